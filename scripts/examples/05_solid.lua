-- SPDX-License-Identifier: Apache-2.0
-- A flange with a bolt circle: build it, weigh it, change it, take the change back.
local bolts = {}
for i = 0, 7 do
  local angle = i * math.pi / 4
  bolts[#bolts + 1] = { kind = "cylinder", name = "bolt_" .. i, radius = "3.3 mm", height = "14 mm",
    position = { 0.04 * math.cos(angle), 0.04 * math.sin(angle), -0.001 } }
end
local flange = solid.create {
  name = "flange", material = material "aluminium",
  root = { kind = "difference", name = "body", children = {
    { kind = "cylinder", name = "disc", radius = "50 mm", height = "12 mm" },
    { kind = "union", name = "bolts", children = bolts },
    { kind = "cylinder", name = "bore", radius = "15 mm", height = "14 mm", position = { 0, 0, -0.001 } } } } }

local function mass() return flange:mass().mass end
local by_hand = 2700 * math.pi * 0.012 * (0.05 ^ 2 - 8 * 0.0033 ^ 2 - 0.015 ^ 2)
print(string.format("%.9f kg, by hand %.9f kg", mass(), by_hand))
assert(math.abs(mass() - by_hand) < 1e-9)

flange:set { path = "bore.radius", value = "20 mm" }
print(string.format("%.9f kg with a bore of 20 mm", mass()))
document.undo()
assert(math.abs(mass() - by_hand) < 1e-9)
