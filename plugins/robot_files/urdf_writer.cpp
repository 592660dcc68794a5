// SPDX-License-Identifier: Apache-2.0
#include "urdf_writer.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <set>
#include <span>
#include <string_view>
#include <utility>

#include "spatial/mass.h"
#include "spatial/pose.h"
#include "spatial/rotation.h"
#include "xml.h"

namespace robomosp::robot_files {
namespace {

/// URDF requires limits where a robot may have none; importers take what is beyond 1e12 for none.
constexpr double kNoLimit = 1e16;

/// The shortest text that reads back as the number.
std::string print_xml_number(double value) {
  char text[64];
  return {text, std::to_chars(text, text + sizeof text, value).ptr};
}
std::string print_rounded(float value) {
  char text[64];
  const auto end = std::to_chars(text, text + sizeof text, static_cast<double>(value),
                                 std::chars_format::general, 4);
  return {text, end.ptr};
}
std::string xml_escaped(std::string_view s) {
  std::string out;
  for (const char c : s) {
    if (c == '&') out += "&amp;";
    else if (c == '<') out += "&lt;";
    else if (c == '>') out += "&gt;";
    else if (c == '"') out += "&quot;";
    else out += c;
  }
  return out;
}
std::string three(const Vec3& v) {
  return print_xml_number(v[0]) + " " + print_xml_number(v[1]) + " " + print_xml_number(v[2]);
}
bool is_identity(const Pose& t) { return t.p == Vec3{} && t.R == Pose{}.R; }
/// "a, b and c"
std::string enumerate(std::span<const std::string> words) {
  std::string out;
  for (std::size_t i = 0; i < words.size(); ++i) {
    if (i > 0) out += i + 1 == words.size() ? " and " : ", ";
    out += words[i];
  }
  return out;
}

class UrdfWriter {
 public:
  UrdfWriter(const ExportTask& task, const UrdfWishes& wishes, const StlWriter& stl,
             ExportReport& report, UrdfNames& names)
      : task_(task),
        wishes_(wishes),
        stl_(stl),
        report_(report),
        names_(names),
        robot_(task.robots[0]),
        model_(*robot_.model),
        links_(mechanism(robot_)->links) {}

  Result<std::vector<ExportedFile>> run() {
    const ExportMechanism& m = *mechanism(robot_);
    for (const ExportLink& l : links_) {
      if (l.name.empty())
        return error(ErrorCode::invalid_argument, "one of its links has no name",
                     "URDF needs names; give it one.");
      // Links keep their names; what is added takes others.
      links_taken_.insert(l.name);
    }
    base_ = free_name("base", links_taken_);
    names_.root = names_.base = base_;
    RMP_TRY(bodies());
    xml_ = "<?xml version=\"1.0\"?>\n<robot name=\"" + xml_escaped(robot_.name) + "\">\n";
    if (!is_identity(robot_.pose)) {
      const std::string mounting = free_name("mounting", links_taken_);
      xml_ += "  <link name=\"" + xml_escaped(mounting) + "\"/>\n";
      ++link_count_;
      names_.root = mounting;
      fixed(mounting, base_, robot_.pose);
      report_.notes.push_back("The base is fixed to an additional link " + in_quotes(mounting) +
                              ", the root.");
    }
    const MassProperties* const standing = standing_mass(robot_);
    link(base_, standing ? *standing : MassProperties{}, bodies_[0]);
    for (std::size_t i = 0; i < links_.size(); ++i) add_link(i);
    for (const ExportFrame& f : m.frames) {
      const std::string name = free_name(f.name, links_taken_);
      names_.frames.push_back(name);
      link(name, {}, {});
      fixed(f.link < 0 ? base_ : links_[static_cast<std::size_t>(f.link)].name, name, f.pose);
    }
    xml_ += joint_xml_ + "</robot>\n";
    for (std::size_t j = 0; j < model_.joints.size(); ++j)
      names_.joints.push_back(model_.joints[j].type == JointType::spherical ? std::string()
                                                                            : urdf_joint(j));
    names_.links = links_taken_;
    report(m);
    report_.counts.push_back({"links", link_count_});
    report_.counts.push_back({"joints", joint_count_});
    files_.insert(files_.begin(), {std::string(task_.name), std::move(xml_)});
    return std::move(files_);
  }

 private:
  static std::string free_name(const std::string& wanted, std::set<std::string>& taken) {
    std::string name = wanted;
    for (int i = 2; !taken.insert(name).second; ++i) name = wanted + "_" + std::to_string(i);
    return name;
  }

  // --- elements ------------------------------------------------------------------------------

  static std::string origin(const Pose& t) {
    return "<origin xyz=\"" + three(t.p) + "\" rpy=\"" + three(spatial::to_rpy(t.R)) + "\"/>";
  }

  void link(const std::string& name, const MassProperties& mass, const std::string& shapes) {
    ++link_count_;
    xml_ += "  <link name=\"" + xml_escaped(name) + "\"";
    if (mass.mass == 0 && is_zero(mass.inertia) && shapes.empty()) {
      xml_ += "/>\n";
      return;
    }
    xml_ += ">\n";
    if (mass.mass != 0 || !is_zero(mass.inertia)) {
      const Sym3& i = mass.inertia;
      const auto part = [](const char* n, double v) {
        return std::string(" ") + n + "=\"" + print_xml_number(v) + "\"";
      };
      xml_ += "    <inertial>\n      <origin xyz=\"" + three(mass.com) +
              "\" rpy=\"0 0 0\"/>\n      <mass value=\"" + print_xml_number(mass.mass) +
              "\"/>\n      <inertia" + part("ixx", i.xx) + part("ixy", i.xy) + part("ixz", i.xz) +
              part("iyy", i.yy) + part("iyz", i.yz) + part("izz", i.zz) + "/>\n    </inertial>\n";
    }
    xml_ += shapes + "  </link>\n";
  }
  static bool is_zero(const Sym3& s) {
    return s.xx == 0 && s.yy == 0 && s.zz == 0 && s.xy == 0 && s.yz == 0 && s.xz == 0;
  }

  void joint(const std::string& name, const char* type, const std::string& parent,
             const std::string& child, const Pose& at, const std::string& rest = {}) {
    ++joint_count_;
    joint_xml_ += "  <joint name=\"" + xml_escaped(name) + "\" type=\"" + type +
                  "\">\n    <parent link=\"" + xml_escaped(parent) + "\"/>\n    <child link=\"" +
                  xml_escaped(child) + "\"/>\n    " + origin(at) + "\n" + rest + "  </joint>\n";
  }
  void fixed(const std::string& parent, const std::string& child, const Pose& at) {
    joint(free_name(child + "_fixed", joints_taken_), "fixed", parent, child, at);
  }

  // --- structure -----------------------------------------------------------------------------

  void add_link(std::size_t i) {
    const ExportLink& l = links_[i];
    const ExportLink* on = l.parent < 0 ? nullptr : &links_[static_cast<std::size_t>(l.parent)];
    const std::string parent = on ? on->name : base_;
    const Pose parent_T_joint = on ? spatial::inverse(on->joint_T_link) : Pose{};
    if (l.joint_count == 0) {
      link(l.name, {}, bodies_[i + 1]);
      fixed(parent, l.name, spatial::compose(parent_T_joint, l.joint_T_link));
      if (l.has_mass) ++(l.joint < 0 ? merged_in_base_ : merged_);
      return;
    }
    std::string below = parent;
    Pose before = parent_T_joint;
    for (std::int32_t k = 0; k < l.joint_count; ++k) {
      const auto j = static_cast<std::size_t>(l.joint + 1 - l.joint_count + k);
      const JointModel& m = model_.joints[j];
      const bool is_last = k + 1 == l.joint_count;
      // A URDF joint is in its child link's frame. The link's frame can be that when the joint's
      // axis runs through its origin.
      const Pose& t = l.joint_T_link;
      const bool is_direct =
          is_last &&
          (m.type == JointType::prismatic ||
           (m.type == JointType::revolute && t.p[0] == 0 && t.p[1] == 0) || is_identity(t));
      const Pose turn = is_direct ? t : Pose{};
      const std::string name =
          is_direct ? l.name : free_name(l.name + (is_last ? "_body" : "_part"), links_taken_);
      const Pose origin_pose = spatial::compose(spatial::compose(before, m.placement), turn);
      std::string child = name;
      if (m.type == JointType::spherical) {
        below = ball(l.name, below, origin_pose);
        link(name, spatial::in_frame(m.body, spatial::inverse(turn)),
             is_direct ? bodies_[i + 1] : std::string());
        joint(urdf_joint(j), "continuous", below, name, {}, axis_xml({1, 0, 0}) + numbers(m));
      } else {
        link(name, spatial::in_frame(m.body, spatial::inverse(turn)),
             is_direct ? bodies_[i + 1] : std::string());
        const bool is_endless = std::isinf(m.lower) && std::isinf(m.upper);
        const char* type = m.type == JointType::free        ? "floating"
                           : m.type == JointType::prismatic ? "prismatic"
                           : is_endless                     ? "continuous"
                                                            : "revolute";
        const Vec3 axis = spatial::rotate_back(turn, {0, 0, 1});
        joint(urdf_joint(j), type, below, name, origin_pose,
              (m.type == JointType::free ? std::string() : axis_xml(axis)) + numbers(m));
      }
      report_joint(m);
      below = child;
      before = Pose{};
      if (is_last && !is_direct) {
        link(l.name, {}, bodies_[i + 1]);
        fixed(name, l.name, t);
        ++split_;
      }
    }
    if (l.joint_count > 1) sequences_.push_back(l.name);
    if (l.is_row) ++rows_;
  }

  /// Two joints of a ball joint, about z and y, without bodies; the third is the caller's.
  std::string ball(const std::string& name, std::string below, Pose at) {
    const Vec3 axes[] = {{0, 0, 1}, {0, 1, 0}};
    const char* suffix[] = {"_z", "_y"};
    for (int k = 0; k < 2; ++k) {
      const std::string child = free_name(name + suffix[k], links_taken_);
      link(child, {}, {});
      joint(free_name(child, joints_taken_), "continuous", below, child, at, axis_xml(axes[k]));
      below = child;
      at = Pose{};
    }
    balls_.push_back(name);
    return below;
  }

  std::string urdf_joint(std::size_t j) {
    std::string& name = joint_names_[j];
    if (name.empty()) name = free_name(model_.joints[j].name, joints_taken_);
    return name;
  }

  static std::string axis_xml(const Vec3& a) { return "    <axis xyz=\"" + three(a) + "\"/>\n"; }

  std::string numbers(const JointModel& m) {
    std::string out;
    if (coordinate_count(m.type) != 1) return m.passive ? own_words(" passive=\"true\"") : out;
    const auto value = [](double v) {
      return print_xml_number(std::isinf(v) ? (v > 0 ? kNoLimit : -kNoLimit) : v);
    };
    const bool has_range = std::isfinite(m.lower) || std::isfinite(m.upper);
    const bool needs_limit = has_range || m.type == JointType::prismatic;
    if (needs_limit || std::isfinite(m.max_velocity) || std::isfinite(m.max_force)) {
      out += "    <limit";
      if (needs_limit) out += " lower=\"" + value(m.lower) + "\" upper=\"" + value(m.upper) + "\"";
      out +=
          " effort=\"" + value(m.max_force) + "\" velocity=\"" + value(m.max_velocity) + "\"/>\n";
      if (std::isinf(m.max_force) || std::isinf(m.max_velocity) ||
          (needs_limit && (std::isinf(m.lower) || std::isinf(m.upper))))
        ++unlimited_;
    }
    const JointFriction& f = m.friction;
    if (f.viscous != 0 || f.coulomb_positive != 0)
      out += "    <dynamics damping=\"" + print_xml_number(f.viscous) + "\" friction=\"" +
             print_xml_number(f.coulomb_positive) + "\"/>\n";
    if (m.is_coupled())
      out += "    <mimic joint=\"" +
             xml_escaped(urdf_joint(static_cast<std::size_t>(m.coupling.of))) + "\" multiplier=\"" +
             print_xml_number(m.coupling.ratio) + "\" offset=\"" +
             print_xml_number(m.coupling.offset) + "\"/>\n";
    std::string own;
    const auto add = [&](const char* what, double v) {
      own += std::string(" ") + what + "=\"" + print_xml_number(v) + "\"";
    };
    if (m.armature != 0) add("armature", m.armature);
    if (m.spring.stiffness != 0) add("stiffness", m.spring.stiffness), add("rest", m.spring.rest);
    if (f.coulomb_negative != -f.coulomb_positive) add("friction_backward", -f.coulomb_negative);
    if (std::isfinite(m.max_acceleration)) add("acceleration", m.max_acceleration);
    if (std::isfinite(m.max_jerk)) add("jerk", m.max_jerk);
    if (m.passive) own += " passive=\"true\"";
    if (!own.empty()) out += own_words(own);
    return out;
  }
  static std::string own_words(const std::string& attributes) {
    return "    <robomosp" + attributes + "/>\n";
  }

  // --- bodies --------------------------------------------------------------------------------

  Result<void> bodies() {
    bodies_.resize(links_.size() + 1);
    if (!wishes_.with_bodies) {
      report_.notes.emplace_back("Shapes were not written, since bodies = false.");
      return {};
    }
    // Which link an item hangs below, and where in its frame; 0 = none, 1 = the base.
    std::vector<std::size_t> below(task_.items.size(), 0);
    std::vector<Pose> link_T_item(task_.items.size());
    std::map<std::uint64_t, std::string> shared;  // mesh elements by definition
    std::size_t others = 0;
    std::set<std::string> drawn;  // links without designed bodies
    for (std::size_t i = 0; i < task_.items.size(); ++i) {
      const ExportItem& item = task_.items[i];
      if (robot_part(item)) {
        const auto l = static_cast<std::size_t>(link_of(item) + 1);
        if (l > links_.size())
          return error(ErrorCode::internal, "an item refers to a missing link");
        below[i] = l + 1;
      } else if (item.parent >= 0) {
        const auto parent = static_cast<std::size_t>(item.parent);
        below[i] = below[parent];
        link_T_item[i] = spatial::compose(link_T_item[parent], item.pose);
      }
      if (!item.mesh) continue;
      if (below[i] == 0) {
        ++others;
        continue;
      }
      std::string& to = bodies_[below[i] - 1];
      if (is_only_drawn(item)) drawn.insert(below[i] == 1 ? base_ : links_[below[i] - 2].name);
      if (const ExportPrimitive* p = primitive(item)) {
        shape(to, said_exactly(*p), spatial::compose(link_T_item[i], p->pose), item.colour,
              !is_only_drawn(item));
        continue;
      }
      std::string single;
      std::string& mesh = item.definition > 0 ? shared[item.definition] : single;
      if (mesh.empty()) {
        RMP_TRY_ASSIGN(mesh, mesh_element(item));
      }
      shape(to, mesh, link_T_item[i], item.colour, !is_only_drawn(item));
    }
    if (drawn.size() > links_.size())
      report_.notes.emplace_back(
          "The robot has no designed bodies: its generated link geometry was written as visual "
          "shapes, without collision shapes.");
    else
      note({drawn.begin(), drawn.end()},
           "Some links have no designed bodies; their generated geometry was written as visual "
           "shapes, without collision shapes");
    if (others > 0)
      report_.notes.push_back(counted(others, "part that is", "parts that are") +
                              " no part of the robot had to be left out.");
    return {};
  }

  static std::string said_exactly(const ExportPrimitive& p) {
    switch (p.form) {
      case ExportPrimitive::Form::box: return "<box size=\"" + three(p.sizes) + "\"/>";
      case ExportPrimitive::Form::cylinder:
        return "<cylinder radius=\"" + print_xml_number(p.sizes[0]) + "\" length=\"" +
               print_xml_number(p.sizes[1]) + "\"/>";
      case ExportPrimitive::Form::sphere: break;
    }
    return "<sphere radius=\"" + print_xml_number(p.sizes[0]) + "\"/>";
  }

  static void shape(std::string& to, const std::string& form, const Pose& at, const Colour& c,
                    bool collides) {
    const auto tone = [](float v) { return print_rounded(v); };
    const std::string inside =
        "      " + origin(at) + "\n      <geometry>" + form + "</geometry>\n";
    const std::string colour = tone(c.r) + " " + tone(c.g) + " " + tone(c.b) + " " + tone(c.a);
    std::string look = colour;
    std::replace(look.begin(), look.end(), ' ', '_');
    to += "    <visual>\n" + inside + "      <material name=\"colour_" + look +
          "\"><color rgba=\"" + colour + "\"/></material>\n    </visual>\n";
    if (collides) to += "    <collision>\n" + inside + "    </collision>\n";
  }

  /// Makes an STL file; `<mesh filename=.../>` for it.
  Result<std::string> mesh_element(const ExportItem& item) {
    std::string plain;
    for (const char c : item.name)
      plain +=
          (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-'
              ? c
              : '_';
    const std::string stem(task_.name.substr(0, task_.name.rfind('.')));
    const std::string folder = wishes_.mesh_folder.empty() ? stem + "_meshes" : wishes_.mesh_folder;
    const std::string local = folder + "/" + free_name(plain, meshes_taken_) + ".stl";
    RMP_TRY_ASSIGN(std::string bytes, stl_(item));
    files_.push_back({local, std::move(bytes)});
    const std::string uri =
        wishes_.package.empty() ? local : "package://" + wishes_.package + "/" + local;
    return "<mesh filename=\"" + xml_escaped(uri) + "\"/>";
  }

  // --- report --------------------------------------------------------------------------------

  void report_joint(const JointModel& m) {
    if (m.armature != 0) motors_.push_back(m.name);
    if (m.spring.stiffness != 0) springs_.push_back(m.name);
    if (m.friction.coulomb_negative != -m.friction.coulomb_positive) uneven_.push_back(m.name);
    if (m.passive) passive_.push_back(m.name);
    if (std::isfinite(m.max_acceleration) || std::isfinite(m.max_jerk)) jerks_.push_back(m.name);
  }

  static std::string counted(std::size_t n, const char* one, const char* more) {
    return std::to_string(n) + " " + (n == 1 ? one : more);
  }
  void note(const std::vector<std::string>& of, const std::string& what) {
    if (of.empty()) return;
    std::vector<std::string> names;
    for (std::size_t i = 0; i < of.size() && i < 6; ++i) names.push_back(in_quotes(of[i]));
    if (of.size() > 6) names.push_back(std::to_string(of.size() - 6) + " more");
    report_.notes.push_back(what + ": " + enumerate(names) + ".");
  }

  void report(const ExportMechanism& m) {
    const char* const own =
        " has no counterpart in URDF; it is written as an element <robomosp> that only this "
        "program reads";
    if (rows_ > 0)
      report_.notes.push_back("The Denavit-Hartenberg rows of " + counted(rows_, "link", "links") +
                              " became origins and axes.");
    if (split_ > 0)
      report_.notes.push_back(
          counted(split_, "link has a frame", "links have frames") +
          " off the joint's axis, so a link named \"..._body\" moves and carries the frame.");
    if (merged_ > 0)
      report_.notes.push_back("The masses of " + counted(merged_, "fixed link", "fixed links") +
                              " were added to the moving links that carry them.");
    if (merged_in_base_ > 0)
      report_.notes.push_back("The masses of " + counted(merged_in_base_, "link", "links") +
                              " fixed to the base were added to the base.");
    note(balls_,
         "URDF has no ball joint: three continuous joints about z, y and x without bodies between "
         "them replace it, with other coordinates");
    note(sequences_, "Joints of several axes became sequences of joints without bodies between");
    note(motors_, std::string("Motor inertia at the joint") + own);
    note(springs_, std::string("A spring") + own);
    note(uneven_, std::string("Coulomb friction that differs by direction") + own);
    note(passive_, std::string("The absence of a motor at a joint") + own);
    note(jerks_, std::string("A limit of acceleration or jerk") + own);
    if (unlimited_ > 0)
      report_.notes.push_back(counted(unlimited_, "joint has", "joints have") +
                              " limits missing that URDF requires; they were written as 1e16.");
    std::vector<std::string> loops, poses;
    for (const LoopModel& l : model_.loops) loops.push_back(l.name);
    note(loops, "URDF has no closed loops; these were left open");
    for (const ExportPose& p : m.poses) poses.push_back(p.name);
    note(poses, "Named poses were left out; SRDF files contain them");
    for (const std::string& n : m.left_out) report_.notes.push_back(n);
  }

  const ExportTask& task_;
  const UrdfWishes& wishes_;
  const StlWriter& stl_;
  ExportReport& report_;
  UrdfNames& names_;
  const ExportRobot& robot_;
  const RobotModel& model_;
  const std::vector<ExportLink>& links_;
  std::string base_, xml_, joint_xml_;
  std::vector<ExportedFile> files_;
  std::vector<std::string> bodies_;  ///< shapes of the base, then of each link
  std::set<std::string> links_taken_, joints_taken_, meshes_taken_;
  std::map<std::size_t, std::string> joint_names_;
  std::vector<std::string> balls_, sequences_, motors_, springs_, uneven_, passive_, jerks_;
  std::int64_t link_count_ = 0, joint_count_ = 0;
  std::size_t split_ = 0, merged_ = 0, merged_in_base_ = 0, rows_ = 0, unlimited_ = 0;
};

}  // namespace

Result<std::vector<ExportedFile>> write_urdf(const ExportTask& task, const UrdfWishes& wishes,
                                             const StlWriter& stl, ExportReport& report,
                                             UrdfNames* names) {
  if (task.robots.size() != 1)
    return error(
        ErrorCode::unsupported,
        "a URDF file contains one robot, but here are " + std::to_string(task.robots.size()),
        "Export each robot separately.");
  if (!task.robots[0].model || !mechanism(task.robots[0]))
    return error(ErrorCode::unsupported, "the program does not list the robot's links",
                 "Update it; the plugin is newer.");
  UrdfNames unread;
  return UrdfWriter(task, wishes, stl, report, names ? *names : unread).run();
}

}  // namespace robomosp::robot_files
