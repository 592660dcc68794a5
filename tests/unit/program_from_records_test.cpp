// SPDX-License-Identifier: Apache-2.0
// Programs made of tasks, trajectories and recordings: every kind of step as the language says it,
// and a sentence for what it cannot say.
#include <cmath>
#include <regex>
#include <string>

#include <gtest/gtest.h>

#include "program_source/source_text.h"
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

/// Two robots that stand where their motions begin, what they do there, and what compares it with
/// a run of the program made of it.
constexpr const char* kRecorded = R"lua(
  -- A world whose only robot stands with q; the way in joints is as far as its limits let it.
  function cell_of(name, q)
    local cell = world.create{name = "cell of " .. name}
    local arm = robot.get(name)
    cell:add_robot{robot = arm, name = name, q = q}
    return cell
  end
  function joints_of(run, name)
    local q = {}
    for j = 1, 6 do
      q[j] = run:values(name .. ".q" .. j)
    end
    return q, run:values("time")
  end
  -- How far the joints of two runs are apart at most, and their rates, and how long both take.
  function apart(a, b, name)
    local p, t = joints_of(a, name)
    local q, u = joints_of(b, name)
    local worst, rate = 0, 0
    for j = 1, 6 do
      for i = 1, math.min(#t, #u) - 1 do
        assert(math.abs(t[i] - u[i]) < 1e-9, i)
        worst = math.max(worst, math.abs(p[j][i] - q[j][i]))
        if i > 1 then
          rate = math.max(rate, math.abs(p[j][i] - p[j][i - 1] - q[j][i] + q[j][i - 1]) / (t[i] - t[i - 1]))
        end
      end
      worst = math.max(worst, math.abs(p[j][#t] - q[j][#u]))
    end
    return worst, rate, t[#t] - u[#u]
  end
)lua";

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
        "MOVE PTP MAIN_JOINT(5.729577951, 0.0, 0.0, 0.0, 0.0, 0.0, 250.0) TIME := 0.97871691; { "
        "rest }",
        "FOR round_1 := 1 TO 3",
        "MOVE LIN POSE(POSITION(600.0, 200.0, 500.0), ORIZYX(0.0, 0.0, 0.0)) SPEED := 250.0 "
        "SPEED_ORI := "
        "28.647889757 ACC := 40.0;",
        "gripper := TRUE; { takes part }", "inner();", "WRITELN('it''s {in}');",
        "IF NOT my_while <= 0.1 THEN", "idle := TRUE;", "ELSE", "WAIT 0.5 SEC;",
        "gripper := FALSE; { lets go part }", "my_while := my_while * 2.0;"})
    EXPECT_NE(text.find(line), std::string::npos) << line << "\nis not in\n" << text;
  // The rounds of what is called are its own.
  EXPECT_TRUE(std::regex_search(text, std::regex("PROCEDURE inner \\(\\);\nVAR\n  INT: round_1;")))
      << text;
}

TEST_F(ProgramFrom, EveryMotionOfATaskTakesItsTimeInTheProgram) {
  lua(std::string(kRecorded) + R"lua(
    for _, name in ipairs{"ur5", "puma560"} do
      local up = name == "ur5"
      local stand = {0.3, up and -1.2 or 0.4, up and 1.4 or -2.6, 0.2, 0.7, 0.1}
      local function moved(a, b, c)
        return {stand[1] + a, stand[2] + b, stand[3] + c, stand[4], stand[5] + a, stand[6] - b}
      end
      local cell = cell_of(name, stand)
      for _, n in ipairs{"mark", "far", "low"} do cell:add_signal{name = n} end
      -- Each motion is followed by a change of the signal, whose instants both runs have.
      local steps, value = {}, 0
      local function add(list, step)
        list[#list + 1] = step
        value = 1 - value
        list[#list + 1] = {step = "set", signal = "mark", value = value}
      end
      task.create{name = "dip " .. name, steps = {
        {step = "move", joints = moved(0.1, 0.05, -0.1)}, {step = "set", signal = "low", value = 1},
        {step = "move", joints = moved(0, 0, 0), profile = "s_curve"}, {step = "set", signal = "low", value = 0}}}
      add(steps, {step = "move", joints = moved(0.5, 0.1, -0.2)})
      local inner = {}
      add(inner, {step = "move", joints = moved(-0.3, 0.2, -0.3), speed = 0.3})
      add(inner, {step = "move", joints = moved(0.1, 0.1, -0.1), profile = "trapezoidal", speed = 0.5})
      local within = {}
      add(within, {step = "move", joints = moved(0.2, 0, 0), profile = "s_curve"})
      add(within, {step = "move", joints = moved(0.25, 0, 0.1), profile = "time_optimal"})
      inner[#inner + 1] = {step = "repeat", count = 2, steps = within}
      inner[#inner + 1] = {step = "call", task = "dip " .. name}
      steps[#steps + 1] = {step = "repeat", count = 3, steps = inner}
      add(steps, {step = "move", joints = moved(0.25, 0, 0.1)})
      steps[#steps + 1] = {step = "call", task = "dip " .. name}
      add(steps, {step = "move", joints = moved(0.4, 0, 0), duration = 1.5})
      task.create{name = "all " .. name, steps = steps}
      cell:add_task{task = "all " .. name, robot = name, name = "all"}
      local p = program.from_task{world = cell, task = "all", name = name .. "_all"}
      assert(p:check().correct)
      assert(not p:source():find("take a different time"), p:source())
      cell:add_program{program = p, name = "program"}
      for _, n in ipairs{"mark", "low"} do p:bind{kind = "signal", name = n, to = n} end
      local a = cell:run_task{task = "all", sample_time = 0.001}
      local b = cell:run_task{program = "program", sample_time = 0.001}
      local function changes(run)
        local out, t = {}, run:values("time")
        for _, n in ipairs{"mark", "low"} do
          local v = run:values("signal." .. n)
          for i = 2, #v do if v[i] ~= v[i - 1] then out[#out + 1] = t[i] end end
        end
        out[#out + 1] = t[#t]
        return out
      end
      local x, y = changes(a), changes(b)
      assert(#x == #y and #x > 20, #x .. " " .. #y)
      for i = 1, #x do assert(math.abs(x[i] - y[i]) < 0.0011, i .. ": " .. x[i] .. " " .. y[i]) end
      -- The first round begins elsewhere than the others.
      assert(p:source():find("IF round_1 = 1 THEN\n      MOVE PTP"), p:source())
      -- Behind a branch nobody knows where it stands, and that is said.
      task.create{name = "may " .. name, steps = {
        {step = "if", condition = "far == 1", steps = {{step = "move", joints = moved(0.2, 0, 0)}}},
        {step = "move", joints = moved(0, 0, 0.2)}}}
      cell:add_task{task = "may " .. name, robot = name, name = "may"}
      local may = program.from_task{world = cell, task = "may", name = name .. "_may"}:source()
      assert(may:find("take a different time if their start is unknown"), may)
      assert(select(2, may:gsub("TIME :=", "")) == 1, may)
    end)lua");
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
  refused("{step = 'wait', condition = 'left.q1 > 0.3 rad'}",
          "(wait): the language has no counterpart of \"left.q1\" in \"left.q1 > 0.3 rad\". "
          "Programs support signals, numbers and their sqrt and abs.");
  refused("{step = 'wait', condition = 'ready + 1 == 2'}",
          "(wait): the digital signal \"ready\" is used other than in a comparison with 0 or 1. In "
          "a program it is a BOOL; write ready == 1.");
  refused(
      "{step = 'move', robot = 'right', pose = 'rest'}",
      "(move): it is a task of robot \"right\", but the program is for \"left\". A program is for "
      "one robot; make a task for each.");
  refused("{step = 'move', pose = 'nowhere'}",
          "(move): robot \"left\" has no pose \"nowhere\". Define it with robot.set_pose.");
  refused("{step = 'set', signal = 'none', value = 1}",
          "(set): the world has no signal \"none\". Add one with world.add_signal.");
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
  lua(std::string(kRecorded) + R"lua(
    for _, name in ipairs{"ur5", "puma560"} do
      local stand = {0.3, name == "ur5" and -1.2 or 0.4, name == "ur5" and 1.4 or -2.6, 0.2, 0.7, 0.1}
      local cell = cell_of(name, stand)
      local far = {0.9, stand[2] + 0.3, stand[3] - 0.4, 0.5, 1.1, -0.6}
      -- By two laws, with a rest between, and there and back.
      task.create{name = "go " .. name, steps = {
        {step = "move", joints = far, speed = 0.4},
        {step = "wait", time = 0.7},
        {step = "move", joints = stand, profile = "trapezoidal", speed = 0.6},
        {step = "move", joints = far, profile = "s_curve", duration = 2}}}
      cell:add_task{task = "go " .. name, robot = name, name = "go"}
      local recorded = cell:run_task{task = "go", sample_time = 0.02}
      local fine = cell:run_task{task = "go", sample_time = 0.005}
      local counts = {}
      for k, tolerance in ipairs{0.02, 1e-3, 1e-5, 1e-12} do
        local p = program.from_recording{recording = recorded, tolerance = tolerance,
          name = name .. " " .. k}
        assert(p:check().correct)
        _, counts[k] = p:source():gsub("MOVE PTP", "")
        assert(not p:source():find("stops"), p:source():sub(1, 800))
        local placed = cell:add_program{program = p, name = "p" .. k}
        local run = cell:run_task{program = "p" .. k, sample_time = 0.02}
        local worst, rate, longer = apart(recorded, run, name)
        assert(worst <= tolerance * 1.0001 + 1e-9, tostring(worst))
        assert(math.abs(longer) < 1e-6, tostring(longer))
        -- Between the rows of the recording, too, and without a stop at them.
        local between, rates = apart(fine, cell:run_task{program = "p" .. k, sample_time = 0.005}, name)
        assert(between <= 1.05 * tolerance + 2e-4, tostring(between))
        if tolerance < 1e-4 then assert(rates < 0.05, tostring(rates)) end
        for _, n in ipairs(run:notes()) do assert(not n:find("C_PASS"), n) end
      end
      assert(counts[1] < counts[2] and counts[2] < counts[3] and counts[3] < counts[4])
    end)lua");
}

TEST_F(ProgramFrom, ATrajectorysRecordingRunsAsItWas) {
  lua(std::string(kRecorded) + R"lua(
    local cell = cell_of("ur5", {0, -1.2, 1.4, -1.7, -1.5, 0})
    trajectory.create{name = "seam", segments = {
      {shape = "line", points = {{-0.45, -0.1, 0.4, 0, math.pi, 0}, {-0.45, 0.2, 0.4, 0, math.pi, 0}}, speed = 0.2,
       law = "trapezoidal"},
      {shape = "arc", points = {{-0.45, 0.2, 0.4, 0, math.pi, 0}, {-0.5, 0.25, 0.4, 0, math.pi, 0}, {-0.55, 0.2, 0.4, 0, math.pi, 0}},
       speed = 0.2, law = "trapezoidal", transition = {distance = 0.02}}}}
    cell:add_trajectory{trajectory = "seam", name = "seam"}
    task.create{name = "sew", steps = {{step = "move", trajectory = "seam"}}}
    cell:add_task{task = "sew", robot = "ur5", name = "sew"}
    local recorded = cell:run_task{task = "sew", sample_time = 0.02}
    for k, tolerance in ipairs{5e-3, 1e-12} do
      local p = program.from_recording{recording = recorded, tolerance = tolerance, name = "p" .. k}
      cell:add_program{program = p, name = "p" .. k}
      local run = cell:run_task{program = "p" .. k, sample_time = 0.02}
      local worst, rate, longer = apart(recorded, run, "ur5")
      assert(worst <= tolerance * 1.0001 + 1e-9 and math.abs(longer) < 1e-6, tostring(worst))
    end
    )lua");
}

TEST_F(ProgramFrom, ATrajectorysProgramGoesAsTheTrajectory) {
  lua(std::string(kRecorded) + R"lua(
    local cell = cell_of("ur5", {0, -1.2, 1.4, -1.7, -1.5, 0})
    local law = "trapezoidal"
    local function at(x, y, z) return {x, y, z, 0, math.pi, 0} end
    trajectory.create{name = "seam", segments = {
      {shape = "line", points = {at(-0.45, -0.1, 0.4), at(-0.45, 0.2, 0.4)}, speed = 0.2, law = law},
      {shape = "arc", points = {at(-0.45, 0.2, 0.4), at(-0.5, 0.25, 0.4), at(-0.55, 0.2, 0.4)}, speed = 0.15,
       acceleration = 0.8, law = law},
      {shape = "cubic_spline", points = {at(-0.55, 0.2, 0.4), at(-0.5, 0, 0.45), at(-0.55, -0.1, 0.4)}, speed = 0.2,
       law = law},
      {shape = "line", points = {at(-0.55, -0.1, 0.4), {-0.45, -0.1, 0.4, 0, math.pi, 1}}, duration = 3, law = law}}}
    cell:add_trajectory{trajectory = "seam", name = "seam"}
    task.create{name = "sew", steps = {{step = "move", trajectory = "seam"}}}
    cell:add_task{task = "sew", robot = "ur5", name = "sew"}
    local p = program.from_trajectory{world = cell, robot = "ur5", trajectory = "seam", name = "way"}
    cell:add_program{program = p, name = "way"}
    local function way(run)
      run:compute{quantities = {"pose"}, robot = "ur5"}
      return run:values("time"), {run:values("ur5.x"), run:values("ur5.y"), run:values("ur5.z")}
    end
    local t, a = way(cell:run_task{task = "sew", sample_time = 0.002})
    local u, b = way(cell:run_task{program = "way", sample_time = 0.002})
    -- Both begin elsewhere, and end together: at equal times before the end they are at one place.
    local worst = 0
    local function place(times, w, time)
      local i = 1 + math.floor(time / 0.002)
      local x = (time - times[i]) / (times[i + 1] - times[i])
      return {w[1][i] + x * (w[1][i + 1] - w[1][i]), w[2][i] + x * (w[2][i + 1] - w[2][i]),
              w[3][i] + x * (w[3][i + 1] - w[3][i])}
    end
    local timed = 0
    for k = 1, 782 do
      local before = 0.01 * k
      local p, q = place(t, a, t[#t] - before), place(u, b, u[#u] - before)
      local off = math.sqrt((p[1] - q[1]) ^ 2 + (p[2] - q[2]) ^ 2 + (p[3] - q[3]) ^ 2)
      -- The last segment has a time alone, and ramps of its own in it.
      if before <= 3 then timed = math.max(timed, off) else worst = math.max(worst, off) end
    end
    assert(worst < 3e-5, tostring(worst))
    assert(timed < 1e-3, tostring(timed))
  )lua");
}

TEST(IrlText, NumbersAreReadAsWhatTheyWere) {
  using program_source::irl_real;
  EXPECT_EQ(irl_real(0), "0.0");
  EXPECT_EQ(irl_real(-0.0), "0.0");
  EXPECT_EQ(irl_real(-1e-12), "0.0");
  EXPECT_EQ(irl_real(0.1 * 3 * 1000), "300.0");
  EXPECT_EQ(irl_real(1e300), "1.0e+300");
  EXPECT_EQ(irl_real(100000), "100000.0");
  EXPECT_EQ(irl_real(123456.789), "123456.789");
}

TEST(IrlText, NamesAreNeitherReservedNorTwice) {
  program_source::IrlNames names;
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
