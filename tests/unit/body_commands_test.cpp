// SPDX-License-Identifier: Apache-2.0
// Bodies of robots and worlds through the commands: what links weigh, what is generated, which
// pairs can be asked for, and motions that are checked in part.
#include <string>

#include <gtest/gtest.h>

#include "support/lua_program.h"

namespace robomosp::lua {
namespace {

class BodyCommands : public test::LuaProgramTest {
 protected:
  void SetUp() override {
    LuaProgramTest::SetUp();
    run("material.create{name = 'steel', density = 7850}\n"
        "block = solid.create{name = 'block', material = 'steel',\n"
        "  root = {kind = 'box', x = 0.1, y = 0.1, z = 0.1}}\n"
        "function near(a, b, eps) assert(math.abs(a - b) < (eps or 1e-9), a .. ' is not ' .. b) "
        "end\n"
        "function names(list) local out = {} for _, p in ipairs(list) do\n"
        "  out[p.a .. '+' .. p.b] = true end return out end");
  }
};

// ---- masses ----

TEST_F(BodyCommands, ALinkWeighsWhatAnObjectOfItsPartsDoes) {
  run("parts = {{what = 'block'}, {what = 'block', position = {0.05, 0, 0}}}\n"
      "pair = object.create{name = 'pair', parts = {{what = 'block', name = 'a'},\n"
      "  {what = 'block', name = 'b', position = {0.05, 0, 0}}}}\n"
      "near(pair:mass().mass, 11.775)\n"
      "arm = robot.create{name = 'arm', mass_source = 'designed', base_parts = parts,\n"
      "  links = {{name = 'one', parts = parts}, {name = 'two', joint = 'fixed', parts = parts}}}\n"
      "for _, link in ipairs{'one', 'two'} do\n"
      "  local l, o = arm:link_mass(link), pair:mass()\n"
      "  near(l.mass, 11.775) near(l.com[1], o.com[1])\n"
      "  near(l.inertia[1][1], o.inertia[1][1]) near(l.inertia[2][2], o.inertia[2][2])\n"
      "end");
}

TEST_F(BodyCommands, APartThatSumsOrIsMeasuredKeepsToItself) {
  run("sums = object.create{name = 'sums', overlap = 'sum', parts = {{what = 'block', name = "
      "'a'},\n"
      "  {what = 'block', name = 'b', position = {0.05, 0, 0}}}}\n"
      "known = solid.create{name = 'known', material = 'steel',\n"
      "  root = {kind = 'box', x = 0.1, y = 0.1, z = 0.1}}\n"
      "known:set_measured{mass = 3}\n"
      "arm = robot.create{name = 'arm', mass_source = 'designed',\n"
      "  links = {{name = 'one', parts = {{what = 'sums'}}},\n"
      "           {name = 'two', parts = {{what = 'block'}, {what = 'known'}}}}}\n"
      "near(arm:link_mass('one').mass, 15.7)\n"
      "near(arm:link_mass('two').mass, 10.85)");
}

TEST_F(BodyCommands, TheMassOfARobotHasItsBaseAndWhatIsFixedToIt) {
  run("arm = robot.create{name = 'arm', mass_source = 'designed',\n"
      "  base_parts = {{what = 'block', position = {0, 0, -0.05}}},\n"
      "  links = {{name = 'plate', joint = 'fixed', mass = 2, com = {0, 0, 0.1}},\n"
      "           {name = 'one', parts = {{what = 'block'}}}}}\n"
      "m = arm:mass()\n"
      "near(m.mass, 2 * 7.85 + 2) near(m.moving, 7.85) near(m.standing, 9.85)\n"
      "near(m.com[3], (7.85 * 0.05 + 2 * 0.1) / m.mass)\n"
      "bare = robot.create{name = 'bare', base_parts = {{what = 'block'}},\n"
      "  links = {{name = 'one', mass = 5}}}\n"
      "m = bare:mass()\n"
      "near(m.mass, 5) near(m.standing, 0)");
}

// ---- generated bodies ----

TEST_F(BodyCommands, OnePartTakesTheGeneratedBodyOfItsOwnLinkOnly) {
  run("local links = {{name = 'l1', d = 0.4, alpha = '90 deg'}, {name = 'l2', a = 0.4},\n"
      "  {name = 'l3', a = 0.4}, {name = 'l4', d = 0.1, alpha = '90 deg'},\n"
      "  {name = 'l5', d = 0.1, alpha = '-90 deg'}, {name = 'l6', d = 0.08}}\n"
      "plain = robot.create{name = 'plain', links = links}\n"
      "links[6].parts = {{what = 'block', position = {0, 0, 0.2}}}\n"
      "torch = robot.create{name = 'torch', links = links}\n"
      "local before, after = plain:checked_pairs(), torch:checked_pairs()\n"
      "assert(#before > 3 and #after >= #before, #before .. ' pairs became ' .. #after)\n"
      "local p, t = plain:skin(), torch:skin()\n"
      "assert(p.generated and not t.generated and t.base == p.base)\n"
      "for i = 1, 5 do assert(t.links[i] == p.links[i]) end\n"
      "assert(p.links[6] > 0 and t.links[6] == 0)");
}

TEST_F(BodyCommands, FramesAndHiddenLinksHaveNoBodyAndABaseGoesWithItsLinks) {
  run("r = robot.create{name = 'r', links = {\n"
      "  {name = 'slide', joint = 'prismatic', parts = {{what = 'block'}}},\n"
      "  {name = 'flange', joint = 'fixed', d = 0.3},\n"
      "  {name = 'hidden', a = 0.3, visible = false},\n"
      "  {name = 'seen', a = 0.3}}}\n"
      "local s = r:skin()\n"
      "assert(s.base == 0 and s.links[1] == 0 and s.links[2] == 0 and s.links[3] == 0)\n"
      "assert(s.links[4] > 0)");
}

TEST_F(BodyCommands, ABodyWithoutShapeIsReported) {
  run("r = robot.create{name = 'r', links = {{name = 'slide', joint = 'prismatic', lower = 0,\n"
      "  upper = 1, parts = {{what = 'block'}}}, {name = 'hidden', a = 0.3, visible = false}}}\n"
      "nothing = object.create{name = 'nothing'}\n"
      "cell = world.create{name = 'cell'}\n"
      "cell:add_robot{robot = r, name = 'r', q = {0.5, 0}}\n"
      "cell:add_object{what = 'nothing', name = 'ghost'}\n"
      "cell:add_object{what = 'block', name = 'wall', position = {3, 0, 0}}\n"
      "local c = cell:check_path{path = {{0, 0}, {1, 0}}}\n"
      "assert(c.is_free and #c.shapeless == 3)\n"
      "local found = {} for _, n in ipairs(c.shapeless) do found[n] = true end\n"
      "assert(found.ghost and found['r.base'] and found['r.hidden'])");
}

// ---- pairs ----

TEST_F(BodyCommands, AForbiddenPairOfObjectsIsChecked) {
  run("cell = world.create{name = 'cell'}\n"
      "cell:add_object{what = 'block', name = 'a'}\n"
      "cell:add_object{what = 'block', name = 'b', position = {0.05, 0, 0}}\n"
      "cell:add_object{what = 'block', name = 'c', position = {0.35, 0, 0}}\n"
      "assert(#cell:checked_pairs() == 0 and #cell:collisions() == 0)\n"
      "cell:forbid_pair('a', 'b')\n"
      "cell:forbid_pair('b', 'c')\n"
      "assert(#cell:checked_pairs() == 2)\n"
      "local hits = names(cell:collisions())\n"
      "assert(hits['a+b'] and not hits['b+c'])\n"
      "near(cell:clearance().distance, -0.05)\n"
      "local d = cell:distances()\n"
      "assert(#d == 2) near(d[2].distance, 0.2)\n"
      "cell:forget_pair('a', 'b')\n"
      "assert(#cell:checked_pairs() == 1)");
}

TEST_F(BodyCommands, AnyTwoBodiesCanBeAskedFor) {
  run("cell = world.create{name = 'cell'}\n"
      "cell:add_object{what = 'block', name = 'a'}\n"
      "cell:add_object{what = 'block', name = 'b', position = {0.05, 0, 0}}\n"
      "r = robot.create{name = 'r', links = {{name = 'slide', joint = 'prismatic', lower = 0,\n"
      "  upper = 1, parts = {{what = 'block'}}}, {name = 'next', joint = 'prismatic', lower = 0,\n"
      "  upper = 1, parts = {{what = 'block', position = {0, 0, 0.05}}}}}}\n"
      "cell:add_robot{robot = r, name = 'r', position = {1, 0, 0}}\n"
      "assert(#cell:collisions{a = 'a', b = 'b'} == 1)\n"
      "near(cell:distances{a = 'b', b = 'a'}[1].distance, -0.05)\n"
      "local d = cell:distances{a = 'r.slide', b = 'a', q = {0.2, 0}}\n"
      "assert(#d == 1) near(d[1].distance, math.sqrt(0.9^2 + 0.1^2))\n"
      "assert(#cell:distances{a = 'r', b = 'a'} == 2)\n"
      "assert(#cell:distances{a = 'a'} == 3)\n"
      // Neighbours are passed over, and still answer.
      "assert(#r:self_collisions() == 0 and #r:self_collisions{a = 'slide', b = 'next'} == 1)");
  EXPECT_NE(eval("cell:distances{a = 'a', b = 'nobody'}").find("nobody"), std::string::npos);
  EXPECT_NE(eval("cell:distances{a = 'a', b = 'a'}").find("the same body"), std::string::npos);
}

// ---- collision shapes ----

TEST_F(BodyCommands, DistancesOfConesAndPolyhedraAreExact) {
  run("cone = solid.create{name = 'cone', root = {kind = 'cone', base_radius = 0.2,\n"
      "  top_radius = 0.05, height = 0.3}}\n"
      "roof = solid.create{name = 'roof', root = {kind = 'pyramid', sides = 3, radius = 0.1,\n"
      "  top_radius = 0.1, height = 0.37}}\n"
      "ball = solid.create{name = 'ball', root = {kind = 'sphere', radius = 0.1}}\n"
      "cell = world.create{name = 'cell'}\n"
      "cell:add_object{what = 'cone', name = 'cone'}\n"
      "cell:add_object{what = 'ball', name = 'ball', position = {0.5, 0.3, 0.25}}\n"
      "local r, s = math.sqrt(0.5^2 + 0.3^2), math.sqrt(0.3^2 + 0.15^2)\n"
      // The side runs from (0.2, 0) to (0.05, 0.3).
      "local want = ((r - 0.2) * 0.3 + 0.25 * 0.15) / s - 0.1\n"
      "near(cell:distances{a = 'cone', b = 'ball'}[1].distance, want, 1e-12)\n"
      "cell:add_object{what = 'roof', name = 'roof', position = {0, 0, 1}}\n"
      "near(cell:distances{a = 'roof', b = 'cone'}[1].distance, 0.7, 1e-12)\n"
      "cell:add_object{what = 'ball', name = 'far', position = {0, 0, 1.37 + 0.4}}\n"
      "near(cell:distances{a = 'roof', b = 'far'}[1].distance, 0.3, 1e-12)");
}

// ---- checks of motions ----

TEST_F(BodyCommands, ACheckGoesOnWithLimitsAndContactWhereOneSampleIsOutOfReach) {
  run("lift = robot.create{name = 'lift', links = {{name = 'rail', joint = 'prismatic', lower = "
      "0,\n"
      "  upper = 1, max_velocity = 0.45, parts = {{what = 'block'}}}}}\n"
      "cell = world.create{name = 'cell'}\n"
      "cell:add_robot{robot = lift, name = 'lift'}\n"
      "cell:add_object{what = 'block', name = 'beam', position = {0, 0, 0.5}}\n"
      "trajectory.create{name = 'up', sample_time = 0.1, segments = {{shape = 'line', points = \n"
      "  {{0, 0, 0, 0, 0, 0}, {0, 0, 2, 0, 0, 0}}, speed = 0.5}}}\n"
      "cell:add_trajectory{trajectory = 'up'}\n"
      "local c = cell:check{robot = 'lift', trajectory = 'up', collisions = true}\n"
      "local kinds = {}\n"
      "for _, f in ipairs(c.faults) do kinds[f.kind] = f end\n"
      "assert(kinds.unreachable and kinds.limit and kinds.collision, #c.faults)\n"
      "near(kinds.limit.excess, 0.05, 1e-6)\n"
      "assert(kinds.limit.last <= 21 and kinds.collision.a ~= kinds.collision.b)\n"
      "assert(kinds.collision.from > 0.7 and kinds.collision.to < 1.3)");
}

// ---- contact physics at its limits ----

class PhysicsLimits : public BodyCommands {
 protected:
  void SetUp() override {
    BodyCommands::SetUp();
    run("solid.create{name = 'floor', root = {kind = 'box', x = 40, y = 40, z = 0.1}}\n"
        "cell = world.create{name = 'cell'}\n"
        "cell:add_object{what = 'floor', name = 'floor', position = {0, 0, -0.1}}\n"
        "function fails(args, ...)\n"
        "  local ok, why = pcall(cell.simulate_physics, cell, args)\n"
        "  assert(not ok, 'it ran')\n"
        "  why = tostring(why)\n"
        "  for _, part in ipairs{...} do assert(why:find(part, 1, true), part .. ' in: ' .. why) "
        "end\n"
        "end");
  }
};

TEST_F(PhysicsLimits, StacksThatTouchFromTheStartStayWhereTheyAre) {
  run("for i = 0, 19 do for k = 0, 2 do\n"
      "  cell:add_object{what = 'block', name = 'b' .. i .. '_' .. k, position = {0.3 * i, 0, 0.1 "
      "* "
      "k}}\n"
      "end end\n"
      "local r = cell:simulate_physics{duration = 0.3}\n"
      "for i = 0, 19 do for k = 0, 2 do\n"
      "  local name = 'b' .. i .. '_' .. k\n"
      "  local x, z = r:values(name .. '.x'), r:values(name .. '.z')\n"
      "  near(x[#x], 0.3 * i, 1e-3) near(z[#z], 0.1 * k, 1e-3)\n"
      "end end");
}

TEST_F(PhysicsLimits, OverlappingBoxesByTheHundredAreRefusedWithTheLimit) {
  run("for i = 1, 600 do cell:add_object{what = 'block', name = 'b' .. i,\n"
      "  position = {0.0001 * i, 0.00007 * i, 0.00003 * i}} end\n"
      "local t = os.clock()\n"
      "fails({duration = 0.1}, 'contacts', 'the maximum per step')\n"
      "fails({duration = 0.1, engine = {name = 'ode', params = {solver = 'sweeps'}}}, '20000')\n"
      "assert(os.clock() - t < 20, 'it took ' .. os.clock() - t .. ' s')");
}

TEST_F(PhysicsLimits, FarFastAndHeavyBodiesEndTheRunByName) {
  run("cell:add_object{what = 'block', name = 'near', position = {0, 0, 0.5}}\n"
      "cell:add_object{what = 'block', name = 'stray', position = {0, 1, 0.5}}\n"
      "local function at(v) return {duration = 0.05, objects = {{name = 'stray', velocity = v}}} "
      "end\n"
      "fails(at{0, 0, 1e8}, 'stray')\n"
      "fails(at{0, 0, 1e300}, 'stray')\n"
      "fails({duration = 0.05, objects = {{name = 'stray', angular_velocity = {1e9, 0, 0}}}}, "
      "'stray')\n"
      // It leaves during the run.
      "fails({duration = 2, step = 0.1, sample_time = 0.1,\n"
      "  objects = {{name = 'stray', velocity = {0, 0, 9.9e6}}}}, 'stray', 't = ')\n"
      "fails({duration = 1e12, step = 1e10, sample_time = 1e10}, 'step')\n"
      "cell:add_object{what = 'block', name = 'gone', position = {1e9, 0, 0}}\n"
      "fails({duration = 0.05}, 'gone')\n"
      "cell:remove_member('gone')\n"
      "material.create{name = 'neutronium', density = 1e30}\n"
      "solid.create{name = 'heavy', material = 'neutronium', root = {kind = 'box', x = 0.1, y = "
      "0.1,\n"
      "  z = 0.1}}\n"
      "cell:add_object{what = 'heavy', name = 'heavy', position = {0, 0, 1}}\n"
      "fails({duration = 0.05}, 'heavy', 'kg')");
}

TEST_F(PhysicsLimits, StiffGainsEndTheRunWithASentence) {
  // The gains are in N m/rad here: far beyond what a step of 10 ms can follow.
  run("cell:add_robot{robot = robot 'puma560', name = 'puma', position = {0, 0, 1}}\n"
      "local function drive(controller, step, gain)\n"
      "  return pcall(cell.simulate_physics, cell, {duration = 0.5, step = step, robots = {\n"
      "    {name = 'puma', drive = 'controlled', controller = {name = controller,\n"
      "      params = {kp = {gain}, kd = {gain}}}}},\n"
      "    actions = {{action = 'move', q = {1, 0.5, -1, 0.5, 0.5, 0.5}, duration = 0.2}}})\n"
      "end\n"
      "local ended = 0\n"
      "for _, controller in ipairs{'computed_torque', 'pd_gravity', 'joint_pid'} do\n"
      "  for _, gain in ipairs{1e3, 1e6, 1e12} do\n"
      "    local ok, why = drive(controller, 0.01, gain)\n"
      "    if not ok then\n"
      "      ended, why = ended + 1, tostring(why)\n"
      "      assert(why:find('puma', 1, true) and why:find('t = ', 1, true), why)\n"
      "    end\n"
      "  end\n"
      "end\n"
      "assert(ended > 3, ended)");
}

}  // namespace
}  // namespace robomosp::lua
