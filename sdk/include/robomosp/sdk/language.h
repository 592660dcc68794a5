// SPDX-License-Identifier: Apache-2.0
// Interface robomosp.language/1: the source of a robot's program to a typed program and to
// three-address code (layer: contract, std only).
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <robomosp/sdk/params.h>
#include <robomosp/sdk/program_code.h>
#include <robomosp/sdk/progress.h>
#include <robomosp/sdk/result.h>
#include <robomosp/sdk/types.h>

namespace robomosp {

/// A file of a program's source. The texts stay where they are while the compiler runs.
struct SourceFile {
  std::string_view name;  ///< without folders: "towers.irl"
  std::string_view text;
  Room room{};
};

/// A value that a variable or constant of the program begins with, in place of what its declaration
/// has: of a point that follows an object. A compiler that supports them returns non-null from
/// Language::extension(kGivenValues); to others none are given.
struct GivenValue {
  std::string_view name;   ///< as the program declares it, behind VAR or CONST; letter case aside
  std::string_view field;  ///< of a record that its declaration makes: "PSE"; "" = the whole
  std::string_view text;   ///< an expression of the language
  Room room{};
};
inline constexpr const char* kGivenValues = "robomosp.given_values/1";

/// What is compiled. Made by the host; may gain fields at the end.
struct LanguageTask {
  std::uint32_t struct_size = sizeof(LanguageTask);  ///< see plugin.h
  /// The program first, then whatever it may name: cells, modules, lists of data. A compiler opens
  /// no files.
  std::span<const SourceFile> files;
  /// Each name and field once. What does not fit the program is a fault of it.
  std::span<const GivenValue> values{};
};

/// A compiled program, which owns its tables; constant from when it is made. [any thread]
class CompiledProgram {
 public:
  virtual ~CompiledProgram() = default;
  /// What later versions of the SDK add, by its id (plugin.h); nullptr = not known.
  [[nodiscard]] virtual const void* extension(const char* /*id*/) const { return nullptr; }
  /// Stays as long as this object.
  [[nodiscard]] virtual const rmp_code& code() const = 0;
};

/// Interface robomosp.language/1. [any thread]
class Language {
 public:
  using Interface = Language;
  static constexpr const char* kInterfaceId = "robomosp.language/1";
  virtual ~Language() = default;
  /// What later versions of the SDK add, by its id (plugin.h); nullptr = not known.
  [[nodiscard]] virtual const void* extension(const char* /*id*/) const { return nullptr; }
  /// Lower-case extensions of its programs without dot, comma-separated.
  [[nodiscard]] virtual std::string_view extensions() const = 0;
  /// Names of the files that a source names: its cell, modules, lists of data, with extensions.
  virtual Result<std::vector<std::string>> needs(const SourceFile&) const = 0;
  /// A program, whatever is wrong with it: faults are among its tables, as many as were found. An
  /// error is what keeps the compiler itself from its work, such as being cancelled.
  virtual Result<std::unique_ptr<CompiledProgram>> compile(const LanguageTask&, const Params&,
                                                           Progress&) const = 0;
};

}  // namespace robomosp
