// SPDX-License-Identifier: Apache-2.0
#include "newton_euler.h"

#include <algorithm>
#include <cmath>

#include "spatial/pose.h"

namespace robomosp::newton_euler {
namespace {

using spatial::add;
using spatial::cross;
using spatial::multiply;
using spatial::rotate;
using spatial::rotate_back;
using spatial::scale;

// What the outward pass leaves for the inward pass, in each joint's frame.
struct State {
  Pose to_parent;       // parent_T_joint(q)
  Vec3 w{}, wd{}, a{};  // angular velocity, angular and linear acceleration of the origin
  Vec3 f{}, n{};        // force and moment about the origin
  std::array<double, 9> base_R{};  // only kept when a tip wrench acts
};
struct Composite {
  Pose to_parent;
  double mass = 0;
  Vec3 first{};
  Sym3 inertia;
};
static_assert(sizeof(State) % sizeof(double) == 0 && sizeof(Composite) % sizeof(double) == 0);
static_assert(alignof(State) == alignof(double) && alignof(Composite) == alignof(double));

Pose moved(const ChainJoint& joint, double q) {
  Pose t{joint.R, joint.p};
  if (joint.is_prismatic) {
    t.p = {t.p[0] + q * t.R[2], t.p[1] + q * t.R[5], t.p[2] + q * t.R[8]};
    return t;
  }
  const double s = std::sin(q), c = std::cos(q);
  for (std::size_t i = 0; i < 9; i += 3) {
    const double x = t.R[i], y = t.R[i + 1];
    t.R[i] = x * c + y * s;
    t.R[i + 1] = y * c - x * s;
  }
  return t;
}

std::array<double, 9> product(const std::array<double, 9>& a, const std::array<double, 9>& b) {
  std::array<double, 9> c;
  for (std::size_t i = 0; i < 9; i += 3)
    for (std::size_t j = 0; j < 3; ++j)
      c[i + j] = a[i] * b[j] + a[i + 1] * b[3 + j] + a[i + 2] * b[6 + j];
  return c;
}

// Paper eqs 2 and 4, with gravity as an acceleration of the base.
void outward(const ChainJoint& joint, const State* parent, const Vec3& base_a, double qd,
             double qdd, State& s) {
  if (parent) {
    const Vec3 &w = parent->w, &wd = parent->wd, &p = s.to_parent.p;
    s.w = rotate_back(s.to_parent, w);
    s.wd = rotate_back(s.to_parent, wd);
    s.a = rotate_back(s.to_parent, add(parent->a, add(cross(wd, p), cross(w, cross(w, p)))));
  } else {
    s.w = s.wd = {};
    s.a = rotate_back(s.to_parent, base_a);
  }
  if (joint.is_prismatic) {
    s.a = {s.a[0] + 2 * s.w[1] * qd, s.a[1] - 2 * s.w[0] * qd, s.a[2] + qdd};
  } else {
    s.wd = {s.wd[0] + s.w[1] * qd, s.wd[1] - s.w[0] * qd, s.wd[2] + qdd};
    s.w[2] += qd;
  }
}

// Paper eq 5 for one body: rate of its momentum about the joint's origin.
void body_force(const ChainJoint& joint, State& s) {
  const Vec3& h = joint.first;
  s.f = add(scale(s.a, joint.mass), add(cross(s.wd, h), cross(s.w, cross(s.w, h))));
  s.n = add(multiply(joint.inertia, s.wd),
            add(cross(s.w, multiply(joint.inertia, s.w)), cross(h, s.a)));
}

void subtract_wrench(const Chain& chain, const TipWrench& tip, State& s) {
  Pose base;
  base.R = s.base_R;
  const Vec3 f = rotate_back(base, tip.force);
  const Vec3 n = add(rotate_back(base, tip.moment), cross(chain.tip, f));
  s.f = spatial::sub(s.f, f);
  s.n = spatial::sub(s.n, n);
}

}  // namespace

std::size_t newton_euler_scratch(const Chain& chain) {
  return chain.dof() * (sizeof(State) / sizeof(double));
}

void newton_euler(const Chain& chain, const Motion& motion, double* scratch, double* tau) {
  const std::size_t n = chain.dof();
  State* states = reinterpret_cast<State*>(scratch);
  const Vec3 base_a = scale(motion.gravity, -1);
  for (std::size_t j = 0; j < n; ++j) {
    const ChainJoint& joint = chain.joints[j];
    State& s = states[j];
    const State* parent = joint.parent < 0 ? nullptr : &states[joint.parent];
    s.to_parent = moved(joint, motion.q[j]);
    outward(joint, parent, base_a, motion.qd ? motion.qd[j] : 0.0, motion.qdd ? motion.qdd[j] : 0.0,
            s);
    body_force(joint, s);
    if (motion.tip) s.base_R = parent ? product(parent->base_R, s.to_parent.R) : s.to_parent.R;
  }
  if (motion.tip && chain.tip_joint >= 0)
    subtract_wrench(chain, *motion.tip, states[chain.tip_joint]);
  for (std::size_t j = n; j-- > 0;) {
    const ChainJoint& joint = chain.joints[j];
    const State& s = states[j];
    tau[j] = joint.is_prismatic ? s.f[2] : s.n[2];  // paper eq 6
    if (joint.parent < 0) continue;
    State& up = states[joint.parent];
    const Vec3 f = rotate(s.to_parent, s.f);
    up.f = add(up.f, f);
    up.n = add(up.n, add(rotate(s.to_parent, s.n), cross(s.to_parent.p, f)));
  }
}

void selected_torques(const Chain& chain, const DynamicsBatch& batch, std::size_t sample,
                      std::uint32_t terms, double* scratch, double* tau) {
  const std::size_t n = chain.dof(), at = sample * n;
  const double* qd = batch.qd.empty() ? nullptr : batch.qd.data() + at;
  const double* qdd =
      batch.qdd.empty() || !(terms & kInertialTerm) ? nullptr : batch.qdd.data() + at;
  Motion motion;
  motion.q = batch.q.data() + at;
  motion.qd = (terms & kVelocityTerm) ? qd : nullptr;
  motion.qdd = qdd;
  if (terms & kGravityTerm) motion.gravity = chain.gravity;
  if ((terms & kExternalTerm) && !batch.tip.empty())
    motion.tip = &batch.tip[batch.tip.size() == 1 ? 0 : sample];
  newton_euler(chain, motion, scratch, tau);
  if (qdd)
    for (std::size_t j = 0; j < n; ++j) tau[j] += chain.joints[j].armature * qdd[j];
  if (qd && (terms & kFrictionTerm))
    for (std::size_t j = 0; j < n; ++j) {
      const JointFriction& f = chain.joints[j].friction;
      tau[j] += f.viscous * qd[j];
      if (qd[j] > 0) tau[j] += f.coulomb_positive;
      if (qd[j] < 0) tau[j] += f.coulomb_negative;
    }
}

std::size_t inertia_scratch(const Chain& chain, InertiaMethod method) {
  if (method == InertiaMethod::columns) return newton_euler_scratch(chain) + 2 * chain.dof();
  return chain.dof() * (sizeof(Composite) / sizeof(double));
}

namespace {

// Adds the composite body of a joint to its parent's: the moments about the parent's origin.
void add_to_parent(const Composite& c, Composite& up) {
  const Vec3& p = c.to_parent.p;
  const Vec3 h = rotate(c.to_parent, c.first);
  const Vec3 r0{c.to_parent.R[0], c.to_parent.R[1], c.to_parent.R[2]};
  const Vec3 r1{c.to_parent.R[3], c.to_parent.R[4], c.to_parent.R[5]};
  const Vec3 r2{c.to_parent.R[6], c.to_parent.R[7], c.to_parent.R[8]};
  const Vec3 i0 = multiply(c.inertia, r0), i1 = multiply(c.inertia, r1),
             i2 = multiply(c.inertia, r2);
  // For x' = R x + p with first moment h: 2 (p.h) 1 - p h^T - h p^T + m (p^2 1 - p p^T).
  const Vec3 g = add(h, scale(p, 0.5 * c.mass));
  const double trace = 2 * spatial::dot(p, g);
  const auto cross_term = [&](std::size_t a, std::size_t b) { return p[a] * g[b] + g[a] * p[b]; };
  up.inertia = spatial::add(
      up.inertia,
      {spatial::dot(r0, i0) + trace - cross_term(0, 0),
       spatial::dot(r1, i1) + trace - cross_term(1, 1),
       spatial::dot(r2, i2) + trace - cross_term(2, 2), spatial::dot(r0, i1) - cross_term(0, 1),
       spatial::dot(r1, i2) - cross_term(1, 2), spatial::dot(r0, i2) - cross_term(0, 2)});
  up.first = add(up.first, add(h, scale(p, c.mass)));
  up.mass += c.mass;
}

void composite_inertia(const Chain& chain, const double* q, double* scratch, double* m) {
  const std::size_t n = chain.dof();
  Composite* bodies = reinterpret_cast<Composite*>(scratch);
  std::fill(m, m + n * n, 0.0);
  for (std::size_t j = 0; j < n; ++j) {
    const ChainJoint& joint = chain.joints[j];
    bodies[j] = {moved(joint, q[j]), joint.mass, joint.first, joint.inertia};
  }
  for (std::size_t j = n; j-- > 0;) {
    const ChainJoint& joint = chain.joints[j];
    const Composite& c = bodies[j];
    if (joint.parent >= 0) add_to_parent(c, bodies[joint.parent]);
    Vec3 f, moment;
    if (joint.is_prismatic) {
      f = {0, 0, c.mass};
      moment = {c.first[1], -c.first[0], 0};
    } else {
      f = {-c.first[1], c.first[0], 0};
      moment = {c.inertia.xz, c.inertia.yz, c.inertia.zz};
    }
    m[j * n + j] = (joint.is_prismatic ? f[2] : moment[2]) + joint.armature;
    std::size_t at = j;
    for (std::int32_t up = joint.parent; up >= 0;
         up = chain.joints[static_cast<std::size_t>(up)].parent) {
      const Pose& t = bodies[at].to_parent;
      f = rotate(t, f);
      moment = add(rotate(t, moment), cross(t.p, f));
      at = static_cast<std::size_t>(up);
      const double value = chain.joints[at].is_prismatic ? f[2] : moment[2];
      m[j * n + at] = m[at * n + j] = value;
    }
  }
}

// The paper's way: column k is the force for unit acceleration of joint k alone.
void columns_inertia(const Chain& chain, const double* q, double* scratch, double* m) {
  const std::size_t n = chain.dof();
  double* unit = scratch + newton_euler_scratch(chain);
  double* column = unit + n;
  std::fill(unit, unit + n, 0.0);
  for (std::size_t k = 0; k < n; ++k) {
    unit[k] = 1;
    newton_euler(chain, {q, nullptr, unit, {}, nullptr}, scratch, column);
    unit[k] = 0;
    for (std::size_t i = 0; i <= k; ++i) m[i * n + k] = m[k * n + i] = column[i];
    m[k * n + k] += chain.joints[k].armature;
  }
}

}  // namespace

void joint_space_inertia(const Chain& chain, InertiaMethod method, const double* q, double* scratch,
                         double* m) {
  if (method == InertiaMethod::columns) columns_inertia(chain, q, scratch, m);
  else composite_inertia(chain, q, scratch, m);
}

}  // namespace robomosp::newton_euler
