-- SPDX-License-Identifier: Apache-2.0
-- A world from nothing: a robot, a trajectory of your own, a simulation, a table of results.
local circle = trajectory.create {
  name = "small circle", sample_time = 0.05,
  segments = { { shape = "circle", speed = "50 mm/s", points = {
    { position = { 0.5, 0, 0.4 }, rpy = { "180 deg", 0, "180 deg" } },
    { position = { 0.56, 0.06, 0.4 }, rpy = { "180 deg", 0, "180 deg" } },
    { position = { 0.62, 0, 0.4 }, rpy = { "180 deg", 0, "180 deg" } } } } } }
local cell = world.create { name = "cell" }
cell:add_robot { robot = robot "pa10", name = "arm" }
cell:add_trajectory { trajectory = circle, name = "circle" }
local run = cell:inverse_dynamics { robot = "arm", trajectory = "circle" }
for _, column in ipairs(run:summary()) do
  if column.name:match "^tau%d$" then
    print(string.format("%s  %8.3f to %8.3f %s", column.name, column.min, column.max, column.unit))
  end
end
local x, y = run:values "x", run:values "y"
for i = 1, #x do assert(math.abs(math.sqrt((x[i] - 0.56) ^ 2 + y[i] ^ 2) - 0.06) < 1e-9) end
