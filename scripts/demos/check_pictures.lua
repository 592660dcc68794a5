-- SPDX-License-Identifier: Apache-2.0
-- Pictures of programs that are checked by a run: one that goes through a post and out of reach,
-- its joints against their limits, and the seam of scripts/programs.
-- usage: robomosp run scripts/demos/check_pictures.lua [folder [quality of the pictures]]
local folder, quality = arg and arg[1] or ".", arg and arg[2] or "draft"
local programs = ((arg and arg[0] or ""):match("^(.*)/demos/[^/]*$") or "scripts") .. "/programs/"
local function draw(program, given)
  local made, trouble = pcall(program.check_run, program, given)
  if not made then print(trouble) end  -- such as: no renderer is installed
  return made and trouble or program:check_run{ world = given.world, name_there = given.name_there }
end

local cell = world.create{ name = "checked_cell" }
cell:add_robot{ robot = robot.get("ur5"), name = "ur5", q = {0, "-90 deg", "90 deg", "-90 deg", "-90 deg", 0} }
solid.create{ name = "checked_post", root = {kind = "box", x = 0.06, y = 0.06, z = 0.6} }
cell:add_object{ what = "checked_post", name = "post", position = {0.55, 0.05, 0} }
local carry = program.create{ name = "carry", source = [[
PROGRAM carry;
VAR
  ORIENTATION: down := ORIZYX(0.0, 180.0, 0.0);
BEGIN
  MOVE PTP POSE(POSITION(500.0, -350.0, 350.0), down);
  MOVE LIN POSE(POSITION(500.0, -350.0, 200.0), down) SPEED := 250.0;
  MOVE LIN POSE(POSITION(500.0, 350.0, 200.0), down) SPEED := 800.0;
  MOVE LIN POSE(POSITION(500.0, 350.0, 350.0), down) SPEED := 250.0;
  MOVE LIN POSE(POSITION(900.0, 350.0, 350.0), down) SPEED := 250.0;
  MOVE PTP POSE(POSITION(500.0, -350.0, 350.0), down);
ENDPROGRAM;
]] }
cell:add_program{ program = carry }
local found = draw(carry, { world = cell, picture = folder .. "/check_faults.png", quality = quality,
  eye = {1.9, -1.2, 1.1}, target = {0.35, 0.05, 0.3} })
print(found.report)
draw(carry, { world = cell, plot = folder .. "/check_plot.png" })

arg = {[0] = programs .. "arc_weld.lua"}
local weld = dofile(arg[0])
draw(program.get("arc_weld"), { world = weld, picture = folder .. "/check_weld.png", quality = quality,
  eye = {1.35, -0.85, 0.75}, target = {0.45, -0.08, 0.25} })
