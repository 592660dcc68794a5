-- SPDX-License-Identifier: Apache-2.0
-- A controller and an integrator of one's own, in Lua: PID with the weight compensated, and Heun's
-- method. Both are checked against the compiled ones.
ioci.provide("robomosp.controller/1", "my_pid", {
  state = 2, -- integrals, kept from tick to tick
  params = {{name = "stiffness", type = "real", unit = "N m/rad", doc = "Gain.", default = 300}},
  torques = function(model, now, state, params)
    local tau = {}
    for j = 1, model.dof do
      local e = now.q_desired[j] - now.q[j]
      state[j] = state[j] + 200 * e * now.dt
      tau[j] = now.gravity[j] + params.stiffness * e - 40 * now.qd[j] + state[j]
    end
    return tau
  end,
})
ioci.provide("robomosp.integrator/1", "heun", function(rate, t, x, h)
  local function ahead(d, s)
    local out = {}
    for i = 1, #x do out[i] = x[i] + s * d[i] end
    return out
  end
  local a = rate(t, x)
  local b = rate(t + h, ahead(a, h))
  local mean = {}
  for i = 1, #x do mean[i] = (a[i] + b[i]) / 2 end
  return ahead(mean, h)
end)

local rods = robot "planar2rods"
local held = rods:simulate{ q = {0.1, -0.1}, reference = {0, 0}, controller = "my_pid", duration = 2 }
local off = held:values("tip_error")
assert(off[#off] < 2e-3, "the controller settles")

local function end_of(integrator)
  local q = rods:simulate{ q = {0, 0.5}, duration = 0.5, integrator = integrator, step = 5e-4 }:values("q1")
  return q[#q]
end
assert(math.abs(end_of("heun") - end_of("dormand_prince")) < 1e-5, "the integrator agrees")
print("my_pid settles to " .. off[#off] .. " m; heun and dormand_prince agree")
