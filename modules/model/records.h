// SPDX-License-Identifier: Apache-2.0
// The records a user can save: materials, solids, objects, robots, trajectories, worlds, tasks, and
// kinds that registered (layer: data processing, model). Plain values; other records are named by
// id only. SI and radians.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "kernel/fingerprint.h"
#include "model/basics.h"
#include "model/fields.h"
#include "model/kept_solver.h"
#include "model/kind.h"
#include "model/material.h"
#include "model/object.h"
#include "model/robot.h"
#include "model/solid.h"
#include "model/task.h"
#include "model/trajectory.h"
#include "model/world.h"

namespace robomosp::model {

/// Content of a record of a kind that registered (register_kind()). A value: copies are deep.
class OtherContent {
 public:
  /// A default-constructed one.
  explicit OtherContent(Kind kind);
  /// `T` is the struct that the kind was registered with.
  template <class T>
  OtherContent(Kind kind, T value) : kind_(kind), value_(std::make_shared<T>(std::move(value))) {}
  OtherContent(const OtherContent&);
  OtherContent(OtherContent&&) noexcept = default;
  OtherContent& operator=(const OtherContent&);
  OtherContent& operator=(OtherContent&&) noexcept = default;
  ~OtherContent() = default;

  [[nodiscard]] Kind kind() const { return kind_; }
  [[nodiscard]] const void* data() const { return value_.get(); }
  [[nodiscard]] void* data() { return value_.get(); }
  template <class T>
  [[nodiscard]] const T& as() const {
    return *static_cast<const T*>(data());
  }
  template <class T>
  [[nodiscard]] T& as() {
    return *static_cast<T*>(data());
  }

 private:
  Kind kind_;
  std::shared_ptr<void> value_;  ///< ours alone
};

/// In order of Kind; what has no name there is OtherContent.
using Body = std::variant<Material, Solid, Object, Robot, Trajectory, World, Task, OtherContent>;

[[nodiscard]] inline Kind kind_of_body(const Body& body) {
  const auto* other = std::get_if<OtherContent>(&body);
  return other ? other->kind() : static_cast<Kind>(body.index());
}

/// A record: a name, unique per kind, and its content. Immutable once in a document.
struct Record {
  std::string name;
  std::string file;  ///< where it was loaded from or saved to; "" = never
  Body body;
  /// Of the bytes of `file` as they were read or written last; all 0 = not known.
  Fingerprint disk{};
  /// Written in Lua, travelling in its file; one an interface and name.
  std::vector<KeptSolver> solvers{};
  [[nodiscard]] Kind kind() const { return kind_of_body(body); }
};

/// Where the record chooses the provider `from` of an interface, it chooses `to`.
void rename_choices(Body& body, std::string_view interface, const std::string& from,
                    const std::string& to);
/// Whether the record chooses that provider anywhere.
[[nodiscard]] bool chooses(const Body& body, std::string_view interface, std::string_view name);

namespace detail {
template <class R, class B>
struct IndexIn;
template <class R, class... T>
struct IndexIn<R, std::variant<T...>> {
  static constexpr std::size_t value = [] {
    constexpr bool is_same[] = {std::is_same_v<R, T>...};
    std::size_t i = 0;
    while (!is_same[i]) ++i;
    return i;
  }();
};
}  // namespace detail
/// Kind of a record type: kind_of<Solid> == Kind::solid.
template <class R>
inline constexpr Kind kind_of = static_cast<Kind>(detail::IndexIn<R, Body>::value);

/// Calls fn(AnyId, std::string_view where) for every record that `body` refers to, in order;
/// `where` is the name of the element that does, or else of the field.
void for_each_reference(const Body& body, const std::function<void(AnyId, std::string_view)>& fn);

}  // namespace robomosp::model
