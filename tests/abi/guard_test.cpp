// SPDX-License-Identifier: Apache-2.0
// What the host does for every provider: it enforces the provider's tags, looks at what it returns,
// names it in every fault, hands it the host, and takes none as the default that was only found.
#include "kernel/provider_guard.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include <gtest/gtest.h>
#include <robomosp/sdk/collision.h>
#include <robomosp/sdk/conformance/mechanisms.h>
#include <robomosp/sdk/curve.h>
#include <robomosp/sdk/dynamics.h>
#include <robomosp/sdk/ik.h>
#include <robomosp/sdk/integrator.h>
#include <robomosp/sdk/io.h>
#include <robomosp/sdk/joint_segment.h>
#include <robomosp/sdk/language.h>
#include <robomosp/sdk/language_editing.h>
#include <robomosp/sdk/motion_law.h>
#include <robomosp/sdk/orientation.h>
#include <robomosp/sdk/planner.h>
#include <robomosp/sdk/post.h>
#include <robomosp/sdk/program_tables.h>
#include <robomosp/sdk/retimer.h>
#include <robomosp/sdk/trajectory.h>

#include "kernel/plugin_loader.h"

namespace robomosp {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr const char* kReport = " Report it to the provider's author or choose another provider.";

/// A registry with one provider "mine" of Interface, made by `make`.
template <class Interface>
std::shared_ptr<Interface> guarded_provider(std::function<Interface*()> make,
                                            std::vector<std::string> tags = {}) {
  static Registry registry;
  ProviderInfo info;
  info.interface_id = Interface::kInterfaceId;
  info.name = "mine";
  info.tags = std::move(tags);
  EXPECT_TRUE(registry
                  .add(
                      std::move(info), [make]() -> Result<void*> { return make(); }, true)
                  .ok());
  auto made = registry.create<Interface>("mine");
  EXPECT_TRUE(made.ok());
  return made.ok() ? *made : nullptr;
}

// --- tags ----------------------------------------------------------------------------------------

struct AnyIk final : IkSolver {
  Result<void> prepare(const RobotModel&, const Params&) override { return {}; }
  Result<void> solve(const IkBatch& batch, std::span<IkResult> results, Progress&) const override {
    if (!batch.goals.empty()) throw std::runtime_error("it was given goals");
    for (IkResult& r : results) r.iterations = batch.tip;
    return {};
  }
};

TEST(Guard, ASimpleProviderNeverSeesARobotThatIsNot) {
  const auto params = make_params({});
  const auto simple = guarded_provider<IkSolver>([] { return new AnyIk; }, {"simple"});
  EXPECT_TRUE(simple->prepare(conformance::pa10(), *params).ok());
  EXPECT_EQ(simple->prepare(conformance::floating_manipulator(), *params).error().sentence(),
            "robot \"floating manipulator\": provider \"mine\" supports robots with one coordinate "
            "per joint, without followers and loops. Choose another provider for it.");
  EXPECT_EQ(simple->prepare(conformance::four_bar(4, 1, 3, 3), *params).error().code,
            ErrorCode::unsupported);
  const auto any = guarded_provider<IkSolver>([] { return new AnyIk; });
  EXPECT_TRUE(any->prepare(conformance::floating_manipulator(), *params).ok());
}

TEST(Guard, GoalsObjectivesAndArmAnglesGoToThoseThatSayTheyServeThem) {
  const auto ik = guarded_provider<IkSolver>([] { return new AnyIk; });
  NoProgress none;
  const Pose targets[2] = {};
  const IkGoal two[] = {{0}, {1}}, part[] = {{0, kIkPosition}}, whole[] = {{1}};
  std::vector<IkResult> one(1);
  IkBatch batch;
  batch.targets = targets;
  batch.goals = two;
  EXPECT_EQ(ik->solve(batch, one, none).error().message,
            "provider \"mine\" does not declare support for several goals or parts of a pose");
  batch.targets = {targets, 1};
  batch.goals = part;
  EXPECT_EQ(ik->solve(batch, one, none).error().code, ErrorCode::unsupported);
  batch.goals = whole;  // is what every solver serves: the tip 1
  ASSERT_TRUE(ik->solve(batch, one, none).ok());
  EXPECT_EQ(one[0].iterations, 1);
  batch.goals = {};
  batch.objective = IkObjective::limits;
  EXPECT_EQ(ik->solve(batch, one, none).error().message,
            "provider \"mine\" does not declare support for objectives");
  batch.objective = IkObjective::none;
  const double angle[] = {0.0};
  batch.arm_angles = angle;
  EXPECT_EQ(ik->solve(batch, one, none).error().message,
            "provider \"mine\" does not declare support for arm angles");
  const auto says = guarded_provider<IkSolver>([] { return new AnyIk; }, {"goals"});
  batch.arm_angles = {};
  batch.goals = whole;
  EXPECT_EQ(says->solve(batch, one, none).error().sentence(),
            std::string("provider \"mine\" threw: it was given goals.") + kReport);
}

struct AnyForward final : ForwardDynamics {
  Result<void> prepare(const RobotModel&, const Params&) override { return {}; }
  std::size_t scratch_size() const override { return 0; }
  Result<void> accelerations(const DynamicsBatch&, std::span<double>, Progress&) const override {
    return {};
  }
};

TEST(Guard, ForwardDynamicsWithoutTheTagLoopsSeesNone) {
  const auto params = make_params({});
  const auto four_bar = conformance::four_bar(4, 1, 3, 3);
  EXPECT_EQ(guarded_provider<ForwardDynamics>([] { return new AnyForward; })
                ->prepare(four_bar, *params)
                .error()
                .message,
            "provider \"mine\" does not declare that its accelerations keep loops closed");
  EXPECT_TRUE(guarded_provider<ForwardDynamics>([] { return new AnyForward; }, {"loops"})
                  ->prepare(four_bar, *params)
                  .ok());
}

// --- what is returned ----------------------------------------------------------------------------

using LawAt = std::function<LawSample(double)>;
struct Law final : MotionLaw {
  LawAt at;
  double T = 2;
  double duration() const override { return T; }
  Result<void> sample(std::span<const double> times, std::span<LawSample> out) const override {
    for (std::size_t i = 0; i < times.size(); ++i) out[i] = at(times[i]);
    return {};
  }
};
struct LawFactory final : MotionLawFactory {
  LawAt at;
  double T = 2;
  Result<std::unique_ptr<MotionLaw>> make(const LawTask&, const Params&) const override {
    auto law = std::make_unique<Law>();
    law->at = at;
    law->T = T;
    return std::unique_ptr<MotionLaw>(std::move(law));
  }
};
/// A cubic over 2 s, right in all.
LawSample right(double t) {
  const double x = std::clamp(t / 2, 0.0, 1.0);
  const bool moves = t >= 0 && t <= 2;
  return {x * x * (3 - 2 * x), moves ? 3 * x * (1 - x) : 0, moves ? 1.5 - 3 * x : 0,
          moves ? -1.5 : 0};
}
std::string law_fault(LawAt at, double T = 2) {
  const auto factory = guarded_provider<MotionLawFactory>([&] {
    auto* made = new LawFactory;
    made->at = at;
    made->T = T;
    return made;
  });
  const auto law = factory->make({}, *make_params({}));
  if (law.ok()) return "";
  EXPECT_EQ(law.error().code, ErrorCode::plugin_failed);
  EXPECT_TRUE(law.error().message.starts_with("provider \"mine\" ")) << law.error().message;
  return law.error().message.substr(16);
}

TEST(Guard, LawsAreLookedAtWhenTheyAreMade) {
  EXPECT_EQ(law_fault(right), "");
  EXPECT_EQ(law_fault(right, kNan), "made a law without a positive duration");
  EXPECT_EQ(law_fault([](double t) {
              LawSample s = right(t);
              if (t > 0.9) s.jerk = kNan;
              return s;
            }).substr(0, 39),
            "returned a law that is not a number at ");
  EXPECT_EQ(
      law_fault([](double t) {
        LawSample s = right(t);
        if (t > 1) s.share -= 0.2 * (t - 1) * (2 - std::min(t, 2.0));
        return s;
      }),
      "made a law with a rate that is not the derivative of its path parameter");  // at half of the
                                                                                   // places
  EXPECT_EQ(law_fault([](double t) {
              LawSample s = right(t);
              if (t > 0.9 && t < 1.1) s.share = 0.3;
              return s;
            }).substr(0, 32),
            "made a law that runs backwards a");
  EXPECT_EQ(law_fault([](double t) {
              LawSample s = right(t);
              s.share *= 0.9;
              return s;
            }),
            "made a law that runs from a share of 0 to 0.9 of its path, not from 0 to 1");
  EXPECT_EQ(law_fault([](double t) {
              LawSample s = right(t);
              if (t > 2) s.rate = 0.1;
              return s;
            }),
            "made a law that moves past its end");
  EXPECT_EQ(law_fault([](double t) {
              LawSample s = right(t);
              s.rate *= 2;  // by the share of the duration, not by time
              return s;
            }),
            "made a law with a rate that is not the derivative of its path parameter");
  EXPECT_EQ(law_fault([](double t) {
              LawSample s = right(t);
              s.acceleration = 0;
              return s;
            }),
            "made a law with an acceleration that is not the derivative of its rate");
}

TEST(Guard, LawsOfManyPiecesAndExtremeDurationsAreRight) {
  // A trapezoid: the acceleration jumps.
  const auto ramps = [](double T) {
    return [T](double t) -> LawSample {
      const double x = t / T;
      if (x < 0 || x > 1) return {x < 0 ? 0.0 : 1.0, 0, 0, 0};
      const double v = 1 / 0.7, a = v / 0.3;
      if (x < 0.3) return {a * x * x / 2, a * x / T, a / (T * T), 0};
      if (x > 0.7) return {1 - a * (1 - x) * (1 - x) / 2, a * (1 - x) / T, -a / (T * T), 0};
      return {a * 0.045 + v * (x - 0.3), v / T, 0, 0};
    };
  };
  for (const double T : {1e-6, 1e-3, 1.0, 1e4, 1e8}) EXPECT_EQ(law_fault(ramps(T), T), "") << T;
}

TEST(Guard, ALaterSampleThatIsNotANumberIsAnErrorThatNamesTheProvider) {
  // Only at one time that nothing looks at when it is made.
  const auto factory = guarded_provider<MotionLawFactory>([] {
    auto* made = new LawFactory;
    made->at = [](double t) {
      LawSample s = right(t);
      if (t == 1.2345) s.rate = kNan;
      if (t == 1.3) s.share = 1.5;
      if (t == 1.4) throw std::runtime_error("no such time");
      return s;
    };
    return made;
  });
  const auto law = factory->make({}, *make_params({}));
  ASSERT_TRUE(law.ok()) << law.error().sentence();
  LawSample s;
  for (const auto& [t, sentence] :
       {std::pair(1.2345, "provider \"mine\" returned a law that is not a number at 1.2345 s."),
        {1.3, "provider \"mine\" returned a law that leaves its path, to a share of 1.5 at 1.3 s."},
        {1.4, "provider \"mine\" threw: no such time."}})
    EXPECT_EQ((*law)->sample({&t, 1}, {&s, 1}).error().sentence(), std::string(sentence) + kReport);
}

using CurveAt = std::function<CurveSample(double)>;
struct AnyCurve final : Curve {
  CurveAt at;
  std::vector<double> known{0, 1};
  bool even = false;
  double end() const override { return 1; }
  std::vector<double> knots() const override { return known; }
  bool is_even() const override { return even; }
  Result<void> evaluate(std::span<const double> u, std::span<CurveSample> out) const override {
    for (std::size_t i = 0; i < u.size(); ++i) out[i] = at(u[i]);
    return {};
  }
};
struct AnyCurveFactory final : CurveFactory {
  std::function<std::unique_ptr<Curve>()> made;
  Result<std::unique_ptr<Curve>> make(std::span<const Pose>, const Params&) const override {
    return made();
  }
};
CurveSample circle(double u) {
  const double c = std::cos(u), s = std::sin(u);
  return {{c, s, 0}, {-s, c, 0}, {-c, -s, 0}, {s, -c, 0}};
}
std::string curve_fault(CurveAt at, std::vector<double> knots = {0, 1}, bool even = false) {
  const auto factory = guarded_provider<CurveFactory>([&] {
    auto* one = new AnyCurveFactory;
    one->made = [=] {
      auto curve = std::make_unique<AnyCurve>();
      curve->at = at;
      curve->known = knots;
      curve->even = even;
      return curve;
    };
    return one;
  });
  const auto curve = factory->make({}, *make_params({}));
  return curve.ok() ? "" : curve.error().message;
}

TEST(Guard, CurvesAreLookedAtWhenTheyAreMade) {
  EXPECT_EQ(curve_fault(circle, {0, 0.5, 1}, true), "");
  // Far from the origin and tiny: differences are mostly rounding, which is no fault.
  EXPECT_EQ(curve_fault([](double u) {
              CurveSample s = circle(u);
              for (Vec3* v : {&s.p, &s.d1, &s.d2, &s.d3})
                for (double& x : *v) x *= 1e-6;
              s.p[0] += 1e4;
              return s;
            }),
            "");
  EXPECT_EQ(curve_fault([](double) { return CurveSample{{1, 2, 3}, {}, {}, {}}; }), "");
  EXPECT_EQ(curve_fault(circle, {0, 0.7, 0.5}),
            "provider \"mine\" made a curve with knots that do not increase within 0 to its end");
  EXPECT_EQ(
      curve_fault([](double u) {
        CurveSample s = circle(u);
        s.d1 = {s.d1[0] * 2, s.d1[1] * 2, 0};
        return s;
      }),
      "provider \"mine\" made a curve with a first derivative that is not that of its points");
  EXPECT_EQ(
      curve_fault([](double u) {
        CurveSample s = circle(u);
        s.d2 = {};
        return s;
      }),
      "provider \"mine\" made a curve with a second derivative that is not that of the first");
  EXPECT_EQ(curve_fault(
                [](double u) {
                  return CurveSample{{u * u, 0, 0}, {2 * u, 0, 0}, {2, 0, 0}, {}};
                },
                {0, 1}, true),
            "provider \"mine\" made a curve that claims even speed and does not have it");
  const auto nothing = guarded_provider<CurveFactory>([] {
    auto* one = new AnyCurveFactory;
    one->made = [] { return std::unique_ptr<Curve>(); };
    return one;
  });
  EXPECT_EQ(nothing->make({}, *make_params({})).error().sentence(),
            std::string("provider \"mine\" made nothing.") + kReport);
}

struct AnyOrientation final : Orientation {
  std::array<double, 9> R{};
  Result<void> evaluate(std::span<const double> w, std::span<const CurveSample>,
                        std::span<OrientationSample> out) const override {
    for (std::size_t i = 0; i < w.size(); ++i) out[i].R = R;
    return {};
  }
};
struct AnyOrientationFactory final : OrientationFactory {
  std::array<double, 9> R{};
  Result<std::unique_ptr<Orientation>> make(const OrientationTask&, const Params&) const override {
    auto made = std::make_unique<AnyOrientation>();
    made->R = R;
    return std::unique_ptr<Orientation>(std::move(made));
  }
};

TEST(Guard, OrientationsAreRotations) {
  const std::array<double, 9> identity{1, 0, 0, 0, 1, 0, 0, 0, 1},
      mirror{-1, 0, 0, 0, 1, 0, 0, 0, 1}, stretched{2, 0, 0, 0, 1, 0, 0, 0, 0.5},
      broken{kNan, 0, 0, 0, 1, 0, 0, 0, 1};
  for (const auto& [R, is_right] :
       {std::pair(identity, true), {mirror, false}, {stretched, false}, {broken, false}}) {
    const auto factory = guarded_provider<OrientationFactory>([&, &given = R] {
      auto* one = new AnyOrientationFactory;
      one->R = given;
      return one;
    });
    auto made = factory->make({}, *make_params({}));
    ASSERT_TRUE(made.ok());
    const double w = 0.25;
    CurveSample along;
    OrientationSample out;
    const auto said = (*made)->evaluate({&w, 1}, {&along, 1}, {&out, 1});
    EXPECT_EQ(said.ok(), is_right);
    if (!is_right) {
      EXPECT_EQ(
          said.error().message,
          "provider \"mine\" returned an orientation that is not a rotation at 0.25 of the path");
    }
  }
}

struct AnySegment final : Segment, JointSegment {
  double duration() const override { return 1; }
  double length() const override { return 1; }
  const void* extension(const char*) const override { return nullptr; }
  Result<void> sample(std::span<const double> times, std::span<PathSample> out) const override {
    for (std::size_t i = 0; i < times.size(); ++i) {
      out[i] = {};
      out[i].pose.p[0] = std::clamp(times[i], 0.0, 1.0);
      if (times[i] <= 1) out[i].velocity[0] = factor;
    }
    return {};
  }
  Result<void> sample(std::span<const double> times, const JointSamples& out) const override {
    for (std::size_t i = 0; i < times.size(); ++i) {
      out.q[i] = times[i];
      if (!out.qd.empty()) out.qd[i] = factor;
    }
    return {};
  }
  double factor = 1;
};
struct AnySegmentFactory final : SegmentFactory {
  double factor = 1;
  Result<std::unique_ptr<Segment>> make(std::span<const Pose>, const Params&) const override {
    auto made = std::make_unique<AnySegment>();
    made->factor = factor;
    return std::unique_ptr<Segment>(std::move(made));
  }
};
struct AnyJointFactory final : JointSegmentFactory {
  double factor = 1;
  Result<std::unique_ptr<JointSegment>> make(std::size_t, std::span<const double>,
                                             const JointLimits&, const JointEnds&,
                                             const Params&) const override {
    auto made = std::make_unique<AnySegment>();
    made->factor = factor;
    return std::unique_ptr<JointSegment>(std::move(made));
  }
};

TEST(Guard, SegmentsMoveAsTheySay) {
  for (const double factor : {1.0, 1.5, kNan}) {
    const auto segments = guarded_provider<SegmentFactory>([=] {
      auto* one = new AnySegmentFactory;
      one->factor = factor;
      return one;
    });
    const auto joints = guarded_provider<JointSegmentFactory>([=] {
      auto* one = new AnyJointFactory;
      one->factor = factor;
      return one;
    });
    const auto a = segments->make({}, *make_params({}));
    const auto b = joints->make(1, {}, {}, {}, *make_params({}));
    EXPECT_EQ(a.ok(), factor == 1.0);
    EXPECT_EQ(b.ok(), factor == 1.0);
    if (factor == 1.5) {
      EXPECT_EQ(a.error().message,
                "provider \"mine\" made a segment with a velocity that is not the derivative of "
                "its position");
      EXPECT_EQ(b.error().message,
                "provider \"mine\" made a joint motion whose velocity of joint 1 is not the "
                "derivative of its position");
    }
  }
}

struct AnyRetimer final : Retimer {
  std::vector<double> time;
  Result<Retiming> retime(const RetimeProblem&, const Params&, Progress&) const override {
    return Retiming{std::vector<double>(time.size(), 1.0), time};
  }
};
TEST(Guard, RetimersDoNotRunBackwards) {
  const double s[] = {0, 0.5, 1};
  RetimeProblem problem;
  problem.s = s;
  NoProgress none;
  const auto said = [&](std::vector<double> time) {
    const auto retimer = guarded_provider<Retimer>([&] {
      auto* one = new AnyRetimer;
      one->time = time;
      return one;
    });
    const auto timed = retimer->retime(problem, *make_params({}), none);
    return timed.ok() ? std::string() : timed.error().message;
  };
  EXPECT_EQ(said({0, 1, 2}), "");
  EXPECT_EQ(said({0, 1}), "provider \"mine\" gave times that do not fit the path");
  EXPECT_EQ(said({0, 2, 1}), "provider \"mine\" gave times that run backwards at grid point 3");
  EXPECT_EQ(said({0, kNan, 1}),
            "provider \"mine\" gave a time that is not a number at grid point 2");
}

struct AnyIntegrator final : Integrator {
  std::vector<double> times;
  Result<void> prepare(const Params&) override { return {}; }
  Result<OdeStatistics> run(OdeSystem&, const OdeRun& run, OdeSink& sink,
                            Progress&) const override {
    for (const double t : times)
      if (!sink.sample(t, run.x0)) break;
    return OdeStatistics{};
  }
};
struct NoSystem final : OdeSystem {
  std::size_t size() const override { return 1; }
  std::size_t positions() const override { return 0; }
  Result<void> rate(double, std::span<const double>, std::span<double>) override { return {}; }
  void project(std::span<double>) override {}
  std::size_t events() const override { return 0; }
  void event_values(double, std::span<const double>, std::span<double>) override {}
  bool at_event(double, std::size_t, std::span<double>) override { return true; }
};
struct Count final : OdeSink {
  int count = 0;
  bool sample(double, std::span<const double>) override { return ++count > 0; }
};
TEST(Guard, IntegratorsHandOverFiniteStatesInTheOrderOfTime) {
  NoSystem system;
  NoProgress none;
  const auto said = [&](std::vector<double> times, double x) {
    const auto integrator = guarded_provider<Integrator>([&] {
      auto* one = new AnyIntegrator;
      one->times = times;
      return one;
    });
    Count sink;
    OdeRun run;
    run.x0 = {&x, 1};
    run.end = 2;
    const auto done = integrator->run(system, run, sink, none);
    return done.ok() ? std::to_string(sink.count) : done.error().message;
  };
  EXPECT_EQ(said({0, 1, 1, 2}, 1), "4");
  EXPECT_EQ(said({0, 2, 1}, 1),
            "provider \"mine\" handed over a sample at t = 1 s, out of the order of time");
  EXPECT_EQ(said({0, 3}, 1),
            "provider \"mine\" handed over a sample at t = 3 s, out of the order of time");
  EXPECT_EQ(said({0}, kNan),
            "provider \"mine\" handed over a state that is not a number at t = 0 s");
}

// --- the host ------------------------------------------------------------------------------------

TEST(Host, ReachesEveryProviderWhichMayLogAndAskOthers) {
  Registry registry;
  Messages messages;
  PluginLoader loader(registry, &messages);
  ASSERT_TRUE(loader.load(std::string(ABI_PLUGIN_DIR) + "/abi_asks.so").loaded);
  ProviderInfo helper;
  helper.interface_id = IkSolver::kInterfaceId;
  helper.name = "helper";
  helper.tags = {"simple"};
  ASSERT_TRUE(
      registry.add(helper, []() -> Result<void*> { return static_cast<IkSolver*>(new AnyIk); })
          .ok());
  const auto asking = registry.create<IkSolver>("asking");
  ASSERT_TRUE(asking.ok()) << asking.error().sentence();
  EXPECT_TRUE((*asking)->prepare(conformance::pa10(), *make_params({})).ok());
  ASSERT_EQ(messages.recent().size(), 1U);
  EXPECT_EQ(messages.recent()[0].text, "it sees 4 solvers");
  // What it was handed stands behind its guard as well.
  EXPECT_EQ((*asking)->prepare(conformance::floating_manipulator(), *make_params({})).error().code,
            ErrorCode::unsupported);
  EXPECT_NE(registry.create<IkSolver>("circular").error().message.find("in a cycle"),
            std::string::npos);
}

TEST(Host, AResultThatIsReadWithoutAskingIsAnErrorOfItsProvider) {
  Registry registry;
  PluginLoader loader(registry);
  ASSERT_TRUE(loader.load(std::string(ABI_PLUGIN_DIR) + "/abi_asks.so").loaded);
  const auto misreads = registry.create<IkSolver>("misreads");
  ASSERT_TRUE(misreads.ok());
  EXPECT_EQ((*misreads)->prepare(conformance::pa10(), *make_params({})).error().sentence(),
            std::string("provider \"misreads\" threw: a failed result was read: no such file.") +
                kReport);
}

// --- defaults ------------------------------------------------------------------------------------

Registry::Create make_ik() {
  return []() -> Result<void*> { return static_cast<IkSolver*>(new AnyIk); };
}
void add_ik(Registry& registry, const char* name, bool shipped,
            std::vector<std::string> tags = {}) {
  ProviderInfo info;
  info.interface_id = IkSolver::kInterfaceId;
  info.name = name;
  info.shipped = shipped;
  info.tags = std::move(tags);
  ASSERT_TRUE(registry.add(std::move(info), make_ik()).ok());
}
std::string standard(const Registry& registry) {
  const auto info = registry.find(IkSolver::kInterfaceId, "");
  return info.ok() ? info->name : info.error().sentence();
}

TEST(Defaults, NothingBecomesTheDefaultByBeingFound) {
  Registry registry;
  add_ik(registry, "found_first", false);
  EXPECT_EQ(standard(registry), "found_first");  // the only one there is
  add_ik(registry, "found_too", false);
  EXPECT_EQ(standard(registry),
            "no ik provider is the default. Choose one with provider.default: found_first and "
            "found_too.");
  add_ik(registry, "alphabetically", true, {"partial"});
  EXPECT_EQ(standard(registry), "alphabetically");
  add_ik(registry, "better", true);
  EXPECT_EQ(standard(registry), "better");
  add_ik(registry, "numeric", true);
  EXPECT_EQ(standard(registry), "numeric");
  EXPECT_EQ(registry.list(IkSolver::kInterfaceId).front().name, "alphabetically")
      << "who takes the first that can do something takes none that was only found";
  ASSERT_TRUE(registry.set_default(IkSolver::kInterfaceId, "found_too").ok());
  EXPECT_EQ(standard(registry), "found_too");
  ASSERT_TRUE(registry.set_enabled(IkSolver::kInterfaceId, "found_too", false).ok());
  EXPECT_EQ(standard(registry), "numeric");
  ASSERT_TRUE(registry.set_default(IkSolver::kInterfaceId, "").ok());
  ASSERT_TRUE(registry.set_enabled(IkSolver::kInterfaceId, "numeric", false).ok());
  EXPECT_EQ(standard(registry), "better");
}

// --- words, progress and sizes -------------------------------------------------------------------

struct Fails final : IkSolver {
  Error e;
  explicit Fails(Error said) : e(std::move(said)) {}
  Result<void> prepare(const RobotModel&, const Params&) override { return e; }
  Result<void> solve(const IkBatch&, std::span<IkResult>, Progress&) const override { throw 42; }
};

TEST(Guard, WhatAProviderSaysCanBeShown) {
  const auto said = [](const Error& e) {
    return guarded_provider<IkSolver>([&] { return new Fails(e); })
        ->prepare(conformance::pa10(), *make_params({}))
        .error();
  };
  EXPECT_EQ(said(Error{}).sentence(),
            std::string("provider \"mine\" failed and gave no reason.") + kReport);
  EXPECT_EQ(said(error(ErrorCode::io, "\x1b[2Jno\x07 file")).message, "\\x1b[2Jno\\x07 file");
  const Error strange = said(error(static_cast<ErrorCode>(999), "it did not work"));
  EXPECT_EQ(strange.code, ErrorCode::plugin_failed);
  EXPECT_EQ(strange.message, "provider \"mine\" failed: it did not work");
  EXPECT_EQ(said(error(ErrorCode::internal, "a defect")).code, ErrorCode::plugin_failed);
  EXPECT_LT(said(error(ErrorCode::io, std::string(1'000'000, 'x'))).sentence().size(), 2000U);
  NoProgress none;
  std::vector<IkResult> results(1);
  const Pose target;
  IkBatch batch;
  batch.targets = {&target, 1};
  EXPECT_EQ(guarded_provider<IkSolver>([] { return new Fails({}); })
                ->solve(batch, results, none)
                .error()
                .message,
            "provider \"mine\" threw an unknown exception");
}

struct Reports final : Progress {
  std::vector<double> shares;
  std::string words;
  void report(double share, std::string_view what) override {
    shares.push_back(share);
    words += what;
  }
  bool cancelled() const override { return false; }
};

TEST(Guard, ProgressStaysWithinItsBounds) {
  Reports to;
  HeardProgress heard_of(to);
  for (const double share : {kNan, -1.0, 0.25, 7.0, 1e300})
    heard_of.report(share, "\x1b[2J" + std::string(1'000'000, 'y'));
  EXPECT_EQ(to.shares, (std::vector<double>{0, 0.25, 1, 1}));
  EXPECT_EQ(to.words.find('\x1b'), std::string::npos);
  EXPECT_LT(to.words.size(), 1000U);
}

struct AnyResult final : IkSolver {
  IkResult result;
  Result<void> prepare(const RobotModel&, const Params&) override { return {}; }
  Result<void> solve(const IkBatch&, std::span<IkResult> results, Progress&) const override {
    results[0] = result;
    return {};
  }
};

TEST(Guard, ResultsOfInverseKinematicsHaveFieldsOfSense) {
  const auto said = [](const std::function<void(IkResult&)>& spoil) {
    AnyResult* one = nullptr;
    const auto ik = guarded_provider<IkSolver>([&] { return one = new AnyResult; });
    EXPECT_TRUE(ik->prepare(conformance::pa10(), *make_params({})).ok());
    spoil(one->result);
    NoProgress none;
    std::vector<IkResult> results(1);
    const Pose target;
    IkBatch batch;
    batch.targets = {&target, 1};
    const auto done = ik->solve(batch, results, none);
    return done.ok() ? std::string() : done.error().message;
  };
  EXPECT_EQ(said([](IkResult&) {}), "");
  EXPECT_EQ(said([](IkResult& r) { r.limiting_joint = 6; }), "");
  EXPECT_EQ(said([](IkResult& r) { r.limiting_joint = 7; }),
            "provider \"mine\" named a joint that the robot does not have");
  EXPECT_EQ(said([](IkResult& r) { r.status = static_cast<IkStatus>(77); }),
            "provider \"mine\" returned a state that is not defined by its interface");
  for (const auto& spoil : std::vector<std::function<void(IkResult&)>>{
           [](IkResult& r) { r.shortfall = kNan; }, [](IkResult& r) { r.position_error = kNan; },
           [](IkResult& r) { r.lost_direction[5] = kNan; }})
    EXPECT_EQ(said(spoil),
              "provider \"mine\" returned an error or a direction that is not a number");
}

struct AnyInverse final : InverseDynamics {
  std::size_t scratch = 0;
  bool fills = true;
  Result<void> prepare(const RobotModel&, const Params&) override { return {}; }
  std::size_t scratch_size() const override { return scratch; }
  Result<void> torques(const DynamicsBatch&, std::span<double> tau, Progress&) const override {
    if (fills) std::fill(tau.begin(), tau.end(), 1.0);
    return {};
  }
  Result<void> inertia(const DynamicsBatch&, std::span<double>, Progress&) const override {
    return {};
  }
};

TEST(Guard, DynamicsFillWhatTheyAreGivenAndAskForLittle) {
  AnyInverse* one = nullptr;
  const auto make = [&] {
    return guarded_provider<InverseDynamics>([&] { return one = new AnyInverse; });
  };
  auto dynamics = make();
  one->scratch = std::size_t{1} << 62;
  EXPECT_TRUE(dynamics->prepare(conformance::pa10(), *make_params({}))
                  .error()
                  .message.starts_with("provider \"mine\" asks for 4611686018427387904 numbers as "
                                       "scratch"));
  dynamics = make();
  one->scratch = 12;
  ASSERT_TRUE(dynamics->prepare(conformance::pa10(), *make_params({})).ok());
  one->scratch = 99;  // what was asked for stays
  EXPECT_EQ(dynamics->scratch_size(), 12U);
  NoProgress none;
  double tau[7] = {};
  EXPECT_TRUE(dynamics->torques({}, tau, none).ok());
  one->fills = false;
  EXPECT_EQ(dynamics->torques({}, tau, none).error().message,
            "provider \"mine\" returned a value that is not a number");
}

// --- bodies and files ----------------------------------------------------------------------------

struct AnyScene final : CollisionScene {
  double distance;
  std::uint8_t touches;
  AnyScene(double d, std::uint8_t t) : distance(d), touches(t) {}
  Result<void> distances(std::span<const Pose>, std::span<const CollisionPair>, double,
                         std::span<PairDistance> out, Progress&) const override {
    if (distance != 77)
      for (PairDistance& d : out) d.distance = distance;
    return {};
  }
  Result<void> collisions(std::span<const Pose>, std::span<const CollisionPair>,
                          std::span<std::uint8_t> out, Progress&) const override {
    if (touches != 77)
      for (std::uint8_t& x : out) x = touches;
    return {};
  }
};
struct AnyCollision final : CollisionEngine {
  double distance;
  std::uint8_t touches;
  AnyCollision(double d, std::uint8_t t) : distance(d), touches(t) {}
  Result<std::unique_ptr<CollisionScene>> build(std::span<const ShapedBody>, const Params&,
                                                Progress&) const override {
    if (distance == -77) return std::unique_ptr<CollisionScene>();
    return std::unique_ptr<CollisionScene>(std::make_unique<AnyScene>(distance, touches));
  }
};

TEST(Guard, DistancesAreNumbersAndContactsAreYesOrNo) {
  const auto said = [](double distance, std::uint8_t touches) {
    NoProgress none;
    const auto engine =
        guarded_provider<CollisionEngine>([&] { return new AnyCollision(distance, touches); });
    const auto scene = engine->build({}, *make_params({}), none);
    if (!scene.ok()) return scene.error().message;
    const Pose poses[2];
    const CollisionPair pair{0, 1};
    PairDistance d;
    std::uint8_t t = 0;
    if (const auto done = (*scene)->distances(poses, {&pair, 1}, 1, {&d, 1}, none); !done.ok())
      return done.error().message;
    const auto done = (*scene)->collisions(poses, {&pair, 1}, {&t, 1}, none);
    return done.ok() ? std::string() : done.error().message;
  };
  EXPECT_EQ(said(0.5, 0), "");
  EXPECT_EQ(said(INFINITY, 1), "");
  for (const double bad : {kNan, -std::numeric_limits<double>::infinity(), 77.0})
    EXPECT_EQ(said(bad, 0), "provider \"mine\" returned a distance that is not a number") << bad;
  for (const std::uint8_t bad : {std::uint8_t{2}, std::uint8_t{77}})
    EXPECT_EQ(said(0, bad), "provider \"mine\" did not report whether two bodies touch");
  EXPECT_EQ(said(-77, 0), "provider \"mine\" made nothing");
}

struct AnyExporter final : Exporter {
  std::vector<std::string> names;
  explicit AnyExporter(std::vector<std::string> n) : names(std::move(n)) {}
  std::string_view extensions() const override { return "lie, \x1b[2J,also"; }
  bool is_exact(std::string_view) const override { return false; }
  Result<std::vector<ExportedFile>> write(const ExportTask&, const Params&,
                                          Progress&) const override {
    std::vector<ExportedFile> files;
    for (const std::string& n : names) files.push_back({n, ""});
    return files;
  }
};

TEST(Guard, ExportersNameFilesBesideTheMainOne) {
  const auto said = [](std::vector<std::string> names) {
    const auto exporter =
        guarded_provider<Exporter>([&] { return new AnyExporter(std::move(names)); });
    EXPECT_EQ(exporter->extensions(), "lie,also");
    ExportTask task;
    task.name = "out.lie";
    NoProgress none;
    const auto files = exporter->write(task, *make_params({}), none);
    return files.ok() ? std::string() : files.error().message;
  };
  EXPECT_EQ(said({"out.lie", "meshes/a.stl"}), "");
  EXPECT_EQ(said({}), "provider \"mine\" made no file \"out.lie\"");
  EXPECT_EQ(said({"out.lie", "out.lie"}), "provider \"mine\" made two files \"out.lie\"");
  for (const char* bad : {"../b", "/b", "", ".", "a/../b", "a//b", "b\n", "\x1b[2J"})
    EXPECT_NE(said({"out.lie", bad}).find("that is not beside the main one"), std::string::npos)
        << bad;
  EXPECT_NE(said({"out.lie", std::string(300, 'n')}), "");
}

struct AnyPlanner final : Planner {
  std::vector<double> asks;
  explicit AnyPlanner(std::vector<double> q) : asks(std::move(q)) {}
  Result<Plan> plan(const PlanProblem& p, const Params&, Progress&) const override {
    return p.is_free(asks) ? Plan{} : Plan{{1}, 0};
  }
};

TEST(Guard, PlannersAskForWholeConfigurations) {
  const auto said = [](std::vector<double> asks) {
    PlanProblem p;
    p.dof = 2;
    p.is_free = [](std::span<const double> q) { return q.size() == 2; };
    NoProgress none;
    const auto plan = guarded_provider<Planner>([&] {
                        return new AnyPlanner(asks);
                      })->plan(p, *make_params({}), none);
    return plan.ok() ? std::string() : plan.error().message;
  };
  EXPECT_EQ(said({0, 0}), "");
  for (const auto& bad : std::vector<std::vector<double>>{{}, {0}, {0, 0, 0}, {kNan, 0}})
    EXPECT_EQ(said(bad), "provider \"mine\" checked joint values that are not a configuration");
}

// --- posts ---------------------------------------------------------------------------------------

struct AnyPost final : Post {
  PostCapabilities caps;
  std::function<void(PostOutput&)> says;
  AnyPost() { caps.title = "Any"; }
  [[nodiscard]] const PostCapabilities& capabilities() const override { return caps; }
  Result<void> write(const PostTask&, const Params&, PostOutput& out, Progress&) const override {
    if (says) says(out);
    return {};
  }
};
struct NoOutput final : PostOutput {
  void file(std::string_view, std::string_view) override { ++files; }
  void from(std::string_view, std::uint32_t, const rmp_span&) override {}
  void fault(std::uint32_t, const rmp_span&, std::string_view, std::string_view) override {}
  int files = 0;
};

TEST(Guard, PostsWriteFilesOfTheirFolderAndSaySomethingOfTheProgram) {
  ProgramTables tables;
  tables.files.push_back({"p"});
  tables.seal();
  const auto written = [&](std::function<void(PostOutput&)> says,
                           std::function<void(PostCapabilities&)> spoil = {}) -> std::string {
    const auto post = guarded_provider<Post>([&] {
      auto* made = new AnyPost;
      made->says = says;
      if (spoil) spoil(made->caps);
      return made;
    });
    PostProfile profile;
    PostTask task;
    task.code = &tables.code();
    task.profile = &profile;
    NoProgress progress;
    NoOutput out;
    const auto done = post->write(task, *make_params({}), out, progress);
    return done.ok() ? "" : done.error().sentence();
  };
  const auto wrong = [](const char* what) {
    return "provider \"mine\" " + std::string(what) + "." + kReport;
  };
  const rmp_span here{0, 1, 1, 0, 0}, nowhere{5, 1, 1, 0, 0};
  EXPECT_EQ(written([](PostOutput& o) { o.file("a/b.src", "x"); }), "");
  EXPECT_EQ(written([&](PostOutput& o) { o.fault(RMP_FAULT_ERROR, here, "no", ""); }), "");
  EXPECT_EQ(written({}), wrong("wrote no file"));
  EXPECT_EQ(written([&](PostOutput& o) { o.fault(RMP_FAULT_NOTE, here, "no", ""); }),
            wrong("wrote no file"));
  for (const char* name : {"../a", "/a", "a//b", "a/", ".", "a/../b"})
    EXPECT_EQ(written([&](PostOutput& o) { o.file(name, ""); }),
              wrong("named a file outside its folder"))
        << name;
  EXPECT_EQ(written([](PostOutput& o) { o.file("", ""); }), wrong("named a file \"\""));
  EXPECT_EQ(written([](PostOutput& o) {
              o.file("a", "");
              o.file("a", "");
            }),
            wrong("wrote the file a twice"));
  EXPECT_EQ(written([&](PostOutput& o) {
              o.file("a", "");
              o.from("b", 1, here);
            }),
            wrong("mapped a line that it has not written"));
  EXPECT_EQ(written([&](PostOutput& o) { o.fault(RMP_FAULT_ERROR, nowhere, "no", ""); }),
            wrong("reported a fault outside the program"));
  EXPECT_EQ(written([&](PostOutput& o) { o.fault(9, here, "no", ""); }),
            wrong("reported a fault outside the program"));
  const auto file = [](PostOutput& o) { o.file("a", ""); };
  EXPECT_EQ(written(file, [](PostCapabilities& c) { c.forms = 0; }),
            wrong("accepts no form of a program"));
  EXPECT_EQ(written(file, [](PostCapabilities& c) { c.max_name = 1; }),
            wrong("has names of less than four letters"));
  EXPECT_EQ(written(file, [](PostCapabilities& c) { c.title = ""; }), wrong("has no title"));
  EXPECT_EQ(written(file, [](PostCapabilities& c) { c.struct_size = 4; }),
            wrong("has capabilities of another version"));
  EXPECT_EQ(written([](PostOutput&) { throw 1; }).substr(0, 21), "provider \"mine\" threw");
}

// --- languages -----------------------------------------------------------------------------------

struct AnyLanguage final : Language {
  std::function<void(ProgramTables&)> spoil;
  [[nodiscard]] std::string_view extensions() const override { return "any"; }
  Result<std::vector<std::string>> needs(const SourceFile&) const override {
    return std::vector<std::string>{};
  }
  /// A program that says HALT, and what is done to its tables.
  Result<std::unique_ptr<CompiledProgram>> compile(const LanguageTask&, const Params&,
                                                   Progress&) const override {
    auto p = std::make_unique<ProgramTables>();
    for (std::uint32_t t = 0; t <= RMP_TYPE_PROCESS; ++t)
      p->types.push_back({t, 0, "", RMP_NONE, 0, 0, 0, 0, {}});
    p->files.push_back({"p"});
    rmp_code_symbol s{};
    s.kind = RMP_SYMBOL_ROUTINE;
    s.name = "p";
    s.scope = s.value = s.constant = RMP_NONE;
    p->symbols.push_back(s);
    rmp_code_statement halt{};
    halt.op = RMP_STMT_HALT;
    halt.next = halt.a = halt.b = halt.c = halt.body = halt.symbol = halt.motion = RMP_NONE;
    p->statements.push_back(halt);
    p->expressions.push_back({RMP_EXPR_LITERAL, RMP_TYPE_INT, RMP_NONE, p->integer(5), 0, 0, {}});
    rmp_code_routine r{};
    r.scope = r.priority = r.condition = RMP_NONE;
    r.instruction_count = 1;
    p->routines.push_back(r);
    rmp_code_instruction i{};
    i.op = RMP_OP_HALT;
    p->instructions.push_back(i);
    if (spoil) spoil(*p);
    p->seal();
    return std::unique_ptr<CompiledProgram>(std::move(p));
  }
};

/// Says of a text of ten bytes whatever it is told to say.
struct AnyEdited final : EditedProgram {
  SourceRange range{0, 2, 4};
  std::uint32_t parent = RMP_NONE;
  SourceTokenKind kind = SourceTokenKind::name;
  std::vector<SourceEdit> edits;
  Result<std::vector<SourceFault>> faults(Progress&) const override {
    SourceFault f;
    f.range = range;
    return std::vector<SourceFault>{f};
  }
  Result<std::vector<SourceToken>> tokens(std::uint32_t, Progress&) const override {
    SourceToken t;
    t.kind = kind;
    t.begin = range.begin;
    t.end = range.end;
    return std::vector<SourceToken>{t};
  }
  Result<std::vector<SourceCompletion>> complete(std::uint32_t, std::uint32_t,
                                                 Progress&) const override {
    SourceCompletion c;
    c.kind = kind;
    c.begin = range.begin;
    c.end = range.end;
    return std::vector<SourceCompletion>{c};
  }
  Result<SourceHover> hover(std::uint32_t, std::uint32_t, Progress&) const override {
    SourceHover h;
    h.range = range;
    h.detail = "x";
    return h;
  }
  Result<std::vector<SourceRange>> definition(std::uint32_t, std::uint32_t,
                                              Progress&) const override {
    return std::vector<SourceRange>{range};
  }
  Result<std::vector<SourceReference>> references(std::uint32_t, std::uint32_t,
                                                  Progress&) const override {
    SourceReference r;
    r.range = range;
    return std::vector<SourceReference>{r};
  }
  Result<std::vector<SourceEdit>> rename(std::uint32_t, std::uint32_t, std::string_view,
                                         Progress&) const override {
    return edits;
  }
  Result<std::string> format(std::uint32_t, const SourceLayout&, Progress&) const override {
    throw std::runtime_error("no layout");
  }
  Result<std::vector<SourceSymbol>> outline(std::uint32_t, Progress&) const override {
    SourceSymbol s;
    s.kind = kind;
    s.parent = parent;
    s.begin = s.name_begin = range.begin;
    s.end = s.name_end = range.end;
    return std::vector<SourceSymbol>{s};
  }
  Result<SourceSignature> signature(std::uint32_t, std::uint32_t, Progress&) const override {
    SourceSignature s;
    s.label = "f(abcdefgh)";
    s.parameters = {range.begin, range.end};
    return s;
  }
  Result<std::vector<SourceRange>> folds(std::uint32_t, Progress&) const override {
    return std::vector<SourceRange>{range};
  }
};
struct AnyEditing final : LanguageEditing {
  std::function<void(AnyEdited&)> spoil;
  Result<std::unique_ptr<EditedProgram>> open(const LanguageTask&) const override {
    auto made = std::make_unique<AnyEdited>();
    if (spoil) spoil(*made);
    return std::unique_ptr<EditedProgram>(std::move(made));
  }
};
struct EditingLanguage final : Language {
  AnyEditing editing;
  [[nodiscard]] const void* extension(const char* id) const override {
    return std::string_view(id) == LanguageEditing::kExtensionId
               ? static_cast<const LanguageEditing*>(&editing)
               : nullptr;
  }
  [[nodiscard]] std::string_view extensions() const override { return "any"; }
  Result<std::vector<std::string>> needs(const SourceFile&) const override {
    return std::vector<std::string>{};
  }
  Result<std::unique_ptr<CompiledProgram>> compile(const LanguageTask&, const Params&,
                                                   Progress&) const override {
    return error(ErrorCode::unsupported, "not asked for");
  }
};

TEST(Guard, WhatALanguageTellsEditorsLiesWithinTheTexts) {
  /// Which answers are refused, a letter each.
  const auto refused = [](std::function<void(AnyEdited&)> spoil) {
    const auto language = guarded_provider<Language>([&] {
      auto* made = new EditingLanguage;
      made->editing.spoil = spoil;
      return made;
    });
    const auto* editing =
        static_cast<const LanguageEditing*>(language->extension(LanguageEditing::kExtensionId));
    const SourceFile file{"p", "0123456789", {}};
    LanguageTask task;
    task.files = std::span<const SourceFile>(&file, 1);
    const auto p = editing->open(task);
    EXPECT_TRUE(p.ok());
    NoProgress told;
    std::string out;
    const auto ask = [&](char letter, const auto& answer) {
      if (!answer.ok()) out += letter;
    };
    ask('f', (*p)->faults(told));
    ask('t', (*p)->tokens(0, told));
    ask('c', (*p)->complete(0, 3, told));
    ask('h', (*p)->hover(0, 3, told));
    ask('d', (*p)->definition(0, 3, told));
    ask('r', (*p)->references(0, 3, told));
    ask('n', (*p)->rename(0, 3, "x", told));
    ask('o', (*p)->outline(0, told));
    ask('s', (*p)->signature(0, 3, told));
    ask('b', (*p)->folds(0, told));
    EXPECT_FALSE((*p)->complete(0, 11, told).ok());
    EXPECT_FALSE((*p)->tokens(1, told).ok());
    EXPECT_NE((*p)->format(0, {}, told).error().sentence().find("no layout"), std::string::npos);
    return out;
  };
  EXPECT_EQ(refused({}), "");
  EXPECT_EQ(refused([](AnyEdited& e) { e.range = {0, 2, 20}; }), "ftchdrosb");
  EXPECT_EQ(refused([](AnyEdited& e) { e.range = {0, 4, 2}; }), "ftchdrosb");
  EXPECT_EQ(refused([](AnyEdited& e) { e.range.file = 1; }), "fhdrb");
  EXPECT_EQ(refused([](AnyEdited& e) { e.kind = static_cast<SourceTokenKind>(99); }), "tco");
  EXPECT_EQ(refused([](AnyEdited& e) { e.parent = 0; }), "o");
  EXPECT_EQ(refused([](AnyEdited& e) {
              e.edits = {{{0, 1, 3}, "a", {}}, {{0, 2, 4}, "b", {}}};
            }),
            "n");
  EXPECT_EQ(refused([](AnyEdited& e) {
              e.edits = {{{0, 5, 6}, "a", {}}, {{0, 1, 2}, "b", {}}};
            }),
            "n");
  EXPECT_EQ(refused([](AnyEdited& e) {
              e.edits = {{{0, 1, 3}, "a", {}}, {{0, 3, 11}, "b", {}}};
            }),
            "n");
}

TEST(Guard, TablesOfProgramsLeadSomewhereAndInNoCircle) {
  const auto compiled = [](std::function<void(ProgramTables&)> spoil) -> std::string {
    const auto language = guarded_provider<Language>([&] {
      auto* made = new AnyLanguage;
      made->spoil = spoil;
      return made;
    });
    NoProgress progress;
    const auto made = language->compile(LanguageTask{}, *make_params({}), progress);
    return made.ok() ? "" : made.error().sentence();
  };
  EXPECT_EQ(compiled({}), "");
  const std::string wrong =
      std::string("provider \"mine\" made tables with numbers that refer to nothing.") + kReport;
  const std::function<void(ProgramTables&)> kSpoils[] = {
      [](ProgramTables& p) { p.symbols[0].type = 99; },
      [](ProgramTables& p) { p.symbols[0].name = nullptr; },
      [](ProgramTables& p) { p.statements[0].next = 0; },
      [](ProgramTables& p) { p.statements[0].body = 7; },
      [](ProgramTables& p) { p.statements[0].op = 1000; },
      [](ProgramTables& p) {
        p.links = {0};
        p.expressions[0].count = 1;
      },
      [](ProgramTables& p) {
        p.types.push_back({RMP_TYPE_LIST, 0, "", 10, 0, 0, 0, 0, {}});
      },
      [](ProgramTables& p) { p.routines.clear(); },
      [](ProgramTables& p) { p.routines[0].instruction_count = 2; },
      [](ProgramTables& p) {
        p.instructions[0].a = {RMP_OPERAND_VARIABLE, 0, 1};
      },
      [](ProgramTables& p) {
        p.instructions[0].a = {RMP_OPERAND_VARIABLE, 0, -1};
      },
      [](ProgramTables& p) { p.instructions[0].op = 1000; },
      [](ProgramTables& p) {
        p.faults.push_back({RMP_FAULT_ERROR, {}, nullptr, ""});
      },
      [](ProgramTables& p) {
        p.faults.push_back({7, {}, "", ""});
      }};
  for (const auto& spoil : kSpoils) EXPECT_EQ(compiled(spoil), wrong);
}

}  // namespace
}  // namespace robomosp
