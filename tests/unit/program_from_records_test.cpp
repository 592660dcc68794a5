// SPDX-License-Identifier: Apache-2.0
// Programs made of tasks, trajectories and recordings: every kind of step as the language says it,
// and a sentence for what it cannot say.
#include <cmath>
#include <regex>
#include <string>

#include <gtest/gtest.h>

#include "ioci/program/source_text.h"
#include "lua/lua_state.h"
#include "support/program.h"

namespace robomosp {
namespace {

class ProgramFrom : public test::CommandTest {
 protected:
  /// A script; its return value as text.
  std::string lua(const std::string& script) {
    lua::LuaState state(app(), session_);
    auto r = state.run_text_values(script, "test");
    EXPECT_TRUE(r.ok()) << (r.ok() ? "" : r.error().sentence());
    if (!r.ok() || r->empty()) return {};
    const std::string* out = (*r)[0].as_string();
    return out ? *out : "";
  }
  static constexpr const char* kCell = R"(
    local links = {}
    for i = 1, 7 do
      links[i] = {name = "l" .. i, a = 0.1, alpha = i % 2 == 0 and 1.57 or 0,
                  joint = i == 7 and "prismatic" or "revolute"}
    end
    arm = robot.create{name = "arm", links = links}
    arm:set_pose{name = "rest", q = {0.1, 0, 0, 0, 0, 0, 0.25}}
    solid.create{name = "part", root = {kind = "box", x = 0.03, y = 0.03, z = 0.03}}
    cell = world.create{name = "cell"}
    cell:add_robot{robot = arm, name = "left", position = {1, 0, 0}}
    cell:add_robot{robot = arm, name = "right"}
    cell:add_object{what = "part", name = "part", position = {0.5, 0, 0}}
    cell:add_frame{name = "bench", position = {1.5, 0, 0.2}}
    cell:add_signal{name = "ready"}
    cell:add_signal{name = "while", kind = "analogue", unit = "m"}
    cell:add_signal{name = "idle"}
  )";
};

TEST_F(ProgramFrom, EveryKindOfStepIsAStatement) {
  const std::string text = lua(std::string(kCell) + R"(
    task.create{name = "inner", steps = {
      {step = "repeat", count = 2, steps = {{step = "message", text = "it's {in}"}}}}}
    task.create{name = "all", steps = {
      {step = "wait", condition = "ready == 1 and while > 250 mm", timeout = 2},
      {step = "move", pose = "rest", speed = 0.5},
      {step = "repeat", count = 3, steps = {
        {step = "move", target = {0.1, 0.2, 0.3, 0, 0, 0}, frame = "bench", path = "straight"},
        {step = "attach", object = "part"},
        {step = "call", task = "inner"}}},
      {step = "if", condition = "not while <= 0.1", steps = {{step = "set", signal = "idle", value = 1}}},
      {step = "else", steps = {{step = "wait", time = 0.5}}},
      {step = "detach", object = "part"},
      {step = "set", signal = "while", value = "while * 2"}}}
    cell:add_task{task = "all", robot = "left"}
    p = program.from_task{world = cell, task = "all"}
    local c = p:check()
    assert(c.correct, #c.faults > 0 and c.faults[1].message or "")
    return p:source())");
  EXPECT_NE(text.find("SYSTEM_SPECIFICATION 'all.ssi';"), std::string::npos) << text;
  for (const char* line :
       {"INPUT BOOL: ready AT 1;", "OUTPUT REAL: my_while AT 2;", "OUTPUT BOOL: idle AT 3;",
        "OUTPUT BOOL: gripper AT 4;", "WAIT FOR ready = TRUE AND my_while > 0.25 TIMEOUT 2.0;",
        "MOVE PTP MAIN_JOINT(5.729577951, 0.0, 0.0, 0.0, 0.0, 0.0, 250.0) SPEED_PTP := 50.0; { "
        "rest }",
        "FOR round_1 := 1 TO 3",
        "MOVE LIN POSE(POSITION(600.0, 200.0, 500.0), ORIZYX(0.0, 0.0, 0.0)) SPEED := 250.0;",
        "gripper := TRUE; { takes part }", "inner();", "WRITELN('it''s {in}');",
        "IF NOT my_while <= 0.1 THEN", "idle := TRUE;", "ELSE", "WAIT 0.5 SEC;",
        "gripper := FALSE; { lets go part }", "my_while := my_while * 2.0;"})
    EXPECT_NE(text.find(line), std::string::npos) << line << "\nis not in\n" << text;
  // The rounds of what is called are its own.
  EXPECT_TRUE(std::regex_search(text, std::regex("PROCEDURE inner \\(\\);\nVAR\n  INT: round_1;")))
      << text;
}

TEST_F(ProgramFrom, WhatTheLanguageCannotSayNamesTheStep) {
  lua(kCell);
  const auto refused = [&](const std::string& step, const std::string& sentence) {
    lua("cell = world.get('cell')\ntask.create{name = 't', steps = {{step = 'message', text = "
        "'x'}, " +
        step + "}}\ncell:add_task{task = 't', robot = 'left'}");
    const Error e = fails("program.from_task", {{"world", "cell"}, {"task", "t"}});
    EXPECT_EQ(e.sentence(), "task \"t\", step 2 " + sentence);
    call("document.undo");
    call("document.undo");
  };
  refused(
      "{step = 'wait', condition = 'left.q1 > 0.3 rad'}",
      "(wait): the language has no word for \"left.q1\" in \"left.q1 > 0.3 rad\". Programs know "
      "signals, numbers and sqrt, abs of them.");
  refused(
      "{step = 'wait', condition = 'ready + 1 == 2'}",
      "(wait): the digital signal \"ready\" is more than compared with 0 or 1. A program has it "
      "as a BOOL; write ready == 1.");
  refused("{step = 'move', robot = 'right', pose = 'rest'}",
          "(move): it is one of robot \"right\", but the program is for \"left\". A program is for "
          "one robot; make a task for each.");
  refused("{step = 'move', pose = 'nowhere'}",
          "(move): robot \"left\" has no pose \"nowhere\". robot.set_pose keeps one.");
  refused("{step = 'set', signal = 'none', value = 1}",
          "(set): the world has no signal \"none\". world.add_signal adds one.");
}

TEST_F(ProgramFrom, ShapesBecomeMotions) {
  const std::string text = lua(std::string(kCell) + R"(
    trajectory.create{name = "seam", segments = {
      {shape = "line", points = {{0, 0, 0, 0, 0, 0}, {0.1, 0, 0, 0, 0, 0}}, speed = 0.05},
      {shape = "arc", points = {{0.1, 0, 0, 0, 0, 0}, {0.15, 0.05, 0, 0, 0, 0}, {0.2, 0, 0, 0, 0, 0}}, law = "trapezoidal", duration = 3,
       transition = {distance = 0.002}},
      {shape = "cubic_spline", points = {{0.3, 0, 0, 0, 0, 0}, {0.4, 0.1, 0, 0, 0, 0}, {0.5, 0, 0, 0, 0, 0}}}}}
    cell:add_trajectory{trajectory = "seam", name = "seam", position = {1, 0, 0.4}}
    local p = program.from_trajectory{world = cell, robot = "left", trajectory = "seam", points = 4}
    local c = p:check()
    assert(c.correct, #c.faults > 0 and c.faults[1].message or "")
    return p:source())");
  for (const char* line :
       {"MOVE PTP POSE(POSITION(0.0, 0.0, 400.0), ORIZYX(0.0, 0.0, 0.0));",
        "MOVE LIN POSE(POSITION(100.0, 0.0, 400.0), ORIZYX(0.0, 0.0, 0.0)) SPEED := 50.0 C_CP := "
        "2.0;",
        "MOVE CIRCLE POSE(POSITION(150.0, 50.0, 400.0), ORIZYX(0.0, 0.0, 0.0)), "
        "POSE(POSITION(200.0, 0.0, 400.0), ORIZYX(0.0, 0.0, 0.0)) TIME := 3.0;",
        "MOVE LIN POSE(POSITION(300.0, 0.0, 400.0), ORIZYX(0.0, 0.0, 0.0));", "MOVE PATH POSE(",
        "POSE(POSITION(500.0, 0.0, 400.0), ORIZYX(0.0, 0.0, 0.0)) TIME := "})
    EXPECT_NE(text.find(line), std::string::npos) << line << "\nis not in\n" << text;
}

TEST_F(ProgramFrom, RecordingsKeepAsFewRowsAsTheToleranceLets) {
  const std::string counts = lua(R"lua(
    local links = {}
    for i = 1, 6 do links[i] = {name = "l" .. i, a = 0.2, max_velocity = 2, max_acceleration = 8} end
    local arm = robot.create{name = "arm", links = links}
    local cell = world.create{name = "cell"}
    cell:add_robot{robot = arm}
    task.create{name = "go", steps = {
      {step = "move", joints = {1, 0.5, 0, 0, 0, 0}}, {step = "move", joints = {0, 0, 1, 0, 0, 0}}}}
    cell:add_task{task = "go", robot = "arm"}
    local run = cell:run_task()
    local out, q = {}, {}
    for k, tolerance in ipairs{0.1, 0.001} do
      local p = program.from_recording{recording = run, tolerance = tolerance, name = "p" .. k}
      assert(p:check().correct)
      local _, n = p:source():gsub("MOVE PTP", "")
      -- What is between the rows kept is within the tolerance of what was recorded.
      local t, rows = 0, {}
      for line in p:source():gmatch("MOVE PTP[^\n]+") do
        local first = tonumber(line:match("MAIN_JOINT%(([^,]+),"))
        t = t + (tonumber(line:match("TIME := ([%d.e-]+)")) or 0)
        rows[#rows + 1] = {t, math.rad(first)}
      end
      local times, q1 = run:values("time"), run:values("arm.q1")
      local worst, at = 0, 1
      for i = 1, #times do
        while at < #rows - 1 and rows[at + 1][1] < times[i] do at = at + 1 end
        local a, b = rows[at], rows[at + 1]
        local x = (times[i] - a[1]) / (b[1] - a[1])
        worst = math.max(worst, math.abs(a[2] + x * (b[2] - a[2]) - q1[i]))
      end
      assert(worst <= tolerance * 1.001, worst)
      out[k] = n
    end
    assert(out[2] > out[1] and out[1] >= 3, out[1] .. " " .. out[2])
    return out[1] .. " " .. out[2])lua");
  EXPECT_FALSE(counts.empty());
}

TEST(IrlText, NumbersAreReadAsWhatTheyWere) {
  using ioci::irl_real;
  EXPECT_EQ(irl_real(0), "0.0");
  EXPECT_EQ(irl_real(-0.0), "0.0");
  EXPECT_EQ(irl_real(-1e-12), "0.0");
  EXPECT_EQ(irl_real(0.1 * 3 * 1000), "300.0");
  EXPECT_EQ(irl_real(1e300), "1.0e+300");
  EXPECT_EQ(irl_real(123456.789), "123456.789");
}

TEST(IrlText, NamesAreNeitherReservedNorTwice) {
  ioci::IrlNames names;
  EXPECT_EQ(names.name("1", "While"), "my_While");
  EXPECT_EQ(names.name("2", "3 d"), "n_3_d");
  EXPECT_EQ(names.name("3", "part"), "part");
  EXPECT_EQ(names.name("4", "PART"), "PART_2");
  EXPECT_EQ(names.name("3", "anything"), "part");
  EXPECT_EQ(names.name("5", "R_SPEED"), "my_R_SPEED");
  EXPECT_EQ(names.name("6", ""), "n_");
}

}  // namespace
}  // namespace robomosp
