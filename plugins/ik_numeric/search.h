// SPDX-License-Identifier: Apache-2.0
// The search for joint values (layer: plugin): Levenberg-Marquardt on the base-referred Jacobian
// inside the joint limits, with a damping that vanishes with the error, so that it ends as
// Newton's method (Sugihara, IEEE T-RO 27(5), 2011; limits by the projected active set).
#pragma once

#include <span>
#include <vector>

#include <robomosp/sdk/ik.h>

#include "chain.h"

namespace robomosp::ik_numeric {

struct SearchOptions {
  int max_iterations = 100;
  double damping = 1e-2;  ///< factor of the squared error in the damping
  double max_step = 0.6;  ///< of one joint in one iteration [rad, or chain lengths]
  bool use_limits = true;
  bool position_only = false;
};

enum class SearchEnd { reached, stuck, out_of_iterations, cancelled };

/// Memory of one thread's searches; sized once per solve call.
struct Workspace {
  explicit Workspace(std::size_t n)
      : frames(n), trial_frames(n), trial(n), step(n), columns(6 * n), held(n) {}
  std::vector<Pose> frames, trial_frames;
  std::vector<double> trial, step, columns;
  std::vector<char> held;
};

struct SearchResult {
  SearchEnd end = SearchEnd::stuck;
  int iterations = 0;
  double position_error = 0;  ///< [m]
  double rotation_error = 0;  ///< [rad]
  double cost = 0;            ///< squared weighted error, to compare attempts
};

/// Improves q (one entry a path joint) in place.
SearchResult search(const Chain& chain, const Pose& target, const IkTolerance& tolerance,
                    const SearchOptions& options, std::span<double> q, Workspace& work,
                    const Progress& progress);

}  // namespace robomosp::ik_numeric
