// SPDX-License-Identifier: Apache-2.0
// Kinds of records and ids that name records (layer: data processing, model). Ids are 64-bit,
// increasing, never reused.
#pragma once

#include <compare>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string_view>

namespace robomosp {

/// Kinds of records. These have names here since code knows them; further ones have the numbers
/// that model::register_kind() gives them.
enum class Kind : std::uint8_t { material, solid, object, robot, trajectory, world, task };
/// The kinds that have names above.
inline constexpr std::size_t kNamedKinds = 7;

/// All kinds there are, in order of their numbers. [any thread]
[[nodiscard]] std::span<const Kind> all_kinds();
/// "robot"; "record" of a number that no kind has. [any thread]
[[nodiscard]] std::string_view to_string(Kind k);
[[nodiscard]] std::optional<Kind> kind_from(std::string_view word);

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
    return std::hash<std::uint64_t>{}(id.number * 64 + static_cast<std::uint64_t>(id.kind));
  }
};
