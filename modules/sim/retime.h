// SPDX-License-Identifier: Apache-2.0
// Time-optimal timing along the joint path of a motion (layer: application, sim).
#pragma once

#include <span>
#include <string>

#include <robomosp/sdk/dynamics.h>
#include <robomosp/sdk/progress.h>
#include <robomosp/sdk/result.h>

#include "kernel/registry.h"
#include "model/records.h"
#include "sim/robot_motion.h"
#include "sim/simulate.h"
#include "sim/tip_load.h"

namespace robomosp::sim {

/// The load at a tip, over the path.
struct RetimeLoad {
  const BoundTipLoad* load = nullptr;  ///< not over time; null = no load
  Pose world_T_base;
  std::span<const double> path;  ///< path length of its tip at each row of the motion [m]
};

struct RetimeOptions {
  model::ProviderChoice retimer;  ///< of robomosp.retimer/1; empty name = the default
  double share = 1;               ///< usable fraction of the joints' limits, 0..1
  bool has_torques = true;        ///< apply the torque limits too
  double step = 0.01;             ///< between samples of the result [s]
  RetimeLoad load{};              ///< uses part of the torque limits
  /// Configurations closer than this fraction of the whole path are left out: near a standstill of
  /// the motion, their rounding errors would look like curvature. Use less for a path without
  /// stops, with densely sampled tight curves.
  double least_step = 5e-4;
};

/// The same path, from rest to rest, as fast as the joints' velocity, acceleration and torque
/// limits allow. The path is the cubic spline through the configurations, over their distances; it
/// stops where it turns by more than 30 degrees from one sample to the next. Viscous friction is
/// included by reducing the torque limits by its maximum. Errors give the position on the path.
/// `dynamics` may be null without torque limits.
Result<RobotMotion> retime(const Registry&, const RobotModel&, const RobotMotion&,
                           const Bound<InverseDynamics>* dynamics, const RetimeOptions&,
                           const std::string& where, Progress&);

}  // namespace robomosp::sim
