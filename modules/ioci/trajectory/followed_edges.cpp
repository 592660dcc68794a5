// SPDX-License-Identifier: Apache-2.0
#include "ioci/trajectory/followed_edges.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <tuple>
#include <utility>

#include "ioci/core/commands.h"
#include "ioci/core/room_parts.h"
#include "ioci/trajectory/along_edges.h"
#include "ioci/trajectory/segments.h"
#include "model/data.h"
#include "spatial/pose.h"

namespace robomosp::ioci {
namespace {

using model::EdgePath;
using model::Trajectory;
using spatial::dot;
using spatial::norm;
using spatial::scale;
using spatial::sub;
using spatial::unit;

/// What an edge is known by.
struct EdgeMark {
  CsgEdge::Kind kind = CsgEdge::Kind::curve;
  bool is_closed = false;
  Vec3 place{};      ///< its middle, of a circle the centre [m]
  Vec3 direction{};  ///< along it, of a circle its axis; the sign means nothing
  /// Outward normals of its faces: in the solid's axes, of a circle along its axis and radius.
  std::array<Vec3, 2> normals{};
  double length = 0;  ///< [m]
};

EdgeMark mark_of(const CsgEdge& e) {
  EdgeMark m{e.kind, e.is_closed, {}, {}, {}, e.length};
  const CsgEdgePoint& middle = e.points[e.points.size() / 2];
  if (e.kind == CsgEdge::Kind::circle) {
    m.place = e.centre, m.direction = e.axis;
    const Vec3 out = unit(sub(middle.position, e.centre));
    // About which of the two directions of the axis the circle runs means nothing.
    Vec3 axis = e.axis;
    for (std::size_t k = 3; k-- > 0;) {
      if (std::fabs(axis[k]) < 1e-9) continue;
      if (axis[k] < 0) axis = scale(axis, -1);
      break;
    }
    for (std::size_t k = 0; k < 2; ++k)
      m.normals[k] = {dot(middle.normals[k], axis), dot(middle.normals[k], out), 0};
    return m;
  }
  m.place = e.points.size() == 2
                ? scale(spatial::add(e.points[0].position, e.points[1].position), 0.5)
                : middle.position;
  m.direction = middle.tangent;
  m.normals = middle.normals;
  return m;
}

/// The box around the marks, to compare places within it.
struct MarkBox {
  Vec3 least{}, size{};
  double diagonal = 0;
};
MarkBox box_of(const std::vector<EdgeMark>& marks) {
  constexpr double kFar = std::numeric_limits<double>::max();
  Vec3 least{kFar, kFar, kFar}, most{-kFar, -kFar, -kFar};
  for (const EdgeMark& m : marks)
    for (std::size_t k = 0; k < 3; ++k) {
      least[k] = std::min(least[k], m.place[k]);
      most[k] = std::max(most[k], m.place[k]);
    }
  const Vec3 size = sub(most, least);
  return {least, size, norm(size)};
}

double square(const Vec3& a, const Vec3& b) {
  const Vec3 d = sub(a, b);
  return dot(d, d);
}

/// Faces that differ by more than this share (0 alike, 1 opposite) are no longer the same.
constexpr double kOtherFaces = 0.4;

/// How unlike two edges are: 0 = alike, infinite = never the same.
double unlikeness(const EdgeMark& a, const EdgeMark& b, const MarkBox& of_a, const MarkBox& of_b) {
  constexpr double kNever = std::numeric_limits<double>::infinity();
  if (a.kind != b.kind || a.is_closed != b.is_closed) return kNever;
  const double faces =
      std::min(square(a.normals[0], b.normals[0]) + square(a.normals[1], b.normals[1]),
               square(a.normals[0], b.normals[1]) + square(a.normals[1], b.normals[0])) /
      8;
  if (faces > kOtherFaces) return kNever;
  const double turned = 1 - std::fabs(dot(a.direction, b.direction));
  // Where a solid grows its edges move with it: near, or at the same share of its size.
  const double whole = std::max({of_a.diagonal, of_b.diagonal, 1e-12});
  double shares = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const auto share = [&](const EdgeMark& m, const MarkBox& box) {
      return box.size[k] > 1e-9 * whole ? (m.place[k] - box.least[k]) / box.size[k] : 0.5;
    };
    const double d = share(a, of_a) - share(b, of_b);
    shares += d * d / 3;
  }
  const double moved = std::min(std::sqrt(square(a.place, b.place)) / whole, std::sqrt(shares));
  const double grown = std::fabs(a.length - b.length) / std::max(a.length + b.length, 1e-12);
  return 4 * faces + 2 * turned + moved + 0.2 * grown;
}

/// `a circle of radius 20 mm about (0, 0, 10) mm`
std::string shown_edge(const CsgEdge& e) {
  const auto place = [](const Vec3& p) {
    std::string s = "(";
    for (std::size_t k = 0; k < 3; ++k)
      s += (k ? ", " : "") + text::print_rounded(1e3 * p[k] + 0.0, 6);
    return s + ") mm";
  };
  if (e.kind == CsgEdge::Kind::circle)
    return "a circle of radius " + text::print_rounded(1e3 * e.radius, 6) + " mm about " +
           place(e.centre);
  return std::string(e.kind == CsgEdge::Kind::line ? "a line" : "a curve") + " from " +
         place(e.points.front().position) + " to " + place(e.points.back().position);
}

/// Which way a path runs where it begins: along its first edge, or about the axis of a circle.
Vec3 sense_of(const CsgEdge& e, bool is_reversed) {
  const Vec3 d = e.kind == CsgEdge::Kind::circle ? e.axis : e.points[e.points.size() / 2].tangent;
  return is_reversed ? scale(d, -1) : d;
}

/// Moves the numbers of a path from the edges of the solid before to those of now.
Result<void> renumber(EdgePath& path, const std::vector<CsgEdge>& before,
                      const std::vector<CsgEdge>& after) {
  std::vector<std::size_t> wanted;
  for (const std::int64_t number : path.edges) {
    if (number < 1 || static_cast<std::size_t>(number) > before.size())
      return error(ErrorCode::invalid_argument, "the solid has " + std::to_string(before.size()) +
                                                    " edges, and no edge " +
                                                    std::to_string(number));
    wanted.push_back(static_cast<std::size_t>(number) - 1);
  }
  const auto found = same_edges(before, after, wanted);
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    if (!found[i])
      return error(ErrorCode::not_found, "edge " + std::to_string(wanted[i] + 1) + " (" +
                                             shown_edge(before[wanted[i]]) + ") is gone");
    path.edges[i] = static_cast<std::int64_t>(*found[i]) + 1;
  }
  // A chain of several edges has its sense by their order; of one the engine may have turned it.
  if (wanted.size() == 1 &&
      dot(sense_of(before[wanted[0]], false), sense_of(after[*found[0]], false)) < 0)
    path.is_reversed = !path.is_reversed;
  return {};
}

class EdgeFollower {
 public:
  explicit EdgeFollower(CommandContext& ctx)
      : ctx_(ctx), edits_(ctx.edit()), before_(edits_.before()) {}

  Result<void> run() {
    for (const AnyId id : followers()) {
      const auto now = ctx_.snapshot().share(id);
      const auto was = before_.share(id);
      const auto& t = std::get<Trajectory>(now->body);
      const auto* old = was ? std::get_if<Trajectory>(&was->body) : nullptr;
      const bool is_same_path = old && old->along == t.along;
      if (is_same_path && !equal_segments(old->segments, t.segments)) {
        if (!is_made_of_path(t)) RMP_TRY(leave(id, "its segments were edited"));
        continue;
      }
      if (!needs_making(t, old)) continue;
      if (auto made = make(id, t, is_same_path); !made.ok()) {
        // A path that was set is refused, as every value is; what was stopped is undone as a whole.
        const bool is_set = old ? !is_same_path : t.segments.empty();
        if (is_set || made.error().code == ErrorCode::cancelled)
          return std::move(made).error().in("along").in(ctx_.snapshot().describe(id));
        RMP_TRY(leave(id, made.error().message));
      }
    }
    return {};
  }

 private:
  /// Trajectories with a path that were changed themselves, or whose solids were, once each.
  [[nodiscard]] std::vector<AnyId> followers() const {
    std::vector<AnyId> all;
    const document::Snapshot& now = ctx_.snapshot();
    const auto keep = [&](AnyId id) {
      if (id.kind != Kind::trajectory) return;
      const model::Record* r = now.find(id);
      if (r && std::get<Trajectory>(r->body).along) all.push_back(id);
    };
    for (const AnyId id : edits_.touched()) {
      keep(id);
      if (id.kind != Kind::solid || !now.find(id)) continue;
      for (const AnyId user : now.referrers(id)) keep(user);
    }
    std::sort(all.begin(), all.end());
    all.erase(std::unique(all.begin(), all.end()), all.end());
    return all;
  }
  using Segments = std::vector<model::TrajectorySegment>;
  static bool equal_segments(const Segments& a, const Segments& b) {
    const model::Field& f = *model::type_of<Trajectory>().field("segments");
    return model::equal({f.type, &a}, {f.type, &b});
  }
  /// True if the segments were made again of the same path, such as after the solid was changed.
  [[nodiscard]] bool is_made_of_path(const Trajectory& t) const {
    const auto all = edges_along(ctx_, ctx_.snapshot(), *t.along);
    if (!all.ok()) return false;
    const auto made = segments_along(ctx_, **all, *t.along);
    return made.ok() && equal_segments(*made, t.segments);
  }
  static bool has_expression(const Trajectory& t) {
    const auto& all = t.parametric.expressions;
    return std::any_of(all.begin(), all.end(),
                       [](const auto& e) { return e.first.starts_with("along."); });
  }
  /// The solid as it was when the segments were made of it; null = it is new.
  [[nodiscard]] const model::Solid* solid_before(const Trajectory& t) const {
    return before_.get(t.along->solid);
  }
  [[nodiscard]] bool needs_making(const Trajectory& t, const Trajectory* old) const {
    if (old && old->along != t.along) return true;
    if (!old && (t.segments.empty() || has_expression(t))) return true;
    const model::Solid* was = solid_before(t);
    const model::Solid* is = ctx_.snapshot().get(t.along->solid);
    if (!old || !was || was == is) return false;
    const model::Field& nodes = *model::type_of<model::Solid>().field("nodes");
    return was->chord != is->chord ||
           !model::equal({nodes.type, nodes.in(was)}, {nodes.type, nodes.in(is)});
  }

  Result<void> make(AnyId id, const Trajectory& now, bool is_same_path) {
    EdgePath path = *now.along;
    RMP_TRY_ASSIGN(const auto after, edges_along(ctx_, ctx_.snapshot(), path));
    // A path that was set counts within the solid of now.
    if (is_same_path && solid_before(now)) {
      RMP_TRY_ASSIGN(const auto before, edges_along(ctx_, before_, path));
      RMP_TRY(renumber(path, *before, *after));
    }
    Trajectory t = now;
    RMP_TRY_ASSIGN(t.segments, segments_along(ctx_, *after, path));
    t.along = std::move(path);
    drop_expressions(t, "segments");
    RMP_TRY(check_trajectory(ctx_, ctx_.snapshot().find(id)->name, t));
    return edits_.edit(id, [&](model::Record& r) -> Result<void> {
      r.body = std::move(t);
      return {};
    });
  }

  Result<void> leave(AnyId id, const std::string& why) {
    const document::Snapshot& now = ctx_.snapshot();
    const std::string name = now.find(id)->name;
    const auto solid = std::get<Trajectory>(now.find(id)->body).along->solid;
    ctx_.app.messages.post(
        Severity::warning, "edges_left",
        "Trajectory " + text::quote(name) + " no longer follows " + now.describe(AnyId(solid)) +
            ": " + why + ". It keeps its segments; trajectory.along_edges{replace = true} makes " +
            "them of edges again.",
        ctx_.session.name());
    return edits_.edit(id, [&](model::Record& r) -> Result<void> {
      auto& t = std::get<Trajectory>(r.body);
      t.along.reset();
      drop_expressions(t, "along");
      return {};
    });
  }

  CommandContext& ctx_;
  document::Transaction& edits_;
  const document::Snapshot before_;
};

}  // namespace

std::vector<std::optional<std::size_t>> same_edges(std::span<const CsgEdge> before,
                                                   std::span<const CsgEdge> after,
                                                   std::span<const std::size_t> wanted) {
  std::vector<EdgeMark> old, now;
  for (const CsgEdge& e : before) old.push_back(mark_of(e));
  for (const CsgEdge& e : after) now.push_back(mark_of(e));
  const MarkBox old_box = box_of(old), new_box = box_of(now);
  std::vector<std::optional<std::size_t>> of_old(old.size());
  std::vector<bool> is_taken(now.size(), false);
  // Edges that are as they were are the same ones, whatever else changed.
  constexpr double kUnchanged = 1e-9;
  std::vector<std::pair<double, std::size_t>> by_place;
  for (std::size_t j = 0; j < now.size(); ++j) by_place.emplace_back(now[j].place[0], j);
  std::sort(by_place.begin(), by_place.end());
  for (std::size_t i = 0; i < old.size(); ++i)
    for (auto at = std::lower_bound(by_place.begin(), by_place.end(),
                                    std::pair(old[i].place[0] - kUnchanged, std::size_t{0}));
         at != by_place.end() && at->first <= old[i].place[0] + kUnchanged; ++at)
      if (!is_taken[at->second] && square(old[i].place, now[at->second].place) < 1e-18 &&
          std::fabs(old[i].length - now[at->second].length) < kUnchanged &&
          unlikeness(old[i], now[at->second], old_box, new_box) < 1e-6) {
        of_old[i] = at->second, is_taken[at->second] = true;
        break;
      }
  // Of the others the likest pair first, then the next of what is left. Where there are too many to
  // compare all with all, only those that are wanted look for theirs.
  std::vector<std::size_t> open;
  for (std::size_t i = 0; i < old.size(); ++i)
    if (!of_old[i]) open.push_back(i);
  constexpr std::size_t kMostPairs = 1'000'000;
  if (open.size() * now.size() > kMostPairs)
    std::erase_if(open, [&](std::size_t i) {
      return std::find(wanted.begin(), wanted.end(), i) == wanted.end();
    });
  struct Pair {
    double unlike;
    std::size_t old, now;
  };
  std::vector<Pair> pairs;
  for (const std::size_t i : open)
    for (std::size_t j = 0; j < now.size(); ++j)
      if (!is_taken[j])
        if (const double u = unlikeness(old[i], now[j], old_box, new_box); std::isfinite(u))
          pairs.push_back({u, i, j});
  std::sort(pairs.begin(), pairs.end(), [](const Pair& a, const Pair& b) {
    return std::tie(a.unlike, a.old, a.now) < std::tie(b.unlike, b.old, b.now);
  });
  for (const Pair& p : pairs)
    if (!of_old[p.old] && !is_taken[p.now]) of_old[p.old] = p.now, is_taken[p.now] = true;
  std::vector<std::optional<std::size_t>> out;
  for (const std::size_t i : wanted) out.push_back(of_old[i]);
  return out;
}

Result<void> follow_edges(CommandContext& ctx) { return EdgeFollower(ctx).run(); }

namespace {

const RoomFile kFollowedEdgesPart({.before_commit = follow_edges});

}  // namespace

}  // namespace robomosp::ioci
