-- SPDX-License-Identifier: Apache-2.0
-- Contact physics: a PUMA 560 with a suction cup takes a crate from a table and sets it on top of a
-- stack that has just fallen into place, while other things fall onto the table.
-- A folder and a quality for the pictures may be given; those of the manual are made by
--   robomosp run scripts/demos/pick_and_place.lua docs/images normal
local folder, quality = arg and arg[1] or ".", arg and arg[2] or "draft"

local cell = world.get("pick_and_place")
local puma = robot.get("puma560")

-- A suction cup on the flange, the tool's frame at its rim.
material.create{ name = "cup_rubber", density = 1200, colour = "#d0442c" }
solid.create{ name = "suction_cup", material = "cup_rubber", root = {kind = "union", children = {
  {kind = "cylinder", radius = 0.008, height = 0.06},
  {kind = "cylinder", radius = 0.016, height = 0.02, position = {0, 0, 0.05}}}} }
local length = 0.056 + 0.07
puma:set_link{ link = "flange", parts = {
  {what = "puma560_link6"}, {what = "suction_cup", position = {0, 0, 0.056}}} }
puma:set_tool{ position = {0, 0, length} }

-- Joint values for the cup's rim at a place of the world, looking down.
local shoulder = 0.672
local q = {0, 0.8, -2.9, 0, 0.6, 0}
local function above(x, y, z)
  local answer = puma:solve_ik{ seed = q, target = {x, y, z - shoulder, math.pi, 0, 0} }
  q = answer.q
  return q
end

local press = 0.0002          -- the cup is pressed into the crate
local high = 0.78
local actions = {
  {action = "move", q = above(0.55, -0.15, high), duration = 0.8},
  {action = "move", q = above(0.55, -0.15, 0.56 - press), duration = 0.6},
  {action = "grasp"},
  {action = "move", q = above(0.55, -0.15, high), duration = 0.6},
  {action = "move", q = above(0.1, 0.6, high), duration = 1.2},
  {action = "move", q = above(0.1, 0.6, 0.68), duration = 0.6},
  {action = "release", duration = 0.2},
  {action = "move", q = above(0.1, 0.6, high), duration = 0.5},
}
local standing = {}
for _, name in ipairs{"floor", "table", "shelf"} do
  standing[#standing + 1] = {name = name, fixed = true}
end
local run = cell:simulate_physics{ actions = actions, objects = standing, sample_time = 0.02 }

local x, y, z = run:values("crate.x"), run:values("crate.y"), run:values("crate.z")
print(string.format("the crate ends %.1f mm from the middle of the stack, its bottom at %.1f mm",
  1000 * math.sqrt((x[#x] - 0.1)^2 + (y[#y] - 0.6)^2), 1000 * z[#z]))
print(string.format("the upper crate of the stack rests at %.2f mm", 1000 * run:values("upper.z")[#z]))

for name, at in pairs{ start = 0.1, carried = 2.9, placed = 4.4 } do
  local drawn, fault = pcall(cell.render, cell, { recording = run, at = at,
    file = folder .. "/pick_and_place_" .. name .. ".png", size = {900, 600}, quality = quality,
    axes = false, eye = {2.5, 1.7, 1.8}, target = {0.3, 0.2, 0.66} })
  if not drawn then print(fault) end  -- such as: no renderer is installed
end
