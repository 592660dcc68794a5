// SPDX-License-Identifier: Apache-2.0
// Functions of the worker programs (formats.h); all of them may crash or hang on a bad file, so
// they run in separate programs (layer: plugin).
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <robomosp/sdk/progress.h>
#include <robomosp/sdk/result.h>

#include "../scene.h"

namespace robomosp::cad_exchange {

struct ReadOptions {
  std::string format;  ///< extension, lower case
  bool heal = true;
  double unit = 0;  ///< length of one unit if the file does not state it [m]; 0 = not given
};

struct WriteOptions {
  std::string format;            ///< "step" or "iges"
  std::string unit = "mm";       ///< of the file
  std::string schema = "ap214";  ///< of STEP: "ap203", "ap214", "ap242"
};

/// STEP and IGES through Open CASCADE, units, names, colours and assemblies included.
Result<Scene> read_cad(const std::string& path, const ReadOptions&, Progress&);
Result<std::string> write_cad(const Scene&, const WriteOptions&, Progress&);
/// Meshes through Assimp: OBJ, PLY, glTF, GLB, DAE.
Result<Scene> read_meshes(const std::string& path, const ReadOptions&, Progress&);
/// 3MF: core, materials and production; it reports parts of other extensions as left out.
Result<Scene> read_3mf(const std::string& path, Progress&);

}  // namespace robomosp::cad_exchange
