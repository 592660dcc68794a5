-- SPDX-License-Identifier: Apache-2.0
-- How the cost of commands grows with what they work on: joints of a chain, objects of a world, nodes
-- of a solid, records, lists (parameters, segments, steps), samples of a recording.
--
--   robomosp run tests/bench/growth.lua OUT [largest [family]]
--
-- Times are processor time of the whole process, all threads, of the command as a user gives it, the
-- least of a few passes: what a first pass computes and keeps, the next ones find, but where a pass
-- changes what it works on. Programs that read foreign files are not counted. Writes OUT/growth.csv,
-- a plot for each family (by gnuplot), and OUT/growth.md: times and the exponent of the last two sizes
-- that took 1 ms and more (1 = linear).
-- What has an exponent of 1.2 and more, and what could not be measured, is named at the end.
local out, largest = arg and arg[1] or ".", tonumber(arg and arg[2] or 1e5)
local only = arg and arg[3]
local short = 0.02   -- [s] what takes less is repeated

local rows = {}      -- {family, what, n, seconds}
local function note(family, what, n, seconds)
  rows[#rows + 1] = {family, what, n, seconds}
  io.stderr:write(string.format("%-10s %-34s %8d %12.6f s %10.4f us each\n", family, what, n,
                                seconds, seconds / n * 1e6))
end
--- The least time of `call` in a few passes.
local function time_of(call)
  local best, passes, spent = math.huge, 0, 0
  repeat
    local t = os.clock()
    call()
    t = os.clock() - t
    best, passes, spent = math.min(best, t), passes + 1, spent + t
  until passes >= 2 and (spent > short or passes >= 100)
  return best
end
local left_out, last = {}, {}   -- what has no time, and why; the time before
local function measure(family, n, list)
  for i = 1, #list, 2 do
    local what, call = list[i], list[i + 1]
    local key, why = family .. what, nil
    if last[key] and last[key] > 1.5 then
      why = "left out, since the size before took " .. string.format("%.1f s", last[key])
    else
      local ok, e = pcall(function()
        last[key] = time_of(call)
        note(family, what, n, last[key])
      end)
      if not ok then why = tostring(e) end
    end
    if why then left_out[#left_out + 1] = family .. " " .. what .. " " .. n .. ": " .. why end
  end
end
local function sizes(family, from, to)
  local s, n = {}, from
  if only and only ~= family then return s end
  while n <= math.min(to, largest) do s[#s + 1] = n; n = n * 10 end
  return s
end
local tmp = os.tmpname(); os.remove(tmp); os.execute("mkdir -p " .. tmp)

-- joints: a chain of n ------------------------------------------------------------------------
for _, n in ipairs(sizes("joints", 10, 10000)) do
  document.clear()
  local links = {}
  for i = 1, n do
    links[i] = {a = 1 / n, alpha = i % 2 == 0 and "90 deg" or "-90 deg", mass = 1 / n,
                com = {-0.5 / n, 0, 0}, inertia = {1e-6, 1e-6, 1e-6, 0, 0, 0}, max_velocity = 1}
  end
  local count = 0
  local arm
  measure("joints", n, {
    "robot.create", function()
      count = count + 1
      arm = robot.create{name = "chain" .. count, links = links}
    end})
  local q, z = {}, {}
  for i = 1, n do q[i] = 0.3 * math.sin(i); z[i] = 0.1 end
  measure("joints", n, {
    "robot.fk", function() arm:fk{q = q} end,
    "robot.jacobian", function() arm:jacobian{q = q} end,
    "robot.inverse_dynamics", function() arm:inverse_dynamics{q = q, qd = z, qdd = z} end,
    "robot.forward_dynamics", function() arm:forward_dynamics{q = q, qd = z, tau = z} end,
    "robot.gravity_torques", function() arm:gravity_torques{q = q} end,
    "robot.energy", function() arm:energy{q = q, qd = z} end,
    "robot.set_link, undo", function() arm:set_link{link = n // 2, mass = math.random() / n}; document.undo() end,
    "robot.set_link and fk", function() arm:set_link{link = n // 2, a = math.random() / n}; arm:fk{q = q} end,
    "robot.describe", function() arm:describe() end,
    "robot.links", function() arm:links() end,
    "robot.dh_table", function() arm:dh_table() end,
    "robot.overview", function() arm:overview() end,
    "robot.mass", function() arm:mass{q = q} end,
    "robot.text", function() arm:text() end,
    "robot.save", function() arm:save{file = tmp .. "/chain.rbt"} end,
    "robot.duplicate", function() count = count + 1; arm:duplicate{name = "copy" .. count} end,
    "robot.export_urdf", function() arm:export_urdf{file = tmp .. "/chain.urdf"} end,
    "robot.self_collisions", function() if n <= 100 then arm:self_collisions{q = q} else error("bodies of 20 ms a link") end end,
    "robot.clearance", function() if n <= 100 then arm:clearance{q = q} else error("bodies of 20 ms a link") end end,
    "robot.solve_ik", function() arm:solve_ik{target = arm:fk{q = q}.pose, seed = z, partial = true} end,
    "robot.simulate (10 ms)", function() arm:simulate{q = q, duration = 0.01, step = 0.001} end})
  measure("joints", n, {
    "robot.load", function() document.clear(); robot.load{file = tmp .. "/chain.rbt"} end,
    "import (URDF)", function() document.clear(); import{file = tmp .. "/chain.urdf"} end})
end

-- objects: n boxes in a world ---------------------------------------------------------------------
for _, n in ipairs(sizes("objects", 10, 100000)) do
  document.clear()
  solid.create{name = "brick", root = {kind = "box", x = 0.2, y = 0.1, z = 0.05}}
  local wall = {}
  local side = math.ceil(n ^ (1 / 3))
  for i = 0, n - 1 do
    wall[i + 1] = {what = "brick", name = "b" .. i,
                   position = {0.3 * (i % side), 0.3 * (i // side % side), 0.3 * (i // side // side)}}
  end
  local cell, k = nil, 0
  measure("objects", n, {
    "world.add_objects", function()
      k = k + 1
      cell = world.create{name = "cell" .. k}
      cell:add_objects(wall)
    end})
  cell:add_robot{robot = robot.get("puma560"), name = "arm", position = {-2, -2, 0}}
  measure("objects", n, {
    "world.place, undo", function()
      cell:place{member = "b" .. n // 2, position = {-1, -1, math.random()}}
      document.undo()
    end,
    "world.objects", function() cell:objects() end,
    "world.describe", function() cell:describe() end,
    "world.text", function() cell:text() end,
    "world.save", function() cell:save{file = tmp .. "/cell.wld"} end,
    "world.duplicate", function() k = k + 1; cell:duplicate{name = "copy" .. k} end,
    "world.collisions", function() cell:collisions() end,
    "world.clearance", function() cell:clearance() end,
    "world.add_object, remove", function()
      cell:add_object{what = "brick", name = "more", position = {-2, 0, 0}}
      cell:remove_member{member = "more"}
    end,
    "world.export (GLB)", function() cell:export{file = tmp .. "/cell.glb"} end,
    "world.simulate_physics (10 ms)", function() cell:simulate_physics{duration = 0.01, step = 0.001} end})
  measure("objects", n, {"world.load", function() document.clear(); world.load{file = tmp .. "/cell.wld"} end})
end

-- nodes: a solid of n boxes -------------------------------------------------------------------------
for _, n in ipairs(sizes("nodes", 10, 10000)) do
  document.clear()
  local apart = {}
  for i = 1, n do
    apart[i] = {kind = "box", x = 0.01, y = 0.01, z = 0.01, position = {0.02 * (i % 100), 0.02 * (i // 100), 0}}
  end
  local k, s = 0, nil
  measure("nodes", n, {
    "solid.create", function()
      k = k + 1
      s = solid.create{name = "s" .. k, root = {kind = "union", children = apart}}
    end})
  measure("nodes", n, {
    "solid.set, mass", function() s:set{path = "box_" .. n // 2 .. ".x", value = 0.01 + 0.001 * math.random()}; s:mass() end,
    "solid.set, mesh_info", function() s:set{path = "box_" .. n // 2 .. ".x", value = 0.01 + 0.001 * math.random()}; s:mesh_info() end,
    "solid.tree", function() s:tree() end,
    "solid.text", function() s:text() end,
    "solid.edges", function() s:edges() end,
    "solid.save", function() s:save{file = tmp .. "/s.csg"} end})
  measure("nodes", n, {"solid.load", function() document.clear(); solid.load{file = tmp .. "/s.csg"} end})
end

-- records: n of them --------------------------------------------------------------------------------
for _, n in ipairs(sizes("records", 10, 10000)) do
  measure("records", n, {
    "solid.create, n times", function()
      document.clear()
      for i = 1, n do solid.create{name = "s" .. i, root = {kind = "box", x = 0.1, y = 0.1, z = 0.1}} end
    end})
  measure("records", n, {
    "solid.set of one, undo", function()
      solid.set{id = "s" .. n // 2, path = "box.x", value = math.random()}
      document.undo()
    end,
    "document.list", function() document.list() end,
    "solid.list", function() solid.list() end,
    "document.digest", function() document.digest() end,
    "document.history", function() document.history() end,
    "solid.rename", function() solid.rename{id = "s1", name = "other"}; solid.rename{id = "other", name = "s1"} end,
    "object.create of all", function()
      local parts = {}
      for i = 1, n do parts[i] = {what = "s" .. i, position = {i, 0, 0}} end
      object.create{name = "o" .. math.random(1 << 40), parts = parts}
    end,
    "document.referrers", function() document.referrers{record = solid.get("s1")} end,
    "file.save_all", function() os.execute("mkdir -p " .. tmp .. "/all"); file.save_all{folder = tmp .. "/all"} end,
    "undo and redo of all", function()
      local steps = 0
      while pcall(document.undo) and steps < n do steps = steps + 1 end
      for _ = 1, steps do document.redo() end
    end})
end

-- parameters, steps, segments -------------------------------------------------------------------------
for _, n in ipairs(sizes("lists", 10, 10000)) do
  document.clear()
  local p = {p1 = "1 mm"}
  for i = 2, n do p["p" .. i] = "p" .. i - 1 .. " + 1 um" end
  local k, s = 0, nil
  measure("parameters", n, {
    "solid.create, a chain of parameters", function()
      k = k + 1
      s = solid.create{name = "s" .. k, parameters = p, root = {kind = "box", x = "p" .. n, y = 0.1, z = 0.1}}
    end,
    "set_parameter", function() s:set_parameter{name = "p1", value = math.random() * 1e-3} end})
  document.clear()
  local t
  k = 0
  local segments = {}
  for i = 1, n do
    segments[i] = {shape = "line", points = {{0.5 + 0.1 * (i % 2), 0.1, 0.3, 0, 0, 0}, {0.5 + 0.1 * ((i + 1) % 2), 0.1, 0.3, 0, 0, 0}}}
  end
  measure("segments", n, {
    "trajectory.create", function() k = k + 1; t = trajectory.create{name = "t" .. k, segments = segments} end})
  measure("segments", n, {
    "trajectory.set, length", function() t:set{description = tostring(math.random())}; t:length() end,
    "trajectory.length", function() t:length() end,
    "trajectory.points (100)", function() t:points{step = t:duration() / 100} end,
    "trajectory.segments", function() t:segments() end,
    "trajectory.text", function() t:text() end})
  document.clear()
  local cell = world.create{name = "cell"}
  cell:add_robot{robot = robot.get("puma560"), name = "arm"}
  k = 0
  local steps, task_ = {}, nil
  for i = 1, n do steps[i] = {step = "wait", time = 0.001} end
  measure("steps", n, {
    "task.create", function() k = k + 1; task_ = task.create{name = "t" .. k, steps = steps} end})
  measure("steps", n, {
    "task.steps", function() task_:steps() end,
    "world.run_task", function()
      if #cell:tasks() == 0 then cell:add_task{task = task_} end
      cell:run_task{task = task_, sample_time = 0.01}
    end})
end

-- samples: a run of n -----------------------------------------------------------------------------------
for _, n in ipairs(sizes("samples", 100, 1000000)) do
  document.clear()
  local arm = robot.get("puma560")
  local cell = world.create{name = "cell"}
  cell:add_robot{robot = "puma560", name = "arm", q = {0, -0.5, 0.2, 0.3, 0.5, 0}}
  local q = {0, -0.5, 0.2, 0.3, 0.5, 0}
  local from = arm:fk{q = q}
  local p, a = from.position, from.rpy
  trajectory.create{name = "stroke", segments = {{shape = "line", law = {name = "constant_speed", duration = 10},
    points = {{p[1], p[2], p[3], a[1], a[2], a[3]}, {p[1], p[2] + 0.05, p[3], a[1], a[2], a[3]}}}}}
  cell:add_trajectory{trajectory = "stroke"}
  local run
  local dt = trajectory.duration{id = "stroke"} / n
  measure("samples", n, {
    "trajectory.points", function() trajectory.points{id = "stroke", step = dt} end,
    "world.inverse_kinematics", function() run = cell:inverse_kinematics{robot = "arm", trajectory = "stroke", sample_time = dt} end,
    "world.simulate", function() run = cell:simulate{robot = "arm", trajectory = "stroke", sample_time = dt} end,
    "world.check", function() cell:check{robot = "arm", trajectory = "stroke", sample_time = dt} end,
    "world.time_optimal", function() cell:time_optimal{robot = "arm", trajectory = "stroke", sample_time = dt} end})
  measure("samples", n, {
    "recording.summary", function() run:summary() end,
    "recording.values", function() run:values{columns = "q1"} end,
    "recording.compute", function() run:compute{quantities = {"energy"}} end,
    "recording.compare", function() run:compare{with = run} end,
    "recording.plot (SVG)", function() run:plot{file = tmp .. "/run.svg"} end,
    "recording.replay", function() run:replay{file = tmp .. "/run.html"} end,
    "recording.csv", function() run:csv{file = tmp .. "/run.csv"} end,
    "recording.save", function() run:save{file = tmp .. "/run.rec"} end,
    "recording.load (CSV)", function() recording.load{file = tmp .. "/run.csv"} end,
    "recording.load", function() recording.load{file = tmp .. "/run.rec"} end,
    "robot.simulate (n steps)", function() arm:simulate{q = "ready", duration = n * 1e-5, step = 1e-5, sample_time = 1e-5} end,
    "world.simulate_physics (n steps)", function() if n <= 10000 then cell:simulate_physics{duration = n * 1e-3, step = 1e-3, sample_time = 1e-3} else error("left out, since it would take long") end end})
end
os.execute("rm -rf " .. tmp)

-- tables -----------------------------------------------------------------------------------------
local families, names, times, all_sizes = {}, {}, {}, {}
for _, r in ipairs(rows) do
  local family, what, n, t = table.unpack(r)
  if not names[family] then names[family] = {}; families[#families + 1] = family; all_sizes[family] = {} end
  if not times[family .. what] then
    times[family .. what] = {}
    table.insert(names[family], what)
  end
  times[family .. what][n] = t
  all_sizes[family][n] = true
end
local csv = assert(io.open(out .. "/growth.csv", "w"))
csv:write("family,command,count,seconds\n")
for _, r in ipairs(rows) do csv:write(string.format("%s,\"%s\",%d,%.9f\n", r[1], r[2], r[3], r[4])) end
csv:close()
local function shown(t)
  if not t then return "" end
  if t < 1e-3 then return string.format("%.3g us", t * 1e6) end
  if t < 1 then return string.format("%.3g ms", t * 1e3) end
  return string.format("%.3g s", t)
end
local page, faster = assert(io.open(out .. "/growth.md", "w")), {}
for _, family in ipairs(families) do
  local list = {}
  for n in pairs(all_sizes[family]) do list[#list + 1] = n end
  table.sort(list)
  page:write("| " .. family .. " | " .. table.concat(list, " | ") .. " | exponent |\n|---|", ("---|"):rep(#list + 1), "\n")
  local data = assert(io.open(out .. "/growth_" .. family .. ".dat", "w"))
  for _, what in ipairs(names[family]) do
    local t, cells, exponent = times[family .. what], {}, ""
    for i, n in ipairs(list) do
      cells[i] = shown(t[n])
      local before = i > 1 and t[list[i - 1]]
      if t[n] and before and before > 1e-3 then
        local e = math.log(t[n] / before) / math.log(n / list[i - 1])
        exponent = string.format("%.2f", e)
      end
      if t[n] then data:write(string.format("%d %.9f\n", n, math.max(t[n], 1e-6))) end
    end
    data:write("\n\n")
    if tonumber(exponent) and tonumber(exponent) >= 1.2 then faster[#faster + 1] = family .. ": " .. what .. " " .. exponent end
    page:write("| " .. what .. " | " .. table.concat(cells, " | ") .. " | " .. exponent .. " |\n")
  end
  data:close()
  page:write("\n")
  local stem = out .. "/growth_" .. family
  local plot = assert(io.open(stem .. ".gp", "w"))
  plot:write(string.format([[
set terminal pngcairo size 1200,700 font "sans,13"
set output "%s.png"
set logscale xy
set xlabel "%s"
set ylabel "processor time [s]"
set format y "10^{%%L}"
set format x "%%.0f"
set grid lc rgb "#dddddd"
set key outside right top samplen 2 spacing 1.15
set yrange [1e-6:]
plot 1e-5*x title "linear" with lines dashtype 2 lw 2 lc rgb "#888888"]], stem, family))
  for i, what in ipairs(names[family]) do
    plot:write(string.format(", \\\n  '%s.dat' index %d title '%s' noenhanced with linespoints lw 2 pt %d ps 0.9", stem, i - 1, what, i % 13 + 1))
  end
  plot:write("\n")
  plot:close()
  if os.execute("gnuplot " .. stem .. ".gp") then os.remove(stem .. ".gp"); os.remove(stem .. ".dat") end
end
page:close()
for _, why in ipairs(left_out) do print(why) end
print(#faster == 0 and "Nothing grows faster than what it works on."
      or "Faster than what it works on:\n  " .. table.concat(faster, "\n  "))
