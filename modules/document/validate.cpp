// SPDX-License-Identifier: Apache-2.0
#include "document/validate.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <string>
#include <unordered_set>

#include "kernel/text.h"

namespace robomosp::document {

namespace {

using namespace model;
using text::quote;

bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); }
bool is_digit(char c) { return c >= '0' && c <= '9'; }

Error fault(std::string message, std::string hint = {}) {
  return error(ErrorCode::invalid_argument, std::move(message), std::move(hint));
}

std::string shown(double v) { return text::print_rounded(v, 6); }

/// `what` names the number: `the density`, `the x of box "plate"`.
Result<void> finite(double v, const std::string& what) {
  if (std::isfinite(v)) return {};
  return fault(what + " is " + text::print(v) + "; it must be a finite number");
}
Result<void> finite(std::span<const double> v, const std::string& what) {
  for (const double x : v) RMP_TRY(finite(x, what));
  return {};
}
Result<void> within(double v, double low, double high, const std::string& what) {
  RMP_TRY(finite(v, what));
  if (v >= low && v <= high) return {};
  return fault(what + " is " + shown(v) + "; it must be from " + shown(low) + " to " + shown(high));
}
Result<void> positive(double v, const std::string& what, const char* unit) {
  RMP_TRY(finite(v, what));
  if (v > 0) return {};
  return fault(what + " is " + shown(v) + unit + "; it must be greater than 0");
}
Result<void> not_negative(double v, const std::string& what, const char* unit) {
  RMP_TRY(finite(v, what));
  if (v >= 0) return {};
  return fault(what + " is " + shown(v) + unit + "; it must not be negative");
}
/// Far beyond any robot, and far below where sums of lengths lose millimetres or overflow.
constexpr double kLongest = 1e4;   // m
constexpr double kHeaviest = 1e9;  // kg
Result<void> at_most(double v, double most, const std::string& what, const char* unit) {
  RMP_TRY(finite(v, what));
  if (std::fabs(v) <= most) return {};
  return fault(what + " is " + shown(v) + unit + "; at most " + shown(most) + unit + " is allowed");
}
/// A limit: positive, infinity = none.
Result<void> limit(double v, const std::string& what) {
  if (v > 0) return {};
  return fault(what + " is " + text::print(v) + "; it must be greater than 0");
}
Result<void> colour(const Colour& c, const std::string& what) {
  for (const float v : {c.r, c.g, c.b, c.a}) RMP_TRY(within(static_cast<double>(v), 0, 1, what));
  return {};
}
Result<void> placement(const Placement& p, const std::string& what) {
  RMP_TRY(finite(p.position, "the position of " + what));
  RMP_TRY(finite(p.angles, "an angle of the placement of " + what));
  if (p.notation > AngleNotation::zyz)
    return fault("the placement of " + what + " has an unknown notation of angles");
  return {};
}
Result<void> near(const Placement& p, const std::string& what) {
  RMP_TRY(placement(p, what));
  for (const double x : p.position) RMP_TRY(at_most(x, kLongest, "a coordinate of " + what, " m"));
  return {};
}
Result<void> choice(const ProviderChoice& p, const std::string& what) {
  for (const auto& [name, value] : p.params) {
    const std::string which = "parameter " + quote(name) + " of " + what;
    if (!is_name(name) || name.find(' ') != std::string::npos || name == "point")
      return bad_name(name, "parameter of " + what);
    if (const auto* v = std::get_if<double>(&value)) RMP_TRY(finite(*v, which));
    if (const auto* v = std::get_if<std::vector<double>>(&value)) RMP_TRY(finite(*v, which));
  }
  return {};
}

/// Names seen so far within one record.
class Names {
 public:
  explicit Names(const char* what) : what_(what) {}
  Result<void> add(const std::string& name) {
    if (!is_name(name)) return bad_name(name, what_);
    if (!seen_.insert(name).second)
      return error(ErrorCode::conflict,
                   "there are two " + std::string(what_) + "s named " + quote(name),
                   "Give each its own name.");
    return {};
  }

 private:
  const char* what_;
  std::unordered_set<std::string> seen_;
};

Result<void> check_size(const CsgSize& size, double value, const std::string& which) {
  const std::string unit = size.unit.empty() ? "" : " " + std::string(size.unit);
  const char* tail = unit.c_str();
  switch (size.range) {
    case CsgRange::positive: return positive(value, which, tail);
    case CsgRange::not_negative: return not_negative(value, which, tail);
    case CsgRange::any: return finite(value, which);
    case CsgRange::count: break;
  }
  if (value >= 1 && value <= 10'000 && value == std::floor(value)) return {};
  return fault(which + " is " + text::print(value) + "; it must be a whole number from 1 to 10000");
}

Result<void> check_node(const Solid& s, std::size_t i) {
  const SolidNode& n = s.nodes[i];
  const std::string node = "node " + quote(n.name);
  if (i == 0 ? n.parent != -1 : (n.parent < 0 || static_cast<std::size_t>(n.parent) >= i))
    return fault(i == 0 ? node + " is the root, so it cannot have a parent"
                        : node + " does not come after its parent",
                 "Every node but the first has a parent, and parents come first.");
  if (n.parent >= 0) {
    const auto& p = s.nodes[static_cast<std::size_t>(n.parent)];
    const CsgNodeInfo& above = csg_info(p.kind);
    if (above.children == CsgChildren::none)
      return fault(node + " is inside " + std::string(above.name) + " " + quote(p.name) +
                       ", which is a primitive",
                   "Only an operation such as a union, or a modifier, has nodes inside.");
  }
  RMP_TRY(placement(n.placement, node));
  const CsgNodeInfo& info = csg_info(n.kind);
  if (info.kind != n.kind) return fault(node + " is of an unknown kind");
  const std::string of = " of " + std::string(info.name) + " " + quote(n.name);
  for (std::size_t k = 0; k < csg_size_count(n.kind); ++k)
    RMP_TRY(check_size(info.sizes[k], n.sizes[k], std::string(info.sizes[k].name) + of));
  if (n.kind == CsgKind::cone && n.sizes[0] == 0 && n.sizes[1] == 0)
    return fault("both radii" + of + " are 0", "Give one of them a size.");
  return {};
}

Result<void> check(const Material& m, Subject&) {
  RMP_TRY(positive(m.density, "the density", " kg/m^3"));
  RMP_TRY(colour(m.colour, "a component of the colour"));
  RMP_TRY(within(m.shininess, 0, 1, "shininess"));
  return within(m.metalness, 0, 1, "metalness");
}

Result<void> check(const Solid& s, Subject& subject) {
  RMP_TRY(positive(s.chord, "the chord", " m"));
  Names names("node");
  for (std::size_t i = 0; i < s.nodes.size(); ++i) {
    subject = {"node", i};
    RMP_TRY(names.add(s.nodes[i].name));
    RMP_TRY(check_node(s, i));
  }
  return {};
}

Result<void> solid_or_object(AnyId id, const std::string& what) {
  if (!id) return fault(what + " has neither a solid nor an object", "Say what stands there.");
  return {};
}

Result<void> check(const Object& o, Subject& subject) {
  if (o.overlap > Overlap::sum) return fault("the overlap policy is unknown");
  Names names("part");
  for (std::size_t i = 0; i < o.parts.size(); ++i) {
    const ObjectPart& p = o.parts[i];
    subject = {"part", i};
    RMP_TRY(names.add(p.name));
    RMP_TRY(solid_or_object(p.what, "part " + quote(p.name)));
    RMP_TRY(placement(p.placement, "part " + quote(p.name)));
  }
  return {};
}

Result<void> check_link(const Robot& r, std::size_t i) {
  const Link& l = r.links[i];
  const std::string link = "link " + quote(l.name);
  const std::string of = " of " + link;
  if (l.parent < -1 || l.parent >= static_cast<std::int32_t>(i))
    return fault(link + " does not come after its parent", "Parents come first; -1 is the base.");
  if (l.joint > JointKind::fixed) return fault("the joint" + of + " is of an unknown kind");
  RMP_TRY(at_most(l.row.a, kLongest, "a" + of, " m"));
  RMP_TRY(finite(l.row.alpha, "alpha" + of));
  RMP_TRY(at_most(l.row.d, kLongest, "d" + of, " m"));
  RMP_TRY(finite(l.row.theta, "theta" + of));
  if (!(l.lower <= l.upper))
    return fault(
        "the lower limit" + of + " is " + shown(l.lower) + " and the upper " + shown(l.upper),
        "The lower limit must not exceed the upper one.");
  RMP_TRY(limit(l.max_velocity, "max_velocity" + of));
  RMP_TRY(limit(l.max_acceleration, "max_acceleration" + of));
  RMP_TRY(limit(l.max_force, "max_force" + of));
  RMP_TRY(not_negative(l.drive.motor_inertia, "motor_inertia" + of, " kg m^2"));
  RMP_TRY(finite(l.drive.gear_ratio, "gear_ratio" + of));
  RMP_TRY(not_negative(l.drive.viscous, "viscous" + of, " N m s/rad"));
  RMP_TRY(not_negative(l.drive.coulomb_positive, "the positive coulomb friction" + of, " N m"));
  RMP_TRY(finite(l.drive.coulomb_negative, "the negative coulomb friction" + of));
  if (l.drive.coulomb_negative > 0)
    return fault("the negative coulomb friction" + of + " is " + shown(l.drive.coulomb_negative) +
                 " N m; it must not be positive");
  if (l.given) {
    RMP_TRY(not_negative(l.given->mass, "the given mass" + of, " kg"));
    RMP_TRY(at_most(l.given->mass, kHeaviest, "the given mass" + of, " kg"));
    RMP_TRY(finite(l.given->com, "the given centre of mass" + of));
    const Sym3& s = l.given->inertia;
    RMP_TRY(finite(std::array{s.xx, s.yy, s.zz, s.xy, s.yz, s.xz}, "the given inertia" + of));
    for (const double v : {s.xx, s.yy, s.zz})
      RMP_TRY(not_negative(v, "a diagonal element of the given inertia" + of, " kg m^2"));
  }
  for (const auto& p : l.parts) {
    RMP_TRY(solid_or_object(p.what, "a part" + of));
    RMP_TRY(placement(p.placement, "a part" + of));
  }
  return {};
}

Result<void> check(const Robot& r, Subject& subject) {
  if (r.convention > Convention::mdh) return fault("the convention is unknown");
  if (r.mass_source > MassSource::designed) return fault("the source of masses is unknown");
  RMP_TRY(near(r.base, "the base"));
  RMP_TRY(near(r.tool, "the tool"));
  for (const auto& p : r.base_parts) {
    RMP_TRY(solid_or_object(p.what, "a part of the base"));
    RMP_TRY(placement(p.placement, "a part of the base"));
  }
  Names names("link");
  for (std::size_t i = 0; i < r.links.size(); ++i) {
    subject = {"link", i};
    RMP_TRY(names.add(r.links[i].name));
    if (r.links[i].name == "base")
      return fault("a link cannot be named \"base\"",
                   "\"base\" is the frame the first link stands on.");
    RMP_TRY(check_link(r, i));
  }
  const auto dof = static_cast<std::size_t>(std::count_if(
      r.links.begin(), r.links.end(), [](const Link& l) { return l.joint != JointKind::fixed; }));
  Names poses("pose");
  for (std::size_t i = 0; i < r.poses.size(); ++i) {
    const NamedPose& p = r.poses[i];
    subject = {"pose", i};
    RMP_TRY(poses.add(p.name));
    RMP_TRY(finite(p.q, "a joint value of pose " + quote(p.name)));
    if (p.q.size() != dof)
      return fault(
          "pose " + quote(p.name) + " has " + std::to_string(p.q.size()) +
          (p.q.size() == 1 ? " joint value; the robot has " : " joint values; the robot has ") +
          std::to_string(dof) + (dof == 1 ? " moving joint" : " moving joints"));
  }
  subject = {};
  RMP_TRY(choice(r.ik, "ik"));
  RMP_TRY(choice(r.inverse_dynamics, "inverse_dynamics"));
  RMP_TRY(choice(r.forward_dynamics, "forward_dynamics"));
  RMP_TRY(colour(r.skin_colour, "a component of the skin's colour"));
  return colour(r.skin_accent, "a component of the skin's accent");
}

Result<void> check(const Trajectory& t, Subject& subject) {
  RMP_TRY(positive(t.sample_time, "the sample time", " s"));
  for (std::size_t i = 0; i < t.segments.size(); ++i) {
    subject = {"segment", i};
    const std::string segment = "segment " + std::to_string(i + 1);
    if (!is_name(t.segments[i].shape.name))
      return bad_name(t.segments[i].shape.name, "shape of " + segment);
    RMP_TRY(choice(t.segments[i].shape, segment));
    for (std::size_t k = 0; k < t.segments[i].points.size(); ++k)
      RMP_TRY(
          placement(t.segments[i].points[k], "point " + std::to_string(k + 1) + " of " + segment));
  }
  return {};
}

Result<void> check(const World& w, Subject& subject) {
  RMP_TRY(finite(w.gravity, "gravity"));
  Names names("member");
  for (std::size_t i = 0; i < w.objects.size(); ++i) {
    const PlacedObject& o = w.objects[i];
    subject = {"object", i};
    RMP_TRY(names.add(o.name));
    RMP_TRY(solid_or_object(o.what, "object " + quote(o.name)));
    RMP_TRY(placement(o.placement, "object " + quote(o.name)));
  }
  for (std::size_t i = 0; i < w.robots.size(); ++i) {
    const PlacedRobot& r = w.robots[i];
    subject = {"robot", i};
    RMP_TRY(names.add(r.name));
    if (!r.robot) return fault("the placed robot " + quote(r.name) + " names no robot");
    RMP_TRY(placement(r.placement, "robot " + quote(r.name)));
    RMP_TRY(finite(r.q, "a joint value of robot " + quote(r.name)));
  }
  for (std::size_t i = 0; i < w.trajectories.size(); ++i) {
    const PlacedTrajectory& t = w.trajectories[i];
    subject = {"trajectory", i};
    RMP_TRY(names.add(t.name));
    if (!t.trajectory)
      return fault("the placed trajectory " + quote(t.name) + " names no trajectory");
    RMP_TRY(placement(t.placement, "trajectory " + quote(t.name)));
  }
  return {};
}

}  // namespace

bool is_name(std::string_view name) {
  if (name.empty() || !is_letter(name.front()) || name.back() == ' ') return false;
  return std::all_of(name.begin(), name.end(), [](char c) {
    return is_letter(c) || is_digit(c) || c == '_' || c == '-' || c == '.' || c == ' ';
  });
}

std::string with_article(std::string_view noun) {
  const bool is_vowel =
      !noun.empty() && std::string_view("aeio").find(noun.front()) != std::string_view::npos;
  return (is_vowel ? "an " : "a ") + std::string(noun);
}

Error bad_name(std::string_view name, std::string_view what) {
  const std::string hint =
      "A name starts with a letter and has letters, digits, _ - . and spaces, none at the end.";
  if (name.empty()) return fault("the name of " + with_article(what) + " is empty", hint);
  return fault(quote(name) + " cannot be the name of " + with_article(what), hint);
}

Result<void> check_record(const Record& record, Subject* subject) {
  if (!is_name(record.name)) return bad_name(record.name, to_string(record.kind()));
  Subject place;
  auto result = std::visit([&place](const auto& body) { return check(body, place); }, record.body);
  if (subject && !result.ok()) *subject = place;
  return std::move(result).in(std::string(to_string(record.kind())) + " " + quote(record.name));
}

}  // namespace robomosp::document
