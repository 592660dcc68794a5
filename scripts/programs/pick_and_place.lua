-- SPDX-License-Identifier: Apache-2.0
-- Five parts from a feeder to a tray by scripts/programs/pick_and_place.irl. A second program is
-- the feeder: it tells that a part is there while the lamp is on. All parts stand at its end.
-- usage: robomosp run scripts/programs/pick_and_place.lua
local here = (arg and arg[0] or ""):match("^(.*)/[^/]*$") or "scripts/programs"
local cell = world.create{ name = "pick_and_place_cell" }
cell:add_robot{ robot = robot.get("ur5"), name = "ur5" }
for _, name in ipairs{"part_here", "tray_ok"} do cell:add_signal{ name = name } end
cell:add_signal{ name = "lamp", kind = "analogue" }
solid.create{ name = "part_of_feeder", root = {kind = "box", x = 0.04, y = 0.04, z = 0.04} }
for i = 1, 5 do
  cell:add_object{ what = "part_of_feeder", name = "part" .. i, position = {0.55, -0.3, 0.12} }
end
local pick = program.import{ file = here .. "/pick_and_place.irl" }
cell:add_program{ program = pick }
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
cell:add_program{ program = feeder }
local run = cell:run_task{}
for _, note in ipairs(run:notes()) do print(note) end
local t = run:values("time")
print(string.format("%.2f s", t[#t]))
return cell, run
