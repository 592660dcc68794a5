// SPDX-License-Identifier: Apache-2.0
// Source of the Industrial Robot Language, written by the program: numbers, poses, names, lines
// (layer: data processing,
// program_source).
#pragma once

#include <array>
#include <map>
#include <numbers>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <robomosp/sdk/result.h>
#include <robomosp/sdk/types.h>

namespace robomosp::program_source {

/// IRL is in degrees and millimetres, everything else in radians and metres.
inline constexpr double kDegreesPerRadian = 180 / std::numbers::pi, kMm = 1e3;

/// A REAL as the language writes it, to a billionth: "120.0", "-0.5", "1.0e+300".
[[nodiscard]] std::string irl_real(double value);
/// `POSITION(x, y, z)` of a point in metres, in mm.
[[nodiscard]] std::string irl_position(const Vec3&);
/// `ORIZYX(a, b, c)` of a rotation matrix, row-major, in degrees.
[[nodiscard]] std::string irl_orientation(const std::array<double, 9>&);
/// `POSE(POSITION(x, y, z), ORIZYX(a, b, c))` of a pose in metres, in mm and degrees.
[[nodiscard]] std::string irl_pose(const Pose& pose);
/// A STRING of a text; line ends become blanks, which the language has no sign for.
[[nodiscard]] std::string irl_string(std::string_view text);
/// A comment of a text; its braces become brackets.
[[nodiscard]] std::string irl_comment(std::string_view text);

/// Names of a program: letters, digits and _, none twice in any letter case, none reserved.
class IrlNames {
 public:
  /// A name for `wanted`, the same one for the same `key`.
  const std::string& name(const std::string& key, std::string_view wanted);

 private:
  std::map<std::string, std::string> by_key_;
  std::set<std::string> taken_;  ///< in lower case
};

/// What a condition of a task may name, as the program has it.
struct IrlSignal {
  std::string name;  ///< in the program
  bool is_bool = false;
};
/// An expression over signals (docs/user/tasks.md), in IRL and in SI units. What the language
/// cannot say is an error: places and rates of members, the time, units of angles in functions.
[[nodiscard]] Result<std::string> irl_expression(const std::string& expression,
                                                 const std::map<std::string, IrlSignal>& signals);

/// Lines with their indentation.
class IrlLines {
 public:
  void add(std::string_view line) {
    text_ += std::string(static_cast<std::size_t>(2 * depth_), ' ') + std::string(line) + "\n";
  }
  void in() { ++depth_; }
  void out() { --depth_; }
  [[nodiscard]] const std::string& text() const { return text_; }

 private:
  std::string text_;
  int depth_ = 0;
};

/// A cell for a robot of so many joints: types MAIN_JOINT, ADD_JOINT, JOINT and ROBTARGET. "" where
/// the language's own cell, of six axes, is one.
[[nodiscard]] std::string irl_cell(std::size_t joints);

}  // namespace robomosp::program_source
