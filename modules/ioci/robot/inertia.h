// SPDX-License-Identifier: Apache-2.0
// Inertias that no body can have (layer: commands).
#pragma once

#include <string>

#include <robomosp/sdk/types.h>

namespace robomosp::ioci {

/// Whether a principal moment is negative or exceeds the sum of the two others: no body has that.
[[nodiscard]] bool is_impossible(const Sym3& inertia);
/// The principal moments [kg m^2], ascending: "0.1, 0.2 and 0.5".
[[nodiscard]] std::string moments_text(const Sym3& inertia);

}  // namespace robomosp::ioci
