// SPDX-License-Identifier: Apache-2.0
// What tells one build of a file from another (layer: core). [any thread]
#pragma once

#include <filesystem>

#include "kernel/fingerprint.h"

namespace robomosp {

/// Adds size and time of a file; false, and that there is none, where it is no file.
bool add_file_stamp(Fingerprinter&, const std::filesystem::path& file);

}  // namespace robomosp
