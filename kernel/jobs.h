// SPDX-License-Identifier: Apache-2.0
// Jobs: work off the application thread with progress, cancellation and ordered completion
// (layer: core).
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
#include <thread>
#include <vector>

#include <robomosp/sdk/progress.h>
#include <robomosp/sdk/result.h>

#include "kernel/value.h"

namespace robomosp {

enum class JobState : std::uint8_t { waiting, running, done, failed, cancelled };
[[nodiscard]] std::string_view to_string(JobState);

struct JobStatus {
  std::uint64_t id = 0;
  std::string label;
  JobState state = JobState::waiting;
  double fraction = 0;
  std::string what;
};

/// A pool of worker threads. submit() and the completions run on the application thread; the work
/// itself on a worker, where it may read snapshots and call providers but owns nothing.
class Jobs {
 public:
  using Work = std::function<Result<Value>(Progress&)>;
  using Done = std::function<void(Result<Value>)>;
  /// 0 = one a hardware thread: whoever waits for jobs, waits without using one.
  explicit Jobs(unsigned threads = 0);
  ~Jobs();  ///< cancels and joins
  Jobs(const Jobs&) = delete;
  Jobs& operator=(const Jobs&) = delete;

  /// `done` is called from pump(), in the order of submission. An exception of the work becomes an
  /// Error. Returns the job's id, never reused.
  std::uint64_t submit(std::string label, Work work, Done done = {});
  bool cancel(std::uint64_t id);  ///< false if unknown or finished [any thread]
  void cancel_all();              ///< [any thread]
  [[nodiscard]] Result<JobStatus> status(std::uint64_t id) const;  ///< [any thread]
  [[nodiscard]] std::vector<JobStatus> list() const;               ///< [any thread]
  /// Runs finished jobs' completions; returns how many. [application thread]
  std::size_t pump();
  /// Blocks until the job is finished (pumping completions) and returns its result. Results of the
  /// last 256 delivered jobs can still be asked for. [application thread]
  [[nodiscard]] Result<Value> wait(std::uint64_t id);

 private:
  struct Job;
  void worker(std::stop_token);
  bool cancel_locked(Job&);  // with mutex_ held
  void forget_locked();      // with mutex_ held
  [[nodiscard]] Error unknown(std::uint64_t id) const;
  mutable std::mutex mutex_;
  std::condition_variable_any wake_, finished_;
  std::deque<std::shared_ptr<Job>> queue_;              // guarded by mutex_
  std::map<std::uint64_t, std::shared_ptr<Job>> jobs_;  // guarded by mutex_
  std::deque<std::shared_ptr<Job>> completions_;        // guarded by mutex_, in submission order
  std::uint64_t next_ = 1;                              // guarded by mutex_
  std::vector<std::jthread> threads_;
};

/// A Progress that a stop_token can cancel; reports go to a callback (may be empty).
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
