// SPDX-License-Identifier: Apache-2.0
// Methods that treat positions and velocities alike and so keep the energy of a free motion in
// bounds over any time (layer: plugin). Semi-implicit Euler; velocity Verlet (L. Verlet, Phys. Rev.
// 159, 1967); Yoshida's composition of order 4 (H. Yoshida, Phys. Lett. A 150, 1990). Where
// accelerations depend on velocities the second half kick is implicit, so that a step stays
// symmetric in time (Hairer, Lubich, Wanner, Geometric Numerical Integration, II.4 and VI.3).
#include <algorithm>
#include <cmath>

#include "methods.h"
#include "spatial/ode_fixed_step.h"

namespace robomosp::integrators {
namespace {

class SymplecticSteps final : public spatial::FixedStep {
 public:
  SymplecticSteps(spatial::Rates& rates, const OdeRun& run, Symplectic::Method method)
      : FixedStep(rates, run),
        method_(method),
        positions_(rates.system().positions()),
        is_plain_(size() == 2 * positions_),
        now_(size()),
        at_start_(size()),
        dx_(size()),
        from_(size()),
        middle_(size()) {}

 protected:
  Result<void> begin(double t, std::span<const double> x) override { return rate(t, x, now_); }
  void save_start() override { at_start_ = now_; }
  void load_start() override { now_ = at_start_; }
  Result<void> advance(double t, std::span<const double> x0, double h,
                       std::span<double> x1) override {
    std::copy(x0.begin(), x0.end(), x1.begin());
    if (method_ == Symplectic::Method::euler) {
      kick(h, x1, x1);
      RMP_TRY(drift(t, h, x1));
      return rate(t + h, x1, now_);
    }
    if (method_ == Symplectic::Method::verlet) return verlet(t, h, x1);
    const double root = std::cbrt(2.0), outer = 1 / (2 - root), inner = -root * outer;
    RMP_TRY(verlet(t, outer * h, x1));
    RMP_TRY(verlet(t + outer * h, inner * h, x1));
    return verlet(t + (outer + inner) * h, outer * h, x1);
  }

 private:
  /// v = v0 + h a with the accelerations of `now_`.
  void kick(double h, std::span<const double> x0, std::span<double> x) const {
    for (std::size_t i = positions_; i < x.size(); ++i) x[i] = x0[i] + h * now_[i];
  }

  /// Kick, drift, kick; `now_` holds the rates at its start and, after it, at its end.
  Result<void> verlet(double t, double h, std::span<double> x) {
    kick(h / 2, x, x);
    RMP_TRY(drift(t, h, x));
    from_.assign(x.begin(), x.end());
    kick(h / 2, from_, x);  // a first guess with the accelerations of before
    return repeat(t, h, [&](double& change, double& size) -> Result<void> {
      RMP_TRY(rate(t + h, x, now_));
      for (std::size_t i = positions_; i < x.size(); ++i) {
        const double v = from_[i] + h / 2 * now_[i];
        change = std::max(change, std::fabs(v - x[i]));
        size = std::max(size, std::fabs(from_[i]) + std::fabs(h * now_[i]));
        x[i] = v;
      }
      return {};
    });
  }

  /// Moves the positions with the velocities held: plain addition, or by the implicit midpoint
  /// rule where rates of coordinates depend on the coordinates (quaternions).
  Result<void> drift(double t, double h, std::span<double> x) {
    if (is_plain_) {
      for (std::size_t i = 0; i < positions_; ++i) x[i] += h * x[positions_ + i];
      return {};
    }
    from_.assign(x.begin(), x.end());
    middle_ = from_;
    return repeat(t, h, [&](double& change, double& size) -> Result<void> {
      RMP_TRY(rate(t + h / 2, middle_, dx_));
      for (std::size_t i = 0; i < positions_; ++i) {
        const double q = from_[i] + h / 2 * dx_[i];
        change = std::max(change, std::fabs(q - middle_[i]));
        size = std::max(size, std::fabs(from_[i]) + std::fabs(h * dx_[i]));
        middle_[i] = q;
        x[i] = from_[i] + h * dx_[i];
      }
      return {};
    });
  }

  Symplectic::Method method_;
  std::size_t positions_;
  bool is_plain_;
  std::vector<double> now_, at_start_, dx_, from_, middle_;
};

}  // namespace

Result<void> Symplectic::prepare(const Params& params) {
  const auto chosen = params.text("method");
  method_ = chosen == "euler"      ? Method::euler
            : chosen == "yoshida4" ? Method::yoshida4
                                   : Method::verlet;
  return {};
}

Result<OdeStatistics> Symplectic::run(OdeSystem& system, const OdeRun& run, OdeSink& sink,
                                      Progress& progress) const {
  return spatial::run_steps<SymplecticSteps>(system, run, sink, progress, method_);
}

}  // namespace robomosp::integrators
