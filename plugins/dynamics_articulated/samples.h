// SPDX-License-Identifier: Apache-2.0
// What the providers share about samples: sentences of refusal and the search for mechanisms that
// are singular by their masses (layer: plugin).
#pragma once

#include <cmath>
#include <numeric>
#include <string>
#include <vector>

#include <robomosp/sdk/dynamics.h>

#include "spatial/body_tree.h"

namespace robomosp::articulated {

/// Samples between two looks at Progress: far less than 100 ms of work for any mechanism.
inline constexpr std::size_t kSamplesPerCheck = 64;

inline Error cancelled() {
  return error(ErrorCode::cancelled, "the dynamics computation was cancelled");
}
inline std::string sample_name(std::size_t i) { return "sample " + std::to_string(i + 1); }
inline Error not_finite(const char* what, std::size_t sample) {
  return error(ErrorCode::invalid_argument,
               std::string(what) + " of sample " + std::to_string(sample + 1) + " are not finite",
               "Check its joint values, rates and forces.");
}
inline Error singular(const spatial::BodyTree& tree, std::int32_t joint) {
  return error(
      ErrorCode::invalid_argument,
      "the inertia that it moves is zero or negative, so its acceleration is undefined",
      "Give its bodies a mass, or its drive a motor inertia.",
      tree.where() + ", joint \"" + tree.joint_names[static_cast<std::size_t>(joint)] + "\"");
}
inline bool all_finite(const double* v, std::size_t n) {
  // 0 * v is NaN for infinities and NaN, else 0.
  return std::accumulate(v, v + n, 0.0, [](double s, double x) { return s + 0 * x; }) == 0;
}
inline bool finite_inputs(const spatial::BodyTree& tree, const DynamicsBatch& b, std::size_t i) {
  const std::size_t n = tree.velocities;
  return all_finite(b.q.data() + i * tree.coordinates, tree.coordinates) &&
         (b.qd.empty() || all_finite(b.qd.data() + i * n, n)) &&
         (b.tau.empty() || all_finite(b.tau.data() + i * n, n));
}
/// The uncoupled joint that entry v of the velocities belongs to.
inline std::int32_t joint_of(const spatial::BodyTree& tree, std::size_t v) {
  for (std::size_t i = 0; i < tree.bodies.size(); ++i) {
    const spatial::TreeBody& b = tree.bodies[i];
    const auto first = static_cast<std::size_t>(b.v_index);
    if (!b.coupled && v >= first && v < first + static_cast<std::size_t>(b.columns))
      return static_cast<std::int32_t>(i);
  }
  return 0;
}
inline Result<void> refuse_loops(const RobotModel& model) {
  if (model.loops.empty()) return {};
  return error(ErrorCode::unsupported,
               "it has the closed loop \"" + model.loops[0].name +
                   "\", but this provider of forward dynamics supports trees only",
               "Choose the provider constrained.", "robot \"" + model.name + "\"");
}

/// A mechanism that is singular wherever one looks is singular by its masses; a single
/// configuration could be an accident. The places are multiples of the golden angle.
/// `solve(batch, qdd)` gives -1 or the joint that nothing resists.
template <class Solve>
Result<void> refuse_singular(const spatial::BodyTree& tree, Solve&& solve) {
  std::vector<double> q(tree.coordinates), qdd(tree.velocities);
  std::int32_t joint = -1;
  for (std::size_t attempt = 1; attempt <= 4; ++attempt) {
    for (std::size_t j = 0; j < q.size(); ++j)
      q[j] = std::fmod(2.399963229728653 * static_cast<double>(attempt * (j + 1)), 3.0);
    DynamicsBatch b;
    b.count = 1;
    b.q = q;
    joint = solve(b, qdd.data());
    if (joint < 0) return {};
  }
  return singular(tree, joint);
}

}  // namespace robomosp::articulated
