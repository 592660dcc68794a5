// SPDX-License-Identifier: GPL-3.0-or-later
// Short forms for reading results of commands (layer: GUI).
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <QString>

#include <robomosp/sdk/types.h>

#include "kernel/value.h"

namespace robomosp::viewer {

[[nodiscard]] inline QString shown(std::string_view text) {
  return QString::fromUtf8(text.data(), static_cast<qsizetype>(text.size()));
}
[[nodiscard]] inline std::string utf8(const QString& text) { return text.toStdString(); }

/// With a capital at its beginning.
[[nodiscard]] inline QString capitalized(QString text) {
  if (!text.isEmpty()) text[0] = text[0].toUpper();
  return text;
}

/// Members of a map; what is missing or of another type is "", false, 0 or null.
[[nodiscard]] inline std::string text_at(const Map& m, std::string_view key) {
  const Value* v = m.find(key);
  const std::string* text = v ? v->as_string() : nullptr;
  return text ? *text : std::string();
}
[[nodiscard]] inline bool flag_at(const Map& m, std::string_view key) {
  const Value* v = m.find(key);
  const bool* on = v ? v->as_bool() : nullptr;
  return on && *on;
}
[[nodiscard]] inline double number_at(const Map& m, std::string_view key) {
  const Value* v = m.find(key);
  return v ? v->number() : 0;
}
[[nodiscard]] inline std::int64_t whole_at(const Map& m, std::string_view key) {
  return static_cast<std::int64_t>(number_at(m, key));
}
[[nodiscard]] inline std::optional<Handle> handle_at(const Map& m, std::string_view key) {
  const Value* v = m.find(key);
  const Handle* h = v ? v->as_handle() : nullptr;
  return h ? std::optional(*h) : std::nullopt;
}
[[nodiscard]] inline const List& list_at(const Map& m, std::string_view key) {
  static const List none;
  const Value* v = m.find(key);
  const List* list = v ? v->as_list() : nullptr;
  return list ? *list : none;
}
[[nodiscard]] inline const List& list_of(const Value& v) {
  static const List none;
  const List* list = v.as_list();
  return list ? *list : none;
}
[[nodiscard]] inline const Map& map_of(const Value& v) {
  static const Map none;
  const Map* map = v.as_map();
  return map ? *map : none;
}
[[nodiscard]] inline const Map& map_at(const Map& m, std::string_view key) {
  static const Map none;
  const Value* v = m.find(key);
  return v ? map_of(*v) : none;
}
/// The numbers of an array or list; none of anything else.
[[nodiscard]] inline std::vector<double> numbers_of(const Value& v) {
  if (const NumericArray* a = v.as_array()) return {a->data().begin(), a->data().end()};
  std::vector<double> out;
  for (const Value& each : list_of(v)) out.push_back(each.number());
  return out;
}
[[nodiscard]] inline std::vector<double> numbers_at(const Map& m, std::string_view key) {
  const Value* v = m.find(key);
  return v ? numbers_of(*v) : std::vector<double>();
}
/// Two numbers of an array or list.
[[nodiscard]] inline std::optional<std::pair<double, double>> pair_at(const Map& m,
                                                                      std::string_view key) {
  const std::vector<double> n = numbers_at(m, key);
  return n.size() == 2 ? std::optional(std::pair(n[0], n[1])) : std::nullopt;
}
/// Three numbers of an array or list.
[[nodiscard]] inline std::optional<Vec3> vec_at(const Map& m, std::string_view key) {
  const std::vector<double> n = numbers_at(m, key);
  return n.size() == 3 ? std::optional(Vec3{n[0], n[1], n[2]}) : std::nullopt;
}

}  // namespace robomosp::viewer
