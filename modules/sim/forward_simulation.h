// SPDX-License-Identifier: Apache-2.0
// Forward dynamic simulation: the motion of one robot under torques, a controller, gravity and
// contact forces (layer: application, sim).
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <robomosp/sdk/controller.h>
#include <robomosp/sdk/integrator.h>

#include "sim/base_motion.h"
#include "sim/mechanism_motion.h"
#include "sim/pulls.h"
#include "sim/row_sink.h"
#include "sim/simulate.h"
#include "sim/tip_load.h"

namespace robomosp::sim {

/// Options of a simulation. A robot of a world, or a robot record alone under standard gravity.
struct ForwardRun {
  WorldId world;              ///< none = the record alone
  RobotId record;             ///< used without a world
  std::string robot;          ///< name within the world
  double duration = 0;        ///< [s]; 0 = that of the reference
  double sample_time = 0.01;  ///< of the recording [s]
  std::vector<double> q;      ///< initial; empty = of the reference, else as placed, else home
  std::vector<double> qd;     ///< initial; empty = of the reference, else zeros

  /// Torques of the motors, constant or recorded (columns tau1, tau2, ...); neither = none.
  std::vector<double> tau;
  recording::RecordingPtr recorded_tau;

  /// A controller instead, every `control_period`, that makes the robot follow one of these:
  bool is_controlled = false;
  model::ProviderChoice controller;    ///< empty name = the robot's, else the default
  double control_period = 1e-3;        ///< [s]
  std::string trajectory;              ///< of the world, by inverse kinematics
  recording::RecordingPtr recorded_q;  ///< columns q1, ... (qd1, qdd1, ...)
  std::vector<double> hold;            ///< a configuration; all three empty = the initial one

  std::string base_trajectory;                 ///< of the world: moves the mounting
  std::optional<BaseExpressions> base_motion;  ///< the same by expressions of the time
  TipLoad load;                                ///< its path is that of the reference

  model::ProviderChoice integrator;  ///< empty name = the default
  double relative_tolerance = 1e-10, absolute_tolerance = 1e-12;
  double loosened = 1;  ///< factor of these relative to the default; for the notes
  double step = 1e-3;   ///< of fixed-step methods [s]
  bool friction = true;
  double breakaway = 1;
  AtLimit at_limit = AtLimit::stop;
  double restitution = 0;
  IkTolerance tolerance{};            ///< of the inverse kinematics along a trajectory
  std::shared_ptr<Pulls> pulls = {};  ///< of a live run; null = none
};

/// Factor of the integrator's default tolerances for a mechanism of this many velocities. Beyond
/// 1000 links in a chain, the rounding errors of the accelerations grow until the error of a step
/// cannot come below the tolerances, and steps become ever shorter: chains that hang out and fall
/// for 0.1 s took 368, 685 and 2695 steps with 1000, 2000 and 4000 links at 1e-10, and 354 with
/// 4000 at 1e-9.
[[nodiscard]] double loosening(std::size_t velocities);

/// Columns: time, q, qd, qdd, tau of the motors, friction and stops, energies, x y z of the first
/// tip in the world, and the errors against the reference. Notes report limits reached, joints that
/// stuck and slid again, clipped torques, and statistics of the integrator. A `sink` receives every
/// row as it is computed, always with tau_stop. With `from` the run continues from there, with
/// joint values, velocities and the controller's state, and the current world.
Result<recording::RecordingPtr> forward_dynamics(const Simulator& simulator, const ForwardRun& run,
                                                 Progress& progress, RowSink* sink = nullptr,
                                                 const RunState* from = nullptr);

/// A prepared controller with its inverse dynamics, which can be cancelled by `run`; `run` must
/// outlive it. For a mechanism with closed loops, the controller sees the tree with the loops cut
/// and a motor at every joint, and its forces at joints without motors are mapped to the others
/// (sim/closed_dynamics.h). `choice.name` empty = the default, of either.
Result<Bound<Controller>> bind_controller(const Registry&, std::shared_ptr<const RobotModel>,
                                          const model::ProviderChoice& dynamics,
                                          const model::ProviderChoice& choice, const Progress& run);
Result<Bound<Integrator>> bind_integrator(const Registry&, std::shared_ptr<const RobotModel>,
                                          const model::ProviderChoice&);

}  // namespace robomosp::sim
