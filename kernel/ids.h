// SPDX-License-Identifier: Apache-2.0
// Ids of records: 64-bit, increasing, never reused, with the kind of the record (layer: core).
#pragma once

#include <compare>
#include <cstdint>
#include <functional>
#include <optional>
#include <string_view>

namespace robomosp {

/// Kinds of records a document holds.
enum class Kind : std::uint8_t { material, solid, object, robot, trajectory, world, task };
inline constexpr Kind kAllKinds[] = {Kind::material,   Kind::solid, Kind::object, Kind::robot,
                                     Kind::trajectory, Kind::world, Kind::task};

[[nodiscard]] constexpr std::string_view to_string(Kind k) {
  switch (k) {
    case Kind::material: return "material";
    case Kind::solid: return "solid";
    case Kind::object: return "object";
    case Kind::robot: return "robot";
    case Kind::trajectory: return "trajectory";
    case Kind::world: return "world";
    case Kind::task: return "task";
  }
  return "record";
}
[[nodiscard]] constexpr std::optional<Kind> kind_from(std::string_view word) {
  for (const Kind k : kAllKinds)
    if (to_string(k) == word) return k;
  return std::nullopt;
}

/// Id of a record of any kind; `number` 0 is no record.
struct AnyId {
  Kind kind = Kind::material;
  std::uint64_t number = 0;
  explicit operator bool() const { return number != 0; }
  auto operator<=>(const AnyId&) const = default;
};

/// Id of a record of one kind; a distinct type per kind, so that they cannot be mixed up.
template <Kind K>
struct Id {
  std::uint64_t number = 0;
  explicit operator bool() const { return number != 0; }
  operator AnyId() const { return {K, number}; }  // NOLINT: every Id is an AnyId
  auto operator<=>(const Id&) const = default;
};

using MaterialId = Id<Kind::material>;
using SolidId = Id<Kind::solid>;
using ObjectId = Id<Kind::object>;
using RobotId = Id<Kind::robot>;
using TrajectoryId = Id<Kind::trajectory>;
using WorldId = Id<Kind::world>;
using TaskId = Id<Kind::task>;

}  // namespace robomosp

template <>
struct std::hash<robomosp::AnyId> {
  std::size_t operator()(const robomosp::AnyId& id) const noexcept {
    return std::hash<std::uint64_t>{}(id.number * 8 + static_cast<std::uint64_t>(id.kind));
  }
};
