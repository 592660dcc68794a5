// SPDX-License-Identifier: Apache-2.0
#include "robotics/closure.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include <Eigen/Core>

#include "robotics/decompositions.h"
#include "robotics/kinematics.h"
#include "spatial/loops.h"
#include "spatial/pose.h"
#include "spatial/rotation.h"

namespace robomosp::robotics {
namespace {

using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
using Vector = Eigen::VectorXd;

bool fixes(const LoopModel& loop, std::size_t direction) {
  return (loop.fixed >> direction & 1U) != 0;
}

/// Adds the six rows of a loop for the motion of an end on `joint`, times `sign`.
void add_end(const RobotModel& model, std::span<const Pose> frames, std::int32_t joint,
             const spatial::LoopGap& gap, double sign, Matrix& rows) {
  for (std::int32_t j = joint; j >= 0; j = model.joints[static_cast<std::size_t>(j)].parent) {
    const JointModel& m = model.joints[static_cast<std::size_t>(j)];
    const Pose& own = frames[static_cast<std::size_t>(j)];
    const double factor = sign * (m.is_coupled() ? m.coupling.ratio : 1.0);
    Eigen::Index column = m.v_index;
    const auto add = [&](const spatial::Screw& motion) {
      const std::array<double, 6> rates = gap.rates(motion, true);
      for (Eigen::Index k = 0; k < 6; ++k)
        rows(k, column) += factor * rates[static_cast<std::size_t>(k)];
    };
    const auto slide = [&](std::size_t k) { add({{}, spatial::axis(own, k)}); };
    const auto turn = [&](std::size_t k) {
      const Vec3 z = spatial::axis(own, k);
      add({z, spatial::cross(own.p, z)});
    };
    if (m.type == JointType::revolute) turn(2);
    if (m.type == JointType::prismatic) slide(2);
    if (m.type == JointType::free)
      for (std::size_t k = 0; k < 3; ++k, ++column) slide(k);
    if (m.type == JointType::spherical || m.type == JointType::free)
      for (std::size_t k = 0; k < 3; ++k, ++column) turn(k);
  }
}

/// Everything that closing needs again and again.
class Closer {
 public:
  Closer(const RobotModel& model, const std::vector<bool>& held, const ClosureOptions& options)
      : model_(model),
        options_(options),
        frames_(model.joints.size()),
        residual_(static_cast<Eigen::Index>(loop_rows(model))),
        jacobian_(residual_.size(), static_cast<Eigen::Index>(model.dof())) {
    for (std::size_t v = 0; v < model.dof(); ++v)
      if (v >= held.size() || !held[v]) free_.push_back(static_cast<Eigen::Index>(v));
    size_ = 0.01;
    for (const JointModel& j : model.joints) size_ = std::max(size_, spatial::norm(j.placement.p));
  }

  /// Newton's method from q; leaves the best configuration there.
  bool close(std::vector<double>& q) {
    evaluate(q);
    double now = residual_.norm();
    for (int i = 0; i < options_.most_iterations && now > 0.01 * options_.tolerance; ++i) {
      ++iterations;
      linearise();
      // Where the pseudo-inverse's step leads nowhere, near a lost direction, damped ones do.
      bool is_better = false;
      for (const double damping : {0.0, 1e-3, 1e-1}) {
        is_better = search(newton_step(damping), q, now);
        if (is_better) break;
      }
      if (!is_better) break;
    }
    residual = evaluate(q);
    return residual <= options_.tolerance;
  }

  /// Newton's method, then again from displaced starts when it stood at a singular place.
  bool close_from_anywhere_near(std::vector<double>& q) {
    std::vector<double> best = q;
    if (close(best)) {
      q = std::move(best);
      return true;
    }
    double least = residual_.norm();
    // Fixed numbers: the same mechanism closes the same way every time.
    std::minstd_rand random(20011);
    std::uniform_real_distribution<double> uniform(-1, 1);
    for (const double scale : {0.01, 0.03, 0.1, 0.1, 0.3, 0.3, 0.6, 0.6, 1.0, 1.0}) {
      std::vector<double> other = q;
      Vector step(static_cast<Eigen::Index>(free_.size()));
      for (Eigen::Index k = 0; k < step.size(); ++k)
        step[k] = scale * uniform(random) * (is_length(free_[at(k)]) ? size_ : 1.0);
      move_configuration(model_, spread(step), other);
      const bool is_closed = close(other);
      if (is_closed || residual_.norm() < least) {
        least = residual_.norm();
        best = other;
      }
      if (is_closed) {
        q = std::move(best);
        return true;
      }
    }
    q = std::move(best);
    residual = evaluate(q);
    return false;
  }

  /// Greatest element of the residual, of which loop.
  [[nodiscard]] std::size_t worst_loop() const {
    Eigen::Index worst = 0;
    if (residual_.size() > 0) residual_.cwiseAbs().maxCoeff(&worst);
    return spatial::loop_of_row(model_.loops, at(worst));
  }

  double residual = 0;
  int iterations = 0;

 private:
  static constexpr double kLongestStep = 0.35;  ///< of a joint in one step [rad or mechanism sizes]

  static std::size_t at(Eigen::Index k) { return static_cast<std::size_t>(k); }

  double evaluate(std::span<const double> q) {
    forward_kinematics(model_, q, frames_);
    loop_residual(model_, frames_, {residual_.data(), at(residual_.size())});
    return residual_.size() == 0 ? 0.0 : residual_.cwiseAbs().maxCoeff();
  }

  /// Goes along a step, halved until the residual shrinks; false = it does not.
  bool search(const Vector& step, std::vector<double>& q, double& now) {
    const double longest = longest_of(step);
    if (!(longest > 0) || !std::isfinite(longest)) return false;
    double factor = std::min(1.0, kLongestStep / longest);
    for (int halvings = 0; halvings < 8; ++halvings, factor *= 0.5) {
      std::vector<double> next = q;
      move_configuration(model_, spread(factor * step), next);
      evaluate(next);
      if (residual_.norm() < now) {
        now = residual_.norm();
        q = std::move(next);
        return true;
      }
    }
    evaluate(q);
    return false;
  }

  /// The Jacobian of the free joints where evaluate() was last.
  void linearise() {
    loop_jacobian(model_, frames_, {jacobian_.data(), at(jacobian_.size())});
    of_free_.resize(residual_.size(), static_cast<Eigen::Index>(free_.size()));
    for (Eigen::Index k = 0; k < of_free_.cols(); ++k)
      of_free_.col(k) = jacobian_.col(free_[at(k)]);
  }

  /// Least motion of the free joints that closes the loops to first order; damped (Levenberg) by
  /// this part of the Jacobian's size.
  [[nodiscard]] Vector newton_step(double damping) const {
    if (of_free_.cols() == 0) return {};
    if (damping > 0) {
      const double weight = std::max(1e-12, damping * of_free_.squaredNorm());
      Matrix square = of_free_.transpose() * of_free_;
      square.diagonal().array() += weight;
      return square.ldlt().solve(of_free_.transpose() * -residual_);
    }
    Eigen::CompleteOrthogonalDecomposition<Matrix> decomposition;
    // Directions that are less than this part of the strongest are taken for lost.
    decomposition.setThreshold(1e-8);
    decomposition.compute(of_free_);
    return decomposition.solve(-residual_);
  }

  [[nodiscard]] bool is_length(Eigen::Index v) const {
    for (const JointModel& j : model_.joints) {
      if (j.is_coupled() || v < j.v_index || v >= j.v_index + velocity_count(j.type)) continue;
      return j.type == JointType::prismatic || (j.type == JointType::free && v < j.v_index + 3);
    }
    return false;
  }
  [[nodiscard]] double longest_of(const Vector& step) const {
    double longest = 0;
    for (Eigen::Index k = 0; k < step.size(); ++k)
      longest = std::max(longest, std::fabs(step[k]) / (is_length(free_[at(k)]) ? size_ : 1.0));
    return longest;
  }
  [[nodiscard]] std::vector<double> spread(const Vector& step) const {
    std::vector<double> all(model_.dof(), 0.0);
    for (Eigen::Index k = 0; k < step.size(); ++k) all[at(free_[at(k)])] = step[k];
    return all;
  }

  const RobotModel& model_;
  const ClosureOptions& options_;
  std::vector<Pose> frames_;
  Vector residual_;
  Matrix jacobian_, of_free_;
  std::vector<Eigen::Index> free_;
  double size_ = 1;  ///< of the mechanism [m]
};

/// The motion of the held joints from start to target.
std::vector<double> held_way(const RobotModel& model, std::span<const double> start,
                             std::span<const double> target, const std::vector<bool>& held) {
  std::vector<double> way(model.dof(), 0.0);
  for (const JointModel& j : model.joints) {
    if (j.is_coupled()) continue;
    const auto q = static_cast<std::size_t>(j.q_index), v = static_cast<std::size_t>(j.v_index);
    const bool has_rotation = j.type == JointType::spherical || j.type == JointType::free;
    if (!has_rotation) {
      way[v] = target[q] - start[q];
      continue;
    }
    const std::size_t turn = j.type == JointType::free ? 3 : 0;
    Pose from, to;
    from.R = spatial::quaternion_rotation(&start[q + turn]);
    to.R = spatial::quaternion_rotation(&target[q + turn]);
    if (turn == 3) {
      const Vec3 p = spatial::rotate_back(
          from, {target[q] - start[q], target[q + 1] - start[q + 1], target[q + 2] - start[q + 2]});
      std::copy(p.begin(), p.end(), way.begin() + static_cast<std::ptrdiff_t>(v));
    }
    const Vec3 r = spatial::rotation_log(spatial::compose(spatial::inverse(from), to).R);
    std::copy(r.begin(), r.end(), way.begin() + static_cast<std::ptrdiff_t>(v + turn));
  }
  for (std::size_t v = 0; v < way.size(); ++v)
    if (!held[v]) way[v] = 0;
  return way;
}

/// Numbers of held joints as in `target`, to the last bit.
void put_held(const RobotModel& model, std::span<const double> target,
              const std::vector<bool>& held, std::vector<double>& q) {
  for (const JointModel& j : model.joints) {
    if (j.is_coupled() || !held[static_cast<std::size_t>(j.v_index)]) continue;
    const auto first = static_cast<std::size_t>(j.q_index);
    for (std::size_t k = 0; k < static_cast<std::size_t>(coordinate_count(j.type)); ++k)
      q[first + k] = target[first + k];
  }
}

}  // namespace

std::size_t loop_rows(const RobotModel& model) { return spatial::loop_rows(model.loops); }

void loop_residual(const RobotModel& model, std::span<const Pose> joint_frames,
                   std::span<double> residual) {
  std::size_t row = 0;
  for (const LoopModel& loop : model.loops) {
    const Pose a = carried(loop.joint_a, loop.in_a, joint_frames),
               b = carried(loop.joint_b, loop.in_b, joint_frames);
    const spatial::LoopGap gap(a, b);
    for (std::size_t k = 0; k < 6; ++k)
      if (fixes(loop, k)) residual[row++] = k < 3 ? gap.way[k] : gap.turn[k - 3];
  }
}

void loop_jacobian(const RobotModel& model, std::span<const Pose> joint_frames,
                   std::span<double> jacobian) {
  const auto dof = static_cast<Eigen::Index>(model.dof());
  Matrix rows(6, dof);
  std::size_t out = 0;
  for (const LoopModel& loop : model.loops) {
    const Pose a = carried(loop.joint_a, loop.in_a, joint_frames),
               b = carried(loop.joint_b, loop.in_b, joint_frames);
    const spatial::LoopGap gap(a, b);
    rows.setZero();
    add_end(model, joint_frames, loop.joint_b, gap, 1, rows);
    add_end(model, joint_frames, loop.joint_a, gap, -1, rows);
    for (std::size_t k = 0; k < 6; ++k) {
      if (!fixes(loop, k)) continue;
      for (Eigen::Index v = 0; v < dof; ++v)
        jacobian[out++] = rows(static_cast<Eigen::Index>(k), v);
    }
  }
}

void move_configuration(const RobotModel& model, std::span<const double> step,
                        std::span<double> q) {
  for (const JointModel& j : model.joints) {
    if (j.is_coupled()) continue;
    double* own = q.data() + j.q_index;
    const double* by = step.data() + j.v_index;
    if (coordinate_count(j.type) == 1) {
      own[0] += by[0];
      continue;
    }
    double* turn = own + (j.type == JointType::free ? 3 : 0);
    if (j.type == JointType::free) {
      Pose at;
      at.R = spatial::quaternion_rotation(turn);
      const Vec3 way = spatial::rotate(at, Vec3{by[0], by[1], by[2]});
      for (std::size_t k = 0; k < 3; ++k) own[k] += way[k];
      by += 3;
    }
    const Vec3 v{by[0], by[1], by[2]};
    const double angle = spatial::norm(v);
    const double s = angle > 1e-8 ? std::sin(0.5 * angle) / angle : 0.5;
    const double r[4] = {std::cos(0.5 * angle), s * v[0], s * v[1], s * v[2]};
    const double w = turn[0], x = turn[1], y = turn[2], z = turn[3];
    double next[4] = {
        w * r[0] - x * r[1] - y * r[2] - z * r[3], w * r[1] + x * r[0] + y * r[3] - z * r[2],
        w * r[2] - x * r[3] + y * r[0] + z * r[1], w * r[3] + x * r[2] - y * r[1] + z * r[0]};
    const double length =
        std::sqrt(next[0] * next[0] + next[1] * next[1] + next[2] * next[2] + next[3] * next[3]);
    for (std::size_t k = 0; k < 4; ++k) turn[k] = next[k] / length;
  }
}

Closure close_loops(const RobotModel& model, std::span<const double> start,
                    std::span<const double> target, const std::vector<bool>& held,
                    const ClosureOptions& options) {
  Closure out;
  Closer closer(model, held, options);
  std::vector<double> q(start.begin(), start.end());
  const std::vector<double> way = held_way(model, start, target, held);
  double longest = 0;
  for (const double x : way) longest = std::max(longest, std::fabs(x));
  if (model.loops.empty()) {
    put_held(model, target, held, q);
    out.q = std::move(q);
    out.is_closed = true;
    out.outside = joint_outside_limits(model, out.q);
    return out;
  }
  const auto steps =
      std::min<std::size_t>(1000, static_cast<std::size_t>(std::ceil(longest / options.step)));
  out.is_closed = closer.close_from_anywhere_near(q);
  std::vector<double> part(way.size());
  for (std::size_t k = 0; k < way.size(); ++k)
    part[k] = steps > 0 ? way[k] / static_cast<double>(steps) : 0;
  for (std::size_t i = 1; i <= steps; ++i) {
    move_configuration(model, part, q);
    if (i == steps) put_held(model, target, held, q);
    // On the way a step may fail (the start could not be closed either); the end decides.
    out.is_closed = i == steps ? closer.close_from_anywhere_near(q) : closer.close(q);
  }
  out.residual = closer.residual;
  out.worst_loop = closer.worst_loop();
  out.iterations = closer.iterations;
  out.q = std::move(q);
  out.outside = joint_outside_limits(model, out.q);
  return out;
}

std::vector<bool> actuated_velocities(const RobotModel& model) {
  std::vector<bool> held(model.dof(), false);
  const auto is_passive = [](const JointModel& j) { return !j.is_coupled() && j.passive; };
  if (std::none_of(model.joints.begin(), model.joints.end(), is_passive)) return held;
  for (const JointModel& j : model.joints)
    if (!j.is_coupled() && !j.passive)
      for (std::int32_t k = 0; k < velocity_count(j.type); ++k)
        held[static_cast<std::size_t>(j.v_index + k)] = true;
  return held;
}

std::int32_t joint_outside_limits(const RobotModel& model, std::span<const double> q,
                                  double slack) {
  std::int32_t worst = -1;
  double most = slack;
  for (std::size_t i = 0; i < model.joints.size(); ++i) {
    const JointModel& j = model.joints[i];
    if (coordinate_count(j.type) != 1) continue;
    const double value = spatial::joint_value(j, q.data());
    const double by = std::max(j.lower - value, value - j.upper);
    if (by > most) {
      most = by;
      worst = static_cast<std::int32_t>(i);
    }
  }
  return worst;
}

}  // namespace robomosp::robotics
