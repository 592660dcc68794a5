// SPDX-License-Identifier: Apache-2.0
// Interface robomosp.robot_code/1: source code of one robot's kinematics and dynamics for the
// user's own controller (layer: contract, std only).
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include <robomosp/sdk/params.h>
#include <robomosp/sdk/progress.h>
#include <robomosp/sdk/result.h>
#include <robomosp/sdk/robot_model.h>

namespace robomosp {

/// Functions to generate, to be summed by `|`.
enum RobotCodePart : std::uint32_t {
  kCodeForwardKinematics = 1,  ///< poses of the tips
  kCodeJacobian = 2,           ///< of the first tip
  kCodeInverseDynamics = 4,
  kCodeInertia = 8,
  kCodeForwardDynamics = 16,
  kCodeAll = 31,
};

struct CodeFile {
  std::string name;  ///< "puma560.h"
  std::string text;
};

/// Interface robomosp.robot_code/1. [any thread]
class RobotCodeGenerator {
 public:
  using Interface = RobotCodeGenerator;
  static constexpr const char* kInterfaceId = "robomosp.robot_code/1";
  virtual ~RobotCodeGenerator() = default;
  /// Self-contained source files; `name` is a C identifier that starts every symbol.
  virtual Result<std::vector<CodeFile>> generate(const RobotModel& model, std::string_view name,
                                                 std::uint32_t parts, const Params&,
                                                 Progress&) const = 0;
};

}  // namespace robomosp
