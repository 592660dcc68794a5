// SPDX-License-Identifier: Apache-2.0
#include "spatial/ode_run.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "spatial/print.h"

namespace robomosp::spatial {
namespace {

std::string number(double value) { return print_number(value, 6); }

/// Events closer together than this part of the run, this often in a row, pile up.
constexpr double kSameTime = 1e-12;
constexpr int kMostEventsAtOnce = 200;
/// Looks at 1e-6, 1e-4 and 1e-2 of the first step after an event.
constexpr int kEarlyLooks = 3;
constexpr std::int64_t kStepsPerCheck = 64;
constexpr double kEps = std::numeric_limits<double>::epsilon();

int sign(double v) { return v > 0 ? 1 : v < 0 ? -1 : 0; }

/// Zeros of the event functions along the steps. A function is armed when its sign is known; after
/// its event it is armed again once it has left zero.
class EventWatch {
 public:
  explicit EventWatch(OdeSystem& system)
      : system_(system), signs_(system.events()), values_(signs_.size()), fired_(signs_.size()) {}

  [[nodiscard]] bool empty() const { return signs_.empty(); }
  void arm(double t, std::span<const double> x) {
    if (empty()) return;
    system_.event_values(t, x, values_);
    for (std::size_t i = 0; i < signs_.size(); ++i) signs_[i] = fired_[i] ? 0 : sign(values_[i]);
    std::fill(fired_.begin(), fired_.end(), false);
  }
  /// The first time in the stepper's last step, begun at `start`, at which a function has left its
  /// sign; NaN without one. `x` is then the state there.
  Result<double> find(Stepper& stepper, double start, std::vector<double>& x) {
    const double end = stepper.time();
    const int looks = stepper.looks_for_events();
    // Right after an event its function has no sign yet; it is looked at early, or it could leave
    // zero and be back before the first look.
    const bool is_unsure = std::find(signs_.begin(), signs_.end(), 0) != signs_.end();
    double low = start;
    for (int k = is_unsure ? -kEarlyLooks + 1 : 1; k <= looks; ++k) {
      const double part = k > 0 ? static_cast<double>(k) / looks : std::pow(100.0, k - 1);
      const double t = k == looks ? end : start + (end - start) * part;
      if (!(t > low)) continue;
      RMP_TRY(evaluate(stepper, t, end, x));
      if (crossed()) return locate(stepper, low, t, end, x);
      for (std::size_t i = 0; i < signs_.size(); ++i)
        if (signs_[i] == 0) signs_[i] = sign(values_[i]);
      low = t;
    }
    return std::numeric_limits<double>::quiet_NaN();
  }
  /// Tells the system of every event at the state that find() left; false = end there.
  bool fire(double t, std::span<double> x, OdeStatistics& statistics) {
    for (std::size_t i = 0; i < signs_.size(); ++i)
      fired_[i] = signs_[i] != 0 && sign(values_[i]) != signs_[i];
    bool go_on = true;
    for (std::size_t i = 0; i < signs_.size(); ++i) {
      if (!fired_[i]) continue;
      ++statistics.events;
      go_on = system_.at_event(t, i, x) && go_on;
    }
    return go_on;
  }

 private:
  Result<void> evaluate(Stepper& stepper, double t, double end, std::vector<double>& x) {
    if (t == end) x.assign(stepper.state().begin(), stepper.state().end());
    else RMP_TRY(stepper.between(t, x));
    system_.event_values(t, x, values_);
    return {};
  }
  [[nodiscard]] bool crossed() const { return margin() <= 0; }
  /// Least value of the armed functions, counted from their known sign: above 0 up to an event.
  [[nodiscard]] double margin() const {
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < signs_.size(); ++i)
      if (signs_[i] != 0) least = std::min(least, signs_[i] * values_[i]);
    return least;
  }
  /// Narrows the bracket by false position and halving in turn; ends on the far side of the zero.
  Result<double> locate(Stepper& stepper, double low, double high, double end,
                        std::vector<double>& x) {
    double at_high = margin();
    RMP_TRY(low < high ? evaluate(stepper, low, end, x) : Result<void>());
    double at_low = std::max(margin(), 0.0);
    const double width = 4 * kEps * std::max({std::fabs(low), std::fabs(high), high - low});
    bool halve = false;
    while (high - low > width) {
      double t = low + (high - low) / 2;
      if (!halve && std::isfinite(at_low) && at_low - at_high > 0) {
        t = low + (high - low) * at_low / (at_low - at_high);
        // Not onto an end: a hair beyond the guess closes the bracket on both sides.
        t = std::clamp(t, low + width / 2, high - width / 2);
      }
      halve = !halve;
      if (!(t > low && t < high)) break;
      RMP_TRY(evaluate(stepper, t, end, x));
      const double value = margin();
      if (value > 0) low = t, at_low = value;
      else high = t, at_high = value;
    }
    RMP_TRY(evaluate(stepper, high, end, x));
    return high;
  }

  OdeSystem& system_;
  std::vector<int> signs_;
  std::vector<double> values_;
  std::vector<bool> fired_;
};

/// Gives the samples that were asked for, each projected.
class Samples {
 public:
  Samples(OdeSystem& system, std::span<const double> times, OdeSink& sink)
      : system_(system), times_(times), sink_(sink) {}
  /// Those up to `limit`; false = the sink has had enough.
  Result<bool> up_to(double limit, Stepper& stepper, double step_start, std::vector<double>& x) {
    for (; next_ < times_.size() && times_[next_] <= limit; ++next_) {
      const double t = times_[next_];
      if (t <= step_start) continue;
      if (t == stepper.time()) x.assign(stepper.state().begin(), stepper.state().end());
      else RMP_TRY(stepper.between(t, x));
      system_.project(x);
      if (!sink_.sample(t, x)) return false;
    }
    return true;
  }
  bool at_start(double t, std::span<const double> x) {
    for (; next_ < times_.size() && times_[next_] <= t; ++next_)
      if (!sink_.sample(t, x)) return false;
    return true;
  }

 private:
  OdeSystem& system_;
  std::span<const double> times_;
  OdeSink& sink_;
  std::size_t next_ = 0;
};

Error piled_up(double t) {
  return error(ErrorCode::invalid_argument, "events follow each other without time between them",
               "Let the rebounding body come to rest, or give it more restitution.", at_time(t));
}

}  // namespace

std::string at_time(double t) { return "t = " + number(t) + " s"; }
Error rate_not_finite(double t) {
  return error(ErrorCode::invalid_argument,
               "the rate of the state is not finite, so the motion cannot continue",
               "Check forces, masses and the state at that time.", at_time(t));
}

Result<bool> Rates::operator()(double t, std::span<const double> x, std::span<double> dx) {
  ++statistics_.rates;
  auto done = system_.rate(t, x, dx);
  if (!done.ok()) return std::move(done).error();
  double sum = 0;  // 0 * v is NaN for infinities and NaN, else 0
  for (const double v : dx) sum += 0 * v;
  return sum == 0;
}

Result<void> check_run(const OdeSystem& system, const OdeRun& run) {
  const auto wrong = [](std::string what, std::string hint) {
    return error(ErrorCode::invalid_argument, std::move(what), std::move(hint));
  };
  if (run.x0.size() != system.size() || system.positions() > system.size())
    return wrong("the initial state has " + std::to_string(run.x0.size()) +
                     " numbers for a system of " + std::to_string(system.size()),
                 "Give one number for each state variable.");
  for (const double v : run.x0)
    if (!std::isfinite(v))
      return wrong("the initial state is not finite", "Check positions and velocities.");
  if (!std::isfinite(run.start) || !std::isfinite(run.end) || run.end < run.start)
    return wrong("the run ends at " + number(run.end) + " s, before its start at " +
                     number(run.start) + " s",
                 "Give an end after the start.");
  if (!(run.step > 0) || !std::isfinite(run.step))
    return wrong("the step is " + number(run.step) + " s", "Give a step above 0.");
  if (!(run.relative_tolerance >= 0) || !(run.absolute_tolerance >= 0) ||
      !(run.relative_tolerance + run.absolute_tolerance > 0))
    return wrong("the tolerances are " + number(run.relative_tolerance) + " (relative) and " +
                     number(run.absolute_tolerance) + " (absolute)",
                 "Give tolerances above 0, such as 1e-10 and 1e-12.");
  for (std::size_t i = 0; i < run.sample_times.size(); ++i)
    if (!(run.sample_times[i] >= run.start && run.sample_times[i] <= run.end) ||
        (i > 0 && run.sample_times[i] < run.sample_times[i - 1]))
      return wrong("the sample times do not increase from " + number(run.start) + " s to " +
                       number(run.end) + " s",
                   "Give them in order and within the run.");
  return {};
}

Result<OdeStatistics> integrate(Rates& rates, Stepper& stepper, const OdeRun& run, OdeSink& sink,
                                Progress& progress) {
  OdeSystem& system = rates.system();
  OdeStatistics& statistics = rates.statistics();
  std::vector<double> x(run.x0.begin(), run.x0.end()), trial(x.size());
  EventWatch watch(system);
  Samples samples(system, run.sample_times, sink);
  double t = run.start, last_event = -std::numeric_limits<double>::infinity();
  int at_once = 0;
  system.project(x);
  statistics.end = t;
  if (!samples.at_start(t, x) || run.end == run.start) return statistics;
  RMP_TRY(stepper.restart(t, x));
  watch.arm(t, x);
  for (std::int64_t count = 0; t < run.end; ++count) {
    if (count % kStepsPerCheck == 0) {
      if (progress.cancelled())
        return error(ErrorCode::cancelled, "the integration was cancelled", {}, at_time(t));
      progress.report((t - run.start) / (run.end - run.start), "motion");
    }
    RMP_TRY(stepper.step(run.end));
    ++statistics.steps;
    double found = std::numeric_limits<double>::quiet_NaN();
    if (!watch.empty()) {
      RMP_TRY_ASSIGN(found, watch.find(stepper, t, x));
    }
    if (std::isnan(found)) {
      RMP_TRY_ASSIGN(const bool go_on, samples.up_to(stepper.time(), stepper, t, trial));
      statistics.end = t = stepper.time();
      if (!go_on) return statistics;
      x.assign(stepper.state().begin(), stepper.state().end());
      system.project(x);
      if (!std::equal(x.begin(), x.end(), stepper.state().begin())) RMP_TRY(stepper.restart(t, x));
      continue;
    }
    RMP_TRY_ASSIGN(const bool go_on, samples.up_to(found, stepper, t, trial));
    at_once = found - last_event <= kSameTime * (run.end - run.start) ? at_once + 1 : 0;
    if (at_once > kMostEventsAtOnce) return piled_up(found);
    statistics.end = t = last_event = found;
    if (!go_on) return statistics;
    system.project(x);
    if (!sink.sample(t, x)) return statistics;
    const bool goes_on = watch.fire(t, x, statistics);
    system.project(x);
    if (!sink.sample(t, x) || !goes_on) return statistics;
    if (t >= run.end) break;
    RMP_TRY(stepper.restart(t, x));
    watch.arm(t, x);
  }
  return statistics;
}

}  // namespace robomosp::spatial
