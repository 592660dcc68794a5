// SPDX-License-Identifier: Apache-2.0
#include "kernel/file_root.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <deque>
#include <system_error>

#include "kernel/folder_names.h"
#include "kernel/permit.h"
#include "kernel/text.h"

#include <dirent.h>
#include <fcntl.h>
#include <linux/magic.h>
#include <linux/openat2.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/vfs.h>
#include <unistd.h>

namespace robomosp {

namespace fs = std::filesystem;

int FileDescriptor::close() noexcept { return fd_ < 0 ? 0 : ::close(std::exchange(fd_, -1)); }

struct FileRoot::Held {
  FileDescriptor fd;  ///< O_PATH
  fs::path folder;
  std::vector<std::string> names;  ///< of `folder`, one by one
  std::vector<fs::path> readable;
  std::vector<std::vector<std::string>> readable_names;
};

namespace {

constexpr std::size_t kLongestPath = 4095;  // as the system's
constexpr int kMostLinks = 40;              // as the system counts
constexpr std::size_t kMostSteps = 10'000;
constexpr std::size_t kLongestShown = 120;

std::string reason(int number) { return std::generic_category().message(number); }

/// A name in a message, as it was given.
std::string quoted(const fs::path& path) {
  std::string name = path.string();
  if (name.size() > kLongestShown) name = name.substr(0, kLongestShown) + "...";
  return text::quote(name);
}

/// The same whatever stands there, and whether anything does.
Error outside(const fs::path& path) {
  return error(ErrorCode::permission,
               quoted(path) + " is not in the folder that the files of this session lie in",
               "Give a name relative to that folder that does not lead out of it, neither by .. "
               "nor by a link.");
}
Error read_only(const fs::path& path) {
  return error(ErrorCode::permission, quoted(path) + " may be read only in this session",
               "Write to a file in the session's folder.");
}
Error missing(const fs::path& path) {
  return error(ErrorCode::not_found, "there is no file " + quoted(path), "Check the path.");
}
Error failed(const fs::path& path, const char* what, int number) {
  if (number == ENOENT) return missing(path);
  return error(ErrorCode::io, std::string("cannot ") + what + " " + quoted(path) + ": " +
                                  (number == ELOOP ? "it was replaced by a link" : reason(number)));
}
Error no_file(const fs::path& path, bool is_folder) {
  return error(ErrorCode::io,
               quoted(path) + (is_folder ? " is a folder, not a file" : " is not a regular file"));
}

std::vector<std::string> names_of(const fs::path& path) {
  std::vector<std::string> out;
  const std::string& all = path.native();
  for (std::size_t at = 0; at < all.size();) {
    const std::size_t end = std::min(all.find('/', at), all.size());
    if (end > at && all.compare(at, end - at, ".") != 0) out.push_back(all.substr(at, end - at));
    at = end + 1;
  }
  return out;
}

bool begins_with(const std::vector<std::string>& all, const std::vector<std::string>& start) {
  return all.size() >= start.size() && std::equal(start.begin(), start.end(), all.begin());
}

bool has_dots(const std::vector<std::string>& names) {
  return std::find(names.begin(), names.end(), "..") != names.end();
}

/// A folder below another one, by names that are no links; -1 and errno.
int open_below(int root, const std::vector<std::string>& names) {
  if (names.empty()) return ::openat(root, ".", O_PATH | O_DIRECTORY | O_CLOEXEC);
  std::string path;
  for (const std::string& n : names) path += (path.empty() ? "" : "/") + n;
  open_how how{};
  how.flags = O_PATH | O_DIRECTORY | O_CLOEXEC;
  how.resolve = RESOLVE_BENEATH | RESOLVE_NO_SYMLINKS | RESOLVE_NO_MAGICLINKS;
  const long fd = ::syscall(SYS_openat2, root, path.c_str(), &how, sizeof how);
  // Systems before Linux 5.6, and those that do not let it through: folder by folder is the same.
  if (fd >= 0 || (errno != ENOSYS && errno != EPERM && errno != EAGAIN))
    return static_cast<int>(fd);
  FileDescriptor at(::openat(root, ".", O_PATH | O_DIRECTORY | O_CLOEXEC));
  for (const std::string& n : names) {
    if (!at.is_open()) return -1;
    at = FileDescriptor(
        ::openat(at.get(), n.c_str(), O_PATH | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC));
  }
  return at.is_open() ? ::fcntl(at.get(), F_DUPFD_CLOEXEC, 0) : -1;
}

/// Where a path leads to below the root. Its folder is held open, so that whoever swaps folders and
/// links meanwhile changes nothing of it.
struct Walked {
  FileDescriptor dir;              ///< the folder it stands in
  std::vector<std::string> names;  ///< of `dir`, from the root
  std::string last = ".";          ///< in `dir`; "." = `dir` itself is meant
  struct stat status {};           ///< where it is there
  bool is_there = false;
  bool wants_folder = false;        ///< the path ended with a slash
  std::vector<std::string> behind;  ///< names behind `last`, which is missing then
  std::string link;                 ///< text of `last`, which is a link that was not followed
};

class Walk {
 public:
  Walk(const FileRoot::Held& root, const fs::path& path) : root_(root), path_(path) {}

  /// `names` from the root on; no name of the path outside is ever looked up.
  Result<Walked> run(const std::vector<std::string>& names, bool follow_last) {
    todo_.assign(names.begin(), names.end());
    RMP_TRY(restart());
    std::size_t steps = 0;
    int links = 0;
    while (!todo_.empty()) {
      if (++steps > kMostSteps) return failed(path_, "open", ENAMETOOLONG);
      const std::string name = std::move(todo_.front());
      todo_.pop_front();
      if (name == "..") {
        if (out_.names.empty()) return outside(path_);
        out_.names.pop_back();
        RMP_TRY(reopen());
        continue;
      }
      if (::fstatat(out_.dir.get(), name.c_str(), &out_.status, AT_SYMLINK_NOFOLLOW) != 0) {
        if (errno != ENOENT) return failed(path_, "open", errno);
        if (has_dots({todo_.begin(), todo_.end()})) return missing(path_);
        out_.last = name;
        out_.behind.assign(todo_.begin(), todo_.end());
        return std::move(out_);
      }
      if (S_ISLNK(out_.status.st_mode)) {
        if (todo_.empty() && !follow_last) return ended(name);
        if (++links > kMostLinks) return failed(path_, "open", ELOOP);
        RMP_TRY(follow(name));
        continue;
      }
      if (todo_.empty()) return ended(name);
      if (!S_ISDIR(out_.status.st_mode)) return failed(path_, "open", ENOTDIR);
      FileDescriptor next(
          ::openat(out_.dir.get(), name.c_str(), O_PATH | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC));
      if (!next.is_open()) return failed(path_, "open", errno);
      out_.dir = std::move(next);
      out_.names.push_back(name);
    }
    if (::fstat(out_.dir.get(), &out_.status) != 0) return failed(path_, "open", errno);
    out_.is_there = true;
    return std::move(out_);
  }

 private:
  Result<Walked> ended(const std::string& name) {
    out_.last = name;
    out_.is_there = true;
    return std::move(out_);
  }
  Result<void> restart() {
    out_.names.clear();
    return reopen();
  }
  Result<void> reopen() {
    out_.dir = FileDescriptor(open_below(root_.fd.get(), out_.names));
    if (!out_.dir.is_open()) return failed(path_, "open", errno);
    return {};
  }
  Result<void> follow(const std::string& name) {
    char text[kLongestPath + 1];
    const ssize_t n = ::readlinkat(out_.dir.get(), name.c_str(), text, sizeof text);
    if (n < 0) return failed(path_, "open", errno);
    if (n == 0 || static_cast<std::size_t>(n) >= sizeof text) return failed(path_, "open", ENOENT);
    const fs::path target(std::string(text, static_cast<std::size_t>(n)));
    std::vector<std::string> names = names_of(target);
    if (target.is_absolute()) {
      if (!begins_with(names, root_.names)) return outside(path_);
      names.erase(names.begin(), names.begin() + static_cast<std::ptrdiff_t>(root_.names.size()));
      RMP_TRY(restart());
    }
    todo_.insert(todo_.begin(), names.begin(), names.end());
    return {};
  }

  const FileRoot::Held& root_;
  const fs::path& path_;
  Walked out_;
  std::deque<std::string> todo_;
};

/// A path of a confined session: in the root, or in a folder that may be read.
struct Place {
  bool is_readable = false;  ///< in the latter; `path` is absolute then
  fs::path path;
  std::vector<std::string> names;  ///< from the root on
  bool wants_folder = false;
};

Result<Place> placed(const FileRoot::Held& root, const fs::path& path) {
  const std::string& native = path.native();
  if (native.empty())
    return error(ErrorCode::invalid_argument, "a file's name is empty", "Give its name.");
  if (native.find('\0') != std::string::npos)
    return error(ErrorCode::invalid_argument, "a file's name has a zero byte in it",
                 "Give its name without it.");
  if (native.size() > kLongestPath)
    return error(ErrorCode::invalid_argument,
                 "a file's name has " + std::to_string(native.size()) + " bytes; at most " +
                     std::to_string(kLongestPath) + " are possible",
                 "Give a shorter one.");
  Place p;
  p.names = names_of(path);
  p.wants_folder = native.back() == '/';
  if (path.is_relative()) return p;
  if (begins_with(p.names, root.names)) {
    p.names.erase(p.names.begin(),
                  p.names.begin() + static_cast<std::ptrdiff_t>(root.names.size()));
    return p;
  }
  // Files there name each other by "..": what they name is decided without looking.
  const fs::path normal = path.lexically_normal();
  const std::vector<std::string> names = names_of(normal);
  for (const auto& readable : root.readable_names)
    if (begins_with(names, readable)) {
      p.is_readable = true;
      p.path = normal;
      return p;
    }
  return outside(path);
}

Result<Walked> walked(const FileRoot::Held& root, const Place& place, const fs::path& path,
                      bool follow_last = true) {
  RMP_TRY_ASSIGN(Walked w, Walk(root, path).run(place.names, follow_last));
  w.wants_folder = place.wants_folder;
  if (w.wants_folder && w.is_there && !S_ISDIR(w.status.st_mode))
    return failed(path, "open", ENOTDIR);
  return w;
}

fs::path path_of(const FileRoot::Held& root, const Walked& w) {
  fs::path out = root.folder;
  for (const std::string& n : w.names) out /= n;
  if (w.last != ".") out /= w.last;
  for (const std::string& n : w.behind) out /= n;
  return out;
}

FileKind file_kind_of(const struct stat& s) {
  return S_ISREG(s.st_mode)   ? FileKind::file
         : S_ISDIR(s.st_mode) ? FileKind::folder
                              : FileKind::other;
}

/// What the system makes up as it is read is no file of anybody's.
bool is_made_up(int fd) {
  struct statfs s {};
  return ::fstatfs(fd, &s) == 0 && (s.f_type == PROC_SUPER_MAGIC || s.f_type == SYSFS_MAGIC);
}

/// Checked by the descriptor, so that no name can be swapped.
Result<FileDescriptor> regular(FileDescriptor fd, const fs::path& path) {
  struct stat s {};
  if (::fstat(fd.get(), &s) != 0) return failed(path, "open", errno);
  if (!S_ISREG(s.st_mode)) return no_file(path, S_ISDIR(s.st_mode));
  if (is_made_up(fd.get())) return no_file(path, false);
  return fd;
}

Result<FileDescriptor> open_walked(const Walked& w, const fs::path& path, int flags,
                                   const char* what) {
  if (!w.behind.empty()) return missing(path);
  if (w.last == ".") return no_file(path, true);
  // Before it is opened, since that alone does something to a device.
  if (w.is_there && !S_ISREG(w.status.st_mode)) return no_file(path, S_ISDIR(w.status.st_mode));
  if (!w.is_there && ((flags & O_CREAT) == 0 || w.wants_folder)) return missing(path);
  FileDescriptor fd(::openat(w.dir.get(), w.last.c_str(),
                             flags | O_NOFOLLOW | O_NONBLOCK | O_NOCTTY | O_CLOEXEC, 0666));
  if (!fd.is_open()) return failed(path, what, errno);
  return regular(std::move(fd), path);
}

Result<FileDescriptor> open_plainly(const fs::path& path, int flags, const char* what) {
  FileDescriptor fd(::open(path.c_str(), flags | O_CLOEXEC, 0666));
  if (!fd.is_open()) return failed(path, what, errno);
  return fd;
}

void replace_all(std::string& text, const std::string& what) {
  for (std::size_t at = 0; (at = text.find(what, at)) != std::string::npos;)
    text.erase(at, what.size());
}

}  // namespace

// --- the root ------------------------------------------------------------------------------------

Result<FileRoot> FileRoot::open(const fs::path& folder, const std::vector<fs::path>& readable) {
  auto held = std::make_shared<Held>();
  std::error_code ec;
  held->folder = fs::canonical(folder.empty() ? fs::path(".") : folder, ec);
  if (!ec) {
    held->fd = FileDescriptor(::open(held->folder.c_str(), O_PATH | O_DIRECTORY | O_CLOEXEC));
    if (!held->fd.is_open()) ec = std::error_code(errno, std::generic_category());
  }
  if (ec)
    return error(ec == std::errc::no_such_file_or_directory ? ErrorCode::not_found : ErrorCode::io,
                 quoted(folder) + " cannot be the folder of a session: " + ec.message(),
                 "Make the folder first.");
  held->names = names_of(held->folder);
  const auto add = [&](const fs::path& p) {
    if (std::find(held->readable.begin(), held->readable.end(), p) != held->readable.end()) return;
    held->readable.push_back(p);
    held->readable_names.push_back(names_of(p));
  };
  for (const fs::path& p : readable) {
    const fs::path real = fs::canonical(p, ec);
    if (ec || real == real.root_path() || !fs::is_directory(real, ec)) continue;
    const fs::path given = fs::absolute(p, ec).lexically_normal();
    if (!ec && !has_dots(names_of(given))) add(given);
    add(real);
  }
  return FileRoot(std::move(held));
}

const fs::path& FileRoot::folder() const { return held_->folder; }
const std::vector<fs::path>& FileRoot::readable() const { return held_->readable; }

std::string FileRoot::shown(std::string text) const {
  if (held_->names.empty()) return text;
  const std::string& folder = held_->folder.native();
  replace_all(text, folder + "/");
  const std::string quoted = text::quote(folder);
  for (std::size_t at = 0; (at = text.find(quoted, at)) != std::string::npos;)
    text.replace(at, quoted.size(), "\".\"");
  return text;
}

std::string FileRoot::shown_name(std::string_view name) const {
  const std::string& folder = held_->folder.native();
  if (held_->names.empty() || !name.starts_with(folder)) return std::string(name);
  if (name.size() == folder.size()) return ".";
  if (name[folder.size()] != '/') return std::string(name);
  return std::string(name.substr(folder.size() + 1));
}

const FileRoot* current_file_root() noexcept {
  const Permit* permit = current_permit();
  return permit ? permit->files.get() : nullptr;
}

// --- the door ------------------------------------------------------------------------------------

Result<fs::path> permitted_path(const fs::path& path, Effect effect) {
  const FileRoot* root = current_file_root();
  if (!root) return path;
  RMP_TRY_ASSIGN(const Place place, placed(root->held(), path));
  if (place.is_readable) {
    if (effect == Effect::files_write) return read_only(path);
    return place.path;
  }
  RMP_TRY_ASSIGN(const Walked w, walked(root->held(), place, path));
  return path_of(root->held(), w);
}

Result<fs::path> permitted_name(const fs::path& path) {
  const FileRoot* root = current_file_root();
  if (!root) return path;
  RMP_TRY_ASSIGN(const Place place, placed(root->held(), path));
  if (place.is_readable) return place.path;
  RMP_TRY_ASSIGN(const Walked w, walked(root->held(), place, path));
  fs::path out = root->folder();
  if (has_dots(place.names)) out = path_of(root->held(), w);
  else
    for (const std::string& n : place.names) out /= n;
  if (place.wants_folder) out /= "";
  return out;
}

FileKind file_kind(const fs::path& path) {
  const FileRoot* root = current_file_root();
  struct stat s {};
  if (root) {
    const auto place = placed(root->held(), path);
    if (!place.ok()) return FileKind::none;
    if (!place->is_readable) {
      const auto w = walked(root->held(), *place, path);
      return w.ok() && w->is_there && w->behind.empty() ? file_kind_of(w->status) : FileKind::none;
    }
  }
  return ::stat(path.c_str(), &s) == 0 ? file_kind_of(s) : FileKind::none;
}

Result<FileDescriptor> open_to_read(const fs::path& path) {
  const FileRoot* root = current_file_root();
  if (!root) return open_plainly(path, O_RDONLY, "read");
  RMP_TRY_ASSIGN(const Place place, placed(root->held(), path));
  if (place.is_readable) {
    RMP_TRY_ASSIGN(FileDescriptor fd,
                   open_plainly(place.path, O_RDONLY | O_NONBLOCK | O_NOCTTY, "read"));
    return regular(std::move(fd), path);
  }
  RMP_TRY_ASSIGN(const Walked w, walked(root->held(), place, path));
  return open_walked(w, path, O_RDONLY, "read");
}

Result<FileDescriptor> open_to_write(const fs::path& path, int flags) {
  const FileRoot* root = current_file_root();
  if (!root) return open_plainly(path, flags, "write");
  RMP_TRY_ASSIGN(const Place place, placed(root->held(), path));
  if (place.is_readable) return read_only(path);
  RMP_TRY_ASSIGN(const Walked w, walked(root->held(), place, path));
  // O_TRUNC only behind the look at what it is.
  RMP_TRY_ASSIGN(FileDescriptor fd, open_walked(w, path, flags & ~O_TRUNC, "write"));
  if ((flags & O_TRUNC) != 0 && ::ftruncate(fd.get(), 0) != 0) return failed(path, "write", errno);
  return fd;
}

Result<FilePlace> place_to_write(const fs::path& path) {
  FilePlace out;
  const FileRoot* root = current_file_root();
  if (!root) {
    out.folder = AT_FDCWD;
    out.name = path.string();
    out.path = path;
    return out;
  }
  RMP_TRY_ASSIGN(const Place place, placed(root->held(), path));
  if (place.is_readable) return read_only(path);
  RMP_TRY_ASSIGN(Walked w, walked(root->held(), place, path));
  if (w.last == "." || w.wants_folder)
    return error(ErrorCode::io, quoted(path) + " is a folder, so it cannot be written as a file",
                 "Choose another name.");
  if (!w.behind.empty())
    return error(ErrorCode::not_found,
                 "there is no folder " + quoted(path.parent_path()) + " to save " +
                     quoted(path.filename()) + " in",
                 "Create the folder first or choose another one.");
  if (w.is_there && !S_ISREG(w.status.st_mode)) return no_file(path, S_ISDIR(w.status.st_mode));
  out.path = path_of(root->held(), w);
  out.name = w.last;
  out.held = std::make_shared<const FileDescriptor>(std::move(w.dir));
  out.folder = out.held->get();
  return out;
}

Result<void> make_folders(const fs::path& path) {
  const FileRoot* root = current_file_root();
  if (!root) {
    std::error_code ec;
    fs::create_directories(path, ec);
    if (ec) return failed(path, "make the folder", ec.value());
    return {};
  }
  RMP_TRY_ASSIGN(const Place place, placed(root->held(), path));
  if (place.is_readable) return read_only(path);
  RMP_TRY_ASSIGN(Walked w, walked(root->held(), place, path));
  if (w.is_there) {
    if (S_ISDIR(w.status.st_mode)) return {};
    return failed(path, "make the folder", ENOTDIR);
  }
  std::vector<std::string> names{w.last};
  names.insert(names.end(), w.behind.begin(), w.behind.end());
  for (const std::string& n : names) {
    if (::mkdirat(w.dir.get(), n.c_str(), 0777) != 0 && errno != EEXIST)
      return failed(path, "make the folder", errno);
    FileDescriptor next(
        ::openat(w.dir.get(), n.c_str(), O_PATH | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC));
    if (!next.is_open()) return failed(path, "make the folder", errno);
    w.dir = std::move(next);
  }
  return {};
}

Result<bool> remove_file(const fs::path& path) {
  const FileRoot* root = current_file_root();
  if (!root) {
    std::error_code ec;
    const bool was_there = fs::remove(path, ec);
    if (ec) return failed(path, "remove", ec.value());
    return was_there;
  }
  RMP_TRY_ASSIGN(const Place place, placed(root->held(), path));
  if (place.is_readable) return read_only(path);
  RMP_TRY_ASSIGN(const Walked w, walked(root->held(), place, path, false));
  if (!w.is_there) return false;
  if (w.last == ".")
    return error(ErrorCode::invalid_argument, quoted(path) + " cannot be removed",
                 "Name it by its own name; the session's folder itself stays.");
  const bool is_folder = S_ISDIR(w.status.st_mode);
  if (::unlinkat(w.dir.get(), w.last.c_str(), is_folder ? AT_REMOVEDIR : 0) != 0) {
    if (errno == ENOENT) return false;
    return failed(path, "remove", errno);
  }
  return true;
}

Result<void> rename_file(const fs::path& from, const fs::path& to) {
  const FileRoot* root = current_file_root();
  if (!root) {
    if (::rename(from.c_str(), to.c_str()) != 0) return failed(from, "rename", errno);
    return {};
  }
  const auto find = [&](const fs::path& path) -> Result<Walked> {
    RMP_TRY_ASSIGN(const Place place, placed(root->held(), path));
    if (place.is_readable) return read_only(path);
    RMP_TRY_ASSIGN(Walked w, walked(root->held(), place, path, false));
    if (w.last == "." || !w.behind.empty()) return failed(path, "rename", ENOENT);
    return w;
  };
  RMP_TRY_ASSIGN(const Walked a, find(from));
  RMP_TRY_ASSIGN(const Walked b, find(to));
  if (::renameat(a.dir.get(), a.last.c_str(), b.dir.get(), b.last.c_str()) != 0)
    return failed(from, "rename", errno);
  return {};
}

namespace {

/// A folder that is open for reading its entries.
struct OpenFolder {
  FileDescriptor fd;
  std::unique_ptr<DIR, int (*)(DIR*)> dir{nullptr, ::closedir};
};

Result<OpenFolder> open_folder(const fs::path& path) {
  const FileRoot* root = current_file_root();
  OpenFolder out;
  bool is_walked = false;
  constexpr int kFlags = O_RDONLY | O_DIRECTORY | O_NONBLOCK | O_CLOEXEC;
  if (root) {
    RMP_TRY_ASSIGN(const Place place, placed(root->held(), path));
    is_walked = !place.is_readable;
    if (is_walked) {
      RMP_TRY_ASSIGN(const Walked w, walked(root->held(), place, path));
      if (!w.is_there) return missing(path);
      out.fd = FileDescriptor(::openat(w.dir.get(), w.last.c_str(), kFlags | O_NOFOLLOW));
    }
  }
  if (!is_walked) out.fd = FileDescriptor(::open(path.c_str(), kFlags));
  if (!out.fd.is_open()) return failed(path, "list", errno);
  if (root && is_made_up(out.fd.get())) return failed(path, "list", EACCES);
  const int again = ::fcntl(out.fd.get(), F_DUPFD_CLOEXEC, 0);
  out.dir.reset(again >= 0 ? ::fdopendir(again) : nullptr);
  if (!out.dir) {
    const int number = errno;
    if (again >= 0) ::close(again);
    return failed(path, "list", number);
  }
  return out;
}

/// Kind and size of an entry; false if it no longer exists.
bool look_at(const OpenFolder& in, const fs::path& path, FolderEntry& e) {
  struct stat s {};
  if (::fstatat(in.fd.get(), e.name.c_str(), &s, AT_SYMLINK_NOFOLLOW) != 0) return false;
  e.kind = file_kind_of(s);
  if (S_ISLNK(s.st_mode)) {
    e.kind = file_kind(path / e.name);
    if (e.kind == FileKind::file)
      if (const auto target = open_to_read(path / e.name);
          !target.ok() || ::fstat(target->get(), &s) != 0)
        e.kind = FileKind::none;
  }
  if (e.kind == FileKind::file) e.size = static_cast<std::uint64_t>(s.st_size);
  return true;
}

bool is_before(const FolderEntry& a, const FolderEntry& b) { return a.name < b.name; }

}  // namespace

Result<std::vector<FolderEntry>> list_folder(const fs::path& path, std::size_t most) {
  RMP_TRY_ASSIGN(const OpenFolder in, open_folder(path));
  std::vector<FolderEntry> out;
  while (const dirent* entry = ::readdir(in.dir.get())) {
    const std::string_view name = entry->d_name;
    if (name == "." || name == "..") continue;
    if (out.size() >= most)
      return error(ErrorCode::unsupported,
                   "the folder " + quoted(path) + " holds more than " + std::to_string(most) +
                       " files, the most that are listed",
                   "Keep the files in several folders.");
    FolderEntry e;
    e.name = name;
    if (look_at(in, path, e)) out.push_back(std::move(e));
  }
  std::sort(out.begin(), out.end(), is_before);
  return out;
}

Result<std::vector<FolderEntry>> first_names(
    const fs::path& path, std::size_t most,
    const std::function<bool(std::string_view, FileKind)>& wanted) {
  RMP_TRY_ASSIGN(const OpenFolder in, open_folder(path));
  std::vector<FolderEntry> out;  // a heap once it is full, the last name on top
  while (const dirent* entry = ::readdir(in.dir.get())) {
    const std::string_view name = entry->d_name;
    if (name == "." || name == "..") continue;
    const bool is_full = out.size() >= most;
    if (is_full && (most == 0 || name >= out.front().name)) continue;
    FolderEntry e;
    if (entry->d_type == DT_REG || entry->d_type == DT_DIR) {
      e.kind = entry->d_type == DT_REG ? FileKind::file : FileKind::folder;
      if (!wanted(name, e.kind)) continue;
      e.name = name;
    } else {  // a link, or a file system that does not say
      e.name = name;
      if (!look_at(in, path, e) || !wanted(name, e.kind)) continue;
      e.size = 0;
    }
    if (is_full) {
      std::pop_heap(out.begin(), out.end(), is_before);
      out.back() = std::move(e);
      std::push_heap(out.begin(), out.end(), is_before);
    } else {
      out.push_back(std::move(e));
      if (out.size() == most) std::make_heap(out.begin(), out.end(), is_before);
    }
  }
  std::sort(out.begin(), out.end(), is_before);
  return out;
}

Result<FilePart> read_part(const fs::path& path, std::uint64_t offset, std::size_t length) {
  RMP_TRY_ASSIGN(FileDescriptor opened, open_to_read(path));
  RMP_TRY_ASSIGN(const FileDescriptor fd, regular(std::move(opened), path));
  FilePart out;
  struct stat s {};
  if (::fstat(fd.get(), &s) != 0) return failed(path, "read", errno);
  out.size = static_cast<std::uint64_t>(s.st_size);
  const std::uint64_t there = offset < out.size ? out.size - offset : 0;
  out.bytes.resize(static_cast<std::size_t>(std::min<std::uint64_t>(length, there)));
  std::size_t done = 0;
  while (done < out.bytes.size()) {
    const ssize_t n = ::pread(fd.get(), out.bytes.data() + done, out.bytes.size() - done,
                              static_cast<off_t>(offset + done));
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return failed(path, "read", errno);
    if (n == 0) break;  // it became shorter
    done += static_cast<std::size_t>(n);
  }
  out.bytes.resize(done);
  return out;
}

Result<std::uint64_t> append_to(const fs::path& path, std::string_view bytes) {
  RMP_TRY_ASSIGN(const FileDescriptor fd, open_to_write(path, O_WRONLY | O_CREAT | O_APPEND));
  while (!bytes.empty()) {
    const ssize_t n = ::write(fd.get(), bytes.data(), bytes.size());
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return failed(path, "write", errno);
    bytes.remove_prefix(static_cast<std::size_t>(n));
  }
  struct stat s {};
  if (::fstat(fd.get(), &s) != 0) return failed(path, "write", errno);
  return static_cast<std::uint64_t>(s.st_size);
}

Result<std::string> read_permitted(const fs::path& path, std::uint64_t most) {
  RMP_TRY_ASSIGN(const FileDescriptor fd, open_to_read(path));
  std::string bytes;
  char buffer[1 << 16];
  for (;;) {
    const ssize_t n = ::read(fd.get(), buffer, sizeof buffer);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return failed(path, "read", errno);
    if (n == 0) return bytes;
    bytes.append(buffer, static_cast<std::size_t>(n));
    if (bytes.size() > most)
      return error(ErrorCode::io, quoted(path) + " is larger than " + std::to_string(most) +
                                      " bytes, the most that is read");
  }
}

}  // namespace robomosp
