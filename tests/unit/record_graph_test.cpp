// SPDX-License-Identifier: Apache-2.0
// The graph of records that refer to each other, whatever their kinds: cycles are refused, what is
// affected comes in order of dependency.
#include <algorithm>
#include <random>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "model/data.h"
#include "support/records.h"
#include "support/sample_records.h"
#include "support/seed.h"

namespace robomosp {
namespace {

using document::Commit;
using document::Document;
using document::Snapshot;
using test::make;
using test::SampleRecords;

std::set<AnyId> references_of(const Snapshot& s, AnyId id) {
  std::set<AnyId> out;
  model::for_each_reference(s.find(id)->body,
                            [&out](AnyId to, std::string_view) { out.insert(to); });
  return out;
}

/// Everything that refers to `id`, directly or not, by a search of its own over all records.
std::set<AnyId> dependents(const Snapshot& s, AnyId id) {
  std::set<AnyId> out{id};
  for (bool has_grown = true; has_grown;) {
    has_grown = false;
    for (const AnyId each : s.list())
      for (const AnyId to : references_of(s, each))
        if (out.contains(to) && out.insert(each).second) has_grown = true;
  }
  return out;
}

void expect_in_order(const Snapshot& s, const Commit& commit, const std::set<AnyId>& expected) {
  EXPECT_EQ(std::set<AnyId>(commit.affected.begin(), commit.affected.end()), expected);
  EXPECT_EQ(commit.affected.size(), expected.size()) << "each once";
  std::set<AnyId> seen;
  for (const AnyId id : commit.affected) {
    for (const AnyId to : references_of(s, id))
      EXPECT_TRUE(!expected.contains(to) || seen.contains(to))
          << s.describe(id) << " comes before " << s.describe(to);
    seen.insert(id);
  }
}

TEST(RecordGraph, WhatIsAffectedComesAfterWhatItRefersToForAllKinds) {
  SampleRecords samples;
  Document& d = samples.document;
  std::set<Kind> kinds;
  for (const AnyId id : samples.ids) {
    SCOPED_TRACE(d.now()->describe(id));
    kinds.insert(id.kind);
    auto tx = d.begin("rename");
    const std::string name = "x_" + d.now()->find(id)->name;
    ASSERT_TRUE(tx->edit(id, [&](model::Record& r) -> Result<void> {
                    r.name = name;
                    return {};
                  }).ok());
    const auto commit = tx->commit();
    ASSERT_TRUE(commit.ok()) << commit.error().sentence();
    expect_in_order(*d.now(), *commit, dependents(*d.now(), id));
    const auto back = d.undo();
    ASSERT_TRUE(back.ok());
    EXPECT_EQ(back->affected, commit->affected);
  }
  EXPECT_EQ(kinds.size(), kNamedKinds);
}

model::Trajectory run_again(TrajectoryId other) {
  model::Trajectory t;
  t.segments.emplace_back().stored = other;
  return t;
}
model::Task call(TaskId other) {
  model::Task t;
  auto& step = t.steps.emplace_back();
  step.kind = model::StepKind::call;
  step.task = other;
  return t;
}
template <class R>
std::string refusal(Document& d, AnyId id, R content) {
  auto tx = d.begin("edit");
  auto edited = tx->edit(id, [&](model::Record& r) -> Result<void> {
    r.body = content;
    return {};
  });
  EXPECT_TRUE(edited.ok());
  const auto commit = tx->commit();
  return commit.ok() ? std::string() : commit.error().sentence();
}

TEST(RecordGraph, TrajectoriesAndTasksInACircleAreRefused) {
  Document d;
  const auto a = make(d, "a", model::Trajectory{});
  const auto b = make(d, "b", run_again(a));
  const auto c = make(d, "c", run_again(b));
  EXPECT_EQ(
      refusal(d, a, run_again(b)),
      "trajectory \"a\" cannot refer to trajectory \"b\", which refers to it in turn (b > a). "
      "Remove one of these references first.");
  EXPECT_EQ(refusal(d, a, run_again(c)).substr(0, 52),
            "trajectory \"a\" cannot refer to trajectory \"c\", which");
  EXPECT_EQ(refusal(d, a, run_again(a)), "trajectory \"a\" cannot refer to itself.");
  const auto inner = make(d, "inner", model::Task{});
  const auto outer = make(d, "outer", call(inner));
  EXPECT_EQ(refusal(d, inner, call(outer)),
            "task \"inner\" cannot refer to task \"outer\", which refers to it in turn (outer > "
            "inner). Remove one of these references first.");
  // The callee comes before its caller, whatever their ids.
  const auto late = make(d, "late", model::Task{});
  EXPECT_EQ(refusal(d, inner, call(late)), "");
  auto tx = d.begin("rename");
  ASSERT_TRUE(tx->edit(late, [](model::Record& r) -> Result<void> {
                  r.name = "later";
                  return {};
                }).ok());
  EXPECT_EQ(tx->commit()->affected, (std::vector<AnyId>{late, inner, outer}));
}

TEST(RecordGraph, ACircleOfOneCommitIsRefusedToo) {
  Document d;
  const auto a = make(d, "a", model::Trajectory{});
  const auto b = make(d, "b", model::Trajectory{});
  auto tx = d.begin("both");
  for (const auto& [id, to] : {std::pair(a, b), std::pair(b, a)})
    ASSERT_TRUE(tx->edit(id, [to = to](model::Record& r) -> Result<void> {
                    r.body = run_again(to);
                    return {};
                  }).ok());
  EXPECT_FALSE(tx->commit().ok());
  EXPECT_TRUE(d.now()->get(a)->segments.empty());
}

TEST(RecordGraph, RandomEditsAreRefusedExactlyWhenTheyCloseACircle) {
  std::mt19937 random(test::seed());
  constexpr std::size_t kRecords = 12;
  Document d;
  std::vector<TrajectoryId> all;
  for (std::size_t i = 0; i < kRecords; ++i)
    all.push_back(make(d, "t" + std::to_string(i), model::Trajectory{}));
  const auto pick = [&] {
    return all[std::uniform_int_distribution<std::size_t>(0, kRecords - 1)(random)];
  };
  std::size_t refused = 0;
  for (int step = 0; step < 500; ++step) {
    const TrajectoryId from = pick();
    model::Trajectory t;
    bool closes = false;
    for (int n = 0; n < 2; ++n) {
      const TrajectoryId to = pick();
      t.segments.emplace_back().stored = to;
      closes = closes || dependents(*d.now(), from).contains(to);
    }
    // What `from` referred to before does not count: it is replaced.
    const bool was_refused = !refusal(d, from, t).empty();
    EXPECT_EQ(was_refused, closes) << "step " << step;
    refused += was_refused ? 1 : 0;
  }
  EXPECT_GT(refused, 50U);
}

}  // namespace
}  // namespace robomosp
