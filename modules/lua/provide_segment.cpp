// SPDX-License-Identifier: Apache-2.0
// Trajectory segments written in Lua (layer: application, lua).
#include <algorithm>
#include <cmath>

#include <robomosp/sdk/trajectory.h>

#include "lua/provide.h"
#include "lua/sampled.h"

namespace robomosp::lua {
namespace {

/// A path that a script described, sampled once when it was made: the SDK lets any thread sample a
/// segment, and Lua has only one. Quintic between the samples, so rates are continuous.
class SampledSegment final : public Segment {
 public:
  SampledSegment(double duration, std::vector<PathSample> samples)
      : duration_(duration), samples_(std::move(samples)) {
    for (std::size_t i = 1; i < samples_.size(); ++i) {
      const Vec3 &a = samples_[i - 1].pose.p, &b = samples_[i].pose.p;
      length_ += std::hypot(b[0] - a[0], b[1] - a[1], b[2] - a[2]);
    }
  }
  [[nodiscard]] double duration() const override { return duration_; }
  [[nodiscard]] double length() const override { return length_; }

  Result<void> sample(std::span<const double> times, std::span<PathSample> out) const override {
    const double step = duration_ / static_cast<double>(samples_.size() - 1);
    for (std::size_t n = 0; n < times.size(); ++n) {
      if (times[n] <= 0 || times[n] >= duration_) {
        out[n] = PathSample{
            times[n] <= 0 ? samples_.front().pose : samples_.back().pose, {}, {}, {}, {}};
        if (times[n] < 0 || times[n] > duration_) continue;
        out[n] = times[n] <= 0 ? samples_.front() : samples_.back();
        continue;
      }
      const std::size_t i = step_at(times[n] / step, samples_.size());
      out[n] =
          between(samples_[i], samples_[i + 1], step, times[n] / step - static_cast<double>(i));
    }
    return {};
  }

 private:
  double duration_, length_ = 0;
  std::vector<PathSample> samples_;
};

/// fn(points, params, t) -> pose, and the duration for t == nil; or {duration = number | fn,
/// sample = fn}.
class LuaSegmentFactory final : public SegmentFactory {
 public:
  explicit LuaSegmentFactory(ProviderPtr p) : p_(std::move(p)) {}

  Result<std::unique_ptr<Segment>> make(std::span<const Pose> points,
                                        const Params& params) const override {
    double duration = 0;
    std::vector<Pose> poses;
    Call call_script(*p_);
    const auto sampled = call_script.run([&](Impl& impl, lua_State* L) -> Result<void> {
      push_poses(impl, L, points);
      const int list = lua_gettop(L);
      push_params(impl, L, p_->schema, params);
      const int values = lua_gettop(L);
      RMP_TRY_ASSIGN(duration, read_duration(call_script, impl, L, *p_, list, values));
      const auto count = sample_count(duration);
      poses.reserve(count);
      const double step = duration / static_cast<double>(count - 1);
      for (std::size_t i = 0; i < count; ++i) {
        lua_settop(L, values);
        call_script.push_function(L, "sample");
        lua_pushvalue(L, list);
        lua_pushvalue(L, values);
        lua_pushnumber(L, i + 1 == count ? duration : step * static_cast<double>(i));
        RMP_TRY(call(impl, L, 3, 1));
        RMP_TRY_ASSIGN(const Pose pose, read_pose(*p_, L, -1, "the pose"));
        poses.push_back(pose);
      }
      return {};
    });
    if (!sampled.ok()) return sampled.error();
    return std::unique_ptr<Segment>(std::make_unique<SampledSegment>(
        duration, with_rates(poses, duration / static_cast<double>(poses.size() - 1))));
  }

 private:
  ProviderPtr p_;
};

}  // namespace

RMP_LUA_PROVIDER(SegmentFactory, LuaSegmentFactory, "sample");

}  // namespace robomosp::lua
