// SPDX-License-Identifier: Apache-2.0
#include "ros2_package.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <map>
#include <set>
#include <string_view>
#include <utility>

#include "xml.h"

namespace robomosp::robot_files {
namespace {

/// The shortest text that reads back as the number, which YAML takes for one that need not be
/// whole.
std::string print_yaml_number(double value) {
  char text[64];
  std::string out(text, std::to_chars(text, text + sizeof text, value).ptr);
  if (out.find_first_of(".e") == std::string::npos) out += ".0";
  // YAML 1.1 wants a point before the exponent.
  if (const auto e = out.find('e'); e != std::string::npos && out.find('.') == std::string::npos)
    out.insert(e, ".0");
  return out;
}
std::string package_escaped(std::string_view s) {
  std::string out;
  for (const char c : s) {
    if (c == '&') out += "&amp;";
    else if (c == '<') out += "&lt;";
    else if (c == '>') out += "&gt;";
    else if (c == '"') out += "&quot;";
    else if (c == '\n' || c == '\t' || c == '\r') out += ' ';
    else out += c;
  }
  return out;
}
bool is_name_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); }
bool is_digit(char c) { return c >= '0' && c <= '9'; }
/// Names of joints and links stand in names of parameters, topics and frames.
bool is_name(std::string_view s) {
  return !s.empty() && is_name_letter(s[0]) && std::all_of(s.begin(), s.end(), [](char c) {
    return is_name_letter(c) || is_digit(c) || c == '_';
  });
}

class PackageWriter {
 public:
  PackageWriter(const ExportTask& task, const Ros2Wishes& wishes, const StlWriter& stl,
                ExportReport& report)
      : task_(task),
        wishes_(wishes),
        stl_(stl),
        report_(report),
        robot_(task.robots[0]),
        model_(*robot_.model),
        mechanism_(*mechanism(robot_)) {}

  Result<std::vector<ExportedFile>> run() {
    RMP_TRY(check_words());
    ExportTask urdf = task_;
    const std::string urdf_name = wishes_.package + ".urdf";
    urdf.name = urdf_name;
    urdf.extension = "urdf";
    UrdfWishes wishes{wishes_.package, wishes_.with_bodies, "meshes"};
    const std::size_t notes = report_.notes.size();
    RMP_TRY_ASSIGN(auto files, write_urdf(urdf, wishes, stl_, report_, &names_));
    RMP_TRY(check_names());
    // Poses are in the SRDF here.
    report_.notes.erase(std::remove_if(report_.notes.begin() + static_cast<std::ptrdiff_t>(notes),
                                       report_.notes.end(),
                                       [](const std::string& n) {
                                         return n.starts_with("Named poses") ||
                                                n.starts_with("Rules of which");
                                       }),
                        report_.notes.end());
    has_meshes_ = files.size() > 1;
    sort_joints();
    chains();
    std::string& xml = files.front().bytes;
    xml.insert(xml.rfind("</robot>"), ros2_control());
    files.front().name = "urdf/" + urdf_name;
    files.push_back({"config/" + wishes_.package + ".srdf", srdf()});
    files.push_back({"config/controllers.yaml", controllers()});
    files.push_back({"config/joint_limits.yaml", joint_limits()});
    files.push_back({"config/kinematics.yaml", kinematics()});
    files.push_back({"launch/robot.launch.py", launch()});
    files.push_back({"CMakeLists.txt", cmake()});
    files.push_back({std::string(task_.name), package_xml()});
    return files;
  }

 private:
  struct Group {
    std::string name, tip;
    std::vector<std::size_t> joints;  ///< of the model, from the base on
  };

  // --- names ---------------------------------------------------------------------------------

  Result<void> check_words() const {
    if (const std::string fault = package_name_fault(wishes_.package); !fault.empty())
      return error(ErrorCode::invalid_argument, in_quotes(wishes_.package) + " " + fault,
                   "Give package a name such as \"my_arm_description\".", "package");
    if (!is_name(wishes_.group))
      return error(ErrorCode::invalid_argument,
                   in_quotes(wishes_.group) + " cannot be the name of a group",
                   "Use letters, digits and _, starting with a letter.", "group");
    if (wishes_.email.find('@') == std::string::npos)
      return error(ErrorCode::invalid_argument,
                   in_quotes(wishes_.email) + " is not an e-mail address",
                   "package.xml needs one of the maintainer.", "email");
    int points = 0;
    bool is_version = !wishes_.version.empty() && is_digit(wishes_.version.front()) &&
                      is_digit(wishes_.version.back());
    char before = 0;
    for (const char c : wishes_.version) {
      is_version = is_version && (is_digit(c) || (c == '.' && before != '.'));
      points += c == '.' ? 1 : 0;
      before = c;
    }
    if (!is_version || points != 2)
      return error(ErrorCode::invalid_argument, in_quotes(wishes_.version) + " is not a version",
                   "Give three numbers such as 0.1.0.", "version");
    const auto colon = wishes_.hardware.find('/');
    if (colon == std::string::npos || !is_name(wishes_.hardware.substr(0, colon)) ||
        !is_name(wishes_.hardware.substr(colon + 1)))
      return error(ErrorCode::invalid_argument,
                   in_quotes(wishes_.hardware) + " is not a ros2_control plugin",
                   "Give one such as mock_components/GenericSystem.", "hardware");
    return {};
  }

  Result<void> check_names() const {
    const auto refused = [](const char* what, const std::string& name) {
      return error(ErrorCode::invalid_argument,
                   std::string("the ") + what + " " + in_quotes(name) +
                       " has a name that is not valid in ROS 2",
                   "Rename it: letters, digits and _, starting with a letter.");
    };
    for (const std::string& name : names_.links)
      if (!is_name(name)) return refused("link", name);
    for (const std::string& name : names_.joints)
      if (!name.empty() && !is_name(name)) return refused("joint", name);
    if (names_.links.contains("world"))
      return error(ErrorCode::invalid_argument,
                   "the link \"world\" has the name of the frame to which ROS 2 fixes robots",
                   "Rename it.");
    for (const ExportPose& p : mechanism_.poses)
      if (!is_name(p.name)) return refused("pose", p.name);
    return {};
  }

  // --- structure -----------------------------------------------------------------------------

  void sort_joints() {
    std::vector<std::string> others, moved;
    for (std::size_t j = 0; j < model_.joints.size(); ++j) {
      const JointModel& m = model_.joints[j];
      if (coordinate_count(m.type) != 1) others.push_back(in_quotes(m.name));
      else if (m.is_coupled() || m.passive)
        moved.push_back(in_quotes(names_.joints[j])), stated_.push_back(j);
      else driven_.push_back(j), stated_.push_back(j);
    }
    const auto list = [](const std::vector<std::string>& all) {
      std::string out;
      for (std::size_t i = 0; i < all.size() && i < 6; ++i) out += (i ? ", " : "") + all[i];
      return out + (all.size() > 6 ? " and others" : "");
    };
    if (!others.empty())
      report_.notes.push_back(
          "Joints with several coordinates are left out of ros2_control, poses and controllers: " +
          list(others) + ".");
    if (!moved.empty())
      report_.notes.push_back(
          "Joints without their own motor have states but no commands: " + list(moved) + ".");
  }

  /// One group for each end of the tree: the joints from the base to it.
  void chains() {
    const auto& joints = model_.joints;
    std::vector<bool> has_child(joints.size(), false);
    for (const JointModel& j : joints)
      if (j.parent >= 0) has_child[static_cast<std::size_t>(j.parent)] = true;
    std::vector<std::size_t> ends;
    for (std::size_t j = 0; j < joints.size(); ++j)
      if (!has_child[j]) ends.push_back(j);
    for (const std::size_t end : ends) {
      Group g;
      g.name = ends.size() == 1 ? wishes_.group : wishes_.group + "_" + names_or_link(end);
      for (auto j = static_cast<std::int32_t>(end); j >= 0;
           j = joints[static_cast<std::size_t>(j)].parent)
        g.joints.push_back(static_cast<std::size_t>(j));
      std::reverse(g.joints.begin(), g.joints.end());
      // The last frame that this joint carries, such as the tool; else its last link.
      for (std::size_t l = 0; l < mechanism_.links.size(); ++l)
        if (mechanism_.links[l].joint == static_cast<std::int32_t>(end))
          g.tip = mechanism_.links[l].name;
      for (std::size_t f = 0; f < mechanism_.frames.size(); ++f) {
        const std::int32_t link = mechanism_.frames[f].link;
        if (link >= 0 && mechanism_.links[static_cast<std::size_t>(link)].joint ==
                             static_cast<std::int32_t>(end))
          g.tip = names_.frames[f];
      }
      if (!g.tip.empty()) groups_.push_back(std::move(g));
    }
  }
  [[nodiscard]] std::string names_or_link(std::size_t joint) const {
    return names_.joints[joint].empty() ? "end" + std::to_string(joint + 1) : names_.joints[joint];
  }

  // --- files ---------------------------------------------------------------------------------

  static std::string param(const std::string& name, const std::string& value) {
    return "        <param name=\"" + name + "\">" + value + "</param>\n";
  }

  [[nodiscard]] double shown(std::size_t joint) const {
    const JointModel& m = model_.joints[joint];
    const auto at = static_cast<std::size_t>(m.q_index);
    const double q = m.q_index >= 0 && at < robot_.q.size() ? robot_.q[at] : 0;
    return m.is_coupled() ? m.coupling.ratio * q + m.coupling.offset : q;
  }

  std::string ros2_control() const {
    std::string out = "  <ros2_control name=\"" + wishes_.package +
                      "\" type=\"system\">\n    <hardware>\n"
                      "      <plugin>" +
                      wishes_.hardware + "</plugin>\n    </hardware>\n";
    for (const std::size_t j : stated_) {
      const JointModel& m = model_.joints[j];
      out += "    <joint name=\"" + names_.joints[j] + "\">\n";
      if (std::find(driven_.begin(), driven_.end(), j) != driven_.end()) {
        out += "      <command_interface name=\"" + wishes_.command + "\">\n";
        const double most = wishes_.command == "velocity" ? m.max_velocity : m.max_force;
        const double low = wishes_.command == "position" ? m.lower : -most;
        const double high = wishes_.command == "position" ? m.upper : most;
        if (std::isfinite(low)) out += param("min", print_yaml_number(low));
        if (std::isfinite(high)) out += param("max", print_yaml_number(high));
        out += "      </command_interface>\n";
      } else if (m.is_coupled()) {
        const auto& of = names_.joints[static_cast<std::size_t>(m.coupling.of)];
        out += "      <param name=\"mimic\">" + of + "</param>\n      <param name=\"multiplier\">" +
               print_yaml_number(m.coupling.ratio) + "</param>\n";
      }
      out += "      <state_interface name=\"position\">\n" +
             param("initial_value", print_yaml_number(shown(j))) +
             "      </state_interface>\n      <state_interface name=\"velocity\"/>\n";
      if (wishes_.command == "effort") out += "      <state_interface name=\"effort\"/>\n";
      out += "    </joint>\n";
    }
    return out + "  </ros2_control>\n";
  }

  std::string link_name(std::int32_t link) const {
    return link < 0 ? names_.base : mechanism_.links[static_cast<std::size_t>(link)].name;
  }

  std::string srdf() {
    std::string out =
        "<?xml version=\"1.0\"?>\n<robot name=\"" + package_escaped(robot_.name) + "\">\n";
    for (const Group& g : groups_)
      out += "  <group name=\"" + g.name + "\">\n    <chain base_link=\"" + names_.base +
             "\" tip_link=\"" + g.tip + "\"/>\n  </group>\n";
    if (groups_.size() > 1) {
      out += "  <group name=\"" + wishes_.group + "\">\n";
      for (const Group& g : groups_) out += "    <group name=\"" + g.name + "\"/>\n";
      out += "  </group>\n";
    }
    for (const ExportPose& p : mechanism_.poses) {
      out += "  <group_state name=\"" + p.name + "\" group=\"" + wishes_.group + "\">\n";
      for (const std::size_t j : driven_)
        if (const auto at = static_cast<std::size_t>(model_.joints[j].q_index); at < p.q.size())
          out += "    <joint name=\"" + names_.joints[j] + "\" value=\"" +
                 print_yaml_number(p.q[at]) + "\"/>\n";
      out += "  </group_state>\n";
    }
    for (const std::size_t j : stated_)
      if (std::find(driven_.begin(), driven_.end(), j) == driven_.end())
        out += "  <passive_joint name=\"" + names_.joints[j] + "\"/>\n";
    out +=
        "  <virtual_joint name=\"fixed_base\" type=\"fixed\" parent_frame=\"world\" child_link=\"" +
        names_.root + "\"/>\n";
    const bool knows_pairs =
        mechanism_.struct_size >= offsetof(ExportMechanism, pairs) + sizeof mechanism_.pairs;
    if (knows_pairs)
      for (const ExportPair& p : mechanism_.pairs)
        out += "  <disable_collisions link1=\"" + link_name(p.a) + "\" link2=\"" + link_name(p.b) +
               "\" reason=\"" + reason(p) + "\"/>\n";
    return out + "</robot>\n";
  }

  static const char* reason(const ExportPair& p) {
    switch (p.why) {
      case ExportPair::Why::adjacent: return "Adjacent";
      case ExportPair::Why::never: return "Never";
      case ExportPair::Why::always: return "Always";
      case ExportPair::Why::rule: break;
    }
    return "User";
  }

  [[nodiscard]] std::string controller() const { return wishes_.group + "_controller"; }

  std::string controllers() const {
    std::string out = "controller_manager:\n  ros__parameters:\n    update_rate: " +
                      std::to_string(static_cast<int>(std::lround(wishes_.rate))) +
                      "\n    joint_state_broadcaster:\n"
                      "      type: joint_state_broadcaster/JointStateBroadcaster\n";
    if (driven_.empty()) return out;
    out += "    " + controller() +
           ":\n      type: joint_trajectory_controller/JointTrajectoryController\n" + controller() +
           ":\n  ros__parameters:\n    joints:\n";
    for (const std::size_t j : driven_) out += "      - " + names_.joints[j] + "\n";
    out += "    command_interfaces:\n      - " + wishes_.command +
           "\n    state_interfaces:\n      - position\n      - velocity\n";
    if (wishes_.command != "position") {
      out += "    gains:\n";
      for (const std::size_t j : driven_)
        out += "      " + names_.joints[j] + ": {p: 1.0, i: 0.0, d: 0.0}\n";
    }
    return out;
  }

  std::string joint_limits() const {
    std::string out = "joint_limits:\n";
    if (stated_.empty()) return "joint_limits: {}\n";
    for (const std::size_t j : stated_) {
      const JointModel& m = model_.joints[j];
      out += "  " + names_.joints[j] + ":\n";
      const auto limit = [&](const char* what, double most) {
        const bool has = std::isfinite(most);
        out += std::string("    has_") + what + "_limits: " + (has ? "true" : "false") + "\n";
        if (has) out += std::string("    max_") + what + ": " + print_yaml_number(most) + "\n";
      };
      limit("velocity", m.max_velocity);
      limit("acceleration", m.max_acceleration);
      limit("jerk", m.max_jerk);
    }
    return out;
  }

  std::string kinematics() const {
    std::string out;
    for (const Group& g : groups_)
      out += g.name +
             ":\n  kinematics_solver: kdl_kinematics_plugin/KDLKinematicsPlugin\n"
             "  kinematics_solver_search_resolution: 0.005\n  kinematics_solver_timeout: 0.05\n";
    return out.empty() ? "{}\n" : out;
  }

  std::string launch() const {
    std::string out =
        "\"\"\"Shows the robot and moves its joints by ros2_control.\"\"\"\n"
        "from pathlib import Path\n\n"
        "from ament_index_python.packages import get_package_share_directory\n"
        "from launch import LaunchDescription\n"
        "from launch_ros.actions import Node\n"
        "from launch_ros.parameter_descriptions import ParameterValue\n\n\n"
        "def generate_launch_description():\n"
        "    share = Path(get_package_share_directory(\"" +
        wishes_.package +
        "\"))\n"
        "    urdf = (share / \"urdf\" / \"" +
        wishes_.package +
        ".urdf\").read_text(encoding=\"utf-8\")\n"
        "    description = {\"robot_description\": ParameterValue(urdf, value_type=str)}\n"
        "    controllers = [\"joint_state_broadcaster\"";
    if (!driven_.empty()) out += ", \"" + controller() + "\"";
    return out +
           "]\n"
           "    return LaunchDescription([\n"
           "        Node(package=\"robot_state_publisher\", executable=\"robot_state_publisher\",\n"
           "             parameters=[description]),\n"
           "        Node(package=\"controller_manager\", executable=\"ros2_control_node\",\n"
           "             parameters=[description, str(share / \"config\" / "
           "\"controllers.yaml\")]),\n"
           "    ] + [\n"
           "        Node(package=\"controller_manager\", executable=\"spawner\", "
           "arguments=[name])\n"
           "        for name in controllers\n"
           "    ])\n";
  }

  std::string cmake() const {
    return "cmake_minimum_required(VERSION 3.8)\nproject(" + wishes_.package +
           ")\n\nfind_package(ament_cmake REQUIRED)\ninstall(DIRECTORY config launch" +
           (has_meshes_ ? " meshes" : "") +
           " urdf DESTINATION share/${PROJECT_NAME})\nament_package()\n";
  }
  std::string package_xml() const {
    std::string out =
        "<?xml version=\"1.0\"?>\n"
        "<package format=\"3\">\n  <name>" +
        wishes_.package + "</name>\n  <version>" + wishes_.version + "</version>\n  <description>" +
        package_escaped(wishes_.description) + "</description>\n  <maintainer email=\"" +
        package_escaped(wishes_.email) + "\">" + package_escaped(wishes_.maintainer) +
        "</maintainer>\n  <license>" + package_escaped(wishes_.licence) +
        "</license>\n\n  <buildtool_depend>ament_cmake</buildtool_depend>\n\n";
    for (const char* needed :
         {"controller_manager", "joint_state_broadcaster", "joint_trajectory_controller", "launch",
          "launch_ros", "robot_state_publisher"})
      out += std::string("  <exec_depend>") + needed + "</exec_depend>\n";
    return out +
           "\n  <export>\n    <build_type>ament_cmake</build_type>\n  </export>\n</package>\n";
  }

  const ExportTask& task_;
  const Ros2Wishes& wishes_;
  const StlWriter& stl_;
  ExportReport& report_;
  const ExportRobot& robot_;
  const RobotModel& model_;
  const ExportMechanism& mechanism_;
  UrdfNames names_;
  std::vector<std::size_t> driven_, stated_;  ///< joints of the model with commands, with states
  std::vector<Group> groups_;
  bool has_meshes_ = false;
};

}  // namespace

std::string package_name_fault(const std::string& name) {
  if (name.size() < 2) return "is too short for the name of a package";
  if (name.size() > 100) return "is too long for the name of a package";
  if (!(name[0] >= 'a' && name[0] <= 'z'))
    return "does not begin with a lower-case letter, as package names do";
  for (std::size_t i = 0; i < name.size(); ++i) {
    const char c = name[i];
    if (!((c >= 'a' && c <= 'z') || is_digit(c) || c == '_'))
      return "contains characters other than lower-case letters, digits and _";
    if (c == '_' && (i + 1 == name.size() || name[i + 1] == '_'))
      return "ends with _ or has two of them in a row";
  }
  return {};
}

Result<std::vector<ExportedFile>> write_ros2_package(const ExportTask& task,
                                                     const Ros2Wishes& wishes, const StlWriter& stl,
                                                     ExportReport& report) {
  if (task.name != "package.xml")
    return error(ErrorCode::invalid_argument,
                 "a ROS 2 package is given by its file \"package.xml\", not by " +
                     in_quotes(std::string(task.name)),
                 "Give file = \".../my_robot/package.xml\", or use robot.export_ros2.");
  if (task.robots.size() != 1)
    return error(ErrorCode::unsupported,
                 "a package contains one robot, but here are " + std::to_string(task.robots.size()),
                 "Export each robot separately.");
  if (!task.robots[0].model || !mechanism(task.robots[0]))
    return error(ErrorCode::unsupported, "the program does not list the robot's links",
                 "Update it; the plugin is newer.");
  return PackageWriter(task, wishes, stl, report).run();
}

}  // namespace robomosp::robot_files
