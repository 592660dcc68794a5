// SPDX-License-Identifier: Apache-2.0
// Searches for one whole pose of a chain of simple joints, with many targets and many starts in the
// lanes of the processor (layer: plugin). The solution for a target is that of its first successful
// start, so that it is the same alone, in a batch and for every vector width.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <robomosp/sdk/ik.h>

#include "chain.h"
#include "lanes.h"

namespace robomosp::ik_numeric {

/// Configurations throughout the joint space with their poses: a search from the one with the pose
/// nearest to the target is short and seldom reaches a limit.
class StartTable {
 public:
  StartTable(const Chain& chain, std::uint64_t seed);
  static constexpr int kSize = 512;
  /// Distance of the pose of every entry from the target, weighted as in the search.
  void distances(const Pose& target, std::span<float> out) const;
  [[nodiscard]] const double* configuration(int i) const {
    return q_.data() + static_cast<std::size_t>(i) * joints_;
  }

 private:
  std::size_t joints_;
  double length_;
  std::vector<double> q_;
  std::vector<float> features_;  ///< feature-major, so that all entries are compared at once
};

/// State of one target.
struct Attempted {
  bool reached = false, ended_early = false;
  int iterations = 0;
  double cost = 0;        ///< of the closest end of a search
  std::vector<double> q;  ///< of the solution or the closest end, one value per path joint
};

struct AttemptOptions {
  LaneOptions lanes;
  std::uint64_t seed = 1;
  bool limits = true;
};

/// Solves all targets: attempt 0 starts at starts[i], later ones, up to restarts[i], elsewhere.
/// False on cancellation.
bool attempt(const Chain& chain, const StartTable& table, const AttemptOptions& options,
             std::span<const Pose> targets, std::span<const double> starts,
             std::span<const int> restarts, std::span<Attempted> out, Progress& progress);

}  // namespace robomosp::ik_numeric
