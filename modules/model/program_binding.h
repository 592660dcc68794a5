// SPDX-License-Identifier: Apache-2.0
// Bindings of a program's names in worlds (layer: data processing, model). SI and radians.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "model/fields.h"

namespace robomosp::model {

/// Meaning of a program's name in a world.
enum class BindingKind : std::uint8_t {
  robot,   ///< its robot is that of the world
  signal,  ///< its signal is that of the world
  grip,    ///< its output, or additional joint, grips and releases
  joint,   ///< its additional joint is a joint of a robot or mechanism of the world
  free,    ///< its signal is separate: an input has a value, an output has no reader
  point,   ///< its variable is a point on an object or frame of the world
  value,   ///< its variable is an expression over parameters of an object or of the world
  task,    ///< its output starts a task of the world, its input reports its end
};
/// True if such a binding sets the initial value of a variable.
[[nodiscard]] constexpr bool gives_value(BindingKind k) {
  return k == BindingKind::point || k == BindingKind::value;
}
/// Their words in files and commands, in order of BindingKind.
inline constexpr std::array<std::string_view, 8> kBindingWords{"robot", "signal", "grip",  "joint",
                                                               "free",  "point",  "value", "task"};
constexpr std::span<const std::string_view> words(Of<BindingKind>) { return kBindingWords; }
[[nodiscard]] constexpr std::string_view to_string(BindingKind k) {
  return kBindingWords[static_cast<std::size_t>(k)];
}

struct ProgramBinding {
  BindingKind kind = BindingKind::signal;
  std::string name;  ///< in the program; of an additional joint its number; "" = its own robot
  std::string
      to;  ///< in the world: robot, signal, task; the object that a grip takes, "" = the nearest;
           ///< the object or frame that a point is on; of a value "" = the world itself
  std::string frame;  ///< robot: frame or object of the world for base targets; "" = its base
  std::string tool;   ///< robot, grip: link, tool or centre point; "" = the robot's tool
  std::string joint;  ///< joint: its name or number; grip: the gripping robot, "" = the program's
                      ///< robot
  double reach = 0;   ///< grip: objects farther from the tool are ignored [m]; 0 = 5 mm
  double value = 0;   ///< free: of an input
  std::string at;     ///< point: centre point, part, node or feature of the object; "" = its frame
  /// point: offset from `at`, along its axes; expressions, "" = 0
  std::string x, y, z, roll, pitch, yaw;
  std::string expression;  ///< value
};
template <class V>
constexpr void fields(V& v, Of<ProgramBinding>) {
  v("kind", &ProgramBinding::kind).needed().doc("Kind of the binding.");
  v("name", &ProgramBinding::name)
      .doc(
          "Name in the program; for an additional joint its number; empty is the program's robot.");
  v("to", &ProgramBinding::to)
      .doc(
          "Robot, signal or task of the world; for a grip the object that it takes, empty is the "
          "nearest; the object or frame of a point; the object with the parameters of a value, "
          "empty is the world.");
  v("frame", &ProgramBinding::frame)
      .doc(
          "Frame or object of the world in which the robot's targets are given; empty is its "
          "base.");
  v("tool", &ProgramBinding::tool)
      .doc("Link, tool or tool centre point for targets, or for a grip.");
  v("joint", &ProgramBinding::joint)
      .doc("Joint of the robot or mechanism: name or number; for a grip or point its robot.");
  v("reach", &ProgramBinding::reach)
      .unit("m")
      .at_least(0)
      .doc("A grip takes nothing farther from its tool; 0 is 5 mm.");
  v("value", &ProgramBinding::value).doc("Value of a free input.");
  v("at", &ProgramBinding::at)
      .doc(
          "Of a point: centre point or part of the object, node of the solid, or a feature by "
          "description or number; empty is its frame.");
  v("x", &ProgramBinding::x).doc("Of a point: offset from there, an expression [m]; empty is 0.");
  v("y", &ProgramBinding::y).doc("The same along y.");
  v("z", &ProgramBinding::z).doc("The same along z.");
  v("roll", &ProgramBinding::roll)
      .doc(
          "Of a point: rotation Rz(yaw) Ry(pitch) Rx(roll) there, an expression [rad]; empty is "
          "0.");
  v("pitch", &ProgramBinding::pitch).doc("The same for the pitch.");
  v("yaw", &ProgramBinding::yaw).doc("The same for the yaw.");
  v("expression", &ProgramBinding::expression)
      .doc("Expression of a value, over parameters of the object, or of worlds.");
}

}  // namespace robomosp::model
