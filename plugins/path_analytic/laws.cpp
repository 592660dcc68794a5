// SPDX-License-Identifier: Apache-2.0
// Motion law "constant_speed" (layer: plugin).
#include <algorithm>
#include <cmath>

#include "makers.h"

namespace robomosp::path_analytic {
namespace {

// Times this share of the duration beyond an end are that end: callers reach it by sums of steps.
constexpr double kRounding = 1e-12;

class ConstantSpeed final : public MotionLaw {
 public:
  explicit ConstantSpeed(double duration) : duration_(duration) {}
  [[nodiscard]] double duration() const override { return duration_; }
  void sample(std::span<const double> times, std::span<LawSample> out) const override {
    const double slack = kRounding * duration_;
    for (std::size_t i = 0; i < times.size(); ++i) {
      const bool is_moving = times[i] >= -slack && times[i] <= duration_ + slack;
      out[i] = {std::clamp(times[i] / duration_, 0.0, 1.0), is_moving ? 1 / duration_ : 0, 0, 0};
    }
  }

 private:
  double duration_;
};

}  // namespace

Result<std::unique_ptr<MotionLaw>> ConstantSpeedMaker::make(const LawTask& task,
                                                            const Params& params) const {
  double duration = params.real("duration");
  if (!(duration > 0)) {
    if (task.length > 0) {
      RMP_TRY_ASSIGN(const double speed, positive(params, "speed", "m/s"));
      duration = task.length / speed;
    }
    if (task.turn > 0) {
      RMP_TRY_ASSIGN(const double speed, positive(params, "angular_speed", "rad/s"));
      duration = std::max(duration, task.turn / speed);
    }
  }
  return std::unique_ptr<MotionLaw>(new ConstantSpeed(duration));
}

}  // namespace robomosp::path_analytic
