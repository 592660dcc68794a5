// SPDX-License-Identifier: Apache-2.0
// The user who cancels in the suites (StopAfter) notices a provider that goes on, and one that does
// not ask; and blames nobody for what others compute.
#include <chrono>
#include <ctime>
#include <functional>
#include <thread>

#include <gtest/gtest.h>

#include <robomosp/sdk/conformance/stop_after.h>

namespace robomosp::conformance {
namespace {

/// Computes on this thread for so long [s].
void compute(double seconds, const std::function<void()>& each = {}) {
  const auto now = [] {
    timespec t{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
  };
  for (const double end = now() + seconds; now() < end;)
    if (each) each();
}

TEST(StopAfter, CancelsAfterWhatIsComputedAndNotAfterWhatPasses) {
  const StopAfter user(0.02);
  std::this_thread::sleep_for(std::chrono::milliseconds(50));
  EXPECT_FALSE(user.cancelled());
  compute(0.03);
  EXPECT_TRUE(user.cancelled());
  EXPECT_LT(user.since_told(), 0.01);
  EXPECT_LT(user.unheard(), 0.05);
}

TEST(StopAfter, SeesWhoGoesOnAndWhoDoesNotAsk) {
  const StopAfter user(0.01);
  compute(0.03, [&] { (void)user.cancelled(); });
  EXPECT_GT(user.since_told(), 0.015) << "it went on though it was told";
  EXPECT_LT(user.unheard(), 0.005) << "it asked all the time";
  compute(0.03);
  EXPECT_GT(user.unheard(), 0.029);
}

TEST(StopAfter, LooksAtEachThreadForItself) {
  const StopAfter user(10);
  std::jthread other([&] {
    compute(0.03);  // before it has to do with it
    (void)user.cancelled();
    compute(0.02);
    (void)user.cancelled();
  });
  other.join();
  EXPECT_GT(user.unheard(), 0.019);
  EXPECT_LT(user.unheard(), 0.029);
}

}  // namespace
}  // namespace robomosp::conformance
