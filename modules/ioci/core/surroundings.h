// SPDX-License-Identifier: Apache-2.0
// Surroundings: events about what a window shows besides records: providers and
// their defaults, which records are not saved, settings, the memory of the machine
// (layer: application).
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "document/document.h"
#include "kernel/registry.h"
#include "kernel/value.h"

namespace robomosp::ioci {

class Application;
class Session;

/// Memory of the machine, or of the group of processes that is bounded together. [bytes]
struct MemoryState {
  std::uint64_t total = 0, available = 0;
  std::uint64_t used = 0;  ///< by this program
};
/// As the system reports it now; nullopt = it does not.
[[nodiscard]] std::optional<MemoryState> read_memory();
/// The part of /proc/meminfo, /proc/self/statm and the bounds of the control group ("" or "max" =
/// none) that read_memory() reads.
[[nodiscard]] std::optional<MemoryState> parse_memory(std::string_view meminfo,
                                                      std::string_view statm,
                                                      std::uint64_t page_bytes,
                                                      std::string_view group_limit,
                                                      std::string_view group_used);
enum class MemoryLevel : std::uint8_t { fine, low, critical };
[[nodiscard]] std::string_view to_string(MemoryLevel);
/// Low below a tenth of all that is available, critical below a twentieth; it rises again half as
/// much above that, so that it does not flicker.
[[nodiscard]] MemoryLevel level_of(const MemoryState&, MemoryLevel before);

/// Topics of events that Surroundings publishes.
inline constexpr std::uint32_t kSurroundings =
    bit(Topic::provider) | bit(Topic::unsaved) | bit(Topic::memory) | bit(Topic::setting);

/// Kept with the application (Application::kept()). It publishes events of the topics provider,
/// unsaved, setting and memory, and does nothing while nobody wants them. Providers and memory are
/// looked at where commands, jobs and commits end, memory once a second at most; the records that
/// changed are compared with their files by a task of the executor. [any thread]
class Surroundings {
 public:
  explicit Surroundings(Application& app);
  ~Surroundings();  ///< waits for its task
  Surroundings(const Surroundings&) = delete;
  Surroundings& operator=(const Surroundings&) = delete;
  /// To be called before somebody subscribes to these topics (bits by Topic): changes of providers
  /// made before are not published later.
  void prepare(std::uint32_t topics);
  /// To be called after somebody subscribed to these topics: what changes from now on is published.
  /// Of unsaved also what is not saved now.
  void begin(std::uint32_t topics);
  /// Something has happened.
  void look();
  void committed(const document::Commit&);

 private:
  struct Provider {
    bool enabled = true;
    std::string origin;
    bool operator==(const Provider&) const = default;
  };
  using Providers = std::map<std::pair<std::string, std::string>, Provider>;
  void look_at_providers();
  void look_at_memory();
  void compare();  // the task
  Application& app_;
  std::mutex mutex_;
  // Guarded by mutex_:
  std::optional<std::uint64_t> registry_revision_;
  Providers providers_;
  std::map<std::string, Registry::Choice> chosen_;
  std::chrono::steady_clock::time_point next_look_{};
  MemoryLevel level_ = MemoryLevel::fine;
  std::set<AnyId> changed_;  ///< records that are to be compared
  bool is_whole_ = true;     ///< all are to be compared
  bool is_comparing_ = false, is_ending_ = false;
  std::condition_variable wake_;
  std::set<AnyId> unsaved_;  ///< of the task
};

/// Publishes that a session has set a setting of the program.
void tell_setting(Application& app, Session& session, std::string_view name, Value value);

}  // namespace robomosp::ioci
