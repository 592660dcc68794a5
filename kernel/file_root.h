// SPDX-License-Identifier: Apache-2.0
// FileRoot: the folder that confines a session's files, and the functions that check, open, create
// and remove every file named by a user or by another file (layer: core). Their guarantees:
// docs/security.md. Without a folder these functions act like those of the file system.
#pragma once

#include <sys/types.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <robomosp/sdk/result.h>

#include "kernel/effects.h"

namespace robomosp {

/// Owns a file descriptor and closes it; -1 = none.
class FileDescriptor {
 public:
  explicit FileDescriptor(int fd = -1) noexcept : fd_(fd) {}
  ~FileDescriptor() { (void)close(); }
  FileDescriptor(FileDescriptor&& from) noexcept : fd_(std::exchange(from.fd_, -1)) {}
  FileDescriptor& operator=(FileDescriptor&& from) noexcept {
    std::swap(fd_, from.fd_);
    return *this;
  }
  [[nodiscard]] int get() const { return fd_; }
  [[nodiscard]] bool is_open() const { return fd_ >= 0; }
  /// Return value of the system's close(); 0 if there is no descriptor.
  int close() noexcept;

 private:
  int fd_;
};

/// An open folder, and further folders that may only be read: those shipped with the program.
/// Copies share it. Immutable. [any thread]
class FileRoot {
 public:
  /// Relative names are relative to the current folder of the program. Folders of `readable` may be
  /// read as well; missing ones are left out. ErrorCode::not_found, ErrorCode::io.
  static Result<FileRoot> open(const std::filesystem::path& folder,
                               const std::vector<std::filesystem::path>& readable = {});
  /// Absolute, links resolved.
  [[nodiscard]] const std::filesystem::path& folder() const;
  /// Absolute; each as given, and with links resolved.
  [[nodiscard]] const std::vector<std::filesystem::path>& readable() const;
  /// A text as shown to the session: file names in the folder become relative to it.
  [[nodiscard]] std::string shown(std::string text) const;
  /// The same for a text that is a single name.
  [[nodiscard]] std::string shown_name(std::string_view name) const;

  struct Held;
  [[nodiscard]] const Held& held() const { return *held_; }

 private:
  explicit FileRoot(std::shared_ptr<const Held> held) : held_(std::move(held)) {}
  std::shared_ptr<const Held> held_;
};

/// The folder of this thread's permit; null = files are not confined. Valid as long as the permit
/// is.
[[nodiscard]] const FileRoot* current_file_root() noexcept;

/// Path of a file that may be used: without a folder the path itself, else an absolute one with
/// links resolved. The file need not exist. `effect`: files_read or files_write; readable folders
/// reject the latter. The result is only a name: another process may replace the file before it is
/// opened, so open it with the functions below. ErrorCode::permission outside the folder; not_found
/// if a folder along the path is missing and its name is followed by "..".
[[nodiscard]] Result<std::filesystem::path> permitted_path(const std::filesystem::path&,
                                                           Effect effect);

/// The same, but links stay as they are named; for the values of arguments. Without ".." and, in a
/// confined session, absolute.
[[nodiscard]] Result<std::filesystem::path> permitted_name(const std::filesystem::path&);

/// Kind of a file, links followed. `none` for a file that may not be read, existing or not.
enum class FileKind : std::uint8_t { none, file, folder, other };
[[nodiscard]] FileKind file_kind(const std::filesystem::path&);

/// Opens a file for reading. In a confined session it opens only regular files, checked on the
/// descriptor rather than by name, and never blocks; otherwise as the system does.
[[nodiscard]] Result<FileDescriptor> open_to_read(const std::filesystem::path&);
/// The same with flags of open(2) (O_RDWR, O_CREAT, O_TRUNC, O_APPEND); new files get the
/// permissions of the umask.
[[nodiscard]] Result<FileDescriptor> open_to_write(const std::filesystem::path&, int flags);

/// Place where a file is created, replaced or removed: its folder, for the system's ...at()
/// functions, and its name in it. Links to files are followed. Without a root, `folder` is AT_FDCWD
/// and `name` is the path as given.
struct FilePlace {
  std::shared_ptr<const FileDescriptor> held;
  int folder = -100;           ///< AT_FDCWD
  std::string name;            ///< one component, in a confined session
  std::filesystem::path path;  ///< for messages and comparisons
};
[[nodiscard]] Result<FilePlace> place_to_write(const std::filesystem::path&);

/// Creates a folder and its parents; existing ones are no error.
Result<void> make_folders(const std::filesystem::path&);
/// Removes a file or an empty folder; of a link, the link itself. Returns false if nothing existed.
Result<bool> remove_file(const std::filesystem::path&);
/// Renames a file; an existing file at `to` is replaced.
Result<void> rename_file(const std::filesystem::path& from, const std::filesystem::path& to);

struct FolderEntry {
  std::string name;
  FileKind kind = FileKind::none;  ///< kind of a link's target; none if it may not be read
  std::uint64_t size = 0;          ///< of a file [bytes]
};
/// Sorted by name; ErrorCode::unsupported for more than `most` entries.
[[nodiscard]] Result<std::vector<FolderEntry>> list_folder(const std::filesystem::path&,
                                                           std::size_t most);

/// The content of a file; an error if it has more than `most` bytes.
[[nodiscard]] Result<std::string> read_permitted(const std::filesystem::path&, std::uint64_t most);

/// A part of a file.
struct FilePart {
  std::string bytes;
  std::uint64_t size = 0;  ///< of the whole file [bytes]
};
/// At most `length` bytes from `offset` on; none beyond the end. Regular files only, checked on the
/// open descriptor.
[[nodiscard]] Result<FilePart> read_part(const std::filesystem::path&, std::uint64_t offset,
                                         std::size_t length);
/// Appends bytes to a file, which is created if missing; returns its new size.
Result<std::uint64_t> append_to(const std::filesystem::path&, std::string_view bytes);

}  // namespace robomosp
