-- SPDX-License-Identifier: Apache-2.0
-- Five parts from a feeder to a tray by scripts/programs/pick_and_place.irl. A belt brings them, and
-- another one takes them from the tray; a second program is the feeder: it tells that a part is there
-- while the lamp is on. The check warns that the straight motions to pick and place end with STATUS 0
-- where their targets say 2: they keep the branch in which the arm comes, on a UR5.
-- usage: robomosp run scripts/programs/pick_and_place.lua
local here = (arg and arg[0] or ""):match("^(.*)/[^/]*$") or "scripts/programs"
local belts = dofile(here .. "/belts.lua")
local cell = world.create{ name = "pick_and_place_cell" }
local arm = robot.get("ur5"):duplicate{ name = "placer" }
arm:attach{ tool = object.get("suction_cup"), tcp = "rim" }
cell:add_robot{ robot = arm, name = "ur5" }
for _, name in ipairs{"part_here", "tray_ok"} do cell:add_signal{ name = name } end
cell:add_signal{ name = "lamp", kind = "analogue" }
belts.block("part_of_feeder", 0.04, 0.04, 0.04)
belts.bring(cell, { name = "feeder_belt", what = "part_of_feeder", prefix = "part", count = 5, pitch = 0.12,
  height = 0.04, at = {0.55, -0.3, 0.12}, axis = {1, 0} })
belts.take(cell, { name = "tray_belt", prefix = "part", count = 5, pitch = 0.12, height = 0.04,
  at = {0.55, 0.3, 0.08}, axis = {0, 1}, robot = "ur5" })
local pick = program.import{ file = here .. "/pick_and_place.irl" }
cell:add_program{ program = pick, robot = "ur5" }
local feeder = program.create{ name = "feeder", source = [[
PROGRAM feeder;
SIGNAL
  OUTPUT BOOL: part_here AT 1;
  INPUT  INT:  lamp AT 10, 4;
BEGIN
  WAIT FOR lamp = 1;
  WAIT 1.0 SEC;
  part_here := TRUE;
  WAIT FOR lamp = 0;
  part_here := FALSE;
ENDPROGRAM;
]] }
cell:add_program{ program = feeder, robot = "ur5" }
local run = cell:run_task{}
for _, note in ipairs(run:notes()) do print(note) end
local t = run:values("time")
print(string.format("%.2f s", t[#t]))
return cell, run
