// SPDX-License-Identifier: Apache-2.0
// Conversation: the requests of one client and their answers, independent of the transport (layer:
// application, remote).
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>

#include "ioci/core/application.h"
#include "kernel/value.h"
#include "remote/rpc.h"
#include "remote/signal_waits.h"

namespace robomosp::remote {

/// Requests are queued until the session's thread runs them; requests about jobs (job.list,
/// job.progress, job.wait, job.cancel) and rpc.cancel are answered at once, on the thread that read
/// them.
class Conversation {
 public:
  using Clock = std::chrono::steady_clock;
  struct Options {
    /// Sends one line, given without its newline. [any thread]
    std::function<void(std::string)> say;
    /// Called for each new request. [the reader's thread]
    std::function<void()> ready;
    std::size_t most_waits = 64;  ///< concurrent job.wait and server.wait requests
    /// Calls `fn` after this many seconds, on any thread, unless the returned function is called
    /// before; empty = each server.wait uses a thread.
    std::function<std::function<void()>(double seconds, std::function<void()> fn)> after = {};
  };
  Conversation(ioci::Application& app, ioci::Session& session, RpcServer& server, Options options);
  /// Ends waiting requests. The reader's and the session's thread must no longer use it.
  ~Conversation();
  Conversation(const Conversation&) = delete;
  Conversation& operator=(const Conversation&) = delete;

  // --- the reader's thread ---

  /// Processes a message, without its newline.
  void take(std::string_view line);
  /// Processes a classic line; its answer is "ok VALUE" or "error CODE SENTENCE".
  void take_classic(std::string_view line);
  /// Reports a line that exceeded the length limit.
  void take_too_long();
  /// Repeats the cancellation of a request, which may have begun only after the first; returns
  /// whether it is still running, so that this must be called again.
  bool cancel_again();

  // --- the session's thread ---

  /// Runs the next request; false if there is none.
  bool run_next();

  // --- any thread ---

  [[nodiscard]] bool has_next() const;
  [[nodiscard]] std::size_t waiting() const;        ///< requests
  [[nodiscard]] std::size_t waiting_bytes() const;  ///< of their lines
  /// Start time of the running request; nullopt if there is none.
  [[nodiscard]] std::optional<Clock::time_point> running_since() const;
  /// True if the session's last interrupt came from rpc.cancel; resets it.
  [[nodiscard]] bool was_cancelled();

 private:
  struct Entry {
    Value message{};
    std::optional<std::string> answer{};   ///< ready answer of an invalid message
    std::optional<std::string> classic{};  ///< a line of the 2006 program
    std::size_t bytes = 0;
  };
  /// Forwards reports of jobs as long as it lives.
  struct Gate {
    std::mutex mutex;
    Conversation* conversation = nullptr;  // guarded by mutex
  };
  void copy_rights(ioci::Session& to) const;
  void put(Entry entry);
  void wait_for_job(Value request);
  void wait_on_a_thread(Value request, bool is_admitted);
  [[nodiscard]] std::optional<std::uint64_t> running_job(const Value& request) const;
  [[nodiscard]] bool is_over(std::uint64_t job) const;
  void job_over(std::uint64_t job);
  void wait_for_signal(Value request);
  void refuse_wait(const Value& request) const;
  void signal_late(std::uint64_t number, double seconds);
  void signal_told(std::uint64_t number, Result<Value> outcome);
  void cancel(const Map& message);
  void watch(std::uint64_t job);
  void report(const JobStatus& s);
  [[nodiscard]] std::string run_classic(const std::string& line);

  ioci::Application& app_;
  ioci::Session& session_;
  RpcServer& server_;
  const Options options_;
  const std::shared_ptr<SignalWaits> signal_waits_;
  ioci::Session beside_;  ///< of the same user, for requests about jobs on the reader's thread
  const std::shared_ptr<Gate> gate_ = std::make_shared<Gate>();
  std::uint64_t watching_ = 0;  ///< subscription to jobs; 0 = none yet. The session's thread
  std::uint64_t awaiting_ = 0;  ///< another one, for job.wait. The reader's thread
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  // Guarded by mutex_:
  std::deque<Entry> inbox_;
  std::size_t inbox_bytes_ = 0;
  std::optional<Value> running_, cancelling_;  ///< ids
  std::optional<Clock::time_point> since_;
  bool was_cancelled_ = false;
  struct SignalWait {
    Value id;                ///< of the request
    std::uint64_t wait = 0;  ///< in SignalWaits; 0 = not registered yet
    SignalWish wish;
    std::function<void()> stop = {};  ///< its timer
  };
  struct JobWait {
    Value request;
    std::uint64_t job = 0;
  };
  std::map<std::uint64_t, SignalWait> signals_;
  std::list<JobWait> job_waits_;  ///< waits for running jobs, without a thread each
  std::uint64_t next_signal_ = 1;
  std::list<ioci::Session> waits_;  ///< of the same user, each for a wait that is on a thread
  std::map<std::uint64_t, Clock::time_point> watched_;  ///< jobs: when they were last reported
};

/// Cuts bytes into lines. [one thread]
class Lines {
 public:
  explicit Lines(std::size_t longest) : longest_(longest) {}
  /// Calls line(text) for each complete line, without its newline, and too_long() once for each
  /// line longer than `longest`, which is skipped; they return whether to continue. Returns false
  /// if one returned false, leaving the following bytes unread.
  bool feed(std::string_view bytes, const std::function<bool(std::string_view)>& line,
            const std::function<bool()>& too_long);
  /// A last line without newline, at the end of input.
  [[nodiscard]] std::string rest() { return is_skipping_ ? std::string() : std::move(buffer_); }
  /// True in the middle of a line.
  [[nodiscard]] bool is_within() const { return is_skipping_ || !buffer_.empty(); }
  void set_longest(std::size_t bytes) { longest_ = bytes; }

 private:
  std::size_t longest_;
  std::string buffer_;
  bool is_skipping_ = false;  ///< within a line that was too long
};

}  // namespace robomosp::remote
