// SPDX-License-Identifier: Apache-2.0
#include "sim/for_samples.h"

#include <algorithm>
#include <atomic>
#include <mutex>
#include <new>
#include <optional>
#include <utility>

#include "spatial/parallel.h"

namespace robomosp::sim {

Result<void> for_samples(
    std::size_t count, double nanoseconds, Progress& progress,
    const std::function<Result<void>(std::size_t, std::size_t, std::size_t)>& work) {
  constexpr double kBetweenLooks = 1e6;  // ns
  const auto grain = static_cast<std::size_t>(std::clamp(kBetweenLooks / nanoseconds, 1.0, 1024.0));
  std::atomic<bool> is_stopped{false};
  std::mutex mutex;
  std::size_t failed_at = count;
  std::optional<Error> failed;
  spatial::in_parallel(count, grain, spatial::worthwhile_threads(count, nanoseconds),
                       [&](std::size_t first, std::size_t last, std::size_t thread) {
                         for (std::size_t i = first; i < last; i += grain) {
                           if (progress.cancelled()) is_stopped = true;
                           if (is_stopped) return;
                           auto done = [&]() -> Result<void> {
                             try {
                               return work(i, std::min(last, i + grain), thread);
                             } catch (const std::bad_alloc&) {
                               return error(ErrorCode::internal,
                                            "there is not enough memory for the batch",
                                            "Give fewer states at once.");
                             }
                           }();
                           if (done.ok()) continue;
                           const std::lock_guard lock(mutex);
                           if (i < failed_at) failed_at = i, failed = std::move(done).error();
                           return;
                         }
                       });
  if (is_stopped) return error(ErrorCode::cancelled, "the batch was cancelled");
  if (failed) return std::move(*failed);
  return {};
}

}  // namespace robomosp::sim
