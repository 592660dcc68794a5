// SPDX-License-Identifier: Apache-2.0
// The server over real sockets, without plugins, so that it is quickly built for ThreadSanitizer:
// hello, rights, limits, events, undo of each client, several at once, and what attackers send.
#include <malloc.h>
#include <sys/mman.h>
#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "kernel/text.h"
#include "support/seed.h"
#include "support/served.h"

namespace robomosp::remote {
namespace {

TEST(Addresses, AreReadAndWhatIsNoneIsSaid) {
  const auto shown = [](const char* text) {
    const auto a = Address::parse(text);
    return a.ok() ? a->text() + (a->is_local() ? " local" : " open") : a.error().message;
  };
  EXPECT_EQ(shown("127.0.0.1:80"), "127.0.0.1:80 local");
  EXPECT_EQ(shown("127.9.9.9"), "127.9.9.9:7007 local");
  EXPECT_EQ(shown("[::1]:0"), "[::1]:0 local");
  EXPECT_EQ(shown("localhost"), "localhost:7007 local");
  EXPECT_EQ(shown("unix:/tmp/x"), "unix:/tmp/x local");
  EXPECT_EQ(shown("*:7007"), "*:7007 open");
  EXPECT_EQ(shown("0.0.0.0"), "0.0.0.0:7007 open");
  EXPECT_EQ(shown("[::]:1"), "[::]:1 open");
  EXPECT_EQ(shown("robot.example:1"), "robot.example:1 open");
  // A name is not believed, whatever it begins with.
  EXPECT_EQ(shown("127.0.0.1.example:1"), "127.0.0.1.example:1 open");
  for (const char* wrong : {"", ":80", "unix:", "[::1", "[x]:1", "[::1]x", "::1", "a:b", "a:70000",
                            "a:-1", "a b:1", "a:", "h\x01:1"})
    EXPECT_FALSE(Address::parse(wrong).ok()) << wrong;
  EXPECT_FALSE(Address::parse("unix:" + std::string(200, 'x')).ok());
}

TEST(Limits, ThePageOfTheServerListsThemWithTheirDefaults) {
  std::ifstream in(fs::path(ROBOMOSP_SOURCE_DIR) / "docs/user/remote/server.md");
  const std::string page((std::istreambuf_iterator<char>(in)), {});
  const Limits usual;
  for (const LimitSpec& s : limit_specs()) {
    const std::string row = "| `" + std::string(s.name) + "` | " + std::to_string(usual.*s.value) +
                            " | " + std::string(s.unit) + " | " + std::string(s.doc) +
                            (s.can_be_none ? " 0 = none." : "") + " |";
    EXPECT_NE(page.find(row), std::string::npos) << row;
  }
}

TEST_F(ServerTest, AClientSaysHelloAsksAndIsAnsweredInOrderOverTcpAndAUnixSocket) {
  options_.addresses = {address("127.0.0.1:0"), address("unix:" + (folder() / "s").string())};
  start();
  struct stat info {};
  ASSERT_EQ(::stat((folder() / "s").c_str(), &info), 0);
  EXPECT_EQ(info.st_mode & 0777U, 0600U);
  for (const Address& a : server_->addresses()) {
    Client c(a);
    const Map hello = c.hello({{"client", "test\n\x1b[31m"}});
    const Map& said = *result(hello).as_map();
    EXPECT_EQ(*said.find("protocol")->as_int(), kProtocol);
    EXPECT_EQ(said.find("effects")->as_list()->size(), 3U);
    std::string all;
    for (int i = 0; i < 200; ++i)
      all +=
          R"({"jsonrpc":"2.0","id":)" + std::to_string(i) + R"(,"method":"material.list"})" + "\n";
    ASSERT_TRUE(c.send(all));
    for (int i = 0; i < 200; ++i) ASSERT_EQ(*c.answer().find("id")->as_int(), i);
    EXPECT_EQ(code(c.hello()), "conflict");
    EXPECT_TRUE(is_ok(c.call("server.bye")));
    EXPECT_TRUE(c.is_closed());
  }
  EXPECT_TRUE(wait_for_clients(0));
  // The same path can be served again only when nobody listens there any more.
  auto second = Server::start(app(), options_);
  ASSERT_FALSE(second.ok());
  EXPECT_NE(second.error().sentence().find("another program listens"), std::string::npos)
      << second.error().sentence();
  server_.reset();
  EXPECT_FALSE(fs::exists(folder() / "s"));
}

TEST_F(ServerTest, AFirstLineThatIsNoHelloEndsTheConnectionWithASentenceOrSilence) {
  start();
  const struct {
    std::string line, answer;  // "" = nothing is said
  } cases[] = {
      {R"({"jsonrpc":"2.0","id":1,"method":"material.list"})", "usage"},
      {R"({"jsonrpc":"2.0","id":1,"method":"server.hello"})", "invalid_argument"},
      {R"({"jsonrpc":"2.0","id":1,"method":"server.hello","params":{"protocol":2}})",
       "unsupported"},
      {R"({"jsonrpc":"2.0","id":1,"method":"server.hello","params":{"protocol":1,"x":1}})",
       "unknown_name"},
      {R"({"jsonrpc":"2.0","id":1,"method":"server.hello","params":{"protocol":1,"token":"rmp_x"}})",
       "permission"},
      {R"({"jsonrpc":"2.0","id":1,"method":"server.hello","params":{"protocol":1,"token":7}})",
       "invalid_argument"},
      {R"({"jsonrpc":"2.0","id":1,"method":"server.hello","params":{"protocol":1,"subscribe":["x"]}})",
       "unknown_name"},
      {"[]", "usage"},
      {"{", "not JSON"},
      {"{" + std::string(100'000, ' '), "too long"},
      {"helo", "hello TOKEN"},
      {"hello wrong", "permission"},
      {"GET / HTTP/1.1\r\nHost: 127.0.0.1", ""},
      {"POST / HTTP/1.1\r\n\r\n{\"jsonrpc\":\"2.0\"}", ""},
      {"OPTIONS * HTTP/1.1", ""},
      {std::string("\x16\x03\x01\x02\x00", 5), ""},
      {std::string("\x00\x01", 2), ""},
      {"\xff\xfe", ""},
  };
  for (const auto& c : cases) {
    Client client(where());
    (void)client.send(c.line + "\n" + R"({"jsonrpc":"2.0","id":2,"method":"quit"})" + "\n");
    const auto said = client.line();
    EXPECT_EQ(said.has_value(), !c.answer.empty()) << c.line.substr(0, 80);
    EXPECT_TRUE(!said || said->find(c.answer) != std::string::npos) << *said;
    EXPECT_TRUE(client.is_closed()) << c.line.substr(0, 80);
  }
  EXPECT_FALSE(app().quit_requested);
  Client still(where());
  EXPECT_TRUE(is_ok(still.hello()));
}

TEST_F(ServerTest, ClassicLinesAreAnsweredLineByLine) {
  start();
  Client c(where());
  ASSERT_TRUE(c.send("hello\r\nWorlds LsWorlds\n\nNothing at all\nPRobot none GetDOF\nquit\n"));
  EXPECT_TRUE(c.line()->starts_with("ok robomosp "));
  EXPECT_TRUE(c.line()->starts_with("ok"));
  EXPECT_TRUE(c.line()->starts_with("error "));
  EXPECT_TRUE(c.line()->starts_with("error "));
  EXPECT_TRUE(c.line()->starts_with("error permission"));
  EXPECT_FALSE(app().quit_requested);
}

TEST_F(ServerTest, ATokenSaysWhatAClientMayDoAndCommandsAreGrantedByName) {
  options_.needs_token = true;
  const std::string student = grant({.name = "student"});
  const std::string reader =
      grant({.name = "reader", .effects = Effect::reads, .commands = {"server.status"}});
  start();
  Client none(where());
  EXPECT_EQ(code(none.hello()), "permission");
  EXPECT_TRUE(none.is_closed());
  Client c(where()), r(where());
  EXPECT_EQ(*result(c.hello({{"token", student}})).as_map()->find("token")->as_string(), "student");
  ASSERT_TRUE(is_ok(r.hello({{"token", reader}})));
  EXPECT_TRUE(is_ok(c.call("material.create", {{"name", "brass"}, {"density", 8500}})));
  EXPECT_TRUE(is_ok(r.call("material.list")));
  for (const char* method :
       {"server.grant", "server.clients", "server.status", "quit", "plugin.load", "server.stop"})
    EXPECT_EQ(code(c.call(method, {{"name", "x"}, {"file", "x"}, {"code", "return 1"}})),
              "permission")
        << method;
  EXPECT_EQ(code(r.call("material.create", {{"name", "gold"}, {"density", 19300}})), "permission");
  EXPECT_TRUE(is_ok(r.call("server.status")));
  EXPECT_FALSE(app().quit_requested);
  // As a job, and within a batch, it is the same.
  ASSERT_TRUE(r.send(R"([{"jsonrpc":"2.0","id":1,"method":"material.create","params":)"
                     R"({"name":"gold","density":19300},"job":true}])"
                     "\n"));
  EXPECT_NE(r.line()->find("permission"), std::string::npos);
}

TEST_F(ServerTest, AScriptThatIsGrantedRunsInTheProgramWithTheRightsOfItsConnection) {
  const std::string secret = grant({.name = "author", .commands = {"lua.eval"}});
  start();
  Client author(where());
  ASSERT_TRUE(is_ok(author.hello({{"token", secret}})));
  const auto eval = [&](const char* text) { return author.call("lua.eval", {{"code", text}}); };
  EXPECT_TRUE(is_ok(eval("x = 41 print('kept')")));
  const Map kept = eval("return x + 1");
  EXPECT_EQ(*result(kept).as_map()->find("value")->as_int(), 42);
  EXPECT_EQ(result(eval("return 1, 2")).as_map()->find("values")->as_list()->size(), 2U);
  EXPECT_FALSE(is_ok(eval("error('wrong')")));
  // The script may do no more than its connection.
  EXPECT_FALSE(is_ok(eval("os.exit(3)")));
  EXPECT_FALSE(is_ok(eval("io.open('/etc/passwd')")));
  EXPECT_FALSE(app().quit_requested);
}

TEST_F(ServerTest, TokensExpireAreRevokedAndAreKeptAsHashesForTheirOwnerOnly) {
  options_.needs_token = true;
  const std::string shown = grant({.name = "short"}, 1);
  const std::string other = grant({.name = "other"});
  start();
  std::ifstream in(options_.token_file);
  const std::string kept((std::istreambuf_iterator<char>(in)), {});
  EXPECT_EQ(kept.find(other), std::string::npos);
  EXPECT_EQ(kept.find(other.substr(4, 20)), std::string::npos);
  struct stat info {};
  ASSERT_EQ(::stat(options_.token_file.c_str(), &info), 0);
  EXPECT_EQ(info.st_mode & 0777U, 0600U);

  auto tokens = Tokens::open(options_.token_file);
  ASSERT_TRUE(tokens.ok());
  EXPECT_EQ(tokens->grant({.name = "other"}, 0).error().code, ErrorCode::conflict);
  for (const char* wrong : {"", "a b", "x/y", "\n"})
    EXPECT_FALSE(tokens->grant({.name = wrong}, 0).ok()) << wrong;
  EXPECT_FALSE(tokens->grant({.name = "a", .effects = Effects::all()}, 0).ok());
  EXPECT_FALSE(tokens->grant({.name = "a", .folder = "/none/here"}, 0).ok());

  Client c(where());
  ASSERT_TRUE(is_ok(c.hello({{"token", other}})));
  ASSERT_TRUE(tokens->revoke("other").ok());
  EXPECT_EQ(server_->kick_token("other", "The token was revoked."), 1U);
  EXPECT_NE(c.line()->find("server.closing"), std::string::npos);
  EXPECT_TRUE(c.is_closed());
  Client again(where());
  EXPECT_EQ(code(again.hello({{"token", other}})), "permission");
  std::this_thread::sleep_for(1100ms);
  Client late(where());
  const Map expired = late.hello({{"token", shown}});
  EXPECT_NE(sentence(expired).find("has expired"), std::string::npos) << sentence(expired);

  ASSERT_EQ(::chmod(options_.token_file.c_str(), 0644), 0);
  Client open(where());
  EXPECT_NE(sentence(open.hello({{"token", shown}})).find("chmod 600"), std::string::npos);
  EXPECT_FALSE(Tokens::open(options_.token_file).ok());
  ASSERT_EQ(::chmod(options_.token_file.c_str(), 0600), 0);
  for (const char* damaged : {"", "{", "[]", "{\"tokens\":1}", "{\"tokens\":[1]}",
                              R"({"tokens":[{"name":"a","sha256":"x","effects":[]}]})"}) {
    std::ofstream(options_.token_file, std::ios::trunc) << damaged;
    const auto read = Tokens::open(options_.token_file);
    ASSERT_FALSE(read.ok()) << damaged;
    EXPECT_NE(read.error().sentence().find("is damaged"), std::string::npos);
  }
}

TEST_F(ServerTest, TokensOfManyProgramsAtOnceAreAllKept) {
  constexpr int kThreads = 4, kEach = 10;
  {
    std::vector<std::jthread> all;
    for (int t = 0; t < kThreads; ++t)
      all.emplace_back([&, t] {
        auto tokens = Tokens::open(options_.token_file);
        ASSERT_TRUE(tokens.ok());
        for (int i = 0; i < kEach; ++i) {
          const auto made = tokens->grant({.name = std::to_string(t) + "." + std::to_string(i)}, 0);
          EXPECT_TRUE(made.ok()) << made.error().sentence();
        }
      });
  }
  const auto tokens = Tokens::open(options_.token_file);
  EXPECT_EQ(tokens->list()->size(), static_cast<std::size_t>(kThreads * kEach));
}

TEST_F(ServerTest, AnAddressThatOthersReachNeedsTlsAndATokenOrItDoesNotStart) {
  options_.addresses = {address("0.0.0.0:0")};
  auto refused = Server::start(app(), options_);
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.error().sentence().find("so nobody could connect"), std::string::npos);
  grant({.name = "a"});
  refused = Server::start(app(), options_);
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.error().sentence().find("needs TLS"), std::string::npos);
  options_.certificate = folder() / "certificate.pem";
  std::ofstream(options_.certificate) << "none";
  refused = Server::start(app(), options_);
  EXPECT_NE(refused.error().sentence().find("needs its private key"), std::string::npos);
  options_.key = folder() / "key.pem";
  refused = Server::start(app(), options_);
  EXPECT_NE(refused.error().sentence().find("cannot be read"), std::string::npos);
  std::ofstream(options_.key) << "no key";
  ASSERT_EQ(::chmod(options_.key.c_str(), 0644), 0);
  refused = Server::start(app(), options_);
  EXPECT_NE(refused.error().sentence().find("chmod 600"), std::string::npos);
  ASSERT_EQ(::chmod(options_.key.c_str(), 0600), 0);
  refused = Server::start(app(), options_);
  EXPECT_NE(refused.error().sentence().find("cannot be used"), std::string::npos);
}

TEST_F(ServerTest, LimitsAreRefusedWithASentenceAndTheConnectionGoesOn) {
  options_.limits.line = 2000;
  options_.limits.batch = 3;
  options_.limits.answer = 5000;
  options_.limits.jobs = 2;
  options_.limits.subscriptions = 2;
  options_.limits.seconds = 1;
  start();
  Client c(where());
  ASSERT_TRUE(is_ok(c.hello()));
  ASSERT_TRUE(c.send(std::string(3000, 'x') + "\n"));
  EXPECT_NE(c.line()->find("longer than 2000 bytes"), std::string::npos);
  ASSERT_TRUE(c.send("[1,2,3,4]\n"));
  EXPECT_NE(c.line()->find("at most 3 are processed together"), std::string::npos);
  const Map is_long = c.call("work.long", {{"bytes", 6000}});
  EXPECT_NE(sentence(is_long).find("at most 5000 are sent"), std::string::npos);
  for (int i = 0; i < 3; ++i)
    ASSERT_TRUE(
        c.send(R"({"jsonrpc":"2.0","id":1,"method":"work.rest","params":{"ms":3000},"job":true})"
               "\n"));
  EXPECT_TRUE(is_ok(c.answer()));
  EXPECT_TRUE(is_ok(c.answer()));
  EXPECT_NE(sentence(c.answer()).find("2 jobs of this connection"), std::string::npos);
  EXPECT_TRUE(is_ok(c.call("server.subscribe")));
  EXPECT_TRUE(is_ok(c.call("server.subscribe")));
  EXPECT_EQ(code(c.call("server.subscribe")), "conflict");
  EXPECT_TRUE(is_ok(c.call("server.unsubscribe", {{"subscription", 1}})));
  EXPECT_EQ(code(c.call("server.unsubscribe", {{"subscription", 1}})), "unknown_name");
  EXPECT_EQ(code(c.call("server.subscribe", {{"rate", -1}})), "invalid_argument");
  const Map late = c.call("work.rest", {{"ms", 20'000}});
  EXPECT_NE(sentence(late).find("took longer than 1 s"), std::string::npos) << sentence(late);
  EXPECT_TRUE(is_ok(c.call("material.list")));
  for (const auto& [key, value] :
       {std::pair{"line", 1.0}, {"line", 1e300}, {"seconds", 0.5}, {"clients", 0.0}, {"none", 1.0}})
    EXPECT_FALSE(limits_from({{key, value}}).ok()) << key << value;
  EXPECT_TRUE(limits_from({{"seconds", 0}}).ok());
}

TEST_F(ServerTest, ARateIsKeptAndTheReserveFillsAgain) {
  options_.needs_token = true;
  const std::string slow = grant({.name = "slow", .rate = 20});
  start();
  Client c(where());
  ASSERT_TRUE(is_ok(c.hello({{"token", slow}})));
  std::string all;
  for (int i = 0; i < 200; ++i)
    all += R"({"jsonrpc":"2.0","id":1,"method":"material.list"})"
           "\n";
  ASSERT_TRUE(c.send(all));
  int answered = 0, refused = 0;
  for (int i = 0; i < 200; ++i) {
    const Map a = c.answer();
    if (is_ok(a)) ++answered;
    else if (sentence(a).find("more than 20 requests per second") != std::string::npos) ++refused;
  }
  EXPECT_GE(answered, 20);
  EXPECT_GT(refused, 0);
  EXPECT_EQ(answered + refused, 200);
  std::this_thread::sleep_for(200ms);
  EXPECT_TRUE(is_ok(c.call("material.list")));
}

TEST_F(ServerTest, WhoSaysNothingOrEndsNoLineOrIsOneTooManyIsCut) {
  options_.limits.hello_seconds = 1;
  options_.limits.line_seconds = 1;
  options_.limits.clients = 3;
  start();
  Client silent(where()), slow(where()), half(where());
  ASSERT_TRUE(half.send(R"({"jsonrpc")"));
  ASSERT_TRUE(is_ok(slow.hello()));
  ASSERT_TRUE(slow.send(R"({"jsonrpc":"2.0")"));
  Client many(where());
  EXPECT_TRUE(many.is_closed());
  EXPECT_TRUE(silent.is_closed());
  EXPECT_TRUE(half.is_closed());
  const auto said = slow.line();
  EXPECT_TRUE(said && said->find("A line took longer than 1 s") != std::string::npos);
  EXPECT_TRUE(slow.is_closed());
  EXPECT_TRUE(wait_for_clients(0));
}

TEST_F(ServerTest, EachClientHasItsOwnUndoAndSeesTheChangesOfOthers) {
  start();
  Client a(where()), b(where());
  ASSERT_TRUE(is_ok(a.hello()));
  ASSERT_TRUE(is_ok(b.hello({{"subscribe", List{Value("change")}}})));
  ASSERT_TRUE(is_ok(a.call("material.create", {{"name", "brass"}, {"density", 8500}})));
  ASSERT_TRUE(is_ok(b.call("material.create", {{"name", "gold"}, {"density", 19300}})));
  ASSERT_TRUE(is_ok(a.call("document.undo")));
  EXPECT_TRUE(is_ok(b.call("material.get", {{"name", "gold"}})));
  EXPECT_FALSE(is_ok(b.call("material.get", {{"name", "brass"}})));
  std::vector<std::string> seen;
  for (const auto until = Clock::now() + 20s; b.events.size() < 3 && Clock::now() < until;)
    (void)b.call("material.list");
  ASSERT_GE(b.events.size(), 3U);
  for (const Map& e : b.events) {
    EXPECT_EQ(*e.find("method")->as_string(), "event");
    seen.push_back(*params_of(e).find("kind")->as_string());
  }
  EXPECT_EQ(seen, (std::vector<std::string>{"edit", "edit", "undo"}));
}

TEST_F(ServerTest, AClientThatDoesNotReadGetsChangesMergedAndTheOthersAreNotHeldUp) {
  options_.limits.unread = 20'000;
  options_.addresses = {address("unix:" + (folder() / "lazy").string())};
  start();
  Client lazy(where()), busy(where());
  ASSERT_TRUE(is_ok(lazy.hello({{"subscribe", List{Value("change")}}})));
  ASSERT_TRUE(is_ok(busy.hello()));
  ASSERT_TRUE(is_ok(busy.call("material.create", {{"name", "brass"}, {"density", 8500}})));
  // More than the buffers of the system take, too.
  constexpr int kEdits = 20'000;
  for (int i = 1; i <= kEdits; ++i) {
    busy.ask("material.set", {{"id", "brass"}, {"density", 1000 + i}});
    for (int k = 0; i % 100 == 0 && k < 100; ++k) ASSERT_TRUE(is_ok(busy.answer()));
  }
  // What waits for it is bounded; the revisions tell that none is missing.
  std::int64_t next = -1, commits = 0, merged = 0;
  for (const auto until = Clock::now() + 60s; commits < kEdits + 1 && Clock::now() < until;) {
    const auto text = lazy.line();
    ASSERT_TRUE(text);
    const auto message = from_json(*text);
    ASSERT_TRUE(message.ok());
    const Map& e = params_of(*message->as_map());
    const std::int64_t first = *e.find("first_revision")->as_int();
    if (next >= 0) {
      EXPECT_EQ(first, next);
    }
    next = *e.find("revision")->as_int() + 1;
    commits += *e.find("commits")->as_int();
    if (*e.find("commits")->as_int() > 1) ++merged;
  }
  EXPECT_EQ(commits, kEdits + 1);
  EXPECT_GT(merged, 0);
}

TEST_F(ServerTest, AnswersThatNobodyReadsStopTheClientsOwnRequestsOnly) {
  options_.limits.unread = 100'000;
  options_.limits.unread_seconds = 1;
  start();
  Client lazy(where()), other(where());
  ASSERT_TRUE(is_ok(lazy.hello()));
  ASSERT_TRUE(is_ok(other.hello()));
  for (int i = 0; i < 200; ++i) lazy.ask("work.long", {{"bytes", 100'000}});
  for (int i = 0; i < 50; ++i) ASSERT_TRUE(is_ok(other.call("material.list")));
  std::uint64_t sent = 0;
  for (const ClientInfo& c : server_->clients()) sent = std::max(sent, c.requests);
  EXPECT_LT(sent, 200U);
  EXPECT_TRUE(wait_for_clients(1)) << "who reads nothing for a second is cut";
}

TEST_F(ServerTest, LongCommandsOfSomeDoNotKeepOthersWaitingAndEndWhenAsked) {
  start();
  constexpr int kBusy = 12;  // more than there are threads at first
  std::vector<std::unique_ptr<Client>> busy;
  for (int i = 0; i < kBusy; ++i) {
    busy.push_back(std::make_unique<Client>(where()));
    ASSERT_TRUE(is_ok(busy.back()->hello()));
    busy.back()->ask("work.rest", {{"ms", 120'000}}, 77);
  }
  Client quick(where());
  ASSERT_TRUE(is_ok(quick.hello()));
  for (int i = 0; i < 20; ++i) ASSERT_TRUE(is_ok(quick.call("material.list")));
  EXPECT_GE(server_->threads(), static_cast<std::size_t>(kBusy));
  // One takes its request back, one is closed, one goes away, the rest end with the server.
  ASSERT_TRUE(
      busy[0]->send(R"({"jsonrpc":"2.0","id":78,"method":"rpc.cancel","params":{"request":77}})"
                    "\n"));
  const Map first = busy[0]->answer(), second = busy[0]->answer();
  EXPECT_EQ(code(*first.find("id")->as_int() == 77 ? first : second), "cancelled");
  std::uint64_t number = 0;
  for (const ClientInfo& c : server_->clients())
    if (c.requests == 1 && number == 0) number = c.number;
  ASSERT_TRUE(server_->kick(number, "Enough."));
  EXPECT_FALSE(server_->kick(999'999, ""));
  busy.erase(busy.begin() + 3);
  EXPECT_TRUE(wait_for_clients(kBusy - 1));
  const auto begin = Clock::now();
  server_.reset();
  EXPECT_LT(Clock::now() - begin, 30s);
}

std::size_t threads_of_process() {
  std::ifstream in("/proc/self/status");
  for (std::string line; std::getline(in, line);)
    if (line.starts_with("Threads:")) return std::stoul(line.substr(8));
  return 0;
}

TEST_F(ServerTest, WhoWaitsForAJobHoldsNoThread) {
  constexpr std::size_t kClients = 50;
  start();
  Client owner(where());
  ASSERT_TRUE(is_ok(owner.hello()));
  ASSERT_TRUE(owner.send(R"({"jsonrpc":"2.0","id":1,"method":"work.rest","job":true,)"
                         R"("params":{"ms":60000}})"
                         "\n"));
  const Value job = result(owner.answer());
  const auto waits = static_cast<std::int64_t>(options_.limits.waits);
  ASSERT_GE(waits, 2);
  std::vector<std::unique_ptr<Client>> all;
  const std::size_t before = threads_of_process();
  for (std::size_t i = 0; i < kClients; ++i) {
    auto& c = *all.emplace_back(std::make_unique<Client>(where()));
    ASSERT_TRUE(is_ok(c.hello()));
    for (std::int64_t w = 1; w <= waits; ++w) c.ask("job.wait", {{"id", job}}, 100 + w);
    // One too many is a sentence; what is asked behind them is answered.
    c.ask("job.wait", {{"id", job}}, 99);
    const Map no = c.answer();
    EXPECT_EQ(*no.find("id")->as_int(), 99);
    EXPECT_EQ(code(no), "conflict");
    EXPECT_TRUE(is_ok(c.call("material.list")));
  }
  EXPECT_LE(threads_of_process(), before + 4) << kClients * options_.limits.waits << " wait";
  // One that was taken back, one that is no job, a client that goes.
  Client& first = *all.front();
  first.ask("rpc.cancel", {{"request", 101}}, 1);
  const Map a = first.answer(), b = first.answer();
  EXPECT_EQ(code(*a.find("id")->as_int() == 101 ? a : b), "cancelled");
  first.ask("job.wait", {{"id", "job#999999"}}, 7);
  EXPECT_FALSE(is_ok(first.answer()));
  all.pop_back();
  ASSERT_TRUE(is_ok(owner.call("job.cancel", {{"id", job}})));
  for (std::size_t i = 0; i < all.size(); ++i) {
    std::vector<bool> is_told(static_cast<std::size_t>(waits) + 1);
    for (std::int64_t w = i == 0 ? 2 : 1; w <= waits; ++w) {
      const Map said = all[i]->answer();
      ASSERT_TRUE(said.find("id")) << i << " " << w;
      EXPECT_EQ(code(said), "cancelled");
      is_told.at(static_cast<std::size_t>(*said.find("id")->as_int() - 100)) = true;
    }
    EXPECT_EQ(std::count(is_told.begin(), is_told.end(), true), waits - (i == 0 ? 1 : 0));
  }
  // One that has ended is answered at once, and its result is that of the job.
  ASSERT_TRUE(owner.send(R"({"jsonrpc":"2.0","id":1,"method":"work.rest","job":true,)"
                         R"("params":{"ms":50}})"
                         "\n"));
  const Value brief = result(owner.answer());
  for (int i = 0; i < 2; ++i)
    EXPECT_EQ(*result(all.back()->call("job.wait", {{"id", brief}})).as_int(), 1);
}

TEST_F(ServerTest, ClientsThatCameAndWentLeaveNothingBehind) {
  start();
  const auto come = [&](int times) {
    for (int i = 0; i < times; ++i) {
      Client c(where());
      EXPECT_TRUE(is_ok(c.hello({{"subscribe", List{Value("change")}}})));
      EXPECT_TRUE(is_ok(c.call("material.list")));
    }
    EXPECT_TRUE(wait_for_clients(0));
  };
  come(3000);
  EXPECT_LE(app().sessions().size(), 4200U) << "those that closed are forgotten";
  EXPECT_FALSE(app().events.has_subscribers());
  // Steps of a session that is forgotten can be undone, as those of one that is closed.
  const auto all = app().sessions();
  EXPECT_TRUE(std::is_sorted(all.begin(), all.end(),
                             [](const auto& a, const auto& b) { return a.number < b.number; }));
}

std::uint64_t resident_mib() {
  std::ifstream in("/proc/self/statm");
  std::uint64_t all = 0, resident = 0;
  in >> all >> resident;
  return resident * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE)) >> 20;
}

struct Footprint {
  std::int64_t kib = 0;   ///< resident, after what is free was given back
  std::int64_t used = 0;  ///< of the heap, without what is free in it [KiB]
  std::size_t threads = 0, descriptors = 0, children = 0;
};
Footprint footprint() {
  Footprint f;
#ifdef __GLIBC__
  ::malloc_trim(0);
#endif
  std::ifstream in("/proc/self/statm");
  std::int64_t all = 0, resident = 0;
  in >> all >> resident;
  f.kib = resident * ::sysconf(_SC_PAGESIZE) / 1024;
#ifdef __GLIBC__
  const auto heap = ::mallinfo2();
  f.used = static_cast<std::int64_t>((heap.uordblks + heap.hblkhd) / 1024);
#endif
  f.threads = threads_of_process();
  f.descriptors = static_cast<std::size_t>(
      std::distance(fs::directory_iterator("/proc/self/fd"), fs::directory_iterator()));
  for (const auto& task : fs::directory_iterator("/proc/self/task")) {
    std::ifstream list(task.path() / "children");
    for (std::string pid; list >> pid;) ++f.children;
  }
  return f;
}

/// "An hour in compressed time": clients that come and go in every way, with what each can leave
/// behind. ROBOMOSP_LOAD_SECONDS (4) says how long; the memory of before and after is compared.
TEST_F(ServerTest, ClientsThatDoAllTheyCanAndComeBackLeaveNoMemoryBehind) {
  start();
  const std::string secret =
      grant({.name = "worker", .effects = Effect::reads | Effect::edits | Effect::simulates});
  std::atomic<std::uint64_t> connections{0}, requests{0}, scripts{0}, jobs{0}, failed{0};
  // One visit of a client; `n` says what it does and how it leaves.
  const auto visit = [&](std::uint64_t n) {
    Client c(where());
    ++connections;
    const auto must = [&](const Map& answer) {
      ++requests;
      if (!is_ok(answer)) {
        ++failed;
        ADD_FAILURE() << n << ": " << to_json(Value(answer));
      }
      return answer;
    };
    Map how{{"client", "worker " + std::to_string(n % 7)}};
    if (n % 2 == 0) how.set("token", secret);
    if (n % 3 != 0)
      how.set(
          "subscribe",
          Map{{"topics", List{Value("change"), Value("recording"), Value("job"), Value("message")}},
              {"rows", true}});
    must(c.hello(how));
    const std::string own = "m" + std::to_string(n);
    must(c.call("material.create", {{"name", own}, {"density", 1000}}));
    must(c.call("material.set", {{"id", own}, {"density", 2000}}));
    must(c.call("document.undo"));
    const Map recording = must(
        c.call("recording.create",
               {{"title", own},
                {"columns",
                 List{Map{{"name", "time"}, {"unit", "s"}, {"values", NumericArray({0, 1})}}}}}));
    must(c.call("recording.append",
                {{"id", *recording.find("result")},
                 {"columns",
                  List{Map{{"name", "time"}, {"unit", "s"}, {"values", NumericArray({2, 3})}}}}}));
    c.ask("work.rest", {{"ms", 1}}, 1);
    must(c.answer());
    (void)c.send(R"({"jsonrpc":"2.0","id":1,"method":"work.rest","job":true,"params":{"ms":)" +
                 std::string(n % 5 == 0 ? "60000" : "1") + "}}\n");
    const Map job = must(c.answer());
    ++jobs;
    if (n % 5 != 0) must(c.call("job.wait", {{"id", *job.find("result")}}));
    const Map subscription =
        must(c.call("server.subscribe", {{"topics", List{Value("run"), Value("change")}}}));
    if (n % 2 == 0)
      must(c.call("server.unsubscribe", {{"subscription", *subscription.find("result")}}));
    if (n % 10 == 0) {
      must(
          c.call("lua.eval", {{"code", "local t = {} for i = 1, 1000 do t[i] = i end return #t"}}));
      ++scripts;
    }
    must(c.call("recording.remove", {{"id", *recording.find("result")}}));
    must(c.call("material.remove", {{"id", own}}));
    // Some say goodbye, some go within a request, within a wait, or within a line.
    switch (n % 4) {
      case 0: must(c.call("server.bye")); break;
      case 1: c.ask("work.rest", {{"ms", 5}}); break;
      case 2: c.ask("job.wait", {{"id", *job.find("result")}}, 7); break;
      default: (void)c.send(R"({"jsonrpc":"2.0","id":1,"meth)");
    }
  };
  std::atomic<std::uint64_t> next{0};
  const auto work = [&](std::uint64_t until, Clock::time_point end) {
    std::vector<std::jthread> all;
    for (int t = 0; t < 4; ++t)
      all.emplace_back([&] {
        while (next < until && Clock::now() < end && failed == 0) visit(next++);
      });
    all.clear();
    EXPECT_TRUE(wait_for_clients(0));
    const auto runs = [] {
      const auto all_jobs = app().jobs.list();
      return std::any_of(all_jobs.begin(), all_jobs.end(),
                         [](const JobStatus& j) { return j.state == JobState::running; });
    };
    for (int i = 0; i < 2000 && runs(); ++i) std::this_thread::sleep_for(5ms);
    ioci::Session own("cleaner");
    EXPECT_TRUE(app().dispatch(own, "document.clear", {}).ok());
  };
  // What has a bound is filled first: sessions that are remembered, jobs, steps of undo.
  for (int i = 0; i < 4300; ++i) {
    Client c(where());
    ASSERT_TRUE(is_ok(c.hello()));
    ASSERT_TRUE(is_ok(c.call("material.list")));
  }
  const auto seconds = [] {
    const char* given = std::getenv("ROBOMOSP_LOAD_SECONDS");
    return given ? std::max(1.0, std::atof(given)) : 4.0;
  }();
  work(400, Clock::now() + 60s);
  const Footprint before = footprint();
  const std::uint64_t first = connections, asked = requests;
  work(~std::uint64_t{0}, Clock::now() + std::chrono::duration_cast<Clock::duration>(
                                             std::chrono::duration<double>(seconds)));
  // Threads that are too many end when they are next looked at.
  Footprint after = footprint();
  for (int i = 0; i < 400 && after.threads > before.threads + 4; ++i) {
    std::this_thread::sleep_for(10ms);
    after = footprint();
  }
  const std::uint64_t came = connections - first;
  std::printf("%s\n", (std::to_string(came) + " connections, " + std::to_string(requests - asked) +
                       " requests, " + std::to_string(jobs) + " jobs, " + std::to_string(scripts) +
                       " scripts; in use " + std::to_string(before.used) + " KiB before, " +
                       std::to_string(after.used) + " after; resident " +
                       std::to_string(before.kib) + ", " + std::to_string(after.kib))
                          .c_str());
  EXPECT_GT(came, 50U);
  EXPECT_EQ(failed, 0U);
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)  // which keep what is freed
  // What sessions that are remembered have done fills some MiB; then no time makes it more. What is
  // resident is more by holes between what is used.
  EXPECT_LT(after.used - before.used, 6 * 1024);
  EXPECT_LT(after.kib - before.kib, 32 * 1024);
#endif
  EXPECT_LE(after.threads, before.threads + 4);
  EXPECT_LE(after.descriptors, before.descriptors + 4);
  EXPECT_EQ(after.children, 0U) << "processes of scripts end with their connections";
  EXPECT_FALSE(app().events.has_subscribers());
  EXPECT_TRUE(app().recordings.list().empty());
}

/// A recording of so many rows, a millisecond apart, as a run of a world that is paused.
class ServedRun : public ServerTest {
 protected:
  void begin(std::size_t rows) {
    start();
    owner_ = std::make_unique<Client>(where());
    ASSERT_TRUE(is_ok(owner_->hello()));
    std::vector<double> time, x;
    for (std::size_t i = 0; i < rows; ++i) {
      time.push_back(1e-3 * static_cast<double>(i));
      x.push_back(std::sin(static_cast<double>(i)));
    }
    const Map made = owner_->call(
        "recording.create",
        {{"title", "measured"},
         {"columns", List{Map{{"name", "time"}, {"unit", "s"}, {"values", NumericArray(time)}},
                          Map{{"name", "x"}, {"values", NumericArray(x)}}}}});
    ASSERT_TRUE(is_ok(made)) << to_json(Value(made));
    ASSERT_TRUE(is_ok(owner_->call("world.create", {{"name", "cell"}})));
    const Map run = owner_->call(
        "world.start_run",
        {{"id", "cell"}, {"of", "recording"}, {"with", Map{{"recording", *made.find("result")}}}});
    ASSERT_TRUE(is_ok(run)) << to_json(Value(run));
    run_ = *run.find("result");
    x_ = std::move(x);
  }
  std::unique_ptr<Client> listen(const Map& how) {
    auto c = std::make_unique<Client>(where());
    const Map said = c->hello({{"subscribe", how}});
    EXPECT_TRUE(is_ok(said)) << to_json(Value(said));
    return c;
  }
  /// Events of a run until it is over; their number.
  static std::size_t until_over(Client& c, const std::function<void(const Map&)>& each = {}) {
    for (std::size_t count = 0;; ++count) {
      const auto text = c.line();
      EXPECT_TRUE(text) << "no event";
      if (!text) return count;
      const auto message = from_json(*text);
      EXPECT_TRUE(message.ok()) << *text;
      const Map& event = params_of(*message->as_map());
      if (each) each(event);
      const Value* state = event.find("state");
      if (state && *state->as_map()->find("is_over")->as_bool() &&
          !*state->as_map()->find("is_playing")->as_bool())
        return count + 1;
    }
  }
  std::unique_ptr<Client> owner_;
  Value run_;
  std::vector<double> x_;
};

TEST_F(ServedRun, StatesComeWhileItPlaysAsOftenAsEachWantsThem) {
  begin(1001);
  auto often = listen({{"topics", List{Value("run")}}, {"rate", 100}});
  auto seldom = listen({{"topics", List{Value("run")}}, {"rate", 10}});
  const auto begin = Clock::now();
  ASSERT_TRUE(is_ok(owner_->call("run.play", {{"id", run_}})));
  std::size_t few = 0;
  std::jthread other([&] { few = until_over(*seldom); });
  double last = -1;
  const std::size_t many = until_over(*often, [&](const Map& e) {
    const double t = e.find("state")->as_map()->find("time")->number();
    EXPECT_GE(t, last) << "states come in order";
    last = t;
  });
  other.join();
  const double took = std::chrono::duration<double>(Clock::now() - begin).count();
  EXPECT_NEAR(last, 1, 1e-9) << "the end is told";
  EXPECT_LE(static_cast<double>(many), 100 * took + 4);
  EXPECT_LE(static_cast<double>(few), 10 * took + 4);
  EXPECT_GE(few, 2U);
  EXPECT_GT(many, 2 * few);
}

TEST_F(ServedRun, RowsComeOnceInOrderAndWhole) {
  begin(50'001);
  // Columns, as numbers and as bytes; and one that reads nothing for a while.
  for (const char* arrays : {"numbers", "base64"}) {
    ASSERT_TRUE(is_ok(owner_->call("run.reset", {{"id", run_}})));
    auto c = listen({{"topics", List{Value("run")}},
                     {"rows", List{Value("time"), Value("x")}},
                     {"arrays", arrays}});
    ASSERT_TRUE(is_ok(owner_->call("run.play", {{"id", run_}, {"speed", "max"}})));
    std::vector<double> x;
    const auto take = [&](const Map& event) {
      const Map& rows = *event.find("rows")->as_map();
      ASSERT_EQ(rows.find("error"), nullptr);
      // Rows that are others now take the place of those of before.
      const auto from = static_cast<std::size_t>(*rows.find("from")->as_int());
      ASSERT_LE(from, x.size() + 1) << "none is left out";
      x.resize(from - 1);
      const Value* column = rows.find("columns")->as_map()->find("x");
      if (const List* numbers = column->as_list()) {
        for (const Value& v : *numbers) x.push_back(v.number());
      } else if (const NumericArray* array = column->as_array()) {
        for (std::size_t i = 0; i < array->size(); ++i) x.push_back((*array)[i]);
      } else {
        ADD_FAILURE() << to_json(*column);
      }
    };
    until_over(*c, take);
    while (x.size() < x_.size()) {
      const auto text = c->line();
      ASSERT_TRUE(text) << x.size();
      take(params_of(*from_json(*text)->as_map()));
    }
    EXPECT_EQ(x, x_);
  }
  // What cannot be meant is refused.
  Client c(where());
  ASSERT_TRUE(is_ok(c.hello()));
  for (const Map& wrong : {Map{{"topics", List{Value("change")}}, {"rows", true}},
                           Map{{"rows", "x"}}, Map{{"rows", List{Value(1)}}}, Map{{"rate", 0}},
                           Map{{"rate", 1e9}}, Map{{"arrays", "hex"}}, Map{{"rate", "often"}}})
    EXPECT_EQ(code(c.call("server.subscribe", wrong)), "invalid_argument") << to_json(Value(wrong));
  // A name that is no column: each event says so, and the connection goes on.
  auto lost = listen({{"topics", List{Value("run")}}, {"rows", List{Value("nothing")}}});
  ASSERT_TRUE(is_ok(owner_->call("run.seek", {{"id", run_}, {"time", 1}})));
  const auto text = lost->line();
  ASSERT_TRUE(text);
  EXPECT_NE(text->find("nothing"), std::string::npos) << *text;
}

TEST_F(ServedRun, RowsThatAreAppendedToARecordingComeOnceInOrderAndWhole) {
  start();
  Client owner(where());
  ASSERT_TRUE(is_ok(owner.hello()));
  auto whole = listen({{"topics", List{Value("recording")}},
                       {"rows", List{Value("x")}},
                       {"arrays", "base64"},
                       {"rate", 200}});
  auto seldom = listen({{"topics", List{Value("recording")}}, {"rate", 10}});
  constexpr std::size_t kParts = 200, kRows = 50, kAll = (kParts + 1) * kRows;
  std::vector<double> x;
  const auto part = [&] {
    std::vector<double> time, values;
    for (std::size_t i = 0; i < kRows; ++i) {
      time.push_back(1e-3 * static_cast<double>(x.size()));
      x.push_back(std::sin(static_cast<double>(x.size())));
      values.push_back(x.back());
    }
    return List{Map{{"name", "time"}, {"unit", "s"}, {"values", NumericArray(time)}},
                Map{{"name", "x"}, {"values", NumericArray(values)}}};
  };
  const Map made = owner.call("recording.create", {{"title", "grows"}, {"columns", part()}});
  ASSERT_TRUE(is_ok(made)) << to_json(Value(made));
  const Value id = *made.find("result");
  const auto begin = Clock::now();
  for (std::size_t i = 0; i < kParts; ++i)
    ASSERT_TRUE(is_ok(owner.call("recording.append", {{"id", id}, {"columns", part()}})));
  const double took = std::chrono::duration<double>(Clock::now() - begin).count();
  std::vector<double> came;
  bool is_added = false;
  while (came.size() < kAll) {
    const auto text = whole->line();
    ASSERT_TRUE(text) << came.size();
    const auto message = from_json(*text);
    const Map& event = params_of(*message->as_map());
    EXPECT_EQ(*event.find("topic")->as_string(), "recording");
    const Value* rows = event.find("rows");
    if (const Value* kind = event.find("kind"); kind && *kind->as_string() == "added") {
      is_added = true;
      EXPECT_EQ(*rows->as_int(), static_cast<std::int64_t>(kRows));
      EXPECT_EQ(*event.find("title")->as_string(), "grows");
      continue;
    }
    ASSERT_TRUE(rows && rows->as_map() && !rows->as_map()->find("error")) << *text;
    ASSERT_EQ(*rows->as_map()->find("from")->as_int(), static_cast<std::int64_t>(came.size() + 1));
    const NumericArray* values = rows->as_map()->find("columns")->as_map()->find("x")->as_array();
    ASSERT_TRUE(values) << *text;
    for (std::size_t i = 0; i < values->size(); ++i) came.push_back((*values)[i]);
  }
  EXPECT_TRUE(is_added);
  EXPECT_EQ(came, x);
  // Without rows there is the count only, at the rate that was asked for.
  ASSERT_TRUE(is_ok(owner.call("recording.remove", {{"id", id}})));
  std::size_t events = 0;
  std::int64_t rows = 0;
  for (std::string kind; kind != "removed"; ++events) {
    const auto text = seldom->line();
    ASSERT_TRUE(text);
    const auto message = from_json(*text);
    const Map& event = params_of(*message->as_map());
    kind = *event.find("kind")->as_string();
    if (kind == "appended") rows = *event.find("rows")->as_int();
  }
  EXPECT_EQ(rows, static_cast<std::int64_t>(kAll));
  EXPECT_LE(static_cast<double>(events), 10 * took + 8);
  // Columns that it has not are a sentence of the event.
  auto wrong = listen({{"topics", List{Value("recording")}}, {"rows", List{Value("nothing")}}});
  const Map other = owner.call("recording.create", {{"title", "other"}, {"columns", part()}});
  ASSERT_TRUE(
      is_ok(owner.call("recording.append", {{"id", *other.find("result")}, {"columns", part()}})));
  (void)wrong->line();
  const auto text = wrong->line();
  ASSERT_TRUE(text);
  EXPECT_NE(text->find("no column"), std::string::npos) << *text;
}

TEST_F(ServerTest, WhatTakesTooMuchMemoryEndsAndOthersReadOn) {
  // Above what the program takes already.
  options_.limits.memory = resident_mib() + 200;
  start();
  Client a(where()), b(where());
  ASSERT_TRUE(is_ok(a.hello()) && is_ok(b.hello()));
  ASSERT_TRUE(is_ok(b.call("material.create", {{"name", "before"}, {"density", 1}})));
  a.ask("work.rest", {{"ms", 60'000}});
  std::this_thread::sleep_for(50ms);
  constexpr std::size_t kLarge = std::size_t{400} << 20;
  void* large = ::mmap(nullptr, kLarge, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  ASSERT_NE(large, MAP_FAILED);
  std::memset(large, 1, kLarge);
  const std::string most = std::to_string(options_.limits.memory);
  const Map ended = a.answer();
  EXPECT_EQ(code(ended), "cancelled") << to_json(Value(ended));
  EXPECT_NE(sentence(ended).find(most + " MiB"), std::string::npos) << sentence(ended);
  const Map refused = b.call("material.create", {{"name", "more"}, {"density", 1}});
  EXPECT_EQ(code(refused), "conflict") << to_json(Value(refused));
  EXPECT_NE(sentence(refused).find(most), std::string::npos) << sentence(refused);
  EXPECT_TRUE(is_ok(b.call("material.list")));
  EXPECT_TRUE(is_ok(b.call("material.remove", {{"id", "before"}})))
      << "what makes room is let through";
  ::munmap(large, kLarge);
  bool is_open = false;
  for (int i = 0; i < 100 && !is_open; ++i) {
    std::this_thread::sleep_for(50ms);
    is_open = is_ok(b.call("material.create", {{"name", "after"}, {"density", 1}}));
  }
  EXPECT_TRUE(is_open) << "once there is room, edits go on";
}

TEST_F(ServerTest, TheCommandsStartListKickGrantRevokeAndStop) {
  ioci::Session own("operator");
  const auto run = [&](const char* command, const Map& args = {}) {
    return app().dispatch(own, command, args);
  };
  const std::string file = options_.token_file.string();
  const auto started = run("server.start", {{"addresses", "127.0.0.1:0"},
                                            {"token_file", file},
                                            {"effects", List{Value("reads")}},
                                            {"limits", Map{{"seconds", 5}}},
                                            {"audit", (folder() / "audit").string()}});
  ASSERT_TRUE(started.ok()) << started.error().sentence();
  EXPECT_EQ(run("server.start").error().code, ErrorCode::conflict);
  const auto secret =
      run("server.grant", {{"name", "operator"}, {"commands", List{Value("server.stop")}}});
  ASSERT_TRUE(secret.ok()) << secret.error().sentence();
  EXPECT_EQ(run("server.grant", {{"name", "x"}, {"commands", "no.such"}}).error().code,
            ErrorCode::unknown_name);
  EXPECT_EQ(run("server.grant", {{"name", "x"}, {"effects", "stops"}}).error().code,
            ErrorCode::invalid_argument);
  EXPECT_EQ(run("server.tokens")->as_list()->size(), 1U);
  const Address a = address(*started->as_map()->find("addresses")->as_list()->front().as_string());
  Client guest(a), admin(a);
  ASSERT_TRUE(is_ok(guest.hello({{"client", "guest"}})));
  ASSERT_TRUE(is_ok(admin.hello({{"token", *secret->as_string()}})));
  EXPECT_EQ(code(guest.call("material.create", {{"name", "a"}, {"density", 1}})), "permission");
  const auto clients = run("server.clients");
  ASSERT_EQ(clients->as_list()->size(), 2U);
  EXPECT_EQ(*clients->as_list()->front().as_map()->find("name")->as_string(), "guest");
  ASSERT_TRUE(run("server.kick", {{"client", 1}, {"reason", "Not now."}}).ok());
  EXPECT_NE(guest.line()->find("Not now."), std::string::npos);
  EXPECT_TRUE(guest.is_closed());
  // A client that may stops it, is answered, and sees the end.
  const Map stopped = admin.call("server.stop");
  EXPECT_TRUE(is_ok(stopped)) << to_json(Value(stopped));
  EXPECT_TRUE(admin.is_closed() || admin.is_closed());
  EXPECT_FALSE(*run("server.status")->as_map()->find("is_running")->as_bool());
  EXPECT_EQ(*run("server.revoke", {{"name", "operator"}, {"token_file", file}})->as_int(), 0);
  std::ifstream in(folder() / "audit");
  const std::string audit((std::istreambuf_iterator<char>(in)), {});
  EXPECT_NE(audit.find(R"("method":"material.create")"), std::string::npos) << audit;
  EXPECT_NE(audit.find(R"("result":"permission")"), std::string::npos) << audit;
  EXPECT_EQ(audit.find(*secret->as_string()), std::string::npos) << "no secret is written";
}

TEST_F(ServerTest, TwentyClientsEditUndoSubscribeAndLeaveAtAnyMoment) {
  start();
  ioci::Session own("first");
  ASSERT_TRUE(app().dispatch(own, "material.create", {{"name", "shared"}, {"density", 1000}}).ok());
  constexpr int kClients = 20, kRequests = 60;
  std::atomic<int> answered{0}, wrong{0};
  {
    std::vector<std::jthread> all;
    for (int t = 0; t < kClients; ++t)
      all.emplace_back([&, t] {
        std::mt19937 random(test::seed() + static_cast<unsigned>(t));
        auto c = std::make_unique<Client>(where());
        const Map subscribe{{"subscribe", List{Value("change"), Value("job")}}};
        if (!is_ok(c->hello(subscribe))) ++wrong;
        for (int i = 0; i < kRequests; ++i) {
          const auto kind = random() % 8;
          if (kind == 0) {
            c->ask("work.rest", {{"ms", 50}});  // left behind
            c = std::make_unique<Client>(where());
            if (!is_ok(c->hello(subscribe))) ++wrong;
            continue;
          }
          const Map a = kind < 3   ? c->call("material.set", {{"id", "shared"}, {"density", i + 1}})
                        : kind < 4 ? c->call("document.undo")
                        : kind < 5 ? c->call("job.list")
                                   : c->call("material.list");
          const bool is_fine = is_ok(a) || code(a) == "conflict" || code(a) == "unknown_name" ||
                               code(a) == "stale_handle" || code(a) == "usage";
          if (!is_fine) {
            ++wrong;
            ADD_FAILURE() << to_json(Value(a));
          }
          ++answered;
        }
      });
  }
  EXPECT_EQ(wrong, 0);
  EXPECT_GT(answered, kClients * kRequests / 2);
  EXPECT_TRUE(wait_for_clients(0));
}

TEST_F(ServerTest, WhateverBytesComeTheServerAnswersOrCutsAndGoesOn) {
  options_.limits.hello_seconds = 2;
  start();
  std::mt19937 random(test::seed());
  const std::string hello =
      R"({"jsonrpc":"2.0","id":1,"method":"server.hello","params":{"protocol":1,"subscribe":["change"]}})"
      "\n";
  const std::vector<std::string> lines = {
      R"({"jsonrpc":"2.0","id":2,"method":"material.create","params":{"name":"a","density":1}})",
      R"({"jsonrpc":"2.0","id":2,"method":"server.subscribe","params":{"topics":["run"],"rate":5}})",
      R"({"jsonrpc":"2.0","id":2,"method":"server.unsubscribe","params":{"subscription":1}})",
      R"({"jsonrpc":"2.0","id":2,"method":"rpc.cancel","params":{"request":2}})",
      R"([{"jsonrpc":"2.0","id":2,"method":"material.list"},{"jsonrpc":"2.0","method":"job.list"}])",
      R"({"jsonrpc":"2.0","id":2,"method":"work.rest","params":{"ms":3},"job":true,"progress":true})",
      R"({"jsonrpc":"2.0","id":2,"method":"job.wait","params":{"id":"job#1"}})",
      R"({"jsonrpc":"2.0","id":2,"method":"ioci.classic","params":{"line":"Worlds LsWorlds"}})",
      "hello",
      "Worlds LsWorlds"};
  // Bytes of all doors together; longer by the variable.
  const char* wish = std::getenv("ROBOMOSP_FUZZ_SECONDS");
  const auto until = Clock::now() + std::chrono::milliseconds(wish ? std::atoi(wish) * 1000 : 2500);
  std::size_t sent = 0;
  while (Clock::now() < until) {
    Client c(where());
    std::string text = random() % 4 ? hello : std::string();
    for (std::size_t i = 0, n = random() % 30; i < n; ++i) {
      std::string line = lines[random() % lines.size()];
      for (std::size_t k = 0, m = random() % 3 ? random() % 4 : 0; k < m && !line.empty(); ++k) {
        const std::size_t at = random() % line.size();
        switch (random() % 4) {
          case 0: line[at] = static_cast<char>(random()); break;
          case 1: line.erase(at, random() % 9); break;
          case 2: line.insert(at, line.substr(random() % line.size(), random() % 40)); break;
          default: line.insert(at, std::string(random() % 50, "[{\"\n\x00"[random() % 5])); break;
        }
      }
      text += line + (random() % 20 ? "\n" : "");
    }
    // In pieces of any size.
    for (std::size_t at = 0; at < text.size();) {
      const std::size_t n = std::min<std::size_t>(1 + random() % 400, text.size() - at);
      if (!c.send(std::string_view(text).substr(at, n))) break;
      at += n;
    }
    sent += text.size();
    if (random() % 3 == 0) (void)c.line(5ms);
  }
  RecordProperty("bytes", static_cast<int>(sent));
  std::cout << sent << " bytes\n";
  Client c(where());
  EXPECT_TRUE(is_ok(c.hello()));
  EXPECT_TRUE(is_ok(c.call("material.list")));
}

}  // namespace
}  // namespace robomosp::remote
