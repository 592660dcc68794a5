// SPDX-License-Identifier: Apache-2.0
// LuaState: the scripting language of one session, generated from the command table; used by the
// console of the terminal, the console of the desktop, `run`, `eval` and `rpc`
// (layer: application, lua). No Lua type shows here.
#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <robomosp/sdk/result.h>

#include "ioci/core/application.h"

namespace robomosp::lua {

class CommandHost;

struct LuaOptions {
  /// Where print() goes; empty = standard output.
  std::function<void(std::string_view)> print;
  /// Characters per line of results, evaluated for each; empty or 0 = unlimited.
  std::function<std::size_t()> width = {};
  /// Name of the inputs of eval() in errors and tracebacks: "console:3".
  std::string input_name = "console";
  /// Limit for Lua values and the numeric arrays they hold [bytes].
  std::size_t memory_limit = std::size_t{1} << 30;
  /// Folders of modules for require(); empty = <share>/lib.
  std::vector<std::filesystem::path> module_path;
  /// How long another thread waits for a solver written in Lua until its thread serves it.
  std::chrono::milliseconds patience{10'000};
};

/// Completions: the word that starts at byte `start` may become one of `words`.
struct Completion {
  std::size_t start = 0;
  std::vector<std::string> words;
};

/// One Lua state bound to one session. Never throws. It belongs to the thread that made it; solvers
/// written in it serve other threads while that thread waits: in a command, for a job, or in
/// serve(). [the session's thread]
class LuaState {
 public:
  /// Both outlive the state.
  LuaState(ioci::Application& app, ioci::Session& session, LuaOptions options = {});
  /// For untrusted scripts, over any implementation of `host` (lua/untrusted.cpp lists what they
  /// may use); such a state cannot provide, complete or require.
  LuaState(std::unique_ptr<CommandHost> host, LuaOptions options);
  /// Withdraws the providers of its scripts; adapters still in use return an error.
  ~LuaState();
  LuaState(const LuaState&) = delete;
  LuaState& operator=(const LuaState&) = delete;

  /// Runs a file; `args` become the global table `arg` and the chunk's `...`.
  Result<void> run_file(const std::filesystem::path& file, std::span<const std::string> args = {});
  /// The same; returns the file's return values as Values (others as text).
  Result<List> run_file_values(const std::filesystem::path& file,
                               std::span<const std::string> args = {});
  /// The same for a text in place of the file of that name.
  Result<List> run_text_values(std::string_view code, const std::string& file,
                               std::span<const std::string> args = {});
  Result<void> run_string(std::string_view code, std::string_view chunk_name);

  /// Runs scripts that are plugins: they have separate globals, and their providers have the file
  /// as origin. A failing script is skipped with all its providers, with a warning. Then the user's
  /// choice of defaults is applied to the providers.
  void load_plugins(std::span<const std::filesystem::path> files);

  /// Evaluates one input of a console: an expression (also `=x`), statements, `x?` for help,
  /// `x:name` for help on a method, or a classic line. Returns the readable text of the results; ""
  /// if there are none. Results are stored in `_`. `shown` gets a value for each result that a
  /// window can show as a picture or plot: handles, texts, and of tables the fields png and file.
  Result<std::string> eval(std::string_view input, List* shown = nullptr);
  /// The same for programs: the results as Values (others as text).
  Result<List> eval_values(std::string_view input);

  /// True if the input is the beginning of an incomplete statement.
  [[nodiscard]] bool is_incomplete(std::string_view input) const;
  /// Candidates at byte `cursor` of `input` (all lines so far). Runs no script.
  [[nodiscard]] Completion complete(std::string_view input, std::size_t cursor) const;

  /// Serves calls of other threads to solvers written in Lua; for a thread that waits for input.
  void serve();
  /// Calls `wake`, on another thread, whenever there are calls to serve, as long as the returned
  /// object lives.
  [[nodiscard]] std::shared_ptr<void> wake_to_serve(std::function<void()> wake);

  /// Call stack of the last failure, one frame a line; folded away from the message.
  [[nodiscard]] const std::string& traceback() const;
  /// Set once a script called os.exit(code).
  [[nodiscard]] std::optional<int> exit_requested() const;
  /// Bytes in use, as the memory limit counts them.
  [[nodiscard]] std::size_t memory_used() const;

  struct Impl;  ///< for the files of this module only

 private:
  std::unique_ptr<Impl> impl_;
};

/// The text of a script's file.
[[nodiscard]] Result<std::string> script_text(const std::filesystem::path& file);

/// "Lua 5.4.4"
[[nodiscard]] std::string lua_version();

}  // namespace robomosp::lua
