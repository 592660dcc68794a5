// SPDX-License-Identifier: Apache-2.0
#include "scene/path_lines.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "kernel/text.h"
#include "model/placement.h"
#include "scene/ellipsoid.h"
#include "scene/ids.h"
#include "scene/shapes.h"
#include "spatial/pose.h"
#include "spatial/vec.h"

namespace robomosp::scene {
namespace {

constexpr Colour kPathColour{0.95F, 0.45F, 0.10F, 1.0F};
constexpr Colour kPointColour{0.16F, 0.20F, 0.28F, 1.0F};
constexpr std::size_t kArrows = 8;
constexpr int kDeepest = 16;  ///< stored trajectories within each other

/// In order of sim::PathState.
struct Mark {
  Colour colour;
  const char* text;
};
constexpr std::array<Mark, 4> kMarks{{{{0.13F, 0.58F, 0.22F, 1}, "good"},
                                      {{0.96F, 0.58F, 0.04F, 1}, "limit"},
                                      {{0.58F, 0.14F, 0.68F, 1}, "contact"},
                                      {{0.86F, 0.10F, 0.10F, 1}, "no reach"}}};

const Mark& mark_of(sim::PathState s) { return kMarks[static_cast<std::size_t>(s)]; }

/// Size of arrowheads and balls on a path [m].
double mark_size(double path_size) { return std::clamp(0.03 * path_size, 0.004, 0.05); }

/// Arrowheads at even distances along a way; `colour(i)` is that between points i and i + 1.
template <class Colours>
void add_arrows(render::Scene& scene, const std::string& member, std::span<const Pose> poses,
                Colours&& colour) {
  double length = 0;
  std::vector<double> at{0};
  for (std::size_t i = 1; i < poses.size(); ++i) {
    length += spatial::distance(poses[i].p, poses[i - 1].p);
    at.push_back(length);
  }
  if (!(length > 0)) return;
  const double size = 1.6 * mark_size(size_of(poses));
  const auto mesh = cone(size, 0.32 * size);
  for (std::size_t k = 0; k < kArrows; ++k) {
    const double s = length * (static_cast<double>(k) + 0.5) / kArrows;
    const auto next =
        static_cast<std::size_t>(std::upper_bound(at.begin(), at.end(), s) - at.begin());
    if (next == 0 || next >= poses.size()) continue;
    const Vec3 from = poses[next - 1].p, way = spatial::sub(poses[next].p, from);
    const double step = spatial::norm(way);
    if (!(step > 0)) continue;
    const Vec3 z = spatial::scale(way, 1 / step);
    Vec3 x = spatial::cross(std::abs(z[2]) < 0.9 ? Vec3{0, 0, 1} : Vec3{1, 0, 0}, z);
    x = spatial::scale(x, 1 / spatial::norm(x));
    const Vec3 y = spatial::cross(z, x);
    render::Item item;
    item.id = item_id(member, kLineBody + 2, k);
    item.name = member;
    item.mesh = mesh;
    item.pose.R = {x[0], y[0], z[0], x[1], y[1], z[1], x[2], y[2], z[2]};
    item.pose.p = spatial::add(from, spatial::scale(z, s - at[next - 1] - 0.5 * size));
    item.appearance = {colour(next - 1), 0.3F, 0.0F};
    const Colour& c = item.appearance.colour;
    item.appearance.emission = {0.5F * c.r, 0.5F * c.g, 0.5F * c.b, 1};
    scene.items.push_back(std::move(item));
  }
}

struct PointFactory {
  render::Scene& scene;
  const std::string& member;
  const motion::FindTrajectory& stored;
  double size;
  bool has_frames;
  std::vector<PointOf>* points;
  std::size_t count = 0;

  void add(const model::Trajectory& t, const Pose& world_T_trajectory, int depth) {
    for (std::size_t i = 0; i < t.segments.size(); ++i) {
      const model::TrajectorySegment& s = t.segments[i];
      if (depth == 0) of.segment = static_cast<std::int32_t>(i);
      for (std::size_t k = 0; k < s.points.size(); ++k) {
        of.point = depth == 0 ? static_cast<std::int32_t>(k) : -1;
        add(spatial::compose(world_T_trajectory, model::pose(s.points[k])));
      }
      const model::Record* inner = s.stored && stored ? stored(s.stored) : nullptr;
      if (inner && depth < kDeepest)
        add(std::get<model::Trajectory>(inner->body),
            spatial::compose(world_T_trajectory, model::pose(s.placement)), depth + 1);
    }
  }
  void add(const Pose& pose) {
    // Neighbours share the point where they meet.
    if (count > 0 && spatial::distance(pose.p, last) < 1e-9) return;
    last = pose.p;
    if (points) points->push_back(of);
    const double r = 0.45 * mark_size(size);
    scene.items.push_back(ellipsoid_item(item_id(member, kLineBody + 3, count), member, pose,
                                         {r, r, r}, kPointColour));
    const std::string number = std::to_string(++count);
    if (has_frames)
      scene.triads.push_back(
          {item_id(member, kLineBody + 4, count), pose, 2.5 * mark_size(size), number, false});
    else scene.labels.push_back({pose.p, number});
  }
  Vec3 last{};
  PointOf of{};
};

}  // namespace

double size_of(std::span<const Pose> poses) {
  if (poses.empty()) return 0;
  Vec3 low = poses[0].p, high = low;
  for (const Pose& pose : poses)
    for (std::size_t i = 0; i < 3; ++i) {
      low[i] = std::min(low[i], pose.p[i]);
      high[i] = std::max(high[i], pose.p[i]);
    }
  return spatial::distance(high, low);
}

void add_path(render::Scene& scene, const std::string& member, std::span<const Pose> poses,
              ShownPath shown, std::vector<std::size_t>* arrows) {
  if (shown == ShownPath::none) return;
  render::Line line;
  line.id = item_id(member, kLineBody, 0);
  line.colour = kPathColour;
  for (const Pose& pose : poses) line.points.push_back(pose.p);
  scene.lines.push_back(std::move(line));
  if (shown >= ShownPath::arrows)
    add_arrows(scene, member, poses, [arrows](std::size_t before) {
      if (arrows) arrows->push_back(before);
      return kPathColour;
    });
}

void add_points(render::Scene& scene, const std::string& member, const model::Trajectory& t,
                const Pose& world_T_trajectory, const motion::FindTrajectory& stored, double size,
                bool has_frames, std::vector<PointOf>* points) {
  PointFactory{scene, member, stored, size, has_frames, points}.add(t, world_T_trajectory, 0);
}

void mark_path(render::Scene& scene, const sim::PathCheck& check, MarkedSamples* samples) {
  const std::string& member = check.trajectory;
  const std::uint64_t plain = item_id(member, kLineBody, 0);
  std::erase_if(scene.lines, [&](const render::Line& l) { return l.id == plain; });
  // A piece between two samples is as bad as the worse of them.
  const auto state = [&](std::size_t k) { return std::max(check.states[k], check.states[k + 1]); };
  for (std::size_t i = 0; i + 1 < check.poses.size();) {
    render::Line line;
    if (samples) samples->lines.push_back(i);
    line.id = item_id(member, kLineBody + 5, i);
    line.colour = mark_of(state(i)).colour;
    line.width = state(i) == sim::PathState::good ? 3.0F : 4.5F;
    line.points.push_back(check.poses[i].p);
    const sim::PathState now = state(i);
    for (; i + 1 < check.poses.size() && state(i) == now; ++i)
      line.points.push_back(check.poses[i + 1].p);
    scene.lines.push_back(std::move(line));
  }
  add_arrows(scene, member, check.poses, [&](std::size_t i) {
    if (samples) samples->items.push_back(i);
    return mark_of(state(i)).colour;
  });
  const double r = 0.5 * mark_size(size_of(check.poses));
  for (std::size_t k = 0; k < check.faults.size(); ++k) {
    const sim::PathFault& f = check.faults[k];
    if (f.is_start) continue;  // it is not on the way
    const Pose& at = check.poses[f.worst];
    if (samples) samples->items.push_back(f.worst);
    scene.items.push_back(ellipsoid_item(item_id(member, kLineBody + 6, k), member, at, {r, r, r},
                                         mark_of(f.kind).colour));
    scene.labels.push_back({at.p, "sample " + std::to_string(f.worst + 1)});
  }
  // Only the colours that the picture has.
  render::Legend legend;
  legend.title = member;
  std::vector<const Mark*> used;
  for (std::size_t s = 0; s < kMarks.size(); ++s)
    if (std::any_of(check.states.begin(), check.states.end(),
                    [&](sim::PathState x) { return static_cast<std::size_t>(x) == s; }))
      used.push_back(&kMarks[s]);
  for (std::size_t s = 0; s < used.size(); ++s) {
    legend.colours.push_back(used[s]->colour);
    legend.ticks.push_back(
        {(static_cast<double>(s) + 0.5) / static_cast<double>(used.size()), used[s]->text});
  }
  scene.legends.push_back(std::move(legend));
}

void mark_stretches(render::Scene& scene, const std::string& member,
                    std::span<const MarkedStretch> stretches, std::span<const MarkedPlace> places) {
  std::vector<Pose> all;
  render::Legend legend;
  legend.title = member;
  for (std::size_t i = 0; i < stretches.size(); ++i) {
    const MarkedStretch& s = stretches[i];
    render::Line line;
    line.id = item_id(member, kLineBody + 5, i);
    line.colour = s.colour;
    line.width = s.is_good ? 2.5F : 5.0F;
    for (const Pose& p : s.poses) line.points.push_back(p.p);
    all.insert(all.end(), s.poses.begin(), s.poses.end());
    if (line.points.size() > 1) scene.lines.push_back(std::move(line));
    const bool is_known =
        std::any_of(legend.ticks.begin(), legend.ticks.end(),
                    [&](const render::Legend::Tick& t) { return t.text == s.kind; });
    if (is_known) continue;
    legend.ticks.push_back({0, s.kind});
    legend.colours.push_back(s.colour);
  }
  const double r = 0.45 * mark_size(size_of(all));
  for (std::size_t k = 0; k < places.size(); ++k) {
    Pose at;
    at.p = places[k].at;
    scene.items.push_back(
        ellipsoid_item(item_id(member, kLineBody + 6, k), member, at, {r, r, r}, places[k].colour));
    if (!places[k].text.empty()) scene.labels.push_back({at.p, places[k].text});
  }
  const double count = static_cast<double>(legend.ticks.size());
  for (std::size_t k = 0; k < legend.ticks.size(); ++k)
    legend.ticks[k].share = (static_cast<double>(k) + 0.5) / count;
  if (!legend.ticks.empty()) scene.legends.push_back(std::move(legend));
}

}  // namespace robomosp::scene
