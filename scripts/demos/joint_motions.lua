-- SPDX-License-Identifier: Apache-2.0
-- One way between two postures by the three profiles of point-to-point motions, a spline through four
-- postures, and the fastest motion between two states that move, as joint_motion_*.png in the folder
-- that is given, if any (with gnuplot; else as *.svg). The pictures of the manual are made by
--   robomosp run scripts/demos/joint_motions.lua docs/images
local folder = arg and arg[1]

local limits = {max_velocity = 1, max_acceleration = 2, max_jerk = 10}  -- rad and s
local function link(length)
  local l = {a = length}
  for key, value in pairs(limits) do l[key] = value end
  return l
end
robot.create{name = "pair", links = {link(0.5), link(0.4)}}
local cell = world.create{name = "joint_motions"}
cell:add_robot{robot = "pair", name = "arm"}

--- The recording of segments of joints on the arm.
local function run(name, segments)
  trajectory.create{name = name, segments = segments, sample_time = 0.005}
  cell:add_trajectory{trajectory = name}
  local r = cell:inverse_kinematics{robot = "arm", trajectory = name}
  local t = r:values("time")
  print(("%-14s %.4f s"):format(name, t[#t]))
  return r
end
local function draw(file, recordings, options)
  if not folder then return end
  local first = table.remove(recordings, 1)
  options.with, options.width, options.height = recordings, 760, options.height or 560
  options.file = ("%s/joint_motion_%s.png"):format(folder, file)
  if not pcall(first.plot, first, options) then  -- no gnuplot
    options.file = options.file:gsub("png$", "svg")
    first:plot(options)
  end
  print(options.file)
end

local from, to = {0, 0}, {1.2, 0.3}
local profiles = {}
for _, profile in ipairs{"trapezoidal", "s_curve", "quintic"} do
  table.insert(profiles, run(profile, {{shape = "ptp", profile = profile, joints = {from, to}}}))
end
draw("profiles", profiles, {columns = {"q1", "qd1", "qdd1"}, title = "joint 1 by 1.2 rad"})

draw("spline", {run("spline", {{shape = "joint_spline", degree = 5,
  joints = {{0, 0}, {0.8, 0.5}, {0.4, 1.2}, {1.2, 0.3}}}})},
  {columns = {"q", "qd", "qdd"}, title = "a spline of degree 5 through four postures"})

-- Through the middle at a velocity of its own: the second motion begins as the first one ends.
local middle = {0.8, 0.6}
draw("time_optimal", {run("time_optimal", {
  {shape = "time_optimal", joints = {from, middle}, end_velocity = {0.9, -0.3}},
  {shape = "time_optimal", joints = {middle, {1.4, 0}}}})},
  {columns = {"q", "qd", "qdd"}, title = "two motions as fast as can be; between them both joints move"})
