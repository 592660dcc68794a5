-- SPDX-License-Identifier: Apache-2.0
-- From a dimension of a part to the code of a controller: a bead of sealant goes around a bore, 2 mm
-- above the housing's top. The program's points are bound to the housing; a wider bore and a higher
-- housing are a wider and higher bead in KRL, and undo gives the bytes of before.
local cell = world.create{ name = "sealing_cell" }
local arm = robot.get("ur5"):duplicate{ name = "sealer" }
arm:attach{ tool = object.get("suction_cup"), tcp = "rim" }
cell:add_robot{ robot = arm, name = "ur5", q = {0, "-90 deg", "-90 deg", "-90 deg", "90 deg", 0} }
local housing = solid.create{ name = "housing", parameters = {height = "60 mm", bore = "40 mm"},
  root = {kind = "difference", children = {
    {kind = "box", name = "body", x = 0.2, y = 0.15, z = "height"},
    {kind = "cylinder", name = "bore", radius = "bore/2", height = "height + 2 mm", position = {0.03, 0.01, "-1 mm"}}}} }
cell:add_object{ what = housing, name = "housing", position = {0.5, 0.1, 0.05}, rpy = {0, 0, "30 deg"} }

local seal = program.create{ name = "seal", source = [[
PROGRAM seal;
{ Where the ring is and how wide follows the housing (program.bindings). }
CONST
  REAL: RADIUS := 20.0, LIFT := 50.0;       { mm }
VAR
  POSE: ring := POSE(POSITION(500.0, 0.0, 150.0), ORIZYX(0.0, 180.0, 0.0));
SIGNAL
  OUTPUT BOOL: valve AT 4;
BEGIN
  MOVE PTP ring @ POSE(POSITION(RADIUS, 0.0, -LIFT), ORIZYX(0.0, 0.0, 0.0));
  MOVE LIN ring @ POSE(POSITION(RADIUS, 0.0, 0.0), ORIZYX(0.0, 0.0, 0.0)) SPEED := 100.0;
  valve := TRUE;
  MOVE CIRCLE ring @ POSE(POSITION(0.0, RADIUS, 0.0), ORIZYX(0.0, 0.0, 0.0)),
              ring @ POSE(POSITION(-RADIUS, 0.0, 0.0), ORIZYX(0.0, 0.0, 0.0)) SPEED := 30.0;
  MOVE CIRCLE ring @ POSE(POSITION(0.0, -RADIUS, 0.0), ORIZYX(0.0, 0.0, 0.0)),
              ring @ POSE(POSITION(RADIUS, 0.0, 0.0), ORIZYX(0.0, 0.0, 0.0)) SPEED := 30.0;
  valve := FALSE;
  MOVE LIN ring @ POSE(POSITION(RADIUS, 0.0, -LIFT), ORIZYX(0.0, 0.0, 0.0)) SPEED := 100.0;
ENDPROGRAM;
]] }
cell:add_program{ program = seal, robot = "ur5" }
seal:bind{ kind = "free", name = "valve" }
-- The bore's node begins 1 mm under the housing; the tool looks down.
seal:bind{ kind = "point", name = "ring", to = "housing", at = "bore",
  position = {0, 0, "height + 3 mm"}, rpy = {"180 deg", 0, 0} }
seal:bind{ kind = "value", name = "RADIUS", to = "housing", expression = "bore/2 + 4 mm" }

local function code(target)
  local all = {}
  for _, f in ipairs(seal:post{ target = target, run_check = true }.files) do all[#all + 1] = f.text end
  return table.concat(all)
end
local function show(title)
  print(title)
  for line in code("krl"):gmatch("[^\n]+") do
    if line:find("E6POS XP[24]=") then print("  " .. line) end
  end
end
show("as drawn")
local before = code("krl")
housing:set_parameter("bore", "60 mm")
housing:set_parameter("height", "80 mm")
show("bore 60 mm, height 80 mm")
assert(code("krl") ~= before)
document.undo()
document.undo()
assert(code("krl") == before)
print("undone: the same " .. #before .. " bytes")
return cell, seal
