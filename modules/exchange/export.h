// SPDX-License-Identifier: Apache-2.0
// Records to foreign files, by providers of robomosp.exporter/1 (layer: application, exchange).
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <robomosp/sdk/io.h>

#include "exchange/providers.h"
#include "model/kind.h"

namespace robomosp::exchange {

struct ExportRequest {
  std::string file;
  std::string extension;  ///< decides the format; without the dot
  FormatValues values{};
  Map own{};             ///< values of the format that the caller sets itself
  bool as_mesh = false;  ///< of a DXF file: triangles, not the section
  /// Section plane of a drawing, cut along its x and y; empty = level at half the height.
  std::optional<Pose> plane{};
  double chord = 0;                 ///< [m] greatest deviation of triangles; 0 = that of each solid
  std::vector<ExportPair> pairs{};  ///< of a robot (export_pairs())
  bool may_replace = true;          ///< existing files
};

struct Exported {
  std::string file;
  std::vector<std::string> others, notes;
  std::vector<std::filesystem::path> replaced;  ///< files that held something else
  std::size_t parts = 0, triangles = 0;
  std::vector<ExportReport::Count> counts;
};

/// Writes a record by the provider for files of the extension. The height of a section that was
/// chosen is posted as a message.
[[nodiscard]] Result<Exported> export_record(const Exchange&, AnyId, ExportRequest);

}  // namespace robomosp::exchange
