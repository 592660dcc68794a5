// SPDX-License-Identifier: Apache-2.0
#include "scene/path_shape.h"

#include <algorithm>
#include <array>
#include <set>
#include <span>
#include <utility>

#include "kernel/text.h"
#include "model/placement.h"
#include "motion/cartesian_path.h"
#include "scene/ids.h"
#include "sim/simulate.h"
#include "sim/trajectory_faults.h"
#include "spatial/pose.h"
#include "spatial/vec.h"

namespace robomosp::scene {
namespace {

constexpr std::size_t kLinePoints = 400;

/// Poses along a way, and the segment that each pair of neighbours is in (empty = not known).
struct Way {
  std::vector<Pose> poses;
  std::vector<std::int32_t> segments;
  std::vector<double> speeds = {};  ///< between each pair of neighbours [m/s]; empty = not known
};

/// The segment, from 0, that each pair of neighbouring times is in; empty if the pieces of the path
/// are not known.
template <class Pieces>
std::vector<std::int32_t> segments_between(const Pieces& pieces, std::span<const double> times) {
  std::vector<std::int32_t> out;
  std::size_t piece = 0;
  for (std::size_t i = 0; !pieces.empty() && i + 1 < times.size(); ++i) {
    const double middle = 0.5 * (times[i] + times[i + 1]);
    while (piece + 1 < pieces.size() && pieces[piece + 1].start <= middle) ++piece;
    out.push_back(static_cast<std::int32_t>(pieces[piece].number) - 1);
  }
  return out;
}

Result<Way> path_way(const Source& source, const std::string& name, const model::Trajectory& t) {
  RMP_TRY_ASSIGN(const auto path,
                 motion::Path::build(source.registry, name, t, motion::stored_in(source.snapshot)));
  const auto times = path->sample_times(path->duration() / static_cast<double>(kLinePoints));
  std::vector<PathSample> samples(times.size());
  RMP_TRY(path->sample(times, samples));
  Way out;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    out.poses.push_back(samples[i].pose);
    if (i + 1 == samples.size()) break;
    out.speeds.push_back(
        0.5 * (spatial::norm(samples[i].velocity) + spatial::norm(samples[i + 1].velocity)));
  }
  out.segments = segments_between(path->pieces(), times);
  return out;
}

Result<Way> tool_way(const Source& source, WorldId world, PosedRobot robot,
                     const std::string& robot_name, const std::string& trajectory,
                     Progress& progress) {
  const sim::Simulator simulator{source.registry, source.derived, source.snapshot};
  sim::Run run;
  run.world = world;
  run.robot = robot_name;
  run.trajectory = trajectory;
  RMP_TRY_ASSIGN(const auto recording, simulator.inverse_kinematics(run, progress));
  const std::size_t count = robot.base().model->coordinate_count();
  std::vector<const recording::Column*> columns;
  for (std::size_t j = 0; j < count; ++j)
    columns.push_back(recording->find("q" + std::to_string(j + 1)));
  Way out;
  std::vector<Pose> bodies;
  std::vector<double> q(count);
  for (std::size_t i = 0; i < recording->rows(); ++i) {
    for (std::size_t j = 0; j < count; ++j) q[j] = columns[j]->values[i];
    robot.pose(q, bodies);
    out.poses.push_back(bodies.back());
    if (i == 0) continue;
    const auto& times = recording->columns.front().values;
    const double step = times[i] - times[i - 1];
    const double length = spatial::distance(out.poses[i].p, out.poses[i - 1].p);
    out.speeds.push_back(step > 0 ? length / step : 0.0);
  }
  return out;
}

/// Colours of speeds, the lowest first.
constexpr std::array<Colour, 5> kSpeedColours{{{0.16F, 0.33F, 0.80F, 1},
                                               {0.10F, 0.62F, 0.70F, 1},
                                               {0.20F, 0.62F, 0.20F, 1},
                                               {0.95F, 0.65F, 0.05F, 1},
                                               {0.85F, 0.12F, 0.10F, 1}}};

/// The path in bands of speed, and what their colours mean.
void add_speed_lines(const Way& way, const std::string& member, std::int32_t body, Shape& out) {
  const auto [low, high] = std::minmax_element(way.speeds.begin(), way.speeds.end());
  const double range = *high - *low;
  const std::size_t bands = range > 1e-6 * *high ? kSpeedColours.size() : 1;
  const auto band = [&](std::size_t i) {
    const double share = bands > 1 ? (way.speeds[i] - *low) / range : 0.0;
    return std::min(static_cast<std::size_t>(share * static_cast<double>(bands)), bands - 1);
  };
  std::vector<bool> is_used(bands, false);
  for (std::size_t i = 0; i < way.speeds.size();) {
    const std::size_t now = band(i);
    is_used[now] = true;
    Element<render::Line> e;
    e.what.colour = kSpeedColours[now];
    e.what.width = 4;
    e.what.points.push_back(way.poses[i].p);
    e.body = body;
    e.group = kLineBody + 8;
    e.number = static_cast<std::uint32_t>(i);
    std::vector<std::int32_t> segments;
    for (; i < way.speeds.size() && band(i) == now; ++i) {
      e.what.points.push_back(way.poses[i + 1].p);
      if (i < way.segments.size()) segments.push_back(way.segments[i]);
    }
    out.lines.push_back(std::move(e));
    out.segments.push_back(std::move(segments));
  }
  Element<render::Legend> legend;
  legend.group = kLineBody + 8;
  legend.what.title = member + " [mm/s]";
  for (std::size_t b = 0; b < bands; ++b) {
    const double share = (static_cast<double>(b) + 0.5) / static_cast<double>(bands);
    legend.what.colours.push_back(kSpeedColours[b]);
    legend.what.ticks.push_back({share, text::print_rounded(1000 * (*low + share * range), 3)});
  }
  out.legends.push_back(std::move(legend));
}

/// From what path_lines.h draws to elements that know what they stand for.
void add_elements(const Way& way, const std::string& member, const Extras& extras,
                  std::int32_t body, Shape& out) {
  if (way.poses.empty()) return;
  const ShownPath shown = extras.paths;
  render::Scene drawn;
  std::vector<std::size_t> arrows;
  add_path(drawn, member, way.poses, shown, &arrows);
  const auto segment_at = [&](std::size_t i) {
    return i < way.segments.size() ? way.segments[i] : -1;
  };
  const bool is_by_speed = extras.path_speeds && !way.speeds.empty();
  if (is_by_speed) add_speed_lines(way, member, body, out);
  for (render::Line& line : drawn.lines) {
    if (is_by_speed) continue;
    Element<render::Line> e;
    e.what = std::move(line);
    e.what.id = 0;
    e.body = body;
    e.group = kLineBody;
    out.lines.push_back(std::move(e));
    out.segments.push_back(way.segments);
  }
  for (std::size_t k = 0; k < drawn.items.size(); ++k) {
    Element<render::Item> e;
    e.what = std::move(drawn.items[k]);
    e.what.id = 0;
    e.what.name.clear();
    e.body = body;
    e.group = kLineBody + 2;
    e.number = static_cast<std::uint32_t>(k);
    e.of.segment = segment_at(arrows[k]);
    out.items.push_back(std::move(e));
  }
}

void add_point_elements(const Source& source, const model::PlacedTrajectory& placed,
                        const Pose& body_T_trajectory, double size, bool has_frames,
                        std::int32_t body, Shape& out) {
  render::Scene drawn;
  std::vector<PointOf> points;
  add_points(drawn, placed.name, *source.snapshot.get(placed.trajectory), body_T_trajectory,
             motion::stored_in(source.snapshot), size, has_frames, &points);
  const auto tell = [&](auto& e, std::uint32_t group, std::size_t k) {
    e.body = body;
    e.group = group;
    e.number = static_cast<std::uint32_t>(k);
    e.of.segment = points[k].segment;
    e.of.point = points[k].point;
  };
  for (std::size_t k = 0; k < drawn.items.size(); ++k) {
    Element<render::Item> e;
    e.what = std::move(drawn.items[k]);
    e.what.id = 0;
    e.what.name.clear();
    tell(e, kLineBody + 3, k);
    out.items.push_back(std::move(e));
  }
  for (std::size_t k = 0; k < drawn.triads.size(); ++k) {
    Element<render::Triad> e;
    e.what = std::move(drawn.triads[k]);
    e.what.id = 0;
    tell(e, kLineBody + 4, k);
    out.triads.push_back(std::move(e));
  }
  for (std::size_t k = 0; k < drawn.labels.size(); ++k) {
    Element<render::Label> e;
    e.what = std::move(drawn.labels[k]);
    tell(e, kLineBody + 7, k);
    out.labels.push_back(std::move(e));
  }
}

}  // namespace

bool moves_joints(const document::Snapshot& snapshot, TrajectoryId id) {
  std::set<TrajectoryId> seen;
  std::vector<TrajectoryId> open{id};
  while (!open.empty()) {
    const TrajectoryId at = open.back();
    open.pop_back();
    const model::Trajectory* t = seen.insert(at).second ? snapshot.get(at) : nullptr;
    if (!t) continue;
    for (const model::TrajectorySegment& s : t->segments) {
      if (!s.joints.empty()) return true;
      if (s.stored) open.push_back(s.stored);
    }
  }
  return false;
}

Result<ShapePtr> path_shape(const Source& source, const model::PlacedTrajectory& placed,
                            const Extras& extras) {
  auto shape = std::make_shared<Shape>();
  const model::Trajectory* record = source.snapshot.get(placed.trajectory);
  if (!record) {
    shape->failure =
        error(ErrorCode::stale_handle, "the trajectory no longer exists", "Add it again.");
    return ShapePtr(std::move(shape));
  }
  auto way = path_way(source, placed.name, *record);
  if (!way.ok()) {
    if (way.error().code == ErrorCode::cancelled || way.error().code == ErrorCode::unsupported)
      return std::move(way).error();
    shape->failure = std::move(way).error();
    return ShapePtr(std::move(shape));
  }
  add_elements(*way, placed.name, extras, 0, *shape);
  if (extras.paths >= ShownPath::points)
    add_point_elements(source, placed, Pose{}, size_of(way->poses),
                       extras.paths >= ShownPath::frames, 0, *shape);
  return ShapePtr(std::move(shape));
}

Result<ShapePtr> tool_path_shape(const Source& source, WorldId world,
                                 const model::PlacedTrajectory& placed, const Extras& extras,
                                 const RobotBasePtr& robot, const model::PlacedRobot* where,
                                 Progress& progress) {
  auto shape = std::make_shared<Shape>();
  Way way;
  if (robot && where) {
    auto made = tool_way(source, world, PosedRobot(robot, model::pose(where->placement)),
                         where->name, placed.name, progress);
    if (!made.ok()) {
      if (made.error().code == ErrorCode::cancelled) return std::move(made).error();
      shape->failure = std::move(made).error();
      return ShapePtr(std::move(shape));
    }
    way = std::move(made).value();
  }
  add_elements(way, placed.name, extras, kWorldBody, *shape);
  if (extras.paths >= ShownPath::points)
    add_point_elements(source, placed, model::pose(placed.placement), size_of(way.poses),
                       extras.paths >= ShownPath::frames, kWorldBody, *shape);
  return ShapePtr(std::move(shape));
}

Result<ShapePtr> checked_path_shape(const Source& source, WorldId world,
                                    const model::PlacedTrajectory& placed, const Extras& extras,
                                    const model::PlacedRobot& robot, Progress& progress) {
  auto shape = std::make_shared<Shape>();
  const sim::Simulator simulator{source.registry, source.derived, source.snapshot,
                                 source.collision_models};
  sim::Run run;
  run.world = world;
  run.robot = robot.name;
  run.trajectory = placed.name;
  auto check = sim::check_path(simulator, run, extras.contacts, progress);
  if (!check.ok()) {
    if (check.error().code == ErrorCode::cancelled) return std::move(check).error();
    shape->failure = std::move(check).error();
    return ShapePtr(std::move(shape));
  }
  // Of joint motions the segments are not known.
  std::vector<std::int32_t> segment_of;
  if (!moves_joints(source.snapshot, placed.trajectory)) {
    const model::Trajectory& record = *source.snapshot.get(placed.trajectory);
    const auto path = motion::Path::build(source.registry, placed.name, record,
                                          motion::stored_in(source.snapshot));
    if (path.ok()) segment_of = segments_between((*path)->pieces(), check->times);
  }
  const auto segment_at = [&](std::size_t sample) {
    return segment_of.empty() ? -1 : segment_of[std::min(sample, segment_of.size() - 1)];
  };
  render::Scene drawn;
  MarkedSamples samples;
  mark_path(drawn, *check, &samples);
  std::uint32_t number = 0;  // all share a group
  const auto add = [&](auto& list, auto& from) {
    for (auto& what : from) {
      auto& e = list.emplace_back();
      e.what = std::move(what);
      e.body = kWorldBody;
      e.group = kLineBody + 5;
      e.number = number++;
    }
  };
  add(shape->items, drawn.items);
  add(shape->lines, drawn.lines);
  add(shape->labels, drawn.labels);
  add(shape->legends, drawn.legends);
  for (std::size_t k = 0; k < shape->items.size(); ++k) {
    auto& e = shape->items[k];
    e.what.id = 0;
    e.what.name.clear();
    e.of.segment = segment_at(samples.items[k]);
  }
  for (std::size_t k = 0; k < shape->lines.size(); ++k) {
    render::Line& line = shape->lines[k].what;
    line.id = 0;
    auto& segments = shape->segments.emplace_back();
    for (std::size_t i = 0; !segment_of.empty() && i + 1 < line.points.size(); ++i)
      segments.push_back(segment_at(samples.lines[k] + i));
  }
  if (extras.paths >= ShownPath::points)
    add_point_elements(source, placed, model::pose(placed.placement), size_of(check->poses),
                       extras.paths >= ShownPath::frames, kWorldBody, *shape);
  shape->left_out = std::move(check->notes);
  return ShapePtr(std::move(shape));
}

}  // namespace robomosp::scene
