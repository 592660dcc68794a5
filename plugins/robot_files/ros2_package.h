// SPDX-License-Identifier: Apache-2.0
// A robot as a package of ROS 2: URDF with ros2_control, SRDF, meshes, settings of controllers and
// of MoveIt, and a launch file (layer: plugin).
#pragma once

#include <string>
#include <vector>

#include <robomosp/sdk/io.h>

#include "urdf_writer.h"

namespace robomosp::robot_files {

struct Ros2Wishes {
  std::string package;  ///< its name
  std::string description, maintainer, email, licence, version;
  std::string group = "manipulator";                       ///< of the SRDF
  std::string hardware = "mock_components/GenericSystem";  ///< plugin of ros2_control
  std::string command = "position";  ///< interface: position, velocity, effort
  double rate = 100;                 ///< of the controllers [Hz]
  bool with_bodies = true;
};

/// Violation of the rules of REP 144 by a package name; "" = none.
[[nodiscard]] std::string package_name_fault(const std::string& name);

/// The package of the only robot of the task, with the main file `package.xml`. Omissions are in
/// the report; names that ROS 2 does not allow are an error.
[[nodiscard]] Result<std::vector<ExportedFile>> write_ros2_package(const ExportTask&,
                                                                   const Ros2Wishes&,
                                                                   const StlWriter&, ExportReport&);

}  // namespace robomosp::robot_files
