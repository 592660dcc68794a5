// SPDX-License-Identifier: Apache-2.0
// Mutator: changes texts at random, some so that the syntax stays and the meaning breaks.
#pragma once

#include <algorithm>
#include <cctype>
#include <random>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace robomosp::test {

class Mutator {
 public:
  /// `all` texts and `tokens` are what is put into others; they must outlive it.
  Mutator(std::mt19937& random, const std::vector<std::string>& all,
          std::span<const char* const> tokens)
      : random_(random), all_(all), tokens_(tokens) {}

  std::string mutate(std::string s) {
    for (std::size_t n = 1 + pick(4); n > 0; --n) {
      if (s.empty()) return s;
      const std::size_t at = pick(s.size()), length = std::min(1 + pick(12), s.size() - at);
      switch (pick(7)) {
        case 0: s[at] = static_cast<char>(pick(256)); break;
        case 1: s.erase(at, length); break;
        case 2: s.insert(at, s.substr(at, length)); break;
        case 3: s.insert(at, tokens_[pick(tokens_.size())]); break;
        case 4: {
          const std::string& other = all_[pick(all_.size())];
          const std::size_t from = pick(other.size());
          s.insert(at, other.substr(from, 1 + pick(80)));
          break;
        }
        case 5: replace_word(s, at); break;
        default: s.resize(at); break;
      }
    }
    return s;
  }

 private:
  std::size_t pick(std::size_t n) {
    return std::uniform_int_distribution<std::size_t>(0, n - 1)(random_);
  }
  /// Puts a word of another sample in the place of one: keeps the syntax and breaks the meaning.
  void replace_word(std::string& s, std::size_t at) {
    const auto word = [](const std::string& t, std::size_t i) {
      std::size_t b = i, e = i;
      while (b > 0 && !std::isspace(static_cast<unsigned char>(t[b - 1]))) --b;
      while (e < t.size() && !std::isspace(static_cast<unsigned char>(t[e]))) ++e;
      return std::pair{b, e - b};
    };
    const std::string& other = all_[pick(all_.size())];
    const auto [b, n] = word(s, at);
    const auto [ob, on] = word(other, pick(other.size()));
    s.replace(b, n, other.substr(ob, on));
  }

  std::mt19937& random_;
  const std::vector<std::string>& all_;
  std::span<const char* const> tokens_;
};

}  // namespace robomosp::test
