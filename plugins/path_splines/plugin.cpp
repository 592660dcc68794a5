// SPDX-License-Identifier: Apache-2.0
// Splines and Bezier curves of Cartesian trajectories (layer: plugin).
#include <cmath>
#include <numeric>
#include <optional>
#include <string>

#include <robomosp/sdk/plugin.h>

#include "piecewise.h"
#include "spatial/pose.h"
#include "spatial/print.h"
#include "spatial/vec.h"

namespace robomosp::path_splines {
namespace {

using spatial::print_number;

constexpr double kSamePoint = 1e-9;  ///< [m]

Error bad(std::string message, std::string hint) {
  return error(ErrorCode::invalid_argument, std::move(message), std::move(hint));
}

Result<void> check_points(std::span<const Pose> points, std::size_t least, const char* shape) {
  if (points.size() < least)
    return bad(std::string(shape) + " needs " + std::to_string(least) + " points or more, " +
                   std::to_string(points.size()) +
                   (points.size() == 1 ? " was given" : " were given"),
               "Add points.");
  for (std::size_t i = 0; i < points.size(); ++i)
    if (!spatial::is_rigid(points[i], 1e-6))
      return bad("point " + std::to_string(i + 1) + " is not a pose",
                 "All its numbers must be finite.");
  return {};
}

std::vector<Vec3> positions(std::span<const Pose> points) {
  std::vector<Vec3> out;
  for (const Pose& p : points) out.push_back(p.p);
  return out;
}

/// A parameter of three numbers, or none.
Result<std::optional<Vec3>> vector_of(const Params& params, const char* name) {
  if (!params.has(name)) return std::optional<Vec3>{};  // cubic splines have no acceleration there
  const auto v = params.reals(name);
  if (v.empty()) return std::optional<Vec3>{};
  if (v.size() != 3)
    return bad(std::string(name) + " has " + std::to_string(v.size()) + " numbers",
               "Give x, y, z.");
  return std::optional<Vec3>(Vec3{v[0], v[1], v[2]});
}

/// When the points are passed: as given, or by their distances.
struct Timing {
  std::vector<double> at;
  bool is_timed = false;
};
Result<Timing> timing(std::span<const Pose> points, const Params& params) {
  Timing out;
  const auto given = params.reals("times");
  out.is_timed = !given.empty();
  if (out.is_timed) {
    if (given.size() != points.size())
      return bad(std::to_string(given.size()) + " times are given for " +
                     std::to_string(points.size()) + " points",
                 "Give one per point.");
    out.at.assign(given.begin(), given.end());
    for (std::size_t i = 1; i < given.size(); ++i)
      if (!(given[i] > given[i - 1]))
        return bad("the time of point " + std::to_string(i + 1) + " is " + print_number(given[i]) +
                       " s, not after " + print_number(given[i - 1]) + " s",
                   "Times must increase.");
    return out;
  }
  out.at.push_back(0);
  const bool is_centripetal = params.text("spacing") == "centripetal";
  for (std::size_t i = 1; i < points.size(); ++i) {
    const double distance = spatial::distance(points[i - 1].p, points[i].p);
    if (!(distance > kSamePoint))
      return bad("points " + std::to_string(i) + " and " + std::to_string(i + 1) +
                     " are at the same position",
                 "Remove one of them, or give times.");
    out.at.push_back(out.at.back() + (is_centripetal ? std::sqrt(distance) : distance));
  }
  return out;
}

/// What is asked for at one end; nothing given is free there.
struct End {
  std::optional<Vec3> velocity, acceleration;
  [[nodiscard]] bool is_given() const { return velocity || acceleration; }
};

/// Velocity and acceleration at an end as given: in m/s with times; without, the velocity's
/// direction counts. `must`: ends are clamped, so that what is left out is zero.
Result<End> read_end(const std::string& end, bool must, const Params& params, const Timing& t) {
  const std::string velocity = end + "_velocity", acceleration = end + "_acceleration";
  End out;
  RMP_TRY_ASSIGN(out.velocity, vector_of(params, velocity.c_str()));
  RMP_TRY_ASSIGN(out.acceleration, vector_of(params, acceleration.c_str()));
  if (must && !out.velocity) out.velocity = Vec3{};
  if (t.is_timed) return out;
  if (out.acceleration)
    return bad("an acceleration is given, but no times", "Give times too, or leave it out.");
  if (!out.velocity) return out;
  if (!(spatial::norm(*out.velocity) > 0))
    return bad(velocity + " is zero: without times the tool cannot stop at an end",
               "Give its direction there, or times.");
  out.velocity = spatial::unit(*out.velocity);
  return out;
}

Result<std::unique_ptr<Curve>> curve_of(const BasisSpline& spline, const Timing& t) {
  for (const Vec3& p : spline.points)
    if (!spatial::is_finite(p))
      return bad("the spline through these points is not finite", "Check the points and times.");
  std::vector<double> knots = t.at;
  for (double& k : knots) k -= t.at.front();
  return std::unique_ptr<Curve>(new PiecewiseCurve(spline, std::move(knots), t.is_timed));
}

/// The conditions at one end, `count` of them. Free: those of the spline that bends least.
void add_conditions(bool is_start, const End& end, int degree, std::size_t count,
                    std::vector<EndCondition>& out) {
  const int free = (degree + 1) / 2;  // the first derivative that a free end does not have
  std::size_t left = count;
  if (end.velocity) out.push_back({is_start, 1, *end.velocity}), --left;
  if (left > 0 && end.is_given())
    out.push_back({is_start, 2, end.acceleration.value_or(Vec3{})}), --left;
  for (int order = free; left > 0; ++order, --left) out.push_back({is_start, order, {}});
}

/// Splines of degree 3, 4 and 5 through points. They have degree - 1 conditions at their ends; of
/// an odd number the greater part is at the start.
Result<std::unique_ptr<Curve>> through(int degree, const char* shape, std::span<const Pose> points,
                                       const Params& params) {
  RMP_TRY(check_points(points, 2, shape));
  RMP_TRY_ASSIGN(const Timing t, timing(points, params));
  const std::string_view ends = params.text("ends");
  const bool clamped = ends == "clamped";
  RMP_TRY_ASSIGN(const End start, read_end("start", clamped, params, t));
  RMP_TRY_ASSIGN(const End end, read_end("end", clamped, params, t));
  if (ends != "auto" && !clamped && (start.is_given() || end.is_given()))
    return bad(
        "ends = \"" + std::string(ends) + "\" leaves the spline no freedom for the " +
            (start.velocity || (end.velocity && !start.is_given()) ? "velocity" : "acceleration") +
            " that is given at its " + (start.is_given() ? "start" : "end"),
        "Leave ends out or use \"clamped\", or leave out the values given there.");
  const std::vector<Vec3> places = positions(points);
  if (ends == "not_a_knot") {
    RMP_TRY(check_points(points, static_cast<std::size_t>(degree) + 1,
                         (std::string(shape) + " with ends = \"not_a_knot\"").c_str()));
    return curve_of(interpolate_not_a_knot(degree, t.at, places), t);
  }
  if (ends == "periodic") {
    RMP_TRY(check_points(points, 3, (std::string(shape) + " with ends = \"periodic\"").c_str()));
    const double open = spatial::distance(places.front(), places.back());
    if (!(open <= kSamePoint))
      return bad("ends = \"periodic\" closes the spline, and its last point is " +
                     print_number(open) + " m away from its first",
                 "Add the first point once more at the end.");
    return curve_of(interpolate_periodic(degree, t.at, places), t);
  }
  const auto conditions = static_cast<std::size_t>(degree - 1);
  std::vector<EndCondition> all;
  if (degree == 5 && points.size() == 2 && !start.is_given() && !end.is_given()) {
    // Free at both ends it may be any parabola: the straight one.
    for (const bool is_start : {true, false})
      for (const int order : {2, 3}) all.push_back({is_start, order, {}});
  } else {
    add_conditions(true, start, degree, conditions - conditions / 2, all);
    add_conditions(false, end, degree, conditions / 2, all);
  }
  return curve_of(interpolate(degree, t.at, places, all), t);
}

struct CubicSplineFactory final : CurveFactory {
  Result<std::unique_ptr<Curve>> make(std::span<const Pose> points,
                                      const Params& params) const override {
    return through(3, "a cubic spline", points, params);
  }
};
struct QuarticSplineFactory final : CurveFactory {
  Result<std::unique_ptr<Curve>> make(std::span<const Pose> points,
                                      const Params& params) const override {
    return through(4, "a quartic spline", points, params);
  }
};
struct QuinticSplineFactory final : CurveFactory {
  Result<std::unique_ptr<Curve>> make(std::span<const Pose> points,
                                      const Params& params) const override {
    return through(5, "a quintic spline", points, params);
  }
};

class BSplineFactory final : public CurveFactory {
 public:
  Result<std::unique_ptr<Curve>> make(std::span<const Pose> points,
                                      const Params& params) const override {
    const auto degree = static_cast<std::size_t>(params.integer("degree"));
    RMP_TRY(check_points(points, degree + 1,
                         ("a B-spline of degree " + std::to_string(degree)).c_str()));
    BasisSpline spline;
    spline.degree = static_cast<int>(degree);
    spline.points = positions(points);
    // Even knots between; each control point is drawn to most at the mean of its inner knots
    // (Greville's abscissae).
    std::vector<double> inner(points.size() - degree - 1);
    std::iota(inner.begin(), inner.end(), 1.0);
    spline.knots =
        clamped_knots(spline.degree, 0, inner, static_cast<double>(points.size() - degree));
    std::vector<double> knots;
    for (std::size_t i = 0; i < points.size(); ++i) {
      double sum = 0;
      for (std::size_t k = 1; k <= degree; ++k) sum += spline.knots[i + k];
      knots.push_back(sum / static_cast<double>(degree));
    }
    return std::unique_ptr<Curve>(new PiecewiseCurve(spline, std::move(knots), false));
  }
};

class BezierFactory final : public CurveFactory {
 public:
  Result<std::unique_ptr<Curve>> make(std::span<const Pose> points,
                                      const Params& params) const override {
    RMP_TRY(check_points(points, 2, "a Bezier curve"));
    const double duration = params.real("duration");
    RMP_TRY_ASSIGN(const auto v0, vector_of(params, "start_velocity"));
    RMP_TRY_ASSIGN(const auto v1, vector_of(params, "end_velocity"));
    if ((v0 || v1) && !(duration > 0))
      return bad("a velocity is given, but no duration", "Give the duration too.");
    std::vector<Vec3> p = positions(points);
    std::vector<double> knots;
    for (std::size_t i = 0; i < p.size(); ++i)
      knots.push_back(static_cast<double>(i) / static_cast<double>(p.size() - 1));
    // A velocity adds a control point beside its end: p' = n (p1 - p0) / T.
    const double n = static_cast<double>(p.size() - 1 + (v0 ? 1U : 0U) + (v1 ? 1U : 0U));
    if (v0) p.insert(p.begin() + 1, spatial::add(p.front(), spatial::scale(*v0, duration / n)));
    if (v1) p.insert(p.end() - 1, spatial::sub(p.back(), spatial::scale(*v1, duration / n)));
    return std::unique_ptr<Curve>(new BezierCurve(std::move(p), duration, std::move(knots)));
  }
};

/// Straight from point to point, the corners rounded by curves of fifth degree that begin and end
/// without curvature.
class TeachPointsFactory final : public CurveFactory {
 public:
  Result<std::unique_ptr<Curve>> make(std::span<const Pose> points,
                                      const Params& params) const override {
    RMP_TRY(check_points(points, 2, "a list of taught points"));
    const double rounding = params.real("rounding");
    const std::size_t n = points.size();
    std::vector<double> way{0};
    for (std::size_t i = 1; i < n; ++i) {
      const double d = spatial::distance(points[i - 1].p, points[i].p);
      if (!(d > kSamePoint))
        return bad("points " + std::to_string(i) + " and " + std::to_string(i + 1) +
                       " are at the same position",
                   "Remove one of them.");
      way.push_back(way.back() + d);
    }
    // As one spline of degree 5: knots of multiplicity 5 part its Bezier pieces.
    BasisSpline spline;
    spline.degree = 5;
    spline.points.push_back(points[0].p);
    std::vector<double> inner;
    // Six control points from a over the corner b to c: even steps on either side of it.
    const auto round = [&](const Vec3& a, const Vec3& b, const Vec3& c) {
      const Vec3 u = spatial::sub(b, a), v = spatial::sub(c, b);
      for (const double x : {0.4, 0.8})
        spline.points.push_back(spatial::add(a, spatial::scale(u, x)));
      for (const double x : {0.2, 0.6, 1.0})
        spline.points.push_back(spatial::add(b, spatial::scale(v, x)));
    };
    double from = 0;
    Vec3 at = points[0].p;
    for (std::size_t i = 1; i < n; ++i) {
      const Vec3 corner = points[i].p;
      double cut = 0;
      if (i + 1 < n) {
        cut = std::min({rounding, (way[i] - way[i - 1]) / 2, (way[i + 1] - way[i]) / 2});
        if (!(cut > kSamePoint))
          return bad("the corner at point " + std::to_string(i + 1) + " is not rounded",
                     "Give a rounding above 0, or make a line of each part.");
      }
      const Vec3 ahead = spatial::unit(spatial::sub(corner, at));
      const Vec3 to = spatial::sub(corner, spatial::scale(ahead, cut));
      if (way[i] - cut > from + kSamePoint) {
        // Evenly spaced: control points at fifths.
        const Vec3 u = spatial::sub(to, at);
        for (int k = 1; k <= 5; ++k)
          spline.points.push_back(spatial::add(at, spatial::scale(u, 0.2 * k)));
        if (from > 0) inner.insert(inner.end(), 5, from);
        from = way[i] - cut;
        at = to;
      }
      if (i + 1 == n) break;
      const Vec3 out = spatial::unit(spatial::sub(points[i + 1].p, corner));
      if (spatial::dot(ahead, out) < -1 + 1e-9)
        return bad("the path turns back on itself at point " + std::to_string(i + 1),
                   "Make a line of each part.");
      const Vec3 behind = spatial::add(corner, spatial::scale(out, cut));
      round(at, corner, behind);
      if (from > 0) inner.insert(inner.end(), 5, from);
      from = way[i] + cut;
      at = behind;
    }
    spline.knots = clamped_knots(5, 0, inner, way.back());
    return std::unique_ptr<Curve>(new PiecewiseCurve(spline, way, false));
  }
};

const rmp_param kTimes{
    "times", "real[]", "s", "Time of each point; if omitted, the motion law sets the times.",
    "{}",    nullptr,  1,   0};
const rmp_param kSpacing{"spacing",
                         "enum",
                         "",
                         "Without times, the parameter grows with the points' distances, or with "
                         "their square roots (gentler at sharp corners).",
                         "chord",
                         "chord|centripetal",
                         1,
                         0};
const char* const kEndsDoc =
    "natural: free, as straight as possible; clamped: with the velocities given there, zero by "
    "default; not_a_knot: one polynomial at either end; periodic: closed, without a jump where the "
    "last point is the first; auto: clamped at an end with a given value, else natural.";
const rmp_param kEnds{
    "ends", "enum", "", kEndsDoc, "auto", "auto|natural|clamped|not_a_knot|periodic", 1, 0},
    // A closed spline of an even degree with its knots at the points does not exist for every
    // number of points.
    kOpenEnds{"ends", "enum", "", kEndsDoc, "auto", "auto|natural|clamped|not_a_knot", 1, 0};
const rmp_param kStart{"start_velocity",
                       "real[]",
                       "m/s",
                       "Velocity at the start; without times only its direction counts.",
                       "{}",
                       nullptr,
                       1,
                       0};
const rmp_param kEnd{"end_velocity",
                     "real[]",
                     "m/s",
                     "Velocity at the end; without times only its direction counts.",
                     "{}",
                     nullptr,
                     1,
                     0};
const rmp_param kSplineParams[] = {kTimes, kSpacing, kEnds, kStart, kEnd};
const rmp_param kQuarticParams[] = {kTimes, kSpacing, kOpenEnds, kStart, kEnd};
const rmp_param kQuinticParams[] = {kTimes,
                                    kSpacing,
                                    kEnds,
                                    kStart,
                                    kEnd,
                                    {"start_acceleration", "real[]", "m/s^2",
                                     "Acceleration at the start, with times.", "{}", nullptr, 1, 0},
                                    {"end_acceleration", "real[]", "m/s^2",
                                     "Acceleration at the end, with times.", "{}", nullptr, 1, 0}};
const rmp_param kBSplineParams[] = {
    {"degree", "int", "", "Degree; degree - 1 derivatives are continuous.", "3", nullptr, 2, 9}};
const rmp_param kBezierParams[] = {
    {"duration", "real", "s",
     "Total duration, uniform in the parameter; 0 = set by the motion law.", "0", nullptr, 0, 1e9},
    {"start_velocity", "real[]", "m/s", "Velocity at the start: adds a control point.", "{}",
     nullptr, 1, 0},
    {"end_velocity", "real[]", "m/s", "Velocity at the end: adds a control point.", "{}", nullptr,
     1, 0}};
const rmp_param kTeachParams[] = {{"rounding", "real", "m",
                                   "Distance from a point at which its corner is cut; at most half "
                                   "the distance to its neighbours.",
                                   "0.01", nullptr, 0, 1e6}};

}  // namespace
}  // namespace robomosp::path_splines

namespace ps = robomosp::path_splines;

RMP_PLUGIN("org.robomosp.path_splines", "0.1.0", "Apache-2.0", "Splines and Bezier curves.",
           RMP_PROVIDER(ps::CubicSplineFactory, "cubic_spline",
                        "Cubic spline through the points, with continuous curvature.", "points=2+",
                        ps::kSplineParams),
           RMP_PROVIDER(ps::QuarticSplineFactory, "quartic_spline",
                        "Quartic spline through the points.", "points=2+", ps::kQuarticParams),
           RMP_PROVIDER(ps::QuinticSplineFactory, "quintic_spline",
                        "Quintic spline through the points, with continuous jerk.", "points=2+",
                        ps::kQuinticParams),
           RMP_PROVIDER(ps::BSplineFactory, "b_spline",
                        "B-spline with control points, from the first to the last.", "points=3+",
                        ps::kBSplineParams),
           RMP_PROVIDER(ps::BezierFactory, "bezier",
                        "Bezier curve of any degree, from the first control point to the last.",
                        "points=2+", ps::kBezierParams),
           RMP_PROVIDER(ps::TeachPointsFactory, "teach_points",
                        "Straight from point to point, with rounded corners.", "points=2+",
                        ps::kTeachParams))
