// SPDX-License-Identifier: Apache-2.0
// From a scene to native records: a solid for each part, an object for each assembly, a material
// for each colour (layer: plugin).
#pragma once

#include <string>

#include <robomosp/sdk/io.h>

#include "scene.h"

namespace robomosp::cad_exchange {

struct RecordOptions {
  std::string name;       ///< of the main record
  std::string source;     ///< the file, for people
  bool materials = true;  ///< make materials of colours; else solids have none
  double density = 0;     ///< of those materials [kg/m^3]; 0 = kDefaultDensity, with a note
};

/// Aluminium EN AW-6082, as in the library's aluminium.mtr: what machine parts are mostly made of,
/// and within a factor of three of the others [kg/m^3].
inline constexpr double kDefaultDensity = 2700;

/// The scene must have passed check().
Imported records(Scene scene, const RecordOptions& options);

}  // namespace robomosp::cad_exchange
