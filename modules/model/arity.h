// SPDX-License-Identifier: Apache-2.0
// Makes a struct that omits a member from its `fields` a compile error (layer: data processing,
// model).
#pragma once

#include <cstddef>
#include <initializer_list>
#include <string_view>

#include "kernel/arity.h"
#include "model/fields.h"

namespace robomosp::model::detail {

/// Counts the members that a declaration names, at compile time.
struct MemberCount {
  struct Forgotten {
    constexpr const Forgotten& label(std::string_view) const { return *this; }
    constexpr const Forgotten& doc(std::string_view) const { return *this; }
    constexpr const Forgotten& unit(std::string_view) const { return *this; }
    constexpr const Forgotten& unit_by(std::string_view (*)(const void*, std::size_t)) const {
      return *this;
    }
    constexpr const Forgotten& component_by(std::string_view (*)(const void*, std::size_t)) const {
      return *this;
    }
    constexpr const Forgotten& in_paths(std::string_view (*)(const void*)) const { return *this; }
    constexpr const Forgotten& counts_if(bool (*)(const void*)) const { return *this; }
    constexpr const Forgotten& file(std::string_view) const { return *this; }
    constexpr const Forgotten& flat_value() const { return *this; }
    constexpr const Forgotten& always_written() const { return *this; }
    constexpr const Forgotten& with_unit() const { return *this; }
    constexpr const Forgotten& by_kind() const { return *this; }
    constexpr const Forgotten& range(double, double) const { return *this; }
    constexpr const Forgotten& at_least(double) const { return *this; }
    constexpr const Forgotten& above(double) const { return *this; }
    constexpr const Forgotten& refers_to(std::initializer_list<Kind>) const { return *this; }
    constexpr const Forgotten& index_of(std::string_view) const { return *this; }
    constexpr const Forgotten& since(int) const { return *this; }
    constexpr const Forgotten& infinite() const { return *this; }
    constexpr const Forgotten& needed() const { return *this; }
    constexpr const Forgotten& read_only() const { return *this; }
    constexpr const Forgotten& flat() const { return *this; }
    constexpr const Forgotten& by_names() const { return *this; }
  };
  int n = 0;
  template <class M>
  constexpr Forgotten operator()(std::string_view, M) {
    ++n;
    return {};
  }
  constexpr void stands_for(int members) { n += members; }
  constexpr void alternative(std::size_t (*)(const void*)) {}
};
template <class T>
constexpr int member_count() {
  MemberCount v;
  fields(v, Of<T>{});
  return v.n;
}

/// A struct that has a member which its declaration leaves out does not compile.
template <class T>
void check_arity() {
  check_members<T, static_cast<std::size_t>(member_count<T>())>();
}

}  // namespace robomosp::model::detail
