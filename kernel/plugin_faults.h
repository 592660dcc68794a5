// SPDX-License-Identifier: Apache-2.0
// Faults of plugins that were refused, and of providers that were left out (layer: core).
#pragma once

#include <vector>

#include "kernel/fault.h"
#include "kernel/plugin_loader.h"

namespace robomosp {

/// The refusal of a file, or one fault for each remark of its report. The subject is the file; of a
/// provider that was left out, also the provider and its interface. [any thread]
[[nodiscard]] std::vector<Fault> plugin_faults(const PluginReport&);

}  // namespace robomosp
