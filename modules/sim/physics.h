// SPDX-License-Identifier: Apache-2.0
// Contact physics of a world: objects fall, touch and stack, robots are moved or driven and carry
// what they grasp (layer: application, sim).
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <robomosp/sdk/controller.h>
#include <robomosp/sdk/physics.h>

#include "recording/recording.h"
#include "sim/row_sink.h"
#include "sim/simulate.h"

namespace robomosp::sim {

/// An object of the world where it differs from the others.
struct PhysicsObjectSettings {
  std::string name;
  bool is_fixed = false;  ///< stays where it is; objects without mass do in any case
  std::optional<double> friction, restitution;
  Vec3 velocity{}, angular_velocity{};  ///< at the start, of its origin, world axes [m/s, rad/s]
};

enum class RobotDrive {
  moved,       ///< along its motion whatever it meets, as if its motors had no limit
  controlled,  ///< bodies and joints with masses; torques by a controller along its motion
  limp,        ///< the same without torques
};

struct PhysicsRobotSettings {
  std::string name;
  RobotDrive drive = RobotDrive::moved;
  model::ProviderChoice controller;  ///< empty name = the robot's own, else the default
  std::optional<double> friction, restitution;
  bool self_contact = false;  ///< links touch each other, but for pairs that collision passes over
};

/// One line of what happens. It begins when the line before it ended, unless a time is given.
struct PhysicsAction {
  enum class Kind {
    move,     ///< the robot moves; one of q, recorded and trajectory
    grasp,    ///< ties an object to the link that carries the tool
    grip,     ///< a joint presses with a force instead of following the robot's motion
    release,  ///< lets it go, and gripping joints follow the motion again
    wait,
  } kind = Kind::move;
  std::optional<double> time;  ///< when it begins [s]
  /// [s] Of a move to q: how long, 0 = as the joints' greatest velocities allow. Else the pause
  /// after it.
  double duration = 0;
  std::string robot;      ///< empty = that of the line before; else the only one of the world
  std::vector<double> q;  ///< where to: all joints evenly, by the quintic of minimum jerk
  recording::RecordingPtr recorded;  ///< columns q1, ...; with its own duration
  std::string trajectory;            ///< of the world, by inverse kinematics; with its own duration
  std::string object;  ///< to grasp; empty = what the tool touches. To release; empty = all
  std::string tool;    ///< name of a tip; empty = the first
  std::string joint;   ///< that grips
  double force = 0;    ///< it grips with; positive where its value grows [N or N m]
  double speed = 0;    ///< of gripping; 0 = the joint's greatest, else 0.1 m/s or 0.5 rad/s
};

struct PhysicsRun {
  WorldId world;
  double duration = 0;        ///< [s]; 0 = to the end of the last action
  double step = 1e-3;         ///< of the engine and of controllers [s]
  double sample_time = 0.01;  ///< of the recording, rounded to whole steps [s]
  double friction = 0.5;      ///< Coulomb coefficient of all that says nothing else [-]
  double restitution = 0;     ///< 0..1 [-]
  std::vector<PhysicsObjectSettings> objects;
  std::vector<PhysicsRobotSettings> robots;
  std::vector<PhysicsAction> actions;
  model::ProviderChoice engine;  ///< empty name = the default
};

/// Columns: time; of each object that can move `<name>.x .y .z` [m], the quaternion `.qw .qx .qy
/// .qz` (world_T_object) and `.contact_force`, the size of the sum of what touches it [N]; q, qd
/// and of driven robots tau of the robot that acts first (of the others `<name>.q1` ...);
/// `contacts`, the number of contact points, and `contact_force`, the sum of their forces' sizes
/// [N]. Equal runs give equal bits. Notes tell bodies that had to be given a mass, torques that
/// were cut, and what was grasped.
/// A `sink` takes every row as it is made. With `from` the run goes on there, with the world as it
/// is now: what can move carries over place and speed by its name, as do robots, controllers and
/// what is held; what is new begins where it is placed; actions before that time are past.
Result<recording::RecordingPtr> simulate_physics(const Simulator&, const PhysicsRun&, Progress&,
                                                 RowSink* sink = nullptr,
                                                 const RunState* from = nullptr);

}  // namespace robomosp::sim
