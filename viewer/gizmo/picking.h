// SPDX-License-Identifier: GPL-3.0-or-later
// Picking: what a click or a box in a picture selects, and which elements a view hides (layer:
// GUI).
#pragma once

#include <cstdint>
#include <set>
#include <string_view>
#include <vector>

#include <QRectF>

#include "scene/frame.h"
#include "scene/visibility.h"
#include "viewer/desktop/desk.h"
#include "viewer/frame.h"
#include "viewer/gizmo/gizmo.h"

namespace robomosp::viewer {

/// A record as commands take it.
[[nodiscard]] Handle record_handle(AnyId id);

/// What a click on an element selects: its member, or the link, node or part within it if the
/// member, or something within it, is selected already.
[[nodiscard]] Selection clicked(const scene::Frame& frame, const scene::ElementRef& element,
                                const Selection& now);

/// Text for what a click selects: "object table", "robot arm > elbow" with the element that the
/// mouse is over, "link elbow of arm".
[[nodiscard]] std::string words_of(const scene::Frame& frame, const scene::ElementRef& element,
                                   const Selected& what);

/// What a box in the picture [px] selects, members once each: those inside it, or that it touches.
[[nodiscard]] Selection boxed(const scene::Frame& frame, const viewer::Frame& drawn,
                              const ScreenCamera& camera, const QRectF& box, bool is_touching,
                              const std::set<std::uint64_t>& hidden);

/// Members that a view does not draw.
class HiddenMembers {
 public:
  void hide(const Selection& what, const scene::Frame& frame);
  /// Hides all members but these.
  void isolate(const Selection& what, const scene::Frame& frame);
  void show_all() { names_.clear(); }
  [[nodiscard]] std::size_t count() const { return names_.size(); }
  [[nodiscard]] bool contains(const std::string& member) const { return names_.contains(member); }
  void toggle(const std::string& member);
  /// Members that are hidden, "objects.table".
  [[nodiscard]] const std::set<std::string>& names() const { return names_; }
  /// Takes what is hidden out of a scene, and forgets members that are gone. The ids of its items.
  std::set<std::uint64_t> apply(const scene::Frame& frame, render::Scene& scene);

 private:
  std::set<std::string> names_;
};

}  // namespace robomosp::viewer
