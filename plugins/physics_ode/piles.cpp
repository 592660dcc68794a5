// SPDX-License-Identifier: Apache-2.0
// Which contacts are of piles of free bodies, solved by pile.h instead of the engine, whose exact
// solver takes time with the cube of their number; the forces found are then given to the engine,
// which moves the bodies (layer: plugin).
#include <algorithm>
#include <cmath>

#include "spatial/pose.h"
#include "world.h"

namespace robomosp::physics_ode {
namespace {

/// Multiplications of one factorization, of which there are up to some thirty in a step: some
/// tenths of a second at most.
constexpr double kMostWork = 1.5e7;
/// Below this softness [m/s / N s times a step] a problem is not well enough conditioned.
constexpr double kLeastSoftness = 1e-12;

/// x of A x = b for a symmetric positive matrix.
Vec3 solved(const std::array<double, 9>& A, const Vec3& b) {
  const Vec3 r0{A[0], A[1], A[2]}, r1{A[3], A[4], A[5]}, r2{A[6], A[7], A[8]};
  const Vec3 c0 = spatial::cross(r1, r2), c1 = spatial::cross(r2, r0), c2 = spatial::cross(r0, r1);
  const double det = spatial::dot(r0, c0);
  Vec3 x;
  for (std::size_t k = 0; k < 3; ++k) x[k] = (c0[k] * b[0] + c1[k] * b[1] + c2[k] * b[2]) / det;
  return x;
}

}  // namespace

PileBody OdeWorld::pile_body(std::int32_t body) const {
  const Body& b = bodies_[static_cast<std::size_t>(body)];
  PileBody out;
  dMass m;
  dBodyGetMass(b.id, &m);
  out.mass = m.mass;
  out.inertia = inertia_in_world(b.id);
  out.v = vec3(dBodyGetLinearVel(b.id)), out.w = vec3(dBodyGetAngularVel(b.id));
  Vec3 force{}, torque{};
  for (const Push& p : pushes_) {
    if (p.body != body) continue;
    const Vec3 arm = spatial::sub(pose(body).p, vec3(dBodyGetPosition(b.id)));
    force = spatial::add(force, p.force);
    torque = spatial::add(torque, spatial::add(p.torque, spatial::cross(arm, p.force)));
  }
  out.v_free = spatial::add(
      out.v, spatial::scale(spatial::add(gravity_, spatial::scale(force, 1 / out.mass)), dt_));
  out.w_free = spatial::add(b.turn.is_on ? b.turn.w_after : out.w,
                            spatial::scale(solved(out.inertia, torque), dt_));
  return out;
}

/// Rows as the engine's contact joints have them.
PileContact OdeWorld::pile_contact(const Contact& contact, Pass pass) const {
  const dContact& c = contact.made;
  const dSurfaceParameters s = surface(contact, pass);
  PileContact out;
  const Vec3 n = contact.contact.normal, at = contact.contact.point;
  dVector3 t1, t2;
  if (c.surface.mode & dContactFDir1) {
    std::copy_n(c.fdir1, 3, t1);
  } else {
    dPlaneSpace(c.geom.normal, t1, t2);
  }
  out.axis = {n, vec3(t1), spatial::cross(n, vec3(t1))};
  out.soft = s.soft_cfm / dt_, out.soft_across = settings_.cfm / dt_;
  out.friction = c.surface.mu;
  if (pass == Pass::places) out.limit = s.mu * dt_;
  out.place = contact.place;
  Vec3 speed{}, known{};  // of what is at the point, a less b, and of what the pile does not move
  const auto take = [&](std::int32_t body, double sign, std::int32_t& number, Vec3& arm) {
    const Body& b = bodies_[static_cast<std::size_t>(body)];
    if (!b.id) return;
    number = b.is_movable ? local_[static_cast<std::size_t>(body)] : -1;
    arm = spatial::sub(at, vec3(dBodyGetPosition(b.id)));
    const Vec3 v = spatial::scale(spatial::add(vec3(dBodyGetLinearVel(b.id)),
                                               spatial::cross(vec3(dBodyGetAngularVel(b.id)), arm)),
                                  sign);
    speed = spatial::add(speed, v);
    if (number < 0) known = spatial::add(known, v);
  };
  take(contact.contact.a, 1, out.a, out.arm_a);
  take(contact.contact.b, -1, out.b, out.arm_b);
  const double depth = std::max(0.0, c.geom.depth - dWorldGetContactSurfaceLayer(world_));
  double wanted = s.soft_erp / dt_ * depth;
  const double approach = -spatial::dot(n, speed);
  if ((c.surface.mode & dContactBounce) && approach > c.surface.bounce_vel)
    wanted = std::max(wanted, c.surface.bounce * approach);
  out.target = {wanted - spatial::dot(n, known), -spatial::dot(out.axis[1], known),
                -spatial::dot(out.axis[2], known)};
  return out;
}

/// Solves one pile; false where it was not solved.
bool OdeWorld::settle(std::span<const std::size_t> contacts, Pass pass) {
  std::vector<std::int32_t> members;
  for (const std::size_t c : contacts)
    for (const std::int32_t body : {contacts_[c].contact.a, contacts_[c].contact.b}) {
      const auto i = static_cast<std::size_t>(body);
      if (!bodies_[i].is_movable || local_[i] >= 0) continue;
      local_[i] = static_cast<std::int32_t>(members.size());
      members.push_back(body);
    }
  std::vector<PileBody> bodies;
  std::vector<PileContact> rows;
  for (const std::int32_t body : members) bodies.push_back(pile_body(body));
  for (const std::size_t c : contacts) rows.push_back(pile_contact(contacts_[c], pass));
  const bool has_limits = std::all_of(
      rows.begin(), rows.end(), [](const PileContact& row) { return std::isfinite(row.friction); });
  const bool is_solved = has_limits && solve_pile(bodies, rows, kMostWork);
  for (const std::int32_t body : members) local_[static_cast<std::size_t>(body)] = -1;
  if (!is_solved) return false;
  const std::size_t first = pile_forces_.size();
  for (const std::int32_t body : members) pile_forces_.push_back({body_id(body), {}, {}});
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    const PileContact& row = rows[i];
    Contact& c = contacts_[contacts[i]];
    c.is_solved = true;
    Vec3 total{};
    for (std::size_t r = 0; r < 3; ++r)
      total = spatial::add(total, spatial::scale(row.axis[r], row.impulse[r] / dt_));
    if (pass != Pass::places) c.contact.force = total, c.place = row.place;
    const auto give = [&](std::int32_t body, const Vec3& arm, double sign) {
      if (body < 0) return;
      PileForce& f = pile_forces_[first + static_cast<std::size_t>(body)];
      const Vec3 force = spatial::scale(total, sign);
      f.force = spatial::add(f.force, force);
      f.torque = spatial::add(f.torque, spatial::cross(arm, force));
    };
    give(row.a, row.arm_a, 1);
    give(row.b, row.arm_b, -1);
  }
  return true;
}

void OdeWorld::settle_piles(Pass pass) {
  pile_forces_.clear();
  if (!settings_.exact || settings_.cfm < kLeastSoftness ||
      settings_.contact_cfm < kLeastSoftness || contacts_.empty())
    return;
  std::vector<std::size_t> root(bodies_.size());
  for (std::size_t i = 0; i < root.size(); ++i) root[i] = i;
  const auto find = [&](std::size_t i) {
    while (root[i] != i) i = root[i] = root[root[i]];
    return i;
  };
  const auto moves = [&](std::int32_t body) {
    return bodies_[static_cast<std::size_t>(body)].is_movable;
  };
  for (const Contact& c : contacts_)
    if (moves(c.contact.a) && moves(c.contact.b))
      root[find(static_cast<std::size_t>(c.contact.a))] =
          find(static_cast<std::size_t>(c.contact.b));
  // What a joint holds, or an attachment, is the engine's with all that touches it.
  std::vector<char> is_held(bodies_.size());
  for (std::size_t i = 0; i < bodies_.size(); ++i)
    if (bodies_[i].is_movable && bodies_[i].is_jointed) is_held[find(i)] = 1;
  for (const Attachment& t : attachments_)
    for (const std::int32_t body : {t.a, t.b})
      if (t.joint && moves(body)) is_held[find(static_cast<std::size_t>(body))] = 1;
  std::vector<std::size_t> number(bodies_.size(), bodies_.size());
  std::vector<std::vector<std::size_t>> piles;
  for (std::size_t i = 0; i < contacts_.size(); ++i) {
    const PhysicsContact& c = contacts_[i].contact;
    const std::size_t pile = find(static_cast<std::size_t>(moves(c.a) ? c.a : c.b));
    if (is_held[pile]) continue;
    if (number[pile] == bodies_.size()) number[pile] = piles.size(), piles.emplace_back();
    piles[number[pile]].push_back(i);
  }
  local_.assign(bodies_.size(), -1);
  // What is moved, such as a conveyor, ties together for the engine all that touches it.
  const auto ties = [&](std::size_t contact) {
    const PhysicsContact& c = contacts_[contact].contact;
    return (!moves(c.a) && body_id(c.a)) || (!moves(c.b) && body_id(c.b));
  };
  for (const auto& pile : piles)
    if (pile.size() >= settings_.piles_from || std::any_of(pile.begin(), pile.end(), ties))
      settle(pile, pass);
}

}  // namespace robomosp::physics_ode
