// SPDX-License-Identifier: Apache-2.0
#include "robotics/joint_limits.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "robotics/coordinates.h"
#include "spatial/print.h"

namespace robomosp::robotics {
namespace {

constexpr double kTurn = 2 * std::numbers::pi;
/// How far outside a limit rounding may put an angle [rad].
constexpr double kRounding = 1e-9;

double beyond(const JointModel& j, double x) { return std::max(j.lower - x, x - j.upper); }

}  // namespace

RobotModel without_limits(const RobotModel& model) {
  RobotModel out = model;
  for (JointModel& j : out.joints) {
    j.lower = -std::numeric_limits<double>::infinity();
    j.upper = std::numeric_limits<double>::infinity();
  }
  return out;
}

std::vector<double> start_configuration(const RobotModel& model) {
  std::vector<double> q = neutral_coordinates(model);
  for (const JointModel& j : model.joints)
    if (coordinate_count(j.type) == 1 && !j.is_coupled() && std::isfinite(j.lower) &&
        std::isfinite(j.upper))
      q[static_cast<std::size_t>(j.q_index)] = 0.5 * (j.lower + j.upper);
  return q;
}

LimitExcess limit_excess(const RobotModel& model, std::span<const double> q, double slack) {
  LimitExcess out;
  for (std::size_t i = 0; i < model.joints.size(); ++i) {
    const JointModel& j = model.joints[i];
    if (coordinate_count(j.type) != 1) continue;
    double x = q[static_cast<std::size_t>(j.q_index)];
    if (j.is_coupled()) x = j.coupling.ratio * x + j.coupling.offset;
    const double by = beyond(j, x);
    if (by > slack && by > out.by)
      out = {static_cast<std::int32_t>(i), by, x, x > j.upper ? j.upper : j.lower};
  }
  return out;
}

void turn_into_limits(const RobotModel& model, std::span<double> q, std::span<const double> near) {
  std::vector<bool> is_followed(q.size());
  for (const JointModel& j : model.joints)
    if (j.is_coupled()) is_followed[static_cast<std::size_t>(j.q_index)] = true;
  for (const JointModel& j : model.joints) {
    const auto at = static_cast<std::size_t>(j.q_index);
    if (j.type != JointType::revolute || j.is_coupled() || is_followed[at]) continue;
    // Beyond this a whole turn is less than what rounding leaves of the number.
    if (!(std::fabs(q[at]) < 1e12)) continue;
    double x = q[at];
    if (at < near.size()) x += kTurn * std::round((near[at] - x) / kTurn);
    if (x > j.upper + kRounding) x -= kTurn * std::ceil((x - j.upper - kRounding) / kTurn);
    if (x < j.lower - kRounding) {
      x += kTurn * std::ceil((j.lower - kRounding - x) / kTurn);
      if (beyond(j, x - kTurn) < beyond(j, x)) x -= kTurn;
    }
    if (beyond(j, x) > 0 && beyond(j, x) <= kRounding) x = std::clamp(x, j.lower, j.upper);
    q[at] = x;
  }
}

std::string excess_words(const RobotModel& model, const LimitExcess& excess) {
  if (excess.joint < 0) return {};
  const JointModel& j = model.joints[static_cast<std::size_t>(excess.joint)];
  return "joint " + std::to_string(excess.joint + 1) + " (\"" + j.name + "\") at " +
         spatial::print_joint_value(excess.value, j.type) + ", " +
         spatial::print_joint_value(excess.by, j.type) + " beyond its limit";
}

}  // namespace robomosp::robotics
