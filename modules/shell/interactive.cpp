// SPDX-License-Identifier: Apache-2.0
#include "shell/interactive.h"

#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <utility>

#include "ioci/core/kept_solvers.h"
#include "kernel/letters.h"
#include "kernel/text.h"
#include "shell/console.h"

namespace robomosp::shell {

bool is_leaving(std::string_view input) {
  input = text::trim(input);
  return input == "quit" || input == "exit" || input == "quit()" || input == "exit()";
}

namespace {

/// Statements from a pipe: stops at the first error.
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
        count_interrupts_anew();
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

}  // namespace

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

}  // namespace robomosp::shell
