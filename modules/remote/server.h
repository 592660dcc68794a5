// SPDX-License-Identifier: Apache-2.0
// Server: many clients on one program, over TCP and Unix sockets, with TLS where the network is not
// this machine (layer: application, remote).
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include <robomosp/sdk/result.h>

#include "ioci/core/application.h"
#include "remote/address.h"
#include "remote/limits.h"
#include "remote/tokens.h"

namespace robomosp::remote {

/// Version of the protocol, which hello names.
inline constexpr int kProtocol = 1;

struct ServerOptions {
  std::vector<Address> addresses;          ///< empty = 127.0.0.1:7007
  std::filesystem::path certificate, key;  ///< PEM; empty = no TLS
  std::filesystem::path token_file;        ///< empty = the usual one of the user
  bool needs_token = false;                ///< also on addresses of this machine
  bool tls_everywhere = false;             ///< also on addresses of this machine
  Rights without_token;                    ///< of who needs none
  Limits limits;
  bool browser = false;              ///< serves the page, and WebSockets, on the same ports
  std::vector<std::string> origins;  ///< of pages from elsewhere that may connect
  std::filesystem::path audit;       ///< a line a request is added; empty = none
};

struct ClientInfo {
  std::uint64_t number = 0;   ///< of the connection, counted from 1
  std::uint64_t session = 0;  ///< 0 before its first command
  std::string name;           ///< as it says
  std::string token;          ///< "" = without
  std::string peer;           ///< "127.0.0.1:51234", "unix"
  std::string protocol;       ///< "json", "classic", "websocket", "" before hello
  bool has_tls = false;
  double seconds = 0;  ///< since it connected
  std::uint64_t requests = 0, bytes_in = 0, bytes_out = 0;
  std::size_t waiting = 0;  ///< requests
};

/// Listens from start() until it is destroyed. [any thread] unless marked
class Server {
 public:
  /// Refuses what would be open to the network without TLS and a token.
  static Result<std::unique_ptr<Server>> start(ioci::Application& app, ServerOptions options);
  /// Says goodbye to its clients, ends what they run and waits for that. Not by a command of a
  /// client.
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  /// Where it listens, with the ports that the system chose.
  [[nodiscard]] std::vector<Address> addresses() const;
  [[nodiscard]] std::vector<ClientInfo> clients() const;
  /// Closes a connection with a sentence; false when there is none of that number.
  bool kick(std::uint64_t number, const std::string& reason);
  /// Closes the connections of a token; how many.
  std::size_t kick_token(std::string_view token, const std::string& reason);
  [[nodiscard]] const std::filesystem::path& tokens_file() const;
  [[nodiscard]] const ServerOptions& options() const;
  [[nodiscard]] std::size_t threads() const;

  class Impl;  ///< shared with the connections

 private:
  explicit Server(std::shared_ptr<Impl> impl) : impl_(std::move(impl)) {}
  std::shared_ptr<Impl> impl_;
};

/// What a program serves: the servers that server.start began. Kept with the application.
class Servers {
 public:
  explicit Servers(ioci::Application& app) : app_(app) {}
  /// ErrorCode::conflict when one runs.
  Result<void> start(ServerOptions options);
  /// Takes the one that runs out, which ends when it is let go of; null when none runs.
  [[nodiscard]] std::shared_ptr<Server> release();
  /// Null = none runs; it stays while the pointer is held.
  [[nodiscard]] std::shared_ptr<Server> running() const;

 private:
  ioci::Application& app_;
  mutable std::mutex mutex_;
  std::shared_ptr<Server> server_;  // guarded by mutex_
};

}  // namespace robomosp::remote
