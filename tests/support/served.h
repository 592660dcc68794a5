// SPDX-License-Identifier: Apache-2.0
// Fixture of tests of the server: one program without plugins, a server on it for each test, and
// clients over real sockets.
#pragma once

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "ioci/core/commands.h"
#include "remote/json.h"
#include "remote/server.h"

namespace robomosp::remote {

namespace fs = std::filesystem;
using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

/// A command that runs until it is cancelled, or so many milliseconds.
inline Result<Value> rest(ioci::CommandContext& ctx, const Map& args) {
  const auto until = Clock::now() + std::chrono::milliseconds(ioci::integer(args, "ms"));
  while (Clock::now() < until) {
    if (ctx.progress.cancelled()) return error(ErrorCode::cancelled, "stopped");
    std::this_thread::sleep_for(1ms);
  }
  return Value(1);
}
inline Result<Value> answer_long(ioci::CommandContext&, const Map& args) {
  return Value(std::string(static_cast<std::size_t>(ioci::integer(args, "bytes")), 'x'));
}

// Apart from remote::Client, with which this program connects to others.
namespace served {

/// A client over a blocking socket, with a read timeout of some seconds.
class Client {
 public:
  explicit Client(const Address& a) {
    if (a.is_unix) {
      fd_ = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
      sockaddr_un end{};
      end.sun_family = AF_UNIX;
      std::strncpy(end.sun_path, a.path.c_str(), sizeof end.sun_path - 1);
      EXPECT_EQ(::connect(fd_, reinterpret_cast<sockaddr*>(&end), sizeof end), 0);
    } else {
      fd_ = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
      sockaddr_in end{};
      end.sin_family = AF_INET;
      end.sin_port = htons(a.port);
      end.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
      EXPECT_EQ(::connect(fd_, reinterpret_cast<sockaddr*>(&end), sizeof end), 0);
    }
  }
  ~Client() { ::close(fd_); }
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;

  bool send(std::string_view text) const {
    while (!text.empty()) {
      const ssize_t n = ::send(fd_, text.data(), text.size(), MSG_NOSIGNAL);
      if (n <= 0) return false;
      text.remove_prefix(static_cast<std::size_t>(n));
    }
    return true;
  }
  /// A line; nullopt at the end of the connection, or when nothing comes.
  std::optional<std::string> line(std::chrono::milliseconds patience = 20s) {
    for (;;) {
      if (const auto end = buffer_.find('\n'); end != std::string::npos) {
        std::string out = buffer_.substr(0, end);
        buffer_.erase(0, end + 1);
        return out;
      }
      pollfd ready{fd_, POLLIN, 0};
      if (::poll(&ready, 1, static_cast<int>(patience.count())) <= 0) return std::nullopt;
      std::array<char, 65'536> piece{};
      const ssize_t n = ::recv(fd_, piece.data(), piece.size(), 0);
      if (n <= 0) return std::nullopt;
      buffer_.append(piece.data(), static_cast<std::size_t>(n));
    }
  }
  /// What there is to read within the time; empty when nothing came.
  std::string bytes(std::chrono::milliseconds patience) const {
    pollfd ready{fd_, POLLIN, 0};
    if (::poll(&ready, 1, static_cast<int>(patience.count())) <= 0) return {};
    std::string out(65'536, '\0');
    const ssize_t n = ::recv(fd_, out.data(), out.size(), 0);
    out.resize(n > 0 ? static_cast<std::size_t>(n) : 0);
    return out;
  }
  /// Whether the server closed it, within the time, with nothing more to say.
  bool is_closed(std::chrono::milliseconds patience = 20s) {
    return !line(patience) && [this] {
      char c = 0;
      return ::recv(fd_, &c, 1, MSG_DONTWAIT) == 0 || (errno != EAGAIN && errno != EWOULDBLOCK);
    }();
  }
  void ask(std::string_view method, const Map& params, const Value& id = 1) const {
    EXPECT_TRUE(
        send(to_json(Map{{"jsonrpc", "2.0"}, {"id", id}, {"method", method}, {"params", params}}) +
             "\n"));
  }
  /// The next message that has an id; events before it are kept.
  Map answer() {
    for (;;) {
      const auto text = line();
      if (!text) return {};
      auto message = from_json(*text);
      EXPECT_TRUE(message.ok()) << *text;
      if (!message.ok()) return {};
      if (message->as_map()->find("id")) return std::move(*message->as_map());
      events.push_back(std::move(*message->as_map()));
    }
  }
  Map call(std::string_view method, const Map& params = {}) {
    ask(method, params);
    return answer();
  }
  Map hello(const Map& more = {}) {
    Map params{{"protocol", kProtocol}};
    for (const auto& [key, value] : more) params.set(key, value);
    return call("server.hello", params);
  }
  std::vector<Map> events;

 private:
  int fd_ = -1;
  std::string buffer_;
};

}  // namespace served
using served::Client;

inline bool is_ok(const Map& answer) { return answer.find("result") != nullptr; }
inline const Value& result(const Map& answer) {
  static const Value kNone;
  const Value* r = answer.find("result");
  EXPECT_TRUE(r) << to_json(Value(answer));
  return r ? *r : kNone;
}
inline std::string code(const Map& answer) {
  const Value* e = answer.find("error");
  const Value* data = e ? e->as_map()->find("data") : nullptr;
  return data ? *data->as_map()->find("code")->as_string() : std::string();
}
inline std::string sentence(const Map& answer) {
  const Value* e = answer.find("error");
  return e ? *e->as_map()->find("message")->as_string() : std::string();
}
inline const Map& params_of(const Map& event) { return *event.find("params")->as_map(); }

class ServerTest : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder() = fs::temp_directory_path() / ("robomosp-server-" + std::to_string(::getpid()));
    fs::create_directories(folder());
    ioci::ApplicationOptions options;
    options.library = {fs::path(ROBOMOSP_SOURCE_DIR) / "scripts/library"};
    options.plugins = false;
    auto made = ioci::Application::create(std::move(options));
    ASSERT_TRUE(made.ok()) << made.error().sentence();
    holder() = std::move(*made);
    std::vector<ioci::CommandSpec> own;
    own.push_back({.name = "work.rest",
                   .classic = "",
                   .summary = "Rests.",
                   .details = "",
                   .example = "work",
                   .params = {ioci::defaulted("ms", "int", "", 100, "Milliseconds.")},
                   .returns = {"int", "", "1.", {}},
                   .effect = Effect::reads,
                   .run = rest});
    own.push_back({.name = "work.long",
                   .classic = "",
                   .summary = "Answers at length.",
                   .details = "",
                   .example = "work",
                   .params = {ioci::defaulted("bytes", "int", "", 100, "How many.")},
                   .returns = {"string", "", "Letters.", {}},
                   .effect = Effect::reads,
                   .run = answer_long});
    app().commands.add(std::move(own));
  }
  static void TearDownTestSuite() {
    holder().reset();
    fs::remove_all(folder());
  }
  void SetUp() override { options_.token_file = folder() / (name() + ".tokens"); }
  void TearDown() override {
    server_.reset();
    ioci::Session own("cleaner");
    (void)app().dispatch(own, "document.clear", {});
  }
  static ioci::Application& app() { return *holder(); }
  static fs::path& folder() {
    static fs::path one;
    return one;
  }
  static std::string name() {
    return testing::UnitTest::GetInstance()->current_test_info()->name();
  }
  static Address address(const std::string& text) {
    const auto a = Address::parse(text);
    EXPECT_TRUE(a.ok()) << a.error().sentence();
    return *a;
  }
  /// Starts the server of the test, on a free port of this machine unless said otherwise.
  void start() {
    if (options_.addresses.empty()) options_.addresses = {address("127.0.0.1:0")};
    auto server = Server::start(app(), options_);
    ASSERT_TRUE(server.ok()) << server.error().sentence();
    server_ = std::move(*server);
  }
  Address where() const { return server_->addresses().front(); }
  std::string grant(Rights rights, std::int64_t seconds = 0) const {
    auto tokens = Tokens::open(options_.token_file);
    EXPECT_TRUE(tokens.ok());
    const auto secret = tokens->grant(std::move(rights), seconds);
    EXPECT_TRUE(secret.ok()) << secret.error().sentence();
    return secret.ok() ? *secret : std::string();
  }
  bool wait_for_clients(std::size_t count) const {
    for (int i = 0; i < 2000; ++i) {
      if (server_->clients().size() == count) return true;
      std::this_thread::sleep_for(5ms);
    }
    return false;
  }

  ServerOptions options_;
  std::unique_ptr<Server> server_;

 private:
  static std::unique_ptr<ioci::Application>& holder() {
    static std::unique_ptr<ioci::Application> one;
    return one;
  }
};

}  // namespace robomosp::remote
