// SPDX-License-Identifier: Apache-2.0
// Random arguments for every command, made from the schemas of the program itself, as JSON and as
// Lua: numbers at the ends of their range and beyond, texts of any length, values of other kinds,
// long lists. The program never ends by itself, every request has one answer that is JSON, an error
// is a sentence of bearable length, memory stays within bounds, and whatever takes long can be
// cancelled.
#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <deque>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "fuzz/made_arguments.h"
#include "support/classic_lines.h"
#include "support/seed.h"

namespace {

using robomosp::test::as_json;
using robomosp::test::as_lua;
using robomosp::test::Json;
using robomosp::test::kRecords;
using robomosp::test::Maker;
using Clock = std::chrono::steady_clock;
namespace fs = std::filesystem;

/// Of the limits below, the times are generous: other tests run beside this one.
constexpr double kPatience = 2;         // s until a request is cancelled
constexpr double kToCancel = 0.2;       // s of the processor, from then on
constexpr double kToCancelAtMost = 60;  // s by the clock
constexpr long kMostMemory = 3L << 20;  // KiB
constexpr std::size_t kLongestError = 8000;
/// What the program reads as one line; longer ones are refused before anybody looks at their id.
constexpr std::size_t kLongestLine = std::size_t{8} << 20;
constexpr std::size_t kCommandsOfOne = 150;  // until another program is started

/// The program, answering over pipes in a folder of its own.
class Program {
 public:
  explicit Program(const fs::path& folder) {
    int in[2], out[2];
    if (::pipe2(in, O_CLOEXEC) != 0 || ::pipe2(out, O_CLOEXEC) != 0) std::abort();
    child_ = ::fork();
    if (child_ == 0) {
      ::dup2(in[0], 0);
      ::dup2(out[1], 1);
      if (!std::freopen((folder / "errors.txt").c_str(), "w", stderr)) ::_exit(126);
      if (::chdir((folder / "work").c_str()) != 0) ::_exit(126);
      for (const char* home : {"HOME", "XDG_STATE_HOME", "XDG_CONFIG_HOME", "XDG_CACHE_HOME"})
        ::setenv(home, (folder / "home").c_str(), 1);
      const std::string program = std::string(ROBOMOSP_BUILD_DIR) + "/bin/robomosp";
      const std::string library = (folder / "library").string();
      ::execl(program.c_str(), program.c_str(), "--library", library.c_str(), "rpc", nullptr);
      ::_exit(127);
    }
    ::close(in[0]);
    ::close(out[1]);
    in_ = in[1];
    out_ = out[0];
  }
  ~Program() {
    ::close(in_);
    ::close(out_);
    if (!end().empty()) return;
    ::kill(child_, SIGKILL);
    ::waitpid(child_, nullptr, 0);
  }
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;

  bool send(std::string line) const {
    line += '\n';
    for (std::size_t at = 0; at < line.size();) {
      const ssize_t n = ::write(in_, line.data() + at, line.size() - at);
      if (n < 0) return false;
      at += static_cast<std::size_t>(n);
    }
    return true;
  }
  /// The next line within some time; nullopt = none came.
  std::optional<std::string> receive(double seconds) {
    const auto end = Clock::now() + std::chrono::duration<double>(seconds);
    for (;;) {
      if (const auto newline = buffer_.find('\n'); newline != std::string::npos) {
        std::string line = buffer_.substr(0, newline);
        buffer_.erase(0, newline + 1);
        return line;
      }
      const double left = std::chrono::duration<double>(end - Clock::now()).count();
      pollfd ready{out_, POLLIN, 0};
      if (left <= 0 || ::poll(&ready, 1, static_cast<int>(left * 1e3) + 1) <= 0) {
        if (left <= 0) return std::nullopt;
        continue;
      }
      std::vector<char> chunk(1 << 16);
      const ssize_t n = ::read(out_, chunk.data(), chunk.size());
      if (n <= 0) return std::nullopt;
      buffer_.append(chunk.data(), static_cast<std::size_t>(n));
    }
  }
  /// How it ended; empty while it runs.
  [[nodiscard]] std::string end() {
    int status = 0;
    if (end_.empty() && ::waitpid(child_, &status, WNOHANG) == child_)
      end_ = WIFSIGNALED(status) ? "signal " + std::to_string(WTERMSIG(status))
                                 : "code " + std::to_string(WEXITSTATUS(status));
    return end_;
  }
  /// Time of the processor that it took so far [s].
  [[nodiscard]] double processor() const {
    std::ifstream in("/proc/" + std::to_string(child_) + "/stat");
    std::string text((std::istreambuf_iterator<char>(in)), {});
    std::istringstream rest(text.substr(std::min(text.rfind(')') + 1, text.size())));
    std::string word;
    double ticks = 0;
    for (int field = 3; field <= 15 && rest >> word; ++field)
      if (field >= 14) ticks += std::strtod(word.c_str(), nullptr);
    return ticks / static_cast<double>(::sysconf(_SC_CLK_TCK));
  }
  /// Most memory that it held [KiB].
  [[nodiscard]] long memory() const {
    std::ifstream in("/proc/" + std::to_string(child_) + "/status");
    for (std::string line; std::getline(in, line);)
      if (line.starts_with("VmHWM:")) return std::strtol(line.c_str() + 6, nullptr, 10);
    return 0;
  }

 private:
  pid_t child_ = -1;
  int in_ = -1, out_ = -1;
  std::string buffer_, end_;
};

/// The example of a command with other numbers, and now and then another text, in some places.
std::string changed_example(std::string code, Maker& maker) {
  struct Place {
    std::size_t at, size;
    bool is_text;
  };
  const auto is_digit = [](char c) { return c >= '0' && c <= '9'; };
  std::vector<Place> places;
  for (std::size_t i = 0; i < code.size(); ++i) {
    const char before = i > 0 ? code[i - 1] : ' ';
    if (code[i] == '"') {
      const std::size_t end = code.find('"', i + 1);
      if (end == std::string::npos) break;
      places.push_back({i, end + 1 - i, true});
      i = end;
    } else if (is_digit(code[i]) && !std::isalnum(static_cast<unsigned char>(before)) &&
               before != '_' && before != '.') {
      std::size_t end = i;
      while (end < code.size() && (is_digit(code[end]) || code[end] == '.' || code[end] == 'e'))
        ++end;
      places.push_back({i, end - i, false});
      i = end;
    }
  }
  if (places.empty()) return code;
  // From the end, so that the places before stay where they are.
  std::vector<std::size_t> chosen;
  for (std::size_t n = 1 + maker.pick(2); n > 0; --n) chosen.push_back(maker.pick(places.size()));
  std::sort(chosen.rbegin(), chosen.rend());
  chosen.erase(std::unique(chosen.begin(), chosen.end()), chosen.end());
  for (const std::size_t i : chosen) {
    const Place& p = places[i];
    if (p.is_text && !maker.chance(0.3)) continue;
    const Json value = p.is_text ? maker.text() : maker.chance(0.9) ? maker.number() : maker.any();
    code.replace(p.at, p.size, "(" + as_lua(value) + ")");
  }
  return code;
}

class CommandFuzz : public testing::Test {
 protected:
  void SetUp() override {
    ::signal(SIGPIPE, SIG_IGN);
    std::string pattern = (fs::temp_directory_path() / "robomosp_commands_XXXXXX").string();
    folder_ = ::mkdtemp(pattern.data());
    for (const char* name : {"work", "home"}) fs::create_directory(folder_ / name);
    fs::copy(fs::path(ROBOMOSP_SOURCE_DIR) / "scripts/library", folder_ / "library",
             fs::copy_options::recursive);
  }
  void TearDown() override {
    program_.reset();
    std::error_code ec;
    if (!HasFailure()) fs::remove_all(folder_, ec);
    else std::cout << "kept: " << folder_ << "\n";
  }

  void start() {
    program_ = std::make_unique<Program>(folder_);
    ASSERT_TRUE(ask("lua.eval", "{\"code\":" + Json(kRecords).dump() + "}").contains("result"));
    // The first picture starts OpenGL, which nothing can cancel.
    const Json first =
        "solid.create{name = 'first', root = {kind = 'box', x = 1, y = 1, z = 1}}:picture{size = "
        "{96, 64}, quality = 'draft'} solid.remove('first')";
    ASSERT_TRUE(program_->send("{\"jsonrpc\":\"2.0\",\"id\":" + std::to_string(++id_) +
                               ",\"method\":\"lua.eval\",\"params\":{\"code\":" + first.dump() +
                               "}}"));
    ASSERT_TRUE(program_->receive(kToCancelAtMost));
  }
  Json ask(const std::string& method, const std::string& params) {
    return exchange("{\"jsonrpc\":\"2.0\",\"id\":" + std::to_string(++id_) + ",\"method\":\"" +
                    method + "\",\"params\":" + params + "}");
  }

  /// Sends a request and looks at its answer; what took too long is cancelled.
  Json exchange(const std::string& line) {
    if (line.size() > kLongestLine) return {};  // refused as a whole: shell_program_test
    recent_.push_back(line.size() > 3000 ? line.substr(0, 3000) + " ..." : line);
    if (recent_.size() > 12) recent_.pop_front();
    if (!program_->send(line)) return died();
    const auto begin = Clock::now();
    auto answer = program_->receive(kPatience);
    std::optional<double> cancelled;  // processor time when it was
    while (!answer) {
      if (const std::string how = program_->end(); !how.empty()) return died(how);
      if (!cancelled) {
        cancelled = program_->processor();
        if (!program_->send(
                "{\"jsonrpc\":\"2.0\",\"method\":\"rpc.cancel\",\"params\":{\"request\":" +
                std::to_string(id_) + "}}"))
          return died();
      }
      const double waited = std::chrono::duration<double>(Clock::now() - begin).count();
      if (waited > kToCancelAtMost) {
        ADD_FAILURE() << "it does not stop:\n" << recent_.back();
        return {};
      }
      answer = program_->receive(0.01);
    }
    if (cancelled) {
      // Ticks are of 10 ms, and several threads may end their parts.
      const double took = program_->processor() - *cancelled;
      if (took > kToCancel + 0.1) {
        std::cout << took << " s to cancel: " << recent_.back().substr(0, 600) << "\n";
        if (took > 5 * kToCancel)
          ADD_FAILURE() << took << " s of the processor to cancel:\n" << recent_.back();
      }
    }
    Json message = Json::parse(*answer, nullptr, false);
    if (message.is_discarded() || message.value("id", Json()) != Json(id_)) {
      ADD_FAILURE() << "no answer to the request: " << answer->substr(0, 500) << "\n"
                    << recent_.back();
      return {};
    }
    if (message.contains("error")) {
      const auto text = message["error"].value("message", std::string());
      const auto code = message["error"].value("data", Json::object()).value("code", std::string());
      if (text.empty() || text.size() > kLongestError || code == "internal")
        ADD_FAILURE() << text.substr(0, 1000) << "\n" << recent_.back();
    }
    if (program_->memory() > kMostMemory)
      ADD_FAILURE() << program_->memory() / 1024 << " MiB after\n" << recent_.back();
    return message;
  }
  Json died(std::string how = {}) {
    for (int i = 0; i < 200 && how.empty(); ++i) {
      ::usleep(10'000);
      how = program_->end();
    }
    std::string all;
    for (const std::string& line : recent_) all += line + "\n";
    std::ifstream errors(folder_ / "errors.txt");
    std::string said((std::istreambuf_iterator<char>(errors)), {});
    if (said.size() > 2000) said.erase(0, said.size() - 2000);
    ADD_FAILURE() << "the program ended (" << how << "); its last words: " << said
                  << "\nlast requests, newest at the end:\n"
                  << all;
    return {};
  }

  fs::path folder_;
  std::unique_ptr<Program> program_;
  std::int64_t id_ = 0;
  std::deque<std::string> recent_;
};

TEST_F(CommandFuzz, EveryCommandWithstandsWhatItsSchemaLets) {
  std::mt19937 random(robomosp::test::seed());
  const robomosp::test::FuzzBudget budget(900, 0.8);
  Maker maker(random);
  start();
  ASSERT_FALSE(HasFailure());
  std::vector<Json> commands;
  const Json table = ask("ioci.describe", "{}");
  ASSERT_TRUE(table.contains("result"));
  for (const Json& c : table["result"])
    // What ends the program, and what waits for it, is no fault.
    if (c.at("name") != "quit") commands.push_back(c);
  ASSERT_GE(commands.size(), 300U);

  // The ten minutes name every request that takes long, and go on after a fault.
  const bool is_long = std::getenv("ROBOMOSP_FUZZ_SECONDS") || std::getenv("ROBOMOSP_LONG");
  std::map<std::string, std::size_t> refused;
  std::size_t runs = 0, answered = 0, examples = 0;
  for (; budget.allows(runs) && (is_long || !HasFailure()); ++runs) {
    if (runs % kCommandsOfOne == 0 && runs > 0) start();
    if (!program_->end().empty()) start();
    const Json& command = commands[maker.pick(commands.size())];
    const std::string name = command.at("name");
    if (maker.chance(0.3)) {
      // Commands on what commands made, each alone in a document.
      const Json code =
          "document.clear()\n" + changed_example(command.at("example").get<std::string>(), maker);
      const Json answer =
          ask("lua.eval",
              "{\"code\":" + code.dump(-1, ' ', false, Json::error_handler_t::replace) + "}");
      examples += answer.contains("result") ? 1U : 0U;
      const Json again = "document.clear()" + std::string(kRecords);
      (void)ask("lua.eval", "{\"code\":" + again.dump() + "}");
      continue;
    }
    const Json arguments = maker.arguments(command.at("params"));
    const bool by_lua = maker.chance(0.4), as_job = !by_lua && maker.chance(0.05);
    Json answer;
    if (by_lua) {
      answer =
          ask("lua.eval", "{\"code\":" +
                              Json("return ioci.call(\"" + name + "\", " + as_lua(arguments) + ")")
                                  .dump(-1, ' ', false, Json::error_handler_t::replace) +
                              "}");
    } else {
      std::string params = as_json(arguments);
      if (maker.chance(0.05)) {  // by position
        Json all = Json::array();
        for (const auto& a : arguments) all.push_back(a);
        params = as_json(all);
      }
      answer = exchange("{\"jsonrpc\":\"2.0\",\"id\":" + std::to_string(++id_) +
                        (as_job ? ",\"job\":true" : "") + ",\"method\":\"" + name +
                        "\",\"params\":" + params + "}");
    }
    if (answer.contains("result")) ++answered;
    else if (answer.contains("error"))
      ++refused[answer["error"].value("data", Json::object()).value("code", "json")];
  }
  std::cout << runs << " requests, " << answered << " answered, " << examples
            << " examples with other numbers";
  for (const auto& [code, count] : refused) std::cout << ", " << count << " " << code;
  std::cout << "\n";
  EXPECT_GT(answered, runs / 20);
  EXPECT_GT(examples, runs / 50);
  EXPECT_GT(refused["invalid_argument"], runs / 20);
}

TEST_F(CommandFuzz, ClassicLinesOverJsonRpcAreAnsweredOrRefused) {
  std::mt19937 random(robomosp::test::seed());
  const robomosp::test::FuzzBudget budget(600, 0.2);
  Maker maker(random);
  start();
  ASSERT_FALSE(HasFailure());
  const bool is_long = std::getenv("ROBOMOSP_FUZZ_SECONDS") || std::getenv("ROBOMOSP_LONG");
  std::size_t runs = 0, answered = 0, refused = 0;
  for (; budget.allows(runs) && (is_long || !HasFailure()); ++runs) {
    if ((runs % kCommandsOfOne == 0 && runs > 0) || !program_->end().empty()) start();
    const Json line = robomosp::test::changed_classic_line(random);
    std::string params =
        "{\"line\":" + line.dump(-1, ' ', false, Json::error_handler_t::replace) + "}";
    if (maker.chance(0.05)) params = as_json(maker.any());
    const Json answer = ask("ioci.classic", params);
    if (answer.contains("result")) ++answered;
    else if (answer.contains("error")) ++refused;
  }
  std::cout << runs << " lines, " << answered << " answered, " << refused << " refused\n";
  EXPECT_GT(answered, runs / 8);
  EXPECT_GT(refused, runs / 20);
}

}  // namespace
