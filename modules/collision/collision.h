// SPDX-License-Identifier: Apache-2.0
// Collision of a world or robot: its bodies, the pairs worth a check, distances, checks of whole
// joint paths, and the clearance with its gradient (layer: application).
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <robomosp/sdk/collision.h>
#include <robomosp/sdk/collision_bounds.h>
#include <robomosp/sdk/ik.h>
#include <robomosp/sdk/progress.h>
#include <robomosp/sdk/result.h>

#include "collision/broad_phase.h"
#include "collision/cover.h"
#include "evaluation/sources.h"
#include "recording/recording.h"

namespace robomosp::collision {

/// A rigid body: a placed object, a robot's base or a link, or what a robot holds.
struct CollisionBody {
  std::string name;         ///< "table", "arm.forearm", "arm.base"; of a robot alone "forearm"
  std::int32_t robot = -1;  ///< index into robots(); -1 = an object that none holds
  std::int32_t joint = -1;  ///< that carries it; -1 = none: it stands still
  Pose placement;           ///< joint_T_body, or world_T_body of what stands still
  double reach = 0;         ///< of its shapes from the joint's origin, a bound [m]
  bool is_held = false;     ///< an object in a robot's hand
};

/// A robot and where its coordinates are in a configuration of all.
struct CollisionRobot {
  std::string name;
  RobotId record;
  std::shared_ptr<const RobotModel> model;
  Pose world_T_base;
  std::vector<double> shown;  ///< its configuration in the world
  std::size_t first = 0;      ///< of its coordinate_count() entries
};

/// Why a pair is not checked.
enum class PairReason : std::uint8_t {
  adjacent,  ///< nothing but one joint (or links without shapes) between them
  always,    ///< they touch in every sampled configuration
  rule,      ///< the record says so (model::CollisionPairRule)
};
struct PassedPair {
  CollisionPair pair;  ///< indices of bodies
  PairReason reason = PairReason::adjacent;
  std::string text;  ///< of a rule: its reason
};

/// A pair that is too near, and where.
struct Contact {
  CollisionPair pair;
  PairDistance at;
};
/// First contact on a joint path.
struct PathContact {
  std::size_t segment = 0;  ///< between waypoints `segment` and `segment` + 1
  double share = 0;         ///< of the way along it, 0..1
  Contact contact;
};

/// What of sampled configurations says that a pair need not be checked.
struct SampledPair {
  CollisionPair pair;
  bool always = false;  ///< touches in all samples; false = in none
};

/// What robots hold, and where other objects are, instead of as the world says.
struct ObjectPlaces {
  std::vector<recording::Load> held;
  std::map<std::string, Pose> moved;  ///< world_T_object by name
};

/// The order of CollisionModel::pairs().
[[nodiscard]] inline bool comes_before(const CollisionPair& x, const CollisionPair& y) {
  return x.a != y.a ? x.a < y.a : x.b < y.b;
}

/// A clearance that remembers when it could not be told: whoever gave it to a solver asks
/// afterwards, since a solver only sees numbers and takes such configurations for clear.
class AskedClearance : public ClearanceField {
 public:
  /// The first failure since it was made: of the collision provider, or that it was cancelled.
  [[nodiscard]] virtual Result<void> outcome() const = 0;
};

/// Immutable; any thread may query it. A configuration holds the coordinates of all robots one
/// after the other.
class CollisionModel {
 public:
  /// Objects among themselves and with robots' bases, which never move, are checked only where a
  /// rule that names both forbids them to touch. What a robot holds is a body of it, and checked
  /// with all but what carries it.
  static Result<std::shared_ptr<const CollisionModel>> of_world(
      const evaluation::Sources&, WorldId, Progress&, const ObjectPlaces* places = nullptr);
  /// Self-collision of a robot that stands in its mounting frame.
  static Result<std::shared_ptr<const CollisionModel>> of_robot(const evaluation::Sources&, RobotId,
                                                                Progress&);

  [[nodiscard]] const std::vector<CollisionBody>& bodies() const { return bodies_; }
  [[nodiscard]] const std::vector<CollisionRobot>& robots() const { return robots_; }
  /// The pairs that are checked.
  [[nodiscard]] const std::vector<CollisionPair>& pairs() const { return pairs_; }
  /// Pairs of bodies that move against each other and are not checked.
  [[nodiscard]] const std::vector<PassedPair>& passed() const { return passed_; }
  /// What has no shape and so touches nothing, by the names that bodies have: objects without
  /// parts, and of each robot what moves as one and of which nothing is designed or generated.
  [[nodiscard]] const std::vector<std::string>& shapeless() const { return shapeless_; }
  [[nodiscard]] std::size_t coordinate_count() const { return coordinates_; }
  /// The engine is written in Lua: it answers on the application's thread only.
  [[nodiscard]] bool is_script() const { return is_script_; }
  /// Where the world shows its robots.
  [[nodiscard]] std::vector<double> shown() const;
  /// "arm.forearm and table"
  [[nodiscard]] std::string describe(const CollisionPair&) const;

  /// The pairs nearer than `interest` [m] in one configuration, in the order of pairs().
  [[nodiscard]] Result<std::vector<Contact>> near(std::span<const double> q, double interest,
                                                  Progress&) const;
  /// All pairs, each asked for: samples * pairs() (pair-fastest) for samples * coordinate_count()
  /// numbers. Pairs farther than `interest` [m] may have distance = interest.
  [[nodiscard]] Result<std::vector<PairDistance>> distances(std::span<const double> q,
                                                            double interest, Progress&) const;
  /// Pairs that touch in one configuration, in the order of pairs().
  [[nodiscard]] Result<std::vector<CollisionPair>> collisions(std::span<const double> q,
                                                              Progress&) const;
  /// Any two bodies in one configuration, whether they are checked or not: one answer a pair.
  [[nodiscard]] Result<std::vector<Contact>> between(std::span<const double> q,
                                                     std::span<const CollisionPair> pairs,
                                                     double interest, Progress&) const;
  /// Those of any pairs that touch in one configuration.
  [[nodiscard]] Result<std::vector<CollisionPair>> touching(std::span<const double> q,
                                                            std::span<const CollisionPair> pairs,
                                                            Progress&) const;
  /// The least distance of each sample, with the first pair that has it; no pairs: infinity and the
  /// pair (-1, -1).
  [[nodiscard]] Result<std::vector<Contact>> clearance(std::span<const double> q, Progress&) const;
  /// The same, never above the least distance and at most `tolerance` [m] below it, which takes a
  /// fraction of the time where meshes are near each other; 0, or an engine that offers no bounds,
  /// gives the least distance itself. The pair may be any that is within the tolerance of the
  /// first.
  [[nodiscard]] Result<std::vector<Contact>> clearance(std::span<const double> q, double tolerance,
                                                       Progress&) const;
  /// Whether the engine offers distances within a tolerance.
  [[nodiscard]] bool has_bounds() const { return bounds_ != nullptr; }
  /// The first time that a pair comes nearer than `tolerance` > 0 [m] while all joints move evenly
  /// from waypoint to waypoint. Nothing between samples is missed: an interval is free once the
  /// distances at its ends add up to more than the pair can move against each other meanwhile
  /// (Schwarzer, Saha, Latombe, IEEE Trans. Robotics 21 (2005) 338), else it is halved.
  [[nodiscard]] Result<std::optional<PathContact>> check_path(std::span<const double> waypoints,
                                                              double tolerance, Progress&) const;
  /// Pairs that touch always or never in `samples` random configurations within the joint limits;
  /// adjacent ones are left out. Equal seeds give equal answers.
  [[nodiscard]] Result<std::vector<SampledPair>> sample_pairs(std::size_t samples,
                                                              std::uint64_t seed, Progress&) const;

  /// The clearance of one robot, others where the world shows them, and its gradient:
  ///   influence - |influence - d_k|_4 over the pairs k nearer than `influence` [m],
  /// which is the distance where it is one pair, at most the least one where it is several, and
  /// smooth. Not counted,
  /// since nothing could be done about them, are pairs of the robot's own bodies that are nearer in
  /// every one of 64 sampled configurations, such as neighbours but one, and pairs with other
  /// things whose distance stays the same, such as a first link's. The model and `progress`, which
  /// is heard in every call, outlive the field.
  [[nodiscard]] Result<std::unique_ptr<AskedClearance>> field(std::size_t robot, double influence,
                                                              Progress& progress) const;

  /// world_T_body of all bodies for one configuration.
  void place(std::span<const double> q, std::span<Pose> out) const;

 private:
  friend class RobotClearance;
  friend class PathChecker;
  friend class SearchCheck;
  struct Builder;
  /// Where all bodies are at one configuration, and what was nearest before; one a thread.
  struct Sample {
    std::vector<std::vector<Pose>> frames;  ///< of each robot's joints
    std::vector<Pose> poses;                ///< world_T_body
    BroadPhase::Placed boxes;
    CollisionPair nearest{-1, -1};
  };
  [[nodiscard]] Result<void> check(std::span<const double> q) const;
  [[nodiscard]] Sample sample() const;  ///< with what stands still in its place
  void place_moving(std::span<const double> q, Sample&) const;
  [[nodiscard]] Result<void> ask(std::span<const Pose> poses, std::span<const CollisionPair> pairs,
                                 double interest, std::span<PairDistance> out, Progress&,
                                 double tolerance = 0) const;
  [[nodiscard]] std::vector<CollisionPair> candidates(const Sample&, const PairSet&,
                                                      double within) const;
  [[nodiscard]] Result<std::vector<CollisionPair>> touching_at(const Sample&,
                                                               std::span<const CollisionPair>,
                                                               Progress&) const;
  [[nodiscard]] Result<Contact> least(Sample&, const PairSet&, double interest, const Progress&,
                                      double tolerance = 0) const;
  /// What engines that offer bounds say of all pairs without much work.
  struct Rough {
    struct Row {
      CollisionPair pair;
      double least;  ///< it is no nearer than this [m]
    };
    std::vector<Row> rows;  ///< the nearest first; pairs that are not in it do not count
    Contact nearest;        ///< of a pair that is so near, or (-1, -1)
    double most = 0;        ///< that the least distance can be [m]
  };
  [[nodiscard]] Result<double> bound(const Sample&, const CollisionPair&, double tolerance, Rough&,
                                     Progress&) const;
  [[nodiscard]] Result<Rough> rough(const Sample&, const PairSet&, double interest,
                                    Progress&) const;
  [[nodiscard]] Result<Contact> least_bound(const Sample&, const PairSet&, double interest,
                                            const Progress&, double tolerance) const;
  [[nodiscard]] Result<std::vector<PairDistance>> distances_of(std::span<const double> q,
                                                               std::span<const CollisionPair> pairs,
                                                               double interest, Progress&) const;

  std::vector<CollisionBody> bodies_;
  std::vector<CollisionRobot> robots_;
  std::vector<CollisionPair> pairs_;
  std::vector<PassedPair> passed_;
  std::vector<std::string> shapeless_;
  std::size_t coordinates_ = 0;
  std::string provider_;
  bool is_script_ = false;
  std::unique_ptr<CollisionScene> scene_;
  const CollisionBounds* bounds_ = nullptr;  ///< of the scene; none = it offers none
  BroadPhase broad_;
  PairSet checked_;
  std::vector<BodyCover> covers_;  ///< of the bodies
};

/// The recording with a column "clearance": the least distance of the robot's bodies to each other
/// and to all else [m], negative where convex bodies overlap; and a note when something touches.
[[nodiscard]] Result<recording::RecordingPtr> with_clearance(const evaluation::Sources&,
                                                             const recording::Recording&,
                                                             Progress&);

/// Configurations of a world from a recording's columns q1.. and where the other robots stand.
[[nodiscard]] Result<std::vector<double>> configurations(const CollisionModel&,
                                                         const recording::Recording&);

}  // namespace robomosp::collision
