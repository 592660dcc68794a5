// SPDX-License-Identifier: Apache-2.0
// A robot of the document as posts see it (layer: application, program_post).
#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <robomosp/sdk/post.h>

#include "robotics/kinematics.h"
#include "sim/ik_choice.h"

namespace robomosp::program_post {

/// Kinematics of a robot for posts.
class HostKinematics final : public PostKinematics {
 public:
  HostKinematics(std::shared_ptr<const RobotModel> model, sim::Bound<IkSolver> ik,
                 Progress& progress)
      : model_(std::move(model)), ik_(std::move(ik)), names_(ik_, 0), progress_(progress) {}
  [[nodiscard]] Result<Pose> forward(std::span<const double> q) const override {
    RMP_TRY(check(q));
    std::vector<Pose> frames(model_->joints.size());
    robotics::forward_kinematics(*model_, q, frames);
    return robotics::tip_pose(*model_, 0, frames);
  }
  [[nodiscard]] Result<std::vector<double>> inverse(const Pose& base_T_tip,
                                                    std::span<const double> seed,
                                                    std::int64_t status) const override {
    RMP_TRY(check(seed));
    IkBatch batch;
    batch.targets = std::span(&base_T_tip, 1);
    batch.seeds = seed;
    batch.all_solutions = status >= 0;
    RMP_TRY_ASSIGN(const auto results, sim::solve_ik(ik_, batch, progress_));
    const IkResult& r = results.front();
    const std::size_t n = model_->coordinate_count();
    if (r.status != IkStatus::solved || r.q.size() < n)
      return error(ErrorCode::unreachable,
                   r.detail.empty() ? "the robot does not reach this target" : r.detail);
    std::vector<double> best;
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t at = 0; at + n <= r.q.size(); at += n) {
      const std::span<const double> q(r.q.data() + at, n);
      std::uint32_t known = 0;
      const std::uint32_t has = this->status(q, known);
      if (status >= 0 && ((has ^ static_cast<std::uint32_t>(status)) & known) != 0) continue;
      double d = 0;
      for (std::size_t i = 0; i < n; ++i) d += (q[i] - seed[i]) * (q[i] - seed[i]);
      if (d >= least) continue;
      least = d;
      best.assign(q.begin(), q.end());
    }
    if (best.empty())
      return error(ErrorCode::unreachable,
                   "the robot does not reach this target with STATUS " + std::to_string(status));
    return best;
  }
  [[nodiscard]] std::uint32_t status(std::span<const double> q,
                                     std::uint32_t& known) const override {
    return names_.status(q, known);
  }

 private:
  Result<void> check(std::span<const double> q) const {
    if (q.size() == model_->coordinate_count()) return {};
    return error(ErrorCode::invalid_argument, "the target has " + std::to_string(q.size()) +
                                                  " joints, but the robot " +
                                                  std::to_string(model_->coordinate_count()));
  }
  std::shared_ptr<const RobotModel> model_;
  sim::Bound<IkSolver> ik_;
  sim::BranchNames names_;
  Progress& progress_;
};

}  // namespace robomosp::program_post
