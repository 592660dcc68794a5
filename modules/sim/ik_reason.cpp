// SPDX-License-Identifier: Apache-2.0
#include "sim/ik_reason.h"

#include <limits>
#include <memory>
#include <vector>

#include "robotics/joint_limits.h"

namespace robomosp::sim {

std::string ik_reason(const Registry& registry, const Bound<IkSolver>& ik,
                      const model::ProviderChoice& choice, const IkResult& r, const Pose& target,
                      std::span<const double> seed, const robotics::MakerAxes& axes,
                      Progress& progress) {
  const RobotModel& model = *ik.model;
  std::string own = axes.in_text(model, r.detail);
  if (r.status != IkStatus::joint_limit || r.limiting_joint < 0) return own;
  const JointModel& joint = model.joints[static_cast<std::size_t>(r.limiting_joint)];
  if (joint.is_coupled() || coordinate_count(joint.type) != 1) return own;
  const auto entry = static_cast<std::size_t>(joint.q_index);
  const PostAxis* const axis = axes.of_entry(entry);
  if (!axis || axis->coupled.empty()) return own;
  const auto free =
      bind_ik(registry, std::make_shared<const RobotModel>(robotics::without_limits(model)),
              {ik.provider, choice.params});
  if (!free.ok()) return own;
  IkBatch batch;
  batch.targets = {&target, 1};
  batch.seeds = seed;
  batch.all_solutions = true;
  const auto results = solve_ik(*free, batch, progress);
  if (!results.ok()) return own;
  const IkResult& found = results->front();
  const std::size_t n = model.coordinate_count();
  std::vector<double> nearest;
  robotics::LimitExcess least;
  least.by = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i + n <= found.q.size() && found.status == IkStatus::solved; i += n) {
    std::vector<double> q(found.q.begin() + static_cast<std::ptrdiff_t>(i),
                          found.q.begin() + static_cast<std::ptrdiff_t>(i + n));
    robotics::turn_into_limits(model, q, seed);
    const auto excess = robotics::limit_excess(model, q);
    if (excess.joint != r.limiting_joint || excess.by >= least.by) continue;
    least = excess;
    nearest = std::move(q);
  }
  if (nearest.empty()) return own;
  return axes.before_place(entry, nearest) + robotics::excess_words(model, least);
}

}  // namespace robomosp::sim
