// SPDX-License-Identifier: Apache-2.0
// The target of an editor's debugger: a live run of programs, in this program or on a server
// (layer: application, remote).
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

/// Options for starting a run.
struct RunSettings {
  std::string world;                  ///< its name; "" = the one with programs
  std::vector<std::string> programs;  ///< of the world; empty = all, with its tasks
  std::string unbound;                ///< "error" or "free"; "" = default
  std::optional<double> sample_time, most_time, duration;  ///< [s]
  std::string entry = "wait";  ///< how programs begin, as in world.start_run
};
struct LaunchSettings {
  RunSettings run;
  std::filesystem::path program;       ///< source of a program, script, or file of a record
  std::string robot;                   ///< robot of a program without a world: name or .rbt file
  std::vector<std::string> arguments;  ///< of a script
  std::vector<std::filesystem::path> files;  ///< loaded first
};
struct AttachSettings {
  RunSettings run;
  ClientOptions client;
  std::string
      which;  ///< title or number of a live run; "" = a new one of the world, or the only one
};

/// Uses commands only, so that both variants work alike. [the session's thread]
class Debuggee {
 public:
  /// Loads the launched program and starts its run, paused at its beginning.
  static Result<std::unique_ptr<Debuggee>> launch(ioci::Application&, ioci::Session&,
                                                  lua::LuaState&, LaunchSettings);
  /// `cancel` ends waiting for the other program.
  static Result<std::unique_ptr<Debuggee>> attach(AttachSettings, const std::atomic<bool>& cancel);

  /// Calls a command without a run argument, in the program that has the run.
  Result<Value> ask(std::string_view command, const Map& args);
  /// Calls a command of the run.
  Result<Value> ask_run(std::string_view command, Map args = {});
  /// Restarts: a launched program is loaded again, the run of another program is reset.
  Result<void> restart(const std::string& entry);
  /// Removes everything it has created. `goes_on` = an attached run continues to play as before.
  void leave(bool goes_on);

  [[nodiscard]] bool is_attached() const { return client_ != nullptr; }
  /// Started by another client: it is neither started nor ended by this one.
  [[nodiscard]] bool is_foreign() const { return is_foreign_; }
  [[nodiscard]] bool was_playing() const { return was_playing_; }
  /// Folder in which files of its programs are searched; empty = unknown.
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
