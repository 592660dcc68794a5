-- SPDX-License-Identifier: Apache-2.0
-- Pictures of the way that a robot's tool goes under a program of scripts/programs: the Towers of
-- Hanoi on three robots, parts from a feeder, a pallet, two robots, and a seam, straight and woven.
-- usage: robomosp run scripts/demos/program_pictures.lua [folder [quality of the pictures]]
local folder, quality = arg and arg[1] or ".", arg and arg[2] or "draft"
local programs = ((arg and arg[0] or ""):match("^(.*)/demos/[^/]*$") or "scripts") .. "/programs/"

-- A trajectory through the places that the tool came to, a point each centimetre, or `pitch`.
-- `what`: the robot, or an object at its tool. `while_set`: only while this signal is 1.
local function traced(cell, run, what, name, pitch, while_set)
  if what ~= "rod" then run:compute{ quantities = {"pose"}, robot = what } end
  local x, y, z = run:values(what .. ".x"), run:values(what .. ".y"), run:values(what .. ".z")
  local is_set = while_set and run:values("signal." .. while_set)
  local most, rounding = (pitch or 0.01)^2, pitch and pitch / 5 or 0.001
  -- A new segment wherever the way turns back.
  local segments, points, before = {}, {}, nil
  local function close()
    if #points > 1 then
      segments[#segments + 1] = {shape = "teach_points", points = points, rounding = rounding,
        transition = #segments > 0 and "none" or nil}
    end
    points = {points[#points]}
  end
  for i = 1, #x do
    local last = points[#points]
    local d = last and {x[i] - last[1], y[i] - last[2], z[i] - last[3]}
    if (not is_set or is_set[i] == 1) and (not last or d[1]^2 + d[2]^2 + d[3]^2 > most) then
      if before and before[1] * d[1] + before[2] * d[2] + before[3] * d[3] < 0 then close() end
      points[#points + 1] = {x[i], y[i], z[i], 0, 0, 0}
      before = d
    end
  end
  close()
  trajectory.create{ name = name, segments = segments }
  cell:add_trajectory{ trajectory = name }
end

local function picture(name, script, what, at, argument, eye, target)
  local before = arg
  arg = {[0] = programs .. script .. ".lua", argument}
  local cell, run = dofile(programs .. script .. ".lua")
  arg = before
  for _, one in ipairs(type(what) == "table" and what or {what}) do
    traced(cell, run, one, name .. "_way_" .. one)
  end
  -- The program's frame stands in the robot's foot, where only its name would be seen.
  for _, frame in ipairs(cell:describe().frames) do cell:remove_member(frame.name) end
  local drawn, trouble = pcall(cell.render, cell, { recording = run, at = at, quality = quality,
    paths = "line", axes = false, eye = eye, target = target, file = folder .. "/" .. name .. ".png" })
  if not drawn then print(trouble) end  -- such as: no renderer is installed
end

for _, robot in ipairs{"pa10", "puma560", "ur5"} do
  picture("program_hanoi_" .. robot, "hanoi", "rod", 30, robot)
end
picture("program_pick_and_place", "pick_and_place", "ur5", 16,
  nil, {2.7, -1.2, 1.9}, {0.15, 0.0, 0.5})
picture("program_palletising", "palletising", "kr5", 30,
  nil, {2.9, -1.5, 2.0}, {0.5, 0.15, 0.4})
picture("program_two_robots", "two_robots", {"left", "right"}, 9,
  nil, {3.4, -0.9, 2.2}, {0.2, 0.0, 0.2})
picture("program_weld", "arc_weld", "ur5", 30,
  nil, {1.35, -0.85, 0.75}, {0.45, -0.08, 0.25})

-- The same seam with the torch upright, woven 4 mm to each side, over 12 mm of the way.
do
  local cell, seam = world "arc_weld_cell", program "arc_weld"
  local source = seam:source():gsub("SPEED := WELDING", "SPEED := WELDING, WOBBLE := TRUE")
  source = source:gsub("  arc := TRUE;", "  R_WOBBLE_AMPLITUDE := 4.0;\n  R_WOBBLE_LENGTH := 12.0;\n  arc := TRUE;")
  seam:set_file{ name = "arc_weld.irl", text = source:gsub("ORIZYX%(0.0, 135.0, 0.0%)", "ORIZYX(0.0, 180.0, 0.0)") }
  cell:remove_member("program_weld_way_ur5")
  local run = cell:run_task{}
  traced(cell, run, "ur5", "program_weave_way", 0.0008, "arc")
  local drawn, trouble = pcall(cell.render, cell, { recording = run, at = 38, quality = quality,
    paths = "line", eye = {0.98, -0.3, 0.42}, target = {0.585, -0.085, 0.12}, axes = false,
    file = folder .. "/program_weave.png" })
  if not drawn then print(trouble) end  -- such as: no renderer is installed
end
