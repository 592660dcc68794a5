// SPDX-License-Identifier: Apache-2.0
// Edges of solids as curves, and trajectories along them.
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

TEST_F(AlongEdges, IsOneStepOfUndoAndFollowsTheSolidOfNow) {
  run(R"(
    w = world.create{name = "w"}
    way = trajectory.along_edges{name = "way", solid = plate, edges = {{0, 0.05, 0.01}}, speed = 0.05}
    document.undo() assert(#trajectory.list() == 0) document.redo() assert(#trajectory.list() == 1)
    plate:set("body.x", 0.3)
    near(trajectory.get("way"):length(), 0.2)
    longer = trajectory.along_edges{name = "longer", solid = plate, edges = {{0, 0.05, 0.01}}, speed = 0.05}
    near(longer:length(), 0.3))");
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
  EXPECT_NE(refused(head + "{1.5}}").find("no edge 1.5"), std::string::npos);
  EXPECT_NE(refused(head + "{0/0}}").find("no edge"), std::string::npos);
  EXPECT_NE(refused(head + "{'rim'}}").find("edges[1]"), std::string::npos);
  EXPECT_NE(refused(head + "{{0.1, 0.05, 0.01}}}").find("are equally near"), std::string::npos);
  EXPECT_NE(refused(head + "{{0.1, 0, 0.01}, {-0.1, 0, 0.01}}}").find("does not begin where edge"),
            std::string::npos);
  EXPECT_NE(refused(head + "{{0.1, 0, 0.01}}, from = {0, 1, 0}}").find("runs along the direction"),
            std::string::npos);
  EXPECT_NE(refused(head + "{{0.1, 0, 0.01}}, from = {0, 0, 0}}").find("runs along the direction"),
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
