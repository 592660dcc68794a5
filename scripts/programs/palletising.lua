-- SPDX-License-Identifier: Apache-2.0
-- Twenty-four parts on a tray that stands askew, by scripts/programs/palletising.irl. All of them
-- stand at the feeder's end.
-- usage: robomosp run scripts/programs/palletising.lua
local here = (arg and arg[0] or ""):match("^(.*)/[^/]*$") or "scripts/programs"
local cell = world.create{ name = "palletising_cell" }
cell:add_robot{ robot = robot.get("kr5"), name = "kr5" }
solid.create{ name = "palletised_part", root = {kind = "box", x = 0.09, y = 0.07, z = 0.06} }
for i = 1, 24 do
  cell:add_object{ what = "palletised_part", name = "part" .. i, position = {0.3, 0.45, 0.15} }
end
cell:add_program{ program = program.import{ file = here .. "/palletising.irl" } }
local run = cell:run_task{}
local notes = run:notes()
print(notes[#notes])
local t = run:values("time")
print(string.format("%.2f s", t[#t]))
return cell, run
