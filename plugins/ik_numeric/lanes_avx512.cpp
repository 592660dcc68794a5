// SPDX-License-Identifier: Apache-2.0
#define RMP_LANES 8
#define RMP_LANE_SPACE avx512
#define RMP_LANE_NAME "AVX-512"
#include "lanes_kernel.h"
