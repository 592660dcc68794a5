// SPDX-License-Identifier: Apache-2.0
// HTTP/1.1, as needed for a page and the handshake of WebSocket: the header of one request, parsed
// strictly and with limits, and complete responses (RFC 9112) (layer: application, remote).
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace robomosp::remote {

inline constexpr std::size_t kLongestHttpHead = 16'384;   ///< all lines together [bytes]
inline constexpr std::size_t kLongestHttpTarget = 1'024;  ///< [bytes]
inline constexpr std::size_t kLongestHttpField = 8'192;   ///< one field's line [bytes]
inline constexpr std::size_t kMostHttpFields = 64;

/// The fault of a request, for its response.
struct HttpFault {
  int status = 400;
  std::string sentence{};
};

/// A request of the method GET without content.
struct HttpRequest {
  std::string target;
  /// Names in lower case; only list fields may be repeated.
  std::vector<std::pair<std::string, std::string>> fields;
  [[nodiscard]] const std::string* find(std::string_view name) const;
  /// True if a list field contains the word, in any case.
  [[nodiscard]] bool has_word(std::string_view name, std::string_view word) const;
};

/// Collects the header of one request. Lines must end with CR LF; folded lines, content and a
/// second request are rejected, since they are ambiguous. [one thread]
class HttpHead {
 public:
  /// Adds bytes; true if the header is complete or invalid. Bytes after it are kept.
  bool feed(std::string_view bytes);
  /// The request, after feed() returned true.
  [[nodiscard]] std::optional<HttpRequest> read(HttpFault& fault) const;

 private:
  std::string bytes_;
  std::size_t end_ = std::string::npos;  ///< of the empty line
  bool is_lame_ = false;                 ///< a line does not end with CR LF
};

/// A response that ends the connection. `fields` are whole lines with their CR LF.
[[nodiscard]] std::string http_answer(int status, std::string_view type, std::string_view fields,
                                      std::string_view content);
/// A response of one sentence.
[[nodiscard]] std::string http_answer(const HttpFault& fault);

}  // namespace robomosp::remote
