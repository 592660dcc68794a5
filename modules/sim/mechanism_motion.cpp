// SPDX-License-Identifier: Apache-2.0
#include "sim/mechanism_motion.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Core>

#include "robotics/closure.h"
#include "robotics/decompositions.h"
#include "robotics/kinematics.h"
#include "spatial/pose.h"
#include "spatial/rest.h"

namespace robomosp::sim {
namespace {

using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
constexpr double kInfinity = std::numeric_limits<double>::infinity();
/// A joint this near to a stop stands at it [rad or m].
constexpr double kTouch = 1e-9;
/// Loops closed better than this are left alone [m, rad].
constexpr double kClosed = 1e-13;
/// Rounds in which simultaneous impacts settle.
constexpr int kImpacts = 50;

std::size_t position_of(std::int32_t index) { return static_cast<std::size_t>(index); }

void normalize(double* quaternion) {
  double n = 0;
  for (int k = 0; k < 4; ++k) n += quaternion[k] * quaternion[k];
  if (std::fabs(n - 1) <= 4 * std::numeric_limits<double>::epsilon() || !(n > 0)) return;
  n = std::sqrt(n);
  for (int k = 0; k < 4; ++k) quaternion[k] /= n;
}

/// dq = q (0, w) / 2.
void quaternion_rate(const double* q, const double* w, double* dq) {
  dq[0] = -0.5 * (q[1] * w[0] + q[2] * w[1] + q[3] * w[2]);
  dq[1] = 0.5 * (q[0] * w[0] + q[2] * w[2] - q[3] * w[1]);
  dq[2] = 0.5 * (q[0] * w[1] + q[3] * w[0] - q[1] * w[2]);
  dq[3] = 0.5 * (q[0] * w[2] + q[1] * w[1] - q[2] * w[0]);
}

/// Of motions that nobody stops.
const Progress& nobody() {
  static const NoProgress progress;
  return progress;
}

}  // namespace

MechanismMotion::MechanismMotion(Bound<ForwardDynamics> dynamics, MotionOptions options)
    : dynamics_(std::move(dynamics)),
      options_(std::move(options)),
      coordinates_(model().coordinate_count()),
      velocities_(model().dof()),
      loop_rows_(robotics::loop_rows(model())),
      entries_(velocities_),
      torques_(velocities_),
      tau_(velocities_),
      applied_(velocities_),
      qdd_(velocities_),
      held_force_(velocities_),
      q_(coordinates_),
      scratch_(dynamics_.solver->scratch_size()),
      frames_(model().joints.size()),
      residual_(loop_rows_),
      jacobian_(loop_rows_ * velocities_),
      quiet_(options_.whole ? *options_.whole : nobody()) {
  for (std::size_t i = 0; i < model().joints.size(); ++i) {
    const JointModel& joint = model().joints[i];
    if (robomosp::coordinate_count(joint.type) != 1) continue;
    Entry& e = entries_[position_of(joint.v_index)];
    const double r = joint.is_coupled() ? joint.coupling.ratio : 1;
    if (!joint.is_coupled()) e.joint = i;
    if (options_.friction) {
      const JointFriction& f = joint.friction;
      e.viscous += r * r * f.viscous;
      e.coulomb_positive += r > 0 ? r * f.coulomb_positive : r * f.coulomb_negative;
      e.coulomb_negative += r > 0 ? r * f.coulomb_negative : r * f.coulomb_positive;
    }
    if (options_.at_limit == AtLimit::ignore) continue;
    for (const bool is_upper : {false, true}) {
      const double limit = is_upper ? joint.upper : joint.lower;
      if (std::isfinite(limit) && r != 0)
        stops_.push_back({i, position_of(joint.v_index), position_of(joint.q_index), r,
                          joint.is_coupled() ? joint.coupling.offset : 0, limit, is_upper, false});
    }
  }
  for (std::size_t v = 0; v < velocities_; ++v) {
    const bool has_stop =
        options_.at_limit == AtLimit::stop &&
        std::any_of(stops_.begin(), stops_.end(), [v](const Stop& s) { return s.entry == v; });
    if (entries_[v].has_coulomb() || has_stop) watched_.push_back(v);
  }
}

bool MechanismMotion::has_friction() const {
  return std::any_of(entries_.begin(), entries_.end(),
                     [](const Entry& e) { return e.viscous > 0 || e.has_coulomb(); });
}

void MechanismMotion::set_torques(std::span<const double> tau) {
  torques_.assign(tau.begin(), tau.end());
}

double MechanismMotion::margin(const Entry& e, double force) {
  return std::min(force - e.low, e.high - force);
}

/// What acts on the joints besides weight and motion: motors, friction of sliding joints.
void MechanismMotion::applied(double t, std::span<const double> qd) {
  tau_ = torques_;
  if (options_.torques) options_.torques(t, tau_);
  for (const JointModel& joint : model().joints) {
    if (joint.is_coupled()) continue;
    for (std::int32_t k = 0; k < velocity_count(joint.type); ++k) {
      double& tau = tau_[position_of(joint.v_index + k)];
      if (joint.passive) tau = 0;
      if (velocity_count(joint.type) == 1) tau = std::clamp(tau, -joint.max_force, joint.max_force);
    }
  }
  for (std::size_t v = 0; v < velocities_; ++v) {
    const Entry& e = entries_[v];
    const double coulomb = e.slides > 0   ? e.coulomb_positive
                           : e.slides < 0 ? e.coulomb_negative
                                          : 0;
    applied_[v] = tau_[v] - e.viscous * qd[v] - coulomb;
  }
}

/// Columns of the inverse inertia (of the closed mechanism) for some entries.
Result<void> MechanismMotion::mobility_columns(std::span<const double> q,
                                               const std::vector<std::size_t>& entries) {
  // With loops a first sample without force takes out what stabilises them.
  const std::size_t extra = loop_rows_ > 0 ? 1 : 0, count = entries.size() + extra;
  column_q_.clear();
  for (std::size_t i = 0; i < count; ++i) column_q_.insert(column_q_.end(), q.begin(), q.end());
  column_tau_.assign(count * velocities_, 0.0);
  for (std::size_t i = 0; i < entries.size(); ++i)
    column_tau_[(i + extra) * velocities_ + entries[i]] = 1;
  columns_.assign(count * velocities_, 0.0);
  DynamicsBatch batch;
  batch.count = count, batch.q = column_q_, batch.tau = column_tau_, batch.scratch = scratch_;
  batch.terms = 0;
  RMP_TRY(guarded(dynamics_.provider,
                  [&] { return dynamics_.solver->accelerations(batch, columns_, quiet_); }));
  if (extra == 0) return {};
  for (std::size_t i = 1; i < count; ++i)
    for (std::size_t v = 0; v < velocities_; ++v) columns_[i * velocities_ + v] -= columns_[v];
  columns_.erase(columns_.begin(), columns_.begin() + static_cast<std::ptrdiff_t>(velocities_));
  return {};
}

/// qdd_, tau_ and held_force_ at a state.
Result<void> MechanismMotion::evaluate(double t, std::span<const double> x) {
  const auto q = x.first(coordinates_), qd = x.subspan(coordinates_);
  applied(t, qd);
  DynamicsBatch batch;
  batch.count = 1, batch.q = q, batch.qd = qd, batch.tau = applied_, batch.scratch = scratch_;
  if (options_.outside) {
    loaded_ = applied_;
    RMP_TRY(options_.outside(t, q, qd, loaded_));
    batch.tau = loaded_;
  }
  batch.terms = kAllTerms & ~static_cast<std::uint32_t>(kFrictionTerm);
  TipWrench wrench;
  if (options_.wrench) {
    RMP_TRY_ASSIGN(wrench, options_.wrench(t, q));
    batch.tip = std::span(&wrench, 1);
    batch.tip_index = options_.tip;
  }
  BaseMotion base;
  if (options_.base) {
    RMP_TRY_ASSIGN(base, options_.base(t));
    batch.base = std::span(&base, 1);
  }
  RMP_TRY(guarded(dynamics_.provider,
                  [&] { return dynamics_.solver->accelerations(batch, qdd_, quiet_); }));
  std::fill(held_force_.begin(), held_force_.end(), 0.0);
  held_.clear();
  for (std::size_t v = 0; v < velocities_; ++v)
    if (entries_[v].is_held) held_.push_back(v);
  if (held_.empty()) return {};
  RMP_TRY(mobility_columns(q, held_));
  const auto m = static_cast<Eigen::Index>(held_.size());
  Matrix a(m, m);
  Eigen::VectorXd b(m);
  for (Eigen::Index i = 0; i < m; ++i) {
    const std::size_t row = held_[static_cast<std::size_t>(i)];
    b[i] = -qdd_[row];
    for (Eigen::Index j = 0; j < m; ++j)
      a(i, j) = columns_[static_cast<std::size_t>(j) * velocities_ + row];
  }
  // Loops make holding forces redundant; then the least ones.
  const Eigen::VectorXd f =
      loop_rows_ > 0
          ? Eigen::VectorXd(Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd>(a).solve(b))
          : Eigen::VectorXd(Eigen::LDLT<Eigen::MatrixXd>(a).solve(b));
  for (std::size_t i = 0; i < held_.size(); ++i) {
    const double force = f[static_cast<Eigen::Index>(i)];
    held_force_[held_[i]] = force;
    for (std::size_t v = 0; v < velocities_; ++v) qdd_[v] += force * columns_[i * velocities_ + v];
  }
  for (const std::size_t v : held_) qdd_[v] = 0;
  return {};
}

void MechanismMotion::coordinate_rates(std::span<const double> q, std::span<const double> qd,
                                       std::span<double> dq) const {
  for (const JointModel& joint : model().joints) {
    if (joint.is_coupled()) continue;
    const double *from = &q[position_of(joint.q_index)], *v = &qd[position_of(joint.v_index)];
    double* out = &dq[position_of(joint.q_index)];
    if (joint.type == JointType::spherical) {
      quaternion_rate(from, v, out);
    } else if (joint.type == JointType::free) {
      Pose turned;
      turned.R = spatial::quaternion_rotation(from + 3);
      const Vec3 way = spatial::rotate(turned, Vec3{v[0], v[1], v[2]});
      std::copy(way.begin(), way.end(), out);
      quaternion_rate(from + 3, v + 3, out + 3);
    } else {
      out[0] = v[0];
    }
  }
}

Result<void> MechanismMotion::rate(double t, std::span<const double> x, std::span<double> dx) {
  if (failure_) return *failure_;
  RMP_TRY(evaluate(t, x));
  coordinate_rates(x.first(coordinates_), x.subspan(coordinates_), dx.first(coordinates_));
  std::copy(qdd_.begin(), qdd_.end(), dx.begin() + static_cast<std::ptrdiff_t>(coordinates_));
  for (const std::size_t v : held_) dx[coordinates_ + v] = 0;
  return {};
}

double MechanismMotion::loop_error(std::span<const double> q) {
  if (loop_rows_ == 0) return 0;
  robotics::forward_kinematics(model(), q, frames_);
  robotics::loop_residual(model(), frames_, residual_);
  double greatest = 0;
  for (const double r : residual_) greatest = std::max(greatest, std::fabs(r));
  return greatest;
}

/// Quaternions to length 1; loops closed by the least motion of the joints that are not held, and
/// velocities along the loops.
void MechanismMotion::project(std::span<double> x) {
  for (const JointModel& joint : model().joints)
    if (const std::int32_t count = robomosp::coordinate_count(joint.type); count > 1)
      normalize(&x[position_of(joint.q_index + count - 4)]);
  if (loop_rows_ == 0) return;
  const auto q = x.first(coordinates_), qd = x.subspan(coordinates_);
  const auto rows = static_cast<Eigen::Index>(loop_rows_),
             cols = static_cast<Eigen::Index>(velocities_);
  const auto solve = [&](const Eigen::VectorXd& wanted) {
    Matrix j = Eigen::Map<const Matrix>(jacobian_.data(), rows, cols);
    for (std::size_t v = 0; v < velocities_; ++v)
      if (entries_[v].is_held) j.col(static_cast<Eigen::Index>(v)).setZero();
    return Eigen::VectorXd(
        Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd>(j).solve(wanted));
  };
  bool moved = false;
  for (int pass = 0; pass < 5 && loop_error(q) > kClosed; ++pass) {
    robotics::loop_jacobian(model(), frames_, jacobian_);
    const Eigen::VectorXd step = solve(-Eigen::Map<const Eigen::VectorXd>(residual_.data(), rows));
    robotics::move_configuration(model(), std::span<const double>(step.data(), velocities_), q);
    moved = true;
  }
  if (!moved) robotics::forward_kinematics(model(), q, frames_);
  robotics::loop_jacobian(model(), frames_, jacobian_);
  const Eigen::VectorXd drift = Eigen::Map<const Matrix>(jacobian_.data(), rows, cols) *
                                Eigen::Map<const Eigen::VectorXd>(qd.data(), cols);
  if (drift.cwiseAbs().maxCoeff() <= kClosed) return;
  const Eigen::VectorXd step = solve(-drift);
  for (std::size_t v = 0; v < velocities_; ++v) qd[v] += step[static_cast<Eigen::Index>(v)];
}

// --- events -------------------------------------------------------------------------------------
// First one a watched entry: of a held one how far its force is from what can hold it, of a sliding
// one its velocity. Then one a stop: the way left to it.

std::size_t MechanismMotion::events() const { return watched_.size() + stops_.size(); }

void MechanismMotion::event_values(double t, std::span<const double> x, std::span<double> g) {
  const bool holds =
      std::any_of(entries_.begin(), entries_.end(), [](const Entry& e) { return e.is_held; });
  bool known = false;
  if (holds && !failure_) {
    auto done = evaluate(t, x);
    known = done.ok();
    if (!known) failure_ = std::move(done).error();
  }
  std::size_t i = 0;
  for (const std::size_t v : watched_) {
    const Entry& e = entries_[v];
    double value = 1;
    if (e.is_held) value = known ? margin(e, held_force_[v]) : 1;
    else if (e.has_coulomb() && e.slides != 0) value = e.slides * x[coordinates_ + v];
    g[i++] = value;
  }
  for (const Stop& s : stops_) g[i++] = s.is_touched ? 1 : s.way(x);
}

bool MechanismMotion::at_event(double t, std::size_t index, std::span<double> x) {
  if (failure_) return false;
  if (index >= watched_.size()) {
    Stop& stop = stops_[index - watched_.size()];
    if (options_.at_limit == AtLimit::report) {
      const double speed = stop.ratio * x[coordinates_ + stop.entry];
      const bool outward = stop.into() * x[coordinates_ + stop.entry] > 0;
      if (outward) happen(t, MotionEvent::Kind::report, stop.joint, stop.is_upper, speed);
      return true;
    }
    hit(t, stop, x);
  } else if (const std::size_t v = watched_[index]; entries_[v].is_held) {
    // At the very limit of what can hold it, where rounding decides on which side: it is let go.
    if (auto done = let_go(t, v, x); !done.ok()) {
      failure_ = std::move(done).error();
      return false;
    }
    return true;
  } else {
    x[coordinates_ + v] = 0;
  }
  if (auto done = settle(t, x); !done.ok()) {
    failure_ = std::move(done).error();
    return false;
  }
  return true;
}

/// Gives an entry a new velocity by an impulse on it alone; the others follow by the mobility.
void MechanismMotion::push(std::size_t entry, double impulse_to, std::span<double> x) {
  if (failure_) return;
  if (auto done = mobility_columns(x.first(coordinates_), {entry}); !done.ok()) {
    failure_ = std::move(done).error();
    return;
  }
  const auto qd = x.subspan(coordinates_);
  const double own = columns_[entry];
  if (!(own > 0)) return;
  const double impulse = (impulse_to - qd[entry]) / own;
  for (std::size_t v = 0; v < velocities_; ++v) qd[v] += impulse * columns_[v];
  qd[entry] = impulse_to;
}

void MechanismMotion::hit(double t, Stop& stop, std::span<double> x) {
  const auto qd = x.subspan(coordinates_);
  const double speed = qd[stop.entry], back = -options_.restitution * speed;
  if (stop.into() * speed <= 0) return;
  const bool rests = std::fabs(back * stop.ratio) < options_.rest_speed;
  if (!model().joints[stop.joint].is_coupled()) x[stop.coordinate] = stop.value;
  happen(t, rests ? MotionEvent::Kind::rest : MotionEvent::Kind::limit, stop.joint, stop.is_upper,
         stop.ratio * speed);
  push(stop.entry, rests ? 0 : back, x);
  // What rests elsewhere may have been pushed into its stop.
  for (int round = 0; round < kImpacts; ++round) {
    bool again = false;
    for (const Stop& other : stops_) {
      if (!other.is_touched || other.into() * qd[other.entry] <= 1e-14) continue;
      push(other.entry, 0, x);
      again = true;
    }
    if (!again) break;
  }
}

void MechanismMotion::bring_to_rest(std::span<double> x) const {
  for (std::size_t v = 0; v < velocities_; ++v) {
    double& speed = x[coordinates_ + v];
    if (entries_[v].has_coulomb() && std::fabs(speed) <= spatial::kRestSpeed) speed = 0;
  }
}

Result<void> MechanismMotion::settle(double t, std::span<double> x) {
  return settle(t, x, velocities_, 0);
}

Result<void> MechanismMotion::let_go(double t, std::size_t entry, std::span<double> x) {
  RMP_TRY(evaluate(t, x));
  const Entry& e = entries_[entry];
  const double force = held_force_[entry];
  return settle(t, x, entry, force - e.low < e.high - force ? 1 : -1);
}

/// `freed` does not hold any longer and goes in `direction`; velocities_ = none.
Result<void> MechanismMotion::settle(double t, std::span<double> x, std::size_t freed,
                                     int direction) {
  const auto q = x.first(coordinates_), qd = x.subspan(coordinates_);
  std::vector<bool> was_held(velocities_);
  std::vector<int> slid(velocities_);
  for (std::size_t v = 0; v < velocities_; ++v)
    was_held[v] = entries_[v].is_held, slid[v] = entries_[v].slides;
  // All that rests is held at first, by friction and by the stops it touches.
  for (Entry& e : entries_) e.is_held = false;
  for (const std::size_t v : watched_) {
    Entry& e = entries_[v];
    e.slides = qd[v] > 0 ? 1 : qd[v] < 0 ? -1 : 0;
    if (qd[v] != 0) continue;
    e.is_held = e.has_coulomb();
    e.low = -options_.breakaway * e.coulomb_positive;
    e.high = -options_.breakaway * e.coulomb_negative;
  }
  if (options_.at_limit == AtLimit::stop)
    for (Stop& s : stops_) {
      Entry& e = entries_[s.entry];
      s.is_touched = s.way(q) <= kTouch && qd[s.entry] == 0;
      if (!s.is_touched) continue;
      e.is_held = true;
      (s.into() > 0 ? e.low : e.high) = s.into() > 0 ? -kInfinity : kInfinity;
    }
  std::vector<bool> was_freed(velocities_);
  if (freed < velocities_) release(freed, direction), was_freed[freed] = true;
  // Then what is pulled hardest is let go, one after the other. What then would slide against its
  // own friction, because another joint was let go as well, is held again, once.
  for (std::size_t round = 0; round <= 3 * watched_.size(); ++round) {
    RMP_TRY(evaluate(t, x));
    bool changed = false;
    for (const std::size_t v : watched_) {
      Entry& e = entries_[v];
      if (e.is_held || qd[v] != 0 || !e.has_coulomb() || was_freed[v] || e.slides == 0) continue;
      if (qdd_[v] * e.slides >= 0) continue;
      e.is_held = was_freed[v] = changed = true;
    }
    if (changed) continue;
    double worst = 0;
    std::size_t next = velocities_;
    for (const std::size_t v : held_) {
      const double over = -margin(entries_[v], held_force_[v]);
      if (over > worst) worst = over, next = v;
    }
    if (next == velocities_) break;
    release(next, held_force_[next] < entries_[next].low ? 1 : -1);
  }
  for (const std::size_t v : watched_) {
    const Entry& e = entries_[v];
    if (was_held[v] && !e.is_held) happen(t, MotionEvent::Kind::slides, e.joint, false, e.slides);
    if (!was_held[v] && e.is_held) happen(t, MotionEvent::Kind::sticks, e.joint);
  }
  return {};
}

void MechanismMotion::release(std::size_t entry, int direction) {
  entries_[entry].is_held = false;
  entries_[entry].slides = direction;
  for (Stop& s : stops_)
    if (s.entry == entry) s.is_touched = false;
}

Result<void> MechanismMotion::forces(double t, std::span<const double> x, Forces& out) {
  RMP_TRY(evaluate(t, x));
  out.qdd = qdd_;
  out.tau = tau_;
  out.friction.assign(velocities_, 0.0);
  out.stop.assign(velocities_, 0.0);
  for (std::size_t v = 0; v < velocities_; ++v) {
    const Entry& e = entries_[v];
    if (!e.is_held) {
      out.friction[v] = applied_[v] - tau_[v];
      continue;
    }
    // Friction takes what it can of the holding force, the stop the rest.
    out.friction[v] = std::clamp(held_force_[v], -options_.breakaway * e.coulomb_positive,
                                 -options_.breakaway * e.coulomb_negative);
    out.stop[v] = held_force_[v] - out.friction[v];
  }
  return {};
}

}  // namespace robomosp::sim
