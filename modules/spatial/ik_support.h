// SPDX-License-Identifier: Apache-2.0
// What every closed-form provider of robomosp.ik/1 needs around its formulas: checks of a request,
// seeds, whole turns within limits, and sentences (layer: data processing, spatial).
#pragma once

#include <span>
#include <string>
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

}  // namespace robomosp::spatial
