// SPDX-License-Identifier: Apache-2.0
#include "scene/build.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <unordered_map>
#include <utility>

#include "kernel/text.h"
#include "model/placement.h"
#include "motion/cartesian_path.h"
#include "robotics/build_model.h"
#include "robotics/grip.h"
#include "robotics/home.h"
#include "robotics/kinematics.h"
#include "scene/ids.h"
#include "scene/places.h"
#include "scene/tool_ellipsoids.h"
#include "spatial/mass.h"
#include "spatial/pose.h"
#include "spatial/rotation.h"

namespace robomosp::scene {
namespace {

using document::Snapshot;
using evaluation::Drawable;
using render::Item;

/// A scene under construction.
struct Factory {
  const Source& source;
  const Extras& extras;
  Progress& progress;
  Built out;
  std::vector<std::size_t> group_of;  ///< of each item: what moves as one when exploded
  std::size_t groups = 0;

  void add(Item item) {
    out.scene.items.push_back(std::move(item));
    group_of.push_back(groups);
  }
  /// Lengths of triads and the like follow the size of what is shown [m].
  [[nodiscard]] double size() const;
};

render::Appearance appearance_of(const Drawable& d) {
  render::Appearance a{d.colour, static_cast<float>(d.shininess), static_cast<float>(d.metalness)};
  a.ambient = d.ambient;
  a.specular = d.specular;
  a.emission = d.emission;
  // What is left of a solid that could not be made: clear and in the colour of a warning.
  if (d.is_operand) {
    a = render::Appearance{{1.0F, 0.42F, 0.05F, 0.45F}, 0.4F, 0.0F};
    a.emission = {0.25F, 0.06F, 0.0F, 1};
  }
  return a;
}

Item item_of(const Drawable& d, std::uint64_t id, std::string name, const Pose& world_T_parent) {
  Item item;
  item.id = id;
  item.name = std::move(name);
  item.mesh = d.mesh;
  item.pose = spatial::compose(world_T_parent, d.placement);
  item.appearance = appearance_of(d);
  return item;
}

/// Joint values to show: the world's, else the pose "home", else zeros. What the world lacks,
/// since the robot got links after it was placed, is neutral.
std::vector<double> shown_q(const model::Robot& robot, const std::vector<double>& given) {
  if (given.empty()) return robotics::home_joint_values(robot);
  std::vector<double> q = robotics::neutral_coordinates(robot);
  std::copy_n(given.begin(), std::min(given.size(), q.size()), q.begin());
  return q;
}

/// A robot ready to be posed.
struct PosedRobot {
  std::string owner;  ///< for ids and names
  const model::Robot* record = nullptr;
  std::shared_ptr<const RobotModel> model;
  evaluation::RobotBodies bodies;
  std::vector<robotics::LinkFrame> links;
  Pose world_T_mounting, world_T_base;
  mutable std::vector<Pose> joint_frames, link_frames;

  /// world_T_body of every body (base first) and of the tool, for joint values q.
  void pose(std::span<const double> q, std::vector<Pose>& bodies_out, Pose& tool) const {
    robotics::forward_kinematics(*model, q, joint_frames);
    robotics::link_poses(links, joint_frames, link_frames);
    bodies_out.resize(bodies.bodies.size());
    bodies_out[0] = world_T_base;
    for (std::size_t i = 1; i < bodies_out.size(); ++i)
      bodies_out[i] = spatial::compose(world_T_base, link_frames[i - 1]);
    tool = spatial::compose(world_T_base, robotics::tip_pose(*model, 0, joint_frames));
  }
  /// Where something fixed to a joint is in the world, for joint values q.
  [[nodiscard]] Pose place(const robotics::LinkFrame& at, std::span<const double> q) const {
    if (at.joint < 0) return spatial::compose(world_T_base, at.joint_T_link);
    robotics::forward_kinematics(*model, q, joint_frames);
    return spatial::compose(
        world_T_base,
        spatial::compose(joint_frames[static_cast<std::size_t>(at.joint)], at.joint_T_link));
  }
  [[nodiscard]] bool shows(std::size_t body) const {
    return body == 0 || record->links[body - 1].visible;
  }
  [[nodiscard]] std::string body_name(std::size_t body) const {
    return body == 0 ? owner + " base" : owner + " " + record->links[body - 1].name;
  }
  [[nodiscard]] std::uint64_t triad_id() const { return item_id(owner, kToolBody, 0); }
};

Result<PosedRobot> posed_robot(const Source& source, RobotId id, std::string owner,
                               const Pose& world_T_mounting, Progress& progress) {
  const Snapshot& snapshot = source.snapshot;
  evaluation::Derived& derived = source.derived;
  PosedRobot r;
  r.record = snapshot.get(id);
  if (!r.record)
    return error(ErrorCode::stale_handle, "the robot no longer exists", "Add it again.");
  RMP_TRY_ASSIGN(r.model, derived.robot_model(snapshot, id, {0, 0, -9.81}, progress));
  RMP_TRY_ASSIGN(r.bodies, derived.robot_bodies(snapshot, id, progress));
  r.owner = std::move(owner);
  r.links = robotics::link_frames(*r.record);
  r.world_T_mounting = world_T_mounting;
  r.world_T_base = spatial::compose(world_T_mounting, r.model->base);
  r.joint_frames.resize(r.model->joints.size());
  r.link_frames.resize(r.links.size());
  return r;
}

/// Where an object that the robot holds is fixed to it.
Result<robotics::LinkFrame> grip_of(const PosedRobot& robot, const model::Attachment& a) {
  RMP_TRY_ASSIGN(auto at, robotics::grip_frame(*robot.record, *robot.model, a.link));
  at.joint_T_link = spatial::compose(at.joint_T_link, model::pose(a.tool_T_object));
  return at;
}

/// Frame of a place with its name.
void add_frame(Factory& m, std::string_view owner, std::size_t number, const Pose& pose,
               std::string name, double length) {
  m.out.scene.triads.push_back(
      {item_id(owner, kFrameBody, number), pose, length, std::move(name), true});
}

/// The mark of a body given in the frame `world_T_body`; without mass a sentence says so.
void add_mark(Factory& m, const std::string& owner, const std::string& what,
              const MassProperties& mass, const Pose& world_T_body) {
  if (!(mass.mass > 0)) {
    m.out.left_out.push_back(what + " has no mass, so its centre of mass is not shown.");
    return;
  }
  m.out.scene.marks.push_back(
      mass_mark(item_id(owner, kMarkBody, 0), spatial::in_frame(mass, world_T_body)));
}

double reach(const model::Robot& robot) {
  double sum = 0;
  for (const auto& l : robot.links)
    sum += l.origin ? spatial::norm(model::position(*l.origin)) : std::hypot(l.row.a, l.row.d);
  return sum;
}

void add_robot(Factory& m, const PosedRobot& robot, std::span<const double> q) {
  std::vector<Pose> bodies;
  Pose tool;
  robot.pose(q, bodies, tool);
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    if (!robot.shows(b)) continue;
    const auto& parts = robot.bodies.bodies[b];
    for (std::size_t p = 0; p < parts.size(); ++p)
      m.add(item_of(parts[p], item_id(robot.owner, b, p), robot.body_name(b), bodies[b]));
    ++m.groups;
  }
  const double length = std::clamp(0.07 * reach(*robot.record), 0.03, 0.25);
  // An exploded hand is not where the tool's frame is.
  if (!(m.extras.explode > 0)) m.out.scene.triads.push_back({robot.triad_id(), tool, length, {}});
  for (Item& item : tool_ellipsoids(robot.owner, *robot.model, robot.world_T_base,
                                    robot.joint_frames, m.extras.ellipsoids)) {
    m.add(std::move(item));
    ++m.groups;
  }
  if (m.extras.frames) {
    add_frame(m, robot.owner, 0, bodies[0], "base", length);
    for (std::size_t b = 1; b < bodies.size(); ++b)
      add_frame(m, robot.owner, b, bodies[b], robot.record->links[b - 1].name, length);
  }
  if (m.extras.com) {
    std::vector<MassProperties> masses;
    for (std::size_t j = 0; j < robot.model->joints.size(); ++j)
      if (robot.model->joints[j].body.mass > 0)
        masses.push_back(spatial::in_frame(robot.model->joints[j].body, robot.joint_frames[j]));
    const MassProperties all = spatial::combine(masses);
    add_mark(m, robot.owner, "robot " + text::quote(robot.owner), all, robot.world_T_base);
  }
}

Result<void> add_body(Factory& m, AnyId what, const std::string& owner, const std::string& name,
                      const Pose& world_T_body) {
  const auto& [snapshot, derived, registry] = m.source;
  RMP_TRY_ASSIGN(const auto parts, derived.drawables(snapshot, what, m.progress));
  for (std::size_t p = 0; p < parts.size(); ++p) {
    m.add(
        item_of(parts[p], item_id(owner, 0, p), name.empty() ? parts[p].name : name, world_T_body));
    ++m.groups;
    const auto& told = m.out.left_out;
    if (parts[p].is_operand && std::find(told.begin(), told.end(), parts[p].failure) == told.end())
      m.out.left_out.push_back(parts[p].failure);
  }
  const bool is_whole =
      std::none_of(parts.begin(), parts.end(), [](const Drawable& d) { return d.is_operand; });
  if (m.extras.com && is_whole) {
    RMP_TRY_ASSIGN(const auto mass, derived.mass(snapshot, what, m.progress));
    add_mark(m, owner, snapshot.describe(what), mass.mass, world_T_body);
  }
  if (!m.extras.frames) return {};
  const double length = 0.12 * m.size();
  if (const auto* object =
          what.kind == Kind::object ? snapshot.get(ObjectId{what.number}) : nullptr) {
    for (std::size_t i = 0; i < object->parts.size(); ++i)
      add_frame(m, owner, i,
                spatial::compose(world_T_body, model::pose(object->parts[i].placement)),
                object->parts[i].name, length);
  } else if (const auto* solid =
                 what.kind == Kind::solid ? snapshot.get(SolidId{what.number}) : nullptr) {
    std::vector<Pose> solid_T_node;
    for (std::size_t i = 0; i < solid->nodes.size(); ++i) {
      const model::SolidNode& n = solid->nodes[i];
      const Pose placement = model::pose(n.placement);
      solid_T_node.push_back(
          n.parent < 0 || n.is_global
              ? placement
              : spatial::compose(solid_T_node[static_cast<std::size_t>(n.parent)], placement));
      add_frame(m, owner, i, spatial::compose(world_T_body, solid_T_node.back()), n.name, length);
    }
  }
  return {};
}

constexpr std::size_t kLinePoints = 400;

/// The way of a robot's tool along a trajectory that has joint segments.
Result<std::vector<Pose>> tool_way(const Source& source, WorldId world, const PosedRobot& robot,
                                   const std::string& trajectory, Progress& progress) {
  const sim::Simulator simulator{source.registry, source.derived, source.snapshot};
  sim::Run run;
  run.world = world;
  run.robot = robot.owner;
  run.trajectory = trajectory;
  RMP_TRY_ASSIGN(const auto recording, simulator.inverse_kinematics(run, progress));
  const std::size_t dof = robot.model->coordinate_count();
  std::vector<const recording::Column*> columns;
  for (std::size_t j = 0; j < dof; ++j)
    columns.push_back(recording->find("q" + std::to_string(j + 1)));
  std::vector<Pose> out, bodies;
  std::vector<double> q(dof);
  for (std::size_t i = 0; i < recording->rows(); ++i) {
    for (std::size_t j = 0; j < dof; ++j) q[j] = columns[j]->values[i];
    robot.pose(q, bodies, out.emplace_back());
  }
  return out;
}

/// The way that a trajectory of a world describes, with a robot where it moves joints; none where
/// no robot is known for that.
Result<std::vector<Pose>> way_of(const Factory& m, WorldId world,
                                 const model::PlacedTrajectory& placed,
                                 const PosedRobot* joint_robot) {
  const Source& source = m.source;
  const model::Trajectory* record = source.snapshot.get(placed.trajectory);
  if (!record)
    return error(ErrorCode::stale_handle, "the trajectory no longer exists", "Add it again.");
  auto path = motion::Path::build(source.registry, placed.name, *record,
                                  motion::stored_in(source.snapshot));
  if (!path.ok()) {
    if (path.error().code != ErrorCode::unsupported) return std::move(path).error();
    if (!joint_robot) return std::vector<Pose>{};
    return tool_way(source, world, *joint_robot, placed.name, m.progress);
  }
  const auto times = (*path)->sample_times((*path)->duration() / static_cast<double>(kLinePoints));
  std::vector<PathSample> samples(times.size());
  RMP_TRY((*path)->sample(times, samples));
  const Pose world_T_path = model::pose(placed.placement);
  std::vector<Pose> out;
  for (const PathSample& s : samples) out.push_back(spatial::compose(world_T_path, s.pose));
  return out;
}

Result<void> add_trajectory(Factory& m, WorldId world, const model::PlacedTrajectory& placed,
                            const PosedRobot* joint_robot) {
  if (m.extras.paths == ShownPath::none) return {};
  RMP_TRY_ASSIGN(const auto poses, way_of(m, world, placed, joint_robot));
  render::Scene& scene = m.out.scene;
  const std::size_t before = scene.items.size();
  if (!poses.empty()) add_path(scene, placed.name, poses, m.extras.paths);
  if (m.extras.paths >= ShownPath::points)
    add_points(scene, placed.name, *m.source.snapshot.get(placed.trajectory),
               model::pose(placed.placement), motion::stored_in(m.source.snapshot), size_of(poses),
               m.extras.paths >= ShownPath::frames);
  m.group_of.insert(m.group_of.end(), scene.items.size() - before, m.groups++);
  return {};
}

Result<void> add_world(Factory& m, WorldId id) {
  const Snapshot& snapshot = m.source.snapshot;
  const model::World& world = *snapshot.get(id);
  const auto skip = [&](Result<void> done) -> Result<void> {
    if (done.ok() || done.error().code == ErrorCode::cancelled) return done;
    m.out.left_out.push_back(done.error().sentence());
    return {};
  };
  std::vector<PosedRobot> robots;
  std::vector<std::vector<double>> q;
  std::unordered_map<std::string_view, std::size_t> robot_of;
  for (const auto& r : world.robots) {
    auto robot = posed_robot(m.source, r.robot, r.name, model::pose(r.placement), m.progress);
    if (!robot.ok()) {
      RMP_TRY(skip(std::move(robot).error()));
      continue;
    }
    robot_of[r.name] = robots.size();
    const auto given = m.extras.robot_q.find(r.name);
    q.push_back(shown_q(*robot->record, given == m.extras.robot_q.end() ? r.q : given->second));
    robots.push_back(std::move(*robot));
  }
  std::unordered_map<std::string_view, Pose> held;  // world_T_object
  for (const auto& a : world.attachments) {
    const auto at = robot_of.find(a.robot);
    if (at == robot_of.end()) continue;
    auto grip = grip_of(robots[at->second], a);
    if (grip.ok()) held[a.object] = robots[at->second].place(*grip, q[at->second]);
    else RMP_TRY(skip(std::move(grip).error()));
  }
  for (const auto& o : world.objects) {
    const auto at = held.find(o.name);
    RMP_TRY(skip(add_body(m, o.what, "object " + o.name, o.name,
                          at == held.end() ? model::pose(o.placement) : at->second)));
  }
  for (std::size_t i = 0; i < robots.size(); ++i) add_robot(m, robots[i], q[i]);
  const double length = std::clamp(0.08 * m.size(), 0.02, 0.25);
  for (const auto& f : world.frames) m.out.scene.triads.push_back(triad_of(f, length));
  for (const auto& l : world.lights) {
    m.out.scene.lights.push_back(lamp_of(l));
    if (m.extras.frames) m.out.scene.triads.push_back(triad_of(l, length));
  }
  const PosedRobot* joint_robot = robots.size() == 1 ? &robots.front() : nullptr;
  if (const auto at = robot_of.find(m.extras.path_robot); at != robot_of.end())
    joint_robot = &robots[at->second];
  for (const auto& t : world.trajectories) RMP_TRY(skip(add_trajectory(m, id, t, joint_robot)));
  return {};
}

/// Box around items [m]; low > high when there is nothing.
std::array<Vec3, 2> box_of(std::span<const Item> items) {
  constexpr double kInf = std::numeric_limits<double>::infinity();
  std::array<Vec3, 2> box{{{kInf, kInf, kInf}, {-kInf, -kInf, -kInf}}};
  for (const Item& item : items) {
    if (!item.mesh) continue;
    const auto& p = item.mesh->positions;
    for (std::size_t v = 0; v + 2 < p.size(); v += 3) {
      const Vec3 at =
          spatial::transform(item.pose, {static_cast<double>(p[v]), static_cast<double>(p[v + 1]),
                                         static_cast<double>(p[v + 2])});
      for (std::size_t i = 0; i < 3; ++i) {
        box[0][i] = std::min(box[0][i], at[i]);
        box[1][i] = std::max(box[1][i], at[i]);
      }
    }
  }
  return box;
}

Vec3 middle(const std::array<Vec3, 2>& box) {
  return {0.5 * (box[0][0] + box[1][0]), 0.5 * (box[0][1] + box[1][1]),
          0.5 * (box[0][2] + box[1][2])};
}

double diagonal(const std::array<Vec3, 2>& box) {
  return std::max(0.0,
                  std::hypot(box[1][0] - box[0][0], box[1][1] - box[0][1], box[1][2] - box[0][2]));
}

double Factory::size() const {
  const double d = diagonal(box_of(out.scene.items));
  return std::isfinite(d) && d > 0 ? d : 0.1;
}

}  // namespace

void explode(render::Scene& scene, std::span<const std::size_t> group_of, double factor) {
  const auto whole = box_of(scene.items);
  const double size = diagonal(whole);
  if (scene.items.empty() || !std::isfinite(size) || !(size > 0)) return;
  const Vec3 centre = middle(whole);
  std::size_t longest = 0;
  for (std::size_t i = 1; i < 3; ++i)
    if (whole[1][i] - whole[0][i] > whole[1][longest] - whole[0][longest]) longest = i;

  struct Group {
    std::vector<std::size_t> items;
    std::array<Vec3, 2> box{};
    Vec3 shift{};
  };
  std::vector<Group> groups;
  for (std::size_t i = 0; i < scene.items.size(); ++i) {
    if (group_of[i] >= groups.size()) groups.resize(group_of[i] + 1);
    groups[group_of[i]].items.push_back(i);
  }
  std::erase_if(groups, [](const Group& g) { return g.items.empty(); });
  for (Group& g : groups) {
    std::vector<Item> own;
    for (const std::size_t i : g.items) own.push_back(scene.items[i]);
    g.box = box_of(own);
  }
  // Groups that share a middle, in the order of their lengths along the longest axis.
  constexpr double kSamePlace = 0.02;
  std::vector<bool> done(groups.size(), false);
  for (std::size_t a = 0; a < groups.size(); ++a) {
    if (done[a] || groups[a].box[0][0] > groups[a].box[1][0]) continue;
    const Vec3 at = middle(groups[a].box);
    std::vector<std::size_t> together;
    for (std::size_t b = a; b < groups.size(); ++b) {
      if (done[b] || groups[b].box[0][0] > groups[b].box[1][0]) continue;
      const Vec3 other = middle(groups[b].box);
      if (std::hypot(at[0] - other[0], at[1] - other[1], at[2] - other[2]) > kSamePlace * size)
        continue;
      done[b] = true;
      together.push_back(b);
    }
    std::vector<Vec3> way(together.size());
    for (std::size_t k = 0; k < together.size(); ++k)
      for (std::size_t i = 0; i < 3; ++i) way[k][i] = at[i] - centre[i];
    // The one listed first stays; the others come out to either side, each past the one before.
    const auto length = [&](std::size_t k) {
      const auto& box = groups[together[k]].box;
      return box[1][longest] - box[0][longest];
    };
    double up = 0.5 * length(0), down = up;
    for (std::size_t k = 1; k < together.size(); ++k) {
      double& used = k % 2 == 1 ? up : down;
      way[k][longest] += (k % 2 == 1 ? 2.0 : -2.0) * (used + 0.5 * length(k));
      used += length(k);
    }
    for (std::size_t k = 0; k < together.size(); ++k)
      for (std::size_t i = 0; i < 3; ++i) groups[together[k]].shift[i] = factor * way[k][i];
  }
  for (std::size_t n = 0; n < groups.size(); ++n) {
    const Group& g = groups[n];
    if (std::hypot(g.shift[0], g.shift[1], g.shift[2]) < 1e-3 * size) continue;
    for (const std::size_t k : g.items)
      for (std::size_t i = 0; i < 3; ++i) scene.items[k].pose.p[i] += g.shift[i];
    render::Line line;
    line.id = item_id(scene.items[g.items.front()].name, kLineBody + 1, n);
    line.colour = {0.30F, 0.33F, 0.38F, 0.8F};
    line.width = 1.2F;
    const Vec3 from = middle(g.box);
    line.points = {from, {from[0] + g.shift[0], from[1] + g.shift[1], from[2] + g.shift[2]}};
    scene.lines.push_back(std::move(line));
  }
}

Result<Built> build(const Source& source, AnyId id, const Extras& extras, Progress& progress) {
  const model::Record* record = source.snapshot.find(id);
  if (!record)
    return error(ErrorCode::stale_handle, "the record no longer exists", "Open or create one.");
  Factory m{source, extras, progress, {}, {}};
  switch (id.kind) {
    case Kind::world: RMP_TRY(add_world(m, WorldId{id.number})); break;
    case Kind::robot: {
      RMP_TRY_ASSIGN(const PosedRobot robot,
                     posed_robot(source, RobotId{id.number}, record->name, Pose{}, progress));
      add_robot(m, robot, shown_q(*robot.record, extras.q));
      break;
    }
    case Kind::object:
    case Kind::solid: RMP_TRY(add_body(m, id, record->name, {}, Pose{})); break;
    case Kind::material: {
      const auto& material = std::get<model::Material>(record->body);
      render::Appearance look{material.colour, static_cast<float>(material.shininess),
                              static_cast<float>(material.metalness)};
      look.ambient = material.ambient;
      look.specular = material.specular;
      look.emission = material.emission;
      for (Item& item : material_preview(look)) m.add(std::move(item));
      break;
    }
    case Kind::trajectory:
    case Kind::task:
      return error(ErrorCode::invalid_argument,
                   source.snapshot.describe(id) + " has no body to show",
                   "Show the world it is placed in.");
  }
  if (extras.explode > 0) explode(m.out.scene, m.group_of, extras.explode);
  return std::move(m.out);
}

namespace {

/// The items of a placed object.
struct ObjectParts {
  std::vector<std::uint64_t> ids;
  std::vector<Pose> placements;  ///< object_T_item

  void add_poses(const Pose& world_T_object, Playback& playback) const {
    for (const Pose& t : placements) playback.poses.push_back(spatial::compose(world_T_object, t));
  }
};

Result<ObjectParts> parts_of(const Source& source, const model::PlacedObject& placed,
                             Progress& progress) {
  ObjectParts out;
  const std::string where = "object " + text::quote(placed.name);
  RMP_TRY_ASSIGN(const auto parts,
                 source.derived.drawables(source.snapshot, placed.what, progress).in(where));
  for (std::size_t i = 0; i < parts.size(); ++i) {
    out.ids.push_back(item_id("object " + placed.name, 0, i));
    out.placements.push_back(parts[i].placement);
  }
  return out;
}

/// How the bodies and the tool of a robot move along columns `<prefix>q1` and so on.
struct MovingRobot {
  /// Parts of an object that it holds.
  struct Held {
    robotics::LinkFrame at;
    ObjectParts parts;
  };
  PosedRobot robot;
  std::vector<const recording::Column*> q;
  std::vector<Held> held = {};

  void add_ids(Playback& playback) const {
    for (std::size_t b = 0; b < robot.bodies.bodies.size(); ++b)
      for (std::size_t p = 0; robot.shows(b) && p < robot.bodies.bodies[b].size(); ++p)
        playback.ids.push_back(item_id(robot.owner, b, p));
    playback.ids.push_back(robot.triad_id());
    for (const Held& h : held)
      playback.ids.insert(playback.ids.end(), h.parts.ids.begin(), h.parts.ids.end());
  }
  void add_poses(std::size_t row, Playback& playback) {
    sample.resize(q.size());
    for (std::size_t j = 0; j < q.size(); ++j) sample[j] = q[j]->values[row];
    robot.pose(sample, bodies, tool);
    for (std::size_t b = 0; b < bodies.size(); ++b)
      for (std::size_t p = 0; robot.shows(b) && p < robot.bodies.bodies[b].size(); ++p)
        playback.poses.push_back(spatial::compose(bodies[b], robot.bodies.bodies[b][p].placement));
    playback.poses.push_back(tool);
    for (const Held& h : held) h.parts.add_poses(robot.place(h.at, sample), playback);
  }
  std::vector<double> sample = {};
  std::vector<Pose> bodies = {};
  Pose tool = {};
};

/// An object that moves along columns `<name>.x` and so on, as contact physics records them.
struct MovingObject : ObjectParts {
  std::array<const recording::Column*, 7> at{};  ///< recording::kPlaceColumns

  void add_poses(std::size_t row, Playback& playback) const {
    std::array<double, 7> place{};
    for (std::size_t k = 0; k < place.size(); ++k) place[k] = at[k]->values[row];
    ObjectParts::add_poses(recording::pose_of_place(place), playback);
  }
};

Result<std::optional<MovingObject>> moving_object(const Source& source,
                                                  const model::PlacedObject& placed,
                                                  const recording::Recording& recording,
                                                  Progress& progress) {
  MovingObject out;
  for (std::size_t k = 0; k < out.at.size(); ++k) {
    out.at[k] = recording.find(placed.name + recording::kPlaceColumns[k]);
    if (!out.at[k]) return std::optional<MovingObject>{};
  }
  RMP_TRY_ASSIGN(auto parts, parts_of(source, placed, progress));
  static_cast<ObjectParts&>(out) = std::move(parts);
  return std::optional(std::move(out));
}

}  // namespace

Result<Playback> build_playback(const Source& source, WorldId id,
                                const recording::Recording& recording, Progress& progress) {
  const model::World* world = source.snapshot.get(id);
  if (!world)
    return error(ErrorCode::stale_handle, "the world no longer exists", "Open or create one.");
  std::vector<MovingRobot> robots;
  bool is_found = recording.robot.empty();
  for (const model::PlacedRobot& placed : world->robots) {
    // Further robots have their columns under their names.
    const bool is_main = placed.name == recording.robot;
    const std::string prefix = is_main ? "" : placed.name + ".";
    is_found = is_found || is_main;
    if (!is_main && !recording.find(prefix + "q1")) continue;
    RMP_TRY_ASSIGN(PosedRobot robot, posed_robot(source, placed.robot, placed.name,
                                                 model::pose(placed.placement), progress));
    std::vector<const recording::Column*> q;
    for (std::size_t j = 0; j < robot.model->coordinate_count(); ++j) {
      q.push_back(recording.find(prefix + "q" + std::to_string(j + 1)));
      if (!q.back() || (is_main && recording.dof != robot.model->dof()))
        return error(ErrorCode::conflict, "the recording was made from a robot with other joints",
                     "Simulate again.");
    }
    robots.push_back({std::move(robot), std::move(q)});
  }
  if (!is_found)
    return error(ErrorCode::unknown_name,
                 "the world has no robot " + text::quote(recording.robot) + " any more",
                 "Simulate again.");
  std::vector<MovingObject> objects;
  for (const model::PlacedObject& placed : world->objects) {
    RMP_TRY_ASSIGN(auto object, moving_object(source, placed, recording, progress));
    if (object) {
      objects.push_back(std::move(*object));
      continue;
    }
    // What the recording does not tell goes with the robot that holds it.
    const auto a = std::find_if(world->attachments.begin(), world->attachments.end(),
                                [&](const auto& x) { return x.object == placed.name; });
    if (a == world->attachments.end()) continue;
    for (MovingRobot& r : robots) {
      if (r.robot.owner != a->robot) continue;
      RMP_TRY_ASSIGN(const auto at, grip_of(r.robot, *a));
      RMP_TRY_ASSIGN(auto parts, parts_of(source, placed, progress));
      r.held.push_back({at, std::move(parts)});
    }
  }
  Playback playback;
  playback.times = recording.columns.front().values;
  for (const MovingRobot& r : robots) r.add_ids(playback);
  for (const MovingObject& o : objects)
    playback.ids.insert(playback.ids.end(), o.ids.begin(), o.ids.end());
  playback.poses.reserve(playback.times.size() * playback.ids.size());
  for (std::size_t i = 0; i < playback.times.size(); ++i) {
    for (MovingRobot& r : robots) r.add_poses(i, playback);
    for (const MovingObject& o : objects) o.add_poses(i, playback);
  }
  return playback;
}

}  // namespace robomosp::scene
