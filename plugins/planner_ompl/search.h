// SPDX-License-Identifier: Apache-2.0
// One search, by a roadmap or a planner of OMPL (layer: plugin).
#pragma once

#include <robomosp/sdk/planner.h>

namespace robomosp::planner_ompl {

enum class Method { rrt_connect, prm, bit_star };

Result<Plan> search(Method method, const PlanProblem& problem, const Params& params,
                    Progress& progress);

}  // namespace robomosp::planner_ompl
