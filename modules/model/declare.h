// SPDX-License-Identifier: Apache-2.0
// Builds a Type from the `fields(...)` beside a struct (layer: data processing, model). Expensive:
// include it only where a struct's type is defined (model/types.cpp, a file that defines a kind).
#pragma once

#include <array>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

#include <robomosp/sdk/types.h>

#include "model/arity.h"
#include "model/fields.h"
#include "model/records.h"

namespace robomosp::model {

namespace detail {

template <class T>
concept HasWords = requires {
  words(Of<T>{});
};
template <class T>
struct IsId : std::false_type {};
template <Kind K>
struct IsId<Id<K>> : std::true_type {
  static constexpr Kind kind = K;
};
template <class T>
struct NumberCount : std::integral_constant<std::size_t, 0> {};
template <std::size_t N>
struct NumberCount<std::array<double, N>> : std::integral_constant<std::size_t, N> {};
template <>
struct NumberCount<Sym3> : std::integral_constant<std::size_t, 6> {};
static_assert(sizeof(Sym3) == 6 * sizeof(double) && sizeof(Colour) == 4 * sizeof(float));

template <class T>
struct Element {
  static constexpr bool is_list = false, is_long = false, is_optional = false, is_shared = false,
                        is_table = false;
};
template <class T>
struct Element<std::vector<T>> : Element<void> {
  static constexpr bool is_list = true;
  using type = T;
};
template <class T>
struct Element<LongList<T>> : Element<void> {
  static constexpr bool is_list = true, is_long = true;
  using type = T;
};
template <class T>
struct Element<std::optional<T>> : Element<void> {
  static constexpr bool is_optional = true;
  using type = T;
};
template <class T>
struct Element<std::shared_ptr<const T>> : Element<void> {
  static constexpr bool is_shared = true;
  using type = T;
};
template <class T>
struct Element<std::map<std::string, T>> : Element<void> {
  static constexpr bool is_table = true;
  using type = T;
};

/// Argument of `fields`: collects the members of T.
template <class T>
class Declaration {
 public:
  explicit Declaration(Type& type)
      : type_(type), sample_(static_cast<const T*>(type.standard.get())) {
    type_.fields.reserve(kMostMembers);  // so that references to fields stay valid
  }
  template <class M>
  Field& operator()(std::string_view name, M T::*member) {
    Field& f = type_.fields.emplace_back();
    f.name = name;
    f.type = &type_of<M>();
    f.offset = static_cast<std::size_t>(reinterpret_cast<const std::byte*>(&(sample_->*member)) -
                                        reinterpret_cast<const std::byte*>(sample_));
    return f;
  }
  /// Members that are aliases of another member.
  void stands_for(int) {}
  /// Selects the part of units such as "rad|m" in T and below.
  void alternative(std::size_t (*f)(const void*)) { type_.alternative = f; }

 private:
  Type& type_;
  const T* sample_;
};

template <class T>
void set_shape(Type& t) {
  using E = Element<T>;
  if constexpr (std::is_same_v<T, bool>) {
    t.shape = Shape::boolean;
  } else if constexpr (std::is_enum_v<T>) {
    t.shape = Shape::word;
    std::int64_t value = 0;
    if constexpr (HasWords<T>)
      for (const auto& w : words(Of<T>{})) t.words.push_back({w, value++});
    else t.words = numbered_words(Of<T>{});
    t.whole = [](const void* p) { return static_cast<std::int64_t>(*static_cast<const T*>(p)); };
    t.set_whole = [](void* p, std::int64_t v) { *static_cast<T*>(p) = static_cast<T>(v); };
  } else if constexpr (std::is_integral_v<T>) {
    t.shape = Shape::integer;
    t.whole = [](const void* p) { return static_cast<std::int64_t>(*static_cast<const T*>(p)); };
    t.set_whole = [](void* p, std::int64_t v) { *static_cast<T*>(p) = static_cast<T>(v); };
  } else if constexpr (std::is_same_v<T, double>) {
    t.shape = Shape::real;
  } else if constexpr (std::is_same_v<T, std::string>) {
    t.shape = Shape::text;
    t.has_heap = true;
  } else if constexpr (NumberCount<T>::value > 0) {
    t.shape = Shape::numbers;
    t.count = NumberCount<T>::value;
  } else if constexpr (std::is_same_v<T, std::vector<double>>) {
    t.shape = Shape::reals;
    t.has_heap = true;
  } else if constexpr (std::is_same_v<T, Colour>) {
    t.shape = Shape::colour;
  } else if constexpr (std::is_same_v<T, std::array<std::uint64_t, 2>>) {
    t.shape = Shape::digest;
  } else if constexpr (std::is_same_v<T, AnyId> || IsId<T>::value) {
    t.shape = Shape::reference;
    t.has_references = true;
    if constexpr (IsId<T>::value) t.kinds = {IsId<T>::kind};
    t.id = [](const void* p) { return AnyId(*static_cast<const T*>(p)); };
    t.set_id = [](void* p, AnyId id) {
      if constexpr (IsId<T>::value) static_cast<T*>(p)->number = id.number;
      else *static_cast<AnyId*>(p) = id;
    };
  } else if constexpr (std::is_same_v<T, ProviderChoice::Param>) {
    t.shape = Shape::setting;
    t.has_heap = true;
  } else if constexpr (E::is_list) {
    t.shape = Shape::list;
    t.element = &type_of<typename E::type>();
    t.has_heap = true;
    t.length = [](const void* p) { return static_cast<const T*>(p)->size(); };
    t.resize = [](void* p, std::size_t n) { static_cast<T*>(p)->resize(n); };
    if constexpr (E::is_long) {
      t.block = T::kBlock;
      t.item = [](const void* p, std::size_t i) -> const void* {
        return &(*static_cast<const T*>(p))[i];
      };
      t.item_for_change = [](void* p, std::size_t i) -> void* { return &(*static_cast<T*>(p))[i]; };
      t.take_out = [](void* p, std::size_t i) { static_cast<T*>(p)->erase(i); };
    } else {
      t.data = [](const void* p) -> const void* { return static_cast<const T*>(p)->data(); };
      t.take_out = [](void* p, std::size_t i) {
        auto& list = *static_cast<T*>(p);
        list.erase(list.begin() + static_cast<std::ptrdiff_t>(i));
      };
    }
  } else if constexpr (E::is_optional) {
    t.shape = Shape::optional;
    t.element = &type_of<typename E::type>();
    t.held = [](const void* p) -> const void* {
      const auto& v = *static_cast<const T*>(p);
      return v ? &*v : nullptr;
    };
    t.hold = [](void* p) -> void* {
      auto& v = *static_cast<T*>(p);
      return v ? &*v : &v.emplace();
    };
    t.drop = [](void* p) { static_cast<T*>(p)->reset(); };
  } else if constexpr (E::is_shared) {
    t.shape = Shape::shared;
    t.element = &type_of<typename E::type>();
    t.held = [](const void* p) -> const void* { return static_cast<const T*>(p)->get(); };
    t.hold = [](void* p) -> void* {
      using V = typename E::type;
      auto& v = *static_cast<T*>(p);
      auto copy = v ? std::make_shared<V>(*v) : std::make_shared<V>();
      V* inner = copy.get();
      v = std::move(copy);
      return inner;
    };
    t.drop = [](void* p) { static_cast<T*>(p)->reset(); };
  } else if constexpr (E::is_table) {
    t.shape = Shape::table;
    t.element = &type_of<typename E::type>();
    t.has_heap = true;
    t.each = [](const void* p, const std::function<void(const std::string&, const void*)>& fn) {
      for (const auto& [key, v] : *static_cast<const T*>(p)) fn(key, &v);
    };
    t.entry = [](void* p, const std::string& key) -> void* { return &(*static_cast<T*>(p))[key]; };
    t.erase = [](void* p, const std::string& key) { static_cast<T*>(p)->erase(key); };
  } else {
    check_arity<T>();
    t.shape = Shape::structure;
    Declaration<T> declaration(t);
    fields(declaration, Of<T>{});
  }
}

}  // namespace detail

template <class T>
const Type& type_of() {
  static const Type type = [] {
    Type t;
    t.size = sizeof(T);
    t.standard = std::make_shared<const T>();
    t.assign = [](void* to, const void* from) {
      *static_cast<T*>(to) = *static_cast<const T*>(from);
    };
    t.clone = [](const void* p) -> std::shared_ptr<void> {
      return std::make_shared<T>(*static_cast<const T*>(p));
    };
    detail::set_shape<T>(t);
    const auto inherit = [&t](const Type& inner) {
      t.has_references = t.has_references || inner.has_references;
      t.has_heap = t.has_heap || inner.has_heap;
    };
    if (t.element && t.shape != Shape::shared) inherit(*t.element);
    for (const Field& f : t.fields) inherit(*f.type);
    return t;
  }();
  return type;
}

/// Registers a kind with the content T.
template <class T>
Kind register_kind_of(std::string_view name, std::string_view extension, std::string_view folder) {
  return register_kind({name, extension, folder, &type_of<T>()});
}

}  // namespace robomosp::model
