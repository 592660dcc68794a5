// SPDX-License-Identifier: Apache-2.0
// Messages with a length header, as used by editors (Language Server Protocol, Debug Adapter
// Protocol): parsed from bytes, limited, and written (layer: application, remote).
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include <nlohmann/json.hpp>

namespace robomosp::remote {

/// Longest message that is read [bytes], and most values within it.
inline constexpr std::size_t kLongestEditorMessage = std::size_t{32} << 20;
inline constexpr std::size_t kMostEditorValues = 2'000'000;

/// Parses messages: a header with Content-Length, a blank line, the message.
class Frames {
 public:
  /// Calls each message; false = the stream is invalid, with the reason in `fault`.
  template <class Each>
  bool feed(std::string_view bytes, Each&& each, std::string& fault) {
    while (!bytes.empty()) {
      if (wanted_ > 0) {
        if (!take_body(bytes)) return true;
        each(std::exchange(body_, {}));
        continue;
      }
      switch (take_head(bytes, fault)) {
        case Head::wrong: return false;
        case Head::open: break;
        case Head::whole:
          if (wanted_ == 0) each(std::string());
      }
    }
    return true;
  }

 private:
  enum class Head : std::uint8_t { open, whole, wrong };
  /// True = the body is whole.
  bool take_body(std::string_view& bytes);
  /// Up to the end of a line.
  Head take_head(std::string_view& bytes, std::string& fault);
  bool field(std::string_view line, std::string& fault);
  std::string head_, body_;
  std::size_t line_ = 0, wanted_ = 0, length_ = 0;
  bool has_length_ = false;
};

/// A message with its head.
[[nodiscard]] std::string framed(const nlohmann::json& message);
/// Writes all bytes; false = the reader has closed.
bool write_all(int fd, std::string_view bytes);

/// Approximate memory of a parsed JSON text [bytes]; empty = it is nested too deep, or has too many
/// values.
[[nodiscard]] std::optional<std::size_t> bytes_of_json(std::string_view text);

/// A member of an object; null if missing.
[[nodiscard]] const nlohmann::json& member(const nlohmann::json& j, const char* name);
/// A member that is a string; else "".
[[nodiscard]] std::string string_member(const nlohmann::json& j, const char* name);
/// A member that is a whole number of at least 0, clamped to 32 bits.
[[nodiscard]] std::optional<std::uint32_t> number_member(const nlohmann::json& j, const char* name);

}  // namespace robomosp::remote
