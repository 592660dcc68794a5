// SPDX-License-Identifier: Apache-2.0
// Messages between this program and robomosp-lua, which runs untrusted scripts in a separate
// process: frames of bytes, one Value each (layer: application, lua). Neither end trusts the other:
// frames that are truncated, too long, too deep or malformed are rejected. [any thread]
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include <robomosp/sdk/result.h>

#include "kernel/value.h"

namespace robomosp::lua::wire {

/// Kinds of frames. `ready` replies to `setup`, and one `done` to each `eval`; before that the
/// child may send any number of `print` and `request` frames, and each request gets one `answer`.
enum class Kind : std::uint8_t {
  setup = 'S',    ///< to the child: limits and the table of commands
  eval = 'E',     ///< to the child: a text to run
  answer = 'A',   ///< to the child: the result of its request
  ready = 'Y',    ///< from the child: how it is locked
  request = 'R',  ///< from the child: a command, or a query about a handle
  print = 'P',    ///< from the child: a text that was printed
  done = 'D',     ///< from the child: the results of the text, or its error
};

/// Kinds of requests.
enum class Ask : std::uint8_t { dispatch, start, classic, unknown, name_of, describe, begin, end };
inline constexpr std::uint8_t kLastAsk = static_cast<std::uint8_t>(Ask::end);

/// Greatest nesting of a value in a frame: that of a Lua value plus its envelope.
inline constexpr int kDeepest = 72;
/// Values in one frame; each takes more memory than bytes.
inline constexpr std::size_t kMostValues = 1'000'000;
/// Bytes of a frame from the child.
inline constexpr std::size_t kLongestRequest = std::size_t{16} << 20;
/// Bytes of a frame to the child.
inline constexpr std::size_t kLongestAnswer = std::size_t{32} << 20;

/// Length of a frame's header: four bytes for the length, one for the kind.
inline constexpr std::size_t kHeader = 5;

/// A frame; nullopt if it would be longer than `longest`.
[[nodiscard]] std::optional<std::string> frame(Kind kind, const Value& value, std::size_t longest);

/// The value of a frame, which is all of `bytes`; nullopt if malformed.
[[nodiscard]] std::optional<Value> read_value(std::string_view bytes);

struct Frame {
  Kind kind{};
  Value value;
};
/// Extracts frames from received bytes.
class Inbox {
 public:
  explicit Inbox(std::size_t longest) : longest_(longest) {}
  void add(std::string_view bytes);
  /// The next frame; nullopt if it is incomplete. After an error, no more frames follow.
  [[nodiscard]] Result<std::optional<Frame>> take();

 private:
  std::size_t longest_;
  std::string bytes_;
  std::size_t taken_ = 0;  ///< processed bytes at the beginning of bytes_
};

/// An error as a value and back; texts longer than 64 KiB are cut, unknown codes are script_failed.
[[nodiscard]] Value error_value(const Error& e);
[[nodiscard]] Error error_from(const Value& v);

}  // namespace robomosp::lua::wire
