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
#include <fstream>
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

  /// From now on, if the GUI thread does not return to its loop for `seconds`, apart from time in
  /// which it waits for a processor, its stack is printed and the hang counts. [GUI thread]
  void start_watchdog(double seconds) {
    gui_ = pthread_self();
    std::signal(SIGUSR2, [](int) {
      std::array<void*, 64> frames{};
      backtrace_symbols_fd(frames.data(), backtrace(frames.data(), 64), STDERR_FILENO);
    });
    // Loads what backtrace() needs outside of a signal handler.
    std::array<void*, 2> frames{};
    (void)backtrace(frames.data(), 2);
    waited_file_ = "/proc/self/task/" + std::to_string(gettid()) + "/schedstat";
    watchdog_ = std::thread([this, seconds] {
      double seen = 0, waited_before = 0, reported = 0;
      while (!is_ending_) {
        std::this_thread::sleep_for(std::chrono::milliseconds(50));
        const double last = beat_.load(), waited = waited_for_processor();
        if (last != seen) {
          seen = last;
          waited_before = waited;
        }
        // What others use of the processors is no fault of this program.
        const double busy = seconds_of(CLOCK_MONOTONIC) - last - (waited - waited_before);
        if (busy < seconds || last == reported || !is_within_) continue;
        reported = last;
        ++hangs_;
        std::fprintf(stderr, "The GUI thread has been busy or blocked for %.1f s in an event:\n",
                     busy);
        pthread_kill(gui_, SIGUSR2);
        std::this_thread::sleep_for(std::chrono::milliseconds(100));
      }
    });
  }
  void stop_watchdog() {
    is_ending_ = true;
    if (watchdog_.joinable()) watchdog_.join();
  }
  [[nodiscard]] int hangs() const { return hangs_; }

 private:
  /// Time in which the GUI thread could run, but no processor was free [s].
  [[nodiscard]] double waited_for_processor() const {
    std::ifstream file(waited_file_);
    double ran = 0, waited = 0;
    file >> ran >> waited;
    return 1e-9 * waited;
  }
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
  std::string waited_file_;
  pthread_t gui_{};
};

}  // namespace robomosp::viewer
