// SPDX-License-Identifier: Apache-2.0
#include "task.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace robomosp::joint_motion {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
/// Joint values this much beyond a limit are at it, and vectors this close are the same.
constexpr double kSame = 1e-12;

/// The robot's limits, lowered by a parameter of one value or one a joint.
Result<std::vector<double>> limits_of(std::span<const double> robot, const Params& params,
                                      const char* name, std::size_t dof) {
  if (!robot.empty() && robot.size() != dof)
    return bad(std::to_string(robot.size()) + " " + name + " limits are given for " +
                   std::to_string(dof) + " joints",
               "Give one per joint.");
  std::vector<double> out(dof, kInfinity);
  std::copy(robot.begin(), robot.end(), out.begin());
  const auto given = params.reals(name);
  if (!given.empty() && given.size() != 1 && given.size() != dof)
    return bad(std::string(name) + " has " + std::to_string(given.size()) + " values for " +
                   std::to_string(dof) + " joints",
               "Give one for all, or one per joint.");
  for (std::size_t j = 0; j < dof; ++j) {
    if (!given.empty()) out[j] = std::min(out[j], given[given.size() == 1 ? 0 : j]);
    if (!(out[j] > 0))
      return bad(
          "the " + std::string(name) + " limit of " + joint_name(j) + " is " + print_number(out[j]),
          "It must be above 0.");
  }
  return out;
}

}  // namespace

Error bad(std::string message, std::string hint) {
  return error(ErrorCode::invalid_argument, std::move(message), std::move(hint));
}

Result<Task> read_task(std::size_t dof, std::span<const double> points, const JointLimits& limits,
                       const Params& params, std::size_t least) {
  if (dof == 0) return bad("the robot has no joints", "Use another robot.");
  if (points.size() % dof != 0)
    return bad(std::to_string(points.size()) + " joint values are given for " +
                   std::to_string(dof) + " joints",
               "Give whole joint vectors.");
  Task t;
  t.dof = dof;
  t.count = points.size() / dof;
  if (t.count < least)
    return bad("a joint motion needs " + std::to_string(least) + " joint vectors or more, " +
                   std::to_string(t.count) + (t.count == 1 ? " was given" : " were given"),
               "Add joint vectors.");
  t.q.assign(points.begin(), points.end());
  t.lower.assign(dof, -kInfinity);
  t.upper.assign(dof, kInfinity);
  if (limits.lower.size() == dof) std::copy_n(limits.lower.begin(), dof, t.lower.begin());
  if (limits.upper.size() == dof) std::copy_n(limits.upper.begin(), dof, t.upper.begin());
  for (std::size_t i = 0; i < t.q.size(); ++i) {
    const std::size_t j = i % dof;
    const std::string where = joint_name(j) + " of joint vector " + std::to_string(i / dof + 1);
    if (!std::isfinite(t.q[i])) return bad(where + " is not a number", "Check the vector.");
    if (t.q[i] < t.lower[j] - kSame || t.q[i] > t.upper[j] + kSame)
      return bad(where + " is " + print_number(t.q[i], 6) + ", outside its limits " +
                     print_number(t.lower[j], 6) + " to " + print_number(t.upper[j], 6),
                 "Move it inside.");
  }
  RMP_TRY_ASSIGN(t.velocity, limits_of(limits.velocity, params, "velocity", dof));
  RMP_TRY_ASSIGN(t.acceleration, limits_of(limits.acceleration, params, "acceleration", dof));
  RMP_TRY_ASSIGN(t.jerk, limits_of(limits.jerk, params, "jerk", dof));
  const double share = params.real("speed_share");
  if (!(share > 0 && share <= 1))
    return bad("speed_share is " + print_number(share), "It must be above 0 and at most 1.");
  for (double& v : t.velocity) v *= share;
  return t;
}

Result<void> check_apart(const Task& t) {
  for (std::size_t i = 1; i < t.count; ++i) {
    double most = 0;
    for (std::size_t j = 0; j < t.dof; ++j)
      most = std::max(most, std::fabs(t.at(i, j) - t.at(i - 1, j)));
    if (!(most > kSame))
      return bad(
          "joint vectors " + std::to_string(i) + " and " + std::to_string(i + 1) + " are the same",
          "Remove one of them.");
  }
  return {};
}

Result<std::vector<double>> end_values(std::span<const double> given, const Task& t,
                                       const char* what) {
  std::vector<double> out(t.dof, 0.0);
  if (given.empty()) return out;
  if (given.size() != t.dof)
    return bad("the " + std::string(what) + " has " + std::to_string(given.size()) +
                   " values for " + std::to_string(t.dof) + " joints",
               "Give one per joint.");
  for (std::size_t j = 0; j < t.dof; ++j) {
    if (!std::isfinite(given[j]))
      return bad("the " + std::string(what) + " of " + joint_name(j) + " is not a number",
                 "Check it.");
    out[j] = given[j];
  }
  return out;
}

std::span<const double> end_or(std::span<const double> asked, const Params& params,
                               const char* name) {
  return asked.empty() ? params.reals(name) : asked;
}

Result<void> need(const std::vector<double>& limits, const char* what, std::size_t joint,
                  const char* parameter) {
  if (std::isfinite(limits[joint])) return {};
  return bad(joint_name(joint) + " has no " + what + " limit",
             "Give the robot one, or the parameter " + std::string(parameter) + ".");
}

Result<void> JointwiseSegment::sample(std::span<const double> times,
                                      const JointSamples& out) const {
  // Times this share of the duration beyond an end are that end: callers reach it by sums.
  const double slack = 1e-12 * duration_;
  for (std::size_t i = 0; i < times.size(); ++i) {
    const bool is_moving = times[i] >= -slack && times[i] <= duration_ + slack;
    const double t = std::clamp(times[i], 0.0, duration_);
    for (std::size_t j = 0, k = i * dof_; j < dof_; ++j, ++k) {
      Motion1 m = at(j, t);
      if (!is_moving) m.v = m.a = m.j = 0;
      if (!out.q.empty()) out.q[k] = m.x;
      if (!out.qd.empty()) out.qd[k] = m.v;
      if (!out.qdd.empty()) out.qdd[k] = m.a;
      if (!out.qddd.empty()) out.qddd[k] = m.j;
    }
  }
  return {};
}

}  // namespace robomosp::joint_motion
