-- SPDX-License-Identifier: Apache-2.0
-- Twenty-four parts on a tray that stands askew, by scripts/programs/palletising.irl. A belt brings
-- them one by one.
-- usage: robomosp run scripts/programs/palletising.lua
local here = (arg and arg[0] or ""):match("^(.*)/[^/]*$") or "scripts/programs"
local belts = dofile(here .. "/belts.lua")
local cell = world.create{ name = "palletising_cell" }
local arm, reach = robot.get("kr5"):duplicate{ name = "palletiser" }, 0.12
arm:add_tool{ name = "cup_tip", link = 6, position = {0, 0, reach} }
cell:add_robot{ robot = arm, name = "kr5" }
solid.create{ name = "palletising_cup", root = {kind = "union", children = {
  {kind = "cylinder", radius = 0.012, height = reach}, {kind = "cylinder", radius = 0.025, height = 0.02}}} }
cell:add_object{ what = "palletising_cup", name = "cup" }
cell:attach{ object = "cup", robot = "kr5", link = "cup_tip", rpy = {math.pi, 0, 0} }
-- Nearer to the robot some of the straight ways would pass a singularity of the wrist.
local x, z = 0.2, 0.05
cell:add_frame{ name = "floor", position = {x, 0, z} }
belts.block("palletised_part", 0.09, 0.07, 0.06)
belts.bring(cell, { name = "part_belt", what = "palletised_part", prefix = "part", count = 24, pitch = 0.11,
  height = 0.06, at = {x + 0.3, 0.45, z + 0.15}, axis = {0, 1} })
solid.create{ name = "pallet_tray", root = {kind = "box", x = 0.46, y = 0.28, z = 0.02,
  position = {0.165, 0.085, -0.0805}} }
cell:add_object{ what = "pallet_tray", name = "tray", position = {x + 0.7, -0.2, z + 0.02}, rpy = {0, 0, math.rad(30)} }
local fill = program.import{ file = here .. "/palletising.irl" }
cell:add_program{ program = fill, robot = "kr5" }
fill:bind{ kind = "robot", frame = "floor", tool = "cup_tip" }
local run = cell:run_task{}
local notes = run:notes()
print(notes[#notes])
local t = run:values("time")
print(string.format("%.2f s", t[#t]))
return cell, run
