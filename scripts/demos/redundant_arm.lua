-- SPDX-License-Identifier: Apache-2.0
-- What an arm of seven joints does with its freedom: along a path it keeps a joint away from the limit
-- that it would run into, and at a place it turns its elbow away from a pole.
-- usage: robomosp run scripts/demos/redundant_arm.lua [folder [quality of the pictures]]
local folder, quality = arg and arg[1], arg and arg[2] or "draft"

local cell = world.get("redundant_arm")
local arm = robot.get("iiwa14")
local joints = arm:joints()
local degree = math.pi / 180

-- A straight line on which the tool turns, solved place after place.
local function line(s)
  return {0.40 + 0.29 * s, 0.63 - 0.27 * s, 0.12 + 0.15 * s, math.pi, 0.06 - 0.56 * s, 0.66 - 1.05 * s}
end
local steps = 40
local first = arm:solve_goals{ goals = {{target = line(0)}}, seed = "ready" }.q
local function follow(objective)
  local q, path, margin, worst = first, {}, math.huge, 0
  for i = 0, steps do
    local answer = arm:solve_goals{ goals = {{target = line(i / steps)}}, seed = q, objective = objective }
    q = answer.q
    path[i + 1] = q
    worst = math.max(worst, answer.position_error)
    for j, joint in ipairs(joints) do
      margin = math.min(margin, q[j] - joint.lower, joint.upper - q[j])
    end
  end
  assert(worst < 1e-8)
  print(string.format("objective %-7s all joints stay %4.1f deg or more from their limits", objective .. ":",
    margin / degree))
  return path, margin
end
local plain, near = follow("none")
local kept, far = follow("limits")
assert(near < 1 * degree and far > 20 * degree)

-- Joint 3 against its limit, as a drawing.
local file <close> = folder and io.open(folder .. "/redundant_arm_limits.svg", "w") or io.tmpfile()
local function y(angle) return 170 - angle / degree * 0.8 end
local function curve(path, colour)
  local points = {}
  for i, q in ipairs(path) do points[i] = string.format("%.1f,%.1f", 50 + 500 * (i - 1) / steps, y(q[3])) end
  return '<polyline fill="none" stroke-width="2" stroke="' .. colour .. '" points="' .. table.concat(points, " ") .. '"/>\n'
end
file:write('<svg xmlns="http://www.w3.org/2000/svg" width="600" height="340" font-family="sans-serif" font-size="13">\n',
  '<rect width="600" height="340" fill="white"/>\n')
for _, limit in ipairs{joints[3].lower, 0, joints[3].upper} do
  file:write(string.format('<path d="M50 %.1fh500" stroke="%s"/><text x="4" y="%.1f">%.0f°</text>\n', y(limit),
    limit == 0 and "#999" or "#c33", y(limit) + 4, limit / degree))
end
file:write(curve(plain, "#777"), curve(kept, "#17c"),
  '<text x="60" y="330">Joint 3 along the line: grey without objective, blue away from limits</text>\n</svg>\n')

-- At one place: the robot's distance from the pole alone, so other pairs are let be.
cell:allow_pair{ a = "iiwa14", b = "iiwa14", reason = "the demo looks at the pole" }
cell:allow_pair{ a = "iiwa14", b = "pedestal", reason = "the demo looks at the pole" }
local target = {0.55, 0.49, 0.2, math.pi, 0, 0}
local q, free = "ready", {}
for _, objective in ipairs{"none", "clearance"} do
  local answer = arm:solve_goals{ goals = {{target = target}}, seed = q, objective = objective,
    world = objective == "clearance" and cell or nil }
  assert(answer.position_error < 1e-8 and answer.rotation_error < 1e-8)
  q = answer.q
  free[objective] = cell:clearance{ exact = true, q = {iiwa14 = q} }.distance
  cell:set_robot_q{ robot = "iiwa14", q = q }
  if folder then
    local drawn, fault = pcall(cell.render, cell, { file = folder .. "/redundant_arm_" .. objective .. ".png",
      size = {360, 400}, quality = quality, axes = false, collisions = true, eye = {2.2, -1.1, 1.7}, target = {0.2, 0.2, 0.6} })
    if not drawn then print(fault) end  -- such as: no renderer is installed
  end
end
print(string.format("from the pole: %.0f mm, and %.0f mm with the objective clearance, the tool at the same place",
  1000 * free.none, 1000 * free.clearance))
assert(free.clearance > free.none + 0.02)

return cell  -- what a window shows
