// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/scene/osg_geometry.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "viewer/scene/linear.h"

namespace robomosp::viewer {
namespace {

osg::ref_ptr<osg::Geometry> empty_geometry() {
  osg::ref_ptr<osg::Geometry> g = new osg::Geometry;
  g->setUseDisplayList(false);
  g->setUseVertexBufferObjects(true);
  return g;
}

osg::ref_ptr<osg::Vec3Array> vectors_of(const std::vector<float>& xyz) {
  osg::ref_ptr<osg::Vec3Array> a = new osg::Vec3Array;
  a->reserve(xyz.size() / 3);
  for (std::size_t i = 0; i + 2 < xyz.size(); i += 3)
    a->push_back(osg::Vec3f(xyz[i], xyz[i + 1], xyz[i + 2]));
  return a;
}

osg::Vec3f float_vec_of(const Vec3& v) {
  return {static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2])};
}

}  // namespace

osg::ref_ptr<osg::Program> program_of(const ShaderPair& sources, const char* name) {
  osg::ref_ptr<osg::Program> p = new osg::Program;
  p->setName(name);
  p->addShader(new osg::Shader(osg::Shader::VERTEX, sources.vertex));
  p->addShader(new osg::Shader(osg::Shader::FRAGMENT, sources.fragment));
  return p;
}

osg::Matrixd matrix_of(const Pose& pose) {
  const auto& R = pose.R;
  return {R[0], R[3], R[6], 0, R[1],      R[4],      R[7],      0,
          R[2], R[5], R[8], 0, pose.p[0], pose.p[1], pose.p[2], 1};
}

osg::Matrixd matrix_of(const Matrix4& m) {
  return {m[0], m[4], m[8],  m[12], m[1], m[5], m[9],  m[13],
          m[2], m[6], m[10], m[14], m[3], m[7], m[11], m[15]};
}

osg::Vec4f linear_of(const Colour& srgb) {
  const auto decode = [](float c) {
    c = std::clamp(c, 0.0F, 1.0F);
    return c <= 0.04045F ? c / 12.92F : std::pow((c + 0.055F) / 1.055F, 2.4F);
  };
  return {decode(srgb.r), decode(srgb.g), decode(srgb.b), std::clamp(srgb.a, 0.0F, 1.0F)};
}

osg::ref_ptr<osg::Geometry> triangles_of(const Surface& surface) {
  auto g = empty_geometry();
  g->setVertexArray(vectors_of(surface.positions));
  g->setNormalArray(vectors_of(surface.normals), osg::Array::BIND_PER_VERTEX);
  g->addPrimitiveSet(
      new osg::DrawElementsUInt(GL_TRIANGLES, surface.triangles.begin(), surface.triangles.end()));
  return g;
}

osg::ref_ptr<osg::Geometry> segments_of(const std::vector<float>& ends,
                                        const std::vector<float>& along) {
  auto g = empty_geometry();
  g->setVertexArray(vectors_of(ends));
  osg::ref_ptr<osg::FloatArray> way = new osg::FloatArray(along.begin(), along.end());
  way->resize(ends.size() / 3);
  g->setTexCoordArray(0, way, osg::Array::BIND_PER_VERTEX);
  g->addPrimitiveSet(new osg::DrawArrays(GL_LINES, 0, static_cast<GLsizei>(ends.size() / 3)));
  return g;
}

osg::ref_ptr<osg::Geometry> sheet_of(const std::vector<float>& positions,
                                     const std::vector<std::uint32_t>& triangles,
                                     const Vec3& normal) {
  auto g = empty_geometry();
  g->setVertexArray(vectors_of(positions));
  osg::ref_ptr<osg::Vec3Array> n = new osg::Vec3Array(static_cast<unsigned>(positions.size() / 3));
  std::fill(n->begin(), n->end(), float_vec_of(normal));
  g->setNormalArray(n, osg::Array::BIND_PER_VERTEX);
  g->addPrimitiveSet(new osg::DrawElementsUInt(GL_TRIANGLES, triangles.begin(), triangles.end()));
  return g;
}

osg::ref_ptr<osg::Geometry> ball_of(double radius) {
  constexpr unsigned kRings = 24, kSides = 48;
  osg::ref_ptr<osg::Vec3Array> vertices = new osg::Vec3Array, normals = new osg::Vec3Array;
  osg::ref_ptr<osg::DrawElementsUInt> triangles = new osg::DrawElementsUInt(GL_TRIANGLES);
  for (unsigned r = 0; r <= kRings; ++r) {
    const double b = std::numbers::pi * (static_cast<double>(r) / kRings - 0.5);
    for (unsigned s = 0; s <= kSides; ++s) {
      const double a = 2 * std::numbers::pi * s / kSides;
      const Vec3 n{std::cos(b) * std::cos(a), std::cos(b) * std::sin(a), std::sin(b)};
      vertices->push_back(float_vec_of(radius * n));
      normals->push_back(float_vec_of(n));
    }
  }
  for (unsigned r = 0; r < kRings; ++r)
    for (unsigned s = 0; s < kSides; ++s) {
      const unsigned a = r * (kSides + 1) + s, b = a + kSides + 1;
      for (const unsigned i : {a, a + 1, b + 1, a, b + 1, b}) triangles->push_back(i);
    }
  auto g = empty_geometry();
  g->setVertexArray(vertices);
  g->setNormalArray(normals, osg::Array::BIND_PER_VERTEX);
  g->addPrimitiveSet(triangles);
  return g;
}

osg::ref_ptr<osg::Geometry> hull_of(const Surface& surface) {
  auto g = empty_geometry();
  const auto positions = vectors_of(surface.positions);
  const auto normals = vectors_of(surface.normals);
  const std::vector<std::uint32_t> first = welded(surface);
  std::vector<osg::Vec3f> sum(first.size());
  for (std::size_t i = 0; i < first.size(); ++i) {
    osg::Vec3f& s = sum[first[i]];
    // The same normal met twice shall not outweigh another side of the corner.
    if (s.length2() == 0 || (s * (*normals)[i]) / s.length() < 0.999F) s += (*normals)[i];
  }
  for (std::size_t i = 0; i < first.size(); ++i) {
    osg::Vec3f n = sum[first[i]];
    n.normalize();
    (*normals)[i] = n;
  }
  g->setVertexArray(positions);
  g->setNormalArray(normals, osg::Array::BIND_PER_VERTEX);
  g->addPrimitiveSet(
      new osg::DrawElementsUInt(GL_TRIANGLES, surface.triangles.begin(), surface.triangles.end()));
  return g;
}

osg::ref_ptr<osg::Geometry> ribbon_of(std::span<const Vec3> points) {
  std::vector<Vec3> kept;
  for (const Vec3& p : points)
    if (is_finite(p) && (kept.empty() || norm(p - kept.back()) > 0)) kept.push_back(p);
  auto g = empty_geometry();
  g->setCullingActive(false);
  osg::ref_ptr<osg::Vec3Array> here = new osg::Vec3Array, before = new osg::Vec3Array;
  osg::ref_ptr<osg::Vec4Array> after = new osg::Vec4Array;
  if (kept.size() >= 2) {
    for (std::size_t i = 0; i < kept.size(); ++i) {
      for (const float side : {-1.0F, 1.0F}) {
        here->push_back(float_vec_of(kept[i]));
        before->push_back(float_vec_of(kept[i == 0 ? 0 : i - 1]));
        after->push_back(osg::Vec4f(float_vec_of(kept[std::min(i + 1, kept.size() - 1)]), side));
      }
    }
  }
  g->setVertexArray(here);
  g->setNormalArray(before, osg::Array::BIND_PER_VERTEX);
  g->setTexCoordArray(0, after, osg::Array::BIND_PER_VERTEX);
  g->addPrimitiveSet(new osg::DrawArrays(GL_TRIANGLE_STRIP, 0, static_cast<GLsizei>(here->size())));
  return g;
}

osg::ref_ptr<osg::Geometry> arrow_of(double shaft_radius) {
  struct Ring {
    double radius, z, normal_r, normal_z;
  };
  const double head = 2.5 * shaft_radius, neck = 1 - 3.1 * head, slope = head / (1 - neck);
  const double n = std::hypot(1.0, slope);
  const std::array<Ring, 8> rings{{{0, 0, 0, -1},
                                   {shaft_radius, 0, 0, -1},
                                   {shaft_radius, 0, 1, 0},
                                   {shaft_radius, neck, 1, 0},
                                   {shaft_radius, neck, 0, -1},
                                   {head, neck, 0, -1},
                                   {head, neck, 1 / n, slope / n},
                                   {0, 1, 1 / n, slope / n}}};
  constexpr unsigned kSides = 28;
  osg::ref_ptr<osg::Vec3Array> vertices = new osg::Vec3Array, normals = new osg::Vec3Array;
  osg::ref_ptr<osg::DrawElementsUInt> triangles = new osg::DrawElementsUInt(GL_TRIANGLES);
  for (unsigned s = 0; s <= kSides; ++s) {
    const double a = 2 * std::numbers::pi * s / kSides, c = std::cos(a), d = std::sin(a);
    for (const Ring& r : rings) {
      vertices->push_back(float_vec_of({r.radius * c, r.radius * d, r.z}));
      normals->push_back(float_vec_of({r.normal_r * c, r.normal_r * d, r.normal_z}));
    }
  }
  constexpr unsigned kRings = 8;
  for (unsigned s = 0; s < kSides; ++s) {
    for (unsigned r = 0; r + 1 < kRings; r += 2) {
      const unsigned a = s * kRings + r, b = a + kRings;
      for (const unsigned i : {a, b, b + 1, a, b + 1, a + 1}) triangles->push_back(i);
    }
  }
  auto g = empty_geometry();
  g->setVertexArray(vertices);
  g->setNormalArray(normals, osg::Array::BIND_PER_VERTEX);
  g->addPrimitiveSet(triangles);
  return g;
}

osg::ref_ptr<osg::Geometry> square_of(double half) {
  auto g = empty_geometry();
  osg::ref_ptr<osg::Vec3Array> v = new osg::Vec3Array;
  for (const auto& [x, y] : {std::pair{-1, -1}, {1, -1}, {1, 1}, {-1, 1}})
    v->push_back(float_vec_of({x * half, y * half, 0}));
  osg::ref_ptr<osg::Vec3Array> n = new osg::Vec3Array(4);
  std::fill(n->begin(), n->end(), osg::Vec3f(0, 0, 1));
  g->setVertexArray(v);
  g->setNormalArray(n, osg::Array::BIND_PER_VERTEX);
  g->addPrimitiveSet(new osg::DrawArrays(GL_TRIANGLE_FAN, 0, 4));
  g->setCullingActive(false);
  return g;
}

}  // namespace robomosp::viewer
