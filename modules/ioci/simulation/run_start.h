// SPDX-License-Identifier: Apache-2.0
// Notes about where runs start (layer: application, ioci only).
#pragma once

#include <vector>

#include "ioci/core/command.h"
#include "kernel/fault.h"
#include "recording/recording.h"

namespace robomosp::ioci {

/// Robots that start a run in a world outside their limits, and bodies that touch in its first row
/// without being meant to. Contact is looked for as below. Only cancelling is an error.
[[nodiscard]] Result<std::vector<Fault>> start_faults(CommandContext&,
                                                      const recording::RecordingPtr&);
/// The recording of a run in a world with a note for each robot that starts outside its limits, and
/// one where bodies touch in the first row that are not meant to; with `posts` the notes are
/// posted as warnings too. Notes that it has are not made again. What a robot holds or takes at the
/// start may touch. Contact is looked for where a collision engine and the shapes of all bodies are
/// there; where they are not, nothing is noted: a run is no check. Only cancelling is an error.
[[nodiscard]] Result<recording::RecordingPtr> with_start_notes(CommandContext&,
                                                               recording::RecordingPtr,
                                                               bool posts = true);

}  // namespace robomosp::ioci
