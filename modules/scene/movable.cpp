// SPDX-License-Identifier: Apache-2.0
#include "scene/movable.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "kernel/text.h"
#include "model/data.h"
#include "model/field_path.h"
#include "model/parametric.h"
#include "model/placement.h"
#include "scene/leaf_parts.h"
#include "scene/posed_robot.h"
#include "spatial/pose.h"

namespace robomosp::scene {
namespace {

constexpr double kSameNumber = 1e-12;     ///< [m, rad or 1] below this a number did not change
constexpr double kPerMetre = 1e12;        ///< picometres
constexpr double kLargestRounded = 1000;  ///< [m] whose picometres are whole numbers
constexpr const char* kPositionParts[] = {".x", ".y", ".z"};

Error nothing_to_move(std::string what, std::string hint) {
  return error(ErrorCode::unsupported, std::move(what), std::move(hint));
}

/// The words of a path: "segments.2.points.1". The name in the middle may contain dots.
std::string_view list_of(std::string_view path) { return path.substr(0, path.find('.')); }
std::string_view name_behind(std::string_view path) {
  const auto dot = path.find('.');
  return dot == std::string_view::npos ? std::string_view() : path.substr(dot + 1);
}

/// The placement in which a trajectory is shown: the one that was seen, else the first; null =
/// none.
const model::PlacedTrajectory* shown_placement(const Frame& frame, AnyId id,
                                               const std::optional<ElementRef>& seen) {
  const auto* world = frame.snapshot && frame.what.kind == Kind::world
                          ? frame.snapshot->get(WorldId{frame.what.number})
                          : nullptr;
  if (!world) return nullptr;
  const model::PlacedTrajectory* found = nullptr;
  for (const model::PlacedTrajectory& each : world->trajectories) {
    if (AnyId(each.trajectory) != id) continue;
    if (!found) found = &each;
    if (seen && seen->member && seen->member->kind == MemberKind::trajectory &&
        seen->member->name == each.name)
      return &each;
  }
  return found;
}

class Finder {
 public:
  Finder(const Frame& frame, AnyId record, std::string_view path,
         const std::optional<ElementRef>& seen)
      : frame_(frame), snapshot_(*frame.snapshot), id_(record), path_(path), seen_(seen) {}

  Result<Movable> find() {
    const model::Record* r = snapshot_.find(id_);
    if (!r) return error(ErrorCode::stale_handle, "the record no longer exists", "Select another.");
    body_ = &r->body;
    content_ = model::content(r->body);
    out_.record = id_;
    if (path_.empty()) return whole();
    switch (id_.kind) {
      case Kind::world: return member();
      case Kind::object: return of_object();
      case Kind::solid: return node();
      case Kind::robot: return of_robot();
      case Kind::trajectory: return of_trajectory();
      default: break;
    }
    return nothing_to_move(snapshot_.describe(id_) + " has no place", "Select what has a place.");
  }

 private:
  /// The member that shows a record.
  Result<Movable> whole() {
    const Member* found = nullptr;
    std::size_t count = 0;
    frame_.for_each_member([&](const MemberPtr& m) {
      if (!m->is_placed || m->what != id_ || m->kind == MemberKind::ghost ||
          m->kind == MemberKind::clearance || m->kind == MemberKind::frame ||
          m->kind == MemberKind::light)
        return;
      ++count;
      const bool is_seen = seen_ && seen_->member && seen_->member->name == m->name;
      if (!found || is_seen) found = m.get();
    });
    if (!found)
      return nothing_to_move(snapshot_.describe(id_) + " cannot be placed by itself here",
                             "Select a part of it, or move it in a world.");
    const char* list = found->kind == MemberKind::robot        ? "robots."
                       : found->kind == MemberKind::trajectory ? "trajectories."
                                                               : "objects.";
    return Finder(frame_, frame_.what, list + found->name, seen_).find();
  }

  Result<Movable> done(const model::Placement& placement, std::string path, std::string label,
                       const Pose& world_T_parent) {
    out_.placement = placement;
    out_.path = std::move(path);
    out_.label = std::move(label);
    out_.world_T_parent = world_T_parent;
    out_.parent_T_own = model::pose(placement);
    if (const model::Parametric* parametric = model::parametric_of(*body_))
      for (const auto& [at, text] : parametric->expressions) {
        const double* number = model::number_in(*body_, at);
        for (std::size_t i = 0; i < 3; ++i) {
          if (number == &placement.position[i]) out_.expressions[i] = text;
          if (number == &placement.angles[i]) out_.expressions[3 + i] = text;
        }
      }
    return std::move(out_);
  }

  /// The path of an element by its name, or by its number where the name leads elsewhere.
  [[nodiscard]] std::string element(std::string_view list, std::size_t i,
                                    const std::string& name) const {
    const std::string by_number = std::string(list) + "." + std::to_string(i + 1);
    const auto at = model::find(content_, by_number + ".position");
    const std::string by_name = std::string(list) + "." + name;
    const auto same = model::find(content_, by_name + ".position");
    return at && same && at->data == same->data ? by_name : by_number;
  }
  /// The index that a name or a number has in a list; its size if it has none.
  template <class List>
  static std::size_t place_in(const List& list, std::string_view name) {
    std::size_t i = 0;
    for (const auto& each : list) {
      if (each.name == name) return i;
      ++i;
    }
    const auto number = text::read_int(name);
    return number && *number >= 1 ? std::min<std::size_t>(list.size(), *number - 1) : list.size();
  }
  [[nodiscard]] Error missing() const {
    return error(ErrorCode::unknown_name,
                 snapshot_.describe(id_) + " has no " + text::quote(std::string(path_)),
                 "It was renamed or removed; select it again.");
  }
  [[nodiscard]] Error not_shown(const std::string& what) const {
    return nothing_to_move(what + " is not in this picture",
                           "Open a view of its record, or of a world that shows it.");
  }

  Result<Movable> member() {
    const auto* world = snapshot_.get(WorldId{id_.number});
    const std::string_view list = list_of(path_), name = name_behind(path_);
    const auto placed = [&](const auto& members, const char* kind) -> Result<Movable> {
      const std::size_t i = place_in(members, name);
      if (i >= members.size()) return missing();
      return done(members[i].placement, element(list, i, members[i].name),
                  std::string(kind) + " " + text::quote(members[i].name), {});
    };
    if (list == "objects") {
      for (std::size_t i = 0; i < world->attachments.size(); ++i)
        if (world->attachments[i].object == name) return held(*world, i);
      return placed(world->objects, "object");
    }
    if (list == "robots") return placed(world->robots, "robot");
    if (list == "trajectories") return placed(world->trajectories, "trajectory");
    if (list == "frames") return placed(world->frames, "frame");
    if (list == "lights") return placed(world->lights, "light");
    return nothing_to_move("a member of the " + std::string(list) + " of a world has no place",
                           "Select an object, robot, trajectory, frame or light.");
  }
  /// An object in the hand of a robot moves in the hand.
  Result<Movable> held(const model::World& world, std::size_t i) {
    const model::Attachment& a = world.attachments[i];
    for (const MemberPtr& m : frame_.bodies)
      if (m->is_placed && m->name == a.object && !m->bodies.empty())
        return done(
            a.tool_T_object, "attachments." + std::to_string(i + 1),
            "object " + text::quote(a.object) + " in the hand of " + text::quote(a.robot),
            spatial::compose(m->world_T(0), spatial::inverse(model::pose(a.tool_T_object))));
    return not_shown("object " + text::quote(a.object));
  }

  /// Calls see(world_T_solid, leaf) for the solids drawn, until one is wanted; first the seen one.
  template <class See>
  bool each_leaf(See&& see) const {
    const auto look = [&](const Member& m, const Element<render::Item>& e) {
      if (e.of.leaf < 0) return false;
      const Pose world_T_solid = spatial::compose(m.world_T(e.body), e.what.pose);
      const AnyId outer = outer_of(m, e.of);
      const auto& leaves = leaves_of(outer);
      const auto i = static_cast<std::size_t>(e.of.leaf);
      return i < leaves.size() && see(world_T_solid, leaves[i]);
    };
    if (seen_ && seen_->member && seen_->kind == ElementKind::item) {
      const ShapePtr& shape = seen_->member->shape(seen_->layer);
      if (shape && seen_->index < shape->items.size() &&
          look(*seen_->member, shape->items[seen_->index]))
        return true;
    }
    bool is_found = false;
    frame_.for_each_member([&](const MemberPtr& m) {
      const ShapePtr& shape = m->shape(ShapeLayer::bodies);
      if (is_found || !shape || m->kind == MemberKind::ghost) return;
      for (const auto& e : shape->items)
        if (!is_found) is_found = look(*m, e);
    });
    return is_found;
  }
  [[nodiscard]] AnyId outer_of(const Member& m, const PartOf& of) const {
    if (m.what.kind != Kind::robot) return m.what;
    const auto* robot = snapshot_.get(RobotId{m.what.number});
    if (!robot) return {};
    if (of.tool >= 0)
      return static_cast<std::size_t>(of.tool) < robot->attached.size()
                 ? robot->attached[static_cast<std::size_t>(of.tool)].what
                 : AnyId{};
    if (of.link < 0 || static_cast<std::size_t>(of.link) > robot->links.size()) return {};
    const auto& parts = of.link == 0 ? robot->base_parts
                                     : robot->links[static_cast<std::size_t>(of.link - 1)].parts;
    return of.part >= 0 && static_cast<std::size_t>(of.part) < parts.size()
               ? parts[static_cast<std::size_t>(of.part)].what
               : AnyId{};
  }
  const std::vector<LeafPart>& leaves_of(AnyId outer) const {
    for (const auto& [id, leaves] : leaves_)
      if (id == outer) return leaves;
    leaves_.emplace_back(outer, leaf_parts(snapshot_, outer));
    return leaves_.back().second;
  }

  /// Where an object is that is shown itself, or within another one.
  [[nodiscard]] std::optional<Pose> world_T_object(ObjectId object) const {
    std::optional<Pose> out;
    each_leaf([&](const Pose& world_T_solid, const LeafPart& leaf) {
      for (std::size_t s = 0; s < leaf.steps.size(); ++s) {
        if (leaf.steps[s].object != object) continue;
        Pose object_T_solid;
        for (std::size_t k = s; k < leaf.steps.size(); ++k) {
          const auto* o = snapshot_.get(leaf.steps[k].object);
          const auto part = static_cast<std::size_t>(leaf.steps[k].part);
          if (!o || part >= o->parts.size()) return false;
          object_T_solid = spatial::compose(object_T_solid, model::pose(o->parts[part].placement));
        }
        out = spatial::compose(world_T_solid, spatial::inverse(object_T_solid));
        return true;
      }
      return false;
    });
    return out;
  }

  Result<Movable> of_object() {
    const ObjectId object{id_.number};
    const auto* o = snapshot_.get(object);
    const std::string_view list = list_of(path_), name = name_behind(path_);
    const bool is_part = list == "parts";
    if (!is_part && list != "tcps")
      return nothing_to_move(text::quote(std::string(path_)) + " has no place",
                             "Select a part or a centre point.");
    const std::size_t i = is_part ? place_in(o->parts, name) : place_in(o->tcps, name);
    if (i >= (is_part ? o->parts.size() : o->tcps.size())) return missing();
    const auto at = world_T_object(object);
    if (!at) return not_shown(snapshot_.describe(id_));
    if (is_part)
      return done(o->parts[i].placement, element(list, i, o->parts[i].name),
                  "part " + text::quote(o->parts[i].name), *at);
    return done(o->tcps[i].placement, element(list, i, o->tcps[i].name),
                "centre point " + text::quote(o->tcps[i].name), *at);
  }

  Result<Movable> node() {
    const SolidId solid{id_.number};
    const auto* s = snapshot_.get(solid);
    const std::size_t i = place_in(s->nodes, name_behind(path_));
    if (list_of(path_) != "nodes" || i >= s->nodes.size()) return missing();
    std::optional<Pose> world_T_solid;
    each_leaf([&](const Pose& pose, const LeafPart& leaf) {
      if (leaf.solid != solid) return false;
      world_T_solid = pose;
      return true;
    });
    if (!world_T_solid) return not_shown(snapshot_.describe(id_));
    Pose solid_T_parent;
    if (!s->nodes[i].is_global)
      for (std::int32_t at = s->nodes[i].parent; at >= 0;) {
        const model::SolidNode& n = s->nodes[static_cast<std::size_t>(at)];
        solid_T_parent = spatial::compose(model::pose(n.placement), solid_T_parent);
        at = n.is_global ? -1 : n.parent;
      }
    return done(s->nodes[i].placement, element("nodes", i, s->nodes[i].name),
                "node " + text::quote(s->nodes[i].name),
                spatial::compose(*world_T_solid, solid_T_parent));
  }

  /// The member that shows the robot: the seen one, else the first.
  [[nodiscard]] const Member* shown_robot() const {
    if (seen_ && seen_->member && seen_->member->what == id_ &&
        seen_->member->kind == MemberKind::robot)
      return seen_->member.get();
    for (const MemberPtr& m : frame_.robots)
      if (m->what == id_ && m->kind == MemberKind::robot) return m.get();
    return nullptr;
  }

  Result<Movable> of_robot() {
    const auto* robot = snapshot_.get(RobotId{id_.number});
    const Member* m = shown_robot();
    if (!m || m->bodies.size() != robot->links.size() + 2)
      return not_shown(snapshot_.describe(id_));
    const auto body = [&](std::int32_t link) {
      return m->bodies[static_cast<std::size_t>(link + 1)];
    };
    const std::string_view list = list_of(path_), name = name_behind(path_);
    if (path_ == "tool") {
      if (!robot->tcp.empty())
        return nothing_to_move("the tool of the robot is the centre point " +
                                   text::quote(robot->tcp) + " of an attached tool",
                               "Move the attached tool, or the centre point in its object.");
      const auto last = static_cast<std::int32_t>(robot->links.size()) - 1;
      return done(robot->tool, "tool", "tool", body(last));
    }
    if (list == "tools") {
      const std::size_t i = place_in(robot->tools, name);
      if (i >= robot->tools.size()) return missing();
      return done(robot->tools[i].placement, element(list, i, robot->tools[i].name),
                  "tool " + text::quote(robot->tools[i].name), body(robot->tools[i].link));
    }
    if (list == "attached") {
      const std::size_t i = place_in(robot->attached, name);
      if (i >= robot->attached.size()) return missing();
      return done(robot->attached[i].placement, element(list, i, robot->attached[i].name),
                  "tool " + text::quote(robot->attached[i].name), body(robot->attached[i].link));
    }
    if (list == "links" && m->is_placed) return movable_tool(frame_, m->name);
    return nothing_to_move(text::quote(std::string(path_)) + " of a robot is moved by its joints",
                           "In a world, select the link to move the tool; here, edit its row.");
  }

  Result<Movable> of_trajectory() {
    const auto* t = snapshot_.get(TrajectoryId{id_.number});
    const model::PlacedTrajectory* placed = shown_placement(frame_, id_, seen_);
    if (!placed) return not_shown(snapshot_.describe(id_));
    if (t->along)
      return nothing_to_move("the points of the trajectory follow edges of a solid",
                             "Edit the edges, or the trajectory's `along`.");
    // "segments.2" or "segments.2.points.1".
    std::array<std::size_t, 2> number{0, 0};
    std::size_t k = 0;
    for (const std::string_view word : text::split(path_, '.'))
      if (const auto n = text::read_int(word); n && k < 2)
        number[k++] = *n < 0 ? 0 : static_cast<std::size_t>(*n);
    if (number[0] == 0 || number[0] > t->segments.size()) return missing();
    const auto& segment = t->segments[number[0] - 1];
    const std::string base = "segments." + std::to_string(number[0]);
    const Pose world_T_trajectory = model::pose(placed->placement);
    if (segment.stored)
      return done(segment.placement, base, "segment " + std::to_string(number[0]),
                  world_T_trajectory);
    if (segment.points.empty())
      return nothing_to_move(
          "segment " + std::to_string(number[0]) + " moves joints, and has no points in space",
          "Edit its joint values.");
    const std::size_t p = number[1] == 0 ? segment.points.size() : number[1];
    if (p > segment.points.size()) return missing();
    return done(segment.points[p - 1], base + ".points." + std::to_string(p),
                "point " + std::to_string(p) + " of segment " + std::to_string(number[0]),
                world_T_trajectory);
  }

  const Frame& frame_;
  const document::Snapshot& snapshot_;
  AnyId id_;
  std::string path_;
  const std::optional<ElementRef>& seen_;
  const model::Body* body_ = nullptr;
  model::Content content_;
  mutable std::vector<std::pair<AnyId, std::vector<LeafPart>>> leaves_;
  Movable out_;
};

/// The position in the coordinates of a placement.
Vec3 written(const Vec3& p, const model::Placement& placement) {
  const double r = std::hypot(p[0], p[1]);
  // The angle about z is not defined on the axis: keep it.
  const double about = r > kSameNumber ? std::atan2(p[1], p[0]) : placement.position[1];
  switch (placement.coordinates) {
    case model::PositionRepresentation::cylindrical: return {r, about, p[2]};
    case model::PositionRepresentation::spherical:
      return {std::hypot(r, p[2]), about, std::atan2(r, p[2])};
    case model::PositionRepresentation::cartesian: break;
  }
  // Sums of offsets leave residues in the last digits: round to picometres. The quotient of two
  // whole numbers is the nearest number to a decimal fraction.
  Vec3 out = p;
  for (double& x : out)
    if (std::fabs(x) < kLargestRounded) x = std::round(x * kPerMetre) / kPerMetre;
  return out;
}

}  // namespace

Pose Movable::world_T_own() const { return spatial::compose(world_T_parent, parent_T_own); }

Result<Movable> movable(const Frame& frame, AnyId record, std::string_view path,
                        const std::optional<ElementRef>& seen) {
  if (!frame.snapshot || !frame.is_there)
    return nothing_to_move("the view shows no record", "Open one.");
  return Finder(frame, record, path, seen).find();
}

Result<Movable> movable_tool(const Frame& frame, std::string_view member) {
  const auto* world = frame.snapshot && frame.what.kind == Kind::world
                          ? frame.snapshot->get(WorldId{frame.what.number})
                          : nullptr;
  for (std::size_t i = 0; world && i < world->robots.size(); ++i) {
    const model::PlacedRobot& placed = world->robots[i];
    if (placed.name != member) continue;
    const auto* robot = frame.snapshot->get(placed.robot);
    for (const MemberPtr& m : frame.robots) {
      if (!robot || m->name != member || m->kind != MemberKind::robot || m->bodies.empty())
        continue;
      Movable out;
      out.record = frame.what;
      out.label = "tool of robot " + text::quote(placed.name);
      out.parent_T_own = m->bodies.back();
      out.joints = Movable::Joints{AnyId(placed.robot), placed.name, model::pose(placed.placement),
                                   shown_q(*robot, placed.q)};
      return out;
    }
  }
  return nothing_to_move("the picture shows no robot " + text::quote(std::string(member)),
                         "Select a robot of the world.");
}

std::vector<ControlPoint> control_points(const Frame& frame, AnyId id,
                                         const std::optional<ElementRef>& seen) {
  std::vector<ControlPoint> out;
  const auto* t = frame.snapshot && id.kind == Kind::trajectory
                      ? frame.snapshot->get(TrajectoryId{id.number})
                      : nullptr;
  const model::PlacedTrajectory* placed = t ? shown_placement(frame, id, seen) : nullptr;
  if (!placed) return out;
  const Pose world_T_trajectory = model::pose(placed->placement);
  for (std::size_t s = 0; s < t->segments.size(); ++s) {
    const auto& points = t->segments[s].points;
    for (std::size_t p = 0; p < points.size(); ++p) {
      const std::string which = p == 0                   ? "start"
                                : p + 1 == points.size() ? "end"
                                                         : "through " + std::to_string(p);
      out.push_back({"segments." + std::to_string(s + 1) + ".points." + std::to_string(p + 1),
                     "segment " + std::to_string(s + 1) + ", " + which,
                     spatial::transform(world_T_trajectory, model::position(points[p]))});
    }
  }
  return out;
}

Result<std::vector<Assignment>> assignments(const Movable& m, const Pose& world_T_own) {
  const Pose now = spatial::compose(spatial::inverse(m.world_T_parent), world_T_own);
  std::vector<Assignment> out;
  std::array<bool, 6> differs{};
  double apart = 0;
  for (std::size_t i = 0; i < 3; ++i)
    apart = std::max(apart, std::fabs(now.p[i] - m.parent_T_own.p[i]));
  const Vec3 position = written(now.p, m.placement);
  if (apart > kSameNumber)
    for (std::size_t i = 0; i < 3; ++i)
      differs[i] = std::fabs(position[i] - m.placement.position[i]) > kSameNumber;
  double turned = 0;
  for (std::size_t i = 0; i < 9; ++i)
    turned = std::max(turned, std::fabs(now.R[i] - m.parent_T_own.R[i]));
  const Vec3 angles = model::placement(now, m.placement.notation).angles;
  if (turned > kSameNumber)
    for (std::size_t i = 0; i < 3; ++i)
      differs[3 + i] = std::fabs(angles[i] - m.placement.angles[i]) > kSameNumber;
  for (std::size_t i = 0; i < 6; ++i)
    if (differs[i] && !m.expressions[i].empty())
      return error(ErrorCode::conflict,
                   m.label + ": the expression " + text::quote(m.expressions[i]) + " gives its " +
                       (i < 3 ? "position" : "angles"),
                   "Change its parameters, or replace the expression by a number first.", m.path);
  const auto put = [&](std::size_t first, const std::string& name, const Vec3& value,
                       const Vec3& was) {
    std::size_t count = 0;
    bool has_expression = false;
    Vec3 all = was;
    for (std::size_t i = 0; i < 3; ++i) {
      count += differs[first + i];
      has_expression = has_expression || !m.expressions[first + i].empty();
      if (differs[first + i]) all[i] = value[i];
    }
    if (count == 0) return;
    if (count == 3 || !has_expression) {
      out.push_back({name, Value(List{all[0], all[1], all[2]})});
      return;
    }
    // Numbers with expressions stay as they are.
    for (std::size_t i = 0; i < 3; ++i)
      if (differs[first + i]) out.push_back({name + kPositionParts[i], Value(all[i])});
  };
  put(0, m.path + ".position", position, m.placement.position);
  put(3, m.path + "." + std::string(model::word_of(m.placement.notation)), angles,
      m.placement.angles);
  return out;
}

}  // namespace robomosp::scene
