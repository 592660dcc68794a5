// SPDX-License-Identifier: Apache-2.0
// Channel: memory that this program and the process of a plugin share, with one message at a time
// in it, and whose turn it is (layer: core).
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include <robomosp/sdk/result.h>

namespace robomosp::apart {

/// What a message is.
enum class Kind : std::uint32_t { call = 1, answer = 2 };

/// Begins the shared memory. Each side writes what it says before it gives the turn away; what the
/// other side wrote is read once and held against the size of the memory.
struct Shared {
  std::atomic<std::uint32_t> turn;       ///< 0: the program's, 1: the process's
  std::atomic<std::uint32_t> asleep[2];  ///< who has to be woken
  std::atomic<std::uint32_t> cancelled;  ///< the user asked to stop
  std::uint32_t kind, method;
  std::uint64_t object, offset, size;
  // What the work reports of its progress; the last word holds.
  std::atomic<std::uint32_t> told;  ///< odd while it is written
  std::uint32_t what_size;
  double share;
  char what[200];
};

struct Message {
  Kind kind = Kind::call;
  std::uint32_t method = 0;
  std::uint64_t object = 0;
  char* bytes = nullptr;  ///< in the shared memory: the other side may change them
  std::uint64_t size = 0;
};

/// One conversation: calls, calls within calls and their answers, strictly in turn. [one thread at
/// a time]
class Channel {
 public:
  enum class Side : std::uint32_t { program = 0, process = 1 };
  static constexpr std::size_t kAlign = 64;

  /// Of the program, with memory of its own that may grow to `most` bytes and never shrinks, so
  /// that what is mapped stays there whatever the other side does.
  static Result<std::unique_ptr<Channel>> make(std::uint64_t most);
  /// Of the process; takes the descriptor over. Null = it cannot be mapped.
  static std::unique_ptr<Channel> open(int descriptor, std::uint64_t most);
  ~Channel();
  Channel(const Channel&) = delete;
  Channel& operator=(const Channel&) = delete;

  [[nodiscard]] int descriptor() const { return fd_; }
  [[nodiscard]] Shared& shared() const { return *shared_; }

  /// Room for a message above all that are in use; null = there is no more.
  [[nodiscard]] char* place(std::uint64_t size);
  /// Says what stands at the last place() and gives the turn away.
  void post(Kind kind, std::uint64_t object, std::uint32_t method, std::uint64_t size);
  /// Whether it is this side's turn, after waiting at most so long; < 0 = for good.
  [[nodiscard]] bool wait(int milliseconds);
  /// What the other side said; false = that is no message.
  [[nodiscard]] bool receive(Message& out);

  /// Messages above this place are not in use any more.
  [[nodiscard]] std::uint64_t top() const { return top_; }
  void set_top(std::uint64_t top);

 private:
  struct Segment {
    std::uint64_t offset = 0, size = 0;
    char* base = nullptr;
  };
  Channel(int fd, Side side, std::uint64_t most) : fd_(fd), side_(side), most_(most) {}
  [[nodiscard]] bool map(std::uint64_t offset, std::uint64_t size);
  [[nodiscard]] char* at(std::uint64_t offset, std::uint64_t size) const;
  [[nodiscard]] std::uint64_t file_size() const;

  int fd_;
  Side side_;
  std::uint64_t most_;
  std::uint64_t top_ = 0, placed_ = 0;
  Shared* shared_ = nullptr;
  std::vector<Segment> segments_;
};

}  // namespace robomosp::apart
