// SPDX-License-Identifier: Apache-2.0
// Types with names that several commands share; those of one command's tables are beside them.
#include <algorithm>
#include <initializer_list>
#include <string>
#include <utility>

#include "ioci/core/argument_types.h"
#include "ioci/core/commands.h"
#include "ioci/core/record_params.h"
#include "ioci/robot/robots.h"
#include "ioci/trajectory/segments.h"
#include "kernel/check.h"
#include "kernel/type.h"

namespace robomosp::ioci {
namespace {

/// The arguments of a command as a map: of parts, members and the like that another command takes
/// as a list. Without `id` and what `without` names.
std::string arguments_of(std::string_view command,
                         std::initializer_list<std::string_view> without = {}) {
  for (const auto& [file, make] : CommandFile::all())
    for (CommandSpec& spec : make()) {
      if (spec.name != command) continue;
      give_argument_types(spec);
      std::erase_if(spec.params, [&](const ParamSpec& p) {
        return p.name == "id" || std::find(without.begin(), without.end(), p.name) != without.end();
      });
      return map_type(spec.params);
    }
  RMP_CHECK(false, std::string(command).c_str());
  return {};
}

std::string with_placement(Schema s, const char* frame) {
  for (ParamSpec& p : placement_fields(frame)) s.push_back(std::move(p));
  return map_type(s);
}

std::string part_type() { return arguments_of("object.add_part"); }
std::string tcp_type() { return arguments_of("object.add_tcp"); }
std::string placed_object_type() { return arguments_of("world.add_object"); }
std::string binding_type() {
  return arguments_of("program.bind", {"world", "name_there", "program"});
}
std::string link_type() {
  Schema s = link_params();
  param_named(s, "joint").default_value = Value(model::kJointWords[0]);
  // robot.dh_table calls them so.
  ParamSpec link = optional("link", "string", "", "The name, as robot.dh_table gives it.");
  ParamSpec type = optional("type", "string", "", "The joint, as robot.dh_table gives it.");
  s.push_back(noted(std::move(link), "@advanced"));
  s.push_back(noted(std::move(type), "@advanced"));
  return map_type(s);
}
std::string body_type() {
  return with_placement({needed("what", "ref:object|solid", "", "An object or solid.")},
                        "the link");
}
std::string mass_type() {
  return "map{mass?: real [kg] @min(0) \"The mass.\"; com?: vec3 [m] \"Centre of mass.\"; "
         "inertia?: vec(Ixx, Iyy, Izz, Ixy, Iyz, Ixz) or matrix(3, 3) \"About the centre of "
         "mass.\"}";
}
std::string parameter_type() {
  return "expression or map{value?: expression; expression?: string; unit?: string; description?: "
         "string; text?: string; uses?: list<string>}";
}
/// Of a provider: its parameters have these types.
std::string setting_type() { return "bool or int or real or string or real[]"; }
/// Of a program: structures and arrays contain further values.
std::string program_value_type() {
  return "bool or real or string or real[] or list<type:program_value> or "
         "map<type:program_value>";
}
std::string segment_type() {
  Schema s{
      optional("shape", "provider:curve|segment|joint_segment(name)", "",
               "Curve, or motion of joints."),
      optional("points", "list<vec3 or pose> or matrix", "", "Control poses."),
      optional("joints", "list<joints> or matrix", "", "Joint vectors of a motion of joints."),
      optional("law", "provider:motion_law or map<type:setting>{name?: string}", "",
               "How the tool runs along a curve."),
      optional("orientation", "provider:orientation or map<type:setting>{name?: string}", "",
               "How the tool turns along a curve."),
      optional("turning", "provider:motion_law or map<type:setting>{name?: string}", "",
               "A motion law for the turn."),
      optional("transition",
               "enum(none|smooth) or map{distance?: real [m] @min(0); speed?: real [m/s] @min(0)}",
               "", "From the segment before."),
      optional("params", "map<type:setting> @advanced", "", "Parameters of shape and laws."),
      optional("trajectory", "ref:trajectory @when(shape is absent)", "",
               "A stored trajectory that is run instead.")};
  for (ParamSpec& p : s)
    if (p.name != "trajectory" && p.name != "transition" && p.name != "shape")
      p.type += " @when(trajectory is absent)";
  for (ParamSpec& p : placement_fields("the trajectory")) {
    s.push_back(noted(std::move(p), "@when(trajectory is present)"));
  }
  for (const ParamSpec& p : declared_segment_params()) s.push_back(p);
  // Parameters of the shape, its law and its orientation stand beside the others.
  std::string text = map_type(s);
  text.insert(3, "<type:setting>");
  return text;
}

const NamedType kPartType("part", "map", part_type);
const NamedType kTcpType("tcp", "map", tcp_type);
const NamedType kPlacedObjectType("placed_object", "map", placed_object_type);
const NamedType kBindingType("binding", "map", binding_type);
const NamedType kLinkType("link", "map", link_type);
const NamedType kBodyType("body", "map", body_type);
const NamedType kMassType("mass", "map", mass_type);
const NamedType kParameterType("parameter", "any", parameter_type);
const NamedType kSettingType("setting", "any", setting_type);
const NamedType kProgramValueType("program_value", "any", program_value_type);
const NamedType kSegmentType("segment", "map", segment_type);

}  // namespace
}  // namespace robomosp::ioci
