// SPDX-License-Identifier: Apache-2.0
// The native text files: one grammar for all records, exact positions in errors, byte-equal
// rewriting, atomic saving (layer: application). Grammar: docs/user/files.md.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <robomosp/sdk/result.h>

#include "document/document.h"
#include "io/geometry.h"
#include "kernel/fingerprint.h"

namespace robomosp::io {

/// Files loaded into a transaction: the requested record and all records it refers to.
struct Loaded {
  AnyId id;                ///< the record of the file itself
  std::vector<AnyId> all;  ///< in dependency order, the main one last; also those reused
  std::vector<std::string> notes;
  std::vector<std::string> warnings;  ///< deviations the caller may not expect
};

/// What load() does with a file if its record is in the document already.
enum class Reload : std::uint8_t {
  no,       ///< uses the record; a warning reports a file changed on disk
  changed,  ///< reads it again if it changed on disk
  yes       ///< reads the requested file again in any case, and those it refers to if changed
};

/// ".rbt" etc. of a kind, as it is registered (model/kinds.cpp).
[[nodiscard]] std::string_view extension(Kind);

/// Reads a file and all it refers to into the transaction. References are paths relative to the
/// referring file, else inside a `library` folder. A file that is already in the document (same
/// canonical path) is reused, not loaded again, except as `reload` requests: then the record gets
/// the content of the file, and records that refer to it are updated. A record with a name in use
/// gets a free name. Any fault is one Error with `where` = `file:line:column`, and nothing is
/// added. Files of the 2006 program are recognised by their content and read as well (io/legacy.h);
/// `wanted` selects the kind of the result.
Result<Loaded> load(document::Transaction&, const std::filesystem::path& file,
                    const std::vector<std::filesystem::path>& library,
                    std::optional<Kind> wanted = {}, Reload reload = Reload::no);

/// The same for a text instead of a file: `shown` names it in messages, references are relative to
/// `folder`. The record has no file.
Result<Loaded> load_text(document::Transaction&, std::string_view text, const std::string& shown,
                         const std::filesystem::path& folder,
                         const std::vector<std::filesystem::path>& library);

/// Files in memory only, such as the results of an importer; names are paths as written in
/// references.
struct MemoryFiles {
  std::map<std::string, std::string, std::less<>> texts;       ///< records
  std::map<std::string, GeometryPtr, std::less<>> geometries;  ///< made by make_geometry()
};
/// The same for the record `main` of files in memory. References are searched among them first,
/// then relative to `folder` as in load_text(). The records of `files` have no file; messages name
/// them as `shown/<name>`.
Result<Loaded> load_memory(document::Transaction&, const MemoryFiles& files,
                           const std::string& main, const std::string& shown,
                           const std::filesystem::path& folder,
                           const std::vector<std::filesystem::path>& library);

/// The same for several records of files in memory, which may refer to each other; one result each.
/// Records added for one remain when another fails.
std::vector<Result<Loaded>> load_memory(document::Transaction&, const MemoryFiles& files,
                                        const std::vector<std::string>& names,
                                        const std::string& shown,
                                        const std::filesystem::path& folder,
                                        const std::vector<std::filesystem::path>& library);

/// Text of one record as save() would write it to a file at `file` (references become paths
/// relative to it; those to records that were never saved, to where save() would put them).
Result<std::string> print(const document::Snapshot&, AnyId, const std::filesystem::path& file,
                          const std::vector<std::filesystem::path>& library);

/// How save() treats existing files.
struct SaveOptions {
  /// Replaces the record's file even if another program changed it since; otherwise that is an
  /// error with code conflict.
  bool overwrite = false;
  /// Receives the files with content that this document never read or wrote; may be null.
  std::vector<std::filesystem::path>* replaced = nullptr;
};

/// Saves the record; referred records that were never saved are saved beside it first, as
/// `<name><extension>`, and geometries before the solids they belong to (geometry_file_name). Sets
/// Record::file through the transaction. Atomic per file: temporary file, fsync, rename; of a link
/// the file that it leads to is replaced.
Result<std::vector<std::filesystem::path>> save(document::Transaction&, AnyId,
                                                const std::filesystem::path& file,
                                                const std::vector<std::filesystem::path>& library,
                                                const SaveOptions& = {});

/// Saves several records, each once: to its file, or beside one that refers to it.
Result<std::vector<std::filesystem::path>> save_all(
    document::Transaction&, const std::vector<std::pair<AnyId, std::filesystem::path>>& wanted,
    const std::vector<std::filesystem::path>& library, const SaveOptions& = {});

/// Of the bytes of a file: Record::disk.
[[nodiscard]] Fingerprint file_fingerprint(std::string_view bytes);

/// Writes bytes atomically: temporary file in the same folder, fsync, rename. Needs the permit of
/// Effect::files_write.
Result<void> write_file(const std::filesystem::path&, std::string_view bytes);
/// What FileBatch checks before it replaces a file.
struct FileBefore {
  bool is_asked = false;  ///< false: replaces any existing file silently
  /// The content last seen; if the file has neither this nor the new content, finish() fails. If
  /// empty, such a file is replaced and listed in replaced().
  std::optional<Fingerprint> seen{};
};
/// Writes many files, each as atomically as write_file(): a crash at any moment leaves the old or
/// the new version of every file. Temporary files are written beside them at once; finish() flushes
/// all to disk and then renames each. Without finish(), nothing changes. If one file cannot be
/// written, none is, unless the final rename fails. Needs the permit of Effect::files_write. [one
/// thread]
class FileBatch {
 public:
  FileBatch();
  ~FileBatch();
  FileBatch(const FileBatch&) = delete;
  FileBatch& operator=(const FileBatch&) = delete;
  Result<void> add(const std::filesystem::path&, std::string_view bytes, const FileBefore& = {});
  /// Concurrent calls by several programs in one folder wait for each other.
  Result<void> finish();
  [[nodiscard]] const std::vector<std::filesystem::path>& replaced() const;

 private:
  struct Work;
  std::unique_ptr<Work> work_;
};
/// Whether a file is there and holds exactly these bytes.
[[nodiscard]] bool file_holds(const std::filesystem::path&, std::string_view bytes);
/// Reads a whole file of at most `limit` bytes. Needs the permit of Effect::files_read.
Result<std::string> read_file(const std::filesystem::path&,
                              std::size_t limit = std::size_t{64} << 20);

}  // namespace robomosp::io
