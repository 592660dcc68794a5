// SPDX-License-Identifier: Apache-2.0
// Curve "clothoid": its curvature grows evenly with its length, as a steered wheel's does. It
// starts at the first pose along its x axis and bends about its z axis; roads, rails and milling
// paths are joined to straight parts by it.
//
// With s the length, theta(s) = k0 s + (k1 - k0) s^2 / (2 L) is the angle of the tangent, and the
// place its integral (M. Abramowitz, I. Stegun, Handbook of Mathematical Functions, section 7.3).
#include <algorithm>
#include <array>
#include <cmath>

#include <robomosp/sdk/curve.h>
#include <robomosp/sdk/plugin.h>

namespace {

using namespace robomosp;

class Clothoid final : public Curve {
 public:
  Clothoid(const Pose& start, double length, double k0, double k1)
      : start_(start), length_(length), k0_(k0), change_((k1 - k0) / length) {
    // Places at the ends of steps within which the tangent turns by less than half a radian.
    const double turn = (std::fabs(k0) + std::fabs(k1)) * length;
    steps_ = static_cast<std::size_t>(std::ceil(2 * turn)) + 1;
    places_.assign(steps_ + 1, {0, 0});
    for (std::size_t i = 0; i < steps_; ++i) {
      const std::array<double, 2> way = integral(step() * static_cast<double>(i), step());
      places_[i + 1] = {places_[i][0] + way[0], places_[i][1] + way[1]};
    }
  }

  double end() const override { return length_; }
  bool is_even() const override { return true; }  // the parameter is the length
  std::vector<double> knots() const override { return {0}; }

  Result<void> evaluate(std::span<const double> u, std::span<CurveSample> out) const override {
    for (std::size_t i = 0; i < u.size(); ++i) {
      const double s = u[i], k = k0_ + change_ * s, theta = angle(s);
      const double c = std::cos(theta), n = std::sin(theta);
      const auto piece = std::min(static_cast<std::size_t>(s / step()), steps_ - 1);
      const double from = step() * static_cast<double>(piece);
      const std::array<double, 2> way = integral(from, s - from);
      out[i].p = in_frame(places_[piece][0] + way[0], places_[piece][1] + way[1]);
      for (std::size_t x = 0; x < 3; ++x) out[i].p[x] += start_.p[x];
      // The tangent turns with the curvature.
      out[i].d1 = in_frame(c, n);
      out[i].d2 = in_frame(-k * n, k * c);
      out[i].d3 = in_frame(-change_ * n - k * k * c, change_ * c - k * k * n);
    }
    return {};
  }

 private:
  double step() const { return length_ / static_cast<double>(steps_); }
  double angle(double s) const { return s * (k0_ + change_ * s / 2); }
  /// Of the tangent from `from` over `h`, by eight Gauss-Legendre nodes (Abramowitz and Stegun,
  /// table 25.4): below 1e-15 of the step for turns of half a radian.
  std::array<double, 2> integral(double from, double h) const {
    constexpr double x[4] = {0.183434642495649805, 0.525532409916328986, 0.796666477413626740,
                             0.960289856497536232};
    constexpr double w[4] = {0.362683783378361983, 0.313706645877887287, 0.222381034453374471,
                             0.101228536290376259};
    std::array<double, 2> sum{0, 0};
    for (int i = 0; i < 4; ++i)
      for (const double side : {-x[i], x[i]}) {
        const double theta = angle(from + h * (1 + side) / 2);
        sum[0] += w[i] * std::cos(theta);
        sum[1] += w[i] * std::sin(theta);
      }
    return {sum[0] * h / 2, sum[1] * h / 2};
  }
  Vec3 in_frame(double x, double y) const {
    const auto& R = start_.R;
    return {R[0] * x + R[1] * y, R[3] * x + R[4] * y, R[6] * x + R[7] * y};
  }

  Pose start_;
  double length_, k0_, change_;
  std::size_t steps_;
  std::vector<std::array<double, 2>> places_;
};

class ClothoidFactory final : public CurveFactory {
 public:
  Result<std::unique_ptr<Curve>> make(std::span<const Pose> points,
                                      const Params& params) const override {
    if (points.size() != 1)
      return error(
          ErrorCode::invalid_argument,
          "a clothoid starts at one pose; " + std::to_string(points.size()) + " were given",
          "Give the pose of its start; the tool's x axis points along it.");
    for (const double x : points[0].p)
      if (!std::isfinite(x))
        return error(ErrorCode::invalid_argument, "the start is not finite", "Give numbers.");
    const double length = params.real("length");
    if (!(length > 0))
      return error(ErrorCode::invalid_argument, "the length is not positive", "Give it in metres.");
    return std::unique_ptr<Curve>(new Clothoid(points[0], length, params.real("start_curvature"),
                                               params.real("end_curvature")));
  }
};

const rmp_param kParams[] = {
    {"length", "real", "m", "Length of the curve.", nullptr, nullptr, 0, 1e6},
    {"start_curvature", "real", "1/m", "Curvature at the start; positive to the left.", "0",
     nullptr, -1e6, 1e6},
    {"end_curvature", "real", "1/m", "Curvature at the end.", "1", nullptr, -1e6, 1e6},
};

}  // namespace

RMP_PLUGIN(
    "org.robomosp.example.clothoid", "0.1.0", "Apache-2.0", "A custom curve.",
    RMP_PROVIDER(
        ClothoidFactory, "clothoid",
        "Curvature that grows linearly with the length, from the first pose on along its x axis.",
        "points=1", kParams))
