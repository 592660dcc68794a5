// SPDX-License-Identifier: Apache-2.0
// Interface robomosp.program_reader/1: a program of a controller to source in IRL (layer:
// contract, std only).
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <robomosp/sdk/language.h>
#include <robomosp/sdk/params.h>
#include <robomosp/sdk/program_code.h>
#include <robomosp/sdk/progress.h>
#include <robomosp/sdk/result.h>
#include <robomosp/sdk/types.h>

namespace robomosp {

/// An extension that a reader takes, and its controller. Constant data.
struct ReaderFormat {
  const char* extension = "";   ///< lower-case, without dot: "src"
  const char* controller = "";  ///< what people call it: "KUKA KRL"
};

/// What is read. Made by the host; may gain fields at the end.
struct ProgramReaderTask {
  std::uint32_t struct_size = sizeof(ProgramReaderTask);  ///< see plugin.h
  /// The program first, then whatever it may name. A reader opens no files.
  std::span<const SourceFile> files;
};

/// A file of IRL that a reader made. The texts stay as long as the object that refers to them.
struct ReadFile {
  std::string_view name;  ///< without folders: "weld.irl"; the first file is the program
  std::string_view text;
  Room room{};
};

/// Where a line of IRL comes from: lines of both count from 1. Lines of our own, such as
/// declarations that a controller does not need, are in no row.
struct ReadLine {
  std::uint32_t irl_file = 0, irl_line = 1;  ///< of the files that were made
  std::uint32_t file = 0, line = 1;          ///< of the files that were read
};

/// What a reader made of a program; constant from when it is made. [any thread]
class ReadProgram {
 public:
  virtual ~ReadProgram() = default;
  /// What later versions of the SDK add, by its id (plugin.h); nullptr = not known.
  [[nodiscard]] virtual const void* extension(const char* /*id*/) const { return nullptr; }
  /// The program, then what it names, such as its cell. All of these stay as long as this object.
  [[nodiscard]] virtual std::span<const ReadFile> files() const = 0;
  /// What IRL does not say of the source, with places in the files that were read. An error: the
  /// program means something else without it. A warning: it moves and switches as before.
  [[nodiscard]] virtual std::span<const rmp_code_fault> faults() const = 0;
  /// In order of the lines of IRL.
  [[nodiscard]] virtual std::span<const ReadLine> lines() const = 0;
};

/// Interface robomosp.program_reader/1. [any thread]
class ProgramReader {
 public:
  using Interface = ProgramReader;
  static constexpr const char* kInterfaceId = "robomosp.program_reader/1";
  virtual ~ProgramReader() = default;
  /// What later versions of the SDK add, by its id (plugin.h); nullptr = not known.
  [[nodiscard]] virtual const void* extension(const char* /*id*/) const { return nullptr; }
  /// Stays as long as this object.
  [[nodiscard]] virtual std::span<const ReaderFormat> formats() const = 0;
  /// How sure it is that a text is of its language, where several readers take an extension: 0 it
  /// is not, 1 by its name only, 2 words of the language are there.
  [[nodiscard]] virtual std::int32_t claims(const SourceFile&) const = 0;
  /// Names of the files that belong to a source and may be beside it. Letter case does not count:
  /// controllers ignore it. "System/$config.dat" is also looked for in a folder of this name beside
  /// the source and beside the folders above it, the nearest first.
  virtual Result<std::vector<std::string>> needs(const SourceFile&) const = 0;
  /// A program, whatever is wrong with it. Nothing is dropped without a fault at its place. An
  /// error is what keeps the reader itself from its work, such as being cancelled.
  virtual Result<std::unique_ptr<ReadProgram>> read(const ProgramReaderTask&, const Params&,
                                                    Progress&) const = 0;
};

}  // namespace robomosp
