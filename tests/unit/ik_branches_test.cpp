// SPDX-License-Identifier: Apache-2.0
// Inverse kinematics as they are asked for by commands: arguments that a solver has no use for, the
// solver of a robot that names none, what joint limits take away, and branches by name.
#include <fstream>
#include <string>

#include <gtest/gtest.h>

#include "support/lua_program.h"

namespace robomosp {
namespace {

class IkBranchesTest : public test::LuaProgramTest {
 protected:
  /// The newest message of this code; "" = there is none.
  std::string said(const char* code) {
    std::string out;
    for (const Message& m : app().messages.recent(1000))
      if (m.code == code) out = m.text;
    return out;
  }
  std::size_t count(const char* code) {
    std::size_t n = 0;
    for (const Message& m : app().messages.recent(1000)) n += m.code == code ? 1 : 0;
    return n;
  }
};

void expect_has(const std::string& text, const char* part) {
  EXPECT_NE(text.find(part), std::string::npos) << text << "\nlacks: " << part;
}

// The rows of C. S. G. Lee and M. Ziegler (1984); `h` = 1 or -1 turns axis 2 over, which must not
// change what is left and what is up.
constexpr const char* kArms = R"~(
pi = math.pi
function lee_ziegler(name, limit, options)
  local l = {lower = -limit, upper = limit}
  local function row(t) t.lower, t.upper = l.lower, l.upper; return t end
  local r = {name = name, convention = "dh", links = {
    row{alpha = -pi/2}, row{a = 0.4318, d = 0.14909}, row{a = -0.02032, alpha = pi/2},
    row{d = 0.43307, alpha = -pi/2}, row{alpha = pi/2}, row{d = 0.05625}}}
  for k, v in pairs(options or {}) do r[k] = v end
  return robot.create(r)
end
local seed = 12345
function random()
  seed = (seed * 1103515245 + 12345) % 2147483648
  return (seed / 2147483648 * 2 - 1) * pi
end
function refused(f, ...)
  local ok, e = pcall(f, ...)
  assert(not ok, "not refused")
  return tostring(e)
end
function has(text, part) assert(tostring(text):find(part, 1, true), tostring(text) .. " lacks " .. part) end
)~";

TEST_F(IkBranchesTest, AnArgumentThatASolverHasNoUseForIsRefusedWithTheOnesThatHave) {
  run(kArms);
  run(R"~(
local puma, pa10, gripper = robot.get("puma560"), robot.get("pa10"), robot.get("gripper")
local at = pa10:fk{q = "ready"}.pose
has(refused(pa10.solve_ik, pa10, {target = at, provider = "numeric", arm_angle = 0.1}),
  'the solver "numeric" does not use arm_angle. Of this robot\'s solvers "srs" does: give provider = "srs", or leave it out')
has(refused(pa10.solve_ik_batch, pa10, {targets = {at}, provider = "numeric", arm_angle = {0.1}}), '"srs" does')
has(refused(puma.solve_ik, puma, {target = at, arm_angle = 0.1}), 'No solver of this robot does: leave it out')
has(refused(puma.solve_ik, puma, {target = at, provider = "numeric", branch = "left"}),
  'does not use branch. Of this robot\'s solvers "spherical_wrist" does')
local planar = robot.get("planar2rods")
has(refused(planar.solve_ik, planar, {target = at, branch = "left"}), 'No solver of this robot does')
has(refused(puma.solve_ik, puma, {target = at, provider = {name = "spherical_wrist", params = {turning = true}}}),
  "turning")
)~");
}

TEST_F(IkBranchesTest, ARobotThatNamesNoSolverGetsTheClosedFormThatServesIt) {
  run(kArms);
  run("lz = lee_ziegler('lz', 3)");
  expect_has(said("ik_choice"),
             "robot \"lz\" names no solver: its inverse kinematics are solved in closed form by "
             "\"spherical_wrist\"");
  run(R"~(
q = {0.1, 0.2, 0.3, 0.4, 0.5, 0.6}
function solver(r) return r:solve_ik{target = r:fk{q = q}.pose, seed = q, partial = true}.provider end
assert(solver(lz) == "spherical_wrist")
lz:set_link{link = 5, a = "10 mm"}
assert(solver(lz) == "numeric"))~");
  expect_has(said("ik_choice"),
             "now searched for by \"numeric\", as \"spherical_wrist\" no longer "
             "serves it (spherical_wrist: it has neither a spherical wrist");
  run("document.undo()\nassert(solver(lz) == 'spherical_wrist')");
  expect_has(said("ik_choice"), "now solved in closed form by \"spherical_wrist\"");
  // Geometry by a parameter, in a command that knows nothing of robots.
  run(R"~(
par = robot.create{name = "par", convention = "dh", parameters = {bend = "0 mm"}, links = {
  {alpha = -pi/2}, {a = 0.4}, {alpha = pi/2}, {d = 0.4, alpha = -pi/2}, {a = "bend", alpha = pi/2}, {d = 0.05}}}
assert(solver(par) == "spherical_wrist")
par:set_parameter("bend", "20 mm")
assert(solver(par) == "numeric"))~");
  expect_has(said("ik_choice"), "robot \"par\" names no solver");
  expect_has(said("ik_choice"), "now searched for");
  // What is named stays, and nothing is said of it.
  const std::size_t before = count("ik_choice");
  run(R"~(
own = lee_ziegler("own", 3, {ik = "numeric"})
assert(solver(own) == "numeric")
closed = lee_ziegler("closed", 3, {ik = "spherical_wrist"})
closed:set_link{link = 5, a = "10 mm"}
has(refused(closed.solve_ik, closed, {target = pose(0.3, 0.2, 0.1)}), "neither a spherical wrist")
with_tool = lee_ziegler("tuned", 3, {ik = {name = "spherical_wrist", params = {turns = false}}})
assert(solver(with_tool) == "spherical_wrist"))~");
  EXPECT_EQ(count("ik_choice"), before);
  // A default that somebody chose is a choice.
  run(R"~(
provider.default{interface = "robomosp.ik/1", name = "numeric"}
assert(solver(robot.get("lz")) == "numeric")
provider.default{interface = "robomosp.ik/1", name = ""}
assert(solver(robot.get("lz")) == "spherical_wrist"))~");
}

TEST_F(IkBranchesTest, TheClosedFormOfSevenJointsIsChosenAndWhyNoneFitsIsSaid) {
  run(kArms);
  run(R"~(
local function seven(name, bend)
  return robot.create{name = name, convention = "dh", links = {
    {d = 0.34, alpha = -pi/2}, {alpha = pi/2}, {d = 0.4, alpha = pi/2}, {alpha = -pi/2},
    {d = 0.4, alpha = -pi/2}, {a = bend, alpha = pi/2}, {d = 0.126}}}
end
local q = {0.1, 0.5, 0.2, -1.2, 0.3, 0.8, 0.1}
local srs, panda = seven("srs_arm", 0), seven("panda_like", 0.088)
assert(srs:solve_ik{target = srs:fk{q = q}.pose, seed = q}.provider == "srs")
assert(srs:solve_ik{target = srs:fk{q = q}.pose, seed = q, arm_angle = 0.3}.status == "solved")
assert(panda:solve_ik{target = panda:fk{q = q}.pose, seed = q}.provider == "numeric"))~");
  expect_has(said("ik_choice"),
             "robot \"panda_like\" names no solver: its inverse kinematics are "
             "searched for by \"numeric\"; no closed form fits (srs: it is not "
             "a spherical-revolute-spherical arm: axis 7 passes");
}

TEST_F(IkBranchesTest, ARobotWithATipThatNoClosedFormServesIsSearchedFor) {
  run(kArms);
  run(R"~(
local two = lee_ziegler("two", 3)
two:add_tool{name = "hand", link = 3}
local q = {0.1, 0.2, 0.3, 0.4, 0.5, 0.6}
local s = two:solve_ik{target = two:fk{q = q}.pose, seed = q}
assert(s.status == "solved", s.detail)
local goals = two:solve_goals{goals = {{target = two:fk{q = q}.pose, parts = "position"}}, seed = q}
assert(goals.status == "solved" and goals.provider == "numeric", goals.provider))~");
}

TEST_F(IkBranchesTest, AnImportedArmGetsTheClosedForm) {
  std::string urdf = "<robot name=\"six\"><link name=\"l0\"/>";
  const char* const origins[] = {"0 0 0.4", "0 0 0", "0.45 0 0", "0.4 0 0", "0 0 0", "0.05 0 0"};
  const char* const axes[] = {"0 0 1", "0 1 0", "0 1 0", "1 0 0", "0 1 0", "1 0 0"};
  for (int i = 0; i < 6; ++i) {
    const std::string n = std::to_string(i + 1), b = std::to_string(i);
    urdf += "<link name=\"l" + n + "\"/><joint name=\"j" + n +
            "\" type=\"revolute\"><parent link=\"l" + b + "\"/><child link=\"l" + n +
            "\"/><origin xyz=\"" + origins[i] + "\"/><axis xyz=\"" + axes[i] +
            "\"/><limit lower=\"-3\" upper=\"3\" effort=\"10\" velocity=\"1\"/></joint>";
  }
  const auto file = std::filesystem::path(testing::TempDir()) / "ik_branches_six.urdf";
  std::ofstream(file) << urdf << "</robot>";
  run("import{file = '" + file.string() + "'}");
  expect_has(said("ik_choice"), "solved in closed form by \"spherical_wrist\"");
  run(R"~(
local six = robot.get("six")
local q = {0.3, 0.4, -0.9, 0.2, 0.6, 0.1}
local s = six:solve_ik{target = six:fk{q = q}.pose, seed = q, all = true}
assert(s.provider == "spherical_wrist" and #s.branches >= 2))~");
  std::filesystem::remove(file);
}

TEST_F(IkBranchesTest, WhatJointLimitsTakeAwayIsCountedNamedAndGivenOnRequest) {
  run(kArms);
  run(R"~(
tight = lee_ziegler("tight", pi)
local seen, gone = 0, 0
for _ = 1, 60 do
  local q = {random(), random(), random(), random(), random(), random()}
  local target = tight:fk{q = q}.pose
  for j = 1, 6 do tight:set_link{link = j, lower = -pi, upper = pi} end
  local whole = tight:solve_ik{target = target, seed = q, all = true,
    provider = {name = "spherical_wrist", params = {turns = false}}}
  assert(#whole.solutions == 8 and whole.beyond_limits == 0 and #whole.beyond == 0)
  -- Limits about q, counted by hand.
  local reach = 1.2
  for j = 1, 6 do tight:set_link{link = j, lower = q[j] - reach, upper = q[j] + reach} end
  local within = 0
  for i = 1, 8 do
    local ok = true
    for j = 1, 6 do
      local off = math.abs((whole.solutions[i][j] - q[j] + pi) % (2 * pi) - pi)
      ok = ok and off <= reach
    end
    within = within + (ok and 1 or 0)
  end
  local s = tight:solve_ik{target = target, seed = q, all = true}
  assert(#s.solutions == within and s.beyond_limits == 8 - within and #s.beyond == 8 - within)
  has(s.detail, (8 - within) .. " of 8 solutions ")
  for _, b in ipairs(s.beyond) do
    local most = 0                                       -- the joint farthest beyond, whole turns apart
    for j = 1, 6 do
      local off = math.abs((b.q[j] - q[j] + pi) % (2 * pi) - pi)
      most = math.max(most, off - reach)
    end
    assert(math.abs(most - b.by) < 1e-9, most .. " " .. b.by)
    local p, t = tight:fk{q = b.q}.position, tight:fk{q = q}.position
    for k = 1, 3 do assert(math.abs(p[k] - t[k]) < 1e-9) end
  end
  local all = tight:solve_ik{target = target, seed = q, all = true, limits = "ignore"}
  assert(#all.solutions == 8 and all.beyond_limits == 8 - within)
  local kept = 0
  for _, w in ipairs(all.within_limits) do kept = kept + (w and 1 or 0) end
  assert(kept == within)
  seen, gone = seen + within, gone + 8 - within
end
assert(seen >= 60 and gone > 100))~");
}

TEST_F(IkBranchesTest, WhenLimitsLeaveNothingTheErrorSaysHowManyTheyTookAndByWhichJoint) {
  run(kArms);
  run(R"~(
tight = lee_ziegler("tight", pi)
local q = {0.4, -0.6, 0.9, 0.5, 0.7, -0.3}
local target = tight:fk{q = q}.pose
tight:set_link{link = 2, lower = 0.5, upper = 0.6}
tight:set_link{link = 3, lower = 0.95, upper = 0.97}
local e = refused(tight.solve_ik, tight, {target = target, seed = q})
has(e, "all 8 solutions are beyond the joint limits: ")
has(e, 'by joint 2 ("link2"), ')
has(e, 'limits = "ignore"')
local s = tight:solve_ik{target = target, seed = q, partial = true}
assert(s.status == "joint_limit" and s.beyond_limits == 8 and #s.beyond == 8)
local one = tight:solve_ik{target = target, seed = q, limits = "ignore"}
assert(one.status == "solved" and one.beyond_limits == 1 and one.within_limits[1] == false)
for j = 1, 6 do assert(math.abs(one.q[j] - q[j]) < 1e-9) end
assert(one.beyond[1].joint == "link2" and math.abs(one.beyond[1].by - 1.1) < 1e-9, one.beyond[1].by)
assert(one.beyond[1].limit == 0.5 and math.abs(one.beyond[1].value + 0.6) < 1e-9)
-- The same through the batch.
local b = tight:solve_ik_batch{targets = {target}, seed = q, limits = "ignore"}
assert(b.solved == 1 and b.within_limits[1] == false)
has(b.detail[1], 'joint 2 ("link2") at -34.38 deg, 63.03 deg beyond its limit')
-- And with a search.
local n = tight:solve_ik{target = target, seed = q, limits = "ignore", provider = "numeric"}
assert(n.status == "solved" and n.within_limits[1] == false and n.beyond_limits == 1))~");
}

// ARM = sign(-d4 S23 - a3 C23 - a2 C2), +1 right; ELBOW = ARM sign(d4 C3 - a3 S3), +1 above: Lee
// and Ziegler's decision equations. Wrist: FLIP is joint 5 below 0, NOFLIP above (Unimation, VAL).
TEST_F(IkBranchesTest, BranchesOfAPumaAreThoseOfLeeAndZiegler) {
  run(kArms);
  run(R"~(
local lz = lee_ziegler("lz", pi)
local a2, a3, d4 = 0.4318, -0.02032, 0.43307
local names, words = 0, {}
for _ = 1, 500 do
  local q = {random(), random(), random(), random(), random(), random()}
  local arm = -d4 * math.sin(q[2] + q[3]) - a3 * math.cos(q[2] + q[3]) - a2 * math.cos(q[2])
  local elbow = (d4 * math.cos(q[3]) - a3 * math.sin(q[3])) * (arm > 0 and 1 or -1)
  local expected = (arm > 0 and "right" or "left") .. (elbow > 0 and " up" or " down") ..
    (math.sin(q[5]) > 0 and " no flip" or " flip")
  local s = lz:solve_ik{target = lz:fk{q = q}.pose, seed = q}
  for j = 1, 6 do assert(math.abs(s.q[j] - q[j]) < 1e-6) end
  assert(s.branch == expected, s.branch .. " is not " .. expected)
  words[s.branch] = true
end
for _ in pairs(words) do names = names + 1 end
assert(names == 8))~");
}

TEST_F(IkBranchesTest, TheEightSolutionsOfAnArmHaveEightNamesThatCanBeAskedFor) {
  run(kArms);
  run(R"~(
local lz = lee_ziegler("lz", 4)
local arms = {lz, robot.get("puma560"), robot.get("puma560_mdh"), robot.get("ur5"), robot.get("ur10e"),
  robot.get("kr5"), robot.get("irb140")}
for _, arm in ipairs(arms) do
  for j = 1, 6 do arm:set_link{link = j, lower = -pi, upper = pi} end
  local tried = 0
  for _ = 1, 40 do
    local q = {random(), random(), random(), random(), random(), random()}
    local target = arm:fk{q = q}.pose
    local s = arm:solve_ik{target = target, seed = q, all = true}
    if #s.solutions == 8 then
      tried = tried + 1
      local seen, n = {}, 0
      for i, name in ipairs(s.branches) do
        if not seen[name] then n = n + 1 end
        seen[name] = s.solutions[i]
      end
      assert(n == 8, arm.name .. ": " .. n .. " names")
      for name, q in pairs(seen) do
        local one = arm:solve_ik{target = target, branch = name}
        assert(one.branch == name and #one.solutions == 1)
        for j = 1, 6 do
          assert(math.abs((one.q[j] - q[j] + pi) % (2 * pi) - pi) < 1e-6, arm.name .. " " .. name)
        end
      end
      local left = arm:solve_ik{target = target, branch = "left", all = true}
      assert(#left.solutions == 4)
      for _, name in ipairs(left.branches) do has(name, "left ") end
      local table = arm:solve_ik{target = target, branch = {wrist = "flip", elbow = "up"}, all = true}
      assert(#table.solutions == 2 and table.branches[1]:find("up flip", 1, true))
      assert(#arm:solve_ik{target = target, branch = {"no_flip", "down"}, all = true}.solutions == 2)
    end
  end
  assert(tried >= 5, arm.name .. " " .. tried)
end)~");
}

// What is left does not hang on which way the rows let an axis point: standard and modified rows of
// one arm, and rows with axis 2 turned over.
TEST_F(IkBranchesTest, TheSameArmInOtherRowsHasTheSameNames) {
  run(kArms);
  run(R"~(
local lz = lee_ziegler("lz", 4)
-- alpha1, d2, theta2 and theta3 with the other sign: axes 2 and 3 turned over.
local over = robot.create{name = "over", convention = "dh", links = {
  {alpha = pi/2, lower = -4, upper = 4}, {a = 0.4318, d = -0.14909, lower = -4, upper = 4},
  {a = -0.02032, alpha = -pi/2, lower = -4, upper = 4}, {d = 0.43307, alpha = -pi/2, lower = -4, upper = 4},
  {alpha = pi/2, lower = -4, upper = 4}, {d = 0.05625, lower = -4, upper = 4}}}
for _ = 1, 100 do
  local q = {random(), random(), random(), random(), random(), random()}
  local turned = {q[1], -q[2], -q[3], q[4], q[5], q[6]}
  local a, b = lz:fk{q = q}, over:fk{q = turned}
  for k = 1, 3 do assert(math.abs(a.position[k] - b.position[k]) < 1e-12) end
  local x = lz:solve_ik{target = a.pose, seed = q}
  local y = over:solve_ik{target = b.pose, seed = turned}
  assert(x.branch == y.branch, x.branch .. " " .. y.branch)
end)~");
}

// A UR5 by its own angles: flipped by the sign of joint 5; the elbow by joint 3, read about the
// side on which the wrist lies; the shoulder by where the wrist centre lies in the frame behind
// joint 1.
TEST_F(IkBranchesTest, BranchesOfAUr5FollowItsGeometry) {
  run(kArms);
  run(R"~(
local ur = robot.get("ur5")
local a2, a3, d4, d5 = -0.425, -0.39225, 0.10915, 0.09465
for _ = 1, 300 do
  local q = {random(), random(), random(), random(), random(), random()}
  -- In the plane behind joint 1 (x ahead of axis 1, y up, d4 along axis 2); the wrist centre is
  -- where axes 5 and 6 meet.
  local t = q[2] + q[3] + q[4]
  local x = a2 * math.cos(q[2]) + a3 * math.cos(q[2] + q[3]) + d5 * math.sin(t)
  -- Axis 2 points along -y at q1 = 0: looking along +x from axis 1 with z up, that is to the right.
  local right = x > 0
  local elbow_up = (math.sin(q[3]) > 0) == (x < 0)
  local expected = (right and "right" or "left") .. (elbow_up and " up" or " down") ..
    (math.sin(q[5]) > 0 and " no flip" or " flip")
  local s = ur:solve_ik{target = ur:fk{q = q}.pose, seed = q}
  assert(s.branch == expected, s.branch .. " is not " .. expected)
end)~");
}

TEST_F(IkBranchesTest, BranchesOfSevenJointsAreTheSignsOfJointsTwoFourAndSix) {
  run(kArms);
  run(R"~(
for _, name in ipairs{"pa10", "iiwa14"} do
  local arm = robot.get(name)
  for j = 1, 7 do arm:set_link{link = j, lower = -pi, upper = pi} end
  -- Which way joint 4 bends the arm forward when joint 3 is 0: the hand comes nearer to the floor
  -- than with the arm straight and joint 2 leaning forward.
  local up = arm:fk{q = {0, 0.5, 0, 0.4, 0, 0, 0}}.position[3] < arm:fk{q = {0, 0.5, 0, -0.4, 0, 0, 0}}.position[3]
  local compared = 0
  for _ = 1, 100 do
    local q = {random(), random(), random(), random(), random(), random(), random()}
    local target = arm:fk{q = q}.pose
    local function sign(x) return x > 0 end
    local s = arm:solve_ik{target = target, seed = q}
    local lean = arm:fk{q = {0, 0.3, 0, 0, 0, 0, 0}}.position[1] > 0
    local expected = ((math.sin(q[2]) > 0) == lean and "left" or "right") ..
      ((math.sin(q[4]) > 0) == up and " up" or " down") .. (math.sin(q[6]) > 0 and " no flip" or " flip")
    if math.abs(s.q[4] - q[4]) < 1e-6 and math.abs(s.q[2] - q[2]) < 1e-6 then
      assert(s.branch == expected, name .. ": " .. s.branch .. " is not " .. expected)
      compared = compared + 1
    end
    local all = arm:solve_ik{target = target, seed = q, all = true}
    local seen, n = {}, 0
    for _, b in ipairs(all.branches) do if not seen[b] then n = n + 1; seen[b] = true end end
    assert(n == 8, n)
  end
  assert(compared >= 90, name .. " " .. compared)
end)~");
}

TEST_F(IkBranchesTest, ABranchThatIsNotThereSaysWhichAre) {
  run(kArms);
  run(R"~(
local lz = lee_ziegler("lz", pi)
local q = {0.4, -0.6, 0.9, 0.5, 0.7, -0.3}
local target, own = lz:fk{q = q}.pose
own = lz:solve_ik{target = target, seed = q}.branch
for j = 1, 6 do lz:set_link{link = j, lower = q[j] - 0.2, upper = q[j] + 0.2} end
local other = own:find("left") and "right" or "left"
local e = refused(lz.solve_ik, lz, {target = target, branch = other})
has(e, 'no solution is on the branch "' .. other .. '" within the joint limits: it would need joint ')
has(e, 'There are "' .. own .. '"')
assert(lz:solve_ik{target = target, branch = own}.branch == own)
local e = refused(lz.solve_ik, lz, {target = target, branch = "sideways"})
has(e, '"sideways" is not a word for a branch. The words are right or left, up or down, no flip or flip')
has(refused(lz.solve_ik, lz, {target = target, branch = "flip no flip"}), "exclude each other")
has(refused(lz.solve_ik, lz, {target = target, branch = {elbo = "up"}}), 'Did you mean "elbow"?')
has(refused(lz.solve_ik, lz, {target = target, branch = {elbow = "left"}}), "not a branch of the elbow: up or down")
has(refused(lz.solve_ik, lz, {target = target, branch = 3}), "branch: 3 is not string or ")
has(refused(lz.solve_ik, lz, {target = target, branch = ""}), "no branch is named")
has(refused(lz.solve_ik, lz, {target = target, limits = "loose"}), "limits")
-- Of many targets those that lack the branch say so.
local far = lz:fk{q = {q[1], q[2], q[3], q[4], q[5] + 0.1, q[6]}}.pose
local b = lz:solve_ik_batch{targets = {target, far}, branch = own}
assert(b.solved == 2 and b.branches[1] == own and b.branches[2] == own)
b = lz:solve_ik_batch{targets = {target, far}, branch = other}
assert(b.solved == 0 and b.status[1] == "other_branch")
has(b.detail[2], 'there are "' .. own .. '"')
has(refused(lz.solve_ik_batch, lz, {targets = {target, far}, branch = other, continuous = true}), "target 1: no solution"))~");
}

TEST_F(IkBranchesTest, APathThatChangesItsBranchSaysWhere) {
  run(kArms);
  run(R"~(
lz = lee_ziegler("lz", 4)
local targets = {}
for i = 0, 20 do                                        -- joint 5 passes 0: through a singular wrist
  targets[#targets + 1] = lz:fk{q = {0.2, -0.7, 0.6, 0.3, 0.31 - 0.03 * i, 0.4}}.pose
end
local seed = {0.2, -0.7, 0.6, 0.3, 0.31, 0.4}
local b = lz:solve_ik_batch{targets = targets, seed = seed, continuous = true}
assert(b.solved == 21)
assert(#b.branch_changes == 1, #b.branch_changes)
local c = b.branch_changes[1]
assert(c.target == 12 and c.from:find("no flip") and not c.to:find("no flip"), c.target)
-- A path that stays says nothing, also when it stops in the singular place and goes back.
local back = {}
for i = 0, 20 do
  back[#back + 1] = lz:fk{q = {0.2, -0.7, 0.6, 0.3, math.abs(0.3 - 0.03 * i), 0.4}}.pose
end
b = lz:solve_ik_batch{targets = back, seed = seed, continuous = true}
assert(b.solved == 21 and #b.branch_changes == 0)
-- Begun on a branch that was asked for.
local flip = lz:solve_ik_batch{targets = {targets[1], targets[2], targets[3]}, branch = "flip", continuous = true}
assert(flip.solved == 3)
for _, name in ipairs(flip.branches) do assert(not name:find("no flip")) end)~");
}

// With the parameter `switching` a path goes over to another branch where a limit ends its own.
TEST_F(IkBranchesTest, ASimulationThatJumpsToAnotherBranchSaysSo) {
  run(kArms);
  run(R"~(
lz = lee_ziegler("lz", 4, {ik = {name = "spherical_wrist", params = {switching = true}}})
lz:set_pose{name = "home", q = {0.2, -0.9, 0.8, 0.3, 0.7, 0.4}}
lz:set_link{link = 1, lower = 0.1, upper = 5.5}
cell = world.create{name = "cell"}
cell:add_robot{robot = lz}
local a = lz:fk{q = "home"}
local p = a.position
local rpy = a.rpy
local path = trajectory.create{name = "aside", segments = {{shape = "line", duration = 2, points = {
  {position = p, rpy = rpy}, {position = {p[1] + 0.05, p[2] - 0.25, p[3]}, rpy = rpy}}}}}
cell:add_trajectory{trajectory = path}
run = cell:inverse_kinematics{robot = "lz", trajectory = "aside", sample_time = 0.02}
notes = table.concat(run:notes(), "\n")
has(notes, "the arm changes its configuration from STATUS")
has(notes, "jumps by")
lz:set_link{link = 1, lower = -pi, upper = pi}
run = cell:inverse_kinematics{robot = "lz", trajectory = "aside", sample_time = 0.02}
assert(not table.concat(run:notes(), "\n"):find("configuration"), table.concat(run:notes(), "\n")))~");
}

TEST_F(IkBranchesTest, ASolverInLuaNamesItsBranches) {
  run(kArms);
  run(R"~(
-- Two links in a plane: the elbow on either side.
local function solve(model, target, seed, asked)
  local x, y = target[1][4], target[2][4]
  local k = (x^2 + y^2 - 0.5^2 - 0.3^2) / (2 * 0.5 * 0.3)
  if k < -1 or k > 1 then return nil, "out_of_reach" end
  local found = {}
  for i, side in ipairs{1, -1} do
    local b = side * math.acos(k)
    local a = math.atan(y, x) - math.atan(0.3 * math.sin(b), 0.5 + 0.3 * math.cos(b))
    found[i] = {a, b, math.atan(target[2][1], target[1][1]) - a - b}
  end
  return found
end
tips = {}
own = {solve = solve, branches = {{"elbow", "left", "right"}},
  branch = function(model, q, tip, params) tips[tip] = #model.joints return {math.sin(q[2])} end}
ioci.provide("robomosp.ik/1", "two_ways", own)
flat = robot.create{name = "flat", links = {{name = "a", a = 0.5}, {name = "b", a = 0.3}, {name = "c"}}, ik = "two_ways"}
target = flat:fk{q = {0.4, 0.9, 0.1}}.pose
local s = flat:solve_ik{target = target, all = true}
assert(s.branch == "left" and #s.branches == 2 and s.branches[2] == "right", s.branch)
assert(tips[1] == 3)
local r = flat:solve_ik{target = target, branch = "right"}
assert(r.branch == "right" and math.abs(r.q[2] + 0.9) < 1e-9)
assert(flat:solve_ik{target = target, branch = {elbow = "left"}}.q[2] > 0)
has(refused(flat.solve_ik, flat, {target = target, branch = "up"}), "The words are left or right")
-- It is among those that name branches.
local tagged = false
for _, p in ipairs(provider.list("robomosp.ik/1")) do
  if p.name == "two_ways" then for _, t in ipairs(p.tags) do tagged = tagged or t == "branches" end end
end
assert(tagged)
has(refused(flat.solve_ik, flat, {target = target, branch = "left", provider = "numeric"}), '"two_ways"'))~");
  // A bare number where there is one choice; a job asks from another thread.
  run(R"~(
own.branch = function(model, q) return math.sin(q[2]) end
ioci.provide("robomosp.ik/1", "two_ways", own)
local job = start("robot.solve_ik", {id = flat, target = target, branch = "right"})
assert(job:wait().branch == "right"))~");
}

TEST_F(IkBranchesTest, BranchesOfASolverInLuaThatAreNoneAreRefused) {
  const auto told = [&](const char* branches) {
    return eval(std::string("ioci.provide('robomosp.ik/1', 'odd', {solve = function(model, target, "
                            "seed) return seed end, ") +
                branches +
                "})\nrobot.get('arm'):solve_ik{target = robot.get('arm'):fk{q = {0, 0, 0, "
                "0, 0, 0}}.pose, provider = 'odd', partial = true}");
  };
  const std::pair<const char*, const char*> wrong[] = {
      {"branches = {{'elbow', 'up', 'down'}}", "no function branch"},
      {"branch = function() return 0 end", "no list of branches"},
      {"branches = {}, branch = function() return 0 end", "no list of branches"},
      {"branches = {{'elbow', 'up'}}, branch = function() return 0 end",
       "a branch must be a name and two words"},
      {"branches = {{'elbow', 'up', 'up'}}, branch = function() return 0 end",
       "two branches have the word \"up\""},
      {"branches = {{'a', 'up', 'down'}, {'b', 'left', 'up'}}, branch = function() return 0 end",
       "two branches have the word \"up\""}};
  for (const auto& [given, said] : wrong)
    EXPECT_NE(told(given).find(said), std::string::npos) << given << ": " << told(given);
  // Measures that are none leave the answer, without its names, and are told once.
  const auto reported = [&](const char* part) {
    int n = 0;
    for (const Message& m : app().messages.recent(1000))
      n += m.code == "branches" && m.text.find(part) != std::string::npos;
    return n;
  };
  const char* const kOne = "branches = {{'elbow', 'up', 'down'}}, branch = function() ";
  (void)told((std::string(kOne) + "return 7 end").c_str());
  (void)told((std::string(kOne) + "return 7 end").c_str());
  EXPECT_EQ(reported("branch returned 7, which is not within -1 to 1"), 1);
  (void)told((std::string(kOne) + "return {0, 0} end").c_str());
  EXPECT_EQ(reported("the result of branch"), 1);
  (void)told((std::string(kOne) + "error('no idea') end").c_str());
  EXPECT_EQ(reported("no idea"), 1);
}

}  // namespace
}  // namespace robomosp
