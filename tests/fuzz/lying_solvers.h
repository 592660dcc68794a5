// SPDX-License-Identifier: Apache-2.0
// Providers that answer as those of the program do, but for the lies of Liar: what is bound to a
// robot, and what runs it.
#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <robomosp/sdk/controller.h>
#include <robomosp/sdk/dynamics.h>
#include <robomosp/sdk/ik.h>
#include <robomosp/sdk/integrator.h>
#include <robomosp/sdk/planner.h>
#include <robomosp/sdk/retimer.h>
#include <robomosp/sdk/robot_code.h>
#include <robomosp/sdk/tip_force.h>

#include "support/liar.h"

namespace robomosp::test {

inline Liar& liar() { return Liar::one(); }

/// A lie about one of many numbers.
inline Lie<Nothing> no_number_in(std::span<double> numbers) {
  return {"no number among many", Seen::surely,
          [numbers](Nothing&) { numbers[liar().pick(numbers.size())] = liar().no_number(); }};
}
inline Lie<Nothing> wild_in(std::span<double> numbers) {
  return {"a wild number among many", Seen::maybe,
          [numbers](Nothing&) { numbers[liar().pick(numbers.size())] = liar().wild(); }};
}
/// Numbers that the host left as they were when it asked.
inline Lie<Nothing> unfilled(std::span<double> numbers, const std::vector<double>& before) {
  return {"nothing filled in", Seen::maybe, [numbers, before](Nothing&) {
            std::copy(before.begin(), before.end(), numbers.begin());
          }};
}
inline std::vector<Lie<Nothing>> about_numbers(std::span<double> numbers) {
  if (numbers.empty()) return {};
  return {no_number_in(numbers), wild_in(numbers),
          unfilled(numbers, {numbers.begin(), numbers.end()})};
}
inline std::size_t size_of(const std::string& who, std::size_t honest) {
  return liar().value<std::size_t>(
      who, [&] { return honest; },
      {{"a wild size", Seen::surely, [](std::size_t& n) { n = liar().wild_size(); }}});
}

/// Base of providers that pass on what another one answers.
template <class I>
class Lying : public I {
 public:
  explicit Lying(std::shared_ptr<I> inner) : inner_(std::move(inner)) {}

 protected:
  std::shared_ptr<I> inner_;
};

class LyingIk final : public Lying<IkSolver> {
 public:
  using Lying::Lying;
  Result<void> prepare(const RobotModel& m, const Params& p) override {
    return liar().fill("ik.prepare", nullptr, [&] { return inner_->prepare(m, p); }, {});
  }
  Result<void> solve(const IkBatch& b, std::span<IkResult> r, Progress& p) const override {
    const auto one = [r](const char* what, Seen seen, std::function<void(IkResult&)> spoil) {
      return Lie<Nothing>{what, seen, [r, spoil](Nothing&) {
                            if (!r.empty()) spoil(r[liar().pick(r.size())]);
                          }};
    };
    return liar().fill(
        "ik.solve", &p, [&] { return inner_->solve(b, r, p); },
        {one("a status that is none", Seen::maybe,
             [](IkResult& x) { x.status = static_cast<IkStatus>(liar().pick(2) ? 77 : -1); }),
         one("solved without a configuration", Seen::surely,
             [](IkResult& x) {
               x.status = IkStatus::solved;
               x.q.clear();
             }),
         one("a configuration too short", Seen::surely,
             [](IkResult& x) {
               x.status = IkStatus::solved;
               x.q.assign(1, 0);
             }),
         one("a configuration too long", Seen::surely,
             [](IkResult& x) {
               x.status = IkStatus::solved;
               x.q.resize(x.q.size() + 1);
             }),
         one("a hundred thousand configurations", Seen::maybe,
             [](IkResult& x) {
               if (x.q.empty()) return;
               const std::vector<double> q = x.q;
               for (std::size_t i = 0; i < 100'000; ++i) x.q.push_back(q[i % q.size()]);
             }),
         one("no number", Seen::surely,
             [](IkResult& x) {
               x.status = IkStatus::solved;
               x.q.resize(std::max<std::size_t>(1, x.q.size()));
               x.q[liar().pick(x.q.size())] = liar().no_number();
             }),
         one("no solution said to be one", Seen::surely,
             [](IkResult& x) {
               if (x.q.empty()) x.q.resize(1);
               x.status = IkStatus::solved;
               for (double& q : x.q) q += 0.3;
             }),
         one("a wild joint value", Seen::maybe,
             [](IkResult& x) {
               if (!x.q.empty()) x.q[liar().pick(x.q.size())] = liar().wild();
             }),
         one("wild fields", Seen::maybe,
             [](IkResult& x) {
               x.status = IkStatus::out_of_reach;
               x.position_error = liar().no_number(), x.rotation_error = liar().wild();
               x.iterations = -5, x.limiting_joint = liar().pick(2) ? 2'000'000'000 : -7;
               x.detail = liar().wild_text(), x.shortfall = liar().no_number();
               x.lost_direction.fill(liar().no_number());
               if (liar().pick(2)) x.q.assign(x.q.size(), liar().no_number());
             }),
         {"nothing filled in", Seen::maybe, [r](Nothing&) {
            for (IkResult& x : r) x = {};
          }}});
  }
};

class LyingInverse final : public Lying<InverseDynamics> {
 public:
  using Lying::Lying;
  Result<void> prepare(const RobotModel& m, const Params& p) override {
    return liar().fill("inverse_dynamics.prepare", nullptr, [&] { return inner_->prepare(m, p); },
                       {});
  }
  std::size_t scratch_size() const override {
    return size_of("inverse_dynamics.scratch_size", inner_->scratch_size());
  }
  Result<void> torques(const DynamicsBatch& b, std::span<double> t, Progress& p) const override {
    return liar().fill(
        "torques", &p, [&] { return inner_->torques(b, t, p); }, about_numbers(t));
  }
  Result<void> inertia(const DynamicsBatch& b, std::span<double> m, Progress& p) const override {
    auto lies = about_numbers(m);
    lies.push_back({"a negative inertia", Seen::maybe, [m](Nothing&) {
                      for (double& x : m) x = -x;
                    }});
    return liar().fill(
        "inertia", &p, [&] { return inner_->inertia(b, m, p); }, std::move(lies));
  }
  Result<void> derivatives(const DynamicsBatch& b, std::span<double> by_q, std::span<double> by_qd,
                           Progress& p) const override {
    return liar().fill(
        "inverse_dynamics.derivatives", &p, [&] { return inner_->derivatives(b, by_q, by_qd, p); },
        about_numbers(liar().pick(2) ? by_q : by_qd));
  }
  Result<void> regressor(const DynamicsBatch& b, std::span<double> y, Progress& p) const override {
    return liar().fill(
        "regressor", &p, [&] { return inner_->regressor(b, y, p); }, about_numbers(y));
  }
  Result<void> energy(const DynamicsBatch& b, std::span<Energy> out, Progress& p) const override {
    return liar().fill("energy", &p, [&] { return inner_->energy(b, out, p); },
                       {{"no number", Seen::surely,
                         [out](Nothing&) {
                           if (out.empty()) return;
                           Energy& e = out[liar().pick(out.size())];
                           double* const all[] = {&e.kinetic, &e.potential, &e.momentum[1],
                                                  &e.angular_momentum[2], &e.com[0]};
                           *all[liar().pick(5)] = liar().no_number();
                         }},
                        {"a negative energy", Seen::maybe, [out](Nothing&) {
                           if (!out.empty()) out[0].kinetic = -5;
                         }}});
  }
};

class LyingForward final : public Lying<ForwardDynamics> {
 public:
  using Lying::Lying;
  Result<void> prepare(const RobotModel& m, const Params& p) override {
    return liar().fill("forward_dynamics.prepare", nullptr, [&] { return inner_->prepare(m, p); },
                       {});
  }
  std::size_t scratch_size() const override {
    return size_of("forward_dynamics.scratch_size", inner_->scratch_size());
  }
  Result<void> accelerations(const DynamicsBatch& b, std::span<double> qdd,
                             Progress& p) const override {
    return liar().fill(
        "accelerations", &p, [&] { return inner_->accelerations(b, qdd, p); }, about_numbers(qdd));
  }
  Result<void> constrained(const DynamicsBatch& b, std::span<double> qdd, std::span<double> f,
                           Progress& p) const override {
    return liar().fill(
        "constrained", &p, [&] { return inner_->constrained(b, qdd, f, p); },
        about_numbers(liar().pick(2) ? qdd : f));
  }
  Result<void> derivatives(const DynamicsBatch& b, std::span<double> by_q, std::span<double> by_qd,
                           std::span<double> by_tau, Progress& p) const override {
    const std::span<double> all[] = {by_q, by_qd, by_tau};
    return liar().fill(
        "forward_dynamics.derivatives", &p,
        [&] { return inner_->derivatives(b, by_q, by_qd, by_tau, p); },
        about_numbers(all[liar().pick(3)]));
  }
};

class LyingController final : public Lying<Controller> {
 public:
  using Lying::Lying;
  Result<void> prepare(const RobotModel& m, const InverseDynamics& d, const Params& p) override {
    return liar().fill("controller.prepare", nullptr, [&] { return inner_->prepare(m, d, p); }, {});
  }
  std::size_t state_size() const override {
    return size_of("controller.state_size", inner_->state_size());
  }
  std::size_t scratch_size() const override {
    return size_of("controller.scratch_size", inner_->scratch_size());
  }
  Result<void> torques(const ControlInput& in, std::span<double> state, std::span<double> scratch,
                       std::span<double> tau) const override {
    auto lies = about_numbers(tau);
    lies.push_back({"a state that is no number", Seen::maybe, [state](Nothing&) {
                      for (double& x : state) x = liar().no_number();
                    }});
    return liar().fill(
        "controller.torques", nullptr, [&] { return inner_->torques(in, state, scratch, tau); },
        std::move(lies));
  }
};

class LyingCode final : public Lying<RobotCodeGenerator> {
 public:
  using Lying::Lying;
  Result<std::vector<CodeFile>> generate(const RobotModel& m, std::string_view name,
                                         std::uint32_t parts, const Params& params,
                                         Progress& p) const override {
    using Files = std::vector<CodeFile>;
    return liar().answer<Files>(
        "robot_code.generate", &p, [&] { return inner_->generate(m, name, parts, params, p); },
        {{"no files", Seen::surely, [](Files& f) { f.clear(); }},
         {"a name that leads out", Seen::surely,
          [](Files& f) {
            const char* all[] = {"../out.c", "/lying.c", "", ".", "..", "a/b.c"};
            f[0].name = all[liar().pick(6)];
          }},
         {"a name that no file has", Seen::surely,
          [](Files& f) { f[0].name = liar().pick(2) ? std::string(5000, 'n') : "a\x1b\n\x07.c"; }},
         {"a name with an end in it", Seen::surely,
          [](Files& f) { f[0].name = std::string("a\0b.c", 5); }},
         {"one name twice", Seen::surely, [](Files& f) { f.push_back(f[0]); }},
         {"empty texts", Seen::maybe, [](Files& f) {
            for (CodeFile& x : f) x.text.clear();
          }}});
  }
};

/// Hands what the honest one finds on to the sink, wrongly.
class LyingTipForce final : public TipForce {
 public:
  Result<void> prepare(const Params&) override {
    return liar().fill("tip_force.prepare", nullptr, []() -> Result<void> { return {}; }, {});
  }
  Result<TipWrench> at(double time, double) const override {
    return liar().answer<TipWrench>("tip_force.at", nullptr,
                                    [time]() -> Result<TipWrench> {
                                      return TipWrench{{1, 0, -2 * time}, {0, 0.1, 0}};
                                    },
                                    {{"a force that is no number", Seen::surely,
                                      [](TipWrench& w) { w.force[1] = liar().no_number(); }},
                                     {"a moment that is no number", Seen::surely,
                                      [](TipWrench& w) { w.moment[2] = liar().no_number(); }}});
  }
};

class LyingIntegrator final : public Lying<Integrator> {
 public:
  using Lying::Lying;
  Result<void> prepare(const Params& p) override {
    return liar().fill("integrator.prepare", nullptr, [&] { return inner_->prepare(p); }, {});
  }
  Result<OdeStatistics> run(OdeSystem& system, const OdeRun& run, OdeSink& sink,
                            Progress& p) const override {
    Sink spoiled(sink);
    return liar().answer<OdeStatistics>(
        "integrator.run", &p, [&] { return inner_->run(system, run, spoiled, p); },
        {{"no number at the end", Seen::surely,
          [](OdeStatistics& s) { s.end = liar().no_number(); }},
         {"negative counts", Seen::maybe,
          [](OdeStatistics& s) { s.steps = -7, s.rates = INT64_MIN; }},
         {"samples after the end", Seen::surely,
          [&](OdeStatistics&) {
            const std::vector<double> x(run.x0.begin(), run.x0.end());
            for (int i = 0; i < 5; ++i) (void)sink.sample(run.start - 1, x);
          }},
         {"a rate asked for with a short state", Seen::surely,
          [&](OdeStatistics&) {
            double one[1] = {0};
            (void)system.rate(0, {one, 0}, {one, 0});
          }},
         {"a state projected that is short", Seen::surely,
          [&](OdeStatistics&) {
            double one[1] = {0};
            system.project({one, 0});
          }},
         {"an event that is none", Seen::surely,
          [&](OdeStatistics&) {
            std::vector<double> x(run.x0.begin(), run.x0.end());
            (void)system.at_event(0, system.events() + 1'000'000, x);
          }},
         {"events asked for with short spans", Seen::surely, [&](OdeStatistics&) {
            double one[1] = {0};
            system.event_values(0, {one, 0}, {one, 0});
          }}});
  }

 private:
  class Sink final : public OdeSink {
   public:
    explicit Sink(OdeSink& to) : to_(to) {}
    bool sample(double t, std::span<const double> x) override {
      struct State {
        double t;
        std::vector<double> x;
      } s{t, {x.begin(), x.end()}};
      liar().spoil<State>(
          "integrator's sample", s,
          {{"a time that is none", Seen::surely, [](State& v) { v.t = liar().no_number(); }},
           {"a time long ago", Seen::surely, [](State& v) { v.t = -1e9; }},
           {"a state too short", Seen::surely, [](State& v) { v.x.pop_back(); }},
           {"an empty state", Seen::surely, [](State& v) { v.x.clear(); }},
           {"a state too long", Seen::surely, [](State& v) { v.x.resize(v.x.size() + 100); }},
           {"a state that is no number", Seen::surely,
            [](State& v) { v.x[liar().pick(v.x.size())] = liar().no_number(); }},
           {"a wild state", Seen::maybe,
            [](State& v) { v.x[liar().pick(v.x.size())] = liar().wild(); }}});
      return to_.sample(s.t, s.x);
    }

   private:
    OdeSink& to_;
  };
};

class LyingRetimer final : public Lying<Retimer> {
 public:
  using Lying::Lying;
  Result<Retiming> retime(const RetimeProblem& problem, const Params& params,
                          Progress& p) const override {
    return liar().answer<Retiming>(
        "retimer.retime", &p, [&] { return inner_->retime(problem, params, p); },
        {{"times too few", Seen::surely, [](Retiming& r) { r.time.pop_back(); }},
         {"no times", Seen::surely, [](Retiming& r) { r.time.clear(), r.rate.clear(); }},
         {"rates too many", Seen::surely, [](Retiming& r) { r.rate.resize(r.rate.size() + 9); }},
         {"no number", Seen::surely,
          [](Retiming& r) { r.time[liar().pick(r.time.size())] = liar().no_number(); }},
         {"no number as a rate", Seen::surely,
          [](Retiming& r) { r.rate[liar().pick(r.rate.size())] = liar().no_number(); }},
         {"times that fall", Seen::surely,
          [](Retiming& r) { std::swap(r.time.front(), r.time.back()); }},
         {"a negative rate", Seen::surely, [](Retiming& r) { r.rate[r.rate.size() / 2] = -1; }},
         {"a wild rate", Seen::maybe,
          [](Retiming& r) { r.rate[liar().pick(r.rate.size())] = 1e300; }},
         {"no time at all", Seen::surely, [](Retiming& r) { r.time.assign(r.time.size(), 0); }},
         {"a wild end", Seen::maybe, [](Retiming& r) { r.time.back() = 1e300; }}});
  }
};

class LyingPlanner final : public Lying<Planner> {
 public:
  using Lying::Lying;
  Result<Plan> plan(const PlanProblem& problem, const Params& params, Progress& p) const override {
    return liar().answer<Plan>(
        "planner.plan", &p, [&] { return inner_->plan(problem, params, p); },
        {{"no points", Seen::surely, [](Plan& x) { x.points.clear(); }},
         {"half a point", Seen::surely, [](Plan& x) { x.points.pop_back(); }},
         {"no number", Seen::surely,
          [](Plan& x) { x.points[liar().pick(x.points.size())] = liar().no_number(); }},
         {"a start from elsewhere", Seen::surely, [](Plan& x) { x.points[0] += 0.5; }},
         {"a goal that is none", Seen::surely,
          [](Plan& x) { x.goal = liar().pick(2) ? 1'000'000 : ~std::size_t{0}; }},
         {"an end elsewhere", Seen::surely, [](Plan& x) { x.points.back() += 0.5; }},
         {"a way through what is there", Seen::maybe,
          [&](Plan& x) {
            x.points.erase(x.points.begin() + static_cast<std::ptrdiff_t>(problem.dof),
                           x.points.end() - static_cast<std::ptrdiff_t>(problem.dof));
          }},
         {"a question about half a configuration", Seen::surely,
          [&](Plan&) { (void)problem.is_free(problem.start.first(0)); }},
         {"a question about half a motion", Seen::surely,
          [&](Plan&) { (void)problem.is_free_between(problem.start.first(0), problem.start); }},
         {"a question about what is no number", Seen::maybe, [&](Plan&) {
            const std::vector<double> q(problem.dof, liar().no_number());
            (void)problem.is_free(q);
            (void)problem.is_free_between(q, q);
          }}});
  }
};

}  // namespace robomosp::test
