// SPDX-License-Identifier: Apache-2.0
// Generated code compiled by the system's compiler and loaded: one library a robot, kept in the
// user's cache folder (layer: plugin).
#pragma once

#include <memory>
#include <string>
#include <vector>

#include <robomosp/sdk/plugin.h>
#include <robomosp/sdk/result.h>
#include <robomosp/sdk/robot_model.h>

#include "mechanism.h"

namespace robomosp::robot_code {

using Single1 = void (*)(const double*, double*);
using Batch1 = void (*)(std::size_t, const double*, double*);
using Single3 = void (*)(const double*, const double*, const double*, double*);
using Batch3 = void (*)(std::size_t, const double*, const double*, const double*, double*);

/// The functions of one robot, forward dynamics only where they exist. Libraries are never closed.
struct Compiled {
  Single3 inverse_dynamics = nullptr, forward_dynamics = nullptr;
  Batch3 inverse_dynamics_batch = nullptr, forward_dynamics_batch = nullptr;
  Single1 inertia = nullptr, jacobian = nullptr, forward_kinematics = nullptr;
  Batch1 inertia_batch = nullptr;
};

/// Whether a robot without forward dynamics (closed loops, a singular inertia) is an error.
enum class ForwardDynamicsPolicy { optional, needed };

/// All functions of a model, as expressions; an error when they are too many operations.
Result<std::vector<Function>> all_functions(const RobotModel& model, ForwardDynamicsPolicy forward);

/// Compiles (or finds compiled) and checks some states against the expressions. The compiler is that of the
/// environment variable ROBOMOSP_CC, a path or a name on PATH; otherwise cc, gcc or clang from PATH.
Result<Compiled> compile(const RobotModel& model, ForwardDynamicsPolicy forward,
                         const rmp_host* host);

}  // namespace robomosp::robot_code
