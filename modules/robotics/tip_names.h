// SPDX-License-Identifier: Apache-2.0
// Names of the tips of a robot's model, without building it (layer: data processing, robotics).
// [any thread]
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "model/records.h"

namespace robomosp::robotics {

/// Whether each link has no child.
[[nodiscard]] std::vector<bool> leaf_links(const model::Robot&);
/// Name of the tip at a leaf link: that of the link, or "link 3".
[[nodiscard]] std::string leaf_tip_name(const model::Robot&, std::size_t link);
/// Calls `see` with the name of each tip in the order of RobotModel::tips, until it returns false.
/// A robot without links has none.
void each_tip_name(const model::Robot&, const std::function<bool(std::string_view)>& see);

}  // namespace robomosp::robotics
