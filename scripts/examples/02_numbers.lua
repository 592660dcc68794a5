-- SPDX-License-Identifier: Apache-2.0
-- Numbers with units, arrays and poses.
local target = pose(0.557, 0, mm(374), rpy(pi, 0, pi))
print(target)
assert(#target == 4 and target[1][4] == 0.557 and target(3, 4) == 0.374)
local same = target * target:inverse()
for i = 1, 4 do
  for j = 1, 4 do
    assert(math.abs(same(i, j) - (i == j and 1 or 0)) < 1e-15)
  end
end
local q = deg { 0, 45, 90 }
print(q, q:unit(), q:norm())
