// SPDX-License-Identifier: Apache-2.0
// Providers "dormand_prince", "runge_kutta4" and "symplectic": the SDK's suite.
#include <robomosp/sdk/conformance/integrator_suite.h>

#include <cmath>

namespace robomosp::conformance {
namespace {

const std::string kFile = std::string(ROBOMOSP_PLUGIN_DIR) + "/integrators.so";

INSTANTIATE_TEST_SUITE_P(
    Plugin, IntegratorConformance,
    testing::Values(
        IntegratorCase{kFile, "dormand_prince", 5, {}, true, "max_step", false},
        IntegratorCase{kFile, "dormand_prince", 5, {{"norm", "max"}}, true, "max_step", false},
        IntegratorCase{kFile, "runge_kutta4", 4, {}, false, "", false},
        IntegratorCase{kFile, "symplectic", 2, {{"method", "verlet"}}, false, "", true},
        IntegratorCase{kFile, "symplectic", 4, {{"method", "yoshida4"}}, false, "", true},
        IntegratorCase{kFile, "symplectic", 1, {{"method", "euler"}}, false, "", true}),
    integrator_case_name);

/// x'' = -w^2 x from a phase of the swing.
class Spring final : public OdeSystem {
 public:
  static constexpr double kRate = 1000;  // rad/s
  std::size_t size() const override { return 2; }
  std::size_t positions() const override { return 1; }
  Result<void> rate(double, std::span<const double> x, std::span<double> dx) override {
    dx[0] = x[1], dx[1] = -kRate * kRate * x[0];
    return {};
  }
  void project(std::span<double>) override {}
  std::size_t events() const override { return 0; }
  void event_values(double, std::span<const double>, std::span<double>) override {}
  bool at_event(double, std::size_t, std::span<double>) override { return true; }
};
class Last final : public OdeSink {
 public:
  bool sample(double, std::span<const double> x) override {
    position = x[0];
    return true;
  }
  double position = 0;
};

/// "" where the run ended, with the amplitude bounded; else the sentence, or "diverged".
std::string swing(const char* name, const char* method, double step, double phase) {
  auto found = find_provider<Integrator>(kFile, name);
  if (!found.ok()) return found.error().sentence();
  TableParams params(**found);
  if (*method) params.set("method", method);
  const auto solver = create<Integrator>(**found);
  if (const auto r = solver->prepare(params); !r.ok()) return r.error().sentence();
  Spring spring;
  Last last;
  NoProgress none;
  const double x0[] = {0.01 * std::cos(phase), -0.01 * Spring::kRate * std::sin(phase)};
  const double end[] = {0.2};
  OdeRun run;
  run.end = 0.2, run.x0 = x0, run.sample_times = end, run.step = step;
  const auto done = solver->run(spring, run, last, none);
  if (!done.ok()) return done.error().sentence();
  return std::fabs(last.position) > 0.05 ? "diverged" : "";
}

/// Limits of stability h w: Hairer, Norsett, Wanner, Solving ODEs I, IV.2 for Runge-Kutta; 2 for
/// Verlet and semi-implicit Euler; for Yoshida's composition the trace of the map of a step leaves
/// -2..2 from 1.5735 on.
TEST(FixedSteps, ThatAreTooLongAreRefusedAndOthersAreNot) {
  const struct {
    const char *name, *method;
    double limit;
  } cases[] = {{"runge_kutta4", "", 2.8284},
               {"symplectic", "euler", 2},
               {"symplectic", "verlet", 2},
               {"symplectic", "yoshida4", 1.5735}};
  for (const auto& c : cases)
    for (const double phase : {0.0, 0.7, 2.0, 4.5}) {
      for (const double part : {1.01, 1.05, 1.1, 1.3, 2.0, 5.0, 15.0}) {
        const std::string said = swing(c.name, c.method, part * c.limit / Spring::kRate, phase);
        EXPECT_NE(said.find("too long for this motion"), std::string::npos)
            << c.name << " " << c.method << " " << part << " " << phase << ": " << said;
      }
      for (const double part : {0.05, 0.2, 0.4})
        EXPECT_EQ(swing(c.name, c.method, part * c.limit / Spring::kRate, phase), "")
            << c.name << " " << c.method << " " << part << " " << phase;
    }
}

}  // namespace
}  // namespace robomosp::conformance
