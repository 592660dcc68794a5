// SPDX-License-Identifier: Apache-2.0
// Text of a record in the native grammar (layer: application). Internal to modules/io.
#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include <robomosp/sdk/result.h>

#include "document/document.h"

namespace robomosp::io {

/// The path to be written for a reference.
using PathOf = std::function<std::string(AnyId)>;

/// Fixed field order, defaults left out, shortest numbers: equal records give equal bytes. `file`
/// is its future path: geometries are named after it (geometry_file_name).
[[nodiscard]] Result<std::string> print_record(const document::Snapshot&, const model::Record&,
                                               const std::filesystem::path& file, const PathOf&);

}  // namespace robomosp::io
