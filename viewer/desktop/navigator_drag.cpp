// SPDX-License-Identifier: GPL-3.0-or-later
// Dragging in the navigator: what a row is elsewhere, and what a drop on a row does.
#include <algorithm>
#include <utility>

#include <QMimeData>

#include "viewer/desktop/dragging.h"
#include "viewer/desktop/navigator_model.h"
#include "viewer/desktop/navigator_node.h"
#include "viewer/desktop/values.h"

namespace robomosp::viewer {
namespace {

/// Parts with an order in the model, which a drag changes.
bool has_order(const std::string& kind) {
  return kind == "step" || kind == "segment" || kind == "node";
}

/// The part behind the dot of a path: "3" of "steps.3", "bore" of "nodes.bore".
std::string behind_dot(const std::string& path) { return path.substr(path.find('.') + 1); }

std::int64_t number_of(const std::string& path) { return shown(behind_dot(path)).toLongLong(); }

}  // namespace

struct NavigatorModel::Drop {
  std::string command;  ///< "" = rows are put into a world
  Map args;
  Handle world;
  std::vector<DraggedRow> rows;
};

bool NavigatorModel::may_drag(const Node& n) {
  return n.type == RowType::record || n.type == RowType::part || n.type == RowType::other ||
         n.type == RowType::library;
}

QStringList NavigatorModel::mimeTypes() const { return {kRowsMime}; }

QMimeData* NavigatorModel::mimeData(const QModelIndexList& indexes) const {
  std::vector<DraggedRow> rows;
  for (const QModelIndex& index : indexes) {
    const Node& n = *node_of(index);
    if (!may_drag(n)) continue;
    rows.push_back(
        {n.kind, utf8(n.name), n.type == RowType::library ? Handle{n.kind, 0} : n.record, n.path});
  }
  return rows.empty() ? nullptr : mime_of(rows).release();
}

std::optional<NavigatorModel::Drop> NavigatorModel::drop_of(const QMimeData* data, int row,
                                                            const QModelIndex& parent) const {
  const std::vector<DraggedRow> rows = dragged_rows(data);
  if (rows.empty() || !parent.isValid()) return std::nullopt;
  const Node& over = *node_of(parent);
  const DraggedRow& first = rows.front();
  if (rows.size() == 1 && !first.path.empty() && has_order(first.kind)) {
    // Within its record: before a row, into a block, or at the end.
    const bool is_same_record =
        over.record == first.record &&
        (over.type == RowType::record || over.type == RowType::group || over.kind == first.kind);
    if (!is_same_record || over.path == first.path) return std::nullopt;
    const Node* next = nullptr;
    const bool is_between = row >= 0;
    if (is_between && static_cast<std::size_t>(row) < over.children.size())
      next = over.children[static_cast<std::size_t>(row)].get();
    const bool is_on_part = over.type == RowType::part;
    Map args{{"id", first.record}};
    if (first.kind == "node") {
      args.set("node", behind_dot(first.path));
      if (is_on_part) args.set("parent", behind_dot(over.path));
      if (is_between && is_on_part) {
        std::int64_t at = row + 1;
        for (int i = 0; i < row && static_cast<std::size_t>(i) < over.children.size(); ++i)
          if (over.children[static_cast<std::size_t>(i)]->path == first.path) --at;
        args.set("index", at);
      }
      if (!is_on_part) return std::nullopt;  // there is one node without a parent
      return Drop{"solid.move_node", std::move(args), {}, {}};
    }
    if (next && (next->kind != first.kind || next->path == first.path)) return std::nullopt;
    args.set("index", number_of(first.path));
    if (first.kind == "segment") {
      // On a segment: to its place.
      const Node* at = is_between ? next : &over;
      std::int64_t to = at && at->type == RowType::part
                            ? number_of(at->path)
                            : static_cast<std::int64_t>(over.children.size());
      if (is_between && next && to > number_of(first.path)) --to;
      if (to == number_of(first.path)) return std::nullopt;
      args.set("to", to);
      return Drop{"trajectory.move_segment", std::move(args), {}, {}};
    }
    if (next) args.set("before", number_of(next->path));
    else if (is_on_part && !over.children.empty()) args.set("parent", number_of(over.path));
    else if (is_on_part) args.set("before", number_of(over.path));
    return Drop{"task.move_step", std::move(args), {}, {}};
  }
  if (over.type != RowType::record || over.kind != "world" || row >= 0) return std::nullopt;
  const bool have_places = std::all_of(rows.begin(), rows.end(),
                                       [&](const DraggedRow& r) { return placing_of(r).ok(); });
  if (!have_places) return std::nullopt;
  return Drop{"", {}, over.record, rows};
}

bool NavigatorModel::canDropMimeData(const QMimeData* data, Qt::DropAction, int row, int,
                                     const QModelIndex& parent) const {
  return drop_of(data, row, parent).has_value();
}

bool NavigatorModel::dropMimeData(const QMimeData* data, Qt::DropAction, int row, int,
                                  const QModelIndex& parent) {
  auto drop = drop_of(data, row, parent);
  if (!drop) return false;
  if (drop->command.empty()) place_rows(desk_, drop->world, drop->rows, std::nullopt);
  else desk_.act(std::move(drop->command), std::move(drop->args));
  return true;
}

}  // namespace robomosp::viewer
