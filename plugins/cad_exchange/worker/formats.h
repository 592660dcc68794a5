// SPDX-License-Identifier: Apache-2.0
// Entry points of worker programs for reading and writing files. Each program has one file that
// implements them and links only the libraries of its formats: starting a program that links Open
// CASCADE takes longer than reading most meshes (layer: plugin).
#pragma once

#include <string>

#include "worker.h"

namespace robomosp::cad_exchange {

/// Reads a file, before its meshes are finished. `unit` is 0 if not given.
Result<Scene> read_format(const std::string& path, const ReadOptions&, Progress&);
Result<std::string> write_format(const Scene&, const WriteOptions&, Progress&);
/// The message of an exception being caught that is not a std::exception.
std::string thrown_by_library();

/// The error of a program for a format that another one handles.
inline Error not_here(const std::string& format) {
  return error(ErrorCode::unsupported, "this program does not know the format \"" + format + "\"",
               "Reinstall the program; its parts do not match.");
}
/// Adds the default unit for a file that states none.
inline ReadOptions with_unit(ReadOptions o) {
  if (!(o.unit > 0)) o.unit = 1e-3;
  return o;
}

}  // namespace robomosp::cad_exchange
