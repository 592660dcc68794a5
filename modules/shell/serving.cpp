// SPDX-License-Identifier: Apache-2.0
#include "shell/serving.h"

#include <poll.h>
#include <signal.h>

#include <optional>
#include <utility>

#include "kernel/text.h"
#include "remote/debug_adapter.h"
#include "remote/language_server.h"
#include "remote/server.h"

namespace robomosp::shell {

using remote::RpcServer;

Result<Map> ServeSettings::arguments() const {
  Map args;
  const auto words = [](const std::vector<std::string>& from) {
    List out;
    for (const std::string& word : from) out.emplace_back(word);
    return out;
  };
  if (!listen.empty()) args.set("addresses", words(listen));
  if (!allow.empty()) args.set("effects", words(allow));
  if (!grant.empty()) args.set("commands", words(grant));
  for (const auto& [name, value] : {std::pair("certificate", &certificate),
                                    {"key", &key},
                                    {"token_file", &token_file},
                                    {"folder", &folder},
                                    {"audit", &audit}})
    if (!value->empty()) args.set(name, *value);
  if (needs_token) args.set("needs_token", true);
  if (tls_everywhere) args.set("tls_everywhere", true);
  if (browser) args.set("browser", true);
  if (!origins.empty()) args.set("origins", words(origins));
  Map bounds;
  for (const std::string& word : limits) {
    const auto equals = word.find('=');
    const auto number = equals == std::string::npos
                            ? std::optional<double>()
                            : text::read_real(std::string_view(word).substr(equals + 1));
    if (!number)
      return error(ErrorCode::usage, text::quote(word) + " is not a limit",
                   "Write --limit seconds=60.");
    bounds.set(word.substr(0, equals), *number);
  }
  if (!bounds.empty()) args.set("limits", std::move(bounds));
  return args;
}

namespace {

/// Where a browser finds the page of a server: the first address that is not a file.
std::string page_address(const Map& server, bool tls_everywhere) {
  const bool has_tls = *server.find("has_tls")->as_bool();
  for (const Value& a : *server.find("addresses")->as_list()) {
    const auto address = remote::Address::parse(*a.as_string());
    if (!address.ok() || address->is_unix) continue;
    const bool is_every =
        address->host.empty() || address->host == "0.0.0.0" || address->host == "::";
    const bool is_six = address->host.find(':') != std::string::npos && !is_every;
    const std::string host = is_every ? "localhost"
                             : is_six ? "[" + address->host + "]"
                                      : address->host;
    return (has_tls && (tls_everywhere || !address->is_local()) ? "https://" : "http://") + host +
           ":" + std::to_string(address->port) + "/";
  }
  return "through a proxy to the socket";
}

}  // namespace

int run_rpc(const Settings& s, Voice& voice) {
  const int answers = voice.keep_output();
  Program p;
  if (auto started = start(p, s, voice, "rpc"); !started.ok()) return voice.fail(started.error());
  p.session->show_progress = {};
  RpcServer server(*p.app, *p.session, *p.lua);
  p.rpc = &server;
  const int code = remote::serve(*p.app, *p.session, server, STDIN_FILENO, answers);
  return p.lua->exit_requested().value_or(code);
}

int run_language_server(const Settings& s, Voice& voice) {
  const int answers = voice.keep_output();
  Program p;
  if (auto started = start(p, s, voice, "language-server"); !started.ok())
    return voice.fail(started.error());
  return remote::serve_editor(*p.app, STDIN_FILENO, answers);
}

int run_debug_adapter(const Settings& s, Voice& voice) {
  const int answers = voice.keep_output();
  Program p;
  if (auto started = start(p, s, voice, "debug-adapter"); !started.ok())
    return voice.fail(started.error());
  p.session->show_progress = {};
  return remote::serve_debugger(*p.app, *p.session, *p.lua, p.printed, STDIN_FILENO, answers);
}

int run_serve(const Settings& s, const Voice& voice, const ServeSettings& how) {
  constexpr int kLook = 100;  // ms
  const auto args = how.arguments();
  if (!args.ok()) return voice.fail(args.error());
  Program p;
  if (auto started = start(p, s, voice, "serve"); !started.ok()) return voice.fail(started.error());
  struct sigaction action {};
  action.sa_handler = on_interrupt;
  ::sigaction(SIGTERM, &action, nullptr);
  if (!how.script.empty()) {
    const auto done = p.lua->run_file(how.script);
    if (const auto code = p.lua->exit_requested()) return *code;
    if (!done.ok()) return voice.fail(done.error(), p.lua->traceback());
  }
  const auto server = p.app->dispatch(*p.session, "server.start", *args);
  if (!server.ok()) return voice.fail(server.error());
  if (voice.json()) {
    voice.result(*server, {});
  } else if (const Map* m = server->as_map()) {
    std::string where;
    for (const Value& a : *m->find("addresses")->as_list())
      where += (where.empty() ? "" : ", ") + *a.as_string();
    voice.line("Listening on " + where);
    if (how.browser) voice.line("The page: " + page_address(*m, how.tls_everywhere));
  }
  const Wake wake(*p.lua);
  while (!p.session->interrupted() && !p.app->quit_requested) {
    pollfd ready{wake.fd(), POLLIN, 0};
    if (::poll(&ready, 1, kLook) > 0) wake.rest();
    p.lua->serve();
  }
  (void)p.app->kept<remote::Servers>().release();
  settle(p);
  return 0;
}

}  // namespace robomosp::shell
