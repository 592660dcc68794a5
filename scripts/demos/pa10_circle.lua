-- SPDX-License-Identifier: Apache-2.0
-- The ROBOMOSP paper's first test: a PA-10 whose tool runs once round a circle of 100 mm radius at
-- 10 mm/s, with the torques that this takes.
-- usage: robomosp run scripts/demos/pa10_circle.lua [folder for the files]
local folder = arg and arg[1]

local cell = world "pa10_circle"
local run = cell:inverse_dynamics{ robot = "pa10", trajectory = "circle" }

if folder then
  run:csv{ file = folder .. "/pa10_circle.csv" }
  run:plot{ file = folder .. "/pa10_torques.png", columns = { "tau" }, panels = "column", title = "PA-10 on the circle: joint torques" }
  run:plot{ file = folder .. "/pa10_torques.svg", columns = { "tau" }, panels = "column", title = "PA-10 on the circle: joint torques" }
  run:plot{ file = folder .. "/pa10_joints.png", columns = { "q", "qd" }, title = "PA-10 on the circle: joint positions and velocities" }
end

local rows = {}
for _, column in ipairs(run:summary()) do rows[column.name] = column end

-- How far the tool is from the circle of the paper: centre (658, 0, 734.6) mm, radius 100 mm.
local x, y, z = run:values("x"), run:values("y"), run:values("z")
local off = 0
for i = 1, #x do
  local radius = math.sqrt((x[i] - 0.658)^2 + y[i]^2)
  off = math.max(off, math.abs(radius - 0.1), math.abs(z[i] - 0.7346))
end

print(string.format("PA-10, circle of 100 mm at 10 mm/s: %d samples in %.3f s, tool within %.1e m of the circle", #x,
  rows.time.max, off))
print(string.format("  %-8s%16s%18s%22s", "joint", "range [deg]", "speed [deg/s]", "torque [N m]"))
for j = 1, 7 do
  local q, qd, tau = rows["q" .. j], rows["qd" .. j], rows["tau" .. j]
  print(string.format("  %-8d%8.2f%8.2f%18.3f%12.3f%10.3f", j, math.deg(q.min), math.deg(q.max),
    math.deg(math.max(math.abs(qd.min), math.abs(qd.max))), tau.min, tau.max))
end

return run  -- what a window plays
