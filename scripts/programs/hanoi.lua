-- SPDX-License-Identifier: Apache-2.0
-- The Towers of Hanoi by scripts/programs/hanoi.irl: three discs go from the first peg's place to
-- the third. One program serves every robot that reaches; its gripper takes what the tool touches.
-- usage: robomosp run scripts/programs/hanoi.lua [pa10|puma560|ur5 [folder for a picture]]
local which, folder = arg and arg[1] or "ur5", arg and arg[2]
local here = (arg and arg[0] or ""):match("^(.*)/[^/]*$") or "scripts/programs"

-- Where the robot stands over the table that the pegs are on [m].
local stand = ({pa10 = -0.2, puma560 = 0.0, ur5 = 0.0})[which] or 0
local thick, pegs = 0.03, {-0.25, 0, 0.25}

local cell = world.create{ name = "hanoi_" .. which }
-- A rod on the last link takes the discs at their middle.
local reach, links = 0.12, {pa10 = 7, puma560 = 6, ur5 = 6}
local arm = robot.get(which)
arm:add_tool{ name = "rod", link = links[which] or 6, position = {0, 0, reach} }
cell:add_robot{ robot = arm, name = which }
solid.create{ name = "hanoi_rod_" .. which, root = {kind = "cylinder", radius = 0.012, height = reach} }
cell:add_object{ what = "hanoi_rod_" .. which, name = "rod" }
cell:attach{ object = "rod", robot = which, link = "rod", rpy = {math.pi, 0, 0} }
cell:add_frame{ name = "table", position = {0, 0, stand} }
solid.create{ name = "hanoi_table_" .. which, root = {kind = "box", x = 0.4, y = 0.8, z = 0.02} }
cell:add_object{ what = "hanoi_table_" .. which, name = "board", position = {0.6, 0, stand - 0.0205} }
if stand < 0 then  -- the robot stands above the table, on a post
  solid.create{ name = "hanoi_post_" .. which, root = {kind = "cylinder", radius = 0.1, height = 0.0195 - stand} }
  cell:add_object{ what = "hanoi_post_" .. which, name = "post", position = {0, 0, stand - 0.0205} }
end
for i = 1, 3 do
  local name = "disc" .. i
  solid.create{ name = "hanoi_" .. name .. "_" .. which,
    root = {kind = "cylinder", radius = 0.1 - 0.02 * i, height = thick} }
  cell:add_object{ what = "hanoi_" .. name .. "_" .. which, name = name,
    position = {0.6, pegs[1], stand + thick * (i - 1)} }
end
local towers = program.import{ file = here .. "/hanoi.irl", name = "hanoi_on_" .. which }
cell:add_program{ program = towers, name = "hanoi" }
towers:bind{ kind = "robot", frame = "table", tool = "rod" }
local run = cell:run_task{}
for _, note in ipairs(run:notes()) do print(note) end
local t = run:values("time")
print(string.format("%s: %.2f s", which, t[#t]))
for i = 1, 3 do
  local at = {}
  for k, axis in ipairs{"x", "y", "z"} do
    local v = run:values("disc" .. i .. "." .. axis)
    at[k] = string.format("%.1f", 1000 * (v[#v] - (k == 3 and stand or 0)))
  end
  print("disc" .. i .. " at " .. table.concat(at, ", ") .. " mm")
end
return cell, run
