-- SPDX-License-Identifier: Apache-2.0
-- All robots, the drives, gears, bearings and profiles, and the tools of the library, as library_robots.png, library_parts.png
-- and tools_library.png in the current folder. A folder and a quality may be given; the pictures of the manual are made by
--   robomosp run scripts/demos/library_pictures.lua docs/images normal
local folder, quality = arg and arg[1] or ".", arg and arg[2] or "draft"

local function draw(what, options)
  local drawn, fault = pcall(what.render, what, options)
  if not drawn then print(fault) end  -- such as: no renderer is installed
  return drawn
end

-- Robots from behind to the front, each row from the left: a name, the width of its cell [m], its height over the floor [m], and its
-- rotation about z [deg]. The cells of a row are side by side, about y = 0.
local rows = {
  {x = -3.0, {"satellite_arm", 2.1, 0.75, 35}, {"dual_arm", 1.3, 0, 30}, {"kr5", 1.2, 0, -35}, {"planar2rods", 0.7, 1.055, 60},
   {"twolink", 1.25, 1.07, 60}, {"puma560", 0.95, 0.672, 20}, {"puma560_mdh", 0.9, 0.672, 20}},
  {x = -1.6, {"stewart", 1.45, 0, 0}, {"ur10e", 1.1, 0, -35}, {"pa10", 0.95, 0, -40}, {"pa10_nus", 0.95, 0, -40}, {"iiwa14", 0.85, 0, -40},
   {"panda", 0.85, 0, -40}, {"irb140", 0.9, 0, -40}},
  {x = -0.45, {"ur5", 1.0, 0, -40}, {"delta", 1.1, 0.75, 20}, {"stanford", 1.2, 0.13, -60}, {"cobra600", 0.9, 0, -40}, {"arm", 0.75, 0.14, -40},
   {"gripper", 0.4, 0, 60}},
  {x = 0.4, {"four_bar", 0.9, 0.212, 60}, {"slider_crank", 1.0, 0.122, 60}, {"five_bar", 0.7, 0.1, 0}},
}
local hall = world.create{name = "hall"}
local count = 0
for _, row in ipairs(rows) do
  local width = 0
  for _, entry in ipairs(row) do width = width + entry[2] end
  local left = -width / 2
  for _, entry in ipairs(row) do
    local name, wide, z, yaw = table.unpack(entry)
    local y = left + wide / 2
    left = left + wide
    count = count + 1
    if z > 1 then  -- two that hang on posts
      hall:add_object{what = solid "post_column", name = "post of " .. name, position = {row.x - 0.08, y + 0.045, 0}}
    end
    hall:add_robot{robot = robot(name), name = name, position = {row.x, y, z}, rpy = {0, 0, yaw .. " deg"}}
  end
end
print(count .. " robots")
draw(hall, {file = folder .. "/library_robots.png", size = {1400, 760}, quality = quality, axes = false, grid = false,
            eye = {6.6, 0.02, 3.95}, target = {-1.5, 0.02, 0.38}})

-- Parts, some in several sizes: the same solid with other parameters.
local shelf, parts = world.create{name = "shelf"}, 0
local function put(name, x, y, z, parameters, rpy)
  parts = parts + 1
  local part = solid.duplicate{id = solid(name), name = name .. " no " .. parts}
  for _, each in ipairs(parameters or {}) do part:set_parameter(each[1], each[2]) end
  shelf:add_object{what = part, position = {x, y, z}, rpy = rpy}
end
local lying = {"90 deg", 0, "90 deg"}  -- the shaft towards +x
put("stepper_motor", -0.05, -0.42, 0.043, {{"nema", 34}, {"length", "80 mm"}}, lying)
put("stepper_motor", 0.0, -0.3, 0.0282, {{"nema", 23}, {"length", "56 mm"}}, lying)
put("stepper_motor", 0.04, -0.21, 0.02115, {}, lying)
put("servo_motor", -0.05, -0.1, 0.04, {{"flange", "80 mm"}, {"length", "145 mm"}}, lying)
put("servo_motor", 0.0, 0.01, 0.03, {}, lying)
put("servo_motor", 0.04, 0.1, 0.02, {{"flange", "40 mm"}, {"length", "94.5 mm"}}, lying)
put("planetary_gear", 0.0, 0.2, 0.04, {{"size", 80}}, lying)
put("planetary_gear", 0.03, 0.3, 0.03, {{"stages", 2}}, lying)
local high = {0.044, 0.037, 0.0335, 0.0325, 0.0285}  -- turned over, to show the wave generators
for k, size in ipairs{32, 25, 20, 17, 14} do
  put("strain_wave_gear", 0.2, -0.44 + 0.115 * k - 0.006 * k * k, high[k], {{"size", size}}, {"180 deg", 0, 0})
end
for k, number in ipairs{6000, 6002, 6004, 6006, 6008} do
  put("ball_bearing", 0.2, 0.05 + 0.05 * k + 0.003 * k * k, 0.0075, {{"number", number}})
end
put("crossed_roller_bearing", 0.33, -0.36, 0.01, {{"outer", "120 mm"}, {"bore", "80 mm"}, {"width", "16 mm"}})
put("crossed_roller_bearing", 0.33, -0.24, 0.0065, {})
put("crossed_roller_bearing", 0.33, -0.16, 0.005, {{"bore", "30 mm"}, {"outer", "55 mm"}, {"width", "10 mm"}})
for k, name in ipairs{"profile_40", "profile_30", "profile_20"} do
  put(name, 0.28, 0.07 * k - 0.08, ({0.02, 0.015, 0.01})[k], {{"length", "200 mm"}}, {0, "90 deg", 0})
end
print(parts .. " parts")
draw(shelf, {file = folder .. "/library_parts.png", size = {960, 480}, quality = quality, axes = false,
             eye = {1.12, -0.02, 0.64}, target = {0.15, -0.055, 0.01}})

-- Tools, as they stand on their flanges.
local rack = world.create{name = "rack"}
local stands = {
  {"mig_torch_22", 0.16, -0.42}, {"mig_torch_45", 0.16, -0.2}, {"milling_spindle", 0.16, 0.02}, {"pen", 0.16, 0.24}, {"camera", 0.16, 0.42},
  {"parallel_gripper", -0.16, -0.44}, {"angular_gripper", -0.16, -0.22}, {"three_jaw_gripper", -0.16, 0}, {"suction_cup", -0.16, 0.2},
  {"suction_four", -0.16, 0.44}}
for _, s in ipairs(stands) do
  rack:add_object{what = object(s[1]), name = s[1], position = {-s[2], s[3], 0}, rpy = {0, 0, "65 deg"}}
end
print(#stands .. " tools")
draw(rack, {file = folder .. "/tools_library.png", size = {1000, 500}, quality = quality, axes = false,
            eye = {1.2, 0, 0.66}, target = {0.02, 0, 0.09}})
