-- SPDX-License-Identifier: Apache-2.0
-- A tree with two tools: two arms on a turning torso carry a tray round an upright loop and tilt it
-- meanwhile. Both hands are goals at once, and what freedom is left keeps joints from their limits.
-- usage: robomosp run scripts/demos/two_arms.lua [folder [quality of the pictures]]
local folder, quality = arg and arg[1], arg and arg[2] or "draft"

local cell = world.get("dual_arm")
local both = robot.get("dual_arm")

-- The tray's middle, and its tilt about x; a hand holds it at either end and points forward.
local half = 0.2
local function tray(share)
  local s = 2 * math.pi * share
  return {0.55, 0.12 * math.sin(2 * s), 1.0 + 0.1 * math.cos(s)}, 0.35 * math.sin(s)
end
local function goals(share)
  local at, tilt = tray(share)
  local along, up = half * math.cos(tilt), half * math.sin(tilt)
  local turn = {math.pi / 2, math.pi / 2 - tilt, math.pi / 2}
  return {
    {tip = "left_tool", target = {at[1], at[2] + along, at[3] + up, table.unpack(turn)}},
    {tip = "tool", target = {at[1], at[2] - along, at[3] - up, table.unpack(turn)}}}
end

local q, worst, off = "home", 0, 0
local steps = 40
for i = 0, steps do
  local share = i / steps
  local answer = both:solve_goals{ goals = goals(share), seed = q, objective = "limits" }
  q = answer.q
  worst = math.max(worst, answer.position_error)
  local left, right = both:fk{ q = q, tip = "left_tool" }.position, both:fk{ q = q }.position
  local apart = math.sqrt((left[1] - right[1])^2 + (left[2] - right[2])^2 + (left[3] - right[3])^2)
  off = math.max(off, math.abs(apart - 2 * half))
  if i == 10 or i == 25 then
    local at, tilt = tray(share)
    cell:set_robot_q{ robot = "dual_arm", q = q }
    cell:place{ member = "tray", position = {at[1] + 0.15, at[2], at[3]}, rpy = {tilt, 0, 0} }
    if folder then
      local drawn, fault = pcall(cell.render, cell, { file = folder .. "/two_arms_" .. i .. ".png",
        size = {440, 370}, quality = quality, axes = false, eye = {2.1, 1.2, 1.6}, target = {0.2, 0, 0.7} })
      if not drawn then print(fault) end  -- such as: no renderer is installed
    end
  end
end
assert(worst < 1e-8 and off < 1e-8)
print(string.format("two arms, %d joints, %d places of the tray: hands off by %.0e m, their distance by %.0e m",
  both:dof(), steps + 1, worst, off))

return cell  -- what a window shows
