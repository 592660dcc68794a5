// SPDX-License-Identifier: Apache-2.0
// What a SceneModel keeps between frames, and the steps of an update, each in a separate file
// (layer: application, scene). Internal to modules/scene.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "scene/build.h"
#include "scene/posed_robot.h"
#include "scene/same.h"
#include "scene/scene_model.h"
#include "scene/shape_store.h"

namespace robomosp::scene {

struct SceneModel::Impl {
  Impl(evaluation::Derived& d, const Registry& r, AnyId id, collision::CollisionCache* models);

  /// Which bodies touch, and how near others are.
  struct Proximity {
    /// Bodies that touch something by their robot (true) or object (false) and its name.
    std::map<std::pair<bool, std::string>, std::vector<std::int32_t>> touching;
    std::vector<MemberPtr> lines;        ///< of clearances
    std::optional<std::string> failure;  ///< why they are not known, a sentence
    bool is_outstanding = false;         ///< computed for an earlier frame
  };

  /// One update: from the last frame to the next.
  struct Work {
    const Wanted& wanted;
    Detail detail;
    Progress& progress;
    Source source;
    std::shared_ptr<Frame> next;
    std::unordered_set<AnyId> affected = {};  ///< records that are not as in the last frame
    bool is_anew = false;                     ///< nothing of the last frame can be kept
    bool has_other_extras = false;
    bool is_exact = true;                  ///< nothing is outstanding
    const model::World* before = nullptr;  ///< of the last frame; null = there was none
    const model::World* now = nullptr;
    std::map<std::string, Pose> held = {};  ///< world_T_object
    std::unordered_set<std::string> outstanding = {};
    const model::PlacedRobot* path_robot = nullptr;
    RobotBasePtr path_base = nullptr;
    Proximity proximity = {};
    /// Whether a shape of a record has to be looked up again.
    [[nodiscard]] bool is_touched(AnyId id) const {
      return is_anew || has_other_extras || affected.contains(id);
    }
  };
  /// A robot where it was last.
  struct RobotState {
    RobotBasePtr base;
    Pose world_T_mounting;
    std::vector<double> q;
    std::optional<PosedRobot> posed;
    MemberPtr member;  ///< as it was shown then; null = with other extras
  };

  Result<FramePtr> update(const Wanted&, Detail, Progress&);
  Result<void> show_alone(Work&);
  Result<void> show_world(Work&);
  // scene_objects.cpp
  [[nodiscard]] bool can_be_finer(const Work&, AnyId) const;
  Result<void> show_objects(Work&);
  void index_objects(Work&);
  Result<MemberPtr> object_member(Work&, const std::string& name, bool is_placed, AnyId object,
                                  const Pose& world_T_object, const MemberPtr& before);
  // scene_robots.cpp
  Result<void> show_robots(Work&);
  Result<MemberPtr> robot_member(Work&, const std::string& name, bool is_placed, RobotId,
                                 const Pose& world_T_mounting, const std::vector<double>& q);
  void hold_objects(Work&);
  Result<void> show_ghosts(Work&);
  // scene_paths.cpp
  void show_places(Work&);
  Result<void> show_trajectories(Work&);
  // scene_proximity.cpp
  Result<void> show_proximity(Work&);
  [[nodiscard]] Result<Proximity> proximity_of(Work&);
  void paint_touching(Work&);

  const AnyId what;
  collision::CollisionCache own_models;  ///< where none are given
  collision::CollisionCache& models;
  ShapeStore store;
  FramePtr frame;
  Extras extras;     ///< of `frame`
  MotionPtr motion;  ///< of `frame`
  bool is_forgotten = false;
  std::map<std::string, Pose> held;                ///< of `frame`
  std::map<std::string, RobotState> robot_states;  ///< robots by name
  std::unordered_set<AnyId> coarse;                ///< records with coarse shapes in `frame`
  std::unordered_set<std::string> outstanding;     ///< trajectories shown with an old path
  Proximity proximity;                             ///< of `frame`
  // The objects of the world of `indexed`:
  document::RecordPtr indexed;
  std::unordered_map<std::string, std::size_t> object_at;
  std::unordered_map<AnyId, std::vector<std::size_t>> users;
};

/// The layer of a member, for changing.
[[nodiscard]] inline ShapePtr& layer_of(Member& m, ShapeLayer layer) {
  return m.shapes[static_cast<std::size_t>(layer)];
}
/// A member's name over its box. `before`, if not null, is taken where it is the same.
[[nodiscard]] ShapePtr label_of(const Member& m, const Bounds& own_box, const MemberPtr& before);

}  // namespace robomosp::scene
