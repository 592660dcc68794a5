-- SPDX-License-Identifier: Apache-2.0
-- A floating base: a satellite swings its arm. Nothing holds its body, so that it turns the other
-- way, while linear and angular momentum stay zero and the centre of mass stays where it was.
-- usage: robomosp run scripts/demos/floating_base.lua [folder [quality of the pictures]]
local folder, quality = arg and arg[1], arg and arg[2] or "draft"

local orbit = world.get("satellite_arm")
local satellite = robot.get("satellite_arm")

-- The arm goes from one posture to another under a soft controller; the body has no motor.
local to = {0, 0, 0, 1, 0, 0, 0, 1.6, 0.2, -0.3, 0, 0.5, 0}
local run = orbit:simulate_dynamics{ robot = "satellite_arm", q = "home", reference = to,
  controller = {name = "joint_pid", params = {frequency = 1.5, damping = 1}}, control_period = 0.01,
  duration = 6, sample_time = 0.05, friction = false }
if folder then
  run:plot{ file = folder .. "/floating_base.svg", columns = {"q1", "q2", "q3", "x", "y", "z"},
    title = "A satellite's body (q1, q2, q3) and its tool (x, y, z) while the arm swings [m]" }
end

local q, qd = {}, {}
for k = 1, 13 do q[k] = run:values("q" .. k) end
for k = 1, 12 do qd[k] = run:values("qd" .. k) end
local function row(columns, i)
  local out = {}
  for k = 1, #columns do out[k] = columns[k][i] end
  return out
end
local function length(v) return math.sqrt(v[1]^2 + v[2]^2 + v[3]^2) end
local samples, com, linear, angular, way = #q[1], nil, 0, 0, 0
local busiest = 0
for i = 1, samples do
  local m = satellite:momentum{ q = row(q, i), qd = row(qd, i) }
  com = com or m.com
  linear, angular = math.max(linear, length(m.linear)), math.max(angular, length(m.angular))
  way = math.max(way, length{m.com[1] - com[1], m.com[2] - com[2], m.com[3] - com[3]})
  busiest = math.max(busiest, math.abs(qd[7][i]))
end
local last = row(q, samples)
local turned = 2 * math.acos(math.min(1, math.abs(last[4])))
print(string.format("satellite: joints up to %.2f rad/s; its body has moved by %.0f mm and turned by %.1f deg",
  busiest, 1000 * length(last), turned * 180 / math.pi))
print(string.format("momentum stays within %.0e kg m/s and %.0e kg m^2/s, the centre of mass within %.0e m",
  linear, angular, way))
assert(linear < 1e-6 and angular < 1e-6 and way < 1e-7 and turned > 0.05)

for name, at in pairs{ start = 0, swung = 6 } do
  if folder then
    local drawn, fault = pcall(orbit.render, orbit, { file = folder .. "/floating_base_" .. name .. ".png",
      recording = run, at = at, size = {440, 370}, quality = quality, grid = false,
      eye = {4.3, 2.75, 2.75}, target = {0.15, 0.33, 0.3} })
    if not drawn then print(fault) end  -- such as: no renderer is installed
  end
end

return run  -- what a window plays
