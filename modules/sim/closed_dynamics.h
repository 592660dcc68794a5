// SPDX-License-Identifier: Apache-2.0
// Inverse dynamics and controllers of mechanisms with closed loops: providers compute the open
// tree, and here their forces are carried to the motors (layer: application, sim).
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

/// As bind_inverse_dynamics(), which of a mechanism with closed loops gives forces of the motors,
/// but with forces at all joints of the tree that is left where loops are cut.
Result<Bound<InverseDynamics>> bind_tree_dynamics(const Registry&,
                                                  std::shared_ptr<const RobotModel>,
                                                  const model::ProviderChoice&);

/// Torques, inertia and regressor of the closed mechanism by a solver of the open tree, which is
/// prepared for `model`; both are kept. Energies are the tree's own: they are the same. States have
/// closed loops, and rates and accelerations that keep them closed (check_loops): derivatives, for
/// which states leave them, are refused. [any thread]
Result<std::shared_ptr<InverseDynamics>> close_dynamics(std::shared_ptr<const RobotModel> model,
                                                        std::shared_ptr<InverseDynamics> tree);

/// Whether a solver is one of close_dynamics().
[[nodiscard]] bool is_closed(const InverseDynamics& solver);

/// A controller that is prepared for the open tree with a motor at every joint
/// (model_with_all_motors): what it asks of joints without motors is carried by those with one.
Result<std::shared_ptr<Controller>> close_controller(std::shared_ptr<const RobotModel> model,
                                                     std::shared_ptr<Controller> tree);

/// A copy in which no joint is passive.
[[nodiscard]] std::shared_ptr<const RobotModel> model_with_all_motors(const RobotModel& model);

/// Copies of rates and accelerations in which joints without motors follow those with one.
struct FollowedRates {
  std::vector<double> qd, qdd;  ///< empty where the batch has none and nothing moves
};
/// Refuses states of a batch with open loops, and rates or accelerations that would open them. With
/// `follow` joints without motors follow: the batch's spans then lie in it. Accelerations are
/// looked at where the batch's terms have the inertial one. `of_state` gives the words for where a
/// sample is, such as ", row 3". Does nothing without loops.
Result<void> check_loops(const RobotModel& model, DynamicsBatch& batch, FollowedRates* follow,
                         const std::function<std::string(std::size_t)>& of_state,
                         Progress& progress);

/// Rows of a recording, count * coordinate_count() and count * dof() numbers (qdd may be empty),
/// become states with closed loops by the least motion that closes them, and joints without motors
/// follow those with one. Returns the greatest gap before [m, rad]; rows whose loops are open by
/// more than 1 mm or 1 mrad are refused. Does nothing without loops.
Result<double> close_rows(const RobotModel& model, std::span<double> q, std::span<double> qd,
                          std::span<double> qdd, Progress& progress);

/// The joint without motor that has to give the most in forces of an answer (count * dof), which no
/// motor can: none where the motors do all.
struct MissingMotor {
  std::size_t entry = 0;
  double force = 0;  ///< [N m or N]
};
std::optional<MissingMotor> missing_motor(const RobotModel& model, std::span<const double> tau);

}  // namespace robomosp::sim
