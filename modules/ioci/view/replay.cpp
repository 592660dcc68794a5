// SPDX-License-Identifier: Apache-2.0
// Recordings that are looked at: as a page with scene, timeline and plots, as frames and a video.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <system_error>

#include "io/native.h"
#include "ioci/core/commands.h"
#include "ioci/core/loaded.h"
#include "ioci/core/watchers.h"
#include "ioci/core/word_list.h"
#include "ioci/view/lone_robot.h"
#include "ioci/view/picture.h"
#include "kernel/base64.h"
#include "kernel/file_root.h"
#include "scene/build.h"
#include "scene/gif.h"
#include "scene/mp4.h"
#include "scene/replay.h"

namespace robomosp::ioci {
namespace {

namespace fs = std::filesystem;

constexpr double kMostGifRate = 50;      ///< browsers show faster ones slower [Hz]
constexpr std::size_t kTriedFrames = 8;  ///< that a GIF takes its colours from
constexpr double kMostFrames = 999'999;  ///< six digits in the names of their files

/// A recording with the scene of its world and how that moves.
struct Show {
  std::optional<LoneRobot> alone;
  AnyId what;  ///< the world, or the robot alone
  recording::RecordingPtr recording;
  scene::Built built;
  scene::Playback playback;
};

Result<Show> show_of(CommandContext& ctx, const Map& args) {
  Show show;
  show.recording = ctx.recording(*args.find("id")->as_handle());
  const recording::Recording& r = *show.recording;
  if (r.columns.empty() || r.columns.front().name != "time")
    return error(ErrorCode::invalid_argument,
                 "the recording " + text::quote(r.title) + " is not a motion over time",
                 "Give a recording of a simulation.", "id");
  AnyId world = r.world;
  if (has(args, "world")) {
    world = ref(args, "world");
  } else if (const auto robot = robot_of(ctx.snapshot(), r)) {
    RMP_TRY_ASSIGN(LoneRobot made, LoneRobot::make(ctx, *robot, r));
    show.alone.emplace(std::move(made));
    show.what = AnyId(*robot);
    world = AnyId(show.alone->world());
  }
  if (!show.alone) show.what = world;
  const document::Snapshot& snapshot = show.alone ? show.alone->snapshot() : ctx.snapshot();
  if (!snapshot.find(world))
    return error(ErrorCode::not_found,
                 "the recording " + text::quote(r.title) +
                     (r.world.number == 0 && !r.robot.empty()
                          ? " is of a robot " + text::quote(r.robot) + ", which no longer exists"
                          : " does not belong to an open world"),
                 "Give the world of the robot it moves.", "world");
  const scene::Source source{snapshot, ctx.app.derived, ctx.app.registry};
  RMP_TRY_ASSIGN(show.playback,
                 scene::build_playback(source, WorldId{world.number}, r, ctx.progress));
  RMP_TRY(scene::check(show.playback).in("recording " + text::quote(r.title)));
  scene::Extras extras;
  extras.paths = read_paths(args);
  RMP_TRY_ASSIGN(show.built, scene::build(source, world, extras, ctx.progress));
  return show;
}

/// Tells what could not be built, and gives it back as the field left_out.
Value report_left_out(CommandContext& ctx, const scene::Built& built) {
  List out;
  for (const std::string& sentence : built.left_out) {
    ctx.app.messages.post(Severity::warning, "left_out", sentence, "replay");
    out.emplace_back(sentence);
  }
  return Value(std::move(out));
}

/// The columns to be plotted; joint values and torques where none are named.
Result<std::vector<const recording::Column*>> plotted(const recording::Recording& r,
                                                      const Map& args) {
  RMP_TRY_ASSIGN(std::vector<std::string> names, word_list(args, "columns"));
  const Value* given = args.find("columns");
  if (!given || given->is_nil())
    for (const char* name : {"q", "tau"})
      if (r.find(std::string(name) + "1")) names.emplace_back(name);
  if (names.empty()) return std::vector<const recording::Column*>{};
  return r.select(names);
}

Result<Value> replay(CommandContext& ctx, const Map& args) {
  const std::string file = text_of(args, "file");
  RMP_TRY(check_new_file(file, ".html", "A replay is a page; give a name such as run.html."));
  scene::ReplayRequest request;
  RMP_TRY_ASSIGN(request.camera, read_camera(args));
  request.frame_rate = real(args, "fps");
  RMP_TRY_ASSIGN(const Show show, show_of(ctx, args));
  request.title = has(args, "title") ? text_of(args, "title") : show.recording->title;
  RMP_TRY_ASSIGN(request.columns, plotted(*show.recording, args));
  RMP_TRY_ASSIGN(const auto data,
                 scene::replay_data(show.built.scene, show.playback, request, ctx.progress));
  const std::string page =
      scene::replay_page(data, request.title, ctx.app.watchers->draws(file) || flag(args, "watch"));
  RMP_TRY(write_named_file(ctx, file, page));
  RMP_TRY(watch_drawing(ctx, "recording.replay", args));
  return Value(Map{{"file", file},
                   {"bytes", page.size()},
                   {"duration", scene::duration(show.playback)},
                   {"frames", data.frames},
                   {"left_out", report_left_out(ctx, show.built)}});
}

/// The same for a page that draws it itself.
Result<Value> replay_data_of(CommandContext& ctx, const Map& args) {
  scene::ReplayRequest request;
  RMP_TRY_ASSIGN(request.camera, read_camera(args));
  request.frame_rate = real(args, "fps");
  RMP_TRY_ASSIGN(const Show show, show_of(ctx, args));
  request.title = show.recording->title;
  RMP_TRY_ASSIGN(request.columns, plotted(*show.recording, args));
  RMP_TRY_ASSIGN(scene::ReplayData data,
                 scene::replay_data(show.built.scene, show.playback, request, ctx.progress));
  std::string bytes;
  base64::append(bytes, data.bytes);
  List left_out;
  for (const std::string& sentence : show.built.left_out) left_out.emplace_back(sentence);
  return Value(Map{{"header", std::move(data.header)},
                   {"bytes", std::move(bytes)},
                   {"duration", scene::duration(show.playback)},
                   {"frames", data.frames},
                   {"left_out", std::move(left_out)}});
}

/// The user's folder for frames.
class FrameFolder {
 public:
  Result<void> keep(const std::string& folder) {
    path_ = folder;
    const FileKind above =
        path_.has_parent_path() ? file_kind(path_.parent_path()) : FileKind::folder;
    if (file_kind(path_) == FileKind::none && above == FileKind::folder)
      if (const auto made = make_folders(path_);
          !made.ok() && made.error().code == ErrorCode::permission)
        return made.error();
    if (file_kind(path_) == FileKind::folder) return {};
    return error(ErrorCode::io, "cannot make the folder " + text::quote(folder) + " for frames",
                 "Create the folder it lies in, or choose another one.", "frames");
  }
  /// Of frame 1, 2 and so on.
  [[nodiscard]] fs::path frame(std::size_t number) const {
    std::array<char, 32> name{};
    std::snprintf(name.data(), name.size(), "frame_%06zu.png", number);
    return path_ / name.data();
  }
  /// Frames of a longer run before are not taken for this run's.
  void remove_after(std::size_t count) const {
    for (std::size_t i = count + 1;; ++i)
      if (const auto removed = remove_file(frame(i)); !removed.ok() || !*removed) return;
  }

 private:
  fs::path path_;
};

/// Progress of one part of longer work: `from`..`to` of the whole.
class Part final : public Progress {
 public:
  Part(Progress& whole, double from, double to) : whole_(whole), from_(from), to_(to) {}
  void report(double fraction, std::string_view what) override {
    whole_.report(from_ + fraction * (to_ - from_), what);
  }
  [[nodiscard]] bool cancelled() const override { return whole_.cancelled(); }

 private:
  Progress& whole_;
  double from_, to_;
};

/// The times of the frames of a video.
struct FrameTimes {
  double from = 0, step = 0;
  std::size_t count = 0;
};

Result<FrameTimes> frame_times(const scene::Playback& playback, const Map& args, double fps) {
  const double start = playback.times.front(), end = playback.times.back();
  FrameTimes t;
  t.from = has(args, "from") ? real(args, "from") : start;
  const double to = has(args, "to") ? real(args, "to") : end;
  if (t.from < start || to > end || !(t.from < to))
    return error(ErrorCode::invalid_argument,
                 "from " + text::print_rounded(t.from) + " s to " + text::print_rounded(to) +
                     " s is not within the recording, " + text::print_rounded(start) + " s to " +
                     text::print_rounded(end) + " s",
                 "Give times within it, with from before to.", has(args, "from") ? "from" : "to");
  t.step = real(args, "speed") / fps;
  const double count = std::floor((to - t.from) / t.step + 1e-6) + 1;
  if (count > kMostFrames)
    return error(ErrorCode::invalid_argument,
                 "the video would have " + text::print_rounded(count, 3) + " frames",
                 "Give a lower fps or a higher speed.", "fps");
  t.count = static_cast<std::size_t>(count);
  return t;
}

Result<Value> video(CommandContext& ctx, const Map& args) {
  const bool has_file = has(args, "file"), has_frames = has(args, "frames");
  if (!has_file && !has_frames)
    return error(ErrorCode::invalid_argument, "neither a file nor a folder for frames is given",
                 "Give file, an .mp4 or .gif, or frames, a folder for PNG files, or both.", "file");
  const std::string file = has_file ? text_of(args, "file") : "";
  const bool is_gif = fs::path(file).extension() == ".gif";
  if (is_gif) {
    RMP_TRY(check_new_file(file, ".gif", ""));
    if (real(args, "fps") > kMostGifRate)
      return error(ErrorCode::invalid_argument,
                   "a GIF shows at most 50 pictures a second; viewers slow down faster ones",
                   "Give an fps of 50 or less, or an .mp4.", "fps");
  } else if (has_file) {
    RMP_TRY(check_new_file(file, ".mp4", "Films are written as .mp4 or .gif."));
  }
  RMP_TRY_ASSIGN(render::Options options, read_picture(args));
  if (options.look.background == render::Background::transparent && has_file)
    return error(ErrorCode::invalid_argument, "a video has no transparent background",
                 "Give frames instead of file, or another background.", "background");
  const double fps = real(args, "fps");
  RMP_TRY_ASSIGN(Show show, show_of(ctx, args));
  RMP_TRY_ASSIGN(const FrameTimes times, frame_times(show.playback, args, fps));
  RMP_TRY(apply_visibility(ctx, args, show.what, show.built));
  RMP_TRY_ASSIGN(options.look.section, read_section(ctx, args, show.built.scene));
  RMP_TRY_ASSIGN(const auto drawer, renderer(ctx.app));
  FrameFolder frames;
  if (has_frames) RMP_TRY(frames.keep(text_of(args, "frames")));
  std::optional<scene::Mp4Writer> mp4;
  if (has_file && !is_gif) {
    RMP_TRY_ASSIGN(scene::Mp4Writer made,
                   scene::Mp4Writer::create(static_cast<std::size_t>(options.width),
                                            static_cast<std::size_t>(options.height), fps));
    mp4.emplace(std::move(made));
  }

  // The colours of a GIF are chosen before its first frame, from some of all.
  const std::size_t tried = is_gif ? std::min(times.count, kTriedFrames) : 0;
  const auto at = [&](std::size_t i) {
    return static_cast<double>(i) / static_cast<double>(times.count + tried);
  };
  std::size_t drawn = 0;
  const auto draw = [&](std::size_t frame) -> Result<render::Image> {
    if (ctx.progress.cancelled())
      return error(ErrorCode::cancelled, "the video was cancelled", "Draw it again.");
    scene::pose_at(show.built.scene, show.playback,
                   times.from + static_cast<double>(frame) * times.step);
    Part part(ctx.progress, at(drawn), at(drawn + 1));
    ++drawn;
    return draw_image(*drawer, show.built.scene, options, part);
  };
  std::optional<scene::GifWriter> gif;
  if (is_gif) {
    scene::GifPalette palette;
    for (std::size_t i = 0; i < tried; ++i) {
      RMP_TRY_ASSIGN(const render::Image image,
                     draw(tried < 2 ? 0 : i * (times.count - 1) / (tried - 1)));
      palette.add(image.rgba);
    }
    gif.emplace(static_cast<std::size_t>(options.width), static_cast<std::size_t>(options.height),
                palette.colours(255));
  }
  for (std::size_t i = 0; i < times.count; ++i) {
    RMP_TRY_ASSIGN(const render::Image image, draw(i));
    if (gif) gif->add(image.rgba, static_cast<double>(i + 1) / fps);
    if (mp4) RMP_TRY(mp4->add(image.rgba));
    if (!has_frames) continue;
    const auto png = guarded("renderer", [&] { return drawer->png(image); });
    if (!png.ok()) return png.error();
    RMP_TRY(io::write_file(frames.frame(i + 1), *png));
  }
  if (has_frames) frames.remove_after(times.count);
  Map out;
  if (gif) {
    RMP_TRY(write_named_file(ctx, file, gif->finish()));
    out.set("file", file);
  } else if (mp4) {
    RMP_TRY_ASSIGN(const std::string bytes, mp4->finish());
    RMP_TRY(write_named_file(ctx, file, bytes));
    out.set("file", file);
  }
  if (has_frames) out.set("folder", text_of(args, "frames"));
  out.set("frames", times.count);
  out.set("duration", static_cast<double>(times.count) / fps);
  out.set("left_out", report_left_out(ctx, show.built));
  return Value(std::move(out));
}

ParamSpec world_field() {
  return optional("world", "ref:world", "",
                  "The world to show; by default that of the recording, or for a robot without a "
                  "world the robot alone.");
}

std::string with_run(const char* rest) {
  return with_arm(
             "local cell = world.create{name = \"cell\"}\ncell:add_robot{robot = arm, q = "
             "\"ready\"}\nlocal run = cell:simulate_dynamics{robot = \"arm\", duration = 0.1}\n") +
         rest;
}

CommandSpec replay_command() {
  CommandSpec c;
  c.name = "recording.replay";
  c.summary = "Writes a recording as one HTML page: an animated scene, a timeline and plots.";
  c.details =
      "The page opens in any browser with WebGL 2, loads nothing and needs no network. It shows "
      "the world at any time between the samples, the path of every tool, and the chosen columns "
      "with a cursor. Poses are stored to 1/65536 of the scene's size and 0.02 mrad.";
  c.example = with_run(
      "local done = run:replay{file = \"run.html\", columns = {\"q\"}}\n"
      "assert(done.frames == 4 and done.bytes < 5e6)");
  c.params = {self("recording"),
              needed("file", "path", "", "The page, *.html."),
              optional("columns", "any", "",
                       "Columns to plot: a name or a list of names; {} plots none. Joint values "
                       "and torques if omitted."),
              optional("title", "string", "", "Title; by default that of the recording."),
              between(defaulted("fps", "real", "Hz", 30.0,
                                "Poses stored per second, if the recording has as many."),
                      0.01, 1000),
              world_field()};
  for (ParamSpec& p : camera_params()) c.params.push_back(std::move(p));
  c.params.push_back(watch_file_field());
  c.returns = {
      "map",
      "",
      "",
      {field("file", "string", "", "The page."), field("bytes", "int", "", "Size of the page."),
       field("duration", "real", "s", "Duration of the playback."),
       field("frames", "int", "", "Poses stored for every body."),
       field("left_out", "list", "", "Sentences about items that could not be shown.")}};
  c.effect = Effect::files_write;
  c.run = replay;
  return c;
}

/// `replay` gives what is in the page instead of writing it.
CommandSpec replay_data_command() {
  CommandSpec c = replay_command();
  c.name = "recording.replay_data";
  c.summary = "Returns a recording to a program that draws it: the scene, its motion and columns.";
  c.details =
      "No file is written. Header and bytes are those of the page that recording.replay writes, in "
      "the format of modules/scene/replay.h, for the scripts in modules/scene/replay.";
  c.example = with_run(
      "local data = run:replay_data{columns = {\"q\"}}\n"
      "assert(data.frames == 4 and #data.bytes > 1000)");
  std::erase_if(c.params, [](const ParamSpec& p) {
    return p.name == "file" || p.name == "title" || p.name == "watch";
  });
  c.returns = {"map",
               "",
               "",
               {field("header", "string", "", "JSON: the contents, in the order of the bytes."),
                field("bytes", "string", "", "The numbers as base64 (RFC 4648)."),
                field("duration", "real", "s", "Duration of the playback."),
                field("frames", "int", "", "Poses stored for every body."),
                field("left_out", "list", "", "Sentences about items that could not be shown.")}};
  c.effect = Effect::reads;
  c.run = replay_data_of;
  return c;
}

CommandSpec video_command() {
  CommandSpec c;
  c.name = "recording.video";
  c.summary = "Films a recording: an animated GIF, an MP4 video, or frames as PNG files.";
  c.details =
      "All frames are drawn by one renderer without a window. A GIF has 255 colours; an MP4 has "
      "all colours, is a tenth as large and plays in every browser (H.264, by the library "
      "OpenH264). The frames are kept if a folder is named for them. draft is quick, normal and "
      "high take up to seconds per frame. A recording of a robot without a world shows that robot.";
  c.example = with_run(
      "local done = run:video{file = \"run.gif\", fps = 20, size = {96, 64}}\n"
      "assert(done.frames == 3)\n"
      "run:video{file = \"run.mp4\", fps = 20, size = {96, 64}}");
  c.params = {self("recording"),
              optional("file", "path", "", "The film: *.mp4 or *.gif."),
              optional("frames", "path", "",
                       "Folder in which the frames are kept, frame_000001.png and so on."),
              between(defaulted("fps", "real", "Hz", 25.0, "Frames per second."), 0.1, 240),
              between(defaulted("speed", "real", "", 1.0, "Speed: 2 plays it in half the time."),
                      1e-3, 1e3),
              optional("from", "real", "s", "Time of the first frame; the start if omitted."),
              optional("to", "real", "s", "Time of the last frame; the end if omitted."),
              world_field()};
  for (ParamSpec& p :
       picture_params({.has_mass = false, .has_frames = false, .has_parts = false})) {
    // Thousands of pictures: quick ones unless told otherwise.
    if (p.name == "quality") {
      p.choices = {"draft", "normal", "high"};
      p.default_value = Value("draft");
    }
    c.params.push_back(std::move(p));
  }
  c.params.push_back(paths_param());
  c.params.push_back(without_param());
  c.params.push_back(fade_param());
  c.returns = {"map",
               "",
               "",
               {field("file", "string", "", "The video, if requested."),
                field("folder", "string", "", "The folder of the frames, if they were kept."),
                field("frames", "int", "", "Number of frames."),
                field("duration", "real", "s", "Duration of the video."),
                field("left_out", "list", "", "Sentences about items that could not be drawn.")}};
  c.effect = Effect::files_write;
  c.run = video;
  return c;
}

}  // namespace

RMP_COMMANDS(replay_commands) {
  std::vector<CommandSpec> all;
  all.push_back(replay_command());
  all.push_back(replay_data_command());
  all.push_back(video_command());
  return all;
}

}  // namespace robomosp::ioci
