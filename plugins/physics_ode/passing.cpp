// SPDX-License-Identifier: Apache-2.0
// Bodies that are so fast that they are on the other side of another one after a step: they are
// found by looking at places between (layer: plugin).
#include <algorithm>
#include <cmath>

#include "spatial/pose.h"
#include "spatial/rotation.h"
#include "world.h"

namespace robomosp::physics_ode {
namespace {

constexpr int kMostLooks = 400;  ///< of a pair in a step
constexpr std::size_t kMostPassed = 32;
/// Bodies can pass where they approach by more than this share of both their thicknesses in a
/// step; looks are this share apart.
constexpr double kPassShare = 0.5, kLookShare = 0.25;

struct Bounds {
  Vec3 low, high;
};
Bounds bounds_of(dGeomID g) {
  dReal x[6];
  dGeomGetAABB(g, x);
  return {{x[0], x[2], x[4]}, {x[1], x[3], x[5]}};
}

}  // namespace

/// Bodies that move by a good part of what is thinnest of them in the coming step, as they are.
std::vector<OdeWorld::FastBody> OdeWorld::fast_bodies() const {
  std::vector<FastBody> all;
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    const Body& b = bodies_[i];
    if (!b.id || !(b.thinnest > 0)) continue;
    const Vec3 v = vec3(dBodyGetLinearVel(b.id)), w = vec3(dBodyGetAngularVel(b.id));
    const double way = dt_ * (spatial::norm(v) + spatial::norm(w) * b.reach);
    if (way < kPassShare * b.thinnest) continue;
    FastBody f{i, way, {b.id, vec3(dBodyGetPosition(b.id)), v, w, {}}, {}};
    std::copy_n(dBodyGetQuaternion(b.id), 4, f.before.q.begin());
    for (const Geometry& g : b.geometries) {
      const Bounds at = bounds_of(g.id);
      f.bounds.push_back({at.low, at.high});
    }
    all.push_back(std::move(f));
  }
  return all;
}

/// Notes what of these went through others in the step that was made.
void OdeWorld::find_passed(std::span<const FastBody> fast) {
  for (const FastBody& f : fast) {
    const Body& own = bodies_[f.body];
    for (std::size_t k = 0; k < own.geometries.size(); ++k) {
      Bounds swept = bounds_of(own.geometries[k].id);
      for (std::size_t c = 0; c < 3; ++c) {
        swept.low[c] = std::min(swept.low[c], f.bounds[k][0][c]);
        swept.high[c] = std::max(swept.high[c], f.bounds[k][1][c]);
      }
      for (std::size_t other = 0; other < bodies_.size(); ++other) {
        if (other == f.body || passed_.size() >= kMostPassed ||
            !may_touch(static_cast<std::int32_t>(f.body), static_cast<std::int32_t>(other)))
          continue;
        const auto twin = std::find_if(fast.begin(), fast.end(),
                                       [&](const FastBody& x) { return x.body == other; });
        if (twin != fast.end() && other < f.body) continue;  // looked at from the other side
        for (const Geometry& g : bodies_[other].geometries) {
          const Bounds at = bounds_of(g.id);
          bool is_near = true;
          for (std::size_t c = 0; c < 3; ++c)
            is_near = is_near && at.low[c] <= swept.high[c] && at.high[c] >= swept.low[c];
          const double thick = own.geometries[k].thickness + g.thickness;
          const double way = f.way + (twin != fast.end() ? twin->way : 0);
          if (!is_near && twin == fast.end()) continue;
          if (!meet(own.geometries[k].tag->role, g.tag->role) || way < kPassShare * thick) continue;
          look_between(f, twin == fast.end() ? nullptr : &*twin, own.geometries[k].id, g.id, way,
                       thick);
        }
      }
    }
  }
}

void OdeWorld::look_between(const FastBody& f, const FastBody* twin, dGeomID own, dGeomID other,
                            double way, double thick) {
  const std::pair<std::int32_t, std::int32_t> pair =
      std::minmax(static_cast<const GeometryTag*>(dGeomGetData(own))->body,
                  static_cast<const GeometryTag*>(dGeomGetData(other))->body);
  if (std::find(passed_.begin(), passed_.end(), pair) != passed_.end()) return;
  // What touched when the step began was held back.
  for (const Contact& c : contacts_)
    if (std::min(c.contact.a, c.contact.b) == pair.first &&
        std::max(c.contact.a, c.contact.b) == pair.second)
      return;
  std::array<dContactGeom, 1> point;
  const auto touches = [&] {
    return dCollide(own, other, 1, point.data(), sizeof(dContactGeom)) > 0;
  };
  const bool at_end = touches();
  const Vec3 normal_at_end = at_end ? vec3(point[0].normal) : Vec3{};
  const auto state = [](const FastBody& b) {
    Moving m{b.before.id, vec3(dBodyGetPosition(b.before.id)), {}, {}, {}};
    std::copy_n(dBodyGetQuaternion(b.before.id), 4, m.q.begin());
    return m;
  };
  const auto place = [](const Moving& from, const Moving& to, double u) {
    const Vec3 p = spatial::add(spatial::scale(from.p, 1 - u), spatial::scale(to.p, u));
    double same = 0;
    for (std::size_t k = 0; k < 4; ++k) same += from.q[k] * to.q[k];
    std::array<dReal, 4> q;
    for (std::size_t k = 0; k < 4; ++k) q[k] = (1 - u) * from.q[k] + (same < 0 ? -u : u) * to.q[k];
    dBodySetPosition(to.id, p[0], p[1], p[2]);
    dBodySetQuaternion(to.id, q.data());
  };
  const Moving end = state(f), twin_end = twin ? state(*twin) : Moving{};
  const int looks =
      static_cast<int>(std::clamp(std::ceil(way / (kLookShare * thick)), 2.0, double{kMostLooks}));
  bool has_passed = false;
  for (int i = 1; i < looks && !has_passed; ++i) {
    const double u = static_cast<double>(i) / looks;
    place(f.before, end, u);
    if (twin) place(twin->before, twin_end, u);
    if (!touches()) continue;
    // From here it would be pushed back; at the end it is gone, or is pushed on.
    has_passed = !at_end || spatial::dot(vec3(point[0].normal), normal_at_end) < 0;
    break;
  }
  place(f.before, end, 1);
  if (twin) place(twin->before, twin_end, 1);
  if (!has_passed) return;
  passed_.push_back(pair);
  notes_.push_back({pair.first, pair.second,
                    "passed through each other within a step: they approach by " +
                        short_number(1e3 * way) + " mm in " + short_number(1e3 * dt_) +
                        " ms and are " + short_number(1e3 * thick) +
                        " mm thick together. Use a step of " +
                        short_number(1e3 * kLookShare * thick / way * dt_) + " ms or less"});
}

}  // namespace robomosp::physics_ode
