// SPDX-License-Identifier: Apache-2.0
// STL in, binary and text (layer: plugin, std only).
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <robomosp/sdk/result.h>

#include "scene.h"

namespace robomosp::cad_exchange {

/// One shape for each solid of a text file; a binary file is one. Coordinates are times `unit` [m].
/// Adds to `notes`, a sentence each, what was not read.
Result<std::vector<Shape>> read_stl(std::string_view bytes, double unit,
                                    std::vector<std::string>& notes);

}  // namespace robomosp::cad_exchange
