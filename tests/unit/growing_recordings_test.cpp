// SPDX-License-Identifier: Apache-2.0
// Recordings that grow while others read them; also run under ThreadSanitizer.
#include <atomic>
#include <cmath>
#include <limits>
#include <memory>
#include <thread>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "recording/recording.h"

namespace robomosp::recording {
namespace {

using Rows = std::vector<std::vector<double>>;

RecordingPtr table(std::vector<double> time, std::vector<double> x) {
  auto r = std::make_shared<Recording>();
  r->columns = {{"time", "s", "", std::move(time)}, {"x", "m", "", std::move(x)}};
  return r;
}

TEST(GrowingRecordings, WhoHasOneKeepsTheRowsOfThen) {
  Recordings all;
  const auto n = all.add(table({0, 1}, {5, 6}));
  const RecordingPtr before = all.find(n);
  ASSERT_TRUE(all.append(n, Rows{{2, 3}, {7, 8}}).ok());
  const RecordingPtr after = all.find(n);
  ASSERT_TRUE(all.append(n, Rows{{4}, {9}}).ok());
  EXPECT_EQ(before->rows(), 2U);
  EXPECT_EQ(after->rows(), 4U);
  EXPECT_NE(before, after);
  EXPECT_EQ(all.find(n)->columns[1].values, (std::vector<double>{5, 6, 7, 8, 9}));
  EXPECT_EQ(all.find(n), all.find(n));
  EXPECT_EQ(all.list().front().second->rows(), 5U);
}

TEST(GrowingRecordings, RowsComeAllOrNone) {
  Recordings all;
  const auto n = all.add(table({0, 1}, {5, 6}));
  const double inf = std::numeric_limits<double>::infinity();
  for (const Rows& bad :
       {Rows{{1}, {0}}, Rows{{2, 2}, {0, 0}}, Rows{{2, 1.5}, {0, 0}}, Rows{{NAN}, {0}},
        Rows{{inf}, {0}}, Rows{{2}}, Rows{{2, 3}, {0}}, Rows{{2}, {0}, {0}}})
    EXPECT_FALSE(all.append(n, bad).ok());
  EXPECT_EQ(all.find(n)->rows(), 2U);
  ASSERT_TRUE(all.append(n, Rows{{1.5}, {NAN}}).ok());  // a value that is missing
  EXPECT_FALSE(all.append(n, Rows{{1.25}, {0}}).ok());  // before one that nobody has read
  EXPECT_EQ(*all.append(n, Rows{{2}, {0}}), 4U);
  EXPECT_FALSE(all.append(n + 1, Rows{{3}, {0}}).ok());
  EXPECT_TRUE(all.remove(n));
  EXPECT_FALSE(all.append(n, Rows{{3}, {0}}).ok());
}

TEST(GrowingRecordings, IsReplacedOnlyWhenItDidNotGrowMeanwhile) {
  Recordings all;
  const auto n = all.add(table({0, 1}, {5, 6}));
  const RecordingPtr was = all.find(n);
  ASSERT_TRUE(all.append(n, Rows{{2}, {7}}).ok());
  EXPECT_FALSE(all.replace(n, was, table({0}, {1})).ok());
  const RecordingPtr now = all.find(n);
  ASSERT_TRUE(all.replace(n, now, table({0}, {1})).ok());
  EXPECT_EQ(all.find(n)->rows(), 1U);
  EXPECT_EQ(now->rows(), 3U);
  EXPECT_EQ(*all.append(n, Rows{{2}, {7}}), 2U);
}

TEST(GrowingRecordings, AppendingCostsTheRowsAndNotTheRecording) {
  // Counted in addresses: the table moves as seldom as a vector that doubles.
  Recordings all;
  const auto n = all.add(table({0}, {0}));
  const double* at = nullptr;
  int moves = 0;
  const int count = 100000;
  for (int i = 1; i <= count; ++i) {
    ASSERT_TRUE(all.append(n, Rows{{double(i)}, {double(-i)}}).ok());
    const double* is = all.find(n)->columns[1].values.data();
    moves += is != at ? 1 : 0;
    at = is;
  }
  EXPECT_LE(moves, 40);
  EXPECT_EQ(all.find(n)->rows(), std::size_t{count} + 1);
}

TEST(GrowingRecordings, IsReadByManyWhileItGrows) {
  Recordings all;
  const auto n = all.add(table({0}, {0}));
  std::atomic<bool> stop{false};
  std::atomic<int> faults{0};
  std::vector<std::thread> readers;
  for (int k = 0; k < 3; ++k)
    readers.emplace_back([&] {
      while (!stop) {
        const RecordingPtr r = all.find(n);
        const std::size_t rows = r->rows();
        for (std::size_t i = 0; i < rows; ++i)
          if (r->columns[0].values[i] != double(i) || r->columns[1].values[i] != -double(i))
            ++faults;
        if (r->rows() != rows) ++faults;
      }
    });
  for (int i = 1; i <= 5000; ++i)
    if (!all.append(n, Rows{{double(i)}, {-double(i)}}).ok()) ++faults;
  stop = true;
  for (std::thread& t : readers) t.join();
  EXPECT_EQ(faults, 0);
}

}  // namespace
}  // namespace robomosp::recording
