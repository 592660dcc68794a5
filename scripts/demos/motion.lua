-- SPDX-License-Identifier: Apache-2.0
-- Robots that move by themselves or under control: a double pendulum, a PUMA 560 on a circle under
-- computed torque and under PID, and a joint that sticks and slips.
-- usage: robomosp run scripts/demos/motion.lua [folder for the files]
local folder = arg and arg[1]

local function greatest(values)
  local most = 0
  for i = 1, #values do most = math.max(most, math.abs(values[i])) end
  return most
end

-- A double pendulum swings freely: potential energy becomes kinetic and back, the sum stays.
local rods = robot "planar2rods"
local swing = rods:simulate{ q = {0, 0.5}, duration = 3, sample_time = 0.005, limits = "ignore",
  friction = false }
if folder then
  swing:plot{ file = folder .. "/double_pendulum_energy.png", columns = {"kinetic", "potential", "energy"},
    title = "Double pendulum: energy of a free swing" }
end
local e = swing:values("energy")
local drift = 0
for i = 1, #e do drift = math.max(drift, math.abs(e[i] - e[1])) end
print(string.format("double pendulum: %.2f J move to and fro, their sum drifts by %.1e J in 3 s",
  greatest(swing:values("kinetic")), drift))

-- A PUMA 560 follows a circle of 100 mm radius once in 2 s under two controllers.
local puma = robot "puma560"
local cell = world.create{ name = "motion" }
local start = {0, "45 deg", "180 deg", 0, "45 deg", 0}
cell:add_robot{ robot = puma, q = start }
local at = puma:fk{ q = start }
local p, a, r = at.position, at.rpy, 0.1
local function point(x, y) return {p[1] + x, p[2] + y, p[3], a[1], a[2], a[3]} end
trajectory.create{ name = "round", sample_time = 0.01, segments = {
  {shape = "circle", speed = 2 * math.pi * r / 2,
   points = {point(0, 0), point(-r, r), point(-2 * r, 0)}}} }
cell:add_trajectory{ trajectory = "round" }
for _, name in ipairs{"computed_torque", "joint_pid"} do
  local run = cell:simulate_dynamics{ robot = "puma560", trajectory = "round", controller = name }
  if folder then
    run:plot{ file = folder .. "/puma_" .. name .. ".png",
      columns = {"error1", "error2", "error3", "tip_error"}, title = "PUMA 560 on a circle under " .. name }
  end
  print(string.format("PUMA 560 on a circle under %-16s the tool is off by %.1e m at the most", name .. ":",
    greatest(run:values("tip_error"))))
end

-- A block on a rail is pulled by a spring whose end moves steadily at 0.1 m/s: it sticks until the
-- spring overcomes 7 N, then slips against 4 N. The spring stands in the joint, and the torque is
-- that of its moving end, k v t, by a controller that is asked every millisecond.
local slider = robot.create{ name = "slider", convention = "mdh", links = {
  {joint = "prismatic", alpha = "90 deg", mass = 2, inertia = {0.01, 0.01, 0.01, 0, 0, 0},
   coulomb_positive = 4, coulomb_negative = -4, stiffness = 50}} }
ioci.provide("robomosp.controller/1", "pulled", function(model, now) return {50 * 0.1 * now.time} end)
local slip = slider:simulate{ controller = "pulled", reference = {0}, duration = 8, breakaway = 1.75 }
if folder then
  slip:plot{ file = folder .. "/stick_slip.png", columns = {"q1", "qd1"}, title = "A block pulled by a spring: stick and slip" }
  slip:plot{ file = folder .. "/stick_slip_friction.png", columns = {"tau_friction1"}, title = "A block pulled by a spring: friction" }
end
local stuck, qd = 0, slip:values("qd1")
for i = 1, #qd do if qd[i] == 0 then stuck = stuck + 1 end end
print(string.format("stick and slip: at rest in %d of %d samples", stuck, #qd))
for _, note in ipairs(slip:notes()) do print("  " .. note) end
