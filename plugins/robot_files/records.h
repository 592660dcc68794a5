// SPDX-License-Identifier: Apache-2.0
// Converts a mechanism to native records: a robot, a solid for each different shape, a material for
// each colour (layer: plugin).
#pragma once

#include <robomosp/sdk/io.h>

#include "mechanism.h"
#include "read.h"

namespace robomosp::robot_files {

/// Orders the bodies (parents and followed joints first, else in the order of the file), renames
/// those with invalid names, and reports every such change in the notes.
[[nodiscard]] Result<Imported> records(Mechanism m, const Options& options);

}  // namespace robomosp::robot_files
