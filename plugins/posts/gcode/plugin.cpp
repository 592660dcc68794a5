// SPDX-License-Identifier: Apache-2.0
// Plugin post_gcode: programs to G-code behind robomosp.post/1.
#include <robomosp/sdk/plugin.h>

#include "gcode.h"

RMP_PLUGIN("org.robomosp.post_gcode", "1.0.0", "Apache-2.0", "Programs to G-code.",
           RMP_PROVIDER_NO_PARAMS(robomosp::post::GCode, "gcode", "G-code (RS274).", ""))
