// SPDX-License-Identifier: Apache-2.0
// Work on many samples divided among the processor's cores (layer: data processing, spatial).
#pragma once

#include <cstddef>
#include <functional>

namespace robomosp::spatial {

/// Threads that `samples` samples of about `nanoseconds` each are worth, 1 to cores() of them: a
/// thread costs some 30 us to start, and should save ten times that.
[[nodiscard]] std::size_t worthwhile_threads(std::size_t samples, double nanoseconds);

/// Cores that batches use: the machine's, at most 16. [any thread]
[[nodiscard]] std::size_t cores();

/// Calls work(first, last, thread) for ranges that cover 0..samples, each a multiple of `grain`
/// but the last, one for each of `threads` threads, of which the caller's is number 0. Returns when
/// all are done. A thread that the system refuses is made up for by the caller. `work` must not
/// throw. [any thread]
void in_parallel(std::size_t samples, std::size_t grain, std::size_t threads,
                 const std::function<void(std::size_t, std::size_t, std::size_t)>& work);

}  // namespace robomosp::spatial
