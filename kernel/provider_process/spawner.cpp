// SPDX-License-Identifier: Apache-2.0
#include "kernel/provider_process/spawner.h"

#include <cerrno>
#include <condition_variable>
#include <cstring>
#include <deque>
#include <filesystem>
#include <future>
#include <mutex>
#include <thread>
#include <utility>

#include "kernel/process.h"
#include "kernel/text.h"

namespace robomosp::apart {
namespace {

Result<int> start(const std::filesystem::path& program, std::vector<std::string> arguments, int in,
                  int out) {
  const auto [pid, failed] = start_process(program, std::move(arguments), {in, out, out});
  if (failed == 0) return pid;
  return error(failed == ENOENT ? ErrorCode::not_found : ErrorCode::io,
               "the program " + text::quote(program.string()) +
                   ", which runs plugins in processes of " +
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
  Result<int> spawn(std::filesystem::path program, std::vector<std::string> arguments, int in,
                    int out) {
    Order order{std::move(program), std::move(arguments), in, out, {}};
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
    std::filesystem::path program;
    std::vector<std::string> arguments;
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
      order.done.set_value(start(order.program, std::move(order.arguments), order.in, order.out));
    }
  }
  std::mutex mutex_;
  std::condition_variable wake_;
  std::deque<Order> orders_;  // guarded by mutex_
  bool is_ending_ = false;    // guarded by mutex_
  std::thread thread_;        // guarded by mutex_
};

}  // namespace

Result<int> spawn_for_good(std::filesystem::path program, std::vector<std::string> arguments,
                           int in, int out) {
  return Spawner::of_process().spawn(std::move(program), std::move(arguments), in, out);
}

}  // namespace robomosp::apart
