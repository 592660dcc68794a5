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

/// Stores each value in a separate file with a checksum; its name is derived from the kind, the key
/// and the build that wrote it. Damaged and foreign files are removed with a note and count as
/// missing; if the folder cannot be used, every value counts as missing. A file is written under
/// another name and renamed, so that several programs can share the folder. [any thread]
class FileCache {
 public:
  struct Options {
    std::filesystem::path folder;
    std::uint64_t limit = std::uint64_t{512} << 20;  ///< of all files [bytes]
    /// Identifies the program and all else that affects computed values; files of other builds are
    /// ignored.
    Fingerprint build = fingerprint_of_program();
    /// Called with one sentence for each problem, on the thread that found it, one call at a time.
    /// It must not call the cache.
    std::function<void(const std::string&)> note = {};
  };
  explicit FileCache(Options options);

  /// The stored bytes, if any. `kind` is a word of letters, digits and '_'.
  [[nodiscard]] std::optional<std::string> read(std::string_view kind, const Fingerprint& key);
  /// Stores `bytes`, and removes the least recently used files if the limit is exceeded. Does not
  /// store a value larger than a quarter of the limit.
  void write(std::string_view kind, const Fingerprint& key, std::string_view bytes);
  /// Discards a value that read() returned but that cannot be decoded, as if it were damaged.
  void refuse(std::string_view kind, const Fingerprint& key);

  struct State {
    std::uint64_t files = 0, bytes = 0;                            ///< in the folder, of any build
    std::uint64_t hits = 0, misses = 0, refused = 0, written = 0;  ///< by this object
  };
  [[nodiscard]] State state() const;
  /// Removes all stored values, of any build, and nothing else; returns the number of files.
  std::uint64_t clear();
  [[nodiscard]] const std::filesystem::path& folder() const { return options_.folder; }
  [[nodiscard]] std::uint64_t limit() const { return options_.limit; }

  /// Path of the file of a value, existing or not.
  [[nodiscard]] std::filesystem::path file_of(std::string_view kind, const Fingerprint& key) const;
  /// Computed from the executable's size, time and version.
  static Fingerprint fingerprint_of_program();
  /// ROBOMOSP_CACHE if it names a folder, else $XDG_CACHE_HOME/robomosp/geometry or
  /// ~/.cache/robomosp/geometry; empty if it is "off" or there is no home folder.
  static std::filesystem::path user_folder();
  /// ROBOMOSP_CACHE_MIB [MiB] converted to bytes, else the default of Options [bytes].
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
  std::optional<std::uint64_t> bytes_;  ///< total size of the folder, approximate; guarded by
                                        ///< mutex_
  std::uint64_t since_look_ = 0;  ///< files written since they were counted; guarded by mutex_
};

}  // namespace robomosp
