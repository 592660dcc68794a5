// SPDX-License-Identifier: Apache-2.0
// Tasks: ordered steps carried out by robots of a world (layer: data processing, model). Robots,
// objects, frames and signals are named as in the world, so that one task serves every world with
// members of these names. SI and radians.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "model/basics.h"
#include "model/fields.h"
#include "model/kind.h"

namespace robomosp::model {

/// Kinds of steps. Blocks (`repeat`, `when`, `otherwise`) contain the steps that name them as
/// parent.
enum class StepKind : std::uint8_t {
  move,       ///< moves a robot along a trajectory, or to a named pose, joint vector or tool pose
  attach,     ///< an object follows a link or tool from now on (gripping, tool change)
  detach,     ///< an object stays where it is
  set,        ///< sets a signal
  wait,       ///< for a time, or until a condition over signals is true
  call,       ///< the steps of another task
  repeat,     ///< its steps `count` times
  when,       ///< its steps if a condition over signals is true
  otherwise,  ///< its steps if the condition of the `when` right before it is false
  message,    ///< a note in the recording
};
/// Words of the kinds in files and commands, in order of StepKind.
inline constexpr std::array<std::string_view, 10> kStepWords{
    "move", "attach", "detach", "set", "wait", "call", "repeat", "if", "else", "message"};
constexpr std::span<const std::string_view> words(Of<StepKind>) { return kStepWords; }
[[nodiscard]] constexpr std::string_view to_string(StepKind k) {
  return kStepWords[static_cast<std::size_t>(k)];
}
[[nodiscard]] constexpr bool is_block(StepKind k) {
  return k == StepKind::repeat || k == StepKind::when || k == StepKind::otherwise;
}

/// A step. Fields that do not apply to a kind are empty.
struct TaskStep {
  StepKind kind = StepKind::message;
  std::int32_t parent = -1;  ///< index of the block it is in (< own index), -1 = the task itself
  std::string robot;         ///< of the world; "" = the default robot of the task in the world

  // move: one of trajectory, pose, joints and target
  TrajectoryId trajectory;
  std::string pose;                 ///< a named pose of the robot
  std::vector<double> joints;       ///< [rad, m or 1]
  std::optional<Placement> target;  ///< frame_T_tool; of a trajectory frame_T_trajectory
  std::string frame;         ///< reference frame of target: of the world, or an object; "" = world
  std::string profile;       ///< of a joint move: "quintic" (as "") or "trapezoidal"
  bool is_straight = false;  ///< to a target: the tool moves along a straight line
  double speed = 1;          ///< fraction of the joints' limits, 0 < speed <= 1
  double tool_speed = 0;     ///< of a straight move [m/s]; 0 = 0.25
  double duration = 0;       ///< of a move, 0 = as fast as allowed; of a wait [s]

  // attach, detach
  std::string object;
  std::string link;  ///< of the robot, or a tool of it; "" = its tool
  std::string tcp;   ///< attach: centre point of the object used by later moves; "" = none
  double reach = 0;  ///< attach: objects farther from tool or link are ignored [m]; 0 = 5 mm

  // set, wait, when
  std::string signal;
  std::string expression;  ///< value or condition over signals and numbers
  double timeout = 0;      ///< of a wait for a condition [s]; 0 = no timeout

  TaskId task;             ///< call
  std::int64_t count = 1;  ///< repeat
  std::string text;        ///< message
};
template <class V>
constexpr void fields(V& v, Of<TaskStep>) {
  constexpr auto is_move = [](const void* s) {
    return static_cast<const TaskStep*>(s)->kind == StepKind::move;
  };
  v("kind", &TaskStep::kind).needed().doc("Kind of the step.");
  v("parent", &TaskStep::parent).index_of("steps").doc("The block that contains it.");
  v("robot", &TaskStep::robot)
      .doc("Robot of the world; empty is the one that the world assigns to the task.");
  v("trajectory", &TaskStep::trajectory).doc("Trajectory of a move.");
  v("pose", &TaskStep::pose).doc("Named pose of a move.");
  v("joints", &TaskStep::joints).unit(kByJoint).counts_if(is_move).doc("Joint vector of a move.");
  v("target", &TaskStep::target)
      .counts_if(is_move)
      .doc("Target pose of a move, or placement of its trajectory.");
  v("frame", &TaskStep::frame)
      .doc("Frame or object in which the target is given; empty is the world.");
  v("profile", &TaskStep::profile).doc("Profile of a joint move; empty is quintic.");
  v("is_straight", &TaskStep::is_straight).doc("Whether the tool moves straight to the target.");
  v("speed", &TaskStep::speed)
      .counts_if(is_move)
      .above(0)
      .range(0, 1)
      .doc("Share of the joints' limits.");
  v("tool_speed", &TaskStep::tool_speed)
      .counts_if(is_move)
      .unit("m/s")
      .at_least(0)
      .doc("Speed of a straight move; 0 is 0.25 m/s.");
  v("duration", &TaskStep::duration)
      .counts_if([](const void* s) {
        const auto& step = *static_cast<const TaskStep*>(s);
        return step.kind == StepKind::move ||
               (step.kind == StepKind::wait && step.expression.empty());
      })
      .unit("s")
      .at_least(0)
      .doc("Duration of a move, 0 is as fast as allowed; of a wait.");
  v("object", &TaskStep::object).doc("Object to attach or detach.");
  v("link", &TaskStep::link).doc("Link or tool of the robot; empty is its tool.");
  v("tcp", &TaskStep::tcp)
      .doc("Centre point of an attached object that the robot's moves use; empty is none.");
  v("reach", &TaskStep::reach)
      .counts_if(
          [](const void* s) { return static_cast<const TaskStep*>(s)->kind == StepKind::attach; })
      .unit("m")
      .at_least(0)
      .doc("For an attach: an object farther from tool or link is not attached; 0 is 5 mm.");
  v("signal", &TaskStep::signal).doc("Signal to set.");
  v("expression", &TaskStep::expression).doc("Value or condition over signals and numbers.");
  v("timeout", &TaskStep::timeout)
      .counts_if([](const void* s) {
        const auto& step = *static_cast<const TaskStep*>(s);
        return step.kind == StepKind::wait && !step.expression.empty();
      })
      .unit("s")
      .at_least(0)
      .doc("Timeout of a wait for a condition; 0 waits for ever.");
  v("task", &TaskStep::task).doc("Task to call.");
  v("count", &TaskStep::count).range(0, 1'000'000).doc("Number of repetitions.");
  v("text", &TaskStep::text).doc("Text of a message.");
}

struct Task {
  std::string description;
  std::vector<TaskStep> steps;  ///< in pre-order: the steps of a block follow it directly
  Parametric parametric = {};
};
template <class V>
constexpr void fields(V& v, Of<Task>) {
  v("description", &Task::description).doc("Its description.");
  v("parametric", &Task::parametric).flat().doc("Parameters and expressions.");
  v("steps", &Task::steps).doc("In order; the steps of a block follow it directly.");
}

}  // namespace robomosp::model
