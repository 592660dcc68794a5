// SPDX-License-Identifier: Apache-2.0
// Collision through the SDK beside plain FCL calls in the same run, on the same shapes and poses:
// primitives, convex hulls and triangle meshes, distance with nearest points and yes-or-no.
#include <array>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>
#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/geometry/shape/box.h>
#include <fcl/geometry/shape/capsule.h>
#include <fcl/geometry/shape/cone.h>
#include <fcl/geometry/shape/convex.h>
#include <fcl/geometry/shape/cylinder.h>
#include <fcl/geometry/shape/ellipsoid.h>
#include <fcl/geometry/shape/sphere.h>
#include <fcl/narrowphase/collision.h>
#include <fcl/narrowphase/distance.h>

#include <robomosp/sdk/conformance/collision_suite.h>

#include "spatial/convex_hull.h"

namespace robomosp {
namespace {

using conformance::multiply;
using conformance::Random;
using conformance::turn_x;
using conformance::turn_z;

constexpr int kPoses = 1000;

enum Which : std::int64_t {
  spheres,
  capsules,
  boxes,
  box_cylinder,
  box_capsule,
  cylinders,
  sphere_cylinder,
  hulls_100,
  hulls_1000,
  meshes_2k,
  meshes_20k,
  mesh_box,
  kCases
};
constexpr const char* kNames[] = {"sphere-sphere",   "capsule-capsule", "box-box",
                                  "box-cylinder",    "box-capsule",     "cylinder-cylinder",
                                  "sphere-cylinder", "hull114-hull114", "hull1014-hull1014",
                                  "mesh2k-mesh2k",   "mesh20k-mesh20k", "mesh20k-box"};

Shape primitive(ShapeKind kind) {
  switch (kind) {
    case ShapeKind::sphere: return conformance::shape_of(kind, 0.5);
    case ShapeKind::box: return conformance::shape_of(kind, 0.8, 0.9, 1.0);
    case ShapeKind::cylinder: return conformance::shape_of(kind, 0.4, 1.0);
    default: return conformance::shape_of(kind, 0.3, 0.8);
  }
}

/// Points on a sphere, so that all are corners of the hull.
Mesh points_on_sphere(int count) {
  Mesh m;
  for (int i = 0; i < count; ++i) {
    const double z = 1 - (2.0 * i + 1) / count, r = std::sqrt(1 - z * z);
    for (const double x : {0.5 * r * std::cos(2.399963229728653 * i),
                           0.5 * r * std::sin(2.399963229728653 * i), 0.5 * z})
      m.positions.push_back(static_cast<float>(x));
  }
  m.normals.assign(m.positions.size(), 0.0F);
  return m;
}

struct Case {
  std::array<Shape, 2> shapes;
  std::array<std::shared_ptr<const Mesh>, 2> meshes;
  std::array<std::unique_ptr<fcl::CollisionGeometryd>, 2> peers;
  std::unique_ptr<CollisionScene> scene;
  std::vector<Pose> poses;
};

std::unique_ptr<fcl::CollisionGeometryd> peer_of(const Shape& s) {
  std::unique_ptr<fcl::CollisionGeometryd> g;
  switch (s.kind) {
    case ShapeKind::sphere: g = std::make_unique<fcl::Sphered>(s.sizes[0]); break;
    case ShapeKind::box: g = std::make_unique<fcl::Boxd>(s.sizes[0], s.sizes[1], s.sizes[2]); break;
    case ShapeKind::cylinder: g = std::make_unique<fcl::Cylinderd>(s.sizes[0], s.sizes[1]); break;
    case ShapeKind::capsule: g = std::make_unique<fcl::Capsuled>(s.sizes[0], s.sizes[1]); break;
    case ShapeKind::cone: g = std::make_unique<fcl::Coned>(s.sizes[0], s.sizes[2]); break;
    case ShapeKind::convex: {
      const auto hull = spatial::convex_hull(spatial::vertices(*s.mesh));
      auto v = std::make_shared<std::vector<fcl::Vector3d>>();
      for (const Vec3& p : hull->points) v->emplace_back(p[0], p[1], p[2]);
      auto f = std::make_shared<std::vector<int>>();
      for (const auto& t : hull->triangles)
        for (const int i :
             {3, static_cast<int>(t[0]), static_cast<int>(t[1]), static_cast<int>(t[2])})
          f->push_back(i);
      g = std::make_unique<fcl::Convexd>(v, static_cast<int>(hull->triangles.size()), f);
      break;
    }
    case ShapeKind::ellipsoid:
      g = std::make_unique<fcl::Ellipsoidd>(s.sizes[0], s.sizes[1], s.sizes[2]);
      break;
    case ShapeKind::mesh: {
      auto model = std::make_unique<fcl::BVHModel<fcl::OBBRSSd>>();
      std::vector<fcl::Vector3d> v;
      for (const Vec3& p : spatial::vertices(*s.mesh)) v.emplace_back(p[0], p[1], p[2]);
      std::vector<fcl::Triangle> t;
      for (std::size_t i = 0; i < s.mesh->triangles.size(); i += 3)
        t.emplace_back(s.mesh->triangles[i], s.mesh->triangles[i + 1], s.mesh->triangles[i + 2]);
      model->beginModel();
      model->addSubModel(v, t);
      model->endModel();
      g = std::move(model);
      break;
    }
  }
  g->computeLocalAABB();
  return g;
}

const Case& the_case(std::int64_t which) {
  static std::array<std::unique_ptr<Case>, kCases> made;
  auto& slot = made[static_cast<std::size_t>(which)];
  if (slot) return *slot;
  slot = std::make_unique<Case>();
  Case& c = *slot;
  const auto both = [&](ShapeKind a, ShapeKind b) { c.shapes = {primitive(a), primitive(b)}; };
  const auto of_mesh = [&](ShapeKind kind, Mesh mesh) {
    c.meshes[0] = std::make_shared<const Mesh>(std::move(mesh));
    c.shapes[0].kind = c.shapes[1].kind = kind;
    c.shapes[0].mesh = c.shapes[1].mesh = c.meshes[0].get();
  };
  using enum ShapeKind;
  switch (which) {
    case spheres: both(sphere, sphere); break;
    case capsules: both(capsule, capsule); break;
    case boxes: both(box, box); break;
    case box_cylinder: both(box, cylinder); break;
    case box_capsule: both(box, capsule); break;
    case cylinders: both(cylinder, cylinder); break;
    case sphere_cylinder: both(sphere, cylinder); break;
    case hulls_100: of_mesh(convex, points_on_sphere(114)); break;
    case hulls_1000: of_mesh(convex, points_on_sphere(1014)); break;
    case meshes_2k: of_mesh(mesh, conformance::ball_mesh(0.5, 23, 0.1)); break;
    case meshes_20k: of_mesh(mesh, conformance::ball_mesh(0.5, 71, 0.1)); break;
    default: of_mesh(mesh, conformance::ball_mesh(0.5, 71, 0.1)); c.shapes[1] = primitive(box);
  }
  for (std::size_t i = 0; i < 2; ++i) c.peers[i] = peer_of(c.shapes[i]);
  const rmp_provider* provider = *conformance::find_provider<CollisionEngine>(
      std::string(ROBOMOSP_PLUGIN_DIR) + "/collision_fcl.so", "fcl");
  const auto engine = conformance::create<CollisionEngine>(*provider);
  const std::vector<ShapedBody> bodies{{{c.shapes[0]}}, {{c.shapes[1]}}};
  NoProgress none;
  conformance::TableParams params(*provider);
  params.set("threads", "1");
  c.scene = std::move(*engine->build(bodies, params, none));
  Random random(1);
  for (int i = 0; i < 2 * kPoses; ++i) {
    Pose p = multiply(turn_z(random.uniform(-3, 3)), turn_x(random.uniform(-3, 3)));
    for (double& x : p.p) x = random.uniform(-2, 2);
    c.poses.push_back(p);
  }
  return c;
}

fcl::Transform3d transform_of(const Pose& p) {
  fcl::Transform3d t = fcl::Transform3d::Identity();
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) t.linear()(i, j) = p.R[static_cast<std::size_t>(3 * i + j)];
    t.translation()(i) = p.p[static_cast<std::size_t>(i)];
  }
  return t;
}

void finish(benchmark::State& state) {
  state.SetLabel(kNames[state.range(0)]);
  state.SetItemsProcessed(state.iterations() * kPoses);
}

void distance_ours(benchmark::State& state) {
  const Case& c = the_case(state.range(0));
  const std::array pairs{CollisionPair{0, 1}};
  std::vector<PairDistance> out(kPoses);
  NoProgress none;
  for (auto _ : state) {
    if (!c.scene->distances(c.poses, pairs, std::numeric_limits<double>::infinity(), out, none)
             .ok())
      state.SkipWithError("failed");
  }
  finish(state);
}
void collide_ours(benchmark::State& state) {
  const Case& c = the_case(state.range(0));
  const std::array pairs{CollisionPair{0, 1}};
  std::vector<std::uint8_t> out(kPoses);
  NoProgress none;
  for (auto _ : state) {
    if (!c.scene->collisions(c.poses, pairs, out, none).ok()) state.SkipWithError("failed");
  }
  finish(state);
}

/// As one would call FCL by its manual: the default solver, unsigned, since signed distances of
/// overlapping cylinders end the process.
void distance_fcl(benchmark::State& state) {
  const Case& c = the_case(state.range(0));
  double sum = 0;
  for (auto _ : state)
    for (std::size_t i = 0; i < c.poses.size(); i += 2) {
      fcl::DistanceRequestd request(true, false);
      request.gjk_solver_type = fcl::GST_LIBCCD;
      fcl::DistanceResultd result;
      try {
        sum += fcl::distance(c.peers[0].get(), transform_of(c.poses[i]), c.peers[1].get(),
                             transform_of(c.poses[i + 1]), request, result);
      } catch (const std::exception&) {
      }
    }
  benchmark::DoNotOptimize(sum);
  finish(state);
}
void collide_fcl(benchmark::State& state) {
  const Case& c = the_case(state.range(0));
  std::size_t sum = 0;
  for (auto _ : state)
    for (std::size_t i = 0; i < c.poses.size(); i += 2) {
      fcl::CollisionRequestd request;
      fcl::CollisionResultd result;
      sum += fcl::collide(c.peers[0].get(), transform_of(c.poses[i]), c.peers[1].get(),
                          transform_of(c.poses[i + 1]), request, result);
    }
  benchmark::DoNotOptimize(sum);
  finish(state);
}

BENCHMARK(distance_ours)->DenseRange(0, kCases - 1)->Unit(benchmark::kMillisecond);
BENCHMARK(distance_fcl)->DenseRange(0, kCases - 1)->Unit(benchmark::kMillisecond);
BENCHMARK(collide_ours)->DenseRange(0, kCases - 1)->Unit(benchmark::kMillisecond);
BENCHMARK(collide_fcl)->DenseRange(0, kCases - 1)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace robomosp
