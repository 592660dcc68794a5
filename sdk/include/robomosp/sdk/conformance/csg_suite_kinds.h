// SPDX-License-Identifier: Apache-2.0
// Conformance suite of interface robomosp.csg/1, second part: drawn and imported primitives,
// modifiers, features, sections and geometry (layer: contract). Included by csg_suite.h.
#pragma once

#include <robomosp/sdk/conformance/csg_suite.h>

namespace robomosp::conformance {

inline Csg modifier(CsgKind kind, Csg child, std::array<double, 6> sizes, std::string select = {}) {
  Csg c = operation(kind, {std::move(child)});
  c.node.sizes = sizes;
  c.node.select = std::move(select);
  return c;
}
inline Csg fillet(Csg child, double radius, std::string select = {}) {
  return modifier(CsgKind::fillet, std::move(child), {radius}, std::move(select));
}
inline Csg chamfer(Csg child, double distance, std::string select = {}) {
  return modifier(CsgKind::chamfer, std::move(child), {distance}, std::move(select));
}
inline Csg mirror(Csg child, Vec3 normal, double offset, bool keep) {
  return modifier(CsgKind::mirror, std::move(child),
                  {normal[0], normal[1], normal[2], offset, keep ? 1.0 : 0.0});
}
inline Csg linear_pattern(Csg child, int count, Vec3 step) {
  return modifier(CsgKind::linear_pattern, std::move(child),
                  {double(count), step[0], step[1], step[2]});
}
inline Csg circular_pattern(Csg child, int count, double angle = kCsgFullTurn) {
  return modifier(CsgKind::circular_pattern, std::move(child), {double(count), angle});
}
inline Csg wedge(double x, double y, double z, double top_x = 0) {
  return primitive(CsgKind::wedge, {x, y, z, top_x});
}
inline Csg pyramid(int sides, double radius, double top_radius, double height) {
  return primitive(CsgKind::pyramid, {double(sides), radius, top_radius, height});
}
inline Csg prism(CsgProfile profile, double height) {
  Csg c = primitive(CsgKind::prism, {height});
  c.node.profile = std::make_shared<const CsgProfile>(std::move(profile));
  return c;
}
inline Csg revolution(CsgProfile profile, double angle = kCsgFullTurn) {
  Csg c = primitive(CsgKind::revolution, {angle});
  c.node.profile = std::make_shared<const CsgProfile>(std::move(profile));
  return c;
}
inline Csg imported(CsgGeometry geometry, double scale = 1) {
  Csg c = primitive(CsgKind::imported, {scale});
  c.node.geometry = std::make_shared<const CsgGeometry>(std::move(geometry));
  return c;
}

using Point2 = std::array<double, 2>;
inline CsgCurve line_to(double x, double y) { return {CsgCurve::Kind::line, {{x, y}}}; }
inline CsgCurve arc_to(Point2 through, Point2 end) { return {CsgCurve::Kind::arc, {through, end}}; }
inline CsgCurve spline_to(std::vector<Point2> points) {
  return {CsgCurve::Kind::spline, std::move(points)};
}
inline CsgLoop circle_loop(double x, double y, double radius) {
  return {{}, {{CsgCurve::Kind::circle, {{x, y}, {radius, 0}}}}};
}
inline CsgLoop polygon_loop(const std::vector<Point2>& corners) {
  CsgLoop loop{corners[0], {}};
  for (std::size_t i = 1; i < corners.size(); ++i)
    loop.curves.push_back(line_to(corners[i][0], corners[i][1]));
  return loop;
}
inline CsgLoop rectangle_loop(double x0, double y0, double x1, double y1) {
  return polygon_loop({{x0, y0}, {x1, y0}, {x1, y1}, {x0, y1}});
}

namespace detail {

/// Area integrals of a plane region: 1, x, y, x x, y y, x y.
struct Flat {
  double a = 0, x = 0, y = 0, xx = 0, yy = 0, xy = 0;
};
inline Flat plus(const Flat& p, const Flat& q, double factor = 1) {
  return {p.a + factor * q.a,   p.x + factor * q.x,   p.y + factor * q.y,
          p.xx + factor * q.xx, p.yy + factor * q.yy, p.xy + factor * q.xy};
}
/// The same region moved by (dx, dy).
inline Flat shifted(const Flat& f, double dx, double dy) {
  return {f.a,
          f.x + f.a * dx,
          f.y + f.a * dy,
          f.xx + 2 * f.x * dx + f.a * dx * dx,
          f.yy + 2 * f.y * dy + f.a * dy * dy,
          f.xy + f.x * dy + f.y * dx + f.a * dx * dy};
}
inline Flat rectangle(double w, double h) {  // about its middle
  return {w * h, 0, 0, w * w * w * h / 12, w * h * h * h / 12, 0};
}
inline Flat disc(double r) {
  const double a = kPi * r * r;
  return {a, 0, 0, a * r * r / 4, a * r * r / 4, 0};
}
inline Flat right_half_disc(double r) {
  const double a = kPi * r * r / 2;
  return {a, 2 * r * r * r / 3, 0, a * r * r / 4, a * r * r / 4, 0};
}
inline Flat triangle(Point2 p, Point2 q, Point2 r) {
  const double a = ((q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])) / 2;
  // Exact for polynomials of degree 2: the middles of the sides.
  Flat f;
  for (const auto& [u, v] : {std::pair{p, q}, std::pair{q, r}, std::pair{r, p}}) {
    const double x = (u[0] + v[0]) / 2, y = (u[1] + v[1]) / 2;
    f = plus(f, {a / 3, a / 3 * x, a / 3 * y, a / 3 * x * x, a / 3 * y * y, a / 3 * x * y});
  }
  return f;
}
/// Integral of f over a..b, exact for polynomials up to degree 9.
template <class F>
double gauss5(double a, double b, F&& f) {
  const double p = std::sqrt(5 - 2 * std::sqrt(10.0 / 7)) / 3,
               q = std::sqrt(5 + 2 * std::sqrt(10.0 / 7)) / 3, s = std::sqrt(70.0);
  const double wp = (322 + 13 * s) / 900, wq = (322 - 13 * s) / 900, m = (a + b) / 2,
               h = (b - a) / 2;
  return h * (128.0 / 225 * f(m) + wp * (f(m - h * p) + f(m + h * p)) +
              wq * (f(m - h * q) + f(m + h * q)));
}
/// Moments of a solid from 0 to h with cross-section flat(z) at z, a polynomial in z.
template <class F>
Moments stacked(double h, F&& flat) {
  const auto total = [&](auto&& pick) { return gauss5(0, h, pick); };
  Moments m;
  m.area = -1;
  m.volume = total([&](double z) { return flat(z).a; });
  m.first = {total([&](double z) { return flat(z).x; }), total([&](double z) { return flat(z).y; }),
             total([&](double z) { return flat(z).a * z; })};
  m.second = {total([&](double z) { return flat(z).xx; }),
              total([&](double z) { return flat(z).yy; }),
              total([&](double z) { return flat(z).a * z * z; }),
              total([&](double z) { return flat(z).xy; }),
              total([&](double z) { return flat(z).y * z; }),
              total([&](double z) { return flat(z).x * z; })};
  return m;
}
inline Moments extruded(const Flat& f, double h) {
  return stacked(h, [&](double) { return f; });
}
/// A full turn about z of a region in the xz plane: volume 2 pi int x, first z 2 pi int x z, second
/// xx = yy = pi int x^3, zz = 2 pi int x z^2.
inline Moments turned_round(double x, double xz, double xxx, double xzz) {
  Moments m = closed_form(2 * kPi * x, 2 * kPi * xz, kPi * xxx, kPi * xxx, 2 * kPi * xzz);
  return m;
}
inline Flat regular(int n, double r) {
  const double t = kCsgFullTurn / n, a = n * r * r * std::sin(t) / 2,
               xx = a * r * r * (2 + std::cos(t)) / 12;
  return {a, 0, 0, xx, xx, 0};
}

/// The natural spline through (-a, 0), (0, h), (a, 0): x is linear in the parameter, and y over
/// x in -a..0 is h (3 s - s^3) / 2 with s = 1 + x / a, by the equations of the natural spline.
inline double hump(double x, double a, double h) {
  const double s = 1 - std::abs(x) / a;
  return h * (3 * s - s * s * s) / 2;
}
inline CsgProfile hump_profile(double cx, double cy, double a, double h) {
  return {{{{cx + a, cy}, {spline_to({{cx, cy + h}, {cx - a, cy}})}}}};
}
/// Integral of f(x, y) over the hump about (cx, cy), for polynomials f of degree at most 2 in y and
/// 3 in x (degree 9 and below with y up to 3).
template <class F>
double over_hump(double cx, double cy, double a, double h, F&& f) {
  const auto column = [&](double x) {
    const double top = hump(x, a, h);
    return gauss5(0, top, [&](double y) { return f(cx + x, cy + y); });
  };
  return gauss5(-a, -a / 2, column) + gauss5(-a / 2, 0, column) + gauss5(0, a / 2, column) +
         gauss5(a / 2, a, column);
}

inline std::vector<PrimitiveCase> kind_cases() {
  std::vector<PrimitiveCase> cases;
  const auto wedge_form = [](double x, double y, double z, double top) {
    return stacked(z, [=](double h) {
      const double w = x + (top - x) * h / z;
      return shifted(rectangle(w, y), (w - x) / 2, 0);
    });
  };
  cases.push_back({"wedge", wedge(0.2, 0.1, 0.05), wedge_form(0.2, 0.1, 0.05, 0)});
  cases.push_back({"blunt wedge", wedge(0.2, 0.1, 0.05, 0.07), wedge_form(0.2, 0.1, 0.05, 0.07)});
  cases.push_back(
      {"wedge that is a box", wedge(0.2, 0.1, 0.05, 0.2), wedge_form(0.2, 0.1, 0.05, 0.2)});
  cases.push_back(
      {"ridge along y", frustum(0.2, 0.1, 0, 0.07, 0.15), frustum_form(0.2, 0.1, 0, 0.07, 0.15)});
  cases.push_back(
      {"ridge along x", frustum(0.2, 0.1, 0.3, 0, 0.15), frustum_form(0.2, 0.1, 0.3, 0, 0.15)});
  const auto pyramid_form = [](int n, double r, double top, double h) {
    return stacked(h, [=](double z) { return regular(n, r + (top - r) * z / h); });
  };
  for (const int n : {3, 4, 7, 24})
    cases.push_back({"pyramid " + std::to_string(n), pyramid(n, 0.05, 0, 0.08),
                     pyramid_form(n, 0.05, 0, 0.08)});
  cases.push_back({"cut pyramid", pyramid(5, 0.05, 0.02, 0.08), pyramid_form(5, 0.05, 0.02, 0.08)});
  cases.push_back({"hexagon", pyramid(6, 0.05, 0.05, 0.08), pyramid_form(6, 0.05, 0.05, 0.08)});
  cases.push_back({"triangular prism",
                   prism({{polygon_loop({{0.01, 0}, {0.07, 0.02}, {0.03, 0.09}})}}, 0.04),
                   extruded(triangle({0.01, 0}, {0.07, 0.02}, {0.03, 0.09}), 0.04)});
  {
    // A slot 0.08 between centres, clockwise on purpose, with a round hole and an island in that.
    CsgLoop slot{{-0.04, -0.03}, {}};
    slot.curves = {arc_to({-0.07, 0}, {-0.04, 0.03}), line_to(0.04, 0.03),
                   arc_to({0.07, 0}, {0.04, -0.03}), line_to(-0.04, -0.03)};
    const Flat half = right_half_disc(0.03);
    const Flat other{half.a, -half.x, 0, half.xx, half.yy, 0};
    Flat flat = plus(rectangle(0.08, 0.06), plus(shifted(half, 0.04, 0), shifted(other, -0.04, 0)));
    flat = plus(flat, shifted(disc(0.02), 0.01, 0.002), -1);
    flat = plus(flat, shifted(rectangle(0.01, 0.012), 0.01, 0.001));
    cases.push_back({"slot with hole and island",
                     prism({{rectangle_loop(0.005, -0.005, 0.015, 0.007),
                             circle_loop(0.01, 0.002, 0.02), slot}},
                           0.03),
                     extruded(flat, 0.03)});
  }
  {
    const double a = 0.04, h = 0.03, t = 0.02, cx = 0.01, cy = -0.02;
    const auto in = [&](auto&& f) { return over_hump(cx, cy, a, h, f); };
    Flat flat{
        in([](double, double) { return 1.0; }),     in([](double x, double) { return x; }),
        in([](double, double y) { return y; }),     in([](double x, double) { return x * x; }),
        in([](double, double y) { return y * y; }), in([](double x, double y) { return x * y; })};
    cases.push_back({"spline prism", prism(hump_profile(cx, cy, a, h), t), extruded(flat, t)});
    const double rx = 0.07;
    const auto round = [&](auto&& f) { return over_hump(rx, cy, a, h, f); };
    cases.push_back({"spline revolution", revolution(hump_profile(rx, cy, a, h)),
                     turned_round(round([](double x, double) { return x; }),
                                  round([](double x, double y) { return x * y; }),
                                  round([](double x, double) { return x * x * x; }),
                                  round([](double x, double y) { return x * y * y; }))});
  }
  {
    // A rectangle beside the axis, turned by a part of a turn: by cylindrical coordinates.
    const double r = 0.03, R = 0.05, h = 0.02, angle = 2.2;
    Moments m;
    m.area = -1;
    m.volume = angle * (R * R - r * r) / 2 * h;
    const double cube = (R * R * R - r * r * r) / 3, fourth = (std::pow(R, 4) - std::pow(r, 4)) / 4;
    const double c = std::cos(angle), s = std::sin(angle), c2 = std::sin(2 * angle) / 4;
    m.first = {cube * s * h, cube * (1 - c) * h, m.volume * h / 2};
    m.second = {fourth * (angle / 2 + c2) * h, fourth * (angle / 2 - c2) * h, m.volume * h * h / 3,
                fourth * s * s / 2 * h,        cube * (1 - c) * h * h / 2,    cube * s * h * h / 2};
    cases.push_back({"part of a ring", revolution({{rectangle_loop(r, 0, R, h)}}, angle), m});
  }
  {
    // On the axis: a half disc gives a ball.
    const double r = 0.05, v = 4 * kPi / 3 * r * r * r;
    CsgLoop half{{0, -r}, {arc_to({r, 0}, {0, r})}};
    cases.push_back({"turned half disc", revolution({{half}}),
                     closed_form(v, 0, v * r * r / 5, v * r * r / 5, v * r * r / 5)});
    cases.push_back({"turned circle", revolution({{circle_loop(0.08, 0, 0.02)}}),
                     closed_form(2 * kPi * kPi * 0.08 * 4e-4, 0,
                                 2 * kPi * kPi * 0.08 * 4e-4 * (0.0032 + 1.5e-4),
                                 2 * kPi * kPi * 0.08 * 4e-4 * (0.0032 + 1.5e-4),
                                 2 * kPi * kPi * 0.08 * 4e-4 * 1e-4)});
  }
  return cases;
}

/// A box as a triangle mesh.
inline CsgGeometry box_mesh(double x, double y, double z) {
  CsgGeometry g;
  g.form = CsgGeometry::Form::mesh;
  for (const double h : {0.0, z})
    for (const auto& [i, j] : {std::pair{-1, -1}, {1, -1}, {1, 1}, {-1, 1}})
      g.points.insert(g.points.end(), {i * x / 2, j * y / 2, h});
  g.triangles = {0, 2, 1, 0, 3, 2, 4, 5, 6, 4, 6, 7, 0, 1, 5, 0, 5, 4,
                 1, 2, 6, 1, 6, 5, 2, 3, 7, 2, 7, 6, 3, 0, 4, 3, 4, 7};
  g.digest = {1, 2};
  g.source = "box.stl";
  return g;
}
}  // namespace detail

TEST_P(CsgConformance, DrawnAndPlanePrimitivesHaveTheirClosedFormMoments) {
  for (const auto& c : detail::kind_cases()) expect_closed(moments(c.solid), c.want, 1e-11, c.name);
}

TEST_P(CsgConformance, DrawnAndPlanePrimitivesHaveClosedMeshesAndBooleans) {
  for (const auto& c : detail::kind_cases()) {
    SCOPED_TRACE(c.name);
    const MeshFacts f = facts(mesh(c.solid, {2e-4, 0.3}), 2e-4);
    EXPECT_EQ(f.unbalanced_sides, 0U);
    EXPECT_EQ(f.degenerate, 0U);
    EXPECT_EQ(f.inward_normals, 0U);
    const Moments whole = moments(c.solid);
    EXPECT_NEAR(f.volume, whole.volume, whole.area * 2e-4 + volume_slack(whole, 0));
    const Csg knife = box(0.4, 0.4, 0.4).at(turned({0.2, 0.3, 1}, 0.4, {0.21, 0.02, -0.2}));
    const Moments left = moments(subtract({c.solid, knife})),
                  right = moments(intersect({c.solid, knife}));
    Moments want = whole;
    want.area = -1;
    expect_identity(sum(left, right), want, 10 * GetParam().boolean_accuracy, {whole, left, right},
                    "cut in two");
  }
}

TEST_P(CsgConformance, BadDrawingsAreRefused) {
  const auto loop = [](std::vector<CsgCurve> curves, Point2 start = {0.01, 0.01}) {
    return CsgLoop{start, std::move(curves)};
  };
  const auto refuse = [&](const std::vector<CsgLoop>& loops,
                          const std::vector<std::string>& words) {
    std::vector<std::string> all{"node 0", "\"drawing\""};
    all.insert(all.end(), words.begin(), words.end());
    expect_error(prism({loops}, 0.01).named("drawing"), all);
  };
  refuse({}, {"loop"});
  refuse({loop({})}, {"loop 1"});
  refuse({rectangle_loop(0, 0, 0.1, 0.1), loop({line_to(0.02, 0.01)})}, {"loop 2"});
  refuse({polygon_loop({{0, 0}, {0.1, 0.1}, {0.1, 0}, {0, 0.1}})}, {"loop 1"});
  refuse({rectangle_loop(0, 0, 0.1, 0.1), rectangle_loop(0.05, 0.05, 0.15, 0.15)},
         {"loop 1", "loop 2"});
  refuse({rectangle_loop(0, 0, 0.1, 0.1), rectangle_loop(0, 0.02, 0.05, 0.05)},
         {"loop 1", "loop 2"});
  refuse({rectangle_loop(0, 0, 0.1, 0.1), circle_loop(0.05, 0.05, 0.05)}, {"loop 1", "loop 2"});
  refuse({circle_loop(0, 0, 0.05), circle_loop(0.09, 0, 0.04)}, {"loop 1", "loop 2"});
  refuse({circle_loop(0, 0, 0.05), circle_loop(0, 0, 0.05)}, {"loop 1", "loop 2"});
  refuse({circle_loop(0, 0, 0)}, {"loop 1", "radius"});
  refuse({circle_loop(0, 0, std::nan(""))}, {"loop 1"});
  refuse({loop({arc_to({0.05, 0.05}, {0.09, 0.09}), line_to(0, 0.09)})}, {"loop 1", "arc"});
  refuse({loop({arc_to({0.05, 0.05}, {0.01, 0.01})})}, {"loop 1", "arc"});
  refuse({loop({arc_to({0.01, 0.01}, {0.05, 0.05}), line_to(0, 0.09)})}, {"loop 1", "arc"});
  refuse({loop({spline_to({{0.05, 0.05}, {0.05, 0.05}, {0, 0.1}})})}, {"loop 1", "spline"});
  refuse({loop({spline_to({{0.09, 0.09}, {0.09, 0.01}, {0.01, 0.09}})})}, {"loop 1", "spline"});
  refuse({loop({line_to(0.1, 0.01), line_to(0.1, std::nan(""))})}, {"loop 1"});
  refuse({loop({line_to(0.1, 0.01), {CsgCurve::Kind::line, {}}})}, {"loop 1"});
  // Back along itself.
  refuse({loop({line_to(0.1, 0.01), line_to(0.1, 0.05), line_to(0.1, 0.03), line_to(0, 0.03)})},
         {"loop 1"});
  expect_error(revolution({{rectangle_loop(-0.01, 0, 0.05, 0.05)}}).named("wheel"),
               {"\"wheel\"", "loop 1", "axis"});
  expect_error(revolution({{circle_loop(0.05, 0, 0.05)}}).named("wheel"), {"\"wheel\"", "axis"});
  expect_error(revolution({{rectangle_loop(0.01, 0, 0.05, 0.05)}}, 7).named("wheel"),
               {"\"wheel\"", "angle"});
  expect_error(primitive(CsgKind::prism, {0.1}).named("bare"), {"\"bare\"", "profile"});
  expect_error(prism({{rectangle_loop(0, 0, 1, 1)}}, 0), {"height"});
  expect_error(pyramid(2, 0.1, 0, 0.1), {"sides"});
  expect_error(primitive(CsgKind::pyramid, {3.5, 0.1, 0, 0.1}), {"sides"});
  expect_error(wedge(0.1, 0.1, 0.1, 0.2), {"top x"});
}

TEST_P(CsgConformance, MirrorImagesAreMirrored) {
  // The moments of a mirror image at x = offset: x becomes 2 offset - x.
  const auto image = [](const Moments& m, double offset) {
    Moments i = m;
    const double d = 2 * offset;
    i.first[0] = d * m.volume - m.first[0];
    i.second.xx = d * d * m.volume - 2 * d * m.first[0] + m.second.xx;
    i.second.xy = d * m.first[1] - m.second.xy;
    i.second.xz = d * m.first[2] - m.second.xz;
    return i;
  };
  const double tolerance = 10 * GetParam().boolean_accuracy;
  std::vector<std::pair<std::string, Csg>> parts;
  const Pose place = turned({1, 2, 3}, 0.8, {0.2, 0.1, -0.05});
  for (const auto& c : detail::kind_cases()) parts.emplace_back(c.name, c.solid.at(place));
  for (const auto& c : detail::primitive_cases())
    if (c.name != "large box" && c.name != "small box" && c.name != "flat cylinder")
      parts.emplace_back(c.name, c.solid.at(place));
  parts.emplace_back(
      "bracket", subtract({wedge(0.2, 0.1, 0.05, 0.05), cylinder(0.01, 0.2).at(-0.05, 0.02, -0.01)})
                     .at(place));
  for (const auto& [name, part] : parts) {
    const Moments m = moments(part);
    const Csg turned_over = mirror(part, {-2, 0, 0}, -0.3, false);
    expect_identity(moments(turned_over), image(m, 0.3), tolerance, {m}, name);
    const MeshFacts f = facts(mesh(turned_over, {2e-4, 0.3}), 2e-4);
    EXPECT_EQ(f.unbalanced_sides, 0U) << name;
    EXPECT_EQ(f.inward_normals, 0U) << name;
    EXPECT_NEAR(f.volume, m.volume, m.area * 2e-4 + volume_slack(m, 0)) << name;
    Moments both = sum(m, image(m, 0.5));
    both.area = -1;
    expect_identity(moments(mirror(part, {1, 0, 0}, 0.5, true)), both, tolerance, {m},
                    name + " and its image");
  }
  // Twice mirrored is a motion.
  const Csg part = parts.back().second;
  expect_identity(moments(mirror(mirror(part, {1, 0, 0}, 0, false), {0, 1, 0}, 0, false)),
                  moved(moments(part), turned({0, 0, 1}, detail::kPi)), tolerance, {}, "twice");
  // Across the plane: the union counts the middle once.
  expect_identity(moments(mirror(box(0.1, 0.1, 0.1), {1, 0, 0}, 0.02, true)),
                  moved(moments(box(0.14, 0.1, 0.1)), turned({0, 0, 1}, 0, {0.02, 0, 0})),
                  tolerance, {}, "overlapping");
  expect_error(mirror(box(0.1, 0.1, 0.1), {0, 0, 0}, 0, true).named("glass"),
               {"\"glass\"", "normal"});
}

TEST_P(CsgConformance, PatternsPlaceCopies) {
  const double tolerance = 10 * GetParam().boolean_accuracy;
  const Csg pin = subtract({cone(0.01, 0.006, 0.03), box(0.004, 0.004, 0.1)}).at(0.05, 0.01, 0);
  const Moments one = moments(pin);
  const auto check = [&](const Csg& c, const std::vector<Pose>& places, const std::string& what) {
    Moments want{};
    for (const Pose& p : places) want = sum(want, moved(one, p));
    want.area = -1;
    const Moments got = moments(c);
    expect_identity(got, want, tolerance, {got}, what);
  };
  const auto moves = [](int n, Vec3 d) {
    std::vector<Pose> v;
    for (int k = 0; k < n; ++k) v.push_back(turned({0, 0, 1}, 0, {d[0] * k, d[1] * k, d[2] * k}));
    return v;
  };
  const auto turns = [](int n, double step) {
    std::vector<Pose> v;
    for (int k = 0; k < n; ++k) v.push_back(turned({0, 0, 1}, step * k));
    return v;
  };
  check(linear_pattern(pin, 1, {0.03, 0, 0}), moves(1, {}), "one");
  check(linear_pattern(pin, 5, {0.03, -0.01, 0.02}), moves(5, {0.03, -0.01, 0.02}), "five");
  check(circular_pattern(pin, 5), turns(5, kCsgFullTurn / 5), "full turn");
  check(circular_pattern(pin, 4, 1.5), turns(4, 0.5), "both ends");
  check(circular_pattern(pin, 3, -1.5), turns(3, -0.75), "the other way");
  check(circular_pattern(pin, 1, 1.5), turns(1, 0), "a single one");
  // A pattern in a difference: a plate with 12 holes; and a pattern of patterns.
  const Csg hole = cylinder(0.004, 0.1).at(-0.05, -0.03, -0.04);
  const Csg holes = linear_pattern(linear_pattern(hole, 4, {0.03, 0, 0}), 3, {0, 0.03, 0});
  const Moments plate = moments(subtract({box(0.14, 0.1, 0.01), holes}));
  const double want = 0.14 * 0.1 * 0.01 - 12 * detail::kPi * 16e-6 * 0.01;
  EXPECT_NEAR(plate.volume, want, volume_slack(plate, GetParam().boolean_accuracy));
  // Overlapping copies are one solid.
  const Moments bar = moments(linear_pattern(box(0.1, 0.02, 0.03), 4, {0.05, 0, 0}));
  EXPECT_NEAR(bar.volume, 0.25 * 0.02 * 0.03, 1e-12);
  // Copies at the same place, too.
  EXPECT_NEAR(moments(linear_pattern(box(0.1, 0.02, 0.03), 4, {})).volume, 6e-5, 1e-15);
  expect_error(linear_pattern(pin, 0, {0.1, 0, 0}).named("row"), {"\"row\"", "count"});
  expect_error(circular_pattern(pin, 4, 9).named("ring"), {"\"ring\"", "angle"});
  Csg half = linear_pattern(pin, 2, {0.1, 0, 0});
  half.node.sizes[0] = 2.5;
  expect_error(half, {"count", "2.5"});
  Csg many = linear_pattern(linear_pattern(pin, 10000, {0.1, 0, 0}), 10000, {0, 0.1, 0});
  expect_error(many.named("too many"), {"\"too many\""});
  Csg two = linear_pattern(pin, 2, {0.1, 0, 0});
  two.children.push_back(sphere(0.1));
  expect_error(two, {"node 0", "child"});
  two.children.clear();
  expect_error(two, {"node 0", "child"});
}

TEST_P(CsgConformance, SelectedEdgesAreRoundedAndBevelled) {
  NoProgress progress;
  if (const auto can = engine->evaluate(fillet(box(0.1, 0.1, 0.1), 0.01).tree(), progress); !can) {
    ASSERT_TRUE(is_mesh()) << can.error().sentence();
    EXPECT_EQ(can.error().code, ErrorCode::unsupported) << can.error().sentence();
    GTEST_SKIP() << can.error().sentence();
  }
  const double pi = detail::kPi, x = 0.1, y = 0.08, z = 0.06, r = 0.01;
  const Csg block = box(x, y, z);
  const double V = x * y * z, lost = (1 - pi / 4) * r * r, cut = r * r / 2;
  const auto volume = [&](const Csg& c, double want, const std::string& what) {
    const Moments m = moments(c);
    EXPECT_NEAR(m.volume, want, volume_slack(m, 1e-9)) << what;
    const MeshFacts f = facts(mesh(c, {2e-4, 0.3}), 2e-4);
    EXPECT_EQ(f.unbalanced_sides, 0U) << what;
    EXPECT_NEAR(f.volume, want, m.area * 2e-4 + volume_slack(m, 0)) << what;
  };
  // Steiner: a box rounded all over.
  const double a = x - 2 * r, b = y - 2 * r, c = z - 2 * r;
  const double rounded = a * b * c + 2 * (a * b + b * c + c * a) * r + pi * (a + b + c) * r * r +
                         4 * pi / 3 * r * r * r;
  volume(fillet(block, r), rounded, "all by default");
  volume(fillet(block, r, "all"), rounded, "all");
  volume(fillet(block, r, "parallel z"), V - 4 * lost * z, "parallel z");
  volume(fillet(block, r, "parallel x and top"), V - 2 * lost * x, "parallel x and top");
  volume(fillet(block, r, "right and front"), V - lost * z, "right and front");
  volume(fillet(block, r, "left and back"), V - lost * z, "left and back");
  volume(fillet(block, r, "near (0.05, 0.04, 0.031)"), V - lost * z, "near");
  volume(fillet(block, r, "parallel y and near (0.2, 0, 0)"), V - lost * y, "parallel y and near");
  volume(chamfer(block, r, "parallel z"), V - 4 * cut * z, "chamfer parallel z");
  volume(chamfer(block, r, "bottom and parallel x"), V - 2 * cut * x, "chamfer");
  // A box with all edges bevelled is what three bevelled bars through each other share, without
  // the tips that are left in its corners: tetrahedra of r^3 / 12.
  {
    const auto prism_about = [&](double p, double q, double length, Vec3 axis, double angle) {
      // The box p by q without its four corners, drawn, of the given length.
      const double u = p / 2, v = q / 2;
      return prism({{polygon_loop({{u - r, -v},
                                   {u, -v + r},
                                   {u, v - r},
                                   {u - r, v},
                                   {-u + r, v},
                                   {-u, v - r},
                                   {-u, -v + r},
                                   {-u + r, -v}})}},
                   length)
          .at(0, 0, -length / 2)
          .at(turned(axis, angle));
    };
    const Csg along_z = prism_about(x, y, z, {0, 0, 1}, 0).at(0, 0, 0);
    const Csg along_y = unite({prism_about(x, z, y, {1, 0, 0}, 0).at(0, 0, -y / 2)})
                            .at(turned({1, 0, 0}, pi / 2, {0, 0, z / 2}));
    const Csg along_x = unite({prism_about(z, y, x, {0, 0, 1}, 0).at(0, 0, -x / 2)})
                            .at(turned({0, 1, 0}, pi / 2, {0, 0, z / 2}));
    const Moments want = moments(intersect({along_z, along_y, along_x}));
    volume(chamfer(block, r), want.volume - 8 * r * r * r / 12, "chamfer all");
  }
  // Round edges by Pappus: the lost corner of a cylinder's rim has its centre of area
  // r (10 - 3 pi) / (3 (4 - pi)) from the outside.
  const double R = 0.05, h = 0.08, inset = r * (10 - 3 * pi) / (3 * (4 - pi));
  const Csg can = cylinder(R, h);
  volume(fillet(can, r, "round and top"), pi * R * R * h - 2 * pi * (R - inset) * lost, "rim");
  volume(fillet(can, r, "round"), pi * R * R * h - 4 * pi * (R - inset) * lost, "rims");
  volume(chamfer(can, r, "top"), pi * R * R * h - 2 * pi * (R - r / 3) * cut, "bevelled rim");
  // An inner corner gains what an outer one loses.
  const Csg angle = unite({box(0.1, 0.1, 0.02), box(0.02, 0.1, 0.1).at(-0.04, 0, 0)});
  const double solid = 0.1 * 0.1 * 0.02 + 0.02 * 0.1 * 0.08;
  volume(fillet(angle, r, "concave"), solid + lost * 0.1, "concave");
  volume(fillet(angle, r / 2, "convex and parallel y and top"), solid - 2 * lost / 4 * 0.1,
         "convex");
  // Hubs joined by a web, inner and outer edges, straight ones and arcs; the body made before, so
  // that it is remembered.
  const Csg lever = unite({cylinder(0.06, 0.08), cylinder(0.045, 0.08).at(0.3, 0, 0),
                           box(0.3, 0.06, 0.05).at(0.15, 0, 0.015)});
  const Moments plain = moments(lever);
  for (const char* which : {"concave", "concave and straight", "convex"}) {
    const Moments m = moments(fillet(lever, 0.002, which));
    EXPECT_EQ(m.volume > plain.volume, which[3] == 'c') << which;
    EXPECT_NEAR(m.volume, plain.volume, 0.005 * plain.volume) << which;
    EXPECT_NE(m.volume, plain.volume) << which;
  }
  // In the child's frame, wherever the child is.
  volume(fillet(block.at(turned({1, 2, 3}, 1, {0.3, 0, 0})), r, "parallel z and right"),
         V - 2 * lost * z, "child's frame");
  volume(subtract({fillet(block, r, "top"), cylinder(0.01, 0.1).at(0, 0, -0.02)}),
         moments(fillet(block, r, "top")).volume - pi * 1e-4 * z, "drilled afterwards");
  // Refusals.
  expect_error(fillet(block, 0.2).named("blend"), {"\"blend\"", "0.2"});
  expect_error(fillet(block, 0.031, "parallel x").named("blend"), {"\"blend\"", "0.031"});
  expect_error(chamfer(block, 0.2).named("bevel"), {"\"bevel\"", "0.2"});
  expect_error(fillet(sphere(0.1), 0.01).named("blend"), {"\"blend\"", "edge"});
  expect_error(fillet(block, 0.01, "round").named("blend"), {"\"blend\"", "edge", "round"});
  expect_error(fillet(block, 0, "all").named("blend"), {"\"blend\"", "radius"});
  const auto odd =
      engine->evaluate(fillet(block, 0.01, "sideways").named("blend").tree(), progress);
  ASSERT_FALSE(odd.ok());
  EXPECT_NE(odd.error().sentence().find("sideways"), std::string::npos) << odd.error().sentence();
  EXPECT_NE(odd.error().sentence().find("\"blend\""), std::string::npos) << odd.error().sentence();
}

TEST_P(CsgConformance, FlushSolidsHaveTheEdgesOfOneBody) {
  NoProgress progress;
  if (!engine->evaluate(fillet(box(0.1, 0.1, 0.1), 0.01).tree(), progress))
    GTEST_SKIP() << "the engine rounds no edges";
  const double pi = detail::kPi, r = 0.005;
  const auto alike = [&](const Csg& several, const Csg& one, const std::string& what) {
    for (const char* edges : {"all", "parallel z", "top"})
      for (const auto& work : {fillet, chamfer}) {
        const Moments a = moments(work(several, r, edges)), b = moments(work(one, r, edges));
        EXPECT_NEAR(a.volume, b.volume, volume_slack(b, 1e-9)) << what << ", " << edges;
        EXPECT_NEAR(a.area, b.area, 1e-9 + 1e-9 * b.area) << what << ", " << edges;
      }
  };
  alike(unite({box(0.06, 0.08, 0.05), box(0.04, 0.08, 0.05).at(0.05, 0, 0)}),
        box(0.1, 0.08, 0.05).at(0.02, 0, 0), "two boxes side by side");
  alike(unite({box(0.1, 0.08, 0.02), box(0.1, 0.08, 0.03).at(0, 0, 0.02)}), box(0.1, 0.08, 0.05),
        "two boxes on each other");
  alike(unite({box(0.07, 0.08, 0.05), box(0.07, 0.08, 0.05).at(0.03, 0, 0)}),
        box(0.1, 0.08, 0.05).at(0.015, 0, 0), "two boxes that overlap");
  // Of an angle of boxes, five edges along z are convex and one is concave.
  const Csg angle = unite({box(0.2, 0.1, 0.05), box(0.1, 0.2, 0.05).at(0.05, 0.05, 0)});
  const double V = 0.05 * (0.2 * 0.1 + 0.1 * 0.1), lost = (1 - pi / 4) * r * r, cut = r * r / 2;
  const auto volume = [&](const Csg& c, double want) {
    const Moments m = moments(c);
    EXPECT_NEAR(m.volume, want, volume_slack(m, 1e-9));
  };
  volume(fillet(angle, r, "parallel z"), V - 4 * lost * 0.05);
  volume(chamfer(angle, r, "parallel z"), V - 4 * cut * 0.05);
  volume(fillet(unite({cylinder(0.05, 0.04), cylinder(0.05, 0.06).at(0, 0, 0.04)}), r),
         moments(cylinder(0.05, 0.1, r)).volume);
}

TEST_P(CsgConformance, ContentBelongsToWhatIsRemembered) {
  // Nodes that differ in a drawing, a selection or a file only.
  const auto volume = [&](const Csg& c) { return moments(c).volume; };
  EXPECT_NEAR(volume(prism({{rectangle_loop(0, 0, 0.1, 0.1)}}, 0.1)), 1e-3, 1e-12);
  EXPECT_NEAR(volume(prism({{rectangle_loop(0, 0, 0.1, 0.2)}}, 0.1)), 2e-3, 1e-12);
  EXPECT_NEAR(volume(prism({{rectangle_loop(0, 0, 0.1, 0.2)}}, 0.2)), 4e-3, 1e-12);
  EXPECT_NEAR(volume(unite({prism({{rectangle_loop(0, 0, 0.1, 0.1)}}, 0.1),
                            prism({{rectangle_loop(0, 0, 0.2, 0.1)}}, 0.1).at(0, 1, 0)})),
              3e-3, 1e-12);
}

TEST_P(CsgConformance, ImportedSolidsAreTakenByTheRightEngine) {
  NoProgress progress;
  const Csg part = subtract({box(0.1, 0.08, 0.06), cylinder(0.02, 0.2).at(0.01, 0, -0.1)})
                       .at(turned({1, 2, 3}, 0.7, {0.3, -0.2, 0.1}));
  const auto s = shape(part);
  ASSERT_NE(s, nullptr);
  const Moments want = moments(part);
  const auto geometry = engine->geometry(*s, progress);
  ASSERT_TRUE(geometry.ok()) << geometry.error().sentence();
  EXPECT_EQ(geometry->form, is_mesh() ? CsgGeometry::Form::mesh : CsgGeometry::Form::brep);
  const Csg back = imported(*geometry);
  expect_identity(moments(back), want, 10 * GetParam().boolean_accuracy, {want}, "there and back");
  const MeshFacts f = facts(mesh(back, {2e-4, 0.3}), 2e-4);
  EXPECT_EQ(f.unbalanced_sides, 0U);
  const Moments twice = moments(imported(*geometry, 2));
  EXPECT_NEAR(twice.volume, 8 * want.volume, volume_slack(twice, 1e-8));
  EXPECT_NEAR(twice.first[0], 16 * want.first[0], volume_slack(twice, 1e-8));
  const Moments rest = moments(subtract({back, box(1, 1, 1).at(0.3, -0.2, 0.1)}));
  EXPECT_GT(rest.volume, 0);
  EXPECT_LT(rest.volume, want.volume);
  expect_identity(moments(mirror(mirror(back, {1, 0, 0}, 0, false), {1, 0, 0}, 0, false)), want,
                  10 * GetParam().boolean_accuracy, {want}, "mirrored twice");

  const Csg triangles = imported(detail::box_mesh(0.1, 0.08, 0.06)).named("scan");
  if (is_mesh()) {
    EXPECT_NEAR(moments(triangles).volume, 0.1 * 0.08 * 0.06, 1e-15);
    CsgGeometry brep;
    brep.brep = "DBRep_DrawableShape";
    expect_error(imported(brep).named("exact").tree(), ErrorCode::unsupported, {"\"exact\""});
    CsgGeometry open = detail::box_mesh(0.1, 0.08, 0.06);
    open.triangles.resize(open.triangles.size() - 3);
    expect_error(imported(open).named("open"), {"\"open\""});
    CsgGeometry wild = detail::box_mesh(0.1, 0.08, 0.06);
    wild.triangles[4] = 99;
    expect_error(imported(wild).named("wild"), {"\"wild\""});
  } else {
    expect_error(triangles.tree(), ErrorCode::unsupported, {"\"scan\"", "mesh"});
    // Damaged and truncated texts are errors, never solids and never the end of the program.
    for (const std::size_t keep : {0U, 30U, 500U, 2000U}) {
      CsgGeometry cut = *geometry;
      cut.brep.resize(std::min(keep, cut.brep.size() / 2));
      cut.source = "part.brep";
      expect_error(imported(cut).named("broken"), {"\"broken\"", "part.brep"});
    }
  }
  CsgNode none;
  none.kind = CsgKind::imported;
  none.sizes[0] = 1;
  expect_error(CsgTree{{none}}, ErrorCode::invalid_argument, {"node 0", "geometry"});
}

TEST_P(CsgConformance, FeaturesAreTheFacesEdgesAndCorners) {
  NoProgress progress;
  const Pose place = turned({0, 0, 1}, detail::kPi / 2, {1, 2, 3});
  const Csg part =
      subtract({box(0.1, 0.08, 0.06), cylinder(0.02, 0.2).at(0.01, 0, -0.1)}).at(place);
  const auto s = shape(part);
  ASSERT_NE(s, nullptr);
  const auto features = engine->features(*s, progress);
  if (!features.ok() && is_mesh() && features.error().code == ErrorCode::unsupported)
    GTEST_SKIP() << features.error().sentence();
  ASSERT_TRUE(features.ok()) << features.error().sentence();
  std::map<CsgFeature::Kind, int> count;
  int order = 0;
  using Kind = CsgFeature::Kind;
  for (const CsgFeature& f : *features) {
    ++count[f.kind];
    const int rank = f.kind == Kind::corner                           ? 2
                     : f.kind == Kind::line || f.kind == Kind::circle ? 1
                                                                      : 0;
    EXPECT_GE(rank, order) << "faces, then edges, then corners";
    order = rank;
    const double n = std::hypot(f.direction[0], f.direction[1], f.direction[2]);
    EXPECT_NEAR(n,
                f.kind == Kind::corner || f.kind == Kind::sphere || f.kind == Kind::other ? 0 : 1,
                1e-12);
  }
  EXPECT_EQ(count[Kind::plane], 6);
  EXPECT_EQ(count[Kind::cylinder], 1);
  EXPECT_EQ(count[Kind::line], 12);
  EXPECT_EQ(count[Kind::circle], 2);
  EXPECT_EQ(count[Kind::corner], 8);
  const double slack = is_mesh() ? 1e-4 : 1e-9;
  const auto find = [&](Kind kind, Vec3 point) -> const CsgFeature* {
    for (const CsgFeature& f : *features)
      if (f.kind == kind &&
          std::hypot(f.point[0] - point[0], f.point[1] - point[1], f.point[2] - point[2]) < slack)
        return &f;
    ADD_FAILURE() << "no feature of kind " << int(kind) << " at " << point[0] << ' ' << point[1]
                  << ' ' << point[2];
    return nullptr;
  };
  // The part's x is the world's y, its y the world's -x.
  if (const auto* f = find(Kind::plane, {1, 2.05, 3.03})) {
    EXPECT_NEAR(f->direction[1], 1, 1e-12);
    EXPECT_NEAR(f->size, 0.08 * 0.06, 1e-12);
  }
  const double hole = detail::kPi * 4e-4;
  if (const auto* f = find(Kind::plane, {1, 2 - 0.01 * hole / (0.008 - hole), 3.06})) {
    EXPECT_NEAR(f->direction[2], 1, 1e-12);
    EXPECT_NEAR(f->size, 0.008 - hole, 10 * slack * 0.008);
  }
  if (const auto* f = find(Kind::cylinder, {1, 2.01, 3.03})) {
    EXPECT_NEAR(f->radius, 0.02, slack);
    EXPECT_TRUE(f->inward);
    EXPECT_NEAR(std::abs(f->direction[2]), 1, 1e-9);
    EXPECT_NEAR(f->size, 2 * detail::kPi * 0.02 * 0.06, 10 * slack * 0.01);
  }
  if (const auto* f = find(Kind::circle, {1, 2.01, 3.06})) {
    EXPECT_NEAR(f->radius, 0.02, slack);
    EXPECT_NEAR(f->size, 2 * detail::kPi * 0.02, slack);
  }
  if (const auto* f = find(Kind::line, {1.04, 2.05, 3.03})) {
    EXPECT_NEAR(f->size, 0.06, 1e-12);
  }
  find(Kind::corner, {0.96, 1.95, 3});

  // The same tree by another path: an edit and its reversal.
  shape(subtract({box(0.1, 0.08, 0.06), cylinder(0.021, 0.2).at(0.01, 0, -0.1)}).at(place));
  const auto fresh = GetParam().make();
  const auto anew = fresh->evaluate(part.tree(), progress);
  ASSERT_TRUE(anew.ok()) << anew.error().sentence();
  const auto again = fresh->features(**anew, progress);
  ASSERT_TRUE(again.ok()) << again.error().sentence();
  ASSERT_EQ(again->size(), features->size());
  for (std::size_t i = 0; i < features->size(); ++i) {
    EXPECT_EQ((*again)[i].kind, (*features)[i].kind) << i;
    for (std::size_t k = 0; k < 3; ++k)
      EXPECT_NEAR((*again)[i].point[k], (*features)[i].point[k], 1e-9) << i;
  }

  const auto of = [&](const Csg& c) {
    const auto made = shape(c);
    std::map<Kind, std::vector<CsgFeature>> by;
    if (!made) return by;
    const auto list = engine->features(*made, progress);
    EXPECT_TRUE(list.ok());
    if (list.ok())
      for (const CsgFeature& f : *list) by[f.kind].push_back(f);
    return by;
  };
  auto ball = of(sphere(0.05).at(0.1, 0, 0));
  ASSERT_EQ(ball[Kind::sphere].size(), 1U);
  EXPECT_NEAR(ball[Kind::sphere][0].point[0], 0.1, slack);
  EXPECT_NEAR(ball[Kind::sphere][0].radius, 0.05, slack);
  EXPECT_FALSE(ball[Kind::sphere][0].inward);
  EXPECT_EQ(ball.size(), 1U) << "no seam, no poles";
  auto tip = of(cone(0.05, 0, 0.1));
  EXPECT_EQ(tip[Kind::cone].size(), 1U);
  EXPECT_EQ(tip[Kind::corner].size(), 1U);
  EXPECT_EQ(tip[Kind::circle].size(), 1U);
  auto ring = of(torus(0.08, 0.02));
  ASSERT_EQ(ring[Kind::torus].size(), 1U);
  EXPECT_NEAR(ring[Kind::torus][0].radius, 0.08, slack);
}

TEST_P(CsgConformance, SectionsAreProfiles) {
  NoProgress progress;
  const auto section = [&](const Csg& c, const Pose& plane, double chord = 1e-5) {
    const auto s = shape(c);
    return s ? engine->section(*s, plane, chord, progress)
             : Result<CsgProfile>(error(ErrorCode::internal, "no shape"));
  };
  // What was cut out, drawn again and made thick, has the section's area.
  const auto area = [&](const CsgProfile& p) {
    const Moments m = moments(prism(p, 0.01));
    return std::pair(m.volume / 0.01, m.relative_error);
  };
  const Csg part = subtract({box(0.1, 0.08, 0.06), cylinder(0.02, 0.2).at(0.01, 0.005, -0.1)});
  const Pose level = turned({0, 0, 1}, 0, {0.01, 0.005, 0.02});
  const auto flat = section(part, level);
  if (!flat.ok() && is_mesh() && flat.error().code == ErrorCode::unsupported)
    GTEST_SKIP() << flat.error().sentence();
  ASSERT_TRUE(flat.ok()) << flat.error().sentence();
  ASSERT_EQ(flat->loops.size(), 2U);
  const auto near = [&](double got, double want, double rounding, double relative) {
    EXPECT_NEAR(got, want, (is_mesh() ? relative + GetParam().mesh_error : rounding) * want);
  };
  {
    const auto [got, e] = area(*flat);
    near(got, 0.008 - detail::kPi * 4e-4, 1e-9, e);
  }
  if (!is_mesh()) {
    const bool second = flat->loops[1].curves[0].kind == CsgCurve::Kind::circle;
    const CsgLoop& round = flat->loops[second ? 1 : 0];
    const CsgLoop& outline = flat->loops[second ? 0 : 1];
    ASSERT_EQ(round.curves.size(), 1U);
    ASSERT_EQ(round.curves[0].kind, CsgCurve::Kind::circle);
    EXPECT_NEAR(round.curves[0].points[0][0], 0, 1e-12) << "in the plane's frame";
    EXPECT_NEAR(round.curves[0].points[0][1], 0, 1e-12);
    EXPECT_NEAR(round.curves[0].points[1][0], 0.02, 1e-12);
    EXPECT_EQ(outline.curves.size(), 4U);
    for (const CsgCurve& c : outline.curves) EXPECT_EQ(c.kind, CsgCurve::Kind::line);
  }
  // Across the bore: two rectangles.
  const Pose upright = turned({1, 0, 0}, detail::kPi / 2, {0, 0.005, 0});
  const auto cross = section(part, upright);
  ASSERT_TRUE(cross.ok()) << cross.error().sentence();
  EXPECT_EQ(cross->loops.size(), 2U);
  {
    const auto [got, e] = area(*cross);
    near(got, 0.06 * 0.06, 1e-9, e);
  }
  // An ellipse is no arc: a spline within the chord.
  const auto slanted = section(cylinder(0.03, 0.2), turned({1, 0, 0}, 0.5, {0, 0, 0.1}), 1e-6);
  ASSERT_TRUE(slanted.ok()) << slanted.error().sentence();
  {
    const auto [got, e] = area(*slanted);
    near(got, detail::kPi * 9e-4 / std::cos(0.5), 1e-4, e);
  }
  // A torus lengthwise: two circles. A ball: one. Beside it: nothing.
  const auto pair = section(torus(0.08, 0.02), turned({1, 0, 0}, detail::kPi / 2));
  ASSERT_TRUE(pair.ok()) << pair.error().sentence();
  EXPECT_EQ(pair->loops.size(), 2U);
  {
    const auto [got, e] = area(*pair);
    near(got, 2 * detail::kPi * 4e-4, 1e-9, e);
  }
  const auto ball = section(sphere(0.05), turned({1, 2, 3}, 1, {0.03, 0, 0}));
  ASSERT_TRUE(ball.ok()) << ball.error().sentence();
  ASSERT_EQ(ball->loops.size(), 1U);
  const Pose t = turned({1, 2, 3}, 1, {0.03, 0, 0});
  {
    const double depth = t.R[2] * 0.03;
    const auto [got, e] = area(*ball);
    near(got, detail::kPi * (0.0025 - depth * depth), 1e-9, e);
  }
  const auto nothing = section(sphere(0.05), turned({0, 0, 1}, 0, {0, 0, 0.06}));
  ASSERT_TRUE(nothing.ok()) << nothing.error().sentence();
  EXPECT_TRUE(nothing->loops.empty());
  Pose sheared = level;
  sheared.R[1] = 0.4;
  EXPECT_FALSE(section(part, sheared).ok());
  EXPECT_FALSE(section(part, level, 0).ok());
  EXPECT_FALSE(section(part, level, std::nan("")).ok());
}

TEST_P(CsgConformance, FurtherWorkStopsWhenCancelledAndRefusesForeignShapes) {
  CancelledProgress cancelled;
  NoProgress progress;
  const Csg part = subtract({box(0.1, 0.08, 0.06), cylinder(0.02, 0.2).at(0.01, 0, -0.1)});
  const auto s = shape(part);
  ASSERT_NE(s, nullptr);
  const auto stopped = [&](const auto& result) {
    ASSERT_FALSE(result.ok());
    EXPECT_TRUE(result.error().code == ErrorCode::cancelled ||
                (is_mesh() && result.error().code == ErrorCode::unsupported))
        << result.error().sentence();
  };
  stopped(engine->features(*s, cancelled));
  stopped(engine->section(*s, turned({0, 0, 1}, 0, {0, 0, 0.02}), 1e-4, cancelled));
  stopped(engine->geometry(*s, cancelled));
  stopped(engine->evaluate(fillet(part, 0.004).tree(), cancelled));
  stopped(engine->evaluate(
      prism({{rectangle_loop(0, 0, 0.1, 0.1), circle_loop(0.05, 0.05, 0.02)}}, 0.1).tree(),
      cancelled));
  class Foreign final : public CsgShape {
   public:
    std::array<Vec3, 2> bounds() const override { return {}; }
    std::span<const std::string> notes() const override { return {}; }
  };
  const Foreign foreign;
  EXPECT_FALSE(engine->features(foreign, progress).ok());
  EXPECT_FALSE(engine->section(foreign, {}, 1e-4, progress).ok());
  EXPECT_FALSE(engine->geometry(foreign, progress).ok());
}

}  // namespace robomosp::conformance

#include <robomosp/sdk/conformance/csg_suite_scale.h>
