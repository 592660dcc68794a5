// SPDX-License-Identifier: Apache-2.0
#include "evaluation/robot_doubts.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "kernel/text.h"
#include "model/handle.h"
#include "spatial/mass.h"
#include "spatial/principal.h"

namespace robomosp::evaluation {
namespace {

const FaultCodes kRobotCodes{
    {"robot.impossible_inertia", ErrorCode::invalid_argument,
     "A principal moment of inertia is negative or exceeds the sum of the two others."},
    {"robot.stuck_joint", ErrorCode::invalid_argument,
     "A joint cannot move, as its lower and upper limits are the same."},
};

Fault link_fault(const document::Snapshot& records, AnyId id, const char* code, std::string message,
                 std::string hint, std::string path) {
  Fault f = make_fault(code, std::move(message), std::move(hint), records.describe(id));
  f.severity = Severity::warning;
  f.subject.record = f.witness.scene = model::handle(id);
  f.subject.name = records.find(id)->name;
  f.subject.path = std::move(path);
  return f;
}

Value numbers_of(const Sym3& s) { return NumericArray({s.xx, s.yy, s.zz, s.xy, s.yz, s.xz}); }

FaultRemedy set_remedy(AnyId id, std::string label, std::string path, Value value) {
  FaultRemedy r;
  r.label = std::move(label);
  r.command = "record.set";
  r.args = {
      {"id", model::handle(id)}, {"path", std::move(path)}, {"value", std::move(value)}};
  r.untried = kUntriedByList;
  return r;
}

/// Of "links[3]".
std::optional<std::size_t> link_of(const FaultSubject& s) {
  constexpr std::string_view kLinks = "links[";
  if (!s.path.starts_with(kLinks)) return std::nullopt;
  const auto number = text::read_int(
      std::string_view(s.path).substr(kLinks.size(), s.path.find(']') - kLinks.size()));
  return number ? std::optional(static_cast<std::size_t>(*number - 1)) : std::nullopt;
}

}  // namespace

bool is_impossible(const Sym3& inertia) {
  const Vec3 m = spatial::principal(inertia).moments;  // ascending
  const double slack = 1e-6 * std::max(std::fabs(m[0]), std::fabs(m[2]));
  return m[0] < -slack || m[2] > m[0] + m[1] + slack;
}

std::string moments_text(const Sym3& inertia) {
  const Vec3 m = spatial::principal(inertia).moments;  // ascending
  const auto shown = [](double x) { return text::print_rounded(x, 4); };
  return shown(m[0]) + ", " + shown(m[1]) + " and " + shown(m[2]);
}

Sym3 nearest_possible(const Sym3& inertia) {
  const spatial::Principal p = spatial::principal(inertia);
  Vec3 m = p.moments;  // ascending, so that only the last can exceed the sum of the others
  const double excess = m[2] - m[0] - m[1];
  if (excess > 0) {
    const double rest = (m[1] + m[2]) / 2;
    m = {m[0] + excess / 3, m[1] + excess / 3, m[2] - excess / 3};
    if (m[0] < 0) m = {0, std::max(rest, 0.0), std::max(rest, 0.0)};  // a rod
  }
  return spatial::rotate(Pose{p.axes, {}}, Sym3{m[0], m[1], m[2], 0, 0, 0});
}

void offer_designed_mass(const document::Snapshot& records, Derived& derived, Progress& progress,
                         RobotId id, Fault& f) {
  const model::Robot* robot = records.get(id);
  if (!robot) return;
  const auto link = link_of(f.subject);
  const std::vector<model::BodyPart>& parts = link ? robot->links[*link].parts : robot->base_parts;
  if (parts.empty()) return;
  const auto designed = derived.mass(records, parts, progress);
  if (!designed.ok() || !(designed->mass.mass > 0) || is_impossible(designed->mass.inertia)) return;
  const MassProperties& m = designed->mass;
  f.remedies.insert(
      f.remedies.begin(),
      set_remedy(id,
                 "Use the mass of its designed bodies: " + text::print_rounded(m.mass, 4) +
                     " kg, principal moments " + moments_text(m.inertia) + " kg m^2",
                 link ? f.subject.path + ".given" : "base_mass",
                 Map{{"mass", m.mass},
                     {"com", NumericArray({m.com[0], m.com[1], m.com[2]})},
                     {"inertia", numbers_of(m.inertia)}}));
}

std::vector<Fault> robot_doubts(const document::Snapshot& records, AnyId id) {
  std::vector<Fault> out;
  const auto* robot = id.kind == Kind::robot ? records.get(RobotId{id.number}) : nullptr;
  if (!robot) return out;
  constexpr const char* kCorrect = "Correct it before you trust the robot's torques.";
  const auto impossible = [&](const Sym3& inertia, const std::string& of, std::string path) {
    out.push_back(
        link_fault(records, id, "robot.impossible_inertia",
                   of + " has an inertia that no body can have: its principal moments are " +
                       moments_text(inertia) + " kg m^2",
                   kCorrect, path));
    const Sym3 near = nearest_possible(inertia);
    out.back().remedies.push_back(
        set_remedy(id,
                   "Set the nearest possible inertia, with the principal moments " +
                       moments_text(near) + " kg m^2",
                   path + ".inertia", numbers_of(near)));
  };
  if (robot->base_mass && is_impossible(robot->base_mass->inertia))
    impossible(robot->base_mass->inertia, "the base", "base_mass");
  for (std::size_t i = 0; i < robot->links.size(); ++i) {
    const model::Link& l = robot->links[i];
    const std::string path = "links[" + std::to_string(i + 1) + "]";
    const std::string who = "link " + text::quote(l.name);
    if (l.given && is_impossible(l.given->inertia)) {
      impossible(l.given->inertia, who, path);
      out.back().witness.bodies = {l.name};
    }
    if (l.joint == model::JointKind::fixed || l.mimic || l.lower != l.upper) continue;
    const bool is_prismatic = l.joint == model::JointKind::prismatic;
    const std::string at = is_prismatic
                               ? text::print_rounded(l.lower, 6) + " m"
                               : text::print_rounded(l.lower * 180 / std::numbers::pi, 6) + " deg";
    Fault f = link_fault(records, id, "robot.stuck_joint",
                         "the joint of " + who + " cannot move: both limits are " + at,
                         "Set lower and upper, or make the joint fixed.", path + ".lower");
    FaultJoint joint;
    joint.name = l.name;
    joint.number = i + 1;
    joint.limit = l.lower;
    joint.unit = is_prismatic ? "m" : "rad";
    f.witness.joints.push_back(std::move(joint));
    FaultRemedy r;
    r.label = "Make the joint of " + l.name + " fixed";
    r.command = "robot.set_link";
    r.args = {{"id", model::handle(id)}, {"link", l.name}, {"joint", "fixed"}};
    r.untried = kUntriedByList;
    f.remedies.push_back(std::move(r));
    out.push_back(std::move(f));
  }
  return out;
}

}  // namespace robomosp::evaluation
