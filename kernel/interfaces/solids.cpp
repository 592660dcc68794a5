// SPDX-License-Identifier: Apache-2.0
// Engines of solids and primitives; what they make is checked where it is derived.
#include <robomosp/sdk/csg.h>
#include <robomosp/sdk/csg_primitive.h>

#include "kernel/interface_file.h"

namespace robomosp {

RMP_INTERFACES(solids, plain_interface<CsgEngine>("occt"), plain_interface<CsgPrimitive>());

}  // namespace robomosp
