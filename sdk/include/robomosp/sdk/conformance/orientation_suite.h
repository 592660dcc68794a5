// SPDX-License-Identifier: Apache-2.0
// Conformance suite of robomosp.orientation/2 (layer: contract helper for tests, GoogleTest,
// header-only): orientations are rotations, turn and bend their derivatives. Include it in one file
// of a test program and instantiate OrientationConformance with OrientationCase values.
//
// The path is the helix (cos 2w, sin 2w, w/2), by the share w of its length; points are poses at
// shares of it with their positions on it.
#pragma once

#include <array>
#include <cmath>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <robomosp/sdk/conformance/allocations.h>
#include <robomosp/sdk/conformance/models.h>
#include <robomosp/sdk/conformance/provider.h>
#include <robomosp/sdk/conformance/threads.h>
#include <robomosp/sdk/orientation.h>

namespace robomosp::conformance {

struct OrientationCase {
  std::string file, provider, name;
  std::vector<double> shares;                                 ///< of the points
  std::vector<Pose> points;                                   ///< their orientations
  std::vector<std::pair<std::string, std::string>> params{};  ///< as in files, SI
  bool meets_ends = true;  ///< the first and the last point's orientation
  bool meets_all_points = false;
  /// Shares where the rate may jump, beside which nothing is differentiated.
  std::vector<double> jumps{};
};
inline void PrintTo(const OrientationCase& c, std::ostream* os) {
  *os << c.provider << " " << c.name;
}
inline std::string orientation_case_name(const testing::TestParamInfo<OrientationCase>& info) {
  return info.param.provider + "_" + info.param.name;
}

class OrientationConformance : public testing::TestWithParam<OrientationCase> {
 protected:
  class Helix final : public Curve {
   public:
    double end() const override { return 1; }
    bool is_even() const override { return true; }
    std::vector<double> knots() const override { return {0, 1}; }
    Result<void> evaluate(std::span<const double> u, std::span<CurveSample> out) const override {
      for (std::size_t i = 0; i < u.size(); ++i) {
        const double c = std::cos(2 * u[i]), s = std::sin(2 * u[i]);
        out[i] = {{c, s, u[i] / 2}, {-2 * s, 2 * c, 0.5}, {-4 * c, -4 * s, 0}, {8 * s, -8 * c, 0}};
      }
      return {};
    }
  };

  static Result<std::unique_ptr<Orientation>> make(const OrientationCase& c) {
    RMP_TRY_ASSIGN(const rmp_provider* provider,
                   find_provider<OrientationFactory>(c.file, c.provider));
    TableParams params(*provider);
    for (const auto& [name, value] : c.params) params.set(name, value);
    const Helix helix;
    std::vector<Pose> points = c.points;
    for (std::size_t i = 0; i < points.size(); ++i) points[i].p = along(c.shares[i]).p;
    return create<OrientationFactory>(*provider)->make(
        {sizeof(OrientationTask), points, c.shares, &helix}, params);
  }
  void SetUp() override {
    auto made = make(GetParam());
    ASSERT_TRUE(made.ok()) << made.error().sentence();
    orientation_ = std::move(made).value();
  }
  static CurveSample along(double w) {
    CurveSample s[1];
    const double u[] = {w};
    EXPECT_TRUE(Helix().evaluate(u, s).ok());
    return s[0];
  }
  OrientationSample at(double w) const {
    const double shares[] = {w};
    const CurveSample way[] = {along(w)};
    OrientationSample s[1];
    EXPECT_TRUE(orientation_->evaluate(shares, way, s).ok());
    return s[0];
  }
  Pose pose_at(double w) const {
    Pose p;
    p.R = at(w).R;
    return p;
  }
  bool is_beside_jump(double w) const {
    for (const double jump : GetParam().jumps)
      if (std::fabs(w - jump) < 1e-3) return true;
    return false;
  }
  std::unique_ptr<Orientation> orientation_;
};
GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(OrientationConformance);

TEST_P(OrientationConformance, OrientationsAreRotations) {
  for (int i = 0; i <= 40; ++i) {
    const auto R = at(i / 40.0).R;
    for (std::size_t r = 0; r < 3; ++r)
      for (std::size_t c = 0; c < 3; ++c) {
        double dot = 0;
        for (std::size_t k = 0; k < 3; ++k) dot += R[3 * r + k] * R[3 * c + k];
        EXPECT_NEAR(dot, r == c ? 1 : 0, 1e-13) << "at " << i / 40.0;
      }
    const double determinant = R[0] * (R[4] * R[8] - R[5] * R[7]) -
                               R[1] * (R[3] * R[8] - R[5] * R[6]) +
                               R[2] * (R[3] * R[7] - R[4] * R[6]);
    EXPECT_NEAR(determinant, 1, 1e-12) << "at " << i / 40.0;
  }
}

// dR/dw R^T = [turn]x, by central differences.
TEST_P(OrientationConformance, TurnAndBendAreDerivatives) {
  constexpr double h = 2e-5;
  for (int i = 0; i < 60; ++i) {
    const double w = (i + 0.31) / 60;
    if (is_beside_jump(w)) continue;
    const OrientationSample a = at(w - h), s = at(w), b = at(w + h);
    double D[9] = {};  // (R(w + h) - R(w - h)) R(w)^T / 2h
    for (std::size_t r = 0; r < 3; ++r)
      for (std::size_t c = 0; c < 3; ++c)
        for (std::size_t k = 0; k < 3; ++k)
          D[3 * r + c] += (b.R[3 * r + k] - a.R[3 * r + k]) * s.R[3 * c + k] / (2 * h);
    const Vec3 turn{(D[7] - D[5]) / 2, (D[2] - D[6]) / 2, (D[3] - D[1]) / 2};
    double scale = 1;
    for (std::size_t k = 0; k < 3; ++k) scale += std::fabs(s.turn[k]) + std::fabs(s.bend[k]);
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_NEAR(s.turn[k], turn[k], 1e-6 * scale) << "turn at " << w;
      EXPECT_NEAR(s.bend[k], (b.turn[k] - a.turn[k]) / (2 * h), 1e-5 * scale) << "bend at " << w;
    }
  }
}

TEST_P(OrientationConformance, HasNoJumps) {
  Pose before = pose_at(0);
  double most = 0;
  for (int i = 0; i <= 2000; ++i)
    for (const double t : at(i / 2000.0).turn) most = std::max(most, std::fabs(t));
  for (int i = 1; i <= 2000; ++i) {
    const Pose now = pose_at(i / 2000.0);
    EXPECT_LE(rotation_gap(before, now), 2 * most / 2000 + 1e-7) << "before " << i / 2000.0;
    before = now;
  }
}

TEST_P(OrientationConformance, MeetsThePoints) {
  const OrientationCase& c = GetParam();
  for (std::size_t i = 0; i < c.points.size(); ++i) {
    const bool is_end = i == 0 || i + 1 == c.points.size();
    if (!(c.meets_all_points || (is_end && c.meets_ends))) continue;
    Pose wanted;
    wanted.R = c.points[i].R;
    EXPECT_LE(rotation_gap(pose_at(c.shares[i]), wanted), 1e-9) << "point " << i + 1;
  }
}

TEST_P(OrientationConformance, SeveralThreadsGetTheSameSamplesAtOnce) {
  std::vector<double> in;
  std::vector<CurveSample> along_it;
  for (int i = 0; i <= 200; ++i) {
    in.push_back(i / 200.0);
    along_it.push_back(along(i / 200.0));
  }
  std::vector<OrientationSample> alone(in.size());
  ASSERT_TRUE(orientation_->evaluate(in, along_it, alone).ok());
  std::array<std::vector<OrientationSample>, 4> together;
  at_once(together.size(), [&](std::size_t thread) {
    together[thread].resize(in.size());
    EXPECT_TRUE(orientation_->evaluate(in, along_it, together[thread]).ok());
  });
  for (const auto& out : together)
    for (std::size_t i = 0; i < in.size(); ++i) {
      EXPECT_EQ(out[i].R, alone[i].R);
      EXPECT_EQ(out[i].turn, alone[i].turn);
      EXPECT_EQ(out[i].bend, alone[i].bend);
    }
}

TEST_P(OrientationConformance, NothingIsAllocatedForASample) {
  RMP_NEEDS_ALLOCATION_COUNTS();
  std::vector<double> in;
  std::vector<CurveSample> along_it;
  for (int i = 0; i <= 200; ++i) {
    in.push_back(i / 200.0);
    along_it.push_back(along(i / 200.0));
  }
  std::vector<OrientationSample> alone(in.size());
  const auto of = [&](std::size_t n) {
    return allocations_in([&] {
      (void)orientation_->evaluate(std::span<const double>(in).first(n),
                                   std::span<const CurveSample>(along_it).first(n),
                                   std::span(alone).first(n));
    });
  };
  (void)of(in.size());  // what is made once
  EXPECT_LE(of(in.size()), of(1)) << "more samples, more allocations";
}

TEST_P(OrientationConformance, ManySharesAtOnceAreTheSameAsOneByOne) {
  std::vector<double> w;
  std::vector<CurveSample> way;
  for (int i = 0; i <= 200; ++i) {
    w.push_back(((i * 37) % 201) / 200.0);
    way.push_back(along(w.back()));
  }
  std::vector<OrientationSample> out(w.size());
  ASSERT_TRUE(orientation_->evaluate(w, way, out).ok());
  for (std::size_t i = 0; i < w.size(); ++i) EXPECT_EQ(out[i].R, at(w[i]).R);
}

TEST_P(OrientationConformance, WithoutPointsIsRefused) {
  OrientationCase broken = GetParam();
  broken.points.clear();
  broken.shares.clear();
  EXPECT_FALSE(make(broken).ok());
}

}  // namespace robomosp::conformance
