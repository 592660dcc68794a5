// SPDX-License-Identifier: Apache-2.0
// Conformance suite of robomosp.robot_code/1 (layer: contract helper for tests, GoogleTest,
// header-only, POSIX). The code is written to a folder and run; what it computes is compared with
// the bodies' frames alone (dynamics_reference.h), which is independent of any generator. Include
// it in one file of a test program and instantiate RobotCodeConformance with RobotCodeCase values.
#pragma once

#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <robomosp/sdk/conformance/dynamics_reference.h>
#include <robomosp/sdk/conformance/mechanisms.h>
#include <robomosp/sdk/conformance/provider.h>
#include <robomosp/sdk/conformance/threads.h>
#include <robomosp/sdk/robot_code.h>

namespace robomosp::conformance {

/// Runs one function of the code in `folder`, with names that start with `name`. Inputs of
/// all samples, one after the other: q, or (q, qd, qdd) of inverse_dynamics, or (q, qd, tau) of
/// forward_dynamics; answers likewise: for each tip its rotation row by row and its origin; 6 rows
/// of dof() numbers, (v, w) in the base's axes; dof() rows of dof() numbers.
using CodeRunner = std::function<Result<std::vector<double>>(
    const std::filesystem::path& folder, const std::string& name, RobotCodePart part,
    const std::vector<std::vector<double>>& samples)>;

struct RobotCodeCase {
  std::string file, provider;
  CodeRunner run;
  RobotModel model;
  std::filesystem::path folder;  ///< where the code may be written
};
inline void PrintTo(const RobotCodeCase& c, std::ostream* os) {
  *os << c.provider << " on " << c.model.name;
}
inline std::string robot_code_case_name(const testing::TestParamInfo<RobotCodeCase>& c) {
  std::string s = c.param.provider + "_" + c.param.model.name;
  for (char& x : s)
    if (!std::isalnum(static_cast<unsigned char>(x))) x = '_';
  return s;
}

[[nodiscard]] inline const char* part_name(RobotCodePart part) {
  switch (part) {
    case kCodeForwardKinematics: return "forward_kinematics";
    case kCodeJacobian: return "jacobian";
    case kCodeInverseDynamics: return "inverse_dynamics";
    case kCodeInertia: return "inertia";
    case kCodeForwardDynamics: return "forward_dynamics";
    case kCodeAll: break;
  }
  return "";
}

/// Runs a program by the shell; standard input and output are files. True when it went well.
inline bool run_program(const std::vector<std::string>& command,
                        const std::filesystem::path& input = "/dev/null",
                        const std::filesystem::path& output = "/dev/null") {
  const auto quoted = [](const std::string& word) {
    std::string s = "'";
    for (const char c : word) s += c == '\'' ? std::string("'\\''") : std::string(1, c);
    return s + "' ";
  };
  std::string line;
  for (const std::string& word : command) line += quoted(word);
  line += "< " + quoted(input.string()) + "> " + quoted(output.string());
  return std::system(line.c_str()) == 0;
}

/// A runner by a program of yours: `command... FOLDER NAME FUNCTION` reads a sample a line from its
/// standard input, numbers with spaces between, and writes the answer of each as a line.
[[nodiscard]] inline CodeRunner run_by(std::vector<std::string> command) {
  return [command = std::move(command)](
             const std::filesystem::path& folder, const std::string& name, RobotCodePart part,
             const std::vector<std::vector<double>>& samples) -> Result<std::vector<double>> {
    const auto input = folder / "samples.txt", output = folder / "answers.txt";
    {
      std::ofstream out(input);
      out.precision(17);
      for (const auto& sample : samples) {
        for (const double x : sample) out << x << ' ';
        out << '\n';
      }
    }
    std::vector<std::string> all = command;
    all.insert(all.end(), {folder.string(), name, part_name(part)});
    if (!run_program(all, input, output))
      return error(ErrorCode::io,
                   "the runner \"" + command[0] + "\" failed for " + part_name(part));
    std::ifstream in(output);
    std::vector<double> answers;
    for (std::string word; in >> word;) answers.push_back(std::strtod(word.c_str(), nullptr));
    return answers;
  };
}

class RobotCodeConformance : public testing::TestWithParam<RobotCodeCase> {
 protected:
  static constexpr std::size_t kSamples = 7;

  void SetUp() override {
    auto found = find_provider<RobotCodeGenerator>(GetParam().file, GetParam().provider);
    ASSERT_TRUE(found.ok()) << found.error().sentence();
    provider_ = *found;
    generator_ = create<RobotCodeGenerator>(**found);
    ASSERT_NE(generator_, nullptr);
  }
  [[nodiscard]] const RobotModel& model() const { return GetParam().model; }
  [[nodiscard]] std::size_t n() const { return model().dof(); }

  Result<std::vector<CodeFile>> generate(const RobotModel& m, const std::string& name,
                                         std::uint32_t parts) {
    NoProgress none;
    return generator_->generate(m, name, parts, TableParams(*provider_), none);
  }
  /// Writes the code of one part and runs it; empty where the part is refused as unsupported.
  std::vector<double> run(const RobotModel& m, RobotCodePart part,
                          const std::vector<std::vector<double>>& samples, std::size_t width) {
    auto files = generate(m, "robot_under_test", part);
    if (!files.ok()) {
      EXPECT_EQ(files.error().code, ErrorCode::unsupported) << files.error().sentence();
      return {};
    }
    const auto folder = GetParam().folder / GetParam().provider / m.name / part_name(part);
    std::filesystem::create_directories(folder);
    for (const CodeFile& f : *files) std::ofstream(folder / f.name) << f.text;
    auto answers = GetParam().run(folder, "robot_under_test", part, samples);
    EXPECT_TRUE(answers.ok()) << (answers.ok() ? "" : answers.error().sentence());
    if (!answers.ok()) return std::vector<double>(samples.size() * width);
    EXPECT_EQ(answers->size(), samples.size() * width) << part_name(part);
    answers->resize(samples.size() * width);
    return std::move(*answers);
  }
  std::vector<double> run(RobotCodePart part, const std::vector<std::vector<double>>& samples,
                          std::size_t width) {
    return run(model(), part, samples, width);
  }
  static std::vector<double> joined(std::vector<double> a,
                                    std::initializer_list<std::vector<double>> more) {
    for (const auto& b : more) a.insert(a.end(), b.begin(), b.end());
    return a;
  }
  /// Whether the generator says that it writes dynamics of closed loops.
  [[nodiscard]] bool knows_loops() const {
    return ("," + std::string(provider_->tags) + ",").find(",loops,") != std::string::npos;
  }
  /// Torques of all parts: Kane's equations, springs and friction.
  [[nodiscard]] std::vector<double> torques(const std::vector<double>& q,
                                            const std::vector<double>& qd,
                                            const std::vector<double>& qdd) const {
    return torques(model(), q, qd, qdd);
  }
  [[nodiscard]] static std::vector<double> torques(const RobotModel& m,
                                                   const std::vector<double>& q,
                                                   const std::vector<double>& qd,
                                                   const std::vector<double>& qdd) {
    auto tau = kane_torques(m, q, qd, qdd);
    const auto spring = gradient(m, q, spring_energy);
    for (std::size_t k = 0; k < tau.size(); ++k) tau[k] += spring[k];
    for (const JointModel& j : m.joints) {
      if (robomosp::velocity_count(j.type) != 1) continue;
      const double ratio = j.is_coupled() ? j.coupling.ratio : 1;
      const auto v = static_cast<std::size_t>(j.v_index);
      const double rate = ratio * qd[v];
      tau[v] += ratio * (j.friction.viscous * rate + (rate > 1e-9    ? j.friction.coulomb_positive
                                                      : rate < -1e-9 ? j.friction.coulomb_negative
                                                                     : 0));
    }
    return tau;
  }
  static double size_of(const std::vector<double>& v) {
    double size = 1;
    for (const double x : v) size = std::max(size, std::fabs(x));
    return size;
  }
  const rmp_provider* provider_ = nullptr;
  std::unique_ptr<RobotCodeGenerator> generator_;
  Random random_{29};
};
GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(RobotCodeConformance);

TEST_P(RobotCodeConformance, TipsAreWhereTheJointsPutThem) {
  std::vector<std::vector<double>> samples;
  for (std::size_t i = 0; i < kSamples; ++i) samples.push_back(random_.configuration(model()));
  const std::size_t tips = model().tips.size();
  const auto answers = run(kCodeForwardKinematics, samples, 12 * tips);
  if (answers.empty()) GTEST_SKIP() << "it does not generate this part";
  for (std::size_t i = 0; i < samples.size(); ++i)
    for (std::size_t t = 0; t < tips; ++t) {
      const Pose expected = tip_pose(model(), samples[i].data(), t);
      const double* at = &answers[12 * (i * tips + t)];
      for (std::size_t k = 0; k < 9; ++k) ASSERT_NEAR(at[k], expected.R[k], 1e-12) << "tip " << t;
      for (std::size_t k = 0; k < 3; ++k)
        ASSERT_NEAR(at[9 + k], expected.p[k], 1e-12) << "tip " << t;
    }
}

TEST_P(RobotCodeConformance, TheJacobianIsTheDerivativeOfTheTipsPose) {
  std::vector<std::vector<double>> samples;
  for (std::size_t i = 0; i < kSamples; ++i) samples.push_back(random_.configuration(model()));
  const auto answers = run(kCodeJacobian, samples, 6 * n());
  if (answers.empty()) GTEST_SKIP() << "it does not generate this part";
  for (std::size_t i = 0; i < samples.size(); ++i)
    for (std::size_t c = 0; c < n(); ++c)
      for (std::size_t r = 0; r < 6; ++r) {
        const double slope = difference(
            [&](double h) {
              const Pose now = tip_pose(model(), samples[i].data());
              const Pose at = tip_pose(model(), nudged(model(), samples[i], c, h).data());
              if (r < 3) return at.p[r];
              double W[9] = {};  // R(h) R^T
              for (std::size_t a = 0; a < 3; ++a)
                for (std::size_t b = 0; b < 3; ++b)
                  for (std::size_t k = 0; k < 3; ++k)
                    W[3 * a + b] += at.R[3 * a + k] * now.R[3 * b + k];
              return r == 3 ? (W[7] - W[5]) / 2 : r == 4 ? (W[2] - W[6]) / 2 : (W[3] - W[1]) / 2;
            },
            1e-3);
        ASSERT_NEAR(answers[(i * 6 + r) * n() + c], slope, 1e-9) << "row " << r << " column " << c;
      }
}

TEST_P(RobotCodeConformance, TorquesSatisfyKanesEquationsWithSpringsAndFriction) {
  std::vector<std::vector<double>> q, qd, qdd, samples;
  for (std::size_t i = 0; i < kSamples; ++i) {
    q.push_back(random_.configuration(model()));
    // The first sample at rest, where there is no Coulomb friction.
    qd.push_back(i == 0 ? std::vector<double>(n()) : random_.vector(n(), -1, 1));
    qdd.push_back(random_.vector(n(), -2, 2));
    samples.push_back(joined(q[i], {qd[i], qdd[i]}));
  }
  const auto answers = run(kCodeInverseDynamics, samples, n());
  if (answers.empty()) GTEST_SKIP() << "it does not generate this part";
  for (std::size_t i = 0; i < kSamples; ++i) {
    const auto expected = torques(q[i], qd[i], qdd[i]);
    for (std::size_t k = 0; k < n(); ++k)
      ASSERT_NEAR(answers[i * n() + k], expected[k], 1e-7 * size_of(expected)) << "entry " << k + 1;
  }
}

TEST_P(RobotCodeConformance, TheInertiaGivesTheKineticEnergy) {
  std::vector<std::vector<double>> samples;
  for (std::size_t i = 0; i < kSamples; ++i) samples.push_back(random_.configuration(model()));
  const auto answers = run(kCodeInertia, samples, n() * n());
  if (answers.empty()) GTEST_SKIP() << "it does not generate this part";
  for (std::size_t i = 0; i < kSamples; ++i) {
    const double* M = &answers[i * n() * n()];
    for (int trial = 0; trial < 4; ++trial) {
      const auto qd = random_.vector(n(), -1, 1);
      double twice = 0;
      for (std::size_t r = 0; r < n(); ++r)
        for (std::size_t c = 0; c < n(); ++c) twice += qd[r] * M[r * n() + c] * qd[c];
      const double expected = kinetic_energy(model(), samples[i], qd);
      ASSERT_NEAR(twice / 2, expected, 1e-8 * std::max(1.0, expected));
    }
    for (std::size_t r = 0; r < n(); ++r)
      for (std::size_t c = 0; c < r; ++c)
        ASSERT_NEAR(M[r * n() + c], M[c * n() + r], 1e-12 * size_of(answers));
  }
}

TEST_P(RobotCodeConformance, AccelerationsAnswerTheTorques) {
  std::vector<std::vector<double>> q, qd, samples;
  const auto tau = random_.vector(n(), -5, 5);
  for (std::size_t i = 0; i < kSamples; ++i) {
    q.push_back(random_.configuration(model()));
    qd.push_back(random_.vector(n(), -1, 1));
    samples.push_back(joined(q[i], {qd[i], tau}));
  }
  const auto answers = run(kCodeForwardDynamics, samples, n());
  if (answers.empty()) GTEST_SKIP() << "it does not generate this part";
  for (std::size_t i = 0; i < kSamples; ++i) {
    const std::vector<double> qdd(answers.begin() + static_cast<std::ptrdiff_t>(i * n()),
                                  answers.begin() + static_cast<std::ptrdiff_t>((i + 1) * n()));
    const auto back = torques(q[i], qd[i], qdd);
    for (std::size_t k = 0; k < n(); ++k)
      ASSERT_NEAR(back[k], tau[k], 1e-6 * size_of(back)) << "entry " << k + 1;
  }
}

// A four-bar with one motor, with springs and friction at joints without motors, and one with a
// motor at each joint. Judged by Kane's equations of the tree and equal work on the motions that
// keep the loop closed.
TEST_P(RobotCodeConformance, DynamicsOfClosedLoopsAreThoseOfTheMotors) {
  if (!knows_loops()) GTEST_SKIP() << "it has no tag \"loops\"";
  for (const bool all : {false, true}) {
    RobotModel m = four_bar(1, 0.3, 0.9, 0.7);
    m.name = all ? "bars with three motors" : "bars with one motor";
    m.gravity = {0, -9.81, 0};  // in their plane
    for (std::size_t k = 0; k < m.joints.size(); ++k) {
      m.joints[k].passive = k > 0 && !all;
      m.joints[k].spring = {2, 0.3};
      m.joints[k].friction = {0.1, 0.2, -0.3};
    }
    const std::size_t n = m.dof();
    std::vector<std::vector<double>> q, qd, qdd, states, samples;
    for (int i = 0; i < 5; ++i) {
      q.push_back(closed_near(m, random_.configuration(m)));
      for (const double r : loop_residuals(m, q.back())) ASSERT_LT(std::fabs(r), 1e-11);
      qd.push_back(velocities_that_close(m, q.back(), random_.vector(n, -1, 1)));
      // What the rates alone do to the loop, and accelerations that undo it.
      const auto gap = [&](double t) {
        return loop_residuals(m, moved_on(m, q.back(), qd.back(), std::vector<double>(n), t));
      };
      const double h = 1e-2;
      const auto u = gap(h), d = gap(-h), uu = gap(2 * h), dd = gap(-2 * h);
      const auto J = loop_jacobian(m, q.back());
      auto x = velocities_that_close(m, q.back(), random_.vector(n, -2, 2));
      std::vector<double> drift(u.size());
      for (std::size_t r = 0; r < drift.size(); ++r)
        drift[r] = (16 * (u[r] + d[r]) - (uu[r] + dd[r])) / (12 * h * h);
      const auto step = least_step(J, drift);
      for (std::size_t k = 0; k < n; ++k) x[k] -= step[k];
      qdd.push_back(x);
      states.push_back(q.back());
      samples.push_back(joined(q.back(), {qd.back(), qdd.back()}));
    }
    const auto tau = run(m, kCodeInverseDynamics, samples, n);
    const auto inertia = run(m, kCodeInertia, states, n * n);
    ASSERT_FALSE(tau.empty() || inertia.empty()) << "the tag \"loops\" promises these parts";
    std::vector<std::vector<double>> driven;
    for (std::size_t i = 0; i < samples.size(); ++i) {
      const std::vector<double> f(tau.begin() + static_cast<std::ptrdiff_t>(i * n),
                                  tau.begin() + static_cast<std::ptrdiff_t>((i + 1) * n));
      driven.push_back(joined(q[i], {qd[i], f}));
      const auto tree = torques(m, q[i], qd[i], qdd[i]);
      const auto J = loop_jacobian(m, q[i]);
      const auto v = velocities_that_close(m, q[i], random_.vector(n, -1, 1));
      double work = 0, expected = 0, twice = 0, size = size_of(tree);
      for (std::size_t r = 0; r < n; ++r) {
        work += f[r] * v[r], expected += tree[r] * v[r];
        for (std::size_t c = 0; c < n; ++c) twice += v[r] * inertia[(i * n + r) * n + c] * v[c];
      }
      ASSERT_NEAR(work, expected, 1e-6 * size) << m.name;
      const double kinetic = kinetic_energy(m, q[i], v);
      ASSERT_NEAR(twice / 2, kinetic, 1e-8 * std::max(1.0, kinetic)) << m.name;
      for (std::size_t r = 0; r < n; ++r)
        if (m.joints[r].passive) {
          ASSERT_EQ(f[r], 0) << m.name;
        }
      for (const auto& row : J) {  // the least forces do not press on the loop
        double along = 0;
        for (std::size_t r = 0; all && r < n; ++r) along += row[r] * f[r];
        ASSERT_NEAR(along, 0, 1e-6 * size) << m.name;
      }
    }
    const auto back = run(m, kCodeForwardDynamics, driven, n);
    ASSERT_FALSE(back.empty()) << "the tag \"loops\" promises this part";
    for (std::size_t i = 0; i < samples.size(); ++i)
      for (std::size_t k = 0; k < n; ++k)
        ASSERT_NEAR(back[i * n + k], qdd[i][k], 1e-6 * size_of(qdd[i])) << m.name;
  }
}

TEST_P(RobotCodeConformance, WhateverTheNamesSayTheCodeRuns) {
  RobotModel m = model();
  for (JointModel& j : m.joints) j.name = "\"'*/ \\ \"\"\" \n #endif ]]--";
  for (TipModel& t : m.tips) t.name = m.joints[0].name;
  const std::vector<std::vector<double>> samples{random_.configuration(m)};
  const std::string plain = m.name;
  const auto expected = tip_pose(m, samples[0].data());
  auto files = generate(m, "robot_under_test", kCodeForwardKinematics);
  if (!files.ok()) GTEST_SKIP() << files.error().sentence();
  RobotModel evil = m;
  evil.name = m.joints[0].name;
  files = generate(evil, "robot_under_test", kCodeForwardKinematics);
  ASSERT_TRUE(files.ok()) << files.error().sentence();
  const auto folder = GetParam().folder / GetParam().provider / plain / "names";
  std::filesystem::create_directories(folder);
  for (const CodeFile& f : *files) std::ofstream(folder / f.name) << f.text;
  const auto answers = GetParam().run(folder, "robot_under_test", kCodeForwardKinematics, samples);
  ASSERT_TRUE(answers.ok()) << answers.error().sentence();
  ASSERT_EQ(answers->size(), 12 * m.tips.size());
  for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR((*answers)[9 + k], expected.p[k], 1e-12);
}

TEST_P(RobotCodeConformance, FilesHavePlainNamesAndEqualRobotsGiveEqualText) {
  const auto files = generate(model(), "my_arm", kCodeForwardKinematics);
  if (!files.ok()) GTEST_SKIP() << files.error().sentence();
  ASSERT_FALSE(files->empty());
  for (const CodeFile& f : *files) {
    EXPECT_EQ(f.name.rfind("my_arm", 0), 0U) << f.name << " does not start with the name";
    EXPECT_EQ(f.name.find('/'), std::string::npos) << f.name;
    ASSERT_FALSE(f.text.empty()) << f.name;
    EXPECT_EQ(f.text.back(), '\n') << f.name;
  }
  const auto again = generate(model(), "my_arm", kCodeForwardKinematics);
  ASSERT_TRUE(again.ok());
  ASSERT_EQ(again->size(), files->size());
  for (std::size_t i = 0; i < files->size(); ++i) EXPECT_EQ((*again)[i].text, (*files)[i].text);
  // A robot that is another one gives other text.
  RobotModel longer = model();
  longer.tips[0].tool.p[0] += 0.125;
  const auto other = generate(longer, "my_arm", kCodeForwardKinematics);
  ASSERT_TRUE(other.ok());
  bool differs = false;
  for (std::size_t i = 0; i < files->size() && i < other->size(); ++i)
    differs = differs || (*other)[i].text != (*files)[i].text;
  EXPECT_TRUE(differs);
}

TEST_P(RobotCodeConformance, SeveralThreadsGenerateTheSameTextAtOnce) {
  const auto alone = generate(model(), "robot", kCodeForwardKinematics);
  if (!alone.ok()) GTEST_SKIP() << alone.error().sentence();
  at_once(4, [&](std::size_t) {
    const auto files = generate(model(), "robot", kCodeForwardKinematics);
    EXPECT_TRUE(files.ok());
    if (!files.ok()) return;
    EXPECT_EQ(files->size(), alone->size());
    for (std::size_t i = 0; i < std::min(files->size(), alone->size()); ++i)
      EXPECT_EQ((*files)[i].text, (*alone)[i].text);
  });
}

TEST_P(RobotCodeConformance, WhatCannotBeGeneratedIsRefusedWithASentence) {
  const auto refused = [&](const RobotModel& m, const std::string& name, std::uint32_t parts,
                           const char* why) {
    const auto files = generate(m, name, parts);
    ASSERT_FALSE(files.ok()) << why;
    EXPECT_FALSE(files.error().message.empty()) << why;
    EXPECT_FALSE(files.error().hint.empty()) << why << ": " << files.error().sentence();
  };
  for (const char* name : {"", "2fast", "a b", "a-b", "../up", "a\"b", "\xc3\xa4rm"})
    refused(model(), name, kCodeForwardKinematics, name);
  refused(model(), "arm", 0, "no part");
  if (!knows_loops())
    for (const std::uint32_t part : {kCodeInverseDynamics, kCodeInertia, kCodeForwardDynamics})
      refused(four_bar(1, 0.3, 0.9, 0.7), "bars", part,
              "dynamics that leave the loops open are wrong");
  CancelledProgress stop;
  const auto stopped =
      generator_->generate(model(), "arm", kCodeForwardKinematics, TableParams(*provider_), stop);
  ASSERT_FALSE(stopped.ok());
  EXPECT_TRUE(stopped.error().code == ErrorCode::cancelled ||
              stopped.error().code == ErrorCode::unsupported);
}

}  // namespace robomosp::conformance
