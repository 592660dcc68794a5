-- SPDX-License-Identifier: Apache-2.0
-- Where a PUMA 560 and a PA-10 can work: voxels around the robot, cut open and clear, sections through
-- them, and over two joints where the arm is singular. Areas of a planar arm are checked against their
-- closed form.
-- usage: robomosp run scripts/demos/workspace.lua [folder [quality of the pictures [fineness]]]
-- The pictures of the manual: robomosp run scripts/demos/workspace.lua docs/images normal 20
local folder, quality = arg and arg[1], arg and arg[2] or "draft"
local fineness = math.tointeger(arg and tonumber(arg[3]) or 1)

-- A picture, where there is what draws it: a renderer for bodies, gnuplot for sections.
local function try(draw, what, settings)
  if not folder then return end
  settings.file = folder .. "/workspace_" .. settings.file .. ".png"
  local drawn, fault = pcall(draw, what, settings)
  if not drawn then print(fault) end
end

-- Two rods of 0.7 m and 0.45 m that turn freely reach the ring from 0.25 m to 1.15 m; with the elbow
-- within a quarter turn the inner radius is that of the law of cosines at 90 degrees.
local rods = robot "planar2rods"
for _, case in ipairs{{"-180 deg", "180 deg", 0.25^2}, {0, "90 deg", 0.7^2 + 0.45^2}} do
  rods:set_link{ link = 2, lower = case[1], upper = case[2] }
  local w = rods:workspace{ samples = 200000, voxel = 0.02 }
  local exact = math.pi * (1.15^2 - case[3])
  print(string.format("planar2rods: %s Closed form: %.4f m^2", w.reading, exact))
  assert(w.dimension == 2 and w.settled and w.growth >= 0)
  assert(math.abs(w.size - exact) < math.min(w.error, 0.03 * exact))
end

local look = { size = {560, 420}, quality = quality, axes = false }
local function picture(arm, name, map)
  if not folder then return end
  look.file, look.map = name, map
  try(arm.render, arm, look)
end
for _, name in ipairs{"puma560", "pa10"} do
  local arm = robot(name)
  local w = arm:workspace{ samples = 200000 * fineness, voxel = fineness > 1 and 0.05 or 0.1,
                           part = "translation" }
  print(name .. ": " .. w.reading)
  picture(arm, name .. "_manipulability", { recording = w.recording, cut = "-y" })
  try(w.recording.heat_map, w.recording, { file = name .. "_section" })

  local m = arm:reachability{ samples = 50000 * fineness, voxel = fineness > 1 and 0.1 or 0.25,
                              directions = fineness > 1 and 60 or 12 }
  print(string.format("  %.0f %% of the directions on the average; all of them in %.1f %% of the voxels",
    100 * m.mean_share, 100 * m.dexterous))
  assert(m.mean_share > 0.2 and m.mean_share < 1 and m.dexterous < 1 and m.unreached < 0.5)
  picture(arm, name .. "_reachability", { recording = m.recording, cut = "-y", low = 0, high = 1 })
  -- Where the tool has most of the directions, clear.
  picture(arm, name .. "_clear", { recording = m.recording, above = fineness > 1 and 0.85 or 0.4, opacity = 0.3,
                                   low = fineness > 1 and 0.8 or 0.4, high = 1 })
end

-- The manipulability of a PUMA's position is zero where the elbow is straight, whatever joint 2 does,
-- and where the wrist is above the shoulder.
local puma = robot "puma560"
local s = puma:joint_slice{ a = 2, b = 3, part = "translation", count = 161 }
local straight = math.atan(0.0203, 0.4318) - math.pi / 2
local found = 0
for i = 1, #s.curve do
  if math.abs(s.curve[i][2] - straight) < 1e-5 then found = found + 1 end
end
print("puma560: singular at q3 = " .. straight .. " at " .. found .. " of 161 places")
assert(found >= 161)
try(s.recording.heat_map, s.recording, { file = "puma560_slice", curve = s.curve })

return robot "pa10"  -- what a window shows
