// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <atomic>
#include <chrono>
#include <numeric>
#include <set>

#include "document/validate.h"
#include "io/native.h"
#include "ioci/core/commands.h"
#include "ioci/core/counted.h"
#include "ioci/core/loaded.h"
#include "ioci/core/placement_argument.h"
#include "ioci/core/record_params.h"
#include "ioci/robot/array_units.h"
#include "ioci/robot/shown_robot.h"
#include "ioci/world/members.h"
#include "kernel/executor.h"
#include "kernel/fresh_names.h"
#include "kernel/quiet_progress.h"
#include "robotics/home.h"
#include "robotics/maker_axes.h"

namespace robomosp::ioci {
namespace {

using model::World;

Schema world_fields() {
  return without(led_by({"gravity"}, record_params("world", "")),
                 {"objects", "robots", "trajectories", "frames", "lights", "tasks", "programs",
                  "signals", "attachments", "pair_rules"});
}

Result<Value> create(CommandContext& ctx, const Map& args) {
  World w;
  RMP_TRY(set_fields(w, args));
  w.parametric = ctx.expressions.own();
  ctx.expressions.keep(w.parametric);
  const std::string name =
      has(args, "name") ? text_of(args, "name") : ctx.edit().free_name(Kind::world, "world");
  RMP_TRY_ASSIGN(const auto id, ctx.edit().add(name, std::move(w)));
  return Value(Application::handle(id));
}

Result<Value> set_world(CommandContext& ctx, const Map& args) {
  return change_world(ctx, args, [&](World& w) -> Result<void> {
    RMP_TRY(set_fields(w, args));
    ctx.expressions.keep(w.parametric);
    return {};
  });
}

/// Adds a member, made of the arguments but for its name and placement, to a list of the world;
/// the result is its name.
template <class Members, class Member>
Result<Value> add_placed(CommandContext& ctx, const Map& args, Members World::*list, AnyId record,
                         Member made) {
  RMP_TRY_ASSIGN(made.placement, placement_given(ctx, "placement"));
  RMP_TRY(change_world(ctx, args, [&](World& w) -> Result<void> {
    RMP_TRY_ASSIGN(made.name, member_name(w, args, ctx.snapshot().find(record)->name));
    (w.*list).push_back(made);
    ctx.expressions.keep(w.parametric, made.name);
    return {};
  }));
  return Value(made.name);
}

Result<Value> add_object(CommandContext& ctx, const Map& args) {
  model::PlacedObject made;
  RMP_TRY(set_fields(made, args));
  return add_placed(ctx, args, &World::objects, made.what, made);
}

/// Many at once: one copy of the world, one check, one step.
Result<Value> add_objects(CommandContext& ctx, const Map& args) {
  static const Schema schema = plain_params(without(member_params("objects", "what"), {"id"}));
  const List& given = *args.find("objects")->as_list();
  std::vector<model::PlacedObject> fresh;
  std::vector<bool> is_named;
  fresh.reserve(given.size());
  for (std::size_t i = 0; i < given.size(); ++i) {
    const std::string where = "objects[" + std::to_string(i + 1) + "]";
    RMP_TRY_ASSIGN(const Map checked, read_map(ctx, schema, given[i], where));
    model::PlacedObject o;
    RMP_TRY(set_fields(o, checked));
    RMP_TRY_ASSIGN(o.placement, read_placement_fields(*given[i].as_map(), where));
    is_named.push_back(has(checked, "name"));
    if (!is_named.back()) o.name = ctx.snapshot().find(o.what)->name;
    fresh.push_back(std::move(o));
  }
  List names;
  RMP_TRY_ASSIGN(const Value none, change_world(ctx, args, [&](World& w) -> Result<void> {
                   FreshNames taken(member_names(w));
                   for (std::size_t i = 0; i < fresh.size(); ++i) {
                     model::PlacedObject& o = fresh[i];
                     if (is_named[i] && taken.is_taken(o.name))
                       return error(ErrorCode::conflict,
                                    "there is already a member named " + text::quote(o.name),
                                    "Names must be unique within a world.",
                                    "objects[" + std::to_string(i + 1) + "]");
                     o.name = taken.fresh(o.name);
                     names.emplace_back(o.name);
                     w.objects.push_back(std::move(o));
                   }
                   return {};
                 }));
  static_cast<void>(none);
  return Value(std::move(names));
}

Result<Value> add_robot(CommandContext& ctx, const Map& args) {
  model::PlacedRobot made;
  RMP_TRY(set_fields(made, args));
  if (has(args, "q")) {
    RMP_TRY_ASSIGN(const auto m, model_of(ctx, args, "robot"));
    RMP_TRY_ASSIGN(
        made.q, read_q(*args.find("q"), content<model::Robot>(ctx, args, "robot"), m->joints, "q"));
  }
  RMP_TRY_ASSIGN(Value name, add_placed(ctx, args, &World::robots, AnyId(made.robot), made));
  if (!made.q.empty()) note_shown_joints(ctx, made.robot, made.q);
  return name;
}

Result<Value> add_trajectory(CommandContext& ctx, const Map& args) {
  model::PlacedTrajectory made;
  RMP_TRY(set_fields(made, args));
  return add_placed(ctx, args, &World::trajectories, AnyId(made.trajectory), made);
}

Result<Value> load_trajectory(CommandContext& ctx, const Map& args) {
  const std::filesystem::path file = text_of(args, "file");
  if (file.extension() != io::extension(Kind::trajectory))
    return error(ErrorCode::invalid_argument,
                 text::quote(file.string()) + " does not end with " +
                     std::string(io::extension(Kind::trajectory)),
                 "Give a trajectory file.");
  RMP_TRY_ASSIGN(const auto loaded, load_file(ctx, file));
  if (loaded.id.kind != Kind::trajectory)
    return error(ErrorCode::invalid_argument,
                 text::quote(file.string()) + " holds " +
                     document::with_article(to_string(loaded.id.kind)) + ", not a trajectory",
                 "Give a trajectory file.");
  model::PlacedTrajectory made;
  made.trajectory = TrajectoryId{loaded.id.number};
  return add_placed(ctx, args, &World::trajectories, loaded.id, made);
}

Result<Value> remove_member(CommandContext& ctx, const Map& args) {
  const std::string name = text_of(args, "member");
  std::vector<std::string> let_go, standing;
  auto done = change_world(ctx, args, [&](World& w) -> Result<void> {
    const auto named = [&](const auto& m) { return m.name == name; };
    let_go.clear(), standing.clear();
    if (erase_if(w.objects, named) + std::erase_if(w.robots, named) +
            std::erase_if(w.trajectories, named) + std::erase_if(w.frames, named) +
            std::erase_if(w.lights, named) + std::erase_if(w.tasks, named) +
            std::erase_if(w.programs, named) ==
        0)
      return no_member(w, name);
    std::erase_if(w.attachments, [&](const auto& a) {
      if (a.robot == name && a.object != name) let_go.push_back(text::quote(a.object));
      return a.object == name || a.robot == name;
    });
    for (auto& r : w.robots) {
      if (r.base_trajectory != name) continue;
      r.base_trajectory.clear();
      standing.push_back(text::quote(r.name));
    }
    return {};
  });
  const std::string world = name_in(ctx, ref(args, "id"));
  if (done.ok() && !let_go.empty())
    ctx.app.messages.post(
        Severity::info, "let_go",
        text::quote(name) + " is gone and holds no longer: " + text::enumerate(let_go) + ".",
        world);
  if (done.ok() && !standing.empty())
    ctx.app.messages.post(Severity::info, "base",
                          "The way " + text::quote(name) + " is gone: the base of " +
                              text::enumerate(standing) + " stays where it is placed.",
                          world);
  return done;
}

Result<Value> place(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const auto placement, placement_given(ctx, "placement"));
  const std::string name = text_of(args, "member");
  return change_world(ctx, args, [&](World& w) -> Result<void> {
    bool found = false;
    const auto move_in = [&](auto& list) {
      for (std::size_t i = 0; i < list.size(); ++i)
        if (std::as_const(list)[i].name == name) {
          list[i].placement = placement;
          found = true;
        }
    };
    move_in(w.objects);
    move_in(w.robots);
    move_in(w.trajectories);
    move_in(w.frames);
    move_in(w.lights);
    if (!found) return no_member(w, name);
    ctx.expressions.keep(w.parametric, name);
    return {};
  });
}

Result<Value> set_robot_q(CommandContext& ctx, const Map& args) {
  const World& w = content<World>(ctx, args);
  RMP_TRY_ASSIGN(const std::size_t at, find_robot(ctx, typed<World>(args), *args.find("robot"),
                                                  name_in(ctx, ref(args, "id"))));
  const RobotId robot = w.robots[at].robot;
  RMP_TRY_ASSIGN(const auto m,
                 ctx.app.derived.robot_model(ctx.snapshot(), robot, {0, 0, -9.81}, ctx.progress));
  const model::Robot& record = *ctx.snapshot().get(robot);
  RMP_TRY(one_of_joints_and_axes(ctx, args, robot, record));
  const auto shown = [&] {
    return w.robots[at].q.empty() ? robotics::home_joint_values(record) : w.robots[at].q;
  };
  RMP_TRY_ASSIGN(const auto q, has(args, "axes")
                                   ? read_axis_values(record, *args.find("axes"), shown(), "axes")
                                   : read_q(*args.find("q"), record, m->joints, "q"));
  note_shown_joints(ctx, robot, *m, q);
  return change_world(ctx, args, [&](World& changed) -> Result<void> {
    changed.robots[at].q = q;
    return {};
  });
}

template <class List_, class Fn>
Value rows(const List_& list, Fn&& fn) {
  List out;
  for (const auto& m : list) out.emplace_back(fn(m));
  return out;
}

Result<Value> objects(CommandContext& ctx, const Map& args) {
  return rows(content<World>(ctx, args).objects, [&](const auto& m) {
    return Map{{"name", m.name},
               {"what", Application::handle(m.what)},
               {"placement", placement_value(m.placement)}};
  });
}
Result<Value> robots(CommandContext& ctx, const Map& args) {
  return rows(content<World>(ctx, args).robots, [&](const auto& m) {
    const model::Robot* robot = ctx.snapshot().get(m.robot);
    Map row{{"name", m.name},
            {"robot", Application::handle(m.robot)},
            {"placement", placement_value(m.placement)},
            {"q", NumericArray(m.q, robot ? joint_array_unit(*robot) : std::string())}};
    if (robot && !robot->axes.empty())
      row.set("axes", axis_map(*robotics::MakerAxes::for_messages(robot),
                               m.q.empty() ? robotics::home_joint_values(*robot) : m.q));
    return row;
  });
}
Result<Value> trajectories(CommandContext& ctx, const Map& args) {
  return rows(content<World>(ctx, args).trajectories, [&](const auto& m) {
    return Map{{"name", m.name},
               {"trajectory", Application::handle(m.trajectory)},
               {"placement", placement_value(m.placement)}};
  });
}

template <class Members>
Result<Value> name_at(CommandContext& ctx, const Map& args, const Members& list, const char* kind) {
  const auto i = counted(args, list.size(), kind);
  if (!i.ok()) return Error(i.error()).in(name_in(ctx, ref(args, "id")));
  return Value(list[*i].name);
}
Result<Value> object_name(CommandContext& ctx, const Map& args) {
  return name_at(ctx, args, content<World>(ctx, args).objects, "object");
}
Result<Value> robot_name(CommandContext& ctx, const Map& args) {
  return name_at(ctx, args, content<World>(ctx, args).robots, "robot");
}
Result<Value> trajectory_name(CommandContext& ctx, const Map& args) {
  return name_at(ctx, args, content<World>(ctx, args).trajectories, "trajectory");
}

Result<Value> robot_index(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const std::size_t at, find_robot(ctx, typed<World>(args), *args.find("robot"),
                                                  name_in(ctx, ref(args, "id"))));
  return Value(static_cast<std::int64_t>(at) + integer(args, "first"));
}
Result<Value> trajectory_index(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const std::size_t at,
                 find_trajectory(ctx, typed<World>(args), *args.find("trajectory"),
                                 name_in(ctx, ref(args, "id"))));
  return Value(static_cast<std::int64_t>(at) + integer(args, "first"));
}

Result<Value> world_name(CommandContext& ctx, const Map& args) {
  const auto all = ctx.snapshot().list(Kind::world);
  RMP_TRY_ASSIGN(const std::size_t i, counted(args, all.size(), "world"));
  return Value(ctx.snapshot().find(all[i])->name);
}
Result<Value> world_index(CommandContext& ctx, const Map& args) {
  const auto all = ctx.snapshot().list(Kind::world);
  return Value(static_cast<std::int64_t>(std::find(all.begin(), all.end(), ref(args, "world")) -
                                         all.begin()) +
               integer(args, "first"));
}

/// All solids that a world shows, directly or through objects and robots.
std::vector<SolidId> solids_of(const document::Snapshot& s, AnyId root) {
  std::vector<AnyId> open{root};
  std::set<AnyId> seen{root};
  std::vector<SolidId> out;
  while (!open.empty()) {
    const AnyId id = open.back();
    open.pop_back();
    if (id.kind == Kind::solid) out.push_back(SolidId{id.number});
    const model::Record* r = s.find(id);
    if (!r) continue;
    model::for_each_reference(r->body, [&](AnyId to, std::string_view) {
      if (seen.insert(to).second) open.push_back(to);
    });
  }
  std::sort(out.begin(), out.end());
  return out;
}

Result<Value> evaluate(CommandContext& ctx, const Map& args) {
  const document::Snapshot& snapshot = ctx.snapshot();
  const auto solids = solids_of(snapshot, ref(args, "id"));
  const auto start = std::chrono::steady_clock::now();
  // The largest first, so that no core is left alone with one at the end.
  const auto nodes_of = [&](std::size_t i) { return snapshot.get(solids[i])->nodes.size(); };
  std::vector<std::size_t> order(solids.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return nodes_of(a) > nodes_of(b); });
  const auto evaluated = [&](SolidId id) -> Result<Map> {
    QuietProgress progress(ctx.progress);
    const auto begin = std::chrono::steady_clock::now();
    RMP_TRY_ASSIGN(const auto mesh, ctx.app.derived.mesh(snapshot, id, progress));
    RMP_TRY_ASSIGN(const auto moments, ctx.app.derived.moments(snapshot, id, progress));
    return Map{{"seconds",
                std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count()},
               {"triangles", mesh->triangle_count()},
               {"volume", moments.volume}};
  };
  std::vector<Map> rows(solids.size());
  std::atomic<std::size_t> done{0};
  Executor& executor = Executor::of_process();
  executor.spread(solids.size(), executor.cores(), [&](std::size_t n) {
    if (ctx.progress.cancelled()) return;
    const std::size_t i = order[n];
    rows[i].set("solid", snapshot.find(solids[i])->name);
    const auto result = guarded("evaluation", [&] { return evaluated(solids[i]); });
    if (result.ok())
      for (const auto& [key, v] : *result) rows[i].set(key, v);
    else rows[i].set("error", result.error().sentence());
    ctx.progress.report(static_cast<double>(++done) / static_cast<double>(solids.size()),
                        "evaluating solids");
  });
  if (ctx.progress.cancelled())
    return error(ErrorCode::cancelled, "the evaluation was cancelled", {},
                 name_in(ctx, ref(args, "id")));
  List out;
  for (Map& row : rows) out.emplace_back(std::move(row));
  return Value(Map{
      {"seconds", std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count()},
      {"solids", std::move(out)}});
}

Schema placed_robot_params() {
  Schema s = member_params("robots", "robot");
  ParamSpec& q = param_named(s, "q");
  q.type = "joints of robot or member:pose of robot";
  q.unit = "rad or m";
  return led_by({"id", "robot", "name", "q"}, std::move(s));
}

}  // namespace

RMP_COMMANDS(world_commands) {
  std::vector<CommandSpec> all;
  const auto placed = [](Schema s) {
    for (ParamSpec& p : placement_fields("the world")) s.push_back(std::move(p));
    return s;
  };
  const ParamSpec member_name_spec =
      optional("name", "string", "",
               "Name of the member, unique in the world; by default that of the record.");
  Schema create_params{optional(
      "name", "string", "", "Name, unique among worlds; one derived from \"world\" if omitted.")};
  Schema set_params{self("world")};
  for (const ParamSpec& p : world_fields()) {
    create_params.push_back(p);
    set_params.push_back(p);
  }
  create_params.push_back(parameters_field());
  all.push_back({.name = "world.create",
                 .classic = "Worlds Create",
                 .summary = "Makes an empty world.",
                 .details = "",
                 .example = "local moon = world.create{name = \"moon\", gravity = {0, 0, "
                            "-1.62}}\nassert(moon:describe().gravity[3] == -1.62)",
                 .params = std::move(create_params),
                 .returns = {"handle", "", "", {}},
                 .effect = Effect::edits,
                 .run = create,
                 .takes_expressions = true});
  all.push_back({.name = "world.set",
                 .classic = "",
                 .summary = "Changes the given properties of a world.",
                 .details = "",
                 .example = "local cell = world.create{name = \"cell\"}\ncell:set{gravity = {0, 0, "
                            "0}}\nassert(cell:describe().gravity[3] == 0)",
                 .params = std::move(set_params),
                 .returns = {},
                 .effect = Effect::edits,
                 .run = set_world,
                 .takes_expressions = true});
  all.push_back({.name = "world.add_object",
                 .classic = "",
                 .summary = "Places an object or a solid in a world.",
                 .details = "It is at the world's origin unless a placement is given.",
                 .example =
                     "solid.create{name = \"table\", root = {kind = \"box\", x = 1, y = 1, z = "
                     "0.7}}\nlocal cell = world.create{name = \"cell\"}\ncell:add_object{what = "
                     "\"table\", position = {1, 0, 0}}\nassert(#cell:objects() == 1)",
                 .params = member_params("objects", "what"),
                 .returns = {"string", "", "Name of the member.", {}},
                 .effect = Effect::edits,
                 .run = add_object,
                 .takes_expressions = true});
  all.push_back(
      {.name = "world.add_objects",
       .classic = "",
       .summary = "Places many objects or solids in a world, as one step.",
       .details = "Each entry is a table of the arguments of world.add_object; its numbers are "
                  "plain or strings with a unit, not expressions. Either all are placed or none.",
       .example = "solid.create{name = \"brick\", root = {kind = \"box\", x = 0.2, y = 0.1, z = "
                  "0.05}}\nlocal cell = world.create{name = \"cell\"}\nlocal wall = {}\n"
                  "for i = 1, 100 do\n  wall[i] = {what = \"brick\", position = {0.2 * (i % 10), "
                  "0, 0.05 * (i // 10)}}\nend\ncell:add_objects(wall)\n"
                  "assert(#cell:objects() == 100)",
       .params = {self("world"),
                  needed("objects", "list", "",
                         "Tables of what, name, and a placement as in world.add_object.")},
       .returns = {"list", "", "Names of the members.", {}},
       .effect = Effect::edits,
       .run = add_objects});
  all.push_back({.name = "world.add_robot",
                 .classic = "",
                 .summary = "Places a robot in a world.",
                 .details =
                     "The placement is that of its mounting frame, by default the world's origin. "
                     "Without joint values it is shown in its pose \"home\", or at zeros.",
                 .example = example_cell("assert(cell:robots()[1].name == \"arm\")"),
                 .params = placed_robot_params(),
                 .returns = {"string", "", "Name of the member.", {}},
                 .effect = Effect::edits,
                 .run = add_robot,
                 .takes_expressions = true});
  all.push_back({.name = "world.add_trajectory",
                 .classic = "",
                 .summary = "Places a trajectory in a world.",
                 .details = "The placement is that of the trajectory's frame, by default the "
                            "world's origin. world.inverse_kinematics runs a robot along it.",
                 .example = example_run("assert(cell:trajectories()[1].name == \"stroke\")"),
                 .params = member_params("trajectories", "trajectory"),
                 .returns = {"string", "", "Name of the member.", {}},
                 .effect = Effect::edits,
                 .run = add_trajectory,
                 .takes_expressions = true});
  all.push_back(
      {.name = "world.load_trajectory",
       .classic = "World LoadPTrajectory",
       .summary = "Loads a trajectory from a file and places it in a world.",
       .details = "",
       .example = example_run(
           "local file = \"example.tjc\"\ntrajectory.save{id = \"stroke\", file = "
           "file}\nlocal other = world.create{name = "
           "\"other\"}\nother:load_trajectory(file)\nassert(#other:trajectories() == 1)"),
       .params = placed({self("world"), needed("file", "path", "", "The file."), member_name_spec}),
       .returns = {"string", "", "Name of the member.", {}},
       .effect = Effect::files_read | Effect::edits,
       .run = load_trajectory,
       .takes_expressions = true});
  all.push_back(
      {.name = "world.remove_member",
       .classic = "",
       .summary =
           "Removes a member from a world: an object, robot, trajectory, frame, light or task.",
       .details = "The record itself is kept. A held object is released.",
       .example = example_cell("cell:remove_member(\"arm\")\nassert(#cell:robots() == 0)"),
       .params = {self("world"), needed("member", "string", "", "Its name in the world.")},
       .returns = {},
       .effect = Effect::edits,
       .run = remove_member});
  Schema place_params =
      placed({self("world"), needed("member", "string", "", "Its name in the world.")});
  all.push_back(
      {.name = "world.place",
       .classic = "",
       .summary = "Moves a member of a world to another place.",
       .details = "For objects, robots, trajectories, frames and lights; omitted parts of the "
                  "placement are 0.",
       .example = example_cell("cell:place{member = \"arm\", position = {0, 0, \"500 "
                               "mm\"}}\nassert(cell:robots()[1].placement.position[3] == 0.5)"),
       .params = std::move(place_params),
       .returns = {},
       .effect = Effect::edits,
       .run = place,
       .takes_expressions = true});
  all.push_back(
      {.name = "world.set_robot_q",
       .classic = "",
       .summary = "Sets the joint values of a robot in a world.",
       .details = "By joint values, or by the maker's axes. robot.jog moves one axis.",
       .example = example_cell(
           "cell:set_robot_q{robot = \"arm\", q = \"ready\"}\nassert(cell:robots()[1].q[5] == 1)"),
       .params =
           {self("world"),
            needed("robot", "any", "",
                   "Name of the member, or the robot; may be omitted if the world has only one."),
            optional("q", "any", "rad or m", "Joint values, or the name of a pose."),
            axis_values()},
       .returns = {},
       .effect = Effect::edits,
       .run = set_robot_q});
  const ParamSpec placement_field = field("placement", "map", "", "Pose in the world.");
  all.push_back(
      {.name = "world.objects",
       .classic = "World LsPObjects",
       .summary = "Lists the objects of a world.",
       .details = "",
       .example = example_cell("assert(#cell:objects() == 0)"),
       .params = {self("world")},
       .returns = {"list",
                   "",
                   "",
                   {field("name", "string", "", "Name in the world."),
                    field("what", "handle", "", "The object or solid."), placement_field}},
       .effect = Effect::reads,
       .run = objects});
  all.push_back({.name = "world.robots",
                 .classic = "World LsPRobots",
                 .summary = "Lists the robots of a world.",
                 .details = "",
                 .example = example_cell("assert(#cell:robots() == 1)"),
                 .params = {self("world")},
                 .returns = {"list",
                             "",
                             "",
                             {field("name", "string", "", "Name in the world."),
                              field("robot", "handle", "", "The robot."), placement_field,
                              field("q", "real[]", "rad or m",
                                    "Joint values shown; none means the pose \"home\" or zeros."),
                              field("axes", "map", "",
                                    "Values of the maker's axes by name [deg or mm]; absent where "
                                    "they are unknown.")}},
                 .effect = Effect::reads,
                 .run = robots});
  all.push_back(
      {.name = "world.trajectories",
       .classic = "World LsPTrajectories",
       .summary = "Lists the trajectories of a world.",
       .details = "",
       .example = example_run("assert(#cell:trajectories() == 1)"),
       .params = {self("world")},
       .returns = {"list",
                   "",
                   "",
                   {field("name", "string", "", "Name in the world."),
                    field("trajectory", "handle", "", "The trajectory."), placement_field}},
       .effect = Effect::reads,
       .run = trajectories});
  const ParamSpec index = needed("index", "int", "", "Its number.");
  const std::string counts = "Numbers count from 0, or from first.";
  all.push_back({.name = "world.object_name",
                 .classic = "World GetPObjectId(index, first=1)",
                 .summary = "Returns the name of the i-th object of a world.",
                 .details = counts,
                 .example =
                     "solid.create{name = \"table\", root = {kind = \"box\", x = 1, y = 1, z = "
                     "0.7}}\nlocal cell = world.create{name = \"cell\"}\ncell:add_object{what = "
                     "\"table\"}\nassert(cell:object_name(0) == \"table\")",
                 .params = {self("world"), index, first_field()},
                 .returns = {"string", "", "", {}},
                 .effect = Effect::reads,
                 .run = object_name});
  all.push_back({.name = "world.robot_name",
                 .classic = "World GetPRobotId(index, first=1)",
                 .summary = "Returns the name of the i-th robot of a world.",
                 .details = counts,
                 .example = example_cell("assert(cell:robot_name(0) == \"arm\")"),
                 .params = {self("world"), index, first_field()},
                 .returns = {"string", "", "", {}},
                 .effect = Effect::reads,
                 .run = robot_name});
  all.push_back({.name = "world.trajectory_name",
                 .classic = "World GetPTrajectoryId(index, first=1)",
                 .summary = "Returns the name of the i-th trajectory of a world.",
                 .details = counts,
                 .example = example_run("assert(cell:trajectory_name(0) == \"stroke\")"),
                 .params = {self("world"), index, first_field()},
                 .returns = {"string", "", "", {}},
                 .effect = Effect::reads,
                 .run = trajectory_name});
  all.push_back({.name = "world.robot_index",
                 .classic = "World GetPRobotIndex(robot, first=1)",
                 .summary = "Returns the index of a robot in the list of a world.",
                 .details = counts,
                 .example = example_cell("assert(cell:robot_index(\"arm\") == 0)"),
                 .params = {self("world"), placed_robot_field(), first_field()},
                 .returns = {"int", "", "Its number.", {}},
                 .effect = Effect::reads,
                 .run = robot_index});
  all.push_back({.name = "world.trajectory_index",
                 .classic = "World GetPTrajectoryIndex(trajectory, first=1)",
                 .summary = "Returns the index of a trajectory in the list of a world.",
                 .details = counts,
                 .example = example_run("assert(cell:trajectory_index(\"stroke\") == 0)"),
                 .params = {self("world"), placed_trajectory_field(), first_field()},
                 .returns = {"int", "", "Its number.", {}},
                 .effect = Effect::reads,
                 .run = trajectory_index});
  all.push_back({.name = "world.name_at",
                 .classic = "Worlds GetWorldId(index, first=1)",
                 .summary = "Returns the name of the i-th world.",
                 .details = counts,
                 .example = "world.create{name = \"cell\"}\nassert(world.name_at(0) == \"cell\")",
                 .params = {index, first_field()},
                 .returns = {"string", "", "", {}},
                 .effect = Effect::reads,
                 .run = world_name});
  all.push_back({.name = "world.index_of",
                 .classic = "Worlds GetWorldIndex(world, first=1)",
                 .summary = "Returns the index of a world in the list of worlds.",
                 .details = counts,
                 .example = "world.create{name = \"cell\"}\nassert(world.index_of(\"cell\") == 0)",
                 .params = {needed("world", "ref:world", "", "The world."), first_field()},
                 .returns = {"int", "", "Its number.", {}},
                 .effect = Effect::reads,
                 .run = world_index});
  all.push_back(
      {.name = "world.evaluate",
       .classic = "",
       .summary = "Computes mesh and volume of every solid in a world, several in parallel.",
       .details = "Cached results take no time. A solid that cannot be computed is reported in its "
                  "row; the others continue.",
       .example =
           "solid.create{name = \"table\", root = {kind = \"box\", x = 1, y = 1, z = 0.7}}\nlocal "
           "cell = world.create{name = \"cell\"}\ncell:add_object{what = \"table\"}\nlocal e = "
           "cell:evaluate()\nassert(math.abs(e.solids[1].volume - 0.7) < 1e-12)",
       .params = {self("world")},
       .returns = {"map",
                   "",
                   "",
                   {field("seconds", "real", "s", "Total time."),
                    field("solids", "list", "",
                          "One table per solid: solid, seconds, triangles, volume, or error.")}},
       .effect = Effect::reads,
       .run = evaluate});
  return all;
}

}  // namespace robomosp::ioci
