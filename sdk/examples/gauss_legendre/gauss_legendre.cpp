// SPDX-License-Identifier: Apache-2.0
// An integrator of one's own: Gauss and Legendre's implicit method of two stages,
//
//     k1 = f(t + c1 h, x + h (a11 k1 + a12 k2)),   c = 1/2 -+ sqrt(3)/6
//     k2 = f(t + c2 h, x + h (a21 k1 + a22 k2)),   a = [1/4, 1/4 - sqrt(3)/6; 1/4 + sqrt(3)/6, 1/4]
//     x' = x + h (k1 + k2) / 2
//
// Order 4 and symplectic for every Hamiltonian, also where positions and velocities do not separate
// as in robots (the inertia depends on q), and it keeps quadratic invariants exactly: momentum, the
// length of quaternions. J. C. Butcher, Math. Comp. 18 (1964); Hairer, Lubich, Wanner, Geometric
// Numerical Integration, 2006, IV.2.1 and VI.4.
//
// Samples, events, projections and cancellation are those of the helper library: run_steps().
#include <algorithm>
#include <cmath>
#include <numbers>

#include <robomosp/sdk/integrator.h>
#include <robomosp/sdk/plugin.h>

#include "spatial/ode_fixed_step.h"

namespace {

using namespace robomosp;

constexpr double kRoot = std::numbers::sqrt3 / 6;
constexpr double kC[2] = {0.5 - kRoot, 0.5 + kRoot};
constexpr double kA[2][2] = {{0.25, 0.25 - kRoot}, {0.25 + kRoot, 0.25}};

class Steps final : public spatial::FixedStep {
 public:
  Steps(spatial::Rates& rates, const OdeRun& run)
      : FixedStep(rates, run), x_(size()), new_(size()) {
    for (auto& k : k_) k.resize(size());
  }

 protected:
  // Nothing is kept from step to step, so that any state may be the start of the next one.
  Result<void> begin(double, std::span<const double>) override { return {}; }
  void save_start() override {}
  void load_start() override {}

  Result<void> advance(double t, std::span<const double> x0, double h,
                       std::span<double> x1) override {
    RMP_TRY(rate(t, x0, k_[0]));
    k_[1] = k_[0];
    // Each pass computes k1, and k2 with it (Gauss and Seidel); what changes is h k. Passes
    // contract by h |df/dx| / 4 or so: where that is not below 1, repeat() tells the user.
    RMP_TRY(repeat(t, h, [&](double& change, double& size) -> Result<void> {
      for (std::size_t s = 0; s < 2; ++s) {
        for (std::size_t i = 0; i < x0.size(); ++i)
          x_[i] = x0[i] + h * (kA[s][0] * k_[0][i] + kA[s][1] * k_[1][i]);
        RMP_TRY(rate(t + kC[s] * h, x_, new_));
        for (std::size_t i = 0; i < x0.size(); ++i) {
          change = std::max(change, std::fabs(h * (new_[i] - k_[s][i])));
          size = std::max(size, std::fabs(x0[i]) + std::fabs(h * new_[i]));
        }
        k_[s] = new_;
      }
      return {};
    }));
    for (std::size_t i = 0; i < x0.size(); ++i) x1[i] = x0[i] + h / 2 * (k_[0][i] + k_[1][i]);
    return {};
  }

 private:
  std::vector<double> k_[2], x_, new_;
};

class GaussLegendre final : public Integrator {
 public:
  Result<void> prepare(const Params&) override { return {}; }
  Result<OdeStatistics> run(OdeSystem& system, const OdeRun& run, OdeSink& sink,
                            Progress& progress) const override {
    return spatial::run_steps<Steps>(system, run, sink, progress);
  }
};

}  // namespace

// The suite reads the tags: the order to be seen, and that energy has to stay in bounds.
RMP_PLUGIN("org.example.gauss_legendre", "0.1.0", "Apache-2.0", "An integrator as an example.",
           RMP_PROVIDER_NO_PARAMS(GaussLegendre, "gauss_legendre",
                                  "Implicit, order 4, symplectic, with a fixed step.",
                                  "fixed_step,order=4,symplectic"))
