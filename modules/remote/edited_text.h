// SPDX-License-Identifier: Apache-2.0
// Texts that an editor changes, with places as the Language Server Protocol counts them, and the
// addresses of files (layer: application, remote).
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

namespace robomosp::remote {

enum class Units : std::uint8_t { utf16, utf8 };

inline bool is_inner(char c) { return (static_cast<unsigned char>(c) & 0xC0U) == 0x80; }
/// Of UTF-16: all of a character count with its first byte.
inline std::uint32_t units_of(char c) {
  return is_inner(c) ? 0 : static_cast<unsigned char>(c) >= 0xF0 ? 2 : 1;
}
/// The byte of a character within a line of `size` bytes without its end; behind it is its end.
template <class At>
std::uint32_t byte_in_line(std::uint32_t size, std::uint32_t character, Units units, At&& at) {
  std::uint32_t i = 0;
  if (units == Units::utf8) {
    i = std::min(character, size);
    while (i > 0 && i < size && is_inner(at(i))) --i;
    return i;
  }
  for (std::uint32_t n = 0; i < size && n < character;) {
    n += units_of(at(i));
    ++i;
    while (i < size && is_inner(at(i))) ++i;
  }
  return i;
}

/// A text with its lines, as editors count: behind \n, \r\n and \r. A place in a line costs nothing
/// that grows with the line.
class Text {
 public:
  Text() { set({}); }
  explicit Text(std::string s) { set(std::move(s)); }
  [[nodiscard]] const std::string& all() const { return all_; }
  void set(std::string s) {
    all_ = std::move(s);
    starts_.assign(1, 0);
    marks_.clear();
    std::uint32_t units = 0;
    for (std::size_t i = 0; i < all_.size(); ++i) {
      if (i % kMark == 0) marks_.push_back(units);
      units += units_of(all_[i]);
      if (all_[i] == '\n' || (all_[i] == '\r' && (i + 1 == all_.size() || all_[i + 1] != '\n')))
        starts_.push_back(static_cast<std::uint32_t>(i + 1));
    }
    if (all_.size() % kMark == 0) marks_.push_back(units);
  }
  /// The text with one change; nothing = it ends before it begins.
  [[nodiscard]] std::optional<std::string> with_change(std::uint32_t l0, std::uint32_t c0,
                                                       std::uint32_t l1, std::uint32_t c1,
                                                       std::string_view with, Units units) const {
    const std::uint32_t begin = byte(l0, c0, units), end = byte(l1, c1, units);
    if (end < begin) return std::nullopt;
    std::string out;
    out.reserve(all_.size() + with.size());
    out.append(all_, 0, begin).append(with).append(all_, end, std::string::npos);
    return out;
  }
  /// A place behind the end of a line is its end, as the protocol has it.
  [[nodiscard]] std::uint32_t byte(std::uint32_t line, std::uint32_t character, Units units) const {
    if (line >= starts_.size()) return static_cast<std::uint32_t>(all_.size());
    const std::uint32_t start = starts_[line], end = line_end(line);
    if (units == Units::utf8 || end - start <= kMark)
      return start + byte_in_line(end - start, character, units,
                                  [&](std::uint32_t i) { return all_[start + i]; });
    // From the last mark that is not behind it.
    const std::uint64_t wanted = std::uint64_t{units_before(start)} + character;
    const auto behind = std::lower_bound(marks_.begin(), marks_.end(), wanted);
    const auto mark = static_cast<std::uint32_t>(behind - marks_.begin());
    std::uint32_t i = std::max(start, mark > 0 ? (mark - 1) * kMark : 0);
    for (std::uint64_t n = units_before(i); i < end && n < wanted;) {
      n += units_of(all_[i]);
      ++i;
      while (i < end && is_inner(all_[i])) ++i;
    }
    return std::min(i, end);
  }
  [[nodiscard]] nlohmann::json position(std::uint32_t byte, Units units) const {
    const auto it = std::upper_bound(starts_.begin(), starts_.end(), byte) - 1;
    return {{"line", it - starts_.begin()}, {"character", this->units(*it, byte, units)}};
  }
  [[nodiscard]] std::uint32_t line_of(std::uint32_t byte) const {
    return static_cast<std::uint32_t>(std::upper_bound(starts_.begin(), starts_.end(), byte) -
                                      starts_.begin() - 1);
  }
  /// Without the signs that end it.
  [[nodiscard]] std::uint32_t line_end(std::uint32_t line) const {
    std::uint32_t end =
        line + 1 < starts_.size() ? starts_[line + 1] : static_cast<std::uint32_t>(all_.size());
    while (end > starts_[line] && (all_[end - 1] == '\n' || all_[end - 1] == '\r')) --end;
    return end;
  }
  [[nodiscard]] std::uint32_t line_begin(std::uint32_t line) const { return starts_[line]; }
  [[nodiscard]] std::uint32_t units(std::uint32_t begin, std::uint32_t end, Units units) const {
    if (units == Units::utf8) return end - begin;
    return units_before(end) - units_before(begin);
  }
  [[nodiscard]] nlohmann::json range(std::uint32_t begin, std::uint32_t end, Units units) const {
    return {{"start", position(begin, units)}, {"end", position(end, units)}};
  }

 private:
  static constexpr std::uint32_t kMark = 1024;
  /// Units of UTF-16 before a byte.
  [[nodiscard]] std::uint32_t units_before(std::uint32_t byte) const {
    const std::uint32_t mark = byte / kMark;
    std::uint32_t n = marks_[mark];
    for (std::uint32_t i = mark * kMark; i < byte; ++i) n += units_of(all_[i]);
    return n;
  }
  std::string all_;
  std::vector<std::uint32_t> starts_;  ///< of lines
  std::vector<std::uint32_t> marks_;   ///< units before every kMark bytes
};

/// A text while an editor changes it at many places: a change costs what its lines have, and what
/// lies between it and the one before.
class ChangedText {
 public:
  explicit ChangedText(const std::string& s) { set(s); }
  void set(std::string_view s) {
    above_.clear();
    below_.clear();
    size_ = s.size();
    split(s, below_);
    std::reverse(below_.begin(), below_.end());
  }
  [[nodiscard]] std::size_t size() const { return size_; }
  /// Bytes that were gone over so far.
  [[nodiscard]] std::uint64_t work() const { return work_; }
  /// False = it ends before it begins.
  bool replace(std::uint32_t l0, std::uint32_t c0, std::uint32_t l1, std::uint32_t c1,
               std::string_view with, Units units) {
    const auto lines = static_cast<std::uint32_t>(above_.size() + below_.size());
    // Behind the last line is its end.
    const auto bound = [&](std::uint32_t& line, std::uint32_t& character) {
      if (line < lines) return;
      line = lines - 1;
      character = 0xffffffffU;
    };
    bound(l0, c0);
    bound(l1, c1);
    if (l1 < l0) return false;
    go_to(l0);
    const std::uint32_t last = l1 - l0;
    const auto line = [&](std::uint32_t k) -> const std::string& {
      return below_[below_.size() - 1 - k];
    };
    const std::uint32_t b0 = byte_of(line(0), c0, units), b1 = byte_of(line(last), c1, units);
    if (last == 0 && b1 < b0) return false;
    std::string now = line(0).substr(0, b0);
    now += with;
    now.append(line(last), b1, std::string::npos);
    for (std::uint32_t k = 0; k <= last; ++k) {
      size_ -= below_.back().size();
      below_.pop_back();
    }
    // Of \r\n both belong to one line, wherever they come from.
    if (!above_.empty() && above_.back().back() == '\r' && now.starts_with('\n')) {
      size_ -= above_.back().size();
      now.insert(0, above_.back());
      above_.pop_back();
    }
    if (now.ends_with('\r') && !below_.empty() && below_.back().starts_with('\n')) {
      size_ -= below_.back().size();
      now += below_.back();
      below_.pop_back();
    }
    size_ += now.size();
    work_ += now.size();
    std::vector<std::string> made;
    split(now, made);
    // What ends in the middle of the text has no empty line behind it.
    if (!below_.empty() && made.back().empty()) made.pop_back();
    for (std::size_t k = made.size(); k-- > 0;) below_.push_back(std::move(made[k]));
    if (below_.empty()) below_.emplace_back();
    return true;
  }
  [[nodiscard]] std::string all() const {
    std::string out;
    out.reserve(size_);
    for (const std::string& s : above_) out += s;
    for (std::size_t k = below_.size(); k-- > 0;) out += below_[k];
    return out;
  }

 private:
  /// Lines with what ends them; behind an end there is one more.
  static void split(std::string_view s, std::vector<std::string>& out) {
    std::size_t start = 0;
    for (std::size_t i = 0; i < s.size(); ++i)
      if (s[i] == '\n' || (s[i] == '\r' && (i + 1 == s.size() || s[i + 1] != '\n'))) {
        out.emplace_back(s.substr(start, i + 1 - start));
        start = i + 1;
      }
    out.emplace_back(s.substr(start));
  }
  static std::uint32_t byte_of(const std::string& line, std::uint32_t character, Units units) {
    std::size_t end = line.size();
    while (end > 0 && (line[end - 1] == '\n' || line[end - 1] == '\r')) --end;
    return byte_in_line(static_cast<std::uint32_t>(end), character, units,
                        [&](std::uint32_t i) { return line[i]; });
  }
  void go_to(std::size_t line) {
    work_ += line > above_.size() ? line - above_.size() : above_.size() - line;
    for (; above_.size() > line; above_.pop_back()) below_.push_back(std::move(above_.back()));
    for (; above_.size() < line; below_.pop_back()) above_.push_back(std::move(below_.back()));
  }
  std::vector<std::string> above_, below_;  ///< lines; below_ from the end
  std::size_t size_ = 0;
  std::uint64_t work_ = 0;
};

/// "file:///a%20b" as a path; nothing = it is of another kind.
inline std::optional<std::filesystem::path> path_of(std::string_view uri) {
  constexpr std::string_view kFile = "file://";
  if (uri.substr(0, kFile.size()) != kFile) return std::nullopt;
  uri.remove_prefix(kFile.size());
  const std::size_t slash = uri.find('/');
  if (slash == std::string_view::npos) return std::nullopt;
  uri.remove_prefix(slash);  // a host is this one
  std::string out;
  const auto digit = [](char c) {
    return c >= '0' && c <= '9'   ? c - '0'
           : c >= 'a' && c <= 'f' ? c - 'a' + 10
           : c >= 'A' && c <= 'F' ? c - 'A' + 10
                                  : -1;
  };
  for (std::size_t i = 0; i < uri.size(); ++i) {
    if (uri[i] == '%' && i + 2 < uri.size() && digit(uri[i + 1]) >= 0 && digit(uri[i + 2]) >= 0) {
      out += static_cast<char>(digit(uri[i + 1]) * 16 + digit(uri[i + 2]));
      i += 2;
    } else {
      out += uri[i];
    }
  }
  if (out.find('\0') != std::string::npos) return std::nullopt;
  return std::filesystem::path(out);
}
inline std::string uri_of(const std::filesystem::path& path) {
  std::string out = "file://";
  for (const char c : path.string()) {
    const bool is_plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') ||
                          (c >= '0' && c <= '9') || c == '/' || c == '.' || c == '-' || c == '_' ||
                          c == '~';
    constexpr char kDigits[] = "0123456789ABCDEF";
    if (is_plain) {
      out += c;
    } else {
      out += '%';
      out += kDigits[static_cast<unsigned char>(c) >> 4U];
      out += kDigits[static_cast<unsigned char>(c) & 15U];
    }
  }
  return out;
}
inline std::string file_name(std::string_view uri) {
  if (const auto path = path_of(uri)) return path->filename().string();
  const std::size_t slash = uri.find_last_of("/:");
  return std::string(slash == std::string_view::npos ? uri : uri.substr(slash + 1));
}

}  // namespace robomosp::remote
