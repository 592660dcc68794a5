// SPDX-License-Identifier: Apache-2.0
#include "ioci/task/steps.h"

#include <algorithm>

#include "ioci/core/commands.h"
#include "ioci/program/in_world.h"
#include "ioci/records/field_values.h"
#include "ioci/trajectory/segments.h"
#include "kernel/type.h"

namespace robomosp::ioci {
namespace {

using model::StepKind;
using model::TaskStep;

constexpr std::size_t kDeepest = 60;  ///< blocks inside each other

Schema step_schema(StepKind kind) {
  const ParamSpec robot = optional("robot", "string", "", "Robot of the world.");
  switch (kind) {
    case StepKind::move:
      return {robot,
              optional("trajectory", "ref:trajectory", "", "Trajectory to follow."),
              optional("pose", "string", "", "A named pose of the robot."),
              optional("joints", "any", "", "Joint values."),
              optional("target", "any", "", "Pose of the tool, or of the trajectory."),
              optional("frame", "string", "",
                       "Frame or object of the world in which the target is given."),
              optional("tool", "string", "", "Tool, link or held object to move."),
              choice("profile", {"quintic", "trapezoidal", "s_curve", "time_optimal"},
                     "Profile of a joint move."),
              choice("path", {"joint", "straight"}, "Motion of the tool to a target."),
              defaulted("speed", "real", "", 1.0, "Share of the joints' limits."),
              optional("tool_speed", "real", "m/s", "Speed of a straight move."),
              optional("duration", "real", "s", "Duration of the move.")};
    case StepKind::attach:
      return {robot, needed("object", "string", "", "Object of the world."),
              optional("link", "string", "", "Link or tool of the robot."),
              optional("tcp", "string", "",
                       "Centre point of the object that the robot's moves use from then on."),
              above_zero(optional(
                  "reach", "real", "m",
                  "An object farther from the tool or link is not attached; 5 mm if omitted."))};
    case StepKind::detach: return {needed("object", "string", "", "Object of the world.")};
    case StepKind::set:
      return {needed("signal", "string", "", "Signal of the world."),
              needed("value", "any", "", "A number, or an expression like a condition.")};
    case StepKind::wait:
      return {optional("time", "real", "s", "Time to wait."),
              optional("condition", "string", "", "Condition over signals, time and places."),
              optional("timeout", "real", "s", "Longest time to wait.")};
    case StepKind::call: return {robot, needed("task", "ref:task", "", "The task to run.")};
    case StepKind::repeat:
      return {needed("count", "int", "", "Number of repetitions."),
              defaulted("steps", "list", "", List{}, "What.")};
    case StepKind::when:
      return {needed("condition", "string", "", "Condition over signals, time and places."),
              defaulted("steps", "list", "", List{}, "Steps if it is true.")};
    case StepKind::otherwise:
      return {defaulted("steps", "list", "", List{}, "Steps if the condition is not true.")};
    case StepKind::message: return {needed("text", "string", "", "Text of the note.")};
  }
  return {};
}

/// Steps as a type: what the fields of each kind name, and when they matter.
std::string step_type() {
  std::vector<std::pair<std::string, Schema>> cases;
  for (std::size_t i = 0; i < model::kStepWords.size(); ++i) {
    Schema s = step_schema(static_cast<StepKind>(i));
    for (const auto& [field, type] : std::initializer_list<std::pair<const char*, const char*>>{
             {"robot", "member:robot of world"},
             {"pose",
              "member:pose of robot @when(trajectory is absent and joints is absent and "
              "target is absent)"},
             {"joints",
              "joints of robot @when(trajectory is absent and pose is absent and target "
              "is absent)"},
             {"trajectory", "ref:trajectory @when(pose is absent and joints is absent)"},
             {"target", "pose @when(pose is absent and joints is absent)"},
             {"frame", "member:frame of world @when(target is present)"},
             {"tool", "member:link_or_tool of robot"},
             {"profile", "enum @when(path is joint and trajectory is absent)"},
             {"path", "enum @when(target is present)"},
             {"tool_speed", "real @above(0) @when(path is straight)"},
             {"object", "member:object of world"},
             {"link", "member:link_or_tool of robot"},
             {"tcp", "member:tcp of object"},
             {"signal", "member:signal of world"},
             {"value", "expression or bool"},
             {"time", "real @when(condition is absent)"},
             {"condition", "script:condition"},
             {"timeout", "real @when(condition is present)"},
             {"steps", "list<type:step>"}})
      if (std::any_of(s.begin(), s.end(), [&](const ParamSpec& p) { return p.name == field; }))
        retype(s, field, type);
    // A wait has a time or a condition.
    if (static_cast<StepKind>(i) == StepKind::wait)
      retype(s, "condition", "script:condition @when(time is absent)");
    cases.emplace_back(model::kStepWords[i], std::move(s));
  }
  return variant_type("step", cases);
}
const NamedType kStepType("step", "map", step_type);

Result<StepKind> kind_of(const Value& value, const std::string& path) {
  const Map* given = value.as_map();
  const Value* word = given ? given->find("step") : nullptr;
  if (!word || !word->as_string())
    return error(ErrorCode::invalid_argument, value.text() + " is not a step",
                 "Give a table such as {step = \"move\", robot = \"arm\", pose = \"home\"}.", path);
  const std::vector<std::string> words(std::begin(model::kStepWords), std::end(model::kStepWords));
  const auto it = std::find(words.begin(), words.end(), *word->as_string());
  if (it != words.end()) return static_cast<StepKind>(it - words.begin());
  Error e = unknown_name("kind of step", *word->as_string(), words);
  return std::move(e).in(path);
}

Result<TaskStep> read_one(const CommandContext& ctx, StepKind kind, const Value& value,
                          const std::string& path, List& inner) {
  Map rest;
  for (const auto& [key, v] : *value.as_map())
    if (key != "step") rest.set(key, v);
  RMP_TRY_ASSIGN(const Map given, read_map(ctx, step_schema(kind), Value(rest), path));
  TaskStep s;
  s.kind = kind;
  const auto word = [&](const char* field, std::string& out) {
    if (has(given, field)) out = text_of(given, field);
  };
  word("robot", s.robot);
  word("pose", s.pose);
  word("frame", s.frame);
  word("object", s.object);
  word(kind == StepKind::move ? "tool" : "link", s.link);
  word("tcp", s.tcp);
  word("signal", s.signal);
  word("condition", s.expression);
  word("text", s.text);
  if (has(given, "trajectory")) s.trajectory = typed<model::Trajectory>(given, "trajectory");
  if (has(given, "task")) s.task = typed<model::Task>(given, "task");
  if (has(given, "joints")) {
    RMP_TRY_ASSIGN(s.joints, read_joint_vector(*given.find("joints"), path + ".joints"));
  }
  if (has(given, "target")) {
    RMP_TRY_ASSIGN(s.target, read_placement(rest.find("target"), path + ".target"));
  }
  if (has(given, "profile") && text_of(given, "profile") != "quintic")
    s.profile = text_of(given, "profile");
  if (has(given, "path")) s.is_straight = text_of(given, "path") == "straight";
  if (has(given, "speed")) s.speed = real(given, "speed");
  if (has(given, "tool_speed")) s.tool_speed = real(given, "tool_speed");
  if (has(given, "reach")) s.reach = real(given, "reach");
  if (has(given, "duration")) s.duration = real(given, "duration");
  if (has(given, "time")) s.duration = real(given, "time");
  if (has(given, "timeout")) s.timeout = real(given, "timeout");
  if (has(given, "count")) s.count = integer(given, "count");
  if (has(given, "value")) {
    const Value& v = *given.find("value");
    s.expression = v.as_string() ? *v.as_string()
                   : v.as_bool() ? (*v.as_bool() ? "1" : "0")
                                 : v.text();
  }
  if (has(given, "steps")) inner = *given.find("steps")->as_list();
  return s;
}

Result<void> append(const CommandContext& ctx, const Value& value, const std::string& path,
                    std::int32_t parent, std::size_t depth, std::vector<TaskStep>& out) {
  if (depth > kDeepest)
    return error(ErrorCode::invalid_argument,
                 "more than " + std::to_string(kDeepest) + " blocks are nested",
                 "Call a task instead.", path);
  RMP_TRY_ASSIGN(const StepKind kind, kind_of(value, path));
  List inner;
  RMP_TRY_ASSIGN(TaskStep step, read_one(ctx, kind, value, path, inner));
  step.parent = parent;
  const auto own = static_cast<std::int32_t>(out.size());
  out.push_back(std::move(step));
  for (std::size_t i = 0; i < inner.size(); ++i)
    RMP_TRY(
        append(ctx, inner[i], path + ".steps[" + std::to_string(i + 1) + "]", own, depth + 1, out));
  return {};
}

template <class Rows, class Fn>
Value list_of(const Rows& rows, Fn&& fn) {
  List out;
  for (const auto& row : rows) out.emplace_back(fn(row));
  return out;
}

}  // namespace

const char* const kStepDoc =
    "A step is a table: `step` is its kind, the other fields are its parameters. `move`: `robot` "
    "and one of `pose` (a named one), `joints` (all, or those with motors), `target` (a pose, in "
    "the world or in `frame`; with path = \"straight\" in a straight line at `tool_speed`) or "
    "`trajectory` (placed at `target`); `tool` names a tool or link of the robot, or an object "
    "that it holds, which is moved there instead of the robot's tool; joint moves take `profile` "
    "quintic, trapezoidal, s_curve or time_optimal, `speed` (share of the joints' limits) and "
    "`duration`. `attach` and `detach`: `object`, `robot`, `link` (a link or tool); with `tcp`, a "
    "centre point of the object, moves that name no `tool` move that point until the object is "
    "released; an object farther than `reach` (5 mm) from the tool's point, or from the link and "
    "its bodies, is not attached, which a note reports. `set`: `signal`, `value`. `wait`: `time`, "
    "or `condition` with `timeout`. `call`: `task`. `repeat`: `count`, `steps`. `if`: `condition`, "
    "`steps`; `else`: `steps`. `message`: `text`. Conditions are expressions over signals, `time`, "
    "the joints `left.q1` and `left.qd1` of a robot, and the places `left.x` of its tool and "
    "`part.x` of an object.";

Result<std::vector<TaskStep>> read_steps(const CommandContext& ctx, const Value& value,
                                         const std::string& path) {
  std::vector<TaskStep> out;
  RMP_TRY(append(ctx, value, path, -1, 0, out));
  return out;
}

Value steps_value(const document::Snapshot& snapshot, const model::Task& task) {
  List out;
  for (std::size_t i = 0; i < task.steps.size(); ++i) {
    const TaskStep& s = task.steps[i];
    Map m{{"number", static_cast<std::int64_t>(i + 1)},
          {"parent", static_cast<std::int64_t>(s.parent + 1)},
          {"step", std::string(to_string(s.kind))}};
    const auto word = [&](const char* field, const std::string& text) {
      if (!text.empty()) m.set(field, text);
    };
    const auto number = [&](const char* field, double v, double standard) {
      if (v != standard) m.set(field, v);
    };
    word("robot", s.robot);
    if (s.trajectory) m.set("trajectory", ref_value(snapshot, s.trajectory));
    word("pose", s.pose);
    if (!s.joints.empty()) m.set("joints", NumericArray(s.joints));
    if (s.target) m.set("target", placement_value(*s.target));
    word("frame", s.frame);
    word("profile", s.profile);
    if (s.is_straight) m.set("path", "straight");
    number("speed", s.speed, 1);
    number("tool_speed", s.tool_speed, 0);
    number(s.kind == StepKind::wait ? "time" : "duration", s.duration, 0);
    word("object", s.object);
    word(s.kind == StepKind::move ? "tool" : "link", s.link);
    word("tcp", s.tcp);
    number("reach", s.reach, 0);
    word("signal", s.signal);
    word(s.kind == StepKind::set ? "value" : "condition", s.expression);
    number("timeout", s.timeout, 0);
    if (s.task) m.set("task", ref_value(snapshot, s.task));
    if (s.kind == StepKind::repeat) m.set("count", s.count);
    word("text", s.text);
    out.emplace_back(std::move(m));
  }
  return out;
}

void set_members(Map& out, const document::Snapshot& snapshot, const model::World& w) {
  constexpr const char* kLights[] = {"sun", "point", "spot"};
  out.set("frames", list_of(w.frames, [](const model::PlacedFrame& f) {
            return Map{{"name", f.name}, {"placement", placement_value(f.placement)}};
          }));
  out.set("lights", list_of(w.lights, [&](const model::PlacedLight& l) {
            return Map{{"name", l.name},
                       {"kind", kLights[static_cast<std::size_t>(l.kind)]},
                       {"placement", placement_value(l.placement)},
                       {"colour", colour_value(l.colour)},
                       {"intensity", l.intensity},
                       {"angle", l.angle}};
          }));
  out.set("tasks", list_of(w.tasks, [&](const model::PlacedTask& t) {
            return Map{{"name", t.name}, {"task", ref_value(snapshot, t.task)}, {"robot", t.robot}};
          }));
  out.set("programs", list_of(w.programs, [&](const model::PlacedProgram& p) {
            return Map{{"name", p.name},
                       {"program", ref_value(snapshot, p.program)},
                       {"robot", p.robot},
                       {"bindings", list_of(p.bindings, binding_value)}};
          }));
  out.set("signals", list_of(w.signals, [](const model::Signal& s) {
            return Map{{"name", s.name},
                       {"kind", s.kind == model::SignalKind::digital ? "digital" : "analogue"},
                       {"unit", s.unit},
                       {"initial", s.initial},
                       {"from", s.from},
                       {"to", s.to},
                       {"description", s.description}};
          }));
  out.set("attachments", list_of(w.attachments, [](const model::Attachment& a) {
            return Map{{"object", a.object},
                       {"robot", a.robot},
                       {"link", a.link},
                       {"placement", placement_value(a.tool_T_object)}};
          }));
}

namespace {

const OwnFormFile kStepsForm(
    {.type = model::type_of<TaskStep>,
     .is_list = true,
     .of = [](const document::Snapshot& snapshot, const model::Content& whole, const void*) {
       return whole.type == model::info(Kind::task).type
                  ? std::optional(
                        steps_value(snapshot, *static_cast<const model::Task*>(whole.data)))
                  : std::nullopt;
     }});

}  // namespace

}  // namespace robomosp::ioci
