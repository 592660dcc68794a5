// SPDX-License-Identifier: Apache-2.0
// FlatScene: a frame as the lists that renderers take, brought from frame to frame by what differs
// (layer: application, scene).
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <robomosp/sdk/render.h>

#include "scene/frame.h"

namespace robomosp::scene {

/// Equal to to_scene() of the frame, element by element, and then what is shown beside it. Showing
/// another frame writes the elements of the members that differ; only if members came, went or have
/// other numbers of elements, all is written again. [one thread at a time]
class FlatScene {
 public:
  using Beside = std::shared_ptr<const render::Scene>;
  /// Shows a frame, and behind it the items and legends of `beside`, if not null.
  void show(const FramePtr& frame, const Beside& beside = nullptr);
  /// Shows this instead; the next show() writes all elements.
  void show(render::Scene other);
  [[nodiscard]] const render::Scene& scene() const { return scene_; }
  /// left_out() of the frame; empty if show() got a finished scene.
  [[nodiscard]] const std::vector<std::string>& left_out() const { return left_out_; }
  /// Null if it shows none.
  [[nodiscard]] const FramePtr& frame() const { return frame_; }

 private:
  /// Numbers of elements by ElementKind, or where they begin in the lists.
  using Counts = std::array<std::uint32_t, 7>;
  /// Where the elements of each member begin, members in drawing order.
  struct Layout {
    std::vector<Counts> begin;
    Counts total{};
  };
  [[nodiscard]] bool change_to(const Frame& frame);
  void show_whole(const Frame& frame);
  void put(const Member& member, Counts at);
  FramePtr frame_;
  Beside beside_;
  Layout layout_;
  render::Scene scene_;
  std::vector<std::string> left_out_;
};

}  // namespace robomosp::scene
