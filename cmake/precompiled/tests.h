// SPDX-License-Identifier: Apache-2.0
// What the tests read.
#pragma once

#include <gtest/gtest.h>

#include <fstream>
#include <random>

#include "cmake/precompiled/sdk.h"
