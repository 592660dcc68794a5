// SPDX-License-Identifier: Apache-2.0
// Packs of templates as files and folders, and those that are targets when the program starts
// (layer: application).
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

namespace robomosp::ioci {

/// The tag of targets that are made of templates.
inline constexpr const char* kByTemplates = "templates";
/// In a folder that is a pack, the file that the others are included by.
inline constexpr const char* kPackFile = "pack.post";

/// Reads a pack with the files that it includes, which lie beside it. `read` gives the text of a
/// file of at most so many bytes.
using ReadPack = std::function<Result<std::string>(const std::filesystem::path&, std::uint64_t)>;
[[nodiscard]] Result<std::shared_ptr<const program_post::TemplatePack>> read_pack(
    const std::filesystem::path&, const ReadPack& read,
    std::vector<program_post::PackFault>* faults = nullptr);

/// What is wrong with a pack, that is a file or a folder, one by one; empty = nothing, or it cannot
/// be read at all.
[[nodiscard]] std::vector<program_post::PackFault> pack_faults(std::filesystem::path);

/// Adds the target of a pack. A pack takes the place of one of the same name where it may, but of
/// nothing else. Gives its name.
Result<std::string> add_pack(Registry&, const std::filesystem::path&,
                             std::shared_ptr<const program_post::TemplatePack>, bool replaces);

/// Adds the packs of folders, in order: files *.post, and folders with a pack.post. What comes
/// first is taken; what is hidden by it, and what is wrong with a pack, is said.
void load_packs(Registry&, Messages&, std::span<const std::filesystem::path> folders);

}  // namespace robomosp::ioci
