// SPDX-License-Identifier: Apache-2.0
#include "spatial/body_tree.h"

#include <algorithm>
#include <cmath>

#include "spatial/mass.h"
#include "spatial/rest.h"

namespace robomosp::spatial {
namespace {

static_assert(sizeof(MovingBody) % sizeof(double) == 0 && alignof(MovingBody) == alignof(double));
static_assert(sizeof(Screw) == 6 * sizeof(double));

Result<void> check_joint(const RobotModel& model, std::size_t i, const std::string& where) {
  const JointModel& m = model.joints[i];
  if (m.parent < -1 || m.parent >= static_cast<std::int32_t>(i))
    return error(ErrorCode::invalid_argument, "its parent does not come before it",
                 "Order the joints so that parents come first.", where);
  if (!is_finite(m.body) || !is_rigid(m.placement))
    return error(ErrorCode::invalid_argument, "its placement or mass properties are not finite",
                 "Correct the robot's rows and masses.", where);
  if (m.q_index < 0 || m.v_index < 0 ||
      m.q_index + (m.is_coupled() ? 1 : coordinate_count(m.type)) > model.coordinates ||
      m.v_index + (m.is_coupled() ? 1 : velocity_count(m.type)) > model.velocities)
    return error(ErrorCode::invalid_argument, "its coordinates are not numbered",
                 "Call RobotModel::number_coordinates() when the joints are complete.", where);
  if (m.is_coupled()) {
    const auto of = static_cast<std::size_t>(m.coupling.of);
    if (of >= model.joints.size() || model.joints[of].is_coupled() ||
        coordinate_count(model.joints[of].type) != 1 || coordinate_count(m.type) != 1)
      return error(ErrorCode::invalid_argument, "it follows a joint that cannot be followed",
                   "It can only follow an uncoupled revolute or prismatic joint.", where);
  }
  return {};
}

}  // namespace

Result<void> check_mechanism(const RobotModel& model) {
  const std::string where = "robot \"" + model.name + "\"";
  if (model.joints.empty())
    return error(ErrorCode::invalid_argument, "it has no joints", "Give it at least one joint.",
                 where);
  for (std::size_t i = 0; i < model.joints.size(); ++i)
    RMP_TRY(check_joint(model, i, where + ", joint \"" + model.joints[i].name + "\""));
  const auto joints = static_cast<std::int32_t>(model.joints.size());
  for (const TipModel& t : model.tips)
    if (t.joint < -1 || t.joint >= joints)
      return error(ErrorCode::invalid_argument,
                   "tip \"" + t.name + "\" is on a joint that does not exist", "Correct the tip.",
                   where);
  for (const LoopModel& l : model.loops)
    if (l.joint_a < -1 || l.joint_a >= joints || l.joint_b < -1 || l.joint_b >= joints)
      return error(ErrorCode::invalid_argument,
                   "loop \"" + l.name + "\" is at a joint that does not exist", "Correct the loop.",
                   where);
  return {};
}

Result<BodyTree> make_body_tree(const RobotModel& model) {
  RMP_TRY(check_mechanism(model));
  BodyTree tree;
  tree.name = model.name;
  tree.gravity = model.gravity;
  tree.tips = model.tips;
  tree.loops = model.loops;
  tree.coordinates = model.coordinate_count();
  tree.velocities = model.dof();
  for (const JointModel& m : model.joints) {
    TreeBody b;
    b.type = m.type;
    b.parent = m.parent;
    b.q_index = m.q_index;
    b.v_index = m.v_index;
    b.column = static_cast<std::int32_t>(tree.columns);
    b.columns = velocity_count(m.type);
    b.coupled = m.is_coupled();
    if (b.coupled) b.ratio = m.coupling.ratio, b.offset = m.coupling.offset;
    b.placement = m.placement;
    b.inertia = {m.body.mass, scale(m.body.com, m.body.mass), inertia_about(m.body, Vec3{})};
    if (b.columns == 1) b.armature = m.armature, b.spring = m.spring, b.friction = m.friction;
    tree.columns += static_cast<std::size_t>(b.columns);
    tree.bodies.push_back(b);
    tree.joint_names.push_back(m.name);
  }
  return tree;
}

Result<void> check_batch(const BatchShape& shape, const DynamicsBatch& b,
                         std::size_t required_scratch, std::size_t output,
                         std::size_t output_per_sample) {
  const std::size_t nq = b.count * shape.coordinates, nv = b.count * shape.velocities;
  const auto where = [&] { return "robot \"" + shape.robot + "\""; };
  const auto wrong = [&](const char* what, std::size_t is, std::size_t should) {
    return error(ErrorCode::invalid_argument,
                 std::string(what) + " has " + std::to_string(is) + " values for " +
                     std::to_string(b.count) + " samples of " + where(),
                 "Give " + std::to_string(should) + ".");
  };
  if (b.q.size() != nq) return wrong("q", b.q.size(), nq);
  if (!b.qd.empty() && b.qd.size() != nv) return wrong("qd", b.qd.size(), nv);
  if (!b.qdd.empty() && b.qdd.size() != nv) return wrong("qdd", b.qdd.size(), nv);
  if (!b.tau.empty() && b.tau.size() != nv) return wrong("tau", b.tau.size(), nv);
  if (b.tip.size() > 1 && b.tip.size() != b.count)
    return wrong("the tip wrench", b.tip.size(), b.count);
  if (!b.tip.empty() && (b.tip_index < 0 || static_cast<std::size_t>(b.tip_index) >= shape.tips))
    return error(ErrorCode::invalid_argument,
                 "there is no tip " + std::to_string(b.tip_index) + " for the wrench to act at",
                 "Choose one of the " + std::to_string(shape.tips) + " tips.", where());
  if (b.base.size() > 1 && b.base.size() != b.count)
    return wrong("the base's motion", b.base.size(), b.count);
  if (output != b.count * output_per_sample)
    return wrong("the output", output, b.count * output_per_sample);
  if (b.scratch.size() < required_scratch)
    return wrong("scratch", b.scratch.size(), required_scratch);
  return {};
}

Pose joint_pose(const TreeBody& b, const double* q) {
  const double* own = q + b.q_index;
  switch (b.type) {
    case JointType::revolute: {
      Pose t = b.placement;
      const double x = b.ratio * own[0] + b.offset, s = std::sin(x), c = std::cos(x);
      for (std::size_t i = 0; i < 9; i += 3) {
        const double u = t.R[i], v = t.R[i + 1];
        t.R[i] = u * c + v * s;
        t.R[i + 1] = v * c - u * s;
      }
      return t;
    }
    case JointType::prismatic: {
      Pose t = b.placement;
      const double x = b.ratio * own[0] + b.offset;
      t.p = {t.p[0] + x * t.R[2], t.p[1] + x * t.R[5], t.p[2] + x * t.R[8]};
      return t;
    }
    case JointType::spherical: {
      Pose moved;
      moved.R = quaternion_rotation(own);
      return compose(b.placement, moved);
    }
    case JointType::free:
      return compose(b.placement, {quaternion_rotation(own + 3), {own[0], own[1], own[2]}});
  }
  return b.placement;
}

Screw joint_column(const TreeBody& b, std::int32_t k) {
  Screw s;
  const auto i = static_cast<std::size_t>(k);
  switch (b.type) {
    case JointType::revolute: s.angular[2] = b.ratio; break;
    case JointType::prismatic: s.linear[2] = b.ratio; break;
    case JointType::spherical: s.angular[i] = 1; break;
    case JointType::free: (k < 3 ? s.linear[i] : s.angular[i - 3]) = 1; break;
  }
  return s;
}

TreeState state_of(const BodyTree& tree, const DynamicsBatch& batch, std::size_t sample,
                   std::uint32_t terms, bool forward) {
  TreeState s;
  const std::size_t v = sample * tree.velocities;
  s.q = batch.q.data() + sample * tree.coordinates;
  if (!batch.qd.empty() && (terms & kVelocityTerm)) s.qd = batch.qd.data() + v;
  if (!batch.qdd.empty() && !forward && (terms & kInertialTerm)) s.qdd = batch.qdd.data() + v;
  Vec3 gravity = tree.gravity;
  if (!batch.base.empty()) {
    const BaseMotion& b = batch.base[batch.base.size() == 1 ? 0 : sample];
    gravity = b.gravity;
    s.base_velocity.angular = b.angular_velocity;
    s.base_acceleration = {b.angular_acceleration, b.acceleration};
  }
  if (!forward && !(terms & kInertialTerm)) s.base_acceleration = {};
  if (terms & kGravityTerm) s.base_acceleration.linear = sub(s.base_acceleration.linear, gravity);
  return s;
}

void sweep(const BodyTree& tree, const TreeState& state, std::span<MovingBody> bodies,
           std::span<Screw> columns) {
  for (std::size_t i = 0; i < tree.bodies.size(); ++i) {
    const TreeBody& b = tree.bodies[i];
    MovingBody& m = bodies[i];
    const MovingBody* up = b.parent < 0 ? nullptr : &bodies[static_cast<std::size_t>(b.parent)];
    const Pose local = joint_pose(b, state.q);
    m.pose = up ? compose(up->pose, local) : local;
    Screw rate, push;
    for (std::int32_t k = 0; k < b.columns; ++k) {
      const Screw column = motion_out(m.pose, joint_column(b, k));
      columns[static_cast<std::size_t>(b.column + k)] = column;
      if (state.qd) rate = add(rate, scale(column, state.qd[b.v_index + k]));
      if (state.qdd) push = add(push, scale(column, state.qdd[b.v_index + k]));
    }
    m.velocity = add(up ? up->velocity : state.base_velocity, rate);
    m.acceleration = add(up ? up->acceleration : state.base_acceleration,
                         add(push, cross_motion(m.velocity, rate)));
    m.inertia = inertia_out(m.pose, b.inertia);
    m.force = add(multiply(m.inertia, m.acceleration),
                  cross_force(m.velocity, multiply(m.inertia, m.velocity)));
  }
}

void apply_wrench(const BodyTree& tree, std::size_t tip, const TipWrench& wrench,
                  std::span<MovingBody> bodies) {
  const TipModel& t = tree.tips[tip];
  if (t.joint < 0) return;
  MovingBody& m = bodies[static_cast<std::size_t>(t.joint)];
  const Vec3 at = transform(m.pose, t.tool.p);
  m.force = sub(m.force, {add(wrench.moment, cross(at, wrench.force)), wrench.force});
}

void gather(const BodyTree& tree, std::span<MovingBody> bodies, bool inertias) {
  for (std::size_t i = tree.bodies.size(); i-- > 0;) {
    const std::int32_t parent = tree.bodies[i].parent;
    if (parent < 0) continue;
    MovingBody& up = bodies[static_cast<std::size_t>(parent)];
    up.force = add(up.force, bodies[i].force);
    if (inertias) up.inertia = add(up.inertia, bodies[i].inertia);
  }
}

void add_joint_forces(const BodyTree& tree, const DynamicsBatch& batch, std::size_t sample,
                      std::uint32_t terms, std::span<double> tau) {
  const double* q = batch.q.data() + sample * tree.coordinates;
  const double* qd = batch.qd.empty() ? nullptr : batch.qd.data() + sample * tree.velocities;
  const double* qdd = batch.qdd.empty() ? nullptr : batch.qdd.data() + sample * tree.velocities;
  for (const TreeBody& b : tree.bodies) {
    const auto v = static_cast<std::size_t>(b.v_index);
    if (qdd && (terms & kInertialTerm) && b.columns == 1)
      tau[v] += b.ratio * b.ratio * b.armature * qdd[v];
    if ((terms & kSpringTerm) && b.spring.stiffness != 0)
      tau[v] += b.ratio * b.spring.stiffness * (b.ratio * q[b.q_index] + b.offset - b.spring.rest);
    if (!qd || !(terms & kFrictionTerm)) continue;
    for (std::size_t k = v; k < v + static_cast<std::size_t>(b.columns); ++k) {
      const double rate = b.ratio * qd[k];
      double force = b.friction.viscous * rate;
      if (rate > kRestSpeed) force += b.friction.coulomb_positive;
      if (rate < -kRestSpeed) force += b.friction.coulomb_negative;
      tau[k] += b.ratio * force;
    }
  }
}

namespace {

void project(const BodyTree& tree, std::span<const MovingBody> bodies,
             std::span<const Screw> columns, double sign, std::span<double> tau) {
  for (std::size_t i = 0; i < tree.bodies.size(); ++i) {
    const TreeBody& b = tree.bodies[i];
    for (std::int32_t k = 0; k < b.columns; ++k)
      tau[static_cast<std::size_t>(b.v_index + k)] +=
          sign * dot(columns[static_cast<std::size_t>(b.column + k)], bodies[i].force);
  }
}

}  // namespace

void tree_torques(const BodyTree& tree, const DynamicsBatch& batch, std::size_t sample,
                  std::uint32_t terms, bool forward, std::span<MovingBody> bodies,
                  std::span<Screw> columns, std::span<double> tau) {
  std::fill(tau.begin(), tau.end(), 0.0);
  TreeState state = state_of(tree, batch, sample, terms, forward);
  // The turning base alone belongs to the inertial term, with moving joints to the velocity term:
  // without the inertial term its part is taken away again.
  if (!forward && !(terms & kInertialTerm)) {
    if (!(terms & kVelocityTerm)) {
      state.base_velocity = {};
    } else if (norm(state.base_velocity.angular) > 0) {
      TreeState still;
      still.q = state.q;
      still.base_velocity = state.base_velocity;
      sweep(tree, still, bodies, columns);
      gather(tree, bodies, false);
      project(tree, bodies, columns, -1, tau);
    }
  }
  sweep(tree, state, bodies, columns);
  if ((terms & kExternalTerm) && !batch.tip.empty())
    apply_wrench(tree, static_cast<std::size_t>(batch.tip_index),
                 batch.tip[batch.tip.size() == 1 ? 0 : sample], bodies);
  gather(tree, bodies, true);
  project(tree, bodies, columns, 1, tau);
  add_joint_forces(tree, batch, sample,
                   forward ? terms & ~static_cast<std::uint32_t>(kInertialTerm) : terms, tau);
}

void tree_inertia(const BodyTree& tree, std::span<const MovingBody> bodies,
                  std::span<const Screw> columns, std::span<double> m) {
  const std::size_t n = tree.velocities;
  std::fill(m.begin(), m.end(), 0.0);
  for (std::size_t i = 0; i < tree.bodies.size(); ++i) {
    const TreeBody& b = tree.bodies[i];
    for (std::int32_t k = 0; k < b.columns; ++k) {
      const auto row = static_cast<std::size_t>(b.v_index + k);
      const Screw f = multiply(bodies[i].inertia, columns[static_cast<std::size_t>(b.column + k)]);
      for (std::int32_t l = 0; l < b.columns; ++l)
        m[row * n + static_cast<std::size_t>(b.v_index + l)] +=
            dot(columns[static_cast<std::size_t>(b.column + l)], f);
      for (std::int32_t up = b.parent; up >= 0;) {
        const TreeBody& a = tree.bodies[static_cast<std::size_t>(up)];
        for (std::int32_t l = 0; l < a.columns; ++l) {
          const auto at = static_cast<std::size_t>(a.v_index + l);
          const double x = dot(columns[static_cast<std::size_t>(a.column + l)], f);
          m[row * n + at] += x;
          m[at * n + row] += x;
        }
        up = a.parent;
      }
    }
    if (b.columns == 1) {
      const auto v = static_cast<std::size_t>(b.v_index);
      m[v * n + v] += b.ratio * b.ratio * b.armature;
    }
  }
}

std::size_t tree_scratch(const BodyTree& tree) {
  return (tree.bodies.size() * sizeof(MovingBody) + tree.columns * sizeof(Screw)) / sizeof(double);
}

TreeScratch take_scratch(const BodyTree& tree, double* scratch) {
  TreeScratch s;
  s.bodies = {reinterpret_cast<MovingBody*>(scratch), tree.bodies.size()};
  double* next = scratch + s.bodies.size_bytes() / sizeof(double);
  s.columns = {reinterpret_cast<Screw*>(next), tree.columns};
  s.rest = next + s.columns.size_bytes() / sizeof(double);
  return s;
}

std::ptrdiff_t cholesky(std::span<double> m, std::size_t n) {
  constexpr double kPivot = 1e-13;  // relative to the diagonal: below this a pivot is rounding
  for (std::size_t i = 0; i < n; ++i) {
    double* row = m.data() + i * n;
    const double diagonal = row[i];
    for (std::size_t j = 0; j <= i; ++j) {
      const double* other = m.data() + j * n;
      double s = row[j];
      for (std::size_t k = 0; k < j; ++k) s -= row[k] * other[k];
      if (j < i) {
        row[j] = s / other[j];
      } else {
        if (!(s > kPivot * diagonal)) return static_cast<std::ptrdiff_t>(i);
        row[i] = std::sqrt(s);
      }
    }
  }
  return -1;
}

void cholesky_solve(std::span<const double> m, std::size_t n, double* x) {
  for (std::size_t i = 0; i < n; ++i) {
    double s = x[i];
    for (std::size_t k = 0; k < i; ++k) s -= m[i * n + k] * x[k];
    x[i] = s / m[i * n + i];
  }
  for (std::size_t i = n; i-- > 0;) {
    double s = x[i];
    for (std::size_t k = i + 1; k < n; ++k) s -= m[k * n + i] * x[k];
    x[i] = s / m[i * n + i];
  }
}

}  // namespace robomosp::spatial
