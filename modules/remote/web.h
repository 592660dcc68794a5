// SPDX-License-Identifier: Apache-2.0
// What a browser finds at a server's door: the page, and a WebSocket that carries the lines of the
// protocol; apart from sockets, as tls.h is (layer: application, remote).
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

/// Who may come, and what is served. It stays as it is while connections use it. [any thread]
struct WebRules {
  /// Origins beside the server's own, "https://robots.example"; their hosts are its names, too.
  /// ErrorCode::invalid_argument says which is none.
  [[nodiscard]] static Result<WebRules> make(const std::vector<std::string>& origins,
                                             const std::vector<Address>& addresses);
  /// Whether a page may have asked for this host: an address in digits, localhost, or a name of
  /// the server. Any other name is one that its owner has pointed here (DNS rebinding).
  [[nodiscard]] bool is_own_host(std::string_view host) const;
  /// Whether a page of this origin may connect to this host. Without an origin it is no page.
  [[nodiscard]] bool is_own_origin(const std::string* origin, std::string_view host,
                                   bool has_tls) const;

  std::vector<std::string> origins;  ///< in lower case
  std::vector<std::string> hosts;    ///< names without port, in lower case
};

/// One connection of a browser: a request, then its answer and the end, or a WebSocket. [one thread
/// at a time] unless marked
class WebDoor {
 public:
  WebDoor(const WebRules& rules, bool has_tls, std::size_t longest);
  struct Sinks {
    std::function<bool(std::string_view line)> line;  ///< false: no more is read
    std::function<bool()> too_long;                   ///< a line that is skipped; the same
    std::function<void(std::string bytes)> send;      ///< to the network, as they are
  };
  /// Takes bytes of the network. False when the connection ends once all is sent.
  bool feed(std::string_view bytes, const Sinks& sinks);
  /// Whether lines may be sent: the handshake is done.
  [[nodiscard]] bool is_socket() const { return is_socket_; }
  /// Of the answer to the request, 0 before; 101 = the handshake is done.
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
