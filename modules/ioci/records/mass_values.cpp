// SPDX-License-Identifier: Apache-2.0
// Mass of solids and objects as commands return it and principal axes.
#include <algorithm>
#include <cmath>
#include <cstring>

#include "ioci/core/commands.h"
#include "spatial/mass.h"
#include "spatial/pose.h"
#include "spatial/principal.h"

namespace robomosp::ioci {

std::vector<ParamSpec> body_mass_fields() {
  return {
      field("mass", "real", "kg", "Mass; the measured one, if there is one."),
      field("com", "vec3", "m", "Centre of mass in the frame of the record, or in `about`."),
      field("inertia", "matrix", "kg m^2",
            "Inertia tensor about the centre of mass; its off-diagonal elements are minus the "
            "products of inertia."),
      field("inertia_origin", "matrix", "kg m^2", "Inertia tensor about the origin of the frame."),
      field("principal_moments", "vec3", "kg m^2",
            "Eigenvalues of the tensor about the centre of mass, ascending."),
      field("principal_axes", "matrix", "", "Their axes, one per column."),
      field("radii_of_gyration", "vec3", "m",
            "sqrt(I / m) for the frame's axes through the centre of mass."),
      field("principal_radii", "vec3", "m", "sqrt(I / m) for the principal axes."),
      field("volume", "real", "m^3",
            "Volume; overlaps of parts count once unless the object sums them."),
      field("area", "real", "m^2", "Surface area, the sum over the parts."),
      field("overlap", "real", "m^3", "Volume that parts share."),
      field("exact", "bool", "", "True if it is computed from the analytic surfaces."),
      field("relative_error", "real", "", "Error bound of mass and volume if not exact."),
      field("measured", "map", "", "The measured mass, com, inertia and source, if any."),
      field("computed", "map", "", "If measured: the computed mass, com, inertia."),
      field("notes", "list", "", "Remarks such as parts without a material.")};
}

Map body_mass_map(const evaluation::BodyMass& b, const Pose& about) {
  const auto there = [&](const MassProperties& m) {
    return spatial::in_frame(m, spatial::inverse(about));
  };
  const bool moved = about.p != Vec3{} || about.R != Pose{}.R;
  const evaluation::BodyMass& given = b;
  if (moved) {
    evaluation::BodyMass other = given;
    other.mass = there(given.mass);
    if (given.computed) other.computed = there(*given.computed);
    return body_mass_map(other);
  }
  const spatial::Principal p = spatial::principal(b.mass.inertia);
  List notes;
  for (const auto& n : b.notes) notes.emplace_back(n);
  const MassProperties turned{
      b.mass.mass, b.mass.com, {p.moments[0], p.moments[1], p.moments[2], 0, 0, 0}};
  Map out{{"mass", b.mass.mass},
          {"com", vec_value(b.mass.com, "m")},
          {"inertia", sym_value(b.mass.inertia, "kg m^2")},
          {"inertia_origin", sym_value(spatial::inertia_about(b.mass, Vec3{}), "kg m^2")},
          {"principal_moments", vec_value(p.moments, "kg m^2")},
          {"principal_axes", NumericArray(std::vector<double>(p.axes.begin(), p.axes.end()), 3, 3)},
          {"radii_of_gyration", vec_value(spatial::radii_of_gyration(b.mass), "m")},
          {"principal_radii", vec_value(spatial::radii_of_gyration(turned), "m")},
          {"volume", b.volume},
          {"area", b.area},
          {"overlap", b.overlap},
          {"exact", b.exact},
          {"relative_error", b.exact ? 0.0 : b.relative_error},
          {"notes", std::move(notes)}};
  if (b.computed) {
    Map measured = *mass_value(b.mass).as_map();
    measured.set("source", b.measured_source);
    out.set("measured", std::move(measured));
    out.set("computed", mass_value(*b.computed));
  }
  return out;
}

ParamSpec about_field() {
  return optional("about", "pose", "",
                  "A frame in the record's frame: com, inertia and inertia_origin are then given "
                  "in its axes and about its origin.");
}

Pose about_of(const Map& args) {
  const Value* v = args.find("about");
  const auto pose = v && !v->is_nil() ? pose_from(*v) : std::nullopt;
  return pose ? *pose : Pose{};
}

}  // namespace robomosp::ioci
