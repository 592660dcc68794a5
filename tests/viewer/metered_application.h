// SPDX-License-Identifier: GPL-3.0-or-later
// MeteredApplication: a QApplication that measures how long each event holds up the GUI thread,
// and a watchdog that prints the stack of that thread if an event takes too long.
#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <ctime>
#include <map>
#include <string>
#include <thread>

#include <execinfo.h>
#include <pthread.h>
#include <unistd.h>

#include <QApplication>
#include <QEvent>
#include <QObject>

namespace robomosp::viewer {

inline double seconds_of(clockid_t clock) {
  timespec now{};
  clock_gettime(clock, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

class MeteredApplication : public QApplication {
 public:
  /// An event that was handled.
  struct Handled {
    double elapsed = 0, processor = 0;  ///< of the GUI thread [s]
    std::string receiver;               ///< its class and object name
    int type = 0;                       ///< QEvent::Type
  };
  MeteredApplication(int& argc, char** argv) : QApplication(argc, argv) { beat(); }
  ~MeteredApplication() override { stop_watchdog(); }

  bool notify(QObject* receiver, QEvent* event) override {
    if (depth_ > 0) {
      beat();  // of a loop within an event, such as a menu's
      ++depth_;
      const bool result = QApplication::notify(receiver, event);
      --depth_;
      return result;
    }
    ++depth_;
    const char* const type_name = receiver->metaObject()->className();
    const QString name = receiver->objectName();
    const int type = event->type();
    beat();
    const double begin = seconds_of(CLOCK_MONOTONIC),
                 begin_processor = seconds_of(CLOCK_THREAD_CPUTIME_ID);
    const bool result = QApplication::notify(receiver, event);
    const double elapsed = seconds_of(CLOCK_MONOTONIC) - begin,
                 processor = seconds_of(CLOCK_THREAD_CPUTIME_ID) - begin_processor;
    --depth_;
    beat();
    ++events_;
    ++by_type_[type];
    const auto keep = [&](Handled& most, bool is_more) {
      if (is_more)
        most = {elapsed, processor, std::string(type_name) + " " + name.toStdString(), type};
    };
    keep(longest_, elapsed > longest_.elapsed);
    keep(busiest_, processor > busiest_.processor);
    return result;
  }

  void reset() {
    longest_ = busiest_ = {};
    events_ = 0;
    by_type_.clear();
  }
  [[nodiscard]] const Handled& longest() const { return longest_; }  ///< by the clock
  [[nodiscard]] const Handled& busiest() const { return busiest_; }  ///< by processor time
  [[nodiscard]] std::size_t events() const { return events_; }
  [[nodiscard]] std::size_t events(QEvent::Type type) const {
    const auto at = by_type_.find(type);
    return at == by_type_.end() ? 0 : at->second;
  }
  [[nodiscard]] const std::map<int, std::size_t>& by_type() const { return by_type_; }

  /// From now on, the stack of the GUI thread is printed if it is not back in its loop after
  /// `seconds`. That is a hang once the thread itself has computed for so long, or after a minute:
  /// on a loaded machine it also waits for a processor, and for others that do. [GUI thread]
  void start_watchdog(double seconds) {
    gui_ = pthread_self();
    clockid_t processor{};
    pthread_getcpuclockid(gui_, &processor);
    std::signal(SIGUSR2, [](int) {
      std::array<void*, 64> frames{};
      backtrace_symbols_fd(frames.data(), backtrace(frames.data(), 64), STDERR_FILENO);
    });
    // Loads what backtrace() needs outside of a signal handler.
    std::array<void*, 2> frames{};
    (void)backtrace(frames.data(), 2);
    watchdog_ = std::thread([this, seconds, processor] {
      double seen = 0, used_before = 0, noted = 0, counted = 0;
      while (!is_ending_) {
        std::this_thread::sleep_for(std::chrono::milliseconds(50));
        const double last = beat_.load(), used = seconds_of(processor);
        if (last != seen) {
          seen = last;
          used_before = used;
        }
        const double lasted = seconds_of(CLOCK_MONOTONIC) - last, computed = used - used_before;
        if (lasted < seconds || !is_within_) continue;
        if (last != noted) {
          noted = last;
          std::fprintf(stderr, "Note: an event has lasted for %.1f s, and computed for %.1f s:\n",
                       lasted, computed);
          pthread_kill(gui_, SIGUSR2);
          std::this_thread::sleep_for(std::chrono::milliseconds(100));
        }
        if (last == counted || (computed < seconds && lasted < kLongest)) continue;
        counted = last;
        ++hangs_;
        std::fprintf(stderr, "It hangs: it has lasted for %.1f s, and computed for %.1f s.\n",
                     lasted, computed);
      }
    });
  }
  void stop_watchdog() {
    is_ending_ = true;
    if (watchdog_.joinable()) watchdog_.join();
  }
  [[nodiscard]] int hangs() const { return hangs_; }

 private:
  static constexpr double kLongest = 60;  ///< an event that is no hang, by the clock [s]
  void beat() {
    beat_ = seconds_of(CLOCK_MONOTONIC);
    is_within_ = depth_ > 0;
  }
  int depth_ = 0;
  Handled longest_, busiest_;
  std::size_t events_ = 0;
  std::map<int, std::size_t> by_type_;
  std::atomic<double> beat_{0};
  std::atomic<bool> is_within_{false}, is_ending_{false};
  std::atomic<int> hangs_{0};
  std::thread watchdog_;
  pthread_t gui_{};
};

}  // namespace robomosp::viewer
