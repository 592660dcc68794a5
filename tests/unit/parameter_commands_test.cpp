// SPDX-License-Identifier: Apache-2.0
// Parameters from the console: every command that takes numbers takes expressions, what depends on
// a parameter follows it down to the torques of a robot, and faults are reported in one sentence.
#include <filesystem>
#include <string>

#include <gtest/gtest.h>

#include <robomosp/sdk/csg_primitive.h>

#include "ioci/core/commands.h"
#include "lua/lua_state.h"
#include "support/program.h"

namespace robomosp::lua {
namespace {

class Parameters : public test::ProgramTest {
 protected:
  void SetUp() override {
    ProgramTest::SetUp();
    state_ = std::make_unique<LuaState>(app(), session_, LuaOptions{});
  }
  std::string eval(std::string_view code) {
    auto r = state_->eval(code);
    return r.ok() ? *r : r.error().sentence();
  }
  /// Runs code that ends with asserts of its own.
  void run(std::string_view code) {
    auto r = state_->eval(code);
    EXPECT_TRUE(r.ok()) << (r.ok() ? "" : r.error().sentence());
  }
  ioci::Session session_{"test"};
  std::unique_ptr<LuaState> state_;
};

/// A solid with parameters, in an object, on a robot, whose world gives the bore.
const char* const kChain = R"~(
material.create{name = "steel", density = 7850}
cell = world.create{name = "cell", parameters = {bore = "20 mm"}}
bush = solid.create{name = "bush", material = "steel",
  parameters = {bore = "cell.bore", wall = {value = "bore/4 + 2 mm", description = "around it"}},
  root = {kind = "difference", name = "body", children = {
    {kind = "cylinder", name = "outer", radius = "bore/2 + wall", height = "30 mm"},
    {kind = "cylinder", name = "hole", radius = "bore/2", height = "40 mm", position = {0, 0, "-wall"}}}}}
pair = object.create{name = "pair", parameters = {gap = "2*cell.bore + 10 mm"}, parts = {
  {what = "bush", name = "left"}, {what = "bush", name = "right", position = {"gap", 0, 0}}}}
arm = robot.create{name = "arm", mass_source = "designed", parameters = {reach = "10*cell.bore"},
  links = {{a = "reach", alpha = "90 deg"},
           {a = "2*reach", parts = {{what = "pair", position = {"-reach/2", 0, 0}}}}}}
function twin(bore)
  local wall = bore / 4 + 0.002
  local s = solid.create{name = "bush2", material = "steel", root = {kind = "difference", children = {
    {kind = "cylinder", radius = bore / 2 + wall, height = 0.03},
    {kind = "cylinder", radius = bore / 2, height = 0.04, position = {0, 0, -wall}}}}}
  local o = object.create{name = "pair2", parts = {
    {what = s, name = "left"}, {what = s, name = "right", position = {2 * bore + 0.01, 0, 0}}}}
  local reach = 10 * bore
  local r = robot.create{name = "arm2", mass_source = "designed", links = {
    {a = reach, alpha = math.pi / 2}, {a = 2 * reach, parts = {{what = o, position = {-reach / 2, 0, 0}}}}}}
  local mass, both = s:mass().mass, o:mass().mass
  local tau = r:inverse_dynamics{q = {0.3, -0.7}, qd = {0.5, 1}, qdd = {-2, 3}}
  r:remove() o:remove() s:remove()
  return mass, both, tau
end
function close(a, b) return math.abs(a - b) <= 1e-12 * math.abs(b) end
want = {}  -- beforehand, so that undo meets the steps of the test alone
for _, bore in ipairs{0.02, 0.025, 0.032} do want[bore] = {twin(bore)} end
function check(bore)
  local mass, both, tau = table.unpack(want[bore])
  assert(close(bush:mass().mass, mass), "solid")
  assert(close(pair:mass().mass, both), "object")
  local got = arm:inverse_dynamics{q = {0.3, -0.7}, qd = {0.5, 1}, qdd = {-2, 3}}
  for i = 1, 2 do assert(close(got[i], tau[i]), "torque " .. i) end
  -- The closed form of the two rings.
  local r, R = bore / 2, bore / 2 + bore / 4 + 0.002
  assert(math.abs(both - 2 * 7850 * math.pi * (R^2 - r^2) * 0.03) < 1e-9)
  return tau[2]
end
)~";

TEST_F(Parameters, OneOfAWorldReachesTheTorquesOfARobot) {
  run(kChain);
  run("before = check(0.02)\n"
      "cell:set_parameter(\"bore\", \"32 mm\")\n"
      "after = check(0.032)\n"
      "assert(after ~= before)\n"
      "document.undo()\nassert(check(0.02) == before)\n"
      "document.redo()\nassert(check(0.032) == after)");
  run("world.rename(\"cell\", \"big cell\")\ncell:set_parameter(\"bore\", 0.025)\ncheck(0.025)\n"
      "cell:rename_parameter(\"bore\", \"hole\")\ncell:set_parameter(\"hole\", \"0.02\")\n"
      "assert(check(0.02) == before)\n"
      "assert(bush:parameters().bore.expression == \"'big cell'.hole\")");
  EXPECT_EQ(
      eval("cell:remove()"),
      "cannot remove world \"big cell\": solid \"bush\", object \"pair\" and robot \"arm\" use "
      "its parameters. Give their numbers plain values or other expressions first.");
}

/// Every command that puts numbers into records, in the order of the issue that asked for it.
const char* const kEveryDoor = R"~(
function near(a, b) assert(math.abs(a - b) < 1e-12, tostring(a) .. " is not " .. tostring(b)) end
-- material
m = material.create{name="foam", parameters={rho="200 kg/m^3"}, density="rho/2", shininess="0.1*2"}
near(m:describe().density, 100); m:set_parameter("rho", "300 kg/m^3"); near(m:describe().density, 150)
document.undo(); near(m:describe().density, 100)
m:set{density="rho"}; near(m:describe().density, 200)
m:set{density=5}; assert(not (m:describe().expressions or {}).density)
-- robot
r = robot.create{name="r", parameters={L="0.5 m", pitch="10 mm", a="30 deg", k="2 kg"}, links={
 {name="turn", origin={position={0,0,"L"}, rpy={0,"a",0}}, axis={0,"sin(a)", "cos(a)"}, mass="k", com={"L/2",0,0}, inertia={{"k*L^2/12",0,0},{0,1,0},{0,0,1}}, lower="-2*a", upper="2*a"},
 {name="screw", joint="prismatic", origin={0,0,"2*L"}, mimic={link="turn", ratio="pitch/(360 deg)", offset="pitch"}},
 {name="slide", joint="prismatic", d="L"}}, poses={home={"a","L/5"}}}
d = r:describe()
near(d.links[2].mimic.ratio, 0.01/(2*math.pi)); near(d.links[2].mimic.offset, 0.01)
near(d.poses.home[2], 0.1); near(d.poses.home[1], math.pi/6)
r:set_pose("up", {"2*a", "L"}); r:add_tool{name="camera", link="turn", position={0,"L/10",0}, mass="k/10", com={0,0,"L"}}
r:add_loop{name="pin", kind="planar", a={link="turn", position={"L",0,0}}, b={link="slide", position={0,"L",0}}}
r:set_payload{mass="k", com={0,0,"L"}}
r:set_parameter("L", "1 m")
d = r:describe()
near(d.poses.up[2], 1); near(d.loops[1].a.position[1],1); near(d.loops[1].b.position[2],1); near(d.tools[1].payload.com[3],1); near(d.payload.com[3],1)
near(d.links[1].given.inertia[1][1], 2/12)
r:set_parameter("pitch","20 mm"); near(r:describe().links[2].mimic.ratio, 0.02/(2*math.pi))
document.undo(); document.undo(); near(r:describe().poses.up[2], 0.5)
record.set(r, "poses.home.q", {"a/2", "L"}); near(r:describe().poses.home[2], 0.5)
record.set(r, "poses.home.q.2", "20 mm"); near(r:describe().poses.home[2], 0.02)
record.set(r, "turn.mimic", nil)
-- world
w = world.create{name="cell", parameters={ht="0.3 m", lux=2}}
w:add_robot{robot=r, q={"45 deg","ht/3"}}
w:add_light{name="lamp", intensity="lux*2", position={0,0,"ht"}}
w:add_signal{name="level", kind="analogue", unit="m", initial="ht/2"}
w:add_signal{name="on", initial="lux/2"}
w:set_parameter("ht","0.6 m"); near(w:signals()[1].initial, 0.3); near(w:robots()[1].q[2], 0.2); near(w:lights()[1].intensity, 4)
w:set_signal("level","ht"); near(w:signals()[1].initial, 0.6)
-- trajectory with the world's parameter
t = trajectory.create{name="t", parameters={v="0.1 m/s"}, sample_time="20 ms * 1", segments={{shape="line", points={{0,0,0},{"cell.ht",0,0}}, speed="v"},{shape="line", points={{"cell.ht",0,0},{"cell.ht","1 m*1",0}}, speed="v", transition={distance="cell.ht/100"}}}}
near(t:describe().segments[1].points[2].position[1], 0.6)
w:set_parameter("ht","0.5 m"); near(t:describe().segments[1].points[2].position[1], 0.5); near(t:describe().segments[2].transition.distance, 0.005)
t:insert_segment(1, {shape="line", points={{0,0,1},{0,0,0}}, speed="2*v"})
e=t:describe().expressions
assert(e["segments.2.points.2.position.x"]=="cell.ht" and e["segments.1.shape.speed"]=="2*v" and e["segments.2.shape.speed"]=="v")
t:move_segment(1,3); e=t:describe().expressions; assert(e["segments.3.shape.speed"]=="2*v" and e["segments.1.shape.speed"]=="v")
t:set_segment(1,{speed="3*v"}); assert(t:describe().expressions["segments.1.shape.speed"]=="3*v")
t:set_segment(1,{speed=0.2}); assert(not t:describe().expressions["segments.1.shape.speed"])
j = trajectory.create{name="j", parameters={a="30 deg", L="0.2 m"}, segments={{shape="ptp", joints={{0,0},{"a","L"}}}}}
near(j:describe().segments[1].joints[2][2], 0.2)
-- task
k = task.create{name="k", parameters={a="30 deg", sp=0.5, T="2 s"}, steps={{step="move", robot="r", joints={"a","0.1 m"}, speed="sp"},{step="repeat", count=2, steps={{step="wait", time="T"}}},{step="wait", condition="on > 0", timeout="2*T"}, {step="move", robot="r", target={position={0,0,"T*(1 m/s)"}}, duration="T"}}}
k:set_parameter("T","3 s"); near(k:steps()[3].time, 3); near(k:steps()[4].timeout,6); near(k:steps()[5].target.position[3],3)
k:add_step{step={step="wait", time="T/3"}, before=1}
e=k:describe().expressions; assert(e["steps.1.duration"]=="T/3" and e["steps.4.duration"]=="T" and e["steps.2.speed"]=="sp")
k:remove_step(1); e=k:describe().expressions; assert(e["steps.3.duration"]=="T" and e["steps.1.speed"]=="sp")
)~";

TEST_F(Parameters, EveryCommandTakesExpressionsWhereverARecordHoldsANumber) {
  run(kEveryDoor);
  EXPECT_EQ(eval("m:set{opacity = \"rho/rho/2\"}"),
            "material.set: the expression \"rho/rho/2\" is not kept: this command uses the number "
            "only. Give the number itself, or set the numbers of the record with record.set.");
  EXPECT_EQ(eval("m:set{density = \"rho * 2 m\"}"),
            "material.set, density: \"rho * 2 m\" is a quantity in kg/m^2; a density (kg/m^3) is "
            "expected.");
  EXPECT_EQ(eval("m:set{density = \"nope*2\"}"),
            "material.set, density, at character 1 of \"nope*2\": there is no parameter \"nope\". "
            "Parameters are rho.");
  EXPECT_EQ(eval("r:set_pose(\"bad\", {\"L\", \"L\"})"),
            "robot.set_pose, q[1]: \"L\" is a length; an angle (rad) is expected.");
  EXPECT_EQ(eval("w:set_signal(\"level\", \"lux\")"),
            "world.set_signal, value: \"lux\" is a number without a unit; a length (m) is "
            "expected. Multiply it by a "
            "unit, such as mm.");
}

TEST_F(Parameters, EveryNumberThatIsGivenMayBeAnExpression) {
  run(kChain);
  run("bush:set(\"hole.radius\", \"bore/4\")\nassert(bush:tree().children[2].radius == 0.005)\n"
      "bush:set(\"chord\", \"wall/100\")\nassert(bush:describe().chord == 0.007 / 100)\n"
      "bush:set(\"hole.position\", {\"wall\", 0, \"-wall\"})\n"
      "bush:set(\"hole.rpy.z\", \"atan2(wall, bore)\")\n"
      "local e = bush:describe().expressions\n"
      "assert(e[\"hole.position.x\"] == \"wall\" and e[\"hole.position.y\"] == nil)\n"
      "bush:set(\"hole.position\", {0, 0, -0.005})\n"
      "assert(not bush:describe().expressions[\"hole.position.z\"])\n"
      "bush:add_node{node = {kind = \"box\", name = \"slot\", x = \"wall\", y = \"2*wall\", z = "
      "0.1}}\n"
      "assert(bush:tree().children[3].y == 0.014)\n"
      "bush:set(\"slot.name\", \"cut\")\n"
      "assert(bush:describe().expressions[\"cut.x\"] == \"wall\")\n"
      "bush:remove_node(\"cut\")\n"
      "assert(not bush:describe().expressions[\"cut.x\"])");
  run("pair:set(\"right.position.y\", \"gap/2\")\npair:set(\"right.rpy.x\", \"gap / (1 m) * "
      "rad\")\n"
      "pair:add_part{what = \"bush\", name = \"third\", position = {0, \"gap\", 0}}\n"
      "local d = pair:describe()\n"
      "assert(d.parts[2].placement.position[2] == 0.025 and d.parts[2].placement.rpy[1] == 0.05)\n"
      "assert(d.parts[3].placement.position[2] == 0.05)\n"
      "pair:set(\"third.position.y\", \"60 mm\")\n"
      "assert(not pair:describe().expressions[\"third.position.y\"])");
  run("arm:set_link{link = 2, d = \"reach/2\", upper = \"pi/2 * rad\", mass = 3, com = {\"reach\", "
      "0, 0}}\n"
      "assert(arm:link(2).d == 0.1 and arm:link(2).upper == math.pi / 2)\n"
      "arm:add_link{name = \"rail\", joint = \"prismatic\", d = \"reach\", upper = \"2*reach\"}\n"
      "assert(arm:link(3).upper == 0.4)\n"
      "arm:set{tool = {position = {0, 0, \"reach/4\"}}}\n"
      "arm:set_parameter(\"reach\", \"0.4 m\")\n"
      "local d = arm:describe()\n"
      "assert(d.links[2].d == 0.2 and d.links[3].upper == 0.8 and d.tool.position[3] == 0.1)\n"
      "assert(d.links[2].given.com[1] == 0.4 and d.links[2].parts[1].placement.position[1] == "
      "-0.2)\n"
      "arm:set_link{link = 2, d = 0.3}\narm:set_parameter(\"reach\", \"0.5 m\")\n"
      "assert(arm:link(2).d == 0.3 and arm:link(2).a == 1)");
  run("cell:add_object{what = \"pair\", name = \"here\", position = {\"bore\", \"2*cell.bore\", "
      "0}}\n"
      "cell:add_robot{robot = \"arm\", position = {0, 0, \"bore\"}}\n"
      "cell:set{gravity = {0, 0, \"-9.81 m/s^2 / 2\"}}\n"
      "cell:set_parameter(\"bore\", \"30 mm\")\n"
      "assert(cell:objects()[1].placement.position[2] == 0.06)\n"
      "assert(cell:robots()[1].placement.position[3] == 0.03)\n"
      "assert(cell:describe().gravity[3] == -9.81 / 2)\n"
      "cell:place{member = \"here\", position = {1, 0, 0}}\n"
      "assert(not cell:describe().expressions[\"here.position.x\"])");
}

TEST_F(Parameters, WhatDescribesARecordMakesItAgain) {
  run(kChain);
  run("local copy = solid.create{name = \"copy\", root = bush:tree(), parameters = "
      "bush:parameters()}\n"
      "cell:set_parameter(\"bore\", \"36 mm\")\n"
      "assert(copy:tree().children[1].radius == bush:tree().children[1].radius)\n"
      "local w = copy:parameters().wall\n"
      "assert(w.text == \"11 mm\" and w.expression == \"bore/4 + 2 mm\" and w.description == "
      "\"around it\")\n"
      "assert(w.uses[1] == \"hole.position.z\" and w.uses[2] == \"outer.radius\")");
}

TEST_F(Parameters, ComputedValuesDependOnTheNumbersOnly) {
  run(kChain);
  run("local function made()\n  pair:mass() arm:inverse_dynamics{q = {0.3, -0.7}}\n"
      "  return cache.stats().misses\nend\n"
      "local before = made()\n"
      "arm:rename_parameter(\"reach\", \"length\")\n"
      "bush:set(\"outer.radius\", \"wall + bore/2\")\n"
      "bush:set_parameter{name = \"wall\", description = \"another text\"}\n"
      "assert(made() == before)\n"
      "cell:set_parameter(\"bore\", \"21 mm\")\nassert(made() > before)");
}

TEST_F(Parameters, FilesKeepThem) {
  run(kChain);
  run("arm:save(\"params_test_arm.rbt\")\nlocal text = bush:text()\n"
      "assert(text:find('parameter bore 20 mm = \"cell.bore\"', 1, true), text)\n"
      "document.clear()\nlocal back = robot.load(\"params_test_arm.rbt\")\n"
      "assert(solid.get(\"bush\"):text() == text)\n"
      "assert(back:link(1).a == 0.2)\n"
      "for _, f in ipairs{\"params_test_arm.rbt\", \"pair.part\", \"bush.csg\", \"steel.mtr\"} do "
      "end");
  for (const char* f : {"params_test_arm.rbt", "pair.part", "bush.csg", "steel.mtr"})
    std::filesystem::remove(f);
}

TEST_F(Parameters, FaultsAreOneSentence) {
  run(kChain);
  const std::pair<const char*, const char*> cases[] = {
      {"bush:set(\"hole.radius\", \"bor/4\")",
       "solid \"bush\", hole.radius, at character 1 of \"bor/4\": there is no parameter \"bor\". "
       "Did "
       "you mean \"bore\"?"},
      {"bush:set(\"hole.radius\", \"3 mm + 2 deg\")",
       "solid \"bush\", hole.radius, at character 6 of \"3 mm + 2 deg\": a length (3 mm) and an "
       "angle "
       "(2 deg) cannot be added."},
      {"bush:set(\"hole.radius\", \"3 mmm\")",
       "solid \"bush\", hole.radius: \"mmm\" is not a unit. Did you mean \"mm\"?"},
      {"bush:set(\"hole.radius\", \"-bore\")",
       "solid \"bush\", hole.radius: -0.02 m is out of range; it must be greater than 0."},
      {"bush:set_parameter(\"h\", 3)",
       "solid \"bush\", parameter \"h\": \"h\" cannot name a parameter: it is a unit. Choose a "
       "longer "
       "one, such as h_1."},
      {"bush:set_parameter(\"bore\", \"wall\")",
       "solid \"bush\": parameter \"bore\" depends on itself: bore > wall > bore. Give one of them "
       "a "
       "plain value."},
      {"bush:remove_parameter(\"wall\")",
       "solid \"bush\": cannot remove parameter \"wall\": it is used by hole.position.z and "
       "outer.radius. Give these plain numbers or other expressions first."},
      {"cell:remove_parameter(\"bore\")",
       "world \"cell\": cannot remove parameter \"bore\": it is used by solid \"bush\": parameter "
       "\"bore\", object \"pair\": parameter \"gap\" and robot \"arm\": parameter \"reach\". Give "
       "these "
       "plain numbers or other expressions first."},
      {"bush:rename_parameter(\"wall\", \"bore\")",
       "solid \"bush\": there is already a parameter named \"bore\". Choose another name."},
      {"arm:set_link{link = 1, a = \"2 * reach + 3 deg\"}",
       "robot.set_link, a, at character 11 of \"2 * reach + 3 deg\": a length (2 * reach) and an "
       "angle "
       "(3 deg) cannot be added."},
      {"cell:set_parameter(\"bore\", \"-1 m\")",
       "solid \"bush\": radius of cylinder \"outer\" is -0.748 m; it must be greater than 0."},
      {"cell:set_parameter(\"bore\", \"20 deg\")",
       "solid \"bush\", parameter \"bore\": \"cell.bore\" is an angle; a length (m) is expected."},
  };
  const std::string before = app().document.content_digest();
  for (const auto& [code, wanted] : cases) EXPECT_EQ(eval(code), wanted);
  EXPECT_EQ(app().document.content_digest(), before);
}

/// A row of boxes `pitch` apart in x, each `pitch / 2` long and 10 mm wide and high.
class Comb final : public CsgPrimitive {
 public:
  Result<CsgTree> build(const Params& params, Progress&) const override {
    CsgTree tree;
    tree.nodes.push_back({CsgKind::union_, -1, {}, {}, "comb"});
    for (std::int64_t i = 0; i < params.integer("teeth"); ++i) {
      Pose at;
      at.p[0] = static_cast<double>(i) * params.real("pitch");
      tree.nodes.push_back({CsgKind::box, 0, at, {params.real("pitch") / 2, 0.01, 0.01}, ""});
    }
    return tree;
  }
};

class PrimitiveParameters : public Parameters {
 protected:
  void SetUp() override {
    Parameters::SetUp();
    ProviderInfo info;
    info.interface_id = CsgPrimitive::kInterfaceId;
    info.name = "comb";
    info.version = "1";
    info.schema = {ioci::field("teeth", "int", "", ""), ioci::field("pitch", "real", "m", ""),
                   ioci::field("label", "string", "", "")};
    const auto added = app().registry.add(
        info,
        [] {
          return Result<void*>(static_cast<CsgPrimitive*>(std::make_unique<Comb>().release()));
        },
        true);
    ASSERT_TRUE(added.ok());
    run("material.create{name = \"unit\", density = 1e6}\n"
        "comb = solid.create{name = \"comb\", material = \"unit\", "
        "parameters = {n = 3, long = \"80 mm\"}, root = {kind = \"custom\", name = \"row\", "
        "primitive = {name = \"comb\", params = {teeth = \"2*n\", pitch = \"long/4\", label = "
        "\"n\"}}}}\n"
        "function check(teeth, pitch)\n"
        "  local m = comb:mass().mass\n"
        "  assert(math.abs(m - teeth * pitch / 2 * 100) < 1e-9, m)\n"
        "end");
  }
  void TearDown() override { app().registry.remove(CsgPrimitive::kInterfaceId, "comb"); }
};

TEST_F(PrimitiveParameters, OfPluginsPrimitivesFollowAsSizesDo) {
  run("check(6, 0.02)\n"
      "comb:set_parameter(\"n\", 5) check(10, 0.02)\n"
      "comb:set_parameter(\"long\", \"40 mm\") check(10, 0.01)\n"
      "document.undo() check(10, 0.02)\n"
      "comb:rename_parameter(\"n\", \"count\")\n"
      "local e = comb:describe().expressions\n"
      "assert(e[\"row.primitive.teeth\"] == \"2*count\", e[\"row.primitive.teeth\"])\n"
      "assert(e[\"row.primitive.label\"] == nil, \"a text is no expression\")\n"
      // A plain number takes the expression's place, an expression a number's.
      "comb:set(\"row.primitive.teeth\", 4) check(4, 0.02)\n"
      "assert(comb:describe().expressions[\"row.primitive.teeth\"] == nil)\n"
      "comb:set(\"row.primitive.teeth\", \"count + 2\") check(7, 0.02)\n"
      "comb:set(\"row.primitive.pitch\", \"30 mm\") check(7, 0.03)\n"
      "comb:set(\"row.primitive\", {name = \"comb\", params = {teeth = \"count\", pitch = "
      "\"long/8\", label = \"\"}}) check(5, 0.01)\n"
      "comb:set(\"row.name\", \"line\") comb:set_parameter(\"count\", 8) check(8, 0.01)");
}

TEST_F(PrimitiveParameters, OfPluginsPrimitivesGoThroughTreesAndFiles) {
  run("local again = solid.create{name = \"again\", material = \"unit\", "
      "parameters = comb:describe().parameters, root = comb:tree()}\n"
      "again:set_parameter(\"n\", 4)\n"
      "assert(math.abs(again:mass().mass - 8 * 0.01 * 100) < 1e-9, again:mass().mass)\n"
      "again:remove()\n"
      // A count stays one that can follow when the table is written with whole numbers.
      "local whole = comb:tree() whole.primitive.params.teeth = 6\n"
      "again = solid.create{name = \"again\", material = \"unit\", "
      "parameters = comb:describe().parameters, root = whole}\n"
      "again:set_parameter(\"n\", 4)\n"
      "assert(math.abs(again:mass().mass - 8 * 0.01 * 100) < 1e-9, again:mass().mass)");
}

TEST_F(PrimitiveParameters, FaultsInThoseOfPluginsPrimitivesAreToldWhenTheyAreGiven) {
  EXPECT_EQ(
      eval("comb:set(\"row.primitive.pitch\", \"30 deg + 2 * n * rad\")"),
      "solid \"comb\", row.primitive.pitch: \"30 deg + 2 * n * rad\" is an angle; a length (m) "
      "is expected.");
  EXPECT_EQ(eval("comb:set(\"row.primitive.teeth\", \"2 * nlong\")"),
            "solid \"comb\", row.primitive.teeth, at character 5 of \"2 * nlong\": there is no "
            "parameter \"nlong\". Did you mean \"long\"?");
  run("check(6, 0.02)");
}

}  // namespace
}  // namespace robomosp::lua
