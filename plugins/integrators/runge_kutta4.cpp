// SPDX-License-Identifier: Apache-2.0
// The classical Runge-Kutta method of order 4 with a fixed step (layer: plugin). W. Kutta, Z. Math.
// Phys. 46 (1901).
#include "methods.h"
#include "spatial/ode_fixed_step.h"

namespace robomosp::integrators {
namespace {

class RungeKuttaSteps final : public spatial::FixedStep {
 public:
  RungeKuttaSteps(spatial::Rates& rates, const OdeRun& run)
      : FixedStep(rates, run), k1_(size()), k2_(size()), k3_(size()), k4_(size()), x_(size()) {}

 protected:
  // Every step begins with a rate of its own.
  Result<void> begin(double, std::span<const double>) override { return {}; }
  void save_start() override { has_first_ = false; }
  void load_start() override {}
  Result<void> advance(double t, std::span<const double> x0, double h,
                       std::span<double> x1) override {
    if (!has_first_) RMP_TRY(rate(t, x0, k1_));
    has_first_ = true;
    RMP_TRY(stage(t + h / 2, x0, h / 2, k1_, k2_));
    RMP_TRY(stage(t + h / 2, x0, h / 2, k2_, k3_));
    RMP_TRY(stage(t + h, x0, h, k3_, k4_));
    for (std::size_t i = 0; i < x0.size(); ++i)
      x1[i] = x0[i] + h / 6 * (k1_[i] + 2 * (k2_[i] + k3_[i]) + k4_[i]);
    return {};
  }

 private:
  Result<void> stage(double t, std::span<const double> x0, double h, std::span<const double> k,
                     std::span<double> out) {
    for (std::size_t i = 0; i < x0.size(); ++i) x_[i] = x0[i] + h * k[i];
    return rate(t, x_, out);
  }
  std::vector<double> k1_, k2_, k3_, k4_, x_;
  bool has_first_ = false;
};

}  // namespace

Result<void> RungeKutta4::prepare(const Params&) { return {}; }

Result<OdeStatistics> RungeKutta4::run(OdeSystem& system, const OdeRun& run, OdeSink& sink,
                                       Progress& progress) const {
  return spatial::run_steps<RungeKuttaSteps>(system, run, sink, progress);
}

}  // namespace robomosp::integrators
