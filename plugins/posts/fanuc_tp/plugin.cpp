// SPDX-License-Identifier: Apache-2.0
// Plugin post_fanuc_tp: programs to FANUC TP behind robomosp.post/1.
#include <robomosp/sdk/plugin.h>

#include "fanuc_tp.h"

RMP_PLUGIN("org.robomosp.post_fanuc_tp", "1.0.0", "Apache-2.0", "Programs to FANUC TP.",
           RMP_PROVIDER_NO_PARAMS(robomosp::post::FanucTp, "fanuc_tp", "FANUC TP programs (.LS).",
                                  "carried_base"))
