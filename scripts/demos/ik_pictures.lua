-- SPDX-License-Identifier: Apache-2.0
-- All eight configurations of a PUMA 560 that bring the tool to one pose, as ik_puma_*.png in the
-- current folder. A folder and a quality may be given; the picture of the manual is made by
--   robomosp run scripts/demos/ik_pictures.lua docs/images normal
local folder, quality = arg and arg[1] or ".", arg and arg[2] or "draft"

local puma = robot "puma560"
for i = 1, 6 do puma:set_link{ link = i, lower = "-180 deg", upper = "180 deg" } end
local target = puma:fk{ q = {0.3, 0.75, -2.35, 0.6, 0.9, 0.2} }.pose
local answer = puma:solve_ik{ target = target, all = true, seed = {0.3, 0.75, -2.35, 0.6, 0.9, 0.2} }
assert(answer.provider == "spherical_wrist" and #answer.solutions == 8)

local cell = world.create{ name = "eight" }
for k = 1, 8 do
  local row, column = (k - 1) // 4, (k - 1) % 4
  cell:add_robot{ robot = puma, name = "configuration " .. k, q = answer.solutions[k],
                  position = {-1.6 * row, 1.3 * (column - 1.5), 0.672} }
end
print(answer.solutions)
local drawn, fault = pcall(cell.render, cell, {
  file = folder .. "/ik_puma_eight.png", size = {1200, 480}, quality = quality, axes = false,
  eye = {4.3, 0.1, 2.25}, target = {-0.5, 0.1, 0.52} })
if not drawn then print(fault) end  -- such as: no renderer is installed
