// SPDX-License-Identifier: Apache-2.0
#include "lua/lua_state.h"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>

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
              "Look for endless recursion."),
        place(L, 0));
    lua_error(L);
  }
  stop_script(impl, L);
  push_error(L,
             error(ErrorCode::cancelled,
                   impl.exit_code ? "the script called exit" : "the script was interrupted"),
             place(L, 0));
  lua_error(L);
}

void arm(lua_State* L) { lua_sethook(L, hook, LUA_MASKCOUNT, kHookEvery); }

/// A top-level run: begins without an old interrupt, and leaves none behind.
class Run {
 public:
  explicit Run(Impl& impl) : impl_(impl), top_(lua_gettop(state(impl))) {
    if (impl_.depth++ == 0) {
      impl_.host.clear_interrupt();
      impl_.stopping = false;
      arm(impl_.main);
    }
  }
  ~Run() {
    lua_settop(state(impl_), top_);
    if (--impl_.depth > 0) return;
    if (impl_.out) std::fflush(impl_.out.get());
    impl_.host.clear_interrupt();
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

struct Job {
  const Body* body;
  std::optional<Error> failed;
};

Result<int> run_job(Impl& impl, lua_State* L) {
  auto& job = *static_cast<Job*>(lua_touserdata(L, 1));
  lua_settop(L, 0);
  if (impl.host.revision() != impl.commands) open_new_commands(impl, L);
  impl.catch_up();
  auto r = (*job.body)(L);
  if (!r.ok()) job.failed = std::move(r).error();
  return 0;
}

bool ends_with_eof(std::string_view message) { return message.ends_with("<eof>"); }

/// Syntax error of a message like `box.lua:3: '=' expected near 'x'`.
Error syntax_error(lua_State* L) {
  Error e = to_error(L, -1);
  e.code = ErrorCode::syntax;
  if (!e.message.starts_with("syntax error")) e.message = "syntax error: " + e.message;
  return e;
}

Result<void> load(lua_State* L, std::string_view code, const std::string& chunk_name) {
  impl_of(L).sources[chunk_name] = code;
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

bool compiles(lua_State* L, const std::string& code) {
  const bool ok = luaL_loadbufferx(L, code.data(), code.size(), "=input", "t") == LUA_OK;
  lua_pop(L, 1);
  return ok;
}

/// Whether a line at which reading a script ended, or the one before it, only names a value, as one
/// types it at the console. `where` ends with ":LINE".
bool is_shown_value(lua_State* L, std::string_view code, std::string_view where) {
  const auto colon = where.rfind(':');
  const auto number = colon == where.npos ? std::nullopt : text::read_int(where.substr(colon + 1));
  if (!number || *number < 1) return false;
  std::string before;
  std::int64_t at = 0;
  while (!code.empty() && ++at <= *number) {
    const auto end = std::min(code.find('\n'), code.size());
    const std::string line(text::trim(code.substr(0, end)));
    code.remove_prefix(std::min(end + 1, code.size()));
    if (at + 2 >= *number && !line.empty() && !compiles(L, line) && compiles(L, "return " + line) &&
        compiles(L, before))
      return true;
    before += line + "\n";
  }
  return false;
}

/// A classic line begins with one of the paper's nouns and is not Lua.
bool is_classic(const Impl& impl, lua_State* L, std::string_view input) {
  const auto end =
      std::find_if(input.begin(), input.end(), [](char c) { return c == ' ' || c == '\t'; });
  if (!impl.host.is_classic_noun(std::string_view(input.begin(), end))) return false;
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
  if (luaL_loadbufferx(L, expression.data(), expression.size(), name.c_str(), "t") == LUA_OK) {
    impl_of(L).sources[name] = code;
    return {};
  }
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
        const auto known = help_topic(impl, L, -1);
        if (!known && !lua_isnil(L, -1)) {
          // A value of which there is nothing to explain is shown with what it is.
          const char* const type = array_at(L, -1) ? "array" : luaL_typename(L, -1);
          const std::string shown =
              topic + " is " +
              (std::string_view("aeiou").find(type[0]) != std::string_view::npos ? "an " : "a ") +
              type + ": " + result_text_of(impl, L, -1);
          lua_pop(L, 1);
          lua_pushlstring(L, shown.data(), shown.size());
          return {};
        }
        topic = known.value_or(topic);
        lua_pop(L, 1);
      }
    }
    RMP_TRY_ASSIGN(const std::string text, help_text(impl, topic));
    lua_pushlstring(L, text.data(), text.size());
    return {};
  }
  if (is_classic(impl, L, input)) {
    auto result = impl.host.dispatch_classic(input);
    if (!result.ok()) return std::move(result).error();
    if (!result->is_nil()) push(impl, L, *result);
    return {};
  }
  RMP_TRY(load_input(impl, L, input));
  return call(impl, L, 0, LUA_MULTRET);
}

/// `local x = 1` and nothing behind it that could use it.
bool is_lone_local(lua_State* L, const std::string& input) {
  if (!input.starts_with("local ")) return false;
  const auto equals = input.find('=');
  return equals != std::string::npos && compiles(L, "return " + input.substr(equals + 1));
}

/// Appends the results that a window can show (see eval()). Large texts and tables are not copied.
void add_shown(lua_State* L, int first, int last, List& shown) {
  constexpr std::size_t kLongest = 64 << 20;  ///< of a picture [bytes]
  for (int i = first; i <= last; ++i) {
    if (lua_type(L, i) == LUA_TSTRING) {
      std::size_t length = 0;
      const char* text = lua_tolstring(L, i, &length);
      if (length <= kLongest) shown.emplace_back(std::string(text, length));
    } else if (auto handle = handle_at(L, i)) {
      shown.emplace_back(std::move(*handle));
    } else if (lua_istable(L, i)) {
      Map fields;
      for (const char* name : {"png", "file"}) {
        lua_pushstring(L, name);
        if (lua_rawget(L, i) == LUA_TSTRING) {
          std::size_t length = 0;
          const char* text = lua_tolstring(L, -1, &length);
          if (length <= kLongest) fields.set(name, std::string(text, length));
        }
        lua_pop(L, 1);
      }
      if (!fields.empty()) shown.emplace_back(std::move(fields));
    }
  }
}

void remember(lua_State* L, int first, int last) {
  if (first > last) return;
  lua_pushvalue(L, first);
  lua_setglobal(L, "_");
}

}  // namespace

Result<void> run_protected(Impl& impl, const Body& body) {
  RMP_CHECK(impl.calls->is_owner(), "Lua off the thread of its state");
  AppLock::expect_free();
  const Run run(impl);
  lua_State* L = Run::state(impl);
  Job job{&body, {}};
  if (!lua_checkstack(L, 20))
    return error(ErrorCode::script_failed, "the Lua stack is full", "Reduce the call depth.");
  lua_pushcfunction(L, entry<run_job>);
  lua_pushlightuserdata(L, &job);
  RMP_TRY(call(impl, L, 1, 0));
  if (job.failed) return std::move(*job.failed);
  return {};
}

Result<void> load_script(lua_State* L, std::string_view code, const std::string& file) {
  const std::string_view script = without_shebang(code);
  auto loaded = load(L, script, "@" + file);
  if (loaded.ok()) return {};
  Error e = std::move(loaded).error();
  if (e.hint.empty() && is_shown_value(L, script, e.where))
    e.hint =
        "In a script print(...) shows a value; lines as they are typed at the console are run by "
        "robomosp < " +
        file + ".";
  return e;
}

bool is_stopping(const Impl& impl) { return impl.stopping || impl.host.interrupted(); }

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

void open_state(Impl& impl, const Body& open) {
  lua_State* L = lua_newstate(allocate, &impl);
  RMP_CHECK(L != nullptr, "no memory for a Lua state");
  impl.main = L;
  *static_cast<Impl**>(lua_getextraspace(L)) = &impl;
  // What the commands are is read while they are opened.
  impl.commands = impl.host.revision();
  const auto opened = run_protected(impl, open);
  RMP_CHECK(opened.ok(), opened.ok() ? "" : opened.error().sentence().c_str());
}

LuaState::Impl::Impl(std::unique_ptr<CommandHost> h, LuaOptions o)
    : owned_host(std::move(h)), host(*owned_host), options(std::move(o)) {
  calls->open();
}
LuaState::Impl::~Impl() { calls->close(); }

LuaState::LuaState(std::unique_ptr<CommandHost> host, LuaOptions options)
    : impl_(std::make_unique<Impl>(std::move(host), std::move(options))) {
  impl_->is_untrusted = true;
  open_state(*impl_, [this](lua_State* L) -> Result<void> {
    open_untrusted(*impl_, L);
    return {};
  });
}

LuaState::~LuaState() {
  impl_->before_close();
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
  RMP_TRY_ASSIGN(const std::string code, script_text(file));
  return run_text_values(code, file.string(), args);
}

Result<std::string> script_text(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::error_code ec;
  if (!in || std::filesystem::is_directory(file, ec))
    return error(ErrorCode::not_found,
                 "there is no script \"" + file.string() + "\" that can be read",
                 "Check the path.");
  return std::string((std::istreambuf_iterator<char>(in)), {});
}

Result<List> LuaState::run_text_values(std::string_view code, const std::string& file,
                                       std::span<const std::string> args) {
  List out;
  const auto done = run_protected(*impl_, [&](lua_State* L) -> Result<void> {
    const int first = lua_gettop(L) + 1;
    RMP_TRY(load_script(L, code, file));
    lua_createtable(L, static_cast<int>(args.size()), 1);
    lua_pushlstring(L, file.data(), file.size());
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

Result<void> LuaState::run_string(std::string_view code, std::string_view chunk_name) {
  return run_protected(*impl_, [&](lua_State* L) -> Result<void> {
    RMP_TRY(load(L, without_shebang(code), "=" + std::string(chunk_name)));
    return call(*impl_, L, 0, 0);
  });
}

Result<std::string> LuaState::eval(std::string_view input, List* shown) {
  std::string out;
  const std::string word(text::trim(input));
  const auto done = run_protected(*impl_, [&](lua_State* L) -> Result<void> {
    const int first = lua_gettop(L) + 1;
    RMP_TRY(run_input(*impl_, L, input));
    const int last = lua_gettop(L);
    for (int i = first; i <= last; ++i)
      out += (i > first ? "\n" : "") + result_text_of(*impl_, L, i);
    if (shown) add_shown(L, first, last, *shown);
    remember(L, first, last);
    if (first == last && lua_isnil(L, first) && word != "nil" && word != "_")
      if (const std::string note = note_for_undefined(*impl_, L, word); !note.empty())
        impl_->host.note("undefined", note);
    if (is_lone_local(L, word))
      impl_->host.note("lone_local",
                       "A local variable ends with its line here. Omit local to keep it.");
    check_own_globals(*impl_, L);
    return {};
  });
  if (done.ok()) return out;
  Error e = without_place(*impl_, input, done.error());
  (void)run_protected(*impl_, [&](lua_State* L) -> Result<void> {
    check_own_globals(*impl_, L);
    return {};
  });
  return e;
}

Result<List> LuaState::eval_values(std::string_view input) {
  List out;
  const auto done = run_protected(*impl_, [&](lua_State* L) -> Result<void> {
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
  const auto done = run_protected(*impl_, [&](lua_State* L) -> Result<void> {
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

void LuaState::serve() {
  impl_->calls->serve();
  if (impl_->depth == 0) impl_->catch_up();
}

std::shared_ptr<void> LuaState::wake_to_serve(std::function<void()> wake) {
  return std::make_shared<CallQueue::Waker>(*impl_->calls, std::move(wake));
}

const std::string& LuaState::traceback() const { return impl_->traceback; }
std::optional<int> LuaState::exit_requested() const { return impl_->exit_code; }
std::size_t LuaState::memory_used() const { return impl_->used + impl_->external; }

std::string lua_version() { return LUA_RELEASE; }

}  // namespace robomosp::lua
