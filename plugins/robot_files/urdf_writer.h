// SPDX-License-Identifier: Apache-2.0
// Robots as URDF: links and joints as XML, meshes in separate files, and a report of features that
// URDF lacks (layer: plugin).
#pragma once

#include <functional>
#include <set>
#include <string>
#include <vector>

#include <robomosp/sdk/io.h>

namespace robomosp::robot_files {

struct UrdfWishes {
  std::string package;      ///< of ROS; "" = meshes are named relative to the file
  bool with_bodies = true;  ///< write the shapes
  /// Folder of the meshes, beside the file or from the package's root; "" = `<name>_meshes`.
  std::string mesh_folder = {};
};
/// Names of the robot's parts in the file.
struct UrdfNames {
  std::string root, base;           ///< links; equal if the base is at the root
  std::vector<std::string> joints;  ///< of each joint of the model; "" of a ball joint
  std::vector<std::string> frames;  ///< links of the mechanism's frames
  std::set<std::string> links;      ///< all of them
};
/// The bytes of an STL file in metres of one item, ignoring its pose.
using StlWriter = std::function<Result<std::string>(const ExportItem&)>;

/// The only robot of the task as URDF, first, and its meshes in a folder `<name>_meshes`. Notes and
/// the counts of links and joints are added to the report. `names` receives the names used.
[[nodiscard]] Result<std::vector<ExportedFile>> write_urdf(const ExportTask&, const UrdfWishes&,
                                                           const StlWriter&, ExportReport&,
                                                           UrdfNames* names = nullptr);

}  // namespace robomosp::robot_files
