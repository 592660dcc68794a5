// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <map>
#include <string_view>
#include <tuple>
#include <unordered_map>
#include <utility>

#include "scene/frame.h"
#include "scene/same.h"

namespace robomosp::scene {
namespace {

template <class T>
bool stands_still(const T& a, const T& b) {
  if constexpr (requires { a.pose; }) return same(a.pose, b.pose);
  else return true;
}

template <class See>
void for_each_list_of_two(const Shape& a, const Shape& b, See&& see) {
  see(ElementKind::item, a.items, b.items);
  see(ElementKind::line, a.lines, b.lines);
  see(ElementKind::triad, a.triads, b.triads);
  see(ElementKind::mark, a.marks, b.marks);
  see(ElementKind::label, a.labels, b.labels);
  see(ElementKind::legend, a.legends, b.legends);
  see(ElementKind::light, a.lights, b.lights);
}

/// Compares members that have one name.
class Comparison {
 public:
  explicit Comparison(Changes& out) : out_(out) {}

  /// Either may be null.
  void members(const MemberPtr& before, const MemberPtr& after) {
    static const auto kNothing = std::make_shared<const Shape>();
    const bool all_rest =
        before && after && same(before->bodies, after->bodies) &&
        before->touching == after->touching;
    for (std::size_t layer = 0; layer < kShapeLayers; ++layer) {
      const ShapePtr& a = before && before->shapes[layer] ? before->shapes[layer] : kNothing;
      const ShapePtr& b = after && after->shapes[layer] ? after->shapes[layer] : kNothing;
      if (a == b && (all_rest || a == kNothing)) continue;
      for_each_list_of_two(*a, *b, [&](ElementKind kind, const auto& was, const auto& is) {
        if (was.empty() && is.empty()) return;
        if (a == b) moved_only(kind, layer, before, after, is);
        else if (is_same_order(was, is)) pairs(kind, layer, before, after, was, is);
        else lists(kind, layer, before, after, was, is);
      });
    }
  }

 private:
  static bool same(const std::vector<Pose>& a, const std::vector<Pose>& b) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                      [](const Pose& x, const Pose& y) { return scene::same(x, y); });
  }
  static ElementRef ref(ElementKind kind, std::size_t layer, std::size_t i, const MemberPtr& of) {
    return {kind, static_cast<ShapeLayer>(layer), static_cast<std::uint32_t>(i), of};
  }
  static bool rests(const MemberPtr& before, std::int32_t was, const MemberPtr& after,
                    std::int32_t is) {
    return (was < 0 && is < 0) || scene::same(before->world_T(was), after->world_T(is));
  }
  /// Items of bodies that touch something are drawn red.
  static bool looks_same(ElementKind kind, const MemberPtr& before, std::int32_t was,
                         const MemberPtr& after, std::int32_t is) {
    return kind != ElementKind::item || before->touches(was) == after->touches(is);
  }
  /// The same elements in the same order, as most layers have that were made again.
  template <class List>
  static bool is_same_order(const List& was, const List& is) {
    return std::equal(was.begin(), was.end(), is.begin(), is.end(),
                      [](const auto& a, const auto& b) {
                        return a.group == b.group && a.number == b.number;
                      });
  }
  template <class List>
  void moved_only(ElementKind kind, std::size_t layer, const MemberPtr& before,
                  const MemberPtr& after, const List& list) {
    for (std::size_t i = 0; i < list.size(); ++i)
      if (!looks_same(kind, before, list[i].body, after, list[i].body))
        out_.changed.push_back(ref(kind, layer, i, after));
      else if (!rests(before, list[i].body, after, list[i].body))
        out_.moved.push_back(ref(kind, layer, i, after));
  }
  template <class List>
  void pair(ElementKind kind, std::size_t layer, const MemberPtr& before, const MemberPtr& after,
            const List& was, std::size_t at, const List& is, std::size_t i) {
    const auto& e = was[at];
    if (!scene::same(e.what, is[i].what) || !looks_same(kind, before, e.body, after, is[i].body)) {
      out_.changed.push_back(ref(kind, layer, i, after));
    } else if (!stands_still(e.what, is[i].what) || !rests(before, e.body, after, is[i].body)) {
      out_.moved.push_back(ref(kind, layer, i, after));
    }
  }
  template <class List>
  void pairs(ElementKind kind, std::size_t layer, const MemberPtr& before, const MemberPtr& after,
             const List& was, const List& is) {
    for (std::size_t i = 0; i < is.size(); ++i) pair(kind, layer, before, after, was, i, is, i);
  }
  template <class List>
  void lists(ElementKind kind, std::size_t layer, const MemberPtr& before, const MemberPtr& after,
             const List& was, const List& is) {
    if (was.empty() || is.empty()) {  // a layer was turned on or off
      for (std::size_t i = 0; i < is.size(); ++i) out_.added.push_back(ref(kind, layer, i, after));
      for (std::size_t i = 0; i < was.size(); ++i)
        out_.removed.push_back(ref(kind, layer, i, before));
      return;
    }
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::size_t> old;
    for (std::size_t i = 0; i < was.size(); ++i) old[{was[i].group, was[i].number}] = i;
    for (std::size_t i = 0; i < is.size(); ++i) {
      const auto at = old.find({is[i].group, is[i].number});
      if (at == old.end()) {
        out_.added.push_back(ref(kind, layer, i, after));
        continue;
      }
      pair(kind, layer, before, after, was, at->second, is, i);
      old.erase(at);
    }
    for (const auto& [key, i] : old) out_.removed.push_back(ref(kind, layer, i, before));
  }
  Changes& out_;
};

void compare(Comparison& comparison, const MemberList& before, const MemberList& after) {
  std::vector<MemberPtr> gone, come;  // where the lists differ
  const std::size_t most = std::max(before.size(), after.size());
  for (std::size_t i = 0; i < most; ++i) {
    if (before.shares_block(after, i)) {
      i += MemberList::kBlock - 1 - i % MemberList::kBlock;
      continue;
    }
    const MemberPtr was = i < before.size() ? before[i] : nullptr;
    const MemberPtr is = i < after.size() ? after[i] : nullptr;
    if (was == is) continue;
    if (was && is && was->name == is->name) {
      comparison.members(was, is);
      continue;
    }
    if (was) gone.push_back(was);
    if (is) come.push_back(is);
  }
  std::unordered_map<std::string_view, const MemberPtr*> old;
  for (const MemberPtr& m : gone) old[m->name] = &m;
  for (const MemberPtr& m : come) {
    const auto at = old.find(m->name);
    const MemberPtr was = at == old.end() ? nullptr : *at->second;
    if (was) old.erase(at);
    if (was != m) comparison.members(was, m);
  }
  for (const MemberPtr& m : gone)
    if (old.contains(m->name)) comparison.members(m, nullptr);
}

}  // namespace

Changes changes_between(const Frame* from, const Frame& to) {
  static const Frame kEmpty;
  Changes out;
  out.from = from ? from->number : 0;
  out.to = to.number;
  const Frame& before = from ? *from : kEmpty;
  Comparison comparison(out);
  compare(comparison, before.bodies, to.bodies);
  compare(comparison, before.robots, to.robots);
  compare(comparison, before.frames, to.frames);
  compare(comparison, before.lights, to.lights);
  compare(comparison, before.trajectories, to.trajectories);
  compare(comparison, before.ghosts, to.ghosts);
  compare(comparison, before.clearances, to.clearances);
  return out;
}

}  // namespace robomosp::scene
