// SPDX-License-Identifier: Apache-2.0
// Worlds: placed objects, robots, trajectories, tasks, programs, and signals (layer: data
// processing, model). SI and radians.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <robomosp/sdk/types.h>

#include "model/basics.h"
#include "model/fields.h"
#include "model/kind.h"
#include "model/program_binding.h"

namespace robomosp::model {

struct PlacedObject {
  std::string name;     ///< unique in the world
  AnyId what;           ///< object or solid
  Placement placement;  ///< world_T_object
};
template <class V>
constexpr void fields(V& v, Of<PlacedObject>) {
  v("name", &PlacedObject::name).needed().doc("Unique in the world.");
  v("what", &PlacedObject::what)
      .refers_to({Kind::solid, Kind::object})
      .by_kind()
      .needed()
      .doc("The placed solid or object.");
  v("placement", &PlacedObject::placement).flat().doc("Its frame in the world's.");
}

/// How the mounting of a robot is held: fixed, or moved along a trajectory. The cause of the motion
/// does not matter to the robot; the words are those of the program of 2006.
enum class BaseKind : std::uint8_t { fixed, free_flying, free_floating, serpentine };
inline constexpr std::array<std::string_view, 4> kBaseWords{"fixed", "free_flying", "free_floating",
                                                            "serpentine"};
constexpr std::span<const std::string_view> words(Of<BaseKind>) { return kBaseWords; }

struct PlacedRobot {
  std::string name;
  RobotId robot;
  Placement placement;         ///< world_T_mounting
  std::vector<double> q = {};  ///< joint values shown; empty = the pose "home" or zeros
  BaseKind base = BaseKind::fixed;
  /// Trajectory of the world that moves the mounting in runs: its frame is that of the mounting. ""
  /// = the mounting stays at its placement. Not for a fixed base.
  std::string base_trajectory = {};
};
template <class V>
constexpr void fields(V& v, Of<PlacedRobot>) {
  v("name", &PlacedRobot::name).needed().doc("Unique in the world.");
  v("robot", &PlacedRobot::robot).needed().doc("The placed robot.");
  v("placement", &PlacedRobot::placement).flat().doc("Its mounting frame in the world.");
  v("q", &PlacedRobot::q)
      .unit(kByJoint)
      .doc("Joint values shown; empty is the pose home, or zeros.");
  v("base", &PlacedRobot::base).doc("How its mounting is held; if not fixed it may move.");
  v("base_trajectory", &PlacedRobot::base_trajectory)
      .doc("Trajectory of the world that its mounting follows in runs; empty is none.");
}

struct PlacedTrajectory {
  std::string name;
  TrajectoryId trajectory;
  Placement placement;  ///< world_T_trajectory
};
template <class V>
constexpr void fields(V& v, Of<PlacedTrajectory>) {
  v("name", &PlacedTrajectory::name).needed().doc("Unique in the world.");
  v("trajectory", &PlacedTrajectory::trajectory).needed().doc("The placed trajectory.");
  v("placement", &PlacedTrajectory::placement).flat().doc("Its frame in the world's.");
}

/// A named frame for tasks and users.
struct PlacedFrame {
  std::string name;
  Placement placement;  ///< world_T_frame
};
template <class V>
constexpr void fields(V& v, Of<PlacedFrame>) {
  v("name", &PlacedFrame::name).needed().doc("Unique in the world.");
  v("placement", &PlacedFrame::placement).flat().doc("The frame in the world's.");
}

enum class LightKind : std::uint8_t {
  sun,     ///< parallel light along -z of its frame
  point,   ///< from its origin in all directions
  spot,    ///< from its origin along -z of its frame, within `angle` of it
  ambient  ///< from all sides, in place of the studio's; its placement has no effect
};
inline constexpr std::array<std::string_view, 4> kLightWords{"sun", "point", "spot", "ambient"};
constexpr std::span<const std::string_view> words(Of<LightKind>) { return kLightWords; }

struct PlacedLight {
  std::string name;
  LightKind kind = LightKind::point;
  Placement placement;   ///< world_T_light
  Colour colour;         ///< sRGB; a is ignored
  double intensity = 1;  ///< 1 = as bright as the program's default light
  double angle = 0.5;    ///< half the opening of a spot [rad]
};
template <class V>
constexpr void fields(V& v, Of<PlacedLight>) {
  v("name", &PlacedLight::name).needed().doc("Unique in the world.");
  v("kind", &PlacedLight::kind)
      .always_written()
      .doc(
          "Parallel light, light from a point in all directions, a spot, or light from all sides.");
  v("placement", &PlacedLight::placement).flat().doc("Its frame in the world's.");
  v("colour", &PlacedLight::colour).doc("Colour in sRGB; the opacity is ignored.");
  v("intensity", &PlacedLight::intensity)
      .at_least(0)
      .doc("1 is as bright as the program's own light of that kind.");
  v("angle", &PlacedLight::angle).unit("rad").above(0).doc("Half the opening angle of a spot.");
}

struct PlacedTask {
  std::string name;
  TaskId task;
  std::string robot;  ///< robot of steps that name none; "" = every step names one
};
template <class V>
constexpr void fields(V& v, Of<PlacedTask>) {
  v("name", &PlacedTask::name).needed().doc("Unique in the world.");
  v("task", &PlacedTask::task).needed().doc("The placed task.");
  v("robot", &PlacedTask::robot).doc("Robot for steps that name none.");
}

enum class SignalKind : std::uint8_t { digital, analogue };
inline constexpr std::array<std::string_view, 2> kSignalWords{"digital", "analogue"};
constexpr std::span<const std::string_view> words(Of<SignalKind>) { return kSignalWords; }

/// A signal line between two devices; tasks set it and wait for it.
struct Signal {
  std::string name;  ///< a letter, then letters, digits and _
  SignalKind kind = SignalKind::digital;
  std::string unit;      ///< SI, of an analogue one; "" = a plain number
  double initial = 0;    ///< a digital one is 0 or 1
  std::string from, to;  ///< members of the world, or devices of any name; "" = any
  std::string description;
};
template <class V>
constexpr void fields(V& v, Of<Signal>) {
  v("name", &Signal::name).needed().doc("Name: a letter, then letters, digits and _.");
  v("kind", &Signal::kind).always_written().doc("Digital is 0 or 1, analogue any number.");
  v("initial", &Signal::initial).doc("Value at the start.");
  v("unit", &Signal::unit).doc("SI unit of an analogue signal; empty is a plain number.");
  v("from", &Signal::from).doc("Device that sets it; empty is any.");
  v("to", &Signal::to).doc("Device that reads it; empty is any.");
  v("description", &Signal::description).doc("Its description.");
}

/// A program in the world, with the bindings of its names.
struct PlacedProgram {
  std::string name;   ///< unique in the world
  AnyId program;      ///< of kind program
  std::string robot;  ///< robot of the world for motions that name none; "" = its only one
  std::vector<ProgramBinding> bindings;
};
template <class V>
constexpr void fields(V& v, Of<PlacedProgram>) {
  v("name", &PlacedProgram::name).needed().doc("Unique in the world.");
  v("program", &PlacedProgram::program).needed().doc("The placed program.");
  v("robot", &PlacedProgram::robot)
      .doc("Robot for motions that name none; empty is the world's only one.");
  v("bindings", &PlacedProgram::bindings).doc("Bindings of its names.");
}

/// An object that a robot holds at the start.
struct Attachment {
  std::string object, robot;
  std::string link;         ///< of the robot, or a tool of it; "" = its tool
  Placement tool_T_object;  ///< from the link's or tool's frame
};
template <class V>
constexpr void fields(V& v, Of<Attachment>) {
  v("object", &Attachment::object).needed().doc("The held object.");
  v("robot", &Attachment::robot).needed().doc("The robot that holds it.");
  v("link", &Attachment::link).doc("Link or tool of the robot; empty is its tool.");
  v("placement", &Attachment::tool_T_object)
      .flat()
      .doc("Frame of the object in that of the link or tool.");
}

struct World {
  std::string description;
  Vec3 gravity{0, 0, -9.81};  ///< [m/s^2]
  LongList<PlacedObject> objects;
  std::vector<PlacedRobot> robots;
  std::vector<PlacedTrajectory> trajectories;
  std::vector<PlacedFrame> frames;
  std::vector<PlacedLight> lights;
  std::vector<PlacedTask> tasks;
  std::vector<PlacedProgram> programs;
  std::vector<Signal> signals;
  std::vector<Attachment> attachments;  ///< at most one per object
  std::vector<CollisionPairRule> pair_rules;
  Parametric parametric;  ///< its parameters are available to all records as `<name>.<parameter>`
};
template <class V>
constexpr void fields(V& v, Of<World>) {
  v("description", &World::description).doc("Its description.");
  v("parametric", &World::parametric)
      .flat()
      .doc("Parameters, available to all records, and expressions.");
  v("gravity", &World::gravity).unit("m/s^2").doc("Acceleration of free fall.");
  v("objects", &World::objects).by_names().doc("Placed objects and solids.");
  v("robots", &World::robots).by_names().doc("Placed robots.");
  v("trajectories", &World::trajectories).file("trajectory").by_names().doc("Placed trajectories.");
  v("frames", &World::frames).by_names().doc("Named places.");
  v("lights", &World::lights).by_names().doc("Lights.");
  v("tasks", &World::tasks).doc("Placed tasks.");
  v("programs", &World::programs).doc("Placed programs.");
  v("signals", &World::signals).doc("Signals between devices, which tasks set and wait for.");
  v("attachments", &World::attachments).doc("Objects that robots hold at the start.");
  v("pair_rules", &World::pair_rules)
      .doc("Pairs of bodies that may touch, or that are always checked.");
}

}  // namespace robomosp::model
