// SPDX-License-Identifier: GPL-3.0-or-later
// Lamp, sky and lights of the scene with their shadow maps.
#include "viewer/scene/scene_view_impl.h"

namespace robomosp::viewer {

/// The lights of the frame that a pass is lit by, the one with a shadow first. The passes of a
/// still take turns: each has one light, as much brighter as there are passes without it, so that
/// the mean has all with their shadows. A window has them all at once.
std::vector<Lamp> SceneView::Impl::lights_of(const Pass& pass) const {
  if (!is_still) return lights;
  const auto n = static_cast<int>(lights.size());
  const int k = pass.number % n, count = std::max(pass.count, n);
  Lamp one = moved(lights[static_cast<std::size_t>(k)], camera.target(), pass.lamp);
  const int turns = count / n + (k < count % n ? 1 : 0);
  for (float& c : one.colour) c *= static_cast<float>(count) / static_cast<float>(turns);
  return {one};
}

void SceneView::Impl::aim_lights(const Pass& pass) {
  if (is_drawing(look.style)) {
    // Frames and marks are lit from the eye; nothing casts shadows.
    osg::StateSet* state = root->getStateSet();
    for (const char* map : {"lamp_map", "sky_map"}) set_uniform(state, map, nowhere());
    set_uniform(state, "sky_direction", vec_of(camera.backward()));
    const Lamp lamp_at_eye = own_lamp(camera.backward());
    set_lamps(state, {&lamp_at_eye, 1}, 1);
    set_lamps(frames->getOrCreateStateSet(), {&lamp_at_eye, 1}, 1);
    set_uniform(state, "lamp_texel", osg::Vec2f(0, 0));
    set_uniform(state, "sky_texel", osg::Vec2f(0, 0));
    set_uniform(state, "pass_number", static_cast<float>(pass.number));
    lamp.set_mask(0);
    sky.set_mask(0);
    return;
  }
  std::vector<Vec3> opaque, all;
  for (const auto& [id, node] : items) {
    if (node.surface.triangles.empty()) continue;
    const bool is_glass = node.item.appearance.colour.a < kOpaque;
    for (const Vec3& p : corners(node.surface, node.item.pose)) {
      all.push_back(p);
      if (!is_glass) opaque.push_back(p);
    }
  }
  // Glass of opacity a casts its shadow in a share a of the passes: on average a shadow of depth a.
  for (auto& [id, node] : items) {
    if (!node.glass_front) continue;
    const bool casts = static_cast<double>(node.item.appearance.colour.a) > pass.glass_shadow;
    node.glass_front->setNodeMask(kVisible | (casts ? kGlassCaster : 0U));
  }
  const unsigned mask = kCaster | kGlassCaster;
  osg::StateSet* s = root->getStateSet();
  const Lamp own = moved(own_lamp(unit(kLamp)), {}, pass.lamp);
  std::vector<Lamp> shining{own};
  if (!lights.empty()) shining = lights_of(pass);
  const double share = lights.empty() ? 1 : kSurroundings;
  set_lamps(s, shining, share);
  // The floor is its own colour under the lamp of the renderer.
  set_uniform(s, "floor_lamp", static_cast<float>(lights.empty() ? own.place[2] : unit(kLamp)[2]));
  // Frames keep their colours: no light of the scene tints them.
  osg::StateSet* f = frames->getOrCreateStateSet();
  set_lamps(f, {&own, 1}, 1);
  if (lights.empty()) f->removeUniform("lamp_map");
  else set_uniform(f, "lamp_map", nowhere());
  lamp.set_mask(mask);
  const ShadowLookup l = shining[0].is_parallel ? lamp.aim(shining[0].place, all)
                                                : lamp.aim_from(shining[0].place, shining[0].axis,
                                                                shining[0].half_angle, all);
  set_uniform(s, "lamp_map", osg::Matrixf(l.map_T_world));
  set_uniform(s, "lamp_texel", l.texel);
  set_uniform(s, "pass_number", static_cast<float>(pass.number));
  const Vec3 zenith{0, 0, 1};
  sky.set_mask(pass.sky ? mask : 0);
  const ShadowLookup k = sky.aim(pass.sky.value_or(zenith), all);
  set_uniform(s, "sky_direction", vec_of(pass.sky.value_or(zenith)));
  set_uniform(s, "sky_map", osg::Matrixf(k.map_T_world));
  set_uniform(s, "sky_texel", k.texel);
}

}  // namespace robomosp::viewer
