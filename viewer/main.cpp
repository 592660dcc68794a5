// SPDX-License-Identifier: GPL-3.0-or-later
// Program robomosp-desktop: shows a world, robot, object or solid in a window, or draws it to a
// file without any display.
#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <condition_variable>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <malloc.h>
#include <signal.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include "ioci/client/live_view.h"
#include "ioci/client/opening.h"
#include "ioci/client/window_program.h"
#include "kernel/text.h"
#include "viewer/desktop/desktop.h"
#include "viewer/desktop/start_times.h"
#include "viewer/window/check_display.h"
#include "viewer/window/graphics_report.h"

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
  std::vector<std::string> what;
  std::vector<std::string> play;  ///< robot, trajectory
  bool still = false;
  std::filesystem::path script;
  std::vector<std::string> arguments;  ///< of the script
  std::string render, screenshot, tour;
  std::optional<double> at;  ///< [s]
  std::array<int, 2> size{1600, 1000};
  bool has_size = false, software_view = false, start_times = false, safe = false;
  std::string ellipsoid;
  std::string view = "isometric", style = "smooth", quality = "normal", section, background;
  bool orthographic = false, fast = false, no_edges = false, no_axes = false, hidden = false,
       com = false, frames = false;
  double explode = 0;
  std::string map, cut;  ///< voxels around the robot
  double map_opacity = 1;
  double zoom = 1;
  std::optional<Vec3> eye, target;  ///< [m]; both or neither
  std::vector<std::filesystem::path> plugin_path, library;
  std::vector<std::string> tour_pictures;
  bool graphics = false;
  bool trust = false;  ///< solvers in Lua that come with files run
};

const std::map<std::string, viewer::Camera::View> kViews{
    {"isometric", viewer::Camera::View::isometric}, {"front", viewer::Camera::View::front},
    {"back", viewer::Camera::View::back},           {"left", viewer::Camera::View::left},
    {"right", viewer::Camera::View::right},         {"top", viewer::Camera::View::top},
    {"bottom", viewer::Camera::View::bottom}};

const std::array kStyles{"smooth", "flat", "wireframe", "hidden_line"};
const std::array kQualities{"draft", "normal", "high"};

/// The main thread as the host of a view: it waits for results.
class Host {
 public:
  /// [any thread]
  void wake() {
    const std::lock_guard lock(mutex_);
    is_woken_ = true;
    woken_.notify_all();
  }
  /// Delivers until `is_so`.
  void until(ioci::LiveView& view, const std::function<bool()>& is_so) {
    while (!is_so()) {
      {
        std::unique_lock lock(mutex_);
        woken_.wait(lock, [this] { return is_woken_; });
        is_woken_ = false;
      }
      (void)view.deliver();
    }
  }
  /// The result of a call.
  Result<Value> result(ioci::LiveView& view, const ioci::Client::Answer& answer) {
    until(view, [&] { return answer.result() != nullptr; });
    return *answer.result();
  }

 private:
  std::mutex mutex_;
  std::condition_variable woken_;
  bool is_woken_ = false;  // guarded by mutex_
};

void warn_left_out(const std::string& sentence) {
  std::fprintf(stderr, "warning: left out: %s\n", sentence.c_str());
}

/// The argument `map` of pictures, with a recording that is computed now.
Result<Map> map_of(Host& host, ioci::LiveView& view, const Handle& what, const Options& options) {
  const std::string robot = options.play.empty() ? "" : options.play[0];
  RMP_TRY_ASSIGN(const Value recording,
                 host.result(view, view.compute_map(what, options.map, robot, {})));
  Map map{{"recording", recording}, {"opacity", options.map_opacity}};
  if (!options.cut.empty()) map.set("cut", options.cut);
  if (!robot.empty()) map.set("robot", robot);
  return map;
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
double time_shown(double at, const ioci::Opened& opened) {
  if (!opened.recording) {
    std::fprintf(stderr, "warning: --at: nothing moves here, so the time changes nothing.\n");
    return at;
  }
  const double end = opened.to;
  if (at > end) {
    std::fprintf(stderr,
                 "warning: --at: %s s is beyond the end; the motion takes %s s, and its end is "
                 "shown.\n",
                 text::print_rounded(at).c_str(), text::print_rounded(end).c_str());
  }
  return std::min(at, end);
}

/// Draws to the file by the command that every other front end uses.
int render(Host& host, ioci::LiveView& view, const ioci::Opened& opened, const Options& options) {
  Map args{{"id", opened.what},
           {"file", options.render},
           {"view", options.view},
           {"style", options.style},
           {"quality", options.fast ? "draft" : options.quality},
           {"size", List{options.size[0], options.size[1]}},
           {"projection", options.orthographic ? "orthographic" : "perspective"},
           {"zoom", options.zoom},
           {"edges", !options.no_edges}};
  const auto add_vec = [&](const char* name, const std::optional<Vec3>& v) {
    if (v) args.set(name, List{(*v)[0], (*v)[1], (*v)[2]});
  };
  add_vec("eye", options.eye);
  add_vec("target", options.target);
  if (options.hidden) args.set("hidden", true);
  if (options.no_axes) args.set("axes", false);
  if (!options.section.empty()) args.set("section", options.section);
  if (!options.background.empty()) args.set("background", options.background);
  if (options.explode > 0) args.set("explode", options.explode);
  if (options.com) args.set("com", true);
  if (!options.ellipsoid.empty()) args.set("ellipsoid", options.ellipsoid);
  if (options.frames) args.set("frames", true);
  if (!options.map.empty()) {
    auto map = map_of(host, view, opened.what, options);
    if (!map.ok()) return fail(map.error());
    args.set("map", std::move(*map));
  }
  if (options.at) {
    const double at = time_shown(*options.at, opened);
    if (opened.recording) {
      args.set("recording", *opened.recording);
      args.set("at", at);
    }
  }
  const auto drawn =
      host.result(view, view.client().call(opened.what.kind + ".render", std::move(args)));
  if (!drawn.ok()) return fail(drawn.error());
  if (const Map* m = drawn->as_map(); m && m->find("left_out"))
    for (const Value& sentence : *m->find("left_out")->as_list())
      warn_left_out(*sentence.as_string());
  std::printf("%s\n", options.render.c_str());
  return kOk;
}

viewer::DesktopOptions desktop_options(const Options& options) {
  viewer::DesktopOptions d;
  for (const std::string& what : options.what) {
    ioci::OpenRequest request;
    if (std::filesystem::path(what).extension() == ".lua") request.script = what;
    else request.what = what;
    request.play = options.play;
    request.simulates = !options.still;
    d.open.push_back(std::move(request));
  }
  if (!options.script.empty()) {
    ioci::OpenRequest request;
    request.script = options.script;
    request.arguments = options.arguments;
    request.simulates = !options.still;
    d.open.push_back(std::move(request));
  }
  d.plugin_path = options.plugin_path;
  d.at = options.at;
  d.camera.view = kViews.at(options.view);
  d.camera.perspective = !options.orthographic;
  d.camera.zoom = options.zoom;
  if (options.eye) {
    d.camera.view = viewer::Camera::View::custom;
    d.camera.eye = options.eye;
    d.camera.target = options.target;
  }
  const auto style = std::find(kStyles.begin(), kStyles.end(), options.style) - kStyles.begin();
  d.style = static_cast<viewer::Style>(style);
  d.has_edges = !options.no_edges;
  d.has_hidden_edges = options.hidden;
  if (options.com) d.layers.emplace_back("centres_of_mass");
  if (options.frames) d.layers.emplace_back("frames");
  for (const char* which : {"velocity", "force"})
    if (options.ellipsoid == which || options.ellipsoid == "both")
      d.layers.push_back(std::string(which) + "_ellipsoids");
  d.explode = options.explode;
  d.map = options.map;
  d.map_robot = options.play.empty() ? "" : options.play[0];
  d.map_cut = options.cut;
  d.map_opacity = options.map_opacity;
  d.screenshot = options.screenshot;
  d.tour = options.tour;
  d.tour_pictures = options.tour_pictures;
  if (options.has_size) d.size = options.size;
  d.software_view = options.software_view;
  d.is_safe = options.safe;
  return d;
}

/// Keeps large blocks, such as textures and pictures, out of the heap. By default the C library
/// raises the size from which blocks get pages of their own up to 32 MB, once such blocks are
/// freed; later ones then fragment the heap, which never shrinks.
void return_large_blocks() {
  constexpr int kOwnPages = 256 * 1024, kReturned = 1024 * 1024;  // [bytes]
  ::mallopt(M_MMAP_THRESHOLD, kOwnPages);
  ::mallopt(M_TRIM_THRESHOLD, kReturned);
}

/// For a window that does not start or work: drivers, plugins and settings of this machine are left
/// out. The environment also reaches the processes that it starts.
void make_safe(Options& options) {
  ::setenv("LIBGL_ALWAYS_SOFTWARE", "1", 1);
  ::setenv("__GLX_VENDOR_LIBRARY_NAME", "mesa", 1);
  ::setenv("ROBOMOSP_SHIPPED_PLUGINS_ONLY", "1", 1);
  options.software_view = true;  // no OpenGL of the display server either
}

int run(Options options, viewer::StartTimes& times) {
  if (options.safe) make_safe(options);
  if (options.graphics) {
    const bool has_display = viewer::check_display().ok();
    std::printf("%s", viewer::graphics_report(has_display).c_str());
    return kOk;
  }
  // First of all, as it forks and the application has threads.
  const bool has_window = options.render.empty();
  if (has_window) {
    return_large_blocks();
    if (const auto display = viewer::check_display(); !display.ok()) {
      fail(display.error());
      return kFailed;
    }
    times.reached("display checked");
  }
  ioci::WindowProgramOptions program;
  program.plugin_path = options.plugin_path;
  program.library = options.library;
  program.keeps_unsaved = has_window;
  program.trusts_scripts = options.trust;
  // As in the console: warnings are printed on standard error.
  program.on_message = [](const Message& m) {
    if (m.severity >= Severity::warning)
      std::fprintf(stderr, "warning: %s\n", text::visible(m.text).c_str());
  };
  const auto app = ioci::start_window_program(std::move(program));
  if (!app.ok()) return fail(app.error());

  times.reached("program started");
  if (has_window) {
    viewer::DesktopOptions desktop = desktop_options(options);
    if (options.start_times) desktop.start_times = &times;
    return viewer::run_desktop(**app, std::move(desktop));
  }

  Host host;
  ioci::LiveView::Options wanted;
  wanted.name = "desktop";
  wanted.wake = [&host] { host.wake(); };
  wanted.plugin_path = options.plugin_path;
  const auto view = ioci::LiveView::open(**app, std::move(wanted));
  if (!view.ok()) return fail(view.error());

  ioci::OpenRequest request;
  request.what = options.what.empty() ? "pa10_circle" : options.what.front();
  request.script = options.script;
  request.arguments = options.arguments;
  request.play = options.play;
  if (std::filesystem::path(request.what).extension() == ".lua")
    request.script = std::exchange(request.what, {});
  request.simulates = !options.still && (options.at || !options.play.empty());
  request.is_for_picture = true;
  std::optional<Result<ioci::Opened>> opened;
  (void)(*view)->open_record(std::move(request),
                             [&](const Result<ioci::Opened>& r) { opened.emplace(r); });
  host.until(**view, [&] { return opened.has_value(); });
  if (!opened->ok()) return fail(opened->error());
  return render(host, **view, **opened, options);
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
    options.has_size = true;
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
  viewer::StartTimes times;
  times.reached("main entered");
  Options options;
  Words words;
  ::signal(SIGXFSZ, SIG_IGN);  // a file that grows too large is an error of whoever writes it
  CLI::App cli("The desktop of ROBOMOSP; with --render it draws a picture without a window.",
               "robomosp-desktop");
  cli.set_version_flag("--version", "robomosp-desktop " RMP_SDK_VERSION);
  cli.add_option("what", options.what,
                 "native files, names of the library, or a Lua script (default: the start page, "
                 "and pa10_circle with --render)");
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
  cli.add_option("--tour", options.tour,
                 "photograph every room into this folder, dark and light, and end")
      ->type_name("FOLDER");
  cli.add_option("--tour-pictures", options.tour_pictures,
                 "with --tour: only these, such as motion-dark,small-dark-150")
      ->needs("--tour")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->type_name("NAMES");
  cli.add_flag("--start-times", options.start_times,
               "print the times of the steps of the start once the window is usable, and end");
  cli.add_flag("--software-view", options.software_view,
               "draw through EGL even where the window could use OpenGL");
  cli.add_option("--plugin-path", options.plugin_path, "folders searched for plugins first");
  cli.add_flag("--safe", options.safe,
               "start without the settings and layouts of the user, without plugins that are not "
               "part of the program, and with software OpenGL")
      ->excludes("--plugin-path");
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
  cli.add_option("--zoom", words.zoom, "0.01..100; 1 fits everything but floors into the picture")
      ->type_name("FACTOR");
  cli.add_flag("--orthographic", options.orthographic, "parallel projection");
  cli.add_option("--style", options.style, "smooth, flat, wireframe or hidden_line")
      ->check(CLI::IsMember(std::vector<std::string>(kStyles.begin(), kStyles.end())));
  cli.add_flag("--no-edges", options.no_edges, "no lines along the edges of bodies");
  cli.add_flag("--no-axes", options.no_axes,
               "with --render: without the axes in the lower left corner");
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
                 "with --render: studio, dark, white, transparent or a colour such as #e8eef4");
  cli.add_option("--quality", options.quality, "with --render: draft, normal or high")
      ->check(CLI::IsMember(std::vector<std::string>(kQualities.begin(), kQualities.end())));
  cli.add_flag("--fast", options.fast, "the same as --quality draft");
  cli.add_option("--library", options.library, "folders of materials, robots and worlds");
  cli.add_flag("--graphics", options.graphics,
               "print what the window draws with: Qt, display, OpenGL, fonts; and end");
  cli.add_flag("--trust", options.trust,
               "run solvers in Lua that come with files, without asking, in this run");
  try {
    cli.parse(arguments(argc, argv));
  } catch (const CLI::ParseError& e) {
    const int status = cli.exit(e);
    return status == 0 ? kOk : kUsage;
  }
  if (const auto read = read_words(cli, words, options); !read.ok()) return fail(read.error());
  return run(std::move(options), times);
}
