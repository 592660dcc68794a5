// SPDX-License-Identifier: Apache-2.0
// Quick checks for searches: whether configurations and joint motions of one robot are free, many
// at a time in lanes, with distances computed only where spheres and boxes do not settle it
// (layer: application, collision).
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include <robomosp/sdk/progress.h>
#include <robomosp/sdk/result.h>

#include "collision/collision.h"
#include "robotics/batch_kinematics.h"
#include "spatial/box_tree.h"

namespace robomosp::collision {

/// Result of a check of a whole motion.
enum class MotionFound : std::uint8_t {
  free,     ///< nothing comes nearer than the clearance, also between samples
  blocked,  ///< something does
  unsure,   ///< too close to decide in the allowed number of steps
};

/// One robot of simple joints among all other bodies, which stay at their pose in the model.
/// Configurations are those of the robot, dof numbers each. Keeps its memory between calls: one
/// thread at a time. The model must outlive it.
class SearchCheck {
 public:
  /// `lower`, `upper`: finite bounds of all coordinates that will be checked [rad or m].
  SearchCheck(const CollisionModel& model, std::size_t robot, std::span<const double> lower,
              std::span<const double> upper);
  ~SearchCheck();
  SearchCheck(const SearchCheck&) = delete;
  SearchCheck& operator=(const SearchCheck&) = delete;

  /// Numbers of checks since construction.
  struct Counts {
    std::size_t configurations = 0;  ///< checked in lanes
    std::size_t distances = 0;       ///< exact distances of pairs of bodies
  };
  [[nodiscard]] const Counts& counts() const { return counts_; }

  /// True if no pair is nearer than `clearance` [m]; exact.
  [[nodiscard]] Result<bool> is_free(std::span<const double> q, double clearance, Progress&);
  /// The same for samples of the straight joint motion from a to b, ends included; between samples
  /// no point of the robot moves more than `step` [m].
  [[nodiscard]] Result<bool> seems_free(std::span<const double> a, std::span<const double> b,
                                        double clearance, double step, Progress&);
  /// Checks whether the straight joint motions from row to row are certainly free: a part of a
  /// motion is free if the clearance at its middle exceeds the motion within it, else it is halved.
  [[nodiscard]] Result<MotionFound> check_rows(std::span<const double> rows, double clearance,
                                               Progress&);

 private:
  struct Moving;
  struct Pairing;
  struct Room;
  struct Part;
  /// Lanes, as bits. Nothing more is looked for once one is inside.
  struct Lanes {
    std::uint32_t inside = 0;  ///< a pair is nearer than the clearance
    std::uint32_t near = 0;    ///< a pair is nearer than the clearance and the growth
  };
  void add_moving(std::size_t robot, std::span<const double> lower, std::span<const double> upper);
  void add_still(const std::vector<Pose>& world_T_body, const Pose& world_T_base);
  [[nodiscard]] std::vector<double> motion_of(std::int32_t joint, std::int32_t up_to, double reach,
                                              std::span<const double> lower,
                                              std::span<const double> upper) const;
  [[nodiscard]] Result<Lanes> look(std::span<const double> rows, std::size_t count,
                                   double clearance, bool has_growth, Progress&);
  void place(std::span<const double> rows, std::size_t count);
  void against_still(std::size_t moving, double clearance, bool has_growth, Lanes& found);
  void against_moving(const Pairing& pairing, std::size_t number, double clearance, bool has_growth,
                      Lanes& found);
  [[nodiscard]] Result<void> ask_engine(double clearance, Lanes& found, Progress&);

  const CollisionModel& model_;
  const CollisionRobot& robot_;
  std::size_t dof_;
  robotics::BatchKinematics kinematics_;
  const SearchKernel& kernel_;
  std::vector<Moving> moving_;
  std::vector<Pairing> pairings_;  ///< of two bodies that move
  std::vector<double>
      bounds_;  ///< rows of dof: of the bodies, then of the pairings [m per rad or m]
  std::vector<SearchShape> shapes_;
  std::vector<std::int32_t> shape_body_;
  std::vector<std::uint8_t> shape_exact_;
  spatial::BoxTree tree_;
  std::vector<spatial::Box> tree_boxes_;
  std::vector<Pose> shown_;  ///< world_T_body of all
  std::unique_ptr<Room> room_;
  Counts counts_;
};

}  // namespace robomosp::collision
