// SPDX-License-Identifier: Apache-2.0
// What a Snapshot holds: records in chunks by id, a hashed name index per kind, reverse references;
// parts are shared between snapshots and copied only where they change (layer: application).
// Internal to modules/document.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string_view>
#include <vector>

#include "document/document.h"
#include "document/world_index.h"

namespace robomosp::document {

/// The object behind `p` for changing: a fresh copy unless nobody else holds it. Uniqueness must be
/// established from the root down, since a shared owner shares what it owns.
template <class T>
T& unique(std::shared_ptr<T>& p) {
  if (!p) {
    p = std::make_shared<T>();
  } else if (p.use_count() != 1) {
    p = std::make_shared<T>(*p);
  } else {
    // Another thread may have let go of it a moment ago; what it read happened before our writes.
    std::atomic_thread_fence(std::memory_order_acquire);
  }
  return *p;
}

/// The index of one version of a world, once it was asked for.
struct WorldNames {
  RecordPtr record;
  std::once_flag once;
  std::optional<WorldIndex> index;
};
/// Null where there is no world of that id.
[[nodiscard]] inline std::shared_ptr<WorldNames> names_of(const Snapshot& snapshot, AnyId id);

struct Snapshot::State {
  static constexpr std::size_t kChunk = 64;     ///< records a chunk
  static constexpr std::size_t kBuckets = 256;  ///< name buckets a kind

  struct Slot {
    RecordPtr record;
    std::shared_ptr<std::vector<AnyId>> referrers;  ///< ascending, each once; null = none
    std::shared_ptr<WorldNames> names;              ///< of a world
  };
  struct Chunk {
    std::array<Slot, kChunk> slots;
  };
  struct Name {
    std::uint64_t hash = 0, number = 0;
  };
  struct NameTable {
    std::array<std::shared_ptr<std::vector<Name>>, kBuckets> buckets;
  };

  std::uint64_t revision = 0;
  std::size_t count = 0;
  std::vector<std::shared_ptr<Chunk>> chunks;  ///< id n stands in chunk n / kChunk
  std::array<std::shared_ptr<NameTable>, std::size(kAllKinds)> names;
  std::shared_ptr<std::vector<AnyId>> users_of_worlds;  ///< ascending; null = none

  [[nodiscard]] const Slot* slot(std::uint64_t number) const;
  [[nodiscard]] const RecordPtr* find(AnyId id) const;
  [[nodiscard]] std::optional<AnyId> find(Kind kind, std::string_view name) const;

  friend std::shared_ptr<WorldNames> names_of(const Snapshot& snapshot, AnyId id) {
    return of(snapshot).find(id) ? of(snapshot).slot(id.number)->names : nullptr;
  }
  static const State& of(const Snapshot& snapshot) { return *snapshot.state_; }

  /// Puts a record in (or with null takes it out) and keeps names and reverse references.
  void put(AnyId id, RecordPtr record);

 private:
  Slot& slot_for_change(std::uint64_t number);
  void add_name(AnyId id, std::string_view name);
  void remove_name(AnyId id, std::string_view name);
  void note_use_of_worlds(AnyId id, bool was, bool is);
};

/// Ids a body refers to, ascending, each once.
[[nodiscard]] std::vector<AnyId> references(const model::Body& body);

}  // namespace robomosp::document
