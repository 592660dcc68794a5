// SPDX-License-Identifier: Apache-2.0
// Foreign files in and out through providers of robomosp.importer/1 and robomosp.exporter/1.
#include <filesystem>
#include <utility>

#include "exchange/export.h"
#include "exchange/export_pairs.h"
#include "exchange/import.h"
#include "ioci/core/commands.h"
#include "ioci/core/import_faults.h"
#include "ioci/core/loaded.h"
#include "ioci/records/solid_nodes.h"

namespace robomosp::ioci {
namespace {

using exchange::Exported;

exchange::Exchange exchange_of(CommandContext& ctx) {
  Application& app = ctx.app;
  return {{app.registry, app.derived, ctx.snapshot(), &app.collision_models},
          app.messages,
          app.library,
          ctx.progress};
}
/// Of these arguments, those that were given, and the argument `options`.
exchange::FormatValues values_of(const Map& args, std::initializer_list<const char*> names) {
  exchange::FormatValues out;
  for (const char* name : names)
    if (has(args, name)) out.given.set(name, *args.find(name));
  if (const Value* options = args.find("options"); options && options->as_map())
    out.options = *options->as_map();
  return out;
}

// --- in ------------------------------------------------------------------------------------

constexpr auto kImportValues = {"name", "unit", "heal", "density", "shapes"};

Result<Value> import_file(CommandContext& ctx, const Map& args) {
  if (has(args, "material") && has(args, "density"))
    return error(ErrorCode::invalid_argument, "both material and density are given",
                 "The material has a density; leave one out.", "density");
  RMP_TRY_ASSIGN(auto done,
                 exchange::import_file(exchange_of(ctx), ctx.edit(),
                                       {text_of(args, "file"), values_of(args, kImportValues),
                                        typed<model::Material>(args, "material")}));
  for (auto& kept : done.kept)
    ctx.app.kept<ImportFaults>().note(kept.record, ctx.snapshot().find(kept.record)->name,
                                      std::move(kept.faults), std::move(kept.holds));
  List made;
  for (std::size_t i = done.loaded.all.size(); i-- > 0;)
    made.emplace_back(Application::handle(done.loaded.all[i]));
  return Value(std::move(made));
}

Result<Value> import_profile(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const CsgProfile profile,
                 exchange::import_profile(exchange_of(ctx), text_of(args, "file"),
                                          values_of(args, kImportValues)));
  return profile_value(profile);
}

// --- out -----------------------------------------------------------------------------------

/// What all exports have as arguments.
exchange::ExportRequest request_of(const Map& args, std::string file, std::string extension) {
  exchange::ExportRequest out;
  out.file = std::move(file);
  out.extension = std::move(extension);
  out.values = values_of(args, {"unit", "schema"});
  out.as_mesh = text_of(args, "as") == "mesh";
  if (has(args, "plane")) out.plane = pose_from(*args.find("plane"));
  if (has(args, "chord")) out.chord = real(args, "chord");
  return out;
}
/// Writes a record and reports what is to be known of it.
Result<Exported> export_record(CommandContext& ctx, AnyId id, exchange::ExportRequest request) {
  RMP_TRY_ASSIGN(Exported done, exchange::export_record(exchange_of(ctx), id, std::move(request)));
  report_replaced(ctx, Severity::info, done.replaced);
  for (const std::string& note : done.notes)
    ctx.app.messages.post(Severity::info, "export_note", note, "export");
  return done;
}

List texts(const std::vector<std::string>& all) { return {all.begin(), all.end()}; }

Result<Value> export_any(CommandContext& ctx, AnyId id, const Map& args) {
  const std::string file = text_of(args, "file");
  RMP_TRY_ASSIGN(const Exported done,
                 export_record(ctx, id, request_of(args, file, exchange::extension_of(file))));
  Map out{{"file", done.file},
          {"parts", done.parts},
          {"triangles", done.triangles},
          {"others", texts(done.others)},
          {"notes", texts(done.notes)}};
  return Value(std::move(out));
}

Result<Value> export_urdf(CommandContext& ctx, const Map& args) {
  exchange::ExportRequest request = request_of(args, text_of(args, "file"), "urdf");
  for (const char* name : {"package", "bodies"})
    if (has(args, name)) request.own.set(name, *args.find(name));
  RMP_TRY_ASSIGN(const Exported done, export_record(ctx, ref(args, "id"), std::move(request)));
  Map out{{"file", done.file}, {"meshes", texts(done.others)}, {"notes", texts(done.notes)}};
  for (const ExportReport::Count& c : done.counts) out.set(c.what, c.count);
  return Value(std::move(out));
}

/// "My arm" gives "my_arm_description".
std::string package_of(const std::string& robot) {
  std::string out;
  for (char c : robot) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c + 32);
    const bool is_plain = (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9');
    if (is_plain) out += c;
    else if (!out.empty() && out.back() != '_') out += '_';
  }
  if (out.empty() || (out[0] >= '0' && out[0] <= '9')) out = "robot_" + out;
  return out + (out.back() == '_' ? "" : "_") + "description";
}

Result<Value> export_ros2(CommandContext& ctx, const Map& args) {
  const AnyId id = ref(args, "id");
  const std::string package =
      has(args, "package") ? text_of(args, "package") : package_of(ctx.snapshot().find(id)->name);
  const std::filesystem::path folder = std::filesystem::path(text_of(args, "folder")) / package;
  exchange::ExportRequest request = request_of(args, (folder / "package.xml").string(), "xml");
  for (const char* name : {"bodies", "description", "maintainer", "email", "licence", "version",
                           "group", "hardware", "command", "rate"})
    if (has(args, name)) request.own.set(name, *args.find(name));
  request.own.set("package", package);
  request.may_replace = flag(args, "overwrite");
  const auto samples = static_cast<std::size_t>(integer(args, "samples"));
  std::vector<std::string> notes;
  if (samples > 0) {
    RMP_TRY_ASSIGN(
        request.pairs,
        exchange::export_pairs(exchange_of(ctx).from, RobotId{id.number}, samples,
                               static_cast<std::uint64_t>(integer(args, "seed")), ctx.progress));
  } else {
    notes.emplace_back("No pairs of links were looked for that need no check for collision.");
  }
  const std::size_t pairs = request.pairs.size();
  RMP_TRY_ASSIGN(Exported done, export_record(ctx, id, std::move(request)));
  notes.insert(notes.begin(), done.notes.begin(), done.notes.end());
  std::vector<std::string> files = std::move(done.others);
  files.push_back(done.file);
  Map out{{"package", package},
          {"folder", folder.string()},
          {"files", texts(files)},
          {"disabled_pairs", pairs},
          {"notes", texts(notes)}};
  for (const ExportReport::Count& c : done.counts) out.set(c.what, c.count);
  return Value(std::move(out));
}

Result<Value> export_what(CommandContext& ctx, const Map& args) {
  return export_any(ctx, ref(args, "what"), args);
}
Result<Value> export_id(CommandContext& ctx, const Map& args) {
  return export_any(ctx, ref(args, "id"), args);
}

// --- table ---------------------------------------------------------------------------------

ParamSpec maybe_choice(std::string name, std::vector<std::string> choices, std::string doc) {
  ParamSpec p = choice(std::move(name), std::move(choices), std::move(doc));
  p.default_value.reset();
  p.required = false;
  return p;
}

constexpr const char* kOptions =
    "Parameters of the format's provider by name; `provider.params` lists them.";

Schema export_params(ParamSpec first) {
  ParamSpec plane = optional("plane", "pose", "",
                             "Of a drawing: the section plane, cut along its x and y; by default "
                             "horizontal at half the height.");
  return {std::move(first),
          needed("file", "path", "", "The file; its extension selects the format."),
          maybe_choice("unit", {"mm", "cm", "m", "in", "ft"},
                       "Length unit of the file; default: mm. GLB is always in metres."),
          maybe_choice("schema", {"ap214", "ap203", "ap242"},
                       "Application protocol of a STEP file; default: ap214."),
          above_zero(optional("chord", "real", "m",
                              "Greatest deviation of triangles, or of curves in a drawing; by "
                              "default the chord of each solid.")),
          choice("as", {"section", "mesh"}, "Content of a DXF file."),
          optional("options", "map", "", kOptions),
          std::move(plane)};
}

const char* const kFormats =
    "| extension | content |\n"
    "|---|---|\n"
    "| `.step`, `.stp` | exact solids, names, colours, assemblies with shared parts |\n"
    "| `.iges`, `.igs` | exact solids, names, colours |\n"
    "| `.stl`, `.obj`, `.ply` | one mesh; the file states no unit |\n"
    "| `.glb` | meshes, names, colours, assemblies; metres, y up |\n"
    "| `.3mf` | meshes, names, colours, assemblies |\n"
    "| `package.xml` | a ROS 2 package as of `robot.export_ros2`, without the pairs that need no "
    "check; `provider.params` of `ros2_package` |\n"
    "| `.urdf` | one robot: links, joints, masses, limits, shapes; `provider.params` of `urdf` |\n"
    "| `.dxf` | the section at a plane (lines, arcs, circles, splines), or the mesh as faces |\n";

const char* const kBlock =
    "local block = solid.create{name = \"block\", root = {kind = \"box\", x = 0.1, y = 0.1, z = "
    "0.02}}\n";
std::string with_block(const char* rest) { return std::string(kBlock) + rest; }

}  // namespace

RMP_COMMANDS(exchange_commands) {
  std::vector<CommandSpec> all;
  all.push_back(
      {.name = "import",
       .classic = "",
       .summary = "Reads solids from a CAD or mesh file, or a robot from URDF, MJCF or SDF.",
       .details =
           "Exact solids come from STEP (AP203, AP214, AP242) and IGES, meshes from STL, OBJ, PLY, "
           "glTF, GLB, DAE (COLLADA), 3MF and DXF; plugins may add formats. Each part becomes a "
           "solid with one `imported` node, an assembly becomes an object, and copies share their "
           "solid. Files are read in a separate process; if it fails nothing is created, and a "
           "successful import is one step. Messages report what was repaired, left out or assumed. "
           "A mesh that does not bound a clean solid (open or self-intersecting) is drawn and "
           "collides unchanged, and has the mass that its triangles enclose; a message reports "
           "each such mesh, and `solid.mesh_faults` shows the places.\n\n"
           "Masses in such files are ignored. Each colour becomes a material with the density of "
           "aluminium unless `density` or `material` is given; a message reports this.\n\n"
           "Robots come from URDF (`.urdf`), MJCF (`.xml`, `.mjcf`) and SDF (`.sdf`), with the "
           "masses, limits and friction given in the file; meshes are read from the files it "
           "names, and a message lists every file that was read.",
       .example =
           with_block("block:export(\"example.step\")\nlocal made = import{file = "
                      "\"example.step\", name = \"copy\"}\nassert(made[1].name == \"copy\")"),
       .params = {needed("file", "path", "", "The file; its extension selects the format."),
                  optional("name", "string", "",
                           "Name of the new record; by default that of the file."),
                  maybe_choice("unit", {"auto", "mm", "cm", "m", "in", "ft"},
                               "Length unit of a file that does not state one (STL, OBJ, PLY, some "
                               "DXF); default: mm, with a message."),
                  optional("material", "ref:material", "", "Material of all imported solids."),
                  above_zero(optional("density", "real", "kg/m^3",
                                      "Density of the materials created from the file's colours.")),
                  optional("heal", "bool", "", "Repair faulty geometry; default: true."),
                  maybe_choice(
                      "shapes", {"visual", "collision"},
                      "Of a robot's file: the shapes that its links get; default: visual."),
                  optional("options", "map", "", kOptions)},
       .returns = {"list", "", "Handles of all new records, the main one first.", {}},
       .effect = Effect::files_read | Effect::edits,
       .sometimes = Effect::processes,
       .run = import_file});
  all.push_back(
      {.name = "import_profile",
       .classic = "",
       .summary = "Reads the closed outlines of a drawing (DXF) as a profile.",
       .details = "Prisms and revolutions take such a profile. LINE, ARC, CIRCLE, ELLIPSE, "
                  "LWPOLYLINE, POLYLINE and SPLINE are read, also in blocks; pieces are joined end "
                  "to end in any order.",
       .example = with_block("block:export(\"example.dxf\")\nlocal profile = import_profile{file = "
                             "\"example.dxf\"}\nassert(#profile == 1)"),
       .params = {needed("file", "path", "", "The file, *.dxf."),
                  maybe_choice("unit", {"auto", "mm", "cm", "m", "in", "ft"},
                               "Length unit if the drawing does not state one; default: mm, with a "
                               "message.")},
       .returns = {"list", "", "The loops of the profile.", {}},
       .effect = Effect::files_read,
       .sometimes = Effect::processes,
       .run = import_profile});
  const std::vector<ParamSpec> fields{
      field("file", "string", "", "The file."), field("parts", "int", "", "Number of parts in it."),
      field("triangles", "int", "", "Number of triangles in it."),
      field("others", "list", "", "Additional files written."),
      field("notes", "list", "", "Changes and omissions, one sentence each.")};
  const auto add = [&](std::string name, std::string what, ParamSpec first, std::string example,
                       auto run) {
    all.push_back({.name = std::move(name),
                   .classic = "",
                   .summary = "Writes " + what + " as a CAD or mesh file.",
                   .details = std::string(kFormats) +
                              "\nMeshes are as fine as the `chord` of their solids, or as `chord` "
                              "here. Generated bodies of robots keep their chord.",
                   .example = std::move(example),
                   .params = export_params(std::move(first)),
                   .returns = {"map", "", "", fields},
                   .effect = Effect::files_write,
                   .sometimes = Effect::processes,
                   .run = run});
  };
  add("export", "a solid, object, robot or world",
      needed("what", "ref:solid|object|robot|world", "", "The record to write."),
      with_block("assert(export{what = block, file = \"example.step\"}.parts == 1)"), export_what);
  add("solid.export", "a solid", self("solid"),
      with_block("assert(block:export(\"example.stl\").triangles == 12)"), export_id);
  add("object.export", "an object", self("object"),
      with_block("local o = object.create{name = \"o\", parts = {{what = \"block\"}}}\n"
                 "assert(o:export(\"example.glb\").triangles == 12)"),
      export_id);
  add("world.export", "all objects and robots of a world", self("world"),
      with_block("local w = world.create{name = \"w\"}\nw:add_object{what = \"block\", name = "
                 "\"b\"}\nassert(w:export(\"example.3mf\").parts == 1)"),
      export_id);
  all.push_back(
      {.name = "robot.export_urdf",
       .classic = "",
       .summary = "Writes the robot as a URDF file with separate mesh files.",
       .details = "Links, joints, limits, masses, friction and followers are written as URDF "
                  "elements; boxes, cylinders and spheres are exact, other bodies become STL files "
                  "in a folder `<file>_meshes`. Properties that URDF cannot express are written in "
                  "an element `<robomosp>` of the joint, which other programs ignore (motor "
                  "inertia, springs, passive joints, uneven friction, limits of acceleration), or "
                  "are left out (closed loops, poses). `notes` lists all of these, one sentence "
                  "each. Masses are those used by the solvers, payloads included. `import` reads "
                  "the file back with equal poses and torques, except as listed in `notes`.",
       .example = with_arm("local done = arm:export_urdf{file = \"example.urdf\"}\n"
                           "assert(done.joints >= 6)\nlocal back = import{file = \"example.urdf\", "
                           "name = \"back\"}\nassert(back[1].name == \"back\")"),
       .params = {self("robot"), needed("file", "path", "", "The file, *.urdf."),
                  optional(
                      "package", "string", "",
                      "ROS package of the file: meshes are then named package://<package>/..."),
                  defaulted("bodies", "bool", "", true,
                            "False omits the shapes: only joints and masses are written.")},
       .returns = {"map",
                   "",
                   "",
                   {field("file", "string", "", "The file."),
                    field("links", "int", "", "Number of links in it."),
                    field("joints", "int", "", "Number of joints in it, including fixed ones."),
                    field("meshes", "list", "", "The mesh files written."),
                    field("notes", "list", "", "Changes and omissions, one sentence each.")}},
       .effect = Effect::files_write,
       .sometimes = Effect::processes,
       .run = export_urdf});
  all.push_back(
      {.name = "robot.export_ros2",
       .classic = "",
       .summary = "Writes the robot as a description package of ROS 2.",
       .details =
           "A folder with package.xml, CMakeLists.txt, the URDF with its meshes and a ros2_control "
           "system (mock components unless `hardware` names another plugin), an SRDF with groups, "
           "named poses and the pairs of links that need no collision check, settings of "
           "controllers, joint limits and kinematics, and a launch file. Pairs are found as by "
           "`robot.find_allowed_pairs`: Adjacent, Never and Always, and User for the robot's "
           "rules; a pair that touched in none of the samples may still touch between them. Names "
           "that ROS 2 does not accept are rejected, and so are existing files unless overwrite = "
           "true. The provider ros2_package has further options.",
       .example = with_arm("local done = arm:export_ros2{folder = \"ros2\", samples = 100}\n"
                           "assert(done.package == \"arm_description\" and #done.files >= 8)\n"
                           "assert(done.joints >= 6)"),
       .params =
           {self("robot"),
            needed("folder", "path", "",
                   "Folder in which the package's folder is created, such as src of a workspace."),
            optional("package", "string", "",
                     "Name of the package; by default that of the robot followed by _description."),
            defaulted("overwrite", "bool", "", false, "Replace existing files."),
            defaulted("bodies", "bool", "", true,
                      "False omits the shapes: only joints and masses are written."),
            between(
                defaulted(
                    "samples", "int", "", 10000,
                    "Random configurations in which pairs are checked; 0 = no pairs are searched."),
                0, 10000000),
            defaulted("seed", "int", "", 1, "Seed of the random numbers."),
            optional("group", "string", "", "Name of the planning group; default: manipulator."),
            optional("hardware", "string", "",
                     "Plugin of ros2_control; default: mock_components/GenericSystem."),
            maybe_choice("command", {"position", "velocity", "effort"},
                         "Command interface of the joints; default: position."),
            optional("rate", "real", "Hz", "Update rate of the controllers; default: 100 Hz."),
            optional("description", "string", "", "Description of the package in package.xml."),
            optional("maintainer", "string", "", "Name of the maintainer in package.xml."),
            optional("email", "string", "", "Email address of the maintainer."),
            optional("licence", "string", "", "Licence of the package."),
            optional("version", "string", "", "Version of the package, such as 0.1.0.")},
       .returns = {"map",
                   "",
                   "",
                   {field("package", "string", "", "Its name."),
                    field("folder", "string", "", "Folder of the package."),
                    field("files", "list", "", "All files written."),
                    field("links", "int", "", "Number of links of the URDF."),
                    field("joints", "int", "", "Number of its joints, including fixed ones."),
                    field("disabled_pairs", "int", "", "Number of pairs that need no check."),
                    field("notes", "list", "", "Changes and omissions, one sentence each.")}},
       .effect = Effect::files_write,
       .sometimes = Effect::processes,
       .run = export_ros2});
  return all;
}

}  // namespace robomosp::ioci
