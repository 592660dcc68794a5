// SPDX-License-Identifier: Apache-2.0
// What all commands and the front ends read.
#pragma once

#include "cmake/precompiled/records.h"
#include "ioci/core/commands.h"
