// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/scene/lamps.h"

#include <algorithm>
#include <cmath>

#include "viewer/scene/linear.h"
#include "viewer/scene/osg_geometry.h"

namespace robomosp::viewer {
namespace {

// Irradiance of the renderer's own lamp over pi; one of a scene is white at the same brightness.
constexpr float kOwn = 0.86F;
constexpr std::array<float, 3> kOwnColour{1.02F * kOwn, 0.985F * kOwn, 0.93F * kOwn};
// Seen radius of a lamp [rad]; larger than the sun's, as a softbox in a studio.
constexpr double kLampRadius = 0.0264;
// Share of the studio's sky and floor beside lights of a scene, none of which is ambient.
constexpr float kSurroundings = 0.5F;

/// Beyond this everything that is lit is white, and far beyond it a float has no number.
constexpr double kBrightest = 1e6;

/// Of a light, 0 and more.
float strength(const render::Light& light) {
  return static_cast<float>(std::clamp(light.intensity, 0.0, kBrightest));
}

float brightness(const Lamp& l) { return std::max({l.colour[0], l.colour[1], l.colour[2]}); }

osg::Vec4f four(const Vec3& v, double w) {
  return {static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2]),
          static_cast<float>(w)};
}

osg::Uniform& array_of(osg::StateSet* state, const char* name, osg::Uniform::Type type) {
  osg::Uniform* u = state->getUniform(name);
  if (!u) {
    u = new osg::Uniform(type, name, static_cast<int>(kMostLamps));
    state->addUniform(u);
  }
  return *u;
}

}  // namespace

Lamp own_lamp(const Vec3& towards) {
  Lamp l;
  l.place = towards;
  l.colour = kOwnColour;
  return l;
}

std::vector<Lamp> lamps_of(const std::vector<render::Light>& lights) {
  std::vector<Lamp> out;
  for (const render::Light& light : lights) {
    if (light.kind == render::Light::Kind::ambient || !is_finite(light.pose) ||
        !std::isfinite(light.intensity) || !(light.intensity > 0))
      continue;
    Lamp l;
    const Vec3 z = rotate(light.pose, {0, 0, 1});
    l.is_parallel = light.kind == render::Light::Kind::sun;
    l.place = l.is_parallel ? z : light.pose.p;
    l.axis = -1.0 * z;
    if (light.kind == render::Light::Kind::spot && std::isfinite(light.angle))
      l.half_angle = std::clamp(light.angle, 0.001, 3.14159);
    const osg::Vec4f c = linear_of(light.colour);
    for (std::size_t i = 0; i < 3; ++i)
      l.colour[i] = kOwn * strength(light) * c[static_cast<int>(i)];
    out.push_back(l);
  }
  std::stable_sort(out.begin(), out.end(),
                   [](const Lamp& a, const Lamp& b) { return brightness(a) > brightness(b); });
  return out;
}

osg::Vec3f surroundings_of(const std::vector<render::Light>& lights) {
  osg::Vec3f sum;
  bool has_ambient = false;
  for (const render::Light& light : lights) {
    if (light.kind != render::Light::Kind::ambient || !std::isfinite(light.intensity)) continue;
    has_ambient = true;
    const osg::Vec4f c = linear_of(light.colour);
    sum += osg::Vec3f(c[0], c[1], c[2]) * strength(light);
  }
  if (has_ambient) return sum;
  const float share = lamps_of(lights).empty() ? 1 : kSurroundings;
  return {share, share, share};
}

Lamp moved(const Lamp& lamp, const Vec3& middle, const std::array<double, 2>& disk) {
  const Vec3 way = lamp.is_parallel ? lamp.place : lamp.place - middle;
  const double distance = norm(way);
  if (!(distance > 0)) return lamp;
  const Vec3 back = (1 / distance) * way;
  Vec3 side = cross(back, std::abs(back[2]) < 0.99 ? Vec3{0, 0, 1} : Vec3{0, 1, 0});
  side = (1 / norm(side)) * side;
  const Vec3 across = cross(side, back);
  const double r = kLampRadius * distance;
  Lamp out = lamp;
  out.place = lamp.place + (r * disk[0]) * side + (r * disk[1]) * across;
  if (lamp.is_parallel) out.place = (1 / norm(out.place)) * out.place;
  return out;
}

void set_lamps(osg::StateSet* state, std::span<const Lamp> lamps, const osg::Vec3f& surroundings) {
  const auto count = std::min(lamps.size(), kMostLamps);
  osg::Uniform& place = array_of(state, "lamp_place", osg::Uniform::FLOAT_VEC4);
  osg::Uniform& axis = array_of(state, "lamp_axis", osg::Uniform::FLOAT_VEC4);
  osg::Uniform& colour = array_of(state, "lamp_colour", osg::Uniform::FLOAT_VEC3);
  for (std::size_t i = 0; i < count; ++i) {
    const Lamp& l = lamps[i];
    const auto k = static_cast<unsigned>(i);
    place.setElement(k, four(l.place, l.is_parallel ? 0 : 1));
    axis.setElement(k, four(l.axis, l.half_angle < 0 ? -2 : std::cos(l.half_angle)));
    colour.setElement(k, osg::Vec3f(l.colour[0], l.colour[1], l.colour[2]));
  }
  set_uniform(state, "lamp_count", static_cast<int>(count));
  set_uniform(state, "surroundings", surroundings);
}

}  // namespace robomosp::viewer
