-- SPDX-License-Identifier: Apache-2.0
-- A curve, a motion law and an orientation of one's own, without a compiler: an Archimedean spiral
-- run by a law without jumps of jerk, the tool rocking about its first orientation.
--
-- Each function is asked when a segment is made, never later; the program takes derivatives itself
-- and walks the curve by its length.

-- The spiral r = b * angle about the first point, in the plane of its pose.
ioci.provide("robomosp.curve/2", "spiral", {
  summary = "Archimedean spiral outwards from the first pose, in its x-y plane.",
  params = {{name = "turns", type = "real", doc = "Number of turns.", default = 3, min = 0.1},
            {name = "pitch", type = "real", unit = "m", doc = "Way outwards in one turn.", default = 0.02, min = 0}},
  place = function(points, params, u)
    if #points ~= 1 then return nil, "a spiral starts at one pose" end
    local angle = 2 * math.pi * params.turns * (u + 0.05)  -- not from the very centre: no tangent there
    local r = params.pitch * angle / (2 * math.pi)
    local p = points[1] * pose(r * math.cos(angle), r * math.sin(angle), 0)
    return {p(1, 4), p(2, 4), p(3, 4)}
  end})

-- A polynomial of seventh degree: speed, acceleration and jerk are zero at both ends.
ioci.provide("robomosp.motion_law/2", "septic", {
  summary = "Seventh degree in time: at rest, without acceleration and jerk at both ends.",
  params = {{name = "mean_speed", type = "real", unit = "m/s", doc = "Length over duration.", default = 0.1, min = 1e-6}},
  duration = function(way, params) return way.length / params.mean_speed end,
  share = function(way, params, t)
    local x = t * params.mean_speed / way.length
    return x^4 * (35 - 84 * x + 70 * x^2 - 20 * x^3)
  end})

-- Rocks about the tool's x axis, four times on the way.
ioci.provide("robomosp.orientation/2", "rocking", {
  params = {{name = "amplitude", type = "real", unit = "rad", doc = "Greatest turn.", default = 0.2}},
  orient = function(points, params, w)
    return points[1] * pose(0, 0, 0, rpy(params.amplitude * math.sin(8 * math.pi * w), 0, 0))
  end})

local sanding = trajectory.create{name = "sanding", segments = {
  {shape = "spiral", points = {{0.5, 0, 0.3, 0, 0, 0}}, turns = 2, pitch = "30 mm", law = "septic",
   mean_speed = "80 mm/s", orientation = "rocking"}}}

-- The length of the spiral in closed form: b/2 (a sqrt(1 + a^2) + asinh a), b = pitch / 2 pi.
local b, first, last = 0.03 / (2 * math.pi), 0.05 * 4 * math.pi, 1.05 * 4 * math.pi
local function length(a) return b / 2 * (a * math.sqrt(1 + a^2) + math.log(a + math.sqrt(1 + a^2))) end
local exact = length(last) - length(first)
assert(math.abs(sanding:length() - exact) < 1e-9 * exact)
assert(math.abs(sanding:duration() - exact / 0.08) < 1e-9)

-- The greatest speed of the law is 35/16 of the mean, at half time.
local middle = sanding:sample(sanding:duration() / 2)
local v = middle.velocity
assert(math.abs(math.sqrt(v[1]^2 + v[2]^2 + v[3]^2) - 0.08 * 35 / 16) < 1e-6)
local e = sanding:sample(sanding:duration())
assert(math.abs(e.velocity[1]) + math.abs(e.acceleration[1]) < 1e-6)
print(("a spiral of %.4f m in %.3f s"):format(sanding:length(), sanding:duration()))
