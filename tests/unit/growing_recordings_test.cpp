// SPDX-License-Identifier: Apache-2.0
// Recordings that grow while others read them; also run under ThreadSanitizer.
#include <atomic>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <string>
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

TEST(GrowingRecordings, RowsAreGivenFromAnyOnAndFromTheFirstWhenTheTableIsAnother) {
  Recordings all;
  std::vector<RecordingChange::What> heard;
  all.observe([&](const RecordingChange& c) { heard.push_back(c.what); });
  const auto n = all.add(table({0, 1}, {5, 6}));
  ASSERT_TRUE(all.append(n, Rows{{2, 3}, {7, 8}}).ok());  // which no reader has seen
  const auto x = [&](std::size_t from, std::optional<std::size_t> replaced, std::size_t most) {
    const auto r = all.rows(n, from, replaced, most, std::vector<std::string>{"x"});
    EXPECT_TRUE(r.ok() && r->columns.size() == 1);
    return r->columns.front().second;
  };
  using Numbers = std::vector<double>;
  EXPECT_EQ(x(0, {}, 100), (Numbers{5, 6, 7, 8}));
  EXPECT_EQ(x(1, 0, 2), (Numbers{6, 7}));
  EXPECT_EQ(x(3, 0, 0), (Numbers{8})) << "one row at least";
  EXPECT_EQ(x(4, 0, 100), Numbers());
  EXPECT_EQ(x(400, 0, 100), Numbers());
  const auto both = all.rows(n, 1, {}, 4, {});
  ASSERT_TRUE(both.ok());
  ASSERT_EQ(both->columns.size(), 2U);
  EXPECT_EQ(both->columns[0].second, (Numbers{1, 2})) << "numbers of all columns are counted";
  EXPECT_EQ(both->from, 1U);
  EXPECT_EQ(both->rows, 4U);
  ASSERT_TRUE(all.replace(n, all.find(n), table({0, 4}, {1, 2})).ok());
  EXPECT_EQ(x(2, 0, 100), (Numbers{1, 2}));
  EXPECT_EQ(x(1, 1, 100), (Numbers{2}));
  EXPECT_FALSE(all.rows(n, 0, {}, 100, std::vector<std::string>{"y"}).ok());
  EXPECT_TRUE(all.remove(n));
  EXPECT_FALSE(all.rows(n, 0, {}, 100, {}).ok());
  using What = RecordingChange::What;
  EXPECT_EQ(heard, (std::vector<What>{What::added, What::appended, What::replaced, What::removed}));
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
