// SPDX-License-Identifier: Apache-2.0
// Generated C: compiled by the system's compiler without a warning, judged by the SDK's suites of
// generated code and of dynamics, and its batches by forward kinematics and Jacobians of other
// code.
#include <dlfcn.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <utility>

#include <robomosp/sdk/conformance/dynamics_suite.h>
#include <robomosp/sdk/conformance/robot_code_suite.h>

#include "robotics/kinematics.h"

namespace robomosp::conformance {
namespace {

namespace fs = std::filesystem;

const std::string kFile = std::string(ROBOMOSP_PLUGIN_DIR) + "/robot_code_c.so";
const fs::path kFolder = fs::path(ROBOMOSP_BUILD_DIR) / "robot_code";

/// What providers of this test run: the compiler, without limits.
std::int32_t run_for_provider(const rmp_program* p, char*, std::uint32_t) {
  std::vector<std::string> command{p->name};
  command.insert(command.end(), p->arguments, p->arguments + p->argument_count);
  return run_program(command) ? 0 : 2;
}

/// The compiled libraries are kept between runs of the tests; the provider checks them.
const bool kReady = [] {
  fs::create_directories(kFolder);
  setenv("XDG_CACHE_HOME", kFolder.c_str(), 1);
  host().run = &run_for_provider;
  return true;
}();

RobotModel sprung_tree() {
  RobotModel m = tree();
  m.joints[2].spring = {15, 0.4};
  return m;
}

INSTANTIATE_TEST_SUITE_P(Compiled, DynamicsConformance,
                         testing::ValuesIn(dynamics_cases(kFile, "compiled", "compiled",
                                                          {puma560(), scara(), sprung_tree(),
                                                           floating_manipulator()})),
                         dynamics_case_name);

/// Arms on a floating base beside a chain: so many velocities that the inertia matrix is filled and
/// factorized by loops, and operations enough for several functions.
RobotModel grove() {
  RobotModel m = floating_manipulator();
  m.name = "grove";
  const auto add = [&](const RobotModel& other, std::int32_t on) {
    const auto before = static_cast<std::int32_t>(m.joints.size());
    for (JointModel j : other.joints) {
      j.parent = j.parent < 0 ? on : j.parent + before;
      if (j.is_coupled()) j.coupling.of += before;
      j.name += " of " + other.name;
      m.joints.push_back(std::move(j));
    }
    for (TipModel t : other.tips) {
      t.joint += before;
      m.tips.push_back(std::move(t));
    }
  };
  add(panda(), 3);
  add(tree(), 0);
  add(floating_manipulator(), -1);
  m.number_coordinates();
  return m;
}

std::vector<CodeFile> generated(const RobotModel& m, const std::string& name,
                                std::uint32_t parts = kCodeAll) {
  const rmp_provider* provider = *find_provider<RobotCodeGenerator>(kFile, "c99");
  NoProgress none;
  auto files =
      create<RobotCodeGenerator>(*provider)->generate(m, name, parts, TableParams(*provider), none);
  EXPECT_TRUE(files.ok()) << (files.ok() ? "" : files.error().sentence());
  return files.ok() ? *files : std::vector<CodeFile>{};
}

/// A library of the code in a folder, compiled as a user would.
void* compiled(const fs::path& folder, const std::string& name, const char* speed) {
  const std::string source = (folder / (name + ".c")).string(), to = (folder / "lib.so").string();
  EXPECT_TRUE(run_program({"cc", "-std=c99", "-pedantic", "-Wall", "-Wextra", "-Werror", speed,
                           "-fPIC", "-shared", "-o", to, source, "-lm"}));
  void* opened = dlopen(to.c_str(), RTLD_NOW | RTLD_LOCAL);
  EXPECT_NE(opened, nullptr) << dlerror();
  return opened;
}
void* library(const RobotModel& m, const std::string& name, std::uint32_t parts,
              const char* speed = "-O1") {
  const fs::path folder = kFolder / name;
  fs::create_directories(folder);
  for (const CodeFile& f : generated(m, name, parts)) std::ofstream(folder / f.name) << f.text;
  return compiled(folder, name, speed);
}

template <class F>
F symbol(void* opened, const std::string& name) {
  return reinterpret_cast<F>(dlsym(opened, name.c_str()));
}

using Single = void (*)(const double*, double*);
using Batch = void (*)(std::size_t, const double*, double*);

/// A number that the header defines.
std::size_t defined(const fs::path& header, const std::string& word) {
  std::ifstream in(header);
  for (std::string line; std::getline(in, line);)
    if (const auto at = line.find(word + " "); line.starts_with("#define") && at != line.npos)
      return static_cast<std::size_t>(std::stoul(line.substr(at + word.size())));
  ADD_FAILURE() << header << " does not define " << word;
  return 0;
}

/// Calls the functions for single samples; those of dynamics take three arrays.
CodeRunner runner() {
  return [](const fs::path& folder, const std::string& name, RobotCodePart part,
            const std::vector<std::vector<double>>& samples) -> Result<std::vector<double>> {
    using Dynamics = void (*)(const double*, const double*, const double*, double*);
    const fs::path header = folder / (name + ".h");
    const std::size_t nq = defined(header, "_COORDINATES"), n = defined(header, "_DOF"),
                      poses = 12 * defined(header, "_TIPS");
    void* opened = compiled(folder, name, "-O0");
    if (!opened) return error(ErrorCode::io, "the code does not compile");
    const std::string function = name + "_" + part_name(part);
    const std::size_t width = part == kCodeForwardKinematics ? poses
                              : part == kCodeJacobian        ? 6 * n
                              : part == kCodeInertia         ? n * n
                                                             : n;
    std::vector<double> answers(samples.size() * width);
    for (std::size_t i = 0; i < samples.size(); ++i) {
      const double* x = samples[i].data();
      double* out = &answers[i * width];
      if (part == kCodeInverseDynamics || part == kCodeForwardDynamics)
        symbol<Dynamics>(opened, function)(x, x + nq, x + nq + n, out);
      else symbol<Single>(opened, function)(x, out);
    }
    return answers;
  };
}
std::vector<RobotCodeCase> code_cases() {
  std::vector<RobotCodeCase> all;
  for (const RobotModel& m : {scara(), floating_manipulator(), grove()})
    all.push_back({kFile, "c99", runner(), m, kFolder});
  return all;
}
INSTANTIATE_TEST_SUITE_P(C99, RobotCodeConformance, testing::ValuesIn(code_cases()),
                         robot_code_case_name);

void check_kinematics(const RobotModel& m, const std::string& name) {
  ASSERT_TRUE(kReady);
  void* opened = library(m, name, kCodeForwardKinematics | kCodeJacobian);
  ASSERT_NE(opened, nullptr);
  const auto fk = symbol<Single>(opened, name + "_forward_kinematics");
  const auto fk_batch = symbol<Batch>(opened, name + "_forward_kinematics_batch");
  const auto jacobian = symbol<Single>(opened, name + "_jacobian");
  const auto jacobian_batch = symbol<Batch>(opened, name + "_jacobian_batch");
  ASSERT_TRUE(fk && fk_batch && jacobian && jacobian_batch);
  constexpr std::size_t kCount = 37;  // not a multiple of the lanes
  Random random(7);
  const std::size_t nq = m.coordinate_count(), n = m.dof(), poses = 12 * m.tips.size();
  std::vector<double> q;
  for (std::size_t i = 0; i < kCount; ++i)
    for (const double x : random.configuration(m)) q.push_back(x);
  std::vector<double> many(kCount * poses), many_j(kCount * 6 * n), one(poses), one_j(6 * n);
  fk_batch(kCount, q.data(), many.data());
  jacobian_batch(kCount, q.data(), many_j.data());
  std::vector<Pose> frames(m.joints.size());
  std::vector<double> expected_j(6 * n);
  for (std::size_t i = 0; i < kCount; ++i) {
    fk(q.data() + i * nq, one.data());
    jacobian(q.data() + i * nq, one_j.data());
    for (std::size_t t = 0; t < m.tips.size(); ++t) {
      const Pose expected = tip_pose(m, q.data() + i * nq, t);
      for (std::size_t k = 0; k < 12; ++k) {
        const double e = k < 9 ? expected.R[k] : expected.p[k - 9];
        EXPECT_NEAR(one[12 * t + k], e, 1e-13);
        EXPECT_NEAR(many[i * poses + 12 * t + k], e, 1e-13);
      }
    }
    robotics::forward_kinematics(m, {q.data() + i * nq, nq}, frames);
    robotics::geometric_jacobian(m, 0, frames, robotics::JacobianFrame::base, expected_j);
    for (std::size_t c = 0; c < n; ++c)
      for (std::size_t r = 0; r < 6; ++r) {
        EXPECT_NEAR(one_j[r * n + c], expected_j[6 * c + r], 1e-13);
        EXPECT_NEAR(many_j[i * 6 * n + r * n + c], expected_j[6 * c + r], 1e-13);
      }
  }
}

TEST(RobotCode, KinematicsOfAnArmAgreeWithOtherCode) { check_kinematics(panda(), "panda"); }
TEST(RobotCode, KinematicsOfAFloatingTreeAgreeWithOtherCode) {
  check_kinematics(floating_manipulator(), "floating");
}

TEST(RobotCode, AnglesFarFromZeroAreTakenByTheLibrarysSine) {
  const RobotModel m = puma560();
  void* opened = library(m, "far_puma", kCodeAll);
  ASSERT_NE(opened, nullptr);
  const auto fk = symbol<Single>(opened, "far_puma_forward_kinematics");
  const auto batch = symbol<Batch>(opened, "far_puma_forward_kinematics_batch");
  std::vector<double> q(2 * 6, 0.3), single(12), many(24);
  q[7] = 4e7 + 0.1;
  batch(2, q.data(), many.data());
  for (std::size_t i = 0; i < 2; ++i) {
    fk(q.data() + 6 * i, single.data());
    const Pose expected = tip_pose(m, q.data() + 6 * i);
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_NEAR(single[9 + k], expected.p[k], 1e-12);
      EXPECT_NEAR(many[12 * i + 9 + k], expected.p[k], 1e-12);
    }
  }
}

/// Compilers' time grows faster than the length of a function, so that none may be long, and the
/// whole grows with the joints alone.
TEST(RobotCode, CodeOfLongChainsIsShortFunctionsAndGrowsWithTheJoints) {
  std::size_t before = 0;
  for (const int n : {30, 60, 120}) {
    const std::string text = generated(long_chain(n), "chain").at(1).text;
    std::size_t longest = 0, length = 0;
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line); ++length)
      if (line == "}") longest = std::max(longest, std::exchange(length, 0));
    EXPECT_LT(longest, 3000U) << n;
    if (before) {
      EXPECT_LT(text.size(), 2.4 * static_cast<double>(before)) << n;
    }
    before = text.size();
  }
}

/// Samples of a batch beside single ones, where the code is in pieces: side by side, and one by
/// one.
TEST(RobotCode, BatchesOfLongChainsGiveWhatSingleSamplesGive) {
  const int n = 36;
  const RobotModel m = long_chain(n);
  void* opened = library(m, "chain", kCodeInverseDynamics | kCodeForwardDynamics, "-O0");
  ASSERT_NE(opened, nullptr);
  using Dynamics = void (*)(const double*, const double*, const double*, double*);
  using Batches = void (*)(std::size_t, const double*, const double*, const double*, double*);
  constexpr std::size_t kCount = 19, kWidth = 36;
  Random random(11);
  const auto q = random.vector(kCount * kWidth, -1.5, 1.5),
             qd = random.vector(kCount * kWidth, -1, 1),
             qdd = random.vector(kCount * kWidth, -2, 2);
  std::vector<double> tau(q.size()), back(q.size()), one(kWidth);
  symbol<Batches>(opened, "chain_inverse_dynamics_batch")(kCount, q.data(), qd.data(), qdd.data(),
                                                          tau.data());
  symbol<Batches>(opened, "chain_forward_dynamics_batch")(kCount, q.data(), qd.data(), tau.data(),
                                                          back.data());
  for (std::size_t i = 0; i < kCount; ++i) {
    const std::size_t at = i * kWidth;
    symbol<Dynamics>(opened, "chain_inverse_dynamics")(&q[at], &qd[at], &qdd[at], one.data());
    double size = 1;
    for (const double x : one) size = std::max(size, std::fabs(x));
    for (std::size_t k = 0; k < kWidth; ++k) {
      EXPECT_NEAR(tau[at + k], one[k], 1e-13 * size);
      EXPECT_NEAR(back[at + k], qdd[at + k], 1e-8);
    }
  }
}

TEST(RobotCode, PartsAreChosenAndFaultsAreSentences) {
  const auto files = generated(scara(), "part", kCodeInertia);
  ASSERT_EQ(files.size(), 2U);
  EXPECT_EQ(files[0].name, "part.h");
  EXPECT_NE(files[0].text.find("part_inertia_batch"), std::string::npos);
  EXPECT_EQ(files[0].text.find("jacobian("), std::string::npos);

  const rmp_provider* provider = *find_provider<RobotCodeGenerator>(kFile, "c99");
  const auto c99 = create<RobotCodeGenerator>(*provider);
  NoProgress none;
  const auto refused = [&](const RobotModel& m, const char* name, std::uint32_t parts) {
    const auto r = c99->generate(m, name, parts, TableParams(*provider), none);
    return r.ok() ? std::string("it was accepted") : r.error().sentence();
  };
  EXPECT_EQ(refused(scara(), "2fast", kCodeAll),
            "\"2fast\" is not a valid C name. Use letters, digits and underscores, starting with a "
            "letter.");
  RobotModel one_turn = four_bar(1, 0.3, 0.9, 0.7);
  one_turn.loops[0].fixed = kLoopPoint | kLoopRotX;
  EXPECT_NE(refused(one_turn, "bars", kCodeAll).find("constrains a single rotation"),
            std::string::npos);
  EXPECT_EQ(generated(one_turn, "bars", kCodeForwardKinematics | kCodeJacobian).size(), 2U);
  RobotModel long_loop = long_chain(201);
  LoopModel ends;
  ends.name = "ends";
  ends.joint_b = 200;
  ends.fixed = kLoopPoint;
  long_loop.loops.push_back(ends);
  EXPECT_EQ(refused(long_loop, "loop", kCodeInverseDynamics),
            "robot \"chain of 201\": its inverse_dynamics has a matrix of 201 rows, more than the "
            "200 allowed on the stack. Use robot.inverse_dynamics and the provider constrained for "
            "such mechanisms.");
  EXPECT_EQ(refused(scara(), "a", 0), "no part was selected. Choose at least one.");
  EXPECT_NE(refused(long_chain(400), "long", kCodeForwardDynamics).find("operations, more than"),
            std::string::npos);
  RobotModel gantries;
  gantries.name = "gantries";
  for (int i = 0; i < 501; ++i)
    add_joint(gantries, "axis " + std::to_string(i), -1, JointType::prismatic, Pose{},
              body(1, 0, 0, 0, 0.1, 0.1, 0.1));
  gantries.tips = {{"tip", 0, Pose{}}};
  gantries.number_coordinates();
  EXPECT_EQ(
      refused(gantries, "long", kCodeForwardDynamics),
      "robot \"gantries\": its forward_dynamics has a matrix of 501 rows, more than the 500 "
      "allowed on the stack. Use the providers newton_euler and articulated_body for long chains.");
}

}  // namespace
}  // namespace robomosp::conformance
