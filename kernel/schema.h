// SPDX-License-Identifier: Apache-2.0
// Schemas: the parameters of a command or provider, and checks of Values against them (layer:
// core).
#pragma once

#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <robomosp/sdk/params.h>
#include <robomosp/sdk/plugin.h>
#include <robomosp/sdk/result.h>

#include "kernel/value.h"

namespace robomosp {

/// One parameter. Types:
///   bool, int, real, string, enum, path
///   real[]      list of reals, one unit for all ("3 mm" allowed per entry)
///   vec3        three reals; the unit may be one for each: "m, rad, m"
///   pose        {position|cylindrical|spherical = vec3, rpy|xyz|zyz = vec3 [rad]} (or quaternion =
///               {w, x, y, z}, or axis_angle = {x, y, z, angle}) or 4x4 matrix or a flat list
///               {x, y, z, roll, pitch, yaw}; normalised to a 4x4 matrix NumericArray
///   matrix      rows of reals
///   list, map, any
///   ref:<kind>  handle or name of a record of that kind ("ref:robot", "ref:solid|object");
///               normalised to a Handle
struct ParamSpec {
  std::string name;
  std::string type;
  std::string unit;  ///< SI; "" = dimensionless
  std::string doc;
  std::optional<Value> default_value;  ///< empty and required = must be given
  bool required = false;
  std::vector<std::string> choices;  ///< words of an enum
  double min = -std::numeric_limits<double>::infinity();
  double max = std::numeric_limits<double>::infinity();
  bool infinite = false;  ///< inf and -inf are allowed within min..max; NaN never is
  std::string label{};    ///< shown instead of the name: "Damping"; empty = the name
  std::string group{};    ///< heading it is shown under; empty = none
};

/// `min` of a quantity that must be greater than 0.
inline constexpr double kPositive = std::numeric_limits<double>::denorm_min();

using Schema = std::vector<ParamSpec>;
/// The parameter of that name; null = there is none. [any thread]
[[nodiscard]] const ParamSpec* find_param(const Schema&, std::string_view name);

/// Converts a name or handle to a Handle of one of the kinds; the error suggests similar names.
using ResolveRef = std::function<Result<Handle>(std::string_view kinds, const Value&)>;

/// Checks `given` against the schema, fills in defaults, converts units and references. Reports all
/// faults at once, one sentence each, with the parameter's path and unit; rejects unknown names
/// with the nearest known one. Under a permit with a folder for files, paths must lie in it
/// (kernel/file_root.h).
[[nodiscard]] Result<Map> check(const Schema&, const Map& given, const ResolveRef& = {});

/// Checks one value; `path` names it in messages.
[[nodiscard]] Result<Value> check_value(const ParamSpec&, const Value&, std::string_view path,
                                        const ResolveRef& = {});

/// `speed: real [m/s] = 0.1, greater than 0. Speed along the path.`
[[nodiscard]] std::string describe(const ParamSpec&);

/// The schema of a constant parameter table; a malformed row is an error that names it.
[[nodiscard]] Result<Schema> schema_from(std::span<const rmp_param> table);
/// The schema of a provider; its table may be that of an older SDK.
[[nodiscard]] Result<Schema> schema_from(const rmp_provider&);

/// Params (as seen by providers) for a checked Map; owns a copy.
[[nodiscard]] std::unique_ptr<Params> make_params(Map checked);

/// Pose <-> the normalised 4x4 NumericArray of type "pose".
[[nodiscard]] Value pose_value(const Pose&);
[[nodiscard]] std::optional<Pose> pose_from(const Value&);

}  // namespace robomosp
