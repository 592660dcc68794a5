// SPDX-License-Identifier: Apache-2.0
// Distinguishes one build of a file from another (layer: core). [any thread]
#pragma once

#include <filesystem>

#include "kernel/fingerprint.h"

namespace robomosp {

/// Adds size and modification time of a file; if there is no file, adds that fact and returns
/// false.
bool add_file_stamp(Fingerprinter&, const std::filesystem::path& file);

}  // namespace robomosp
