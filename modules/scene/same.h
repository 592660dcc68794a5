// SPDX-License-Identifier: Apache-2.0
// Whether two drawn elements are the same; poses of elements are compared apart, by the first of
// these (layer: application, scene).
#pragma once

#include <cstddef>
#include <optional>

#include <robomosp/sdk/render.h>
#include <robomosp/sdk/types.h>

namespace robomosp::scene {

[[nodiscard]] inline bool same(const Pose& a, const Pose& b) { return a.R == b.R && a.p == b.p; }
[[nodiscard]] inline bool same(const Colour& a, const Colour& b) {
  return a.r == b.r && a.g == b.g && a.b == b.b && a.a == b.a;
}
[[nodiscard]] inline bool same(const std::optional<Colour>& a, const std::optional<Colour>& b) {
  return a.has_value() == b.has_value() && (!a || same(*a, *b));
}
[[nodiscard]] inline bool same(const render::Appearance& a, const render::Appearance& b) {
  return same(a.colour, b.colour) && a.shininess == b.shininess && a.metalness == b.metalness &&
         same(a.ambient, b.ambient) && same(a.specular, b.specular) && same(a.emission, b.emission);
}
/// Equal but for the pose.
[[nodiscard]] inline bool same(const render::Item& a, const render::Item& b) {
  return a.mesh == b.mesh && a.name == b.name && same(a.appearance, b.appearance);
}
[[nodiscard]] inline bool same(const render::Line& a, const render::Line& b) {
  return a.points == b.points && same(a.colour, b.colour) && a.width == b.width;
}
[[nodiscard]] inline bool same(const render::Triad& a, const render::Triad& b) {
  return a.length == b.length && a.label == b.label && a.on_top == b.on_top;
}
[[nodiscard]] inline bool same(const render::MassMark& a, const render::MassMark& b) {
  return a.gyration == b.gyration && a.label == b.label;
}
[[nodiscard]] inline bool same(const render::Label& a, const render::Label& b) {
  return a.text == b.text && a.place == b.place;
}
[[nodiscard]] inline bool same(const render::Legend& a, const render::Legend& b) {
  if (a.title != b.title || a.colours.size() != b.colours.size() ||
      a.ticks.size() != b.ticks.size())
    return false;
  for (std::size_t i = 0; i < a.colours.size(); ++i)
    if (!same(a.colours[i], b.colours[i])) return false;
  for (std::size_t i = 0; i < a.ticks.size(); ++i)
    if (a.ticks[i].share != b.ticks[i].share || a.ticks[i].text != b.ticks[i].text) return false;
  return true;
}
[[nodiscard]] inline bool same(const render::Light& a, const render::Light& b) {
  return a.kind == b.kind && same(a.colour, b.colour) && a.intensity == b.intensity &&
         a.angle == b.angle;
}

}  // namespace robomosp::scene
