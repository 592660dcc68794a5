// SPDX-License-Identifier: Apache-2.0
// Parts of records of several kinds: placements, parameters, measured masses, selected providers,
// pairs of bodies (layer: data processing, model). SI and radians.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include <robomosp/sdk/types.h>

#include "model/fields.h"
#include "model/kind.h"
#include "model/long_list.h"

namespace robomosp::model {

/// How the three angles of a Placement make a rotation matrix.
enum class AngleRepresentation : std::uint8_t {
  rpy,  ///< roll, pitch, yaw: R = Rz(yaw) Ry(pitch) Rx(roll), angles given (roll, pitch, yaw)
  xyz,  ///< R = Rx(a) Ry(b) Rz(c)
  zyz,  ///< R = Rz(a) Ry(b) Rz(c)
};
inline constexpr std::array<std::string_view, 3> kAngleWords{"rpy", "xyz", "zyz"};
constexpr std::span<const std::string_view> words(Of<AngleRepresentation>) { return kAngleWords; }

/// What the three numbers of a Placement's position are.
enum class PositionRepresentation : std::uint8_t {
  cartesian,    ///< x, y, z [m]
  cylindrical,  ///< radius [m], angle about z from x [rad], z [m]
  spherical,    ///< radius [m], angle about z from x [rad], angle from z [rad]
};
/// As files name them.
inline constexpr std::array<std::string_view, 3> kPositionWords{"at", "cylindrical", "spherical"};
constexpr std::span<const std::string_view> words(Of<PositionRepresentation>) {
  return kPositionWords;
}

/// SI units of the three numbers of a position.
[[nodiscard]] constexpr std::array<std::string_view, 3> position_units(
    PositionRepresentation notation) {
  switch (notation) {
    case PositionRepresentation::cylindrical: return {"m", "rad", "m"};
    case PositionRepresentation::spherical: return {"m", "rad", "rad"};
    case PositionRepresentation::cartesian: break;
  }
  return {"m", "m", "m"};
}

/// A placement as the user wrote it; `pose()` in model/placement.h turns it into a matrix.
struct Placement {
  Vec3 position{};  ///< by `coordinates` [m, rad]
  Vec3 angles{};    ///< [rad]
  AngleRepresentation notation = AngleRepresentation::rpy;
  PositionRepresentation coordinates = PositionRepresentation::cartesian;
  bool operator==(const Placement&) const = default;
};
template <class V>
constexpr void fields(V& v, Of<Placement>) {
  v("position", &Placement::position)
      .unit_by([](const void* p, std::size_t i) {
        return position_units(static_cast<const Placement*>(p)->coordinates)[i];
      })
      .doc("Position of the origin, in the selected coordinates.");
  v("angles", &Placement::angles)
      .in_paths([](const void* p) {
        return kAngleWords[static_cast<std::size_t>(static_cast<const Placement*>(p)->notation)];
      })
      .unit("rad")
      .doc("The three angles of the rotation, in the selected convention.");
  v("notation", &Placement::notation).doc("Convention of the three angles.");
  v("coordinates", &Placement::coordinates)
      .doc("Whether the position is Cartesian (at), cylindrical or spherical.");
}

/// A named number for expressions of its record; worlds' parameters are available to all records as
/// `world.name`.
struct Parameter {
  std::string name;
  std::string expression;  ///< "" = a plain number
  std::string unit;        ///< SI; "" = dimensionless
  double value = 0;        ///< [unit]; of the expression, when there is one
  std::string description;
  bool operator==(const Parameter&) const = default;
};
template <class V>
constexpr void fields(V& v, Of<Parameter>) {
  v("name", &Parameter::name).needed().doc("Name for use in expressions.");
  v("expression", &Parameter::expression).doc("Expression of its value; empty for a plain number.");
  v("unit", &Parameter::unit).doc("SI unit of its value; empty for a plain number.");
  v("value", &Parameter::value).doc("Its value in SI units.");
  v("description", &Parameter::description).doc("Its description.");
}

/// Parameters of a record, and its numbers that are expressions over them: path as in the set
/// commands ("bore.radius", "chord") -> expression. The numbers hold the last values.
struct Parametric {
  LongList<Parameter> parameters;
  std::map<std::string, std::string> expressions;
  bool operator==(const Parametric&) const = default;
};
template <class V>
constexpr void fields(V& v, Of<Parametric>) {
  v("parameters", &Parametric::parameters).doc("Named numbers for the record's expressions.");
  v("expressions", &Parametric::expressions).doc("Expressions by the path of their numbers.");
}

template <class V>
constexpr void fields(V& v, Of<MassProperties>) {
  v("mass", &MassProperties::mass).unit("kg").range(0, 1e9).needed().doc("The mass.");
  v("com", &MassProperties::com)
      .label("centre of mass")
      .unit("m")
      .doc("The centre of mass in the stated frame.");
  v("inertia", &MassProperties::inertia)
      .unit("kg m^2")
      .doc("Inertia about the centre of mass: xx, yy, zz, xy, yz, xz.");
}

/// Values measured on the real object; they replace the computed ones, which are still reported.
struct MeasuredMass {
  MassProperties mass;  ///< in the record's frame
  std::string source;   ///< how and by whom
};
template <class V>
constexpr void fields(V& v, Of<MeasuredMass>) {
  v("mass", &MeasuredMass::mass).flat().doc("Measured values, in the record's frame.");
  v("source", &MeasuredMass::source).doc("Source of the measurement: method and person.");
}

/// A selected provider with the values given for its parameters, by name. Empty name = the default.
struct ProviderChoice {
  using Param = std::variant<bool, std::int64_t, double, std::string, std::vector<double>>;
  std::string name;
  std::map<std::string, Param> params;  ///< SI
  bool operator==(const ProviderChoice&) const = default;
};
template <class V>
constexpr void fields(V& v, Of<ProviderChoice>) {
  v("name", &ProviderChoice::name).doc("Name of the provider; empty for the default one.");
  v("params", &ProviderChoice::params)
      .flat()
      .doc("Values of the provider's parameters, in SI units.");
}

/// Overrides whether collision checks include a pair of bodies. A robot's bodies are named by link,
/// or "base"; a world's are "table", "arm.forearm", "arm.base", and "arm" means all of that robot.
/// A name that matches nothing has no effect.
struct CollisionPairRule {
  std::string a, b;
  bool is_allowed = true;  ///< contact is allowed, the pair is skipped; false = it is always
                           ///< checked
  std::string reason;      ///< why, for people
  bool operator==(const CollisionPairRule&) const = default;
};
template <class V>
constexpr void fields(V& v, Of<CollisionPairRule>) {
  v("a", &CollisionPairRule::a).needed().doc("One body.");
  v("b", &CollisionPairRule::b).needed().doc("The other body.");
  v("is_allowed", &CollisionPairRule::is_allowed)
      .doc("True: the two may touch and are not checked; false: they are always checked.");
  v("reason", &CollisionPairRule::reason).doc("Reason, for readers.");
}

}  // namespace robomosp::model
