// SPDX-License-Identifier: Apache-2.0
// A parsed pack: filled by template_reader.cpp, used by templates.cpp (layer: data processing,
// program_post; for these two files only).
#pragma once

#include <algorithm>
#include <cstdint>
#include <deque>
#include <functional>
#include <initializer_list>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <robomosp/sdk/post_writer.h>

#include "program_post/templates.h"

namespace robomosp::program_post {

struct Filter {
  std::string name;
  double by = 0;
};
/// Text, or a variable with its filters.
struct Piece {
  std::string text;
  bool is_variable = false;
  std::vector<Filter> filters;
};
struct TemplateLine {
  std::string condition;  ///< a variable that is not empty, 0 or FALSE; "" = always
  bool is_not = false;
  std::vector<Piece> pieces;
};
using Template = std::vector<TemplateLine>;

class TemplatePack {
 public:
  std::string name, title, extensions, reserved;
  PostCapabilities caps;
  post::Orientation orientation = post::Orientation::zyx;
  int digits = 3, indent = 2;
  std::string separator = ", ", between_values = ", ", text_sign = "\"", true_word = "TRUE",
              false_word = "FALSE";
  double length = 1, angle = 1;  ///< units of a mm and of a degree
  std::string angles = "abc";    ///< written angles of an orientation
  std::map<std::string, Template, std::less<>> templates;
  std::vector<post::Operator> operators;
  /// Operators written by a line with {{a}} and {{b}}, with their precedence.
  std::map<std::uint32_t, std::pair<TemplateLine, int>> patterns;
  std::deque<std::string> spellings;
  enum class Points { before, behind, file } points = Points::before;
  TemplateLine file_name, points_file;
  int first_number = 0, number_step = 0;  ///< of lines; a step of 0 = no line numbers
  TemplateLine line_number;
  bool are_points_numbered = true;
  int longest_line = 0;  ///< bytes; 0 = any
  // Names: allowed characters besides letters and digits; the first replaces all others.
  std::string name_signs = "_";
  bool have_names_digits = true;
  // Numbers: of all of them the sign, of REAL values in expressions the form.
  char decimal_sign = '.';
  bool has_exponents = true, has_real_point = true;
  int real_digits = -1;  ///< most digits after the point; negative = as many as needed
  /// How `text_sign` is escaped in a text.
  enum class Quotes { refused, doubled, backslash } quotes = Quotes::refused;
  [[nodiscard]] const Template* find(std::string_view construct) const {
    const auto it = templates.find(construct);
    return it == templates.end() ? nullptr : &it->second;
  }
};

/// True if a construct is lost when its template writes no line, which must be reported.
[[nodiscard]] bool must_say(std::string_view construct);
/// True if a template writes or tests one of these variables.
[[nodiscard]] inline bool uses(const Template* t,
                               std::initializer_list<std::string_view> variables) {
  if (!t) return false;
  const auto is_one = [&](std::string_view name) {
    return std::find(variables.begin(), variables.end(), name) != variables.end();
  };
  for (const TemplateLine& l : *t) {
    if (!l.condition.empty() && is_one(l.condition)) return true;
    for (const Piece& p : l.pieces)
      if (p.is_variable && is_one(p.text)) return true;
  }
  return false;
}

/// The number of a joint's variable: 3 for "q3" if `kind` is 'q'; 0 = it is not one.
[[nodiscard]] inline std::size_t joint_number(std::string_view variable, char kind) {
  if (variable.size() < 2 || variable.size() > 4 || variable[0] != kind) return 0;
  std::size_t n = 0;
  for (const char c : variable.substr(1)) {
    if (c < '0' || c > '9') return 0;
    n = 10 * n + static_cast<std::size_t>(c - '0');
  }
  return n;
}

/// A text within `text_sign`, escaped as the pack defines; unchanged if `quotes` is refused.
[[nodiscard]] std::string within_signs(const TemplatePack&, std::string_view text);

/// Names of a pack: with its characters, case and length, no reserved words, unique. Equal calls in
/// equal order give equal names.
class PackNames {
 public:
  explicit PackNames(const TemplatePack&);
  /// The name of `key`, built from `wish` at the first call.
  const std::string& of(std::uint64_t key, std::string_view wish);
  std::string unique(std::string_view wish);

 private:
  [[nodiscard]] std::string folded(std::string_view) const;
  [[nodiscard]] std::string tail(std::uint64_t) const;
  const TemplatePack& pack_;
  std::map<std::uint64_t, std::string> names_;
  std::set<std::string, std::less<>> used_;
  std::map<std::string, std::uint64_t> numbers_;  ///< by name: the last number appended to it
};

/// Filters that give a text a fixed length, or change its letters; all others need a number.
[[nodiscard]] constexpr bool is_of_text(std::string_view filter) {
  return filter == "upper" || filter == "lower" || filter == "pad" || filter == "left" ||
         filter == "zeros" || filter == "first";
}

}  // namespace robomosp::program_post
