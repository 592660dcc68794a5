// SPDX-License-Identifier: Apache-2.0
// Server: many clients of one program, over TCP and Unix sockets, with TLS for other machines
// (layer: application, remote).
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

/// Version of the protocol, sent by hello.
inline constexpr int kProtocol = 1;

struct ServerOptions {
  std::vector<Address> addresses;          ///< empty = 127.0.0.1:7007
  std::filesystem::path certificate, key;  ///< PEM; empty = no TLS
  std::filesystem::path token_file;        ///< empty = the user's default
  bool needs_token = false;                ///< also on addresses of this machine
  bool tls_everywhere = false;             ///< also on addresses of this machine
  Rights without_token;                    ///< of clients that need no token
  Limits limits;
  bool browser = false;              ///< serves the page, and WebSockets, on the same ports
  std::vector<std::string> origins;  ///< further origins of pages that may connect
  std::filesystem::path audit;       ///< file for one line per request; empty = none
};

struct ClientInfo {
  std::uint64_t number = 0;   ///< of the connection, counted from 1
  std::uint64_t session = 0;  ///< 0 before its first command
  std::string name;           ///< given by the client
  std::string token;          ///< "" = none
  std::string peer;           ///< "127.0.0.1:51234", "unix"
  std::string protocol;       ///< "json", "classic", "websocket", "" before hello
  bool has_tls = false;
  double seconds = 0;  ///< since it connected
  std::uint64_t requests = 0, bytes_in = 0, bytes_out = 0;
  std::size_t waiting = 0;  ///< requests
};

/// Listens from start() until its destruction. [any thread] unless marked
class Server {
 public:
  /// Refuses access from the network without TLS and a token.
  static Result<std::unique_ptr<Server>> start(ioci::Application& app, ServerOptions options);
  /// Notifies its clients, ends their requests and waits for these. Must not be called by a
  /// client's command.
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  /// The addresses, with the ports chosen by the system.
  [[nodiscard]] std::vector<Address> addresses() const;
  [[nodiscard]] std::vector<ClientInfo> clients() const;
  /// Closes a connection with a reason; false if the number is unknown.
  bool kick(std::uint64_t number, const std::string& reason);
  /// Closes the connections of a token; returns their number.
  std::size_t kick_token(std::string_view token, const std::string& reason);
  [[nodiscard]] const std::filesystem::path& tokens_file() const;
  [[nodiscard]] const ServerOptions& options() const;
  [[nodiscard]] std::size_t threads() const;

  class Impl;  ///< shared with the connections

 private:
  explicit Server(std::shared_ptr<Impl> impl) : impl_(std::move(impl)) {}
  std::shared_ptr<Impl> impl_;
};

/// The server started by server.start. Kept with the application.
class Servers {
 public:
  explicit Servers(ioci::Application& app) : app_(app) {}
  /// ErrorCode::conflict if one is running.
  Result<void> start(ServerOptions options);
  /// Returns and clears the running server, which ends with its last pointer; null if none is
  /// running.
  [[nodiscard]] std::shared_ptr<Server> release();
  /// Null = none is running; the server lives as long as the pointer.
  [[nodiscard]] std::shared_ptr<Server> running() const;

 private:
  ioci::Application& app_;
  mutable std::mutex mutex_;
  std::shared_ptr<Server> server_;  // guarded by mutex_
};

}  // namespace robomosp::remote
