// SPDX-License-Identifier: Apache-2.0
// The members of a world, or a robot alone, at the present time of a live run, for scenes (layer:
// application).
// Internal to modules/ioci.
#pragma once

#include <robomosp/sdk/result.h>

#include "document/document.h"
#include "ioci/core/runs.h"
#include "scene/motion.h"

namespace robomosp::ioci {

/// Null before the run's first row. A run of another subject is an error. [any thread]
[[nodiscard]] Result<scene::MotionPtr> run_motion(const document::Snapshot&, AnyId subject,
                                                  const LiveRunEntry& run);

}  // namespace robomosp::ioci
