// SPDX-License-Identifier: Apache-2.0
// robomosp-exchange: STEP and IGES in and out (layer: plugin).
#include "formats.h"

#include <Standard_Failure.hxx>

namespace robomosp::cad_exchange {

Result<Scene> read_format(const std::string& path, const ReadOptions& o, Progress& progress) {
  if (o.format == "stp" || o.format == "step" || o.format == "igs" || o.format == "iges")
    return read_cad(path, with_unit(o), progress);
  return not_here(o.format);
}

Result<std::string> write_format(const Scene& scene, const WriteOptions& o, Progress& progress) {
  return write_cad(scene, o, progress);
}

std::string thrown_by_library() {
  try {
    throw;
  } catch (const Standard_Failure& e) {
    return e.GetMessageString() && *e.GetMessageString() ? e.GetMessageString()
                                                         : e.DynamicType()->Name();
  } catch (...) {
    return "it threw an unknown exception";
  }
}

}  // namespace robomosp::cad_exchange
