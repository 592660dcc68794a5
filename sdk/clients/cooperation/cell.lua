-- SPDX-License-Identifier: Apache-2.0
-- Two robots, two stands, a bar: the world that left.py and right.py share.
--   robomosp serve --listen unix:/tmp/cell cell.lua
local arm = robot.get("irb140")
for _, link in ipairs(arm:describe().links) do
  arm:set_link{ link = link.name, max_acceleration = "600 deg/s^2", max_jerk = "6000 deg/s^3" }
end
arm:set_tool{ position = {0, "120 mm", 0}, rpy = {"-90 deg", "90 deg", 0} }  -- out of the flange

material.create{ name = "bar_red", density = 1200, colour = "#c8402c" }
material.create{ name = "stand_grey", density = 2700, colour = "#b9bfc6" }
material.create{ name = "dark", density = 2700, colour = "#3a3f46" }
solid.create{ name = "bar", material = "bar_red", root = {kind = "box", x = 0.04, y = 0.04, z = 0.24} }
solid.create{ name = "stand", material = "stand_grey", root = {kind = "box", x = 0.16, y = 0.16, z = 0.20} }
solid.create{ name = "hand", material = "dark", root = {kind = "union", children = {
  {kind = "cylinder", radius = 0.03, height = 0.03},
  {kind = "box", x = 0.11, y = 0.05, z = 0.03, position = {0, 0, 0.03}},
  {kind = "box", x = 0.012, y = 0.03, z = 0.08, position = {0.0265, 0, 0.06}},
  {kind = "box", x = 0.012, y = 0.03, z = 0.08, position = {-0.0265, 0, 0.06}}}} }

local cell = world.create{ name = "cell" }
cell:add_robot{ robot = "irb140", name = "left", q = {0.8, -1.5, 2 * math.pi - 3.0, 0, 1.4, 0} }
cell:add_robot{ robot = "irb140", name = "right", q = {-0.8, -1.5, 2 * math.pi - 3.0, 0, 1.4, 0},
  placement = {1.5, 0, 0, 0, 0, "180 deg"} }
for _, name in ipairs{"left", "right"} do
  cell:add_object{ what = "hand", name = name .. "_hand" }
  cell:attach{ object = name .. "_hand", robot = name, link = "flange", rpy = {"-90 deg", "90 deg", 0} }
end
cell:add_object{ what = "stand", name = "here", position = {0.40, 0.30, 0} }
cell:add_object{ what = "stand", name = "there", position = {1.10, 0.30, 0} }
cell:add_object{ what = "bar", name = "bar", position = {0.40, 0.30, 0.20} }
cell:add_frame{ name = "middle", position = {0.75, 0, 0.48} }
cell:add_signal{ name = "offered", from = "left", to = "right", description = "the bar is held out" }
cell:add_signal{ name = "taken", from = "right", to = "left", description = "the bar is held" }
cell:add_signal{ name = "clear", from = "left", to = "right", description = "the other hand is away" }
