// SPDX-License-Identifier: Apache-2.0
// Values of robots that are allowed but hardly meant (layer: application, ioci only).
#pragma once

#include <vector>

#include "document/document.h"
#include "kernel/fault.h"

namespace robomosp::ioci {

/// Inertias that no body can have (robot.impossible_inertia) and joints that cannot move because
/// both limits are the same (robot.stuck_joint): one fault for each link, with remedies that are
/// not tried yet. Empty = there are none, or the record is no robot.
[[nodiscard]] std::vector<Fault> robot_doubts(const document::Snapshot&, AnyId);

}  // namespace robomosp::ioci
