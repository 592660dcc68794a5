// SPDX-License-Identifier: Apache-2.0
// Live runs from the console: what an edit does to them, motions that are computed first, solvers
// in Lua, and one sentence for what cannot be run.
#include <string>

#include <gtest/gtest.h>

#include "support/lua_program.h"

namespace robomosp::lua {
namespace {

class RunCommands : public test::LuaProgramTest {
 protected:
  void SetUp() override {
    LuaProgramTest::SetUp();
    run("for _, r in ipairs(run.list()) do r.id:remove() end\n"
        "wood = material.create{name = 'wood', density = 600}\n"
        "box = solid.create{name = 'box', material = 'wood', root = {kind = 'box', x = 0.1, y = "
        "0.1, z = 0.1}}\n"
        "other = solid.create{name = 'other', root = {kind = 'box', x = 1, y = 1, z = 1}}\n"
        "cell = world.create{name = 'cell'}\n"
        "cell:add_object{what = 'box', position = {0, 0, 1}}\n"
        "fall = cell:start_run('physics', {duration = 0.3})");
  }
  std::string refused(std::string_view code) {
    auto r = state_->eval(code);
    EXPECT_FALSE(r.ok()) << code;
    return r.ok() ? "" : r.error().sentence();
  }
  void expect_refused(std::string_view code, std::string_view with) {
    const std::string said = refused(code);
    EXPECT_NE(said.find(with), std::string::npos) << said;
  }
};

TEST_F(RunCommands, OnlyEditsOfWhatTheWorldRefersToMakeARunOutdated) {
  run("fall:seek(0.1)\n"
      "other:set{path = 'box.x', value = 2}\n"
      "assert(not fall:state().is_outdated)\n"
      "wood:set{density = 700}\n"
      "assert(fall:state().is_outdated and fall:step().is_outdated)\n"
      "assert(not fall:refresh().is_outdated)");
}

TEST_F(RunCommands, AResetKeepsEveryEdit) {
  run("fall:finish()\n"
      "cell:add_object{what = 'box', name = 'second', position = {1, 0, 2}}\n"
      "before = document.digest()\n"
      "s = fall:reset()\n"
      "assert(s.time == 0 and #cell:objects() == 2)\n"
      "assert(math.abs(s.objects.second.position[3] - 2) < 1e-12)\n"
      "assert(document.digest() == before)\n"
      "document.undo()\n"
      "assert(not fall:reset().objects.second)");
}

TEST_F(RunCommands, AnEditThatCannotRunLeavesWhatIsRecorded) {
  run("fall:seek(0.2)\ncell:remove_member('box')\n"
      "robot.create{name = 'slack', links = {{name = 'one'}}}\ncell:remove()");
  expect_refused("fall:refresh()", "no longer exists");
  run("assert(fall:state().rows == 21)\nassert(#fall:recording():values('box.z') == 21)");
}

TEST_F(RunCommands, MotionsAlongTrajectoriesGoOnInTheNewWorldAtTheSameTime) {
  run("cell = world.load('worlds/pa10_circle.wld')\n"
      "what = {robot = cell:robots()[1].name, trajectory = cell:trajectories()[1].name}\n"
      "ik = cell:start_run('inverse_kinematics', what)\n"
      "old = cell:inverse_kinematics(what):values('q1')\n"
      "ik:step(10)\n"
      "p = cell:trajectories()[1].placement.position\n"
      "cell:place{member = what.trajectory, position = {p[1], p[2] + 0.02, p[3]}}\n"
      "new = cell:inverse_kinematics(what):values('q1')\n"
      "ik:refresh()\nik:finish()\n"
      "q = ik:recording():values('q1')\n"
      "assert(#q == #new and q[11] == old[11] and q[12] == new[12] and q[#q] == new[#new])\n"
      "assert(old[12] ~= new[12])\n"
      "assert(#ik:recording():notes() > 0)");
}

TEST_F(RunCommands, AControllerInLuaIsRunAsWell) {
  run("ioci.provide('robomosp.controller/1', 'spring', {torques = function(model, now)\n"
      "  local tau = {}\n"
      "  for j = 1, model.dof do tau[j] = now.gravity[j] - 30 * now.q[j] - 4 * now.qd[j] end\n"
      "  return tau\nend})\n"
      "arm = robot 'planar2rods'\n"
      "what = {q = {0.3, -0.2}, reference = {0, 0}, controller = 'spring', duration = 0.1}\n"
      "count = #recording.list()\n"
      "swing = arm:start_run('dynamics', what)\n"
      "assert(#recording.list() == count)\n"
      "assert(swing:step(4).row == 5)\n"
      "q = arm:simulate(what):values('q2')\n"
      "assert(swing:state().joints.planar2rods[2] == q[5])");
}

TEST_F(RunCommands, ARecordingIsPlayedBackwards) {
  run("r = cell:simulate_physics{duration = 0.2}\n"
      "back = cell:start_run('recording', {recording = r})\n"
      "back:finish()\n"
      "assert(back:step(-5).objects.box.position[3] == r:values('box.z')[16])\n"
      "assert(back:play(-1).speed == -1 and not back:pause().is_playing)");
}

TEST_F(RunCommands, WhatCannotBeRunIsSaidInASentence) {
  expect_refused("cell:start_run('physics')", "Give a duration");
  expect_refused("cell:start_run('physics', {durations = 1})", "Did you mean \"duration\"");
  expect_refused("cell:start_run('dynamics', {duration = 1})", "with");
  expect_refused("cell:start_run('swim', {})", "tasks");
  expect_refused("cell:start_run('tasks')", "no task");
  expect_refused("cell:start_run('recording', {recording = 3})", "no recording");
  expect_refused("fall:play(0)", "cannot be played");
  expect_refused("fall:play('fast')", "speed: \"fast\" is not ");
  expect_refused("fall:seek(-1)", "time");
  run("fall:stop()");
  expect_refused("fall:step(5)", "was cancelled");
  run("fall:remove()");
  expect_refused("fall:step()", "no longer exists");
  run("assert(#run.list() == 0)");
}

TEST_F(RunCommands, NoneBeginsInsideAGroupOfEdits) {
  const auto done = app().transaction(session_, "group", [&]() -> Result<void> {
    RMP_TRY(app().dispatch(session_, "material.create", {{"name", "oak"}, {"density", 700.0}}));
    RMP_TRY(app().dispatch(session_, "world.start_run",
                           {{"id", "cell"}, {"of", "physics"}, {"with", Map{{"duration", 0.1}}}}));
    return {};
  });
  ASSERT_FALSE(done.ok());
  EXPECT_NE(done.error().message.find("group of edits"), std::string::npos);
}

}  // namespace
}  // namespace robomosp::lua
