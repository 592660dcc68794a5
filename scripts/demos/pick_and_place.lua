-- SPDX-License-Identifier: Apache-2.0
-- Contact physics: a PUMA 560 with a suction cup takes a crate from a table and sets it on top of a
-- stack that has just fallen into place, while other things fall onto the table. Then one with two
-- fingers takes a crate by friction alone, and loses it when the fingers are oily.
-- A folder and a quality for the pictures may be given; those of the manual are made by
--   robomosp run scripts/demos/pick_and_place.lua docs/images normal
local folder, quality = arg and arg[1], arg and arg[2] or "draft"

local cell = world.get("pick_and_place")
local puma = robot.get("puma560")

local fingered = puma:duplicate{ name = "fingered" }  -- for later

-- A suction cup of the library on the flange, which is 56 mm from the wrist; the cup's rim leads.
local cup = object.get("suction_cup")
puma:attach{ tool = cup, position = {0, 0, 0.056} }
local length = 0.056 + cup:tcps()[1].position[3]

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
  if folder then
    local drawn, fault = pcall(cell.render, cell, { recording = run, at = at,
      file = folder .. "/pick_and_place_" .. name .. ".png", size = {780, 520}, quality = quality,
      axes = false, eye = {2.5, 1.7, 1.8}, target = {0.3, 0.2, 0.66} })
    if not drawn then print(fault) end  -- such as: no renderer is installed
  end
end

-- Two fingers that close along x of the flange. One motor: the right finger follows the left one.
solid.create{ name = "palm", material = "steel", root =
  {kind = "box", x = 0.13, y = 0.04, z = 0.03, position = {0, 0, 0.056}} }
material.create{ name = "finger_rubber", density = 1200, colour = "#3070b0" }
solid.create{ name = "finger", material = "finger_rubber", root =
  {kind = "box", x = 0.012, y = 0.03, z = 0.08} }
fingered:set_link{ link = "flange", parts = { {what = "puma560_link6"}, {what = "palm"} } }
local function add_finger(name, sign, mimic)  -- at 0 the two touch
  fingered:add_link{ name = name, parent = "flange", joint = "prismatic", origin = {0, 0, 0.086},
    axis = {sign, 0, 0}, lower = 0, upper = 0.05, mimic = mimic,
    mass = 0.05, inertia = {1e-4, 1e-4, 1e-4, 0, 0, 0},
    parts = {{what = "finger", position = {sign * 0.006, 0, 0}}} }
end
add_finger("left", -1)
add_finger("right", 1, {link = "left"})

local gripping = cell:duplicate{ name = "gripping" }
gripping:remove_member{ member = "puma560" }
for _, name in ipairs{"lower", "upper", "falling_1", "falling_2", "falling_3"} do
  gripping:remove_member{ member = name }
end
gripping:add_robot{ robot = "fingered", position = {0, 0, shoulder} }

local open = 0.045
local function around(x, y, z)      -- the middle between the pads, 145 mm from the wrist
  local to = {table.unpack(above(x, y, z + 0.145 - length), 1, 6)}
  to[7] = open
  return to
end
local force, time = 6, 0.8          -- of the motor: 3 N on either side
local down, up = around(0.55, -0.15, 0.525), around(0.55, -0.15, 0.75)
gripping:set_robot_q{ robot = "fingered", q = around(0.4, -0.3, 0.75) }
local taking = {
  {action = "move", q = up, duration = 0.6},
  {action = "move", q = down, duration = 0.6},
  {action = "grip", joint = "left", force = -force, speed = 0.05, duration = 0.5},
  {action = "move", q = up, duration = time},
  {action = "move", q = around(0.1, 0.6, 0.75), duration = 1.2},
  {action = "move", q = around(0.1, 0.6, 0.527), duration = time},
  {action = "release", duration = 0.4},
  {action = "move", q = around(0.1, 0.6, 0.75), duration = 0.5},
}
local function grip(friction)
  return gripping:simulate_physics{ actions = taking, objects = standing, sample_time = 0.02,
    robots = {{name = "fingered", friction = friction}}, friction = 0.5 }
end
local oil, rubber = grip(0.05), grip(0.9)
local mass = solid.get("crate"):mass().mass
-- Held while 2 mu N >= m (g + a), with N = force / 2 and the greatest acceleration of the lift,
-- about 10 / sqrt(3) of way over time^2.
local needed = mass * (9.81 + 10 / math.sqrt(3) * 0.225 / time^2) / force
print(string.format("friction of %.2f is needed, %.2f and %.2f are there", needed,
  math.sqrt(0.9 * 0.5), math.sqrt(0.05 * 0.5)))
for _, with in ipairs{ {"rubber", rubber}, {"oil", oil} } do
  local r = with[2]
  local px, py, pz = r:values("crate.x"), r:values("crate.y"), r:values("crate.z")
  print(string.format("%s: the crate ends at (%.1f, %.1f, %.1f) mm", with[1],
    1000 * px[#px], 1000 * py[#py], 1000 * pz[#pz]))
end
if folder then
  local drawn, fault = pcall(gripping.render, gripping, { recording = rubber, at = 2.5,
    file = folder .. "/pick_and_place_fingers.png", size = {780, 520}, quality = quality,
    axes = false, eye = {1.05, 0.6, 1.02}, target = {0.47, -0.12, 0.8} })
  if not drawn then print(fault) end
end

return run  -- what a window plays
