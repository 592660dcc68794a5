// SPDX-License-Identifier: Apache-2.0
// Inverse dynamics for a controller that can be cancelled by its run, since a controller's tick
// gets no progress (layer: numerics, sim).
#pragma once

#include <memory>
#include <utility>

#include <robomosp/sdk/dynamics.h>

namespace robomosp::sim {

/// `run` must outlive it. Already prepared. [any thread]
class StoppableDynamics final : public InverseDynamics {
 public:
  StoppableDynamics(std::shared_ptr<const InverseDynamics> inner, const Progress& run)
      : inner_(std::move(inner)), run_(run) {}
  [[nodiscard]] const void* extension(const char* id) const override {
    return inner_->extension(id);
  }
  Result<void> prepare(const RobotModel&, const Params&) override { return {}; }
  [[nodiscard]] std::size_t scratch_size() const override { return inner_->scratch_size(); }
  Result<void> torques(const DynamicsBatch& b, std::span<double> tau, Progress& p) const override {
    Either progress(p, run_);
    return inner_->torques(b, tau, progress);
  }
  Result<void> inertia(const DynamicsBatch& b, std::span<double> m, Progress& p) const override {
    Either progress(p, run_);
    return inner_->inertia(b, m, progress);
  }
  Result<void> derivatives(const DynamicsBatch& b, std::span<double> by_q, std::span<double> by_qd,
                           Progress& p) const override {
    Either progress(p, run_);
    return inner_->derivatives(b, by_q, by_qd, progress);
  }
  Result<void> regressor(const DynamicsBatch& b, std::span<double> y, Progress& p) const override {
    Either progress(p, run_);
    return inner_->regressor(b, y, progress);
  }
  Result<void> energy(const DynamicsBatch& b, std::span<Energy> out, Progress& p) const override {
    Either progress(p, run_);
    return inner_->energy(b, out, progress);
  }

 private:
  /// Cancelled by either of two; reports to the first.
  class Either final : public Progress {
   public:
    Either(Progress& own, const Progress& run) : own_(own), run_(run) {}
    [[nodiscard]] const void* extension(const char* id) const override {
      return own_.extension(id);
    }
    void report(double fraction, std::string_view what) override { own_.report(fraction, what); }
    [[nodiscard]] bool cancelled() const override { return own_.cancelled() || run_.cancelled(); }

   private:
    Progress& own_;
    const Progress& run_;
  };

  std::shared_ptr<const InverseDynamics> inner_;
  const Progress& run_;
};

}  // namespace robomosp::sim
