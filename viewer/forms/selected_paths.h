// SPDX-License-Identifier: GPL-3.0-or-later
// SelectedPaths: what is selected, for forms and properties (layer: GUI).
#pragma once

#include <string>
#include <vector>

#include "kernel/value.h"

namespace robomosp::viewer {

/// A selected record, or a part of it: `path` is one that record.set takes, "" = the whole.
struct SelectedPath {
  Handle record{};
  std::string path{};
  bool operator==(const SelectedPath&) const = default;
};
using SelectedPaths = std::vector<SelectedPath>;

/// From a selection of structs with the members `record` and `path`.
template <class Selected>
[[nodiscard]] SelectedPaths selected_paths(const std::vector<Selected>& selection) {
  SelectedPaths out;
  for (const Selected& s : selection) out.push_back({s.record, s.path});
  return out;
}

}  // namespace robomosp::viewer
