// SPDX-License-Identifier: Apache-2.0
// What the suites of robomosp.ik/1 hold against a solver that names its branches (ik_branches.h):
// its words, and that its measures change their sign only through 0 (layer: contract helper for
// tests, header-only).
#pragma once

#include <cmath>
#include <limits>
#include <set>
#include <string>
#include <vector>

#include <robomosp/sdk/conformance/models.h>
#include <robomosp/sdk/ik_branches.h>

namespace robomosp::conformance {

/// The first fault of the branches of one tip, "" = none. Motions between random
/// configurations of the model are followed, straight in its joints.
[[nodiscard]] inline std::string branch_fault(const IkBranches& branches, const RobotModel& model,
                                              std::int32_t tip, std::uint64_t seed = 20061) {
  const auto choices = branches.choices(tip);
  const std::size_t n = model.coordinate_count(), m = choices.size();
  if (m == 0) return {};
  std::set<std::string> words, names;
  for (const IkBranchChoice& c : choices) {
    if (!c.name || !*c.name) return "a choice has no name";
    if (!names.insert(c.name).second) return "two choices have the name " + std::string(c.name);
    for (const char* word : {c.positive, c.negative}) {
      if (!word || !*word) return std::string("the choice ") + c.name + " lacks a word";
      if (!words.insert(word).second) return std::string("two options have the word ") + word;
    }
  }
  Random random(seed);
  constexpr std::size_t kConfigurations = 100, kMotions = 60, kSteps = 100;
  const double unset = std::numeric_limits<double>::quiet_NaN();
  std::vector<double> q;
  for (std::size_t i = 0; i < kConfigurations; ++i)
    for (const double x : random.configuration(model)) q.push_back(x);
  std::vector<double> all(kConfigurations * m, unset), one(m);
  branches.measure(tip, q, all);
  for (std::size_t i = 0; i < kConfigurations; ++i) {
    one.assign(m, unset);
    branches.measure(tip, {q.data() + i * n, n}, one);
    for (std::size_t k = 0; k < m; ++k) {
      const std::string which = std::string("the measure of ") + choices[k].name;
      if (!(std::fabs(one[k]) <= 1 + 1e-12))
        return which + " is " + std::to_string(one[k]) + ", not within -1 to 1";
      if (one[k] != all[i * m + k]) return which + " depends on what it is asked together with";
    }
  }
  // Where a sign changes, two branches meet: a measure is 0 on both sides.
  constexpr double kMeet = 1e-3;
  std::vector<double> here(n), before(m), now(m);
  for (std::size_t motion = 0; motion < kMotions; ++motion) {
    const double* from = &q[motion * n];
    const double* to = &q[(motion + kConfigurations / 2) % kConfigurations * n];
    const auto at = [&](double share, std::vector<double>& out) {
      for (std::size_t j = 0; j < n; ++j) here[j] = from[j] + share * (to[j] - from[j]);
      branches.measure(tip, here, out);
    };
    at(0, before);
    for (std::size_t step = 1; step <= kSteps; ++step) {
      at(static_cast<double>(step) / kSteps, now);
      for (std::size_t k = 0; k < m; ++k) {
        if (now[k] * before[k] >= 0) continue;
        double low = static_cast<double>(step - 1) / kSteps,
               high = static_cast<double>(step) / kSteps;
        const double sign = before[k];
        std::vector<double> a = before, b = now, middle(m);
        for (int halving = 0; halving < 50 && high - low > 1e-13; ++halving) {
          const double share = (low + high) / 2;
          at(share, middle);
          const bool is_before = middle[k] * sign > 0;
          (is_before ? low : high) = share;
          (is_before ? a : b) = middle;
        }
        // Branches may depend on others, as above and below on the side: then those meet there.
        bool meet = false;
        for (std::size_t other = 0; other < m; ++other)
          meet = meet || (std::fabs(a[other]) <= kMeet && std::fabs(b[other]) <= kMeet);
        if (!meet)
          return std::string("the measure of ") + choices[k].name + " jumps from " +
                 std::to_string(a[k]) + " to " + std::to_string(b[k]);
      }
      before = now;
    }
  }
  return {};
}

}  // namespace robomosp::conformance
