// SPDX-License-Identifier: Apache-2.0
// Channel: memory that this program and the process of a plugin share, which holds one message at a
// time, and the turn of the two sides (layer: core).
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include <robomosp/sdk/result.h>

namespace robomosp::apart {

/// Kind of a message.
enum class Kind : std::uint32_t { call = 1, answer = 2 };

/// The start of the shared memory. Each side writes its message before it passes the turn; what the
/// other side wrote is read once and checked against the size of the memory.
struct Shared {
  std::atomic<std::uint32_t> turn;       ///< 0: the program's, 1: the process's
  std::atomic<std::uint32_t> asleep[2];  ///< which side has to be woken
  std::atomic<std::uint32_t> cancelled;  ///< the user asked to stop
  std::uint32_t kind, method;
  std::uint64_t object, offset, size;
  // Progress of the work; only the latest report counts.
  std::atomic<std::uint32_t> told;  ///< odd during a write
  std::uint32_t what_size;
  double share;
  char what[200];
};

struct Message {
  Kind kind = Kind::call;
  std::uint32_t method = 0;
  std::uint64_t object = 0;
  char* bytes = nullptr;  ///< in the shared memory: the other side may change it
  std::uint64_t size = 0;
};

/// One conversation: calls, nested calls and their replies, strictly in turn. [one thread at a
/// time]
class Channel {
 public:
  enum class Side : std::uint32_t { program = 0, process = 1 };
  static constexpr std::size_t kAlign = 64;

  /// The program's end: allocates memory that may grow to `most` bytes and never shrinks, so that
  /// its mapping stays valid whatever the other side does.
  static Result<std::unique_ptr<Channel>> make(std::uint64_t most);
  /// The plugin process's end; takes ownership of the descriptor. Null = it cannot be mapped.
  static std::unique_ptr<Channel> open(int descriptor, std::uint64_t most);
  ~Channel();
  Channel(const Channel&) = delete;
  Channel& operator=(const Channel&) = delete;

  [[nodiscard]] int descriptor() const { return fd_; }
  [[nodiscard]] Shared& shared() const { return *shared_; }

  /// Space for a message above all those in use; null = there is no more.
  [[nodiscard]] char* place(std::uint64_t size);
  /// Sends the message written at the last place() and passes the turn.
  void post(Kind kind, std::uint64_t object, std::uint32_t method, std::uint64_t size);
  /// True if it is this side's turn, after waiting at most this long; < 0 = no limit.
  [[nodiscard]] bool wait(int milliseconds);
  /// The message of the other side; false = malformed.
  [[nodiscard]] bool receive(Message& out);

  /// Messages above this offset are no longer in use.
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
