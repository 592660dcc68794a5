-- SPDX-License-Identifier: Apache-2.0
-- Processor time of commands, for two builds that tests/bench/compare runs by turns.
--
--   robomosp -q run tests/bench/compare_commands.lua examples OUT          writes the examples of all commands
--   robomosp -q run tests/bench/compare_commands.lua time EXAMPLES OUT SECONDS [NAMES]
--   robomosp -q run tests/bench/compare_commands.lua large OUT SECONDS [NAMES]
--
-- `time` runs each example in a cleared document, again and again, and writes for each a line: name,
-- least time of the example [us], least time in its command [us], runs, or the error. Several runs
-- are one measurement, since the clock counts microseconds. `large` measures saving, loading and
-- undoing of large records. Times are processor time of all threads.
local what = arg[1]

if what == "examples" then
  local out = assert(io.open(arg[2], "w"))
  out:write("return {\n")
  for _, c in ipairs(ioci.describe()) do
    if c.example and c.example ~= "" then out:write(string.format("{%q, %q},\n", c.name, c.example)) end
  end
  out:write("}\n")
  out:close()
  return
end

local function words(text)
  if not text or text == "" then return nil end
  local all = {}
  for w in text:gmatch("[^,]+") do all[w] = true end
  return all
end

local function clear()
  for _, r in ipairs(recording.list()) do recording.remove(r.recording) end
  document.clear()
end

if what == "time" then
  local examples, out, budget, only = dofile(arg[2]), assert(io.open(arg[3], "w")), tonumber(arg[4]), words(arg[5])
  -- The time in the command that is measured, by functions around commands and methods.
  local target, spent, calls, depth = "", 0, 0, 0
  local function finish(begun, ...)
    spent, calls = spent + os.clock() - begun, calls + 1
    return ...
  end
  local function watched(name, f)
    return function(...)
      if name ~= target then return f(...) end
      return finish(os.clock(), f(...))
    end
  end
  for name, space in pairs(_G) do
    local mt = type(space) == "table" and getmetatable(space)
    if type(mt) == "table" and rawget(mt, "__name") == name then
      local all = {}
      for verb, f in pairs(space) do if type(f) == "function" then all[verb] = f end end
      for verb, f in pairs(all) do rawset(space, verb, watched(name .. "." .. verb, f)) end
      local call = rawget(mt, "__call")
      if call then mt.__call = watched(name .. ".get", call) end
    end
  end
  for _, name in ipairs{"version", "help"} do
    if type(_G[name]) == "function" then _G[name] = watched(name, _G[name]) end
  end
  local seen = {}
  local function watch_kind(h)
    local mt = debug.getmetatable(h)
    if not mt or seen[mt] then return end
    seen[mt] = true
    local index, kind, methods = mt.__index, mt.__name, {}
    mt.__index = function(x, k)
      local f = methods[k]
      if f then return f end
      f = index(x, k)
      if type(f) ~= "function" then return f end
      f = watched(kind .. "." .. k, f)
      methods[k] = f
      return f
    end
  end
  for _, make in ipairs{
      function() return material.create{name = "m", density = 1} end,
      function() return solid.create{name = "s", root = {kind = "sphere", radius = 1}} end,
      function() return object.create{name = "o", parts = {{what = "s"}}} end,
      function() return robot.create{name = "r", links = {{a = 1}}} end,
      function() return trajectory.create{name = "t", segments = {{shape = "line", points = {{0, 0, 0}, {1, 0, 0}}}}} end,
      function() return world.create{name = "w"} end,
      function() return task.create{name = "k", steps = {{step = "message", text = "x"}}} end,
      function() return program.create{name = "p", source = "PROGRAM p; BEGIN HALT; ENDPROGRAM;"} end,
      function() return controller.create{name = "c", target = "krl"} end,
      function() return robot.get("r"):simulate{q = {0}, duration = 0.01} end,
    } do
    local ok, h = pcall(make)
    if ok then watch_kind(h) end
  end
  clear()
  local real_clock = os.clock
  local function run(chunk, name)
    local env = setmetatable({}, {__index = _G})
    local f = assert(load(chunk, name, "t", env))
    clear()
    spent, calls = 0, 0
    local begun = real_clock()
    local ok, e = pcall(f)
    return ok, real_clock() - begun, e
  end
  for _, each in ipairs(examples) do
    local name, chunk = each[1], each[2]
    if not only or only[name] then
      target = name
      local ok, took, e = run(chunk, name)
      if not ok then
        out:write(string.format("%s\tfailed\t%s\n", name, (tostring(e):gsub("%s+", " "))))
      else
        local _, again = run(chunk, name)
        local per = math.max(1, math.min(20, math.ceil(0.002 / math.max(again, 1e-6))))
        local best, best_own, runs, used = math.huge, math.huge, 0, 0
        repeat
          collectgarbage()
          local sum, own, fine = 0, 0, true
          for _ = 1, per do
            local good, t = run(chunk, name)
            fine = fine and good
            sum, own, runs = sum + t, own + (calls > 0 and spent / calls or 0), runs + 1
          end
          used = used + sum
          if not fine then break end
          best, best_own = math.min(best, sum / per), math.min(best_own, own / per)
        until runs >= 3 * per and (used > budget or runs >= 400)
        out:write(string.format("%s\t%.2f\t%.2f\t%d\n", name, best * 1e6, best_own * 1e6, runs))
      end
      out:flush()
    end
  end
  out:close()
  os.exit(0)
end

-- large ----------------------------------------------------------------------------------------
local out, budget, only = assert(io.open(arg[2], "w")), tonumber(arg[3]), words(arg[4])
local function measure(name, call, before)
  if only and not only[name] then return end
  local best, runs, used = math.huge, 0, 0
  local ok, e = pcall(function()
    repeat
      if before then before() end
      collectgarbage()
      local t = os.clock()
      call()
      t = os.clock() - t
      best, runs, used = math.min(best, t), runs + 1, used + t
    until runs >= 3 and (used > budget or runs >= 50)
  end)
  if ok then out:write(string.format("%s\t%.2f\t%.2f\t%d\n", name, best * 1e6, best * 1e6, runs))
  else out:write(string.format("%s\tfailed\t%s\n", name, (tostring(e):gsub("%s+", " ")))) end
  out:flush()
end
local function files(kind, h, ending)
  local file = kind .. ending
  measure("save." .. kind, function() h:save{file = file, overwrite = true} end)
  local space = _G[kind]
  measure("describe." .. kind, function() h:describe() end)
  measure("digest." .. kind, function() document.digest() end)
  measure("duplicate." .. kind, function() h:duplicate{name = "copy"} end, function()
    if #space.list() > 1 then pcall(function() document.undo() end) end
  end)
  measure("load." .. kind, function() space.load(file) end, clear)
  clear()
end
do
  local steps = {}
  for i = 1, 20000 do
    local k = i % 4
    steps[i] = k == 0 and {step = "message", text = "m" .. i} or k == 1 and {step = "wait", time = 0.1 * i}
      or k == 2 and {step = "set", signal = "s", value = i}
      or {step = "move", robot = "arm", joints = {0.1, 0.2, 0.3, 0.4, 0.5, 0.6}, speed = 0.5}
  end
  measure("create.task", function() task.create{name = "job", steps = steps} end, clear)
  clear()
  local t = task.create{name = "job", steps = steps}
  measure("steps.task", function() t:steps() end)
  measure("undo.task", function() document.undo() end, function() t:remove_step(1) end)
  files("task", t, ".tsk")
end
do
  local links = {}
  for i = 1, 2000 do
    links[i] = {name = "l" .. i, a = 0.01 * i, alpha = 0.1, d = 0.02, max_velocity = 2, lower = -1, upper = 1,
                mass = 1 + i, com = {0, 0, 0.1}, inertia = {1, 1, 1, 0, 0, 0}}
  end
  measure("create.robot", function() robot.create{name = "chain", links = links} end, clear)
  clear()
  local r = robot.create{name = "chain", links = links}
  measure("undo.robot", function() document.undo() end, function() r:set_link{link = 7, a = 2} end)
  measure("set_link.robot", function() r:set_link{link = 8, a = 3 + os.clock()} end)
  files("robot", r, ".rbt")
end
do
  solid.create{name = "brick", root = {kind = "box", x = 1, y = 1, z = 1}}
  local many = {}
  for i = 1, 10000 do many[i] = {what = "brick", name = "o" .. i, position = {i, 0, 0}} end
  local w = world.create{name = "hall"}
  measure("add_objects.world", function() w:add_objects(many) end, function()
    if #w:objects() > 0 then document.undo() end
  end)
  measure("undo.world", function() document.undo() end, function()
    if #w:objects() == 0 then w:add_objects(many) end
  end)
  measure("redo.world", function() document.redo() end, function()
    if #w:objects() > 0 then document.undo() end
  end)
  if #w:objects() == 0 then w:add_objects(many) end
  measure("objects.world", function() w:objects() end)
  files("world", w, ".wld")
end
do
  local nodes = {}
  for i = 1, 2000 do nodes[i] = {kind = "box", name = "n" .. i, x = 1, y = 1 + i, z = 1} end
  local root = {kind = "union", children = nodes}
  measure("create.solid", function() solid.create{name = "s", root = root} end, clear)
  clear()
  local s = solid.create{name = "s", root = root}
  measure("set.solid", function() s:set{path = "n7.x", value = 1 + os.clock()} end)
  measure("undo.solid", function() document.undo() end, function() s:set{path = "n8.x", value = 2 + os.clock()} end)
  files("solid", s, ".csg")
end
do
  local segments = {}
  for i = 1, 2000 do segments[i] = {shape = "line", points = {{i, 0, 0}, {i + 1, 0, 0}}, speed = 0.1} end
  measure("create.trajectory", function() trajectory.create{name = "t", segments = segments} end, clear)
  clear()
  local t = trajectory.create{name = "t", segments = segments}
  measure("set_segment.trajectory", function() t:set_segment(5, {speed = 0.2 + os.clock() * 1e-6}) end)
  files("trajectory", t, ".tjc")
end
do
  measure("create.materials", function()
    ioci.transaction("fill", function() for i = 1, 10000 do material.create{name = "m" .. i, density = i} end end)
  end, clear)
  measure("undo.materials", function() document.undo() end, function()
    if #material.list() > 0 then return end
    ioci.transaction("fill", function() for i = 1, 10000 do material.create{name = "m" .. i, density = i} end end)
  end)
  measure("list.materials", function() material.list() end, function()
    if #material.list() > 0 then return end
    document.redo()
  end)
  clear()
end
out:close()
os.exit(0)
