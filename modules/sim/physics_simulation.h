// SPDX-License-Identifier: Apache-2.0
// The parts of a contact physics run: its bodies, its planned actions, the run itself, its
// recording (layer: application, sim). Internal to modules/sim/physics*.cpp.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "kernel/text.h"
#include "sim/index.h"
#include "sim/motion_reference.h"
#include "sim/physics.h"
#include "sim/physics_actor.h"

namespace robomosp::sim {

/// An object of the world.
struct PhysicsThing {
  std::string name;
  std::int32_t body = 0;
  bool is_movable = false;
  std::array<double, 4> quaternion{};  ///< last recorded value
};

/// The time when an action begins.
struct PhysicsEvent {
  double time = 0;
  std::int64_t tick = 0;
  std::size_t action = 0;
};
/// An object held by a robot.
struct PhysicsHeld {
  std::int32_t attachment = 0, object = 0, link = 0;
  std::size_t actor = 0;
};

/// An object that a robot carries without the engine moving it, or that must be attached at the
/// start.
struct PhysicsCarried {
  std::size_t actor = 0;
  std::int32_t joint = -1, object = 0;  ///< of the actor, -1 = its base; a body
  Pose joint_T_object;
};

/// A body that is pulled.
struct PhysicsPulled {
  std::size_t body = 0;
  Vec3 point{};  ///< in its frame [m]
  PullSpring spring;
};

class PhysicsSimulation {
 public:
  PhysicsSimulation(const Simulator& sim, const PhysicsRun& run, RowSink* sink,
                    const RunState* from)
      : sim_(sim), run_(run), sink_(sink), from_(from) {}

  Result<recording::RecordingPtr> operator()(Progress& progress);

 private:
  friend class SteppedPhysics;  // the same world, stepped by a caller
  using Actor = PhysicsActor;
  using Thing = PhysicsThing;
  using Event = PhysicsEvent;
  using Held = PhysicsHeld;
  using Kind = PhysicsAction::Kind;
  using RecordingPtr = recording::RecordingPtr;
  using ShapePiece = evaluation::ShapePiece;

  // ---- bodies (physics_build.cpp) ----

  Result<void> check_times();
  /// Adds a body with its shapes, which are kept as long as the world.
  PhysicsBody& add_body(std::vector<ShapePiece> pieces, const Pose& pose);
  Result<void> add_objects(Progress& progress);
  /// State of a movable object before the world was edited.
  [[nodiscard]] const RunState::Body* before_of(const std::string& name) const;
  Result<void> add_robots(Progress& progress);
  Result<void> create();
  /// Restores grasps from before the world was edited, as far as the objects exist.
  Result<void> hold_again();
  /// Places objects held at the start (world.attach) at their poses in the robots.
  Result<void> place_attached();
  Result<void> hold_attached();
  /// Attaches an object to a link.
  Result<void> hold(std::size_t actor, std::int32_t link, std::int32_t object);
  /// Disables contact of pairs of links that collision checks skip.
  Result<void> pass_over(const Actor& a, Progress& progress);
  Result<void> add_bodies(Actor& a, std::size_t number, Progress& progress);
  /// Sets joints simulated by the engine to their values before the world was edited, the others to
  /// those of their path.
  static void carry_over(Actor& a, const RunState::Robot& before,
                         const MotionReference::Sample& path);

  // ---- actions (physics_plan.cpp) ----

  Result<void> plan(Progress& progress);
  /// Returns its end time.
  Result<double> plan_one(const PhysicsAction& action, std::size_t number, double begin,
                          const std::string& robot, Progress& progress);
  static Error is_limp(const std::string& robot);
  struct PlacedName {
    std::string name;
  };
  Result<double> plan_move(Actor& a, const PhysicsAction& action, double begin, Progress& progress);
  /// The quintic's greatest velocity is 15/8 of the mean one.
  static double least_duration(const Actor& a, std::span<const double> to);
  [[nodiscard]] static Result<std::int32_t> tip_of(const Actor& a, const std::string& tool);

  // ---- the run (physics.cpp) ----

  Result<void> read();
  [[nodiscard]] std::string body_name(std::size_t body) const;
  /// Adds the name to an engine's error about "body 3".
  [[nodiscard]] Error named(Error e) const;
  Result<void> go(Progress& progress);
  /// Moves massless objects with their carriers from t to `end`.
  Result<void> carry(double t, double end);
  /// Applies the pulls of a live run to the step from t to `end` (physics_pull.cpp).
  Result<void> pull(double t, double end);
  /// Finds the bodies that are pulled from t on.
  void find_pulled(double t, double end);
  [[nodiscard]] std::optional<PhysicsPulled> pulled_body(const Pull& pull, double dt) const;
  /// The engine's step from t to `end`, after robots and forces are set.
  Result<void> step(double t, double end, Progress& progress);
  Result<void> act(const Event& event);

  // ---- the recording (physics_recording.cpp) ----

  std::size_t add_column(std::string name, std::string unit, std::string doc);
  /// Notes properties of the world that the engine does not support.
  void note_differences();
  /// Notes for the first step: bodies that initially penetrate each other.
  void note_meshes();
  void note_overlaps();
  /// Adds the engine's new notes.
  Result<void> note_engine();
  void prepare_columns();
  void add_robot_columns(const Actor& a, const std::string& prefix);
  Result<void> sample(double t);
  /// State from which a run can continue.
  [[nodiscard]] RunStatePtr state(double t) const;
  /// Name of the joint that an entry of tau belongs to.
  static std::string name_of_entry(const Actor& a, std::size_t entry);
  Result<RecordingPtr> record();

  template <class Members>
  [[nodiscard]] Result<std::size_t> find(const Members& all, std::string_view kind,
                                         const std::string& name) const {
    for (std::size_t i = 0; i < all.size(); ++i)
      if (all[i].name == name) return i;
    return is_missing(all, kind, name);
  }

  template <class Members>
  [[nodiscard]] static Error is_missing(const Members& all, std::string_view kind,
                                        const std::string& name) {
    std::vector<std::string> names;
    for (const auto& member : all) names.push_back(member.name);
    std::string hint = text::did_you_mean(name, names);
    if (hint.empty())
      hint =
          names.empty() ? "It has none; add one first." : "It has " + text::enumerate(names) + ".";
    return error(ErrorCode::unknown_name,
                 "the world has no " + std::string(kind) + " " + text::quote(name), hint);
  }

  [[nodiscard]] double time_of(std::int64_t tick) const {
    return std::min(static_cast<double>(tick) * run_.step, duration_);
  }

  const Simulator& sim_;
  const PhysicsRun& run_;
  RowSink* sink_;
  const RunState* from_;
  std::unordered_map<std::string_view, std::size_t> before_;  ///< objects of from_ by their names
  const model::World* world_record_ = nullptr;
  std::vector<PhysicsBody> bodies_;
  std::vector<std::vector<ShapePiece>> pieces_;  ///< keeps the meshes
  std::vector<PhysicsJoint> joints_;
  std::vector<Thing> things_;  ///< object i is body i
  std::vector<Actor> actors_;
  std::vector<Event> events_;
  std::map<std::size_t, std::size_t> actor_of_;  ///< of grasps, grips and releases
  std::map<std::size_t, std::size_t> grip_of_;   ///< of grips, in their actor
  std::vector<Held> held_;
  std::vector<PhysicsCarried> attached_;  ///< at the start
  std::vector<PhysicsCarried> carried_;   ///< objects that the engine does not move
  double last_end_ = 0, duration_ = 0;
  std::int64_t first_ = 0, ticks_ = 0, every_ = 1;
  std::string provider_;
  std::unique_ptr<PhysicsWorld> world_;
  std::vector<Pose> poses_;
  std::vector<Vec3> velocities_, angular_velocities_;
  std::vector<double> joint_q_, joint_qd_, forces_;
  std::vector<PhysicsContact> contacts_;
  MotionReference::Sample wanted_;
  std::vector<const Actor*> recorded_;
  std::optional<PullsInForce> pulls_;
  std::vector<PhysicsPulled> pulled_;  ///< one per pull
  std::vector<std::string> inert_;
  std::size_t engine_notes_ = 0;        ///< number of the engine's notes in out_
  std::vector<std::string> untouched_;  ///< links without parts of designed robots
  recording::Recording out_;
};

}  // namespace robomosp::sim
