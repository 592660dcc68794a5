// SPDX-License-Identifier: Apache-2.0
// SignalWaits: clients that wait until a signal of a world has a value (layer: application,
// remote).
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include <robomosp/sdk/result.h>

#include "ioci/core/application.h"
#include "kernel/value.h"

namespace robomosp::remote {

struct SignalWish {
  enum class Is : std::uint8_t { equal, at_least, at_most };
  WorldId world;
  std::string world_name;  ///< for messages
  std::string signal;
  Is is = Is::equal;
  double value = 1;    ///< SI
  std::string client;  ///< client that should set it; "" = any
  double absent = 5;   ///< longest time without a connected client of that name [s]
};

/// Without polling: each commit that changes a world is checked once for waits on its signals, on a
/// thread of the executor; without waits there is no cost. [any thread]
class SignalWaits {
 public:
  using Done = std::function<void(Result<Value>)>;
  /// The one of the program. Its holders may keep it longer than the program lives.
  [[nodiscard]] static std::shared_ptr<SignalWaits> of(ioci::Application& app);
  explicit SignalWaits(ioci::Application& app);
  ~SignalWaits();
  SignalWaits(const SignalWaits&) = delete;
  SignalWaits& operator=(const SignalWaits&) = delete;

  /// The value if it matches now; an error if it never will; nullopt = not yet.
  [[nodiscard]] std::optional<Result<Value>> look(const SignalWish& wish) const;
  /// Called if the client of a wait is not connected; call check_absent() after wish.absent.
  using Away = std::function<void(std::uint64_t wait)>;
  /// Calls `done` once with the result of look(), on any thread or before this returns; `away` may
  /// be called repeatedly.
  std::uint64_t begin(SignalWish wish, Done done, Away away);
  /// Ends the wait if its client has been absent too long.
  void check_absent(std::uint64_t wait);
  /// False if `done` was called, or is about to be.
  bool end(std::uint64_t wait);
  /// Reports that a client connected or disconnected.
  void client_came(const std::string& name);
  void client_gone(const std::string& name);
  /// The error of a timeout after this many seconds.
  [[nodiscard]] Error late(const SignalWish& wish, double seconds) const;
  /// Called when the program ends; no callbacks follow.
  void close();

 private:
  struct State;
  std::shared_ptr<State> state_;
};

/// During its lifetime, server.wait on this thread stores its wish here instead of waiting, or may
/// wait although the thread is a client's. Elsewhere a client's wait is refused, since it would
/// block others.
class DeferredWait {
 public:
  DeferredWait();
  ~DeferredWait();
  DeferredWait(const DeferredWait&) = delete;
  DeferredWait& operator=(const DeferredWait&) = delete;
  [[nodiscard]] static DeferredWait* of_this_thread();
  std::optional<SignalWish> wish{};
  double seconds = 0;
  bool may_block = false;

 private:
  DeferredWait* before_;
};

}  // namespace robomosp::remote
