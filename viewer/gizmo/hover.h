// SPDX-License-Identifier: GPL-3.0-or-later
// Hover: what is under the mouse at rest gets a thin line around it and its name beside the mouse
// (layer: GUI). Painted over the picture, which is not drawn again.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include <QColor>
#include <QImage>
#include <QObject>
#include <QPointF>
#include <QRect>
#include <QString>
#include <QTimer>

#include "viewer/desktop/desk.h"
#include "viewer/frame.h"
#include "viewer/window/display.h"

class QPainter;

namespace robomosp::viewer {

/// What a click would select.
struct Hovered {
  Selection what{};                    ///< empty = nothing
  QString name{};                      ///< "object table"
  std::vector<std::uint64_t> items{};  ///< that are outlined
};

/// A line around items of a picture, transparent elsewhere.
struct ItemOutline {
  QImage image;
  QPointF at;  ///< its upper left corner in the widget [device-independent px]
};
/// The line around these items as a view shows them, also where other items hide them; none if the
/// view shows none of them, or they have more than 300,000 triangles. `ratio`: pixels of the
/// picture per device-independent pixel; `width` of the line [px of the picture].
[[nodiscard]] std::optional<ItemOutline> outline_around(const Frame& frame,
                                                        const std::vector<std::uint64_t>& items,
                                                        const Display::View& view, double ratio,
                                                        double width, const QColor& colour);

/// [GUI thread]
class Hover : public QObject {
 public:
  /// Desk and display outlive it. `redraw` is called with a part of the display that paint() draws
  /// differently from now on.
  Hover(Desk& desk, Display& display, std::function<void(const QRect&)> redraw);

  /// What is at a place of the display.
  std::function<Hovered(QPointF at)> find;
  /// The items of what the mouse is over elsewhere, such as a row of the navigator.
  std::function<std::vector<std::uint64_t>(const Selection& what)> items_of;

  /// The frame shown from now on. Its selected items are outlined by the picture itself.
  void set_frame(const viewer::Frame& frame);
  /// Looks up the item under the mouse, which moved with no button held, once it rests.
  void move(QPointF at);
  /// Shows nothing until the mouse moves again.
  void clear();
  /// Looks again if the frame or the camera changed.
  void check();

  /// Name of what is shown; "" = nothing, or the mouse is over it elsewhere.
  [[nodiscard]] const QString& name() const { return shown_.name; }
  [[nodiscard]] const Selection& what() const { return shown_.what; }
  [[nodiscard]] const std::optional<ItemOutline>& outline() const { return outline_; }
  /// Times that something was looked for under the mouse.
  [[nodiscard]] int looks() const { return looks_; }
  void paint(QPainter& painter) const;

 private:
  void look();
  void show(Hovered what, bool is_here);
  void forget();
  [[nodiscard]] QRect label_place() const;
  [[nodiscard]] QRect place_shown() const;

  Desk& desk_;
  Display& display_;
  std::function<void(const QRect&)> redraw_;
  const viewer::Frame* frame_ = nullptr;
  QTimer rest_;            ///< until the mouse counts as at rest
  QPointF at_, label_at_;  ///< [device-independent px]
  bool is_inside_ = false, is_elsewhere_ = false;
  Hovered shown_;
  std::optional<ItemOutline> outline_;
  Display::View view_;  ///< that the outline is drawn in
  int frames_ = 0, drawn_for_ = 0, looks_ = 0;
};

}  // namespace robomosp::viewer
