// SPDX-License-Identifier: Apache-2.0
// Contact physics of a world: objects fall, touch and stack, robots are moved or driven and carry
// objects they grasp (layer: application, sim).
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <robomosp/sdk/controller.h>
#include <robomosp/sdk/physics.h>

#include "recording/recording.h"
#include "sim/pulls.h"
#include "sim/row_sink.h"
#include "sim/simulate.h"

namespace robomosp::sim {

/// Settings of an object that differ from the default.
struct PhysicsObjectSettings {
  std::string name;
  bool is_fixed = false;  ///< does not move; objects without mass never do
  std::optional<double> friction, restitution;
  Vec3 velocity{}, angular_velocity{};  ///< initial, of its origin, world axes [m/s, rad/s]
};

enum class RobotDrive {
  moved,       ///< along its motion regardless of contact, as if its motors had no limit
  controlled,  ///< bodies and joints with masses; torques by a controller along its motion
  limp,        ///< the same without torques
};

struct PhysicsRobotSettings {
  std::string name;
  RobotDrive drive = RobotDrive::moved;
  model::ProviderChoice controller;  ///< empty name = the robot's, else the default
  std::optional<double> friction, restitution;
  bool self_contact = false;  ///< links touch each other, except pairs that collision checks skip
};

/// An action of a run. It begins at the end of the previous one, unless a time is given.
struct PhysicsAction {
  enum class Kind {
    move,     ///< the robot moves; one of q, recorded and trajectory
    grasp,    ///< attaches an object to the link that carries the tool
    grip,     ///< a joint presses with a force instead of following the robot's motion
    release,  ///< releases it, and gripping joints follow the motion again
    wait,
  } kind = Kind::move;
  std::optional<double> time;  ///< its start time [s]
  /// [s] For a move to q: its duration, 0 = from the joints' greatest velocities. Else the pause
  /// after it.
  double duration = 0;
  std::string robot;      ///< empty = that of the previous action; else the only one of the world
  std::vector<double> q;  ///< target: all joints synchronously, by the minimum-jerk quintic
  recording::RecordingPtr recorded;  ///< columns q1, ...; with their duration
  std::string trajectory;            ///< of the world, by inverse kinematics; with its duration
  std::string object;  ///< to grasp; empty = the one in contact with the tool. To release; empty =
                       ///< all
  std::string tool;    ///< name of a tip; empty = the first
  std::string joint;   ///< the gripping joint
  double force = 0;    ///< gripping force; positive in the direction of increasing joint value [N
                       ///< or N m]
  double speed = 0;    ///< of gripping; 0 = the joint's greatest, else 0.1 m/s or 0.5 rad/s
};

struct PhysicsRun {
  WorldId world;
  double duration = 0;        ///< [s]; 0 = to the end of the last action
  double step = 1e-3;         ///< of the engine and of controllers [s]
  double sample_time = 0.01;  ///< of the recording, rounded to whole steps [s]
  double friction = 0.5;      ///< Coulomb coefficient by default [-]
  double restitution = 0;     ///< 0..1 [-]
  std::vector<PhysicsObjectSettings> objects;
  std::vector<PhysicsRobotSettings> robots;
  std::vector<PhysicsAction> actions;
  model::ProviderChoice engine;       ///< empty name = the default
  std::shared_ptr<Pulls> pulls = {};  ///< of a live run; null = none
};

/// Columns: time; for each movable object `<name>.x .y .z` [m], the quaternion `.qw .qx .qy .qz`
/// (world_T_object) and `.contact_force`, the magnitude of the sum of its contact forces [N]; q,
/// and for driven robots tau, of the robot that acts first (for the others `<name>.q1` ...);
/// `contacts`, the number of contact points, and `contact_force`, the sum of the magnitudes of
/// their forces [N]. Equal runs give equal bits. Notes list bodies that got a default mass, clipped
/// torques, and grasped objects. A `sink` receives every row as it is computed. With `from` the run
/// continues from there, with the current world: movable objects keep pose and velocity by name,
/// and so do robots, controllers and held objects; new ones start at their placement; actions
/// before that time are skipped.
Result<recording::RecordingPtr> simulate_physics(const Simulator&, const PhysicsRun&, Progress&,
                                                 RowSink* sink = nullptr,
                                                 const RunState* from = nullptr);

}  // namespace robomosp::sim
