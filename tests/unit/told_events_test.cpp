// SPDX-License-Identifier: Apache-2.0
// Events for what a window shows besides records: executed commands without their secrets,
// providers, sessions, saved state, settings, memory and drafts.
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include <robomosp/sdk/ik.h>

#include "ioci/core/commands.h"
#include "ioci/core/handle_text.h"
#include "ioci/core/lua_line.h"
#include "ioci/core/secrets.h"
#include "ioci/core/surroundings.h"
#include "support/program.h"

namespace robomosp::ioci {
namespace {

using namespace std::chrono_literals;

class ToldEvents : public test::CommandTest {
 protected:
  std::int64_t listen(const char* topic, Map more = {}) {
    more.set("topics", List{topic});
    return *call("event.subscribe", more).as_int();
  }
  List take(std::int64_t token) { return *call("event.take", {{"subscription", token}}).as_list(); }
  /// Takes events until one is as wanted.
  Value wait_for(std::int64_t token, const std::function<bool(const Value&)>& is_it) {
    const auto end = std::chrono::steady_clock::now() + 60s;
    while (std::chrono::steady_clock::now() < end) {
      for (const Value& e : take(token))
        if (is_it(e)) return e;
      std::this_thread::sleep_for(5ms);
    }
    ADD_FAILURE() << "it did not come";
    return {};
  }
  static std::string word(const Value& event, const char* name) {
    const Value* v = event.as_map()->find(name);
    return v ? v->text() : "";
  }
};

TEST_F(ToldEvents, EveryCommandIsToldOnceAsALineThatRunsItAgain) {
  const auto token = listen("command");
  call("material.create", {{"name", "steel"}, {"density", 0.1}, {"source", "a \"b\""}});
  EXPECT_FALSE(app().dispatch(session_, "material.set", {{"id", "nobody"}, {"density", 1}}).ok());
  call("material.list");
  EXPECT_FALSE(app().dispatch(session_, "material.describe", {{"id", "nobody"}}).ok());
  const List all = take(token);
  ASSERT_EQ(all.size(), 3U) << "what only reads is left out, unless it fails";
  EXPECT_EQ(word(all[0], "line"),
            "material.create{name = \"steel\", density = 0.1, source = \"a \\\"b\\\"\"}");
  EXPECT_EQ(word(all[0], "command"), "material.create");
  EXPECT_EQ(word(all[0], "outcome"), "done");
  EXPECT_EQ(word(all[0], "session"), "test");
  EXPECT_EQ(at(all[0], "session_number").number(),
            static_cast<double>(app().author(session_).session));
  EXPECT_GE(at(all[0], "seconds").number(), 0);
  EXPECT_EQ(all[0].as_map()->find("whole"), nullptr);
  EXPECT_EQ(word(all[1], "outcome"), "failed");
  EXPECT_EQ(word(all[1], "code"), "unknown_name");
  EXPECT_NE(word(all[1], "text").find("nobody"), std::string::npos);
  EXPECT_EQ(word(all[2], "command"), "material.describe");
  EXPECT_EQ(word(all[2], "line"), "material.describe{id = \"nobody\"}");
}

TEST_F(ToldEvents, ReadingCommandsComeWhereTheyAreWantedAndOwnOnesWhereTheyAreNot) {
  const auto reads = listen("command", {{"reads", true}});
  const auto others = listen("command", {{"own", false}});
  call("material.list");
  call("material.create", {{"name", "steel"}, {"density", 1}});
  Session other("other");
  ASSERT_TRUE(app().dispatch(other, "material.create", {{"name", "brass"}, {"density", 1}}).ok());
  std::vector<std::string> names;
  for (const Value& e : take(reads))  // whether it reports its own start depends on others
    if (word(e, "command") != "event.subscribe") names.push_back(word(e, "command"));
  EXPECT_EQ(names,
            (std::vector<std::string>{"material.list", "material.create", "material.create"}));
  const List theirs = take(others);
  ASSERT_EQ(theirs.size(), 1U);
  EXPECT_EQ(word(theirs[0], "session"), "other");
}

TEST_F(ToldEvents, ACommandInAJobAGestureOrADraftSaysSo) {
  const auto token = listen("command");
  const Value job =
      *app().dispatch_async(session_, "material.create", {{"name", "steel"}, {"density", 1}});
  call("job.wait", {{"id", job}});
  const Value e =
      wait_for(token, [&](const Value& v) { return word(v, "command") == "material.create"; });
  EXPECT_EQ(*at(e, "job").as_handle(), *job.as_handle());
  const Value gesture = call("gesture.begin", {{"label", "drag"}});
  ASSERT_TRUE(app()
                  .update_gesture(session_, static_cast<std::uint64_t>(*gesture.as_int()),
                                  "material.set", {{"id", "steel"}, {"density", 2}})
                  .ok());
  call("gesture.commit", {{"gesture", gesture}});
  const Value draft = call("draft.open", {{"label", "try"}});
  ASSERT_TRUE(app()
                  .dispatch_on_draft(session_, static_cast<std::uint64_t>(*draft.as_int()),
                                     "material.set", {{"id", "steel"}, {"density", 3}})
                  .ok());
  call("draft.run", {{"draft", draft},
                     {"command", "material.set"},
                     {"arguments", Map{{"id", "steel"}, {"density", 4}}}});
  call("draft.discard", {{"draft", draft}});
  const List all = take(token);
  std::vector<std::string> names;
  for (const Value& one : all) names.push_back(word(one, "command"));
  EXPECT_EQ(names,
            (std::vector<std::string>{"gesture.begin", "material.set", "gesture.commit",
                                      "draft.open", "material.set", "draft.run", "draft.discard"}))
      << "what a command dispatches is a part of it";
  EXPECT_EQ(at(all[1], "gesture"), gesture);
  EXPECT_EQ(at(all[4], "draft"), draft);
}

TEST_F(ToldEvents, SecretsAreInNoEventAndNoMessage) {
  const auto token = listen("command");
  const auto messages = listen("message");
  const std::string secret = "rmp-9f0c1d";
  (void)app().dispatch(session_, "draft.run",
                       {{"draft", 1},
                        {"command", "connection.open"},
                        {"arguments", Map{{"address", "unix:x"}, {"token", secret}}}});
  (void)app().dispatch(session_, "material.create",
                       {{"name", "steel"},
                        {"density", 1},
                        {"api_token", secret},
                        {"deep", List{Map{{"Password", secret}}}}});
  const List all = take(token);
  ASSERT_EQ(all.size(), 2U);
  for (const Value& e : all) {
    EXPECT_EQ(word(e, "line").find(secret), std::string::npos) << word(e, "line");
    EXPECT_NE(word(e, "line").find("(secret)"), std::string::npos) << word(e, "line");
    EXPECT_EQ(at(e, "whole"), Value(false));
  }
  for (const Value& m : take(messages))
    EXPECT_EQ(word(m, "text").find(secret), std::string::npos) << word(m, "text");
  CommandSpec spec;
  spec.name = "connection.open";
  EXPECT_EQ(command_line(app(), spec, {{"address", "unix:x"}, {"token", secret}}),
            "connection.open{address = \"unix:x\", token = \"(secret)\"}");
}

TEST_F(ToldEvents, TheRuleOfSecretsIsByTheWordsOfAName) {
  for (const char* name : {"token", "Token", "api_token", "tokens", "PASSWORD", "key-passphrase",
                           "client.secret", "credential", "token_of_user", "secret_2"})
    EXPECT_TRUE(is_secret(name)) << name;
  for (const char* name :
       {"", "token_file", "tokenizer", "key", "name", "_", "passworded", "file", "secretary"})
    EXPECT_FALSE(is_secret(name)) << name;
  // Every command's own arguments that are secrets; a new one is to be looked at.
  std::vector<std::string> found;
  for (const CommandSpec* c : app().commands.list())
    for (const ParamSpec& p : c->params)
      if (is_secret(p.name)) found.push_back(c->name + " " + p.name);
  for (const std::string& one : found) EXPECT_NE(one.find("token"), std::string::npos) << one;
}

TEST_F(ToldEvents, ALineIsLuaThatGivesTheArgumentsBack) {
  call("material.create", {{"name", "steel"}, {"density", 1}});
  const Handle steel = Application::handle(*app().document.now()->find(Kind::material, "steel"));
  const auto line = [&](Map args) {
    CommandSpec spec;
    spec.name = "a.b";
    return lua_line(app(), spec, args);
  };
  EXPECT_EQ(line({}).text, "a.b()");
  EXPECT_EQ(line({{"id", steel}}).text, "a.b{id = \"steel\"}");
  EXPECT_EQ(line({{"id", Handle{"job", 7}}}).text, "a.b{id = \"job#7\"}");
  EXPECT_EQ(line({{"end", 1}, {"a b", 2}, {"\xC3\xA9", 3}}).text,
            "a.b{[\"end\"] = 1, [\"a b\"] = 2, [\"\xC3\xA9\"] = 3}");
  EXPECT_EQ(line({{"x", std::numeric_limits<double>::infinity()},
                  {"y", -std::numeric_limits<double>::infinity()},
                  {"z", std::nan("")},
                  {"i", std::numeric_limits<std::int64_t>::min()},
                  {"e", 1e300},
                  {"s", 5e-324}})
                .text,
            "a.b{x = 1/0, y = -1/0, z = 0/0, i = math.mininteger, e = 1e+300, s = 5e-324}");
  EXPECT_EQ(line({{"s", std::string("\n\t\0\x7f\\\"\xff", 7)}}).text,
            "a.b{s = \"\\n\\009\\000\\127\\\\\\\"\\255\"}");
  EXPECT_EQ(line({{"m", NumericArray({1, 2, 3, 4}, 2, 2)}, {"v", NumericArray({1, 2})}}).text,
            "a.b{m = {{1, 2}, {3, 4}}, v = {1, 2}}");
  EXPECT_EQ(line({{"l", List{1, Map{{"a", List{}}}, true, Value()}}}).text,
            "a.b{l = {1, {a = {}}, true, nil}}");
  const LuaLine cut = line({{"v", NumericArray(std::vector<double>(1'000'000, 0.5))}});
  EXPECT_FALSE(cut.is_whole);
  EXPECT_LT(cut.text.size(), 70'000U);
  Value deep(1);
  for (int i = 0; i < 1'000; ++i) {
    List one;
    one.push_back(std::move(deep));
    deep = std::move(one);
  }
  EXPECT_TRUE(line({{"deep", std::move(deep)}}).is_whole);
}

TEST_F(ToldEvents, ALineNamesTheKindWhereOthersHaveTheName) {
  call("material.create", {{"name", "twin"}, {"density", 1}});
  call("solid.create", {{"name", "twin"}, {"root", Map{{"kind", "sphere"}, {"radius", 1}}}});
  call("world.create", {{"name", "twin"}});
  call("material.create", {{"name", "alone"}, {"density", 1}});
  const auto now = app().document.now();
  const auto line = [&](const Handle& h) {
    CommandSpec spec;
    spec.name = "a.b";
    return lua_line(app(), spec, {{"id", h}}).text;
  };
  const Handle alone = Application::handle(*now->find(Kind::material, "alone"));
  EXPECT_EQ(line(alone), "a.b{id = \"alone\"}");
  const Handle world = Application::handle(*now->find(Kind::world, "twin"));
  EXPECT_EQ(line(world), "a.b{id = \"world:twin\"}");
  // Each text means its record, whatever kinds are taken.
  for (const AnyId id : now->list()) {
    const Handle h = Application::handle(id);
    const auto text = reference_text(*now, h);
    ASSERT_TRUE(text);
    for (const std::string& kinds :
         {std::string("any"), h.kind, "material|solid|world|" + h.kind}) {
      const auto found = app().resolve(*now, kinds, Value(*text));
      ASSERT_TRUE(found.ok()) << *text << ": " << found.error().sentence();
      EXPECT_EQ(*found, h) << *text << " as " << kinds;
    }
  }
  EXPECT_FALSE(app().resolve(*now, "solid", Value("world:twin")).ok());
  // What there is, is named so that each name can be used.
  EXPECT_EQ(app().resolve(*now, "any", Value("nowhere near")).error().hint,
            "There are material:twin, alone, solid:twin and world:twin.");
}

TEST_F(ToldEvents, SessionsAreToldWhenTheyOpenAndClose) {
  const auto token = listen("session");
  std::int64_t number = 0;
  {
    Session silent("silent");  // has called nothing, so that nobody knows it
    Session other("other", SessionKind::window);
    ASSERT_TRUE(app().dispatch(other, "material.create", {{"name", "m"}, {"density", 1}}).ok());
    number = static_cast<std::int64_t>(other.number());
    const List opened = take(token);
    ASSERT_EQ(opened.size(), 1U);
    EXPECT_EQ(word(opened[0], "what"), "opened");
    EXPECT_EQ(word(opened[0], "kind"), "window");
    EXPECT_EQ(at(opened[0], "session_number"), Value(number));
  }
  const List closed = take(token);
  ASSERT_EQ(closed.size(), 1U);
  EXPECT_EQ(word(closed[0], "what"), "closed");
  EXPECT_EQ(word(closed[0], "session"), "other");
  EXPECT_EQ(at(closed[0], "session_number"), Value(number));
}

TEST_F(ToldEvents, ProvidersThatComeGoOrBecomeTheDefaultAreTold) {
  const auto token = listen("provider");
  const auto added =
      app().registry.add({.interface_id = IkSolver::kInterfaceId,
                          .name = "told",
                          .summary = "for a test",
                          .tags = {},
                          .origin = "test",
                          .version = "1",
                          .schema = {}},
                         []() -> Result<void*> { return error(ErrorCode::unsupported, "none"); });
  ASSERT_TRUE(added.ok());
  call("provider.default", {{"interface", "ik"}, {"name", "told"}});
  call("provider.default", {{"interface", "ik"}, {"name", ""}});
  call("provider.disable", {{"interface", "ik"}, {"name", "told"}});
  app().registry.remove(IkSolver::kInterfaceId, "told");
  call("material.list");
  std::vector<std::string> words;
  for (const Value& e : take(token)) {
    EXPECT_EQ(word(e, "interface"), IkSolver::kInterfaceId);
    words.push_back(word(e, "what") + " " + word(e, "name"));
  }
  EXPECT_EQ(words, (std::vector<std::string>{"registered told", "default told", "default ",
                                             "disabled told", "withdrawn told"}));
}

TEST_F(ToldEvents, AnEndedSubscriptionIsForgotten) {
  const auto token = listen("change");
  call("event.unsubscribe", {{"subscription", token}});
  for (const char* command : {"event.take", "event.unsubscribe"}) {
    const auto again = app().dispatch(session_, command, {{"subscription", token}});
    ASSERT_FALSE(again.ok()) << command;
    EXPECT_EQ(again.error().code, ErrorCode::unknown_name);
  }
}

TEST_F(ToldEvents, ProvidersThatChangedWhileNobodyListenedAreNotTold) {
  const auto first = listen("provider");
  call("event.unsubscribe", {{"subscription", first}});
  ASSERT_TRUE(app()
                  .registry
                  .add({.interface_id = IkSolver::kInterfaceId,
                        .name = "unheard",
                        .summary = "for a test",
                        .tags = {},
                        .origin = "test",
                        .version = "1",
                        .schema = {}},
                       []() -> Result<void*> { return error(ErrorCode::unsupported, "none"); })
                  .ok());
  call("material.list");
  const auto token = listen("provider");
  call("material.list");
  EXPECT_TRUE(take(token).empty());
  app().registry.remove(IkSolver::kInterfaceId, "unheard");
  call("material.list");
  const List told = take(token);
  ASSERT_EQ(told.size(), 1U);
  EXPECT_EQ(word(told[0], "what"), "withdrawn");
}

TEST_F(ToldEvents, WhatIsNotSavedIsListedAndToldWhenItChanges) {
  namespace fs = std::filesystem;
  const fs::path folder =
      fs::temp_directory_path() / ("robomosp-unsaved-" + std::to_string(::getpid()));
  fs::create_directories(folder);
  call("material.create", {{"name", "old"}, {"density", 1}});
  const auto token = listen("unsaved");
  const auto has = [](const Value& e, const char* list, std::size_t n) {
    return e.as_map()->find(list)->as_list()->size() == n;
  };
  wait_for(token, [&](const Value& e) { return has(e, "unsaved", 1); });
  call("material.create", {{"name", "steel"}, {"density", 7850}});
  Value e = wait_for(token, [&](const Value& v) { return has(v, "unsaved", 1); });
  EXPECT_EQ(at(e, "count"), Value(2));
  const auto why = [&](const char* name) -> std::string {
    const Value left = call("document.unsaved");
    for (const Value& one : *left.as_list())
      if (at(one, "name").text() == name) return at(one, "why").text();
    return "";
  };
  EXPECT_EQ(why("steel"), "no file");
  const std::string file = (folder / "steel.mtr").string();
  call("material.save", {{"id", "steel"}, {"file", file}});
  e = wait_for(token, [&](const Value& v) { return has(v, "saved", 1); });
  EXPECT_EQ(at(e, "count"), Value(1));
  EXPECT_EQ(why("steel"), "");
  call("material.set", {{"id", "steel"}, {"density", 7800}});
  e = wait_for(token, [&](const Value& v) { return has(v, "unsaved", 1); });
  EXPECT_EQ(at(e, "unsaved").as_list()->front().as_handle()->kind, "material");
  EXPECT_EQ(why("steel"), "differs");
  call("document.undo");
  wait_for(token, [&](const Value& v) { return has(v, "saved", 1); });
  EXPECT_EQ(why("steel"), "");
  call("material.remove", {{"id", "old"}});
  e = wait_for(token, [&](const Value& v) { return has(v, "saved", 1); });
  EXPECT_EQ(at(e, "count"), Value(0)) << "what is gone is nothing to save";
  fs::remove(file);
  EXPECT_EQ(why("steel"), "differs");
  fs::remove_all(folder);
}

TEST_F(ToldEvents, SettingsAndDraftsAreTold) {
  const auto settings = listen("setting");
  const auto drafts = listen("draft");
  const Value bytes = call("document.history_memory");
  EXPECT_TRUE(take(settings).empty()) << "it was only asked";
  call("document.history_memory", {{"bytes", bytes}});
  const List told = take(settings);
  ASSERT_EQ(told.size(), 1U);
  EXPECT_EQ(word(told[0], "name"), "history_memory");
  EXPECT_EQ(at(told[0], "value"), bytes);
  EXPECT_EQ(word(told[0], "session"), "test");
  const Value draft = call("draft.open", {{"label", "try"}});
  call("draft.run", {{"draft", draft},
                     {"command", "material.create"},
                     {"arguments", Map{{"name", "steel"}, {"density", 1}}}});
  call("draft.accept", {{"draft", draft}});
  const Value other = call("draft.open", {{"label", "other"}});
  call("draft.discard", {{"draft", other}});
  std::vector<std::string> words;
  for (const Value& e : take(drafts)) words.push_back(word(e, "what") + " " + word(e, "label"));
  EXPECT_EQ(words, (std::vector<std::string>{"opened try", "edited try", "accepted try",
                                             "opened other", "discarded other"}));
}

TEST_F(ToldEvents, JobsSayWhoseTheyAre) {
  const auto token = listen("job");
  const Value job = *app().dispatch_async(session_, "material.list", {});
  call("job.wait", {{"id", job}});
  const Value e = wait_for(token, [](const Value& v) { return word(v, "state") == "done"; });
  EXPECT_EQ(word(e, "session"), "test");
  const Value jobs = call("job.list");
  for (const Value& one : *jobs.as_list())
    EXPECT_TRUE(at(one, "id") != job || word(one, "session") == "test");
}

TEST(Memory, ItsFiguresAreReadAndJudged) {
  const char* meminfo =
      "MemTotal:       16000000 kB\nMemFree:         1000000 kB\nMemAvailable:    4000000 kB\n";
  const auto machine = parse_memory(meminfo, "1000 250 100 1 0 1 0\n", 4096, "max\n", "");
  ASSERT_TRUE(machine);
  EXPECT_EQ(machine->total, 16'000'000ULL << 10);
  EXPECT_EQ(machine->available, 4'000'000ULL << 10);
  EXPECT_EQ(machine->used, 250U * 4096U);
  const auto group = parse_memory(meminfo, "", 4096, "2147483648\n", "2000000000\n");
  ASSERT_TRUE(group);
  EXPECT_EQ(group->total, 2147483648U);
  EXPECT_EQ(group->available, 147483648U);
  EXPECT_EQ(parse_memory(meminfo, "", 4096, "1000", "5000")->available, 0U);
  EXPECT_FALSE(parse_memory("", "", 4096, "", ""));
  EXPECT_FALSE(parse_memory("MemTotal: x kB\nMemAvailable: 1 kB\n", "", 4096, "", ""));
  using enum MemoryLevel;
  const auto level = [](std::uint64_t available, MemoryLevel before) {
    return level_of({1000, available, 0}, before);
  };
  EXPECT_EQ(level(500, fine), fine);
  EXPECT_EQ(level(100, fine), fine);
  EXPECT_EQ(level(99, fine), low);
  EXPECT_EQ(level(120, low), low) << "it does not flicker";
  EXPECT_EQ(level(151, low), fine);
  EXPECT_EQ(level(49, fine), critical);
  EXPECT_EQ(level(60, critical), critical);
  EXPECT_EQ(level(80, critical), low);
  EXPECT_EQ(level(200, critical), fine);
  EXPECT_EQ(level_of({0, 0, 0}, low), low);
  if (std::filesystem::exists("/proc/meminfo")) {
    const auto now = read_memory();
    ASSERT_TRUE(now);
    EXPECT_GT(now->total, 0U);
    EXPECT_LE(now->available, now->total);
    EXPECT_GT(now->used, 0U);
  }
}

TEST(EventBounds, CommandsAndNoticesBeyondTheBoundAreCountedAndStatesReplaced) {
  Events events;
  const auto token = events.subscribe({.most = 100});
  for (int i = 0; i < 1000; ++i) {
    CommandRun run;
    run.line = std::to_string(i);
    events.publish(std::move(run));
  }
  auto all = *events.take(token);
  ASSERT_LE(all.size(), 100U);
  EXPECT_EQ(all.back().command->line, "999");
  EXPECT_EQ(all.front().left_out + all.size(), 1000U);
  for (int i = 0; i < 1000; ++i)
    events.publish(Topic::memory, {"low", Map{{"available", i}}, true});
  all = *events.take(token);
  ASSERT_EQ(all.size(), 1U);
  EXPECT_EQ(*all[0].notice->facts.find("available"), Value(999));
  EXPECT_EQ(all[0].left_out, 0U);
}

}  // namespace
}  // namespace robomosp::ioci
