// SPDX-License-Identifier: Apache-2.0
// What the shipped providers and those of a test compute in a process of their own is what they
// compute in the program, to the bit; and so are their errors. (The suites of the SDK on providers
// in processes: the tests apart_*.)
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <robomosp/sdk/conformance/models.h>
#include <robomosp/sdk/csg_primitive.h>
#include <robomosp/sdk/dynamics.h>
#include <robomosp/sdk/ik.h>
#include <robomosp/sdk/ik_branches.h>
#include <robomosp/sdk/io.h>
#include <robomosp/sdk/joint_segment.h>
#include <robomosp/sdk/module.h>
#include <robomosp/sdk/motion_law.h>
#include <robomosp/sdk/orientation.h>
#include <robomosp/sdk/robot_code.h>
#include <robomosp/sdk/trajectory.h>

#include "kernel/plugin_loader.h"
#include "kernel/plugin_run.h"

namespace robomosp {
namespace {

/// All that is made is written here, numbers as bytes.
class Seen {
 public:
  void add(const std::string& words) { all += words + "\n"; }
  template <class T>
  void add(const std::vector<T>& numbers) {
    all.append(reinterpret_cast<const char*>(numbers.data()), numbers.size() * sizeof(T));
    ++answers;
  }
  bool add(const Error& e) {
    add(e.sentence());
    return false;
  }
  std::string all;
  int answers = 0;
};

class SameElsewhere : public testing::Test {
 protected:
  struct Side {
    Registry registry;
    PluginLoader loader{registry};
  };
  /// Runs `work` with a plugin in the program and with it in a process; both see the same.
  static void same(const std::string& file, const std::function<void(Registry&, Seen&)>& work) {
    SCOPED_TRACE(file);
    Side in, out;
    Seen here, there;
    {
      const PluginRunScope scope(PluginRun{});
      const auto& r = in.loader.load(file);
      ASSERT_FALSE(r.refusal) << r.refusal->sentence();
    }
    {
      const PluginRunScope scope(PluginRun{false, {}});
      const auto& r = out.loader.load(file);
      ASSERT_FALSE(r.refusal) << r.refusal->sentence();
    }
    ASSERT_TRUE(PluginRuns::of_program().process(std::filesystem::canonical(file)));
    work(in.registry, here);
    work(out.registry, there);
    EXPECT_GT(here.answers, 0) << here.all;
    EXPECT_EQ(here.answers, there.answers);
    EXPECT_TRUE(here.all == there.all) << here.all.substr(0, 2000) << "\n--\n"
                                       << there.all.substr(0, 2000);
  }
  static std::string shipped(const std::string& name) {
    return std::string(ROBOMOSP_PLUGIN_DIR) + "/" + name + ".so";
  }
  /// The defaults, and something for what has none.
  static std::unique_ptr<Params> params_of(const ProviderInfo& info) {
    Map given;
    for (const ParamSpec& p : info.schema) {
      if (!p.required) continue;
      if (p.type == "real") given.set(p.name, 0.5);
      if (p.type == "int") given.set(p.name, 3);
    }
    auto checked = check(info.schema, given);
    return make_params(checked.ok() ? std::move(*checked) : Map{});
  }
  template <class I>
  static void each(Registry& registry, Seen& seen,
                   const std::function<void(I&, const Params&)>& work) {
    for (const ProviderInfo& info : registry.list(I::kInterfaceId)) {
      seen.add(info.name);
      auto made = registry.create<I>(info.name);
      if (!made.ok()) seen.add(made.error());
      else work(**made, *params_of(info));
    }
  }
};

std::vector<Pose> corners() {
  std::vector<Pose> out(4);
  out[1].p = {0.3, 0.1, 0};
  out[2].p = {0.4, 0.4, 0.1};
  out[3].p = {0.1, 0.5, 0.3};
  const double c = std::cos(0.7), s = std::sin(0.7);
  out[3].R = {c, -s, 0, s, c, 0, 0, 0, 1};
  return out;
}
std::vector<double> steps(double end) {
  std::vector<double> out;
  for (int i = 0; i <= 50; ++i) out.push_back(end * i / 50);
  return out;
}

TEST_F(SameElsewhere, Paths) {
  for (const char* plugin : {"path_analytic", "path_splines", "joint_motion"})
    same(shipped(plugin), [](Registry& registry, Seen& seen) {
      std::unique_ptr<Curve> along;
      each<CurveFactory>(registry, seen, [&](CurveFactory& f, const Params& params) {
        for (const std::size_t n : {std::size_t{2}, std::size_t{3}, std::size_t{4}}) {
          const auto points = corners();
          auto made = f.make(std::span(points).first(n), params);
          if (!made.ok()) {
            seen.add(made.error());
            continue;
          }
          seen.add(std::vector<double>{(*made)->end(), (*made)->is_timed() ? 1.0 : 0.0});
          seen.add((*made)->knots());
          const auto u = steps((*made)->end());
          std::vector<CurveSample> out(u.size());
          if (const auto done = (*made)->evaluate(u, out); !done.ok()) seen.add(done.error());
          seen.add(out);
          along = std::move(*made);
        }
      });
      each<MotionLawFactory>(registry, seen, [&](MotionLawFactory& f, const Params& params) {
        LawTask task;
        task.length = 0.5;
        auto made = f.make(task, params);
        if (!made.ok()) return (void)seen.add(made.error());
        const auto t = steps((*made)->duration());
        std::vector<LawSample> out(t.size());
        if (const auto done = (*made)->sample(t, out); !done.ok()) seen.add(done.error());
        seen.add(out);
      });
      each<OrientationFactory>(registry, seen, [&](OrientationFactory& f, const Params& params) {
        const auto points = corners();
        const std::vector<double> shares{0, 0.3, 0.6, 1};
        OrientationTask task;
        task.points = points;
        task.shares = shares;
        task.curve = along.get();
        auto made = f.make(task, params);
        if (!made.ok()) return (void)seen.add(made.error());
        const auto w = steps(1);
        std::vector<CurveSample> way(w.size());
        for (CurveSample& s : way) s.d1 = {1, 0.5, 0};
        std::vector<OrientationSample> out(w.size());
        if (const auto done = (*made)->evaluate(w, way, out); !done.ok()) seen.add(done.error());
        seen.add(out);
      });
      each<SegmentFactory>(registry, seen, [&](SegmentFactory& f, const Params& params) {
        const auto points = corners();
        auto made = f.make(points, params);
        if (!made.ok()) return (void)seen.add(made.error());
        const auto t = steps((*made)->duration());
        std::vector<PathSample> out(t.size());
        if (const auto done = (*made)->sample(t, out); !done.ok()) seen.add(done.error());
        seen.add(out);
      });
      each<JointSegmentFactory>(registry, seen, [&](JointSegmentFactory& f, const Params& params) {
        const std::vector<double> points{0, 0, 1, -1}, low{-3, -3}, high{3, 3}, fast{1, 1},
            quick{2, 2}, jerk{50, 50};
        const JointLimits limits{sizeof(JointLimits), low, high, fast, quick, jerk};
        auto made = f.make(2, points, limits, JointEnds{}, params);
        if (!made.ok()) return (void)seen.add(made.error());
        const auto t = steps((*made)->duration());
        std::vector<double> q(2 * t.size()), qd(q), qdd(q);
        if (const auto done = (*made)->sample(t, {q, qd, qdd, {}}); !done.ok())
          seen.add(done.error());
        for (const auto& x : {q, qd, qdd}) seen.add(x);
      });
    });
}

TEST_F(SameElsewhere, Robots) {
  const RobotModel model = conformance::puma560();
  same(shipped("dynamics_newton_euler"), [&](Registry& registry, Seen& seen) {
    each<InverseDynamics>(registry, seen, [&](InverseDynamics& s, const Params& params) {
      if (const auto bound = s.prepare(model, params); !bound.ok())
        return (void)seen.add(bound.error());
      std::vector<double> scratch(s.scratch_size()), q, tau(6000), m(36000), by_q(m), by_qd(m);
      for (int i = 0; i < 6000; ++i) q.push_back(std::sin(i));
      std::vector<Energy> energy(1000);
      DynamicsBatch b;
      b.count = 1000;
      b.q = b.qd = b.qdd = q;
      b.scratch = scratch;
      NoProgress none;
      for (const auto& done : {s.torques(b, tau, none), s.inertia(b, m, none),
                               s.derivatives(b, by_q, by_qd, none), s.energy(b, energy, none)})
        if (!done.ok()) seen.add(done.error());
      for (const auto& x : {tau, m, by_q, by_qd}) seen.add(x);
      seen.add(energy);
    });
  });
  same(shipped("ik_spherical_wrist"), [&](Registry& registry, Seen& seen) {
    each<IkSolver>(registry, seen, [&](IkSolver& s, const Params& params) {
      if (const auto bound = s.prepare(model, params); !bound.ok())
        return (void)seen.add(bound.error());
      std::vector<Pose> targets(20);
      for (std::size_t i = 0; i < targets.size(); ++i)
        targets[i].p = {0.3 + 0.05 * static_cast<double>(i), 0.2, 0.1};
      std::vector<IkResult> results(targets.size());
      IkBatch b;
      b.targets = targets;
      b.all_solutions = true;
      NoProgress none;
      if (const auto done = s.solve(b, results, none); !done.ok()) seen.add(done.error());
      const auto* branches = static_cast<const IkBranches*>(s.extension(IkBranches::kExtensionId));
      ASSERT_TRUE(branches);
      for (const auto& c : branches->choices(0))
        seen.add(std::string(c.name) + c.positive + c.negative);
      for (const IkResult& r : results) {
        seen.add(r.detail + std::to_string(static_cast<int>(r.status)));
        seen.add(r.q);
        seen.add(std::vector<double>{r.position_error, r.rotation_error, r.shortfall});
        std::vector<double> sides(r.q.size() / 6 * branches->choices(0).size());
        branches->measure(0, r.q, sides);
        seen.add(sides);
      }
    });
  });
  same(shipped("robot_code_c"), [&](Registry& registry, Seen& seen) {
    each<RobotCodeGenerator>(registry, seen, [&](RobotCodeGenerator& g, const Params& params) {
      NoProgress none;
      const auto files = g.generate(model, "puma", kCodeAll, params, none);
      if (!files.ok()) return (void)seen.add(files.error());
      for (const CodeFile& f : *files) {
        seen.add(f.name);
        seen.add(std::vector<char>(f.text.begin(), f.text.end()));
      }
    });
  });
}

class Answers final : public ModuleCall {
 public:
  explicit Answers(Seen& seen) : seen_(seen) {}
  Result<ModuleValue> run(std::string_view command, const ModuleValue& arguments) override {
    seen_.add(std::string(command) + std::to_string(arguments["value"].real()));
    ModuleValue out = ModuleValue::map();
    out.set("all", ModuleValue::list({1, 2.5, "three", true, ModuleValue::reference("robot", 7),
                                      ModuleValue::matrix({1, 2, 3, 4, 5, 6}, 2, 3, "m")}));
    return out;
  }
  [[nodiscard]] Result<ModuleValue> setting(std::string_view name) const override {
    if (name != "factor") return error(ErrorCode::unknown_name, "which?");
    return ModuleValue(2.0);
  }
  [[nodiscard]] Result<std::string> name(const ModuleValue&) const override {
    return std::string();
  }
  Result<std::shared_ptr<const RobotModel>> robot_model(const ModuleValue&) override {
    return error(ErrorCode::unknown_name, "none");
  }
  Progress& progress() override { return none_; }
  void say(std::int32_t severity, std::string_view text) override {
    seen_.add(std::to_string(severity) + std::string(text));
  }
  [[nodiscard]] std::string_view session() const override { return "somebody"; }

 private:
  Seen& seen_;
  NoProgress none_;
};

TEST_F(SameElsewhere, FilesSolidsAndModules) {
  const std::string file = testing::TempDir() + "/some.words";
  std::ofstream(file) << "twelve words";
  same(std::string(ABI_PLUGIN_DIR) + "/abi_reckless_module.so", [&](Registry& registry,
                                                                    Seen& seen) {
    NoProgress none;
    each<CsgPrimitive>(registry, seen, [&](CsgPrimitive& p, const Params& params) {
      const auto tree = p.build(params, none);
      if (!tree.ok()) return (void)seen.add(tree.error());
      const CsgNode& node = tree->nodes.at(0);
      seen.add(node.name + std::to_string(node.profile->loops.at(0).curves.at(0).points.at(1)[1]));
      seen.add(std::vector<double>(node.sizes.begin(), node.sizes.end()));
    });
    each<Importer>(registry, seen, [&](Importer& importer, const Params& params) {
      seen.add(std::string(importer.extensions()));
      for (const std::string& path : {file, file + ".missing"}) {
        const auto read = importer.read(path, params, none);
        if (!read.ok()) seen.add(read.error());
        else seen.add(read->records.at(0).text + read->notes.at(0));
      }
    });
    each<Exporter>(registry, seen, [&](Exporter& e, const Params& params) {
      seen.add(std::string(e.extensions()) + (e.is_exact("exact") ? "yes" : "no") +
               (e.is_exact("words") ? "yes" : "no"));
      Mesh mesh;
      mesh.positions.resize(9);
      const ExportPrimitive box{ExportPrimitive::Form::box, {}, {4, 5, 6}};
      std::vector<ExportItem> items(2);
      items[0].name = "part";
      items[0].mesh = &mesh;
      set_primitive(items[0], &box);
      set_robot_part(items[1], {0, 3});
      ExportReport report;
      ExportTask task;
      task.name = "all.words";
      task.extension = "words";
      task.items = items;
      task.report = &report;
      const auto files = e.write(task, params, none);
      if (!files.ok()) return (void)seen.add(files.error());
      seen.add(files->at(0).bytes + report.notes.at(0));
    });
    each<Module>(registry, seen, [&](Module& m, const Params&) {
      const ModuleTable& t = m.table();
      ASSERT_EQ(t.command_count, 1U);
      EXPECT_EQ(t.runs, kModuleRunTask);
      seen.add(std::string(t.commands[0].name) + t.commands[0].params.rows[0].default_text);
      Answers host(seen);
      ModuleValue given = ModuleValue::map();
      given.set("value", 21.0);
      const auto made = t.commands[0].run(m, given, host);
      if (!made.ok()) return (void)seen.add(made.error());
      EXPECT_EQ((*made)["value"].real(), 42);
      EXPECT_EQ((*made)["all"].item(5).rows(), 2U);
      EXPECT_EQ((*made)["all"].item(4).number(), 7U);
      ModuleValue arguments = ModuleValue::map();
      arguments.set("name", "one");
      ModuleRunNotice notice;
      notice.command = "task.run";
      notice.arguments = &arguments;
      const auto let = m.before_run(notice, host);
      EXPECT_FALSE(let.ok());
      if (!let.ok()) seen.add(let.error());
    });
  });
  std::filesystem::remove(file);
}

}  // namespace
}  // namespace robomosp
