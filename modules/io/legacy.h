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

/// Reads a file of the 2006 program and the files it refers to into the transaction. References are
/// searched below the folder of the file or one above it ("./Saves/..." starts at the
/// installation), beside it, and in its sibling folders Materials, CSGs, Objects, Robots,
/// Trajectories, Worlds. Records get no file, so that saving never overwrites one of those; one
/// that equals an existing record of its name becomes that record. Here a solid has one material,
/// there each primitive has one: a .csg with several becomes an object with one solid per material,
/// or, if `wanted` is a solid, one solid of its first material, with a note. Cached masses are not
/// read. All or nothing; a fault's `where` is `file:line:column`.
[[nodiscard]] Result<Loaded> load_legacy(document::Transaction&, const std::filesystem::path& file,
                                         std::optional<Kind> wanted);
/// True if a file is of that program, by its content; false if it cannot be read.
[[nodiscard]] bool is_legacy_file(const std::filesystem::path& file);

/// Writes a material, solid or object and all records it refers to below `folder` in the layout of
/// the 2006 program: Saves/Materials, Saves/CSGs, Saves/Objects. A node that the format cannot
/// express is an error that names it, and so is an existing file with different content unless
/// `overwrite`. On any error nothing is written. Returns the paths, the requested record last.
[[nodiscard]] Result<std::vector<std::filesystem::path>> export_legacy(
    const document::Snapshot&, AnyId, const std::filesystem::path& folder, bool overwrite);

}  // namespace robomosp::io
