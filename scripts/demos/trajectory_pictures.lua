-- SPDX-License-Identifier: Apache-2.0
-- Curves, motion laws, orientations and transitions side by side, as trajectory_*.png in the current
-- folder (with gnuplot; else as *.svg). A folder may be given; the pictures of the manual are made by
--   robomosp run scripts/demos/trajectory_pictures.lua docs/images
local folder = arg and arg[1] or "."

local function recorded(name, segments, step)
  return trajectory.create{name = name, segments = segments}:record{step = step or 0.01}
end

--- Several recordings over each other.
local function draw(file, recordings, options)
  local first = table.remove(recordings, 1)
  options.with, options.width = recordings, options.width or 760
  options.file = ("%s/trajectory_%s.png"):format(folder, file)
  if not pcall(first.plot, first, options) then  -- no gnuplot
    options.file = options.file:gsub("png$", "svg")
    first:plot(options)
  end
  print(options.file)
end

-- Curves with the same four points, or about the same centre.
local zigzag = {{0, 0, 0, 0, 0, 0}, {0.2, 0.2, 0.05, 0, 0, 0}, {0.4, -0.1, 0.1, 0, 0, 0}, {0.6, 0.1, 0, 0, 0, 0}}
local splines = {}
for _, shape in ipairs{"cubic_spline", "quintic_spline", "b_spline", "bezier", "teach_points"} do
  table.insert(splines, recorded(shape, {{shape = shape, points = zigzag, degree = shape == "b_spline" and 2 or nil,
    rounding = shape == "teach_points" and 0.08 or nil}}))
end
draw("splines", splines, {columns = {"y"}, x = "x", title = "curves by control points", height = 460})

draw("curves", {
  recorded("helix", {{shape = "helix", points = {{0.1, 0, 0, 0, 0, 0}}, centre = {0, 0, 0}, turns = 3, pitch = 0.05}}),
  recorded("circle", {{shape = "circle", points = {{0.3, 0, 0, 0, 0, 0}, {0.2, 0.1, 0.1, 0, 0, 0}, {0.1, 0, 0.15, 0, 0, 0}}}}),
  recorded("arc", {{shape = "arc", points = {{-0.1, 0, 0, 0, 0, 0}, {-0.2, 0.1, 0.1, 0, 0, 0}, {-0.3, 0, 0, 0, 0, 0}}}}),
}, {kind = "path", title = "helix, circle, arc", width = 900})

-- Laws over the same 0.4 m in 2 s.
local laws = {}
for _, law in ipairs{"constant_speed", "trapezoidal", "s_curve", "cubic", "quintic", "cycloidal"} do
  local s = {shape = "line", points = {{0, 0, 0, 0, 0, 0}, {0.4, 0, 0, 0, 0, 0}}, law = law, duration = 2}
  if law ~= "constant_speed" then s.speed = 0.4 end
  if law == "trapezoidal" then s.acceleration = 0.8 end
  if law == "s_curve" then s.acceleration, s.jerk = 1.2, 4 end
  table.insert(laws, recorded(law, {s}))
end
draw("laws", laws, {columns = {"speed", "acceleration", "jerk"}, title = "0.4 m in 2 s", height = 760})

-- Orientations through four points of an S.
local turned = {{0, 0, 0, 0, 0, 0}, {0.2, 0.1, 0, 0.9, 0, 0}, {0.4, -0.1, 0, 0.9, 0.8, 0}, {0.6, 0, 0, 0, 0.8, 1.4}}
local orientations = {}
for _, how in ipairs{"slerp", "slerp_points", "squad", "tangent"} do
  table.insert(orientations, recorded(how, {{shape = "cubic_spline", points = turned, orientation = how,
    duration = 4, up = how == "tangent" and {0, 0, 1} or nil}}))
end
draw("orientations", orientations, {columns = {"turning"}, title = "how fast the tool turns along a spline", height = 400})

-- A corner, and what is put there.
local corners = {}
for _, distance in ipairs{0.01, 0.03, 0.055} do
  table.insert(corners, recorded(("cut %g mm"):format(1000 * distance), {
    {shape = "line", points = {{0.1, 0, 0, 0, 0, 0}, {0.3, 0, 0, 0, 0, 0}}},
    {shape = "line", points = {{0.3, 0, 0, 0, 0, 0}, {0.3, 0.13, 0, 0, 0, 0}}, transition = {distance = distance}}}))
end
local overlaid = {table.unpack(corners)}
draw("transitions", corners, {columns = {"y"}, x = "x", title = "a corner cut", height = 460})
draw("transition_speed", overlaid, {columns = {"speed", "acceleration"}, title = "a corner cut", height = 460})
