// SPDX-License-Identifier: Apache-2.0
// A program that the tests of the sandbox start in place of robomosp-lua; what it does is the name
// that it is called by:
//   call-NAME          locks itself down and tries that one system call
//   no-seccomp         is robomosp-lua on a system without seccomp
//   liar-SEED          says at random what robomosp-lua never would
// Descriptor 0 is a socket; after a call it says there what came of it.
#include <cerrno>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <random>
#include <string>
#include <string_view>
#include <vector>

#include <fcntl.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/time.h>
#include <unistd.h>

#include "lua/sandbox/lock_down.h"
#include "lua/sandbox/wire.h"

namespace {

using namespace robomosp;
namespace wire = lua::wire;

void say(std::string_view s) { (void)!::write(0, s.data(), s.size()); }

/// From here on the system has no seccomp: asking for it fails.
void lose_seccomp() {
  constexpr auto kCall = static_cast<std::uint32_t>(offsetof(seccomp_data, nr));
  constexpr auto kFirst = static_cast<std::uint32_t>(offsetof(seccomp_data, args));
  sock_filter code[] = {
      BPF_STMT(BPF_LD | BPF_W | BPF_ABS, kCall),
      BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, SYS_seccomp, 3, 0),
      BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, SYS_prctl, 0, 3),
      BPF_STMT(BPF_LD | BPF_W | BPF_ABS, kFirst),
      BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, PR_SET_SECCOMP, 0, 1),
      BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ERRNO | EINVAL),
      BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW),
  };
  sock_fprog program{sizeof code / sizeof code[0], code};
  ::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0);
  if (::prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &program) != 0) ::_exit(9);
}

/// A call that the sandbox lets through gives true.
bool is_answered(std::string_view call) {
  const auto n = [](long result) { return result >= 0; };
  if (call == "none") return true;
  if (call == "clock") {
    timespec t{};
    return n(::syscall(SYS_clock_gettime, CLOCK_PROCESS_CPUTIME_ID, &t));
  }
  if (call == "memory") {
    std::vector<char> some(std::size_t{64} << 20, 1);
    return some.back() == 1;
  }
  if (call == "too-much-memory")
    return ::mmap(nullptr, std::size_t{512} << 20, PROT_READ | PROT_WRITE,
                  MAP_PRIVATE | MAP_ANONYMOUS, -1, 0) != MAP_FAILED;
  static char path[] = "/etc/passwd";
  static char* none[] = {nullptr};
  if (call == "open") return n(::syscall(SYS_open, path, O_RDONLY));
  if (call == "openat") return n(::syscall(SYS_openat, AT_FDCWD, path, O_RDONLY));
  if (call == "openat2") return n(::syscall(SYS_openat2, AT_FDCWD, path, nullptr, 0));
  if (call == "stat") return n(::syscall(SYS_newfstatat, AT_FDCWD, path, nullptr, 0));
  if (call == "unlink") return n(::syscall(SYS_unlink, "/tmp/robomosp-no-such-file"));
  if (call == "mkdir") return n(::syscall(SYS_mkdir, "/tmp/robomosp-sandbox", 0700));
  if (call == "execve") return n(::syscall(SYS_execve, "/bin/true", none, none));
  if (call == "execveat") return n(::syscall(SYS_execveat, AT_FDCWD, "/bin/true", none, none, 0));
  if (call == "socket") return n(::syscall(SYS_socket, AF_INET, SOCK_STREAM, 0));
  if (call == "socketpair") {
    int pair[2];
    return n(::syscall(SYS_socketpair, AF_UNIX, SOCK_STREAM, 0, pair));
  }
  if (call == "connect") return n(::syscall(SYS_connect, 0, nullptr, 0));
  if (call == "sendmsg") return n(::syscall(SYS_sendmsg, 0, nullptr, 0));
  if (call == "fork") return n(::syscall(SYS_fork));
  if (call == "vfork") return n(::syscall(SYS_vfork));
  if (call == "clone") return n(::syscall(SYS_clone, SIGCHLD, 0, 0, 0, 0));
  if (call == "clone3") return n(::syscall(SYS_clone3, nullptr, 0));
  if (call == "kill") return n(::syscall(SYS_kill, ::getppid(), 0));
  if (call == "tgkill") return n(::syscall(SYS_tgkill, 1, 1, 0));
  if (call == "ptrace") return n(::syscall(SYS_ptrace, 0, 0, 0, 0));
  if (call == "process_vm_readv") return n(::syscall(SYS_process_vm_readv, 1, 0, 0, 0, 0, 0));
  if (call == "prctl") return n(::syscall(SYS_prctl, PR_SET_PDEATHSIG, 0, 0, 0, 0));
  if (call == "prlimit") return n(::syscall(SYS_prlimit64, 0, RLIMIT_CPU, nullptr, nullptr));
  if (call == "seccomp") return n(::syscall(SYS_seccomp, 0, 0, nullptr));
  if (call == "unshare") return n(::syscall(SYS_unshare, CLONE_NEWUSER));
  if (call == "mount") return n(::syscall(SYS_mount, nullptr, nullptr, nullptr, 0, nullptr));
  if (call == "bpf") return n(::syscall(SYS_bpf, 0, nullptr, 0));
  if (call == "io_uring_setup") return n(::syscall(SYS_io_uring_setup, 1, nullptr));
  if (call == "memfd_create") return n(::syscall(SYS_memfd_create, "x", 0));
  if (call == "dup") return n(::syscall(SYS_dup, 0));
  if (call == "ioctl") return n(::syscall(SYS_ioctl, 0, 0, 0));
  if (call == "read-1") return n(::syscall(SYS_read, 1, path, 1));
  if (call == "write-1") return n(::syscall(SYS_write, 1, path, 1));
  if (call == "write-2") return n(::syscall(SYS_write, 2, path, 1));
  if (call == "map-code")
    return ::mmap(nullptr, 4096, PROT_READ | PROT_WRITE | PROT_EXEC, MAP_PRIVATE | MAP_ANONYMOUS,
                  -1, 0) != MAP_FAILED;
  if (call == "map-file") return ::mmap(nullptr, 4096, PROT_READ, MAP_PRIVATE, 0, 0) != MAP_FAILED;
  if (call == "protect-code") {
    void* page = ::mmap(nullptr, 4096, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    return ::mprotect(page, 4096, PROT_READ | PROT_EXEC) == 0;
  }
  if (call == "x32") return n(::syscall(0x40000000L | SYS_getpid));
  ::_exit(8);
}

int try_call(std::string_view call) {
  lua::LockDown wanted;
  if (call.starts_with("without-")) {
    lose_seccomp();
    wanted.without_seccomp = true;
    call.remove_prefix(std::strlen("without-"));
  }
  const auto locked = lua::lock_down(wanted);
  if (!locked.ok()) return 7;
  say(locked->namespaces ? "in namespaces, " : "locked, ");
  say(is_answered(call) ? "answered" : "refused");
  ::_exit(0);
}

/// What passes as a message, or nearly.
class Liar {
 public:
  explicit Liar(unsigned seed) : random_(seed) {}
  int tell() {
    skip_frame();
    send(wire::Kind::ready, Map{{"seccomp", true}, {"namespaces", pick(2) == 0}});
    for (;;) {
      skip_frame();  // a text to run
      const std::size_t lies = pick(12);
      for (std::size_t i = 0; i < lies; ++i) lie();
      if (pick(4) == 0) ::raise(pick(2) == 0 ? SIGSEGV : SIGKILL);
      if (pick(4) == 0) ::_exit(static_cast<int>(pick(4)));
      send(wire::Kind::done, pick(3) == 0 ? any(0) : Value(Map{{"values", any(0)}}));
    }
  }

 private:
  std::size_t pick(std::size_t below) { return random_() % below; }

  static void skip_frame() {
    char header[wire::kHeader];
    std::size_t got = 0;
    while (got < sizeof header) {
      const ssize_t n = ::read(0, header + got, sizeof header - got);
      if (n <= 0) ::_exit(0);
      got += static_cast<std::size_t>(n);
    }
    std::uint32_t length = 0;
    std::memcpy(&length, header, sizeof length);
    std::string rest(65536, '\0');
    while (length > 0) {
      const ssize_t n = ::read(0, rest.data(), std::min<std::size_t>(length, rest.size()));
      if (n <= 0) ::_exit(0);
      length -= static_cast<std::uint32_t>(n);
    }
  }

  Value any(int depth) {
    switch (pick(depth > 5 ? 7 : 10)) {
      case 0: return {};
      case 1: return Value(pick(2) == 0);
      case 2: return Value(static_cast<std::int64_t>(random_()) - (std::int64_t{1} << 31));
      case 3: return Value(pick(2) == 0 ? 1e300 : std::strtod("nan", nullptr));
      case 4: return Value(std::string(pick(40), static_cast<char>(pick(256))));
      case 5: return Value(Handle{pick(2) == 0 ? "material" : "no such", pick(50)});
      case 6: return Value(NumericArray(std::vector<double>(pick(9), 1.0)));
      case 7: {
        List out;
        for (std::size_t n = pick(4); n > 0; --n) out.push_back(any(depth + 1));
        return Value(std::move(out));
      }
      default: {
        Map out;
        for (const char* key : {"id", "name", "density", "code", "values"})
          if (pick(3) == 0) out.set(key, any(depth + 1));
        return Value(std::move(out));
      }
    }
  }

  static void send_bytes(std::string_view bytes) {
    while (!bytes.empty()) {
      const ssize_t n = ::send(0, bytes.data(), bytes.size(), MSG_NOSIGNAL);
      if (n <= 0) ::_exit(0);
      bytes.remove_prefix(static_cast<std::size_t>(n));
    }
  }
  static void send(wire::Kind kind, const Value& v) {
    if (const auto frame = wire::frame(kind, v, wire::kLongestRequest)) send_bytes(*frame);
  }

  void lie() {
    static const char* const kNames[] = {
        "material.create", "material.list", "world.create", "document.undo",
        "robot.get",       "no.such",       "help",         ""};
    switch (pick(8)) {
      case 0: send(wire::Kind::request, any(0)); break;
      case 1: {  // bytes of a frame, some changed
        auto frame = wire::frame(
            wire::Kind::request,
            Map{{"ask", 0}, {"name", "material.create"}, {"args", Map{{"name", any(0)}}}}, 1 << 20);
        if (!frame) break;
        for (std::size_t n = 1 + pick(3); n > 0; --n)
          (*frame)[pick(frame->size())] = static_cast<char>(pick(256));
        send_bytes(*frame);
        break;
      }
      case 2: send_bytes(std::string("\xff\xff\xff\xffR", 5)); break;
      case 3: {  // a list that claims to be long, in itself
        std::string bytes;
        for (int i = 0; i < 60; ++i) bytes += std::string("\x08\x00\x00\x10\x00", 5);
        std::string frame(5, '\0');
        const auto length = static_cast<std::uint32_t>(bytes.size());
        std::memcpy(frame.data(), &length, sizeof length);
        frame[4] = 'R';
        send_bytes(frame + bytes);
        break;
      }
      case 4: send(wire::Kind::print, any(0)); break;
      default:
        send(wire::Kind::request,
             Map{{"ask", static_cast<std::int64_t>(pick(9))},
                 {"name", kNames[pick(std::size(kNames))]},
                 {"args", pick(3) == 0 ? any(0)
                                       : Value(Map{{"name", "stolen" + std::to_string(pick(5))},
                                                   {"density", 1000.0}})}});
        if (pick(2) == 0) skip_frame();
    }
  }

  std::minstd_rand random_;
};

}  // namespace

int main(int, char** argv) {
  const std::string path = argv[0];
  const std::string name = path.substr(path.rfind('/') + 1);
  if (name.starts_with("call-")) return try_call(std::string_view(name).substr(5));
  if (name.starts_with("liar-"))
    return Liar(static_cast<unsigned>(std::strtoul(name.c_str() + 5, nullptr, 10))).tell();
  if (name == "no-seccomp") {
    lose_seccomp();
    static char program[] = SANDBOX_PROGRAM;
    argv[0] = program;
    ::execv(program, argv);
  }
  return 9;
}
