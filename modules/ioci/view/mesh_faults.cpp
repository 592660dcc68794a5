// SPDX-License-Identifier: Apache-2.0
// Where imported meshes bound no clean solid: open rims, cuts, places enclosed twice; in words and
// as a picture.
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "io/native.h"
#include "ioci/view/picture.h"
#include "scene/build.h"
#include "spatial/vec.h"

namespace robomosp::ioci {
namespace {

constexpr std::size_t kMostLabels = 12;  ///< in a picture; more hide each other
constexpr Colour kRim{0.90F, 0.10F, 0.10F, 1}, kCut{0.85F, 0.10F, 0.75F, 1},
    kOverlap{0.95F, 0.55F, 0.05F, 1};

struct Place {
  std::string kind;  ///< open, cut or overlap
  Vec3 at{};
  double size = 0;
  std::vector<Vec3> line;
};

std::vector<Place> places_of(const evaluation::MeshState& state) {
  std::vector<Place> out;
  for (const spatial::SurfaceFault& f : state.surface.faults)
    out.push_back(
        {f.kind == spatial::SurfaceFault::Kind::rim ? "open" : "overlap", f.at, f.size, f.line});
  for (const spatial::SurfaceCut& c : state.cuts) out.push_back({"cut", c.at, 0, {}});
  std::stable_sort(out.begin(), out.end(),
                   [](const Place& a, const Place& b) { return a.size > b.size; });
  return out;
}

/// The solid, clear as glass, with rims as lines, cuts and overlaps as crosses, and names at the
/// largest.
void mark(render::Scene& scene, const std::vector<Place>& places) {
  for (render::Item& item : scene.items) item.appearance.colour.a = 0.35F;
  constexpr double kInf = std::numeric_limits<double>::infinity();
  Vec3 low{kInf, kInf, kInf}, high{-kInf, -kInf, -kInf};
  for (const render::Item& item : scene.items)
    for (std::size_t i = 0; i + 2 < item.mesh->positions.size(); i += 3)
      for (std::size_t k = 0; k < 3; ++k) {
        low[k] = std::min(low[k], double{item.mesh->positions[i + k]});
        high[k] = std::max(high[k], double{item.mesh->positions[i + k]});
      }
  const double arm = scene.items.empty() ? 0 : 0.012 * spatial::distance(low, high);
  std::uint64_t id = 1;
  for (const Place& p : places) {
    const Colour colour = p.kind == "open" ? kRim : p.kind == "cut" ? kCut : kOverlap;
    if (!p.line.empty()) {
      render::Line rim;
      rim.id = id++;
      rim.points = p.line;
      rim.points.push_back(p.line.front());
      rim.colour = colour;
      scene.lines.push_back(std::move(rim));
    } else {
      for (std::size_t k = 0; k < 3; ++k) {
        render::Line cross;
        cross.id = id++;
        Vec3 from = p.at, to = p.at;
        from[k] -= arm;
        to[k] += arm;
        cross.points = {from, to};
        cross.colour = colour;
        scene.lines.push_back(std::move(cross));
      }
    }
    // One name is enough for what is close together.
    const bool is_named =
        std::any_of(scene.labels.begin(), scene.labels.end(), [&](const render::Label& l) {
          return l.text == p.kind && spatial::distance(l.place, p.at) < 10 * arm;
        });
    if (is_named || scene.labels.size() >= kMostLabels) continue;
    render::Label label;
    label.place = p.at;
    label.text = p.kind;
    scene.labels.push_back(std::move(label));
  }
}

Result<Value> mesh_faults(CommandContext& ctx, const Map& args) {
  const auto id = typed<model::Solid>(args);
  const bool draws = has(args, "file");
  render::Options options;
  if (draws) {
    RMP_TRY(
        check_new_file(text_of(args, "file"), ".png", "Pictures are written as PNG files only."));
    RMP_TRY_ASSIGN(options, read_picture(args));
  }
  RMP_TRY_ASSIGN(const auto states,
                 ctx.app.derived.mesh_states(ctx.snapshot(), id, true, ctx.progress));
  List meshes;
  std::vector<Place> all;
  for (const evaluation::MeshState& state : states) {
    const std::vector<Place> places = places_of(state);
    List told;
    for (const Place& p : places)
      told.emplace_back(
          Map{{"kind", p.kind}, {"position", vec_value(p.at, "m")}, {"size", p.size}});
    const Moments& m = state.surface.moments;
    meshes.emplace_back(Map{{"node", state.node},
                            {"why", state.why.message},
                            {"open_edges", state.surface.open_edges},
                            {"turned", state.surface.turned},
                            {"volume", m.volume},
                            {"relative_error", m.relative_error},
                            {"is_hull", state.surface.is_hull},
                            {"places", std::move(told)}});
    all.insert(all.end(), places.begin(), places.end());
  }
  Map out{{"meshes", std::move(meshes)}};
  if (draws) {
    const std::string file = text_of(args, "file");
    const scene::Source source{ctx.snapshot(), ctx.app.derived, ctx.app.registry};
    RMP_TRY_ASSIGN(scene::Built built, scene::build(source, id, {}, ctx.progress));
    RMP_TRY(apply_visibility(ctx, args, id, built));
    mark(built.scene, all);
    RMP_TRY_ASSIGN(options.look.section, read_section(ctx, args, built.scene));
    RMP_TRY_ASSIGN(const auto drawer, renderer(ctx.app));
    RMP_TRY_ASSIGN(const std::string bytes, draw_png(*drawer, built.scene, options, ctx.progress));
    RMP_TRY(io::write_file(file, bytes));
    out.set("file", file);
  }
  return Value(std::move(out));
}

}  // namespace

RMP_COMMANDS(mesh_fault_commands) {
  CommandSpec c;
  c.name = "solid.mesh_faults";
  c.summary =
      "Lists and shows the places at which imported meshes of a solid do not bound a clean solid.";
  c.details =
      "Clean meshes are not listed. For the others it returns the reason why operations on solids "
      "refuse them and the places, the largest first: `open` is the rim of a hole, `cut` a place "
      "at which triangles intersect (the first 1000), `overlap` a region that the mesh encloses "
      "more than once. `volume` is the volume used for the mesh if it is the whole solid, in its "
      "own frame, within `relative_error`; `is_hull` means that it is that of the convex "
      "hull.\n\nWith `file`, a picture is drawn of the solid, transparent like glass, with rims as "
      "lines and other places as crosses; the view is chosen as for `solid.render`.";
  c.example =
      "local lid = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 0, 0}}\n"
      "local cup = solid.create{name = \"cup\", root = {kind = \"imported\", geometry = {\n"
      "  points = lid, triangles = {{4, 2, 1}, {4, 1, 3}, {4, 3, 2}}}}}\n"
      "local faults = cup:mesh_faults().meshes[1]\n"
      "assert(faults.open_edges == 3 and faults.places[1].kind == \"open\")";
  c.params = {self("solid"), optional("file", "path", "", "The picture, *.png.")};
  for (ParamSpec& p : picture_params(
           {.has_mass = false, .has_frames = false, .has_parts = false, .has_fading = true}))
    c.params.push_back(std::move(p));
  c.returns = {"map",
               "",
               "",
               {field("meshes", "list", "",
                      "For each mesh: node, why, open_edges, turned (triangles with reversed "
                      "orientation), volume [m^3], relative_error, is_hull, and places with kind, "
                      "position [m] and size [m]."),
                field("file", "string", "", "The picture, if requested.")}};
  c.sometimes = Effect::files_write;
  c.run = mesh_faults;
  return {std::move(c)};
}

}  // namespace robomosp::ioci
