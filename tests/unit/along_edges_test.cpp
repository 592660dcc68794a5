// SPDX-License-Identifier: Apache-2.0
// Edges of solids as curves, and trajectories along them.
#include <unistd.h>

#include <filesystem>
#include <string>

#include <gtest/gtest.h>

#include "support/lua_program.h"

namespace robomosp::lua {
namespace {

class AlongEdges : public test::LuaProgramTest {
 protected:
  void SetUp() override {
    LuaProgramTest::SetUp();
    run(R"(
      function near(a, b, e) assert(math.abs(a - b) <= (e or 1e-9), a .. " is not " .. b) end
      function dot(a, b) return a[1]*b[1] + a[2]*b[2] + a[3]*b[3] end
      plate = solid.create{name = "plate", root = {kind = "difference", children = {
        {kind = "box", name = "body", x = 0.2, y = 0.1, z = 0.01},
        {kind = "cylinder", name = "bore", radius = 0.02, height = 0.03, position = {0, 0, -0.01}}}}}
      -- A stadium: two half circles and two lines, as one outline.
      slot = solid.create{name = "slot", root = {kind = "union", children = {
        {kind = "box", x = 0.1, y = 0.06, z = 0.02},
        {kind = "cylinder", radius = 0.03, height = 0.02, position = {0.05, 0, 0}},
        {kind = "cylinder", radius = 0.03, height = 0.02, position = {-0.05, 0, 0}}}}})");
  }
  std::string refused(const std::string& code) {
    const std::string before = app().document.content_digest();
    auto r = state_->eval(code);
    EXPECT_FALSE(r.ok()) << code;
    EXPECT_EQ(app().document.content_digest(), before) << code;
    return r.ok() ? "" : r.error().sentence();
  }
};

TEST_F(AlongEdges, ASolidListsItsEdgesWithTheNormalsOfTheirFaces) {
  run(R"(
    all = plate:edges()
    lines, circles = plate:edges{kind = "line"}, plate:edges{kind = "circle"}
    assert(#all == 14 and #lines == 12 and #circles == 2 and #plate:edges{kind = "curve"} == 0)
    for i, e in ipairs(all) do
      assert(e.index == i)
      for at_end, at in ipairs{{e.start, e.start_tangent, e.start_normals},
                               {e.finish, e.finish_tangent, e.finish_normals}} do
        near(dot(at[2], at[2]), 1)
        for side = 1, 2 do
          local n = at[3][side]
          near(dot(n, n), 1) near(dot(n, at[2]), 0)
          -- Outward: a little back along the normal is in the plate.
          local p = {}
          local on = at_end == 1 and 1e-4 or -1e-4
          for k = 1, 3 do
            p[k] = at[1][k] - 1e-4 * (at[3][1][k] + at[3][2][k]) + on * at[2][k]
          end
          local r = math.sqrt(p[1]^2 + p[2]^2)
          assert(math.abs(p[1]) < 0.1 and math.abs(p[2]) < 0.05 and p[3] > 0 and p[3] < 0.01 and
                 r > 0.02)
        end
      end
    end
    for _, e in ipairs(lines) do
      local d = {}
      for k = 1, 3 do d[k] = e.finish[k] - e.start[k] end
      near(math.sqrt(dot(d, d)), e.length) near(dot(d, e.start_tangent), e.length)
    end
    for _, e in ipairs(circles) do
      near(e.radius, 0.02) near(e.angle, 2 * math.pi) near(e.length, 0.04 * math.pi)
      assert(e.is_closed and e.axis[3] == 1 and #e.points >= 13)
      near(e.start_tangent[2] * e.start[1] - e.start_tangent[1] * e.start[2], 0.02)
    end
    -- The nearest one, and the same numbers every time.
    e = plate:edges{near = {0.1, 0, 0.011}}[1]
    near(e.start[1], 0.1) near(e.finish[1], 0.1) near(e.start[3], 0.01)
    again = plate:edges()
    for i = 1, #all do for k = 1, 3 do assert(all[i].start[k] == again[i].start[k]) end end)");
}

TEST_F(AlongEdges, OtherCurvesComeWithPlacesOnBothFaces) {
  run(R"(
    tee = solid.create{name = "tee", root = {kind = "union", children = {
      {kind = "cylinder", radius = 0.05, height = 0.2},
      {kind = "cylinder", radius = 0.03, height = 0.1, position = {0, 0, 0.1}, rpy = {0, "90 deg", 0}}}}}
    curves = tee:edges{kind = "curve", chord = 1e-5}
    assert(#curves >= 1)
    for _, e in ipairs(curves) do
      assert(#e.points > 20)
      for i = 1, #e.points do
        local p = e.points[i]
        near(math.sqrt(p[1]^2 + p[2]^2), 0.05, 1e-7)
        near(math.sqrt(p[2]^2 + (p[3] - 0.1)^2), 0.03, 1e-7)
      end
    end
    -- A way along it stays on it: between its points, too.
    way = trajectory.along_edges{name = "saddle", solid = tee, edges = {curves[1].index},
      speed = 0.01, acceleration = 1, chord = 1e-5}
    for i = 0, 200 do
      local s = way:sample(way:duration() * i / 200)
      near(math.sqrt(s.position[1]^2 + s.position[2]^2), 0.05, 3e-5)
      near(math.sqrt(s.position[2]^2 + (s.position[3] - 0.1)^2), 0.03, 3e-5)
    end)");
}

TEST_F(AlongEdges, ARimIsRunAtOneSpeedWithTheToolBetweenTheFaces) {
  run(R"(
    rim = trajectory.along_edges{name = "rim", solid = slot, speed = 0.02, acceleration = 0.5,
      edges = {{0, 0.03, 0.02}, {0.08, 0, 0.02}, {0, -0.03, 0.02}, {-0.08, 0, 0.02}}}
    near(rim:length(), 0.2 + 0.06 * math.pi)
    T = rim:duration()
    -- One stretch of speed between two ramps.
    near(T, rim:length() / 0.02 + 0.02 / 0.5)
    for i = 0, 400 do
      local t = T * i / 400
      local s = rim:sample(t)
      local x, y = s.position[1], s.position[2]
      local ax = math.max(math.abs(x) - 0.05, 0)
      near(math.sqrt(ax^2 + y^2), 0.03) near(s.position[3], 0.02)
      local v = s.velocity
      if t > 0.05 and t < T - 0.05 then near(math.sqrt(dot(v, v)), 0.02) end
      -- x along the way; z into the part, alike from the top and from the side.
      local m = s.pose
      local side = {(x > 0 and ax or -ax) / 0.03, y / 0.03, 0}
      if i > 0 and i < 400 then near(dot(v, {m[1][1], m[2][1], m[3][1]}), math.sqrt(dot(v, v)), 1e-8) end
      near(m[3][3], -math.sqrt(0.5))
      near(dot({m[1][3], m[2][3], m[3][3]}, side), -math.sqrt(0.5))
    end
    -- The other way round.
    back = trajectory.along_edges{name = "back", solid = slot, speed = 0.02, reverse = true,
      edges = {{0, 0.03, 0.02}, {0.08, 0, 0.02}}}
    near(back:sample(back:duration()).position[1], -0.05) near(back:sample(0).position[2], -0.03))");
}

TEST_F(AlongEdges, AtACornerTheToolStopsAndTurns) {
  run(R"(
    seam = trajectory.along_edges{name = "seam", solid = plate, speed = 0.05, acceleration = 1,
      edges = {{0.1, 0, 0.01}, {0, 0.05, 0.01}}}
    rows = seam:segments()
    assert(#rows == 3)
    near(rows[1].length, 0.1) near(rows[2].length, 0) near(rows[3].length, 0.2)
    near(rows[1].duration, 0.1 / 0.05 + 0.05)
    local v = seam:sample(rows[2].start).velocity
    near(dot(v, v), 0)
    first, last = seam:sample(0), seam:sample(seam:duration())
    near(first.position[1], 0.1) near(first.position[2], -0.05)
    near(last.position[1], -0.1) near(last.position[2], 0.05))");
}

TEST_F(AlongEdges, LeadsTiltAndApproachAreWhatTheyAreCalled) {
  run(R"(
    local tilt, lead = 0.2, 0.3
    way = trajectory.along_edges{name = "way", solid = plate, edges = {{0, 0.05, 0.01}}, speed = 0.05,
      acceleration = 1, from = {0, 0, 1}, tilt = tilt, lead = lead, lead_in = 0.02, lead_out = 0.03,
      approach = 0.04, retract = 0.05, travel_speed = 0.2}
    near(way:length(), 0.2 + 0.02 + 0.03 + 0.04 + 0.05)
    local e = plate:edges{near = {0, 0.05, 0.01}}[1]
    local x, z = e.start_tangent, {0, 0, -1}
    local y = {z[2]*x[3]-z[3]*x[2], z[3]*x[1]-z[1]*x[3], z[1]*x[2]-z[2]*x[1]}
    -- Rx(tilt) Ry(lead): its z is (sin lead, -sin tilt cos lead, cos tilt cos lead).
    local into = {}
    for k = 1, 3 do
      into[k] = math.sin(lead) * x[k] - math.sin(tilt) * math.cos(lead) * y[k] +
                math.cos(tilt) * math.cos(lead) * z[k]
    end
    local first, last = way:sample(0), way:sample(way:duration())
    for k = 1, 3 do
      near(first.pose[k][3], into[k])
      near(first.position[k], e.start[k] - 0.02 * x[k] - 0.04 * into[k])
      near(last.position[k], e.finish[k] + 0.03 * x[k] - 0.05 * into[k])
    end
    rows = way:segments()
    near(rows[1].duration, 0.04 / 0.2 + 0.2, 1e-9))");
}

TEST_F(AlongEdges, AStandOffKeepsTheToolAwayFromTheEdge) {
  run(R"(
    -- Around the bore from above at 45 degrees: on a circle that is smaller and higher.
    off = 0.004
    local args = {solid = plate, edges = {{0.02, 0, 0.01}}, speed = 0.02, acceleration = 0.5,
      approach = 0.03, retract = 0.02}
    args.name = "at" at = trajectory.along_edges(args)
    args.name, args.stand_off = "away", "4 mm" away = trajectory.along_edges(args)
    local T = away:duration()
    for i = 20, 80 do
      local s = away:sample(T * i / 100)
      local z = {s.pose[1][3], s.pose[2][3], s.pose[3][3]}
      -- From there 4 mm ahead along the tool is the edge.
      local e = {}
      for k = 1, 3 do e[k] = s.position[k] + off * z[k] end
      near(math.sqrt(e[1]^2 + e[2]^2), 0.02, 1e-6) near(e[3], 0.01, 1e-6)
    end
    near(away:sample(T/2).position[3], 0.01 + off / math.sqrt(2), 1e-6)
    -- Corners, splines and stands that are turned, too.
    args = {name = "round", solid = plate, stand_off = off, speed = 0.02, acceleration = 0.5,
      edges = {{0.1, 0, 0.01}, {0, 0.05, 0.01}}, tilt = 0.2, lead = 0.1}
    local round = trajectory.along_edges(args)
    args.name, args.stand_off = "close", 0 local close = trajectory.along_edges(args)
    assert(round:length() > close:length() + 1e-3)
    local last, step = round:sample(0).position, round:duration() / 2000
    for i = 1, 2000 do  -- without a jump
      local p = round:sample(i * step).position
      assert(math.sqrt((p[1]-last[1])^2 + (p[2]-last[2])^2 + (p[3]-last[3])^2) < 0.021 * step)
      last = p
    end)");
  EXPECT_NE(refused("trajectory.along_edges{name = 'x', solid = plate, edges = {{0.02, 0, 0.01}}, "
                    "speed = 0.01, stand_off = -0.001}")
                .find("stand_off"),
            std::string::npos);
  EXPECT_NE(refused("trajectory.along_edges{name = 'x', solid = plate, edges = {{0.02, 0, 0.01}}, "
                    "speed = 0.01, from = {-1, 0, 0}}"),
            "");
}

TEST_F(AlongEdges, IsOneStepOfUndoAndCountsWithinTheSolidOfNow) {
  run(R"(
    w = world.create{name = "w"}
    way = trajectory.along_edges{name = "way", solid = plate, edges = {{0, 0.05, 0.01}}, speed = 0.05,
      follow = false}
    document.undo() assert(#trajectory.list() == 0) document.redo() assert(#trajectory.list() == 1)
    plate:set("body.x", 0.3)
    near(trajectory.get("way"):length(), 0.2)
    longer = trajectory.along_edges{name = "longer", solid = plate, edges = {{0, 0.05, 0.01}}, speed = 0.05}
    near(longer:length(), 0.3))");
}

/// A plate with bores whose sizes are parameters; the rim of the first bore and the front edge.
class FollowedEdges : public AlongEdges {
 protected:
  void SetUp() override {
    AlongEdges::SetUp();
    run(R"(
      part = solid.create{name = "part", parameters = {bore = "20 mm", width = "200 mm", high = "10 mm", at = "0 mm"},
        root = {kind = "difference", children = {
          {kind = "box", name = "body", x = "width", y = 0.1, z = "high"},
          {kind = "cylinder", name = "bore", radius = "bore", height = 1, position = {"at", 0, -0.5}}}}}
      rim = trajectory.along_edges{name = "rim", solid = part, edges = {{0.02, 0, 0.01}}, speed = 0.02,
        acceleration = 1, tilt = 0.1}
      front = trajectory.along_edges{name = "front", solid = part, edges = {{0, -0.05, 0.01}, {0.1, 0, 0.01}},
        speed = 0.05}
      function radius(way)
        local p = way:sample(way:duration() / 3).position
        return math.sqrt(p[1]^2 + p[2]^2), p[3]
      end)");
    before_ = warnings();
  }
  [[nodiscard]] std::size_t warnings() const {
    std::size_t n = 0;
    for (const auto& m : app().messages.recent(1000)) n += m.code == "edges_left" ? 1 : 0;
    return n - before_;
  }
  std::size_t before_ = 0;
};

TEST_F(FollowedEdges, SegmentsFollowAParameterWithinOneStepOfUndo) {
  run(R"(
    near(radius(rim), 0.02)
    near(front:length(), 0.3)
    part:set_parameter{name = "bore", value = "35 mm"}
    local r, z = radius(rim) near(r, 0.035) near(z, 0.01)
    near(rim:length(), 2 * math.pi * 0.035)
    near(front:length(), 0.3)
    part:set_parameter{name = "high", value = "60 mm"}
    r, z = radius(rim) near(r, 0.035) near(z, 0.06)
    near(front:sample(0).position[3], 0.06)
    part:set_parameter{name = "width", value = "300 mm"}
    near(front:length(), 0.4) near(rim:length(), 2 * math.pi * 0.035)
    part:set_parameter{name = "at", value = "50 mm"}
    local p = rim:sample(rim:duration() / 3).position
    near(math.sqrt((p[1] - 0.05)^2 + p[2]^2), 0.035)
    -- Each edit is one step, with what follows.
    for _ = 1, 4 do document.undo() end
    near(rim:length(), 2 * math.pi * 0.02) near(front:length(), 0.3) near(radius(rim), 0.02)
    document.redo() near(radius(rim), 0.035)
    document.undo() document.undo() assert(#trajectory.list() == 1))");
  EXPECT_EQ(warnings(), 0U);
}

TEST_F(FollowedEdges, TheSenseTheTiltAndTheOrderStay) {
  // The tool stays on its side of the rim, and runs the same way round, at every radius and height.
  run(R"(
    local function turn(way)
      local a, b = way:sample(way:duration() * 0.3), way:sample(way:duration() * 0.31)
      return a.position[1] * b.position[2] - a.position[2] * b.position[1] > 0
    end
    local sense, pose = turn(rim), rim:sample(rim:duration() / 2).pose
    for _, r in ipairs{0.049, 0.001, 0.03, 0.02} do
      part:set_parameter{name = "bore", value = r}
      part:set_parameter{name = "high", value = 2 * r}
      assert(turn(rim) == sense)
      local now = rim:sample(rim:duration() / 2).pose
      for i = 1, 3 do for k = 1, 3 do near(now[i][k], pose[i][k], 1e-6) end end
      near(front:sample(0).position[2], -0.05)
      near(front:sample(front:duration()).position[1], 0.1)
    end)");
  EXPECT_EQ(warnings(), 0U);
}

TEST_F(FollowedEdges, AnEdgeAmongAlikeOnesStaysTheSame) {
  // Concentric rims: the inner one grows beyond what the outer one was, and both follow.
  run(R"(
    local step = solid.create{name = "step", root = {kind = "difference", children = {
      {kind = "box", x = 0.4, y = 0.4, z = 0.02},
      {kind = "cylinder", name = "inner", radius = 0.05, height = 1, position = {0, 0, -0.5}},
      {kind = "difference", name = "groove", position = {0, 0, 0.015}, children = {
        {kind = "cylinder", name = "outside", radius = 0.12, height = 1},
        {kind = "cylinder", name = "inside", radius = 0.1, height = 3, position = {0, 0, -1}}}}}}}
    local ways = {}
    for i, r in ipairs{0.05, 0.1, 0.12} do
      ways[i] = trajectory.along_edges{name = "way" .. i, solid = step, edges = {{r, 0, 0.02}}, speed = 0.1}
    end
    step:set("outside.radius", 0.18) step:set("inside.radius", 0.13)
    for i, r in ipairs{0.05, 0.13, 0.18} do near(ways[i]:length(), 2 * math.pi * r) end
    step:set("inner.radius", 0.11)
    for i, r in ipairs{0.11, 0.13, 0.18} do near(ways[i]:length(), 2 * math.pi * r) end)");
  EXPECT_EQ(warnings(), 0U);
}

TEST_F(FollowedEdges, WhenAnEdgeIsGoneASentenceSaysSoAndUndoBringsItBack) {
  run("part:remove_node{node = 'bore'} near(rim:length(), 2 * math.pi * 0.02)");
  EXPECT_EQ(warnings(), 1U);
  std::string said;
  for (const auto& m : app().messages.recent(1000))
    if (m.code == "edges_left") said = m.text;
  EXPECT_NE(said.find("\"rim\" no longer follows solid \"part\""), std::string::npos) << said;
  EXPECT_NE(said.find("circle of radius 20 mm about (0, 0, 10) mm) is gone"), std::string::npos)
      << said;
  run("assert(record.describe(rim).along == nil and record.describe(front).along)\n"
      "part:set_parameter{name = 'width', value = 0.4} near(front:length(), 0.5)\n"
      "document.undo() document.undo()\n"
      "part:set_parameter{name = 'bore', value = 0.03} near(rim:length(), 2 * math.pi * 0.03)");
}

TEST_F(FollowedEdges, GroupsFollowAtTheirEnd) {
  run(R"(
    ioci.transaction(function()
      part:remove_node{node = "bore"}
      part:add_node{parent = part:tree().name, node = {kind = "cylinder", name = "bore", radius = 0.03, height = 1,
        position = {0, 0, -0.5}}}
      part:set_parameter{name = "width", value = 0.5}
    end)
    near(rim:length(), 2 * math.pi * 0.03) near(front:length(), 0.6)
    document.undo() near(rim:length(), 2 * math.pi * 0.02) near(front:length(), 0.3))");
  EXPECT_EQ(warnings(), 0U);
}

TEST_F(FollowedEdges, SegmentsThatAreEditedStayAsTheyAre) {
  run(R"(
    front:remove_segment{index = 1}
    part:set_parameter{name = "width", value = 0.4}
    assert(record.describe(front).along == nil)
    near(rim:length(), 2 * math.pi * 0.02))");
  EXPECT_EQ(warnings(), 1U);
  // Made again after an edit of the solid, in one group, it follows.
  run(R"(
    ioci.transaction(function()
      part:set_parameter{name = "width", value = 0.2}
      trajectory.along_edges{name = "front", replace = true, solid = part, speed = 0.05,
        edges = {{0, -0.05, 0.01}, {0.1, 0, 0.01}}}
    end)
    part:set_parameter{name = "width", value = 0.3}
    near(front:length(), 0.4))");
  EXPECT_EQ(warnings(), 1U);
}

TEST_F(FollowedEdges, ArgumentsAreFieldsThatTakeExpressions) {
  run(R"(
    record.set{id = rim, path = "along.stand_off", value = 0.005}
    -- Half way between the faces, turned by the tilt: 5 mm off at 45 degrees and 0.1 rad.
    local r, z = radius(rim)
    near(math.sqrt((r - 0.02)^2 + (z - 0.01)^2), 0.005)
    rim:set_parameter{name = "off", value = "2 mm"}
    record.set{id = rim, path = "along.stand_off", value = "2 * off"}
    r, z = radius(rim) near(math.sqrt((r - 0.02)^2 + (z - 0.01)^2), 0.004)
    rim:set_parameter{name = "off", value = "1 mm"}
    r, z = radius(rim) near(math.sqrt((r - 0.02)^2 + (z - 0.01)^2), 0.002)
    local a = record.describe(rim).along
    assert(a.solid == 'part' and a.speed == 0.02 and #a.edges == 1))");
  EXPECT_EQ(warnings(), 0U);
}

TEST_F(FollowedEdges, APathThatIsSetCountsWithinTheSolidOfNowOrIsRefused) {
  EXPECT_NE(refused("record.set(rim, 'along.edges', {99})").find("14 edges, and no edge 99"),
            std::string::npos);
  EXPECT_NE(refused("record.set(rim, 'along.edges', {})").find("no edge"), std::string::npos);
  EXPECT_NE(refused("record.set(rim, 'along.speed', 0)").find("speed"), std::string::npos);
  EXPECT_NE(refused("record.set(front, 'along.from', {0, 1, 0})").find("along"), std::string::npos);
  EXPECT_NE(refused("record.create{kind = 'trajectory', name = 'x', fields = {along = {solid = "
                    "'part', edges = {15}, speed = 0.1}}}")
                .find("no edge 15"),
            std::string::npos);
  EXPECT_EQ(warnings(), 0U);
  run(R"(
    local e = part:edges{near = {0, 0.05, 0.01}}[1].index
    record.set(rim, "along.edges", {e}) near(rim:length(), 0.2)
    local made = record.create{kind = "trajectory", name = "made", fields = {along = {solid = "part",
      edges = {e}, speed = 0.1}}}
    near(made:length(), 0.2)
    part:set_parameter{name = "width", value = 0.3} near(rim:length(), 0.3) near(made:length(), 0.3)
    record.set(rim, "along", nil)
    part:set_parameter{name = "width", value = 0.4} near(rim:length(), 0.3) near(made:length(), 0.4))");
  EXPECT_EQ(warnings(), 0U);
}

TEST_F(FollowedEdges, ParametersOfAWorldAndGesturesAreFollowed) {
  run(R"(
    cell = world.create{name = "cell", parameters = {wide = "0.3 m", speed = "0.1 m/s"}}
    part:set("body.x", "cell.wide") near(front:length(), 0.4)
    cell:set_parameter{name = "wide", value = 0.5} near(front:length(), 0.6)
    record.set(front, "along.speed", "cell.speed")
    local slow = front:duration()
    cell:set_parameter{name = "speed", value = 0.2} assert(front:duration() < 0.8 * slow)
    document.undo() near(front:duration(), slow)
    local g = gesture.begin{label = "wider"}
    for _, w in ipairs{0.6, 0.2, 0.7} do
      gesture.update(g, "world.set_parameter", {id = cell, name = "wide", value = w})
      near(front:length(), w + 0.1)
    end
    gesture.cancel(g) near(front:length(), 0.6)
    local copy = front:duplicate{name = "copy"}
    cell:set_parameter{name = "wide", value = 0.35} near(copy:length(), 0.45) near(front:length(), 0.45))");
  EXPECT_EQ(warnings(), 0U);
}

TEST_F(FollowedEdges, ASolidThatIsFollowedIsNotRemoved) {
  EXPECT_NE(refused("part:remove()").find("rim"), std::string::npos);
  run("rim:remove() front:remove() part:remove()");
}

TEST_F(FollowedEdges, FilesKeepWhatIsFollowed) {
  const auto folder =
      std::filesystem::temp_directory_path() / ("robomosp-rim-" + std::to_string(::getpid()));
  std::filesystem::create_directories(folder);
  const std::string at = (folder / "rim.tjc").string();
  run("front:remove() record.save{id = rim, file = '" + at +
      "'}\n"
      "document.clear() rim = trajectory.load{file = '" +
      at +
      "'}\n"
      "near(rim:length(), 2 * math.pi * 0.02)\n"
      "solid.get('part'):set_parameter{name = 'bore', value = 0.04}\n"
      "near(rim:length(), 2 * math.pi * 0.04)");
  std::filesystem::remove_all(folder);
  EXPECT_EQ(warnings(), 0U);
}

TEST_F(AlongEdges, IsMadeAgainUnderItsNameWhereWorldsRunIt) {
  run(R"(
    args = {name = "seam", solid = plate, edges = {{0.1, 0, 0.01}}, speed = 0.02, acceleration = 0.5,
      sample_time = 0.03, description = "the first"}
    seam = trajectory.along_edges(args)
    cell = world.create{name = "cell"}
    cell:add_trajectory{trajectory = seam, name = "weld"}
    near(seam:length(), 0.1)
    args.edges, args.sample_time, args.description, args.replace = {{0, 0.05, 0.01}}, nil, nil, true
    again = trajectory.along_edges(args)
    assert(tostring(again) == tostring(seam))
    near(seam:length(), 0.2) near(cell:trajectories()[1].trajectory:length(), 0.2)
    local d = seam:describe()
    assert(d.description == "the first" and math.abs(d.sample_time - 0.03) < 1e-15)
    document.undo()
    near(seam:length(), 0.1)
    -- Where there is none yet it is made.
    args.name = "other" near(trajectory.along_edges(args):length(), 0.2))");
  EXPECT_NE(
      refused("trajectory.along_edges{name = 'seam', solid = plate, edges = {{0, 0.05, 0.01}}, "
              "speed = 0.01}")
          .find("seam"),
      std::string::npos);
}

TEST_F(AlongEdges, WhatCannotBeRunIsSaid) {
  const std::string head =
      "trajectory.along_edges{name = 'x', solid = plate, speed = 0.05, edges = ";
  EXPECT_NE(refused(head + "{}}").find("no edge is given"), std::string::npos);
  EXPECT_NE(refused(head + "{15}}").find("the solid has 14 edges, and no edge 15"),
            std::string::npos);
  EXPECT_NE(refused(head + "{0}}").find("no edge 0"), std::string::npos);
  EXPECT_NE(refused(head + "{1.5}}").find("edges[1]: 1.5 is not "), std::string::npos);
  EXPECT_NE(refused(head + "{0/0}}").find("edges[1]: "), std::string::npos);
  EXPECT_NE(refused(head + "{'rim'}}").find("edges[1]"), std::string::npos);
  EXPECT_NE(refused(head + "{{0.1, 0.05, 0.01}}}").find("are equally near"), std::string::npos);
  EXPECT_NE(refused(head + "{{0.1, 0, 0.01}, {-0.1, 0, 0.01}}}").find("does not begin where edge"),
            std::string::npos);
  EXPECT_NE(refused(head + "{{0.1, 0, 0.01}}, from = {0, 1, 0}}")
                .find("runs along the approach direction"),
            std::string::npos);
  EXPECT_NE(refused(head + "{{0.1, 0, 0.01}}, from = {0, 0, 0}}").find("from has no direction"),
            std::string::npos);
  EXPECT_NE(refused(head + "{{0.1, 0, 0.01}}, lead_in = -1}").find("lead_in"), std::string::npos);
  EXPECT_NE(refused("trajectory.along_edges{name = 'x', solid = plate, speed = 0, edges = {1}}")
                .find("speed"),
            std::string::npos);
  run("ball = solid.create{name = 'ball', root = {kind = 'sphere', radius = 0.1}}");
  EXPECT_NE(refused("trajectory.along_edges{name = 'x', solid = ball, speed = 1, edges = {1}}")
                .find("the solid has 0 edges"),
            std::string::npos);
}

}  // namespace
}  // namespace robomosp::lua
