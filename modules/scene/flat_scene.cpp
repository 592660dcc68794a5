// SPDX-License-Identifier: Apache-2.0
#include "scene/flat_scene.h"

#include <algorithm>
#include <type_traits>
#include <utility>

#include "scene/placed_elements.h"

namespace robomosp::scene {
namespace {

std::size_t index_of(ElementKind kind) { return static_cast<std::size_t>(kind); }

std::array<std::uint32_t, 7> counts_of(const Member& m) {
  std::array<std::uint32_t, 7> out{};
  for (const ShapePtr& shape : m.shapes)
    if (shape)
      for_each_list(*shape, [&](ElementKind kind, const auto& list) {
        out[index_of(kind)] += static_cast<std::uint32_t>(list.size());
      });
  return out;
}

bool has_trouble(const Member& m) {
  return std::any_of(m.shapes.begin(), m.shapes.end(), [](const ShapePtr& shape) {
    return shape && (shape->failure || !shape->left_out.empty());
  });
}

/// As Frame::for_each_member() has them.
std::array<const MemberList*, 7> lists_of(const Frame& f) {
  return {&f.bodies, &f.robots, &f.frames, &f.lights, &f.trajectories, &f.ghosts, &f.clearances};
}

/// Calls see(number, before, after) for each member that is not the same object in both frames,
/// `number` in drawing order. False if the frames have other numbers of members.
template <class See>
bool for_each_other_member(const Frame& a, const Frame& b, See&& see) {
  const auto before = lists_of(a), after = lists_of(b);
  std::size_t first = 0;
  for (std::size_t l = 0; l < before.size(); ++l) {
    const MemberList &was = *before[l], &is = *after[l];
    if (was.size() != is.size()) return false;
    for (std::size_t i = 0; i < is.size(); ++i) {
      if (was.shares_block(is, i)) {
        i += MemberList::kBlock - 1 - i % MemberList::kBlock;
        continue;
      }
      if (was[i] != is[i] && !see(first + i, *was[i], *is[i])) return false;
    }
    first += is.size();
  }
  return true;
}

}  // namespace

void FlatScene::put(const Member& member, Counts at) {
  for_each_placed(member, [&](std::size_t, const auto&, auto placed) {
    using T = decltype(placed);
    list_for<T>(scene_)[at[index_of(kKindOf<T>)]++] = std::move(placed);
  });
}

bool FlatScene::change_to(const Frame& frame) {
  if (!frame_) return false;
  // Looked at first: a scene of which only a part was written would be neither of the two.
  std::vector<std::pair<std::size_t, const Member*>> others;
  bool has_other_troubles = frame_->troubles != frame.troubles;
  const bool is_same_layout = for_each_other_member(
      *frame_, frame, [&](std::size_t number, const Member& was, const Member& is) {
        if (counts_of(was) != counts_of(is)) return false;
        has_other_troubles = has_other_troubles ||
                             (was.shapes != is.shapes && (has_trouble(was) || has_trouble(is)));
        others.emplace_back(number, &is);
        return true;
      });
  if (!is_same_layout) return false;
  for (const auto& [number, member] : others) put(*member, layout_.begin[number]);
  if (has_other_troubles) left_out_ = scene::left_out(frame);
  return true;
}

void FlatScene::show_whole(const Frame& frame) {
  layout_ = {};
  frame.for_each_member([&](const MemberPtr& member) {
    layout_.begin.push_back(layout_.total);
    const Counts own = counts_of(*member);
    for (std::size_t k = 0; k < own.size(); ++k) layout_.total[k] += own[k];
  });
  scene_ = to_scene(frame);
  left_out_ = scene::left_out(frame);
  beside_ = nullptr;
}

void FlatScene::show(const FramePtr& frame, const Beside& beside) {
  if (frame != frame_) {
    if (!change_to(*frame)) show_whole(*frame);
    frame_ = frame;
  }
  if (beside == beside_) return;
  scene_.items.resize(layout_.total[index_of(ElementKind::item)]);
  scene_.legends.resize(layout_.total[index_of(ElementKind::legend)]);
  if (beside) {
    scene_.items.insert(scene_.items.end(), beside->items.begin(), beside->items.end());
    scene_.legends.insert(scene_.legends.end(), beside->legends.begin(), beside->legends.end());
  }
  beside_ = beside;
}

void FlatScene::show(render::Scene other) {
  scene_ = std::move(other);
  frame_ = nullptr;
  beside_ = nullptr;
  layout_ = {};
  left_out_.clear();
}

}  // namespace robomosp::scene
