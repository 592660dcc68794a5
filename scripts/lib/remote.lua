-- SPDX-License-Identifier: Apache-2.0
-- Another program that serves, as if its commands were here. `local remote = require "remote"`.
--
--   local r = remote.connect{address = "127.0.0.1:7007"}
--   local arm = r.robot.get "pa10"
--   local found = arm:solve_ik{target = {0.557, 0, 0.374, "180 deg", 0, "180 deg"}}
--   r:on("change", function(event) print(event.label) end)
--   r:wait(10)
--   r:close()
--
-- Commands, their arguments and what they give are those of the program over there.
local remote = {}

local kDeepest = 60
local kPoseFields = {position = true, cylindrical = true, spherical = true, rpy = true, xyz = true,
                     zyz = true, quaternion = true, axis_angle = true}
local kNumberWords = {inf = math.huge, ["-inf"] = -math.huge, nan = 0 / 0}
local own_source = debug.getinfo(1, "S").source

-- Of each connection what it keeps: number, timeout, specs, kinds, handlers.
local inside = setmetatable({}, {__mode = "k"})
-- Of each handle: its connection, and what it is.
local owner_of = setmetatable({}, {__mode = "k"})
local facts_of = setmetatable({}, {__mode = "k"})

--- The line of the script that called into this file.
local function caller()
  for level = 3, 20 do
    local info = debug.getinfo(level, "Sl")
    if not info then
      return ""
    end
    if info.source ~= own_source and info.currentline > 0 then
      return info.short_src .. ":" .. info.currentline
    end
  end
  return ""
end

--- Raises an error as if the command had been one of this program.
local function raise(e)
  if type(e) == "table" and e.code then
    e.where = (e.where or ""):gsub("^connection%.%a+,? ?", "")
    e.at = caller()
  end
  error(e, 0)
end

local function refuse(code, message, hint)
  -- A table with these fields is an error to every command and to the console.
  error(setmetatable({code = code, message = message, where = "", hint = hint or "", at = caller()}, {
    __tostring = function(e) return e.message .. "." .. (e.hint ~= "" and " " .. e.hint or "") end}), 0)
end

--- Runs a command of this program; its errors have the place of the script.
local function run(command, arguments)
  local results = table.pack(pcall(command, arguments))
  if not results[1] then
    raise(results[2])
  end
  return table.unpack(results, 2, results.n)
end

--- Arguments as they are sent: handles as tables of what they are.
local function packed(c, value, depth)
  if type(value) ~= "table" then
    return value
  end
  if depth > kDeepest then
    refuse("invalid_argument", "the arguments are nested too deeply")
  end
  local of = owner_of[value]
  if of then
    if of ~= c then
      refuse("invalid_argument", tostring(value) .. " is of another connection",
             "Get it by name through this one.")
    end
    return {["$handle"] = facts_of[value]}
  end
  local out = {}
  for key, v in pairs(value) do
    out[key] = packed(c, v, depth + 1)
  end
  return out
end

local function handle_text(handle)
  local facts = facts_of[handle]
  return facts.kind .. (facts.name ~= "" and ":" .. facts.name or "") .. "#" .. facts.number
end

local function no_field(handle)
  refuse("invalid_argument", "fields of a " .. handle.kind .. " cannot be assigned",
         "Edit it with a command, for example x:set{...}.")
end

local function is_same(a, b)
  local x, y = facts_of[a], facts_of[b]
  return owner_of[a] == owner_of[b] and x and y and x.kind == y.kind and x.number == y.number and
         x.generation == y.generation or false
end

local function new_handle(c, h)
  local self = inside[c]
  local find = self.kinds[h.kind]
  if not find then
    local methods = self.methods[h.kind] or {}
    find = function(handle, key)
      local found = methods[key]
      if found == nil then
        found = facts_of[handle][key]
      end
      if found ~= nil then
        return found
      end
      refuse("unknown_name", "a " .. h.kind .. " over there has no method \"" .. tostring(key) .. "\"",
             "r." .. h.kind .. " holds the commands of its kind.")
    end
    self.kinds[h.kind] = find
  end
  local handle = {}
  owner_of[handle] = c
  facts_of[handle] = {kind = h.kind, number = h.number, name = h.name or "", generation = h.generation}
  -- One metatable each: __shown is what a console shows, which runs no script.
  return setmetatable(handle, {__name = h.kind, __index = find, __newindex = no_field, __eq = is_same,
                               __tostring = handle_text,
                               __shown = handle_text(handle) .. " at " .. self.about.address})
end

--- What came, with handles to be used; `types` says which texts are numbers and which units there are.
local function unpacked(c, value, returns)
  if type(value) == "string" and returns and returns.type == "real" then
    return kNumberWords[value] or value
  end
  if type(value) == "userdata" then
    return returns and returns.unit and returns.unit ~= "" and array(value, returns.unit) or value
  end
  if type(value) ~= "table" then
    return value
  end
  local inner = rawget(value, "$handle")
  if type(inner) == "table" and inner.kind and inner.number then
    return new_handle(c, inner)
  end
  local fields = {}
  for _, field in ipairs(returns and returns.fields or {}) do
    fields[field.name] = field
  end
  local out = {}
  for key, v in pairs(value) do
    -- Entries of a list have the fields of the list.
    out[key] = unpacked(c, v, type(key) == "number" and returns and {fields = returns.fields} or fields[key])
  end
  return out
end

--- Whether the only argument gives names, or is the value of the next parameter.
local function gives_names(value, params, place)
  if type(value) ~= "table" or owner_of[value] then
    return false
  end
  local type_of = params[place] and params[place].type
  local any, known, pose = false, false, false
  for key in pairs(value) do
    if type(key) ~= "string" then
      return false
    end
    any = true
    for _, p in ipairs(params) do
      known = known or p.name == key
    end
    pose = pose or kPoseFields[key]
  end
  return not any or known or not (type_of == "map" or type_of == "pose" and pose)
end

--- The arguments of a call by name, as commands of this program take them.
local function arguments(spec, ...)
  local given, count = {...}, select("#", ...)
  local named, first, place = {}, 1, 1
  local params = spec.params
  local has_id = params[1] and params[1].name == "id"
  if has_id and count > 0 and (owner_of[given[1]] or type(given[1]) == "string") then
    named.id, first, place = given[1], 2, 2
  end
  if first == count and gives_names(given[first], params, place) then
    for key, value in pairs(given[first]) do
      if key == "id" and named.id ~= nil then
        refuse("usage", "id is given twice", "Leave it out of the braces.")
      end
      named[key] = value
    end
    return named
  end
  for i = first, count do
    if place > #params then
      refuse("usage", "there are more arguments than the " .. #params .. " that " .. spec.name .. " takes")
    end
    named[params[place].name] = given[i]
    place = place + 1
  end
  return named
end

local function call(c, method, params, options)
  local self = inside[c]
  if not self then
    refuse("usage", "a method of a connection was called without it", "Write r:eval(...) with a colon.")
  end
  if self.is_closed then
    refuse("io", tostring(c):gsub("^connection", "the connection") .. " is closed", "Connect again.")
  end
  options = options or {}
  return run(connection.call, {connection = self.number, method = method, params = packed(c, params or {}, 0),
                               job = options.job, timeout = options.timeout or self.timeout})
end

local function run_command(c, spec, ...)
  local result = call(c, spec.name, arguments(spec, ...))
  if result == nil then
    return
  end
  return unpacked(c, result, spec.returns)
end

--- Fills a connection with the commands of the program over there.
local function learn(c)
  local self = inside[c]
  self.specs, self.kinds, self.methods = {}, {}, {}
  for name in pairs(self.topics or {}) do
    rawset(c, name, nil)
  end
  self.topics = {}
  for _, spec in ipairs(call(c, "ioci.describe", {})) do
    self.specs[spec.name] = spec
    local topic, verb = spec.name:match("^([^.]+)%.(.+)$")
    local command = function(...) return run_command(c, spec, ...) end
    if not topic then
      if not remote.Connection[spec.name] then
        self.topics[spec.name] = true
        rawset(c, spec.name, command)
      end
    else
      local names = rawget(c, topic)
      if not names then
        names = setmetatable({}, {
          __name = topic,
          __call = function(t, ...) return t.get(...) end,
          __index = function(_, key)
            refuse("unknown_name", "there is no command \"" .. topic .. "." .. tostring(key) .. "\" over there")
          end})
        self.topics[topic] = true
        rawset(c, topic, names)
      end
      rawset(names, verb, command)
      if spec.params[1] and spec.params[1].name == "id" then
        self.methods[topic] = self.methods[topic] or {}
        self.methods[topic][verb] = command
      end
    end
  end
end

local Connection = {}
remote.Connection = Connection

--- Calls a method by its name: r:call("robot.fk", {id = "pa10", q = "ready"}, {timeout = 5}).
function Connection:call(method, params, options)
  local spec = inside[self] and inside[self].specs[method]
  return unpacked(self, call(self, method, params, options), spec and spec.returns)
end

--- A command as a job over there, whose handle it gives: r:start("robot.workspace", {id = "pa10"}):wait().
function Connection:start(method, params)
  return unpacked(self, call(self, method, params, {job = true}))
end

--- Runs a script over there; prints what it prints and returns what it returns.
function Connection:eval(code)
  local out = unpacked(self, call(self, "lua.eval", {code = code}))
  if out.output and out.output ~= "" then
    io.write(out.output)
  end
  if out.values then
    return table.unpack(out.values)
  end
  return out.value
end

--- A line of the program of 2006: r:classic "PRobot puma560 GetDOF".
function Connection:classic(line)
  return unpacked(self, call(self, "ioci.classic", {line = line}))
end

local function subscribe(c, handler)
  local params = {}
  for key, value in pairs(handler.options) do
    params[key] = value
  end
  params.topics = {handler.topic}
  return call(c, "server.subscribe", params)
end

--- Calls fn(event) for what happens over there, while this waits: r:on("change", print). Topics are change,
--- message, job and run; options are those of event.subscribe. Returns a function that ends it.
function Connection:on(topic, fn, options)
  if type(topic) ~= "string" or type(fn) ~= "function" then
    refuse("usage", "on needs a topic and a function", "Write r:on(\"change\", function(event) ... end).")
  end
  local handler = {topic = topic, fn = fn, options = options or {}}
  local self_ = inside[self]
  handler.number = subscribe(self, handler)
  self_.handlers[handler] = true
  return function()
    if self_.handlers[handler] then
      self_.handlers[handler] = nil
      call(self, "server.unsubscribe", {subscription = handler.number})
    end
  end
end

--- Waits so many seconds, or until until_true() is true, and calls the functions of on() meanwhile. Returns
--- how many events came, or whether it became true.
function Connection:wait(seconds, until_true)
  local self_, count, left = inside[self], 0, seconds or 0
  while not (until_true and until_true()) do
    local came = run(connection.events, {connection = self_.number, timeout = math.max(left, 0)})
    for _, event in ipairs(came.events) do
      for handler in pairs(self_.handlers) do
        if handler.number == event.subscription then
          count = count + 1
          handler.fn(unpacked(self, event))
        end
      end
    end
    left = left - came.seconds
    if left <= 0 then
      if until_true then
        return until_true() and true or false
      end
      return count
    end
  end
  return true
end

--- Connects again, trying for so many seconds. What on() was told goes on; handles hold where the program
--- over there is still the same.
function Connection:reconnect(seconds)
  local self_ = inside[self]
  local about = run(connection.reopen, {connection = self_.number, timeout = seconds or 0})
  if about.generation ~= self_.about.generation then
    learn(self)
  end
  self_.about = about
  for handler in pairs(self_.handlers) do
    handler.number = subscribe(self, handler)
  end
  return self
end

--- What the server said of itself: version, effects, limits.
function Connection:about()
  return inside[self].about.server
end

--- Ends the connection.
function Connection:close()
  local self_ = inside[self]
  if self_ and not self_.is_closed then
    self_.is_closed = true
    pcall(connection.close, self_.number)
  end
end

local kMeta = {
  __index = function(c, key)
    if Connection[key] then
      return Connection[key]
    end
    if key == "timeout" then
      return inside[c] and inside[c].timeout
    end
    refuse("unknown_name", "the program over there has no commands \"" .. tostring(key) .. "\"")
  end,
  __newindex = function(c, key, value)
    if key ~= "timeout" then
      refuse("invalid_argument", "only the timeout of a connection can be assigned")
    end
    inside[c].timeout = value
  end,
  __close = function(c) c:close() end,
  __tostring = function(c) return "connection to " .. inside[c].about.address end}

--- Connects to a program that serves: remote.connect "127.0.0.1:7007", or with the arguments of
--- connection.open: remote.connect{address = "robots.example:7007", token = "rmp_...", certificate =
--- "server.pem"}. r.timeout [s] is for all its calls; nil = as long as they take.
function remote.connect(options)
  if type(options) == "string" then
    options = {address = options}
  end
  local about = run(connection.open, options or {})
  local meta = {__name = "connection", __shown = "connection to " .. about.address}
  for name, value in pairs(kMeta) do
    meta[name] = value
  end
  local c = setmetatable({}, meta)
  inside[c] = {number = about.connection, about = about, handlers = {}, specs = {}}
  local ok, why = pcall(learn, c)
  if not ok then
    c:close()
    raise(why)
  end
  return c
end

return remote
