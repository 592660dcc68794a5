// SPDX-License-Identifier: Apache-2.0
#include "remote/websocket.h"

#include <algorithm>
#include <utility>

#include "kernel/base64.h"
#include "kernel/utf8.h"
#include "remote/crypto.h"

namespace robomosp::remote {
namespace {

// Kinds of frames.
constexpr unsigned kContinuation = 0, kText = 1, kBinary = 2, kClose = 8, kPing = 9, kPong = 10;
/// Longest content of a control frame [bytes].
constexpr std::size_t kLongestControl = 125;
/// A message's buffer that is larger is given back when the message is done [bytes].
constexpr std::size_t kKeptFrameBuffer = 4096;

std::string frame(unsigned kind, std::string_view content) {
  std::string out;
  out.reserve(content.size() + 10);
  const std::size_t n = content.size();
  out += static_cast<char>(0x80U | kind);
  if (n < 126) {
    out += static_cast<char>(n);
  } else {
    const int bytes = n < 65'536 ? 2 : 8;
    out += static_cast<char>(bytes == 2 ? 126 : 127);
    for (int i = bytes - 1; i >= 0; --i)
      out += static_cast<char>((static_cast<std::uint64_t>(n) >> (8 * i)) & 255U);
  }
  out += content;
  return out;
}

/// Codes that a close frame may carry.
bool is_code(unsigned code) {
  return (code >= 1000 && code <= 1003) || (code >= 1007 && code <= 1014) ||
         (code >= 3000 && code < 5000);
}

}  // namespace

std::string websocket_accept(std::string_view key) {
  std::string out;
  base64::append(out, sha1_bytes(std::string(key) + "258EAFA5-E914-47DA-95CA-C5AB0DC85B11"));
  return out;
}

bool is_websocket_key(std::string_view key) {
  std::array<char, 24> bytes{};
  return key.size() == 24 && base64::decoded_size(key) == 16 && base64::decode(key, bytes.data());
}

std::string websocket_text(std::string_view text) { return frame(kText, text); }

std::string websocket_close(WebSocketEnd code, std::string_view reason) {
  std::string content;
  content += static_cast<char>(static_cast<unsigned>(code) >> 8U);
  content += static_cast<char>(static_cast<unsigned>(code) & 255U);
  std::string words(reason.substr(0, kLongestControl - 2));
  while (text::first_bad_byte(words) != std::string::npos) words.pop_back();  // a cut character
  return frame(kClose, content + words);
}

std::string websocket_pong(std::string_view content) { return frame(kPong, content); }

bool WebSocketReader::feed(std::string_view bytes, const Sinks& sinks) {
  if (is_over_) return false;
  while (!bytes.empty()) {
    if (head_size_ < head_wanted_) {
      head_[head_size_++] = static_cast<unsigned char>(bytes.front());
      bytes.remove_prefix(1);
      if (head_size_ == 2) {
        const unsigned size = head_[1] & 127U;
        head_wanted_ = 2U + (size == 126 ? 2U : size == 127 ? 8U : 0U) + 4U;
        if (!head(sinks)) return false;
      }
      if (head_size_ < head_wanted_) continue;
      const unsigned size = head_[1] & 127U;
      left_ = size;
      if (size >= 126) {
        left_ = 0;
        for (std::size_t i = 2; i < head_wanted_ - 4; ++i) left_ = left_ << 8U | head_[i];
      }
      // The shortest form only, and no length beyond what a signed number holds.
      if ((size == 126 && left_ < 126) || (size == 127 && (left_ < 65'536 || left_ >> 63U))) {
        is_over_ = true;
        sinks.end(WebSocketEnd::protocol, "A length is not in its shortest form.");
        return false;
      }
      at_ = 0;
      const bool is_control = (head_[0] & 8U) != 0;
      if (!is_control && !is_skipping_ && left_ > longest_ - message_.size()) {
        is_skipping_ = true;
        std::string().swap(message_);
        if (!sinks.too_long()) {
          is_over_ = true;
          return false;
        }
      }
    }
    const std::size_t n = static_cast<std::size_t>(std::min<std::uint64_t>(left_, bytes.size()));
    const bool is_control = (head_[0] & 8U) != 0;
    if (n > 0 && (is_control || !is_skipping_)) {
      std::string& to = is_control ? control_ : message_;
      const unsigned char* mask = head_.data() + head_wanted_ - 4;
      const std::size_t before = to.size();
      to.append(bytes.substr(0, n));
      for (std::size_t i = 0; i < n; ++i)
        to[before + i] =
            static_cast<char>(static_cast<unsigned char>(to[before + i]) ^ mask[(at_ + i) & 3U]);
    }
    at_ = (at_ + n) & 3U;
    left_ -= n;
    bytes.remove_prefix(n);
    if (left_ == 0) {
      const bool go_on = finish(sinks);
      head_size_ = 0;
      head_wanted_ = 2;
      if (!go_on) {
        is_over_ = true;
        return false;
      }
    }
  }
  return true;
}

/// Looks at the first two bytes of a frame.
bool WebSocketReader::head(const Sinks& sinks) {
  const unsigned kind = head_[0] & 15U;
  const bool is_last = (head_[0] & 0x80U) != 0, is_control = (kind & 8U) != 0;
  const auto no = [&](WebSocketEnd code, std::string_view why) {
    is_over_ = true;
    sinks.end(code, why);
    return false;
  };
  if ((head_[0] & 0x70U) != 0)
    return no(WebSocketEnd::protocol, "A frame uses an extension that was not negotiated.");
  if ((head_[1] & 0x80U) == 0)
    return no(WebSocketEnd::protocol, "A frame of a client must be masked.");
  if (kind == kBinary) return no(WebSocketEnd::no_text, "Messages must be text (JSON).");
  if (kind > kPong || (kind > kBinary && kind < kClose))
    return no(WebSocketEnd::protocol, "A frame is of unknown kind.");
  if (is_control && (!is_last || (head_[1] & 127U) > kLongestControl))
    return no(WebSocketEnd::protocol,
              "A control frame must be unfragmented and at most 125 bytes long.");
  if (kind == kContinuation && !is_open_)
    return no(WebSocketEnd::protocol, "A continuation frame has no beginning.");
  if (kind == kText && is_open_)
    return no(WebSocketEnd::protocol, "A message begins within another.");
  if (!is_control) is_open_ = true;
  return true;
}

/// A frame is whole.
bool WebSocketReader::finish(const Sinks& sinks) {
  const unsigned kind = head_[0] & 15U;
  if (kind == kPing) sinks.ping(control_);
  if (kind == kClose) {
    unsigned code = 0;
    if (control_.size() >= 2)
      code = static_cast<unsigned>(static_cast<unsigned char>(control_[0])) << 8U |
             static_cast<unsigned char>(control_[1]);
    const bool is_fine =
        control_.empty() ||
        (control_.size() >= 2 && is_code(code) &&
         text::first_bad_byte(std::string_view(control_).substr(2)) == std::string::npos);
    sinks.end(is_fine ? WebSocketEnd::normal : WebSocketEnd::protocol, "");
    return false;
  }
  control_.clear();
  if ((kind & 8U) != 0 || (head_[0] & 0x80U) == 0) return true;
  is_open_ = false;
  if (std::exchange(is_skipping_, false)) return true;
  bool go_on = false;
  if (text::first_bad_byte(message_) != std::string::npos)
    sinks.end(WebSocketEnd::bad_text, "A message must be text in UTF-8.");
  else if (message_.find_first_of("\r\n") != std::string::npos)
    sinks.end(WebSocketEnd::policy, "A message must be one line.");
  else go_on = sinks.message(message_);
  if (message_.capacity() > kKeptFrameBuffer) std::string().swap(message_);
  message_.clear();
  return go_on;
}

}  // namespace robomosp::remote
