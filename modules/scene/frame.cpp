// SPDX-License-Identifier: Apache-2.0
#include "scene/frame.h"

#include <set>
#include <string>
#include <unordered_set>
#include <utility>

#include "scene/ids.h"
#include "spatial/pose.h"

namespace robomosp::scene {
namespace {

/// Opacity of a robot where it is not.
constexpr float kGhost = 0.3F;
constexpr Colour kTouching{0.85F, 0.08F, 0.06F, 1.0F};

template <class T>
std::uint64_t id_in(const std::string& owner, const Element<T>& e) {
  return item_id(owner, e.group, e.number);
}

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

render::Item placed(const Member& m, const std::string& owner, const Element<render::Item>& e) {
  render::Item item = e.what;
  item.id = id_in(owner, e);
  item.name = name_in(m, e.what.name);
  item.pose = spatial::compose(m.world_T(e.body), e.what.pose);
  if (m.kind == MemberKind::ghost) item.appearance.colour.a *= kGhost;
  if (m.touches(e.body)) paint_touching(item.appearance);
  return item;
}

template <class T>
const Element<T>& element_at(const ElementRef& ref, const std::vector<Element<T>>& list) {
  return list[ref.index];
}

}  // namespace

std::uint64_t id_of(const ElementRef& ref) {
  std::uint64_t id = 0;
  const ShapePtr& shape = ref.member->shape(ref.layer);
  for_each_list(*shape, [&](ElementKind kind, const auto& list) {
    if (kind == ref.kind) id = id_in(ref.member->owner(), element_at(ref, list));
  });
  return id;
}

render::Item item_of(const ElementRef& ref) {
  return placed(*ref.member, ref.member->owner(), ref.member->shape(ref.layer)->items[ref.index]);
}

render::Scene to_scene(const Frame& frame, std::vector<std::size_t>* group_of) {
  render::Scene out;
  std::size_t groups = 0;
  frame.for_each_member([&](const MemberPtr& member) {
    const Member& m = *member;
    const std::string owner = m.owner();
    for (std::size_t layer = 0; layer < kShapeLayers; ++layer) {
      const ShapePtr& shape = m.shapes[layer];
      if (!shape) continue;
      // A body of a robot and a trajectory move as a whole, all else item by item.
      const bool moves_by_body = m.kind == MemberKind::robot || m.kind == MemberKind::trajectory;
      std::int32_t last = -2;
      for (const auto& e : shape->items) {
        out.items.push_back(placed(m, owner, e));
        if (!group_of) continue;
        if (!moves_by_body || layer != 0 || e.body != last) ++groups;
        last = e.body;
        group_of->push_back(groups - 1);
      }
      for (const auto& e : shape->lines) {
        render::Line line = e.what;
        line.id = id_in(owner, e);
        const Pose world_T_body = m.world_T(e.body);
        for (Vec3& p : line.points) p = spatial::transform(world_T_body, p);
        out.lines.push_back(std::move(line));
      }
      for (const auto& e : shape->triads) {
        // The hand of an exploded robot is not where the tool's frame is.
        if (group_of && e.group == kToolBody) continue;
        render::Triad triad = e.what;
        triad.id = id_in(owner, e);
        triad.pose = spatial::compose(m.world_T(e.body), triad.pose);
        out.triads.push_back(std::move(triad));
      }
      for (const auto& e : shape->marks) {
        render::MassMark mark = e.what;
        mark.id = id_in(owner, e);
        mark.pose = spatial::compose(m.world_T(e.body), mark.pose);
        out.marks.push_back(std::move(mark));
      }
      for (const auto& e : shape->labels) {
        render::Label label = e.what;
        label.place = spatial::transform(m.world_T(e.body), label.place);
        out.labels.push_back(std::move(label));
      }
      for (const auto& e : shape->legends) out.legends.push_back(e.what);
      for (const auto& e : shape->lights) {
        render::Light light = e.what;
        light.pose = spatial::compose(m.world_T(e.body), light.pose);
        out.lights.push_back(light);
      }
    }
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
