// SPDX-License-Identifier: Apache-2.0
// What a Snapshot holds: records in pages of chunks by id, a hashed name index per kind, reverse
// references; parts are shared between snapshots and copied only where they change (layer:
// application). Internal to modules/document.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "document/document.h"
#include "document/world_index.h"
#include "kernel/unique.h"

namespace robomosp::document {

/// The index of one version of a world, built on first use.
struct WorldNames {
  RecordPtr record;
  std::once_flag once;
  std::optional<WorldIndex> index;
};
/// Null if no world has that id.
[[nodiscard]] inline std::shared_ptr<WorldNames> names_of(const Snapshot& snapshot, AnyId id);
/// As each_record() of each_record.h.
inline void visit_records(const Snapshot&, std::span<const Kind> kinds,
                          const std::function<bool(AnyId, const Record&)>& see);
/// As changed_records() of changed.h.
[[nodiscard]] inline std::vector<AnyId> differing(const Snapshot& before, const Snapshot& after);

struct Snapshot::State {
  /// An edit copies one chunk and one page, which are small, so that they come from lists of free
  /// blocks, and the list of pages.
  static constexpr std::size_t kChunk = 16;     ///< records a chunk
  static constexpr std::size_t kPage = 32;      ///< chunks a page
  static constexpr std::size_t kBuckets = 256;  ///< name buckets a kind

  struct Slot {
    RecordPtr record;
    std::shared_ptr<std::vector<AnyId>> referrers;  ///< ascending, each once; null = none
    std::shared_ptr<WorldNames> names;              ///< of a world
  };
  struct Chunk {
    std::array<Slot, kChunk> slots;
  };
  struct Page {
    std::array<std::shared_ptr<Chunk>, kPage> chunks;
  };
  struct Name {
    std::uint64_t hash = 0, number = 0;
  };
  struct NameTable {
    std::array<std::shared_ptr<std::vector<Name>>, kBuckets> buckets;
  };

  std::uint64_t revision = 0;
  std::size_t count = 0;
  std::vector<std::shared_ptr<Page>> pages;             ///< id n is in chunk n / kChunk of all
  std::vector<std::shared_ptr<NameTable>> names;        ///< by kind, sized by the number of records
  std::shared_ptr<std::vector<AnyId>> users_of_worlds;  ///< ascending; null = none

  [[nodiscard]] static constexpr std::uint32_t bit(Kind kind) {
    return std::uint32_t{1} << static_cast<unsigned>(kind);
  }
  [[nodiscard]] std::vector<AnyId> list(std::uint32_t kinds) const;  ///< in order of creation
  [[nodiscard]] const Slot* slot(std::uint64_t number) const;
  [[nodiscard]] const RecordPtr* find(AnyId id) const;
  [[nodiscard]] std::optional<AnyId> find(Kind kind, std::string_view name) const;

  friend std::shared_ptr<WorldNames> names_of(const Snapshot& snapshot, AnyId id) {
    (void)snapshot.find(id);  // so that it counts as read
    return of(snapshot).find(id) ? of(snapshot).slot(id.number)->names : nullptr;
  }
  friend void visit_records(const Snapshot& snapshot, std::span<const Kind> kinds,
                            const std::function<bool(AnyId, const Record&)>& see) {
    std::uint32_t bits = 0;
    for (const Kind k : kinds) bits |= bit(k);
    visit(snapshot, bits, see);
  }
  friend std::vector<AnyId> differing(const Snapshot& before, const Snapshot& after) {
    return differing_records(of(before), of(after));
  }
  static const State& of(const Snapshot& snapshot) { return *snapshot.state_; }
  static void visit(const Snapshot&, std::uint32_t kinds,
                    const std::function<bool(AnyId, const Record&)>& see);
  static std::vector<AnyId> differing_records(const State& before, const State& after);

  /// Inserts a record (null removes it) and updates names and reverse references.
  void put(AnyId id, RecordPtr record);
  /// Updates the references of these records again, for records inserted before those they refer
  /// to.
  void relink(const std::vector<AnyId>& ids);
  /// True if a record refers to another one; false for a missing record.
  [[nodiscard]] bool refers(AnyId from, AnyId to) const;
  /// Records that refer to a missing one; ascending.
  [[nodiscard]] std::vector<AnyId> dangling(AnyId id) const;

 private:
  /// Calls see(AnyId, const Record&) for the records of these kinds in order of creation, until it
  /// returns false.
  template <class See>
  void each(std::uint32_t kinds, const See& see) const;
  Slot& slot_for_change(std::uint64_t number);
  void add_name(AnyId id, std::string_view name);
  void remove_name(AnyId id, std::string_view name);
  void note_use_of_worlds(AnyId id, bool was, bool is);
};

/// The reads made through a snapshot: enough to decide later whether they would see the same. [any
/// thread]
struct Snapshot::Reads {
  void record(AnyId id);
  void name(Kind kind, std::string_view name);
  void referrers_of(AnyId id);
  void list(std::uint32_t kinds);  ///< bits by kind
  void users_of_worlds();
  void join(const Reads& more);
  struct Difference {
    std::string what;  ///< `robot "pa10" was changed`
    AnyId id;          ///< the record; number 0 if it is not a single record
  };
  /// The first read with a different result in the two states; nullopt if there is none.
  [[nodiscard]] std::optional<Difference> difference(const State& before, const State& now) const;
  static constexpr std::uint32_t kAllLists = ~std::uint32_t{0};

 private:
  mutable std::mutex mutex_;
  // Guarded by mutex_:
  std::vector<AnyId> records_, referrers_;
  std::vector<bool> is_known_;  ///< by number: in records_
  std::set<std::pair<Kind, std::string>> names_;
  std::uint32_t lists_ = 0;
  bool users_of_worlds_ = false;
};

}  // namespace robomosp::document
