// SPDX-License-Identifier: Apache-2.0
// Provider "spherical_wrist": the SDK's suites on every family it knows, and what it refuses.
#include <array>
#include <cmath>
#include <span>
#include <vector>

#include <robomosp/sdk/conformance/arms.h>
#include <robomosp/sdk/conformance/ik_closed_suite.h>

namespace robomosp::conformance {
namespace {

const std::string kFile = std::string(ROBOMOSP_PLUGIN_DIR) + "/ik_spherical_wrist.so";
const std::string kNumeric = std::string(ROBOMOSP_PLUGIN_DIR) + "/ik_numeric.so";
const char* const kName = "spherical_wrist";

std::vector<RobotModel> arms() {
  return {puma560(), puma560_modified(), kr5(),         irb140(),
          ur5(),     skew_arm(),         meeting_arm(), parallel_first_arm()};
}
std::vector<RobotModel> free_arms() {
  std::vector<RobotModel> all;
  for (RobotModel& m : arms()) all.push_back(within_one_turn(std::move(m)));
  return all;
}

INSTANTIATE_TEST_SUITE_P(SphericalWrist, IkConformance,
                         testing::ValuesIn(ik_cases(kFile, kName, arms())), ik_case_name);
INSTANTIATE_TEST_SUITE_P(SphericalWrist, IkClosedForm,
                         testing::ValuesIn(ik_cases(kFile, kName, arms())), ik_case_name);
INSTANTIATE_TEST_SUITE_P(SphericalWristFree, IkClosedForm,
                         testing::ValuesIn(ik_cases(kFile, kName, free_arms(), kNumeric)),
                         ik_case_name);

std::vector<IkBranchChoice> choices_of(std::span<const std::array<const char*, 3>> words) {
  std::vector<IkBranchChoice> out(words.size());
  for (std::size_t i = 0; i < out.size(); ++i) {
    out[i].name = words[i][0];
    out[i].positive = words[i][1];
    out[i].negative = words[i][2];
  }
  return out;
}
using Words = std::array<const char*, 3>;
constexpr Words kWords[] = {{"elbow", "up", "down"}, {"wrist", "flip", "no flip"}};

/// Branches by the sign of the second joint's sine, with one thing wrong at a time.
class Branches : public IkBranches {
 public:
  [[nodiscard]] std::span<const IkBranchChoice> choices(std::int32_t) const override {
    return given;
  }
  void measure(std::int32_t, std::span<const double> q, std::span<double> out) const override {
    const std::size_t m = given.size(), count = m ? out.size() / m : 0;
    for (std::size_t i = 0; i < count; ++i)
      for (std::size_t k = 0; k < m; ++k)
        out[i * m + k] = of(q[i * q.size() / count + 1 + k], static_cast<double>(count));
  }
  std::vector<IkBranchChoice> given = choices_of(kWords);
  double (*of)(double q, double count) = [](double q, double) { return std::sin(q); };
};

TEST(BranchCheck, FindsWhatIsWrongWithMeasuresAndWords) {
  const RobotModel m = within_one_turn(puma560());
  EXPECT_EQ(branch_fault(Branches(), m, 0), "");
  Branches none;
  none.given.clear();
  EXPECT_EQ(branch_fault(none, m, 0), "");
  const auto fault = [&](double (*of)(double, double)) {
    Branches wrong;
    wrong.of = of;
    return branch_fault(wrong, m, 0);
  };
  EXPECT_NE(fault([](double q, double) { return q < 0 ? -1.0 : 1.0; }).find("elbow jumps"),
            std::string::npos);
  EXPECT_NE(fault([](double q, double) { return 3 * q; }).find("not within -1 to 1"),
            std::string::npos);
  EXPECT_NE(fault([](double, double) { return std::nan(""); }).find("not within"),
            std::string::npos);
  EXPECT_NE(fault([](double q, double count) { return std::sin(q) / count; }).find("together with"),
            std::string::npos);
  const auto worded = [&](std::vector<Words> words) {
    Branches wrong;
    wrong.given = choices_of(words);
    return branch_fault(wrong, m, 0);
  };
  EXPECT_EQ(worded({{"elbow", "up", "down"}, {"wrist", "up", "no flip"}}),
            "two options have the word up");
  EXPECT_EQ(worded({{"elbow", "up", "down"}, {"elbow", "flip", "no flip"}}),
            "two choices have the name elbow");
  EXPECT_EQ(worded({{"elbow", "up", nullptr}}), "the choice elbow lacks a word");
  EXPECT_EQ(worded({{"", "up", "down"}}), "a choice has no name");
}

}  // namespace
}  // namespace robomosp::conformance
