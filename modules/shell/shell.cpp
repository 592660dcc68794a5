// SPDX-License-Identifier: Apache-2.0
#include "shell/shell.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iostream>
#include <set>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>

#include <robomosp/sdk/csg.h>
#include <robomosp/sdk/curve.h>
#include <robomosp/sdk/dynamics.h>
#include <robomosp/sdk/ik.h>
#include <robomosp/sdk/plugin.h>

#include "ioci/core/application.h"
#include "ioci/core/kept_solvers.h"
#include "ioci/core/lua_plugins.h"
#include "ioci/core/watchers.h"
#include "ioci/program/packs.h"
#include "kernel/letters.h"
#include "kernel/plugin_loader.h"
#include "kernel/text.h"
#include "lua/lua_state.h"
#include "remote/client_host.h"
#include "remote/debug_adapter.h"
#include "remote/json.h"
#include "remote/language_server.h"
#include "remote/lua_child.h"
#include "remote/rpc.h"
#include "remote/server.h"
#include "shell/console.h"
#include "shell/irl.h"
#include "shell/pager.h"
#include "shell/plugin_check.h"
#include "shell/post_test.h"
#include "spatial/instruction_limit.h"

#ifndef ROBOMOSP_VERSION
#define ROBOMOSP_VERSION "0"
#endif

namespace robomosp::shell {
using remote::error_map;
using remote::NameOf;
using remote::RpcServer;
using remote::to_json;

int exit_code(ErrorCode code) {
  switch (code) {
    case ErrorCode::usage: return 2;
    case ErrorCode::invalid_argument:
    case ErrorCode::unknown_name:
    case ErrorCode::not_found:
    case ErrorCode::syntax:
    case ErrorCode::conflict:
    case ErrorCode::stale_handle:
    case ErrorCode::plugin_refused:
    case ErrorCode::permission:
    case ErrorCode::unsupported: return 3;
    case ErrorCode::unreachable: return 4;
    case ErrorCode::cancelled: return 130;
    case ErrorCode::io:
    case ErrorCode::plugin_failed:
    case ErrorCode::internal:
    case ErrorCode::script_failed: return 1;
  }
  return 1;
}

namespace {

// --- Ctrl-C
// ---------------------------------------------------------------------------------------

std::atomic<ioci::Session*> interrupted_session{nullptr};
std::atomic<int> impatience{0};
static_assert(std::atomic<ioci::Session*>::is_always_lock_free);

/// The first Ctrl-C asks the script to stop; the fourth without effect ends the program, for the
/// few C functions that cannot be asked.
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

// --- what the command line says
// ---------------------------------------------------------------------

struct Settings {
  bool json = false, quiet = false, no_cache = false, no_plugins = false, trace = false,
       trust = false;
  std::string color = "auto";
  std::vector<std::string> plugin_path, library;
};

/// The line of a terminal that shows the progress of a command. Whatever else is printed erases it
/// first. [any thread]
class ProgressLine {
 public:
  void show(double fraction, std::string_view what) {
    std::string words = text::visible(what);
    std::replace(words.begin(), words.end(), '\n', ' ');
    std::fprintf(stderr, "\r[%3d%%] %s\x1b[K", static_cast<int>(fraction * 100), words.c_str());
    is_shown_ = true;
  }
  void erase() {
    if (is_shown_.exchange(false)) std::fprintf(stderr, "\r\x1b[K");
  }

 private:
  std::atomic<bool> is_shown_ = false;
};

ProgressLine& progress_line() {
  static ProgressLine line;
  return line;
}

/// Speaks to the user: results on standard output, everything else on standard error.
class Voice {
 public:
  explicit Voice(const Settings& s) : settings_(s) {
    const char* no_color = std::getenv("NO_COLOR");
    color_ = s.color == "always" ||
             (s.color == "auto" && ::isatty(STDERR_FILENO) != 0 && !(no_color && *no_color));
  }
  /// From here on standard output carries answers only: whatever else is written to it, by
  /// scripts, by programs that they run and by libraries, goes to standard error. Returns the
  /// descriptor of the answers.
  int keep_output() {
    std::fflush(stdout);
    const int fd = ::fcntl(STDOUT_FILENO, F_DUPFD_CLOEXEC, STDERR_FILENO + 1);
    std::FILE* answers = fd < 0 ? nullptr : ::fdopen(fd, "w");
    if (!answers || ::dup2(STDERR_FILENO, STDOUT_FILENO) < 0) return STDOUT_FILENO;
    out_ = answers;
    return fd;
  }
  [[nodiscard]] bool json() const { return settings_.json; }
  [[nodiscard]] bool quiet() const { return settings_.quiet; }

  /// Prints the error and returns its exit code.
  int fail(const Error& e, std::string_view trace = {}) const {
    const Error said = text::shortened(e);
    if (settings_.json) line(to_json(Map{{"ok", false}, {"error", error_map(said)}}));
    else to_stderr("error", "\x1b[31m", said.sentence());
    if (settings_.trace && !trace.empty())
      std::fprintf(stderr, "%s\n", text::visible(text::shortened(std::string(trace))).c_str());
    return exit_code(e.code);
  }
  void note(std::string_view text) const {
    if (!settings_.quiet && !settings_.json) to_stderr("note", "\x1b[36m", text);
  }
  void warn(std::string_view text) const {
    if (!settings_.quiet) to_stderr("warning", "\x1b[33m", text);
  }
  void line(std::string_view text) const {
    progress_line().erase();
    std::fwrite(text.data(), 1, text.size(), out_);
    std::fputc('\n', out_);
    std::fflush(out_);
  }
  /// Prints a result: text for people, {"ok": true, "value": ...} for programs.
  void result(const Value& value, std::string_view text, const NameOf& name_of = {}) const {
    if (settings_.json)
      line(to_json(value.is_nil() ? Map{{"ok", true}} : Map{{"ok", true}, {"value", value}},
                   name_of));
    else if (!text.empty()) show(text.ends_with('\n') ? text.substr(0, text.size() - 1) : text);
  }
  /// From here on results that are longer than the terminal are shown page by page.
  void page_results() { pages_ = true; }

 private:
  void show(std::string_view text) const {
    const std::string shown = text::visible(text);
    progress_line().erase();
    if (pages_) show_paged(shown);
    else line(shown);
  }
  void to_stderr(const char* word, const char* color, std::string_view text) const {
    const std::string shown = text::visible(text);
    progress_line().erase();
    std::fprintf(stderr, "%s%s:%s %s\n", color_ ? color : "", word, color_ ? "\x1b[0m" : "",
                 shown.c_str());
  }
  const Settings& settings_;
  std::FILE* out_ = stdout;
  bool color_ = false, pages_ = false;
};

/// Notes of the commands that are typed here, such as that 90 was taken as radians: once each, and
/// of many at once the first few.
class Notes {
 public:
  /// Of what is posted by the thread that makes this.
  void take(const Message& m) {
    if (m.severity == Severity::info && std::this_thread::get_id() == thread_) add(m.code, m.text);
  }
  void add(std::string_view code, const std::string& text) {
    // Not shown: messages that only report what a command did, or that no command caused.
    constexpr std::string_view kQuiet[] = {"audit",         "history_forgets", "ik_choice",
                                           "kept_geometry", "plugin_hidden",   "recovery"};
    if (std::find(std::begin(kQuiet), std::end(kQuiet), code) == std::end(kQuiet)) add(text);
  }
  void add(const std::string& text) {
    if (!told_.insert(text).second) return;
    if (fresh_.size() < kMost) fresh_.push_back(text);
    else ++more_;
  }
  /// Those since the last time.
  [[nodiscard]] std::vector<std::string> fresh() {
    if (more_ > 0)
      fresh_.push_back(std::to_string(more_) + (more_ == 1 ? " more note" : " more notes") +
                       ": message.list() lists all messages.");
    more_ = 0;
    return std::exchange(fresh_, {});
  }

 private:
  static constexpr std::size_t kMost = 5;
  const std::thread::id thread_ = std::this_thread::get_id();
  // Of that thread:
  std::set<std::string> told_;
  std::vector<std::string> fresh_;
  std::size_t more_ = 0;
};

/// The application with its session and Lua, as every subcommand but the light ones needs it.
struct Program {
  std::unique_ptr<ioci::Application> app;
  std::unique_ptr<ioci::Session> session;
  std::unique_ptr<lua::LuaState> lua;
  RpcServer* rpc = nullptr;                       ///< takes what scripts print while it serves
  std::function<void(std::string_view)> printed;  ///< the same, where it is set
  std::uint64_t subscription = 0;
  std::unique_ptr<Notes> notes;  ///< of a console

  [[nodiscard]] NameOf names() const {
    return [this](const Handle& h) { return app->name_of(h).value_or(""); };
  }
  ~Program() {
    interrupted_session = nullptr;
    if (app && subscription) app->messages.unsubscribe(subscription);
    lua.reset();
  }
};

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

/// What journals of consoles say that read their input from a file or a pipe.
constexpr const char* kPiped = "robomosp, input from a file";

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

/// Results of a console input as one Value: nothing, the value, or a list of several.
Value joined(List values) {
  if (values.empty()) return {};
  if (values.size() == 1) return std::move(values.front());
  return values;
}

// --- subcommands
// --------------------------------------------------------------------------------------

/// Files that follow edits are as the last edit left them when the program ends; Ctrl-C ends the
/// wait.
void settle(Program& p) {
  (void)p.app->watchers->settle([&p] { return p.session->interrupted(); });
}

int run_script(const Settings& s, const Voice& voice, const std::string& file,
               const std::vector<std::string>& args) {
  Program p;
  if (auto started = start(p, s, voice, "script"); !started.ok())
    return voice.fail(started.error());
  const auto done = p.lua->run_file(file, args);
  settle(p);
  if (const auto code = p.lua->exit_requested()) return *code;
  if (!done.ok()) return voice.fail(done.error(), p.lua->traceback());
  voice.result({}, {});
  return 0;
}

/// What `run --sandbox` was given beside the file.
struct Sandbox {
  bool is_wanted = false, without_seccomp = false;
  std::string allow = "reads,edits,simulates", limits;
};

Result<Effects> effects_from(std::string_view words) {
  Effects out;
  for (const std::string_view part : text::split(words, ',')) {
    const std::string_view word = text::trim(part);
    std::vector<std::string> known;
    bool is_known = false;
    for (const Effect e : kAllEffects) {
      known.emplace_back(to_string(e));
      if (known.back() != word) continue;
      out = out | e;
      is_known = true;
    }
    if (!is_known)
      return error(ErrorCode::usage, "there is no effect " + text::quote(std::string(word)),
                   "Effects: " + text::enumerate(known) + ".", "--allow");
  }
  return out;
}

/// A script of a stranger: in a process of its own, with some effects only.
int run_sandboxed(const Settings& s, const Voice& voice, const std::string& file,
                  const std::vector<std::string>& args, const Sandbox& sandbox) {
  const auto allowed = effects_from(sandbox.allow);
  if (!allowed.ok()) return voice.fail(allowed.error());
  remote::LuaChildOptions options;
  if (!sandbox.limits.empty()) {
    const auto limits = remote::lua_limits(sandbox.limits);
    if (!limits.ok()) return voice.fail(limits.error());
    options.limits = *limits;
  }
  options.without_seccomp = sandbox.without_seccomp;
  options.print = [&s](std::string_view text) {
    // With --json standard output carries JSON only, and this is standard error.
    std::FILE* const to = s.json ? stderr : stdout;
    std::fwrite(text.data(), 1, text.size(), to);
    std::fflush(to);
  };
  Program p;
  if (auto started = start(p, s, voice, "script"); !started.ok())
    return voice.fail(started.error());
  for (const Effect e : Effects::all().without(*allowed).list()) p.session->deny(e);
  remote::LuaChild child(*p.app, std::move(options));
  const auto done = child.run_file(file, args, *p.session);
  settle(p);
  if (!done.ok()) return voice.fail(done.error(), child.traceback());
  voice.result({}, {});
  return 0;
}

/// One input; prints its result. Returns the exit code.
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

int run_eval(const Settings& s, const Voice& voice, const std::string& code) {
  Program p;
  if (auto started = start(p, s, voice, "eval"); !started.ok()) return voice.fail(started.error());
  const int exit = evaluate(p, voice, code);
  settle(p);
  return exit;
}

/// What `robomosp post` was asked for.
struct PostSettings {
  std::string file, target, profile, robot, folder, form = "automatic", name, templates;
  std::string world, side_by_side, picture, plot, only_robot;
  bool check = false, run_check = false, overwrite = false;
};

/// Tells an error of a post and gives its exit code: what files and folders do not allow is wrong
/// input, as a name is that there is not.
int fail_post(const Voice& voice, const Error& e) {
  const int code = voice.fail(e);
  if (e.code == ErrorCode::unsupported) return 1;  // the target cannot say it
  return e.code == ErrorCode::io ? 3 : code;
}

/// Faults at places to standard error, "file:line:column: severity: sentence" a line.
void tell_faults(const Settings& s, const List& faults) {
  for (const Value& each : faults) {
    const Map& f = *each.as_map();
    if (s.quiet && *f.find("severity")->as_string() != "error") continue;
    const std::string hint = *f.find("hint")->as_string();
    std::fprintf(
        stderr, "%s\n",
        text::visible(*f.find("file")->as_string() + ":" + f.find("line")->text() + ":" +
                      f.find("column")->text() + ": " + *f.find("severity")->as_string() + ": " +
                      *f.find("message")->as_string() + (hint.empty() ? "" : " " + hint))
            .c_str());
  }
}

/// All that is wrong with a pack of templates, a line each; false = nothing is.
bool tell_pack_faults(const Settings& s, const Voice& voice, const std::string& file) {
  List faults;
  for (const auto& f : ioci::pack_faults(file))
    faults.emplace_back(Map{{"severity", "error"},
                            {"file", f.file},
                            {"line", static_cast<std::int64_t>(f.line)},
                            {"column", static_cast<std::int64_t>(f.column)},
                            {"message", f.message + "."},
                            {"hint", f.hint}});
  if (faults.empty() || voice.json()) return false;  // with --json one error has them all
  tell_faults(s, faults);
  return true;
}

/// Writes a page with the code of several targets side by side; where one cannot say the program,
/// the page says so, and it ends with 1.
int compare_posts(Program& p, const Settings& s, const Voice& voice, const PostSettings& how,
                  const Map& args) {
  Map asked{{"id", *args.find("id")}, {"form", how.form}, {"file", how.side_by_side}};
  if (const Value* robot = args.find("robot")) asked.set("robot", *robot);
  List targets;
  for (const std::string_view each : text::split(how.target, ','))
    targets.emplace_back(std::string(text::trim(each)));
  asked.set("targets", Value(std::move(targets)));
  auto made = p.app->dispatch(*p.session, "program.compare_targets", asked);
  if (!made.ok()) return fail_post(voice, made.error());
  const Map& found = *made->as_map();
  bool is_correct = true;
  for (const Value& each : *found.find("targets")->as_list())
    is_correct = is_correct && *each.as_map()->find("correct")->as_bool();
  if (voice.json()) {
    voice.result(*made, "");
    return is_correct ? 0 : 1;
  }
  if (!s.quiet)
    for (const Value& each : *found.find("differences")->as_list()) {
      const Map& d = *each.as_map();
      std::fprintf(
          stderr, "%s\n",
          text::visible(*d.find("file")->as_string() + ":" + d.find("line")->text() + ": " +
                        *d.find("kind")->as_string() + ": " + *d.find("text")->as_string())
              .c_str());
    }
  voice.line(*found.find("points")->as_string());
  voice.line(how.side_by_side);
  return is_correct ? 0 : 1;
}

/// The program of the file, and the world that has it, of a script that makes both: its bindings
/// count, and what runs beside it. A script whose worlds have no program of that file gives its
/// only world this one. What the script prints goes to standard error.
Result<std::pair<Value, Value>> cell_of_script(Program& p, const PostSettings& how) {
  p.printed = [](std::string_view text) { std::fwrite(text.data(), 1, text.size(), stderr); };
  RMP_TRY(p.lua->run_file(how.world));
  const auto ask = [&](const char* command, const Map& args) {
    return p.app->dispatch(*p.session, command, args);
  };
  const std::string wanted = std::filesystem::path(how.file).filename().string();
  RMP_TRY_ASSIGN(const Value worlds, ask("world.list", Map{}));
  std::vector<std::pair<Value, Value>> found;
  for (const Value& world : *worlds.as_list()) {
    RMP_TRY_ASSIGN(const Value programs, ask("world.programs", Map{{"id", world}}));
    for (const Value& each : *programs.as_list()) {
      RMP_TRY_ASSIGN(const Value id,
                     ask("program.get", Map{{"name", *each.as_map()->find("program")}}));
      RMP_TRY_ASSIGN(const Value files, ask("program.files", Map{{"id", id}}));
      const List& all = *files.as_list();
      if (!all.empty() && *all.front().as_map()->find("name")->as_string() == wanted)
        found.emplace_back(id, world);
    }
  }
  if (found.size() == 1) return found.front();
  if (!found.empty())
    return error(ErrorCode::conflict,
                 "the script has " + std::to_string(found.size()) + " programs of the file " +
                     text::quote(wanted) + " in its worlds",
                 "Make it create one.", how.world);
  if (worlds.as_list()->size() != 1)
    return error(ErrorCode::not_found,
                 "the script makes " + std::to_string(worlds.as_list()->size()) +
                     " worlds, and none has a program of the file " + text::quote(wanted),
                 "Make it create one world, or place the program with world.add_program.",
                 how.world);
  const Value& world = worlds.as_list()->front();
  RMP_TRY_ASSIGN(const Value id, ask("program.import", Map{{"file", how.file}}));
  RMP_TRY(ask("world.add_program", Map{{"id", world}, {"program", id}}));
  return std::pair(id, world);
}

/// What is missing, and the targets that there are.
Error no_target(Program& p, const char* what, const char* hint) {
  std::string all;
  if (const auto targets = p.app->dispatch(*p.session, "program.targets", Map{}); targets.ok())
    for (const Value& each : *targets->as_list())
      all += (all.empty() ? "" : ", ") + *each.as_map()->find("name")->as_string();
  return error(ErrorCode::usage, what, std::string(hint) + ". Targets are " + all + ".");
}

/// Posts a program to the files of a controller; its faults go to standard error, a line each.
int run_post(const Settings& s, const Voice& voice, const PostSettings& how) {
  Program p;
  if (auto started = start(p, s, voice, "post"); !started.ok())
    return fail_post(voice, started.error());
  const auto ask = [&](const char* command, const Map& args) {
    return p.app->dispatch(*p.session, command, args);
  };
  if (how.target.empty() && how.templates.empty() &&
      (how.profile.empty() || !how.side_by_side.empty()))
    return voice.fail(no_target(p, "post needs a target", "Write --target krl, or --profile"));
  Map args;
  if (!how.templates.empty()) {
    if (tell_pack_faults(s, voice, how.templates)) return 3;
    auto added = ask("program.add_target", Map{{"file", how.templates}});
    if (!added.ok()) return fail_post(voice, added.error());
    if (!how.target.empty() && how.target != *added->as_string())
      return fail_post(
          voice, error(ErrorCode::invalid_argument,
                       "the target " + text::quote(how.target) + " is requested, but the pack is " +
                           text::quote(*added->as_string()),
                       "Give --target or --templates.", "--target"));
    args.set("target", *added);
  }
  const bool is_script = how.world.ends_with(".lua");
  Result<Value> program = Value();
  if (is_script) {
    auto found = cell_of_script(p, how);
    if (!found.ok()) return voice.fail(found.error(), p.lua->traceback());
    program = found->first;
    args.set("world", found->second);
  } else {
    program = ask("program.import", Map{{"file", how.file}});
  }
  if (!program.ok()) return fail_post(voice, program.error());
  args.set("id", *program);
  // A source with errors is told whole, before anything else.
  auto checked = ask("program.check", Map{{"id", *program}});
  if (!checked.ok()) return fail_post(voice, checked.error());
  if (!*checked->as_map()->find("correct")->as_bool()) {
    if (voice.json()) voice.result(*checked, "");
    else tell_faults(s, *checked->as_map()->find("faults")->as_list());
    return 1;
  }
  if (!how.target.empty()) args.set("target", how.target);
  if (!how.profile.empty()) {
    if (how.profile.ends_with(".ctl")) {
      auto loaded = ask("file.load", Map{{"file", how.profile}});
      if (!loaded.ok()) return fail_post(voice, loaded.error());
      args.set("profile", *loaded);
    } else {
      auto found = ask("controller.get", Map{{"name", how.profile}});
      if (!found.ok()) return fail_post(voice, found.error());
      args.set("profile", *found);
    }
  }
  if (!how.robot.empty()) {
    if (how.robot.ends_with(".rbt")) {
      auto loaded = ask("file.load", Map{{"file", how.robot}});
      if (!loaded.ok()) return fail_post(voice, loaded.error());
      args.set("robot", *loaded);
    } else {
      auto found = ask("robot.get", Map{{"name", how.robot}});
      if (!found.ok()) return fail_post(voice, found.error());
      args.set("robot", *found);
    }
  }
  if (!how.world.empty() && !is_script) {
    auto loaded = ask("file.load", Map{{"file", how.world}});
    if (!loaded.ok()) return fail_post(voice, loaded.error());
    auto placed = ask("world.add_program", Map{{"id", *loaded}, {"program", *program}});
    if (!placed.ok()) return fail_post(voice, placed.error());
    args.set("world", *loaded);
  }
  if (!how.side_by_side.empty()) return compare_posts(p, s, voice, how, args);
  if (!how.folder.empty()) args.set("folder", how.folder);
  if (!how.name.empty()) args.set("name", how.name);
  if (!how.only_robot.empty()) args.set("only_robot", how.only_robot);
  args.set("run_check", how.run_check);
  if (!how.picture.empty()) args.set("picture", how.picture);
  if (!how.plot.empty()) args.set("plot", how.plot);
  args.set("form", how.form);
  args.set("overwrite", how.overwrite);
  // All faults are wanted, not the first: what is wrong is looked for before anything is written.
  args.set("check", true);
  auto posted = ask("program.post", args);
  if (!posted.ok()) return fail_post(voice, posted.error());
  const Map found = *posted->as_map();
  const bool is_correct = *found.find("correct")->as_bool();
  if (is_correct && !how.check && !how.folder.empty()) {
    args.set("check", false);
    args.set("run_check", false);  // it has just been correct
    args.erase("picture");
    args.erase("plot");
    posted = ask("program.post", args);
    if (!posted.ok()) return fail_post(voice, posted.error());
  }
  if (voice.json()) {
    voice.result(*posted, "");
    return is_correct ? 0 : 1;
  }
  tell_faults(s, *found.find("faults")->as_list());
  if (const Value* run = found.find("run"); run && !s.quiet)
    for (const Value& each : *run->as_map()->find("not_checked")->as_list())
      std::fprintf(stderr, "not checked: %s\n", text::visible(*each.as_string()).c_str());
  if (!is_correct) return 1;
  const Map written = *posted->as_map();
  for (const Value& each : *written.find("files")->as_list()) {
    const Map& f = *each.as_map();
    if (const Value* path = f.find("path")) voice.line(*path->as_string());
    else if (!how.check) {
      voice.line("=== " + *f.find("name")->as_string());
      std::string text = *f.find("text")->as_string();
      if (text.ends_with('\n')) text.pop_back();
      voice.line(text);
    }
  }
  return 0;
}

/// What a target makes of the sample programs and of each construct.
int run_post_test(const Settings& s, const Voice& voice, const PostTest& how) {
  Program p;
  if (auto started = start(p, s, voice, "post"); !started.ok()) return voice.fail(started.error());
  if (how.what.empty())
    return voice.fail(no_target(p, "post test needs a target",
                                "Write post test krl, or a plugin, pack or controller"));
  const Ask ask = [&](const char* command, const Map& args) {
    return p.app->dispatch(*p.session, command, args);
  };
  std::error_code none;
  const bool is_pack =
      how.what.ends_with(".post") ||
      std::filesystem::is_regular_file(std::filesystem::path(how.what) / ioci::kPackFile, none);
  if (is_pack && tell_pack_faults(s, voice, how.what)) return 3;
  Map report;
  const auto tested = test_post(
      *p.app, ask, how,
      [&](const std::string& l) {
        if (!voice.json()) voice.line(text::visible(l));
      },
      report);
  if (!tested.ok()) return fail_post(voice, tested.error());
  if (voice.json()) voice.result(report, "");
  return *tested;
}

/// Words of one line, or several lines when every argument is more than a word.
std::vector<std::string> classic_lines(const std::vector<std::string>& arguments) {
  const bool all_lines = std::all_of(arguments.begin(), arguments.end(), [](const std::string& a) {
    return a.find(' ') != std::string::npos;
  });
  return all_lines ? arguments : std::vector<std::string>{text::join(arguments, " ")};
}

int run_classic(const Settings& s, const Voice& voice, const std::vector<std::string>& lines) {
  Program p;
  if (auto started = start(p, s, voice, "classic"); !started.ok())
    return voice.fail(started.error());
  for (const std::string& line : lines) {
    // Through Lua, so that the result is printed as the console prints it.
    const int status = evaluate(p, voice, "ioci.classic(" + text::quote(line) + ")");
    if (status != 0) return status;
  }
  return 0;
}

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

/// A descriptor that can be read while something is to be served.
class Wake {
 public:
  explicit Wake(lua::LuaState& lua)
      : waker_(lua.wake_to_serve([fd = fd_] {
          const std::uint64_t one = 1;
          (void)!::write(fd, &one, sizeof one);
        })) {}
  ~Wake() {
    waker_.reset();
    ::close(fd_);
  }
  Wake(const Wake&) = delete;
  Wake& operator=(const Wake&) = delete;
  [[nodiscard]] int fd() const { return fd_; }
  void rest() const {
    std::uint64_t count = 0;
    (void)!::read(fd_, &count, sizeof count);
  }

 private:
  const int fd_ = ::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  std::shared_ptr<void> waker_;
};

/// What `serve` is told.
struct ServeSettings {
  std::vector<std::string> listen, allow, grant, limits, origins;
  std::string script, certificate, key, token_file, folder, audit;
  bool needs_token = false, tls_everywhere = false, browser = false;
  /// The arguments of server.start.
  [[nodiscard]] Result<Map> arguments() const {
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
};

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

/// Serves until it is interrupted, or a client stops the program.
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

/// Statements from a pipe: stops at the first error.
/// Words that leave a console as one would type them.
bool is_leaving(std::string_view input) {
  input = text::trim(input);
  return input == "quit" || input == "exit" || input == "quit()" || input == "exit()";
}

int run_piped(Program& p, const Voice& voice) {
  std::string line, pending;
  std::size_t number = 0, first = 1;
  const auto failed = [&](int code) {
    if (code != 0 && !p.lua->exit_requested())
      voice.note("This was line " + std::to_string(first) +
                 " of the input; what follows was not run.");
    return code;
  };
  while (std::getline(std::cin, line)) {
    ++number;
    if (number == 1 && line.starts_with("#!")) continue;
    if (pending.empty()) first = number;
    if (pending.empty() && is_leaving(line)) return 0;
    if (!pending.empty()) pending += '\n';
    pending += line;
    if (p.lua->is_incomplete(pending)) continue;
    const int code = evaluate(p, voice, std::exchange(pending, {}));
    if (code != 0 || p.lua->exit_requested() || p.app->quit_requested) return failed(code);
    p.lua->serve();
  }
  const int code = pending.empty() ? 0 : failed(evaluate(p, voice, pending));
  settle(p);
  return code;
}

std::filesystem::path user_startup() {
  if (const char* config = std::getenv("XDG_CONFIG_HOME"); config && *config == '/')
    return std::filesystem::path(config) / "robomosp" / "startup.lua";
  if (const char* home = std::getenv("HOME"); home && *home)
    return std::filesystem::path(home) / ".config" / "robomosp" / "startup.lua";
  return {};
}

/// Solvers in Lua that came with what was loaded: asks once a text whether they may run.
void ask_for_trust(Program& p, const Voice& voice, LineEditor& editor) {
  for (const ioci::KeptEntry& e : p.app->kept_solvers->take_unasked()) {
    const std::string what = ioci::described(*p.app->document.now(), e);
    for (;;) {
      const auto line =
          editor.read("Run the Lua text of " + what + "? [y]es, [n]o, [s]how it: ", "");
      const std::string answer(text::trim(line.text));
      if (line.outcome == LineEditor::Outcome::line && (answer == "s" || answer == "show")) {
        voice.result({}, e.solver.text);
        continue;
      }
      if (line.outcome == LineEditor::Outcome::line && (answer == "y" || answer == "yes")) {
        if (const auto done = p.app->kept_solvers->trust(e.solver.text, true); !done.ok())
          (void)voice.fail(done.error());
      } else if (!voice.quiet()) {
        voice.line("It is not run. Allow it later with provider.trust.");
      }
      break;
    }
  }
}

/// Journals of consoles without a terminal that stay at most.
constexpr std::size_t kMostPiped = 10;

/// `robot "arm", solid "plate" and 3 more`.
std::string described(const Program& p, const std::vector<AnyId>& records) {
  constexpr std::size_t kMostNamed = 4;
  const document::SnapshotPtr now = p.app->document.now();
  std::vector<std::string> names;
  for (std::size_t i = 0; i < records.size() && i < kMostNamed; ++i)
    names.push_back(now->describe(records[i]));
  if (records.size() > kMostNamed)
    names.push_back(std::to_string(records.size() - kMostNamed) + " more");
  return text::enumerate(names);
}

/// What was not saved is kept for the next start, and a sentence says so.
void keep_unsaved(Program& p, const Voice& voice, std::size_t most) {
  const std::vector<AnyId> unsaved = p.app->unsaved();
  if (unsaved.empty()) return;
  if (const auto kept = p.app->keep_unsaved(most); !kept.ok()) {
    voice.warn("Not saved: " + described(p, unsaved) + ". " + kept.error().sentence());
    return;
  }
  voice.note("Not saved: " + described(p, unsaved) +
             ". Kept for the next start: recovery.restore() loads it there, document.save() saves "
             "everything.");
}

/// Asks what to do with unsaved work; false = the user stays.
bool may_leave(Program& p, const Voice& voice, LineEditor& editor) {
  using Outcome = LineEditor::Outcome;
  for (;;) {
    const std::vector<AnyId> unsaved = p.app->unsaved();
    if (unsaved.empty()) return true;
    voice.line("Not saved: " + described(p, unsaved) + ".");
    const auto line =
        editor.read("[s]ave, [k]eep for the next start, [d]rop, or [b]ack to the console? ", "");
    if (line.outcome == Outcome::cancelled) return false;
    if (line.outcome == Outcome::end) voice.line("");
    const std::string answer = text::lower(text::trim(line.text));
    if (line.outcome == Outcome::end || answer == "k" || answer == "keep") {
      keep_unsaved(p, voice, 0);
      return true;
    }
    if (answer == "d" || answer == "drop") return true;
    if (answer == "b" || answer == "back") return false;
    if (answer != "s" && answer != "save") continue;
    const auto folder = editor.read("Folder for what was never saved [.]: ", "");
    if (folder.outcome != Outcome::line) continue;
    const std::string_view name = text::trim(folder.text);
    const auto saved = p.app->dispatch(*p.session, "document.save",
                                       Map{{"folder", std::string(name.empty() ? "." : name)}});
    if (!saved.ok()) {
      (void)voice.fail(saved.error());
      continue;
    }
    for (const Value& file : *saved->as_list()) voice.line("Saved " + file.text());
  }
}

int run_interactive(Program& p, Voice& voice) {
  std::error_code ec;
  for (const auto& file : {p.app->share / "startup.lua", user_startup()})
    if (!file.empty() && std::filesystem::exists(file, ec))
      if (const auto done = p.lua->run_file(file); !done.ok()) (void)voice.fail(done.error());
  if (!voice.quiet()) {
    voice.line("ROBOMOSP " ROBOMOSP_VERSION " with " + lua::lua_version() + ": " +
               std::to_string(p.app->commands.list().size()) + " commands, " +
               std::to_string(p.app->registry.list().size()) + " providers.");
    voice.line(
        "help() explains, x? explains x, TAB completes, Ctrl-C stops a script, Ctrl-D leaves.");
  }
  voice.page_results();
  const Wake wake(*p.lua);
  LineEditor editor(
      *p.lua,
      [&p, &wake] {
        wake.rest();
        p.lua->serve();
        impatience = 0;
        const bool interrupted = p.session->interrupted();
        p.session->clear_interrupt();
        return interrupted;
      },
      wake.fd());
  if (p.notes) (void)p.notes->fresh();  // of the scripts of the start
  std::string pending;
  while (!p.lua->exit_requested()) {
    if (p.app->quit_requested) {
      if (may_leave(p, voice, editor)) return 0;
      p.app->quit_requested = false;
    }
    progress_line().erase();
    const auto line = editor.read(pending.empty() ? "> " : ">> ", pending);
    if (line.outcome == LineEditor::Outcome::cancelled) {
      // What was dropped can be taken up again.
      editor.remember(std::string(text::trim(pending)));
      pending.clear();
      continue;
    }
    if (line.outcome == LineEditor::Outcome::end) {
      voice.line("");
      p.app->quit_requested = true;
      continue;
    }
    if (pending.empty() && is_leaving(line.text)) {
      p.app->quit_requested = true;
      continue;
    }
    pending += line.text;
    if (p.lua->is_incomplete(pending)) {
      pending += '\n';
      continue;
    }
    editor.remember(pending);
    (void)evaluate(p, voice, std::exchange(pending, {}));
    ask_for_trust(p, voice, editor);
  }
  keep_unsaved(p, voice, 0);  // os.exit() asks nothing
  return p.lua->exit_requested().value_or(0);
}

int run_console(const Settings& s, Voice& voice) {
  Program p;
  if (auto started = start(p, s, voice, "console"); !started.ok())
    return voice.fail(started.error());
  for (const Message& m : p.app->messages.recent())
    if (m.code == "recovery" && m.severity == Severity::info) voice.warn(m.text);
  if (is_interactive(s)) return run_interactive(p, voice);
  const int code = run_piped(p, voice);
  keep_unsaved(p, voice, kMostPiped);
  return code;
}

/// What `connect` is told.
struct ConnectSettings {
  std::string address, token_file, certificate;
  bool tls = false, no_tls = false;
  double seconds = 10;
};

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

/// What `irl` is told, beside the token, which stands in a file.
struct IrlWords {
  IrlSettings settings;
  std::string token_file;
};

/// Runs a program of a robot.
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
    impatience = 0;
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

int run_plugin_list(const Settings& s, const Voice& voice) {
  Program p;
  if (auto started = start(p, s, voice, "plugin"); !started.ok())
    return voice.fail(started.error());
  return evaluate(p, voice, "plugin.list()");
}

int run_plugin_check(const Voice& voice, const std::string& file) {
  const PluginCheck check = check_plugin(file);
  if (voice.json()) voice.line(to_json(Map{{"ok", check.exit_code == 0}, {"value", check.report}}));
  else if (check.exit_code == 0) voice.line(check.text);
  else std::fprintf(stderr, "error: %s\n", check.text.c_str());
  return check.exit_code;
}

int run_plugin_test(const Voice& voice, const std::string& file, const std::string& sdk,
                    const std::vector<std::string>& arguments) {
  const auto tested = test_plugin(file, sdk, arguments);
  return tested.ok() ? *tested : voice.fail(tested.error());
}

int run_commands(const Settings& s, const Voice& voice, const std::string& folder) {
  Program p;
  if (auto started = start(p, s, voice, "commands"); !started.ok())
    return voice.fail(started.error());
  if (!folder.empty()) {
    const auto written = ioci::write_reference(p.app->commands, folder);
    if (!written.ok()) return voice.fail(written.error());
    voice.result({}, "The pages were written to " + folder + ".");
    return 0;
  }
  if (voice.json()) return evaluate(p, voice, "ioci.describe()");
  std::size_t longest = 0;
  for (const ioci::CommandSpec* spec : p.app->commands.list())
    longest = std::max(longest, spec->name.size());
  for (const ioci::CommandSpec* spec : p.app->commands.list())
    voice.line(spec->name + std::string(longest + 2 - spec->name.size(), ' ') + spec->summary);
  return 0;
}

/// What the program found and what it misses; exit code 1 when something is missing.
int run_doctor(const Settings& s, const Voice& voice) {
  Program p;
  if (auto started = start(p, s, voice, "doctor"); !started.ok())
    return voice.fail(started.error());
  List missing, folders, plugins, providers;
  std::string text = "robomosp " ROBOMOSP_VERSION "\nLua      " + lua::lua_version() +
                     "\nSDK      " RMP_SDK_VERSION ", " RMP_ABI_TAG "\n\nplugin folders\n";
  std::error_code ec;
  std::vector<std::filesystem::path> given(s.plugin_path.begin(), s.plugin_path.end());
  for (const auto& folder : PluginLoader::search_path(given)) {
    const bool exists = std::filesystem::is_directory(folder, ec);
    text += "  " + folder.string() + (exists ? "" : " (absent)") + "\n";
    folders.emplace_back(Map{{"folder", folder.string()}, {"exists", exists}});
  }
  text += "plugins\n";
  for (const PluginReport& r : p.app->plugins.reports()) {
    text += "  " + r.file.filename().string() + ": " +
            (r.refusal ? "refused: " + r.refusal->sentence() : r.id + " " + r.version) + "\n";
    plugins.emplace_back(
        Map{{"file", r.file.string()}, {"loaded", r.loaded}, {"id", r.id}, {"version", r.version}});
    if (r.refusal) missing.emplace_back("plugin " + r.file.filename().string() + " was refused");
  }
  text += "providers\n";
  for (const std::string& id : known_interfaces()) {
    std::vector<std::string> names;
    for (const ProviderInfo& info : p.app->registry.list(id)) names.push_back(info.name);
    text += "  " + id + ": " + (names.empty() ? "none" : text::join(names, ", ")) + "\n";
    List list;
    for (const std::string& n : names) list.emplace_back(n);
    providers.emplace_back(Map{{"interface", id}, {"names", std::move(list)}});
    const bool is_needed = id == CsgEngine::kInterfaceId || id == IkSolver::kInterfaceId ||
                           id == InverseDynamics::kInterfaceId ||
                           id == ForwardDynamics::kInterfaceId || id == CurveFactory::kInterfaceId;
    if (names.empty() && is_needed) missing.emplace_back("no provider of " + id);
  }
  text += "library\n";
  for (const auto& folder : p.app->library) {
    const bool exists = std::filesystem::is_directory(folder, ec);
    text += "  " + folder.string() + (exists ? "" : " (absent)") + "\n";
    if (!exists) missing.emplace_back("the library folder " + folder.string() + " does not exist");
  }
  text += "history\n  " + history_file().string() + "\n";
  const AppLock::Stats lock = p.app->lock.stats();
  const double longest = std::chrono::duration<double>(lock.longest).count();
  text += "application lock\n  held " + std::to_string(lock.holds) + " times, the longest " +
          text::print_rounded(1e3 * longest, 3) + " ms" +
          (lock.longest_by.empty() ? "" : " by " + lock.longest_by) + "; " +
          std::to_string(lock.long_holds) + " times longer than " +
          std::to_string(AppLock::kLongestHold.count()) + " ms; " +
          std::to_string(lock.calls_within) + " calls of providers and scripts within\n\n";
  if (missing.empty()) text += "Nothing is missing.";
  for (const Value& m : missing) text += "missing: " + *m.as_string() + "\n";
  const bool is_healthy = missing.empty();
  voice.result(
      Map{{"version", ROBOMOSP_VERSION},
          {"lua", lua::lua_version()},
          {"abi_tag", RMP_ABI_TAG},
          {"plugin_folders", std::move(folders)},
          {"plugins", std::move(plugins)},
          {"providers", std::move(providers)},
          {"application_lock", Map{{"holds", static_cast<std::int64_t>(lock.holds)},
                                   {"long_holds", static_cast<std::int64_t>(lock.long_holds)},
                                   {"calls_within", static_cast<std::int64_t>(lock.calls_within)},
                                   {"longest", longest}}},
          {"missing", std::move(missing)}},
      text);
  return is_healthy ? 0 : 1;
}

/// A usage fault of CLI11 as one sentence.
int usage_fault(const Voice& voice, const CLI::App& cli, const CLI::ParseError& e) {
  std::string what = e.what();
  while (!what.empty() && (what.back() == '.' || what.back() == '\n')) what.pop_back();
  const auto subcommands = [](const CLI::App& of) {
    std::vector<std::string> names;
    for (const CLI::App* sub : of.get_subcommands([](const CLI::App*) { return true; }))
      names.push_back(sub->get_name());
    return names;
  };
  // CLI11 says only that a subcommand is missing, not which word was none.
  const auto parsed = cli.get_subcommands();
  const auto extras = cli.remaining(true);
  if (dynamic_cast<const CLI::RequiredError*>(&e) && parsed.size() == 1 && !extras.empty()) {
    const auto known = subcommands(*parsed.front());
    if (!known.empty()) {
      const std::string near = text::did_you_mean(extras.front(), known);
      return voice.fail(error(
          ErrorCode::usage,
          parsed.front()->get_name() + " has no subcommand " + text::quote(extras.front()),
          (near.empty() ? std::string() : near + " ") + "It has " + text::enumerate(known) + "."));
    }
  }
  const std::vector<std::string> names = subcommands(cli);
  std::string hint = "robomosp --help lists the subcommands.";
  const auto word = what.rfind(' ');
  if (dynamic_cast<const CLI::ExtrasError*>(&e) && word != std::string::npos)
    if (const std::string near = text::did_you_mean(what.substr(word + 1), names); !near.empty())
      hint = near + " " + hint;
  return voice.fail(error(ErrorCode::usage, std::move(what), std::move(hint)));
}

}  // namespace

int shell_main(int argc, char** argv) {
  ::signal(SIGXFSZ, SIG_IGN);  // a file that grows too large is an error of whoever writes it
  Settings s;
  CLI::App cli("ROBOMOSP: robotics modeling and simulation. Without a subcommand: the console.",
               "robomosp");
  cli.set_version_flag("--version", "robomosp " ROBOMOSP_VERSION " (" + lua::lua_version() +
                                        ", SDK " RMP_SDK_VERSION ", " RMP_ABI_TAG ")");
  cli.add_flag("--json", s.json, "Results and errors as JSON objects on standard output");
  cli.add_flag("-q,--quiet", s.quiet, "No warnings, banner or progress");
  cli.add_flag(
      "--no-cache", s.no_cache,
      "Do not use the caches: compute every derived value anew, and keep none between runs");
  cli.add_flag("--trust", s.trust,
               "Run Lua solvers that are stored in files in this run, without asking");
  cli.add_flag("--no-plugins", s.no_plugins,
               "Load no plugin at the start, not even the shipped ones");
  cli.add_flag("--trace", s.trace, "Show the call stack of a script's error");
  cli.add_option("--color", s.color, "auto, always or never; NO_COLOR is respected")
      ->check(CLI::IsMember({"auto", "always", "never"}));
  cli.add_option("--plugin-path", s.plugin_path,
                 "Folder of plugins, searched first (may be repeated)")
      ->allow_extra_args(false);
  cli.add_option("--library", s.library,
                 "Folder of materials, parts and robots instead of the shipped one")
      ->allow_extra_args(false);
  cli.require_subcommand(0, 1);
  cli.fallthrough();

  std::string file, code, folder;
  CLI::App* run = cli.add_subcommand("run", "Run a Lua script: run FILE [ARGS...]");
  run->add_option("file", file, "Script")->required();
  Sandbox sandbox;
  run->add_flag("--sandbox", sandbox.is_wanted,
                "Run an untrusted script: in a locked process, with the effects of --allow");
  run->add_option("--allow", sandbox.allow, "With --sandbox: effects that its commands may have")
      ->capture_default_str();
  run->add_option("--limits", sandbox.limits,
                  "With --sandbox: memory=256,cpu=10,wall=60,output=1 (MiB, s, s, MiB)");
  run->add_flag("--without-seccomp", sandbox.without_seccomp,
                "With --sandbox: run even if the system cannot filter system calls");
  run->prefix_command();
  CLI::App* eval =
      cli.add_subcommand("eval", "Evaluate one expression or statement and print the result");
  eval->add_option("code", code, "Lua")->required();
  CLI::App* rpc =
      cli.add_subcommand("rpc", "JSON-RPC 2.0 on standard input and output, one message per line");
  CLI::App* language_server = cli.add_subcommand(
      "language-server",
      "Language server for robot programs in editors: LSP on standard input and output");
  CLI::App* debug_adapter = cli.add_subcommand(
      "debug-adapter",
      "Debug adapter for robot programs in editors: DAP on standard input and output");
  bool is_stdio = true;
  language_server->add_flag("--stdio", is_stdio, "Accepted without effect: some editors pass it");
  debug_adapter->add_flag("--stdio", is_stdio, "Accepted without effect: some editors pass it");
  ServeSettings how;
  CLI::App* serve = cli.add_subcommand(
      "serve", "Let other programs work on one world: JSON-RPC and classic lines over sockets");
  serve->add_option("script", how.script, "Lua script to run first");
  serve
      ->add_option("--listen", how.listen,
                   "HOST:PORT, [IPv6]:PORT or unix:PATH (may be repeated); default: 127.0.0.1:7007")
      ->allow_extra_args(false);
  serve->add_option("--certificate", how.certificate, "TLS: PEM file of the certificate");
  serve->add_option("--key", how.key, "TLS: PEM file of the private key, mode 600");
  serve->add_flag("--tls-everywhere", how.tls_everywhere, "TLS also on addresses of this machine");
  serve->add_option("--token-file", how.token_file, "File of tokens instead of the user's");
  serve->add_flag("--needs-token", how.needs_token, "Clients on this machine need a token, too");
  serve
      ->add_option("--allow", how.allow,
                   "Rights of clients without a token; default: reads,edits,simulates")
      ->delimiter(',')
      ->allow_extra_args(false);
  serve
      ->add_option("--grant", how.grant,
                   "A command that clients without a token may run (repeatable)")
      ->allow_extra_args(false);
  serve->add_option("--folder", how.folder,
                    "Folder of the files that clients without a token read and write");
  serve->add_option("--limit", how.limits, "A limit, such as seconds=60 (may be repeated)")
      ->allow_extra_args(false);
  serve->add_flag("--browser", how.browser,
                  "Serve browsers, too: a page at the same address shows the world");
  serve
      ->add_option(
          "--origin", how.origins,
          "Origin of other pages that may connect, such as https://robots.example (repeatable)")
      ->allow_extra_args(false);
  serve->add_option("--audit", how.audit, "File to which a line is appended for each request");
  ConnectSettings there;
  CLI::App* connect = cli.add_subcommand(
      "connect", "Console of a program that runs a server: HOST:PORT, [IPv6]:PORT or unix:PATH");
  connect->add_option("address", there.address, "Address of the server")->required();
  connect->add_option("--token-file", there.token_file, "File with the token, mode 600");
  connect->add_option("--certificate", there.certificate,
                      "TLS: PEM file of the certificate to trust; default: those of the system");
  connect->add_flag("--tls", there.tls,
                    "TLS also with this machine; for other hosts it is the default");
  connect->add_flag("--no-tls", there.no_tls, "No TLS: others can read the connection")
      ->excludes("--tls")
      ->excludes("--certificate");
  connect->add_option("--timeout", there.seconds, "Time limit for connecting [s]")
      ->check(CLI::Range(0.1, 3600.0))
      ->capture_default_str();
  PostSettings posted;
  CLI::App* post =
      cli.add_subcommand("post",
                         "Write a program in a controller's language: post PROGRAM.irl --target "
                         "krl -o FOLDER; exit code 1 if it cannot be translated");
  post->add_option("file", posted.file, "Program");
  post->add_option("--target", posted.target, "Language, such as krl, rapid or c");
  post->add_option("--profile", posted.profile,
                   "Controller: a name of the library, or a .ctl file");
  post->add_option("--robot", posted.robot, "Robot: a name of the library, or a .rbt file");
  post->add_option("-o,--output", posted.folder,
                   "Existing folder for the files; if omitted, they are printed");
  post->add_option("--form", posted.form, "automatic, structured or flat")
      ->check(CLI::IsMember({"automatic", "structured", "flat"}))
      ->capture_default_str();
  post->add_option("--name", posted.name, "Name of the program on the controller");
  post->add_option("--only-robot", posted.only_robot,
                   "For a program for several robots: the part for this one's controller");
  post->add_option("--templates", posted.templates, "Target made of templates: its file");
  post->add_flag("--check", posted.check, "List the faults and write nothing");
  post->add_flag(
      "--run-check", posted.run_check,
      "Check it by a run, in the world or alone with the robot; if it has errors, post nothing");
  post->add_option("--world", posted.world,
                   "World for the run: a .wld file, or a .lua script that makes it");
  CLI::Option* const is_run = post->get_option("--run-check");
  post->add_option("--picture", posted.picture,
                   "With --run-check: the path of the tool, a .png file")
      ->needs(is_run);
  post->add_option("--plot", posted.plot,
                   "With --run-check: joints against their limits, .svg, .png or .pdf")
      ->needs(is_run);
  post->add_option("--side-by-side", posted.side_by_side,
                   "Page with the code of several targets (--target krl,rapid): .html, .md or .txt")
      ->excludes("--only-robot");
  post->add_flag("--overwrite", posted.overwrite, "Replace existing files");
  post->footer(
      "Exit codes: 0 posted; 1 the program has errors, or the target cannot express it: nothing is "
      "written; 2 wrong usage; 3 wrong input: a file, folder, pack, target, robot or controller "
      "that is missing or cannot be used; 130 interrupted.");
  post->require_subcommand(0, 1);
  PostTest tested;
  CLI::App* post_test = post->add_subcommand("test",
                                             "Test a target with the sample programs and every "
                                             "construct; the exit code is 1 if anything is wrong");
  post_test->add_option("what", tested.what,
                        "Target, plugin (.so), pack (.post), its folder, or a controller (.ctl)");
  post_test
      ->add_option("--robot", tested.robot, "Robot: a name of the library, a .rbt file, or none")
      ->capture_default_str();
  post_test->add_option("--profile", tested.profile,
                        "Controller: a name of the library, or a .ctl file");
  post_test->add_option("--program", tested.programs, "An additional program (may be repeated)")
      ->allow_extra_args(false);
  post_test->add_option(
      "--reader", tested.reader,
      "Folder for the files that an independent reader needs to read the posts back");
  post_test->add_flag("--brief", tested.brief, "Only list constructs that are refused or wrong");
  post_test->footer(
      "Exit codes: 0 nothing is wrong; 1 something is lost, has no line or differs the second "
      "time; 2 "
      "wrong usage; 3 wrong input: nothing could be tested; 130 interrupted.");
  IrlWords program;
  IrlSettings& irl_how = program.settings;
  CLI::App* irl = cli.add_subcommand(
      "irl",
      "Run a robot program: irl PROGRAM.irl alone, with --robot NAME, or with --connect HOST:PORT "
      "in the world of a server; the exit code is 1 after a fault, 5 after HALT");
  irl->add_option("file", irl_how.file, "Program; also in a controller's language (program.import)")
      ->required();
  irl->add_flag("--check", irl_how.check, "List the faults and do not run it");
  irl->add_flag("--code", irl_how.code, "Only print its three-address code");
  irl->add_option(
         "--set", irl_how.set,
         "NAME=VALUE of a variable, assigned after its declaration, or of an input (repeatable)")
      ->allow_extra_args(false);
  irl->add_option("--language", irl_how.language,
                  "Language or reader, if the file's text does not identify it");
  irl->add_option("--robot", irl_how.robot,
                  "Robot that it moves: a name of the library or a .rbt file; with --connect its "
                  "name in the world");
  irl->add_option("--frame", irl_how.frame,
                  "Frame or object of the world in which targets are given");
  irl->add_option("--tool", irl_how.tool, "Tool of the robot for the targets");
  irl->add_option("--bind", irl_how.bind, "NAME=SIGNAL of the world (repeatable)")
      ->allow_extra_args(false);
  irl->add_option("--grip", irl_how.grip,
                  "NAME of an output that grips and releases, or NAME=OBJECT (repeatable)")
      ->allow_extra_args(false);
  irl->add_flag("--free", irl_how.free, "Signals that the world lacks belong to the program");
  irl->add_option("-o,--output", irl_how.record,
                  "Recording of the run: a .csv, .npz, .json or .rec file");
  irl->add_option("--most-time", irl_how.most_time, "Longest time of a run with a robot [s]")
      ->check(CLI::Range(1e-3, 1e9))
      ->capture_default_str();
  irl->add_option("--most-instructions", irl_how.most_instructions,
                  "Without a robot: limit of instructions; 0 is no limit")
      ->check(CLI::Range(0.0, 9e15))
      ->capture_default_str();
  irl->add_flag("--real-time", irl_how.real_time, "Waits take their time even without a robot");
  irl->add_flag("--fast", irl_how.fast, "With --connect: as fast as possible");
  irl->add_option("--connect", irl_how.connect,
                  "HOST:PORT, [IPv6]:PORT or unix:PATH of a program that runs a server");
  irl->add_option("--world", irl_how.world, "With --connect: name of the world on the server");
  irl->add_option("--token-file", program.token_file, "File with the token, mode 600");
  irl->add_option("--certificate", irl_how.certificate,
                  "TLS: PEM file of the certificate to trust; default: those of the system");
  irl->add_flag("--tls", irl_how.tls,
                "TLS also with this machine; for other hosts it is the default");
  irl->add_flag("--no-tls", irl_how.no_tls, "No TLS: others can read the connection")
      ->excludes("--tls")
      ->excludes("--certificate");
  irl->add_option("--timeout", irl_how.seconds, "Time limit for connecting [s]")
      ->check(CLI::Range(0.1, 3600.0))
      ->capture_default_str();
  CLI::App* classic =
      cli.add_subcommand("classic",
                         "Run classic command lines in order, such as: classic \"Worlds Open "
                         "worlds/pa10_circle.wld\" \"PRobot pa10 mGetDHP\"");
  classic->prefix_command();
  CLI::App* plugin = cli.add_subcommand("plugin", "Inspect plugins");
  plugin->require_subcommand(1);
  CLI::App* plugin_list =
      plugin->add_subcommand("list", "List the plugins that were found and loaded");
  CLI::App* plugin_check = plugin->add_subcommand(
      "check", "Load a file in a child process and report whether it would be accepted");
  plugin_check->add_option("file", file, "Plugin file")->required();
  CLI::App* plugin_test =
      plugin->add_subcommand("test",
                             "Run the conformance suites of the SDK on all providers of a file: "
                             "test FILE [GTEST OPTIONS...]");
  plugin_test->add_option("file", file, "Plugin file")->required();
  std::string sdk;
  plugin_test->add_option("--sdk", sdk, "Prefix of the installed SDK with the suites");
  plugin_test->prefix_command();
  CLI::App* commands = cli.add_subcommand("commands", "List the commands");
  commands->add_option("--markdown", folder, "Write the reference pages to this folder");
  CLI::App* doctor = cli.add_subcommand("doctor", "Show versions, folders, and missing parts");
  std::string about;
  CLI::App* help = cli.add_subcommand("help", "Show this text, or that of a subcommand");
  help->add_option("subcommand", about, "Subcommand");
  // Subcommands inherit the fallthrough of global options; what follows these two belongs to the
  // script or the line.
  run->fallthrough(false);
  classic->fallthrough(false);
  plugin_test->fallthrough(false);

  // `robomosp file.lua` is `robomosp run file.lua`.
  std::vector<char*> given_words(argv, argv + argc);
  std::string run_word = "run";
  for (std::size_t i = 1; i < given_words.size(); ++i) {
    const std::string_view word = given_words[i];
    if (word == "--color" || word == "--plugin-path" || word == "--library") {
      ++i;
    } else if (!word.starts_with('-')) {
      if (word.ends_with(".lua"))
        given_words.insert(given_words.begin() + static_cast<std::ptrdiff_t>(i), run_word.data());
      break;
    }
  }

  cli.footer(
      "Examples:\n"
      "  robomosp                                   the console; help() explains\n"
      "  robomosp cell.lua                          run a script\n"
      "  robomosp < lines.txt                       run lines as they are typed at the console\n"
      "  robomosp eval 'robot(\"puma560\"):fk{q = {0, \"90 deg\", 0, 0, 0, 0}}.position'\n"
      "  robomosp irl weld.irl --robot kr5 -o weld.csv\n"
      "  robomosp post weld.irl --target krl --robot kr5 -o .\n"
      "  robomosp serve cell.lua --browser          share a world with other programs\n"
      "  robomosp help post                         options of a subcommand");

  // After parsing, CLI11 gives the help of the subcommand that was parsed.
  const std::string overview = cli.help();
  try {
    cli.parse(static_cast<int>(given_words.size()), given_words.data());
  } catch (const CLI::Success& e) {
    return cli.exit(e);
  } catch (const CLI::ParseError& e) {
    // Options may not have been read yet; --json must hold for this error too.
    for (int i = 1; i < argc; ++i) s.json = s.json || std::string_view(argv[i]) == "--json";
    return usage_fault(Voice(s), cli, e);
  }
  Voice voice(s);
  if (s.json) (void)voice.keep_output();
  if (help->parsed()) {
    if (about.empty()) {
      voice.line(overview);
      return 0;
    }
    for (const CLI::App* subcommand : cli.get_subcommands(nullptr)) {
      if (subcommand->get_name() != about) continue;
      voice.line(subcommand->help("robomosp"));
      return 0;
    }
    return voice.fail(error(ErrorCode::usage, "there is no subcommand " + text::quote(about),
                            "robomosp --help lists the subcommands."));
  }
  if (run->parsed()) {
    if (sandbox.is_wanted) return run_sandboxed(s, voice, file, run->remaining(), sandbox);
    for (const char* only : {"--allow", "--limits", "--without-seccomp"})
      if (run->count(only) > 0)
        return voice.fail(error(ErrorCode::usage, std::string(only) + " goes with --sandbox",
                                "Write run --sandbox " + std::string(only) + " ... FILE."));
    return run_script(s, voice, file, run->remaining());
  }
  if (eval->parsed()) return run_eval(s, voice, code);
  if (post_test->parsed()) return run_post_test(s, voice, tested);
  if (post->parsed()) {
    if (posted.file.empty())
      return voice.fail(error(ErrorCode::usage, "post needs a program",
                              "Write post PROGRAM.irl --target krl, or post test TARGET."));
    return run_post(s, voice, posted);
  }
  if (irl->parsed()) return run_program(s, voice, program);
  if (rpc->parsed()) return run_rpc(s, voice);
  if (language_server->parsed()) return run_language_server(s, voice);
  if (debug_adapter->parsed()) return run_debug_adapter(s, voice);
  if (serve->parsed()) return run_serve(s, voice, how);
  if (connect->parsed()) return run_connect(s, voice, there);
  if (classic->parsed()) {
    const auto words = classic->remaining();
    if (words.empty())
      return voice.fail(error(ErrorCode::usage, "classic needs a command line",
                              "Write classic \"PRobot pa10 mGetDHP\"."));
    return run_classic(s, voice, classic_lines(words));
  }
  if (plugin_check->parsed()) return run_plugin_check(voice, file);
  if (plugin_test->parsed()) return run_plugin_test(voice, file, sdk, plugin_test->remaining());
  if (plugin_list->parsed()) return run_plugin_list(s, voice);
  if (commands->parsed()) return run_commands(s, voice, folder);
  if (doctor->parsed()) return run_doctor(s, voice);
  return run_console(s, voice);
}

}  // namespace robomosp::shell
