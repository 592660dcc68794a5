// SPDX-License-Identifier: Apache-2.0
#include "shell/irl.h"

#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <map>
#include <optional>
#include <thread>
#include <utility>

#include <robomosp/sdk/program_tables.h>

#include "io/native.h"
#include "ioci/core/commands.h"
#include "ioci/program/alone_inputs.h"
#include "kernel/file_root.h"
#include "kernel/text.h"
#include "program/alone.h"
#include "shell/shell.h"

namespace robomosp::shell {
namespace {

using ioci::text_of;

constexpr int kFault = 1;

class UserProgress final : public Progress {
 public:
  explicit UserProgress(const ioci::Session& user) : user_(user) {}
  void report(double, std::string_view) override {}
  [[nodiscard]] bool cancelled() const override { return user_.interrupted(); }

 private:
  const ioci::Session& user_;
};

bool same(std::string_view a, std::string_view b) {
  const auto lower = [](unsigned char c) { return c >= 'A' && c <= 'Z' ? c + 32 : c + 0; };
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [&](char x, char y) { return lower(x) == lower(y); });
}

/// `NAME=VALUE`.
Result<std::pair<std::string, std::string>> split(const std::string& word, const char* option) {
  const auto at = word.find('=');
  std::string name(text::trim(std::string_view(word).substr(0, at)));
  if (at == std::string::npos || name.empty())
    return error(ErrorCode::usage, text::quote(word) + " does not assign a value to a name",
                 std::string("Write ") + option + " NAME=VALUE.", option);
  return std::pair(std::move(name), std::string(text::trim(std::string_view(word).substr(at + 1))));
}

/// A value of an input as the user writes it.
std::optional<double> input_value(std::string_view text) {
  if (same(text, "TRUE")) return 1;
  if (same(text, "FALSE")) return 0;
  return text::read_real(text);
}

/// The person at the terminal, and files in the program's folder.
class Terminal final : public program::Operator {
 public:
  Terminal(const IrlVoice& voice, const ioci::Session& user, std::filesystem::path folder,
           bool in_real_time)
      : voice_(voice), user_(user), folder_(std::move(folder)), in_real_time_(in_real_time) {}

  Result<void> says(std::string_view piece) override {
    voice_.text(piece);
    return {};
  }
  Result<std::string> line() override {
    std::string line;
    if (std::getline(std::cin, line)) {
      if (line.ends_with('\r')) line.pop_back();
      return line;
    }
    if (user_.interrupted()) return error(ErrorCode::cancelled, "the program was interrupted");
    return error(ErrorCode::not_found, "READ waits for a line, and standard input has ended",
                 "Type it, or provide a file with more lines.");
  }
  Result<void> pause(std::string_view message) override {
    std::string said = "PAUSE" + (message.empty() ? std::string() : ": " + std::string(message));
    if (::isatty(STDIN_FILENO) == 0) {
      if (!voice_.is_quiet)
        voice_.tell(said + ". Standard input is not a terminal, and the program continues.");
      return {};
    }
    voice_.tell(said + ". Press Enter to continue.");
    std::string line;
    std::getline(std::cin, line);
    if (user_.interrupted()) return error(ErrorCode::cancelled, "the program was interrupted");
    std::cin.clear();
    return {};
  }
  Result<void> time(double now) override {
    if (!in_real_time_) return {};
    while (!user_.interrupted()) {
      const std::chrono::duration<double> passed = Clock::now() - start_;
      const double left = now - passed.count();
      if (left <= 0) return {};
      std::this_thread::sleep_for(std::chrono::duration<double>(std::min(left, 0.05)));
    }
    return error(ErrorCode::cancelled, "the program was interrupted");
  }
  Result<void> does(double now, const std::string& file, std::uint32_t line,
                    const std::string& what) override {
    voice_.tell("t = " + text::print_rounded(now) + " s, " + file + ":" + std::to_string(line) +
                ": " + what);
    return {};
  }
  Result<std::string> read_file(std::string_view name) override {
    RMP_TRY_ASSIGN(const auto path, beside(name));
    return io::read_file(path);
  }
  Result<void> write_file(std::string_view name, std::string_view bytes, bool adds) override {
    RMP_TRY_ASSIGN(const auto path, beside(name));
    std::string all;
    if (adds && file_kind(path) != FileKind::none) {
      RMP_TRY_ASSIGN(all, io::read_file(path));
    }
    all += bytes;
    return io::write_file(path, all);
  }

 private:
  using Clock = std::chrono::steady_clock;
  [[nodiscard]] Result<std::filesystem::path> beside(std::string_view name) const {
    if (!name.empty() && name != "." && name != ".." &&
        name.find_first_of(std::string_view("/\\\0", 3)) == std::string_view::npos)
      return folder_ / name;
    return error(ErrorCode::permission,
                 text::quote(std::string(name)) + " is not the name of a file next to the program",
                 "A program can open files in its own folder only: give a name without folders.");
  }
  const IrlVoice& voice_;
  const ioci::Session& user_;
  const std::filesystem::path folder_;
  const bool in_real_time_;
  const Clock::time_point start_ = Clock::now();
};

class Run {
 public:
  Run(ioci::Application& app, ioci::Session& session, const IrlSettings& how, const IrlVoice& voice)
      : app_(app), session_(session), how_(how), voice_(voice) {}

  int run() {
    if (auto loaded = load(); !loaded.ok()) return voice_.fail(loaded.error());
    auto faults = ask("program.check", Map{{"id", program_}});
    if (!faults.ok()) return voice_.fail(faults.error());
    const Map& found = *faults->as_map();
    const bool is_correct = *found.find("correct")->as_bool();
    tell_faults(*found.find("faults")->as_list());
    if (!is_correct || how_.check) {
      if (voice_.is_json) voice_.result(*faults);
      return is_correct ? 0 : kFault;
    }
    if (how_.code) return print_code();
    if (auto sorted = sort_values(); !sorted.ok()) return voice_.fail(sorted.error());
    if (how_.is_alone()) return alone();
    return in_world();
  }

 private:
  Result<Value> ask(const char* command, const Map& args) {
    return app_.dispatch(session_, command, args);
  }

  Result<void> load() {
    Map args{{"file", how_.file}};
    if (!how_.language.empty()) args.set("language", how_.language);
    RMP_TRY_ASSIGN(program_, ask("program.import", args));
    return {};
  }

  void tell_faults(const List& faults) const {
    for (const Value& each : faults) {
      const Map& f = *each.as_map();
      const std::string severity = text_of(f, "severity");
      if (voice_.is_quiet && severity != "error") continue;
      const std::string hint = text_of(f, "hint");
      voice_.tell(text_of(f, "file") + ":" + f.find("line")->text() + ":" +
                  f.find("column")->text() + ": " + severity + ": " + text_of(f, "message") +
                  (hint.empty() ? "" : " " + hint));
    }
  }

  int print_code() {
    auto code = ask("program.code", Map{{"id", program_}});
    if (!code.ok()) return voice_.fail(code.error());
    if (voice_.is_json) voice_.result(*code);
    else if (code->as_string()) voice_.text(*code->as_string());
    return 0;
  }

  /// --set gives variables values, and inputs.
  Result<void> sort_values() {
    UserProgress progress(session_);
    RMP_TRY_ASSIGN(code_, ioci::compile_now(app_, *program_.as_handle(), progress));
    const rmp_code& c = code_->code();
    for (const std::string& word : how_.set) {
      RMP_TRY_ASSIGN(auto pair, split(word, "--set"));
      const rmp_code_symbol* symbol = nullptr;
      for (std::uint32_t s = 0; s < c.symbols.count && !symbol; ++s) {
        const auto& x = row<rmp_code_symbol>(c.symbols, s);
        if (x.kind == RMP_SYMBOL_INPUT && same(x.name, pair.first)) symbol = &x;
      }
      if (!symbol) {
        values_.push_back(std::move(pair));
        continue;
      }
      const auto value = input_value(pair.second);
      if (!value)
        return error(
            ErrorCode::usage,
            "the input " + text::quote(pair.first) + " cannot be " + text::quote(pair.second),
            "Give TRUE, FALSE or a number.", "--set");
      inputs_.set(symbol->name, *value);
    }
    return {};
  }
  int alone() {
    program::AloneOptions options;
    auto inputs =
        ioci::read_inputs(inputs_.empty() ? nullptr : &(input_value_ = Value(inputs_)), "--set");
    if (!inputs.ok()) return voice_.fail(inputs.error());
    options.inputs = std::move(*inputs);
    options.values = values_;
    options.is_traced = voice_.is_traced;
    options.limits.most_instructions = how_.most_instructions;
    std::string collected;
    IrlVoice voice = voice_;
    if (voice_.is_json) voice.text = [&collected](std::string_view piece) { collected += piece; };
    Terminal terminal(voice, session_, std::filesystem::path(how_.file).parent_path(),
                      how_.real_time);
    const UserProgress progress(session_);
    const auto ended = program::run_alone(code_, options, terminal, progress);
    if (!ended.ok()) return ended_by(ended.error());
    if (voice_.is_json) {
      Map outputs;
      for (const auto& [name, value] : ended->outputs) outputs.append(name, value);
      voice_.result(Map{{"is_halted", ended->is_halted},
                        {"time", ended->time},
                        {"motions", static_cast<std::int64_t>(ended->motions)},
                        {"instructions", static_cast<std::int64_t>(ended->instructions)},
                        {"outputs", std::move(outputs)},
                        {"text", std::move(collected)}});
    }
    return halted(ended->is_halted);
  }

  /// A fault of the run, not of how it was asked for.
  int ended_by(const Error& e) const {
    const int code = voice_.fail(e);
    // A wait that nothing ends is told by the world.
    const bool is_of_run =
        e.where.find("program ") != std::string::npos || e.code == ErrorCode::conflict;
    return is_of_run && e.code != ErrorCode::cancelled && e.code != ErrorCode::unreachable ? kFault
                                                                                           : code;
  }
  int halted(bool is_halted) const {
    if (!is_halted) return 0;
    if (!voice_.is_quiet && !voice_.is_json) voice_.tell("The program ended by HALT.");
    return kHalted;
  }

  [[nodiscard]] Result<List> bindings() const {
    List out;
    for (const std::string& word : how_.bind) {
      RMP_TRY_ASSIGN(auto pair, split(word, "--bind"));
      out.emplace_back(Map{{"kind", "signal"}, {"name", pair.first}, {"to", pair.second}});
    }
    for (const std::string& word : how_.grip) {
      Map grip{{"kind", "grip"}, {"name", word.substr(0, word.find('='))}};
      if (const auto at = word.find('='); at != std::string::npos)
        grip.set("to", word.substr(at + 1));
      out.emplace_back(std::move(grip));
    }
    for (const auto& [name, value] : inputs_)
      out.emplace_back(Map{{"kind", "free"}, {"name", name}, {"value", value}});
    return out;
  }
  void add_common(Map& args) const {
    Map values;
    for (const auto& [name, value] : values_) values.set(name, value);
    if (!values.empty()) args.set("values", std::move(values));
    args.set("most_time", how_.most_time);
    args.set("unbound", how_.connect.empty() || how_.free ? "free" : "error");
  }

  int in_world() {
    const auto begun = how_.connect.empty() ? prepare() : open();
    if (!begun.ok()) return voice_.fail(begun.error());
    std::string collected;
    bool is_halted = false, is_told = false;
    const auto take = [&](const std::string& note) {
      // "t = 1.5 s: name: what was written", or "t = 1.5 s: what happened"
      const auto at = note.find(" s: ");
      if (!note.starts_with("t = ") || at == std::string::npos) return voice_.tell(note);
      const std::string said = note.substr(at + 4);
      if (said.starts_with(name_ + ": ")) {
        const std::string line = said.substr(name_.size() + 2) + "\n";
        if (voice_.is_json) collected += line;
        else voice_.text(line);
        return;
      }
      is_halted = is_halted || said.starts_with(name_ + " is at HALT");
      if (!voice_.is_quiet) voice_.tell(note);
    };
    const std::uint64_t heard = app_.messages.subscribe([&](const Message& m) {
      if (m.code == "program_note") take(m.text), is_told = true;
      if (m.code == "program_line" && voice_.is_traced) voice_.tell(m.text);
    });
    const auto recording =
        ask(how_.connect.empty() ? "world.run_task" : "program.run_remote", run_);
    app_.messages.unsubscribe(heard);
    if (!recording.ok()) return ended_by(recording.error());
    const auto found = app_.recordings.find(recording->as_handle()->number);
    if (found && !is_told)
      for (const std::string& note : found->notes) take(note);
    if (found && voice_.is_traced && how_.connect.empty()) trace(*found);
    std::string file;
    if (!how_.record.empty()) {
      const auto saved = ask("recording.save", Map{{"id", *recording}, {"file", how_.record}});
      if (!saved.ok()) return voice_.fail(saved.error());
    }
    if (voice_.is_json) {
      double time = 0;
      if (found && !found->columns.empty() && !found->columns.front().values.empty())
        time = found->columns.front().values.back();
      List notes;
      if (found)
        for (const std::string& note : found->notes) notes.emplace_back(note);
      voice_.result(Map{{"is_halted", is_halted},
                        {"time", time},
                        {"notes", std::move(notes)},
                        {"text", std::move(collected)}});
    }
    return halted(is_halted);
  }
  void trace(const recording::Recording& r) const {
    for (const recording::Column& c : r.columns) {
      if (c.name != name_ + ".line") continue;
      double last = 0;
      for (std::size_t i = 0; i < c.values.size(); ++i)
        if (c.values[i] != std::exchange(last, c.values[i]))
          voice_.tell("t = " + text::print_rounded(r.columns.front().values[i]) + " s: " + name_ +
                      ", line " + text::print_rounded(c.values[i]));
    }
  }
  /// A world for the robot and the program.
  Result<void> prepare() {
    Value robot;
    if (how_.robot.ends_with(".rbt")) {
      RMP_TRY_ASSIGN(robot, ask("file.load", Map{{"file", how_.robot}}));
    } else {
      RMP_TRY_ASSIGN(robot, ask("robot.get", Map{{"name", how_.robot}}));
    }
    RMP_TRY_ASSIGN(const Value world, ask("world.create", Map{{"name", "cell"}}));
    RMP_TRY(done(ask("world.add_robot", Map{{"id", world}, {"robot", robot}})));
    RMP_TRY_ASSIGN(const Value placed,
                   ask("world.add_program", Map{{"id", world}, {"program", program_}}));
    name_ = *placed.as_string();
    if (!how_.frame.empty() || !how_.tool.empty()) {
      Map b{{"id", program_}, {"kind", "robot"}};
      if (!how_.frame.empty()) b.set("frame", how_.frame);
      if (!how_.tool.empty()) b.set("tool", how_.tool);
      RMP_TRY(done(ask("program.bind", b)));
    }
    RMP_TRY_ASSIGN(const List all, bindings());
    for (const Value& one : all) {
      Map b = *one.as_map();
      b.set("id", program_);
      RMP_TRY(done(ask("program.bind", b)));
    }
    run_ = Map{{"id", world}, {"program", name_}};
    add_common(run_);
    return {};
  }
  Result<void> open() {
    Map to{{"address", how_.connect}, {"client", "irl"}, {"timeout", how_.seconds}};
    if (!how_.token.empty()) to.set("token", how_.token);
    if (!how_.certificate.empty()) to.set("certificate", how_.certificate);
    if (how_.tls) to.set("tls", true);
    if (how_.no_tls) to.set("tls", false);
    auto opened = ask("connection.open", to);
    if (!opened.ok()) {
      Error e = std::move(opened).error();
      if (e.code == ErrorCode::permission && how_.token.empty())
        e.hint =
            "Get a token from the server's administrator, and give its file with --token-file.";
      return e;
    }
    RMP_TRY_ASSIGN(const Value about, ask("program.describe", Map{{"id", program_}}));
    name_ = text_of(*about.as_map(), "name");
    RMP_TRY_ASSIGN(List all, bindings());
    run_ = Map{{"id", program_},
               {"connection", *opened->as_map()->find("connection")},
               {"real_time", !how_.fast}};
    for (const auto& [name, value] : {std::pair("world", &how_.world),
                                      {"robot", &how_.robot},
                                      {"frame", &how_.frame},
                                      {"tool", &how_.tool}})
      if (!value->empty()) run_.set(name, *value);
    if (!all.empty()) run_.set("bindings", std::move(all));
    add_common(run_);
    return {};
  }
  static Result<void> done(Result<Value> answer) {
    if (answer.ok()) return {};
    return std::move(answer).error();
  }

  ioci::Application& app_;
  ioci::Session& session_;
  const IrlSettings& how_;
  const IrlVoice& voice_;
  Value program_;     ///< its handle
  std::string name_;  ///< in the world
  std::shared_ptr<const CompiledProgram> code_;
  std::vector<program::Preset> values_;
  Map inputs_;
  Value input_value_;
  Map run_;  ///< arguments
};

}  // namespace

Result<void> check_irl(const IrlSettings& how) {
  const auto no = [](const char* option, std::string why, std::string hint) {
    return error(ErrorCode::usage, std::string(option) + " " + std::move(why), std::move(hint));
  };
  if (how.check && how.code) return no("--code", "goes without --check", "Leave one of them out.");
  if (how.real_time && how.fast)
    return no("--real-time", "goes without --fast", "Leave one of them out.");
  if (how.connect.empty()) {
    for (const auto& [option, is_given] : {std::pair("--world", !how.world.empty()),
                                           {"--token-file", !how.token.empty()},
                                           {"--certificate", !how.certificate.empty()},
                                           {"--tls", how.tls},
                                           {"--no-tls", how.no_tls}})
      if (is_given) return no(option, "goes with --connect", "Give --connect HOST:PORT.");
  }
  if (how.is_alone())
    for (const auto& [option, is_given] : {std::pair("--bind", !how.bind.empty()),
                                           {"--grip", !how.grip.empty()},
                                           {"--frame", !how.frame.empty()},
                                           {"--tool", !how.tool.empty()},
                                           {"--output", !how.record.empty()}})
      if (is_given) return no(option, "needs a world", "Give --robot NAME or --connect HOST:PORT.");
  if (how.real_time && !how.is_alone() && how.connect.empty())
    return no(
        "--real-time", "goes with --connect, or without a robot",
        "A run with --robot is computed at once; play it in real time with recording.replay.");
  return {};
}

int run_irl(ioci::Application& app, ioci::Session& session, const IrlSettings& how,
            const IrlVoice& voice) {
  return Run(app, session, how, voice).run();
}

}  // namespace robomosp::shell
