// SPDX-License-Identifier: Apache-2.0
#include "model/field_types.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "kernel/text.h"
#include "kernel/type.h"
#include "model/records.h"

namespace robomosp::model {
namespace {

/// In order of kinds and paths. A field with a function `counts` has its condition here in words;
/// a test compares the two.
constexpr FieldNote kFieldNotes[] = {
    {"robot", "links.parent", "member:link_or_base of id or int",
     "Number or name of its parent link, \"base\" for the base; by default the link before."},
    {"robot", "links.joint", "",
     "Type of motion. universal: rotates about z, then the new x; cylindrical: slides along z and "
     "rotates about it; planar: slides along x and y, rotates about z; spherical: a ball joint; "
     "free: all six."},
    {"robot", "links.row", "@group(Place in the parent) @when(origin is absent)"},
    {"robot", "links.row.d", "", "Link offset; the value of a prismatic joint is added to it."},
    {"robot", "links.row.theta", "", "Joint angle; the value of a revolute joint is added to it."},
    {"robot", "links.convention", "@group(Place in the parent) @when(origin is absent)",
     "Convention of this row; by default that of the robot."},
    {"robot", "links.origin", "@group(Place in the parent)",
     "Instead of a row: placement of the link in its parent link's frame at joint value 0: a "
     "position such as {0.1, 0, 0}, a pose, or {position = ..., rpy = ...}. false returns to the "
     "row."},
    {"robot", "links.axis", "@group(Place in the parent) @when(origin is present)",
     "With an origin: the joint's axis in the link's frame; {0, 0, 1} if omitted."},
    {"robot", "links.mimic", "",
     "The joint follows another one: {link = ..., ratio = 1, offset = 0}; its value is ratio times "
     "the other value plus offset. false makes it independent."},
    {"robot", "links.passive", "", "The joint has no motor: springs, gravity or a loop move it."},
    {"robot", "links.lower", "@group(Limits)"},
    {"robot", "links.upper", "@group(Limits)"},
    {"robot", "links.max_velocity", "@group(Limits)"},
    {"robot", "links.max_acceleration", "@group(Limits)"},
    {"robot", "links.max_jerk", "@group(Limits)"},
    {"robot", "links.max_force", "@group(Limits)",
     "Greatest torque or force of the joint, at the output of the gear."},
    {"robot", "links.drive", "@group(Drive)"},
    {"robot", "links.drive.motor_inertia", "",
     "Jm, inertia of the rotor at the motor; gear_ratio^2 Jm at the joint."},
    {"robot", "links.drive.gear_ratio", "",
     "G, revolutions of the motor per revolution of the joint (radians per metre for a prismatic "
     "one); negative if the motor turns against the joint."},
    {"robot", "links.drive.viscous", "",
     "B, viscous friction at the motor; gear_ratio^2 B at the joint."},
    {"robot", "links.drive.coulomb_positive", "",
     "Tc+, not below 0: Coulomb friction at the motor while the velocity of the joint is positive, "
     "whatever the sign of gear_ratio; abs(gear_ratio) Tc+ at the joint."},
    {"robot", "links.drive.coulomb_negative", "",
     "Tc-, not above 0: Coulomb friction at the motor while the velocity of the joint is negative, "
     "whatever the sign of gear_ratio; abs(gear_ratio) Tc- at the joint."},
    {"robot", "links.spring", "@group(Drive) @advanced"},
    {"robot", "links.given", "@group(Mass)"},
    {"robot", "links.given.mass", "", "Published mass."},
    {"robot", "links.given.com", "", "Published centre of mass in the link's frame."},
    {"robot", "links.given.inertia", "",
     "Published inertia about the centre of mass: {Ixx, Iyy, Izz, Ixy, Iyz, Ixz} or a 3x3 matrix, "
     "elements of the tensor."},
    {"robot", "links.parts", "@group(Mass)",
     "Designed bodies: {what = solid or object, placement or position with angles}."},
    {"robot", "tools.link", "member:link_or_base of id or int"},
    {"robot", "attached.link", "member:link_or_base of id or int"},
    {"robot", "loops.link_a", "member:link_or_base of id or int"},
    {"robot", "loops.link_b", "member:link_or_base of id or int"},
    {"robot", "base_parts", "",
     "Designed bodies of the base: {what = solid or object, placement or position with angles}."},
    {"robot", "base_mass", "",
     "Published mass of the base: mass, com and inertia about it in the base's frame, as for a "
     "link. A mass of 0 removes it."},
    {"robot", "ik", "provider:ik @group(Solvers)",
     "Inverse kinematics provider: name, or {name = ..., params = {...}}."},
    {"robot", "inverse_dynamics", "provider:inverse_dynamics @group(Solvers)"},
    {"robot", "forward_dynamics", "provider:forward_dynamics @group(Solvers)"},
    {"robot", "controller", "provider:controller @group(Solvers)"},
    {"trajectory", "segments.shape",
     "provider:curve|segment|joint_segment @when(stored is absent)"},
    {"trajectory", "segments.law", "provider:motion_law @when(stored is absent)"},
    {"trajectory", "segments.orientation", "provider:orientation @when(stored is absent)"},
    {"trajectory", "segments.turning", "provider:motion_law @when(stored is absent)"},
    {"trajectory", "segments.points", "@when(stored is absent)"},
    {"trajectory", "segments.joints", "list<joints> @when(stored is absent)"},
    {"trajectory", "segments.placement", "@when(stored is present or shape.name is absent)"},
    {"trajectory", "segments.transition.distance", "@when(is_smooth is true)"},
    {"trajectory", "segments.transition.speed", "@when(is_smooth is true)"},
    {"world", "gravity", "@shown(m/s^2)"},
    {"world", "robots.base_trajectory", "member:trajectory of id"},
    {"world", "tasks.robot", "member:robot of id"},
    {"world", "programs.program", "ref:program"},
    {"world", "programs.robot", "member:robot of id"},
    {"world", "attachments.object", "member:object of id"},
    {"world", "attachments.robot", "member:robot of id"},
    {"world", "attachments.link", "member:link_or_tool of robot"},
    {"task", "steps.robot", "member:robot of world @when(kind is move, attach, call)"},
    {"task", "steps.trajectory", "@when(kind is move)"},
    {"task", "steps.pose", "member:pose of robot @when(kind is move)"},
    {"task", "steps.joints", "joints of robot @when(kind is move)"},
    {"task", "steps.target", "@when(kind is move)"},
    {"task", "steps.frame", "member:frame of world @when(kind is move and target is present)"},
    {"task", "steps.profile", "enum(quintic|trapezoidal|s_curve|time_optimal) @when(kind is move)"},
    {"task", "steps.is_straight", "@when(kind is move and target is present)"},
    {"task", "steps.speed", "@when(kind is move)"},
    {"task", "steps.tool_speed", "@when(kind is move)"},
    {"task", "steps.duration", "@when(kind is move or kind is wait and expression is absent)"},
    {"task", "steps.object", "member:object of world @when(kind is attach, detach)"},
    {"task", "steps.link", "member:link_or_tool of robot @when(kind is move, attach)"},
    {"task", "steps.tcp", "member:tcp of object @when(kind is attach)"},
    {"task", "steps.reach", "@when(kind is attach)"},
    {"task", "steps.signal", "member:signal of world @when(kind is set)"},
    {"task", "steps.expression", "script:condition @when(kind is set, wait, if)"},
    {"task", "steps.timeout", "@when(kind is wait and expression is present)"},
    {"task", "steps.task", "@when(kind is call)"},
    {"task", "steps.count", "@when(kind is repeat)"},
    {"task", "steps.text", "@when(kind is message)"},
    {"program", "language", "provider:language(name)"},
    {"controller", "target", "provider:post(name)"},
};

const FieldNote* note_of(std::string_view kind, std::string_view path) {
  for (const FieldNote& n : kFieldNotes)
    if (n.kind == kind && n.path == path) return &n;
  return nullptr;
}

std::string joined_path(std::string_view path, std::string_view name) {
  return path.empty() ? std::string(name) : std::string(path) + "." + std::string(name);
}

/// "links" -> "link".
std::string_view singular(std::string_view list) {
  return list.ends_with('s') ? list.substr(0, list.size() - 1) : list;
}

Schema struct_params(std::string_view kind, std::string_view path, const Type& t);

std::string type_of_field(std::string_view kind, std::string_view path, const Field& f,
                          const Type& t) {
  // Structs that commands and files write in a form of their own.
  if (&t == &type_of<Placement>()) return "pose";
  if (&t == &type_of<ProviderChoice>()) return "map{name: string; params: map<any>}";
  switch (t.shape) {
    case Shape::boolean: return "bool";
    case Shape::integer:
      return f.index_in.empty() ? std::string("int")
                                : "member:" + std::string(singular(f.index_in)) + " of id or int";
    case Shape::real: return "real";
    case Shape::text:
    case Shape::digest: return "string";
    case Shape::word: {
      std::string out = "enum(";
      for (std::size_t i = 0; i < t.words.size(); ++i)
        out += (i ? "|" : "") + std::string(t.words[i].word);
      return out + ")";
    }
    case Shape::numbers:
      return t.count == 3 ? std::string("vec3") : "vec(" + std::to_string(t.count) + ")";
    case Shape::reals: return f.si_unit == kByJoint ? "joints of id" : "real[]";
    case Shape::colour: return "colour";
    case Shape::reference: {
      std::vector<std::string> words;
      for (const Kind k : f.kinds.empty() ? t.kinds : f.kinds) words.emplace_back(to_string(k));
      return words.empty() ? std::string("ref:any") : "ref:" + text::join(words, "|");
    }
    case Shape::setting: return "bool or int or real or string or real[]";
    case Shape::structure: return map_type(struct_params(kind, path, t));
    case Shape::list: return "list<" + type_of_field(kind, path, f, *t.element) + ">";
    case Shape::optional:
    case Shape::shared: return type_of_field(kind, path, f, *t.element);
    case Shape::table: return "map<" + type_of_field(kind, path, f, *t.element) + ">";
  }
  return "any";
}

Schema struct_params(std::string_view kind, std::string_view path, const Type& t) {
  Schema out;
  for (const Field& f : t.fields) {
    if (!f.is_value_flat) {
      out.push_back(field_param(kind, joined_path(path, f.name), f));
      continue;
    }
    // Its fields are among the owner's, and count and are grouped as it does.
    const FieldNote* note = note_of(kind, joined_path(path, f.name));
    for (ParamSpec& p : struct_params(kind, joined_path(path, f.name), *f.type)) {
      if (note && !note->type.empty()) p.type += " " + std::string(note->type);
      out.push_back(std::move(p));
    }
  }
  return out;
}

}  // namespace

std::span<const FieldNote> field_notes() { return kFieldNotes; }

NotedField noted_field(const FieldNote& note) {
  const auto kind = kind_from(note.kind);
  NotedField out;
  const Type* t = kind ? info(*kind).type : nullptr;
  for (const std::string_view name : text::split(note.path, '.')) {
    while (t && t->element) t = t->element;
    if (!t) return {};
    out = {t, t->field(name)};
    if (!out.field) return {};
    t = out.field->type;
  }
  return out;
}

ParamSpec field_param(std::string_view kind, std::string_view path, const Field& f) {
  ParamSpec p;
  p.name = f.name;
  p.doc = f.sentence;
  p.label = f.shown_name() == f.name ? std::string() : f.shown_name();
  p.required = f.is_needed;
  p.unit = f.si_unit;
  p.min = f.is_above_min ? (f.min == 0 ? kPositive : std::nextafter(f.min, HUGE_VAL)) : f.min;
  p.max = f.max;
  p.infinite = f.may_be_infinite;
  const FieldNote* note = note_of(kind, path);
  const std::string_view type = note ? note->type : std::string_view();
  if (!type.empty() && !type.starts_with('@')) {
    p.type = type;
  } else {
    p.type = type_of_field(kind, path, f, *f.type);
    if (!type.empty()) p.type += " " + std::string(type);
  }
  if (note && !note->doc.empty()) p.doc = note->doc;
  return p;
}

Schema record_fields(const KindInfo& kind) { return struct_params(kind.name, {}, *kind.type); }

}  // namespace robomosp::model
