// SPDX-License-Identifier: Apache-2.0
// Divides work on many samples among the processor's cores (layer: data processing, spatial).
#pragma once

#include <cstddef>
#include <functional>

#include <robomosp/sdk/plugin.h>

namespace robomosp::spatial {

/// Number of threads worth starting for `samples` samples of about `nanoseconds` each, 1 to
/// cores(): a thread costs some 30 us to start, and should save ten times that.
[[nodiscard]] std::size_t worthwhile_threads(std::size_t samples, double nanoseconds);

/// Cores that batches use: the machine's, at most 16. [any thread]
[[nodiscard]] std::size_t cores();

/// Calls part(context, 0) ... part(context, parts - 1), at most `threads` of them at once, and
/// returns when all are done. `part` does not throw.
using Spread = void (*)(std::size_t parts, std::size_t threads,
                        void (*part)(void* context, std::size_t), void* context);
/// Sets the thread provider of in_parallel(), such as the program's executor; null = in_parallel()
/// starts threads itself for each call. [any thread]
void set_spread(Spread);
/// The same for a plugin, which has a copy of this library: uses the threads of its host from now
/// on, if it provides any. For constructors of providers. [any thread]
void use_threads_of(const rmp_host*);

/// Calls work(first, last, thread) for ranges that cover 0..samples, each a multiple of `grain` but
/// the last, with numbers `thread` below `threads` that differ between concurrent calls. Returns
/// when all are done. The calling thread takes part, and does the work of unavailable threads.
/// `work` must not throw. [any thread]
void in_parallel(std::size_t samples, std::size_t grain, std::size_t threads,
                 const std::function<void(std::size_t, std::size_t, std::size_t)>& work);

}  // namespace robomosp::spatial
