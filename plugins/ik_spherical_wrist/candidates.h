// SPDX-License-Identifier: Apache-2.0
// The up to eight configurations of one target, before and after limits (layer: plugin).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include <robomosp/sdk/types.h>

namespace robomosp::ik_spherical_wrist {

inline constexpr std::size_t kBranches = 8;

/// Targets that are searched together at most.
inline constexpr std::size_t kTogether = 8;

/// What a search of the branches is asked: a pose of the tip, and where to stay near.
struct Question {
  Pose target;                   ///< base_T_tip
  std::array<double, 6> near{};  ///< angles to stay near [rad]
  std::array<double, 6> lower{}, upper{};
  double touch = 0;  ///< a miss that still counts as reached [m]
};

/// One lane a branch; lanes that mean nothing have an infinite `gap`.
struct Candidates {
  alignas(64) std::array<std::array<double, kBranches>, 6> q;  ///< turned towards `near` [rad]
  alignas(64) std::array<double, kBranches> gap;  ///< what is missing of the way [m]; 0 = reaches
  alignas(64) std::array<double, kBranches> outside;  ///< greatest excess of a limit [rad]
  alignas(64) std::array<double, kBranches> cost;     ///< squared distance from `near` [rad^2]
  alignas(64) std::array<double, kBranches> margin;   ///< towards 0 where branches meet [1]
  /// Place among the lanes that reach within the limits, the least cost first; of others anything.
  alignas(64) std::array<std::int64_t, kBranches> rank;
};

}  // namespace robomosp::ik_spherical_wrist
