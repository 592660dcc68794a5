// SPDX-License-Identifier: Apache-2.0
#include "ioci/view/picture.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <set>
#include <system_error>

#include "ioci/view/map_view.h"
#include "kernel/file_root.h"
#include "kernel/text.h"
#include "kernel/type.h"
#include "scene/visibility.h"
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
constexpr Word<scene::ShownPath> kPaths[] = {{"line", scene::ShownPath::line},
                                             {"arrows", scene::ShownPath::arrows},
                                             {"points", scene::ShownPath::points},
                                             {"frames", scene::ShownPath::frames},
                                             {"none", scene::ShownPath::none}};
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

Result<void> read_size(const Map& args, render::Options& options) {
  const auto size = reals(args, "size");
  if (size.empty()) return {};
  const bool is_whole = size.size() == 2 && std::all_of(size.begin(), size.end(), [](double x) {
                          return x >= 16 && x <= 8192 && x == std::floor(x);
                        });
  if (!is_whole)
    return error(ErrorCode::invalid_argument,
                 "a size must be two whole numbers of pixels in 16..8192",
                 "Give a width and a height such as {800, 600}.", "size");
  options.width = static_cast<int>(size[0]);
  options.height = static_cast<int>(size[1]);
  return {};
}

Result<void> read_background(const Map& args, render::Look& look) {
  const Value* given = args.find("background");
  if (!given || given->is_nil()) return {};
  const std::string* word = given->as_string();
  if (word && *word == "studio") {
    look.background = Background::studio;
  } else if (word && *word == "dark") {
    look.background = Background::studio;
    look.background_colour = {0, 0, 0, 1};
  } else if (word && *word == "transparent") {
    look.background = Background::transparent;
  } else {
    look.background = Background::plain;
    if (word && *word == "white") return {};
    auto colour = read_colour(*given, "background");
    if (!colour.ok())
      return error(ErrorCode::invalid_argument, given->text() + " is not a background",
                   "Give \"studio\", \"dark\", \"white\", \"transparent\" or a colour such as "
                   "\"#e8eef4\".",
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

}  // namespace

Result<Camera> read_camera(const Map& args) {
  Camera camera;
  camera.view = value_of(kViews, text_of(args, "view"));
  camera.perspective = text_of(args, "projection") == "perspective";
  camera.zoom = real(args, "zoom");
  if (has(args, "eye") != has(args, "target"))
    return error(ErrorCode::invalid_argument, "eye and target must be given together",
                 "Give both, or a view.", has(args, "eye") ? "eye" : "target");
  if (!has(args, "eye")) return camera;
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
  return camera;
}

Result<render::Options> read_picture(const Map& args) {
  render::Options options;
  render::Look& look = options.look;
  RMP_TRY(read_size(args, options));
  RMP_TRY_ASSIGN(look.camera, read_camera(args));
  RMP_TRY(read_background(args, look));
  look.style = value_of(kStyles, text_of(args, "style"));
  look.feature_edges = flag(args, "edges");
  look.hidden_edges = flag(args, "hidden");
  look.grid = flag(args, "grid");
  look.world_axes = flag(args, "axes");
  look.caption = text_of(args, "caption");
  options.quality = value_of(kQualities, text_of(args, "quality"));
  return options;
}

scene::ShownPath read_paths(const Map& args) {
  return has(args, "paths") ? value_of(kPaths, text_of(args, "paths")) : scene::ShownPath::line;
}

Result<std::optional<render::Section>> read_section(const CommandContext& ctx, const Map& args,
                                                    const render::Scene& scene) {
  using Out = std::optional<render::Section>;
  const Value* given = args.find("section");
  if (!given || given->is_nil()) return Out{};
  RMP_TRY_ASSIGN(const Map s, read_plane_map(ctx, section_fields(), *given, "section"));
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

bool takes_all(const render::Section& section, const render::Scene& scene) {
  bool is_anything_there = false, is_anything_left = false;
  each_corner(scene, [&](const Vec3& x) {
    is_anything_there = true;
    is_anything_left =
        is_anything_left || spatial::dot(spatial::sub(x, section.point), section.normal) < 0;
  });
  return is_anything_there && !is_anything_left;
}

Result<void> check_new_file(const std::string& file, const std::string& extension,
                            const char* only) {
  namespace fs = std::filesystem;
  const fs::path path(file);
  std::string ending = path.extension().string();
  for (char& c : ending)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  if (ending != extension)
    return error(ErrorCode::invalid_argument, text::quote(file) + " does not end with " + extension,
                 only, "file");
  if (path.has_parent_path() && file_kind(path.parent_path()) != FileKind::folder)
    return error(ErrorCode::not_found,
                 "cannot write " + text::quote(file) + ": there is no folder " +
                     text::quote(path.parent_path().string()),
                 "Create the folder or choose another one.", "file");
  return {};
}

Result<std::shared_ptr<render::Renderer>> renderer(Application& app) {
  const std::uint64_t revision = app.registry.revision();
  const std::lock_guard lock(app.renderer_mutex);
  if (app.renderer && app.renderer_revision == revision) return app.renderer;
  if (app.registry.list(render::Renderer::kInterfaceId).empty())
    return error(
        ErrorCode::unsupported, "cannot draw a picture, because no renderer is installed",
        "Install the desktop package of this program, which contains the plugin render_osg.");
  RMP_TRY_ASSIGN(app.renderer, app.registry.create<render::Renderer>(""));
  app.renderer_revision = revision;
  return app.renderer;
}

Result<render::Image> draw_image(const render::Renderer& drawer, const render::Scene& scene,
                                 const render::Options& options, Progress& progress) {
  const auto draw = [&] { return drawer.draw(scene, options, progress); };
  auto image = guarded("renderer", draw);
  if (!image.ok()) return std::move(image).error();
  if (image->rgba.size() !=
      4 * static_cast<std::size_t>(options.width) * static_cast<std::size_t>(options.height))
    return error(ErrorCode::plugin_failed, "the renderer made a picture of a different size",
                 "Report it to the provider's author or choose another provider.");
  return image;
}

Result<std::string> draw_png(const render::Renderer& drawer, const render::Scene& scene,
                             const render::Options& options, Progress& progress) {
  RMP_TRY_ASSIGN(const render::Image image, draw_image(drawer, scene, options, progress));
  return guarded("renderer", [&] { return drawer.png(image); });
}

Schema picture_params(const PictureAbilities& can) {
  Schema s{choice("view", words(kViews),
                  "View direction; isometric is the three-quarter view from the front right, and "
                  "with orthographic the true isometric one.")};
  s.push_back(choice("style", words(kStyles),
                     "smooth and flat are shaded, wireframe shows all lines, hidden_line is a "
                     "drawing with white faces."));
  s.push_back(optional("size", "real[]", "", "Width and height [px], 16..8192; {800, 600}."));
  s.push_back(choice("quality", words(kQualities),
                     "draft is simple lighting in a fraction of a second, normal has soft shadows, "
                     "high is for print."));
  s.push_back(choice("projection", {"perspective", "orthographic"}, "Projection of depth."));
  s.push_back(
      between(defaulted("zoom", "real", "", 1.0, "1 fits everything but floors into the picture."),
              0.01, 100));
  s.push_back(optional("eye", "vec3", "m", "Position of the camera, instead of a view."));
  s.push_back(optional("target", "vec3", "m", "Point that the camera looks at, with eye."));
  s.push_back(defaulted("edges", "bool", "", true, "Dark lines along the edges."));
  s.push_back(defaulted("hidden", "bool", "", false,
                        "With hidden_line: draw hidden edges dashed instead of omitting them."));
  s.push_back(optional("section", "any", "",
                       "A plane that cuts everything open: an axis such as \"x\" or \"-z\" through "
                       "the middle, or a table with axis or normal, offset or point, colour and "
                       "hatch. The side the axis or normal points to is removed."));
  if (can.has_joints || can.moves)
    s.push_back(
        optional("map", "any", "",
                 "Voxels around a robot: a recording of robot.workspace or "
                 "robot.reachability, or a table with recording, column, cut (a plane as "
                 "for section, through the mounting frame's origin), opacity, above (a value), "
                 "low, high, bands, and in a world robot, its name there."));
  if (can.has_parts) {
    ParamSpec p = defaulted("explode", "real", "", 0.0,
                            "Explosion: moves the parts outwards by this share of their distance.");
    s.push_back(between(std::move(p), 0, 100));
  }
  if (can.has_mass)
    s.push_back(defaulted("com", "bool", "", false,
                          "Marks the centre of mass by a chequered ball, with the principal axes "
                          "as long as the radii of gyration on both sides."));
  if (can.has_frames)
    s.push_back(defaulted("frames", "bool", "", false,
                          "Frames of nodes, parts or links, with their names."));
  if (can.has_joints)
    s.push_back(optional("q", "any", "",
                         "Joint values or a named pose; the pose home or zeros if omitted."));
  if (can.has_joints || can.moves)
    s.push_back(choice("ellipsoid", {"none", "velocity", "force", "both"},
                       "Ellipsoids at the tools of robots: the velocities for joint speeds of unit "
                       "length, or the forces for joint torques of unit length; the greatest half "
                       "axis is a fifth of the reach."));
  if (can.moves || can.records) {
    s.push_back(optional(
        "recording", "ref:recording", "",
        "Recording that places the robot, with at; for a robot, a recording without a world."));
    ParamSpec at = optional("at", "real", "s", "Time within the recording.");
    at.min = 0;
    s.push_back(std::move(at));
  }
  if (can.moves) {
    s.push_back(paths_param());
    s.push_back(
        optional("path_robot", "string", "",
                 "The robot with the tool that joint trajectories move; by default the only one."));
    s.push_back(defaulted("collisions", "bool", "", false,
                          "Shows touching bodies in red; if none touch, the shortest line between "
                          "two bodies with its length."));
  }
  if (can.has_layers) {
    s.push_back(optional("layers", "list<enum(" + text::join(scene::layer_names(), "|") + ")>", "",
                         "Overlays, as a window shows them."));
  }
  if (can.has_members) s.push_back(without_param());
  if (can.has_fading) s.push_back(fade_param());
  s.push_back(optional("background", "any", "",
                       "studio, dark (a studio with dark floor and wall), white, transparent or a "
                       "colour; by default studio for shaded styles and white for drawings."));
  s.push_back(defaulted("grid", "bool", "", true, "Lines on the floor of the studio."));
  s.push_back(defaulted("axes", "bool", "", true, "The axes on the floor and in the corner."));
  s.push_back(defaulted("caption", "string", "", "", "Small text in the lower left corner."));
  return s;
}

namespace {

const Schema& fade_fields() {
  static const Schema all{
      optional("what", "ref:world|robot|object|solid", "",
               "Record with the place; by default the one that is drawn."),
      defaulted("path", "string", "", "",
                "Member, link, part or node, such as objects.table, links.elbow, parts.shank or "
                "nodes.hole; the whole record if omitted."),
      between(needed("opacity", "real", "", "Share of its opacity."), 0, 1)};
  return all;
}

/// A place as messages name it: `"links.elbow" of robot "arm"`.
std::string place_text(const CommandContext& ctx, AnyId what, const std::string& path) {
  return (path.empty() ? std::string() : text::quote(path) + " of ") + name_in(ctx, what);
}

}  // namespace

ParamSpec paths_param() {
  return choice(
      "paths", words(kPaths),
      "Display of trajectories, each including the items before it: the tool's path, arrowheads "
      "along it, the control points as numbered balls, and their axes; or none.");
}

ParamSpec without_param() {
  return optional("without", "list<string>", "",
                  "Members of a world that are left out, such as \"objects.table\" or "
                  "\"robots.arm\".");
}

ParamSpec fade_param() {
  return optional("fade", "list<" + map_type(fade_fields()) + ">", "",
                  "Places drawn with less opacity; later entries override earlier ones. Drawings "
                  "of lines have no opacity.");
}

Result<void> apply_visibility(const CommandContext& ctx, const Map& args, AnyId what,
                              scene::Built& built) {
  const scene::Frame& frame = *built.frame;
  std::map<std::uint64_t, double> shares;
  if (const Value* fade = args.find("fade"); fade && fade->as_list())
    for (std::size_t i = 0; i < fade->as_list()->size(); ++i) {
      const std::string where = "fade[" + std::to_string(i + 1) + "]";
      RMP_TRY_ASSIGN(const Map f, read_map(ctx, fade_fields(), (*fade->as_list())[i], where));
      const AnyId of = has(f, "what") ? ref(f, "what") : what;
      const std::string path = text_of(f, "path");
      const std::vector<std::uint64_t> items = scene::items_of(frame, of, path);
      if (items.empty())
        return error(ErrorCode::unknown_name,
                     "the picture has nothing of " + place_text(ctx, of, path),
                     "Give a member such as objects.table, or a record with the path of a link, "
                     "part or node.",
                     where);
      for (const std::uint64_t id : items) shares[id] = real(f, "opacity");
    }
  for (render::Item& item : built.scene.items)
    if (const auto at = shares.find(item.id); at != shares.end())
      item.appearance.colour.a *= static_cast<float>(at->second);
  std::set<std::string> without;
  if (const Value* paths = args.find("without"); paths && paths->as_list()) {
    const std::set<std::string> known = scene::member_paths(frame);
    for (std::size_t i = 0; i < paths->as_list()->size(); ++i) {
      const std::string where = "without[" + std::to_string(i + 1) + "]";
      const std::string* path = (*paths->as_list())[i].as_string();
      if (!path || !known.contains(*path))
        return unknown_name("member", path ? *path : std::string(), {known.begin(), known.end()})
            .in(where);
      if (path->starts_with("lights."))
        return error(ErrorCode::unsupported,
                     text::quote(*path) + " is a light, of which pictures have no symbol",
                     "Leave it out of the list, or remove the light from the world.", where);
      without.insert(*path);
    }
  }
  (void)scene::leave_out(frame, without, built.scene);
  return {};
}

Result<void> read_layers(const Map& args, scene::Extras& extras) {
  if (const Value* layers = args.find("layers"); layers && layers->as_list())
    for (const Value& layer : *layers->as_list())
      if (auto set = scene::set_layer(extras, layer.text(), true); !set.ok())
        return std::move(set).error().in("layers");
  return {};
}

Schema camera_params() {
  Schema all = picture_params({});
  std::erase_if(all, [](const ParamSpec& p) {
    return p.name != "view" && p.name != "projection" && p.name != "zoom" && p.name != "eye" &&
           p.name != "target";
  });
  return all;
}

}  // namespace robomosp::ioci
