// SPDX-License-Identifier: Apache-2.0
#include "ioci/core/argument_types.h"

#include <string>
#include <vector>

#include "kernel/text.h"
#include "kernel/type.h"

namespace robomosp::ioci {
namespace {

constexpr std::string_view kOfRobot = "joints of id or member:pose of id";
constexpr std::string_view kOfWorldRobot = "joints of robot or member:pose of robot";
constexpr std::string_view kWordsType = "string or list<string>";

constexpr ArgumentType kArgumentTypes[] = {
    // Joint space.
    {"q", "world.clearance world.collisions world.distances",
     "joints or member:pose or map<joints or string>"},
    {"q", "robot.rotation_vector",
     "joints of id or member:pose of id or matrix(3, 3) or matrix(4, 4)"},
    {"q", "world.simulate_dynamics", kOfWorldRobot},
    {"q", "world.add_robot", kOfWorldRobot},
    {"q", "world.load_element", "joints of name or string"},
    {"q", "view.*", "joints of what or member:pose of what"},
    {"q", "world.*", kOfWorldRobot},
    {"q", "*", kOfRobot},
    {"seed", "robot.solve_ik_batch",
     "joints of id or member:pose of id or list<joints of id or member:pose of id>"},
    {"seed", "*", kOfRobot},
    {"qd", "world.*", "any<joints(velocity) of robot>"},
    {"qd", "*", "joints(velocity) of id"},
    {"qdd", "*", "joints(acceleration) of id"},
    {"tau", "robot.simulate", "joints(force) of id or ref:recording"},
    {"tau", "world.*", "joints(force) of robot or ref:recording"},
    {"tau", "*", "joints(force) of id"},
    {"from", "world.plan_path", kOfWorldRobot},
    {"to", "world.plan_path", kOfWorldRobot},
    {"reference", "robot.simulate", "ref:recording or joints of id or member:pose of id"},
    {"reference", "world.*", "ref:recording or joints of robot or member:pose of robot"},
    {"path", "world.check_path", "list<joints of robot or member:pose of robot>"},
    {"poses", "robot.create", "map<joints>"},
    {"joints", "robot.close", "map<joints of id>"},
    {"values", "robot.joints_from_axes", "any<real[]>"},
    {"value", "robot.set_joint robot.add_joint", "real or real[]"},
    // Members of a robot.
    {"link", "world.attach", "member:link_or_tool of robot"},
    {"link", "robot.add_tool robot.set_tool robot.attach", "member:link_or_base of id or int"},
    {"link", "robot.*", "member:link of id or int"},
    {"joint", "robot.*", "member:joint of id or int"},
    {"joint", "program.bind", "member:joint of robot"},
    {"tip", "world.*", "member:tip of robot"},
    {"tip", "recording.torque_residual", "member:tip"},
    {"tip", "recording.*", "member:tip of robot"},
    {"tip", "*", "member:tip of id"},
    {"tool", "robot.set_payload robot.set_tool robot.tool", "member:tool of id"},
    {"tool", "robot.detach", "member:attached of id"},
    {"from", "robot.change_tool", "member:attached of id"},
    {"tcp", "robot.attach robot.change_tool", "bool or member:tcp of tool"},
    {"branch", "*", "string or list<string> or map<string or real>"},
    {"node", "solid.*", "member:node of id"},
    {"parent", "solid.*", "member:node of id"},
    {"copy", "solid.*", "member:node of id"},
    {"part", "object.*", "member:part of id"},
    {"on", "object.place", "member:part of id"},
    {"feature", "object.place", "int or string"},
    {"on_feature", "object.place", "int or string"},
    {"a", "robot.allow_pair robot.forbid_pair robot.forget_pair robot.self_collisions",
     "member:body of id"},
    {"b", "robot.allow_pair robot.forbid_pair robot.forget_pair robot.self_collisions",
     "member:body of id"},
    {"a", "world.*_pair world.collisions world.distances", "member:body of id"},
    {"b", "world.*_pair world.collisions world.distances", "member:body of id"},
    {"a", "robot.add_loop robot.set_loop", "type:frame_on_link"},
    {"b", "robot.add_loop robot.set_loop", "type:frame_on_link"},
    // Members of a world.
    {"robot", "world.attach world.plan_path world.check_path world.add_task world.add_program",
     "member:robot of id"},
    {"robot", "program.from_trajectory", "any<member:robot of world>"},
    {"robot", "world.*", "member:robot of id or ref:robot"},
    {"trajectory", "program.from_trajectory", "any<member:trajectory of world>"},
    {"trajectory", "world.simulate_dynamics", "any<member:trajectory of id>"},
    {"trajectory", "robot.set_base", "ref:trajectory or path(open: *.tjc)"},
    {"trajectory", "world.*", "member:trajectory of id or ref:trajectory"},
    {"base_trajectory", "world.*", "any<member:trajectory of id>"},
    {"path_robot", "view.*", "member:robot of what"},
    {"path_robot", "world.*", "member:robot of id"},
    {"object", "world.*", "member:object of id"},
    {"member", "world.*", "member:member of id"},
    {"signal", "world.*", "member:signal of id"},
    {"signal", "*", "member:signal of world"},
    {"task", "world.run_task", "member:task of id or list<member:task of id>"},
    {"task", "program.from_task", "any<member:task of world>"},
    {"program", "world.run_task", "member:program of id or list<member:program of id>"},
    {"frame", "program.bind program.run_remote", "member:frame of world"},
    // Recordings.
    {"columns",
     "recording.plot recording.csv recording.values recording.replay recording.replay_data "
     "recording.residual recording.compare",
     "member:column of id or list<member:column of id>"},
    {"columns", "recording.append",
     "list<map{name: string; values: list; unit?: string; doc?: string}>"},
    {"columns", "recording.create",
     "list<string or map{name: string; values?: list; unit?: string; doc?: string}>"},
    {"columns", "run.rows trajectory.plot", "list<string>"},
    {"columns", "robot.create", "list<string>"},
    {"column", "recording.*", "member:column of id"},
    {"x", "recording.plot recording.heat_map", "member:column of id"},
    {"y", "recording.heat_map", "member:column of id"},
    {"quantities", "recording.compute", kWordsType},
    {"tip_columns", "*", "list<member:column of tip_wrench>"},
    {"tip_wrench", "*", "any<ref:recording>"},
    {"tip_force", "robot.simulate recording.* world.*",
     "vec3 or list<expression> or matrix(, 3) or string or map"},
    {"tip_force", "*", "vec3 or list<expression> or matrix(, 3)"},
    {"tip_moment", "*", "vec3 or list<expression> or matrix(, 3)"},
    {"with", "recording.compare", "any<ref:recording>"},
    {"with", "recording.plot", "ref:recording or list<ref:recording>"},
    {"curve", "recording.heat_map", "matrix or list<real[]>"},
    // Providers.
    {"provider", "robot.solve_* robot.reachability", "provider:ik"},
    {"provider", "robot.forward_dynamics robot.constraint_forces",
     "provider:forward_dynamics|inverse_dynamics"},
    {"provider", "robot.dynamics_derivatives", "provider:inverse_dynamics|forward_dynamics"},
    {"provider", "robot.generate_code", "any<provider:robot_code>"},
    {"provider", "robot.*", "provider:inverse_dynamics"},
    {"ik", "*", "provider:ik"},
    {"controller", "robot.* world.*", "provider:controller"},
    {"integrator", "*", "provider:integrator"},
    {"engine", "*", "provider:physics"},
    {"planner", "*", "provider:planner"},
    {"retimer", "*", "provider:retimer"},
    {"target", "program.post", "provider:post(name)"},
    {"interface", "provider.* schema.*", "member:interface"},
    {"params", "program.post", "map<type:setting>"},
    {"options", "*", "map<type:setting>"},
    {"settings", "program.*", "map<type:setting>"},
    // Records and what they are made of.
    {"parameters", "*", "map<type:parameter>"},
    {"value", "*.set_parameter", "expression"},
    {"kind", "record.* schema.*", "member:kind"},
    {"links", "robot.create", "any<list<type:link or real[]> or map>"},
    {"parts", "robot.generate_code", "list<string>"},
    {"parts", "object.create", "list<type:part>"},
    {"tcps", "object.create", "list<type:tcp>"},
    {"inertia", "*", kInertiaType},
    {"base_motion", "*", "map<expression>"},
    {"axes", "robot.create robot.set_axes", "list<type:axis>"},
    {"goals", "robot.solve_goals",
     "table{target: pose; tip?: member:tip of id; parts?: string or list<string>; weight?: real "
     "@min(0)}"},
    {"segment", "trajectory.*", "type:segment"},
    {"segments", "trajectory.create", "list<type:segment>"},
    {"edges", "trajectory.along_edges", "list<int or vec3>"},
    {"step", "task.add_step task.set_step", "type:step"},
    {"steps", "task.create", "list<type:step>"},
    {"root", "solid.create", "type:node"},
    {"node", "solid.add_node", "type:node"},
    {"with", "solid.wrap solid.replace_node", "type:node"},
    {"to", "robot.jog", "real or string"},
    {"by", "robot.jog", "real or string"},
    {"axes", "robot.set_joints world.set_robot_q", "list<real or string> or map<real or string>"},
    {"fields", "solid.wrap", "map<real or string or real[] or bool or pose>"},
    {"objects", "world.add_objects", "list<type:placed_object>"},
    {"bindings", "program.run_remote", "list<type:binding>"},
    // Poses and directions.
    {"targets", "robot.solve_ik_batch world.plan_path", "list<pose>"},
    {"targets", "program.compare_targets", "list<string>"},
    {"value", "transform.set transform.add", "real or string"},
    {"euler", "rotation.convert", "map{sequence: string; angles: vec3 [rad]}"},
    {"position", "program.bind", "vec3 or list<expression>"},
    {"rpy", "program.bind", "vec3 or list<expression>"},
    {"section", "*", "string or type:section"},
    {"map", "*", "ref:recording or type:voxels"},
    // Pictures.
    {"background", "*", "enum(studio|dark|white|transparent) or colour"},
    {"colour", "*", "colour"},
    // Runs.
    {"speed", "run.*", "real or enum(max)"},
    {"physics", "program.run world.run_task", "bool or type:task_physics"},
    {"actions", "world.simulate_physics", "list<type:physics_action>"},
    {"objects", "world.simulate_physics", "list<type:physics_object>"},
    {"robots", "world.simulate_physics", "list<type:physics_robot>"},
    {"gravity", "*", "vec3 @shown(m/s^2)"},
    {"terms", "*", "list<enum(gravity|inertial|velocity|friction|external|spring)>"},
    {"value", "world.set_signal", "bool or real"},
    {"lines", "program.run world.run_task", "list<string or real> or map<list<string or real>>"},
    {"lines", "program.run_alone", "list<string or real>"},
    {"values", "program.* world.run_task", "map<type:program_value>"},
    {"inputs", "program.*", "map<type:program_value>"},
    // Servers, events, plugins.
    {"addresses", "server.*", kWordsType},
    {"origins", "server.*", kWordsType},
    {"commands", "server.*", kWordsType},
    {"effects", "server.*", kWordsType},
    {"limits", "server.start", "map<real>"},
    {"topics", "event.subscribe", "list<string>"},
    {"kinds", "event.subscribe", "list<member:kind>"},
    {"records", "event.subscribe", "list<ref:any>"},
    {"providers", "plugin.load", "list<string>"},
    {"meshes", "view.scene", "list<string>"},
    {"texts", "world.unpack", "map<string>"},
    {"geometries", "world.unpack", "map<string>"},
    {"command", "gesture.update ioci.describe schema.*", "member:command"},
    {"setting", "plugin.set", "member:setting of plugin"},
    {"plugin", "plugin.set plugin.settings", "member:module"},
};

constexpr UntypedArgument kUntypedArguments[] = {
    {"value", "record.set object.set solid.set", "The path decides what it is."},
    {"value", "plugin.set", "The setting decides what it is."},
    {"fields", "record.create", "The kind decides which fields there are: record.schema."},
    {"with", "robot.start_run world.start_run",
     "The simulation decides which arguments there are."},
    {"arguments", "gesture.update gesture.start draft.run draft.start connection.call",
     "The command decides which there are."},
    {"params", "connection.call", "The method decides which there are."},
    {"given", "schema.*", "The command decides which arguments there are."},
    {"link", "run.pull run.release", "A name or a number in a robot of the run."},
};

bool fits(std::string_view name, std::string_view pattern) {
  const auto star = pattern.find('*');
  if (star == std::string_view::npos) return name == pattern;
  const std::string_view front = pattern.substr(0, star), back = pattern.substr(star + 1);
  return name.size() >= front.size() + back.size() && name.starts_with(front) &&
         name.ends_with(back);
}

}  // namespace

std::span<const ArgumentType> argument_types() { return kArgumentTypes; }
std::span<const UntypedArgument> untyped_arguments() { return kUntypedArguments; }

bool is_command_among(std::string_view command, std::string_view commands) {
  for (const std::string_view pattern : text::split(commands, ' '))
    if (!pattern.empty() && fits(command, pattern)) return true;
  return false;
}

void give_argument_types(CommandSpec& spec) {
  for (ParamSpec& p : spec.params) {
    const bool is_open =
        p.type == "any" || p.type == "map" || p.type == "list" || p.type == "string";
    if (!is_open) continue;
    for (const ArgumentType& t : kArgumentTypes) {
      if (t.argument != p.name || !is_command_among(spec.name, t.commands)) continue;
      // A name may mean a text in some commands and a table in others.
      if (plain_type(t.type) != p.type) continue;
      p.type = t.type;
      break;
    }
  }
}

}  // namespace robomosp::ioci
