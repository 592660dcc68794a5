// SPDX-License-Identifier: Apache-2.0
// What the modules that read records have in common.
#pragma once

#include "cmake/precompiled/sdk.h"
#include "kernel/fingerprint.h"
#include "kernel/registry.h"
#include "kernel/text.h"
#include "kernel/units.h"
#include "model/placement.h"
#include "model/records.h"
#include "spatial/pose.h"
