// SPDX-License-Identifier: Apache-2.0
// What a debugger of an editor works on: a live run of programs, in this program or in another one
// that serves (layer: application, remote).
#pragma once

#include <atomic>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "ioci/core/application.h"
#include "lua/lua_state.h"
#include "remote/client.h"

namespace robomosp::remote {

/// How a run is made.
struct RunSettings {
  std::string world;                  ///< its name; "" = the one that has programs
  std::vector<std::string> programs;  ///< of the world; empty = all, with its tasks
  std::string unbound;                ///< "error" or "free"; "" = as fits
  std::optional<double> sample_time, most_time, duration;  ///< [s]
  std::string entry = "wait";  ///< how programs begin, as world.start_run has it
};
struct LaunchSettings {
  RunSettings run;
  std::filesystem::path program;  ///< source of a program, script, or file of a record
  std::string robot;              ///< that a program moves which has no world: name or .rbt file
  std::vector<std::string> arguments;        ///< of a script
  std::vector<std::filesystem::path> files;  ///< that are loaded first
};
struct AttachSettings {
  RunSettings run;
  ClientOptions client;
  std::string
      which;  ///< title or number of a live run; "" = a new one of the world, or the only one
};

/// All goes through commands, so that both kinds do the same. [the session's thread]
class Debuggee {
 public:
  /// Loads what is launched into this program and starts its run, which stands at its begin.
  static Result<std::unique_ptr<Debuggee>> launch(ioci::Application&, ioci::Session&,
                                                  lua::LuaState&, LaunchSettings);
  /// `cancel` ends what waits for the other program.
  static Result<std::unique_ptr<Debuggee>> attach(AttachSettings, const std::atomic<bool>& cancel);

  /// A command that is given no run: of the program in which that is.
  Result<Value> ask(std::string_view command, const Map& args);
  /// A command of the run.
  Result<Value> ask_run(std::string_view command, Map args = {});
  /// From the start: what was launched is loaded anew, the run of another program is reset.
  Result<void> restart(const std::string& entry);
  /// Takes away what this has made. `goes_on` = an attached run plays as it did before.
  void leave(bool goes_on);

  [[nodiscard]] bool is_attached() const { return client_ != nullptr; }
  /// Made by another one than this: it is not begun, and not ended with this.
  [[nodiscard]] bool is_foreign() const { return is_foreign_; }
  [[nodiscard]] bool was_playing() const { return was_playing_; }
  /// Where files of its programs may lie; empty = nobody knows.
  [[nodiscard]] std::filesystem::path folder() const;
  [[nodiscard]] const std::string& title() const { return title_; }

 private:
  Debuggee() = default;
  Result<void> load();
  Result<Value> load_file();
  Result<Value> world_for(const Value& program, bool is_record);
  Result<Value> world_with_programs(const Value& loaded);
  Result<void> start_run(const Value& world, const RunSettings&);
  Result<void> find_run(const AttachSettings&);

  ioci::Application* app_ = nullptr;
  ioci::Session* session_ = nullptr;
  lua::LuaState* lua_ = nullptr;
  LaunchSettings launched_;
  std::unique_ptr<Client> client_;
  const std::atomic<bool>* cancel_ = nullptr;
  Value run_;
  std::string title_;
  bool is_foreign_ = false, was_playing_ = false;
};

}  // namespace robomosp::remote
