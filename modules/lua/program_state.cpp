// SPDX-License-Identifier: Apache-2.0
// A Lua state in this process: its commands are those of the application, its scripts provide
// solvers, and scripts in folders of plugins are run at its start.
#include "lua/program_state.h"

#include <algorithm>
#include <cctype>
#include <fstream>
#include <iterator>
#include <set>
#include <utility>

#include "ioci/core/chosen_providers.h"
#include "ioci/core/classic.h"
#include "ioci/core/commands.h"
#include "ioci/core/scripted.h"
#include "kernel/permit.h"
#include "kernel/text.h"
#include "lua/kept_scripts.h"

namespace robomosp::lua {
namespace {

std::string lower(std::string_view s) {
  std::string out(s);
  for (char& c : out) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return out;
}

class ProgramHost final : public CommandHost {
 public:
  ProgramHost(ioci::Application& app, ioci::Session& session)
      : app_(app), session_(session), nouns_(classic_nouns(app.commands)) {}
  [[nodiscard]] std::uint64_t revision() const override { return app_.commands.revision(); }
  [[nodiscard]] const ioci::CommandSpec* find(std::string_view name) const override {
    return app_.commands.find(name);
  }
  [[nodiscard]] std::vector<const ioci::CommandSpec*> list() const override {
    return app_.commands.list();
  }
  [[nodiscard]] std::vector<const ioci::CommandSpec*> methods_of(
      std::string_view kind) const override {
    return app_.commands.methods_of(kind);
  }
  [[nodiscard]] Error unknown(std::string_view name) const override {
    return app_.commands.unknown(name);
  }
  [[nodiscard]] bool is_classic_noun(std::string_view word) const override {
    return nouns_.contains(lower(ioci::without_prefix(word)));
  }
  Result<Value> dispatch(const ioci::CommandSpec& spec, const Map& args) override {
    const ioci::ScriptedCalls by_lua;
    return app_.dispatch(session_, spec, args);
  }
  Result<Handle> dispatch_async(const ioci::CommandSpec& spec, Map args) override {
    return app_.dispatch_async(session_, spec.name, std::move(args));
  }
  Result<Value> dispatch_classic(std::string_view line) override {
    const ioci::ScriptedCalls by_lua;
    return app_.dispatch_classic(session_, line);
  }
  Result<void> transaction(const std::string& label,
                           const std::function<Result<void>()>& body) override {
    return app_.transaction(session_, label, body);
  }
  [[nodiscard]] std::optional<std::string> name_of(const Handle& h) const override {
    return app_.name_of(h, &session_);
  }
  [[nodiscard]] std::string describe(const Handle& h) const override {
    return app_.describe(h, &session_);
  }
  [[nodiscard]] bool interrupted() const override { return session_.interrupted(); }
  void clear_interrupt() override { session_.clear_interrupt(); }
  [[nodiscard]] Result<void> may(Effect effect, std::string_view what) const override {
    if (session_.may(effect)) return {};
    return not_permitted(session_.name(), what, effect);
  }
  void warn(std::string_view code, const std::string& sentence) override {
    app_.messages.post(Severity::warning, std::string(code), sentence, "lua");
  }
  void note(std::string_view code, const std::string& sentence) override {
    app_.messages.post(Severity::info, std::string(code), sentence, "lua");
  }

 private:
  ioci::Application& app_;
  ioci::Session& session_;
  const std::set<std::string, std::less<>> nouns_;
};

}  // namespace

std::set<std::string, std::less<>> classic_nouns(const ioci::CommandTable& commands) {
  std::set<std::string, std::less<>> out;
  for (const ioci::CommandSpec* spec : commands.list())
    for (const std::string_view spelling : text::split(spec->classic, '|'))
      if (const auto t = text::trim(spelling); !t.empty())
        out.insert(lower(t.substr(0, t.find(' '))));
  return out;
}

ProgramState::ProgramState(ioci::Application& a, ioci::Session& s, LuaOptions o)
    : Impl(std::make_unique<ProgramHost>(a, s), std::move(o)), app(a), session(s) {
  if (options.module_path.empty()) options.module_path.push_back(app.share / "lib");
}
ProgramState::~ProgramState() = default;

void ProgramState::catch_up() {
  if (kept) kept->catch_up();
}

std::string ProgramState::record_hint(const std::string& name) {
  // A script may meet such errors in a loop; the library is in files.
  if (session.kind() != ioci::SessionKind::console && session.name() != "eval") return {};
  const auto call = [&name](Kind kind) {
    return name + " = " + std::string(to_string(kind)) + " " + text::quote(name);
  };
  const auto now = app.document.now();
  for (const Kind kind : all_kinds())
    if (now->find(kind, name))
      return "The document has the " + std::string(to_string(kind)) + " " + text::quote(name) +
             ": " + call(kind) + " makes it a variable.";
  for (const Kind kind : all_kinds())
    if (ioci::library_file(app, kind, name)) return call(kind) + " loads it from the library.";
  return {};
}

void ProgramState::before_close() {
  kept.reset();
  withdraw_all(*this);
}

LuaState::LuaState(ioci::Application& app, ioci::Session& session, LuaOptions options) {
  auto made = std::make_unique<ProgramState>(app, session, std::move(options));
  open_state(*made, [&made](lua_State* L) -> Result<void> {
    luaL_openlibs(L);
    open_errors(L);
    open_arrays(L);
    open_linear_algebra(L);
    open_commands(*made, L);
    open_providers(*made, L);
    open_globals(*made, L);
    keep_own_globals(L);
    return {};
  });
  made->kept = std::make_unique<KeptScripts>(*made);
  impl_ = std::move(made);
}

void LuaState::load_plugins(std::span<const std::filesystem::path> files) {
  ProgramState& impl = program_of(*impl_);
  const auto warn = [&impl](const char* code, const std::string& sentence) {
    impl.app.messages.post(Severity::warning, code, sentence, "plugins");
  };
  for (const std::filesystem::path& file : files) {
    const std::size_t before = impl.providers.size();
    impl.plugin = file.string();
    const auto done = run_protected(impl, [&](lua_State* L) -> Result<void> {
      std::ifstream in(file, std::ios::binary);
      if (!in) return error(ErrorCode::io, "it cannot be read", "Check its permissions.");
      const std::string code((std::istreambuf_iterator<char>(in)), {});
      RMP_TRY(load_script(L, code, file.string()));
      // What it makes global is its own; what is global here it sees.
      lua_newtable(L);
      lua_createtable(L, 0, 1);
      lua_pushglobaltable(L);
      lua_setfield(L, -2, "__index");
      lua_setmetatable(L, -2);
      lua_setupvalue(L, -2, 1);
      return call(impl, L, 0, 0);
    });
    impl.plugin.clear();
    if (done.ok()) continue;
    withdraw_after(impl, before);
    warn("plugin_refused",
         "the plugin " + text::quote(file.string()) + " was left out: " + done.error().sentence());
  }
  if (files.empty()) return;
  for (const auto& [interface_id, name] : ioci::chosen_providers())
    if (const auto set = impl.app.registry.set_user_default(interface_id, name); !set.ok())
      warn("default_missing", "The chosen default is not available: " + set.error().sentence());
}

}  // namespace robomosp::lua
