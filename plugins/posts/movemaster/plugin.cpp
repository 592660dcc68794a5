// SPDX-License-Identifier: Apache-2.0
// Plugin post_movemaster: programs to Movemaster RV-M1 behind robomosp.post/1.
#include <robomosp/sdk/plugin.h>

#include "movemaster.h"

RMP_PLUGIN("org.robomosp.post_movemaster", "1.0.0", "Apache-2.0", "Programs to Movemaster RV-M1.",
           RMP_PROVIDER_NO_PARAMS(robomosp::post::Movemaster, "movemaster",
                                  "Command set of the Movemaster RV-M1.", ""))
