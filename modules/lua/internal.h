// SPDX-License-Identifier: Apache-2.0
// Shared by the files of this module; the only header that exposes Lua's own headers (layer:
// application, lua, internal).
#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdio>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include <lua.hpp>

#include "kernel/call_queue.h"
#include "kernel/permit.h"
#include "kernel/value.h"
#include "lua/command_host.h"
#include "lua/lua_state.h"
#include "lua/pretty.h"

namespace robomosp::lua {

/// A table nested deeper than this (or one that contains itself) is rejected; this also limits the
/// recursion of conversions.
inline constexpr int kDeepestValue = 64;

/// Kind of a handle userdata; there is one metatable per kind, so a handle is only its number.
struct KindInfo {
  std::string kind;
};
struct HandleBox {
  std::uint64_t number;
};

/// A numeric array userdata; `row` other than kWhole is a view of one row of a matrix.
struct ArrayBox {
  static constexpr std::size_t kWhole = static_cast<std::size_t>(-1);
  NumericArray source;
  std::string unit;
  std::size_t row = kWhole;
  std::size_t counted = 0;  ///< bytes reported to the memory budget

  [[nodiscard]] bool is_matrix() const { return row == kWhole && source.is_matrix(); }
  [[nodiscard]] std::size_t length() const { return row != kWhole ? source.cols() : source.rows(); }
  [[nodiscard]] double entry(std::size_t i) const {
    return row != kWhole ? source.at(row, i) : source[i];
  }
  [[nodiscard]] NumericArray value() const;  ///< the viewed numbers with their unit
};

/// A provider given by a script. Adapters share it; on withdrawal `state` becomes null and they
/// return an error. Used on the state's thread only, except for constant members.
struct LuaProvider {
  LuaState::Impl* state = nullptr;
  std::shared_ptr<CallQueue> calls;  ///< to the state's thread
  std::chrono::milliseconds patience{};
  int ref = LUA_NOREF;  ///< the function or table, in the registry
  std::string interface_id, name;
  std::vector<std::string> tags;
  Schema schema;
  std::vector<int> values;  ///< of the script, kept in the registry by adapters
  std::string origin;
  std::string source;    ///< the script that provided it; "" = not known
  bool is_kept = false;  ///< it came with a record: it may only compute and read

  [[nodiscard]] bool has_tag(std::string_view tag) const {
    return std::find(tags.begin(), tags.end(), tag) != tags.end();
  }
};

}  // namespace robomosp::lua

struct robomosp::lua::LuaState::Impl {
  Impl(std::unique_ptr<CommandHost> h, LuaOptions o);
  virtual ~Impl();
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;
  /// Called before each run and after serving other threads.
  virtual void catch_up() {}
  /// Called with the table of a command's arguments: returns one in which functions are replaced by
  /// names of providers, where the command accepts them.
  virtual Result<void> take_functions(lua_State*, const ioci::CommandSpec&, int /*table*/) {
    return {};
  }
  /// How a record of this name, in the document or the library, becomes a variable; "" = none.
  [[nodiscard]] virtual std::string record_hint(const std::string& /*name*/) { return {}; }
  /// Called before the state of Lua is closed.
  virtual void before_close() {}

  const std::unique_ptr<CommandHost> owned_host;
  CommandHost& host;
  LuaOptions options;
  bool is_untrusted = false;  ///< with the libraries for untrusted scripts (untrusted.cpp)
  /// Calls from other threads to the thread of this state.
  const std::shared_ptr<CallQueue> calls = CallQueue::for_this_thread();
  lua_State* main = nullptr;
  lua_State* current = nullptr;      ///< running Lua thread, used by callbacks of providers
  int depth = 0;                     ///< nested top-level runs
  std::size_t used = 0;              ///< bytes allocated by Lua
  std::size_t external = 0;          ///< bytes of arrays held by userdata
  bool is_collected_rarely = false;  ///< see push()
  std::size_t collect_at = std::size_t{64} << 20;  ///< `external` at which a full collection runs
  bool stopping = false;                           ///< an interrupt is propagating
  std::optional<int> exit_code;
  std::string traceback;
  std::map<std::string, std::unique_ptr<KindInfo>, std::less<>> kinds;
  /// Loaded texts, by their name in Lua: "@box.lua", "=console".
  std::map<std::string, std::string, std::less<>> sources;
  /// What scripts write to standard output; goes where print() goes. Outlives their handles.
  std::unique_ptr<std::FILE, int (*)(std::FILE*)> out{nullptr, std::fclose};
  std::set<std::string, std::less<>> hidden;  ///< built-in globals that a console was warned about
                                              ///< replacing
  int digits = 6;                             ///< significant digits of printed numbers
  std::uint64_t commands = 0;                 ///< revision of the table when the state was last
                                              ///< updated
};

namespace robomosp::lua {

using Impl = LuaState::Impl;

[[nodiscard]] inline Impl& impl_of(lua_State* L) {
  return **static_cast<Impl**>(lua_getextraspace(L));
}

// --- the trampoline (call.cpp), the only place that raises -----------------------------------

/// A function of this module: gets arguments on the stack, returns the number of results it pushed,
/// or an Error. It may call Lua functions that raise: Lua compiled as C++ unwinds C++ frames.
using Function = Result<int> (*)(Impl&, lua_State*);
/// Return value of a Function that leaves the error object to raise on top.
inline constexpr int kRaiseTop = -1;

/// Calls `fn`: a Result's error and foreign exceptions become Lua error objects, raised only after
/// every C++ object of `fn` is destroyed; Lua's own errors pass.
int enter(lua_State* L, Function fn);
template <Function fn>
int entry(lua_State* L) {
  return enter(L, fn);
}

/// A call with traceback from C++; the function and its arguments are on the stack. On failure it
/// leaves the error object on the stack and returns a status other than LUA_OK.
int protected_call(Impl&, lua_State* L, int arguments, int results);
/// The same, with the error object popped and converted to an Error.
Result<void> call(Impl&, lua_State* L, int arguments, int results);

using Body = std::function<Result<void>(lua_State*)>;
/// All calls from C++ pass through this function: `body` runs protected, so that a memory error
/// raised by a mere push is caught. (lua_state.cpp)
Result<void> run_protected(Impl&, const Body& body);
/// Creates the state of `impl` and initialises it with `open`.
void open_state(Impl& impl, const Body& open);

/// Adds the commands' namespaces and the table `ioci`.
void open_commands(Impl&, lua_State* L);
/// Adds commands registered since then, to namespaces and to existing handles.
void open_new_commands(Impl&, lua_State* L);
/// Adds a command to the methods of the handles of its kind, if such handles exist. (handle.cpp)
void add_method(Impl&, lua_State* L, const ioci::CommandSpec& spec);
/// The command of a function value; nullptr if it is another function.
[[nodiscard]] const ioci::CommandSpec* command_of(lua_State* L, int index);
/// Pushes the function of a command; a method takes its handle first.
void push_command(lua_State* L, const ioci::CommandSpec& spec, bool is_method);

// --- values (convert.cpp) ---------------------------------------------------------------------

[[nodiscard]] Result<Value> to_value(lua_State* L, int index, int depth = 0);
/// Named arguments of a table with string keys. `params`, of a command: a table of many rows of
/// numbers becomes a matrix if the command accepts joint values or the like.
[[nodiscard]] Result<Map> to_map(lua_State* L, int index, int depth = 0,
                                 const Schema* params = nullptr);
/// The same of one argument.
[[nodiscard]] Result<Value> argument_value(lua_State* L, int index, const Schema& params,
                                           std::string_view name);
/// Pushes; `returns` (may be null) names the units and fields for printing.
void push(Impl&, lua_State* L, const Value& value, const ioci::ReturnSpec* returns = nullptr);
/// The ReturnSpec a table was pushed with; nullptr without.
[[nodiscard]] const ioci::ReturnSpec* returns_of(lua_State* L, int index);
/// Pushes an error object; `at` is the script line, may be empty.
void push_error(lua_State* L, const Error& e, std::string_view at);
/// The Error of any error object: ours, a table like it, a string, another value.
[[nodiscard]] Error to_error(lua_State* L, int index);
/// "box.lua:12" of the caller at a level, "" in C.
[[nodiscard]] std::string place(lua_State* L, int level);
/// Whether long lists are cut after their beginning. `as_text`: complete, and independent of the
/// terminal.
enum class Shown { beginning, all, as_text };
/// Readable text of any value; never runs a script.
[[nodiscard]] std::string pretty_of(Impl&, lua_State* L, int index, Shown shown = Shown::beginning);
/// The text that a console shows for a result: a handle of a kind with a command `overview` is
/// shown by that command.
[[nodiscard]] std::string result_text_of(Impl&, lua_State* L, int index);
/// How values are shown here: digits, and the width of the terminal if there is one.
[[nodiscard]] PrettyStyle style_of(const Impl&);
/// A sequence or array of numbers.
[[nodiscard]] Result<std::vector<double>> to_reals(lua_State* L, int index, std::string_view what);
void open_errors(lua_State* L);

// --- userdata (array.cpp, handle.cpp) -----------------------------------------------------------

[[nodiscard]] const ArrayBox* array_at(lua_State* L, int index);
void push_array(Impl&, lua_State* L, NumericArray array, std::string_view unit = {});
/// Pushes a table of numbers, or of rows, as an array.
[[nodiscard]] Result<void> push_array_of(Impl&, lua_State* L, int table, const std::string& unit);
/// The pose of a 4x4 matrix; nullopt for other shapes, or if its columns are not the unit vectors
/// of a right-handed frame to 1e-6.
[[nodiscard]] std::optional<Pose> rigid_pose(const NumericArray&);
void open_arrays(lua_State* L);
void open_linear_algebra(lua_State* L);  ///< `linalg`, after the arrays (linear_algebra.cpp)
void push_array_methods(lua_State* L);   ///< their table

[[nodiscard]] std::optional<Handle> handle_at(lua_State* L, int index);
[[nodiscard]] const KindInfo* handle_kind(lua_State* L, int index);
void push_handle(Impl&, lua_State* L, const Handle& handle);
/// Names after the colon of a kind's handles, sorted.
[[nodiscard]] std::vector<std::string> method_names(const Impl&, std::string_view kind);

// --- the rest -----------------------------------------------------------------------------------

/// print, help, deg, pose, ..., and the restrictions of the standard libraries
/// (standard_libraries.cpp).
void open_globals(Impl&, lua_State* L);
/// The same without the standard libraries.
void open_helpers(lua_State* L);
/// Wraps xpcall, so that no message handler delays the end of a script (globals.cpp).
void guard_xpcall(lua_State* L);
/// The libraries and helpers of untrusted scripts, instead of Lua's own (untrusted.cpp).
void open_untrusted(Impl&, lua_State* L);
/// The hint for an untrusted script that uses an unavailable global; "" for other names.
[[nodiscard]] std::string untrusted_hint(std::string_view global);
/// Adds ioci.provide and ioci.withdraw (provide.cpp).
void open_providers(Impl&, lua_State* L);
/// Origin of a provider.
struct ProviderSource {
  std::string origin;   ///< ProviderInfo::origin
  std::string summary;  ///< used if the provider gives none
  std::string text;     ///< of its script, if known
  bool is_kept = false;
  bool only_checks = false;  ///< nothing is registered
};
/// Registers the function or table at `index`; a name that is taken is an error.
Result<void> add_provider(Impl&, lua_State* L, const std::string& interface_id,
                          const std::string& name, int index, ProviderSource source);
/// Withdraws the one at a place of impl.providers.
void withdraw_at(Impl&, std::size_t place);
void withdraw_all(Impl&);
/// Withdraws all but the first `keep` providers of this state.
void withdraw_after(Impl&, std::size_t keep);
/// Loads a text as a function; a syntax error is returned. (lua_state.cpp)
Result<void> load_script(lua_State* L, std::string_view code, const std::string& file);
/// Re-arms the hook that checks for Ctrl-C and the time limit (lua_state.cpp).
void stop_script(Impl&, lua_State* L);
[[nodiscard]] bool is_stopping(const Impl&);
/// Candidates at a cursor (complete.cpp).
[[nodiscard]] Completion completion(Impl&, lua_State* L, std::string_view input,
                                    std::size_t cursor);
/// Remembers the globals of a new state as built-in (own_globals.cpp).
void keep_own_globals(lua_State* L);
/// Restores those of them that a console set to nil, and notes once which ones it replaced.
void check_own_globals(Impl&, lua_State* L);
/// A hint for an undefined global: a record of that name, one of the library, or a similar command.
/// May be empty.
[[nodiscard]] std::string hint_for_name(Impl&, lua_State* L, const std::string& name);
/// The note on an input that is one undefined name; "" = it is not a name.
[[nodiscard]] std::string note_for_undefined(Impl&, lua_State* L, const std::string& name);
/// An error for what the session may not do; `what` is the function that would do it. (globals.cpp)
[[nodiscard]] Result<void> script_may(const Impl&, Effect, std::string_view what);
/// Restricts files to the session's folder, if it has one, until the scope ends. (confined.cpp)
class SessionFiles {
 public:
  explicit SessionFiles(const Impl&);
  SessionFiles(const SessionFiles&) = delete;
  SessionFiles& operator=(const SessionFiles&) = delete;

 private:
  Permit permit_;
  PermitScope scope_;
};
/// Calls a function of Lua's own libraries for a session confined to a folder; the stack has the
/// function, its name and the arguments. A plain C function, since dofile may yield.
int call_confined_library(lua_State* L);
/// Prints through the session's sink.
void print_text(Impl&, std::string_view text);
/// The topic of the command `help` for the value at `index`; nullopt if it is neither command,
/// namespace, handle nor text.
[[nodiscard]] std::optional<std::string> help_topic(Impl&, lua_State* L, int index);
/// Help on a helper, a command or a topic.
[[nodiscard]] Result<std::string> help_text(Impl&, const std::string& topic);

}  // namespace robomosp::lua
