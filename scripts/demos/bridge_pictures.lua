-- SPDX-License-Identifier: Apache-2.0
-- What a controller measured minus what the model says, as on the page about bridges. The controller is of this
-- script's own: joints that give way under 3 kg of which the model knows nothing, noise of encoders, a clock that
-- begins elsewhere, reported in pieces as a bridge appends them. The plot goes to bridge_residual.png in the current
-- folder, or in one that is given.
local folder = arg and arg[1] or "."

local arm = robot "puma560"
local loaded = arm:duplicate "puma560_loaded"
loaded:set_payload{ mass = 3, com = {0, 0, 0.08} }

-- The motion that was commanded, which the model makes.
local function joints(t)
  return {0.6 * math.sin(1.1 * t), -0.9 + 0.5 * math.sin(0.8 * t), 0.4 * math.cos(1.3 * t), 0.3 * t, 0.5, 0}
end
local function made(title, times, of)
  local rows = {}
  for i, t in ipairs(times) do rows[i] = of(t, i) end
  return {{name = "time", unit = "s", values = times}, {name = "q", unit = "rad", values = rows}}, title
end
local times = {}
for i = 0, 800 do times[#times + 1] = 0.01 * i end
local columns, title = made("model", times, joints)
local model = recording.create{ title = title, robot = "puma560", columns = columns }

local seed = 1
local function noise()  -- -1 to 1, the same in every run
  seed = (seed * 16807) % 2147483647
  return 2 * seed / 2147483647 - 1
end
local stiffness, delay = {9000, 9000, 6000, 2000, 2000, 2000}, 0.137  -- [N m/rad], [s]
local function measure(clock)
  local q = joints(clock - delay)
  local with, without = loaded:gravity_torques{ q = q }, arm:gravity_torques{ q = q }
  for j = 1, 6 do q[j] = q[j] - (with[j] - without[j]) / stiffness[j] + 1e-4 * noise() end
  return q
end
local measured
for piece = 0, 29 do
  local clock = {}
  for i = 1, 25 do clock[i] = delay + 0.2 + 0.25 * piece + 0.01 * i end
  local rows = made("", clock, measure)
  if measured then measured:append{ columns = rows }
  else measured = recording.create{ title = "measured", robot = "puma560", columns = rows } end
end
assert(#measured:values "time" == 750)

local fit = measured:residual{ with = model, columns = "q", find_shift = 0.3 }
assert(math.abs(fit.shift + delay) < 0.002, fit.shift)
assert(fit.columns[2].rms > 10 * fit.columns[6].rms)  -- the shoulder carries the load, the last joint nothing
print(string.format("the controller's clock is %.1f ms late; joint 2 is off by up to %.2f mrad", -1000 * fit.shift,
  1000 * fit.columns[2].max))
local file = folder .. "/bridge_residual.png"
local drawn, fault = pcall(fit.recording.plot, fit.recording, { file = file, columns = {"q_residual1", "q_residual2", "q_residual3"},
  width = 760, title = "measured minus model: 3 kg that the model does not know" })
print(drawn and file or fault)
