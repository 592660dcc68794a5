// SPDX-License-Identifier: Apache-2.0
#include "explain.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "decompositions.h"
#include "spatial/print.h"

namespace robomosp::ik_numeric {
namespace {

constexpr double kTurn = 2 * std::numbers::pi;
// Singular: the least part of the greatest rate, lengths counted in mechanism lengths.
constexpr double kSingular = 1e-3;

bool wraps(const Mechanism& m, const Velocity& v) {
  if (v.q < 0 || m.model->joints[v.joint].type != JointType::revolute) return false;
  return std::none_of(m.model->joints.begin(), m.model->joints.end(), [&](const JointModel& j) {
    return j.coupling.of == static_cast<std::int32_t>(v.joint);
  });
}

double nearest_turn(const Velocity& v, double q, double near) {
  double x = q + kTurn * std::round((near - q) / kTurn);
  if (x > v.upper) x -= kTurn * std::ceil((x - v.upper) / kTurn);
  if (x < v.lower) x += kTurn * std::ceil((v.lower - x) / kTurn);
  return x >= v.lower && x <= v.upper ? x : q;
}

double outside(const Velocity& v, double q) { return std::max({0.0, v.lower - q, q - v.upper}); }

// Chooses the turns that are least outside the limits; the velocity that stays farthest out, or
// none (size) when all are within.
std::size_t bring_near_limits(const Mechanism& m, std::span<const double> near,
                              std::span<double> q) {
  std::size_t worst = m.velocities.size();
  double most = 0;
  for (std::size_t i = 0; i < m.velocities.size(); ++i) {
    const Velocity& v = m.velocities[i];
    if (v.q < 0) continue;
    const auto k = static_cast<std::size_t>(v.q);
    if (wraps(m, v) && outside(v, q[k]) > 0) {
      const double low = std::isfinite(v.lower) ? v.lower : v.upper - kTurn;
      const double high = std::isfinite(v.upper) ? v.upper : v.lower + kTurn;
      q[k] =
          nearest_turn(v, q[k] + kTurn * std::round((0.5 * (low + high) - q[k]) / kTurn), near[k]);
    }
    if (const double by = outside(v, q[k]) / v.unit; by > most) most = by, worst = i;
  }
  return worst;
}

std::string over_limit(const Mechanism& m, const Velocity& v, double q) {
  const JointModel& joint = m.model->joints[v.joint];
  return "joint " + std::to_string(v.joint + 1) + " (\"" + joint.name + "\") would need " +
         spatial::print_joint_value(q, joint.type) + "; its limit is " +
         spatial::print_joint_value(q > v.upper ? v.upper : v.lower, joint.type);
}

// Tries without limits. 1: reached within them after all, q is the answer; -1: reached outside,
// `out` names the joint that would have to go farthest; 0: not reached.
int try_without_limits(const Failure& f, std::vector<double>& q, IkResult& out,
                       const Progress& progress) {
  Aims aims(f.mechanism, f.goals);
  Search search(aims, progress);
  SearchOptions free = f.options;
  free.use_limits = false;
  Random random(f.seed + 1);
  const std::vector<double> closest = q;
  std::vector<double> x = closest;
  double least = std::numeric_limits<double>::infinity();
  for (int i = 0; i < 8 && !progress.cancelled(); ++i) {
    if (i > 0) random_configuration(f.mechanism, random, x);
    const SearchResult r = search.run(f.targets, free, x);
    out.iterations += r.iterations;
    if (r.end != SearchEnd::reached) continue;
    const std::size_t worst = bring_near_limits(f.mechanism, closest, x);
    if (worst == f.mechanism.velocities.size()) {
      q = x;
      return 1;
    }
    const Velocity& v = f.mechanism.velocities[worst];
    const double at = x[static_cast<std::size_t>(v.q)], by = outside(v, at) / v.unit;
    if (by >= least) continue;
    least = by;
    out.detail = over_limit(f.mechanism, v, at);
    out.limiting_joint = static_cast<std::int32_t>(v.joint);
  }
  return std::isfinite(least) ? -1 : 0;
}

// The least distance at which the positions alone can be met [m].
double position_gap(const Failure& f, const std::vector<double>& closest,
                    const Progress& progress) {
  std::vector<IkGoal> places(f.goals.begin(), f.goals.end());
  bool some = false;
  for (IkGoal& g : places) some |= (g.parts &= kIkPosition) != 0;
  if (!some) return 0;
  Aims aims(f.mechanism, places);
  Search search(aims, progress);
  Random random(f.seed + 2);
  double gap = std::numeric_limits<double>::infinity();
  std::vector<double> x = closest;
  for (int i = 0; i < 4 && gap > f.options.tolerance.position && !progress.cancelled(); ++i) {
    if (i > 0) random_configuration(f.mechanism, random, x);
    gap = std::min(gap, search.run(f.targets, f.options, x).miss.position);
  }
  return gap;
}

std::string direction_words(const std::array<double, 6>& d) {
  const double v = std::hypot(d[0], d[1], d[2]), w = std::hypot(d[3], d[4], d[5]);
  const auto axis = [](double x, double y, double z, double n) {
    return "(" + spatial::print_number(x / n, 3) + ", " + spatial::print_number(y / n, 3) + ", " +
           spatial::print_number(z / n, 3) + ")";
  };
  if (w < 0.05) return "cannot move along " + axis(d[0], d[1], d[2], v);
  if (v < 0.05) return "cannot turn about " + axis(d[3], d[4], d[5], w);
  return "cannot move along " + axis(d[0], d[1], d[2], v) + " while turning about " +
         axis(d[3], d[4], d[5], w);
}

}  // namespace

std::array<double, 6> lost_direction(const Mechanism& m, const IkGoal& goal,
                                     std::span<const double> q) {
  Aims aims(m, std::span(&goal, 1));
  aims.place(q);
  Eigen::MatrixXd J = aims.tip_jacobian(0);
  J.topRows<3>() /= m.length;
  if (!(goal.parts & kIkRotation)) J.bottomRows<3>().setZero();
  if (!(goal.parts & kIkPosition)) J.topRows<3>().setZero();
  for (std::size_t i = 0; i < m.velocities.size(); ++i)
    J.col(static_cast<Eigen::Index>(i)) *= m.velocities[i].unit;
  const Eigen::Index directions =
      !(goal.parts & kIkRotation) || !(goal.parts & kIkPosition) ? 3 : 6;
  Eigen::Index carrying = 0;
  for (Eigen::Index i = 0; i < J.cols(); ++i) carrying += J.col(i).squaredNorm() > 0;
  std::array<double, 6> lost{};
  const Eigen::Index last = std::min(directions, carrying) - 1;
  if (last < 0) return lost;
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(J, Eigen::ComputeThinU);
  if (last >= svd.singularValues().size() ||
      svd.singularValues()[last] > kSingular * svd.singularValues()[0])
    return lost;
  Eigen::VectorXd u = svd.matrixU().col(last);
  u.head<3>() *= m.length;
  u.normalize();
  // Of the two senses the one whose greatest part is positive.
  Eigen::Index greatest = 0;
  u.cwiseAbs().maxCoeff(&greatest);
  if (u[greatest] < 0) u = -u;
  for (std::size_t k = 0; k < 6; ++k) {
    const double x = u[static_cast<Eigen::Index>(k)];
    lost[k] = std::fabs(x) < 1e-9 ? 0.0 : x;
  }
  return lost;
}

void unwind(const Mechanism& m, std::span<const double> near, std::span<double> q) {
  for (const Velocity& v : m.velocities)
    if (wraps(m, v)) {
      const auto k = static_cast<std::size_t>(v.q);
      q[k] = nearest_turn(v, q[k], near[k]);
    }
}

bool explain(const Failure& f, std::vector<double>& q, IkResult& out, const Progress& progress) {
  if (f.certain_gap <= f.options.tolerance.position) {
    const int without = try_without_limits(f, q, out, progress);
    if (without > 0) return true;
    if (without < 0) {
      out.status = IkStatus::joint_limit;
      return false;
    }
  }
  if (progress.cancelled()) return false;
  const double gap = std::max(f.certain_gap, position_gap(f, q, progress));
  Aims aims(f.mechanism, f.goals);
  aims.evaluate(f.targets, q, false);
  const std::string left = spatial::print_number(aims.miss().position, 3) + " m and " +
                           spatial::print_joint_value(aims.miss().rotation, JointType::revolute, 3);
  bool places = false, turns = false;
  for (const IkGoal& g : f.goals) places |= g.parts & kIkPosition, turns |= g.parts & kIkRotation;
  for (const IkGoal& g : f.goals)
    if (out.lost_direction == std::array<double, 6>{})
      out.lost_direction = lost_direction(f.mechanism, g, q);
  if (gap > f.options.tolerance.position) {
    out.status = IkStatus::out_of_reach;
    out.shortfall = gap;
    out.detail = "the target is out of reach by " + spatial::print_number(gap, 3) + " m";
    return false;
  }
  if (f.ended_early) {
    out.status = IkStatus::not_converged;
    out.detail = "the search ended with " + left +
                 " left; raise max_iterations or restarts, or give a seed nearby";
  } else {
    out.status = IkStatus::out_of_reach;
    out.detail = f.goals.size() > 1
                     ? "the goals cannot all be met; the closest configuration found is off by "
                 : places && turns
                     ? "the position can be reached, but not with this orientation; the closest "
                       "pose found is off by "
                     : "the target cannot be reached; the closest pose found is off by ";
    out.detail += left;
  }
  if (out.lost_direction != std::array<double, 6>{})
    out.detail += "; there the tip " + direction_words(out.lost_direction);
  return false;
}

}  // namespace robomosp::ik_numeric
