// SPDX-License-Identifier: Apache-2.0
// Tasks of several robots on one clock, against motions and places written down by hand.
#include <array>
#include <cmath>
#include <functional>

#include <gtest/gtest.h>

#include "recording/file.h"
#include "recording/recording.h"
#include "sim/recording_columns.h"
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

/// A place in the plane: x, y and the angle about z.
struct Planar {
  double x = 0, y = 0, angle = 0;
  [[nodiscard]] Planar operator*(const Planar& b) const {
    return {x + std::cos(angle) * b.x - std::sin(angle) * b.y,
            y + std::sin(angle) * b.x + std::cos(angle) * b.y, angle + b.angle};
  }
  [[nodiscard]] Planar inverse() const {
    return {-std::cos(angle) * x - std::sin(angle) * y, std::sin(angle) * x - std::cos(angle) * y,
            -angle};
  }
};
/// Tool of the two rods of 0.3 m and 0.2 m.
Planar tool_of(double q1, double q2) {
  return {0.3 * std::cos(q1) + 0.2 * std::cos(q1 + q2),
          0.3 * std::sin(q1) + 0.2 * std::sin(q1 + q2), q1 + q2};
}

/// A 4 x 4 matrix of the Denavit-Hartenberg convention, rows one after the other.
using Matrix = std::array<double, 16>;
Matrix product(const Matrix& a, const Matrix& b) {
  Matrix c{};
  for (std::size_t i = 0; i < 4; ++i)
    for (std::size_t j = 0; j < 4; ++j)
      for (std::size_t k = 0; k < 4; ++k) c[4 * i + j] += a[4 * i + k] * b[4 * k + j];
  return c;
}
/// ABB's tool0 of the IRB 140: the rows of its file, and z of the tool along y of the last.
Matrix irb140(const std::vector<double>& q) {
  const double h = M_PI / 2;
  const double rows[6][3] = {{0.07, -h, 0.352}, {0.36, 0, 0}, {0, h, 0},
                             {0, -h, 0.38},     {0, h, 0},    {0, h, 0.065}};
  Matrix t{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
  for (std::size_t i = 0; i < 6; ++i) {
    const auto& [a, alpha, d] = rows[i];
    const double c = std::cos(q[i]), s = std::sin(q[i]), ca = std::cos(alpha), sa = std::sin(alpha);
    t = product(t,
                {c, -s * ca, s * sa, a * c, s, c * ca, -c * sa, a * s, 0, sa, ca, d, 0, 0, 0, 1});
  }
  return product(t, {0, -1, 0, 0, 0, 0, 1, 0, -1, 0, 0, 0, 0, 0, 0, 1});
}

TaskStep step(StepKind kind) {
  TaskStep s;
  s.kind = kind;
  return s;
}
TaskStep joints(std::vector<double> q, double duration = 0, const std::string& robot = "") {
  TaskStep s = step(StepKind::move);
  s.joints = std::move(q), s.duration = duration, s.robot = robot;
  return s;
}
TaskStep target(const Vec3& position, const Vec3& angles) {
  TaskStep s = step(StepKind::move);
  s.target = model::Placement{position, angles};
  return s;
}
TaskStep straight(TaskStep s, double speed) {
  s.is_straight = true, s.tool_speed = speed;
  return s;
}
TaskStep pause(double time) {
  TaskStep s = step(StepKind::wait);
  s.duration = time;
  return s;
}
TaskStep until(const std::string& condition, double timeout = 0) {
  TaskStep s = step(StepKind::wait);
  s.expression = condition, s.timeout = timeout;
  return s;
}
TaskStep set(const std::string& signal, const std::string& value) {
  TaskStep s = step(StepKind::set);
  s.signal = signal, s.expression = value;
  return s;
}
TaskStep attach(const std::string& object, double reach = 0) {
  TaskStep s = step(StepKind::attach);
  s.object = object, s.reach = reach;
  return s;
}
TaskStep detach(const std::string& object) {
  TaskStep s = step(StepKind::detach);
  s.object = object;
  return s;
}
TaskStep say(const std::string& text, std::int32_t parent = -1) {
  TaskStep s = step(StepKind::message);
  s.text = text, s.parent = parent;
  return s;
}
TaskStep within(std::int32_t parent, TaskStep s) {
  s.parent = parent;
  return s;
}
TaskStep repeat(std::int64_t count, std::int32_t parent = -1) {
  TaskStep s = step(StepKind::repeat);
  s.count = count, s.parent = parent;
  return s;
}
TaskStep when(const std::string& condition, std::int32_t parent = -1) {
  TaskStep s = step(StepKind::when);
  s.expression = condition, s.parent = parent;
  return s;
}

class TaskRuns : public ::testing::Test {
 protected:
  Workbench bench;
  NoProgress progress;
  model::World world;
  RobotId rods;

  void SetUp() override {
    model::Robot r;
    for (const double a : {0.3, 0.2}) {
      model::Link l;
      l.name = a > 0.25 ? "turn" : "reach";
      l.row.a = a;
      l.parent = static_cast<std::int32_t>(r.links.size()) - 1;
      l.lower = -3, l.upper = 3;
      l.max_velocity = 2, l.max_acceleration = 8, l.max_jerk = 100;
      r.links.push_back(l);
    }
    rods = make(bench.document, "rods", r);
  }
  /// Two arms of two rods; the right one stands at (0.8, 0.1) and is turned by 90 degrees.
  void two_arms() {
    world.robots.push_back({"left", rods, {}, {0.1, 0.2}});
    world.robots.push_back({"right", rods, {{0.8, 0.1, 0}, {0, 0, M_PI / 2}}, {0, 0}});
  }
  void add_part(const Vec3& at, double angle = 0) {
    if (!box_) {
      model::Solid box;
      model::SolidNode n;
      n.name = "box";
      n.sizes = {0.05, 0.05, 0.05};
      box.nodes.push_back(n);
      box_ = make(bench.document, "box", box);
    }
    world.objects.push_back(
        {"part" + std::to_string(world.objects.size() + 1), AnyId(box_), {at, {0, 0, angle}}});
  }
  void add_signal(const std::string& name, const std::string& unit = "", double initial = 0) {
    model::Signal s;
    s.name = name, s.unit = unit, s.initial = initial;
    s.kind = unit.empty() ? model::SignalKind::digital : model::SignalKind::analogue;
    world.signals.push_back(s);
  }
  TaskId add_task(const std::string& name, const std::string& robot, std::vector<TaskStep> steps) {
    const TaskId id = make(bench.document, name, model::Task{"", std::move(steps)});
    if (robot != "-") world.tasks.push_back({name, id, robot});
    return id;
  }
  Result<RecordingPtr> run(double most_time = 100) {
    const WorldId id = make(bench.document, "cell" + std::to_string(++count_), world);
    const auto snapshot = bench.document.now();
    const sim::Simulator simulator{bench.registry, bench.derived, *snapshot};
    task::TaskRun wanted;
    wanted.world = id;
    wanted.most_time = most_time;
    return task::run(simulator, wanted, progress);
  }
  std::string fault() {
    const auto r = run();
    EXPECT_FALSE(r.ok());
    return r.ok() ? "" : r.error().sentence();
  }
  static const std::vector<double>& column(const RecordingPtr& r, const std::string& name) {
    static const std::vector<double> kNone;
    const recording::Column* c = r ? r->find(name) : nullptr;
    EXPECT_TRUE(c) << name;
    return c ? c->values : kNone;
  }
  static double end_of(const RecordingPtr& r) {
    return r ? column(r, "time").back() : std::numeric_limits<double>::quiet_NaN();
  }
  static Planar place(const RecordingPtr& r, const std::string& object, std::size_t i) {
    EXPECT_NEAR(column(r, object + ".qx")[i], 0, 1e-12);
    EXPECT_NEAR(column(r, object + ".qy")[i], 0, 1e-12);
    return {column(r, object + ".x")[i], column(r, object + ".y")[i],
            2 * std::atan2(column(r, object + ".qz")[i], column(r, object + ".qw")[i])};
  }
  static void expect_near(const Planar& a, const Planar& b, double t) {
    EXPECT_NEAR(a.x, b.x, 1e-9) << t;
    EXPECT_NEAR(a.y, b.y, 1e-9) << t;
    EXPECT_NEAR(std::remainder(a.angle - b.angle, 2 * M_PI), 0, 1e-9) << t;
  }
  SolidId box_;
  int count_ = 0;
};

TEST_F(TaskRuns, RobotsWaitForEachOtherOnOneClock) {
  two_arms();
  add_signal("go");
  add_task("first", "left", {pause(0.513), joints({1.1, -0.3}, 2), set("go", "1")});
  add_task("second", "right", {until("go == 1"), joints({-0.5, 1}, 1.2)});
  const RecordingPtr r = unwrap(run());
  ASSERT_TRUE(r);
  EXPECT_NEAR(end_of(r), 0.513 + 2 + 1.2, 1e-12);
  // Moves of a given duration go by x^3 (10 - 15 x + 6 x^2).
  const auto quintic = [](double from, double to, double x) {
    x = std::clamp(x, 0.0, 1.0);
    return from + (to - from) * x * x * x * (10 - 15 * x + 6 * x * x);
  };
  for (std::size_t i = 0; i < r->rows(); ++i) {
    const double t = column(r, "time")[i], x = (t - 0.513) / 2, y = (t - 2.513) / 1.2;
    EXPECT_NEAR(column(r, "left.q1")[i], quintic(0.1, 1.1, x), 1e-12) << t;
    EXPECT_NEAR(column(r, "left.q2")[i], quintic(0.2, -0.3, x), 1e-12) << t;
    EXPECT_NEAR(column(r, "right.q1")[i], quintic(0, -0.5, y), 1e-12) << t;
    EXPECT_NEAR(column(r, "right.q2")[i], quintic(0, 1, y), 1e-12) << t;
    const double rate = x > 0 && x < 1 ? 30 * x * x * (1 - x) * (1 - x) / 2 : 0;
    EXPECT_NEAR(column(r, "left.qd1")[i], rate, 1e-9) << t;
    const double acceleration = x > 0 && x < 1 ? 60 * x * (1 - x) * (1 - 2 * x) / 4 : 0;
    EXPECT_NEAR(column(r, "left.qdd1")[i], acceleration, 1e-9) << t;
    EXPECT_EQ(column(r, "signal.go")[i], t > 2.513 ? 1 : 0) << t;
  }
  EXPECT_EQ(r->find("left.q1")->lower, -3);
  EXPECT_EQ(r->find("left.qd1")->upper, 2);
}

TEST_F(TaskRuns, AMoveToWhereItIsTakesTheTimeAskedForOrNone) {
  two_arms();
  const Planar tool = tool_of(0.1, 0.2);
  TaskStep there = target({tool.x, tool.y, 0}, {0, 0, tool.angle});
  const TaskStep line = straight(there, 0.1);
  TaskStep slow = there;
  slow.duration = 0.25;
  add_task("stay", "left",
           {joints({0.1, 0.2}, 2), joints({0.1, 0.2}), there, line, slow, pause(0.5)});
  const RecordingPtr r = unwrap(run());
  ASSERT_TRUE(r);
  EXPECT_NEAR(end_of(r), 2 + 0.25 + 0.5, 1e-9);
  for (const double q : column(r, "left.q1")) EXPECT_NEAR(q, 0.1, 1e-6);
}

TEST_F(TaskRuns, MovesWithoutADurationUseTheLimitsAndKeepThem) {
  world.robots.push_back({"left", rods, {}, {0, 0}});
  TaskStep half = joints({2, -1});
  half.speed = 0.5;
  TaskStep trapezoid = joints({0, 0});
  trapezoid.profile = "trapezoidal";
  add_task("only", "left", {half, trapezoid});
  const RecordingPtr r = unwrap(run());
  double fastest = 0, fastest_back = 0;
  for (std::size_t i = 0; i < (r ? r->rows() : 0); ++i) {
    const double v = column(r, "left.qd1")[i];
    fastest = std::max(fastest, v);
    fastest_back = std::max(fastest_back, -v);
  }
  EXPECT_LE(fastest, 1 + 1e-9);
  EXPECT_GT(fastest, 0.99);
  // 2 rad at 2 rad/s and 8 rad/s^2: 0.25 s up, 0.25 s down, 0.75 s between.
  EXPECT_NEAR(fastest_back, 2, 1e-9);
  EXPECT_NEAR(end_of(r), 2 * 1.875 / 1 + 1.25, 1e-9);
}

// d/V + V/A + A/J of the joint with the most to go; the same from state to state.
TEST_F(TaskRuns, MovesKeepJerkLimitsWithTheProfilesThatHaveThem) {
  world.robots.push_back({"left", rods, {}, {0, 0}});
  TaskStep there = joints({2, -1}), back = joints({0, 0});
  there.profile = "s_curve", back.profile = "time_optimal";
  add_task("only", "left", {there, back});
  const RecordingPtr r = unwrap(run());
  EXPECT_NEAR(end_of(r), 2 * (2 / 2.0 + 2 / 8.0 + 8 / 100.0), 1e-9);
}

TEST_F(TaskRuns, HeldObjectsFollowTheToolAndNeverJump) {
  two_arms();
  add_part({0.45, 0.2, 0.07}, 0.4);
  add_signal("give");
  add_task("bring", "left",
           {pause(0.107), attach("part1", 0.2), joints({1, 0.7}, 1), set("give", "1"),
            joints({0.2, 0.4}, 1)});
  // The other one takes it over while it moves itself, and puts it down.
  add_task("take", "right",
           {joints({0.6, 0.4}, 0.9), until("give == 1"), attach("part1", 0.5), joints({-1, 1}, 1.7),
            detach("part1"), joints({0, 0}, 1.2)});
  const RecordingPtr r = unwrap(run());
  ASSERT_TRUE(r);
  const auto tool = [&](const std::string& robot, const Planar& base, double at) {
    const auto& time = column(r, "time");
    const auto i = static_cast<std::size_t>(std::lower_bound(time.begin(), time.end(), at - 1e-9) -
                                            time.begin());
    return base * tool_of(column(r, robot + ".q1")[i], column(r, robot + ".q2")[i]);
  };
  const Planar left{}, right{0.8, 0.1, M_PI / 2}, start{0.45, 0.2, 0.4};
  const Planar in_left = tool_of(0.1, 0.2).inverse() * start;
  const Planar given = tool_of(1, 0.7) * in_left;
  const Planar in_right = (right * tool_of(0.6, 0.4)).inverse() * given;
  const Planar down = right * tool_of(-1, 1) * in_right;
  for (std::size_t i = 0; i < r->rows(); ++i) {
    const double t = column(r, "time")[i];
    const Planar is = place(r, "part1", i);
    EXPECT_NEAR(column(r, "part1.z")[i], 0.07, 1e-12);
    if (t < 0.107) expect_near(is, start, t);
    else if (t < 1.107) expect_near(is, tool("left", left, t) * in_left, t);
    else if (t < 2.807) expect_near(is, tool("right", right, t) * in_right, t);
    else expect_near(is, down, t);
  }
  EXPECT_NEAR(end_of(r), 4.007, 1e-12);
  ASSERT_EQ(r->notes.size(), 3U);
  EXPECT_EQ(r->notes[0], "t = 0.107 s: left takes part1");
  EXPECT_EQ(r->notes[2], "t = 2.807 s: part1 is released");
}

TEST_F(TaskRuns, ObjectsMayBeHeldFromTheStartAndByAnyLink) {
  two_arms();
  add_part({});
  world.attachments.push_back({"part1", "right", "turn", {{0.1, 0.05, 0}, {}}});
  add_task("swing", "right", {joints({1, -1}, 1)});
  const RecordingPtr r = unwrap(run());
  for (std::size_t i = 0; i < (r ? r->rows() : 0); ++i) {
    const double q = column(r, "right.q1")[i];
    const Planar elbow{0.3 * std::cos(q), 0.3 * std::sin(q), q};
    expect_near(place(r, "part1", i), Planar{0.8, 0.1, M_PI / 2} * elbow * Planar{0.1, 0.05, 0},
                column(r, "time")[i]);
  }
}

TEST_F(TaskRuns, BlocksAndCallsAreCarriedOutInOrder) {
  two_arms();
  add_signal("n", "kg", 0);  // any unit: it counts
  const TaskId inner = add_task("inner", "-", {say("in"), joints({0.5, 0}, 0.75)});
  TaskStep call = step(StepKind::call);
  call.task = inner;
  const std::vector<TaskStep> steps{repeat(3),
                                    within(0, set("n", "n + 1 kg")),
                                    when("n >= 2 kg", 0),
                                    say("many", 2),
                                    repeat(2, 2),
                                    say("twice", 4),
                                    within(0, step(StepKind::otherwise)),
                                    say("few", 6),
                                    repeat(0),
                                    say("never", 8),
                                    when("n < 0 kg"),
                                    say("never", 10),
                                    call,
                                    say("end")};
  add_task("outer", "left", steps);
  const RecordingPtr r = unwrap(run());
  ASSERT_TRUE(r);
  std::vector<std::string> said;
  for (const std::string& note : r->notes) said.push_back(note.substr(note.find(": ") + 2));
  EXPECT_EQ(said, (std::vector<std::string>{"few", "many", "twice", "twice", "many", "twice",
                                            "twice", "in", "end"}));
  EXPECT_NEAR(end_of(r), 0.75, 1e-12);
  EXPECT_NEAR(column(r, "left.q1").back(), 0.5, 1e-12);  // the caller's robot
  EXPECT_EQ(column(r, "signal.n").front(), 3);
}

TEST_F(TaskRuns, ConditionsOverTimeAndPlacesTurnTrueWhenTheyDo) {
  struct Case {
    const char* condition;
    double at;
  };
  // q1 goes from 0 to 1 in 2 s and stands for 0.5 rad in the middle; `go` is set at 2.5 s.
  for (const Case& c : {Case{"time >= 2 s", 2},
                        {"time > 1.2345 s", 1.2345},
                        {"go == 1 and time >= 2.51 s", 2.51},
                        {"go == 1 or time >= 31/30 * 1 s", 31.0 / 30},
                        {"go == 1 and time >= 1 s", 2.5},
                        {"left.q1 >= 0.5 rad", 1},
                        {"left.q1 > 30 deg and left.qd1 < 0.5 rad/s", -1},
                        {"left.y >= 0.5 m * sin(0.5 rad)", 1},
                        {"part1.y >= 0.4 m * sin(0.5 rad)", 1},
                        {"time >= 77.125 s", 77.125}}) {
    SCOPED_TRACE(c.condition);
    world = {};
    world.robots.push_back({"left", rods, {}, {0, 0}});
    world.robots.push_back({"right", rods, {}, {0, 0}});
    add_part({0.4, 0, 0});
    add_signal("go");
    const std::string n = std::to_string(++count_);
    add_task("move" + n, "left",
             {attach("part1", 0.5), joints({1, 0}, 2), pause(0.5), set("go", "1")});
    add_task("wait" + n, "right", {until(c.condition), say("now")});
    const RecordingPtr r = unwrap(run());
    ASSERT_TRUE(r);
    ASSERT_EQ(r->notes.size(), 2U);
    double at = c.at;
    if (at < 0) {  // the rate 30 x^2 (1 - x)^2 / 2 falls to 0.5 rad/s; by Newton's method
      double x = 0.75;
      for (int i = 0; i < 50; ++i)
        x -= (15 * x * x * (1 - x) * (1 - x) - 0.5) / (30 * x * (1 - x) * (1 - 2 * x));
      at = 2 * x;
    }
    const std::string note = r->notes[1];
    const double told = std::stod(note.substr(4));
    EXPECT_NEAR(told, at, 1e-5 * at) << note;  // notes are rounded
    const auto& times = column(r, "time");
    EXPECT_NEAR(times.back(), std::max(at, 2.5), at < 2.5 || at == 2.51 ? 1e-12 : 0);
  }
}

TEST_F(TaskRuns, TheInstantOfAConditionIsExact) {
  world.robots.push_back({"left", rods, {}, {0, 0}});
  world.robots.push_back({"right", rods, {}, {0, 0}});
  add_task("move", "left", {pause(0.0123), joints({1, 0}, 2)});
  add_task("wait", "right", {until("left.q1 >= 0.5 rad"), joints({1, 0}, 1.5)});
  EXPECT_NEAR(end_of(unwrap(run())), 0.0123 + 1 + 1.5, 1e-8);  // cubics between rows
  world.tasks[1].task =
      make(bench.document, "late", model::Task{"", {until("time >= 0.77777 s", 1), pause(2)}});
  EXPECT_DOUBLE_EQ(end_of(unwrap(run())), 0.77777 + 2);
}

TEST_F(TaskRuns, WaitsThatNothingEndsAreTold) {
  two_arms();
  add_signal("go");
  add_signal("stop");
  add_task("a", "left", {pause(0.25), until("go == 1")});
  add_task("b", "right", {say("here"), repeat(2), within(1, until("stop == 1"))});
  const std::string both = fault();
  EXPECT_NE(both.find("task \"a\", step 2 (wait) waits for \"go == 1\""), std::string::npos)
      << both;
  EXPECT_NE(both.find("task \"b\", step 3 (wait) waits for \"stop == 1\""), std::string::npos);
  EXPECT_NE(both.find("can never come true after t = 0.25 s"), std::string::npos) << both;
  world.tasks.pop_back();
  for (const char* never : {"time < 0 s", "left.q1 > 1 rad and time > 1 s"}) {
    const TaskId id =
        make(bench.document, never[0] == 't' ? "t" : "q", model::Task{"", {until(never)}});
    world.tasks[0] = {"c", id, "left"};
    const std::string timed = fault();
    EXPECT_NE(timed.find("task \"c\", step 1 (wait) waits for"), std::string::npos) << timed;
    EXPECT_NE(timed.find("does not come true within 100 s"), std::string::npos) << timed;
  }
}

TEST_F(TaskRuns, TimeoutsAreTold) {
  two_arms();
  add_signal("go");
  add_task("set", "left", {pause(0.9), set("go", "1")});
  add_task("patient", "right", {until("go == 1", 0.95), pause(0.1)});
  EXPECT_NEAR(end_of(unwrap(run())), 1, 1e-12);
  add_task("hasty", "right", {pause(0.2), until("go == 1", 0.5)});
  const std::string told = fault();
  EXPECT_NE(told.find("task \"hasty\", step 2 (wait)"), std::string::npos) << told;
  EXPECT_NE(told.find("\"go == 1\" did not come true within 0.5 s"), std::string::npos) << told;
}

TEST_F(TaskRuns, AnalogueSignalsHaveUnits) {
  two_arms();
  add_signal("p", "Pa", 1e5);
  add_signal("go");
  add_task("pump", "left", {pause(0.1), set("p", "2.5 bar"), pause(0.1), set("p", "p / 2")});
  add_task("watch", "right", {until("p > 2 bar"), say("high"), until("p <= 1.25 bar"), say("low")});
  const RecordingPtr r = unwrap(run());
  ASSERT_TRUE(r);
  EXPECT_EQ(r->find("signal.p")->unit, "Pa");
  EXPECT_EQ(column(r, "signal.p").front(), 1e5);
  EXPECT_EQ(column(r, "signal.p")[7], 2.5e5);
  EXPECT_EQ(column(r, "signal.p").back(), 1.25e5);
  EXPECT_EQ(r->notes, (std::vector<std::string>{"t = 0.1 s: high", "t = 0.2 s: low"}));
  const auto told = [&](const std::string& name, const TaskStep& s) {
    world.tasks = {{name, make(bench.document, name, model::Task{"", {s}}), "left"}};
    return fault();
  };
  EXPECT_NE(told("unit", set("p", "3 kg")).find("task \"unit\", step 1 (set)"), std::string::npos);
  EXPECT_NE(told("two", set("go", "2")).find("the digital signal \"go\" cannot be 2"),
            std::string::npos);
  EXPECT_NE(told("plain", until("p > 2")).find("Give the number a unit"), std::string::npos);
  EXPECT_NE(told("near", until("gp == 1")).find("no signal \"gp\""), std::string::npos);
}

TEST_F(TaskRuns, WhatTasksCannotDoIsToldWithTaskAndStep) {
  two_arms();
  add_part({0.4, 0, 0});
  add_task("a", "left", {joints({1, 1}, 2)});
  add_task("b", "right", {pause(0.5), joints({1, 1}, 0, "left")});
  std::string told = fault();
  EXPECT_NE(told.find("task \"b\", step 2 (move)"), std::string::npos) << told;
  EXPECT_NE(told.find("robot \"left\" is still moved by another task at t = 0.5 s"),
            std::string::npos)
      << told;
  const auto alone = [&](const std::string& name, std::vector<TaskStep> steps,
                         const std::string& robot = "left") {
    world.tasks = {{name, make(bench.document, name, model::Task{"", std::move(steps)}), robot}};
    return fault();
  };
  told = alone("far", {say("go"), target({0.9, 0, 0}, {})});
  EXPECT_NE(told.find("task \"far\", step 2 (move)"), std::string::npos) << told;
  EXPECT_NE(told.find("cannot be reached"), std::string::npos) << told;
  told = alone("limit", {joints({3.5, 0})});
  EXPECT_NE(told.find("task \"limit\", step 1 (move)"), std::string::npos) << told;
  told = alone("nobody", {joints({1, 0})}, "");
  EXPECT_NE(told.find("names a robot"), std::string::npos) << told;
  told = alone("loose", {detach("part1")});
  EXPECT_NE(told.find("nothing holds object \"part1\""), std::string::npos) << told;
  TaskStep with = target({0.3, 0.3, 0}, {});
  with.link = "part1";
  told = alone("empty", {with});
  EXPECT_NE(told.find("robot \"left\" does not hold object \"part1\""), std::string::npos) << told;
  told = alone("endless", {repeat(1'000'000), within(0, say("x"))});
  EXPECT_NE(told.find("is repeated endlessly without waiting at t = 0 s"), std::string::npos)
      << told;
  told = alone("long", {pause(101)});
  EXPECT_NE(told.find("longer than 100 s"), std::string::npos) << told;
}

TEST_F(TaskRuns, EqualWorldsGiveEqualRecordings) {
  two_arms();
  add_part({0.45, 0.2, 0});
  add_signal("go");
  add_task("a", "left", {attach("part1", 0.5), joints({1, 0.7}), set("go", "1"), detach("part1")});
  add_task("b", "right", {until("go == 1 and left.q1 > 0.9 rad"), joints({0.3, 0.7})});
  const RecordingPtr first = unwrap(run()), second = unwrap(run());
  ASSERT_TRUE(first && second);
  NoProgress silent;
  EXPECT_EQ(unwrap(recording::to_csv(*first, silent)), unwrap(recording::to_csv(*second, silent)));
  EXPECT_EQ(first->notes, second->notes);
}

TEST_F(TaskRuns, QuantitiesOfOneOfSeveralRobotsAreThoseOfItsMotion) {
  model::Robot pendulum;
  model::Link l;
  l.name = "rod";
  l.row.a = 0.5;
  l.max_velocity = 3, l.max_acceleration = 10, l.max_jerk = 100;
  l.given = MassProperties{2, {-0.2, 0, 0}, {0.01, 0.03, 0.03, 0, 0, 0}};
  pendulum.links.push_back(l);
  const RobotId id = make(bench.document, "pendulum", pendulum);
  two_arms();
  // It swings in the x-z plane of the world.
  world.robots.push_back({"bell", id, {{0.2, 0, 1}, {M_PI / 2, 0, 0}}, {-1}});
  add_task("ring", "bell", {joints({0.5}, 2)});
  add_task("other", "left", {joints({1, 1}, 1.5)});
  const RecordingPtr r = unwrap(run());
  ASSERT_TRUE(r);
  const auto snapshot = bench.document.now();
  const sim::Simulator simulator{bench.registry, bench.derived, *snapshot};
  const std::vector<std::string> wanted{"torque", "power", "pose", "limits"};
  const RecordingPtr more =
      unwrap(sim::with_quantities_of(simulator, *r, "bell", wanted, progress));
  ASSERT_TRUE(more);
  for (std::size_t i = 0; i < more->rows(); ++i) {
    const double q = column(r, "bell.q1")[i], qdd = column(r, "bell.qdd1")[i];
    const double tau = (0.03 + 2 * 0.3 * 0.3) * qdd + 2 * 9.81 * 0.3 * std::cos(q);
    EXPECT_NEAR(column(more, "bell.tau1")[i], tau, 1e-9);
    EXPECT_NEAR(column(more, "bell.total_power")[i], tau * column(r, "bell.qd1")[i], 1e-9);
    EXPECT_NEAR(column(more, "bell.x")[i], 0.2 + 0.5 * std::cos(q), 1e-12);
    EXPECT_NEAR(column(more, "bell.z")[i], 1 + 0.5 * std::sin(q), 1e-12);
    EXPECT_NEAR(column(more, "bell.used_qd1")[i], std::fabs(column(r, "bell.qd1")[i]) / 3, 1e-12);
  }
  EXPECT_EQ(more->find("left.tau1"), nullptr);
  const auto none = sim::with_quantities_of(simulator, *r, "nobody", wanted, progress);
  ASSERT_FALSE(none.ok());
  EXPECT_NE(none.error().sentence().find("no joints of a robot \"nobody\""), std::string::npos);
}

class ToolMoves : public TaskRuns {
 protected:
  void SetUp() override {
    TaskRuns::SetUp();
    world.robots.push_back({"arm", RobotId{bench.load("robots/irb140.rbt").number}, {}, {}});
  }
  static std::vector<double> row(const RecordingPtr& r, std::size_t i) {
    std::vector<double> q;
    for (int j = 1; j <= 6; ++j) q.push_back(column(r, "arm.q" + std::to_string(j))[i]);
    return q;
  }
};

TEST_F(ToolMoves, StraightMovesStayOnTheLineAndWithinTheLimits) {
  // Down-facing flange; the way begins between two rows of the recording.
  const Vec3 from{0.45, -0.2, 0.4}, to{0.5, 0.25, 0.3};
  add_task("line", "arm",
           {pause(0.0137), target(from, {M_PI, 0, 0}), straight(target(to, {M_PI, 0, 0}), 0.2)});
  const RecordingPtr r = unwrap(run());
  ASSERT_TRUE(r);
  const double length = std::sqrt(0.05 * 0.05 + 0.45 * 0.45 + 0.1 * 0.1);
  const double limits[] = {200, 200, 260, 360, 360, 450};
  std::size_t on_line = 0;
  double last = 0;
  for (std::size_t i = 0; i < r->rows(); ++i) {
    for (std::size_t j = 0; j < 6; ++j)
      EXPECT_LE(std::fabs(column(r, "arm.qd" + std::to_string(j + 1))[i]),
                limits[j] * M_PI / 180 * (1 + 1e-9));
    const Matrix t = irb140(row(r, i));
    const double p[] = {t[3] - from[0], t[7] - from[1], t[11] - from[2]};
    const double u[] = {0.05 / length, 0.45 / length, -0.1 / length};
    const double way = p[0] * u[0] + p[1] * u[1] + p[2] * u[2];
    // From the first row at the start of the line on.
    if (on_line == 0 && !(way > -1e-9 && std::hypot(p[0], p[1], p[2]) < 0.01)) continue;
    ++on_line;
    EXPECT_NEAR(std::hypot(p[0] - way * u[0], p[1] - way * u[1], p[2] - way * u[2]), 0, 1e-9) << i;
    EXPECT_GE(way, last - 1e-11);
    last = way;
    EXPECT_NEAR(t[0], 1, 1e-9);  // the tool keeps its orientation: rpy (180 deg, 0, 0)
    EXPECT_NEAR(t[5], -1, 1e-9);
    EXPECT_NEAR(t[10], -1, 1e-9);
  }
  EXPECT_GT(on_line, 50U);
  EXPECT_NEAR(last, length, 1e-9);
}

TEST_F(ToolMoves, AHeldObjectOrANamedToolGoesToTheTarget) {
  add_part({0.45, 0, 0.3});
  world.frames.push_back({"bench", {{0.1, 0.2, 0.05}, {0, 0, 0.3}}});
  TaskStep put = target({0.3, -0.1, 0.1}, {0, 0, 0.2});
  put.link = "part1", put.frame = "bench";
  TaskStep lower = straight(target({0.3, -0.1, 0.02}, {0, 0, 0.2}), 0.1);
  lower.link = "part1", lower.frame = "bench";
  add_task("put", "arm",
           {target({0.45, 0, 0.35}, {M_PI, 0, 0}), attach("part1"), put, lower, detach("part1")});
  const RecordingPtr r = unwrap(run());
  ASSERT_TRUE(r);
  const Planar at = Planar{0.1, 0.2, 0.3} * Planar{0.3, -0.1, 0.2};
  const std::size_t last = r->rows() - 1;
  EXPECT_NEAR(column(r, "part1.x")[last], at.x, 1e-9);
  EXPECT_NEAR(column(r, "part1.y")[last], at.y, 1e-9);
  EXPECT_NEAR(column(r, "part1.z")[last], 0.07, 1e-9);
  EXPECT_NEAR(2 * std::atan2(column(r, "part1.qz")[last], column(r, "part1.qw")[last]), 0.5, 1e-9);
  EXPECT_NEAR(std::hypot(column(r, "part1.qx")[last], column(r, "part1.qy")[last]), 0, 1e-9);
  // It keeps above its place while it is lowered: the object goes straight, not the flange alone.
  for (std::size_t i = last - 10; i < last; ++i) EXPECT_NEAR(column(r, "part1.x")[i], at.x, 1e-9);
}

TEST_F(ToolMoves, ATrajectoryElsewhereIsGoneToFirst) {
  model::Trajectory way;
  model::TrajectorySegment s;
  s.shape.name = "line";
  s.shape.params["speed"] = 0.2;
  s.law.name = "trapezoidal";
  s.points = {{{0.45, -0.2, 0.4}, {M_PI, 0, 0}}, {{0.45, 0.2, 0.4}, {M_PI, 0, 0}}};
  way.segments = {s};
  TaskStep follow = step(StepKind::move);
  follow.trajectory = make(bench.document, "way", way);
  follow.target = model::Placement{{0, 0, -0.1}, {}};
  add_task("follow", "arm", {pause(0.1), follow});
  const RecordingPtr r = unwrap(run());
  ASSERT_TRUE(r);
  for (std::size_t i = 1; i < r->rows(); ++i)
    for (int j = 1; j <= 6; ++j) {
      const auto& q = column(r, "arm.q" + std::to_string(j));
      EXPECT_LE(std::fabs(q[i] - q[i - 1]), 8 * 0.02);  // 450 deg/s at most
    }
  const Matrix end = irb140(row(r, r->rows() - 1));
  EXPECT_NEAR(end[3], 0.45, 1e-9);
  EXPECT_NEAR(end[7], 0.2, 1e-9);
  EXPECT_NEAR(end[11], 0.3, 1e-9);
}

class MechanismMoves : public TaskRuns {};

TEST_F(MechanismMoves, ClosedLoopsStayClosedWhileTheirMotorsMove) {
  world.robots.push_back({"bar", RobotId{bench.load("robots/four_bar.rbt").number}, {}, {}});
  add_part({0, 0, 0});
  world.attachments.push_back({"part1", "bar", "coupler_point", {}});
  TaskStep home = step(StepKind::move);
  home.pose = "home";
  add_task("crank", "bar", {pause(0.011), joints({3.5}, 6), home});
  const RecordingPtr r = unwrap(run());
  ASSERT_TRUE(r);
  double moved = 0;
  const auto& time = column(r, "time");
  for (std::size_t i = 0; i < r->rows(); ++i) {
    const double q1 = column(r, "bar.q1")[i], q2 = column(r, "bar.q2")[i],
                 q3 = column(r, "bar.q3")[i];
    EXPECT_NEAR(0.12 * std::cos(q1) + 0.36 * std::cos(q1 + q2), 0.42 + 0.28 * std::cos(q3), 1e-9);
    EXPECT_NEAR(0.12 * std::sin(q1) + 0.36 * std::sin(q1 + q2), 0.28 * std::sin(q3), 1e-9);
    moved = std::max(moved, q3 - 1.7);
    if (i > 2 && i + 3 < r->rows()) {
      const double rate =
          (column(r, "bar.q3")[i + 1] - column(r, "bar.q3")[i - 1]) / (time[i + 1] - time[i - 1]);
      EXPECT_NEAR(column(r, "bar.qd3")[i], rate, 0.02);
    }
  }
  EXPECT_GT(moved, 0.3);
  EXPECT_NEAR(column(r, "bar.q3").back(), 1.7181605870968062, 1e-6);
}

TEST_F(MechanismMoves, FollowersKeepTheirLimitsAndToolsOfMechanismsAreRefused) {
  world.robots.push_back({"hand", RobotId{bench.load("robots/gripper.rbt").number}, {}, {}});
  TaskStep shut = step(StepKind::move);
  shut.pose = "closed";
  add_task("grip", "hand", {shut});
  const RecordingPtr r = unwrap(run());
  ASSERT_TRUE(r);
  EXPECT_NEAR(column(r, "hand.q1").back(), 10 * M_PI / 180, 1e-12);
  const auto alone = [&](const std::string& name, const TaskStep& s) {
    world.tasks = {{name, make(bench.document, name, model::Task{"", {s}}), "hand"}};
    return fault();
  };
  EXPECT_NE(alone("reach", target({0, 0, 0.1}, {})).find("tasks cannot move its tool to a pose"),
            std::string::npos);
  const std::string wide = alone("wide", joints({0.3}));
  EXPECT_NE(wide.find("task \"wide\", step 1 (move)"), std::string::npos) << wide;
}

}  // namespace
}  // namespace robomosp
