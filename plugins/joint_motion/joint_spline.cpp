// SPDX-License-Identifier: Apache-2.0
// Splines through joint vectors, at given times or as fast as the limits allow (layer: plugin).
//
// Times by search, as in C. Lin, P. Chang, J. Luh, Formulation and optimization of cubic polynomial
// joint trajectories for industrial robots, IEEE Transactions on Automatic Control 28(12), 1983;
// here with exact extremes of every piece and steps that are changed one by one.
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "knots.h"

namespace robomosp::joint_motion {
namespace {

/// Joint values closer than this are one [rad or m, relative above 1].
constexpr double kSameValue = 1e-9;

class JointSpline final : public JointwiseSegment {
 public:
  JointSpline(std::size_t dof, double duration, Spline spline)
      : JointwiseSegment(dof, duration), dof_(dof), spline_(std::move(spline)) {
    knots_.push_back(0);
    for (const double h : spline_.step) knots_.push_back(knots_.back() + h);
  }

 protected:
  [[nodiscard]] Motion1 at(std::size_t joint, double t) const override {
    const auto next = std::upper_bound(knots_.begin() + 1, knots_.end() - 1, t);
    const auto i = static_cast<std::size_t>(next - knots_.begin()) - 1;
    return value(spline_.pieces[i * dof_ + joint], t - knots_[i]);
  }

 private:
  std::size_t dof_;
  Spline spline_;
  std::vector<double> knots_;
};

/// What a spline asks for at its most, as shares of the limits.
struct Use {
  double velocity = 0, acceleration = 0, jerk = 0;
  std::size_t joint = 0, piece = 0;  ///< of the greatest share
  [[nodiscard]] double most() const { return std::max({velocity, acceleration, jerk}); }
  /// How much slower everything must go to use no more than all.
  [[nodiscard]] double stretch() const {
    return std::max({velocity, std::sqrt(acceleration), std::cbrt(jerk)});
  }
};

Use use_of(const Spline& s, const Task& t) {
  Use out;
  for (std::size_t k = 0; k < s.pieces.size(); ++k) {
    const std::size_t j = k % t.dof;
    const double before = out.most();
    int order = 1;
    for (auto [share, limit] :
         {std::pair{&out.velocity, t.velocity[j]}, std::pair{&out.acceleration, t.acceleration[j]},
          std::pair{&out.jerk, t.jerk[j]}}) {
      if (std::isfinite(limit)) {
        const Range r = range(s.pieces[k], order, s.step[k / t.dof]);
        *share = std::max(*share, std::max(-r.least, r.most) / limit);
      }
      ++order;
    }
    if (out.most() > before) out.joint = j, out.piece = k / t.dof;
  }
  return out;
}

/// Times found by search: the spline of given relative steps, slowed down as little as the limits
/// ask for; then one step after the other longer or shorter, as long as the whole gets faster.
class TimeSearch {
 public:
  TimeSearch(const Task& task, bool is_quintic, EndRule rule, const Clamps& clamps)
      : t_(task), is_quintic_(is_quintic), rule_(rule), clamps_(clamps) {
    const auto is_zero = [](double x) { return x == 0; };
    for (const auto* c : {&clamps.v0, &clamps.v1, &clamps.a0, &clamps.a1})
      is_resting_ = is_resting_ && std::all_of(c->begin(), c->end(), is_zero);
  }

  /// Steps, empty when no stretch of time keeps the limits.
  [[nodiscard]] std::vector<double> run() const {
    const std::size_t n = t_.count - 1;
    std::vector<double> step(n);
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t j = 0; j < t_.dof; ++j) {
        const double way = std::fabs(t_.at(i + 1, j) - t_.at(i, j));
        step[i] = std::max({step[i], way / t_.velocity[j], std::sqrt(way / t_.acceleration[j]),
                            std::cbrt(way / t_.jerk[j])});
      }
    }
    if (!fit(step)) return {};
    if (n == 1) return step;
    double best = total(step);
    std::size_t left = is_resting_ ? kMostTrials : kMostTrials / 10;  // each is dearer
    for (double change = 0.4; change > kLeastChange && left > 0;) {
      bool is_better = false;
      for (std::size_t i = 0; i < n && left > 0; ++i)
        for (const double factor : {1 / (1 + change), 1 + change}) {
          std::vector<double> trial = step;
          trial[i] *= factor;
          --left;
          if (!fit(trial) || !(total(trial) < best * (1 - 1e-9))) {
            if (left == 0) break;
            continue;
          }
          step = std::move(trial);
          best = total(step);
          is_better = true;
          break;
        }
      if (!is_better) change /= 2;
    }
    return step;
  }

 private:
  static constexpr std::size_t kMostTrials = 3000;
  static constexpr double kLeastChange = 1e-4;
  static double total(const std::vector<double>& step) {
    return std::accumulate(step.begin(), step.end(), 0.0);
  }
  [[nodiscard]] Use use(const std::vector<double>& step, double factor) const {
    std::vector<double> h = step;
    for (double& x : h) x *= factor;
    return use_of(through(t_, h, is_quintic_, rule_, clamps_), t_);
  }
  /// Scales all steps so that the limits are just kept.
  [[nodiscard]] bool fit(std::vector<double>& step) const {
    double factor = 1;
    if (is_resting_) {
      factor = use(step, 1).stretch();
    } else {
      // Given rates do not scale along: the least factor that keeps the limits, from below.
      factor = 0.25;
      while (use(step, factor).most() > 1 && factor < 1e4) factor *= 1.1;
      if (!(factor < 1e4)) return false;
      double low = factor / 1.1;
      for (int i = 0; i < 40; ++i) {
        const double middle = (low + factor) / 2;
        (use(step, middle).most() > 1 ? low : factor) = middle;
      }
    }
    if (!(factor > 0) || !std::isfinite(factor)) return false;
    for (double& h : step) h *= factor;
    return true;
  }

  const Task& t_;
  bool is_quintic_;
  EndRule rule_;
  const Clamps& clamps_;
  bool is_resting_ = true;
};

Result<std::vector<double>> steps_of(std::span<const double> times, std::size_t count) {
  if (times.size() != count)
    return bad(std::to_string(times.size()) + " times are given for " + std::to_string(count) +
                   " joint vectors",
               "Give one per vector.");
  std::vector<double> out;
  for (std::size_t i = 1; i < count; ++i) {
    if (!(times[i] > times[i - 1]))
      return bad("the time of joint vector " + std::to_string(i + 1) + " is " +
                     print_number(times[i]) + " s, not after " + print_number(times[i - 1]) + " s",
                 "Times must increase.");
    out.push_back(times[i] - times[i - 1]);
  }
  return out;
}

/// What a rule wants of the joint vectors.
Result<void> check_vectors(const Task& t, bool is_quintic, EndRule rule) {
  const std::size_t least = rule == EndRule::not_a_knot ? (is_quintic ? 6 : 4)
                            : rule == EndRule::periodic ? 3
                                                        : 2;
  if (t.count < least)
    return bad("ends = \"" + std::string(rule == EndRule::periodic ? "periodic" : "not_a_knot") +
                   "\" needs " + std::to_string(least) + " joint vectors of a " +
                   (is_quintic ? "quintic" : "cubic") + " spline, but there are " +
                   std::to_string(t.count),
               "Add joint vectors, or choose other ends.");
  if (rule != EndRule::periodic) return {};
  for (std::size_t j = 0; j < t.dof; ++j) {
    const double open = std::fabs(t.at(t.count - 1, j) - t.at(0, j));
    if (open > kSameValue * (1 + std::fabs(t.at(0, j))))
      return bad("ends = \"periodic\" closes the spline, and " + joint_name(j) + " ends " +
                     print_number(open, 6) + " away from its start",
                 "Add the first joint vector once more at the end.");
  }
  return {};
}

}  // namespace

Result<std::unique_ptr<JointSegment>> SplineFactory::make(std::size_t dof,
                                                          std::span<const double> points,
                                                          const JointLimits& limits,
                                                          const JointEnds& ends,
                                                          const Params& params) const {
  RMP_TRY_ASSIGN(const Task task, read_task(dof, points, limits, params, 2));
  // At given times the joints may stand still for a while.
  if (params.reals("times").empty()) RMP_TRY(check_apart(task));
  const bool is_quintic = params.text("degree") == "5";
  const std::string_view ends_word = params.text("ends");
  const EndRule rule = ends_word == "natural"      ? EndRule::natural
                       : ends_word == "not_a_knot" ? EndRule::not_a_knot
                       : ends_word == "periodic"   ? EndRule::periodic
                                                   : EndRule::clamped;
  RMP_TRY(check_vectors(task, is_quintic, rule));
  Clamps clamps;
  RMP_TRY_ASSIGN(clamps.v0, end_values(ends.start_velocity, task, "velocity at the start"));
  RMP_TRY_ASSIGN(clamps.v1, end_values(end_or(ends.end_velocity, params, "end_velocity"), task,
                                       "velocity at the end"));
  RMP_TRY_ASSIGN(clamps.a0, end_values(ends.start_acceleration, task, "acceleration at the start"));
  RMP_TRY_ASSIGN(clamps.a1, end_values(end_or(ends.end_acceleration, params, "end_acceleration"),
                                       task, "acceleration at the end"));
  for (std::size_t j = 0; j < dof; ++j) {
    if (rule != EndRule::clamped &&
        (clamps.v0[j] != 0 || clamps.v1[j] != 0 || clamps.a0[j] != 0 || clamps.a1[j] != 0))
      return bad("ends = \"" + std::string(ends_word) + "\" determines the rates there, but " +
                     joint_name(j) + " has one",
                 "Use ends = \"clamped\", or leave the rate out.");
    if (!is_quintic && (clamps.a0[j] != 0 || clamps.a1[j] != 0))
      return bad("a cubic spline cannot begin or end with a given acceleration, but " +
                     joint_name(j) + " has one",
                 "Take degree 5.");
    for (const double v : {clamps.v0[j], clamps.v1[j]})
      if (std::fabs(v) > task.velocity[j] * (1 + 1e-12))
        return bad("the velocity of " + joint_name(j) + " at an end is " + print_number(v, 6) +
                       ", above its limit " + print_number(task.velocity[j], 6),
                   "Lower it.");
  }
  const auto times = params.reals("times");
  std::vector<double> step;
  if (!times.empty()) {
    RMP_TRY_ASSIGN(step, steps_of(times, task.count));
  } else {
    for (std::size_t j = 0; j < dof; ++j)
      if (!std::isfinite(task.acceleration[j]))
        RMP_TRY(need(task.velocity, "velocity", j, "velocity"));
    step = TimeSearch(task, is_quintic, rule, clamps).run();
    if (step.empty())
      return bad("the limits cannot be met with these rates at the ends",
                 "Lower the rates, or raise the limits.");
  }
  Spline spline = through(task, step, is_quintic, rule, clamps);
  for (const Piece& p : spline.pieces)
    for (const double c : p)
      if (!std::isfinite(c))
        return bad("the spline through these joint vectors is not finite", "Check the times.");
  const Use use = use_of(spline, task);
  if (use.most() > 1 + 1e-9) {
    const char* what = use.most() == use.velocity       ? "velocity"
                       : use.most() == use.acceleration ? "acceleration"
                                                        : "jerk";
    return bad(
        "between joint vectors " + std::to_string(use.piece + 1) + " and " +
            std::to_string(use.piece + 2) + " " + joint_name(use.joint) + " needs " +
            print_number(100 * use.most(), 5) + " % of its " + what + " limit",
        "Give " + print_number(use.stretch(), 4) + " times as much time, or leave the times out.");
  }
  for (std::size_t k = 0; k < spline.pieces.size(); ++k)
    RMP_TRY(check_range(spline.pieces[k], step[k / dof], task, k % dof, k / dof));
  const double duration = std::accumulate(step.begin(), step.end(), 0.0);
  return std::unique_ptr<JointSegment>(new JointSpline(dof, duration, std::move(spline)));
}

}  // namespace robomosp::joint_motion
