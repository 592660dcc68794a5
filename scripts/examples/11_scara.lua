-- SPDX-License-Identifier: Apache-2.0
-- A closed-form solver of a plugin's own in place of a shipped robot's default: the SDK's example
-- scara_ik moves the Adept Cobra 600.
--   robomosp --plugin-path <its build folder> run 11_scara.lua
local offered = false
for _, p in ipairs(provider.list("robomosp.ik/1")) do offered = offered or p.name == "scara" end
if not offered then
  print("The plugin scara_ik is not loaded; see share/robomosp/examples/scara_ik.")
  return
end

local cobra = robot "cobra600"
cobra:set{ ik = "scara" }
local q = {-0.2, 0.9, 0.12, 0.5}
local answer = cobra:solve_ik{ target = cobra:fk{ q = q }.pose, seed = q, all = true }
print(answer.provider, answer.solutions)
assert(answer.provider == "scara" and answer.position_error < 1e-12)
for i = 1, 4 do assert(math.abs(answer.q[i] - q[i]) < 1e-9) end

-- A world that shows the robot follows a line with it.
local turn = rpy(pi, 0, 0)
local line = trajectory.create{ name = "line", segments = { { shape = "line", points = {
  { position = {0.45, -0.15, 0.28}, rpy = {pi, 0, 0} },
  { position = {0.5, 0.1, 0.24}, rpy = {pi, 0, 0} } } } } }
local cell = world.create{ name = "cell" }
cell:add_robot{ robot = cobra, name = "arm", q = cobra:solve_ik{ target = pose(0.45, -0.15, 0.28, turn) }.q }
cell:add_trajectory{ trajectory = line, name = "line" }
local run = cell:inverse_kinematics{ robot = "arm", trajectory = "line" }
local x = run:values "x"
print(string.format("%d samples from x = %.3f to %.3f m", #x, x[1], x[#x]))
assert(math.abs(x[#x] - 0.5) < 1e-9)
