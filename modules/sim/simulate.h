// SPDX-License-Identifier: Apache-2.0
// Simulations over a world: kinematic (inverse kinematics along a trajectory) and inverse dynamic
// (layer: application).
#pragma once

#include <memory>
#include <string>
#include <string_view>

#include <robomosp/sdk/dynamics.h>
#include <robomosp/sdk/ik.h>
#include <robomosp/sdk/progress.h>
#include <robomosp/sdk/result.h>

#include "evaluation/sources.h"
#include "recording/recording.h"

namespace robomosp::sim {

/// A solver bound to the model it was prepared for (which must outlive it).
template <class Solver>
struct Bound {
  std::shared_ptr<const RobotModel> model;
  std::shared_ptr<Solver> solver;
  std::string provider;  ///< for messages
};

/// Creates, prepares and wraps a provider chosen by a robot; `choice.name` empty = the default, of
/// inverse kinematics the closed form that serves the robot if there is one (sim/ik_choice.h).
Result<Bound<IkSolver>> bind_ik(const Registry&, std::shared_ptr<const RobotModel>,
                                const model::ProviderChoice&);
/// `own` where it has the tag, else the program's default or the first other one that has it; `own`
/// where none has it.
model::ProviderChoice ik_with_tag(const Registry&, const model::ProviderChoice& own,
                                  std::string_view tag);
Result<Bound<InverseDynamics>> bind_inverse_dynamics(const Registry&,
                                                     std::shared_ptr<const RobotModel>,
                                                     const model::ProviderChoice&);
Result<Bound<ForwardDynamics>> bind_forward_dynamics(const Registry&,
                                                     std::shared_ptr<const RobotModel>,
                                                     const model::ProviderChoice&);

/// Calls the solver and checks what it gives (finite, right lengths, within limits, and by forward
/// kinematics that a claimed solution is one); a provider that lies is plugin_failed.
Result<std::vector<IkResult>> solve_ik(const Bound<IkSolver>&, const IkBatch&, Progress&);
/// tau of count samples; checked finite.
Result<std::vector<double>> torques(const Bound<InverseDynamics>&, DynamicsBatch, Progress&);
Result<std::vector<double>> inertia(const Bound<InverseDynamics>&, DynamicsBatch, Progress&);
Result<std::vector<double>> accelerations(const Bound<ForwardDynamics>&, DynamicsBatch, Progress&);

/// What to simulate, by names within the world.
struct Run {
  WorldId world;
  std::string robot, trajectory;
  double sample_time = 0;  ///< [s]; 0 = the trajectory's own
  IkTolerance tolerance{};
  IkObjective objective = IkObjective::none;  ///< what a redundant robot does with its freedom
  bool begins_on_path = false;                ///< see RobotMotionTask
  double influence = 0.2;  ///< with clearance: what is farther away does not count [m]
};

struct RetimeOptions;

struct Simulator : evaluation::Sources {
  /// time, q, qd, qdd of the joints, x, y, z of the tool in the world, and the remaining pose
  /// error.
  Result<recording::RecordingPtr> inverse_kinematics(const Run&, Progress&) const;
  /// The same and tau, with its gravity, inertial, velocity and friction parts.
  Result<recording::RecordingPtr> inverse_dynamics(const Run&, Progress&) const;
  /// The same path as fast as the joints' limits let it be run, with torques (sim/retime.h).
  Result<recording::RecordingPtr> time_optimal(const Run&, const RetimeOptions&, Progress&) const;
};

}  // namespace robomosp::sim
