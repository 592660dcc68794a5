// SPDX-License-Identifier: Apache-2.0
// Help for posts: lines of files with their places in the source (layer: contract helper, inline
// only, not part of the ABI).
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <robomosp/sdk/post.h>

namespace robomosp::post {

/// The lines of a file, each with where it comes from.
class File {
 public:
  explicit File(int indent = 2) : indent_(indent) {}
  void add(std::string_view text, const rmp_span* from = nullptr) {
    std::string s;
    if (!text.empty()) s.assign(static_cast<std::size_t>(depth_ * indent_), ' ');
    s += text;
    lines_.push_back(std::move(s));
    spans_.push_back(from ? *from : rmp_span{RMP_NONE, 0, 0, 0, 0});
  }
  /// Text of several lines, as it is.
  void add_lines(std::string_view text) {
    while (!text.empty()) {
      const std::size_t end = std::min(text.find('\n'), text.size());
      lines_.emplace_back(text.substr(0, end));
      if (!lines_.back().empty() && lines_.back().back() == '\r') lines_.back().pop_back();
      spans_.push_back(rmp_span{RMP_NONE, 0, 0, 0, 0});
      text.remove_prefix(std::min(end + 1, text.size()));
    }
  }
  void append(const File& other) {
    lines_.insert(lines_.end(), other.lines_.begin(), other.lines_.end());
    spans_.insert(spans_.end(), other.spans_.begin(), other.spans_.end());
  }
  void in() { ++depth_; }
  void out() { depth_ = std::max(0, depth_ - 1); }
  [[nodiscard]] std::size_t size() const { return lines_.size(); }
  [[nodiscard]] bool empty() const { return lines_.empty(); }
  [[nodiscard]] std::vector<std::string>& lines() { return lines_; }
  [[nodiscard]] const std::vector<std::string>& lines() const { return lines_; }
  [[nodiscard]] const std::vector<rmp_span>& spans() const { return spans_; }
  void give(PostOutput& to, std::string_view name, bool crlf) const {
    std::string all;
    std::size_t n = 0;
    for (const std::string& l : lines_) n += l.size() + 2;
    all.reserve(n);
    for (const std::string& l : lines_) all.append(l).append(crlf ? "\r\n" : "\n");
    to.file(name, all);
    for (std::size_t i = 0; i < spans_.size(); ++i)
      if (spans_[i].file != RMP_NONE) to.from(name, static_cast<std::uint32_t>(i + 1), spans_[i]);
  }

 private:
  std::vector<std::string> lines_;
  std::vector<rmp_span> spans_;
  int indent_, depth_ = 0;
};

/// What the controller keeps from line to line, so that it is written where it changes only.
template <class T>
class Modal {
 public:
  /// Whether this is not what it has already; it has then.
  bool changes(const T& to) {
    if (value_ && *value_ == to) return false;
    value_ = to;
    return true;
  }
  void forget() { value_.reset(); }

 private:
  std::optional<T> value_;
};

}  // namespace robomosp::post
