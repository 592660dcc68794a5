// SPDX-License-Identifier: Apache-2.0
#include "sim/retime.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <robomosp/sdk/retimer.h>

#include "kernel/text.h"
#include "motion/provider_params.h"
#include "robotics/kinematics.h"
#include "spatial/cubic_spline.h"

namespace robomosp::sim {
namespace {

/// Configurations closer than this are one [rad or m].
constexpr double kSameRetimedPlace = 1e-9;
constexpr double kShort = 8;  ///< of the least steps
/// Grid points of a piece at least, and steps between two of its configurations, to begin with: a
/// retimer keeps limits at the grid points only.
constexpr std::size_t kLeastGrid = 400, kLeastParts = 3;
/// The path stops where it turns by more than this from sample to sample.
constexpr double kCornerCosine = 0.866;
constexpr int kMostRounds = 8;
/// Between grid points limits are looked at in these shares of a step, closer where a limit that is
/// met at an end may be passed just behind it. Steps that go beyond are parted; what is then still
/// beyond is made good, with a reserve for what lies between these shares, by running the piece
/// more slowly.
constexpr std::array<double, 9> kBetween{0.04, 0.1, 0.18, 0.33, 0.5, 0.67, 0.82, 0.9, 0.96};
constexpr double kBeyond = 1e-4, kReserve = 1.25;
constexpr std::size_t kParts = 3, kMostGrid = 40000;
constexpr int kMostPartings = 4;
/// A joint that moves less than this share of the fastest one rests: what it moves is rounding.
constexpr double kResting = 1e-9;
/// Slow, but no rest: Coulomb friction is whole, and nothing else of the motion is felt [rad/s].
constexpr double kCreeping = 1e-6;

/// Creeping velocities in the directions of `rates`, for what friction takes where the joints have
/// but started.
std::vector<double> directions(std::span<const double> rates) {
  double greatest = 0;
  for (const double x : rates) greatest = std::max(greatest, std::fabs(x));
  std::vector<double> out;
  for (const double x : rates)
    out.push_back(std::fabs(x) <= kResting * greatest ? 0.0 : std::copysign(kCreeping, x));
  return out;
}

/// Configurations one after the other, without corners.
struct PathPiece {
  std::vector<double> q;
  std::vector<double> approach;  ///< of each whether a move that was put in goes there (1) or not
  std::vector<double> way;       ///< of the tip up to each [m]; empty = nobody asks
};

/// A natural cubic spline through configurations, over the distances between them.
class JointPath {
 public:
  JointPath(std::size_t dof, PathPiece piece)
      : dof_(dof),
        q_(std::move(piece.q)),
        approach_(std::move(piece.approach)),
        way_(std::move(piece.way)) {
    const std::size_t n = q_.size() / dof_;
    s_.assign(n, 0.0);
    for (std::size_t i = 1; i < n; ++i) s_[i] = s_[i - 1] + distance(i - 1, i);
    std::vector<double> step;
    for (std::size_t i = 1; i < n; ++i) step.push_back(s_[i] - s_[i - 1]);
    rate_ = spatial::cubic_spline_rates(dof_, q_, step);
  }
  /// The knots, and points evenly between them where these are few.
  [[nodiscard]] std::vector<double> grid() const {
    const std::size_t parts = std::max(kLeastParts, 1 + kLeastGrid / s_.size());
    std::vector<double> out{s_.front()};
    for (std::size_t i = 1; i < s_.size(); ++i)
      for (std::size_t k = 1; k <= parts; ++k)
        out.push_back(k == parts ? s_[i]
                                 : s_[i - 1] + (s_[i] - s_[i - 1]) * static_cast<double>(k) /
                                                   static_cast<double>(parts));
    return out;
  }

  /// 1 on the way to a configuration of an approach, else 0.
  [[nodiscard]] double approach(double s) const { return approach_[step_of(s) + 1]; }

  /// Way of the tip up to there [m], linear between the configurations.
  [[nodiscard]] double way(double s) const {
    if (way_.empty()) return 0;
    const std::size_t i = step_of(s);
    return way_[i] + (way_[i + 1] - way_[i]) * (s - s_[i]) / (s_[i + 1] - s_[i]);
  }

  void evaluate(double s, double* q, double* q1, double* q2) const {
    const std::size_t i = step_of(s);
    const double h = s_[i + 1] - s_[i], x = s - s_[i];
    for (std::size_t j = 0; j < dof_; ++j) {
      const auto c = spatial::cubic_piece(at(i, j), at(i + 1, j), rate_[i * dof_ + j],
                                          rate_[(i + 1) * dof_ + j], h);
      q[j] = c[0] + x * (c[1] + x * (c[2] + x * c[3]));
      q1[j] = c[1] + x * (2 * c[2] + 3 * x * c[3]);
      q2[j] = 2 * c[2] + 6 * x * c[3];
    }
  }

 private:
  [[nodiscard]] std::size_t step_of(double s) const {
    const auto next = std::upper_bound(s_.begin() + 1, s_.end() - 1, s);
    return static_cast<std::size_t>(next - s_.begin()) - 1;
  }
  [[nodiscard]] double at(std::size_t i, std::size_t j) const { return q_[i * dof_ + j]; }
  [[nodiscard]] double distance(std::size_t a, std::size_t b) const {
    double sum = 0;
    for (std::size_t j = 0; j < dof_; ++j) sum += (at(b, j) - at(a, j)) * (at(b, j) - at(a, j));
    return std::sqrt(sum);
  }
  std::size_t dof_;
  std::vector<double> q_, approach_, way_, s_, rate_;
};

/// The configurations of a motion in pieces without corners, each with two or more.
/// `way_of_tip`: of the tip up to each row [m], or empty. `least_step`: RetimeOptions.
std::vector<PathPiece> pieces_of(const RobotMotion& motion, std::size_t dof, double least_step,
                                 std::span<const double> way_of_tip) {
  double whole = 0;
  for (std::size_t i = 1; i < motion.times.size(); ++i) {
    double square = 0;
    for (std::size_t j = 0; j < dof; ++j) {
      const double d = motion.q[i * dof + j] - motion.q[(i - 1) * dof + j];
      square += d * d;
    }
    whole += std::sqrt(square);
  }
  const double least = std::max(kSameRetimedPlace, least_step * whole);
  std::vector<PathPiece> pieces(1);
  std::vector<double> before;  // direction of the last way
  double last_length = 0;
  for (std::size_t i = 0; i < motion.times.size(); ++i) {
    const auto q = std::span<const double>(motion.q).subspan(i * dof, dof);
    const double approach = motion.approach.empty() ? 0.0 : motion.approach[i];
    PathPiece* piece = &pieces.back();
    if (!piece->q.empty()) {
      const double* last = piece->q.data() + piece->q.size() - dof;
      std::vector<double> way(dof);
      double length = 0, turn = 0;
      for (std::size_t j = 0; j < dof; ++j) {
        way[j] = q[j] - last[j];
        length += way[j] * way[j];
      }
      length = std::sqrt(length);
      if (length < least) continue;
      for (std::size_t j = 0; j < dof; ++j) {
        way[j] /= length;
        if (!before.empty()) turn += way[j] * before[j];
      }
      if (!before.empty() && turn < kCornerCosine) {
        const std::vector<double> corner(last, last + dof);
        // Samples on either side of one corner make two: the short piece between is left out.
        const double corner_approach = piece->approach.back();
        std::vector<double> corner_way;
        if (!piece->way.empty()) corner_way.push_back(piece->way.back());
        if (pieces.size() > 1 && piece->q.size() == 2 * dof && last_length < kShort * least) {
          pieces.pop_back();
          std::copy(corner.begin(), corner.end(),
                    pieces.back().q.end() - static_cast<std::ptrdiff_t>(dof));
          if (!corner_way.empty()) pieces.back().way.back() = corner_way.front();
        }
        pieces.push_back({corner, {corner_approach}, std::move(corner_way)});
        piece = &pieces.back();
      }
      before = std::move(way);
      last_length = length;
    }
    piece->q.insert(piece->q.end(), q.begin(), q.end());
    piece->approach.push_back(approach);
    if (!way_of_tip.empty()) piece->way.push_back(way_of_tip[i]);
  }
  // The end itself, in place of what was near it.
  const auto end = std::span<const double>(motion.q).last(dof);
  std::vector<double>& last = pieces.back().q;
  if (last.size() >= 2 * dof) {
    std::copy(end.begin(), end.end(), last.end() - static_cast<std::ptrdiff_t>(dof));
    if (!way_of_tip.empty()) pieces.back().way.back() = way_of_tip.back();
  } else if (whole > least) {
    last.insert(last.end(), end.begin(), end.end());
    pieces.back().approach.push_back(motion.approach.empty() ? 0.0 : motion.approach.back());
    if (!way_of_tip.empty()) pieces.back().way.push_back(way_of_tip.back());
  } else {
    pieces.pop_back();
  }
  return pieces;
}

/// A piece in time: grid, and when and how fast it is passed.
struct TimedPiece {
  std::vector<double> s;
  Retiming timing;
};

/// How the piece is run at time dt after grid point i: the change of rate is constant in a step.
struct Pace {
  double s, rate, change;
};
Pace pace_at(const TimedPiece& piece, std::size_t i, double dt) {
  const double r0 = piece.timing.rate[i], r1 = piece.timing.rate[i + 1],
               u = (r1 * r1 - r0 * r0) / (2 * (piece.s[i + 1] - piece.s[i]));
  return {std::clamp(piece.s[i] + dt * (r0 + dt * u / 2), piece.s[i], piece.s[i + 1]), r0 + dt * u,
          u};
}

struct Limits {
  std::vector<double> velocity, acceleration, torque;
};

class PieceRetimer {
 public:
  PieceRetimer(const Retimer& retimer, const Params& params, const RobotModel& model,
               const Bound<InverseDynamics>* dynamics, const RetimeOptions& options)
      : retimer_(retimer),
        params_(params),
        model_(model),
        load_(options.load),
        dof_(model.dof()),
        dynamics_(options.has_torques ? dynamics : nullptr) {
    for (const JointModel& joint : model.joints) {
      limits_.velocity.push_back(options.share * joint.max_velocity);
      limits_.acceleration.push_back(options.share * joint.max_acceleration);
      limits_.torque.push_back(options.share * joint.max_force);
    }
    if (std::none_of(limits_.torque.begin(), limits_.torque.end(),
                     [](double t) { return std::isfinite(t); }))
      dynamics_ = nullptr;
  }

  /// The piece within the limits, between grid points too.
  Result<TimedPiece> run(const JointPath& path, const std::string& provider, Progress& progress) {
    TimedPiece out{path.grid(), {}};
    for (int partings = 0;; ++partings) {
      auto timed = guarded(provider, [&] { return retimed(path, out.s, progress); });
      if (!timed.ok()) return std::move(timed).error();
      out.timing = std::move(timed).value();
      if (out.timing.time.size() != out.s.size() || out.timing.rate.size() != out.s.size() ||
          !(out.timing.time.back() > 0) || !std::isfinite(out.timing.time.back()))
        return error(ErrorCode::plugin_failed,
                     "provider \"" + provider + "\" returned times that do not fit the path",
                     "Report it to the provider's author or choose another provider.");
      RMP_TRY_ASSIGN(const std::vector<double> slower, beyond(path, out, progress));
      const double most = *std::max_element(slower.begin(), slower.end());
      const auto is_coarse = [&](std::size_t i) { return slower[i] > 1 + kBeyond / 2; };
      std::vector<double> finer{out.s.front()};
      for (std::size_t i = 0; i + 1 < out.s.size(); ++i) {
        const double h = out.s[i + 1] - out.s[i];
        for (std::size_t k = 1; k < kParts && is_coarse(i); ++k)
          finer.push_back(out.s[i] + h * static_cast<double>(k) / kParts);
        finer.push_back(out.s[i + 1]);
      }
      if (most <= 1 + kBeyond || partings == kMostPartings || finer.size() > kMostGrid) {
        const double factor = 1 + kReserve * (most - 1);
        for (double& t : out.timing.time) t *= factor;
        for (double& r : out.timing.rate) r /= factor;
        return out;
      }
      out.s = std::move(finer);
    }
  }

 private:
  /// By which factor each step would have to be run more slowly to stay within the limits, 1 or
  /// more.
  Result<std::vector<double>> beyond(const JointPath& path, const TimedPiece& piece,
                                     Progress& progress) const {
    const std::size_t steps = piece.s.size() - 1, count = steps * kBetween.size();
    std::vector<double> slower(steps, 1.0), q(count * dof_), qd(q), qdd(q), places(count);
    for (std::size_t k = 0; k < count; ++k) {
      const std::size_t i = k / kBetween.size();
      const double dt = piece.timing.time[i + 1] - piece.timing.time[i];
      const Pace at = pace_at(piece, i, dt * kBetween[k % kBetween.size()]);
      places[k] = at.s;
      double *v = &qd[k * dof_], *a = &qdd[k * dof_];
      path.evaluate(at.s, &q[k * dof_], v, a);
      for (std::size_t j = 0; j < dof_; ++j) {
        a[j] = v[j] * at.change + a[j] * at.rate * at.rate;
        v[j] *= at.rate;
        slower[i] = std::max({slower[i], std::fabs(v[j]) / limits_.velocity[j],
                              std::sqrt(std::fabs(a[j]) / limits_.acceleration[j])});
      }
    }
    if (!dynamics_) return slower;
    // What remains at rest, weight and springs and friction, does not shrink with the speed.
    const std::vector<double> creeping = directions(qd);
    const std::uint32_t rest = kAllTerms & ~(kInertialTerm | kVelocityTerm);
    RMP_TRY_ASSIGN(const auto acting, wrenches(path, places, q));
    RMP_TRY_ASSIGN(const auto whole, torque(q, qd, qdd, kAllTerms, progress, acting));
    RMP_TRY_ASSIGN(const auto still, torque(q, creeping, qdd, rest, progress, acting));
    for (std::size_t k = 0; k < whole.size(); ++k) {
      const double limit = limits_.torque[k % dof_], over = std::fabs(whole[k]) - limit;
      if (!(over > 0)) continue;
      const double room = limit - std::copysign(still[k], still[k] * whole[k]);
      double& factor = slower[k / dof_ / kBetween.size()];
      if (room > 0) factor = std::max(factor, std::sqrt((room + over) / room));
    }
    return slower;
  }

  Result<Retiming> retimed(const JointPath& path, const std::vector<double>& s,
                           Progress& progress) const {
    const std::size_t n = s.size();
    std::vector<double> q1(n * dof_), q(q1), q2(q1);
    for (std::size_t i = 0; i < n; ++i)
      path.evaluate(s[i], &q[i * dof_], &q1[i * dof_], &q2[i * dof_]);
    RetimeProblem p;
    p.dof = dof_;
    p.s = s, p.q = q, p.q1 = q1, p.q2 = q2;
    p.velocity = limits_.velocity, p.acceleration = limits_.acceleration;
    if (!dynamics_) return retimer_.retime(p, params_, progress);

    // tau = a s'' + b s'^2 + c: a by unit changes of rate, b by unit rates, c at rest (Coulomb
    // friction against the way).
    const std::vector<double> zero(n * dof_, 0.0);
    const std::vector<double> creeping = directions(q1);
    const std::uint32_t rest = kAllTerms & ~(kInertialTerm | kVelocityTerm);
    RMP_TRY_ASSIGN(const auto a, torque(q, zero, q1, kInertialTerm, progress));
    RMP_TRY_ASSIGN(const auto bent, torque(q, zero, q2, kInertialTerm, progress));
    RMP_TRY_ASSIGN(auto b, torque(q, q1, zero, kVelocityTerm, progress));
    RMP_TRY_ASSIGN(const auto acting, wrenches(path, s, q));
    RMP_TRY_ASSIGN(const auto c, torque(q, creeping, zero, rest, progress, acting));
    RMP_TRY_ASSIGN(const auto friction, torque(q, q1, zero, kFrictionTerm, progress));
    RMP_TRY_ASSIGN(const auto coulomb, torque(q, creeping, zero, kFrictionTerm, progress));
    for (std::size_t k = 0; k < b.size(); ++k) b[k] += bent[k];
    p.torque_a = a, p.torque_b = b, p.torque_c = c;
    std::vector<double> limit = limits_.torque;
    for (int round = 0;; ++round) {
      p.torque = limit;
      RMP_TRY_ASSIGN(auto done, retimer_.retime(p, params_, progress));
      // Viscous friction grows with the rate itself: the most it takes is set aside.
      double missing = 0;
      for (std::size_t j = 0; j < dof_; ++j) {
        double most = 0;
        for (std::size_t i = 0; i < n; ++i) {
          const std::size_t k = i * dof_ + j;
          most = std::max(most, std::fabs(friction[k] - coulomb[k]) * done.rate[i]);
        }
        if (!std::isfinite(limit[j])) continue;
        const double left = limits_.torque[j] - most;
        missing = std::max(missing, (limit[j] - left) / limits_.torque[j]);
        limit[j] = std::min(limit[j], std::max(left, 0.05 * limits_.torque[j]));
      }
      if (missing <= 1e-6 || round == kMostRounds) return done;
    }
  }

  Result<std::vector<double>> torque(std::span<const double> q, std::span<const double> qd,
                                     std::span<const double> qdd, std::uint32_t terms,
                                     Progress& progress,
                                     std::span<const TipWrench> acting = {}) const {
    DynamicsBatch batch;
    batch.count = q.size() / dof_;
    batch.q = q, batch.qd = qd, batch.qdd = qdd;
    batch.terms = terms;
    batch.tip = acting;
    if (!acting.empty()) batch.tip_index = load_.load->tip();
    return torques(*dynamics_, batch, progress);
  }

  /// What acts at places of the path, base axes; empty = nothing.
  Result<std::vector<TipWrench>> wrenches(const JointPath& path, std::span<const double> s,
                                          std::span<const double> q) const {
    std::vector<TipWrench> out;
    if (!load_.load) return out;
    std::vector<Pose> frames(model_.joints.size());
    for (std::size_t i = 0; i < s.size(); ++i) {
      robotics::forward_kinematics(model_, q.subspan(i * dof_, dof_), frames);
      const auto tip = static_cast<std::size_t>(load_.load->tip());
      RMP_TRY_ASSIGN(const TipWrench given, load_.load->at(0, path.way(s[i])));
      out.push_back(load_.load->in_base(given, load_.world_T_base, model_.base,
                                        robotics::tip_pose(model_, tip, frames)));
    }
    return out;
  }

  const Retimer& retimer_;
  const Params& params_;
  const RobotModel& model_;
  RetimeLoad load_;
  std::size_t dof_;
  const Bound<InverseDynamics>* dynamics_;
  Limits limits_;
};

}  // namespace

Result<RobotMotion> retime(const Registry& registry, const RobotModel& model,
                           const RobotMotion& motion, const Bound<InverseDynamics>* dynamics,
                           const RetimeOptions& options, const std::string& where,
                           Progress& progress) {
  const std::size_t dof = model.dof();
  RMP_TRY_ASSIGN(const ProviderInfo info,
                 registry.find(Retimer::kInterfaceId, options.retimer.name).in(where));
  RMP_TRY_ASSIGN(const auto params, motion::checked_params(info, options.retimer, where));
  RMP_TRY_ASSIGN(const auto retimer, registry.create<Retimer>(info.name).in(where));
  const auto pieces = pieces_of(motion, dof, options.least_step, options.load.path);
  if (pieces.empty()) return motion;  // nothing moves
  PieceRetimer run(*retimer, *params, model, dynamics, options);
  RobotMotion out;
  // Their times are those of the motion before.
  for (const std::string& note : motion.notes) out.notes.push_back("Before retiming: " + note);
  const bool has_approach =
      std::any_of(motion.approach.begin(), motion.approach.end(), [](double x) { return x != 0; });
  double begin = 0;
  std::size_t k = 0;
  for (std::size_t piece = 0; piece < pieces.size(); ++piece) {
    const JointPath path(dof, pieces[piece]);
    RMP_TRY_ASSIGN(const TimedPiece timed, run.run(path, info.name, progress).in(where));
    const std::vector<double>& time = timed.timing.time;
    const double duration = time.back();
    if ((begin + duration) / options.step > 1e7)
      return error(ErrorCode::invalid_argument,
                   "a step of " + text::print_rounded(options.step) + " s makes too many samples",
                   "Give a longer step.", where);
    std::size_t i = 0;
    const bool is_last = piece + 1 == pieces.size();
    for (bool is_end = false; !is_end;) {
      double t = static_cast<double>(k) * options.step - begin;
      if (t >= duration * (1 - 1e-12)) {
        if (!is_last && t > duration * (1 + 1e-12)) break;
        is_end = true;
        t = duration;
      }
      ++k;
      while (i + 2 < time.size() && time[i + 1] < t) ++i;
      const auto [at, paced, u] = pace_at(timed, i, t - time[i]);
      const double rate = is_end ? timed.timing.rate.back() : paced;
      std::vector<double> q(dof), q1(dof), q2(dof);
      path.evaluate(at, q.data(), q1.data(), q2.data());
      out.times.push_back(begin + t);
      if (has_approach) out.approach.push_back(path.approach(at));
      for (std::size_t j = 0; j < dof; ++j) {
        out.q.push_back(q[j]);
        out.qd.push_back(q1[j] * rate);
        out.qdd.push_back(q1[j] * u + q2[j] * rate * rate);
      }
    }
    begin += duration;
    if (!is_last)
      out.notes.push_back("It stops at t = " + text::print_rounded(begin) +
                          " s, where the path has a corner.");
  }
  if (std::any_of(model.joints.begin(), model.joints.end(),
                  [](const JointModel& joint) { return std::isfinite(joint.max_jerk); }))
    out.notes.push_back(
        "The jerk is not limited: at the limits the acceleration changes in steps. A joint segment "
        "time_optimal respects jerk limits.");
  out.position_error.assign(out.times.size(), 0.0);
  out.rotation_error.assign(out.times.size(), 0.0);
  return out;
}

}  // namespace robomosp::sim
