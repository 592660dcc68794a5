// SPDX-License-Identifier: Apache-2.0
// A struct whose `fields` leaves a member out does not compile (layer: data processing, model).
#pragma once

#include <cstddef>
#include <initializer_list>
#include <string_view>

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

inline constexpr std::size_t kMostMembers = 26;

/// Decomposes T into as many members as are declared: another number is an error of the compiler.
template <class T>
void check_arity() {
  constexpr int n = member_count<T>();
  static_assert(n <= static_cast<int>(kMostMembers), "more members: add lines below");
  using V = T;
  if constexpr (n == 1) {
    [[maybe_unused]] constexpr auto f = [](V& v) { [[maybe_unused]] auto& [m1] = v; };
  } else if constexpr (n == 2) {
    [[maybe_unused]] constexpr auto f = [](V& v) { [[maybe_unused]] auto& [m1, m2] = v; };
  } else if constexpr (n == 3) {
    [[maybe_unused]] constexpr auto f = [](V& v) { [[maybe_unused]] auto& [m1, m2, m3] = v; };
  } else if constexpr (n == 4) {
    [[maybe_unused]] constexpr auto f = [](V& v) { [[maybe_unused]] auto& [m1, m2, m3, m4] = v; };
  } else if constexpr (n == 5) {
    [[maybe_unused]] constexpr auto f = [](V& v) {
      [[maybe_unused]] auto& [m1, m2, m3, m4, m5] = v;
    };
  } else if constexpr (n == 6) {
    [[maybe_unused]] constexpr auto f = [](V& v) {
      [[maybe_unused]] auto& [m1, m2, m3, m4, m5, m6] = v;
    };
  } else if constexpr (n == 7) {
    [[maybe_unused]] constexpr auto f = [](V& v) {
      [[maybe_unused]] auto& [m1, m2, m3, m4, m5, m6, m7] = v;
    };
  } else if constexpr (n == 8) {
    [[maybe_unused]] constexpr auto f = [](V& v) {
      [[maybe_unused]] auto& [m1, m2, m3, m4, m5, m6, m7, m8] = v;
    };
  } else if constexpr (n == 9) {
    [[maybe_unused]] constexpr auto f = [](V& v) {
      [[maybe_unused]] auto& [m1, m2, m3, m4, m5, m6, m7, m8, m9] = v;
    };
  } else if constexpr (n == 10) {
    [[maybe_unused]] constexpr auto f = [](V& v) {
      [[maybe_unused]] auto& [m1, m2, m3, m4, m5, m6, m7, m8, m9, m10] = v;
    };
  } else if constexpr (n == 11) {
    [[maybe_unused]] constexpr auto f = [](V& v) {
      [[maybe_unused]] auto& [m1, m2, m3, m4, m5, m6, m7, m8, m9, m10, m11] = v;
    };
  } else if constexpr (n == 12) {
    [[maybe_unused]] constexpr auto f = [](V& v) {
      [[maybe_unused]] auto& [m1, m2, m3, m4, m5, m6, m7, m8, m9, m10, m11, m12] = v;
    };
  } else if constexpr (n == 13) {
    [[maybe_unused]] constexpr auto f = [](V& v) {
      [[maybe_unused]] auto& [m1, m2, m3, m4, m5, m6, m7, m8, m9, m10, m11, m12, m13] = v;
    };
  } else if constexpr (n == 14) {
    [[maybe_unused]] constexpr auto f = [](V& v) {
      [[maybe_unused]] auto& [m1, m2, m3, m4, m5, m6, m7, m8, m9, m10, m11, m12, m13, m14] = v;
    };
  } else if constexpr (n == 15) {
    [[maybe_unused]] constexpr auto f = [](V& v) {
      [[maybe_unused]] auto& [m1, m2, m3, m4, m5, m6, m7, m8, m9, m10, m11, m12, m13, m14, m15] = v;
    };
  } else if constexpr (n == 16) {
    [[maybe_unused]] constexpr auto f = [](V& v) {
      [[maybe_unused]] auto& [m1, m2, m3, m4, m5, m6, m7, m8, m9, m10, m11, m12, m13, m14, m15,
                              m16] = v;
    };
  } else if constexpr (n == 17) {
    [[maybe_unused]] constexpr auto f = [](V& v) {
      [[maybe_unused]] auto& [m1, m2, m3, m4, m5, m6, m7, m8, m9, m10, m11, m12, m13, m14, m15, m16,
                              m17] = v;
    };
  } else if constexpr (n == 18) {
    [[maybe_unused]] constexpr auto f = [](V& v) {
      [[maybe_unused]] auto& [m1, m2, m3, m4, m5, m6, m7, m8, m9, m10, m11, m12, m13, m14, m15, m16,
                              m17, m18] = v;
    };
  } else if constexpr (n == 19) {
    [[maybe_unused]] constexpr auto f = [](V& v) {
      [[maybe_unused]] auto& [m1, m2, m3, m4, m5, m6, m7, m8, m9, m10, m11, m12, m13, m14, m15, m16,
                              m17, m18, m19] = v;
    };
  } else if constexpr (n == 20) {
    [[maybe_unused]] constexpr auto f = [](V& v) {
      [[maybe_unused]] auto& [m1, m2, m3, m4, m5, m6, m7, m8, m9, m10, m11, m12, m13, m14, m15, m16,
                              m17, m18, m19, m20] = v;
    };
  } else if constexpr (n == 21) {
    [[maybe_unused]] constexpr auto f = [](V& v) {
      [[maybe_unused]] auto& [m1, m2, m3, m4, m5, m6, m7, m8, m9, m10, m11, m12, m13, m14, m15, m16,
                              m17, m18, m19, m20, m21] = v;
    };
  } else if constexpr (n == 22) {
    [[maybe_unused]] constexpr auto f = [](V& v) {
      [[maybe_unused]] auto& [m1, m2, m3, m4, m5, m6, m7, m8, m9, m10, m11, m12, m13, m14, m15, m16,
                              m17, m18, m19, m20, m21, m22] = v;
    };
  } else if constexpr (n == 23) {
    [[maybe_unused]] constexpr auto f = [](V& v) {
      [[maybe_unused]] auto& [m1, m2, m3, m4, m5, m6, m7, m8, m9, m10, m11, m12, m13, m14, m15, m16,
                              m17, m18, m19, m20, m21, m22, m23] = v;
    };
  } else if constexpr (n == 24) {
    [[maybe_unused]] constexpr auto f = [](V& v) {
      [[maybe_unused]] auto& [m1, m2, m3, m4, m5, m6, m7, m8, m9, m10, m11, m12, m13, m14, m15, m16,
                              m17, m18, m19, m20, m21, m22, m23, m24] = v;
    };
  } else if constexpr (n == 25) {
    [[maybe_unused]] constexpr auto f = [](V& v) {
      [[maybe_unused]] auto& [m1, m2, m3, m4, m5, m6, m7, m8, m9, m10, m11, m12, m13, m14, m15, m16,
                              m17, m18, m19, m20, m21, m22, m23, m24, m25] = v;
    };
  } else if constexpr (n == 26) {
    [[maybe_unused]] constexpr auto f = [](V& v) {
      [[maybe_unused]] auto& [m1, m2, m3, m4, m5, m6, m7, m8, m9, m10, m11, m12, m13, m14, m15, m16,
                              m17, m18, m19, m20, m21, m22, m23, m24, m25, m26] = v;
    };
  }
}

}  // namespace robomosp::model::detail
