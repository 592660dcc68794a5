// SPDX-License-Identifier: Apache-2.0
// Browser access of a server: the page, and a WebSocket that carries the lines of the protocol;
// independent of sockets, like tls.h (layer: application, remote).
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <robomosp/sdk/result.h>

#include "remote/address.h"
#include "remote/http.h"
#include "remote/websocket.h"

namespace robomosp::remote {

/// Access rules and served files. Constant while connections use it. [any thread]
struct WebRules {
  /// Origins in addition to the server's own, "https://robots.example"; their hosts are also its
  /// names. ErrorCode::invalid_argument names an invalid one.
  [[nodiscard]] static Result<WebRules> make(const std::vector<std::string>& origins,
                                             const std::vector<Address>& addresses);
  /// True if a page may use this host name: a numeric address, localhost, or a name of the server.
  /// Any other name may have been pointed here by its owner (DNS rebinding).
  [[nodiscard]] bool is_own_host(std::string_view host) const;
  /// True if a page of this origin may connect to this host. Requests without an origin are not
  /// from pages.
  [[nodiscard]] bool is_own_origin(const std::string* origin, std::string_view host,
                                   bool has_tls) const;

  std::vector<std::string> origins;  ///< in lower case
  std::vector<std::string> hosts;    ///< names without port, in lower case
};

/// One connection of a browser: a request and its response, or a WebSocket. [one thread at a time]
/// unless marked
class WebDoor {
 public:
  WebDoor(const WebRules& rules, bool has_tls, std::size_t longest);
  struct Sinks {
    std::function<bool(std::string_view line)> line;  ///< false: stop reading
    std::function<bool()> too_long;                   ///< a skipped line; the same
    std::function<void(std::string bytes)> send;      ///< to the network, unchanged
  };
  /// Processes network bytes. False if the connection ends after everything is sent.
  bool feed(std::string_view bytes, const Sinks& sinks);
  /// True if lines may be sent: the handshake is complete.
  [[nodiscard]] bool is_socket() const { return is_socket_; }
  /// Status of the response, 0 before; 101 = the handshake is complete.
  [[nodiscard]] int status() const { return status_; }
  [[nodiscard]] bool is_within() const { return reader_.is_within(); }
  void set_longest(std::size_t bytes) { reader_.set_longest(bytes); }

 private:
  [[nodiscard]] std::string answer(const HttpRequest& request);

  const WebRules& rules_;
  const bool has_tls_;
  HttpHead head_;
  WebSocketReader reader_;
  bool is_socket_ = false;
  int status_ = 0;
};

}  // namespace robomosp::remote
