// SPDX-License-Identifier: Apache-2.0
// Plugin post_c99: programs in C behind robomosp.post/1.
#include <robomosp/sdk/plugin.h>

#include "c99.h"

RMP_PLUGIN("org.robomosp.post_c99", "1.0.0", "Apache-2.0", "Programs in C.",
           RMP_PROVIDER_NO_PARAMS(robomosp::posts::C99, "c",
                                  "C99 that drives a robot of a running ROBOMOSP.", ""),
           RMP_PROVIDER_NO_PARAMS(robomosp::posts::Pa10, "pa10",
                                  "C99 for the library of the Mitsubishi PA-10.", ""))
