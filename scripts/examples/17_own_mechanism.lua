-- SPDX-License-Identifier: Apache-2.0
-- Solvers of one's own, in Lua, for every mechanism: inverse kinematics and forward dynamics that
-- know closed loops, ball and free joints and joints that follow others, from the tables of the
-- model alone. They are checked against the built-in ones.

-- J(q): how a joint's frame moves in its placement.
local function moved(j, q)
  local i = j.q_index
  if j.type == "revolute" or j.type == "prismatic" then
    local x = q[i]
    if j.coupling then x = j.coupling.ratio * x + j.coupling.offset end
    if j.type == "prismatic" then return array{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, x}, {0, 0, 0, 1}} end
    local c, s = math.cos(x), math.sin(x)
    return array{{c, -s, 0, 0}, {s, c, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}}
  end
  local p = {0, 0, 0}
  if j.type == "free" then p, i = {q[i], q[i + 1], q[i + 2]}, i + 3 end
  local w, x, y, z = q[i], q[i + 1], q[i + 2], q[i + 3]
  local s = 2 / (w * w + x * x + y * y + z * z)
  return array{{1 - s * (y * y + z * z), s * (x * y - z * w), s * (x * z + y * w), p[1]},
    {s * (x * y + z * w), 1 - s * (x * x + z * z), s * (y * z - x * w), p[2]},
    {s * (x * z - y * w), s * (y * z + x * w), 1 - s * (x * x + y * y), p[3]}, {0, 0, 0, 1}}
end
local function frames(model, q)
  local all = {}
  for i, j in ipairs(model.joints) do
    local T = j.placement * moved(j, q)
    all[i] = j.parent > 0 and all[j.parent] * T or T
  end
  return all
end
local function on(all, joint, frame) return joint > 0 and all[joint] * frame or frame end

-- q moved by velocities times 1 s: angles and ways add up, quaternions turn about the moving axes.
local function step(model, q, v, size)
  local out = {}
  for k = 1, #q do out[k] = q[k] end
  for _, j in ipairs(model.joints) do
    local i, n = j.q_index, j.v_index
    if not j.coupling and (j.type == "revolute" or j.type == "prismatic") then
      out[i] = q[i] + size * v[n]
    elseif not j.coupling then
      if j.type == "free" then
        local R = moved(j, q)
        for r = 1, 3 do
          for c = 1, 3 do out[i + r - 1] = out[i + r - 1] + size * R(r, c) * v[n + c - 1] end
        end
        i, n = i + 3, n + 3
      end
      local x, y, z = size * v[n], size * v[n + 1], size * v[n + 2]
      local angle = math.sqrt(x * x + y * y + z * z)
      local a, s = math.cos(angle / 2), angle > 1e-12 and math.sin(angle / 2) / angle or 0.5
      x, y, z = s * x, s * y, s * z
      local w0, x0, y0, z0 = q[i], q[i + 1], q[i + 2], q[i + 3]
      out[i] = w0 * a - x0 * x - y0 * y - z0 * z
      out[i + 1] = w0 * x + x0 * a + y0 * z - z0 * y
      out[i + 2] = w0 * y - x0 * z + y0 * a + z0 * x
      out[i + 3] = w0 * z + x0 * y - y0 * x + z0 * a
    end
  end
  return out
end

-- What of frame b against frame a counts, in the axes of a: way and (to first order) turn.
local function gap(a, b, directions, out)
  local d = a:inverse() * b
  local all = {d(1, 4), d(2, 4), d(3, 4), (d(3, 2) - d(2, 3)) / 2, (d(1, 3) - d(3, 1)) / 2, (d(2, 1) - d(1, 2)) / 2}
  for _, k in ipairs(directions) do out[#out + 1] = all[k] end
end
local function open(model, all, out)
  for _, l in ipairs(model.loops) do
    gap(on(all, l.joint_a, l.in_a), on(all, l.joint_b, l.in_b), l.fixed, out)
  end
  return out
end

-- Solves a x = b with pivots, in place.
local function solve(a, b)
  local n = #b
  for i = 1, n do
    local p = i
    for r = i + 1, n do if math.abs(a[r][i]) > math.abs(a[p][i]) then p = r end end
    a[i], a[p], b[i], b[p] = a[p], a[i], b[p], b[i]
    for r = i + 1, n do
      local f = a[r][i] / a[i][i]
      for c = i, n do a[r][c] = a[r][c] - f * a[i][c] end
      b[r] = b[r] - f * b[i]
    end
  end
  for i = n, 1, -1 do
    for c = i + 1, n do b[i] = b[i] - a[i][c] * b[c] end
    b[i] = b[i] / a[i][i]
  end
  return b
end

-- Derivative of f(q) by the velocities, rows of f: central differences.
local function derivative(model, q, f)
  local rows = {}
  for n = 1, model.dof do
    local unit = {}
    for k = 1, model.dof do unit[k] = k == n and 1 or 0 end
    local h = 1e-6
    local plus, minus = f(step(model, q, unit, h)), f(step(model, q, unit, -h))
    for r = 1, #plus do
      rows[r] = rows[r] or {}
      rows[r][n] = (plus[r] - minus[r]) / (2 * h)
    end
  end
  return rows
end
-- J J' + damping
local function normal(J, damping)
  local a = {}
  for r = 1, #J do
    a[r] = {}
    for c = 1, #J do
      local x = r == c and damping or 0
      for k = 1, #J[r] do x = x + J[r][k] * J[c][k] end
      a[r][c] = x
    end
  end
  return a
end

-- Newton's method for goals and loops together, the least motion in each step.
ioci.provide("robomosp.ik/1", "newton_lua", {
  summary = "Newton's method for every mechanism: trees, loops, balls, followers.",
  tags = {"goals", "closed", "floating"},
  solve = function(model, target, seed, asked)
    local whole = {1, 2, 3, 4, 5, 6}
    local goals = #asked.goals > 0 and asked.goals or {{ tip = asked.tip, target = target, parts = whole }}
    local function miss(q)
      local all, e = frames(model, q), {}
      for _, g in ipairs(goals) do
        local tip = model.tips[g.tip]
        gap(g.target, on(all, tip.joint, tip.tool), g.parts, e)
      end
      return open(model, all, e)
    end
    local q = {}
    for k = 1, #seed do q[k] = seed[k] end
    for _ = 1, 60 do
      local e, size = miss(q), 0
      for k = 1, #e do size = math.max(size, math.abs(e[k])) end
      if size < 1e-11 then return q end
      local J = derivative(model, q, miss)
      local y, v, longest = solve(normal(J, 1e-12), e), {}, 0
      for n = 1, model.dof do
        v[n] = 0
        for r = 1, #J do v[n] = v[n] - J[r][n] * y[r] end
        longest = math.max(longest, math.abs(v[n]))
      end
      q = step(model, q, v, math.min(1, 0.5 / longest))
    end
    return nil, "sixty steps did not suffice"
  end,
})

-- Constrained dynamics with Lagrange's multipliers: M a = tau - h + J' f, J a + dJ/dt v = -2 w e' - w^2 e
-- (J. Baumgarte, Comput. Methods Appl. Mech. Eng. 1 (1972) 1). M and h are asked of the program.
ioci.provide("robomosp.forward_dynamics/1", "multipliers_lua", {
  summary = "Forward dynamics of closed loops by Lagrange's multipliers.",
  tags = {"loops"},
  params = { { name = "stabilisation", type = "real", unit = "1/s", doc = "Rate at which open loops close.",
    default = 20, min = 0 } },
  accelerations = function(model, q, qd, tau, params)
    local arm, w = robot(model.name), params.stabilisation
    local M = arm:inertia{ q = q, tree = true }
    local mounted = {} -- gravity as the robot is mounted
    for r = 1, 3 do
      mounted[r] = 0
      for c = 1, 3 do mounted[r] = mounted[r] + model.base(r, c) * model.gravity[c] end
    end
    local h = arm:inverse_dynamics{ q = q, qd = qd, terms = {"gravity", "velocity"}, gravity = mounted,
      tree = true }
    local function inverse_times(b)
      local a = {}
      for r = 1, model.dof do
        a[r] = {}
        for c = 1, model.dof do a[r][c] = M(r, c) end
      end
      return solve(a, b)
    end
    local free = {}
    for k = 1, model.dof do free[k] = tau[k] - h[k] end
    free = inverse_times(free)
    if #model.loops == 0 then return free end
    local function gaps(x) return open(model, frames(model, x), {}) end
    local e, J = gaps(q), derivative(model, q, gaps)
    -- The rate of J along the motion, by differences.
    local t = 1e-5
    local ahead = derivative(model, step(model, q, qd, t), gaps)
    local behind = derivative(model, step(model, q, qd, -t), gaps)
    local columns, A, b = {}, {}, {}
    for r = 1, #J do
      local row, rate, curve = {}, 0, 0
      for k = 1, model.dof do
        row[k] = J[r][k]
        rate = rate + J[r][k] * qd[k]
        curve = curve + (ahead[r][k] - behind[r][k]) / (2 * t) * qd[k]
      end
      columns[r] = inverse_times(row)
      b[r] = -curve - 2 * w * rate - w * w * e[r]
      for k = 1, model.dof do b[r] = b[r] - J[r][k] * free[k] end
    end
    for r = 1, #J do
      A[r] = {}
      for c = 1, #J do
        A[r][c] = r == c and 1e-12 or 0
        for k = 1, model.dof do A[r][c] = A[r][c] + J[r][k] * columns[c][k] end
      end
    end
    local forces = solve(A, b)
    for r = 1, #J do
      for k = 1, model.dof do free[k] = free[k] + columns[r][k] * forces[r] end
    end
    return free, forces
  end,
})

-- Each machine is sent back to where it stands, from a place nearby: what its free velocities move
-- is asked for, followers and loops look after the rest.
local function near(q, way)
  local out = {}
  for k = 1, #q do out[k] = q[k] + way * math.sin(5 * k) end
  return out
end
local worst = 0
for _, case in ipairs{
  {"gripper", {-0.3}, "x"}, {"four_bar", nil, "x"}, {"five_bar", nil, {"x", "y"}}, {"stewart", nil, "pose"},
  {"satellite_arm", nil, "pose"} } do
  local machine = robot(case[1])
  local q = case[2] or machine:describe().poses.home
  local target = machine:fk{ q = q }.pose
  local answer = machine:solve_goals{ goals = {{ target = target, parts = case[3] }}, seed = near(q, 0.02),
    provider = "newton_lua" }
  assert(answer.provider == "newton_lua" and answer.position_error < 1e-9, case[1])
  worst = math.max(worst, answer.position_error) -- that loops are closed is checked by the program
end

-- Accelerations and the forces at the pins of linkages, against the built-in solver.
local function compare(name)
  local linkage = robot(name)
  local q = linkage:describe().poses.home
  local own = linkage:constraint_forces{ q = q, provider = "multipliers_lua" }
  local known = linkage:constraint_forces{ q = q, provider = "constrained" }
  local most, greatest = 0, 0
  for k = 1, #own.qdd do
    most, greatest = math.max(most, math.abs(own.qdd[k] - known.qdd[k])), math.max(greatest, math.abs(known.qdd[k]))
  end
  for i, l in ipairs(own.loops) do
    for k = 1, 3 do most = math.max(most, math.abs(l.force[k] - known.loops[i].force[k])) end
  end
  assert(most < 1e-5 * math.max(1, greatest), name .. ": " .. most)
  return most
end
local off = math.max(compare "four_bar", compare "slider_crank", compare "five_bar")

-- The linkage falls by both in the same way.
local bar = robot "four_bar"
local function fall(name)
  bar:set{ forward_dynamics = name }
  local run = bar:simulate{ q = "home", duration = 0.02, integrator = "dormand_prince" }
  local q = {}
  for k = 1, 3 do
    local column = run:values("q" .. k)
    q[k] = column[#column]
  end
  return q
end
local own, known = fall "multipliers_lua", fall "constrained"
local apart = 0
for k = 1, 3 do apart = math.max(apart, math.abs(own[k] - known[k])) end
assert(apart < 1e-6, "they fall alike: " .. apart)
print(string.format("newton_lua: five machines to %.1g m; multipliers_lua agrees to %.1g, falls to %.1g rad",
  worst, off, apart))
