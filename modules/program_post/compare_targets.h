// SPDX-License-Identifier: Apache-2.0
// One program posted for several controllers, read back and compared (layer: application,
// program_post).
#pragma once

#include <span>
#include <string>

#include <robomosp/sdk/result.h>

#include "program_post/comparison.h"
#include "program_post/post.h"

namespace robomosp::program_post::comparison {

/// Posts a compiled program for each target: the name of a provider or of a controller's record.
/// What independent readers make of the files is run through and compared (comparison.h). Of the
/// request, `target` and `profile` are not read; `flattening` has the inputs of these runs.
[[nodiscard]] Result<Comparison> compare_targets(const program_source::Workshop&,
                                                 const PostRequest&,
                                                 const program_source::Compiled&,
                                                 std::span<const std::string> targets);

}  // namespace robomosp::program_post::comparison
