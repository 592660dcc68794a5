// SPDX-License-Identifier: Apache-2.0
#include "ioci/trajectory/followed_edges.h"

#include <algorithm>
#include <string>
#include <utility>

#include "geometry/same_edges.h"
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
using spatial::scale;

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
  const auto found = geometry::same_edges(before, after, wanted);
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

/// Trajectories with a path that were changed themselves, or whose solids were, once each.
std::vector<AnyId> followers_of(CommandContext& ctx) {
  std::vector<AnyId> all;
  const document::Snapshot& now = ctx.snapshot();
  const auto keep = [&](AnyId id) {
    if (id.kind != Kind::trajectory) return;
    const model::Record* r = now.find(id);
    if (r && std::get<Trajectory>(r->body).along) all.push_back(id);
  };
  for (const AnyId id : ctx.edit().touched()) {
    keep(id);
    if (id.kind != Kind::solid || !now.find(id)) continue;
    for (const AnyId user : now.referrers(id)) keep(user);
  }
  std::sort(all.begin(), all.end());
  all.erase(std::unique(all.begin(), all.end()), all.end());
  return all;
}

class EdgeFollower {
 public:
  explicit EdgeFollower(CommandContext& ctx)
      : ctx_(ctx), edits_(ctx.edit()), before_(edits_.before()) {}

  Result<void> run(const std::vector<AnyId>& followers) {
    for (const AnyId id : followers) {
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

Result<void> follow_edges(CommandContext& ctx) {
  const std::vector<AnyId> followers = followers_of(ctx);
  return followers.empty() ? Result<void>() : EdgeFollower(ctx).run(followers);
}

namespace {

const RoomFile kFollowedEdgesPart({.before_commit = follow_edges});

}  // namespace

}  // namespace robomosp::ioci
