// SPDX-License-Identifier: Apache-2.0
// Path: the timed Cartesian path of a trajectory record, made of its segments by their providers
// (layer: data processing).
#pragma once

#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <robomosp/sdk/result.h>
#include <robomosp/sdk/trajectory.h>

#include "kernel/registry.h"
#include "model/records.h"

namespace robomosp::motion {

/// Finds a stored trajectory; null = there is none.
using FindTrajectory = std::function<const model::Record*(TrajectoryId)>;

/// Those of a document's snapshot, which must outlive it.
template <class Snapshot>
FindTrajectory stored_in(const Snapshot& snapshot) {
  return [&snapshot](TrajectoryId id) { return snapshot.find(AnyId(id)); };
}

/// Segments one after the other in time. Immutable. [any thread]
class Path {
 public:
  struct Piece {
    std::shared_ptr<const Segment> segment;
    double start = 0;            ///< [s]
    std::size_t number = 0;      ///< of the trajectory's own segment that it belongs to, from 1
    bool is_transition = false;  ///< it leads to that segment
  };

  /// Builds every segment by its providers, and the transitions between them (transition.h). Joint
  /// segments are ErrorCode::unsupported.
  static Result<std::shared_ptr<const Path>> build(const Registry&,
                                                   std::string_view trajectory_name,
                                                   const model::Trajectory&,
                                                   const FindTrajectory& = {});

  /// Whether a trajectory can be built, and its notes; joint segments are only checked for what
  /// needs no robot.
  static Result<std::vector<std::string>> check(const Registry&, std::string_view trajectory_name,
                                                const model::Trajectory&,
                                                const FindTrajectory& = {});

  [[nodiscard]] double duration() const { return starts_.back(); }  ///< [s]
  [[nodiscard]] double length() const { return length_; }           ///< [m]
  /// Of segments and the transitions between them.
  [[nodiscard]] std::size_t segment_count() const { return pieces_.size(); }
  /// In order of time. What runs a stored trajectory is as many as that has.
  [[nodiscard]] std::span<const Piece> pieces() const { return pieces_; }
  /// Where transitions pass limits or leave the hull of their segments, a sentence each.
  [[nodiscard]] const std::vector<std::string>& notes() const { return notes_; }
  /// Fills out[i] for times[i] (ascending or not; held at the ends outside 0..duration()). A time
  /// at a joint of two segments belongs to the later one. Poses in the trajectory's frame. An error
  /// names the provider that could not say.
  Result<void> sample(std::span<const double> times, std::span<PathSample> out) const;
  /// 0, step, 2 step, ... and the very end.
  [[nodiscard]] std::vector<double> sample_times(double step) const;

 private:
  std::vector<Piece> pieces_;
  std::vector<double> starts_;  ///< start time of each piece, and the end of the last
  double length_ = 0;
  std::vector<std::string> notes_;
};

}  // namespace robomosp::motion
