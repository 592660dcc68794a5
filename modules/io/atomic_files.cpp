// SPDX-License-Identifier: Apache-2.0
#include "io/native.h"

#include <atomic>
#include <cerrno>
#include <set>
#include <system_error>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "kernel/permit.h"
#include "kernel/text.h"

namespace robomosp::io {

namespace {

namespace fs = std::filesystem;
using text::quote;

std::string reason(int number) { return std::generic_category().message(number); }

/// Closes a descriptor at the end of a block.
class Descriptor {
 public:
  explicit Descriptor(int fd = -1) : fd_(fd) {}
  ~Descriptor() {
    if (fd_ >= 0) ::close(fd_);
  }
  Descriptor(Descriptor&& from) noexcept : fd_(std::exchange(from.fd_, -1)) {}
  Descriptor& operator=(Descriptor&& from) noexcept {
    std::swap(fd_, from.fd_);
    return *this;
  }
  [[nodiscard]] int get() const { return fd_; }
  [[nodiscard]] int close() { return ::close(std::exchange(fd_, -1)); }

 private:
  int fd_;
};

int write_all(int fd, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t n = ::write(fd, bytes.data(), bytes.size());
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return errno;
    bytes.remove_prefix(static_cast<std::size_t>(n));
  }
  return 0;
}

/// A file that is written beside the one whose place it takes; removed unless it did.
class Temporary {
 public:
  /// Nothing of it is certain to be on the disk yet.
  static Result<Temporary> write(const fs::path& file, std::string_view bytes) {
    // open() gives a new file the permissions of the user's umask; an old one keeps its own.
    static std::atomic<unsigned> counter{0};
    Temporary t(file);
    t.name_ = (folder_of(file) / ("." + file.filename().string() + "." +
                                  std::to_string(::getpid()) + "." + std::to_string(counter++)))
                  .string();
    struct stat old {};
    const bool is_new = ::stat(file.c_str(), &old) != 0;
    if (!is_new && S_ISDIR(old.st_mode))
      return error(ErrorCode::io, t.shown() + " is a folder, so it cannot be written as a file",
                   "Choose another name.");
    t.fd_ = Descriptor(::open(t.name_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666));
    if (t.fd_.get() < 0) {
      const int failure = errno;
      t.name_.clear();
      return t.refused(failure);
    }
    int failure = write_all(t.fd_.get(), bytes);
    if (!failure && !is_new && ::fchmod(t.fd_.get(), old.st_mode & 07777) != 0) failure = errno;
    if (failure) return t.refused(failure);
    // Begun here, so that many files need not be waited for one after the other.
    ::sync_file_range(t.fd_.get(), 0, 0, SYNC_FILE_RANGE_WRITE);
    return t;
  }
  Temporary(Temporary&& from) noexcept
      : file_(std::move(from.file_)),
        name_(std::exchange(from.name_, {})),
        fd_(std::move(from.fd_)) {}
  Temporary& operator=(Temporary&&) = delete;
  ~Temporary() {
    if (!name_.empty()) ::unlink(name_.c_str());
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
    if (::rename(name_.c_str(), file_.c_str()) != 0) return refused(errno);
    name_.clear();
    return {};
  }

 private:
  explicit Temporary(fs::path file) : file_(std::move(file)) {}
  [[nodiscard]] std::string shown() const { return quote(file_.generic_string()); }
  [[nodiscard]] Error refused(int number) const {
    return error(ErrorCode::io, "cannot write " + shown() + ": " + reason(number),
                 "Check the folder's permissions and free space.");
  }

  fs::path file_;
  std::string name_;  ///< empty = there is none (any more)
  Descriptor fd_;
};

/// So that what was renamed in it survives a power cut.
void sync_folder(const fs::path& folder) {
  const Descriptor directory(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (directory.get() >= 0) ::fsync(directory.get());
}

/// Files that are open at once, until they are on the disk: a process may have some 1000.
constexpr std::size_t kTogether = 128;

}  // namespace

struct FileBatch::Work {
  std::set<fs::path> folders;
  std::vector<Temporary> files;
  std::size_t synced = 0;  ///< files from the first on that are on the disk

  /// The file system commits what it knows of all of them with the first, so that the others wait
  /// for little.
  Result<void> sync() {
    for (; synced < files.size(); ++synced) RMP_TRY(files[synced].sync());
    return {};
  }
};

FileBatch::FileBatch() : work_(std::make_unique<Work>()) {}
FileBatch::~FileBatch() = default;

Result<void> FileBatch::add(const fs::path& file, std::string_view bytes) {
  RMP_TRY(require(Effect::files_write));
  Work& w = *work_;
  const fs::path folder = Temporary::folder_of(file);
  std::error_code ec;
  if (!w.folders.contains(folder) && !fs::is_directory(folder, ec))
    return error(ErrorCode::not_found,
                 "there is no folder " + quote(folder.generic_string()) + " to save " +
                     quote(file.filename().generic_string()) + " in",
                 "Create the folder first or choose another one.");
  w.folders.insert(folder);
  RMP_TRY_ASSIGN(Temporary written, Temporary::write(file, bytes));
  w.files.push_back(std::move(written));
  if (w.files.size() - w.synced >= kTogether) RMP_TRY(w.sync());
  return {};
}

Result<void> FileBatch::finish() {
  RMP_TRY(require(Effect::files_write));
  Work& w = *work_;
  RMP_TRY(w.sync());
  for (Temporary& each : w.files) RMP_TRY(each.take_place());
  for (const fs::path& folder : w.folders) sync_folder(folder);
  w = Work();
  return {};
}

Result<void> write_file(const fs::path& file, std::string_view bytes) {
  FileBatch batch;
  RMP_TRY(batch.add(file, bytes));
  return batch.finish();
}

bool file_holds(const fs::path& file, std::string_view bytes) {
  const PermitScope own(nullptr);  // nothing of the file is shown to anybody
  const auto there = read_file(file, bytes.size());
  return there.ok() && *there == bytes;
}

Result<std::string> read_file(const fs::path& file, std::size_t limit) {
  RMP_TRY(require(Effect::files_read));
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
                                      " bytes, the most that is read");
  }
}

}  // namespace robomosp::io
