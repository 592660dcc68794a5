// SPDX-License-Identifier: Apache-2.0
// The interfaces of the two processes beside the remote calls, PluginDoor and HostDoor, and the
// numbers that identify either side's objects (layer: core, header-only).
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "kernel/provider_process/calls.h"
#include "kernel/provider_process/channel.h"
#include "kernel/provider_process/sdk_fields.h"

namespace robomosp::apart {

struct ProviderWire {
  std::string interface_id, name, summary, tags;
  std::vector<RowWire> params;
  std::string fault;  ///< why it cannot be used; may be empty
};
struct PluginWire {
  std::string id, version, license, summary;
  std::vector<ProviderWire> providers;
};
RMP_FIELDS(ProviderWire, interface_id, name, summary, tags, params, fault)
RMP_FIELDS(PluginWire, id, version, license, summary, providers)

/// Interface of a plugin's process: its object number 1.
class PluginDoor {
 public:
  virtual ~PluginDoor() = default;
  /// The plugin's tables, or the loader's error if it cannot be opened.
  virtual Result<PluginWire> describe() = 0;
  /// Creates the provider of a row; returns its number.
  virtual Result<std::uint64_t> create(std::uint32_t row) = 0;
};
template <>
struct Methods<PluginDoor> : MethodList<&PluginDoor::describe, &PluginDoor::create> {};

struct CreatedWire {
  std::uint64_t id = 0;
  std::string interface_id, name;
  std::vector<std::string> params;
};
struct ProgramWire {
  std::string name, input;
  std::vector<std::string> arguments;
  double seconds = 0;
  std::uint64_t memory = 0, most_output = 0;
};
struct ProgramDone {
  std::string output;
  std::vector<std::string> lines;
};
RMP_FIELDS(CreatedWire, id, interface_id, name, params)
RMP_FIELDS(ProgramWire, name, input, arguments, seconds, memory, most_output)
RMP_FIELDS(ProgramDone, output, lines)

/// Interface of the program: its object number 1. Serves rmp_host to the plugin as inside the
/// program.
class HostDoor {
 public:
  virtual ~HostDoor() = default;
  virtual void log(std::int32_t severity, const std::string& source, const std::string& words) = 0;
  virtual Result<CreatedWire> create(const std::string& interface_id, const std::string& name) = 0;
  virtual std::vector<std::pair<std::string, std::string>> list(
      const std::string& interface_id) = 0;
  virtual std::int32_t file_kind(const std::string& path) = 0;
  virtual Result<std::string> file_read(const std::string& path, std::uint64_t most) = 0;
  virtual Result<ProgramDone> run(const ProgramWire& program) = 0;
  virtual void release(std::uint64_t lent) = 0;
};
template <>
struct Methods<HostDoor>
    : MethodList<&HostDoor::log, &HostDoor::create, &HostDoor::list, &HostDoor::file_kind,
                 &HostDoor::file_read, &HostDoor::run, &HostDoor::release> {};

inline constexpr std::uint64_t kDoor = 1;

/// Objects of one side, by the numbers under which the other side knows them. [any thread]
class Table {
 public:
  struct Entry {
    void* object = nullptr;
    Serve serve = nullptr;
    /// What the object uses; destroyed after it.
    std::shared_ptr<std::vector<std::shared_ptr<const void>>> bound{};
    std::shared_ptr<void> owner;
    const void* scope = nullptr;  ///< the only conversation that may use it; null = all
    /// Serialises the calls of objects created by the other side.
    std::shared_ptr<std::recursive_mutex> in_turn;
  };
  std::uint64_t add(Entry entry) {
    const std::lock_guard lock(mutex_);
    entries_.emplace(++last_, std::move(entry));
    return last_;
  }
  void erase(std::uint64_t id) {
    Entry gone;  // destroyed after the lock
    const std::lock_guard lock(mutex_);
    if (const auto at = entries_.find(id); at != entries_.end()) {
      gone = std::move(at->second);
      entries_.erase(at);
    }
  }
  void keep(std::uint64_t id, std::shared_ptr<const void> what, bool is_in_place_of_the_last) {
    auto all = std::make_shared<std::vector<std::shared_ptr<const void>>>();
    const std::lock_guard lock(mutex_);
    const auto at = entries_.find(id);
    if (at == entries_.end()) return;
    if (at->second.bound && !is_in_place_of_the_last) *all = *at->second.bound;
    all->push_back(std::move(what));
    at->second.bound.swap(all);
  }
  [[nodiscard]] Entry find(std::uint64_t id) const {
    const std::lock_guard lock(mutex_);
    const auto at = entries_.find(id);
    return at == entries_.end() ? Entry{} : at->second;
  }

 private:
  mutable std::mutex mutex_;
  std::map<std::uint64_t, Entry> entries_;  // guarded by mutex_
  std::uint64_t last_ = 0;                  // guarded by mutex_
};

/// Replies to one request over the channel on which it arrived.
class Answering final : public Sink {
 public:
  /// `object` is the called object of `table`; `too_long` is the error sent if the reply exceeds
  /// the space of the channel.
  Answering(Peer& peer, Table& table, Channel& channel, std::uint64_t object, const char* too_long)
      : peer_(peer), table_(table), channel_(channel), object_(object), too_long_(too_long) {}
  void keep(std::shared_ptr<const void> what, bool is_in_place_of_the_last) override {
    table_.keep(object_, std::move(what), is_in_place_of_the_last);
  }
  void send(Reply& reply) override {
    Sizer sizer;
    reply.measure(sizer);
    char* place = channel_.place(sizer.size());
    if (!place) {
      FaultReply too_long(Outcome::threw, too_long_);
      return send(too_long);
    }
    Writer writer(peer_, place, sizer.size());
    reply.write(writer);
    channel_.post(Kind::answer, 0, 0, sizer.size());
  }

 private:
  Peer& peer_;
  Table& table_;
  Channel& channel_;
  std::uint64_t object_;
  const char* too_long_;
};

/// Control messages of the program, one per packet; the descriptor of a new channel is attached.
struct Control {
  enum class What : std::uint32_t { channel = 1, release = 2 };
  What what = What::channel;
  std::uint64_t id = 0;
};

}  // namespace robomosp::apart
