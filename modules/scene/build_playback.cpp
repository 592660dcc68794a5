// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <optional>
#include <span>
#include <utility>

#include "kernel/text.h"
#include "model/placement.h"
#include "scene/build.h"
#include "scene/frame.h"
#include "scene/posed_robot.h"
#include "scene/scene_model.h"
#include "spatial/pose.h"

namespace robomosp::scene {
namespace {

/// The items and axes of a member that move with its bodies, as the frame shows them.
class MovingElements {
 public:
  MovingElements() = default;
  explicit MovingElements(const MemberPtr& member) {
    const ShapePtr& shape = member->shape(ShapeLayer::bodies);
    if (!shape) return;
    const auto add = [&](ElementKind kind, const auto& list) {
      for (std::size_t i = 0; i < list.size(); ++i) {
        ids_.push_back(id_of({kind, ShapeLayer::bodies, static_cast<std::uint32_t>(i), member}));
        places_.emplace_back(static_cast<std::size_t>(list[i].body), list[i].what.pose);
      }
    };
    add(ElementKind::item, shape->items);
    add(ElementKind::triad, shape->triads);
  }
  void add_ids(Playback& playback) const {
    playback.ids.insert(playback.ids.end(), ids_.begin(), ids_.end());
  }
  /// `bodies`: world_T_body.
  void add_poses(std::span<const Pose> bodies, Playback& playback) const {
    for (const auto& [body, body_T_element] : places_)
      playback.poses.push_back(spatial::compose(bodies[body], body_T_element));
  }

 private:
  std::vector<std::uint64_t> ids_;
  std::vector<std::pair<std::size_t, Pose>> places_;  ///< body, body_T_element
};

/// How a robot, and what it holds, move along columns `<prefix>q1` and so on.
struct MovingRobot {
  struct Held {
    robotics::LinkFrame at;
    MovingElements elements;
  };
  std::string owner;
  PosedRobot robot;
  MovingElements elements;
  std::vector<const recording::Column*> q;
  std::vector<Held> held = {};
  std::vector<double> sample = {};
  std::vector<Pose> bodies = {};

  void add_ids(Playback& playback) const {
    elements.add_ids(playback);
    for (const Held& h : held) h.elements.add_ids(playback);
  }
  void add_poses(std::size_t row, Playback& playback) {
    sample.resize(q.size());
    for (std::size_t j = 0; j < q.size(); ++j) sample[j] = q[j]->values[row];
    robot.pose(sample, bodies);
    elements.add_poses(bodies, playback);
    for (const Held& h : held) {
      const Pose place = robot.place(h.at);
      h.elements.add_poses(std::span(&place, 1), playback);
    }
  }
};

/// An object that moves along columns `<name>.x` and so on, as contact physics records them.
struct MovingObject {
  MovingElements elements;
  std::array<const recording::Column*, 7> at{};  ///< recording::kPlaceColumns

  void add_poses(std::size_t row, Playback& playback) const {
    std::array<double, 7> place{};
    for (std::size_t k = 0; k < place.size(); ++k) place[k] = at[k]->values[row];
    const Pose world_T_object = recording::pose_of_place(place);
    elements.add_poses(std::span(&world_T_object, 1), playback);
  }
};

std::optional<std::array<const recording::Column*, 7>> place_columns(
    const std::string& object, const recording::Recording& recording) {
  std::array<const recording::Column*, 7> at{};
  for (std::size_t k = 0; k < at.size(); ++k) {
    at[k] = recording.find(object + recording::kPlaceColumns[k]);
    if (!at[k]) return std::nullopt;
  }
  return at;
}

MemberPtr member_named(const MemberList& list, const std::string& name) {
  const auto at =
      std::find_if(list.begin(), list.end(), [&](const MemberPtr& m) { return m->name == name; });
  return at == list.end() ? nullptr : *at;
}

}  // namespace

Result<Playback> build_playback(const Source& source, WorldId id,
                                const recording::Recording& recording, Progress& progress) {
  const model::World* world = source.snapshot.get(id);
  if (!world)
    return error(ErrorCode::stale_handle, "the world no longer exists", "Open or create one.");
  // The ids and the places of the elements are those of the picture.
  SceneModel model(source.derived, source.registry, id, source.collision_models);
  Wanted wanted;
  wanted.snapshot = std::make_shared<const document::Snapshot>(source.snapshot);
  wanted.extras.paths = ShownPath::none;
  RMP_TRY_ASSIGN(const FramePtr frame, model.update(wanted, Detail::exact, progress));
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
    const MemberPtr shown = member_named(frame->robots, placed.name);
    robots.push_back({placed.name, PosedRobot(std::move(base), model::pose(placed.placement)),
                      shown ? MovingElements(shown) : MovingElements(), std::move(q)});
  }
  if (!is_found)
    return error(ErrorCode::unknown_name,
                 "the world has no robot " + text::quote(recording.robot) + " any more",
                 "Simulate again.");
  std::vector<MovingObject> objects;
  for (std::size_t i = 0; i < world->objects.size(); ++i) {
    const std::string& name = world->objects[i].name;
    if (const auto at = place_columns(name, recording)) {
      objects.push_back({MovingElements(frame->bodies[i]), *at});
      continue;
    }
    // What the recording has no columns for moves with the robot that holds it.
    const auto a = std::find_if(world->attachments.begin(), world->attachments.end(),
                                [&](const auto& x) { return x.object == name; });
    if (a == world->attachments.end()) continue;
    for (MovingRobot& r : robots) {
      if (r.owner != a->robot) continue;
      RMP_TRY_ASSIGN(const auto at, r.robot.grip_of(*a));
      r.held.push_back({at, MovingElements(frame->bodies[i])});
    }
  }
  Playback playback;
  playback.times = recording.columns.front().values;
  for (const MovingRobot& r : robots) r.add_ids(playback);
  for (const MovingObject& o : objects) o.elements.add_ids(playback);
  playback.poses.reserve(playback.times.size() * playback.ids.size());
  for (std::size_t i = 0; i < playback.times.size(); ++i) {
    for (MovingRobot& r : robots) r.add_poses(i, playback);
    for (const MovingObject& o : objects) o.add_poses(i, playback);
  }
  return playback;
}

}  // namespace robomosp::scene
