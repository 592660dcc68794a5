// SPDX-License-Identifier: Apache-2.0
// Commands, settings and hooks that plugins add (robomosp.module/1), through every door of the
// program; and what happens when a plugin does what it may not.
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <thread>

#include <gtest/gtest.h>

#include "io/native.h"
#include "ioci/core/commands.h"
#include "ioci/core/modules.h"
#include "lua/lua_state.h"
#include "remote/json.h"
#include "remote/rpc.h"
#include "shell/plugin_check.h"

namespace robomosp {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

const fs::path kBench = fs::path(MODULE_PLUGIN_DIR) / "module_bench.so";
const fs::path kLate = fs::path(MODULE_PLUGIN_DIR) / "module_late.so";

std::unique_ptr<ioci::Application> application() {
  ioci::ApplicationOptions options;
  options.plugin_path = {ROBOMOSP_PLUGIN_DIR};
  options.library = {fs::path(ROBOMOSP_SOURCE_DIR) / "scripts/library"};
  auto made = ioci::Application::create(std::move(options));
  EXPECT_TRUE(made.ok()) << made.error().sentence();
  return std::move(*made);
}

class ModuleTest : public testing::Test {
 protected:
  void SetUp() override {
    app_ = application();
    state_ = std::make_unique<lua::LuaState>(*app_, session_);
    const auto loaded = dispatch("plugin.load", {{"file", kBench.string()}});
    ASSERT_TRUE(loaded.ok()) << loaded.error().sentence();
    report_ = *loaded;
    folder_ = fs::temp_directory_path() / ("module-" + std::to_string(::getpid()));
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }
  Result<Value> dispatch(std::string_view name, const Map& args = {}) {
    return app_->dispatch(session_, name, args);
  }
  Value call(std::string_view name, const Map& args = {}) {
    auto r = dispatch(name, args);
    EXPECT_TRUE(r.ok()) << name << ": " << (r.ok() ? "" : r.error().sentence());
    return r.ok() ? *r : Value();
  }
  Error fails(std::string_view name, const Map& args = {}) {
    const std::string before = app_->document.content_digest();
    auto r = dispatch(name, args);
    EXPECT_FALSE(r.ok()) << name << " gave " << (r.ok() ? r->text() : "");
    EXPECT_EQ(app_->document.content_digest(), before);
    return r.ok() ? Error{} : r.error();
  }
  std::string eval(std::string_view code) {
    auto r = state_->eval(code);
    return r.ok() ? *r
                  : "ERROR " + std::string(to_string(r.error().code)) + ": " + r.error().sentence();
  }
  void set(const char* setting, Value value) {
    call("plugin.set", {{"plugin", "bench"}, {"setting", setting}, {"value", std::move(value)}});
  }
  [[nodiscard]] int heard(const char* what) {
    return static_cast<int>(call("bench.heard").as_map()->find(what)->number());
  }
  [[nodiscard]] bool was_said(std::string_view sentence) const {
    const auto recent = app_->messages.recent();
    return std::any_of(recent.begin(), recent.end(), [&](const Message& m) {
      return m.text.find(sentence) != std::string::npos;
    });
  }

  std::unique_ptr<ioci::Application> app_;
  ioci::Session session_{"test"};
  std::unique_ptr<lua::LuaState> state_;
  Value report_;
  fs::path folder_;
};

TEST_F(ModuleTest, ACommandIsCalledFromLuaOverJsonRpcAndIsInTheReference) {
  EXPECT_EQ(eval("return bench.typed{}[1]"), "0.005");
  EXPECT_EQ(eval("return bench.typed{length = '20 cm', mode = 'slow'}[1]"), "0.2");
  EXPECT_EQ(eval("m = material.create{name = 'brass', density = 8500}"), "");
  EXPECT_EQ(eval("return m:bench_name().name"), "brass") << "a method of handles that there are";
  EXPECT_EQ(eval("local v = bench.echo({1, 'a', {x = m, y = true}})\nreturn v[3].x.name"), "brass");
  EXPECT_NE(eval("return bench.typed{length = 3}").find("it must be 0 to 2 m"), std::string::npos)
      << eval("return bench.typed{length = 3}");
  EXPECT_NE(eval("return bench.typed{legnth = 3}").find("Did you mean \"length\""),
            std::string::npos);
  const auto words = state_->complete("bench.ty", 8).words;
  ASSERT_EQ(words.size(), 1U);
  EXPECT_EQ(words[0], "typed");

  remote::RpcServer server(*app_, session_, *state_);
  const auto answer = server.answer(std::string_view(
      R"({"jsonrpc":"2.0","id":1,"method":"bench.echo","params":{"value":[1,{"a":"b"}]}})"));
  ASSERT_TRUE(answer);
  EXPECT_NE(answer->find(R"("result":[1,{"a":"b"}])"), std::string::npos) << *answer;

  const auto pages = ioci::reference_pages(app_->commands);
  const std::string& page = pages.at("bench.md");
  EXPECT_NE(page.find("## bench.typed"), std::string::npos);
  EXPECT_NE(page.find("| `length` | real | m | `0.005` | A length. |"), std::string::npos) << page;
  EXPECT_NE(page.find("A command of the plugin `bench`."), std::string::npos);
  EXPECT_NE(pages.at("README.md").find("bench.typed"), std::string::npos);
  EXPECT_NE(call("help", {{"topic", "bench.typed"}}).text().find("One of fast and slow"),
            std::string::npos);
  EXPECT_EQ(call("ioci.describe", {{"command", "bench.typed"}})
                .as_list()
                ->front()
                .as_map()
                ->find("plugin")
                ->text(),
            "bench");
}

TEST_F(ModuleTest, WhatCannotBeUsedIsLeftOutWithASentence) {
  std::string remarks;
  for (const Value& r : *report_.as_map()->find("remarks")->as_list()) remarks += r.text() + "\n";
  EXPECT_EQ(remarks,
            "command \"Bench\" is skipped: its name is not topic.verb of lower-case letters, "
            "digits and _.\n"
            "command \"bench.bad_effect\" is skipped: its effect \"magic\" is not one of reads, "
            "edits, simulates, files_read, files_write, processes, providers, loads_code, "
            "stops and administers.\n"
            "command \"bench.nothing\" is skipped: it has no function to run.\n"
            "command \"bench.bad_result\" is skipped: its result has the unknown type "
            "\"tensor\".\n"
            "command \"robot.of_material\" is skipped: its parameter id is a material, which is "
            "not the topic of its name.\n"
            "command \"robot.fk\" is skipped: the program has a command of that name.\n"
            "command \"bench.echo\" is skipped: plugin \"bench\" has a command of that name.\n");
  EXPECT_TRUE(app_->commands.find("robot.fk")->plugin.empty()) << "ours stays";
  ioci::Session another("another");
  lua::LuaState scripted(*app_, another);
  ASSERT_TRUE(scripted.eval("late = 7").ok());
  // Another plugin's names are not taken either; the rest of it is there at once, in Lua too.
  const Value late = call("plugin.load", {{"file", kLate.string()}});
  EXPECT_EQ(late.as_map()->find("remarks")->as_list()->front().text(),
            "command \"bench.echo\" is skipped: plugin \"bench\" has a command of that name.");
  EXPECT_EQ(eval("return late.echo(5)"), "5");
  EXPECT_EQ(eval("return material.create{name = 'tin', density = 1}:late(6)"), "6");
  const Value plugins = call("plugin.list");
  for (const Value& plugin : *plugins.as_list())
    if (plugin.as_map()->find("id")->text() == "org.robomosp.test_bench") {
      EXPECT_EQ(plugin.as_map()->find("remarks")->as_list()->size(), 7U);
    }
  const shell::PluginCheck checked = shell::check_plugin(kBench.string());
  EXPECT_EQ(checked.exit_code, 0) << checked.text;
  EXPECT_NE(checked.text.find("command \"robot.fk\" is skipped"), std::string::npos)
      << checked.text;
  EXPECT_EQ(*scripted.eval("return late"), "7") << "a script's own global stays";
  EXPECT_EQ(*scripted.eval("return ioci.call('late.echo', 8)"), "8");
  EXPECT_TRUE(was_said("has no global name here, since late is something else"));
}

TEST_F(ModuleTest, FaultsOfAModuleAreSentencesThatNameIt) {
  const std::pair<const char*, const char*> kFaults[] = {
      {"bench.throws", "provider \"bench\" threw: a bug of the author"},
      {"bench.throws_int", "provider \"bench\" threw an unknown exception"},
      {"bench.not_a_number",
       "plugin \"bench\", bench.not_a_number: [2][2] of its result is not a finite number"},
      {"bench.wrong_type",
       "plugin \"bench\", bench.wrong_type: its result is of type string, not real"},
      {"bench.wrong_matrix",
       "plugin \"bench\", bench.wrong_matrix: a matrix of 2 by 2 has 3 numbers"},
      {"bench.too_deep", "plugin \"bench\", bench.too_deep: a value is nested deeper than 64"},
      {"bench.later_type",
       "plugin \"bench\", bench.later_type: a value has the type number 77, "
       "which this program does not know"},
      {"bench.extra_field",
       "plugin \"bench\", bench.extra_field: it has the field colour, which "
       "its table does not name"},
      {"bench.endless", "commands of plugins call each other more than 32 deep"},
      {"bench.misreads", "a failed result was read"},
      {"bench.other_thread", "bench.other_thread called run from another thread"},
  };
  for (const auto& [command, sentence] : kFaults) {
    const Error e = fails(command);
    EXPECT_EQ(e.code, ErrorCode::plugin_failed) << command;
    EXPECT_NE(e.sentence().find(sentence), std::string::npos) << command << ": " << e.sentence();
  }
  EXPECT_LT(fails("bench.endless").sentence().size(), 200U);
  EXPECT_NE(fails("bench.dangling").sentence().find("it gave a reference to what is not there"),
            std::string::npos);
  EXPECT_EQ(eval("return bench.echo(1)"), "1") << "the program goes on";
}

TEST_F(ModuleTest, OtherCommandsAreBoundToWhatTheCommandDeclaresAndTheSessionMay) {
  const Map create{{"name", "brass"}, {"density", 8500}};
  const auto ask = [&](const char* how, const char* what, const Map& args) {
    return dispatch(how, {{"command", what}, {"arguments", args}});
  };
  const std::string before = app_->document.content_digest();
  auto refused = ask("bench.ask", "material.create", create);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::permission);
  EXPECT_EQ(refused.error().sentence(),
            "plugin \"bench\", bench.ask: what called material.create may have the effects reads "
            "only, and material.create has edits. The plugin's command must declare them.");
  // What is done at times only is refused where it gets there: a robot of the library.
  refused = ask("bench.ask", "robot.get", {{"name", "pa10"}});
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().sentence(),
            "plugin \"bench\", bench.ask: what called robot.get may have the effects reads only, "
            "and with these arguments robot.get has others (edits, files_read). The plugin's "
            "command must declare them.");
  EXPECT_EQ(app_->document.content_digest(), before);
  // Of a command within a command within a command.
  refused = ask("bench.ask", "bench.ask_to_edit", {{"command", "material.create"}});
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::permission);

  ASSERT_TRUE(ask("bench.ask_to_edit", "material.create", create).ok());
  EXPECT_EQ(app_->document.now()->list(Kind::material).size(), 1U);
  ioci::Session reader("reader");
  reader.deny(Effect::edits);
  refused = app_->dispatch(reader, "bench.ask_to_edit",
                           {{"command", "material.create"}, {"arguments", create}});
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().sentence(),
            "session \"reader\" may not run bench.ask_to_edit, which edits the document. Start the "
            "session with the right to do so.");
  EXPECT_TRUE(app_->dispatch(reader, "bench.ask", {{"command", "version"}}).ok());

  // Its edits are one step, or none.
  call("bench.two_edits");
  EXPECT_EQ(app_->document.now()->list(Kind::material).size(), 3U);
  call("document.undo");
  EXPECT_EQ(app_->document.now()->list(Kind::material).size(), 1U);
  call("material.create", {{"name", "two"}, {"density", 1}});
  EXPECT_EQ(fails("bench.two_edits").sentence(),
            "plugin \"bench\", bench.two_edits: no material two.");
  EXPECT_FALSE(app_->document.now()->find(Kind::material, "one"));
}

TEST_F(ModuleTest, ALongOneRunsAsAJobReportsIsCancelledAndHoldsUpNobody) {
  const auto job = app_->dispatch_async(session_, "bench.wait", {{"seconds", 30}});
  ASSERT_TRUE(job.ok());
  ioci::Session other("other");
  while (app_->jobs.status(job->number)->fraction < 0.25) std::this_thread::sleep_for(1ms);
  EXPECT_EQ(app_->jobs.status(job->number)->what, "waiting");
  const auto begin = std::chrono::steady_clock::now();
  ASSERT_TRUE(
      app_->dispatch(other, "material.create", {{"name", "brass"}, {"density", 8500}}).ok());
  EXPECT_LT(std::chrono::steady_clock::now() - begin, 5s) << "an edit does not wait for it";
  EXPECT_EQ(app_->lock.stats().calls_within, 0U);
  ASSERT_TRUE(app_->jobs.cancel(job->number));
  const auto ended = app_->jobs.wait(job->number);
  ASSERT_FALSE(ended.ok());
  EXPECT_EQ(ended.error().code, ErrorCode::cancelled);
  EXPECT_EQ(eval("j = start('bench.wait', {seconds = 0.01})\nreturn j:wait()"), "waited");

  std::thread interrupting([&] {
    std::this_thread::sleep_for(50ms);
    session_.interrupt();
  });
  EXPECT_EQ(fails("bench.wait").code, ErrorCode::cancelled) << "Ctrl-C";
  interrupting.join();
  session_.clear_interrupt();
}

TEST_F(ModuleTest, SettingsAreSavedLoadedUndoneAndKeptWithoutThePlugin) {
  const auto setting = [&](const char* name) { return call("bench.setting", {{"value", name}}); };
  EXPECT_EQ(setting("gap").number(), 0.002);
  set("gap", "5 mm");
  EXPECT_EQ(setting("gap").number(), 0.005);
  call("document.undo");
  EXPECT_EQ(setting("gap").number(), 0.002);
  call("document.redo");
  EXPECT_EQ(setting("gap").number(), 0.005);
  EXPECT_NE(fails("plugin.set", {{"plugin", "bench"}, {"setting", "gap"}, {"value", 2}})
                .sentence()
                .find("gap"),
            std::string::npos);
  EXPECT_NE(fails("plugin.set", {{"plugin", "bench"}, {"setting", "gasp"}, {"value", 2}})
                .sentence()
                .find("Did you mean \"gap\"?"),
            std::string::npos);
  EXPECT_NE(fails("plugin.set", {{"plugin", "benhc"}, {"setting", "gap"}, {"value", 2}})
                .sentence()
                .find("Did you mean \"bench\"?"),
            std::string::npos);
  set("weights", NumericArray({1, 2.5, 1e300}));
  set("veto", "no \"such\" thing");
  const Value rows = call("plugin.settings", {{"plugin", "bench"}});
  const Map row = *rows.as_list()->front().as_map();
  EXPECT_EQ(row.find("setting")->text(), "gap");
  EXPECT_EQ(row.find("value")->number(), 0.005);
  EXPECT_EQ(row.find("default")->number(), 0.002);
  EXPECT_EQ(row.find("unit")->text(), "m");

  const Value files = call("file.save_all", {{"folder", folder_.string()}});
  ASSERT_EQ(files.as_list()->size(), 1U);
  const fs::path file = files.as_list()->front().text();
  EXPECT_EQ(file.filename(), "bench.settings");
  const std::string text = *io::read_file(file);

  // In a program without the plugin: said once, kept, saved as it was.
  const auto without = application();
  ioci::Session reader("reader");
  ASSERT_TRUE(without->dispatch(reader, "file.load", {{"file", file.string()}}).ok());
  std::size_t said = 0;
  for (const Message& m : without->messages.recent())
    said += m.text ==
            "The document has settings of the plugin \"bench\", which is not loaded; they are kept "
            "and saved as they are.";
  EXPECT_EQ(said, 1U);
  const auto listed = without->dispatch(reader, "plugin.settings", {});
  ASSERT_TRUE(listed.ok());
  ASSERT_EQ(listed->as_list()->size(), 3U);
  EXPECT_EQ(listed->as_list()->front().as_map()->find("loaded")->text(), "false");
  const auto blind = without->dispatch(reader, "plugin.set",
                                       {{"plugin", "bench"}, {"setting", "gap"}, {"value", 0.1}});
  ASSERT_FALSE(blind.ok());
  EXPECT_EQ(blind.error().sentence(),
            "the plugin \"bench\" is not loaded, so its settings cannot be checked. They are kept "
            "unchanged until it is.");
  fs::remove(file);
  ASSERT_TRUE(without->dispatch(reader, "file.save_all", {{"folder", folder_.string()}}).ok());
  EXPECT_EQ(*io::read_file(file), text) << "not a byte is lost";
  ASSERT_TRUE(without->dispatch(reader, "plugin.load", {{"file", kBench.string()}}).ok());
  EXPECT_EQ(without->dispatch(reader, "bench.setting", {{"value", "gap"}})->number(), 0.005);

  // What somebody wrote into the file and does not fit is said where it is wanted.
  std::ofstream(file) << "robomosp settings 1\nname bench\nof bench {\n  gap 7\n}\n";
  const auto odd = application();
  ASSERT_TRUE(odd->dispatch(reader, "plugin.load", {{"file", kBench.string()}}).ok());
  const auto read = odd->dispatch(reader, "file.load", {{"file", file.string()}});
  ASSERT_TRUE(read.ok()) << read.error().sentence();
  const auto wrong = odd->dispatch(reader, "bench.setting", {{"value", "gap"}});
  ASSERT_FALSE(wrong.ok());
  EXPECT_NE(wrong.error().sentence().find("settings of the plugin \"bench\""), std::string::npos)
      << wrong.error().sentence();

  call("plugin.set", {{"plugin", "bench"}, {"setting", "gap"}});
  EXPECT_EQ(setting("gap").number(), 0.002) << "without a value it is the default";
  call("plugin.set", {{"plugin", "bench"}});
  EXPECT_TRUE(app_->document.now()->list(ioci::settings_kind()).empty());
}

TEST_F(ModuleTest, HooksHearOfRunsMayRefuseThemAndChangeNothing) {
  EXPECT_EQ(eval("arm = robot.create{name = 'arm', links = {{a = 0.3, mass = 1}, {a = 0.2, mass = "
                 "1}}}"),
            "");
  const int before = heard("before"), after = heard("after"), failures = heard("failures");
  const std::string run = "r = arm:simulate{q = {0.1, 0}, duration = 0.05}";
  EXPECT_EQ(eval(run), "");
  EXPECT_EQ(heard("before"), before + 1);
  EXPECT_EQ(heard("after"), after + 1);
  EXPECT_EQ(eval("return arm:fk{q = {0, 0}} ~= nil"), "true");
  EXPECT_EQ(heard("before"), before + 1) << "that is no run";
  EXPECT_EQ(eval("return start('bench.echo', {value = 3}):wait()"), "3");
  EXPECT_EQ(heard("before"), before + 2) << "a job is";
  EXPECT_NE(
      eval("arm:simulate{q = {0.1, 0}, duration = 0.05, controller = 'none_such'}").find("ERROR"),
      std::string::npos);
  EXPECT_EQ(heard("failures"), failures + 1);

  set("veto", "robot.simulate");
  const auto recordings = app_->recordings.list().size();
  EXPECT_EQ(eval(run),
            "ERROR conflict: robot.simulate was refused by the plugin \"bench\": the bench is "
            "locked. Unlock it.");
  EXPECT_NE(eval("return start('robot.simulate', {id = arm, q = {0.1, 0}, duration = 0.05}):wait()")
                .find("was refused by the plugin \"bench\""),
            std::string::npos);
  EXPECT_NE(eval("arm:start_run('dynamics', {q = {0.1, 0}, duration = 0.05})"), "")
      << "robot.start_run has a name of its own";
  EXPECT_EQ(app_->recordings.list().size(), recordings) << "nothing was run";
  call("provider.disable", {{"interface", "module"}, {"name", "bench"}});
  EXPECT_EQ(eval(run), "") << "a disabled module is not asked";
  EXPECT_NE(eval("return bench.echo(1)").find("which is disabled"), std::string::npos);
  call("provider.enable", {{"interface", "module"}, {"name", "bench"}});

  set("veto", "");
  set("hook", "edit");
  EXPECT_NE(eval(run).find("hooks cannot edit"), std::string::npos);
  EXPECT_TRUE(app_->document.now()->list(Kind::material).empty());
  set("hook", "throw");
  EXPECT_NE(eval(run).find("provider \"bench\" threw: a bug in a hook"), std::string::npos);
  set("hook", "fail_after");
  EXPECT_EQ(eval(run), "") << "what comes after it takes nothing back";
  EXPECT_TRUE(was_said("plugin \"bench\", after robot.simulate: the log is full."));
}

/// Modules are made when the program starts, so that one that crashes would end every start.
TEST_F(ModuleTest, OneThatEndsTheProcessIsNamedAndLeftOut) {
  const fs::path plugins = folder_ / "plugins", state = folder_ / "state";
  fs::create_directories(plugins);
  fs::copy_file(fs::path(MODULE_PLUGIN_DIR) / "module_crash.so", plugins / "module_crash.so");
  const char* set = std::getenv("XDG_STATE_HOME");
  const std::string before = set ? set : "";
  ::setenv("XDG_STATE_HOME", state.c_str(), 1);
  ioci::ApplicationOptions options;
  options.plugin_path = {plugins};
  auto made = ioci::Application::create(std::move(options));
  if (set) ::setenv("XDG_STATE_HOME", before.c_str(), 1);
  else ::unsetenv("XDG_STATE_HOME");
  ASSERT_TRUE(made.ok());
  bool is_named = false;
  for (const PluginReport& r : (*made)->plugins.reports())
    if (r.file.filename() == "module_crash.so") {
      is_named = true;
      ASSERT_TRUE(r.refusal);
      EXPECT_NE(r.refusal->sentence().find("SIGABRT"), std::string::npos) << r.refusal->sentence();
    }
  EXPECT_TRUE(is_named);
}

TEST_F(ModuleTest, TheExampleOfTheSdkAnswersAsItsPagesSay) {
  const auto loaded = dispatch("plugin.load", {{"file", PAYLOAD_PLUGIN}});
  ASSERT_TRUE(loaded.ok()) << loaded.error().sentence();
  EXPECT_TRUE(loaded->as_map()->find("remarks")->as_list()->empty());
  for (const char* name : {"robot.payload_margin", "robot.greatest_payload"}) {
    const ioci::CommandSpec* spec = app_->commands.find(name);
    ASSERT_TRUE(spec) << name;
    EXPECT_EQ(spec->plugin, "payload_margin");
    call("document.clear");
    const auto ran = state_->run_string(spec->example, name);
    EXPECT_TRUE(ran.ok()) << name << ": " << (ran.ok() ? "" : ran.error().sentence());
  }
  call("document.clear");
  // One joint with a bar of 1 kg: stretched out it holds m g l / 2 + payload g l.
  EXPECT_EQ(
      eval("arm = robot.create{name = 'arm', convention = 'dh', base = {rpy = {math.pi/2, 0, 0}},"
           " links = {{a = 1, mass = 1, com = {-0.5, 0, 0}, max_force = 20}}}"),
      "");
  EXPECT_EQ(
      eval("return math.abs(arm:payload_margin{payload = 1}.margin - (1 - 1.5*9.81/20)) < 1e-3"),
      "true")
      << eval("return arm:payload_margin{payload = 1}");
  EXPECT_EQ(eval("return math.abs(arm:greatest_payload() - (18 - 0.5*9.81)/9.81) < 2e-3"), "true")
      << eval("return arm:greatest_payload()");
  const std::string run = "arm:simulate{q = {0}, duration = 0.01}";
  EXPECT_EQ(eval(run + " return 1"), "1");
  EXPECT_EQ(eval("plugin.set('payload_margin', 'guard', true) plugin.set('payload_margin', "
                 "'payload', '5 kg')"),
            "");
  EXPECT_NE(eval(run).find("robot.simulate was refused by the plugin \"payload_margin\": with "),
            std::string::npos)
      << eval(run);
  // The robots of a world are guarded as well, in tasks too.
  EXPECT_EQ(
      eval("cell = world.create{name = 'cell'} cell:add_robot{robot = arm} task.create{name = "
           "'shift', steps = {{step = 'message', text = 'hello'}}} cell:add_task{task = "
           "'shift', robot = 'arm'}"),
      "");
  EXPECT_NE(eval("cell:run_task{}").find("world.run_task was refused by the plugin"),
            std::string::npos)
      << eval("cell:run_task{}");
  EXPECT_NE(eval("cell:start_run('tasks')").find("world.start_run was refused by the plugin"),
            std::string::npos);
  EXPECT_EQ(eval("plugin.set('payload_margin', 'payload', '500 g') " + run + " return 1"), "1");
  EXPECT_EQ(eval("r = cell:run_task{}"), "");
  const auto job = app_->dispatch_async(session_, "robot.payload_margin",
                                        {{"id", "arm"}, {"samples", 10000000}});
  ASSERT_TRUE(job.ok());
  while (app_->jobs.status(job->number)->fraction == 0) std::this_thread::sleep_for(1ms);
  ASSERT_TRUE(app_->jobs.cancel(job->number));
  EXPECT_EQ(app_->jobs.wait(job->number).error().code, ErrorCode::cancelled);
}

}  // namespace
}  // namespace robomosp
