// SPDX-License-Identifier: Apache-2.0
// Interfaces as users name them (layer: application, ioci).
#pragma once

#include <string>

#include <robomosp/sdk/result.h>

namespace robomosp::ioci {

/// "ik" gives "robomosp.ik/1", and an id of an older program that of this one; full ids pass.
[[nodiscard]] Result<std::string> interface_of_word(const std::string& word);

}  // namespace robomosp::ioci
