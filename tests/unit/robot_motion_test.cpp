// SPDX-License-Identifier: Apache-2.0
// Trajectories of joint and Cartesian segments on a robot: what follows what, when, and how
// smoothly.
#include <cmath>

#include <gtest/gtest.h>
#include <robomosp/sdk/joint_segment.h>

#include "model/placement.h"
#include "robotics/kinematics.h"
#include "sim/retime.h"
#include "sim/simulate.h"
#include "spatial/pose.h"
#include "spatial/rotation.h"
#include "support/workbench.h"

namespace robomosp {
namespace {

using recording::Recording;
using test::unwrap;
using test::Workbench;

/// From the first joint vector to the last by x = (1 - cos(pi t / T)) / 2 in two seconds.
class Cosine final : public JointSegment {
 public:
  Cosine(std::size_t dof, std::span<const double> points)
      : dof_(dof), points_(points.begin(), points.end()) {}
  [[nodiscard]] double duration() const override { return 2; }
  Result<void> sample(std::span<const double> times, const JointSamples& out) const override {
    const double w = M_PI / 2;
    for (std::size_t i = 0; i < times.size(); ++i)
      for (std::size_t j = 0; j < dof_; ++j) {
        const double from = points_[j], way = points_[points_.size() - dof_ + j] - from;
        out.q[i * dof_ + j] = from + way * (1 - std::cos(w * times[i])) / 2;
        if (!out.qd.empty()) out.qd[i * dof_ + j] = way * w * std::sin(w * times[i]) / 2;
        if (!out.qdd.empty()) out.qdd[i * dof_ + j] = way * w * w * std::cos(w * times[i]) / 2;
      }
    return {};
  }

 private:
  std::size_t dof_;
  std::vector<double> points_;
};
class CosineFactory final : public JointSegmentFactory {
 public:
  Result<std::unique_ptr<JointSegment>> make(std::size_t dof, std::span<const double> points,
                                             const JointLimits& limits, const JointEnds&,
                                             const Params&) const override {
    EXPECT_EQ(limits.velocity.size(), dof);
    return std::unique_ptr<JointSegment>(new Cosine(dof, points));
  }
};

class RobotMotion : public ::testing::Test {
 protected:
  Workbench bench;
  NoProgress progress;
  RobotId robot;
  const std::vector<double> home{0, 0.35, 0, 1.85, 0, 0.94, 0};

  void SetUp() override {
    robot = {bench.load("robots/pa10.rbt").number};
    ProviderInfo info;
    info.interface_id = JointSegmentFactory::kInterfaceId;
    info.name = "cosine";
    ASSERT_TRUE(bench.registry
                    .add(info,
                         [] {
                           return Result<void*>(static_cast<void*>(
                               static_cast<JointSegmentFactory*>(new CosineFactory)));
                         })
                    .ok());
    limit(2, 8, std::numeric_limits<double>::infinity());
  }
  /// Limits of every joint.
  void limit(double velocity, double acceleration, double torque) {
    auto t = bench.document.begin("limits");
    ASSERT_TRUE(t->edit(AnyId(robot), [&](model::Record& r) -> Result<void> {
                   for (model::Link& l : std::get<model::Robot>(r.body).links) {
                     l.max_velocity = velocity;
                     l.max_acceleration = acceleration;
                     l.max_jerk = std::isfinite(velocity) ? 100 : velocity;
                     l.max_force = torque;
                   }
                   return {};
                 }).ok());
    ASSERT_TRUE(t->commit().ok());
  }
  Result<recording::RecordingPtr> run(const model::Trajectory& trajectory, double step = 0.05) {
    auto t = bench.document.begin("world");
    const auto id = unwrap(t->add("way" + std::to_string(++count_), trajectory));
    model::World w;
    w.robots.push_back({"arm", robot, {}, home});
    w.trajectories.push_back({"way", id, {}});
    const WorldId world = unwrap(t->add("cell" + std::to_string(count_), std::move(w)));
    EXPECT_TRUE(t->commit().ok());
    const auto snapshot = bench.document.now();
    const sim::Simulator simulator{bench.registry, bench.derived, *snapshot};
    return simulator.inverse_dynamics({.world = world,
                                       .robot = "arm",
                                       .trajectory = "way",
                                       .sample_time = step,
                                       .begins_on_path = begins_on_path},
                                      progress);
  }
  bool begins_on_path = false;
  Pose tip(const std::vector<double>& q) {
    const auto snapshot = bench.document.now();
    const auto model = unwrap(bench.derived.robot_model(*snapshot, robot, {0, 0, -9.81}, progress));
    std::vector<Pose> frames(model->joints.size());
    robotics::forward_kinematics(*model, q, frames);
    return robotics::tip_pose(*model, 0, frames);
  }
  static std::vector<double> row(const Recording& r, const std::string& stem, std::size_t i) {
    std::vector<double> v;
    for (std::size_t j = 1; j <= r.dof; ++j)
      v.push_back(r.find(stem + std::to_string(j))->values[i]);
    return v;
  }
  static model::TrajectorySegment joints(std::vector<std::vector<double>> q) {
    model::TrajectorySegment s;
    s.shape.name = "cosine";
    s.joints = std::move(q);
    return s;
  }
  static model::TrajectorySegment line(const Pose& from, const Pose& to, const char* law) {
    model::TrajectorySegment s;
    s.shape.name = "line";
    s.law.name = law;
    s.points = {model::placement(from), model::placement(to)};
    return s;
  }
  int count_ = 0;
};

TEST_F(RobotMotion, JointSegmentsStartWhereTheJointsAre) {
  const std::vector<double> there{0.2, 0.5, 0.1, 1.6, 0, 1, 0.3};
  model::Trajectory t;
  t.segments.push_back(joints({there}));
  const auto r = run(t);
  ASSERT_TRUE(r.ok()) << r.error().sentence();
  EXPECT_EQ((*r)->rows(), 41U);
  EXPECT_NEAR((*r)->find("time")->values.back(), 2, 1e-12);
  EXPECT_EQ(row(**r, "q", 0), home);
  for (std::size_t j = 0; j < 7; ++j) EXPECT_NEAR(row(**r, "q", 40)[j], there[j], 1e-12);
  // Half way at half the time, at pi/2 / T times the way.
  EXPECT_NEAR((*r)->find("q1")->values[20], 0.1, 1e-12);
  EXPECT_NEAR((*r)->find("qd1")->values[20], 0.2 * M_PI / 4, 1e-12);
  EXPECT_EQ((*r)->find("position_error")->values[20], 0);
}

TEST_F(RobotMotion, CartesianPathsFollowJointMovesAndBackAgain) {
  const std::vector<double> there{0.2, 0.5, 0.1, 1.6, 0, 1, 0.3};
  const Pose from = tip(there);
  Pose to = from;
  to.p[2] += 0.1;
  model::Trajectory t;
  t.segments = {joints({there}), line(from, to, "quintic"), joints({home})};
  const auto r = run(t, 0.013);
  ASSERT_TRUE(r.ok()) << r.error().sentence();
  EXPECT_TRUE((*r)->notes.empty()) << (*r)->notes.front();
  const auto& times = (*r)->find("time")->values;
  for (std::size_t i = 0; i + 1 < times.size(); ++i)
    EXPECT_NEAR(times[i], 0.013 * static_cast<double>(i), 1e-9);
  // Positions change by the mean of the rates, up to terms of third order: nothing jumps.
  for (std::size_t i = 1; i < times.size(); ++i) {
    const double h = times[i] - times[i - 1];
    const auto a = row(**r, "q", i - 1), b = row(**r, "q", i), va = row(**r, "qd", i - 1),
               vb = row(**r, "qd", i);
    for (std::size_t j = 0; j < 7; ++j)
      EXPECT_NEAR(b[j] - a[j], h * (va[j] + vb[j]) / 2, 2e-5) << "at " << times[i];
  }
  for (std::size_t j = 0; j < 7; ++j)
    EXPECT_NEAR(row(**r, "q", times.size() - 1)[j], home[j], 1e-9);
  // On the way of the line: straight up.
  const double middle = 2 + (times.back() - 4) / 2;
  const auto i = static_cast<std::size_t>(middle / 0.013);
  EXPECT_NEAR((*r)->find("x")->values[i], from.p[0], 1e-9);
  EXPECT_GT((*r)->find("z")->values[i], from.p[2] + 0.01);
}

TEST_F(RobotMotion, AMoveIsPutInWhereThePathBeginsElsewhere) {
  Pose from = tip(home), to = from;
  from.p[1] += 0.1, to.p[1] += 0.2;
  model::Trajectory t;
  t.segments = {joints({{0.2, 0.5, 0.1, 1.6, 0, 1, 0.3}}), line(from, to, "quintic")};
  const auto r = run(t);
  ASSERT_TRUE(r.ok()) << r.error().sentence();
  ASSERT_EQ((*r)->notes.size(), 1U);
  EXPECT_EQ(
      (*r)->notes[0],
      "A joint move was inserted at t = 2 s: the path does not start at the present joint values.");
  EXPECT_NEAR((*r)->find("y")->values.back(), to.p[1], 1e-9);
}

// A jerk-limited way that is passed in motion: nothing jumps where one segment hands over to the
// next, and it is shorter than stopping there.
TEST_F(RobotMotion, JointSegmentsHandTheirMotionOn) {
  std::vector<double> middle = home, there = home;
  for (std::size_t j = 0; j < 7; ++j) middle[j] += 0.15, there[j] += 0.4;
  const auto ways = [&](const std::vector<double>& velocity) {
    model::Trajectory t;
    t.segments = {joints({middle}), joints({there})};
    for (auto& s : t.segments) s.shape.name = "time_optimal";
    t.segments[0].shape.params["end_velocity"] = velocity;
    return t;
  };
  const double step = 0.004;
  const auto r = run(ways(std::vector<double>(7, 0.6)), step), stops = run(ways({}), step);
  ASSERT_TRUE(r.ok()) << r.error().sentence();
  ASSERT_TRUE(stops.ok()) << stops.error().sentence();
  EXPECT_LT((*r)->find("time")->values.back(), (*stops)->find("time")->values.back() - 0.1);
  std::size_t passed = 0;
  for (std::size_t i = 1; i < (*r)->rows(); ++i) {
    const auto a = row(**r, "q", i - 1), b = row(**r, "q", i), va = row(**r, "qd", i - 1),
               vb = row(**r, "qd", i);
    const double h = (*r)->find("time")->values[i] - (*r)->find("time")->values[i - 1];
    for (std::size_t j = 0; j < 7; ++j) {
      EXPECT_NEAR(b[j] - a[j], h * (va[j] + vb[j]) / 2, 100 * h * h * h / 6);
      EXPECT_LE(std::fabs(vb[j]), 2 + 1e-9);
    }
    if (a[0] <= middle[0] && b[0] > middle[0]) {
      ++passed;
      EXPECT_NEAR(va[0], 0.6, 8 * h);
    }
  }
  EXPECT_EQ(passed, 1U);
  // Who must begin at rest says so, in joints and in space.
  auto wrong = ways(std::vector<double>(7, 0.6));
  wrong.segments[1].shape.name = "ptp";
  EXPECT_NE(run(wrong).error().sentence().find("ptp moves from rest to rest"), std::string::npos)
      << run(wrong).error().sentence();
  Pose to = tip(middle);
  to.p[2] += 0.05;
  wrong.segments[1] = line(tip(middle), to, "quintic");
  EXPECT_NE(run(wrong).error().sentence().find("ends in motion"), std::string::npos)
      << run(wrong).error().sentence();
}

TEST_F(RobotMotion, PointsInSpaceAreTargetsOfJointMovesToo) {
  Pose target = tip(home);
  target.p[1] += 0.15;
  model::Trajectory t;
  t.segments.push_back(joints({}));
  t.segments.back().points = {model::placement(target)};
  const auto r = run(t);
  ASSERT_TRUE(r.ok()) << r.error().sentence();
  EXPECT_NEAR((*r)->find("y")->values.back(), target.p[1], 1e-8);
}

TEST_F(RobotMotion, LimitsThatARobotLacksAreAssumedAndTold) {
  limit(std::numeric_limits<double>::infinity(), 8, 100);
  model::Trajectory t;
  t.segments = {joints({{0.2, 0.5, 0.1, 1.6, 0, 1, 0.3}}), joints({home})};
  const auto r = run(t);
  ASSERT_TRUE(r.ok()) << r.error().sentence();
  ASSERT_EQ((*r)->notes.size(), 1U);
  EXPECT_EQ((*r)->notes[0],
            "The robot lacks limits: velocity of all joints and jerk of all joints. Joint moves "
            "use these defaults: 1 rad/s (m/s) and full acceleration after 0.25 s.");
}

// What a segment gives stands in where the robot has no limit, and is not below an assumed one.
TEST_F(RobotMotion, LimitsOfASegmentStandInForThoseThatTheRobotLacks) {
  constexpr double kNone = std::numeric_limits<double>::infinity();
  limit(kNone, kNone, 100);
  std::vector<double> there = home;
  there[0] += 2;
  model::Trajectory t;
  t.segments = {joints({there})};
  t.segments[0].shape.name = "ptp";
  t.segments[0].shape.params["profile"] = std::string("trapezoidal");
  t.segments[0].shape.params["velocity"] = std::vector<double>{3};
  t.segments[0].shape.params["acceleration"] = std::vector<double>(7, 20.0);
  const auto r = run(t, 0.001);
  ASSERT_TRUE(r.ok()) << r.error().sentence();
  double v = 0, a = 0;
  for (std::size_t i = 0; i < (*r)->rows(); ++i) {
    v = std::max(v, std::fabs(row(**r, "qd", i)[0]));
    a = std::max(a, std::fabs(row(**r, "qdd", i)[0]));
  }
  EXPECT_NEAR(v, 3, 1e-6);
  EXPECT_NEAR(a, 20, 1e-6);
  ASSERT_EQ((*r)->notes.size(), 1U);
  EXPECT_EQ((*r)->notes[0],
            "The robot lacks limits: jerk of all joints. Joint moves use these defaults: full "
            "acceleration after 0.25 s.");
}

// A way of several joint vectors that begins elsewhere than the robot stands.
TEST_F(RobotMotion, AWayOfJointsThatBeginsElsewhereGetsAnApproachThatIsTold) {
  const std::vector<double> from{0.2, 0.5, 0.1, 1.6, 0, 1, 0.3};
  std::vector<double> to = from;
  to[0] += 0.5;
  model::Trajectory t;
  t.segments = {joints({from, to})};
  t.segments[0].shape.name = "joint_spline";
  t.segments[0].shape.params["times"] = std::vector<double>{0, 2};
  const auto r = run(t);
  ASSERT_TRUE(r.ok()) << r.error().sentence();
  ASSERT_FALSE((*r)->notes.empty());
  EXPECT_NE((*r)->notes[0].find("An approach of "), std::string::npos) << (*r)->notes[0];
  EXPECT_NE((*r)->notes[0].find("start = \"path\" starts there"), std::string::npos);
  const auto* approach = (*r)->find(recording::kApproachColumn);
  ASSERT_NE(approach, nullptr);
  const auto& times = (*r)->find("time")->values;
  // Its rows end where the segment begins, 2 s before the end.
  const double begins = times.back() - 2;
  EXPECT_GT(begins, 0.1);
  for (std::size_t i = 0; i < times.size(); ++i)
    EXPECT_EQ(approach->values[i], times[i] < begins - 1e-9 ? 1 : 0) << times[i];
  for (std::size_t j = 0; j < 7; ++j) {
    EXPECT_NEAR(row(**r, "q", 0)[j], home[j], 1e-12);
    EXPECT_NEAR(row(**r, "q", times.size() - 1)[j], to[j], 1e-12);
  }
  // On request it begins there.
  begins_on_path = true;
  const auto there = run(t);
  ASSERT_TRUE(there.ok()) << there.error().sentence();
  EXPECT_EQ((*there)->find(recording::kApproachColumn), nullptr);
  EXPECT_NEAR((*there)->find("time")->values.back(), 2, 1e-12);
  for (std::size_t j = 0; j < 7; ++j) EXPECT_NEAR(row(**there, "q", 0)[j], from[j], 1e-12);
  for (const std::string& note : (*there)->notes)
    EXPECT_EQ(note.find("approach"), std::string::npos) << note;
}

// A segment to where the joints are takes no time, or the time asked for; so do vectors that are
// given twice.
TEST_F(RobotMotion, ASegmentToWhereTheJointsAreIsNoError) {
  const auto time = [&](const model::Trajectory& t) {
    const auto r = run(t);
    EXPECT_TRUE(r.ok()) << (r.ok() ? "" : r.error().sentence());
    if (!r.ok()) return -1.0;
    for (std::size_t j = 0; j < 7; ++j)
      EXPECT_NEAR(row(**r, "q", (*r)->find("time")->values.size() - 1)[j], home[j], 1e-12);
    return (*r)->find("time")->values.back();
  };
  for (const char* shape : {"ptp", "joint_spline", "time_optimal"}) {
    SCOPED_TRACE(shape);
    for (const std::vector<std::vector<double>>& q :
         {std::vector<std::vector<double>>{home}, {home, home}}) {
      model::Trajectory t;
      t.segments = {joints(q)};
      t.segments[0].shape.name = shape;
      EXPECT_EQ(time(t), 0);
      if (std::string_view(shape) == "joint_spline") continue;
      t.segments[0].shape.params["duration"] = 1.5;
      EXPECT_NEAR(time(t), 1.5, 1e-12);
    }
  }
  model::Trajectory t;
  t.segments = {line(tip(home), tip(home), "trapezoidal")};
  EXPECT_EQ(time(t), 0);
  t.segments[0].shape.params["duration"] = 0.7;
  EXPECT_NEAR(time(t), 0.7, 1e-12);
  // Before and behind a motion nothing changes.
  std::vector<double> to = home;
  to[0] += 0.3;
  const auto lasts = [&](const std::vector<std::vector<double>>& q) {
    model::Trajectory m;
    m.segments = {joints(q)};
    m.segments[0].shape.name = "ptp";
    const auto r = run(m);
    EXPECT_TRUE(r.ok()) << (r.ok() ? "" : r.error().sentence());
    return r.ok() ? (*r)->find("time")->values.back() : -1;
  };
  EXPECT_NEAR(lasts({home, home, to, to}), lasts({home, to}), 1e-12);
}

TEST_F(RobotMotion, WrongInputIsToldByPlace) {
  model::Trajectory t;
  t.segments.push_back(joints({{0.1, 0.2}}));
  EXPECT_NE(run(t).error().sentence().find(
                "segment 1: joint vector 1 has 2 values, but the robot has 7 joints."),
            std::string::npos)
      << run(t).error().sentence();
  Pose far = tip(home), farther = far;
  far.p[0] += 0.05, farther.p[0] += 3;
  t.segments = {line(tip(home), farther, "quintic")};
  const std::string told = run(t).error().sentence();
  EXPECT_NE(told.find(" of "), std::string::npos) << told;
  EXPECT_NE(told.find("the robot cannot follow"), std::string::npos) << told;
}

class TimeOptimal : public RobotMotion {
 protected:
  Result<recording::RecordingPtr> fastest(const model::Trajectory& trajectory,
                                          const sim::RetimeOptions& options, double step) {
    auto t = bench.document.begin("world");
    const auto id = unwrap(t->add("way" + std::to_string(++count_), trajectory));
    model::World w;
    w.robots.push_back({"arm", robot, {}, home});
    w.trajectories.push_back({"way", id, {}});
    const WorldId world = unwrap(t->add("cell" + std::to_string(count_), std::move(w)));
    EXPECT_TRUE(t->commit().ok());
    const auto snapshot = bench.document.now();
    const sim::Simulator simulator{bench.registry, bench.derived, *snapshot};
    return simulator.time_optimal(
        {.world = world, .robot = "arm", .trajectory = "way", .sample_time = step}, options,
        progress);
  }
  static double most(const Recording& r, const std::string& column) {
    double m = 0;
    for (const double v : r.find(column)->values) m = std::max(m, std::fabs(v));
    return m;
  }
};

// All joints on a straight way: the one with the most to go, d, has the trapezoid of its limits,
// T = d / V + V / A.
TEST_F(TimeOptimal, AStraightJointMoveTakesTheTimeOfItsSlowestJoint) {
  limit(0.8, 2, std::numeric_limits<double>::infinity());
  std::vector<double> there = home;
  there[0] += 1, there[2] -= 0.4, there[6] += 0.7;
  model::Trajectory t;
  t.segments.push_back(joints({there}));
  const auto r = fastest(t, {}, 0.01);
  ASSERT_TRUE(r.ok()) << r.error().sentence();
  const double T = 1 / 0.8 + 0.8 / 2.0;
  EXPECT_NEAR((*r)->find("time")->values.back(), T, 1e-3 * T);
  EXPECT_GE((*r)->find("time")->values.back(), T - 1e-9);
  EXPECT_NEAR(most(**r, "qd1"), 0.8, 1e-6);
  EXPECT_NEAR(most(**r, "qdd1"), 2, 1e-6);
  for (std::size_t j = 0; j < 7; ++j) {
    EXPECT_NEAR(row(**r, "q", (*r)->rows() - 1)[j], there[j], 1e-9);
    EXPECT_LE(std::fabs(row(**r, "qd", 0)[j]), 1e-9);
  }
  // Half the limits: T = d / (V/2) + (V/2) / (A/2).
  const auto half = fastest(t, {.retimer = {}, .share = 0.5}, 0.01);
  ASSERT_TRUE(half.ok()) << half.error().sentence();
  EXPECT_NEAR((*half)->find("time")->values.back(), 2 / 0.8 + 0.8 / 2.0, 2e-3 * T);
}

TEST_F(TimeOptimal, LimitsAreKeptAlongACurveAndTorquesToo) {
  limit(1.5, 6, 60);
  const Pose centre = tip(home);
  model::Trajectory t;
  model::TrajectorySegment arc;
  arc.shape.name = "arc";
  for (const auto& [y, z] : {std::pair{0.0, 0.0}, std::pair{0.15, 0.05}, std::pair{0.1, 0.2}}) {
    Pose p = centre;
    p.p[1] += y, p.p[2] += z;
    arc.points.push_back(model::placement(p));
  }
  t.segments.push_back(arc);
  const auto r = fastest(t, {.retimer = {}, .share = 1, .has_torques = true, .step = 0.0003}, 0.01);
  ASSERT_TRUE(r.ok()) << r.error().sentence();
  double closest = 0;
  for (int j = 1; j <= 7; ++j) {
    const std::string n = std::to_string(j);
    EXPECT_LE(most(**r, "qd" + n), 1.5 * (1 + 1e-7));
    EXPECT_LE(most(**r, "qdd" + n), 6 * (1 + 1e-7));
    EXPECT_LE(most(**r, "tau" + n), 60 * (1 + 1e-7));
    closest = std::max(
        {closest, most(**r, "qd" + n) / 1.5, most(**r, "qdd" + n) / 6, most(**r, "tau" + n) / 60});
  }
  EXPECT_GT(closest, 0.98) << "some limit is used to the full";
  // Free of torque limits it is not slower.
  const auto free = fastest(t, {.retimer = {}, .share = 1, .has_torques = false}, 0.01);
  ASSERT_TRUE(free.ok()) << free.error().sentence();
  EXPECT_LE((*free)->find("time")->values.back(), (*r)->find("time")->values.back() * (1 + 1e-3));
  // A torque limit below what its weight asks for cannot be kept.
  limit(1.5, 6, 5);
  const auto weak = fastest(t, {}, 0.01);
  ASSERT_FALSE(weak.ok());
  EXPECT_NE(weak.error().sentence().find("to hold still"), std::string::npos)
      << weak.error().sentence();
}

TEST_F(TimeOptimal, ItStopsAtCorners) {
  limit(1.5, 6, std::numeric_limits<double>::infinity());
  const Pose a = tip(home);
  Pose b = a, c = a;
  b.p[1] += 0.1;
  c.p[1] += 0.1, c.p[2] += 0.1;
  model::Trajectory t;
  t.segments = {line(a, b, "quintic"), line(b, c, "quintic")};
  const auto r = fastest(t, {}, 0.01);
  ASSERT_TRUE(r.ok()) << r.error().sentence();
  ASSERT_EQ((*r)->notes.size(), 2U);
  EXPECT_NE((*r)->notes[0].find("the path has a corner"), std::string::npos) << (*r)->notes[0];
  EXPECT_NE((*r)->notes[1].find("The jerk is not limited"), std::string::npos) << (*r)->notes[1];
  double nearest = 1;
  for (std::size_t i = 0; i < (*r)->rows(); ++i)
    nearest = std::min(nearest, std::hypot((*r)->find("y")->values[i] - b.p[1],
                                           (*r)->find("z")->values[i] - b.p[2]));
  EXPECT_LT(nearest, 2e-3);
}

}  // namespace
}  // namespace robomosp
