// SPDX-License-Identifier: Apache-2.0
// Pulls of live runs: their mechanics, what they act on, what the record says, and refusals.
#include <chrono>
#include <string>
#include <thread>

#include <gtest/gtest.h>

#include "ioci/core/commands.h"
#include "support/lua_program.h"

namespace robomosp::lua {
namespace {

class RunPull : public test::LuaProgramTest {
 protected:
  /// A cube of 0.6 kg in free space.
  void SetUp() override {
    LuaProgramTest::SetUp();
    run("for _, r in ipairs(run.list()) do r.id:remove() end\n"
        "wood = material.create{name = 'wood', density = 600}\n"
        "box = solid.create{name = 'box', material = 'wood', root = {kind = 'box', x = 0.1, y = "
        "0.1, z = 0.1}}\n"
        "cell = world.create{name = 'cell'}\ncell:set{gravity = {0, 0, 0}}\n"
        "cell:add_object{what = 'box', position = {0, 0, 1}}\n"
        "live = cell:start_run('physics', {duration = 1})\n"
        "function near(a, b, by) assert(math.abs(a - b) <= by, a .. ' is not ' .. b) end\n"
        "function noted(what)\n"
        "  for _, n in ipairs(live:recording():notes()) do\n"
        "    if n:find(what, 1, true) then return n end\n  end\nend");
  }
  void expect_refused(std::string_view code, std::string_view with) {
    const std::string said = eval(code);
    EXPECT_NE(said.find(with), std::string::npos) << code << ": " << said;
  }
};

TEST_F(RunPull, AConstantForceAcceleratesByNewtonsLaw) {
  // A place far away: the spring pulls with its greatest force.
  run("live:pull{object = 'box', to = {1e6, 0, 0}, force = 3}\n"
      "v = live:seek(0.2).values\n"
      "near(v['box.x'], 0.5 * 3 / 0.6 * 0.2 ^ 2, 5e-4)\n"  // steps of 1 ms: half a step late
      "near(live:state().pulls[1].force, 3, 1e-9)\n"
      "near(live:state().pulls[1].at[3], 1.05, 1e-4)\n"
      // Released, it keeps its speed.
      "assert(live:release('box') == 1)\n"
      "a = live:seek(0.3).values['box.x']\nb = live:seek(0.4).values['box.x']\n"
      "near(b - a, 0.1 * 3 / 0.6 * 0.2, 1e-4)");
}

TEST_F(RunPull, TheBodyComesToThePlaceWithoutSwingingPastIt) {
  run("live:pull{object = 'box', to = {0.2, 0, 1}}\nlive:finish()\n"
      "x = live:recording():values('box.x')\n"
      "near(x[#x], 0.2, 1e-3)\n"
      "for _, each in ipairs(x) do assert(each < 0.2 + 1e-4) end");
}

TEST_F(RunPull, APointBesideTheCentreTurnsTheBody) {
  run("live:pull{object = 'box', to = {1e6, 0, 1}, point = {0.05, 0.05, 0.05}, force = 0.1}\n"
      "v = live:seek(0.1).values\n"
      // The torque is about -z.
      "assert(v['box.qz'] < -1e-3 and math.abs(v['box.qx']) < 1e-6)");
}

TEST_F(RunPull, AHardSpringStaysStable) {
  run("live:pull{object = 'box', to = {0.1, 0, 1.1}, point = {0.05, 0.05, 0.05}, stiffness = 1e12, "
      "force = 1e9}\nlive:finish()\n"
      "s = live:state()\n"
      "near(s.pulls[1].at[1], 0.1, 1e-3)\nnear(s.pulls[1].at[3], 1.1, 1e-3)");
}

TEST_F(RunPull, APulledBoxIsLiftedAgainstGravityAndPushesOthers) {
  run("cell:set{gravity = {0, 0, -9.81}}\n"
      "floor = solid.create{name = 'floor', root = {kind = 'box', x = 4, y = 4, z = 0.1}}\n"
      "cell:place{member = 'box', position = {0, 0, 0}}\n"
      "cell:add_object{what = 'floor', position = {0, 0, -0.1}}\n"
      "cell:add_object{what = 'box', name = 'other', position = {0.15, 0, 0}}\n"
      "live = cell:start_run('physics', {duration = 3})\n"
      "live:pull{object = 'box', to = {0.6, 0, 0.05}}\n"
      "live:seek(1.5)\nassert(live:state().objects.other.position[1] > 0.3)\n"
      "live:pull{object = 'box', to = {0.6, 0, 1}}\n"
      "near(live:seek(2.9).pulls[1].at[3], 1 - 9.81 / 90, 1e-3)");  // the spring sags
}

TEST_F(RunPull, ARunThatNobodyPullsHasTheBitsOfTheCommand) {
  run("live:finish()\nassert(#live:state().pulls == 0)\n"
      "a = live:recording():values('box.x')\nb = cell:simulate_physics{duration = "
      "1}:values('box.x')\n"
      "for i = 1, #b do assert(a[i] == b[i]) end");
}

TEST_F(RunPull, TheRecordSaysWhatWasPulled) {
  run("live:seek(0.1)\nlive:pull{object = 'box', to = {1e6, 0, 1}, force = 2.5}\nlive:seek(0.3)\n"
      "assert(noted('t = 0.1 s: \"box\" is pulled from outside'))\nassert(not noted('released'))\n"
      "live:release()\nlive:seek(0.4)\n"
      "assert(noted('\"box\" is released after a pull of 0.2 s with at most 2.5 N'))\n"
      // Rows that are dropped take their notes along.
      "live:seek(0.05)\nlive:refresh()\nlive:seek(0.2)\nassert(not noted('pulled'))");
}

TEST_F(RunPull, APullActsOnlyOnWhatIsComputedNext) {
  run("live:seek(0.5)\nlive:seek(0.2)");
  expect_refused("live:pull{object = 'box', to = {1, 0, 1}}",
                 "run.pull, id: run \"cell: physics\" shows t = 0.2 s and is computed up to 0.5 s");
  run("live:refresh()\nlive:pull{object = 'box', to = {1, 0, 1}}\n"
      "assert(live:seek(0.4).values['box.x'] > 0.1)\nlive:release()\nlive:finish()");
  expect_refused("live:pull{object = 'box', to = {1, 0, 1}}", "nothing is left to compute");
}

TEST_F(RunPull, NothingIsPulledAtTheLastRowOfARun) {
  // The simulation has not noticed yet that nobody wants another row.
  run("live:seek(1)\nassert(not live:state().is_complete)");
  expect_refused("live:pull{object = 'box', to = {1, 0, 1}}",
                 "is over at t = 1 s: nothing is left to compute");
  run("live:seek(0.9)\nlive:refresh()\nlive:pull{object = 'box', to = {1, 0, 1}}\n"
      "assert(live:seek(0.95).values['box.x'] > 0)\n"
      "live = robot 'planar2rods':start_run('dynamics', {duration = 0.5})\nlive:seek(0.5)");
  expect_refused("live:pull{link = 'lower', to = {1, 0, 0}}",
                 "is over at t = 0.5 s: nothing is left to compute");
}

TEST_F(RunPull, AnEditWhileItIsPulledActsWithRefreshAndThePullStays) {
  run("live:pull{object = 'box', to = {1e6, 0, 1}, force = 3}\nlive:seek(0.1)\n"
      "wood:set{density = 6000}\nassert(live:state().is_outdated and #live:state().pulls == 1)\n"
      "live:refresh()\nv1 = live:seek(0.11).values['box.x']\nv2 = live:seek(0.21).values['box.x']\n"
      // 0.5 m/s as before, and the acceleration of ten times the mass.
      "near(v2 - v1, 0.1 * 0.5 + 0.5 * 0.5 * 0.1 ^ 2, 1e-3)\n"
      "cell:remove_member('box')\n"
      "cell:add_object{what = 'box', name = 'late', position = {0, 0, 2}}\n"
      "live:refresh()\nlive:step(2)\n"
      "assert(#live:state().pulls == 0 and noted('\"box\" is not pulled any more'))");
}

TEST_F(RunPull, TheWorkOfThePullIsTheEnergyThatTheRobotGains) {
  // Two rods without friction; their tool is the origin of the frame of the last link.
  run("arm = robot 'planar2rods'\n"
      "live = arm:start_run('dynamics', {q = {0.3, -0.2}, duration = 0.5})\n"
      "live:seek(0.1)\nlive:pull{link = 'lower', point = {0, 0, 0}, to = {1e7, 0, 0}, force = 20}\n"
      "live:seek(0.3)\ne = live:recording()\n"
      "function at(c, t) local v = e:values(c) return v[math.floor(t / 0.01 + 0.5) + 1] end\n"
      "gained = at('energy', 0.3) - at('energy', 0.1)\n"
      "near(gained, 20 * (at('x', 0.3) - at('x', 0.1)), 1e-5)\nassert(math.abs(gained) > 0.5)\n"
      "near(at('energy', 0.1), at('energy', 0), 1e-7)\n"
      "live:release()\nlive:finish()\ne = live:recording()\n"
      "near(at('energy', 0.5), at('energy', 0.3), 1e-6)\n"
      "assert(noted('link \"lower\" of \"planar2rods\" is released after a pull of 0.2 s with at "
      "most 20 N'))");
}

TEST_F(RunPull, AControlledRobotYieldsAndComesBack) {
  run("arm = robot 'planar2rods'\ncell:add_robot{robot = arm, name = 'arm', q = {0.3, -0.2}}\n"
      "live = cell:start_run('dynamics', {robot = 'arm', reference = {0.3, -0.2}, controller = "
      "'pd_gravity', duration = 2})\n"
      "q = live:state().joints.arm[1]\n"
      "live:pull{link = 2, to = {0, 0, 5}, force = 30}\nlive:seek(0.4)\n"
      "assert(math.abs(live:state().joints.arm[1] - q) > 1e-3)\n"
      "live:release()\nlive:finish()\nnear(live:state().joints.arm[1], q, 1e-2)");
}

TEST_F(RunPull, ALimpRobotOfPhysicsIsPulledByItsLink) {
  run("arm = robot 'planar2rods'\ncell:add_robot{robot = arm, name = 'arm', q = {0, 0}}\n"
      "live = cell:start_run('physics', {duration = 1, robots = {{name = 'arm', drive = "
      "'limp'}}})\n"
      "s = live:state()\nassert(table.concat(s.pullable, ' ') == 'arm box')\n"
      "live:pull{robot = 'arm', link = 'lower', point = {0, 0, 0}, to = {0, 0, 5}, force = 10}\n"
      "live:seek(0.1)\nassert(live:state().joints.arm[2] > 0.1)\n"
      "near(live:state().pulls[1].force, 10, 1e-9)");
}

TEST_F(RunPull, WhatForcesDoNotMoveIsRefused) {
  run("slab = solid.create{name = 'slab', root = {kind = 'box', x = 1, y = 1, z = 0.1}}\n"
      "cell:add_object{what = 'slab', position = {0, 0, -1}}\n"
      "cell:add_robot{robot = robot 'planar2rods', name = 'arm'}\n"
      "live = cell:start_run('physics', {duration = 1})");
  expect_refused("live:pull{object = 'slab', to = {0, 0, 1}}",
                 "run.pull, object: forces do not move object \"slab\"");
  expect_refused("live:pull{object = 'bax', to = {0, 0, 1}}", "box");
  expect_refused("live:pull{link = 1, robot = 'arm', to = {0, 0, 1}}", "follows its motion");
  expect_refused("live:pull{to = {0, 0, 1}}", "neither an object nor a link is given");
  expect_refused("live:pull{object = 'box', link = 1, to = {0, 0, 1}}", "an object and a link");
  expect_refused("live:pull{object = 'box', to = {0, 0, 1}, force = -1}", "force");
  run("live = cell:start_run('physics', {duration = 1, robots = {{name = 'arm', drive = "
      "'limp'}}})");
  expect_refused("live:pull{link = 0, to = {0, 0, 1}}", "base of robot \"arm\" is fixed");
  run("world.load('worlds/pa10_circle.wld')\ncell = world.get('pa10_circle')\n"
      "live = cell:start_run('inverse_kinematics', {robot = cell:robots()[1].name, trajectory = "
      "cell:trajectories()[1].name})\nassert(#live:state().pullable == 0)");
  expect_refused("live:pull{robot = 'pa10', link = 1, to = {0, 0, 1}}",
                 "run.pull, id: no forces act in run");
  run("assert(live:release() == 0)");
}

TEST_F(RunPull, PullsOfTwoSessionsAddUpAndEndWithTheirSession) {
  const auto all = app().dispatch(session_, "run.list", {});
  ASSERT_TRUE(all.ok() && all->as_list() && !all->as_list()->empty());
  const Handle live = *all->as_list()->back().as_map()->find("id")->as_handle();
  const auto call = [&](ioci::Session& who, const char* command, Map args) {
    args.set("id", live);
    auto r = app().dispatch(who, command, args);
    EXPECT_TRUE(r.ok()) << r.error().sentence();
    return r.ok() ? *r : Value();
  };
  {
    ioci::Session guest{"guest"};
    call(session_, "run.pull", {{"object", "box"}, {"to", List{1e6, 0.0, 1.0}}, {"force", 3}});
    call(guest, "run.pull", {{"object", "box"}, {"to", List{-1e6, 0.0, 1.0}}, {"force", 3}});
    call(guest, "run.seek", {{"time", 0.1}});
    run("near(live:state().values['box.x'], 0, 1e-9)\nassert(#live:state().pulls == 2)");
    // A session ends its own pulls only.
    EXPECT_EQ(call(guest, "run.release", {}).number(), 1);
    call(guest, "run.pull", {{"object", "box"}, {"to", List{-1e6, 0.0, 1.0}}, {"force", 3}});
  }
  // Nobody is left who could release the guest's pull; closed sessions are noticed in 0.1 s.
  std::this_thread::sleep_for(std::chrono::milliseconds(150));
  run("live:seek(0.3)\nassert(#live:state().pulls == 1)\n"
      "assert(live:state().values['box.x'] > 0.01)");
}

TEST_F(RunPull, ARunThatPlaysIsPulledMeanwhile) {
  run("live:play('max')\nok = pcall(function() live:pull{object = 'box', to = {0.2, 0, 1}} end)\n"
      "live:finish()\nif ok then assert(noted('pulled')) end\n"
      "live = cell:start_run('physics', {duration = 100})\nlive:play()\n"
      "live:pull{object = 'box', to = {0.2, 0, 1}}\n"
      "repeat s = live:state() until s.time > 1 or s.objects.box.position[1] > 0.05\n"
      "assert(s.objects.box.position[1] > 0.05)\nlive:release()\nlive:remove()");
}

}  // namespace
}  // namespace robomosp::lua
