// SPDX-License-Identifier: Apache-2.0
// Commands that make this program a client of others: connection.open, call, events, reopen, close,
// list. scripts/lib/remote.lua is what scripts use of them.
#include <algorithm>
#include <map>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "ioci/core/commands.h"
#include "kernel/permit.h"
#include "kernel/text.h"
#include "remote/client.h"

namespace robomosp::remote {
namespace {

using namespace ioci;

/// At a time, of all sessions.
constexpr std::size_t kMostConnections = 64;

/// The connections to other programs. Each belongs to the session that opened it. [any thread]
class Connections {
 public:
  struct Entry {
    explicit Entry(std::uint64_t of) : session(of) {}
    const std::uint64_t session;
    std::timed_mutex mutex;
    std::unique_ptr<Client> client;  // guarded by mutex
  };
  explicit Connections(Application& app) : app_(app) {}

  Result<std::int64_t> add(std::uint64_t session, std::unique_ptr<Client> client) {
    const auto entry = std::make_shared<Entry>(session);
    entry->client = std::move(client);
    const std::lock_guard lock(mutex_);
    entries_.emplace(next_, entry);
    return next_++;
  }
  /// Refuses one more than there may be; those of sessions that are gone are closed.
  Result<void> make_room() {
    const auto sessions = app_.sessions();
    const std::lock_guard lock(mutex_);
    std::erase_if(entries_, [&](const auto& e) {
      return std::none_of(sessions.begin(), sessions.end(), [&](const auto& s) {
        return s.is_open && s.number == e.second->session;
      });
    });
    if (entries_.size() < kMostConnections) return {};
    return error(ErrorCode::conflict,
                 std::to_string(entries_.size()) + " connections are open already",
                 "Close one: connection.list() names them.");
  }
  [[nodiscard]] std::shared_ptr<Entry> find(std::int64_t number, std::uint64_t session) const {
    const std::lock_guard lock(mutex_);
    const auto it = entries_.find(number);
    return it == entries_.end() || it->second->session != session ? nullptr : it->second;
  }
  void remove(std::int64_t number) {
    const std::lock_guard lock(mutex_);
    entries_.erase(number);
  }
  [[nodiscard]] std::vector<std::pair<std::int64_t, std::shared_ptr<Entry>>> of(
      std::uint64_t session) const {
    std::vector<std::pair<std::int64_t, std::shared_ptr<Entry>>> out;
    const std::lock_guard lock(mutex_);
    for (const auto& [number, entry] : entries_)
      if (entry->session == session) out.emplace_back(number, entry);
    return out;
  }

 private:
  Application& app_;
  mutable std::mutex mutex_;
  std::int64_t next_ = 1;                                   // guarded by mutex_
  std::map<std::int64_t, std::shared_ptr<Entry>> entries_;  // guarded by mutex_
};

Connections& connections(CommandContext& ctx) { return ctx.app.kept<Connections>(); }

/// What was done over there stays when a group of edits here is taken back, so nothing is.
Result<void> not_in_group(const CommandContext& ctx, const char* what) {
  if (!ctx.is_in_group()) return {};
  return error(ErrorCode::conflict,
               std::string(what) +
                   " cannot be part of a group of edits: what it does in the other "
                   "program would stay when the group is taken back",
               "Call it before or after ioci.transaction.");
}

/// A connection, for as long as this lives used by nobody else.
struct Use {
  std::shared_ptr<Connections::Entry> entry{};
  std::unique_lock<std::timed_mutex> lock{};
  [[nodiscard]] Client& client() const { return *entry->client; }
};

Result<Use> use(CommandContext& ctx, const Map& args) {
  const std::int64_t number = integer(args, "connection");
  Use u;
  u.entry = connections(ctx).find(number, ctx.app.author(ctx.session).session);
  if (!u.entry)
    return error(ErrorCode::unknown_name,
                 "this session has no connection " + std::to_string(number),
                 "connection.open makes one.", "connection");
  u.lock = std::unique_lock(u.entry->mutex, std::defer_lock);
  while (!u.lock.try_lock_for(std::chrono::milliseconds(50)))
    if (ctx.progress.cancelled())
      return error(ErrorCode::cancelled, "the call was interrupted before it began");
  return u;
}

Map about(std::int64_t number, const Client& client) {
  Map out{{"connection", number},
          {"address", client.options().address.text()},
          {"is_open", client.is_open()},
          {"generation", static_cast<std::int64_t>(client.generation())}};
  out.append("server", client.hello());
  return out;
}

Result<Value> open(CommandContext& ctx, const Map& args) {
  RMP_TRY(not_in_group(ctx, "connecting"));
  ClientOptions o;
  RMP_TRY_ASSIGN(o.address, Address::parse(text_of(args, "address")));
  o.token = text_of(args, "token");
  o.name = text_of(args, "client");
  if (const Value* tls = args.find("tls"); tls && tls->as_bool()) o.tls = *tls->as_bool();
  o.certificate = text_of(args, "certificate");
  if (!o.certificate.empty()) {
    RMP_TRY(require(Effect::files_read));
    if (!o.tls) o.tls = true;
  }
  o.seconds = real(args, "timeout");
  o.longest_answer = static_cast<std::size_t>(integer(args, "longest_answer"));
  RMP_TRY(connections(ctx).make_room());
  const std::uint64_t session = ctx.app.author(ctx.session).session;
  RMP_TRY_ASSIGN(auto client, Client::connect(std::move(o), ctx.progress));
  Client& made = *client;
  RMP_TRY_ASSIGN(const std::int64_t number, connections(ctx).add(session, std::move(client)));
  return Value(about(number, made));
}

Result<Value> call(CommandContext& ctx, const Map& args) {
  RMP_TRY(not_in_group(ctx, "a call of another program"));
  RMP_TRY_ASSIGN(const Use u, use(ctx, args));
  // As it was given: the schema has nothing to say about what is another program's.
  const Value* named = ctx.given("params");
  const Value* places = ctx.given("arguments");
  Value params = named && !named->is_nil()     ? *named
                 : places && !places->is_nil() ? *places
                                               : Value(Map{});
  if (const NumericArray* a = params.as_array()) {
    List list;
    for (const double x : a->data()) list.emplace_back(x);
    params = std::move(list);
  }
  if (params.as_list() && params.as_list()->empty()) params = Map{};
  return u.client().call(text_of(args, "method"), std::move(params), flag(args, "job"),
                         real(args, "timeout"), ctx.progress);
}

Result<Value> events(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const Use u, use(ctx, args));
  const auto begin = Client::Clock::now();
  RMP_TRY_ASSIGN(List out, u.client().events(real(args, "timeout"), ctx.progress));
  const std::chrono::duration<double> waited = Client::Clock::now() - begin;
  return Value(Map{{"events", std::move(out)}, {"seconds", waited.count()}});
}

Result<Value> reopen(CommandContext& ctx, const Map& args) {
  RMP_TRY(not_in_group(ctx, "connecting"));
  RMP_TRY_ASSIGN(const Use u, use(ctx, args));
  RMP_TRY(u.client().reconnect(real(args, "timeout"), ctx.progress));
  return Value(about(integer(args, "connection"), u.client()));
}

Result<Value> close(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const Use u, use(ctx, args));
  u.client().close();
  connections(ctx).remove(integer(args, "connection"));
  return Value();
}

Result<Value> list(CommandContext& ctx, const Map&) {
  List out;
  for (const auto& [number, entry] : connections(ctx).of(ctx.app.author(ctx.session).session)) {
    const std::unique_lock lock(entry->mutex, std::try_to_lock);
    if (lock) out.emplace_back(about(number, *entry->client));
    else out.emplace_back(Map{{"connection", number}, {"is_open", true}});  // a call is under way
  }
  return Value(std::move(out));
}

ParamSpec which() {
  return between(needed("connection", "int", "", "Its number, as connection.open gave it."), 1,
                 9e15);
}
ParamSpec patience(const char* doc, double usual) {
  return between(defaulted("timeout", "real", "s", usual, doc), 0, 1e9);
}

std::vector<ParamSpec> connection_fields() {
  return {field("connection", "int", "", "Its number."),
          field("address", "string", "", "Where it leads."),
          field("is_open", "bool", "", "Whether it has not been lost."),
          field("generation", "int", "",
                "Counts up when a reconnect finds another program; handles of before are refused."),
          field("server", "map", "", "What the server said of itself and of what is allowed.")};
}

}  // namespace

RMP_COMMANDS(client_commands) {
  std::vector<CommandSpec> all;
  const Effects effect = Effect::administers | Effect::simulates;
  all.push_back(
      {.name = "connection.open",
       .classic = "",
       .summary = "Connects to another program that serves.",
       .details = "Scripts use it by require \"remote\", whose connect gives what feels like the "
                  "commands here. At most 64 are open. The connection belongs to the session.",
       .example = "local ok, why = pcall(connection.open, {address = \"unix:nobody-listens\"})\n"
                  "assert(not ok and why.code == \"io\")",
       .params = {needed("address", "string", "", "HOST:PORT, [IPv6]:PORT or unix:PATH."),
                  optional("token", "string", "", "The secret that server.grant printed."),
                  optional("tls", "bool", "",
                           "Whether TLS is spoken; left out: with other machines than this one."),
                  optional("certificate", "path", "",
                           "PEM file with certificates to trust, such as the server's own; left "
                           "out: the authorities of the system."),
                  defaulted("client", "string", "", "robomosp", "A name for the server's lists."),
                  patience("What connecting may take.", 10),
                  between(defaulted("longest_answer", "int", "bytes", 268'435'456,
                                    "A server that sends a longer one is not believed."),
                          1024, 1e10)},
       .returns = {"map", "", "The connection.", connection_fields()},
       .effect = effect,
       .sometimes = Effect::files_read,
       .run = open});
  all.push_back(
      {.name = "connection.call",
       .classic = "",
       .summary = "Calls a method of the program at the other end.",
       .details = "Its error is raised here. Ctrl-C and the time limit cancel what runs over "
                  "there. Handles of the other program are tables {[\"$handle\"] = {kind, number, "
                  "name, generation}}. Not within a group of edits, which could not take it back.",
       .example = "assert(not pcall(connection.call, {connection = 1, method = \"version\"}))",
       .params = {which(), needed("method", "string", "", "A command or another method."),
                  optional("params", "map", "", "Its arguments by name."),
                  optional("arguments", "list", "", "Or by place."),
                  defaulted("job", "bool", "", false, "Goes on as a job over there."),
                  patience("What it may take; 0 = as long as it takes.", 0)},
       .returns = {"any", "", "What the method gives.", {}},
       .effect = effect,
       .run = call});
  all.push_back(
      {.name = "connection.events",
       .classic = "",
       .summary = "Gives what came for subscriptions of a connection.",
       .details = "connection.call of the method server.subscribe makes one.",
       .example = "assert(not pcall(connection.events, 1))",
       .params = {which(), patience("How long to wait for the first; 0 = not at all.", 0)},
       .returns = {"map",
                   "",
                   "What came.",
                   {field("events", "list", "", "As event.take gives them, oldest first."),
                    field("seconds", "real", "s", "For how long it was waited.")}},
       .effect = effect,
       .run = events});
  all.push_back({.name = "connection.reopen",
                 .classic = "",
                 .summary = "Connects again, after the connection was lost or to begin anew.",
                 .details = "Handles hold on where the program over there is still the same. "
                            "Subscriptions are gone.",
                 .example = "assert(not pcall(connection.reopen, 1))",
                 .params = {which(), patience("For how long it is tried while nobody answers.", 0)},
                 .returns = {"map", "", "The connection.", connection_fields()},
                 .effect = effect,
                 .run = reopen});
  all.push_back({.name = "connection.close",
                 .classic = "",
                 .summary = "Ends a connection.",
                 .details = "",
                 .example = "assert(not pcall(connection.close, 1))",
                 .params = {which()},
                 .returns = {},
                 .effect = effect,
                 .run = close});
  all.push_back({.name = "connection.list",
                 .classic = "",
                 .summary = "Lists the connections of this session.",
                 .details = "",
                 .example = "assert(#connection.list() == 0)",
                 .params = {},
                 .returns = {"list", "", "One entry for each.", connection_fields()},
                 .effect = Effect::administers,
                 .run = list});
  return all;
}

}  // namespace robomosp::remote
