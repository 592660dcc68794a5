// SPDX-License-Identifier: Apache-2.0
// What nearly every source of the engine and of the plugins reads: the standard library as far as
// they use it, and the SDK's basic types.
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <filesystem>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <mutex>
#include <numbers>
#include <numeric>
#include <optional>
#include <set>
#include <span>
#include <sstream>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <variant>
#include <vector>

#include <robomosp/sdk/plugin.h>
#include <robomosp/sdk/result.h>
#include <robomosp/sdk/robot_model.h>
