// SPDX-License-Identifier: Apache-2.0
#include "ioci/robot/array_units.h"

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "robotics/coordinates.h"

namespace robomosp::ioci {
namespace {

/// "rad" or "rad, m, rad"; what `named` makes of each unit.
template <class Named>
std::string unit_or_list(std::span<const std::string_view> units, Named&& named) {
  if (units.empty()) return {};
  const bool is_one = std::all_of(units.begin(), units.end(),
                                  [&](std::string_view unit) { return unit == units.front(); });
  if (is_one) return units.front().empty() ? std::string() : named(units.front());
  std::string out;
  for (const std::string_view unit : units) {
    if (!out.empty()) out += ", ";
    out += unit.empty() ? "1" : named(unit);
  }
  return out;
}

/// True where every entry is the value of a revolute joint: the usual arm, answered without
/// allocation.
bool only_turns(const RobotModel& model) {
  return !model.joints.empty() &&
         std::all_of(model.joints.begin(), model.joints.end(), [](const JointModel& joint) {
           return joint.type == JointType::revolute && !joint.is_coupled();
         });
}

std::string as_it_is(std::string_view unit) { return std::string(unit); }

}  // namespace

std::string joint_array_unit(const RobotModel& model) {
  if (only_turns(model)) return "rad";
  return unit_or_list(robotics::coordinate_units(model), as_it_is);
}

std::string joint_array_unit(const model::Robot& robot, bool degrees) {
  return unit_or_list(robotics::coordinate_units(robot), [&](std::string_view unit) {
    return std::string(degrees && unit == "rad" ? "deg" : unit);
  });
}

std::string rate_array_unit(const RobotModel& model, std::string_view per) {
  if (only_turns(model)) return "rad" + std::string(per);
  return unit_or_list(robotics::velocity_units(model),
                      [&](std::string_view unit) { return std::string(unit) + std::string(per); });
}

std::string residual_array_unit(const RobotModel& model) {
  std::vector<std::string_view> units;
  for (const LoopModel& loop : model.loops)
    for (std::uint32_t k = 0; k < 6; ++k)
      if ((loop.fixed >> k & 1U) != 0) units.push_back(k < 3 ? "m" : "rad");
  return unit_or_list(units, as_it_is);
}

std::string force_array_unit(const RobotModel& model) {
  if (only_turns(model)) return "N m";
  return unit_or_list(robotics::velocity_units(model), [](std::string_view unit) {
    return std::string(unit == "rad" ? "N m" : "N");
  });
}

}  // namespace robomosp::ioci
