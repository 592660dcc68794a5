// SPDX-License-Identifier: Apache-2.0
// Mass properties in other frames, about other points, and put together (layer: data processing,
// spatial). Inertia tensors are matrix elements (see Sym3), about the centre of mass. [any thread]
#pragma once

#include <array>
#include <span>

#include <robomosp/sdk/csg.h>
#include <robomosp/sdk/types.h>

namespace robomosp::spatial {

/// R s R^T: a tensor of frame b in the axes of frame a.
[[nodiscard]] Sym3 rotate(const Pose& a_T_b, const Sym3& s);
/// Mass properties given in frame b, in frame a.
[[nodiscard]] MassProperties in_frame(const MassProperties& m, const Pose& a_T_b);
/// m (d^2 1 - d d^T): what the parallel axis theorem adds for a distance d [kg m^2].
[[nodiscard]] Sym3 parallel_axis(double mass, const Vec3& d);
/// Inertia about `point` of the same frame instead of the centre of mass [kg m^2].
[[nodiscard]] Sym3 inertia_about(const MassProperties& m, const Vec3& point);
/// All bodies as one; all in one frame. Without any mass the centre of mass is the origin.
[[nodiscard]] MassProperties combine(std::span<const MassProperties> bodies);
/// Mass properties of a homogeneous solid from its volume integrals; density in kg/m^3.
[[nodiscard]] MassProperties mass_properties(const Moments& moments, double density);
/// m, m*com (3), then Ixx, Iyy, Izz, Ixy, Iyz, Ixz about the frame's origin (elements of the
/// tensor): the ten parameters in which the equations of motion are linear.
[[nodiscard]] std::array<double, 10> inertial_parameters(const MassProperties& m);
/// sqrt(I / m) for each axis of the frame, through the centre of mass [m]; zeros without mass.
[[nodiscard]] Vec3 radii_of_gyration(const MassProperties& m);
[[nodiscard]] bool is_finite(const MassProperties& m);

}  // namespace robomosp::spatial
