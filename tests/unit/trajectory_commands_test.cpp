// SPDX-License-Identifier: Apache-2.0
// Trajectories from the console: their segments one by one, with undo; recordings and pictures; and
// one sentence for what cannot be run.
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

#include <gtest/gtest.h>

#include "support/lua_program.h"

namespace robomosp::lua {
namespace {

namespace fs = std::filesystem;

class TrajectoryCommands : public test::LuaProgramTest {
 protected:
  void SetUp() override {
    LuaProgramTest::SetUp();
    run("t = trajectory.create{name = 'way', segments = {\n"
        "  {shape = 'line', points = {{0, 0, 0, 0, 0, 0}, {0.4, 0, 0, 0, 0, 0}}, speed = 0.1},\n"
        "  {shape = 'line', points = {{0.4, 0, 0, 0, 0, 0}, {0.4, 0.2, 0, 0, 0, 0}}, speed = "
        "0.1}}}");
  }
  /// The sentence for a change that must leave the document as it was.
  std::string refused(const std::string& code) {
    const std::string before = app().document.content_digest();
    auto r = state_->eval(code);
    EXPECT_FALSE(r.ok()) << code;
    EXPECT_EQ(app().document.content_digest(), before) << code;
    return r.ok() ? "" : r.error().sentence();
  }
};

TEST_F(TrajectoryCommands, ListTheirSegmentsWithTheTransitionsPutIn) {
  // The corner is cut 20 mm on either side (a tenth of the shorter line): 3.8 s, 0.4 s, 1.8 s.
  run("rows = t:segments() assert(#rows == 3)\n"
      "assert(rows[1].kind == 'segment' and rows[1].shape == 'line' and rows[1].start == 0)\n"
      "assert(math.abs(rows[1].duration - 3.8) < 1e-9 and math.abs(rows[1].length - 0.38) < 1e-9)\n"
      "assert(rows[2].kind == 'transition' and rows[2].number == 2 and not rows[2].shape)\n"
      "assert(math.abs(rows[2].start - 3.8) < 1e-9 and math.abs(rows[2].duration - 0.4) < 1e-9)\n"
      "assert(rows[3].number == 2 and math.abs(rows[3].start - 4.2) < 1e-9)\n"
      "assert(math.abs(rows[3].start + rows[3].duration - t:duration()) < 1e-12)");
  run("outer = trajectory.create{name = 'outer', segments = {{trajectory = t, position = {1, 0, "
      "0}}}}\n"
      "rows = outer:segments() assert(#rows == 3 and rows[1].trajectory == 'way')\n"
      "assert(rows[3].number == 1)");
}

TEST_F(TrajectoryCommands, ChangeSegmentsAndUndoThat) {
  const std::string before = app().document.content_digest();
  run("t:set_segment(1, {speed = '50 mm/s'}) s = t:describe().segments[1]\n"
      "assert(s.params.speed == 0.05 and #s.points == 2)\n"
      "assert(math.abs(t:segments()[1].duration - 7.6) < 1e-9)");
  // Another law drops what belonged to the old one, and keeps the speed, which it knows as well.
  run("t:set_segment(1, {law = 's_curve', jerk = 7}) s = t:describe().segments[1]\n"
      "assert(s.law.name == 's_curve' and s.params.jerk == 7 and s.params.speed == 0.05)\n"
      "t:set_segment(1, {law = 'cycloidal'}) s = t:describe().segments[1]\n"
      "assert(not s.params.jerk and s.params.speed == 0.05)");
  run("t:set_segment(1, {shape = 'bezier', duration = 2}) s = t:describe().segments[1]\n"
      "assert(s.shape == 'bezier' and not s.params.speed and s.law.name == 'cycloidal')\n"
      "assert(#s.points == 2)");
  run("t:insert_segment(3, {shape = 'line', points = {{0.4, 0.2, 0, 0, 0, 0}, {0, 0.2, 0, 0, 0, "
      "0}}})\n"
      "t:set_transition{index = 3, distance = '5 mm', speed = 0.2}\n"
      "t:move_segment(3, 1) s = t:describe().segments\n"
      "assert(#s == 3 and s[1].points[2].position[1] == 0 and s[1].transition.distance == 0.005)\n"
      "t:move_segment(1, 3) s = t:describe().segments\n"
      "assert(s[3].points[2].position[1] == 0 and s[1].shape == 'bezier')\n"
      "t:set_transition(2, 'none') assert(t:describe().segments[2].transition == 'none')");
  while (app().document.undo_labels().size() > 1) ASSERT_TRUE(app().document.undo().ok());
  EXPECT_EQ(app().document.content_digest(), before);
}

TEST_F(TrajectoryCommands, TurnsByALawOfItsOwn) {
  run("a = trajectory.create{name = 'apart', segments = {{shape = 'line', speed = 0.1, points = "
      "{{0, 0, 0, 0, 0, 0}, {0.3, 0, 0, 1.2, 0, 0}}, turning = 'cubic'}}}\n"
      "assert(a:segments()[1].turning == 'cubic')\n"
      // The turn by its own limits takes 3/2 1.2 / 0.5 = 3.6 s, more than the way's 3 s.
      "assert(math.abs(a:duration() - 3.6) < 1e-3)\n"
      "a:set_segment(1, {turning = {name = 'trapezoidal', angular_speed = '2 rad/s'}})\n"
      "s = a:describe().segments[1] assert(s.turning.params.angular_speed == 2)\n"
      "assert(math.abs(a:duration() - 3) < 1e-12)\n"
      "a:set_segment(1, {speed = 0.2}) "
      "assert(a:describe().segments[1].turning.params.angular_speed "
      "== 2)\n"
      "a:set_segment(1, s) assert(math.abs(a:duration() - 3) < 1e-12)\n"
      "a:set_segment(1, {turning = 'none'}) assert(not a:describe().segments[1].turning)");
}

TEST_F(TrajectoryCommands, GiveParametersInATableToItsProvider) {
  // Both the helix and the tangent have an axis.
  run("h = trajectory.create{name = 'screw', segments = {{shape = 'helix', axis = {0, 0, 1}, \n"
      "  points = {{0.1, 0, 0}}, centre = {0, 0, 0}, turns = 1, pitch = 0.05,\n"
      "  orientation = {name = 'tangent', axis = 'z'}, law = {name = 's_curve', jerk = 3}}}}\n"
      "s = h:describe().segments[1]\n"
      "assert(s.orientation.params.axis == 'z' and s.law.params.jerk == 3)\n"
      "assert(s.params.axis[3] == 1 and not s.params.jerk)\n"
      "h:set_segment(1, {orientation = {name = 'tangent', axis = 'x'}})\n"
      "s = h:describe().segments[1]\n"
      "assert(s.orientation.params.axis == 'x' and s.law.params.jerk == 3 and s.params.axis[3] == "
      "1)");
  EXPECT_EQ(refused("h:set_segment(1, {law = {name = 's_curve', jrk = 3}})"),
            "trajectory \"screw\", segment.law: \"s_curve\" has no parameter \"jrk\". Did you mean "
            "\"jerk\"?");
}

TEST_F(TrajectoryCommands, StoredOnesKeepWhatIsNotGiven) {
  run("outer = trajectory.create{name = 'outer', segments = {{trajectory = t, position = {1, 0, "
      "0}}}}\n"
      "outer:set_segment(1, {transition = 'none'})\n"
      "assert(outer:sample(0).position[1] == 1)\n"
      "outer:set_segment(1, {position = {2, 0, 0}})\n"
      "assert(outer:sample(0).position[1] == 2)\n"
      "assert(outer:describe().segments[1].transition == 'none')");
}

TEST_F(TrajectoryCommands, RecordSpeedAccelerationAndJerk) {
  // x = 0.4 (10 s^3 - 15 s^4 + 6 s^5) over 2 s: its jerk is 0.4 (60 - 360 s + 360 s^2) / 8.
  run("q = trajectory.create{name = 'quintic', segments = {{shape = 'line', law = 'quintic', \n"
      "  duration = 2, points = {{0, 0, 0, 0, 0, 0}, {0.4, 0, 0, 0, 0, 0}}}}}\n"
      "r = q:record{step = 0.1} v, j, x = r:values{'speed'}, r:values{'jerk'}, r:values{'x'}\n"
      "for i = 0, 20 do local s = i / 20\n"
      "  assert(math.abs(x[i+1] - 0.4*(10*s^3 - 15*s^4 + 6*s^5)) < 1e-12)\n"
      "  assert(math.abs(v[i+1] - 0.4*(30*s^2 - 60*s^3 + 30*s^4)/2) < 1e-12)\n"
      "  assert(math.abs(j[i+1] - math.abs(0.4*(60 - 360*s + 360*s^2)/8)) < 1e-3, i) end");
}

TEST_F(TrajectoryCommands, TheJerkHasNoDipsWhereItTurnsRound) {
  // In an s-curve that never reaches its acceleration the jerk goes from 4 to -4 and back; where
  // that is, between two samples or at one, is told by no sample.
  run(R"(
    c = trajectory.create{name = 'seven', segments = {{shape = 'line', law = 's_curve', jerk = 4,
      speed = 1, acceleration = 10, duration = 2,
      points = {{0, 0, 0, 0, 0, 0}, {0.4, 0, 0, 0, 0, 0}}}}}
    for _, step in ipairs{0.01, 0.0099, 0.0037} do
      local r, n = c:record{step = step}, 0
      local j, a = r:values{'jerk'}, r:values{'acceleration'}
      for i = 1, #j do
        if a[i] > 1e-6 then n = n + 1 assert(math.abs(j[i] - 4) < 1e-3, i .. ' ' .. j[i]) end
        assert(j[i] < 4 + 1e-3, j[i])
      end
      assert(n > 50)
    end
    -- The acceleration of a trapezoid jumps; beside the jump its jerk is 0.
    t2 = trajectory.create{name = 'three', segments = {{shape = 'line', law = 'trapezoidal',
      speed = 1, acceleration = 0.8, duration = 2,
      points = {{0, 0, 0, 0, 0, 0}, {0.4, 0, 0, 0, 0, 0}}}}}
    for _, step in ipairs{0.01, 0.0099, 0.0037} do
      for _, j in ipairs(t2:record{step = step}:values{'jerk'}) do assert(j < 1e-6, j) end
    end)");
}

TEST_F(TrajectoryCommands, DrawThemselvesOverTimeAndInSpace) {
  const fs::path folder = fs::path(testing::TempDir()) / "trajectory_pictures";
  fs::create_directories(folder);
  const auto drawn = [&](const std::string& arguments) {
    const std::string file = (folder / "way.svg").string();
    fs::remove(file);
    run("t:plot{file = '" + file + "', " + arguments + "}");
    std::ifstream in(file);
    std::ostringstream all;
    all << in.rdbuf();
    return all.str();
  };
  const std::string time = drawn("title = 'here & there'");
  for (const char* part : {"here &amp; there", ">jerk<", "speed [m/s]", "time [s]"})
    EXPECT_NE(time.find(part), std::string::npos) << part;
  EXPECT_EQ(drawn("columns = {'turning'}").find("jerk"), std::string::npos);
  const std::string path = drawn("kind = 'path'");
  for (const char* part : {"x [m]", "z [m]"}) EXPECT_NE(path.find(part), std::string::npos) << part;
  // A turn on the spot has no extent.
  run("s = trajectory.create{name = 'spot', segments = {{shape = 'line', points = {{0, 0, 0, 0, 0, "
      "0}, {0, 0, 0, 1, 0, 0}}}}} spot = s:plot{kind = 'path'} assert(not spot:find('nan'))");
  EXPECT_EQ(refused("t:plot{file = 'a.svg', columns = {'sped'}}").find("nan"), std::string::npos);
  fs::remove_all(folder);
}

TEST_F(TrajectoryCommands, CountThePointsOfALongWayWithoutMakingThem) {
  run("function way_to(x) return {{shape = 'line', points = {{0, 0, 0, 0, 0, 0}, {x, 0, 0, 0, 0, "
      "0}}}} end\n"
      "near = trajectory.create{name = 'near', segments = way_to(1), sample_time = 0.03}\n"
      "far = trajectory.create{name = 'far', segments = way_to(1e11)}");
  run("n = near:point_count() assert(n == math.floor(near:duration() / 0.03) + 2)\n"
      "assert(near:parameters().samples == n)\n"
      "assert(near:point(n - 1).time == near:duration())\n"
      "assert(math.abs(near:point(2).time - 0.06) < 1e-15)");
  EXPECT_NE(eval("near:point(n)").find("there is no point"), std::string::npos);
  run("n = far:point_count() assert(n > 1e12)\n"
      "assert(far:parameters().samples == n)\n"
      "assert(far:point(n - 1).time == far:duration())");
}

TEST_F(TrajectoryCommands, TellWhatCannotBeRunInOneSentence) {
  EXPECT_EQ(refused("t:set_segment(3, {speed = 1})"),
            "trajectory \"way\", index: there is no segment 3. Segments are numbered 1 to 2.");
  EXPECT_EQ(refused("t:move_segment(1, 5)"),
            "trajectory \"way\", to: there is no segment 5. Segments are numbered 1 to 2.");
  EXPECT_EQ(refused("t:set_transition(1, 'none')"),
            "trajectory \"way\", index: nothing comes before segment 1. A transition belongs to "
            "the following segment; give 2 or more.");
  EXPECT_EQ(refused("t:set_transition{index = 2, kind = 'none', speed = 1}"),
            "trajectory \"way\": no transition has a distance or a speed. Leave them out, or give "
            "kind = \"smooth\".");
  EXPECT_EQ(
      refused("t:set_segment(1, {shape = 'arc', points = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}}})"),
      "trajectory \"way\", segment 1: the three points lie on a straight line. Move one of "
      "them off the line, or use a line.");
  EXPECT_EQ(refused("t:set_segment(1, {law = 'trapezoidal', duration = 1})"),
            "trajectory \"way\", segment 1: a duration of 1 s is too short for the limits. The "
            "shortest is 4.1 s.");
  EXPECT_EQ(refused("t:set_segment(1, {law = 'trapezoidal', start_speed = 2})"),
            "trajectory \"way\", segment 1: the speed at an end is 2 m/s, above the maximum of 0.1 "
            "m/s. Lower it, or raise the speed.");
  EXPECT_EQ(
      refused("t:set_segment(1, {law = 'trapezoidal', speed = 9, start_speed = 8})"),
      "trajectory \"way\", segment 1: to change from 8 m/s to 0 m/s takes 32 m, but the path is "
      "0.4 m. Raise the acceleration (and jerk), or bring the speeds at the ends together.");
  EXPECT_EQ(refused("t:set_segment(1, {sped = 1})"),
            "trajectory \"way\", segment: \"line\" has no parameter \"sped\". Did you mean "
            "\"speed\"?");
  EXPECT_EQ(refused("t:set_segment(1, {shape = 'lien'})"),
            "trajectory \"way\", segment: \"lien\" is not a shape of segments. Did you mean "
            "\"line\"?");
}

}  // namespace
}  // namespace robomosp::lua
