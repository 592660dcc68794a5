// SPDX-License-Identifier: Apache-2.0
// What every closed-form provider of robomosp.ik/1 needs around its formulas: checks of a request,
// seeds, whole turns within limits, and sentences (layer: data processing, spatial).
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

/// Tips, limits and placements that formulas can take; an error names robot and joint.
[[nodiscard]] Result<void> check_ik_model(const RobotModel& model);

/// Sizes, numbers and poses of a request; an error says what is wrong with it.
[[nodiscard]] Result<void> check_ik_request(const RobotModel& model, const IkBatch& batch,
                                            std::size_t results);

/// The tip of a request that wants one whole pose and nothing of a redundant arm's freedom; else
/// an error of code unsupported.
[[nodiscard]] Result<std::size_t> whole_pose_tip(const IkBatch& batch);

/// The seed of a sample within the limits; without one the middle of the limits. `q` has
/// RobotModel::coordinate_count() entries.
void ik_start(const RobotModel& model, const IkBatch& batch, std::size_t sample,
              std::span<double> q);

/// The whole turn of angle q nearest to `near` within the limits, held there against rounding; else
/// the one nearest to `near`.
[[nodiscard]] double turn_within(const ArmJoint& joint, double q, double near);
/// How far an angle is outside the limits, any whole turn added [rad]; 0 = inside.
[[nodiscard]] double turns_outside(const ArmJoint& joint, double q);

/// `joint 2 ("elbow") would need 68.75 deg; its limit is 57.3 deg`.
[[nodiscard]] std::string over_limit(const ArmJoint& joint, double q);

/// All q + whole turns of the joints that have two finite limits and are within them, q itself not
/// among them; at most `most`.
[[nodiscard]] std::vector<std::vector<double>> other_turns(const SerialArm& arm,
                                                           std::span<const double> q,
                                                           std::size_t most);

/// The arms of all tips, as far as `recognise(model, tip)` gives one; when it gives none, the error
/// of the first tip.
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

/// A request whose positions lie too far away to be calculated with (the square of 1e200 is no
/// number), brought near: onto the same ray from the base, a hundred lengths of the robot away. The
/// closest configuration is the same to a hundredth of a radian. Lives no longer than the batch
/// that it is made of.
class NearTargets {
 public:
  NearTargets(const RobotModel& model, const IkBatch& batch);
  NearTargets(const NearTargets&) = delete;
  NearTargets& operator=(const NearTargets&) = delete;
  /// What to solve.
  [[nodiscard]] const IkBatch& batch() const { return batch_; }
  /// Puts the true distances into the answers.
  void correct(std::span<IkResult> results) const;

 private:
  std::span<const Pose> asked_;
  std::vector<Pose> near_;  ///< empty when no target is far
  IkBatch batch_;
};

/// Errors of a call before prepare, and for a tip that recognise_tips() left out.
[[nodiscard]] Error ik_not_prepared();
[[nodiscard]] Error ik_unknown_arm(const RobotModel& model, std::size_t tip);

/// Error of a call that is cancelled.
[[nodiscard]] Error ik_stopped();

/// Calls work(first, count) for all samples, `together` at a time, and hears cancellation.
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
