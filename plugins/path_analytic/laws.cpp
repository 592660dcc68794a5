// SPDX-License-Identifier: Apache-2.0
// Motion laws: constant speed and acceleration, trapezoid and S-curve of speed (layer: plugin).
#include <algorithm>
#include <cmath>
#include <limits>

#include "laws.h"
#include "spatial/ramps.h"

namespace robomosp::path_analytic {
namespace {

using spatial::print_number;
using spatial::RampLimits;
using spatial::Ramps;

class RampLaw final : public MotionLaw {
 public:
  explicit RampLaw(const Ramps& ramps) : ramps_(ramps) {}
  [[nodiscard]] double duration() const override { return ramps_.duration(); }
  Result<void> sample(std::span<const double> times, std::span<LawSample> out) const override {
    for (std::size_t i = 0; i < times.size(); ++i) {
      const spatial::Motion1 m = ramps_.at(times[i]);
      out[i] = {std::clamp(m.x, 0.0, 1.0), m.v, m.a, m.j};
    }
    return {};
  }

 private:
  Ramps ramps_;
};

std::unique_ptr<MotionLaw> law_of(const Ramps& ramps) { return std::make_unique<RampLaw>(ramps); }

/// From limits in space to one in shares of the way; the slower of moving and turning counts.
Result<double> in_shares(const LawTask& task, const Params& params, const char* moving,
                         const char* moving_unit, const char* turning, const char* turning_unit) {
  double least = std::numeric_limits<double>::infinity();
  if (task.length > 0) {
    RMP_TRY_ASSIGN(const double limit, positive(params, moving, moving_unit));
    least = limit / task.length;
  }
  if (task.turn > 0) {
    RMP_TRY_ASSIGN(const double limit, positive(params, turning, turning_unit));
    least = std::min(least, limit / task.turn);
  }
  return least;
}

/// From shares of the way to what the user knows: a speed [m/s], or [rad/s] on the spot.
std::string speed_text(const LawTask& task, double rate) {
  return task.length > 0 ? print_number(rate * task.length) + " m/s"
                         : print_number(rate * task.turn) + " rad/s";
}

Result<std::unique_ptr<MotionLaw>> ramps(const LawTask& task, const Params& params,
                                         const RampLimits& limits) {
  RMP_TRY_ASSIGN(const EndRates ends, end_rates(task, params));
  for (const double rate : {ends.start, ends.end})
    if (rate > limits.v * (1 + 1e-12))
      return bad("the speed at an end is " + speed_text(task, rate) + ", above the maximum of " +
                     speed_text(task, limits.v),
                 "Lower it, or raise the speed.");
  const double v0 = std::min(ends.start, limits.v), v1 = std::min(ends.end, limits.v);
  const auto fastest = spatial::fastest_ramps(1, v0, v1, limits);
  if (!fastest)
    return bad(
        "to change from " + speed_text(task, v0) + " to " + speed_text(task, v1) + " takes " +
            print_number(spatial::least_way(v0, v1, limits) *
                         (task.length > 0 ? task.length : task.turn)) +
            (task.length > 0 ? " m, but the path is " + print_number(task.length) + " m"
                             : " rad, but the rotation is " + print_number(task.turn) + " rad"),
        "Raise the acceleration (and jerk), or bring the speeds at the ends together.");
  const double duration = params.real("duration");
  if (!(duration > 0)) return law_of(*fastest);
  const auto timed = spatial::timed_ramps(1, v0, v1, limits, duration);
  if (timed) return law_of(*timed);
  if (duration < fastest->duration())
    return bad("a duration of " + print_number(duration) + " s is too short for the limits",
               "The shortest is " + print_number(fastest->duration()) + " s.");
  return bad("a duration of " + print_number(duration) + " s is too long with these end speeds",
             "The tool would have to turn back; lower the speeds at the ends.");
}

}  // namespace

Result<EndRates> end_rates(const LawTask& task, const Params& params) {
  EndRates out;
  const double start = params.real("start_speed"), end = params.real("end_speed");
  if (task.length > 0) {
    out = {start / task.length, end / task.length};
  } else if (start > 0 || end > 0) {
    return bad("a rotation in place starts and ends at rest",
               "Leave start_speed and end_speed out.");
  }
  return out;
}

Result<double> greatest_rate(const LawTask& task, const Params& params) {
  return in_shares(task, params, "speed", "m/s", "angular_speed", "rad/s");
}
Result<double> greatest_acceleration(const LawTask& task, const Params& params) {
  return in_shares(task, params, "acceleration", "m/s^2", "angular_acceleration", "rad/s^2");
}

Result<std::unique_ptr<MotionLaw>> ConstantSpeedFactory::make(const LawTask& task,
                                                              const Params& params) const {
  double duration = params.real("duration");
  if (!(duration > 0)) {
    RMP_TRY_ASSIGN(const double rate, greatest_rate(task, params));
    duration = 1 / rate;
  }
  Ramps ramps(0, 1 / duration);
  ramps.append(duration, 0, 0);
  return law_of(ramps);
}

Result<std::unique_ptr<MotionLaw>> ConstantAccelerationFactory::make(const LawTask& task,
                                                                     const Params& params) const {
  RMP_TRY_ASSIGN(const EndRates ends, end_rates(task, params));
  double v0 = ends.start, v1 = ends.end, duration = params.real("duration");
  if (const double ratio = params.real("start_ratio"); ratio > 0) {
    if (!(duration > 0) || v0 > 0 || v1 > 0)
      return bad("start_ratio needs a duration and no start_speed or end_speed",
                 "Give the duration, or start_speed instead.");
    v0 = ratio / duration;
  }
  if (duration > 0) {
    // Way = (v0 + v1) / 2 duration: one of the two follows.
    if (!(v1 > 0)) v1 = 2 / duration - v0;
    else v0 = 2 / duration - v1;
    if (!(v0 >= 0 && v1 >= 0))
      return bad("in " + print_number(duration) + " s the tool would run past the end",
                 "Shorten the duration to " + print_number(2 / (v0 < 0 ? v1 : v0)) +
                     " s or less, or lower the speed.");
  } else if (!(v1 > 0)) {
    RMP_TRY_ASSIGN(const double a, greatest_acceleration(task, params));
    v1 = std::sqrt(v0 * v0 + 2 * a);
  }
  duration = 2 / (v0 + v1);
  Ramps ramps(0, v0);
  ramps.append(duration, (v1 - v0) / duration, 0);
  return law_of(ramps);
}

Result<std::unique_ptr<MotionLaw>> TrapezoidalFactory::make(const LawTask& task,
                                                            const Params& params) const {
  RampLimits limits;
  RMP_TRY_ASSIGN(limits.v, greatest_rate(task, params));
  RMP_TRY_ASSIGN(limits.a, greatest_acceleration(task, params));
  return ramps(task, params, limits);
}

Result<std::unique_ptr<MotionLaw>> SCurveFactory::make(const LawTask& task,
                                                       const Params& params) const {
  RampLimits limits;
  RMP_TRY_ASSIGN(limits.v, greatest_rate(task, params));
  RMP_TRY_ASSIGN(limits.a, greatest_acceleration(task, params));
  RMP_TRY_ASSIGN(limits.j, in_shares(task, params, "jerk", "m/s^3", "angular_jerk", "rad/s^3"));
  return ramps(task, params, limits);
}

}  // namespace robomosp::path_analytic
