// SPDX-License-Identifier: Apache-2.0
// Tools attached to robots: body, mass, centre points and collisions change together. Against
// closed forms of an arm without mass that turns in the plane of x and z, and of the library's own
// numbers.
#include <filesystem>
#include <string>

#include <gtest/gtest.h>

#include "support/lua_program.h"

namespace robomosp::lua {
namespace {

/// An arm of 0.5 m whose joint turns x towards z (gravity along -z of its mounting), with a torch
/// of one cylinder of 8000 kg/m^3, and a pen of another.
class AttachedTools : public test::LuaProgramTest {
 protected:
  void SetUp() override {
    LuaProgramTest::SetUp();
    run("material.create{name = 'metal', density = 8000}\n"
        "barrel = solid.create{name = 'barrel', material = 'metal', parameters = {bore = '10 "
        "mm'},\n"
        "  root = {kind = 'difference', children = {{kind = 'cylinder', radius = 0.01, height = "
        "0.2},\n"
        "  {kind = 'cylinder', name = 'hole', radius = 'bore/2', height = 0.2}}}}\n"
        "torch = object.create{name = 'torch', parts = {{what = 'barrel'}}, parameters = {stick = "
        "'15 mm'},\n"
        "  tcps = {{name = 'tip', position = {0, 0, '200 mm + stick'}, rpy = {0, '30 deg', 0}}, "
        "{name "
        "= 'rim', position = {0, 0, 0.2}}}}\n"
        "shaft = solid.create{name = 'shaft', material = 'metal', root = {kind = 'cylinder', "
        "radius "
        "= 0.005, height = 0.1}}\n"
        "pen = object.create{name = 'pen', parts = {{what = 'shaft'}}, tcps = {{name = 'point', "
        "position = {0, 0, 0.1}}}}\n"
        "bare = solid.create{name = 'bare', root = {kind = 'sphere', radius = 0.02}}\n"
        // Its last link's frame: x along the arm. The tool frame's z is the arm's x.
        "arm = robot.create{name = 'arm', tool = {0, 0, 0, 0, math.pi / 2, 0}, links = {{name = "
        "'swing', a = 0.5}},\n"
        "  base = {0, 0, 0, math.pi / 2, 0, 0}}\n"
        "function near(a, b, e) assert(math.abs(a - b) <= (e or 1e-12), tostring(a) .. ' is not ' "
        ".. tostring(b)) end\n"
        "g = 9.81");
  }
};

TEST_F(AttachedTools, BringBodyMassAndCentrePoints) {
  run("near(arm:mass().mass, 0)\n"
      "assert(arm:attach{tool = torch} == 'torch')\n"
      "m = math.pi * (0.01^2 - 0.005^2) * 0.2 * 8000\n"
      "near(arm:mass().mass, m)\n"
      // The torch's z is the arm's x, so that its centre of mass is 0.6 m from the joint.
      "for _, q in ipairs{0, 0.7, -2} do near(arm:gravity_torques{q = {q}}[1], m * g * 0.6 * "
      "math.cos(q), 1e-11) end\n"
      "p = arm:fk{q = {0.3}}.position\n"
      "near(p[1], 0.715 * math.cos(0.3)) near(p[2], 0) near(p[3], 0.715 * math.sin(0.3))\n"
      "p = arm:fk{q = {0.3}, tip = 'torch.rim'}.position near(p[1], 0.7 * math.cos(0.3))\n"
      "p = arm:fk{q = {0.3}, tip = 'torch'}.position near(p[1], 0.5 * math.cos(0.3))\n"
      // Its tip turns by 30 degrees about y of the flange, which is y of the arm's last frame.
      "z = arm:fk{q = {0}}.pose\n"
      "near(z[1][3], math.cos(math.pi / 6)) near(math.abs(z[2][3]), 0.5)");
  run("t = arm:tools() assert(#t == 4 and t[1].tcp == 'torch.tip' and t[2].name == 'torch' and "
      "t[2].what == 'torch')\n"
      "near(t[2].payload.mass, m) assert(t[3].name == 'torch.tip' and t[4].name == 'torch.rim')\n"
      "near(t[1].placement.position[1], 0.215)\n"
      "near(arm:tool{tool = 'torch.rim'}.position[1], 0.2)\n"
      "assert(arm:overview():find('torch on swing', 1, true) and arm:overview():find('torch.tip', "
      "1, "
      "true))");
}

TEST_F(AttachedTools, FollowEditsOfWhatTheyAreMadeOf) {
  run("arm:attach{tool = torch}\n"
      "before = arm:gravity_torques{q = {0}}[1]\n"
      "barrel:set_parameter('bore', '16 mm')\n"
      "near(arm:gravity_torques{q = {0}}[1], math.pi * (0.01^2 - 0.008^2) * 0.2 * 8000 * g * 0.6, "
      "1e-11)\n"
      "document.undo() near(arm:gravity_torques{q = {0}}[1], before)\n"
      "torch:set_parameter('stick', '35 mm')\n"
      "near(arm:fk{q = {0}}.position[1], 0.735)\n"
      "near(arm:gravity_torques{q = {0}}[1], before)\n"
      "torch:set('tcps.tip.position.z', 0.3) near(arm:fk{q = {0}}.position[1], 0.8)\n"
      "barrel:set('material', material.create{name = 'lead', density = 16000})\n"
      "near(arm:gravity_torques{q = {0}}[1], 2 * before, 1e-11)\n"
      // A measured mass counts instead.
      "torch:set_measured{mass = 3, com = {0, 0, 0.1}}\n"
      "near(arm:gravity_torques{q = {0}}[1], 3 * g * 0.6, 1e-11)");
}

TEST_F(AttachedTools, ChangeTogetherAndAreOneStepOfUndo) {
  run("arm:attach{tool = torch}\n"
      "m1, steps = arm:mass().mass, #document.history().undo\n"
      "assert(arm:change_tool{tool = pen} == 'pen.point')\n"
      "assert(#document.history().undo == steps + 1)\n"
      "m2 = math.pi * 0.005^2 * 0.1 * 8000\n"
      "near(arm:mass().mass, m2) near(arm:fk{q = {0}}.position[1], 0.6)\n"
      "near(arm:gravity_torques{q = {0}}[1], m2 * g * 0.55, 1e-11)\n"
      "document.undo() near(arm:mass().mass, m1) near(arm:fk{q = {0}}.position[1], 0.715)\n"
      "document.redo() near(arm:mass().mass, m2) document.undo()\n"
      "assert(arm:change_tool{tcp = 'rim'} == 'torch.rim') near(arm:fk{q = {0}}.position[1], 0.7)\n"
      "assert(arm:change_tool{tcp = false} == 'tool') near(arm:fk{q = {0}}.position[1], 0.5)\n"
      "near(arm:mass().mass, m1)\n"
      "arm:change_tool{tcp = 'torch.tip'} arm:detach() near(arm:mass().mass, 0)\n"
      "near(arm:fk{q = {0}}.position[1], 0.5) assert(#arm:tools() == 1)");
}

TEST_F(AttachedTools, TwoAtATimeKeepTheirPlacesAndOneLeads) {
  run("arm:attach{tool = torch}\n"
      "arm:attach{tool = pen, name = 'marker', position = {0, 0.1, 0}}\n"
      "near(arm:fk{q = {0}}.position[1], 0.715)\n"  // the first one goes on leading
      "p = arm:fk{q = {0}, tip = 'marker.point'}.position\n"
      "near(p[1], 0.5) near(math.abs(p[2]), 0.1) near(math.abs(p[3]), 0.1, 1e-12)\n"
      "near(arm:mass().mass, torch:mass().mass + pen:mass().mass)\n"
      "assert(arm:change_tool{tcp = 'marker.point'} == 'marker.point')\n"
      "arm:detach('torch') near(arm:mass().mass, pen:mass().mass)\n"
      "arm:set_tool{tool = 'marker', position = {0.2, 0, 0}, rpy = {0, math.pi / 2, 0}}\n"
      "near(arm:fk{q = {0}}.position[1], 0.8)");
}

TEST_F(AttachedTools, CollideAsAPartOfTheirLink) {
  run("cell = world.create{name = 'cell'}\n"
      "cell:add_robot{robot = 'arm', q = {0}}\n"
      "cell:add_object{what = 'bare', name = 'lamp', position = {0.69, 0, 0}}\n"
      "assert(#cell:collisions() == 0)\n"
      "arm:attach{tool = torch}\n"
      "hit = cell:collisions() assert(#hit == 1 and hit[1].b == 'arm.swing')\n"
      "assert(#arm:self_collisions() == 0)\n"  // the torch is in the flange
      "assert(#cell:collisions{q = {arm = {0.5}}} == 0)\n"
      "arm:change_tool{tool = pen} assert(#cell:collisions() == 0)\n"
      // A sphere's surface is 0.67 m from the joint, the pen ends at 0.6 m.
      "near(cell:clearance{exact = true}.distance, 0.07, 1e-6)\n"
      "document.undo() assert(#cell:collisions() == 1)");
}

TEST_F(AttachedTools, AreSavedAndLoaded) {
  const auto folder = std::filesystem::temp_directory_path() / "robomosp_attached_tools";
  std::filesystem::create_directories(folder);
  run("folder = '" + folder.string() + "/'\n" +
      "arm:attach{tool = torch, position = {'10 mm', 0, 0}}\n"
      "arm:attach{tool = bare, link = 'base', name = 'lamp'}\n"
      "before = arm:describe() x = arm:fk{q = {0.2}}.position m = arm:mass().mass\n"
      "for _, r in ipairs{material.get('metal')} do r:save(folder .. 'metal.mtr') end\n"
      "barrel:save(folder .. 'barrel.csg') bare:save(folder .. 'bare.csg')\n"
      "torch:save(folder .. 'torch.part') arm:save(folder .. 'arm.rbt')\n"
      "document.clear()\n"
      "again = robot.load(folder .. 'arm.rbt') y = again:fk{q = {0.2}}.position\n"
      "for k = 1, 3 do assert(x[k] == y[k]) end\n"
      "assert(again:mass().mass == m and #again:tools() == 5)\n"
      "assert(again:tools()[1].tcp == 'torch.tip')\n"
      "object.get('torch'):set_parameter('stick', '35 mm')\n"  // expressions of centre points stay
      "near(again:tool{tool = 'torch.tip'}.position[3] - 0, 0.235)");
  std::filesystem::remove_all(folder);
}

TEST_F(AttachedTools, SayWhatIsWrong) {
  const auto says = [&](const std::string& code, const std::string& what) {
    EXPECT_NE(eval(code).find(what), std::string::npos) << code << "\n" << eval(code);
  };
  says("arm:detach()", "nothing is attached to it");
  says("arm:change_tool{tool = pen}", "nothing is attached to it");
  says("arm:attach{tool = 'nothing'}", "nothing");
  says("arm:attach{tool = torch, tcp = 'tipp'}", "tip");
  says("arm:attach{tool = pen, tcp = 5}", "tcp: 5 is not ");
  says("arm:attach{tool = torch, link = 'base', tcp = 'tip'}", "not on the last link");
  says("arm:attach{tool = torch, name = 'swing'}", "two links or tools named");
  says("arm:attach{tool = torch, name = 'a.b'}", "dot");
  says("arm:attach{tool = torch, position = {0, 0, 1e300}}", "a coordinate of the attached tool");
  says("arm:attach{tool = torch, position = {0, 0, 0/0}}", "finite");
  run("assert(#arm:tools() == 1)  -- nothing of that was done\n"
      "arm:attach{tool = torch}");
  says("arm:attach{tool = torch}", "named \"torch\"");
  says("arm:set_tool{position = {0, 0, 1}}", "torch.tip");
  says("transform.set('arm.tool', 'P3', 1)", "torch.tip");
  says("arm:remove_tool('torch')", "robot.detach");
  says("arm:change_tool{}", "neither tool nor tcp");
  says("arm:change_tool{tcp = 'nose'}", "nose");
  says("arm:change_tool{tcp = 'rim', name = 'x'}", "name is for a tool being mounted");
  says("torch:remove_tcp('tip')", "is the tool of robot \"arm\"");
  says("torch:remove()", "arm");
  says("torch:add_tcp{name = 'tip'}", "two tool centre points");
  says("torch:add_tcp{name = 'a.b'}", "dot");
  says("torch:add_tcp{name = 'far', position = {0, 0, 1e300}}",
       "a coordinate of tool centre point");
  says("torch:add_tcp{name = 'far', position = {0, 0, 0/0}}", "finite");
  says("arm:add_link{name = 'more'}", "not on the last link");
  says("arm:fk{q = {0}, tip = 'torch.tipp'}", "torch.tip");
  // A centre point that is gone by another way is named by whatever asks for it.
  run("record.set{id = torch, path = 'tcps.tip.name', value = 'wire'}");
  says("arm:fk{q = {0}}", "no longer exists");
  says("arm:tools()", "no longer exists");
  run("arm:change_tool{tcp = 'wire'} near(arm:fk{q = {0}}.position[1], 0.715)");
}

TEST_F(AttachedTools, WithoutMassAreToldOf) {
  run("function told() local n = 0 for _, m in ipairs(message.list{severity = 'warning'}) do\n"
      "  if m.code == 'tool_without_mass' then n = n + 1 end end return n end\n"
      "before = told() arm:attach{tool = bare} assert(told() == before + 1)\n"
      "arm:attach{tool = torch, link = 'swing', tcp = false} arm:detach('torch') "
      "assert(told() == before + 1)\n"
      "near(arm:mass().mass, 0) near(arm:fk{q = {0}}.position[1], 0.5)\n"
      "assert(arm:tools()[1].tcp == nil)  -- a solid has no centre point, so nothing is led by it\n"
      "assert(arm:change_tool{tcp = 'bare'} == 'bare')");
}

TEST_F(AttachedTools, AreChangedInTasks) {
  // Two joints in the plane, and a hook where its flange comes to.
  run("two = robot.create{name = 'two', links = {{name = 'upper', a = 0.3, max_velocity = 2, "
      "max_acceleration = 8, max_jerk = 100},\n"
      "  {name = 'fore', a = 0.2, max_velocity = 2, max_acceleration = 8, max_jerk = 100}}}\n"
      "hook = object.create{name = 'hook', parts = {{what = 'shaft'}}, tcps = {{name = 'end', "
      "position = {0.1, 0, 0}}}}\n"
      "cell = world.create{name = 'cell'}\n"
      "cell:add_robot{robot = 'two', q = {0, 0.5}}\n"
      "at = two:fk{q = {0.6, 0.4}}.pose\n"
      "cell:add_object{what = 'hook', name = 'hook', placement = at}\n"
      "task.create{name = 'job', steps = {{step = 'move', joints = {0.6, 0.4}},\n"
      "  {step = 'attach', object = 'hook', tcp = 'end'},\n"
      "  {step = 'move', joints = {0.3, 0.5}},\n"
      "  {step = 'move', joints = {0.6, 0.4}}, {step = 'detach', object = 'hook'},\n"
      "  {step = 'move', joints = {0, 0.5}}}}\n"
      "cell:add_task{task = 'job', robot = 'two'}\n"
      "run = cell:run_task{sample_time = 0.01}\n"
      "assert(#run:notes() == 2)\n"
      "assert(task.get('job'):steps()[2].tcp == 'end')");
  const std::string bad = eval(
      "task.create{name = 'bad', steps = {{step = 'attach', object = 'hook', tcp = 'endd'}}}\n"
      "cell:add_task{task = 'bad', robot = 'two'}\n cell:run_task{task = 'bad'}");
  EXPECT_NE(bad.find("no tool centre point \"endd\""), std::string::npos) << bad;
}

TEST_F(AttachedTools, HeldObjectsLeadByTheirCentrePoints) {
  // An arm of six joints takes a torch and draws a line with its tip; the tip's place is that of
  // the object in the recording, turned by its own pose: the other way than kinematics takes.
  run("ur = robot.get('ur5')\n"
      "cell = world.create{name = 'cell'} start = {0.1, -1.2, 1.4, -1.8, -1.5, 0.2}\n"
      "cell:add_robot{robot = ur, q = start}\n"
      "cell:add_object{what = 'torch', name = 'torch', placement = ur:fk{q = start}.pose}\n"
      "for j = 1, 6 do ur:set_link{link = j, max_velocity = 2, max_acceleration = 10} end\n"
      "tip = spatial.compose(ur:fk{q = start}.pose, {0, 0, 0.215, 0, math.pi / 6, 0}).pose\n"
      "to = spatial.compose({0.05, 0.06, -0.04, 0, 0, 0}, tip).pose\n"
      "task.create{name = 'draw', steps = {{step = 'attach', object = 'torch', tcp = 'tip'},\n"
      "  {step = 'move', target = to, path = 'straight', tool_speed = 0.1}}}\n"
      "cell:add_task{task = 'draw', robot = 'ur5'}\n"
      "r = cell:run_task{sample_time = 0.05}\n"
      "n = #r:values('time')\n"
      "function at(i) return {position = {r:values('torch.x')[i], r:values('torch.y')[i], "
      "r:values('torch.z')[i]},\n"
      "  quaternion = {r:values('torch.qw')[i], r:values('torch.qx')[i], r:values('torch.qy')[i], "
      "r:values('torch.qz')[i]}} end\n"
      "assert(n > 5)\n"
      "for i = 1, n do\n"
      "  local p = spatial.compose(at(i), {0, 0, 0.215, 0, 0, 0}).pose\n"
      "  local d = {p[1][4] - tip[1][4], p[2][4] - tip[2][4], p[3][4] - tip[3][4]}\n"
      "  local s = d[1] / 0.05\n"  // on the line of (0.05, 0.06, -0.04)
      "  near(d[2], s * 0.06, 1e-5) near(d[3], -s * 0.04, 1e-5) if i == n then near(s, 1, 1e-5) "
      "end end");
  // Once it is let go the robot's own tool leads again.
  run("to = spatial.compose({0.03, 0, -0.02, 0, 0, 0}, ur:fk{q = start}.pose).pose\n"
      "task.create{name = 'after', steps = {{step = 'attach', object = 'torch', tcp = 'tip'}, "
      "{step "
      "= 'detach', object = 'torch'},\n"
      "  {step = 'move', target = to, path = 'straight', tool_speed = 0.1}}}\n"
      "r = cell:run_task{task = cell:add_task{task = 'after', robot = 'ur5'}, sample_time = 0.05}\n"
      "q = {} for j = 1, 6 do local v = r:values('ur5.q' .. j) q[j] = v[#v] end\n"
      "for k = 1, 3 do near(ur:fk{q = q}.position[k], to[k][4], 1e-6) end");
}

TEST_F(AttachedTools, GoIntoUrdfWithMassAndFrames) {
  const auto file = std::filesystem::temp_directory_path() / "robomosp_attached.urdf";
  run("six = robot.get('ur5'):duplicate{name = 'six'}\n"
      "six:attach{tool = torch}\n"
      "done = six:export_urdf{file = '" +
      file.string() +
      "', bodies = false}\n"
      "back = import{file = done.file, name = 'back'}[1]\n"
      "q = {0.1, -1.2, 1.4, -1.8, -1.5, 0.2}\n"
      "a, b = six:gravity_torques{q = q}, back:gravity_torques{q = q}\n"
      "for j = 1, 6 do near(a[j], b[j], 1e-9) end\n"
      "a, b = six:fk{q = q, tip = 'torch.rim'}.position, back:fk{q = q, tip = "
      "'torch_rim'}.position  -- names of URDF have no dots\n"
      "for k = 1, 3 do near(a[k], b[k], 1e-9) end\n"
      "said = false for _, n in ipairs(done.notes) do said = said or n:find('Attached tools', 1, "
      "true) end assert(said)");
  std::filesystem::remove(file);
}

// Centred or not, a primitive is the same element of URDF, whose origins are centres.
TEST_F(AttachedTools, CentredPrimitivesGoIntoUrdfWithTheirCentre) {
  const auto file = std::filesystem::temp_directory_path() / "robomosp_centred.urdf";
  run("function origins(nodes)\n"
      "  local parts = {}\n"
      "  for i, root in ipairs(nodes) do\n"
      "    solid.create{name = 'piece' .. i, root = root} parts[i] = {what = 'piece' .. i}\n"
      "  end\n"
      "  local r = robot.create{name = 'one', links = {{name = 'arm', a = 0.1, parts = parts}}}\n"
      "  os.remove('" +
      file.string() + "') r:export_urdf{file = '" + file.string() +
      "'}\n"
      "  local f = io.open('" +
      file.string() +
      "') local text = f:read('a') f:close()\n"
      "  local found = {}\n"
      "  for kind, origin, shape in text:gmatch('<(%a+)[^<]*>%s*<origin ([^>]*)/>%s*<geometry>%s*"
      "<([bcs][^>]*)/>') do\n"
      "    found[#found + 1] = kind .. ' ' .. origin .. ' ' .. shape\n"
      "  end\n"
      "  document.undo() for i = 1, #nodes do document.undo() end\n"
      "  assert(#found > 0, text) return table.concat(found, '; ')\n"
      "end\n"
      "a = origins{{kind = 'box', x = 0.1, y = 0.2, z = 0.3, position = {0.1, 0, 0.2}, centred = "
      "true},\n"
      "  {kind = 'cylinder', radius = 0.1, height = 0.4, position = {0.2, 0, 0}, centred = true}}\n"
      "b = origins{{kind = 'box', x = 0.1, y = 0.2, z = 0.3, position = {0.1, 0, 0.05}},\n"
      "  {kind = 'cylinder', radius = 0.1, height = 0.4, position = {0.2, 0, -0.2}}}\n"
      "assert(a == b, a .. ' is not ' .. b)\n");
  std::filesystem::remove(file);
}

TEST_F(AttachedTools, OfTheLibraryHaveMassesAndCentrePoints) {
  app().document.clear();
  run("least = {mig_torch_22 = 0.6, mig_torch_45 = 0.6, parallel_gripper = 0.8, angular_gripper = "
      "0.4, three_jaw_gripper = 0.8,\n"
      "  suction_cup = 0.1, suction_four = 0.5, milling_spindle = 4, pen = 0.1, camera = 0.1}\n"
      "for name, from in pairs(least) do\n"
      "  local t = object.get(name) local m = t:mass()\n"
      "  assert(m.mass > from and m.mass < 3 * from, name .. ' weighs ' .. m.mass)\n"
      "  assert(m.relative_error < 1e-3, name)\n"
      "  assert(#t:tcps() >= 1 and t:tcps()[1].position[3] > m.com[3], name)\n"
      "  local r = robot.get('ur5'):duplicate{name = 'with_' .. name}\n"
      "  local before = r:mass().mass\n"
      "  r:attach{tool = t} near(r:mass().mass, before + m.mass, 1e-9)\n"
      "end\n"
      // The neck's angle moves wire and tip and turns it.
      "t = object.get('mig_torch_22') t:set_parameter('neck', '90 deg')\n"
      "near(t:tcps()[1].position[1], 0.131) near(t:tcps()[1].position[3], 0.2)\n"
      "g = object.get('parallel_gripper') g:set_parameter('opening', '10 mm')\n"
      "near(g:describe().parts[5].placement.position[1], 0.005)");
}

}  // namespace
}  // namespace robomosp::lua
