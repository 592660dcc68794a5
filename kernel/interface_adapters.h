// SPDX-License-Identifier: Apache-2.0
// Adapts providers built for the previous number of an interface to the current one (layer: core).
#pragma once

#include <string>
#include <string_view>

namespace robomosp {

/// The interface that providers of an older number are adapted to: "robomosp.curve/1" gives
/// "robomosp.curve/2"; a current id gives itself; "" = unknown.
[[nodiscard]] std::string current_interface(std::string_view interface_id);

/// Takes ownership of an object of `interface_id` and returns one of
/// current_interface(interface_id).
[[nodiscard]] void* adapted(std::string_view interface_id, void* made);

}  // namespace robomosp
