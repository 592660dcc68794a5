// SPDX-License-Identifier: Apache-2.0
// A record with all that it refers to, as texts: what one program sends to another (layer:
// application).
#pragma once

#include <string>

#include <robomosp/sdk/result.h>

#include "document/document.h"
#include "io/native.h"

namespace robomosp::io {

/// The texts of a record and of what it refers to, and their geometries, under names of their own;
/// load_memory() reads them again. The records are those of the snapshot, whatever files have.
struct Pack {
  std::string main;  ///< name of the record itself
  MemoryFiles files;
};
[[nodiscard]] Result<Pack> pack(const document::Snapshot&, AnyId);

}  // namespace robomosp::io
