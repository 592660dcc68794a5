// SPDX-License-Identifier: Apache-2.0
#include "shell/program.h"

#include <signal.h>

#include <algorithm>
#include <atomic>
#include <chrono>

#include "ioci/core/kept_solvers.h"
#include "ioci/core/lua_plugins.h"
#include "ioci/core/watchers.h"
#include "kernel/plugin_loader.h"
#include "kernel/text.h"
#include "shell/pager.h"
#include "spatial/instruction_limit.h"

namespace robomosp::shell {

namespace {

std::atomic<ioci::Session*> interrupted_session{nullptr};
std::atomic<int> impatience{0};
static_assert(std::atomic<ioci::Session*>::is_always_lock_free);

/// A bar on standard error, when that is a terminal.
std::function<void(double, std::string_view)> progress_bar() {
  return [last = std::chrono::steady_clock::time_point()](double fraction,
                                                          std::string_view what) mutable {
    const auto now = std::chrono::steady_clock::now();
    if (fraction >= 1) return progress_line().erase();
    if (now - last < std::chrono::milliseconds(100)) return;
    last = now;
    progress_line().show(fraction, what);
  };
}

/// Results of a console input as one Value: nothing, the value, or a list of several.
Value joined(List values) {
  if (values.empty()) return {};
  if (values.size() == 1) return std::move(values.front());
  return values;
}

}  // namespace

void on_interrupt(int) {
  ioci::Session* session = interrupted_session.load();
  if (session) session->interrupt();
  if (!session || impatience.fetch_add(1) >= 3) ::_exit(130);
}

void catch_interrupts(ioci::Session& session) {
  interrupted_session = &session;
  struct sigaction action {};
  action.sa_handler = on_interrupt;  // no SA_RESTART: a blocking read must notice
  ::sigaction(SIGINT, &action, nullptr);
  ::signal(SIGPIPE, SIG_IGN);
}

void count_interrupts_anew() { impatience = 0; }

Program::~Program() {
  interrupted_session = nullptr;
  if (app && subscription) app->messages.unsubscribe(subscription);
  lua.reset();
}

bool is_interactive(const Settings& s) {
  return ::isatty(STDIN_FILENO) != 0 && ::isatty(STDOUT_FILENO) != 0 && !s.json;
}

Result<void> start(Program& p, const Settings& s, const Voice& voice, std::string session_name) {
  ioci::ApplicationOptions options;
  options.plugin_path.assign(s.plugin_path.begin(), s.plugin_path.end());
  options.library.assign(s.library.begin(), s.library.end());
  options.cache = !s.no_cache;
  options.kept_geometry = FileCache::user_folder();
  options.kept_geometry_limit = FileCache::user_limit();
  options.plugins = !s.no_plugins;
  if (session_name == "console" || session_name == "script" || session_name == "rpc" ||
      session_name == "serve")
    options.recovery = io::recovery_folder();
  if (session_name == "console" && !is_interactive(s)) options.recovery_program = kPiped;
  RMP_TRY_ASSIGN(p.app, ioci::Application::create(std::move(options)));
  const auto show = [&voice, &p](const Message& m) {
    if (m.severity >= Severity::warning) voice.warn(m.text);
    else if (p.notes) p.notes->take(m);
  };
  for (const Message& m : p.app->messages.recent()) show(m);
  if (const std::string words = spatial::instruction_set_complaint(); !words.empty())
    voice.warn(words);
  p.subscription = p.app->messages.subscribe(show);
  const auto kind = session_name == "console" ? ioci::SessionKind::console
                    : session_name == "rpc"   ? ioci::SessionKind::connection
                                              : ioci::SessionKind::script;
  if (s.trust) p.app->kept_solvers->trust_all();
  p.session = std::make_unique<ioci::Session>(std::move(session_name), kind);
  if (!s.quiet && !s.json && ::isatty(STDERR_FILENO)) p.session->show_progress = progress_bar();
  lua::LuaOptions lua_options;
  lua_options.input_name = p.session->name();
  lua_options.print = [&p](std::string_view text) {
    if (p.rpc) {
      p.rpc->printed += text;
      return;
    }
    if (p.printed) return p.printed(text);
    progress_line().erase();
    // With --json standard output carries JSON only, and this is standard error.
    std::fwrite(text.data(), 1, text.size(), stdout);
    std::fflush(stdout);
  };
  if (!s.json && ::isatty(STDOUT_FILENO) != 0)
    lua_options.width = [] { return terminal_size().columns; };
  p.lua = std::make_unique<lua::LuaState>(*p.app, *p.session, std::move(lua_options));
  catch_interrupts(*p.session);
  if (!s.no_plugins)
    p.lua->load_plugins(
        ioci::lua_plugins(PluginLoader::search_path({s.plugin_path.begin(), s.plugin_path.end()})));
  if (kind == ioci::SessionKind::console || p.session->name() == "eval")
    p.notes = std::make_unique<Notes>();
  return {};
}

void settle(Program& p) {
  (void)p.app->watchers->settle([&p] { return p.session->interrupted(); });
}

int evaluate(lua::LuaState& lua, const NameOf& names, const Voice& voice,
             const std::string& input) {
  impatience = 0;
  if (voice.json()) {
    auto values = lua.eval_values(input);
    if (const auto code = lua.exit_requested()) return *code;
    if (!values.ok()) return voice.fail(values.error(), lua.traceback());
    voice.result(joined(std::move(*values)), {}, names);
    return 0;
  }
  const auto text = lua.eval(input);
  if (const auto code = lua.exit_requested()) return *code;
  if (!text.ok()) return voice.fail(text.error(), lua.traceback());
  voice.result({}, *text);
  return 0;
}
int evaluate(Program& p, const Voice& voice, const std::string& input) {
  const int code = evaluate(*p.lua, p.names(), voice, input);
  if (p.notes)
    for (const std::string& note : p.notes->fresh()) voice.note(note);
  return code;
}

}  // namespace robomosp::shell
