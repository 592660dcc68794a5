// SPDX-License-Identifier: Apache-2.0
// Every command is refused to a session that lacks one of its effects, and then has none: the
// document, the folder and the registry are as before.
#include <algorithm>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "docs/example_arguments.h"
#include "docs/examples.h"
#include "io/native.h"
#include "kernel/permit.h"
#include "lua/lua_state.h"

namespace robomosp::ioci {
namespace {

namespace fs = std::filesystem;
using test::arguments_of;
using test::examples_app;

/// What a command could have touched.
struct State {
  std::string digest;
  std::uint64_t revision = 0, registry = 0;
  std::size_t steps = 0, recordings = 0, jobs = 0, plugins = 0;
  std::map<std::string, std::pair<std::uintmax_t, fs::file_time_type>> files;
  bool operator==(const State&) const = default;
};

State state_now() {
  Application& app = examples_app();
  State s;
  s.digest = app.document.content_digest();
  s.revision = app.document.now()->revision();
  s.steps = app.document.history().size();
  s.registry = app.registry.revision();
  s.recordings = app.recordings.list().size();
  s.jobs = app.jobs.list().size();
  s.plugins = app.plugins.reports().size();
  for (const auto& entry : fs::recursive_directory_iterator("."))
    if (entry.is_regular_file())
      s.files[entry.path().string()] = {entry.file_size(), entry.last_write_time()};
  return s;
}

TEST(Effects, ACommandIsRefusedToASessionThatLacksOneOfThem) {
  const test::ExamplesFolder folder("effects");
  Application& app = examples_app();
  std::size_t refused = 0, tried = 0;
  for (const CommandSpec* spec : app.commands.list()) {
    const auto args = arguments_of(*spec);
    // Without a call of their own, such as job.cancel with no job: any arguments do, since the
    // permission is asked for first.
    const Map given = args.value_or(Map{});
    for (const Effect effect : (spec->effect | Effect::reads).list()) {
      const State before = state_now();
      Session guest("guest");
      guest.deny(effect);
      ++tried;
      const auto result = app.dispatch(guest, spec->name, given);
      ASSERT_FALSE(result.ok()) << spec->name << " without " << to_string(effect);
      EXPECT_EQ(result.error().code, ErrorCode::permission)
          << spec->name << ": " << result.error().sentence();
      EXPECT_TRUE(state_now() == before) << spec->name << " without " << to_string(effect);
      ++refused;
    }
    if (!args || test::cannot_draw(*spec)) continue;
    for (const Effect effect : spec->sometimes.list()) {
      const State before = state_now();
      Session guest("guest");
      guest.deny(effect);
      ++tried;
      const auto result = app.dispatch(guest, spec->name, given);
      const State after = state_now();
      if (!result.ok()) {
        // An example may show what fails for everybody, such as a plugin that is not there.
        Session owner("owner");
        const auto other = app.dispatch(owner, spec->name, given);
        const bool fails_anyway = !other.ok() && other.error().code == result.error().code;
        EXPECT_TRUE(fails_anyway || result.error().code == ErrorCode::permission)
            << spec->name << ": " << result.error().sentence();
        EXPECT_TRUE(fails_anyway || after == before)
            << spec->name << " without " << to_string(effect);
        ++refused;
      }
      // Where it is not refused, it did not need the effect.
      EXPECT_TRUE(effect != Effect::edits || after.digest == before.digest) << spec->name;
      EXPECT_TRUE(effect != Effect::files_write || after.files == before.files) << spec->name;
      EXPECT_TRUE(effect != Effect::providers || after.registry == before.registry) << spec->name;
    }
    Session owner("owner");
    if (spec->name == "server.start") (void)app.dispatch(owner, "server.stop", {});
  }
  app.document.clear();
  EXPECT_GT(tried, app.commands.list().size());
  EXPECT_GT(refused, app.commands.list().size());
}

TEST(Effects, NothingComesFromTheLibraryWithoutTheRightToEdit) {
  Application& app = examples_app();
  app.document.clear();
  Session guest("guest");
  guest.deny(Effect::edits);
  const auto refused = app.dispatch(guest, "robot.get", {{"name", "pa10"}});
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::permission);
  EXPECT_EQ(app.document.now()->size(), 0U);
  // A classic line loads what it names in the same way.
  EXPECT_FALSE(app.dispatch_classic(guest, "PRobot pa10 mGetDHP").ok());
  EXPECT_EQ(app.document.now()->size(), 0U);

  Session owner("owner");
  ASSERT_TRUE(app.dispatch(owner, "robot.get", {{"name", "pa10"}}).ok());
  EXPECT_TRUE(app.dispatch(guest, "robot.get", {{"name", "pa10"}}).ok())
      << "what is in the document is only found";
  app.document.clear();
}

Result<Value> write_in_secret(CommandContext&, const Map&) {
  RMP_TRY(io::write_file("secret.txt", "text"));
  return Value();
}
Result<Value> edit_in_secret(CommandContext& ctx, const Map&) {
  RMP_TRY_ASSIGN(auto tx, ctx.app.document.begin("secret"));
  RMP_TRY(tx.add("secret", model::Material{}));
  RMP_TRY(tx.commit());
  return Value();
}

TEST(Effects, ATableThatSaysTooLittleOpensNothing) {
  const test::ExamplesFolder folder("secrets");
  Application& app = examples_app();
  app.document.clear();
  const auto run = [&](Result<Value> (*body)(CommandContext&, const Map&)) {
    auto& spec = const_cast<CommandSpec&>(*app.commands.find("version"));
    const auto before = std::exchange(spec.run, body);
    Session session("owner");
    auto result = app.dispatch(session, "version", {});
    spec.run = before;
    return result;
  };
  const State before = state_now();
  for (const auto body : {write_in_secret, edit_in_secret}) {
    const auto result = run(body);
    ASSERT_FALSE(result.ok());
    EXPECT_EQ(result.error().code, ErrorCode::internal);
    EXPECT_NE(result.error().sentence().find("version"), std::string::npos);
    EXPECT_TRUE(state_now() == before);
  }
}

/// A script reaches out of the program through Lua's own libraries, too.
TEST(Effects, LuasOwnLibrariesAskAsWell) {
  const test::ExamplesFolder folder("lua-effects");
  ASSERT_TRUE(io::write_file("there.txt", "text").ok());
  ASSERT_TRUE(io::write_file("there.lua", "return 1").ok());
  struct Case {
    Effect effect;
    const char* code;
  };
  const Case cases[] = {
      {Effect::files_write, "io.open('new.txt', 'w')"},
      {Effect::files_write, "io.open('there.txt', 'r+')"},
      {Effect::files_write, "io.open('there.txt', 'a')"},
      {Effect::files_write, "io.output('new.txt')"},
      {Effect::files_write, "os.remove('there.txt')"},
      {Effect::files_write, "os.rename('there.txt', 'gone.txt')"},
      {Effect::files_write, "os.tmpname()"},
      {Effect::files_read, "io.open('there.txt')"},
      {Effect::files_read, "io.lines('there.txt')"},
      {Effect::files_read, "io.input('there.txt')"},
      {Effect::files_read, "dofile('there.lua')"},
      {Effect::files_read, "loadfile('there.lua')"},
      {Effect::files_read, "require('there')"},
      {Effect::processes, "os.execute('touch new.txt')"},
      {Effect::processes, "io.popen('touch new.txt')"},
      {Effect::loads_code, "package.cpath = './?.so' require('nowhere')"},
      {Effect::providers, "ioci.provide('robomosp.ik/1', 'mine', function() end)"},
      {Effect::providers, "ioci.withdraw('robomosp.ik/1', 'mine')"},
      {Effect::stops, "os.exit(3)"},
  };
  Application& app = examples_app();
  for (const Case& c : cases) {
    Session guest("guest");
    guest.deny(c.effect);
    lua::LuaState lua(app, guest, {.print = [](std::string_view) {}, .module_path = {"."}});
    const State before = state_now();
    const auto refused = lua.run_string(c.code, "case");
    ASSERT_FALSE(refused.ok()) << c.code;
    EXPECT_EQ(refused.error().code, ErrorCode::permission)
        << c.code << ": " << refused.error().sentence();
    EXPECT_TRUE(state_now() == before) << c.code;
    EXPECT_FALSE(lua.exit_requested().has_value()) << c.code;
  }
  Session owner("owner");
  lua::LuaState lua(app, owner, {.print = [](std::string_view) {}, .module_path = {"."}});
  const auto works = lua.run_string(
      "local f = io.open('new.txt', 'w') f:write('a\\nb') f:close()\n"
      "local n = 0 for line in io.lines('new.txt') do n = n + 1 end assert(n == 2)\n"
      "assert(dofile('there.lua') == 1 and require('there') == 1)\n"
      "local co = coroutine.wrap(function() return dofile('there.lua') end) assert(co() == 1)\n"
      "os.remove('new.txt')",
      "allowed");
  EXPECT_TRUE(works.ok()) << (works.ok() ? "" : works.error().sentence());
}

}  // namespace
}  // namespace robomosp::ioci
