// SPDX-License-Identifier: Apache-2.0
// Methods with a fixed step (layer: data processing, spatial). States within a step come from a
// shorter step, so that samples and events are as exact as the method. A step that is too long for
// the motion is an error: where velocities change abruptly from step to step, and now and then,
// the step is repeated by two halves, and what both give is compared.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "spatial/ode_run.h"
#include "spatial/print.h"

namespace robomosp::spatial {

class FixedStep : public Stepper {
 public:
  FixedStep(Rates& rates, const OdeRun& run)
      : rates_(rates),
        h_(run.step),
        positions_(rates.system().positions()),
        x0_(run.x0.size()),
        x1_(run.x0.size()),
        change_(run.x0.size()),
        middle_(run.x0.size()),
        fine_(run.x0.size()) {}

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
    RMP_TRY(advance(t0_, x0_, t1_ - t0_, x1_));
    ++steps_;
    // A rest that is shorter is not comparable with the step before.
    if (t1_ - t0_ > 0.999 * h_) RMP_TRY(watch());
    // A run of so few steps that kMostCoarse cannot be compared is as wrong.
    if (is_last && coarse_ > 0 && coarse_ == compared_ && steps_ <= kMostCoarse + 1)
      return too_long();
    return {};
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
    if (finite) return {};
    Error e = rate_not_finite(t);
    e.hint = "Check forces, masses and the state at that time, or give a shorter step than " +
             print_number(h_, 6) + " s.";
    return e;
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
  /// Greatest changes of a step [those of positions, of velocities], or of what they differ by.
  struct Extent {
    double positions = 0, velocities = 0;
    [[nodiscard]] Extent greater(const Extent& other) const {
      return {std::max(positions, other.positions), std::max(velocities, other.velocities)};
    }
  };
  /// Greatest part of each kind of the numbers that entry(i) gives.
  template <class Entry>
  Extent extent(Entry&& entry) const {
    Extent e;
    for (std::size_t i = 0; i < x0_.size(); ++i) {
      double& part = i < positions_ ? e.positions : e.velocities;
      part = std::max(part, std::fabs(entry(i)));
    }
    // A system without velocities is watched by all that it has.
    if (positions_ >= x0_.size()) e.velocities = e.positions;
    return e;
  }

  /// After a whole step: counts those that are too long, and gives up at kMostCoarse.
  Result<void> watch() {
    const Extent change = extent([&](std::size_t i) { return x1_[i] - x0_[i]; });
    const Extent turn = extent([&](std::size_t i) { return x1_[i] - x0_[i] - change_[i]; });
    const Extent size = extent([&](std::size_t i) { return x1_[i]; });
    const Extent scale = change.greater(before_);
    const bool is_due = coarse_ > 0 || steps_ % kEvery == 2;
    const bool is_checked = has_change_ && scale.velocities > kStill * (1 + size.velocities) &&
                            (is_due || turn.velocities > kAbrupt * scale.velocities);
    has_change_ = true;
    before_ = change;
    for (std::size_t i = 0; i < x0_.size(); ++i) change_[i] = x1_[i] - x0_[i];
    if (!is_checked) return {};
    ++compared_;
    RMP_TRY_ASSIGN(const Extent apart, halves_apart());
    if (!(apart.velocities > kCoarse * scale.velocities) &&
        !(apart.positions > kCoarse * scale.positions)) {
      coarse_ = 0;
      return {};
    }
    return ++coarse_ < kMostCoarse ? Result<void>() : too_long();
  }
  [[nodiscard]] Error too_long() const {
    return error(ErrorCode::invalid_argument,
                 "the step of " + print_number(h_, 6) +
                     " s is too long for this motion: two steps of half the length give a "
                     "different result, by more than " +
                     print_number(100 * kCoarse, 3) + " % of the change in one step",
                 "Give a shorter step, or choose dormand_prince, which adapts its step.",
                 at_time(t0_));
  }
  /// How far two steps of half the length end from the last step. The next step begins anew.
  Result<Extent> halves_apart() {
    const double half = (t1_ - t0_) / 2;
    RMP_TRY(begin_at(t0_, x0_));
    RMP_TRY(advance(t0_, x0_, half, middle_));
    RMP_TRY(begin_at(t0_ + half, middle_));
    RMP_TRY(advance(t0_ + half, middle_, half, fine_));
    RMP_TRY(begin_at(t0_, x0_));  // for between()
    is_stale_ = true;
    return extent([&](std::size_t i) { return fine_[i] - x1_[i]; });
  }
  Result<void> begin_at(double t, std::span<const double> x) {
    RMP_TRY(begin(t, x));
    save_start();
    return {};
  }

  // Velocities change abruptly when their change differs by the part kAbrupt of the greater one
  // from that of the step before; a step is too long when two halves end elsewhere by the part
  // kCoarse. For an oscillation of w rad/s the limits of stability are h w = 2.83 for runge_kutta4,
  // 2 for verlet and euler, 1.57 for yoshida4; the first steps refused are 2.25, 1.56, 1.14, 1.24
  // (decision 0079). Changes of velocities below kStill [rad/s, m/s] are rounding.
  static constexpr double kAbrupt = 0.3, kCoarse = 0.3, kStill = 1e-9;
  /// So many in a row: single steps may be long, where a force jumps.
  static constexpr int kMostCoarse = 3;
  /// How often a step is repeated though nothing is abrupt: just beyond the limit of stability a
  /// motion may grow smoothly. It costs a sixteenth.
  static constexpr std::int64_t kEvery = 32;
  // A change of rounding, relative to the values; at the least `kSettled` once it no longer falls.
  static constexpr double kRounding = 4e-16, kSettled = 1e-11;
  static constexpr int kPasses = 60;
  double h_, t0_ = 0, t1_ = 0;
  std::size_t positions_;
  std::vector<double> x0_, x1_, change_, middle_, fine_;
  bool is_stale_ = false, has_change_ = false;
  int coarse_ = 0, compared_ = 0;
  std::int64_t steps_ = 0;
  Extent before_;
};

}  // namespace robomosp::spatial
