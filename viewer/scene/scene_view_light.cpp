// SPDX-License-Identifier: GPL-3.0-or-later
// Lamp, sky and lights of the scene with their shadow maps.
#include "viewer/scene/scene_view_impl.h"

namespace robomosp::viewer {
namespace {

/// Texels of the shadow maps of lamp and sky for a picture of so many pixels: a map need not be
/// finer than what it is seen in, and the light of the sky is smooth.
std::array<int, 2> map_sizes(int pixels) {
  const auto texels = [&](double share, int least, int most) {
    return std::clamp(16 * static_cast<int>(std::ceil(share * pixels / 16)), least, most);
  };
  return {texels(1.0, 128, 2048), texels(0.4, 96, 512)};
}

}  // namespace

/// Corners of the part of the view in which something with a shadow on it can be.
std::vector<Vec3> SceneView::Impl::points_seen(const std::vector<Vec3>& casters_at) const {
  const Vec3 back = camera.backward();
  const double d = camera.distance();
  double far = 0;
  for (const Vec3& p : casters_at) far = std::max(far, dot(camera.eye() - p, back));
  // Shadows on the floor behind the last body, as long as a low lamp makes them.
  far = std::min(far + 4 * radius, 12 * d);
  const double near = camera.perspective() ? 0 : std::min(d - 4 * radius, 0.0);
  std::vector<Vec3> points;
  for (const double depth : {near, far})
    for (const double x : {-1.0, 1.0})
      for (const double y : {-1.0, 1.0}) {
        const double half = camera.tan_half_height() * (camera.perspective() ? depth : d);
        points.push_back(camera.eye() - depth * back +
                         (x * half * camera.aspect()) * camera.right() + (y * half) * camera.up());
      }
  return points;
}

/// The light of the frame whose turn it is in a pass, as much brighter as there are passes without
/// it, so that the mean has all with their shadows.
Lamp SceneView::Impl::light_of(const Pass& pass) const {
  const auto n = static_cast<int>(lights.size());
  const int k = pass.number % n, count = std::max(pass.count, n);
  Lamp one = lights[static_cast<std::size_t>(k)];
  const int turns = count / n + (k < count % n ? 1 : 0);
  for (float& c : one.colour) c *= static_cast<float>(count) / static_cast<float>(turns);
  return one;
}

/// The lights of the frame that a pass is lit by, the one with a shadow first: a still has one a
/// pass, a window all at once.
std::vector<Lamp> SceneView::Impl::lights_of(const Pass& pass) const {
  if (!is_still) return lights;
  return {moved(light_of(pass), camera.target(), pass.samples[0].lamp)};
}

void SceneView::Impl::aim_lights(const Pass& pass) {
  if (pass.keeps_shadows) {
    for (ShadowMap* map : {&lamp, &sky, &lamp_2, &sky_2}) map->set_mask(0);
    return;
  }
  if (is_drawing(look.style)) {
    // Frames and marks are lit from the eye; nothing casts shadows.
    osg::StateSet* state = root->getStateSet();
    for (const char* map : kMapUniforms) set_uniform(state, map, nowhere());
    for (const char* name : {"sky_direction", "sky_direction_2"})
      set_uniform(state, name, vec_of(camera.backward()));
    const Lamp lamp_at_eye = own_lamp(camera.backward());
    set_lamps(state, {&lamp_at_eye, 1});
    set_lamps(frames->getOrCreateStateSet(), {&lamp_at_eye, 1});
    set_uniform(state, "lamp_texel", osg::Vec2f(0, 0));
    for (const char* name : {"sky_texel", "sky_texel_2"})
      set_uniform(state, name, osg::Vec2f(0, 0));
    for (ShadowMap* map : {&lamp, &sky, &lamp_2, &sky_2}) map->set_mask(0);
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
  // Glass of opacity a casts its shadow in a share a of the samples: on average one of depth a.
  for (auto& [id, node] : items) {
    if (!node.glass_caster) continue;
    const auto opacity = static_cast<double>(node.item.appearance.colour.a);
    node.glass_caster->setNodeMask((opacity > pass.samples[0].glass_shadow ? kGlassCaster : 0U) |
                                   (opacity > pass.samples[1].glass_shadow ? kGlassCaster2 : 0U));
  }
  osg::StateSet* s = root->getStateSet();
  const Lamp own = moved(own_lamp(unit(kLamp)), {}, pass.samples[0].lamp);
  std::vector<Lamp> shining{own};
  if (!lights.empty()) shining = lights_of(pass);
  set_lamps(s, shining, surroundings);
  // The floor is its own colour under the lamp of the renderer.
  set_uniform(s, "floor_lamp", static_cast<float>(lights.empty() ? own.place[2] : unit(kLamp)[2]));
  // Frames keep their colours: no light of the scene tints them.
  osg::StateSet* f = frames->getOrCreateStateSet();
  set_lamps(f, {&own, 1});
  for (const char* map : {"lamp_map", "lamp_map_2"}) {
    if (lights.empty()) f->removeUniform(map);
    else set_uniform(f, map, nowhere());
  }
  if (is_still) {
    const auto [lamp_size, sky_size] = map_sizes(std::max(camera.width(), camera.height()));
    for (ShadowMap* map : {&lamp, &lamp_2}) map->set_size(lamp_size);
    for (ShadowMap* map : {&sky, &sky_2}) map->set_size(sky_size);
  }
  for (ShadowMap* map : {&lamp, &sky, &lamp_2, &sky_2}) map->set_shift(pass.map_x, pass.map_y);
  const std::vector<Vec3> seen = pass.all_shadows ? std::vector<Vec3>() : points_seen(all);
  const auto aimed = [&](ShadowMap& map, const Lamp& l) {
    return l.is_parallel ? map.aim(l.place, all, seen, !is_still)
                         : map.aim_from(l.place, l.axis, l.half_angle, all);
  };
  lamp.set_mask(kCaster | kGlassCaster);
  const ShadowLookup l = aimed(lamp, shining[0]);
  if (!is_still) {
    // While only the camera moves, the map of the last picture holds.
    if (!has_new_casters && lamp_drawn && *lamp_drawn == l.map_T_world) lamp.set_mask(0);
    lamp_drawn = l.map_T_world;
    has_new_casters = false;
  }
  set_uniform(s, "lamp_map", osg::Matrixf(l.map_T_world));
  set_uniform(s, "lamp_texel", l.texel);
  if (has_two_samples) {
    lamp_2.set_mask(kCaster | kGlassCaster2);
    const Lamp other = lights.empty()
                           ? moved(own_lamp(unit(kLamp)), {}, pass.samples[1].lamp)
                           : moved(light_of(pass), camera.target(), pass.samples[1].lamp);
    set_uniform(s, "lamp_map_2", osg::Matrixf(aimed(lamp_2, other).map_T_world));
  }
  aim_sky(sky, pass.samples[0], kCaster | kGlassCaster, "", all, seen);
  if (has_two_samples) aim_sky(sky_2, pass.samples[1], kCaster | kGlassCaster2, "_2", all, seen);
}

void SceneView::Impl::aim_sky(ShadowMap& map, const Pass::Sample& sample, unsigned mask,
                              const std::string& suffix, std::span<const Vec3> casters_at,
                              std::span<const Vec3> seen) {
  const Vec3 towards = sample.sky.value_or(Vec3{0, 0, 1});
  map.set_mask(sample.sky ? mask : 0);
  const ShadowLookup l = map.aim(towards, casters_at, seen);
  osg::StateSet* s = root->getStateSet();
  set_uniform(s, ("sky_direction" + suffix).c_str(), vec_of(towards));
  set_uniform(s, ("sky_map" + suffix).c_str(), osg::Matrixf(l.map_T_world));
  set_uniform(s, ("sky_texel" + suffix).c_str(), l.texel);
}

}  // namespace robomosp::viewer
