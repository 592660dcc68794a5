// SPDX-License-Identifier: Apache-2.0
// Members of worlds by name in constant time (layer: application). [any thread]
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string_view>
#include <unordered_map>

#include "document/document.h"

namespace robomosp::document {

/// The lists of a world with named members.
enum class MemberList : std::uint8_t {
  objects,
  robots,
  trajectories,
  frames,
  lights,
  tasks,
  programs,
  signals,
};
inline constexpr std::size_t kMemberLists = 8;

/// Positions of a world's named members in its lists. Immutable; the world must outlive it.
class WorldIndex {
 public:
  explicit WorldIndex(const model::World& world);
  /// Index in the list, or nothing.
  [[nodiscard]] std::optional<std::size_t> find(MemberList list, std::string_view name) const;

 private:
  std::array<std::unordered_map<std::string_view, std::size_t>, kMemberLists> at_;
};

/// The index of a world of a snapshot, built on first use and kept as long as this version of the
/// world; null if the world no longer exists. It keeps the world alive.
[[nodiscard]] std::shared_ptr<const WorldIndex> world_index(const Snapshot&, WorldId);

}  // namespace robomosp::document
