// SPDX-License-Identifier: Apache-2.0
// What all tests read.
#pragma once

#include <gtest/gtest.h>

#include <chrono>
#include <fstream>
#include <iostream>
#include <random>
#include <thread>

#include "cmake/precompiled/sdk.h"
