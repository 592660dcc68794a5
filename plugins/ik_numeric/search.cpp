// SPDX-License-Identifier: Apache-2.0
#include "search.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/Core>

#include "spatial/pose.h"
#include "spatial/rotation.h"

namespace robomosp::ik_numeric {
namespace {

// At most 6 x 6: the normal equations are solved on the smaller side, so nothing is allocated.
using Small = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 6, 6>;
using SmallVector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 6, 1>;
using Vector6 = Eigen::Matrix<double, 6, 1>;

// Lengths are counted in chain lengths, so that position and rotation weigh alike.
Vector6 residual(const Chain& chain, const Pose& at, const Pose& target, bool position_only,
                 SearchResult& result) {
  Vector6 e;
  const Vec3 p = spatial::sub(target.p, at.p);
  result.position_error = spatial::norm(p);
  const Vec3 r = spatial::rotation_difference(at.R, target.R);
  result.rotation_error = spatial::norm(r);
  const double w = position_only ? 0.0 : 1.0;
  e << p[0] / chain.length, p[1] / chain.length, p[2] / chain.length, w * r[0], w * r[1], w * r[2];
  return e;
}

void fill_columns(const Chain& chain, const Pose& tip, bool position_only, Workspace& work) {
  for (std::size_t i = 0; i < chain.size(); ++i) {
    const PathJoint& joint = chain.joints[i];
    const Vec3 z = spatial::axis(work.frames[i], 2);
    const bool turns = joint.type == JointType::revolute;
    const Vec3 v = turns ? spatial::scale(spatial::cross(z, spatial::sub(tip.p, work.frames[i].p)),
                                          1 / chain.length)
                         : spatial::scale(z, joint.unit / chain.length);
    const Vec3 w = turns && !position_only ? z : Vec3{};
    std::copy(v.begin(), v.end(), work.columns.begin() + static_cast<std::ptrdiff_t>(6 * i));
    std::copy(w.begin(), w.end(), work.columns.begin() + static_cast<std::ptrdiff_t>(6 * i + 3));
  }
}

// The damped step over the joints that are not held; zeros for those that are.
void damped_step(const Chain& chain, const Vector6& e, double damping, Workspace& work) {
  std::size_t free = 0;
  for (std::size_t i = 0; i < chain.size(); ++i) free += work.held[i] ? 0 : 1;
  std::fill(work.step.begin(), work.step.end(), 0.0);
  if (free == 0) return;
  const auto column = [&](std::size_t i) {
    return Eigen::Map<const Vector6>(work.columns.data() + 6 * i);
  };
  if (free >= 6) {
    Eigen::Matrix<double, 6, 6> g = Eigen::Matrix<double, 6, 6>::Identity() * damping;
    for (std::size_t i = 0; i < chain.size(); ++i)
      if (!work.held[i]) g.noalias() += column(i) * column(i).transpose();
    const Vector6 y = g.ldlt().solve(e);
    for (std::size_t i = 0; i < chain.size(); ++i)
      if (!work.held[i]) work.step[i] = column(i).dot(y);
    return;
  }
  std::array<std::size_t, 6> who{};
  for (std::size_t i = 0, k = 0; i < chain.size(); ++i)
    if (!work.held[i]) who[k++] = i;
  const auto k = static_cast<Eigen::Index>(free);
  Small g(k, k);
  SmallVector b(k);
  for (Eigen::Index r = 0; r < k; ++r) {
    const auto cr = column(who[static_cast<std::size_t>(r)]);
    b[r] = cr.dot(e);
    for (Eigen::Index c = 0; c < k; ++c) g(r, c) = cr.dot(column(who[static_cast<std::size_t>(c)]));
    g(r, r) += damping;
  }
  const SmallVector x = g.ldlt().solve(b);
  for (Eigen::Index r = 0; r < k; ++r) work.step[who[static_cast<std::size_t>(r)]] = x[r];
}

// Joints that stand at a limit and would leave it are held; the step is found again without them.
void limited_step(const Chain& chain, const Vector6& e, double damping, bool use_limits,
                  std::span<const double> q, Workspace& work) {
  std::fill(work.held.begin(), work.held.end(), char{0});
  for (std::size_t round = 0; round <= chain.size(); ++round) {
    damped_step(chain, e, damping, work);
    if (!use_limits) return;
    bool more = false;
    for (std::size_t i = 0; i < chain.size(); ++i) {
      const PathJoint& joint = chain.joints[i];
      const bool leaves =
          (q[i] <= joint.lower && work.step[i] < 0) || (q[i] >= joint.upper && work.step[i] > 0);
      if (leaves && !work.held[i]) work.held[i] = 1, more = true;
    }
    if (!more) return;
  }
}

// A few units in the last place of the pose: no search can improve on it.
constexpr double kRounding = 1e-15;

}  // namespace

SearchResult search(const Chain& chain, const Pose& target, const IkTolerance& tolerance,
                    const SearchOptions& options, std::span<double> q, Workspace& work,
                    const Progress& progress) {
  SearchResult result;
  const std::size_t n = chain.size();
  Pose tip = forward(chain, q, work.frames);
  Vector6 e = residual(chain, tip, target, options.position_only, result);
  result.cost = e.squaredNorm();
  const auto reached = [&](const SearchResult& r) {
    return r.position_error <= tolerance.position &&
           (options.position_only || r.rotation_error <= tolerance.rotation);
  };
  double trust = 1;  // raises the damping while steps fail
  int polish = 0;
  for (; result.iterations < options.max_iterations; ++result.iterations) {
    if ((result.iterations & 15) == 15 && progress.cancelled()) {
      result.end = SearchEnd::cancelled;
      return result;
    }
    // Once within tolerance two more Newton steps bring the answer to rounding.
    if (reached(result) && (++polish > 2 || result.cost < 100 * kRounding * kRounding)) {
      result.end = SearchEnd::reached;
      return result;
    }
    fill_columns(chain, tip, options.position_only, work);
    limited_step(chain, e, options.damping * trust * result.cost + kRounding, options.use_limits, q,
                 work);
    double greatest = 0;
    for (std::size_t i = 0; i < n; ++i) greatest = std::max(greatest, std::fabs(work.step[i]));
    const double shorten = greatest > options.max_step ? options.max_step / greatest : 1.0;
    double moved = 0;
    for (std::size_t i = 0; i < n; ++i) {
      const PathJoint& joint = chain.joints[i];
      double x = q[i] + shorten * work.step[i] * joint.unit;
      if (options.use_limits) x = std::clamp(x, joint.lower, joint.upper);
      work.trial[i] = x;
      moved = std::max(moved, std::fabs(x - q[i]) / joint.unit);
    }
    SearchResult next = result;
    const Pose trial_tip = forward(chain, work.trial, work.trial_frames);
    const Vector6 trial_e = residual(chain, trial_tip, target, options.position_only, next);
    next.cost = trial_e.squaredNorm();
    if (next.cost < result.cost) {
      const double gain = 1 - next.cost / result.cost;
      std::copy(work.trial.begin(), work.trial.end(), q.begin());
      std::swap(work.frames, work.trial_frames);
      tip = trial_tip;
      e = trial_e;
      next.iterations = result.iterations;
      result = next;
      trust = std::max(trust * (gain > 0.5 ? 0.2 : 1.0), 1e-3);
      // Creeping along a valley whose floor is not zero: a closest pose, not a solution.
      if (gain < 1e-4 && !reached(result) && moved < 1e-3) {
        result.end = SearchEnd::stuck;
        return result;
      }
    } else {
      if (reached(result)) {
        result.end = SearchEnd::reached;
        return result;
      }
      if (moved < 1e-12 || trust > 1e9) {
        result.end = SearchEnd::stuck;
        return result;
      }
      trust = std::max(trust, 1e-2) * 8;
    }
  }
  result.end = reached(result) ? SearchEnd::reached : SearchEnd::out_of_iterations;
  return result;
}

}  // namespace robomosp::ik_numeric
