// SPDX-License-Identifier: Apache-2.0
// Commands that make this program a client of others: connection.open, call, events, reopen, close,
// list. scripts/lib/remote.lua is what scripts use of them.
#include <algorithm>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "ioci/core/commands.h"
#include "kernel/permit.h"
#include "kernel/text.h"
#include "remote/connections.h"

namespace robomosp::remote {
namespace {

using namespace ioci;

/// What was done over there stays when a group of edits here is taken back, so nothing is.
Result<void> not_in_group(const CommandContext& ctx, const char* what) {
  if (!ctx.is_in_group()) return {};
  return error(ErrorCode::conflict,
               std::string(what) +
                   " cannot be part of a group of edits: its effects in the other program would "
                   "remain when the group is undone",
               "Call it before or after ioci.transaction.");
}

Connections& connections(CommandContext& ctx) { return ctx.app.kept<Connections>(); }

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
  RMP_TRY_ASSIGN(const ConnectionUse u, use_connection(ctx, args));
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
  RMP_TRY_ASSIGN(const ConnectionUse u, use_connection(ctx, args));
  const auto begin = Client::Clock::now();
  RMP_TRY_ASSIGN(List out, u.client().events(real(args, "timeout"), ctx.progress));
  const std::chrono::duration<double> waited = Client::Clock::now() - begin;
  return Value(Map{{"events", std::move(out)}, {"seconds", waited.count()}});
}

Result<Value> reopen(CommandContext& ctx, const Map& args) {
  RMP_TRY(not_in_group(ctx, "connecting"));
  RMP_TRY_ASSIGN(const ConnectionUse u, use_connection(ctx, args));
  RMP_TRY(u.client().reconnect(real(args, "timeout"), ctx.progress));
  return Value(about(integer(args, "connection"), u.client()));
}

Result<Value> close(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const ConnectionUse u, use_connection(ctx, args));
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
  return between(needed("connection", "int", "", "Its number, from connection.open."), 1, 9e15);
}
ParamSpec patience(const char* doc, double usual) {
  return between(defaulted("timeout", "real", "s", usual, doc), 0, 1e9);
}

std::vector<ParamSpec> connection_fields() {
  return {
      field("connection", "int", "", "Its number."),
      field("address", "string", "", "Address of the server."),
      field("is_open", "bool", "", "Whether it is still connected."),
      field("generation", "int", "",
            "Incremented when a reconnect finds another program; older handles are then rejected."),
      field("server", "map", "",
            "The server's description of itself and of the permitted commands.")};
}

}  // namespace

RMP_COMMANDS(client_commands) {
  std::vector<CommandSpec> all;
  const Effects effect = Effect::administers | Effect::simulates;
  all.push_back(
      {.name = "connection.open",
       .classic = "",
       .summary = "Connects to another program that runs a server.",
       .details = "Scripts use it by require \"remote\"; its connect returns an object with the "
                  "same commands as here. At most 64 connections can be open. A connection belongs "
                  "to its session.",
       .example = "local ok, why = pcall(connection.open, {address = \"unix:nobody-listens\"})\n"
                  "assert(not ok and why.code == \"io\")",
       .params = {needed("address", "string", "", "HOST:PORT, [IPv6]:PORT or unix:PATH."),
                  optional("token", "string", "", "The secret that server.grant printed."),
                  optional("tls", "bool", "",
                           "Whether TLS is used; by default for all hosts except this machine."),
                  optional("certificate", "path", "",
                           "PEM file with certificates to trust, such as that of the server; by "
                           "default the authorities of the system."),
                  defaulted("client", "string", "", "robomosp", "A name for the server's lists."),
                  patience("Time limit for connecting.", 10),
                  between(defaulted("longest_answer", "int", "bytes", 268'435'456,
                                    "Longest message accepted from the server."),
                          1024, 1e10)},
       .returns = {"map", "", "The connection.", connection_fields()},
       .effect = effect,
       .sometimes = Effect::files_read,
       .run = open});
  all.push_back(
      {.name = "connection.call",
       .classic = "",
       .summary = "Calls a method of the connected program.",
       .details =
           "Its error is raised here. Ctrl-C and the time limit cancel the call on the server. "
           "Handles of the other program are tables {[\"$handle\"] = {kind, number, name, "
           "generation}}. Not allowed within a group of edits, which could not undo the call.",
       .example = "assert(not pcall(connection.call, {connection = 1, method = \"version\"}))",
       .params = {which(), needed("method", "string", "", "A command or another method."),
                  optional("params", "map", "", "Its arguments, by name."),
                  optional("arguments", "list", "", "Arguments by position, instead."),
                  defaulted("job", "bool", "", false, "Runs as a job on the server."),
                  patience("Time limit; 0 = none.", 0)},
       .returns = {"any", "", "Result of the method.", {}},
       .effect = effect,
       .run = call});
  all.push_back(
      {.name = "connection.events",
       .classic = "",
       .summary = "Returns the received events of a connection's subscriptions.",
       .details = "connection.call of the method server.subscribe creates a subscription.",
       .example = "assert(not pcall(connection.events, 1))",
       .params = {which(), patience("Time to wait for the first event; 0 = do not wait.", 0)},
       .returns = {"map",
                   "",
                   "The events.",
                   {field("events", "list", "", "As returned by event.take, oldest first."),
                    field("seconds", "real", "s", "Time waited.")}},
       .effect = effect,
       .run = events});
  all.push_back(
      {.name = "connection.reopen",
       .classic = "",
       .summary = "Reconnects after the connection was lost, or to start afresh.",
       .details =
           "Handles stay valid if the server is still the same program. Subscriptions are lost.",
       .example = "assert(not pcall(connection.reopen, 1))",
       .params = {which(), patience("Time to keep trying while there is no answer.", 0)},
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
