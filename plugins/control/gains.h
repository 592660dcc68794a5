// SPDX-License-Identifier: Apache-2.0
// Shared by the controllers: gains, the error between two configurations, friction compensation
// (layer: plugin).
#pragma once

#include <span>
#include <string>
#include <vector>

#include <robomosp/sdk/controller.h>

namespace robomosp::control {

/// A mechanism with the inverse dynamics used to control it.
struct Plant {
  const RobotModel* model = nullptr;
  const InverseDynamics* dynamics = nullptr;
  std::vector<bool> has_motor;  ///< by entry of tau

  [[nodiscard]] std::size_t dof() const { return model->dof(); }
};

/// Checks the model; entries of passive joints have no motor.
Result<Plant> make_plant(const RobotModel& model, const InverseDynamics& dynamics);

/// One number for each entry of qd: the list `name`, its only number for all, or `otherwise`.
Result<std::vector<double>> gains_of(const Plant& plant, const Params& params,
                                     std::string_view name, std::span<const double> otherwise);

/// Diagonal of M at the configuration 0 (unit quaternions): what an entry's motor moves alone.
Result<std::vector<double>> own_inertia(const Plant& plant);

/// Rejects spans of the wrong length.
Result<void> check_input(const Plant& plant, const ControlInput& in, std::size_t state,
                         std::size_t needs_state, std::size_t scratch, std::size_t needs_scratch,
                         std::size_t tau);

/// The small velocity (dof numbers) that takes q to q_desired in unit time: differences, and
/// rotation vectors in the moving frame for spherical and free joints.
void configuration_error(const RobotModel& model, std::span<const double> q,
                         std::span<const double> q_desired, std::span<double> e);

/// Adds friction compensation: viscous friction of the actual velocity, Coulomb friction of the
/// desired one, since its sign does not chatter.
void add_friction(const RobotModel& model, const ControlInput& in, std::span<double> tau);

/// Sets entries without a motor to 0.
void clear_passive(const Plant& plant, std::span<double> tau);

}  // namespace robomosp::control
