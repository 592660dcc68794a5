// SPDX-License-Identifier: Apache-2.0
// A robot controller connected by RTDE, and its states (layer: plugin).
#pragma once

#include <chrono>
#include <csignal>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "../log.h"
#include "protocol.h"

namespace robomosp::bridges::rtde {

struct ControllerWish {
  std::string host;
  int port = kPort;
  double frequency = 125;              ///< of data packages [Hz]
  std::vector<std::string> variables;  ///< the time first, a DOUBLE
  std::vector<std::size_t> entries;    ///< required entries of each; 0 = any number
};

/// Keeps a connection: reads until `stop`, reconnects at most every 10 s. Only reads: inputs of the
/// controller are never set up.
class Controller {
 public:
  /// One data package: the numbers of all variables, one after the other.
  using OnState = std::function<void(std::vector<double>)>;
  Controller(ControllerWish wish, OnState on_state, Log& log,
             const volatile std::sig_atomic_t* stop)
      : wish_(std::move(wish)), on_state_(std::move(on_state)), log_(log), stop_(stop) {}
  ~Controller() { close(); }
  Controller(const Controller&) = delete;
  Controller& operator=(const Controller&) = delete;

  /// Returns after a stop.
  void run();

 private:
  using Clock = std::chrono::steady_clock;
  /// Runs one connection to its end; returns the reason, "" = stopped. `worked` if data arrived.
  std::string session(bool& worked);
  std::string connect();
  std::string negotiate(Recipe& recipe, std::vector<Type>& types);
  bool send(std::string_view bytes);
  /// Waits for bytes; returns the fault, "" = none.
  std::string receive(Clock::time_point until);
  /// The answer of this kind; text messages of the controller that arrive before it are logged.
  std::string answer(Package kind, std::string& content);
  void say_message(std::string_view content);
  void close();

  ControllerWish wish_;
  OnState on_state_;
  Log& log_;
  const volatile std::sig_atomic_t* stop_;
  Reader reader_;
  int fd_ = -1;
};

}  // namespace robomosp::bridges::rtde
