// SPDX-License-Identifier: Apache-2.0
#include "remote/http.h"
#include "kernel/letters.h"

#include <algorithm>

namespace robomosp::remote {
namespace {

constexpr std::string_view kEnd = "\r\n\r\n";

/// RFC 9110, section 5.6.2.
bool is_token(std::string_view s) {
  return !s.empty() && std::all_of(s.begin(), s.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
           std::string_view("!#$%&'*+-.^_`|~").find(c) != std::string_view::npos;
  });
}

std::string_view trimmed(std::string_view s) {
  const auto first = s.find_first_not_of(" \t");
  if (first == s.npos) return {};
  return s.substr(first, s.find_last_not_of(" \t") - first + 1);
}

/// Fields that may come more than once, as they are lists.
bool is_list(std::string_view name) {
  static constexpr std::string_view kLists[] = {"accept",
                                                "accept-encoding",
                                                "accept-language",
                                                "cache-control",
                                                "connection",
                                                "cookie",
                                                "forwarded",
                                                "pragma",
                                                "sec-websocket-extensions",
                                                "sec-websocket-protocol",
                                                "via",
                                                "x-forwarded-for"};
  return std::find(std::begin(kLists), std::end(kLists), name) != std::end(kLists);
}

std::string_view reason(int status) {
  switch (status) {
    case 200: return "OK";
    case 403: return "Forbidden";
    case 404: return "Not Found";
    case 414: return "URI Too Long";
    case 421: return "Misdirected Request";
    case 426: return "Upgrade Required";
    case 431: return "Request Header Fields Too Large";
    case 505: return "HTTP Version Not Supported";
    default: return "Bad Request";
  }
}

}  // namespace

const std::string* HttpRequest::find(std::string_view name) const {
  for (const auto& [own, value] : fields)
    if (own == name) return &value;
  return nullptr;
}

bool HttpRequest::has_word(std::string_view name, std::string_view word) const {
  for (const auto& [own, value] : fields) {
    if (own != name) continue;
    for (std::string_view rest = value; !rest.empty();) {
      const auto comma = rest.find(',');
      if (text::lower(trimmed(rest.substr(0, comma))) == word) return true;
      rest = comma == rest.npos ? std::string_view() : rest.substr(comma + 1);
    }
  }
  return false;
}

bool HttpHead::feed(std::string_view bytes) {
  if (end_ != std::string::npos || is_lame_) return true;
  const std::size_t before = bytes_.size();
  // What is longer is refused, however it goes on.
  bytes_.append(bytes.substr(0, kLongestHttpHead + kEnd.size() - before));
  for (std::size_t i = before; i < bytes_.size(); ++i)
    if (bytes_[i] == '\n' && (i == 0 || bytes_[i - 1] != '\r')) {
      const auto whole = bytes_.find(kEnd);
      if (whole != std::string::npos && whole < i) break;  // behind the head
      is_lame_ = true;
      return true;
    }
  end_ = bytes_.find(kEnd, before < kEnd.size() ? 0 : before - kEnd.size() + 1);
  return end_ != std::string::npos || bytes_.size() >= kLongestHttpHead + kEnd.size();
}

std::optional<HttpRequest> HttpHead::read(HttpFault& fault) const {
  const auto no = [&](int status, std::string sentence) {
    fault = {status, std::move(sentence)};
    return std::nullopt;
  };
  if (is_lame_) return no(400, "A line of the request does not end with CR LF.");
  if (end_ == std::string::npos)
    return no(431, "The request is longer than " + std::to_string(kLongestHttpHead) + " bytes.");
  if (end_ + kEnd.size() != bytes_.size())
    return no(400, "Data follow the request; only one request per connection is served.");
  std::string_view rest = std::string_view(bytes_).substr(0, end_ + 2);
  const auto line = [&rest] {
    const auto end = rest.find("\r\n");
    const std::string_view out = rest.substr(0, end);
    rest.remove_prefix(end + 2);
    return out;
  };
  const std::string_view first = line();
  const auto space = first.find(' ');
  const auto second = space == first.npos ? first.npos : first.find(' ', space + 1);
  if (second == first.npos || first.substr(0, space) != "GET")
    return no(400, "The first line of a request must be: GET TARGET HTTP/1.1");
  HttpRequest out;
  out.target = first.substr(space + 1, second - space - 1);
  if (first.substr(second + 1) != "HTTP/1.1")
    return no(first.substr(second + 1).starts_with("HTTP/") ? 505 : 400,
              "This server supports HTTP/1.1 only.");
  if (out.target.size() > kLongestHttpTarget) return no(414, "The address is too long.");
  if (out.target.empty() || out.target.front() != '/' ||
      !std::all_of(out.target.begin(), out.target.end(),
                   [](char c) { return c > 0x20 && c < 0x7f; }))
    return no(400, "The target of a request must be a path that begins with a slash.");
  while (!rest.empty()) {
    const std::string_view text = line();
    if (text.size() > kLongestHttpField || out.fields.size() >= kMostHttpFields)
      return no(431, "The request has too many fields, or one that is too long.");
    const auto colon = text.find(':');
    if (colon == text.npos || !is_token(text.substr(0, colon)))
      return no(400, "A line of the request is not a header field.");
    std::string name = text::lower(text.substr(0, colon));
    const std::string_view value = trimmed(text.substr(colon + 1));
    for (const char c : value)
      if ((static_cast<unsigned char>(c) < 0x20 && c != '\t') || c == 0x7f)
        return no(400, "A field of the request holds a control character.");
    if (!is_list(name) && out.find(name))
      return no(400, "The field " + name + " of the request appears twice.");
    out.fields.emplace_back(std::move(name), value);
  }
  const std::string* length = out.find("content-length");
  if (out.find("transfer-encoding") || (length && *length != "0"))
    return no(400, "Requests with a body are not supported.");
  if (!out.find("host")) return no(400, "The request has no Host field.");
  return out;
}

std::string http_answer(int status, std::string_view type, std::string_view fields,
                        std::string_view content) {
  std::string out = "HTTP/1.1 " + std::to_string(status) + " " + std::string(reason(status)) +
                    "\r\nConnection: close\r\nContent-Type: " + std::string(type) +
                    "\r\nContent-Length: " + std::to_string(content.size()) +
                    "\r\nX-Content-Type-Options: nosniff\r\nReferrer-Policy: no-referrer\r\n"
                    "Cache-Control: no-store\r\nX-Frame-Options: DENY\r\n"
                    "Cross-Origin-Opener-Policy: same-origin\r\n"
                    "Cross-Origin-Resource-Policy: same-origin\r\n";
  out += fields;
  out += "\r\n";
  out += content;
  return out;
}

std::string http_answer(const HttpFault& fault) {
  return http_answer(fault.status, "text/plain; charset=utf-8",
                     fault.status == 426 ? "Upgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
                                         : "Content-Security-Policy: default-src 'none'\r\n",
                     fault.sentence + "\n");
}

}  // namespace robomosp::remote
