// SPDX-License-Identifier: Apache-2.0
// Plugin post_urscript: programs to URScript behind robomosp.post/1.
#include <robomosp/sdk/plugin.h>

#include "urscript.h"

RMP_PLUGIN("org.robomosp.post_urscript", "1.0.0", "Apache-2.0", "Programs to URScript.",
           RMP_PROVIDER_NO_PARAMS(robomosp::post::UrScript, "urscript",
                                  "URScript of Universal Robots.", ""))
