// SPDX-License-Identifier: GPL-3.0-or-later
// Program robomosp-desktop: shows a world, robot, object or solid in a window, or draws it to a
// file without any display.
#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <signal.h>
#include <unistd.h>

#include <CLI/CLI.hpp>

#include "ioci/core/application.h"
#include "ioci/core/kept_solvers.h"
#include "ioci/core/lua_plugins.h"
#include "kernel/text.h"
#include "lua/lua_state.h"
#include "model/placement.h"
#include "scene/build.h"
#include "scene/tool_ellipsoids.h"
#include "scene/voxels.h"
#include "sim/simulate.h"
#include "viewer/scene/playback.h"
#include "viewer/window/window.h"

namespace {

using namespace robomosp;

/// Exit statuses shared with `robomosp`.
enum Exit { kOk = 0, kFailed = 1, kUsage = 2, kBadInput = 3, kUnreachable = 4 };

int fail(const Error& e) {
  std::fprintf(stderr, "error: %s\n", e.sentence().c_str());
  switch (e.code) {
    case ErrorCode::usage: return kUsage;
    case ErrorCode::unreachable: return kUnreachable;
    case ErrorCode::io:
    case ErrorCode::internal:
    case ErrorCode::plugin_failed: return kFailed;
    default: return kBadInput;
  }
}

struct Options {
  std::string what = "pa10_circle";
  std::vector<std::string> play;  ///< robot, trajectory
  bool still = false;
  std::filesystem::path script;
  std::vector<std::string> arguments;  ///< of the script
  recording::RecordingPtr recording;   ///< that the script made last
  std::string render, screenshot;
  std::optional<double> at;  ///< [s]
  std::array<int, 2> size{1600, 1000};
  std::string ellipsoid;
  std::string view = "isometric", style = "smooth", quality = "normal", section, background;
  bool orthographic = false, fast = false, no_edges = false, hidden = false, com = false,
       frames = false;
  double explode = 0;
  std::string map, cut;  ///< voxels around the robot
  double map_opacity = 1;
  double zoom = 1;
  std::optional<Vec3> eye, target;  ///< [m]; both or neither
  std::vector<std::filesystem::path> plugin_path, library;
  bool trust = false;  ///< solvers in Lua that come with files run
};

const std::map<std::string, viewer::Camera::View> kViews{
    {"isometric", viewer::Camera::View::isometric}, {"front", viewer::Camera::View::front},
    {"back", viewer::Camera::View::back},           {"left", viewer::Camera::View::left},
    {"right", viewer::Camera::View::right},         {"top", viewer::Camera::View::top},
    {"bottom", viewer::Camera::View::bottom}};

constexpr std::array kShown{Kind::world, Kind::robot, Kind::object, Kind::solid};
const std::array kStyles{"smooth", "flat", "wireframe", "hidden_line"};
const std::array kQualities{"draft", "normal", "high"};

/// Why a material or a trajectory makes no picture.
Error not_shown(const std::string& what, Kind kind, const std::string& name) {
  return error(ErrorCode::invalid_argument,
               text::quote(what) + " is a " + std::string(to_string(kind)) + "; it cannot be shown",
               kind == Kind::trajectory
                   ? "Give the world it is meant for, and --play ROBOT " + name + "."
                   : "Give a world, a robot, an object or a solid.");
}

std::vector<std::string> library_names(ioci::Application& app, ioci::Session& session, Kind kind) {
  std::vector<std::string> names;
  const auto listed =
      app.dispatch(session, "library.list", Map{{"kind", std::string(to_string(kind))}});
  const List* list = listed.ok() ? listed->as_list() : nullptr;
  if (list == nullptr) return names;
  for (const Value& name : *list)
    if (const std::string* word = name.as_string()) names.push_back(*word);
  return names;
}

/// The error for a name that is nothing shown, with what may have been meant.
Error nothing_shown(ioci::Application& app, ioci::Session& session, const std::string& what) {
  for (const Kind kind : {Kind::material, Kind::trajectory, Kind::task}) {
    const auto names = library_names(app, session, kind);
    if (std::find(names.begin(), names.end(), what) != names.end())
      return not_shown(what, kind, what);
  }
  std::vector<std::string> known;
  for (const Kind kind : kShown) {
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
               "there is no world, robot, object or solid " + text::quote(what), hint);
}

/// The record to show: a file, or a name of the library tried kind by kind.
Result<AnyId> open_record(ioci::Application& app, ioci::Session& session, const std::string& what) {
  const auto id_of = [&](const Value& v) -> Result<AnyId> {
    const Handle* h = v.as_handle();
    if (!h) return error(ErrorCode::internal, "loading gave no handle", "Report this.");
    return ioci::Application::record_id(*app.document.now(), *h);
  };
  const std::filesystem::path path(what);
  if (path.has_extension() || path.has_parent_path()) {
    RMP_TRY_ASSIGN(const Value loaded, app.dispatch(session, "file.load", Map{{"file", what}}));
    RMP_TRY_ASSIGN(const AnyId id, id_of(loaded));
    if (std::find(kShown.begin(), kShown.end(), id.kind) == kShown.end())
      return not_shown(what, id.kind, app.document.now()->find(id)->name);
    return id;
  }
  for (const Kind kind : kShown) {
    auto found = app.dispatch(session, std::string(to_string(kind)) + ".get", Map{{"name", what}});
    if (found.ok()) return id_of(*found);
    if (found.error().code != ErrorCode::unknown_name && found.error().code != ErrorCode::not_found)
      return std::move(found).error();
  }
  return nothing_shown(app, session, what);
}

struct Picture {
  viewer::Frame frame;
  viewer::Playback playback;
  scene::MovingEllipsoids ellipsoids;
};

/// The simulation that is played or looked into; nothing where nothing moves.
Result<recording::RecordingPtr> recording_of(ioci::Application& app, AnyId id,
                                             const Options& options) {
  if (id.kind != Kind::world) return recording::RecordingPtr{};
  if (options.recording) return options.recording;
  NoProgress progress;
  const auto snapshot = app.document.now();
  const WorldId world{id.number};
  const auto* record = snapshot->get(world);
  std::vector<std::string> play = options.play;
  if (play.empty() && !options.still && !record->robots.empty() && !record->trajectories.empty())
    play = {record->robots.front().name, record->trajectories.front().name};
  if (play.empty()) return recording::RecordingPtr{};
  const sim::Simulator simulator{app.registry, app.derived, *snapshot};
  return simulator.inverse_kinematics({.world = world, .robot = play[0], .trajectory = play[1]},
                                      progress);
}

/// The robot that a map is of: the one shown, or that of a world which plays or stands first.
Result<std::pair<RobotId, Pose>> mapped_robot(ioci::Application& app, AnyId id,
                                              const Options& options) {
  if (id.kind == Kind::robot) return std::pair{RobotId{id.number}, Pose{}};
  if (id.kind == Kind::world) {
    const auto snapshot = app.document.now();
    for (const auto& r : snapshot->get(WorldId{id.number})->robots)
      if (options.play.empty() || r.name == options.play[0])
        return std::pair{r.robot, model::pose(r.placement)};
  }
  return error(ErrorCode::invalid_argument, "there is no robot that a map could be of",
               "Show a robot, or a world with one.", "--map");
}

/// The recording of the map that is asked for.
Result<Handle> map_recording(ioci::Application& app, ioci::Session& session, RobotId robot,
                             const Options& options) {
  const bool is_reach = options.map == "reachability";
  const Map args{{"id", ioci::Application::handle(AnyId{Kind::robot, robot.number})}};
  RMP_TRY_ASSIGN(const Value done,
                 app.dispatch(session, is_reach ? "robot.reachability" : "robot.workspace", args));
  return *done.as_map()->find("recording")->as_handle();
}

/// Adds the map to the scene of a window.
Result<void> add_map(ioci::Application& app, ioci::Session& session, AnyId id,
                     const Options& options, render::Scene& scene) {
  RMP_TRY_ASSIGN(const auto of, mapped_robot(app, id, options));
  RMP_TRY_ASSIGN(const Handle h, map_recording(app, session, of.first, options));
  scene::VoxelView view;
  view.opacity = options.map_opacity;
  if (!options.cut.empty()) {
    view.cut.emplace();
    view.cut->normal[static_cast<std::size_t>(options.cut.back() - 'x')] =
        options.cut.size() > 1 ? -1 : 1;
  }
  return scene::add_voxels(scene, *app.recordings.find(h.number), of.second, view);
}

Result<Picture> picture(ioci::Application& app, ioci::Session& session, AnyId id,
                        const Options& options) {
  NoProgress progress;
  const auto snapshot = app.document.now();
  const scene::Source source{*snapshot, app.derived, app.registry};
  scene::Extras extras;
  extras.com = options.com;
  extras.frames = options.frames;
  extras.explode = options.explode;
  RMP_TRY_ASSIGN(scene::Built built, scene::build(source, id, extras, progress));
  for (const auto& s : built.left_out) std::fprintf(stderr, "warning: left out: %s\n", s.c_str());
  Picture p;
  if (!options.map.empty()) RMP_TRY(add_map(app, session, id, options, built.scene));
  static_cast<render::Scene&>(p.frame) = std::move(built.scene);
  RMP_TRY_ASSIGN(const recording::RecordingPtr recording, recording_of(app, id, options));
  if (recording) {
    RMP_TRY_ASSIGN(p.playback,
                   scene::build_playback(source, WorldId{id.number}, *recording, progress));
  }
  RMP_TRY_ASSIGN(p.ellipsoids,
                 scene::MovingEllipsoids::build(source, id, recording.get(), progress));
  return p;
}

/// Finds out before the work whether a picture can be written to `path` afterwards.
Result<void> check_picture_file(const std::string& option, const std::string& path) {
  namespace fs = std::filesystem;
  const fs::path file(path);
  std::string ending = file.extension().string();
  for (char& c : ending) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  if (ending != ".png")
    return error(ErrorCode::invalid_argument, text::quote(path) + " does not end with .png",
                 "Pictures are written as PNG files only.", option);
  const fs::path folder = file.has_parent_path() ? file.parent_path() : fs::path(".");
  std::error_code ignored;
  if (!fs::is_directory(folder, ignored))
    return error(ErrorCode::not_found,
                 "cannot write " + text::quote(path) + ": there is no folder " +
                     text::quote(folder.string()),
                 "Create the folder or choose another one.", option);
  if (fs::is_directory(file, ignored))
    return error(ErrorCode::invalid_argument, text::quote(path) + " is a folder",
                 "Choose another name.", option);
  if (access(folder.c_str(), W_OK | X_OK) != 0)
    return error(ErrorCode::io,
                 "cannot write " + text::quote(path) + ": the folder " +
                     text::quote(folder.string()) + " may not be written",
                 "Choose another folder.", option);
  return {};
}

/// The time to show: beyond the end it is the end, with a note.
double time_shown(double at, const std::vector<double>& times) {
  if (times.empty()) {
    std::fprintf(stderr, "warning: --at: nothing moves here, so the time changes nothing.\n");
    return at;
  }
  const double end = times.back();
  if (at > end) {
    std::fprintf(stderr,
                 "warning: --at: %s s is beyond the end; the motion takes %s s, and its end is "
                 "shown.\n",
                 text::print_rounded(at).c_str(), text::print_rounded(end).c_str());
  }
  return std::min(at, end);
}

/// Draws to the file by the command that every other front end uses.
int render(ioci::Application& app, ioci::Session& session, AnyId id, const Options& options) {
  const std::string kind(to_string(id.kind));
  Map args{{"id", ioci::Application::handle(id)},
           {"file", options.render},
           {"view", options.view},
           {"style", options.style},
           {"quality", options.fast ? "draft" : options.quality},
           {"size", List{options.size[0], options.size[1]}},
           {"projection", options.orthographic ? "orthographic" : "perspective"},
           {"zoom", options.zoom},
           {"edges", !options.no_edges},
           {"hidden", options.hidden}};
  const auto add_vec = [&](const char* name, const std::optional<Vec3>& v) {
    if (v) args.set(name, List{(*v)[0], (*v)[1], (*v)[2]});
  };
  add_vec("eye", options.eye);
  add_vec("target", options.target);
  if (!options.section.empty()) args.set("section", options.section);
  if (!options.background.empty()) args.set("background", options.background);
  if (options.explode > 0) args.set("explode", options.explode);
  if (options.com) args.set("com", true);
  if (!options.ellipsoid.empty()) args.set("ellipsoid", options.ellipsoid);
  if (options.frames) args.set("frames", true);
  if (!options.map.empty()) {
    const auto of = mapped_robot(app, id, options);
    if (!of.ok()) return fail(of.error());
    const auto recording = map_recording(app, session, of->first, options);
    if (!recording.ok()) return fail(recording.error());
    Map map{{"recording", *recording}, {"opacity", options.map_opacity}};
    if (!options.cut.empty()) map.set("cut", options.cut);
    if (!options.play.empty()) map.set("robot", options.play[0]);
    args.set("map", std::move(map));
  }
  if (options.at || !options.play.empty()) {
    auto recording = recording_of(app, id, options);
    if (!recording.ok()) return fail(recording.error());
    if (options.at) {
      const double at = time_shown(
          *options.at, *recording ? (*recording)->columns.front().values : std::vector<double>{});
      if (*recording) {
        args.set("recording", Handle{"recording", app.recordings.add(*recording)});
        args.set("at", at);
      }
    }
  }
  const auto drawn = app.dispatch(session, kind + ".render", args);
  if (!drawn.ok()) return fail(drawn.error());
  if (const Map* m = drawn->as_map(); m && m->find("left_out"))
    for (const Value& sentence : *m->find("left_out")->as_list())
      std::fprintf(stderr, "warning: left out: %s\n", sentence.as_string()->c_str());
  std::printf("%s\n", options.render.c_str());
  return kOk;
}

/// Runs the script that is asked for. What it returns is shown, a recording or a record; else the
/// last recording that it made.
Result<AnyId> run_script(ioci::Application& app, lua::LuaState& lua, Options& options) {
  RMP_TRY_ASSIGN(const List returned, lua.run_file_values(options.script, options.arguments));
  if (const Handle* h = returned.empty() ? nullptr : returned.front().as_handle()) {
    if (h->kind == "recording") {
      options.recording = app.recordings.find(h->number);
      if (options.recording && app.document.now()->get(options.recording->world))
        return AnyId(options.recording->world);
      return error(ErrorCode::invalid_argument, "the script returned a recording without a world",
                   "Return one of a world, or the world itself.", options.script.string());
    }
    RMP_TRY_ASSIGN(const AnyId id, ioci::Application::record_id(*app.document.now(), *h));
    if (std::find(kShown.begin(), kShown.end(), id.kind) == kShown.end())
      return not_shown(app.document.now()->find(id)->name, id.kind,
                       app.document.now()->find(id)->name);
    options.still = true;
    return id;
  }
  for (const auto& [number, recording] : app.recordings.list())
    if (app.document.now()->get(recording->world)) options.recording = recording;
  if (options.recording) return AnyId(options.recording->world);
  return error(ErrorCode::invalid_argument, "the script made no recording of a world",
               "Let it simulate, world.simulate_physics{...}, say, without removing the recording, "
               "or return what is to be shown.",
               options.script.string());
}

int run(Options options) {
  // First of all, as it forks and the application has threads.
  if (options.render.empty()) {
    if (const auto display = viewer::check_display(); !display.ok()) {
      fail(display.error());
      return kFailed;
    }
  }
  auto made = ioci::Application::create(
      {.plugin_path = options.plugin_path,
       .library = options.library,
       .kept_geometry = FileCache::user_folder(),
       .kept_geometry_limit = FileCache::user_limit(),
       .recovery = options.render.empty() ? io::recovery_folder() : std::filesystem::path()});
  if (!made.ok()) return fail(made.error());
  ioci::Application& app = **made;
  // As in the console: what was not as asked for is told on standard error.
  const auto tell = [](const Message& m) {
    if (m.severity >= Severity::warning)
      std::fprintf(stderr, "warning: %s\n", text::visible(m.text).c_str());
  };
  for (const Message& m : app.messages.recent()) tell(m);
  (void)app.messages.subscribe(tell);
  if (options.trust) app.kept_solvers->trust_all();
  ioci::Session session("desktop", ioci::SessionKind::window);
  lua::LuaState lua(app, session);
  lua.load_plugins(ioci::lua_plugins(PluginLoader::search_path(options.plugin_path)));
  auto id = options.script.empty() ? open_record(app, session, options.what)
                                   : run_script(app, lua, options);
  if (!id.ok()) return fail(id.error());
  if (!options.render.empty()) return render(app, session, *id, options);
  auto built = picture(app, session, *id, options);
  if (!built.ok()) return fail(built.error());
  Picture p = std::move(built).value();
  p.frame.camera.view = kViews.at(options.view);
  p.frame.camera.perspective = !options.orthographic;
  p.frame.camera.zoom = options.zoom;
  if (options.eye) {
    p.frame.camera.view = viewer::Camera::View::custom;
    p.frame.camera.eye = options.eye;
    p.frame.camera.target = options.target;
  }
  const auto style = std::find(kStyles.begin(), kStyles.end(), options.style) - kStyles.begin();
  p.frame.style = static_cast<viewer::Style>(style);
  p.frame.feature_edges = !options.no_edges;
  p.frame.hidden_edges = options.hidden;
  if (options.at) scene::pose_at(p.frame, p.playback, time_shown(*options.at, p.playback.times));
  viewer::WindowOptions window;
  window.title = app.document.now()->find(*id)->name + " - ROBOMOSP";
  window.play = !p.playback.times.empty();
  window.screenshot = options.screenshot;
  if (!p.ellipsoids.empty())
    window.ellipsoids = [&p](double time, bool velocity, bool force) {
      return p.ellipsoids.at(time, {velocity, force});
    };
  window.velocity_ellipsoid = options.ellipsoid == "velocity" || options.ellipsoid == "both";
  window.force_ellipsoid = options.ellipsoid == "force" || options.ellipsoid == "both";
  return viewer::run_window(p.frame, p.playback, window);
}

/// The options that CLI11 would explain badly, as they were typed.
struct Words {
  std::string size, at, zoom;
  std::vector<std::string> eye, target;
};

Error wrong(const std::string& option, std::string message) {
  return error(ErrorCode::usage, std::move(message), {}, option);
}

Result<std::array<int, 2>> read_size(const std::string& typed) {
  std::string words = typed;
  for (char& c : words)
    if (c == 'x' || c == 'X' || c == ',') c = ' ';
  const auto space = words.find(' ');
  if (space != std::string::npos) {
    const std::string_view all = words;
    const auto width = text::read_int(text::trim(all.substr(0, space))),
               height = text::read_int(text::trim(all.substr(space)));
    if (width && height) {
      if (std::min(*width, *height) >= 16 && std::max(*width, *height) <= 8192)
        return std::array{static_cast<int>(*width), static_cast<int>(*height)};
      return wrong("--size", text::quote(typed) +
                                 " is out of range; the width and the height are 16..8192 pixels");
    }
  }
  return wrong("--size", text::quote(typed) +
                             " is not a width and a height; give two whole numbers of pixels in "
                             "16..8192, such as 640 480 or 640x480");
}

Result<double> read_at(const std::string& typed) {
  const auto time = text::read_real(typed);
  if (!time || !std::isfinite(*time))
    return wrong("--at", text::quote(typed) + " is not a time in seconds");
  if (*time < 0)
    return wrong("--at",
                 "the time must be 0 or more seconds, and " + text::quote(typed) + " is less");
  return *time;
}

Result<double> read_zoom(const std::string& typed) {
  const auto zoom = text::read_real(typed);
  if (!zoom || std::isnan(*zoom)) return wrong("--zoom", text::quote(typed) + " is not a number");
  if (*zoom < 0.01 || *zoom > 100)
    return wrong("--zoom", text::quote(typed) + " is out of range; a zoom is 0.01..100");
  return *zoom;
}

Result<Vec3> read_point(const std::string& option, const std::vector<std::string>& typed) {
  // Further away single-precision graphics shows nothing.
  constexpr double kFar = 1e6;
  Vec3 point{};
  for (std::size_t i = 0; i < 3; ++i) {
    const auto coordinate = text::read_real(typed[i]);
    if (!coordinate || !std::isfinite(*coordinate))
      return wrong(option, text::quote(typed[i]) + " is not a coordinate in metres");
    if (std::abs(*coordinate) > kFar)
      return wrong(option,
                   text::quote(typed[i]) + " is too far away; coordinates are -1000000..1000000 m");
    point[i] = *coordinate;
  }
  return point;
}

Result<void> read_words(const CLI::App& cli, const Words& words, Options& options) {
  if (cli.count("--size") > 0) {
    RMP_TRY_ASSIGN(options.size, read_size(words.size));
  }
  if (cli.count("--at") > 0) {
    RMP_TRY_ASSIGN(options.at, read_at(words.at));
  }
  if (cli.count("--zoom") > 0) {
    RMP_TRY_ASSIGN(options.zoom, read_zoom(words.zoom));
  }
  if (words.eye.empty() != words.target.empty())
    return wrong(words.eye.empty() ? "--target" : "--eye",
                 "--eye and --target go together, and only one of them is given");
  if (!words.eye.empty()) {
    RMP_TRY_ASSIGN(options.eye, read_point("--eye", words.eye));
    RMP_TRY_ASSIGN(options.target, read_point("--target", words.target));
    const Vec3 &eye = *options.eye, &target = *options.target;
    if (std::hypot(eye[0] - target[0], eye[1] - target[1], eye[2] - target[2]) < 1e-6)
      return wrong("--eye", "the eye is at the target, so there is no direction to look");
  }
  if (cli.count("--render") > 0) RMP_TRY(check_picture_file("--render", options.render));
  if (cli.count("--screenshot") > 0)
    RMP_TRY(check_picture_file("--screenshot", options.screenshot));
  return {};
}

/// The arguments after the program's name, last first as CLI11 wants them, with `--size W H` made
/// `--size WxH`: an option of one or two words would swallow the name that follows.
std::vector<std::string> arguments(int argc, char** argv) {
  std::vector<std::string> all;
  for (int i = 1; i < argc; ++i) {
    all.emplace_back(argv[i]);
    if (all.back() == "--size" && i + 2 < argc && text::read_real(argv[i + 1]) &&
        text::read_real(argv[i + 2])) {
      all.back() += "=" + std::string(argv[i + 1]) + "x" + argv[i + 2];
      i += 2;
    }
  }
  std::reverse(all.begin(), all.end());
  return all;
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  Words words;
  ::signal(SIGXFSZ, SIG_IGN);  // a file that grows too large is an error of whoever writes it
  CLI::App cli("Shows a world, robot, object or solid; without --render in a window.",
               "robomosp-desktop");
  cli.set_version_flag("--version", "robomosp-desktop " RMP_SDK_VERSION);
  cli.add_option("what", options.what,
                 "a native file, or a name of the library (default: pa10_circle)");
  cli.add_option("--play", options.play,
                 "simulate this robot on this trajectory (default: the first of each)")
      ->expected(2)
      ->type_name("ROBOT TRAJECTORY");
  cli.add_flag("--still", options.still, "do not simulate");
  cli.add_option("--script", options.script,
                 "run this Lua file, and show what it returns, or else the last recording that it "
                 "made")
      ->excludes("what")
      ->excludes("--play")
      ->excludes("--still");
  cli.add_option("--argument", options.arguments, "an argument of the script; may be repeated")
      ->needs("--script")
      ->allow_extra_args(false)
      ->type_name("TEXT");
  cli.add_option("--render", options.render, "draw to this PNG file and exit; needs no display")
      ->type_name("FILE");
  cli.add_option("--screenshot", options.screenshot,
                 "photograph the window to this PNG file after a second and end")
      ->type_name("FILE");
  cli.add_option("--at", words.at, "time of the picture [s], 0 or more")->type_name("TIME");
  cli.add_option("--size", words.size,
                 "width and height of the picture [px], 16..8192 each; also WxH or W,H "
                 "(default: 1600 1000)")
      ->type_name("W H");
  cli.add_option("--view", options.view, "isometric, front, back, left, right, top or bottom")
      ->check(CLI::IsMember(kViews));
  cli.add_option("--eye", words.eye, "where the camera stands, in the world [m]; with --target")
      ->expected(3)
      ->type_name("X Y Z");
  cli.add_option("--target", words.target, "what the camera looks at, in the world [m]; with --eye")
      ->expected(3)
      ->type_name("X Y Z");
  cli.add_option("--zoom", words.zoom, "0.01..100; 1 fits everything into the picture")
      ->type_name("FACTOR");
  cli.add_flag("--orthographic", options.orthographic, "parallel projection");
  cli.add_option("--style", options.style, "smooth, flat, wireframe or hidden_line")
      ->check(CLI::IsMember(std::vector<std::string>(kStyles.begin(), kStyles.end())));
  cli.add_flag("--no-edges", options.no_edges, "no lines along the edges of bodies");
  cli.add_flag("--hidden", options.hidden, "with --style hidden_line: hidden edges dashed");
  cli.add_option("--section", options.section,
                 "with --render: cut through the middle and take away the side of this axis: x, "
                 "-x, y, -y, z or -z")
      ->check(CLI::IsMember({"x", "-x", "y", "-y", "z", "-z"}))
      ->type_name("AXIS");
  cli.add_option("--explode", options.explode, "move parts outwards by this share, 0..100")
      ->check(CLI::Range(0.0, 100.0))
      ->type_name("FACTOR");
  cli.add_option("--map", options.map,
                 "voxels around the robot: manipulability or reachability, coloured")
      ->check(CLI::IsMember({"manipulability", "reachability"}))
      ->type_name("MAP");
  cli.add_option("--cut", options.cut,
                 "with --map: leave out its voxels on the side of this axis: x, -x, y, -y, z or -z")
      ->check(CLI::IsMember({"x", "-x", "y", "-y", "z", "-z"}))
      ->type_name("AXIS");
  cli.add_option("--map-opacity", options.map_opacity, "with --map: 0.01..1; 1 is solid")
      ->check(CLI::Range(0.01, 1.0))
      ->type_name("SHARE");
  cli.add_flag("--com", options.com, "mark the centre of mass and the principal axes");
  cli.add_option("--ellipsoid", options.ellipsoid,
                 "at the tools of robots: velocity, force or both")
      ->check(CLI::IsMember({"velocity", "force", "both"}))
      ->type_name("WHICH");
  cli.add_flag("--frames", options.frames, "frames of nodes, parts or links");
  cli.add_option("--background", options.background,
                 "with --render: studio, white, transparent or a colour such as #e8eef4");
  cli.add_option("--quality", options.quality, "with --render: draft, normal or high")
      ->check(CLI::IsMember(std::vector<std::string>(kQualities.begin(), kQualities.end())));
  cli.add_flag("--fast", options.fast, "the same as --quality draft");
  cli.add_option("--plugin-path", options.plugin_path, "folders searched for plugins first");
  cli.add_option("--library", options.library, "folders of materials, robots and worlds");
  cli.add_flag("--trust", options.trust,
               "run solvers in Lua that come with files, without asking, in this run");
  try {
    cli.parse(arguments(argc, argv));
  } catch (const CLI::ParseError& e) {
    const int status = cli.exit(e);
    return status == 0 ? kOk : kUsage;
  }
  if (const auto read = read_words(cli, words, options); !read.ok()) return fail(read.error());
  return run(options);
}
