// SPDX-License-Identifier: Apache-2.0
// Values as text: the start of a value for messages and logs, and the table layout shared by all
// writers of values (layer: core).
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "kernel/value.h"

namespace robomosp {

/// Value::text() for callers that show only its start: the whole text if it has at most `most`
/// bytes, else a longer beginning, which may end anywhere. The rest takes no time. [any thread]
[[nodiscard]] std::string beginning_of(const Value&, std::size_t most);

/// True if the name consists of ASCII letters, digits and _, and does not begin with a digit: a key
/// that needs no brackets. [any thread]
[[nodiscard]] bool is_plain_name(std::string_view);

/// A value as text with lists and maps in braces: {1, 2}, {name = value}. `leaf(value, is_inside)`
/// writes other values, and `key(name)` writes a name with the separator before its value. A text
/// longer than `most` bytes may end anywhere. Values may be nested to any depth. [any thread]
template <class Leaf, class Key>
[[nodiscard]] std::string table_text(const Value& value, std::size_t most, const Leaf& leaf,
                                     const Key& key) {
  // An explicit stack, since the depth is set by the user.
  struct Level {
    const Value* container;
    std::size_t next = 0;
  };
  if (!value.as_list() && !value.as_map()) return leaf(value, false);
  std::string out = "{";
  std::vector<Level> stack{{&value}};
  while (!stack.empty() && out.size() <= most) {
    Level& level = stack.back();
    const List* list = level.container->as_list();
    const Map* map = level.container->as_map();
    if (level.next == (list ? list->size() : map->size())) {
      out += "}";
      stack.pop_back();
      continue;
    }
    if (level.next > 0) out += ", ";
    const Value* item = nullptr;
    if (list) {
      item = &(*list)[level.next];
    } else {
      const Map::Entry& entry = *(map->begin() + static_cast<std::ptrdiff_t>(level.next));
      out += key(entry.first);
      item = &entry.second;
    }
    ++level.next;
    if (item->as_list() || item->as_map()) {
      out += "{";
      stack.push_back({item});
    } else {
      out += leaf(*item, true);
    }
  }
  return out;
}

}  // namespace robomosp
