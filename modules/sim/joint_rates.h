// SPDX-License-Identifier: Apache-2.0
// Joint velocities and accelerations along a path of configurations that follow the tip's motion
// exactly (layer: application, sim).
#pragma once

#include <span>
#include <vector>

#include <robomosp/sdk/robot_model.h>
#include <robomosp/sdk/trajectory.h>

namespace robomosp::sim {

/// First and second time derivative of sampled values (samples * dof, joint-fastest) at increasing
/// times, by the five-point polynomial through the nearest samples (fewer where there are fewer).
void differentiate(std::span<const double> times, std::span<const double> values, std::size_t dof,
                   std::span<double> first, std::span<double> second);

/// qd and qdd (samples * dof) of configurations q with tip 0 on `path` (poses and rates in the base
/// frame): qd = J+ v + (1 - J+ J) dq/dt and likewise for qdd, so that the tip moves as on the path
/// and the null space as in the configurations.
void joint_rates(const RobotModel&, std::span<const double> times, std::span<const double> q,
                 std::span<const PathSample> path, std::span<double> qd, std::span<double> qdd);

}  // namespace robomosp::sim
