// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/synthetic.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

namespace robomosp::viewer::synthetic {
namespace {

constexpr double kPi = std::numbers::pi;

void push(std::vector<float>& to, double x, double y, double z) {
  for (const double v : {x, y, z}) to.push_back(static_cast<float>(v));
}

std::vector<ProfilePoint> rounded_profile(double radius, double z0, double z1, double rim) {
  std::vector<ProfilePoint> p{{0, z0}};
  const int steps = rim > 0 ? 6 : 0;
  for (int i = 0; i <= steps; ++i) {
    const double a = steps > 0 ? kPi / 2 * i / steps : 0;
    p.push_back({radius - rim + rim * std::sin(a), z0 + rim - rim * std::cos(a)});
  }
  for (int i = 0; i <= steps; ++i) {
    const double a = steps > 0 ? kPi / 2 * i / steps : 0;
    p.push_back({radius - rim + rim * std::cos(a), z1 - rim + rim * std::sin(a)});
  }
  p.push_back({0, z1});
  return p;
}

}  // namespace

std::shared_ptr<const Mesh> box(double x, double y, double z) {
  auto mesh = std::make_shared<Mesh>();
  const std::array<double, 3> half{x / 2, y / 2, z / 2};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (const double side : {-1.0, 1.0}) {
      const std::size_t u = (axis + 1) % 3, v = (axis + 2) % 3;
      const auto first = static_cast<std::uint32_t>(mesh->positions.size() / 3);
      for (const auto& [a, b] : {std::pair{-1, -1}, {1, -1}, {1, 1}, {-1, 1}}) {
        std::array<double, 3> p{}, n{};
        p[axis] = side * half[axis], p[u] = a * half[u], p[v] = b * half[v];
        n[axis] = side;
        push(mesh->positions, p[0], p[1], p[2]);
        push(mesh->normals, n[0], n[1], n[2]);
      }
      for (const std::uint32_t i : {0U, 1U, 2U, 0U, 2U, 3U})
        mesh->triangles.push_back(first + (side > 0 ? i : 3 - i));
      for (const double other : {-1.0, 1.0}) {
        std::array<double, 3> a{}, b{};
        a[axis] = b[axis] = side * half[axis];
        a[u] = b[u] = other * half[u];
        a[v] = -half[v], b[v] = half[v];
        push(mesh->edge_points, a[0], a[1], a[2]);
        push(mesh->edge_points, b[0], b[1], b[2]);
        mesh->edge_sizes.push_back(2);
      }
    }
  }
  return mesh;
}

std::shared_ptr<const Mesh> lathe(const std::vector<ProfilePoint>& profile, int sides) {
  auto mesh = std::make_shared<Mesh>();
  const std::size_t segments = profile.size() - 1;
  std::vector<std::array<double, 2>> normal(segments);
  for (std::size_t i = 0; i < segments; ++i) {
    const double dr = profile[i + 1].radius - profile[i].radius;
    const double dz = profile[i + 1].z - profile[i].z, l = std::hypot(dr, dz);
    normal[i] = {dz / l, -dr / l};
  }
  const auto is_corner = [&](std::size_t i) {  // between segments i - 1 and i
    return normal[i - 1][0] * normal[i][0] + normal[i - 1][1] * normal[i][1] < std::cos(kPi / 6);
  };
  for (std::size_t i = 0; i < segments; ++i) {
    for (const std::size_t end : {i, i + 1}) {
      const bool has_other = end > 0 && end < segments && !is_corner(end);
      const auto& other = has_other ? normal[end == i ? i - 1 : i + 1] : normal[i];
      const double nr = normal[i][0] + other[0], nz = normal[i][1] + other[1];
      const double l = std::hypot(nr, nz);
      for (int s = 0; s <= sides; ++s) {
        const double a = 2 * kPi * s / sides;
        push(mesh->positions, profile[end].radius * std::cos(a), profile[end].radius * std::sin(a),
             profile[end].z);
        push(mesh->normals, nr / l * std::cos(a), nr / l * std::sin(a), nz / l);
      }
    }
    const auto ring = static_cast<std::uint32_t>(sides + 1);
    const auto first = static_cast<std::uint32_t>(2 * i) * ring;
    for (std::uint32_t s = 0; s + 1 < ring; ++s) {
      const std::uint32_t a = first + s, b = a + ring;
      for (const std::uint32_t v : {a, a + 1, b + 1, a, b + 1, b}) mesh->triangles.push_back(v);
    }
    if (i > 0 && is_corner(i)) {
      for (int s = 0; s <= sides; ++s) {
        const double a = 2 * kPi * s / sides;
        push(mesh->edge_points, profile[i].radius * std::cos(a), profile[i].radius * std::sin(a),
             profile[i].z);
      }
      mesh->edge_sizes.push_back(ring);
    }
  }
  // A smooth body has no feature edges; say so, so that none are searched for.
  if (mesh->edge_sizes.empty()) mesh->edge_sizes.push_back(0);
  return mesh;
}

std::shared_ptr<const Mesh> cylinder(double radius, double height, double rim, int sides) {
  return lathe(rounded_profile(radius, 0, height, rim), sides);
}

std::shared_ptr<const Mesh> sphere(double radius, int triangles) {
  const int rows = std::max(4, static_cast<int>(std::sqrt(triangles / 4.0)));
  std::vector<ProfilePoint> profile;
  for (int i = 0; i <= rows; ++i) {
    const double a = kPi * i / rows;
    profile.push_back({radius * std::sin(a), -radius * std::cos(a)});
  }
  return lathe(profile, 2 * rows);
}

Pose turned(const Vec3& axis, double angle, const Vec3& place) {
  const double c = std::cos(angle), s = std::sin(angle), k = 1 - c;
  const auto [x, y, z] = axis;
  return {{c + x * x * k, x * y * k - z * s, x * z * k + y * s, y * x * k + z * s, c + y * y * k,
           y * z * k - x * s, z * x * k - y * s, z * y * k + x * s, c + z * z * k},
          place};
}

Pose chained(const Pose& a, const Pose& b) {
  Pose r;
  for (std::size_t i = 0; i < 3; ++i) {
    r.p[i] = a.p[i];
    for (std::size_t j = 0; j < 3; ++j) {
      r.p[i] += a.R[3 * i + j] * b.p[j];
      r.R[3 * i + j] = 0;
      for (std::size_t k = 0; k < 3; ++k) r.R[3 * i + j] += a.R[3 * i + k] * b.R[3 * k + j];
    }
  }
  return r;
}

Frame robot_cell(double phase) {
  const Appearance white{{0.95F, 0.95F, 0.94F, 1}, 0.55F, 0},
      dark{{0.17F, 0.18F, 0.20F, 1}, 0.5F, 0}, orange{{0.95F, 0.47F, 0.08F, 1}, 0.5F, 0},
      steel{{0.78F, 0.79F, 0.80F, 1}, 0.7F, 1}, slate{{0.40F, 0.45F, 0.52F, 1}, 0.3F, 0},
      glass{{0.45F, 0.68F, 0.88F, 0.28F}, 0.9F, 0};
  const Vec3 x{1, 0, 0}, y{0, 1, 0}, z{0, 0, 1};
  Frame frame;
  std::uint64_t next = 1;
  const auto add = [&](const char* name, std::shared_ptr<const Mesh> mesh, const Pose& pose,
                       const Appearance& look) {
    frame.items.push_back({next++, name, std::move(mesh), pose, look, false});
  };
  const auto across = [&](double offset) { return turned(x, -kPi / 2, {0, offset, 0}); };

  add("pedestal", cylinder(0.22, 0.035, 0.008), {}, dark);
  add("base",
      lathe({{0, 0.035},
             {0.165, 0.035},
             {0.160, 0.07},
             {0.143, 0.12},
             {0.134, 0.18},
             {0.132, 0.25},
             {0, 0.25}}),
      {}, white);
  const Pose j1 = turned(z, 0.35 + 0.5 * std::sin(phase), {0, 0, 0.25});
  add("ring1", cylinder(0.139, 0.026, 0.007), j1, dark);
  add("turret",
      lathe({{0, 0.026},
             {0.132, 0.026},
             {0.130, 0.10},
             {0.120, 0.18},
             {0.104, 0.235},
             {0.075, 0.262},
             {0, 0.27}}),
      j1, white);
  const Pose shoulder = chained(j1, {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0, 0, 0.16}});
  add("shoulder", lathe(rounded_profile(0.098, -0.15, 0.15, 0.018)), chained(shoulder, across(0)),
      white);
  add("shoulder_cap", lathe(rounded_profile(0.068, -0.16, 0.16, 0.006)),
      chained(shoulder, across(0)), orange);
  const Pose j2 = chained(shoulder, turned(y, 0.42 + 0.2 * std::sin(phase + 0.6)));
  add("upper_arm_hub", lathe(rounded_profile(0.105, -0.06, 0.06, 0.02)), chained(j2, across(0.215)),
      white);
  add("upper_arm",
      lathe({{0, 0}, {0.074, 0.0}, {0.070, 0.2}, {0.064, 0.45}, {0.062, 0.60}, {0, 0.60}}),
      chained(j2, {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0, 0.215, 0.03}}), white);
  const Pose j3 = chained(chained(j2, {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0, 0, 0.64}}),
                          turned(y, 1.05 + 0.25 * std::sin(phase)));
  add("elbow", lathe(rounded_profile(0.080, -0.15, 0.17, 0.016)), chained(j3, across(0.13)), dark);
  add("elbow_cap", lathe(rounded_profile(0.050, -0.176, 0.176, 0.005)), chained(j3, across(0.13)),
      orange);
  add("forearm_hub", lathe(rounded_profile(0.088, -0.07, 0.07, 0.022)), chained(j3, across(0.03)),
      white);
  add("forearm",
      lathe({{0, 0.02}, {0.070, 0.02}, {0.066, 0.16}, {0.056, 0.34}, {0.054, 0.395}, {0, 0.395}}),
      chained(j3, {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0, 0.03, 0}}), white);
  const Pose j4 = chained(j3, {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0, 0.03, 0.40}});
  add("ring4", lathe(rounded_profile(0.059, -0.012, 0.012, 0.004)), j4, orange);
  add("wrist", lathe({{0, 0.012}, {0.054, 0.012}, {0.050, 0.14}, {0.044, 0.20}, {0, 0.20}}), j4,
      white);
  const Pose j5 = chained(chained(j4, {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0, 0, 0.235}}),
                          turned(y, 1.05 - 0.4 * std::sin(phase)));
  add("wrist_hub", lathe(rounded_profile(0.048, -0.062, 0.062, 0.010)), chained(j5, across(0)),
      dark);
  const Pose j6 =
      chained(chained(j5, {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0, 0, 0.045}}), turned(z, 0.4));
  add("flange", cylinder(0.037, 0.05, 0.004), j6, steel);
  add("gripper", box(0.055, 0.11, 0.05), chained(j6, {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0, 0, 0.075}}),
      dark);
  for (const double side : {-1.0, 1.0})
    add(side < 0 ? "finger_left" : "finger_right", box(0.02, 0.014, 0.09),
        chained(j6, {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0, side * 0.035, 0.145}}), steel);
  const Pose tool = chained(j6, {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0, 0, 0.19}});

  add("table", cylinder(0.32, 0.34, 0.012, 128), {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0.92, -0.28, 0}},
      slate);
  add("workpiece", box(0.16, 0.09, 0.07), turned(z, 0.5, {0.82, -0.36, 0.375}), orange);
  add("bolt", cylinder(0.05, 0.12, 0.006), {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {1.02, -0.16, 0.34}},
      steel);
  add("screen", box(0.02, 1.5, 1.1), {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {-0.72, 0.1, 0.56}}, glass);

  Line path;
  path.id = 1001;
  for (int i = 0; i <= 120; ++i) {
    const double u = i / 120.0;
    path.points.push_back({tool.p[0] * (1 - u) + 0.62 * u + 0.12 * std::sin(2 * kPi * u),
                           tool.p[1] * (1 - u) - 0.62 * u,
                           tool.p[2] * (1 - u) + 0.72 * u + 0.22 * std::sin(kPi * u)});
  }
  frame.lines.push_back(path);
  frame.triads.push_back({2001, tool, 0.14, "tool"});
  frame.triads.push_back({2002, {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0.92, -0.28, 0.341}}, 0.10, ""});
  return frame;
}

}  // namespace robomosp::viewer::synthetic
