// SPDX-License-Identifier: Apache-2.0
// Plugin post_krl: programs for KUKA controllers behind robomosp.post/1.
#include <robomosp/sdk/plugin.h>

#include "krl.h"

RMP_PLUGIN("org.robomosp.post_krl", "1.0.0", "Apache-2.0", "Programs for KUKA controllers.",
           RMP_PROVIDER_NO_PARAMS(robomosp::posts::Krl, "krl",
                                  "KUKA Robot Language: .src and .dat.", "carried_base"))
