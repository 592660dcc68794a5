// SPDX-License-Identifier: Apache-2.0
// Plugins that may end the program: files from elsewhere are opened in a process of their own
// before they are opened here, and what ended a process while it was opened is remembered (layer:
// core).
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>

#include <robomosp/sdk/result.h>

namespace robomosp {

/// Remembers in a folder of the user's how opening each plugin went. One file is known by its path,
/// size and time, so that a new build is tried anew. [application thread]
///
/// A file that ends its trial, or the program itself while it is opened, is named and left out; at
/// the start after that it is tried once more; after the second time it stays out until it changes
/// or somebody asks for it by name.
class PluginTrials {
 public:
  /// `state`: where to remember; empty = nowhere.
  explicit PluginTrials(std::filesystem::path state, double seconds = 10);
  ~PluginTrials();
  PluginTrials(const PluginTrials&) = delete;
  PluginTrials& operator=(const PluginTrials&) = delete;
  /// $XDG_STATE_HOME/robomosp/plugins or ~/.local/state/robomosp/plugins; empty = there is no home.
  [[nodiscard]] static std::filesystem::path state_folder();

  /// Whether a file may be opened in this process: from what is remembered, else, where it is not
  /// `trusted` or has failed before, by trying it in another. `is_asked`: somebody named the file;
  /// it is tried however often it failed.
  [[nodiscard]] Result<void> admit(const std::filesystem::path& file, bool trusted, bool is_asked);

  /// Marks that a file is being opened in this process, as long as it lives. Whatever ends the
  /// process meanwhile, the next start knows the file; an exit() of the plugin's becomes exit code
  /// 3 with a sentence.
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
    bool passed = false;    ///< its trial went well
    bool sits_out = false;  ///< the program itself died: the next start leaves it out untried
    std::string how;        ///< it failed
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
