// SPDX-License-Identifier: Apache-2.0
// The recovery journal: written beside edits, whole entries only, whatever ends the process.
#include "io/recovery_journal.h"

#include <signal.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <fstream>
#include <functional>
#include <iterator>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "io/native.h"
#include "support/records.h"
#include "support/seed.h"

namespace robomosp {
namespace {

namespace fs = std::filesystem;
using document::Document;
using io::RecoveryJournal;
using std::chrono::milliseconds;

std::int64_t now_ns() { return std::chrono::steady_clock::now().time_since_epoch().count(); }

class Recovery : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("robomosp-recovery-" + std::to_string(::getpid()));
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  /// Runs `body` in a process of its own, which is killed by it or by the caller.
  static pid_t start(const std::function<void()>& body) {
    const pid_t child = ::fork();
    if (child == 0) {
      body();
      ::_exit(0);
    }
    return child;
  }
  static void kill_now(pid_t child) {
    ::kill(child, SIGKILL);
    int status = 0;
    ::waitpid(child, &status, 0);
  }
  /// A journal of `d` whose process was killed after its first entry.
  fs::path dead_journal(const std::function<void(Document&)>& fill) {
    const pid_t child = start([&] {
      Document d;
      RecoveryJournal journal(d, {.folder = folder_, .interval = milliseconds(1)});
      fill(d);
      journal.changed();
      while (journal.file().empty()) std::this_thread::sleep_for(milliseconds(1));
      ::raise(SIGKILL);
    });
    int status = 0;
    ::waitpid(child, &status, 0);
    const auto found = io::found_journals(folder_);
    EXPECT_FALSE(found.empty());
    return found.empty() ? fs::path() : found.back().file;
  }
  static std::vector<std::string> restore(const fs::path& file, Document& d) {
    std::vector<std::string> notes;
    auto claimed = io::ClaimedJournal::claim(file);
    EXPECT_TRUE(claimed.ok());
    auto tx = d.begin("restore");
    const auto loaded = claimed->restore(*tx, {}, notes);
    EXPECT_TRUE(loaded.ok()) << loaded.error().sentence();
    const auto done = tx->commit();
    EXPECT_TRUE(done.ok()) << done.error().sentence();
    return notes;
  }

  fs::path folder_;
};

void fill(Document& d) {
  auto tx = d.begin("fill");
  model::Material steel;
  steel.density = 7850;
  const auto material = *tx->add("steel", steel);
  model::Solid pin;
  pin.material = material;
  pin.nodes.push_back({CsgKind::cylinder, "pin", -1, {}, {0.01, 0.05}});
  const auto solid = *tx->add("pin", pin, "/elsewhere/pin.csg");
  model::Object bolt;
  bolt.parts.push_back({"shaft", AnyId(solid), {}, {}});
  const auto object = *tx->add("bolt", bolt);
  model::World cell;
  cell.objects.push_back({});
  cell.objects.back().name = "first";
  cell.objects.back().what = object;
  (void)*tx->add("cell", cell);
  (void)tx->commit().ok();
}

TEST_F(Recovery, GivesBackRecordsWithTheirReferencesAndFiles) {
  const auto file = dead_journal(fill);
  Document d, expected;
  fill(expected);
  EXPECT_TRUE(restore(file, d).empty());
  EXPECT_EQ(d.content_digest(), expected.content_digest());
  EXPECT_EQ(d.now()->find(*d.now()->find(Kind::solid, "pin"))->file, "/elsewhere/pin.csg");
}

TEST_F(Recovery, NamesThatAreTakenGetFreeOnes) {
  const auto file = dead_journal(fill);
  Document d;
  fill(d);
  EXPECT_FALSE(restore(file, d).empty()) << "the notes say so";
  EXPECT_EQ(d.now()->size(), 8U);
  EXPECT_TRUE(d.now()->find(Kind::world, "cell_2").has_value());
}

TEST_F(Recovery, WhatIsInItsFileIsNotUnsaved) {
  const fs::path saved = folder_ / "steel.mtr";
  const auto file = dead_journal([&](Document& d) {
    test::make(d, "steel", model::Material{});
    auto tx = d.begin("save");
    (void)io::save(*tx, *tx->now().find(Kind::material, "steel"), saved, {}).ok();
    (void)tx->commit().ok();
  });
  ASSERT_TRUE(fs::exists(saved));
  const auto held = io::ClaimedJournal::claim(file);
  ASSERT_TRUE(held.ok());
  EXPECT_EQ(*held->unsaved({}), 0U);
  std::ofstream(saved, std::ios::app) << "\n";
  EXPECT_EQ(*held->unsaved({}), 1U) << "the file is another one now";
}

TEST_F(Recovery, AJournalOfALivingProcessIsNotOffered) {
  Document d;
  RecoveryJournal journal(d, {.folder = folder_, .interval = milliseconds(1)});
  fill(d);
  journal.changed();
  while (journal.file().empty()) std::this_thread::sleep_for(milliseconds(1));
  EXPECT_TRUE(io::found_journals(folder_).empty());
  const auto refused = io::ClaimedJournal::claim(journal.file());
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::conflict);
}

TEST_F(Recovery, NothingIsLeftOfAProcessThatEndsAsItShould) {
  {
    Document d;
    RecoveryJournal journal(d, {.folder = folder_, .interval = milliseconds(1)});
    fill(d);
    journal.changed();
    while (journal.file().empty()) std::this_thread::sleep_for(milliseconds(1));
    EXPECT_FALSE(fs::is_empty(folder_));
  }
  EXPECT_TRUE(fs::is_empty(folder_));
  {
    const Document d;
    const RecoveryJournal unused(d, {.folder = folder_ / "never"});
  }
  EXPECT_FALSE(fs::exists(folder_ / "never")) << "without edits nothing is written";
}

TEST_F(Recovery, OneThatIsHeldOrDiscardedIsOfferedNoMore) {
  const auto file = dead_journal(fill);
  {
    auto held = io::ClaimedJournal::claim(file);
    ASSERT_TRUE(held.ok());
    EXPECT_TRUE(io::found_journals(folder_).empty());
  }
  EXPECT_EQ(io::found_journals(folder_).size(), 1U);
  io::ClaimedJournal::claim(file)->discard();
  EXPECT_TRUE(io::found_journals(folder_).empty());
}

TEST_F(Recovery, WhatCannotBeWrittenIsReported) {
  std::ofstream(folder_ / "file") << "no folder";
  std::atomic<int> told{0};
  Document d;
  RecoveryJournal journal(d, {.folder = folder_ / "file",
                              .interval = milliseconds(1),
                              .trouble = [&](const std::string&) { ++told; }});
  fill(d);
  journal.changed();
  for (int i = 0; i < 5000 && told == 0; ++i) std::this_thread::sleep_for(milliseconds(1));
  std::this_thread::sleep_for(milliseconds(20));
  EXPECT_EQ(told, 1) << "once, not with every attempt";
}

/// Densities of the two materials that are always edited together.
std::pair<double, double> twins(const Document& d) {
  const auto now = d.now();
  const auto of = [&](const char* name) {
    const auto id = now->find(Kind::material, name);
    return id ? now->get(MaterialId{id->number})->density : -1.0;
  };
  return {of("left"), of("right")};
}

/// Edits without end; writes down when each edit was committed.
void edit_for_ever(const fs::path& folder, milliseconds interval, std::atomic<std::int64_t>* count,
                   std::atomic<std::int64_t>* times, std::int64_t most) {
  Document d;
  RecoveryJournal journal(d, {.folder = folder, .interval = interval});
  d.on_commit([&](const document::Commit&) { journal.changed(); });
  auto tx = d.begin("begin");
  model::Material m;
  m.density = 1;
  const auto left = *tx->add("left", m), right = *tx->add("right", m);
  (void)tx->commit().ok();
  times[1] = now_ns();
  *count = 1;
  for (std::int64_t k = 2; k < most; ++k) {
    auto step = d.begin("step");
    for (const auto id : {left, right})
      (void)step
          ->edit(id,
                 [&](model::Record& r) -> Result<void> {
                   std::get<model::Material>(r.body).density = static_cast<double>(k);
                   return {};
                 })
          .ok();
    // Records come and go, too.
    model::Solid ball;
    ball.material = left;
    ball.nodes.push_back({CsgKind::sphere, "ball", -1, {}, {0.1}});
    if (k % 3 == 0) (void)step->add("ball " + std::to_string(k), ball).ok();
    if (const auto old = step->now().find(Kind::solid, "ball " + std::to_string(k - 30)))
      (void)step->remove(*old).ok();
    (void)step->commit().ok();
    times[k] = now_ns();
    *count = k;
    std::this_thread::sleep_for(std::chrono::microseconds(200));
  }
}

TEST_F(Recovery, KilledAtRandomMomentsItIsWholeAndHardlyBehind) {
  constexpr std::int64_t kMost = 100000;
  constexpr milliseconds kInterval{20};
  // Seconds that the thread may be kept from writing on a busy machine; 5 s is what is promised.
  constexpr std::int64_t kMostBehind = std::int64_t{2'000'000'000};
  const std::size_t bytes = sizeof(std::atomic<std::int64_t>) * (kMost + 1);
  auto* shared = static_cast<std::atomic<std::int64_t>*>(
      ::mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0));
  ASSERT_NE(shared, MAP_FAILED);
  std::mt19937_64 random(test::seed());
  int restored = 0;
  for (int round = 0; round < 20; ++round) {
    fs::remove_all(folder_);
    shared[0] = 0;
    const pid_t child =
        start([&] { edit_for_ever(folder_, kInterval, &shared[0], shared, kMost); });
    while (shared[0] == 0) std::this_thread::sleep_for(milliseconds(1));
    std::this_thread::sleep_for(
        std::chrono::microseconds(std::uniform_int_distribution<int>(0, 250000)(random)));
    const std::int64_t last = shared[0], when = now_ns();
    kill_now(child);
    const auto found = io::found_journals(folder_);
    if (found.empty()) {
      EXPECT_LT(when - shared[1], kMostBehind) << "the first edit was not written in time";
      continue;
    }
    ++restored;
    Document d;
    EXPECT_TRUE(restore(found.back().file, d).empty());
    const auto [left, right] = twins(d);
    EXPECT_EQ(left, right) << "an entry is one snapshot";
    const auto k = static_cast<std::int64_t>(left);
    ASSERT_GE(k, 1);
    EXPECT_LE(k, static_cast<std::int64_t>(shared[0]) + 1);
    EXPECT_TRUE(k >= last || when - shared[k + 1] < kMostBehind) << "edit " << k << " of " << last;
    std::size_t balls = 0;
    for (std::int64_t b = 3; b <= k; b += 3)
      balls += d.now()->find(Kind::solid, "ball " + std::to_string(b)).has_value() ? 1U : 0U;
    EXPECT_EQ(balls + 2, d.now()->size()) << "nothing of later edits, nothing removed before";
  }
  EXPECT_GT(restored, 10) << "most are killed after the first entry";
  ::munmap(shared, bytes);
}

TEST_F(Recovery, AnyBeginningOfTheFileGivesAStateThatThereWas) {
  std::int64_t entries = 0;
  const pid_t child = start([&] {
    Document d;
    RecoveryJournal journal(d, {.folder = folder_, .interval = milliseconds(1)});
    d.on_commit([&](const document::Commit&) { journal.changed(); });
    model::Material m;
    auto tx = d.begin("begin");
    const auto id = *tx->add("left", m);
    (void)tx->add("right", m).ok();
    (void)tx->commit().ok();
    for (int k = 1; k <= 10; ++k) {
      std::this_thread::sleep_for(milliseconds(10));
      auto step = d.begin("step");
      for (const AnyId each : {AnyId(id), *step->now().find(Kind::material, "right")})
        (void)step
            ->edit(each,
                   [&](model::Record& r) -> Result<void> {
                     std::get<model::Material>(r.body).density = k;
                     return {};
                   })
            .ok();
      (void)step->commit().ok();
    }
    std::this_thread::sleep_for(milliseconds(50));
    ::raise(SIGKILL);
  });
  int status = 0;
  ::waitpid(child, &status, 0);
  const auto found = io::found_journals(folder_);
  ASSERT_EQ(found.size(), 1U);
  std::ifstream in(found[0].file, std::ios::binary);
  const std::string bytes((std::istreambuf_iterator<char>(in)), {});
  const fs::path cut = folder_ / "cut.journal";
  double last = 0;
  for (std::size_t length = 0; length <= bytes.size(); length += 13) {
    std::ofstream(cut, std::ios::binary).write(bytes.data(), static_cast<std::streamsize>(length));
    const auto all = io::found_journals(folder_);
    const auto one =
        std::find_if(all.begin(), all.end(), [&](const auto& j) { return j.file == cut; });
    if (one == all.end()) continue;
    Document d;
    EXPECT_TRUE(restore(cut, d).empty());
    const auto [left, right] = twins(d);
    EXPECT_EQ(left, right) << length;
    if (left != last) ++entries;
    last = left;
  }
  EXPECT_GT(entries, 3);
  // A damaged byte ends it there.
  std::string damaged = bytes;
  damaged[bytes.size() / 2] = static_cast<char>(damaged[bytes.size() / 2] ^ 1);
  std::ofstream(cut, std::ios::binary)
      .write(damaged.data(), static_cast<std::streamsize>(damaged.size()));
  for (const auto& j : io::found_journals(folder_)) {
    if (j.file != cut) continue;
    EXPECT_GT(j.unread, 0U);
    Document d;
    restore(cut, d);
    EXPECT_EQ(twins(d).first, twins(d).second);
  }
}

TEST_F(Recovery, ALongJournalIsWrittenAnew) {
  Document d;
  RecoveryJournal journal(d, {.folder = folder_, .interval = milliseconds(1)});
  model::Solid big;
  for (int i = 0; i < 3000; ++i)
    big.nodes.push_back({CsgKind::sphere, "node" + std::to_string(i), i == 0 ? -1 : 0, {}, {0.1}});
  big.nodes[0] = {CsgKind::union_, "all", -1, {}, {}};
  const auto id = test::make(d, "big", big);
  std::uintmax_t largest = 0;
  for (int k = 0; k < 120; ++k) {
    auto tx = d.begin("step");
    ASSERT_TRUE(tx->edit(id, [&](model::Record& r) -> Result<void> {
                    std::get<model::Solid>(r.body).nodes[1].sizes[0] = 1 + k;
                    return {};
                  }).ok());
    ASSERT_TRUE(tx->commit().ok());
    journal.changed();
    std::this_thread::sleep_for(milliseconds(8));
    std::error_code ec;
    if (const auto file = journal.file(); !file.empty())
      largest = std::max(largest, fs::file_size(file, ec));
  }
  EXPECT_LT(largest, std::uintmax_t{6} << 20) << "it must not grow with every edit for ever";
}

}  // namespace
}  // namespace robomosp
