// SPDX-License-Identifier: Apache-2.0
#include "kernel/provider_process/channel.h"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <climits>
#include <cstring>
#include <ctime>
#include <string>
#include <thread>

#include <fcntl.h>
#include <linux/futex.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

namespace robomosp::apart {
namespace {

constexpr std::uint64_t kPage = 4096;
constexpr std::uint64_t kFirst = std::uint64_t{256} << 10;  ///< size of new memory [bytes]
/// Memory beyond this is given back when the conversation is over [bytes].
constexpr std::uint64_t kKept = std::uint64_t{64} << 20;
/// A short answer comes sooner than a thread is woken.
constexpr auto kSpin = std::chrono::microseconds(150);

static_assert(sizeof(Shared) <= kPage);
static_assert(std::atomic<std::uint32_t>::is_always_lock_free);

constexpr std::uint64_t up(std::uint64_t n, std::uint64_t to) { return (n + to - 1) / to * to; }

void relax() {
#if defined(__x86_64__) || defined(__i386__)
  __builtin_ia32_pause();
#endif
}

long futex(std::atomic<std::uint32_t>& word, int what, std::uint32_t value, const timespec* limit) {
  return ::syscall(SYS_futex, reinterpret_cast<std::uint32_t*>(&word), what, value, limit, nullptr,
                   0);
}

}  // namespace

Result<std::unique_ptr<Channel>> Channel::make(std::uint64_t most) {
  const auto failed = [](const char* what) {
    return error(ErrorCode::io, std::string(what) + ": " + std::strerror(errno),
                 "Close other programs, or raise the limits of the system, and try again.");
  };
  const int fd = static_cast<int>(
      ::syscall(SYS_memfd_create, "robomosp-provider", MFD_CLOEXEC | MFD_ALLOW_SEALING));
  if (fd < 0) return failed("no shared memory could be made");
  std::unique_ptr<Channel> out(new Channel(fd, Side::program, most));
  if (::ftruncate(fd, kFirst) != 0 || ::fcntl(fd, F_ADD_SEALS, F_SEAL_SHRINK | F_SEAL_SEAL) != 0 ||
      !out->map(0, kFirst))
    return failed("no shared memory could be made");
  return out;
}

std::unique_ptr<Channel> Channel::open(int descriptor, std::uint64_t most) {
  std::unique_ptr<Channel> out(new Channel(descriptor, Side::process, most));
  if (!out->map(0, kFirst)) return nullptr;
  return out;
}

Channel::~Channel() {
  for (const Segment& s : segments_) ::munmap(s.base, s.size);
  ::close(fd_);
}

std::uint64_t Channel::file_size() const {
  struct stat s {};
  return ::fstat(fd_, &s) == 0 && s.st_size > 0 ? static_cast<std::uint64_t>(s.st_size) : 0;
}

bool Channel::map(std::uint64_t offset, std::uint64_t size) {
  void* base =
      ::mmap(nullptr, size, PROT_READ | PROT_WRITE, MAP_SHARED, fd_, static_cast<off_t>(offset));
  if (base == MAP_FAILED) return false;
  segments_.push_back({offset, size, static_cast<char*>(base)});
  if (!shared_) {
    shared_ = reinterpret_cast<Shared*>(base);
    top_ = kPage;
  }
  return true;
}

char* Channel::at(std::uint64_t offset, std::uint64_t size) const {
  for (const Segment& s : segments_)
    if (offset >= s.offset && offset - s.offset <= s.size && size <= s.size - (offset - s.offset))
      return s.base + (offset - s.offset);
  return nullptr;
}

char* Channel::place(std::uint64_t size) {
  if (size > most_) return nullptr;
  placed_ = up(top_, kAlign);
  if (char* here = at(placed_, size)) return here;
  for (const Segment& s : segments_)
    if (s.offset >= placed_ && size <= s.size) {
      placed_ = s.offset;
      return s.base;
    }
  const std::uint64_t old = up(file_size(), kPage);
  const std::uint64_t more = up(std::max(size, old), kPage);
  placed_ = old;
  // Every message of a conversation may be that large.
  if (old > 4 * most_ || ::ftruncate(fd_, static_cast<off_t>(old + more)) != 0 || !map(old, more))
    return nullptr;
  return segments_.back().base;
}

void Channel::post(Kind kind, std::uint64_t object, std::uint32_t method, std::uint64_t size) {
  Shared& s = *shared_;
  s.kind = static_cast<std::uint32_t>(kind);
  s.object = object;
  s.method = method;
  s.offset = placed_;
  s.size = size;
  top_ = placed_ + size;
  const auto other = side_ == Side::program ? Side::process : Side::program;
  s.turn.store(static_cast<std::uint32_t>(other));
  if (s.asleep[static_cast<std::size_t>(other)].load() != 0)
    futex(s.turn, FUTEX_WAKE, INT_MAX, nullptr);
}

bool Channel::wait(int milliseconds) {
  static const bool has_others = std::thread::hardware_concurrency() > 1;
  const auto mine = static_cast<std::uint32_t>(side_);
  const auto is_mine = [&] { return shared_->turn.load() == mine; };
  if (is_mine()) return true;
  if (has_others) {
    const auto end = std::chrono::steady_clock::now() + kSpin;
    do {
      for (int i = 0; i < 32; ++i) {
        if (is_mine()) return true;
        relax();
      }
      std::this_thread::yield();  // the other side may be waiting for this core
    } while (std::chrono::steady_clock::now() < end);
  }
  std::atomic<std::uint32_t>& asleep = shared_->asleep[mine];
  asleep.store(1);
  const timespec limit{milliseconds / 1000, (milliseconds % 1000) * 1'000'000L};
  do {
    if (is_mine()) break;
    futex(shared_->turn, FUTEX_WAIT, 1 - mine, milliseconds < 0 ? nullptr : &limit);
  } while (milliseconds < 0 && !is_mine());
  asleep.store(0);
  return is_mine();
}

bool Channel::receive(Message& out) {
  const Shared& s = *shared_;
  const std::uint32_t kind = s.kind;
  const std::uint64_t offset = s.offset, size = s.size;
  out.kind = static_cast<Kind>(kind);
  out.method = s.method;
  out.object = s.object;
  out.size = size;
  if ((kind != 1 && kind != 2) || size > most_ || offset < kPage || offset % kAlign != 0 ||
      offset > 8 * most_ + kFirst)
    return false;
  out.bytes = at(offset, size);
  if (!out.bytes) {
    const std::uint64_t from = offset / kPage * kPage, end = file_size() / kPage * kPage;
    if (end > 8 * most_ + kFirst || end < from || size > end - from ||
        offset - from > end - from - size || !map(from, end - from))
      return false;
    out.bytes = at(offset, size);
  }
  top_ = offset + size;
  return out.bytes != nullptr;
}

void Channel::set_top(std::uint64_t top) {
  top_ = top;
  if (side_ != Side::program || top > kPage) return;
  for (const Segment& s : segments_)
    if (s.offset >= kKept) ::madvise(s.base, s.size, MADV_REMOVE);
}

}  // namespace robomosp::apart
