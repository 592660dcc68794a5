// SPDX-License-Identifier: Apache-2.0
// Retimer "reachability": time-optimal along a path by reachability analysis (layer: plugin).
//
// H. Pham, Q.-C. Pham, A new approach to time-optimal path parameterization based on reachability
// analysis, IEEE Transactions on Robotics 34(3), 2018: backwards, the squared rates from which the
// end can be reached; forwards, always the greatest. With constraints at both ends of every step.
#include <algorithm>
#include <cmath>
#include <optional>
#include <string>

#include <robomosp/sdk/plugin.h>
#include <robomosp/sdk/retimer.h>

#include "spatial/print.h"
#include "stages.h"

namespace robomosp::retime_reachability {
namespace {

using spatial::print_number;

Error bad(std::string message, std::string hint) {
  return error(ErrorCode::invalid_argument, std::move(message), std::move(hint));
}

std::string percent_of(const RetimeProblem& p, std::size_t i) {
  return print_number(std::round(1000 * (p.s[i] - p.s[0]) / (p.s.back() - p.s[0])) / 10) + " %";
}

Result<void> check(const RetimeProblem& p) {
  const std::size_t count = p.s.size(), entries = count * p.dof;
  if (count < 2 || p.dof == 0)
    return bad("the path has no length", "Give two grid points or more.");
  if (p.q1.size() != entries || p.q2.size() != entries || p.velocity.size() != p.dof ||
      p.acceleration.size() != p.dof || (!p.rate.empty() && p.rate.size() != count))
    return bad("the tables of the path do not match its grid", "Report it to the caller's author.");
  for (const auto& table : {p.torque_a, p.torque_b, p.torque_c})
    if (table.size() != (p.torque_a.empty() ? 0 : entries) ||
        (!p.torque_a.empty() && p.torque.size() != p.dof))
      return bad("the torque tables do not match the path", "Report it to the caller's author.");
  for (std::size_t i = 1; i < count; ++i)
    if (!(p.s[i] > p.s[i - 1]))
      return bad("grid point " + std::to_string(i + 1) + " does not lie after the previous one",
                 "Grid values must increase.");
  for (const auto& table : {p.q1, p.q2, p.torque_a, p.torque_b, p.torque_c})
    for (std::size_t k = 0; k < table.size(); ++k)
      if (!std::isfinite(table[k]))
        return bad("the path is not finite at " + percent_of(p, k / p.dof) + " of its length",
                   "Check the curve there.");
  for (std::size_t j = 0; j < p.dof; ++j) {
    if (!(p.velocity[j] > 0) || !(p.acceleration[j] > 0))
      return bad("joint " + std::to_string(j + 1) + " has a limit that is not above 0",
                 "Give its velocity and acceleration limits, or none.");
    if (!p.torque_a.empty() && !(p.torque[j] > 0))
      return bad("the torque limit of joint " + std::to_string(j + 1) + " is not above 0",
                 "Give it, or none.");
  }
  if (!(p.start_rate >= 0) || !(p.end_rate >= 0))
    return bad("the rate at an end is below 0", "Paths are run forwards.");
  return {};
}

/// The first joint that cannot hold its own weight at a grid point.
std::optional<Error> too_heavy(const RetimeProblem& p, std::size_t i) {
  for (std::size_t j = 0; j < p.dof && !p.torque_a.empty(); ++j) {
    const double need = std::fabs(p.torque_c[i * p.dof + j]);
    if (need > p.torque[j])
      return bad("at " + percent_of(p, i) + " of the path joint " + std::to_string(j + 1) +
                     " needs " + print_number(need) + " to hold still, " +
                     print_number(need - p.torque[j]) + " above its limit",
                 "Raise its torque limit, lighten the load, or use another path.");
  }
  return {};
}

/// Why nothing is possible at a grid point.
Error stuck(const RetimeProblem& p, std::size_t i) {
  if (auto heavy = too_heavy(p, i)) return *std::move(heavy);
  return bad(
      "at " + percent_of(p, i) + " of the path no speed meets all limits and still reaches the end",
      "Raise the limits, or make the path smoother there.");
}

class Reachability final : public Retimer {
 public:
  Result<Retiming> retime(const RetimeProblem& p, const Params&,
                          Progress& progress) const override {
    RMP_TRY(check(p));
    const Stages stages(p);
    const std::size_t count = stages.count(), last = count - 1;
    // Backwards: the x from which the end can be reached.
    std::vector<Interval> reach(count);
    const double end = p.end_rate * p.end_rate;
    if (end > stages.most(last) * (1 + 1e-9))
      return bad("the rate at the end is " + print_number(p.end_rate) + ", above the maximum " +
                     print_number(std::sqrt(std::max(0.0, stages.most(last)))),
                 "Lower it.");
    reach[last] = {end, end};
    for (std::size_t i = last; i-- > 0;) {
      if ((i & 1023U) == 0 && progress.cancelled())
        return error(ErrorCode::cancelled, "re-timing was cancelled");
      const double greatest = stages.greatest(i, reach[i + 1]);
      if (greatest < 0) return stuck(p, i);
      reach[i] = {stages.least(i, reach[i + 1]), greatest};
      if (reach[i].low < 0) reach[i].low = greatest;
    }
    // Forwards: as fast as can be.
    Retiming out;
    out.rate.resize(count);
    out.time.resize(count);
    double x = p.start_rate * p.start_rate;
    if (x > reach[0].high * (1 + 1e-9) || x < reach[0].low * (1 - 1e-9) - 1e-12) {
      if (auto heavy = too_heavy(p, 0)) return *std::move(heavy);
      return bad("the rate at the start is " + print_number(p.start_rate) + ", and only " +
                     print_number(std::sqrt(reach[0].low)) + " to " +
                     print_number(std::sqrt(reach[0].high)) + " is possible within the limits",
                 "Change it.");
    }
    x = std::clamp(x, reach[0].low, reach[0].high);
    out.rate[0] = std::sqrt(x);
    for (std::size_t i = 0; i < last; ++i) {
      const double h = 2 * stages.step(i);
      const double to =
          std::clamp(x + h * stages.changes(i, x).high, reach[i + 1].low, reach[i + 1].high);
      out.rate[i + 1] = std::sqrt(to);
      const double sum = out.rate[i] + out.rate[i + 1];
      if (!(sum > 0)) return stuck(p, i);
      out.time[i + 1] = out.time[i] + h / sum;
      x = to;
    }
    return out;
  }
};

}  // namespace
}  // namespace robomosp::retime_reachability

RMP_PLUGIN("org.robomosp.retime_reachability", "0.1.0", "Apache-2.0",
           "Time-optimal re-timing of joint paths.",
           RMP_PROVIDER_NO_PARAMS(robomosp::retime_reachability::Reachability, "reachability",
                                  "Fastest motion along a path within velocity, acceleration and "
                                  "torque limits, by reachability analysis.",
                                  "velocity,acceleration,torque"))
