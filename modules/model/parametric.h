// SPDX-License-Identifier: Apache-2.0
// Named parameters of records and numbers that are expressions over them (layer: data processing,
// model). Paths are those of the set commands; rules for users: docs/user/parameters.md.
#pragma once

#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <robomosp/sdk/result.h>

#include "kernel/expression.h"
#include "model/records.h"

namespace robomosp::model {

/// Parameters and expressions of a record; nullptr for kinds without them. [any thread]
[[nodiscard]] const Parametric* parametric_of(const Body&);
[[nodiscard]] Parametric* parametric_of(Body&);

/// The number at a path.
struct PathNumber {
  double value = 0;       ///< [unit]
  std::string_view unit;  ///< SI; "" = dimensionless; or kAnyUnit, kByJoint
};
/// Unit of a number with a dimension that only its provider knows.
inline constexpr std::string_view kAnyUnit = "any";
/// Converts a quantity to a number in the unit of a PathNumber: kAnyUnit accepts every dimension,
/// kByJoint an angle, a length or a plain number (a joint of a robot not known here). `text` is the
/// text of the quantity, for the error of another dimension.
[[nodiscard]] Result<double> in_unit(const Quantity&, std::string_view unit, std::string_view text);
/// The number at a path, which may be any number of the record that is a real: `bore.radius`,
/// `bore.position.x`, `bore.rpy.z` (of the notation it is written in), `plate.profile.1.3.x` (loop
/// and point from 1; of a circle `plate.profile.2.radius`), `wheel.primitive.teeth`,
/// `elbow.origin.position.x`, `poses.home.q.2`, `segments.1.points.2.position.z`. The unit of a joint
/// value is that of the robot's joint where the record knows it, else kByJoint.
[[nodiscard]] std::optional<PathNumber> number_at(const Body&, std::string_view path);
/// Its address in the record; nullptr = the path is not a number.
[[nodiscard]] const double* number_in(const Body&, std::string_view path);
/// Writes it; false = the path is not a number.
bool set_number(Body&, std::string_view path, double value);

/// A parameter's quantity.
[[nodiscard]] Quantity quantity_of(const Parameter&);
[[nodiscard]] const Parameter* find_parameter(const Parametric&, std::string_view name);

/// The quantity of `world.parameter`, or empty if the world or the parameter does not exist.
using WorldParameters = std::function<std::optional<Quantity>(const Expression::Name&)>;

/// Evaluates the parameters in the order of their dependencies, then writes every number that is an
/// expression. Expressions over a parameter of a missing world keep their last value. Faults name
/// the path or parameter: unknown names, dimensions, undefined values, and cycles. `before` is the
/// record before the edit, evaluated under the same name and with the same parameters of worlds;
/// then only the changed expressions and their dependents are parsed and evaluated, with the same
/// results. Null = none. [any thread]
Result<void> resolve(Body&, std::string_view own_name, const WorldParameters&,
                     const Body* before = nullptr);

/// Names known to the expressions of a record (its own parameters, and worlds'); the error gives
/// the reason for an unknown one. `own_name` is that of a world itself. The references must outlive
/// it.
[[nodiscard]] Expression::Lookup lookup(const Parametric&, std::string_view own_name,
                                        const WorldParameters&);

/// Parameters of worlds that expressions of the record use, each once.
[[nodiscard]] std::vector<Expression::Name> world_mentions(const Body&);
/// True if there are any.
[[nodiscard]] bool mentions_worlds(const Body&);
/// Uses of a name: paths and `parameter "wall"`.
[[nodiscard]] std::vector<std::string> uses_of(const Body&, const Expression::Name&);
/// Replaces names in all expressions of the record.
void rename_in(Body&, const std::function<Expression::Name(const Expression::Name&)>& rename);

/// Updates expressions after an edit: they follow elements that were renamed or moved within their
/// list, those of removed elements are dropped, and an edited number replaces its expression.
void follow_edit(const Body& before, Body& after);

}  // namespace robomosp::model
