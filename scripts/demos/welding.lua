-- SPDX-License-Identifier: Apache-2.0
-- A PUMA 560 welds a tube and two plates to a base along one seam: plate, half way round the tube,
-- plate. The part stands on a positioner that tilts by 45 degrees and turns, so that the seam always
-- lies under the torch with both its flanks sloping alike. Part, seam and bead follow the world's
-- parameters: with another tube the seam, the motions of arm and table and the torques are others.
-- usage: robomosp run scripts/demos/welding.lua [folder [quality of the pictures]]
local folder, quality = arg and arg[1], arg and arg[2] or "draft"

local speed = 0.008                                  -- of the torch along the seam [m/s]
local work, travel = math.rad(45), math.rad(10)      -- of the wire: from the base, and pushing
local tilt = math.rad(45)
local step = 0.1                                     -- between samples [s]

local cell = world.create{ name = "weld", parameters = {
  tube = {value = "80 mm", description = "outer diameter of the tube"},
  plate = {value = "80 mm", description = "length of the plates"},
  wall = "6 mm", height = "45 mm", base = "10 mm" } }

-- The part, about the tube's axis, and the bead.
local function paint(name, colour, density)
  return material.create{ name = name, density = density or 7850, colour = colour }
end
local raw, hot = paint("raw_steel", "#9aa3ab"), paint("bead", "#ff7a1a")
local frame_paint, table_paint = paint("frame_paint", "#3c4650"), paint("table_paint", "#2f6f8f")
local function box(x, y, z, position) return {kind = "box", x = x, y = y, z = z, position = position} end
local function cylinder(radius, height, position, rpy)
  return {kind = "cylinder", radius = radius, height = height, position = position, rpy = rpy}
end
local function union(name, of, children)
  return solid.create{ name = name, material = of, root = {kind = "union", children = children} }
end
local part = union("part", raw, {
  box("weld.plate + weld.tube + 30 mm", "weld.tube + 60 mm", "weld.base", {"weld.plate/2 - 5 mm", 0, 0}),
  box("weld.plate", "weld.wall", "weld.height", {"weld.plate/2", "weld.tube/2 - weld.wall/2", "weld.base"}),
  box("weld.plate", "weld.wall", "weld.height", {"weld.plate/2", "weld.wall/2 - weld.tube/2", "weld.base"}),
  {kind = "difference", children = {
    cylinder("weld.tube/2", "weld.height", {0, 0, "weld.base"}),
    cylinder("weld.tube/2 - weld.wall", "weld.height + 2 mm", {0, 0, "weld.base"}) }} })
local function along(y) return cylinder("3 mm", "weld.plate", {0, y, "weld.base"}, {0, "90 deg", 0}) end
local bead = union("bead", hot, { along("weld.tube/2"), along("-weld.tube/2"),
  {kind = "difference", children = {
    {kind = "torus", ring_radius = "weld.tube/2", tube_radius = "3 mm", position = {0, 0, "weld.base"}},
    box("weld.tube", "weld.tube + 20 mm", "20 mm", {"weld.tube/2", 0, 0}) }} })

-- The positioner: a tilting bracket that carries a turning face plate; masses are those of the bodies.
local axis_height, face = 0.5, -0.035
local positioner = robot.create{ name = "positioner", mass_source = "designed",
  base_parts = {{what = union("stand", frame_paint, {
    box(0.1, 0.18, axis_height + 0.06, {0.27, 0, 0}), box(0.34, 0.4, 0.03, {0.2, 0, 0}) })}},
  links = {
    {name = "tilt", joint = "revolute", origin = {0, 0, axis_height}, axis = {1, 0, 0}, lower = -1.2, upper = 1.2,
     max_velocity = 1, max_acceleration = 2, parts = {{what = union("bracket", frame_paint, {
       cylinder(0.05, 0.06, {0.17, 0, 0}, {0, "90 deg", 0}), box(0.02, 0.12, 0.17, {0.18, 0, -0.11}),
       box(0.27, 0.12, 0.02, {0.055, 0, -0.11}), cylinder(0.045, 0.04, {0, 0, -0.09}) })}}},
    {name = "turn", joint = "revolute", origin = {0, 0, face}, axis = {0, 0, 1}, lower = -7, upper = 7,
     max_velocity = 2, max_acceleration = 4,
     parts = {{what = union("face_plate", table_paint, {cylinder(0.12, 0.015, {0, 0, -0.015})})},
              {what = part}, {what = bead}}} } }

-- The arm with a torch of the library. A further centre point of it is the seam's frame at the tip of
-- the wire: x along the seam, z away from the base, so that the angles of the wire stand in the tool
-- and the seam knows nothing of them.
local arm = robot.get("puma560"):duplicate{ name = "welder" }
local torch = object.get("mig_torch_22"):duplicate{ name = "torch" }
local joint_speed = 1.5  -- our limits: the library has none for this arm [rad/s]
for k = 1, 6 do arm:set_link{ link = k, max_velocity = joint_speed, max_acceleration = 5, max_jerk = 50 } end
local w = {math.sin(travel), math.cos(travel) * math.sin(work), -math.cos(travel) * math.cos(work)}
local function cross(a, b)
  return {a[2] * b[3] - a[3] * b[2], a[3] * b[1] - a[1] * b[3], a[1] * b[2] - a[2] * b[1]}
end
local y = cross(w, {1, 0, 0})
local norm = math.sqrt(y[1]^2 + y[2]^2 + y[3]^2)
for k = 1, 3 do y[k] = y[k] / norm end
local x = cross(y, w)
-- Rows: the wire's axes in the seam's frame, so that the matrix maps the seam's frame to the wire's.
local seam_in_wire = {{x[1], x[2], x[3], 0}, {y[1], y[2], y[3], 0}, {w[1], w[2], w[3], 0}, {0, 0, 0, 1}}
torch:add_tcp{ name = "seam", placement = spatial.compose(torch:tcps()[1].pose, seam_in_wire).pose }
arm:attach{ tool = torch, position = {0, 0, 0.056}, tcp = "seam" }

local shoulder, table_x = 0.672, 0.56
local rest = {0, 0.8, -2.9, 0, 0.6, 0}
cell:add_robot{ robot = arm, position = {0, 0, shoulder}, q = rest }
cell:add_robot{ robot = positioner, position = {table_x, 0, 0}, q = {0, 0} }
cell:add_signal{ name = "arc", from = "welder", to = "positioner" }
cell:add_signal{ name = "placed", from = "positioner", to = "welder" }

-- The same without wire and bead, which touch: for the room between nozzle and part.
local bare = world.create{ name = "bare" }
local bare_arm, bare_table = arm:duplicate{ name = "bare_arm" }, positioner:duplicate{ name = "bare_table" }
local bare_torch = torch:duplicate{ name = "torch_without_wire" }
bare_torch:remove_part("wire")
bare_arm:change_tool{ tool = bare_torch, tcp = "seam" }
bare_table:set_link{ link = "turn", parts = { {what = "face_plate"}, {what = part} } }
bare:add_robot{ robot = bare_arm, name = "welder", position = {0, 0, shoulder} }
bare:add_robot{ robot = bare_table, name = "positioner", position = {table_x, 0, 0} }

local function compose(a, b) return spatial.compose(a, b).pose end
local part_fk = function(q) return compose({table_x, 0, 0, 0, 0, 0}, positioner:fk{ q = q }.pose) end
local function greatest(values)
  local most = 0
  for i = 1, #values do most = math.max(most, math.abs(values[i])) end
  return most
end

-- Everything from the parameters of now.
local function weld(name)
  local now = cell:parameters()
  local r, plate, base = now.tube.value / 2, now.plate.value, now.base.value
  local ramp = 0.05
  -- The foot of a plate, half way round the tube, the other plate; z away from the base.
  local seam = trajectory.along_edges{ name = "seam_" .. name, solid = part, from = {0, 0, 1}, tilt = math.pi,
    edges = {{plate/2, r, base}, {-r, 0, base}, {plate/2, -r, base}}, speed = speed, acceleration = ramp }
  local length, duration = seam:length(), seam:duration()
  assert(math.abs(length - (2 * plate + math.pi * r)) < 1e-6)

  -- The table turns with the tube, gently into it and out of it: the rate of its turn goes up within
  -- 30 mm of the seam as 10 u^3 - 15 u^4 + 6 u^5, and this is the integral of that.
  local parts = seam:segments()
  local t1, t2 = parts[2].start, parts[#parts].start  -- round the tube
  local half = 0.015 / speed
  local function gone(t)
    local u = t / (2 * half) + 0.5
    if u <= 0 then return 0 end
    if u >= 1 then return t end
    return 2 * half * (2.5 * u^4 - 3 * u^5 + u^6)
  end
  local function turn(t) return -speed / r * (gone(t - t1) - gone(t - t2)) end

  local times, targets, turns = {}, {}, {}
  local rows = math.ceil(duration / step)
  for i = 0, rows do
    local t = duration * i / rows
    times[i + 1] = t
    turns[i + 1] = {tilt, turn(t)}
    targets[i + 1] = compose({0, 0, -shoulder, 0, 0, 0}, compose(part_fk(turns[i + 1]), seam:sample(t).pose))
  end
  local found = arm:solve_ik_batch{ targets = targets, seed = rest, continuous = true }
  for i, status in ipairs(found.status) do
    assert(status == "solved", string.format("at %.1f s the torch cannot follow: %s", times[i], found.detail[i]))
  end
  local function spline(of, q)
    return trajectory.create{ name = of .. "_" .. name, segments = {{shape = "joint_spline", joints = q, times = times}} }
  end
  local joints = {}
  for i = 1, #times do joints[i] = array(found.q[i]) end
  local arm_way, table_way = spline("arm", joints), spline("table", turns)

  -- On one clock: the table tilts while the arm comes, both weld together, the arm leaves.
  local function away(target, q) return arm:solve_ik{ target = compose(target, {0, -0.06, 0.06, 0, 0, 0}), seed = q }.q end
  local first, last = joints[1], joints[#joints]
  local arm_steps = {
    {step = "move", joints = away(targets[1], first)}, {step = "wait", condition = "placed == 1"},
    {step = "move", joints = first}, {step = "set", signal = "arc", value = 1},
    {step = "move", trajectory = arm_way}, {step = "set", signal = "arc", value = 0},
    {step = "move", joints = away(targets[#targets], last)}, {step = "move", joints = rest} }
  local table_steps = {
    {step = "move", joints = turns[1]}, {step = "set", signal = "placed", value = 1},
    {step = "wait", condition = "arc == 1"}, {step = "move", trajectory = table_way},
    {step = "wait", condition = "arc == 0"}, {step = "move", joints = {0, turns[#turns][2]}} }
  for robot_name, steps in pairs{ welder = arm_steps, positioner = table_steps } do
    local one = task.create{ name = robot_name .. "_" .. name, steps = steps }
    cell:add_task{ task = one, robot = robot_name }
  end
  cell:set_robot_q{ robot = "welder", q = rest }
  cell:set_robot_q{ robot = "positioner", q = {0, 0} }
  local run = cell:run_task{ task = {"welder_" .. name, "positioner_" .. name}, sample_time = step }

  -- The torch as the part sees it, against the seam.
  local clock, arc = run:values("time"), run:values("signal.arc")
  local function row(stem, count, i)
    local q = {}
    for j = 1, count do q[j] = run:values(stem .. j)[i] end
    return q
  end
  local off, askew, slowest, fastest, room = 0, 0, math.huge, 0, math.huge
  local before, welded = nil, {}
  for i = 1, #clock do
    if arc[i] == 1 then
      welded[#welded + 1] = i
      local q, t = row("welder.q", 6, i), row("positioner.q", 2, i)
      local tcp = compose({0, 0, shoulder, 0, 0, 0}, arm:fk{ q = q }.pose)
      local seen = compose(spatial.invert(part_fk(t)).pose, tcp)
      local px, py, pz = seen[1][4], seen[2][4], seen[3][4]
      local aside = px > 0 and math.abs(py) - r or math.sqrt(px^2 + py^2) - r
      off = math.max(off, math.sqrt(aside^2 + (pz - base)^2))
      askew = math.max(askew, math.acos(math.min(1, seen[3][3])))
      if before and #welded > 5 and i + 5 <= #clock and arc[i + 5] == 1 then
        local v = math.sqrt((px - before[1])^2 + (py - before[2])^2 + (pz - before[3])^2) / (clock[i] - clock[i - 1])
        slowest, fastest = math.min(slowest, v), math.max(fastest, v)
      end
      before = {px, py, pz}
      if #welded % 25 == 1 then
        room = math.min(room, bare:clearance{ exact = true, q = {welder = q, positioner = t} }.distance)
      end
    end
  end
  assert(off < 5e-5 and askew < 1e-3 and slowest > 0.99 * speed and fastest < 1.01 * speed)
  assert(room > 0.003, "the torch comes too near to the part")

  -- The torques of arm and table while they weld.
  cell:add_trajectory{ trajectory = arm_way }
  cell:set_robot_q{ robot = "welder", q = first }
  local forces = cell:inverse_dynamics{ robot = "welder", trajectory = arm_way.name, sample_time = step }
  local held = 0
  for _, q in ipairs(turns) do held = math.max(held, math.abs(positioner:gravity_torques{ q = q }[1])) end
  local tau = {}
  for j = 1, 6 do tau[j] = greatest(forces:values("tau" .. j)) end
  local rates = {}
  for j = 1, 6 do rates[j] = 100 * greatest(forces:values("qd" .. j)) / joint_speed end
  print(string.format("tube of %.0f mm: seam of %.1f mm in %.1f s, part of %.2f kg", 2000 * r, 1000 * length, duration,
    part:mass().mass))
  print(string.format("  the torch is within %.4f mm of the seam and %.4f degrees upright, at %.3f to %.3f mm/s",
    1000 * off, math.deg(askew), 1000 * slowest, 1000 * fastest))
  print(string.format("  nozzle and part are %.1f mm apart or more; at most %.1f %% of the arm's joint speeds are used",
    1000 * room, math.max(table.unpack(rates))))
  print(string.format("  torques of the arm up to %.1f, %.1f, %.1f, %.2f, %.2f, %.2f N m; the tilt holds %.2f N m",
    tau[1], tau[2], tau[3], tau[4], tau[5], tau[6], held))
  local pictures = {
    start = {share = 0.02, eye = {1.65, -1.55, 1.5}, target = {0.24, 0, 0.62}},
    tube = {share = 0.5, eye = {0.72, -0.42, 0.98}, target = {0.54, 0.01, 0.53}} }
  for label, view in pairs(pictures) do
    if folder then
      local drawn, fault = pcall(cell.render, cell, { file = folder .. "/welding_" .. name .. "_" .. label .. ".png",
        recording = run, at = clock[welded[math.ceil(view.share * #welded)]], size = {700, 570}, quality = quality,
        axes = false, eye = view.eye, target = view.target })
      if not drawn then print(fault) end  -- such as: no renderer is installed
    end
  end
  return {run = run, forces = forces, length = length, duration = duration, held = held}
end

local small = weld("small")
cell:set_parameter("tube", "120 mm")  -- part, bead, seam, motions and torques follow
local large = weld("large")
assert(math.abs(large.length - small.length - math.pi * 0.02) < 1e-6 and large.held > small.held)
if folder then
  large.forces:plot{ file = folder .. "/welding_torques.svg", columns = {"tau1", "tau2", "tau3"}, with = small.forces,
    title = "Torques along the seam, tube of 120 mm and (dashed) 80 mm" }
end

return large.run  -- what a window plays
