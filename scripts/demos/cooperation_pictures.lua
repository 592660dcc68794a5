-- SPDX-License-Identifier: Apache-2.0
-- The picture of the page on cooperation: the moment at which the bar changes hands. The world is that of
-- sdk/clients/cooperation, the two programs are two connections of this one.
--   robomosp run scripts/demos/cooperation_pictures.lua docs/images normal
local remote = require "remote"
local folder, quality = arg and arg[1], arg and arg[2] or "draft"

local here = arg and arg[0]:match("^(.*)/[^/]*$") or "."
local scene
for _, path in ipairs{here .. "/../../sdk/clients/cooperation/cell.lua", here .. "/../clients/cooperation/cell.lua"} do
  scene = scene or loadfile(path)
end
assert(scene, "cell.lua of the clients is not there")()

local serving = server.start{ addresses = {"127.0.0.1:0"} }
local function connect(name)
  local r = remote.connect{ address = serving.addresses[1], client = name }
  return r, r.world.get "cell"
end
local pi, left, right = math.pi, {}, {}
left.r, left.cell = connect "left"
right.r, right.cell = connect "right"

-- Runs a task of a robot and leaves it where it ends.
local function run(who, name, steps)
  local cell = who.cell
  who.r.task.create{ name = name, steps = steps }
  cell:add_task{ task = name, robot = name == "fetch" and "left" or "right" }
  local recording, q = cell:run_task{ task = name }, {}
  for j = 1, 6 do
    local values = recording:values((name == "fetch" and "left" or "right") .. ".q" .. j)
    q[j] = values[#values]
  end
  return q
end

local q = run(left, "fetch", {
  {step = "move", target = {0.40, 0.30, 0.52, pi, 0, pi}},
  {step = "move", target = {0.40, 0.30, 0.42, pi, 0, pi}, path = "straight"},
  {step = "attach", object = "bar"},
  {step = "move", target = {0.40, 0.30, 0.57, pi, 0, pi}, path = "straight"},
  {step = "move", target = {-0.10, 0, 0, pi, -pi / 2, 0}, frame = "middle"}})
left.cell:attach{ object = "bar", robot = "left", position = {0, 0, 0.22}, rpy = {0, pi, 0} }
left.cell:set_robot_q{ robot = "left", q = q }
left.cell:set_signal("offered", 1)

assert(right.r.server.wait{ signal = "offered", client = "left", timeout = 10 } == 1)
q = run(right, "take", {
  {step = "move", target = {0.17, 0, 0, pi, pi / 2, 0}, frame = "middle"},
  {step = "move", target = {0.10, 0, 0, pi, pi / 2, 0}, frame = "middle", path = "straight"}})
right.cell:set_robot_q{ robot = "right", q = q }
right.cell:attach{ object = "bar", robot = "right", position = {0, 0, -0.02} }

local held
for _, a in ipairs(world.attachments("cell")) do
  if a.object == "bar" then
    assert(not held, "two hands hold the bar")
    held = a.robot
  end
end
assert(held == "right")
print("the bar is in the hand of the " .. held .. " robot")
left.r:close()
right.r:close()

if folder then
  local drawn, trouble = pcall(world.render, { id = "cell", file = folder .. "/cooperation_taken.png", size = {780, 520},
    quality = quality, axes = false, eye = {0.75, 3.1, 1.4}, target = {0.75, 0.15, 0.38} })
  if not drawn then print(trouble) end  -- such as: no renderer is installed
end
server.stop()
