// SPDX-License-Identifier: Apache-2.0
// The provider that is taken where none is named: chosen for the run, with the document, for the
// user; who says so, what undo and files make of it, and what happens when it is not there.
#include <stdlib.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <memory>
#include <string>

#include <robomosp/sdk/dynamics.h>

#include "ioci/core/document_providers.h"
#include "ioci/core/kept_plugin_runs.h"
#include "kernel/plugin_loader.h"
#include "kernel/plugin_run.h"
#include "support/program.h"

namespace robomosp {
namespace {

namespace fs = std::filesystem;

/// Torques of another provider times a factor: a number says who computed it.
class Scaled final : public InverseDynamics {
 public:
  Scaled(std::shared_ptr<InverseDynamics> inner, double factor)
      : inner_(std::move(inner)), factor_(factor) {}
  Result<void> prepare(const RobotModel& model, const Params& params) override {
    return inner_->prepare(model, params);
  }
  std::size_t scratch_size() const override { return inner_->scratch_size(); }
  Result<void> torques(const DynamicsBatch& batch, std::span<double> tau,
                       Progress& progress) const override {
    RMP_TRY(inner_->torques(batch, tau, progress));
    for (double& t : tau) t *= factor_;
    return {};
  }
  Result<void> inertia(const DynamicsBatch& batch, std::span<double> m,
                       Progress& progress) const override {
    return inner_->inertia(batch, m, progress);
  }

 private:
  std::shared_ptr<InverseDynamics> inner_;
  double factor_;
};

class DefaultProviders : public test::CommandTest {
 protected:
  static constexpr const char* kId = InverseDynamics::kInterfaceId;

  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("default-providers-" + std::to_string(::getpid()));
    fs::create_directories(folder_);
    ::setenv("XDG_CONFIG_HOME", folder_.c_str(), 1);
    CommandTest::SetUp();
    offer("twofold", 2);
    offer("threefold", 3);
    (void)app().registry.set_default(kId, "");
    (void)app().registry.set_user_default(kId, "");
  }
  void TearDown() override {
    app().document.clear();
    for (const char* name : {"twofold", "threefold"}) app().registry.remove(kId, name);
    fs::remove_all(folder_);
  }
  static void offer(const char* name, double factor) {
    ProviderInfo info;
    info.interface_id = kId;
    info.name = name;
    info.origin = "test";
    info.tags = {"serial", "tree"};
    ASSERT_TRUE(app()
                    .registry
                    .add(
                        info,
                        [factor]() -> Result<void*> {
                          RMP_TRY_ASSIGN(auto inner,
                                         app().registry.create<InverseDynamics>("newton_euler"));
                          return static_cast<void*>(
                              static_cast<InverseDynamics*>(new Scaled(std::move(inner), factor)));
                        },
                        true)
                    .ok());
  }
  /// The torque that holds one arm of 1 m and 1 kg level, over its weight: the factor of who
  /// computes it.
  double factor() {
    const auto tau = torque();
    EXPECT_TRUE(tau.ok()) << (tau.ok() ? "" : tau.error().sentence());
    return tau.ok() ? *tau / weight_ : 0;
  }
  Result<double> torque() {
    if (!app().document.now()->find(Kind::robot, "puma560"))
      call("robot.get", {{"name", "puma560"}});
    RMP_TRY_ASSIGN(const Value tau,
                   app().dispatch(session_, "robot.inverse_dynamics",
                                  {{"id", "puma560"}, {"q", List{0, 0.3, 0, 0, 0, 0}}}));
    const double second = tau.as_array() ? tau.as_array()->data()[1] : std::nan("");
    return second;
  }
  void measure() { weight_ = *torque(); }
  std::string chosen_by(const std::string& name) {
    const Value list = call("provider.list", {{"interface", "inverse_dynamics"}});
    for (const Value& p : *list.as_list())
      if (at(p, "name").text() == name) return at(p, "chosen").text();
    return "absent";
  }
  Value choose(const char* name, const char* keep) {
    return call("provider.default",
                {{"interface", "inverse_dynamics"}, {"name", name}, {"keep", keep}});
  }
  fs::path folder_;
  double weight_ = 0;
};

TEST_F(DefaultProviders, TheDocumentsChoiceIsAStepThatUndoTakesBack) {
  measure();
  const auto steps = app().document.undo_labels().size();
  choose("twofold", "document");
  EXPECT_EQ(app().document.undo_labels().size(), steps + 1);
  EXPECT_DOUBLE_EQ(factor(), 2);
  EXPECT_EQ(chosen_by("twofold"), "document");
  EXPECT_EQ(chosen_by("newton_euler"), "");
  choose("threefold", "document");
  EXPECT_DOUBLE_EQ(factor(), 3);
  EXPECT_EQ(app().document.now()->list(ioci::default_provider_kind()).size(), 1U)
      << "one record an interface";
  call("document.undo");
  EXPECT_DOUBLE_EQ(factor(), 2);
  call("document.undo");
  EXPECT_DOUBLE_EQ(factor(), 1);
  EXPECT_EQ(chosen_by("twofold"), "");
  call("document.redo");
  EXPECT_DOUBLE_EQ(factor(), 2);
  choose("", "document");
  EXPECT_DOUBLE_EQ(factor(), 1);
  EXPECT_TRUE(app().document.now()->list(ioci::default_provider_kind()).empty());
}

TEST_F(DefaultProviders, TheRunIsStrongerThanTheDocumentAndThatThanTheUser) {
  measure();
  choose("threefold", "user");
  EXPECT_DOUBLE_EQ(factor(), 3);
  EXPECT_EQ(chosen_by("threefold"), "user");
  choose("twofold", "document");
  EXPECT_DOUBLE_EQ(factor(), 2);
  EXPECT_EQ(chosen_by("threefold"), "");
  choose("newton_euler", "session");
  EXPECT_DOUBLE_EQ(factor(), 1);
  EXPECT_EQ(chosen_by("newton_euler"), "session");
  choose("", "session");
  EXPECT_DOUBLE_EQ(factor(), 2);
  // What is chosen now holds now: a choice for the run does not hide it.
  choose("newton_euler", "session");
  choose("threefold", "document");
  EXPECT_DOUBLE_EQ(factor(), 3);
  choose("", "document");
  choose("", "user");
  EXPECT_DOUBLE_EQ(factor(), 1);
}

TEST_F(DefaultProviders, ItIsSavedAndLoadedWithTheDocument) {
  measure();
  choose("twofold", "document");
  const Value files = call("file.save_all", {{"folder", folder_.string()}});
  const fs::path file = folder_ / "inverse_dynamics.default";
  EXPECT_TRUE(fs::exists(file)) << files.text();
  call("document.clear");
  EXPECT_DOUBLE_EQ(factor(), 1) << "an empty document chooses nothing";
  call("file.load", {{"file", file.string()}});
  EXPECT_DOUBLE_EQ(factor(), 2);
  EXPECT_EQ(chosen_by("twofold"), "document");
}

TEST_F(DefaultProviders, AProviderThatIsNotThereIsAnErrorAndNoOtherOneComputes) {
  measure();
  choose("twofold", "document");
  call("file.save_all", {{"folder", folder_.string()}});
  call("document.clear");
  app().registry.remove(kId, "twofold");
  call("file.load", {{"file", (folder_ / "inverse_dynamics.default").string()}});
  const std::string sentence =
      "the document chooses the inverse_dynamics provider \"twofold\", which is missing or "
      "disabled";
  bool is_told = false;
  for (const Message& m : app().messages.recent())
    is_told = is_told || (m.code == "default_missing" && m.severity == Severity::warning &&
                          m.text.find(sentence) != std::string::npos);
  EXPECT_TRUE(is_told);
  const auto refused = torque();
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.error().sentence().find(sentence), std::string::npos)
      << refused.error().sentence();
  EXPECT_NE(refused.error().sentence().find("keep = \"document\""), std::string::npos);
  // The user says so: for this run, or by taking the choice back.
  choose("newton_euler", "session");
  EXPECT_DOUBLE_EQ(factor(), 1);
  choose("", "session");
  EXPECT_FALSE(torque().ok());
  offer("twofold", 2);  // its plugin is loaded
  EXPECT_DOUBLE_EQ(factor(), 2);
  ASSERT_TRUE(app().registry.set_enabled(kId, "twofold", false).ok());
  EXPECT_FALSE(torque().ok());
  ASSERT_TRUE(app().registry.set_enabled(kId, "twofold", true).ok());
  app().registry.remove(kId, "twofold");
  choose("", "document");
  EXPECT_DOUBLE_EQ(factor(), 1);
}

TEST_F(DefaultProviders, WhatCannotBeKeptIsRefused) {
  EXPECT_NE(
      fails("provider.default", {{"interface", "ik"}, {"name", "no_such"}, {"keep", "document"}})
          .sentence()
          .find("no_such"),
      std::string::npos);
  EXPECT_NE(fails("provider.default", {{"interface", "ik"}, {"keep", "document"}})
                .sentence()
                .find("no name to keep"),
            std::string::npos);
}

/// Where a plugin runs, kept for the user.
TEST_F(DefaultProviders, PluginsStayInProcessesOfTheirOwnWhereThatIsKept) {
  const std::string file =
      fs::canonical(std::string(ROBOMOSP_PLUGIN_DIR) + "/dynamics_newton_euler.so").string();
  const auto load = [&](Map more) {
    more.set("file", file);
    return app().dispatch(session_, "plugin.load", more);
  };
  const auto refused = load({{"seconds", 5.0}});
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.error().sentence().find("Give run_in_process = false or true."),
            std::string::npos);
  const auto moved =
      load({{"run_in_process", false}, {"seconds", 5.0}, {"memory", 1024.0}, {"keep", "user"}});
  ASSERT_TRUE(moved.ok()) << moved.error().sentence();
  const Map& report = *moved->as_map();
  EXPECT_FALSE(*report.find("run_in_process")->as_bool());
  EXPECT_EQ(*report.find("memory")->as_real(), 1024);
  const auto kept = ioci::kept_plugin_runs();
  ASSERT_TRUE(kept.contains(file));
  EXPECT_FALSE(kept.at(file).in_process);
  EXPECT_EQ(kept.at(file).limits.seconds, 5);
  EXPECT_EQ(kept.at(file).limits.memory, std::uint64_t{1024} << 20);
  EXPECT_TRUE(kept.at(file).limits.confined);
  // Only some of its providers, by names of any kind; and what cannot be meant.
  ASSERT_TRUE(load({{"run_in_process", false},
                    {"providers", List{Value("inverse_dynamics newton_euler")}},
                    {"keep", "user"}})
                  .ok());
  ASSERT_EQ(ioci::kept_plugin_runs().at(file).only,
            std::vector<std::string>{std::string(InverseDynamics::kInterfaceId) + " newton_euler"});
  EXPECT_TRUE(ioci::kept_plugin_runs().at(file).limits.confined);
  for (const Map& wrong :
       {Map{{"providers", List{Value("newton_euler")}}},
        Map{{"run_in_process", true}, {"providers", List{Value("newton_euler")}}},
        Map{{"run_in_process", false}, {"providers", List{}}},
        Map{{"run_in_process", false}, {"providers", List{Value("no_such")}}}})
    EXPECT_FALSE(load(wrong).ok());
  ASSERT_TRUE(load({{"run_in_process", false}, {"keep", "user"}}).ok());
  // Another program finds it so.
  Registry registry;
  PluginLoader loader(registry);
  PluginRuns::of_program().set_wishes(kept);
  EXPECT_TRUE(loader.load(file).loaded);
  EXPECT_TRUE(PluginRuns::of_program().process(file));
  ASSERT_TRUE(load({{"run_in_process", true}, {"keep", "user"}}).ok());
  EXPECT_TRUE(ioci::kept_plugin_runs().empty());
  PluginRuns::of_program().set_wishes({});
}

}  // namespace
}  // namespace robomosp
