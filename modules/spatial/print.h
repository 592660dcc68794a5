// SPDX-License-Identifier: Apache-2.0
// Numbers for messages, independent of the locale (layer: data processing, spatial).
#pragma once

#include <charconv>
#include <numbers>
#include <string>

#include <robomosp/sdk/robot_model.h>

namespace robomosp::spatial {

/// `value` with at most `digits` significant digits: "0.213", "1e-07", "inf".
[[nodiscard]] inline std::string print_number(double value, int digits = 4) {
  char text[64];
  const auto end =
      std::to_chars(text, text + sizeof text, value, std::chars_format::general, digits).ptr;
  return {text, end};
}
/// An angle in degrees or a length in metres, as people read joint values: "151.2 deg", "0.21 m".
[[nodiscard]] inline std::string print_joint_value(double value, JointType type, int digits = 4) {
  if (type == JointType::revolute)
    return print_number(value * 180 / std::numbers::pi, digits) + " deg";
  return print_number(value, digits) + " m";
}

}  // namespace robomosp::spatial
