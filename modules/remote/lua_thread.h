// SPDX-License-Identifier: Apache-2.0
// LuaThread: runs the scripts of a connection on a separate thread, since its requests arrive on
// any: in the program if permitted, else in a locked process (layer: application, remote).
#pragma once

#include <condition_variable>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "ioci/core/application.h"

namespace robomosp::remote {

/// The thread starts with the first eval() and ends with this object. [one thread at a time]
class LuaThread {
 public:
  /// `is_trusted`: scripts run in this program.
  LuaThread(ioci::Application& app, ioci::Session& session, bool is_trusted)
      : app_(app), session_(session), is_trusted_(is_trusted) {}
  ~LuaThread();
  LuaThread(const LuaThread&) = delete;
  LuaThread& operator=(const LuaThread&) = delete;
  /// Returns {value or values, output}, from a process also a note; waits for the end.
  Result<Map> eval(const std::string& code);

 private:
  void work();
  void work_in_program();
  void work_in_process();
  /// The next text; nullopt if there are calls to serve, or at the end.
  std::optional<std::string> next();
  void done(Result<Map> result);
  ioci::Application& app_;
  ioci::Session& session_;
  const bool is_trusted_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::optional<std::string> code_;    // guarded by mutex_
  std::optional<Result<Map>> result_;  // guarded by mutex_
  bool is_called_ = false;             ///< a solver given by the script was called; guarded by
                                       ///< mutex_
  bool is_ending_ = false;             // guarded by mutex_
  std::thread thread_;
};

}  // namespace robomosp::remote
