// SPDX-License-Identifier: Apache-2.0
// Pictures of records, as PNG files or as their bytes, by a provider of robomosp.renderer/2; and
// redraw (layer: application).
#include <algorithm>
#include <optional>

#include "io/native.h"
#include "ioci/core/commands.h"
#include "ioci/core/loaded.h"
#include "ioci/core/watchers.h"
#include "ioci/view/lone_robot.h"
#include "ioci/view/map_view.h"
#include "ioci/view/picture.h"
#include "kernel/base64.h"
#include "robotics/build_model.h"
#include "scene/build.h"
#include "scene/motion.h"

namespace robomosp::ioci {
namespace {

/// Bytes of the greatest picture of an answer; as text it is a third longer.
constexpr std::size_t kLongestPicture = std::size_t{45} << 20;

/// A picture and what is said of it.
struct Drawn {
  std::string png;  ///< the bytes of the file
  Map about;        ///< width, height, items, left_out
};

Result<Drawn> draw_what(CommandContext& ctx, const Map& args) {
  AnyId id = ref(args, has(args, "id") ? "id" : "what");
  RMP_TRY_ASSIGN(render::Options options, read_picture(args));
  render::Look& look = options.look;

  scene::Extras extras;
  extras.com = has(args, "com") && flag(args, "com");
  extras.frames = has(args, "frames") && flag(args, "frames");
  if (has(args, "ellipsoid")) {
    const std::string shown = text_of(args, "ellipsoid");
    extras.ellipsoids = {shown == "velocity" || shown == "both",
                         shown == "force" || shown == "both"};
  }
  extras.paths = read_paths(args);
  if (has(args, "path_robot")) {
    extras.path_robot = text_of(args, "path_robot");
    const auto* world = id.kind == Kind::world ? ctx.snapshot().get(WorldId{id.number}) : nullptr;
    std::vector<std::string> known;
    if (world)
      for (const auto& r : world->robots) known.push_back(r.name);
    if (std::find(known.begin(), known.end(), extras.path_robot) == known.end())
      return unknown_name("robot", extras.path_robot, known).in("path_robot");
  }
  extras.explode = has(args, "explode") ? real(args, "explode") : 0.0;
  if (extras.explode > 0 && has(args, "without"))
    return error(ErrorCode::unsupported, "an exploded picture shows all members",
                 "Leave explode or without out.", "without");
  RMP_TRY(read_layers(args, extras));
  const AnyId asked = id;
  std::optional<LoneRobot> alone;
  if (id.kind == Kind::robot && has(args, "recording")) {
    if (has(args, "q"))
      return error(ErrorCode::invalid_argument,
                   "q and a recording both set the joint values of the robot",
                   "Leave one of them out.", "q");
    const auto recording = ctx.recording(*args.find("recording")->as_handle());
    if (robot_of(ctx.snapshot(), *recording) != RobotId{id.number})
      return error(ErrorCode::invalid_argument,
                   "the recording " + text::quote(recording->title) + " is not one of " +
                       name_in(ctx, id) + " alone",
                   "Draw the world in which it was made.", "recording");
    RMP_TRY_ASSIGN(LoneRobot made, LoneRobot::make(ctx, RobotId{id.number}, *recording));
    alone.emplace(std::move(made));
    id = AnyId(alone->world());
  }
  const document::Snapshot& snapshot = alone ? alone->snapshot() : ctx.snapshot();
  const scene::Source source{snapshot, ctx.app.derived, ctx.app.registry,
                             &ctx.app.collision_models};
  if (has(args, "q")) {
    const auto* robot = id.kind == Kind::robot ? source.snapshot.get(RobotId{id.number}) : nullptr;
    if (!robot)
      return error(ErrorCode::invalid_argument, name_in(ctx, id) + " has no joints",
                   "Leave q out, or draw a robot.", "q");
    RMP_TRY_ASSIGN(const auto model, source.derived.robot_model(source.snapshot, RobotId{id.number},
                                                                {0, 0, -9.81}, ctx.progress));
    RMP_TRY_ASSIGN(extras.q, read_q(*args.find("q"), *robot, model->joints, "q"));
  }
  if (has(args, "at") && !has(args, "recording"))
    return error(ErrorCode::invalid_argument, "a time needs a recording", "Give recording too.",
                 "at");
  scene::MotionPtr motion;
  if (has(args, "recording")) {
    const auto recording = ctx.recording(*args.find("recording")->as_handle());
    if (id.kind != Kind::world)
      return error(ErrorCode::invalid_argument, name_in(ctx, id) + " is not a world",
                   "A recording moves the robot of a world.", "recording");
    RMP_TRY_ASSIGN(scene::Motion at,
                   scene::motion_at(source.snapshot, WorldId{id.number}, *recording,
                                    has(args, "at") ? real(args, "at") : 0.0));
    motion = std::make_shared<const scene::Motion>(std::move(at));
  }
  if (has(args, "collisions") && flag(args, "collisions")) {
    if (id.kind != Kind::world)
      return error(ErrorCode::invalid_argument, name_in(ctx, id) + " is not a world",
                   "Draw a world, or leave collisions out.", "collisions");
    extras.contacts = extras.clearances = true;
  }
  RMP_TRY_ASSIGN(scene::Built built, scene::build(source, id, extras, ctx.progress, motion));
  RMP_TRY(apply_visibility(ctx, args, asked, built));
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
  RMP_TRY_ASSIGN(std::string bytes, draw_png(*drawer, built.scene, options, ctx.progress));
  List left_out;
  for (const std::string& sentence : built.left_out) {
    ctx.app.messages.post(Severity::warning, "left_out", sentence, "view");
    left_out.emplace_back(sentence);
  }
  return Drawn{std::move(bytes),
               {{"width", options.width},
                {"height", options.height},
                {"items", built.scene.items.size()},
                {"left_out", std::move(left_out)}}};
}

Result<Value> render_what(CommandContext& ctx, const Map& args) {
  const std::string file = text_of(args, "file");
  RMP_TRY(check_new_file(file, ".png", "Pictures are written as PNG files only."));
  RMP_TRY_ASSIGN(const Drawn drawn, draw_what(ctx, args));
  RMP_TRY(write_named_file(ctx, file, drawn.png));
  const bool is_named = has(args, "what");
  RMP_TRY(watch_drawing(
      ctx, (is_named ? "view" : std::string(to_string(ref(args, "id").kind))) + ".render", args));
  Map out{{"file", file}};
  for (const auto& [key, value] : drawn.about) out.set(key, value);
  return Value(std::move(out));
}

Result<Value> picture_of(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const Drawn drawn, draw_what(ctx, args));
  if (drawn.png.size() > kLongestPicture)
    return error(ErrorCode::unsupported,
                 "the picture takes " + std::to_string(drawn.png.size() >> 20) +
                     " MiB, but a reply can contain at most " +
                     std::to_string(kLongestPicture >> 20),
                 "Make it smaller, or draw it to a file (render).", "size");
  std::string text;
  base64::append(text, drawn.png);
  Map out{{"png", std::move(text)}};
  for (const auto& [key, value] : drawn.about) out.set(key, value);
  return Value(std::move(out));
}

Result<Value> redraw(CommandContext& ctx, const Map&) {
  if (ctx.app.redraw) ctx.app.redraw();
  return Value();
}

CommandSpec render_command(std::string name, std::string summary, std::string example,
                           ParamSpec what, const PictureAbilities& can) {
  CommandSpec c;
  c.name = std::move(name);
  c.summary = std::move(summary);
  c.details =
      "Lengths are in metres and places in the frame of the drawn record. The picture is drawn "
      "without a window or display by a provider of robomosp.renderer/2, and the file appears only "
      "when it is complete. In a world, items that cannot be drawn are left out with a message.";
  c.example = std::move(example);
  c.params = {std::move(what), needed("file", "path", "", "The picture, *.png.")};
  for (ParamSpec& p : picture_params(can)) c.params.push_back(std::move(p));
  c.params.push_back(watch_file_field());
  c.returns = {
      "map",
      "",
      "",
      {field("file", "string", "", "The picture."), field("width", "int", "", "Its width [px]."),
       field("height", "int", "", "Its height [px]."),
       field("items", "int", "", "Number of bodies in it."),
       field("left_out", "list", "", "Sentences about items that could not be drawn.")}};
  c.effect = Effect::files_write;
  c.run = render_what;
  return c;
}

/// `render` gives the file's bytes instead of writing it.
CommandSpec picture_command(std::string name, std::string summary, std::string example,
                            ParamSpec what, const PictureAbilities& can) {
  CommandSpec c =
      render_command(std::move(name), std::move(summary), std::move(example), std::move(what), can);
  c.details =
      "For notebooks and remote programs: no file is written. Everything else is the same as in "
      "render.";
  std::erase_if(c.params, [](const ParamSpec& p) { return p.name == "file" || p.name == "watch"; });
  c.returns.fields.front() =
      field("png", "string", "", "The bytes of a PNG file as base64 (RFC 4648).");
  c.effect = Effect::reads;
  c.run = picture_of;
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

RMP_COMMANDS(view_commands) {
  constexpr PictureAbilities kAnything{.has_joints = true,
                                       .moves = true,
                                       .has_layers = true,
                                       .has_members = true,
                                       .has_fading = true};
  const std::string small = "size = {96, 64}, quality = \"draft\"}";
  std::vector<CommandSpec> all;
  ParamSpec what =
      needed("what", "ref:world|robot|object|solid|material", "", "The record to draw.");
  const std::string is_png = "\nassert(p.width == 96 and p.png:sub(1, 11) == \"iVBORw0KGgo\")";
  all.push_back(render_command(
      "view.render", "Draws a world, robot, object, solid or material to a PNG file.",
      with_plate(
          "local done = view.render{what = \"plate\", file = \"plate.png\", view = \"top\", " +
          small + "\nassert(done.items == 1)"),
      std::move(what), kAnything));
  all.push_back(render_command(
      "solid.render", "Draws a solid to a PNG file.",
      with_plate("plate:render{file = \"cut.png\", style = \"hidden_line\", section = \"-y\", " +
                 small),
      self("solid"), {.has_parts = false, .has_layers = true, .has_fading = true}));
  all.push_back(render_command(
      "object.render", "Draws an object to a PNG file.",
      with_plate(
          "local stack = object.create{name = \"stack\", parts = {{what = \"plate\"}, {what = "
          "\"plate\", position = {0, 0, 0.02}}}}\n"
          "assert(stack:render{file = \"stack.png\", explode = 1, " +
          small + ".items == 2)"),
      self("object"), {.has_layers = true, .has_fading = true}));
  all.push_back(render_command(
      "robot.render", "Draws a robot to a PNG file.",
      "local arm = robot.get(\"twolink\")\n"
      "arm:render{file = \"arm.png\", q = {\"30 deg\", \"45 deg\"}, " +
          small,
      self("robot"),
      {.has_joints = true, .records = true, .has_layers = true, .has_fading = true}));
  all.push_back(render_command(
      "world.render", "Draws a world to a PNG file.",
      "local cell = world.create{name = \"cell\"}\n"
      "cell:render{file = \"cell.png\", view = \"front\", " +
          small,
      self("world"), {.moves = true, .has_layers = true, .has_members = true, .has_fading = true}));
  all.push_back(render_command(
      "material.render", "Draws a material, on a sphere and a cone, to a PNG file.",
      "local brass = material.create{name = \"brass\", density = 8500, colour = \"#c8a44a\", "
      "metalness = 1, shininess = 0.8}\n"
      "brass:render{file = \"brass.png\", " +
          small,
      self("material"),
      {.has_mass = false, .has_frames = false, .has_parts = false, .has_fading = true}));
  all.push_back(picture_command(
      "view.picture",
      "Draws a world, robot, object, solid or material and returns the PNG's bytes.",
      with_plate("local p = view.picture{what = \"plate\", view = \"top\", " + small + is_png),
      needed("what", "ref:world|robot|object|solid|material", "", "The record to draw."),
      kAnything));
  all.push_back(
      picture_command("solid.picture", "Draws a solid and returns the PNG's bytes.",
                      with_plate("local p = plate:picture{section = \"-y\", " + small + is_png),
                      self("solid"), {.has_parts = false, .has_layers = true, .has_fading = true}));
  all.push_back(picture_command(
      "object.picture", "Draws an object and returns the PNG's bytes.",
      with_plate("local stack = object.create{name = \"stack\", parts = {{what = \"plate\"}}}\n"
                 "local p = stack:picture{" +
                 small + is_png),
      self("object"), {.has_layers = true, .has_fading = true}));
  all.push_back(picture_command(
      "robot.picture", "Draws a robot and returns the PNG's bytes.",
      "local arm = robot.get(\"twolink\")\n"
      "local p = arm:picture{q = {\"30 deg\", \"45 deg\"}, " +
          small + is_png,
      self("robot"),
      {.has_joints = true, .records = true, .has_layers = true, .has_fading = true}));
  all.push_back(picture_command(
      "world.picture", "Draws a world and returns the PNG's bytes.",
      "local cell = world.create{name = \"cell\"}\n"
      "local p = cell:picture{view = \"front\", " +
          small + is_png,
      self("world"), {.moves = true, .has_layers = true, .has_members = true, .has_fading = true}));
  all.push_back(picture_command(
      "material.picture", "Draws a material, on a sphere and a cone, and returns the PNG's bytes.",
      "local brass = material.create{name = \"brass\", density = 8500, colour = \"#c8a44a\"}\n"
      "local p = brass:picture{" +
          small + is_png,
      self("material"),
      {.has_mass = false, .has_frames = false, .has_parts = false, .has_fading = true}));
  all.push_back({.name = "view.redraw",
                 .classic = "ForceReDraw",
                 .summary = "Draws the scene again in viewers that show one.",
                 .details = "Viewers follow every change automatically.",
                 .example = "view.redraw()",
                 .params = {},
                 .returns = {},
                 .effect = Effect::simulates,
                 .run = redraw});
  return all;
}

}  // namespace robomosp::ioci
