// SPDX-License-Identifier: GPL-3.0-or-later
// Snapping: the corner, edge, centre or face of a picture nearest to the mouse (layer: GUI).
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>

#include <QPointF>
#include <QPolygonF>

#include "viewer/frame.h"
#include "viewer/gizmo/gizmo.h"
#include "viewer/gizmo/tool_settings.h"
#include "viewer/scene/scene_view.h"

namespace robomosp::viewer {

/// Something in the picture that a drag or a measurement holds to.
struct SnapTarget {
  enum class Kind : std::uint8_t { corner, edge, centre, face };
  Kind kind = Kind::corner;
  Vec3 point{};            ///< in the world [m]
  std::uint64_t item = 0;  ///< id
  std::string name;        ///< of the item
  QPolygonF line{};        ///< the edge in the picture [px]
  Vec3 on{};               ///< of a circle: a point on it [m]
};
[[nodiscard]] const char* word_of(SnapTarget::Kind kind);

/// Looks at the edges of items under the mouse, for at most two milliseconds. [GUI thread]
class Snapper {
 public:
  using PickFace = std::function<std::optional<Pick>(QPointF)>;
  /// Items for which `is_left_out` is true are not targets. `pick` gives the face under the mouse.
  [[nodiscard]] std::optional<SnapTarget> find(
      const Frame& frame, const ScreenCamera& camera, QPointF at, double reach_px,
      const ToolSettings& kinds, const std::function<bool(std::uint64_t)>& is_left_out,
      const PickFace& pick);

 private:
  struct Box {
    std::weak_ptr<const Mesh> mesh;
    Vec3 centre{};
    double radius = 0;
  };
  const Box& box_of(const std::shared_ptr<const Mesh>& mesh);
  std::map<const Mesh*, Box> boxes_;
};

}  // namespace robomosp::viewer
