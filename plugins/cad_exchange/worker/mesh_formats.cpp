// SPDX-License-Identifier: Apache-2.0
// robomosp-exchange-mesh: OBJ, PLY, glTF, GLB, COLLADA and 3MF in (layer: plugin).
#include "formats.h"

namespace robomosp::cad_exchange {

Result<Scene> read_format(const std::string& path, const ReadOptions& o, Progress& progress) {
  if (o.format == "3mf") return read_3mf(path, progress);
  return read_meshes(path, with_unit(o), progress);
}

Result<std::string> write_format(const Scene&, const WriteOptions& o, Progress&) {
  return not_here(o.format);
}

std::string thrown_by_library() { return "it threw an unknown exception"; }

}  // namespace robomosp::cad_exchange
