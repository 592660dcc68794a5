// SPDX-License-Identifier: Apache-2.0
#include "remote/client.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <asio/buffer.hpp>
#include <asio/connect.hpp>
#include <asio/ip/tcp.hpp>
#include <asio/local/stream_protocol.hpp>

#include "kernel/fault.h"
#include "kernel/text.h"
#include "remote/json.h"
#include "remote/server.h"

namespace robomosp::remote {
namespace {

using namespace std::chrono_literals;

/// How often a wait asks whether the user wants it to end.
constexpr auto kClientLook = 20ms;
/// Between two attempts to connect.
constexpr auto kClientAgain = 100ms;
/// How long the end of a cancelled request is waited for.
constexpr auto kClientGoodbye = 5s;
constexpr std::size_t kPiece = 65'536;      // of reading [bytes]
constexpr int kDeepestReply = 60;           // of arguments
constexpr double kLongestClientWait = 1e9;  // [s]

std::string shown(std::string_view raw) {
  constexpr std::size_t kMost = 60;
  std::string out = text::visible(std::string(raw.substr(0, kMost)));
  std::replace(out.begin(), out.end(), '\n', ' ');
  return text::quote(out + (raw.size() > kMost ? "..." : ""));
}

std::string text_under(const Map& m, std::string_view key) {
  const Value* v = m.find(key);
  return v && v->as_string() ? *v->as_string() : std::string();
}

/// Handles count the server's records: here they would mean others. Names stay.
void without_handles(Fault& f) {
  f.subject.record = {};
  f.witness.scene = {};
  if (!f.cause) return;
  Fault cause = *f.cause;
  without_handles(cause);
  f.cause = std::make_shared<const Fault>(std::move(cause));
}

/// The error of an answer, as it was meant over there.
Error error_of(const Map& fault) {
  const Value* data = fault.find("data");
  static const Map kNone;
  const Map& about = data && data->as_map() ? *data->as_map() : kNone;
  Error e = error(ErrorCode::unsupported, text_under(fault, "message"));
  // JSON-RPC 2.0, section 5.1: what a server means that gives no word of ours.
  const Value* given = fault.find("code");
  const std::int64_t number = given && given->as_int() ? *given->as_int() : 0;
  if (number == -32'700) e.code = ErrorCode::syntax;
  if (number == -32'600) e.code = ErrorCode::usage;
  if (number == -32'601) e.code = ErrorCode::unknown_name;
  if (number == -32'602) e.code = ErrorCode::invalid_argument;
  e.code = error_code_from(text_under(about, "code")).value_or(e.code);
  e.where = text_under(about, "where");
  e.hint = text_under(about, "hint");
  // The message is the whole sentence; where and hint stand by themselves here.
  if (!e.where.empty() && e.message.starts_with(e.where + ": "))
    e.message.erase(0, e.where.size() + 2);
  if (!e.hint.empty() && e.message.ends_with(" " + e.hint))
    e.message.erase(e.message.size() - e.hint.size() - 1);
  if (e.message.ends_with(".")) e.message.pop_back();
  if (e.message.empty()) e.message = "the server returned an error without a message";
  if (const Value* faults = about.find("faults")) adopt_faults(e, *faults);
  if (kept_faults(e)) amend(e, without_handles);
  return e;
}

std::optional<Client::Clock::time_point> end_of(double seconds) {
  if (!(seconds > 0)) return std::nullopt;
  return Client::Clock::now() +
         std::chrono::duration_cast<Client::Clock::duration>(
             std::chrono::duration<double>(std::min(seconds, kLongestClientWait)));
}

Error cancelled() { return error(ErrorCode::cancelled, "the call was interrupted"); }

}  // namespace

Result<std::unique_ptr<Client>> Client::connect(ClientOptions options, Progress& progress) {
  if (options.address.is_unix && options.tls.value_or(false))
    return error(ErrorCode::invalid_argument, "a Unix socket has no TLS", "Leave tls out.", "tls");
  if (!options.address.is_unix && options.address.port == 0)
    return error(ErrorCode::invalid_argument, "a port must be a number from 1 to 65535", "",
                 "address");
  std::unique_ptr<Client> made(new Client(std::move(options)));
  RMP_TRY(made->open(progress));
  return made;
}

Client::~Client() { close(); }

void Client::close() {
  if (socket_) {
    asio::error_code ec;
    socket_->shutdown(Socket::shutdown_both, ec);
    socket_->close(ec);
    // What was begun on it ends before it goes.
    io_.restart();
    io_.poll();
  }
  socket_.reset();
  tls_.reset();
}

Error Client::no_server(const std::string& why) const {
  return error(ErrorCode::unsupported,
               options_.address.text() + " is not a ROBOMOSP server: " + why,
               "Give the address that `robomosp serve` printed when it started.");
}

void Client::lose(Error why) {
  if (!lost_) lost_ = std::move(why);
}

Error Client::lost() const {
  return lost_ ? *lost_
               : error(ErrorCode::io, "the connection to " + options_.address.text() + " is closed",
                       "Connect again.");
}

template <class Done>
Result<bool> Client::run(std::optional<Clock::time_point> end, Progress& progress, Done is_done) {
  while (!is_done()) {
    if (progress.cancelled()) return cancelled();
    auto until = Clock::now() + kClientLook;
    if (end && *end <= Clock::now()) return false;
    if (end) until = std::min(until, *end);
    io_.restart();
    io_.run_one_until(until);
  }
  return true;
}

Result<void> Client::open(Progress& progress) {
  close();
  lines_ = Lines(options_.longest_answer);
  out_.clear();
  sent_ = 0;
  is_writing_ = has_spoken_ = false;
  first_.clear();
  goodbye_.clear();
  events_.clear();
  left_out_ = 0;
  lost_.reset();
  const auto end = end_of(options_.seconds).value_or(Clock::now() + 10s);
  auto done = open_socket(end, progress);
  if (done.ok()) done = say_hello(end, progress);
  if (done.ok()) return done;
  lose(done.error());
  close();
  return done;
}

Result<void> Client::open_socket(Clock::time_point end, Progress& progress) {
  const std::string where = options_.address.text();
  const auto unreachable = [&where](const std::string& why) {
    return error(ErrorCode::io, where + " cannot be reached: " + why,
                 "Check that `robomosp serve` is running there.");
  };
  std::shared_ptr<TlsContext> tls;
  if (options_.tls.value_or(!options_.address.is_local())) {
    RMP_TRY_ASSIGN(tls, TlsContext::create_client(options_.certificate));
  }
  socket_ = std::make_unique<Socket>(io_);
  std::optional<asio::error_code> outcome;
  if (options_.address.is_unix) {
    asio::local::stream_protocol::socket s(io_);
    asio::error_code ec;
    s.connect(asio::local::stream_protocol::endpoint(options_.address.path), ec);
    if (ec) return unreachable(ec.message());
    *socket_ = std::move(s);
  } else {
    const std::string host = options_.address.host.empty() ? "127.0.0.1" : options_.address.host;
    asio::ip::tcp::resolver resolver(io_);
    asio::ip::tcp::socket s(io_);
    const auto connect_to = [&](const auto& endpoints) {
      asio::async_connect(s, endpoints,
                          [&](const asio::error_code& ec, const auto&) { outcome = ec; });
    };
    asio::error_code ec;
    const auto number = asio::ip::make_address(host, ec);
    if (!ec) {
      connect_to(std::array{asio::ip::tcp::endpoint(number, options_.address.port)});
    } else {
      resolver.async_resolve(host, std::to_string(options_.address.port),
                             [&](const asio::error_code& fault, const auto& found) {
                               if (fault) outcome = fault;
                               else connect_to(found);
                             });
    }
    auto in_time = run(end, progress, [&] { return outcome.has_value(); });
    if (!in_time.ok() || !*in_time) {
      resolver.cancel();
      s.close(ec);
      io_.restart();
      while (!outcome) io_.run_one();  // what was begun refers to what is here
      if (!in_time.ok()) return std::move(in_time).error();
      return unreachable("it did not answer within " + text::print_rounded(options_.seconds) +
                         " s");
    }
    if (*outcome) return unreachable(outcome->message());
    s.set_option(asio::ip::tcp::no_delay(true), ec);
    *socket_ = std::move(s);
  }
  socket_->non_blocking(true);
  buffer_.resize(kPiece);
  if (tls) {
    tls_ = std::make_unique<TlsStream>(std::move(tls), options_.address.host);
    out_ += tls_->output();
  }
  read();
  flush();
  if (!tls_) return {};
  RMP_TRY_ASSIGN(const bool in_time,
                 run(end, progress, [this] { return lost_ || tls_->is_ready(); }));
  if (lost_) {
    if (lost_->code == ErrorCode::permission) return *lost_;
    return error(ErrorCode::unsupported,
                 options_.address.text() + " does not speak TLS: " + lost_->message,
                 "Give tls = false if it serves without TLS.");
  }
  if (!in_time)
    return unreachable("its TLS did not answer within " + text::print_rounded(options_.seconds) +
                       " s");
  return {};
}

Result<void> Client::say_hello(Clock::time_point end, Progress& progress) {
  Map params{{"protocol", kProtocol}};
  if (!options_.token.empty()) params.append("token", options_.token);
  if (!options_.name.empty()) params.append("client", options_.name);
  awaited_ = next_id_++;
  told_.reset();
  write(to_json(Map{{"jsonrpc", "2.0"},
                    {"id", static_cast<std::int64_t>(awaited_)},
                    {"method", "server.hello"},
                    {"params", std::move(params)}}));
  RMP_TRY_ASSIGN(const bool in_time, run(end, progress, [this] { return lost_ || told_; }));
  if (!in_time)
    return no_server("it did not answer within " + text::print_rounded(options_.seconds) + " s");
  if (!told_) return lost();
  if (!told_->ok()) {
    Error e = told_->error();
    if (e.code == ErrorCode::unknown_name) return no_server(e.message);
    e.where = options_.address.text();
    return e;
  }
  const Map* hello = (*told_)->as_map();
  const Value* version = hello ? hello->find("protocol") : nullptr;
  if (!hello || text_under(*hello, "program") != "robomosp")
    return no_server("its reply does not identify it as one");
  if (!version || !version->as_int() || *version->as_int() != kProtocol)
    return error(ErrorCode::unsupported,
                 options_.address.text() + " speaks version " +
                     (version ? version->text() : std::string("?")) +
                     " of the protocol, and this program version " + std::to_string(kProtocol),
                 "Use programs of the same version.");
  const std::string instance = text_under(*hello, "instance");
  if (!instance_.empty() && instance != instance_) ++generation_;
  instance_ = instance;
  hello_ = *hello;
  longest_request_ = kLongestLine;
  if (const Value* limits = hello_.find("limits"); limits && limits->as_map())
    if (const Value* n = limits->as_map()->find("line"); n && n->as_int() && *n->as_int() > 0)
      longest_request_ = static_cast<std::size_t>(*n->as_int());
  return {};
}

// --- the network ---

void Client::read() {
  socket_->async_read_some(
      asio::buffer(buffer_), [this](const asio::error_code& ec, std::size_t count) {
        if (ec == asio::error::operation_aborted) return;
        if (count > 0) received({buffer_.data(), count});
        if (!ec && !lost_) return read();
        if (!ec) return;
        const std::string where = options_.address.text();
        if (tls_ && !tls_->is_ready())
          return lose(error(ErrorCode::io, "it closed the connection"));
        if (!goodbye_.empty())
          return lose(error(ErrorCode::io, where + " closed the connection: " + goodbye_));
        // As of a server that is about to end, too: its socket takes connections to the last.
        if (!has_spoken_ && first_.empty())
          return lose(error(ErrorCode::io, where + " closed the connection without an answer",
                            "Check that it is a ROBOMOSP server."));
        if (!has_spoken_)
          return lose(first_.starts_with("\x15\x03")
                          ? error(ErrorCode::unsupported, where + " speaks TLS",
                                  "Give tls = true, or the server's certificate.")
                          : no_server("it answered " + shown(first_)));
        lose(error(ErrorCode::io,
                   where + " closed the connection" + (lines_.is_within() ? " during a reply" : ""),
                   "Reconnect when it is available again."));
      });
}

void Client::received(std::string_view bytes) {
  if (!tls_) return plain(bytes);
  auto done = tls_->feed(bytes, [this](std::string_view text) { plain(text); });
  out_ += tls_->output();
  flush();
  if (!done.ok()) lose(std::move(done).error());
}

void Client::plain(std::string_view bytes) {
  if (!has_spoken_ && first_.size() < kPiece) first_ += bytes.substr(0, kPiece);
  (void)lines_.feed(
      bytes, [this](std::string_view text) { return line(text); },
      [this] {
        lose(error(ErrorCode::unsupported,
                   options_.address.text() + " sent a reply longer than " +
                       std::to_string(options_.longest_answer) + " bytes",
                   "Request less at a time, or allow more (longest_answer)."));
        return false;
      });
}

bool Client::line(std::string_view text) {
  text = text::trim(text);
  if (lost_) return false;
  if (text.empty()) return true;
  auto message = from_json(text, Handles::foreign);
  const auto no = [&](const std::string& why) {
    lose(has_spoken_
             ? error(ErrorCode::unsupported, options_.address.text() + " sent a reply that " + why,
                     "Reconnect, and report it to the server's administrator.")
         : first_.starts_with("\x15\x03")
             ? error(ErrorCode::unsupported, options_.address.text() + " speaks TLS",
                     "Give tls = true, or the server's certificate.")
             : no_server("it answered " + shown(text)));
    return false;
  };
  if (!message.ok()) return no("is not JSON: " + shown(text));
  if (array_fault(*message)) return no("contains an invalid array");
  Map* m = message->as_map();
  if (!m) return no("is not a message: " + shown(text));
  if (const Value* method = m->find("method")) {
    if (m->find("id")) return no("is a request");
    has_spoken_ = true;
    const Value* params = m->find("params");
    if (!method->as_string() || !params || !params->as_map()) return true;
    if (*method->as_string() == "event") take_event(*params->as_map());
    if (*method->as_string() == "server.closing")
      goodbye_ = text_under(*params->as_map(), "reason");
    return true;
  }
  const Value* id = m->find("id");
  const Value* fault = m->find("error");
  Value* result = m->find("result");
  if (!(fault && fault->as_map()) && !result) return no("is not a reply: " + shown(text));
  has_spoken_ = true;
  // Without an id: it could not read which request it was, and there is one only.
  const bool is_ours =
      awaited_ != 0 &&
      ((id && id->as_int() && *id->as_int() == static_cast<std::int64_t>(awaited_)) ||
       ((!id || id->is_nil()) && fault));
  if (!is_ours) return true;  // nobody waits for it any more
  if (const Value* notes = m->find("notes"); notes && notes->as_list())
    for (const Value& note : *notes->as_list())
      if (const Map* n = note.as_map(); n && notes_.size() < kMostEvents)
        notes_.push_back({text_under(*n, "code"), text_under(*n, "text")});
  if (fault) told_ = error_of(*fault->as_map());
  else told_ = std::move(*result);
  awaited_ = 0;
  return true;
}

void Client::take_event(Map params) {
  if (events_.size() >= kMostEvents) {
    events_.pop_front();
    ++left_out_;
  }
  if (left_out_ > 0) {
    const Value* theirs = params.find("left_out");
    const std::int64_t before = theirs && theirs->as_int() ? *theirs->as_int() : 0;
    params.set("left_out", before + static_cast<std::int64_t>(std::exchange(left_out_, 0)));
  }
  events_.emplace_back(std::move(params));
}

void Client::write(std::string_view line) {
  std::string text(line);
  text += '\n';
  if (tls_) {
    (void)tls_->write(text);
    out_ += tls_->output();
  } else {
    out_ += text;
  }
  flush();
}

void Client::flush() {
  if (is_writing_ || !socket_ || sent_ >= out_.size()) return;
  is_writing_ = true;
  // Copied, as out_ grows meanwhile.
  auto piece = std::make_shared<std::string>(out_.substr(sent_, kPiece));
  socket_->async_write_some(asio::buffer(*piece),
                            [this, piece](const asio::error_code& ec, std::size_t count) {
                              if (ec == asio::error::operation_aborted) return;
                              is_writing_ = false;
                              if (ec) return;  // the reader finds out why
                              sent_ += count;
                              if (sent_ == out_.size()) {
                                out_.clear();
                                sent_ = 0;
                              }
                              flush();
                            });
}

// --- calls ---

namespace {

/// {kind, number, ...} of a handle of another program; null for all else.
const Map* foreign_handle(const Map& map) {
  const Value* inner = map.size() == 1 ? map.find("$handle") : nullptr;
  return inner ? inner->as_map() : nullptr;
}

bool has_handles(const Value& v) {
  if (const List* list = v.as_list()) return std::any_of(list->begin(), list->end(), has_handles);
  const Map* map = v.as_map();
  if (!map) return false;
  return foreign_handle(*map) || std::any_of(map->begin(), map->end(), [](const auto& entry) {
           return has_handles(entry.second);
         });
}

Value marked(const Value& v, std::int64_t generation) {
  if (!has_handles(v)) return v;
  if (const List* list = v.as_list()) {
    List out;
    out.reserve(list->size());
    for (const Value& one : *list) out.push_back(marked(one, generation));
    return out;
  }
  Map out;
  if (const Map* handle = foreign_handle(*v.as_map())) {
    Map inner = *handle;
    inner.set("generation", generation);
    out.append("$handle", std::move(inner));
    return out;
  }
  for (const auto& [key, value] : *v.as_map()) out.append(key, marked(value, generation));
  return out;
}

}  // namespace

Result<Value> Client::outgoing(const Value& v, int depth) const {
  if (depth > kDeepestReply)
    return error(ErrorCode::invalid_argument, "the arguments are nested too deeply");
  if (const Handle* h = v.as_handle())
    return error(ErrorCode::invalid_argument,
                 "a " + h->kind + " of this program is unknown to " + options_.address.text(),
                 "Give its name on the server.");
  if (const List* list = v.as_list()) {
    List out;
    out.reserve(list->size());
    for (const Value& one : *list) {
      RMP_TRY_ASSIGN(Value sent, outgoing(one, depth + 1));
      out.push_back(std::move(sent));
    }
    return Value(std::move(out));
  }
  const Map* map = v.as_map();
  if (!map) return v;
  if (const Map* handle = foreign_handle(*map)) {
    const Value* of = handle->find("generation");
    if (of && of->as_int() && *of->as_int() != static_cast<std::int64_t>(generation_))
      return error(ErrorCode::stale_handle,
                   text_under(*handle, "kind") + " " + text::quote(text_under(*handle, "name")) +
                       " belongs to a program that has ended",
                   "Get it again by name.");
    Map inner = *handle;
    inner.erase("generation");
    return Value(Map{{"$handle", std::move(inner)}});
  }
  Map out;
  for (const auto& [key, value] : *map) {
    RMP_TRY_ASSIGN(Value sent, outgoing(value, depth + 1));
    out.append(key, std::move(sent));
  }
  return Value(std::move(out));
}

Result<Value> Client::call(const std::string& method, Value params, bool as_job, double seconds,
                           Progress& progress) {
  if (!socket_ || lost_) return lost();
  RMP_TRY_ASSIGN(params, outgoing(params));
  const std::uint64_t id = next_id_++;
  Map request{{"jsonrpc", "2.0"}, {"id", static_cast<std::int64_t>(id)}, {"method", method}};
  request.append("params", std::move(params));
  request.append("arrays", "base64");
  if (as_job) request.append("job", true);
  if (options_.wants_notes) request.append("notes", true);
  const std::string text = to_json(std::move(request), {}, Arrays::base64);
  if (text.size() > longest_request_)
    return error(ErrorCode::invalid_argument,
                 "the request takes " + std::to_string(text.size()) + " bytes, and " +
                     options_.address.text() + " reads " + std::to_string(longest_request_) +
                     " at once",
                 "Send it in parts.", method);
  awaited_ = id;
  told_.reset();
  write(text);
  const auto end = end_of(seconds);
  const auto is_done = [this] { return lost_ || told_; };
  auto in_time = run(end, progress, is_done);
  if (in_time.ok() && *in_time) {
    if (told_) {
      Result<Value> result = std::move(*told_);
      told_.reset();
      if (result.ok() && has_handles(*result))
        return marked(*result, static_cast<std::int64_t>(generation_));
      return result;
    }
    awaited_ = 0;
    close();
    return lost();
  }
  // What runs over there ends, and the connection is good for the next call.
  write(to_json(Map{{"jsonrpc", "2.0"},
                    {"method", "rpc.cancel"},
                    {"params", Map{{"request", static_cast<std::int64_t>(id)}}}}));
  NoProgress patient;
  (void)run(Clock::now() + kClientGoodbye, patient, is_done);
  awaited_ = 0;
  told_.reset();
  if (lost_) close();
  if (!in_time.ok()) return std::move(in_time).error().in(method);
  return error(ErrorCode::cancelled,
               options_.address.text() + " did not answer within " + text::print_rounded(seconds) +
                   " s; the call was cancelled",
               "Give it more time, or start it as a job on the server.", method);
}

Result<List> Client::events(double seconds, Progress& progress) {
  if (!socket_ || (lost_ && events_.empty())) return lost();
  // What is there already is read, too.
  io_.restart();
  io_.poll();
  if (events_.empty() && seconds > 0) {
    RMP_TRY_ASSIGN(const bool came,
                   run(end_of(seconds), progress, [this] { return lost_ || !events_.empty(); }));
    static_cast<void>(came);
  }
  if (events_.empty() && lost_) {
    close();
    return lost();
  }
  List out;
  for (const Value& e : events_) out.push_back(marked(e, static_cast<std::int64_t>(generation_)));
  events_.clear();
  return out;
}

Result<void> Client::reconnect(double seconds, Progress& progress) {
  const auto end =
      Clock::now() + std::chrono::duration_cast<Clock::duration>(
                         std::chrono::duration<double>(std::min(seconds, kLongestClientWait)));
  for (;;) {
    auto done = open(progress);
    if (done.ok() || done.error().code != ErrorCode::io || Clock::now() >= end) return done;
    const auto again = std::min(Clock::now() + kClientAgain, end);
    RMP_TRY_ASSIGN(const bool never, run(again, progress, [] { return false; }));
    static_cast<void>(never);
  }
}

}  // namespace robomosp::remote
