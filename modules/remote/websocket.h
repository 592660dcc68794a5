// SPDX-License-Identifier: Apache-2.0
// WebSocket, the server's end (RFC 6455): frames of a client to messages of text, and back. No
// extension is known, so nothing is ever compressed (layer: application, remote).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>

namespace robomosp::remote {

/// Why a WebSocket ends; RFC 6455, section 7.4.1.
enum class WebSocketEnd : std::uint16_t {
  normal = 1000,
  leaving = 1001,
  protocol = 1002,
  no_text = 1003,
  bad_text = 1007,
  policy = 1008,
  too_long = 1009,
};

/// The answer to the key of a handshake: base64 of its SHA-1 with the number of the RFC.
[[nodiscard]] std::string websocket_accept(std::string_view key);
/// Whether it is base64 of 16 bytes.
[[nodiscard]] bool is_websocket_key(std::string_view key);

/// A message of text in one frame, as servers send it.
[[nodiscard]] std::string websocket_text(std::string_view text);
/// The last frame; the reason is cut to the 123 bytes that fit.
[[nodiscard]] std::string websocket_close(WebSocketEnd code, std::string_view reason);
/// A pong with the content of its ping.
[[nodiscard]] std::string websocket_pong(std::string_view content);

/// Takes the frames of a client apart. A message is a text in UTF-8 without line breaks; its
/// pieces are put together, up to `longest` bytes. [one thread]
class WebSocketReader {
 public:
  explicit WebSocketReader(std::size_t longest) : longest_(longest) {}
  struct Sinks {
    std::function<bool(std::string_view text)> message;  ///< false: no more is read
    std::function<bool()> too_long;  ///< once for each that is longer and skipped; the same
    std::function<void(std::string_view content)> ping;
    /// The client ends the connection, or broke a rule: this is to be answered.
    std::function<void(WebSocketEnd code, std::string_view reason)> end;
  };
  /// False when nothing more is to be read.
  bool feed(std::string_view bytes, const Sinks& sinks);
  void set_longest(std::size_t bytes) { longest_ = bytes; }
  /// Whether a frame or a message has begun and is not whole.
  [[nodiscard]] bool is_within() const { return head_size_ > 0 || is_open_; }

 private:
  bool head(const Sinks& sinks);  ///< of a frame, whose bytes are there
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
