// SPDX-License-Identifier: Apache-2.0
#include "scene/origin.h"

#include <algorithm>
#include <utility>

#include "model/data.h"
#include "model/field_path.h"
#include "scene/leaf_parts.h"

namespace robomosp::scene {
namespace {

/// An element, whatever its kind.
struct Seen {
  std::int32_t body = 0;
  PartOf of;
};

class Trace {
 public:
  Trace(const Frame& frame, const Member& member)
      : snapshot_(*frame.snapshot), member_(member), world_(frame.what) {}

  /// The member in its world. `field` as lists of worlds are called.
  void member(const char* list, const char* leaf) {
    if (!member_.is_placed) return;
    // A ghost has its number behind the robot's name.
    out.member = member_.kind == MemberKind::ghost ? member_.name.substr(0, member_.name.rfind(' '))
                 : member_.kind == MemberKind::clearance ? member_.begins_at
                                                         : member_.name;
    if (snapshot_.get(WorldId{world_.number})) add(world_, element(world_, list, out.member, leaf));
  }
  /// An object in the world: the place in the hand of a robot that holds it, else its own.
  void object() {
    const model::World* world = member_.is_placed ? snapshot_.get(WorldId{world_.number}) : nullptr;
    const std::string& name =
        member_.kind == MemberKind::clearance ? member_.begins_at : member_.name;
    for (std::size_t i = 0; world && i < world->attachments.size(); ++i) {
      if (world->attachments[i].object != name) continue;
      out.member = name;
      add(world_, checked(world_, "attachments." + std::to_string(i + 1) + ".position"));
      return;
    }
    member("objects", "position");
  }
  void add(AnyId record, std::string path) {
    if (!path.empty()) out.steps.push_back({record, std::move(path)});
  }
  /// Down to a solid within a solid or object; `leaf` -1 = only to its first part.
  void into_body(AnyId what, std::int32_t leaf, std::int32_t part, std::int32_t node) {
    if (leaf >= 0) {
      const auto leaves = leaf_parts(snapshot_, what);
      if (static_cast<std::size_t>(leaf) >= leaves.size()) return;
      const LeafPart& at = leaves[static_cast<std::size_t>(leaf)];
      for (const LeafPart::Step& step : at.steps) into_part(step.object, step.part);
      into_node(at.solid, node);
      return;
    }
    if (what.kind == Kind::object && part >= 0) into_part(ObjectId{what.number}, part);
    if (what.kind == Kind::object && part < 0) into_object(ObjectId{what.number});
    if (what.kind == Kind::solid) into_node(SolidId{what.number}, node);
  }
  void into_robot(RobotId id, const Seen& e) {
    const model::Robot* robot = snapshot_.get(id);
    if (!robot) return;
    const AnyId record(id);
    if (e.of.tool >= 0 && static_cast<std::size_t>(e.of.tool) < robot->attached.size()) {
      const auto& tool = robot->attached[static_cast<std::size_t>(e.of.tool)];
      name_link(*robot, e.of.link);
      add(record, numbered(record, "attached", e.of.tool, "position"));
      out.part = tool.name;
      into_body(tool.what, e.of.leaf, -1, -1);
    } else if (e.of.link >= 0) {
      name_link(*robot, e.of.link);
      const bool is_base = e.of.link == 0;
      const auto& parts =
          is_base ? robot->base_parts : robot->links[static_cast<std::size_t>(e.of.link - 1)].parts;
      const bool has_part = e.of.part >= 0 && static_cast<std::size_t>(e.of.part) < parts.size();
      add(record, link_path(*robot, record, e.of.link, has_part ? e.of.part : -1));
      if (has_part) into_body(parts[static_cast<std::size_t>(e.of.part)].what, e.of.leaf, -1, -1);
    } else {
      // The tool, or what the robot as a whole has.
      add(record, robot->tcp.empty() ? "tool.position" : "tcp");
    }
  }
  void into_trajectory(TrajectoryId id, const PartOf& of, std::int32_t segment) {
    const model::Trajectory* t = snapshot_.get(id);
    if (!t) return;
    if (segment < 0 && t->segments.size() == 1) segment = 0;
    if (segment < 0 || static_cast<std::size_t>(segment) >= t->segments.size()) {
      add(AnyId(id), "segments");
      return;
    }
    out.segment = static_cast<std::size_t>(segment) + 1;
    const auto& s = t->segments[static_cast<std::size_t>(segment)];
    std::string path = "segments." + std::to_string(out.segment);
    if (of.point >= 0) {
      out.point = static_cast<std::size_t>(of.point) + 1;
      path += ".points." + std::to_string(out.point) + ".position";
    } else if (s.stored) {
      path += ".stored";
    } else {
      path += s.joints.empty() ? ".points" : ".joints";
    }
    add(AnyId(id), std::move(path));
  }

  Origin out;

 private:
  [[nodiscard]] model::Content content(AnyId id) const {
    const model::Record* record = snapshot_.find(id);
    return record ? model::content(record->body) : model::Content{};
  }
  /// A path that leads somewhere; "" else.
  [[nodiscard]] std::string checked(AnyId id, std::string path) const {
    const model::Content c = content(id);
    return c.data && model::find(c, path) ? path : std::string();
  }
  /// The path of element `i` of a list, by its name where that leads to the same place.
  [[nodiscard]] std::string named(AnyId id, const std::string& list, std::size_t i,
                                  const std::string& name, const std::string& leaf) const {
    const model::Content c = content(id);
    if (!c.data) return {};
    const auto at = model::find(c, list + "." + std::to_string(i + 1) + "." + leaf);
    if (!at) return {};
    for (const std::string& path : {name + "." + leaf, list + "." + name + "." + leaf})
      if (const auto same = model::find(c, path); same && same->data == at->data) return path;
    return list + "." + std::to_string(i + 1) + "." + leaf;
  }
  [[nodiscard]] std::string numbered(AnyId id, const std::string& list, std::int32_t i,
                                     const std::string& leaf) const {
    return checked(id, list + "." + std::to_string(i + 1) + "." + leaf);
  }
  [[nodiscard]] std::string element(AnyId world, const std::string& list, const std::string& name,
                                    const std::string& leaf) const {
    const auto* w = snapshot_.get(WorldId{world.number});
    const auto place = [&](const auto& members) {
      for (std::size_t i = 0; i < members.size(); ++i)
        if (members[i].name == name) return i;
      return members.size();
    };
    const std::size_t i = list == "objects"        ? place(w->objects)
                          : list == "robots"       ? place(w->robots)
                          : list == "trajectories" ? place(w->trajectories)
                          : list == "frames"       ? place(w->frames)
                                                   : place(w->lights);
    return named(world, list, i, name, leaf);
  }
  void name_link(const model::Robot& robot, std::int32_t link) {
    out.link = link == 0 ? "base" : robot.links[static_cast<std::size_t>(link - 1)].name;
  }
  [[nodiscard]] std::string link_path(const model::Robot& robot, AnyId id, std::int32_t link,
                                      std::int32_t part) const {
    if (link == 0) return part < 0 ? "base.position" : numbered(id, "base_parts", part, "position");
    const auto i = static_cast<std::size_t>(link - 1);
    const model::Link& l = robot.links[i];
    if (part >= 0)
      return named(id, "links", i, l.name, "parts." + std::to_string(part + 1) + ".position");
    if (l.origin) return named(id, "links", i, l.name, "origin.position");
    return named(id, "links", i, l.name, "a");
  }
  void into_object(ObjectId id) {
    const auto* object = snapshot_.get(id);
    if (object && !object->parts.empty()) add(AnyId(id), "parts");
    else add(AnyId(id), "description");
  }
  void into_part(ObjectId id, std::int32_t part) {
    const auto* object = snapshot_.get(id);
    if (!object || static_cast<std::size_t>(part) >= object->parts.size()) return;
    const std::string& name = object->parts[static_cast<std::size_t>(part)].name;
    out.part += (out.part.empty() ? "" : ".") + name;
    add(AnyId(id), named(AnyId(id), "parts", static_cast<std::size_t>(part), name, "position"));
  }
  /// To a node of a solid; -1 = to its root.
  void into_node(SolidId id, std::int32_t node) {
    const auto* solid = snapshot_.get(id);
    if (!solid || solid->nodes.empty()) return;
    const auto i = static_cast<std::size_t>(std::max(node, 0));
    if (i >= solid->nodes.size()) return;
    out.node = solid->nodes[i].name;
    add(AnyId(id), named(AnyId(id), "nodes", i, solid->nodes[i].name, "position"));
  }

  const document::Snapshot& snapshot_;
  const Member& member_;
  AnyId world_;
};

Error no_primitive(std::size_t primitive, const char* what, std::size_t count) {
  return error(ErrorCode::invalid_argument,
               std::string(what) + " " + std::to_string(primitive + 1) +
                   " was picked, but there are " + std::to_string(count),
               "Pick in the frame that was drawn.");
}

}  // namespace

Result<Origin> pick(const Frame& frame, const ElementRef& ref,
                    std::optional<std::size_t> primitive) {
  if (!ref.member || !ref.member->shape(ref.layer) || !frame.snapshot)
    return error(ErrorCode::invalid_argument, "nothing was picked", "Pick something drawn.");
  const Member& m = *ref.member;
  const Shape& shape = *m.shape(ref.layer);
  std::optional<Seen> seen;
  for_each_list(shape, [&](ElementKind kind, const auto& list) {
    if (kind == ref.kind && ref.index < list.size())
      seen = Seen{list[ref.index].body, list[ref.index].of};
  });
  if (!seen) return no_primitive(ref.index, "element", 0);
  Trace trace(frame, m);
  std::int32_t segment = seen->of.segment;
  if (primitive && ref.kind == ElementKind::item) {
    const Mesh& mesh = *shape.items[ref.index].what.mesh;
    if (*primitive >= mesh.triangle_count())
      return no_primitive(*primitive, "triangle", mesh.triangle_count());
    for (const Mesh::Face& face : mesh.faces)
      if (*primitive >= face.first_triangle &&
          *primitive < std::size_t{face.first_triangle} + face.triangle_count)
        trace.out.face = face.id;
  }
  if (primitive && ref.kind == ElementKind::line) {
    const std::size_t points = shape.lines[ref.index].what.points.size();
    if (*primitive + 1 >= points)
      return no_primitive(*primitive, "piece", points > 0 ? points - 1 : 0);
    if (ref.index < shape.segments.size() && *primitive < shape.segments[ref.index].size())
      segment = shape.segments[ref.index][*primitive];
  }
  switch (m.kind) {
    case MemberKind::body:
      trace.object();
      trace.into_body(m.what, seen->of.leaf, seen->of.part, seen->of.node);
      break;
    case MemberKind::robot:
    case MemberKind::ghost:
      trace.member("robots", "position");
      trace.into_robot(RobotId{m.what.number}, *seen);
      break;
    case MemberKind::trajectory:
      trace.member("trajectories", "position");
      trace.into_trajectory(TrajectoryId{m.what.number}, seen->of, segment);
      break;
    case MemberKind::frame: trace.member("frames", "position"); break;
    case MemberKind::light: trace.member("lights", "position"); break;
    case MemberKind::material: trace.add(m.what, "colour"); break;
    case MemberKind::clearance:
      if (m.what.kind == Kind::robot) {
        trace.member("robots", "position");
        trace.into_robot(RobotId{m.what.number}, *seen);
      } else {
        trace.object();
        trace.into_body(m.what, -1, -1, -1);
      }
      break;
  }
  if (trace.out.steps.empty())
    return error(ErrorCode::not_found, "the records behind what was picked are no longer there",
                 "Pick again in the newest frame.");
  trace.out.record = trace.out.steps.back().record;
  trace.out.path = trace.out.steps.back().path;
  return std::move(trace.out);
}

std::string name_of(const Frame& frame, AnyId id) {
  const model::Record* record = frame.snapshot ? frame.snapshot->find(id) : nullptr;
  return record ? record->name : std::string();
}

void for_each_element(const Frame& frame, const std::function<void(const ElementRef&)>& see) {
  frame.for_each_member([&](const MemberPtr& member) {
    for (std::size_t layer = 0; layer < kShapeLayers; ++layer) {
      if (!member->shapes[layer]) continue;
      for_each_list(*member->shapes[layer], [&](ElementKind kind, const auto& list) {
        for (std::size_t i = 0; i < list.size(); ++i)
          see({kind, static_cast<ShapeLayer>(layer), static_cast<std::uint32_t>(i), member});
      });
    }
  });
}

std::optional<ElementRef> find_element(const Frame& frame, std::uint64_t id) {
  std::optional<ElementRef> found;
  for_each_element(frame, [&](const ElementRef& ref) {
    if (!found && id_of(ref) == id) found = ref;
  });
  return found;
}

}  // namespace robomosp::scene
