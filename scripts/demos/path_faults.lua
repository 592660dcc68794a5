-- SPDX-License-Identifier: Apache-2.0
-- A robot that cannot follow: where its way leaves its reach, and where it is too fast and touches the
-- table, as path_*.png in the current folder. Folder and quality may be given; the pictures of the
-- manual are made by
--   robomosp run scripts/demos/path_faults.lua docs/images normal
local folder, quality = arg and arg[1] or ".", arg and arg[2] or "draft"

local arm = robot.get("puma560")
local ready = {0, 0.6, -2.4, 0, 0.2, 0}
local cell = world.create{name = "path_faults"}
cell:add_robot{robot = arm, name = "arm", q = ready}
solid.create{name = "bench", root = {kind = "box", x = 0.6, y = 1.2, z = 0.04}}
cell:add_object{what = "bench", name = "bench", position = {0.75, 0, -0.3}}
solid.create{name = "foot", root = {kind = "union", children = {
  {kind = "cylinder", radius = 0.05, height = 0.36}, {kind = "cylinder", radius = 0.22, height = 0.02}}}}
cell:add_object{what = "foot", name = "foot", position = {0.75, 0, -0.66}}

local from = arm:fk{q = ready}
--- A trajectory by steps from where the tool is.
local function way(name, speed, steps)
  local p, a, segments = from.position, from.rpy, {}
  local x, y, z = p[1], p[2], p[3]
  for _, s in ipairs(steps) do
    local to = {x + s[1], y + s[2], z + s[3]}
    table.insert(segments, {shape = "line", speed = speed, points = {
      {x, y, z, a[1], a[2], a[3]}, {to[1], to[2], to[3], a[1], a[2], a[3]}}})
    x, y, z = to[1], to[2], to[3]
  end
  trajectory.create{name = name, sample_time = 0.01, segments = segments}
  cell:add_trajectory{trajectory = name}
end
way("too_far", 0.3, {{0, 0.5, 0}, {0.35, 0, 0}, {0, -0.5, 0}, {-0.35, 0, 0}})
way("too_low", 2.5, {{-0.2, 0.2, 0}, {0, 0.1, -0.42}, {0, 0.2, 0.42}})

for name, kind in pairs{too_far = "unreachable", too_low = "collision"} do
  local file = ("%s/path_%s.png"):format(folder, name)
  local c = cell:check{robot = "arm", trajectory = name}
  local found = {}
  for _, f in ipairs(c.faults) do
    found[f.kind] = true
    print(name, f.kind, f.text)
  end
  assert(found[kind], "no fault of the kind " .. kind)
  if #provider.list("renderer") > 0 then
    cell:check{robot = "arm", trajectory = name, file = file, size = {900, 520}, axes = false,
               eye = {2.45, -1.6, 1.0}, target = {0.5, 0.06, -0.1}, quality = quality}
    print(file)
  end
end
