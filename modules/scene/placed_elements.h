// SPDX-License-Identifier: Apache-2.0
// Elements of members at their places in the world (layer: application, scene). Internal to
// modules/scene.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <type_traits>
#include <utility>

#include "scene/frame.h"
#include "scene/ids.h"
#include "spatial/pose.h"

namespace robomosp::scene {

template <class T>
[[nodiscard]] std::uint64_t id_in(const std::string& owner, const Element<T>& e) {
  return item_id(owner, e.group, e.number);
}

/// An item of a member with its id, name, place and colour. `owner` is that of the member.
[[nodiscard]] render::Item placed_item(const Member& m, const std::string& owner,
                                       const Element<render::Item>& e);

/// Calls see(layer, element, placed) for each element of a member in drawing order, where `placed`
/// is the element as renderers take it, such as a render::Line.
template <class See>
void for_each_placed(const Member& m, See&& see) {
  const std::string owner = m.owner();
  for (std::size_t layer = 0; layer < kShapeLayers; ++layer) {
    const ShapePtr& shape = m.shapes[layer];
    if (!shape) continue;
    for (const auto& e : shape->items) see(layer, e, placed_item(m, owner, e));
    for (const auto& e : shape->lines) {
      render::Line line = e.what;
      line.id = id_in(owner, e);
      const Pose world_T_body = m.world_T(e.body);
      for (Vec3& p : line.points) p = spatial::transform(world_T_body, p);
      see(layer, e, std::move(line));
    }
    for (const auto& e : shape->triads) {
      render::Triad triad = e.what;
      triad.id = id_in(owner, e);
      triad.pose = spatial::compose(m.world_T(e.body), triad.pose);
      see(layer, e, std::move(triad));
    }
    for (const auto& e : shape->marks) {
      render::MassMark mark = e.what;
      mark.id = id_in(owner, e);
      mark.pose = spatial::compose(m.world_T(e.body), mark.pose);
      see(layer, e, std::move(mark));
    }
    for (const auto& e : shape->labels) {
      render::Label label = e.what;
      label.place = spatial::transform(m.world_T(e.body), label.place);
      see(layer, e, std::move(label));
    }
    for (const auto& e : shape->legends) see(layer, e, render::Legend(e.what));
    for (const auto& e : shape->lights) {
      render::Light light = e.what;
      light.pose = spatial::compose(m.world_T(e.body), light.pose);
      see(layer, e, std::move(light));
    }
  }
}

/// The list of a scene that holds elements of the type of `T`.
template <class T, class Scene>
[[nodiscard]] auto& list_for(Scene& scene) {
  if constexpr (std::is_same_v<T, render::Item>) return scene.items;
  else if constexpr (std::is_same_v<T, render::Line>) return scene.lines;
  else if constexpr (std::is_same_v<T, render::Triad>) return scene.triads;
  else if constexpr (std::is_same_v<T, render::MassMark>) return scene.marks;
  else if constexpr (std::is_same_v<T, render::Label>) return scene.labels;
  else if constexpr (std::is_same_v<T, render::Legend>) return scene.legends;
  else return scene.lights;
}
template <class T>
inline constexpr ElementKind kKindOf = std::is_same_v<T, render::Item>       ? ElementKind::item
                                       : std::is_same_v<T, render::Line>     ? ElementKind::line
                                       : std::is_same_v<T, render::Triad>    ? ElementKind::triad
                                       : std::is_same_v<T, render::MassMark> ? ElementKind::mark
                                       : std::is_same_v<T, render::Label>    ? ElementKind::label
                                       : std::is_same_v<T, render::Legend>   ? ElementKind::legend
                                                                             : ElementKind::light;

}  // namespace robomosp::scene
