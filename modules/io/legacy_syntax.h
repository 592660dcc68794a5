// SPDX-License-Identifier: Apache-2.0
// Words, numbers and frames of the text files of ROBOMOSP 1.4 (2006) (layer: application).
// Internal to modules/io. Format: docs/user/files-2006.md.
#pragma once

#include <cstdint>
#include <initializer_list>
#include <numbers>
#include <string>
#include <string_view>
#include <vector>

#include <robomosp/sdk/result.h>

#include "io/syntax.h"
#include "model/placement.h"

namespace robomosp::io {

/// Degrees to radians: the files of 2006 are in degrees.
inline constexpr double kDegree = std::numbers::pi / 180;

/// Whether a text is one of that program: its first item is a text in quotes, or a brace, a text
/// and a number (native files begin with the word robomosp, and no other format we know begins so).
[[nodiscard]] bool is_legacy(std::string_view text);
/// The same text in UTF-8; those files are Latin-1 when they are not UTF-8 already.
[[nodiscard]] std::string to_utf8(std::string_view bytes);

/// Reads one item after the other; every fault is an error at its place in the file.
class LegacyReader {
 public:
  /// `syntax.file` and `syntax.text` must outlive the reader.
  explicit LegacyReader(const Syntax& syntax) : s_(syntax) {}
  /// Reads on from an offset() asked for before.
  void go_to(std::uint32_t offset) { at_ = offset; }

  /// Skips blanks and comments; '"' for a text, '0' for a number, 'a' for a word, else the
  /// character itself; '\0' at the end.
  [[nodiscard]] char next();
  [[nodiscard]] std::uint32_t offset();  ///< of the next item
  Result<std::string> text(const char* what);
  Result<double> number(const char* what);
  Result<std::int64_t> whole(const char* what);
  Result<std::string_view> word(const char* what);
  Result<void> expect(char c, const char* what);
  [[nodiscard]] bool accept(char c);  ///< takes it when it is next
  /// `( a, b, ... )`; separated by commas or blanks.
  Result<std::vector<double>> tuple(const char* what);

  /// A frame `( p1, p2, p3, o1, o2, o3 ) ptype otype rtype` in metres and radians.
  struct Frame {
    model::Placement placement;
    bool is_global = false;
  };
  Result<Frame> frame(const char* what);
  /// A line of unit codes. Lengths that follow are in that unit: frame() converts them, and
  /// metres() does for others. Masses of these files are not read, so their unit changes nothing;
  /// of angles only 0, degrees, is known.
  enum class Unit : std::uint8_t { length, mass, angle };
  Result<void> units(std::initializer_list<Unit> kinds);
  /// A length, speed or acceleration as written [unit of the file] in metres.
  [[nodiscard]] double metres(double written) const { return written * metre_; }

  [[nodiscard]] Error at(std::uint32_t offset, std::string message, std::string hint = {}) const {
    return s_.at(offset, ErrorCode::syntax, std::move(message), std::move(hint));
  }

 private:
  [[nodiscard]] Error unexpected(const char* wanted);

  const Syntax& s_;
  std::uint32_t at_ = 0;
  double metre_ = 1;  ///< of the unit of length
};

}  // namespace robomosp::io
