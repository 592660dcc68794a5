-- SPDX-License-Identifier: Apache-2.0
-- The nearest points of a PA-10 and a lamp, and a link that touches it, as collision_*.png in the
-- current folder. A folder and a quality may be given; the pictures of the manual are made by
--   robomosp run scripts/demos/collision_pictures.lua docs/images normal
local folder, quality = arg and arg[1] or ".", arg and arg[2] or "draft"

material.create{ name = "glass", density = 2500, colour = "#e8b23a", shininess = 0.6 }
solid.create{ name = "lamp", material = "glass", root = {kind = "sphere", radius = 0.06} }
local cell = world.create{ name = "cell" }
cell:add_robot{ robot = robot "pa10", q = {0, 0.179, 0, 1.298, 0, 1.664, 0} }
cell:add_object{ what = "lamp", position = {0.12, 0.24, 0.82} }
cell:allow_pair{ a = "pa10", b = "pa10", reason = "here the lamp matters" }
local function draw(name, eye, target)
  local drawn, fault = pcall(cell.render, cell, { file = folder .. "/collision_" .. name .. ".png",
    size = {560, 520}, quality = quality, axes = false, collisions = true, eye = eye,
    target = target })
  if not drawn then print(fault) end  -- such as: no renderer is installed
end
local near = cell:clearance{ exact = true }
print(string.format("%s and %s: %.1f mm", near.a, near.b, 1000 * near.distance))
draw("nearest", {1.55, 0.62, 1.2}, {0.06, 0.06, 0.62})
cell:set_robot_q{ robot = "pa10", q = {1, 0.49, 0, 0.4, 0, 1, 0} }
local hits = cell:collisions()
assert(#hits > 0)
for _, hit in ipairs(hits) do print(hit.a .. " and " .. hit.b .. " touch") end
draw("touching", {2.3, 0.75, 1.2}, {0.2, 0.05, 0.58})
