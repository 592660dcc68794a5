// SPDX-License-Identifier: Apache-2.0
// Segments "line", "arc" and "circle" at constant speed (layer: plugin). The orientation turns at
// a constant rate from the first control pose's to the last one's.
#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <string>

#include <robomosp/sdk/plugin.h>
#include <robomosp/sdk/trajectory.h>

#include "spatial/pose.h"
#include "spatial/print.h"
#include "spatial/rotation.h"

namespace robomosp::path_analytic {
namespace {

using spatial::add;
using spatial::cross;
using spatial::dot;
using spatial::print_number;
using spatial::scale;
using spatial::sub;

const rmp_param kLineParams[] = {
    {"speed", "real", "m/s", "Speed of the tool along the line.", "0.1", nullptr, 0, 1e6},
    {"angular_speed", "real", "rad/s", "Speed of turning where the tool turns on the spot.", "0.5",
     nullptr, 0, 1e6},
};
const rmp_param kArcParams[] = {
    {"speed", "real", "m/s", "Speed of the tool along the arc.", "0.1", nullptr, 0, 1e6},
};
const rmp_param kCircleParams[] = {
    {"speed", "real", "m/s", "Speed of the tool along the circle.", "0.1", nullptr, 0, 1e6},
    {"turns", "real", "", "Number of turns, whole or not.", "1", nullptr, 0, 1e6},
};

// Control points closer than this count as one [m]; it is far below what a robot can place.
constexpr double kSamePoint = 1e-9;
// Times this share of the duration beyond an end are that end: callers reach it by sums of steps.
constexpr double kRounding = 1e-12;
// Orientations closer than this count as one [rad].
constexpr double kSameRotation = 1e-9;

Error bad(std::string message, std::string hint) {
  return error(ErrorCode::invalid_argument, std::move(message), std::move(hint));
}

/// Orientation that turns at a constant rate about an axis fixed in the trajectory's frame.
struct Turning {
  spatial::Matrix3 start{};
  Vec3 whole{};  ///< rotation vector from the first to the last orientation [rad]

  void fill(double share, double per_second, PathSample& out) const {
    Pose turn, first;
    turn.R = spatial::rotation_exp(scale(whole, share));
    first.R = start;
    out.pose.R = spatial::compose(turn, first).R;
    out.angular_velocity = scale(whole, per_second);
    out.angular_acceleration = {};
  }
};

class ConstantSpeed : public Segment {
 public:
  ConstantSpeed(double length, double duration, Turning turning)
      : length_(length), duration_(duration), turning_(turning) {}
  double duration() const override { return duration_; }
  double length() const override { return length_; }
  void sample(std::span<const double> times, std::span<PathSample> out) const override {
    for (std::size_t i = 0; i < times.size() && i < out.size(); ++i) {
      const double slack = kRounding * duration_;
      const bool moving = times[i] >= -slack && times[i] <= duration_ + slack;
      const double share = std::clamp(times[i] / duration_, 0.0, 1.0);
      turning_.fill(share, 1 / duration_, out[i]);
      place(share, length_ / duration_, out[i]);
      if (!moving)
        out[i].velocity = out[i].acceleration = out[i].angular_velocity =
            out[i].angular_acceleration = {};
    }
  }

 protected:
  /// Position, velocity and acceleration at a share 0..1 of the way and speed in m/s.
  virtual void place(double share, double speed, PathSample& out) const = 0;

 private:
  double length_, duration_;
  Turning turning_;
};

class Line final : public ConstantSpeed {
 public:
  Line(const Vec3& from, const Vec3& way, double duration, const Turning& turning)
      : ConstantSpeed(spatial::norm(way), duration, turning),
        from_(from),
        way_(way),
        direction_(spatial::unit(way)) {}

 private:
  void place(double share, double speed, PathSample& out) const override {
    out.pose.p = add(from_, scale(way_, share));
    out.velocity = scale(direction_, speed);
    out.acceleration = {};
  }
  Vec3 from_, way_, direction_;
};

/// The circle through three points, run from the first towards the second and third.
struct Circle {
  Vec3 centre{}, x{}, y{};  ///< x points to the first point, y along the motion there
  double radius = 0;        ///< [m]
  double to_third = 0;      ///< angle from the first point to the third [rad], 0..2 pi
};

Result<Circle> circle_through(const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 u = sub(b, a), v = sub(c, a), n = cross(u, v);
  const double lu = spatial::norm(u), lv = spatial::norm(v), lw = spatial::distance(b, c);
  const std::pair<double, const char*> sides[] = {
      {lu, "1 and 2"}, {lv, "1 and 3"}, {lw, "2 and 3"}};
  for (const auto& [length, which] : sides)
    if (!(length > kSamePoint))
      return bad(std::string("points ") + which + " are the same place",
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
  const Vec3 r = sub(c, k.centre);
  k.to_third = std::atan2(dot(r, k.y), dot(r, k.x));
  if (k.to_third <= 0) k.to_third += 2 * std::numbers::pi;
  return k;
}

class Arc final : public ConstantSpeed {
 public:
  Arc(const Circle& circle, double angle, double duration, const Turning& turning)
      : ConstantSpeed(circle.radius * angle, duration, turning), circle_(circle), angle_(angle) {}

 private:
  void place(double share, double speed, PathSample& out) const override {
    const spatial::SinCos a = spatial::sin_cos(share * angle_);
    const Vec3 outward = add(scale(circle_.x, a.cos), scale(circle_.y, a.sin));
    const Vec3 along = sub(scale(circle_.y, a.cos), scale(circle_.x, a.sin));
    out.pose.p = add(circle_.centre, scale(outward, circle_.radius));
    out.velocity = scale(along, speed);
    out.acceleration = scale(outward, -speed * speed / circle_.radius);
  }
  Circle circle_;
  double angle_;
};

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

Result<double> positive(const Params& params, const char* name, const char* unit) {
  const double value = params.real(name);
  if (!(value > 0) || !std::isfinite(value))
    return bad(std::string(name) + " is " + print_number(value) + " " + unit,
               "It must be above 0.");
  return value;
}

Turning turning(const Pose& first, const Pose& last) {
  Turning t{first.R, spatial::rotation_difference(first.R, last.R)};
  if (spatial::norm(t.whole) < kSameRotation) t.whole = {};
  return t;
}

class LineMaker final : public SegmentMaker {
 public:
  Result<std::unique_ptr<Segment>> make(std::span<const Pose> points,
                                        const Params& params) const override {
    RMP_TRY(check_points(points, 2, "a line", "Give start and end."));
    const Turning turn = turning(points[0], points[1]);
    const Vec3 way = sub(points[1].p, points[0].p);
    const double length = spatial::norm(way), angle = spatial::norm(turn.whole);
    if (length > kSamePoint) {
      RMP_TRY_ASSIGN(const double speed, positive(params, "speed", "m/s"));
      return std::unique_ptr<Segment>(new Line(points[0].p, way, length / speed, turn));
    }
    if (angle > kSameRotation) {
      RMP_TRY_ASSIGN(const double speed, positive(params, "angular_speed", "rad/s"));
      return std::unique_ptr<Segment>(new Line(points[0].p, Vec3{}, angle / speed, turn));
    }
    return bad("start and end of the line are the same pose", "Move or turn one of them.");
  }
};

class ArcMaker final : public SegmentMaker {
 public:
  Result<std::unique_ptr<Segment>> make(std::span<const Pose> points,
                                        const Params& params) const override {
    RMP_TRY(check_points(points, 3, "an arc", "Give start, a point on the way, and end."));
    RMP_TRY_ASSIGN(const double speed, positive(params, "speed", "m/s"));
    RMP_TRY_ASSIGN(const Circle circle, circle_through(points[0].p, points[1].p, points[2].p));
    return std::unique_ptr<Segment>(new Arc(circle, circle.to_third,
                                            circle.radius * circle.to_third / speed,
                                            turning(points[0], points[2])));
  }
};

class CircleMaker final : public SegmentMaker {
 public:
  Result<std::unique_ptr<Segment>> make(std::span<const Pose> points,
                                        const Params& params) const override {
    RMP_TRY(check_points(points, 3, "a circle",
                         "Give three points on it, in the order they are passed."));
    RMP_TRY_ASSIGN(const double speed, positive(params, "speed", "m/s"));
    RMP_TRY_ASSIGN(const double turns, positive(params, "turns", "turns"));
    RMP_TRY_ASSIGN(const Circle circle, circle_through(points[0].p, points[1].p, points[2].p));
    const double angle = 2 * std::numbers::pi * turns;
    return std::unique_ptr<Segment>(
        new Arc(circle, angle, circle.radius * angle / speed, turning(points[0], points[2])));
  }
};

}  // namespace
}  // namespace robomosp::path_analytic

RMP_PLUGIN("org.robomosp.path_analytic", "0.1.0", "Apache-2.0", "Lines, arcs and circles.",
           RMP_PROVIDER(robomosp::path_analytic::LineMaker, "line",
                        "Straight line between two poses at constant speed.", "points=2",
                        robomosp::path_analytic::kLineParams),
           RMP_PROVIDER(robomosp::path_analytic::ArcMaker, "arc",
                        "Part of a circle from the first pose through the second to the third.",
                        "points=3", robomosp::path_analytic::kArcParams),
           RMP_PROVIDER(robomosp::path_analytic::CircleMaker, "circle",
                        "Full turns through three points, starting at the first.", "points=3",
                        robomosp::path_analytic::kCircleParams))
