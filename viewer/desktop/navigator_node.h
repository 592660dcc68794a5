// SPDX-License-Identifier: GPL-3.0-or-later
// A row of the navigator's tree (layer: GUI; for the model's own files).
#pragma once

#include <string>
#include <vector>

#include <QString>

#include "viewer/desktop/navigator_model.h"

namespace robomosp::viewer {

struct NavigatorModel::Node {
  RowType type = RowType::root;
  std::string key;  ///< unique among its siblings
  QString name, detail;
  std::string kind, icon;
  Handle record;     ///< of a record; of a part the record that it is in
  std::string path;  ///< of a part
  Handle refers;     ///< record with the outline below a part; number 0 = none
  bool is_named = true, is_quiet = false;
  qint64 bytes = 0;  ///< of memory that a recording holds
  double share = 0;  ///< of the machine's memory
  Node* parent = nullptr;
  int row = 0;
  std::vector<NodePtr> children;
  std::size_t count = 0;  ///< of a group: of all its parts
  enum class Load : std::uint8_t { none, wanted, asked, done } load = Load::none;

  /// The record with the parts below this row.
  [[nodiscard]] const Handle& outlined() const { return type == RowType::part ? refers : record; }
};

}  // namespace robomosp::viewer
