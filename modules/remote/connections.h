// SPDX-License-Identifier: Apache-2.0
// The connections of a program to others that serve (layer: application, remote).
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "ioci/core/application.h"
#include "remote/client.h"

namespace robomosp::remote {

/// The connections to other programs. Each belongs to the session that opened it. [any thread]
class Connections {
 public:
  struct Entry {
    explicit Entry(std::uint64_t of) : session(of) {}
    const std::uint64_t session;
    std::timed_mutex mutex;
    std::unique_ptr<Client> client;  // guarded by mutex
  };
  explicit Connections(ioci::Application& app) : app_(app) {}

  Result<std::int64_t> add(std::uint64_t session, std::unique_ptr<Client> client);
  /// Refuses one more than there may be; those of sessions that are gone are closed.
  Result<void> make_room();
  [[nodiscard]] std::shared_ptr<Entry> find(std::int64_t number, std::uint64_t session) const;
  void remove(std::int64_t number);
  [[nodiscard]] std::vector<std::pair<std::int64_t, std::shared_ptr<Entry>>> of(
      std::uint64_t session) const;

 private:
  ioci::Application& app_;
  mutable std::mutex mutex_;
  std::int64_t next_ = 1;                                   // guarded by mutex_
  std::map<std::int64_t, std::shared_ptr<Entry>> entries_;  // guarded by mutex_
};

/// A connection, for as long as this lives used by nobody else.
struct ConnectionUse {
  std::shared_ptr<Connections::Entry> entry{};
  std::unique_lock<std::timed_mutex> lock{};
  [[nodiscard]] Client& client() const { return *entry->client; }
};
/// That of the argument `connection`; waits for whoever uses it.
Result<ConnectionUse> use_connection(ioci::CommandContext&, const Map& args);

}  // namespace robomosp::remote
