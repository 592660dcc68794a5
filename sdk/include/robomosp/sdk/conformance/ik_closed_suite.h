// SPDX-License-Identifier: Apache-2.0
// Conformance of providers of robomosp.ik/1 that claim all solutions and exact reasons: closed
// forms (layer: contract helper for tests, GoogleTest, header-only). Instantiate beside
// IkConformance:
//   INSTANTIATE_TEST_SUITE_P(Mine, IkClosedForm, testing::ValuesIn(ik_cases("my_ik.so", "my_ik",
//                            {within_one_turn(puma560())}, "ik_numeric.so")), ik_case_name);
#pragma once

#include <robomosp/sdk/conformance/ik_suite.h>

namespace robomosp::conformance {

/// Angles of joints apart, whole turns not counted [rad]; lengths as they are.
[[nodiscard]] inline double apart(const RobotModel& m, const double* a, const double* b) {
  double most = 0;
  for (std::size_t j = 0; j < m.joints.size(); ++j) {
    const double d = a[j] - b[j];
    most = std::max(
        most, std::fabs(m.joints[j].type == JointType::revolute ? std::remainder(d, 2 * kPi) : d));
  }
  return most;
}

/// A search of configurations of simple mechanisms, with no regard to how it is solved in closed
/// form: Levenberg-Marquardt from a start, within limits up to whole turns.
class IkSearch {
 public:
  explicit IkSearch(const RobotModel& m) : m_(m), n_(m.dof()) {
    for (const JointModel& j : m.joints)
      size_ += std::hypot(j.placement.p[0], j.placement.p[1], j.placement.p[2]);
    size_ = std::max(size_, 1e-3);
  }
  /// q becomes a solution within limits; false when none was found from there.
  bool solve(const Pose& target, std::vector<double>& q) const {
    double lambda = 1e-3, error = INFINITY;
    for (int step = 0; step < 100; ++step) {
      const auto e = residual(target, q);
      error = norm(e);
      if (error < 1e-11) return unwrap(q);
      const auto J = jacobian(q);
      std::vector<double> g(n_), a(n_ * n_);
      for (std::size_t i = 0; i < n_; ++i)
        for (std::size_t r = 0; r < 6; ++r) g[i] += J[r * n_ + i] * e[r];
      bool is_better = false;
      for (int tries = 0; tries < 12 && !is_better; ++tries) {
        for (std::size_t i = 0; i < n_; ++i)
          for (std::size_t k = 0; k < n_; ++k) {
            a[i * n_ + k] = i == k ? lambda : 0;
            for (std::size_t r = 0; r < 6; ++r) a[i * n_ + k] += J[r * n_ + i] * J[r * n_ + k];
          }
        auto moved = q;
        const auto d = linear(a, g);
        for (std::size_t i = 0; i < n_; ++i) moved[i] += d[i];
        is_better = norm(residual(target, moved)) < error;
        if (is_better) q = moved;
        lambda = is_better ? std::max(lambda / 10, 1e-14) : lambda * 10;
      }
      if (!is_better) return error < 1e-10 && unwrap(q);
    }
    return false;
  }
  /// Least pivot of J^T J or, for a redundant arm, of J J^T: 0 where the mechanism is singular.
  double smallest(const std::vector<double>& q) const {
    const auto J = jacobian(q);
    const std::size_t k = std::min<std::size_t>(n_, 6);
    std::vector<double> a(k * k);
    for (std::size_t i = 0; i < k; ++i)
      for (std::size_t j = 0; j < k; ++j)
        for (std::size_t s = 0; s < (n_ > 6 ? n_ : 6); ++s)
          a[i * k + j] += n_ > 6 ? J[i * n_ + s] * J[j * n_ + s] : J[s * n_ + i] * J[s * n_ + j];
    double least = INFINITY;
    for (std::size_t c = 0; c < k; ++c) {  // Cholesky
      double d = a[c * k + c];
      least = std::min(least, d);
      if (!(d > 0)) return 0;
      for (std::size_t r = c + 1; r < k; ++r)
        for (std::size_t x = c + 1; x < k; ++x) a[r * k + x] -= a[r * k + c] * a[c * k + x] / d;
    }
    return std::sqrt(least);
  }

 private:
  using Six = std::array<double, 6>;
  static double norm(const Six& e) {
    double s = 0;
    for (const double x : e) s += x * x;
    return std::sqrt(s);
  }
  Six residual(const Pose& target, const std::vector<double>& q) const {
    const Pose at = tip_pose(m_, q.data());
    // D = R_target R_at^T; its rotation vector, lengths in arm lengths.
    double D[9] = {};
    for (std::size_t r = 0; r < 3; ++r)
      for (std::size_t c = 0; c < 3; ++c)
        for (std::size_t k = 0; k < 3; ++k) D[3 * r + c] += target.R[3 * r + k] * at.R[3 * c + k];
    const Vec3 v{(D[7] - D[5]) / 2, (D[2] - D[6]) / 2, (D[3] - D[1]) / 2};
    const double s = std::hypot(v[0], v[1], v[2]), c = (D[0] + D[4] + D[8] - 1) / 2;
    const double scale = s > 1e-12 ? std::atan2(s, c) / s : 1;
    Six e{};
    for (std::size_t k = 0; k < 3; ++k) {
      e[k] = (target.p[k] - at.p[k]) / size_;
      e[3 + k] = scale * v[k];
    }
    if (s <= 1e-12 && c < 0) e[3] = kPi;  // half a turn: any axis leads on
    return e;
  }
  /// 6 rows of n.
  std::vector<double> jacobian(const std::vector<double>& q) const {
    const auto frames = joint_frames(m_, q.data());
    const Pose tip = tip_pose(m_, q.data());
    std::vector<double> J(6 * n_);
    for (std::int32_t j = m_.tips[0].joint; j >= 0;
         j = m_.joints[static_cast<std::size_t>(j)].parent) {
      const auto i = static_cast<std::size_t>(j);
      const Pose& f = frames[i];
      const Vec3 z{f.R[2], f.R[5], f.R[8]},
          d{tip.p[0] - f.p[0], tip.p[1] - f.p[1], tip.p[2] - f.p[2]};
      const Vec3 across{z[1] * d[2] - z[2] * d[1], z[2] * d[0] - z[0] * d[2],
                        z[0] * d[1] - z[1] * d[0]};
      const bool turns = m_.joints[i].type == JointType::revolute;
      for (std::size_t k = 0; k < 3; ++k) {
        J[k * n_ + i] = (turns ? across[k] : z[k]) / size_;
        J[(3 + k) * n_ + i] = turns ? z[k] : 0;
      }
    }
    return J;
  }
  /// x of a x = b, by elimination with pivots; a pivot of zero gives zero.
  static std::vector<double> linear(std::vector<double> a, std::vector<double> b) {
    const std::size_t n = b.size();
    for (std::size_t c = 0; c < n; ++c) {
      std::size_t pivot = c;
      for (std::size_t r = c; r < n; ++r)
        if (std::fabs(a[r * n + c]) > std::fabs(a[pivot * n + c])) pivot = r;
      for (std::size_t k = 0; k < n; ++k) std::swap(a[pivot * n + k], a[c * n + k]);
      std::swap(b[pivot], b[c]);
      if (a[c * n + c] == 0) continue;
      for (std::size_t r = c + 1; r < n; ++r) {
        const double f = a[r * n + c] / a[c * n + c];
        for (std::size_t k = c; k < n; ++k) a[r * n + k] -= f * a[c * n + k];
        b[r] -= f * b[c];
      }
    }
    for (std::size_t c = n; c-- > 0;) {
      for (std::size_t k = c + 1; k < n; ++k) b[c] -= a[c * n + k] * b[k];
      b[c] = a[c * n + c] == 0 ? 0 : b[c] / a[c * n + c];
    }
    return b;
  }
  /// Whole turns away, within the limits.
  bool unwrap(std::vector<double>& q) const {
    for (std::size_t j = 0; j < n_; ++j) {
      const JointModel& joint = m_.joints[j];
      if (joint.type == JointType::revolute) {
        q[j] = std::remainder(q[j], 2 * kPi);
        if (q[j] < joint.lower) q[j] += 2 * kPi;
        if (q[j] > joint.upper) q[j] -= 2 * kPi;
      }
      // Not on the edge, where rounding decides.
      if (q[j] < joint.lower + 1e-9 || q[j] > joint.upper - 1e-9) return false;
    }
    return true;
  }

  const RobotModel& m_;
  std::size_t n_;
  double size_ = 0;
};

[[nodiscard]] inline std::string text_of(const std::vector<double>& q) {
  std::string s = "q =";
  for (const double x : q) s += " " + std::to_string(x);
  return s;
}

class IkClosedForm : public IkConformance {
 protected:
  /// A configuration away from singular ones: no two solutions are near each other there.
  std::vector<double> regular_configuration(Random& random) {
    for (;;) {
      std::vector<double> q = random.configuration(model());
      if (std::fabs(determinant(q)) > 0.02) return q;
    }
  }
  /// det(J J^T) with lengths in arm lengths, by differences.
  double determinant(const std::vector<double>& q) const {
    const std::size_t n = dof();
    double length = 0;
    for (const JointModel& j : model().joints)
      length += std::hypot(j.placement.p[0], j.placement.p[1], j.placement.p[2]);
    std::vector<std::array<double, 6>> columns(n);
    for (std::size_t j = 0; j < n; ++j) {
      std::vector<double> a = q, b = q;
      a[j] -= 1e-5, b[j] += 1e-5;
      const Pose pa = tip_pose(model(), a.data()), pb = tip_pose(model(), b.data());
      for (std::size_t k = 0; k < 3; ++k) columns[j][k] = (pb.p[k] - pa.p[k]) / 2e-5 / length;
      const auto turn = [&](std::size_t r, std::size_t c) {
        double s = 0;
        for (std::size_t k = 0; k < 3; ++k)
          s += (pb.R[3 * r + k] - pa.R[3 * r + k]) * pa.R[3 * c + k];
        return s / 2e-5;
      };
      columns[j][3] = turn(2, 1), columns[j][4] = turn(0, 2), columns[j][5] = turn(1, 0);
    }
    std::array<std::array<double, 6>, 6> a{};
    for (std::size_t r = 0; r < 6; ++r)
      for (std::size_t c = 0; c < 6; ++c)
        for (const auto& column : columns) a[r][c] += column[r] * column[c];
    double det = 1;
    for (std::size_t c = 0; c < 6; ++c) {
      std::size_t pivot = c;
      for (std::size_t r = c; r < 6; ++r)
        if (std::fabs(a[r][c]) > std::fabs(a[pivot][c])) pivot = r;
      std::swap(a[pivot], a[c]);
      det *= a[c][c];
      if (det == 0) return 0;
      for (std::size_t r = c + 1; r < 6; ++r)
        for (std::size_t k = 6; k-- > c;) a[r][k] -= a[c][k] * a[r][c] / a[c][c];
    }
    return std::sqrt(std::fabs(det));
  }
};
GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(IkClosedForm);

TEST_P(IkClosedForm, SolutionsAreExactAndDistinctAndTheNearestComesFirst) {
  Random random(kSeed + 10);
  for (int i = 0; i < 300; ++i) {
    SCOPED_TRACE("target " + std::to_string(i));
    const std::vector<double> q = random.configuration(model());
    const std::vector<double> seed = random.configuration(model());
    const Pose target[] = {tip_pose(model(), q.data())};
    IkBatch batch;
    batch.targets = target;
    batch.all_solutions = true;
    batch.seeds = seed;
    const auto r = solve(batch);
    ASSERT_EQ(r[0].status, IkStatus::solved) << r[0].detail;
    expect_within_limits(r[0]);
    IkTolerance exact;
    exact.position = exact.rotation = 2e-12;
    expect_reaches(target[0], r[0], exact);
    const std::size_t n = dof(), count = r[0].q.size() / n;
    double first = 0;
    for (std::size_t k = 0; k < count; ++k) {
      double far = 0;
      for (std::size_t j = 0; j < n; ++j) far += std::pow(r[0].q[k * n + j] - seed[j], 2);
      if (k == 0) first = far;
      EXPECT_GE(far, first - 1e-9) << "solution " << k + 1 << " is nearer to the seed";
      for (std::size_t m = 0; m < k; ++m) {
        double most = 0;
        for (std::size_t j = 0; j < n; ++j)
          most = std::max(most, std::fabs(r[0].q[k * n + j] - r[0].q[m * n + j]));
        EXPECT_GT(most, 1e-9) << "solutions " << m + 1 << " and " << k + 1 << " are one";
      }
    }
    if (n != 6) continue;  // a redundant arm gives samples of its solutions
    double least = INFINITY;
    for (std::size_t k = 0; k < count; ++k)
      least = std::min(least, apart(model(), &r[0].q[k * n], q.data()));
    EXPECT_LT(least, 1e-5) << "the configuration that the target was made of is missing";
  }
}

TEST_P(IkClosedForm, NoSolutionIsMissingThatASearchFromManyStartsFinds) {
  if (GetParam().oracle.empty()) GTEST_SKIP() << "no numeric provider to compare with";
  if (dof() != 6) GTEST_SKIP() << "a redundant arm has infinitely many";
  const auto found = find_provider<IkSolver>(GetParam().oracle, "numeric");
  ASSERT_TRUE(found.ok()) << found.error().sentence();
  const auto oracle = create<IkSolver>(**found);
  TableParams params(**found);
  params.set("restarts", 60.0);
  ASSERT_TRUE(oracle->prepare(model(), params).ok());
  Random random(kSeed + 11);
  NoProgress none;
  std::size_t most = 0;
  for (int i = 0; i < 4; ++i) {
    SCOPED_TRACE("target " + std::to_string(i));
    const std::vector<double> q = regular_configuration(random);
    const Pose target[] = {tip_pose(model(), q.data())};
    IkBatch batch;
    batch.targets = target;
    batch.all_solutions = true;
    const auto mine = solve(batch);
    std::vector<IkResult> theirs(1);
    ASSERT_TRUE(oracle->solve(batch, theirs, none).ok());
    ASSERT_EQ(theirs[0].status, IkStatus::solved);
    const std::size_t n = dof();
    most = std::max(most, mine[0].q.size() / n);
    for (std::size_t k = 0; k < theirs[0].q.size() / n; ++k) {
      double least = INFINITY;
      for (std::size_t m = 0; m < mine[0].q.size() / n; ++m)
        least = std::min(least, apart(model(), &theirs[0].q[k * n], &mine[0].q[m * n]));
      EXPECT_LT(least, 1e-4) << "the search's solution " << k + 1 << " is missing";
    }
  }
  EXPECT_GE(most, 2U) << "the targets were too easy to tell anything";
}

// What random restarts of a search find must be among the solutions: each of them where they are
// isolated (no more joints than the target fixes). A redundant arm has infinitely many: asked from
// each of them as a seed, the set has it.
TEST_P(IkClosedForm, WhatRandomRestartsFindIsInTheSet) {
  const std::size_t n = dof();
  Random random(kSeed + 15);
  const IkSearch search(model());
  std::size_t found = 0;
  for (int i = 0; i < 5; ++i) {
    SCOPED_TRACE("target " + std::to_string(i));
    const Pose target = tip_pose(model(), random.configuration(model()).data());
    IkBatch batch;
    batch.targets = {&target, 1};
    batch.all_solutions = true;
    auto set = solve(batch)[0].q;
    for (int restart = 0; restart < (n > 6 ? 30 : 120); ++restart) {
      std::vector<double> q = random.configuration(model());
      // Near a singular configuration solutions are ill-conditioned, and two are nearly one.
      if (!search.solve(target, q) || search.smallest(q) < 0.02) continue;
      ++found;
      if (n > 6) {
        batch.seeds = q;
        set = solve(batch)[0].q;
      }
      double least = INFINITY;
      for (std::size_t k = 0; k < set.size() / n; ++k)
        least = std::min(least, apart(model(), &set[k * n], q.data()));
      ASSERT_LT(least, 1e-6) << "a solution is missing: " << text_of(q);
    }
  }
  EXPECT_GT(found, 20U) << "the search found too little to tell anything";
}

TEST_P(IkClosedForm, TheShortfallIsTheLeastDistanceThatOrientationLeaves) {
  Random random(kSeed + 12);
  const RobotModel& m = model();
  int checked = 0;
  for (int i = 0; i < 40 && checked < 3; ++i) {
    SCOPED_TRACE("target " + std::to_string(i));
    std::vector<double> q = random.configuration(m);
    Pose target = tip_pose(m, q.data());
    for (double& x : target.p) x *= 1.7;
    IkBatch batch;
    batch.targets = {&target, 1};
    const auto r = solve(batch);
    if (r[0].status != IkStatus::out_of_reach || r[0].shortfall == 0) continue;
    ++checked;
    EXPECT_NE(r[0].detail.find("out of reach by"), std::string::npos) << r[0].detail;
    if (r[0].rotation_error < 1e-9) {  // else limits made it turn the tip
      EXPECT_GE(r[0].position_error, r[0].shortfall - 1e-9) << "closer than the least distance";
    }
    // A little beyond the shortfall, towards no configuration in particular, nothing is reached;
    // somewhere on the sphere of the shortfall's radius something is. Looked for by brute force:
    // random targets on spheres about the target.
    const auto reaches = [&](double radius, int tries) {
      IkBatch one;
      for (int k = 0; k < tries; ++k) {
        double v[3], size = 0;
        do {
          size = 0;
          for (double& x : v) x = random.uniform(-1, 1), size += x * x;
        } while (size > 1 || size < 0.01);
        Pose moved = target;
        for (std::size_t c = 0; c < 3; ++c) moved.p[c] += radius * v[c] / std::sqrt(size);
        one.targets = {&moved, 1};
        const IkStatus s = solve(one)[0].status;
        if (s == IkStatus::solved || s == IkStatus::joint_limit) return true;
      }
      return false;
    };
    EXPECT_FALSE(reaches(0.999 * r[0].shortfall, 60)) << "shortfall " << r[0].shortfall;
    EXPECT_TRUE(reaches(1.05 * r[0].shortfall, 600)) << "shortfall " << r[0].shortfall;
  }
  EXPECT_GT(checked, 1);
}

TEST_P(IkClosedForm, ALimitInTheWayIsNamed) {
  Random random(kSeed + 13);
  int named = 0;
  for (int i = 0; i < 60; ++i) {
    // Poses of configurations that are outside the limits in one joint.
    std::vector<double> q = random.configuration(model());
    const std::size_t j = static_cast<std::size_t>(i) % dof();
    q[j] = model().joints[j].upper + 0.3;
    const Pose target[] = {tip_pose(model(), q.data())};
    IkBatch batch;
    batch.targets = target;
    const auto r = solve(batch);
    if (r[0].status == IkStatus::solved) {  // another solution
      expect_within_limits(r[0]);
      continue;
    }
    ASSERT_EQ(r[0].status, IkStatus::joint_limit) << r[0].detail;
    expect_within_limits(r[0]);
    ASSERT_GE(r[0].limiting_joint, 0);
    ASSERT_LT(static_cast<std::size_t>(r[0].limiting_joint), dof());
    const JointModel& joint = model().joints[static_cast<std::size_t>(r[0].limiting_joint)];
    EXPECT_NE(r[0].detail.find("\"" + joint.name + "\""), std::string::npos) << r[0].detail;
    ++named;
  }
  RecordProperty("named", named);
}

TEST_P(IkClosedForm, ASingularConfigurationTellsTheLostDirection) {
  if (dof() < 6) GTEST_SKIP() << "its tip never moves in all directions";
  Random random(kSeed + 14);
  // The wrist stretched: joint 5 of 6, or 6 of 7, where its neighbours' axes are one line.
  std::vector<double> q = random.configuration(model());
  const std::size_t bend = dof() - 2;
  double best = INFINITY, at = 0;
  for (double x = model().joints[bend].lower; x < model().joints[bend].upper; x += 1e-3) {
    q[bend] = x;
    const double d = std::fabs(determinant(q));
    if (d < best) best = d, at = x;
  }
  q[bend] = std::fabs(at) < 2e-3 ? 0.0 : at;
  if (std::fabs(determinant(q)) > 1e-7) GTEST_SKIP() << "its wrist is not singular at zero";
  const Pose target[] = {tip_pose(model(), q.data())};
  IkBatch batch;
  batch.targets = target;
  batch.seeds = q;
  const auto r = solve(batch);
  ASSERT_EQ(r[0].status, IkStatus::solved) << r[0].detail;
  for (std::size_t j = 0; j < dof(); ++j) EXPECT_NEAR(r[0].q[j], q[j], 1e-6) << "kept";
  double size = 0;
  for (const double x : r[0].lost_direction) size += x * x;
  ASSERT_NEAR(size, 1, 1e-9) << "a unit twist";
  for (std::size_t j = 0; j < dof(); ++j) {
    std::vector<double> a = q, b = q;
    a[j] -= 1e-5, b[j] += 1e-5;
    const Pose pa = tip_pose(model(), a.data()), pb = tip_pose(model(), b.data());
    double along = 0;
    for (std::size_t k = 0; k < 3; ++k)
      along += r[0].lost_direction[k] * (pb.p[k] - pa.p[k]) / 2e-5;
    for (std::size_t k = 0; k < 3; ++k) {
      double w = 0;
      const std::size_t row = (k + 2) % 3, column = (k + 1) % 3;
      for (std::size_t c = 0; c < 3; ++c)
        w += (pb.R[3 * row + c] - pa.R[3 * row + c]) * pa.R[3 * column + c];
      along += r[0].lost_direction[3 + k] * w / 2e-5;
    }
    EXPECT_NEAR(along, 0, 3e-5) << "joint " << j + 1 << " moves along the lost direction";
  }
}

}  // namespace robomosp::conformance
