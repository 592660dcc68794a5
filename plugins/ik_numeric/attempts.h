// SPDX-License-Identifier: Apache-2.0
// Searches for one whole pose of a chain of simple joints, many targets and many starts in the
// lanes of the processor (layer: plugin). The answer for a target is that of its first start that
// leads there, so that it is the same alone, in a batch and on every width of processor.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <robomosp/sdk/ik.h>

#include "chain.h"
#include "lanes.h"

namespace robomosp::ik_numeric {

/// Configurations all over the joint space with their poses: a search that starts at the one whose
/// pose is nearest to the target is short and seldom runs into a limit.
class StartTable {
 public:
  StartTable(const Chain& chain, std::uint64_t seed);
  static constexpr int kSize = 512;
  /// How far the pose of every entry is from the target, weighted as the search does.
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

/// What is left of one target.
struct Attempted {
  bool reached = false, ended_early = false;
  int iterations = 0;
  double cost = 0;        ///< of the closest ending
  std::vector<double> q;  ///< of the answer or the closest ending, one value a path joint
};

struct AttemptOptions {
  LaneOptions lanes;
  std::uint64_t seed = 1;
  bool limits = true;
};

/// Solves all targets: attempt 0 starts at starts[i], later ones, up to restarts[i], elsewhere.
/// False when cancelled.
bool attempt(const Chain& chain, const StartTable& table, const AttemptOptions& options,
             std::span<const Pose> targets, std::span<const double> starts,
             std::span<const int> restarts, std::span<Attempted> out, Progress& progress);

}  // namespace robomosp::ik_numeric
