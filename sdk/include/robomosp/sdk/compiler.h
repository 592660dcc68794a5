// SPDX-License-Identifier: Apache-2.0
// Interface robomosp.compiler/1: program text to three-address code (layer: contract, std only).
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include <robomosp/sdk/params.h>
#include <robomosp/sdk/progress.h>
#include <robomosp/sdk/result.h>

namespace robomosp {

/// A remark or fault at a place of the source text.
struct Diagnostic {
  std::int32_t line = 0, column = 0;  ///< from 1
  bool is_error = true;
  std::string text;  ///< a sentence
};

/// result := operation(left, right); operands are names, literals or labels.
struct CodeLine {
  std::string operation, result, left, right;
  std::int32_t source_line = 0;
};

/// What a compiler makes: the input of every post-processor.
struct ThreeAddressCode {
  std::string program;
  std::vector<CodeLine> lines;
  std::vector<Diagnostic> diagnostics;  ///< empty lines with errors here = not compiled
};

/// Interface robomosp.compiler/1. [any thread]
class Compiler {
 public:
  using Interface = Compiler;
  static constexpr const char* kInterfaceId = "robomosp.compiler/1";
  virtual ~Compiler() = default;
  /// Faults of the text are diagnostics, all of them, not an Error.
  virtual Result<ThreeAddressCode> compile(std::string_view file_name, std::string_view text,
                                           const Params&, Progress&) const = 0;
};

}  // namespace robomosp
