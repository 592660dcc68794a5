// SPDX-License-Identifier: Apache-2.0
// Plugin post_melfa: programs to MELFA-BASIC IV and V behind robomosp.post/1.
#include <robomosp/sdk/plugin.h>

#include "melfa.h"

RMP_PLUGIN("org.robomosp.post_melfa", "1.0.0", "Apache-2.0", "Programs to MELFA-BASIC IV and V.",
           RMP_PROVIDER_NO_PARAMS(robomosp::post::Melfa4, "melfa4", "MELFA-BASIC IV of Mitsubishi.",
                                  ""),
           RMP_PROVIDER_NO_PARAMS(robomosp::post::Melfa5, "melfa5", "MELFA-BASIC V of Mitsubishi.",
                                  ""))
