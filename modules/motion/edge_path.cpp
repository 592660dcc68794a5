// SPDX-License-Identifier: Apache-2.0
#include "motion/edge_path.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <string>
#include <utility>

#include "spatial/pose.h"

namespace robomosp::motion {
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

/// The edges as one chain, each turned so that it begins where the one before ends.
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
  explicit Builder(const EdgePath& path) : path_(path) {
    if (path.from != Vec3{}) stance_.from = path.from;
    stance_.tilt = path.tilt, stance_.lead = path.lead, stance_.stand_off = path.stand_off;
  }

  Result<std::vector<EdgePiece>> run(const std::vector<Leg>& legs) {
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

  static EdgePiece piece(const char* shape, std::vector<Pose> points, const char* orientation) {
    return {.shape = shape, .orientation = orientation, .points = std::move(points)};
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
    if (!is_start) turn_to(begin);
    const double lead_in = is_start ? path_.lead_in : 0, lead_out = is_end ? path_.lead_out : 0;
    std::vector<EdgePiece> way;  // at the working speed
    if (lead_in > 0) {
      const Pose before = moved(begin, scale(a.tangent, -lead_in));
      way.push_back(piece("line", {before, begin}, "fixed"));
      begin = before;
    }
    for (std::size_t i = first; i <= last; ++i) RMP_TRY(add_leg(legs[i], way));
    if (lead_out > 0) {
      const Pose after = moved(end, scale(b.tangent, lead_out));
      way.push_back(piece("line", {end, after}, "fixed"));
      end = after;
    }
    if (const double d = is_start ? path_.approach : 0; d > 0)
      made_.push_back(from_rest_to_rest(
          piece("line", {moved(begin, scale(axis(begin, 2), -d)), begin}, "fixed")));
    const double speed = path_.speed;
    for (std::size_t i = 0; i < way.size(); ++i) {
      EdgePiece& m = way[i];
      m.params.set("speed", speed);
      // The speed asked for holds: how the tool turns with the way is for the robot to follow.
      m.params.set("angular_speed", kAnyTurn);
      if (i > 0 && i + 1 < way.size()) {
        m.law = "constant_speed";
      } else {
        m.law = "trapezoidal";
        m.params.set("angular_acceleration", kAnyTurn);
        if (path_.acceleration > 0) m.params.set("acceleration", path_.acceleration);
        if (i > 0) m.params.set("start_speed", speed);
        if (i + 1 < way.size()) m.params.set("end_speed", speed);
      }
      made_.push_back(std::move(m));
    }
    if (const double d = is_end ? path_.retract : 0; d > 0)
      made_.push_back(
          from_rest_to_rest(piece("line", {end, moved(end, scale(axis(end, 2), -d))}, "fixed")));
    last_ = end;
    return {};
  }

  /// To the pose of the tool after a corner: on the spot, or as far as its stand-off takes it.
  void turn_to(const Pose& to) {
    Pose there = to;
    if (stance_.stand_off == 0) there.p = last_.p;
    made_.push_back(from_rest_to_rest(piece("line", {last_, there}, "slerp")));
  }

  EdgePiece from_rest_to_rest(EdgePiece m) const {
    m.law = "trapezoidal";
    m.params.set("speed", path_.travel_speed > 0 ? path_.travel_speed : path_.speed);
    if (path_.acceleration > 0) m.params.set("acceleration", path_.acceleration);
    return m;
  }

  Result<void> add_leg(const Leg& leg, std::vector<EdgePiece>& way) const {
    const CsgEdge& e = leg.edge;
    if (e.kind == CsgEdge::Kind::circle) return add_arc(leg, way);
    if (e.kind == CsgEdge::Kind::line) {
      RMP_TRY_ASSIGN(const Pose a, frame_at(e.points.front(), stance_, leg.number));
      RMP_TRY_ASSIGN(const Pose b, frame_at(e.points.back(), stance_, leg.number));
      way.push_back(piece("line", {a, b}, "slerp"));
      return {};
    }
    std::vector<Pose> all;
    for (const CsgEdgePoint& p : e.points) {
      RMP_TRY_ASSIGN(const Pose t, frame_at(p, stance_, leg.number));
      all.push_back(t);
    }
    way.push_back(piece("cubic_spline", std::move(all), "squad"));
    return {};
  }

  Result<void> add_arc(const Leg& leg, std::vector<EdgePiece>& way) const {
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
      EdgePiece m = piece("arc_centre", {a, b}, "slerp");
      // Off the edge the tool runs on a circle about the same axis.
      const Vec3 up = spatial::unit(e.axis);
      const Vec3 centre = add(e.centre, scale(up, dot(sub(a.p, e.centre), up)));
      m.params.set("centre", NumericArray({centre[0], centre[1], centre[2]}));
      m.params.set("axis", NumericArray({e.axis[0], e.axis[1], e.axis[2]}));
      m.params.set("angle", e.angle / pieces);
      way.push_back(std::move(m));
    }
    return {};
  }

  const EdgePath& path_;
  Stance stance_;
  Pose last_;
  std::vector<EdgePiece> made_;
};

}  // namespace

Result<std::vector<EdgePiece>> edge_pieces(const std::vector<CsgEdge>& all, const EdgePath& path) {
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
  return Builder(path).run(legs);
}

}  // namespace robomosp::motion
