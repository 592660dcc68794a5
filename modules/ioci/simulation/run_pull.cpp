// SPDX-License-Identifier: Apache-2.0
// Commands that pull objects and links of live runs.
#include <algorithm>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "ioci/core/commands.h"
#include "ioci/simulation/live_runs.h"
#include "ioci/simulation/program_debugging.h"
#include "ioci/simulation/run_pulse.h"
#include "spatial/vec.h"

namespace robomosp::ioci {
namespace {

using debugging::run_of;

std::string title_of(const LiveRunEntry& run) { return "run " + text::quote(run.title); }

/// The number of the session, which its first command may be about to get.
std::uint64_t number_of(const CommandContext& ctx) { return ctx.app.author(ctx.session).session; }

/// Pulls act on rows that are computed from forces, next.
Result<void> check_run(const LiveRunEntry& run) {
  if (!run.has_forces) {
    const bool is_known = run.of == "physics" || run.of == "dynamics";
    if (is_known)
      return error(ErrorCode::invalid_argument,
                   "the rows of " + title_of(run) +
                       " are computed before they are shown, since it uses a solver written in Lua",
                   "Choose other solvers to pull in it.", "id");
    return error(ErrorCode::invalid_argument,
                 run.of == "tasks"
                     ? title_of(run) +
                           " cannot be pulled: where it continues, its tasks are "
                           "computed again from their start"
                     : "no forces act in " + title_of(run) + ": its motion does not depend on them",
                 "Start a run of physics or dynamics, such as world.start_run(\"physics\").", "id");
  }
  const sim::LiveRun::Shown s = run.run->shown();
  if (s.failure || s.has_last || s.is_over)
    return error(ErrorCode::conflict,
                 title_of(run) + " is over at t = " + text::print_rounded(s.recorded) +
                     " s: nothing is left to compute",
                 "Go back (run.seek) and continue from there with run.refresh, or restart it: "
                 "run.reset.",
                 "id");
  // While it plays, the computed rows are at most a few ahead of the clock.
  if (s.row + 3 < s.rows)
    return error(
        ErrorCode::conflict,
        title_of(run) + " shows t = " + text::print_rounded(s.time) + " s and is computed up to " +
            text::print_rounded(s.recorded) + " s: a pull acts on what is computed next",
        "Continue from the time shown with run.refresh, or go to the end of the rows.", "id");
  return {};
}

/// The robot record with a name in the run; null = it has none.
const model::Robot* robot_named(const LiveRunEntry& run, const document::Snapshot& snapshot,
                                const std::string& name) {
  const auto* record = snapshot.find(AnyId{*kind_from(run.subject.kind), run.subject.number});
  if (!record) return nullptr;
  if (const auto* robot = std::get_if<model::Robot>(&record->body)) return robot;
  const auto* world = std::get_if<model::World>(&record->body);
  for (std::size_t i = 0; world && i < world->robots.size(); ++i)
    if (world->robots[i].name == name) return snapshot.get(world->robots[i].robot);
  return nullptr;
}

/// The object or link of the arguments; other fields as by default.
Result<sim::Pull> body_of(const CommandContext& ctx, const LiveRunEntry& run, const Map& args) {
  sim::Pull out;
  out.session = number_of(ctx);
  const recording::Recording head = run.run->head();
  const document::SnapshotPtr snapshot = run.snapshot();
  if (has(args, "object") == has(args, "link"))
    return error(ErrorCode::invalid_argument,
                 has(args, "object") ? "an object and a link are given"
                                     : "neither an object nor a link is given",
                 "Give object = \"box\", or robot and link.", "object");
  if (has(args, "object")) {
    out.object = text_of(args, "object");
    const auto* world =
        run.subject.kind == "world" ? snapshot->get(WorldId{run.subject.number}) : nullptr;
    std::vector<std::string> names;
    if (world)
      for (const auto& o : world->objects) names.push_back(o.name);
    if (std::find(names.begin(), names.end(), out.object) == names.end())
      return unknown_name("object", out.object, names).in("object");
    if (!head.find(out.object + recording::kPlaceColumns[0]))
      return error(ErrorCode::invalid_argument,
                   "forces do not move object " + text::quote(out.object) + " in " + title_of(run) +
                       ": it is fixed or has no mass, or only a robot moves",
                   "Pull an object with a material that is not fixed, in a run of physics.",
                   "object");
    return out;
  }
  const std::vector<std::string> robots = pullable_robots(run, head);
  out.robot = has(args, "robot")   ? text_of(args, "robot")
              : robots.size() == 1 ? robots.front()
                                   : head.robot;
  const model::Robot* record = robot_named(run, *snapshot, out.robot);
  if (!record) return unknown_name("robot", out.robot, robots).in("robot");
  if (std::find(robots.begin(), robots.end(), out.robot) == robots.end())
    return error(ErrorCode::invalid_argument,
                 "robot " + text::quote(out.robot) + " follows its motion in " + title_of(run) +
                     ": forces do not move it",
                 "Start the run with drive = \"controlled\" or \"limp\" for this robot.", "robot");
  RMP_TRY_ASSIGN(const std::int32_t link, read_link(*record, *args.find("link"), true, "link"));
  if (link < 0)
    return error(ErrorCode::invalid_argument,
                 "the base of robot " + text::quote(out.robot) + " is fixed to the world",
                 "Pull one of its moving links.", "link");
  out.link = record->links[static_cast<std::size_t>(link)].name;
  return out;
}

void publish(CommandContext& ctx, const Map& args, const LiveRunEntry& run) {
  if (ctx.app.events.run_rate() > 0)
    (void)ctx.app.kept<RunPulse>().publish(args.find("id")->as_handle()->number, run);
}

Result<Value> pull(CommandContext& ctx, const Map& args) {
  const LiveRunPtr run = run_of(ctx, args);
  RMP_TRY(check_run(*run));
  RMP_TRY_ASSIGN(sim::Pull p, body_of(ctx, *run, args));
  p.to = vec3(args, "to");
  if (has(args, "point")) p.point = vec3(args, "point");
  for (const char* name : {"to", "point"})
    if (has(args, name) && !spatial::is_finite(vec3(args, name)))
      return error(ErrorCode::invalid_argument, args.find(name)->text() + " is not a place",
                   "Give finite numbers.", name);
  if (has(args, "stiffness")) p.stiffness = real(args, "stiffness");
  if (has(args, "force")) p.force = real(args, "force");
  const auto before = run->pulls.shown();
  const bool is_new =
      std::none_of(before.begin(), before.end(), [&](const auto& s) { return s.pull.is_of(p); });
  run->pulls.set(std::move(p));
  if (is_new) publish(ctx, args, *run);
  return Value();
}

Result<Value> release(CommandContext& ctx, const Map& args) {
  const LiveRunPtr run = run_of(ctx, args);
  std::optional<sim::Pull> body;
  if (has(args, "object") || has(args, "link")) {
    RMP_TRY_ASSIGN(body, body_of(ctx, *run, args));
  }
  const std::size_t count = run->pulls.end(
      [&](const sim::Pull& p) { return p.session == number_of(ctx) && (!body || p.is_of(*body)); });
  if (count > 0) publish(ctx, args, *run);
  return Value(static_cast<std::int64_t>(count));
}

std::string with_box(const char* rest) {
  return std::string(
             "material.create{name = \"wood\", density = 600}\n"
             "solid.create{name = \"box\", material = \"wood\", root = {kind = \"box\", x = 0.1, "
             "y = 0.1, z = 0.1}}\n"
             "local cell = world.create{name = \"cell\"}\ncell:set{gravity = {0, 0, 0}}\n"
             "cell:add_object{what = \"box\", position = {0, 0, 0.5}}\n"
             "local run = cell:start_run(\"physics\", {duration = 2})\n") +
         rest;
}

Schema body_params() {
  return {self("run"),
          optional("object", "string", "", "Name of the object; or a link is given instead."),
          optional("robot", "string", "",
                   "Name of the link's robot; by default the only one that forces move."),
          optional("link", "any", "", "Name or number of the link.")};
}

}  // namespace

RMP_COMMANDS(run_pull_commands) {
  std::vector<CommandSpec> all;
  Schema params = body_params();
  params.push_back(needed("to", "vec3", "m", "Place in the world that the spring pulls to."));
  params.push_back(optional("point", "vec3", "m",
                            "The pulled point in the frame of the object or link; by default the "
                            "centre of mass."));
  params.push_back(above_zero(optional("stiffness", "real", "N/m",
                                       "Of the spring; by default 90 per second squared times "
                                       "the mass of the object, or of all links.")));
  params.push_back(above_zero(
      optional("force", "real", "N", "Greatest force; by default 20 times that weight.")));
  all.push_back(
      {.name = "run.pull",
       .classic = "",
       .summary = "Pulls an object or link of a live run by a spring, as the mouse does.",
       .details =
           "The pull acts on what is computed next, until run.release or the end of the session; "
           "another call for the same body moves the place. A session pulls each body at most "
           "once, and pulls of several sessions add up. The spring has a damper. Runs of physics "
           "and dynamics have forces; notes of their recordings name what was pulled, the times "
           "and the greatest force. run.reset and run.refresh do not repeat earlier pulls.",
       .example = with_box("run:pull{object = \"box\", to = {0.2, 0, 0.55}}\n"
                           "assert(math.abs(run:seek(1.9).objects.box.position[1] - 0.2) < 1e-3)\n"
                           "assert(run:release() == 1)"),
       .params = std::move(params),
       .returns = {},
       .effect = Effect::simulates,
       .run = pull});
  all.push_back({.name = "run.release",
                 .classic = "",
                 .summary = "Ends pulls of this session in a live run.",
                 .details = "Those of one object or link, or all of them.",
                 .example = with_box("run:pull{object = \"box\", to = {0.2, 0, 0.5}}\n"
                                     "run:step(5)\nassert(run:release(\"box\") == 1)\n"
                                     "assert(run:step().values[\"box.x\"] > 0)\n"
                                     "assert(#run:state().pulls == 0)"),
                 .params = body_params(),
                 .returns = {"int", "", "Number of pulls that ended.", {}},
                 .effect = Effect::simulates,
                 .run = release});
  return all;
}

}  // namespace robomosp::ioci
