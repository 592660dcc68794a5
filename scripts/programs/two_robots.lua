-- SPDX-License-Identifier: Apache-2.0
-- One robot brings parts and another takes them away, by scripts/programs/two_robots.irl: two
-- processes of one program, each with a robot, and two semaphores. A belt brings the parts, and
-- another takes the first two from where the second robot leaves them; over the third it stays.
-- usage: robomosp run scripts/programs/two_robots.lua
local here = (arg and arg[0] or ""):match("^(.*)/[^/]*$") or "scripts/programs"
local belts = dofile(here .. "/belts.lua")
local cell = world.create{ name = "two_robots_cell" }
local ur5 = robot.get("ur5"):duplicate{ name = "carrier" }
ur5:attach{ tool = object.get("suction_cup"), tcp = "rim" }
cell:add_robot{ robot = ur5, name = "left", position = {0, -0.6, 0} }
cell:add_robot{ robot = ur5, name = "right", position = {0, 0.6, 0} }
belts.block("passed_part", 0.05, 0.05, 0.05)
belts.bring(cell, { name = "left_belt", what = "passed_part", prefix = "part", count = 3, pitch = 0.15,
  height = 0.05, at = {0.5, -0.9, 0.15}, axis = {0, -1} })
belts.take(cell, { name = "right_belt", prefix = "part", count = 2, pitch = 0.15, height = 0.05,
  at = {0.5, 0.9, 0.15}, axis = {0, 1}, robot = "right" })
solid.create{ name = "passing_table", root = {kind = "box", x = 0.2, y = 0.2, z = 0.02, position = {0, 0, -0.0703}} }
cell:add_object{ what = "passing_table", name = "table", position = {0.3, 0, 0.15} }
local both = program.import{ file = here .. "/two_robots.irl" }
cell:add_program{ program = both }
both:bind{ kind = "grip", name = "left_gripper", robot = "left" }
both:bind{ kind = "grip", name = "right_gripper", robot = "right" }
local run = cell:run_task{}
for _, note in ipairs(run:notes()) do print(note) end
local t = run:values("time")
print(string.format("%.2f s", t[#t]))
return cell, run
