-- SPDX-License-Identifier: Apache-2.0
-- Physics of one's own, in Lua: balls and boxes that fall onto boxes that stand still. Contact is a
-- spring and a damper (a penalty), friction is Coulomb's with a short slope at zero speed; the step
-- is symplectic (Euler). It is checked against closed forms and against the built-in engine.
local function cross(a, b)
  return {a[2] * b[3] - a[3] * b[2], a[3] * b[1] - a[1] * b[3], a[1] * b[2] - a[2] * b[1]}
end
local function add(a, b, s) s = s or 1 return {a[1] + s * b[1], a[2] + s * b[2], a[3] + s * b[3]} end
local function dot(a, b) return a[1] * b[1] + a[2] * b[2] + a[3] * b[3] end
local function turn(m, v) -- R v
  return {m(1, 1) * v[1] + m(1, 2) * v[2] + m(1, 3) * v[3],
          m(2, 1) * v[1] + m(2, 2) * v[2] + m(2, 3) * v[3],
          m(3, 1) * v[1] + m(3, 2) * v[2] + m(3, 3) * v[3]}
end
local function turn_back(m, v) -- R' v
  return {m(1, 1) * v[1] + m(2, 1) * v[2] + m(3, 1) * v[3],
          m(1, 2) * v[1] + m(2, 2) * v[2] + m(3, 2) * v[3],
          m(1, 3) * v[1] + m(2, 3) * v[2] + m(3, 3) * v[3]}
end
local function place(m, v) return add(turn(m, v), {m(1, 4), m(2, 4), m(3, 4)}) end

-- Solves a x = b for a symmetric 3 x 3 matrix (Cramer).
local function solve3(a, b)
  local c1, c2, c3 = {a(1, 1), a(2, 1), a(3, 1)}, {a(1, 2), a(2, 2), a(3, 2)}, {a(1, 3), a(2, 3), a(3, 3)}
  local d = dot(c1, cross(c2, c3))
  return {dot(b, cross(c2, c3)) / d, dot(c1, cross(b, c3)) / d, dot(c1, cross(c2, b)) / d}
end

-- v turned by w * dt (Rodrigues).
local function rotated(v, w, dt)
  local size = math.sqrt(dot(w, w))
  if size == 0 then return v end
  local n, angle = {w[1] / size, w[2] / size, w[3] / size}, size * dt
  return add(add(add({0, 0, 0}, v, math.cos(angle)), cross(n, v), math.sin(angle)), n,
    dot(n, v) * (1 - math.cos(angle)))
end

-- Points that touch (of a ball its centre, with the radius) and boxes that stand still.
local function create(world)
  if #world.joints > 0 then return nil, "robots whose joints act; let them be moved" end
  world.points, world.boxes = {}, {}
  for i, body in ipairs(world.bodies) do
    for _, s in ipairs(body.shapes) do
      if s.kind == "sphere" and body.mass > 0 then
        table.insert(world.points, {body = i, at = {s.pose(1, 4), s.pose(2, 4), s.pose(3, 4)}, radius = s.sizes[1]})
      elseif s.kind == "box" and body.mass > 0 then
        for corner = 0, 7 do
          local at = {}
          for k = 1, 3 do at[k] = (corner >> (k - 1) & 1 == 1 and 0.5 or -0.5) * s.sizes[k] end
          table.insert(world.points, {body = i, at = place(s.pose, at), radius = 0})
        end
      elseif s.kind == "box" then
        table.insert(world.boxes, {body = i, pose = s.pose, sizes = s.sizes})
      else
        return nil, "body " .. i .. ", a " .. s.kind .. ": this engine knows balls and boxes that fall onto boxes"
      end
    end
  end
end

-- The depth of a ball about p in a box and the direction out of it; nil when they are apart.
local function depth(p, radius, box, at)
  local frame = at * box.pose
  local c = place(frame:inverse(), p)
  local nearest, inside, out = {}, true, {0, 0, 0}
  for k = 1, 3 do
    nearest[k] = math.max(-box.sizes[k] / 2, math.min(box.sizes[k] / 2, c[k]))
    inside = inside and nearest[k] == c[k]
  end
  local gap = 0
  if inside then
    local face = 1
    for k = 2, 3 do
      if box.sizes[k] / 2 - math.abs(c[k]) < box.sizes[face] / 2 - math.abs(c[face]) then face = k end
    end
    out[face] = c[face] < 0 and -1 or 1
    gap = math.abs(c[face]) - box.sizes[face] / 2
  else
    out = add(c, nearest, -1)
    gap = math.sqrt(dot(out, out))
    if gap >= radius then return nil end
    out = {out[1] / gap, out[2] / gap, out[3] / gap}
  end
  return radius - gap, turn(frame, out)
end

local function step(world, dt, _, params)
  local contacts, force, moment, com = {}, {}, {}, {}
  for i, body in ipairs(world.bodies) do
    force[i], moment[i] = {0, 0, 0}, {0, 0, 0}
    com[i] = turn(body.pose, body.com) -- from the frame's origin
  end
  for _, point in ipairs(world.points) do
    local body = world.bodies[point.body]
    local p = place(body.pose, point.at)
    for _, box in ipairs(world.boxes) do
      local floor = world.bodies[box.body]
      local deep, n = depth(p, point.radius, box, floor.pose)
      if deep then
        local touch = add(p, n, deep - point.radius)
        local arm = add(touch, {body.pose(1, 4), body.pose(2, 4), body.pose(3, 4)}, -1)
        local under = add(touch, {floor.pose(1, 4), floor.pose(2, 4), floor.pose(3, 4)}, -1)
        local v = add(add(body.velocity, cross(body.angular_velocity, arm)),
          add(floor.velocity, cross(floor.angular_velocity, under)), -1)
        local vn = dot(v, n)
        -- No pull: the spring and the damper only push.
        local normal = math.max(0, params.stiffness * deep - params.damping * vn)
        local slip = add(v, n, -vn)
        local speed = math.sqrt(dot(slip, slip))
        local mu = math.sqrt(body.friction * floor.friction)
        local f = add({0, 0, 0}, n, normal)
        if speed > 0 then f = add(f, slip, -mu * normal / math.max(speed, params.slip)) end
        force[point.body] = add(force[point.body], f)
        moment[point.body] = add(moment[point.body], cross(add(arm, com[point.body], -1), f))
        contacts[#contacts + 1] = {a = point.body, b = box.body, point = touch, normal = n, depth = deep, force = f}
      end
    end
  end
  for i, body in ipairs(world.bodies) do
    if body.mass > 0 then
      -- In the body's axes about its centre of mass: I dw = M - w x I w.
      local w = turn_back(body.pose, body.angular_velocity)
      local momentum = {}
      for k = 1, 3 do momentum[k] = dot({body.inertia(k, 1), body.inertia(k, 2), body.inertia(k, 3)}, w) end
      local dw = solve3(body.inertia, add(turn_back(body.pose, moment[i]), cross(w, momentum), -1))
      local v = add(body.velocity, cross(body.angular_velocity, com[i])) -- of the centre of mass
      v = add(v, add(world.gravity, force[i], 1 / body.mass), dt)
      w = turn(body.pose, add(w, dw, dt))
      local centre = add(add(place(body.pose, {0, 0, 0}), com[i]), v, dt)
      local columns = {}
      for k = 1, 3 do
        columns[k] = rotated({body.pose(1, k), body.pose(2, k), body.pose(3, k)}, w, dt)
      end
      local arm = add(add({0, 0, 0}, columns[1], body.com[1]), columns[2], body.com[2])
      arm = add(arm, columns[3], body.com[3])
      local at, rows = add(centre, arm, -1), {}
      for r = 1, 3 do rows[r] = {columns[1][r], columns[2][r], columns[3][r], at[r]} end
      rows[4] = {0, 0, 0, 1}
      body.pose = array(rows)
      body.velocity, body.angular_velocity = add(v, cross(w, arm), -1), w
    end
  end
  return contacts
end

ioci.provide("robomosp.physics/1", "penalty_lua", {
  summary = "Balls and boxes that fall onto boxes, by springs and dampers.",
  params = {
    { name = "stiffness", type = "real", unit = "N/m", doc = "Of a point of contact.", default = 2e4, min = 0 },
    { name = "damping", type = "real", unit = "N s/m", doc = "Of a point of contact.", default = 30, min = 0 },
    { name = "slip", type = "real", unit = "m/s", doc = "Speed below which friction is proportional to it.",
      default = 1e-2, min = 1e-9 },
  },
  create = create,
  step = step,
})

material.create{ name = "oak", density = 700 }
solid.create{ name = "ball", material = "oak", root = { kind = "sphere", radius = 0.05 } }
solid.create{ name = "brick", material = "oak", root = { kind = "box", x = 0.12, y = 0.1, z = 0.05 } }
solid.create{ name = "ground", root = { kind = "box", x = 4, y = 4, z = 0.1 } }
local yard = world.create{ name = "yard" }
yard:add_object{ what = "ground", position = {0, 0, -0.1} }
yard:add_object{ what = "ball", position = {-0.5, 0, 0.45} }
yard:add_object{ what = "brick", position = {0, 0.5, 0} }
local function run(engine, step_length)
  return yard:simulate_physics{ engine = engine, step = step_length, sample_time = 0.02, duration = 1.2, friction = 0.4,
    objects = { { name = "ground", fixed = true }, { name = "brick", velocity = {1, 0, 0} } } }
end
local own = run("penalty_lua", 1e-3)
local z, t = own:values "ball.z", own:values "time"
local ground_z = 0 -- upper side of the ground

-- Free fall until the ball meets the ground (first order in the step).
local h = z[1]
for i = 1, #t do
  local fallen = 9.81 * t[i]^2 / 2
  if h - fallen - 0.05 > ground_z then assert(math.abs(z[i] - (h - fallen)) <= 9.81 * t[i] * 1e-3) end
end
-- The brick is stopped by friction after v^2 / (2 mu g), and rests with its weight.
local slid = own:values "brick.x"
local far = 1 / (2 * 0.4 * 9.81)
assert(math.abs(slid[#slid] - far) < 0.02 * far, "the brick slides " .. slid[#slid] .. " m instead of " .. far)
local weight = 700 * 0.12 * 0.1 * 0.05 * 9.81
local pressed = own:values "brick.contact_force"
assert(math.abs(pressed[#pressed] - weight) < 0.01 * weight, "the ground carries the brick")

-- The same by the built-in engine.
local known = run(nil, 1e-3):values "brick.x"
assert(math.abs(known[#known] - slid[#slid]) < 0.03 * far)
print(string.format("penalty_lua: the brick slides %.4f m; the formula says %.4f, the built-in engine %.4f",
  slid[#slid], far, known[#known]))

-- What it does not know it refuses in a sentence.
solid.create{ name = "can", material = "oak", root = { kind = "cylinder", radius = 0.05, height = 0.1 } }
yard:add_object{ what = "can", position = {1, 0, 0} }
local done, fault = pcall(run, "penalty_lua", 1e-3)
assert(not done and tostring(fault):find("balls and boxes", 1, true), fault)
