// SPDX-License-Identifier: Apache-2.0
// Geometry files beside solid records, what an `imported` node holds: B-rep text (.brep) and closed
// triangle meshes (.ply) (layer: application). Formats: docs/user/files.md. [any thread]
#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

#include <robomosp/sdk/csg.h>
#include <robomosp/sdk/result.h>

namespace robomosp::io {

using GeometryPtr = std::shared_ptr<const CsgGeometry>;

inline constexpr std::size_t kMostGeometryBytes = std::size_t{1} << 30;  ///< of one file

/// ".brep" or ".ply".
[[nodiscard]] std::string_view geometry_extension(CsgGeometry::Form);

/// Checks a geometry and sets its digest: a B-rep must be a text of Open CASCADE's format, a mesh
/// must have finite points, triangles of known and different corners, and no open edge (every edge
/// is used as often in one direction as in the other, corners compared by index). All that makes
/// geometries (importers, files, commands) ends here.
[[nodiscard]] Result<GeometryPtr> make_geometry(CsgGeometry);

/// The bytes of a geometry's file: the B-rep text as it is, or binary little-endian PLY with double
/// positions in metres. Equal content gives equal bytes.
[[nodiscard]] Result<std::string> geometry_bytes(const CsgGeometry&);

/// The geometry of a file's bytes; `shown` names the file in errors, `source` becomes
/// CsgGeometry::source.
[[nodiscard]] Result<GeometryPtr> parse_geometry(CsgGeometry::Form, std::string bytes,
                                                 const std::string& shown, std::string source = {});

/// Reads a geometry file; its extension (.brep or .ply) determines the form.
[[nodiscard]] Result<GeometryPtr> read_geometry(const std::filesystem::path&,
                                                std::string source = {});

/// The name of the file that a geometry of the record saved at `record` is written to, beside it:
/// "housing-0f3a5c7d9e1b2a4c.brep". It is made of the content's digest, so that a file is never
/// overwritten by other content.
[[nodiscard]] std::string geometry_file_name(const std::filesystem::path& record,
                                             const CsgGeometry&);

}  // namespace robomosp::io
