// SPDX-License-Identifier: Apache-2.0
#include "mechanism.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "spatial/body_tree.h"
#include "spatial/loops.h"
#include "spatial/mass.h"
#include "spatial/pose.h"
#include "spatial/rest.h"

namespace robomosp::robot_code {
namespace {

using Vector = std::array<Number, 3>;
using Matrix = std::array<Number, 9>;  ///< row-major

Vector operator+(const Vector& a, const Vector& b) {
  return {a[0] + b[0], a[1] + b[1], a[2] + b[2]};
}
Vector operator-(const Vector& a, const Vector& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
Vector operator*(const Number& s, const Vector& a) { return {s * a[0], s * a[1], s * a[2]}; }
Vector cross(const Vector& a, const Vector& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
Number dot(const Vector& a, const Vector& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
Vector operator*(const Matrix& m, const Vector& v) {
  return {m[0] * v[0] + m[1] * v[1] + m[2] * v[2], m[3] * v[0] + m[4] * v[1] + m[5] * v[2],
          m[6] * v[0] + m[7] * v[1] + m[8] * v[2]};
}
Matrix transposed(const Matrix& m) {
  return {m[0], m[3], m[6], m[1], m[4], m[7], m[2], m[5], m[8]};
}

/// Rotations by right angles come with residues of some 1e-16, which would cost operations.
double snapped(double x) {
  constexpr double kResidue = 4e-16;
  for (const double whole : {-1.0, 0.0, 1.0})
    if (std::fabs(x - whole) < kResidue) return whole;
  return x;
}
Matrix constants(const std::array<double, 9>& m) {
  Matrix out;
  for (std::size_t i = 0; i < 9; ++i) out[i] = snapped(m[i]);
  return out;
}
Vector constants(const Vec3& v) { return {v[0], v[1], v[2]}; }

/// parent_T_joint: a constant rotation, then a turn about z by an angle or any rotation.
struct Placed {
  bool is_twist = false;  ///< the constant rotation is one about x
  double cos_twist = 1, sin_twist = 0;
  Matrix rotation;  ///< the constant one, when it is no twist
  bool is_ball = false;
  Number c = 1, s = 0;  ///< of the turn about z
  Matrix ball;
  Vector p;

  [[nodiscard]] Vector fixed(const Vector& u) const {
    if (!is_twist) return rotation * u;
    return {u[0], Number(cos_twist) * u[1] - Number(sin_twist) * u[2],
            Number(sin_twist) * u[1] + Number(cos_twist) * u[2]};
  }
  [[nodiscard]] Vector fixed_back(const Vector& v) const {
    if (!is_twist) return transposed(rotation) * v;
    return {v[0], Number(cos_twist) * v[1] + Number(sin_twist) * v[2],
            Number(cos_twist) * v[2] - Number(sin_twist) * v[1]};
  }
  [[nodiscard]] Vector to_parent(const Vector& v) const {
    return fixed(is_ball ? ball * v : Vector{c * v[0] - s * v[1], s * v[0] + c * v[1], v[2]});
  }
  [[nodiscard]] Vector to_child(const Vector& v) const {
    const Vector u = fixed_back(v);
    return is_ball ? transposed(ball) * u : Vector{c * u[0] + s * u[1], c * u[1] - s * u[0], u[2]};
  }
  /// R of the whole, column by column from the axes.
  [[nodiscard]] Matrix matrix() const {
    const Vector x = to_parent({1, 0, 0}), y = to_parent({0, 1, 0}), z = to_parent({0, 0, 1});
    return {x[0], y[0], z[0], x[1], y[1], z[1], x[2], y[2], z[2]};
  }
};

/// The expressions of one function under construction.
class Builder {
 public:
  Builder(const RobotModel& model, Graph& graph) : model_(model), graph_(graph) {
    for (const JointModel& j : model.joints) placed_.push_back(place(j));
  }
  const RobotModel& model() const { return model_; }
  const JointModel& joint(std::size_t i) const { return model_.joints[i]; }
  const Placed& placed(std::size_t i) const { return placed_[i]; }
  Number input(std::uint32_t array, std::int32_t element) {
    return {graph_, graph_.input(array, static_cast<std::uint32_t>(element))};
  }
  /// Coordinate, rate or acceleration of a joint of one coordinate.
  Number value(const JointModel& j) {
    const Number x = input(kQ, j.q_index);
    return j.is_coupled() ? Number(j.coupling.ratio) * x + Number(j.coupling.offset) : x;
  }
  Number rate(const JointModel& j, std::uint32_t array, std::int32_t k = 0) {
    const Number x = input(array, j.v_index + k);
    return j.is_coupled() ? Number(j.coupling.ratio) * x : x;
  }
  static Number ratio(const JointModel& j) { return j.is_coupled() ? j.coupling.ratio : 1.0; }

 private:
  Matrix quaternion(std::int32_t first) {
    const Number w = input(kQ, first), x = input(kQ, first + 1), y = input(kQ, first + 2),
                 z = input(kQ, first + 3);
    const Number two = Number(2) / (w * w + x * x + y * y + z * z);
    const Number one(1), sx = two * x, sy = two * y, sz = two * z;
    return {one - sy * y - sz * z, sx * y - sz * w,       sx * z + sy * w,
            sx * y + sz * w,       one - sx * x - sz * z, sy * z - sx * w,
            sx * z - sy * w,       sy * z + sx * w,       one - sx * x - sy * y};
  }
  Placed place(const JointModel& j) {
    Placed t;
    const auto& R = j.placement.R;
    t.p = constants(j.placement.p);
    // Rx(twist) Rz(angle), as rows of either DH convention are.
    constexpr double kSame = 1e-15;
    double angle = 0;
    if (std::fabs(R[2]) < kSame) {
      t.is_twist = true;
      t.cos_twist = snapped(R[8]);
      t.sin_twist = snapped(-R[5]);
      angle = std::atan2(-R[1], R[0]);
      if (std::fabs(angle) < kSame) angle = 0;
    } else {
      t.rotation = constants(R);
    }
    switch (j.type) {
      case JointType::revolute: {
        const Number turned = value(j) + Number(angle);
        t.c = turned.cosine();
        t.s = turned.sine();
        break;
      }
      case JointType::prismatic:
        t.c = snapped(std::cos(angle));
        t.s = snapped(std::sin(angle));
        t.p = t.p + t.fixed({0, 0, value(j)});
        break;
      case JointType::spherical:
      case JointType::free: {
        const bool is_free = j.type == JointType::free;
        t.is_twist = false;
        t.rotation = constants(R);
        t.is_ball = true;
        t.ball = quaternion(is_free ? j.q_index + 3 : j.q_index);
        if (is_free)
          t.p = t.p +
                t.fixed({input(kQ, j.q_index), input(kQ, j.q_index + 1), input(kQ, j.q_index + 2)});
        break;
      }
    }
    return t;
  }

  const RobotModel& model_;
  Graph& graph_;
  std::vector<Placed> placed_;
};

std::size_t index(std::int32_t i) { return static_cast<std::size_t>(i); }

/// base_T_joint of every joint, as (rotation, origin).
struct Global {
  Matrix R{1, 0, 0, 0, 1, 0, 0, 0, 1};
  Vector p;
};
Matrix operator*(const Matrix& a, const Matrix& b) {
  Matrix c;
  for (std::size_t i = 0; i < 9; i += 3)
    for (std::size_t j = 0; j < 3; ++j)
      c[i + j] = a[i] * b[j] + a[i + 1] * b[3 + j] + a[i + 2] * b[6 + j];
  return c;
}
std::vector<Global> globals(Builder& b) {
  std::vector<Global> out;
  for (std::size_t i = 0; i < b.model().joints.size(); ++i) {
    const std::int32_t parent = b.joint(i).parent;
    const Placed& t = b.placed(i);
    if (parent < 0) {
      out.push_back({t.matrix(), t.p});
    } else {
      const Global& up = out[index(parent)];
      out.push_back({up.R * t.matrix(), up.p + up.R * t.p});
    }
  }
  return out;
}
Global tip(const RobotModel& m, std::size_t t, const std::vector<Global>& at) {
  const TipModel& tool = m.tips[t];
  const Global local{constants(tool.tool.R), constants(tool.tool.p)};
  if (tool.joint < 0) return local;
  const Global& up = at[index(tool.joint)];
  return {up.R * local.R, up.p + up.R * local.p};
}

/// What a joint adds to the outputs by its forces f, n at the joint frame's origin.
void add_joint_force(std::vector<Number>& tau, const JointModel& j, const Vector& f,
                     const Vector& n) {
  const std::size_t v = index(j.v_index);
  switch (j.type) {
    case JointType::revolute: tau[v] += Builder::ratio(j) * n[2]; break;
    case JointType::prismatic: tau[v] += Builder::ratio(j) * f[2]; break;
    case JointType::spherical:
      for (std::size_t k = 0; k < 3; ++k) tau[v + k] += n[k];
      break;
    case JointType::free:
      for (std::size_t k = 0; k < 3; ++k) tau[v + k] += f[k], tau[v + 3 + k] += n[k];
      break;
  }
}

/// tau of the rigid bodies; without accelerations when `still`.
std::vector<Number> newton_euler(Builder& b, const Vector& gravity, bool still) {
  struct Body {
    Vector w, wd, a, f, n;
    Matrix U;  ///< acceleration of a point r of the body: a + U r
  };
  const RobotModel& m = b.model();
  std::vector<Body> bodies(m.joints.size());
  const Vector base_a = Number(-1) * gravity;
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    const JointModel& j = m.joints[i];
    const Placed& t = b.placed(i);
    Body& x = bodies[i];
    if (j.parent < 0) {
      x.a = t.to_child(base_a);
    } else {
      const Body& up = bodies[index(j.parent)];
      x.w = t.to_child(up.w);
      x.wd = t.to_child(up.wd);
      x.a = t.to_child(up.a + up.U * t.p);
    }
    const auto rates = [&](std::uint32_t array, std::int32_t first) -> Vector {
      if (array == kQdd && still) return {};
      return {b.rate(j, array, first), b.rate(j, array, first + 1), b.rate(j, array, first + 2)};
    };
    const auto turn = [&](std::int32_t first) {
      const Vector w = rates(kQd, first), wd = rates(kQdd, first);
      x.wd = x.wd + cross(x.w, w) + wd;
      x.w = x.w + w;
    };
    switch (j.type) {
      case JointType::revolute: {
        const Number qd = b.rate(j, kQd), qdd = still ? Number(0) : b.rate(j, kQdd);
        x.wd = {x.wd[0] + x.w[1] * qd, x.wd[1] - x.w[0] * qd, x.wd[2] + qdd};
        x.w[2] += qd;
        break;
      }
      case JointType::prismatic: {
        const Number qd = b.rate(j, kQd), qdd = still ? Number(0) : b.rate(j, kQdd);
        const Number twice = Number(2) * qd;
        x.a = {x.a[0] + x.w[1] * twice, x.a[1] - x.w[0] * twice, x.a[2] + qdd};
        break;
      }
      case JointType::spherical: turn(0); break;
      case JointType::free: {
        const Vector v = rates(kQd, 0), w = rates(kQd, 3);
        x.a = x.a + rates(kQdd, 0) + cross(Number(2) * x.w + w, v);
        turn(3);
        break;
      }
    }
    const Number xx = x.w[0] * x.w[0], yy = x.w[1] * x.w[1], zz = x.w[2] * x.w[2];
    const Number xy = x.w[0] * x.w[1], yz = x.w[1] * x.w[2], xz = x.w[0] * x.w[2];
    x.U = {Number(0) - yy - zz, xy - x.wd[2], xz + x.wd[1], xy + x.wd[2],       Number(0) - xx - zz,
           yz - x.wd[0],        xz - x.wd[1], yz + x.wd[0], Number(0) - xx - yy};
    const MassProperties& body = j.body;
    const Vector h = constants(spatial::scale(body.com, body.mass));
    const Sym3 s = spatial::inertia_about(body, Vec3{});
    const double half = (s.xx + s.yy + s.zz) / 2;
    // Second moments of the mass about the joint's origin.
    const Matrix S{half - s.xx, -s.xy, -s.xz, -s.xy, half - s.yy, -s.yz, -s.xz, -s.yz, half - s.zz};
    const auto skew = [&](std::size_t r, std::size_t c) {
      Number sum;
      for (std::size_t k = 0; k < 3; ++k)
        sum += x.U[3 * r + k] * S[3 * k + c] - S[3 * r + k] * x.U[3 * c + k];
      return sum;
    };
    x.f = Number(body.mass) * x.a + x.U * h;
    x.n = Vector{skew(2, 1), skew(0, 2), skew(1, 0)} + cross(h, x.a);
  }
  std::vector<Number> tau(m.dof());
  for (std::size_t i = bodies.size(); i-- > 0;) {
    const JointModel& j = m.joints[i];
    add_joint_force(tau, j, bodies[i].f, bodies[i].n);
    if (j.parent < 0) continue;
    Body& up = bodies[index(j.parent)];
    const Vector f = b.placed(i).to_parent(bodies[i].f);
    up.f = up.f + f;
    up.n = up.n + b.placed(i).to_parent(bodies[i].n) + cross(b.placed(i).p, f);
  }
  return tau;
}

/// Friction, springs and (unless `still`) motor inertias.
void add_joint_parts(Builder& b, std::vector<Number>& tau, bool still) {
  for (const JointModel& j : b.model().joints) {
    if (velocity_count(j.type) != 1) continue;
    const Number qd = b.rate(j, kQd), kRest(spatial::kRestSpeed);
    Number sum = Number(j.friction.viscous) * qd;
    if (j.friction.coulomb_positive != 0)
      sum += (qd - kRest).if_positive(j.friction.coulomb_positive);
    if (j.friction.coulomb_negative != 0)
      sum += (-qd - kRest).if_positive(j.friction.coulomb_negative);
    if (j.spring.stiffness != 0)
      sum += Number(j.spring.stiffness) * (b.value(j) - Number(j.spring.rest));
    if (!still && j.armature != 0) sum += Number(j.armature) * b.rate(j, kQdd);
    tau[index(j.v_index)] += Builder::ratio(j) * sum;
  }
}

/// Symmetric tensor by its rows.
struct Composite {
  Number mass;
  Vector h;
  std::array<Vector, 3> inertia;  ///< about the joint's origin
};

void add_to_parent(const Placed& t, const Composite& c, Composite& up) {
  std::array<Vector, 3> half, turned;
  for (std::size_t r = 0; r < 3; ++r) half[r] = t.to_parent(c.inertia[r]);  // R I, transposed
  for (std::size_t col = 0; col < 3; ++col)
    turned[col] = t.to_parent({half[0][col], half[1][col], half[2][col]});
  const Vector h = t.to_parent(c.h);
  const Vector g = h + Number(0.5) * (c.mass * t.p);
  const Number trace = Number(2) * dot(t.p, g);
  for (std::size_t r = 0; r < 3; ++r)
    for (std::size_t k = r; k < 3; ++k) {
      Number v = up.inertia[r][k] + turned[r][k] - (t.p[r] * g[k] + g[r] * t.p[k]);
      if (r == k) v += trace;
      up.inertia[r][k] = up.inertia[k][r] = v;
    }
  up.h = up.h + h + c.mass * t.p;
  up.mass += c.mass;
}

/// Force and moment about the origin that a unit acceleration of a joint's column takes.
struct Wrench {
  Vector f, n;
};
Wrench column_wrench(const Composite& c, const JointModel& j, std::int32_t k) {
  const bool slides = j.type == JointType::prismatic || (j.type == JointType::free && k < 3);
  const std::size_t axis = velocity_count(j.type) == 1 ? 2 : static_cast<std::size_t>(k % 3);
  Vector e;
  e[axis] = 1;
  if (slides) return {c.mass * e, cross(c.h, e)};
  return {cross(e, c.h), c.inertia[axis]};
}
Number along(const JointModel& j, std::int32_t k, const Wrench& w) {
  const bool slides = j.type == JointType::prismatic || (j.type == JointType::free && k < 3);
  const std::size_t axis = velocity_count(j.type) == 1 ? 2 : static_cast<std::size_t>(k % 3);
  return slides ? w.f[axis] : w.n[axis];
}

/// Bodies without those beyond them.
std::vector<Composite> single_bodies(const RobotModel& m) {
  std::vector<Composite> bodies;
  bodies.reserve(m.joints.size());
  for (const JointModel& j : m.joints) {
    const MassProperties& body = j.body;
    const Sym3 s = spatial::inertia_about(body, Vec3{});
    bodies.push_back(
        {body.mass,
         constants(spatial::scale(body.com, body.mass)),
         {Vector{s.xx, s.xy, s.xz}, Vector{s.xy, s.yy, s.yz}, Vector{s.xz, s.yz, s.zz}}});
  }
  return bodies;
}

std::vector<Number> inertia_matrix(Builder& b) {
  const RobotModel& m = b.model();
  const std::size_t n = m.dof();
  std::vector<Composite> bodies = single_bodies(m);
  std::vector<Number> M(n * n);
  for (std::size_t i = bodies.size(); i-- > 0;) {
    const JointModel& j = m.joints[i];
    if (j.parent >= 0) add_to_parent(b.placed(i), bodies[i], bodies[index(j.parent)]);
    for (std::int32_t k = 0; k < velocity_count(j.type); ++k) {
      const std::size_t row = index(j.v_index + k);
      Wrench w = column_wrench(bodies[i], j, k);
      for (std::int32_t l = 0; l < velocity_count(j.type); ++l)
        M[row * n + index(j.v_index + l)] += Builder::ratio(j) * Builder::ratio(j) * along(j, l, w);
      if (velocity_count(j.type) == 1)
        M[row * n + row] += Builder::ratio(j) * Builder::ratio(j) * Number(j.armature);
      std::size_t at = i;
      for (std::int32_t up = j.parent; up >= 0; up = m.joints[index(up)].parent) {
        const Placed& t = b.placed(at);
        w.f = t.to_parent(w.f);
        w.n = t.to_parent(w.n) + cross(t.p, w.f);
        at = index(up);
        const JointModel& other = m.joints[at];
        for (std::int32_t l = 0; l < velocity_count(other.type); ++l) {
          const Number v = Builder::ratio(j) * Builder::ratio(other) * along(other, l, w);
          const std::size_t column = index(other.v_index + l);
          M[row * n + column] += v;
          M[column * n + row] += v;
        }
      }
    }
  }
  return M;
}

/// What the loops of an ending take for the inertia matrix (ending.h): placements and wrenches.
std::vector<Number> inertia_parts(Builder& b) {
  const RobotModel& m = b.model();
  std::vector<Number> parts;
  for (std::size_t i = 0; i < m.joints.size(); ++i) {
    const Matrix R = b.placed(i).matrix();
    parts.insert(parts.end(), R.begin(), R.end());
    parts.insert(parts.end(), b.placed(i).p.begin(), b.placed(i).p.end());
  }
  std::vector<Composite> bodies = single_bodies(m);
  for (std::size_t i = bodies.size(); i-- > 0;)
    if (m.joints[i].parent >= 0)
      add_to_parent(b.placed(i), bodies[i], bodies[index(m.joints[i].parent)]);
  for (std::size_t i = 0; i < bodies.size(); ++i)
    for (std::int32_t k = 0; k < velocity_count(m.joints[i].type); ++k) {
      const Wrench w = column_wrench(bodies[i], m.joints[i], k);
      parts.insert(parts.end(), w.f.begin(), w.f.end());
      parts.insert(parts.end(), w.n.begin(), w.n.end());
    }
  return parts;
}

/// Above so many velocities even the graph of a function that is written out is large.
constexpr std::size_t kMostVelocitiesWrittenOut = 24;

Function named(const char* name, const char* doc, std::vector<std::uint32_t> arrays,
               const char* output) {
  Function f;
  f.name = name;
  f.doc = doc;
  f.arrays = std::move(arrays);
  f.output = output;
  return f;
}

void set_outputs(Function& f, const std::vector<Number>& values) {
  for (const Number& v : values) f.outputs.push_back(v.in(f.graph));
}

/// Row of a pivot of the inertia matrix that is not positive at some configurations, or -1.
std::ptrdiff_t singular_row(const RobotModel& model) {
  const Function m = inertia(model);
  std::vector<double> q(model.coordinate_count());
  std::ptrdiff_t row = 0;
  for (int attempt = 0; attempt < 3 && row >= 0; ++attempt) {
    for (std::size_t k = 0; k < q.size(); ++k)
      q[k] = 0.3 + std::sin(2.3 * attempt + 1.7 * static_cast<double>(k + 1));
    const std::span<const double> inputs[] = {q};
    auto values = m.evaluate(inputs);
    row = spatial::cholesky(values, model.dof());
  }
  return row;
}

}  // namespace

Result<void> check_model(const RobotModel& model) {
  RMP_TRY(spatial::check_mechanism(model));
  if (model.tips.empty())
    return error(ErrorCode::invalid_argument, "it has no tip", "Give it at least one.",
                 "robot \"" + model.name + "\"");
  return {};
}

Function forward_kinematics(const RobotModel& model) {
  Function f = named("forward_kinematics",
                     "Poses of the tips in the base frame: 12 numbers each, the rotation matrix "
                     "row by row, then the origin [m].",
                     {kQ}, "pose");
  Builder b(model, f.graph);
  const auto at = globals(b);
  std::vector<Number> out;
  for (std::size_t t = 0; t < model.tips.size(); ++t) {
    const Global g = tip(model, t, at);
    out.insert(out.end(), g.R.begin(), g.R.end());
    out.insert(out.end(), g.p.begin(), g.p.end());
  }
  set_outputs(f, out);
  return f;
}

Function jacobian(const RobotModel& model) {
  Function f = named("jacobian",
                     "Geometric Jacobian of the first tip in the base frame, row by row: three "
                     "rows of linear velocity, three of angular velocity, one column per rate.",
                     {kQ}, "jacobian");
  Builder b(model, f.graph);
  const auto at = globals(b);
  const Vector p = tip(model, 0, at).p;
  const std::size_t n = model.dof();
  std::vector<Number> out(6 * n);
  for (std::int32_t i = model.tips[0].joint; i >= 0; i = b.joint(index(i)).parent) {
    const JointModel& j = b.joint(index(i));
    const Global& g = at[index(i)];
    for (std::int32_t k = 0; k < velocity_count(j.type); ++k) {
      const bool slides = j.type == JointType::prismatic || (j.type == JointType::free && k < 3);
      const std::size_t a = velocity_count(j.type) == 1 ? 2 : static_cast<std::size_t>(k % 3);
      const Vector axis{g.R[a], g.R[3 + a], g.R[6 + a]};
      const Vector v = slides ? axis : cross(axis, p - g.p);
      const Number r = Builder::ratio(j);
      for (std::size_t row = 0; row < 3; ++row) {
        out[row * n + index(j.v_index + k)] += r * v[row];
        if (!slides) out[(row + 3) * n + index(j.v_index + k)] += r * axis[row];
      }
    }
  }
  set_outputs(f, out);
  return f;
}

Function inverse_dynamics(const RobotModel& model) {
  Function f = named("inverse_dynamics",
                     "Joint forces of gravity, inertia, velocity, friction, springs and motors "
                     "[N m or N].",
                     {kQ, kQd, kQdd}, "tau");
  Builder b(model, f.graph);
  auto tau = newton_euler(b, constants(model.gravity), false);
  add_joint_parts(b, tau, false);
  set_outputs(f, tau);
  return f;
}

Function inertia(const RobotModel& model) {
  const auto start = [] {
    return named("inertia", "Joint-space inertia matrix with motors, row by row.", {kQ}, "m");
  };
  if (model.dof() <= kMostVelocitiesWrittenOut) {
    Function f = start();
    Builder b(model, f.graph);
    set_outputs(f, inertia_matrix(b));
    if (operation_count(f) <= kMostWrittenOut) return f;
  }
  Function f = start();
  f.ending = Ending::inertia;
  f.columns = columns_of(model);
  Builder b(model, f.graph);
  set_outputs(f, inertia_parts(b));
  return f;
}

namespace {

Function forward_dynamics_start() {
  return named("forward_dynamics",
               "Joint accelerations under joint forces tau, gravity, friction and springs.",
               {kQ, kQd, kTau}, "qdd");
}
/// Forces less those that a robot without accelerations takes.
std::vector<Number> accelerating_forces(Builder& b) {
  auto bias = newton_euler(b, constants(b.model().gravity), true);
  add_joint_parts(b, bias, true);
  std::vector<Number> x(bias.size());
  for (std::size_t i = 0; i < x.size(); ++i)
    x[i] = b.input(kTau, static_cast<std::int32_t>(i)) - bias[i];
  return x;
}

Function forward_dynamics_written_out(const RobotModel& model) {
  Function f = forward_dynamics_start();
  Builder b(model, f.graph);
  const std::size_t n = model.dof();
  std::vector<Number> x = accelerating_forces(b), inverse(n);
  auto M = inertia_matrix(b);
  // M = L^T D L from the last row to the first, which keeps the zeros between branches.
  for (std::size_t k = n; k-- > 0;) {
    inverse[k] = Number(1) / M[k * n + k];
    for (std::size_t i = k; i-- > 0;) {
      const Number factor = M[k * n + i] * inverse[k];
      for (std::size_t j = 0; j <= i; ++j) M[i * n + j] -= factor * M[k * n + j];
      M[k * n + i] = factor;
      x[i] -= factor * x[k];
    }
  }
  for (std::size_t k = 0; k < n; ++k) {
    x[k] = x[k] * inverse[k];
    for (std::size_t i = 0; i < k; ++i) x[k] -= M[k * n + i] * x[i];
  }
  set_outputs(f, x);
  return f;
}

// Closed loops.

ClosedLoops closed_loops(const RobotModel& m) {
  ClosedLoops out;
  out.rows = spatial::loop_rows(m.loops);
  std::vector<bool> has_motor(m.dof(), true);
  for (const JointModel& j : m.joints)
    if (!j.is_coupled() && j.passive)
      for (std::int32_t k = 0; k < velocity_count(j.type); ++k)
        has_motor[index(j.v_index + k)] = false;
  for (std::size_t v = 0; v < has_motor.size(); ++v)
    (has_motor[v] ? out.motors : out.passive).push_back(v);
  return out;
}

/// One end of a loop, in motion with all accelerations at zero; base axes.
struct LoopEnd {
  Global frame;
  std::vector<std::size_t> joints;  ///< that move it and not the other end, from the base on
  Vector v, w, a, wd;
};

/// Joints from the base to `joint`.
std::vector<std::size_t> chain_to(const RobotModel& m, std::int32_t joint) {
  std::vector<std::size_t> out;
  for (; joint >= 0; joint = m.joints[index(joint)].parent) out.push_back(index(joint));
  return {out.rbegin(), out.rend()};
}

/// What moves both ends alike does not change how they lie to each other: it counts as at rest.
void move_end(Builder& b, const std::vector<Global>& at, LoopEnd& end) {
  Vector from;
  for (const std::size_t i : end.joints) {
    const JointModel& j = b.joint(i);
    const Vector r = i == end.joints.front() ? Vector{} : at[i].p - from;
    const Vector up = end.w;
    end.v = end.v + cross(up, r);
    end.a = end.a + cross(end.wd, r) + cross(up, cross(up, r));
    const auto of_axes = [&](std::int32_t first) {
      return at[i].R *
             Vector{b.rate(j, kQd, first), b.rate(j, kQd, first + 1), b.rate(j, kQd, first + 2)};
    };
    const auto along_z = [&] {
      return b.rate(j, kQd) * Vector{at[i].R[2], at[i].R[5], at[i].R[8]};
    };
    const auto turn = [&](const Vector& u) {
      end.wd = end.wd + cross(up, u);
      end.w = up + u;
    };
    switch (j.type) {
      case JointType::prismatic: {
        const Vector u = along_z();
        end.v = end.v + u;
        end.a = end.a + Number(2) * cross(up, u);
        break;
      }
      case JointType::revolute: turn(along_z()); break;
      case JointType::spherical: turn(of_axes(0)); break;
      case JointType::free: {
        // Velocities are given in the moving frame, so they turn with it.
        const Vector u = of_axes(0), w = of_axes(3);
        end.v = end.v + u;
        end.a = end.a + cross(up, u) + cross(up + w, u);
        turn(w);
        break;
      }
    }
    from = at[i].p;
  }
  if (end.joints.empty()) return;
  const Vector r = end.frame.p - from;
  end.v = end.v + cross(end.w, r);
  end.a = end.a + cross(end.wd, r) + cross(end.w, cross(end.w, r));
}

/// Rows of the loops as in spatial/loops.h, what the ending takes of them: the Jacobian row by row,
/// the gaps (of turns as half of R - R^T, which is the rotation vector when nearly closed) and,
/// with `moves`, the drift and the rates.
std::vector<Number> loop_numbers(Builder& b, bool moves) {
  const RobotModel& m = b.model();
  const std::size_t n = m.dof();
  const std::vector<Global> at = globals(b);
  std::vector<Number> jacobian, gaps, drift, rates;
  for (const LoopModel& l : m.loops) {
    const auto end_of = [&](std::int32_t joint, const Pose& in) {
      LoopEnd end;
      const Global local{constants(in.R), constants(in.p)};
      end.joints = chain_to(m, joint);
      end.frame = local;
      if (joint >= 0) {
        const Global& up = at[index(joint)];
        end.frame = {up.R * local.R, up.p + up.R * local.p};
      }
      return end;
    };
    LoopEnd a = end_of(l.joint_a, l.in_a), c = end_of(l.joint_b, l.in_b);
    while (!a.joints.empty() && !c.joints.empty() && a.joints.front() == c.joints.front()) {
      a.joints.erase(a.joints.begin());
      c.joints.erase(c.joints.begin());
    }
    const Matrix back = transposed(a.frame.R);
    std::vector<Number> rows(6 * n);
    const auto add_end = [&](const LoopEnd& end, double sign) {
      for (const std::size_t i : end.joints) {
        const JointModel& j = m.joints[i];
        for (std::int32_t k = 0; k < velocity_count(j.type); ++k) {
          const bool slides =
              j.type == JointType::prismatic || (j.type == JointType::free && k < 3);
          const std::size_t x = velocity_count(j.type) == 1 ? 2 : static_cast<std::size_t>(k % 3);
          const Vector axis{at[i].R[x], at[i].R[3 + x], at[i].R[6 + x]};
          const Vector moved = back * (slides ? axis : cross(axis, c.frame.p - at[i].p));
          const Vector turned = slides ? Vector{} : back * axis;
          const Number r = Number(sign) * Builder::ratio(j);
          for (std::size_t d = 0; d < 6; ++d)
            rows[d * n + index(j.v_index + k)] += r * (d < 3 ? moved[d] : turned[d - 3]);
        }
      }
    };
    add_end(c, 1);
    add_end(a, -1);
    const Vector way = back * (c.frame.p - a.frame.p);
    const Matrix R = back * c.frame.R;
    const Number half(0.5);
    const Vector turn{half * (R[7] - R[5]), half * (R[2] - R[6]), half * (R[3] - R[1])};
    Vector v, u, acceleration, ud;
    if (moves) {
      move_end(b, at, a);
      move_end(b, at, c);
      const Vector wa = back * a.w;
      v = back * (c.v - a.v) - cross(wa, way);
      u = back * (c.w - a.w);
      acceleration = back * (c.a - a.a) - (cross(back * a.wd, way) + Number(2) * cross(wa, v) +
                                           cross(wa, cross(wa, way)));
      ud = back * (c.wd - a.wd) - cross(wa, u);
    }
    for (std::size_t d = 0; d < 6; ++d) {
      if (!(l.fixed >> d & 1U)) continue;
      jacobian.insert(jacobian.end(), rows.begin() + static_cast<std::ptrdiff_t>(d * n),
                      rows.begin() + static_cast<std::ptrdiff_t>((d + 1) * n));
      gaps.push_back(d < 3 ? way[d] : turn[d - 3]);
      drift.push_back(d < 3 ? acceleration[d] : ud[d - 3]);
      rates.push_back(d < 3 ? v[d] : u[d - 3]);
    }
  }
  jacobian.insert(jacobian.end(), gaps.begin(), gaps.end());
  if (!moves) return jacobian;
  jacobian.insert(jacobian.end(), drift.begin(), drift.end());
  jacobian.insert(jacobian.end(), rates.begin(), rates.end());
  return jacobian;
}

void append(std::vector<Number>& to, const std::vector<Number>& more) {
  to.insert(to.end(), more.begin(), more.end());
}

/// Accelerations need a tree whose every joint moves some inertia.
Result<void> check_inertia(const RobotModel& model) {
  const auto row = singular_row(model);
  if (row < 0) return {};
  std::string joint;
  for (const JointModel& j : model.joints)
    if (!j.is_coupled() && j.v_index <= row) joint = j.name;
  return error(ErrorCode::invalid_argument,
               "its inertia matrix is singular: joint \"" + joint + "\" moves no inertia",
               "Give the links beyond it a mass, or the joint a motor inertia.",
               "robot \"" + model.name + "\"");
}

}  // namespace

Result<void> check_loops(const RobotModel& model) {
  for (const LoopModel& l : model.loops)
    if (std::popcount(l.fixed & (kLoopRotX | kLoopRotY | kLoopRotZ)) == 1)
      return error(ErrorCode::unsupported,
                   "its loop \"" + l.name +
                       "\" constrains a single rotation, which the code generator does not support",
                   "Leave inverse_dynamics, inertia and forward_dynamics out of the parts.",
                   "robot \"" + model.name + "\"");
  return {};
}

Function closed_inverse_dynamics(const RobotModel& model) {
  Function f = named("inverse_dynamics",
                     "Forces of the motors of the closed mechanism, by gravity, inertia, velocity, "
                     "friction, springs and motors [N m or N], for joint values, rates and "
                     "accelerations that keep its loops closed. Entries of joints without motors "
                     "are forces that no motor can provide.",
                     {kQ, kQd, kQdd}, "tau");
  f.ending = Ending::motor_forces;
  f.columns = columns_of(model);
  f.loops = closed_loops(model);
  Builder b(model, f.graph);
  auto out = newton_euler(b, constants(model.gravity), false);
  add_joint_parts(b, out, false);
  append(out, loop_numbers(b, false));
  set_outputs(f, out);
  return f;
}

Function closed_inertia(const RobotModel& model) {
  Function f = named("inertia",
                     "Inertia matrix seen by the motors of the closed mechanism, row by row, for "
                     "joint values that close its loops.",
                     {kQ}, "m");
  f.ending = Ending::motor_inertia;
  f.columns = columns_of(model);
  f.loops = closed_loops(model);
  Builder b(model, f.graph);
  auto out = inertia_parts(b);
  append(out, loop_numbers(b, false));
  set_outputs(f, out);
  return f;
}

Result<Function> closed_forward_dynamics(const RobotModel& model, double stabilization) {
  Function f = named("forward_dynamics",
                     "Joint accelerations of the closed mechanism under joint forces tau, gravity, "
                     "friction and springs; gaps of its loops are closed.",
                     {kQ, kQd, kTau}, "qdd");
  f.ending = Ending::closed_accelerations;
  f.columns = columns_of(model);
  f.loops = closed_loops(model);
  f.stabilization = stabilization;
  {
    Builder b(model, f.graph);
    auto out = inertia_parts(b);
    append(out, accelerating_forces(b));
    append(out, loop_numbers(b, true));
    set_outputs(f, out);
  }
  RMP_TRY(check_size(f, model));
  RMP_TRY(check_inertia(model));
  return f;
}

Result<Function> forward_dynamics(const RobotModel& model) {
  Function f = forward_dynamics_start();
  f.ending = Ending::accelerations;
  f.columns = columns_of(model);
  {
    Builder b(model, f.graph);
    std::vector<Number> parts = inertia_parts(b);
    const std::vector<Number> forces = accelerating_forces(b);
    parts.insert(parts.end(), forces.begin(), forces.end());
    set_outputs(f, parts);
  }
  // Before the matrix of a robot that is refused is factorized.
  RMP_TRY(check_size(f, model));
  RMP_TRY(check_inertia(model));
  if (model.dof() <= kMostVelocitiesWrittenOut)
    if (Function whole = forward_dynamics_written_out(model);
        operation_count(whole) <= kMostWrittenOut)
      return whole;
  return f;
}

std::vector<std::uint32_t> use_counts(const Function& f) {
  std::vector<std::uint32_t> uses(f.graph.size());
  for (const Node n : f.outputs) ++uses[n];
  for (std::size_t i = uses.size(); i-- > 0;) {
    const NodeData& n = f.graph[static_cast<Node>(i)];
    if (!uses[i] || !is_operation(n.operation)) continue;
    ++uses[n.a];
    if (is_binary(n.operation)) ++uses[n.b];
  }
  return uses;
}

std::size_t operation_count(const Function& f) {
  const auto uses = use_counts(f);
  std::size_t count = 0;
  for (std::size_t i = 0; i < uses.size(); ++i)
    count += uses[i] > 0 && is_operation(f.graph[static_cast<Node>(i)].operation) ? 1U : 0U;
  return count;
}

Result<void> check_size(const Function& f, const RobotModel& model) {
  const char* hint =
      is_closed(f.ending)
          ? "Use robot.inverse_dynamics and the provider constrained for such mechanisms."
          : "Use the providers newton_euler and articulated_body for long chains.";
  const std::size_t most = is_closed(f.ending) ? kMostClosedRows : kMostRows,
                    rows = std::max(f.columns.rows(), f.loops.rows);
  if (f.ending != Ending::none && rows > most)
    return error(ErrorCode::unsupported,
                 "its " + f.name + " has a matrix of " + std::to_string(rows) +
                     " rows, more than the " + std::to_string(most) + " allowed on the stack",
                 hint, "robot \"" + model.name + "\"");
  const std::size_t count = operation_count(f);
  if (count <= kMostOperations) return {};
  return error(ErrorCode::unsupported,
               "its " + f.name + " takes " + std::to_string(count) + " operations, more than the " +
                   std::to_string(kMostOperations) + " that compilers can handle in seconds",
               hint, "robot \"" + model.name + "\"");
}

std::vector<double> Function::evaluate(std::span<const std::span<const double>> inputs) const {
  auto values = graph.evaluate(inputs, outputs);
  return ending == Ending::none ? values : run_ending(ending, columns, values);
}

}  // namespace robomosp::robot_code
