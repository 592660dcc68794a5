// SPDX-License-Identifier: Apache-2.0
#include "remote/debuggee.h"

#include <algorithm>
#include <utility>

#include "kernel/text.h"

namespace robomosp::remote {
namespace {

namespace fs = std::filesystem;

class Flagged final : public Progress {
 public:
  explicit Flagged(const std::atomic<bool>& cancel) : cancel_(cancel) {}
  void report(double, std::string_view) override {}
  [[nodiscard]] bool cancelled() const override { return cancel_.load(); }

 private:
  const std::atomic<bool>& cancel_;
};

std::string debuggee_text(const Value& v, std::string_view name) {
  const Map* m = v.as_map();
  const Value* found = m ? m->find(name) : nullptr;
  return found && found->as_string() ? *found->as_string() : std::string();
}
bool debuggee_flag(const Value& v, std::string_view name) {
  const Map* m = v.as_map();
  const Value* found = m ? m->find(name) : nullptr;
  return found && found->as_bool() && *found->as_bool();
}
const List& debuggee_list(const Value& v) {
  static const List none;
  return v.as_list() ? *v.as_list() : none;
}
/// The kind of a handle, of this program or of another one.
std::string kind_of(const Value& v) {
  if (const Handle* h = v.as_handle()) return h->kind;
  const Map* m = v.as_map();
  const Value* inner = m ? m->find("$handle") : nullptr;
  return inner ? debuggee_text(*inner, "kind") : std::string();
}
std::string number_of(const Value& v) {
  if (const Handle* h = v.as_handle()) return std::to_string(h->number);
  const Map* m = v.as_map();
  const Value* inner = m ? m->find("$handle") : nullptr;
  const Value* n = inner && inner->as_map() ? inner->as_map()->find("number") : nullptr;
  return n ? n->text() : std::string();
}

}  // namespace

Result<std::unique_ptr<Debuggee>> Debuggee::launch(ioci::Application& app, ioci::Session& session,
                                                   lua::LuaState& lua, LaunchSettings settings) {
  std::unique_ptr<Debuggee> out(new Debuggee());
  out->app_ = &app, out->session_ = &session, out->lua_ = &lua;
  out->launched_ = std::move(settings);
  if (auto done = out->load(); !done.ok()) {
    // Nothing of it is in the way of the next attempt.
    if (!out->run_.is_nil()) (void)out->ask_run("run.remove");
    (void)out->ask("document.clear", Map{});
    return std::move(done).error();
  }
  return out;
}

Result<std::unique_ptr<Debuggee>> Debuggee::attach(AttachSettings settings,
                                                   const std::atomic<bool>& cancel) {
  std::unique_ptr<Debuggee> out(new Debuggee());
  out->cancel_ = &cancel;
  Flagged progress(cancel);
  settings.client.name = "debugger";
  RMP_TRY_ASSIGN(out->client_, Client::connect(settings.client, progress));
  RMP_TRY(out->find_run(settings));
  return out;
}

Result<Value> Debuggee::ask(std::string_view command, const Map& args) {
  if (!client_) return app_->dispatch(*session_, command, args);
  Flagged progress(*cancel_);
  return client_->call(std::string(command), args, false, 0, progress);
}

Result<Value> Debuggee::ask_run(std::string_view command, Map args) {
  args.set("id", run_);
  return ask(command, args);
}

fs::path Debuggee::folder() const {
  return client_ ? fs::path() : fs::absolute(launched_.program).parent_path();
}

Result<void> Debuggee::load() {
  for (const fs::path& file : launched_.files)
    RMP_TRY(ask("file.load", Map{{"file", file.string()}}));
  RMP_TRY_ASSIGN(const Value world, load_file());
  return start_run(world, launched_.run);
}

/// The world that what is launched makes, or has.
Result<Value> Debuggee::load_file() {
  const fs::path& file = launched_.program;
  std::string extension = file.extension().string();
  for (char& c : extension)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  if (extension == ".lua") {
    RMP_TRY_ASSIGN(const List made, lua_->run_file_values(file, launched_.arguments));
    if (const auto code = lua_->exit_requested())
      return error(ErrorCode::script_failed,
                   "the script ended the program with code " + std::to_string(*code),
                   "Do not call os.exit in a debugged script.", file.filename().string());
    return world_with_programs(made.empty() ? Value() : made.front());
  }
  if (extension == ".wld" || extension == ".stn") {
    RMP_TRY_ASSIGN(const Value loaded, ask("file.load", Map{{"file", file.string()}}));
    return world_with_programs(loaded);
  }
  if (extension == ".prg")
    if (auto loaded = ask("file.load", Map{{"file", file.string()}}); loaded.ok())
      return world_for(*loaded, true);
  RMP_TRY_ASSIGN(const Value program, ask("program.import", Map{{"file", file.string()}}));
  return world_for(program, false);
}

/// The world of a program: its own, or a new one for it alone.
Result<Value> Debuggee::world_for(const Value& program, bool is_record) {
  if (!launched_.run.world.empty()) {
    RMP_TRY_ASSIGN(const Value world, ask("world.get", Map{{"name", launched_.run.world}}));
    if (!is_record) RMP_TRY(ask("world.add_program", Map{{"id", world}, {"program", program}}));
    return world;
  }
  if (is_record) return world_with_programs(Value());
  RMP_TRY_ASSIGN(const Value world,
                 ask("world.create", Map{{"name", launched_.program.stem().string() + "_cell"}}));
  if (!launched_.robot.empty()) {
    Value robot;
    if (launched_.robot.ends_with(".rbt")) {
      RMP_TRY_ASSIGN(robot, ask("file.load", Map{{"file", launched_.robot}}));
    } else {
      RMP_TRY_ASSIGN(robot, ask("robot.get", Map{{"name", launched_.robot}}));
    }
    RMP_TRY(ask("world.add_robot", Map{{"id", world}, {"robot", robot}}));
  }
  RMP_TRY(ask("world.add_program", Map{{"id", world}, {"program", program}}));
  // Its signals have nobody else.
  if (launched_.run.unbound.empty()) launched_.run.unbound = "free";
  return world;
}

/// The world that is named, the loaded one, or the only one that has programs.
Result<Value> Debuggee::world_with_programs(const Value& loaded) {
  if (!launched_.run.world.empty()) return ask("world.get", Map{{"name", launched_.run.world}});
  const auto has_programs = [this](const Value& world) -> Result<bool> {
    RMP_TRY_ASSIGN(const Value programs, ask("world.programs", Map{{"id", world}}));
    return programs.as_list() && !programs.as_list()->empty();
  };
  if (kind_of(loaded) == "world") {
    RMP_TRY_ASSIGN(const bool has, has_programs(loaded));
    if (has) return loaded;
  }
  RMP_TRY_ASSIGN(const Value all, ask("world.list", Map{}));
  Value found;
  std::vector<std::string> names;
  for (const Value& world : debuggee_list(all)) {
    RMP_TRY_ASSIGN(const bool has, has_programs(world));
    if (!has) continue;
    found = world;
    const Handle* h = world.as_handle();
    names.push_back(h && app_ ? app_->name_of(*h).value_or("") : number_of(world));
  }
  if (names.size() == 1) return found;
  if (names.empty())
    return error(ErrorCode::not_found, "no loaded world has a program",
                 "Add one with world.add_program; files = [...] loads saved ones (.prg).",
                 launched_.program.filename().string());
  return error(ErrorCode::invalid_argument, std::to_string(names.size()) + " worlds have programs",
               "Give world, one of " + text::enumerate(names) + ".", "world");
}

Result<void> Debuggee::start_run(const Value& world, const RunSettings& how) {
  Map with;
  if (!how.programs.empty()) {
    List names;
    for (const std::string& name : how.programs) names.emplace_back(name);
    with.set("program", std::move(names));
  }
  if (!how.unbound.empty()) with.set("unbound", how.unbound);
  if (how.sample_time) with.set("sample_time", *how.sample_time);
  if (how.most_time) with.set("most_time", *how.most_time);
  if (how.duration) with.set("duration", *how.duration);
  RMP_TRY_ASSIGN(
      run_,
      ask("world.start_run",
          Map{{"id", world}, {"of", "tasks"}, {"with", std::move(with)}, {"entry", how.entry}}));
  // A run without programs has nothing to debug.
  RMP_TRY(ask_run("run.programs"));
  RMP_TRY_ASSIGN(const Value all, ask("run.list", Map{}));
  for (const Value& one : debuggee_list(all))
    if (const Map* m = one.as_map();
        m && m->find("id") && number_of(*m->find("id")) == number_of(run_))
      title_ = debuggee_text(one, "title");
  return {};
}

Result<void> Debuggee::find_run(const AttachSettings& how) {
  RMP_TRY_ASSIGN(const Value all, ask("run.list", Map{}));
  std::vector<std::string> titles;
  std::vector<const Map*> fit;
  for (const Value& one : debuggee_list(all)) {
    const Map* m = one.as_map();
    if (!m || !m->find("id")) continue;
    titles.push_back(debuggee_text(one, "title"));
    if (how.which.empty() || how.which == titles.back() || how.which == number_of(*m->find("id")))
      fit.push_back(m);
  }
  if (how.which.empty() && !how.run.world.empty()) {
    RMP_TRY_ASSIGN(const Value world, ask("world.get", Map{{"name", how.run.world}}));
    return start_run(world, how.run);
  }
  if (fit.size() != 1)
    return error(ErrorCode::invalid_argument,
                 titles.empty() ? "there is no live run to attach to"
                 : fit.empty()  ? "there is no live run " + text::quote(how.which)
                                : std::to_string(fit.size()) + " live runs fit",
                 titles.empty() ? "Give world to start one."
                                : "Give run, its number or one of " + text::enumerate(titles) + ".",
                 "run");
  run_ = *fit.front()->find("id");
  title_ = debuggee_text(Value(*fit.front()), "title");
  is_foreign_ = true;
  was_playing_ = debuggee_flag(Value(*fit.front()), "is_playing");
  RMP_TRY(ask_run("run.programs"));
  return {};
}

Result<void> Debuggee::restart(const std::string& entry) {
  if (client_) {
    RMP_TRY(ask_run("run.reset", Map{{"entry", entry}}));
    return {};
  }
  if (!run_.is_nil()) (void)ask_run("run.remove");
  run_ = Value();
  launched_.run.entry = entry;
  // Files may have been edited: nothing of them stays.
  RMP_TRY(ask("document.clear", Map{}));
  return load();
}

void Debuggee::leave(bool goes_on) {
  if (run_.is_nil()) return;
  if (!is_foreign_) (void)ask_run("run.remove");
  else if (goes_on && was_playing_) (void)ask_run("run.play");
}

}  // namespace robomosp::remote
