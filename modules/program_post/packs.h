// SPDX-License-Identifier: Apache-2.0
// Packs of templates as files and folders, and the packs loaded as targets at program start (layer:
// application).
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "program_post/templates.h"

namespace robomosp {
class Messages;
class Registry;
}  // namespace robomosp

namespace robomosp::program_post {

/// The tag of targets that are made of templates.
inline constexpr const char* kByTemplates = "templates";
/// The main file of a pack in a folder, which includes the others.
inline constexpr const char* kPackFile = "pack.post";

/// Reads a pack with the files it includes, which are beside it. `read` returns the text of a file
/// of at most the given number of bytes.
using ReadPack = std::function<Result<std::string>(const std::filesystem::path&, std::uint64_t)>;
[[nodiscard]] Result<std::shared_ptr<const TemplatePack>> read_pack(
    const std::filesystem::path&, const ReadPack& read, std::vector<PackFault>* faults = nullptr);

/// The faults of a pack (a file or a folder), one by one; empty = none, or it cannot be read at
/// all.
[[nodiscard]] std::vector<PackFault> pack_faults(std::filesystem::path);

/// Adds the target of a pack. A pack may replace one of the same name where permitted, but nothing
/// else. Returns its name.
Result<std::string> add_pack(Registry&, const std::filesystem::path&,
                             std::shared_ptr<const TemplatePack>, bool replaces);

/// Adds the packs of folders, in order: files *.post, and folders with a pack.post. The first of a
/// name is used; hidden packs and faults of packs are reported.
void load_packs(Registry&, Messages&, std::span<const std::filesystem::path> folders);

}  // namespace robomosp::program_post
