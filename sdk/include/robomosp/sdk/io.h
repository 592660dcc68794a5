// SPDX-License-Identifier: Apache-2.0
// Interfaces robomosp.importer/1 and robomosp.exporter/1: foreign files in and out
// (layer: contract, std only).
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <robomosp/sdk/params.h>
#include <robomosp/sdk/progress.h>
#include <robomosp/sdk/result.h>
#include <robomosp/sdk/types.h>

namespace robomosp {

/// What an importer hands over: native text records (docs: file grammar), and meshes they name.
struct ImportedFile {
  std::string name;  ///< native file name, e.g. "arm.rbt"
  std::string text;
};
struct ImportedMesh {
  std::string name;
  Mesh mesh;
};
struct Imported {
  std::vector<ImportedFile> records;
  std::vector<ImportedMesh> meshes;
  std::vector<std::string> notes;  ///< every repair and every thing left out, a sentence each
};

/// Interface robomosp.importer/1. [any thread]
class Importer {
 public:
  using Interface = Importer;
  static constexpr const char* kInterfaceId = "robomosp.importer/1";
  virtual ~Importer() = default;
  /// Lower-case extensions without dot, comma-separated.
  [[nodiscard]] virtual std::string_view extensions() const = 0;
  virtual Result<Imported> read(std::string_view path, const Params&, Progress&) const = 0;
};

/// A mesh at a place with its colour, for export.
struct ExportItem {
  std::string name;
  const Mesh* mesh = nullptr;
  Pose pose;
  Colour colour;
};

/// Interface robomosp.exporter/1. [any thread]
class Exporter {
 public:
  using Interface = Exporter;
  static constexpr const char* kInterfaceId = "robomosp.exporter/1";
  virtual ~Exporter() = default;
  [[nodiscard]] virtual std::string_view extensions() const = 0;
  /// The file's bytes; the host writes them atomically.
  virtual Result<std::string> write(std::span<const ExportItem> items, const Params&,
                                    Progress&) const = 0;
};

}  // namespace robomosp
