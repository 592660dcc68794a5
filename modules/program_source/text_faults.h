// SPDX-License-Identifier: Apache-2.0
// Faults of compilers, readers and posts as data (layer: application,
// program_source).
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <robomosp/sdk/program_code.h>
#include <robomosp/sdk/result.h>

#include "kernel/fault.h"
#include "model/program.h"

namespace robomosp::program_source {

/// The text in which a compiler, reader or post found a fault.
struct FaultyText {
  AnyId record{};                           ///< the program; number 0 = files of no record
  const model::Program* program = nullptr;  ///< its content; null = files of no record
  std::string where{};                      ///< context: `program "weld"`
  std::string provider{};                   ///< the reader or post
  std::string interface_id{};               ///< of the provider
  std::string name{};                       ///< of the record
};
/// What it found. The severity is one of rmp_fault_severity.
struct TextFault {
  std::uint32_t severity = RMP_FAULT_ERROR;
  rmp_span span{};
  std::string file{};  ///< name of span.file
  std::string message{}, hint{};
};
/// The fault with file, line and columns, and the path of the line in the program. A hint of the
/// compiler that names the word that was meant becomes a remedy, not tried yet.
[[nodiscard]] Fault text_fault(const char* code, const FaultyText&, const TextFault&);

/// The faults of compiled source, with the code program.syntax.
[[nodiscard]] std::vector<Fault> source_faults(const FaultyText&, const rmp_code&);

/// The path of a line of a program's file; "" = the record has no such line.
[[nodiscard]] std::string line_path(const model::Program&, std::string_view file,
                                    std::uint32_t line);

/// `e` with these faults, of which there is at least one; its text stays.
[[nodiscard]] Error with_faults(Error e, const std::vector<Fault>& faults);

}  // namespace robomosp::program_source
