// SPDX-License-Identifier: Apache-2.0
// FileCache: computed bytes kept in files from one run to the next, by fingerprint (layer: core).
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>

#include "kernel/fingerprint.h"

namespace robomosp {

/// Each value is a file of its own, whose name comes from its kind, its key and the build that made
/// it, and which holds a checksum. What is damaged or not ours is removed with a note, and counts
/// as not there; so does everything when the folder cannot be used. A file is written under another
/// name and renamed, so that any number of programs may share the folder. [any thread]
class FileCache {
 public:
  struct Options {
    std::filesystem::path folder;
    std::uint64_t limit = std::uint64_t{512} << 20;  ///< of all files [bytes]
    /// Of the program and whatever else decides what is computed; others' files are not looked at.
    Fingerprint build = fingerprint_of_program();
    /// Told in a sentence what was not as it should be; on the thread that found it, one at a time.
    /// It does not call the cache.
    std::function<void(const std::string&)> note = {};
  };
  explicit FileCache(Options options);

  /// What was kept. `kind` is a word of letters, digits and '_'.
  [[nodiscard]] std::optional<std::string> read(std::string_view kind, const Fingerprint& key);
  /// Keeps `bytes`, and removes what was used longest ago where the limit is passed. What alone
  /// takes more than a quarter of the limit is not kept.
  void write(std::string_view kind, const Fingerprint& key, std::string_view bytes);
  /// Of bytes that read() gave and that make no sense: as if they had been damaged.
  void refuse(std::string_view kind, const Fingerprint& key);

  struct State {
    std::uint64_t files = 0, bytes = 0;                            ///< in the folder, of any build
    std::uint64_t hits = 0, misses = 0, refused = 0, written = 0;  ///< by this object
  };
  [[nodiscard]] State state() const;
  /// Removes all that is kept, of any build, and nothing else; gives the number of files.
  std::uint64_t clear();
  [[nodiscard]] const std::filesystem::path& folder() const { return options_.folder; }
  [[nodiscard]] std::uint64_t limit() const { return options_.limit; }

  /// The file of a value, whether it is there or not.
  [[nodiscard]] std::filesystem::path file_of(std::string_view kind, const Fingerprint& key) const;
  /// Of the executable's size, time and version.
  static Fingerprint fingerprint_of_program();
  /// ROBOMOSP_CACHE where it is a folder, else $XDG_CACHE_HOME/robomosp/geometry or
  /// ~/.cache/robomosp/geometry; empty where it is "off" or there is no home.
  static std::filesystem::path user_folder();
  /// ROBOMOSP_CACHE_MIB [MiB], else that of Options [bytes].
  static std::uint64_t user_limit();

 private:
  struct Found;
  void tell(const std::string& what);
  void drop(const std::filesystem::path& file, const std::string& why);
  void make_room(std::uint64_t added);
  template <class Visit>
  void each_file(Visit&& visit) const;

  Options options_;
  std::atomic<std::uint64_t> hits_{0}, misses_{0}, refused_{0}, written_{0}, part_{0};
  std::atomic<bool> is_usable_{true};
  std::mutex telling_;  ///< held while options_.note is called
  std::mutex mutex_;
  std::optional<std::uint64_t> bytes_;  ///< in the folder, about; guarded by mutex_
  std::uint64_t since_look_ = 0;  ///< files written since they were counted; guarded by mutex_
};

}  // namespace robomosp
