// SPDX-License-Identifier: Apache-2.0
// The door of the plugin csg_occt.
#include <cstdint>

#include <robomosp/sdk/plugin.h>

#include "engine.h"

using robomosp::csg_occt::OcctCsgEngine;

RMP_PLUGIN("org.robomosp.csg_occt", "0.1.0", "Apache-2.0",
           "CSG trees to exact solids by Open CASCADE",
           RMP_PROVIDER_NO_PARAMS(OcctCsgEngine, "occt",
                                  "Exact boundary representation, verified boolean operations, "
                                  "analytic mass properties.",
                                  "exact,brep,overlap"))
