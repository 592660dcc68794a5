// SPDX-License-Identifier: Apache-2.0
// What the tests read that link the engine or the front ends.
#pragma once

#include "cmake/precompiled/commands.h"
#include "cmake/precompiled/tests.h"
#include "evaluation/derived.h"
#include "io/native.h"
#include "lua/lua_state.h"
