// SPDX-License-Identifier: Apache-2.0
// Jobs: background work of sessions, with progress and cancellation (layer: core).
#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <stop_token>
#include <string>
#include <utility>
#include <vector>

#include <robomosp/sdk/progress.h>
#include <robomosp/sdk/result.h>

#include "kernel/value.h"

namespace robomosp {

enum class JobState : std::uint8_t { waiting, running, done, failed, cancelled };
[[nodiscard]] std::string_view to_string(JobState);

/// The session that started a job, and the step that its edits join. Zeros and "": started by the
/// program itself, with its edits as a separate step.
struct JobOwner {
  std::uint64_t session = 0;  ///< its number
  std::string name;           ///< of the session
  std::uint64_t gesture = 0, draft = 0;
};

struct JobStatus {
  std::uint64_t id = 0;
  std::string label;
  JobState state = JobState::waiting;
  double fraction = 0;
  std::string what;
  JobOwner owner = {};
};

/// Work on threads of the executor, with a limit on how many run at once. It reads snapshots and
/// calls providers and owns nothing. [any thread]
class Jobs {
 public:
  using Work = std::function<Result<Value>(Progress&)>;
  /// 0 = two per core, at least kLeastAtOnce, since work may wait for a script or for other work.
  explicit Jobs(std::size_t at_once = 0);
  ~Jobs();  ///< cancels and waits
  Jobs(const Jobs&) = delete;
  Jobs& operator=(const Jobs&) = delete;
  static constexpr std::size_t kLeastAtOnce = 4;

  /// An exception of the work becomes an Error. Returns the job's id, never reused.
  std::uint64_t submit(std::string label, Work work);
  std::uint64_t submit(std::string label, JobOwner owner, Work work);
  /// Requests the end of a job: work that obeys returns ErrorCode::cancelled, other work runs to
  /// its end. A job still in the queue ends at once. False if unknown or finished.
  bool cancel(std::uint64_t id);
  enum class Asked : std::uint8_t {
    not_there,       ///< unknown or finished
    will_not_begin,  ///< still in the queue: it ends cancelled when its turn comes
    was_told         ///< running: it ends as after cancel()
  };
  /// The same for threads that must not wait: locks the mutex only briefly, calls no listener and
  /// frees no memory.
  Asked ask_to_end(std::uint64_t id);
  void cancel_all();
  void end();  ///< cancels all jobs and waits for them
  [[nodiscard]] Result<JobStatus> status(std::uint64_t id) const;
  [[nodiscard]] std::vector<JobStatus> list() const;
  /// The job that this thread is running; 0 = none.
  [[nodiscard]] static std::uint64_t here();
  /// Waits until the job is finished and returns its result; runs calls handed to this thread
  /// meanwhile. `gives_up` (may be empty) is polled every 50 ms; if it returns true, wait() fails
  /// with ErrorCode::cancelled, and the job continues. The results of the last 256 finished jobs
  /// are kept.
  [[nodiscard]] Result<Value> wait(std::uint64_t id, const std::function<bool()>& gives_up = {});
  /// Calls `listener` after each change of a job's state or progress, on the thread that changes
  /// it; one more call may follow shortly after unsubscribe().
  std::uint64_t subscribe(std::function<void(const JobStatus&)> listener);
  void unsubscribe(std::uint64_t);

 private:
  struct Job;
  using Launched = std::vector<std::shared_ptr<Job>>;
  [[nodiscard]] Launched next_locked();  // with mutex_ held; the next job that may start
  void launch(const Launched&);          // without mutex_ held
  void work_on(const std::shared_ptr<Job>&);
  bool cancel_locked(Job&);  // with mutex_ held
  void forget_locked();      // with mutex_ held
  void tell(const JobStatus&) const;
  [[nodiscard]] Error unknown(std::uint64_t id) const;
  const std::size_t at_once_;
  mutable std::mutex listeners_mutex_;
  std::vector<
      std::pair<std::uint64_t, std::shared_ptr<const std::function<void(const JobStatus&)>>>>
      listeners_;                    // guarded by listeners_mutex_
  std::uint64_t next_listener_ = 1;  // guarded by listeners_mutex_
  mutable std::mutex mutex_;
  std::condition_variable finished_;
  std::deque<std::shared_ptr<Job>> queue_;              // guarded by mutex_
  std::map<std::uint64_t, std::shared_ptr<Job>> jobs_;  // guarded by mutex_
  std::deque<std::uint64_t> done_;                      // guarded by mutex_, oldest first
  std::uint64_t next_ = 1;                              // guarded by mutex_
  std::size_t running_ = 0;                             // guarded by mutex_
};

/// A Progress that a stop_token can cancel; reports are passed to a callback (may be empty).
class StopProgress final : public Progress {
 public:
  explicit StopProgress(std::stop_token token,
                        std::function<void(double, std::string_view)> show = {})
      : token_(std::move(token)), show_(std::move(show)) {}
  void report(double fraction, std::string_view what) override {
    if (show_) show_(fraction, what);
  }
  [[nodiscard]] bool cancelled() const override { return token_.stop_requested(); }

 private:
  std::stop_token token_;
  std::function<void(double, std::string_view)> show_;
};

}  // namespace robomosp
