// SPDX-License-Identifier: Apache-2.0
// A record with all records it refers to, as texts: sent from one program to another (layer:
// application).
#pragma once

#include <string>

#include <robomosp/sdk/result.h>

#include "document/document.h"
#include "io/native.h"

namespace robomosp::io {

/// The texts of a record and of those it refers to, and their geometries, under generated names;
/// load_memory() reads them again. Uses the records of the snapshot, not their files.
struct Pack {
  std::string main;  ///< name of the record itself
  MemoryFiles files;
};
[[nodiscard]] Result<Pack> pack(const document::Snapshot&, AnyId);

}  // namespace robomosp::io
