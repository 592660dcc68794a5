// SPDX-License-Identifier: Apache-2.0
#include "spatial/ik_support.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "spatial/pose.h"
#include "spatial/print.h"

namespace robomosp::spatial {
namespace {

constexpr double kTurn = 2 * std::numbers::pi;
/// How far outside a limit rounding may put an angle [rad].
constexpr double kLimitRounding = 1e-10;

Error bad(std::string message, std::string hint) {
  return error(ErrorCode::invalid_argument, std::move(message), std::move(hint));
}

/// From where on targets are brought near, in lengths of the robot.
constexpr double kFar = 100;

double length(const Vec3& v) { return std::hypot(v[0], v[1], v[2]); }

}  // namespace

NearTargets::NearTargets(const RobotModel& model, const IkBatch& batch)
    : asked_(batch.targets), batch_(batch) {
  double reach = 1;
  for (const JointModel& j : model.joints) {
    reach += length(j.placement.p);
    if (j.type == JointType::prismatic && std::isfinite(j.lower) && std::isfinite(j.upper))
      reach += std::max(std::fabs(j.lower), std::fabs(j.upper));
  }
  for (const TipModel& tip : model.tips) reach += length(tip.tool.p);
  const double most = kFar * reach;
  for (std::size_t i = 0; i < asked_.size(); ++i) {
    const Vec3& p = asked_[i].p;
    const double greatest = std::max({std::fabs(p[0]), std::fabs(p[1]), std::fabs(p[2])});
    if (!(greatest > most)) continue;
    if (near_.empty()) near_.assign(asked_.begin(), asked_.end());
    for (std::size_t k = 0; k < 3; ++k) near_[i].p[k] = p[k] / greatest * most;
  }
  if (!near_.empty()) batch_.targets = near_;
}

void NearTargets::correct(std::span<IkResult> results) const {
  if (near_.empty()) return;
  const std::size_t goals = asked_.size() / results.size();
  for (std::size_t i = 0; i < asked_.size(); ++i) {
    const double farther = length(sub(asked_[i].p, near_[i].p));
    const bool counts = batch_.goals.empty() || (batch_.goals[i % goals].parts & kIkPosition) != 0;
    if (!(farther > 0) || !counts) continue;
    IkResult& r = results[i / goals];
    r.status = IkStatus::out_of_reach;
    r.limiting_joint = -1;
    constexpr double kMost = std::numeric_limits<double>::max();
    r.position_error = std::min(r.position_error + farther, kMost);
    r.shortfall = std::min(r.shortfall + farther, kMost);
    r.detail = "the target is out of reach by " + print_number(r.shortfall, 3) + " m";
  }
}

Result<void> check_ik_model(const RobotModel& model) {
  const std::string where = "robot \"" + model.name + "\"";
  if (model.tips.empty())
    return error(ErrorCode::invalid_argument, "it has no tip to place", "Add a tool.", where);
  for (const JointModel& joint : model.joints)
    if (!(joint.lower <= joint.upper) || !is_rigid(joint.placement))
      return error(ErrorCode::invalid_argument,
                   "its limits or its placement are not usable numbers",
                   "Correct the robot's table.")
          .in("joint \"" + joint.name + "\"")
          .in(where);
  return {};
}

Result<void> check_ik_request(const RobotModel& model, const IkBatch& batch, std::size_t results) {
  const std::size_t n = model.coordinate_count(), count = batch.samples();
  if (results != count || (!batch.goals.empty() && batch.targets.size() % batch.goals.size() != 0))
    return bad(std::to_string(results) + " results for " + std::to_string(count) + " targets",
               "Give one result per target.");
  if (!batch.seeds.empty() && batch.seeds.size() != n && batch.seeds.size() != n * count)
    return bad("the seeds have " + std::to_string(batch.seeds.size()) + " values for " +
                   std::to_string(count) + " targets and " + std::to_string(n) + " joints",
               "Give " + std::to_string(n) + " for all targets, " + std::to_string(n * count) +
                   ", or none.");
  if (batch.tip < 0 || static_cast<std::size_t>(batch.tip) >= model.tips.size())
    return bad("there is no tip " + std::to_string(batch.tip),
               "The robot has tips 0 to " + std::to_string(model.tips.size() - 1) + ".");
  for (const IkGoal& g : batch.goals)
    if (g.tip < 0 || static_cast<std::size_t>(g.tip) >= model.tips.size())
      return bad("a goal is for tip " + std::to_string(g.tip) + ", which does not exist",
                 "The robot has tips 0 to " + std::to_string(model.tips.size() - 1) + ".");
  if (!(batch.tolerance.position > 0) || !(batch.tolerance.rotation > 0))
    return bad("a tolerance is not positive", "Give lengths and angles above 0, such as 1e-9.");
  if (!batch.arm_angles.empty() && batch.arm_angles.size() != 1 && batch.arm_angles.size() != count)
    return bad(std::to_string(batch.arm_angles.size()) + " arm angles for " +
                   std::to_string(count) + " targets",
               "Give one for all targets, one per target, or none.");
  for (const double a : batch.arm_angles)
    if (!std::isfinite(a)) return bad("an arm angle is not finite", "Correct it.");
  for (std::size_t i = 0; i < batch.targets.size(); ++i)
    if (!is_rigid(batch.targets[i], 1e-6))
      return bad("target " + std::to_string(i + 1) + " is not a pose",
                 "Its rotation must be orthonormal and all its numbers finite.");
  for (std::size_t i = 0; i < batch.seeds.size(); ++i)
    if (!std::isfinite(batch.seeds[i]))
      return bad("value " + std::to_string(i + 1) + " of the seeds is not finite",
                 "Correct the seed.");
  return {};
}

Result<std::size_t> whole_pose_tip(const IkBatch& batch) {
  const auto refused = [](const char* what) {
    return error(ErrorCode::unsupported, what, "Choose another provider, such as numeric.");
  };
  if (batch.objective != IkObjective::none)
    return refused("a closed form has no freedom left for an objective");
  if (batch.goals.empty()) return static_cast<std::size_t>(batch.tip);
  if (batch.goals.size() != 1 || batch.goals[0].parts != kIkPose)
    return refused("a closed form needs one full pose, not several goals or parts of one");
  return static_cast<std::size_t>(batch.goals[0].tip);
}

void ik_start(const RobotModel& model, const IkBatch& batch, std::size_t sample,
              std::span<double> q) {
  const std::size_t n = q.size();
  const double* seed = batch.seeds.empty()
                           ? nullptr
                           : batch.seeds.data() + (batch.seeds.size() == n ? 0 : sample * n);
  for (const JointModel& j : model.joints) {
    if (j.is_coupled()) continue;
    const auto first = static_cast<std::size_t>(j.q_index);
    const auto count = static_cast<std::size_t>(coordinate_count(j.type));
    if (count == 1) {
      const bool bounded = std::isfinite(j.lower) && std::isfinite(j.upper);
      const double middle = bounded ? 0.5 * (j.lower + j.upper) : 0.0;
      q[first] = std::clamp(seed ? seed[first] : middle, j.lower, j.upper);
      continue;
    }
    for (std::size_t k = 0; k < count; ++k)
      q[first + k] = seed ? seed[first + k] : k + 4 == count ? 1.0 : 0.0;
  }
}

Error ik_stopped() { return error(ErrorCode::cancelled, "inverse kinematics was cancelled"); }
Error ik_not_prepared() {
  return error(ErrorCode::invalid_argument, "the solver was not given a robot",
               "Call prepare first.");
}
Error ik_unknown_arm(const RobotModel& model, std::size_t tip) {
  return error(ErrorCode::unsupported,
               "the tip \"" + model.tips[tip].name + "\" does not belong to an arm it can solve",
               "Choose another provider, such as numeric.");
}

double turn_within(const ArmJoint& joint, double q, double near) {
  const double x = q + kTurn * std::round((near - q) / kTurn);
  const double low = joint.lower - kLimitRounding, high = joint.upper + kLimitRounding;
  double y = x;
  if (y > high) y -= kTurn * std::ceil((y - high) / kTurn);
  if (y < low) y += kTurn * std::ceil((low - y) / kTurn);
  return y >= low && y <= high ? std::clamp(y, joint.lower, joint.upper) : x;
}

double turns_outside(const ArmJoint& joint, double q) {
  const double x = turn_within(joint, q, std::clamp(q, joint.lower, joint.upper));
  if (x >= joint.lower && x <= joint.upper) return 0;
  return x > joint.upper ? std::min(x - joint.upper, std::fabs(joint.lower - (x - kTurn)))
                         : std::min(joint.lower - x, std::fabs(x + kTurn - joint.upper));
}

std::string over_limit(const ArmJoint& joint, double q) {
  const bool above = q > joint.upper;
  // Of the two limits the one that is less far away, a whole turn counted as none.
  if (above && std::fabs(joint.lower - (q - kTurn)) < q - joint.upper) q -= kTurn;
  else if (!above && std::fabs(q + kTurn - joint.upper) < joint.lower - q) q += kTurn;
  return "joint " + std::to_string(joint.joint + 1) + " (\"" + joint.name + "\") would need " +
         print_joint_value(q, JointType::revolute) + "; its limit is " +
         print_joint_value(q > joint.upper ? joint.upper : joint.lower, JointType::revolute);
}

std::vector<std::vector<double>> other_turns(const SerialArm& arm, std::span<const double> q,
                                             std::size_t most) {
  std::vector<std::vector<double>> all{std::vector<double>(q.begin(), q.end())};
  for (std::size_t i = 0; i < arm.size(); ++i) {
    const ArmJoint& j = arm.joints[i];
    if (!std::isfinite(j.lower) || !std::isfinite(j.upper)) continue;
    const std::size_t before = all.size();
    // No more turns than may be returned: limits of 1e300 rad are no reason to count that far.
    const double limit = static_cast<double>(std::min(most, std::size_t{1} << 20));
    const auto first =
        static_cast<int>(std::clamp(std::ceil((j.lower - q[i]) / kTurn), -limit, limit));
    const auto last =
        static_cast<int>(std::clamp(std::floor((j.upper - q[i]) / kTurn), -limit, limit));
    for (int turn = first; turn <= last; ++turn)
      for (std::size_t k = 0; turn != 0 && k < before && all.size() <= most; ++k) {
        all.push_back(all[k]);
        all.back()[i] += turn * kTurn;
      }
  }
  all.erase(all.begin());
  return all;
}

}  // namespace robomosp::spatial
