// SPDX-License-Identifier: Apache-2.0
// Collision-free motions of a robot in its world: planned, shortened, rounded and timed (layer:
// application, sim).
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <robomosp/sdk/progress.h>
#include <robomosp/sdk/result.h>

#include "collision/collision.h"
#include "kernel/registry.h"
#include "model/records.h"
#include "robotics/maker_axes.h"
#include "sim/retime.h"

namespace robomosp::sim {

/// One robot moves; the others keep their configuration in the world.
struct PlanTask {
  std::size_t robot = 0;      ///< index into CollisionModel::robots()
  std::vector<double> start;  ///< joint values [rad or m]
  std::vector<double> goals;  ///< joint values row-major; any of them is sufficient
  std::vector<Pose> targets;  ///< world_T_tip; all solutions found become goals
  model::ProviderChoice planner, ik;
  double clearance = 2e-3;  ///< bodies nearer than this count as touching [m], > 0
  double seconds = 10;      ///< computing time of search and shortcuts [s]
  std::uint64_t seed = 1;
  std::size_t tries = 200;  ///< of shortening
  bool is_timed = true;     ///< false = only the path, without rounded corners and times
  RetimeOptions timing;
  model::ProviderChoice inverse_dynamics;  ///< for the torque limits, if joints have any
  Vec3 gravity{0, 0, -9.81};               ///< of the world [m/s^2]
  /// For joints without limits: greatest velocity [rad/s or m/s], and the time to reach it [s].
  double velocity = 1, ramp = 0.25;
  /// Axes of the robot's maker, for errors and notes; null = unknown.
  std::shared_ptr<const robotics::MakerAxes> axes;
};

/// Effort of a plan.
struct PlanWork {
  std::size_t configurations = 0;  ///< checked, including those within motions
  std::size_t distances = 0;       ///< exact ones of pairs of bodies
  std::size_t motions = 0;         ///< requested by the planner
  std::size_t searches = 1;        ///< more than one if a path was not free between the samples
  std::size_t shortcuts = 0;       ///< tried
  /// Wall-clock times of: goals and their inverse kinematics, search, proof that the path is free,
  /// shortcuts, corners and timing [s].
  double goals_seconds = 0, search_seconds = 0, proof_seconds = 0, shortcut_seconds = 0,
         timing_seconds = 0;
};

struct PlannedMotion {
  std::vector<double> waypoints;  ///< of the shortened path, row-major
  RobotMotion motion;             ///< without samples if no times were requested
  PlanWork work;
  std::string planner;           ///< the provider used for the search
  std::size_t goals = 0;         ///< number of free goals
  double found = 0, length = 0;  ///< length of the path as found, and shortened
  std::vector<std::string> notes;
};

/// Lengths are upper bounds in metres: joint changes times the reach of the bodies they move,
/// summed as squares. Nothing comes nearer than the clearance along the path, also between samples
/// (CollisionModel::check_path), nor than half of it along the sampled motion. A start or goals in
/// collision are errors that name the bodies; equal seeds give equal motions. [any thread, unless
/// the collision engine is a script]
Result<PlannedMotion> plan_motion(const Registry&, const collision::CollisionModel&,
                                  const PlanTask&, Progress&);

/// time, q, qd, qdd of the joints and x, y, z of the first tip in the world.
[[nodiscard]] recording::Recording planned_recording(const collision::CollisionRobot&, WorldId,
                                                     const PlannedMotion&,
                                                     const robotics::MakerAxes&);

}  // namespace robomosp::sim
