// SPDX-License-Identifier: Apache-2.0
// Conversation: what one client asks and is answered, whatever carries its lines (layer:
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

/// Requests wait in the order of their coming until the session's thread answers them; what is
/// about jobs (job.list, job.progress, job.wait, job.cancel) and rpc.cancel is answered at once, by
/// the thread that read it.
class Conversation {
 public:
  using Clock = std::chrono::steady_clock;
  struct Options {
    /// Sends one line, given without its newline. [any thread]
    std::function<void(std::string)> say;
    /// Called when a request came. [the reader's thread]
    std::function<void()> ready;
    std::size_t most_waits = 64;  ///< of job.wait and server.wait that wait at a time
    /// Calls `fn` after so many seconds, on any thread, unless what it gives is called before;
    /// empty = server.wait takes a thread each.
    std::function<std::function<void()>(double seconds, std::function<void()> fn)> after = {};
  };
  Conversation(ioci::Application& app, ioci::Session& session, RpcServer& server, Options options);
  /// Ends what waits. The reader's and the session's thread are done with it.
  ~Conversation();
  Conversation(const Conversation&) = delete;
  Conversation& operator=(const Conversation&) = delete;

  // --- the reader's thread ---

  /// A message, without its newline.
  void take(std::string_view line);
  /// A classic line; its answer is "ok VALUE" or "error CODE SENTENCE".
  void take_classic(std::string_view line);
  /// A line that was longer than is read.
  void take_too_long();
  /// Tells a request that is to end so again, as it may have begun only after that; whether it
  /// still runs, so that this is to be called again.
  bool cancel_again();

  // --- the session's thread ---

  /// Answers the next request; false when none waits.
  bool run_next();

  // --- any thread ---

  [[nodiscard]] bool has_next() const;
  [[nodiscard]] std::size_t waiting() const;        ///< requests
  [[nodiscard]] std::size_t waiting_bytes() const;  ///< of their lines
  /// Since when a request runs; nullopt when none does.
  [[nodiscard]] std::optional<Clock::time_point> running_since() const;
  /// Whether the session's last interrupt was rpc.cancel's; asked once.
  [[nodiscard]] bool was_cancelled();

 private:
  struct Entry {
    Value message{};
    std::optional<std::string> answer{};   ///< of what is no message
    std::optional<std::string> classic{};  ///< a line of the 2006 program
    std::size_t bytes = 0;
  };
  /// Through which jobs report for as long as this lives.
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
  ioci::Session beside_;  ///< of the same user, for what the reader's thread answers about jobs
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
    std::uint64_t wait = 0;  ///< in SignalWaits; 0 = not there yet
    SignalWish wish;
    std::function<void()> stop = {};  ///< its timer
  };
  struct JobWait {
    Value request;
    std::uint64_t job = 0;
  };
  std::map<std::uint64_t, SignalWait> signals_;
  std::list<JobWait> job_waits_;  ///< of jobs that run; no thread waits for them
  std::uint64_t next_signal_ = 1;
  std::list<ioci::Session> waits_;  ///< of the same user, each for a wait that is on a thread
  std::map<std::uint64_t, Clock::time_point> watched_;  ///< jobs: when they were last reported
};

/// Cuts bytes into lines. [one thread]
class Lines {
 public:
  explicit Lines(std::size_t longest) : longest_(longest) {}
  /// Calls line(text) for each line that is whole, without its newline, and too_long() once for
  /// each that is longer than `longest` and skipped; what they return says whether to go on.
  /// Returns false when one said no, with the bytes behind it not read.
  bool feed(std::string_view bytes, const std::function<bool(std::string_view)>& line,
            const std::function<bool()>& too_long);
  /// A last line without newline, as left behind by the end of input.
  [[nodiscard]] std::string rest() { return is_skipping_ ? std::string() : std::move(buffer_); }
  /// Whether a line has begun and is not whole.
  [[nodiscard]] bool is_within() const { return is_skipping_ || !buffer_.empty(); }
  void set_longest(std::size_t bytes) { longest_ = bytes; }

 private:
  std::size_t longest_;
  std::string buffer_;
  bool is_skipping_ = false;  ///< within a line that was too long
};

}  // namespace robomosp::remote
