-- SPDX-License-Identifier: Apache-2.0
-- A seam of two straight pieces and half a circle by scripts/programs/arc_weld.irl. The power
-- source is a program that tells when its arc is stable. The plate lies 1.5 mm under the wire's tip,
-- so that the check warns all along the seam that torch and plate are nearer than 5 mm, as they are
-- when it welds.
-- usage: robomosp run scripts/programs/arc_weld.lua
local here = (arg and arg[0] or ""):match("^(.*)/[^/]*$") or "scripts/programs"
local cell = world.create{ name = "arc_weld_cell" }
local arm = robot.get("ur5"):duplicate{ name = "welder" }
-- The wire's tip leads; its z goes along the wire.
arm:attach{ tool = object.get("mig_torch_22"), tcp = "wire_tip" }
-- It waits above the table.
cell:add_robot{ robot = arm, name = "ur5", q = {0, "-90 deg", "-90 deg", "-90 deg", "90 deg", 0} }
-- The seam goes around a plate that lies on a table.
solid.create{ name = "weld_plate", root = {kind = "union", children = {
  {kind = "box", x = 0.12, y = 0.12, z = 0.01, position = {0.56, -0.09, 0.0885}},
  {kind = "cylinder", radius = 0.06, height = 0.01, position = {0.62, -0.09, 0.0885}}}} }
solid.create{ name = "weld_table", root = {kind = "box", x = 0.4, y = 0.4, z = 0.088, position = {0.58, -0.09, 0}} }
cell:add_object{ what = "weld_plate", name = "plate" }
cell:add_object{ what = "weld_table", name = "table" }
for _, name in ipairs{"arc", "arc_stable"} do cell:add_signal{ name = name } end
cell:add_program{ program = program.import{ file = here .. "/arc_weld.irl" } }
cell:add_program{ program = program.create{ name = "source", source = [[
PROGRAM source;
SIGNAL
  INPUT  BOOL: arc AT 5;
  OUTPUT BOOL: arc_stable AT 6;
BEGIN
  WAIT FOR arc;
  WAIT 0.2 SEC;
  arc_stable := TRUE;
  WAIT FOR NOT arc;
  arc_stable := FALSE;
ENDPROGRAM;
]] } }
local run = cell:run_task{}
local t, arc, burning = run:values("time"), run:values("signal.arc"), 0
for i = 2, #t do burning = burning + arc[i] * (t[i] - t[i - 1]) end
for _, note in ipairs(run:notes()) do print(note) end
print(string.format("%.2f s, the arc burns for %.2f s", t[#t], burning))
return cell, run
