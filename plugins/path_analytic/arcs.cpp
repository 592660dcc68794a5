// SPDX-License-Identifier: Apache-2.0
// Curves "line", "arc", "circle", "arc_centre" and "helix" (layer: plugin).
#include <algorithm>
#include <cmath>
#include <numbers>

#include "factories.h"
#include "spatial/pose.h"
#include "spatial/rotation.h"
#include "spatial/vec.h"

namespace robomosp::path_analytic {

using spatial::add;
using spatial::cross;
using spatial::dot;
using spatial::print_number;
using spatial::scale;
using spatial::sub;

namespace {

/// Parameter: the share of the way, 0..1.
class Line final : public Curve {
 public:
  Line(const Vec3& from, const Vec3& way) : from_(from), way_(way) {}
  [[nodiscard]] double end() const override { return 1; }
  [[nodiscard]] bool is_even() const override { return true; }
  [[nodiscard]] std::vector<double> knots() const override { return {0, 1}; }
  Result<void> evaluate(std::span<const double> u, std::span<CurveSample> out) const override {
    for (std::size_t i = 0; i < u.size(); ++i)
      out[i] = {add(from_, scale(way_, u[i])), way_, {}, {}};
    return {};
  }

 private:
  Vec3 from_, way_;
};

/// The circle through three points, run from the first towards the second and third.
struct Circle {
  Vec3 centre{}, x{}, y{};  ///< x points to the first point, y along the motion there
  double radius = 0;        ///< [m]
  double to_second = 0;     ///< angle from the first point to the second [rad]
  double to_third = 0;      ///< ... to the third, to_second..2 pi
};

Result<Circle> circle_through(const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 u = sub(b, a), v = sub(c, a), n = cross(u, v);
  const double lu = spatial::norm(u), lv = spatial::norm(v), lw = spatial::distance(b, c);
  const std::pair<double, const char*> sides[] = {
      {lu, "1 and 2"}, {lv, "1 and 3"}, {lw, "2 and 3"}};
  for (const auto& [length, which] : sides)
    if (!(length > kSamePoint))
      return bad(std::string("points ") + which + " are at the same position",
                 "Three different points are needed to define a circle.");
  const double area = spatial::norm(n), longest = std::max({lu, lv, lw});
  if (!(area > 1e-9 * longest * longest))
    return bad("the three points lie on a straight line",
               "Move one of them off the line, or use a line.");
  Circle k;
  const double n2 = dot(n, n);
  k.centre =
      add(a, scale(add(scale(cross(v, n), dot(u, u)), scale(cross(n, u), dot(v, v))), 0.5 / n2));
  k.radius = spatial::distance(a, k.centre);
  k.x = spatial::unit(sub(a, k.centre));
  // Counter-clockwise about n the points come in the order 1, 2, 3.
  k.y = spatial::unit(cross(n, k.x));
  const auto angle_of = [&](const Vec3& p) {
    const Vec3 r = sub(p, k.centre);
    const double angle = std::atan2(dot(r, k.y), dot(r, k.x));
    return angle <= 0 ? angle + 2 * std::numbers::pi : angle;
  };
  k.to_second = angle_of(b);
  k.to_third = angle_of(c);
  return k;
}

/// Parameter: the share of the angle, 0..1. A `rise` along the axis makes it a helix.
class Arc final : public Curve {
 public:
  /// `knots` are the angles of the control points.
  Arc(const Circle& circle, double angle, std::vector<double> knots, const Vec3& rise = {})
      : circle_(circle), angle_(angle), knots_(std::move(knots)), rise_(rise) {
    for (double& k : knots_) k /= angle_;
  }
  [[nodiscard]] double end() const override { return 1; }
  [[nodiscard]] bool is_even() const override { return true; }
  [[nodiscard]] std::vector<double> knots() const override { return knots_; }
  Result<void> evaluate(std::span<const double> u, std::span<CurveSample> out) const override {
    const double r = circle_.radius, d = angle_;
    for (std::size_t i = 0; i < u.size(); ++i) {
      const spatial::SinCos a = spatial::sin_cos(u[i] * angle_);
      const Vec3 outward = add(scale(circle_.x, a.cos), scale(circle_.y, a.sin));
      const Vec3 along = sub(scale(circle_.y, a.cos), scale(circle_.x, a.sin));
      out[i] = {add(add(circle_.centre, scale(outward, r)), scale(rise_, u[i])),
                add(scale(along, r * d), rise_), scale(outward, -r * d * d),
                scale(along, -r * d * d * d)};
    }
    return {};
  }

 private:
  Circle circle_;
  double angle_;
  std::vector<double> knots_;
  Vec3 rise_;  ///< over the whole angle [m]
};

Result<Vec3> vector_of(const Params& params, const char* name, const char* unit) {
  const auto v = params.reals(name);
  if (v.size() == 3) return Vec3{v[0], v[1], v[2]};
  return bad(std::string(name) + " has " + std::to_string(v.size()) + " numbers",
             std::string("Give x, y, z") + unit + ".");
}

/// About `centre` and `axis` from the first point on, by an angle of either sign; the second point
/// only gives the last orientation.
Result<std::unique_ptr<Curve>> about_centre(std::span<const Pose> points, const Params& params,
                                            const char* shape, double angle, double rise) {
  RMP_TRY(
      check_points(points, points.size() < 2 ? 1 : 2, shape,
                   "Give the start, and a second pose for the last orientation if it changes."));
  RMP_TRY_ASSIGN(const Vec3 centre, vector_of(params, "centre", " [m]"));
  RMP_TRY_ASSIGN(Vec3 axis, vector_of(params, "axis", ""));
  if (!(spatial::norm(axis) > 0))
    return bad("the axis has no length", "Give a direction, such as 0, 0, 1.");
  axis = spatial::unit(axis);
  const Vec3 from = sub(points[0].p, centre), arm = sub(from, scale(axis, dot(from, axis)));
  if (!(spatial::norm(arm) > kSamePoint))
    return bad("the start lies on the axis", "Move it, or the centre.");
  if (!(std::fabs(angle) > kSameRotation))
    return bad("the angle is " + print_number(angle) + " rad", "Give one that is not 0.");
  Circle c;
  c.centre = add(centre, scale(axis, dot(from, axis)));
  c.radius = spatial::norm(arm);
  c.x = spatial::unit(arm);
  c.y = scale(cross(axis, c.x), angle < 0 ? -1 : 1);
  const double turn = std::fabs(angle);
  std::vector<double> knots{0};
  if (points.size() == 2) knots.push_back(turn);
  return std::unique_ptr<Curve>(new Arc(c, turn, std::move(knots), scale(axis, rise)));
}

}  // namespace

Result<void> check_points(std::span<const Pose> points, std::size_t count, const char* shape,
                          const char* which) {
  if (points.size() != count)
    return bad(std::string(shape) + " needs " + std::to_string(count) + " points, " +
                   std::to_string(points.size()) +
                   (points.size() == 1 ? " was given" : " were given"),
               which);
  for (std::size_t i = 0; i < count; ++i)
    if (!spatial::is_rigid(points[i], 1e-6))
      return bad("point " + std::to_string(i + 1) + " is not a pose",
                 "All its numbers must be finite.");
  return {};
}

Result<std::unique_ptr<Curve>> LineFactory::make(std::span<const Pose> points,
                                                 const Params&) const {
  RMP_TRY(check_points(points, 2, "a line", "Give start and end."));
  Vec3 way = sub(points[1].p, points[0].p);
  if (!(spatial::norm(way) > kSamePoint)) way = {};  // the tool turns on the spot, or stands
  return std::unique_ptr<Curve>(new Line(points[0].p, way));
}

Result<std::unique_ptr<Curve>> ArcFactory::make(std::span<const Pose> points, const Params&) const {
  RMP_TRY(check_points(points, 3, "an arc", "Give start, a via point, and end."));
  RMP_TRY_ASSIGN(const Circle c, circle_through(points[0].p, points[1].p, points[2].p));
  return std::unique_ptr<Curve>(new Arc(c, c.to_third, {0, c.to_second, c.to_third}));
}

Result<std::unique_ptr<Curve>> ArcCentreFactory::make(std::span<const Pose> points,
                                                      const Params& params) const {
  return about_centre(points, params, "an arc about a centre", params.real("angle"), 0);
}

Result<std::unique_ptr<Curve>> HelixFactory::make(std::span<const Pose> points,
                                                  const Params& params) const {
  const double turns = params.real("turns");
  return about_centre(points, params, "a helix", 2 * std::numbers::pi * turns,
                      std::fabs(turns) * params.real("pitch"));
}

Result<std::unique_ptr<Curve>> CircleFactory::make(std::span<const Pose> points,
                                                   const Params& params) const {
  RMP_TRY(check_points(points, 3, "a circle", "Give three points on it, in the order of travel."));
  RMP_TRY_ASSIGN(const double turns, positive(params, "turns", "turns"));
  RMP_TRY_ASSIGN(const Circle c, circle_through(points[0].p, points[1].p, points[2].p));
  const double angle = 2 * std::numbers::pi * turns;
  return std::unique_ptr<Curve>(
      new Arc(c, angle, {0, std::min(c.to_second, angle), std::min(c.to_third, angle)}));
}

}  // namespace robomosp::path_analytic
