// SPDX-License-Identifier: Apache-2.0
#include "lua/lua_state.h"

#include <algorithm>
#include <cctype>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <set>

#include "ioci/core/chosen_providers.h"
#include "ioci/core/classic.h"
#include "kernel/check.h"
#include "kernel/text.h"
#include "lua/internal.h"

namespace robomosp::lua {
namespace {

constexpr int kHookEvery = 2000;  // instructions between two looks for Ctrl-C, about 20 us
// A stack is called deep from this many calls on; it then needs this many free slots until the next
// look. Lua's own limit is a million slots. What it collects when it reaches that limit cannot be
// finalized: each attempt copies the whole stack twice, with hooks off, for minutes.
constexpr int kDeepCalls = 500;
constexpr int kFreeSlots = 300000;

/// Lua's allocator with a budget. Freeing and shrinking never fail.
void* allocate(void* ud, void* block, std::size_t old_size, std::size_t new_size) {
  Impl& impl = *static_cast<Impl*>(ud);
  if (block == nullptr) old_size = 0;  // then it is the kind of object
  if (new_size == 0) {
    std::free(block);
    impl.used -= old_size;
    return nullptr;
  }
  if (new_size > old_size &&
      impl.used + impl.external + (new_size - old_size) > impl.options.memory_limit)
    return nullptr;
  void* fresh = std::realloc(block, new_size);
  if (fresh) impl.used += new_size - old_size;
  return fresh;
}

/// Looks for Ctrl-C. Once it came, the hook runs before every instruction and keeps raising, so
/// that a pcall in the script only delays the end by one instruction.
void hook(lua_State* L, lua_Debug*) {
  Impl& impl = impl_of(L);
  if (!is_stopping(impl)) {
    // A coroutine that outlived an interrupted run.
    if (lua_gethookcount(L) == 1) lua_sethook(L, hook, LUA_MASKCOUNT, kHookEvery);
    lua_Debug deep;
    if (!lua_getstack(L, kDeepCalls, &deep) || lua_checkstack(L, kFreeSlots)) return;
    push_error(
        L,
        error(ErrorCode::script_failed, "the script calls itself too deeply (stack overflow)",
              "Look for a function that calls itself without end."),
        place(L, 0));
    lua_error(L);
  }
  stop_script(impl, L);
  push_error(L,
             error(ErrorCode::cancelled,
                   impl.exit_code ? "the script asked to exit" : "the script was interrupted"),
             place(L, 0));
  lua_error(L);
}

void arm(lua_State* L) { lua_sethook(L, hook, LUA_MASKCOUNT, kHookEvery); }

/// A top-level run: begins without an old interrupt, and leaves none behind.
class Run {
 public:
  explicit Run(Impl& impl) : impl_(impl), top_(lua_gettop(state(impl))) {
    if (impl_.depth++ == 0) {
      impl_.session.clear_interrupt();
      impl_.stopping = false;
      arm(impl_.main);
    }
  }
  ~Run() {
    lua_settop(state(impl_), top_);
    if (--impl_.depth > 0) return;
    if (impl_.out) std::fflush(impl_.out.get());
    impl_.session.clear_interrupt();
    impl_.stopping = false;
    arm(impl_.main);
  }
  Run(const Run&) = delete;
  Run& operator=(const Run&) = delete;
  static lua_State* state(Impl& impl) { return impl.current ? impl.current : impl.main; }

 private:
  Impl& impl_;
  int top_;
};

using Body = std::function<Result<void>(lua_State*)>;
struct Job {
  const Body* body;
  std::optional<Error> failed;
};

Result<int> run_job(Impl& impl, lua_State* L) {
  auto& job = *static_cast<Job*>(lua_touserdata(L, 1));
  lua_settop(L, 0);
  if (impl.app.commands.revision() != impl.commands) open_new_commands(impl, L);
  auto r = (*job.body)(L);
  if (!r.ok()) job.failed = std::move(r).error();
  return 0;
}

/// Everything from C++ goes through here: `body` runs protected, so that a memory error raised by
/// a mere push has somewhere to go.
Result<void> protect(Impl& impl, const Body& body) {
  RMP_CHECK(impl.calls->is_owner(), "Lua off the thread of its state");
  AppLock::expect_free();
  const Run run(impl);
  lua_State* L = Run::state(impl);
  Job job{&body, {}};
  if (!lua_checkstack(L, 20))
    return error(ErrorCode::script_failed, "the Lua stack is full", "Call less deep.");
  lua_pushcfunction(L, entry<run_job>);
  lua_pushlightuserdata(L, &job);
  RMP_TRY(call(impl, L, 1, 0));
  if (job.failed) return std::move(*job.failed);
  return {};
}

bool ends_with_eof(std::string_view message) { return message.ends_with("<eof>"); }

/// Syntax error of a message like `box.lua:3: '=' expected near 'x'`.
Error syntax_error(lua_State* L) {
  Error e = to_error(L, -1);
  e.code = ErrorCode::syntax;
  e.message = "syntax error: " + e.message;
  return e;
}

Result<void> load(lua_State* L, std::string_view code, const std::string& chunk_name) {
  if (luaL_loadbufferx(L, code.data(), code.size(), chunk_name.c_str(), "t") == LUA_OK) return {};
  Error e = syntax_error(L);
  lua_pop(L, 1);
  return e;
}

std::string_view without_shebang(std::string_view code) {
  if (code.starts_with("\xEF\xBB\xBF")) code.remove_prefix(3);
  if (code.starts_with("#")) code.remove_prefix(std::min(code.find('\n'), code.size()));
  return code;
}

std::string lower(std::string_view s) {
  std::string out(s);
  for (char& c : out) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return out;
}

bool compiles(lua_State* L, const std::string& code) {
  const bool ok = luaL_loadbufferx(L, code.data(), code.size(), "=input", "t") == LUA_OK;
  lua_pop(L, 1);
  return ok;
}

/// A classic line begins with one of the paper's nouns and is not Lua.
bool is_classic(const Impl& impl, lua_State* L, std::string_view input) {
  input = ioci::without_prefix(input);
  const auto end =
      std::find_if(input.begin(), input.end(), [](char c) { return c == ' ' || c == '\t'; });
  const std::string word = lower(std::string_view(input.begin(), end));
  if (!std::binary_search(impl.classic_nouns.begin(), impl.classic_nouns.end(), word)) return false;
  const std::string code(input);
  return !compiles(L, "return " + code) && !compiles(L, code);
}

/// `pa10:fk` without a call is no Lua; it is meant as the method itself, `pa10.fk`. nullopt for
/// anything but names joined by dots with a colon before the last one.
std::optional<std::string> bare_method(std::string_view input) {
  input = text::trim(input);
  if (input.starts_with("=")) input = text::trim(input.substr(1));
  const auto colon = input.rfind(':');
  if (colon == std::string_view::npos) return std::nullopt;
  const auto is_name = [](std::string_view s) {
    return !s.empty() && !(s[0] >= '0' && s[0] <= '9') &&
           std::all_of(s.begin(), s.end(), [](char c) {
             return c == '_' || (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') ||
                    (c >= 'A' && c <= 'Z');
           });
  };
  for (const std::string_view name : text::split(input.substr(0, colon), '.'))
    if (!is_name(name)) return std::nullopt;
  if (!is_name(input.substr(colon + 1))) return std::nullopt;
  std::string out(input);
  out[colon] = '.';
  return out;
}

/// Loads one console input: `=x` and expressions return their values.
Result<void> load_input(const Impl& impl, lua_State* L, std::string_view input) {
  std::string code(input);
  if (auto method = bare_method(input)) code = std::move(*method);
  if (code.starts_with("=")) code.erase(0, 1);
  const std::string name = "=" + impl.options.input_name;
  const std::string expression = "return " + code;
  if (luaL_loadbufferx(L, expression.data(), expression.size(), name.c_str(), "t") == LUA_OK)
    return {};
  lua_pop(L, 1);
  return load(L, code, name);
}

/// In an input of one line the place "console:1" says nothing.
Error without_place(const Impl& impl, std::string_view input, Error e) {
  const std::string place = impl.options.input_name + ":1";
  if (text::trim(input).find('\n') != std::string_view::npos || !e.where.starts_with(place))
    return e;
  std::string_view rest = std::string_view(e.where).substr(place.size());
  if (!rest.empty() && !rest.starts_with(", ")) return e;  // console:12
  rest.remove_prefix(std::min<std::size_t>(rest.size(), 2));
  e.where = std::string(rest);
  return e;
}

/// Runs one console input; its results are left on the stack above the height before.
Result<void> run_input(Impl& impl, lua_State* L, std::string_view input) {
  input = text::trim(input);
  if (input.empty()) return {};
  if (input.ends_with("?")) {
    const std::string_view about = text::trim(input.substr(0, input.size() - 1));
    std::string topic(about);
    if (load_input(impl, L, about).ok()) {
      const auto found = call(impl, L, 0, 1);
      if (!found.ok() && bare_method(about)) return found.error();
      if (found.ok()) {
        topic = help_topic(impl, L, -1).value_or(topic);
        lua_pop(L, 1);
      }
    }
    RMP_TRY_ASSIGN(const std::string text, help_text(impl, topic));
    lua_pushlstring(L, text.data(), text.size());
    return {};
  }
  if (is_classic(impl, L, input)) {
    auto result = impl.app.dispatch_classic(impl.session, input);
    if (!result.ok()) return std::move(result).error();
    if (!result->is_nil()) push(impl, L, *result);
    return {};
  }
  RMP_TRY(load_input(impl, L, input));
  return call(impl, L, 0, LUA_MULTRET);
}

void remember(lua_State* L, int first, int last) {
  if (first > last) return;
  lua_pushvalue(L, first);
  lua_setglobal(L, "_");
}

}  // namespace

bool is_stopping(const Impl& impl) { return impl.stopping || impl.session.interrupted(); }

void stop_script(Impl& impl, lua_State* L) {
  impl.stopping = true;
  lua_sethook(L, hook, LUA_MASKCOUNT, 1);
  // Callers of a coroutine and threads made later carry hooks of their own.
  lua_sethook(impl.main, hook, LUA_MASKCOUNT, 1);
}

void print_text(Impl& impl, std::string_view text) {
  if (impl.out) std::fflush(impl.out.get());  // in their order
  if (impl.options.print) {
    impl.options.print(text);
  } else {
    std::fwrite(text.data(), 1, text.size(), stdout);
    std::fflush(stdout);
  }
}

LuaState::LuaState(ioci::Application& app, ioci::Session& session, LuaOptions options)
    : impl_(std::make_unique<Impl>(app, session, std::move(options))) {
  if (impl_->options.module_path.empty()) impl_->options.module_path.push_back(app.share / "lib");
  lua_State* L = lua_newstate(allocate, impl_.get());
  RMP_CHECK(L != nullptr, "no memory for a Lua state");
  impl_->main = L;
  *static_cast<Impl**>(lua_getextraspace(L)) = impl_.get();
  std::set<std::string> nouns;
  for (const ioci::CommandSpec* spec : app.commands.list())
    for (const std::string_view spelling : text::split(spec->classic, '|'))
      if (const auto t = text::trim(spelling); !t.empty())
        nouns.insert(lower(t.substr(0, t.find(' '))));
  impl_->classic_nouns.assign(nouns.begin(), nouns.end());
  const auto opened = protect(*impl_, [this](lua_State* l) -> Result<void> {
    luaL_openlibs(l);
    open_errors(l);
    open_arrays(l);
    open_linear_algebra(l);
    open_commands(*impl_, l);
    open_globals(*impl_, l);
    return {};
  });
  RMP_CHECK(opened.ok(), opened.ok() ? "" : opened.error().sentence().c_str());
}

LuaState::~LuaState() {
  withdraw_all(*impl_);
  lua_close(impl_->main);
}

Result<void> LuaState::run_file(const std::filesystem::path& file,
                                std::span<const std::string> args) {
  auto done = run_file_values(file, args);
  if (!done.ok()) return std::move(done).error();
  return {};
}

Result<List> LuaState::run_file_values(const std::filesystem::path& file,
                                       std::span<const std::string> args) {
  List out;
  std::ifstream in(file, std::ios::binary);
  std::error_code ec;
  if (!in || std::filesystem::is_directory(file, ec))
    return error(ErrorCode::not_found,
                 "there is no script \"" + file.string() + "\" that can be read",
                 "Check the path.");
  const std::string code((std::istreambuf_iterator<char>(in)), {});
  const auto done = protect(*impl_, [&](lua_State* L) -> Result<void> {
    const int first = lua_gettop(L) + 1;
    RMP_TRY(load(L, without_shebang(code), "@" + file.string()));
    lua_createtable(L, static_cast<int>(args.size()), 1);
    lua_pushstring(L, file.c_str());
    lua_rawseti(L, -2, 0);
    for (std::size_t i = 0; i < args.size(); ++i) {
      lua_pushlstring(L, args[i].data(), args[i].size());
      lua_rawseti(L, -2, static_cast<lua_Integer>(i + 1));
    }
    lua_setglobal(L, "arg");
    luaL_checkstack(L, static_cast<int>(args.size()) + 4, "too many arguments");
    for (const std::string& a : args) lua_pushlstring(L, a.data(), a.size());
    RMP_TRY(call(*impl_, L, static_cast<int>(args.size()), LUA_MULTRET));
    for (int i = first; i <= lua_gettop(L); ++i) {
      auto value = to_value(L, i);
      out.push_back(value.ok() ? std::move(*value) : Value(pretty_of(*impl_, L, i)));
    }
    return {};
  });
  if (!done.ok()) return done.error();
  return out;
}

void LuaState::load_plugins(std::span<const std::filesystem::path> files) {
  Impl& impl = *impl_;
  const auto warn = [&impl](const char* code, const std::string& sentence) {
    impl.app.messages.post(Severity::warning, code, sentence, "plugins");
  };
  for (const std::filesystem::path& file : files) {
    const std::size_t before = impl.providers.size();
    impl.plugin = file.string();
    const auto done = protect(impl, [&](lua_State* L) -> Result<void> {
      std::ifstream in(file, std::ios::binary);
      if (!in) return error(ErrorCode::io, "it cannot be read", "Check its permissions.");
      const std::string code((std::istreambuf_iterator<char>(in)), {});
      RMP_TRY(load(L, without_shebang(code), "@" + file.string()));
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
      warn("default_missing", "The default that you chose is not there: " + set.error().sentence());
}

Result<void> LuaState::run_string(std::string_view code, std::string_view chunk_name) {
  return protect(*impl_, [&](lua_State* L) -> Result<void> {
    RMP_TRY(load(L, without_shebang(code), "=" + std::string(chunk_name)));
    return call(*impl_, L, 0, 0);
  });
}

Result<std::string> LuaState::eval(std::string_view input) {
  std::string out;
  const auto done = protect(*impl_, [&](lua_State* L) -> Result<void> {
    const int first = lua_gettop(L) + 1;
    RMP_TRY(run_input(*impl_, L, input));
    const int last = lua_gettop(L);
    for (int i = first; i <= last; ++i)
      out += (i > first ? "\n" : "") + result_text_of(*impl_, L, i);
    remember(L, first, last);
    return {};
  });
  if (!done.ok()) return without_place(*impl_, input, done.error());
  return out;
}

Result<List> LuaState::eval_values(std::string_view input) {
  List out;
  const auto done = protect(*impl_, [&](lua_State* L) -> Result<void> {
    const int first = lua_gettop(L) + 1;
    RMP_TRY(run_input(*impl_, L, input));
    const int last = lua_gettop(L);
    for (int i = first; i <= last; ++i) {
      auto value = to_value(L, i);
      out.push_back(value.ok() ? std::move(*value) : Value(pretty_of(*impl_, L, i)));
    }
    remember(L, first, last);
    return {};
  });
  if (!done.ok()) return without_place(*impl_, input, done.error());
  return out;
}

bool LuaState::is_incomplete(std::string_view input) const {
  bool incomplete = false;
  const auto done = protect(*impl_, [&](lua_State* L) -> Result<void> {
    const std::string_view trimmed = text::trim(input);
    if (trimmed.empty() || trimmed.ends_with("?") || is_classic(*impl_, L, trimmed) ||
        load_input(*impl_, L, trimmed).ok())
      return {};
    const std::string code(trimmed.starts_with("=") ? trimmed.substr(1) : trimmed);
    // An expression that goes on is incomplete as `return x`, a statement as itself.
    for (const std::string& attempt : {"return " + code, code}) {
      if (luaL_loadbufferx(L, attempt.data(), attempt.size(), "=input", "t") == LUA_ERRSYNTAX)
        incomplete = incomplete || ends_with_eof(lua_tostring(L, -1));
      lua_pop(L, 1);
    }
    return {};
  });
  return done.ok() && incomplete;
}

Completion LuaState::complete(std::string_view input, std::size_t cursor) const {
  Completion out;
  const auto done = protect(*impl_, [&](lua_State* L) -> Result<void> {
    out = completion(*impl_, L, input, cursor);
    return {};
  });
  return done.ok() ? out : Completion{std::min(cursor, input.size()), {}};
}

void LuaState::serve() { impl_->calls->serve(); }

std::shared_ptr<void> LuaState::wake_to_serve(std::function<void()> wake) {
  return std::make_shared<CallQueue::Waker>(*impl_->calls, std::move(wake));
}

const std::string& LuaState::traceback() const { return impl_->traceback; }
std::optional<int> LuaState::exit_requested() const { return impl_->exit_code; }
std::size_t LuaState::memory_used() const { return impl_->used + impl_->external; }

std::string lua_version() { return LUA_RELEASE; }

}  // namespace robomosp::lua
