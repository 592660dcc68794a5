// SPDX-License-Identifier: Apache-2.0
// Meshes of MuJoCo's formats (STL, OBJ, MSH), for their mass only, with its rules; the host reads
// them for drawing (layer: plugin).
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

#include <robomosp/sdk/result.h>
#include <robomosp/sdk/types.h>

namespace robomosp::robot_files {

struct MeshFile {
  std::vector<double> points;            ///< 3 a corner, as in the file
  std::vector<std::uint32_t> triangles;  ///< 3 indices each, in range
};

/// At most 256 MiB, by the file's extension. Polygons are divided into fans.
[[nodiscard]] Result<MeshFile> read_mesh_file(const std::filesystem::path& file);
/// The same of a file's content; `extension` in lower case, without dot.
[[nodiscard]] Result<MeshFile> parse_mesh(std::string_view bytes, std::string_view extension);

/// MuJoCo's interpretation of a mesh: `legacy`, its default, adds up the pyramids from the middle
/// of the surface to every triangle, all positive, and so overestimates shapes that are not
/// star-shaped from there; `exact` is the enclosed volume; `convex` the hull; `shell` the surface,
/// with a density per area.
enum class MeshInertia : std::uint8_t { legacy, exact, convex, shell };

/// Mass and inertia at density 1, in the file's frame; `size` multiplies the coordinates. nullopt
/// if there is no volume, or for `shell` no area.
[[nodiscard]] std::optional<MassProperties> mesh_mass(const MeshFile& mesh, const Vec3& size,
                                                      MeshInertia rule);

/// Masses of mesh files, each read once.
class MeshMasses {
 public:
  /// As mesh_mass(); also nullopt for a file that cannot be read, or only by the host.
  std::optional<MassProperties> of(const std::string& file, const Vec3& size, MeshInertia rule);

 private:
  using Key = std::tuple<std::string, Vec3, MeshInertia>;
  std::map<Key, std::optional<MassProperties>> known_;
};

}  // namespace robomosp::robot_files
