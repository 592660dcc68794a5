// SPDX-License-Identifier: Apache-2.0
// Materials, solids, objects, robots, trajectories and worlds of ROBOMOSP 1.4 (2006): from their
// files to records, and from the first three to such files (layer: application). Format:
// docs/user/files-2006.md.
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include <robomosp/sdk/result.h>

#include "document/document.h"
#include "io/native.h"

namespace robomosp::io {

/// Reads a file of the 2006 program and what it refers to into the transaction. References are
/// looked for below the folder of the file or one above it ("./Saves/..." starts at the
/// installation), beside it, and in its sibling folders Materials, CSGs, Objects, Robots,
/// Trajectories, Worlds. Records get no file, so that saving never overwrites one of those; one
/// that is equal to a record of its name is that record. A solid has one material here, there each
/// primitive has its own: a .csg of several becomes an object with one solid a material, or, when
/// `wanted` is a solid, one solid of its first material, and a note says so. Cached masses are not
/// read. All or nothing; a fault's `where` is `file:line:column`.
[[nodiscard]] Result<Loaded> load_legacy(document::Transaction&, const std::filesystem::path& file,
                                         std::optional<Kind> wanted);
/// Whether a file is one of that program, by its content; false when it cannot be read.
[[nodiscard]] bool is_legacy_file(const std::filesystem::path& file);

/// Writes a material, solid or object and all it refers to below `folder` as the 2006 program keeps
/// them: Saves/Materials, Saves/CSGs, Saves/Objects. A node that the format cannot express is an
/// error that names it; a file that is there with another content is one unless `overwrite`.
/// Nothing is written when anything is wrong. Returns the paths, the record asked for last.
[[nodiscard]] Result<std::vector<std::filesystem::path>> export_legacy(
    const document::Snapshot&, AnyId, const std::filesystem::path& folder, bool overwrite);

}  // namespace robomosp::io
