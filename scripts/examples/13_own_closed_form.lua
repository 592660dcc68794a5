-- SPDX-License-Identifier: Apache-2.0
-- A closed form of one's own, in Lua, in place of a shipped robot's default: the two configurations
-- of a SCARA by the law of cosines. They are checked against the numerical solver, then the robot
-- follows a line with them.
ioci.provide("robomosp.ik/1", "scara_lua", {
  summary = "SCARA robots by the law of cosines.",
  tags = {"simple", "closed_form", "all_solutions"},
  solve = function(model, target, seed)
    local j = model.joints
    if #j ~= 4 or j[3].type ~= "prismatic" then return nil, "this is no SCARA" end
    local l1, l2, height = j[2].placement(1, 4), j[3].placement(1, 4), j[1].placement(3, 4)
    local x, y, z = target(1, 4), target(2, 4), target(3, 4)
    local k = (x^2 + y^2 - l1^2 - l2^2) / (2 * l1 * l2)
    if k < -1 or k > 1 then return nil, "out_of_reach" end
    local turn, found = math.atan(target(2, 1), target(1, 1)), {}
    for _, side in ipairs{1, -1} do
      local q2 = side * math.acos(k)
      local q1 = math.atan(y, x) - math.atan(l2 * math.sin(q2), l1 + l2 * math.cos(q2))
      local q = {q1, q2, height - z, q1 + q2 - turn} -- joints 3 and 4 point down
      local inside, away = true, 0
      for i, value in ipairs(q) do
        if i ~= 3 then q[i] = (value + pi) % (2 * pi) - pi end
        inside = inside and q[i] >= j[i].lower and q[i] <= j[i].upper
        away = away + (q[i] - seed[i])^2
      end
      if inside then found[#found + 1] = {q = q, away = away} end
    end
    if #found == 0 then return nil, "joint_limit" end
    table.sort(found, function(a, b) return a.away < b.away end)
    for i, f in ipairs(found) do found[i] = f.q end
    return found
  end,
})

local cobra = robot "cobra600"
local default = cobra:solve_ik{ target = cobra:fk{ q = {0, 1, 0.1, 0} }.pose, seed = {0, 1, 0.1, 0} }.provider
cobra:set{ ik = "scara_lua" }

-- Every configuration is found again, also by the numerical solver from a seed nearby.
local number = 1
local function random(low, high) -- Park and Miller's generator: the same numbers everywhere
  number = number * 48271 % 2147483647
  return low + (high - low) * number / 2147483647
end
local greatest, pairs_found = 0, 0
for _ = 1, 100 do
  local q = {random(-0.8, 0.8), random(-1.5, 1.5), random(0, 0.2), random(-3, 3)}
  local target = cobra:fk{ q = q }.pose
  local own = cobra:solve_ik{ target = target, seed = q, all = true }
  assert(own.provider == "scara_lua")
  local near = {}
  for i = 1, 4 do
    greatest = math.max(greatest, math.abs(own.q[i] - q[i]))
    near[i] = q[i] + 0.02
  end
  local other = cobra:solve_ik{ target = target, seed = near, provider = "numeric" }.q
  for i = 1, 4 do assert(math.abs(other[i] - own.q[i]) < 1e-6) end
  if #own.solutions == 2 then pairs_found = pairs_found + 1 end
end
assert(greatest < 1e-9, "the closed form gives back what it came from")
assert(pairs_found > 10, "both elbows are told where the limits allow them")

-- A world that shows the robot follows a line with it.
local line = trajectory.create{ name = "line", segments = { { shape = "line", points = {
  { position = {0.45, -0.15, 0.28}, rpy = {pi, 0, 0} },
  { position = {0.5, 0.1, 0.24}, rpy = {pi, 0, 0} } } } } }
local cell = world.create{ name = "cell" }
local start = cobra:solve_ik{ target = pose(0.45, -0.15, 0.28, rpy(pi, 0, 0)) }.q
cell:add_robot{ robot = cobra, name = "arm", q = start }
cell:add_trajectory{ trajectory = line, name = "line" }
local run = cell:inverse_kinematics{ robot = "arm", trajectory = "line" }
local x = run:values "x"
assert(math.abs(x[#x] - 0.5) < 1e-9)
print(string.format("scara_lua in place of %s: 100 poses to %.1g rad, a line to x = %.3f m",
  default, greatest, x[#x]))
