// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/frame_builder.h"

#include <algorithm>

#include "kernel/fingerprint.h"
#include "kernel/text.h"
#include "model/placement.h"
#include "motion/path.h"
#include "robotics/build_model.h"
#include "robotics/home.h"
#include "robotics/kinematics.h"
#include "spatial/pose.h"

namespace robomosp::viewer {
namespace {

using document::Drawable;
using document::Snapshot;

/// Stable across frames: the same member of the same world has the same id.
std::uint64_t item_id(std::string_view owner, std::size_t body, std::size_t part) {
  return Fingerprinter("item/1")
      .add(owner)
      .add(static_cast<std::int64_t>(body))
      .add(static_cast<std::int64_t>(part))
      .finish()
      .lo;
}

Item item_of(const Drawable& d, std::uint64_t id, std::string name, const Pose& world_T_parent) {
  Item item;
  item.id = id;
  item.name = std::move(name);
  item.mesh = d.mesh;
  item.pose = spatial::compose(world_T_parent, d.placement);
  item.appearance = {d.colour, static_cast<float>(d.shininess), static_cast<float>(d.metalness)};
  return item;
}

/// Joint values to show: the world's, else the pose "home", else zeros.
std::vector<double> shown_q(const model::Robot& robot, const std::vector<double>& given,
                            std::size_t dof) {
  std::vector<double> q = given.empty() ? robotics::home_joint_values(robot, dof) : given;
  q.resize(dof, 0.0);
  return q;
}

/// A robot ready to be posed.
struct PosedRobot {
  std::string owner;  ///< for ids and names
  const model::Robot* record = nullptr;
  std::shared_ptr<const RobotModel> model;
  document::RobotBodies bodies;
  std::vector<robotics::LinkFrame> links;
  Pose world_T_mounting, world_T_base;
  mutable std::vector<Pose> joint_frames, link_frames;

  /// world_T_body of every body (base first) and of the tool, for joint values q.
  void pose(std::span<const double> q, std::vector<Pose>& bodies_out, Pose& tool) const {
    robotics::forward_kinematics(*model, q, joint_frames);
    robotics::link_poses(links, joint_frames, link_frames);
    bodies_out.resize(bodies.bodies.size());
    bodies_out[0] = world_T_base;
    for (std::size_t i = 1; i < bodies_out.size(); ++i)
      bodies_out[i] = spatial::compose(world_T_base, link_frames[i - 1]);
    tool = spatial::compose(world_T_base, robotics::tip_pose(*model, 0, joint_frames));
  }
  [[nodiscard]] bool shows(std::size_t body) const {
    return body == 0 || record->links[body - 1].visible;
  }
  [[nodiscard]] std::string body_name(std::size_t body) const {
    return body == 0 ? owner + " base" : owner + " " + record->links[body - 1].name;
  }
  [[nodiscard]] std::uint64_t triad_id() const { return item_id(owner, 100000, 0); }
};

Result<PosedRobot> posed_robot(const Snapshot& snapshot, document::Derived& derived, RobotId id,
                               std::string owner, const Pose& world_T_mounting,
                               Progress& progress) {
  PosedRobot r;
  r.record = snapshot.get(id);
  if (!r.record)
    return error(ErrorCode::stale_handle, "the robot no longer exists", "Add it again.");
  RMP_TRY_ASSIGN(r.model, derived.robot_model(snapshot, id, {0, 0, -9.81}, progress));
  RMP_TRY_ASSIGN(r.bodies, derived.robot_bodies(snapshot, id, progress));
  r.owner = std::move(owner);
  r.links = robotics::link_frames(*r.record);
  r.world_T_mounting = world_T_mounting;
  r.world_T_base = spatial::compose(world_T_mounting, r.model->base);
  r.joint_frames.resize(r.model->dof());
  r.link_frames.resize(r.links.size());
  return r;
}

void add_robot(const PosedRobot& robot, std::span<const double> q, Frame& frame) {
  std::vector<Pose> bodies;
  Pose tool;
  robot.pose(q, bodies, tool);
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    if (!robot.shows(b)) continue;
    const auto& parts = robot.bodies.bodies[b];
    for (std::size_t p = 0; p < parts.size(); ++p)
      frame.items.push_back(
          item_of(parts[p], item_id(robot.owner, b, p), robot.body_name(b), bodies[b]));
  }
  double reach = 0;
  for (const auto& l : robot.record->links) reach += std::hypot(l.row.a, l.row.d);
  frame.triads.push_back({robot.triad_id(), tool, std::clamp(0.07 * reach, 0.03, 0.25), {}});
}

constexpr std::size_t kLinePoints = 400;

Result<Line> trajectory_line(const Registry& registry, const Snapshot& snapshot,
                             const model::PlacedTrajectory& placed) {
  const model::Trajectory* record = snapshot.get(placed.trajectory);
  if (!record)
    return error(ErrorCode::stale_handle, "the trajectory no longer exists", "Add it again.");
  RMP_TRY_ASSIGN(const auto path, motion::Path::build(registry, placed.name, *record));
  const auto times = path->sample_times(path->duration() / static_cast<double>(kLinePoints));
  std::vector<PathSample> samples(times.size());
  path->sample(times, samples);
  const Pose world_T_path = model::pose(placed.placement);
  Line line;
  line.id = item_id(placed.name, 200000, 0);
  for (const auto& s : samples) line.points.push_back(spatial::transform(world_T_path, s.pose.p));
  return line;
}

}  // namespace

Result<Frame> build_frame(const WorldView& view, std::vector<std::string>& left_out,
                          Progress& progress) {
  const model::World* world = view.snapshot.get(view.world);
  if (!world)
    return error(ErrorCode::stale_handle, "the world no longer exists", "Open or create one.");
  Frame frame;
  const auto skip = [&](Error e) -> Result<void> {
    if (e.code == ErrorCode::cancelled) return e;
    left_out.push_back(e.sentence());
    return {};
  };
  for (const auto& o : world->objects) {
    auto parts = view.derived.drawables(view.snapshot, o.what, progress);
    if (!parts.ok()) {
      RMP_TRY(skip(std::move(parts).error()));
      continue;
    }
    for (std::size_t p = 0; p < parts->size(); ++p)
      frame.items.push_back(item_of((*parts)[p], item_id("object " + o.name, 0, p), o.name,
                                    model::pose(o.placement)));
  }
  for (const auto& r : world->robots) {
    auto robot = posed_robot(view.snapshot, view.derived, r.robot, r.name, model::pose(r.placement),
                             progress);
    if (!robot.ok()) {
      RMP_TRY(skip(std::move(robot).error()));
      continue;
    }
    add_robot(*robot, shown_q(*robot->record, r.q, robot->model->dof()), frame);
  }
  for (const auto& t : world->trajectories) {
    auto line = trajectory_line(view.registry, view.snapshot, t);
    if (line.ok()) frame.lines.push_back(std::move(line).value());
    else RMP_TRY(skip(std::move(line).error()));
  }
  return frame;
}

Result<Playback> build_playback(const WorldView& view, const sim::Recording& recording,
                                Progress& progress) {
  const model::World* world = view.snapshot.get(view.world);
  if (!world)
    return error(ErrorCode::stale_handle, "the world no longer exists", "Open or create one.");
  const auto placed = std::find_if(world->robots.begin(), world->robots.end(),
                                   [&](const auto& r) { return r.name == recording.robot; });
  if (placed == world->robots.end())
    return error(ErrorCode::unknown_name,
                 "the world has no robot " + text::quote(recording.robot) + " any more",
                 "Simulate again.");
  RMP_TRY_ASSIGN(const PosedRobot robot,
                 posed_robot(view.snapshot, view.derived, placed->robot, placed->name,
                             model::pose(placed->placement), progress));
  const std::size_t dof = robot.model->dof();
  std::vector<const sim::Column*> q;
  for (std::size_t j = 0; j < dof; ++j) {
    q.push_back(recording.find("q" + std::to_string(j + 1)));
    if (!q.back() || recording.dof != dof)
      return error(ErrorCode::conflict, "the recording was made from a robot with other joints",
                   "Simulate again.");
  }
  Playback playback;
  playback.times = recording.columns.front().values;
  for (std::size_t b = 0; b < robot.bodies.bodies.size(); ++b)
    for (std::size_t p = 0; robot.shows(b) && p < robot.bodies.bodies[b].size(); ++p)
      playback.ids.push_back(item_id(robot.owner, b, p));
  playback.ids.push_back(robot.triad_id());
  playback.poses.reserve(playback.times.size() * playback.ids.size());
  std::vector<Pose> bodies;
  std::vector<double> sample(dof);
  Pose tool;
  for (std::size_t i = 0; i < playback.times.size(); ++i) {
    for (std::size_t j = 0; j < dof; ++j) sample[j] = q[j]->values[i];
    robot.pose(sample, bodies, tool);
    for (std::size_t b = 0; b < bodies.size(); ++b)
      for (std::size_t p = 0; robot.shows(b) && p < robot.bodies.bodies[b].size(); ++p)
        playback.poses.push_back(spatial::compose(bodies[b], robot.bodies.bodies[b][p].placement));
    playback.poses.push_back(tool);
  }
  return playback;
}

Result<Frame> build_frame(const Snapshot& snapshot, document::Derived& derived, AnyId id,
                          Progress& progress) {
  Frame frame;
  const model::Record* record = snapshot.find(id);
  if (!record)
    return error(ErrorCode::stale_handle, "the record no longer exists", "Open or create one.");
  if (id.kind == Kind::robot) {
    RMP_TRY_ASSIGN(const PosedRobot robot, posed_robot(snapshot, derived, RobotId{id.number},
                                                       record->name, Pose{}, progress));
    add_robot(robot, shown_q(*robot.record, {}, robot.model->dof()), frame);
    return frame;
  }
  RMP_TRY_ASSIGN(const auto parts, derived.drawables(snapshot, id, progress));
  for (std::size_t p = 0; p < parts.size(); ++p)
    frame.items.push_back(item_of(parts[p], item_id(record->name, 0, p), parts[p].name, Pose{}));
  return frame;
}

}  // namespace robomosp::viewer
