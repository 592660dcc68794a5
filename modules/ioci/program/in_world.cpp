// SPDX-License-Identifier: Apache-2.0
// Commands for programs in worlds: where they run, what their names mean there, and runs.
#include "ioci/program/in_world.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <set>

#include "ioci/core/commands.h"
#include "ioci/core/record_params.h"
#include "ioci/program/alone_inputs.h"
#include "ioci/program/run_files.h"
#include "ioci/program/workshop.h"
#include "ioci/world/members.h"
#include "program_source/bound_values.h"

namespace robomosp::ioci {
namespace {

using model::BindingKind;
using model::PlacedProgram;
using model::Program;
using model::ProgramBinding;

bool same_name(std::string_view a, std::string_view b) {
  return a.size() == b.size() && std::equal(a.begin(), a.end(), b.begin(), [](char x, char y) {
           return std::tolower(static_cast<unsigned char>(x)) ==
                  std::tolower(static_cast<unsigned char>(y));
         });
}

/// Changes what a world says of one of its programs.
template <class Fn>
Result<void> edit_place(CommandContext& ctx, const ProgramPlace& place, Fn&& fn) {
  auto done = change<model::World>(ctx, AnyId(place.world),
                                   [&](model::World& w) { return fn(w.programs[place.at]); });
  if (!done.ok()) return std::move(done).error().in(name_in(ctx, AnyId(place.world)));
  return {};
}

Result<Value> add_to_world(CommandContext& ctx, const Map& args) {
  PlacedProgram made;
  RMP_TRY(set_fields(made, args, {"robot"}));
  if (has(args, "robot")) {
    RMP_TRY_ASSIGN(const std::size_t at,
                   find_robot(ctx, typed<model::World>(args), *args.find("robot"), "robot"));
    made.robot = ctx.snapshot().get(typed<model::World>(args))->robots[at].name;
  }
  const std::string wanted = ctx.snapshot().find(made.program)->name;
  RMP_TRY(change_world(ctx, args, [&](model::World& w) -> Result<void> {
    RMP_TRY_ASSIGN(made.name, member_name(w, args, wanted));
    w.programs.push_back(made);
    return {};
  }));
  return Value(made.name);
}

Result<Value> remove_program(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const std::size_t at,
                 find_program(ctx, typed<model::World>(args), *args.find("name"),
                              name_in(ctx, ref(args, "id"))));
  return change_world(ctx, args, [&](model::World& w) -> Result<void> {
    w.programs.erase(w.programs.begin() + static_cast<std::ptrdiff_t>(at));
    return {};
  });
}

Result<Value> list_programs(CommandContext& ctx, const Map& args) {
  List out;
  for (const PlacedProgram& p : content<model::World>(ctx, args).programs)
    out.emplace_back(Map{{"name", p.name},
                         {"program", ctx.snapshot().find(p.program)->name},
                         {"robot", p.robot},
                         {"bindings", static_cast<std::int64_t>(p.bindings.size())}});
  return Value(std::move(out));
}

/// Three numbers or expressions as texts; "" = 0.
Result<void> read_expressions(const Map& args, const char* name, const char* unit,
                              std::array<std::string*, 3> out) {
  if (!has(args, name)) return {};
  const Value& given = *args.find(name);
  std::vector<Value> all;
  if (const List* list = given.as_list()) all.assign(list->begin(), list->end());
  else if (const NumericArray* numbers = given.as_array())
    for (const double x : numbers->data()) all.emplace_back(x);
  if (all.size() != out.size())
    return error(
        ErrorCode::invalid_argument,
        std::string(name) + " must be three numbers or expressions, but this is " + given.text(),
        "Such as {0, 0, \"height + 50 mm\"}.", name);
  for (std::size_t i = 0; i < out.size(); ++i) {
    if (const std::string* text = all[i].as_string()) {
      *out[i] = *text;
    } else if (all[i].is_number() && std::isfinite(all[i].number())) {
      *out[i] = all[i].number() == 0 ? "" : text::print(all[i].number()) + " " + unit;
    } else {
      return error(ErrorCode::invalid_argument,
                   all[i].text() + " is neither a number nor an expression",
                   "Such as {0, 0, \"height + 50 mm\"}.", name);
    }
  }
  return {};
}

Result<Value> bind(CommandContext& ctx, const Map& args) {
  const AnyId id = ref(args, "id");
  RMP_TRY_ASSIGN(const ProgramPlace place, place_of(ctx, args));
  ProgramBinding b;
  RMP_TRY(set_fields(b, args));
  const std::string word = text_of(args, "kind");
  const auto needs = [&](const char* what, bool is_there) -> Result<void> {
    if (is_there) return {};
    return error(ErrorCode::invalid_argument,
                 "a binding of kind " + text::quote(word) + " needs " + what,
                 std::string("Give ") + what + ".", what);
  };
  if (b.kind != BindingKind::robot) RMP_TRY(needs("name", !b.name.empty()));
  if (b.kind == BindingKind::signal || b.kind == BindingKind::joint ||
      b.kind == BindingKind::point || b.kind == BindingKind::task)
    RMP_TRY(needs("to", !b.to.empty()));
  if (b.kind == BindingKind::value) RMP_TRY(needs("expression", has(args, "expression")));
  const auto only = [&](const char* what, bool is_of) -> Result<void> {
    if (is_of || !has(args, what)) return {};
    return error(ErrorCode::invalid_argument,
                 "a binding of kind " + text::quote(word) + " has no " + what, "Leave it out.",
                 what);
  };
  RMP_TRY(only("frame", b.kind == BindingKind::robot));
  RMP_TRY(only("tool", b.kind == BindingKind::robot || b.kind == BindingKind::grip));
  RMP_TRY(only("joint", b.kind == BindingKind::joint));
  RMP_TRY(only("reach", b.kind == BindingKind::grip));
  RMP_TRY(only("value", b.kind == BindingKind::free));
  RMP_TRY(only("to", b.kind != BindingKind::free));
  if (has(args, "robot")) {
    if (b.kind != BindingKind::grip && b.kind != BindingKind::point)
      return error(ErrorCode::invalid_argument,
                   "only a grip and a point can have an additional robot", "Give the robot as to.",
                   "robot");
    b.joint = text_of(args, "robot");
  }
  RMP_TRY(only("at", b.kind == BindingKind::point));
  RMP_TRY(only("position", b.kind == BindingKind::point));
  RMP_TRY(only("rpy", b.kind == BindingKind::point));
  RMP_TRY(only("expression", b.kind == BindingKind::value));
  RMP_TRY(read_expressions(args, "position", "m", {&b.x, &b.y, &b.z}));
  RMP_TRY(read_expressions(args, "rpy", "rad", {&b.roll, &b.pitch, &b.yaw}));
  if (model::gives_value(b.kind)) {
    // It has to mean something now: another program than this would be posted without a word.
    PlacedProgram trial = *place.placed;
    const ProgramPlace tried{place.world, place.at, &trial};
    std::erase_if(trial.bindings,
                  [](const ProgramBinding& old) { return old.kind != BindingKind::robot; });
    RMP_TRY_ASSIGN(const auto plain, compile_program(ctx, id, &tried));
    trial.bindings.push_back(b);
    auto found = program_source::bound_values(workshop_of(ctx), tried, plain->code());
    if (!found.ok()) return std::move(found).error();
    RMP_TRY(compile_program(ctx, id, &tried));
  }
  RMP_TRY(edit_place(ctx, place, [&](PlacedProgram& p) -> Result<void> {
    auto& all = p.bindings;
    // A name means one thing: robots are apart from signals and joints.
    std::erase_if(all, [&](const ProgramBinding& old) {
      return same_name(old.name, b.name) &&
             (old.kind == BindingKind::robot) == (b.kind == BindingKind::robot);
    });
    all.push_back(b);
    return {};
  }));
  return Value();
}

Result<Value> unbind(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const ProgramPlace place, place_of(ctx, args));
  const std::string name = text_of(args, "name");
  RMP_TRY(edit_place(ctx, place, [&](PlacedProgram& p) -> Result<void> {
    auto& all = p.bindings;
    if (std::erase_if(all, [&](const ProgramBinding& b) { return same_name(b.name, name); }) > 0)
      return {};
    std::vector<std::string> known;
    for (const ProgramBinding& b : all) known.push_back(b.name);
    return unknown_name("binding", name, known);
  }));
  return Value();
}

Result<Value> bindings(CommandContext& ctx, const Map& args) {
  List out;
  const auto places = places_of(ctx.snapshot(), ref(args, "id"), args);
  // What is asked for by name, and is not there, is no place without bindings.
  if (places.empty() && (has(args, "world") || has(args, "name_there")))
    RMP_TRY(place_of(ctx, args));
  for (const ProgramPlace& x : places)
    for (const ProgramBinding& b : x.placed->bindings) {
      Map one{{"name_there", x.placed->name}, {"world", Application::handle(AnyId(x.world))}};
      for (const auto& [key, value] : binding_value(b)) one.append(key, value);
      out.emplace_back(std::move(one));
    }
  return Value(std::move(out));
}

Result<Value> set_profile(CommandContext& ctx, const Map& args) {
  RMP_TRY(ctx.edit().edit(ref(args, "id"), [&](model::Record& r) -> Result<void> {
    auto& p = std::get<model::OtherContent>(r.body).as<Program>();
    p.target_profile = text_of(args, "profile");
    return {};
  }));
  return Value();
}
Result<Value> profile(CommandContext& ctx, const Map& args) {
  return Value(program_source::program_in(ctx.snapshot(), ref(args, "id"))->target_profile);
}

std::string with_cell(const char* rest) {
  return with_arm(
             "local cell = world.create{name = \"cell\"}\ncell:add_robot{robot = arm}\n"
             "cell:add_signal{name = \"ready\"}\n"
             "local there = program.create{name = \"there\", source = [[\n"
             "PROGRAM there;\n"
             "SIGNAL\n"
             "  OUTPUT BOOL: done AT 1;\n"
             "BEGIN\n"
             "  WAIT 0.5 SEC;\n"
             "  done := TRUE;\n"
             "ENDPROGRAM;\n"
             "]]}\ncell:add_program{program = there}\n"
             "there:bind{kind = \"signal\", name = \"done\", to = \"ready\"}\n") +
         rest;
}

}  // namespace

program_source::PlaceWish place_wish(const Map& args) {
  program_source::PlaceWish out;
  out.world = typed<model::World>(args, "world");
  if (has(args, "name_there")) out.name = text_of(args, "name_there");
  return out;
}

ParamSpec values_field() {
  return optional("values", "map", "",
                  "Values of variables of the program, assigned after its declarations and before "
                  "its first statement: numbers, true and false, or expressions of the language.");
}

Map binding_value(const ProgramBinding& b) {
  const bool has_robot = b.kind == BindingKind::grip || b.kind == BindingKind::point;
  return Map{{"kind", std::string(to_string(b.kind))},
             {"name", b.name},
             {"to", b.to},
             {"frame", b.frame},
             {"tool", b.tool},
             {"joint", has_robot ? std::string() : b.joint},
             {"robot", has_robot ? b.joint : std::string()},
             {"reach", b.reach},
             {"value", b.value},
             {"at", b.at},
             {"position", List{Value(b.x), Value(b.y), Value(b.z)}},
             {"rpy", List{Value(b.roll), Value(b.pitch), Value(b.yaw)}},
             {"expression", b.expression}};
}

std::vector<ProgramPlace> places_of(const document::Snapshot& snapshot, AnyId program,
                                    const Map& args) {
  return program_source::places_of(snapshot, program, place_wish(args));
}

Result<ProgramPlace> place_of(CommandContext& ctx, const Map& args) {
  return program_source::place_of(ctx.snapshot(), ref(args, "id"), place_wish(args));
}

Result<std::vector<program::Preset>> read_presets(const Value* given, std::string_view path) {
  std::vector<program::Preset> out;
  if (!given || given->is_nil()) return out;
  const Map* map = given->as_map();
  if (!map)
    return error(ErrorCode::invalid_argument,
                 "values must be a table with the names of variables as keys",
                 "Give values = {n = 3}.", std::string(path));
  for (const auto& [name, value] : *map) {
    std::string text;
    if (const bool* b = value.as_bool()) text = *b ? "TRUE" : "FALSE";
    else if (const std::string* s = value.as_string()) text = *s;
    else if (value.is_number()) text = value.text();
    else
      return error(ErrorCode::invalid_argument,
                   "the value of " + text::quote(name) + " is a " + std::string(value.type_name()),
                   "Give a number, true or false, or a text that is an expression of the language.",
                   std::string(path));
    out.emplace_back(name, std::move(text));
  }
  return out;
}

namespace {

/// The arguments of program.bind: the fields of a binding, with the six expressions of a point as
/// two lists, and the robot of a grip or point apart from the joint.
Schema binding_params(const ParamSpec& world, const ParamSpec& there) {
  Schema s =
      without(record_params("world", "programs.bindings"), {"x", "y", "z", "roll", "pitch", "yaw"});
  param_named(s, "kind").required = true;
  ParamSpec& reach = param_named(s, "reach");
  reach.min = kPositive;
  reach.doc = "Reach of a grip; 5 mm if omitted.";
  param_named(s, "joint").doc = "Name or number of the robot's joint.";
  s.push_back(optional("robot", "string", "",
                       "Robot with the tool of a grip or the target of a point; by default the "
                       "program's robot."));
  s.push_back(optional("position", "any", "m",
                       "Of a point: offset from there, three numbers or expressions along its "
                       "axes."));
  s.push_back(optional("rpy", "any", "rad",
                       "Of a point: roll, pitch, yaw there, three numbers or expressions."));
  s = led_by({"kind", "name", "to", "frame", "tool", "joint", "robot", "reach", "value", "at",
              "position", "rpy", "expression"},
             std::move(s));
  s.insert(s.begin(), {self("program"), world, there});
  return s;
}

}  // namespace

RMP_COMMANDS(program_in_world_commands) {
  std::vector<CommandSpec> all;
  const auto add = [&](const char* name, const char* summary, const char* details,
                       std::string example, Schema params, ReturnSpec returns, Effect effect,
                       Result<Value> (*run)(CommandContext&, const Map&)) {
    all.push_back({.name = name,
                   .classic = "",
                   .summary = summary,
                   .details = details,
                   .example = std::move(example),
                   .params = std::move(params),
                   .returns = std::move(returns),
                   .effect = effect,
                   .run = run});
  };
  const ParamSpec world =
                      optional("world", "ref:world", "", "The world, if several have the program."),
                  there = optional("name_there", "string", "",
                                   "Its name there, if the world has it several times.");
  add("world.add_program", "Adds a program to a world.",
      "The world stores the bindings of its names (program.bind). A program may be in several "
      "worlds, and several times in one.",
      with_cell("assert(cell:programs()[1].name == \"there\")"),
      led_by({"id", "program", "name", "robot"},
             without(member_params("programs", "program"), {"bindings"})),
      {"string", "", "Its name in the world.", {}}, Effect::edits, add_to_world);
  add("world.remove_program", "Removes a program from a world.", "The program itself stays.",
      with_cell("cell:remove_program(\"there\")\nassert(#cell:programs() == 0)"),
      {self("world"), needed("name", "string", "", "Its name in the world.")}, {}, Effect::edits,
      remove_program);
  add("world.programs", "Lists the programs of a world.", "",
      with_cell("assert(cell:programs()[1].program == \"there\")"), {self("world")},
      {"list",
       "",
       "One table each.",
       {field("name", "string", "", "Name in the world."),
        field("program", "string", "", "The program."),
        field("robot", "string", "", "Robot for motions that name none."),
        field("bindings", "int", "", "Number of its bindings there.")}},
      Effect::reads, list_programs);
  add("program.bind",
      "Binds a name of a program to a robot, signal, task, place or value of its world.",
      "A name without a binding refers to the member of the world with the same name, in any "
      "letter case; an output BOOL gripper without such a signal grips, and so does the first "
      "additional joint (0 is open, 1 is shut). A name has one binding; a new one replaces it. "
      "robot: a ROBOT of the cell by name or number, or the program's robot. Targets are then in "
      "`frame` (by default its base) and for `tool`. signal: a signal of the world. grip: an "
      "output, or an additional joint by its number; its change to TRUE takes the object with the "
      "bounding box nearest to the tool and no farther than `reach`, its change to FALSE releases "
      "it. joint: an additional joint by its number, as a joint of a robot or mechanism. task: an "
      "output BOOL that starts a task of the world when it changes to TRUE, which is then the only "
      "start of that task; or an input BOOL that is TRUE from the task's end until it is started "
      "again. "
      "free: nothing in the world; an input then has `value`. point: a variable POSE, ROBTARGET "
      "(its pose), POSITION or ORIENTATION starts with the pose of an object or frame of the "
      "world: its frame, or a centre point, part, node or feature of it named by `at`, moved by "
      "`position` and turned by `rpy` there. The z axis of a feature is its outward normal or "
      "axis. value: a REAL or INT starts with the value of an expression, in mm, degrees, kg and "
      "s. Both kinds know the parameters of the object, or of the world for its frames, and "
      "parameters of worlds as `cell.height`. Bound values are used wherever the program is run, "
      "checked or posted, and follow every change.",
      with_cell("assert(there:bindings()[1].to == \"ready\")"), binding_params(world, there), {},
      Effect::edits, bind);
  add("program.unbind", "Removes a binding of a program.",
      "The name then refers to the member of the world with the same name.",
      with_cell("there:unbind(\"done\")\nassert(#there:bindings() == 0)"),
      {self("program"), needed("name", "string", "", "Name in the program."), world, there}, {},
      Effect::edits, unbind);
  add("program.bindings", "Lists the bindings of a program's names in its worlds.", "",
      with_cell("assert(there:bindings()[1].kind == \"signal\")"), {self("program"), world, there},
      {"list",
       "",
       "One table each.",
       {field("name_there", "string", "", "The program's name in the world."),
        field("world", "handle", "", "The world."),
        field("kind", "string", "", "Kind of the binding."),
        field("name", "string", "", "Name in the program."),
        field("to", "string", "", "Name in the world."),
        field("frame", "string", "", "Frame in which targets are given."),
        field("tool", "string", "", "Tool for targets, or tool that grips."),
        field("joint", "string", "", "Joint of the robot."),
        field("robot", "string", "", "Robot with the tool of a grip or the target of a point."),
        field("reach", "real", "m", "Reach of a grip; 0 means 5 mm."),
        field("value", "real", "", "Value of a free input."),
        field("at", "string", "", "Place of a point on the object."),
        field("position", "list", "", "Offset expressions of a point [m]; empty means 0."),
        field("rpy", "list", "", "Angle expressions of a point [rad]; empty means 0."),
        field("expression", "string", "", "Expression of a value.")}},
      Effect::reads, bindings);
  add("program.set_profile", "Sets the controller profile that a program is written for.", "",
      with_cell("there:set_profile(\"kr_c4\")\nassert(there:profile() == \"kr_c4\")"),
      {self("program"), needed("profile", "string", "", "Name of the profile; empty means none.")},
      {}, Effect::edits, set_profile);
  add("program.profile", "Returns the controller profile that a program is written for.", "",
      with_cell("assert(there:profile() == \"\")"), {self("program")},
      {"string", "", "Name of the profile; empty means none.", {}}, Effect::reads, profile);
  return all;
}

}  // namespace robomosp::ioci
