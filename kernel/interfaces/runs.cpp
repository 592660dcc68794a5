// SPDX-License-Identifier: Apache-2.0
// Guards of integrators and retimers: times that rise, numbers that are finite.
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
  CheckedSink(const std::string& provider, OdeSink& to) : provider_(provider), to_(to) {}
  bool sample(double t, std::span<const double> x) override {
    if (!std::isfinite(t) || (has_time_ && t < time_)) {
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
  bool has_time_ = false;
  double time_ = 0;
};

class GuardedIntegrator final : public Integrator {
 public:
  GuardedIntegrator(const ProviderInfo& info, Integrator* inner)
      : name_(info.name), inner_(inner) {}
  [[nodiscard]] const void* extension(const char* id) const override {
    return inner_->extension(id);
  }
  Result<void> prepare(const Params& params) override {
    return guarded(name_, [&] { return inner_->prepare(params); });
  }
  Result<OdeStatistics> run(OdeSystem& system, const OdeRun& run, OdeSink& sink,
                            Progress& progress) const override {
    CheckedSink checked(name_, sink);
    auto done = guarded(name_, [&] { return inner_->run(system, run, checked, progress); });
    if (checked.fault) return std::move(*checked.fault);
    if (done.ok() && !std::isfinite(done->end))
      return broken_answer(name_, "ended its run at a time that is not a number");
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
                          Progress& progress) const override {
    auto timed = guarded(name_, [&] { return inner_->retime(problem, params, progress); });
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
