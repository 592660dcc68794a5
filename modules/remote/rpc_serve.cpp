// SPDX-License-Identifier: Apache-2.0
// The loop of JSON-RPC over two descriptors: one thread reads for as long as there is input, the
// session's thread answers in order.
#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <thread>
#include <vector>

#include "kernel/call_queue.h"
#include "remote/conversation.h"
#include "remote/rpc.h"

namespace robomosp::remote {
namespace {

using namespace std::chrono_literals;

/// How often the session's thread looks for an interrupt, and for the end of the program.
constexpr auto kServeLook = 50ms;
/// How often a request that is to end is told so again until it ends.
constexpr int kServeAgain = 20;  // ms

bool write_all(int fd, std::string_view text) {
  while (!text.empty()) {
    const ssize_t n = ::write(fd, text.data(), text.size());
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return false;
    text.remove_prefix(static_cast<std::size_t>(n));
  }
  return true;
}

class Pipes {
 public:
  Pipes(ioci::Application& app, ioci::Session& session, RpcServer& server, int in, int out)
      : app_(app),
        session_(session),
        in_(in),
        out_(out),
        conversation_(app, session, server,
                      {.say = [this](std::string text) { say(std::move(text)); },
                       .ready =
                           [this] {
                             { const std::lock_guard lock(mutex_); }
                             changed_.notify_all();
                           }}) {}
  ~Pipes() { ::close(wake_); }
  Pipes(const Pipes&) = delete;
  Pipes& operator=(const Pipes&) = delete;

  int run() {
    std::thread reader([this] { read_all(); });
    const int code = work();
    const std::uint64_t one = 1;
    (void)!::write(wake_, &one, sizeof one);
    reader.join();
    return code;
  }

 private:
  void say(std::string text) {
    text += '\n';
    const std::lock_guard lock(write_mutex_);
    if (!write_all(out_, text)) is_broken_ = true;
  }

  // --- the session's thread ---

  int work() {
    for (;;) {
      {
        std::unique_lock lock(mutex_);
        (void)wait_serving(lock, changed_, kServeLook,
                           [this] { return conversation_.has_next() || is_over_; });
        if (app_.quit_requested) return 0;
        const bool was_cancelled = conversation_.was_cancelled();
        if (session_.interrupted() && !was_cancelled) return 130;
        session_.clear_interrupt();
        if (is_broken_) return 1;
        if (!conversation_.has_next()) {
          if (is_over_) return failed_ ? 1 : 0;
          continue;
        }
      }
      (void)conversation_.run_next();
      if (app_.quit_requested) return 0;
    }
  }

  // --- the reader's thread ---

  void read_all() {
    Lines lines(kLongestLine);
    std::vector<char> chunk(1 << 16);
    for (;;) {
      pollfd ready[2]{{in_, POLLIN, 0}, {wake_, POLLIN, 0}};
      const int n = ::poll(ready, 2, conversation_.cancel_again() ? kServeAgain : -1);
      if (n == 0 || (n < 0 && errno == EINTR)) continue;
      if (n < 0) return over(true);
      if (ready[1].revents != 0) return;
      const ssize_t got = ::read(in_, chunk.data(), chunk.size());
      if (got < 0 && errno == EINTR) continue;
      if (got <= 0) break;
      (void)lines.feed(
          {chunk.data(), static_cast<std::size_t>(got)},
          [this](std::string_view line) {
            conversation_.take(line);
            return true;
          },
          [this] {
            conversation_.take_too_long();
            return true;
          });
    }
    conversation_.take(lines.rest());
    over(false);
  }

  void over(bool has_failed) {
    const std::lock_guard lock(mutex_);
    is_over_ = true;
    failed_ = has_failed;
    changed_.notify_all();
  }

  ioci::Application& app_;
  ioci::Session& session_;
  const int in_, out_;
  const int wake_ = ::eventfd(0, EFD_CLOEXEC);  ///< ends the reader
  std::mutex write_mutex_;
  std::atomic<bool> is_broken_{false};  ///< nobody reads the answers
  std::mutex mutex_;
  std::condition_variable changed_;
  bool is_over_ = false, failed_ = false;  // guarded by mutex_
  Conversation conversation_;
};

}  // namespace

int serve(ioci::Application& app, ioci::Session& session, RpcServer& server, int in, int out) {
  return Pipes(app, session, server, in, out).run();
}

}  // namespace robomosp::remote
