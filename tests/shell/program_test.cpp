// SPDX-License-Identifier: Apache-2.0
// The program `robomosp` as a user meets it: a child process with pipes or a terminal.
#include <gtest/gtest.h>

#include <poll.h>
#include <pty.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace {

using Json = nlohmann::json;
namespace fs = std::filesystem;

const std::string kProgram = std::string(ROBOMOSP_BUILD_DIR) + "/bin/robomosp";

struct Outcome {
  int code = -1;
  std::string out, err;
};

std::string slurp(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// A folder of this test process, removed at the end.
struct Folder {
  fs::path path;
  Folder() {
    std::string name = (fs::temp_directory_path() / "robomosp-shell-XXXXXX").string();
    path = ::mkdtemp(name.data());
  }
  ~Folder() { fs::remove_all(path); }
};

[[noreturn]] void execute(std::vector<std::string> args) {
  args.insert(args.begin(), kProgram);
  std::vector<char*> argv;
  for (std::string& a : args) argv.push_back(a.data());
  argv.push_back(nullptr);
  ::execv(kProgram.c_str(), argv.data());
  ::_exit(127);
}

Outcome run(const std::vector<std::string>& args, const std::string& input = {}) {
  const Folder folder;
  std::ofstream(folder.path / "in", std::ios::binary) << input;
  std::fflush(nullptr);  // or the child would print what waits in the buffers once more
  const pid_t child = ::fork();
  if (child == 0) {
    if (!std::freopen((folder.path / "in").c_str(), "r", stdin)) ::_exit(126);
    if (!std::freopen((folder.path / "out").c_str(), "w", stdout)) ::_exit(126);
    if (!std::freopen((folder.path / "err").c_str(), "w", stderr)) ::_exit(126);
    execute(args);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  return {WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status),
          slurp(folder.path / "out"), slurp(folder.path / "err")};
}

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

TEST(CommandLine, AnErrorIsOneSentenceOnStandardError) {
  const auto r = run({"-q", "eval", "robot.lod{}"});
  EXPECT_EQ(r.out, "");
  EXPECT_NE(r.err.find("error: "), std::string::npos);
  EXPECT_NE(r.err.find("Did you mean \"robot.load\"?"), std::string::npos) << r.err;
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

TEST(CommandLine, StatementsFromAPipeMayTakeSeveralLines) {
  const auto r = run({"-q"}, "x = {\n1,\n2}\n=#x\nfor i = 1, 2 do\nprint(i)\nend\n");
  EXPECT_EQ(r.code, 0) << r.err;
  EXPECT_EQ(r.out, "2\n1\n2\n");
  EXPECT_EQ(run({"-q"}, "error('a')\nprint('not reached')\n").out, "");
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
  explicit Terminal(const fs::path& home) {
    winsize size{30, 100, 0, 0};
    child_ = ::forkpty(&fd_, nullptr, nullptr, &size);
    if (child_ == 0) {
      ::setenv("HOME", home.c_str(), 1);
      ::unsetenv("XDG_STATE_HOME");
      ::unsetenv("XDG_CONFIG_HOME");
      ::setenv("TERM", "xterm", 1);
      ::setenv("NO_COLOR", "1", 1);
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
  bool expect(const std::string& text, int ms = 20000) {
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
    const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(20);
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

}  // namespace
