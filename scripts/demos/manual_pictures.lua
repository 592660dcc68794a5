-- SPDX-License-Identifier: Apache-2.0
-- The pictures of the manual that no other demo makes: the PA-10 on its circle, a link and an ellipsoid
-- of the page on solids, ellipsoids of a PUMA 560, and plots of a recording, as *.png in the current
-- folder. A folder and a quality may be given; see docs/developer/pictures.md
local folder, quality = arg and arg[1] or ".", arg and arg[2] or "draft"

--- Draws or plots, where there is what does it; options are a picture's.
local function made(draw, what, name, options)
  options.file = folder .. "/" .. name .. ".png"
  local drawn, fault = pcall(draw, what, options)
  print(drawn and options.file or fault)  -- such as: no renderer is installed
end

local cell = world "pa10_circle"
local circle = cell:inverse_dynamics{ robot = "pa10", trajectory = "circle" }
made(cell.render, cell, "pa10_circle", { size = {1400, 875}, quality = quality, recording = circle, at = 20,
  eye = {1.93, -1.85, 1.5}, target = {0.43, 0.02, 0.41} })

-- As on the page about solids.
local link = solid.create{
  name = "arm_link", material = material "aluminium_6082",
  parameters = { length = "300 mm", bore = "30 mm", wall = "15 mm" },
  root = { kind = "difference", name = "body", children = {
    { kind = "union", name = "blank", children = {
      { kind = "cylinder", name = "hub", radius = "bore/2 + 2*wall", height = "60 mm" },
      { kind = "cylinder", name = "eye", radius = "bore/2 + wall", height = "60 mm", position = {"length", 0, 0} },
      { kind = "box", name = "web", x = "length", y = "bore + wall", z = "40 mm", position = {"length/2", 0, "10 mm"} } } },
    { kind = "cylinder", name = "hub_bore", radius = "bore/2", height = "70 mm", position = {0, 0, "-5 mm"} },
    { kind = "cylinder", name = "eye_bore", radius = "bore/2", height = "70 mm", position = {"length", 0, "-5 mm"} },
    { kind = "circular_pattern", name = "bolts", count = 6, children = {
      { kind = "cylinder", name = "bolt", radius = "3 mm", height = "70 mm", position = {"bore/2 + wall", 0, "-5 mm"} } } } } } }
made(link.render, link, "solids_link", { size = {640, 400}, quality = quality })
made(link.render, link, "solids_link_cut", { size = {640, 400}, quality = quality, section = "-y", com = true })
link:set_parameter{ name = "bore", value = "50 mm" }
made(link.render, link, "solids_link_50", { size = {640, 400}, quality = quality })
local oval = solid.create{ name = "oval", material = material "wood", root = { kind = "difference", children = {
  { kind = "scale", name = "wide", x = 1.5, z = 1.25, children = { { kind = "sphere", radius = "20 mm" } } },
  { kind = "scale", name = "slot", x = 3, children = {
    { kind = "cylinder", name = "bore", radius = "6 mm", height = "80 mm", position = {0, 0, "-40 mm"} } } } } } }
made(oval.render, oval, "solids_oval", { size = {640, 400}, quality = quality, section = "-y" })

local puma = robot "puma560"
for name, q in pairs{ ellipsoids = {0.3, 0.7, -0.4, 0.3, 0.8, 0.2}, stretched = {0.3, 0.7, -1.45, 0.3, 0.8, 0.2} } do
  made(puma.render, puma, "kinematics_" .. name, { size = {640, 480}, quality = quality, q = q, ellipsoid = "both" })
end

-- As on the page about recordings.
local start = {0.3, -0.6, 0.4, 0.5, 0.7, 0.2}
local run = puma:simulate{ q = start, duration = 0.5, friction = false, limits = "ignore" }
made(run.plot, run, "recording_limits", { columns = {"q1", "q2", "q3"}, limits = true, width = 760 })
made(run.plot, run, "recording_path", { kind = "path", width = 560, height = 560 })
local heavy = puma:simulate{ q = start, duration = 0.5, sample_time = 0.004, friction = false, limits = "ignore",
  tip_force = {0, 0, -20} }
made(run.plot, run, "recording_over", { columns = {"q2", "q3"}, with = heavy, width = 760,
  title = "free and with 20 N at the tool" })

-- How fast integrators converge, by powers of ten.
local rods = robot "planar2rods"
local function final(how)
  how.q, how.duration, how.sample_time, how.friction, how.limits = {0, 0.5}, 1, 0.5, false, "ignore"
  return rods:simulate(how):values{ "q1", "q2" }[3]
end
local exact = final{ relative_tolerance = 1e-13, absolute_tolerance = 1e-14 }
local steps, errors = {}, { runge_kutta4 = {}, euler = {}, verlet = {}, yoshida4 = {} }
for k = 1, 6 do
  steps[k] = 0.1 / 2^k
  for name, list in pairs(errors) do
    local integrator = name == "runge_kutta4" and name or { name = "symplectic", params = { method = name } }
    list[k] = (final{ integrator = integrator, step = steps[k] } - exact):norm()
  end
end
local columns = { { name = "step", unit = "s", values = steps } }
for _, name in ipairs{ "euler", "verlet", "yoshida4", "runge_kutta4" } do
  table.insert(columns, { name = name, unit = "rad", values = errors[name] })
end
local orders = recording.create{ title = "a double pendulum after 1 s", columns = columns }
made(orders.plot, orders, "recording_log", { log = "xy", width = 760, height = 460 })
