// SPDX-License-Identifier: Apache-2.0
// The loop of JSON-RPC over two descriptors: one thread reads for as long as there is input, the
// session's thread answers in order, and what is about jobs is answered beside it.
#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>

#include "kernel/call_queue.h"
#include "kernel/executor.h"
#include "kernel/text.h"
#include "shell/json.h"
#include "shell/rpc.h"

namespace robomosp::shell {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

/// How often the session's thread looks for an interrupt, and for the end of the program.
constexpr auto kLook = 50ms;
/// How often a request that is to end is told so again until it ends.
constexpr int kAgain = 20;  // ms
/// Least time between two notifications of one job.
constexpr auto kProgressEvery = 100ms;

bool write_all(int fd, std::string_view text) {
  while (!text.empty()) {
    const ssize_t n = ::write(fd, text.data(), text.size());
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return false;
    text.remove_prefix(static_cast<std::size_t>(n));
  }
  return true;
}

class Connection {
 public:
  Connection(ioci::Application& app, ioci::Session& session, RpcServer& server, int in, int out)
      : app_(app),
        session_(session),
        server_(server),
        in_(in),
        out_(out),
        beside_(session.name(), session.kind()) {
    copy_rights(beside_);
    server_.watch = [this](std::uint64_t job) { watch(job); };
    gate_->connection = this;
  }
  ~Connection() {
    server_.watch = {};
    ::close(wake_);
  }
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  int run() {
    const std::uint64_t watching = app_.jobs.subscribe([gate = gate_](const JobStatus& s) {
      const std::lock_guard lock(gate->mutex);
      if (gate->connection) gate->connection->report(s);
    });
    std::thread reader([this] { read_all(); });
    const int code = work();
    const std::uint64_t one = 1;
    (void)!::write(wake_, &one, sizeof one);
    reader.join();
    app_.jobs.unsubscribe(watching);
    {
      const std::lock_guard lock(gate_->mutex);
      gate_->connection = nullptr;
    }
    std::unique_lock lock(mutex_);
    for (ioci::Session& waiting : waits_) waiting.interrupt();
    wait_serving(lock, changed_, [this] { return waits_.empty(); });
    return code;
  }

 private:
  struct Entry {
    Value message;
    std::optional<std::string> answer;  ///< of what is no message
  };

  /// For a session of the same user.
  void copy_rights(ioci::Session& to) const {
    for (const Effect e : session_.denied().list()) to.deny(e);
  }
  void say(std::string text) {
    text += '\n';
    const std::lock_guard lock(write_mutex_);
    if (!write_all(out_, text)) is_broken_ = true;
  }

  // --- the session's thread ---

  int work() {
    for (;;) {
      Entry next;
      {
        std::unique_lock lock(mutex_);
        running_.reset();
        const bool has =
            wait_serving(lock, changed_, kLook, [this] { return !inbox_.empty() || is_over_; });
        if (app_.quit_requested) return 0;
        const bool was_cancelled = std::exchange(was_cancelled_, false);
        if (session_.interrupted() && !was_cancelled) return 130;
        session_.clear_interrupt();
        if (is_broken_) return 1;
        if (!has) continue;
        if (inbox_.empty()) return failed_ ? 1 : 0;
        next = std::move(inbox_.front());
        inbox_.pop_front();
        if (const Map* m = next.message.as_map())
          if (const Value* id = m->find("id")) running_ = *id;
      }
      auto text = next.answer ? std::move(next.answer) : server_.answer(next.message);
      if (text) say(std::move(*text));
      if (app_.quit_requested) return 0;
    }
  }

  // --- the reader's thread ---

  void read_all() {
    std::string buffer;
    bool is_skipping = false;  // within a line that was too long
    std::vector<char> chunk(1 << 16);
    for (;;) {
      pollfd ready[2]{{in_, POLLIN, 0}, {wake_, POLLIN, 0}};
      const int n = ::poll(ready, 2, cancel_again() ? kAgain : -1);
      if (n == 0 || (n < 0 && errno == EINTR)) continue;
      if (n < 0) return over(true);
      if (ready[1].revents != 0) return;
      const ssize_t got = ::read(in_, chunk.data(), chunk.size());
      if (got < 0 && errno == EINTR) continue;
      if (got <= 0) break;
      std::string_view fresh(chunk.data(), static_cast<std::size_t>(got));
      while (!fresh.empty()) {
        const auto newline = fresh.find('\n');
        const std::string_view piece = fresh.substr(0, newline);
        if (!is_skipping) {
          if (buffer.size() + piece.size() > kLongestLine) {
            is_skipping = true;
            buffer.clear();
            put({{}, RpcServer::too_long()});
          } else {
            buffer.append(piece);
          }
        }
        if (newline == std::string_view::npos) break;
        fresh.remove_prefix(newline + 1);
        if (!std::exchange(is_skipping, false)) take(buffer);
        buffer.clear();
      }
    }
    if (!is_skipping) take(buffer);  // a last line without newline
    over(false);
  }

  void over(bool has_failed) {
    const std::lock_guard lock(mutex_);
    is_over_ = true;
    failed_ = has_failed;
    changed_.notify_all();
  }

  void put(Entry entry) {
    {
      const std::lock_guard lock(mutex_);
      inbox_.push_back(std::move(entry));
    }
    changed_.notify_all();  // who wakes finds the mutex free
  }

  void take(std::string_view line) {
    line = text::trim(line);
    if (line.empty()) return;
    auto message = from_json(line);
    if (!message.ok()) return put({{}, RpcServer::not_json(message.error())});
    const Map* m = message->as_map();
    const Value* method = m ? m->find("method") : nullptr;
    const std::string* name = method ? method->as_string() : nullptr;
    if (name && *name == "rpc.cancel") return cancel(*m);
    if (!name || !name->starts_with("job.") || m->find("job"))
      return put({std::move(*message), {}});
    if (*name != "job.wait") {
      if (const auto text = server_.answer_beside(*message, beside_)) say(*text);
      return;
    }
    // A session belongs to one thread, so each that waits gets its own.
    const auto own = [&] {
      const std::lock_guard lock(mutex_);
      return waits_.emplace(waits_.end(), session_.name(), session_.kind());
    }();
    copy_rights(*own);
    Executor::of_process().run([this, own, request = std::move(*message)] {
      if (const auto text = server_.answer_beside(request, *own)) say(*text);
      const std::lock_guard lock(mutex_);
      waits_.erase(own);
      changed_.notify_all();
    });
  }

  /// rpc.cancel {"request": id}: ends the request that runs, or takes back one that waits its turn.
  void cancel(const Map& message) {
    const Value* id = message.find("id");
    const Value* params = message.find("params");
    const Value* request = params && params->as_map() ? params->as_map()->find("request") : nullptr;
    if (!request) {
      if (id)
        say(RpcServer::failure(
            *id, error(ErrorCode::invalid_argument, "rpc.cancel needs the id of a request",
                       "Send {\"request\": 7}.")));
      return;
    }
    bool found = false;
    std::optional<Value> dropped;
    {
      const std::lock_guard lock(mutex_);
      if (running_ && *running_ == *request) {
        found = was_cancelled_ = true;
        cancelling_ = *request;
        session_.interrupt();
      }
      const auto waits = [&](const Entry& e) {
        const Map* m = e.message.as_map();
        const Value* own = m ? m->find("id") : nullptr;
        return own && *own == *request;
      };
      if (const auto it = std::find_if(inbox_.begin(), inbox_.end(), waits);
          !found && it != inbox_.end()) {
        found = true;
        dropped = *request;
        inbox_.erase(it);
      }
    }
    if (dropped)
      say(RpcServer::failure(*dropped, error(ErrorCode::cancelled, "the request was cancelled")));
    if (id) say(server_.success(*id, Value(found)));
  }

  /// Whether a request that was cancelled still runs; it may have begun only after the request.
  bool cancel_again() {
    const std::lock_guard lock(mutex_);
    if (!cancelling_) return false;
    if (!running_ || *running_ != *cancelling_) {
      cancelling_.reset();
      return false;
    }
    was_cancelled_ = true;
    session_.interrupt();
    return true;
  }

  // --- any thread ---

  void watch(std::uint64_t job) {
    {
      const std::lock_guard lock(mutex_);
      watched_[job] = {};
    }
    // It may have ended in between.
    if (const auto now = app_.jobs.status(job); now.ok()) report(*now);
  }

  void report(const JobStatus& s) {
    const bool is_over = s.state != JobState::waiting && s.state != JobState::running;
    {
      const std::lock_guard lock(mutex_);
      const auto it = watched_.find(s.id);
      if (it == watched_.end()) return;
      const auto now = Clock::now();
      if (!is_over && now - it->second < kProgressEvery) return;
      it->second = now;
      if (is_over) watched_.erase(it);
    }
    say(R"({"jsonrpc":"2.0","method":"job.progress","params":)" +
        to_json(Map{{"id", Handle{"job", s.id}},
                    {"state", to_string(s.state)},
                    {"fraction", s.fraction},
                    {"what", s.what}},
                [&s](const Handle&) { return s.label; }) +
        "}");
  }

  ioci::Application& app_;
  ioci::Session& session_;
  RpcServer& server_;
  const int in_, out_;
  const int wake_ = ::eventfd(0, EFD_CLOEXEC);  ///< ends the reader
  ioci::Session beside_;  ///< of the same user, for what the reader's thread answers about jobs
  /// Through which jobs report for as long as this lives.
  struct Gate {
    std::mutex mutex;
    Connection* connection = nullptr;  // guarded by mutex
  };
  const std::shared_ptr<Gate> gate_ = std::make_shared<Gate>();
  std::mutex write_mutex_;
  std::atomic<bool> is_broken_{false};  ///< nobody reads the answers
  std::mutex mutex_;
  std::condition_variable changed_;
  // Guarded by mutex_:
  std::deque<Entry> inbox_;
  std::optional<Value> running_, cancelling_;  ///< ids
  bool was_cancelled_ = false;                 ///< the interrupt of the session was rpc.cancel's
  bool is_over_ = false, failed_ = false;
  std::list<ioci::Session> waits_;  ///< of the same user, each for a job.wait that waits
  std::map<std::uint64_t, Clock::time_point> watched_;  ///< jobs: when they were last reported
};

}  // namespace

int serve(ioci::Application& app, ioci::Session& session, RpcServer& server, int in, int out) {
  return Connection(app, session, server, in, out).run();
}

}  // namespace robomosp::shell
