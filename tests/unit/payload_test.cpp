// SPDX-License-Identifier: Apache-2.0
// What a robot holds has weight and inertia: torques, energies and free motions against closed
// forms of an arm with one joint.
#include <string>

#include <gtest/gtest.h>

#include "support/lua_program.h"

namespace robomosp::lua {
namespace {

/// An arm without mass whose joint turns x towards z; a block of 1 kg beside its tool.
class Payload : public test::LuaProgramTest {
 protected:
  void SetUp() override {
    LuaProgramTest::SetUp();
    run("material.create{name = 'light', density = 1000}\n"
        "block = solid.create{name = 'block', material = 'light', root = {kind = 'box', x = 0.1, y "
        "= "
        "0.1, z = 0.1}}\n"
        "arm = robot.create{name = 'arm', links = {{a = 0.5, max_velocity = 2, max_acceleration = "
        "5}}}\n"
        "cell = world.create{name = 'cell'}\n"
        "cell:add_robot{robot = 'arm', name = 'arm', placement = {0, 0, 0, math.pi / 2, 0, 0}}\n"
        "cell:add_object{what = 'block', name = 'block', position = {0.55, 0.02, 0.1}}\n"
        "trajectory.create{name = 'lift', sample_time = 0.05, segments = {\n"
        "  {shape = 'ptp', profile = 'quintic', joints = {{0}, {1.2}}}}}\n"
        "cell:add_trajectory{trajectory = 'lift'}\n"
        "m = block:mass()\n"
        // x and z of its centre of mass while the arm lies along x; a cube turns alike about all
        // axes.
        "function hold(at_x, at_z) x, z = at_x, at_z\n"
        "  about = m.inertia[2][2] + m.mass * (x * x + z * z) end\n"
        "function torque(q, qdd) return about * qdd + m.mass * 9.81 * (x * math.cos(q) - z * "
        "math.sin(q)) end");
  }
};

TEST_F(Payload, CountsInTheTorquesOfAMotion) {
  run("without = cell:inverse_dynamics{robot = 'arm', trajectory = 'lift'}:values('tau1')\n"
      "for i = 1, #without do assert(math.abs(without[i]) < 1e-12) end\n"
      "cell:attach{robot = 'arm', object = 'block'} hold(0.5, 0)  -- its origin at the tool\n"
      "r = cell:inverse_dynamics{robot = 'arm', trajectory = 'lift'}\n"
      "tau, q, qdd = r:values('tau1'), r:values('q1'), r:values('qdd1')\n"
      "assert(#tau > 20)\n"
      "for i = 1, #tau do assert(math.abs(tau[i] - torque(q[i], qdd[i])) < 1e-9, i) end");
  // The same columns, computed behind a kinematic run.
  run("r = cell:inverse_kinematics{robot = 'arm', trajectory = 'lift'}\n"
      "r:compute{quantities = {'torque', 'energy'}}\n"
      "tau, q, qd, qdd = r:values('tau1'), r:values('q1'), r:values('qd1'), r:values('qdd1')\n"
      "kinetic = r:values('kinetic')\n"
      "for i = 1, #tau do assert(math.abs(tau[i] - torque(q[i], qdd[i])) < 1e-9, i)\n"
      "  assert(math.abs(kinetic[i] - about * qd[i]^2 / 2) < 1e-9, i) end");
}

TEST_F(Payload, FallsWithTheArm) {
  run("cell:attach{robot = 'arm', object = 'block'} hold(0.5, 0)\n"
      "r = cell:simulate_dynamics{robot = 'arm', duration = 0.3, sample_time = 0.05}\n"
      "q, qdd = r:values('q1'), r:values('qdd1')\n"
      "assert(q[#q] < -0.1)\n"
      "for i = 1, #q do assert(math.abs(torque(q[i], qdd[i])) < 1e-6, i) end");
}

TEST_F(Payload, CountsInTasksWhileItIsHeld) {
  run("hold(0.55 + m.com[1], 0.1 + m.com[3])  -- from where it is\n"
      "task.create{name = 'carry', steps = {\n"
      "  {step = 'move', joints = {0.4}}, {step = 'move', joints = {0}},\n"
      "  {step = 'attach', object = 'block', reach = 1}, {step = 'move', joints = {0.8}},\n"
      "  {step = 'detach', object = 'block'}, {step = 'move', joints = {0}}}}\n"
      "cell:add_task{task = 'carry', robot = 'arm'}\n"
      "r = cell:run_task{sample_time = 0.01}\n"
      "r:compute{quantities = {'torque'}, robot = 'arm'}\n"
      "tau, q, qdd = r:values('arm.tau1'), r:values('arm.q1'), r:values('arm.qdd1')\n"
      "height, held, free = r:values('block.z'), 0, 0\n"
      "for i = 2, #tau - 1 do  -- it is taken and let go between rows\n"
      "  if height[i + 1] ~= height[i] and height[i] ~= height[i - 1] then held = held + 1\n"
      "    assert(math.abs(tau[i] - torque(q[i], qdd[i])) < 1e-9, i)\n"
      "  elseif held == 0 and height[i + 2] == height[i] then free = free + 1\n"
      "    assert(math.abs(tau[i]) < 1e-12, i) end end\n"
      "assert(held > 20 and free > 20)\n"
      "assert(math.abs(tau[#tau]) < 1e-12)");
}

TEST_F(Payload, TouchesWhatItMeetsInTheHand) {
  run("solid.create{name = 'slab', root = {kind = 'box', x = 2, y = 2, z = 0.02}}\n"
      "cell:add_object{what = 'slab', name = 'table', position = {0, 0, -0.4}}\n"
      "function pair(rows) for _, r in ipairs(rows) do\n"
      "  if r.a == 'block' and r.b == 'table' or r.a == 'table' and r.b == 'block' then return r "
      "end\n"
      "end end\n"
      "assert(not pair(cell:distances{q = {-0.3}}))  -- both stand still\n"
      "cell:attach{robot = 'arm', object = 'block'}\n"
      // The lowest corner of the square about the tool, above the table's top at -0.38.
      "lowest = 0.5 * math.sin(-0.3) - 0.05 * (math.sin(0.3) + math.cos(0.3))\n"
      "d = pair(cell:distances{q = {-0.3}}) assert(math.abs(d.distance - lowest - 0.38) < 1e-6)\n"
      "assert(pair(cell:collisions{q = {-0.9}}) and not pair(cell:collisions{q = {-0.3}}))");
}

TEST_F(Payload, CountsInTheClearanceOfTasks) {
  run("solid.create{name = 'slab', root = {kind = 'box', x = 2, y = 2, z = 0.02}}\n"
      "cell:add_object{what = 'slab', name = 'ceiling', position = {0, 0, 0.65}}\n"
      "cell:allow_pair{a = 'block', b = 'arm.base', reason = 'not looked at here'}\n"
      "task.create{name = 'carry', steps = {{step = 'attach', object = 'block', reach = 1},\n"
      "  {step = 'move', joints = {0.8}}, {step = 'detach', object = 'block'},\n"
      "  {step = 'move', joints = {-0.5}}}}\n"
      "cell:add_task{task = 'carry', robot = 'arm'}\n"
      "r = cell:run_task{sample_time = 0.02} r:compute{quantities = {'clearance'}}\n"
      "c, q, z = r:values('clearance'), r:values('arm.q1'), r:values('block.z')\n"
      "n = 0 for i = 1, #c - 1 do if z[i + 1] ~= z[i] then n = n + 1\n"
      "  local top = 0.6 * math.sin(q[i]) + 0.2 * math.cos(q[i])  -- of the block's corner\n"
      "  assert(math.abs(c[i] - 0.65 + top) < 1e-6, i) end end\n"
      "assert(n > 20)");
}

}  // namespace
}  // namespace robomosp::lua
