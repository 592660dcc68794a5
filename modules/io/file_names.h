// SPDX-License-Identifier: Apache-2.0
// Names of files as the document keeps them (layer: application). Internal to modules/io.
#pragma once

#include <filesystem>
#include <string>
#include <system_error>

#include "kernel/file_root.h"

namespace robomosp::io {

/// Absolute, without links and dots, as far as the path exists.
[[nodiscard]] inline std::string canonical_name(const std::filesystem::path& file) {
  std::error_code ec;
  if (current_file_root()) {
    const auto permitted = permitted_path(file, Effect::files_read);
    return (permitted.ok() ? *permitted : file.lexically_normal()).generic_string();
  }
  const auto p = std::filesystem::weakly_canonical(std::filesystem::absolute(file, ec), ec);
  return (ec ? file.lexically_normal() : p).generic_string();
}

/// There is a file, or something else that is no folder.
[[nodiscard]] inline bool is_file(const std::filesystem::path& p) {
  const FileKind kind = file_kind(p);
  return kind == FileKind::file || kind == FileKind::other;
}

}  // namespace robomosp::io
