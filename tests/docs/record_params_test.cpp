// SPDX-License-Identifier: Apache-2.0
// Arguments of commands that are fields of records: each field of each kind, set by its command and
// by record.set, gives the same record.
#include "ioci/core/record_params.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <functional>
#include <initializer_list>
#include <iterator>
#include <map>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "docs/examples.h"
#include "ioci/core/commands.h"
#include "kernel/literal.h"
#include "kernel/text.h"
#include "kernel/type.h"
#include "lua/lua_state.h"
#include "model/field_types.h"

namespace robomosp::ioci {
namespace {

Application& fields_app() { return test::examples_app(); }

/// How a field is given where its type does not say what is valid there.
struct Given {
  std::string value;     ///< a literal; "" = one by the type
  std::string with{};    ///< further arguments of the command
  std::string before{};  ///< Lua before record.set
  std::string path{};    ///< for record.set, if it is not the name
  std::string there{};   ///< the value for record.set, if it is another
};

/// A struct of records and the command that sets its fields.
struct Case {
  std::string kind, record;
  std::string path;   ///< of the struct in the kind
  std::string at;     ///< what record.set has in front of a field
  std::string setup;  ///< Lua that makes the records
  /// Lua that calls the command; $ is where `, field = value` goes.
  std::string call;
  /// Lua that makes the same for record.set, if `call` adds an element.
  std::string add;
  std::map<std::string, Given> given;
  /// Fields that the command does not have, and why.
  std::map<std::string, std::string> other{};
};

std::string sample(const ParamSpec& p) {
  const std::string_view type = plain_type(p.type);
  const auto words = words_of(p);
  if (type_tree(p.type).kind == TypeKind::colour) return "\"#204060\"";
  if (!words.empty()) return "\"" + words.back().word + "\"";
  if (type == "bool") return "true";
  if (type == "int") return "3";
  if (type == "vec3") return "{0.125, 0.25, 0.5}";
  if (type == "string") return "\"other\"";
  return p.max <= 0 ? "-0.25" : "0.25";
}

std::string replaced(std::string text, const std::string& with) {
  const auto at = text.find('$');
  if (at != std::string::npos) text.replace(at, 1, with);
  return text;
}

/// What the record is after a script, without its history.
std::string after(const Case& c, const std::string& lua) {
  fields_app().document.clear();
  Session session("fields");
  lua::LuaState state(fields_app(), session, {.print = [](std::string_view) {}, .module_path = {}});
  const auto done = state.run_string(c.setup + "\n" + lua, "fields");
  if (!done.ok()) return "error: " + done.error().sentence() + "\n" + lua;
  const auto described =
      fields_app().dispatch(session, "record.describe", Map{{"id", c.kind + " " + c.record}});
  for (const AnyId id : fields_app().document.now()->list(*kind_from(c.kind)))
    if (fields_app().document.now()->find(id)->name == c.record)
      return literal(Value(describe_record(*fields_app().document.now(), id)));
  return "error: no " + c.kind + " " + c.record;
}

/// The fields that the cases compared or have a reason for, by the struct ("robot links"), with the
/// value that both got.
using Seen = std::map<std::string, std::map<std::string, std::string>>;
Seen& seen() {
  static Seen all;
  return all;
}
std::string struct_name(const std::string& kind, const std::string& path) {
  return path.empty() ? kind : kind + " " + path;
}
/// For structs that a test compares by itself.
void note_seen(const std::string& kind, const std::string& path,
               std::initializer_list<const char*> fields) {
  for (const char* name : fields) seen()[struct_name(kind, path)].try_emplace(name);
}

void compare(const Case& c) {
  const std::string plain = after(c, c.add);
  auto& fields = seen()[struct_name(c.kind, c.path)];
  for (const auto& [name, reason] : c.other) {
    const Schema all = record_params(c.kind, c.path);
    EXPECT_TRUE(find_param(all, name)) << c.kind << " " << c.path << " has no field " << name;
    fields.try_emplace(name);
  }
  for (const ParamSpec& p : record_params(c.kind, c.path)) {
    if (c.other.contains(p.name)) continue;
    const auto it = c.given.find(p.name);
    const Given g = it == c.given.end() ? Given{} : it->second;
    fields[p.name] += g.there.empty() ? g.value : g.there;
    if (g.value == "-") continue;  // one of several spellings of a placement
    const std::string value = g.value.empty() ? sample(p) : g.value;
    const std::string typed = after(c, replaced(c.call, g.with + ", " + p.name + " = " + value));
    const std::string set =
        after(c, c.add + "\n" + g.before + "\nrecord.set{id = " + c.kind + ".get(\"" + c.record +
                     "\"), path = \"" + c.at + (g.path.empty() ? p.name : g.path) +
                     "\", value = " + (g.there.empty() ? value : g.there) + "}");
    EXPECT_EQ(typed, set) << c.kind << " " << c.at << p.name;
    EXPECT_NE(typed, plain) << c.kind << " " << c.at << p.name << " changes nothing";
    EXPECT_FALSE(typed.starts_with("error")) << typed;
  }
}

/// Two scripts make the same of a record.
void expect_same(const Case& c, const std::string& typed, const std::string& set) {
  const std::string a = after(c, typed);
  EXPECT_EQ(a, after(c, set)) << typed;
  EXPECT_FALSE(a.starts_with("error")) << a;
}

const std::string kArm =
    "solid.create{name = \"pin\", root = {kind = \"box\", x = 0.1, y = 0.1, z = 0.1}}\n"
    "robot.create{name = \"arm\", links = {{name = \"a1\", a = 0.3}, {name = \"a2\"}, "
    "{name = \"a3\", a = 0.1}}}";

/// A placement: one spelling counts for all, which the readers of poses have tests for.
std::map<std::string, Given> with_placement(std::map<std::string, Given> given) {
  for (const char* name :
       {"cylindrical", "spherical", "rpy", "xyz", "zyz", "quaternion", "axis_angle", "placement"})
    given[name] = {"-"};
  return given;
}

TEST(RecordParams, LinksHaveEachFieldOfTheRecord) {
  const std::string mass =
      "record.set{id = robot.get(\"arm\"), path = \"links[2].given\", value = "
      "{mass = 1.0}}";
  compare({.kind = "robot",
           .record = "arm",
           .path = "links",
           .at = "links[2].",
           .setup = kArm,
           .call = "robot.set_link{id = \"arm\", link = 2$}",
           .add = "",
           .given = {{"parent", {"\"base\""}},
                     {"joint", {"\"prismatic\""}},
                     {"convention", {"\"mdh\""}},
                     {"origin", {"{0.1, 0, 0.2, 0, 0, 0.3}"}},
                     {"axis",
                      {"{0, 1, 0}", ", origin = {0, 0, 0.2, 0, 0, 0}",
                       "record.set{id = robot.get(\"arm\"), path = \"links[2].origin\", value = "
                       "{0, 0, 0.2, 0, 0, 0}}"}},
                     {"mimic", {"{link = \"a1\", ratio = 2.0, offset = 0.1}"}},
                     {"visible", {"false"}},
                     {"mass", {"1.0", "", "", "given", "{mass = 1.0}"}},
                     {"com", {"", ", mass = 1.0", mass, "com"}},
                     {"inertia", {"{0.02, 0.01, 0.02, 0, 0, 0}", ", mass = 1.0", mass, "inertia"}},
                     {"parts", {"{{what = \"pin\", placement = {position = {0.1, 0, 0.2}}}}"}}}});
}

TEST(RecordParams, MaterialsHaveEachFieldOfTheRecord) {
  compare({.kind = "material",
           .record = "paint",
           .path = "",
           .at = "",
           .setup = "material.create{name = \"paint\", density = 1000}",
           .call = "material.set{id = \"paint\"$}",
           .add = "",
           .given = {{"ambient", {"\"#204060\""}}, {"specular", {"\"#204060\""}}}});
}

TEST(RecordParams, RobotsSolidsTrajectoriesAndWorldsHaveTheirOwnFields) {
  const std::string solver = "{name = \"numeric\", params = {}}";
  compare({.kind = "robot",
           .record = "arm",
           .path = "",
           .at = "",
           .setup = kArm,
           .call = "robot.set{id = \"arm\"$}",
           .add = "",
           .given = {{"convention", {"\"mdh\""}},
                     {"mass_source", {"\"designed\""}},
                     {"base", {"{0.1, 0, 0.2, 0, 0, 0.3}"}},
                     {"tool", {"{0.1, 0, 0.2, 0, 0, 0.3}"}},
                     {"base_parts", {"{{what = \"pin\", placement = {position = {0.1, 0, 0.2}}}}"}},
                     {"base_mass",
                      {"{mass = 2.0, com = {0.1, 0, 0}, inertia = {0.02, 0.01, 0.02, 0, 0, 0}}"}},
                     {"ik", {solver}},
                     {"inverse_dynamics", {"{name = \"newton_euler\", params = {}}"}},
                     {"forward_dynamics", {"{name = \"articulated_bodies\", params = {}}"}},
                     {"controller", {"{name = \"pid\", params = {}}"}}},
           .other = {{"links", "robot.set_link"},
                     {"payload", "robot.set_payload"},
                     {"tools", "robot.add_tool"},
                     {"attached", "robot.attach"},
                     {"tcp", "robot.change_tool"},
                     {"loops", "robot.add_loop"},
                     {"poses", "robot.set_pose"},
                     {"axes", "robot.set_axes"},
                     {"pair_rules", "robot.allow_pair"}}});
  compare(
      {.kind = "solid",
       .record = "pin",
       .path = "",
       .at = "",
       .setup = "material.create{name = \"steel\", density = 7850}",
       .call = "solid.create{name = \"pin\", root = {kind = \"box\", x = 0.1, y = 0.1, z = "
               "0.1}$}",
       .add = "solid.create{name = \"pin\", root = {kind = \"box\", x = 0.1, y = 0.1, z = 0.1}}",
       .given = {{"material", {"\"steel\""}}},
       .other = {{"measured", "solid.set_measured"}, {"nodes", "solid.add_node"}}});
  compare({.kind = "trajectory",
           .record = "seam",
           .path = "",
           .at = "",
           .setup =
               "trajectory.create{name = \"seam\", segments = {{shape = \"line\", points = {{0, "
               "0, 0}, {0.1, 0, 0}}}}}",
           .call = "trajectory.set{id = \"seam\"$}",
           .add = "",
           .given = {},
           .other = {{"segments", "trajectory.add_segment"}, {"along", "trajectory.along_edges"}}});
  compare({.kind = "world",
           .record = "cell",
           .path = "",
           .at = "",
           .setup = "world.create{name = \"cell\"}",
           .call = "world.set{id = \"cell\"$}",
           .add = "",
           .given = {},
           .other = {{"objects", "world.add_object"},
                     {"robots", "world.add_robot"},
                     {"trajectories", "world.add_trajectory"},
                     {"frames", "world.add_frame"},
                     {"lights", "world.add_light"},
                     {"tasks", "world.add_task"},
                     {"programs", "world.add_program"},
                     {"signals", "world.add_signal"},
                     {"attachments", "world.attach"},
                     {"pair_rules", "world.allow_pair"}}});
}

TEST(RecordParams, MembersOfWorldsAndPartsHaveEachFieldOfTheRecord) {
  const std::string cell = kArm + "\nworld.create{name = \"cell\"}";
  compare({.kind = "world",
           .record = "cell",
           .path = "lights",
           .at = "lights[1].",
           .setup = cell,
           .call = "world.add_light{id = \"cell\"$}",
           .add = "world.add_light{id = \"cell\"}",
           .given = with_placement({})});
  compare({.kind = "world",
           .record = "cell",
           .path = "signals",
           .at = "signals[1].",
           .setup = cell,
           .call = "world.add_signal{id = \"cell\", name = \"go\"$}",
           .add = "world.add_signal{id = \"cell\", name = \"go\"}",
           .given = {{"initial", {"1.0"}},
                     {"unit",
                      {"\"m\"", ", kind = \"analogue\"",
                       "record.set{id = world.get(\"cell\"), path = \"signals[1].kind\", value = "
                       "\"analogue\"}"}}},
           .other = {{"name", "It is given in each call."}}});
  compare({.kind = "object",
           .record = "bolt",
           .path = "parts",
           .at = "parts[1].",
           .setup = kArm +
                    "\nmaterial.create{name = \"steel\", density = 7850}\nobject.create{name "
                    "= \"bolt\"}",
           .call = "object.add_part{id = \"bolt\", what = \"pin\"$}",
           .add = "object.add_part{id = \"bolt\", what = \"pin\"}",
           .given = with_placement({{"material", {"\"steel\""}}}),
           .other = {{"what", "It is given in each call."}}});
}

TEST(RecordParams, PlacedMembersHaveEachFieldOfTheRecord) {
  const std::string cell =
      kArm +
      "\nrobot.create{name = \"other\", links = {{a = 0.2}, {a = 0.1}, {}}}\n"
      "solid.create{name = \"plate\", root = {kind = \"box\", x = 0.2, y = 0.1, z = 0.1}}\n"
      "trajectory.create{name = \"seam\", segments = {{shape = \"line\", points = {{0, 0, 0}, "
      "{0.1, "
      "0, 0}}}}}\n"
      "trajectory.create{name = \"other_seam\", segments = {{shape = \"line\", points = {{0, 0, "
      "0}, "
      "{0.2, 0, 0}}}}}\n"
      "task.create{name = \"job\"}\ntask.create{name = \"other_job\"}\n"
      "program.create{name = \"moves\", source = \"PROGRAM moves; BEGIN HALT; ENDPROGRAM;\"}\n"
      "program.create{name = \"rests\", source = \"PROGRAM rests; BEGIN HALT; ENDPROGRAM;\"}\n"
      "world.create{name = \"cell\"}\nworld.add_trajectory{id = \"cell\", trajectory = "
      "\"seam\"}\nworld.add_robot{id = \"cell\", robot = \"arm\"}\n"
      "world.add_object{id = \"cell\", what = \"pin\", name = \"held\"}\n"
      "world.add_object{id = \"cell\", what = \"pin\", name = \"second\"}\n"
      "world.add_robot{id = \"cell\", robot = \"arm\", name = \"twin\"}";
  // Later fields of a table in Lua replace earlier ones, so that required ones are compared, too.
  const auto member = [&](const std::string& list, const std::string& at, const std::string& add,
                          std::map<std::string, Given> given) {
    compare({.kind = "world",
             .record = "cell",
             .path = list,
             .at = at,
             .setup = cell,
             .call = "world." + add + "$}",
             .add = "world." + add + "}",
             .given = with_placement(std::move(given)),
             .other = list == "programs"
                          ? std::map<std::string, std::string>{{"bindings", "program.bind"}}
                          : std::map<std::string, std::string>{}});
  };
  const std::string moving =
      "record.set{id = world.get(\"cell\"), path = \"robots[3].base\", value = \"free_flying\"}";
  member("objects", "objects[3].", "add_object{id = \"cell\", name = \"a\", what = \"pin\"",
         {{"what", {"\"plate\""}}});
  member("robots", "robots[3].", "add_robot{id = \"cell\", name = \"a\", robot = \"arm\"",
         {{"robot", {"\"other\""}},
          {"q", {"{0.1, 0.2, 0.3}"}},
          {"base_trajectory", {"\"seam\"", ", base = \"free_flying\"", moving}}});
  member("trajectories", "trajectories[2].",
         "add_trajectory{id = \"cell\", name = \"a\", trajectory = \"seam\"",
         {{"trajectory", {"\"other_seam\""}}});
  member("frames", "frames[1].", "add_frame{id = \"cell\", name = \"a\"", {});
  member("tasks", "tasks[1].", "add_task{id = \"cell\", name = \"a\", task = \"job\"",
         {{"task", {"\"other_job\""}}, {"robot", {"\"arm\""}}});
  member("programs", "programs[1].", "add_program{id = \"cell\", name = \"a\", program = \"moves\"",
         {{"program", {"\"rests\""}}, {"robot", {"\"arm\""}}});
  member("attachments", "attachments[1].",
         "attach{id = \"cell\", object = \"held\", robot = \"arm\"",
         {{"object", {"\"second\""}}, {"robot", {"\"twin\""}}, {"link", {"\"a2\""}}});
}

TEST(RecordParams, BindingsHaveEachFieldOfTheRecord) {
  const std::string setup =
      kArm +
      "\nprogram.create{name = \"moves\", source = \"PROGRAM moves; BEGIN HALT; ENDPROGRAM;\"}\n"
      "world.create{name = \"cell\"}\nworld.add_robot{id = \"cell\", robot = \"arm\"}\n"
      "world.add_frame{id = \"cell\", name = \"bench\"}\n"
      "world.add_object{id = \"cell\", what = \"pin\"}\n"
      "world.add_signal{id = \"cell\", name = \"go\"}\n"
      "world.add_signal{id = \"cell\", name = \"other\"}\n"
      "world.add_program{id = \"cell\", program = \"moves\"}";
  const auto bound = [&](const std::string& first, std::map<std::string, Given> given,
                         std::map<std::string, std::string> other) {
    compare({.kind = "world",
             .record = "cell",
             .path = "programs.bindings",
             .at = "programs[1].bindings[1].",
             .setup = setup,
             .call = "program.bind{id = \"moves\", " + first + "$}",
             .add = "program.bind{id = \"moves\", " + first + "}",
             .given = std::move(given),
             .other = std::move(other)});
  };
  const char* const point = "Of a point, which must be a variable of the program.";
  std::map<std::string, std::string> never{{"kind", "Each kind has its own fields."},
                                           {"at", point},
                                           {"expression", "Of a value, which must be a variable."}};
  for (const char* name : {"x", "y", "z", "roll", "pitch", "yaw"}) never[name] = point;
  const auto except = [&](std::initializer_list<const char*> names) {
    std::map<std::string, std::string> out = never;
    for (const char* name : names) out[name] = "Not of this kind.";
    return out;
  };
  bound("kind = \"signal\", name = \"done\", to = \"go\"", {},
        except({"frame", "tool", "joint", "reach", "value"}));
  bound("kind = \"robot\", to = \"arm\"", {{"frame", {"\"bench\""}}, {"tool", {"\"a2\""}}},
        except({"name", "to", "joint", "reach", "value"}));
  bound("kind = \"grip\", name = \"hand\"", {{"to", {"\"pin\""}}, {"tool", {"\"a2\""}}},
        except({"frame", "joint", "value"}));
  bound("kind = \"joint\", name = \"7\", to = \"arm\"", {{"joint", {"\"a2\""}}},
        except({"name", "to", "frame", "tool", "reach", "value"}));
  bound("kind = \"free\", name = \"input\"", {}, except({"to", "frame", "tool", "joint", "reach"}));
}

TEST(RecordParams, ToolsLoopsPosesAndAxesHaveEachFieldOfTheRecord) {
  const auto of_arm = [](const std::string& list, const std::string& setup, const std::string& call,
                         std::map<std::string, Given> given,
                         std::map<std::string, std::string> other) {
    compare({.kind = "robot",
             .record = "arm",
             .path = list,
             .at = list + "[1].",
             .setup = setup,
             .call = call,
             .add = replaced(call, ""),
             .given = with_placement(std::move(given)),
             .other = std::move(other)});
  };
  of_arm("tools", kArm, "robot.add_tool{id = \"arm\", name = \"camera\", link = \"a1\"$}",
         {{"link", {"\"a2\""}}}, {{"payload", "robot.set_payload"}});
  of_arm("attached",
         kArm +
             "\nsolid.create{name = \"plate\", root = {kind = \"box\", x = 0.2, y = 0.1, z = "
             "0.1}}",
         "robot.attach{id = \"arm\", tool = \"pin\", name = \"pen\", link = \"a1\"$}",
         {{"link", {"\"a2\""}}}, {{"what", "It is the argument tool."}});
  of_arm("poses", kArm, "robot.set_pose{id = \"arm\", name = \"up\", q = {0, 0, 0}$}",
         {{"q", {"{0.1, 0.2, 0.3}"}}}, {});
  of_arm("loops", kArm,
         "robot.add_loop{id = \"arm\", name = \"pin\", kind = \"point\", a = {link = \"a1\"}, "
         "b = {link = \"base\"}$}",
         {},
         {{"link_a", "Compared below."},
          {"link_b", "Compared below."},
          {"a", "Compared below."},
          {"b", "Compared below."}});
  of_arm("axes", kArm,
         "robot.set_axes{id = \"arm\", axes = {{name = \"J1\", link = \"a1\"$}, {name = "
         "\"J2\", link = \"a2\"}, {name = \"J3\", link = \"a3\"}}}",
         {{"sign", {"-1"}}, {"coupled", {"{{link = \"a2\", ratio = 2.0}}"}}},
         {{"link", "Each joint has one axis."},
          {"unit", "The joint decides it."},
          {"external", "Compared below."}});
  const auto axes = [](const std::string& more) {
    return "robot.set_axes{id = \"arm\", axes = {{name = \"J1\", link = \"a1\"}, {name = \"J2\", "
           "link = \"a2\"}, {name = \"E1\", link = \"a3\"" +
           more + "}}}";
  };
  expect_same({.kind = "robot",
               .record = "arm",
               .path = "axes",
               .at = "",
               .setup = kArm,
               .call = "",
               .add = "",
               .given = {}},
              axes(", external = true"),
              axes("") +
                  "\nrecord.set{id = robot.get(\"arm\"), path = \"axes[3].external\", value "
                  "= true}");
}

TEST(RecordParams, SegmentsHaveEachFieldOfTheRecord) {
  const char* const stored = "Of a stored trajectory only.";
  std::map<std::string, std::string> other{{"shape", "It is given in each call."},
                                           {"joints", "Of shapes that move joints."},
                                           {"stored", "It is trajectory there."}};
  for (const char* name : {"position", "cylindrical", "spherical", "rpy", "xyz", "zyz",
                           "quaternion", "axis_angle", "placement"})
    other[name] = stored;
  compare({.kind = "trajectory",
           .record = "seam",
           .path = "segments",
           .at = "segments[1].",
           .setup = "trajectory.create{name = \"seam\", segments = {{shape = \"line\", points = "
                    "{{0, 0, 0}, {0.1, 0, 0}}}}}",
           .call = "trajectory.get(\"seam\"):set_segment(1, {shape = \"line\"$})",
           .add = "",
           .given = {{"law", {"{name = \"constant_speed\", params = {}}"}},
                     {"orientation", {"{name = \"slerp\", params = {}}"}},
                     {"turning", {"{name = \"constant_speed\", params = {}}"}},
                     {"points", {"{{0, 0, 0, 0, 0, 0}, {0.2, 0, 0, 0, 0, 0}}"}},
                     {"transition", {"\"none\"", "", "", "transition", "{is_smooth = false}"}}},
           .other = other});
}

TEST(RecordParams, NodesHaveEachFieldOfTheRecord) {
  std::map<std::string, std::string> other{{"kind", "It is given in each call."},
                                           {"parent", "The tree says it."}};
  for (const char* name : {"sizes", "select", "is_global", "is_centred"})
    other[name] = "Compared below.";
  for (const char* name : {"profile", "geometry", "primitive"})
    other[name] = "It has a form of its own: solid_nodes_test.";
  const std::string box =
      "solid.create{name = \"pin\", root = {kind = \"box\", name = \"body\", x = 0.1, y = 0.1, z = "
      "0.1";
  compare({.kind = "solid",
           .record = "pin",
           .path = "nodes",
           .at = "nodes[1].",
           .setup = "",
           .call = box + "$}}",
           .add = box + "}}",
           .given = with_placement({}),
           .other = other});
  const Case pin{.kind = "solid",
                 .record = "pin",
                 .path = "nodes",
                 .at = "nodes[2].",
                 .setup = "",
                 .call = "",
                 .add = "",
                 .given = {}};
  const auto tree = [](const std::string& root, const std::string& child) {
    return "solid.create{name = \"pin\", root = {name = \"root\", " + root +
           ", children = {{name = \"body\", " + child + "}}}}";
  };
  const auto set = [&](const char* path, const char* value) {
    return std::string("\nrecord.set{id = solid.get(\"pin\"), path = \"") + path +
           "\", value = " + value + "}";
  };
  const std::string cube = "kind = \"box\", x = 0.1, y = 0.1, z = 0.1";
  const std::string rod = "kind = \"cylinder\", radius = 0.1, height = 0.2";
  const std::string moved = "kind = \"union\", position = {0.5, 0, 0}";
  expect_same(pin, tree(moved, "kind = \"box\", x = 0.3, y = 0.1, z = 0.1"),
              tree(moved, cube) + set("nodes[2].x", "0.3"));
  expect_same(pin, tree(moved, rod + ", centred = true"),
              tree(moved, rod) + set("nodes[2].is_centred", "true"));
  expect_same(pin, tree(moved, cube + ", frame = \"global\""),
              tree(moved, cube) + set("nodes[2].is_global", "true"));
  const std::string fillet = "kind = \"fillet\", radius = 0.01";
  expect_same(pin, tree(fillet + ", select = \"top\"", cube),
              tree(fillet, cube) + set("nodes[1].select", "\"top\""));
}

TEST(RecordParams, SidesOfALoopAreLinkAndFrame) {
  Case c{.kind = "robot",
         .record = "arm",
         .path = "loops",
         .at = "",
         .setup = kArm,
         .call = "",
         .add = "",
         .given = {}};
  const std::string made =
      after(c,
            "robot.add_loop{id = \"arm\", name = \"pin\", kind = \"point\", a = {link = \"a2\", "
            "position = {0.1, 0, 0}}, b = {link = \"a1\", placement = {0, 0.2, 0, 0, 0, 0.3}}}");
  std::string lua =
      "robot.add_loop{id = \"arm\", name = \"pin\", kind = \"point\", a = {link = \"a1\"}, b = "
      "{link = \"base\"}}\n";
  for (const char* set :
       {"link_a\", value = \"a2\"", "link_b\", value = \"a1\"",
        "a\", value = {position = {0.1, 0, 0}}", "b\", value = {0, 0.2, 0, 0, 0, 0.3}"})
    lua += "record.set{id = robot.get(\"arm\"), path = \"loops[1]." + std::string(set) + "}\n";
  EXPECT_EQ(made, after(c, lua));
  EXPECT_FALSE(made.starts_with("error")) << made;
}

TEST(RecordParams, ObjectsAndTheirCentrePointsHaveEachFieldOfTheRecord) {
  compare({.kind = "object",
           .record = "bolt",
           .path = "",
           .at = "",
           .setup = kArm,
           .call = "object.create{name = \"bolt\", parts = {{what = \"pin\"}}$}",
           .add = "object.create{name = \"bolt\", parts = {{what = \"pin\"}}}",
           .given = {},
           .other = {{"parts", "object.add_part"},
                     {"tcps", "object.add_tcp"},
                     {"measured", "object.set_measured"}}});
  compare({.kind = "object",
           .record = "bolt",
           .path = "tcps",
           .at = "tcps[1].",
           .setup = kArm + "\nobject.create{name = \"bolt\", parts = {{what = \"pin\"}}}",
           .call = "object.add_tcp{id = \"bolt\", name = \"tip\"$}",
           .add = "object.add_tcp{id = \"bolt\", name = \"tip\"}",
           .given = with_placement({})});
}

TEST(RecordParams, MeasuredMassesAndPayloadsHaveEachFieldOfTheRecord) {
  const std::map<std::string, Given> given = {{"mass", {"2.0"}},
                                              {"inertia", {"{0.02, 0.01, 0.02, 0, 0, 0}"}}};
  const std::string whole = ", mass = 1.0, com = {0, 0, 0}, inertia = {0.02, 0.02, 0.02, 0, 0, 0}";
  for (const std::string kind : {"solid", "object"})
    compare({.kind = kind,
             .record = "pin",
             .path = "measured",
             .at = "measured.",
             .setup = kArm + "\nobject.create{name = \"pin\", parts = {{what = \"pin\"}}}",
             .call = kind + ".set_measured{id = \"pin\"" + whole + "$}",
             .add = kind + ".set_measured{id = \"pin\"" + whole + "}",
             .given = given});
  compare({.kind = "robot",
           .record = "arm",
           .path = "payload",
           .at = "payload.",
           .setup = kArm,
           .call = "robot.set_payload{id = \"arm\", mass = 1.0$}",
           .add = "robot.set_payload{id = \"arm\", mass = 1.0}",
           .given = given});
  compare({.kind = "robot",
           .record = "arm",
           .path = "tools.payload",
           .at = "tools[1].payload.",
           .setup = kArm + "\nrobot.add_tool{id = \"arm\", name = \"camera\", link = \"a1\"}",
           .call = "robot.set_payload{id = \"arm\", tool = \"camera\", mass = 1.0$}",
           .add = "robot.set_payload{id = \"arm\", tool = \"camera\", mass = 1.0}",
           .given = given});
}

TEST(RecordParams, RulesOfPairsHaveEachFieldOfTheRecord) {
  const std::string cell =
      kArm +
      "\nworld.create{name = \"cell\"}\nworld.add_robot{id = \"cell\", robot = \"arm\"}\n"
      "world.add_object{id = \"cell\", what = \"pin\", name = \"held\"}\n"
      "world.add_object{id = \"cell\", what = \"pin\", name = \"second\"}";
  const auto of = [](const std::string& kind, const std::string& record, const std::string& setup,
                     const std::string& pair, std::map<std::string, Given> given) {
    const Case c{.kind = kind,
                 .record = record,
                 .path = "pair_rules",
                 .at = "pair_rules[1].",
                 .setup = setup,
                 .call = kind + ".allow_pair{id = \"" + record + "\", " + pair + "$}",
                 .add = kind + ".allow_pair{id = \"" + record + "\", " + pair + "}",
                 .given = std::move(given),
                 .other = {{"is_allowed", "Compared below."}}};
    compare(c);
    expect_same(c, kind + ".forbid_pair{id = \"" + record + "\", " + pair + "}",
                c.add + "\nrecord.set{id = " + kind + ".get(\"" + record +
                    "\"), path = \"pair_rules[1].is_allowed\", value = false}");
  };
  of("robot", "arm", kArm, "a = \"a1\", b = \"a3\"", {{"a", {"\"base\""}}, {"b", {"\"a2\""}}});
  of("world", "cell", cell, "a = \"arm\", b = \"held\"",
     {{"a", {"\"second\""}}, {"b", {"\"second\""}}});
}

TEST(RecordParams, TasksAndProgramsHaveTheirOwnFields) {
  compare({.kind = "task",
           .record = "job",
           .path = "",
           .at = "",
           .setup = "task.create{name = \"job\"}",
           .call = "task.set{id = \"job\"$}",
           .add = "",
           .given = {},
           .other = {{"steps", "task.add_step"}}});
  const std::string made =
      "program.create{name = \"moves\", source = \"PROGRAM moves; BEGIN HALT; ENDPROGRAM;\"";
  const Case c{.kind = "program",
               .record = "moves",
               .path = "",
               .at = "",
               .setup =
                   "record.create{kind = \"controller\", name = \"press\", fields = {target = "
                   "\"krl\"}}",
               .call = made + "$}",
               .add = made + "}",
               .given = {{"language", {"\"irl\""}}},
               .other = {{"files", "program.set_file"}, {"target_profile", "Compared below."}}};
  compare(c);
  expect_same(c, c.add + "\nprogram.set_profile{id = \"moves\", profile = \"press\"}",
              c.add +
                  "\nrecord.set{id = program.get(\"moves\"), path = \"target_profile\", value = "
                  "\"press\"}");
  expect_same(c,
              c.add +
                  "\nprogram.set_file{id = \"moves\", name = \"datalist.dls\", text = \"rounds "
                  ":= 5;\"}",
              c.add +
                  "\nrecord.set{id = program.get(\"moves\"), path = \"files\", value = {{name "
                  "= \"moves.irl\", lines = {\"PROGRAM moves; BEGIN HALT; ENDPROGRAM;\"}}, "
                  "{name = \"datalist.dls\", lines = {\"rounds := 5;\"}}}}");
  note_seen("program", "files", {"name", "lines"});
}

TEST(RecordParams, ControllersHaveEachFieldOfTheRecord) {
  const std::string place = "{{name = \"hand\", number = 2, placement = {0.1, 0, 0.2, 0, 0, 0.3}, ";
  compare({.kind = "controller",
           .record = "press",
           .path = "",
           .at = "",
           .setup = "",
           .call = "record.create{kind = \"controller\", name = \"press\", fields = {target = "
                   "\"krl\"$}}",
           .add = "record.create{kind = \"controller\", name = \"press\", fields = {target = "
                  "\"krl\"}}",
           .given = {{"target", {"\"rapid\""}},
                     {"axes",
                      {"{{name = \"A1\", joint = 2, is_external = true, is_linear = true, sign = "
                       "-1, offset = 5, pulses = 1000, lower = -10, upper = 10}}"}},
                     {"signals",
                      {"{{name = \"grip\", target = \"$OUT\", number = 17, kind = \"hand\", "
                       "is_inverted = true}}"}},
                     {"tools", {place + "mass = 2.5}}"}},
                     {"frames", {place + "mass = 0.0}}"}},
                     {"prologue", {"{\"ABC\", \"DEF\"}"}},
                     {"epilogue", {"{\"ABC\", \"DEF\"}"}},
                     {"length_digits", {"1"}},
                     {"angle_digits", {"2"}},
                     {"speed_digits", {"5"}},
                     {"options", {"{{name = \"acc_cp\", value = \"1.5\"}}"}}}});
}

TEST(RecordParams, TransitionsAndStoredSegmentsHaveEachFieldOfTheRecord) {
  const std::string setup =
      "trajectory.create{name = \"other\", segments = {{shape = \"line\", points = {{0, 0, 0}, "
      "{0.1, 0, 0}}}}}\n"
      "trajectory.create{name = \"seam\", segments = {{shape = \"line\", points = {{0, 0, 0}, "
      "{0.1, 0, 0}}}, {shape = \"line\", points = {{0.1, 0, 0}, {0.1, 0.1, 0}}}}}";
  compare({.kind = "trajectory",
           .record = "seam",
           .path = "segments.transition",
           .at = "segments[2].transition.",
           .setup = setup,
           .call = "trajectory.set_transition{id = \"seam\", index = 2, distance = 0.02$}",
           .add = "trajectory.set_transition{id = \"seam\", index = 2, distance = 0.02}",
           .given = {},
           .other = {{"is_smooth", "It is kind there; compared with the segments."}}});
  const std::string own = "trajectory.get(\"seam\"):set_segment(2, {trajectory = \"other\"";
  std::map<std::string, std::string> no{{"shape", "It is given in each call."},
                                        {"stored", "It is trajectory there."},
                                        {"transition", "Compared above."}};
  for (const char* name : {"law", "orientation", "turning", "points", "joints"})
    no[name] = "Not of a stored trajectory.";
  compare({.kind = "trajectory",
           .record = "seam",
           .path = "segments",
           .at = "segments[2].",
           .setup = setup,
           .call = own + "$})",
           .add = own + "})",
           .given = with_placement({}),
           .other = std::move(no)});
  std::map<std::string, std::string> joint{{"stored", "Not of a motion of joints."}};
  for (const ParamSpec& p : record_params("trajectory", "segments"))
    if (p.name != "joints") joint[p.name] = "Compared above, or not of a motion of joints.";
  const std::string ptp = "trajectory.get(\"seam\"):set_segment(1, {shape = \"ptp\"";
  compare({.kind = "trajectory",
           .record = "seam",
           .path = "segments",
           .at = "segments[1].",
           .setup =
               "trajectory.create{name = \"seam\", segments = {{shape = \"ptp\", joints = {{0, "
               "0}, {0.1, 0.2}}}}}",
           .call = ptp + "$})",
           .add = "",
           .given = {{"joints", {"{{0, 0}, {0.3, 0.4}}"}}},
           .other = std::move(joint)});
  // What describes a segment is taken again, with its empty tables of parameters.
  expect_same(
      {.kind = "trajectory",
       .record = "seam",
       .path = "segments",
       .at = "",
       .setup = setup + "\ntrajectory.get(\"seam\"):set_segment(1, {law = \"trapezoidal\"})",
       .call = "",
       .add = "",
       .given = {}},
      "local seam = trajectory.get(\"seam\")\n"
      "seam:set_segment(1, seam:describe().segments[1])",
      "");
  expect_same({.kind = "trajectory",
               .record = "seam",
               .path = "segments",
               .at = "",
               .setup = setup,
               .call = "",
               .add = "",
               .given = {}},
              "trajectory.set_transition{id = \"seam\", index = 2, kind = \"none\"}",
              "record.set{id = trajectory.get(\"seam\"), path = \"segments[2].transition\", value "
              "= {is_smooth = false}}");
}

/// The kinds of steps with what each must have.
const std::map<std::string, std::string> kSteps = {
    {"move", ", pose = \"up\""},
    {"attach", ", object = \"part\""},
    {"detach", ", object = \"part\""},
    {"set", ", signal = \"go\", value = 1"},
    {"wait", ", time = 1"},
    {"call", ", task = \"inner\""},
    {"repeat", ", count = 2"},
    {"if", ", condition = \"go\""},
    {"else", ""},
    {"message", ", text = \"hello\""},
};

TEST(RecordParams, StepsHaveEachFieldOfTheRecordInTheKindsThatUseIt) {
  const std::map<std::string, Given> special = {
      {"trajectory", {"\"seam\""}},
      {"joints", {"{0.1, 0.2, 0.3}"}},
      {"target", {"{0.1, 0, 0.2, 0, 0, 0.3}"}},
      {"path", {"\"straight\"", "", "", "is_straight", "true"}},
      {"tool", {"", "", "", "link"}},
      {"time", {"", "", "", "duration"}},
      {"value", {"\"2\"", "", "", "expression"}},
      {"condition", {"\"stop > 0\"", "", "", "expression"}},
      {"task", {"\"other_task\""}},
  };
  // Fields that take the place of others or need them, with these: as the step and as the record
  // has them. The record gets both at once.
  const std::string target = ", target = {0, 0, 0.5, 0, 0, 0}";
  const std::map<std::string, std::pair<std::string, std::string>> together = {
      {"move trajectory", {"", ""}},
      {"move joints", {"", ""}},
      {"move target", {"", ""}},
      {"move frame", {target, target}},
      {"move path", {target, target}},
      {"move tool_speed", {target + ", path = \"straight\"", target + ", is_straight = true"}},
      {"wait condition", {"", ""}},
      {"wait timeout", {", condition = \"go\"", ", expression = \"go\""}},
  };
  std::set<std::string> fields;
  const TypeTree& type = *named_type("step");
  ASSERT_EQ(type.cases.size(), kSteps.size());
  for (const auto& [kind, params] : type.cases) {
    const std::string base = kSteps.at(kind);
    // A block before else; the step that counts is the second.
    Case c{.kind = "task",
           .record = "job",
           .path = "steps",
           .at = "steps[2].",
           .setup =
               kArm +
               "\ntrajectory.create{name = \"seam\", segments = {{shape = \"line\", points = {{0, "
               "0, 0}, {0.1, 0, 0}}}}}\ntask.create{name = \"inner\"}\n"
               "task.create{name = \"other_task\"}",
           .call = "",
           .add = "",
           .given = {}};
    const auto made = [&](const std::string& more) {
      return "task.create{name = \"job\", steps = {{step = \"if\", condition = \"go\"}, {step = "
             "\"" +
             kind + "\"" + more + "}}}";
    };
    const std::string plain = after(c, made(base));
    EXPECT_FALSE(plain.starts_with("error")) << plain;
    for (const ParamSpec& p : params) {
      if (p.name == "steps") continue;
      const auto it = special.find(p.name);
      const Given g = it == special.end() ? Given{} : it->second;
      const std::string value = g.value.empty() ? sample(p) : g.value;
      const std::string path = g.path.empty() ? p.name : g.path;
      fields.insert(path);
      // What is needed is given once.
      std::string others;
      for (const std::string_view part : text::split(base, ','))
        if (const std::string_view one = text::trim(part);
            !one.empty() && !one.starts_with(p.name + " "))
          others += ", " + std::string(one);
      std::string record = made(base) + "\nrecord.set{id = task.get(\"job\"), path = \"" + c.at +
                           path + "\", value = " + (g.there.empty() ? value : g.there) + "}";
      if (const auto both = together.find(kind + " " + p.name); both != together.end()) {
        others = both->second.first;
        record = made(base) + "\nrecord.set{id = task.get(\"job\"), path = \"steps\", value = " +
                 "{{kind = \"if\", expression = \"go\"}, {kind = \"" + kind + "\"" +
                 both->second.second + ", " + path + " = " + (g.there.empty() ? value : g.there) +
                 "}}}";
      }
      const std::string typed = after(c, made(others + ", " + p.name + " = " + value));
      const std::string set = after(c, record);
      EXPECT_EQ(typed, set) << kind << " " << p.name;
      EXPECT_FALSE(typed.starts_with("error")) << typed;
      EXPECT_NE(typed, plain) << kind << " " << p.name << " changes nothing";
    }
  }
  note_seen("task", "steps", {"kind", "parent"});  // given in each step, and by the tree
  for (const model::Field& f : model::type_of<model::TaskStep>().fields)
    if (f.name != "kind" && f.name != "parent") {
      EXPECT_TRUE(fields.contains(std::string(f.name))) << "no step has " << f.name;
      seen()["task steps"].try_emplace(std::string(f.name));
    }
}

TEST(RecordParams, HelpAndThePageOfFilesNameEachFieldOfEachKindOfStep) {
  std::ifstream in(std::filesystem::path(ROBOMOSP_SOURCE_DIR) / "docs/user/files.md");
  const std::string page((std::istreambuf_iterator<char>(in)), {});
  for (const auto& [kind, params] : named_type("step")->cases) {
    const std::size_t at = page.find("\n| `" + kind + "` | ");
    ASSERT_NE(at, std::string::npos) << kind;
    const std::string row = page.substr(at + 1, page.find('\n', at + 1) - at);
    for (const ParamSpec& p : params) {
      for (const char* command : {"task.create", "task.add_step"}) {
        const std::string& help = fields_app().commands.find(command)->details;
        const std::size_t line = help.find("| `" + kind + "` | `" + p.name + "` | ");
        ASSERT_NE(line, std::string::npos) << command << " " << kind << " " << p.name;
        EXPECT_NE(help.substr(line, help.find('\n', line) - line).find(p.doc), std::string::npos);
      }
      if (p.name == "steps") continue;
      const bool is_named = row.find("`" + p.name + "`") != std::string::npos ||
                            row.find("`" + p.name + " ") != std::string::npos;
      EXPECT_TRUE(is_named) << "docs/user/files.md, " << kind << ": " << p.name;
    }
  }
}

/// Structs and fields that no case above sets by a command, and why.
const std::map<std::string, std::string> kWithoutCase = {
    {"solid nodes.geometry", "It is imported, and shared as a block: native_geometry_test."},
    {"solid nodes.primitive", "It needs a plugin with a primitive: solid_nodes_test."},
    {"solid nodes.profile", "Its lines have a text of their own: solid_nodes_test."},
    {"trajectory segments.shape", "A provider as law is; it decides the other fields."},
    {"trajectory along", "trajectory.along_edges makes the segments from it: along_edges_test."},
    {"settings", "plugin.set of a plugin that has some: module_test."},
    {"default_provider", "provider.default: default_providers_test."},
};

/// After the others, which fill seen(): each field of each struct of each kind was compared, has a
/// reason in its case, or one here. A struct without a case counts if the field that holds it was
/// compared with a value that has all its fields.
TEST(RecordParams, Zz_EveryFieldOfEveryKindHasACaseOrAReason) {
  if (seen().empty()) GTEST_SKIP() << "the other tests did not run";
  std::set<std::string> used;
  const auto has_reason = [&](const std::string& name) {
    if (!kWithoutCase.contains(name)) return false;
    used.insert(name);
    return true;
  };
  const auto held = [](const model::Type* t) {
    while (t->element) t = t->element;
    return t;
  };
  const auto is_apart = [](const model::Type* t) {
    return t->shape != model::Shape::structure || t == &model::type_of<model::Placement>() ||
           t == &model::type_of<model::Parametric>();
  };
  std::size_t structs = 0;
  std::function<void(const std::string&, const std::string&, const model::Type&,
                     const std::string*)>
      look = [&](const std::string& kind, const std::string& path, const model::Type& t,
                 const std::string* value) {
        const std::string name = struct_name(kind, path);
        if (has_reason(name)) return;
        ++structs;
        const auto of_case = seen().find(name);
        for (const ParamSpec& p : record_params(kind, path)) {
          if (has_reason(name + "." + p.name)) continue;
          if (of_case != seen().end()) {
            EXPECT_TRUE(of_case->second.contains(p.name)) << name << "." << p.name;
            continue;
          }
          // One spelling of a placement counts for all.
          const bool is_placement =
              with_placement({}).contains(p.name) || p.name == "position" || p.name == "placement";
          const bool is_given =
              value && (value->find(p.name + " = ") != std::string::npos ||
                        (is_placement && (value->find("position = ") != std::string::npos ||
                                          value->find("placement = ") != std::string::npos)));
          EXPECT_TRUE(is_given) << name << "." << p.name << " is in no case";
        }
        const std::function<void(const model::Type&, const std::string&)> within =
            [&](const model::Type& owner, const std::string& at) {
              for (const model::Field& f : owner.fields) {
                if (f.is_read_only || is_apart(held(f.type))) continue;
                const std::string inner =
                    at.empty() ? std::string(f.name) : at + "." + std::string(f.name);
                if (f.is_path_flat || f.is_value_flat) {
                  within(*held(f.type), inner);
                  continue;
                }
                const std::string* given = value;
                if (of_case != seen().end())
                  if (const auto it = of_case->second.find(std::string(f.name));
                      it != of_case->second.end())
                    given = &it->second;
                look(kind, inner, *held(f.type), given);
              }
            };
        within(t, path);
      };
  for (const Kind k : all_kinds())
    look(std::string(to_string(k)), "", *model::info(k).type, nullptr);
  EXPECT_GT(structs, 40U);
  for (const auto& [name, reason] : kWithoutCase)
    EXPECT_TRUE(used.contains(name)) << name << " has a case or is gone: " << reason;
}

}  // namespace
}  // namespace robomosp::ioci
