// SPDX-License-Identifier: Apache-2.0
// Trajectories as recordings and pictures.
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "ioci/core/commands.h"
#include "ioci/core/watchers.h"
#include "ioci/recording/plot_answer.h"
#include "ioci/trajectory/segments.h"
#include "motion/cartesian_path.h"
#include "spatial/vec.h"

namespace robomosp::ioci {
namespace {

using model::Trajectory;

struct Sampled {
  std::vector<double> times;
  std::vector<PathSample> samples;
};

Result<Sampled> sampled(const CommandContext& ctx, const motion::Path& path, const Map& args) {
  const double step =
      has(args, "step") ? real(args, "step") : content<Trajectory>(ctx, args).sample_time;
  constexpr double kMost = 1e6;
  if (path.duration() / step > kMost)
    return error(
        ErrorCode::invalid_argument,
        "a step of " + text::print(step) + " s makes more than " + text::print(kMost) + " samples",
        "Give a longer step.", "step");
  Sampled out;
  out.times = path.sample_times(step);
  out.samples.resize(out.times.size());
  RMP_TRY(path.sample(out.times, out.samples));
  return out;
}

/// |da/dt| of the tool's origin, by differences of the acceleration within its piece: over four
/// steps side by side, of which one may hold a place where the acceleration jumps or its rate
/// turns round. That one is not what counts.
Result<double> jerk_at(const motion::Path::Piece& piece, double time) {
  constexpr std::size_t kPlaces = 5;
  const double T = piece.segment->duration(), h = 0.25e-4 * T;
  const double t = std::clamp(time - piece.start, 0.0, T);
  // Near an end of the piece all steps are moved inwards.
  const double first = std::clamp(t - 2 * h, 0.0, T - 4 * h);
  std::array<double, kPlaces> at{};
  for (std::size_t i = 0; i < kPlaces; ++i) at[i] = std::min(first + static_cast<double>(i) * h, T);
  std::array<PathSample, kPlaces> s;
  RMP_TRY(piece.segment->sample(at, s));
  std::array<double, kPlaces - 1> sizes{};
  Vec3 sum{};
  for (std::size_t i = 0; i + 1 < kPlaces; ++i) {
    const Vec3 slope = spatial::scale(spatial::sub(s[i + 1].acceleration, s[i].acceleration),
                                      1 / (at[i + 1] - at[i]));
    sum = spatial::add(sum, slope);
    sizes[i] = spatial::norm(slope);
  }
  std::sort(sizes.begin(), sizes.end());
  const double mean = spatial::norm(sum) / (kPlaces - 1);
  // Where all are alike, their mean is the value in the middle.
  if (sizes.back() - sizes.front() <= 0.01 * mean) return mean;
  return sizes[kPlaces - 3];
}

Result<recording::Recording> recording_of(const std::string& name, const motion::Path& path,
                                          const Sampled& s) {
  recording::Recording r;
  r.title = name;
  r.trajectory = name;
  const auto add = [&](const char* column, const char* unit, const char* doc, const auto& value) {
    recording::Column c;
    c.name = column, c.unit = unit, c.doc = doc;
    c.values.reserve(s.times.size());
    for (std::size_t i = 0; i < s.times.size(); ++i) c.values.push_back(value(i));
    r.columns.push_back(std::move(c));
  };
  add("time", "s", "time", [&](std::size_t i) { return s.times[i]; });
  static constexpr const char* kAxes[] = {"x", "y", "z"};
  for (std::size_t k = 0; k < 3; ++k)
    add(kAxes[k], "m", "place of the tool", [&](std::size_t i) { return s.samples[i].pose.p[k]; });
  const auto size_of = [&](const Vec3 PathSample::*what) {
    return [&s, what](std::size_t i) { return spatial::norm(s.samples[i].*what); };
  };
  add("speed", "m/s", "of the tool", size_of(&PathSample::velocity));
  add("acceleration", "m/s^2", "of the tool", size_of(&PathSample::acceleration));
  std::size_t piece = 0;
  std::optional<Error> failed;
  add("jerk", "m/s^3", "of the tool", [&](std::size_t i) {
    const auto pieces = path.pieces();
    while (piece + 1 < pieces.size() && s.times[i] >= pieces[piece + 1].start) ++piece;
    const auto jerk = jerk_at(pieces[piece], s.times[i]);
    if (jerk.ok()) return *jerk;
    if (!failed) failed = jerk.error();
    return std::nan("");
  });
  add("turning", "rad/s", "how fast the tool turns", size_of(&PathSample::angular_velocity));
  add("angular_acceleration", "rad/s^2", "of the tool", size_of(&PathSample::angular_acceleration));
  if (failed) return *std::move(failed);
  return r;
}

Result<Value> record(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const auto path, path_of(ctx, args));
  RMP_TRY_ASSIGN(const Sampled s, sampled(ctx, *path, args));
  RMP_TRY_ASSIGN(auto r, recording_of(ctx.snapshot().find(ref(args, "id"))->name, *path, s));
  return Value(
      Handle{"recording",
             ctx.app.recordings.add(std::make_shared<const recording::Recording>(std::move(r)))});
}

Result<Value> plot(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const auto path, path_of(ctx, args));
  RMP_TRY_ASSIGN(const Sampled s, sampled(ctx, *path, args));
  RMP_TRY_ASSIGN(const recording::Recording r,
                 recording_of(ctx.snapshot().find(ref(args, "id"))->name, *path, s));
  recording::PlotRequest request;
  request.recordings = {&r};
  RMP_TRY_ASSIGN(Value answer, plot_answer(ctx, std::move(request), args,
                                           {"x", "y", "z", "speed", "acceleration", "jerk"}));
  RMP_TRY(watch_drawing(ctx, "trajectory.plot", args));
  return answer;
}

}  // namespace

RMP_COMMANDS(trajectory_plot_commands) {
  const ParamSpec step = above_zero(
      optional("step", "real", "s", "Time between samples; by default that of the trajectory."));
  std::vector<CommandSpec> all;
  all.push_back(
      {.name = "trajectory.record",
       .classic = "",
       .summary = "Samples position, speed, acceleration and jerk over time into a recording.",
       .details = "Columns: time, x, y, z, speed, acceleration, jerk, turning, "
                  "angular_acceleration. The jerk is that within each piece; at a jump of the "
                  "acceleration it is undefined, and the value beside the jump is recorded. The "
                  "commands recording.* make plots and CSV files of it.",
       .example = with_stroke("local r = stroke:record{step = 0.01}\n"
                              "assert(math.abs(r:values{\"speed\"}[50] - 0.1) < 1e-12)"),
       .params = {self("trajectory"), step, watch_field()},
       .returns = {"handle", "", "", {}},
       .effect = Effect::simulates,
       .run = record});
  all.push_back(
      {.name = "trajectory.plot",
       .classic = "",
       .summary =
           "Draws a trajectory: position, speed, acceleration and jerk over time, or its path.",
       .details = "*.svg is written by the program itself, *.png and *.pdf through gnuplot; "
                  "without a file the plot is returned: in characters for the console, or in the "
                  "format set by `as`.",
       .example = with_stroke("stroke:plot{file = \"stroke.svg\"}\n"
                              "stroke:plot{file = \"stroke_path.svg\", kind = \"path\"}\n"
                              "assert(stroke:plot{as = \"svg\"}:find(\"<svg\"))"),
       .params = {self("trajectory"),
                  optional("file", "path", "",
                           "The picture, *.svg, *.png or *.pdf; text if omitted."),
                  choice("kind", {"curves", "path"}, "Over time, or in space with projections."),
                  optional("columns", "list", "",
                           "Columns as in trajectory.record; x, y, z, speed, acceleration and jerk "
                           "over time if omitted."),
                  step,
                  optional("title", "string", "", "Title; by default the name of the trajectory."),
                  between(defaulted("width", "int", "", 900, "Pixels."), 100, 10000),
                  between(optional("height", "int", "",
                                   "Height in pixels; by default as the panels need."),
                          100, 10000),
                  watch_file_field(), plot_answer_field()},
       .returns = {"string", "", "The file, or the plot itself.", {}},
       .effect = Effect::reads,
       .sometimes = Effect::files_write | Effect::processes,
       .run = plot});
  return all;
}

}  // namespace robomosp::ioci
