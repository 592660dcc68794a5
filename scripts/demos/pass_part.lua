-- SPDX-License-Identifier: Apache-2.0
-- Two robots pass a bar: one takes it from a stand, the other takes it over in the middle and puts
-- it on a belt that carries it away. Each has a task of its own; they wait for each other through
-- signals and places, on one clock.
-- A folder and a quality for the pictures may be given; those of the manual are made by
--   robomosp run scripts/demos/pass_part.lua docs/images normal
local folder, quality = arg and arg[1], arg and arg[2] or "draft"

local arm = robot.get("irb140")
for _, link in ipairs(arm:describe().links) do
  arm:set_link{ link = link.name, max_acceleration = "600 deg/s^2", max_jerk = "6000 deg/s^3" }
end
arm:set_tool{ position = {0, "120 mm", 0}, rpy = {"-90 deg", "90 deg", 0} }  -- out of the flange

material.create{ name = "bar_red", density = 1200, colour = "#c8402c" }
material.create{ name = "stand_grey", density = 2700, colour = "#b9bfc6" }
material.create{ name = "dark", density = 2700, colour = "#3a3f46" }
local function box(name, material, x, y, z)
  solid.create{ name = name, material = material, root = {kind = "box", x = x, y = y, z = z} }
end
local stand, length = 0.20, 0.24
box("bar", "bar_red", 0.04, 0.04, length)
box("stand", "stand_grey", 0.16, 0.16, stand)
box("carriage", "stand_grey", 0.20, 0.02, 0.20)
box("rail", "dark", 0.14, 1.00, stand - 0.03)
solid.create{ name = "hand", material = "dark", root = {kind = "union", children = {
  {kind = "cylinder", radius = 0.03, height = 0.03},
  {kind = "box", x = 0.11, y = 0.05, z = 0.03, position = {0, 0, 0.03}},
  {kind = "box", x = 0.012, y = 0.03, z = 0.08, position = {0.0265, 0, 0.06}},
  {kind = "box", x = 0.012, y = 0.03, z = 0.08, position = {-0.0265, 0, 0.06}}}} }

-- A belt is a robot with one sliding joint, here along y of the world.
robot.create{ name = "belt", links = {
  {name = "carriage", joint = "prismatic", lower = 0, upper = 0.6, max_velocity = 0.3,
   max_acceleration = 0.5, max_jerk = 5, parts = {{what = "carriage", position = {0, 0, -0.10}}}}} }

local cell = world.create{ name = "pass_part" }
local function elbow_up(turn) return {turn, -1.5, 2 * math.pi - 3.0, 0, 1.4, 0} end
cell:add_robot{ robot = "irb140", name = "left", q = elbow_up(0.8) }
cell:add_robot{ robot = "irb140", name = "right", q = elbow_up(-0.8),
  placement = {1.5, 0, 0, 0, 0, "180 deg"} }
cell:add_robot{ robot = "belt", name = "belt",
  placement = {1.10, 0.30, stand - 0.01, "-90 deg", 0, 0} }
cell:add_object{ what = "rail", name = "rail", position = {1.10, 0.60, 0} }
cell:add_object{ what = "stand", name = "stand", position = {0.40, 0.30, 0} }
cell:add_object{ what = "bar", name = "bar", position = {0.40, 0.30, stand} }
for _, name in ipairs{"left", "right"} do
  cell:add_object{ what = "hand", name = name .. "_hand" }
  cell:attach{ object = name .. "_hand", robot = name, link = "flange", rpy = {"-90 deg", "90 deg", 0} }
end
cell:add_frame{ name = "middle", position = {0.75, 0, 0.48} }

cell:add_signal{ name = "offered", from = "left", to = "right", description = "the bar is held out" }
cell:add_signal{ name = "taken", from = "right", to = "left", description = "the bar is held" }
cell:add_signal{ name = "on_belt", from = "right", to = "belt", description = "the bar lies on it" }

local top = stand + length - 0.02  -- where the tool holds the bar
local function down(z) return {0.40, 0.30, z, math.pi, 0, math.pi} end
local function on_belt(z) return {1.10, 0.30, z, math.pi, 0, math.pi} end
local function from_left(x) return {x, 0, 0, math.pi, -math.pi / 2, 0} end
local function from_right(x) return {x, 0, 0, math.pi, math.pi / 2, 0} end

task.create{ name = "give", steps = {
  {step = "move", target = down(top + 0.1)},
  {step = "move", target = down(top), path = "straight", tool_speed = "150 mm/s"},
  {step = "attach", object = "bar"},
  {step = "move", target = down(top + 0.15), path = "straight"},
  {step = "move", target = from_left(-0.10), frame = "middle"},
  {step = "set", signal = "offered", value = 1},
  {step = "wait", condition = "taken == 1", timeout = 20},
  {step = "move", target = from_left(-0.17), frame = "middle", path = "straight"},
  {step = "move", target = down(top + 0.15)}} }
task.create{ name = "receive", steps = {
  {step = "move", target = from_right(0.17), frame = "middle", speed = 0.5},
  {step = "wait", condition = "offered == 1"},
  {step = "move", target = from_right(0.10), frame = "middle", path = "straight"},
  {step = "attach", object = "bar"},
  {step = "set", signal = "taken", value = 1},
  {step = "wait", condition = "left.x < 0.59 m"},
  {step = "move", target = on_belt(top + 0.15)},
  {step = "move", target = on_belt(top), path = "straight"},
  {step = "detach", object = "bar"},
  {step = "set", signal = "on_belt", value = 1},
  {step = "move", target = on_belt(top + 0.15), path = "straight"}} }
task.create{ name = "carry", steps = {
  {step = "wait", condition = "on_belt == 1 and right.z > 0.5 m"},
  {step = "attach", object = "bar"},
  {step = "move", joints = {0.5}, profile = "trapezoidal"},
  {step = "detach", object = "bar"}} }
cell:add_task{ task = "give", robot = "left" }
cell:add_task{ task = "receive", robot = "right" }
cell:add_task{ task = "carry", robot = "belt" }

local run = cell:run_task()
local t = run:values("time")
for _, note in ipairs(run:notes()) do print(note) end

-- The bar never jumps, also where it changes hands, and ends on the belt, its other end up.
local x, y, z = run:values("bar.x"), run:values("bar.y"), run:values("bar.z")
local fastest = 0
for i = 2, #t do
  local way = math.sqrt((x[i] - x[i-1])^2 + (y[i] - y[i-1])^2 + (z[i] - z[i-1])^2)
  fastest = math.max(fastest, way / (t[i] - t[i-1]))
end
assert(fastest < 4, "the bar jumps")
assert(math.abs(x[#x] - 1.10) < 1e-6 and math.abs(y[#y] - 0.80) < 1e-6, "the bar is off the belt")
assert(math.abs(z[#z] - (stand + length)) < 1e-6, "the bar is not on the belt")
print(string.format("%.2f s; the bar ends at x %.1f mm, y %.1f mm, never faster than %.2f m/s",
  t[#t], 1000 * x[#x], 1000 * y[#y], fastest))

-- A wait that nobody ends is told at once.
cell:remove_member("give")
local is_run, fault = pcall(cell.run_task, cell)
assert(not is_run and tostring(fault):find("offered"), "the deadlock is not told")
print("without the task \"give\" nothing runs, and that is told at once: " .. tostring(fault))
cell:add_task{ task = "give", robot = "left" }

local passed = 0
for i, v in ipairs(run:values("signal.taken")) do
  if v == 1 then passed = t[i]; break end
end
for name, at in pairs{ middle = passed, belt = t[#t] } do
  if folder then
    local drawn, trouble = pcall(cell.render, cell, { recording = run, at = at,
      file = folder .. "/pass_part_" .. name .. ".png", size = {780, 520}, quality = quality,
      axes = false, eye = {0.75, 3.1, 1.4}, target = {0.75, 0.15, 0.38} })
    if not drawn then print(trouble) end  -- such as: no renderer is installed
  end
end

return run  -- what a window plays
