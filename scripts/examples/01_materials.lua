-- SPDX-License-Identifier: Apache-2.0
-- Records, handles, undo: the first minute with the document.
local steel = material.create { name = "my steel", density = 7850 }
print(steel, steel.name, steel:describe().density)
assert(steel == material "my steel")

ioci.transaction("two at once", function()
  material.create { name = "first", density = 1000 }
  material.create { name = "second", density = 2000 }
end)
document.undo()
assert(not pcall(material.get, { name = "second" }))
assert(steel.exists)
