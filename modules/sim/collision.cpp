// SPDX-License-Identifier: Apache-2.0
#include "sim/collision.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <limits>
#include <mutex>
#include <numbers>
#include <set>
#include <utility>

#include "kernel/text.h"
#include "model/placement.h"
#include "motion/provider_params.h"
#include "robotics/build_model.h"
#include "robotics/kinematics.h"
#include "sim/collision_cache.h"
#include "sim/payload.h"
#include "spatial/convex_hull.h"
#include "spatial/parallel.h"
#include "spatial/pose.h"
#include "spatial/rotation.h"
#include "spatial/vec.h"

namespace robomosp::sim {
namespace {

using namespace spatial;
using document::ShapePiece;

constexpr std::size_t kAlwaysSamples = 64;  ///< for pairs that touch always
constexpr std::uint64_t kAlwaysSeed = 1;
constexpr double kInf = std::numeric_limits<double>::infinity();
/// Of the norm that sums up how far pairs are within the influence of a clearance field: the
/// nearest count most, but one that the task holds near does not hide the others.
constexpr double kNorm = 4;
constexpr double kVaries = 0.01;        ///< of the influence: a distance that one can change
constexpr double kAboutASample = 5000;  ///< that the clearance of a configuration takes [ns]

bool comes_before(const CollisionPair& x, const CollisionPair& y) {
  return std::pair(x.a, x.b) < std::pair(y.a, y.b);
}

/// SplitMix64 (Steele, Lea, Flood 2014): the same numbers on every platform.
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}
  double uniform(double low, double high) {
    std::uint64_t z = (state_ += 0x9e3779b97f4a7c15ULL);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
    z ^= z >> 31;
    return low + (high - low) * (static_cast<double>(z >> 11) * 0x1.0p-53);
  }
  void quaternion(double* q) {
    double length = 0;
    do {
      length = 0;
      for (int k = 0; k < 4; ++k) q[k] = uniform(-1, 1), length += q[k] * q[k];
    } while (length > 1 || length < 0.01);
    for (int k = 0; k < 4; ++k) q[k] /= std::sqrt(length);
  }

 private:
  std::uint64_t state_;
};

/// Within the limits; one turn or one metre about the middle where there are none.
void random_configuration(const RobotModel& model, Random& random, double* q) {
  for (const JointModel& j : model.joints) {
    if (j.is_coupled()) continue;
    double* own = q + j.q_index;
    if (coordinate_count(j.type) == 1) {
      const double half = j.type == JointType::revolute ? std::numbers::pi : 0.5;
      const bool has_low = std::isfinite(j.lower), has_high = std::isfinite(j.upper);
      const double low = has_low ? j.lower : has_high ? j.upper - 2 * half : -half;
      const double high = has_high ? j.upper : low + 2 * half;
      *own = random.uniform(low, high);
      continue;
    }
    if (j.type == JointType::free) {
      for (int k = 0; k < 3; ++k) own[k] = random.uniform(-0.5, 0.5);
      own += 3;
    }
    random.quaternion(own);
  }
}

std::vector<double> neutral(const RobotModel& model) {
  std::vector<double> q(model.coordinate_count(), 0.0);
  for (const JointModel& j : model.joints) {
    if (j.is_coupled() || coordinate_count(j.type) == 1) continue;
    q[static_cast<std::size_t>(j.q_index) + (j.type == JointType::free ? 3 : 0)] = 1;
  }
  return q;
}

/// The configuration given, else the pose "home", else the neutral one.
std::vector<double> shown_q(const model::Robot& record, const RobotModel& model,
                            const std::vector<double>& given) {
  const std::size_t n = model.coordinate_count();
  if (given.size() == n) return given;
  for (const auto& pose : record.poses)
    if (pose.name == "home" && pose.q.size() == n) return pose.q;
  return neutral(model);
}

/// Greatest distance of a piece's points from a point of its body's frame.
double reach_from(const ShapePiece& p, const Vec3& origin) {
  const Vec3 away = sub(p.pose.p, origin);
  switch (p.kind) {
    case ShapeKind::box: return norm(away) + 0.5 * norm(p.sizes);
    case ShapeKind::sphere: return norm(away) + p.sizes[0];
    case ShapeKind::cylinder: return norm(away) + std::hypot(p.sizes[0], p.sizes[1] / 2);
    case ShapeKind::capsule: return norm(away) + p.sizes[0] + p.sizes[1] / 2;
    case ShapeKind::mesh:
    case ShapeKind::convex: break;
  }
  double most = 0;
  const auto& v = p.mesh->positions;
  for (std::size_t i = 0; i + 2 < v.size(); i += 3)
    most = std::max(most, distance(origin, transform(p.pose, {static_cast<double>(v[i]),
                                                              static_cast<double>(v[i + 1]),
                                                              static_cast<double>(v[i + 2])})));
  return most;
}

/// Around a piece, in its body's frame.
Box box_of(const ShapePiece& p) {
  Box box;
  switch (p.kind) {
    case ShapeKind::box: box.half = scale(p.sizes, 0.5); break;
    case ShapeKind::sphere: box.half = {p.sizes[0], p.sizes[0], p.sizes[0]}; break;
    case ShapeKind::cylinder: box.half = {p.sizes[0], p.sizes[0], p.sizes[1] / 2}; break;
    case ShapeKind::capsule:
      box.half = {p.sizes[0], p.sizes[0], p.sizes[0] + p.sizes[1] / 2};
      break;
    case ShapeKind::mesh:
    case ShapeKind::convex: box = box_around(vertices(*p.mesh)); break;
  }
  return moved(box, p.pose);
}

/// Rotation from one unit quaternion to another: its angle [rad].
double turn_between(const double* a, const double* b) {
  double d = 0, aa = 0, bb = 0;
  for (int k = 0; k < 4; ++k) d += a[k] * b[k], aa += a[k] * a[k], bb += b[k] * b[k];
  return 2 * std::acos(std::clamp(std::fabs(d) / std::sqrt(aa * bb), 0.0, 1.0));
}

/// All joints evenly on the way: angles and lengths linearly, quaternions along the shortest arc.
void between(const RobotModel& model, const double* from, const double* to, double share,
             double* out) {
  for (const JointModel& j : model.joints) {
    if (j.is_coupled()) continue;
    const std::int32_t i = j.q_index;
    const std::int32_t linear = j.type == JointType::spherical ? 0
                                : j.type == JointType::free    ? 3
                                                               : 1;
    for (std::int32_t k = i; k < i + linear; ++k) out[k] = from[k] + share * (to[k] - from[k]);
    if (coordinate_count(j.type) == 1) continue;
    const double *a = from + i + linear, *b = to + i + linear;
    double* o = out + i + linear;
    const double angle = turn_between(a, b) / 2;
    double d = 0;
    for (int k = 0; k < 4; ++k) d += a[k] * b[k];
    const double sign = d < 0 ? -1 : 1;
    const bool is_small = angle < 1e-9;
    const double wa = is_small ? 1 - share : std::sin((1 - share) * angle) / std::sin(angle);
    const double wb = is_small ? share : std::sin(share * angle) / std::sin(angle);
    for (int k = 0; k < 4; ++k) o[k] = wa * a[k] + sign * wb * b[k];
  }
}

}  // namespace

// ---- building ----

struct CollisionModel::Builder {
  const Simulator& source;
  Progress& progress;
  std::shared_ptr<CollisionModel> out = std::make_shared<CollisionModel>();
  std::vector<std::vector<ShapePiece>> pieces = {};   ///< of each body
  std::vector<model::PairRule> rules = {};            ///< names of bodies of the whole
  std::vector<std::set<std::int32_t>> carriers = {};  ///< of each robot: its joints with bodies

  Result<void> add_robot(RobotId id, const std::string& name, const Pose& world_T_mounting,
                         const std::vector<double>& q) {
    const model::Robot* record = source.snapshot.get(id);
    if (!record)
      return error(ErrorCode::stale_handle, "the robot no longer exists", "Add it again.");
    CollisionRobot robot;
    robot.name = name;
    robot.record = id;
    RMP_TRY_ASSIGN(robot.model,
                   source.derived.robot_model(source.snapshot, id, {0, 0, -9.81}, progress));
    RMP_TRY_ASSIGN(auto shapes, source.derived.robot_shapes(source.snapshot, id, progress));
    robot.world_T_base = compose(world_T_mounting, robot.model->base);
    robot.shown = shown_q(*record, *robot.model, q);
    robot.first = out->coordinates_;
    out->coordinates_ += robot.model->coordinate_count();
    const std::string prefix = name.empty() ? "" : name + ".";
    const auto index = static_cast<std::int32_t>(out->robots_.size());
    const auto frames = robotics::link_frames(*record);
    for (std::size_t b = 0; b < shapes.size(); ++b) {
      if (shapes[b].empty()) continue;
      CollisionBody body;
      body.robot = index;
      body.name = prefix + (b == 0 ? "base" : record->links[b - 1].name);
      if (b > 0) body.joint = frames[b - 1].joint;
      const Pose in_joint = b > 0 ? frames[b - 1].joint_T_link : Pose{};
      body.placement = body.joint < 0 ? compose(robot.world_T_base, in_joint) : in_joint;
      const Vec3 origin = inverse(in_joint).p;
      for (const ShapePiece& p : shapes[b])
        body.reach = std::max(body.reach, reach_from(p, origin));
      out->bodies_.push_back(std::move(body));
      pieces.push_back(std::move(shapes[b]));
    }
    for (model::PairRule rule : record->pair_rules) {
      rule.a = prefix + rule.a;
      rule.b = prefix + rule.b;
      rules.push_back(std::move(rule));
    }
    out->robots_.push_back(std::move(robot));
    return {};
  }

  Result<void> add_object(const model::PlacedObject& o, const Pose& world_T_object,
                          const Load* held = nullptr, std::int32_t robot = -1,
                          const Pose& world_T_base = {}) {
    RMP_TRY_ASSIGN(const auto shapes, source.derived.shapes(source.snapshot, o.what, progress));
    CollisionBody body;
    body.name = o.name;
    body.placement = world_T_object;
    if (held) {
      body.is_held = true;
      body.robot = robot;
      body.joint = held->joint;
      body.placement =
          held->joint < 0 ? compose(world_T_base, held->joint_T_object) : held->joint_T_object;
      const Vec3 origin = inverse(held->joint_T_object).p;
      for (const ShapePiece& p : *shapes) body.reach = std::max(body.reach, reach_from(p, origin));
    }
    out->bodies_.push_back(std::move(body));
    pieces.push_back(*shapes);
    return {};
  }

  /// The objects of a world where they are, or with the robots that hold them.
  Result<void> add_objects(WorldId id, const model::World& world, const ObjectPlaces* places) {
    std::vector<Load> held;
    std::vector<Pose> bases;
    for (const model::PlacedRobot& r : world.robots) {
      RMP_TRY_ASSIGN(const auto model,
                     source.derived.robot_model(source.snapshot, r.robot, {0, 0, -9.81}, progress));
      bases.push_back(compose(model::pose(r.placement), model->base));
      if (places) continue;
      RMP_TRY_ASSIGN(auto own, attached_loads(source, id, r, *model));
      std::move(own.begin(), own.end(), std::back_inserter(held));
    }
    if (places) held = places->held;
    for (const model::PlacedObject& o : world.objects) {
      const auto load =
          std::find_if(held.begin(), held.end(), [&](const Load& l) { return l.object == o.name; });
      const auto robot = std::find_if(world.robots.begin(), world.robots.end(), [&](const auto& r) {
        return load != held.end() && r.name == load->robot;
      });
      if (robot != world.robots.end()) {
        const auto at = robot - world.robots.begin();
        RMP_TRY(add_object(o, {}, &*load, static_cast<std::int32_t>(at),
                           bases[static_cast<std::size_t>(at)]));
        continue;
      }
      Pose pose = model::pose(o.placement);
      if (places)
        if (const auto moved = places->moved.find(o.name); moved != places->moved.end())
          pose = moved->second;
      RMP_TRY(add_object(o, pose));
    }
    return {};
  }

  /// Which rule speaks of a pair; a body's own name counts before that of its robot.
  [[nodiscard]] const model::PairRule* rule_of(const CollisionBody& a,
                                               const CollisionBody& b) const {
    const auto fit = [&](const std::string& name, const CollisionBody& body) {
      if (name == body.name) return 2;
      return body.robot >= 0 && name == out->robots_[static_cast<std::size_t>(body.robot)].name ? 1
                                                                                                : 0;
    };
    const model::PairRule* best = nullptr;
    int most = 0;
    for (const model::PairRule& r : rules)
      for (const auto& [x, y] : {std::pair(&r.a, &r.b), std::pair(&r.b, &r.a)}) {
        const int u = fit(*x, a), v = fit(*y, b);
        if (u > 0 && v > 0 && u + v >= most) best = &r, most = u + v;
      }
    return best;
  }

  /// Whether nothing but one joint, or joints that carry no body, is between them.
  [[nodiscard]] bool are_adjacent(const CollisionBody& a, const CollisionBody& b) const {
    if (a.robot != b.robot || a.robot < 0 || a.is_held || b.is_held) return false;
    const RobotModel& m = *out->robots_[static_cast<std::size_t>(a.robot)].model;
    const auto& carrying = carriers[static_cast<std::size_t>(a.robot)];
    const auto below = [&](const CollisionBody& body) {
      std::int32_t j = body.joint < 0 ? -2 : m.joints[static_cast<std::size_t>(body.joint)].parent;
      while (j >= 0 && !carrying.contains(j)) j = m.joints[static_cast<std::size_t>(j)].parent;
      return j;
    };
    if (below(a) == b.joint || below(b) == a.joint) return true;
    // Closed loops join links that the tree does not.
    return std::any_of(m.loops.begin(), m.loops.end(), [&](const LoopModel& l) {
      return (l.joint_a == a.joint && l.joint_b == b.joint) ||
             (l.joint_a == b.joint && l.joint_b == a.joint);
    });
  }

  [[nodiscard]] bool moves_against(const CollisionBody& a, const CollisionBody& b) const {
    if (a.joint < 0 && b.joint < 0) return false;
    return a.robot != b.robot || a.joint != b.joint;
  }

  Result<std::shared_ptr<const CollisionModel>> finish() {
    RMP_TRY_ASSIGN(const ProviderInfo info,
                   source.registry.find(CollisionEngine::kInterfaceId, ""));
    RMP_TRY_ASSIGN(const auto engine, source.registry.create<CollisionEngine>(info.name));
    RMP_TRY_ASSIGN(const auto params,
                   motion::checked_params(info, model::ProviderChoice{}, "collision"));
    std::vector<ShapedBody> shaped(pieces.size());
    for (std::size_t b = 0; b < pieces.size(); ++b)
      for (const ShapePiece& p : pieces[b]) shaped[b].shapes.push_back(p.shape());
    auto scene = guarded(info.name, [&] { return engine->build(shaped, *params, progress); });
    if (!scene.ok()) return std::move(scene).error();
    out->provider_ = info.name;
    out->is_script_ = info.origin == "lua";
    out->scene_ = std::move(*scene);
    carriers.resize(out->robots_.size());
    for (const CollisionBody& b : out->bodies_)
      if (b.robot >= 0) carriers[static_cast<std::size_t>(b.robot)].insert(b.joint);
    make_broad_phase();

    std::vector<CollisionPair> undecided;
    const auto count = static_cast<std::int32_t>(out->bodies_.size());
    for (std::int32_t a = 0; a < count; ++a)
      for (std::int32_t b = a + 1; b < count; ++b) {
        const CollisionBody &x = out->bodies_[static_cast<std::size_t>(a)],
                            &y = out->bodies_[static_cast<std::size_t>(b)];
        if (!moves_against(x, y)) continue;
        const model::PairRule* rule = rule_of(x, y);
        if (rule && rule->is_allowed) {
          out->passed_.push_back({{a, b}, PairReason::rule, rule->reason});
        } else if (!rule && are_adjacent(x, y)) {
          out->passed_.push_back({{a, b}, PairReason::adjacent, {}});
        } else {
          out->pairs_.push_back({a, b});
          if (!rule && x.robot == y.robot) undecided.push_back({a, b});
        }
      }
    if (!undecided.empty()) RMP_TRY(pass_always(undecided));
    out->checked_ = PairSet(out->bodies_.size(), out->pairs_);
    return std::shared_ptr<const CollisionModel>(std::move(out));
  }

  void make_broad_phase() {
    std::vector<Box> boxes;
    std::vector<bool> moves;
    for (std::size_t b = 0; b < pieces.size(); ++b) {
      Box box = box_of(pieces[b].front());
      for (const ShapePiece& p : pieces[b]) box = around(box, box_of(p));
      boxes.push_back(box);
      moves.push_back(out->bodies_[b].joint >= 0);
    }
    std::vector<Pose> poses(out->bodies_.size());
    out->place(out->shown(), poses);
    out->broad_ = BroadPhase(boxes, poses, moves);
  }

  /// Takes out the pairs of one robot that touch however it stands: nothing could be done about
  /// them.
  Result<void> pass_always(const std::vector<CollisionPair>& undecided) {
    const auto all = out->pairs_;
    out->pairs_ = undecided;
    auto sampled = out->sample_pairs(kAlwaysSamples, kAlwaysSeed, progress);
    out->pairs_ = all;
    if (!sampled.ok()) return std::move(sampled).error();
    for (const SampledPair& s : *sampled) {
      if (!s.always) continue;
      std::erase_if(out->pairs_,
                    [&](const CollisionPair& p) { return p.a == s.pair.a && p.b == s.pair.b; });
      out->passed_.push_back({s.pair, PairReason::always, {}});
    }
    return {};
  }
};

Result<std::shared_ptr<const CollisionModel>> CollisionModel::of_world(const Simulator& source,
                                                                       WorldId id,
                                                                       Progress& progress,
                                                                       const ObjectPlaces* places) {
  const model::World* world = source.snapshot.get(id);
  if (!world)
    return error(ErrorCode::stale_handle, "the world no longer exists", "Open or create one.");
  Builder b{source, progress};
  const std::string where = source.snapshot.describe(id);
  RMP_TRY(b.add_objects(id, *world, places).in(where));
  for (const auto& r : world->robots)
    RMP_TRY(b.add_robot(r.robot, r.name, model::pose(r.placement), r.q).in(where));
  // The world's own rules come last, so that they win over those of its robots.
  b.rules.insert(b.rules.end(), world->pair_rules.begin(), world->pair_rules.end());
  return b.finish().in(where);
}

Result<std::shared_ptr<const CollisionModel>> CollisionModel::of_robot(const Simulator& source,
                                                                       RobotId id,
                                                                       Progress& progress) {
  Builder b{source, progress};
  const std::string where = source.snapshot.describe(id);
  RMP_TRY(b.add_robot(id, "", {}, {}).in(where));
  return b.finish().in(where);
}

// ---- queries ----

std::vector<double> CollisionModel::shown() const {
  std::vector<double> q;
  for (const CollisionRobot& r : robots_) q.insert(q.end(), r.shown.begin(), r.shown.end());
  return q;
}

std::string CollisionModel::describe(const CollisionPair& p) const {
  return bodies_[static_cast<std::size_t>(p.a)].name + " and " +
         bodies_[static_cast<std::size_t>(p.b)].name;
}

void CollisionModel::place(std::span<const double> q, std::span<Pose> out) const {
  Sample at = sample();
  place_moving(q, at);
  std::copy(at.poses.begin(), at.poses.end(), out.begin());
}

CollisionModel::Sample CollisionModel::sample() const {
  Sample s;
  for (const CollisionRobot& r : robots_) s.frames.emplace_back(r.model->joints.size());
  for (const CollisionBody& b : bodies_) s.poses.push_back(b.placement);
  return s;
}

void CollisionModel::place_moving(std::span<const double> q, Sample& s) const {
  for (std::size_t i = 0; i < robots_.size(); ++i) {
    const CollisionRobot& r = robots_[i];
    robotics::forward_kinematics(*r.model, q.subspan(r.first, r.model->coordinate_count()),
                                 s.frames[i]);
  }
  for (std::size_t b = 0; b < bodies_.size(); ++b) {
    const CollisionBody& body = bodies_[b];
    if (body.joint < 0) continue;
    const auto robot = static_cast<std::size_t>(body.robot);
    s.poses[b] =
        compose(robots_[robot].world_T_base,
                compose(s.frames[robot][static_cast<std::size_t>(body.joint)], body.placement));
  }
}

Result<void> CollisionModel::check(std::span<const double> q) const {
  if (coordinates_ == 0 ? !q.empty() : q.empty() || q.size() % coordinates_ != 0)
    return error(ErrorCode::invalid_argument,
                 std::to_string(q.size()) + " joint values for configurations of " +
                     std::to_string(coordinates_),
                 "Give whole configurations.");
  for (const double x : q)
    if (!std::isfinite(x))
      return error(ErrorCode::invalid_argument, "a joint value is not a finite number",
                   "Correct it.");
  return {};
}

Result<void> CollisionModel::ask(std::span<const Pose> poses, std::span<const CollisionPair> pairs,
                                 double interest, std::span<PairDistance> out,
                                 Progress& progress) const {
  if (pairs.empty()) return {};
  auto done =
      guarded(provider_, [&] { return scene_->distances(poses, pairs, interest, out, progress); });
  if (!done.ok()) return std::move(done).error();
  for (const PairDistance& d : out)
    if (std::isnan(d.distance) || !is_finite(d.on_a) || !is_finite(d.on_b))
      return error(
          ErrorCode::plugin_failed,
          "provider " + text::quote(provider_) + " returned a distance that is not a number",
          "Report it to the provider's author or choose another provider.");
  return {};
}

Result<std::vector<PairDistance>> CollisionModel::distances_of(std::span<const double> q,
                                                               std::span<const CollisionPair> pairs,
                                                               double interest,
                                                               Progress& progress) const {
  RMP_TRY(check(q));
  const std::size_t samples = coordinates_ == 0 ? 1 : q.size() / coordinates_;
  std::vector<PairDistance> out(samples * pairs.size());
  if (out.empty()) return out;
  std::vector<Pose> poses;
  poses.reserve(samples * bodies_.size());
  Sample at = sample();
  for (std::size_t i = 0; i < samples; ++i) {
    place_moving(q.subspan(i * coordinates_, coordinates_), at);
    poses.insert(poses.end(), at.poses.begin(), at.poses.end());
  }
  RMP_TRY(ask(poses, pairs, interest, out, progress));
  return out;
}

std::vector<CollisionPair> CollisionModel::candidates(const Sample& s, const PairSet& of,
                                                      double within) const {
  std::vector<CollisionPair> out;
  broad_.near(
      s.boxes, of, [&] { return within; }, [&](const CollisionPair& p) { out.push_back(p); });
  std::sort(out.begin(), out.end(), comes_before);
  return out;
}

Result<Contact> CollisionModel::least(Sample& s, const PairSet& of, double interest) const {
  Contact best{{-1, -1}, {interest, {}, {}}};
  NoProgress none;  // one configuration
  std::optional<Error> failure;
  const auto bound = [&] { return failure ? -1 : std::max(best.at.distance, 0.0); };
  const auto consider = [&](const CollisionPair& p) {
    // A little more than the least so far, so that rounding leaves out none that is equal.
    const double room = bound() * (1 + 1e-12) + 1e-15;
    PairDistance d;
    if (auto done = ask(s.poses, {&p, 1}, room, {&d, 1}, none); !done.ok()) {
      failure = std::move(done).error();
      return;
    }
    const bool is_first =
        d.distance == best.at.distance && best.pair.a >= 0 && comes_before(p, best.pair);
    if (d.distance < best.at.distance || is_first) best = {p, d};
  };
  // What was nearest before mostly still is, and leaves little to look at.
  const CollisionPair before = s.nearest;
  if (before.a >= 0 && of.contains(before.a, before.b)) consider(before);
  broad_.near(s.boxes, of, bound, [&](const CollisionPair& p) {
    if (p.a != before.a || p.b != before.b) consider(p);
  });
  if (failure) return std::move(*failure);
  s.nearest = best.pair;
  return best;
}

Result<std::vector<PairDistance>> CollisionModel::distances(std::span<const double> q,
                                                            double interest,
                                                            Progress& progress) const {
  return distances_of(q, pairs_, interest, progress);
}

Result<std::vector<Contact>> CollisionModel::near(std::span<const double> q, double interest,
                                                  Progress& progress) const {
  RMP_TRY(check(q));
  if (!(interest >= 0))
    return error(ErrorCode::invalid_argument, "the distance asked for is not a length",
                 "Give a length from 0 on, or infinity.");
  Sample s = sample();
  place_moving(q, s);
  broad_.place(s.poses, {}, s.boxes);
  const auto asked = candidates(s, checked_, interest);
  std::vector<PairDistance> found(asked.size());
  RMP_TRY(ask(s.poses, asked, interest, found, progress));
  std::vector<Contact> out;
  for (std::size_t k = 0; k < asked.size(); ++k)
    if (found[k].distance < interest) out.push_back({asked[k], found[k]});
  return out;
}

Result<std::vector<CollisionPair>> CollisionModel::collisions(std::span<const double> q,
                                                              Progress& progress) const {
  RMP_TRY(check(q));
  Sample s = sample();
  place_moving(q, s);
  broad_.place(s.poses, {}, s.boxes);
  const auto asked = candidates(s, checked_, 0);
  std::vector<CollisionPair> hits;
  if (asked.empty()) return hits;
  std::vector<std::uint8_t> touch(asked.size());
  auto done =
      guarded(provider_, [&] { return scene_->collisions(s.poses, asked, touch, progress); });
  if (!done.ok()) return std::move(done).error();
  for (std::size_t k = 0; k < asked.size(); ++k)
    if (touch[k]) hits.push_back(asked[k]);
  return hits;
}

Result<std::vector<Contact>> CollisionModel::clearance(std::span<const double> q,
                                                       Progress& progress) const {
  RMP_TRY(check(q));
  const std::size_t samples = coordinates_ == 0 ? 1 : q.size() / coordinates_;
  std::vector<Contact> out(samples, Contact{{-1, -1}, {kInf, {}, {}}});
  if (pairs_.empty()) return out;
  std::mutex mutex;
  std::optional<Error> failure;  // guarded by mutex
  std::atomic<bool> stops{false};
  const auto fail = [&](Error e) {
    const std::lock_guard lock(mutex);
    if (!failure) failure = std::move(e);
    stops = true;
  };
  const auto work = [&](std::size_t first, std::size_t last, std::size_t thread) {
    Sample s = sample();
    for (std::size_t i = first; i < last && !stops; ++i) {
      if (progress.cancelled())
        return fail(error(ErrorCode::cancelled, "the search for the clearance was stopped"));
      place_moving(q.subspan(i * coordinates_, coordinates_), s);
      broad_.place(s.poses, {}, s.boxes);
      auto found = least(s, checked_, kInf);
      if (!found.ok()) return fail(std::move(found).error());
      out[i] = *found;
      if (thread == 0 && i % 64 == 0)
        progress.report(static_cast<double>(i - first) / static_cast<double>(last - first),
                        "clearance");
    }
  };
  const std::size_t threads = is_script_ ? 1 : worthwhile_threads(samples, kAboutASample);
  in_parallel(samples, 16, threads, work);
  if (failure) return std::move(*failure);
  return out;
}

std::int32_t CollisionModel::common_joint(const CollisionPair& pair) const {
  const auto& a = bodies_[static_cast<std::size_t>(pair.a)];
  const auto& b = bodies_[static_cast<std::size_t>(pair.b)];
  if (a.robot != b.robot || a.robot < 0) return -1;
  const RobotModel& m = *robots_[static_cast<std::size_t>(a.robot)].model;
  // Parents have lower numbers than their children.
  std::int32_t i = a.joint, k = b.joint;
  while (i != k) {
    std::int32_t& later = i > k ? i : k;
    later = m.joints[static_cast<std::size_t>(later)].parent;
  }
  return i;
}

double CollisionModel::way_of(const CollisionBody& body, std::span<const double> from,
                              std::span<const double> to, std::int32_t up_to) const {
  if (body.joint < 0) return 0;
  const CollisionRobot& robot = robots_[static_cast<std::size_t>(body.robot)];
  const double *q0 = from.data() + robot.first, *q1 = to.data() + robot.first;
  double way = 0, arm = body.reach;  // from the joint's origin to the farthest point
  for (std::int32_t i = body.joint; i >= 0 && i != up_to;) {
    const JointModel& j = robot.model->joints[static_cast<std::size_t>(i)];
    const double *own0 = q0 + j.q_index, *own1 = q1 + j.q_index;
    switch (j.type) {
      case JointType::revolute:
        way += std::fabs(joint_value(j, q1) - joint_value(j, q0)) * arm;
        break;
      case JointType::prismatic: {
        const double x0 = joint_value(j, q0), x1 = joint_value(j, q1);
        way += std::fabs(x1 - x0);
        arm += std::max(std::fabs(x0), std::fabs(x1));
        break;
      }
      case JointType::spherical: way += turn_between(own0, own1) * arm; break;
      case JointType::free: {
        const Vec3 p0{own0[0], own0[1], own0[2]}, p1{own1[0], own1[1], own1[2]};
        way += turn_between(own0 + 3, own1 + 3) * arm + distance(p0, p1);
        arm += std::max(norm(p0), norm(p1));
        break;
      }
    }
    arm += norm(j.placement.p);
    i = j.parent;
  }
  return way;
}

double CollisionModel::motion_bound(const CollisionPair& pair, std::span<const double> from,
                                    std::span<const double> to) const {
  const std::int32_t shared = common_joint(pair);  // from there on joints move both alike
  return way_of(bodies_[static_cast<std::size_t>(pair.a)], from, to, shared) +
         way_of(bodies_[static_cast<std::size_t>(pair.b)], from, to, shared);
}

Result<std::optional<PathContact>> CollisionModel::check_path(std::span<const double> waypoints,
                                                              double tolerance,
                                                              Progress& progress) const {
  using Out = std::optional<PathContact>;
  if (!(tolerance > 0) || !std::isfinite(tolerance))
    return error(ErrorCode::invalid_argument, "the tolerance is not positive",
                 "Give a length above 0, such as 1e-4.");
  RMP_TRY(check(waypoints));
  const std::size_t n = coordinates_;
  const std::size_t points = n == 0 ? 1 : waypoints.size() / n;
  if (pairs_.empty()) return Out{};
  struct Track {
    CollisionPair pair;
    double way;  ///< that the two can move against each other on the segment, a bound
  };
  struct Open {
    std::size_t track;
    PairDistance begin;
    double end;
  };
  struct Interval {
    double begin, end;
    std::vector<Open> open;
  };
  NoProgress none;  // one configuration
  const std::size_t segments = std::max<std::size_t>(points - 1, 1);
  std::vector<double> q(n), grown(bodies_.size());
  Sample from = sample(), to = sample(), middle = sample();
  std::vector<Track> tracks;
  std::vector<CollisionPair> asked, reached;  ///< reached: the pairs of at_end
  std::vector<PairDistance> at_begin, at_end;
  std::size_t steps = 0;
  for (std::size_t i = 0; i < segments; ++i) {
    if (progress.cancelled())
      return error(ErrorCode::cancelled, "the check of the path was stopped");
    const auto q0 = waypoints.subspan(i * n, n);
    const auto q1 = waypoints.subspan(std::min(i + 1, points - 1) * n, n);
    // Pairs that can meet: their boxes, grown by what each body can move, do.
    if (i == 0) place_moving(q0, from);
    else std::swap(from, to);
    place_moving(q1, to);
    for (std::size_t b = 0; b < bodies_.size(); ++b) grown[b] = way_of(bodies_[b], q0, q1, -1);
    broad_.place(from.poses, grown, from.boxes);
    tracks.clear();
    asked = candidates(from, checked_, tolerance);
    double most = tolerance;
    for (const CollisionPair& p : asked) {
      tracks.push_back({p, motion_bound(p, q0, q1)});
      most = std::max(most, tracks.back().way);
    }
    if (tracks.empty()) {
      reached.clear();
      continue;
    }
    // Where the last segment ended this one begins.
    std::vector<PairDistance> before = std::move(at_end);
    std::vector<CollisionPair> unknown;
    at_begin.assign(asked.size(), {});
    std::vector<std::size_t> at_unknown;
    for (std::size_t k = 0; k < asked.size(); ++k) {
      const auto known = std::lower_bound(reached.begin(), reached.end(), asked[k], comes_before);
      if (known != reached.end() && !comes_before(asked[k], *known)) {
        at_begin[k] = before[static_cast<std::size_t>(known - reached.begin())];
      } else {
        unknown.push_back(asked[k]);
        at_unknown.push_back(k);
      }
    }
    std::vector<PairDistance> found(unknown.size());
    RMP_TRY(ask(from.poses, unknown, 1.001 * most, found, none));
    for (std::size_t k = 0; k < found.size(); ++k) at_begin[at_unknown[k]] = found[k];
    at_end.assign(asked.size(), {});
    RMP_TRY(ask(to.poses, asked, 1.001 * most, at_end, none));
    reached = asked;

    // Intervals in the order of time; a pair stays open while it could come near within.
    Interval whole{0, 1, {}};
    for (std::size_t k = 0; k < tracks.size(); ++k)
      whole.open.push_back({k, at_begin[k], at_end[k].distance});
    std::vector<Interval> stack{std::move(whole)};
    while (!stack.empty()) {
      Interval now = std::move(stack.back());
      stack.pop_back();
      const Open* nearest = nullptr;
      for (const Open& o : now.open)
        if (o.begin.distance <= tolerance &&
            (!nearest || o.begin.distance < nearest->begin.distance))
          nearest = &o;
      if (nearest)
        return Out{PathContact{i, now.begin, {tracks[nearest->track].pair, nearest->begin}}};
      const double length = now.end - now.begin;
      double way = tolerance;
      std::erase_if(now.open, [&](const Open& o) {
        const double own = tracks[o.track].way * length;
        if (o.begin.distance + std::max(o.end, 0.0) > own) return true;
        way = std::max(way, own);
        return false;
      });
      if (now.open.empty()) continue;
      if (++steps % 64 == 0 && progress.cancelled())
        return error(ErrorCode::cancelled, "the check of the path was stopped");
      const double half = 0.5 * (now.begin + now.end);
      for (const CollisionRobot& r : robots_)
        between(*r.model, &q0[r.first], &q1[r.first], half, &q[r.first]);
      place_moving(q, middle);
      std::vector<CollisionPair> open;
      for (const Open& o : now.open) open.push_back(tracks[o.track].pair);
      std::vector<PairDistance> d(open.size());
      RMP_TRY(ask(middle.poses, open, 1.001 * way, d, none));
      Interval first{now.begin, half, now.open}, second{half, now.end, std::move(now.open)};
      for (std::size_t k = 0; k < d.size(); ++k) {
        first.open[k].end = d[k].distance;
        second.open[k].begin = d[k];
      }
      stack.push_back(std::move(second));
      stack.push_back(std::move(first));
    }
    if (i + 1 < segments) continue;
    const auto last =
        std::min_element(at_end.begin(), at_end.end(),
                         [](const auto& x, const auto& y) { return x.distance < y.distance; });
    if (last->distance <= tolerance)
      return Out{PathContact{
          i, 1.0, {tracks[static_cast<std::size_t>(last - at_end.begin())].pair, *last}}};
  }
  return Out{};
}

Result<std::vector<SampledPair>> CollisionModel::sample_pairs(std::size_t samples,
                                                              std::uint64_t seed,
                                                              Progress& progress) const {
  std::vector<SampledPair> out;
  if (pairs_.empty() || samples == 0) return out;
  std::vector<std::size_t> hits(pairs_.size());
  Random random(seed);
  constexpr std::size_t kBatch = 512;
  std::vector<Pose> poses;
  std::vector<std::uint8_t> touch;
  std::vector<double> q(coordinates_);
  for (std::size_t done = 0; done < samples;) {
    const std::size_t now = std::min(kBatch, samples - done);
    poses.resize(now * bodies_.size());
    touch.resize(now * pairs_.size());
    for (std::size_t i = 0; i < now; ++i) {
      for (const CollisionRobot& r : robots_) random_configuration(*r.model, random, &q[r.first]);
      place(q, std::span<Pose>(poses).subspan(i * bodies_.size(), bodies_.size()));
    }
    auto asked =
        guarded(provider_, [&] { return scene_->collisions(poses, pairs_, touch, progress); });
    if (!asked.ok()) return std::move(asked).error();
    for (std::size_t i = 0; i < touch.size(); ++i) hits[i % pairs_.size()] += touch[i] ? 1 : 0;
    done += now;
  }
  for (std::size_t k = 0; k < pairs_.size(); ++k)
    if (hits[k] == 0 || hits[k] == samples) out.push_back({pairs_[k], hits[k] == samples});
  return out;
}

// ---- the clearance as a field ----

class RobotClearance final : public ClearanceField {
 public:
  RobotClearance(const CollisionModel& model, std::size_t robot, double influence)
      : model_(model),
        robot_(robot),
        influence_(influence),
        shown_(model.shown()),
        pairs_(model.bodies_.size(), avoidable()) {}

  double distance(std::span<const double> q, std::span<double> gradient) const override {
    std::fill(gradient.begin(), gradient.end(), 0.0);
    const CollisionRobot& robot = model_.robots_[robot_];
    if (q.size() != robot.model->coordinate_count()) return influence_;
    const std::unique_ptr<State> state = take();
    std::copy(q.begin(), q.end(), state->q.begin() + static_cast<std::ptrdiff_t>(robot.first));
    const double value = evaluate(*state, gradient);
    give_back(std::move(*state));
    return value;
  }

 private:
  /// What a call needs; kept for the next one of any thread.
  struct State {
    std::vector<double> q;  ///< of all robots
    CollisionModel::Sample sample;
  };
  double evaluate(State& state, std::span<double> gradient) const {
    CollisionModel::Sample& s = state.sample;
    if (!model_.check(state.q).ok()) return influence_;
    model_.place_moving(state.q, s);
    model_.broad_.place(s.poses, {}, s.boxes);
    const auto pairs = model_.candidates(s, pairs_, influence_);
    std::vector<PairDistance> d(pairs.size());
    NoProgress none;  // one configuration
    if (!model_.ask(s.poses, pairs, influence_, d, none).ok()) return influence_;
    double sum = 0;
    for (const PairDistance& at : d) sum += std::pow(intrusion(at), kNorm);
    if (!(sum > 0)) return influence_;
    const double whole = std::pow(sum, 1 / kNorm);
    if (gradient.size() != model_.robots_[robot_].model->dof()) return influence_ - whole;
    for (std::size_t k = 0; k < pairs.size(); ++k) {
      if (!(intrusion(d[k]) > 0) || std::fabs(d[k].distance) < 1e-12) continue;
      const double weight = std::pow(intrusion(d[k]) / whole, kNorm - 1);
      const Vec3 n = scale(sub(d[k].on_b, d[k].on_a), weight / d[k].distance);
      add(pairs[k].b, d[k].on_b, n, s.frames[robot_], gradient);
      add(pairs[k].a, d[k].on_a, scale(n, -1), s.frames[robot_], gradient);
    }
    return influence_ - whole;
  }
  [[nodiscard]] double intrusion(const PairDistance& d) const {
    return std::max(0.0, influence_ - d.distance);
  }

  std::unique_ptr<State> take() const {
    const std::lock_guard lock(mutex_);
    if (idle_.empty()) return std::make_unique<State>(State{shown_, model_.sample()});
    auto state = std::make_unique<State>(std::move(idle_.back()));
    idle_.pop_back();
    return state;
  }
  void give_back(State state) const {
    const std::lock_guard lock(mutex_);
    idle_.push_back(std::move(state));
  }

  /// The robot's pairs that some sampled configuration brings farther apart than the influence, and
  /// those with other things whose distance changes.
  [[nodiscard]] std::vector<CollisionPair> avoidable() const {
    std::vector<CollisionPair> near, far;
    const auto index = static_cast<std::int32_t>(robot_);
    for (const CollisionPair& p : model_.pairs_)
      if (model_.bodies_[static_cast<std::size_t>(p.a)].robot == index ||
          model_.bodies_[static_cast<std::size_t>(p.b)].robot == index)
        near.push_back(p);
    const CollisionRobot& robot = model_.robots_[robot_];
    Random random(kAlwaysSeed);
    NoProgress none;
    CollisionModel::Sample s = model_.sample();
    std::vector<double> q = shown_, first_seen;
    for (std::size_t i = 0; i < kAlwaysSamples && !near.empty(); ++i) {
      random_configuration(*robot.model, random, &q[robot.first]);
      model_.place_moving(q, s);
      std::vector<PairDistance> d(near.size());
      if (!model_.ask(s.poses, near, influence_, d, none).ok()) break;
      std::vector<CollisionPair> still;
      std::vector<double> began;
      for (std::size_t k = 0; k < near.size(); ++k) {
        const double first = i == 0 ? d[k].distance : first_seen[k];
        const bool is_own = model_.bodies_[static_cast<std::size_t>(near[k].a)].robot ==
                            model_.bodies_[static_cast<std::size_t>(near[k].b)].robot;
        const bool varies = std::fabs(d[k].distance - first) > kVaries * influence_;
        if (d[k].distance >= influence_ || (!is_own && varies)) {
          far.push_back(near[k]);
        } else {
          still.push_back(near[k]);
          began.push_back(first);
        }
      }
      near = std::move(still);
      first_seen = std::move(began);
    }
    return far;
  }

  /// Adds direction . velocity of a point of a body for unit rates of the robot.
  void add(std::int32_t body, const Vec3& point, const Vec3& direction,
           const std::vector<Pose>& frames, std::span<double> gradient) const {
    const CollisionBody& b = model_.bodies_[static_cast<std::size_t>(body)];
    if (b.robot != static_cast<std::int32_t>(robot_)) return;
    const CollisionRobot& robot = model_.robots_[robot_];
    for (std::int32_t i = b.joint; i >= 0;
         i = robot.model->joints[static_cast<std::size_t>(i)].parent) {
      const JointModel& j = robot.model->joints[static_cast<std::size_t>(i)];
      const Pose at = compose(robot.world_T_base, frames[static_cast<std::size_t>(i)]);
      const Vec3 arm = sub(point, at.p);
      const auto turning = [&](std::size_t k) { return dot(direction, cross(axis(at, k), arm)); };
      double* own = gradient.data() + j.v_index;
      const double ratio = j.is_coupled() ? j.coupling.ratio : 1;
      switch (j.type) {
        case JointType::revolute: *own += ratio * turning(2); break;
        case JointType::prismatic: *own += ratio * dot(direction, axis(at, 2)); break;
        case JointType::spherical:
          for (std::size_t k = 0; k < 3; ++k) own[k] += turning(k);
          break;
        case JointType::free:
          for (std::size_t k = 0; k < 3; ++k) {
            own[k] += dot(direction, axis(at, k));
            own[3 + k] += turning(k);
          }
          break;
      }
    }
  }

  const CollisionModel& model_;
  std::size_t robot_;
  double influence_;
  std::vector<double> shown_;
  PairSet pairs_;
  mutable std::mutex mutex_;
  mutable std::vector<State> idle_;  ///< guarded by mutex_
};

std::unique_ptr<ClearanceField> CollisionModel::field(std::size_t robot, double influence) const {
  return std::make_unique<RobotClearance>(*this, robot, influence);
}

// ---- recordings ----

Result<std::vector<double>> configurations(const CollisionModel& model,
                                           const Recording& recording) {
  const std::vector<double> shown = model.shown();
  std::vector<double> q;
  for (std::size_t i = 0; i < recording.rows(); ++i) q.insert(q.end(), shown.begin(), shown.end());
  bool is_found = recording.robot.empty();
  for (const CollisionRobot& robot : model.robots()) {
    // Further robots have their columns under their names, or stand still.
    const bool is_main = robot.name == recording.robot;
    const std::string stem = is_main ? "q" : robot.name + ".q";
    is_found = is_found || is_main;
    if (!is_main && !recording.find(stem + "1")) continue;
    for (std::size_t k = 0; k < robot.model->coordinate_count(); ++k) {
      const Column* c = recording.find(stem + std::to_string(k + 1));
      if (!c)
        return error(ErrorCode::invalid_argument,
                     "the recording has no column " + stem + std::to_string(k + 1),
                     "Its robot has been changed since; make it again.");
      for (std::size_t i = 0; i < recording.rows(); ++i)
        q[i * shown.size() + robot.first + k] = c->values[i];
    }
  }
  if (!is_found)
    return error(ErrorCode::unknown_name,
                 "the world has no robot " + text::quote(recording.robot) + " any more",
                 "Make the recording again.");
  return q;
}

/// Where objects are in a row of a recording that holds their places.
Result<ObjectPlaces> places_at(const model::World& world, const Recording& recording,
                               std::size_t row) {
  ObjectPlaces out;
  out.held = loads_at(*recording.loads, recording.columns.front().values[row]);
  for (const model::PlacedObject& object : world.objects) {
    if (!recording.find(object.name + ".x")) continue;
    std::array<double, 7> v{};
    constexpr std::array<const char*, 7> kParts{".x", ".y", ".z", ".qw", ".qx", ".qy", ".qz"};
    for (std::size_t k = 0; k < v.size(); ++k) {
      const Column* c = recording.find(object.name + kParts[k]);
      if (!c)
        return error(ErrorCode::invalid_argument,
                     "the recording has no column " + text::quote(object.name + kParts[k]),
                     "Make it again.");
      v[k] = c->values[row];
    }
    Pose pose;
    pose.p = {v[0], v[1], v[2]};
    pose.R = spatial::from_quaternion(spatial::Quaternion{v[3], v[4], v[5], v[6]});
    out.moved.emplace(object.name, pose);
  }
  return out;
}

Result<RecordingPtr> with_clearance(const Simulator& source, const Recording& recording,
                                    Progress& progress) {
  const model::World* const world = source.snapshot.get(recording.world);
  if (!world)
    return error(ErrorCode::stale_handle, "the world no longer exists", "Open or create one.");
  const bool has_loads = recording.loads && recording.rows() > 0;
  for (const model::PlacedObject& object : world->objects)
    if (!has_loads && recording.find(object.name + ".x"))
      return error(ErrorCode::unsupported,
                   "object " + text::quote(object.name) +
                       " moves by itself in the recording, and clearances know objects at rest or "
                       "in a robot's hand",
                   "Ask for the clearance of a run without it.");
  // A model for each stretch of rows in which nothing is taken or let go.
  std::vector<std::shared_ptr<const CollisionModel>> models;
  std::vector<std::size_t> firsts{0};
  if (has_loads) firsts = load_stretches(recording, *recording.loads);
  std::vector<Contact> nearest;
  for (std::size_t i = 0; i < firsts.size(); ++i) {
    if (has_loads) {
      RMP_TRY_ASSIGN(const ObjectPlaces places, places_at(*world, recording, firsts[i]));
      RMP_TRY_ASSIGN(const auto made,
                     CollisionModel::of_world(source, recording.world, progress, &places));
      models.push_back(made);
    } else {
      RMP_TRY_ASSIGN(const auto made, collision_model(source, recording.world, progress));
      models.push_back(made);
    }
    RMP_TRY_ASSIGN(const auto q, configurations(*models.back(), recording));
    const std::size_t width = models.back()->coordinate_count();
    const std::size_t end = i + 1 < firsts.size() ? firsts[i + 1] : recording.rows();
    RMP_TRY_ASSIGN(
        const auto part,
        models.back()->clearance(std::span(q).subspan(firsts[i] * width, (end - firsts[i]) * width),
                                 progress));
    nearest.insert(nearest.end(), part.begin(), part.end());
  }
  Recording out = recording;
  Column column{
      "clearance", "m", "least distance of the robots' bodies to each other and to all else", {}};
  for (std::size_t i = 0; i < recording.rows(); ++i)
    column.values.push_back(nearest[i].at.distance);
  const auto first = std::find_if(nearest.begin(), nearest.end(),
                                  [](const Contact& c) { return c.at.distance <= 0; });
  if (first != nearest.end()) {
    const auto row = static_cast<std::size_t>(first - nearest.begin());
    const auto after = std::upper_bound(firsts.begin(), firsts.end(), row);
    out.notes.push_back(
        models[static_cast<std::size_t>(after - firsts.begin()) - 1]->describe(first->pair) +
        " touch from t = " + text::print_rounded(recording.columns.front().values[row]) + " s.");
  }
  if (std::all_of(models.begin(), models.end(), [](const auto& m) { return m->pairs().empty(); }))
    out.notes.emplace_back("Nothing in the world can touch, so the clearance is infinite.");
  std::erase_if(out.columns, [](const Column& c) { return c.name == "clearance"; });
  out.columns.push_back(std::move(column));
  return std::make_shared<const Recording>(std::move(out));
}

}  // namespace robomosp::sim
