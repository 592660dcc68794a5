// SPDX-License-Identifier: Apache-2.0
// StopAfter: a user who cancels in the midst of the work, and notices how much is done until it
// ends (layer: contract, test support).
#pragma once

#include <algorithm>
#include <ctime>
#include <map>
#include <mutex>
#include <optional>
#include <string_view>
#include <thread>

#include <robomosp/sdk/progress.h>

namespace robomosp::conformance {

/// Cancels once so much has been computed. What counts is the time that threads compute, not the
/// time that passes, so that a machine that is busy with other work makes no test fail. Made by the
/// thread that calls the provider; other threads count from their first look.
class StopAfter final : public Progress {
 public:
  explicit StopAfter(double seconds) : after_(seconds) { (void)look(); }
  void report(double, std::string_view) override {}
  [[nodiscard]] bool cancelled() const override { return look(); }

  /// The most that a thread has computed from one look to the next, or since its last one if it is
  /// this one [s]: a wish to stop is unheard for so long.
  [[nodiscard]] double unheard() const {
    (void)look();
    const std::lock_guard lock(mutex_);
    return unheard_;
  }
  /// What the calling thread has computed since the request to stop [s]; 0 when it was not.
  [[nodiscard]] double since_told() const {
    (void)look();
    const std::lock_guard lock(mutex_);
    return told_at_ ? computed() - *told_at_ : 0;
  }

 private:
  /// What this thread has computed in its life [s].
  static double computed() {
    timespec t{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
  }
  bool look() const {
    const double now = computed();
    const auto self = std::this_thread::get_id();
    const std::lock_guard lock(mutex_);
    double& last = last_look_.try_emplace(self, now).first->second;
    unheard_ = std::max(unheard_, now - last);
    total_ += now - last;
    last = now;
    const bool is_over = total_ >= after_;
    if (is_over && self == caller_ && !told_at_) told_at_ = now;
    return is_over;
  }

  const double after_;
  const std::thread::id caller_ = std::this_thread::get_id();
  mutable std::mutex mutex_;
  // Guarded by mutex_:
  mutable std::map<std::thread::id, double> last_look_;
  mutable double unheard_ = 0, total_ = 0;
  mutable std::optional<double> told_at_;
};

}  // namespace robomosp::conformance
