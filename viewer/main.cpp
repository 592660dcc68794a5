// SPDX-License-Identifier: GPL-3.0-or-later
// Program robomosp-desktop: shows a world, robot, object or solid in a window, or draws it to a
// file without any display.
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "ioci/application.h"
#include "kernel/text.h"
#include "sim/simulate.h"
#include "viewer/frame_builder.h"
#include "viewer/scene/offscreen.h"
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
  std::string render, screenshot;
  double at = -1;
  std::array<int, 2> size{1600, 1000};
  std::string view = "isometric";
  bool orthographic = false, fast = false;
  double zoom = 1;
  std::vector<double> eye, target;  ///< [m], three each
  std::vector<std::filesystem::path> plugin_path, library;
};

const std::map<std::string, viewer::Camera::View> kViews{
    {"isometric", viewer::Camera::View::isometric}, {"front", viewer::Camera::View::front},
    {"back", viewer::Camera::View::back},           {"left", viewer::Camera::View::left},
    {"right", viewer::Camera::View::right},         {"top", viewer::Camera::View::top},
    {"bottom", viewer::Camera::View::bottom}};

/// The record to show: a file, or a name of the library tried kind by kind.
Result<AnyId> open(ioci::Application& app, ioci::Session& session, const std::string& what) {
  const auto id_of = [&](const Value& v) -> Result<AnyId> {
    const Handle* h = v.as_handle();
    if (!h) return error(ErrorCode::internal, "loading gave no handle", "Report this.");
    return ioci::Application::record_id(*app.document.now(), *h);
  };
  const std::filesystem::path path(what);
  if (path.has_extension() || path.has_parent_path()) {
    RMP_TRY_ASSIGN(const Value loaded, app.dispatch(session, "file.load", Map{{"file", what}}));
    return id_of(loaded);
  }
  std::optional<Error> first;
  for (const Kind kind : {Kind::world, Kind::robot, Kind::object, Kind::solid}) {
    auto found = app.dispatch(session, std::string(to_string(kind)) + ".get", Map{{"name", what}});
    if (found.ok()) return id_of(*found);
    if (found.error().code != ErrorCode::unknown_name && found.error().code != ErrorCode::not_found)
      return std::move(found).error();
    if (!first) first = std::move(found).error();
  }
  return *std::move(first);
}

struct Picture {
  viewer::Frame frame;
  viewer::Playback playback;
};

Result<Picture> picture(ioci::Application& app, AnyId id, const Options& options) {
  NoProgress progress;
  const auto snapshot = app.document.now();
  Picture p;
  if (id.kind != Kind::world) {
    RMP_TRY_ASSIGN(p.frame, viewer::build_frame(*snapshot, app.derived, id, progress));
    return p;
  }
  const WorldId world{id.number};
  const viewer::WorldView view{*snapshot, app.derived, app.registry, world};
  std::vector<std::string> left_out;
  RMP_TRY_ASSIGN(p.frame, viewer::build_frame(view, left_out, progress));
  for (const auto& s : left_out) std::fprintf(stderr, "warning: left out: %s\n", s.c_str());
  const auto* record = snapshot->get(world);
  std::vector<std::string> play = options.play;
  if (play.empty() && !options.still && !record->robots.empty() && !record->trajectories.empty())
    play = {record->robots.front().name, record->trajectories.front().name};
  if (!play.empty()) {
    const sim::Simulator simulator{app.registry, app.derived, *snapshot};
    RMP_TRY_ASSIGN(const auto recording,
                   simulator.inverse_kinematics(
                       {.world = world, .robot = play[0], .trajectory = play[1]}, progress));
    RMP_TRY_ASSIGN(p.playback, viewer::build_playback(view, *recording, progress));
  }
  return p;
}

/// Moves the frame's items and triads to their places at `time`.
void pose_at(Picture& p, double time) {
  if (p.playback.times.empty()) return;
  const auto poses = viewer::poses_at(p.playback, time);
  for (std::size_t i = 0; i < p.playback.ids.size(); ++i) {
    for (auto& item : p.frame.items)
      if (item.id == p.playback.ids[i]) item.pose = poses[i];
    for (auto& triad : p.frame.triads)
      if (triad.id == p.playback.ids[i]) triad.pose = poses[i];
  }
}

int run(const Options& options) {
  auto made =
      ioci::Application::create({.plugin_path = options.plugin_path, .library = options.library});
  if (!made.ok()) return fail(made.error());
  ioci::Application& app = **made;
  ioci::Session session("desktop");
  auto id = open(app, session, options.what);
  if (!id.ok()) return fail(id.error());
  auto built = picture(app, *id, options);
  if (!built.ok()) return fail(built.error());
  Picture p = std::move(built).value();
  p.frame.camera.view = kViews.at(options.view);
  p.frame.camera.perspective = !options.orthographic;
  p.frame.camera.zoom = options.zoom;
  if (!options.eye.empty()) {
    p.frame.camera.view = viewer::Camera::View::custom;
    p.frame.camera.eye = {options.eye[0], options.eye[1], options.eye[2]};
    p.frame.camera.target = {options.target[0], options.target[1], options.target[2]};
  }
  if (options.at >= 0) pose_at(p, options.at);
  const auto quality = options.fast ? viewer::Quality::fast : viewer::Quality::quality;
  if (!options.render.empty()) {
    auto drawn =
        viewer::render_png(p.frame, options.size[0], options.size[1], quality, options.render);
    if (!drawn.ok()) return fail(drawn.error());
    std::printf("%s\n", options.render.c_str());
    return kOk;
  }
  viewer::WindowOptions window;
  window.title = app.document.now()->find(*id)->name + " - ROBOMOSP";
  window.play = !p.playback.times.empty();
  window.screenshot = options.screenshot;
  return viewer::run_window(p.frame, p.playback, window);
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
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
  cli.add_option("--render", options.render, "draw to this PNG file and exit; needs no display")
      ->type_name("FILE");
  cli.add_option("--screenshot", options.screenshot,
                 "photograph the window to this PNG file after a second and end")
      ->type_name("FILE");
  cli.add_option("--at", options.at, "time of the picture [s]")->check(CLI::NonNegativeNumber);
  cli.add_option("--size", options.size, "width and height of the picture [px]")
      ->check(CLI::Range(16, 8192));
  cli.add_option("--view", options.view, "isometric, front, back, left, right, top or bottom")
      ->check(CLI::IsMember(kViews));
  cli.add_option("--eye", options.eye, "where the camera stands, in the world [m]; with --target")
      ->expected(3)
      ->type_name("X Y Z");
  cli.add_option("--target", options.target,
                 "what the camera looks at, in the world [m]; with --eye")
      ->expected(3)
      ->type_name("X Y Z");
  cli.add_option("--zoom", options.zoom, "1 fits everything into the picture")
      ->check(CLI::Range(0.01, 100.0));
  cli.add_flag("--orthographic", options.orthographic, "parallel projection");
  cli.add_flag("--fast", options.fast, "simple shading");
  cli.add_option("--plugin-path", options.plugin_path, "folders searched for plugins first");
  cli.add_option("--library", options.library, "folders of materials, robots and worlds");
  try {
    cli.parse(argc, argv);
    if (options.eye.empty() != options.target.empty())
      throw CLI::RequiredError("--eye and --target go together: one of them");
  } catch (const CLI::ParseError& e) {
    const int status = cli.exit(e);
    return status == 0 ? kOk : kUsage;
  }
  return run(options);
}
