// SPDX-License-Identifier: Apache-2.0
// Providers built for the number before of an interface, made usable as this one (layer: core).
#pragma once

#include <string>
#include <string_view>

namespace robomosp {

/// The interface that a provider of an older number is used as: "robomosp.curve/1" gives
/// "robomosp.curve/2"; an id of this program gives itself; "" = unknown here.
[[nodiscard]] std::string current_interface(std::string_view interface_id);

/// Takes over an object of `interface_id` and gives one of current_interface(interface_id).
[[nodiscard]] void* adapted(std::string_view interface_id, void* made);

}  // namespace robomosp
