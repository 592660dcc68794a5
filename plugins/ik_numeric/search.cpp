// SPDX-License-Identifier: Apache-2.0
#include "search.h"

#include <algorithm>
#include <cmath>

#include "decompositions.h"

namespace robomosp::ik_numeric {
namespace {

// A few units in the last place of the pose: no search can improve on it.
constexpr double kRounding = 1e-15;

bool reached(const Miss& miss, const IkTolerance& t) {
  return miss.position <= t.position && miss.rotation <= t.rotation;
}

}  // namespace

Search::Search(Aims& aims, const Progress& progress)
    : aims_(aims),
      progress_(progress),
      trial_(aims.mechanism().model->coordinate_count()),
      held_(aims.mechanism().model->dof()),
      step_(Eigen::VectorXd::Zero(static_cast<Eigen::Index>(held_.size()))),
      real_step_(step_),
      free_columns_(aims.rows(), step_.size()) {}

// The damped step over the velocities that are not held, on the smaller side.
void Search::damped_step(const Eigen::VectorXd& e, double damping) {
  const Eigen::MatrixXd& J = aims_.jacobian();
  step_.setZero();
  Eigen::Index k = 0;
  for (std::size_t i = 0; i < held_.size(); ++i)
    if (!held_[i]) free_columns_.col(k++) = J.col(static_cast<Eigen::Index>(i));
  if (k == 0 || J.rows() == 0) return;
  const auto A = free_columns_.leftCols(k);
  Eigen::VectorXd x;
  if (J.rows() <= k) {
    Eigen::MatrixXd g = A * A.transpose();
    g.diagonal().array() += damping;
    x = A.transpose() * g.ldlt().solve(e);
  } else {
    Eigen::MatrixXd g = A.transpose() * A;
    g.diagonal().array() += damping;
    x = g.ldlt().solve(A.transpose() * e);
  }
  k = 0;
  for (std::size_t i = 0; i < held_.size(); ++i)
    if (!held_[i]) step_[static_cast<Eigen::Index>(i)] = x[k++];
}

// Velocities at a limit that would leave it are held; the step is found again without them.
void Search::limited_step(const Eigen::VectorXd& e, double damping, bool use_limits,
                          std::span<const double> q) {
  std::fill(held_.begin(), held_.end(), char{0});
  const auto& velocities = aims_.mechanism().velocities;
  for (std::size_t round = 0; round <= velocities.size(); ++round) {
    damped_step(e, damping);
    if (!use_limits) return;
    bool more = false;
    for (std::size_t i = 0; i < velocities.size(); ++i) {
      const Velocity& v = velocities[i];
      if (v.q < 0 || held_[i]) continue;
      const double x = q[static_cast<std::size_t>(v.q)], s = step_[static_cast<Eigen::Index>(i)];
      if ((x <= v.lower && s < 0) || (x >= v.upper && s > 0)) held_[i] = 1, more = true;
    }
    if (!more) return;
  }
}

SearchResult Search::run(std::span<const Pose> targets, const SearchOptions& options,
                         std::span<double> q) {
  SearchResult result;
  const auto& velocities = aims_.mechanism().velocities;
  aims_.evaluate(targets, q, true);
  result.cost = aims_.error().squaredNorm();
  result.miss = aims_.miss();
  double trust = 1;  // raises the damping while steps fail
  int polish = 0;
  for (; result.iterations < options.max_iterations; ++result.iterations) {
    if ((result.iterations & 7) == 7 && progress_.cancelled()) {
      result.end = SearchEnd::cancelled;
      return result;
    }
    const bool good = reached(result.miss, options.tolerance);
    // Once within tolerance two more Newton steps bring the answer to rounding.
    if (good && (++polish > 2 || result.cost < 100 * kRounding * kRounding)) {
      result.end = SearchEnd::reached;
      return result;
    }
    limited_step(aims_.error(), options.damping * trust * result.cost + kRounding,
                 options.use_limits, q);
    const double greatest = step_.size() ? step_.cwiseAbs().maxCoeff() : 0.0;
    const double shorten = greatest > options.max_step ? options.max_step / greatest : 1.0;
    for (std::size_t i = 0; i < velocities.size(); ++i)
      real_step_[static_cast<Eigen::Index>(i)] =
          shorten * step_[static_cast<Eigen::Index>(i)] * velocities[i].unit;
    std::copy(q.begin(), q.end(), trial_.begin());
    advance(aims_.mechanism(), {real_step_.data(), velocities.size()}, options.use_limits, trial_);
    aims_.evaluate(targets, trial_, true);
    const double cost = aims_.error().squaredNorm();
    const double moved = shorten * greatest;
    if (cost < result.cost) {
      const double gain = 1 - cost / result.cost;
      std::copy(trial_.begin(), trial_.end(), q.begin());
      result.cost = cost;
      result.miss = aims_.miss();
      trust = std::max(trust * (gain > 0.5 ? 0.2 : 1.0), 1e-3);
      // Creeping along a valley whose floor is not zero: a closest pose, not a solution.
      if (gain < 1e-4 && moved < 1e-3 && !reached(result.miss, options.tolerance)) {
        result.end = SearchEnd::stuck;
        return result;
      }
      continue;
    }
    aims_.evaluate(targets, q, true);
    if (good) {
      result.end = SearchEnd::reached;
      return result;
    }
    if (moved < 1e-12 || trust > 1e9) {
      result.end = SearchEnd::stuck;
      return result;
    }
    trust = std::max(trust, 1e-2) * 8;
  }
  result.end =
      reached(result.miss, options.tolerance) ? SearchEnd::reached : SearchEnd::out_of_iterations;
  return result;
}

// The logarithm of Yoshikawa's measure of the first goal's tip: its gradient is free of scale.
double Search::manipulability(std::span<const double> q) {
  const Mechanism& m = aims_.mechanism();
  aims_.place(q);
  Eigen::MatrixXd J = aims_.tip_jacobian(0);
  J.topRows<3>() /= m.length;
  for (std::size_t i = 0; i < m.velocities.size(); ++i)
    J.col(static_cast<Eigen::Index>(i)) *= m.velocities[i].unit;
  const Eigen::MatrixXd g =
      J.cols() >= 6 ? Eigen::MatrixXd(J * J.transpose()) : Eigen::MatrixXd(J.transpose() * J);
  return 0.5 * std::log(std::max(g.determinant(), 1e-300));
}

double Search::objective(IkObjective which, const ClearanceField* clearance,
                         std::span<const double> q, Eigen::VectorXd* gradient) {
  const auto& velocities = aims_.mechanism().velocities;
  double h = 0;
  if (which == IkObjective::manipulability) {
    h = manipulability(q);
    if (!gradient) return h;
    constexpr double kStep = 1e-5;
    for (Eigen::Index i = 0; i < step_.size(); ++i) {
      double side[2];
      for (int s = 0; s < 2; ++s) {
        real_step_.setZero();
        real_step_[i] = s ? kStep : -kStep;
        std::copy(q.begin(), q.end(), trial_.begin());
        advance(aims_.mechanism(), {real_step_.data(), velocities.size()}, false, trial_);
        side[s] = manipulability(trial_);
      }
      (*gradient)[i] = (side[1] - side[0]) / (2 * kStep);
    }
    return h;
  }
  if (which == IkObjective::clearance) {
    Eigen::VectorXd g = Eigen::VectorXd::Zero(step_.size());
    h = clearance->distance(q, {g.data(), velocities.size()});
    if (gradient) *gradient = g;
    return h;
  }
  for (std::size_t i = 0; i < velocities.size(); ++i) {
    const Velocity& v = velocities[i];
    const double range = v.upper - v.lower;
    if (v.q < 0 || !std::isfinite(range) || !(range > 0)) continue;
    const double x = q[static_cast<std::size_t>(v.q)];
    if (which == IkObjective::centre) {
      const double d = (x - 0.5 * (v.lower + v.upper)) / range;
      h -= 0.5 * d * d;
      if (gradient) (*gradient)[static_cast<Eigen::Index>(i)] = -d / range;
    } else if (which == IkObjective::limits) {
      // Zero in the middle half; towards a limit it falls like the square of what is used up.
      const double d = (x - 0.5 * (v.lower + v.upper)) / (0.5 * range);
      const double over = std::fabs(d) - 0.5;
      if (over <= 0) continue;
      h -= over * over;
      if (gradient)
        (*gradient)[static_cast<Eigen::Index>(i)] = -2 * over * (d > 0 ? 1 : -1) / (0.5 * range);
    }
  }
  return h;
}

// The part of `direction` that the aims do not feel, over the velocities that are not held.
Eigen::VectorXd Search::free_part(const Eigen::VectorXd& direction) {
  const Eigen::MatrixXd& J = aims_.jacobian();
  Eigen::VectorXd d = direction;
  Eigen::Index k = 0;
  for (std::size_t i = 0; i < held_.size(); ++i)
    if (held_[i]) d[static_cast<Eigen::Index>(i)] = 0;
    else free_columns_.col(k++) = J.col(static_cast<Eigen::Index>(i));
  if (k == 0 || J.rows() == 0) return d;
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(free_columns_.leftCols(k), Eigen::ComputeThinV);
  Eigen::VectorXd x(k);
  k = 0;
  for (std::size_t i = 0; i < held_.size(); ++i)
    if (!held_[i]) x[k++] = d[static_cast<Eigen::Index>(i)];
  for (Eigen::Index c = 0; c < svd.singularValues().size(); ++c)
    if (svd.singularValues()[c] > 1e-7 * svd.singularValues()[0])
      x -= svd.matrixV().col(c) * svd.matrixV().col(c).dot(x);
  k = 0;
  for (std::size_t i = 0; i < held_.size(); ++i)
    if (!held_[i]) d[static_cast<Eigen::Index>(i)] = x[k++];
  return d;
}

void Search::improve(std::span<const Pose> targets, const SearchOptions& options, IkObjective which,
                     const ClearanceField* clearance, double first_step, int steps,
                     std::span<double> q) {
  const auto& velocities = aims_.mechanism().velocities;
  const auto n = static_cast<Eigen::Index>(velocities.size());
  std::vector<double> next(q.size());
  double size = first_step;
  Eigen::VectorXd gradient(n);
  for (int i = 0; i < steps && size > 1e-5 && !progress_.cancelled(); ++i) {
    gradient.setZero();
    const double now = objective(which, clearance, q, &gradient);
    for (Eigen::Index k = 0; k < n; ++k)
      gradient[k] *= velocities[static_cast<std::size_t>(k)].unit;
    aims_.evaluate(targets, q, true);
    std::fill(held_.begin(), held_.end(), char{0});
    Eigen::VectorXd d = free_part(gradient);
    for (std::size_t round = 0; round < velocities.size(); ++round) {
      bool more = false;
      for (std::size_t k = 0; k < velocities.size(); ++k) {
        const Velocity& v = velocities[k];
        if (v.q < 0 || held_[k]) continue;
        const double x = q[static_cast<std::size_t>(v.q)], s = d[static_cast<Eigen::Index>(k)];
        if ((x <= v.lower && s < 0) || (x >= v.upper && s > 0)) held_[k] = 1, more = true;
      }
      if (!more) break;
      d = free_part(gradient);
    }
    const double greatest = d.cwiseAbs().maxCoeff();
    if (!(greatest > 1e-9)) return;
    bool better = false;
    while (!better && size > 1e-5) {
      Eigen::VectorXd real(n);
      for (Eigen::Index k = 0; k < n; ++k)
        real[k] = d[k] * (size / greatest) * velocities[static_cast<std::size_t>(k)].unit;
      std::copy(q.begin(), q.end(), next.begin());
      advance(aims_.mechanism(), {real.data(), velocities.size()}, options.use_limits, next);
      const SearchResult r = run(targets, options, next);
      if (r.end == SearchEnd::cancelled) return;
      const double gain =
          r.end == SearchEnd::reached ? objective(which, clearance, next, nullptr) - now : -1;
      better = gain > 1e-12 * (1 + std::fabs(now));
      if (!better) size *= 0.3;
    }
    if (!better) return;
    std::copy(next.begin(), next.end(), q.begin());
    size = std::min(first_step, size * 2);
  }
}

}  // namespace robomosp::ik_numeric
