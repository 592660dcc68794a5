// SPDX-License-Identifier: GPL-3.0-or-later
// The door of the plugin csg_cgal.
#include <cstdint>

#include <robomosp/sdk/plugin.h>

#include "engine.h"

using robomosp::csg_cgal::CgalCsgEngine;

RMP_PLUGIN("org.robomosp.csg_cgal", "0.1.0", "GPL-3.0-or-later",
           "CSG trees to solids of triangles by CGAL, for imported meshes",
           RMP_PROVIDER_NO_PARAMS(CgalCsgEngine, "cgal",
                                  "Closed triangle meshes with exact boolean operations; curved "
                                  "faces are approximate, imported meshes are supported.",
                                  "mesh,approximate,overlap"))
