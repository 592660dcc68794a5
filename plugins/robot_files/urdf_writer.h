// SPDX-License-Identifier: Apache-2.0
// Robots as URDF: links and joints as XML, meshes in files beside it, and a report of what URDF has
// no words for (layer: plugin).
#pragma once

#include <functional>
#include <string>
#include <vector>

#include <robomosp/sdk/io.h>

namespace robomosp::robot_files {

struct UrdfWishes {
  std::string package;      ///< of ROS; "" = meshes are named relative to the file
  bool with_bodies = true;  ///< write the shapes
};
/// The bytes of an STL file in metres of one item, whose pose does not count.
using StlWriter = std::function<Result<std::string>(const ExportItem&)>;

/// The only robot of the task as URDF, first, and its meshes in a folder `<name>_meshes`. Notes and
/// the counts of links and joints are added to the report.
[[nodiscard]] Result<std::vector<ExportedFile>> write_urdf(const ExportTask&, const UrdfWishes&,
                                                           const StlWriter&, ExportReport&);

}  // namespace robomosp::robot_files
