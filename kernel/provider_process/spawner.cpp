// SPDX-License-Identifier: Apache-2.0
#include "kernel/provider_process/spawner.h"

#include <condition_variable>
#include <csignal>
#include <cstring>
#include <deque>
#include <future>
#include <mutex>
#include <thread>
#include <utility>

#include "kernel/text.h"

#include <spawn.h>
#include <unistd.h>

extern char** environ;

namespace robomosp::apart {
namespace {

Result<int> start(std::vector<std::string>& words, int in, int out) {
  std::vector<char*> argv;
  for (std::string& w : words) argv.push_back(w.data());
  argv.push_back(nullptr);
  posix_spawn_file_actions_t files;
  posix_spawnattr_t attributes;
  ::posix_spawn_file_actions_init(&files);
  ::posix_spawnattr_init(&attributes);
  ::posix_spawn_file_actions_adddup2(&files, in, 0);
  ::posix_spawn_file_actions_adddup2(&files, out, 1);
  ::posix_spawn_file_actions_adddup2(&files, out, 2);
  sigset_t none, all;
  ::sigemptyset(&none);
  ::sigfillset(&all);
  ::posix_spawnattr_setsigmask(&attributes, &none);
  ::posix_spawnattr_setsigdefault(&attributes, &all);
  ::posix_spawnattr_setpgroup(&attributes, 0);  // Ctrl-C at a terminal is the program's
  ::posix_spawnattr_setflags(
      &attributes, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF | POSIX_SPAWN_SETPGROUP);
  pid_t pid = -1;
  const int failed = ::posix_spawn(&pid, argv[0], &files, &attributes, argv.data(), environ);
  ::posix_spawnattr_destroy(&attributes);
  ::posix_spawn_file_actions_destroy(&files);
  if (failed == 0) return static_cast<int>(pid);
  return error(failed == ENOENT ? ErrorCode::not_found : ErrorCode::io,
               "the program " + text::quote(words[0]) + ", which runs plugins in processes of " +
                   "their own, cannot be started: " + std::strerror(failed),
               failed == ENOENT ? "Install the program again; it is a part of it."
                                : "Close other programs, or raise the limits of the system.");
}

class Spawner {
 public:
  static Spawner& of_process() {
    static Spawner one;
    return one;
  }
  Result<int> spawn(std::vector<std::string> words, int in, int out) {
    Order order{std::move(words), in, out, {}};
    auto done = order.done.get_future();
    {
      const std::lock_guard lock(mutex_);
      if (!thread_.joinable()) thread_ = std::thread([this] { work(); });
      orders_.push_back(std::move(order));
    }
    wake_.notify_one();
    return done.get();
  }
  ~Spawner() {
    {
      const std::lock_guard lock(mutex_);
      is_ending_ = true;
    }
    wake_.notify_one();
    if (thread_.joinable()) thread_.join();
  }

 private:
  struct Order {
    std::vector<std::string> words;
    int in, out;
    std::promise<Result<int>> done;
  };
  void work() {
    for (;;) {
      std::unique_lock lock(mutex_);
      wake_.wait(lock, [this] { return is_ending_ || !orders_.empty(); });
      if (orders_.empty()) return;
      Order order = std::move(orders_.front());
      orders_.pop_front();
      lock.unlock();
      order.done.set_value(start(order.words, order.in, order.out));
    }
  }
  std::mutex mutex_;
  std::condition_variable wake_;
  std::deque<Order> orders_;  // guarded by mutex_
  bool is_ending_ = false;    // guarded by mutex_
  std::thread thread_;        // guarded by mutex_
};

}  // namespace

Result<int> spawn_for_good(std::vector<std::string> words, int in, int out) {
  return Spawner::of_process().spawn(std::move(words), in, out);
}

}  // namespace robomosp::apart
