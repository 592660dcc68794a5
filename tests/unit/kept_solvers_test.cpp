// SPDX-License-Identifier: Apache-2.0
// Solvers in Lua that travel with files: nothing runs before it is trusted, and then it computes
// and reads, and reaches nothing else.
#include <stdlib.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "io/native.h"
#include "ioci/core/kept_solvers.h"
#include "lua/lua_state.h"

namespace robomosp::lua {
namespace {

namespace fs = std::filesystem;

/// A program with a console, as one user has it.
struct Desk {
  explicit Desk(const std::string& user) {
    ::setenv("XDG_CONFIG_HOME", user.c_str(), 1);
    auto made =
        ioci::Application::create({.plugin_path = {ROBOMOSP_PLUGIN_DIR},
                                   .library = {fs::path(ROBOMOSP_SOURCE_DIR) / "scripts/library"}});
    EXPECT_TRUE(made.ok());
    app = std::move(*made);
    session = std::make_unique<ioci::Session>("desk");
    LuaOptions options;
    options.print = [](std::string_view) {};
    lua = std::make_unique<LuaState>(*app, *session, options);
  }
  ~Desk() {
    lua.reset();
    session.reset();
  }
  Desk(const Desk&) = delete;
  Desk& operator=(const Desk&) = delete;
  /// The readable text of an input's results, or its error behind "error: ".
  std::string eval(const std::string& code) const {
    const auto r = lua->eval(code);
    return r.ok() ? *r : "error: " + r.error().sentence();
  }
  [[nodiscard]] bool told(const std::string& code, const std::string& part) const {
    for (const Message& m : app->messages.recent(1000))
      if (m.code == code && m.text.find(part) != std::string::npos) return true;
    return false;
  }
  std::unique_ptr<ioci::Application> app;
  std::unique_ptr<ioci::Session> session;
  std::unique_ptr<LuaState> lua;
};

class KeptSolvers : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("kept-solvers-" + std::to_string(::getpid()));
    fs::remove_all(folder_);
    for (const char* name : {"author", "colleague", "files"})
      fs::create_directories(folder_ / name);
  }
  void TearDown() override { fs::remove_all(folder_); }
  [[nodiscard]] std::string user(const char* name) const { return (folder_ / name).string(); }
  [[nodiscard]] std::string file(const char* name) const {
    return (folder_ / "files" / name).string();
  }
  static std::string bytes(const std::string& path) {
    std::ifstream in(path, std::ios::binary);
    return std::string((std::istreambuf_iterator<char>(in)), {});
  }
  /// An arm of one joint whose torque a text tells, kept with it and saved.
  void mail(const std::string& path, const std::string& text, const std::string& arm = "arm") {
    const Desk author(user("author"));
    ASSERT_EQ(author
                  .eval("r = robot.create{name = '" + arm +
                        "', convention = 'dh', links = {{a = 1}}}; "
                        "provider.keep{interface = 'inverse_dynamics', name = 'mine', with = r, "
                        "text = [==[" +
                        text + "]==]}; r:set{inverse_dynamics = 'mine'}; r:save('" + path + "')")
                  .find("error"),
              std::string::npos);
  }
  static constexpr const char* kTorque = "return r:inverse_dynamics{q = {0}}";
  fs::path folder_;
};

TEST_F(KeptSolvers, AFileCarriesItsSolverAndNothingRunsUntilItIsTrusted) {
  mail(file("arm.rbt"), "trace = 1\nreturn function(model, q, qd, qdd) return {42} end\n");
  const std::string saved = bytes(file("arm.rbt"));
  EXPECT_NE(saved.find("solver mine {"), std::string::npos) << saved;
  EXPECT_NE(saved.find("line \"return function(model, q, qd, qdd) return {42} end\""),
            std::string::npos);

  const Desk desk(user("colleague"));
  desk.eval("r = file.load('" + file("arm.rbt") + "')");
  EXPECT_TRUE(desk.told("untrusted_solver", "inverse_dynamics \"mine\" of robot \"arm\""));
  const std::string refused = desk.eval(kTorque);
  EXPECT_NE(
      refused.find("inverse_dynamics solver \"mine\" came as Lua with robot \"arm\" and is not "
                   "run until you trust it"),
      std::string::npos)
      << refused;
  EXPECT_NE(refused.find("provider.trust(\"inverse_dynamics\", \"mine\")"), std::string::npos);
  EXPECT_EQ(desk.eval("provider.kept()[1].trusted"), "false");
  // Shown, byte for byte.
  EXPECT_EQ(desk.eval("provider.text('ik', 'mine')").find("error"), 0U);
  EXPECT_EQ(desk.eval("provider.text('inverse_dynamics', 'mine')"),
            "trace = 1\nreturn function(model, q, qd, qdd) return {42} end\n");
  EXPECT_EQ(desk.eval("trace"), "nil");
  desk.eval("provider.trust('inverse_dynamics', 'mine')");
  EXPECT_NE(desk.eval(kTorque).find("42"), std::string::npos) << desk.eval(kTorque);
  EXPECT_EQ(desk.eval("trace"), "nil");  // its globals are its own
  EXPECT_EQ(desk.eval("provider.kept()[1].running"), "true");
  // Saved again it is the same file.
  desk.eval("r:save('" + file("again.rbt") + "')");
  EXPECT_EQ(bytes(file("again.rbt")), saved);
}

TEST_F(KeptSolvers, TrustIsRememberedByTheTextAndAChangedTextAsksAgain) {
  mail(file("arm.rbt"), "return function() return {1} end");
  {
    const Desk desk(user("colleague"));
    desk.eval("r = file.load('" + file("arm.rbt") + "')");
    EXPECT_EQ(desk.app->kept_solvers->take_unasked().size(), 1U);
    EXPECT_TRUE(desk.app->kept_solvers->take_unasked().empty());  // once
    EXPECT_EQ(desk.eval("#provider.trust()"), "1");
  }
  {
    const Desk desk(user("colleague"));
    desk.eval("r = file.load('" + file("arm.rbt") + "')");
    EXPECT_FALSE(desk.told("untrusted_solver", ""));
    EXPECT_TRUE(desk.app->kept_solvers->take_unasked().empty());
    EXPECT_EQ(desk.eval("provider.kept()[1].running"), "true");
  }
  std::string changed = bytes(file("arm.rbt"));
  changed.replace(changed.find("{1}"), 3, "{2}");
  std::ofstream(file("arm.rbt"), std::ios::binary) << changed;
  const Desk desk(user("colleague"));
  desk.eval("r = file.load('" + file("arm.rbt") + "')");
  EXPECT_EQ(desk.eval("provider.kept()[1].trusted"), "false");
  // For this run only, and taken back.
  desk.eval("provider.trust{remember = false}");
  EXPECT_EQ(desk.eval("provider.kept()[1].running"), "true");
  desk.eval("provider.distrust()");
  EXPECT_EQ(desk.eval(kTorque).find("error"), 0U);
  // A remembered file that holds something else trusts nothing.
  for (const auto& entry : fs::directory_iterator(fs::path(user("colleague")) / "robomosp/trusted"))
    std::ofstream(entry.path(), std::ios::binary) << "return function() return {3} end";
  std::string back = bytes(file("arm.rbt"));
  back.replace(back.find("{2}"), 3, "{1}");
  std::ofstream(file("arm.rbt"), std::ios::binary) << back;
  const Desk other(user("colleague"));
  other.eval("r = file.load('" + file("arm.rbt") + "')");
  EXPECT_EQ(other.eval("provider.kept()[1].trusted"), "false");
}

TEST_F(KeptSolvers, WhatIsTrustedComputesAndReadsAndReachesNothingElse) {
  // Each line tries one thing, when the text is run and when the solver is asked.
  const std::vector<std::string> refused{
      "io.open('x', 'w')",
      "os.execute('true')",
      "os.remove('x')",
      "os.exit()",
      "dofile('x.lua')",
      "loadfile('x.lua')",
      "load('return 1')",
      "require('x')",
      "debug.getregistry()",
      "ioci.call('robot.list')",
      "ioci.withdraw('robomosp.ik/1', 'numeric')",
      "start('robot.list')",
      "robot.create{name = 'other', convention = 'dh', links = {{a = 1}}}",
      "robot('arm'):set{description = 'changed'}",
      "robot('arm'):save('" + file("stolen.rbt") + "')",
      "document.clear()",
      "document.undo()",
      "provider.trust()",
      "plugin.load('x')",
      "robot.fk.x.y.z()",
      "setmetatable({}, {__gc = function() end})",
      "getmetatable('').__index.rep = 1",
      "getmetatable(robot).__call = 1"};
  for (const std::string& line : refused) {
    const Desk desk(user("author"));
    desk.eval("r = robot.create{name = 'arm', convention = 'dh', links = {{a = 1}}}");
    const std::string keep =
        "provider.keep{interface = 'inverse_dynamics', name = 'mine', with = r, text = [==[";
    EXPECT_EQ(desk.eval(keep + line + " return function() return {1} end]==]}").find("error"), 0U)
        << line;
    EXPECT_EQ(desk.eval("#provider.kept()"), "0") << line;
    EXPECT_EQ(desk.eval(keep + "return function() " + line + " return {1} end]==]}").find("error"),
              std::string::npos)
        << line;
    desk.eval("r:set{inverse_dynamics = 'mine'}");
    const std::string digest = desk.app->document.content_digest();
    const std::string said = desk.eval(kTorque);
    EXPECT_EQ(said.find("error"), 0U) << line << " gave " << said;
    EXPECT_EQ(desk.app->document.content_digest(), digest) << line;
    EXPECT_EQ(desk.eval("('x'):rep(2)"), "xx");
  }
  EXPECT_FALSE(fs::exists(file("stolen.rbt")));
  // What it may: read the document, compute, keep its own state.
  const Desk desk(user("author"));
  desk.eval("r = robot.create{name = 'arm', convention = 'dh', links = {{a = 1}}}");
  EXPECT_EQ(
      desk.eval(
              "provider.keep{interface = 'inverse_dynamics', name = 'mine', with = r, text = [==[\n"
              "local C = setmetatable({}, {__index = {n = 0}})\n"
              "local function tip(model, q) return robot(model.name):fk{q = q}.position end\n"
              "return {torques = function(model, q)\n"
              "  C.n = C.n + 1\n"
              "  local x = array(tip(model, q))\n"
              "  return {10 * x[1] + linalg.norm{3, 4} + math.floor(os.clock() * 0) + "
              "#('ab'):rep(2)}\n"
              "end, summary = 'From the tip.'}]==]}")
          .find("error"),
      std::string::npos);
  desk.eval("r:set{inverse_dynamics = 'mine'}");
  EXPECT_NE(desk.eval(kTorque).find("19"), std::string::npos) << desk.eval(kTorque);
  EXPECT_NE(
      desk.eval("for _, p in ipairs(provider.list('inverse_dynamics')) do if p.name == 'mine' "
                "then return p.origin .. p.summary end end")
          .find("kept with robot \"arm\"From the tip."),
      std::string::npos);
}

TEST_F(KeptSolvers, WhatTheConsoleProvidedIsKeptAsItWasTyped) {
  const Desk desk(user("author"));
  desk.eval("r = robot.create{name = 'arm', convention = 'dh', links = {{a = 1}}}");
  desk.eval("ioci.provide('robomosp.inverse_dynamics/1', 'typed', function() return {7} end)");
  // Nobody chooses it yet: no record would carry it.
  EXPECT_NE(desk.eval("provider.keep('inverse_dynamics', 'typed')").find("no record chooses"),
            std::string::npos);
  desk.eval("r:set{inverse_dynamics = 'typed'}");
  EXPECT_EQ(desk.eval("provider.keep('inverse_dynamics', 'typed')").find("error"),
            std::string::npos);
  EXPECT_EQ(desk.eval("provider.text('inverse_dynamics', 'typed')"),
            "ioci.provide('robomosp.inverse_dynamics/1', 'typed', function() return {7} end)");
  EXPECT_EQ(desk.eval("provider.kept()[1].running"), "true");
  EXPECT_NE(desk.eval(kTorque).find('7'), std::string::npos);
  // One that lives from the session's globals does not travel.
  desk.eval("helper = 3");
  desk.eval(
      "ioci.provide('robomosp.inverse_dynamics/1', 'leans', "
      "(function() local h = helper + 0 return function() return {h} end end)())");
  const std::string said =
      desk.eval("provider.keep{interface = 'inverse_dynamics', name = 'leans', with = r}");
  EXPECT_NE(said.find("helper"), std::string::npos) << said;
  // Undo takes the text out, and the session's own solver serves again; redo keeps it.
  desk.eval("document.undo()");
  EXPECT_EQ(desk.eval("#provider.kept()"), "0");
  EXPECT_NE(desk.eval(kTorque).find('7'), std::string::npos) << desk.eval(kTorque);
  desk.eval("document.redo()");
  EXPECT_EQ(desk.eval("provider.kept()[1].running"), "true");
  // Duplicates carry it too; who forgets it chooses a name that is not there.
  desk.eval("s = robot.duplicate{id = r, name = 'twin'}");
  EXPECT_EQ(desk.eval("#provider.kept()[1].with"), "2");
  desk.eval(
      "provider.forget('inverse_dynamics', 'typed'); "
      "ioci.withdraw('robomosp.inverse_dynamics/1', 'typed')");
  EXPECT_NE(desk.eval(kTorque).find("there is no inverse_dynamics provider \"typed\""),
            std::string::npos)
      << desk.eval(kTorque);
}

TEST_F(KeptSolvers, TwoFilesWithSolversOfOneNameServeEachItsOwnRobot) {
  mail(file("one.rbt"), "return function() return {1} end", "one");
  mail(file("two.rbt"), "return function() return {2} end", "two");
  mail(file("three.rbt"), "return function() return {1} end", "three");
  const Desk desk(user("author"));
  for (const char* name : {"one", "two", "three"})
    desk.eval(std::string(name) + " = file.load('" + file((std::string(name) + ".rbt").c_str()) +
              "')");
  EXPECT_EQ(desk.eval("#provider.kept()"), "2");
  EXPECT_TRUE(desk.told("file_note", "is named \"mine_2\" here"));
  for (const auto& [robot, torque] :
       {std::pair{"one", '1'}, std::pair{"two", '2'}, std::pair{"three", '1'}})
    EXPECT_NE(desk.eval("r = " + std::string(robot) + "; " + kTorque).find(torque),
              std::string::npos)
        << robot << desk.eval("r = " + std::string(robot) + "; " + kTorque);
  // The renamed one is saved as such, and found again.
  desk.eval("two:save('" + file("renamed.rbt") + "')");
  desk.eval("document.clear()");
  desk.eval("r = file.load('" + file("renamed.rbt") + "')");
  EXPECT_NE(desk.eval(kTorque).find('2'), std::string::npos) << desk.eval(kTorque);
}

TEST_F(KeptSolvers, EveryInterfaceThatLuaProvidesCanBeKept) {
  const std::pair<const char*, const char*> all[] = {{"ik", "solve"},
                                                     {"inverse_dynamics", "torques"},
                                                     {"forward_dynamics", "accelerations"},
                                                     {"controller", "torques"},
                                                     {"integrator", "step"},
                                                     {"curve", "place"},
                                                     {"motion_law", "share"},
                                                     {"orientation", "orient"},
                                                     {"segment", "sample"},
                                                     {"collision", "distance"},
                                                     {"physics", "step"},
                                                     {"robot_code", "generate"}};
  {
    const Desk desk(user("author"));
    desk.eval("w = world.create{name = 'cell'}");
    for (const auto& [interface, function] : all)
      EXPECT_EQ(desk.eval("provider.keep{interface = '" + std::string(interface) +
                          "', name = 'mine', with = w, text = 'return {" + function +
                          " = function() end}'}")
                    .find("error"),
                std::string::npos)
          << interface;
    EXPECT_NE(desk.eval("provider.keep{interface = 'csg', name = 'mine', with = w, text = 'return "
                        "function() end'}")
                  .find("is not an interface that Lua can provide"),
              std::string::npos);
    desk.eval("w:save('" + file("cell.wld") + "')");
  }
  const Desk desk(user("colleague"));
  desk.eval("file.load('" + file("cell.wld") + "')");
  EXPECT_EQ(desk.eval("#provider.kept()"), "12");
  EXPECT_EQ(desk.eval("#provider.trust()"), "12");
  EXPECT_EQ(
      desk.eval("n = 0; for _, p in ipairs(provider.kept()) do n = n + (p.running and 1 or 0) "
                "end; return n"),
      "12");
}

TEST_F(KeptSolvers, ATrajectoryTravelsWithItsLaw) {
  {
    const Desk desk(user("author"));
    EXPECT_EQ(
        desk.eval("ioci.provide('robomosp.motion_law/2', 'even', {share = function(way, params, t) "
                  "return t / 2 end, duration = 2})")
            .find("error"),
        std::string::npos);
    const std::string made = desk.eval(
        "t = trajectory.create{name = 'stroke', segments = {{shape = 'line', law = 'even', points "
        "= "
        "{{0, 0, 0}, {1, 0, 0}}}}}; provider.keep('motion_law', 'even'); t:save('" +
        file("stroke.tjc") + "')");
    EXPECT_EQ(made.find("error"), std::string::npos) << made;
  }
  const Desk desk(user("colleague"));
  desk.eval("t = file.load('" + file("stroke.tjc") + "')");
  EXPECT_NE(desk.eval("t:record()").find("came as Lua with trajectory \"stroke\""),
            std::string::npos)
      << desk.eval("t:record()");
  desk.eval("provider.trust()");
  EXPECT_EQ(desk.eval("t:record()").find("error"), std::string::npos) << desk.eval("t:record()");
}

TEST_F(KeptSolvers, TextsThatCannotBeKeptSaySo) {
  const Desk desk(user("author"));
  desk.eval("r = robot.create{name = 'arm', convention = 'dh', links = {{a = 1}}}");
  const auto keep = [&](const std::string& rest) {
    return desk.eval("provider.keep{interface = 'inverse_dynamics', name = 'mine', with = r, " +
                     rest + "}");
  };
  EXPECT_NE(keep("text = ''").find("the text"), std::string::npos) << keep("text = ''");
  EXPECT_NE(keep("text = 'return 1'").find("not a number"), std::string::npos);
  EXPECT_NE(keep("text = 'local x = 1'").find("provides no solver"), std::string::npos);
  EXPECT_NE(keep("text = 'return function('").find("syntax error"), std::string::npos);
  EXPECT_NE(keep("text = '\\27Lua'").find("error"), std::string::npos);
  EXPECT_NE(keep("text = '-- \\255\\nreturn function() end'").find("UTF-8"), std::string::npos);
  EXPECT_NE(keep("text = 'return function() end' .. ('-'):rep(2^20)").find("bytes"),
            std::string::npos);
  EXPECT_NE(keep("text = 'x', file = 'y'").find("both given"), std::string::npos);
  EXPECT_NE(keep("file = 'no_such.lua'").find("no_such.lua"), std::string::npos);
  EXPECT_NE(desk.eval("provider.keep{interface = 'ik', name = 'numeric', with = r, text = 'return "
                      "function() end'}")
                .find("already exists, from"),
            std::string::npos);
  EXPECT_NE(
      desk.eval("provider.keep{interface = 'nonsense', name = 'mine', with = r}").find("nonsense"),
      std::string::npos);
  EXPECT_NE(desk.eval("provider.text('ik', 'none')").find("keeps no solver"), std::string::npos);
  EXPECT_EQ(desk.eval("#provider.kept()"), "0");
  // Lines of every kind come back as they were.
  for (const char* tail : {"", "\n", "\n\n", "\r\n-- x", "\t-- \"quoted\" \\ \xC3\xA4\n"}) {
    const std::string text = std::string("return function() return {1} end ") + tail;
    const auto kept = desk.app->dispatch(
        *desk.session, "provider.keep",
        Map{{"interface", "inverse_dynamics"}, {"name", "mine"}, {"with", "arm"}, {"text", text}});
    ASSERT_TRUE(kept.ok()) << kept.error().sentence();
    desk.eval("r:save('" + file("arm.rbt") + "'); document.clear(); r = file.load('" +
              file("arm.rbt") + "')");
    EXPECT_EQ(desk.app->kept_solvers->list().at(0).solver.text, text);
  }
}

TEST_F(KeptSolvers, ASessionThatMayNotRunCodeTrustsNothing) {
  mail(file("arm.rbt"), "return function() return {1} end");
  const Desk desk(user("colleague"));
  desk.eval("r = file.load('" + file("arm.rbt") + "')");
  ioci::Session guest("guest");
  guest.deny(Effect::loads_code);
  const auto refused = desk.app->dispatch(guest, "provider.trust", {});
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::permission);
  // As a connection sees it: an error that names the command.
  const auto asked =
      desk.app->dispatch(guest, "robot.inverse_dynamics", Map{{"id", "arm"}, {"q", List{0.0}}});
  ASSERT_FALSE(asked.ok());
  EXPECT_EQ(asked.error().code, ErrorCode::permission);
  EXPECT_NE(asked.error().hint.find("provider.trust(\"inverse_dynamics\", \"mine\")"),
            std::string::npos);
  desk.app->kept_solvers->trust_all();  // --trust
  EXPECT_EQ(desk.eval("provider.kept()[1].running"), "true");
  EXPECT_FALSE(fs::exists(fs::path(user("colleague")) / "robomosp/trusted"));
}

}  // namespace
}  // namespace robomosp::lua
