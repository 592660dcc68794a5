// SPDX-License-Identifier: Apache-2.0
// Trajectories of several segments: transitions, stored ones, walking curves by their length.
#include <cmath>
#include <numbers>

#include "motion/cartesian_path.h"
#include "motion/curve_walk.h"
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

const Registry& registry() {
  static const Registry& r = registry_with({"path_analytic", "path_splines"});
  return r;
}

Pose place(double x, double y, double z, const Vec3& turn = {}) {
  Pose p;
  p.R = spatial::rotation_exp(turn);
  p.p = {x, y, z};
  return p;
}

Result<std::shared_ptr<const motion::Path>> build(const Trajectory& t,
                                                  const motion::FindTrajectory& find = {}) {
  return motion::Path::build(registry(), "test", t, find);
}

PathSample path_at(const motion::Path& path, double t) {
  PathSample s;
  EXPECT_TRUE(path.sample({&t, 1}, {&s, 1}).ok());
  return s;
}

/// The greatest jumps of position, turn, velocities and accelerations from sample to sample, beyond
/// what the next derivative explains.
struct Jumps {
  double position = 0, rotation = 0, velocity = 0, turning = 0;
};
Jumps jumps(const motion::Path& path, int samples = 20000) {
  Jumps out;
  const double h = path.duration() / samples;
  PathSample a = path_at(path, 0);
  for (int i = 1; i <= samples; ++i) {
    const PathSample b = path_at(path, h * i);
    // Hermite: position changes by the mean of the velocities, up to terms of third order.
    const Vec3 moved = spatial::scale(spatial::add(a.velocity, b.velocity), h / 2);
    const Vec3 turned = spatial::scale(spatial::add(a.angular_velocity, b.angular_velocity), h / 2);
    const Vec3 sped = spatial::scale(spatial::add(a.acceleration, b.acceleration), h / 2);
    const Vec3 spun =
        spatial::scale(spatial::add(a.angular_acceleration, b.angular_acceleration), h / 2);
    const auto beyond = [](const Vec3& change, const Vec3& explained) {
      return spatial::norm(spatial::sub(change, explained));
    };
    out.position = std::max(out.position, beyond(spatial::sub(b.pose.p, a.pose.p), moved));
    out.rotation =
        std::max(out.rotation, beyond(spatial::rotation_difference(a.pose.R, b.pose.R), turned));
    out.velocity = std::max(out.velocity, beyond(spatial::sub(b.velocity, a.velocity), sped));
    out.turning =
        std::max(out.turning, beyond(spatial::sub(b.angular_velocity, a.angular_velocity), spun));
    a = b;
  }
  return out;
}

Trajectory corner(model::Transition transition) {
  Trajectory t;
  t.segments.push_back(record_of("line", {place(0, 0, 0), place(0.4, 0, 0, {0.3, 0, 0})}));
  t.segments.push_back(
      record_of("line", {place(0.4, 0, 0, {0.3, 0, 0}), place(0.4, 0.3, 0.1, {0, 0.5, 0})}));
  t.segments.back().transition = transition;
  return t;
}

TEST(Transitions, CutCornersSmoothly) {
  const auto made = build(corner({}));
  ASSERT_TRUE(made.ok()) << made.error().sentence();
  const motion::Path& path = **made;
  EXPECT_EQ(path.segment_count(), 3U);
  const Jumps j = jumps(path);
  EXPECT_LT(j.position, 1e-9);
  EXPECT_LT(j.rotation, 1e-9);
  EXPECT_LT(j.velocity, 2e-5);
  EXPECT_LT(j.turning, 2e-4);
  // Cut a tenth of the shorter neighbour away from the corner, not more.
  const double shorter = std::hypot(0.3, 0.1);
  double nearest = 1;
  for (int i = 0; i <= 1000; ++i)
    nearest = std::min(
        nearest, spatial::distance(path_at(path, path.duration() * i / 1000).pose.p, {0.4, 0, 0}));
  EXPECT_LT(nearest, shorter / 10);
  EXPECT_GT(nearest, 0.2 * shorter / 10);
  EXPECT_LT(path.length(), 0.4 + shorter);
}

TEST(Transitions, KeepTheDistanceAsked) {
  const auto made = build(corner({.is_smooth = true, .distance = 0.05, .speed = 0}));
  ASSERT_TRUE(made.ok()) << made.error().sentence();
  // Up to 0.05 before the corner the first line is run as it is.
  const PathSample s = path_at(**made, 3.4);
  EXPECT_NEAR(s.pose.p[0], 0.34, 1e-12);
  EXPECT_EQ(s.pose.p[1], 0);
  EXPECT_NE(path_at(**made, 3.55).pose.p[1], 0);
}

double greatest_speed(const motion::Path& path, double from, double to) {
  double most = 0;
  for (int i = 0; i <= 4000; ++i)
    most = std::max(most, spatial::norm(path_at(path, from + (to - from) * i / 4000).velocity));
  return most;
}
const motion::Path::Piece& transition_of(const motion::Path& path) {
  for (const auto& piece : path.pieces())
    if (piece.is_transition) return piece;
  return path.pieces().front();
}

// From rest to rest over a gap D the speed of a polynomial of fifth degree is at most 15/8 D / T.
TEST(Transitions, KeepToTheirSpeedOverAGap) {
  Trajectory t;
  t.segments.push_back(record_of("line", {place(0, 0, 0), place(0.4, 0, 0)}));
  t.segments.push_back(record_of("line", {place(0.4, 0.3, 0), place(0, 0.3, 0)}));
  for (auto& s : t.segments) s.law.name = "quintic";
  t.segments.back().transition.speed = 0.2;
  const auto made = build(t);
  ASSERT_TRUE(made.ok()) << made.error().sentence();
  const auto& piece = transition_of(**made);
  const double T = piece.segment->duration();
  EXPECT_NEAR(T, 15.0 / 8 * 0.3 / 0.2, 1e-8);
  EXPECT_NEAR(greatest_speed(**made, piece.start, piece.start + T), 0.2, 1e-8);
}

TEST(Transitions, SlowDownToTheirSpeedInACorner) {
  for (const double speed : {0.05, 0.1, 0.15}) {
    const auto made = build(corner({.is_smooth = true, .distance = 0.03, .speed = speed}));
    ASSERT_TRUE(made.ok()) << made.error().sentence();
    const auto& piece = transition_of(**made);
    const double T = piece.segment->duration();
    EXPECT_LE(greatest_speed(**made, piece.start, piece.start + T),
              std::max(speed, 0.1) * (1 + 1e-6));
    const double middle = spatial::norm(path_at(**made, piece.start + T / 2).velocity);
    EXPECT_LE(middle, speed * (1 + 1e-9));
    EXPECT_GE(middle, speed * 0.5) << "not slower than there is need for";
  }
  // Within so short a way the tool cannot slow down from 1 m/s: it arrives more slowly.
  Trajectory t = corner({.is_smooth = true, .distance = 0.03, .speed = 0.001});
  t.segments.front().shape.params["speed"] = 1.0;
  t.segments.back().shape.params["speed"] = 0.01;
  t.segments.back().shape.params["angular_speed"] = 5.0;
  t.segments.front().shape.params["angular_speed"] = 5.0;
  const auto made = build(t);
  ASSERT_TRUE(made.ok()) << made.error().sentence();
  const auto& piece = transition_of(**made);
  const double T = piece.segment->duration();
  EXPECT_LE(spatial::norm(path_at(**made, piece.start + T / 2).velocity), 0.001 * (1 + 1e-9));
  const Jumps j = jumps(**made, 200000);
  EXPECT_LT(j.position, 1e-7);
}

// What ends at a joint and what begins there agree in position, orientation, both velocities and
// both accelerations.
TEST(Transitions, AreSmoothToTheSecondDerivative) {
  Trajectory gap;
  gap.segments.push_back(record_of("line", {place(0, 0, 0), place(0.4, 0, 0, {1, 0, 0})}));
  gap.segments.push_back(record_of(
      "arc", {place(0.5, 0.1, 0, {0, 0, 2}), place(0.6, 0.2, 0), place(0.5, 0.3, 0, {1, 0, 0})}));
  gap.segments.push_back(record_of("line", {place(0.5, 0.3, 0, {1, 0, 0}), place(0.2, 0.3, 0.2)}));
  gap.segments.back().turning.name = "cubic";
  Trajectory slow = corner({.is_smooth = true, .distance = 0.02, .speed = 0.06});
  slow.segments.front().orientation.name = "squad";
  for (const Trajectory& t : {gap, slow, corner({})}) {
    const auto made = build(t);
    ASSERT_TRUE(made.ok()) << made.error().sentence();
    const auto& pieces = (*made)->pieces();
    ASSERT_GE(pieces.size(), 3U);
    for (std::size_t i = 1; i < pieces.size(); ++i) {
      SCOPED_TRACE(i);
      const PathSample a = conformance::sample_at(*pieces[i - 1].segment,
                                                  pieces[i - 1].segment->duration()),
                       b = conformance::sample_at(*pieces[i].segment, 0);
      EXPECT_LT(spatial::distance(a.pose.p, b.pose.p), 1e-12);
      EXPECT_LT(spatial::norm(spatial::rotation_difference(a.pose.R, b.pose.R)), 1e-11);
      EXPECT_LT(spatial::distance(a.velocity, b.velocity), 1e-10);
      EXPECT_LT(spatial::distance(a.angular_velocity, b.angular_velocity), 1e-10);
      EXPECT_LT(spatial::distance(a.acceleration, b.acceleration), 1e-8);
      EXPECT_LT(spatial::distance(a.angular_acceleration, b.angular_acceleration), 1e-8);
    }
    // And in between the derivatives are those of what they belong to: errors of a central
    // difference fall with its square.
    const double h = 1e-4;
    for (const auto& piece : pieces) {
      const double T = piece.segment->duration();
      for (int k = 1; k < 40; ++k) {
        const double x = T * k / 40;
        const PathSample s = conformance::sample_at(*piece.segment, x),
                         a = conformance::sample_at(*piece.segment, x - h),
                         b = conformance::sample_at(*piece.segment, x + h);
        const auto rate = [&](const Vec3& from, const Vec3& to) {
          return spatial::scale(spatial::sub(to, from), 1 / (2 * h));
        };
        EXPECT_LT(spatial::distance(rate(a.pose.p, b.pose.p), s.velocity), 1e-5);
        EXPECT_LT(spatial::distance(rate(a.velocity, b.velocity), s.acceleration), 1e-4);
        const Vec3 turn =
            spatial::scale(spatial::rotation_difference(a.pose.R, b.pose.R), 1 / (2 * h));
        EXPECT_LT(spatial::distance(turn, s.angular_velocity), 1e-4);
        EXPECT_LT(
            spatial::distance(rate(a.angular_velocity, b.angular_velocity), s.angular_acceleration),
            1e-3);
      }
    }
  }
}

TEST(Transitions, NoneLetsTheVelocityJump) {
  const auto made = build(corner({.is_smooth = false, .distance = 0, .speed = 0}));
  ASSERT_TRUE(made.ok()) << made.error().sentence();
  EXPECT_EQ((*made)->segment_count(), 2U);
  EXPECT_NEAR((*made)->length(), 0.4 + std::hypot(0.3, 0.1), 1e-12);
  EXPECT_GT(jumps(**made).velocity, 0.1);
}

TEST(Transitions, NeedNothingWhereTheToolRests) {
  Trajectory t = corner({});
  for (auto& s : t.segments) s.law.name = "quintic";
  const auto made = build(t);
  ASSERT_TRUE(made.ok()) << made.error().sentence();
  EXPECT_EQ((*made)->segment_count(), 2U);
}

TEST(Waits, AreSplinesWithTimesAtOnePlace) {
  Trajectory t;
  t.segments.push_back(record_of("line", {place(0, 0, 0), place(0.4, 0, 0)}));
  t.segments.push_back(record_of("cubic_spline", {place(0.4, 0, 0), place(0.4, 0, 0)}));
  t.segments.push_back(record_of("line", {place(0.4, 0, 0), place(0.4, 0.3, 0)}));
  // Without times there is nothing that says how long.
  const auto refused = build(t);
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.error().message.find("are at the same position"), std::string::npos);
  t.segments[1].shape.params["times"] = std::vector<double>{0, 2.5};
  for (auto& segment : t.segments) segment.transition.is_smooth = false;
  auto path = build(t);
  ASSERT_TRUE(path.ok()) << path.error().sentence();
  const double before = (*path)->pieces()[1].start;
  EXPECT_NEAR((*path)->pieces()[2].start - before, 2.5, 1e-12);
  EXPECT_NEAR((*path)->length(), 0.7, 1e-12);
  for (const double x : {0.0, 1.1, 2.4}) {
    const PathSample s = path_at(**path, before + x);
    EXPECT_NEAR(s.pose.p[0], 0.4, 1e-15);
    EXPECT_EQ(spatial::norm(s.velocity), 0);
    EXPECT_EQ(spatial::norm(s.acceleration), 0);
    EXPECT_EQ(spatial::norm(s.angular_velocity), 0);
  }
  // Smoothly slowed down for and left.
  t.segments[1].transition = t.segments[2].transition = {};
  path = build(t);
  ASSERT_TRUE(path.ok()) << path.error().sentence();
  const Jumps j = jumps(**path);
  EXPECT_LT(j.position, 1e-9);
  EXPECT_LT(j.velocity, 1e-6);
}

TEST(Transitions, BridgeGaps) {
  Trajectory t;
  t.segments.push_back(record_of("line", {place(0, 0, 0), place(0.4, 0, 0)}));
  t.segments.push_back(record_of(
      "arc", {place(0.5, 0.1, 0, {0, 0, 2}), place(0.6, 0.2, 0), place(0.5, 0.3, 0, {1, 0, 0})}));
  const auto made = build(t);
  ASSERT_TRUE(made.ok()) << made.error().sentence();
  EXPECT_EQ((*made)->segment_count(), 3U);
  const Jumps j = jumps(**made);
  EXPECT_LT(j.position, 1e-9);
  EXPECT_LT(j.rotation, 1e-8);
  EXPECT_LT(j.velocity, 1e-4);
  EXPECT_LT(j.turning, 1e-3);
  t.segments.back().transition.is_smooth = false;
  EXPECT_EQ(build(t).error().sentence(),
            "trajectory \"test\": segment 1 ends and segment 2 starts 0.141421 m apart. Give the "
            "second segment the first one's last pose, or allow a transition.");
}

TEST(StoredTrajectories, RunElsewhere) {
  model::Record stroke;
  stroke.name = "stroke";
  Trajectory inner;
  inner.segments.push_back(record_of("line", {place(0, 0, 0), place(0.2, 0, 0)}));
  stroke.body = inner;
  const TrajectoryId id{7};
  const motion::FindTrajectory find = [&](TrajectoryId wanted) {
    return wanted == id ? &stroke : nullptr;
  };
  Trajectory outer;
  TrajectorySegment s;
  s.stored = id;
  outer.segments.push_back(s);
  s.placement.position = {0.2, 0, 0};
  s.placement.angles = {0, 0, std::numbers::pi / 2};
  inner.segments.push_back(record_of("line", {place(0.2, 0, 0), place(0.2, 0, 0, {0, 0, 1})}));
  inner.segments.push_back(record_of(
      "line", {place(0.2, 0, 0, {0, 0, 1}), place(0.2, 0, 0, {0, 0, std::numbers::pi / 2})}));
  for (auto& segment : inner.segments) segment.transition.is_smooth = false;
  stroke.body = inner;
  s.transition.is_smooth = false;
  outer.segments.push_back(s);
  const auto made = build(outer, find);
  ASSERT_TRUE(made.ok()) << made.error().sentence();
  EXPECT_NEAR((*made)->length(), 0.4, 1e-12);
  const PathSample end = path_at(**made, (*made)->duration());
  EXPECT_NEAR(end.pose.p[0], 0.2, 1e-15);
  EXPECT_NEAR(end.pose.p[1], 0.2, 1e-15);
  EXPECT_NEAR(end.angular_velocity[2], 0.5, 1e-15);

  std::get<Trajectory>(stroke.body).segments.push_back(s);
  EXPECT_EQ(build(outer, find).error().sentence(),
            "trajectory \"test\", segment 1, trajectory \"stroke\", segment 4: trajectory "
            "\"stroke\" would run itself. Remove one of the segments that form the cycle.");
  outer.segments[0].stored = TrajectoryId{8};
  EXPECT_EQ(
      build(outer, find).error().sentence(),
      "trajectory \"test\", segment 1: the trajectory it runs does not exist. Remove the segment "
      "or give another trajectory.");
}

/// An ellipse by its angle.
class Ellipse final : public Curve {
 public:
  [[nodiscard]] double end() const override { return 2 * std::numbers::pi; }
  [[nodiscard]] std::vector<double> knots() const override { return {0, std::numbers::pi}; }
  Result<void> evaluate(std::span<const double> u, std::span<CurveSample> out) const override {
    for (std::size_t i = 0; i < u.size(); ++i) {
      const double c = std::cos(u[i]), s = std::sin(u[i]);
      out[i] = {{2 * c, s, 0}, {-2 * s, c, 0}, {-2 * c, -s, 0}, {2 * s, -c, 0}};
    }
    return {};
  }
};

// The circumference of an ellipse with half axes 2 and 1 is 8 E(3/4) = 9.688448220547676
// (Abramowitz and Stegun, table 17.1: E(3/4) = 1.21105 60276).
TEST(CurveWalk, MeasuresAnEllipse) {
  const auto walk = motion::CurveWalk::build(std::make_shared<Ellipse>());
  ASSERT_TRUE(walk.ok()) << walk.error().sentence();
  EXPECT_NEAR(walk->length(), 8 * 1.2110560276, 1e-9);
  const auto shares = walk->knot_shares();
  ASSERT_TRUE(shares.ok());
  EXPECT_NEAR((*shares)[1], 0.5, 1e-12);
  for (int i = 0; i <= 100; ++i) {
    const double w = 0.01 * i, h = 1e-5;
    CurveSample s[3];
    const double path_at[] = {std::max(0.0, w - h), w, std::min(1.0, w + h)};
    ASSERT_TRUE(walk->evaluate(path_at, s).ok());
    EXPECT_NEAR(spatial::norm(s[1].d1), walk->length(), 1e-10);
    EXPECT_NEAR(spatial::dot(s[1].d1, s[1].d2), 0, 1e-8) << "even steps have no acceleration along";
    for (std::size_t k = 0; k < 3 && i > 0 && i < 100; ++k) {
      EXPECT_NEAR(s[1].d2[k], (s[2].d1[k] - s[0].d1[k]) / (2 * h), 1e-4);
      EXPECT_NEAR(s[1].d3[k], (s[2].d2[k] - s[0].d2[k]) / (2 * h), 1e-2);
    }
  }
}

// The turn by a law of its own: R = exp(w_o(t) phi) R1 with the cubic w_o = 3x^2 - 2x^3 while the
// way goes at a constant speed, both over the same 2 s.
TEST(Turning, RunsByALawOfItsOwn) {
  const Vec3 phi{0.4, -0.9, 1.1};
  TrajectorySegment record = record_of("line", {place(0, 0, 0), place(0.4, 0, 0, phi)});
  record.shape.params["duration"] = 2.0;
  record.turning.name = "cubic";
  const auto made = motion::make_segment(registry(), record, "it");
  ASSERT_TRUE(made.ok()) << made.error().sentence();
  EXPECT_DOUBLE_EQ((*made)->duration(), 2);
  for (int i = 0; i <= 200; ++i) {
    const double t = 0.01 * i, x = t / 2;
    const double w = x * x * (3 - 2 * x), w1 = 6 * x * (1 - x) / 2, w2 = (6 - 12 * x) / 4;
    const PathSample s = conformance::sample_at(**made, t);
    EXPECT_NEAR(s.pose.p[0], 0.2 * t, 1e-12);
    EXPECT_NEAR(s.velocity[0], 0.2, 1e-12);
    EXPECT_LT(spatial::norm(spatial::rotation_difference(
                  spatial::rotation_exp(spatial::scale(phi, w)), s.pose.R)),
              1e-12);
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_NEAR(s.angular_velocity[k], w1 * phi[k], 1e-12);
      EXPECT_NEAR(s.angular_acceleration[k], w2 * phi[k], 1e-12);
    }
  }
}

TEST(Turning, AndTheWayTakeAsLongAsTheLongerOfThem) {
  const double angle = 3;
  TrajectorySegment record = record_of("line", {place(0, 0, 0), place(0.4, 0, 0, {angle, 0, 0})});
  record.shape.params["speed"] = 0.4;  // 1 s for the way
  record.law.name = "constant_speed";
  record.turning = {"trapezoidal", {{"angular_speed", 1.5}, {"angular_acceleration", 3.0}}};
  const auto slow = motion::make_segment(registry(), record, "it");
  ASSERT_TRUE(slow.ok()) << slow.error().sentence();
  // A trapezoid of speed takes angle / speed + speed / acceleration.
  const double T = angle / 1.5 + 1.5 / 3;
  EXPECT_NEAR((*slow)->duration(), T, 1e-12);
  EXPECT_NEAR(conformance::sample_at(**slow, T / 2).velocity[0], 0.4 / T, 1e-12);
  EXPECT_NEAR(conformance::sample_at(**slow, T / 2).angular_velocity[0], 1.5, 1e-12);
  EXPECT_NEAR(conformance::sample_at(**slow, 0.25).angular_acceleration[0], 3, 1e-12);

  record.shape.params["speed"] = 0.1;  // 4 s for the way: the turn is slowed by 4 / T
  const auto fast = motion::make_segment(registry(), record, "it");
  ASSERT_TRUE(fast.ok()) << fast.error().sentence();
  EXPECT_NEAR((*fast)->duration(), 4, 1e-12);
  EXPECT_NEAR(conformance::sample_at(**fast, 2).velocity[0], 0.1, 1e-12);
  EXPECT_NEAR(conformance::sample_at(**fast, 2).angular_velocity[0], 1.5 * T / 4, 1e-12);
  EXPECT_NEAR(conformance::sample_at(**fast, 0.25).angular_acceleration[0], 3 * T * T / 16, 1e-12);
}

TEST(Turning, FollowsTheTangentAtItsOwnShare) {
  TrajectorySegment record =
      record_of("arc_centre", {place(1, 0, 0, {0, 0, std::numbers::pi / 2})});
  record.shape.params = {
      {"centre", std::vector<double>{0, 0, 0}}, {"angle", std::numbers::pi / 2}, {"duration", 1.0}};
  record.orientation.name = "tangent";
  record.turning.name = "quintic";
  const auto made = motion::make_segment(registry(), record, "it");
  ASSERT_TRUE(made.ok()) << made.error().sentence();
  const double x = 0.3, w = x * x * x * (10 + x * (6 * x - 15));
  const PathSample s = conformance::sample_at(**made, x);
  EXPECT_NEAR(s.pose.p[0], std::cos(x * std::numbers::pi / 2), 1e-12);
  EXPECT_NEAR(s.pose.R[0], -std::sin(w * std::numbers::pi / 2), 1e-12);
  EXPECT_NEAR(s.angular_velocity[2], 30 * x * x * (1 - x) * (1 - x) * std::numbers::pi / 2, 1e-11);
}

TEST(Turning, IsRefusedInOneSentence) {
  TrajectorySegment record = record_of("line", {place(0, 0, 0), place(0.4, 0, 0, {1, 0, 0})});
  record.turning.name = "cubik";
  EXPECT_EQ(motion::make_segment(registry(), record, "it").error().sentence(),
            "it: there is no motion_law provider \"cubik\". Did you mean \"cubic\"? Available: "
            "constant_speed, constant_acceleration, trapezoidal, s_curve, cubic, quintic and "
            "cycloidal.");
  record.turning = {"cubic", {{"angular_speed", 0.0}}};
  EXPECT_EQ(motion::make_segment(registry(), record, "it").error().sentence(),
            "it, turning: angular_speed is 0 rad/s. It must be above 0.");
}

}  // namespace
}  // namespace robomosp
