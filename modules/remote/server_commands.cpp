// SPDX-License-Identifier: Apache-2.0
// Commands of the server: server.start, stop, status, clients, kick, grant, revoke, tokens.
#include <algorithm>
#include <cmath>

#include "ioci/core/commands.h"
#include "kernel/executor.h"
#include "kernel/permit.h"
#include "kernel/text.h"
#include "remote/server.h"

namespace robomosp::remote {
namespace {

using namespace ioci;

constexpr double kLongestValidity = 100.0 * 365 * 86'400;  // [s]

Servers& servers(CommandContext& ctx) { return ctx.app.kept<Servers>(); }

/// Words of a list; `path` names it.
Result<std::vector<std::string>> words(const Map& args, std::string_view path) {
  std::vector<std::string> out;
  const Value* given = args.find(path);
  if (!given || given->is_nil()) return out;
  if (const std::string* one = given->as_string()) return std::vector<std::string>{*one};
  const List* list = given->as_list();
  if (!list)
    return error(ErrorCode::invalid_argument, "it must be a list of words", "", std::string(path));
  for (const Value& v : *list) {
    if (!v.as_string())
      return error(ErrorCode::invalid_argument, "it must be a list of words", "",
                   std::string(path));
    out.push_back(*v.as_string());
  }
  return out;
}

Result<Effects> effects_of(const Map& args, Effects usual) {
  RMP_TRY_ASSIGN(const std::vector<std::string> given, words(args, "effects"));
  if (!args.find("effects")) return usual;
  Effects out;
  std::vector<std::string> known;
  for (const Effect e : kAllEffects)
    if (!kByNameOnly.has(e)) known.emplace_back(to_string(e));
  for (const std::string& word : given) {
    bool is_found = false;
    for (const Effect e : kAllEffects) {
      if (to_string(e) != word) continue;
      if (kByNameOnly.has(e))
        return error(ErrorCode::invalid_argument,
                     "no client has the effect " + word + " as a whole",
                     "Grant commands by name: commands = {\"plugin.load\"}.", "effects");
      out = out | e;
      is_found = true;
    }
    if (!is_found) return unknown_name("effect", word, known).in("effects");
  }
  return out;
}

/// Names of commands that there are; "lua.eval" is one here.
Result<std::vector<std::string>> commands_of(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(std::vector<std::string> given, words(args, "commands"));
  for (const std::string& name : given)
    if (name != "lua.eval" && !ctx.app.commands.find(name))
      return ctx.app.commands.unknown(name).in("commands");
  return given;
}

std::filesystem::path path_of(const Map& args, std::string_view name) {
  return text_of(args, name);
}

Map server_value(const Server& server) {
  List addresses;
  for (const Address& a : server.addresses()) addresses.emplace_back(a.text());
  const ServerOptions& o = server.options();
  return Map{{"addresses", std::move(addresses)},
             {"has_tls", !o.certificate.empty()},
             {"needs_token", o.needs_token},
             {"browser", o.browser},
             {"token_file", server.tokens_file().string()},
             {"clients", server.clients().size()},
             {"threads", server.threads()},
             {"limits", limits_value(o.limits)}};
}

Result<Value> start(CommandContext& ctx, const Map& args) {
  ServerOptions o;
  RMP_TRY_ASSIGN(const std::vector<std::string> addresses, words(args, "addresses"));
  for (const std::string& text : addresses) {
    RMP_TRY_ASSIGN(Address a, Address::parse(text));
    o.addresses.push_back(std::move(a));
  }
  o.certificate = path_of(args, "certificate");
  o.key = path_of(args, "key");
  o.tls_everywhere = flag(args, "tls_everywhere");
  o.token_file = path_of(args, "token_file");
  o.needs_token = flag(args, "needs_token");
  o.browser = flag(args, "browser");
  RMP_TRY_ASSIGN(o.origins, words(args, "origins"));
  o.audit = path_of(args, "audit");
  if (!o.certificate.empty() || !o.key.empty()) RMP_TRY(require(Effect::files_read));
  if (!o.audit.empty()) RMP_TRY(require(Effect::files_write));
  RMP_TRY_ASSIGN(o.without_token.effects, effects_of(args, kUsualEffects));
  RMP_TRY_ASSIGN(o.without_token.commands, commands_of(ctx, args));
  if (const auto folder = path_of(args, "folder"); !folder.empty()) {
    std::error_code ec;
    o.without_token.folder = std::filesystem::canonical(folder, ec);
    if (ec || !std::filesystem::is_directory(o.without_token.folder, ec))
      return error(ErrorCode::not_found, "there is no folder " + text::quote(folder.string()),
                   "Create the folder first.", "folder");
  }
  if (const Value* limits = args.find("limits"); limits && limits->as_map()) {
    RMP_TRY_ASSIGN(o.limits, limits_from(*limits->as_map()));
  }
  RMP_TRY(servers(ctx).start(std::move(o)));
  const auto server = servers(ctx).running();
  return server ? Value(server_value(*server)) : Value();
}

Result<Value> stop(CommandContext& ctx, const Map&) {
  auto server = servers(ctx).release();
  if (!server) return Value(false);
  // A client's command runs on a thread of the server, which cannot wait for its own end.
  if (ctx.session.kind() == SessionKind::connection)
    Executor::of_process().run([server = std::move(server)]() mutable { server.reset(); });
  return Value(true);
}

Result<Value> status(CommandContext& ctx, const Map&) {
  const auto server = servers(ctx).running();
  if (!server) return Value(Map{{"is_running", false}});
  Map out = server_value(*server);
  out.set("is_running", true);
  return Value(std::move(out));
}

Result<Value> clients(CommandContext& ctx, const Map&) {
  List out;
  if (const auto server = servers(ctx).running())
    for (const ClientInfo& c : server->clients())
      out.emplace_back(Map{{"number", static_cast<std::int64_t>(c.number)},
                           {"session", static_cast<std::int64_t>(c.session)},
                           {"name", c.name},
                           {"token", c.token},
                           {"peer", c.peer},
                           {"protocol", c.protocol},
                           {"has_tls", c.has_tls},
                           {"seconds", c.seconds},
                           {"requests", static_cast<std::int64_t>(c.requests)},
                           {"bytes_in", static_cast<std::int64_t>(c.bytes_in)},
                           {"bytes_out", static_cast<std::int64_t>(c.bytes_out)},
                           {"waiting", c.waiting}});
  return Value(std::move(out));
}

Result<Value> kick(CommandContext& ctx, const Map& args) {
  const auto number = static_cast<std::uint64_t>(integer(args, "client"));
  const auto server = servers(ctx).running();
  if (!server || !server->kick(number, text_of(args, "reason")))
    return error(ErrorCode::unknown_name, "there is no client " + std::to_string(number),
                 "server.clients() lists them.", "client");
  return Value();
}

/// The file of tokens that is meant: the one that is named, that of the server, or the user's.
Result<Tokens> tokens_file(CommandContext& ctx, const Map& args) {
  std::filesystem::path file = path_of(args, "token_file");
  if (file.empty())
    if (const auto server = servers(ctx).running()) file = server->tokens_file();
  return Tokens::open(file.empty() ? Tokens::usual_file() : file);
}

Result<Value> grant(CommandContext& ctx, const Map& args) {
  Rights rights;
  rights.name = text_of(args, "name");
  RMP_TRY_ASSIGN(rights.effects, effects_of(args, kUsualEffects));
  RMP_TRY_ASSIGN(rights.commands, commands_of(ctx, args));
  rights.folder = path_of(args, "folder");
  rights.rate = static_cast<std::uint64_t>(integer(args, "rate"));
  const Value* valid = args.find("valid_for");
  const double seconds = valid ? std::ceil(valid->number()) : 0;
  RMP_TRY_ASSIGN(Tokens tokens, tokens_file(ctx, args));
  RMP_TRY_ASSIGN(std::string secret,
                 tokens.grant(std::move(rights), static_cast<std::int64_t>(seconds)));
  return Value(std::move(secret));
}

Result<Value> revoke(CommandContext& ctx, const Map& args) {
  const std::string name = text_of(args, "name");
  RMP_TRY_ASSIGN(Tokens tokens, tokens_file(ctx, args));
  RMP_TRY(tokens.revoke(name));
  const auto server = servers(ctx).running();
  const bool is_own = server && server->tokens_file() == tokens.file();
  return Value(is_own ? server->kick_token(name, "The token was revoked.") : std::size_t{0});
}

Result<Value> list_tokens(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const Tokens tokens, tokens_file(ctx, args));
  RMP_TRY_ASSIGN(const std::vector<Token> all, tokens.list());
  List out;
  for (const Token& t : all) {
    List effects, commands;
    for (const Effect e : t.rights.effects.list()) effects.emplace_back(to_string(e));
    for (const std::string& c : t.rights.commands) commands.emplace_back(c);
    Map one{{"name", t.rights.name},
            {"effects", std::move(effects)},
            {"commands", std::move(commands)},
            {"folder", t.rights.folder.string()},
            {"rate", static_cast<std::int64_t>(t.rights.rate)},
            {"created", t.created}};
    if (t.expires) one.append("expires", t.expires);
    out.emplace_back(std::move(one));
  }
  return Value(std::move(out));
}

ParamSpec token_file_param() {
  return optional("token_file", "path", "",
                  "File of the tokens; by default that of the running server, otherwise "
                  "robomosp/tokens.json in the user's folder of settings.");
}
ParamSpec effects_param(const char* whose) {
  return optional("effects", "any", "",
                  std::string("What ") + whose +
                      " may do: some of reads, edits, simulates, files_read, files_write, "
                      "processes, providers; by default reads, edits and simulates.");
}
ParamSpec commands_param() {
  return optional(
      "commands", "any", "",
      "Commands granted by name, whatever their effects: commands that load code, stop the program "
      "or administer can only be granted by name; \"lua.eval\" runs scripts in the program.");
}

std::vector<ParamSpec> server_fields() {
  return {field("addresses", "list", "", "Its addresses, with the chosen ports."),
          field("has_tls", "bool", "", "Whether it has a certificate."),
          field("needs_token", "bool", "", "Whether clients on this machine need a token, too."),
          field("browser", "bool", "", "Whether it serves its page to browsers."),
          field("token_file", "string", "", "File of its tokens."),
          field("clients", "int", "", "Number of open connections."),
          field("threads", "int", "", "Number of threads that serve them."),
          field("limits", "map", "", "All limits by name.")};
}

}  // namespace

RMP_COMMANDS(server_commands) {
  std::vector<CommandSpec> all;
  all.push_back(
      {.name = "server.start",
       .classic = "",
       .summary = "Starts a server: other programs can connect and work on this world.",
       .details = "They use JSON-RPC or classic lines, as described on the page about the "
                  "protocol; each is a session with its own undo. On an address of this machine "
                  "neither TLS nor a token is needed; any other address needs both.",
       .example = "local s = server.start{addresses = {\"127.0.0.1:0\"}}\n"
                  "assert(#s.addresses == 1 and s.clients == 0)\nserver.stop()",
       .params =
           {optional("addresses", "any", "",
                     "A string or a list of strings HOST:PORT, [IPv6]:PORT or unix:PATH; port 0 "
                     "takes a free one; default: 127.0.0.1:7007."),
            optional("certificate", "path", "", "PEM file with the certificate and its chain."),
            optional("key", "path", "", "PEM file with the private key, mode 600."),
            defaulted("tls_everywhere", "bool", "", false,
                      "TLS also on addresses of this machine."),
            token_file_param(),
            defaulted("needs_token", "bool", "", false,
                      "Clients on this machine need a token, too."),
            effects_param("a client without a token"), commands_param(),
            optional("folder", "path", "",
                     "Folder in which clients without a token read and write files; by default "
                     "anywhere."),
            optional("limits", "map", "",
                     "Limits by name, such as {seconds = 60}; server.status shows all."),
            defaulted("browser", "bool", "", false,
                      "Browsers can connect, too: a page at the same address shows the world, and "
                      "WebSockets carry the protocol. Without a token they can only view."),
            optional("origins", "any", "",
                     "A string or a list of strings: origins of other pages that may connect, such "
                     "as https://robots.example, which is also a name of this server."),
            optional("audit", "path", "",
                     "File to which a line of JSON is appended for each request.")},
       .returns = {"map", "", "The server.", server_fields()},
       .effect = Effect::administers | Effect::simulates,
       .sometimes = Effect::files_read | Effect::files_write,
       .run = start});
  all.push_back({.name = "server.stop",
                 .classic = "",
                 .summary = "Notifies all clients and stops the server.",
                 .details = "Their running commands and jobs are cancelled.",
                 .example = "assert(server.stop() == false)  -- none was running",
                 .params = {},
                 .returns = {"bool", "", "Whether a server was running.", {}},
                 .effect = Effect::administers | Effect::simulates,
                 .run = stop});
  auto fields = server_fields();
  fields.push_back(field("is_running", "bool", "",
                         "Whether there is a server; all other fields are absent if not."));
  all.push_back({.name = "server.status",
                 .classic = "",
                 .summary = "Returns the addresses of the server, and its limits.",
                 .details = "",
                 .example = "assert(not server.status().is_running)",
                 .params = {},
                 .returns = {"map", "", "The server.", std::move(fields)},
                 .effect = Effect::administers,
                 .run = status});
  all.push_back({.name = "server.clients",
                 .classic = "",
                 .summary = "Lists the connections.",
                 .details = "",
                 .example = "assert(#server.clients() == 0)",
                 .params = {},
                 .returns = {"list",
                             "",
                             "One entry for each.",
                             {field("number", "int", "", "Number for server.kick."),
                              field("session", "int", "",
                                    "Name of the session that its changes are listed under."),
                              field("name", "string", "", "Name given by the client."),
                              field("token", "string", "", "Name of its token."),
                              field("peer", "string", "", "Address of the client."),
                              field("protocol", "string", "",
                                    "json, classic or websocket; empty before its first message."),
                              field("has_tls", "bool", "", "Whether it is encrypted."),
                              field("seconds", "real", "s", "Time since it connected."),
                              field("requests", "int", "", "Number of requests received."),
                              field("bytes_in", "int", "", "Bytes received."),
                              field("bytes_out", "int", "", "Bytes sent."),
                              field("waiting", "int", "", "Number of queued requests.")}},
                 .effect = Effect::administers,
                 .run = clients});
  all.push_back({.name = "server.kick",
                 .classic = "",
                 .summary = "Closes a connection.",
                 .details = "Its running commands are cancelled. With its token it may reconnect; "
                            "server.revoke prevents this.",
                 .example = "assert(not pcall(server.kick, 1))  -- nobody is connected",
                 .params = {between(needed("client", "int", "", "Its number."), 1, 9e15),
                            defaulted("reason", "string", "", "Closed by the operator.",
                                      "Reason given to the client.")},
                 .returns = {},
                 .effect = Effect::administers | Effect::simulates,
                 .run = kick});
  all.push_back(
      {.name = "server.grant",
       .classic = "",
       .summary = "Creates a token that lets a client connect, and returns its secret.",
       .details = "The secret is shown only this once: only its hash is kept, in a file that only "
                  "its owner may read. It is valid at once, also for a server of another program "
                  "that uses the file.",
       .example = "local file = os.tmpname() .. \".tokens\"\n"
                  "local secret = server.grant{name = \"student\", valid_for = 3600, token_file = "
                  "file}\n"
                  "assert(#secret == 47)\n"
                  "server.revoke{name = \"student\", token_file = file}\nos.remove(file)\n"
                  "os.remove(file .. \".lock\")",
       .params = {needed("name", "string", "", "Letters, digits, - _ and . up to 64."),
                  effects_param("it"), commands_param(),
                  optional("folder", "path", "",
                           "Folder for files to read and write; by default anywhere."),
                  between(defaulted("rate", "int", "", 0,
                                    "Requests per second; 0 means the server's limit."),
                          0, 1e7),
                  between(optional("valid_for", "real", "s",
                                   "Time until it expires; by default never."),
                          1, kLongestValidity),
                  token_file_param()},
       .returns = {"string", "", "The secret.", {}},
       .effect = Effect::administers | Effect::files_write,
       .run = grant});
  all.push_back({.name = "server.revoke",
                 .classic = "",
                 .summary = "Revokes a token and closes its connections.",
                 .details = "",
                 .example = "assert(not pcall(server.revoke, {name = \"nobody\", token_file = "
                            "os.tmpname() .. \".tokens\"}))",
                 .params = {needed("name", "string", "", "Name of the token."), token_file_param()},
                 .returns = {"int", "", "Number of connections closed.", {}},
                 .effect = Effect::administers | Effect::files_write,
                 .run = revoke});
  all.push_back(
      {.name = "server.tokens",
       .classic = "",
       .summary = "Lists the tokens.",
       .details = "",
       .example = "assert(#server.tokens{token_file = \"none_here\"} == 0)",
       .params = {token_file_param()},
       .returns = {"list",
                   "",
                   "One entry for each.",
                   {field("name", "string", "", "Its name."),
                    field("effects", "list", "", "Its permitted effects."),
                    field("commands", "list", "", "Commands granted by name."),
                    field("folder", "string", "", "Its folder for files; empty = anywhere."),
                    field("rate", "int", "", "Requests per second; 0 means the server's limit."),
                    field("created", "int", "", "Seconds since 1970."),
                    field("expires", "int", "",
                          "Time of expiry, in seconds since 1970; absent = never.")}},
       .effect = Effect::administers | Effect::files_read,
       .run = list_tokens});
  return all;
}

}  // namespace robomosp::remote
