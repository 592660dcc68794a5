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

/// A rigid body: a placed object, a robot's base or link, or an object held by a robot.
struct CollisionBody {
  std::string name;         ///< "table", "arm.forearm", "arm.base"; of a robot alone "forearm"
  std::int32_t robot = -1;  ///< index into robots(); -1 = an object that is not held
  std::int32_t joint = -1;  ///< the joint that carries it; -1 = none: the body is fixed
  Pose placement;           ///< joint_T_body, or world_T_body of a fixed body
  double reach = 0;         ///< distance of its shapes from the joint's origin, a bound [m]
  bool is_held = false;     ///< an object in a robot's hand
};

/// A robot and the range of its coordinates in a configuration of all robots.
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
  adjacent,  ///< only one joint (or links without shapes) between them
  always,    ///< they touch in every sampled configuration
  rule,      ///< set by the record (model::CollisionPairRule)
};
struct PassedPair {
  CollisionPair pair;  ///< indices of bodies
  PairReason reason = PairReason::adjacent;
  std::string text;  ///< of a rule: its reason
};

/// A pair that is too near, with the nearest points.
struct Contact {
  CollisionPair pair;
  PairDistance at;
};
/// First contact on a joint path.
struct PathContact {
  std::size_t segment = 0;  ///< between waypoints `segment` and `segment` + 1
  double share = 0;         ///< fraction of the path between them, 0..1
  Contact contact;
};

/// A pair that need not be checked, according to sampled configurations.
struct SampledPair {
  CollisionPair pair;
  bool always = false;  ///< touches in all samples; false = in none
};

/// Objects held by robots, and poses of other objects, that override the world's.
struct ObjectPlaces {
  std::vector<recording::Load> held;
  std::map<std::string, Pose> moved;  ///< world_T_object by name
};

/// The order of CollisionModel::pairs().
[[nodiscard]] inline bool comes_before(const CollisionPair& x, const CollisionPair& y) {
  return x.a != y.a ? x.a < y.a : x.b < y.b;
}

/// A clearance that records failures: a solver only sees numbers and takes a failed configuration
/// for clear, so its caller checks outcome() afterwards.
class AskedClearance : public ClearanceField {
 public:
  /// The first failure since construction: of the collision provider, or a cancellation.
  [[nodiscard]] virtual Result<void> outcome() const = 0;
};

/// Immutable; any thread may query it. A configuration is the concatenated coordinates of all
/// robots.
class CollisionModel {
 public:
  /// Pairs that never move (objects among themselves, and with robots' bases) are checked only if a
  /// rule that names both forbids contact. A held object is a body of its robot, checked with all
  /// bodies but its carrier.
  static Result<std::shared_ptr<const CollisionModel>> of_world(
      const evaluation::Sources&, WorldId, Progress&, const ObjectPlaces* places = nullptr);
  /// Self-collision of a robot at its mounting frame.
  static Result<std::shared_ptr<const CollisionModel>> of_robot(const evaluation::Sources&, RobotId,
                                                                Progress&);

  [[nodiscard]] const std::vector<CollisionBody>& bodies() const { return bodies_; }
  [[nodiscard]] const std::vector<CollisionRobot>& robots() const { return robots_; }
  /// The pairs that are checked.
  [[nodiscard]] const std::vector<CollisionPair>& pairs() const { return pairs_; }
  /// Pairs of bodies with relative motion that are not checked.
  [[nodiscard]] const std::vector<PassedPair>& passed() const { return passed_; }
  /// Items without a shape, which touch nothing, by the names of bodies: objects without parts, and
  /// rigid groups of a robot's links without designed or generated bodies.
  [[nodiscard]] const std::vector<std::string>& shapeless() const { return shapeless_; }
  [[nodiscard]] std::size_t coordinate_count() const { return coordinates_; }
  /// The engine is written in Lua: it runs on the application's thread only.
  [[nodiscard]] bool is_script() const { return is_script_; }
  /// The robots' configuration in the world.
  [[nodiscard]] std::vector<double> shown() const;
  /// "arm.forearm and table"
  [[nodiscard]] std::string describe(const CollisionPair&) const;

  /// The pairs nearer than `interest` [m] in one configuration, in the order of pairs().
  [[nodiscard]] Result<std::vector<Contact>> near(std::span<const double> q, double interest,
                                                  Progress&) const;
  /// Exact distances of all pairs: samples * pairs() (pair-fastest) for samples *
  /// coordinate_count() numbers. Pairs farther than `interest` [m] may have distance = interest.
  [[nodiscard]] Result<std::vector<PairDistance>> distances(std::span<const double> q,
                                                            double interest, Progress&) const;
  /// Pairs that touch in one configuration, in the order of pairs().
  [[nodiscard]] Result<std::vector<CollisionPair>> collisions(std::span<const double> q,
                                                              Progress&) const;
  /// Distances of given pairs of bodies in one configuration, checked or not: one result per pair.
  [[nodiscard]] Result<std::vector<Contact>> between(std::span<const double> q,
                                                     std::span<const CollisionPair> pairs,
                                                     double interest, Progress&) const;
  /// The subset of any given pairs that touch in one configuration.
  [[nodiscard]] Result<std::vector<CollisionPair>> touching(std::span<const double> q,
                                                            std::span<const CollisionPair> pairs,
                                                            Progress&) const;
  /// The least distance of each sample, with the first pair that has it; no pairs: infinity and the
  /// pair (-1, -1).
  [[nodiscard]] Result<std::vector<Contact>> clearance(std::span<const double> q, Progress&) const;
  /// The same, never above the least distance and at most `tolerance` [m] below it, in a fraction
  /// of the time if meshes are near each other; 0, or an engine without bounds, gives the least
  /// distance itself. The pair may be any within the tolerance of the nearest.
  [[nodiscard]] Result<std::vector<Contact>> clearance(std::span<const double> q, double tolerance,
                                                       Progress&) const;
  /// True if the engine offers distances within a tolerance.
  [[nodiscard]] bool has_bounds() const { return bounds_ != nullptr; }
  /// The first contact closer than `tolerance` > 0 [m] while all joints move uniformly from
  /// waypoint to waypoint. Nothing between samples is missed: an interval is free if the distances
  /// at its ends add up to more than the relative motion of the pair in between (Schwarzer, Saha,
  /// Latombe, IEEE Trans. Robotics 21 (2005) 338), else it is halved.
  [[nodiscard]] Result<std::optional<PathContact>> check_path(std::span<const double> waypoints,
                                                              double tolerance, Progress&) const;
  /// Pairs that touch always or never in `samples` random configurations within the joint limits,
  /// without adjacent ones. Equal seeds give equal results.
  [[nodiscard]] Result<std::vector<SampledPair>> sample_pairs(std::size_t samples,
                                                              std::uint64_t seed, Progress&) const;

  /// The clearance of one robot, with the others at their configuration in the world, and its
  /// gradient:
  ///   influence - |influence - d_k|_4 over the pairs k nearer than `influence` [m],
  /// which is smooth, equals the distance of a single pair, and is at most the least of several.
  /// Two sorts of pairs are not counted, since no motion can improve them: pairs of the robot's own
  /// bodies that are nearer in each of 64 sampled configurations, such as links two joints apart,
  /// and pairs with other bodies at a constant distance, such as a first link's. The model and
  /// `progress`, which is polled in every call, must outlive the field.
  [[nodiscard]] Result<std::unique_ptr<AskedClearance>> field(std::size_t robot, double influence,
                                                              Progress& progress) const;

  /// world_T_body of all bodies for one configuration.
  void place(std::span<const double> q, std::span<Pose> out) const;

 private:
  friend class RobotClearance;
  friend class PathChecker;
  friend class SearchCheck;
  struct Builder;
  /// Poses of all bodies at one configuration, and the last nearest pair; one per thread.
  struct Sample {
    std::vector<std::vector<Pose>> frames;  ///< of each robot's joints
    std::vector<Pose> poses;                ///< world_T_body
    BroadPhase::Placed boxes;
    CollisionPair nearest{-1, -1};
  };
  [[nodiscard]] Result<void> check(std::span<const double> q) const;
  [[nodiscard]] Sample sample() const;  ///< with the fixed bodies placed
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
  /// A quick estimate of all pairs by engines that offer bounds.
  struct Rough {
    struct Row {
      CollisionPair pair;
      double least;  ///< lower bound of the distance [m]
    };
    std::vector<Row> rows;  ///< nearest first; pairs not listed do not count
    Contact nearest;        ///< of a pair with an upper bound, or (-1, -1)
    double most = 0;        ///< upper bound of the least distance [m]
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
  const CollisionBounds* bounds_ = nullptr;  ///< of the scene; null = not offered
  BroadPhase broad_;
  PairSet checked_;
  std::vector<BodyCover> covers_;  ///< of the bodies
};

/// The recording with a column "clearance": the least distance of the robot's bodies to each other
/// and to all other bodies [m], negative where convex bodies overlap; and a note on contact.
[[nodiscard]] Result<recording::RecordingPtr> with_clearance(const evaluation::Sources&,
                                                             const recording::Recording&,
                                                             Progress&);

/// Configurations of a world from a recording's columns q1.. and the world's other robots.
[[nodiscard]] Result<std::vector<double>> configurations(const CollisionModel&,
                                                         const recording::Recording&);

}  // namespace robomosp::collision
