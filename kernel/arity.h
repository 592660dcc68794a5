// SPDX-License-Identifier: Apache-2.0
// Makes a struct with another number of members than declared a compile error (layer: core,
// header-only).
#pragma once

#include <cstddef>

namespace robomosp {

inline constexpr std::size_t kMostMembers = 26;

/// Decomposes T into n members: another number is a compile error.
template <class T, std::size_t n>
void check_members() {
  static_assert(n > 0 && n <= kMostMembers, "more members: add lines below");
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

}  // namespace robomosp
