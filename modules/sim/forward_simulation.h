// SPDX-License-Identifier: Apache-2.0
// Forward dynamic simulation: how one robot moves under torques, a controller, weight and what
// touches it (layer: application, sim).
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <robomosp/sdk/controller.h>
#include <robomosp/sdk/integrator.h>

#include "sim/base_motion.h"
#include "sim/mechanism_motion.h"
#include "sim/row_sink.h"
#include "sim/simulate.h"
#include "sim/tip_load.h"

namespace robomosp::sim {

/// What to simulate. A robot of a world, or a robot record alone under standard gravity.
struct ForwardRun {
  WorldId world;              ///< none = the record alone
  RobotId record;             ///< counts without a world
  std::string robot;          ///< name within the world
  double duration = 0;        ///< [s]; 0 = that of the reference
  double sample_time = 0.01;  ///< of the recording [s]
  std::vector<double> q;      ///< at the start; empty = of the reference, else as placed, else home
  std::vector<double> qd;     ///< at the start; empty = of the reference, else zeros

  /// Torques of the motors, constant or recorded (columns tau1, tau2, ...); neither = none.
  std::vector<double> tau;
  recording::RecordingPtr recorded_tau;

  /// A controller instead, every `control_period`, that makes the robot follow one of these:
  bool is_controlled = false;
  model::ProviderChoice controller;    ///< empty name = the robot's own, else the default
  double control_period = 1e-3;        ///< [s]
  std::string trajectory;              ///< of the world, by inverse kinematics
  recording::RecordingPtr recorded_q;  ///< columns q1, ... (qd1, qdd1, ...)
  std::vector<double> hold;            ///< a configuration; all three empty = where it starts

  std::string base_trajectory;                 ///< of the world: how the mounting moves
  std::optional<BaseExpressions> base_motion;  ///< the same by expressions of the time
  TipLoad load;                                ///< its path is that of the reference

  model::ProviderChoice integrator;  ///< empty name = the default
  double relative_tolerance = 1e-10, absolute_tolerance = 1e-12;
  double loosened = 1;  ///< how many times the default these are; for the notes
  double step = 1e-3;   ///< of fixed-step methods [s]
  bool friction = true;
  double breakaway = 1;
  AtLimit at_limit = AtLimit::stop;
  double restitution = 0;
  IkTolerance tolerance{};  ///< of the inverse kinematics along a trajectory
};

/// By how much the default tolerances of the integrator are greater for a mechanism of so many
/// velocities. Beyond 1000 links in a chain the rounding of the accelerations grows until the error
/// of a step cannot come below the tolerances, and steps become ever shorter: chains that hang out
/// and fall for 0.1 s took 368, 685 and 2695 steps with 1000, 2000 and 4000 links at 1e-10, and 354
/// with 4000 at 1e-9.
[[nodiscard]] double loosening(std::size_t velocities);

/// time, q, qd, qdd, tau of the motors, friction and stops, energies, x y z of the first tip in the
/// world, and the errors against the reference. Notes tell limits met, where joints
/// stuck and went on, torques cut, and what the integrator did.
/// A `sink` takes every row as it is made, with tau_stop also while no stop is touched. With `from`
/// the run goes on there, with joint values, velocities and the controller's memory, and the world
/// as it is now.
Result<recording::RecordingPtr> forward_dynamics(const Simulator& simulator, const ForwardRun& run,
                                                 Progress& progress, RowSink* sink = nullptr,
                                                 const RunState* from = nullptr);

/// A prepared controller with the inverse dynamics that it asks, which stop with `run`; `run`
/// outlives it. Of a mechanism with closed loops the controller sees the tree that is left where
/// they are cut, with a motor at every joint, and what it asks of joints without motors is carried
/// by the others (sim/closed_dynamics.h). `choice.name` empty = the default, of either.
Result<Bound<Controller>> bind_controller(const Registry&, std::shared_ptr<const RobotModel>,
                                          const model::ProviderChoice& dynamics,
                                          const model::ProviderChoice& choice, const Progress& run);
Result<Bound<Integrator>> bind_integrator(const Registry&, std::shared_ptr<const RobotModel>,
                                          const model::ProviderChoice&);

}  // namespace robomosp::sim
