// SPDX-License-Identifier: Apache-2.0
// Motion laws in closed form over the whole way: cubic, quintic, cycloidal (layer: plugin).
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "laws.h"

namespace robomosp::path_analytic {
namespace {

using spatial::print_number;

constexpr double kRounding = 1e-12;

/// A law by the share of its duration; `shape` gives way, and derivatives with respect to it.
class ShapeLaw : public MotionLaw {
 public:
  explicit ShapeLaw(double duration) : duration_(duration) {}
  [[nodiscard]] double duration() const override { return duration_; }
  Result<void> sample(std::span<const double> times, std::span<LawSample> out) const override {
    const double slack = kRounding * duration_, d = duration_;
    for (std::size_t i = 0; i < times.size(); ++i) {
      const bool is_moving = times[i] >= -slack && times[i] <= d + slack;
      const LawSample s = shape(std::clamp(times[i] / d, 0.0, 1.0));
      out[i] = {std::clamp(s.share, 0.0, 1.0), 0, 0, 0};
      if (is_moving)
        out[i] = {out[i].share, s.rate / d, s.acceleration / (d * d), s.jerk / (d * d * d)};
    }
    return {};
  }
  [[nodiscard]] virtual LawSample shape(double x) const = 0;

 protected:
  double duration_;
};

class Polynomial final : public ShapeLaw {
 public:
  Polynomial(double duration, const std::array<double, 6>& c) : ShapeLaw(duration), c_(c) {}
  [[nodiscard]] LawSample shape(double x) const override {
    const auto& c = c_;
    return {x * (c[1] + x * (c[2] + x * (c[3] + x * (c[4] + x * c[5])))),
            c[1] + x * (2 * c[2] + x * (3 * c[3] + x * (4 * c[4] + x * 5 * c[5]))),
            2 * c[2] + x * (6 * c[3] + x * (12 * c[4] + x * 20 * c[5])),
            6 * c[3] + x * (24 * c[4] + x * 60 * c[5])};
  }

 private:
  std::array<double, 6> c_;
};

/// s = x - sin(2 pi x) / (2 pi).
class Cycloid final : public ShapeLaw {
 public:
  using ShapeLaw::ShapeLaw;
  [[nodiscard]] LawSample shape(double x) const override {
    constexpr double w = 2 * std::numbers::pi;
    const double s = std::sin(w * x), c = std::cos(w * x);
    return {x - s / w, 1 - c, w * s, w * w * c};
  }
};

std::unique_ptr<ShapeLaw> cubic(double T, double v0, double v1) {
  const double a = v0 * T, b = v1 * T;
  return std::make_unique<Polynomial>(T,
                                      std::array<double, 6>{0, a, 3 - 2 * a - b, -2 + a + b, 0, 0});
}
std::unique_ptr<ShapeLaw> quintic(double T, double v0, double v1) {
  const double a = v0 * T, b = v1 * T;
  return std::make_unique<Polynomial>(
      T,
      std::array<double, 6>{0, a, 0, 10 - 6 * a - 4 * b, -15 + 8 * a + 7 * b, 6 - 3 * a - 3 * b});
}

/// What a shape asks for at its most.
struct Extremes {
  double fastest = 0, slowest = 0, acceleration = 0;  ///< in time [1/s, 1/s^2]
};
Extremes extremes(const ShapeLaw& law) {
  constexpr std::size_t kSteps = 400;
  const double T = law.duration();
  std::array<LawSample, kSteps + 1> samples;
  for (std::size_t i = 0; i <= kSteps; ++i) samples[i] = law.shape(static_cast<double>(i) / kSteps);
  // Where the derivative changes its sign, the extreme follows from it to fourth order: the cubic
  // through values and derivatives of both samples has it near where the derivative's line is 0.
  const auto greatest = [&](const auto& value, const auto& slope) {
    double most = value(samples[0]);
    for (std::size_t i = 0; i < kSteps; ++i) {
      most = std::max(most, value(samples[i + 1]));
      const double a = slope(samples[i]), b = slope(samples[i + 1]);
      if (!(a > 0 && b < 0)) continue;
      const double x = (static_cast<double>(i) + a / (a - b)) / kSteps;
      most = std::max(most, value(law.shape(x)));
    }
    return most;
  };
  const auto of = [](double sign, double LawSample::*member) {
    return [=](const LawSample& s) { return sign * s.*member; };
  };
  const auto rate = &LawSample::rate, acceleration = &LawSample::acceleration,
             jerk = &LawSample::jerk;
  return {greatest(of(1, rate), of(1, acceleration)) / T,
          -greatest(of(-1, rate), of(-1, acceleration)) / T,
          std::max(greatest(of(1, acceleration), of(1, jerk)),
                   greatest(of(-1, acceleration), of(-1, jerk))) /
              (T * T)};
}

/// The shortest duration that keeps the limits, or the one that was asked for, checked.
template <class Make>
Result<std::unique_ptr<MotionLaw>> shaped(const LawTask& task, const Params& params,
                                          const EndRates& ends, Make&& make) {
  double duration = params.real("duration");
  if (!(duration > 0)) {
    RMP_TRY_ASSIGN(const double rate, greatest_rate(task, params));
    RMP_TRY_ASSIGN(const double acceleration, greatest_acceleration(task, params));
    for (const double end : {ends.start, ends.end})
      if (end > rate * (1 + kRounding))
        return bad("a speed at an end is above the maximum speed", "Lower it, or raise the speed.");
    const auto is_within = [&](double T) {
      const Extremes e = extremes(*make(T));
      return e.fastest <= rate * (1 + 1e-12) && e.acceleration <= acceleration * (1 + 1e-12);
    };
    double low = 0, high = 1 / rate;
    constexpr int kMost = 60;
    for (int i = 0; i < kMost && !is_within(high); ++i) low = high, high *= 1.5;
    for (int i = 0; i < kMost; ++i) {
      const double middle = (low + high) / 2;
      (is_within(middle) ? high : low) = middle;
    }
    duration = high;
    if (!is_within(duration))
      return bad("no duration meets the limits with these speeds at the ends",
                 "Raise the acceleration, or lower the speeds at the ends.");
  }
  auto law = make(duration);
  if (extremes(*law).slowest < -1e-9 / duration)
    return bad("in " + print_number(duration) + " s the tool would run past the end and turn back",
               "Shorten the duration, or lower the speeds at the ends.");
  return std::unique_ptr<MotionLaw>(std::move(law));
}

}  // namespace

Result<std::unique_ptr<MotionLaw>> CubicFactory::make(const LawTask& task,
                                                      const Params& params) const {
  RMP_TRY_ASSIGN(const EndRates ends, end_rates(task, params));
  return shaped(task, params, ends, [&](double T) { return cubic(T, ends.start, ends.end); });
}

Result<std::unique_ptr<MotionLaw>> QuinticFactory::make(const LawTask& task,
                                                        const Params& params) const {
  RMP_TRY_ASSIGN(const EndRates ends, end_rates(task, params));
  return shaped(task, params, ends, [&](double T) { return quintic(T, ends.start, ends.end); });
}

Result<std::unique_ptr<MotionLaw>> CycloidalFactory::make(const LawTask& task,
                                                          const Params& params) const {
  return shaped(task, params, {}, [](double T) { return std::make_unique<Cycloid>(T); });
}

}  // namespace robomosp::path_analytic
