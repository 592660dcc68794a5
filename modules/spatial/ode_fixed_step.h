// SPDX-License-Identifier: Apache-2.0
// Methods with a fixed step (layer: data processing, spatial). States within a step come from a
// shorter step, so that samples and events are as exact as the method.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "spatial/ode_run.h"
#include "spatial/print.h"

namespace robomosp::spatial {

class FixedStep : public Stepper {
 public:
  FixedStep(Rates& rates, const OdeRun& run)
      : rates_(rates), h_(run.step), x0_(run.x0.size()), x1_(run.x0.size()) {}

  Result<void> restart(double t, std::span<const double> x) override {
    t1_ = t;
    x1_.assign(x.begin(), x.end());
    RMP_TRY(begin(t1_, x1_));
    return {};
  }
  Result<void> step(double limit) override {
    // The start's rates must be those of the new start when `between` has asked elsewhere.
    if (is_stale_) RMP_TRY(begin(t1_, x1_));
    is_stale_ = false;
    t0_ = t1_;
    x0_ = x1_;
    save_start();
    const double left = limit - t0_;
    const bool is_last = left <= h_ * (1 + 1e-9);
    if (!(t0_ + h_ > t0_))
      return error(ErrorCode::invalid_argument,
                   "the step of " + print_number(h_, 6) + " s is too small", "Give a longer step.",
                   at_time(t0_));
    t1_ = is_last ? limit : t0_ + h_;
    return advance(t0_, x0_, t1_ - t0_, x1_);
  }
  [[nodiscard]] double time() const override { return t1_; }
  [[nodiscard]] std::span<const double> state() const override { return x1_; }
  [[nodiscard]] int looks_for_events() const override { return 1; }
  Result<void> between(double t, std::span<double> x) override {
    is_stale_ = true;
    load_start();
    return advance(t0_, x0_, t - t0_, x);
  }

 protected:
  /// Rates at a point where steps begin.
  virtual Result<void> begin(double t, std::span<const double> x) = 0;
  /// Keeps what begin() or the last step left for the start of this one, and takes it back.
  virtual void save_start() = 0;
  virtual void load_start() = 0;
  /// From (t, x0) by h to x1.
  virtual Result<void> advance(double t, std::span<const double> x0, double h,
                               std::span<double> x1) = 0;
  Result<void> rate(double t, std::span<const double> x, std::span<double> dx) {
    RMP_TRY_ASSIGN(const bool finite, rates_(t, x, dx));
    if (!finite) return rate_not_finite(t);
    return {};
  }
  /// Implicit equations by repetition: calls pass(change, size) -> Result<void>, which improves the
  /// unknowns once and gives the greatest change and value, until nothing changes but rounding.
  template <class Pass>
  Result<void> repeat(double t, double h, Pass&& pass) {
    double before = std::numeric_limits<double>::infinity();
    for (int i = 0; i < kPasses; ++i) {
      double change = 0, size = 0;
      RMP_TRY(pass(change, size));
      if (change <= kRounding * size || (change >= before && change <= kSettled * size)) return {};
      before = change;
    }
    return error(ErrorCode::invalid_argument,
                 "the step of " + print_number(std::fabs(h), 6) +
                     " s is too long for the implicit equations of this method",
                 "Give a shorter step or choose dormand_prince.", at_time(t));
  }
  [[nodiscard]] std::size_t size() const { return x0_.size(); }
  Rates& rates_;

 private:
  // A change of rounding, relative to the values; at the least `kSettled` once it no longer falls.
  static constexpr double kRounding = 4e-16, kSettled = 1e-11;
  static constexpr int kPasses = 60;
  double h_, t0_ = 0, t1_ = 0;
  std::vector<double> x0_, x1_;
  bool is_stale_ = false;
};

}  // namespace robomosp::spatial
