// SPDX-License-Identifier: Apache-2.0
#include "kernel/jobs.h"

#include <algorithm>
#include <exception>
#include <optional>
#include <utility>

#include "kernel/text.h"

namespace robomosp {
namespace {

/// Finished jobs are remembered so that their status and result can still be asked for.
constexpr std::size_t kRemembered = 256;

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
  JobStatus status;  // guarded by mutex_
  Work work;         // taken by the worker
  Done done;         // application thread
  std::stop_source stop;
  std::optional<Result<Value>> result;  // guarded by mutex_
  bool delivered = false;               // guarded by mutex_
};

Jobs::Jobs(unsigned threads) {
  if (threads == 0) threads = std::max(1U, std::thread::hardware_concurrency());
  for (unsigned i = 0; i < threads; ++i)
    threads_.emplace_back([this](std::stop_token token) { worker(std::move(token)); });
}

Jobs::~Jobs() {
  cancel_all();
  for (std::jthread& t : threads_) t.request_stop();
  wake_.notify_all();
  threads_.clear();  // joins, while the members they use still exist
}

std::uint64_t Jobs::submit(std::string label, Work work, Done done) {
  auto job = std::make_shared<Job>();
  job->work = std::move(work);
  job->done = std::move(done);
  {
    const std::lock_guard lock(mutex_);
    job->status.id = next_++;
    job->status.label = std::move(label);
    jobs_.emplace(job->status.id, job);
    queue_.push_back(job);
    completions_.push_back(job);
  }
  wake_.notify_one();
  return job->status.id;
}

bool Jobs::cancel_locked(Job& job) {
  if (is_finished(job.status.state)) return false;
  job.stop.request_stop();
  if (job.status.state != JobState::waiting) return true;
  job.status.state = JobState::cancelled;
  job.result = cancelled_error(job.status.label);
  std::erase_if(queue_, [&](const auto& waiting) { return waiting.get() == &job; });
  return true;
}

bool Jobs::cancel(std::uint64_t id) {
  {
    const std::lock_guard lock(mutex_);
    const auto it = jobs_.find(id);
    if (it == jobs_.end() || !cancel_locked(*it->second)) return false;
  }
  finished_.notify_all();
  return true;
}

void Jobs::cancel_all() {
  {
    const std::lock_guard lock(mutex_);
    for (const auto& [id, job] : jobs_) cancel_locked(*job);
  }
  finished_.notify_all();
}

Error Jobs::unknown(std::uint64_t id) const {
  return error(ErrorCode::unknown_name, "there is no job " + std::to_string(id),
               "job.list tells those known.");
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

void Jobs::worker(std::stop_token token) {
  for (;;) {
    std::shared_ptr<Job> job;
    {
      std::unique_lock lock(mutex_);
      if (!wake_.wait(lock, token, [&] { return !queue_.empty(); }) || token.stop_requested())
        return;
      job = std::move(queue_.front());
      queue_.pop_front();
      job->status.state = JobState::running;
    }
    StopProgress progress(job->stop.get_token(), [&](double fraction, std::string_view what) {
      const std::lock_guard lock(mutex_);
      // Not std::clamp: it would let NaN pass.
      job->status.fraction = fraction >= 1 ? 1 : fraction > 0 ? fraction : 0;
      job->status.what = what;
    });
    Result<Value> result = guarded_work(job->work, job->status.label, progress);
    job->work = {};  // releases what it captured before the job counts as finished
    {
      const std::lock_guard lock(mutex_);
      if (job->stop.stop_requested()) {
        job->status.state = JobState::cancelled;
        result = cancelled_error(job->status.label);
      } else if (result.ok()) {
        job->status.state = JobState::done;
        job->status.fraction = 1;
      } else {
        job->status.state =
            result.error().code == ErrorCode::cancelled ? JobState::cancelled : JobState::failed;
      }
      job->result = std::move(result);
    }
    finished_.notify_all();
  }
}

std::size_t Jobs::pump() {
  std::size_t count = 0;
  for (;;) {
    std::shared_ptr<Job> job;
    {
      const std::lock_guard lock(mutex_);
      if (completions_.empty() || !completions_.front()->result) return count;
      job = std::move(completions_.front());
      completions_.pop_front();
      job->delivered = true;
      forget_locked();
    }
    // Called with no lock held, so that it may submit, cancel or wait.
    if (const Done done = std::exchange(job->done, {})) done(*job->result);
    ++count;
  }
}

void Jobs::forget_locked() {
  std::size_t delivered = 0;
  for (const auto& [id, job] : jobs_) delivered += job->delivered ? 1U : 0U;
  for (auto it = jobs_.begin(); it != jobs_.end() && delivered > kRemembered;) {
    if (!it->second->delivered) {
      ++it;
      continue;
    }
    it = jobs_.erase(it);
    --delivered;
  }
}

Result<Value> Jobs::wait(std::uint64_t id) {
  std::shared_ptr<Job> job;
  {
    const std::lock_guard lock(mutex_);
    const auto it = jobs_.find(id);
    if (it == jobs_.end()) return unknown(id);
    job = it->second;
  }
  for (;;) {
    pump();
    std::unique_lock lock(mutex_);
    if (job->result) {
      const Result<Value> result = *job->result;
      lock.unlock();
      pump();  // it may have finished after the first one
      return result;
    }
    finished_.wait(lock, [&] {
      return job->result || (!completions_.empty() && completions_.front()->result);
    });
  }
}

}  // namespace robomosp
