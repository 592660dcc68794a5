// SPDX-License-Identifier: Apache-2.0
#include "io/native.h"

#include <cerrno>
#include <chrono>
#include <optional>
#include <set>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include "io/write_all.h"
#include "kernel/file_root.h"
#include "kernel/permit.h"
#include "kernel/text.h"

namespace robomosp::io {

namespace {

namespace fs = std::filesystem;
using text::quote;

std::string reason(int number) { return std::generic_category().message(number); }

using Descriptor = FileDescriptor;

/// Where a file is written that is asked for by a link to it, which need not be there.
Result<fs::path> behind_links(fs::path file) {
  constexpr int kMostLinks = 40;  // as the system counts
  const std::string shown = quote(file.generic_string());
  std::error_code ec;
  for (int i = 0; fs::is_symlink(file, ec); ++i) {
    const fs::path target = i < kMostLinks ? fs::read_symlink(file, ec) : fs::path();
    if (target.empty())
      return error(ErrorCode::io, "cannot write " + shown + ": its links are broken",
                   "Remove the link or choose another name.");
    file = target.is_absolute() ? target : file.parent_path() / target;
  }
  return file;
}

/// The same, within the session's folder if it has one.
Result<FilePlace> place_of(const fs::path& wanted) {
  if (current_file_root()) return place_to_write(wanted);
  RMP_TRY_ASSIGN(const fs::path file, behind_links(wanted));
  return place_to_write(file);
}

/// A temporary file this old was left behind by a save that was killed.
constexpr auto kLeftBehind = std::chrono::hours(1);

void remove_left_behind(int folder, const std::string& name) {
  struct stat there {};
  if (::fstatat(folder, name.c_str(), &there, AT_SYMLINK_NOFOLLOW) != 0 || !S_ISREG(there.st_mode))
    return;
  if (std::chrono::system_clock::now() -
          std::chrono::system_clock::from_time_t(there.st_mtim.tv_sec) >
      kLeftBehind)
    ::unlinkat(folder, name.c_str(), 0);
}

/// A file that is written beside the one whose place it takes; removed unless it did.
class Temporary {
 public:
  /// Nothing of it is certain to be on the disk yet.
  static Result<Temporary> write(const FilePlace& place, std::string_view bytes) {
    // open() gives a new file the permissions of the user's umask; an old one keeps its own.
    Temporary t(place);
    struct stat old {};
    // Of a confined session the place is no link, unless somebody made it one since.
    const int links = place.held ? AT_SYMLINK_NOFOLLOW : 0;
    const bool is_new = ::fstatat(place.folder, place.name.c_str(), &old, links) != 0 ||
                        (place.held && !S_ISREG(old.st_mode) && !S_ISDIR(old.st_mode));
    if (!is_new && S_ISDIR(old.st_mode))
      return error(ErrorCode::io, t.shown() + " is a folder, so it cannot be written as a file",
                   "Choose another name.");
    if (const int number = t.open_new(); number != 0) return t.refused(number);
    int failure = write_all(t.fd_.get(), bytes);
    if (!failure && !is_new && ::fchmod(t.fd_.get(), old.st_mode & 07777) != 0) failure = errno;
    if (failure) return t.refused(failure);
    // Begun here, so that many files need not be waited for one after the other.
    ::sync_file_range(t.fd_.get(), 0, 0, SYNC_FILE_RANGE_WRITE);
    return t;
  }
  Temporary(Temporary&& from) noexcept
      : place_(std::move(from.place_)),
        name_(std::exchange(from.name_, {})),
        fd_(std::move(from.fd_)) {}
  Temporary& operator=(Temporary&&) = delete;
  ~Temporary() {
    if (!name_.empty()) ::unlinkat(place_.folder, name_.c_str(), 0);
  }

  static fs::path folder_of(const fs::path& file) {
    return file.has_parent_path() ? file.parent_path() : fs::path(".");
  }
  /// It is on the disk behind it.
  Result<void> sync() {
    if (::fsync(fd_.get()) != 0) return refused(errno);
    if (fd_.close() != 0) return refused(errno);
    return {};
  }
  Result<void> take_place() {
    if (::renameat(place_.folder, name_.c_str(), place_.folder, place_.name.c_str()) != 0)
      return refused(errno);
    name_.clear();
    return {};
  }

 private:
  explicit Temporary(FilePlace place) : place_(std::move(place)) {}
  /// The first name that is free: others are of whoever writes the same file now, or were left
  /// behind, by a process of any number. Returns errno.
  int open_new() {
    // A name may have 255 bytes; the file's own need not leave room for more.
    const fs::path file = place_.name;
    const std::string own = "." + file.filename().string().substr(0, 200) + ".part";
    const std::string start = (folder_of(file) / own).string();
    for (unsigned k = 0;; ++k) {
      name_ = start + std::to_string(k);
      fd_ = Descriptor(
          ::openat(place_.folder, name_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666));
      if (fd_.get() >= 0) return 0;
      const int failure = errno;
      if (failure == EEXIST && k < kMostTries) {
        remove_left_behind(place_.folder, name_);
        continue;
      }
      name_.clear();
      return failure;
    }
  }
  static constexpr unsigned kMostTries = 100'000;
  [[nodiscard]] std::string shown() const { return quote(place_.path.generic_string()); }
  [[nodiscard]] Error refused(int number) const {
    return error(ErrorCode::io, "cannot write " + shown() + ": " + reason(number),
                 "Check the folder's permissions and free space.");
  }

  FilePlace place_;
  std::string name_;  ///< empty = there is none (any more)
  Descriptor fd_;
};

/// A folder that files are written in: its path, and for a confined session itself.
struct Folder {
  fs::path path;
  std::shared_ptr<const FileDescriptor> held;
  bool operator<(const Folder& other) const { return path < other.path; }
  [[nodiscard]] Descriptor open() const {
    constexpr int kFlags = O_RDONLY | O_DIRECTORY | O_CLOEXEC;
    return Descriptor(held ? ::openat(held->get(), ".", kFlags) : ::open(path.c_str(), kFlags));
  }
};

/// So that what was renamed in it survives a power cut.
void sync_folder(const Folder& folder) {
  const Descriptor directory = folder.open();
  if (directory.get() >= 0) ::fsync(directory.get());
}

/// Files that are open at once, until they are on the disk: a process may have some 1000.
constexpr std::size_t kTogether = 128;

}  // namespace

/// Keeps other programs from putting files into folders for as long as it lives, if they ask.
class FolderLocks {
 public:
  explicit FolderLocks(const std::set<Folder>& folders) {
    const auto until = std::chrono::steady_clock::now() + kPatience;
    for (const Folder& folder : folders) {  // in their order, so that nobody waits for ever
      Descriptor fd = folder.open();
      if (fd.get() < 0) continue;
      // A file system without locks, or a process that was stopped, is no reason not to save.
      while (::flock(fd.get(), LOCK_EX | LOCK_NB) != 0 &&
             (errno == EWOULDBLOCK || errno == EINTR) && std::chrono::steady_clock::now() < until)
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
      if (locked_.size() < kTogether) locked_.push_back(std::move(fd));
    }
  }

 private:
  static constexpr auto kPatience = std::chrono::seconds(2);
  std::vector<Descriptor> locked_;
};

struct FileBatch::Work {
  struct Wish {
    FilePlace file;
    FileBefore before;
    Fingerprint bytes;  ///< of the new ones
  };
  std::set<Folder> folders;
  std::vector<Temporary> files;
  std::vector<Wish> wishes;  ///< about files that are there
  std::vector<fs::path> replaced;
  std::size_t synced = 0;  ///< files from the first on that are on the disk

  /// The file system commits what it knows of all of them with the first, so that the others wait
  /// for little.
  Result<void> sync() {
    for (; synced < files.size(); ++synced) RMP_TRY(files[synced].sync());
    return {};
  }
};

namespace {

/// Of what a file holds; nullopt when there is none that can be read.
std::optional<Fingerprint> fingerprint_of(const FilePlace& file) {
  const OwnWorkScope own;  // nothing of the file is shown to anybody
  const auto there = read_file(file.path);
  if (!there.ok()) return std::nullopt;
  return file_fingerprint(*there);
}

}  // namespace

Fingerprint file_fingerprint(std::string_view bytes) {
  return Fingerprinter("file/1").add(bytes).finish();
}

FileBatch::FileBatch() : work_(std::make_unique<Work>()) {}
FileBatch::~FileBatch() = default;

Result<void> FileBatch::add(const fs::path& wanted, std::string_view bytes,
                            const FileBefore& before) {
  RMP_TRY(require(Effect::files_write));
  Work& w = *work_;
  RMP_TRY_ASSIGN(const FilePlace place, place_of(wanted));
  const fs::path& file = place.path;
  const fs::path folder = Temporary::folder_of(file);
  std::error_code ec;
  if (!place.held && !w.folders.contains({folder, nullptr}) && !fs::is_directory(folder, ec))
    return error(ErrorCode::not_found,
                 "there is no folder " + quote(folder.generic_string()) + " to save " +
                     quote(file.filename().generic_string()) + " in",
                 "Create the folder first or choose another one.");
  w.folders.insert({folder, place.held});
  RMP_TRY_ASSIGN(Temporary written, Temporary::write(place, bytes));
  w.files.push_back(std::move(written));
  if (before.is_asked && file_kind(file) != FileKind::none)
    w.wishes.push_back({place, before, file_fingerprint(bytes)});
  if (w.files.size() - w.synced >= kTogether) RMP_TRY(w.sync());
  return {};
}

Result<void> FileBatch::finish() {
  RMP_TRY(require(Effect::files_write));
  Work& w = *work_;
  RMP_TRY(w.sync());
  const FolderLocks alone(w.folders);
  std::vector<fs::path> replaced;
  for (const Work::Wish& wish : w.wishes) {
    const auto there = fingerprint_of(wish.file);
    if (!there || *there == wish.bytes || there == wish.before.seen) continue;
    if (wish.before.seen)
      return error(ErrorCode::conflict,
                   "the file " + quote(wish.file.path.generic_string()) +
                       " was changed by another program since it was read or saved here, so it "
                       "was not written",
                   "Load it with reload = true to use its content, save to another file, or give "
                   "overwrite = true.");
    replaced.push_back(wish.file.path);
  }
  for (Temporary& each : w.files) RMP_TRY(each.take_place());
  for (const Folder& folder : w.folders) sync_folder(folder);
  w = Work();
  w.replaced = std::move(replaced);
  return {};
}

const std::vector<fs::path>& FileBatch::replaced() const { return work_->replaced; }

Result<void> write_file(const fs::path& file, std::string_view bytes) {
  FileBatch batch;
  RMP_TRY(batch.add(file, bytes));
  return batch.finish();
}

bool file_holds(const fs::path& file, std::string_view bytes) {
  const OwnWorkScope own;  // nothing of the file is shown to anybody
  const auto there = read_file(file, bytes.size());
  return there.ok() && *there == bytes;
}

Result<std::string> read_file(const fs::path& file, std::size_t limit) {
  RMP_TRY(require(Effect::files_read));
  if (current_file_root()) return read_permitted(file, limit);
  const std::string shown = quote(file.generic_string());
  std::error_code ec;
  const auto status = fs::status(file, ec);
  if (status.type() == fs::file_type::not_found)
    return error(ErrorCode::not_found, "there is no file " + shown, "Check the path.");
  if (fs::is_directory(status)) return error(ErrorCode::io, shown + " is a folder, not a file");
  if (fs::exists(status) && !fs::is_regular_file(status))
    return error(ErrorCode::io, shown + " is not a regular file");
  const Descriptor fd(::open(file.c_str(), O_RDONLY | O_CLOEXEC));
  if (fd.get() < 0) return error(ErrorCode::io, "cannot read " + shown + ": " + reason(errno));
  std::string bytes;
  char buffer[1 << 16];
  for (;;) {
    const ssize_t n = ::read(fd.get(), buffer, sizeof buffer);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return error(ErrorCode::io, "cannot read " + shown + ": " + reason(errno));
    if (n == 0) return bytes;
    bytes.append(buffer, static_cast<std::size_t>(n));
    if (bytes.size() > limit)
      return error(ErrorCode::io, shown + " is larger than " + std::to_string(limit) +
                                      " bytes, the maximum file size");
  }
}

}  // namespace robomosp::io
