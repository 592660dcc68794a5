// SPDX-License-Identifier: Apache-2.0
// Joint trajectories: both files say the same, times rise, the tip follows lines and circles; what
// comes between motions stands in a sequence, in order.
#include <nlohmann/json.hpp>

#include "joint_trajectory.h"
#include "posts_support.h"

namespace robomosp::posts_test {
namespace {

const post::JointTrajectory kJointTrajectory;
struct Point {
  Numbers q;
  double t;
};
std::vector<Point> read_points(const Posted& p, const std::string& name = "prog") {
  const auto all = nlohmann::json::parse(p.files.at(name + ".json"));
  EXPECT_EQ(all["joint_names"].size(), 6U);
  std::vector<Point> out;
  for (const auto& x : all["points"]) {
    out.push_back(
        {x["positions"].get<Numbers>(), x["time_from_start"]["sec"].get<double>() +
                                            1e-9 * x["time_from_start"]["nanosec"].get<double>()});
    EXPECT_LT(x["time_from_start"]["nanosec"].get<double>(), 1e9);
  }
  // YAML line by line: numbers of a point are those of JSON.
  std::size_t i = 0;
  for (const std::string& l : lines_of(p.files.at(name + ".yaml"))) {
    if (!l.starts_with("  - {positions: [")) continue;
    const Numbers n = numbers_in(l);
    EXPECT_EQ(Numbers(n.begin(), n.begin() + 6), out.at(i).q) << l;
    EXPECT_NEAR(n[6] + 1e-9 * n[7], out.at(i).t, 1e-9);
    ++i;
  }
  EXPECT_EQ(i, out.size());
  return out;
}
/// Steps of a sequence; those of YAML are the same texts.
nlohmann::json steps_of(const Posted& p) {
  const auto all = nlohmann::json::parse(p.files.at("prog_sequence.json"));
  EXPECT_EQ(all["sequence"], 1);
  std::size_t i = 0;
  for (const std::string& l : lines_of(p.files.at("prog_sequence.yaml"))) {
    if (!l.starts_with("  - ")) continue;
    EXPECT_EQ(nlohmann::json::parse(l.substr(4)), all["steps"].at(i)) << l;
    ++i;
  }
  EXPECT_EQ(i, all["steps"].size());
  return all["steps"];
}
How robot() {
  How how;
  how.robot = true;
  how.form = kPostFlat;
  return how;
}

TEST(JointTrajectoryPost, TimesRiseAndTheTipFollowsItsPath) {
  const Posted p = posted(kJointTrajectory, R"(PROGRAM prog;
VAR ORIENTATION: d := ORIZYX(0.0, 30.0, 0.0);
BEGIN
  MOVE PTP POSE(POSITION(10.0, 0.0, 0.0), d);
  MOVE LIN POSE(POSITION(110.0, 0.0, 0.0), d) SPEED := 50.0;
  WAIT 0.5 SEC;
  MOVE CIRCLE POSE(POSITION(160.0, 50.0, 0.0), d), POSE(POSITION(110.0, 100.0, 0.0), d) SPEED := 10.0;
  MOVE LIN POSE(POSITION(110.0, 100.0, 0.0), d);
  MOVE LIN POSE(POSITION(110.0, 100.0, 50.0), d) TIME := 4.0;
ENDPROGRAM;
)",
                          robot());
  ASSERT_EQ(p.errors, 0) << p.faults;
  const auto points = read_points(p);
  for (std::size_t i = 1; i < points.size(); ++i) EXPECT_GT(points[i].t, points[i - 1].t) << i;
  // 3 s to the start, 100 mm at 50 mm/s, a wait, half a circle of 50 mm at 10 mm/s, the
  // millisecond of a motion to where it is, 4 s.
  EXPECT_NEAR(points.back().t, 3 + 2 + 0.5 + 50 * 3.141592653589793 / 10 + 0.001 + 4, 1e-6);
  int on_line = 0, on_circle = 0;
  for (const Point& x : points) {
    const double px = x.q[0] * 1000, py = x.q[1] * 1000;
    if (x.t <= 5.5) {
      EXPECT_NEAR(py, 0, 0.01);
      ++on_line;
    } else if (px > 110.001) {
      EXPECT_NEAR(std::hypot(px - 110, py - 50), 50, 0.01);
      ++on_circle;
    }
    EXPECT_NEAR(x.q[4], 30 * kDeg, 1.7e-4);
  }
  EXPECT_EQ(on_line, 22);  // 20 pieces, the start, the wait
  EXPECT_EQ(on_circle, 31);
}
TEST(JointTrajectoryPost, MotionsOutputsAndWaitsComeBackInOrder) {
  for (const unsigned seed : {3U, 8U}) {
    const Straight s = straight(100, seed);
    const Posted p = posted(kJointTrajectory, s.irl, robot());
    ASSERT_EQ(p.errors, 0) << p.faults;
    const auto steps = steps_of(p);
    // What a reader who knows the page only makes of it: places in turn, outputs, waits.
    std::size_t step = 0, at = 0, trajectories = 0, outputs = 0, waits = 0;
    std::vector<Point> points;
    double before = 0;
    const auto next = [&] {
      ASSERT_LT(step, steps.size());
      const auto& one = steps[step++];
      at = 0;
      points.clear();
      if (!one.contains("trajectory")) return;
      points = read_points(p, one["trajectory"].get<std::string>());
      ++trajectories;
      before = 0;
    };
    for (const Seen& want : s.seen) {
      if (want.what == "via") continue;
      if (want.what == "out") {
        EXPECT_EQ(at, points.size()) << "something is left of the stretch";
        next();
        EXPECT_EQ(steps[step - 1]["number"], want.number);
        EXPECT_EQ(steps[step - 1]["value"], want.value != 0);
        EXPECT_EQ(steps[step - 1]["set"], "grip");
        ++outputs;
        continue;
      }
      if (want.what == "wait") {
        ++waits;
        if (at < points.size()) {  // within a stretch the point again, later
          EXPECT_EQ(points[at].q, points[at - 1].q);
          EXPECT_NEAR(points[at].t - before, want.value, 1e-6);
          before = points[at++].t;
        } else {
          next();
          EXPECT_NEAR(steps[step - 1]["wait"].get<double>(), want.value, 1e-6);
        }
        continue;
      }
      if (at == points.size()) next();
      bool found = false;
      for (; at < points.size() && !found; ++at) {
        found = true;
        before = points[at].t;
        for (std::size_t k = 0; k < 3; ++k)
          found = found &&
                  std::fabs(want.joints.empty() ? points[at].q[k] * 1000 - want.mm[k]
                                                : points[at].q[k] / kDeg - want.joints[k]) < 0.01;
      }
      EXPECT_TRUE(found) << want.what;
    }
    EXPECT_EQ(step, steps.size());
    EXPECT_EQ(at, points.size());
    EXPECT_EQ(p.files.size(), 2 * trajectories + 2);
    EXPECT_GT(outputs, 5U);
    EXPECT_GT(waits, 5U);
  }
}
TEST(JointTrajectoryPost, EachStretchBeginsWhereTheOneBeforeEnded) {
  const Posted p = posted(kJointTrajectory, R"(PROGRAM prog;
SIGNAL OUTPUT BOOL: grip AT 2;
VAR ORIENTATION: d := ORIZYX(0.0, 30.0, 0.0);
BEGIN
  MOVE PTP POSE(POSITION(10.0, 0.0, 0.0), d);
  grip := TRUE;
  MOVE LIN POSE(POSITION(110.0, 0.0, 0.0), d) SPEED := 50.0;
  WAIT 0.5 SEC;
  grip := FALSE;
  WAIT 0.25 SEC;
  MOVE PTP POSE(POSITION(10.0, 0.0, 0.0), d) TIME := 1.5;
ENDPROGRAM;
)",
                          robot());
  ASSERT_EQ(p.errors, 0) << p.faults;
  EXPECT_EQ(steps_of(p), nlohmann::json::parse(R"([{"trajectory": "prog_1"},
    {"set": "grip", "number": 2, "value": true}, {"trajectory": "prog_2"},
    {"set": "grip", "number": 2, "value": false}, {"wait": 0.25}, {"trajectory": "prog_3"}])"));
  const auto line = read_points(p, "prog_2");
  ASSERT_EQ(line.size(), 21U);  // pieces of 5 mm, the wait
  EXPECT_NEAR(line[0].q[0], 0.015, 1e-6);
  EXPECT_NEAR(line[0].t, 0.1, 1e-9);
  EXPECT_NEAR(line[20].t, 2.5, 1e-9);
  const auto back = read_points(p, "prog_3");
  ASSERT_EQ(back.size(), 1U);
  EXPECT_NEAR(back[0].t, 1.5, 1e-9);
}
TEST(JointTrajectoryPost, ConditionsTextsAndPausesAreSteps) {
  How how = robot();
  const PostSignal signals[] = {
      {"n", "level", 9, "", false, {}}, {"b", "", 5, "", true, {}}, {"lamp", "", 7, "", true, {}}};
  how.profile.signals = signals;
  const Posted p = posted(kJointTrajectory, R"(PROGRAM prog;
SIGNAL INPUT BOOL: a AT 1; INPUT BOOL: b AT 2; INPUT INT: n AT 3, 4; INPUT REAL: x AT 8;
  OUTPUT BOOL: lamp AT 4; OUTPUT INT: k AT 10, 3; OUTPUT REAL: y AT 6;
BEGIN
  WAIT 0.5 SEC;
  lamp := TRUE; k := 5; y := 0.25;
  WAIT FOR a AND NOT b OR n + 1 >= 7 TIMEOUT 2.5;
  WAIT FOR x < 1.0E-7 EXOR a;
  WRITELN('to "go" \ on ', 3);
  WRITE('half');
  PAUSE 'look';
  HALT;
ENDPROGRAM;
)",
                          how);
  ASSERT_EQ(p.errors, 0) << p.faults;
  EXPECT_EQ(steps_of(p), nlohmann::json::parse(R"([{"wait": 0.5},
    {"set": "lamp", "number": 7, "value": false},
    {"set": "k", "number": 10, "width": 3, "value": 5}, {"set": "y", "number": 6, "value": 0.25},
    {"wait_for": ["or", ["and", ["input", "a", 1], ["not", ["not", ["input", "b", 5]]]],
                        [">=", ["+", ["input", "level", 9, 4], 1], 7]], "timeout": 2.5},
    {"wait_for": ["xor", ["<", ["input", "x", 8], 1.0e-7], ["input", "a", 1]]},
    {"text": "to \"go\" \\ on 3"}, {"text": "half", "ends_line": false}, {"pause": "look"},
    {"halt": true}])"));
  EXPECT_EQ(p.files.size(), 2U);
}
TEST(JointTrajectoryPost, WhatItHasNotIsAnError) {
  const Posted none = posted(kJointTrajectory, weld());
  EXPECT_TRUE(has_text(none.faults, "joint values are written, and no robot is named"));
  const Posted until = posted(kJointTrajectory,
                              "PROGRAM prog;\nSIGNAL INPUT BOOL: a AT 1;\nBEGIN\nMOVE LIN "
                              "POSE(POSITION(400.0, 0.0, 300.0), ORIZYX(0.0, 180.0, 0.0)) UNTIL "
                              "a;\nENDPROGRAM;\n",
                              robot());
  EXPECT_TRUE(has_text(until.faults,
                       "error 4: JointTrajectory has no motions that end on a condition (UNTIL)"))
      << until.faults;
}
TEST(JointTrajectoryPost, ThePageIsRight) {
  page_is_right(kJointTrajectory, "joint_trajectory.md", robot());
}
TEST(JointTrajectoryPost, EveryConstructIsTextOrAnErrorAtItsLine) {
  every_construct(kJointTrajectory, robot(), 10);
}
TEST(JointTrajectoryPost, WrongInputIsSaid) { wrong_input(kJointTrajectory, robot()); }

}  // namespace
}  // namespace robomosp::posts_test
