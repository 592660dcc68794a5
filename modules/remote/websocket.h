// SPDX-License-Identifier: Apache-2.0
// WebSocket, server side (RFC 6455): frames of a client to text messages, and back. Extensions such
// as compression are not supported (layer: application, remote).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>

namespace robomosp::remote {

/// Status codes at the end of a WebSocket; RFC 6455, section 7.4.1.
enum class WebSocketEnd : std::uint16_t {
  normal = 1000,
  leaving = 1001,
  protocol = 1002,
  no_text = 1003,
  bad_text = 1007,
  policy = 1008,
  too_long = 1009,
};

/// The reply to the key of a handshake: base64 of its SHA-1 with the GUID of the RFC.
[[nodiscard]] std::string websocket_accept(std::string_view key);
/// True if it is base64 of 16 bytes.
[[nodiscard]] bool is_websocket_key(std::string_view key);

/// A text message in one frame, as sent by servers.
[[nodiscard]] std::string websocket_text(std::string_view text);
/// The last frame; the reason is cut to the 123 bytes that fit.
[[nodiscard]] std::string websocket_close(WebSocketEnd code, std::string_view reason);
/// A pong with the content of its ping.
[[nodiscard]] std::string websocket_pong(std::string_view content);

/// Parses the frames of a client. A message is UTF-8 text without line breaks; its fragments are
/// joined, up to `longest` bytes. [one thread]
class WebSocketReader {
 public:
  explicit WebSocketReader(std::size_t longest) : longest_(longest) {}
  struct Sinks {
    std::function<bool(std::string_view text)> message;  ///< false: stop reading
    std::function<bool()> too_long;  ///< once for each that is longer, and is skipped; the same
    std::function<void(std::string_view content)> ping;
    /// The client ended the connection or violated the protocol: reply with this.
    std::function<void(WebSocketEnd code, std::string_view reason)> end;
  };
  /// False if reading should stop.
  bool feed(std::string_view bytes, const Sinks& sinks);
  void set_longest(std::size_t bytes) { longest_ = bytes; }
  /// True in the middle of a frame or a message.
  [[nodiscard]] bool is_within() const { return head_size_ > 0 || is_open_; }

 private:
  bool head(const Sinks& sinks);  ///< parses a complete frame header
  bool finish(const Sinks& sinks);

  std::size_t longest_;
  std::array<unsigned char, 14> head_{};
  std::size_t head_size_ = 0, head_wanted_ = 2;
  std::uint64_t left_ = 0;    ///< of the frame's content
  std::size_t at_ = 0;        ///< byte of the mask that is next
  bool is_open_ = false;      ///< a message has begun
  bool is_skipping_ = false;  ///< it is too long
  bool is_over_ = false;
  std::string message_, control_;
};

}  // namespace robomosp::remote
