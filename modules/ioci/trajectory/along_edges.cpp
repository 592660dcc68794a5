// SPDX-License-Identifier: Apache-2.0
// Trajectories along the edges of a solid: for seams, deburring, sealing.
#include "ioci/trajectory/along_edges.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include "ioci/core/commands.h"
#include "ioci/records/solid_edges.h"
#include "ioci/trajectory/segments.h"
#include "kernel/check.h"
#include "spatial/pose.h"

namespace robomosp::ioci {
namespace {

using model::EdgePath;
using spatial::add;
using spatial::cross;
using spatial::dot;
using spatial::norm;
using spatial::scale;
using spatial::sub;

/// Ends of edges that are one place, and directions that go on without a corner.
constexpr double kSamePlace = 1e-6, kSameDirection = 1e-3;
/// Arcs turn by no more in one segment, so that the short way between two orientations is the way
/// along the arc.
constexpr double kMostTurn = std::numbers::pi / 2;
/// No bound on turning [rad/s, rad/s^2].
constexpr double kAnyTurn = 1e6;
/// Normals whose sum is shorter than this have no direction between them.
constexpr double kLeastSum = 1e-3;

/// An edge as it is run along.
struct Leg {
  std::size_t number = 0;  ///< of solid.edges, from 0
  CsgEdge edge;            ///< from where it is entered
};

CsgEdge reversed(CsgEdge e) {
  std::reverse(e.points.begin(), e.points.end());
  for (CsgEdgePoint& p : e.points) p.tangent = scale(p.tangent, -1);
  e.axis = scale(e.axis, -1);
  return e;
}

double gap(const CsgEdgePoint& a, const CsgEdgePoint& b) {
  return norm(sub(a.position, b.position));
}

/// The edges as one chain, each turned so that it goes on where the one before ends.
Result<std::vector<Leg>> chain(const std::vector<CsgEdge>& all,
                               const std::vector<std::size_t>& chosen, bool is_reversed) {
  std::vector<Leg> legs;
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    Leg leg{chosen[i], all[chosen[i]]};
    const auto turn = [](Leg& l) { l.edge = reversed(std::move(l.edge)); };
    if (i == 0) {
      if (chosen.size() > 1) {
        const CsgEdge& next = all[chosen[1]];
        const auto reach = [&](const CsgEdgePoint& p) {
          return std::min(gap(p, next.points.front()), gap(p, next.points.back()));
        };
        if (reach(leg.edge.points.front()) < reach(leg.edge.points.back())) turn(leg);
      }
    } else {
      const CsgEdgePoint& end = legs.back().edge.points.back();
      const double forth = gap(end, leg.edge.points.front()),
                   back = gap(end, leg.edge.points.back());
      if (back < forth) turn(leg);
      if (std::min(forth, back) > kSamePlace)
        return error(ErrorCode::invalid_argument,
                     "edge " + std::to_string(leg.number + 1) + " does not begin where edge " +
                         std::to_string(legs.back().number + 1) + " ends",
                     "Give edges that follow one another; solid.edges lists where they start and "
                     "end.",
                     "edges");
    }
    legs.push_back(std::move(leg));
  }
  if (is_reversed) {
    std::reverse(legs.begin(), legs.end());
    for (Leg& l : legs) l.edge = reversed(std::move(l.edge));
  }
  return legs;
}

/// How the tool stands on the edge.
struct Stance {
  std::optional<Vec3> from;  ///< the side it comes from, instead of between the faces
  double tilt = 0;           ///< about the way [rad]
  double lead = 0;           ///< about its y after that [rad]
  double stand_off = 0;      ///< from the edge, along the tool [m]
};

/// x along the way, z into the part, before tilt and lead; the place is off the edge then.
Result<Pose> frame_at(const CsgEdgePoint& p, const Stance& stance, std::size_t number) {
  Vec3 out = stance.from.value_or(add(p.normals[0], p.normals[1]));
  out = sub(out, scale(p.tangent, dot(out, p.tangent)));
  if (!(norm(p.tangent) > 0.5) || !(norm(out) > kLeastSum))
    return error(ErrorCode::invalid_argument,
                 stance.from
                     ? "edge " + std::to_string(number + 1) +
                           " runs along the approach direction of the tool"
                     : "edge " + std::to_string(number + 1) + " has no side between its faces",
                 "Give an approach direction of the tool across the edge.", "from");
  const Vec3 z = scale(spatial::unit(out), -1), y = cross(z, p.tangent);
  Pose t;
  for (std::size_t r = 0; r < 3; ++r) {
    t.R[3 * r] = p.tangent[r];
    t.R[3 * r + 1] = y[r];
    t.R[3 * r + 2] = z[r];
  }
  t.p = p.position;
  const Pose tilted{spatial::from_axis_angle({1, 0, 0}, stance.tilt), {}};
  const Pose led{spatial::from_axis_angle({0, 1, 0}, stance.lead), {}};
  t = spatial::compose(spatial::compose(t, tilted), led);
  t.p = sub(t.p, scale(Vec3{t.R[2], t.R[5], t.R[8]}, stance.stand_off));
  return t;
}

class Builder {
 public:
  Builder(const CommandContext& ctx, const EdgePath& path) : ctx_(ctx), path_(path) {
    if (path.from != Vec3{}) stance_.from = path.from;
    stance_.tilt = path.tilt, stance_.lead = path.lead, stance_.stand_off = path.stand_off;
  }

  Result<std::vector<model::TrajectorySegment>> run(const std::vector<Leg>& legs) {
    // Runs without a corner: from rest to rest.
    for (std::size_t first = 0; first < legs.size();) {
      std::size_t last = first;
      while (last + 1 < legs.size()) {
        RMP_TRY_ASSIGN(const bool goes_on, go_on(legs[last], legs[last + 1]));
        if (!goes_on) break;
        ++last;
      }
      RMP_TRY(add_run(legs, first, last, last + 1 == legs.size()));
      first = last + 1;
    }
    return std::move(made_);
  }

 private:
  Result<bool> go_on(const Leg& a, const Leg& b) const {
    RMP_TRY_ASSIGN(const Pose end, frame_at(a.edge.points.back(), stance_, a.number));
    RMP_TRY_ASSIGN(const Pose start, frame_at(b.edge.points.front(), stance_, b.number));
    double worst = 0;
    for (std::size_t i = 0; i < 9; ++i) worst = std::max(worst, std::fabs(end.R[i] - start.R[i]));
    return worst < kSameDirection;
  }

  static Value points(std::initializer_list<Pose> poses) {
    List all;
    for (const Pose& t : poses) all.push_back(pose_value(t));
    return Value(std::move(all));
  }
  static Map segment(const char* shape, Value points, const char* orientation) {
    return Map{{"shape", shape},
               {"points", std::move(points)},
               {"orientation", orientation},
               {"transition", "none"}};
  }
  static Pose moved(Pose t, const Vec3& by) {
    t.p = add(t.p, by);
    return t;
  }
  static Vec3 axis(const Pose& t, std::size_t column) {
    return {t.R[column], t.R[3 + column], t.R[6 + column]};
  }

  Result<void> add_run(const std::vector<Leg>& legs, std::size_t first, std::size_t last,
                       bool is_end) {
    const CsgEdgePoint &a = legs[first].edge.points.front(), &b = legs[last].edge.points.back();
    RMP_TRY_ASSIGN(Pose begin, frame_at(a, stance_, legs[first].number));
    RMP_TRY_ASSIGN(Pose end, frame_at(b, stance_, legs[last].number));
    const bool is_start = made_.empty();
    if (!is_start) RMP_TRY(turn_to(begin));
    const double lead_in = is_start ? path_.lead_in : 0, lead_out = is_end ? path_.lead_out : 0;
    std::vector<Map> way;  // at the working speed
    if (lead_in > 0) {
      const Pose before = moved(begin, scale(a.tangent, -lead_in));
      way.push_back(segment("line", points({before, begin}), "fixed"));
      begin = before;
    }
    for (std::size_t i = first; i <= last; ++i) RMP_TRY(add_leg(legs[i], way));
    if (lead_out > 0) {
      const Pose after = moved(end, scale(b.tangent, lead_out));
      way.push_back(segment("line", points({end, after}), "fixed"));
      end = after;
    }
    if (const double d = is_start ? path_.approach : 0; d > 0)
      RMP_TRY(keep(from_rest_to_rest(
          segment("line", points({moved(begin, scale(axis(begin, 2), -d)), begin}), "fixed"))));
    const double speed = path_.speed;
    for (std::size_t i = 0; i < way.size(); ++i) {
      Map& m = way[i];
      m.set("speed", speed);
      // The speed asked for holds: how the tool turns with the way is for the robot to follow.
      m.set("angular_speed", kAnyTurn);
      if (i > 0 && i + 1 < way.size()) {
        m.set("law", "constant_speed");
      } else {
        m.set("law", "trapezoidal");
        m.set("angular_acceleration", kAnyTurn);
        if (path_.acceleration > 0) m.set("acceleration", path_.acceleration);
        if (i > 0) m.set("start_speed", speed);
        if (i + 1 < way.size()) m.set("end_speed", speed);
      }
      RMP_TRY(keep(std::move(m)));
    }
    if (const double d = is_end ? path_.retract : 0; d > 0)
      RMP_TRY(keep(from_rest_to_rest(
          segment("line", points({end, moved(end, scale(axis(end, 2), -d))}), "fixed"))));
    last_ = end;
    return {};
  }

  /// To how the tool stands behind a corner: on the spot, or as far as its stand-off takes it.
  Result<void> turn_to(const Pose& to) {
    Pose there = to;
    if (stance_.stand_off == 0) there.p = last_.p;
    return keep(from_rest_to_rest(segment("line", points({last_, there}), "slerp")));
  }

  Map from_rest_to_rest(Map m) const {
    m.set("law", "trapezoidal");
    m.set("speed", path_.travel_speed > 0 ? path_.travel_speed : path_.speed);
    if (path_.acceleration > 0) m.set("acceleration", path_.acceleration);
    return m;
  }

  Result<void> add_leg(const Leg& leg, std::vector<Map>& way) const {
    const CsgEdge& e = leg.edge;
    if (e.kind == CsgEdge::Kind::circle) return add_arc(leg, way);
    if (e.kind == CsgEdge::Kind::line) {
      RMP_TRY_ASSIGN(const Pose a, frame_at(e.points.front(), stance_, leg.number));
      RMP_TRY_ASSIGN(const Pose b, frame_at(e.points.back(), stance_, leg.number));
      way.push_back(segment("line", points({a, b}), "slerp"));
      return {};
    }
    List all;
    for (const CsgEdgePoint& p : e.points) {
      RMP_TRY_ASSIGN(const Pose t, frame_at(p, stance_, leg.number));
      all.push_back(pose_value(t));
    }
    way.push_back(segment("cubic_spline", Value(std::move(all)), "squad"));
    return {};
  }

  Result<void> add_arc(const Leg& leg, std::vector<Map>& way) const {
    const CsgEdge& e = leg.edge;
    const int pieces = std::max(1, static_cast<int>(std::ceil(e.angle / kMostTurn - 1e-9)));
    const auto at = [&](int i) {
      // Between two places of the edge their normals turn with the arc.
      const double angle = e.angle * i / pieces;
      const double step = e.angle / static_cast<double>(e.points.size() - 1);
      const auto near =
          std::min(e.points.size() - 1, static_cast<std::size_t>(std::lround(angle / step)));
      const auto R = spatial::from_axis_angle(e.axis, angle - step * static_cast<double>(near));
      const Pose turn{R, {}};
      CsgEdgePoint p = e.points[near];
      p.position = add(e.centre, spatial::rotate(turn, sub(p.position, e.centre)));
      p.tangent = spatial::rotate(turn, p.tangent);
      for (Vec3& n : p.normals) n = spatial::rotate(turn, n);
      return p;
    };
    for (int i = 0; i < pieces; ++i) {
      RMP_TRY_ASSIGN(const Pose a, frame_at(at(i), stance_, leg.number));
      RMP_TRY_ASSIGN(const Pose b, frame_at(at(i + 1), stance_, leg.number));
      Map m = segment("arc_centre", points({a, b}), "slerp");
      // Off the edge the tool runs on a circle about the same axis.
      const Vec3 up = spatial::unit(e.axis);
      const Vec3 centre = add(e.centre, scale(up, dot(sub(a.p, e.centre), up)));
      m.set("centre", NumericArray({centre[0], centre[1], centre[2]}));
      m.set("axis", NumericArray({e.axis[0], e.axis[1], e.axis[2]}));
      m.set("angle", e.angle / pieces);
      way.push_back(std::move(m));
    }
    return {};
  }

  Result<void> keep(Map table) {
    RMP_TRY_ASSIGN(auto segment,
                   read_segment(ctx_, Value(std::move(table)),
                                "segments[" + std::to_string(made_.size() + 1) + "]"));
    made_.push_back(std::move(segment));
    return {};
  }

  const CommandContext& ctx_;
  const EdgePath& path_;
  Stance stance_;
  Pose last_;
  std::vector<model::TrajectorySegment> made_;
};

Result<Value> along_edges(CommandContext& ctx, const Map& args) {
  EdgePath path;
  path.solid = typed<model::Solid>(args, "solid");
  path.is_reversed = flag(args, "reverse");
  if (has(args, "from")) {
    path.from = vec3(args, "from");
    if (path.from == Vec3{})
      return error(ErrorCode::invalid_argument, "from has no direction: its length is 0",
                   "Give the approach direction of the tool, or leave from out.", "from");
  }
  for (const auto& [word, number] : {std::pair<const char*, double*>{"tilt", &path.tilt},
                                     {"lead", &path.lead},
                                     {"stand_off", &path.stand_off},
                                     {"lead_in", &path.lead_in},
                                     {"lead_out", &path.lead_out},
                                     {"approach", &path.approach},
                                     {"retract", &path.retract},
                                     {"speed", &path.speed},
                                     {"travel_speed", &path.travel_speed},
                                     {"acceleration", &path.acceleration},
                                     {"chord", &path.chord}})
    if (has(args, word)) *number = real(args, word);
  RMP_TRY_ASSIGN(const auto all, edges_along(ctx, ctx.snapshot(), path));
  RMP_TRY_ASSIGN(const auto chosen, read_edges(*all, *args.find("edges")->as_list(), "edges"));
  for (const std::size_t e : chosen) path.edges.push_back(static_cast<std::int64_t>(e) + 1);
  model::Trajectory t;
  RMP_TRY_ASSIGN(t.segments, segments_along(ctx, *all, path));
  const std::string name = text_of(args, "name");
  t.description = text_of(args, "description");
  if (has(args, "sample_time")) t.sample_time = real(args, "sample_time");
  RMP_TRY(check_trajectory(ctx, name, t));
  if (flag(args, "follow")) t.along = std::move(path);
  const auto existing = ctx.snapshot().find(Kind::trajectory, name);
  if (!flag(args, "replace") || !existing) {
    RMP_TRY_ASSIGN(const auto made, ctx.edit().add(name, std::move(t)));
    return Value(Application::handle(made));
  }
  // Where it stands in worlds it goes on standing; what is not given stays as it was.
  RMP_TRY(change<model::Trajectory>(ctx, *existing, [&](model::Trajectory& old) -> Result<void> {
    old.segments = std::move(t.segments);
    old.along = std::move(t.along);
    drop_expressions(old, "segments");
    drop_expressions(old, "along");
    if (!t.description.empty()) old.description = std::move(t.description);
    if (has(args, "sample_time")) old.sample_time = t.sample_time;
    return {};
  }));
  return Value(Application::handle(*existing));
}

}  // namespace

Result<std::shared_ptr<const std::vector<CsgEdge>>> edges_along(const CommandContext& ctx,
                                                                const document::Snapshot& records,
                                                                const model::EdgePath& path) {
  const model::Solid* solid = records.get(path.solid);
  RMP_CHECK(solid, "edges of a solid that is not there");
  return ctx.app.derived.edges(records, path.solid, path.chord > 0 ? path.chord : solid->chord,
                               ctx.progress);
}

Result<std::vector<model::TrajectorySegment>> segments_along(const CommandContext& ctx,
                                                             const std::vector<CsgEdge>& all,
                                                             const model::EdgePath& path) {
  if (path.edges.empty())
    return error(ErrorCode::invalid_argument, "no edge is given",
                 "Give numbers of solid.edges, or places near edges.", "edges");
  std::vector<std::size_t> chosen;
  for (const std::int64_t number : path.edges) {
    if (number < 1 || static_cast<std::size_t>(number) > all.size())
      return error(ErrorCode::invalid_argument,
                   "the solid has " + std::to_string(all.size()) + " edges, and no edge " +
                       std::to_string(number),
                   "solid.edges lists them.", "edges");
    chosen.push_back(static_cast<std::size_t>(number) - 1);
  }
  RMP_TRY_ASSIGN(const auto legs, chain(all, chosen, path.is_reversed));
  return Builder(ctx, path).run(legs);
}

void drop_expressions(model::Trajectory& t, std::string_view under) {
  std::erase_if(t.parametric.expressions, [&](const auto& e) {
    return e.first.starts_with(under) &&
           (e.first.size() == under.size() || e.first[under.size()] == '.');
  });
}

RMP_COMMANDS(along_edges_commands) {
  const double most = std::numeric_limits<double>::max();
  const auto length = [&](const char* name, const char* doc) {
    return between(defaulted(name, "real", "m", 0.0, doc), 0, most);
  };
  std::vector<CommandSpec> all;
  all.push_back(
      {.name = "trajectory.along_edges",
       .classic = "",
       .summary = "Makes a trajectory that follows edges of a solid, for a seam, a bead or a burr.",
       .details = "In the solid's frame. The tool's x axis points along the path, its z axis into "
                  "the part, midway between the two faces or away from the direction in `from`, "
                  "then rotated by tilt and lead. Lines and arcs are exact, other edges become "
                  "splines through their points. At a corner the tool stops and turns. When the "
                  "solid changes, the segments are made again in the same step of the history. If "
                  "an edge no longer exists then, or if you edit the segments yourself, they stay "
                  "unchanged and a message reports that they no longer follow the solid.",
       .example =
           "local plate = solid.create{name = \"plate\", root = {kind = \"box\", x = 0.2, y = 0.1, "
           "z = 0.01}}\n"
           "local seam = trajectory.along_edges{name = \"seam\", solid = plate,\n"
           "  edges = {{0.1, 0, 0.01}, {0, 0.05, 0.01}}, speed = \"20 mm/s\", acceleration = 1}\n"
           "assert(math.abs(seam:length() - 0.3) < 1e-9)",
       .params =
           {needed("name", "string", "", "Name, unique among trajectories."),
            needed("solid", "ref:solid", "", "The solid with the edges."),
            needed("edges", "list", "",
                   "In order: numbers of solid.edges, or places {x, y, z} [m], each for the edge "
                   "nearest to it."),
            above_zero(needed("speed", "real", "m/s", "Speed along the edges.")),
            defaulted("reverse", "bool", "", false, "Follow the edges in the other direction."),
            optional("from", "vec3", "",
                     "Direction from which the tool comes, in the solid's frame."),
            defaulted("tilt", "real", "rad", 0.0, "Rotation of the tool about the path."),
            defaulted("lead", "real", "rad", 0.0,
                      "Subsequent rotation about the tool's y axis: positive values point its tip "
                      "ahead."),
            length("stand_off",
                   "Distance from the edge, along the tool: so that the wire of a torch or the "
                   "drop of a nozzle does not count as a contact with the part."),
            length("lead_in", "Straight path before the first edge."),
            length("lead_out", "Straight path after the last edge."),
            length("approach", "Path along the tool axis to the first point."),
            length("retract", "Path along the tool axis from the last point."),
            above_zero(optional("travel_speed", "real", "m/s",
                                "Speed of approach and retract; by default speed.")),
            above_zero(optional("acceleration", "real", "m/s^2",
                                "Acceleration at the start and end of the speed profile; by "
                                "default that of the law.")),
            above_zero(
                optional("chord", "real", "m",
                         "For edges that are not lines or arcs: greatest distance of a chord "
                         "between two points from the edge; by default the chord of the solid.")),
            above_zero(optional("sample_time", "real", "s",
                                "Time between samples of a run that sets none.")),
            defaulted(
                "follow", "bool", "", true,
                "Make the segments again when the solid changes; false keeps them unchanged."),
            defaulted("replace", "bool", "", false,
                      "Replace the segments of an existing trajectory with this name: worlds that "
                      "run it then run the new ones."),
            optional("description", "string", "", "Its description.")},
       .returns = {"handle", "", "", {}},
       .effect = Effect::edits,
       .run = along_edges});
  return all;
}

}  // namespace robomosp::ioci
