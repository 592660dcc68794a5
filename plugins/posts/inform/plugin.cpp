// SPDX-License-Identifier: Apache-2.0
// Plugin post_inform: programs to Yaskawa INFORM behind robomosp.post/1.
#include <robomosp/sdk/plugin.h>

#include "inform.h"

RMP_PLUGIN("org.robomosp.post_inform", "1.0.0", "Apache-2.0", "Programs to Yaskawa INFORM.",
           RMP_PROVIDER_NO_PARAMS(robomosp::post::Inform, "inform",
                                  "INFORM jobs of Yaskawa Motoman (.JBI).", ""))
