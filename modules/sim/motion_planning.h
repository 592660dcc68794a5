// SPDX-License-Identifier: Apache-2.0
// Motions of a robot around the obstacles of its world: planned, shortened, rounded and timed
// (layer: application, sim).
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

/// All that moves is one robot; others stay where the world shows them.
struct PlanTask {
  std::size_t robot = 0;      ///< index into CollisionModel::robots()
  std::vector<double> start;  ///< joint values [rad or m]
  std::vector<double> goals;  ///< joint values row-major; any of them will do
  std::vector<Pose> targets;  ///< world_T_tip; all solutions that are found become goals
  model::ProviderChoice planner, ik;
  double clearance = 2e-3;  ///< what comes nearer than this touches [m], > 0
  double seconds = 10;      ///< of computing at the search and the shortcuts [s]
  std::uint64_t seed = 1;
  std::size_t tries = 200;  ///< at shortening
  bool is_timed = true;     ///< false = the way only, without rounded corners and times
  RetimeOptions timing;
  model::ProviderChoice inverse_dynamics;  ///< for the torque limits, where joints have any
  Vec3 gravity{0, 0, -9.81};               ///< of the world [m/s^2]
  /// Of joints without limits of their own: greatest velocity [rad/s or m/s], and the time in which
  /// it is reached [s].
  double velocity = 1, ramp = 0.25;
  /// Of the robot's maker, for errors and notes; null = not known.
  std::shared_ptr<const robotics::MakerAxes> axes;
};

/// What a plan took.
struct PlanWork {
  std::size_t configurations = 0;  ///< checked, those of motions between them too
  std::size_t distances = 0;       ///< exact ones of pairs of bodies
  std::size_t motions = 0;         ///< that the planner asked for
  std::size_t searches = 1;        ///< more than one where a way was not free between the samples
  std::size_t shortcuts = 0;       ///< tried
  /// Of the clock on the wall: goals and their inverse kinematics, search, proof that the way is
  /// free, shortcuts, corners and times [s].
  double goals_seconds = 0, search_seconds = 0, proof_seconds = 0, shortcut_seconds = 0,
         timing_seconds = 0;
};

struct PlannedMotion {
  std::vector<double> waypoints;  ///< of the shortened way, row-major
  RobotMotion motion;             ///< without samples where no times were wanted
  PlanWork work;
  std::string planner;           ///< the provider that searched
  std::size_t goals = 0;         ///< free ones there were
  double found = 0, length = 0;  ///< of the way as it was found, and shortened
  std::vector<std::string> notes;
};

/// Lengths are in metres at most: joint changes times the reach of what they move, summed as
/// squares. Nothing comes nearer than the clearance along the way, between samples too
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
