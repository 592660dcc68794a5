// SPDX-License-Identifier: Apache-2.0
// Meshes that an imported file names in other files (layer: application, exchange; internal).
#pragma once

#include <array>
#include <cstdint>
#include <set>
#include <string>
#include <vector>

#include <robomosp/sdk/io.h>

#include "document/document.h"
#include "exchange/providers.h"
#include "io/geometry.h"
#include "io/native.h"
#include "kernel/fault.h"

namespace robomosp::exchange {

/// The fault of a sentence, which may have a period.
[[nodiscard]] Fault import_fault(const char* code, std::string sentence, Severity,
                                 const std::string& file);
/// Reads the meshes in separate files, each file once and several at the same time, and
/// adds them to the geometries. Those that failed are in `failed`, with a fault each in `left_out`.
[[nodiscard]] Result<void> read_foreign(const Exchange&, Imported&,
                                        std::vector<std::string>& failed,
                                        std::vector<Fault>& left_out);
/// A geometry in place of a mesh that could not be read, until its solid is removed again. No
/// content has its digest, by which that solid is found.
[[nodiscard]] io::GeometryPtr stand_in(const std::string& name);
/// Removes the solids with these digests from the robots that were made.
[[nodiscard]] Result<void> drop_failed(document::Transaction&, io::Loaded&,
                                       const std::set<std::array<std::uint64_t, 2>>& failed);

}  // namespace robomosp::exchange
