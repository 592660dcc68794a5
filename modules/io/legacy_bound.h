// SPDX-License-Identifier: Apache-2.0
// A record read from a file of ROBOMOSP 1.4 (2006), with its unresolved references and the names in
// it (layer: application). Internal to modules/io. Format: docs/user/files-2006.md.
#pragma once

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <robomosp/sdk/names.h>
#include <robomosp/sdk/result.h>

#include "document/document.h"
#include "document/validate.h"
#include "io/bind.h"
#include "kernel/fresh_names.h"

namespace robomosp::io {

/// Nodes, parts or links of one tree at most.
inline constexpr std::size_t kMostLegacyNodes = 100000;

/// The name of a file without folder and extension, whichever slashes it was written with.
inline std::string legacy_stem(std::string path) {
  std::replace(path.begin(), path.end(), '\\', '/');
  return std::filesystem::path(path).stem().string();
}

/// A name that a record, node or part may have.
inline std::string plain_name(std::string wanted, std::string_view otherwise) {
  while (!wanted.empty() && wanted.back() == ' ') wanted.pop_back();
  wanted.erase(0, std::min(wanted.find_first_not_of(' '), wanted.size()));
  wanted = with_name_characters(wanted);
  if (!document::is_name(wanted)) wanted = std::string(otherwise) + "_" + wanted;
  return document::is_name(wanted) ? wanted : std::string(otherwise);
}

struct LegacyBound {
  model::Record record;
  std::vector<Reference> references;
  /// Offset of an element (document::Subject) in the text.
  std::map<std::pair<std::string_view, std::size_t>, std::uint32_t> places;
  /// References (by index) to records that come from the same text, not from the path.
  std::map<std::size_t, std::shared_ptr<LegacyBound>> made;
  /// Reads what depends on the references; may add notes.
  std::function<Result<void>(model::Body&, const document::Snapshot&, std::vector<std::string>&)>
      finish;
  std::vector<std::string> notes;
  bool is_assembly = false;  ///< an .obj
};

}  // namespace robomosp::io
