// SPDX-License-Identifier: Apache-2.0
// The program of suites, robomosp-plugin-suites: what it finds in solvers with one fault each, when
// it says that nothing was judged, and robots from files.
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include <gtest/gtest.h>

#include <robomosp/sdk/conformance/all_models.h>
#include <robomosp/sdk/model_file.h>

namespace robomosp {
namespace {

namespace fs = std::filesystem;

struct Outcome {
  int code = -1;
  std::string text;
};
Outcome suites(const std::string& arguments) {
  Outcome run;
  FILE* pipe = popen(("\"" ROBOMOSP_SUITES "\" " + arguments + " 2>&1").c_str(), "r");
  if (!pipe) return run;
  std::array<char, 4096> part{};
  while (const std::size_t n = std::fread(part.data(), 1, part.size(), pipe))
    run.text.append(part.data(), n);
  const int status = pclose(pipe);
  run.code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  return run;
}
const std::string kFaulty = "\"" ABI_PLUGIN_DIR "/abi_faulty.so\" ";
const std::string kShipped = "\"" ROBOMOSP_PLUGIN_DIR "/";
bool has(const Outcome& run, const std::string& text) {
  return run.text.find(text) != std::string::npos;
}
std::string temporary(const char* name) {
  return (fs::temp_directory_path() / (std::to_string(getpid()) + name)).string();
}

TEST(Suites, FindASolutionThatIsLeftOut) {
  const Outcome run =
      suites(kFaulty + "--suite ik --models puma560 --gtest_filter='*Restarts*forgetful*'");
  EXPECT_EQ(run.code, 1) << run.text;
  EXPECT_TRUE(has(run, "a solution is missing")) << run.text;
}

TEST(Suites, FindAnAllocationForASample) {
  const Outcome run =
      suites(kFaulty + "--suite dynamics --gtest_filter='*NothingIsAllocated*allocates*'");
  EXPECT_EQ(run.code, 1) << run.text;
  EXPECT_TRUE(has(run, "by torques of 20 samples")) << run.text;
}

TEST(Suites, JudgeInverseDynamicsAlone) {
  const Outcome run = suites(kFaulty + "--suite dynamics --gtest_filter='*/inverse__*'");
  EXPECT_EQ(run.code, 0) << run.text;
  EXPECT_TRUE(has(run, "TorquesSatisfyKanesEquations/inverse__puma560")) << run.text;
  EXPECT_TRUE(has(run, "it has no forward dynamics")) << run.text;
}

TEST(Suites, JudgeForwardDynamicsByTheInverseOfAnotherPlugin) {
  const Outcome run =
      suites(kShipped + "dynamics_articulated.so\" --suite dynamics --dynamics " + kShipped +
             "dynamics_newton_euler.so\" --gtest_filter='*ForwardUndoes*'");
  EXPECT_EQ(run.code, 0) << run.text;
  EXPECT_TRUE(has(run, "newton_euler_articulated_body_puma560")) << run.text;
}

TEST(Suites, FindABoundThatBoundsNothing) {
  const Outcome run = suites(kFaulty + "--suite collision --gtest_filter='*ABound*timid'");
  EXPECT_EQ(run.code, 1) << run.text;
}

TEST(Suites, FindWhatAPostLosesAndWhatDiffersTheSecondTime) {
  const std::string with = "--suite post --language " + kShipped +
                           "irl.so\" --constructs \"" ROBOMOSP_SOURCE_DIR
                           "/scripts/post_test/constructs.txt\" ";
  const Outcome lost = suites(kFaulty + with + "--gtest_filter='*EveryConstruct*loser*'");
  EXPECT_EQ(lost.code, 1) << lost.text;
  EXPECT_TRUE(has(lost, "lost: the files are as without it")) << lost.text;
  const Outcome other = suites(kFaulty + with + "--gtest_filter='*EqualPrograms*restless*'");
  EXPECT_EQ(other.code, 1) << other.text;
  const Outcome good = suites(kShipped + "post_krl.so\" " + with);
  EXPECT_EQ(good.code, 0) << good.text;
  // Without a language there is no program to be written.
  const Outcome none = suites(kShipped + "post_krl.so\" --suite post");
  EXPECT_EQ(none.code, 3) << none.text;
  EXPECT_TRUE(has(none, "--language gives the plugin that compiles them")) << none.text;
}

TEST(Suites, SayThatNothingWasJudged) {
  // A solver that refuses every robot passes no test: it was only never asked.
  const Outcome run = suites(kFaulty + "--suite ik --gtest_filter='*unwilling*'");
  EXPECT_EQ(run.code, 3) << run.text;
  EXPECT_TRUE(has(run, "Nothing was judged by IkConformance on unwilling")) << run.text;
  // Chosen for it, a robot that it refuses is a failure.
  EXPECT_EQ(suites(kFaulty + "--suite ik --models puma560 --gtest_filter='*unwilling*'").code, 1);
  const Outcome other = suites(kShipped + "ik_numeric.so\" --suite planner");
  EXPECT_EQ(other.code, 3) << other.text;
  EXPECT_TRUE(has(other, "offers nothing that the suite \"planner\" judges")) << other.text;
  const Outcome none = suites(kShipped + "robot_files.so\"");
  EXPECT_EQ(none.code, 3) << none.text;
  EXPECT_TRUE(has(none, "There is no suite here for what this plugin offers")) << none.text;
}

TEST(Suites, RefuseWhatTheyDoNotUnderstand) {
  for (const char* wrong : {"--suite sums", "--models hal9000", "--model /nowhere.model",
                            "--what ever", "--suite", "puma560"}) {
    const Outcome run = suites(kFaulty + wrong);
    EXPECT_EQ(run.code, 2) << wrong;
    EXPECT_TRUE(has(run, "usage:")) << wrong;
  }
}

TEST(Suites, RunOnRobotsFromFiles) {
  const std::string file = temporary("-arm.model");
  RobotModel arm = conformance::kr5();
  arm.name = "an arm from a file";
  std::ofstream(file) << model_text(arm);
  const Outcome run =
      suites(kShipped + "ik_spherical_wrist.so\" --model " + file + " --gtest_brief=0");
  EXPECT_EQ(run.code, 0) << run.text;
  EXPECT_TRUE(has(run, "spherical_wrist_an_arm_from_a_file")) << run.text;
  EXPECT_FALSE(has(run, "puma560")) << run.text;
  fs::remove(file);
}

TEST(ModelFile, EveryMechanismComesBackAsItWas) {
  for (const auto& named : conformance::named_models()) {
    SCOPED_TRACE(std::string(named.name));
    const RobotModel m = named.make();
    const std::string text = model_text(m);
    const auto read = model_from_text(text);
    ASSERT_TRUE(read.ok()) << read.error().sentence();
    EXPECT_EQ(model_text(*read), text);
    ASSERT_EQ(read->joints.size(), m.joints.size());
    EXPECT_EQ(read->dof(), m.dof());
    EXPECT_EQ(read->coordinate_count(), m.coordinate_count());
    for (std::size_t i = 0; i < m.joints.size(); ++i) {
      EXPECT_EQ(read->joints[i].placement.R, m.joints[i].placement.R);
      EXPECT_EQ(read->joints[i].coupling.ratio, m.joints[i].coupling.ratio);
      EXPECT_EQ(read->joints[i].q_index, m.joints[i].q_index);
    }
  }
}

TEST(ModelFile, WhatIsWrongIsToldWithItsLine) {
  const std::string pose = " 0 0 0 1 0 0 0 1 0 0 0 1";
  const auto fault = [](const std::string& text) {
    const auto read = model_from_text(text);
    return read.ok() ? std::string("accepted") : read.error().sentence();
  };
  const std::string good = "robot \"r\"\njoint \"a\" revolute -1\ntip \"t\" 0" + pose + "\n";
  EXPECT_EQ(fault(good), "accepted");
  EXPECT_NE(fault("").find("no tip"), std::string::npos);
  EXPECT_NE(fault("placement" + pose).find("line 1"), std::string::npos);
  EXPECT_NE(fault(good + "joint \"b\" round 0").find("line 4: \"round\""), std::string::npos);
  EXPECT_NE(fault(good + "joint \"b\" revolute 7").find("out of range"), std::string::npos);
  EXPECT_NE(fault(good + "tip \"u\" 1e300" + pose).find("out of range"), std::string::npos);
  EXPECT_NE(fault(good + "gravity 0 0 nan").find("not a number"), std::string::npos);
  EXPECT_NE(fault(good + "gravity 0 0 inf").find("not a number"), std::string::npos);
  EXPECT_NE(fault(good + "gravity 0 0").find("not a number"), std::string::npos);
  EXPECT_NE(fault(good + "gravity 0 0 0 0").find("unexpected text"), std::string::npos);
  EXPECT_NE(fault(good + "base 0 0 0 2 0 0 0 1 0 0 0 1").find("not a rotation"), std::string::npos);
  EXPECT_NE(fault(good + "joint \"b\" revolute 0\n coupling 9 1 0").find("does not exist"),
            std::string::npos);
  EXPECT_NE(fault(good + "joint \"b\" revolute 0\n coupling 1 1 0").find("itself coupled"),
            std::string::npos);
}

// What `robomosp plugin test FILE` says of each file of ours that has suites of this program. Code
// is run by tests/conformance/robot_code_test.cpp, whose generators need a runner.
TEST(Suites, EveryShippedPluginPasses) {
  for (const char* name :
       {"collision_fcl", "control", "csg_cgal", "csg_occt", "dynamics_articulated",
        "dynamics_newton_euler", "ik_numeric", "ik_spherical_wrist", "ik_srs", "integrators",
        "physics_ode", "planner_ompl", "retime_reachability"}) {
    const fs::path file = fs::path(ROBOMOSP_PLUGIN_DIR) / (std::string(name) + ".so");
    if (!fs::exists(file)) continue;
    const Outcome run = suites("\"" + file.string() + "\" --dynamics " + kShipped +
                               "dynamics_newton_euler.so\" --gtest_brief=1");
    EXPECT_EQ(run.code, 0) << name << "\n" << run.text;
  }
}

}  // namespace
}  // namespace robomosp
