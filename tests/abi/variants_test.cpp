// SPDX-License-Identifier: Apache-2.0
// The template compiled by other compilers and with other flags: what makes the same objects loads
// and solves, what does not is refused by one sentence.
#include <filesystem>

#include <gtest/gtest.h>
#include <robomosp/sdk/conformance/models.h>
#include <robomosp/sdk/ik.h>

#include "kernel/plugin_loader.h"

namespace robomosp {
namespace {

std::filesystem::path variant(const std::string& name) {
  return std::filesystem::path(ABI_PLUGIN_DIR) / ("variant_" + name + ".so");
}

class Variant : public testing::TestWithParam<const char*> {};

TEST_P(Variant, LoadsAndSolves) {
  const std::string name = GetParam();
  if (!std::filesystem::exists(variant(name))) GTEST_SKIP() << "no such compiler on this machine";
#if defined(__x86_64__)
  if (name == "gcc_avx2" && !(__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")))
    GTEST_SKIP() << "this processor has no AVX2";
#endif
  Registry registry;
  PluginLoader loader(registry);
  const PluginReport& report = loader.load(variant(name).string());
  ASSERT_TRUE(report.loaded) << report.refusal->sentence();
  const auto info = registry.find(IkSolver::kInterfaceId, "my_ik");
  ASSERT_TRUE(info.ok());
  const auto made = registry.create<IkSolver>("my_ik");
  ASSERT_TRUE(made.ok()) << made.error().sentence();
  const RobotModel model = conformance::pa10();
  ASSERT_TRUE((*made)->prepare(model, *make_params(*check(info->schema, {}))).ok());
  conformance::Random random(3);
  std::vector<Pose> targets;
  for (int i = 0; i < 5; ++i)
    targets.push_back(conformance::tip_pose(model, random.configuration(model).data()));
  IkBatch batch;
  batch.targets = targets;
  std::vector<IkResult> results(targets.size());
  NoProgress none;
  const auto solved = (*made)->solve(batch, results, none);
  ASSERT_TRUE(solved.ok()) << solved.error().sentence();
  for (std::size_t i = 0; i < targets.size(); ++i) {
    ASSERT_EQ(results[i].status, IkStatus::solved) << results[i].detail;
    const Pose at = conformance::tip_pose(model, results[i].q.data());
    EXPECT_LE(conformance::position_gap(at, targets[i]), 1e-9);
  }
  // Errors, with their strings, cross as well.
  const RobotModel floating = [] {
    RobotModel m = conformance::pa10();
    m.joints[0].type = JointType::spherical;
    m.number_coordinates();
    return m;
  }();
  EXPECT_EQ((*made)->prepare(floating, *make_params(*check(info->schema, {}))).error().code,
            ErrorCode::unsupported);
}

INSTANTIATE_TEST_SUITE_P(Compilers, Variant,
                         testing::Values("gcc_cxx23", "gcc_o0", "gcc_assertions", "gcc_avx2",
                                         "clang"),
                         [](const auto& c) { return std::string(c.param); });

std::string refusal(const std::string& name) {
  Registry registry;
  PluginLoader loader(registry);
  const PluginReport& report = loader.load(variant(name).string());
  EXPECT_FALSE(report.loaded);
  EXPECT_TRUE(registry.list().empty());
  return report.refusal ? report.refusal->message : "not refused";
}

TEST(VariantRefused, OldStrings) {
  if (!std::filesystem::exists(variant("gcc_old_strings"))) GTEST_SKIP() << "not built";
  EXPECT_EQ(refusal("gcc_old_strings"),
            "its ABI tag \"rmp1;itanium;libstdc++;cxx11=0\" differs from this program's "
            "\"rmp1;itanium;libstdc++;cxx11=1\": cxx11=0 instead of cxx11=1");
}

TEST(VariantRefused, DebugMode) {
  if (!std::filesystem::exists(variant("gcc_debug"))) GTEST_SKIP() << "not built";
  EXPECT_EQ(refusal("gcc_debug"),
            "its ABI tag \"rmp1;itanium;libstdc++;cxx11=1;debug\" differs from this program's "
            "\"rmp1;itanium;libstdc++;cxx11=1\": debug instead of nothing");
}

}  // namespace
}  // namespace robomosp
