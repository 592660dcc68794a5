// SPDX-License-Identifier: Apache-2.0
// Robots, trajectories and worlds of ROBOMOSP 1.4 (2006): from texts to records (layer:
// application). Internal to modules/io. Format: docs/user/files-2006.md.
#pragma once

#include <string>

#include <robomosp/sdk/result.h>

#include "io/legacy_bound.h"
#include "io/legacy_syntax.h"

namespace robomosp::io {

/// Each reads on behind the first text of a file, which is given where it is a description. A code
/// that no known file has evidence for is an error at its place. The syntax must outlive `out`.
Result<void> bind_legacy_robot(LegacyReader&, const Syntax&, const std::string& description,
                               LegacyBound& out);
Result<void> bind_legacy_world(LegacyReader&, const Syntax&, const std::string& description,
                               LegacyBound& out);
Result<void> bind_legacy_trajectory(LegacyReader&, const Syntax&, LegacyBound& out);
/// A section stored by itself: a trajectory of one segment. From its name on, or from the brace
/// before it.
Result<void> bind_legacy_section(LegacyReader&, const Syntax&, bool is_braced, LegacyBound& out);

}  // namespace robomosp::io
