// SPDX-License-Identifier: Apache-2.0
// The up to eight configurations of one target, before and after limits (layer: plugin).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include <robomosp/sdk/types.h>

namespace robomosp::ik_spherical_wrist {

inline constexpr std::size_t kBranches = 8;

/// Most targets searched together.
inline constexpr std::size_t kTogether = 8;

/// Input of a search of the branches: a pose of the tip, and angles to stay near.
struct Question {
  Pose target;                   ///< base_T_tip
  std::array<double, 6> near{};  ///< angles to stay near [rad]
  std::array<double, 6> lower{}, upper{};
  double touch = 0;  ///< greatest distance that counts as reached [m]
};

/// One lane per branch; unused lanes have an infinite `gap`.
struct Candidates {
  alignas(64) std::array<std::array<double, kBranches>, 6> q;  ///< turned towards `near` [rad]
  alignas(64) std::array<double, kBranches> gap;      ///< distance out of reach [m]; 0 = reached
  alignas(64) std::array<double, kBranches> outside;  ///< greatest excess of a limit [rad]
  alignas(64) std::array<double, kBranches> cost;     ///< squared distance from `near` [rad^2]
  alignas(64) std::array<double, kBranches> margin;   ///< approaches 0 where branches meet [1]
  /// Rank among the lanes that reach the target within the limits, least cost first; others
  /// undefined.
  alignas(64) std::array<std::int64_t, kBranches> rank;
};

}  // namespace robomosp::ik_spherical_wrist
