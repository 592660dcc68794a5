// SPDX-License-Identifier: Apache-2.0
// HTTP/1.1, as far as a page and the handshake of WebSocket need it: the head of one request, read
// strictly and within bounds, and whole answers (RFC 9112) (layer: application, remote).
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

/// What is wrong with a request, as its answer says it.
struct HttpFault {
  int status = 400;
  std::string sentence{};
};

/// A request of the method GET without content.
struct HttpRequest {
  std::string target;
  /// Names in lower case; none is there twice but those that are lists.
  std::vector<std::pair<std::string, std::string>> fields;
  [[nodiscard]] const std::string* find(std::string_view name) const;
  /// Whether a field is a list that has the word, in any case.
  [[nodiscard]] bool has_word(std::string_view name, std::string_view word) const;
};

/// Collects the head of one request. Lines end with CR LF and nothing else does; there are no
/// folded lines, no content and no second request: whatever could be read in two ways is refused.
/// [one thread]
class HttpHead {
 public:
  /// Takes bytes; true when the head is whole or cannot become one. Bytes behind it are kept.
  bool feed(std::string_view bytes);
  /// The request, when feed() said so.
  [[nodiscard]] std::optional<HttpRequest> read(HttpFault& fault) const;

 private:
  std::string bytes_;
  std::size_t end_ = std::string::npos;  ///< of the empty line
  bool is_lame_ = false;                 ///< a line does not end with CR LF
};

/// An answer after which the connection ends. `fields` are whole lines with their CR LF.
[[nodiscard]] std::string http_answer(int status, std::string_view type, std::string_view fields,
                                      std::string_view content);
/// An answer of one sentence.
[[nodiscard]] std::string http_answer(const HttpFault& fault);

}  // namespace robomosp::remote
