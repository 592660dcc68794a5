// SPDX-License-Identifier: Apache-2.0
#include "dormand_prince.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "spatial/ode_run.h"
#include "spatial/print.h"

namespace robomosp::integrators {
namespace {

using spatial::at_time;
using spatial::rate_not_finite;
using spatial::Rates;

constexpr double kC[7] = {0, 1.0 / 5, 3.0 / 10, 4.0 / 5, 8.0 / 9, 1, 1};
constexpr double kA[7][6] = {
    {},
    {1.0 / 5},
    {3.0 / 40, 9.0 / 40},
    {44.0 / 45, -56.0 / 15, 32.0 / 9},
    {19372.0 / 6561, -25360.0 / 2187, 64448.0 / 6561, -212.0 / 729},
    {9017.0 / 3168, -355.0 / 33, 46732.0 / 5247, 49.0 / 176, -5103.0 / 18656},
    {35.0 / 384, 0, 500.0 / 1113, 125.0 / 192, -2187.0 / 6784, 11.0 / 84}};
/// Weights of the fifth minus those of the fourth order.
constexpr double kE[7] = {71.0 / 57600,      0,          -71.0 / 16695, 71.0 / 1920,
                          -17253.0 / 339200, 22.0 / 525, -1.0 / 40};
/// Of the last coefficient of the dense output.
constexpr double kD[7] = {-12715105075.0 / 11282082432.0,  0,
                          87487479700.0 / 32700410799.0,   -10690763975.0 / 1880347072.0,
                          701980252875.0 / 199316789632.0, -1453857185.0 / 822651844.0,
                          69997945.0 / 29380423.0};

// Step control: h grows with err^-alpha errold^beta, within these factors.
constexpr double kBeta = 0.04, kAlpha = 0.2 - 0.75 * kBeta, kSafety = 0.9;
constexpr double kShrink = 0.2, kGrow = 10;
// The method's boundary of stability on the negative real axis, and how often in a row steps may
// lie on it before the problem counts as stiff.
constexpr double kStable = 3.25;
constexpr int kStiff = 15, kNotStiff = 6;

class DormandPrinceSteps final : public spatial::Stepper {
 public:
  DormandPrinceSteps(Rates& rates, const OdeRun& run, bool greatest, double max_step,
                     std::int64_t max_steps)
      : rates_(rates),
        run_(run),
        greatest_(greatest),
        max_step_(max_step > 0 ? max_step : std::numeric_limits<double>::infinity()),
        max_steps_(max_steps),
        h_(std::min(run.step, max_step_)),
        n_(run.x0.size()),
        x0_(n_),
        x1_(n_),
        before_(n_) {
    for (auto& k : k_) k.resize(n_);
    for (auto& c : dense_) c.resize(n_);
  }

  Result<void> restart(double t, std::span<const double> x) override {
    t1_ = t;
    x1_.assign(x.begin(), x.end());
    RMP_TRY_ASSIGN(const bool finite, rates_(t, x1_, k_[6]));
    if (!finite) return rate_not_finite(t);
    return {};
  }

  Result<void> step(double limit) override {
    t0_ = t1_;
    x0_.swap(x1_);
    k_[0].swap(k_[6]);
    bool was_rejected = false;
    for (;;) {
      double h = std::min(h_, max_step_);
      if (t0_ + 1.01 * h >= limit) h = limit - t0_;
      else if (t0_ + 2 * h > limit) h = (limit - t0_) / 2;  // no tiny rest
      if (!(t0_ + h > t0_) && t0_ < limit) return too_small(was_not_finite_);
      RMP_TRY(too_many(limit, h));
      RMP_TRY_ASSIGN(const bool finite, stages(h));
      const double err = finite ? norm(h) : std::numeric_limits<double>::infinity();
      if (!(err <= 1)) {
        ++rates_.statistics().rejected;
        was_not_finite_ = !std::isfinite(err);
        h_ = h * (was_not_finite_ ? 0.1 : std::max(kShrink, kSafety * std::pow(err, -kAlpha)));
        was_rejected = true;
        continue;
      }
      was_not_finite_ = false;
      watch_stiffness(h);
      double factor = kSafety * std::pow(std::max(err, 1e-10), -kAlpha) *
                      std::pow(std::max(last_error_, 1e-4), kBeta);
      factor = std::clamp(factor, kShrink, was_rejected ? 1.0 : kGrow);
      // A step cut short by the end says nothing about the next one, unless it asks for less.
      h_ = h < h_ && factor >= 1 ? std::max(h_, h * factor) : h * factor;
      last_error_ = err;
      t1_ = h == limit - t0_ ? limit : t0_ + h;
      taken_ = h;
      has_dense_ = false;
      return {};
    }
  }
  [[nodiscard]] double time() const override { return t1_; }
  [[nodiscard]] std::span<const double> state() const override { return x1_; }
  [[nodiscard]] int looks_for_events() const override { return 4; }

  Result<void> between(double t, std::span<double> x) override {
    if (!has_dense_) make_dense();
    const double s = (t - t0_) / taken_, r = 1 - s;
    for (std::size_t i = 0; i < n_; ++i)
      x[i] =
          x0_[i] + s * (dense_[0][i] + r * (dense_[1][i] + s * (dense_[2][i] + r * dense_[3][i])));
    return {};
  }

 private:
  Result<bool> stages(double h) {
    for (std::size_t s = 1; s < 7; ++s) {
      std::vector<double>& x = s == 5 ? before_ : x1_;
      for (std::size_t i = 0; i < n_; ++i) {
        double sum = 0;
        for (std::size_t j = 0; j < s; ++j) sum += kA[s][j] * k_[j][i];
        x[i] = x0_[i] + h * sum;
      }
      RMP_TRY_ASSIGN(const bool finite, rates_(t0_ + kC[s] * h, x, k_[s]));
      if (!finite) return false;
    }
    return true;
  }
  [[nodiscard]] double norm(double h) const {
    double sum = 0, greatest = 0;
    for (std::size_t i = 0; i < n_; ++i) {
      double e = 0;
      for (std::size_t j = 0; j < 7; ++j) e += kE[j] * k_[j][i];
      const double scale = run_.absolute_tolerance +
                           run_.relative_tolerance * std::max(std::fabs(x0_[i]), std::fabs(x1_[i]));
      const double r = e == 0 ? 0 : h * e / scale;
      sum += r * r;
      greatest = std::max(greatest, std::fabs(r));
      if (std::isnan(r)) return r;
    }
    return greatest_ || n_ == 0 ? greatest : std::sqrt(sum / static_cast<double>(n_));
  }
  void make_dense() {
    for (std::size_t i = 0; i < n_; ++i) {
      const double way = x1_[i] - x0_[i], first = taken_ * k_[0][i] - way;
      dense_[0][i] = way;
      dense_[1][i] = first;
      dense_[2][i] = way - taken_ * k_[6][i] - first;
      double last = 0;
      for (std::size_t j = 0; j < 7; ++j) last += kD[j] * k_[j][i];
      dense_[3][i] = taken_ * last;
    }
    has_dense_ = true;
  }
  /// h times the dominant eigenvalue, from the two stages at the end of the step.
  void watch_stiffness(double h) {
    double rate = 0, way = 0;
    for (std::size_t i = 0; i < n_; ++i) {
      rate += (k_[6][i] - k_[5][i]) * (k_[6][i] - k_[5][i]);
      way += (x1_[i] - before_[i]) * (x1_[i] - before_[i]);
    }
    if (!(way > 0)) return;
    if (h * std::sqrt(rate / way) > kStable) {
      ++stiff_;
      not_stiff_ = 0;
    } else if (++not_stiff_ >= kNotStiff) {
      stiff_ = 0;
    }
  }
  [[nodiscard]] Error too_small(bool not_finite) const {
    if (not_finite) return rate_not_finite(t0_);
    return error(ErrorCode::invalid_argument,
                 "the step became too small for the tolerance (relative " +
                     spatial::print_number(run_.relative_tolerance, 6) + ", absolute " +
                     spatial::print_number(run_.absolute_tolerance, 6) + ")",
                 "Loosen the tolerances, or look for a force that jumps or grows without bound.",
                 at_time(t0_));
  }
  [[nodiscard]] Result<void> too_many(double limit, double h) const {
    const OdeStatistics& s = rates_.statistics();
    const std::int64_t done = s.steps + s.rejected;
    const bool is_stiff = stiff_ >= kStiff;
    const bool hopeless = is_stiff && (limit - t0_) / h > static_cast<double>(max_steps_ - done);
    if (done < max_steps_ && !hopeless) return {};
    return error(ErrorCode::invalid_argument,
                 is_stiff ? "the motion is stiff: some part of it is much faster than the rest and "
                            "forces steps of " +
                                spatial::print_number(h, 6) + " s"
                          : "it takes more than " + std::to_string(max_steps_) + " steps",
                 is_stiff ? "Make springs and damping softer, or raise max_steps and wait."
                          : "Loosen the tolerances, shorten the run or raise max_steps.",
                 at_time(t0_));
  }

  Rates& rates_;
  const OdeRun& run_;
  bool greatest_;
  double max_step_;
  std::int64_t max_steps_;
  double h_, last_error_ = 1e-4, t0_ = 0, t1_ = 0, taken_ = 0;
  std::size_t n_;
  std::vector<double> x0_, x1_, before_;
  std::array<std::vector<double>, 7> k_;
  std::array<std::vector<double>, 4> dense_;
  bool has_dense_ = false, was_not_finite_ = false;
  int stiff_ = 0, not_stiff_ = 0;
};

}  // namespace

Result<void> DormandPrince::prepare(const Params& params) {
  greatest_error_ = params.text("norm") == "max";
  max_step_ = params.real("max_step");
  max_steps_ = params.integer("max_steps");
  return {};
}

Result<OdeStatistics> DormandPrince::run(OdeSystem& system, const OdeRun& run, OdeSink& sink,
                                         Progress& progress) const {
  return spatial::run_steps<DormandPrinceSteps>(system, run, sink, progress, greatest_error_,
                                                max_step_, max_steps_);
}

}  // namespace robomosp::integrators
