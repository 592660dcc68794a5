// SPDX-License-Identifier: Apache-2.0
#include "sim/workspace_maps.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <mutex>
#include <numbers>
#include <optional>
#include <string>

#include "kernel/quiet_progress.h"
#include "kernel/text.h"
#include "robotics/coordinates.h"
#include "spatial/parallel.h"
#include "spatial/pose.h"
#include "spatial/vec.h"

namespace robomosp::sim {
namespace {

using recording::Column;
using recording::Recording;

/// Axes with z along `direction`, turned about it by `roll`.
Pose tool_pose(const Vec3& p, const Vec3& direction, double roll) {
  const Vec3 side = std::fabs(direction[2]) < 0.9 ? Vec3{0, 0, 1} : Vec3{1, 0, 0};
  const Vec3 x = spatial::unit(spatial::cross(side, direction));
  const Vec3 y = spatial::cross(direction, x);
  const double c = std::cos(roll), s = std::sin(roll);
  Pose t;
  t.p = p;
  for (std::size_t i = 0; i < 3; ++i) {
    t.R[3 * i] = c * x[i] + s * y[i];
    t.R[3 * i + 1] = c * y[i] - s * x[i];
    t.R[3 * i + 2] = direction[i];
  }
  return t;
}

bool has_free_solution(const RobotContact& contact, const IkResult& r, std::size_t n,
                       Progress& progress, Result<void>& fault) {
  for (std::size_t k = 0; k < r.q.size() / n; ++k) {
    auto hit = contact.touches(std::span(&r.q[k * n], n), progress);
    if (!hit.ok()) {
      fault = std::move(hit).error();
      return false;
    }
    if (!*hit) return true;
  }
  return false;
}

/// The share of one point. All rolls of a direction that is not yet reached are one batch after
/// the other, so that nothing depends on how points are divided among threads.
Result<double> share_of(const Bound<IkSolver>& ik, const Vec3& point,
                        std::span<const Vec3> directions, const Pose& base_T_mounting,
                        const ReachOptions& o, Progress& progress) {
  const std::size_t n = ik.model->coordinate_count();
  const IkGoal axis{o.tip, kIkPosition | kIkAxis, 1};
  std::vector<std::size_t> open(directions.size());
  for (std::size_t i = 0; i < open.size(); ++i) open[i] = i;
  std::vector<Pose> targets;
  const std::size_t rolls = std::max<std::size_t>(1, o.rolls);
  for (std::size_t r = 0; r < rolls && !open.empty(); ++r) {
    const double roll = 2 * std::numbers::pi * static_cast<double>(r) / static_cast<double>(rolls);
    targets.clear();
    for (const std::size_t i : open)
      targets.push_back(spatial::compose(base_T_mounting, tool_pose(point, directions[i], roll)));
    IkBatch batch;
    batch.targets = targets;
    batch.tolerance = o.tolerance;
    batch.tip = o.tip;
    batch.all_solutions = o.collision != nullptr;
    if (o.rolls == 0) batch.goals = std::span(&axis, 1);
    RMP_TRY_ASSIGN(const auto results, solve_ik(ik, batch, progress));
    std::vector<std::size_t> left;
    Result<void> fault;
    for (std::size_t k = 0; k < open.size(); ++k) {
      const bool is_reached =
          results[k].status == IkStatus::solved &&
          (!o.collision || has_free_solution(*o.collision, results[k], n, progress, fault));
      RMP_TRY(std::move(fault));
      fault = {};
      if (!is_reached) left.push_back(open[k]);
    }
    open = std::move(left);
  }
  return 1 - static_cast<double>(open.size()) / static_cast<double>(directions.size());
}

Column new_column(std::string name, std::string unit, std::string doc) {
  return {std::move(name), std::move(unit), std::move(doc), {}};
}

}  // namespace

Result<bool> RobotContact::touches(std::span<const double> q, Progress& progress) const {
  std::vector<double> all = shown_;
  std::copy(q.begin(), q.end(),
            all.begin() + static_cast<std::ptrdiff_t>(model_->robots()[robot_].first));
  RMP_TRY_ASSIGN(const auto hits, model_->collisions(all, progress));
  const auto is_mine = [&](std::int32_t body) {
    return model_->bodies()[static_cast<std::size_t>(body)].robot ==
           static_cast<std::int32_t>(robot_);
  };
  return std::any_of(hits.begin(), hits.end(),
                     [&](const CollisionPair& p) { return is_mine(p.a) || is_mine(p.b); });
}

robotics::ConfigurationFilter without_collisions(const RobotContact& contact, Progress& progress) {
  return [&](std::span<const double> q, std::span<std::uint8_t> keep) -> Result<void> {
    if (keep.empty()) return {};
    const std::size_t n = q.size() / keep.size();
    std::mutex guard;
    std::optional<Error> fault;
    spatial::in_parallel(keep.size(), 16, contact.is_script() ? 1 : spatial::cores(),
                         [&](std::size_t a, std::size_t b, std::size_t) {
                           QuietProgress quiet(progress);
                           for (std::size_t i = a; i < b && !progress.cancelled(); ++i) {
                             if (!keep[i]) continue;
                             auto hit = contact.touches(q.subspan(i * n, n), quiet);
                             if (hit.ok()) {
                               keep[i] = !*hit;
                               continue;
                             }
                             const std::scoped_lock lock(guard);
                             if (!fault) fault = std::move(hit).error();
                             return;
                           }
                         });
    if (fault) return std::move(*fault);
    // What was not looked at is not free.
    if (progress.cancelled())
      return error(ErrorCode::cancelled, "the check of collisions was cancelled", "");
    return {};
  };
}

Result<std::vector<double>> reachability(const Registry& registry, const Bound<IkSolver>& ik,
                                         std::span<const Vec3> points, const ReachOptions& o,
                                         Progress& progress) {
  const auto directions = robotics::sphere_directions(o.directions);
  const Pose base_T_mounting = spatial::inverse(ik.model->base);
  std::vector<double> share(points.size());
  const auto info = registry.find(IkSolver::kInterfaceId, ik.provider);
  const bool is_script =
      (info.ok() && info->is_script) || (o.collision && o.collision->is_script());
  const std::size_t threads = is_script ? 1 : o.threads ? o.threads : spatial::cores();
  std::atomic<std::size_t> next{0};
  std::mutex guard;
  std::optional<Error> fault;
  std::size_t faulty = points.size();
  spatial::in_parallel(threads, 1, threads, [&](std::size_t, std::size_t, std::size_t thread) {
    QuietProgress quiet(progress);
    for (std::size_t i = next++; i < points.size() && !progress.cancelled(); i = next++) {
      if (thread == 0 && i % 16 < threads)
        progress.report(static_cast<double>(i) / static_cast<double>(points.size()),
                        "reachability");
      auto one = share_of(ik, points[i], directions, base_T_mounting, o, quiet);
      if (one.ok()) {
        share[i] = *one;
        continue;
      }
      const std::scoped_lock lock(guard);
      if (i < faulty) faulty = i, fault = std::move(one).error();
      next = points.size();
    }
  });
  if (progress.cancelled())
    return error(ErrorCode::cancelled, "the reachability map was cancelled", "");
  if (fault) return std::move(*fault);
  return share;
}

Recording workspace_recording(const RobotModel& model, const robotics::Workspace& w) {
  Recording r;
  r.title = model.name + ": workspace";
  r.robot = model.name;
  r.voxel = w.grid.size;
  r.columns = {new_column("x", "m", "centre of the voxel, mounting frame"),
               new_column("y", "m", "centre of the voxel, mounting frame"),
               new_column("z", "m", "centre of the voxel, mounting frame"),
               new_column("samples", "", "sampled configurations whose tip is in the voxel"),
               new_column("surface", "", "1 on the surface of the reached volume, else 0"),
               new_column("manipulability", "", "maximum of the samples in the voxel"),
               new_column("mean_manipulability", "", "mean of the samples in the voxel")};
  for (std::size_t v = 0; v < w.hits.size(); ++v) {
    if (w.hits[v] == 0) continue;
    const Vec3 p = w.grid.centre(v);
    const double row[] = {p[0],
                          p[1],
                          p[2],
                          static_cast<double>(w.hits[v]),
                          static_cast<double>(w.is_surface[v]),
                          w.best[v],
                          w.mean[v]};
    for (std::size_t c = 0; c < std::size(row); ++c) r.columns[c].values.push_back(row[c]);
  }
  r.notes.push_back(std::to_string(w.counted) + " of " + std::to_string(w.samples) +
                    " samples were valid; voxels of " + text::print_rounded(w.grid.size, 6) +
                    " m.");
  return r;
}

Recording slice_recording(const RobotModel& model, const robotics::SliceOptions& o,
                          const robotics::JointSlice& s) {
  Recording r;
  r.title = model.name + ": joint slice";
  r.robot = model.name;
  const auto units = robotics::coordinate_units(model);
  for (const robotics::SliceAxis& a : o.axes) {
    const JointModel& j = model.joints[a.joint];
    const auto k = static_cast<std::size_t>(j.q_index);
    r.columns.push_back(new_column("q" + std::to_string(k + 1), std::string(units[k]),
                                   "joint " + text::quote(j.name)));
  }
  r.columns.push_back(new_column("manipulability", "", "product of the singular values"));
  r.columns.push_back(new_column("condition", "", "largest over smallest singular value"));
  r.columns.push_back(new_column("least", "", "smallest singular value"));
  r.columns.push_back(new_column("collision", "", "1 if the robot touches something, else 0"));
  r.columns.push_back(new_column("singular", "", "1 next to a singular curve, else 0"));
  for (std::size_t i = 0; i < s.nodes.size(); ++i) {
    const double row[] = {o.axes[0].at(i % o.axes[0].count),
                          o.axes[1].at(i / o.axes[0].count),
                          s.nodes[i].manipulability,
                          s.nodes[i].condition,
                          s.nodes[i].least,
                          static_cast<double>(s.collides[i]),
                          static_cast<double>(s.singular[i])};
    for (std::size_t c = 0; c < std::size(row); ++c) r.columns[c].values.push_back(row[c]);
  }
  return r;
}

}  // namespace robomosp::sim
