// SPDX-License-Identifier: Apache-2.0
// Help for posts: names that a target accepts (layer: contract helper, inline
// only, not part of the ABI).
#pragma once

#include <algorithm>
#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <string_view>

#include <robomosp/sdk/post.h>
#include <robomosp/sdk/post_numbers.h>

namespace robomosp::post {

/// Names of a target: cut to its length, in its case, no reserved words, unique. Equal calls in
/// equal order give equal names.
class Names {
 public:
  explicit Names(const PostCapabilities& c) : c_(c) {
    std::string_view rest = c.reserved;
    while (!rest.empty()) {
      const std::size_t end = std::min(rest.find(' '), rest.size());
      if (end > 0) used_.insert(folded(rest.substr(0, end)));
      rest.remove_prefix(std::min(end + 1, rest.size()));
    }
  }
  void reserve(std::string_view name) { used_.insert(folded(name)); }
  /// The name of `key`, made of the wish the first time that it is asked for.
  const std::string& of(std::uint64_t key, std::string_view wish) {
    const auto [it, is_new] = names_.try_emplace(key);
    if (is_new) it->second = unique(wish);
    return it->second;
  }
  std::string unique(std::string_view wish) {
    std::string base;
    for (const char c : wish)
      base += (c >= '0' && c <= '9') || (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') ? c : '_';
    if (base.empty() || !((base[0] | 32) >= 'a' && (base[0] | 32) <= 'z')) base = "x" + base;
    if (c_.name_case == PostCase::upper) base = upper(base);
    if (c_.name_case == PostCase::lower) base = lower(base);
    const auto most = static_cast<std::size_t>(std::max(c_.max_name, 4));
    std::string name = base.substr(0, most);
    if (used_.insert(folded(name)).second) return name;
    // Numbers that were given once are not tried again.
    std::uint64_t& n = numbers_.try_emplace(folded(name), 1).first->second;
    do {
      ++n;
      const std::string tail = std::to_string(n);
      name = base.substr(0, most - std::min(most - 1, tail.size())) + tail;
    } while (!used_.insert(folded(name)).second);
    return name;
  }

 private:
  [[nodiscard]] std::string folded(std::string_view s) const {
    return c_.case_matters ? std::string(s) : upper(s);
  }
  const PostCapabilities& c_;
  std::map<std::uint64_t, std::string> names_;
  std::set<std::string, std::less<>> used_;
  std::map<std::string, std::uint64_t> numbers_;  ///< by name: the last that was put behind it
};

}  // namespace robomosp::post
