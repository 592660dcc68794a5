// SPDX-License-Identifier: Apache-2.0
#include "io/legacy_motion.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <utility>

#include "io/legacy_syntax.h"
#include "kernel/text.h"

namespace robomosp::io {

namespace {

using namespace model;
using text::quote;

/// A file, its description and its place: an entry of lists in robots and worlds.
struct MotionEntry {
  std::string path, description;
  LegacyReader::Frame frame;
  std::uint32_t offset = 0;

  /// The description when it can be a name, else the file's.
  [[nodiscard]] std::string name(std::string_view otherwise) const {
    return plain_name(description.empty() ? legacy_stem(path) : description, otherwise);
  }
};

Result<MotionEntry> read_entry(LegacyReader& in, const std::string& what) {
  MotionEntry e;
  e.offset = in.offset();
  RMP_TRY_ASSIGN(e.path, in.text(("the file of " + what).c_str()));
  RMP_TRY_ASSIGN(e.description, in.text(("the description of " + what).c_str()));
  RMP_TRY_ASSIGN(e.frame, in.frame(("the frame of " + what).c_str()));
  return e;
}

Error global_frame(LegacyReader& in, std::uint32_t offset, const std::string& what) {
  return in.at(offset, "the reference's type 1 (global) is not known for " + what,
               "In all known files frames of robots are relative (0).");
}

/// `( entry, entry, ... )`, commas or not; calls `each(entry)`.
template <class Each>
Result<void> read_list(LegacyReader& in, const std::string& what, Each each) {
  RMP_TRY(in.expect('(', ("( before " + what).c_str()));
  for (bool is_first = true; !in.accept(')'); is_first = false) {
    if (!is_first) (void)in.accept(',');
    RMP_TRY(each());
  }
  return {};
}

/// An angle within limits by full turns, if any reaches them.
double within(double angle, double lower, double upper) {
  constexpr double kTurn = 2 * std::numbers::pi;
  if (angle >= lower && angle <= upper) return angle;
  const double up = angle + kTurn * std::ceil((lower - angle) / kTurn);
  return up <= upper ? up : angle;
}

class RobotBinder {
 public:
  RobotBinder(LegacyReader& in, const Syntax& s, LegacyBound& out) : in_(in), s_(s), out_(out) {}

  Result<void> run(const std::string& description) {
    robot_.description = description;
    robot_.mass_source = MassSource::designed;
    const std::uint32_t type_at = in_.offset();
    RMP_TRY_ASSIGN(const auto type, in_.whole("the robot's type"));
    if (type != 0 && type != 1)
      return in_.at(type_at, "the robot's type " + std::to_string(type) + " is not known",
                    "0 is serial, 1 hyper-branched.");
    is_serial_ = type == 0;
    const std::uint32_t base_at = in_.offset();
    RMP_TRY_ASSIGN(const auto base, in_.frame("the frame of the base"));
    if (base.is_global) return global_frame(in_, base_at, "the base");
    robot_.base = base.placement;
    RMP_TRY(bodies(-1));
    RMP_TRY(links());
    // That program drew nothing for links without objects beside those with some.
    const bool has_bodies = !robot_.base_parts.empty() ||
                            std::any_of(robot_.links.begin(), robot_.links.end(),
                                        [](const Link& link) { return !link.parts.empty(); });
    for (Link& link : robot_.links) link.visible = !has_bodies || !link.parts.empty();
    NamedPose home{"home", std::move(origin_)}, nest{"nest", std::move(nest_)};
    robot_.poses = {std::move(home), std::move(nest)};
    if (has_offsets_)
      out_.notes.push_back(quote(s_.file) +
                           ": the eight numbers after a link's row are not applied; the 2006 "
                           "program's robot follows its trajectory without them.");
    out_.record.body = std::move(robot_);
    return {};
  }

 private:
  /// The objects of a link, or of the base (-1); an empty file name is a bare frame.
  Result<void> bodies(std::int32_t link) {
    return read_list(in_, "the objects", [&]() -> Result<void> {
      RMP_TRY_ASSIGN(const MotionEntry e, read_entry(in_, "an object"));
      if (e.frame.is_global) return global_frame(in_, e.offset, "a robot's object");
      if (e.path.empty()) return {};
      if (link >= 0 && robot_.links.back().name.empty()) robot_.links.back().name = e.name("link");
      auto& parts = link < 0 ? robot_.base_parts : robot_.links.back().parts;
      parts.push_back({{}, e.frame.placement});
      Reference r;
      r.path = e.path;
      r.offset = e.offset;
      r.kinds = {Kind::object, Kind::solid};
      r.owner = link < 0 ? "the base" : "link " + std::to_string(link + 1);
      r.set = [link, part = parts.size() - 1](Body& b, AnyId id) {
        auto& robot = std::get<Robot>(b);
        auto& of = link < 0 ? robot.base_parts : robot.links[static_cast<std::size_t>(link)].parts;
        of[part].what = id;
      };
      out_.references.push_back(std::move(r));
      return {};
    });
  }

  /// The tree of links, depth by an explicit list.
  Result<void> links() {
    std::vector<std::int32_t> open;
    std::int32_t last_parent = -2;
    RMP_TRY(in_.expect('{', "{"));
    do {
      if (!robot_.links.empty() && in_.accept('}')) {
        open.pop_back();
        (void)in_.accept(',');
        continue;
      }
      const std::uint32_t at = in_.offset();
      if (!robot_.links.empty()) RMP_TRY(in_.expect('{', "{ or }"));
      if (robot_.links.size() >= kMostLegacyNodes)
        return in_.at(at, "the robot has more than " + std::to_string(kMostLegacyNodes) + " links");
      const std::int32_t parent = open.empty() ? -1 : open.back();
      // Depth first: a second child of a parent comes after links that lie deeper.
      if (is_serial_ && parent <= last_parent)
        return in_.at(at, "a serial robot (type 0) has a branch",
                      "Robots with branches are of type 1, hyper-branched.");
      last_parent = parent;
      RMP_TRY(link(parent));
      open.push_back(static_cast<std::int32_t>(robot_.links.size()) - 1);
    } while (!open.empty());
    return {};
  }

  Result<void> link(std::int32_t parent) {
    const std::size_t index = robot_.links.size();
    const auto eight = [&](const char* what) -> Result<std::vector<double>> {
      const std::uint32_t at = in_.offset();
      RMP_TRY_ASSIGN(auto v, in_.tuple(what));
      if (v.size() == 8) return v;
      return in_.at(at, std::string(what) + " has " + std::to_string(v.size()) + " numbers, not 8");
    };
    RMP_TRY(in_.expect('[', "["));
    out_.places[{"link", index}] = in_.offset();
    RMP_TRY_ASSIGN(const auto row, eight("the row of a link"));
    RMP_TRY_ASSIGN(const auto offsets, eight("the offsets of a link"));
    for (const double x : offsets) has_offsets_ = has_offsets_ || x != 0;
    const std::uint32_t joint_at = in_.offset();
    RMP_TRY_ASSIGN(const std::string_view joint, in_.word("Revolute or Prismatic"));
    Link l;
    l.parent = parent;
    l.row.alpha = row[0] * kDegree;
    l.row.a = row[1];
    double unit = kDegree;
    if (joint == "Revolute") {  // its angle is the joint's value; theta is only the last one shown
      l.row.d = row[3];
    } else if (joint == "Prismatic") {
      l.joint = JointKind::prismatic;
      l.row.theta = row[2] * kDegree;
      unit = 1;
      out_.notes.push_back(s_.place(joint_at) +
                           ": no file of the 2006 program with a Prismatic link is known; its "
                           "value is taken as d, in metres.");
    } else {
      return in_.at(joint_at, "there is no joint " + quote(joint),
                    "There are Revolute and Prismatic.");
    }
    l.lower = std::min(row[4], row[5]) * unit;  // some files have them the other way round
    l.upper = std::max(row[4], row[5]) * unit;
    // What the joint was last shown at: beyond its limits, they are no limits of that program's.
    const double shown = l.joint == JointKind::revolute ? row[2] : row[3];
    const double value =
        l.joint == JointKind::revolute ? within(shown * unit, l.lower, l.upper) : shown;
    if (!(value >= l.lower && value <= l.upper)) {
      const char* word = l.joint == JointKind::revolute ? " deg" : " m";
      out_.notes.push_back(s_.place(out_.places[{"link", index}]) + ": link " +
                           std::to_string(index + 1) + " was saved at " + text::print(shown) +
                           word + ", beyond its limits of " + text::print(row[4]) + word + " and " +
                           text::print(row[5]) + word + ", so it gets none.");
      l.lower = -std::numeric_limits<double>::infinity();
      l.upper = std::numeric_limits<double>::infinity();
    }
    robot_.links.push_back(std::move(l));
    RMP_TRY(bodies(static_cast<std::int32_t>(index)));
    RMP_TRY(in_.expect(']', "]"));
    std::string& name = robot_.links.back().name;
    name = names_.fresh(name.empty() ? "link" : name);
    origin_.push_back(row[6] * unit);
    nest_.push_back(row[7] * unit);
    return {};
  }

  LegacyReader& in_;
  const Syntax& s_;
  LegacyBound& out_;
  Robot robot_;
  FreshNames names_;
  std::vector<double> origin_, nest_;
  bool is_serial_ = false, has_offsets_ = false;
};

class WorldBinder {
 public:
  WorldBinder(LegacyReader& in, const Syntax& s, LegacyBound& out) : in_(in), s_(s), out_(out) {}

  Result<void> run(const std::string& description) {
    world_.description = description;
    RMP_TRY_ASSIGN(const auto target, in_.frame("the frame of the target"));
    if (target.placement.position != Vec3{} || target.placement.angles != Vec3{})
      world_.frames.push_back({names_.fresh("target"), target.placement});
    RMP_TRY(read_list(in_, "the objects", [&] { return object(); }));
    RMP_TRY(read_list(in_, "the robots", [&] { return robot(); }));
    RMP_TRY(read_list(in_, "the trajectories", [&] { return trajectory(); }));
    out_.record.body = std::move(world_);
    if (!values_.empty())
      out_.finish = [values = std::move(values_), &s = s_](Body& b, const document::Snapshot& now,
                                                           std::vector<std::string>& notes) {
        return set_joints(std::get<World>(b), values, s, now, notes);
      };
    return {};
  }

 private:
  /// Joint values as written: degrees or metres.
  struct Values {
    std::vector<double> q;
    std::uint32_t offset = 0;
  };

  template <class Members>
  Result<MotionEntry> member(const char* list, const char* what, Members& members,
                             std::vector<Kind> kinds) {
    RMP_TRY_ASSIGN(const MotionEntry e,
                   read_entry(in_, "a" + std::string(*what == 'o' ? "n " : " ") + what));
    typename Members::value_type m;
    m.name = names_.fresh(e.name(what));
    m.placement = e.frame.placement;
    out_.places[{list, members.size()}] = e.offset;
    Reference r;
    r.path = e.path;
    r.offset = e.offset;
    r.kinds = std::move(kinds);
    r.owner = std::string(what) + " " + quote(m.name);
    members.push_back(std::move(m));
    out_.references.push_back(std::move(r));
    return e;
  }

  Result<void> object() {
    const std::size_t i = world_.objects.size();
    RMP_TRY(member("object", "object", world_.objects, {Kind::object, Kind::solid}));
    out_.references.back().set = [i](Body& b, AnyId id) {
      std::get<World>(b).objects[i].what = id;
    };
    return {};
  }

  Result<void> robot() {
    const std::size_t i = world_.robots.size();
    RMP_TRY(member("robot", "robot", world_.robots, {Kind::robot}));
    out_.references.back().set = [i](Body& b, AnyId id) {
      std::get<World>(b).robots[i].robot = RobotId{id.number};
    };
    Values v;
    v.offset = in_.offset();
    RMP_TRY_ASSIGN(v.q, in_.tuple("the joint values"));
    values_.push_back(std::move(v));
    const std::uint32_t base_at = in_.offset();
    RMP_TRY_ASSIGN(const std::string_view first, in_.word("the kind of base, such as Fixed"));
    std::string base(first);
    if (base == "Free" && in_.next() == 'a') {
      RMP_TRY_ASSIGN(const std::string_view second, in_.word("Flying or Floating"));
      base += " " + std::string(second);
    }
    // Written in one word or two.
    constexpr std::array<std::pair<std::string_view, BaseKind>, 6> kKinds{
        {{"Fixed", BaseKind::fixed},
         {"Free Flying", BaseKind::free_flying},
         {"FreeFlying", BaseKind::free_flying},
         {"Free Floating", BaseKind::free_floating},
         {"FreeFloating", BaseKind::free_floating},
         {"Serpentine", BaseKind::serpentine}}};
    const auto kind =
        std::find_if(kKinds.begin(), kKinds.end(), [&](const auto& k) { return k.first == base; });
    if (kind == kKinds.end())
      return in_.at(base_at, "the kind of base " + quote(base) + " is not known",
                    "There are Fixed, Free Flying, Free Floating and Serpentine.");
    world_.robots[i].base = kind->second;
    if (kind->second == BaseKind::fixed) return {};
    if (in_.next() != '"') {
      out_.notes.push_back(
          s_.place(base_at) + ": the base is " + base +
          ", and the file names no trajectory for it; set one with robot.set_base.");
      return {};
    }
    // No file with such a base is known; its trajectory is read as those of the list are.
    const std::uint32_t way_at = in_.offset();
    RMP_TRY(trajectory());
    world_.robots[i].base_trajectory = world_.trajectories.back().name;
    out_.notes.push_back(s_.place(way_at) +
                         ": no file of the 2006 program with a base that is not "
                         "fixed is known; what follows is read as the trajectory of the base.");
    return {};
  }

  Result<void> trajectory() {
    const std::size_t i = world_.trajectories.size();
    RMP_TRY(member("trajectory", "trajectory", world_.trajectories, {Kind::trajectory}));
    out_.references.back().set = [i](Body& b, AnyId id) {
      std::get<World>(b).trajectories[i].trajectory = TrajectoryId{id.number};
    };
    return {};
  }

  static Result<void> set_joints(World& world, const std::vector<Values>& values, const Syntax& s,
                                 const document::Snapshot& now, std::vector<std::string>& notes) {
    for (std::size_t i = 0; i < values.size(); ++i) {
      PlacedRobot& placed = world.robots[i];
      const auto& robot = std::get<Robot>(now.find(AnyId(placed.robot))->body);
      const Values& given = values[i];
      if (given.q.size() != robot.links.size())
        return s.at(given.offset, ErrorCode::syntax,
                    "robot " + quote(placed.name) + " has " + std::to_string(given.q.size()) +
                        " joint values, but " + std::to_string(robot.links.size()) + " links",
                    "Each link has one joint value.");
      for (std::size_t k = 0; k < given.q.size(); ++k) {
        const Link& l = robot.links[k];
        const bool turns = l.joint == JointKind::revolute;
        const double q = turns ? within(given.q[k] * kDegree, l.lower, l.upper) : given.q[k];
        if (!(q >= l.lower && q <= l.upper))
          notes.push_back(s.place(given.offset) + ": joint " + std::to_string(k + 1) +
                          " of robot " + quote(placed.name) + " is beyond its limits.");
        placed.q.push_back(q);
      }
    }
    return {};
  }

  LegacyReader& in_;
  const Syntax& s_;
  LegacyBound& out_;
  World world_;
  FreshNames names_;
  std::vector<Values> values_;
};

}  // namespace

Result<void> bind_legacy_robot(LegacyReader& in, const Syntax& s, const std::string& description,
                               LegacyBound& out) {
  return RobotBinder(in, s, out).run(description);
}

Result<void> bind_legacy_world(LegacyReader& in, const Syntax& s, const std::string& description,
                               LegacyBound& out) {
  return WorldBinder(in, s, out).run(description);
}

}  // namespace robomosp::io
