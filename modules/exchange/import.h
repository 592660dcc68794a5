// SPDX-License-Identifier: Apache-2.0
// Records from foreign files, by providers of robomosp.importer/1 (layer: application, exchange).
#pragma once

#include <functional>
#include <string>
#include <vector>

#include <robomosp/sdk/csg.h>

#include "document/document.h"
#include "exchange/providers.h"
#include "io/native.h"
#include "kernel/fault.h"

namespace robomosp::exchange {

struct ImportRequest {
  std::string file;
  FormatValues values{};
  MaterialId material{};  ///< of all solids; number 0 = those of the file
};

/// What an import has to say of the records that it made, besides its messages.
struct ImportReport {
  struct Kept {
    AnyId record;
    std::vector<Fault> faults;
    /// True as long as the faults hold; empty = as long as the record exists.
    std::function<bool(const document::Snapshot&)> holds;
  };
  io::Loaded loaded;
  std::vector<Kept> kept;
};

/// Adds the records of a file to the transaction, with the meshes that it names in other files.
/// Remarks are posted as messages with the source "import" (notes of files: "io").
[[nodiscard]] Result<ImportReport> import_file(const Exchange&, document::Transaction&,
                                               const ImportRequest&);
/// The closed outlines of a drawing.
[[nodiscard]] Result<CsgProfile> import_profile(const Exchange&, const std::string& file,
                                                const FormatValues&);

}  // namespace robomosp::exchange
