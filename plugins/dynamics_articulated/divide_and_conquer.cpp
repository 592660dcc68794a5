// SPDX-License-Identifier: Apache-2.0
#include "divide_and_conquer.h"

#include <algorithm>
#include <atomic>
#include <cmath>

#include "articulated_inertia.h"
#include "samples.h"
#include "spatial/parallel.h"
#include "spatial/rest.h"

namespace robomosp::articulated {
namespace {

using namespace spatial;

constexpr std::int32_t kRun = 8;            // joints of a run at least: below, maps cost more
constexpr std::size_t kShares = 32;         // pieces of work, whatever the number of threads
constexpr double kNanosecondsAJoint = 400;  // to judge what threads are worth
constexpr double kWeak = 1e-6;  // a run ends where its joints are not much weaker than each other

using Matrix = std::array<double, 36>;
using Vector = std::array<double, 6>;

Vector vector_of(const Screw& s) {
  return {s.angular[0], s.angular[1], s.angular[2], s.linear[0], s.linear[1], s.linear[2]};
}
Screw screw_of(const Vector& v) { return {{v[0], v[1], v[2]}, {v[3], v[4], v[5]}}; }

Vector times(const Matrix& m, const Vector& v) {
  Vector out{};
  for (std::size_t i = 0; i < 6; ++i)
    for (std::size_t j = 0; j < 6; ++j) out[i] += m[6 * i + j] * v[j];
  return out;
}
Vector transposed_times(const Matrix& m, const Vector& v) {
  Vector out{};
  for (std::size_t i = 0; i < 6; ++i)
    for (std::size_t j = 0; j < 6; ++j) out[j] += m[6 * i + j] * v[i];
  return out;
}
Matrix product(const Matrix& a, const Matrix& b) {
  Matrix out{};
  for (std::size_t i = 0; i < 6; ++i)
    for (std::size_t k = 0; k < 6; ++k)
      for (std::size_t j = 0; j < 6; ++j) out[6 * i + j] += a[6 * i + k] * b[6 * k + j];
  return out;
}
Matrix transposed(const Matrix& a) {
  Matrix out;
  for (std::size_t i = 0; i < 6; ++i)
    for (std::size_t j = 0; j < 6; ++j) out[6 * j + i] = a[6 * i + j];
  return out;
}
Vector plus(const Vector& a, const Vector& b, double s = 1) {
  Vector out;
  for (std::size_t i = 0; i < 6; ++i) out[i] = a[i] + s * b[i];
  return out;
}
Matrix plus(const Matrix& a, const Matrix& b) {
  Matrix out;
  for (std::size_t i = 0; i < 36; ++i) out[i] = a[i] + b[i];
  return out;
}

/// Solves W x = columns in place (each column a Vector of `count`), by elimination with pivots.
void solve(Matrix w, double* columns, std::size_t count) {
  for (std::size_t k = 0; k < 6; ++k) {
    std::size_t p = k;
    for (std::size_t i = k + 1; i < 6; ++i)
      if (std::fabs(w[6 * i + k]) > std::fabs(w[6 * p + k])) p = i;
    if (p != k) {
      for (std::size_t j = 0; j < 6; ++j) std::swap(w[6 * k + j], w[6 * p + j]);
      for (std::size_t c = 0; c < count; ++c) std::swap(columns[6 * c + k], columns[6 * c + p]);
    }
    for (std::size_t i = k + 1; i < 6; ++i) {
      const double f = w[6 * i + k] / w[6 * k + k];
      for (std::size_t j = k; j < 6; ++j) w[6 * i + j] -= f * w[6 * k + j];
      for (std::size_t c = 0; c < count; ++c) columns[6 * c + i] -= f * columns[6 * c + k];
    }
  }
  for (std::size_t c = 0; c < count; ++c)
    for (std::size_t i = 6; i-- > 0;) {
      double s = columns[6 * c + i];
      for (std::size_t j = i + 1; j < 6; ++j) s -= w[6 * i + j] * columns[6 * c + j];
      columns[6 * c + i] = s / w[6 * i + i];
    }
}

Matrix matrix_of(const ArticulatedInertia& i) {
  Matrix m{};
  const double A[9] = {i.A.xx, i.A.xy, i.A.xz, i.A.xy, i.A.yy, i.A.yz, i.A.xz, i.A.yz, i.A.zz};
  const double M[9] = {i.M.xx, i.M.xy, i.M.xz, i.M.xy, i.M.yy, i.M.yz, i.M.xz, i.M.yz, i.M.zz};
  for (std::size_t r = 0; r < 3; ++r)
    for (std::size_t c = 0; c < 3; ++c) {
      m[6 * r + c] = A[3 * r + c];
      m[6 * r + 3 + c] = i.B[3 * r + c];
      m[6 * (c + 3) + r] = i.B[3 * r + c];
      m[6 * (r + 3) + 3 + c] = M[3 * r + c];
    }
  return m;
}

}  // namespace

/// A joint and its body within a run.
struct DivideAndConquer::Link {
  Pose to_parent;
  Screw v, c, p, u;
  Vector force_out;  ///< how the force at the run's end loads the joint
  double inverse = 0, force = 0;
};

/// A run of joints, or neighbouring runs put together. `in`: of the body before it, in that body's
/// frame; `out`: of its last body. a_out = A a_in - C g + b, f_in = J a_in + A^T g + e, with g the
/// force that the last body hands on.
struct DivideAndConquer::Node {
  Pose pose;     ///< in_T_out
  Screw moving;  ///< velocity of out against in, frame of out
  Matrix A, C, J;
  Vector b, e;
  Matrix middle_a, middle_g;  ///< of the acceleration between the two parts
  Vector middle;
  Pose base;       ///< base_T_in
  Screw velocity;  ///< of in
  Vector a_in, g;  ///< found on the way back
};

struct DivideAndConquer::Work {
  Node* nodes;
  Link* links;
};

DivideAndConquer::Work DivideAndConquer::work(double* scratch) const {
  static_assert(sizeof(Node) % sizeof(double) == 0 && sizeof(Link) % sizeof(double) == 0);
  return {reinterpret_cast<Node*>(scratch),
          reinterpret_cast<Link*>(scratch + levels_.back() * sizeof(Node) / sizeof(double))};
}

std::size_t DivideAndConquer::nodes_of(std::size_t level) const {
  return levels_[level + 1] - levels_[level];
}

std::size_t DivideAndConquer::scratch_size() const {
  return (levels_.back() * sizeof(Node) + articulated_.tree.bodies.size() * sizeof(Link)) /
         sizeof(double);
}

namespace {

using Node = DivideAndConquer::Node;
using Link = DivideAndConquer::Link;

/// What a run gets to know of a sample.
struct Sample {
  const BodyTree& tree;
  const std::vector<double>& pivot;
  const DynamicsBatch& batch;
  TreeState state;
  const double* tau = nullptr;
  const double* rates = nullptr;  ///< for friction
  const TipWrench* wrench = nullptr;
  std::int32_t wrench_joint = -1;
};

void place_run(const Sample& s, std::int32_t first, std::int32_t end, Link* links, Node& node) {
  node.pose = {};
  node.moving = {};
  for (std::int32_t i = first; i < end; ++i) {
    const TreeBody& b = s.tree.bodies[static_cast<std::size_t>(i)];
    Link& l = links[i];
    l.to_parent = spatial::joint_pose(b, s.state.q);
    node.pose = compose(node.pose, l.to_parent);
    node.moving = motion_into(l.to_parent, node.moving);
    if (s.state.qd) {
      const double x = s.state.qd[b.v_index];
      (b.type == JointType::revolute ? node.moving.angular[2] : node.moving.linear[2]) += x;
    }
  }
}

double joint_force(const Sample& s, const TreeBody& b) {
  double f = s.tau ? s.tau[b.v_index] : 0;
  if (s.rates) {
    const double rate = s.rates[b.v_index];
    f -= b.friction.viscous * rate;
    if (rate > spatial::kRestSpeed) f -= b.friction.coulomb_positive;
    if (rate < -spatial::kRestSpeed) f -= b.friction.coulomb_negative;
  }
  if ((s.batch.terms & kSpringTerm) && b.spring.stiffness != 0)
    f -= b.spring.stiffness * (s.state.q[b.q_index] - b.spring.rest);
  return f;
}

/// Velocities, articulated inertias and the map of one run. -1, or the joint that nothing resists.
std::int32_t map_run(const Sample& s, std::int32_t first, std::int32_t end, Link* links, Node& node,
                     double* weakest) {
  Screw v = node.velocity;
  Pose base = node.base;
  for (std::int32_t i = first; i < end; ++i) {
    const TreeBody& b = s.tree.bodies[static_cast<std::size_t>(i)];
    Link& l = links[i];
    l.v = v = motion_into(l.to_parent, v);
    l.c = {};
    if (s.state.qd) {
      Screw rate;
      const double x = s.state.qd[b.v_index];
      (b.type == JointType::revolute ? rate.angular[2] : rate.linear[2]) = x;
      l.v = v = add(v, rate);
      l.c = cross_motion(v, rate);
    }
    l.p = cross_force(v, spatial::multiply(b.inertia, v));
    if (s.wrench) {
      base = compose(base, l.to_parent);
      if (i == s.wrench_joint) {
        const TipModel& tip = s.tree.tips[static_cast<std::size_t>(s.batch.tip_index)];
        const Vec3 f = rotate_back(base, s.wrench->force);
        l.p = sub(l.p, {add(rotate_back(base, s.wrench->moment), cross(tip.tool.p, f)), f});
      }
    }
  }
  ArticulatedInertia inertia =
      articulated(s.tree.bodies[static_cast<std::size_t>(end - 1)].inertia);
  Screw p = links[end - 1].p;
  std::array<Screw, 6> load;  // what the body carries of the force at the run's end, by its parts
  for (std::size_t k = 0; k < 6; ++k) {
    load[k] = {};
    (k < 3 ? load[k].angular[k] : load[k].linear[k - 3]) = 1;
  }
  node.C = {};
  double least = 1e300, most = 0;
  for (std::int32_t i = end; i-- > first;) {
    const TreeBody& b = s.tree.bodies[static_cast<std::size_t>(i)];
    Link& l = links[i];
    const bool turns = b.type == JointType::revolute;
    const auto along = [&](const Screw& f) { return turns ? f.angular[2] : f.linear[2]; };
    Screw axis;
    (turns ? axis.angular[2] : axis.linear[2]) = 1;
    l.u = multiply(inertia, axis);
    const double d = along(l.u) + b.armature;
    if (!(d > s.pivot[static_cast<std::size_t>(i)])) return i;
    least = std::min(least, d), most = std::max(most, d);
    l.inverse = 1 / d;
    l.force = joint_force(s, b) - along(p);
    for (std::size_t k = 0; k < 6; ++k) l.force_out[k] = along(load[k]);
    for (std::size_t r = 0; r < 6; ++r)
      for (std::size_t c = 0; c < 6; ++c)
        node.C[6 * r + c] += l.force_out[r] * l.force_out[c] * l.inverse;
    subtract_square(inertia, l.u, l.inverse);
    p = add(add(p, multiply(inertia, l.c)), scale(l.u, l.force * l.inverse));
    p = force_out(l.to_parent, p);
    for (std::size_t k = 0; k < 6; ++k)
      load[k] = force_out(l.to_parent, sub(load[k], scale(l.u, l.force_out[k] * l.inverse)));
    ArticulatedInertia up;
    if (i > first) {
      up = articulated(s.tree.bodies[static_cast<std::size_t>(i - 1)].inertia);
      p = add(p, links[i - 1].p);
    }
    add_moved(l.to_parent, inertia, up);
    inertia = up;
  }
  if (weakest) *weakest = least / most;
  node.J = matrix_of(inertia);
  node.e = vector_of(p);
  for (std::size_t k = 0; k < 6; ++k) {  // A^T by columns
    const Vector column = vector_of(load[k]);
    for (std::size_t j = 0; j < 6; ++j) node.A[6 * k + j] = column[j];
  }
  Screw a;
  for (std::int32_t i = first; i < end; ++i) {
    const Link& l = links[i];
    a = add(motion_into(l.to_parent, a), l.c);
    const double x = (l.force - dot(l.u, a)) * l.inverse;
    const bool turns = s.tree.bodies[static_cast<std::size_t>(i)].type == JointType::revolute;
    (turns ? a.angular[2] : a.linear[2]) += x;
  }
  node.b = vector_of(a);
  return -1;
}

void put_together(const Node& one, const Node& two, Node& out) {
  Matrix w = product(one.C, two.J);
  for (std::size_t k = 0; k < 6; ++k) w[7 * k] += 1;
  const Matrix carried = product(one.C, transposed(two.A));
  double columns[13 * 6];
  const Vector rest = plus(one.b, times(one.C, two.e), -1);
  for (std::size_t c = 0; c < 6; ++c)
    for (std::size_t r = 0; r < 6; ++r) {
      columns[6 * c + r] = one.A[6 * r + c];
      columns[36 + 6 * c + r] = carried[6 * r + c];
    }
  std::copy(rest.begin(), rest.end(), columns + 72);
  solve(w, columns, 13);
  for (std::size_t c = 0; c < 6; ++c)
    for (std::size_t r = 0; r < 6; ++r) {
      out.middle_a[6 * r + c] = columns[6 * c + r];
      out.middle_g[6 * r + c] = -columns[36 + 6 * c + r];
    }
  std::copy(columns + 72, columns + 78, out.middle.begin());
  out.A = product(two.A, out.middle_a);
  Matrix c = product(two.A, out.middle_g);
  for (double& x : c) x = -x;
  out.C = plus(two.C, c);
  out.b = plus(two.b, times(two.A, out.middle));
  out.J = plus(one.J, product(transposed(one.A), product(two.J, out.middle_a)));
  out.e = plus(one.e, transposed_times(one.A, plus(two.e, times(two.J, out.middle))));
}

/// Hands a_in and g on to the two parts.
void hand_on(const Node& whole, Node& one, Node& two) {
  one.a_in = whole.a_in;
  two.g = whole.g;
  two.a_in =
      plus(plus(times(whole.middle_a, whole.a_in), times(whole.middle_g, whole.g)), whole.middle);
  one.g = plus(plus(times(two.J, two.a_in), transposed_times(two.A, two.g)), two.e);
}

void solve_run(const Sample& s, std::int32_t first, std::int32_t end, const Link* links,
               const Node& node, double* qdd) {
  Screw a = screw_of(node.a_in);
  for (std::int32_t i = first; i < end; ++i) {
    const TreeBody& b = s.tree.bodies[static_cast<std::size_t>(i)];
    const Link& l = links[i];
    a = add(motion_into(l.to_parent, a), l.c);
    double force = l.force;
    for (std::size_t k = 0; k < 6; ++k) force -= l.force_out[k] * node.g[k];
    const double x = (force - dot(l.u, a)) * l.inverse;
    qdd[b.v_index] = x;
    (b.type == JointType::revolute ? a.angular[2] : a.linear[2]) += x;
  }
}

}  // namespace

std::int32_t DivideAndConquer::one(const DynamicsBatch& batch, std::size_t sample, double* scratch,
                                   double* qdd) const {
  const BodyTree& tree = articulated_.tree;
  const Work w = work(scratch);
  Sample s{tree, articulated_.pivot, batch, state_of(tree, batch, sample, batch.terms, true)};
  if (!batch.tau.empty()) s.tau = batch.tau.data() + sample * tree.velocities;
  if (!batch.qd.empty() && (batch.terms & kFrictionTerm))
    s.rates = batch.qd.data() + sample * tree.velocities;
  if ((batch.terms & kExternalTerm) && !batch.tip.empty()) {
    s.wrench = &batch.tip[batch.tip.size() == 1 ? 0 : sample];
    s.wrench_joint = tree.tips[static_cast<std::size_t>(batch.tip_index)].joint;
  }
  const std::size_t levels = levels_.size() - 1, shares = nodes_of(shared_level_);
  std::atomic<std::int32_t> bad{-1};
  const auto node = [&](std::size_t level, std::size_t i) -> Node& {
    return w.nodes[levels_[level] + i];
  };
  /// Calls f(level, i, one, two) for the pairs of levels from..to that lie in a node of `to`.
  const auto pairs = [&](std::size_t to, std::size_t i, bool up, auto&& f) {
    for (std::size_t step = 1; step <= to; ++step) {
      const std::size_t level = up ? step : to + 1 - step;
      const std::size_t first = i << (to - level),
                        last = std::min((i + 1) << (to - level), nodes_of(level));
      for (std::size_t k = first; k < last; ++k)
        f(node(level, k), node(level - 1, 2 * k),
          2 * k + 1 < nodes_of(level - 1) ? &node(level - 1, 2 * k + 1) : nullptr);
    }
  };
  const auto top = [&](bool up, auto&& f) {
    for (std::size_t step = shared_level_ + 1; step < levels; ++step) {
      const std::size_t level = up ? step : levels - 1 - (step - shared_level_ - 1);
      for (std::size_t k = 0; k < nodes_of(level); ++k)
        f(node(level, k), node(level - 1, 2 * k),
          2 * k + 1 < nodes_of(level - 1) ? &node(level - 1, 2 * k + 1) : nullptr);
    }
  };
  /// Calls f(i, run) for all nodes of the shared level and the runs below them, on all threads.
  const auto share = [&](auto&& f) {
    const auto range = [&](std::size_t first, std::size_t last, std::size_t) {
      for (std::size_t i = first; i < last; ++i) f(i);
    };
    if (threads_ == 1) range(0, shares, 0);
    else in_parallel(shares, 1, std::min(threads_, shares), range);
  };
  const auto runs = [&](std::size_t i, auto&& f) {
    for (std::size_t r = i << shared_level_; r < std::min((i + 1) << shared_level_, nodes_of(0));
         ++r)
      f(runs_[r], runs_[r + 1], node(0, r));
  };
  const auto place = [](Node& out, const Node& one, const Node* two) {
    out.pose = two ? compose(one.pose, two->pose) : one.pose;
    out.moving = two ? add(motion_into(two->pose, one.moving), two->moving) : one.moving;
  };
  const auto place_down = [](const Node& whole, Node& one, Node* two) {
    one.base = whole.base;
    one.velocity = whole.velocity;
    if (!two) return;
    two->base = compose(whole.base, one.pose);
    two->velocity = add(motion_into(one.pose, whole.velocity), one.moving);
  };
  const auto map = [](Node& out, const Node& one, const Node* two) {
    if (two) {
      put_together(one, *two, out);
    } else {
      out.A = one.A, out.C = one.C, out.J = one.J, out.b = one.b, out.e = one.e;
    }
  };
  const auto back = [](const Node& whole, Node& one, Node* two) {
    if (two) hand_on(whole, one, *two);
    else one.a_in = whole.a_in, one.g = whole.g;
  };
  share([&](std::size_t i) {
    runs(i, [&](std::int32_t a, std::int32_t b, Node& n) { place_run(s, a, b, w.links, n); });
    pairs(shared_level_, i, true, place);
  });
  top(true, place);
  Node& root = node(levels - 1, 0);
  root.base = {};
  root.velocity = s.state.base_velocity;
  top(false, place_down);
  share([&](std::size_t i) {
    pairs(shared_level_, i, false, place_down);
    runs(i, [&](std::int32_t a, std::int32_t b, Node& n) {
      if (const std::int32_t joint = map_run(s, a, b, w.links, n, nullptr); joint >= 0)
        bad.store(joint);
    });
    if (bad.load() < 0) pairs(shared_level_, i, true, map);
  });
  if (bad.load() >= 0) return bad.load();
  top(true, map);
  root.a_in = vector_of(s.state.base_acceleration);
  root.g = {};
  top(false, back);
  share([&](std::size_t i) {
    pairs(shared_level_, i, false, back);
    runs(i, [&](std::int32_t a, std::int32_t b, Node& n) { solve_run(s, a, b, w.links, n, qdd); });
  });
  return -1;
}

Result<void> DivideAndConquer::prepare(const RobotModel& model, const Params& params) {
  const std::string where = "robot \"" + model.name + "\"";
  RMP_TRY(refuse_loops(model));
  if (!model.is_serial() || !model.is_simple())
    return error(ErrorCode::unsupported,
                 "divide and conquer needs a serial chain of revolute and prismatic joints, but it "
                 "has branches, coupled, ball or free joints",
                 "Choose the provider articulated_body.", where);
  RMP_TRY_ASSIGN(articulated_, make_articulated(model));
  const BodyTree& tree = articulated_.tree;
  const auto n = static_cast<std::int32_t>(tree.bodies.size());
  // Runs end where their joints resist by their own bodies: not before a body that carries none.
  std::vector<double> q(tree.coordinates);
  std::vector<Link> links(tree.bodies.size());
  for (std::size_t j = 0; j < q.size(); ++j)
    q[j] = std::fmod(2.399963229728653 * static_cast<double>(j + 1), 3.0);
  DynamicsBatch batch;
  batch.terms = 0;
  Sample s{tree, articulated_.pivot, batch, {}};
  s.state.q = q.data();
  runs_ = {0};
  while (runs_.back() < n) {
    std::int32_t end = std::min(n, runs_.back() + kRun);
    for (; end < n; ++end) {
      Node node{};
      double weakest = 0;
      place_run(s, runs_.back(), end, links.data(), node);
      if (map_run(s, runs_.back(), end, links.data(), node, &weakest) < 0 && weakest > kWeak) break;
    }
    runs_.push_back(end);
  }
  if (runs_.size() > 2) {  // the last run must stand alone, too, or belongs to the one before
    Node node{};
    const std::int32_t first = runs_[runs_.size() - 2];
    place_run(s, first, n, links.data(), node);
    if (map_run(s, first, n, links.data(), node, nullptr) >= 0) runs_.erase(runs_.end() - 2);
  }
  levels_ = {0};
  for (std::size_t count = runs_.size() - 1;; count = (count + 1) / 2) {
    levels_.push_back(levels_.back() + count);
    if (count == 1) break;
  }
  shared_level_ = 0;
  while (nodes_of(shared_level_) > kShares) ++shared_level_;
  const auto wanted = static_cast<std::size_t>(std::max(0.0, params.real("threads")));
  threads_ = wanted > 0 ? wanted : worthwhile_threads(tree.bodies.size(), kNanosecondsAJoint);
  std::vector<double> scratch(scratch_size());
  return refuse_singular(
      tree, [&](const DynamicsBatch& b, double* qdd) { return one(b, 0, scratch.data(), qdd); });
}

Result<void> DivideAndConquer::accelerations(const DynamicsBatch& batch, std::span<double> qdd,
                                             Progress& progress) const {
  const BodyTree& tree = articulated_.tree;
  const std::size_t n = tree.velocities;
  RMP_TRY(check_batch(tree, batch, scratch_size(), qdd.size(), n));
  for (std::size_t i = 0; i < batch.count; ++i) {
    if (i % kSamplesPerCheck == 0 && progress.cancelled()) return cancelled();
    const std::int32_t bad = one(batch, i, batch.scratch.data(), qdd.data() + i * n);
    if (bad >= 0 && finite_inputs(tree, batch, i))
      return std::move(singular(tree, bad)).in(sample_name(i));
    if (bad >= 0 || !all_finite(qdd.data() + i * n, n)) return not_finite("the forces", i);
  }
  return {};
}

}  // namespace robomosp::articulated
