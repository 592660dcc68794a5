// SPDX-License-Identifier: Apache-2.0
// Curves, motion laws and orientations written in Lua (layer: application, lua). Each is sampled
// once when it is made, since any thread may ask it later and Lua has only one.
#include <algorithm>
#include <cmath>

#include <robomosp/sdk/curve.h>
#include <robomosp/sdk/motion_law.h>
#include <robomosp/sdk/orientation.h>

#include "kernel/text.h"
#include "lua/provide.h"
#include "lua/sampled.h"

namespace robomosp::lua {
namespace {

/// Of curves and orientations.
constexpr std::size_t kSamples = 1001;
constexpr double kStep = 1.0 / (kSamples - 1);
double place_of_sample(std::size_t i) {
  return i + 1 == kSamples ? 1 : kStep * static_cast<double>(i);
}

class SampledCurve final : public Curve {
 public:
  std::array<std::vector<SampledMotion>, 3> axes;
  std::vector<double> shares;  ///< of the control points

  [[nodiscard]] double end() const override { return 1; }
  [[nodiscard]] std::vector<double> knots() const override { return shares; }
  Result<void> evaluate(std::span<const double> u, std::span<CurveSample> out) const override {
    for (std::size_t n = 0; n < u.size(); ++n) {
      const double place = u[n] / kStep;
      const std::size_t i = step_at(place, kSamples);
      for (std::size_t k = 0; k < 3; ++k) {
        const SampledMotion m =
            hermite(axes[k][i], axes[k][i + 1], kStep, place - static_cast<double>(i));
        out[n].p[k] = m.x;
        out[n].d1[k] = m.v;
        out[n].d2[k] = m.a;
        out[n].d3[k] = m.j;
      }
    }
    return {};
  }
};

/// place(points, params, u) -> {x, y, z} for u in 0..1; `knots`, a function of (points, params),
/// tells u of every point, else they are evenly apart.
class LuaCurveFactory final : public CurveFactory {
 public:
  explicit LuaCurveFactory(ProviderPtr p) : p_(std::move(p)) {}

  Result<std::unique_ptr<Curve>> make(std::span<const Pose> points,
                                      const Params& params) const override {
    auto curve = std::make_unique<SampledCurve>();
    std::array<std::vector<double>, 3> places;
    Call call_script(*p_);
    const auto sampled = call_script.run([&](Impl& impl, lua_State* L) -> Result<void> {
      push_poses(impl, L, points);
      const int list = lua_gettop(L);
      push_params(impl, L, p_->schema, params);
      const int values = lua_gettop(L);
      for (std::size_t i = 0; i < kSamples; ++i) {
        lua_settop(L, values);
        call_script.push_function(L, "place");
        lua_pushvalue(L, list);
        lua_pushvalue(L, values);
        lua_pushnumber(L, place_of_sample(i));
        RMP_TRY(call(impl, L, 3, 2));
        RMP_TRY(check_refusal(*p_, L, {}));
        RMP_TRY_ASSIGN(const Vec3 place, read_vec3(*p_, L, -2, "the place"));
        for (std::size_t k = 0; k < 3; ++k) places[k].push_back(place[k]);
      }
      lua_settop(L, values);
      RMP_TRY_ASSIGN(curve->shares, knots(call_script, impl, L, list, values, points.size()));
      return {};
    });
    if (!sampled.ok()) return sampled.error();
    for (std::size_t k = 0; k < 3; ++k) curve->axes[k] = with_rates(places[k], kStep);
    return std::unique_ptr<Curve>(std::move(curve));
  }

 private:
  Result<std::vector<double>> knots(Call& call_script, Impl& impl, lua_State* L, int list,
                                    int values, std::size_t count) const {
    std::vector<double> out(count);
    for (std::size_t i = 1; i < count; ++i)
      out[i] = static_cast<double>(i) / static_cast<double>(count - 1);
    if (!call_script.push_optional(L, "knots")) return out;
    lua_pushvalue(L, list);
    lua_pushvalue(L, values);
    RMP_TRY(call(impl, L, 2, 1));
    RMP_TRY_ASSIGN(out, read_finite(*p_, L, -1, count, "the knots"));
    for (std::size_t i = 0; i < count; ++i)
      if (!(out[i] >= (i ? out[i - 1] : 0) && out[i] <= 1))
        return failed(*p_, "knot " + std::to_string(i + 1) + " is " + text::print(out[i]),
                      "Knots must increase within 0 to 1, one for each point.");
    return out;
  }

  ProviderPtr p_;
};

class SampledLaw final : public MotionLaw {
 public:
  SampledLaw(double duration, std::vector<SampledMotion> samples)
      : duration_(duration), samples_(std::move(samples)) {}
  [[nodiscard]] double duration() const override { return duration_; }
  Result<void> sample(std::span<const double> times, std::span<LawSample> out) const override {
    const double step = duration_ / static_cast<double>(samples_.size() - 1),
                 slack = 1e-12 * duration_;
    for (std::size_t n = 0; n < times.size(); ++n) {
      if (times[n] < -slack || times[n] > duration_ + slack) {
        out[n] = {times[n] < 0 ? 0.0 : 1.0, 0, 0, 0};
        continue;
      }
      const double place = std::clamp(times[n], 0.0, duration_) / step;
      const std::size_t i = step_at(place, samples_.size());
      const SampledMotion m =
          hermite(samples_[i], samples_[i + 1], step, place - static_cast<double>(i));
      out[n] = {std::clamp(m.x, 0.0, 1.0), m.v, m.a, m.j};
    }
    return {};
  }

 private:
  double duration_;
  std::vector<SampledMotion> samples_;
};

/// share(way, params, t) -> share of the way, and its rate and acceleration if it knows them;
/// `duration` [s] is a number, or a function of (way, params). `way` has length and turn.
class LuaLawFactory final : public MotionLawFactory {
 public:
  explicit LuaLawFactory(ProviderPtr p) : p_(std::move(p)) {}

  Result<std::unique_ptr<MotionLaw>> make(const LawTask& task,
                                          const Params& params) const override {
    double duration = 0;
    std::vector<double> shares;
    std::vector<SampledMotion> samples;
    bool has_rates = false;
    Call call_script(*p_);
    const auto sampled = call_script.run([&](Impl& impl, lua_State* L) -> Result<void> {
      lua_createtable(L, 0, 2);
      const int way = lua_gettop(L);
      set_number(L, "length", task.length);
      set_number(L, "turn", task.turn);
      push_params(impl, L, p_->schema, params);
      const int values = lua_gettop(L);
      RMP_TRY_ASSIGN(duration, read_duration(call_script, impl, L, *p_, way, values));
      const std::size_t count = sample_count(duration);
      const double step = duration / static_cast<double>(count - 1);
      for (std::size_t i = 0; i < count; ++i) {
        lua_settop(L, values);
        call_script.push_function(L, "share");
        lua_pushvalue(L, way);
        lua_pushvalue(L, values);
        const double t = i + 1 == count ? duration : step * static_cast<double>(i);
        lua_pushnumber(L, t);
        RMP_TRY(call(impl, L, 3, 3));
        RMP_TRY_ASSIGN(const SampledMotion m, read_sample(L, t));
        if (i == 0) has_rates = lua_isnumber(L, -2) != 0 && lua_isnumber(L, -1) != 0;
        if (i > 0 && m.x < shares.back() - 1e-9)
          return failed(*p_, "the tool would turn back at " + text::print_rounded(t) + " s",
                        "The path parameter must not decrease.");
        shares.push_back(m.x);
        samples.push_back(m);
      }
      const std::pair<double, double> ends[] = {{shares.front(), 0}, {shares.back(), 1}};
      for (const auto& [share, wanted] : ends)
        if (std::fabs(share - wanted) > 1e-9)
          return failed(*p_,
                        std::string("the path parameter at the ") +
                            (wanted == 0 ? "start" : "end") + " is " + text::print_rounded(share),
                        "It must run from 0 to 1 within the duration.");
      return {};
    });
    if (!sampled.ok()) return sampled.error();
    if (!has_rates) samples = with_rates(shares, duration / static_cast<double>(shares.size() - 1));
    return std::unique_ptr<MotionLaw>(std::make_unique<SampledLaw>(duration, std::move(samples)));
  }

 private:
  /// The three results on top; the last two may be missing.
  Result<SampledMotion> read_sample(lua_State* L, double t) const {
    double v[3] = {0, 0, 0};
    for (int k = 0; k < 3; ++k) {
      const int index = k - 3;
      if (k > 0 && lua_isnil(L, index)) continue;
      v[k] = lua_type(L, index) == LUA_TNUMBER ? static_cast<double>(lua_tonumber(L, index))
                                               : std::nan("");
      if (std::isfinite(v[k])) continue;
      static constexpr const char* kNames[] = {"share", "rate", "acceleration"};
      return failed(*p_,
                    std::string("the ") + kNames[k] + " at " + text::print_rounded(t) +
                        " s is not a finite number",
                    "Return the path parameter, 0 to 1, and its rates if they are known.");
    }
    return SampledMotion{v[0], v[1], v[2], 0};
  }

  ProviderPtr p_;
};

class SampledOrientation final : public Orientation {
 public:
  explicit SampledOrientation(std::vector<PathSample> samples) : samples_(std::move(samples)) {}
  Result<void> evaluate(std::span<const double> w, std::span<const CurveSample>,
                        std::span<OrientationSample> out) const override {
    for (std::size_t n = 0; n < w.size(); ++n) {
      const double place = w[n] / kStep;
      const std::size_t i = step_at(place, kSamples);
      const PathSample s =
          between(samples_[i], samples_[i + 1], kStep, place - static_cast<double>(i));
      out[n] = {s.pose.R, s.angular_velocity, s.angular_acceleration};
    }
    return {};
  }

 private:
  std::vector<PathSample> samples_;
};

/// orient(points, params, w, shares) -> a pose, of which only the orientation counts, at the share
/// w of the way; shares[i] is that of points[i].
class LuaOrientationFactory final : public OrientationFactory {
 public:
  explicit LuaOrientationFactory(ProviderPtr p) : p_(std::move(p)) {}

  Result<std::unique_ptr<Orientation>> make(const OrientationTask& task,
                                            const Params& params) const override {
    std::vector<Pose> poses;
    poses.reserve(kSamples);
    Call call_script(*p_);
    const auto sampled = call_script.run([&](Impl& impl, lua_State* L) -> Result<void> {
      push_poses(impl, L, task.points);
      const int list = lua_gettop(L);
      push_params(impl, L, p_->schema, params);
      const int values = lua_gettop(L);
      push_vector(impl, L, task.shares);
      const int shares = lua_gettop(L);
      for (std::size_t i = 0; i < kSamples; ++i) {
        lua_settop(L, shares);
        call_script.push_function(L, "orient");
        lua_pushvalue(L, list);
        lua_pushvalue(L, values);
        lua_pushnumber(L, place_of_sample(i));
        lua_pushvalue(L, shares);
        RMP_TRY(call(impl, L, 4, 2));
        RMP_TRY(check_refusal(*p_, L, {}));
        RMP_TRY_ASSIGN(Pose pose, read_pose(*p_, L, -2, "the pose"));
        pose.p = {};
        poses.push_back(pose);
      }
      return {};
    });
    if (!sampled.ok()) return sampled.error();
    return std::unique_ptr<Orientation>(
        std::make_unique<SampledOrientation>(with_rates(poses, kStep)));
  }

 private:
  ProviderPtr p_;
};

}  // namespace

RMP_LUA_PROVIDER(CurveFactory, LuaCurveFactory, "place");
RMP_LUA_PROVIDER(MotionLawFactory, LuaLawFactory, "share");
RMP_LUA_PROVIDER(OrientationFactory, LuaOrientationFactory, "orient");

}  // namespace robomosp::lua
