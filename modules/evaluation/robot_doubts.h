// SPDX-License-Identifier: Apache-2.0
// Values of robots that are allowed but hardly meant (layer: application, evaluation).
#pragma once

#include <string>
#include <vector>

#include <robomosp/sdk/progress.h>
#include <robomosp/sdk/types.h>

#include "document/document.h"
#include "evaluation/derived.h"
#include "kernel/fault.h"

namespace robomosp::evaluation {

/// Inertias that no body can have (robot.impossible_inertia) and joints that cannot move because
/// both limits are the same (robot.stuck_joint): one fault for each link, with remedies that are
/// not tried yet. Empty = there are none, or the record is no robot.
[[nodiscard]] std::vector<Fault> robot_doubts(const document::Snapshot&, AnyId);

/// True if a principal moment is negative or exceeds the sum of the two others: no body has that.
[[nodiscard]] bool is_impossible(const Sym3& inertia);
/// The principal moments [kg m^2], ascending: "0.1, 0.2 and 0.5".
[[nodiscard]] std::string moments_text(const Sym3& inertia);
/// The inertia nearest to it that a body can have: the same axes, and the principal moments with
/// the least sum of squared differences.
[[nodiscard]] Sym3 nearest_possible(const Sym3& inertia);

/// Offers the mass of the designed bodies of the link, or of the base, that has an impossible
/// inertia, if it has some and their inertia is possible. Computes solids.
void offer_designed_mass(const document::Snapshot&, Derived&, Progress&, RobotId, Fault&);

}  // namespace robomosp::evaluation
