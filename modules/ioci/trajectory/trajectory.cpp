// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstdint>

#include "ioci/core/commands.h"
#include "ioci/core/counted.h"
#include "ioci/core/record_params.h"
#include "ioci/trajectory/segments.h"
#include "motion/cartesian_path.h"

namespace robomosp::ioci {
namespace {

using model::Trajectory;

Result<Value> create(CommandContext& ctx, const Map& args) {
  Trajectory t;
  const std::string name = text_of(args, "name");
  RMP_TRY(set_fields(t, args));
  RMP_TRY_ASSIGN(t.parametric,
                 read_parameters(ctx.snapshot(), {}, args.find("parameters"), "parameters"));
  const List& segments = *args.find("segments")->as_list();
  for (std::size_t i = 0; i < segments.size(); ++i) {
    RMP_TRY_ASSIGN(auto segment,
                   read_segment(ctx, segments[i], "segments[" + std::to_string(i + 1) + "]"));
    t.segments.push_back(std::move(segment));
  }
  RMP_TRY(check_trajectory(ctx, name, t));
  RMP_TRY_ASSIGN(const auto id, ctx.edit().add(name, std::move(t)));
  return Value(Application::handle(id));
}

Result<Value> set(CommandContext& ctx, const Map& args) {
  return change_trajectory(ctx, args,
                           [&](Trajectory& t) -> Result<void> { return set_fields(t, args); });
}

Result<Value> add_segment(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const auto segment, read_segment(ctx, *args.find("segment"), "segment"));
  return change_trajectory(ctx, args, [&](Trajectory& t) -> Result<void> {
    t.segments.push_back(segment);
    return {};
  });
}

Result<Value> remove_segment(CommandContext& ctx, const Map& args) {
  return change_trajectory(ctx, args, [&](Trajectory& t) -> Result<void> {
    const auto i = integer(args, "index");
    if (i < 1 || i > static_cast<std::int64_t>(t.segments.size()))
      return error(ErrorCode::invalid_argument, "there is no segment " + std::to_string(i),
                   "It has " + std::to_string(t.segments.size()) + ".");
    t.segments.erase(t.segments.begin() + (i - 1));
    return {};
  });
}

Map sample_map(double t, const PathSample& s) {
  Map out = pose_map(s.pose);
  out.set("time", t);
  out.set("velocity", vec_value(s.velocity, "m/s"));
  out.set("angular_velocity", vec_value(s.angular_velocity, "rad/s"));
  out.set("acceleration", vec_value(s.acceleration, "m/s^2"));
  out.set("angular_acceleration", vec_value(s.angular_acceleration, "rad/s^2"));
  return out;
}

Result<Value> sample(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const auto path, path_of(ctx, args));
  const double t = real(args, "t");
  PathSample s;
  RMP_TRY(path->sample(std::span(&t, 1), std::span(&s, 1)));
  return Value(sample_map(t, s));
}

Result<Value> points(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const auto path, path_of(ctx, args));
  const double step =
      has(args, "step") ? real(args, "step") : content<Trajectory>(ctx, args).sample_time;
  constexpr double kMost = 5e6;
  if (path->duration() / step > kMost)
    return error(
        ErrorCode::invalid_argument,
        "a step of " + text::print(step) + " s makes more than " + text::print(kMost) + " points",
        "Give a longer step.", "step");
  const auto times = path->sample_times(step);
  std::vector<PathSample> samples(times.size());
  RMP_TRY(path->sample(times, samples));
  std::vector<double> rows;
  rows.reserve(7 * times.size());
  for (std::size_t i = 0; i < times.size(); ++i) {
    const model::Placement p = model::placement(samples[i].pose);
    rows.insert(rows.end(), {times[i], p.position[0], p.position[1], p.position[2], p.angles[0],
                             p.angles[1], p.angles[2]});
  }
  return Value(NumericArray(std::move(rows), times.size(), 7));
}

Result<Value> duration(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const auto path, path_of(ctx, args));
  return Value(path->duration());
}

Result<Value> length(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const auto path, path_of(ctx, args));
  return Value(path->length());
}

/// What motion::Path::sample_times() gives, without making it: a long trajectory has billions.
class Samples {
 public:
  static Result<Samples> of(const motion::Path& path, double step) {
    const double whole = std::floor(path.duration() / step * (1 + 1e-12));
    constexpr double kMost = 1e15;
    if (!(whole <= kMost))
      return error(ErrorCode::invalid_argument,
                   "a sample time of " + text::print(step) + " s makes more than " +
                       text::print(kMost) + " points of " + text::print_rounded(path.duration()) +
                       " s",
                   "Set a longer sample_time.");
    return Samples(path.duration(), step, static_cast<std::int64_t>(whole));
  }
  [[nodiscard]] std::int64_t count() const { return whole_ + 1 + (has_rest_ ? 1 : 0); }
  [[nodiscard]] double time(std::int64_t i) const {
    return i > whole_ ? end_ : std::min(static_cast<double>(i) * step_, end_);
  }

 private:
  Samples(double end, double step, std::int64_t whole)
      : end_(end), step_(step), whole_(whole), has_rest_(end - time(whole) > 1e-9 * step) {}
  double end_, step_;
  std::int64_t whole_;
  bool has_rest_;
};

Result<Value> parameters(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const auto path, path_of(ctx, args));
  const Trajectory& t = content<Trajectory>(ctx, args);
  RMP_TRY_ASSIGN(const Samples samples, Samples::of(*path, t.sample_time));
  List shapes;
  for (const auto& s : t.segments) shapes.emplace_back(s.shape.name);
  return Value(Map{{"description", t.description},
                   {"duration", path->duration()},
                   {"length", path->length()},
                   {"sample_time", t.sample_time},
                   {"samples", samples.count()},
                   {"shapes", std::move(shapes)},
                   {"parameters", parameters_value(t.parametric)}});
}

Result<Value> point_count(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const auto path, path_of(ctx, args));
  RMP_TRY_ASSIGN(const Samples samples,
                 Samples::of(*path, content<Trajectory>(ctx, args).sample_time));
  return Value(samples.count());
}

Result<Value> point(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const auto path, path_of(ctx, args));
  RMP_TRY_ASSIGN(const Samples samples,
                 Samples::of(*path, content<Trajectory>(ctx, args).sample_time));
  RMP_TRY_ASSIGN(const std::size_t i,
                 counted(args, static_cast<std::size_t>(samples.count()), "point"));
  const double t = samples.time(static_cast<std::int64_t>(i));
  PathSample s;
  RMP_TRY(path->sample(std::span(&t, 1), std::span(&s, 1)));
  return Value(sample_map(t, s));
}

}  // namespace

RMP_COMMANDS(trajectory_commands) {
  std::vector<CommandSpec> all;
  const auto with_fields = [](Schema params) {
    for (ParamSpec& p :
         led_by({"sample_time"}, without(record_params("trajectory", ""), {"segments", "along"})))
      params.push_back(std::move(p));
    return params;
  };
  Schema create_params =
      with_fields({needed("name", "string", "", "Name, unique among trajectories."),
                   needed("segments", "list", "", "Its segments.")});
  create_params.push_back(parameters_field());
  all.push_back({.name = "trajectory.create",
                 .classic = "",
                 .summary = "Makes a trajectory from segments, one after the other.",
                 .details = std::string(kSegmentDoc) +
                            " If a segment does not begin at the end of the one "
                            "before, a smooth transition is inserted.",
                 .example = with_stroke("assert(math.abs(stroke:length() - 0.2) < 1e-12)"),
                 .params = std::move(create_params),
                 .returns = {"handle", "", "", {}},
                 .effect = Effect::edits,
                 .run = create});
  all.push_back(
      {.name = "trajectory.set",
       .classic = "",
       .summary = "Changes the given properties of a trajectory.",
       .details = "",
       .example = with_stroke(
           "stroke:set{sample_time = \"5 ms\"}\nassert(stroke:describe().sample_time == 0.005)"),
       .params = with_fields({self("trajectory")}),
       .returns = {},
       .effect = Effect::edits,
       .run = set});
  all.push_back(
      {.name = "trajectory.add_segment",
       .classic = "",
       .summary = "Adds a segment at the end.",
       .details = kSegmentDoc,
       .example = with_stroke(
           "stroke:add_segment({shape = \"line\", points = {{0.5, 0.2, 0.3, 0, 0, 0}, {0.5, 0.2, "
           "0.4, 0, 0, 0}}, transition = \"none\"})\nassert(math.abs(stroke:length() - 0.3) < "
           "1e-12)"),
       .params = {self("trajectory"), needed("segment", "map", "", "The segment.")},
       .returns = {},
       .effect = Effect::edits,
       .run = add_segment});
  all.push_back(
      {.name = "trajectory.remove_segment",
       .classic = "",
       .summary = "Removes a segment.",
       .details = "Its neighbours then follow each other, with the transition of the second one.",
       .example = with_stroke("stroke:remove_segment(1)\nassert(#stroke:describe().segments == 0)"),
       .params = {self("trajectory"), needed("index", "int", "", "Its number, 1 is the first.")},
       .returns = {},
       .effect = Effect::edits,
       .run = remove_segment});
  const std::vector<ParamSpec> sample_fields{
      field("time", "real", "s", "Time."),
      field("pose", "pose", "", "4x4 homogeneous matrix."),
      field("position", "vec3", "m", "Position."),
      field("rpy", "vec3", "rad", "Roll, pitch, yaw."),
      field("quaternion", "real[]", "", "w, x, y, z."),
      field("velocity", "vec3", "m/s", "Velocity of the tool's origin."),
      field("angular_velocity", "vec3", "rad/s", "Angular velocity."),
      field("acceleration", "vec3", "m/s^2", "Velocity of the tool's origin."),
      field("angular_acceleration", "vec3", "rad/s^2", "Angular acceleration.")};
  all.push_back(
      {.name = "trajectory.sample",
       .classic = "",
       .summary = "Returns pose, velocity and acceleration at a time.",
       .details = "Times outside the trajectory are clamped to its ends.",
       .example = with_stroke("assert(stroke:sample(stroke:duration()).position[2] == 0.2)"),
       .params = {self("trajectory"), needed("t", "real", "s", "Time from the start.")},
       .returns = {"map", "", "", sample_fields},
       .effect = Effect::reads,
       .run = sample});
  all.push_back(
      {.name = "trajectory.points",
       .classic = "",
       .summary = "Returns time, position and angles of the tool along the whole trajectory.",
       .details = "At 0, step, 2 step and so on, and at the very end.",
       .example =
           with_stroke("local p = stroke:points()\nassert(p[1][1] == 0 and p[#p][3] == 0.2)"),
       .params = {self("trajectory"),
                  above_zero(optional("step", "real", "s",
                                      "Time between samples; by default that of the trajectory."))},
       .returns = {"matrix", "", "Columns: time [s], x, y, z [m], roll, pitch, yaw [rad].", {}},
       .effect = Effect::reads,
       .run = points});
  all.push_back({.name = "trajectory.duration",
                 .classic = "",
                 .summary = "Returns the duration of a trajectory.",
                 .details = "",
                 .example = with_stroke("assert(stroke:duration() > 0)"),
                 .params = {self("trajectory")},
                 .returns = {"real", "s", "", {}},
                 .effect = Effect::reads,
                 .run = duration});
  all.push_back({.name = "trajectory.length",
                 .classic = "",
                 .summary = "Returns the length of the tool's path.",
                 .details = "",
                 .example = with_stroke("assert(math.abs(stroke:length() - 0.2) < 1e-12)"),
                 .params = {self("trajectory")},
                 .returns = {"real", "m", "", {}},
                 .effect = Effect::reads,
                 .run = length});
  all.push_back({.name = "trajectory.parameters",
                 .classic = "PTrajectory GetParameters",
                 .summary = "Returns duration, length, sampling and shapes of a trajectory.",
                 .details = "",
                 .example = with_stroke("assert(stroke:parameters().shapes[1] == \"line\")"),
                 .params = {self("trajectory")},
                 .returns = {"map",
                             "",
                             "",
                             {field("description", "string", "", "Its description."),
                              field("duration", "real", "s", "Time."),
                              field("length", "real", "m", "Length of the tool's path."),
                              field("sample_time", "real", "s", "Time between samples."),
                              field("samples", "int", "", "Number of samples."),
                              field("shapes", "list", "", "Shape of each segment."),
                              field("parameters", "map", "",
                                    "Its named parameters, as in robot.parameters.")}},
                 .effect = Effect::reads,
                 .run = parameters});
  all.push_back({.name = "trajectory.point_count",
                 .classic = "PTrajectory GetNumGenPoints",
                 .summary = "Counts the samples of a trajectory at its own sample time.",
                 .details = "",
                 .example = with_stroke("assert(stroke:point_count() > 2)"),
                 .params = {self("trajectory")},
                 .returns = {"int", "", "", {}},
                 .effect = Effect::reads,
                 .run = point_count});
  all.push_back(
      {.name = "trajectory.point",
       .classic = "PTrajectory GetGenPoint(index, first=1)",
       .summary = "Returns one sample of a trajectory by its number.",
       .details = "Numbers count from 0, or from first.",
       .example = with_stroke("assert(stroke:point(0).time == 0)"),
       .params = {self("trajectory"), needed("index", "int", "", "Its number."), first_field()},
       .returns = {"map", "", "", sample_fields},
       .effect = Effect::reads,
       .run = point});
  return all;
}

}  // namespace robomosp::ioci
