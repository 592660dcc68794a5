// SPDX-License-Identifier: Apache-2.0
// Providers "rrt_connect", "prm" and "bit_star" of robomosp.planner/1 (layer: plugin).
#include <robomosp/sdk/planner.h>
#include <robomosp/sdk/plugin.h>

#include "search.h"

namespace robomosp::planner_ompl {
namespace {

template <Method method>
class OneMethod final : public Planner {
 public:
  Result<Plan> plan(const PlanProblem& problem, const Params& params,
                    Progress& progress) const override {
    return search(method, problem, params, progress);
  }
};

using RrtConnect = OneMethod<Method::rrt_connect>;
using Prm = OneMethod<Method::prm>;
using BitStar = OneMethod<Method::bit_star>;

const rmp_param kRrtConnectParams[] = {
    {"range", "real", "", "Longest step of a tree, as a fraction of the maximum distance.", "0.025",
     nullptr, 1e-4, 1},
};
const rmp_param kPrmParams[] = {
    {"neighbours", "int", "", "Configurations to which a new one of the roadmap is connected.",
     "10", nullptr, 1, 1000},
    {"range", "real", "", "Longest motion of the roadmap, as a share of the greatest distance.",
     "0.3", nullptr, 1e-4, 1},
};
const rmp_param kBitStarParams[] = {
    {"batch", "int", "", "Configurations drawn at a time.", "100", nullptr, 1, 100000},
    {"checks", "int", "",
     "The search ends with the best known path after checking this many configurations and "
     "motions.",
     "5000", nullptr, 1, 1e9},
};

}  // namespace
}  // namespace robomosp::planner_ompl

namespace ours = robomosp::planner_ompl;
RMP_PLUGIN("org.robomosp.planner_ompl", "0.1.0", "Apache-2.0",
           "Paths around obstacles: two trees, a lazy roadmap, and BIT* of the Open Motion "
           "Planning Library.",
           RMP_PROVIDER(ours::RrtConnect, "rrt_connect",
                        "Two trees that grow towards each other from the start and the goals: the "
                        "fastest to a first path.",
                        "first", ours::kRrtConnectParams),
           RMP_PROVIDER(ours::BitStar, "bit_star",
                        "Batches of samples, searched in the order of their promise: shorter paths "
                        "for more checks.",
                        "shortest", ours::kBitStarParams),
           RMP_PROVIDER(ours::Prm, "prm",
                        "A roadmap that checks its motions only when a path would use them.",
                        "first", ours::kPrmParams))
