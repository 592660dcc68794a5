// SPDX-License-Identifier: Apache-2.0
// Commands, settings and hooks of plugins; guarded where they are called (modules/ioci/core).
#include <robomosp/sdk/module.h>

#include "kernel/interface_file.h"

namespace robomosp {

RMP_INTERFACES(modules, plain_interface<Module>());

}  // namespace robomosp
