-- SPDX-License-Identifier: Apache-2.0
-- A gripper that follows one parameter of its cell: dimensions, masses and torques.
local cell = world.create { name = "cell", parameters = { bore = "20 mm" } }
solid.create {
  name = "bush", material = material "steel",
  parameters = { bore = "cell.bore", wall = { value = "bore/4 + 2 mm", description = "around the bore" } },
  root = { kind = "difference", name = "body", children = {
    { kind = "cylinder", name = "outer", radius = "bore/2 + wall", height = "30 mm" },
    { kind = "cylinder", name = "hole", radius = "bore/2", height = "40 mm", position = { 0, 0, "-wall" } } } } }
object.create { name = "gripper", parts = {
  { what = "bush", name = "left", position = { "-2 * cell.bore", 0, 0 } },
  { what = "bush", name = "right", position = { "2 * cell.bore", 0, 0 } } } }
local arm = robot.create { name = "arm", mass_source = "designed", parameters = { reach = "15 * cell.bore" },
  links = { { a = "reach", alpha = "90 deg" }, { a = "reach", parts = { { what = "gripper" } } } } }

local function show()
  local tau = arm:inverse_dynamics { q = { 0, 0.5 } }
  print(string.format("bore %s: wall %s, gripper %.4f kg, torque of joint 2 %.4f N m",
    cell:parameters().bore.text, solid("bush"):parameters().wall.text, object("gripper"):mass().mass, tau[2]))
  return tau[2]
end

local before = show()
cell:set_parameter("bore", "24 mm")
assert(show() > before)
document.undo()
assert(show() == before)
