// SPDX-License-Identifier: Apache-2.0
#include "io/native.h"

#include <atomic>
#include <cerrno>
#include <system_error>

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
  explicit Descriptor(int fd) : fd_(fd) {}
  ~Descriptor() {
    if (fd_ >= 0) ::close(fd_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  [[nodiscard]] int get() const { return fd_; }
  [[nodiscard]] int close() {
    const int result = ::close(fd_);
    fd_ = -1;
    return result;
  }

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

}  // namespace

Result<void> write_file(const fs::path& file, std::string_view bytes) {
  RMP_TRY(require(Effect::files_write));
  const fs::path folder = file.has_parent_path() ? file.parent_path() : fs::path(".");
  const std::string shown = quote(file.generic_string());
  std::error_code ec;
  if (!fs::is_directory(folder, ec))
    return error(ErrorCode::not_found,
                 "there is no folder " + quote(folder.generic_string()) + " to save " +
                     quote(file.filename().generic_string()) + " in",
                 "Create the folder first or choose another one.");
  if (fs::is_directory(file, ec))
    return error(ErrorCode::io, shown + " is a folder, so it cannot be written as a file",
                 "Choose another name.");
  const auto refused = [&](int number) {
    return error(ErrorCode::io, "cannot write " + shown + ": " + reason(number),
                 "Check the folder's permissions and free space.");
  };

  // open() gives a new file the permissions of the user's umask; an old one keeps its own.
  static std::atomic<unsigned> counter{0};
  const std::string temporary =
      (folder / ("." + file.filename().string() + "." + std::to_string(::getpid()) + "." +
                 std::to_string(counter++)))
          .string();
  Descriptor fd(::open(temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666));
  if (fd.get() < 0) return refused(errno);
  struct stat old {};
  const bool is_new = ::stat(file.c_str(), &old) != 0;
  int failure = write_all(fd.get(), bytes);
  if (!failure && !is_new && ::fchmod(fd.get(), old.st_mode & 07777) != 0) failure = errno;
  if (!failure && ::fsync(fd.get()) != 0) failure = errno;
  if (fd.close() != 0 && !failure) failure = errno;
  if (!failure && ::rename(temporary.c_str(), file.c_str()) != 0) failure = errno;
  if (failure) {
    ::unlink(temporary.c_str());
    return refused(failure);
  }
  const Descriptor directory(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (directory.get() >= 0) ::fsync(directory.get());  // so that the rename survives a power cut
  return {};
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
