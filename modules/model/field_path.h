// SPDX-License-Identifier: Apache-2.0
// Paths to parts of a record: `links[3].mass`, `elbow.a`, `bore.position.x`, `tools.camera`,
// `parts.1.rpy.z` (layer: data processing, model). Elements of lists are addressed by index (from
// 1) or by name; fields declared flat or by names are also addressed without the field's own name.
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

/// The part of a record at a path.
struct Place {
  const Type* type = nullptr;
  void* data = nullptr;
  const Field* field = nullptr;          ///< the field, or the field of the element; null = the
                                         ///< record
  const void* owner = nullptr;           ///< the struct of `field`
  std::size_t component = kNoComponent;  ///< of numbers, reals, a colour or a setting
  std::size_t alternative = 0;           ///< of units, see Type::alternative
  /// True for numbers except read-only ones, parameters' values, and fields that do not apply.
  bool may_be_expression = true;
  bool is_shared = false;  ///< inside a part that versions of the record share

  /// The number of a component, a real or a real setting; null = not a number.
  [[nodiscard]] double* number() const;
  [[nodiscard]] std::string_view unit() const;  ///< SI; kAnyUnit of a provider's setting
};

/// The result's `data` is read-only.
[[nodiscard]] std::optional<Place> find(const Content&, std::string_view path);
/// Copies shared parts along the path, so that `data` may be written.
[[nodiscard]] std::optional<Place> find_for_change(const MutableContent&, std::string_view path);

/// One step of a path in memory: to a member of a struct, or to an element of a list. It contains
/// no names, so that following it takes constant time.
struct WayStep {
  const Field* member = nullptr;  ///< null = an element
  std::size_t element = 0;
};
using Way = std::vector<WayStep>;
/// The end of such a path, for writing; null if a list is shorter. Optional and shared values along
/// the path are entered, and created if missing.
[[nodiscard]] MutableContent follow_for_change(MutableContent, std::span<const WayStep>);

/// Visits every path with its canonical spelling: elements by their names if they have one, without
/// parts that may be omitted. Vectors are visited as a whole, then by component.
void for_each_path(const Content&, const std::function<void(const std::string&, const Place&)>&);
/// The canonical path of the number at `path`; `path` itself if it is not a number.
[[nodiscard]] std::string known_path(const Content&, std::string_view path);

/// Calls see() for every number of a record that can be an expression, in order of declaration,
/// with its canonical path. The path is only built if `wanted` returns true for the number.
void for_each_number(const Content&, const std::function<bool(const double&)>& wanted,
                     const std::function<void(const std::string& path, const double&)>& see);

/// One step of a path into a record, and its position in the text of the path.
struct PathStep {
  const Field* member = nullptr;  ///< of a structure; null = an element of a list
  std::size_t element = 0;
  std::size_t begin = 0, end = 0;  ///< of an element: its name or number in the text
};
/// The steps of a path through structures and lists; components and keys of tables are not steps.
/// Empty = the path does not exist.
[[nodiscard]] std::vector<PathStep> steps_of(const Content&, std::string_view path);

/// Name of component `i` of the numbers of a field: "x", "xx", "radius"; "" = it has none.
[[nodiscard]] std::string_view component_name(const Field&, const void* owner, std::size_t i);

/// Prefix for the elements of a list: "" if they are addressed by their names alone, or "tools.".
[[nodiscard]] std::string element_prefix(const Field& list);

}  // namespace robomosp::model
