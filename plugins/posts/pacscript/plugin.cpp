// SPDX-License-Identifier: Apache-2.0
// Plugin post_pacscript: programs for Denso controllers behind robomosp.post/1.
#include <robomosp/sdk/plugin.h>

#include "pacscript.h"

RMP_PLUGIN("org.robomosp.post_pacscript", "1.0.0", "Apache-2.0",
           "Post-processor for Denso PacScript.",
           RMP_PROVIDER_NO_PARAMS(robomosp::post::pacscript::PacScript, "pacscript",
                                  "Denso PacScript (RC8): one file.", ""))
