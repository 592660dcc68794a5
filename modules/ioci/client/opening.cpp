// SPDX-License-Identifier: Apache-2.0
#include "ioci/client/opening.h"

#include <algorithm>
#include <array>
#include <span>
#include <utility>

#include "kernel/text.h"

namespace robomosp::ioci {
namespace {

/// Kinds that a window opens by name, and those that have pictures.
constexpr std::array kShown{Kind::world, Kind::robot, Kind::object, Kind::solid};
constexpr std::array kDrawn{Kind::world, Kind::robot, Kind::object, Kind::solid, Kind::material};

std::span<const Kind> kinds_of(const OpenRequest& request) {
  if (request.is_for_picture) return kDrawn;
  return kShown;
}
bool is_among(std::span<const Kind> kinds, Kind kind) {
  return std::find(kinds.begin(), kinds.end(), kind) != kinds.end();
}

/// Why a material, trajectory or task cannot be shown.
Error not_shown(const std::string& what, Kind kind, const std::string& name,
                const OpenRequest& request) {
  return error(ErrorCode::invalid_argument,
               text::quote(what) + " is a " + std::string(to_string(kind)) + "; it cannot be shown",
               kind == Kind::trajectory
                   ? "Give the world it is meant for, and --play ROBOT " + name + "."
               : request.is_for_picture ? "Give a world, a robot, an object, a solid or a material."
                                        : "Give a world, a robot, an object or a solid.");
}

std::vector<std::string> library_names(Application& app, Session& session, Kind kind) {
  std::vector<std::string> names;
  const auto listed =
      app.dispatch(session, "library.list", Map{{"kind", std::string(to_string(kind))}});
  const List* list = listed.ok() ? listed->as_list() : nullptr;
  if (list == nullptr) return names;
  for (const Value& name : *list)
    if (const std::string* word = name.as_string()) names.push_back(*word);
  return names;
}

/// The error for a name that no shown record has, with near names.
Error nothing_shown(Application& app, Session& session, const OpenRequest& request) {
  const std::string& what = request.what;
  for (const Kind kind : {Kind::material, Kind::trajectory, Kind::task}) {
    if (is_among(kinds_of(request), kind)) continue;
    const auto names = library_names(app, session, kind);
    if (std::find(names.begin(), names.end(), what) != names.end())
      return not_shown(what, kind, what, request);
  }
  std::vector<std::string> known;
  for (const Kind kind : kinds_of(request)) {
    const auto names = library_names(app, session, kind);
    known.insert(known.end(), names.begin(), names.end());
  }
  std::string hint = text::did_you_mean(what, known);
  if (hint.empty()) {
    const auto worlds = library_names(app, session, Kind::world),
               robots = library_names(app, session, Kind::robot);
    if (!worlds.empty()) hint = "The library has the worlds " + text::enumerate(worlds) + ".";
    if (!robots.empty())
      hint += (hint.empty() ? "The library" : " It") + std::string(" has the robots ") +
              text::enumerate(robots) + ".";
  }
  return error(ErrorCode::unknown_name,
               (request.is_for_picture ? "there is no world, robot, object, solid or material "
                                       : "there is no world, robot, object or solid ") +
                   text::quote(what),
               hint);
}

/// A file, or a name of the library tried kind by kind.
Result<Handle> open_record(Application& app, Session& session, const OpenRequest& request) {
  const std::string& what = request.what;
  const auto handle_of = [&](const Value& v) -> Result<Handle> {
    if (const Handle* h = v.as_handle()) return *h;
    return error(ErrorCode::internal, "loading gave no handle", "Report this.");
  };
  const std::filesystem::path path(what);
  if (path.has_extension() || path.has_parent_path()) {
    RMP_TRY_ASSIGN(const Value loaded, app.dispatch(session, "file.load", Map{{"file", what}}));
    RMP_TRY_ASSIGN(const Handle h, handle_of(loaded));
    RMP_TRY_ASSIGN(const AnyId id, Application::record_id(*app.document.now(), h));
    if (!is_among(kinds_of(request), id.kind))
      return not_shown(what, id.kind, app.document.now()->find(id)->name, request);
    return h;
  }
  for (const Kind kind : kinds_of(request)) {
    auto found = app.dispatch(session, std::string(to_string(kind)) + ".get", Map{{"name", what}});
    if (found.ok()) return handle_of(*found);
    if (found.error().code != ErrorCode::unknown_name && found.error().code != ErrorCode::not_found)
      return std::move(found).error();
  }
  return nothing_shown(app, session, request);
}

struct Scripted {
  Handle what;
  std::optional<Handle> recording;
};

/// The world of a recording; nullopt if it has none.
std::optional<Handle> world_of_recording(Application& app, std::uint64_t recording) {
  const auto found = app.recordings.find(recording);
  if (!found || !app.document.now()->get(found->world)) return std::nullopt;
  return Application::handle(AnyId(found->world));
}

Result<Scripted> run_shown_script(Application& app, Scripts& scripts, const OpenRequest& request) {
  const std::string file = request.script.string();
  RMP_TRY_ASSIGN(const List returned, scripts.run_file(request.script, request.arguments));
  if (const Handle* h = returned.empty() ? nullptr : returned.front().as_handle()) {
    if (h->kind == "recording") {
      if (const auto world = world_of_recording(app, h->number)) return Scripted{*world, *h};
      return error(ErrorCode::invalid_argument, "the script returned a recording without a world",
                   "Return one of a world, or the world itself.", file);
    }
    RMP_TRY_ASSIGN(const AnyId id, Application::record_id(*app.document.now(), *h));
    if (!is_among(kinds_of(request), id.kind)) {
      const std::string name = app.document.now()->find(id)->name;
      return not_shown(name, id.kind, name, request);
    }
    return Scripted{*h, std::nullopt};
  }
  std::optional<Scripted> last;
  for (const auto& [number, recording] : app.recordings.list())
    if (const auto world = world_of_recording(app, number))
      last = Scripted{*world, Handle{"recording", number}};
  if (last) return *last;
  return error(ErrorCode::invalid_argument, "the script made no recording of a world",
               "Let it simulate, world.simulate_physics{...}, say, without removing the recording, "
               "or return what is to be shown.",
               file);
}

/// The recording of the first robot along the first trajectory, or of those of `play`.
Result<std::optional<Handle>> simulate_shown(Application& app, Session& session, const Handle& what,
                                             std::vector<std::string> play) {
  const auto snapshot = app.document.now();
  const model::World* world = what.kind == "world" ? snapshot->get(WorldId{what.number}) : nullptr;
  if (!world) return std::optional<Handle>();
  if (play.empty() && !world->robots.empty() && !world->trajectories.empty())
    play = {world->robots.front().name, world->trajectories.front().name};
  if (play.size() < 2) return std::optional<Handle>();
  RMP_TRY_ASSIGN(const Value made,
                 app.dispatch(session, "world.inverse_kinematics",
                              Map{{"id", what}, {"robot", play[0]}, {"trajectory", play[1]}}));
  if (const Handle* h = made.as_handle()) return std::optional(*h);
  return error(ErrorCode::internal, "the simulation gave no recording", "Report this.");
}

}  // namespace

Result<Opened> open_shown(Application& app, Session& session, Scripts* scripts,
                          const OpenRequest& request) {
  Opened out;
  if (request.script.empty()) {
    RMP_TRY_ASSIGN(out.what, open_record(app, session, request));
    if (request.simulates || !request.play.empty()) {
      RMP_TRY_ASSIGN(out.recording, simulate_shown(app, session, out.what, request.play));
    }
  } else {
    if (!scripts)
      return error(ErrorCode::unsupported, "this program has no scripting language",
                   "Run the script by robomosp.", request.script.string());
    RMP_TRY_ASSIGN(Scripted scripted, run_shown_script(app, *scripts, request));
    out.what = std::move(scripted.what);
    out.recording = std::move(scripted.recording);
  }
  RMP_TRY_ASSIGN(const AnyId id, Application::record_id(*app.document.now(), out.what));
  out.name = app.document.now()->find(id)->name;
  if (out.recording) {
    const auto recording = app.recordings.find(out.recording->number);
    if (recording && recording->rows() > 0) {
      out.from = recording->columns.front().values.front();
      out.to = recording->columns.front().values.back();
    }
  }
  return out;
}

Result<Handle> compute_map(Application& app, Session& session, const Handle& what,
                           const std::string& map, const std::string& robot) {
  std::optional<Handle> of;
  if (what.kind == "robot") of = what;
  const auto snapshot = app.document.now();
  if (const model::World* world =
          what.kind == "world" ? snapshot->get(WorldId{what.number}) : nullptr)
    for (const model::PlacedRobot& r : world->robots)
      if (!of && (robot.empty() || r.name == robot)) of = Application::handle(AnyId(r.robot));
  if (!of)
    return error(ErrorCode::invalid_argument, "there is no robot that a map could be of",
                 "Show a robot, or a world with one.", "--map");
  RMP_TRY_ASSIGN(
      const Value done,
      app.dispatch(session, map == "reachability" ? "robot.reachability" : "robot.workspace",
                   Map{{"id", *of}}));
  const Value* recording = done.as_map() ? done.as_map()->find("recording") : nullptr;
  if (recording && recording->as_handle()) return *recording->as_handle();
  return error(ErrorCode::internal, "the map has no recording", "Report this.");
}

}  // namespace robomosp::ioci
