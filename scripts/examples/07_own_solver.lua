-- SPDX-License-Identifier: Apache-2.0
-- A trajectory shape written in Lua: a sine wave, used like the built-in line and circle.
ioci.provide("robomosp.segment/2", "wave", {
  duration = 4,
  sample = function(points, params, t)
    local from, to = points[1], points[2]
    local s = t / 4
    return pose(
      from[1][4] + s * (to[1][4] - from[1][4]),
      from[2][4] + s * (to[2][4] - from[2][4]) + 0.03 * math.sin(4 * math.pi * s),
      from[3][4], rpy(math.pi, 0, math.pi))
  end })
local wave = trajectory.create { name = "wave", segments = { { shape = "wave", points = {
  { position = { 0.45, -0.1, 0.4 }, rpy = { "180 deg", 0, "180 deg" } },
  { position = { 0.65, 0.1, 0.4 }, rpy = { "180 deg", 0, "180 deg" } } } } } }
local cell = world.create { name = "cell" }
cell:add_robot { robot = robot "pa10", name = "arm" }
cell:add_trajectory { trajectory = wave, name = "wave" }
local run = cell:inverse_kinematics { robot = "arm", trajectory = "wave" }
local x = run:values "x"
print(string.format("%d samples from x = %.3f to %.3f m", #x, x[1], x[#x]))
assert(math.abs(x[#x] - 0.65) < 1e-9)
