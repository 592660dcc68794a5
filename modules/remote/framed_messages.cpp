// SPDX-License-Identifier: Apache-2.0
#include "remote/framed_messages.h"

#include <unistd.h>

#include <algorithm>
#include <cerrno>

#include "kernel/text.h"

namespace robomosp::remote {
namespace {

using Json = nlohmann::json;

constexpr std::size_t kLongestHead = 8192;
constexpr std::size_t kDeepestMessage = 128;

}  // namespace

bool Frames::take_body(std::string_view& bytes) {
  const std::size_t n = std::min(wanted_ - body_.size(), bytes.size());
  body_.append(bytes.substr(0, n));
  bytes.remove_prefix(n);
  if (body_.size() < wanted_) return false;
  wanted_ = 0;
  return true;
}

Frames::Head Frames::take_head(std::string_view& bytes, std::string& fault) {
  const std::size_t end = bytes.find('\n');
  const bool is_whole_line = end != std::string_view::npos;
  head_.append(bytes.substr(0, is_whole_line ? end + 1 : bytes.size()));
  bytes.remove_prefix(is_whole_line ? end + 1 : bytes.size());
  if (head_.size() > kLongestHead) {
    fault = "the header of a message has more than " + std::to_string(kLongestHead) + " bytes";
    return Head::wrong;
  }
  if (!is_whole_line) return Head::open;
  std::string_view line = std::string_view(head_).substr(line_);
  while (!line.empty() && (line.back() == '\n' || line.back() == '\r')) line.remove_suffix(1);
  line_ = head_.size();
  if (!line.empty()) return field(line, fault) ? Head::open : Head::wrong;
  head_.clear();
  line_ = 0;
  if (!std::exchange(has_length_, false)) {
    fault = "a message has no Content-Length";
    return Head::wrong;
  }
  wanted_ = length_;
  return Head::whole;
}

bool Frames::field(std::string_view line, std::string& fault) {
  const std::size_t colon = line.find(':');
  if (colon == std::string_view::npos) {
    fault = "\"" + text::visible(line.substr(0, 40)) + "\" is not a header field of a message";
    return false;
  }
  std::string name(line.substr(0, colon));
  for (char& c : name)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  std::string_view value = line.substr(colon + 1);
  while (!value.empty() && value.front() == ' ') value.remove_prefix(1);
  if (name != "content-length") return true;
  std::size_t n = 0;
  for (const char c : value) {
    if (c < '0' || c > '9' || n > kLongestEditorMessage) {
      n = kLongestEditorMessage + 1;
      break;
    }
    n = n * 10 + static_cast<std::size_t>(c - '0');
  }
  if (value.empty() || n > kLongestEditorMessage) {
    fault = "Content-Length must be a number up to " + std::to_string(kLongestEditorMessage);
    return false;
  }
  length_ = n;
  has_length_ = true;
  return true;
}

std::string framed(const Json& message) {
  const std::string body = message.dump(-1, ' ', false, Json::error_handler_t::replace);
  return "Content-Length: " + std::to_string(body.size()) + "\r\n\r\n" + body;
}

bool write_all(int fd, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t n = ::write(fd, bytes.data(), bytes.size());
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return false;
    bytes.remove_prefix(static_cast<std::size_t>(n));
  }
  return true;
}

std::optional<std::size_t> bytes_of_json(std::string_view s) {
  constexpr std::size_t kBytesOfValue = 96;  // the half of an object with one member
  std::size_t depth = 0, values = 0;
  bool is_string = false;
  for (std::size_t i = 0; i < s.size(); ++i) {
    const char c = s[i];
    if (is_string) {
      if (c == '\\') ++i;
      else if (c == '"') is_string = false;
      continue;
    }
    if (c == '"') is_string = true;
    if (c == '[' || c == '{') {
      if (++depth > kDeepestMessage) return std::nullopt;
      ++values;
    }
    if ((c == ']' || c == '}') && depth > 0) --depth;
    if (c == ',') ++values;
    if (values > kMostEditorValues) return std::nullopt;
  }
  return s.size() + values * kBytesOfValue;
}

const Json& member(const Json& j, const char* name) {
  static const Json none;
  if (!j.is_object()) return none;
  const auto it = j.find(name);
  return it == j.end() ? none : *it;
}

std::string string_member(const Json& j, const char* name) {
  const Json& v = member(j, name);
  return v.is_string() ? v.get<std::string>() : std::string();
}

std::optional<std::uint32_t> number_member(const Json& j, const char* name) {
  const Json& v = member(j, name);
  if (!v.is_number_integer() && !v.is_number_unsigned()) return std::nullopt;
  constexpr std::uint64_t kMost = 0xffffffffU;
  if (v.is_number_unsigned())
    return static_cast<std::uint32_t>(std::min(v.get<std::uint64_t>(), kMost));
  const auto n = v.get<std::int64_t>();
  if (n < 0) return std::nullopt;
  return static_cast<std::uint32_t>(std::min<std::int64_t>(n, kMost));
}

}  // namespace robomosp::remote
