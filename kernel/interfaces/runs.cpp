// SPDX-License-Identifier: Apache-2.0
// Guards of integrators and retimers: times that rise, numbers that are finite.
#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <string>

#include <robomosp/sdk/integrator.h>
#include <robomosp/sdk/retimer.h>

#include "kernel/interface_file.h"
#include "kernel/provider_guard.h"
#include "kernel/text.h"

namespace robomosp {
namespace {

/// Looks at every sample before it goes on.
class CheckedSink final : public OdeSink {
 public:
  CheckedSink(const std::string& provider, OdeSink& to, const OdeRun& run)
      : provider_(provider), to_(to), size_(run.x0.size()), start_(run.start), end_(run.end) {}
  [[nodiscard]] const void* extension(const char* id) const override { return to_.extension(id); }
  bool sample(double t, std::span<const double> x) override {
    if (fault) return false;
    if (x.size() != size_) {
      fault = broken_answer(provider_, "handed over a state of " + std::to_string(x.size()) +
                                           " numbers where there are " + std::to_string(size_));
      return false;
    }
    const double slack = 1e-9 * (1 + std::fabs(start_) + std::fabs(end_));
    const bool is_within = t >= start_ - slack && t <= end_ + slack;  // not of NaN
    if (!is_within || (has_time_ && t < time_)) {
      fault = broken_answer(provider_, "handed over a sample at t = " + text::print_rounded(t) +
                                           " s, out of the order of time");
      return false;
    }
    for (const double v : x)
      if (!std::isfinite(v)) {
        fault = broken_answer(provider_, "handed over a state that is not a number at t = " +
                                             text::print_rounded(t) + " s");
        return false;
      }
    has_time_ = true;
    time_ = t;
    return to_.sample(t, x);
  }
  std::optional<Error> fault;

 private:
  const std::string& provider_;
  OdeSink& to_;
  std::size_t size_;
  double start_, end_;
  bool has_time_ = false;
  double time_ = 0;
};

/// Looks at every question before it is answered.
class CheckedSystem final : public OdeSystem {
 public:
  CheckedSystem(const std::string& provider, OdeSystem& to)
      : provider_(provider), to_(to), size_(to.size()), events_(to.events()) {}
  [[nodiscard]] const void* extension(const char* id) const override { return to_.extension(id); }
  [[nodiscard]] std::size_t size() const override { return size_; }
  [[nodiscard]] std::size_t positions() const override { return to_.positions(); }
  Result<void> rate(double t, std::span<const double> x, std::span<double> dx) override {
    if (!fits(x.size(), dx.size(), size_)) return *fault;
    return to_.rate(t, x, dx);
  }
  void project(std::span<double> x) override {
    if (fits(x.size(), size_, size_)) to_.project(x);
  }
  [[nodiscard]] std::size_t events() const override { return events_; }
  void event_values(double t, std::span<const double> x, std::span<double> g) override {
    if (fits(x.size(), size_, size_) && fits(g.size(), events_, events_)) to_.event_values(t, x, g);
  }
  bool at_event(double t, std::size_t index, std::span<double> x) override {
    if (!fits(x.size(), size_, size_)) return false;
    if (index < events_) return to_.at_event(t, index, x);
    if (!fault) fault = broken_answer(provider_, "reported an event that does not exist");
    return false;
  }
  std::optional<Error> fault;

 private:
  bool fits(std::size_t a, std::size_t b, std::size_t wanted) {
    if (a == wanted && b == wanted) return true;
    if (!fault)
      fault = broken_answer(provider_, "called back with " + std::to_string(a == wanted ? b : a) +
                                           " numbers where there are " + std::to_string(wanted));
    return false;
  }
  const std::string& provider_;
  OdeSystem& to_;
  std::size_t size_, events_;
};

class GuardedIntegrator final : public Integrator {
 public:
  GuardedIntegrator(const ProviderInfo& info, Integrator* inner)
      : name_(info.name), inner_(inner) {}
  [[nodiscard]] const void* extension(const char* id) const override {
    return inner_->extension(id);
  }
  Result<void> prepare(const Params& params) override {
    return asked(name_, [&] { return inner_->prepare(params); });
  }
  Result<OdeStatistics> run(OdeSystem& system, const OdeRun& run, OdeSink& sink,
                            Progress& told) const override {
    CheckedSink checked(name_, sink, run);
    CheckedSystem looked_at(name_, system);
    HeardProgress progress(told);
    auto done = asked(name_, [&] { return inner_->run(looked_at, run, checked, progress); });
    if (looked_at.fault) return std::move(*looked_at.fault);
    if (checked.fault) return std::move(*checked.fault);
    if (done.ok() && !std::isfinite(done->end))
      return broken_answer(name_, "ended its run at a time that is not a number");
    if (done.ok() && std::min({done->steps, done->rejected, done->rates, done->events}) < 0)
      return broken_answer(name_, "counted a negative number of steps");
    return done;
  }

 private:
  std::string name_;
  std::unique_ptr<Integrator> inner_;
};

class GuardedRetimer final : public Retimer {
 public:
  GuardedRetimer(const ProviderInfo& info, Retimer* inner) : name_(info.name), inner_(inner) {}
  [[nodiscard]] const void* extension(const char* id) const override {
    return inner_->extension(id);
  }
  Result<Retiming> retime(const RetimeProblem& problem, const Params& params,
                          Progress& told) const override {
    HeardProgress progress(told);
    auto timed = asked(name_, [&] { return inner_->retime(problem, params, progress); });
    if (!timed.ok()) return timed;
    const std::size_t n = problem.s.size();
    if (timed->time.size() != n || timed->rate.size() != n)
      return broken_answer(name_, "gave times that do not fit the path");
    for (std::size_t i = 0; i < n; ++i) {
      const double t = timed->time[i], rate = timed->rate[i];
      if (!std::isfinite(t) || !std::isfinite(rate))
        return broken_answer(
            name_, "gave a time that is not a number at grid point " + std::to_string(i + 1));
      if (rate < 0 || (i > 0 && t < timed->time[i - 1]))
        return broken_answer(
            name_, "gave times that run backwards at grid point " + std::to_string(i + 1));
    }
    return timed;
  }

 private:
  std::string name_;
  std::unique_ptr<Retimer> inner_;
};

}  // namespace

RMP_INTERFACES(runs, guarded_interface<Integrator, GuardedIntegrator>("dormand_prince"),
               guarded_interface<Retimer, GuardedRetimer>("reachability"));

}  // namespace robomosp
