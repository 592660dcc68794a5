// SPDX-License-Identifier: Apache-2.0
// The fastest way along the joints' path of a motion (layer: application, sim).
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

/// What acts on the robot at a tip, over the path.
struct RetimeLoad {
  const BoundTipLoad* load = nullptr;  ///< not over time; null = nothing acts
  Pose world_T_base;
  std::span<const double> path;  ///< way of its tip up to each row of the motion [m]
};

struct RetimeOptions {
  model::ProviderChoice retimer;  ///< of robomosp.retimer/1; none = the default
  double share = 1;               ///< of the joints' limits that may be used, 0..1
  bool has_torques = true;        ///< keep the torque limits too
  double step = 0.01;             ///< between samples of the result [s]
  RetimeLoad load{};              ///< takes its part of the torque limits
  /// Configurations closer than this share of the whole path are left out: near a rest of the
  /// motion their rounding would look like bends. Less for a path that does not rest, whose tight
  /// curves are sampled closely.
  double least_step = 5e-4;
};

/// The same path, from rest to rest, as fast as the joints' velocity, acceleration and torque
/// limits let it be run. The path is the cubic spline through the configurations, over their
/// distances; it stops where it turns by more than 30 degrees from one sample to the next. Viscous
/// friction is kept within the torque limits by lowering them by the most that it takes. Errors
/// tell the place on the path. `dynamics` may be null without torque limits.
Result<RobotMotion> retime(const Registry&, const RobotModel&, const RobotMotion&,
                           const Bound<InverseDynamics>* dynamics, const RetimeOptions&,
                           const std::string& where, Progress&);

}  // namespace robomosp::sim
