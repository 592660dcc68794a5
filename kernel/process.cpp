// SPDX-License-Identifier: Apache-2.0
#include "kernel/process.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <system_error>
#include <utility>

#include "kernel/permit.h"
#include "kernel/plugin_loader.h"
#include "kernel/text.h"

#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

extern char** environ;

namespace robomosp {
namespace {

#if defined(__SANITIZE_ADDRESS__)
constexpr bool kLimitMemory = false;
#else
constexpr bool kLimitMemory = true;
#endif
constexpr std::size_t kLongestLine = 4096;
/// How soon a cancelled program is killed [ms].
constexpr int kTick = 50;

class Fd {
 public:
  Fd() = default;
  explicit Fd(int fd) : fd_(fd) {}
  Fd(Fd&& o) noexcept : fd_(std::exchange(o.fd_, -1)) {}
  Fd& operator=(Fd&& o) noexcept {
    std::swap(fd_, o.fd_);
    return *this;
  }
  ~Fd() { close(); }
  void close() {
    if (fd_ >= 0) ::close(std::exchange(fd_, -1));
  }
  [[nodiscard]] int get() const { return fd_; }
  [[nodiscard]] bool is_open() const { return fd_ >= 0; }

 private:
  int fd_ = -1;
};

Error system_error(const std::string& what) {
  return error(ErrorCode::io, what + ": " + std::strerror(errno),
               "Close other programs, or raise the limits of the system, and try again.");
}

/// A socket instead of a pipe where we write: send() can be told not to raise SIGPIPE.
Result<std::pair<Fd, Fd>> socket_pair() {
  int fd[2];
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, fd) != 0)
    return system_error("no socket could be made");
  return std::pair(Fd(fd[0]), Fd(fd[1]));
}
Result<std::pair<Fd, Fd>> pipe_pair() {
  int fd[2];
  if (::pipe2(fd, O_CLOEXEC) != 0) return system_error("no pipe could be made");
  return std::pair(Fd(fd[0]), Fd(fd[1]));
}

/// A running program; killed and waited for when it goes out of scope.
class Child {
 public:
  explicit Child(pid_t pid) : pid_(pid) {}
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;
  ~Child() {
    if (pid_ <= 0) return;
    kill();
    wait();
  }
  void kill() const {
    if (pid_ <= 0) return;
    ::kill(-pid_, SIGKILL);  // its own group: what it started goes too
    ::kill(pid_, SIGKILL);   // in case the group does not stand yet
  }
  int wait() {
    int status = 0;
    while (::waitpid(pid_, &status, 0) < 0 && errno == EINTR) {
    }
    pid_ = -1;
    return status;
  }
  [[nodiscard]] pid_t id() const { return pid_; }

 private:
  pid_t pid_;
};

void limit(pid_t pid, __rlimit_resource what, std::uint64_t value) {
  const rlimit both{static_cast<rlim_t>(value), static_cast<rlim_t>(value)};
  ::prlimit(pid, what, &both, nullptr);
}

Result<pid_t> spawn(const ProcessSpec& spec, int in, int out, int err) {
  const auto [pid, failed] = start_process(spec.program, spec.arguments, {in, out, err});
  if (failed == ENOENT)
    return error(ErrorCode::not_found,
                 "the program " + text::quote(spec.program.string()) + " is missing",
                 "Install the program again; it is a part of it.");
  if (failed != 0)
    return error(ErrorCode::io,
                 "the program " + text::quote(spec.program.string()) +
                     " cannot be started: " + std::strerror(failed),
                 "Check its permissions.");
  limit(pid, RLIMIT_CORE, 0);
  limit(pid, RLIMIT_CPU, static_cast<std::uint64_t>(std::max(1.0, spec.seconds)) + 1);
  if (kLimitMemory) limit(pid, RLIMIT_AS, spec.memory);
  return pid;
}

/// Cuts what comes into lines.
class Lines {
 public:
  explicit Lines(const std::function<void(std::string_view)>& hear) : hear_(hear) {}
  void add(std::string_view bytes) {
    for (const char c : bytes) {
      if (c == '\n') flush();
      else if (line_.size() < kLongestLine) line_ += c;
    }
  }
  void flush() {
    if (!line_.empty() && hear_) hear_(line_);
    line_.clear();
  }

 private:
  const std::function<void(std::string_view)>& hear_;
  std::string line_;
};

/// False at the end of the stream.
template <class Take>
bool read_some(const Fd& fd, Take&& take) {
  std::array<char, 65536> buffer;
  const ssize_t n = ::read(fd.get(), buffer.data(), buffer.size());
  if (n < 0) return errno == EINTR || errno == EAGAIN;
  if (n > 0) take(std::string_view(buffer.data(), static_cast<std::size_t>(n)));
  return n > 0;
}

Error too_slow(double seconds) {
  return error(ErrorCode::plugin_failed,
               "it took longer than " + text::print_rounded(seconds, 4) + " s and was stopped",
               "Give it more time, or a smaller file.");
}

/// What an exit status means; nothing when it went well.
Result<void> judge(int status, const ProcessSpec& spec) {
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return {};
  if (WIFEXITED(status))
    return error(ErrorCode::plugin_failed,
                 "it ended with exit code " + std::to_string(WEXITSTATUS(status)));
  const int signal = WIFSIGNALED(status) ? WTERMSIG(status) : 0;
  if (signal == SIGXCPU) return too_slow(spec.seconds);
  const char* name = ::sigabbrev_np(signal);
  return error(
      ErrorCode::plugin_failed,
      "it crashed (signal " + (name ? "SIG" + std::string(name) : std::to_string(signal)) + ")");
}

}  // namespace

Result<std::string> run_process(const ProcessSpec& spec, Progress& progress) {
  RMP_TRY(require(Effect::processes));
  RMP_TRY_ASSIGN(auto in, socket_pair());
  RMP_TRY_ASSIGN(auto out, pipe_pair());
  RMP_TRY_ASSIGN(auto err, pipe_pair());
  RMP_TRY_ASSIGN(const pid_t pid, spawn(spec, in.second.get(), out.second.get(), err.second.get()));
  Child child(pid);
  in.second.close();
  out.second.close();
  err.second.close();

  using Clock = std::chrono::steady_clock;
  const auto end = Clock::now() + std::chrono::duration_cast<Clock::duration>(
                                      std::chrono::duration<double>(std::min(spec.seconds, 1e8)));
  std::string output;
  std::string_view input = spec.input;
  std::string answers;  // that are not sent yet
  std::function<void(std::string_view)> hear = spec.line;
  if (spec.answer) hear = [&](std::string_view line) { answers += spec.answer(line); };
  Lines lines(hear);
  if (input.empty() && !spec.answer) in.first.close();
  while (out.first.is_open() || err.first.is_open()) {
    if (progress.cancelled()) {
      child.kill();
      return error(ErrorCode::cancelled, "stopped");
    }
    if (Clock::now() >= end) {
      child.kill();
      return too_slow(spec.seconds);
    }
    pollfd wait[3] = {{out.first.get(), POLLIN, 0},
                      {err.first.get(), POLLIN, 0},
                      // poll() skips those that are closed (-1)
                      {input.empty() && answers.empty() ? -1 : in.first.get(), POLLOUT, 0}};
    if (::poll(wait, 3, kTick) < 0 && errno != EINTR) return system_error("waiting failed");
    if (wait[0].revents != 0 &&
        !read_some(out.first, [&](std::string_view bytes) { output += bytes; }))
      out.first.close();
    if (output.size() > spec.most_output) {
      child.kill();
      return error(
          ErrorCode::plugin_failed,
          "it sent more than " + std::to_string(spec.most_output >> 20) + " MiB and was stopped",
          "Split the file.");
    }
    if (wait[1].revents != 0 &&
        !read_some(err.first, [&](std::string_view bytes) { lines.add(bytes); }))
      err.first.close();
    if (wait[2].revents != 0) {
      const std::string_view next = input.empty() ? std::string_view(answers) : input;
      const ssize_t n =
          ::send(in.first.get(), next.data(), next.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
      const bool broken = n < 0 && errno != EAGAIN && errno != EINTR;
      if (n > 0) {
        if (input.empty()) answers.erase(0, static_cast<std::size_t>(n));
        else input.remove_prefix(static_cast<std::size_t>(n));
      }
      if (broken) answers.clear(), input = {};
      if (broken || (input.empty() && !spec.answer)) in.first.close();
    }
  }
  lines.flush();
  in.first.close();
  // Both streams are closed; one that closed them and runs on is stopped at the limit.
  for (siginfo_t info{};;) {
    if (::waitid(P_PID, static_cast<id_t>(child.id()), &info, WEXITED | WNOHANG | WNOWAIT) == 0 &&
        info.si_pid != 0)
      break;
    if (progress.cancelled()) return error(ErrorCode::cancelled, "stopped");
    if (Clock::now() >= end) return too_slow(spec.seconds);
    ::poll(nullptr, 0, 1);
  }
  RMP_TRY(judge(child.wait(), spec));
  return output;
}

StartedProcess start_process(const std::filesystem::path& program,
                             std::vector<std::string> arguments, ProcessStreams streams,
                             bool with_environment) {
  std::string name = program.string();
  std::vector<char*> argv{name.data()};
  for (std::string& a : arguments) argv.push_back(a.data());
  argv.push_back(nullptr);
  std::array<char*, 1> nothing{nullptr};
  posix_spawn_file_actions_t files;
  posix_spawnattr_t attributes;
  ::posix_spawn_file_actions_init(&files);
  ::posix_spawnattr_init(&attributes);
  int to = 0;
  for (const int from : {streams.in, streams.out, streams.err}) {
    if (from >= 0) ::posix_spawn_file_actions_adddup2(&files, from, to);
    else
      ::posix_spawn_file_actions_addopen(&files, to, "/dev/null", to == 0 ? O_RDONLY : O_WRONLY, 0);
    ++to;
  }
  sigset_t none, all;
  ::sigemptyset(&none);
  ::sigfillset(&all);
  ::posix_spawnattr_setsigmask(&attributes, &none);
  ::posix_spawnattr_setsigdefault(&attributes, &all);
  ::posix_spawnattr_setpgroup(&attributes, 0);
  ::posix_spawnattr_setflags(
      &attributes, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF | POSIX_SPAWN_SETPGROUP);
  pid_t pid = -1;
  const int failed = ::posix_spawn(&pid, name.c_str(), &files, &attributes, argv.data(),
                                   with_environment ? environ : nothing.data());
  ::posix_spawnattr_destroy(&attributes);
  ::posix_spawn_file_actions_destroy(&files);
  return failed == 0 ? StartedProcess{pid, 0} : StartedProcess{-1, failed};
}

std::filesystem::path helper_program(std::string_view name) {
  return executable_folder().parent_path() / ROBOMOSP_LIBEXECDIR / "robomosp" / name;
}

std::filesystem::path program_on_path(std::string_view name) {
  const char* folders = std::getenv("PATH");
  for (const std::string_view folder : text::split(folders ? folders : "", ':')) {
    if (folder.empty()) continue;
    const std::filesystem::path program = std::filesystem::path(folder) / name;
    std::error_code ignored;
    if (std::filesystem::is_regular_file(program, ignored) && ::access(program.c_str(), X_OK) == 0)
      return program;
  }
  return {};
}

}  // namespace robomosp
