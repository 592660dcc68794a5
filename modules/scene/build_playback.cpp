// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <optional>
#include <utility>

#include "kernel/text.h"
#include "model/placement.h"
#include "scene/build.h"
#include "scene/ids.h"
#include "scene/posed_robot.h"
#include "spatial/pose.h"

namespace robomosp::scene {
namespace {

/// The items of a placed object.
struct ObjectParts {
  std::vector<std::uint64_t> ids;
  std::vector<Pose> placements;  ///< object_T_item

  void add_poses(const Pose& world_T_object, Playback& playback) const {
    for (const Pose& t : placements) playback.poses.push_back(spatial::compose(world_T_object, t));
  }
};

Result<ObjectParts> parts_of(const Source& source, const model::PlacedObject& placed,
                             Progress& progress) {
  ObjectParts out;
  const std::string where = "object " + text::quote(placed.name);
  RMP_TRY_ASSIGN(const auto parts,
                 source.derived.drawables(source.snapshot, placed.what, progress).in(where));
  for (std::size_t i = 0; i < parts.size(); ++i) {
    out.ids.push_back(item_id("object " + placed.name, 0, i));
    out.placements.push_back(parts[i].placement);
  }
  return out;
}

/// How the bodies and the tool of a robot move along columns `<prefix>q1` and so on.
struct MovingRobot {
  /// Parts of an object that it holds.
  struct Held {
    robotics::LinkFrame at;
    ObjectParts parts;
  };
  std::string owner;
  PosedRobot robot;
  std::vector<const recording::Column*> q;
  std::vector<Held> held = {};

  [[nodiscard]] const std::vector<std::vector<evaluation::Drawable>>& drawn() const {
    return robot.base().bodies.bodies;
  }
  void add_ids(Playback& playback) const {
    for (std::size_t b = 0; b < drawn().size(); ++b)
      for (std::size_t p = 0; robot.base().shows(b) && p < drawn()[b].size(); ++p)
        playback.ids.push_back(item_id(owner, b, p));
    playback.ids.push_back(item_id(owner, kToolBody, 0));
    for (const Held& h : held)
      playback.ids.insert(playback.ids.end(), h.parts.ids.begin(), h.parts.ids.end());
  }
  void add_poses(std::size_t row, Playback& playback) {
    sample.resize(q.size());
    for (std::size_t j = 0; j < q.size(); ++j) sample[j] = q[j]->values[row];
    robot.pose(sample, bodies);
    for (std::size_t b = 0; b < drawn().size(); ++b)
      for (std::size_t p = 0; robot.base().shows(b) && p < drawn()[b].size(); ++p)
        playback.poses.push_back(spatial::compose(bodies[b], drawn()[b][p].placement));
    playback.poses.push_back(bodies.back());
    for (const Held& h : held) h.parts.add_poses(robot.place(h.at), playback);
  }
  std::vector<double> sample = {};
  std::vector<Pose> bodies = {};
};

/// An object that moves along columns `<name>.x` and so on, as contact physics records them.
struct MovingObject : ObjectParts {
  std::array<const recording::Column*, 7> at{};  ///< recording::kPlaceColumns

  void add_poses(std::size_t row, Playback& playback) const {
    std::array<double, 7> place{};
    for (std::size_t k = 0; k < place.size(); ++k) place[k] = at[k]->values[row];
    ObjectParts::add_poses(recording::pose_of_place(place), playback);
  }
};

Result<std::optional<MovingObject>> moving_object(const Source& source,
                                                  const model::PlacedObject& placed,
                                                  const recording::Recording& recording,
                                                  Progress& progress) {
  MovingObject out;
  for (std::size_t k = 0; k < out.at.size(); ++k) {
    out.at[k] = recording.find(placed.name + recording::kPlaceColumns[k]);
    if (!out.at[k]) return std::optional<MovingObject>{};
  }
  RMP_TRY_ASSIGN(auto parts, parts_of(source, placed, progress));
  static_cast<ObjectParts&>(out) = std::move(parts);
  return std::optional(std::move(out));
}

}  // namespace

Result<Playback> build_playback(const Source& source, WorldId id,
                                const recording::Recording& recording, Progress& progress) {
  const model::World* world = source.snapshot.get(id);
  if (!world)
    return error(ErrorCode::stale_handle, "the world no longer exists", "Open or create one.");
  std::vector<MovingRobot> robots;
  bool is_found = recording.robot.empty();
  for (const model::PlacedRobot& placed : world->robots) {
    // Further robots have their columns under their names.
    const bool is_main = placed.name == recording.robot;
    const std::string prefix = is_main ? "" : placed.name + ".";
    is_found = is_found || is_main;
    if (!is_main && !recording.find(prefix + "q1")) continue;
    RMP_TRY_ASSIGN(RobotBasePtr base, robot_base(source, placed.robot, progress));
    std::vector<const recording::Column*> q;
    for (std::size_t j = 0; j < base->model->coordinate_count(); ++j) {
      q.push_back(recording.find(prefix + "q" + std::to_string(j + 1)));
      if (!q.back() || (is_main && recording.dof != base->model->dof()))
        return error(ErrorCode::conflict, "the recording was made from a robot with other joints",
                     "Simulate again.");
    }
    robots.push_back(
        {placed.name, PosedRobot(std::move(base), model::pose(placed.placement)), std::move(q)});
  }
  if (!is_found)
    return error(ErrorCode::unknown_name,
                 "the world has no robot " + text::quote(recording.robot) + " any more",
                 "Simulate again.");
  std::vector<MovingObject> objects;
  for (const model::PlacedObject& placed : world->objects) {
    RMP_TRY_ASSIGN(auto object, moving_object(source, placed, recording, progress));
    if (object) {
      objects.push_back(std::move(*object));
      continue;
    }
    // What the recording does not tell goes with the robot that holds it.
    const auto a = std::find_if(world->attachments.begin(), world->attachments.end(),
                                [&](const auto& x) { return x.object == placed.name; });
    if (a == world->attachments.end()) continue;
    for (MovingRobot& r : robots) {
      if (r.owner != a->robot) continue;
      RMP_TRY_ASSIGN(const auto at, r.robot.grip_of(*a));
      RMP_TRY_ASSIGN(auto parts, parts_of(source, placed, progress));
      r.held.push_back({at, std::move(parts)});
    }
  }
  Playback playback;
  playback.times = recording.columns.front().values;
  for (const MovingRobot& r : robots) r.add_ids(playback);
  for (const MovingObject& o : objects)
    playback.ids.insert(playback.ids.end(), o.ids.begin(), o.ids.end());
  playback.poses.reserve(playback.times.size() * playback.ids.size());
  for (std::size_t i = 0; i < playback.times.size(); ++i) {
    for (MovingRobot& r : robots) r.add_poses(i, playback);
    for (const MovingObject& o : objects) o.add_poses(i, playback);
  }
  return playback;
}

}  // namespace robomosp::scene
