// SPDX-License-Identifier: Apache-2.0
// Point to point from rest to rest: all joints together on a straight way of the joint space, or
// each as fast as it can (layer: plugin).
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "spatial/quintic.h"
#include "task.h"

namespace robomosp::joint_motion {
namespace {

using spatial::RampLimits;
using spatial::Ramps;

/// From 0 to 1 by ramps of speed or by 10 x^3 - 15 x^4 + 6 x^5.
struct Law {
  Ramps ramps;
  double quintic = 0;  ///< its duration; 0 = ramps [s]

  [[nodiscard]] double duration() const { return quintic > 0 ? quintic : ramps.duration(); }
  [[nodiscard]] Motion1 at(double t) const {
    if (!(quintic > 0)) return ramps.at(t);
    if (t >= quintic) return {1, 0, 0, 0};
    const double T = quintic, x = t / T;
    const spatial::Jet m = spatial::ease(x);
    return {m.v, m.d / T, m.dd / (T * T), spatial::ease_jerk(x) / (T * T * T)};
  }
};

enum class Kind { trapezoidal, s_curve, quintic };

/// Greatest derivatives of the quintic in its share of time: 15/8, 10/sqrt(3), 60.
double quintic_time(const RampLimits& l) {
  return std::max({1.875 / l.v, std::sqrt(10 / std::sqrt(3.0) / l.a), std::cbrt(60 / l.j)});
}

/// The fastest law, or one of a longer duration.
Law law_of(Kind kind, RampLimits l, double duration) {
  Law out;
  if (kind == Kind::quintic) {
    out.quintic = std::max(duration, quintic_time(l));
    return out;
  }
  if (kind == Kind::trapezoidal) l.j = std::numeric_limits<double>::infinity();
  // No way of 1 is run faster than by the acceleration alone.
  l.v = std::min(l.v, 2 * std::sqrt(l.a));
  const auto timed = duration > 0 ? spatial::timed_ramps(1, 0, 0, l, duration) : std::nullopt;
  out.ramps = timed ? *timed : spatial::fastest_ramps(1, 0, 0, l).value_or(Ramps());
  return out;
}

/// The way between two neighbouring joint vectors.
struct Stretch {
  double from = 0;        ///< [s]
  std::vector<Law> laws;  ///< one for all, or one a joint
};

class Ptp final : public JointwiseSegment {
 public:
  Ptp(Task task, std::vector<Stretch> stretches, double duration)
      : JointwiseSegment(task.dof, duration),
        task_(std::move(task)),
        stretches_(std::move(stretches)) {}

 protected:
  [[nodiscard]] Motion1 at(std::size_t joint, double t) const override {
    std::size_t i = stretches_.size() - 1;
    while (i > 0 && t < stretches_[i].from) --i;
    const Stretch& s = stretches_[i];
    const double start = task_.at(i, joint), way = task_.at(i + 1, joint) - start;
    if (way == 0) return {start, 0, 0, 0};
    const Law& law = s.laws[s.laws.size() == 1 ? 0 : joint];
    const Motion1 m = law.at(t - s.from);
    // Backwards from the end in the second half: the end is met to the last bit.
    const double q = m.x < 0.5 ? start + way * m.x : task_.at(i + 1, joint) - way * (1 - m.x);
    return {q, way * m.v, way * m.a, way * m.j};
  }

 private:
  Task task_;
  std::vector<Stretch> stretches_;
};

}  // namespace

Result<std::unique_ptr<JointSegment>> PtpFactory::make(std::size_t dof,
                                                       std::span<const double> points,
                                                       const JointLimits& limits,
                                                       const JointEnds& ends,
                                                       const Params& params) const {
  RMP_TRY_ASSIGN(Task task, read_task(dof, points, limits, params, 2));
  RMP_TRY(check_apart(task));
  for (const auto& end :
       {ends.start_velocity, ends.end_velocity, ends.start_acceleration, ends.end_acceleration})
    for (std::size_t j = 0; j < end.size(); ++j)
      if (end[j] != 0)
        return bad("ptp moves from rest to rest, but " + joint_name(j) + " is moving at an end",
                   "Use time_optimal or joint_spline.");
  const auto profile = params.text("profile");
  const Kind kind = profile == "quintic"   ? Kind::quintic
                    : profile == "s_curve" ? Kind::s_curve
                                           : Kind::trapezoidal;
  const bool is_together = params.text("joints_arrive") != "each";
  const double wanted = params.real("duration");
  const auto stretches = [&](double factor) -> Result<std::vector<Stretch>> {
    std::vector<Stretch> out;
    double from = 0;
    for (std::size_t i = 0; i + 1 < task.count; ++i) {
      Stretch s{from, {}};
      constexpr double kNone = std::numeric_limits<double>::infinity();
      RampLimits all{kNone, kNone, kNone};
      for (std::size_t j = 0; j < dof; ++j) {
        const double way = std::fabs(task.at(i + 1, j) - task.at(i, j));
        if (!is_together) s.laws.emplace_back();
        if (!(way > 0)) continue;
        if (kind != Kind::quintic)
          RMP_TRY(need(task.acceleration, "acceleration", j, "acceleration"));
        if (kind == Kind::s_curve) RMP_TRY(need(task.jerk, "jerk", j, "jerk"));
        if (kind == Kind::quintic && !std::isfinite(task.acceleration[j]))
          RMP_TRY(need(task.velocity, "velocity", j, "velocity"));
        const RampLimits one{task.velocity[j] / way, task.acceleration[j] / way,
                             task.jerk[j] / way};
        all = {std::min(all.v, one.v), std::min(all.a, one.a), std::min(all.j, one.j)};
        if (!is_together) s.laws.back() = law_of(kind, one, 0);
      }
      if (is_together) {
        s.laws.push_back(law_of(kind, all, 0));
        if (factor > 1) s.laws[0] = law_of(kind, all, factor * s.laws[0].duration());
      }
      double longest = 0;
      for (const Law& l : s.laws) longest = std::max(longest, l.duration());
      from += longest;
      out.push_back(std::move(s));
    }
    out.push_back({from, {}});
    return out;
  };
  RMP_TRY_ASSIGN(auto made, stretches(1));
  const double least = made.back().from;
  if (wanted > 0) {
    if (!is_together)
      return bad("a duration is given, but each joint arrives by itself",
                 "Make the joints arrive together, or leave the duration out.");
    if (wanted < least * (1 - 1e-12))
      return bad("a duration of " + print_number(wanted) + " s is too short for the limits",
                 "The shortest is " + print_number(least, 6) + " s.");
    RMP_TRY_ASSIGN(made, stretches(wanted / least));
  }
  const double duration = made.back().from;
  made.pop_back();
  if (!(duration > 0) || !std::isfinite(duration))
    return bad("the limits give no finite duration", "Check them.");
  return std::unique_ptr<JointSegment>(new Ptp(std::move(task), std::move(made), duration));
}

}  // namespace robomosp::joint_motion
