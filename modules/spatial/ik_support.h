// SPDX-License-Identifier: Apache-2.0
// Shared by all closed-form providers of robomosp.ik/1: checks of a request, seeds, whole turns
// within limits, and messages (layer: data processing, spatial).
#pragma once

#include <algorithm>
#include <optional>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include <robomosp/sdk/ik.h>

#include "spatial/serial_arm.h"

namespace robomosp::spatial {

/// Checks tips, limits and placements for closed forms; an error names robot and joint.
[[nodiscard]] Result<void> check_ik_model(const RobotModel& model);

/// Checks sizes, numbers and poses of a request; an error describes the fault.
[[nodiscard]] Result<void> check_ik_request(const RobotModel& model, const IkBatch& batch,
                                            std::size_t results);

/// The tip of a request for one whole pose, without objectives for redundancy; else an error of
/// code unsupported.
[[nodiscard]] Result<std::size_t> whole_pose_tip(const IkBatch& batch);

/// The seed of a sample within the limits; without one the middle of the limits. `q` has
/// RobotModel::coordinate_count() entries.
void ik_start(const RobotModel& model, const IkBatch& batch, std::size_t sample,
              std::span<double> q);

/// The equivalent of angle q within the limits nearest to `near`, clamped against rounding; else
/// the one nearest to `near`.
[[nodiscard]] double turn_within(const ArmJoint& joint, double q, double near);
/// Distance of an angle from its limits, modulo whole turns [rad]; 0 = inside.
[[nodiscard]] double turns_outside(const ArmJoint& joint, double q);

/// `joint 2 ("elbow") would need 68.75 deg; its limit is 57.3 deg`.
[[nodiscard]] std::string over_limit(const ArmJoint& joint, double q);

/// All solutions q plus whole turns of the joints that have two finite limits, within these,
/// excluding q itself; at most `most`.
[[nodiscard]] std::vector<std::vector<double>> other_turns(const SerialArm& arm,
                                                           std::span<const double> q,
                                                           std::size_t most);

/// The arms of all tips for which `recognise(model, tip)` returns one; if it returns none, the
/// error of the first tip.
template <class Recognise>
auto recognise_tips(const RobotModel& model, const Recognise& recognise)
    -> Result<std::vector<std::optional<std::decay_t<decltype(*recognise(model, 0))>>>> {
  std::vector<std::optional<std::decay_t<decltype(*recognise(model, 0))>>> tips(model.tips.size());
  std::optional<Error> refusal;
  bool any = false;
  for (std::size_t i = 0; i < tips.size(); ++i) {
    auto arm = recognise(model, i);
    any = any || arm.ok();
    if (arm.ok()) tips[i] = std::move(*arm);
    else if (!refusal) refusal = std::move(arm).error().in("robot \"" + model.name + "\"");
  }
  if (!any) return *refusal;
  return tips;
}

/// A request with positions too far away for computation (the square of 1e200 is not finite), moved
/// nearer: onto the same ray from the base, a hundred lengths of the robot away. The closest
/// configuration is the same to a hundredth of a radian. Must not outlive its batch.
class NearTargets {
 public:
  NearTargets(const RobotModel& model, const IkBatch& batch);
  NearTargets(const NearTargets&) = delete;
  NearTargets& operator=(const NearTargets&) = delete;
  /// The request to solve.
  [[nodiscard]] const IkBatch& batch() const { return batch_; }
  /// Corrects the distances in the results.
  void correct(std::span<IkResult> results) const;

 private:
  std::span<const Pose> asked_;
  std::vector<Pose> near_;  ///< empty if no target is far
  IkBatch batch_;
};

/// Errors of a call before prepare, and for a tip left out by recognise_tips().
[[nodiscard]] Error ik_not_prepared();
[[nodiscard]] Error ik_unknown_arm(const RobotModel& model, std::size_t tip);

/// Error of a cancelled call.
[[nodiscard]] Error ik_stopped();

/// Calls work(first, count) for all samples, `together` at a time, and checks for cancellation.
template <class Work>
Result<void> for_ik_samples(std::size_t samples, std::size_t together, Progress& progress,
                            const Work& work) {
  constexpr std::size_t kReportEvery = 16;
  for (std::size_t i = 0; i < samples; i += together) {
    if (i % kReportEvery == 0) {
      if (progress.cancelled()) return ik_stopped();
      progress.report(static_cast<double>(i) / static_cast<double>(samples), "inverse kinematics");
    }
    work(i, std::min(together, samples - i));
  }
  return {};
}

}  // namespace robomosp::spatial
