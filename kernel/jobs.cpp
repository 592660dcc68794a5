// SPDX-License-Identifier: Apache-2.0
#include "kernel/jobs.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <exception>
#include <optional>
#include <utility>

#include "kernel/call_queue.h"
#include "kernel/executor.h"
#include "kernel/permit.h"
#include "kernel/text.h"

namespace robomosp {
namespace {

/// Finished jobs are remembered so that their status and result can still be asked for.
constexpr std::size_t kRemembered = 256;
/// How often one who waits looks whether to give up.
constexpr std::chrono::milliseconds kLook{50};
/// Listeners hear of progress no more often than this.
constexpr std::chrono::milliseconds kTellEvery{20};

thread_local std::uint64_t job_here = 0;

bool is_finished(JobState s) {
  return s == JobState::done || s == JobState::failed || s == JobState::cancelled;
}

Error cancelled_error(const std::string& label) {
  return error(ErrorCode::cancelled, "the job " + text::quote(label) + " was cancelled");
}

Result<Value> guarded_work(const Jobs::Work& work, const std::string& label, Progress& progress) {
  try {
    return work(progress);
  } catch (const std::exception& e) {
    return error(ErrorCode::internal, "the job " + text::quote(label) + " threw: " + e.what());
  } catch (...) {
    return error(ErrorCode::internal,
                 "the job " + text::quote(label) + " threw an unknown exception");
  }
}

}  // namespace

std::string_view to_string(JobState s) {
  switch (s) {
    case JobState::waiting: return "waiting";
    case JobState::running: return "running";
    case JobState::done: return "done";
    case JobState::failed: return "failed";
    case JobState::cancelled: return "cancelled";
  }
  return "waiting";
}

struct Jobs::Job {
  JobStatus status;                      // guarded by mutex_
  Work work;                             // taken by the thread that does it
  std::shared_ptr<const Permit> permit;  // of whoever submitted it
  bool is_serving = false;               // submitted within a call of another thread
  std::stop_source stop;
  bool has_begun = false;               // guarded by mutex_; its work was called
  std::optional<Result<Value>> result;  // guarded by mutex_
};

Jobs::Jobs(std::size_t at_once)
    : at_once_(at_once > 0 ? at_once : std::max(kLeastAtOnce, 2 * Executor::of_process().cores())) {
}

Jobs::~Jobs() { end(); }

void Jobs::end() {
  cancel_all();
  std::unique_lock lock(mutex_);
  wait_serving(lock, finished_, [this] { return running_ == 0; });
}

std::uint64_t Jobs::subscribe(std::function<void(const JobStatus&)> listener) {
  auto kept = std::make_shared<const std::function<void(const JobStatus&)>>(std::move(listener));
  const std::lock_guard lock(listeners_mutex_);
  listeners_.emplace_back(next_listener_, std::move(kept));
  return next_listener_++;
}

void Jobs::unsubscribe(std::uint64_t id) {
  const std::lock_guard lock(listeners_mutex_);
  std::erase_if(listeners_, [&](const auto& entry) { return entry.first == id; });
}

void Jobs::tell(const JobStatus& status) const {
  std::vector<std::shared_ptr<const std::function<void(const JobStatus&)>>> all;
  {
    const std::lock_guard lock(listeners_mutex_);
    for (const auto& [id, listener] : listeners_) all.push_back(listener);
  }
  for (const auto& listener : all) (*listener)(status);
}

std::uint64_t Jobs::here() { return job_here; }

std::uint64_t Jobs::submit(std::string label, Work work) {
  return submit(std::move(label), {}, std::move(work));
}

std::uint64_t Jobs::submit(std::string label, JobOwner owner, Work work) {
  auto job = std::make_shared<Job>();
  job->work = std::move(work);
  job->permit = keep_permit();
  job->is_serving = CallQueue::is_serving();
  std::uint64_t id = 0;
  Launched launched;
  {
    const std::lock_guard lock(mutex_);
    id = job->status.id = next_++;
    job->status.label = std::move(label);
    job->status.owner = std::move(owner);
    jobs_.emplace(id, job);
    queue_.push_back(std::move(job));
    launched = next_locked();
  }
  launch(launched);
  return id;
}

Jobs::Launched Jobs::next_locked() {
  Launched launched;
  while (running_ < at_once_ && !queue_.empty()) {
    launched.push_back(std::move(queue_.front()));
    queue_.pop_front();
    launched.back()->status.state = JobState::running;
    ++running_;
  }
  return launched;
}

void Jobs::launch(const Launched& launched) {
  for (const auto& job : launched) Executor::of_process().run([this, job] { work_on(job); });
}

bool Jobs::cancel_locked(Job& job) {
  if (is_finished(job.status.state)) return false;
  job.stop.request_stop();
  if (job.status.state != JobState::waiting) return true;
  job.status.state = JobState::cancelled;
  job.result = cancelled_error(job.status.label);
  std::erase_if(queue_, [&](const auto& waiting) { return waiting.get() == &job; });
  done_.push_back(job.status.id);
  forget_locked();
  return true;
}

bool Jobs::cancel(std::uint64_t id) {
  std::shared_ptr<Job> job;
  std::optional<JobStatus> ended;
  Work dropped;
  {
    const std::lock_guard lock(mutex_);
    const auto it = jobs_.find(id);
    if (it == jobs_.end()) return false;
    job = it->second;
    if (!cancel_locked(*job)) return false;
    if (is_finished(job->status.state)) {
      ended = job->status;
      dropped = std::move(job->work);
    }
  }
  finished_.notify_all();
  if (ended) tell(*ended);
  return true;
}

Jobs::Asked Jobs::ask_to_end(std::uint64_t id) {
  const std::lock_guard lock(mutex_);
  const auto it = jobs_.find(id);
  if (it == jobs_.end() || is_finished(it->second->status.state)) return Asked::not_there;
  it->second->stop.request_stop();
  return it->second->has_begun ? Asked::was_told : Asked::will_not_begin;
}

void Jobs::cancel_all() {
  std::vector<std::uint64_t> ids;
  {
    const std::lock_guard lock(mutex_);
    for (const auto& [id, job] : jobs_) ids.push_back(id);
  }
  for (const std::uint64_t id : ids) cancel(id);
}

Error Jobs::unknown(std::uint64_t id) const {
  return error(ErrorCode::unknown_name, "there is no job " + std::to_string(id),
               "job.list lists the known jobs.");
}

Result<JobStatus> Jobs::status(std::uint64_t id) const {
  const std::lock_guard lock(mutex_);
  const auto it = jobs_.find(id);
  if (it == jobs_.end()) return unknown(id);
  return it->second->status;
}

std::vector<JobStatus> Jobs::list() const {
  const std::lock_guard lock(mutex_);
  std::vector<JobStatus> all;
  for (const auto& [id, job] : jobs_) all.push_back(job->status);
  return all;
}

void Jobs::work_on(const std::shared_ptr<Job>& job) {
  const auto now = [&] {
    const std::lock_guard lock(mutex_);
    return job->status;
  };
  tell(now());
  std::atomic<std::chrono::steady_clock::rep> told{0};
  StopProgress progress(job->stop.get_token(), [&](double fraction, std::string_view what) {
    {
      const std::lock_guard lock(mutex_);
      // Not std::clamp: it would let NaN pass.
      job->status.fraction = fraction >= 1 ? 1 : fraction > 0 ? fraction : 0;
      job->status.what = what;
    }
    const auto time = std::chrono::steady_clock::now().time_since_epoch();
    auto last = told.load(std::memory_order_relaxed);
    if (time - std::chrono::steady_clock::duration(last) >= kTellEvery &&
        told.compare_exchange_strong(last, time.count()))
      tell(now());
  });
  const PermitScope permitted(job->permit.get());
  const CallQueue::ContextScope as_caller({.is_serving = job->is_serving, .gives_up = nullptr});
  const bool begins = [&] {
    const std::lock_guard lock(mutex_);
    return job->has_begun = !job->stop.stop_requested();
  }();
  const std::uint64_t outer = std::exchange(job_here, job->status.id);
  Result<Value> result = begins ? guarded_work(job->work, job->status.label, progress)
                                : Result<Value>(cancelled_error(job->status.label));
  job_here = outer;
  job->work = {};  // releases what it captured before the job counts as finished
  JobStatus ended;
  {
    const std::lock_guard lock(mutex_);
    // Work that ended well in spite of a late wish to cancel has done what it does.
    if (result.ok()) {
      job->status.state = JobState::done;
      job->status.fraction = 1;
    } else if (result.error().code == ErrorCode::cancelled) {
      job->status.state = JobState::cancelled;
      if (job->stop.stop_requested()) result = cancelled_error(job->status.label);
    } else {
      job->status.state = JobState::failed;
    }
    job->result = std::move(result);
    ended = job->status;
    done_.push_back(ended.id);
    forget_locked();
  }
  finished_.notify_all();
  tell(ended);
  Launched launched;
  {
    const std::lock_guard lock(mutex_);
    --running_;
    launched = next_locked();
    finished_.notify_all();  // with the lock held: whoever waits for the last may destroy this
  }
  if (!launched.empty()) launch(launched);
}

void Jobs::forget_locked() {
  while (done_.size() > kRemembered) {
    jobs_.erase(done_.front());
    done_.pop_front();
  }
}

Result<Value> Jobs::wait(std::uint64_t id, const std::function<bool()>& gives_up) {
  std::unique_lock lock(mutex_);
  const auto it = jobs_.find(id);
  if (it == jobs_.end()) return unknown(id);
  const std::shared_ptr<Job> job = it->second;
  const auto is_done = [&] { return job->result.has_value(); };
  while (!wait_serving(lock, finished_, kLook, is_done)) {
    if (!gives_up) continue;
    lock.unlock();
    if (gives_up())
      return error(ErrorCode::cancelled,
                   "the wait for the job " + text::quote(job->status.label) + " was given up",
                   "The job continues; job.cancel ends it.");
    lock.lock();
  }
  return *job->result;
}

}  // namespace robomosp
