// SPDX-License-Identifier: Apache-2.0
// Seeds and lengths of random tests: the same in every run, so that a failure is repeated by
// running again.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdlib>
#include <iostream>
#include <optional>
#include <random>
#include <string_view>

namespace robomosp::test {

/// 1, or what ROBOMOSP_TEST_SEED says: a number, or "random" for another one in each run.
inline unsigned seed() {
  const char* given = std::getenv("ROBOMOSP_TEST_SEED");
  const unsigned value = !given ? 1U
                         : std::string_view(given) == "random"
                             ? std::random_device{}()
                             : static_cast<unsigned>(std::strtoul(given, nullptr, 10));
  std::cout << "seed " << value << " (set ROBOMOSP_TEST_SEED to repeat)\n";
  return value;
}

/// Length of a mutation loop: a number of files, the same on every machine, or the time in
/// ROBOMOSP_FUZZ_SECONDS, or with ROBOMOSP_LONG=1 ten minutes.
class FuzzBudget {
 public:
  /// `share`: fraction of the time for one loop of a program that has several.
  explicit FuzzBudget(std::size_t files, double share = 1) : files_(files) {
    const char* given = std::getenv("ROBOMOSP_FUZZ_SECONDS");
    const char* is_long = std::getenv("ROBOMOSP_LONG");
    const double seconds = given ? std::strtod(given, nullptr)
                           : is_long && std::string_view(is_long) == "1" ? 600
                                                                         : 0;
    if (seconds > 0)
      end_ = std::chrono::steady_clock::now() +
             std::chrono::duration_cast<std::chrono::steady_clock::duration>(
                 std::chrono::duration<double>(share * seconds));
  }
  [[nodiscard]] bool allows(std::size_t done) const {
    return end_ ? std::chrono::steady_clock::now() < *end_ : done < files_;
  }
  /// A time was asked for.
  [[nodiscard]] bool is_long() const { return end_.has_value(); }

 private:
  std::size_t files_;
  std::optional<std::chrono::steady_clock::time_point> end_;
};

}  // namespace robomosp::test
