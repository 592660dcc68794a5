// SPDX-License-Identifier: Apache-2.0
#include "ioci/robot/branch_wish.h"

#include <cctype>

namespace robomosp::ioci {
namespace {

/// Without what may stand between the parts of a word.
std::string bare(std::string_view word) {
  std::string out;
  for (const char c : word)
    if (c != ' ' && c != '_' && c != '-')
      out += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return out;
}

std::vector<std::string> split_words(std::string_view text) {
  std::vector<std::string> out(1);
  for (const char c : text) {
    if (c == ' ' || c == ',' || c == '\t') out.emplace_back();
    else out.back() += c;
  }
  std::erase_if(out, [](const std::string& w) { return w.empty(); });
  return out;
}

}  // namespace

Result<sim::BranchWish> read_branch_wish(const sim::BranchNames& names, const Value& given,
                                         const std::string& path) {
  const auto choices = names.choices();
  sim::BranchWish out;
  out.ways.assign(choices.size(), 0);
  const auto refused = [&](std::string message) {
    return error(ErrorCode::invalid_argument, std::move(message),
                 "The words are " + names.words() + ".", path);
  };
  const auto take = [&](std::size_t k, int way) -> Result<void> {
    if (out.ways[k] == -way)
      return refused(text::quote(choices[k].positive) + " and " + text::quote(choices[k].negative) +
                     " exclude each other");
    out.ways[k] = way;
    return {};
  };
  // The way of a word: 1, -1, or 0 = it is none of this choice.
  const auto way_of = [&](std::size_t k, const std::string& word) {
    return bare(word) == bare(choices[k].positive)   ? 1
           : bare(word) == bare(choices[k].negative) ? -1
                                                     : 0;
  };
  if (const Map* table = given.as_map()) {
    for (const auto& [key, value] : *table) {
      std::vector<std::string> known;
      std::size_t k = 0;
      for (; k < choices.size() && choices[k].name != key; ++k) known.emplace_back(choices[k].name);
      if (k == choices.size()) return unknown_name("choice of a branch", key, known).in(path);
      const int way = value.as_string() ? way_of(k, *value.as_string()) : 0;
      if (way == 0)
        return refused(value.text() + " is not a branch of the " + key + ": " +
                       choices[k].positive + " or " + choices[k].negative);
      RMP_TRY(take(k, way));
    }
  } else {
    std::vector<std::string> words;
    if (const std::string* text = given.as_string()) {
      words = split_words(*text);
    } else if (const List* list = given.as_list()) {
      for (const Value& v : *list) {
        if (!v.as_string()) return refused(v.text() + " is not a word for a branch");
        words.push_back(*v.as_string());
      }
    } else {
      return refused(given.text() + " is not a branch");
    }
    for (std::size_t i = 0; i < words.size(); ++i) {
      int way = 0;
      const auto look = [&](const std::string& word) -> Result<void> {
        for (std::size_t k = 0; k < choices.size() && way == 0; ++k)
          if ((way = way_of(k, word)) != 0) RMP_TRY(take(k, way));
        return {};
      };
      // "no flip" is two words of a text.
      if (i + 1 < words.size()) RMP_TRY(look(words[i] + words[i + 1]));
      if (way != 0) ++i;
      else RMP_TRY(look(words[i]));
      if (way == 0) return refused(text::quote(words[i]) + " is not a word for a branch");
    }
  }
  for (std::size_t k = 0; k < choices.size(); ++k)
    if (out.ways[k] != 0)
      out.words += (out.words.empty() ? "" : " ") +
                   std::string(out.ways[k] > 0 ? choices[k].positive : choices[k].negative);
  if (out.words.empty()) return refused("no branch is named");
  return out;
}

}  // namespace robomosp::ioci
