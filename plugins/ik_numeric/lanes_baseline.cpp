// SPDX-License-Identifier: Apache-2.0
#define RMP_LANES 2
#define RMP_LANE_SPACE baseline
#define RMP_LANE_NAME "baseline"
#include "lanes_kernel.h"
