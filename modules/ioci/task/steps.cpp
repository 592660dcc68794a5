// SPDX-License-Identifier: Apache-2.0
#include "ioci/task/steps.h"

#include <algorithm>
#include <array>
#include <optional>

#include "ioci/core/commands.h"
#include "ioci/core/record_params.h"
#include "ioci/program/in_world.h"
#include "ioci/records/field_values.h"
#include "ioci/trajectory/segments.h"
#include "kernel/type.h"
#include "model/step_fields.h"

namespace robomosp::ioci {
namespace {

using model::StepKind;
using model::TaskStep;

constexpr std::size_t kDeepest = 60;  ///< blocks inside each other

/// What a step says more than the field's declaration.
struct StepNote {
  std::string_view kinds;
  std::string_view word;
  bool is_needed = false;
  std::string_view type = {};  ///< with notes; "@..." = notes only
  std::string_view doc = {};
};
constexpr StepNote kStepNotes[] = {
    {"move", "trajectory", false, "@when(pose is absent and joints is absent)",
     "Trajectory to run, placed at `target`."},
    {"move", "pose", false, "@when(trajectory is absent and joints is absent and target is absent)",
     "Named pose of the robot."},
    {"move", "joints", false, "@when(trajectory is absent and pose is absent and target is absent)",
     "Joint values: of all joints, or of those with motors."},
    {"move", "target", false, "@when(pose is absent and joints is absent)",
     "Pose of the tool, in the world or in `frame`; of a trajectory, its placement."},
    {"move", "tool", false, "",
     "Tool or link of the robot, or an object that it holds, to move to the target; by default the "
     "robot's tool."},
    {"move", "profile", false, "@when(path is joint and trajectory is absent)",
     "Profile of a joint move."},
    {"move", "path", false, "enum(joint|straight) @when(target is present)",
     "Motion of the tool to a target: straight is a line at `tool_speed`."},
    {"move", "tool_speed", false, "@when(path is straight)"},
    {"move", "duration", false, "", "Duration; 0 is as fast as allowed."},
    {"attach", "object", true, "", "Object to attach."},
    {"detach", "object", true, "", "Object to release."},
    {"attach", "link", false, "",
     "Tool or link that holds the object; by default the robot's tool."},
    {"attach", "tcp", false, "",
     "Centre point of the object: until its release, moves without `tool` move this point."},
    {"attach", "reach", false, "",
     "An object farther than this from the tool's point, or from the link and its bodies, is not "
     "attached, which a note reports; by default 5 mm."},
    {"set", "signal", true},
    {"set", "value", true, "expression or bool", "A number, or an expression like a condition."},
    {"wait", "time", false, "", "Time to wait."},
    {"wait", "condition", false, "@when(time is absent)", "Condition to wait for."},
    {"if", "condition", true, "", "Condition of the block."},
    {"call", "task", true},
    {"call", "robot", false, "", "Robot of steps of the task that name none."},
    {"repeat", "count", true},
    {"message", "text", true},
};

/// The type without its condition.
std::string without_when(std::string type) {
  const std::size_t at = type.find("@when(");
  if (at == std::string::npos) return type;
  type.erase(at, type.find(')', at) + 1 - at);
  return std::string(text::trim(type));
}

/// The fields that a kind of step has, as the declarations of TaskStep and their conditions say.
Schema make_step_params(StepKind kind) {
  static const Schema declared = record_params("task", "steps");
  Schema out;
  for (ParamSpec p : declared) {
    if (p.name == "kind" || p.name == "parent") continue;
    const Condition& when = notes_of(p).when;
    const auto left = when.is_always() ? std::optional<std::string>("")
                                       : model::step_condition(kind, when.text());
    if (!left) continue;
    p.type = without_when(std::move(p.type));
    p.name = model::step_word(p.name, kind);
    std::string notes = left->empty() ? std::string() : "@when(" + *left + ")";
    for (const StepNote& n : kStepNotes) {
      if (n.word != p.name || !model::is_step_kind_among(kind, n.kinds)) continue;
      p.required = n.is_needed;
      if (n.type.starts_with('@')) notes = n.type;
      else if (!n.type.empty()) p.type = n.type, notes.clear();
      if (!n.doc.empty()) p.doc = n.doc;
    }
    if (!notes.empty()) p.type += " " + notes;
    out.push_back(std::move(p));
  }
  if (kind == StepKind::move) {
    param_named(out, "profile").default_value = Value("quintic");
    param_named(out, "path").default_value = Value("joint");
    param_named(out, "speed").default_value = Value(1.0);
  }
  if (kind == StepKind::attach) param_named(out, "reach").min = kPositive;
  if (is_block(kind)) {
    out.push_back(defaulted("steps", "list<type:step>", "", List{}, "The steps of the block."));
  }
  return out;
}

/// The same for check(), made once.
const Schema& step_schema(StepKind kind) {
  static const auto all = [] {
    std::array<Schema, model::kStepWords.size()> made;
    for (std::size_t i = 0; i < made.size(); ++i)
      made[i] = plain_params(make_step_params(static_cast<StepKind>(i)));
    return made;
  }();
  return all[static_cast<std::size_t>(kind)];
}

/// Steps as a type: what the fields of each kind name, and when they matter.
std::string step_type() {
  std::vector<std::pair<std::string, Schema>> cases;
  for (std::size_t i = 0; i < model::kStepWords.size(); ++i)
    cases.emplace_back(model::kStepWords[i], make_step_params(static_cast<StepKind>(i)));
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
  Map fields;
  for (const model::Field& f : model::type_of<TaskStep>().fields)
    if (const Value* v = given.find(model::step_word(f.name, kind)))
      fields.set(std::string(f.name), *v);
  TaskStep s;
  RMP_TRY(set_fields(s, fields, {"target", "is_straight", "expression"}));
  s.kind = kind;
  if (has(given, "joints")) {
    RMP_TRY_ASSIGN(s.joints, read_joint_vector(*given.find("joints"), path + ".joints"));
  }
  if (has(given, "target")) {
    RMP_TRY_ASSIGN(s.target, read_placement(rest.find("target"), path + ".target"));
  }
  if (s.profile == "quintic") s.profile.clear();
  s.is_straight = text_of(given, "path") == "straight";
  if (const Value* v = fields.find("expression"))
    s.expression = v->as_string() ? *v->as_string()
                   : v->as_bool() ? (*v->as_bool() ? "1" : "0")
                                  : v->text();
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

/// As steps_value() writes them: one behind the other, each with the number of its block.
Result<std::vector<TaskStep>> read_flat_steps(const CommandContext& ctx, const List& rows,
                                              const std::string& path) {
  const ParamSpec block = between(field("parent", "int", "", "Number of its block."), 0, 1e9);
  std::vector<TaskStep> out;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const std::string here = path + "[" + std::to_string(i + 1) + "]";
    Map row = *rows[i].as_map();
    std::int64_t parent = 0;
    if (const Value* given = row.find("parent")) {
      RMP_TRY_ASSIGN(const Value number, check_value(block, *given, here + ".parent"));
      parent = *number.as_int();
    }
    row.erase("parent");
    row.erase("number");
    const Value step(std::move(row));
    RMP_TRY_ASSIGN(const StepKind kind, kind_of(step, here));
    List inner;
    RMP_TRY_ASSIGN(TaskStep one, read_one(ctx, kind, step, here, inner));
    if (!inner.empty() || parent > static_cast<std::int64_t>(i))
      return error(ErrorCode::invalid_argument,
                   inner.empty() ? "block " + std::to_string(parent) + " is not before this step"
                                 : std::string("steps are given both as parents and in blocks"),
                   "Give each step the number of its block, or the steps of blocks as `steps`.",
                   here);
    one.parent = static_cast<std::int32_t>(parent) - 1;
    out.push_back(std::move(one));
  }
  return out;
}

template <class Rows, class Fn>
Value list_of(const Rows& rows, Fn&& fn) {
  List out;
  for (const auto& row : rows) out.emplace_back(fn(row));
  return out;
}

}  // namespace

std::string step_doc() {
  std::string out =
      "A step is a table: `step` is its kind, the other fields are its parameters.\n\n"
      "| step | field | unit | default | meaning |\n|---|---|---|---|---|\n";
  for (std::size_t i = 0; i < model::kStepWords.size(); ++i) {
    const std::string word = "| `" + std::string(model::kStepWords[i]) + "` | ";
    const Schema fields = make_step_params(static_cast<StepKind>(i));
    for (const ParamSpec& p : fields) {
      const std::string unit = unit_of(p);
      out += word + "`" + p.name + "` | " + (unit == model::kByJoint ? "by joint" : unit) + " | " +
             (p.required                                       ? "required"
              : p.default_value && !p.default_value->as_list() ? "`" + p.default_value->text() + "`"
                                                               : std::string()) +
             " | " + p.doc;
      if (const auto words = words_of(p); !words.empty()) {
        std::vector<std::string> all;
        for (const WordInfo& w : words) all.push_back(w.word);
        out += " One of " + text::enumerate(all) + ".";
      }
      out += " |\n";
    }
  }
  return out +
         "\nConditions are expressions over signals, `time`, the joints `left.q1` and `left.qd1` "
         "of a robot, and the places `left.x` of its tool and `part.x` of an object.";
}

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
    const model::Type& type = model::type_of<TaskStep>();
    for (const model::Field& f : type.fields) {
      if (f.name == "kind" || f.name == "parent") continue;
      Value v = changed_value(&snapshot, type, f, &s);
      if (f.name == "is_straight" && s.is_straight) v = Value("straight");
      if (f.name == "count" && s.kind == StepKind::repeat) v = Value(s.count);
      if (!v.is_nil()) m.set(std::string(model::step_word(f.name, s.kind)), std::move(v));
    }
    out.emplace_back(std::move(m));
  }
  return out;
}

void set_members(Map& out, const document::Snapshot& snapshot, const model::World& w) {
  out.set("frames", list_of(w.frames, [](const model::PlacedFrame& f) {
            return Map{{"name", f.name}, {"placement", placement_value(f.placement)}};
          }));
  out.set("lights", list_of(w.lights, [&](const model::PlacedLight& l) {
            return Map{{"name", l.name},
                       {"kind", model::kLightWords[static_cast<std::size_t>(l.kind)]},
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
                       {"kind", model::kSignalWords[static_cast<std::size_t>(s.kind)]},
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
     .of =
         [](const document::Snapshot& snapshot, const model::Content& whole, const void*) {
           return whole.type == model::info(Kind::task).type
                      ? std::optional(
                            steps_value(snapshot, *static_cast<const model::Task*>(whole.data)))
                      : std::nullopt;
         },
     .read = [](const CommandContext& ctx, void* p, const Value& v,
                const std::string& path) -> Result<bool> {
       const List* rows = v.as_list();
       const auto has_field = [](const char* name) {
         return [name](const Value& row) { return row.as_map() && row.as_map()->find(name); };
       };
       if (!rows || rows->empty() || !std::all_of(rows->begin(), rows->end(), has_field("step")))
         return false;
       auto& steps = *static_cast<std::vector<TaskStep>*>(p);
       if (std::any_of(rows->begin(), rows->end(), has_field("parent"))) {
         RMP_TRY_ASSIGN(steps, read_flat_steps(ctx, *rows, path));
       } else {
         RMP_TRY_ASSIGN(steps, read_steps(ctx, v, path));
       }
       return true;
     }});

/// One step as in that list; without `parent` it stays in its block.
const OwnFormFile kStepForm({.type = model::type_of<TaskStep>,
                             .of = [](const document::Snapshot&, const model::Content&,
                                      const void*) -> std::optional<Value> { return std::nullopt; },
                             .read = [](const CommandContext& ctx, void* p, const Value& v,
                                        const std::string& path) -> Result<bool> {
                               const Map* given = v.as_map();
                               if (!given || !given->find("step")) return false;
                               auto& step = *static_cast<TaskStep*>(p);
                               Map row = *given;
                               std::int32_t parent = step.parent;
                               if (const Value* block = row.find("parent")) {
                                 RMP_TRY_ASSIGN(
                                     const Value number,
                                     check_value(between(field("parent", "int", "", ""), 0, 1e9),
                                                 *block, path + ".parent"));
                                 parent = static_cast<std::int32_t>(*number.as_int()) - 1;
                               }
                               row.erase("parent");
                               row.erase("number");
                               const Value rest(std::move(row));
                               RMP_TRY_ASSIGN(const StepKind kind, kind_of(rest, path));
                               List inner;
                               RMP_TRY_ASSIGN(TaskStep made,
                                              read_one(ctx, kind, rest, path, inner));
                               if (!inner.empty())
                                 return error(ErrorCode::invalid_argument,
                                              "a single step has no steps in it",
                                              "Set \"steps\", or use task.set_step.", path);
                               made.parent = parent;
                               step = std::move(made);
                               return true;
                             }});

}  // namespace

}  // namespace robomosp::ioci
