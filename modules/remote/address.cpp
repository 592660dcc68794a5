// SPDX-License-Identifier: Apache-2.0
#include "remote/address.h"

#include <arpa/inet.h>

#include <charconv>

#include "kernel/text.h"

namespace robomosp::remote {
namespace {

constexpr std::string_view kUnix = "unix:";
/// Of sockaddr_un, with its ending zero [bytes].
constexpr std::size_t kLongestPath = 107;

Error wrong(std::string_view text, std::string why) {
  return error(ErrorCode::invalid_argument,
               text::quote(std::string(text)) + " is not an address: " + std::move(why),
               "Write 127.0.0.1:7007, [::1]:7007, HOST:PORT or unix:/path/to/socket.");
}

}  // namespace

Result<Address> Address::parse(std::string_view text) {
  Address a;
  if (text.find('\0') != std::string_view::npos) return wrong("", "it contains a zero byte");
  if (text.starts_with(kUnix)) {
    a.is_unix = true;
    a.path = text.substr(kUnix.size());
    if (a.path.empty()) return wrong(text, "the path of the socket is missing");
    if (a.path.size() > kLongestPath)
      return wrong(
          text, "the path of a socket can have at most " + std::to_string(kLongestPath) + " bytes");
    return a;
  }
  std::string_view port;
  bool has_port = false;
  if (text.starts_with('[')) {
    const auto end = text.find(']');
    if (end == std::string_view::npos) return wrong(text, "the closing ] is missing");
    a.host = text.substr(1, end - 1);
    in6_addr parsed{};
    if (::inet_pton(AF_INET6, a.host.c_str(), &parsed) != 1)
      return wrong(text, "the text in brackets is not an IPv6 address");
    const std::string_view rest = text.substr(end + 1);
    has_port = rest.starts_with(':');
    if (!rest.empty() && !has_port) return wrong(text, "behind the ] comes :PORT");
    if (has_port) port = rest.substr(1);
  } else {
    const auto colon = text.rfind(':');
    has_port = colon != std::string_view::npos;
    a.host = text.substr(0, colon);
    if (has_port) port = text.substr(colon + 1);
    if (a.host.find(':') != std::string::npos)
      return wrong(text, "an IPv6 address must be in brackets");
    if (a.host == "*") a.host.clear();
    else if (a.host.empty()) return wrong(text, "the host is missing");
    for (const char c : a.host)
      if (static_cast<unsigned char>(c) <= ' ' || static_cast<unsigned char>(c) >= 0x7f)
        return wrong(text, "a host must consist of letters, digits, dots and dashes");
  }
  if (has_port) {
    unsigned number = 0;
    const auto [end, fault] = std::from_chars(port.data(), port.data() + port.size(), number);
    if (fault != std::errc() || end != port.data() + port.size() || number > 65'535)
      return wrong(text, "a port must be a number from 0 to 65535");
    a.port = static_cast<std::uint16_t>(number);
  }
  return a;
}

std::string Address::text() const {
  if (is_unix) return std::string(kUnix) + path;
  const std::string shown = host.empty()                          ? "*"
                            : host.find(':') == std::string::npos ? host
                                                                  : "[" + host + "]";
  return shown + ":" + std::to_string(port);
}

bool Address::is_local() const {
  if (is_unix || host == "localhost") return true;
  in_addr four{};
  if (::inet_pton(AF_INET, host.c_str(), &four) == 1) return (ntohl(four.s_addr) >> 24) == 127;
  in6_addr six{};
  return ::inet_pton(AF_INET6, host.c_str(), &six) == 1 && IN6_IS_ADDR_LOOPBACK(&six) != 0;
}

}  // namespace robomosp::remote
