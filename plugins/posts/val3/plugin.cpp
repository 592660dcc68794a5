// SPDX-License-Identifier: Apache-2.0
// Plugin post_val3: programs for Staubli controllers behind robomosp.post/1.
#include <robomosp/sdk/plugin.h>

#include "val3.h"

RMP_PLUGIN("org.robomosp.post_val3", "1.0.0", "Apache-2.0", "Post-processor for Staubli VAL3.",
           RMP_PROVIDER_NO_PARAMS(robomosp::post::val3::Val3, "val3",
                                  "Staubli VAL3: an application's folder.", ""))
