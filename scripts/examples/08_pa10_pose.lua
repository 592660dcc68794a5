-- SPDX-License-Identifier: Apache-2.0
-- The ROBOMOSP paper's fourth test: joint values of a PA-10 for the pose (0.557, 0, 0.374) m with
-- roll, pitch, yaw (pi, 0, pi), for both published sets of lengths. Another solver may be named:
-- robomosp --plugin-path FOLDER run 08_pa10_pose.lua my_ik
local goal = pose(0.557, 0, 0.374, rpy(pi, 0, pi))
for _, name in ipairs { "pa10", "pa10_nus" } do
  local arm = robot(name)
  local answer = arm:solve_ik { target = goal, provider = arg and arg[1] }
  print(string.format("%-9s", name), answer.q, answer.provider)
  -- Not what the solver says of itself: forward kinematics once more, and the limits.
  local back = arm:fk { q = answer.q }.pose
  local turn = 0
  for r = 1, 3 do
    assert(math.abs(back[r][4] - goal[r][4]) <= 1e-9)
    for c = 1, 3 do turn = math.max(turn, math.abs(back[r][c] - goal[r][c])) end
  end
  assert(turn <= 1e-9)
  for j, joint in ipairs(arm:joints()) do
    assert(answer.q[j] >= joint.lower and answer.q[j] <= joint.upper)
  end
end
