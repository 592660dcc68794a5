// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "scene/build.h"
#include "spatial/principal.h"

namespace robomosp::scene {

render::MassMark mass_mark(std::uint64_t id, const MassProperties& world_mass) {
  const spatial::Principal p = spatial::principal(world_mass.inertia);
  render::MassMark mark;
  mark.id = id;
  mark.pose = {p.axes, world_mass.com};
  for (std::size_t i = 0; i < 3; ++i)
    mark.gyration[i] = std::sqrt(std::max(p.moments[i], 0.0) / world_mass.mass);
  return mark;
}

}  // namespace robomosp::scene
