// SPDX-License-Identifier: Apache-2.0
// Liar: decides when a provider of a test returns a wrong result, and which, from a seed. At most
// one lie per command, so that the program's reaction can be checked. Its state may be in a file,
// for providers in another process.
#pragma once

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <functional>
#include <limits>
#include <new>
#include <random>
#include <stdexcept>
#include <string>
#include <thread>
#include <type_traits>
#include <utility>
#include <vector>

#include <robomosp/sdk/progress.h>
#include <robomosp/sdk/result.h>

namespace robomosp::test {

/// Whether a lie can be recognised from the result alone.
enum class Seen {
  surely,  ///< the command fails, or reports it: the provider is named
  maybe,   ///< the result may be taken for a correct one
};

/// A method of corrupting a result.
template <class T>
struct Lie {
  const char* what;
  Seen seen;
  std::function<void(T&)> spoil;
};
struct Nothing {};

class Liar {
 public:
  /// One for all providers of a program, and for processes with the same file in
  /// ROBOMOSP_LIAR_STATE. [any thread]
  static Liar& one() {
    static Liar liar(std::getenv("ROBOMOSP_LIAR_STATE"));
    return liar;
  }
  void seed(std::uint64_t s) {
    const Locked lock(state_);
    state_.random.seed(s);
  }
  /// From now on until the first lie, each result is a lie with this probability.
  void arm(double chance) {
    const Locked lock(state_);
    state_.chance = chance;
    state_.told[0] = '\0';
    state_.is_sure = false;
    state_.asked = 0;
  }
  void rest() { arm(0); }
  [[nodiscard]] std::string told() const {
    const Locked lock(state_);
    return state_.told;
  }
  [[nodiscard]] bool is_sure() const {
    const Locked lock(state_);
    return state_.is_sure;
  }
  /// Answers since arm().
  [[nodiscard]] std::size_t asked() const {
    const Locked lock(state_);
    return state_.asked;
  }

  std::size_t pick(std::size_t n) {
    const Locked lock(state_);
    return std::uniform_int_distribution<std::size_t>(0, n - 1)(state_.random);
  }
  /// NaN or infinite.
  double no_number() {
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    const double all[] = {std::numeric_limits<double>::quiet_NaN(), kInfinity, -kInfinity};
    return all[pick(3)];
  }
  /// Finite, and of no use.
  double wild() {
    const double all[] = {1e300, -1e300, 1.7e308, -1, 1e-300, 1e9, -1e9, 0};
    return all[pick(8)];
  }
  std::size_t wild_size() {
    const std::size_t all[] = {std::size_t{1} << 62, ~std::size_t{0}, std::size_t{1} << 40};
    return all[pick(3)];
  }
  std::string wild_text() {
    switch (pick(4)) {
      case 0: return {};
      case 1: return std::string(1'000'000, 'x');
      case 2: return std::string("\x1b[2J\x07\0\x9b", 7) + "31m\xff\xfe \x01";
      default: return "line\nline\r\x1b]0;title\x07";
    }
  }

  /// The result of a provider: `honest()`, or a lie. `progress` may be null.
  template <class T, class Call>
  Result<T> answer(const std::string& who, Progress* progress, Call&& honest,
                   std::vector<Lie<T>> lies) {
    if (!begins()) return honest();
    const std::size_t n = pick(2 * lies.size() + kCommon);
    if (n >= kCommon) {
      auto made = honest();
      if (!made.ok() || !told().empty()) return made;  // what it called may have lied
      const Lie<T>& lie = lies[(n - kCommon) / 2];
      tell(who, lie.what, lie.seen);
      lie.spoil(*made);
      return made;
    }
    if (auto fault = common(who, n, progress)) return std::move(*fault);
    return honest();
  }
  /// The same for functions that fill spans.
  template <class Call>
  Result<void> fill(const std::string& who, Progress* progress, Call&& honest,
                    std::vector<Lie<Nothing>> lies) {
    auto done = answer<Nothing>(
        who, progress,
        [&]() -> Result<Nothing> {
          RMP_TRY(honest());
          return Nothing{};
        },
        std::move(lies));
    if (!done.ok()) return std::move(done).error();
    return {};
  }
  /// For functions that cannot fail: the value, a lie or an exception.
  template <class T, class Call>
  T value(const std::string& who, Call&& honest, std::vector<Lie<T>> lies) {
    if (!begins()) return honest();
    const std::size_t n = pick(lies.size() + 2);
    if (n < lies.size()) {
      T made = honest();
      if (!told().empty()) return made;
      tell(who, lies[n].what, lies[n].seen);
      lies[n].spoil(made);
      return made;
    }
    tell(who, "an exception", Seen::surely);
    if (n == lies.size()) throw 42;
    throw std::runtime_error("thrown \x1b[31m");
  }

  /// Corrupts a value being passed on, or leaves it unchanged.
  template <class T>
  void spoil(const std::string& who, T& made, const std::vector<Lie<T>>& lies) {
    if (!begins()) return;
    const Lie<T>& lie = lies[pick(lies.size())];
    tell(who, lie.what, lie.seen);
    lie.spoil(made);
  }

 private:
  static constexpr std::size_t kCommon = 10;

  bool begins() {
    const Locked lock(state_);
    ++state_.asked;
    if (state_.told[0] != '\0') return false;
    return std::uniform_real_distribution<double>(0, 1)(state_.random) < state_.chance;
  }
  void tell(const std::string& who, const std::string& what, Seen seen) {
    const Locked lock(state_);
    const std::string words = who + ": " + what;
    state_.told[words.copy(state_.told, sizeof state_.told - 1)] = '\0';
    state_.is_sure = seen == Seen::surely;
  }
  /// A lie possible in any call; nothing = it continues honestly.
  std::optional<Error> common(const std::string& who, std::size_t n, Progress* progress) {
    switch (n) {
      case 0: tell(who, "an error without words", Seen::surely); return Error{};
      case 1:
        tell(who, "an error of strange words", Seen::maybe);
        return error(ErrorCode::plugin_failed, wild_text(), wild_text(), wild_text());
      case 2:
        tell(who, "an error of no known code", Seen::maybe);
        return error(static_cast<ErrorCode>(999), "it did not work");
      case 3:
        tell(who, "cancelled, though nobody did", Seen::maybe);
        return error(ErrorCode::cancelled, "cancelled");
      case 4:
        tell(who, "an exception of strange words", Seen::surely);
        throw std::runtime_error(wild_text());
      case 5: tell(who, "an exception that is an int", Seen::surely); throw 42;
      case 6: tell(who, "no memory", Seen::surely); throw std::bad_alloc();
      case 7: {
        if (!progress) return std::nullopt;
        tell(who, "it waits until it is cancelled", Seen::maybe);
        const auto begin = std::chrono::steady_clock::now();
        while (!progress->cancelled() &&
               std::chrono::steady_clock::now() - begin < std::chrono::seconds(3))
          std::this_thread::sleep_for(std::chrono::milliseconds(1));
        if (!progress->cancelled()) {
          tell(who, "it waited in vain for being cancelled", Seen::surely);
          return std::nullopt;
        }
        return error(ErrorCode::cancelled, "cancelled");
      }
      default:
        if (!progress) return std::nullopt;
        tell(who, "progress that is none", Seen::maybe);
        for (const double share : {no_number(), wild(), -1.0, 2.0, 0.5})
          progress->report(share, wild_text());
        return std::nullopt;
    }
  }

  /// Contains no pointers, so that processes can share it.
  struct State {
    std::atomic_flag is_locked;
    std::mt19937_64 random{1};
    double chance = 0;
    char told[400] = "";
    bool is_sure = false;
    std::size_t asked = 0;
  };
  static_assert(std::is_trivially_copyable_v<std::mt19937_64>);
  class Locked {
   public:
    explicit Locked(State& s) : s_(s) {
      while (s_.is_locked.test_and_set(std::memory_order_acquire)) std::this_thread::yield();
    }
    ~Locked() { s_.is_locked.clear(std::memory_order_release); }
    Locked(const Locked&) = delete;
    Locked& operator=(const Locked&) = delete;

   private:
    State& s_;
  };
  /// The first process creates the file; all begin from the same state.
  explicit Liar(const char* file) : state_(*shared(file)) {}
  static State* shared(const char* file) {
    static State own;
    if (!file) return &own;
    const int fd = ::open(file, O_RDWR | O_CLOEXEC);
    const bool is_new = fd < 0;
    const int made = is_new ? ::open(file, O_RDWR | O_CREAT | O_CLOEXEC, 0600) : fd;
    void* at = made >= 0 && ::ftruncate(made, sizeof(State)) == 0
                   ? ::mmap(nullptr, sizeof(State), PROT_READ | PROT_WRITE, MAP_SHARED, made, 0)
                   : MAP_FAILED;
    if (made >= 0) ::close(made);
    if (at == MAP_FAILED) std::abort();  // the test cannot know which lies were made
    return is_new ? new (at) State : static_cast<State*>(at);
  }
  State& state_;
};

}  // namespace robomosp::test
