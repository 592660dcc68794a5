// SPDX-License-Identifier: Apache-2.0
// Work on many samples on the threads that so many are worth (layer: application, sim).
#pragma once

#include <cstddef>
#include <functional>

#include <robomosp/sdk/progress.h>
#include <robomosp/sdk/result.h>

namespace robomosp::sim {

/// Calls work(first, last, thread) for parts of `count` samples, on as many threads as so many
/// samples of `nanoseconds` each are worth, looking at `progress` between them. The error is that
/// of the first part that has one. `thread` is below spatial::cores().
[[nodiscard]] Result<void> for_samples(
    std::size_t count, double nanoseconds, Progress& progress,
    const std::function<Result<void>(std::size_t first, std::size_t last, std::size_t thread)>&
        work);

}  // namespace robomosp::sim
