// SPDX-License-Identifier: Apache-2.0
// Joint trajectories: both files say the same, times rise, the tip follows lines and circles.
#include <nlohmann/json.hpp>

#include "joint_trajectory.h"
#include "posts_support.h"

namespace robomosp::posts_test {
namespace {

const post::JointTrajectory kPost;
struct Point {
  Numbers q;
  double t;
};
std::vector<Point> read(const Posted& p) {
  const auto all = nlohmann::json::parse(p.files.at("prog.json"));
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
  for (const std::string& l : lines_of(p.files.at("prog.yaml"))) {
    if (!l.starts_with("  - {positions: [")) continue;
    const Numbers n = numbers_in(l);
    EXPECT_EQ(Numbers(n.begin(), n.begin() + 6), out.at(i).q) << l;
    EXPECT_NEAR(n[6] + 1e-9 * n[7], out.at(i).t, 1e-9);
    ++i;
  }
  EXPECT_EQ(i, out.size());
  return out;
}
How robot() {
  How how;
  how.robot = true;
  how.form = kPostFlat;
  return how;
}

TEST(JointTrajectoryPost, TimesRiseAndTheTipFollowsItsPath) {
  const Posted p = posted(kPost, R"(PROGRAM prog;
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
  const auto points = read(p);
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
TEST(JointTrajectoryPost, EndsOfMotionsAreTheTargets) {
  std::string irl = straight(100, 3).irl;
  for (std::size_t at; (at = irl.find("grip :=")) != std::string::npos;)
    irl.erase(at, irl.find('\n', at) - at);
  const Straight s = straight(100, 3);
  const Posted p = posted(kPost, irl, robot());
  ASSERT_EQ(p.errors, 0) << p.faults;
  const auto points = read(p);
  std::size_t at = 0;
  for (const Seen& want : s.seen) {
    if (want.what == "out" || want.what == "via" || want.what == "wait") continue;
    bool found = false;
    for (; at < points.size() && !found; ++at) {
      found = true;
      for (std::size_t k = 0; k < 3; ++k)
        found = found &&
                std::fabs(want.joints.empty() ? points[at].q[k] * 1000 - want.mm[k]
                                              : points[at].q[k] / kDeg - want.joints[k]) < 0.01;
    }
    EXPECT_TRUE(found) << want.what;
  }
}
TEST(JointTrajectoryPost, WhatItHasNotIsAnError) {
  const Posted none = posted(kPost, weld());
  EXPECT_TRUE(has_text(none.faults, "joints are written, and no robot is named"));
  const Posted out = posted(kPost, weld(), robot());
  EXPECT_TRUE(has_text(out.faults, "error 11: JointTrajectory has no outputs")) << out.faults;
}
TEST(JointTrajectoryPost, ThePageIsRight) { page_is_right(kPost, "joint_trajectory.md", robot()); }
TEST(JointTrajectoryPost, EveryConstructIsTextOrAnErrorAtItsLine) {
  every_construct(kPost, robot(), 10);
}
TEST(JointTrajectoryPost, WrongInputIsSaid) { wrong_input(kPost, robot()); }

}  // namespace
}  // namespace robomosp::posts_test
