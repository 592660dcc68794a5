// SPDX-License-Identifier: Apache-2.0
// Paths to what is in a record: `links[3].mass`, `elbow.a`, `bore.position.x`, `tools.camera`,
// `parts.1.rpy.z` (layer: data processing, model). Elements of lists are named by place (from 1) or
// by name; what a declaration calls flat or by names is addressed without the field's own name too.
// [any thread]
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "model/data.h"

namespace robomosp::model {

inline constexpr std::size_t kNoComponent = static_cast<std::size_t>(-1);

/// What a path names.
struct Place {
  const Type* type = nullptr;
  void* data = nullptr;
  const Field* field = nullptr;          ///< that it is, or is an element of; null = the record
  const void* owner = nullptr;           ///< the struct of `field`
  std::size_t component = kNoComponent;  ///< of numbers, reals, a colour or a setting
  std::size_t alternative = 0;           ///< of units, see Type::alternative
  /// Its numbers: all but read-only ones, parameters' values, and fields that do not count.
  bool may_be_expression = true;
  bool is_shared = false;  ///< inside of what versions of the record share

  /// The number of a component, a real or a setting that is a real; null = it is none.
  [[nodiscard]] double* number() const;
  [[nodiscard]] std::string_view unit() const;  ///< SI; kAnyUnit of a provider's setting
};

/// Its `data` must not be written through.
[[nodiscard]] std::optional<Place> find(const Content&, std::string_view path);
/// What is shared on the way is copied, so that `data` may be written.
[[nodiscard]] std::optional<Place> find_for_change(const MutableContent&, std::string_view path);

/// One step of a way into a record: to a member of a struct, or to an element of a list. A way
/// names nothing, so that following it takes the same time wherever it leads.
struct WayStep {
  const Field* member = nullptr;  ///< null = an element
  std::size_t element = 0;
};
using Way = std::vector<WayStep>;
/// What stands at the end of a way, to be written; null where a list is shorter. What is optional
/// or shared on the way is entered, and made where it is not there.
[[nodiscard]] MutableContent follow_for_change(MutableContent, std::span<const WayStep>);

/// Every place that a path names, with the path by which it is known: elements by their names where
/// they have any, nothing that may be left out. Numbers come as a whole, then one by one.
void for_each_path(const Content&, const std::function<void(const std::string&, const Place&)>&);
/// The path by which the number at `path` is known; `path` itself when it names none.
[[nodiscard]] std::string known_path(const Content&, std::string_view path);

/// Calls see() for every number of a record that can be an expression, in order of declaration,
/// with the path by which it is known. The path is only built if `wanted` returns true for the
/// number.
void for_each_number(const Content&, const std::function<bool(const double&)>& wanted,
                     const std::function<void(const std::string& path, const double&)>& see);

/// One step of a path into a record, and where it is written in the path's text.
struct PathStep {
  const Field* member = nullptr;  ///< of a structure; null = an element of a list
  std::size_t element = 0;
  std::size_t begin = 0, end = 0;  ///< of an element: its name or number in the text
};
/// The steps to what a path names, as far as they lead through structures and lists; components and
/// keys of tables are none. Empty = the path names nothing.
[[nodiscard]] std::vector<PathStep> steps_of(const Content&, std::string_view path);

/// Name of component `i` of the numbers of a field: "x", "xx", "radius"; "" = it has none.
[[nodiscard]] std::string_view component_name(const Field&, const void* owner, std::size_t i);

/// Where the elements of a list are addressed: "" in front of their names, or "tools.".
[[nodiscard]] std::string element_prefix(const Field& list);

}  // namespace robomosp::model
