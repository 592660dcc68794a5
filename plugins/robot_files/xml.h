// SPDX-License-Identifier: Apache-2.0
// Shared by the readers of robot files: checked numbers of XML attributes and texts, rotations, and
// locations of mesh files (layer: plugin).
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <robomosp/sdk/result.h>
#include <robomosp/sdk/types.h>

namespace tinyxml2 {
class XMLElement;
}

namespace robomosp::robot_files {

class Reach;

using Element = tinyxml2::XMLElement;

/// Larger numbers are taken as a sign of a damaged file.
inline constexpr double kGreatest = 1e12;
inline constexpr std::size_t kMostBodies = 10000;
inline constexpr std::size_t kMostShapes = 100000;

/// `line 12, <origin>`
[[nodiscard]] std::string place(const Element& e);
[[nodiscard]] Error fault(const Element& e, std::string message, std::string hint = {});
/// The attribute, or "".
[[nodiscard]] std::string_view word(const Element& e, const char* attribute);
[[nodiscard]] bool has(const Element& e, const char* attribute);
/// The text inside, without blanks around it.
[[nodiscard]] std::string_view inner(const Element& e);
[[nodiscard]] std::string in_quotes(std::string_view s);

/// All numbers of a text that is separated by blanks. `e` and `what` are for the message.
[[nodiscard]] Result<std::vector<double>> numbers(const Element& e, std::string_view text,
                                                  std::string_view what, std::size_t most = 64);
/// One number; `otherwise` if the attribute is missing.
[[nodiscard]] Result<double> number(const Element& e, const char* attribute, double otherwise);
[[nodiscard]] Result<Vec3> vec3(const Element& e, const char* attribute, Vec3 otherwise);
/// Exactly `out.size()` numbers of a text.
[[nodiscard]] Result<void> read(const Element& e, std::string_view text, std::string_view what,
                                std::span<double> out);

[[nodiscard]] Result<Vec3> unit_vector(const Element& e, const Vec3& v);
/// The least rotation that maps z to a unit vector.
[[nodiscard]] std::array<double, 9> turn_z_to(const Vec3& to);
[[nodiscard]] bool is_yes(std::string_view word, bool otherwise);

/// A file or folder of this relative path beside the folder's content or above it; else empty.
[[nodiscard]] std::filesystem::path found_above(const std::filesystem::path& relative,
                                                const std::filesystem::path& folder);

/// A URI with its percent escapes (RFC 3986, section 2.1) decoded.
[[nodiscard]] std::string without_escapes(std::string_view uri);
/// The file of a mesh's URI: package://, model:// and file:// as well as paths relative to the
/// folder of the robot's file. Packages are searched as folders of that name beside the file and
/// above it, then, within the package, by the path alone; so are files of file:// that are not
/// beside the file. If none is found, percent escapes are decoded. Empty if there is no such file,
/// or if it is out of reach, which is noted there.
[[nodiscard]] std::filesystem::path mesh_file(std::string_view uri,
                                              const std::filesystem::path& folder, Reach& reach);
/// Reports missing meshes by their names in the file as left out; those out of reach get a separate
/// sentence.
void tell_missing(const std::set<std::string>& meshes, const Reach& reach,
                  std::vector<std::string>& notes);

}  // namespace robomosp::robot_files
