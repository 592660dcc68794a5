// SPDX-License-Identifier: GPL-3.0-or-later
// Builds OSG geometry, programs and matrices from plain data (layer: GUI, private to scene/).
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include <osg/Geometry>
#include <osg/Matrixd>
#include <osg/Program>
#include <osg/StateSet>

#include "viewer/frame.h"
#include "viewer/scene/orbit_camera.h"
#include "viewer/scene/shaders.h"
#include "viewer/scene/surface.h"

namespace robomosp::viewer {

/// Sets a uniform of a state set, and creates it if missing.
template <class T>
void set_uniform(osg::StateSet* state, const char* name, const T& value) {
  if (osg::Uniform* u = state->getUniform(name)) u->set(value);
  else state->addUniform(new osg::Uniform(name, value));
}

[[nodiscard]] osg::ref_ptr<osg::Program> program_of(const ShaderPair& sources, const char* name);
/// OSG multiplies row vectors from the left, hence the transposed elements.
[[nodiscard]] osg::Matrixd matrix_of(const Pose& pose);
[[nodiscard]] osg::Matrixd matrix_of(const Matrix4& m);
/// Linear light of an sRGB colour.
[[nodiscard]] osg::Vec4f linear_of(const Colour& srgb);

[[nodiscard]] osg::ref_ptr<osg::Geometry> triangles_of(const Surface& surface);
/// Lines between pairs of ends (6 numbers each) with the distance along the line at each end.
[[nodiscard]] osg::ref_ptr<osg::Geometry> segments_of(const std::vector<float>& ends,
                                                      const std::vector<float>& along);
/// Plane triangles with one normal.
[[nodiscard]] osg::ref_ptr<osg::Geometry> sheet_of(const std::vector<float>& positions,
                                                   const std::vector<std::uint32_t>& triangles,
                                                   const Vec3& normal);
/// Sphere about the origin.
[[nodiscard]] osg::ref_ptr<osg::Geometry> ball_of(double radius);
/// The triangles with one normal per position instead of per vertex, so that a hull pushed outwards
/// along them has no gaps at corners.
[[nodiscard]] osg::ref_ptr<osg::Geometry> hull_of(const Surface& surface);
/// The strip that the ribbon shader widens; repeated points and non-finite ones are left out.
[[nodiscard]] osg::ref_ptr<osg::Geometry> ribbon_of(std::span<const Vec3> points);
/// Arrow of unit length along +z.
[[nodiscard]] osg::ref_ptr<osg::Geometry> arrow_of(double shaft_radius);
/// Rectangle at height zero from -half to half.
[[nodiscard]] osg::ref_ptr<osg::Geometry> square_of(double half);

}  // namespace robomosp::viewer
