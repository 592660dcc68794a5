-- SPDX-License-Identifier: Apache-2.0
-- Inverse dynamics by parts, and forward dynamics as its inverse.
local puma = robot "puma560"
local q, qd, tau = { 0.1, 0.2, 0.3, 0.4, 0.5, 0.6 }, { 1, 0.5, -0.5, 0.2, 0.1, 0.3 }, nil
local qdd = { 0.4, -0.3, 0.2, 0.1, 0.5, -0.2 }
for _, term in ipairs { "gravity", "inertial", "velocity", "friction" } do
  local part = puma:inverse_dynamics { q = q, qd = qd, qdd = qdd, terms = { term } }
  print(string.format("%-9s", term), part)
  tau = tau and tau + part or part
end
local whole = puma:inverse_dynamics { q = q, qd = qd, qdd = qdd }
assert((whole - tau):norm() < 1e-9)

local back = puma:forward_dynamics { q = q, qd = qd, tau = whole }
print("forward  ", back)
for i = 1, 6 do assert(math.abs(back[i] - qdd[i]) < 1e-9) end
