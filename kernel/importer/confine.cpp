// SPDX-License-Identifier: Apache-2.0
#include "kernel/importer/confine.h"

#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>
#include <string_view>

#include <fcntl.h>
#include <linux/landlock.h>
#include <sys/prctl.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

namespace {

constexpr int kNotStarted = 126;
constexpr std::uint64_t kReadFile = LANDLOCK_ACCESS_FS_READ_FILE;
constexpr std::uint64_t kRead = kReadFile | LANDLOCK_ACCESS_FS_READ_DIR;
constexpr std::uint64_t kRun = kRead | LANDLOCK_ACCESS_FS_EXECUTE;
// Rights of later versions, which headers of the oldest system that we build on need not know.
constexpr std::uint64_t kFirst = (std::uint64_t{1} << 13) - 1, kRefer = std::uint64_t{1} << 13,
                        kTruncate = std::uint64_t{1} << 14;

/// All rights that this system can take away.
std::uint64_t rights_of(long version) {
  return kFirst | (version >= 2 ? kRefer : 0) | (version >= 3 ? kTruncate : 0);
}

class Rules {
 public:
  explicit Rules(std::uint64_t handled) : handled_(handled) {
    landlock_ruleset_attr attributes{};
    attributes.handled_access_fs = handled;
    fd_ = static_cast<int>(::syscall(SYS_landlock_create_ruleset, &attributes,
                                     sizeof attributes.handled_access_fs, 0));
  }
  /// What is not there is left out.
  void allow(const char* path, std::uint64_t rights) const {
    const int at = ::open(path, O_PATH | O_CLOEXEC);
    struct stat s {};
    if (at < 0 || ::fstat(at, &s) != 0) return;
    if (!S_ISDIR(s.st_mode))
      rights &= kReadFile | LANDLOCK_ACCESS_FS_EXECUTE | LANDLOCK_ACCESS_FS_WRITE_FILE | kTruncate;
    landlock_path_beneath_attr rule{};
    rule.allowed_access = rights & handled_;
    rule.parent_fd = at;
    ::syscall(SYS_landlock_add_rule, fd_, LANDLOCK_RULE_PATH_BENEATH, &rule, 0);
    ::close(at);
  }
  [[nodiscard]] bool hold() const {
    return fd_ >= 0 && ::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0 &&
           ::syscall(SYS_landlock_restrict_self, fd_, 0) == 0;
  }

 private:
  std::uint64_t handled_;
  int fd_ = -1;
};

}  // namespace

int run_confined(int count, char** words) {
  const long version =
      ::syscall(SYS_landlock_create_ruleset, nullptr, 0, LANDLOCK_CREATE_RULESET_VERSION);
  if (version < 1) {
    std::fputs("this system cannot keep a program to a folder\n", stderr);
    return kNotStarted;
  }
  const std::uint64_t all = rights_of(version);
  const Rules rules(all);
  // What any program needs to start: libraries, and where they are.
  for (const char* folder : {"/lib", "/lib64", "/usr/lib", "/usr/lib64", "/usr/local/lib"})
    rules.allow(folder, kRun);
  for (const char* file : {"/etc/ld.so.cache", "/dev/urandom", "/usr/share/opencascade"})
    rules.allow(file, kRead);
  rules.allow("/dev/null", kReadFile | LANDLOCK_ACCESS_FS_WRITE_FILE | kTruncate);
  if (const char* more = std::getenv("LD_LIBRARY_PATH"))
    for (std::string_view rest = more; !rest.empty();) {
      const std::size_t end = std::min(rest.find(':'), rest.size());
      if (end > 0) rules.allow(std::string(rest.substr(0, end)).c_str(), kRun);
      rest.remove_prefix(std::min(end + 1, rest.size()));
    }
  int i = 0;
  for (; i + 1 < count && std::strcmp(words[i], "run") != 0; i += 2) {
    const std::string_view what = words[i];
    if (what == "own") {
      rules.allow(words[i + 1], all & ~std::uint64_t{LANDLOCK_ACCESS_FS_EXECUTE});
      ::setenv("TMPDIR", words[i + 1], 1);
    } else {
      rules.allow(words[i + 1], what == "code" ? kRun : kRead);
    }
  }
  if (i + 1 >= count) {
    std::fputs("robomosp-importer is started by robomosp.\n", stderr);
    return kNotStarted;
  }
  char** program = words + i + 1;
  // The program with the libraries that were installed with it: <prefix>/libexec/robomosp/NAME.
  rules.allow(*program, kRun);
  const std::string file = *program;
  if (const auto folder = file.find("/libexec/robomosp/"); folder != std::string::npos)
    rules.allow((file.substr(0, folder) + "/lib").c_str(), kRun);
  if (!rules.hold()) {
    std::fputs("the program could not be kept to a folder\n", stderr);
    return kNotStarted;
  }
  ::execv(*program, program);
  std::fprintf(stderr, "it could not be started: %s\n", std::strerror(errno));
  return kNotStarted;
}
