// SPDX-License-Identifier: Apache-2.0
// Elements of worlds straight from files: read and placed in one step.
#include <algorithm>
#include <map>
#include <set>
#include <string>
#include <utility>

#include "io/legacy.h"
#include "io/native.h"
#include "ioci/core/commands.h"
#include "ioci/core/loaded.h"
#include "ioci/core/placement_argument.h"
#include "ioci/world/members.h"
#include "kernel/fresh_names.h"
#include "model/placement.h"
#include "model/program_kinds.h"
#include "spatial/pose.h"

namespace robomosp::ioci {
namespace {

using model::World;

enum class Clash { rename, replace, refuse };

/// Puts members into a world; what has a name that is taken goes by the choice of the user.
class Elements {
 public:
  Elements(World& world, Clash clash, bool keeps_places)
      : world_(world), clash_(clash), keeps_places_(keeps_places), taken_(member_names(world)) {}

  template <class List>
  Result<void> put(List World::*list, typename List::value_type made) {
    const std::string wanted = made.name;
    const bool is_taken = taken_.is_taken(wanted);
    if (is_taken && clash_ == Clash::refuse)
      return error(ErrorCode::conflict, "there is already a member named " + text::quote(wanted),
                   "Give another name, or clash = \"rename\" or \"replace\".");
    auto& members = world_.*list;
    if (is_taken && clash_ == Clash::replace) {
      const auto old = std::find_if(members.begin(), members.end(),
                                    [&](const auto& m) { return m.name == wanted; });
      if (old == members.end())
        return error(
            ErrorCode::conflict,
            "member " + text::quote(wanted) + " is of a different kind and cannot be replaced",
            "Give another name, or clash = \"rename\".");
      if constexpr (requires { made.placement; })
        if (keeps_places_) made.placement = old->placement;
      members[static_cast<std::size_t>(old - members.begin())] = std::move(made);
    } else {
      made.name = taken_.fresh(wanted);
      members.push_back(std::move(made));
    }
    const std::string& name = clash_ == Clash::replace ? wanted : members.back().name;
    if (name != wanted) renamed_[wanted] = name;
    names_.emplace_back(name);
    return {};
  }

  /// The members of another world, seen from `placement`, with all that names them.
  Result<void> put_world(const World& other, const model::Placement& placement) {
    const Pose at = model::pose(placement);
    const bool moves = placement != model::Placement{};
    const auto put_all = [&](auto list) -> Result<void> {
      for (auto m : other.*list) {
        if constexpr (requires { m.placement; })
          if (moves) m.placement = model::placement(spatial::compose(at, model::pose(m.placement)));
        RMP_TRY(put(list, std::move(m)));
      }
      return {};
    };
    RMP_TRY(put_all(&World::objects));
    const std::size_t robots_before = world_.robots.size();
    RMP_TRY(put_all(&World::robots));
    RMP_TRY(put_all(&World::trajectories));
    for (std::size_t i = robots_before; i < world_.robots.size(); ++i)
      world_.robots[i].base_trajectory = now(world_.robots[i].base_trajectory);
    RMP_TRY(put_all(&World::frames));
    RMP_TRY(put_all(&World::lights));
    for (model::PlacedTask t : other.tasks) {
      t.robot = now(t.robot);
      RMP_TRY(put(&World::tasks, std::move(t)));
    }
    for (model::PlacedProgram p : other.programs) {
      p.robot = now(p.robot);
      for (model::ProgramBinding& b : p.bindings) {
        if (b.kind != model::BindingKind::signal) b.to = now(b.to);
        b.frame = now(b.frame);
        // A link or tool of the robot, or an object and its centre point.
        if (has_object(other, b.tool)) b.tool = now_part(b.tool);
        // Of these it is a robot.
        if (b.kind == model::BindingKind::grip || b.kind == model::BindingKind::point)
          b.joint = now(b.joint);
      }
      RMP_TRY(put(&World::programs, std::move(p)));
    }
    for (const model::Signal& s : other.signals) RMP_TRY(put_signal(s));
    for (model::Attachment a : other.attachments) {
      a.object = now(a.object);
      a.robot = now(a.robot);
      std::erase_if(world_.attachments, [&](const auto& old) { return old.object == a.object; });
      world_.attachments.push_back(std::move(a));
    }
    for (model::CollisionPairRule r : other.pair_rules) {
      r.a = now_part(r.a);
      r.b = now_part(r.b);
      world_.pair_rules.push_back(std::move(r));
    }
    return {};
  }

  [[nodiscard]] const List& names() const { return names_; }
  [[nodiscard]] bool has_renamed() const { return !renamed_.empty(); }

 private:
  /// Of the member before the first dot.
  [[nodiscard]] std::string now_part(const std::string& name) const {
    const auto dot = std::min(name.find('.'), name.size());
    return now(name.substr(0, dot)) + name.substr(dot);
  }
  [[nodiscard]] static bool has_object(const World& w, const std::string& name) {
    const std::string object = name.substr(0, name.find('.'));
    return std::any_of(w.objects.begin(), w.objects.end(),
                       [&](const auto& o) { return o.name == object; });
  }
  [[nodiscard]] std::string now(const std::string& name) const {
    const auto at = renamed_.find(name);
    return at == renamed_.end() ? name : at->second;
  }
  Result<void> put_signal(const model::Signal& s) {
    const auto same = std::find_if(world_.signals.begin(), world_.signals.end(),
                                   [&](const model::Signal& k) { return k.name == s.name; });
    if (same == world_.signals.end()) {
      world_.signals.push_back(s);
      world_.signals.back().from = now(s.from);
      world_.signals.back().to = now(s.to);
      return {};
    }
    if (same->kind == s.kind && same->unit == s.unit && same->initial == s.initial) return {};
    return error(ErrorCode::conflict,
                 "signal " + text::quote(s.name) +
                     " already exists and differs in kind, unit or initial value",
                 "Tasks refer to signals by name, so it is not renamed; change one of the two.");
  }

  World& world_;
  Clash clash_;
  bool keeps_places_;
  FreshNames taken_;  ///< names of members
  std::map<std::string, std::string> renamed_;
  List names_;
};

/// The record of a file of any format that the program reads.
Result<AnyId> read_record(CommandContext& ctx, const std::filesystem::path& file,
                          io::Reload reload) {
  const bool is_native = std::any_of(all_kinds().begin(), all_kinds().end(),
                                     [&](Kind k) { return file.extension() == io::extension(k); });
  if (is_native || io::is_legacy_file(file)) {
    RMP_TRY_ASSIGN(const auto loaded, load_file(ctx, file, reload));
    return loaded.id;
  }
  RMP_TRY_ASSIGN(const Value made, ctx.dispatch("import", {{"file", file.string()}}));
  return Application::record_id(ctx.snapshot(), *made.as_list()->front().as_handle());
}

Result<std::vector<double>> joints_of(CommandContext& ctx, const Map& args, RobotId id) {
  if (!has(args, "q")) return std::vector<double>();
  RMP_TRY_ASSIGN(const auto m,
                 ctx.app.derived.robot_model(ctx.snapshot(), id, {0, 0, -9.81}, ctx.progress));
  return read_q(*args.find("q"), *ctx.snapshot().get(id), m->joints, "q");
}

/// An argument that is only for elements of one kind.
Result<void> only_for(const Map& args, const char* name, Kind kind, Kind given) {
  if (!has(args, name) || kind == given) return {};
  return error(ErrorCode::invalid_argument,
               std::string(name) + " is for a " + std::string(to_string(kind)) +
                   ", but the file contains a " + std::string(to_string(given)),
               "Leave it out.", name);
}

Result<Value> load_element(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const auto placement, placement_given(ctx, "placement"));
  const bool has_place = has_placement(ctx);
  const AnyId world = ref(args, "id");
  const std::string file = text_of(args, "file");
  const std::vector<AnyId> before = ctx.snapshot().list(Kind::world);
  // What is replaced is replaced by what the file holds now.
  const io::Reload reload = flag(args, "reload")                  ? io::Reload::yes
                            : text_of(args, "clash") == "replace" ? io::Reload::changed
                                                                  : io::Reload::no;
  RMP_TRY_ASSIGN(const AnyId id, read_record(ctx, file, reload));
  RMP_TRY(only_for(args, "q", Kind::robot, id.kind));
  if (id.kind != program_kind()) RMP_TRY(only_for(args, "robot", Kind::task, id.kind));
  if (id == world)
    return error(ErrorCode::invalid_argument, text::quote(file) + " is the file of this world",
                 "Give the file of an element.", name_in(ctx, world));
  const model::Record record = *ctx.snapshot().find(id);
  if (id.kind == Kind::material)
    return error(
        ErrorCode::invalid_argument, text::quote(file) + " holds a material",
        "Only elements with a placement can be in a world; load materials with file.load.");
  if (id.kind == Kind::world && has(args, "name"))
    return error(ErrorCode::invalid_argument, "the elements of a world need different names",
                 "Leave name out.", "name");
  std::vector<double> q;
  if (id.kind == Kind::robot) {
    RMP_TRY_ASSIGN(q, joints_of(ctx, args, RobotId{id.number}));
  }
  const std::string name = has(args, "name") ? text_of(args, "name") : record.name;
  const std::string word = text_of(args, "clash");
  const Clash clash = word == "replace"  ? Clash::replace
                      : word == "refuse" ? Clash::refuse
                                         : Clash::rename;
  List names;
  bool has_renamed = false;
  RMP_TRY_ASSIGN(
      [[maybe_unused]] const Value none, change_world(ctx, args, [&](World& w) -> Result<void> {
        Elements all(w, clash, !has_place);
        switch (id.kind) {
          case Kind::robot:
            RMP_TRY(all.put(&World::robots, {name, RobotId{id.number}, placement, q}));
            break;
          case Kind::trajectory:
            RMP_TRY(all.put(&World::trajectories, {name, TrajectoryId{id.number}, placement}));
            break;
          case Kind::task:
            RMP_TRY(all.put(&World::tasks, {name, TaskId{id.number}, text_of(args, "robot")}));
            break;
          case Kind::world: RMP_TRY(all.put_world(std::get<World>(record.body), placement)); break;
          default:
            if (id.kind == program_kind()) {
              RMP_TRY(all.put(&World::programs, {name, id, text_of(args, "robot"), {}}));
            } else {
              RMP_TRY(all.put(&World::objects, {name, id, placement}));
            }
        }
        names = all.names();
        has_renamed = all.has_renamed();
        return {};
      }));
  if (id.kind == Kind::world) {
    const auto& other = std::get<World>(record.body);
    if (!other.parametric.parameters.empty() || !other.parametric.expressions.empty())
      ctx.app.messages.post(Severity::info, "file_note",
                            text::quote(file) +
                                ": parameters of the world are not taken over; numbers keep the "
                                "values they have.",
                            "ioci");
    if (has_renamed && !other.tasks.empty())
      ctx.app.messages.post(Severity::warning, "renamed",
                            text::quote(file) +
                                ": members got other names, but steps of tasks still use the old "
                                "ones.",
                            "ioci");
    // The world itself was only read for its elements.
    if (std::find(before.begin(), before.end(), id) == before.end()) RMP_TRY(ctx.edit().remove(id));
  }
  return Value(std::move(names));
}

}  // namespace

RMP_COMMANDS(world_load_commands) {
  std::vector<CommandSpec> all;
  Schema params{self("world"), needed("file", "path", "", "The file."),
                optional("name", "string", "",
                         "Name of the member; by default that of the record. Not for a world."),
                choice("clash", {"rename", "replace", "refuse"},
                       "If the world has a member of that name: number the new one, replace the "
                       "old one, or stop with an error.")};
  for (ParamSpec& p : placement_fields("the world")) params.push_back(std::move(p));
  params.push_back(
      optional("q", "any", "rad or m", "For a robot: joint values shown, or the name of a pose."));
  params.push_back(
      optional("robot", "string", "",
               "For a task or program: the robot for its steps or motions that name none."));
  params.push_back(reload_field());
  all.push_back(
      {.name = "world.load_element",
       .classic = "",
       .summary = "Loads a file into a world: an object, robot, trajectory, task, program, or all "
                  "members of another world.",
       .details =
           "Files are those of file.load (*.part, *.csg, *.rbt, *.tjc, *.tsk, *.prg, *.wld and "
           "those of ROBOMOSP 1.4) and of import (URDF, STEP, STL and so on). Loading and placing "
           "are one step to undo. A member that is replaced passes its placement to the new one "
           "unless a placement is given. A file that is already in the document is read again with "
           "reload, and with clash = \"replace\" if it has changed on disk; everything that uses "
           "its record follows. From another world it takes its members, signals, held objects and "
           "pair rules, all moved by the given placement; not its gravity and parameters.",
       .example = example_cell(
           "solid.create{name = \"table\", root = {kind = \"box\", x = 1, y = 1, z = 0.7}}\n"
           "solid.save{id = \"table\", file = \"table.csg\"}\n"
           "local first = cell:load_element{file = \"table.csg\", position = {1, 0, 0}}\n"
           "local second = cell:load_element{file = \"table.csg\", position = {0, 1, 0}}\n"
           "assert(first[1] == \"table\" and second[1] == \"table_2\")\n"
           "document.undo()\nassert(#cell:objects() == 1)"),
       .params = std::move(params),
       .returns = {"list", "", "Names of the new members.", {}},
       .effect = Effect::files_read | Effect::edits,
       .sometimes = Effect::processes,
       .run = load_element});
  return all;
}

}  // namespace robomosp::ioci
