-- SPDX-License-Identifier: Apache-2.0
-- One robot brings parts and another takes them away, by scripts/programs/two_robots.irl: two
-- processes of one program, each with a robot, and two semaphores.
-- usage: robomosp run scripts/programs/two_robots.lua
local here = (arg and arg[0] or ""):match("^(.*)/[^/]*$") or "scripts/programs"
local cell = world.create{ name = "two_robots_cell" }
local ur5 = robot.get("ur5")
cell:add_robot{ robot = ur5, name = "left", position = {0, -0.6, 0} }
cell:add_robot{ robot = ur5, name = "right", position = {0, 0.6, 0} }
solid.create{ name = "passed_part", root = {kind = "box", x = 0.05, y = 0.05, z = 0.05} }
for i = 1, 3 do
  cell:add_object{ what = "passed_part", name = "part" .. i, position = {0.5, -0.9, 0.15} }
end
local both = program.import{ file = here .. "/two_robots.irl" }
cell:add_program{ program = both }
both:bind{ kind = "grip", name = "left_gripper", robot = "left" }
both:bind{ kind = "grip", name = "right_gripper", robot = "right" }
local run = cell:run_task{}
for _, note in ipairs(run:notes()) do print(note) end
local t = run:values("time")
print(string.format("%.2f s", t[#t]))
return cell, run
