// SPDX-License-Identifier: Apache-2.0
#include "scene/places.h"

#include "model/placement.h"
#include "scene/ids.h"

namespace robomosp::scene {

render::Triad triad_of(const model::PlacedFrame& f, double length) {
  return {item_id(f.name, kPlaceBody, 0), model::pose(f.placement), length, f.name, false};
}

render::Light lamp_of(const model::PlacedLight& l) {
  render::Light out;
  switch (l.kind) {
    case model::LightKind::sun: out.kind = render::Light::Kind::sun; break;
    case model::LightKind::point: out.kind = render::Light::Kind::point; break;
    case model::LightKind::spot: out.kind = render::Light::Kind::spot; break;
    case model::LightKind::ambient: out.kind = render::Light::Kind::ambient; break;
  }
  out.pose = model::pose(l.placement);
  out.colour = l.colour;
  out.intensity = l.intensity;
  out.angle = l.angle;
  return out;
}

render::Triad triad_of(const model::PlacedLight& l, double length) {
  return {item_id(l.name, kPlaceBody, 1), model::pose(l.placement), length, l.name, false};
}

}  // namespace robomosp::scene
