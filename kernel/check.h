// SPDX-License-Identifier: Apache-2.0
// RMP_CHECK: an invariant that only a defect of this program can break; prints it and aborts, also
// in release builds (layer: core).
#pragma once

#include <cstdio>
#include <cstdlib>

#define RMP_CHECK(condition, what)                                                               \
  do {                                                                                           \
    if (!(condition)) {                                                                          \
      std::fprintf(stderr, "robomosp: internal error at %s:%d: %s\n", __FILE__, __LINE__, what); \
      std::abort();                                                                              \
    }                                                                                            \
  } while (false)
