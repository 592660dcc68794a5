// SPDX-License-Identifier: Apache-2.0
#include "remote/web.h"

#include <arpa/inet.h>

#include <algorithm>

#include "kernel/base64.h"
#include "kernel/letters.h"
#include "kernel/text.h"
#include "remote/crypto.h"
#include "remote/web_page.h"

namespace robomosp::remote {
namespace {

constexpr std::string_view kSocketPath = "/socket";

/// The host of "host", "host:80", "[::1]:80"; "" when it is none.
std::string host_of(std::string_view authority) {
  std::string_view host = authority, port;
  if (authority.starts_with('[')) {
    const auto end = authority.find(']');
    if (end == authority.npos) return {};
    host = authority.substr(0, end + 1);
    port = authority.substr(end + 1);
  } else if (const auto colon = authority.find(':'); colon != authority.npos) {
    host = authority.substr(0, colon);
    port = authority.substr(colon);
  }
  const bool is_port = port.empty() || (port.size() > 1 && port.size() <= 6 && port[0] == ':' &&
                                        std::all_of(port.begin() + 1, port.end(),
                                                    [](char c) { return c >= '0' && c <= '9'; }));
  const bool is_name =
      !host.empty() && host.size() <= 255 && std::all_of(host.begin(), host.end(), [](char c) {
        return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
               std::string_view("-._[]:").find(c) != std::string_view::npos;
      });
  return is_port && is_name ? text::lower(host) : std::string();
}

bool is_digits(const std::string& host) {
  in6_addr bytes{};
  if (host.starts_with('['))
    return ::inet_pton(AF_INET6, host.substr(1, host.size() - 2).c_str(), &bytes) == 1;
  return ::inet_pton(AF_INET, host.c_str(), &bytes) == 1;
}

struct Page {
  std::string content, policy;
};

/// The page with its policy: it runs and shows only what is in it, and connects only to where it
/// came from.
const Page& page() {
  static const Page whole = [] {
    const auto hash = [](std::string_view text) {
      std::string out = "'sha256-";
      base64::append(out, sha256_bytes(text));
      return out + "'";
    };
    const auto filled = [](std::string_view from, std::string_view name, std::string_view by) {
      const auto at = from.find(name);
      return std::string(from.substr(0, at)) + std::string(by) +
             std::string(from.substr(at + name.size()));
    };
    Page p;
    p.content = filled(filled(kWebPage, "@STYLE@", kWebStyle), "@SCRIPT@", kWebScript);
    p.policy = "Content-Security-Policy: default-src 'none'; script-src " + hash(kWebScript) +
               "; style-src " + hash(kWebStyle) +
               "; img-src data:; connect-src 'self'; base-uri 'none'; form-action 'none'; "
               "frame-ancestors 'none'\r\n";
    return p;
  }();
  return whole;
}

}  // namespace

Result<WebRules> WebRules::make(const std::vector<std::string>& origins,
                                const std::vector<Address>& addresses) {
  WebRules out;
  for (const std::string& origin : origins) {
    const std::string own = text::lower(origin);
    const std::size_t begin = own.starts_with("https://") ? 8 : own.starts_with("http://") ? 7 : 0;
    const std::string host = begin ? host_of(std::string_view(own).substr(begin)) : std::string();
    if (host.empty())
      return error(ErrorCode::invalid_argument,
                   text::quote(text::shortened(origin)) + " is not an origin of web pages",
                   "Write it as browsers do, without a path: https://robots.example", "origins");
    out.origins.push_back(own);
    out.hosts.push_back(host);
  }
  for (const Address& a : addresses)
    if (!a.is_unix && !a.host.empty()) out.hosts.push_back(text::lower(a.host));
  return out;
}

bool WebRules::is_own_host(std::string_view host) const {
  const std::string name = host_of(host);
  if (name.empty()) return false;
  return name == "localhost" || is_digits(name) ||
         std::find(hosts.begin(), hosts.end(), name) != hosts.end();
}

bool WebRules::is_own_origin(const std::string* origin, std::string_view host, bool has_tls) const {
  if (!origin) return true;
  const std::string own = text::lower(*origin);
  return own == (has_tls ? "https://" : "http://") + text::lower(host) ||
         std::find(origins.begin(), origins.end(), own) != origins.end();
}

WebDoor::WebDoor(const WebRules& rules, bool has_tls, std::size_t longest)
    : rules_(rules), has_tls_(has_tls), reader_(longest) {}

bool WebDoor::feed(std::string_view bytes, const Sinks& sinks) {
  if (is_socket_) {
    return reader_.feed(
        bytes,
        {.message = sinks.line,
         .too_long = sinks.too_long,
         .ping = [&](std::string_view content) { sinks.send(websocket_pong(content)); },
         .end = [&](WebSocketEnd code,
                    std::string_view reason) { sinks.send(websocket_close(code, reason)); }});
  }
  if (!head_.feed(bytes)) return true;
  HttpFault fault;
  const auto request = head_.read(fault);
  std::string said = request ? answer(*request) : http_answer(fault);
  status_ = std::stoi(said.substr(std::string_view("HTTP/1.1 ").size(), 3));
  sinks.send(std::move(said));
  head_ = {};
  return is_socket_;
}

std::string WebDoor::answer(const HttpRequest& request) {
  const std::string& host = *request.find("host");
  if (!rules_.is_own_host(host))
    return http_answer({421,
                        "This server does not know its name in the request. Use its "
                        "address, or start it with --origin."});
  if (request.target != kSocketPath) {
    if (request.target == "/")
      return http_answer(200, "text/html; charset=utf-8", page().policy, page().content);
    if (request.target == "/robomosp.js")
      return http_answer(200, "text/javascript; charset=utf-8", "", kWebClient);
    return http_answer({404, "There is no such page. The page is at /."});
  }
  if (!request.has_word("upgrade", "websocket") || !request.has_word("connection", "upgrade"))
    return http_answer({426, "This is a WebSocket; the page is at /."});
  const std::string* version = request.find("sec-websocket-version");
  const std::string* key = request.find("sec-websocket-key");
  if (!version || *version != "13") return http_answer({426, "The WebSocket version must be 13."});
  if (!key || !is_websocket_key(*key))
    return http_answer({400, "A WebSocket must begin with a key of 16 bytes."});
  if (!rules_.is_own_origin(request.find("origin"), host, has_tls_))
    return http_answer({403,
                        "Pages from other origins may not connect. Start the server with --origin "
                        "and the origin of this page."});
  is_socket_ = true;
  return "HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
         "Sec-WebSocket-Accept: " +
         websocket_accept(*key) + "\r\n\r\n";
}

}  // namespace robomosp::remote
