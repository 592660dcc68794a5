// SPDX-License-Identifier: Apache-2.0
// The members of a world at the present time of a live run, for scenes (layer: application).
// Internal to modules/ioci.
#pragma once

#include <robomosp/sdk/result.h>

#include "document/document.h"
#include "ioci/core/runs.h"
#include "scene/motion.h"

namespace robomosp::ioci {

/// Null before the run's first row. A run of another subject than `world` is an error. [any thread]
[[nodiscard]] Result<scene::MotionPtr> run_motion(const document::Snapshot&, AnyId world,
                                                  const LiveRunEntry& run);

}  // namespace robomosp::ioci
