-- SPDX-License-Identifier: Apache-2.0
-- Belts of the cells beside: robots of one sliding joint, each with a task. One brings parts to a
-- place, the next as soon as the last has gone; another takes away what is let go there.
-- usage: local belts = dofile(here .. "/belts.lua")
local belts = {}

--- A bar across the belt that goes with its parts: behind the last one, or before the first.
local function bar(name, axis, away, height)
  local along = math.abs(axis[1]) > 0.5
  return solid.create{ name = name .. "_bar", root = {kind = "box", x = along and 0.01 or 0.1,
    y = along and 0.1 or 0.01, z = 0.5 * height, position = {axis[1] * away, axis[2] * away, -height}} }
end

--- The part that stands at `at` and `count - 1` others behind it, `pitch` apart along `axis` (a unit
--- vector, from which they come). `what` has its origin where the tool takes it, `height` above its
--- foot. Its objects are part1, part2, ... The belt is 0.3 mm under them.
function belts.bring(cell, given)
  local n, a, p = given.count, given.axis, given.at
  local name, pitch, low = given.name, given.pitch, given.height + 0.0003
  local length = n * pitch + 0.1
  local along = math.abs(a[1]) > 0.5
  local middle = pitch * (n - 1) / 2
  solid.create{ name = name .. "_bed", root = {kind = "box", x = along and length or 0.12,
    y = along and 0.12 or length, z = 0.03, position = {a[1] * middle, a[2] * middle, -low - 0.03}} }
  robot.create{ name = name, links = {{name = "cloth", joint = "prismatic", origin = {0, 0, 0},
    axis = {-a[1], -a[2], 0}, lower = -0.01, upper = n * pitch, max_velocity = 0.6,
    max_acceleration = 4, max_jerk = 100, parts = {{what = bar(name, a, n * pitch - pitch / 2, given.height)}}}},
    base_parts = {{what = name .. "_bed"}} }
  cell:add_robot{ robot = name, name = name, position = p, q = {0} }
  local steps = {}
  for i = 1, n do
    local part, away = given.prefix .. i, (i - 1) * pitch
    cell:add_object{ what = given.what, name = part, position = {p[1] + a[1] * away, p[2] + a[2] * away, p[3]} }
    cell:attach{ object = part, robot = name, link = "cloth", position = {a[1] * away, a[2] * away, 0} }
    if i < n then
      steps[#steps + 1] = {step = "wait", condition = string.format(
        "abs(%s.x - %.5f m) > 150 mm or abs(%s.y - %.5f m) > 150 mm", part, p[1], part, p[2])}
      steps[#steps + 1] = {step = "move", joints = {i * pitch}}
    end
  end
  task.create{ name = name .. "_runs", steps = steps }
  cell:add_task{ task = name .. "_runs", robot = name }
end

--- Takes away what stands at `at`, along `axis`, when the tool of `robot` has gone up from it.
function belts.take(cell, given)
  local n, a, p = given.count, given.axis, given.at
  local name, pitch, low = given.name, given.pitch, given.height + 0.0003
  local length = (n + 1) * pitch + 0.1
  local along = math.abs(a[1]) > 0.5
  local middle = pitch * (n - 1) / 2
  solid.create{ name = name .. "_bed", root = {kind = "box", x = along and length or 0.12,
    y = along and 0.12 or length, z = 0.03, position = {a[1] * middle, a[2] * middle, -low - 0.03}} }
  robot.create{ name = name, links = {{name = "cloth", joint = "prismatic", origin = {0, 0, 0},
    axis = {a[1], a[2], 0}, lower = -0.01, upper = (n + 1) * pitch, max_velocity = 0.6,
    max_acceleration = 4, max_jerk = 100, parts = {{what = bar(name, a, pitch / 2, given.height)}}}},
    base_parts = {{what = name .. "_bed"}} }
  cell:add_robot{ robot = name, name = name, position = p, q = {0} }
  local steps = {}
  for i = 1, n do
    local part = given.prefix .. i
    -- It is there, and the tool is not.
    steps[#steps + 1] = {step = "wait", condition = string.format(
      "abs(%s.x - %.5f m) < 2 mm and abs(%s.y - %.5f m) < 2 mm and %s.z < %.5f m and %s.z > %.5f m",
      part, p[1], part, p[2], part, p[3] + 0.001, given.robot, p[3] + 0.04)}
    -- The only body of the cloth is its bar; it takes what stands anywhere on the bed.
    steps[#steps + 1] = {step = "attach", object = part, link = "cloth", reach = length}
    steps[#steps + 1] = {step = "move", joints = {i * pitch}}
  end
  task.create{ name = name .. "_runs", steps = steps }
  cell:add_task{ task = name .. "_runs", robot = name }
end

--- A block with its origin in the middle of its top, where a cup takes it.
function belts.block(name, x, y, z)
  return solid.create{ name = name, root = {kind = "box", x = x, y = y, z = z, position = {0, 0, -z}} }
end

return belts
