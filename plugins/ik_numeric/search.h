// SPDX-License-Identifier: Apache-2.0
// The general search (layer: plugin): Levenberg-Marquardt on all aims at once inside the joint
// limits, with a damping that vanishes with the error, so that it ends as Newton's method
// (Sugihara, IEEE T-RO 27(5), 2011; limits by an active set); and the use of what freedom is left.
#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>

#include "aims.h"

namespace robomosp::ik_numeric {

struct SearchOptions {
  int max_iterations = 100;
  double damping = 1e-2;  ///< factor of the squared error in the damping
  double max_step = 0.6;  ///< of one joint in one iteration [rad, or mechanism lengths]
  bool use_limits = true;
  IkTolerance tolerance;
};

enum class SearchEnd { reached, stuck, out_of_iterations, cancelled };

struct SearchResult {
  SearchEnd end = SearchEnd::stuck;
  int iterations = 0;
  Miss miss;
  double cost = 0;  ///< squared weighted error, to compare attempts
};

class Search {
 public:
  Search(Aims& aims, const Progress& progress);
  /// Improves q in place.
  SearchResult run(std::span<const Pose> targets, const SearchOptions& options,
                   std::span<double> q);
  /// Uses the freedom that the aims leave: raises the objective along their null space as long as
  /// that gains something and at most `steps` times, keeping the aims. q must meet them. No joint
  /// moves by more than `first_step` in one of them [rad, or mechanism lengths].
  void improve(std::span<const Pose> targets, const SearchOptions& options, IkObjective which,
               const ClearanceField* clearance, double first_step, int steps, std::span<double> q);

 private:
  void limited_step(const Eigen::VectorXd& e, double damping, bool use_limits,
                    std::span<const double> q);
  [[nodiscard]] Eigen::VectorXd free_part(const Eigen::VectorXd& direction);
  void damped_step(const Eigen::VectorXd& e, double damping);
  [[nodiscard]] double objective(IkObjective which, const ClearanceField* clearance,
                                 std::span<const double> q, Eigen::VectorXd* gradient);
  [[nodiscard]] double manipulability(std::span<const double> q);

  Aims& aims_;
  const Progress& progress_;
  std::vector<double> trial_;
  std::vector<char> held_;
  Eigen::VectorXd step_, real_step_;
  Eigen::MatrixXd free_columns_;
};

}  // namespace robomosp::ik_numeric
