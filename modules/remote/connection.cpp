// SPDX-License-Identifier: Apache-2.0
#include "remote/connection.h"

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <utility>

#include <asio/error_code.hpp>
#include <asio/post.hpp>

#include "ioci/core/secrets.h"
#include "ioci/simulation/live_runs.h"
#include "kernel/text.h"
#include "remote/json.h"
#include "remote/lua_thread.h"

#ifndef ROBOMOSP_VERSION
#define ROBOMOSP_VERSION "0"
#endif

namespace robomosp::remote {
namespace {

using namespace std::chrono_literals;

/// Longest line of who has not said hello [bytes].
constexpr std::size_t kLongestHello = 65'536;
constexpr std::size_t kLongestClientName = 64;
/// How long requests of one client are answered before others have their turn.
constexpr auto kTurn = 2ms;
/// How long a client has to take what was said before its connection was closed.
constexpr auto kConnectionGoodbye = 2s;
/// How often a cancelled request is told so again.
constexpr auto kConnectionAgain = 20ms;
/// Most values of a run's rows that one event takes.
constexpr std::size_t kRowValues = 20'000;
/// Bytes that are read before others have their turn.
constexpr std::size_t kReadTurn = std::size_t{256} << 10;

/// Whether a first line begins as a request of HTTP: a browser may have been made to send it.
bool is_http(std::string_view text) {
  static constexpr std::string_view kMethods[] = {"GET ",   "POST ",     "PUT ",     "HEAD ",
                                                  "PATCH ", "DELETE ",   "OPTIONS ", "CONNECT ",
                                                  "TRACE ", "PRI * HTTP"};
  return std::any_of(std::begin(kMethods), std::end(kMethods),
                     [&](std::string_view m) { return text.starts_with(m); });
}

/// A name that lists and messages can show.
std::string shown_name(std::string_view given) {
  std::string out;
  for (const char c : text::visible(given)) {
    if (out.size() >= kLongestClientName) break;
    out += c == '\n' ? ' ' : c;
  }
  while (!out.empty() && (static_cast<unsigned char>(out.back()) & 0xC0U) == 0x80U)
    out.pop_back();  // a character that was cut
  return out;
}

/// What is let through while memory is short: reading, and what makes room.
bool is_light(const ioci::Application& app, std::string_view method) {
  if (method == "lua.eval" || method == "ioci.classic") return false;
  const ioci::CommandSpec* spec = app.commands.find(method);
  return !spec || spec->effect == Effect::reads || method.ends_with(".remove") ||
         method.ends_with(".delete") || method.starts_with("document.clear") ||
         method.starts_with("job.");
}

Map brief(const Map& params) {
  constexpr std::size_t kLongest = 200, kMost = 16;
  Map out;
  for (const auto& [key, value] : params) {
    if (out.size() >= kMost) break;
    const std::string* word = value.as_string();
    if (word) out.append(key, word->size() <= kLongest ? *word : word->substr(0, kLongest) + "...");
    else if (value.is_number() || value.as_bool() || value.as_handle()) out.append(key, value);
    else out.append(key, "(" + std::string(value.type_name()) + ")");
  }
  return out;
}

}  // namespace

/// The session of a client and what answers it.
struct Connection::Talk {
  Talk(Connection& owner, ioci::Application& app, const std::string& name, Rights may)
      : hall(owner.hall_),
        rights(std::move(may)),
        session(name, ioci::SessionKind::connection),
        lua(app, session, is_granted(rights, "lua.eval")),
        server(app, session, options(owner, *this)),
        conversation(app, prepared(app, session, rights), server,
                     {.say = [&owner](std::string text) { owner.send(std::move(text)); },
                      .ready = {},
                      .most_waits = owner.hall_.options.limits.waits,
                      .after =
                          [&owner](double seconds, std::function<void()> fn) {
                            return owner.after(seconds, std::move(fn));
                          }}) {}

  ~Talk() {
    tell_gone();
    if (has_script) --hall.scripts;
  }
  static bool is_granted(const Rights& rights, std::string_view command) {
    return std::find(rights.commands.begin(), rights.commands.end(), command) !=
           rights.commands.end();
  }
  static ioci::Session& prepared(ioci::Application& app, ioci::Session& session,
                                 const Rights& rights) {
    if (!rights.folder.empty()) {
      auto root = app.file_root(rights.folder);
      if (root.ok()) session.confine(std::move(*root));
      else session.deny(Effect::files_read | Effect::files_write);  // admit() said so
    }
    session.deny(Effects::all().without(rights.effects | Effect::reads));
    for (const std::string& command : rights.commands) session.grant(command);
    return session;
  }
  static RpcOptions options(Connection& owner, Talk& self) {
    const Limits& limits = owner.hall_.options.limits;
    RpcOptions o;
    // In a browser scripts need a token.
    if (!owner.web_ || !self.rights.name.empty())
      o.evaluate = [&owner, &self, &limits](const std::string& code) -> Result<Map> {
        if (!self.has_script) {
          if (owner.hall_.scripts.fetch_add(1) >= limits.scripts) {
            --owner.hall_.scripts;
            return error(ErrorCode::conflict,
                         std::to_string(limits.scripts) + " clients already run scripts",
                         "Wait until one of them disconnects.", "lua.eval");
          }
          self.has_script = true;
        }
        return self.lua.eval(code);
      };
    o.methods["server.subscribe"] = [&owner](const Map& p) { return owner.subscribe(p); };
    o.methods["server.unsubscribe"] = [&owner](const Map& p) { return owner.unsubscribe(p); };
    o.methods["server.hello"] = [](const Map&) -> Result<Value> {
      return error(ErrorCode::conflict, "server.hello was already sent");
    };
    o.methods["server.bye"] = [&owner](const Map&) -> Result<Value> {
      owner.is_leaving_ = true;
      return Value(true);
    };
    o.admit = [&owner, &self](std::string_view method) -> std::optional<Error> {
      if (auto refusal = owner.admitted(self.rights.rate)) return refusal;
      const std::uint64_t size = self.hall.too_large;
      if (size == 0 || is_light(self.hall.app, method)) return std::nullopt;
      return error(ErrorCode::conflict,
                   "the program takes " + std::to_string(size) + " MiB; at most " +
                       std::to_string(self.hall.options.limits.memory) + " are allowed",
                   "Wait for running commands, or remove unneeded data; reading remains possible.",
                   std::string(method));
    };
    o.job_started = owner.hall_.job_started;
    if (owner.hall_.audit)
      o.audit = [&owner, &self](std::string_view method, const Map* params,
                                const Result<Value>& result) {
        Map line{{"client", static_cast<std::int64_t>(owner.number_)},
                 {"name", self.session.name()},
                 {"token", self.rights.name},
                 {"peer", owner.peer_},
                 {"method", text::shortened(std::string(method))}};
        if (params && !params->empty())
          line.append("params", brief(ioci::without_secrets(*params)));
        line.append("result", result.ok() ? "ok" : std::string(to_string(result.error().code)));
        owner.hall_.audit(std::move(line));
      };
    o.explain = [&owner, &limits](Error e) {
      const Ended why =
          e.code == ErrorCode::cancelled ? owner.ended_.exchange(Ended::no) : Ended::no;
      if (why == Ended::no) return e;
      if (why == Ended::memory)
        return error(ErrorCode::cancelled,
                     "it was cancelled, since the program took more than " +
                         std::to_string(limits.memory) + " MiB",
                     "Do less at a time.");
      return error(
          ErrorCode::cancelled,
          "it was cancelled, since it took longer than " + std::to_string(limits.seconds) + " s",
          "Start it as a job: \"job\": true beside \"method\".");
    };
    o.longest_line = limits.line;
    o.longest_batch = limits.batch;
    o.longest_answer = limits.answer;
    o.most_jobs = limits.jobs;
    return o;
  }

  void tell_came() {
    is_told_gone = false;
    waits->client_came(client);
    if (rights.name != client) waits->client_came(rights.name);
  }
  void tell_gone() {
    if (is_told_gone.exchange(true)) return;
    waits->client_gone(client);
    if (rights.name != client) waits->client_gone(rights.name);
  }

  Hall& hall;
  const std::shared_ptr<SignalWaits> waits = SignalWaits::of(hall.app);
  std::atomic<bool> is_told_gone{true};  ///< to `waits`
  const Rights rights;
  bool has_script = false;  ///< counted in the hall
  std::string client;       ///< as it calls itself
  ioci::Session session;
  LuaThread lua;
  RpcServer server;
  Conversation conversation;
};

Connection::Connection(Hall& hall, std::uint64_t number, Socket socket, std::string peer,
                       bool needs_token, std::shared_ptr<TlsContext> tls)
    : hall_(hall),
      number_(number),
      peer_(std::move(peer)),
      needs_token_(needs_token),
      lines_(kLongestHello),
      last_in_(begin_.time_since_epoch().count()),
      last_out_(begin_.time_since_epoch().count()),
      socket_(std::move(socket)),
      goodbye_(kConnectionGoodbye) {
  if (tls) tls_ = std::make_unique<TlsStream>(std::move(tls));
}

Connection::~Connection() {
  const Reactor::Running running(hall_.reactor);  // its jobs may take a while to end
  for (const auto& [number, s] : subscriptions_) {
    hall_.app.events.unsubscribe(s.all);
    hall_.app.events.unsubscribe(s.runs);
  }
  talk_.reset();
}

void Connection::start() {
  {
    const std::lock_guard lock(mutex_);
    asio::error_code ec;
    socket_.non_blocking(true, ec);
    const int one = 1, idle = 60, every = 15, times = 4;
    const int fd = socket_.native_handle();
    // A peer that vanished is noticed after two minutes. Of no use on a Unix socket, and no harm.
    (void)::setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &one, sizeof one);
    (void)::setsockopt(fd, SOL_SOCKET, SO_KEEPALIVE, &one, sizeof one);
    (void)::setsockopt(fd, IPPROTO_TCP, TCP_KEEPIDLE, &idle, sizeof idle);
    (void)::setsockopt(fd, IPPROTO_TCP, TCP_KEEPINTVL, &every, sizeof every);
    (void)::setsockopt(fd, IPPROTO_TCP, TCP_KEEPCNT, &times, sizeof times);
  }
  wait_readable();
}

// --- reading: one thread at a time, as the next wait begins when it is done ---

void Connection::wait_readable() {
  const std::lock_guard lock(mutex_);
  if (is_shut_) return;
  socket_.async_wait(Socket::wait_read, [self = shared_from_this()](const asio::error_code& ec) {
    if (!ec) self->on_readable();
    else self->shut();
  });
}

void Connection::on_readable() {
  static thread_local std::array<char, 65'536> piece;
  std::string plain;
  bool go_on = true;
  for (std::size_t read = 0; go_on && read < kReadTurn;) {
    ssize_t got = 0;
    {
      const std::lock_guard lock(mutex_);
      if (is_shut_) return;
      got = ::recv(socket_.native_handle(), piece.data(), piece.size(), MSG_DONTWAIT);
    }
    if (got < 0 && errno == EINTR) continue;
    if (got < 0 && (errno == EAGAIN || errno == EWOULDBLOCK)) break;
    if (got <= 0) return shut();
    read += static_cast<std::size_t>(got);
    bytes_in_ += static_cast<std::uint64_t>(got);
    last_in_ = Clock::now().time_since_epoch().count();
    const std::string_view bytes(piece.data(), static_cast<std::size_t>(got));
    if (!tls_) {
      go_on = received(bytes);
      continue;
    }
    plain.clear();
    bool is_over = false;
    {
      const std::lock_guard lock(mutex_);
      const auto fed = tls_->feed(bytes, [&](std::string_view text) { plain += text; });
      out_ += tls_->output();
      flush_locked();
      is_over = !fed.ok() || tls_->is_closed();
    }
    go_on = plain.empty() || received(plain);
    if (is_over) return shut();
    if (static_cast<std::size_t>(got) < piece.size()) break;
  }
  line_begin_ =
      lines_.is_within() || (web_ && web_->is_within())
          ? (line_begin_.load() ? line_begin_.load() : Clock::now().time_since_epoch().count())
          : 0;
  if (!go_on) return;
  if (has_talk_) {
    const Limits& limits = hall_.options.limits;
    if (talk_->conversation.waiting() >= limits.waiting ||
        talk_->conversation.waiting_bytes() >= limits.waiting_bytes)
      is_paused_ = true;
  }
  if (!is_paused_) wait_readable();
  drain();
}

bool Connection::received(std::string_view plain) {
  if (is_first_ && !plain.empty()) {
    is_first_ = false;
    const auto first = static_cast<unsigned char>(plain.front());
    // GET: no line of ours begins so.
    if (hall_.web && first == 'G')
      web_ = std::make_unique<WebDoor>(*hall_.web, tls_ != nullptr, kLongestHello);
    // A browser, TLS where there is none, or no text at all: nothing is said to that.
    if (!web_ && (is_http(plain) || first < 0x09 || first == 0x16 || first >= 0x80)) {
      shut();
      return false;
    }
    is_classic_ = !web_ && first != '{' && first != '[';
  }
  if (web_) return received_from_web(plain);
  return lines_.feed(
      plain, [this](std::string_view text) { return line(text); }, [this] { return too_long(); });
}

bool Connection::received_from_web(std::string_view plain) {
  const bool is_new = web_->status() == 0;
  const bool go_on =
      web_->feed(plain, {.line = [this](std::string_view text) { return line(text); },
                         .too_long = [this] { return too_long(); },
                         .send =
                             [this](std::string bytes) {
                               // Who sends pings and reads nothing gets no more pongs.
                               if (unread() < hall_.options.limits.unread)
                                 send_bytes(std::move(bytes));
                             }});
  if (hall_.audit && is_new && web_->status() != 0)
    hall_.audit(Map{{"client", static_cast<std::int64_t>(number_)},
                    {"peer", peer_},
                    {"method", "http"},
                    {"result", std::to_string(web_->status())}});
  if (go_on) {
    is_web_ = web_->is_socket();
    return true;
  }
  if (is_closing_) return false;  // what runs is answered first
  is_closing_ = true;
  const std::lock_guard lock(mutex_);
  // A page may be read slowly; of a WebSocket the last frame was sent.
  if (!is_web_.exchange(false))
    goodbye_ = std::chrono::seconds(static_cast<std::int64_t>(hall_.options.limits.unread_seconds));
  end_locked();
  return false;
}

bool Connection::too_long() {
  if (has_talk_) {
    talk_->conversation.take_too_long();
    return true;
  }
  return refuse(RpcServer::failure({}, error(ErrorCode::permission, "the first line is too long")),
                "the first line is too long");
}

bool Connection::line(std::string_view text) {
  if (is_closing_) return false;
  if (!has_talk_) {
    text = text::trim(text);
    if (text.empty()) return true;
    return is_classic_ ? hello_classic(text) : hello(text);
  }
  if (is_classic_) {
    talk_->conversation.take_classic(text);
    return true;
  }
  talk_->conversation.take(text);
  if (talk_->conversation.cancel_again()) {
    auto timer = std::make_shared<asio::steady_timer>(hall_.reactor.io());
    auto again = std::make_shared<std::function<void()>>();
    *again = [self = shared_from_this(), timer, weak = std::weak_ptr(again)] {
      timer->expires_after(kConnectionAgain);
      timer->async_wait([self, keep = weak.lock()](const asio::error_code& ec) {
        if (!ec && !self->is_closing_ && self->talk_->conversation.cancel_again() && keep)
          (*keep)();
      });
    };
    (*again)();
  }
  return true;
}

bool Connection::refuse(const std::string& answer, const std::string& why) {
  if (hall_.audit)
    hall_.audit(Map{{"client", static_cast<std::int64_t>(number_)},
                    {"peer", peer_},
                    {"method", "server.hello"},
                    {"result", why}});
  send(answer);
  is_closing_ = true;
  const std::lock_guard lock(mutex_);
  end_locked();
  return false;
}

bool Connection::hello(std::string_view text) {
  const auto message = from_json(text);
  const auto say_no = [&](const Value& id, const Error& e) {
    return refuse(RpcServer::failure(id, e), std::string(to_string(e.code)));
  };
  if (!message.ok()) return refuse(RpcServer::not_json(message.error()), "syntax");
  const Map* m = message->as_map();
  const Value* method = m ? m->find("method") : nullptr;
  const Value* id = m ? m->find("id") : nullptr;
  const Value* params = m ? m->find("params") : nullptr;
  const Value own_id = id && (id->is_number() || id->as_string()) ? *id : Value();
  if (!method || !method->as_string() || *method->as_string() != "server.hello")
    return say_no(own_id, error(ErrorCode::usage,
                                "the first line of a connection must be a request of server.hello",
                                R"(Send {"jsonrpc": "2.0", "id": 1, "method": "server.hello", )"
                                R"("params": {"protocol": 1}}.)"));
  static const Map kNone;
  const Map& given = params && params->as_map() ? *params->as_map() : kNone;
  std::string secret, client;
  const Value* wanted = nullptr;
  const Value* protocol = nullptr;
  for (const auto& [name, value] : given) {
    const std::string* word = value.as_string();
    if (name == "protocol") {
      protocol = &value;
    } else if (name == "token" && word) {
      secret = *word;
    } else if (name == "client" && word) {
      client = shown_name(*word);
    } else if (name == "subscribe") {
      wanted = &value;
    } else if (name == "token" || name == "client") {
      if (!value.is_nil())
        return say_no(own_id,
                      error(ErrorCode::invalid_argument, name + " is a text", "", "server.hello"));
    } else {
      return say_no(own_id, error(ErrorCode::unknown_name,
                                  "server.hello has no parameter " +
                                      text::quote(text::shortened(std::string(name))),
                                  "Its parameters are protocol, token, client and subscribe."));
    }
  }
  if (!protocol || !protocol->as_int())
    return say_no(
        own_id,
        error(ErrorCode::invalid_argument, "protocol is needed: the protocol version of the client",
              "This server speaks version " + std::to_string(kProtocol) + ".", "server.hello"));
  if (*protocol->as_int() != kProtocol)
    return say_no(
        own_id,
        error(ErrorCode::unsupported,
              "the client speaks version " + std::to_string(*protocol->as_int()) +
                  " of the protocol and this server (robomosp " ROBOMOSP_VERSION ") version " +
                  std::to_string(kProtocol),
              *protocol->as_int() > kProtocol ? "Use a newer server or an older client."
                                              : "Use a newer client."));
  return admit(secret, client, own_id, wanted);
}

bool Connection::hello_classic(std::string_view text) {
  const auto space = text.find(' ');
  const std::string_view word = text.substr(0, space);
  const std::string_view secret =
      space == std::string_view::npos ? std::string_view() : text::trim(text.substr(space));
  if (word != "hello")
    return refuse("error usage The first line must be: hello, or hello TOKEN.", "usage");
  return admit(std::string(secret), "", {}, nullptr);
}

bool Connection::admit(const std::string& secret, const std::string& client, Value id,
                       const Value* wanted) {
  const auto say_no = [&](const Error& e) {
    return refuse(is_classic_ ? "error " + std::string(to_string(e.code)) + " " + e.sentence()
                              : RpcServer::failure(id, e),
                  std::string(to_string(e.code)));
  };
  Rights rights = hall_.options.without_token;
  // Whoever looks over the shoulder of a browser may look only.
  if (web_) rights.effects = Effect::reads, rights.commands.clear();
  if (!secret.empty()) {
    auto token = hall_.tokens.find(secret);
    if (!token.ok()) return say_no(token.error());
    rights = std::move(token->rights);
  } else if (needs_token_) {
    return say_no(
        error(ErrorCode::permission, "this server requires a token",
              "Get one from the server's administrator (server.grant), and send it with hello."));
  }
  if (!rights.folder.empty())
    if (auto root = hall_.app.file_root(rights.folder); !root.ok()) return say_no(root.error());
  std::string name = "client " + std::to_string(number_);
  if (!rights.name.empty()) name += " (" + rights.name + ")";
  else if (!client.empty()) name += " (" + client + ")";
  talk_ = std::make_unique<Talk>(*this, hall_.app, name, std::move(rights));
  talk_->client = client;
  talk_->tell_came();
  lines_.set_longest(hall_.options.limits.line);
  if (web_) web_->set_longest(hall_.options.limits.line);
  {
    const std::lock_guard lock(mutex_);
    refilled_ = Clock::now();
    const std::uint64_t rate = talk_->rights.rate ? talk_->rights.rate : hall_.options.limits.rate;
    tokens_left_ = static_cast<double>(rate);
  }
  has_talk_ = true;
  if (hall_.audit)
    hall_.audit(Map{{"client", static_cast<std::int64_t>(number_)},
                    {"name", talk_->session.name()},
                    {"token", talk_->rights.name},
                    {"peer", peer_},
                    {"method", "server.hello"},
                    {"result", "ok"}});
  if (is_classic_) {
    send("ok robomosp " ROBOMOSP_VERSION);
    return true;
  }
  List effects, commands;
  for (const Effect e : (talk_->rights.effects | Effect::reads).list())
    effects.emplace_back(to_string(e));
  for (const std::string& c : talk_->rights.commands) commands.emplace_back(c);
  Map limits;
  for (const char* shown : {"line", "batch", "answer", "rate", "jobs", "seconds"})
    limits.append(shown, *limits_value(hall_.options.limits).find(shown));
  if (talk_->rights.rate) limits.set("rate", static_cast<std::int64_t>(talk_->rights.rate));
  limits.append("depth", kDeepestJson);
  Map result{{"program", "robomosp"},
             {"version", ROBOMOSP_VERSION},
             {"protocol", kProtocol},
             {"instance", hall_.instance},
             {"client", static_cast<std::int64_t>(number_)},
             {"session", static_cast<std::int64_t>(hall_.app.author(talk_->session).session)},
             {"effects", std::move(effects)},
             {"commands", std::move(commands)},
             {"scripts", !web_ || !talk_->rights.name.empty()},
             {"limits", std::move(limits)}};
  if (!talk_->rights.name.empty()) result.append("token", talk_->rights.name);
  if (!talk_->rights.folder.empty()) result.append("folder", talk_->rights.folder.string());
  if (wanted && !wanted->is_nil()) {
    auto subscription = subscribe(wanted->as_map() ? *wanted->as_map() : Map{{"topics", *wanted}});
    if (!subscription.ok()) return say_no(std::move(subscription).error().in("subscribe"));
    result.append("subscription", std::move(*subscription));
  }
  if (!id.is_nil()) send(talk_->server.success(id, Value(std::move(result))));
  return true;
}

// --- answering ---

/// Answers what waits, unless another thread does so already.
void Connection::drain() {
  if (!has_talk_) return;
  for (;;) {
    if (is_draining_.exchange(true)) return;
    bool has_more = false;
    {
      const Reactor::Running running(hall_.reactor);
      const auto begin = Clock::now();
      while (!is_closing_ && unread() < hall_.options.limits.unread) {
        ended_ = Ended::no;
        if (!talk_->conversation.run_next()) break;
        if (is_leaving_) {
          is_closing_ = true;
          break;
        }
        if (Clock::now() - begin > kTurn && talk_->conversation.has_next()) {
          has_more = true;
          break;
        }
      }
    }
    if (is_paused_ && !is_closing_ &&
        talk_->conversation.waiting() <= hall_.options.limits.waiting / 2 &&
        talk_->conversation.waiting_bytes() <= hall_.options.limits.waiting_bytes / 2 &&
        is_paused_.exchange(false))
      wait_readable();
    is_draining_ = false;
    if (is_closing_) {
      const std::lock_guard lock(mutex_);
      end_locked();
      return;
    }
    if (has_more) {
      asio::post(hall_.reactor.io(), [self = shared_from_this()] { self->drain(); });
      return;
    }
    // What came after the last look and before the flag was taken back.
    if (!talk_->conversation.has_next() || unread() >= hall_.options.limits.unread) return;
  }
}

/// `own`: the rate of the client's token, 0 = the server's. Also while the connection ends.
std::optional<Error> Connection::admitted(std::uint64_t own) {
  ++requests_;
  const std::uint64_t rate = own ? own : hall_.options.limits.rate;
  if (rate == 0) return std::nullopt;
  const std::lock_guard lock(mutex_);
  const auto now = Clock::now();
  const double most = static_cast<double>(rate);
  tokens_left_ =
      std::min(most, tokens_left_ + most * std::chrono::duration<double>(now - refilled_).count());
  refilled_ = now;
  if (tokens_left_ < 1)
    return error(ErrorCode::conflict,
                 "more than " + std::to_string(rate) + " requests per second were received",
                 "Wait a moment and send it again.");
  tokens_left_ -= 1;
  return std::nullopt;
}

// --- sending ---

std::size_t Connection::unread() const {
  const std::lock_guard lock(mutex_);
  return out_.size() - sent_;
}

void Connection::send(std::string text) {
  if (is_web_) text = websocket_text(text);
  else text += '\n';
  send_bytes(std::move(text));
}

void Connection::send_bytes(std::string text) {
  const std::lock_guard lock(mutex_);
  if (is_shut_ || is_ending_) return;
  if (tls_) {
    (void)tls_->write(text);
    out_ += tls_->output();
  } else if (out_.empty()) {
    out_ = std::move(text);
  } else {
    out_ += text;
  }
  flush_locked();
}

void Connection::flush_locked() {
  if (is_shut_) return;
  while (sent_ < out_.size()) {
    const ssize_t n = ::send(socket_.native_handle(), out_.data() + sent_, out_.size() - sent_,
                             MSG_DONTWAIT | MSG_NOSIGNAL);
    if (n < 0 && errno == EINTR) continue;
    if (n > 0) {
      sent_ += static_cast<std::size_t>(n);
      bytes_out_ += static_cast<std::uint64_t>(n);
      last_out_ = Clock::now().time_since_epoch().count();
      stuck_since_ = {};
      continue;
    }
    if (n < 0 && (errno == EAGAIN || errno == EWOULDBLOCK)) {
      if (stuck_since_ == Clock::time_point()) stuck_since_ = Clock::now();
      if (std::exchange(waits_writable_, true)) return;
      socket_.async_wait(
          Socket::wait_write, [self = shared_from_this()](const asio::error_code& ec) {
            if (ec) return self->shut();
            {
              const std::lock_guard lock(self->mutex_);
              self->waits_writable_ = false;
              self->flush_locked();
              if (self->out_.size() - self->sent_ >= self->hall_.options.limits.unread / 2) return;
            }
            self->push_all();
            self->drain();
          });
      return;
    }
    // The peer is gone; the reader notices, too.
    out_.clear();
    sent_ = 0;
    asio::post(hall_.reactor.io(), [self = shared_from_this()] { self->shut(); });
    return;
  }
  out_.clear();
  sent_ = 0;
  if (out_.capacity() > 4096) std::string().swap(out_);
  if (is_ending_) asio::post(hall_.reactor.io(), [self = shared_from_this()] { self->shut(); });
}

// --- events ---

Result<Value> Connection::subscribe(const Map& params) {
  Map args = params;
  Subscription s;
  double rate = ioci::kUsualRate;
  if (const Value* given = params.find("rate")) {
    rate = given->number();
    if (!given->is_number() || !(rate >= 1e-3) || rate > ioci::kHighestRate)
      return error(ErrorCode::invalid_argument,
                   "rate must be a number of states per second, from 0.001 to 1000", "", "rate");
    args.erase("rate");
  }
  if (const Value* given = params.find("rows")) {
    const bool* flag = given->as_bool();
    const List* names = given->as_list();
    bool is_right = flag || names;
    if (flag) s.with_rows = *flag;
    if (names) {
      s.with_rows = true;
      for (const Value& name : *names) {
        is_right = is_right && name.as_string();
        if (name.as_string()) s.columns.push_back(*name.as_string());
      }
    }
    if (!is_right)
      return error(ErrorCode::invalid_argument, "rows must be true or a list of column names", "",
                   "rows");
    args.erase("rows");
  }
  if (const Value* given = params.find("arrays")) {
    const std::string word = given->as_string() ? *given->as_string() : std::string();
    if (word != "numbers" && word != "base64")
      return error(ErrorCode::invalid_argument, R"(arrays is "numbers" or "base64")", "", "arrays");
    if (word == "base64") s.arrays = Arrays::base64;
    args.erase("arrays");
  }
  {
    const std::lock_guard lock(mutex_);
    if (subscriptions_.size() >= hall_.options.limits.subscriptions)
      return error(
          ErrorCode::conflict,
          std::to_string(subscriptions_.size()) + " subscriptions of this connection already exist",
          "End one with server.unsubscribe.");
  }
  // States of runs and what becomes of recordings are sent at their rate, all else at once.
  List others, paced;
  const auto is_paced = [](std::string_view topic) {
    return topic == to_string(ioci::Topic::run) || topic == to_string(ioci::Topic::recording);
  };
  if (const Value* topics = args.find("topics"); topics && topics->as_list()) {
    for (const Value& topic : *topics->as_list())
      (topic.as_string() && is_paced(*topic.as_string()) ? paced : others).push_back(topic);
  } else if (topics && !topics->is_nil()) {
    return error(ErrorCode::invalid_argument, "topics must be a list of words", "", "topics");
  } else {
    for (const ioci::Topic t : ioci::kAllTopics)
      (is_paced(to_string(t)) ? paced : others).emplace_back(to_string(t));
  }
  ioci::Application& app = hall_.app;
  const auto make = [&](List topics) -> Result<std::uint64_t> {
    Map own = args;
    own.set("topics", std::move(topics));
    RMP_TRY_ASSIGN(const Value token, app.dispatch(talk_->session, "event.subscribe", own));
    return static_cast<std::uint64_t>(*token.as_int());
  };
  if (s.with_rows && paced.empty())
    return error(ErrorCode::invalid_argument, "rows need the topic run or recording",
                 "Add one to topics.", "rows");
  if (!others.empty() || paced.empty()) {
    RMP_TRY_ASSIGN(s.all, make(std::move(others)));
  }
  if (!paced.empty()) {
    args.set("rate", rate);
    RMP_TRY_ASSIGN(s.runs, make(std::move(paced)));
  }
  s.every = std::chrono::nanoseconds(static_cast<std::int64_t>(1e9 / rate));
  const std::uint64_t all = s.all, runs = s.runs;
  std::uint64_t number = 0;
  {
    const std::lock_guard lock(mutex_);
    number = next_subscription_++;
    subscriptions_.emplace(number, s);
  }
  const auto wake = [weak = weak_from_this(), number] {
    if (auto self = weak.lock())
      asio::post(self->hall_.reactor.io(), [self, number] { self->push(number); });
  };
  if (all) app.events.set_wake(all, wake);
  if (runs) app.events.set_wake(runs, wake);
  return Value(static_cast<std::int64_t>(number));
}

Result<Value> Connection::unsubscribe(const Map& params) {
  const Value* given = params.find("subscription");
  const std::int64_t* number = given ? given->as_int() : nullptr;
  if (!number || params.size() != 1)
    return error(ErrorCode::invalid_argument, "it needs the number of a subscription",
                 "Send {\"subscription\": 1}.");
  Subscription s;
  {
    const std::lock_guard lock(mutex_);
    const auto at = subscriptions_.find(static_cast<std::uint64_t>(*number));
    if (at == subscriptions_.end())
      return error(ErrorCode::unknown_name,
                   "there is no subscription " + std::to_string(*number) + " of this connection",
                   "Create one with server.subscribe.");
    s = at->second;
    subscriptions_.erase(at);
  }
  hall_.app.events.unsubscribe(s.all);
  hall_.app.events.unsubscribe(s.runs);
  const std::lock_guard alone(push_mutex_);
  rows_.erase(static_cast<std::uint64_t>(*number));
  recording_rows_.erase(static_cast<std::uint64_t>(*number));
  return Value(true);
}

/// Sends what waits for a subscription, as far as the client reads it.
void Connection::push(std::uint64_t number) {
  constexpr std::size_t kTogether = 64;
  const std::lock_guard alone(push_mutex_);
  Subscription s;
  {
    const std::lock_guard lock(mutex_);
    const auto at = subscriptions_.find(number);
    if (at == subscriptions_.end() || is_shut_) return;
    s = at->second;
  }
  ioci::Application& app = hall_.app;
  const std::size_t most = hall_.options.limits.unread / 2;
  if (s.all)
    while (unread() < most) {  // else when it was read, from flush_locked()
      const auto events = app.events.take(s.all, kTogether);
      if (!events.ok() || events->empty()) break;
      for (const ioci::Event& e : *events) send_event(number, ioci::event_value(e));
    }
  if (!s.runs || unread() >= most) return;
  const auto now = Clock::now();
  if (now - s.last < s.every) {
    {
      const std::lock_guard lock(mutex_);
      const auto at = subscriptions_.find(number);
      if (at == subscriptions_.end() || std::exchange(at->second.is_waiting, true)) return;
    }
    auto timer = std::make_shared<asio::steady_timer>(hall_.reactor.io(), s.last + s.every);
    timer->async_wait([self = shared_from_this(), timer, number](const asio::error_code& ec) {
      if (ec) return;
      {
        const std::lock_guard lock(self->mutex_);
        const auto at = self->subscriptions_.find(number);
        if (at != self->subscriptions_.end()) at->second.is_waiting = false;
      }
      self->push(number);
    });
    return;
  }
  if (!push_runs(number, s)) return;
  const std::lock_guard lock(mutex_);
  if (const auto at = subscriptions_.find(number); at != subscriptions_.end())
    at->second.last = now;
}

/// Sends of each run the last state, what became of recordings, and the rows that are new; false
/// when there was none.
bool Connection::push_runs(std::uint64_t number, const Subscription& s) {
  const auto states = hall_.app.events.take(s.runs, 100'000);
  if (!states.ok()) return false;
  std::map<std::uint64_t, const ioci::Event*> last;
  bool has_sent = false;
  for (const ioci::Event& e : *states)
    if (e.run) {
      last[e.run->run] = &e;
    } else if (e.recording) {
      send_recording(number, s, e);
      has_sent = true;
    }
  // Rows that did not go all at once wait here until the client has read.
  if (s.with_rows) {
    for (const auto& [run, sent] : rows_[number])
      if (sent.has_more) last.emplace(run, nullptr);
    std::vector<std::uint64_t> more;
    for (const auto& [recording, sent] : recording_rows_[number])
      if (sent.has_more) more.push_back(recording);
    for (const std::uint64_t recording : more) {
      send_recording_rows(number, s, recording,
                          Map{{"topic", "recording"},
                              {"id", Handle{"recording", recording}},
                              {"kind", "appended"}});
      has_sent = true;
    }
  }
  for (const auto& [run, event] : last) {
    if (!s.with_rows && event->left_out == 0) {
      send_event(number, *hall_.state_texts.of(event->run, [&, e = event] {
        return event_text(ioci::event_value(*e), Arrays::numbers);
      }));
      continue;
    }
    Map params =
        event ? ioci::event_value(*event) : Map{{"topic", "run"}, {"id", Handle{"run", run}}};
    if (s.with_rows) send_run_rows(number, s, run, std::move(params));
    else send_event(number, std::move(params));
  }
  return has_sent || !last.empty();
}

void Connection::send_recording(std::uint64_t number, const Subscription& s, const ioci::Event& e) {
  using What = recording::RecordingChange::What;
  const auto& change = *e.recording;
  if (s.with_rows && change.what == What::appended)
    return send_recording_rows(number, s, change.number, ioci::event_value(e));
  if (change.what == What::removed)
    if (const auto at = recording_rows_.find(number); at != recording_rows_.end())
      at->second.erase(change.number);
  send_event(number, ioci::event_value(e));
}

/// One event with rows, and more of them while the client reads.
void Connection::send_rows(std::uint64_t number, const Subscription& s, Sent& sent,
                           const Handle& of, Map params,
                           const std::function<Result<Map>(const Sent&)>& next) {
  sent.has_more = false;
  const Value topic = *params.find("topic");
  for (;;) {
    auto rows = next(sent);
    if (!rows.ok()) {
      params.set("rows", Map{{"error", rows.error().sentence()}});
      return send_event(number, std::move(params));
    }
    const auto whole = [&rows](const char* name) {
      return static_cast<std::size_t>(*rows->find(name)->as_int());
    };
    sent.next = whole("from") - 1 + whole("count");
    sent.restarts = whole("restarts");
    const bool has_more = sent.next < whole("rows");
    params.set("rows", std::move(*rows));
    send_event(number, std::move(params), s.arrays);
    if (!has_more) return;
    if (unread() >= hall_.options.limits.unread / 2) {
      sent.has_more = true;
      return;
    }
    params = Map{{"topic", topic}, {"id", of}};
  }
}

void Connection::send_run_rows(std::uint64_t number, const Subscription& s, std::uint64_t run,
                               Map params) {
  const auto entry = hall_.app.runs->find(run);
  if (!entry) {
    rows_[number].erase(run);
    return send_event(number, std::move(params));
  }
  send_rows(number, s, rows_[number][run], Handle{"run", run}, std::move(params),
            [&](const Sent& sent) {
              return ioci::live_run_rows(*entry, sent.next, sent.restarts, kRowValues, kRowValues,
                                         s.columns);
            });
}

void Connection::send_recording_rows(std::uint64_t number, const Subscription& s,
                                     std::uint64_t recording, Map params) {
  send_rows(number, s, recording_rows_[number][recording], Handle{"recording", recording},
            std::move(params), [&](const Sent& sent) -> Result<Map> {
              RMP_TRY_ASSIGN(auto piece,
                             hall_.app.recordings.rows(recording, sent.next, sent.restarts,
                                                       kRowValues, s.columns));
              Map columns;
              std::size_t count = 0;
              for (auto& [name, values] : piece.columns) {
                count = values.size();
                columns.set(name, NumericArray(std::move(values)));
              }
              return Map{{"from", static_cast<std::int64_t>(piece.from + 1)},
                         {"count", static_cast<std::int64_t>(count)},
                         {"rows", static_cast<std::int64_t>(piece.rows)},
                         {"restarts", static_cast<std::int64_t>(piece.replaced)},
                         {"columns", std::move(columns)}};
            });
}

std::string Connection::event_text(Map params, Arrays arrays) const {
  std::string out;
  append_json(
      out, Value(std::move(params)),
      [this](const Handle& h) { return hall_.app.name_of(h).value_or(""); }, arrays);
  return out;
}

void Connection::send_event(std::uint64_t number, Map params, Arrays arrays) {
  send_event(number, event_text(std::move(params), arrays));
}

/// Sends one event of a subscription, given as an object of JSON.
void Connection::send_event(std::uint64_t number, std::string_view params) {
  std::string text = R"({"jsonrpc":"2.0","method":"event","params":{"subscription":)" +
                     std::to_string(number) + ",";
  text += params.substr(1);  // behind its opening brace
  text += '}';
  send(std::move(text));
}

StateTexts::Text StateTexts::of(const std::shared_ptr<const ioci::RunState>& state,
                                const std::function<std::string()>& make) {
  {
    const std::lock_guard lock(mutex_);
    const auto at = last_.find(state->run);
    if (at != last_.end() && at->second.first == state) return at->second.second;
  }
  const Text text = std::make_shared<const std::string>(make());
  const std::lock_guard lock(mutex_);
  if (last_.size() >= kMost) last_.clear();
  last_[state->run] = {state, text};
  return text;
}

void Connection::push_all() {
  std::vector<std::uint64_t> numbers;
  {
    const std::lock_guard lock(mutex_);
    for (const auto& [number, s] : subscriptions_) numbers.push_back(number);
  }
  for (const std::uint64_t number : numbers) push(number);
}

// --- the end ---

void Connection::close(const std::string& reason) {
  if (is_closing_ || is_told_.exchange(true)) return;
  if (has_talk_) {
    if (is_classic_) send("closing " + reason);
    else
      send(R"({"jsonrpc":"2.0","method":"server.closing","params":)" +
           to_json(Map{{"reason", reason}}) + "}");
  }
  is_closing_ = true;  // only now, as drain() ends what is closing
  if (has_talk_) talk_->session.interrupt();
  const std::lock_guard lock(mutex_);
  closing_since_ = Clock::now();
  // What runs is answered first; drain() goes on then.
  if (!is_draining_) end_locked();
}

/// When what waits has been sent, the connection is shut.
void Connection::end_locked() {
  if (is_shut_ || is_ending_) return;
  is_ending_ = true;
  if (closing_since_ == Clock::time_point()) closing_since_ = Clock::now();
  if (is_web_.exchange(false)) {
    const std::string last = websocket_close(WebSocketEnd::leaving, "");
    if (tls_) (void)tls_->write(last);
    else out_ += last;
  }
  if (tls_) {
    tls_->close();
    out_ += tls_->output();
  }
  flush_locked();
}

void Connection::shut() {
  is_closing_ = true;
  {
    const std::lock_guard lock(mutex_);
    if (std::exchange(is_shut_, true)) return;
    asio::error_code ec;
    socket_.shutdown(Socket::shutdown_both, ec);
    socket_.close(ec);
  }
  if (has_talk_) talk_->session.interrupt();
  hall_.gone(number_);
  if (has_talk_) talk_->tell_gone();
}

std::function<void()> Connection::after(double seconds, std::function<void()> fn) {
  auto timer = std::make_shared<asio::steady_timer>(
      hall_.reactor.io(),
      std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds)));
  timer->async_wait([timer, fn = std::move(fn)](const asio::error_code& ec) {
    if (!ec) fn();
  });
  return [&io = hall_.reactor.io(), timer] { asio::post(io, [timer] { timer->cancel(); }); };
}

void Connection::look(Clock::time_point now) {
  const Limits& limits = hall_.options.limits;
  const auto since = [now](Clock::rep ticks) {
    return now - Clock::time_point(Clock::duration(ticks));
  };
  const auto seconds = [](std::uint64_t s) {
    return std::chrono::seconds(static_cast<std::int64_t>(s));
  };
  bool is_over = false, is_ending = false;
  {
    const std::lock_guard lock(mutex_);
    if (is_shut_) return;
    is_ending = is_ending_;
    is_over = (closing_since_ != Clock::time_point() && now - closing_since_ > goodbye_) ||
              (stuck_since_ != Clock::time_point() &&
               now - stuck_since_ > seconds(limits.unread_seconds));
  }
  if (is_over) return shut();
  if (is_ending) return;
  if (!has_talk_) {
    if (now - begin_ > seconds(limits.hello_seconds)) shut();
    return;
  }
  if (const auto begin = line_begin_.load(); begin && since(begin) > seconds(limits.line_seconds))
    return close("A line took longer than " + std::to_string(limits.line_seconds) + " s.");
  const auto running = talk_->conversation.running_since();
  if (limits.seconds && running && now - *running > seconds(limits.seconds)) {
    ended_ = Ended::time;
    talk_->session.interrupt();
  }
  if (limits.idle_seconds && !running && since(last_in_) > seconds(limits.idle_seconds) &&
      since(last_out_) > seconds(limits.idle_seconds))
    close("Nothing was received for " + std::to_string(limits.idle_seconds) + " s.");
}

std::optional<Connection::Clock::time_point> Connection::running_since() const {
  if (!has_talk_ || is_closing_ || ended_ != Ended::no) return std::nullopt;
  return talk_->conversation.running_since();
}

void Connection::end_for_memory() {
  ended_ = Ended::memory;
  talk_->session.interrupt();
}

bool Connection::is_closed() const {
  const std::lock_guard lock(mutex_);
  return is_shut_;
}

ClientInfo Connection::info() const {
  ClientInfo i;
  i.number = number_;
  i.peer = peer_;
  i.has_tls = tls_ != nullptr;
  i.seconds = std::chrono::duration<double>(Clock::now() - begin_).count();
  i.requests = requests_;
  i.bytes_in = bytes_in_;
  i.bytes_out = bytes_out_;
  if (has_talk_) {
    i.name = talk_->client;
    i.token = talk_->rights.name;
    i.session = talk_->session.number();
    i.protocol = is_classic_ ? "classic" : web_ ? "websocket" : "json";
    i.waiting = talk_->conversation.waiting();
  }
  return i;
}

}  // namespace robomosp::remote
