-- One part in every style, as solid_*.png in the current folder. A folder and a quality may be given;
-- the pictures of the manual are made by
--   robomosp run scripts/demos/solid_pictures.lua docs/images normal
local folder, quality = arg and arg[1] or ".", arg and arg[2] or "draft"

material.create{name = "machined aluminium", density = 2700, colour = "#c3c8ce", shininess = 0.55,
                metalness = 0.25}
material.create{name = "bearing bronze", density = 8800, colour = "#b98a4e", shininess = 0.6,
                metalness = 0.6}

local holes = {}
for i = 0, 3 do
  local sx, sy = (i % 2 == 0) and 1 or -1, (i < 2) and 1 or -1
  holes[#holes + 1] = {kind = "cylinder", name = "screw_" .. i + 1, radius = 0.0055, height = 0.03,
                       position = {0.062 * sx, 0.035 * sy, -0.005}}
end

local bracket = solid.create{name = "bearing_bracket", material = "machined aluminium", root = {
  kind = "difference", children = {
    {kind = "union", name = "body", children = {
      {kind = "box", name = "foot", x = 0.16, y = 0.1, z = 0.018, fillet = 0.003},
      {kind = "cylinder", name = "column", radius = 0.032, height = 0.085},
      {kind = "box", name = "rib", x = 0.13, y = 0.014, z = 0.045},
      {kind = "cylinder", name = "boss", radius = 0.021, height = 0.078,
       position = {0, 0.039, 0.058}, rpy = {math.pi / 2, 0, 0}}}},
    {kind = "cylinder", name = "bore", radius = 0.02, height = 0.12, position = {0, 0, -0.01}},
    {kind = "cylinder", name = "cross_bore", radius = 0.011, height = 0.12,
     position = {0, 0.06, 0.058}, rpy = {math.pi / 2, 0, 0}},
    table.unpack(holes)}}}
local bush = solid.create{name = "bush", material = "bearing bronze", root = {
  kind = "difference", children = {
    {kind = "union", children = {
      {kind = "cylinder", radius = 0.02, height = 0.04},
      {kind = "cylinder", radius = 0.028, height = 0.006, position = {0, 0, 0.04}}}},
    {kind = "cylinder", radius = 0.014, height = 0.06, position = {0, 0, -0.005}}}}}
local bearing = object.create{name = "bearing", parts = {
  {name = "bracket", what = "bearing_bracket"},
  {name = "upper", what = "bush", position = {0, 0, 0.045}},
  {name = "lower", what = "bush", position = {0, 0, 0.04}, rpy = {math.pi, 0, 0}}}}

local function draw(what, name, options)
  options.file = folder .. "/solid_" .. name .. ".png"
  options.size = options.size or {400, 300}
  options.quality = quality
  what:render(options)
end

local can_draw, fault = pcall(draw, bracket, "smooth", {})
if not can_draw then
  print(fault)  -- such as: no renderer is installed
  return
end
for _, style in ipairs{"smooth", "flat", "wireframe", "hidden_line"} do
  draw(bracket, style, {style = style})
end
draw(bracket, "hidden_dashed", {style = "hidden_line", hidden = true, projection = "orthographic"})
draw(bracket, "front_top", {style = "hidden_line", hidden = true, projection = "orthographic",
                            view = "top"})
draw(bracket, "section", {section = "-y"})
draw(bracket, "section_drawing", {section = "-y", style = "hidden_line"})
draw(bracket, "com", {com = true})
draw(bracket, "frames", {frames = true})
draw(bearing, "exploded", {explode = 1.7})
draw(bearing, "assembly_section", {section = "-y"})
print("The pictures are in " .. folder .. ".")
