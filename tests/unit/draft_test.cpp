// SPDX-License-Identifier: Apache-2.0
// Drafts: edits beside the document, alone and as commands; what others change meanwhile; many at
// once.
#include "document/draft.h"

#include <atomic>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "ioci/core/drafts.h"
#include "support/program.h"
#include "support/records.h"

namespace robomosp {
namespace {

using document::Document;
using document::Draft;

model::Material metal(double density) {
  model::Material m;
  m.density = density;
  return m;
}
void set_density(document::Transaction& tx, MaterialId id, double density) {
  ASSERT_TRUE(tx.edit(id, [&](model::Record& r) -> Result<void> {
                  std::get<model::Material>(r.body).density = density;
                  return {};
                }).ok());
}
double density_in(const document::Snapshot& s, MaterialId id) { return s.get(id)->density; }

TEST(Draft, NothingOfItIsSeenUntilItIsAcceptedAndUndoTakesItBackAtOnce) {
  Document d;
  const auto steel = test::make(d, "steel", metal(7850));
  const std::string before = d.content_digest();
  const std::uint64_t revision = d.now()->revision();
  Draft draft(d, "lighter", {});
  for (int i = 1; i <= 5; ++i) {
    auto tx = draft.begin("density");
    ASSERT_TRUE(tx.ok());
    set_density(*tx, steel, 7000 + i);
    ASSERT_TRUE(tx->add("copy " + std::to_string(i), metal(1.0 * i)).ok());
    ASSERT_TRUE(tx->commit().ok());
  }
  EXPECT_EQ(d.content_digest(), before);
  EXPECT_EQ(d.now()->revision(), revision);
  EXPECT_EQ(d.undo_labels().size(), 1U);
  EXPECT_EQ(density_in(*draft.now(), steel), 7005);
  EXPECT_GE(draft.now()->revision(), Draft::kFirstRevision);
  EXPECT_EQ(draft.changes().size(), 6U);
  const std::string wanted = document::content_digest(*draft.now());
  const auto commit = draft.accept();
  ASSERT_TRUE(commit.ok()) << commit.error().sentence();
  EXPECT_EQ(d.content_digest(), wanted);
  EXPECT_EQ(commit->changed.size(), 6U);
  EXPECT_EQ(d.now()->revision(), revision + 1);
  EXPECT_EQ(d.undo_labels(), (std::vector<std::string>{"lighter", "add steel"}));
  ASSERT_TRUE(d.undo().ok());
  EXPECT_EQ(d.content_digest(), before);
  EXPECT_FALSE(draft.is_open());
  EXPECT_FALSE(draft.begin("late").ok());
  EXPECT_FALSE(draft.accept().ok());
}

TEST(Draft, ATransactionThatFailsOrIsDroppedLeavesItAsItWas) {
  Document d;
  const auto steel = test::make(d, "steel", metal(7850));
  Draft draft(d, "lighter", {});
  {
    auto tx = draft.begin("dropped");
    set_density(*tx, steel, 1);
  }
  auto tx = draft.begin("taken name");
  set_density(*tx, steel, 2);
  EXPECT_FALSE(tx->add("steel", model::Material{}).ok());
  EXPECT_EQ(density_in(*draft.now(), steel), 7850);
  EXPECT_TRUE(draft.changes().empty());
  const auto none = draft.accept();
  ASSERT_TRUE(none.ok());
  EXPECT_TRUE(none->changed.empty());
  EXPECT_EQ(d.undo_labels().size(), 1U) << "a draft that changed nothing leaves no step";
}

TEST(Draft, WhatOthersChangedMeanwhileIsMergedOrNamed) {
  Document d;
  const auto steel = test::make(d, "steel", metal(7850));
  const auto brass = test::make(d, "brass", metal(8500));
  Draft draft(d, "lighter", {});
  {
    auto tx = draft.begin("density");
    set_density(*tx, steel, 7000);
    ASSERT_TRUE(tx->commit().ok());
  }
  {  // another record: both stay
    auto tx = d.begin("other", document::Author{7, "rig"});
    set_density(*tx, brass, 8400);
    ASSERT_TRUE(tx->commit().ok());
  }
  Draft second(d, "heavier", {});
  {
    auto tx = second.begin("density");
    set_density(*tx, steel, 9000);
    ASSERT_TRUE(tx->commit().ok());
  }
  ASSERT_TRUE(draft.accept().ok());
  EXPECT_EQ(density_in(*d.now(), steel), 7000);
  EXPECT_EQ(density_in(*d.now(), brass), 8400);
  const std::string before = d.content_digest();
  const auto refused = second.accept();  // the same record
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::conflict);
  EXPECT_NE(refused.error().message.find("material \"steel\" was changed"), std::string::npos)
      << refused.error().sentence();
  EXPECT_EQ(d.content_digest(), before);
  EXPECT_TRUE(second.is_open()) << "it can still be looked at";
  EXPECT_EQ(density_in(*second.now(), steel), 9000);
  // Once the other step is taken back, all that it looked at is as it was.
  ASSERT_TRUE(d.undo().ok());
  ASSERT_TRUE(second.accept().ok());
  EXPECT_EQ(density_in(*d.now(), steel), 9000);
}

TEST(Draft, ItsPreviewIsWhatAcceptingItWouldPublishNow) {
  Document d;
  const auto steel = test::make(d, "steel", metal(7850));
  const auto brass = test::make(d, "brass", metal(8500));
  const auto set = [&](auto& on, MaterialId id, double density) {
    auto tx = on.begin("density");
    ASSERT_TRUE(tx.ok());
    set_density(*tx, id, density);
    ASSERT_TRUE(tx->commit().ok());
  };
  Draft draft(d, "lighter", {});
  EXPECT_EQ(*draft.preview(), d.now()) << "no edits yet";
  set(draft, steel, 7000);
  EXPECT_EQ(*draft.preview(), draft.now()) << "nobody changed the document";
  set(d, brass, 8400);
  const auto both = draft.preview();
  ASSERT_TRUE(both.ok()) << both.error().sentence();
  EXPECT_EQ(density_in(**both, steel), 7000);
  EXPECT_EQ(density_in(**both, brass), 8400);
  EXPECT_GE((*both)->revision(), Draft::kFirstRevision);
  EXPECT_EQ(*draft.preview(), *both) << "the same as long as nothing changes";
  EXPECT_EQ(density_in(*d.now(), steel), 7850);
  // In conflict with the document, and no more once that is taken back.
  set(d, steel, 9000);
  const auto refused = draft.preview();
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.error().message.find("material \"steel\" was changed"), std::string::npos);
  EXPECT_EQ(draft.accept().error().message, refused.error().message);
  ASSERT_TRUE(d.undo().ok());
  const auto again = draft.preview();
  ASSERT_TRUE(again.ok()) << again.error().sentence();
  const std::string wanted = document::content_digest(**again);
  const auto records = {(*again)->share(AnyId(steel)), (*again)->share(AnyId(brass))};
  ASSERT_TRUE(draft.accept().ok());
  EXPECT_EQ(d.content_digest(), wanted);
  EXPECT_TRUE(std::equal(
      records.begin(), records.end(),
      std::initializer_list{d.now()->share(AnyId(steel)), d.now()->share(AnyId(brass))}.begin()))
      << "the records themselves, so that nothing is computed again";
  EXPECT_EQ(*draft.preview(), d.now());
}

TEST(Draft, TransactionsOnOneDraftOvertakeEachOtherAsOnTheDocument) {
  Document d;
  const auto steel = test::make(d, "steel", metal(7850));
  const auto brass = test::make(d, "brass", metal(8500));
  Draft draft(d, "both", {});
  auto a = draft.begin("a"), b = draft.begin("b"), c = draft.begin("c");
  set_density(*a, steel, 1);
  set_density(*b, brass, 2);
  set_density(*c, steel, 3);
  ASSERT_TRUE(a->commit().ok());
  ASSERT_TRUE(b->commit().ok()) << "it looked at another record";
  const auto refused = c->commit();
  ASSERT_FALSE(refused.ok());
  EXPECT_TRUE(c->is_overtaken());
  EXPECT_NE(refused.error().message.find("by another edit of the draft"), std::string::npos)
      << refused.error().sentence();
  EXPECT_EQ(density_in(*draft.now(), steel), 1);
  EXPECT_EQ(density_in(*draft.now(), brass), 2);
}

TEST(Draft, ADocumentThatWasClearedRefusesItAndATransactionThatEndsLateIsRefused) {
  Document d;
  test::make(d, "steel", metal(7850));
  Draft draft(d, "late", {}), gone(d, "gone", {});
  auto late = gone.begin("late");
  ASSERT_TRUE(late->add("brass", metal(1)).ok());
  EXPECT_TRUE(gone.discard());
  EXPECT_FALSE(gone.discard());
  EXPECT_EQ(late->commit().error().message, "the draft \"gone\" has ended");
  auto tx = draft.begin("density");
  ASSERT_TRUE(tx->add("brass", metal(1)).ok());
  ASSERT_TRUE(tx->commit().ok());
  d.clear();
  const auto refused = draft.accept();
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.error().message.find("cleared"), std::string::npos);
  EXPECT_TRUE(d.now()->list().empty());
}

class DraftCommands : public test::CommandTest {
 protected:
  Value on(const Value& draft, const char* command, Map args = {}) {
    return call("draft.run",
                {{"draft", draft}, {"command", command}, {"arguments", std::move(args)}});
  }
  Error refused(const Value& draft, const char* command, Map args = {}) {
    return fails("draft.run",
                 {{"draft", draft}, {"command", command}, {"arguments", std::move(args)}});
  }
};

/// What a program of edits leaves: a chain of records that refer to each other, edited, renamed and
/// removed.
std::vector<std::pair<std::string, Map>> program_of(int n) {
  const std::string own = "_" + std::to_string(n);
  std::vector<std::pair<std::string, Map>> out;
  for (int i = 0; i < 6; ++i) {
    const std::string m = "m" + std::to_string(i) + own, s = "s" + std::to_string(i) + own;
    out.push_back({"material.create", {{"name", m}, {"density", 1000.0 + n + i}}});
    out.push_back({"solid.create",
                   {{"name", s},
                    {"material", m},
                    {"root", Map{{"kind", "cylinder"}, {"radius", 0.1}, {"height", 0.1 + i}}}}});
    out.push_back({"material.set", {{"id", m}, {"density", 2000.0 + 10 * n + i}}});
  }
  out.push_back({"solid.rename", {{"id", "s0" + own}, {"name", "first" + own}}});
  out.push_back({"solid.remove", {{"id", "s1" + own}}});
  out.push_back({"material.set", {{"id", "m0" + own}, {"density", 1.0 / (3 + n)}}});
  return out;
}

TEST_F(DraftCommands, TenAtOnceInThreadsGiveTheBitsOfTenProgramsOneAfterAnother) {
  constexpr int kDrafts = 10;
  const auto run_all = [](ioci::Session& session, int n) {
    for (const auto& [command, args] : program_of(n)) {
      const auto r = app().dispatch(session, command, args);
      ASSERT_TRUE(r.ok()) << command << ": " << r.error().sentence();
    }
  };
  {
    ioci::Session one("one after another");
    for (int n = 0; n < kDrafts; ++n) run_all(one, n);
  }
  const std::string wanted = app().document.content_digest();
  app().document.clear();

  call("material.create", {{"name", "before"}, {"density", 1}});
  const std::string before = app().document.content_digest();
  std::atomic<int> ready{0};
  std::atomic<bool> may_accept{false};
  std::vector<std::thread> threads;
  for (int n = 0; n < kDrafts; ++n)
    threads.emplace_back([&, n] {
      ioci::Session own("draft " + std::to_string(n));
      const auto draft = app().dispatch(own, "draft.open", {{"label", "program"}});
      EXPECT_TRUE(draft.ok());
      for (const auto& [command, args] : program_of(n)) {
        const auto r = app().dispatch_on_draft(own, static_cast<std::uint64_t>(*draft->as_int()),
                                               command, args);
        EXPECT_TRUE(r.ok()) << command << ": " << r.error().sentence();
        EXPECT_EQ(app().document.content_digest(), before);
      }
      ++ready;
      while (!may_accept) std::this_thread::yield();
      const auto accepted = app().dispatch(own, "draft.accept", {{"draft", *draft}});
      EXPECT_TRUE(accepted.ok()) << accepted.error().sentence();
      EXPECT_EQ(app().document.undo_labels(app().author(own).session).size(), 1U);
    });
  while (ready < kDrafts) std::this_thread::yield();
  EXPECT_EQ(app().document.content_digest(), before);
  may_accept = true;
  for (std::thread& t : threads) t.join();
  call("material.remove", {{"id", "before"}});
  EXPECT_EQ(app().document.content_digest(), wanted);
}

TEST_F(DraftCommands, ManyJobsOnOneDraftGiveWhatTheyGiveOneAfterAnother) {
  const Value draft = call("draft.open", {{"label", "many"}});
  std::vector<Value> jobs;
  for (int i = 0; i < 40; ++i)
    jobs.push_back(call("draft.start", {{"draft", draft},
                                        {"command", "material.create"},
                                        {"arguments", Map{{"name", "m" + std::to_string(i)},
                                                          {"density", 1.0 + i}}}}));
  EXPECT_EQ(call("draft.list").as_list()->size(), 1U);
  for (const Value& job : jobs) call("job.wait", {{"id", job}});
  EXPECT_EQ(at(call("draft.changes", {{"draft", draft}}), "added").as_list()->size(), 40U);
  EXPECT_TRUE(app().document.now()->list().empty());
  call("draft.accept", {{"draft", draft}});
  EXPECT_EQ(app().document.now()->size(), 40U);
  for (int i = 0; i < 40; ++i)
    EXPECT_EQ(at(call("material.describe", {{"id", "m" + std::to_string(i)}}), "density").number(),
              1.0 + i);
  call("document.undo");
  EXPECT_TRUE(app().document.now()->list().empty());
}

TEST_F(DraftCommands, ACommandThatFailsOnADraftLeavesItAsItWas) {
  call("material.create", {{"name", "steel"}, {"density", 7850}});
  const Value draft = call("draft.open", {{"label", "try"}});
  on(draft, "material.set", {{"id", "steel"}, {"density", 7000}});
  refused(draft, "material.set", {{"id", "steel"}, {"density", -1}});
  refused(draft, "material.create", {{"name", "steel"}, {"density", 1}});
  const Value changes = call("draft.changes", {{"draft", draft}});
  ASSERT_EQ(at(changes, "edited").as_list()->size(), 1U);
  EXPECT_EQ(on(draft, "document.digest").text(),
            document::content_digest(*app().kept<ioci::Drafts>().list().front().draft->now()));
  EXPECT_EQ(at(on(draft, "material.describe", {{"id", "steel"}}), "density").number(), 7000);
  EXPECT_EQ(at(call("material.describe", {{"id", "steel"}}), "density").number(), 7850);
  call("draft.discard", {{"draft", draft}});
  EXPECT_EQ(fails("draft.accept", {{"draft", draft}}).code, ErrorCode::unknown_name);
}

TEST_F(DraftCommands, WhatDiscardingWouldNotTakeBackIsRefused) {
  const Value draft = call("draft.open", {{"label", "try"}});
  on(draft, "material.create", {{"name", "steel"}, {"density", 7850}});
  for (const char* command : {"document.undo", "document.clear", "gesture.commit", "draft.open",
                              "material.save", "file.save_all", "provider.disable", "quit"}) {
    const auto* spec = app().commands.find(command);
    ASSERT_NE(spec, nullptr) << command;
    const Error e = refused(draft, command);
    EXPECT_EQ(e.code, ErrorCode::unsupported) << command << ": " << e.sentence();
    EXPECT_NE(e.message.find("cannot run on a draft"), std::string::npos) << e.sentence();
  }
  EXPECT_FALSE(app().quit_requested);
  const Error e = refused(draft, "provider.default", {{"interface", "csg"}, {"name", "x"}});
  EXPECT_NE(e.message.find("cannot run on a draft"), std::string::npos) << e.sentence();
  call("draft.discard", {{"draft", draft}});
}

TEST_F(DraftCommands, ADraftBelongsToItsSessionAndEndsWithIt) {
  std::int64_t number = 0;
  {
    ioci::Session other("other");
    const auto made = app().dispatch(other, "draft.open", {{"label", "theirs"}});
    ASSERT_TRUE(made.ok());
    number = *made->as_int();
    EXPECT_EQ(fails("draft.accept", {{"draft", number}}).code, ErrorCode::unknown_name);
    const Value all = call("draft.list");
    ASSERT_EQ(all.as_list()->size(), 1U);
    EXPECT_EQ(at(all.as_list()->front(), "session").text(), "other");
    EXPECT_FALSE(*at(all.as_list()->front(), "mine").as_bool());
  }
  EXPECT_TRUE(call("draft.list").as_list()->empty());
}

}  // namespace
}  // namespace robomosp
