// SPDX-License-Identifier: Apache-2.0
#define RMP_LANES 4
#define RMP_LANE_SPACE avx2
#define RMP_LANE_NAME "AVX2"
#include "lanes_kernel.h"
