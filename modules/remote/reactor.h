// SPDX-License-Identifier: Apache-2.0
// Reactor: the threads that serve a server's connections. One that runs a command for long is
// replaced, so that others are answered meanwhile (layer: application, remote).
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <list>
#include <memory>
#include <mutex>
#include <thread>

#include <asio/executor_work_guard.hpp>
#include <asio/io_context.hpp>

namespace robomosp::remote {

/// Commands run on the thread that read their request, which costs no change of threads. A thread
/// that has been in one command for two looks of the watch counts as busy; then another is started,
/// up to `most`. [any thread]
class Reactor {
 public:
  explicit Reactor(std::size_t most);
  ~Reactor();  ///< stop()
  Reactor(const Reactor&) = delete;
  Reactor& operator=(const Reactor&) = delete;
  [[nodiscard]] asio::io_context& io() { return io_; }
  /// Ends the threads when what they run has ended. Not by one of them.
  void stop();
  [[nodiscard]] std::size_t threads() const;

  /// Marks that this thread runs a command while it lives. [a thread of the reactor]
  class Running {
   public:
    explicit Running(Reactor& reactor);
    ~Running();
    Running(const Running&) = delete;
    Running& operator=(const Running&) = delete;

   private:
    Reactor& reactor_;
  };

 private:
  struct Worker {
    std::thread thread;
    /// Counts up with each command, odd while one runs.
    std::atomic<std::uint64_t> count{0};
    std::uint64_t seen = 0;  ///< by the watch, when it looked last
    bool is_busy = false;    // guarded by mutex_
    std::atomic<bool> is_done{false};
  };
  void start_one();  // with mutex_ held
  void work(Worker& self);
  void watch();
  static thread_local Worker* current_;

  asio::io_context io_;
  asio::executor_work_guard<asio::io_context::executor_type> guard_;
  const std::size_t most_, wanted_;
  mutable std::mutex mutex_;
  std::condition_variable wake_;
  std::list<std::unique_ptr<Worker>> workers_;  // guarded by mutex_
  std::atomic<std::size_t> too_many_{0};        ///< threads that are to end
  std::atomic<bool> is_quiet_{true};            ///< nothing ran at the last look
  bool is_ending_ = false;                      // guarded by mutex_
  std::thread watch_;
};

}  // namespace robomosp::remote
