// SPDX-License-Identifier: Apache-2.0
#include "kernel/file_cache.h"

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "kernel/file_stamp.h"

namespace robomosp {
namespace {

namespace fs = std::filesystem;

constexpr std::uint32_t kFormat = 1;
constexpr std::uint32_t kByteOrder = 0x01020304;
constexpr char kMagic[8] = {'R', 'M', 'P', 'K', 'E', 'P', 'T', '\n'};
constexpr std::string_view kEnding = ".kept", kPart = ".part";
constexpr double kRoom = 0.9;              ///< of the limit, that is left when some were removed
constexpr std::uint64_t kLookAgain = 500;  ///< files, after which others' are counted too
constexpr std::int64_t kAbandoned = 3600;  ///< age of a part that nobody goes on writing [s]

struct Header {
  char magic[8];
  std::uint32_t byte_order, format;
  Fingerprint name;
  std::uint64_t size;
  Fingerprint checksum;
};
static_assert(sizeof(Header) == 56);

Fingerprint checksum_of(std::string_view bytes) {
  return Fingerprinter("kept bytes/1").add(bytes).finish();
}

/// A file descriptor that closes.
class Opened {
 public:
  explicit Opened(int fd) : fd_(fd) {}
  ~Opened() {
    if (fd_ >= 0) ::close(fd_);
  }
  Opened(const Opened&) = delete;
  Opened& operator=(const Opened&) = delete;
  [[nodiscard]] int fd() const { return fd_; }
  [[nodiscard]] bool close() { return ::close(std::exchange(fd_, -1)) == 0; }

 private:
  int fd_;
};

bool read_all(int fd, char* to, std::size_t size) {
  while (size > 0) {
    const ssize_t n = ::read(fd, to, size);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return false;
    to += n;
    size -= static_cast<std::size_t>(n);
  }
  return true;
}

bool write_all(int fd, const char* from, std::size_t size) {
  while (size > 0) {
    const ssize_t n = ::write(fd, from, size);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return false;
    from += n;
    size -= static_cast<std::size_t>(n);
  }
  return true;
}

bool is_hex(std::string_view s) {
  return std::all_of(s.begin(), s.end(),
                     [](char c) { return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f'); });
}

Fingerprint name_of(std::string_view kind, const Fingerprint& key, const Fingerprint& build) {
  return Fingerprinter("kept/1").add(kind).add(key).add(build).finish();
}

}  // namespace

struct FileCache::Found {
  fs::path file;
  std::uint64_t bytes = 0;
  struct timespec used {};
  bool is_part = false;
};

FileCache::FileCache(Options options) : options_(std::move(options)) {
  if (options_.folder.empty()) is_usable_ = false;
}

fs::path FileCache::user_folder() {
  if (const char* given = std::getenv("ROBOMOSP_CACHE"); given && *given)
    return *given == '/' ? fs::path(given) : fs::path();
  if (const char* cache = std::getenv("XDG_CACHE_HOME"); cache && *cache == '/')
    return fs::path(cache) / "robomosp" / "geometry";
  if (const char* home = std::getenv("HOME"); home && *home == '/')
    return fs::path(home) / ".cache" / "robomosp" / "geometry";
  return {};
}

std::uint64_t FileCache::user_limit() {
  constexpr std::uint64_t kMost = std::uint64_t{1} << 24;  // 16 TiB
  std::uint64_t mib = 0;
  if (const char* given = std::getenv("ROBOMOSP_CACHE_MIB"); given && *given) {
    const char* end = given + std::strlen(given);
    const auto [at, failed] = std::from_chars(given, end, mib);
    if (failed == std::errc() && at == end) return std::min(mib, kMost) << 20;
  }
  return Options{.folder = {}, .build = {}}.limit;
}

Fingerprint FileCache::fingerprint_of_program() {
  Fingerprinter fp("program/1");
  fp.add(std::int64_t{kFormat}).add(sizeof(void*));
  (void)add_file_stamp(fp, "/proc/self/exe");
  return fp.finish();
}

fs::path FileCache::file_of(std::string_view kind, const Fingerprint& key) const {
  const std::string name = name_of(kind, key, options_.build).hex();
  return options_.folder / name.substr(0, 2) /
         (name.substr(2) + "." + std::string(kind) + std::string(kEnding));
}

void FileCache::tell(const std::string& what) {
  if (!options_.note) return;
  const std::lock_guard one_at_a_time(telling_);
  options_.note(what);
}

void FileCache::drop(const fs::path& file, const std::string& why) {
  ++refused_;
  ::unlink(file.c_str());
  tell("The kept file " + file.string() + " " + why +
       "; the file was removed, and its geometry is computed again.");
}

void FileCache::refuse(std::string_view kind, const Fingerprint& key) {
  drop(file_of(kind, key), "holds no " + std::string(kind));
}

std::optional<std::string> FileCache::read(std::string_view kind, const Fingerprint& key) {
  if (!is_usable_) return std::nullopt;
  const fs::path file = file_of(kind, key);
  // Neither a link nor a pipe in the place of a file is followed or waited for.
  const Opened in(::open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK));
  if (in.fd() < 0) {
    ++misses_;
    if (errno == ELOOP) drop(file, "is a link");
    return std::nullopt;
  }
  struct stat s {};
  Header h{};
  const auto refused = [&](const char* why) {
    ++misses_;
    drop(file, why);
    return std::nullopt;
  };
  if (::fstat(in.fd(), &s) != 0 || !S_ISREG(s.st_mode)) return refused("is no file");
  const auto size = static_cast<std::uint64_t>(s.st_size);
  if (size < sizeof h) return refused("is cut short");
  if (!read_all(in.fd(), reinterpret_cast<char*>(&h), sizeof h)) return refused("cannot be read");
  if (std::memcmp(h.magic, kMagic, sizeof kMagic) != 0)
    return refused("was not written by this program");
  if (h.byte_order != kByteOrder || h.format != kFormat)
    return refused("is of another version of the program");
  if (h.name != name_of(kind, key, options_.build)) return refused("belongs to something else");
  if (size != sizeof h + h.size) return refused("is cut short or too long");
  std::string bytes(h.size, '\0');
  if (!read_all(in.fd(), bytes.data(), bytes.size())) return refused("cannot be read");
  if (checksum_of(bytes) != h.checksum) return refused("is damaged");
  ::futimens(in.fd(), nullptr);  // used now
  ++hits_;
  return bytes;
}

void FileCache::write(std::string_view kind, const Fingerprint& key, std::string_view bytes) {
  if (!is_usable_ || bytes.size() + sizeof(Header) > options_.limit / 4) return;
  const fs::path file = file_of(kind, key);
  const auto give_up = [&](int why) {
    if (is_usable_.exchange(false))
      tell("Nothing is kept in " + options_.folder.string() + ": " + std::strerror(why) +
           ". All is computed anew in the next run.");
  };
  std::error_code failed;
  if (!fs::is_directory(file.parent_path(), failed)) {
    fs::create_directories(file.parent_path(), failed);
    if (failed) return give_up(failed.value());
  }
  Header h{};
  std::memcpy(h.magic, kMagic, sizeof kMagic);
  h.byte_order = kByteOrder;
  h.format = kFormat;
  h.name = name_of(kind, key, options_.build);
  h.size = bytes.size();
  h.checksum = checksum_of(bytes);
  // Not synced: what a failing machine leaves behind does not pass its checksum.
  const fs::path part =
      file.parent_path() / (file.stem().string() + "." + std::to_string(::getpid()) + "." +
                            std::to_string(part_++) + std::string(kPart));
  Opened out(::open(part.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600));
  if (out.fd() < 0) {
    if (errno != EEXIST && errno != ENOENT) give_up(errno);
    return;
  }
  errno = 0;
  const bool is_written = write_all(out.fd(), reinterpret_cast<const char*>(&h), sizeof h) &&
                          write_all(out.fd(), bytes.data(), bytes.size()) && out.close();
  const int why = errno;
  if (!is_written || ::rename(part.c_str(), file.c_str()) != 0) {
    ::unlink(part.c_str());
    if (!is_written) give_up(why != 0 ? why : EIO);
    return;
  }
  ++written_;
  make_room(sizeof h + bytes.size());
}

template <class Visit>
void FileCache::each_file(Visit&& visit) const {
  std::error_code failed;
  for (fs::directory_iterator folder(options_.folder, failed), end; !failed && folder != end;
       folder.increment(failed)) {
    const std::string name = folder->path().filename().string();
    if (name.size() != 2 || !is_hex(name) || folder->is_symlink(failed)) continue;
    std::error_code inner;
    for (fs::directory_iterator at(folder->path(), inner); !inner && at != end;
         at.increment(inner)) {
      const std::string own = at->path().filename().string();
      const bool is_part = own.ends_with(kPart);
      if (own.size() < 31 || !is_hex(std::string_view(own).substr(0, 30)) || own[30] != '.' ||
          !(is_part || own.ends_with(kEnding)))
        continue;
      struct stat s {};
      if (::lstat(at->path().c_str(), &s) != 0 || !S_ISREG(s.st_mode)) continue;
      visit(Found{at->path(), static_cast<std::uint64_t>(s.st_size), s.st_mtim, is_part});
    }
  }
}

/// Counts what was added, and where it is too much removes what was used longest ago.
void FileCache::make_room(std::uint64_t added) {
  const std::lock_guard lock(mutex_);
  if (bytes_ && *bytes_ + added <= options_.limit && ++since_look_ < kLookAgain) {
    *bytes_ += added;
    return;
  }
  std::vector<Found> all;
  std::uint64_t sum = 0;
  each_file([&](Found f) {
    if (f.is_part) {
      if (f.used.tv_sec + kAbandoned < std::time(nullptr)) ::unlink(f.file.c_str());
      return;
    }
    sum += f.bytes;
    all.push_back(std::move(f));
  });
  since_look_ = 0;
  if (sum > options_.limit) {
    std::sort(all.begin(), all.end(), [](const Found& a, const Found& b) {
      if (a.used.tv_sec != b.used.tv_sec) return a.used.tv_sec < b.used.tv_sec;
      if (a.used.tv_nsec != b.used.tv_nsec) return a.used.tv_nsec < b.used.tv_nsec;
      return a.file < b.file;
    });
    const auto enough = static_cast<std::uint64_t>(kRoom * static_cast<double>(options_.limit));
    for (const Found& f : all) {
      if (sum <= enough) break;
      ::unlink(f.file.c_str());
      sum -= f.bytes;
    }
  }
  bytes_ = sum;
}

FileCache::State FileCache::state() const {
  State s;
  s.hits = hits_;
  s.misses = misses_;
  s.refused = refused_;
  s.written = written_;
  each_file([&](const Found& f) {
    ++s.files;
    s.bytes += f.bytes;
  });
  return s;
}

std::uint64_t FileCache::clear() {
  std::uint64_t count = 0;
  each_file([&](const Found& f) {
    if (::unlink(f.file.c_str()) == 0) ++count;
  });
  const std::lock_guard lock(mutex_);
  bytes_.reset();
  return count;
}

}  // namespace robomosp
