-- SPDX-License-Identifier: Apache-2.0
-- Sugar on top of the commands, in plain Lua. `local rm = require "robomosp"`.
local robomosp = {}

--- Values from first to last in count steps, ends included: linspace(0, 1, 5).
function robomosp.linspace(first, last, count)
  assert(count >= 2, "linspace needs at least two values")
  local values = {}
  for i = 1, count do
    values[i] = first + (last - first) * (i - 1) / (count - 1)
  end
  return values
end

--- A new list of fn(x) for every x of a list or numeric array.
function robomosp.map(list, fn)
  local out = {}
  for i = 1, #list do
    out[i] = fn(list[i])
  end
  return out
end

--- The greatest difference of two arrays' entries.
function robomosp.max_difference(a, b)
  local difference = array(a) - array(b)
  return math.max(difference:max(), -difference:min())
end

--- A number in another unit, as text: in_degrees(pi / 2) == "90 deg".
function robomosp.in_degrees(angle)
  return string.format("%.6g deg", math.deg(angle))
end

--- Runs fn as one undo step and takes its edits back afterwards; returns what fn returned.
function robomosp.try_out(fn)
  local results
  local ok, reason = pcall(ioci.transaction, "try out", function()
    results = table.pack(fn())
    error(robomosp)
  end)
  if not ok and not results then
    error(reason, 0)
  end
  return table.unpack(results, 1, results.n)
end

return robomosp
