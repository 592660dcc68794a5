// SPDX-License-Identifier: Apache-2.0
#include "scene/frame.h"

#include <set>
#include <string>
#include <type_traits>
#include <unordered_set>
#include <utility>

#include "scene/placed_elements.h"

namespace robomosp::scene {
namespace {

/// Opacity of a robot where it is not.
constexpr float kGhost = 0.3F;
constexpr Colour kTouching{0.85F, 0.08F, 0.06F, 1.0F};

std::string name_in(const Member& m, const std::string& part) {
  switch (m.kind) {
    case MemberKind::robot: return m.name + " " + part;
    case MemberKind::ghost: return "ghost of " + m.name + " " + part;
    case MemberKind::trajectory: return m.name;
    default: return m.is_placed ? m.name : part;
  }
}

/// What touches something is red, as clear as it was.
void paint_touching(render::Appearance& a) {
  const float opacity = a.colour.a;
  a.colour = kTouching;
  a.colour.a = opacity;
  a.ambient.reset();
  a.specular.reset();
  a.metalness = 0;
}

template <class T>
const Element<T>& element_at(const ElementRef& ref, const std::vector<Element<T>>& list) {
  return list[ref.index];
}

}  // namespace

render::Item placed_item(const Member& m, const std::string& owner,
                         const Element<render::Item>& e) {
  render::Item item = e.what;
  item.id = id_in(owner, e);
  item.name = name_in(m, e.what.name);
  item.pose = spatial::compose(m.world_T(e.body), e.what.pose);
  if (m.kind == MemberKind::ghost) item.appearance.colour.a *= kGhost;
  if (m.touches(e.body)) paint_touching(item.appearance);
  return item;
}

std::uint64_t id_of(const ElementRef& ref) {
  std::uint64_t id = 0;
  const ShapePtr& shape = ref.member->shape(ref.layer);
  for_each_list(*shape, [&](ElementKind kind, const auto& list) {
    if (kind == ref.kind) id = id_in(ref.member->owner(), element_at(ref, list));
  });
  return id;
}

render::Item item_of(const ElementRef& ref) {
  return placed_item(*ref.member, ref.member->owner(),
                     ref.member->shape(ref.layer)->items[ref.index]);
}

render::Scene to_scene(const Frame& frame, std::vector<std::size_t>* group_of) {
  render::Scene out;
  std::size_t groups = 0;
  frame.for_each_member([&](const MemberPtr& member) {
    const Member& m = *member;
    // A body of a robot and a trajectory move as a whole, all else item by item.
    const bool moves_by_body = m.kind == MemberKind::robot || m.kind == MemberKind::trajectory;
    std::size_t last_layer = kShapeLayers;
    std::int32_t last = -2;
    for_each_placed(m, [&](std::size_t layer, const auto& e, auto placed) {
      using T = decltype(placed);
      if (std::exchange(last_layer, layer) != layer) last = -2;
      // The hand of an exploded robot is not where the tool's frame is.
      if (std::is_same_v<T, render::Triad> && group_of && e.group == kToolBody) return;
      list_for<T>(out).push_back(std::move(placed));
      if (!std::is_same_v<T, render::Item> || !group_of) return;
      if (!moves_by_body || layer != 0 || e.body != last) ++groups;
      last = e.body;
      group_of->push_back(groups - 1);
    });
  });
  return out;
}

std::vector<std::string> left_out(const Frame& frame) {
  std::vector<std::string> out;
  std::set<std::string> told;
  const auto tell = [&](const std::string& sentence) {
    if (told.insert(sentence).second) out.push_back(sentence);
  };
  for (const std::string& sentence : frame.troubles) tell(sentence);
  std::unordered_set<const Shape*> seen;  // members of one record share it
  frame.for_each_member([&](const MemberPtr& member) {
    for (const ShapePtr& shape : member->shapes) {
      if (!shape || !seen.insert(shape.get()).second) continue;
      if (shape->failure) tell(shape->failure->sentence());
      for (const std::string& sentence : shape->left_out) tell(sentence);
    }
  });
  return out;
}

}  // namespace robomosp::scene
