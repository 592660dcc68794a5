// SPDX-License-Identifier: Apache-2.0
// Transitions keep the limits of their neighbours and the hull of what they join, or a note reports
// it; motions to where the tool is are no error.
#include <array>
#include <cmath>
#include <numbers>

#include "motion/cartesian_path.h"
#include "spatial/pose.h"
#include "spatial/rotation.h"
#include "spatial/vec.h"
#include "support/segments.h"

namespace robomosp {
namespace {

using conformance::record_of;
using conformance::registry_with;
using model::Trajectory;
using model::TrajectorySegment;

const Registry& transition_registry() {
  static const Registry& r = registry_with({"path_analytic", "path_splines"});
  return r;
}

Pose spot(double x, double y, double z, const Vec3& turn = {}) {
  Pose p;
  p.R = spatial::rotation_exp(turn);
  p.p = {x, y, z};
  return p;
}

TrajectorySegment line_of(const Pose& from, const Pose& to, const std::string& law,
                          const std::map<std::string, double>& params) {
  TrajectorySegment s = record_of("line", {from, to});
  s.law.name = law;
  for (const auto& [name, value] : params) s.shape.params[name] = value;
  return s;
}

std::shared_ptr<const motion::Path> built(const Trajectory& t) {
  auto made = motion::Path::build(transition_registry(), "way", t);
  EXPECT_TRUE(made.ok()) << (made.ok() ? "" : made.error().sentence());
  return made.ok() ? *made : nullptr;
}

std::vector<PathSample> sampled(const motion::Path& path, double from, double to, int count) {
  std::vector<double> times;
  for (int i = 0; i <= count; ++i) times.push_back(from + (to - from) * i / count);
  std::vector<PathSample> out(times.size());
  EXPECT_TRUE(path.sample(times, out).ok());
  return out;
}
std::vector<PathSample> sampled(const motion::Path& path, int count = 6000) {
  return sampled(path, 0, path.duration(), count);
}

struct Peaks {
  double speed = 0, acceleration = 0, turning = 0, spin = 0;
};
Peaks peaks(const std::vector<PathSample>& samples) {
  Peaks out;
  for (const PathSample& s : samples) {
    out.speed = std::max(out.speed, spatial::norm(s.velocity));
    out.acceleration = std::max(out.acceleration, spatial::norm(s.acceleration));
    out.turning = std::max(out.turning, spatial::norm(s.angular_velocity));
    out.spin = std::max(out.spin, spatial::norm(s.angular_acceleration));
  }
  return out;
}

/// Greatest distance between velocities and differences of positions, of orientations likewise.
double dishonesty(const motion::Path& path, int count = 6000) {
  const double h = path.duration() / count;
  const auto samples = sampled(path, count);
  double worst = 0;
  for (std::size_t i = 1; i < samples.size(); ++i) {
    const PathSample &a = samples[i - 1], &b = samples[i];
    const Vec3 moved = spatial::scale(spatial::add(a.velocity, b.velocity), h / 2);
    worst = std::max(worst, spatial::norm(spatial::sub(spatial::sub(b.pose.p, a.pose.p), moved)));
    const Vec3 turned = spatial::scale(spatial::add(a.angular_velocity, b.angular_velocity), h / 2);
    worst = std::max(worst, spatial::norm(spatial::sub(
                                spatial::rotation_difference(a.pose.R, b.pose.R), turned)));
  }
  return worst;
}

const motion::Path::Piece* bridge_of(const motion::Path& path) {
  for (const auto& piece : path.pieces())
    if (piece.is_transition) return &piece;
  return nullptr;
}

/// The pieces of a triangle's plane that a point is made of; all of 0..1 inside.
std::array<double, 3> barycentric(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 u = spatial::sub(b, a), v = spatial::sub(c, a), w = spatial::sub(p, a);
  const double uu = spatial::dot(u, u), uv = spatial::dot(u, v), vv = spatial::dot(v, v),
               wu = spatial::dot(w, u), wv = spatial::dot(w, v), det = uu * vv - uv * uv;
  const double s = (vv * wu - uv * wv) / det, t = (uu * wv - uv * wu) / det;
  return {1 - s - t, s, t};
}

// From rest to rest on a straight line x^3 (10 - 15 x + 6 x^2): its greatest speed is 15/8 D / T,
// its greatest acceleration 10 / sqrt(3) D / T^2.
TEST(TransitionLimits, FromRestToRestItIsAStraightLineAtTheNeighboursSpeed) {
  for (const char* law : {"trapezoidal", "cubic", "quintic", "s_curve", "cycloidal"})
    for (const double acceleration : {0.01, 1.0, 5.0}) {
      SCOPED_TRACE(std::string(law) + " " + std::to_string(acceleration));
      std::map<std::string, double> p{{"speed", 0.1}, {"acceleration", acceleration}};
      if (std::string_view(law) == "s_curve") p["jerk"] = 1e6;
      Trajectory t;
      t.segments = {line_of(spot(0, 0, 0), spot(0.3, 0, 0), law, p),
                    line_of(spot(0.3, 0.5, 0), spot(0.6, 0.5, 0), law, p)};
      const auto path = built(t);
      ASSERT_TRUE(path);
      const auto* bridge = bridge_of(*path);
      ASSERT_TRUE(bridge);
      const double fastest = peaks(sampled(*path, 0, bridge->start, 4000)).speed;
      const double T =
          std::max(15.0 / 8 * 0.5 / fastest, std::sqrt(10 / std::sqrt(3.0) * 0.5 / acceleration));
      EXPECT_NEAR(bridge->segment->duration(), T, 2e-3 * T);
      EXPECT_NEAR(bridge->segment->length(), 0.5, 1e-9);
      for (const PathSample& s :
           sampled(*path, bridge->start, bridge->start + bridge->segment->duration(), 500)) {
        EXPECT_NEAR(s.pose.p[0], 0.3, 1e-12);
        EXPECT_GE(s.pose.p[1], -1e-12);
        EXPECT_LE(s.pose.p[1], 0.5 + 1e-12);
      }
      const Peaks all = peaks(sampled(*path));
      EXPECT_LE(all.speed, 0.1 * (1 + 1e-9));
      EXPECT_LE(all.acceleration, acceleration * (1 + 1e-9));
      EXPECT_TRUE(path->notes().empty());
    }
}

TEST(TransitionLimits, AnySlowSpeedIsKeptOverAGap) {
  for (const double speed : {0.05, 1e-3, 1e-6}) {
    Trajectory t;
    t.segments = {line_of(spot(0, 0, 0), spot(0.3, 0, 0), "trapezoidal", {}),
                  line_of(spot(0.3, 0.5, 0), spot(0.6, 0.5, 0), "trapezoidal", {})};
    t.segments[1].transition.speed = speed;
    const auto path = built(t);
    ASSERT_TRUE(path);
    EXPECT_NEAR(bridge_of(*path)->segment->duration(), 15.0 / 8 * 0.5 / speed, 1e-9 / speed);
  }
}

TEST(TransitionLimits, ATurnAloneStaysInItsPlace) {
  Trajectory t;
  t.segments = {
      line_of(spot(0, 0, 0), spot(0.3, 0, 0), "trapezoidal", {}),
      line_of(spot(0.3, 0, 0, {0, 0, 1.2}), spot(0.3, 0.4, 0, {0, 0, 1.2}), "trapezoidal", {})};
  const auto rest = built(t);
  ASSERT_TRUE(rest);
  const auto* bridge = bridge_of(*rest);
  ASSERT_TRUE(bridge);
  EXPECT_NEAR(bridge->segment->duration(), 15.0 / 8 * 1.2 / 0.5, 1e-9);
  for (const PathSample& s :
       sampled(*rest, bridge->start, bridge->start + bridge->segment->duration(), 200))
    EXPECT_LT(spatial::distance(s.pose.p, {0.3, 0, 0}), 1e-12);
  // On the way the turn is part of the corner's cut, within the lines.
  for (auto& s : t.segments) s.law.name = "constant_speed";
  const auto moving = built(t);
  ASSERT_TRUE(moving);
  for (const PathSample& s : sampled(*moving)) {
    const auto inside = barycentric(s.pose.p, {0, 0, 0}, {0.3, 0, 0}, {0.3, 0.4, 0});
    for (const double x : inside) EXPECT_GE(x, -1e-6);
  }
  EXPECT_LE(peaks(sampled(*moving)).turning, 0.5 * (1 + 1e-6));
  EXPECT_TRUE(moving->notes().empty());
  EXPECT_LT(dishonesty(*moving), 1e-5);
}

// What a corner at speed takes of acceleration is no more than its neighbours have: they slow down
// before it. All of it lies in the triangle of the three points.
TEST(TransitionLimits, CornersKeepSpeedsAccelerationsAndTheHull) {
  for (const char* law : {"trapezoidal", "s_curve"})
    for (const double angle : {20.0, 90.0, 150.0, 169.0})
      for (const double distance : {0.01, 0.05, 0.1})
        for (const double second : {0.5, 0.05}) {
          SCOPED_TRACE(std::string(law) + " " + std::to_string(angle) + " " +
                       std::to_string(distance) + " " + std::to_string(second));
          std::map<std::string, double> a{{"speed", 0.5}, {"acceleration", 1}, {"end_speed", 0.5}},
              b{{"speed", second}, {"acceleration", 1}, {"start_speed", second}};
          const bool has_jerk = std::string_view(law) == "s_curve";
          if (has_jerk) a["jerk"] = b["jerk"] = 20;
          const double turn = angle * std::numbers::pi / 180;
          const Vec3 last{0.5 + 0.5 * std::cos(turn), 0.5 * std::sin(turn), 0};
          Trajectory t;
          t.segments = {line_of(spot(0, 0, 0), spot(0.5, 0, 0), law, a),
                        line_of(spot(0.5, 0, 0), spot(last[0], last[1], 0), law, b)};
          t.segments[1].transition.distance = distance;
          const auto path = built(t);
          ASSERT_TRUE(path);
          EXPECT_TRUE(path->notes().empty()) << path->notes().front();
          const auto samples = sampled(*path);
          const Peaks p = peaks(samples);
          EXPECT_LE(p.speed, 0.5 * (1 + 1e-9));
          EXPECT_LE(p.acceleration, 1 + 1e-3);
          EXPECT_LT(dishonesty(*path), 1e-5);
          for (const PathSample& s : samples)
            for (const double x : barycentric(s.pose.p, {0, 0, 0}, {0.5, 0, 0}, last))
              ASSERT_GE(x, -1e-5);
          if (!has_jerk) continue;
          const double h = path->duration() / static_cast<double>(samples.size() - 1);
          double jerk = 0;
          for (std::size_t i = 1; i < samples.size(); ++i)
            jerk = std::max(
                jerk, spatial::distance(samples[i].acceleration, samples[i - 1].acceleration) / h);
          EXPECT_LE(jerk, 20 * 1.02);
        }
}

// Segments too short to slow down in: it is begun farther back.
TEST(TransitionLimits, LookAheadOverShortSegments) {
  Trajectory t;
  const std::map<std::string, double> p{
      {"speed", 0.5}, {"acceleration", 1}, {"start_speed", 0.5}, {"end_speed", 0.5}};
  double x = 0;
  for (int i = 0; i < 12; ++i, x += 0.02)
    t.segments.push_back(line_of(spot(x, 0, 0), spot(x + 0.02, 0, 0), "trapezoidal", p));
  t.segments.push_back(line_of(spot(x, 0, 0), spot(x, 0.3, 0), "trapezoidal", p));
  t.segments.back().transition.distance = 0.005;
  const auto path = built(t);
  ASSERT_TRUE(path);
  const Peaks all = peaks(sampled(*path));
  EXPECT_LE(all.acceleration, 1 + 1e-3);
  EXPECT_LE(all.speed, 0.5 * (1 + 1e-9));
  EXPECT_GT(all.speed, 0.45) << "only slowed down where there is need for";
  EXPECT_LT(dishonesty(*path), 1e-5);
}

TEST(TransitionLimits, WhatLeavesTheHullIsToldWithItsSizeAndTime) {
  Trajectory t;
  t.segments = {line_of(spot(0, 0, 0), spot(0.3, 0, 0), "constant_speed", {{"speed", 0.1}}),
                line_of(spot(0.3, 0.1, 0), spot(0, 0.1, 0), "constant_speed", {{"speed", 0.1}})};
  const auto path = built(t);
  ASSERT_TRUE(path);
  double beyond = 0;
  for (const PathSample& s : sampled(*path)) beyond = std::max(beyond, s.pose.p[0] - 0.3);
  EXPECT_GT(beyond, 1e-3);
  ASSERT_EQ(path->notes().size(), 1U);
  EXPECT_EQ(path->notes()[0].find("trajectory \"way\": the transition to segment 2 leaves the hull "
                                  "of both segments by 0.0"),
            0U)
      << path->notes()[0];
  EXPECT_NEAR(std::stod(path->notes()[0].substr(path->notes()[0].find(" by ") + 4)), beyond, 1e-4);
  // At rest there it stays within.
  for (auto& s : t.segments) s.law.name = "quintic";
  const auto rest = built(t);
  ASSERT_TRUE(rest);
  EXPECT_TRUE(rest->notes().empty());
  for (const PathSample& s : sampled(*rest)) EXPECT_LE(s.pose.p[0], 0.3 + 1e-12);
}

TEST(TransitionLimits, LinesThatGoNowhereTakeTheirDurationOrNoTime) {
  const auto still = [](double duration) {
    return line_of(spot(0.3, 0, 0), spot(0.3, 0, 0), "trapezoidal", {{"duration", duration}});
  };
  Trajectory t;
  t.segments = {line_of(spot(0, 0, 0), spot(0.3, 0, 0), "trapezoidal", {}), still(0),
                line_of(spot(0.3, 0, 0), spot(0.3, 0.4, 0), "trapezoidal", {})};
  const auto without = built(t);
  ASSERT_TRUE(without);
  EXPECT_NEAR(without->duration(), 0.3 / 0.1 + 0.1 + 0.4 / 0.1 + 0.1, 1e-12);
  EXPECT_EQ(without->segment_count(), 3U);
  t.segments[1] = still(2.5);
  const auto waits = built(t);
  ASSERT_TRUE(waits);
  EXPECT_NEAR(waits->duration(), without->duration() + 2.5, 1e-12);
  // Between segments at one speed nothing is there to stop for.
  t.segments[0] = line_of(spot(0, 0, 0), spot(0.3, 0, 0), "constant_speed", {});
  t.segments[2] = line_of(spot(0.3, 0, 0), spot(0.5, 0, 0), "constant_speed", {});
  t.segments[1] = still(0);
  const auto passes = built(t);
  ASSERT_TRUE(passes);
  EXPECT_NEAR(passes->duration(), 5, 1e-9);
  // Alone it takes no time, and has its place.
  t.segments = {still(0)};
  const auto alone = built(t);
  ASSERT_TRUE(alone);
  EXPECT_EQ(alone->duration(), 0);
  EXPECT_EQ(alone->sample_times(0.01).size(), 1U);
  EXPECT_NEAR(sampled(*alone, 0, 0, 1)[0].pose.p[0], 0.3, 1e-15);
  // Somewhere else than its neighbours it is a place to go to.
  t.segments = {line_of(spot(0, 0, 0), spot(0.3, 0, 0), "trapezoidal", {}),
                line_of(spot(0.3, 0.2, 0), spot(0.3, 0.2, 0), "trapezoidal", {})};
  const auto goes = built(t);
  ASSERT_TRUE(goes);
  EXPECT_NEAR(sampled(*goes, goes->duration(), goes->duration(), 1)[0].pose.p[1], 0.2, 1e-12);
}

TEST(TransitionLimits, TinyMotionsAreMade) {
  for (const double way : {1e-3, 1e-6, 1e-8, 1e-10, 1e-13, 1e-300}) {
    SCOPED_TRACE(way);
    Trajectory t;
    t.segments = {line_of(spot(0, 0, 0), spot(0.3, 0, 0), "trapezoidal", {}),
                  line_of(spot(0.3, 0, 0), spot(0.3, way, 0), "trapezoidal", {}),
                  line_of(spot(0.3, way, 0), spot(0.3, 0.4, 0), "trapezoidal", {})};
    const auto path = built(t);
    ASSERT_TRUE(path);
    const PathSample end = sampled(*path, path->duration(), path->duration(), 1)[0];
    EXPECT_NEAR(end.pose.p[1], 0.4, 1e-12);
    EXPECT_LE(peaks(sampled(*path)).acceleration, 1 + 1e-9);
  }
}

// On a circle the three points lie on the first turn; behind the third the tool keeps its
// orientation, and what it says of its turn is the difference of its orientations.
TEST(SquadOnCircles, TurnsThroughItsPointsAndStandsBehindThem) {
  for (const double second : {30.0, 120.0, 200.0})
    for (const double third : {240.0, 300.0, 355.0})
      for (const double turns : {1.0, 2.5}) {
        SCOPED_TRACE(std::to_string(second) + " " + std::to_string(third) + " " +
                     std::to_string(turns));
        const auto on = [](double degrees, const Vec3& turn) {
          const double a = degrees * std::numbers::pi / 180;
          return spot(0.2 * std::cos(a), 0.2 * std::sin(a), 0, turn);
        };
        const std::array<Pose, 3> points{on(0, {}), on(second, {0.4, 0.1, 0}),
                                         on(third, {0.2, 0.5, 0.3})};
        TrajectorySegment s = record_of("circle", {points[0], points[1], points[2]});
        s.orientation.name = "squad";
        s.shape.params["turns"] = turns;
        s.shape.params["angular_speed"] = 100.0;
        Trajectory t;
        t.segments = {s};
        const auto path = built(t);
        if (!path) continue;
        const std::array<double, 3> angles{0, second, third};
        for (std::size_t k = 0; k < 3; ++k) {
          const double when = path->duration() * angles[k] / (360 * turns);
          EXPECT_LT(spatial::norm(spatial::rotation_difference(
                        sampled(*path, when, when, 1)[0].pose.R, points[k].R)),
                    1e-9);
        }
        for (const PathSample& p : sampled(*path, path->duration() * (third / (360 * turns) + 1e-6),
                                           path->duration(), 50))
          EXPECT_EQ(spatial::norm(p.angular_velocity), 0);
        EXPECT_LT(dishonesty(*path, 4000), 1e-5);
        // Without a jump of the rate.
        const auto samples = sampled(*path, 4000);
        const double h = path->duration() / 4000;
        for (std::size_t i = 1; i < samples.size(); ++i)
          EXPECT_LT(spatial::distance(samples[i].angular_velocity, samples[i - 1].angular_velocity),
                    h * 20);
      }
}

}  // namespace
}  // namespace robomosp
