// SPDX-License-Identifier: Apache-2.0
// SignalWaits: who waits until a signal of a world has a value (layer: application, remote).
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
  std::string world_name;  ///< for sentences
  std::string signal;
  Is is = Is::equal;
  double value = 1;    ///< SI
  std::string client;  ///< who is to set it; "" = anybody
  double absent = 5;   ///< how long nobody of that name may be connected [s]
};

/// Nobody polls: each commit that changes a world is looked at once for those who wait for its
/// signals, on a thread of the executor, and nothing is done while nobody waits. [any thread]
class SignalWaits {
 public:
  using Done = std::function<void(Result<Value>)>;
  /// That of the program. Who has it may keep it longer than the program lives.
  [[nodiscard]] static std::shared_ptr<SignalWaits> of(ioci::Application& app);
  explicit SignalWaits(ioci::Application& app);
  ~SignalWaits();
  SignalWaits(const SignalWaits&) = delete;
  SignalWaits& operator=(const SignalWaits&) = delete;

  /// The value when it is as wished now; why it never will be; nullopt = not yet.
  [[nodiscard]] std::optional<Result<Value>> look(const SignalWish& wish) const;
  /// Called when the client of a wait is not there; after wish.absent check_absent() is due.
  using Away = std::function<void(std::uint64_t wait)>;
  /// `done` is called once, with what look() gives then, by any thread or before this returns; so
  /// is `away`, as often as need be.
  std::uint64_t begin(SignalWish wish, Done done, Away away);
  /// Ends the wait if its client has been away for too long.
  void check_absent(std::uint64_t wait);
  /// False when `done` has been called, or is about to be.
  bool end(std::uint64_t wait);
  /// A client has connected, or has gone.
  void client_came(const std::string& name);
  void client_gone(const std::string& name);
  /// Why a wait is over after so many seconds.
  [[nodiscard]] Error late(const SignalWish& wish, double seconds) const;
  /// The program ends; nobody is told any more.
  void close();

 private:
  struct State;
  std::shared_ptr<State> state_;
};

/// While it lives, server.wait on this thread does not wait but leaves its wish here; or may wait
/// on this thread though it is a client's. Elsewhere a client's wait is refused, as it would hold
/// up others.
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
