// SPDX-License-Identifier: Apache-2.0
#include "shell/connecting.h"

#include <sys/stat.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <iostream>
#include <utility>

#include "kernel/letters.h"
#include "kernel/text.h"
#include "remote/client_host.h"
#include "shell/console.h"
#include "shell/interactive.h"
#include "shell/pager.h"

namespace robomosp::shell {

namespace {

/// A file that its owner only can read, as whoever has the token has its rights.
Result<std::string> token_from(const std::string& file) {
  const auto no = [&file](const std::string& why, std::string hint) {
    return error(ErrorCode::io, "the token file " + text::quote(file) + " " + why, std::move(hint),
                 "--token-file");
  };
  struct stat about {};
  if (::stat(file.c_str(), &about) != 0)
    return no(std::string("cannot be read: ") + std::strerror(errno), "Check its name.");
  if (!S_ISREG(about.st_mode)) return no("is not a file", "Check its name.");
  if ((about.st_mode & 077U) != 0) return no("can be read by others", "chmod 600 " + file);
  std::ifstream in(file);
  std::string token;
  std::getline(in, token);
  token = std::string(text::trim(token));
  if (token.empty()) return no("is empty", "Write the token from server.grant into it.");
  return token;
}

}  // namespace

int run_program(const Settings& s, Voice& voice, const IrlWords& words) {
  IrlSettings how = words.settings;
  if (!words.token_file.empty()) {
    auto token = token_from(words.token_file);
    if (!token.ok()) return voice.fail(token.error());
    how.token = std::move(*token);
  }
  if (const auto sound = check_irl(how); !sound.ok()) return voice.fail(sound.error());
  Program p;
  if (auto started = start(p, s, voice, "irl"); !started.ok()) return voice.fail(started.error());
  p.session->show_progress = {};
  IrlVoice to;
  to.is_json = s.json, to.is_quiet = s.quiet, to.is_traced = s.trace;
  to.text = [](std::string_view piece) {
    const std::string shown = text::visible(piece);
    std::fwrite(shown.data(), 1, shown.size(), stdout);
    std::fflush(stdout);
  };
  to.tell = [](std::string_view line) {
    std::fprintf(stderr, "%s\n", text::visible(line).c_str());
  };
  to.fail = [&voice](const Error& e) { return voice.fail(e); };
  to.result = [&voice](const Value& value) { voice.result(value, {}); };
  return run_irl(*p.app, *p.session, how, to);
}

/// The console of another program: scripts run here, commands there.
int run_connect(const Settings& s, Voice& voice, const ConnectSettings& how) {
  const auto address = remote::Address::parse(how.address);
  if (!address.ok()) return voice.fail(address.error());
  remote::ClientOptions options;
  options.address = *address;
  options.name = "console";
  options.certificate = how.certificate;
  options.seconds = how.seconds;
  options.wants_notes = !s.quiet && !s.json;
  if (how.tls || !how.certificate.empty()) options.tls = true;
  if (how.no_tls) options.tls = false;
  if (!how.token_file.empty()) {
    auto token = token_from(how.token_file);
    if (!token.ok()) return voice.fail(token.error());
    options.token = std::move(*token);
  }
  ioci::Session user("connect", ioci::SessionKind::console);
  catch_interrupts(user);
  NoProgress none;
  auto client = remote::Client::connect(std::move(options), none);
  if (!client.ok()) {
    Error e = client.error();
    if (e.code == ErrorCode::permission && how.token_file.empty())
      e.hint = "Get a token from the server's administrator, and give its file with --token-file.";
    return voice.fail(e);
  }
  auto made = remote::ClientHost::make(std::move(*client), user,
                                       [&voice](const std::string& words) { voice.warn(words); });
  if (!made.ok()) return voice.fail(made.error());
  remote::ClientHost& host = **made;
  lua::LuaOptions lua_options;
  lua_options.input_name = "console";
  lua_options.print = [&s](std::string_view text) {
    std::FILE* const to = s.json ? stderr : stdout;
    std::fwrite(text.data(), 1, text.size(), to);
    std::fflush(to);
  };
  if (!s.json && ::isatty(STDOUT_FILENO) != 0)
    lua_options.width = [] { return terminal_size().columns; };
  lua::LuaState lua(std::move(*made), std::move(lua_options));
  const NameOf names = [&host](const Handle& h) { return host.name_of(h).value_or(""); };
  std::string pending;
  Notes notes;
  const auto take = [&](const std::string& line) -> std::optional<int> {
    pending += (pending.empty() ? "" : "\n") + line;
    if (lua.is_incomplete(pending)) return std::nullopt;
    const int code = evaluate(lua, names, voice, std::exchange(pending, {}));
    host.tell_warnings();
    for (const auto& [word, text] : host.take_notes()) notes.add(word, text);
    for (const std::string& note : notes.fresh()) voice.note(note);
    return code;
  };
  if (::isatty(STDIN_FILENO) == 0 || ::isatty(STDOUT_FILENO) == 0 || s.json) {
    std::string line;
    while (std::getline(std::cin, line)) {
      if (pending.empty() && is_leaving(line)) return 0;
      if (const auto code = take(line); code && *code != 0) return *code;
    }
    return pending.empty() ? 0 : evaluate(lua, names, voice, pending);
  }
  if (!voice.quiet()) {
    const Map& hello = host.client().hello();
    const auto word = [&hello](const char* key) {
      const Value* v = hello.find(key);
      return v && v->as_string() ? *v->as_string() : std::string();
    };
    std::string effects;
    if (const Value* list = hello.find("effects"); list && list->as_list())
      for (const Value& one : *list->as_list())
        effects += (effects.empty() ? "" : ", ") + (one.as_string() ? *one.as_string() : "");
    voice.line(how.address + ": ROBOMOSP " + word("version") + " with " +
               std::to_string(host.list().size()) + " commands" +
               (word("token").empty() ? "" : ", token " + word("token")) + " (" + effects + ").");
    voice.line(
        "help() explains, TAB completes, Ctrl-C stops a command, Ctrl-D leaves; the server keeps "
        "running.");
  }
  voice.page_results();
  LineEditor editor(lua, [&user] {
    count_interrupts_anew();
    const bool interrupted = user.interrupted();
    user.clear_interrupt();
    return interrupted;
  });
  for (;;) {
    host.tell_warnings();
    const auto line = editor.read(pending.empty() ? how.address + "> " : ">> ", pending);
    if (line.outcome == LineEditor::Outcome::cancelled) {
      editor.remember(std::string(text::trim(pending)));
      pending.clear();
      continue;
    }
    if (line.outcome == LineEditor::Outcome::end) {
      voice.line("");
      return 0;
    }
    if (pending.empty() && is_leaving(line.text)) return 0;
    const std::string whole = pending.empty() ? line.text : pending + "\n" + line.text;
    user.clear_interrupt();
    if (take(line.text)) editor.remember(whole);
  }
}

}  // namespace robomosp::shell
