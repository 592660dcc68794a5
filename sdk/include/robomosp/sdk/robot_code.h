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

/// Functions to generate, to be summed by `|`, named as their comments begin. Of a robot with
/// closed loops the last three are those of the closed mechanism, for states that keep the loops
/// closed: forces of the motors with entries 0 at passive joints, and the inertia R M R^T that they
/// feel (f = R tau). A generator that writes them so has the tag `loops`; others refuse them.
enum RobotCodePart : std::uint32_t {
  kCodeForwardKinematics = 1,  ///< forward_kinematics: q to the poses of all tips in the base
  kCodeJacobian = 2,           ///< jacobian: q to (v, w) of the first tip by qd, in the base's axes
  kCodeInverseDynamics = 4,    ///< inverse_dynamics: q, qd, qdd to tau of all terms
  kCodeInertia = 8,            ///< inertia: q to M with the motors'
  kCodeForwardDynamics = 16,   ///< forward_dynamics: q, qd, tau to qdd
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
  /// What later versions of the SDK add, by its id (plugin.h); nullptr = not known.
  [[nodiscard]] virtual const void* extension(const char* /*id*/) const { return nullptr; }
  /// Self-contained source files, with names that start with `name`; it is an identifier and starts
  /// every symbol, or is the module of all. Equal models give equal text. What the language or the
  /// provider cannot do is ErrorCode::unsupported.
  virtual Result<std::vector<CodeFile>> generate(const RobotModel& model, std::string_view name,
                                                 std::uint32_t parts, const Params&,
                                                 Progress&) const = 0;
};

}  // namespace robomosp
