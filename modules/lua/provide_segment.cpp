// SPDX-License-Identifier: Apache-2.0
// Trajectory segments written in Lua (layer: application, lua).
#include <algorithm>
#include <cmath>

#include <robomosp/sdk/trajectory.h>

#include "lua/provide.h"
#include "spatial/pose.h"
#include "spatial/rotation.h"

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

  void sample(std::span<const double> times, std::span<PathSample> out) const override {
    const double step = duration_ / static_cast<double>(samples_.size() - 1);
    for (std::size_t n = 0; n < times.size(); ++n) {
      if (times[n] <= 0 || times[n] >= duration_) {
        out[n] = PathSample{
            times[n] <= 0 ? samples_.front().pose : samples_.back().pose, {}, {}, {}, {}};
        if (times[n] < 0 || times[n] > duration_) continue;
        out[n] = times[n] <= 0 ? samples_.front() : samples_.back();
        continue;
      }
      const auto i = std::min(static_cast<std::size_t>(times[n] / step), samples_.size() - 2);
      out[n] =
          between(samples_[i], samples_[i + 1], step, times[n] / step - static_cast<double>(i));
    }
  }

 private:
  struct Motion {
    double x, v, a;
  };
  /// Quintic Hermite interpolation at u in 0..1 over a step h.
  static Motion hermite(const Motion& s, const Motion& e, double h, double u) {
    const double d0 = s.x, d1 = s.v * h, d2 = s.a * h * h / 2;
    const double dx = e.x - (d0 + d1 + d2), dv = e.v * h - (d1 + 2 * d2), da = e.a * h * h - 2 * d2;
    const double c3 = 10 * dx - 4 * dv + da / 2, c4 = -15 * dx + 7 * dv - da,
                 c5 = 6 * dx - 3 * dv + da / 2;
    return {d0 + u * (d1 + u * (d2 + u * (c3 + u * (c4 + u * c5)))),
            (d1 + u * (2 * d2 + u * (3 * c3 + u * (4 * c4 + u * 5 * c5)))) / h,
            (2 * d2 + u * (6 * c3 + u * (12 * c4 + u * 20 * c5))) / (h * h)};
  }
  static PathSample between(const PathSample& a, const PathSample& b, double h, double u) {
    PathSample out;
    for (std::size_t k = 0; k < 3; ++k) {
      const Motion m = hermite({a.pose.p[k], a.velocity[k], a.acceleration[k]},
                               {b.pose.p[k], b.velocity[k], b.acceleration[k]}, h, u);
      out.pose.p[k] = m.x;
      out.velocity[k] = m.v;
      out.acceleration[k] = m.a;
    }
    // The turn within one step is small, so its rotation vector may be treated as a position.
    const Vec3 turn = spatial::rotation_difference(a.pose.R, b.pose.R);
    Vec3 part{};
    for (std::size_t k = 0; k < 3; ++k) {
      const Motion m = hermite({0, a.angular_velocity[k], a.angular_acceleration[k]},
                               {turn[k], b.angular_velocity[k], b.angular_acceleration[k]}, h, u);
      part[k] = m.x;
      out.angular_velocity[k] = m.v;
      out.angular_acceleration[k] = m.a;
    }
    Pose delta, start;
    delta.R = spatial::rotation_exp(part);
    start.R = a.pose.R;
    out.pose.R = spatial::compose(delta, start).R;
    return out;
  }

  double duration_, length_ = 0;
  std::vector<PathSample> samples_;
};

/// fn(points, params, t) -> pose, and the duration for t == nil; or {duration = number | fn,
/// sample = fn}.
class LuaSegmentMaker final : public SegmentMaker {
 public:
  explicit LuaSegmentMaker(ProviderPtr p) : p_(std::move(p)) {}

  Result<std::unique_ptr<Segment>> make(std::span<const Pose> points,
                                        const Params& params) const override {
    double duration = 0;
    std::vector<Pose> poses;
    Call call_script(*p_);
    const auto sampled = call_script.run([&](Impl& impl, lua_State* L) -> Result<void> {
      lua_createtable(L, static_cast<int>(points.size()), 0);
      const int list = lua_gettop(L);
      for (std::size_t i = 0; i < points.size(); ++i) {
        push(impl, L, pose_value(points[i]));
        lua_rawseti(L, list, static_cast<lua_Integer>(i + 1));
      }
      push_params(impl, L, p_->schema, params);
      const int values = lua_gettop(L);
      call_script.push_function(L, "duration");
      if (lua_isfunction(L, -1)) {
        lua_pushvalue(L, list);
        lua_pushvalue(L, values);
        RMP_TRY(call(impl, L, 2, 1));
      }
      duration = lua_type(L, -1) == LUA_TNUMBER ? static_cast<double>(lua_tonumber(L, -1)) : 0.0;
      if (!(duration > 0) || !std::isfinite(duration))
        return failed(*p_, "the duration is not a number above 0 [s]",
                      "Return the duration when t is nil, or give duration = seconds.");
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
    return std::unique_ptr<Segment>(
        std::make_unique<SampledSegment>(duration, with_rates(poses, duration)));
  }

 private:
  /// 2 ms apart, within 201..20001 samples.
  static std::size_t sample_count(double duration) {
    return static_cast<std::size_t>(std::clamp(std::ceil(duration / 0.002), 200.0, 20000.0)) + 1;
  }

  /// Rates by finite differences of fourth order.
  static std::vector<PathSample> with_rates(const std::vector<Pose>& poses, double duration) {
    const std::size_t n = poses.size();
    const double h = duration / static_cast<double>(n - 1);
    std::vector<PathSample> out(n);
    for (std::size_t i = 0; i < n; ++i) {
      out[i].pose = poses[i];
      for (std::size_t k = 0; k < 3; ++k) {
        const auto at = [&](std::size_t j) { return poses[j].p[k]; };
        out[i].velocity[k] = first_difference(at, i, n, h);
        out[i].acceleration[k] = second_difference(at, i, n, h);
        // Orientation as the rotation vector from this sample to its neighbours.
        const auto turned = [&](std::size_t j) {
          return spatial::rotation_difference(poses[i].R, poses[j].R)[k];
        };
        out[i].angular_velocity[k] = first_difference(turned, i, n, h);
        out[i].angular_acceleration[k] = second_difference(turned, i, n, h);
      }
    }
    return out;
  }
  // Coefficients of fourth order on equidistant points: central ones inside, one-sided ones for the
  // last two points of either end (`x` counted from that end).
  template <class At>
  static double first_difference(const At& x, std::size_t i, std::size_t n, double h) {
    if (i >= 2 && i + 2 < n) return (x(i - 2) - 8 * x(i - 1) + 8 * x(i + 1) - x(i + 2)) / (12 * h);
    const bool at_start = i < 2;
    const auto y = [&](std::size_t k) { return x(at_start ? k : n - 1 - k); };
    const std::size_t k = at_start ? i : n - 1 - i;
    const double slope = k == 0 ? -25 * y(0) + 48 * y(1) - 36 * y(2) + 16 * y(3) - 3 * y(4)
                                : -3 * y(0) - 10 * y(1) + 18 * y(2) - 6 * y(3) + y(4);
    return (at_start ? slope : -slope) / (12 * h);
  }
  template <class At>
  static double second_difference(const At& x, std::size_t i, std::size_t n, double h) {
    if (i >= 2 && i + 2 < n)
      return (-x(i - 2) + 16 * x(i - 1) - 30 * x(i) + 16 * x(i + 1) - x(i + 2)) / (12 * h * h);
    const bool at_start = i < 2;
    const auto y = [&](std::size_t k) { return x(at_start ? k : n - 1 - k); };
    const std::size_t k = at_start ? i : n - 1 - i;
    const double bend =
        k == 0 ? 45 * y(0) - 154 * y(1) + 214 * y(2) - 156 * y(3) + 61 * y(4) - 10 * y(5)
               : 10 * y(0) - 15 * y(1) - 4 * y(2) + 14 * y(3) - 6 * y(4) + y(5);
    return bend / (12 * h * h);
  }

  ProviderPtr p_;
};

}  // namespace

void* make_lua_segment(ProviderPtr p) {
  return static_cast<SegmentMaker*>(new LuaSegmentMaker(std::move(p)));
}

}  // namespace robomosp::lua
