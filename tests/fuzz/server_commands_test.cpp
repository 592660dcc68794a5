// SPDX-License-Identifier: Apache-2.0
// Every command with random arguments over a socket of `robomosp serve`, asked with tokens that may
// little: nothing that a token lacks happens. Compared are the document, the files, the processes,
// and whether a word that only stands in a file outside ever comes back.
#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iostream>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "fuzz/made_arguments.h"
#include "kernel/base64.h"
#include "support/seed.h"

namespace {

using robomosp::test::as_json;
using robomosp::test::as_lua;
using robomosp::test::Json;
using robomosp::test::Maker;
using Clock = std::chrono::steady_clock;
namespace fs = std::filesystem;

/// Stands in files that no token may read.
constexpr const char* kSecret = "canary7f3a90";
constexpr double kPatience = 3;  // s until a request is cancelled
constexpr double kAtMost = 60;   // s until it is a fault

class Client {
 public:
  Client(const fs::path& socket, const std::string& token) {
    sockaddr_un end{};
    end.sun_family = AF_UNIX;
    std::strncpy(end.sun_path, socket.c_str(), sizeof end.sun_path - 1);
    for (int i = 0; i < 2000; ++i) {
      fd_ = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
      if (::connect(fd_, reinterpret_cast<sockaddr*>(&end), sizeof end) == 0) break;
      ::close(fd_);
      fd_ = -1;
      ::usleep(10'000);
    }
    hello = ask("server.hello", Json{{"protocol", 1}, {"token", token}}.dump());
  }
  ~Client() {
    if (fd_ >= 0) ::close(fd_);
  }
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;

  /// The answer; discarded when none came.
  Json ask(const std::string& method, const std::string& params, const std::string& more = "") {
    const std::string id = std::to_string(++id_);
    if (!send("{\"jsonrpc\":\"2.0\",\"id\":" + id + more + ",\"method\":\"" + method +
              "\",\"params\":" + params + "}\n"))
      return Json::parse("", nullptr, false);
    const auto begin = Clock::now();
    bool is_cancelled = false;
    for (;;) {
      const double waited = std::chrono::duration<double>(Clock::now() - begin).count();
      if (waited > kAtMost) return Json::parse("", nullptr, false);
      if (waited > kPatience && !is_cancelled) {
        is_cancelled = true;
        send("{\"jsonrpc\":\"2.0\",\"method\":\"rpc.cancel\",\"params\":{\"request\":" + id +
             "}}\n");
      }
      const auto text = line(0.1);
      if (!text) {
        if (is_over_) return Json::parse("", nullptr, false);
        continue;
      }
      last = *text;
      Json message = Json::parse(*text, nullptr, false);
      if (message.is_discarded() || message.value("id", Json()) == Json(id_) ||
          message.contains("error"))
        return message;
    }
  }
  Json hello;
  std::string last;  ///< line that came

 private:
  bool send(const std::string& text) {
    // Read meanwhile: the server does not read on from who reads nothing.
    for (std::size_t at = 0; at < text.size();) {
      const ssize_t n =
          ::send(fd_, text.data() + at, text.size() - at, MSG_NOSIGNAL | MSG_DONTWAIT);
      if (n > 0) {
        at += static_cast<std::size_t>(n);
        continue;
      }
      if (n < 0 && errno != EAGAIN && errno != EINTR) return false;
      pollfd ready{fd_, POLLOUT | POLLIN, 0};
      ::poll(&ready, 1, 1000);
      if (ready.revents & POLLIN) fill();
      if (is_over_) return false;
    }
    return true;
  }
  std::optional<std::string> line(double seconds) {
    for (std::size_t from = 0;;) {
      if (const auto end = buffer_.find('\n', from); end != std::string::npos) {
        std::string out = buffer_.substr(0, end);
        buffer_.erase(0, end + 1);
        return out;
      }
      from = buffer_.size();
      pollfd ready{fd_, POLLIN, 0};
      if (::poll(&ready, 1, static_cast<int>(seconds * 1e3)) <= 0) return std::nullopt;
      fill();
      if (is_over_) return std::nullopt;
    }
  }
  void fill() {
    std::vector<char> piece(1 << 16);
    const ssize_t n = ::recv(fd_, piece.data(), piece.size(), 0);
    if (n > 0) buffer_.append(piece.data(), static_cast<std::size_t>(n));
    else if (n == 0 || (errno != EINTR && errno != EAGAIN)) is_over_ = true;
  }
  int fd_ = -1;
  std::int64_t id_ = 0;
  bool is_over_ = false;
  std::string buffer_;
};

/// Whether a line holds the secret, as text or as bytes in base64.
bool tells(const std::string& line) {
  static const std::vector<std::string> all = [] {
    std::vector<std::string> out{kSecret};
    for (std::size_t shift = 0; shift < 3; ++shift) {
      std::string text;
      robomosp::base64::append(text, std::string(shift, ' ') + kSecret);
      // Characters that depend on what stands before or behind are left out.
      out.push_back(text.substr(4, text.size() - 8));
    }
    return out;
  }();
  return std::any_of(all.begin(), all.end(),
                     [&](const std::string& s) { return line.find(s) != std::string::npos; });
}

/// What lies in a folder: names, kinds, contents.
std::map<std::string, std::string> contents(const fs::path& folder) {
  std::map<std::string, std::string> out;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    std::string& what = out[entry.path().lexically_relative(folder)];
    if (entry.is_symlink()) what = "link";
    else if (entry.is_regular_file()) {
      std::ifstream in(entry.path(), std::ios::binary);
      std::stringstream text;
      text << in.rdbuf();
      what = std::to_string(std::hash<std::string>()(text.str()));
    } else what = "other";
  }
  return out;
}

/// Programs that a process started, and theirs.
std::set<std::string> children(pid_t of) {
  std::set<std::string> out;
  for (const auto& task : fs::directory_iterator("/proc/" + std::to_string(of) + "/task")) {
    std::ifstream in(task.path() / "children");
    for (pid_t child = 0; in >> child;) {
      std::ifstream name("/proc/" + std::to_string(child) + "/comm");
      std::string word;
      std::getline(name, word);
      out.insert(word);
    }
  }
  return out;
}

class ServerCommands : public testing::Test {
 protected:
  void SetUp() override {
    ::signal(SIGPIPE, SIG_IGN);
    std::string pattern = (fs::temp_directory_path() / "robomosp_served_XXXXXX").string();
    folder_ = ::mkdtemp(pattern.data());
    for (const char* name : {"work", "home", "outside", "shared"})
      fs::create_directory(folder_ / name);
    fs::copy(fs::path(ROBOMOSP_SOURCE_DIR) / "scripts/library", folder_ / "library",
             fs::copy_options::recursive);
    for (const char* name : {"secret.mtr", "secret.lua", "secret.csv", "secret.urdf", "a.mtr"})
      std::ofstream(folder_ / "outside" / name) << kSecret << "\n";
    // One that is read as what it is, so that its word can come back in any answer.
    for (const char* folder : {"outside", "work"})
      std::ofstream(folder_ / folder / "secret.csv") << "time [s]," << kSecret << "\n0,1\n1,2\n";
    fs::create_symlink(folder_ / "outside", folder_ / "shared" / "link");
    fs::create_symlink(folder_ / "outside" / "secret.csv", folder_ / "shared" / "link.csv");
    std::ofstream(folder_ / "shared" / "own.csv") << "time [s],x\n0,1\n1,2\n";
    std::ofstream(folder_ / "cell.lua")
        << robomosp::test::kRecords << "local f = '" << (folder_ / "tokens").string() << "'\n"
        << R"lua(
local function grant(name, effects, folder)
  local out = io.open(")lua"
        << folder_.string() << R"lua(/" .. name, "w")
  out:write(server.grant{name = name, effects = effects, folder = folder, token_file = f})
  out:close()
end
grant("reader", {"reads"})
grant("editor", {"reads", "edits", "simulates"})
grant("keeper", {"reads", "edits", "simulates", "files_read"}, ")lua"
        << (folder_ / "shared").string() << R"lua(")
)lua";
    start();
  }
  void TearDown() override {
    ::kill(server_, SIGTERM);
    int status = 0;
    ::waitpid(server_, &status, 0);
    EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0) << status;
    std::error_code ec;
    if (!HasFailure()) fs::remove_all(folder_, ec);
    else std::cout << "kept: " << folder_ << "\n";
  }
  void start() {
    server_ = ::fork();
    if (server_ != 0) return;
    const int out = ::open((folder_ / "said.txt").c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
    ::dup2(out, 1);
    ::dup2(out, 2);
    if (::chdir((folder_ / "work").c_str()) != 0) ::_exit(126);
    for (const char* home : {"HOME", "XDG_STATE_HOME", "XDG_CONFIG_HOME", "XDG_CACHE_HOME"})
      ::setenv(home, (folder_ / "home").c_str(), 1);
    const std::string program = std::string(ROBOMOSP_BUILD_DIR) + "/bin/robomosp";
    ::execl(program.c_str(), program.c_str(), "--library", (folder_ / "library").c_str(), "serve",
            "--listen", ("unix:" + (folder_ / "socket").string()).c_str(), "--needs-token",
            "--token-file", (folder_ / "tokens").c_str(), "--limit", "memory=3000",
            (folder_ / "cell.lua").c_str(), nullptr);
    ::_exit(127);
  }
  std::unique_ptr<Client> connect(const std::string& token) {
    for (int i = 0; i < 2000 && !fs::exists(folder_ / "socket"); ++i) ::usleep(10'000);
    std::ifstream in(folder_ / token);
    std::string secret;
    std::getline(in, secret);
    auto out = std::make_unique<Client>(folder_ / "socket", secret);
    EXPECT_TRUE(out->hello.contains("result")) << out->hello.dump();
    return out;
  }
  std::string digest(Client& c) {
    const Json a = c.ask("document.digest", "{}");
    return a.contains("result") ? a["result"].dump() : "none: " + a.dump();
  }
  /// A path that leads outside, more often than not.
  [[nodiscard]] std::vector<std::string> bad_paths() const {
    return {"../outside/secret.csv",
            folder_ / "outside/secret.csv",
            folder_ / "work/secret.csv",
            "link/secret.csv",
            "link.csv",
            "link/secret.urdf",
            "own.csv",
            "/proc/self/environ",
            "/proc/self/root" + folder_.string() + "/outside/a.mtr",
            "/proc/self/cwd/secret.csv",
            "/proc/self/fd/0",
            "/dev/stdin",
            "/dev/zero",
            "/etc/passwd",
            folder_ / "tokens",
            "./../shared/../outside/secret.lua",
            "link/../../outside/secret.mtr",
            std::string("own.csv\0../../outside/secret.csv", 33),
            "~/secret.csv",
            "file://" + (folder_ / "outside/secret.csv").string(),
            "package://outside/secret.urdf",
            "$HOME/x",
            "|cat /etc/passwd",
            "`touch x`"};
  }
  Json bad_path(Maker& maker) {
    const auto all = bad_paths();
    return all[maker.pick(all.size())];
  }

  /// Asks as one token, and gives how many were answered.
  std::size_t attack(const std::string& token, std::size_t requests, double share,
                     const std::function<bool()>& is_kept) {
    std::mt19937 random(robomosp::test::seed());
    const robomosp::test::FuzzBudget budget(requests, share);
    Maker maker(random);
    auto client = connect(token);
    const Json table = client->ask("ioci.describe", "{}");
    EXPECT_TRUE(table.contains("result"));
    if (!table.contains("result")) return 0;
    const auto& commands = table["result"];
    const auto names_file = [](const Json& p) {
      const std::string key = p.at("name"), type = p.value("type", "");
      return type == "path" || key == "file" || key == "folder" || key.find("path") != key.npos;
    };
    std::vector<Json> of_files;
    for (const Json& c : commands)
      if (std::any_of(c.at("params").begin(), c.at("params").end(), names_file))
        of_files.push_back(c);
    EXPECT_GT(of_files.size(), 30U);
    std::size_t runs = 0, answered = 0;
    // Each command that names a file, with nothing else that can be wrong, and each path.
    for (const Json& command : of_files)
      for (const std::string& path : bad_paths()) {
        Json arguments = Json::object();
        for (const Json& p : command.at("params"))
          if (names_file(p)) arguments[p.at("name").get<std::string>()] = path;
          else if (p.value("required", false))
            arguments[p.at("name").get<std::string>()] = maker.value(p);
        const Json answer = client->ask(command.at("name"), as_json(arguments));
        if (answer.is_discarded() || tells(client->last)) {
          ADD_FAILURE() << token << " asked " << command.at("name") << " " << as_json(arguments)
                        << "\nand was told " << client->last.substr(0, 2000);
          return 0;
        }
        if (answer.contains("result")) ++plain_answered;
      }
    EXPECT_TRUE(is_kept());
    for (; budget.allows(runs) && !HasFailure(); ++runs) {
      // Every other one names a file.
      const Json& command = maker.chance(0.5) ? of_files[maker.pick(of_files.size())]
                                              : commands[maker.pick(commands.size())];
      const std::string name = command.at("name");
      Json arguments = maker.arguments(command.at("params"));
      for (const Json& p : command.at("params"))
        if (names_file(p) && maker.chance(0.8))
          arguments[p.at("name").get<std::string>()] = bad_path(maker);
      Json answer;
      const auto way = maker.pick(10);
      if (way == 0)
        answer = client->ask(
            "lua.eval", "{\"code\":" +
                            Json("return ioci.call(\"" + name + "\", " + as_lua(arguments) + ")")
                                .dump(-1, ' ', false, Json::error_handler_t::replace) +
                            "}");
      else answer = client->ask(name, as_json(arguments), way == 1 ? ",\"job\":true" : "");
      const std::string sent = name + " " + as_json(arguments).substr(0, 2000);
      if (answer.is_discarded()) {
        ADD_FAILURE() << "no answer: " << sent;
        break;
      }
      if (answer.contains("result")) ++answered;
      EXPECT_FALSE(tells(client->last)) << token << " read what it may not:\n"
                                        << sent << "\n"
                                        << client->last.substr(0, 2000);
      if (runs % 25 == 0) {
        EXPECT_TRUE(is_kept()) << sent;
      }
    }
    EXPECT_TRUE(is_kept());
    int status = 0;
    EXPECT_EQ(::waitpid(server_, &status, WNOHANG), 0) << "the server ended";
    std::cout << token << ": " << of_files.size() * bad_paths().size() << " paths, "
              << plain_answered << " answered; " << runs << " requests, " << answered
              << " answered\n";
    return answered;
  }

  fs::path folder_;
  pid_t server_ = -1;
  std::size_t plain_answered = 0;  ///< of the requests with nothing random
};

TEST_F(ServerCommands, WhatATokenLacksDoesNotHappenWhateverIsAsked) {
  auto watcher = connect("reader");
  const auto before = contents(folder_);
  const std::string content = digest(*watcher);
  const auto only_own = [&] {
    auto now = contents(folder_);
    // The program's own: what it says, and a journal of unsaved work.
    for (auto* all : {&now}) {
      std::erase_if(
          *all, [](const auto& e) { return e.first == "said.txt" || e.first.starts_with("home"); });
    }
    auto was = before;
    std::erase_if(
        was, [](const auto& e) { return e.first == "said.txt" || e.first.starts_with("home"); });
    EXPECT_EQ(now, was) << "files";
    for (const std::string& child : children(server_))
      EXPECT_TRUE(child == "robomosp-lua" || child == "robomosp-worker" ||
                  child.starts_with("robomosp"))
          << child << " was started";
    return now == was;
  };
  // Reading changes nothing at all.
  EXPECT_GT(attack("reader", 400, 0.4, [&] { return only_own() && digest(*watcher) == content; }),
            10U);
  // Editing changes the document and no file; a folder's files are read and nothing outside.
  EXPECT_GT(attack("editor", 400, 0.3, only_own), 10U);
  EXPECT_GT(attack("keeper", 400, 0.3, only_own), 10U);
}

}  // namespace
