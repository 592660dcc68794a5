// SPDX-License-Identifier: Apache-2.0
// Plugins that may end the program: files not shipped with it are first opened in a separate
// process, and a file that ended a process while being opened is recorded (layer: core).
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>

#include <robomosp/sdk/result.h>

namespace robomosp {

/// Records, in a folder of the user's, the result of opening each plugin. A file is identified by
/// its path, size and time, so that a new build is tried again. [application thread]
///
/// A file that ends its trial, or the program itself while it is opened, is reported and skipped;
/// at the start after that it is tried once more. After the second failure it is skipped until it
/// changes or the user loads it by name.
class PluginTrials {
 public:
  /// `state`: folder of the records; empty = none are kept.
  explicit PluginTrials(std::filesystem::path state, double seconds = 10);
  ~PluginTrials();
  PluginTrials(const PluginTrials&) = delete;
  PluginTrials& operator=(const PluginTrials&) = delete;
  /// $XDG_STATE_HOME/robomosp/plugins or ~/.local/state/robomosp/plugins; empty if there is no home
  /// folder.
  [[nodiscard]] static std::filesystem::path state_folder();

  /// Decides whether a file may be opened in this process: by its record, or by a trial in another
  /// process if it is not `trusted` or has failed before. `is_asked`: the user named the file, so
  /// it is tried however often it has failed.
  [[nodiscard]] Result<void> admit(const std::filesystem::path& file, bool trusted, bool is_asked);

  /// During its lifetime, marks that a file is being opened in this process. If the process ends
  /// meanwhile, the next start knows which file was to blame; an exit() called by the plugin
  /// becomes exit code 3 with an error message.
  class Opening {
   public:
    Opening(PluginTrials& trials, const std::filesystem::path& file);
    ~Opening();
    Opening(const Opening&) = delete;
    Opening& operator=(const Opening&) = delete;

   private:
    PluginTrials& trials_;
  };

 private:
  struct Record {
    int failures = 0;
    bool passed = false;    ///< its trial succeeded
    bool sits_out = false;  ///< the program itself died: the next start skips it without a trial
    std::string how;        ///< how it failed
  };
  [[nodiscard]] static std::string key_of(const std::filesystem::path& file);
  [[nodiscard]] Result<void> try_out(const std::filesystem::path& file) const;
  void read();
  void find_deaths();
  void write() const;

  std::filesystem::path state_;
  double seconds_;
  std::map<std::string, Record> records_;  ///< by size, time and path
  std::filesystem::path marker_;
  int marker_file_ = -1;
};

}  // namespace robomosp
