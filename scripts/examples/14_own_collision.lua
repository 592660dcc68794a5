-- SPDX-License-Identifier: Apache-2.0
-- Collision of one's own, in Lua: spheres, capsules and sphere-box pairs exactly, everything else
-- by the capsule around it, which never tells more room than there is. Both are checked against the
-- built-in engine.
local function point_of(m, x, y, z) -- of a frame m, in the frame that m stands in
  return {m(1, 1) * x + m(1, 2) * y + m(1, 3) * z + m(1, 4),
          m(2, 1) * x + m(2, 2) * y + m(2, 3) * z + m(2, 4),
          m(3, 1) * x + m(3, 2) * y + m(3, 3) * z + m(3, 4)}
end
local function sub(a, b) return {a[1] - b[1], a[2] - b[2], a[3] - b[3]} end
local function along(a, s, d) return {a[1] + s * d[1], a[2] + s * d[2], a[3] + s * d[3]} end
local function dot(a, b) return a[1] * b[1] + a[2] * b[2] + a[3] * b[3] end
local function norm(a) return math.sqrt(dot(a, a)) end
local function clamp(x, low, high) return math.max(low, math.min(high, x)) end

-- A box of the given sizes about c becomes the capsule around it: along its longest side.
local function capsule_around(frame, c, sizes)
  local long = 1
  for k = 2, 3 do if sizes[k] > sizes[long] then long = k end end
  local half, across = {0, 0, 0}, 0
  for k = 1, 3 do if k ~= long then across = across + (sizes[k] / 2)^2 end end
  half[long] = sizes[long] / 2
  return {radius = math.sqrt(across),
          from = point_of(frame, c[1] - half[1], c[2] - half[2], c[3] - half[3]),
          to = point_of(frame, c[1] + half[1], c[2] + half[2], c[3] + half[3])}
end

-- What is kept of a body: capsules (a line from, to and a radius; a sphere is one of length 0), of
-- boxes their frame and half sides as well.
local function prepare(shapes)
  local parts = {}
  for _, s in ipairs(shapes) do
    local d, part = s.sizes, nil
    if s.kind == "sphere" then
      part = {from = point_of(s.pose, 0, 0, 0), to = point_of(s.pose, 0, 0, 0), radius = d[1]}
    elseif s.kind == "capsule" or s.kind == "cylinder" then
      part = {from = point_of(s.pose, 0, 0, -d[2] / 2), to = point_of(s.pose, 0, 0, d[2] / 2),
              radius = d[1]}
    elseif s.kind == "box" then
      part = capsule_around(s.pose, {0, 0, 0}, d)
      part.frame, part.half = s.pose, {d[1] / 2, d[2] / 2, d[3] / 2}
    else
      local low, high = {}, {}
      for k = 1, 3 do
        local numbers = s.vertices:col(k)
        low[k], high[k] = numbers:min(), numbers:max()
      end
      part = capsule_around(s.pose, {(low[1] + high[1]) / 2, (low[2] + high[2]) / 2, (low[3] + high[3]) / 2},
        sub(high, low))
    end
    part.is_ball = s.kind == "sphere"
    parts[#parts + 1] = part
  end
  return parts
end

-- Nearest points of two line segments (C. Ericson, Real-Time Collision Detection, 2005, 5.1.9).
local function between_lines(p1, q1, p2, q2)
  local d1, d2, r = sub(q1, p1), sub(q2, p2), sub(p1, p2)
  local a, e, b, c, f = dot(d1, d1), dot(d2, d2), dot(d1, d2), dot(d1, r), dot(d2, r)
  local s, t = 0, 0
  if a > 0 and e > 0 then
    local denominator = a * e - b * b
    if denominator > 1e-14 * a * e then s = clamp((b * f - c * e) / denominator, 0, 1) end
    t = clamp((b * s + f) / e, 0, 1)
    s = clamp((b * t - c) / a, 0, 1)
  elseif a > 0 then s = clamp(-c / a, 0, 1)
  elseif e > 0 then t = clamp(f / e, 0, 1)
  end
  return along(p1, s, d1), along(p2, t, d2), d1, d2
end

local function capsules(a, b)
  local on_a, on_b, d1, d2 = between_lines(a.from, a.to, b.from, b.to)
  local n = sub(on_b, on_a)
  local gap = norm(n)
  if gap < 1e-12 then -- the lines cross: the way out is across both
    n = {d1[2] * d2[3] - d1[3] * d2[2], d1[3] * d2[1] - d1[1] * d2[3], d1[1] * d2[2] - d1[2] * d2[1]}
    if norm(n) < 1e-12 then
      local d = norm(d1) > norm(d2) and d1 or d2
      n = math.abs(d[1]) < math.abs(d[2]) and {0, -d[3], d[2]} or {d[3], 0, -d[1]}
    end
    if norm(n) < 1e-12 then n = {0, 0, 1} end
  end
  n = along({0, 0, 0}, 1 / norm(n), n)
  return gap - a.radius - b.radius, along(on_a, a.radius, n), along(on_b, -b.radius, n)
end

-- A ball and a box: the nearest point of the box to the centre; inside, that of the nearest face.
local function ball_and_box(ball, box)
  local c, nearest, outside = point_of(box.inverse, table.unpack(ball.from)), {}, false
  for k = 1, 3 do
    nearest[k] = clamp(c[k], -box.half[k], box.half[k])
    outside = outside or nearest[k] ~= c[k]
  end
  local sign, n = 1, nil
  if outside then
    n = sub(nearest, c)
  else
    local face = 1
    for k = 2, 3 do
      if box.half[k] - math.abs(c[k]) < box.half[face] - math.abs(c[face]) then face = k end
    end
    nearest[face] = c[face] < 0 and -box.half[face] or box.half[face]
    n, sign = sub(nearest, c), -1
    if norm(n) == 0 then n[face] = nearest[face] end
  end
  local gap = sign * norm(sub(nearest, c))
  n = along({0, 0, 0}, sign / norm(n), n)
  local on_ball = along(c, ball.radius, n)
  return gap - ball.radius, point_of(box.placed, table.unpack(on_ball)),
    point_of(box.placed, table.unpack(nearest))
end

-- The parts of a body where it stands.
local function place(parts, at)
  local placed = {}
  for i, p in ipairs(parts) do
    local new = {from = point_of(at, table.unpack(p.from)), to = point_of(at, table.unpack(p.to)),
                 radius = p.radius, is_ball = p.is_ball, half = p.half}
    if p.half then
      new.placed = at * p.frame
      new.inverse = new.placed:inverse()
    end
    placed[i] = new
  end
  return placed
end

ioci.provide("robomosp.collision/1", "capsules_lua", {
  summary = "Spheres, capsules and sphere-box pairs exactly, all else by the capsule around it.",
  tags = {"approximate"},
  prepare = prepare,
  distance = function(a, b, world_T_a, world_T_b, interest)
    local least, on_a, on_b = interest, nil, nil
    local others = place(b, world_T_b)
    for _, p in ipairs(place(a, world_T_a)) do
      for _, q in ipairs(others) do
        local d, x, y
        if p.is_ball and q.half then d, x, y = ball_and_box(p, q)
        elseif q.is_ball and p.half then d, y, x = ball_and_box(q, p)
        else d, x, y = capsules(p, q)
        end
        if d < least then least, on_a, on_b = d, x, y end
      end
    end
    return least, on_a, on_b
  end,
})

-- What it says and what the built-in engine says of the same world.
local built_in = provider.default "collision"
local function both(question)
  local answers = {}
  for _, name in ipairs{"capsules_lua", built_in} do
    provider.default("collision", name)
    answers[#answers + 1] = question()
  end
  provider.default("collision", built_in)
  return answers[1], answers[2]
end

-- Balls and a box at known places: equal to 1e-9, apart, touching and within each other.
solid.create{ name = "ball", root = { kind = "sphere", radius = 0.1 } }
solid.create{ name = "block", root = { kind = "box", x = 0.4, y = 0.3, z = 0.2 } }
local probe = robot.create{ name = "probe", links = {
  { joint = "prismatic", lower = -2, upper = 2, parts = { { what = "ball" } } } } }
local shelf = world.create{ name = "shelf" }
shelf:add_robot{ robot = probe, position = {0.15, 0.1, 0} }
shelf:add_object{ what = "block", position = {0, 0, 0.9}, rpy = {0.3, -0.2, 0.5} }
shelf:add_object{ what = "ball", name = "other", position = {0.4, 0, 0.2} }
local own, known = both(function()
  local all = {}
  for i = 0, 40 do all[#all + 1] = shelf:distances{ q = {i / 20} } end
  return all
end)
local exact, deepest = 0, 0
for i, row in ipairs(own) do
  assert(#row == #known[i] and #row > 1)
  for k = 1, #row do
    exact = math.max(exact, math.abs(row[k].distance - known[i][k].distance))
    deepest = math.min(deepest, row[k].distance)
  end
end
assert(exact < 1e-9, "exact pairs agree: " .. exact)
assert(deepest < -0.1, "the ball goes through the block")

-- Along a recording, where compiled engines work on several threads and this one does not.
local rise = trajectory.create{ name = "rise", segments = { { shape = "line", points = {
  { position = {0.15, 0.1, 0.1}, rpy = {0, 0, 0} }, { position = {0.15, 0.1, 1.5}, rpy = {0, 0, 0} } } } } }
shelf:add_trajectory{ trajectory = rise, name = "rise" }
own, known = both(function()
  local run = shelf:inverse_kinematics{ robot = "probe", trajectory = "rise", clearance = true }
  return run:values "clearance"
end)
for i = 1, #known do exact = math.max(exact, math.abs(own[i] - known[i])) end
assert(#known > 300 and exact < 1e-9, "clearances along a line agree: " .. exact)

-- A shipped robot: never more room than there is.
local cell = world.create{ name = "cell" }
cell:add_robot{ robot = robot "stanford" }
cell:add_object{ what = "block", position = {0.7, 0.2, 0.3} }
own, known = both(function()
  local all = {}
  for i = 1, 5 do all[i] = cell:distances{ q = {0.3 * i, 0.2 * i, 0.2, 0.4, 0.5, 0} } end
  return all
end)
local room, compared = 0, 0
for i = 1, 5 do
  local of = {} -- links that touch always, which differ, are not checked
  for _, pair in ipairs(known[i]) do of[pair.a .. " " .. pair.b] = pair.distance end
  for _, pair in ipairs(own[i]) do
    local distance = of[pair.a .. " " .. pair.b]
    if distance and distance > 0 then
      assert(pair.distance <= distance + 1e-9, pair.a .. " and " .. pair.b)
      room, compared = math.max(room, distance - pair.distance), compared + 1
    end
  end
end
assert(compared > 10)
print(string.format("capsules_lua: exact pairs to %.1g m; %d pairs of the Stanford arm at most %.0f mm less room",
  exact, compared, 1000 * room))
