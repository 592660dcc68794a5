// SPDX-License-Identifier: Apache-2.0
// Scripts of strangers in a process of their own: what they can do, what they cannot, and that
// nothing is left of those that try.
#include "remote/lua_child.h"

#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <random>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include <fcntl.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <gtest/gtest.h>

#include "lua/lua_state.h"
#include "lua/sandbox/wire.h"
#include "remote/rpc.h"
#include "support/program.h"
#include "support/seed.h"

namespace robomosp::remote {
namespace {

namespace fs = std::filesystem;
namespace wire = lua::wire;
using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

/// A folder of this test, removed at the end.
struct Folder {
  fs::path path;
  Folder() {
    std::string name = (fs::temp_directory_path() / "robomosp-sandbox-XXXXXX").string();
    path = ::mkdtemp(name.data());
  }
  ~Folder() { fs::remove_all(path); }
};

class Untrusted : public test::ProgramTest {
 protected:
  void SetUp() override {
    ProgramTest::SetUp();
    options_.limits.cpu_seconds = 0.2;
    for (const Effect e : {Effect::files_read, Effect::files_write, Effect::processes,
                           Effect::providers, Effect::loads_code, Effect::stops})
      session_.deny(e);
    make();
  }
  void make() { child_ = std::make_unique<LuaChild>(app(), options_); }
  void TearDown() override {
    child_.reset();
    // Nobody is left, not even as a zombie.
    EXPECT_EQ(::waitpid(-1, nullptr, WNOHANG), -1);
    EXPECT_EQ(errno, ECHILD);
  }
  /// The text of the value, or "ERROR code: sentence".
  std::string eval(std::string_view code) {
    const auto r = child_->eval(code, session_);
    if (!r.ok())
      return "ERROR " + std::string(to_string(r.error().code)) + ": " + r.error().sentence();
    const Value* v = r->find("value");
    const Value* all = r->find("values");
    return all ? all->text() : v ? v->text() : std::string();
  }
  Map map(std::string_view code) {
    const auto r = child_->eval(code, session_);
    EXPECT_TRUE(r.ok()) << code << ": " << r.error().sentence();
    return r.ok() ? *r : Map();
  }

  ioci::Session session_{"stranger", ioci::SessionKind::connection};
  LuaChildOptions options_;
  std::unique_ptr<LuaChild> child_;
};

TEST_F(Untrusted, AScriptGivesTheSameAnswersAsInThisProcess) {
  lua::LuaState here(app(), session_, {});
  ASSERT_TRUE(here.eval("material.create{name = 'brass', density = 8500}").ok());
  for (const std::string_view code :
       {"1 + 1",
        "true, 7, 0.5, 'text', {1, 2.5, 'x'}, {a = {b = 1}}, nil",
        "array{{1, 2}, {3, 4}} * array{1, 1}",
        "linalg.det(array{{2, 0}, {0, 3}})",
        "string.format('%d %s', 3, 'x'), utf8.char(228), math.maxinteger",
        "m = material 'brass'",
        "m.name, m.kind, m.exists, m:describe()",
        "material 'brass' == m, tostring(m)",
        "material.list()",
        "r = robot.get 'puma560'",
        "r",
        "robot.fk('puma560', {q = {0, 0, 0, 0, 0, 0}}).position",
        "r:fk{q = 'home'}",
        "ioci.call('material.list')",
        "deg(90), mm(20), pose(0.1, 0, 0.2)",
        "m?",
        "help 'units'",
        "help 'robot.fk'",
        "m:text()",
        "robot.fk, {print, m}",
        "PRobot puma560 GetDOF",
        "select('#', pcall(error, {code = 'x'}))",
        "document.describe",
        "m.no_such",
        "m()",
        "robot.no_such{}",
        "no_such{}",
        "no_such_global.x",
        "material.create{nam = 'x'}",
        "x =",
        "error{message = 'm', code = 'io', hint = 'h'}",
        "local function f() error('deep') end f()",
        "ioci.transaction(5)",
        "material 'bras'",
        "digits(3); return digits()"}) {
    const auto expected = here.eval_values(code);
    const std::string there = eval(code);
    if (!expected.ok()) {
      std::string said = expected.error().sentence();
      EXPECT_EQ(there, "ERROR " + std::string(to_string(expected.error().code)) + ": " + said)
          << code;
      continue;
    }
    const List& values = *expected;
    EXPECT_EQ(there, values.empty()       ? ""
                     : values.size() == 1 ? values[0].text()
                                          : Value(values).text())
        << code;
  }
}

TEST_F(Untrusted, VariablesLastFromCallToCallAndWhatIsPrintedComesWithTheAnswer) {
  EXPECT_EQ(eval("x = 20; t = {1, 2}"), "");
  const Map answer = map("print('a', t); print(x); return x + 1");
  EXPECT_EQ(*answer.find("value"), Value(21));
  EXPECT_EQ(*answer.find("output"), Value("a\t{1, 2}\n20\n"));
  EXPECT_FALSE(answer.find("note"));
  EXPECT_EQ(*map("return 1").find("output"), Value(""));
}

TEST_F(Untrusted, CommandsHaveTheEffectsOfTheSession) {
  const std::string before = app().document.content_digest();
  session_.deny(Effect::edits);
  EXPECT_NE(eval("material.create{name = 'x', density = 1}").find("ERROR permission"),
            std::string::npos);
  EXPECT_NE(eval("robot.save{id = robot.get 'puma560', file = '/tmp/x.rob'}").find("ERROR"),
            std::string::npos);
  EXPECT_NE(eval("plugin.load{file = '/tmp/x.so'}").find("ERROR permission"), std::string::npos);
  EXPECT_NE(eval("quit()").find("ERROR permission"), std::string::npos);
  EXPECT_NE(eval("document.undo()").find("ERROR permission"), std::string::npos);
  EXPECT_NE(eval("ioci.transaction(function() material.create{name = 'x', density = 1} end)")
                .find("ERROR permission"),
            std::string::npos);
  EXPECT_NE(
      eval("start('material.create', {name = 'x', density = 1}):wait()").find("ERROR permission"),
      std::string::npos);
  EXPECT_EQ(app().document.content_digest(), before);
  EXPECT_FALSE(app().quit_requested);
}

TEST_F(Untrusted, ATransactionIsOneStepAndAnErrorUndoesIt) {
  EXPECT_EQ(eval("ioci.transaction('two', function() material.create{name = 'a', density = 1}; "
                 "ioci.transaction(function() material.create{name = 'b', density = 2} end) "
                 "return 7 end)"),
            "7");
  EXPECT_EQ(eval("#material.list()"), "2");
  ASSERT_EQ(app().document.undo_labels().size(), 1U);
  const std::string before = app().document.content_digest();
  EXPECT_NE(eval("ioci.transaction(function() material.create{name = 'c', density = 1}; "
                 "error('no') end)")
                .find("no"),
            std::string::npos);
  EXPECT_EQ(app().document.content_digest(), before);
  // The process ends within it.
  const std::string said = eval(
      "ioci.transaction(function() material.create{name = 'c', density = 1}; "
      "string.find(('a'):rep(40), ('a?'):rep(40) .. ('a'):rep(40)) end)");
  EXPECT_NE(said.find("its process was ended"), std::string::npos) << said;
  EXPECT_EQ(app().document.content_digest(), before);
  EXPECT_EQ(eval("document.undo(); return #material.list()"), "0");
}

TEST_F(Untrusted, JobsAreStartedAndWaitedFor) {
  EXPECT_EQ(eval("j = start('material.create', {name = 'a', density = 3}); return j:wait().name"),
            "a");
  EXPECT_EQ(eval("material('a'):describe().density"), "3");
}

TEST_F(Untrusted, WhatIsNotThereSaysSo) {
  for (const char* name : {"io", "debug", "package", "require", "dofile", "loadfile"}) {
    const std::string said = eval(std::string(name) + "('x')");
    EXPECT_NE(said.find("untrusted script has no " + std::string(name)), std::string::npos) << said;
  }
  EXPECT_EQ(eval("os.execute, os.remove, os.getenv, os.exit, os.tmpname, string.dump"),
            eval("nil, nil, nil, nil, nil, nil"));
  EXPECT_EQ(eval("os.time() > 0, os.clock() >= 0, os.date('!%Y', 0)"), "{true, true, \"1970\"}");
  EXPECT_NE(
      eval("ioci.provide('robomosp.ik/1', 'mine', function() end)").find("cannot provide solvers"),
      std::string::npos);
  EXPECT_NE(eval("collectgarbage()").find("\"count\" only"), std::string::npos);
  EXPECT_EQ(eval("collectgarbage('count') > 0"), "true");
  EXPECT_EQ(eval("getmetatable('')"), "string");
  EXPECT_NE(eval("setmetatable(string, {}); getmetatable('').__index = 1").find("ERROR"),
            std::string::npos);
  EXPECT_EQ(eval("('x'):upper()"), "X");
  EXPECT_EQ(eval("load('\\27Lua\\x54\\0\\x19\\x93\\r\\n\\x1a\\n')"),
            "{nil, \"attempt to load a binary chunk (mode is 't')\"}");
  EXPECT_NE(eval("load('return 1', 'x', 'b')").find("loads text only"), std::string::npos);
  EXPECT_EQ(eval("load('return ...')(3), load(function() return nil end) ~= nil, "
                 "load('return x', 'n', 't', {x = 5})()"),
            "{3, true, 5}");
}

TEST_F(Untrusted, AHandleThatIsATableIsATable) {
  EXPECT_EQ(eval("material.create{name = 'a', density = 1}").substr(0, 5), "mater");
  EXPECT_NE(eval("material.get{name = {kind = 'material', number = 1}}").find("ERROR"),
            std::string::npos);
  EXPECT_NE(eval("local h = material 'a'; h.number = 5").find("cannot be assigned"),
            std::string::npos);
  EXPECT_EQ(eval("getmetatable(material 'a')"), "handle");
}

/// What a script of bad will or bad luck does.
struct Trap {
  const char* name;
  const char* code;
  const char* sentence;  ///< a part of what is said
};
std::ostream& operator<<(std::ostream& out, const Trap& t) { return out << t.name; }

class UntrustedTrap : public Untrusted, public testing::WithParamInterface<Trap> {};

constexpr const char* kSlow = "of processor time";

TEST_P(UntrustedTrap, EndsWithASentenceAndTheNextCallRuns) {
  if (std::string_view(GetParam().sentence) != kSlow) {
    // It meets another limit first, also on a slow machine.
    options_.limits.cpu_seconds = 20;
    options_.limits.wall_seconds = 120;
    make();
  }
  const auto& digest = app().document.content_digest();
  const std::string said = eval(GetParam().code);
  EXPECT_NE(said.find(GetParam().sentence), std::string::npos) << said.substr(0, 500);
  EXPECT_EQ(eval("6 * 7"), "42");
  EXPECT_EQ(app().document.content_digest(), digest);
}

INSTANTIATE_TEST_SUITE_P(
    Traps, UntrustedTrap,
    testing::Values(
        Trap{"loop", "while true do end", kSlow},
        Trap{"pcall_in_loop", "while true do pcall(function() while true do end end) end", kSlow},
        Trap{"xpcall_handler",
             "xpcall(function() while true do end end, "
             "function() while true do end end)",
             kSlow},
        Trap{"pattern", "return string.find(('a'):rep(30), ('a?'):rep(30) .. ('a'):rep(30))",
             kSlow},
        Trap{"pattern_gsub", "return (('a'):rep(100000)):gsub('.-b', '')", kSlow},
        Trap{"rep", "return ('x'):rep(1e10)", "ERROR script_failed"},
        Trap{"concat_doubling", "local s = 'x'; while true do s = s .. s end",
             "ERROR script_failed"},
        Trap{"table_move", "table.move({}, 1, 1e15, 2)", kSlow},
        Trap{"table_concat",
             "local t = {}; for i = 1, 1e5 do t[i] = ('x'):rep(1e4) end; "
             "return #table.concat(t)",
             "ERROR script_failed"},
        Trap{"table_growth", "local t = {}; for i = 1, 1e9 do t[i] = {} end",
             "ERROR script_failed"},
        Trap{"recursion", "local function f() return 1 + f() end; f()", "overflow"},
        Trap{"recursion_in_c", "local s = ('('):rep(1e5); error(load(s))", "ERROR"},
        Trap{"tostring_recursion",
             "local t = setmetatable({}, {__index = function(t, k) "
             "return t[k] end}); return t.x",
             "overflow"},
        Trap{"coroutines", "local function f() coroutine.wrap(f)() end; f()", "overflow"},
        Trap{"many_coroutines",
             "local t = {}; while true do t[#t + 1] = coroutine.create(print) end",
             "ERROR script_failed"},
        Trap{"gc_loop",
             "setmetatable({}, {__gc = function() while true do end end}); "
             "for i = 1, 1e7 do local t = {} end",
             kSlow},
        Trap{"close_loop",
             "local x <close> = setmetatable({}, {__close = function() "
             "while true do end end})",
             kSlow},
        Trap{"error_object",
             "error(setmetatable({}, {__tostring = function() "
             "while true do end end}))",
             "ERROR script_failed"},
        Trap{"error_object_printed",
             "print(setmetatable({}, {__tostring = function() "
             "while true do end end}))",
             kSlow},
        Trap{"sort",
             "local t = {}; for i = 1, 1000 do t[i] = i end; "
             "table.sort(t, function() while true do end end)",
             kSlow},
        Trap{"printed", "while true do print(('x'):rep(1000)) end",
             "prints more than the 1024 KiB"},
        Trap{"printed_on", "while true do pcall(print, ('x'):rep(1000)) end", kSlow},
        Trap{"long_answer", "return ('x'):rep(20 * 2^20 // 1 | 0)", "results are more than 16 MiB"},
        Trap{"many_values", "local t = {}; for i = 1, 1.1e6 do t[i] = true end; return t",
             "1000000 values"},
        Trap{"long_argument", "material.get{name = ('x'):rep(17 << 20)}", "16 MiB"},
        Trap{"deep_value", "local t = {}; for i = 1, 100 do t = {t} end; material.get{name = t}",
             "nested deeper"},
        Trap{"cyclic_value", "local t = {}; t.t = t; material.get{name = t}", "nested deeper"},
        Trap{"great_array", "return linalg.zeros(100000, 100000)", "ERROR"},
        Trap{"format", "return ('%99999999d'):format(1)", "ERROR"},
        Trap{"utf8", "return utf8.char(table.unpack({}, 1, 1e7))", "ERROR"},
        Trap{"unpack", "return table.unpack({}, 1, 1e8)", "ERROR"}),
    [](const auto& one) { return std::string(one.param.name); });

TEST_F(Untrusted, ALoopThatHeedsItsLimitKeepsItsVariables) {
  EXPECT_EQ(eval("x = 5"), "");
  const auto before = child_->process();
  EXPECT_EQ(eval("while true do end"),
            "ERROR script_failed: the script took more than 0.2 s of processor time and was "
            "stopped. Do less in one call, or raise the limit of untrusted scripts.");
  EXPECT_EQ(child_->process(), before);
  EXPECT_EQ(eval("x"), "5");
}

TEST_F(Untrusted, AProcessThatWasEndedSaysThatItsVariablesAreGone) {
  EXPECT_EQ(eval("x = 5"), "");
  const std::string said =
      eval("return string.find(('a'):rep(40), ('a?'):rep(40) .. ('a'):rep(40))");
  EXPECT_NE(said.find("did not stop, and its process was ended. Its variables are lost"),
            std::string::npos)
      << said;
  EXPECT_FALSE(child_->process());
  const Map answer = map("return x");
  EXPECT_EQ(*answer.find("value"), Value());
  ASSERT_TRUE(answer.find("note"));
  EXPECT_NE(answer.find("note")->as_string()->find("variables are lost"), std::string::npos);
  EXPECT_FALSE(map("return x").find("note"));
}

TEST_F(Untrusted, WaitingCountsByTheClock) {
  options_.limits.cpu_seconds = 60;
  options_.limits.wall_seconds = 0.3;
  make();
  EXPECT_NE(eval("while true do end").find("took longer than 0.3 s"), std::string::npos);
  EXPECT_NE(eval("while true do pcall(material.list) end").find("took longer than 0.3 s"),
            std::string::npos);
  EXPECT_EQ(eval("1"), "1");
}

TEST_F(Untrusted, AnInterruptEndsALoopAndLeavesItsVariables) {
  options_.limits.cpu_seconds = 60;
  make();
  EXPECT_EQ(eval("x = 5"), "");
  for (const std::string_view code :
       {"print('begun'); while true do end", "while true do pcall(material.list) end"}) {
    std::jthread other([this] {
      std::this_thread::sleep_for(50ms);
      session_.interrupt();
    });
    const auto r = child_->eval(code, session_);
    ASSERT_FALSE(r.ok());
    EXPECT_EQ(r.error().code, ErrorCode::cancelled) << r.error().sentence();
  }
  EXPECT_EQ(eval("x"), "5");
  std::jthread other([this] {
    std::this_thread::sleep_for(50ms);
    session_.interrupt();
  });
  const auto r = child_->eval("table.move({}, 1, 1e15, 2)", session_);
  ASSERT_FALSE(r.ok());
  EXPECT_EQ(r.error().code, ErrorCode::cancelled) << r.error().sentence();
  EXPECT_FALSE(child_->process());
}

TEST_F(Untrusted, AProcessThatIsKilledAtAnyTimeIsOneSentence) {
  options_.limits.cpu_seconds = 60;
  make();
  std::mt19937 random(test::seed());
  for (int i = 0; i < 12; ++i) {
    ASSERT_EQ(eval("1"), "1");
    const pid_t pid = *child_->process();
    std::jthread killer([pid, wait = std::chrono::microseconds(random() % 20000)] {
      std::this_thread::sleep_for(wait);
      ::kill(pid, SIGKILL);
    });
    const std::string said =
        eval(i % 2 ? "while true do end" : "while true do material.list() end");
    EXPECT_NE(said.find("killed externally"), std::string::npos) << said;
  }
  // Between two calls.
  ASSERT_EQ(eval("1"), "1");
  ::kill(*child_->process(), SIGKILL);
  EXPECT_NE(eval("1").find("killed externally"), std::string::npos);
  EXPECT_EQ(eval("1"), "1");
}

TEST_F(Untrusted, TheProcessEndsWithItsObjectAndWithItsThread) {
  ASSERT_EQ(eval("1"), "1");
  const pid_t pid = *child_->process();
  child_.reset();
  EXPECT_EQ(::kill(pid, 0), -1);
  EXPECT_EQ(errno, ESRCH);
}

TEST_F(Untrusted, ThisProgramIsNotSeenFromInside) {
  ASSERT_EQ(eval("1"), "1");
  // Its only descriptor is the socket; its environment is empty.
  const fs::path proc = "/proc/" + std::to_string(*child_->process());
  std::error_code failed;
  std::vector<std::string> open;
  for (const auto& entry : fs::directory_iterator(proc / "fd", failed))
    open.push_back(entry.path().filename().string());
  if (!failed) {
    EXPECT_EQ(open, std::vector<std::string>{"0"});
  }
  std::ifstream environment(proc / "environ", std::ios::binary);
  EXPECT_EQ(std::string(std::istreambuf_iterator<char>(environment), {}), "");
  std::ifstream status(proc / "status");
  std::string line, seccomp, privileges;
  while (std::getline(status, line)) {
    if (line.starts_with("Seccomp:")) seccomp = line;
    if (line.starts_with("NoNewPrivs:")) privileges = line;
  }
  EXPECT_EQ(seccomp, "Seccomp:\t2");
  EXPECT_EQ(privileges, "NoNewPrivs:\t1");
}

TEST_F(Untrusted, LuaEvalOfAConnectionWithoutLoadsCodeRunsThere) {
  lua::LuaState here(app(), session_, {});
  RpcServer server(app(), session_, here);
  const std::string_view line =
      R"({"jsonrpc":"2.0","id":1,"method":"lua.eval","params":{"code":"print(type(io)); return 6 * 7"}})";
  EXPECT_NE(server.answer(line)->find("permission"), std::string::npos);
  server.untrusted = child_.get();
  EXPECT_EQ(*server.answer(line),
            R"({"jsonrpc":"2.0","id":1,"result":{"value":42,"output":"nil\n"}})");
  ioci::Session trusted{"trusted"};
  lua::LuaState own(app(), trusted, {});
  RpcServer mine(app(), trusted, own);
  mine.untrusted = child_.get();
  EXPECT_NE(mine.answer(line)->find("\"value\":42"), std::string::npos);
  EXPECT_EQ(mine.printed, "");
}

TEST_F(Untrusted, CommandsThatPluginsAddLaterAreThere) {
  ASSERT_EQ(eval("1"), "1");
  EXPECT_NE(eval("late.answer{}").find("ERROR"), std::string::npos);
  ioci::CommandSpec spec;
  spec.name = "late.answer";
  spec.summary = "Answers.";
  spec.example = "late.answer{}";
  spec.returns = {"int", "", "the answer", {}};
  spec.plugin = "late";
  spec.plugged = [](ioci::CommandContext&, const Map&) -> Result<Value> { return Value(42); };
  const auto added = app().commands.add_plugged(std::move(spec));
  ASSERT_TRUE(added.ok()) << added.error().sentence();
  EXPECT_EQ(eval("material.list(); return late.answer{}"), "42");
}

TEST_F(Untrusted, WithoutSeccompNothingRunsUnlessASettingAllowsIt) {
  const Folder folder;
  options_.program = folder.path / "no-seccomp";
  fs::create_symlink(SANDBOX_PROBE, options_.program);
  make();
  const std::string said = eval("1");
  EXPECT_NE(
      said.find("ERROR unsupported: untrusted scripts are not run, since system calls cannot be "
                "filtered (seccomp)"),
      std::string::npos)
      << said;
  EXPECT_FALSE(child_->process());
  options_.without_seccomp = true;
  make();
  EXPECT_EQ(eval("1"), "1");
}

TEST_F(Untrusted, AProgramThatIsNotThereOrEndsAtOnceIsOneSentence) {
  options_.program = "/no/such/program";
  make();
  EXPECT_NE(eval("1").find("cannot be started"), std::string::npos);
  options_.program = "/bin/false";
  make();
  EXPECT_NE(eval("1").find("ended at its start (exit code 1)"), std::string::npos);
}

TEST_F(Untrusted, WhateverTheProcessSaysTheProgramAndTheWorldStandFast) {
  const Folder folder;
  const unsigned seed = test::seed();
  ioci::Session reader{"liar", ioci::SessionKind::connection};
  for (const Effect e : kAllEffects)
    if (e != Effect::reads) reader.deny(e);
  const std::string before = app().document.content_digest();
  options_.limits.cpu_seconds = 5;
  options_.limits.wall_seconds = 1;
  const test::FuzzBudget budget(60);
  for (unsigned i = 0; budget.allows(i); ++i) {
    options_.program = folder.path / ("liar-" + std::to_string(seed + i));
    fs::create_symlink(SANDBOX_PROBE, options_.program);
    make();
    for (int call = 0; call < 3; ++call) (void)child_->eval("1", reader);
    EXPECT_EQ(app().document.content_digest(), before) << seed + i;
  }
}

// --- the lock itself ---

/// What the probe says after a call, or the signal that it died of.
std::string probe(const std::string& call) {
  const Folder folder;
  const fs::path program = folder.path / ("call-" + call);
  fs::create_symlink(SANDBOX_PROBE, program);
  int pair[2];
  EXPECT_EQ(::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, pair), 0);
  const pid_t pid = ::fork();
  if (pid == 0) {
    ::dup2(pair[1], 0);
    char* argv[] = {const_cast<char*>(program.c_str()), nullptr};
    ::execv(program.c_str(), argv);
    ::_exit(127);
  }
  ::close(pair[1]);
  std::string said;
  char chunk[256];
  for (ssize_t n = 0; (n = ::read(pair[0], chunk, sizeof chunk)) > 0;)
    said.append(chunk, static_cast<std::size_t>(n));
  ::close(pair[0]);
  int status = 0;
  ::waitpid(pid, &status, 0);
  if (WIFSIGNALED(status)) return "SIG" + std::string(::sigabbrev_np(WTERMSIG(status)));
  if (WEXITSTATUS(status) != 0) return "exit " + std::to_string(WEXITSTATUS(status));
  return said.substr(said.find(' ') == std::string::npos ? 0 : said.rfind(' ') + 1);
}

TEST(LockDown, LetsAProcessComputeAndAnswer) {
  EXPECT_EQ(probe("none"), "answered");
  EXPECT_EQ(probe("clock"), "answered");
  EXPECT_EQ(probe("memory"), "answered");
  EXPECT_EQ(probe("too-much-memory"), "refused");
}

class LockedCall : public testing::TestWithParam<const char*> {};
TEST_P(LockedCall, EndsTheProcess) { EXPECT_EQ(probe(GetParam()), "SIGSYS"); }
INSTANTIATE_TEST_SUITE_P(Calls, LockedCall,
                         testing::Values("open", "openat", "openat2", "stat", "unlink", "mkdir",
                                         "execve", "execveat", "socket", "socketpair", "connect",
                                         "sendmsg", "fork", "vfork", "clone", "clone3", "kill",
                                         "tgkill", "ptrace", "process_vm_readv", "prctl", "prlimit",
                                         "seccomp", "unshare", "mount", "bpf", "io_uring_setup",
                                         "memfd_create", "dup", "ioctl", "read-1", "write-1",
                                         "write-2", "map-code", "map-file", "protect-code", "x32"),
                         [](const auto& one) {
                           std::string name = one.param;
                           for (char& c : name)
                             if (c == '-') c = '_';
                           return name;
                         });

TEST(LockDown, WithoutSeccompTheOtherWallsStillStand) {
  EXPECT_EQ(probe("without-none"), "answered");
  for (const char* call : {"open", "openat", "mkdir", "socketpair", "dup", "memfd_create", "mount",
                           "write-1", "read-1"})
    EXPECT_EQ(probe(std::string("without-") + call), "refused") << call;
}

// --- limits as text ---

TEST(LuaLimitsText, IsReadAndFaultsAreNamed) {
  const auto some = lua_limits("memory=512, cpu=0.5,wall=600,output=4");
  ASSERT_TRUE(some.ok()) << some.error().sentence();
  EXPECT_EQ(some->memory, std::uint64_t{512} << 20);
  EXPECT_EQ(some->cpu_seconds, 0.5);
  EXPECT_EQ(some->wall_seconds, 600);
  EXPECT_EQ(some->output, std::size_t{4} << 20);
  EXPECT_EQ(lua_limits("cpu=3")->memory, LuaLimits{}.memory);
  for (const char* wrong : {"", "cpu", "cpu=", "cpu=-1", "cpu=nan", "cpu=1e300", "memory=64",
                            "memory=x", "speed=3", "cpu=1,,wall=2"})
    EXPECT_FALSE(lua_limits(wrong).ok()) << wrong;
}

// --- messages ---

Value nested(int depth) {
  Value v = 1;
  for (int i = 0; i < depth; ++i) v = List{v};
  return v;
}

TEST(Wire, AValueComesOutAsItWentIn) {
  const Value all = Map{{"nil", Value()},
                        {"yes", true},
                        {"int", std::int64_t{-7}},
                        {"real", 1e300},
                        {"text", std::string("a\0\xff", 3)},
                        {"empty", ""},
                        {"vector", NumericArray({1, 2, 3}, "m")},
                        {"none", NumericArray(std::vector<double>{}, "m")},
                        {"matrix", NumericArray({1, 2, 3, 4, 5, 6}, 2, 3, "N")},
                        {"flat", NumericArray(std::vector<double>{}, 0, 3)},
                        {"list", List{1, "x", List{}}},
                        {"map", Map{}},
                        {"handle", Handle{"robot", 17}}};
  const auto frame = wire::frame(wire::Kind::request, all, 1 << 20);
  ASSERT_TRUE(frame);
  const auto back = wire::read_value(std::string_view(*frame).substr(wire::kHeader));
  ASSERT_TRUE(back);
  EXPECT_EQ(*back, all);
  EXPECT_EQ(back->as_map()->find("vector")->as_array()->unit(), "m");
  // In pieces, and two at once.
  wire::Inbox inbox(1 << 20);
  for (const char c : *frame + *frame) {
    inbox.add({&c, 1});
  }
  for (int i = 0; i < 2; ++i) {
    const auto taken = inbox.take();
    ASSERT_TRUE(taken.ok() && *taken);
    EXPECT_EQ((*taken)->value, all);
  }
  EXPECT_FALSE(*inbox.take());
}

TEST(Wire, WhatIsTooMuchIsNotSentAndNotRead) {
  EXPECT_TRUE(wire::frame(wire::Kind::done, nested(wire::kDeepest), 1 << 20));
  EXPECT_FALSE(wire::frame(wire::Kind::done, nested(wire::kDeepest + 1), 1 << 20));
  EXPECT_FALSE(wire::frame(wire::Kind::done, std::string(1000, 'x'), 900));
  EXPECT_FALSE(wire::frame(wire::Kind::done, NumericArray(std::vector<double>(200)), 900));
  const auto long_one = wire::frame(wire::Kind::done, std::string(1000, 'x'), 1 << 20);
  wire::Inbox inbox(900);
  inbox.add(*long_one);
  EXPECT_FALSE(inbox.take().ok());
  std::string deep;
  for (int i = 0; i < 100000; ++i) deep += std::string("\x08\x01\x00\x00\x00", 5);
  EXPECT_FALSE(wire::read_value(deep));
  // Lists that each claim as much as all may have.
  std::string greedy;
  for (int i = 0; i < 60; ++i) greedy += std::string("\x08\x00\x00\x0f\x00", 5);
  greedy.resize(2'000'000);
  EXPECT_FALSE(wire::read_value(greedy));
  // Two values under one key.
  EXPECT_FALSE(wire::read_value(std::string("\x09\x02\0\0\0\x01\0\0\0a\0\x01\0\0\0a\0", 17)));
  EXPECT_TRUE(wire::read_value(std::string("\x09\x02\0\0\0\x01\0\0\0a\0\x01\0\0\0b\0", 17)));
}

TEST(Wire, ChangedBytesAreAValueOrNone) {
  std::mt19937 random(test::seed());
  const Value all = Map{{"name", "material.create"},
                        {"list", List{1, 2.5, "x", NumericArray({1, 2, 3, 4}, 2, 2, "m")}},
                        {"map", Map{{"h", Handle{"robot", 3}}, {"n", Value()}}}};
  const auto frame = wire::frame(wire::Kind::request, all, 1 << 20);
  ASSERT_TRUE(frame);
  const std::string bytes = frame->substr(wire::kHeader);
  const test::FuzzBudget budget(20000);
  for (std::size_t i = 0; budget.allows(i); ++i) {
    std::string changed = bytes;
    for (std::size_t n = 1 + random() % 4; n > 0; --n)
      changed[random() % changed.size()] = static_cast<char>(random());
    if (random() % 3 == 0) changed.resize(random() % (changed.size() + 1));
    const auto v = wire::read_value(changed);
    if (!v) continue;
    const auto again = wire::frame(wire::Kind::done, *v, 1 << 20);
    ASSERT_TRUE(again);
    EXPECT_EQ(again->substr(wire::kHeader), changed);  // one value has one form
  }
}

}  // namespace
}  // namespace robomosp::remote
