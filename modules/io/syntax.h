// SPDX-License-Identifier: Apache-2.0
// Syntax of the native files: text to a flat list of fields with positions; independent of record
// kinds (layer: application). Internal to modules/io. Grammar: docs/user/files.md.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include <robomosp/sdk/result.h>

namespace robomosp::io {

inline constexpr int kVersion = 1;  ///< of the grammar

/// A number as written; its conversion needs the dimension.
struct Number {
  std::string_view text, unit;    ///< "20", "mm"; unit may be empty
  std::uint32_t offset = 0;       ///< bytes from the start of the file
  std::string_view expression{};  ///< inside of the quotes: 20 mm = "bore"; `text` may be empty
  std::uint32_t expression_offset = 0;
};

enum class Argument : std::uint8_t { none, number, word, string, tuple };

/// `name argument (values) { fields }`; values may follow only a word or text, and further tuples
/// only a tuple, of equal length; argument or block may be absent, not both.
struct Field {
  std::string_view name;
  std::string_view text;  ///< word, or inside of the quotes as written
  Argument argument = Argument::none;
  std::string_view remark{};  ///< inside of the quotes: parameter bore 20 mm "remark"
  bool has_values = false;    ///< numbers in parentheses, or of a parameter one, behind a word
  bool has_block = false;
  std::uint32_t offset = 0, argument_offset = 0;
  std::uint32_t first_number = 0, numbers = 0;  ///< in Syntax::numbers
  std::uint32_t tuples = 0;  ///< of an argument that is a tuple; they share `numbers`
  std::int32_t parent = -1;  ///< index of the enclosing field, -1 = file
  std::uint32_t end = 0;     ///< index after its last inner field
};

/// A file's fields in order of appearance (enclosing before enclosed). Views point into `text`.
struct Syntax {
  std::string file;  ///< as shown in messages
  std::string_view text;
  std::string kind;  ///< of the first line, not checked
  std::uint32_t kind_offset = 0;
  std::vector<Field> fields;
  std::vector<Number> numbers;

  /// An error at a place of the file: where = "file:line:column".
  [[nodiscard]] Error at(std::uint32_t offset, ErrorCode code, std::string message,
                         std::string hint = {}) const;
  [[nodiscard]] std::string place(std::uint32_t offset) const;  ///< "file:line:column"
};

/// Parses; `text` must outlive the result. No recursion: any depth of blocks.
[[nodiscard]] Result<Syntax> parse(std::string file, std::string_view text);

/// The string inside the quotes, escapes resolved.
[[nodiscard]] std::string unescape(std::string_view inside);
/// True if a word needs no quotes: a letter or _, then letters, digits, _ - .
[[nodiscard]] bool is_word(std::string_view s);

}  // namespace robomosp::io
