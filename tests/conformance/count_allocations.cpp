// SPDX-License-Identifier: Apache-2.0
// The programs of this folder count allocations (conformance/allocations.h).
#include <robomosp/sdk/conformance/count_allocations.h>
