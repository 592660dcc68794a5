-- SPDX-License-Identifier: Apache-2.0
-- An arm reaches from one side of a wall below a board to the other, and finds the way itself: planned from sampled configurations, shortened, rounded, run as fast as the joints can.
-- usage: robomosp run scripts/demos/plan_around.lua [folder [quality of the pictures]]
local folder, quality = arg and arg[1], arg and arg[2] or "draft"

local arm = robot.load("robots/ur5.rbt")
local from = {2.3, -1.2, 1.6, -1.9, -1.5, 0}
local cell = world.create{ name = "around" }
cell:add_robot{ robot = arm, name = "arm", q = from }
local function paint(name, colour) return material.create{ name = name, density = 1000, colour = colour } end
local wall = solid.create{ name = "wall", material = paint("brick", "#a8583f"), root = {kind = "box", x = 0.5, y = 0.06, z = 0.75} }
cell:add_object{ what = wall, position = {0.6, 0, 0} }
local floor = solid.create{ name = "floor", material = paint("stone", "#9aa0a6"), root = {kind = "box", x = 1.5, y = 1.5, z = 0.03} }
cell:add_object{ what = floor, position = {0.4, 0, -0.031} }
local board = solid.create{ name = "board", material = paint("timber", "#c79a5e"), root = {kind = "box", x = 0.7, y = 1.2, z = 0.04} }
cell:add_object{ what = board, position = {0.6, 0, 1.15} }
local post = solid.create{ name = "post", material = "timber", root = {kind = "box", x = 0.04, y = 0.04, z = 1.15} }
for i, y in ipairs{-0.57, 0.57} do cell:add_object{ what = post, name = "post" .. i, position = {0.92, y, 0} } end

local to = {4, -1.2, 1.6, -1.9, -1.5, 0}
local direct = cell:check_path{ path = {from, to} }
print(string.format("straight: %s and %s would touch at %.0f %% of the way", direct.a, direct.b, 100 * direct.share))
local ways = {}
for _, planner in ipairs{"rrt_connect", "prm"} do
  local began = os.clock()
  local way = cell:plan_path{ robot = "arm", to = to, planner = planner, seconds = 60, shortcuts = 100 }
  assert(cell:check_path{ recording = way.recording }.is_free)
  print(string.format("%-12s %.2f m found, %.2f m shortened, run in %.2f s, planned in %.1f s", planner,
    way.found_length, way.length, way.duration, os.clock() - began))
  ways[planner] = way
end

-- The tool's path as little beads, and the arm on its way.
local way = ways.rrt_connect
local x, y, z = way.recording:values("x"), way.recording:values("y"), way.recording:values("z")
local bead = solid.create{ name = "bead", material = paint("orange", "#ff8c1a"), root = {kind = "sphere", radius = 0.008} }
local rows = #x
for i = 0, 40 do
  local k = 1 + math.floor(i * (rows - 1) / 40)
  cell:add_object{ what = bead, name = "bead" .. i, position = {x[k], y[k], z[k]} }
end
for i, share in ipairs{0, 0.5, 1} do
  cell:set_robot_q{ robot = "arm", q = way.joints[1 + math.floor(share * (rows - 1))] }
  if folder then
    local drawn, fault = pcall(cell.render, cell, { file = folder .. "/plan_around_" .. i .. ".png",
      size = {640, 580}, quality = quality, axes = false, eye = {3.1, -1.5, 1.15}, target = {0.44, 0, 0.56} })
    if not drawn then print(fault) end  -- such as: no renderer is installed
  end
end
