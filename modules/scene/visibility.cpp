// SPDX-License-Identifier: Apache-2.0
#include "scene/visibility.h"

#include <algorithm>
#include <cstddef>
#include <map>
#include <type_traits>
#include <utility>

#include "scene/placed_elements.h"

namespace robomosp::scene {
namespace {

/// The part behind the list of a path: "forearm" of "links.forearm".
std::string_view after_list(std::string_view path) {
  const auto dot = path.find('.');
  return dot == std::string_view::npos ? std::string_view() : path.substr(dot + 1);
}

/// Whether an item belongs to a part: it has its name, or is inside it.
bool is_of(std::string_view item, std::string_view part) {
  return item == part || (item.starts_with(part) && item[part.size()] == '.');
}

/// The list of a world that members of a kind are in; "" = of none.
std::string_view list_of_member(MemberKind kind) {
  switch (kind) {
    case MemberKind::body: return "objects";
    case MemberKind::robot: return "robots";
    case MemberKind::trajectory: return "trajectories";
    case MemberKind::frame: return "frames";
    case MemberKind::light: return "lights";
    case MemberKind::material:
    case MemberKind::ghost:
    case MemberKind::clearance: break;
  }
  return {};
}

}  // namespace

std::string member_path(const Member& m) {
  const std::string_view list = list_of_member(m.kind);
  return m.is_placed && !list.empty() ? std::string(list) + "." + m.name : std::string();
}

std::set<std::string> member_paths(const Frame& frame) {
  std::set<std::string> out;
  frame.for_each_member([&out](const MemberPtr& m) {
    if (std::string path = member_path(*m); !path.empty()) out.insert(std::move(path));
  });
  return out;
}

LeftOut leave_out(const Frame& frame, const std::set<std::string>& paths, render::Scene& scene) {
  LeftOut out;
  if (paths.empty()) return out;
  std::set<std::uint64_t> ids;
  std::map<std::pair<std::string, Vec3>, std::size_t> labels;  // they have no ids
  frame.for_each_member([&](const MemberPtr& m) {
    const std::string path = member_path(*m);
    if (path.empty() || !paths.contains(path)) return;
    out.members.insert(path);
    for_each_placed(*m, [&](std::size_t, const auto&, const auto& placed) {
      using T = std::decay_t<decltype(placed)>;
      if constexpr (std::is_same_v<T, render::Label>) ++labels[{placed.text, placed.place}];
      else if constexpr (requires { placed.id; }) ids.insert(placed.id);
      if constexpr (std::is_same_v<T, render::Item>) out.items.insert(placed.id);
    });
  });
  const auto is_left_out = [&](const auto& each) { return ids.contains(each.id); };
  std::erase_if(scene.items, is_left_out);
  std::erase_if(scene.lines, is_left_out);
  std::erase_if(scene.triads, is_left_out);
  std::erase_if(scene.marks, is_left_out);
  std::erase_if(scene.labels, [&](const render::Label& label) {
    const auto at = labels.find({label.text, label.place});
    if (at == labels.end() || at->second == 0) return false;
    --at->second;
    return true;
  });
  return out;
}

std::vector<std::uint64_t> items_of(const Frame& frame, AnyId record, std::string_view path) {
  std::vector<std::uint64_t> out;
  const std::string_view part = after_list(path);
  if (record == frame.what && path.empty() && frame.what.kind == Kind::world) return out;
  if (part.empty() && !path.empty()) return out;  // a list, or no path
  frame.for_each_member([&](const MemberPtr& member) {
    const bool is_member = record == frame.what && !path.empty() && member_path(*member) == path;
    const bool is_record =
        member->what == record && (!member->is_placed || member->kind == MemberKind::body ||
                                   member->kind == MemberKind::robot);
    if (!is_member && !is_record) return;
    const ShapePtr& shape = member->shape(ShapeLayer::bodies);
    if (!shape) return;
    for (std::size_t i = 0; i < shape->items.size(); ++i) {
      if (!is_member && !part.empty() && !is_of(shape->items[i].what.name, part)) continue;
      out.push_back(
          id_of({ElementKind::item, ShapeLayer::bodies, static_cast<std::uint32_t>(i), member}));
    }
  });
  std::sort(out.begin(), out.end());
  out.erase(std::unique(out.begin(), out.end()), out.end());
  return out;
}

}  // namespace robomosp::scene
