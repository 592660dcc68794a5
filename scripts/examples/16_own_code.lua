-- SPDX-License-Identifier: Apache-2.0
-- A generator of code of one's own, in Lua: forward kinematics and the Jacobian of any robot whose
-- joints turn or slide, for a PLC (structured text of IEC 61131-3), for GNU Octave or as Lua. What
-- is known of the robot is folded into numbers; the Lua dialect is run here and checked.
local dialects = {
  lua = { file = "%s.lua", at = "%s[%d]", set = "local %s = %s", give = "%s[%d] = %s",
    head = "local function %s(q)\n  local %s = {}", tail = "  return %s\nend",
    first = "-- Forward kinematics and Jacobian of %s.\nlocal sin, cos = math.sin, math.cos",
    last = "return {%s}", indent = "  " },
  octave = { file = "%s.m", at = "%s(%d)", set = "%s = %s;", give = "%s(%d) = %s;",
    head = "function [%2$s] = %1$s(q)", tail = "end",
    first = "%% Forward kinematics and Jacobian of %s.\n1;", last = "", indent = "  " },
  st = { file = "%s.st", at = "%s[%d]", set = "%s := %s;", give = "%s[%d] := %s;",
    first = "(* Forward kinematics and Jacobian of %s. *)", last = "", indent = "  " },
}

-- Expressions are numbers or texts; products with 0 and 1 and sums with 0 vanish.
local function written(x)
  if type(x) == "string" then return x end
  local s = string.format("%.17g", x)
  return s:find("[%.en]") and s or s .. ".0"
end
local function mul(a, b)
  if a == 0 or b == 0 then return 0 end
  if type(a) == "number" and type(b) == "number" then return a * b end
  if a == 1 then return b elseif b == 1 then return a end
  if a == -1 then return "(-" .. written(b) .. ")" elseif b == -1 then return "(-" .. written(a) .. ")" end
  return written(a) .. " * " .. written(b)
end
local function add(a, b)
  if type(a) == "number" and type(b) == "number" then return a + b end
  if a == 0 then return b elseif b == 0 then return a end
  return "(" .. written(a) .. " + " .. written(b) .. ")"
end
local function sub(a, b)
  if type(a) == "number" and type(b) == "number" then return a - b end
  if b == 0 then return a end
  return "(" .. written(a) .. " - " .. written(b) .. ")"
end
-- Entries of a known frame: rounding of its angles is taken off 0, 1 and -1.
local function entry(m, r, c)
  local x = m(r, c)
  local near = math.floor(x + 0.5)
  return math.abs(x - near) < 1e-15 and near or x
end

local base -- of the model of late: where the robot stands; the functions count from there
local function generate(model, name, parts, params)
  base = model.base
  local d = dialects[params.dialect]
  for _, j in ipairs(model.joints) do
    if j.type ~= "revolute" and j.type ~= "prismatic" then
      return nil, "joint " .. j.name .. " is " .. j.type .. "; turning and sliding joints are known"
    end
  end
  if not (parts.forward_kinematics or parts.jacobian) then
    return nil, "forward_kinematics and jacobian are what it writes"
  end
  local lines, temporaries, count
  local function keep(x) -- a temporary for what is not a name or a number
    if type(x) == "number" or x:match("^[%w]+$") then return x end
    count = count + 1
    local t = "t" .. count
    temporaries[#temporaries + 1] = t
    lines[#lines + 1] = d.set:format(t, x)
    return t
  end
  -- T times a frame of entries e(r, c), both as twelve entries [row][column].
  local function times(T, e)
    local out = {}
    for r = 1, 3 do
      out[r] = {}
      for c = 1, 4 do
        local x = c == 4 and T[r][4] or 0
        for k = 1, 3 do x = add(x, mul(T[r][k], e(k, c))) end
        out[r][c] = keep(x)
      end
    end
    return out
  end
  local function frames() -- base_T_joint of all joints
    local all = {}
    for i, j in ipairs(model.joints) do
      local x = d.at:format("q", j.q_index - (params.dialect == "st" and 1 or 0))
      if j.coupling then x = keep(add(mul(j.coupling.ratio, x), j.coupling.offset)) end
      local T = j.parent > 0 and all[j.parent] or {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}}
      T = times(T, function(r, c) return entry(j.placement, r, c) end)
      if j.type == "prismatic" then
        for r = 1, 3 do T[r][4] = keep(add(T[r][4], mul(T[r][3], x))) end
      else
        local s, c = keep("sin(" .. x .. ")"), keep("cos(" .. x .. ")")
        for r = 1, 3 do
          local a, b = T[r][1], T[r][2]
          T[r][1] = keep(add(mul(a, c), mul(b, s)))
          T[r][2] = keep(sub(mul(b, c), mul(a, s)))
        end
      end
      all[i] = T
    end
    return all
  end
  local text, functions = {d.first:format(model.name)}, {}
  local function write(part, result, size, body)
    lines, temporaries, count = {}, {}, 0
    body(function(i, x) lines[#lines + 1] = d.give:format(result, i - (params.dialect == "st" and 1 or 0), written(x)) end)
    local full = name .. "_" .. part
    functions[#functions + 1] = part .. " = " .. full
    if params.dialect == "st" then
      text[#text + 1] = ("FUNCTION_BLOCK %s\nVAR_INPUT q : ARRAY[0..%d] OF LREAL; END_VAR\n" ..
        "VAR_OUTPUT %s : ARRAY[0..%d] OF LREAL; END_VAR\nVAR %s : LREAL; END_VAR"):format(full,
        model.coordinates - 1, result, size - 1, table.concat(temporaries, ", "))
    elseif params.dialect == "octave" then
      text[#text + 1] = ("function %s = %s(q)"):format(result, full)
    else
      text[#text + 1] = d.head:format(full, result)
    end
    for _, line in ipairs(lines) do text[#text + 1] = d.indent .. line end
    text[#text + 1] = params.dialect == "st" and "END_FUNCTION_BLOCK" or d.tail:format(result)
  end
  local tip = model.tips[1]
  local function tip_frame(all)
    local T = tip.joint > 0 and all[tip.joint] or {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}}
    return times(T, function(r, c) return entry(tip.tool, r, c) end)
  end
  if parts.forward_kinematics then -- rows of [R p], twelve numbers
    write("forward_kinematics", "frame", 12, function(give)
      local T = tip_frame(frames())
      for r = 1, 3 do for c = 1, 4 do give(4 * (r - 1) + c, T[r][c]) end end
    end)
  end
  if parts.jacobian then -- for each velocity vx vy vz wx wy wz of the tip
    write("jacobian", "columns", 6 * model.dof, function(give)
      local all = frames()
      local T, sum = tip_frame(all), {}
      for i = 1, 6 * model.dof do sum[i] = 0 end
      local i = tip.joint
      while i > 0 do
        local j, F = model.joints[i], all[i]
        local ratio, first = j.coupling and j.coupling.ratio or 1, 6 * (j.v_index - 1)
        local z, v, w = {F[1][3], F[2][3], F[3][3]}, {}, {0, 0, 0}
        if j.type == "prismatic" then
          v = z
        else
          local arm = {}
          for k = 1, 3 do arm[k], w[k] = sub(T[k][4], F[k][4]), z[k] end
          for k = 1, 3 do
            local m, n = k % 3 + 1, (k + 1) % 3 + 1
            v[k] = sub(mul(z[m], arm[n]), mul(z[n], arm[m]))
          end
        end
        for k = 1, 3 do
          sum[first + k] = add(sum[first + k], mul(ratio, v[k]))
          sum[first + 3 + k] = add(sum[first + 3 + k], mul(ratio, w[k]))
        end
        i = j.parent
      end
      for k = 1, #sum do give(k, sum[k]) end
    end)
  end
  if d.last ~= "" then text[#text + 1] = d.last:format(table.concat(functions, ", ")) end
  return {{ name = d.file:format(name), text = table.concat(text, "\n") .. "\n" }}
end

ioci.provide("robomosp.robot_code/1", "scripts_lua", {
  summary = "Forward kinematics and Jacobian as structured text, Octave or Lua.",
  params = { { name = "dialect", type = "enum", choices = {"lua", "octave", "st"}, doc = "Language.", default = "lua" } },
  generate = generate,
})

local function code(arm, name, dialect)
  local made = arm:generate_code{ folder = ".", name = name, parts = {"forward_kinematics", "jacobian"},
    provider = { name = "scripts_lua", params = { dialect = dialect } } }
  local file = assert(io.open(made.files[1]))
  local text = file:read "a"
  file:close()
  os.remove(made.files[1])
  return text
end

local worst = 0
for _, name in ipairs{"puma560", "stanford", "pa10", "cobra600", "ur5"} do
  local arm = robot(name)
  local own = assert(load(code(arm, name, "lua")))()
  for trial = 1, 5 do
    local q = {}
    for i = 1, #arm:joints() do q[i] = math.sin(3 * i + trial) end
    local T, J = own.forward_kinematics(q), own.jacobian(q)
    local at, columns = base:inverse() * arm:fk{ q = q }.pose, arm:jacobian{ q = q }
    for r = 1, 3 do for c = 1, 4 do worst = math.max(worst, math.abs(T[4 * (r - 1) + c] - at(r, c))) end end
    for r = 1, 6 do for c = 1, #q do worst = math.max(worst, math.abs(J[6 * (c - 1) + r] - columns(r, c))) end end
  end
end
assert(worst < 1e-12, "the generated code agrees with the program: " .. worst)

local arm = robot "puma560"
local plc, octave = code(arm, "puma", "st"), code(arm, "puma", "octave")
assert(plc:find("FUNCTION_BLOCK puma_jacobian", 1, true) and plc:find("END_FUNCTION_BLOCK", 1, true))
assert(octave:find("function frame = puma_forward_kinematics(q)", 1, true))
local refused, fault = pcall(arm.generate_code, arm,
  { parts = {"inertia"}, provider = "scripts_lua" })
assert(not refused and tostring(fault):find("are what it writes", 1, true), fault)
print(string.format("scripts_lua: five robots agree to %.1g; %d lines of structured text for the PUMA 560",
  worst, select(2, plc:gsub("\n", ""))))
