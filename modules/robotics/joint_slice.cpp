// SPDX-License-Identifier: Apache-2.0
#include "robotics/joint_slice.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "robotics/batch_kinematics.h"
#include "robotics/kinematics.h"
#include "spatial/parallel.h"

namespace robomosp::robotics {
namespace {

constexpr double kSingular = 1e-6;              // least over greatest singular value
constexpr double kLevel = 1e-9;                 // of the greatest singular value: no minimum
constexpr std::size_t kBlock = 1U << 14;        // nodes between two looks at the progress
constexpr std::size_t kFilterBlock = 1U << 10;  // the same with a filter, which may take long

class Follower {
 public:
  Follower(const RobotModel& model, std::span<const double> q, const SliceOptions& o, int rank)
      : model_(model),
        o_(o),
        rank_(rank),
        q_(q.begin(), q.end()),
        frames_(model.joints.size()),
        jacobian_(6 * model.dof()) {}

  JacobianMeasures at(const std::array<double, 2>& x) {
    for (std::size_t k = 0; k < 2; ++k)
      q_[static_cast<std::size_t>(model_.joints[o_.axes[k].joint].q_index)] = x[k];
    forward_kinematics(model_, q_, frames_);
    geometric_jacobian(model_, o_.tip, frames_, JacobianFrame::base, jacobian_);
    return jacobian_measures(jacobian_, o_.part, o_.length, rank_);
  }

  /// The minimum of the least singular value between two points, by the golden section.
  std::array<double, 2> minimum(const std::array<double, 2>& a, const std::array<double, 2>& b) {
    const auto point = [&](double t) {
      return std::array{a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])};
    };
    const double g = 1 / std::numbers::phi;
    double low = 0, high = 1, c = 1 - g, d = g;
    double at_c = at(point(c)).least, at_d = at(point(d)).least;
    for (int i = 0; i < 60; ++i) {
      if (at_c < at_d) {
        high = d, d = c, at_d = at_c, c = high - g * (high - low);
        at_c = at(point(c)).least;
      } else {
        low = c, c = d, at_c = at_d, d = low + g * (high - low);
        at_d = at(point(d)).least;
      }
    }
    return point(0.5 * (low + high));
  }

 private:
  const RobotModel& model_;
  const SliceOptions& o_;
  int rank_;
  std::vector<double> q_;
  std::vector<Pose> frames_;
  std::vector<double> jacobian_;
};

bool is_singular(const JacobianMeasures& m) { return !(m.condition * kSingular < 1); }

}  // namespace

Result<JointSlice> joint_slice(const RobotModel& model, std::span<const double> q,
                               const SliceOptions& o, Progress& progress) {
  const SliceAxis &a = o.axes[0], &b = o.axes[1];
  const std::size_t n = model.coordinate_count(), dof = model.dof(), nodes = a.count * b.count;
  JointSlice out;
  out.nodes.resize(nodes);
  out.collides.assign(nodes, 0);
  out.singular.assign(nodes, 0);
  out.rank = singularity(model, o.tip, q, o.part).full_rank;
  const BatchKinematics kinematics(model);
  const std::size_t threads = o.threads ? o.threads : spatial::cores();
  const std::size_t block = o.filter ? kFilterBlock : kBlock;
  std::vector<double> scratch(kinematics.scratch_size()), all(block * n),
      jacobians(block * 6 * dof);
  std::vector<std::uint8_t> keep(block);
  const auto node = [&](std::size_t i) { return std::array{a.at(i % a.count), b.at(i / a.count)}; };
  for (std::size_t done = 0; done < nodes; done += block) {
    progress.report(0.8 * static_cast<double>(done) / static_cast<double>(nodes), "joint slice");
    if (progress.cancelled()) return error(ErrorCode::cancelled, "the slice was cancelled", "");
    const std::size_t count = std::min(block, nodes - done);
    for (std::size_t i = 0; i < count; ++i) {
      std::copy(q.begin(), q.end(), all.begin() + static_cast<std::ptrdiff_t>(i * n));
      const auto x = node(done + i);
      for (std::size_t k = 0; k < 2; ++k)
        all[i * n + static_cast<std::size_t>(model.joints[o.axes[k].joint].q_index)] = x[k];
    }
    kinematics.jacobians(o.tip, std::span(all).first(count * n), JacobianFrame::base, {},
                         std::span(jacobians).first(count * 6 * dof), scratch);
    spatial::in_parallel(count, 64, threads, [&](std::size_t f, std::size_t l, std::size_t) {
      for (std::size_t i = f; i < l; ++i)
        out.nodes[done + i] = jacobian_measures(std::span(&jacobians[i * 6 * dof], 6 * dof), o.part,
                                                o.length, out.rank);
    });
    if (o.filter) {
      std::fill(keep.begin(), keep.end(), std::uint8_t{1});
      RMP_TRY(o.filter(std::span(all).first(count * n), std::span(keep).first(count)));
      for (std::size_t i = 0; i < count; ++i) out.collides[done + i] = !keep[i];
    }
  }
  for (std::size_t i = 0; i < nodes; ++i)
    if (is_singular(out.nodes[i])) {
      out.singular[i] = 1;
      out.curve.push_back(node(i));
    }
  // Between the nodes: minima along a line of the grid, followed to see whether they are zero.
  Follower follower(model, q, o, out.rank);
  for (std::size_t axis = 0; axis < 2; ++axis) {
    const std::size_t step = axis == 0 ? 1 : a.count, length = o.axes[axis].count;
    for (std::size_t i = 0; i < nodes; ++i) {
      if (progress.cancelled()) return error(ErrorCode::cancelled, "the slice was cancelled", "");
      if (i % kFilterBlock == 0)
        progress.report(0.8 + 0.1 * (static_cast<double>(axis) +
                                     static_cast<double>(i) / static_cast<double>(nodes)),
                        "singular curves");
      const std::size_t place = axis == 0 ? i % a.count : i / a.count;
      const double s = out.nodes[i].least;
      const double before = place > 0 ? out.nodes[i - step].least : s;
      const double after = place + 1 < length ? out.nodes[i + step].least : s;
      if (is_singular(out.nodes[i]) || s > before || s > after ||
          std::max(before, after) - s < kLevel * out.nodes[i].least * out.nodes[i].condition)
        continue;
      const auto x =
          follower.minimum(node(place > 0 ? i - step : i), node(place + 1 < length ? i + step : i));
      if (!is_singular(follower.at(x))) continue;
      out.singular[i] = 1;
      out.curve.push_back(x);
    }
  }
  return out;
}

}  // namespace robomosp::robotics
