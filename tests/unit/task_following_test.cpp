// SPDX-License-Identifier: Apache-2.0
// What tasks reach, and moves into frames that move: places by products of Denavit-Hartenberg
// matrices, belts by their joint's column.
#include <algorithm>
#include <array>
#include <cmath>

#include <gtest/gtest.h>

#include "recording/recording.h"
#include "sim/simulate.h"
#include "support/records.h"
#include "support/workbench.h"
#include "task/run.h"

namespace robomosp {
namespace {

using model::StepKind;
using model::TaskStep;
using recording::RecordingPtr;
using test::make;
using test::unwrap;
using test::Workbench;

using BeltMatrix = std::array<double, 16>;  ///< 4 x 4, row by row
BeltMatrix belt_product(const BeltMatrix& a, const BeltMatrix& b) {
  BeltMatrix c{};
  for (std::size_t i = 0; i < 4; ++i)
    for (std::size_t j = 0; j < 4; ++j)
      for (std::size_t k = 0; k < 4; ++k) c[4 * i + j] += a[4 * i + k] * b[4 * k + j];
  return c;
}
/// ABB's tool0 of the IRB 140: the rows of its file, and z of the tool along y of the last.
BeltMatrix belt_irb140(const std::vector<double>& q) {
  const double h = M_PI / 2;
  const double rows[6][3] = {{0.07, -h, 0.352}, {0.36, 0, 0}, {0, h, 0},
                             {0, -h, 0.38},     {0, h, 0},    {0, h, 0.065}};
  BeltMatrix t{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
  for (std::size_t i = 0; i < 6; ++i) {
    const auto& [a, alpha, d] = rows[i];
    const double c = std::cos(q[i]), s = std::sin(q[i]), ca = std::cos(alpha), sa = std::sin(alpha);
    t = belt_product(
        t, {c, -s * ca, s * sa, a * c, s, c * ca, -c * sa, a * s, 0, sa, ca, d, 0, 0, 0, 1});
  }
  return belt_product(t, {0, -1, 0, 0, 0, 0, 1, 0, -1, 0, 0, 0, 0, 0, 0, 1});
}

/// An arm, and a belt along y before it whose cloth holds a box of 50 mm.
class BeltMoves : public ::testing::Test {
 protected:
  Workbench bench;
  NoProgress progress;
  model::World world;
  /// Where the belt's joint is 0; the box stands on its origin.
  static constexpr Vec3 kBelt{0.55, -0.25, 0.2};

  static TaskStep step(StepKind kind) {
    TaskStep s;
    s.kind = kind;
    return s;
  }
  static TaskStep pause(double time) {
    TaskStep s = step(StepKind::wait);
    s.duration = time;
    return s;
  }
  static TaskStep until(const std::string& condition) {
    TaskStep s = step(StepKind::wait);
    s.expression = condition;
    return s;
  }
  static TaskStep target(const Vec3& position, const std::string& frame = "") {
    TaskStep s = step(StepKind::move);
    s.target = model::Placement{position, {M_PI, 0, 0}};
    s.frame = frame;
    return s;
  }
  static TaskStep straight(TaskStep s, double speed) {
    s.is_straight = true, s.tool_speed = speed;
    return s;
  }
  static TaskStep joints(std::vector<double> q, const std::string& profile = "") {
    TaskStep s = step(StepKind::move);
    s.joints = std::move(q), s.profile = profile;
    return s;
  }
  static TaskStep attach(const std::string& object, double reach = 0) {
    TaskStep s = step(StepKind::attach);
    s.object = object, s.reach = reach;
    return s;
  }
  static TaskStep detach(const std::string& object) {
    TaskStep s = step(StepKind::detach);
    s.object = object;
    return s;
  }

  void SetUp() override {
    world.robots.push_back({"arm",
                            RobotId{bench.load("robots/irb140.rbt").number},
                            {},
                            {0, -M_PI / 2, M_PI, 0, M_PI / 2, 0}});
    model::Robot belt;
    model::Link cloth;
    cloth.name = "cloth";
    cloth.joint = model::JointKind::prismatic;
    cloth.origin = model::Placement{};
    cloth.axis = {0, 1, 0};
    cloth.lower = 0, cloth.upper = 1;
    cloth.max_velocity = 0.1, cloth.max_acceleration = 2, cloth.max_jerk = 100;
    belt.links.push_back(cloth);
    world.robots.push_back({"belt", make(bench.document, "belt", belt), {kBelt, {}}, {0}});
    model::Solid box;
    model::SolidNode n;
    n.name = "box";
    n.sizes = {0.05, 0.05, 0.05};
    box.nodes.push_back(n);
    world.objects.push_back({"part", AnyId(make(bench.document, "box", box)), {kBelt, {}}});
    world.attachments.push_back({"part", "belt", "cloth", {}});
  }
  void add_task(const std::string& name, const std::string& robot, std::vector<TaskStep> steps) {
    world.tasks.push_back(
        {name, make(bench.document, name, model::Task{"", std::move(steps)}), robot});
  }
  Result<RecordingPtr> run(double sample_time = 0.02) {
    const WorldId id = make(bench.document, "cell" + std::to_string(++count_), world);
    const auto snapshot = bench.document.now();
    const sim::Simulator simulator{bench.registry, bench.derived, *snapshot};
    task::TaskRun wanted;
    wanted.world = id;
    wanted.sample_time = sample_time;
    return task::run(simulator, wanted, progress);
  }
  static double at(const RecordingPtr& r, const std::string& name, std::size_t i) {
    const recording::Column* c = r->find(name);
    EXPECT_TRUE(c) << name;
    return c ? c->values[i] : 0;
  }
  static BeltMatrix tool(const RecordingPtr& r, std::size_t i) {
    std::vector<double> q;
    for (int j = 1; j <= 6; ++j) q.push_back(at(r, "arm.q" + std::to_string(j), i));
    return belt_irb140(q);
  }
  /// The time of the first note with these words [s].
  static double time_of(const RecordingPtr& r, const std::string& words) {
    for (const std::string& n : r->notes)
      if (n.find(words) != std::string::npos) return std::stod(n.substr(4));
    ADD_FAILURE() << "no note " << words;
    return -1;
  }
  static bool has_note(const RecordingPtr& r, const std::string& words) {
    return std::any_of(r->notes.begin(), r->notes.end(),
                       [&](const std::string& n) { return n.find(words) != std::string::npos; });
  }
  /// The joints' rates are those of their values and do not jump, and their limits hold.
  static void expect_smooth(const RecordingPtr& r) {
    const double limits[] = {200, 200, 260, 360, 360, 450};
    for (std::size_t i = 1; i < r->rows(); ++i) {
      const double h = at(r, "time", i) - at(r, "time", i - 1);
      if (!(h > 1e-3)) continue;
      for (int j = 1; j <= 6; ++j) {
        const std::string q = "arm.q" + std::to_string(j), qd = "arm.qd" + std::to_string(j);
        const double mean = (at(r, qd, i) + at(r, qd, i - 1)) / 2;
        EXPECT_NEAR((at(r, q, i) - at(r, q, i - 1)) / h, mean, 0.02)
            << at(r, "time", i) << " " << q;
        EXPECT_LT(std::fabs(at(r, qd, i)), limits[j - 1] * M_PI / 180 * (1 + 1e-6));
        EXPECT_LT(std::fabs(at(r, qd, i) - at(r, qd, i - 1)), 0.32)
            << at(r, "time", i) << " " << qd;
      }
    }
  }
  /// From `from` to `to` [s] the tool is `up` above the part as the belt's joint has it.
  static void expect_with_belt(const RecordingPtr& r, double from, double to, double up) {
    std::size_t rows = 0;
    for (std::size_t i = 0; i < r->rows(); ++i) {
      const double t = at(r, "time", i);
      if (t < from - 1e-9 || t > to + 1e-9) continue;
      ++rows;
      const BeltMatrix m = tool(r, i);
      EXPECT_NEAR(m[3], kBelt[0], 1e-6) << t;
      EXPECT_NEAR(m[7], kBelt[1] + at(r, "belt.q1", i), 1e-6) << t;
      EXPECT_NEAR(m[11], kBelt[2] + up, 1e-6) << t;
      EXPECT_NEAR(m[10], -1, 1e-9) << t;
    }
    EXPECT_GT(rows, 5U);
  }
  int count_ = 0;
};

TEST_F(BeltMoves, StraightMovesMeetAPartOnABeltThatAnotherTaskDrivesAndLiftIt) {
  add_task("feed", "belt", {joints({0.6}, "trapezoidal")});
  add_task(
      "pick", "arm",
      {target({0.45, -0.1, 0.4}), until("belt.q1 >= 0.12 m"),
       straight(target({0, 0, 0.10}, "part"), 0.4), straight(target({0, 0, 0.05}, "part"), 0.1),
       pause(0.2), attach("part"), pause(0.3), straight(target({0, 0, 0.15}, "part"), 0.2),
       straight(target({0.4, 0.1, 0.5}), 0.25), pause(0.2)});
  const RecordingPtr r = unwrap(run(0.01));
  ASSERT_TRUE(r);
  const double taken = time_of(r, "arm takes part");
  EXPECT_TRUE(has_note(r, "arm follows \"part\""));
  EXPECT_FALSE(has_note(r, "exceeds"));
  expect_with_belt(r, taken - 0.2, taken + 0.3, 0.05);
  // The part goes with the belt up to the grip, and with the tool from there on.
  for (std::size_t i = 0; i < r->rows(); ++i) {
    const BeltMatrix m = tool(r, i);
    if (at(r, "time", i) < taken) {
      EXPECT_NEAR(at(r, "part.y", i), kBelt[1] + at(r, "belt.q1", i), 1e-9);
    } else {
      EXPECT_NEAR(at(r, "part.x", i), m[3], 1e-6) << at(r, "time", i);
      EXPECT_NEAR(at(r, "part.y", i), m[7], 1e-6);
      EXPECT_NEAR(at(r, "part.z", i), m[11] - 0.05, 1e-6);
    }
  }
  expect_smooth(r);
  const BeltMatrix end = tool(r, r->rows() - 1);
  EXPECT_NEAR(end[3], 0.4, 1e-9);
  EXPECT_NEAR(end[7], 0.1, 1e-9);
  EXPECT_NEAR(end[11], 0.5, 1e-9);
}

// The belt begins while the arm is on its way, and stops and begins again while it waits above.
TEST_F(BeltMoves, AMoveLearnsOfABeltThatBeginsWhileItGoesOn) {
  for (const bool is_straight : {false, true}) {
    world.tasks.clear();
    const std::string n = is_straight ? "s" : "j";
    add_task("feed" + n, "belt",
             {pause(2.0), joints({0.2}), pause(0.113), joints({0.35}), pause(0.3)});
    TaskStep there = target({0, 0, 0.08}, "part");
    there.duration = 1.9;
    if (is_straight) there.is_straight = true;
    add_task("pick" + n, "arm",
             {target({0.45, -0.2, 0.4}), until("time >= 1.9 s"), there, pause(4.0),
              target({0.4, 0.1, 0.5})});
    const RecordingPtr r = unwrap(run(0.01));
    ASSERT_TRUE(r);
    EXPECT_NEAR(time_of(r, "arm follows"), 2.0, 1e-9);
    expect_with_belt(r, 3.81, 7.79, 0.08);
    expect_smooth(r);
    const BeltMatrix end = tool(r, r->rows() - 1);
    EXPECT_NEAR(end[7], 0.1, 1e-9);
    EXPECT_NEAR(end[11], 0.5, 1e-9);
  }
}

// Joint moves take as long as their limits need; joint values end the following.
TEST_F(BeltMoves, JointMovesMeetAndLeaveABeltWithinTheirLimits) {
  add_task("feed", "belt", {joints({0.55})});
  add_task("pick", "arm",
           {target({0.45, -0.1, 0.4}), until("belt.q1 >= 0.1 m"), target({0, 0, 0.05}, "part"),
            attach("part"), joints({0.2, 0.1 - M_PI / 2, 0.1 + M_PI, 0, 0.5, 0})});
  const RecordingPtr r = unwrap(run(0.01));
  ASSERT_TRUE(r);
  const double taken = time_of(r, "arm takes part");
  for (std::size_t i = 0; i < r->rows(); ++i) {
    if (std::fabs(at(r, "time", i) - taken) > 0.00501) continue;
    EXPECT_NEAR(tool(r, i)[7], kBelt[1] + at(r, "belt.q1", i), 2e-4);
  }
  expect_smooth(r);
  EXPECT_NEAR(at(r, "arm.q1", r->rows() - 1), 0.2, 1e-12);
  EXPECT_NEAR(at(r, "arm.qd1", r->rows() - 1), 0, 1e-12);
}

TEST_F(BeltMoves, TrajectoriesLieOnWhatTheBeltCarries) {
  model::Trajectory way;
  model::TrajectorySegment s;
  s.shape.name = "line";
  s.shape.params["speed"] = 0.05;
  s.law.name = "trapezoidal";
  s.points = {{{-0.02, 0, 0.05}, {M_PI, 0, 0}}, {{0.02, 0, 0.05}, {M_PI, 0, 0}}};
  way.segments = {s};
  TaskStep seal = step(StepKind::move);
  seal.trajectory = make(bench.document, "seal", way);
  seal.frame = "part";
  add_task("feed", "belt", {joints({0.45})});
  add_task("pick", "arm", {target({0.45, -0.1, 0.4}), until("belt.q1 >= 0.1 m"), seal, pause(0.1)});
  const RecordingPtr r = unwrap(run(0.01));
  ASSERT_TRUE(r);
  EXPECT_FALSE(has_note(r, "stops following")) << r->notes.back();
  // In the part's frame the tool keeps to the line, from -20 to 20 mm.
  double least = 1, most = -1;
  for (std::size_t i = 0; i < r->rows(); ++i) {
    const BeltMatrix m = tool(r, i);
    if (std::fabs(m[11] - kBelt[2] - 0.05) > 1e-6) continue;
    EXPECT_NEAR(m[7], kBelt[1] + at(r, "belt.q1", i), 1e-6);
    least = std::min(least, m[3] - kBelt[0]);
    most = std::max(most, m[3] - kBelt[0]);
  }
  EXPECT_NEAR(least, -0.02, 1e-3);
  EXPECT_NEAR(most, 0.02, 1e-6);
  expect_smooth(r);
}

TEST_F(BeltMoves, AFrameThatIsFasterOrOutOfReachIsTold) {
  // At half the belt's speed the tool would meet the part only where it is out of reach.
  add_task("feed", "belt", {joints({1.0}, "trapezoidal")});
  add_task("pick", "arm",
           {target({0.45, -0.2, 0.4}), until("belt.q1 >= 0.3 m"),
            straight(target({0, 0, 0.05}, "part"), 0.05)});
  const auto slow = run();
  ASSERT_FALSE(slow.ok());
  EXPECT_NE(slow.error().sentence().find("cannot meet \"part\" on belt at t = "), std::string::npos)
      << slow.error().sentence();
  EXPECT_NE(slow.error().sentence().find("task \"pick\", step 3 (move)"), std::string::npos);
  world.tasks.clear();
  // It stays with the part until that is out of reach.
  add_task("feed2", "belt", {joints({1.0}, "trapezoidal")});
  add_task("pick2", "arm",
           {target({0.45, -0.2, 0.4}), until("belt.q1 >= 0.1 m"),
            straight(target({0, 0, 0.05}, "part"), 0.4), pause(9)});
  const RecordingPtr r = unwrap(run());
  ASSERT_TRUE(r);
  EXPECT_TRUE(has_note(r, "arm stops following \"part\"") || at(r, "belt.q1", r->rows() - 1) < 1);
}

// The distance is that of the object's box from the frame of a link without bodies.
// From here the arm lies over its back, and where the part goes the waist's range ends: the solver
// goes on with the waist turned by half a turn.
TEST_F(BeltMoves, AConfigurationThatEndsIsAnErrorWithItsTimeAndNoJump) {
  world.robots[0].q = {1.1, -1.5, 0.9, -0.5, -1.3, -1.6};
  add_task("feed", "belt", {joints({0.9})});
  add_task("pick", "arm",
           {until("belt.q1 >= 0.05 m"), target({0, 0, 0.15}, "part"), pause(2),
            straight(target({0, 0, 0.10}, "part"), 0.3), pause(3)});
  const auto r = run(0.01);
  ASSERT_FALSE(r.ok());
  const std::string told = r.error().sentence();
  EXPECT_NE(told.find("cannot follow \"part\" on belt at t = 6.3"), std::string::npos) << told;
  EXPECT_NE(told.find("joint \"waist\" would jump by 3.14 rad into another configuration"),
            std::string::npos)
      << told;
}

TEST_F(BeltMoves, WhatIsOutOfReachStaysAndTheNoteTellsHowFarItIs) {
  world.attachments.clear();
  world.objects[0].placement.position = {kBelt[0], 1.0, 0.5};  // y from 0.975, z from 0.5 on
  add_task("pick", "belt", {attach("part"), joints({0.1}), detach("part")});
  const RecordingPtr r = unwrap(run());
  ASSERT_TRUE(r);
  EXPECT_FALSE(has_note(r, "takes part"));
  // hypot(0.975 + 0.25, 0.3) = 1.26120 m
  EXPECT_TRUE(has_note(r,
                       "t = 0 s: belt does not take part: part is 1.261 m away from the link of "
                       "belt, which reaches 5 mm"))
      << r->notes[0];
  EXPECT_TRUE(has_note(r, "part is not released: it was out of reach"));
  EXPECT_EQ(r->find("part.x"), nullptr);
  for (const double reach : {1.2611, 1.2613}) {
    world.tasks.clear();
    add_task("reach" + std::to_string(reach), "belt", {attach("part", reach)});
    EXPECT_EQ(has_note(unwrap(run()), "belt takes part"), reach > 1.2612);
  }
}

// A belt takes what lies anywhere on its cloth; the distance is that of the bodies.
TEST_F(BeltMoves, ALinkTakesWhatLiesOnItsBodies) {
  world.attachments.clear();
  world.objects[0].placement.position = {kBelt[0], 0.1, kBelt[2]};
  model::Solid cloth;
  model::SolidNode n;
  n.name = "sheet";
  n.sizes = {0.2, 0.8, 0.01};
  cloth.nodes.push_back(n);
  const SolidId sheet = make(bench.document, "sheet", cloth);
  model::Robot belt = *bench.document.now()->get(world.robots[1].robot);
  belt.links[0].parts.push_back({AnyId(sheet), {{0, 0.2, -0.01}, {}}});
  world.robots[1].robot = make(bench.document, "belt2", belt);
  add_task("feed", "belt", {attach("part"), joints({0.2})});
  const RecordingPtr r = unwrap(run());
  ASSERT_TRUE(r);
  ASSERT_TRUE(has_note(r, "belt takes part"));
  EXPECT_NEAR(at(r, "part.y", r->rows() - 1), 0.3, 1e-12);
  // 30 mm above the cloth it is out of reach.
  world.tasks.clear();
  world.objects[0].placement.position[2] += 0.03;
  add_task("feed2", "belt", {attach("part")});
  EXPECT_TRUE(has_note(unwrap(run()), "part is 30 mm away from the link of belt"));
}

}  // namespace
}  // namespace robomosp
