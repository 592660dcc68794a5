// SPDX-License-Identifier: Apache-2.0
// Meshes of MuJoCo's formats (STL, OBJ, MSH) for their mass only, and the rules by which it weighs
// them; what is drawn of them is read by the host (layer: plugin).
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

/// How MuJoCo takes a mesh: `legacy`, its default, adds up the pyramids from the middle of the
/// surface to every triangle, all positive, and so counts too much of what is not star-shaped from
/// there; `exact` is what the triangles enclose; `convex` the hull; `shell` the surface, whose
/// density is for its area.
enum class MeshInertia : std::uint8_t { legacy, exact, convex, shell };

/// Mass and inertia at density 1, in the file's frame; `size` multiplies the coordinates. nullopt
/// when there is no volume, or for `shell` no area.
[[nodiscard]] std::optional<MassProperties> mesh_mass(const MeshFile& mesh, const Vec3& size,
                                                      MeshInertia rule);

/// Masses of mesh files, each read once.
class MeshMasses {
 public:
  /// As mesh_mass(); nullopt also for a file that cannot be read, or only by the host.
  std::optional<MassProperties> of(const std::string& file, const Vec3& size, MeshInertia rule);

 private:
  using Key = std::tuple<std::string, Vec3, MeshInertia>;
  std::map<Key, std::optional<MassProperties>> known_;
};

}  // namespace robomosp::robot_files
