// SPDX-License-Identifier: Apache-2.0
// Plugin post_rapid: programs for ABB controllers behind robomosp.post/1.
#include <robomosp/sdk/plugin.h>

#include "rapid.h"

RMP_PLUGIN("org.robomosp.post_rapid", "1.0.0", "Apache-2.0", "Programs for ABB controllers.",
           RMP_PROVIDER_NO_PARAMS(robomosp::posts::Rapid, "rapid", "ABB RAPID: a module, .mod.",
                                  "several_robots,carried_base"))
