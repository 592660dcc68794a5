// SPDX-License-Identifier: Apache-2.0
#include "fcl_shapes.h"

#include <algorithm>
#include <cmath>
#include <exception>
#include <limits>
#include <mutex>

#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/geometry/shape/sphere.h>
#include <fcl/narrowphase/collision.h>
#include <fcl/narrowphase/distance.h>

#include "spatial/vec.h"

namespace robomosp::collision_fcl {

struct Geometry {
  std::unique_ptr<fcl::CollisionGeometryd> fcl;
};

namespace {

fcl::Transform3d transform_of(const Pose& p) {
  fcl::Transform3d t = fcl::Transform3d::Identity();
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) t.linear()(i, j) = p.R[static_cast<std::size_t>(3 * i + j)];
    t.translation()(i) = p.p[static_cast<std::size_t>(i)];
  }
  return t;
}
Vec3 vec(const fcl::Vector3d& v) { return {v[0], v[1], v[2]}; }
fcl::Vector3d vec(const Vec3& v) { return {v[0], v[1], v[2]}; }

GeometryPtr wrap(std::unique_ptr<fcl::CollisionGeometryd> g) {
  g->computeLocalAABB();
  auto out = std::make_shared<Geometry>();
  out->fcl = std::move(g);
  return out;
}

}  // namespace

GeometryPtr make_mesh_geometry(const std::vector<Vec3>& points,
                               const std::vector<std::array<std::uint32_t, 3>>& triangles) {
  auto model = std::make_unique<fcl::BVHModel<fcl::OBBRSSd>>();
  std::vector<fcl::Vector3d> v;
  for (const Vec3& p : points) v.push_back(vec(p));
  std::vector<fcl::Triangle> t;
  for (const auto& i : triangles) t.emplace_back(i[0], i[1], i[2]);
  model->beginModel(static_cast<int>(t.size()), static_cast<int>(v.size()));
  model->addSubModel(v, t);
  model->endModel();
  return wrap(std::move(model));
}

void warm_up() {
  static std::once_flag once;
  std::call_once(once, [] {
    const fcl::Sphered ball(1);
    const fcl::Transform3d here = fcl::Transform3d::Identity();
    fcl::Transform3d there = here;
    there.translation()(0) = 3;
    fcl::CollisionResultd collision;
    fcl::collide(&ball, here, &ball, there, fcl::CollisionRequestd(), collision);
    for (const auto solver : {fcl::GST_LIBCCD, fcl::GST_INDEP}) {
      fcl::DistanceRequestd request(true);
      request.gjk_solver_type = solver;
      fcl::DistanceResultd distance;
      fcl::distance(&ball, here, &ball, there, request, distance);
      fcl::CollisionRequestd touch;
      touch.gjk_solver_type = solver;
      fcl::collide(&ball, here, &ball, there, touch, collision);
    }
  });
}

Result<std::optional<PairDistance>> surface_distance(const Geometry& a, const Pose& world_T_a,
                                                     const Geometry& b, const Pose& world_T_b,
                                                     double interest) {
  try {
    fcl::DistanceRequestd request(true, false);
    request.gjk_solver_type = fcl::GST_INDEP;
    request.distance_tolerance = 1e-10;
    // What is farther than a distance that is known already is not descended into.
    fcl::DistanceResultd result(std::min(interest, std::numeric_limits<double>::max()));
    fcl::distance(a.fcl.get(), transform_of(world_T_a), b.fcl.get(), transform_of(world_T_b),
                  request, result);
    if (!result.o1) return std::optional<PairDistance>{};
    PairDistance d;
    d.on_a = vec(result.nearest_points[0]);
    d.on_b = vec(result.nearest_points[1]);
    d.distance = result.min_distance > 0 ? result.min_distance : 0;
    if (!std::isfinite(d.distance) || !spatial::is_finite(d.on_a) || !spatial::is_finite(d.on_b))
      return error(ErrorCode::plugin_failed, "FCL returned a distance that is not a number");
    if (d.distance == 0) d.on_b = d.on_a;
    return std::optional(d);
  } catch (const std::exception& e) {
    return error(ErrorCode::plugin_failed,
                 std::string("FCL could not compute a distance: ") + e.what());
  }
}

}  // namespace robomosp::collision_fcl
