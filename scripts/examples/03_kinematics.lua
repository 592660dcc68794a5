-- SPDX-License-Identifier: Apache-2.0
-- Forward and inverse kinematics: every posture of the PUMA 560 that reaches one pose.
local puma = robot "puma560"
local goal = puma:fk { q = { 0.3, 0.6, -0.4, 0.5, 0.7, 0.2 } }.pose
local answer = puma:solve_ik { target = goal, all = true }
print(#answer.solutions .. " postures reach it:")
for i = 1, answer.solutions:rows() do
  local q = answer.solutions[i]
  local back = puma:fk { q = q }.pose
  print("  " .. tostring(q), string.format("%.1e m off", (back:position() - goal:position()):norm()))
  assert((back:position() - goal:position()):norm() < 1e-8)
end
