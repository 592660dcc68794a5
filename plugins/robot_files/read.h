// SPDX-License-Identifier: Apache-2.0
// The readers of the three formats, and the choice between them by the root element (layer:
// plugin). None of them trusts its input: sizes, depth and numbers are bounded.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

#include <robomosp/sdk/io.h>

#include "documents.h"
#include "mechanism.h"
#include "reach.h"
#include "xml.h"

namespace robomosp::robot_files {

struct Options {
  std::filesystem::path folder;  ///< of the file: mesh paths are relative to it
  std::filesystem::path file;    ///< "" = text without a file
  std::string source;            ///< the file's name, for people
  std::string name;              ///< of the robot; "" = the file's
  bool collision = false;        ///< take the collision shapes, not the visual ones
  /// What the file may have opened; made by default for `folder`.
  std::shared_ptr<Reach> reach{};
};

[[nodiscard]] Result<Mechanism> read_urdf(const Element& robot, const Options&);
[[nodiscard]] Result<Mechanism> read_mjcf(const Element& mujoco, const Options&, Documents&);
[[nodiscard]] Result<Mechanism> read_sdf(const Element& sdf, const Options&, Documents&);

/// Text of a robot file of any of the formats, as native records.
[[nodiscard]] Result<Imported> read_robot(std::string_view text, Options);

}  // namespace robomosp::robot_files
