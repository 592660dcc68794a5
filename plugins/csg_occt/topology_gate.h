// SPDX-License-Identifier: Apache-2.0
// Who may touch topology when: meshing writes triangles and polygons into faces and edges that
// other solids share, so it excludes everything that reads them (layer: plugin).
#pragma once

#include <chrono>
#include <mutex>
#include <shared_mutex>

#include <robomosp/sdk/progress.h>

namespace robomosp::csg_occt {

/// Many readers (booleans, integrals) or one writer (meshing). Not reentrant. [any thread]
class TopologyGate {
 public:
  using Reading = std::shared_lock<std::shared_timed_mutex>;
  using Writing = std::unique_lock<std::shared_timed_mutex>;

  /// Waits for its turn; an unlocked result means that the user cancelled.
  Reading read(const Progress& progress) {
    // A waiting writer holds the turnstile, so that a stream of readers cannot starve it.
    std::unique_lock turn(turnstile_, std::defer_lock);
    if (!wait(turn, progress)) return Reading();
    Reading lock(topology_, std::defer_lock);
    wait(lock, progress);
    return lock;
  }
  Writing write(const Progress& progress) {
    std::unique_lock turn(turnstile_, std::defer_lock);
    if (!wait(turn, progress)) return Writing();
    Writing lock(topology_, std::defer_lock);
    wait(lock, progress);
    return lock;
  }

 private:
  template <class Lock>
  static bool wait(Lock& lock, const Progress& progress) {
    while (!lock.try_lock_for(std::chrono::milliseconds(20)))
      if (progress.cancelled()) return false;
    return true;
  }

  std::timed_mutex turnstile_;
  std::shared_timed_mutex topology_;
};

}  // namespace robomosp::csg_occt
