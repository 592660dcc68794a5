// SPDX-License-Identifier: Apache-2.0
// FileRoot: the folder that a session's files lie in, and the door through which every file that a
// user or a file names is looked at, opened, made and removed (layer: core). What the door promises
// and what not: docs/security.md. Without a folder the functions do what the file system does.
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

/// A file descriptor that is closed with it; -1 = none.
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
  /// What close() of the system answers; 0 when there is none.
  int close() noexcept;

 private:
  int fd_;
};

/// A folder that is held open, and folders beside it that may be read: those that come with the
/// program. Copies share it. [any thread; nothing changes]
class FileRoot {
 public:
  /// Relative names are taken from where the program stands. `readable` may be read as well; those
  /// that are not there are left out. ErrorCode::not_found, ErrorCode::io.
  static Result<FileRoot> open(const std::filesystem::path& folder,
                               const std::vector<std::filesystem::path>& readable = {});
  /// Absolute, without links.
  [[nodiscard]] const std::filesystem::path& folder() const;
  /// Absolute; each as it was given, and without links.
  [[nodiscard]] const std::vector<std::filesystem::path>& readable() const;
  /// A text for the session: the names of files in the folder as it gives them, relative to it.
  [[nodiscard]] std::string shown(std::string text) const;
  /// A text that is one name.
  [[nodiscard]] std::string shown_name(std::string_view name) const;

  struct Held;
  [[nodiscard]] const Held& held() const { return *held_; }

 private:
  explicit FileRoot(std::shared_ptr<const Held> held) : held_(std::move(held)) {}
  std::shared_ptr<const Held> held_;
};

/// The folder of this thread's permit; null = files are not confined. Valid as long as the permit.
[[nodiscard]] const FileRoot* current_file_root() noexcept;

/// Where a file stands that may be used: the path itself without a folder; else an absolute one
/// without links. Nothing need stand there. `effect`: files_read or files_write; what may be read
/// only is refused the latter. It is a name: between asking and opening others may put something
/// else there, so open through the functions below. ErrorCode::permission outside; not_found where
/// a folder on the way is missing and its name is followed by "..".
[[nodiscard]] Result<std::filesystem::path> permitted_path(const std::filesystem::path&,
                                                           Effect effect);

/// The same, but links stay as they are named: what arguments are made of. Without ".." and, in a
/// confined session, absolute.
[[nodiscard]] Result<std::filesystem::path> permitted_name(const std::filesystem::path&);

/// What stands at a path, links followed. What may not be read is `none`, there or not.
enum class FileKind : std::uint8_t { none, file, folder, other };
[[nodiscard]] FileKind file_kind(const std::filesystem::path&);

/// Opens what stands there for reading. In a confined session only files, by what the descriptor
/// is and not by what its name was, and without waiting; otherwise as the system does.
[[nodiscard]] Result<FileDescriptor> open_to_read(const std::filesystem::path&);
/// The same with flags of open(2) (O_RDWR, O_CREAT, O_TRUNC, O_APPEND); made with the permissions
/// of the umask.
[[nodiscard]] Result<FileDescriptor> open_to_write(const std::filesystem::path&, int flags);

/// Where a file is made, replaced or removed: its folder, for the functions ...at() of the system,
/// and its name in that. Links to files are followed. Without a root `folder` is AT_FDCWD and
/// `name` the path as given.
struct FilePlace {
  std::shared_ptr<const FileDescriptor> held;
  int folder = -100;           ///< AT_FDCWD
  std::string name;            ///< one component, in a confined session
  std::filesystem::path path;  ///< for messages and comparisons
};
[[nodiscard]] Result<FilePlace> place_to_write(const std::filesystem::path&);

/// Makes a folder and those above it; fine when it is there.
Result<void> make_folders(const std::filesystem::path&);
/// Removes a file or an empty folder; a link is removed itself. False = there was none.
Result<bool> remove_file(const std::filesystem::path&);
/// Renames; what stands at `to` is replaced.
Result<void> rename_file(const std::filesystem::path& from, const std::filesystem::path& to);

struct FolderEntry {
  std::string name;
  FileKind kind = FileKind::none;  ///< of what a link leads to; none where that may not be read
  std::uint64_t size = 0;          ///< of a file [bytes]
};
/// By name; ErrorCode::unsupported when there are more than `most`.
[[nodiscard]] Result<std::vector<FolderEntry>> list_folder(const std::filesystem::path&,
                                                           std::size_t most);

/// The bytes of a file; an error above `most`.
[[nodiscard]] Result<std::string> read_permitted(const std::filesystem::path&, std::uint64_t most);

/// A part of a file.
struct FilePart {
  std::string bytes;
  std::uint64_t size = 0;  ///< of the whole file [bytes]
};
/// At most `length` bytes from `offset` on; none behind the end. Only of files, by what is open.
[[nodiscard]] Result<FilePart> read_part(const std::filesystem::path&, std::uint64_t offset,
                                         std::size_t length);
/// Puts bytes behind those that the file has, which is made where it is not there; gives its size.
Result<std::uint64_t> append_to(const std::filesystem::path&, std::string_view bytes);

}  // namespace robomosp
