-- SPDX-License-Identifier: Apache-2.0
-- Closed chains: a four-bar linkage swings freely, and the legs of a Stewart platform are found for a
-- platform that circles and tilts.
-- usage: robomosp run scripts/demos/closed_chains.lua [folder [quality of the pictures]]
local folder, quality = arg and arg[1], arg and arg[2] or "draft"

local cell = world.get("closed_chains")
local bar, platform = robot.get("four_bar"), robot.get("stewart")

-- Let go without motor or friction: the loop stays closed and the energy stays.
local start = bar:close{ joints = {crank = "100 deg"} }.q
local swing = cell:simulate_dynamics{ robot = "four_bar", q = start, duration = 2, friction = false }
if folder then
  swing:plot{ file = folder .. "/four_bar_swing.svg", columns = {"q1", "q2", "q3"},
    title = "Four-bar linkage that swings" }
end
local angles, energy = {swing:values("q1"), swing:values("q2"), swing:values("q3")}, swing:values("energy")
local open, drift = 0, 0
for i = 1, #energy do
  local q = {angles[1][i], angles[2][i], angles[3][i]}
  for _, r in ipairs(bar:loop_error{ q = q }.residual) do open = math.max(open, math.abs(r)) end
  drift = math.max(drift, math.abs(energy[i] - energy[1]))
end
print(string.format("four-bar linkage: the pin is off by %.0e, the energy by %.0e J in 2 s", open, drift))

-- The platform is led, and the legs follow; each place starts from the one before. A leg's length is
-- 0.6 m and its slide, which has to be the distance of the joints at its ends.
local home = platform:fk{ q = "home", all = true }
local feet = {}
for _, link in ipairs(home.links) do
  if link.name:find("foot") then feet[#feet + 1] = link.position end
end
local q, worst, least, most = "home", 0, math.huge, -math.huge
local steps = 48
for i = 0, steps do
  local s = 2 * math.pi * i / steps
  local x, y, z = 0.08 * math.cos(s), 0.08 * math.sin(s), 0.72 + 0.04 * math.sin(2 * s)
  local tilt = 0.2                                       -- about an axis that goes round, too
  local w, u, v = math.cos(tilt / 2), math.sin(tilt / 2) * math.cos(s), math.sin(tilt / 2) * math.sin(s)
  q = platform:close{ q = q, joints = {platform = {x, y, z, w, u, v, 0}} }.q
  for leg, loop in ipairs(platform:loops()) do
    local p = loop.a.placement.position
    -- p + 2 w (n x p) + 2 n x (n x p) of the quaternion (w, n)
    local cx, cy, cz = v * p[3], -u * p[3], u * p[2] - v * p[1]
    local hx, hy, hz = x + p[1] + 2 * (w * cx + v * cz), y + p[2] + 2 * (w * cy - u * cz),
      z + p[3] + 2 * (w * cz + u * cy - v * cx)
    local foot, slide = feet[leg], q[3 * leg]
    local length = math.sqrt((hx - foot[1])^2 + (hy - foot[2])^2 + (hz - foot[3])^2)
    worst = math.max(worst, math.abs(length - 0.6 - slide))
    least, most = math.min(least, slide), math.max(most, slide)
  end
  if i % 24 == 6 then
    cell:set_robot_q{ robot = "stewart", q = q }
    cell:set_robot_q{ robot = "four_bar", q = {angles[1][2 * i + 1], angles[2][2 * i + 1], angles[3][2 * i + 1]} }
    if folder then
      local drawn, fault = pcall(cell.render, cell, { file = folder .. "/closed_chains_" .. i .. ".png",
        size = {400, 330}, quality = quality, axes = false, eye = {2.1, -1.6, 1.5}, target = {0, -0.05, 0.4} })
      if not drawn then print(fault) end  -- such as: no renderer is installed
    end
  end
end
print(string.format("Stewart platform: slides from %.0f to %.0f mm, off their closed form by %.0e m",
  1000 * least, 1000 * most, worst))
assert(open < 1e-8 and drift < 1e-6 and worst < 1e-10)

return swing  -- what a window plays
