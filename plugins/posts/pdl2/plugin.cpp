// SPDX-License-Identifier: Apache-2.0
// Plugin post_pdl2: programs for Comau controllers behind robomosp.post/1.
#include <robomosp/sdk/plugin.h>

#include "pdl2.h"

RMP_PLUGIN("org.robomosp.post_pdl2", "1.0.0", "Apache-2.0", "Post-processor for Comau PDL2.",
           RMP_PROVIDER_NO_PARAMS(robomosp::post::pdl2::Pdl2, "pdl2", "Comau PDL2: one program.",
                                  "several_robots,carried_base"))
