// SPDX-License-Identifier: Apache-2.0
#include "ioci/core/secrets.h"

#include <algorithm>
#include <array>
#include <string>
#include <vector>

namespace robomosp::ioci {
namespace {

constexpr std::array<std::string_view, 5> kSecretWords{"token", "password", "passphrase", "secret",
                                                       "credential"};

/// Calls `visit(name, value)` for all entries of maps among arguments, at any depth, until it
/// returns true; whether it did.
template <class Visit>
bool any_entry(const Map& args, const Visit& visit) {
  std::vector<const Value*> open;
  const auto look = [&](const Map& map) {
    return std::any_of(map.begin(), map.end(), [&](const Map::Entry& e) {
      if (visit(e.first, e.second)) return true;
      if (e.second.as_map() || e.second.as_list()) open.push_back(&e.second);
      return false;
    });
  };
  if (look(args)) return true;
  while (!open.empty()) {
    const Value* at = open.back();
    open.pop_back();
    if (const Map* map = at->as_map()) {
      if (look(*map)) return true;
    } else {
      for (const Value& each : *at->as_list())
        if (each.as_map() || each.as_list()) open.push_back(&each);
    }
  }
  return false;
}

// NOLINTBEGIN(misc-no-recursion): values are as deep as what made them
Map redacted(const Map& args);
Value redacted(const Value& v) {
  if (const Map* map = v.as_map()) return redacted(*map);
  const List* list = v.as_list();
  if (!list) return v;
  List out;
  for (const Value& each : *list) out.push_back(redacted(each));
  return out;
}
Map redacted(const Map& args) {
  Map out;
  for (const auto& [name, value] : args)
    out.append(name, is_secret(name) && !value.is_nil() ? Value(kRedacted) : redacted(value));
  return out;
}
// NOLINTEND(misc-no-recursion)

}  // namespace

bool is_secret(std::string_view argument) {
  const auto lower = [](char c) {
    return static_cast<char>(c >= 'A' && c <= 'Z' ? c - 'A' + 'a' : c);
  };
  const auto equals = [&lower](std::string_view word, std::string_view to) {
    return std::equal(word.begin(), word.end(), to.begin(), to.end(),
                      [&lower](char a, char b) { return lower(a) == b; });
  };
  bool is_found = false;
  std::string_view word;
  for (std::size_t from = 0; from <= argument.size(); from += word.size() + 1) {
    word = argument.substr(from, argument.find_first_of("_-.", from) - from);
    // Of most words the first letter decides.
    if (word.empty() || std::none_of(kSecretWords.begin(), kSecretWords.end(),
                                     [first = lower(word.front())](std::string_view secret) {
                                       return secret.front() == first;
                                     }))
      continue;
    // token and tokens, but not tokenizer.
    const std::string_view one =
        word.size() > 1 && lower(word.back()) == 's' ? word.substr(0, word.size() - 1) : word;
    is_found = is_found ||
               std::any_of(kSecretWords.begin(), kSecretWords.end(), [&](std::string_view secret) {
                 return equals(word, secret) || equals(one, secret);
               });
  }
  return is_found && !equals(word, "file");
}

bool has_secrets(const Map& args) {
  return any_entry(args, [](const std::string& name, const Value& value) {
    const std::string* text = value.as_string();
    return is_secret(name) && !value.is_nil() && !(text && *text == kRedacted);
  });
}

Map without_secrets(const Map& args) { return has_secrets(args) ? redacted(args) : args; }

}  // namespace robomosp::ioci
