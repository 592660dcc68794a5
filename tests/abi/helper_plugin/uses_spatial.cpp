// SPDX-License-Identifier: Apache-2.0
// Links the installed helper library; nothing of it is run.
#include "spatial/mass.h"
#include "spatial/pose.h"
#include "spatial/rotation.h"

double used();
double used() { return robomosp::spatial::from_rpy({0.1, 0.2, 0.3})[0]; }
