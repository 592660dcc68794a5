// SPDX-License-Identifier: Apache-2.0
// What passes between this program and robomosp-lua, which runs scripts of strangers in a process
// of its own: frames of bytes, each of one Value (layer: application, lua). Neither end trusts the
// other: what is cut off, too long, too deep or of another form is refused. [any thread]
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include <robomosp/sdk/result.h>

#include "kernel/value.h"

namespace robomosp::lua::wire {

/// What a frame says. After `setup` is answered by `ready`, each `eval` is answered by one `done`;
/// before that the child may send any number of `print` and of `request`, each of which is answered
/// by one `answer`.
enum class Kind : std::uint8_t {
  setup = 'S',    ///< to the child: limits and the table of commands
  eval = 'E',     ///< to the child: a text to run
  answer = 'A',   ///< to the child: what came of its request
  ready = 'Y',    ///< from the child: how it is locked
  request = 'R',  ///< from the child: a command, or what names a handle
  print = 'P',    ///< from the child: a text that was printed
  done = 'D',     ///< from the child: the results of the text, or its error
};

/// What a request asks for.
enum class Ask : std::uint8_t { dispatch, start, classic, unknown, name_of, describe, begin, end };
inline constexpr std::uint8_t kLastAsk = static_cast<std::uint8_t>(Ask::end);

/// Nesting of a value in a frame: that of a value of Lua, and what is put around it.
inline constexpr int kDeepest = 72;
/// Values in one frame; each takes more memory than bytes.
inline constexpr std::size_t kMostValues = 1'000'000;
/// Bytes of a frame from the child.
inline constexpr std::size_t kLongestRequest = std::size_t{16} << 20;
/// Bytes of a frame to the child.
inline constexpr std::size_t kLongestAnswer = std::size_t{32} << 20;

/// Bytes before a frame's value: four of its length, one of its kind.
inline constexpr std::size_t kHeader = 5;

/// A frame; nullopt when it would be longer than `longest`.
[[nodiscard]] std::optional<std::string> frame(Kind kind, const Value& value, std::size_t longest);

/// The value of a frame, which is all of `bytes`; nullopt when it is none.
[[nodiscard]] std::optional<Value> read_value(std::string_view bytes);

struct Frame {
  Kind kind{};
  Value value;
};
/// Takes frames off the bytes that came.
class Inbox {
 public:
  explicit Inbox(std::size_t longest) : longest_(longest) {}
  void add(std::string_view bytes);
  /// The next frame; nullopt when it is not whole yet. After an error nothing else comes.
  [[nodiscard]] Result<std::optional<Frame>> take();

 private:
  std::size_t longest_;
  std::string bytes_;
  std::size_t taken_ = 0;  ///< bytes at the beginning of bytes_ that are done with
};

/// The code of its word; script_failed for any other.
[[nodiscard]] ErrorCode code_from(std::string_view word);
/// An error as a value and back; texts longer than 64 KiB are cut.
[[nodiscard]] Value error_value(const Error& e);
[[nodiscard]] Error error_from(const Value& v);

}  // namespace robomosp::lua::wire
