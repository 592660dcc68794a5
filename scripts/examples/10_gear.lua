-- A primitive of a plugin's own: the involute gear of the SDK's example, as one node among others.
--   robomosp --plugin-path <its build folder> run 10_gear.lua
local offered = false
for _, p in ipairs(provider.list("robomosp.primitive/1")) do offered = offered or p.name == "involute_gear" end
if not offered then
  print("The plugin involute_gear is not loaded; see share/robomosp/examples/involute_gear.")
  return
end

local teeth, m, width = 24, 0.002, 0.012
local wheel = solid.create{
  name = "wheel", material = material "steel_c45",
  root = { kind = "difference", children = {
    { kind = "custom", name = "gear",
      primitive = { name = "involute_gear", params = { teeth = teeth, module = m, width = width, bore = "10 mm" } } },
    { kind = "circular_pattern", name = "holes", count = 5, children = {
      { kind = "cylinder", name = "hole", radius = "4 mm", height = "20 mm", position = {"13 mm", 0, "-4 mm"} } } } } } }

local b = wheel:mass()
print(string.format("%d teeth: %.1f g, %.4f cm^3", teeth, 1000 * b.mass, 1e6 * b.volume))

-- The tooth is as thick as the gap at the pitch circle, so the area is about the pitch circle's; it lies between
-- those of the root and the tip circle.
local holes = pi * (0.005^2 + 5 * 0.004^2)
local function disc(radius) return (pi * radius^2 - holes) * width end
assert(b.volume > disc(m * teeth / 2 - 1.25 * m) and b.volume < disc(m * teeth / 2 + m))
assert(math.abs(b.volume / disc(m * teeth / 2) - 1) < 0.03)
