// SPDX-License-Identifier: Apache-2.0
// Inverse dynamics and controllers of mechanisms with closed loops: providers compute the open
// tree, and the forces are mapped to the motors here (layer: application, sim).
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <robomosp/sdk/controller.h>
#include <robomosp/sdk/dynamics.h>

#include "sim/simulate.h"

namespace robomosp::sim {

/// Like bind_inverse_dynamics(), which returns motor forces for a mechanism with closed loops, but
/// with forces at all joints of the tree obtained by cutting the loops.
Result<Bound<InverseDynamics>> bind_tree_dynamics(const Registry&,
                                                  std::shared_ptr<const RobotModel>,
                                                  const model::ProviderChoice&);

/// Torques, inertia and regressor of the closed mechanism by a solver of the open tree, which is
/// prepared for `model`; both are kept. Energies are those of the tree, which are the same. States
/// must have closed loops, and rates and accelerations must keep them closed (check_loops):
/// derivatives, which need states that do not, are refused. [any thread]
Result<std::shared_ptr<InverseDynamics>> close_dynamics(std::shared_ptr<const RobotModel> model,
                                                        std::shared_ptr<InverseDynamics> tree);

/// True for a solver made by close_dynamics().
[[nodiscard]] bool is_closed(const InverseDynamics& solver);

/// Wraps a controller that is prepared for the open tree with a motor at every joint
/// (model_with_all_motors): its forces at joints without motors are mapped to those with one.
Result<std::shared_ptr<Controller>> close_controller(std::shared_ptr<const RobotModel> model,
                                                     std::shared_ptr<Controller> tree);

/// A copy without passive joints.
[[nodiscard]] std::shared_ptr<const RobotModel> model_with_all_motors(const RobotModel& model);

/// Copies of rates and accelerations in which joints without motors follow those with one.
struct FollowedRates {
  std::vector<double> qd, qdd;  ///< empty if the batch has none and nothing moves
};
/// Rejects states of a batch with open loops, and rates or accelerations that would open them. With
/// `follow`, joints without motors follow: the batch's spans then refer to it. Accelerations are
/// checked if the batch's terms include the inertial one. `of_state` returns the location of a
/// sample for messages, such as ", row 3". Does nothing without loops.
Result<void> check_loops(const RobotModel& model, DynamicsBatch& batch, FollowedRates* follow,
                         const std::function<std::string(std::size_t)>& of_state,
                         Progress& progress);

/// Closes the loops in rows of a recording, count * coordinate_count() and count * dof() numbers
/// (qdd may be empty), by the least motion, with joints without motors following those with one.
/// Returns the greatest gap before [m, rad]; rows with loops open by more than 1 mm or 1 mrad are
/// rejected. Does nothing without loops.
Result<double> close_rows(const RobotModel& model, std::span<double> q, std::span<double> qd,
                          std::span<double> qdd, Progress& progress);

/// The joint without a motor that needs the greatest force in a result (count * dof), which no
/// motor can provide: none if the motors provide all forces.
struct MissingMotor {
  std::size_t entry = 0;
  double force = 0;  ///< [N m or N]
};
std::optional<MissingMotor> missing_motor(const RobotModel& model, std::span<const double> tau);

}  // namespace robomosp::sim
