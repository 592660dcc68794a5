-- SPDX-License-Identifier: Apache-2.0
-- Mechanisms of the library, closed with their motors elsewhere than at home, as mechanism_*.png in
-- the current folder. A folder and a quality may be given; the pictures of the manual are made by
--   robomosp run scripts/demos/mechanism_pictures.lua docs/images normal
local folder, quality = arg and arg[1] or ".", arg and arg[2] or "draft"

local motors = {four_bar = {crank = "50 deg"}, delta = {arm_one = 0.5, arm_two = 0.2, arm_three = 0.3}}
for _, name in ipairs{"four_bar", "delta", "stewart", "dual_arm", "satellite_arm", "gripper"} do
  local mechanism = robot(name)
  local closed = mechanism:close{joints = motors[name]}
  print(name, #closed.q .. " numbers", "open by " .. closed.residual)
  local drawn, fault = pcall(mechanism.render, mechanism, {
    file = folder .. "/mechanism_" .. name .. ".png", size = {480, 400}, quality = quality,
    q = closed.q, axes = false})
  if not drawn then print(fault) end  -- such as: no renderer is installed
end
