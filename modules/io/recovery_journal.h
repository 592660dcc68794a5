// SPDX-License-Identifier: Apache-2.0
// Recovery: a journal of the document that survives any end of the process, and the search for
// journals of earlier processes (layer: application). Format: docs/user/files.md.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include <robomosp/sdk/result.h>

#include "document/document.h"

namespace robomosp::io {

/// Folder of journals: $XDG_STATE_HOME/robomosp/recovery, or below ~/.local/state; empty if there
/// is no home folder.
[[nodiscard]] std::filesystem::path recovery_folder();

struct JournalOptions {
  std::filesystem::path folder{};  ///< created with the first entry
  /// Approximate time from an edit to its entry on disk; the least interval between entries.
  std::chrono::milliseconds interval{1000};
  std::string program = "robomosp";  ///< name of the writer, shown to users
  /// Called once if the journal cannot be written, on its thread; may be empty.
  std::function<void(const std::string&)> trouble{};
};

/// Writes the changes of the document to a file in the background: a separate thread reads
/// snapshots, which needs no lock. Each entry is complete or absent. The file is locked while the
/// process lives, and removed when it exits normally.
class RecoveryJournal {
 public:
  /// The document must outlive it. Nothing is written, and no thread runs, before changed().
  RecoveryJournal(const document::Document& document, JournalOptions options);
  ~RecoveryJournal();
  RecoveryJournal(const RecoveryJournal&) = delete;
  RecoveryJournal& operator=(const RecoveryJournal&) = delete;
  /// Reports a new unsaved change. Does not wait. [any thread]
  void changed();
  /// Writes the document in its current state and keeps the file for the next start of the program;
  /// nothing is written after that. Returns the file. [the thread that ends it]
  Result<std::filesystem::path> keep();
  /// The file; empty before the first entry. [any thread]
  [[nodiscard]] std::filesystem::path file() const;

 private:
  class File;
  void run();
  void end_thread();
  Result<void> write(const document::Snapshot& now, bool whole);
  const document::Document& document_;
  const JournalOptions options_;
  mutable std::mutex mutex_;
  std::condition_variable wake_;
  bool is_changed_ = false, is_ending_ = false;  // guarded by mutex_
  bool is_kept_ = false;                         ///< of the thread that ends it
  std::filesystem::path path_;                   // guarded by mutex_
  std::thread thread_;                           // guarded by mutex_
  // Of the thread:
  std::unique_ptr<File> file_;
  std::unordered_map<AnyId, document::RecordPtr> written_;
  std::unordered_set<std::string> geometries_;  ///< names written to this file
  std::uint64_t whole_bytes_ = 0;               ///< of the last complete entry
};

/// The records that differ from their files, or have none, in order of creation.
[[nodiscard]] std::vector<AnyId> unsaved_records(const document::Snapshot&,
                                                 const std::vector<std::filesystem::path>& library);

/// True if an existing record differs from its file, or has none.
[[nodiscard]] bool is_unsaved(const document::Snapshot&, AnyId,
                              const std::vector<std::filesystem::path>& library);

/// A journal of a process that no longer exists.
struct FoundJournal {
  std::filesystem::path file;
  std::string program;
  std::string time;          ///< of its last entry, "2026-11-22 10:03:17 UTC"
  std::size_t records = 0;   ///< records that can be restored
  std::uintmax_t bytes = 0;  ///< of the file
  std::size_t unread = 0;    ///< bytes at its end that are not a complete entry, such as an
                             ///< interrupted write
};

/// Journals with records in a folder, oldest first; journals of living processes and other files
/// are left out.
[[nodiscard]] std::vector<FoundJournal> found_journals(const std::filesystem::path& folder);

/// Locks a journal of a dead process, so that no other process offers it, until discarded or
/// destroyed.
class ClaimedJournal {
 public:
  /// Refused while its process lives or another one has locked it.
  static Result<ClaimedJournal> claim(const std::filesystem::path& file);
  ClaimedJournal(ClaimedJournal&&) noexcept;
  ClaimedJournal& operator=(ClaimedJournal&&) noexcept;
  ~ClaimedJournal();
  /// Loads its records into the transaction. A record with a name in use gets a free name;
  /// unreadable records are left out and listed in `notes`.
  Result<std::vector<AnyId>> restore(document::Transaction&,
                                     const std::vector<std::filesystem::path>& library,
                                     std::vector<std::string>& notes) const;
  /// Number of its records that differ from their files, or have none.
  [[nodiscard]] Result<std::size_t> unsaved(
      const std::vector<std::filesystem::path>& library) const;
  [[nodiscard]] const std::filesystem::path& file() const { return file_; }
  void discard();  ///< removes the file

 private:
  ClaimedJournal() = default;
  std::filesystem::path file_;
  int descriptor_ = -1;
};

}  // namespace robomosp::io
