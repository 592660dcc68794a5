// SPDX-License-Identifier: Apache-2.0
// Conformance suite of interface robomosp.csg/1 (header-only GoogleTest; layer: contract).
// Include it in one file and name your engine:
//   INSTANTIATE_TEST_SUITE_P(Mine, CsgConformance, ::testing::Values(CsgSubject{"mine", make}));
// Every expected value is a closed form or an identity, never a recorded number. Engines with the
// tag "mesh" are held to the error they state, all others to the accuracy of the subject.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <functional>
#include <map>
#include <memory>
#include <numbers>
#include <ostream>
#include <random>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <robomosp/sdk/csg.h>

namespace robomosp::conformance {

/// The engine under test and what accuracy it claims.
struct CsgSubject {
  std::string name;
  std::function<std::unique_ptr<CsgEngine>()> make;
  std::string tags = "brep";          ///< of its provider, joined by commas
  double primitive_accuracy = 1e-13;  ///< relative, moments of single primitives
  double boolean_accuracy = 1e-8;     ///< relative, moments of curved boolean results
  /// The greatest Moments::relative_error an approximate engine may state for the solids here.
  double mesh_error = 0.03;

  [[nodiscard]] bool has_tag(std::string_view tag) const {
    for (std::size_t from = 0; from <= tags.size();) {
      const std::size_t to = std::min(tags.find(',', from), tags.size());
      if (std::string_view(tags).substr(from, to - from) == tag) return true;
      from = to + 1;
    }
    return false;
  }
  /// Works on triangles: curved solids are approximate, imported meshes are taken.
  [[nodiscard]] bool is_mesh() const { return has_tag("mesh"); }
  friend void PrintTo(const CsgSubject& s, std::ostream* out) { *out << s.name; }
};

/// A tree written as nested calls; flattens itself parents first.
struct Csg {
  CsgNode node;
  std::vector<Csg> children;

  [[nodiscard]] Csg at(const Pose& pose) const {
    Csg c = *this;
    c.node.placement = pose;
    return c;
  }
  [[nodiscard]] Csg at(double x, double y, double z) const {
    Pose p;
    p.p = {x, y, z};
    return at(p);
  }
  [[nodiscard]] Csg named(std::string name) const {
    Csg c = *this;
    c.node.name = std::move(name);
    return c;
  }
  [[nodiscard]] CsgTree tree() const {
    CsgTree t;
    std::vector<std::pair<const Csg*, std::int32_t>> open{{this, -1}};
    while (!open.empty()) {
      const auto [c, parent] = open.back();
      open.pop_back();
      const auto index = static_cast<std::int32_t>(t.nodes.size());
      t.nodes.push_back(c->node);
      t.nodes.back().parent = parent;
      for (auto child = c->children.rbegin(); child != c->children.rend(); ++child)
        open.emplace_back(&*child, index);
    }
    return t;
  }
};

inline Csg primitive(CsgKind kind, std::array<double, 6> sizes) {
  Csg c;
  c.node.kind = kind;
  c.node.sizes = sizes;
  return c;
}
inline Csg box(double x, double y, double z, double fillet = 0) {
  return primitive(CsgKind::box, {x, y, z, fillet});
}
inline Csg cylinder(double radius, double height, double fillet = 0) {
  return primitive(CsgKind::cylinder, {radius, height, fillet});
}
inline Csg cone(double base, double top, double height) {
  return primitive(CsgKind::cone, {base, top, height});
}
inline Csg sphere(double radius) { return primitive(CsgKind::sphere, {radius}); }
inline Csg ellipsoid(double x, double y, double z) {
  return primitive(CsgKind::ellipsoid, {x, y, z});
}
inline Csg torus(double ring, double tube) { return primitive(CsgKind::torus, {ring, tube}); }
inline Csg frustum(double bx, double by, double tx, double ty, double h) {
  return primitive(CsgKind::frustum, {bx, by, tx, ty, h});
}
inline Csg operation(CsgKind kind, std::vector<Csg> children) {
  Csg c;
  c.node.kind = kind;
  c.children = std::move(children);
  return c;
}
inline Csg unite(std::vector<Csg> c) { return operation(CsgKind::union_, std::move(c)); }
inline Csg subtract(std::vector<Csg> c) { return operation(CsgKind::difference, std::move(c)); }
inline Csg intersect(std::vector<Csg> c) { return operation(CsgKind::intersection, std::move(c)); }

/// Rotation by `angle` about the (any length) axis, then translation. Rodrigues' formula.
inline Pose turned(Vec3 axis, double angle, Vec3 p = {}) {
  const double n = std::sqrt(axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2]);
  for (double& a : axis) a /= n;
  const double c = std::cos(angle), s = std::sin(angle);
  const auto [x, y, z] = axis;
  Pose pose;
  pose.R = {c + x * x * (1 - c),     x * y * (1 - c) - z * s, x * z * (1 - c) + y * s,
            y * x * (1 - c) + z * s, c + y * y * (1 - c),     y * z * (1 - c) - x * s,
            z * x * (1 - c) - y * s, z * y * (1 - c) + x * s, c + z * z * (1 - c)};
  pose.p = p;
  return pose;
}

/// Moments of a body about the origin from its volume, its second moments of a symmetric shape,
/// and the height of its centre. `area` < 0 = unknown.
inline Moments closed_form(double volume, double first_z, double xx, double yy, double zz,
                           double area = -1) {
  Moments m;
  m.volume = volume;
  m.area = area;
  m.first = {0, 0, first_z};
  m.second = {xx, yy, zz, 0, 0, 0};
  return m;
}

/// Moments of the same body after the rigid motion.
inline Moments moved(const Moments& m, const Pose& pose) {
  const auto& R = pose.R;
  const auto& p = pose.p;
  const std::array<std::array<double, 3>, 3> S{{{m.second.xx, m.second.xy, m.second.xz},
                                                {m.second.xy, m.second.yy, m.second.yz},
                                                {m.second.xz, m.second.yz, m.second.zz}}};
  Moments out = m;
  Vec3 f{};
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) f[i] += R[3 * i + j] * m.first[j];
    out.first[i] = f[i] + m.volume * p[i];
  }
  const auto element = [&](std::size_t i, std::size_t j) {
    double sum = f[i] * p[j] + p[i] * f[j] + m.volume * p[i] * p[j];
    for (std::size_t a = 0; a < 3; ++a)
      for (std::size_t b = 0; b < 3; ++b) sum += R[3 * i + a] * S[a][b] * R[3 * j + b];
    return sum;
  };
  out.second = {element(0, 0), element(1, 1), element(2, 2),
                element(0, 1), element(1, 2), element(0, 2)};
  return out;
}

/// a + factor * b, of bodies in one frame.
inline Moments sum(const Moments& a, const Moments& b, double factor = 1) {
  Moments m = a;
  m.volume += factor * b.volume;
  for (std::size_t i = 0; i < 3; ++i) m.first[i] += factor * b.first[i];
  m.second.xx += factor * b.second.xx;
  m.second.yy += factor * b.second.yy;
  m.second.zz += factor * b.second.zz;
  m.second.xy += factor * b.second.xy;
  m.second.yz += factor * b.second.yz;
  m.second.xz += factor * b.second.xz;
  return m;
}

/// How far moments may be off, each on its own scale. A stated relative error e means:
/// the volume within e V, the area within e S, the first moments within e sqrt(V T) and the second
/// within e T, T being the trace of the second (|first| <= sqrt(V T), by Cauchy-Schwarz).
struct MomentsBound {
  double volume = 0, area = 0, first = 0, second = 0;
  MomentsBound& operator+=(const MomentsBound& b) {
    volume += b.volume;
    area += b.area;
    first += b.first;
    second += b.second;
    return *this;
  }
};
inline MomentsBound bound(const Moments& m, double relative) {
  const double trace = m.second.xx + m.second.yy + m.second.zz;
  return {relative * m.volume, relative * std::max(0.0, m.area),
          relative * std::sqrt(std::max(0.0, m.volume * trace)), relative * trace};
}

/// Volume, first and second moments agree within the bound.
inline void expect_moments(const Moments& got, const Moments& want, const MomentsBound& b,
                           const std::string& what) {
  SCOPED_TRACE(what);
  EXPECT_NEAR(got.volume, want.volume, b.volume);
  for (std::size_t i = 0; i < 3; ++i)
    EXPECT_NEAR(got.first[i], want.first[i], b.first) << "first moment " << i;
  EXPECT_NEAR(got.second.xx, want.second.xx, b.second);
  EXPECT_NEAR(got.second.yy, want.second.yy, b.second);
  EXPECT_NEAR(got.second.zz, want.second.zz, b.second);
  EXPECT_NEAR(got.second.xy, want.second.xy, b.second);
  EXPECT_NEAR(got.second.yz, want.second.yz, b.second);
  EXPECT_NEAR(got.second.xz, want.second.xz, b.second);
  if (want.area >= 0) {
    EXPECT_NEAR(got.area, want.area, b.area);
  }
}
inline void expect_moments(const Moments& got, const Moments& want, double relative,
                           const std::string& what) {
  expect_moments(got, want, bound(want, relative), what);
}

/// What a triangle mesh is as a closed surface. Triangles thinner than `chord` [m] are not asked
/// for their direction: three neighbours on a curved edge may span one of any direction.
struct MeshFacts {
  double volume = 0;
  double area = 0;
  std::size_t unbalanced_sides = 0;  ///< directed edges without their opposite, by position
  std::size_t degenerate = 0;        ///< triangles with two equal corners
  std::size_t inward_normals = 0;    ///< vertex normals against their triangle
  double worst_normal_length = 0;    ///< | |n| - 1 |
};
inline MeshFacts facts(const Mesh& mesh, double chord = 1e-4) {
  MeshFacts f;
  std::map<std::array<float, 3>, std::uint32_t> place;
  std::vector<std::uint32_t> id;
  for (std::size_t v = 0; v < mesh.vertex_count(); ++v) {
    const std::array<float, 3> p{mesh.positions[3 * v] + 0.0F, mesh.positions[3 * v + 1] + 0.0F,
                                 mesh.positions[3 * v + 2] + 0.0F};
    id.push_back(place.try_emplace(p, static_cast<std::uint32_t>(place.size())).first->second);
    double n = 0;
    for (std::size_t k = 0; k < 3; ++k) n += std::pow(double(mesh.normals[3 * v + k]), 2);
    f.worst_normal_length = std::max(f.worst_normal_length, std::abs(std::sqrt(n) - 1));
  }
  std::map<std::pair<std::uint32_t, std::uint32_t>, long> sides;
  for (std::size_t t = 0; t < mesh.triangle_count(); ++t) {
    std::array<std::array<double, 3>, 3> c{};
    std::array<std::uint32_t, 3> v{};
    for (std::size_t k = 0; k < 3; ++k) {
      v[k] = mesh.triangles[3 * t + k];
      for (std::size_t i = 0; i < 3; ++i) c[k][i] = double(mesh.positions[3 * v[k] + i]);
    }
    const auto cross = [](const Vec3& a, const Vec3& b) {
      return Vec3{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
    };
    const auto dot = [](const Vec3& a, const Vec3& b) {
      return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    };
    f.volume += dot(c[0], cross(c[1], c[2])) / 6;
    const Vec3 n = cross({c[1][0] - c[0][0], c[1][1] - c[0][1], c[1][2] - c[0][2]},
                         {c[2][0] - c[0][0], c[2][1] - c[0][1], c[2][2] - c[0][2]});
    f.area += std::sqrt(dot(n, n)) / 2;
    double longest = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3 &p = c[k], &q = c[(k + 1) % 3];
      longest = std::max(longest, std::hypot(q[0] - p[0], q[1] - p[1], q[2] - p[2]));
    }
    const bool is_wide = std::sqrt(dot(n, n)) > chord * longest;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = id[v[k]], b = id[v[(k + 1) % 3]];
      if (a == b) {
        ++f.degenerate;
        continue;
      }
      ++sides[{a, b}];
      --sides[{b, a}];
      const Vec3 vertex{double(mesh.normals[3 * v[k]]), double(mesh.normals[3 * v[k] + 1]),
                        double(mesh.normals[3 * v[k] + 2])};
      if (is_wide && dot(n, vertex) < 0) ++f.inward_normals;
    }
  }
  for (const auto& [side, balance] : sides)
    if (balance != 0) ++f.unbalanced_sides;
  return f;
}

class CancelledProgress final : public Progress {
 public:
  void report(double, std::string_view) override {}
  [[nodiscard]] bool cancelled() const override { return true; }
};

class CsgConformance : public ::testing::TestWithParam<CsgSubject> {
 protected:
  void SetUp() override {
    engine = GetParam().make();
    ASSERT_NE(engine, nullptr);
  }

  std::shared_ptr<const CsgShape> shape(const Csg& c) const {
    NoProgress progress;
    auto result = engine->evaluate(c.tree(), progress);
    if (!result) {
      ADD_FAILURE() << result.error().sentence();
      return nullptr;
    }
    return *result;
  }
  Moments moments(const Csg& c) const {
    const auto s = shape(c);
    return s ? moments(*s) : Moments{};
  }
  Moments moments(const CsgShape& s) const {
    NoProgress progress;
    auto result = engine->moments(s, progress);
    if (!result) {
      ADD_FAILURE() << result.error().sentence();
      return {};
    }
    return *result;
  }
  Mesh mesh(const Csg& c, const MeshQuality& quality) const {
    const auto s = shape(c);
    if (!s) return {};
    NoProgress progress;
    auto result = engine->mesh(*s, quality, progress);
    if (!result) {
      ADD_FAILURE() << result.error().sentence();
      return {};
    }
    return std::move(*result);
  }
  bool is_mesh() const { return GetParam().is_mesh(); }
  /// `got` against a closed form: within `claim` for an exact engine, within what it states itself
  /// for an approximate one.
  void expect_closed(const Moments& got, const Moments& want, double claim,
                     const std::string& what) const {
    expect_identity(got, want, claim, {}, what);
  }
  /// `got` against `want`, which was made from other results of the engine.
  void expect_identity(const Moments& got, const Moments& want, double claim,
                       const std::vector<Moments>& from, const std::string& what) const {
    MomentsBound b = bound(want, is_mesh() ? 1e-9 : claim);
    if (is_mesh()) {
      for (const Moments& m : from) b += stated(m, what);
      b += stated(got, what);
    }
    if (is_mesh() && want.area >= 0 && from.empty()) b.area = bound(want, got.relative_error).area;
    expect_moments(got, want, b, what);
  }
  MomentsBound stated(const Moments& m, const std::string& what) const {
    EXPECT_GE(m.relative_error, 0) << what;
    EXPECT_LE(m.relative_error, GetParam().mesh_error) << what;
    return bound(m, m.relative_error);
  }
  /// What the volume of `m` may be off by.
  double volume_slack(const Moments& m, double claim) const {
    return (is_mesh() ? m.relative_error + 1e-9 : claim) * m.volume;
  }
  void expect_error(const CsgTree& tree, ErrorCode code,
                    const std::vector<std::string>& words) const {
    NoProgress progress;
    const auto result = engine->evaluate(tree, progress);
    ASSERT_FALSE(result.ok());
    EXPECT_EQ(result.error().code, code) << result.error().sentence();
    for (const std::string& word : words)
      EXPECT_NE(result.error().sentence().find(word), std::string::npos)
          << '"' << word << "\" is missing in: " << result.error().sentence();
  }
  void expect_error(const Csg& c, const std::vector<std::string>& words) const {
    expect_error(c.tree(), ErrorCode::invalid_argument, words);
  }

  std::unique_ptr<CsgEngine> engine;
};

namespace detail {
inline constexpr double kPi = std::numbers::pi;

inline Moments cone_form(double R0, double R1, double h) {
  const double d = R1 - R0;
  return closed_form(kPi * h / 3 * (R0 * R0 + R0 * R1 + R1 * R1),
                     kPi * h * h / 12 * (R0 * R0 + 2 * R0 * R1 + 3 * R1 * R1),
                     kPi * h / 20 *
                         (std::pow(R0, 4) + R0 * R0 * R0 * R1 + R0 * R0 * R1 * R1 +
                          R0 * R1 * R1 * R1 + std::pow(R1, 4)),
                     kPi * h / 20 *
                         (std::pow(R0, 4) + R0 * R0 * R0 * R1 + R0 * R0 * R1 * R1 +
                          R0 * R1 * R1 * R1 + std::pow(R1, 4)),
                     kPi * h * h * h * (R0 * R0 / 3 + R0 * d / 2 + d * d / 5),
                     kPi * (R0 + R1) * std::hypot(h, d) + kPi * R0 * R0 + kPi * R1 * R1);
}
inline Moments frustum_form(double a0, double b0, double a1, double b1, double h) {
  // a(s) = a0 + (a1 - a0) s and b(s) alike; the integrands are polynomials in s.
  using Poly = std::vector<double>;
  const auto times = [](const Poly& p, const Poly& q) {
    Poly r(p.size() + q.size() - 1, 0.0);
    for (std::size_t i = 0; i < p.size(); ++i)
      for (std::size_t j = 0; j < q.size(); ++j) r[i + j] += p[i] * q[j];
    return r;
  };
  const auto integral = [](const Poly& p, std::size_t power) {
    double total = 0;
    for (std::size_t i = 0; i < p.size(); ++i) total += p[i] / double(i + power + 1);
    return total;
  };
  const Poly a{a0, a1 - a0}, b{b0, b1 - b0}, ab = times(a, b);
  return closed_form(h * integral(ab, 0), h * h * integral(ab, 1),
                     h * integral(times(ab, times(a, a)), 0) / 12,
                     h * integral(times(ab, times(b, b)), 0) / 12, h * h * h * integral(ab, 2));
}
struct PrimitiveCase {
  std::string name;
  Csg solid;
  Moments want;
};
inline std::vector<PrimitiveCase> primitive_cases() {
  const auto box_form = [](double x, double y, double z) {
    const double v = x * y * z;
    return closed_form(v, v * z / 2, v * x * x / 12, v * y * y / 12, v * z * z / 3,
                       2 * (x * y + y * z + z * x));
  };
  const auto cylinder_form = [](double r, double h) {
    const double v = kPi * r * r * h;
    return closed_form(v, v * h / 2, v * r * r / 4, v * r * r / 4, v * h * h / 3,
                       2 * kPi * r * (r + h));
  };
  const auto sphere_form = [](double r) {
    const double v = 4 * kPi / 3 * r * r * r;
    return closed_form(v, 0, v * r * r / 5, v * r * r / 5, v * r * r / 5, 4 * kPi * r * r);
  };
  const auto ellipsoid_form = [](double x, double y, double z, double area) {
    const double v = 4 * kPi / 3 * x * y * z;
    return closed_form(v, 0, v * x * x / 5, v * y * y / 5, v * z * z / 5, area);
  };
  // Surfaces of ellipsoids of revolution, of the half axes 6, 6, 2 and 2, 2, 6 cm.
  const double e = std::sqrt(8.0) / 3, oblate = 2 * kPi * 0.0036 * (1 + std::atanh(e) / 9 / e),
               prolate = 2 * kPi * (0.0004 + 0.0012 * std::asin(e) / e);
  const auto torus_form = [](double R, double r) {
    const double v = 2 * kPi * kPi * R * r * r, xx = v * (R * R / 2 + 3 * r * r / 8);
    return closed_form(v, 0, xx, xx, v * r * r / 4, 4 * kPi * kPi * R * r);
  };
  return {
      {"box", box(0.2, 0.1, 0.05), box_form(0.2, 0.1, 0.05)},
      {"small box", box(1e-4, 2e-4, 3e-4), box_form(1e-4, 2e-4, 3e-4)},
      {"large box", box(30, 20, 10), box_form(30, 20, 10)},
      {"cylinder", cylinder(0.05, 0.2), cylinder_form(0.05, 0.2)},
      {"flat cylinder", cylinder(0.5, 0.002), cylinder_form(0.5, 0.002)},
      {"truncated cone", cone(0.06, 0.02, 0.1), cone_form(0.06, 0.02, 0.1)},
      {"cone on its base", cone(0.06, 0, 0.1), cone_form(0.06, 0, 0.1)},
      {"cone on its tip", cone(0, 0.06, 0.1), cone_form(0, 0.06, 0.1)},
      {"cone of equal radii", cone(0.06, 0.06, 0.1), cone_form(0.06, 0.06, 0.1)},
      {"sphere", sphere(0.05), sphere_form(0.05)},
      {"ellipsoid", ellipsoid(0.05, 0.03, 0.08), ellipsoid_form(0.05, 0.03, 0.08, -1)},
      {"flat ellipsoid", ellipsoid(0.06, 0.06, 0.02), ellipsoid_form(0.06, 0.06, 0.02, oblate)},
      {"long ellipsoid", ellipsoid(0.02, 0.02, 0.06), ellipsoid_form(0.02, 0.02, 0.06, prolate)},
      {"torus", torus(0.08, 0.02), torus_form(0.08, 0.02)},
      {"frustum", frustum(0.2, 0.1, 0.05, 0.08, 0.15), frustum_form(0.2, 0.1, 0.05, 0.08, 0.15)},
      {"widening frustum", frustum(0.1, 0.1, 0.2, 0.3, 0.15),
       frustum_form(0.1, 0.1, 0.2, 0.3, 0.15)},
      {"pyramid", frustum(0.2, 0.1, 0, 0, 0.15), frustum_form(0.2, 0.1, 0, 0, 0.15)},
      {"wedge", frustum(0.2, 0.1, 0, 0.1, 0.15), frustum_form(0.2, 0.1, 0, 0.1, 0.15)}};
}
}  // namespace detail

GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(CsgConformance);

TEST_P(CsgConformance, PrimitivesHaveTheirClosedFormMoments) {
  for (const auto& c : detail::primitive_cases())
    expect_closed(moments(c.solid), c.want, GetParam().primitive_accuracy, c.name);
}

TEST_P(CsgConformance, WhatIsApproximateIsToldWithItsError) {
  for (const Csg& c : {sphere(0.05), cylinder(0.05, 0.2), cone(0.06, 0.02, 0.1), torus(0.08, 0.02),
                       ellipsoid(0.05, 0.03, 0.08)}) {
    const Moments m = moments(c);
    EXPECT_EQ(m.exact, !is_mesh()) << csg_info(c.node.kind).name;
    EXPECT_EQ(m.relative_error > 0, is_mesh()) << csg_info(c.node.kind).name;
  }
}

TEST_P(CsgConformance, FilletsFollowSteinersFormula) {
  // A body rounded by r is its core (shrunk by r) grown by a ball:
  // V = V0 + S0 r + M0 r^2 + 4/3 pi r^3, S = S0 + 2 M0 r + 4 pi r^2 (Steiner 1840), with
  // M0 = pi (a + b + c) for a box and pi h + pi^2 R for a cylinder.
  const double pi = detail::kPi;
  const auto check = [&](const Csg& c, double V0, double S0, double M0, double r,
                         const std::string& what) {
    const Moments m = moments(c);
    const double V = V0 + S0 * r + M0 * r * r + 4 * pi / 3 * r * r * r;
    const double S = S0 + 2 * M0 * r + 4 * pi * r * r;
    const double e = is_mesh() ? m.relative_error + 1e-9 : GetParam().boolean_accuracy;
    EXPECT_NEAR(m.volume, V, e * V) << what;
    EXPECT_NEAR(m.area, S, e * S) << what;
  };
  {
    const double r = 0.01, a = 0.2 - 2 * r, b = 0.1 - 2 * r, c = 0.05 - 2 * r;
    check(box(0.2, 0.1, 0.05, r), a * b * c, 2 * (a * b + b * c + c * a), pi * (a + b + c), r,
          "box");
  }
  {
    const double r = 0.01, R = 0.05 - r, h = 0.2 - 2 * r;
    check(cylinder(0.05, 0.2, r), pi * R * R * h, 2 * pi * R * (R + h), pi * h + pi * pi * R, r,
          "cylinder");
  }
}

TEST_P(CsgConformance, InclusionAndExclusionHoldsForAllMoments) {
  constexpr unsigned seed = 20120907;
  RecordProperty("seed", static_cast<int>(seed));
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(-1, 1);
  const std::vector<Csg> solids{box(0.10, 0.08, 0.06), cylinder(0.04, 0.12),
                                sphere(0.05),          cone(0.06, 0.02, 0.1),
                                torus(0.05, 0.02),     frustum(0.1, 0.1, 0.04, 0.06, 0.09)};
  for (std::size_t i = 0; i < solids.size(); ++i)
    for (std::size_t j = i; j < solids.size(); ++j) {
      const Csg a = solids[i];
      const Csg b =
          solids[j].at(turned({unit(random), unit(random), 1.5 + unit(random)}, 3 * unit(random),
                              {0.02 * unit(random), 0.02 * unit(random), 0.02}));
      const std::string what = "solids " + std::to_string(i) + ", " + std::to_string(j);
      const Moments A = moments(a), B = moments(b), both = moments(intersect({a, b}));
      ASSERT_GT(both.volume, 0) << what;
      const double tolerance = 10 * GetParam().boolean_accuracy;
      Moments either = sum(sum(A, B), both, -1), only = sum(A, both, -1);
      either.area = only.area = -1;
      expect_identity(moments(unite({a, b})), either, tolerance, {A, B, both}, what + " union");
      expect_identity(moments(subtract({a, b})), only, tolerance, {A, both}, what + " difference");
    }
}

TEST_P(CsgConformance, NestingAndGroupingDoNotChangeTheSolid) {
  const Csg a = box(0.1, 0.1, 0.1), b = cylinder(0.02, 0.3).at(0.01, 0, -0.1),
            c = sphere(0.03).at(0.05, 0.05, 0.1), d = box(0.02, 0.02, 0.3).at(-0.03, -0.03, -0.05);
  const double tolerance = 10 * GetParam().boolean_accuracy;
  expect_moments(moments(subtract({subtract({a, b}), c, d})), moments(subtract({a, b, c, d})),
                 tolerance, "chain of differences");
  expect_moments(moments(subtract({a, unite({b, c, d})})), moments(subtract({a, b, c, d})),
                 tolerance, "difference of a union");
  expect_moments(moments(unite({a, unite({b, unite({c, d})})})), moments(unite({a, b, c, d})),
                 tolerance, "nested unions");
  const Csg e = sphere(0.06).at(0.03, 0.02, 0.05);
  expect_moments(moments(intersect({a, intersect({b, e})})), moments(intersect({a, b, e})),
                 tolerance, "nested intersections");
}

TEST_P(CsgConformance, PlacementsMoveTheMomentsRigidly) {
  const double rounding = is_mesh() ? 1e-9 : 1e-12;
  const Csg part = subtract({box(0.1, 0.06, 0.04), cylinder(0.01, 0.1).at(0.02, 0.01, -0.02)});
  const Moments local = moments(part);
  const Pose p = turned({1, 2, 3}, 0.7, {0.3, -0.2, 0.5});
  const Pose q = turned({-2, 0.3, 1}, 2.1, {-0.1, 0.4, 0.2});
  expect_moments(moments(part.at(p)), moved(local, p), rounding, "root placement");
  expect_moments(moments(unite({part.at(p)}).at(q)), moved(moved(local, p), q), rounding,
                 "nested placements");
  const Csg two = unite({part.at(p), part.at(q)});
  Moments both = sum(moved(local, p), moved(local, q));
  both.area = -1;
  expect_moments(moments(two), both, rounding, "one part twice");
}

TEST_P(CsgConformance, BoundsEncloseTheSolidTightly) {
  const auto s = shape(subtract({cylinder(0.05, 0.2), box(0.02, 0.02, 0.1)}).at(0.1, 0.2, 0.3));
  ASSERT_NE(s, nullptr);
  const auto b = s->bounds();
  const Vec3 low{0.05, 0.15, 0.3}, high{0.15, 0.25, 0.5};
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_NEAR(b[0][i], low[i], is_mesh() ? 1e-3 : 1e-4);
    EXPECT_NEAR(b[1][i], high[i], is_mesh() ? 1e-3 : 1e-4);
    if (is_mesh()) continue;  // its box encloses its triangles
    EXPECT_LE(b[0][i], low[i] + 1e-9);
    EXPECT_GE(b[1][i], high[i] - 1e-9);
  }
}

TEST_P(CsgConformance, MeshesAreClosedFaceOutwardsAndKeepTheVolume) {
  const MeshQuality quality{2e-4, 0.3};
  std::vector<std::pair<std::string, Csg>> solids;
  for (const auto& c : detail::primitive_cases())
    if (c.name != "small box" && c.name != "large box") solids.emplace_back(c.name, c.solid);
  solids.emplace_back("rounded box", box(0.2, 0.1, 0.05, 0.01));
  solids.emplace_back("rounded cylinder", cylinder(0.05, 0.2, 0.01));
  solids.emplace_back("drilled box",
                      subtract({box(0.1, 0.1, 0.04), cylinder(0.01, 0.1).at(0.02, 0, -0.02),
                                cylinder(0.01, 0.02).at(-0.02, 0, 0.03),
                                cylinder(0.01, 0.02).at(-0.02, 0.03, 0.03)}));
  solids.emplace_back(
      "sphere and cylinders",
      subtract({sphere(0.05), cylinder(0.02, 0.2).at(0, 0, -0.1),
                cylinder(0.02, 0.2).at(turned({0, 1, 0}, 1.5707963267948966, {-0.1, 0, 0}))}));
  solids.emplace_back("turned and moved",
                      unite({box(0.1, 0.1, 0.1), sphere(0.05).at(0.05, 0.02, 0.1)})
                          .at(turned({1, -1, 2}, 0.9, {0.4, 0.1, -0.3})));
  for (const auto& [name, solid] : solids) {
    SCOPED_TRACE(name);
    const Mesh m = mesh(solid, quality);
    const Moments exact = moments(solid);
    ASSERT_GT(m.triangle_count(), 0U);
    ASSERT_EQ(m.normals.size(), m.positions.size());
    const MeshFacts f = facts(m, quality.chord);
    EXPECT_EQ(f.unbalanced_sides, 0U);
    EXPECT_EQ(f.degenerate, 0U);
    EXPECT_EQ(f.inward_normals, 0U);
    EXPECT_LT(f.worst_normal_length, 1e-5);
    // The mesh lies within one chord of the surface.
    EXPECT_NEAR(f.volume, exact.volume, exact.area * quality.chord + volume_slack(exact, 0));
    std::size_t in_faces = 0;
    for (const auto& face : m.faces) {
      EXPECT_EQ(face.first_triangle, in_faces);
      in_faces += face.triangle_count;
    }
    if (!m.faces.empty()) {
      EXPECT_EQ(in_faces, m.triangle_count());
    }
    std::size_t points = 0;
    for (const std::uint32_t n : m.edge_sizes) points += n;
    EXPECT_EQ(points * 3, m.edge_points.size());
  }
}

TEST_P(CsgConformance, FinerMeshesComeCloserAndCoarserOnesGetSmaller) {
  const Csg solid = sphere(0.05);
  const double exact = moments(solid).volume;
  const Mesh coarse = mesh(solid, {1e-3, 0.5}), fine = mesh(solid, {1e-5, 0.5});
  const Mesh again = mesh(solid, {1e-3, 0.5});
  // An engine that works on triangles throughout has no finer ones to give.
  if (!is_mesh()) {
    EXPECT_LT(exact - facts(fine).volume, 0.2 * (exact - facts(coarse).volume));
  }
  EXPECT_EQ(again.triangles, coarse.triangles);
  EXPECT_EQ(again.positions, coarse.positions);
}

TEST_P(CsgConformance, FeatureEdgesAreTheSharpOnes) {
  const MeshQuality quality{2e-4, 0.3};
  EXPECT_EQ(mesh(box(0.1, 0.1, 0.1), quality).edge_sizes.size(), 12U);
  EXPECT_EQ(mesh(sphere(0.1), quality).edge_sizes.size(), 0U);
  EXPECT_EQ(mesh(torus(0.1, 0.02), quality).edge_sizes.size(), 0U);
  EXPECT_EQ(mesh(cylinder(0.1, 0.1), quality).edge_sizes.size(), 2U);
  EXPECT_EQ(mesh(box(0.1, 0.1, 0.1, 0.02), quality).edge_sizes.size(), 0U);
  EXPECT_EQ(mesh(cylinder(0.1, 0.1, 0.02), quality).edge_sizes.size(), 0U);
  EXPECT_EQ(mesh(subtract({box(0.1, 0.1, 0.1), cylinder(0.02, 0.2).at(0, 0, -0.05)}), quality)
                .edge_sizes.size(),
            14U);
}

TEST_P(CsgConformance, AFaceKeepsItsIdWhileOthersChange) {
  const auto drilled = [](double x) {
    return subtract({box(0.1, 0.1, 0.02), cylinder(0.01, 0.1).at(x, 0, -0.05).named("bore")});
  };
  const MeshQuality quality{2e-4, 0.3};
  const auto ids = [&](double x) {
    std::vector<std::uint64_t> v;
    for (const auto& f : mesh(drilled(x), quality).faces) v.push_back(f.id);
    std::sort(v.begin(), v.end());
    EXPECT_EQ(std::adjacent_find(v.begin(), v.end()), v.end()) << "ids must differ";
    return v;
  };
  const auto before = ids(0.01), after = ids(0.02);
  if (is_mesh() && before.empty()) GTEST_SKIP() << "the engine does not tell faces apart";
  std::vector<std::uint64_t> kept;
  std::set_intersection(before.begin(), before.end(), after.begin(), after.end(),
                        std::back_inserter(kept));
  EXPECT_GE(kept.size(), 6U) << "the six faces of the box stayed";
}

TEST_P(CsgConformance, BadSizesAreRefusedByNode) {
  expect_error(box(0.1, 0, 0.1).named("plate"), {"\"plate\"", "box y", "0"});
  expect_error(
      subtract({box(0.1, 0.1, 0.1), cylinder(0.02, 0.1), cylinder(-0.01, 0.1).named("bore")}),
      {"node 3", "\"bore\"", "radius", "-0.01", "greater than 0"});
  expect_error(sphere(std::nan("")), {"node 0", "radius"});
  expect_error(sphere(INFINITY), {"node 0", "radius"});
  expect_error(cone(0, 0, 0.1), {"cone"});
  expect_error(cone(-0.1, 0.1, 0.1), {"base radius"});
  expect_error(torus(0.02, 0.05), {"torus", "tube"});
  expect_error(box(0.1, 0.1, 0.04, 0.02), {"fillet", "0.02"});
  expect_error(box(0.1, 0.1, 0.04, -0.01), {"fillet"});
  expect_error(cylinder(0.05, 0.02, 0.01), {"fillet"});
  expect_error(frustum(0, 0.1, 0.1, 0.1, 0.1), {"base x"});
  expect_error(frustum(0.1, 0.1, -0.1, 0.1, 0.1), {"top x"});
}

TEST_P(CsgConformance, BadTreesAreRefused) {
  expect_error(CsgTree{}, ErrorCode::invalid_argument, {"no nodes"});
  CsgTree tree = unite({box(1, 1, 1), sphere(1)}).tree();
  const auto with = [&](std::size_t node, std::int32_t parent) {
    CsgTree t = tree;
    t.nodes[node].parent = parent;
    return t;
  };
  expect_error(with(2, 7), ErrorCode::invalid_argument, {"node 2", "parent"});
  expect_error(with(2, 2), ErrorCode::invalid_argument, {"node 2", "parent"});
  expect_error(with(2, -1), ErrorCode::invalid_argument, {"node 2", "parent"});
  expect_error(with(2, -5), ErrorCode::invalid_argument, {"node 2", "parent"});
  expect_error(with(2, 1), ErrorCode::invalid_argument, {"node 2", "primitive"});
  expect_error(with(0, 0), ErrorCode::invalid_argument, {"node 0", "parent"});
  expect_error(unite({}), {"node 0", "children"});
  CsgTree odd = tree;
  odd.nodes[1].kind = static_cast<CsgKind>(99);
  expect_error(odd, ErrorCode::invalid_argument, {"node 1"});
  CsgTree sheared = tree;
  sheared.nodes[1].placement.R[1] = 0.3;
  expect_error(sheared, ErrorCode::invalid_argument, {"node 1", "placement"});
  CsgTree mirrored = tree;
  mirrored.nodes[1].placement.R[0] = -1;
  expect_error(mirrored, ErrorCode::invalid_argument, {"node 1", "placement"});
  CsgTree lost = tree;
  lost.nodes[1].placement.p[1] = std::nan("");
  expect_error(lost, ErrorCode::invalid_argument, {"node 1", "placement"});
}

TEST_P(CsgConformance, EmptyResultsAreRefusedByNode) {
  expect_error(subtract({box(0.1, 0.1, 0.1), sphere(1)}).named("nothing"),
               {"\"nothing\"", "empty"});
  expect_error(intersect({sphere(0.1), sphere(0.1).at(1, 0, 0)}), {"node 0", "empty"});
  expect_error(intersect({sphere(0.1), sphere(0.1).at(0.15, 0.15, 0)}), {"node 0", "empty"});
  const Csg nothing =
      intersect({box(0.1, 0.1, 0.1), box(0.1, 0.1, 0.1).at(1, 0, 0)}).named("inner");
  expect_error(unite({nothing, nothing}), {"\"inner\"", "empty"});
  expect_error(intersect({box(1, 1, 1), nothing}), {"empty"});
  expect_error(subtract({nothing, box(1, 1, 1)}), {"\"inner\"", "empty"});
}

TEST_P(CsgConformance, EmptyOperandsAreNothing) {
  const Csg a = box(0.1, 0.1, 0.1), b = cylinder(0.02, 0.3).at(0.01, 0, -0.1);
  const Csg apart = intersect({sphere(0.1), sphere(0.1).at(1, 0, 0)}),
            gone = subtract({box(0.1, 0.1, 0.1), sphere(1)});
  const double tolerance = 10 * GetParam().boolean_accuracy;
  for (const Csg& nothing : {apart, gone, unite({apart, gone}), subtract({gone, apart})}) {
    expect_moments(moments(unite({a, nothing, b})), moments(unite({a, b})), tolerance, "sum");
    expect_moments(moments(unite({nothing, a, b})), moments(unite({a, b})), tolerance,
                   "sum that begins with nothing");
    expect_moments(moments(subtract({a, nothing, b})), moments(subtract({a, b})), tolerance,
                   "difference");
    expect_moments(moments(unite({a, intersect({b, nothing})})), moments(a), tolerance,
                   "intersection with nothing");
  }
}

TEST_P(CsgConformance, CancelledWorkStops) {
  CancelledProgress cancelled;
  const Csg c = subtract({box(0.1, 0.1, 0.1), cylinder(0.02, 0.3).at(0, 0, -0.1)});
  const auto none = engine->evaluate(c.tree(), cancelled);
  ASSERT_FALSE(none.ok());
  EXPECT_EQ(none.error().code, ErrorCode::cancelled);
  const auto s = shape(c);
  ASSERT_NE(s, nullptr);
  const auto no_mesh = engine->mesh(*s, {}, cancelled);
  ASSERT_FALSE(no_mesh.ok());
  EXPECT_EQ(no_mesh.error().code, ErrorCode::cancelled);
  const std::vector<PlacedShape> parts{{s, {}}, {s, turned({0, 0, 1}, 0.3)}};
  const auto no_partition = engine->partition(parts, cancelled);
  ASSERT_FALSE(no_partition.ok());
  EXPECT_EQ(no_partition.error().code, ErrorCode::cancelled);
  EXPECT_GT(facts(mesh(c, {})).volume, 0) << "cancelling must leave nothing half done";
}

TEST_P(CsgConformance, DeepTreesDoNotOverflow) {
  // Alternating operations, each moved by 1 mm, every hundredth with a second child far away.
  CsgTree tree;
  for (int i = 0; i < 2000; ++i) {
    CsgNode node;
    node.kind = i % 2 == 0 ? CsgKind::union_ : CsgKind::difference;
    node.parent = i - 1;
    node.placement.p[0] = 1e-3;
    tree.nodes.push_back(node);
  }
  CsgNode leaf = box(0.1, 0.1, 0.1).node;
  leaf.parent = 1999;
  tree.nodes.push_back(leaf);
  for (int i = 1; i < 2000; i += 100) {
    CsgNode miss = sphere(0.01).node;
    miss.parent = i;
    miss.placement.p[2] = 5;
    tree.nodes.push_back(miss);
  }
  NoProgress progress;
  const auto result = engine->evaluate(tree, progress);
  ASSERT_TRUE(result.ok()) << result.error().sentence();
  const Moments m = moments(**result);
  EXPECT_NEAR(m.volume, 1e-3, volume_slack(m, GetParam().boolean_accuracy));
  EXPECT_NEAR(m.first[0] / m.volume, 2.0, 1e-6);
}

TEST_P(CsgConformance, LongChainsOfDifferencesDoNotOverflow) {
  CsgTree tree;
  constexpr int depth = 2000;
  for (int i = 0; i < depth; ++i) {
    CsgNode node;
    node.kind = CsgKind::difference;
    node.parent = i - 1;
    tree.nodes.push_back(node);
  }
  CsgNode leaf = box(0.1, 0.1, 0.1).node;
  leaf.parent = depth - 1;
  tree.nodes.push_back(leaf);
  for (int i = depth - 1; i >= 0; --i) {
    CsgNode tool = cylinder(0.001, 0.3).node;
    tool.parent = i;
    // Eight of them cut, the others miss.
    tool.placement.p = {i % 250 == 0 ? 0.01 * (i / 250 - 4) : 1.0 + 0.01 * i, 0, -0.1};
    tree.nodes.push_back(tool);
  }
  NoProgress progress;
  const auto result = engine->evaluate(tree, progress);
  ASSERT_TRUE(result.ok()) << result.error().sentence();
  const double want = 1e-3 - 8 * detail::kPi * 1e-6 * 0.1;
  const Moments m = moments(**result);
  EXPECT_NEAR(m.volume, want, volume_slack(m, GetParam().boolean_accuracy));
}

TEST_P(CsgConformance, EditsGiveWhatAFreshEngineGives) {
  const auto part = [](double x) {
    return subtract({unite({cylinder(0.06, 0.08), cylinder(0.045, 0.08).at(0.3, 0, 0),
                            box(0.3, 0.06, 0.05).at(0.15, 0, 0.015)}),
                     cylinder(0.025, 0.2).at(0, 0, -0.05), cylinder(0.018, 0.2).at(0.3, 0, -0.05),
                     cylinder(0.004, 0.2).at(0.045, 0, -0.05),
                     cylinder(0.004, 0.2).at(x, 0, -0.05)});
  };
  const MeshQuality quality{2e-4, 0.3};
  for (const double x : {0.15, 0.151, 0.152, 0.15}) {
    const Csg c = part(x);
    const Moments here = moments(c);
    const MeshFacts f = facts(mesh(c, quality));
    EXPECT_EQ(f.unbalanced_sides, 0U);
    const auto fresh = GetParam().make();
    NoProgress progress;
    const auto s = fresh->evaluate(c.tree(), progress);
    ASSERT_TRUE(s.ok()) << s.error().sentence();
    expect_moments(here, *fresh->moments(**s, progress), GetParam().boolean_accuracy,
                   "hole at " + std::to_string(x));
  }
}

TEST_P(CsgConformance, TwoThreadsGetWhatOneGets) {
  const auto part = [](int i) {
    return subtract({sphere(0.05), cylinder(0.01 + 0.0005 * (i % 5), 0.2).at(0.001 * i, 0, -0.1)});
  };
  constexpr int count = 12;
  std::vector<Moments> want;
  for (int i = 0; i < count; ++i) want.push_back(moments(part(i)));
  const auto shared = GetParam().make();
  std::array<std::vector<std::pair<Moments, std::size_t>>, 2> got;
  const auto work = [&](std::size_t thread) {
    NoProgress progress;
    for (int k = 0; k < count; ++k) {
      const int i = thread == 0 ? k : count - 1 - k;
      const auto s = shared->evaluate(part(i).tree(), progress);
      if (!s.ok()) return;
      const auto triangles = shared->mesh(**s, {2e-4, 0.3}, progress);
      const auto m = shared->moments(**s, progress);
      if (!triangles.ok() || !m.ok()) return;
      got[thread].emplace_back(*m, facts(*triangles).unbalanced_sides);
    }
  };
  std::thread first(work, 0), second(work, 1);
  first.join();
  second.join();
  for (std::size_t thread = 0; thread < 2; ++thread) {
    ASSERT_EQ(got[thread].size(), static_cast<std::size_t>(count)) << "a call failed";
    for (std::size_t k = 0; k < static_cast<std::size_t>(count); ++k) {
      const std::size_t i = thread == 0 ? k : count - 1 - k;
      expect_moments(got[thread][k].first, want[i], GetParam().boolean_accuracy,
                     "solid " + std::to_string(i));
      EXPECT_EQ(got[thread][k].second, 0U);
    }
  }
}

TEST_P(CsgConformance, OverlappingPartsCountOnceAndTheEarlierWins) {
  const auto a = shape(box(0.2, 0.2, 0.05)), b = shape(cylinder(0.05, 0.2)),
             c = shape(sphere(0.04));
  ASSERT_TRUE(a && b && c);
  Pose on_b, on_c;
  on_b.p = {0, 0.05, 0.02};
  on_c.p = {0.06, 0, 0.05};
  const std::vector<PlacedShape> parts{{a, {}}, {b, on_b}, {c, on_c}};
  NoProgress progress;
  const auto result = engine->partition(parts, progress);
  ASSERT_TRUE(result.ok()) << result.error().sentence();
  ASSERT_EQ(result->parts.size(), 3U);
  const double tolerance = 10 * GetParam().boolean_accuracy;
  expect_moments(result->parts[0], moments(*a), tolerance, "the first part keeps everything");
  const Csg A = box(0.2, 0.2, 0.05), B = cylinder(0.05, 0.2).at(on_b), C = sphere(0.04).at(on_c);
  Moments together = sum(sum(result->parts[0], result->parts[1]), result->parts[2]);
  Moments whole = moments(unite({A, B, C}));
  whole.area = -1;
  expect_moments(together, whole, tolerance, "all parts together are the union");
  const Moments only_b = moments(subtract({B, A}));
  expect_moments(result->parts[1], only_b, tolerance, "the second part");
  const double naive = moments(A).volume + moments(B).volume + moments(C).volume;
  EXPECT_NEAR(result->overlap, naive - whole.volume, tolerance * naive);
}

TEST_P(CsgConformance, PartsThatOnlyTouchOrLieApartKeepTheirMoments) {
  const auto s = shape(box(0.1, 0.1, 0.1));
  ASSERT_NE(s, nullptr);
  std::vector<PlacedShape> parts;
  for (int i = 0; i < 20; ++i) {
    Pose p;
    p.p = {0.1 * i, 0, 0};
    parts.push_back({s, p});
  }
  NoProgress progress;
  const auto result = engine->partition(parts, progress);
  ASSERT_TRUE(result.ok()) << result.error().sentence();
  EXPECT_NEAR(result->overlap, 0, 1e-12);
  for (std::size_t i = 0; i < parts.size(); ++i)
    expect_moments(result->parts[i], moved(moments(*s), parts[i].placement), 1e-9,
                   "part " + std::to_string(i));
}

TEST_P(CsgConformance, ASwallowedPartHasNothingLeft) {
  const auto big = shape(box(1, 1, 1)), small = shape(sphere(0.1));
  ASSERT_TRUE(big && small);
  Pose inside;
  inside.p = {0, 0, 0.5};
  NoProgress progress;
  const auto result =
      engine->partition(std::vector<PlacedShape>{{big, {}}, {small, inside}}, progress);
  ASSERT_TRUE(result.ok()) << result.error().sentence();
  EXPECT_NEAR(result->parts[1].volume, 0, 1e-12);
  EXPECT_NEAR(result->overlap, moments(*small).volume, 1e-9);
}

TEST_P(CsgConformance, ShapesOfOtherEnginesAreRefused) {
  class Foreign final : public CsgShape {
   public:
    std::array<Vec3, 2> bounds() const override { return {}; }
    std::span<const std::string> notes() const override { return {}; }
  };
  NoProgress progress;
  const Foreign foreign;
  EXPECT_FALSE(engine->mesh(foreign, {}, progress).ok());
  EXPECT_FALSE(engine->moments(foreign, progress).ok());
  EXPECT_FALSE(engine->partition(std::vector<PlacedShape>{{nullptr, {}}}, progress).ok());
}

TEST_P(CsgConformance, ImpossibleMeshQualityIsRefused) {
  const auto s = shape(sphere(0.1));
  ASSERT_NE(s, nullptr);
  NoProgress progress;
  for (const MeshQuality q :
       {MeshQuality{0, 0.3}, MeshQuality{-1, 0.3}, MeshQuality{1e-4, 0},
        MeshQuality{std::nan(""), 0.3}, MeshQuality{1e-4, std::nan("")}, MeshQuality{1e-15, 0.3}})
    EXPECT_FALSE(engine->mesh(*s, q, progress).ok());
}

}  // namespace robomosp::conformance

#include <robomosp/sdk/conformance/csg_suite_kinds.h>
