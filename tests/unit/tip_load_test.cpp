// SPDX-License-Identifier: Apache-2.0
// Forces at a tip along trajectories, in runs and in torques of recorded motions, against J^T F of
// a Jacobian by differences of products of Denavit-Hartenberg matrices, and against motions in
// closed form.
#include <array>
#include <cmath>
#include <functional>

#include <gtest/gtest.h>

#include "kernel/text.h"
#include "robotics/closure.h"
#include "robotics/kinematics.h"
#include "sim/forward_simulation.h"
#include "sim/loaded_runs.h"
#include "sim/recording_columns.h"
#include "spatial/pose.h"
#include "spatial/rotation.h"
#include "support/records.h"
#include "support/workbench.h"

namespace robomosp {
namespace {

using recording::RecordingPtr;
using sim::LoadAxes;
using sim::TipLoad;
using test::make;
using test::unwrap;
using test::Workbench;

using LoadMatrix = std::array<double, 16>;  ///< 4 x 4, row by row
LoadMatrix load_product(const LoadMatrix& a, const LoadMatrix& b) {
  LoadMatrix c{};
  for (std::size_t i = 0; i < 4; ++i)
    for (std::size_t j = 0; j < 4; ++j)
      for (std::size_t k = 0; k < 4; ++k) c[4 * i + j] += a[4 * i + k] * b[4 * k + j];
  return c;
}
/// ABB's tool0 of the IRB 140 in its base: the rows of its file, and z of the tool along y of the
/// last.
LoadMatrix load_irb140(const std::vector<double>& q) {
  const double h = M_PI / 2;
  const double rows[6][3] = {{0.07, -h, 0.352}, {0.36, 0, 0}, {0, h, 0},
                             {0, -h, 0.38},     {0, h, 0},    {0, h, 0.065}};
  LoadMatrix t{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
  for (std::size_t i = 0; i < 6; ++i) {
    const auto& [a, alpha, d] = rows[i];
    const double c = std::cos(q[i]), s = std::sin(q[i]), ca = std::cos(alpha), sa = std::sin(alpha);
    t = load_product(
        t, {c, -s * ca, s * sa, a * c, s, c * ca, -c * sa, a * s, 0, sa, ca, d, 0, 0, 0, 1});
  }
  return load_product(t, {0, -1, 0, 0, 0, 0, 1, 0, -1, 0, 0, 0, 0, 0, 0, 1});
}

double value_in_row(const RecordingPtr& r, const std::string& column, std::size_t i) {
  const recording::Column* c = r->find(column);
  EXPECT_TRUE(c) << column;
  return c ? c->values[i] : 0;
}

/// An IRB 140 that stands turned in its world, and a straight seam before it.
class TipLoads : public ::testing::Test {
 protected:
  Workbench bench;
  NoProgress progress;
  WorldId world;
  // world_T_base: about z by kTurn, at kPlace.
  static constexpr double kTurn = 0.7;
  static constexpr Vec3 kPlace{0.2, -0.1, 0.3}, kFrom{0.45, -0.15, 0.4}, kTo{0.45, 0.15, 0.35};

  static Vec3 turned(const Vec3& v, double angle = kTurn) {
    return {std::cos(angle) * v[0] - std::sin(angle) * v[1],
            std::sin(angle) * v[0] + std::cos(angle) * v[1], v[2]};
  }
  static Vec3 in_world(const Vec3& p) {
    const Vec3 r = turned(p);
    return {r[0] + kPlace[0], r[1] + kPlace[1], r[2] + kPlace[2]};
  }
  void SetUp() override {
    const AnyId robot = bench.load("robots/irb140.rbt");
    model::Trajectory way;
    way.sample_time = 0.02;
    model::TrajectorySegment s;
    s.shape.name = "line";
    s.shape.params["speed"] = 0.25;
    s.law.name = "quintic";
    s.points = {{kFrom, {M_PI, 0, 0}}, {kTo, {M_PI, 0, 0}}};
    way.segments = {s};
    model::World w;
    w.robots.push_back(
        {"arm", RobotId{robot.number}, {kPlace, {0, 0, kTurn}}, {0, 0, 0, 0, 0.5, 0}});
    w.trajectories.push_back({"seam", make(bench.document, "seam", way), {kPlace, {0, 0, kTurn}}});
    world = make(bench.document, "cell", w);
  }
  Result<RecordingPtr> run(const TipLoad& load) {
    const auto snapshot = bench.document.now();
    const sim::Simulator simulator{bench.registry, bench.derived, *snapshot};
    return sim::inverse_dynamics(simulator, {.world = world, .robot = "arm", .trajectory = "seam"},
                                 load, progress);
  }
  std::string fault(const TipLoad& load) {
    const auto r = run(load);
    EXPECT_FALSE(r.ok());
    return r.ok() ? "" : r.error().sentence();
  }
  static std::vector<double> joints(const RecordingPtr& r, std::size_t i) {
    std::vector<double> q;
    for (int j = 1; j <= 6; ++j) q.push_back(value_in_row(r, "q" + std::to_string(j), i));
    return q;
  }
  /// The torques that hold a force and a moment given in the base's axes, by virtual work: -F dp/dq
  /// - M dR/dq, differences of order four.
  static std::array<double, 6> held(const std::vector<double>& q, const Vec3& force,
                                    const Vec3& moment) {
    constexpr double h = 1e-3;
    const LoadMatrix now = load_irb140(q);
    std::array<double, 6> out{};
    for (std::size_t j = 0; j < 6; ++j) {
      LoadMatrix d{};
      for (const auto& [step, weight] :
           {std::pair{-2.0, 1.0}, {-1.0, -8.0}, {1.0, 8.0}, {2.0, -1.0}}) {
        std::vector<double> moved = q;
        moved[j] += step * h;
        const LoadMatrix m = load_irb140(moved);
        for (std::size_t k = 0; k < 16; ++k) d[k] += weight * m[k] / (12 * h);
      }
      // dR R^T is skew: its entries are the turn about the base's axes.
      const auto skew = [&](std::size_t a, std::size_t b) {
        double sum = 0;
        for (std::size_t k = 0; k < 3; ++k) sum += d[4 * a + k] * now[4 * b + k];
        return sum;
      };
      const Vec3 turn{skew(2, 1), skew(0, 2), skew(1, 0)};
      for (std::size_t k = 0; k < 3; ++k) out[j] -= force[k] * d[4 * k + 3] + moment[k] * turn[k];
    }
    return out;
  }
  using Given = std::function<std::array<double, 6>(double time, double path)>;
  /// Each row of a run counts the force that `given` tells in the axes of the load.
  void expect_load(const TipLoad& load, const Given& given) {
    const RecordingPtr plain = unwrap(run({})), r = unwrap(run(load));
    ASSERT_TRUE(plain && r);
    ASSERT_EQ(plain->rows(), r->rows());
    EXPECT_FALSE(plain->find("wrench1"));
    double greatest = 0;
    for (std::size_t i = 0; i < r->rows(); ++i) {
      const auto q = joints(r, i);
      const LoadMatrix t = load_irb140(q);
      const Vec3 p = in_world({t[3], t[7], t[11]}), start = in_world(kFrom);
      const double path = std::hypot(p[0] - start[0], p[1] - start[1], p[2] - start[2]);
      EXPECT_NEAR(value_in_row(r, "path", i), path, 2e-7) << i;
      const auto w = given(value_in_row(r, "time", i), value_in_row(r, "path", i));
      Vec3 force{w[0], w[1], w[2]}, moment{w[3], w[4], w[5]};
      const auto by_tool = [&](const Vec3& v) {
        Vec3 out{};
        for (std::size_t a = 0; a < 3; ++a)
          for (std::size_t b = 0; b < 3; ++b) out[a] += t[4 * a + b] * v[b];
        return out;
      };
      if (load.axes == LoadAxes::world)
        force = turned(force, -kTurn), moment = turned(moment, -kTurn);
      if (load.axes == LoadAxes::tool) force = by_tool(force), moment = by_tool(moment);
      const auto want = held(q, force, moment);
      const Vec3 f = turned(force), m = turned(moment);
      for (std::size_t j = 0; j < 6; ++j) {
        const std::string n = std::to_string(j + 1);
        EXPECT_NEAR(value_in_row(r, "tau_external" + n, i), want[j], 1e-7) << i << " joint " << n;
        EXPECT_NEAR(value_in_row(r, "tau" + n, i) - value_in_row(plain, "tau" + n, i), want[j],
                    1e-7)
            << i;
        EXPECT_NEAR(value_in_row(r, "wrench" + n, i), j < 3 ? f[j] : m[j - 3], 1e-9) << i;
        greatest = std::max(greatest, std::fabs(want[j]));
      }
    }
    EXPECT_GT(greatest, 1);
  }
  static recording::RecordingPtr table(std::vector<recording::Column> columns) {
    recording::Recording r;
    r.columns = std::move(columns);
    return std::make_shared<const recording::Recording>(std::move(r));
  }
};

TEST_F(TipLoads, ConstantForcesInEachOfTheAxesTakeTheirPartOfTheTorques) {
  for (const LoadAxes axes : {LoadAxes::world, LoadAxes::base, LoadAxes::tool}) {
    TipLoad load;
    load.axes = axes;
    load.constant = {12, -7, 30, 0.6, 0.3, -0.9};
    expect_load(load, [&](double, double) { return load.constant; });
  }
}

TEST_F(TipLoads, ForcesAreFunctionsOfTimeAndPath) {
  TipLoad load;
  load.axes = LoadAxes::tool;
  load.constant[2] = 5;
  load.expressions = {"-20 N * sin(2 rad/s * time)", "5 N + 100 N/m * path", "", "", "",
                      "2 N m * path / 0.1 m"};
  expect_load(load, [](double t, double s) {
    return std::array<double, 6>{-20 * std::sin(2 * t), 5 + 100 * s, 5, 0, 0, 20 * s};
  });
}

TEST_F(TipLoads, ColumnsOfRecordingsActOverTimeOrPath) {
  TipLoad load;
  load.recorded = table({{"time", "s", "", {0, 100}},
                         {"fx", "N", "", {0, 1000}},
                         {"fy", "N", "", {3, 3}},
                         {"fz", "N", "", {0, 0}},
                         {"mx", "N m", "", {1, 1}},
                         {"my", "N m", "", {0, 0}},
                         {"mz", "N m", "", {0, 200}}});
  expect_load(load,
              [](double t, double) { return std::array<double, 6>{10 * t, 3, 0, 1, 0, 2 * t}; });
  // A sensor's own names and unit, over the path.
  TipLoad measured;
  measured.is_over_path = true;
  measured.columns = {"a", "b", "c"};
  measured.recorded = table({{"time", "s", "", {0, 1, 2}},
                             {"path", "m", "", {0, 0.1, 1}},
                             {"a", "kN", "", {0, 0.01, 0.01}},
                             {"b", "", "", {0, 0, 0}},
                             {"c", "N", "", {-4, -4, -4}}});
  expect_load(measured, [](double, double s) {
    return std::array<double, 6>{s < 0.1 ? 100 * s : 10, 0, -4, 0, 0, 0};
  });
}

TEST_F(TipLoads, WhatCannotActIsToldWithItsPlace) {
  TipLoad load;
  load.expressions[1] = "3 N * sin(q1)";
  EXPECT_NE(fault(load).find("tip_force[2]: there is no q1"), std::string::npos) << fault(load);
  load.expressions[1] = "3 m";
  EXPECT_NE(fault(load).find("tip_force[2]"), std::string::npos) << fault(load);
  load.expressions[1] = "1 N / (time - 0 s) * 1 s";
  EXPECT_NE(fault(load).find("t = 0 s"), std::string::npos) << fault(load);
  load = {};
  load.constant[0] = std::nan("");
  EXPECT_NE(fault(load).find("tip_force[1]"), std::string::npos) << fault(load);
  load = {};
  load.constant[0] = 1, load.tip = "elbow";
  EXPECT_NE(fault(load).find("has no tip \"elbow\""), std::string::npos) << fault(load);
  load = {};
  load.recorded = table({{"time", "s", "", {0, 1}}, {"q1", "rad", "", {0, 1}}});
  EXPECT_NE(fault(load).find("no column \"wrench1\""), std::string::npos) << fault(load);
  load.columns = {"q1", "q1", "q1"};
  EXPECT_NE(fault(load).find("\"q1\" is in rad, and N is needed"), std::string::npos)
      << fault(load);
  load.columns = {"q1"};
  EXPECT_NE(fault(load).find("1 columns are named"), std::string::npos) << fault(load);
  load.columns = {}, load.is_over_path = true;
  EXPECT_NE(fault(load).find("no column \"path\""), std::string::npos) << fault(load);
}

// A recording that is shorter than the run is not stretched: its last row acts on, which is told.
TEST_F(TipLoads, BeyondTheRowsOfARecordingTheNearestActsAndANoteTells) {
  TipLoad load;
  load.columns = {"x", "y", "z"};
  load.recorded = table({{"time", "s", "", {0, 0.01}},
                         {"x", "N", "", {0, 8}},
                         {"y", "N", "", {0, 0}},
                         {"z", "N", "", {0, 0}}});
  const RecordingPtr r = unwrap(run(load));
  ASSERT_TRUE(r);
  EXPECT_EQ(value_in_row(r, "wrench1", r->rows() - 1), 8);
  const auto told = [&](const std::string& note) {
    return note.find("outside its rows the nearest row applies") != std::string::npos;
  };
  EXPECT_TRUE(std::any_of(r->notes.begin(), r->notes.end(), told));
}

// A mounting that moves and turns: what is constant in the world turns for the robot.
TEST_F(TipLoads, ABaseThatMovesSeesTheForceOfTheWorldTurned) {
  model::Trajectory ride;
  ride.sample_time = 0.02;
  model::TrajectorySegment s;
  s.shape.name = "line";
  s.shape.params["speed"] = 0.1;
  s.law.name = "quintic";
  constexpr double kEndTurn = 1.0;
  s.points = {{kPlace, {0, 0, kTurn}},
              {{kPlace[0] + 0.05, kPlace[1], kPlace[2]}, {0, 0, kEndTurn}}};
  ride.segments = {s};
  model::World w = *bench.document.now()->get(world);
  w.trajectories.push_back({"ride", make(bench.document, "ride", ride), {}});
  w.robots[0].base = model::BaseKind::free_flying;
  w.robots[0].base_trajectory = "ride";
  world = make(bench.document, "moving cell", w);
  TipLoad load;
  load.constant = {12, -7, 30, 0.6, 0.3, -0.9};
  const RecordingPtr r = unwrap(run(load));
  ASSERT_TRUE(r);
  for (const auto& [row, turn] : {std::pair{std::size_t{0}, kTurn}, {r->rows() - 1, kEndTurn}}) {
    const auto want =
        held(joints(r, row), turned({12, -7, 30}, -turn), turned({0.6, 0.3, -0.9}, -turn));
    for (std::size_t j = 0; j < 6; ++j) {
      const std::string n = std::to_string(j + 1);
      EXPECT_NEAR(value_in_row(r, "tau_external" + n, row), want[j], 1e-6) << row << " joint " << n;
      EXPECT_NEAR(value_in_row(r, "wrench" + n, row), load.constant[j], 1e-9) << row;
    }
  }
}

// What inverse dynamics records makes forward dynamics go the same way.
TEST_F(TipLoads, RecordedTorquesAndForcesGiveTheMotionAgain) {
  TipLoad load;
  load.axes = LoadAxes::tool;
  load.expressions[2] = "-40 N - 200 N/m * path";
  load.constant[0] = 15;
  const auto snapshot = bench.document.now();
  const sim::Simulator simulator{bench.registry, bench.derived, *snapshot};
  const RecordingPtr r = unwrap(sim::inverse_dynamics(
      simulator, {.world = world, .robot = "arm", .trajectory = "seam", .sample_time = 0.002}, load,
      progress));
  ASSERT_TRUE(r);
  sim::ForwardRun forward;
  forward.world = world, forward.robot = "arm";
  // Without a controller what is a little off grows: a part of the way is looked at.
  const std::size_t last = 100;
  forward.duration = value_in_row(r, "time", last);
  forward.sample_time = 0.05;
  forward.q = joints(r, 0);
  forward.recorded_tau = r;
  forward.load.recorded = r;
  forward.at_limit = sim::AtLimit::ignore;
  const RecordingPtr again = unwrap(sim::forward_dynamics(simulator, forward, progress));
  ASSERT_TRUE(again);
  for (int j = 1; j <= 6; ++j) {
    const std::string n = "q" + std::to_string(j);
    EXPECT_NEAR(again->find(n)->values.back(), value_in_row(r, n, last), 2e-5) << n;
  }
}

/// A rod of 0.4 m that turns about the vertical, with 2 kg at its end.
struct TurningRod {
  static model::Robot record() {
    model::Robot r;
    model::Link l;
    l.name = "rod";
    l.row.a = 0.4;
    MassProperties mass;
    mass.mass = 2;
    l.given = mass;  // at the link frame's origin, which is the tool
    r.links.push_back(l);
    return r;
  }
};

// Across the rod in its own axes: qdd = F a / (m a^2) for good. In the world's axes it is a
// pendulum: q' ^2 = 2 F sin(q) / (m a) from rest at 0 under F along y.
TEST_F(TipLoads, ForcesInTheToolsAxesTurnWithIt) {
  const RobotId rod = make(bench.document, "rod", TurningRod::record());
  const auto snapshot = bench.document.now();
  const sim::Simulator simulator{bench.registry, bench.derived, *snapshot};
  sim::ForwardRun r;
  r.record = rod;
  r.duration = 1.5;
  r.load.constant[1] = 0.8;
  r.load.axes = LoadAxes::tool;
  const RecordingPtr turns = unwrap(sim::forward_dynamics(simulator, r, progress));
  r.load.axes = LoadAxes::world;
  const RecordingPtr swings = unwrap(sim::forward_dynamics(simulator, r, progress));
  ASSERT_TRUE(turns && swings);
  EXPECT_NEAR(turns->find("q1")->values.back(), 0.8 * 0.4 / (2 * 0.16) * 1.5 * 1.5 / 2, 1e-9);
  const double q = swings->find("q1")->values.back(), v = swings->find("qd1")->values.back();
  EXPECT_NEAR(v * v, 2 * 0.8 * std::sin(q) / (2 * 0.4), 1e-8);
  EXPECT_GT(q, 0.5);
  r.load = {};
  r.load.expressions[0] = "1 N/m * path";
  const auto none = sim::forward_dynamics(simulator, r, progress);
  ASSERT_FALSE(none.ok());
  EXPECT_NE(none.error().sentence().find("follows no path"), std::string::npos)
      << none.error().sentence();
}

/// Serial arms, prismatic joints, trees with several tips, followers and a floating base.
class LoadsOnMechanisms : public ::testing::TestWithParam<const char*> {
 protected:
  Workbench bench;
  NoProgress progress;

  /// -dW/dq of a force and a moment in the base's axes: what the motors have to give, by central
  /// differences of order four of the tip's pose.
  static std::vector<double> held(const RobotModel& m, std::span<const double> q, std::size_t tip,
                                  const Vec3& force, const Vec3& moment) {
    constexpr double h = 1e-3;
    std::vector<Pose> frames(m.joints.size());
    const auto pose = [&](std::span<const double> at) {
      robotics::forward_kinematics(m, at, frames);
      return robotics::tip_pose(m, tip, frames);
    };
    const Pose now = pose(q);
    std::vector<double> out(m.dof());
    for (std::size_t j = 0; j < m.dof(); ++j) {
      Vec3 rate{}, turn{};
      for (const auto& [step, weight] :
           {std::pair{-2.0, 1.0}, {-1.0, -8.0}, {1.0, 8.0}, {2.0, -1.0}}) {
        std::vector<double> moved(q.begin(), q.end()), by(m.dof());
        by[j] = step * h;
        robotics::move_configuration(m, by, moved);
        const Pose t = pose(moved);
        const Vec3 log = spatial::rotation_log(spatial::compose(t, spatial::inverse(now)).R);
        for (std::size_t k = 0; k < 3; ++k) {
          rate[k] += weight * t.p[k] / (12 * h);
          turn[k] += weight * log[k] / (12 * h);
        }
      }
      for (std::size_t k = 0; k < 3; ++k) out[j] -= force[k] * rate[k] + moment[k] * turn[k];
    }
    return out;
  }
};

// Torques of a recorded motion count the force that the run recorded, at the tip at which it acted,
// or the one that is given.
TEST_P(LoadsOnMechanisms, TorquesOfARecordedMotionCountTheForceAtEachTip) {
  const AnyId id = bench.load(std::string("robots/") + GetParam() + ".rbt");
  const auto snapshot = bench.document.now();
  const sim::Simulator simulator{bench.registry, bench.derived, *snapshot};
  const auto model =
      unwrap(bench.derived.robot_model(*snapshot, RobotId{id.number}, Vec3{0, 0, -9.81}, progress));
  ASSERT_TRUE(model);
  double greatest = 0;
  for (std::size_t tip = 0; tip < model->tips.size(); ++tip)
    for (const LoadAxes axes : {LoadAxes::world, LoadAxes::base, LoadAxes::tool}) {
      sim::ForwardRun r;
      r.record = RobotId{id.number};
      r.duration = 0.02, r.sample_time = 0.005;
      r.at_limit = sim::AtLimit::ignore;
      r.relative_tolerance = r.absolute_tolerance = 1e-8;
      r.load.tip = model->tips[tip].name;
      r.load.axes = axes;
      r.load.constant = {3, -2, 4, 0.1, 0.3, -0.2};
      r.load.expressions[0] = "100 N/s * time";
      const RecordingPtr moved = unwrap(sim::forward_dynamics(simulator, r, progress));
      ASSERT_TRUE(moved);
      const std::string where = std::string(GetParam()) + ", tip " + r.load.tip;
      const std::vector<std::string> torque{"torque"};
      const TipLoad none;
      const RecordingPtr with = unwrap(sim::with_quantities(simulator, *moved, torque, progress)),
                         without = unwrap(
                             sim::with_quantities(simulator, *moved, torque, progress, none)),
                         again = unwrap(
                             sim::with_quantities(simulator, *without, torque, progress, r.load));
      ASSERT_TRUE(with && without && again) << where;
      for (std::size_t i = 0; i < moved->rows(); ++i) {
        std::vector<double> q;
        for (std::size_t c = 1; c <= model->coordinate_count(); ++c)
          q.push_back(moved->find("q" + std::to_string(c))->values[i]);
        std::array<double, 6> w{};
        for (std::size_t k = 0; k < 6; ++k)
          w[k] = moved->find("wrench" + std::to_string(k + 1))->values[i];
        // The mounting is the world: what it sees, the base sees turned.
        const Vec3 force = spatial::rotate_back(model->base, Vec3{w[0], w[1], w[2]}),
                   moment = spatial::rotate_back(model->base, Vec3{w[3], w[4], w[5]});
        // In the axes it was given in it is what was given.
        std::vector<Pose> frames(model->joints.size());
        robotics::forward_kinematics(*model, q, frames);
        Vec3 seen{w[0], w[1], w[2]};
        if (axes == LoadAxes::tool)
          seen = spatial::rotate_back(robotics::tip_pose(*model, tip, frames), force);
        const Vec3 given{3 + 100 * moved->find("time")->values[i], -2, 4};
        for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(seen[k], given[k], 1e-9) << where;
        const auto want = held(*model, q, tip, force, moment);
        for (std::size_t j = 0; j < model->dof(); ++j) {
          const std::string n = std::to_string(j + 1);
          const double tolerance = 1e-7 * (1 + std::fabs(want[j]));
          for (const RecordingPtr& loaded : {with, again}) {
            EXPECT_NEAR(value_in_row(loaded, "tau_external" + n, i), want[j], tolerance) << where;
            EXPECT_NEAR(value_in_row(loaded, "tau" + n, i) - value_in_row(without, "tau" + n, i),
                        want[j], tolerance)
                << where << " joint " << n;
          }
          greatest = std::max(greatest, std::fabs(want[j]));
        }
      }
    }
  EXPECT_GT(greatest, 0.005) << GetParam();
}
INSTANTIATE_TEST_SUITE_P(Library, LoadsOnMechanisms,
                         ::testing::Values("twolink", "stanford", "irb140", "dual_arm", "gripper",
                                           "satellite_arm"));

// The motors' torques that moved it come out again: without the force they would be others.
TEST_F(TipLoads, TorquesOfAPushedMotionAreThoseThatMovedIt) {
  const RobotId rod = make(bench.document, "rod", TurningRod::record());
  const auto snapshot = bench.document.now();
  const sim::Simulator simulator{bench.registry, bench.derived, *snapshot};
  sim::ForwardRun r;
  r.record = rod;
  r.duration = 1;
  r.tau = {0.3};
  r.load.constant[1] = 0.8;
  r.load.axes = LoadAxes::tool;
  const RecordingPtr moved = unwrap(sim::forward_dynamics(simulator, r, progress));
  ASSERT_TRUE(moved);
  const std::vector<std::string> torque{"torque"};
  const RecordingPtr with = unwrap(sim::with_quantities(simulator, *moved, torque, progress));
  const RecordingPtr without =
      unwrap(sim::with_quantities(simulator, *moved, torque, progress, TipLoad{}));
  ASSERT_TRUE(with && without);
  for (std::size_t i = 0; i < moved->rows(); ++i) {
    EXPECT_NEAR(value_in_row(with, "tau1", i), 0.3, 1e-12);
    EXPECT_NEAR(value_in_row(with, "tau_external1", i), -0.8 * 0.4, 1e-12);
    EXPECT_NEAR(value_in_row(without, "tau1", i), 0.3 + 0.8 * 0.4, 1e-12);
    EXPECT_EQ(value_in_row(without, "wrench2", i), 0);
  }
  // Over the path of the recording itself: half of a r t^2.
  TipLoad along;
  along.expressions[1] = "10 N/m * path";
  along.axes = LoadAxes::tool;
  const RecordingPtr path =
      unwrap(sim::with_quantities(simulator, *moved, torque, progress, along));
  ASSERT_TRUE(path);
  const double speed_up = (0.3 + 0.8 * 0.4) / (2 * 0.16);
  for (std::size_t i = 0; i < path->rows(); ++i) {
    const double t = value_in_row(path, "time", i);
    EXPECT_NEAR(value_in_row(path, "path", i), 0.4 * speed_up * t * t / 2, 1e-9);
    EXPECT_NEAR(value_in_row(path, "tau_external1", i), -0.4 * 10 * 0.4 * speed_up * t * t / 2,
                1e-8);
  }
  const std::vector<std::string> power{"power"};
  const auto none = sim::with_quantities(simulator, *moved, power, progress, along);
  ASSERT_FALSE(none.ok());
  EXPECT_NE(none.error().sentence().find("Request the quantity torque"), std::string::npos)
      << none.error().sentence();
  recording::Recording bad = *moved;
  for (recording::Column& c : bad.columns)
    if (c.name == "wrench3") c.values[4] = std::nan("");
  const auto hole = sim::with_quantities(simulator, bad, torque, progress);
  ASSERT_FALSE(hole.ok());
  EXPECT_NE(hole.error().sentence().find("\"wrench3\" has no number in row 5"), std::string::npos)
      << hole.error().sentence();
}

/// Mechanisms with closed loops that move under a force at their tip, without torques of motors.
class LoadsOnLoops : public ::testing::TestWithParam<const char*> {};

TEST_P(LoadsOnLoops, TorquesOfAPushedMotionAreThoseThatMovedIt) {
  Workbench bench;
  NoProgress progress;
  const AnyId id = bench.load(std::string("robots/") + GetParam() + ".rbt");
  const auto snapshot = bench.document.now();
  const sim::Simulator simulator{bench.registry, bench.derived, *snapshot};
  sim::ForwardRun r;
  r.record = RobotId{id.number};
  r.duration = 0.02, r.sample_time = 0.005;
  r.at_limit = sim::AtLimit::ignore;
  r.relative_tolerance = 1e-9, r.absolute_tolerance = 1e-11;
  r.load.constant = {3, 4, -5, 0, 0, 0};
  r.load.axes = LoadAxes::base;
  const RecordingPtr moved = unwrap(sim::forward_dynamics(simulator, r, progress));
  ASSERT_TRUE(moved);
  const std::vector<std::string> torque{"torque"};
  const RecordingPtr with = unwrap(sim::with_quantities(simulator, *moved, torque, progress));
  const RecordingPtr without =
      unwrap(sim::with_quantities(simulator, *moved, torque, progress, TipLoad{}));
  ASSERT_TRUE(with && without);
  double most = 0;
  for (std::size_t j = 1; moved->find("tau" + std::to_string(j)); ++j)
    for (std::size_t i = 1; i < moved->rows(); ++i) {
      EXPECT_NEAR(value_in_row(with, "tau" + std::to_string(j), i), 0, 1e-9) << "joint " << j;
      most = std::max(most, std::fabs(value_in_row(without, "tau" + std::to_string(j), i)));
    }
  EXPECT_GT(most, 0.1) << "what the motors would have to give for the same motion without it";
}
INSTANTIATE_TEST_SUITE_P(Library, LoadsOnLoops,
                         ::testing::Values("four_bar", "slider_crank", "five_bar", "delta",
                                           "stewart"));

// A force that was recorded at the second tip stays there, and where the columns do not tell the
// tip of several, it is asked for.
TEST_F(TipLoads, RecordedForcesStayAtTheirTip) {
  const AnyId id = bench.load("robots/dual_arm.rbt");
  const auto snapshot = bench.document.now();
  const sim::Simulator simulator{bench.registry, bench.derived, *snapshot};
  const auto model =
      unwrap(bench.derived.robot_model(*snapshot, RobotId{id.number}, Vec3{0, 0, -9.81}, progress));
  ASSERT_TRUE(model);
  ASSERT_GE(model->tips.size(), 2U);
  sim::ForwardRun r;
  r.record = RobotId{id.number};
  r.duration = 0.05, r.sample_time = 0.01;
  r.at_limit = sim::AtLimit::ignore;
  r.load.constant = {20, 5, -30, 0, 0, 0};
  r.load.tip = model->tips[1].name;
  const RecordingPtr first = unwrap(sim::forward_dynamics(simulator, r, progress));
  ASSERT_TRUE(first);
  r.load = {};
  r.load.recorded = first;
  const RecordingPtr second = unwrap(sim::forward_dynamics(simulator, r, progress));
  ASSERT_TRUE(second);
  for (std::size_t j = 1; j <= model->dof(); ++j) {
    const std::string n = "q" + std::to_string(j);
    EXPECT_NEAR(first->find(n)->values.back(), second->find(n)->values.back(), 1e-12) << n;
  }
  recording::Recording bare = *first;
  for (recording::Column& c : bare.columns) c.doc.clear();
  const std::vector<std::string> torque{"torque"};
  const auto unclear = sim::with_quantities(simulator, bare, torque, progress);
  ASSERT_FALSE(unclear.ok());
  EXPECT_NE(unclear.error().sentence().find("do not specify the tip"), std::string::npos)
      << unclear.error().sentence();
  TipLoad named;
  named.recorded = std::make_shared<const recording::Recording>(bare);
  named.tip = model->tips[1].name;
  const RecordingPtr told = unwrap(sim::with_quantities(simulator, bare, torque, progress, named)),
                     own = unwrap(sim::with_quantities(simulator, *first, torque, progress));
  ASSERT_TRUE(told && own);
  for (std::size_t j = 1; j <= model->dof(); ++j) {
    const std::string n = "tau" + std::to_string(j);
    EXPECT_NEAR(value_in_row(told, n, 3), value_in_row(own, n, 3), 1e-12) << n;
  }
}

}  // namespace
}  // namespace robomosp
