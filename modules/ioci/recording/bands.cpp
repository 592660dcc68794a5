// SPDX-License-Identifier: Apache-2.0
// Bands of a recording for timelines: segments, use of the limits, clearance, faults, remarks,
// grips and signals as intervals of time.
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <set>

#include "ioci/core/commands.h"
#include "ioci/core/origins.h"
#include "ioci/recording/recording_argument.h"
#include "motion/cartesian_path.h"
#include "recording/limit_share.h"
#include "sim/recording_columns.h"

namespace robomosp::ioci {
namespace {

/// A share above 1 by no more than this is rounding, not a fault.
constexpr double kAtLimit = 1 + 1e-6;
/// Most intervals of one band; a signal that changes more often is a curve.
constexpr std::size_t kMostSpans = 2000;

enum class Level : std::uint8_t { ok, warn, fault };
constexpr const char* kLevelWords[] = {"ok", "warn", "fault"};

struct Span {
  double from = 0, to = 0;  ///< [s]
  std::string level;
  std::string text;
  Map more{};  ///< further fields
};

struct Band {
  std::string name, label;
  std::string unknown{};  ///< why it could not be looked at; "" = it was
  std::string note{};     ///< what was not looked at of it
  std::vector<Span> spans{};
};

/// Where the interval of a row begins: in the middle between it and the row before.
double begin_of(const std::vector<double>& time, std::size_t i) {
  return i == 0 ? time[0] : (time[i - 1] + time[i]) / 2;
}
double end_of(const std::vector<double>& time, std::size_t i) {
  return i + 1 == time.size() ? time[i] : (time[i] + time[i + 1]) / 2;
}

/// Consecutive rows of one level that is not ok as spans; `text` describes the worst row of each.
void add_levels(Band& band, const std::vector<double>& time,
                const std::function<std::pair<Level, double>(std::size_t)>& of_row,
                const std::function<Span(std::size_t worst)>& describe) {
  for (std::size_t i = 0; i < time.size();) {
    const auto [level, badness] = of_row(i);
    std::size_t end = i + 1, worst = i;
    double most = badness;
    for (; end < time.size(); ++end) {
      const auto [next, bad] = of_row(end);
      if (next != level) break;
      if (bad > most) {
        most = bad;
        worst = end;
      }
    }
    if (level != Level::ok && band.spans.size() < kMostSpans) {
      Span span = describe(worst);
      span.from = begin_of(time, i);
      span.to = end_of(time, end - 1);
      span.level = kLevelWords[static_cast<std::size_t>(level)];
      span.more.set("at", time[worst]);
      band.spans.push_back(std::move(span));
    } else if (level != Level::ok) {
      band.note = "only the first " + std::to_string(kMostSpans) + " intervals are listed";
      return;
    }
    i = end;
  }
}

/// The records that a recording was made from, as they were then.
class RecordsThen {
 public:
  RecordsThen(CommandContext& ctx, std::uint64_t number)
      : ctx_(ctx), origin_(ctx.app.origins->find(number)) {}
  [[nodiscard]] const model::Record* find(AnyId id) const {
    if (origin_)
      for (const auto& [known, record] : origin_->inputs.records)
        if (known == id) return record.get();
    return ctx_.snapshot().find(id);
  }
  [[nodiscard]] const model::World* world(const recording::Recording& r) const {
    const model::Record* record = find(AnyId(r.world));
    return record ? std::get_if<model::World>(&record->body) : nullptr;
  }

 private:
  CommandContext& ctx_;
  OriginPtr origin_;
};

std::string text_of_segment(const RecordsThen& then, const model::TrajectorySegment& s) {
  if (s.stored) {
    const model::Record* stored = then.find(AnyId(s.stored));
    return stored ? stored->name : std::string("stored trajectory");
  }
  return s.shape.name + (s.law.name.empty() ? "" : " · " + s.law.name);
}

Band segments_of(CommandContext& ctx, const RecordsThen& then, const recording::Recording& r,
                 const std::vector<double>& time) {
  Band band{"segments", "Segments"};
  const model::World* world = then.world(r);
  const model::PlacedTrajectory* placed = nullptr;
  if (world)
    for (const model::PlacedTrajectory& t : world->trajectories)
      if (t.name == r.trajectory) placed = &t;
  const model::Record* record = placed ? then.find(AnyId(placed->trajectory)) : nullptr;
  if (!record) {
    band.unknown = r.trajectory.empty() ? "the recording follows no trajectory"
                                        : "its trajectory is no longer known";
    return band;
  }
  const auto& trajectory = std::get<model::Trajectory>(record->body);
  const auto path = motion::Path::build(ctx.app.registry, record->name, trajectory,
                                        [&](TrajectoryId id) { return then.find(AnyId(id)); });
  if (!path.ok()) {
    band.unknown = path.error().code == ErrorCode::unsupported
                       ? "times of segments that move joints are not recorded"
                       : path.error().message;
    return band;
  }
  // An approach comes before the trajectory.
  double start = time.front();
  if (const recording::Column* approach = r.find(recording::kApproachColumn))
    for (std::size_t i = 0; i < time.size(); ++i)
      if (approach->values[i] != 0) start = time[i];
  const double duration = (*path)->duration();
  const double step =
      time.size() > 1 ? (time.back() - time.front()) / static_cast<double>(time.size() - 1) : 0;
  if (std::fabs(time.back() - start - duration) > 2 * step + 1e-6 * duration) {
    band.unknown = "the run has its own timing, not that of the trajectory";
    return band;
  }
  if (start > time.front()) band.spans.push_back({time.front(), start, "approach", "approach", {}});
  const auto pieces = (*path)->pieces();
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    const motion::Path::Piece& piece = pieces[i];
    const std::string number = std::to_string(piece.number);
    Span span{start + piece.start,
              start + piece.start + piece.segment->duration(),
              piece.is_transition ? "transition" : "segment",
              piece.is_transition
                  ? "transition to " + number
                  : number + " " + text_of_segment(then, trajectory.segments[piece.number - 1]),
              {}};
    span.more.set("number", piece.number);
    if (ctx.snapshot().find(AnyId(placed->trajectory))) {
      span.more.set("record", Application::handle(AnyId(placed->trajectory)));
      span.more.set("path", "segments." + number);
    }
    // Pieces of one stored trajectory are one segment.
    if (!band.spans.empty() && !piece.is_transition && band.spans.back().level == "segment" &&
        band.spans.back().text == span.text)
      band.spans.back().to = span.to;
    else band.spans.push_back(std::move(span));
    if (band.spans.size() >= kMostSpans) {
      band.note = "only the first " + std::to_string(kMostSpans) + " segments are listed";
      break;
    }
  }
  return band;
}

/// A joint quantity with limits: "arm.qd3" is the velocity of joint 3 of arm.
struct LimitKind {
  const char* name;
  const char* label;
  const char* stem;
  const char* word;
};
constexpr std::array kLimitKinds{LimitKind{"position", "Joint position", "q", "position"},
                                 LimitKind{"speed", "Joint speed", "qd", "speed"},
                                 LimitKind{"torque", "Torque", "tau", "torque"}};

bool is_of(const std::string& column, std::string_view stem) {
  const std::size_t dot = column.rfind('.');
  const std::string_view own =
      std::string_view(column).substr(dot == std::string::npos ? 0 : dot + 1);
  return own.size() > stem.size() && own.starts_with(stem) &&
         own.find_first_not_of("0123456789", stem.size()) == std::string_view::npos;
}

/// The limits of the columns of a recording: those recorded with them, else those that its robot
/// has now.
struct Limits {
  recording::Recording columns;  ///< without values
  std::string unknown{};         ///< why the robot could not be asked; "" = it was
};

Limits limits_of(CommandContext& ctx, const recording::Recording& r) {
  Limits out;
  for (const recording::Column& c : r.columns)
    out.columns.columns.push_back({c.name, c.unit, "", {}, c.lower, c.upper});
  if (r.robot.empty()) {
    out.unknown = "the recording names no robot";
    return out;
  }
  RobotId id;
  Vec3 gravity{0, 0, -9.81};
  if (const model::World* world = ctx.snapshot().get(r.world)) {
    gravity = world->gravity;
    for (const model::PlacedRobot& robot : world->robots)
      if (robot.name == r.robot) id = robot.robot;
  } else if (r.world.number == 0) {
    if (const auto found = ctx.snapshot().find(Kind::robot, r.robot)) id = RobotId{found->number};
  }
  if (id.number == 0) {
    out.unknown = "robot " + text::quote(r.robot) + " does not exist any more";
    return out;
  }
  const auto m = ctx.app.derived.robot_model(ctx.snapshot(), id, gravity, ctx.progress);
  if (!m.ok()) {
    out.unknown = m.error().message;
    return out;
  }
  recording::Recording now = out.columns;
  sim::mark_limits(now, **m);
  for (std::size_t i = 0; i < now.columns.size(); ++i)
    if (recording::Column& c = out.columns.columns[i];
        !std::isfinite(c.lower) && !std::isfinite(c.upper))
      c = std::move(now.columns[i]);
  return out;
}

Band use_of(const recording::Recording& r, const Limits& limits, const std::vector<double>& time,
            const LimitKind& kind, double warn) {
  Band band{kind.name, kind.label};
  struct Limited {
    const recording::Column* column;
    double lower, upper;
  };
  std::vector<Limited> limited;
  std::vector<std::string> without;
  for (std::size_t i = 0; i < r.columns.size(); ++i) {
    if (!is_of(r.columns[i].name, kind.stem)) continue;
    const recording::Column& c = limits.columns.columns[i];
    if (recording::has_limit_share(c.lower, c.upper))
      limited.push_back({&r.columns[i], c.lower, c.upper});
    else without.push_back(r.columns[i].name);
  }
  if (limited.empty()) {
    if (without.empty()) band.unknown = std::string("no ") + kind.word + " of joints was recorded";
    else if (!limits.unknown.empty()) band.unknown = "no limits are known: " + limits.unknown;
    else band.unknown = std::string("the joints have no ") + kind.word + " limits";
    return band;
  }
  if (!without.empty()) {
    constexpr std::size_t kMostNames = 4;
    const std::size_t more = without.size() > kMostNames ? without.size() - kMostNames : 0;
    without.resize(without.size() - more);
    band.note = "no limits of " + text::enumerate(without) +
                (more ? " and " + std::to_string(more) + " more" : "");
  }
  const auto share = [&](const Limited& l, std::size_t i) {
    const double s = recording::limit_share(l.lower, l.upper, l.column->values[i]);
    return std::isnan(s) ? 0 : s;
  };
  const auto worst = [&](std::size_t i) {
    const Limited* most = &limited.front();
    for (const Limited& l : limited)
      if (share(l, i) > share(*most, i)) most = &l;
    return most;
  };
  add_levels(
      band, time,
      [&](std::size_t i) {
        const double s = share(*worst(i), i);
        return std::pair(s > kAtLimit ? Level::fault : s > warn ? Level::warn : Level::ok, s);
      },
      [&](std::size_t i) {
        const Limited& l = *worst(i);
        const double s = share(l, i);
        const double v = l.column->values[i];
        const double bound = std::fabs(v - l.lower) < std::fabs(v - l.upper) ? l.lower : l.upper;
        const std::string unit = l.column->unit.empty() ? "" : " " + l.column->unit;
        Span span{0,
                  0,
                  "",
                  l.column->name + " uses " + text::print_rounded(100 * s, 3) + " % of its " +
                      kind.word + " limit: " + text::print_rounded(v, 4) + unit + " of " +
                      text::print_rounded(bound, 4) + unit,
                  {}};
        span.more.set("column", l.column->name);
        span.more.set("share", s);
        return span;
      });
  return band;
}

Band clearance_of(const recording::Recording& r, const std::vector<double>& time, double near) {
  Band band{"clearance", "Clearance"};
  const recording::Column* c = r.find("clearance");
  if (!c) {
    band.unknown = "no clearance was recorded";
    return band;
  }
  add_levels(
      band, time,
      [&](std::size_t i) {
        const double d = c->values[i];
        return std::pair(d <= 0 ? Level::fault : d < near ? Level::warn : Level::ok, -d);
      },
      [&](std::size_t i) {
        const double d = c->values[i];
        Span span{0,
                  0,
                  "",
                  d <= 0 ? std::string("bodies touch")
                         : "bodies come as near as " + text::print_rounded(1e3 * d, 3) + " mm",
                  {}};
        span.more.set("column", "clearance");
        return span;
      });
  return band;
}

/// Remarks of a run with their times: "t = 1.5 s: left releases part".
Band notes_of(const recording::Recording& r, const std::vector<double>& time) {
  Band band{"notes", "Notes"};
  for (const std::string& note : r.notes) {
    constexpr std::string_view kStart = "t = ";
    const std::size_t at = note.find(kStart);
    if (at == std::string::npos) continue;
    const std::size_t end = note.find(" s", at);
    if (end == std::string::npos) continue;
    const auto t = text::read_real(
        std::string_view(note).substr(at + kStart.size(), end - at - kStart.size()));
    if (!t || *t < time.front() || *t > time.back()) continue;
    band.spans.push_back({*t, *t, "note", note, {}});
    if (band.spans.size() >= kMostSpans) break;
  }
  return band;
}

/// What each robot carries, by object.
std::vector<Band> grips_of(const CommandContext& ctx, const recording::Recording& r,
                           const std::vector<double>& time) {
  std::vector<Band> out;
  if (!r.loads) return out;
  for (const recording::Load& load : *r.loads) {
    auto band = std::find_if(out.begin(), out.end(),
                             [&](const Band& b) { return b.name == "grip." + load.object; });
    if (band == out.end())
      band = out.insert(out.end(), Band{"grip." + load.object, "Grip of " + load.object});
    Span span{std::max(load.from, time.front()),
              std::min(load.to, time.back()),
              "grip",
              load.robot + " carries " + load.object,
              {}};
    if (!(span.to > span.from)) continue;
    if (ctx.snapshot().find(load.what)) span.more.set("record", Application::handle(load.what));
    band->spans.push_back(std::move(span));
  }
  return out;
}

/// The changes of a signal: its values from each time on.
Map signal_of(const recording::Column& c, const std::vector<double>& time) {
  std::vector<double> times, values;
  bool is_digital = true;
  for (std::size_t i = 0; i < time.size(); ++i) {
    is_digital = is_digital && (c.values[i] == 0 || c.values[i] == 1);
    if (!values.empty() && values.back() == c.values[i]) continue;
    times.push_back(time[i]);
    values.push_back(c.values[i]);
  }
  Map out{{"name", c.name},        {"label", c.name.substr(std::string_view("signal.").size())},
          {"kind", "signal"},      {"known", true},
          {"digital", is_digital}, {"unit", c.unit}};
  out.set("times", Value(NumericArray(std::move(times), "s")));
  out.set("values", Value(NumericArray(std::move(values), c.unit)));
  return out;
}

Value shown(Band band) {
  List spans;
  for (Span& s : band.spans) {
    Map row{{"from", s.from}, {"to", s.to}, {"level", s.level}, {"text", s.text}};
    for (const auto& [name, value] : s.more) row.set(name, value);
    spans.emplace_back(std::move(row));
  }
  Map out{{"name", band.name},
          {"label", band.label},
          {"kind", "spans"},
          {"known", band.unknown.empty()}};
  if (!band.unknown.empty()) out.set("why", band.unknown);
  if (!band.note.empty()) out.set("note", band.note);
  out.set("spans", std::move(spans));
  return Value(std::move(out));
}

Result<Value> bands(CommandContext& ctx, const Map& args) {
  const auto r = recording_of(ctx, args);
  const recording::Column* time_column = r->find("time");
  List out;
  if (!time_column || time_column->values.empty()) return Value(std::move(out));
  const std::vector<double>& time = time_column->values;
  const RecordsThen then(ctx, number_of(args));
  std::vector<Band> all;
  all.push_back(segments_of(ctx, then, *r, time));
  all.push_back(clearance_of(*r, time, real(args, "near")));
  const Limits limits = limits_of(ctx, *r);
  const bool has_joints = std::any_of(r->columns.begin(), r->columns.end(),
                                      [](const auto& c) { return is_of(c.name, "q"); });
  if (has_joints)
    for (const LimitKind& kind : kLimitKinds) {
      if (ctx.progress.cancelled()) return error(ErrorCode::cancelled, "cancelled");
      all.push_back(use_of(*r, limits, time, kind, real(args, "warn")));
    }
  Band faults{"faults", "Faults"};
  std::vector<std::string> unknown;
  for (const Band& band : all) {
    if (band.name == "segments") continue;
    if (!band.unknown.empty()) unknown.push_back(text::quote(band.label));
    for (const Span& span : band.spans)
      if (span.level == "fault") faults.spans.push_back(span);
  }
  std::stable_sort(faults.spans.begin(), faults.spans.end(),
                   [](const Span& a, const Span& b) { return a.from < b.from; });
  if (!unknown.empty()) faults.note = "not looked at: " + text::enumerate(unknown);
  all.push_back(std::move(faults));
  Band notes = notes_of(*r, time);
  if (!notes.spans.empty()) all.push_back(std::move(notes));
  for (Band& grip : grips_of(ctx, *r, time)) all.push_back(std::move(grip));
  for (Band& band : all) out.push_back(shown(std::move(band)));
  for (const recording::Column& c : r->columns)
    if (c.name.starts_with("signal.")) out.emplace_back(signal_of(c, time));
  return Value(std::move(out));
}

}  // namespace

RMP_COMMANDS(recording_band_commands) {
  std::vector<CommandSpec> all;
  all.push_back(
      {.name = "recording.bands",
       .classic = "",
       .summary = "Lists intervals of a recording for a timeline: segments, limits, faults, grips, "
                  "signals.",
       .details =
           "Segments are those of the trajectory as it was when the recording was made. Limits are "
           "compared as shares: the distance from the middle of the limits, divided by half "
           "their range. "
           "`known` is false where something could not be looked at, and `why` gives the reason; "
           "an empty list of spans alone means that nothing was found.",
       .example = with_arm(
           "local cell = world.create{name = \"cell\"}\n"
           "cell:add_robot{robot = arm, q = \"ready\"}\n"
           "local start = arm:fk{q = \"ready\"}\n"
           "local p, a = start.position, start.rpy\n"
           "trajectory.create{name = \"stroke\", sample_time = 0.05, segments = {{shape = "
           "\"line\", points = {\n"
           "  {p[1], p[2], p[3], a[1], a[2], a[3]}, {p[1], p[2] + 0.05, p[3], a[1], a[2], "
           "a[3]}}}}}\n"
           "cell:add_trajectory{trajectory = \"stroke\"}\n"
           "local run = cell:inverse_dynamics{robot = \"arm\", trajectory = \"stroke\"}\n"
           "local bands = run:bands()\n"
           "assert(bands[1].name == \"segments\" and bands[1].spans[1].path == \"segments.1\")\n"
           "assert(not bands[2].known and bands[2].why == \"no clearance was recorded\")"),
       .params = {self("recording"),
                  between(defaulted("warn", "real", "", 0.8,
                                    "Share of a limit from which a span has the level warn."),
                          0, 1),
                  between(defaulted("near", "real", "m", 0.005,
                                    "Clearance below which a span has the level warn."),
                          0, 1e6)},
       .returns =
           {"list",
            "",
            "",
            {field("name", "string", "",
                   "segments, clearance, position, speed, torque, faults, notes, grip.<object> or "
                   "the column of a signal."),
             field("label", "string", "", "The name for people."),
             field("kind", "string", "", "spans or signal."),
             field("known", "bool", "", "Whether it could be looked at."),
             field("why", "string", "", "Why not."),
             field("note", "string", "", "What was not looked at of it."),
             field("spans", "list", "",
                   "Tables: from, to [s], level (ok, warn, fault, segment, transition, approach, "
                   "grip or note), text; and as far as they apply at [s] (the worst time), column, "
                   "share, number, record and path of a segment."),
             field("digital", "bool", "", "Of a signal: it is 0 or 1."),
             field("unit", "string", "", "Of a signal."),
             field("times", "array", "s", "Of a signal: when it gets a value."),
             field("values", "array", "", "Of a signal: these values.")}},
       .effect = Effect::reads,
       .run = bands});
  return all;
}

}  // namespace robomosp::ioci
