// SPDX-License-Identifier: Apache-2.0
// Tasks: ordered steps that robots of a world carry out; included by model/records.h (layer: data
// processing). Robots, objects, frames and signals are named as the world names them, so that one
// task serves every world that has members of these names. SI and radians.
#pragma once

namespace robomosp::model {

/// What a step does. Blocks (`repeat`, `when`, `otherwise`) hold the steps that name them as
/// parent.
enum class StepKind : std::uint8_t {
  move,       ///< a robot goes along a trajectory, or to a named pose, joint vector or tool pose
  attach,     ///< an object follows a link or tool from now on (gripping, tool change)
  detach,     ///< an object stays where it is
  set,        ///< a signal takes a value
  wait,       ///< for a time, or until a condition over signals is true
  call,       ///< the steps of another task
  repeat,     ///< its steps `count` times
  when,       ///< its steps if a condition over signals is true
  otherwise,  ///< its steps if that of the `when` right before it is not
  message,    ///< a note in the recording
};

/// A step. What a kind does not use is left empty.
struct TaskStep {
  StepKind kind = StepKind::message;
  std::int32_t parent = -1;  ///< index of the block it is in (< own index), -1 = the task itself
  std::string robot;         ///< of the world; "" = the one that the world gives the task

  // move: one of trajectory, pose, joints and target
  TrajectoryId trajectory;
  std::string pose;                 ///< a named pose of the robot
  std::vector<double> joints;       ///< [rad, m or 1]
  std::optional<Placement> target;  ///< frame_T_tool; of a trajectory frame_T_trajectory
  std::string frame;         ///< of the world, or an object, that target stands in; "" = world
  std::string profile;       ///< of a joint move: "quintic" (as "") or "trapezoidal"
  bool is_straight = false;  ///< to a target: the tool goes straight instead of the joints
  double speed = 1;          ///< share of the limits of the joints, 0 < speed <= 1
  double tool_speed = 0;     ///< of a straight move [m/s]; 0 = 0.25
  double duration = 0;       ///< of a move, 0 = as fast as allowed; of a wait [s]

  // attach, detach
  std::string object;
  std::string link;  ///< of the robot, or a tool of it; "" = its tool

  // set, wait, when
  std::string signal;
  std::string expression;  ///< value or condition over signals and numbers
  double timeout = 0;      ///< of a wait for a condition [s]; 0 = waits for ever

  TaskId task;             ///< call
  std::int64_t count = 1;  ///< repeat
  std::string text;        ///< message
};

struct Task {
  std::string description;
  std::vector<TaskStep> steps;  ///< in pre-order: the steps of a block stand right behind it
};

[[nodiscard]] constexpr bool is_block(StepKind k) {
  return k == StepKind::repeat || k == StepKind::when || k == StepKind::otherwise;
}

/// How files and commands name the kinds, in order of StepKind.
inline constexpr std::string_view kStepWords[] = {"move", "attach", "detach", "set",  "wait",
                                                  "call", "repeat", "if",     "else", "message"};
[[nodiscard]] constexpr std::string_view to_string(StepKind k) {
  return kStepWords[static_cast<std::size_t>(k)];
}

// ---- what a world has for tasks ----

/// A named place that tasks and people refer to.
struct PlacedFrame {
  std::string name;
  Placement placement;  ///< world_T_frame
};

enum class LightKind : std::uint8_t {
  sun,    ///< parallel light along -z of its frame
  point,  ///< from its origin to all sides
  spot,   ///< from its origin along -z of its frame, within `angle` of it
};

struct PlacedLight {
  std::string name;
  LightKind kind = LightKind::point;
  Placement placement;   ///< world_T_light
  Colour colour;         ///< sRGB; a is of no account
  double intensity = 1;  ///< 1 = as bright as the program's own
  double angle = 0.5;    ///< half the opening of a spot [rad]
};

/// An object that a robot holds when the world starts.
struct Attachment {
  std::string object, robot;
  std::string link;         ///< of the robot, or a tool of it; "" = its tool
  Placement tool_T_object;  ///< from the link's or tool's frame
};

enum class SignalKind : std::uint8_t { digital, analogue };

/// A wire between two devices; tasks set it and wait for it.
struct Signal {
  std::string name;  ///< a letter, then letters, digits and _
  SignalKind kind = SignalKind::digital;
  std::string unit;      ///< SI, of an analogue one; "" = a plain number
  double initial = 0;    ///< a digital one is 0 or 1
  std::string from, to;  ///< members of the world, or devices of any name; "" = any
  std::string description;
};

struct PlacedTask {
  std::string name;
  TaskId task;
  std::string robot;  ///< that steps mean which name none; "" = every step names its own
};

}  // namespace robomosp::model
