// SPDX-License-Identifier: Apache-2.0
// Pictures of records as PNG files, by a provider of robomosp.renderer/1; and redraw.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <system_error>

#include "io/native.h"
#include "ioci/commands.h"
#include "ioci/map_view.h"
#include "robotics/build_model.h"
#include "scene/build.h"
#include "scene/contacts.h"
#include "scene/tool_ellipsoids.h"
#include "spatial/pose.h"
#include "spatial/vec.h"

namespace robomosp::ioci {
namespace {

using render::Background;
using render::Camera;
using render::Quality;
using render::Style;

constexpr double kFar = 1e6;  ///< further away single-precision graphics shows nothing [m]

template <class E>
struct Word {
  const char* word;
  E value;
};
constexpr Word<Camera::View> kViews[] = {
    {"isometric", Camera::View::isometric}, {"front", Camera::View::front},
    {"back", Camera::View::back},           {"left", Camera::View::left},
    {"right", Camera::View::right},         {"top", Camera::View::top},
    {"bottom", Camera::View::bottom}};
constexpr Word<Style> kStyles[] = {{"smooth", Style::smooth},
                                   {"flat", Style::flat},
                                   {"wireframe", Style::wireframe},
                                   {"hidden_line", Style::hidden_line}};
constexpr Word<Quality> kQualities[] = {
    {"normal", Quality::normal}, {"draft", Quality::draft}, {"high", Quality::high}};

template <class E, std::size_t N>
std::vector<std::string> words(const Word<E> (&all)[N]) {
  std::vector<std::string> out;
  for (const auto& w : all) out.emplace_back(w.word);
  return out;
}
template <class E, std::size_t N>
E value_of(const Word<E> (&all)[N], const std::string& word) {
  for (const auto& w : all)
    if (word == w.word) return w.value;
  return all[0].value;
}

/// Finds out before the work whether a picture can be written there afterwards.
Result<void> check_file(const std::string& file) {
  namespace fs = std::filesystem;
  const fs::path path(file);
  if (path.extension() != ".png" && path.extension() != ".PNG")
    return error(ErrorCode::invalid_argument, text::quote(file) + " does not end with .png",
                 "Pictures are written as PNG files only.", "file");
  std::error_code ignored;
  if (path.has_parent_path() && !fs::is_directory(path.parent_path(), ignored))
    return error(ErrorCode::not_found,
                 "cannot write " + text::quote(file) + ": there is no folder " +
                     text::quote(path.parent_path().string()),
                 "Create the folder or choose another one.", "file");
  return {};
}

Result<void> read_camera(const Map& args, Camera& camera) {
  camera.view = value_of(kViews, text_of(args, "view"));
  camera.perspective = text_of(args, "projection") == "perspective";
  camera.zoom = real(args, "zoom");
  if (has(args, "eye") != has(args, "target"))
    return error(ErrorCode::invalid_argument, "eye and target go together, and only one is given",
                 "Give both, or a view.", has(args, "eye") ? "eye" : "target");
  if (!has(args, "eye")) return {};
  const Vec3 eye = vec3(args, "eye"), target = vec3(args, "target");
  if (std::hypot(eye[0] - target[0], eye[1] - target[1], eye[2] - target[2]) < 1e-6)
    return error(ErrorCode::invalid_argument,
                 "the eye is at the target, so there is no direction to look", "Move one of them.",
                 "eye");
  for (const Vec3& p : {eye, target})
    for (const double x : p)
      if (std::abs(x) > kFar)
        return error(ErrorCode::invalid_argument, "the camera is too far away",
                     "Coordinates are -1000000..1000000 m.", "eye");
  camera.view = Camera::View::custom;
  camera.eye = eye;
  camera.target = target;
  return {};
}

Result<void> read_size(const Map& args, render::Options& options) {
  const auto size = reals(args, "size");
  if (size.empty()) return {};
  const bool is_whole = size.size() == 2 && std::all_of(size.begin(), size.end(), [](double x) {
                          return x >= 16 && x <= 8192 && x == std::floor(x);
                        });
  if (!is_whole)
    return error(ErrorCode::invalid_argument, "a size is two whole numbers of pixels in 16..8192",
                 "Give a width and a height such as {800, 600}.", "size");
  options.width = static_cast<int>(size[0]);
  options.height = static_cast<int>(size[1]);
  return {};
}

Result<void> read_background(const Map& args, render::Look& look) {
  const Value* given = args.find("background");
  if (!given || given->is_nil()) return {};
  const std::string* word = given->as_string();
  if (word && *word == "studio") look.background = Background::studio;
  else if (word && *word == "transparent") look.background = Background::transparent;
  else {
    look.background = Background::plain;
    if (word && *word == "white") return {};
    auto colour = read_colour(*given, "background");
    if (!colour.ok())
      return error(ErrorCode::invalid_argument, given->text() + " is not a background",
                   "Give \"studio\", \"white\", \"transparent\" or a colour such as \"#e8eef4\".",
                   "background");
    look.background_colour = *colour;
  }
  return {};
}

/// Calls `see` with the corners of all triangles of a scene [m].
template <class See>
void each_corner(const render::Scene& scene, See&& see) {
  for (const render::Item& item : scene.items) {
    if (!item.mesh) continue;
    const auto& p = item.mesh->positions;
    for (std::size_t v = 0; v + 2 < p.size(); v += 3)
      see(spatial::transform(item.pose, {static_cast<double>(p[v]), static_cast<double>(p[v + 1]),
                                         static_cast<double>(p[v + 2])}));
  }
}

/// Middle of the box around the items of a scene [m].
Vec3 middle_of(const render::Scene& scene) {
  Vec3 low{kFar, kFar, kFar}, high{-kFar, -kFar, -kFar};
  each_corner(scene, [&](const Vec3& x) {
    for (std::size_t i = 0; i < 3; ++i) {
      low[i] = std::min(low[i], x[i]);
      high[i] = std::max(high[i], x[i]);
    }
  });
  if (low[0] > high[0]) return {};
  return {0.5 * (low[0] + high[0]), 0.5 * (low[1] + high[1]), 0.5 * (low[2] + high[2])};
}

Result<std::optional<render::Section>> read_section(const CommandContext& ctx, const Map& args,
                                                    const render::Scene& scene) {
  using Out = std::optional<render::Section>;
  const Value* given = args.find("section");
  if (!given || given->is_nil()) return Out{};
  Schema fields = plane_fields();
  fields.push_back(optional("colour", "any", "", "Of the cut faces."));
  fields.push_back(defaulted("hatch", "bool", "", true, "Lines across the cut faces."));
  RMP_TRY_ASSIGN(const Map s, read_plane_map(ctx, fields, *given, "section"));
  RMP_TRY_ASSIGN(const Plane plane, read_plane(s, middle_of(scene), "section"));
  render::Section section;
  section.point = plane.point;
  section.normal = plane.normal;
  if (has(s, "colour")) {
    RMP_TRY_ASSIGN(section.colour, read_colour(*s.find("colour"), "section.colour"));
  }
  section.hatch = flag(s, "hatch");
  return Out{section};
}

/// True when there is something to draw, all of it on the side that is taken away.
bool takes_all(const render::Section& section, const render::Scene& scene) {
  bool is_anything_there = false, is_anything_left = false;
  each_corner(scene, [&](const Vec3& x) {
    is_anything_there = true;
    is_anything_left =
        is_anything_left || spatial::dot(spatial::sub(x, section.point), section.normal) < 0;
  });
  return is_anything_there && !is_anything_left;
}

Result<std::shared_ptr<render::Renderer>> renderer(Application& app) {
  const std::uint64_t revision = app.registry.revision();
  if (app.renderer && app.renderer_revision == revision) return app.renderer;
  if (app.registry.list(render::Renderer::kInterfaceId).empty())
    return error(ErrorCode::unsupported, "cannot draw a picture, because no renderer is installed",
                 "Install the desktop package of this program, which brings the plugin "
                 "render_osg.");
  RMP_TRY_ASSIGN(app.renderer, app.registry.create<render::Renderer>(""));
  app.renderer_revision = revision;
  return app.renderer;
}

Result<Value> render_what(CommandContext& ctx, const Map& args) {
  const AnyId id = ref(args, has(args, "id") ? "id" : "what");
  const std::string file = text_of(args, "file");
  RMP_TRY(check_file(file));
  render::Options options;
  render::Look& look = options.look;
  RMP_TRY(read_size(args, options));
  RMP_TRY(read_camera(args, look.camera));
  RMP_TRY(read_background(args, look));
  look.style = value_of(kStyles, text_of(args, "style"));
  look.feature_edges = flag(args, "edges");
  look.hidden_edges = flag(args, "hidden");
  look.grid = flag(args, "grid");
  look.world_axes = flag(args, "axes");
  look.caption = text_of(args, "caption");
  options.quality = value_of(kQualities, text_of(args, "quality"));

  scene::Extras extras;
  extras.com = has(args, "com") && flag(args, "com");
  extras.frames = has(args, "frames") && flag(args, "frames");
  if (has(args, "ellipsoid")) {
    const std::string shown = text_of(args, "ellipsoid");
    extras.ellipsoids = {shown == "velocity" || shown == "both",
                         shown == "force" || shown == "both"};
  }
  extras.explode = has(args, "explode") ? real(args, "explode") : 0.0;
  const scene::Source source{ctx.snapshot(), ctx.app.derived, ctx.app.registry};
  if (has(args, "q")) {
    const auto* robot = id.kind == Kind::robot ? source.snapshot.get(RobotId{id.number}) : nullptr;
    if (!robot)
      return error(ErrorCode::invalid_argument, name_in(ctx, id) + " has no joints",
                   "Leave q out, or draw a robot.", "q");
    RMP_TRY_ASSIGN(const auto model, source.derived.robot_model(source.snapshot, RobotId{id.number},
                                                                {0, 0, -9.81}, ctx.progress));
    RMP_TRY_ASSIGN(extras.q, read_q(*args.find("q"), *robot, model->joints, "q"));
  }
  RMP_TRY_ASSIGN(scene::Built built, scene::build(source, id, extras, ctx.progress));
  if (has(args, "at") && !has(args, "recording"))
    return error(ErrorCode::invalid_argument, "a time needs a recording to be looked up in",
                 "Give recording too.", "at");
  if (has(args, "recording")) {
    const Handle* h = args.find("recording")->as_handle();
    const auto recording = ctx.app.recordings.find(h->number);
    if (id.kind != Kind::world)
      return error(ErrorCode::invalid_argument, name_in(ctx, id) + " is not a world",
                   "A recording moves the robot of a world.", "recording");
    RMP_TRY_ASSIGN(const auto playback,
                   scene::build_playback(source, WorldId{id.number}, *recording, ctx.progress));
    const double at = has(args, "at") ? real(args, "at") : 0.0;
    scene::pose_at(built.scene, playback, at);
    if (extras.ellipsoids.velocity || extras.ellipsoids.force) {
      RMP_TRY_ASSIGN(const auto ellipsoids,
                     scene::MovingEllipsoids::build(source, id, recording.get(), ctx.progress));
      for (render::Item& moved : ellipsoids.at(at, extras.ellipsoids))
        for (render::Item& item : built.scene.items)
          if (item.id == moved.id) item = std::move(moved);
    }
  }
  if (has(args, "collisions") && flag(args, "collisions")) {
    const sim::Simulator simulator{ctx.app.registry, ctx.app.derived, ctx.snapshot()};
    if (id.kind != Kind::world)
      return error(ErrorCode::invalid_argument, name_in(ctx, id) + " is not a world",
                   "Draw a world, or leave collisions out.", "collisions");
    RMP_TRY_ASSIGN(const auto model, ctx.app.collision_models.find(simulator, id, ctx.progress));
    std::vector<double> q = model->shown();
    if (has(args, "recording")) {
      const auto recording = ctx.app.recordings.find(args.find("recording")->as_handle()->number);
      RMP_TRY_ASSIGN(
          q, scene::configuration_at(*model, *recording, has(args, "at") ? real(args, "at") : 0.0));
    }
    RMP_TRY(scene::mark_contacts(*model, q, built.scene, ctx.progress));
  }
  RMP_TRY_ASSIGN(look.section, read_section(ctx, args, built.scene));
  if (has(args, "map")) {
    if (look.section)
      return error(ErrorCode::invalid_argument, "a section does not cut voxels",
                   "Cut the map by its field cut, and leave section out.", "section");
    RMP_TRY(add_map(ctx, *args.find("map"), id, built.scene));
  }
  if (look.section && takes_all(*look.section, built.scene))
    built.left_out.emplace_back(
        "The section takes everything away: all lies on the side its normal points to. Turn the "
        "normal round or move the plane.");

  RMP_TRY_ASSIGN(const auto drawer, renderer(ctx.app));
  const auto draw = [&] { return drawer->draw(built.scene, options, ctx.progress); };
  auto image = guarded("renderer", draw);
  if (!image.ok()) return std::move(image).error();
  if (image->rgba.size() !=
      4 * static_cast<std::size_t>(options.width) * static_cast<std::size_t>(options.height))
    return error(ErrorCode::plugin_failed, "the renderer made a picture of another size",
                 "Report it to the provider's author or choose another provider.");
  RMP_TRY_ASSIGN(const std::string bytes, guarded("renderer", [&] { return drawer->png(*image); }));
  RMP_TRY(io::write_file(file, bytes));
  List left_out;
  for (const std::string& sentence : built.left_out) {
    ctx.app.messages.post(Severity::warning, "left_out", sentence, "view");
    left_out.emplace_back(sentence);
  }
  return Value(Map{{"file", file},
                   {"width", options.width},
                   {"height", options.height},
                   {"items", built.scene.items.size()},
                   {"left_out", std::move(left_out)}});
}

Result<Value> redraw(CommandContext& ctx, const Map&) {
  if (ctx.app.redraw) ctx.app.redraw();
  return Value();
}

/// What a picture of a kind can show.
struct Abilities {
  bool has_mass = true, has_frames = true, has_parts = true, has_joints = false, moves = false;
};

Schema picture_params(ParamSpec what, const Abilities& can) {
  Schema s{std::move(what), needed("file", "path", "", "The picture, *.png."),
           choice("view", words(kViews),
                  "From where; isometric is the three-quarter view from the front right, and with "
                  "orthographic the true isometric one.")};
  s.push_back(choice("style", words(kStyles),
                     "smooth and flat are shaded, wireframe shows all lines, hidden_line is a "
                     "drawing with white faces."));
  s.push_back(optional("size", "real[]", "", "Width and height [px], 16..8192; {800, 600}."));
  s.push_back(choice("quality", words(kQualities),
                     "draft is simple light in a fraction of a second, normal has soft shadows, "
                     "high is for print."));
  s.push_back(choice("projection", {"perspective", "orthographic"}, "How depth is shown."));
  s.push_back(between(defaulted("zoom", "real", "", 1.0, "1 fits everything into the picture."),
                      0.01, 100));
  s.push_back(optional("eye", "vec3", "m", "Where the camera stands, instead of a view."));
  s.push_back(optional("target", "vec3", "m", "What the camera looks at, with eye."));
  s.push_back(defaulted("edges", "bool", "", true, "Dark lines along the edges."));
  s.push_back(defaulted("hidden", "bool", "", false,
                        "With hidden_line: hidden edges dashed instead of left out."));
  s.push_back(optional("section", "any", "",
                       "A plane that cuts everything open: an axis such as \"x\" or \"-z\" through "
                       "the middle, or a table with axis or normal, offset or point, colour and "
                       "hatch. The side the axis or normal points to is taken away."));
  if (can.has_joints || can.moves)
    s.push_back(
        optional("map", "any", "",
                 "Voxels around a robot: a recording of robot.workspace or "
                 "robot.reachability, or a table with recording, column, cut (a plane as "
                 "for section, through the mounting frame's origin), opacity, above (a value), "
                 "low, high, bands, and in a world robot, its name there."));
  if (can.has_parts) {
    ParamSpec p = defaulted("explode", "real", "", 0.0,
                            "Moves the parts outwards by this share of their distance.");
    s.push_back(between(std::move(p), 0, 100));
  }
  if (can.has_mass)
    s.push_back(defaulted("com", "bool", "", false,
                          "Marks the centre of mass by a chequered ball, with the principal axes "
                          "as long as the radii of gyration to either side."));
  if (can.has_frames)
    s.push_back(defaulted("frames", "bool", "", false,
                          "Frames of nodes, parts or links, with their names."));
  if (can.has_joints)
    s.push_back(optional("q", "any", "",
                         "Joint values or a named pose; the pose home or zeros when left out."));
  if (can.has_joints || can.moves)
    s.push_back(
        choice("ellipsoid", {"none", "velocity", "force", "both"},
               "At the tools of robots: the velocities for joint speeds, and the forces for "
               "joint torques of unit length; the greatest half axis is a fifth of the "
               "reach."));
  if (can.moves) {
    s.push_back(defaulted("collisions", "bool", "", false,
                          "Bodies that touch in red; where none do, the shortest line between two "
                          "bodies with its length."));
    s.push_back(optional("recording", "ref:recording", "", "Where the robot is, with at."));
    ParamSpec at = optional("at", "real", "s", "Time within the recording.");
    at.min = 0;
    s.push_back(std::move(at));
  }
  s.push_back(optional("background", "any", "",
                       "studio, white, transparent or a colour; studio for shaded styles and white "
                       "for drawings when left out."));
  s.push_back(defaulted("grid", "bool", "", true, "Lines on the floor of the studio."));
  s.push_back(defaulted("axes", "bool", "", true, "The axes on the floor and in the corner."));
  s.push_back(defaulted("caption", "string", "", "", "Small text in the lower left corner."));
  return s;
}

CommandSpec render_command(std::string name, std::string summary, std::string example,
                           ParamSpec what, const Abilities& can) {
  CommandSpec c;
  c.name = std::move(name);
  c.summary = std::move(summary);
  c.details =
      "Lengths are in metres and places in the frame of what is drawn. The picture is drawn "
      "without "
      "a window or display by a provider of robomosp.renderer/1, and the file appears only when it "
      "is complete. In a world, what cannot be drawn is left out and told.";
  c.example = std::move(example);
  c.params = picture_params(std::move(what), can);
  c.returns = {
      "map",
      "",
      "",
      {field("file", "string", "", "The picture."), field("width", "int", "", "Its width [px]."),
       field("height", "int", "", "Its height [px]."), field("items", "int", "", "Bodies in it."),
       field("left_out", "list", "", "Sentences about what could not be drawn.")}};
  c.effect = Effect::files_write;
  c.run = render_what;
  return c;
}

std::string with_plate(const std::string& rest) {
  return "local plate = solid.create{name = \"plate\", root = {kind = \"difference\", children = "
         "{\n"
         "  {kind = \"box\", x = 0.2, y = 0.1, z = 0.02},\n"
         "  {kind = \"cylinder\", radius = 0.02, height = 0.02}}}}\n" +
         rest;
}

}  // namespace

std::vector<CommandSpec> view_commands() {
  const std::string small = "size = {96, 64}, quality = \"draft\"}";
  std::vector<CommandSpec> all;
  ParamSpec what = needed("what", "ref:world|robot|object|solid|material", "", "What to draw.");
  all.push_back(render_command(
      "view.render", "Draws a world, robot, object, solid or material to a PNG file.",
      with_plate(
          "local done = view.render{what = \"plate\", file = \"plate.png\", view = \"top\", " +
          small + "\nassert(done.items == 1)"),
      std::move(what), {.has_joints = true, .moves = true}));
  all.push_back(render_command(
      "solid.render", "Draws a solid to a PNG file.",
      with_plate("plate:render{file = \"cut.png\", style = \"hidden_line\", section = \"-y\", " +
                 small),
      self("solid"), {.has_parts = false}));
  all.push_back(render_command(
      "object.render", "Draws an object to a PNG file.",
      with_plate(
          "local stack = object.create{name = \"stack\", parts = {{what = \"plate\"}, {what = "
          "\"plate\", position = {0, 0, 0.02}}}}\n"
          "assert(stack:render{file = \"stack.png\", explode = 1, " +
          small + ".items == 2)"),
      self("object"), {}));
  all.push_back(render_command("robot.render", "Draws a robot to a PNG file.",
                               "local arm = robot.get(\"twolink\")\n"
                               "arm:render{file = \"arm.png\", q = {\"30 deg\", \"45 deg\"}, " +
                                   small,
                               self("robot"), {.has_joints = true}));
  all.push_back(render_command("world.render", "Draws a world to a PNG file.",
                               "local cell = world.create{name = \"cell\"}\n"
                               "cell:render{file = \"cell.png\", view = \"front\", " +
                                   small,
                               self("world"), {.moves = true}));
  all.push_back(render_command(
      "material.render", "Draws a material, on a sphere and a cone, to a PNG file.",
      "local brass = material.create{name = \"brass\", density = 8500, colour = \"#c8a44a\", "
      "metalness = 1, shininess = 0.8}\n"
      "brass:render{file = \"brass.png\", " +
          small,
      self("material"), {.has_mass = false, .has_frames = false, .has_parts = false}));
  all.push_back({.name = "view.redraw",
                 .classic = "ForceReDraw",
                 .summary = "Draws the scene again, where there is one.",
                 .details = "The viewer follows every change by itself.",
                 .example = "view.redraw()",
                 .params = {},
                 .returns = {},
                 .effect = Effect::simulates,
                 .run = redraw});
  return all;
}

}  // namespace robomosp::ioci
