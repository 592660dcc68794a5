// SPDX-License-Identifier: Apache-2.0
// Browsers at the server's door: requests of HTTP, frames of WebSocket, hosts and origins, what a
// browser without a token may, and what attackers send. Without plugins.
#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "ioci/core/application.h"
#include "remote/http.h"
#include "remote/json.h"
#include "remote/server.h"
#include "remote/web.h"
#include "remote/web_page.h"
#include "remote/websocket.h"
#include "support/seed.h"

namespace robomosp::remote {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;
using namespace std::string_literals;
using Clock = std::chrono::steady_clock;

constexpr const char* kKey = "dGhlIHNhbXBsZSBub25jZQ==";  // RFC 6455, section 1.3

std::string handshake(const std::string& host, const std::string& more = "",
                      const std::string& target = "/socket") {
  return "GET " + target + " HTTP/1.1\r\nHost: " + host +
         "\r\nUpgrade: websocket\r\nConnection: keep-alive, Upgrade\r\nSec-WebSocket-Key: " + kKey +
         "\r\nSec-WebSocket-Version: 13\r\n" + more + "\r\n";
}

/// A frame as a client sends it.
std::string frame(unsigned kind, const std::string& content, bool is_last = true,
                  bool is_masked = true, unsigned reserved = 0) {
  std::string out;
  out += static_cast<char>((is_last ? 0x80U : 0U) | reserved | kind);
  const unsigned mask = is_masked ? 0x80U : 0U;
  const auto n = static_cast<std::uint64_t>(content.size());
  const int bytes = n < 126 ? 0 : n < 65'536 ? 2 : 8;
  out += static_cast<char>(mask | (bytes == 0   ? static_cast<unsigned>(n)
                                   : bytes == 2 ? 126U
                                                : 127U));
  for (int i = bytes - 1; i >= 0; --i) out += static_cast<char>((n >> (8 * i)) & 255U);
  if (!is_masked) return out + content;
  const std::string key = "\x37\xfa\x21\x3d";
  out += key;
  for (std::size_t i = 0; i < content.size(); ++i)
    out += static_cast<char>(static_cast<unsigned char>(content[i]) ^
                             static_cast<unsigned char>(key[i % 4]));
  return out;
}

/// The status with which a request is refused, 200 when it is none.
int status_of(const std::string& request, std::size_t piece = 1000) {
  HttpHead head;
  bool is_done = false;
  for (std::size_t at = 0; at < request.size() && !is_done; at += piece)
    is_done = head.feed(std::string_view(request).substr(at, piece));
  if (!is_done) return 0;
  HttpFault fault;
  return head.read(fault) ? 200 : fault.status;
}

TEST(Http, ARequestIsReadInPiecesOfAnySize) {
  const std::string request =
      "GET /a HTTP/1.1\r\nHost: x\r\nUpgrade:\t websocket \r\nCookie: a\r\ncookie: b\r\n\r\n";
  for (std::size_t piece = 1; piece <= request.size(); ++piece)
    EXPECT_EQ(status_of(request, piece), 200) << piece;
  HttpHead head;
  ASSERT_TRUE(head.feed(request));
  HttpFault fault;
  const auto read = head.read(fault);
  ASSERT_TRUE(read);
  EXPECT_EQ(read->target, "/a");
  EXPECT_EQ(*read->find("upgrade"), "websocket");
  EXPECT_TRUE(read->has_word("upgrade", "websocket"));
  EXPECT_FALSE(read->has_word("upgrade", "web"));
  EXPECT_EQ(status_of(request.substr(0, request.size() - 1)), 0);
}

TEST(Http, WhatCouldBeReadInTwoWaysIsRefused) {
  const auto with = [](const std::string& lines) {
    return status_of("GET / HTTP/1.1\r\n" + lines + "\r\n");
  };
  EXPECT_EQ(with("Host: x\r\n"), 200);
  EXPECT_EQ(with(""), 400);  // nobody is meant
  EXPECT_EQ(with("Host: x\r\nHost: y\r\n"), 400);
  EXPECT_EQ(with("Host: x\r\nContent-Length: 5\r\n"), 400);
  EXPECT_EQ(with("Host: x\r\nContent-Length: 0\r\n"), 200);
  EXPECT_EQ(with("Host: x\r\nContent-Length: 00\r\n"), 400);
  EXPECT_EQ(with("Host: x\r\nTransfer-Encoding: chunked\r\n"), 400);
  EXPECT_EQ(with("Host: x\r\nTransfer-Encoding : chunked\r\n"), 400);
  EXPECT_EQ(with("Host: x\r\n folded\r\n"), 400);
  EXPECT_EQ(with("Host: x\r\nno colon\r\n"), 400);
  EXPECT_EQ(with("Host: x\r\n: empty\r\n"), 400);
  EXPECT_EQ(with("Host: x\nOrigin: y\r\n"), 400);
  EXPECT_EQ(with("Host: x\r\nA: \x01\r\n"), 400);
  EXPECT_EQ(with("Host: x\r\nA: "s + '\0' + "\r\n"), 400);
  EXPECT_EQ(with("Host: x\r\nA: b\rc\r\n"), 400);
  EXPECT_EQ(status_of("GET / HTTP/1.1\r\nHost: x\r\n\r\nGET / HTTP/1.1\r\nHost: x\r\n\r\n"), 400);
  EXPECT_EQ(status_of("GET / HTTP/1.1\r\nHost: x\r\n\r\n\n"), 400);
  EXPECT_EQ(status_of("GET / HTTP/1.0\r\nHost: x\r\n\r\n"), 505);
  EXPECT_EQ(status_of("GET / HTTP/2\r\nHost: x\r\n\r\n"), 505);
  EXPECT_EQ(status_of("GET /\r\nHost: x\r\n\r\n"), 400);
  EXPECT_EQ(status_of("GET  / HTTP/1.1\r\nHost: x\r\n\r\n"), 400);
  EXPECT_EQ(status_of("GET / x HTTP/1.1\r\nHost: x\r\n\r\n"), 400);
  EXPECT_EQ(status_of("GET http://x/ HTTP/1.1\r\nHost: x\r\n\r\n"), 400);
  EXPECT_EQ(status_of("GET /\x80 HTTP/1.1\r\nHost: x\r\n\r\n"), 400);
  EXPECT_EQ(status_of("GETS / HTTP/1.1\r\nHost: x\r\n\r\n"), 400);
}

TEST(Http, EverythingIsBounded) {
  const auto fields = [](std::size_t count, std::size_t size) {
    std::string out = "GET / HTTP/1.1\r\nHost: x\r\n";
    for (std::size_t i = 1; i < count; ++i)
      out += "A" + std::to_string(i) + ": " + std::string(size, 'b') + "\r\n";
    return out + "\r\n";
  };
  EXPECT_EQ(status_of(fields(kMostHttpFields, 10)), 200);
  EXPECT_EQ(status_of(fields(kMostHttpFields + 1, 10)), 431);
  EXPECT_EQ(status_of(fields(2, kLongestHttpField)), 431);
  EXPECT_EQ(status_of(fields(3, kLongestHttpField - 10)), 431);  // all together
  EXPECT_EQ(
      status_of("GET /" + std::string(kLongestHttpTarget, 'a') + " HTTP/1.1\r\nHost: x\r\n\r\n"),
      414);
  EXPECT_EQ(status_of("GET /" + std::string(100'000, 'a')), 431);
}

TEST(WebRules, HostsAreAddressesAndOwnNames) {
  const auto address = [](const char* text) { return *Address::parse(text); };
  const auto rules = WebRules::make({"https://Robots.example:8443", "http://cell.example"},
                                    {address("127.0.0.1:7007"), address("arm.example:1")});
  ASSERT_TRUE(rules.ok());
  for (const char* own : {"127.0.0.1:7007", "localhost", "LOCALHOST:80", "[::1]:7007",
                          "192.168.1.7", "robots.example", "cell.example:81", "arm.example:1"})
    EXPECT_TRUE(rules->is_own_host(own)) << own;
  for (const char* strange :
       {"", "evil.example", "evil.example:7007", "localhost.evil.example", "127.0.0.1.evil.example",
        "1.2.3", "0x7f.1", "[::1", "::1", "localhost:", "localhost:80:80", "localhost:x", "a b",
        "localhost@evil.example", "robots.example.", "[::1]x:1"})
    EXPECT_FALSE(rules->is_own_host(strange)) << strange;
  const auto may = [&](const char* origin, const char* host, bool has_tls) {
    const std::string o = origin;
    return rules->is_own_origin(&o, host, has_tls);
  };
  EXPECT_TRUE(may("http://127.0.0.1:7007", "127.0.0.1:7007", false));
  EXPECT_TRUE(may("https://robots.example:8443", "127.0.0.1:7007", false));
  EXPECT_FALSE(may("http://127.0.0.1:7007", "127.0.0.1:7007", true));
  EXPECT_FALSE(may("http://127.0.0.1:8000", "127.0.0.1:7007", false));
  EXPECT_FALSE(may("http://localhost:7007", "127.0.0.1:7007", false));
  EXPECT_FALSE(may("null", "127.0.0.1:7007", false));
  EXPECT_FALSE(may("", "127.0.0.1:7007", false));
  EXPECT_FALSE(may("http://127.0.0.1:7007/", "127.0.0.1:7007", false));
  EXPECT_TRUE(rules->is_own_origin(nullptr, "127.0.0.1:7007", false));
  for (const char* wrong : {"robots.example", "https://", "ftp://x", "https://x/path", "*", "null"})
    EXPECT_FALSE(WebRules::make({wrong}, {}).ok()) << wrong;
}

/// What a reader makes of bytes, as words.
struct Heard {
  std::string all;
  WebSocketReader reader{100};
  bool feed(std::string_view bytes, std::size_t piece = 1000) {
    const WebSocketReader::Sinks sinks{
        .message =
            [this](std::string_view text) {
              all += "<" + std::string(text) + ">";
              return true;
            },
        .too_long =
            [this] {
              all += "long";
              return true;
            },
        .ping = [this](std::string_view content) { all += "ping:" + std::string(content); },
        .end = [this](
                   WebSocketEnd code,
                   std::string_view) { all += "end " + std::to_string(static_cast<int>(code)); }};
    for (std::size_t at = 0; at < bytes.size(); at += piece)
      if (!reader.feed(bytes.substr(at, piece), sinks)) return false;
    return true;
  }
};
std::string heard(const std::string& bytes, std::size_t piece = 1000) {
  Heard h;
  h.feed(bytes, piece);
  return h.all;
}

TEST(WebSocket, TheExamplesOfTheRfcHold) {
  EXPECT_EQ(websocket_accept(kKey), "s3pPLMBiTxaQ9kYGzzhZRbK+xOo=");
  EXPECT_EQ(heard("\x81\x85\x37\xfa\x21\x3d\x7f\x9f\x4d\x51\x58"), "<Hello>");
  EXPECT_EQ(websocket_text("Hello"), "\x81\x05Hello");
  EXPECT_EQ(websocket_text(std::string(256, 'a')).substr(0, 4), "\x81\x7e\x01\x00"s);
  EXPECT_EQ(websocket_text(std::string(65'536, 'a')).substr(0, 10),
            "\x81\x7f\x00\x00\x00\x00\x00\x01\x00\x00"s);
  EXPECT_EQ(websocket_close(WebSocketEnd::normal, ""), "\x88\x02\x03\xe8"s);
  // A reason is cut between characters.
  const std::string last = websocket_close(WebSocketEnd::normal, std::string(122, 'a') + "é");
  EXPECT_EQ(last.size(), 4U + 122U);
  EXPECT_TRUE(is_websocket_key(kKey));
  for (const char* wrong : {"", "dGhlIHNhbXBsZSBub25jZQ=", "dGhlIHNhbXBsZSBub25jZQ=!",
                            "dGhlIHNhbXBsZSBub25jZXhx", "dGhlIHNhbXBsZSBub25j"})
    EXPECT_FALSE(is_websocket_key(wrong)) << wrong;
}

TEST(WebSocket, PiecesOfMessagesArePutTogetherWhateverComesBetween) {
  const std::string all = frame(1, "Hel", false) + frame(9, "are you there") + frame(0, "", false) +
                          frame(10, "x") + frame(0, "lo") + frame(1, "") +
                          frame(1, std::string(90, 'y'));
  for (std::size_t piece = 1; piece < 40; ++piece)
    EXPECT_EQ(heard(all, piece), "ping:are you there<Hello><><" + std::string(90, 'y') + ">")
        << piece;
  // Longer ones are skipped, whether they say so at once or not, and the next is read.
  EXPECT_EQ(heard(frame(1, std::string(200, 'x')) + frame(1, "next")), "long<next>");
  EXPECT_EQ(heard(frame(1, std::string(60, 'x'), false) + frame(0, std::string(60, 'x'), false) +
                  frame(0, std::string(60, 'x')) + frame(1, "next")),
            "long<next>");
  Heard open;
  EXPECT_TRUE(open.feed(frame(1, "a", false)));
  EXPECT_TRUE(open.reader.is_within());
  EXPECT_TRUE(open.feed(frame(0, "b")));
  EXPECT_FALSE(open.reader.is_within());
}

TEST(WebSocket, WhatBreaksTheRulesEndsItWithTheCodeOfTheRfc) {
  EXPECT_EQ(heard(frame(1, "Hello", true, false)), "end 1002");       // not masked
  EXPECT_EQ(heard(frame(1, "Hello", true, true, 0x40)), "end 1002");  // compressed
  EXPECT_EQ(heard(frame(2, "Hello")), "end 1003");
  EXPECT_EQ(heard(frame(3, "Hello")), "end 1002");
  EXPECT_EQ(heard(frame(11, "")), "end 1002");
  EXPECT_EQ(heard(frame(0, "Hello")), "end 1002");
  EXPECT_EQ(heard(frame(1, "a", false) + frame(1, "b")), "end 1002");
  EXPECT_EQ(heard(frame(9, "a", false)), "end 1002");
  EXPECT_EQ(heard(frame(9, std::string(126, 'a'))), "end 1002");
  EXPECT_EQ(heard("\x81\xfe\x00\x05\x37\xfa\x21\x3d"s), "end 1002");  // a length in two bytes
  EXPECT_EQ(heard("\x81\xff\xff\xff\xff\xff\xff\xff\xff\xff\x37\xfa\x21\x3d"), "end 1002");
  EXPECT_EQ(heard(frame(1, "\xff")), "end 1007");
  EXPECT_EQ(heard(frame(1, "\xc3", false) + frame(0, "\xa9")), "<é>");
  EXPECT_EQ(heard(frame(1, "\xed\xa0\x80")), "end 1007");  // half a character of UTF-16
  EXPECT_EQ(heard(frame(1, "a\nb")), "end 1008");
  EXPECT_EQ(heard(frame(1, "a\r")), "end 1008");
  EXPECT_EQ(heard(frame(8, "")), "end 1000");
  EXPECT_EQ(heard(frame(8, "\x03\xe8 bye")), "end 1000");
  EXPECT_EQ(heard(frame(8, "\x03")), "end 1002");
  EXPECT_EQ(heard(frame(8, "\x03\xed")), "end 1002");  // 1005 is never sent
  EXPECT_EQ(heard(frame(8, "\x03\xe8\xff")), "end 1002");
  // Nothing is read after the end.
  EXPECT_EQ(heard(frame(8, "") + frame(1, "late")), "end 1000");
}

// --- a server ---

class Peer {
 public:
  explicit Peer(const Address& a) : port_(a.port) {
    fd_ = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    sockaddr_in end{};
    end.sin_family = AF_INET;
    end.sin_port = htons(a.port);
    end.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(::connect(fd_, reinterpret_cast<sockaddr*>(&end), sizeof end), 0);
  }
  ~Peer() { ::close(fd_); }
  Peer(const Peer&) = delete;
  Peer& operator=(const Peer&) = delete;
  std::string host() const { return "127.0.0.1:" + std::to_string(port_); }
  bool send(std::string_view text) const {
    while (!text.empty()) {
      const ssize_t n = ::send(fd_, text.data(), text.size(), MSG_NOSIGNAL);
      if (n <= 0) return false;
      text.remove_prefix(static_cast<std::size_t>(n));
    }
    return true;
  }
  /// Reads on; false at the end of the connection, or when nothing comes.
  bool more(std::chrono::milliseconds patience = 20s) {
    pollfd ready{fd_, POLLIN, 0};
    if (::poll(&ready, 1, static_cast<int>(patience.count())) <= 0) return false;
    std::array<char, 65'536> piece{};
    const ssize_t n = ::recv(fd_, piece.data(), piece.size(), 0);
    if (n <= 0) return !(is_over_ = true);
    in_.append(piece.data(), static_cast<std::size_t>(n));
    return true;
  }
  /// All that comes until the server closes.
  std::string rest() {
    while (more()) {
    }
    EXPECT_TRUE(is_over_);
    return std::exchange(in_, {});
  }
  std::string get(const std::string& target, const std::string& host,
                  const std::string& more = "") {
    EXPECT_TRUE(send("GET " + target + " HTTP/1.1\r\nHost: " + host + "\r\n" + more + "\r\n"));
    return rest();
  }
  bool upgrade(const std::string& more = "") {
    send(handshake(host(), more));
    std::size_t end = std::string::npos;
    while ((end = in_.find("\r\n\r\n")) == std::string::npos)
      if (!this->more()) return false;
    const bool is_done = in_.starts_with("HTTP/1.1 101 ");
    in_.erase(0, end + 4);
    return is_done;
  }
  /// Kind and content of the next frame; kind 0 at the end.
  std::pair<unsigned, std::string> next() {
    const auto wait = [this](std::size_t count) {
      while (in_.size() < count)
        if (!more()) return false;
      return true;
    };
    if (!wait(2)) return {0, ""};
    const auto byte = [this](std::size_t i) { return static_cast<unsigned char>(in_[i]); };
    EXPECT_EQ(byte(1) & 0x80U, 0U);  // servers do not mask
    std::size_t size = byte(1) & 127U, begin = 2;
    if (size >= 126) {
      begin += size == 126 ? 2 : 8;
      if (!wait(begin)) return {0, ""};
      size = 0;
      for (std::size_t i = 2; i < begin; ++i) size = size << 8U | byte(i);
    }
    if (!wait(begin + size)) return {0, ""};
    std::pair<unsigned, std::string> out{byte(0) & 15U, in_.substr(begin, size)};
    in_.erase(0, begin + size);
    return out;
  }
  std::string call(const std::string& method, const std::string& params = "{}") {
    EXPECT_TRUE(send(frame(
        1, R"({"jsonrpc":"2.0","id":1,"method":")" + method + R"(","params":)" + params + "}")));
    for (;;) {
      const auto [kind, text] = next();
      if (kind != 1) return "frame " + std::to_string(kind);
      if (text.find("\"id\":1") != std::string::npos) return text;
    }
  }
  std::string hello(const std::string& token = "") {
    return call("server.hello",
                R"({"protocol":1)" + (token.empty() ? "" : R"(,"token":")" + token + "\"") + "}");
  }

 private:
  const std::uint16_t port_;
  int fd_ = -1;
  std::string in_;
  bool is_over_ = false;
};

bool has(const std::string& text, std::string_view part) {
  return text.find(part) != std::string::npos;
}

class WebTest : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("robomosp-web-" + std::to_string(::getpid()));
    fs::create_directories(folder_);
    ioci::ApplicationOptions options;
    options.plugins = false;
    auto made = ioci::Application::create(std::move(options));
    ASSERT_TRUE(made.ok()) << made.error().sentence();
    app_ = std::move(*made);
    options_.token_file = folder_ / "tokens";
    options_.addresses = {*Address::parse("127.0.0.1:0")};
    options_.browser = true;
  }
  void TearDown() override {
    server_.reset();
    app_.reset();
    fs::remove_all(folder_);
  }
  void start() {
    auto server = Server::start(*app_, options_);
    ASSERT_TRUE(server.ok()) << server.error().sentence();
    server_ = std::move(*server);
  }
  Address where() const { return server_->addresses().front(); }
  std::string grant(Rights rights) const {
    auto tokens = Tokens::open(options_.token_file);
    const auto secret = tokens->grant(std::move(rights), 0);
    EXPECT_TRUE(secret.ok());
    return *secret;
  }
  std::unique_ptr<ioci::Application> app_;
  ServerOptions options_;
  std::unique_ptr<Server> server_;
  fs::path folder_;
};

TEST_F(WebTest, ThePageComesWithItsPolicyAndNothingElseDoes) {
  start();
  Peer a(where());
  const std::string page = a.get("/", a.host());
  EXPECT_TRUE(page.starts_with("HTTP/1.1 200 OK\r\n"));
  for (const char* field :
       {"X-Content-Type-Options: nosniff\r\n",
        "Content-Security-Policy: default-src 'none'; script-src 'sha256-",
        "frame-ancestors 'none'", "connect-src 'self'", "Cache-Control: no-store\r\n",
        "Connection: close\r\n", "Cross-Origin-Resource-Policy: same-origin\r\n"})
    EXPECT_TRUE(has(page, field)) << field;
  const std::string content = page.substr(page.find("\r\n\r\n") + 4);
  EXPECT_TRUE(has(page, "Content-Length: " + std::to_string(content.size()) + "\r\n"));
  EXPECT_TRUE(has(content, kWebScript));
  EXPECT_FALSE(has(content, "@SCRIPT@"));
  // Whole in itself: nothing is loaded.
  for (const char* outside : {"src=\"", "@import", "<link rel=\"stylesheet"})
    EXPECT_FALSE(has(content, outside)) << outside;
  EXPECT_FALSE(has(std::string(kWebStyle), "url("));
  EXPECT_EQ(content.find("</script"), content.rfind("</script"));
  Peer b(where());
  EXPECT_TRUE(has(b.get("/robomosp.js", b.host()), "text/javascript"));
  for (const char* none :
       {"/index.html", "/../etc/passwd", "//", "/?", "/%2e%2e/", "/robomosp.js/"}) {
    Peer c(where());
    EXPECT_TRUE(c.get(none, c.host()).starts_with("HTTP/1.1 404 ")) << none;
  }
  Peer d(where());
  EXPECT_TRUE(d.get("/", "evil.example").starts_with("HTTP/1.1 421 "));
  Peer e(where());
  EXPECT_TRUE(e.get("/socket", e.host()).starts_with("HTTP/1.1 426 "));
  for (const char* method : {"POST", "HEAD", "OPTIONS", "CONNECT"}) {
    Peer f(where());
    EXPECT_TRUE(f.send(method + " / HTTP/1.1\r\nHost: "s + f.host() + "\r\n\r\n"));
    EXPECT_EQ(f.rest(), "") << method;
  }
}

TEST_F(WebTest, WithoutTheSettingBrowsersAreClosedWithoutAWord) {
  options_.browser = false;
  start();
  Peer a(where());
  EXPECT_EQ(a.get("/", a.host()), "");
  options_.origins = {"https://x.example"};
  EXPECT_FALSE(Server::start(*app_, options_).ok());
}

TEST_F(WebTest, OnlyOwnPagesConnectAndOnlyByARightHandshake) {
  options_.origins = {"https://robots.example"};
  options_.audit = folder_ / "audit";
  start();
  const auto status = [this](const std::string& request) {
    Peer p(where());
    EXPECT_TRUE(p.send(request));
    const std::string said = p.rest();
    return said.size() > 12 ? said.substr(9, 3) : said;
  };
  const std::string host = Peer(where()).host();
  for (const char* wrong : {"http://evil.example", "null", "http://127.0.0.1:1", "file://",
                            "http://localhost", "https://robots.example.evil.example"})
    EXPECT_EQ(status(handshake(host, "Origin: "s + wrong + "\r\n")), "403") << wrong;
  EXPECT_EQ(status(handshake("evil.example", "Origin: http://evil.example\r\n")), "421");
  EXPECT_EQ(
      status(handshake(host, "Origin: http://" + host + "\r\nOrigin: http://evil.example\r\n")),
      "400");
  std::string old = handshake(host);
  old.replace(old.find("Version: 13"), 11, "Version: 8\r");
  EXPECT_EQ(status(old), "400");  // a lone CR
  old = handshake(host);
  old.replace(old.find("Version: 13"), 11, "Version: 08");
  EXPECT_EQ(status(old), "426");
  old = handshake(host);
  old.replace(old.find(kKey), 4, "####");
  EXPECT_EQ(status(old), "400");
  EXPECT_EQ(status(handshake(host) + frame(1, "early")), "400");
  for (const std::string& own : {"http://" + host, "https://robots.example"s}) {
    Peer p(where());
    EXPECT_TRUE(p.upgrade("Origin: " + own + "\r\n")) << own;
    EXPECT_TRUE(has(p.hello(), "\"result\""));
  }
  // Who was refused can be looked up.
  std::ifstream in(folder_ / "audit");
  const std::string audit((std::istreambuf_iterator<char>(in)), {});
  for (const char* said : {R"("method":"http","result":"403")", R"("method":"http","result":"421")",
                           R"("method":"http","result":"101")"})
    EXPECT_TRUE(has(audit, said)) << said;
}

TEST_F(WebTest, ABrowserWithoutATokenLooksAndWithOneDoesWhatThatMay) {
  const std::string token = grant({.name = "student", .effects = Effect::edits | Effect::reads});
  start();
  Peer a(where());
  ASSERT_TRUE(a.upgrade());
  const std::string hello = a.hello();
  EXPECT_TRUE(has(hello, R"("effects":["reads"])")) << hello;
  EXPECT_TRUE(has(hello, R"("scripts":false)")) << hello;
  EXPECT_TRUE(has(a.call("material.list"), "\"result\""));
  EXPECT_TRUE(has(a.call("material.create", R"({"name":"a","density":1})"), "permission"));
  EXPECT_TRUE(has(a.call("lua.eval", R"({"code":"return 1"})"), "does not run scripts"));
  ASSERT_EQ(server_->clients().size(), 1U);
  EXPECT_EQ(server_->clients().front().protocol, "websocket");
  Peer b(where());
  ASSERT_TRUE(b.upgrade());
  EXPECT_TRUE(has(b.hello(token), R"("token":"student")"));
  EXPECT_TRUE(has(b.call("material.create", R"({"name":"a","density":1})"), "\"result\""));
  // A wrong token is a sentence, then the end.
  Peer c(where());
  ASSERT_TRUE(c.upgrade());
  EXPECT_TRUE(has(c.hello("rmp_wrong"), "permission"));
  EXPECT_EQ(c.next().first, 8U);
  EXPECT_EQ(c.rest(), "");
  // A first message that is none.
  Peer d(where());
  ASSERT_TRUE(d.upgrade());
  d.send(frame(1, "hello"));
  EXPECT_TRUE(has(d.next().second, "error"));
  EXPECT_EQ(d.next().first, 8U);
}

TEST_F(WebTest, EventsPingsAndTheEndGoAsFrames) {
  const std::string token = grant({.name = "student", .effects = Effect::edits | Effect::reads});
  start();
  Peer a(where());
  ASSERT_TRUE(a.upgrade());
  (void)a.hello(token);
  EXPECT_TRUE(has(a.call("server.subscribe", R"({"topics":["change"]})"), "\"result\""));
  a.send(frame(9, "still there"));
  auto [kind, content] = a.next();
  EXPECT_EQ(kind, 10U);
  EXPECT_EQ(content, "still there");
  a.send(frame(1, R"({"jsonrpc":"2.0","method":"material.create",)", false) + frame(9, "") +
         frame(0, R"("params":{"name":"b","density":2}})"));
  EXPECT_EQ(a.next().first, 10U);
  std::tie(kind, content) = a.next();
  EXPECT_EQ(kind, 1U);
  EXPECT_TRUE(has(content, R"("topic":"change")")) << content;
  // The client's end is answered.
  a.send(frame(8, "\x03\xe8"));
  EXPECT_EQ(a.next(), std::pair(8U, "\x03\xe8"s));
  EXPECT_EQ(a.rest(), "");
  // The server's.
  Peer b(where());
  ASSERT_TRUE(b.upgrade());
  (void)b.hello();
  server_.reset();
  std::tie(kind, content) = b.next();
  EXPECT_TRUE(has(content, "server.closing"));
  EXPECT_EQ(b.next().first, 8U);
}

TEST_F(WebTest, BoundsAreThoseOfLines) {
  options_.limits.line = 2000;
  options_.limits.hello_seconds = 1;
  options_.limits.line_seconds = 1;
  start();
  Peer a(where());
  ASSERT_TRUE(a.upgrade());
  (void)a.hello();
  a.send(frame(1, std::string(3000, ' ')));
  EXPECT_TRUE(has(a.next().second, "longer than 2000 bytes"));
  EXPECT_TRUE(has(a.call("material.list"), "\"result\""));
  // A message that is never whole.
  a.send(frame(1, "{", false));
  EXPECT_TRUE(has(a.next().second, "A line took longer"));
  EXPECT_EQ(a.next().first, 8U);
  // A first message that is too long, one that announces a mass, and a slow head.
  Peer b(where());
  ASSERT_TRUE(b.upgrade());
  b.send(frame(1, std::string(70'000, 'x')));
  EXPECT_TRUE(has(b.next().second, "too long"));
  Peer c(where());
  ASSERT_TRUE(c.upgrade());
  c.send("\x81\xff\x7f\xff\xff\xff\xff\xff\xff\xff\x37\xfa\x21\x3d"s);
  EXPECT_TRUE(has(c.next().second, "too long"));
  Peer d(where());
  const auto begin = Clock::now();
  bool is_open = d.send("GET / HTTP/1.1\r\nHost: x\r\nA: ");
  while (is_open && Clock::now() - begin < 10s) {
    is_open = d.send("a");
    std::this_thread::sleep_for(50ms);
  }
  EXPECT_LT(Clock::now() - begin, 9s);
}

/// Some bytes are other ones, gone, or there twice.
std::string mutated(std::string text, std::mt19937& random) {
  for (std::size_t k = 0, m = random() % 4; k < m && !text.empty(); ++k) {
    const std::size_t at = random() % text.size();
    switch (random() % 5) {
      case 0: text[at] = static_cast<char>(random()); break;
      case 1: text.erase(at, random() % 9); break;
      case 2: text.insert(at, text.substr(random() % text.size(), random() % 40)); break;
      case 3: text.insert(at, std::string(1 + random() % 3, "\r\n\x00 :"[random() % 5])); break;
      default: text.insert(at, std::string(random() % 300, static_cast<char>(random()))); break;
    }
  }
  return text;
}

TEST_F(WebTest, WhateverBytesComeToTheDoorsOfHttpAndWebSocketItAnswersOrCutsAndGoesOn) {
  options_.limits.hello_seconds = 2;
  start();
  std::mt19937 random(test::seed());
  const std::string host = Peer(where()).host();
  const std::vector<std::string> requests = {
      "GET / HTTP/1.1\r\nHost: " + host + "\r\n\r\n",
      "GET /robomosp.js HTTP/1.1\r\nHost: " + host + "\r\nCookie: a=b\r\n\r\n",
      handshake(host, "Origin: http://" + host + "\r\n"),
      "GET / HTTP/1.1\r\nHost: " + host +
          "\r\nContent-Length: 30\r\n\r\nGET /robomosp.js HTTP/1.1\r\n\r\n",
      "GET / HTTP/1.1\r\nHost: " + host + "\r\nTransfer-Encoding: chunked\r\n\r\n0\r\n\r\n"};
  const std::vector<std::string> messages = {
      R"({"jsonrpc":"2.0","id":1,"method":"server.hello","params":{"protocol":1,"subscribe":["change"]}})",
      R"({"jsonrpc":"2.0","id":2,"method":"material.list"})",
      R"({"jsonrpc":"2.0","id":2,"method":"view.scene","params":{"what":"x"}})",
      R"([{"jsonrpc":"2.0","id":2,"method":"material.list"},{"jsonrpc":"2.0","method":"job.list"}])",
      R"({"jsonrpc":"2.0","id":2,"method":"server.subscribe","params":{"topics":["run"],"rate":5}})"};
  const char* wish = std::getenv("ROBOMOSP_FUZZ_SECONDS");
  const auto until = Clock::now() + std::chrono::milliseconds(wish ? std::atoi(wish) * 1000 : 2000);
  std::size_t sent = 0, answered = 0;
  while (Clock::now() < until) {
    Peer p(where());
    std::string text;
    const bool is_socket = random() % 2 == 0;
    if (is_socket) {
      if (!p.upgrade()) {
        ADD_FAILURE() << "a right handshake was refused";
        break;
      }
      if (random() % 4) text += frame(1, messages[0]);
      for (std::size_t i = 0, n = random() % 12; i < n; ++i) {
        const std::string& message = messages[random() % messages.size()];
        const std::size_t cut = random() % message.size();
        switch (random() % 6) {
          case 0:
            text += frame(random() % 16, message.substr(0, random() % 130), random() % 4);
            break;
          case 1:
            text += frame(1, message.substr(0, cut), false) + frame(0, message.substr(cut));
            break;
          case 2: text += mutated(frame(1, message), random); break;
          case 3:
            text +=
                frame(1, mutated(message, random), true, random() % 8, (random() % 8 == 0) << 6U);
            break;
          default: text += frame(1, message); break;
        }
      }
    } else {
      text = mutated(requests[random() % requests.size()], random);
    }
    for (std::size_t at = 0; at < text.size();) {
      const std::size_t n = std::min<std::size_t>(1 + random() % 700, text.size() - at);
      if (!p.send(std::string_view(text).substr(at, n))) break;
      at += n;
    }
    sent += text.size();
    if (random() % 2) answered += p.more(3ms);
  }
  std::cout << sent << " bytes, " << answered << " answers looked at\n";
  Peer a(where());
  ASSERT_TRUE(a.upgrade());
  EXPECT_TRUE(has(a.hello(), "\"result\""));
  EXPECT_TRUE(has(a.call("material.list"), "\"result\""));
  Peer b(where());
  EXPECT_TRUE(b.get("/", b.host()).starts_with("HTTP/1.1 200 "));
  // Nothing was edited by who may not.
  EXPECT_EQ(app_->document.now()->revision(), 0U);
}

}  // namespace
}  // namespace robomosp::remote
