-- SPDX-License-Identifier: Apache-2.0
-- A SCARA takes boxes from a conveyor and stacks them on a pallet, five a layer, each layer turned
-- against the one below. Arm and conveyor run tasks of their own on one clock and wait for each
-- other by signals. The arm is as fast as velocity, acceleration and jerk of its joints allow: it
-- passes the end of a lift and the start of a descent in motion, all joints in one flow.
-- usage: robomosp run scripts/demos/palletising.lua [folder [quality of the pictures]]
local folder, quality = arg and arg[1], arg and arg[2] or "draft"

-- Lengths in m.
local long, wide, high = 0.12, 0.08, 0.05  -- of a box
local gap = 0.002                          -- between boxes of a layer
local air = 0.0002                         -- under a box when it is let go
local pitch = 0.1                          -- from box to box on the belt
local layers = 3
local pallet = {x = 0.36, y = 0.4, top = 0.1}
local take = {x = 0.45, y = -0.32, top = 0.14}  -- where the belt brings the boxes

-- Joint limits: velocity, acceleration, jerk [rad or m, s].
local limits = {shoulder = {6.5, 45, 1500}, elbow = {11, 70, 2500}, quill = {1.2, 16, 500},
                turn = {20, 250, 8000}}

-- Places of the boxes' bottoms. A layer of 240 x 200 mm has two boxes along x and three across it;
-- what is farther from the belt comes first, so that nothing is carried over what stands higher.
local places = {}
for layer = 1, layers do
  local rows = {{count = 2, x = long, y = wide, turn = 0}, {count = 3, x = wide, y = long, turn = math.pi / 2}}
  if layer % 2 == 0 then rows[1], rows[2] = rows[2], rows[1] end
  local y = (long + wide + gap) / 2
  for _, row in ipairs(rows) do
    for i = 1, row.count do
      places[#places + 1] = {x = pallet.x + (i - (row.count + 1) / 2) * (row.x + gap),
        y = pallet.y + y - row.y / 2, z = pallet.top + air + (layer - 1) * (high + air), turn = row.turn}
    end
    y = y - row.y - gap
  end
end
local count = #places

-- Bodies.
local function paint(name, colour) return material.create{ name = name, density = 1500, colour = colour } end
local white, blue, red = paint("arm_white", "#e8e6e0"), paint("arm_blue", "#33527f"), paint("cup_rubber", "#d0442c")
local card, timber = paint("cardboard", "#c89b62"), paint("timber", "#a9814f")
local dark, belt_cloth = paint("frame_grey", "#4a4f55"), paint("belt_cloth", "#26282b")
local function cylinder(radius, height, x, z)
  return {kind = "cylinder", radius = radius, height = height, position = {x, 0, z}}
end
local function box(x, y, z, middle)
  return {kind = "box", x = x, y = y, z = z, position = {middle[1], middle[2], middle[3] - z / 2}}
end
local function union(name, of, children)
  return solid.create{ name = name, material = of, root = {kind = "union", children = children} }
end
local carton = union("carton", card, {box(long, wide, high, {0, 0, high / 2})})
local boxed = object.create{ name = "box", parts = {{what = carton}} }
local deck = {}
for i = -2, 2 do deck[#deck + 1] = box(0.26, 0.036, 0.016, {0, i * 0.046, pallet.top - 0.008}) end
for i = -1, 1 do
  deck[#deck + 1] = box(0.04, 0.22, pallet.top - 0.016, {i * 0.11, 0, (pallet.top - 0.016) / 2})
end
local pallet_body = union("pallet_body", timber, deck)

-- The arm: a1 and a2 in the plane, then down along the quill, whose frame looks down.
local a1, a2, height, tool = 0.4, 0.36, 0.52, 0.045
local column = union("column", white, {cylinder(0.085, height - 0.06, 0, 0), cylinder(0.13, 0.025, 0, 0)})
local upper = union("upper_arm", blue, {cylinder(0.085, 0.1, -a1, -0.05), cylinder(0.07, 0.1, 0, -0.05),
  box(a1, 0.1, 0.08, {-a1 / 2, 0, 0})})
local fore = union("fore_arm", white, {cylinder(0.07, 0.09, -a2, -0.15), cylinder(0.055, 0.09, 0, -0.15),
  box(a2, 0.085, 0.075, {-a2 / 2, 0, -0.105}), cylinder(0.045, 0.12, -a2 * 0.55, -0.24)})
local rod = union("rod", dark, {cylinder(0.014, 0.56, 0, -0.56)})
local cup = union("cup", red, {cylinder(0.01, 0.03, 0, 0), cylinder(0.03, tool - 0.03, 0, 0.03)})
local function arm_with(name, held)
  local links = {
    {name = "shoulder", a = a1, d = height, lower = -2.3, upper = 2.3, parts = {{what = upper}}},
    {name = "elbow", a = a2, alpha = math.pi, lower = -2.5, upper = 2.5, parts = {{what = fore}}},
    {name = "quill", joint = "prismatic", lower = 0, upper = 0.4, parts = {{what = rod}}},
    {name = "turn", lower = -2 * math.pi, upper = 2 * math.pi, parts = held}}
  for _, l in ipairs(links) do
    l.max_velocity, l.max_acceleration, l.max_jerk = table.unpack(limits[l.name])
  end
  return robot.create{ name = name, convention = "dh", links = links, base_parts = {{what = column}},
                       tool = {0, 0, tool, 0, 0, 0} }
end
local arm = arm_with("stacker", {{what = cup}})

-- The conveyor: its belt is a sliding joint that carries the boxes; a bar pushes the last one.
local length = count * pitch + 0.16
local bed = union("bed", dark, {box(length, 0.03, 0.05, {length / 2 - 0.07, 0.085, take.top - 0.02}),
  box(length, 0.03, 0.05, {length / 2 - 0.07, -0.085, take.top - 0.02}),
  box(0.04, 0.2, take.top - 0.03, {0.02, 0, (take.top - 0.03) / 2}),
  box(0.04, 0.2, take.top - 0.03, {length - 0.2, 0, (take.top - 0.03) / 2})})
local cloth = union("cloth", belt_cloth, {box(length - 0.02, 0.138, 0.028, {length / 2 - 0.07, 0, take.top - 0.014 - air})})
local pusher = union("pusher", red, {box(0.012, 0.13, 0.03, {count * pitch - 0.03, 0, take.top + 0.0155})})
local function conveyor_with(name, queue)
  local parts = {{what = pusher}}
  for _, k in ipairs(queue) do
    parts[#parts + 1] = {what = boxed, position = {(k - 1) * pitch, 0, take.top}, rpy = {0, 0, math.pi / 2}}
  end
  return robot.create{ name = name, links = {{name = "belt", joint = "prismatic", origin = {0, 0, 0},
    axis = {-1, 0, 0}, lower = -0.01, upper = count * pitch, max_velocity = 0.8, max_acceleration = 6,
    max_jerk = 200, parts = parts}}, base_parts = {{what = bed}, {what = cloth}} }
end
local conveyor = conveyor_with("conveyor", {})

-- Joint values with the cup at a place, elbow to one side; `turn` is the box's.
local function joints(x, y, z, turn)
  local c = (x^2 + y^2 - a1^2 - a2^2) / (2 * a1 * a2)
  local q2 = math.acos(c)
  local q1 = math.atan(y, x) - math.atan(a2 * math.sin(q2), a1 + a2 * c)
  local q4 = q1 + q2 - turn
  q4 = q4 - math.pi * math.floor(q4 / math.pi + 0.5)  -- half a turn is the same for a box
  return {q1, q2, height - tool - z, q4}
end

-- Up from `from` by `lift`, over, and down to `to` by `drop`; the quill passes the corners at
-- `up` and `down` m/s.
local function flight(name, from, to, lift, drop, up, down)
  local above, over = {table.unpack(from)}, {table.unpack(to)}
  above[3], over[3] = from[3] - lift, to[3] - drop
  return trajectory.create{ name = name, segments = {
    {shape = "time_optimal", joints = {from, above}, end_velocity = {0, 0, -up, 0}},
    {shape = "time_optimal", joints = {over}, end_velocity = {0, 0, down, 0}},
    {shape = "time_optimal", joints = {to}} } }
end
-- The fastest of a few speeds at the corners.
local trial = world.create{ name = "trial" }
trial:add_robot{ robot = arm }
local tried = 0
local function fastest(name, from, to, lift, drop)
  local best, least, fault
  trial:set_robot_q{ robot = "stacker", q = from }
  for _, up in ipairs{0, 0.35, 0.7} do
    for _, down in ipairs{0, 0.35, 0.7} do
      local way = flight("try", from, to, lift, drop, up, down)
      trial:add_trajectory{ trajectory = way }
      local made, run = pcall(trial.inverse_kinematics, trial, {robot = "stacker", trajectory = "try", sample_time = 0.1})
      if made then
        local t = run:values("time")
        if not least or t[#t] < least then best, least = {up, down}, t[#t] end
        run:remove()
      else
        fault = run
      end
      trial:remove_member("try")
      way:remove()
      tried = tried + 1
    end
  end
  assert(best, fault)
  return flight(name, from, to, lift, drop, best[1], best[2]), least
end

local cell = world.create{ name = "palletising" }
local at_take = joints(take.x, take.y, take.top + high, math.pi / 2)
local function joints_at(p) return joints(p.x, p.y, p.z + high, p.turn) end
cell:add_robot{ robot = arm, q = at_take }
cell:add_robot{ robot = conveyor, position = {take.x, take.y, 0}, q = {0} }
cell:add_object{ what = pallet_body, name = "pallet", position = {pallet.x, pallet.y, 0} }
for _, signal in ipairs{"ready", "taken"} do cell:add_signal{ name = signal } end
local arm_steps, belt_steps = {}, {}
local function step(list, s) list[#list + 1] = s end
step(belt_steps, {step = "set", signal = "ready", value = 1})
local carries = {}
for i, place in ipairs(places) do
  local name = "box_" .. i
  cell:add_object{ what = boxed, name = name, position = {take.x + (i - 1) * pitch, take.y, take.top}, rpy = {0, 0, math.pi / 2} }
  cell:attach{ object = name, robot = "conveyor", link = "belt", position = {(i - 1) * pitch, 0, take.top}, rpy = {0, 0, math.pi / 2} }
  local there = joints_at(place)
  -- The box goes straight up and down as long as others stand beside it.
  local beside = high + 0.012
  carries[i] = fastest("carry_" .. i, at_take, there, beside, beside)
  local back = fastest("back_" .. i, there, at_take, 0.012, 0.012)
  step(arm_steps, {step = "wait", condition = "ready == 1"})
  step(arm_steps, {step = "set", signal = "ready", value = 0})
  step(arm_steps, {step = "attach", object = name})
  step(arm_steps, {step = "set", signal = "taken", value = 1})
  step(arm_steps, {step = "move", trajectory = carries[i]})
  step(arm_steps, {step = "detach", object = name})
  step(arm_steps, {step = "move", trajectory = back})
  if i < count then
    step(belt_steps, {step = "wait", condition = "taken == 1"})
    step(belt_steps, {step = "set", signal = "taken", value = 0})
    step(belt_steps, {step = "wait", time = 0.15})  -- until the box is off the belt
    step(belt_steps, {step = "move", joints = {i * pitch}, profile = "time_optimal"})
    step(belt_steps, {step = "set", signal = "ready", value = 1})
  end
end
task.create{ name = "stack", steps = arm_steps }
task.create{ name = "feed", steps = belt_steps }
cell:add_task{ task = "stack", robot = "stacker" }
cell:add_task{ task = "feed", robot = "conveyor" }
local dt = 0.005
local run = cell:run_task{ sample_time = dt }
local times = run:values("time")
local total = times[#times]
print(string.format("%d boxes in %.2f s: %.3f s a cycle, %.0f boxes an hour (%d flights tried)", count, total,
  total / count, 3600 * count / total, tried))

-- What of the limits is used.
for j, link in ipairs{"shoulder", "elbow", "quill", "turn"} do
  local speed = array(run:values("stacker.qd" .. j))
  local v, a = 0, 0
  for i = 2, #speed do
    v = math.max(v, math.abs(speed[i]))
    if times[i] - times[i - 1] > dt / 2 then
      a = math.max(a, math.abs(speed[i] - speed[i - 1]) / (times[i] - times[i - 1]))
    end
  end
  print(string.format("  %-8s up to %3.0f %% of its speed, %3.0f %% of its acceleration", link,
    100 * v / limits[link][1], 100 * a / limits[link][2]))
  assert(v <= limits[link][1] * 1.001 and a <= limits[link][2] * 1.01)
end

-- Every box is where it belongs.
local worst = 0
for i, p in ipairs(places) do
  local function last(part) local v = run:values("box_" .. i .. part) return v[#v] end
  local turn = 2 * math.atan(last(".qz"), last(".qw")) - p.turn
  turn = turn - math.pi * math.floor(turn / math.pi + 0.5)
  worst = math.max(worst, math.sqrt((last(".x") - p.x)^2 + (last(".y") - p.y)^2 + (last(".z") - p.z)^2))
  assert(math.abs(turn) < 1e-3, "box " .. i .. " is turned")
end
assert(worst < 1e-4, "a box is not at its place")
print(string.format("boxes are within %.4f mm of their places", 1000 * worst))

-- The carried box against stack, belt and its boxes: an arm that has the box as a part of it.
local carton_held = {what = boxed, position = {0, 0, tool + high}, rpy = {math.pi, 0, 0}}
local loaded = arm_with("loaded", {{what = cup}, carton_held})
local check = world.create{ name = "check" }
check:add_robot{ robot = loaded, name = "arm" }
check:add_object{ what = pallet_body, name = "pallet", position = {pallet.x, pallet.y, 0} }
local let_go, taken = {}, {}
for _, note in ipairs(run:notes()) do
  local t, box_number = note:match("^t = ([%d.e-]+) s: stacker takes box_(%d+)")
  if t then taken[tonumber(box_number)] = tonumber(t) end
  t, box_number = note:match("^t = ([%d.e-]+) s: box_(%d+) is released")
  if t then let_go[tonumber(box_number)] = tonumber(t) end
end
local q = {}
for j = 1, 4 do q[j] = run:values("stacker.q" .. j) end
local belt = run:values("conveyor.q1")
local least, row, looked = 1, 1, 0
for i, place in ipairs(places) do
  local queue = {}
  for k = i + 1, count do queue[#queue + 1] = k end
  local fed = conveyor_with("fed_" .. i, queue)
  check:add_robot{ robot = fed, name = "conveyor", position = {take.x, take.y, 0} }
  local rows = {}
  for n = row, #times do
    if times[n] >= taken[i] - 1e-9 and times[n] <= let_go[i] + 1e-9 then rows[#rows + 1] = n end
    if times[n] > let_go[i] then row = n break end
  end
  for n = 1, #rows, 4 do
    local k = rows[n]
    local near = check:clearance{ exact = true, q = {arm = {q[1][k], q[2][k], q[3][k], q[4][k]}, conveyor = {belt[k]}} }
    assert(near.distance > air / 2, string.format("at %.2f s %s and %s touch", times[k], near.a, near.b))
    least, looked = math.min(least, near.distance), looked + 1
  end
  check:remove_member("conveyor")
  check:add_object{ what = boxed, name = "box_" .. i, position = {place.x, place.y, place.z}, rpy = {0, 0, place.turn} }
end
print(string.format("nothing touches: at least %.2f mm of air in %d places looked at", 1000 * least, looked))

-- Pictures: the first box is taken, one is on its way, all are stacked; and one flight's speeds.
for name, at in pairs{ start = 0.02, carried = 0.45 * taken[9] + 0.55 * let_go[9], stacked = total } do
  if folder then
    local drawn, fault = pcall(cell.render, cell, { recording = run, at = at, quality = quality,
      file = folder .. "/palletising_" .. name .. ".png", size = {680, 510}, axes = false,
      eye = {2.15, 1.4, 1.45}, target = {0.44, -0.08, 0.35} })
    if not drawn then print(fault) end  -- such as: no renderer is installed
  end
end
cell:add_trajectory{ trajectory = carries[9] }
cell:set_robot_q{ robot = "stacker", q = at_take }
local flown = cell:inverse_kinematics{ robot = "stacker", trajectory = "carry_9", sample_time = 0.002 }
if folder then
  flown:plot{ file = folder .. "/palletising_speeds.svg", columns = "qd", limits = true,
    title = "One flight: joint speeds, and what is beyond their limits" }
end

return run  -- what a window plays
