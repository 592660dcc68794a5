// SPDX-License-Identifier: Apache-2.0
// The program `robomosp` as a user meets it: a child process with pipes or a terminal.
#include <gtest/gtest.h>

#include <poll.h>
#include <pty.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <optional>
#include <sstream>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "shell/child_program.h"

namespace {

using Json = nlohmann::json;
namespace fs = std::filesystem;
using robomosp::test::execute;
using robomosp::test::Folder;
using robomosp::test::kProgram;
using robomosp::test::Outcome;
using robomosp::test::run;
using robomosp::test::slurp;

TEST(CommandLine, EvaluatesAnExpression) {
  const auto r = run({"-q", "eval", "6 * 7"});
  EXPECT_EQ(r.code, 0) << r.err;
  EXPECT_EQ(r.out, "42\n");
}

TEST(CommandLine, ExitCodesTellFailureUsageAndBadInputApart) {
  EXPECT_EQ(run({"-q", "eval", "error('the gripper slipped')"}).code, 1);
  EXPECT_EQ(run({"no_such_subcommand"}).code, 2);
  EXPECT_EQ(run({"--no-such-option"}).code, 2);
  EXPECT_EQ(run({"-q", "eval", "x ="}).code, 3);
  EXPECT_EQ(run({"-q", "eval", "robot.no_such{}"}).code, 3);
  EXPECT_EQ(run({"-q", "run", "/no/such/file.lua"}).code, 3);
  EXPECT_EQ(run({"-q", "eval", "os.exit(7)"}).code, 7);
}

TEST(Sandbox, RunsAScriptWithTheEffectsThatAreAllowed) {
  const Folder folder;
  const std::string script = (folder.path / "a.lua").string();
  std::ofstream(script) << "print(arg[1], io)\nmaterial.create{name = 'm', density = 1}\n";
  const auto r = run({"-q", "run", "--sandbox", script, "word"});
  EXPECT_EQ(r.code, 0) << r.err;
  EXPECT_EQ(r.out, "word\tnil\n");
  EXPECT_EQ(run({"-q", "run", "--sandbox", "--allow", "reads", script}).code, 3);
  EXPECT_EQ(run({"-q", "run", "--sandbox", "--allow", "flies", script}).code, 2);
  EXPECT_EQ(run({"-q", "run", "--allow", "reads", script}).code, 2);
  EXPECT_EQ(run({"-q", "run", "--sandbox", "--limits", "cpu=x", script}).code, 2);
}

TEST(Sandbox, EndsWithTheProgramEvenWhenThatIsKilled) {
  const Folder folder;
  const std::string script = (folder.path / "a.lua").string();
  std::ofstream(script) << "while true do end\n";
  const pid_t program = ::fork();
  if (program == 0) execute({"-q", "run", "--sandbox", script});
  // Its child, once it is there.
  pid_t child = 0;
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  const fs::path tasks = "/proc/" + std::to_string(program) + "/task";
  while (child == 0 && std::chrono::steady_clock::now() < end) {
    ::poll(nullptr, 0, 5);
    std::error_code failed;
    for (const auto& task : fs::directory_iterator(tasks, failed))
      std::istringstream(slurp(task.path() / "children")) >> child;
  }
  ASSERT_GT(child, 0);
  ::kill(program, SIGKILL);
  ::waitpid(program, nullptr, 0);
  const auto is_there = [child] {
    const std::string stat = slurp("/proc/" + std::to_string(child) + "/stat");
    const auto at = stat.rfind(')');
    return at != std::string::npos && stat.substr(at, 3) != ") Z";  // waits for init only
  };
  while (is_there() && std::chrono::steady_clock::now() < end) ::poll(nullptr, 0, 5);
  EXPECT_FALSE(is_there());
}

TEST(CommandLine, AnErrorIsOneSentenceOnStandardError) {
  const auto r = run({"-q", "eval", "robot.lod{}"});
  EXPECT_EQ(r.out, "");
  EXPECT_NE(r.err.find("error: "), std::string::npos);
  EXPECT_NE(r.err.find("Did you mean \"robot.load\"?"), std::string::npos) << r.err;
}

/// The system's linker takes a library of that name from LD_LIBRARY_PATH first, and this one is no
/// library at all: to the program OpenH264 is not installed.
TEST(CommandLine, WithoutOpenH264AnMp4FilmIsRefusedInASentenceAndAGifIsMade) {
  const Folder folder;
  std::ofstream(folder.path / "libopenh264.so.7") << "no library\n";
  const char* before = std::getenv("LD_LIBRARY_PATH");
  const std::optional<std::string> kept =
      before ? std::optional<std::string>(before) : std::nullopt;
  ::setenv("LD_LIBRARY_PATH", (folder.path.string() + (kept ? ":" + *kept : std::string())).c_str(),
           1);
  const auto film = [&](const std::string& file) {
    return run({"-q", "eval",
                "run = robot('planar2rods'):simulate{q = {0, 0.5}, duration = 0.1, limits = "
                "'ignore'} return run:video{file = '" +
                    (folder.path / file).string() + "', size = {32, 32}, fps = 10}.file"});
  };
  const Outcome mp4 = film("run.mp4"), gif = film("run.gif");
  if (kept) ::setenv("LD_LIBRARY_PATH", kept->c_str(), 1);
  else ::unsetenv("LD_LIBRARY_PATH");
  if (mp4.err.find("was built without") != std::string::npos)
    GTEST_SKIP() << "built without the headers of OpenH264";
  EXPECT_EQ(mp4.code, 3) << mp4.err;
  EXPECT_EQ(
      mp4.err,
      "error: recording.video, file: MP4 films need the library OpenH264, which is not "
      "installed. Install it (Debian's package libopenh264-7), or give a file *.gif, or frames, "
      "a folder for PNG files.\n");
  EXPECT_FALSE(fs::exists(folder.path / "run.mp4"));
  EXPECT_EQ(gif.code, 0) << gif.err;
  EXPECT_TRUE(fs::exists(folder.path / "run.gif"));
}

TEST(CommandLine, JsonCarriesResultsAndErrors) {
  const auto good =
      Json::parse(run({"-q", "--json", "eval", "print('aside') return pose(1, 2, 3)"}).out);
  EXPECT_TRUE(good.at("ok"));
  EXPECT_EQ(good.at("value").at(1).at(3), 2.0);
  const auto bad = Json::parse(run({"-q", "--json", "eval", "robot.lod{}"}).out);
  EXPECT_FALSE(bad.at("ok"));
  EXPECT_EQ(bad.at("error").at("code"), "unknown_name");
  EXPECT_EQ(Json::parse(run({"--json", "no_such"}).out).at("error").at("code"), "usage");
}

TEST(CommandLine, AScriptGetsItsArguments) {
  const Folder folder;
  std::ofstream(folder.path / "s.lua") << "print(arg[1], arg[2], select('#', ...))\n";
  const auto r = run({"-q", "run", (folder.path / "s.lua").string(), "one", "--two"});
  EXPECT_EQ(r.code, 0) << r.err;
  EXPECT_EQ(r.out, "one\t--two\t2\n");
}

TEST(CommandLine, AScriptIsRunByItsNameAlone) {
  const Folder folder;
  const std::string script = (folder.path / "s.lua").string();
  std::ofstream(script) << "print(arg[0]:match('[^/]*$'), arg[1], arg[2], select('#', ...))\n";
  for (const std::vector<std::string>& before : std::vector<std::vector<std::string>>{
           {}, {"-q"}, {"--color", "never", "--no-cache"}, {"--library=" + folder.path.string()}}) {
    std::vector<std::string> words = before;
    words.insert(words.end(), {script, "run", "--json"});
    const auto r = run(words);
    EXPECT_EQ(r.code, 0) << r.err;
    EXPECT_EQ(r.out, "s.lua\trun\t--json\t2\n");
  }
  EXPECT_EQ(run({"nowhere.lua"}).code, 3);
  EXPECT_NE(run({"nowhere.lua"}).err.find("there is no script \"nowhere.lua\""), std::string::npos);
  EXPECT_EQ(run({"nosuchword"}).code, 2);
}

/// A variable of the environment for as long as this lives.
class Environment {
 public:
  Environment(const char* name, const std::string& value) : name_(name) {
    if (const char* before = std::getenv(name)) before_ = before;
    ::setenv(name, value.c_str(), 1);
  }
  ~Environment() {
    if (before_) ::setenv(name_, before_->c_str(), 1);
    else ::unsetenv(name_);
  }
  Environment(const Environment&) = delete;
  Environment& operator=(const Environment&) = delete;

 private:
  const char* name_;
  std::optional<std::string> before_;
};

TEST(CommandLine, ScriptsInFoldersOfPluginsProvideSolversFromTheStart) {
  const Folder folder, config;
  const Environment user("XDG_CONFIG_HOME", config.path.string());
  const auto write = [&](const char* name, const char* code) {
    std::ofstream(folder.path / name) << code;
  };
  write("light.lua",
        "helper = 7  -- its own\n"
        "ioci.provide('robomosp.inverse_dynamics/1', 'weightless', function(model, q)\n"
        "  local tau = {} for i = 1, #q do tau[i] = helper end return tau end)\n");
  const std::string place = folder.path.string();
  const std::string ask =
      "r = robot 'twolink' r:set{inverse_dynamics = 'weightless'} "
      "return r:gravity_torques{q = {0, 0}}";
  const auto eval = [&](const std::string& code, std::vector<std::string> more = {}) {
    more.insert(more.begin(), {"--plugin-path", place});
    more.insert(more.end(), {"eval", code});
    return run(more);
  };
  Outcome r = eval(ask);
  EXPECT_EQ(r.code, 0) << r.err;
  EXPECT_EQ(r.out, "{7, 7} N m\n");
  EXPECT_EQ(r.err, "");
  EXPECT_NE(eval("tostring(rawget(_G, 'helper'))").out.find("nil"), std::string::npos);
  r = eval(
      "for _, p in ipairs(plugin.list()) do if p.id == 'light' then print(p.providers[1], "
      "p.file) end end");
  EXPECT_EQ(r.out, "robomosp.inverse_dynamics/1 weightless\t" + place + "/light.lua\n");
  // What was only found is no default, but can be chosen for good.
  EXPECT_EQ(eval("provider.default 'inverse_dynamics'").out, "newton_euler\n");
  EXPECT_EQ(eval("provider.default('inverse_dynamics', 'weightless', 'user')").code, 0);
  r = eval("provider.default 'inverse_dynamics'");
  EXPECT_EQ(r.out, "weightless\n");
  EXPECT_EQ(r.err, "");
  EXPECT_NE(run({"eval", "1"}).err.find("The default that you chose is not there"),
            std::string::npos);

  // Those that fail are left out one by one, with all that they gave.
  write("bad_syntax.lua", "this is no Lua\n");
  write("half.lua", "ioci.provide('robomosp.ik/1', 'half', function() end)\nerror('no more')\n");
  write("clash.lua", "ioci.provide('robomosp.ik/1', 'numeric', function() end)\n");
  write("with_light.lua",
        "ioci.provide('robomosp.inverse_dynamics/1', 'weightless', function() end)\n");
  r = eval(ask);
  EXPECT_EQ(r.out, "{7, 7} N m\n") << r.err;
  for (const char* name : {"bad_syntax.lua", "half.lua", "clash.lua"})
    EXPECT_NE(r.err.find(std::string(name) + "\" was left out: "), std::string::npos) << r.err;
  EXPECT_EQ(eval("provider.list('ik')").out.find("half"), std::string::npos);
  // By name: light.lua was there before.
  EXPECT_NE(r.err.find("with_light.lua\" was left out: "), std::string::npos) << r.err;
  EXPECT_EQ(eval(ask, {"--no-plugins"}).code, 3);
  r = run({"eval", "plugin.load('" + place + "/light.lua')"});
  EXPECT_NE(r.err.find("Run it: dofile("), std::string::npos) << r.err;
}

TEST(CommandLine, StatementsFromAPipeMayTakeSeveralLines) {
  const auto r = run({"-q"}, "x = {\n1,\n2}\n=#x\nfor i = 1, 2 do\nprint(i)\nend\n");
  EXPECT_EQ(r.code, 0) << r.err;
  EXPECT_EQ(r.out, "2\n1\n2\n");
  EXPECT_EQ(run({"-q"}, "error('a')\nprint('not reached')\n").out, "");
}

TEST(CommandLine, WhatAProgramWroteBeforeItsFaultIsShownWithAndWithoutARobot) {
  const Folder folder;
  const std::string file = (folder.path / "p.irl").string();
  std::ofstream(file) << "PROGRAM p;\nVAR INT: n := 0;\nBEGIN\n  WRITELN('before');\n  "
                         "WRITELN(10 DIV n);\nENDPROGRAM;\n";
  for (const auto& args : {std::vector<std::string>{"irl", file},
                           std::vector<std::string>{"irl", "--robot", "ur5", file}}) {
    const Outcome o = run(args);
    EXPECT_NE(o.code, 0);
    EXPECT_NE(o.out.find("before\n"), std::string::npos) << o.out << o.err;
    EXPECT_NE(o.err.find("divides by zero"), std::string::npos) << o.err;
  }
}

TEST(CommandLine, AFileThatIsNoPluginIsRefusedByTheCheck) {
  const auto r = run({"plugin", "check", "/etc/passwd"});
  EXPECT_EQ(r.code, 3);
  EXPECT_NE(r.err.find("/etc/passwd"), std::string::npos) << r.err;
}

TEST(Rpc, AnswersRequestsBatchesNotificationsAndFaults) {
  const auto r =
      run({"-q", "rpc"},
          "{\"jsonrpc\":\"2.0\",\"id\":1,\"method\":\"material.create\",\"params\":{\"name\":\"m\","
          "\"density\":5}}\n"
          "not json\n"
          "{\"jsonrpc\":\"2.0\",\"id\":2}\n"
          "{\"jsonrpc\":\"2.0\",\"id\":3,\"method\":\"no.such\"}\n"
          "{\"jsonrpc\":\"2.0\",\"id\":4,\"method\":\"material.create\",\"params\":{\"density\":"
          "\"heavy\"}}\n"
          "{\"jsonrpc\":\"2.0\",\"method\":\"document.undo\"}\n"
          "[{\"jsonrpc\":\"2.0\",\"id\":5,\"method\":\"material.list\"},1,{\"jsonrpc\":\"2.0\","
          "\"method\":\"version\"}]\n"
          "[]\n"
          "{\"jsonrpc\":\"2.0\",\"id\":\"e\",\"method\":\"lua.eval\",\"params\":{\"code\":\"print('"
          "x') return 0/0\"}}\n"
          "\"\xff\xfe\"\n" +
              std::string(100, '[') + "\n{\"jsonrpc\":\"2.0\",\"id\":6,\"method\":\"version\"}");
  EXPECT_EQ(r.code, 0) << r.err;
  std::vector<Json> answers;
  std::istringstream lines(r.out);
  for (std::string line; std::getline(lines, line);) answers.push_back(Json::parse(line));
  ASSERT_EQ(answers.size(), 11U) << r.out;
  EXPECT_EQ(answers[0].at("result").at("$handle").at("name"), "m");
  EXPECT_EQ(answers[1].at("error").at("code"), -32700);
  EXPECT_EQ(answers[2].at("error").at("code"), -32600);
  EXPECT_EQ(answers[3].at("error").at("code"), -32601);
  EXPECT_EQ(answers[4].at("error").at("code"), -32602);
  EXPECT_EQ(answers[4].at("error").at("data").at("code"), "invalid_argument");
  ASSERT_EQ(answers[5].size(), 2U);  // the notification in the batch has no answer
  EXPECT_EQ(answers[5][0].at("result").size(), 0U)
      << "the notification before it undid the material";
  EXPECT_EQ(answers[5][1].at("error").at("code"), -32600);
  EXPECT_EQ(answers[6].at("error").at("code"), -32600);
  EXPECT_EQ(answers[7].at("id"), "e");
  EXPECT_EQ(answers[7].at("result").at("output"), "x\n");
  EXPECT_TRUE(answers[7].at("result").at("value").is_string());
  EXPECT_EQ(answers[8].at("error").at("code"), -32700);
  EXPECT_EQ(answers[9].at("error").at("code"), -32700);
  EXPECT_EQ(answers[10].at("id"), 6);
}

/// The program as a peer sees it that talks back and forth.
class Peer {
 public:
  explicit Peer(const std::vector<std::string>& args) {
    int in[2], out[2];
    if (::pipe(in) != 0 || ::pipe(out) != 0) std::abort();
    child_ = ::fork();
    if (child_ == 0) {
      ::dup2(in[0], 0);
      ::dup2(out[1], 1);
      for (const int fd : {in[0], in[1], out[0], out[1]}) ::close(fd);
      execute(args);
    }
    ::close(in[0]);
    ::close(out[1]);
    in_ = in[1];
    out_ = out[0];
  }
  ~Peer() {
    close_input();
    ::close(out_);
    if (child_ > 0) {
      ::kill(child_, SIGKILL);
      ::waitpid(child_, nullptr, 0);
    }
  }
  void close_input() {
    if (in_ >= 0) ::close(in_);
    in_ = -1;
  }
  void signal(int number) const { ::kill(child_, number); }
  /// Exit code within some seconds, or -1.
  int ended(double seconds) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
    while (std::chrono::steady_clock::now() < end) {
      int status = 0;
      if (::waitpid(child_, &status, WNOHANG) == child_) {
        child_ = -1;
        return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
      }
      ::usleep(1000);
    }
    return -1;
  }
  void send(const Json& message) {
    const std::string line = message.dump() + "\n";
    ASSERT_EQ(::write(in_, line.data(), line.size()), static_cast<ssize_t>(line.size()));
  }
  /// The next line; none after 60 s.
  std::optional<std::string> receive_line() {
    for (;;) {
      const auto newline = buffer_.find('\n');
      if (newline != std::string::npos) {
        std::string line = buffer_.substr(0, newline);
        buffer_.erase(0, newline + 1);
        return line;
      }
      pollfd ready{out_, POLLIN, 0};
      if (::poll(&ready, 1, 60'000) <= 0) return std::nullopt;
      char chunk[4096];
      const ssize_t n = ::read(out_, chunk, sizeof chunk);
      if (n <= 0) return std::nullopt;
      buffer_.append(chunk, static_cast<std::size_t>(n));
    }
  }
  /// The next message; null after 60 s.
  Json receive() {
    const auto line = receive_line();
    return line ? Json::parse(*line) : Json();
  }
  /// The answer to a request; notifications before it are kept.
  Json ask(const std::string& method, const Json& params, const Json& more = Json::object()) {
    Json request{{"jsonrpc", "2.0"}, {"id", ++last_}, {"method", method}, {"params", params}};
    request.update(more);
    send(request);
    return answer_to(last_);
  }
  Json answer_to(int id) {
    for (;;) {
      Json message = receive();
      if (message.is_null() || (message.contains("id") && message.at("id") == id)) return message;
      notes.push_back(std::move(message));
    }
  }
  std::vector<Json> notes;  ///< what came that was no answer
  int last_ = 0;

 private:
  pid_t child_ = -1;
  int in_ = -1, out_ = -1;
  std::string buffer_;
};

/// A world in which the search for a way goes on until its time is over.
constexpr const char* kBlocked =
    "arm = robot.create{name = 'arm', convention = 'dh', links = {{a = 0.5, lower = -3, upper = "
    "3}}, poses = {there = {1}, here = {-1}}}\n"
    "solid.create{name = 'ball', root = {kind = 'sphere', radius = 0.1}}\n"
    "cell = world.create{name = 'cell'}\n"
    "cell:add_robot{robot = arm, q = 'here'}\n"
    "cell:add_object{what = 'ball', position = {0.4, 0, 0}}\n"
    "assert(not cell:check_path{path = {'here', 'there'}}.is_free)\n";

double ms_since(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin)
      .count();
}

/// Of what would last for 30 s or more if it waited for a search: it has ended long before. What it
/// took [ms] is only noted; the aim is for a machine that does nothing else.
void expect_before_the_search(double ms, const char* what, int aim) {
  testing::Test::RecordProperty(std::string(what) + "_ms", std::to_string(ms));
  std::printf("%s took %.0f ms (aim %d)\n", what, ms, aim);
  EXPECT_LT(ms, 15000) << what;
}

TEST(Rpc, LinesOfTheProgramOf2006AreAMethod) {
  Peer peer({"-q", "rpc"});
  const auto line = [&](const std::string& text) {
    return peer.ask("ioci.classic", {{"line", text}});
  };
  EXPECT_EQ(line("PRobot puma560 GetDOF").at("result"), 6);
  EXPECT_NEAR(line("PRobot puma560 Link 2 GetMaxAngle").at("result").get<double>(), 225, 1e-9);
  EXPECT_EQ(peer.ask("ioci.classic", Json::array({"IOIC::PRobot puma560 GetDOF"})).at("result"), 6);
  ASSERT_TRUE(peer.ask("lua.eval", {{"code",
                                     "world.create{name = 'cell'}:add_robot{robot = "
                                     "'puma560'}"}})
                  .contains("result"));
  EXPECT_NEAR(line("PRobot puma560 SetLinks 90 0 0 0 0 0").at("result").at(0).get<double>(), 90,
              1e-9);
  EXPECT_NEAR(line("PRobot puma560 LLRL mGetInJointp").at("result").at(0).get<double>(),
              1.5707963267948966, 1e-12);
  EXPECT_EQ(line("").at("result"), nullptr);
  const Json refused = line("PRobot puma560 Link 7 Set 1");
  EXPECT_EQ(refused.at("error").at("message"),
            "robot.set_joint, joint: there is no link 7. Links are numbered 1 to 6.");
  EXPECT_EQ(refused.at("error").at("data").at("code"), "invalid_argument");
  EXPECT_EQ(line("PRobt puma560 GetDOF").at("error").at("data").at("hint"),
            "Did you mean \"PRobot\"?");
  EXPECT_EQ(peer.ask("ioci.classic", {{"text", "x"}}).at("error").at("message"),
            "ioci.classic needs the text line, and nothing else. Send {\"line\": \"PRobot puma560 "
            "GetDOF\"}.");
  EXPECT_TRUE(
      peer.ask("ioci.classic", {{"line", "Worlds LsWorlds"}}, {{"job", true}}).contains("error"));
  // A batch is several lines; what they edit is one person's line of undo.
  peer.send(Json::array({{{"jsonrpc", "2.0"},
                          {"id", "a"},
                          {"method", "ioci.classic"},
                          {"params", {{"line", "PRobot puma560 Link 1 Add -60"}}}},
                         {{"jsonrpc", "2.0"},
                          {"id", "b"},
                          {"method", "ioci.classic"},
                          {"params", {{"line", "PRobot puma560 GetAngle 1"}}}}}));
  const Json both = peer.receive();
  ASSERT_EQ(both.size(), 2U) << both;
  EXPECT_NEAR(both[1].at("result").get<double>(), 30, 1e-9);
  ASSERT_TRUE(peer.ask("document.undo", Json::object()).contains("result"));
  EXPECT_NEAR(line("PRobot puma560 Link 1 GetAngle").at("result").get<double>(), 90, 1e-9);
}

TEST(Rpc, WhileAJobPlansShortCommandsAreAnsweredAndItCanBeCancelled) {
  Peer peer({"-q", "rpc"});
  ASSERT_TRUE(peer.ask("lua.eval", {{"code", kBlocked}}).contains("result"));
  const Json job = peer.ask("world.plan_path",
                            {{"id", "cell"}, {"robot", "arm"}, {"to", "there"}, {"seconds", 120}},
                            {{"job", true}, {"progress", true}});
  ASSERT_TRUE(job.contains("result")) << job;
  const Json handle = job.at("result");
  EXPECT_EQ(handle.at("$handle").at("kind"), "job") << job;
  const auto running = [&peer] {
    return std::count_if(peer.notes.begin(), peer.notes.end(), [](const Json& n) {
      return n.value("method", "") == "job.progress" && n.at("params").at("state") == "running";
    });
  };
  const auto patience = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  while (running() < 2 && std::chrono::steady_clock::now() < patience) {
    Json note = peer.receive();
    ASSERT_FALSE(note.is_null());
    peer.notes.push_back(std::move(note));
  }
  EXPECT_GE(running(), 2) << "progress is told while it runs";
  double slowest = 0;
  for (int i = 0; i < 20; ++i) {
    const auto begin = std::chrono::steady_clock::now();
    const Json fk = peer.ask("robot.fk", {{"id", "arm"}, {"q", "here"}});
    ASSERT_TRUE(fk.contains("result")) << fk;
    slowest = std::max(slowest, ms_since(begin));
  }
  expect_before_the_search(slowest, "the_slowest_answer", 50);
  EXPECT_EQ(peer.ask("job.progress", {{"id", handle}}).at("result").at("state"), "running");
  // A wait holds nobody up.
  peer.send(
      {{"jsonrpc", "2.0"}, {"id", "wait"}, {"method", "job.wait"}, {"params", {{"id", handle}}}});
  EXPECT_TRUE(peer.ask("version", Json::object()).contains("result"));
  const auto begin = std::chrono::steady_clock::now();
  EXPECT_EQ(peer.ask("job.cancel", {{"id", handle}}).at("result"), true);
  for (bool has_wait = false, has_note = false; !has_wait || !has_note;) {
    for (const Json& note : peer.notes) {
      if (note.value("id", Json()) == "wait") {
        has_wait = true;
        EXPECT_EQ(note.at("error").at("data").at("code"), "cancelled") << note;
      }
      if (note.value("method", "") == "job.progress" &&
          note.at("params").at("state") == "cancelled")
        has_note = true;
    }
    if (!has_wait || !has_note) {
      Json next = peer.receive();
      ASSERT_FALSE(next.is_null());
      peer.notes.push_back(std::move(next));
    }
  }
  expect_before_the_search(ms_since(begin), "the_end", 200);
  peer.close_input();
  EXPECT_EQ(peer.ended(60), 0);
}

TEST(Rpc, ARequestThatRunsOrWaitsCanBeCancelledByItsId) {
  Peer peer({"-q", "rpc"});
  ASSERT_TRUE(peer.ask("lua.eval", {{"code", kBlocked}}).contains("result"));
  const auto request = [](const Json& id, const std::string& method, const Json& params) {
    return Json{{"jsonrpc", "2.0"}, {"id", id}, {"method", method}, {"params", params}};
  };
  peer.send(request("plan", "world.plan_path",
                    {{"id", "cell"}, {"robot", "arm"}, {"to", "there"}, {"seconds", 30}}));
  peer.send(request("behind", "version", Json::object()));
  peer.send(request("last", "version", Json::object()));
  ::usleep(300'000);
  const auto begin = std::chrono::steady_clock::now();
  peer.send(request("a", "rpc.cancel", {{"request", "behind"}}));
  peer.send(request("b", "rpc.cancel", {{"request", "plan"}}));
  peer.send(request("c", "rpc.cancel", {{"request", "never"}}));
  std::map<std::string, Json> answers;
  while (answers.size() < 6) {
    const Json next = peer.receive();
    ASSERT_FALSE(next.is_null());
    answers[next.at("id")] = next;
  }
  expect_before_the_search(ms_since(begin), "all_answers", 300);
  EXPECT_EQ(answers["a"].at("result"), true);
  EXPECT_EQ(answers["b"].at("result"), true);
  EXPECT_EQ(answers["c"].at("result"), false);
  EXPECT_EQ(answers["plan"].at("error").at("data").at("code"), "cancelled");
  EXPECT_EQ(answers["behind"].at("error").at("data").at("code"), "cancelled");
  EXPECT_TRUE(answers["last"].contains("result")) << "the program goes on";
  // A script is cancelled the same way.
  peer.send(request("script", "lua.eval", {{"code", "while true do pcall(function() end) end"}}));
  ::usleep(100'000);
  peer.send(request("d", "rpc.cancel", {{"request", "script"}}));
  for (bool is_there = false; !is_there;) {
    const Json next = peer.receive();
    ASSERT_FALSE(next.is_null());
    is_there = next.at("id") == "script";
    if (is_there) {
      EXPECT_EQ(next.at("error").at("data").at("code"), "cancelled") << next;
    }
  }
  EXPECT_TRUE(peer.ask("version", Json::object()).contains("result"));
}

TEST(Rpc, AnswersComeInTheOrderOfTheRequestsAndFaultsOfJobsAreSaid) {
  Peer peer({"-q", "rpc"});
  for (int i = 0; i < 200; ++i)
    peer.send({{"jsonrpc", "2.0"},
               {"id", i},
               {"method", "material.create"},
               {"params", {{"name", "m" + std::to_string(i)}, {"density", 1000 + i}}}});
  for (int i = 0; i < 200; ++i) EXPECT_EQ(peer.receive().at("id"), i);
  const auto fault = [&](const Json& more, const std::string& method = "material.list") {
    return peer.ask(method, Json::object(), more).at("error").at("message").get<std::string>();
  };
  EXPECT_EQ(fault({{"job", 1}}), "job, progress and notes must be true or false.");
  EXPECT_NE(fault({{"job", true}}, "lua.eval").find("lua.eval needs the text code"),
            std::string::npos);
  EXPECT_NE(fault({{"job", true}}, "document.undo").find("Call it without a job"),
            std::string::npos);
  EXPECT_NE(fault(Json::object(), "rpc.cancel").find("rpc.cancel needs the id of a request"),
            std::string::npos);
  const Json job = peer.ask("material.list", Json::object(), {{"job", true}}).at("result");
  EXPECT_EQ(peer.ask("job.wait", {{"id", job}}).at("result").size(), 200U);
}

/// What writes to standard output in all the ways there are.
constexpr const char* kLoud =
    "io.write('written ', 7, '\\n') print('printed') io.stdout:write('to the file\\n') "
    "io.output():write('to the output\\n') os.execute('echo by a program') "
    "io.stdout:setvbuf('no') io.write('last') io.stdout:flush() return 3";

TEST(Rpc, WhatScriptsAndTheirProgramsWriteComesNotBetweenTheAnswers) {
  Peer peer({"-q", "rpc"});
  const Json answer = peer.ask("lua.eval", {{"code", kLoud}});
  EXPECT_EQ(answer.at("result").at("value"), 3);
  EXPECT_EQ(answer.at("result").at("output"),
            "written 7\nprinted\nto the file\nto the output\nlast");
  EXPECT_TRUE(peer.notes.empty());
  const Json closed =
      peer.ask("lua.eval", {{"code", "local ok, why = io.stdout:close() print(why)"}});
  EXPECT_EQ(closed.at("result").at("output"), "cannot close standard file\n");
  EXPECT_TRUE(peer.ask("version", Json::object()).contains("result"));
}

TEST(CommandLine, WithJsonStandardOutputCarriesAnswersOnly) {
  const auto r = run({"-q", "--json", "eval", kLoud});
  EXPECT_EQ(r.code, 0) << r.err;
  EXPECT_EQ(Json::parse(r.out).at("value"), 3) << r.out;
  for (const char* said : {"written 7\nprinted\nto the file\n", "by a program", "last"})
    EXPECT_NE(r.err.find(said), std::string::npos) << r.err;
  // Without it all is where it was, and in order.
  const auto plain = run({"-q", "eval", kLoud});
  EXPECT_EQ(plain.out, "written 7\nprinted\nto the file\nto the output\nby a program\nlast3\n");
}

TEST(Rpc, ALargeBatchIsRefusedBeforeItTakesTheMemory) {
  constexpr std::size_t kItems = 2'000'000;
  std::string ones = "[1";
  for (std::size_t i = 1; i < kItems; ++i) ones += ",1";
  std::string objects = "[{}";
  for (std::size_t i = 1; i < kItems; ++i) objects += ",{}";
  std::string keys = "{\"jsonrpc\":\"2.0\",\"id\":1,\"method\":\"version\",\"params\":{\"k\":1";
  for (std::size_t i = 1; i < 300'000; ++i) keys += ",\"k" + std::to_string(i) + "\":1";
  std::string requests = "[";
  for (std::size_t i = 0; i < 100'000; ++i)
    requests += std::string(i ? "," : "") + R"({"jsonrpc":"2.0","id":1,"method":"version"})";
  const auto r = run({"-q", "--no-plugins", "rpc"},
                     ones + "]\n" + objects + "]\n" + keys + "}}\n" + requests + "]\n");
  EXPECT_EQ(r.code, 0);
  EXPECT_LT(r.memory, 500L << 10);
  EXPECT_LT(r.out.size(), 10'000U) << r.out.size();
  std::istringstream lines(r.out);
  std::size_t count = 0;
  for (std::string line; std::getline(lines, line); ++count)
    EXPECT_TRUE(Json::parse(line).contains("error")) << line;
  EXPECT_EQ(count, 4U);
}

TEST(CommandLine, AnErrorDoesNotRepeatAllThatItWasGiven) {
  const std::string name(200'000, 'x');
  const auto is_short = [](const std::string& s) { return !s.empty() && s.size() < 6000; };
  for (const std::string code :
       {"robot.get(('x'):rep(200000))", "material.create{name = ('x'):rep(200000), density = -1}",
        "ioci.call(('x'):rep(200000))", "file.load(('x'):rep(200000))",
        "material.create{name = 'a', density = ('x'):rep(200000)}",
        "material.create{[('x'):rep(200000)] = 1}", "error(('x'):rep(200000))"}) {
    const auto plain = run({"-q", "eval", code});
    EXPECT_NE(plain.code, 0);
    EXPECT_TRUE(is_short(plain.err)) << code << ": " << plain.err.size();
    const auto json = run({"-q", "--json", "eval", code});
    EXPECT_TRUE(is_short(json.out)) << code << ": " << json.out.size();
  }
  const auto request = [&](const std::string& method, const std::string& params) {
    return R"({"jsonrpc":"2.0","id":1,"method":")" + method + R"(","params":)" + params + "}\n";
  };
  const auto r =
      run({"-q", "rpc"}, request(name, "{}") + request("robot.get", "[\"" + name + "\"]") +
                             request("lua.eval", "{\"code\":\"" + name + ".y()\"}") +
                             request("robot.get", "{\"" + name + "\":1}") + name + "\n");
  std::istringstream lines(r.out);
  std::size_t count = 0;
  for (std::string line; std::getline(lines, line); ++count)
    EXPECT_TRUE(is_short(line)) << line.size();
  EXPECT_EQ(count, 5U);
}

TEST(CommandLine, WhatFilesAndPluginsSayCannotSteerATerminal) {
  const auto has_control = [](const std::string& s) {
    return s.find('\x1b') != std::string::npos || s.find('\x07') != std::string::npos;
  };
  const Folder folder;
  std::ofstream(folder.path / "a.mtr") << "robomosp material 1\nname a\ndensity 1\n"
                                          "description \"\x1b[2J\x07 described\"\n";
  const std::string load = "m = material.load('" + (folder.path / "a.mtr").string() + "') ";
  for (const std::string& code :
       {load + "return m:describe().description", load + "return m:describe()",
        load + "return m:text()", load + "error(m:describe().description)",
        load + "robot.get(m:describe().description)", std::string("file.load('\x1b[31m.mtr')"),
        std::string("x = \x1b[31m")}) {
    const auto r = run({"-q", "eval", code});
    EXPECT_FALSE(has_control(r.out + r.err)) << code << "\n" << r.out << r.err;
    EXPECT_FALSE((r.out + r.err).empty()) << code;
  }
  // A script may.
  EXPECT_TRUE(has_control(run({"-q", "eval", "print('\x1b[31mred')"}).out));
}

TEST(CommandLine, AWrongInstructionSetIsWarnedOf) {
  const Environment set("ROBOMOSP_SIMD", "sse9");
  const auto r = run({"--color", "never", "eval", "return 1"});
  EXPECT_EQ(r.code, 0) << r.err;
  EXPECT_NE(r.err.find("warning: ROBOMOSP_SIMD is \"sse9\", which is not an instruction set"),
            std::string::npos)
      << r.err;
  const Environment right("ROBOMOSP_SIMD", "baseline");
  EXPECT_EQ(run({"--color", "never", "eval", "return 1"}).err.find("ROBOMOSP_SIMD"),
            std::string::npos);
}

TEST(CommandLine, GeometryIsKeptFromRunToRunUnlessItIsTurnedOff) {
  const Folder folder;
  ASSERT_EQ(::setenv("ROBOMOSP_CACHE", (folder.path / "kept").c_str(), 1), 0);
  const std::string weigh =
      "solid.create{name = 'plate', material = material.create{name = 'tin', density = 7300}, "
      "root = {kind = 'difference', children = {{kind = 'box', x = 0.1, y = 0.1, z = 0.01}, "
      "{kind = 'torus', ring_radius = 0.03, tube_radius = 0.004}}}} "
      "local m = solid.mass{id = 'plate'} local k = cache.kept() "
      "return string.format('%a ', m.mass), k.found, k.written, k.files, k.on";
  const auto answer = [&](std::vector<std::string> options) {
    options.insert(options.end(), {"-q", "--json", "eval", weigh});
    const auto r = run(options);
    return Json::parse(r.out).at("value");
  };
  const Json without = answer({"--no-cache"});
  EXPECT_FALSE(without.at(4));
  EXPECT_FALSE(fs::exists(folder.path / "kept"));
  const Json first = answer({}), second = answer({});
  EXPECT_EQ(first.at(0), without.at(0));
  EXPECT_EQ(first.at(1), 0);
  EXPECT_GT(first.at(2), 0);
  EXPECT_EQ(second.at(0), without.at(0));
  EXPECT_GT(second.at(1), 0);
  EXPECT_EQ(second.at(2), 0);
  EXPECT_EQ(second.at(3), first.at(3));
  const auto cleared = Json::parse(
      run({"-q", "--json", "eval", "return cache.clear_kept(), cache.kept().files"}).out);
  EXPECT_EQ(cleared.at("value").at(0), first.at(3));
  EXPECT_EQ(cleared.at("value").at(1), 0);
  ASSERT_EQ(::setenv("ROBOMOSP_CACHE", "off", 1), 0);
  EXPECT_FALSE(answer({}).at(4));
}

TEST(CommandLine, TheDoctorFindsNothingMissingInThisBuild) {
  const auto r = run({"doctor"});
  EXPECT_EQ(r.code, 0) << r.out << r.err;
  EXPECT_NE(r.out.find("Nothing is missing."), std::string::npos) << r.out;
  const auto bare = run({"--no-plugins", "doctor"});
  EXPECT_EQ(bare.code, 1) << bare.out;
  EXPECT_NE(bare.out.find("missing: no provider of robomosp.ik/"), std::string::npos) << bare.out;
}

TEST(CommandLine, AFileThatMayNotGrowIsAnErrorAndLeavesTheOldOne) {
  const Folder folder;
  const std::string file = (folder.path / "a.mtr").string();
  const std::string make =
      "material.create{name = 'a', density = 1} material.save{id = 'a', file = '" + file + "'}";
  ASSERT_EQ(run({"-q", "eval", make}).code, 0);
  const std::string before = slurp(file);
  const auto r = run({"-q", "eval",
                      "material.create{name = 'a', density = 1, description = ('long '):rep(5000)} "
                      "material.save{id = 'a', file = '" +
                          file + "'}"},
                     {}, 4096);
  EXPECT_EQ(r.code, 1) << r.err;
  EXPECT_NE(r.err.find("cannot write"), std::string::npos) << r.err;
  EXPECT_EQ(slurp(file), before);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder.path), fs::directory_iterator()), 1);
}

TEST(CommandLine, CtrlCEndsWhatComputesWithinAFifthOfASecond) {
  Peer peer({"-q", "eval",
             std::string(kBlocked) +
                 "print('go')\ncell:plan_path{robot = 'arm', to = 'there', seconds = 120}"});
  ASSERT_EQ(peer.receive_line().value_or(""), "go");
  ::usleep(300'000);  // it searches, most likely
  const auto begin = std::chrono::steady_clock::now();
  peer.signal(SIGINT);
  EXPECT_EQ(peer.ended(60), 130);
  expect_before_the_search(ms_since(begin), "the_end", 200);
}

TEST(Rpc, ALineThatIsTooLongIsRefusedAndTheNextOneAnswered) {
  const auto r =
      run({"-q", "rpc"}, std::string((std::size_t{8} << 20) + 1, 'x') +
                             "\n{\"jsonrpc\":\"2.0\",\"id\":1,\"method\":\"version\"}\n");
  std::istringstream lines(r.out);
  std::string first, second;
  ASSERT_TRUE(std::getline(lines, first) && std::getline(lines, second)) << r.out;
  EXPECT_EQ(Json::parse(first).at("error").at("code"), -32600);
  EXPECT_EQ(Json::parse(second).at("id"), 1);
}

/// The console on a pseudo-terminal of 100 columns.
class Terminal {
 public:
  explicit Terminal(const fs::path& home, const char* pager = nullptr) {
    winsize size{30, 100, 0, 0};
    child_ = ::forkpty(&fd_, nullptr, nullptr, &size);
    if (child_ == 0) {
      ::setenv("HOME", home.c_str(), 1);
      ::unsetenv("XDG_STATE_HOME");
      ::unsetenv("XDG_CONFIG_HOME");
      ::setenv("TERM", "xterm", 1);
      ::setenv("NO_COLOR", "1", 1);
      if (pager) ::setenv("PAGER", pager, 1);
      else ::unsetenv("PAGER");
      execute({});
    }
  }
  ~Terminal() {
    if (child_ > 0) {
      ::kill(child_, SIGKILL);
      ::waitpid(child_, nullptr, 0);
    }
    ::close(fd_);
  }
  void type(const std::string& keys) {
    ASSERT_EQ(::write(fd_, keys.data(), keys.size()), static_cast<ssize_t>(keys.size()));
  }
  /// Waits until `text` shows after what was waited for before.
  bool expect(const std::string& text, int ms = 60000) {
    const auto until = std::chrono::steady_clock::now() + std::chrono::milliseconds(ms);
    for (;;) {
      if (const auto at = seen.find(text, from_); at != std::string::npos) {
        from_ = at + text.size();
        return true;
      }
      if (std::chrono::steady_clock::now() > until || !fill()) return false;
    }
  }
  int wait_exit() {
    const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    while (fill())
      if (std::chrono::steady_clock::now() > until) ::kill(child_, SIGKILL);
    int status = 0;
    ::waitpid(child_, &status, 0);
    child_ = -1;
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  }
  std::string seen;

 private:
  bool fill() {
    pollfd ready{fd_, POLLIN, 0};
    if (::poll(&ready, 1, 100) == 0) return true;
    char chunk[4096];
    const ssize_t n = ::read(fd_, chunk, sizeof chunk);
    if (n <= 0) return false;
    seen.append(chunk, static_cast<std::size_t>(n));
    return true;
  }
  int fd_ = -1;
  pid_t child_ = -1;
  std::size_t from_ = 0;
};

TEST(Console, EvaluatesSeveralLinesAndLeavesOnCtrlD) {
  const Folder home;
  Terminal t(home.path);
  ASSERT_TRUE(t.expect("> ")) << t.seen;
  t.type("for i = 1, 1 do\n");
  ASSERT_TRUE(t.expect(">> ")) << t.seen;
  t.type("print('sum', 40 + 2)\n");
  ASSERT_TRUE(t.expect(">> ")) << t.seen;
  t.type("end\n");
  ASSERT_TRUE(t.expect("sum\t42") || t.expect("sum     42", 1000)) << t.seen;
  ASSERT_TRUE(t.expect("> ")) << t.seen;
  t.type("\x04");
  EXPECT_EQ(t.wait_exit(), 0) << t.seen;
}

/// The line of the progress is erased before an answer, a text of a script and the prompt.
TEST(Console, ErasesTheProgressBeforeWhateverFollows) {
  const Folder home;
  Terminal t(home.path);
  ASSERT_TRUE(t.expect("> ")) << t.seen;
  t.type("arm = robot 'twolink'\n");
  ASSERT_TRUE(t.expect("\r\n> ")) << t.seen;
  const std::string erased = "inverse kinematics\x1b[K\r\x1b[K";
  const std::string solve = "arm:solve_ik{target = arm:fk{q = {0.3, 0.4}}.pose}";
  for (const auto& [line, shown] : std::initializer_list<std::pair<std::string, std::string>>{
           {solve + ".q", "{0.3, 0.4} rad"},
           {"print('q', " + solve + ".q)", "q"},
           {"s = " + solve, "> "},
           {"arm:solve_ik{target = pose(9, 0, 0)}", "error: "}}) {
    // Progress is shown ten times a second at most.
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
    t.type(line + "\n");
    ASSERT_TRUE(t.expect(erased + shown)) << t.seen;
  }
}

TEST(Console, CtrlCStopsAnEndlessLoopEvenInsidePcallAndKeepsTheProgram) {
  const Folder home;
  Terminal t(home.path);
  ASSERT_TRUE(t.expect("> ")) << t.seen;
  t.type("print('go') while true do pcall(function() while true do end end) end\n");
  ASSERT_TRUE(t.expect("go\r\n")) << t.seen;
  t.type("\x03");
  ASSERT_TRUE(t.expect("interrupted")) << t.seen;
  ASSERT_TRUE(t.expect("> ")) << t.seen;
  t.type("=20 + 3\n");
  EXPECT_TRUE(t.expect("\r\n23")) << t.seen;
}

TEST(Console, NotesOfWhatWasTypedAreShownOnceEach) {
  const Folder home;
  Terminal t(home.path);
  ASSERT_TRUE(t.expect("> ")) << t.seen;
  t.type("puma = robot 'puma560'\n");
  ASSERT_TRUE(t.expect("> ")) << t.seen;
  t.type("puma:fk{q={0,90,0,0,0,0}}.position\n");
  ASSERT_TRUE(t.expect("note: robot \"puma560\", joint 2 (\"shoulder\"): 90 is taken as 90 rad"))
      << t.seen;
  ASSERT_TRUE(t.expect("\"90 deg\" for degrees.")) << t.seen;
  t.type("robot.create{name='a', links={{a=300}}}:dof()\n");
  ASSERT_TRUE(t.expect("note: robot.create: links[1].a = 300 is taken as 300 m.")) << t.seen;
  t.type("run = 5\n");
  ASSERT_TRUE(t.expect("hides the commands run.*")) << t.seen;
  t.type("run = nil\n");
  t.type("#run.list()\n");
  ASSERT_TRUE(t.expect("\r\n0")) << t.seen;
  t.type("local z = 3\n");
  ASSERT_TRUE(t.expect("note: A local variable ends with its line")) << t.seen;
  t.type("a:dof()\n");
  ASSERT_TRUE(t.expect("a = robot \"a\" makes it a variable.")) << t.seen;
  t.type("print('end')\n");
  ASSERT_TRUE(t.expect("\r\nend")) << t.seen;
}

TEST(Console, LeavingAsksWhatToDoWithUnsavedWork) {
  const Folder home;
  const auto folder = [&] { return home.path / "out"; };
  fs::create_directory(folder());
  const std::string make = "material.create{name='brass', density=8500}\n";
  {
    Terminal t(home.path);
    ASSERT_TRUE(t.expect("> ")) << t.seen;
    t.type(make);
    ASSERT_TRUE(t.expect("material:brass")) << t.seen;
    t.type("exit()\n");
    ASSERT_TRUE(t.expect("Not saved: material \"brass\".")) << t.seen;
    ASSERT_TRUE(t.expect("[b]ack to the console? ")) << t.seen;
    t.type("b\n");
    ASSERT_TRUE(t.expect("> ")) << t.seen;
    t.type("#material.list()\n");
    ASSERT_TRUE(t.expect("\r\n1")) << t.seen;
    t.type("quit\n");
    ASSERT_TRUE(t.expect("[b]ack to the console? ")) << t.seen;
    t.type("k\n");
    ASSERT_TRUE(t.expect("Kept for the next start")) << t.seen;
    EXPECT_EQ(t.wait_exit(), 0) << t.seen;
  }
  Terminal t(home.path);
  ASSERT_TRUE(t.expect("Unsaved work of ")) << t.seen;
  ASSERT_TRUE(t.expect("> ")) << t.seen;
  t.type("recovery.restore()[1].name\n");
  ASSERT_TRUE(t.expect("\r\nbrass")) << t.seen;
  ASSERT_TRUE(t.expect("> ")) << t.seen;
  t.type("\x04");
  ASSERT_TRUE(t.expect("[b]ack to the console? ")) << t.seen;
  t.type("s\n");
  ASSERT_TRUE(t.expect("Folder for what was never saved")) << t.seen;
  t.type(folder().string() + "\n");
  ASSERT_TRUE(t.expect("Saved ")) << t.seen;
  EXPECT_EQ(t.wait_exit(), 0) << t.seen;
  EXPECT_TRUE(fs::exists(folder() / "brass.mtr"));
  EXPECT_TRUE(fs::is_empty(home.path / ".local/state/robomosp/recovery"));
}

TEST(Console, InputFromAFileKeepsUnsavedWorkAndNamesTheLineOfAnError) {
  const Folder home;
  ::setenv("XDG_STATE_HOME", home.path.c_str(), 1);
  const Outcome made = run({}, "m = material.create{name='brass', density=8500}\n");
  const Outcome wrong = run({}, "print 'a'\n\nx = {\n1,\n2}\nnosuch()\nprint 'b'\n");
  const Outcome there = run({}, "#recovery.list()\nrecovery.restore()[1].name\nexit\nprint 'no'\n");
  const Outcome saved =
      run({}, "x = recovery.restore()\n#document.save('" + home.path.string() + "')\n");
  const Outcome none = run({}, "#recovery.list()\n");
  const Outcome json = run({"--json"}, "robot.get('puma560'):fk{q={0,90,0,0,0,0}}.position\n");
  ::unsetenv("XDG_STATE_HOME");
  EXPECT_EQ(made.code, 0) << made.err;
  EXPECT_NE(made.err.find("Not saved: material \"brass\". Kept for the next start"),
            std::string::npos)
      << made.err;
  EXPECT_NE(wrong.code, 0);
  EXPECT_EQ(wrong.out, "a\n");
  EXPECT_NE(wrong.err.find("line 6 of the input"), std::string::npos) << wrong.err;
  EXPECT_EQ(there.out, "1\nbrass\n") << there.err;
  EXPECT_EQ(saved.out, "1\n") << saved.err;
  EXPECT_EQ(none.out, "0\n") << none.err;
  EXPECT_EQ(json.err, "") << "notes are for people";
}

TEST(Console, CtrlCAtThePromptDropsTheInput) {
  const Folder home;
  Terminal t(home.path);
  ASSERT_TRUE(t.expect("> ")) << t.seen;
  t.type("x = {\n");
  ASSERT_TRUE(t.expect(">> ")) << t.seen;
  t.type("1, 2\x03");
  ASSERT_TRUE(t.expect("^C")) << t.seen;
  t.type("=type(x)\n");
  EXPECT_TRUE(t.expect("nil")) << t.seen;
}

TEST(Console, TabCompletesNamespacesAndCommands) {
  const Folder home;
  Terminal t(home.path);
  ASSERT_TRUE(t.expect("> ")) << t.seen;
  t.type("=type(material.cre\t)\n");
  EXPECT_TRUE(t.expect("\r\nfunction")) << t.seen;  // material.cre alone would be an error
}

TEST(Console, HistoryOutlivesTheSession) {
  const Folder home;
  {
    Terminal t(home.path);
    ASSERT_TRUE(t.expect("> ")) << t.seen;
    t.type("=111 * 3\n");
    ASSERT_TRUE(t.expect("\r\n333")) << t.seen;
    ASSERT_TRUE(t.expect("> ")) << t.seen;
    t.type("\x04");
    ASSERT_EQ(t.wait_exit(), 0);
  }
  EXPECT_TRUE(fs::exists(home.path / ".local/state/robomosp/history"));
  Terminal t(home.path);
  ASSERT_TRUE(t.expect("> ")) << t.seen;
  t.type("\x1b[A\n");
  EXPECT_TRUE(t.expect("\r\n333")) << t.seen;
}

TEST(Console, ABlockOfSeveralLinesComesBackFromTheHistoryWhole) {
  const Folder home;
  {
    Terminal t(home.path);
    ASSERT_TRUE(t.expect("> ")) << t.seen;
    t.type("for i = 1, 2 do\n");
    ASSERT_TRUE(t.expect(">> ")) << t.seen;
    t.type("print('row', 7 * i)\n");
    ASSERT_TRUE(t.expect(">> ")) << t.seen;
    t.type("end\n");
    ASSERT_TRUE(t.expect("row\t14") || t.expect("row     14", 1000)) << t.seen;
    ASSERT_TRUE(t.expect("> ")) << t.seen;
    t.type("\x1b[A\n");
    EXPECT_TRUE(t.expect("row\t14") || t.expect("row     14", 1000)) << t.seen;
    ASSERT_TRUE(t.expect("> ")) << t.seen;
    t.type("\x04");
    ASSERT_EQ(t.wait_exit(), 0);
  }
  Terminal t(home.path);
  ASSERT_TRUE(t.expect("> ")) << t.seen;
  t.type("\x1b[A\n");
  EXPECT_TRUE(t.expect("row\t14") || t.expect("row     14", 1000)) << t.seen;
}

TEST(Console, WhatIsLongerThanTheTerminalIsShownPageByPage) {
  const Folder home;
  Terminal t(home.path);
  ASSERT_TRUE(t.expect("> ")) << t.seen;
  t.type("local s = {} for i = 1, 100 do s[i] = 'line' .. i end return table.concat(s, '\\n')\n");
  ASSERT_TRUE(t.expect("line29\r\n")) << t.seen;
  ASSERT_TRUE(t.expect("71 more lines")) << t.seen;
  EXPECT_EQ(t.seen.find("line30"), std::string::npos) << t.seen;
  t.type("\n");
  ASSERT_TRUE(t.expect("70 more lines")) << t.seen;
  t.type(" ");
  ASSERT_TRUE(t.expect("line59\r\n")) << t.seen;
  ASSERT_TRUE(t.expect("more lines")) << t.seen;
  t.type("q");
  ASSERT_TRUE(t.expect("> ")) << t.seen;
  EXPECT_EQ(t.seen.find("line60"), std::string::npos) << t.seen;
  // What fits is not held up, and Ctrl-C leaves the pager, not the program.
  t.type("=6 * 7\n");
  ASSERT_TRUE(t.expect("\r\n42")) << t.seen;
  t.type("help(robot)\n");
  ASSERT_TRUE(t.expect("more lines")) << t.seen;
  t.type("\x03");
  ASSERT_TRUE(t.expect("> ")) << t.seen;
  t.type("=20 + 3\n");
  EXPECT_TRUE(t.expect("\r\n23")) << t.seen;
}

TEST(Console, ThePagerOfTheUserIsAskedAndOneThatIsNotThereIsReplaced) {
  const Folder home;
  {
    Terminal t(home.path, "sed 's/^robot.render/PAGED &/; s/^  robot.render/PAGED &/'");
    ASSERT_TRUE(t.expect("> ")) << t.seen;
    t.type("help(robot)\n");
    EXPECT_TRUE(t.expect("PAGED")) << t.seen;
  }
  {
    Terminal t(home.path, "no-such-pager 2>/dev/null");
    ASSERT_TRUE(t.expect("> ")) << t.seen;
    t.type("help(robot)\n");
    EXPECT_TRUE(t.expect("more lines")) << t.seen;
  }
  Terminal t(home.path, "");
  ASSERT_TRUE(t.expect("> ")) << t.seen;
  t.type("help(robot)\n");
  EXPECT_TRUE(t.expect("robot.save_model")) << t.seen;
}

TEST(CommandLine, ResultsInAPipeAreNeitherPagedNorWrapped) {
  const Outcome r = run({"eval", "help('robot.solve_ik')"});
  EXPECT_EQ(r.code, 0) << r.err;
  EXPECT_NE(r.out.find("| `seed` | joint values of `id` or name of a pose of `id` | rad or m |"),
            std::string::npos)
      << r.out;
  EXPECT_EQ(r.out.find("more lines"), std::string::npos);
}

}  // namespace
