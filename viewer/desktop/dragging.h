// SPDX-License-Identifier: GPL-3.0-or-later
// What is dragged from the navigator, and where it can be dropped (layer: GUI).
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <QObject>
#include <QPoint>
#include <QPointF>
#include <QString>

#include "viewer/desktop/desk.h"
#include "viewer/scene/linear.h"

class QDragMoveEvent;
class QMimeData;

namespace robomosp::viewer {

class ViewTab;

/// Rows of the navigator, as JSON.
inline constexpr const char* kRowsMime = "application/x-robomosp-rows";
/// Names of columns of a recording, one on each line.
inline constexpr const char* kColumnMime = "application/x-robomosp-columns";

/// A row that is dragged: a record, a part of one, or a record of the library.
struct DraggedRow {
  std::string kind;  ///< of the record
  std::string name;  ///< shown
  Handle record;     ///< number 0 = of the library
  std::string path;  ///< of a part
  [[nodiscard]] bool is_shipped() const { return record.number == 0; }
};

/// The rows in all forms that a place may want: rows, a column, and Lua as plain text. The caller
/// owns the result.
[[nodiscard]] std::unique_ptr<QMimeData> mime_of(const std::vector<DraggedRow>& rows);
/// Empty if there are none.
[[nodiscard]] std::vector<DraggedRow> dragged_rows(const QMimeData* data);
/// A record as Lua, such as robot("puma560"); a part as its quoted name.
[[nodiscard]] QString lua_of(const DraggedRow& row);

/// The command that puts a row into a world, without `id`; none with the reason if it has no place.
struct Placing {
  std::string command;
  Map args;
};
[[nodiscard]] Result<Placing> placing_of(const DraggedRow& row);
/// Puts rows into a world, each at `position` if it has a place there: one step to undo.
void place_rows(Desk& desk, const Handle& world, const std::vector<DraggedRow>& rows,
                const std::optional<Vec3>& position);

/// Takes rows that are dropped on the picture of a world, and shows where they will be. It belongs
/// to the view. [GUI thread]
class DropTarget : public QObject {
 public:
  DropTarget(Desk& desk, ViewTab& view);
  /// The point of a surface or of the floor at a place of the picture, in the active one of four
  /// views [m].
  [[nodiscard]] std::optional<Vec3> point_at(QPointF place) const;
  [[nodiscard]] bool is_showing() const;

 protected:
  bool eventFilter(QObject* object, QEvent* event) override;

 private:
  class Preview;
  /// Why rows cannot be dropped here; "" = they can.
  [[nodiscard]] QString hindrance(const std::vector<DraggedRow>& rows) const;
  void ask_box(const DraggedRow& row);
  /// Activates the pane of four views at a place of the view; the place in the display.
  QPoint enter_pane(QPointF in_view);
  Desk& desk_;
  ViewTab& view_;
  Preview* preview_;
  std::vector<DraggedRow> rows_;
};

}  // namespace robomosp::viewer
