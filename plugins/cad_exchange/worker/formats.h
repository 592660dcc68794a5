// SPDX-License-Identifier: Apache-2.0
// What a worker program reads and writes. Each program has one file that says so, with the
// libraries of its formats only: starting one that links Open CASCADE takes longer than to read
// most meshes (layer: plugin).
#pragma once

#include <string>

#include "worker.h"

namespace robomosp::cad_exchange {

/// Before its meshes are finished. `unit` is 0 where none is given.
Result<Scene> read_format(const std::string& path, const ReadOptions&, Progress&);
Result<std::string> write_format(const Scene&, const WriteOptions&, Progress&);
/// The words of what is being caught and is no std::exception.
std::string thrown_by_library();

/// The answer of a program to a format that another one is for.
inline Error not_here(const std::string& format) {
  return error(ErrorCode::unsupported, "this program does not know the format \"" + format + "\"",
               "Reinstall the program; its parts do not match.");
}
/// The unit of a file that states none.
inline ReadOptions with_unit(ReadOptions o) {
  if (!(o.unit > 0)) o.unit = 1e-3;
  return o;
}

}  // namespace robomosp::cad_exchange
