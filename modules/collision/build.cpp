// SPDX-License-Identifier: Apache-2.0
// Putting collision models together from worlds and robots, and the pairs that are checked.
#include <algorithm>
#include <iterator>
#include <map>
#include <set>
#include <utility>

#include "collision/collision.h"
#include "collision/cover.h"
#include "collision/random.h"
#include "evaluation/payload.h"
#include "kernel/text.h"
#include "model/placement.h"
#include "motion/provider_params.h"
#include "robotics/build_model.h"
#include "robotics/home.h"
#include "spatial/convex_hull.h"
#include "spatial/pose.h"
#include "spatial/vec.h"

namespace robomosp::collision {
namespace {

using namespace spatial;
using evaluation::attached_loads;
using evaluation::ShapePiece;
using evaluation::Sources;
using recording::Load;

constexpr std::size_t kAlwaysSamples = 64;  ///< for pairs that touch always
constexpr std::uint64_t kAlwaysSeed = 1;

/// The configuration given where it fits, else where the robot stands by itself.
std::vector<double> shown_q(const model::Robot& record, const RobotModel& model,
                            const std::vector<double>& given) {
  return given.size() == model.coordinate_count() ? given : robotics::home_joint_values(record);
}

/// Greatest distance of a piece's points from a point of its body's frame.
double reach_from(const ShapePiece& p, const Vec3& origin) {
  const Vec3 away = sub(p.pose.p, origin);
  if (p.cone)
    return norm(away) + std::hypot(std::max((*p.cone)[0], (*p.cone)[1]), (*p.cone)[2] / 2);
  if (p.ellipsoid) return norm(away) + *std::max_element(p.ellipsoid->begin(), p.ellipsoid->end());
  switch (p.kind) {
    case ShapeKind::box: return norm(away) + 0.5 * norm(p.sizes);
    case ShapeKind::sphere: return norm(away) + p.sizes[0];
    case ShapeKind::cylinder: return norm(away) + std::hypot(p.sizes[0], p.sizes[1] / 2);
    case ShapeKind::capsule: return norm(away) + p.sizes[0] + p.sizes[1] / 2;
    case ShapeKind::cone:
    case ShapeKind::ellipsoid:
    case ShapeKind::mesh:
    case ShapeKind::convex: break;
  }
  double most = 0;
  for (const Vec3& v : p.points()) most = std::max(most, distance(origin, transform(p.pose, v)));
  return most;
}

/// Around a piece, in its body's frame.
Box box_of(const ShapePiece& p) { return moved(box_in_piece(p), p.pose); }

}  // namespace

struct CollisionModel::Builder {
  const Sources& source;
  Progress& progress;
  std::shared_ptr<CollisionModel> out = std::make_shared<CollisionModel>();
  std::vector<std::vector<ShapePiece>> pieces = {};   ///< of each body
  std::vector<model::CollisionPairRule> rules = {};   ///< names of bodies of the whole
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
    note_shapeless(shapes, frames, *record, *robot.model, prefix);
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
    for (model::CollisionPairRule rule : record->pair_rules) {
      rule.a = prefix + rule.a;
      rule.b = prefix + rule.b;
      rules.push_back(std::move(rule));
    }
    out->robots_.push_back(std::move(robot));
    return {};
  }

  /// What moves as one is shapeless where none of its links has a shape: named by its first link.
  void note_shapeless(const std::vector<std::vector<ShapePiece>>& shapes,
                      const std::vector<robotics::LinkFrame>& frames, const model::Robot& record,
                      const RobotModel& model, const std::string& prefix) {
    std::vector<bool> has_shape(model.joints.size() + 1);
    std::vector<std::string> names(has_shape.size());
    for (std::size_t b = 0; b < shapes.size(); ++b) {
      const auto at = static_cast<std::size_t>(b == 0 ? 0 : frames[b - 1].joint + 1);
      if (!shapes[b].empty()) has_shape[at] = true;
      if (names[at].empty()) names[at] = b == 0 ? "base" : record.links[b - 1].name;
    }
    for (std::size_t at = 0; at < names.size(); ++at)
      // A joint of several coordinates is several, and its link hangs on the last.
      if (!has_shape[at] && !names[at].empty()) out->shapeless_.push_back(prefix + names[at]);
  }

  Result<void> add_object(const model::PlacedObject& o, const Pose& world_T_object,
                          const Load* held = nullptr, std::int32_t robot = -1,
                          const Pose& world_T_base = {}) {
    RMP_TRY_ASSIGN(const auto shapes, source.derived.shapes(source.snapshot, o.what, progress));
    if (shapes->empty()) {
      out->shapeless_.push_back(o.name);
      return {};
    }
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
  [[nodiscard]] const model::CollisionPairRule* rule_of(const CollisionBody& a,
                                                        const CollisionBody& b) const {
    const auto fit = [&](const std::string& name, const CollisionBody& body) {
      if (name == body.name) return 2;
      return body.robot >= 0 && name == out->robots_[static_cast<std::size_t>(body.robot)].name ? 1
                                                                                                : 0;
    };
    const model::CollisionPairRule* best = nullptr;
    int most = 0;
    for (const model::CollisionPairRule& r : rules)
      for (const auto& [x, y] : {std::pair(&r.a, &r.b), std::pair(&r.b, &r.a)}) {
        const int u = fit(*x, a), v = fit(*y, b);
        if (u > 0 && v > 0 && u + v >= most) best = &r, most = u + v;
      }
    return best;
  }

  /// Pairs that do not move against each other are checked where a rule that names both says so;
  /// gives the first body of each.
  std::set<std::int32_t> add_forbidden() {
    std::map<std::string_view, std::int32_t> numbers;
    for (std::size_t i = 0; i < out->bodies_.size(); ++i)
      numbers.emplace(out->bodies_[i].name, static_cast<std::int32_t>(i));
    std::set<std::int32_t> firsts;
    for (const model::CollisionPairRule& r : rules) {
      const auto a = numbers.find(r.a), b = numbers.find(r.b);
      if (r.is_allowed || a == numbers.end() || b == numbers.end() || a == b) continue;
      const CollisionPair pair{std::min(a->second, b->second), std::max(a->second, b->second)};
      const CollisionBody &x = out->bodies_[static_cast<std::size_t>(pair.a)],
                          &y = out->bodies_[static_cast<std::size_t>(pair.b)];
      if (moves_against(x, y) || rule_of(x, y) != &r) continue;
      out->pairs_.push_back(pair);
      firsts.insert(pair.a);
    }
    std::sort(out->pairs_.begin(), out->pairs_.end(), comes_before);
    return firsts;
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
    const evaluation::TakenShapes takes = evaluation::taken_shapes(info.tags);
    std::vector<ShapedBody> shaped(pieces.size());
    for (std::size_t b = 0; b < pieces.size(); ++b)
      for (const ShapePiece& p : pieces[b]) shaped[b].shapes.push_back(p.shape(takes));
    auto scene = guarded(info.name, [&] { return engine->build(shaped, *params, progress); });
    if (!scene.ok()) return std::move(scene).error();
    for (const std::vector<ShapePiece>& of_body : pieces)
      out->covers_.push_back(cover_of(of_body));
    out->provider_ = info.name;
    out->is_script_ = info.is_script;
    out->scene_ = std::move(*scene);
    out->bounds_ =
        static_cast<const CollisionBounds*>(out->scene_->extension(CollisionBounds::kId));
    carriers.resize(out->robots_.size());
    for (const CollisionBody& b : out->bodies_)
      if (b.robot >= 0) carriers[static_cast<std::size_t>(b.robot)].insert(b.joint);

    std::vector<CollisionPair> undecided;
    const auto count = static_cast<std::int32_t>(out->bodies_.size());
    for (std::int32_t a = 0; a < count; ++a)
      for (std::int32_t b = a + 1; b < count; ++b) {
        const CollisionBody &x = out->bodies_[static_cast<std::size_t>(a)],
                            &y = out->bodies_[static_cast<std::size_t>(b)];
        if (!moves_against(x, y)) continue;
        const model::CollisionPairRule* rule = rule_of(x, y);
        if (rule && rule->is_allowed) {
          out->passed_.push_back({{a, b}, PairReason::rule, rule->reason});
        } else if (!rule && are_adjacent(x, y)) {
          out->passed_.push_back({{a, b}, PairReason::adjacent, {}});
        } else {
          out->pairs_.push_back({a, b});
          if (!rule && x.robot == y.robot) undecided.push_back({a, b});
        }
      }
    make_broad_phase(add_forbidden());
    if (!undecided.empty()) RMP_TRY(pass_always(undecided));
    out->checked_ = PairSet(out->bodies_.size(), out->pairs_);
    return std::shared_ptr<const CollisionModel>(std::move(out));
  }

  /// `as_moving`: bodies to be looked at with those that move.
  void make_broad_phase(const std::set<std::int32_t>& as_moving) {
    std::vector<Box> boxes;
    std::vector<bool> moves;
    for (std::size_t b = 0; b < pieces.size(); ++b) {
      Box box = box_of(pieces[b].front());
      for (const ShapePiece& p : pieces[b]) box = around(box, box_of(p));
      boxes.push_back(box);
      moves.push_back(out->bodies_[b].joint >= 0 ||
                      as_moving.contains(static_cast<std::int32_t>(b)));
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

Result<std::shared_ptr<const CollisionModel>> CollisionModel::of_world(const Sources& source,
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

Result<std::shared_ptr<const CollisionModel>> CollisionModel::of_robot(const Sources& source,
                                                                       RobotId id,
                                                                       Progress& progress) {
  Builder b{source, progress};
  const std::string where = source.snapshot.describe(id);
  RMP_TRY(b.add_robot(id, "", {}, {}).in(where));
  return b.finish().in(where);
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

}  // namespace robomosp::collision
