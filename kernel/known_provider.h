// SPDX-License-Identifier: Apache-2.0
// Providers whether they are enabled or not (layer: core).
#pragma once

#include <string_view>

#include "kernel/registry.h"

namespace robomosp {

/// As Registry::find(), which refuses a named provider that is disabled; this one finds it, for its
/// parameters and its state. [any thread]
[[nodiscard]] Result<ProviderInfo> known_provider(const Registry&, std::string_view interface_id,
                                                  std::string_view name);

}  // namespace robomosp
