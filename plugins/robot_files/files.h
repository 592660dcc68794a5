// SPDX-License-Identifier: Apache-2.0
// Files named by a robot's file, with the access of the session that reads it (robomosp.files/1)
// (layer: plugin).
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include <robomosp/sdk/plugin.h>
#include <robomosp/sdk/result.h>

namespace robomosp::robot_files::files {

/// From now on, files are read through the host, which is the same for all; without that interface,
/// the file system is used. [any thread]
void use(const rmp_host* host) noexcept;

[[nodiscard]] bool exists(const std::filesystem::path&);
[[nodiscard]] bool is_file(const std::filesystem::path&);
[[nodiscard]] bool is_folder(const std::filesystem::path&);
/// The bytes of a file; an error above `most`.
[[nodiscard]] Result<std::string> read(const std::filesystem::path&, std::uint64_t most);

}  // namespace robomosp::robot_files::files
