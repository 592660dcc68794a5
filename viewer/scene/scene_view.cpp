// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/scene/scene_view.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <unordered_map>
#include <utility>

#include <osg/BlendFunc>
#include <osg/ColorMask>
#include <osg/CullFace>
#include <osg/Depth>
#include <osg/GLObjects>
#include <osg/Geode>
#include <osg/LineWidth>
#include <osg/MatrixTransform>
#include <osg/PolygonMode>
#include <osg/PolygonOffset>
#include <osgViewer/GraphicsWindow>
#include <osgViewer/Viewer>

#include "viewer/scene/hud.h"
#include "viewer/scene/lamps.h"
#include "viewer/scene/linear.h"
#include "viewer/scene/osg_geometry.h"
#include "viewer/scene/playback.h"
#include "viewer/scene/shadow_map.h"
#include "viewer/scene/surface.h"

namespace robomosp::viewer {
namespace {

// What each camera draws.
constexpr unsigned kVisible = 1, kCaster = 2, kGlassCaster = 4;
// Order of drawing within the picture.
constexpr int kOutlineBin = 2, kGroundBin = 3, kBackgroundBin = 4, kGroundFromBelowBin = 5,
              kEdgeBin = 6, kRibbonBin = 7, kVeilBin = 8,
              kGlassBin = 100,  // and the bins after it, one for each layer of glass
    kMarkBin = 1 << 20, kHudBin = kMarkBin + 10;
// Widths of lines and sizes in pixels of a picture 800 pixels high.
constexpr double kEdgeWidth = 1.15, kDrawnWidth = 2.0, kMeshWidth = 1.0, kDashPeriod = 9.0,
                 kHatchSpacing = 8.5, kBallRadius = 13.0;
/// Axes of a mass mark, smallest moment first, sRGB.
constexpr std::array<Colour, 3> kPrincipalColours{
    {{0.80F, 0.10F, 0.52F, 1}, {0.02F, 0.55F, 0.58F, 1}, {0.88F, 0.60F, 0.02F, 1}}};
constexpr osg::StateAttribute::GLMode kSectionMode = GL_CLIP_PLANE0;  // = GL_CLIP_DISTANCE0

// Towards the lamp: above the left shoulder of whoever takes the isometric view.
constexpr Vec3 kLamp{-0.20, -0.80, 1.02};
// Share of the studio's sky and floor where the scene has lights of its own.
constexpr double kSurroundings = 0.5;
constexpr float kOpaque = 0.999F;

/// A shadow map's coordinates that are outside of it everywhere: no shadow.
osg::Matrixf nowhere() { return osg::Matrixf::scale(0, 0, 0) * osg::Matrixf::translate(-1, -1, 0); }

osg::Vec3f vec_of(const Vec3& v) {
  return {static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2])};
}

Vec3 unit(const Vec3& v) { return (1 / norm(v)) * v; }

std::array<Vec3, 8> corners(const Surface& s, const Pose& pose) {
  std::array<Vec3, 8> c;
  for (std::size_t i = 0; i < 8; ++i) {
    c[i] =
        transform(pose, {(i & 1U) != 0 ? s.high[0] : s.low[0], (i & 2U) != 0 ? s.high[1] : s.low[1],
                         (i & 4U) != 0 ? s.high[2] : s.low[2]});
  }
  return c;
}

void blend(osg::StateSet* state, osg::Depth::Function function = osg::Depth::LESS) {
  state->setMode(GL_BLEND, osg::StateAttribute::ON);
  // The colour in memory is the one times the opacity, so that passes can be averaged.
  state->setAttributeAndModes(
      new osg::BlendFunc(osg::BlendFunc::SRC_ALPHA, osg::BlendFunc::ONE_MINUS_SRC_ALPHA,
                         osg::BlendFunc::ONE, osg::BlendFunc::ONE_MINUS_SRC_ALPHA));
  state->setAttributeAndModes(new osg::Depth(function, 0, 1, false));
}

osg::ref_ptr<osg::Geode> geode_of(osg::Geometry* geometry, unsigned mask) {
  osg::ref_ptr<osg::Geode> geode = new osg::Geode;
  geode->addDrawable(geometry);
  geode->setNodeMask(mask);
  return geode;
}

/// From where something was last computed for an item.
struct Seen {
  Matrix4 view{};
  Pose pose;
  bool perspective = true;
};
bool same(const Seen& a, const Seen& b) {
  return a.view == b.view && a.pose.R == b.pose.R && a.pose.p == b.pose.p &&
         a.perspective == b.perspective;
}

/// A section with a unit normal.
struct Plane {
  Vec3 point{}, normal{};
  friend bool operator==(const Plane&, const Plane&) = default;
};

struct ItemNode {
  Item item;
  Surface surface;
  osg::ref_ptr<osg::MatrixTransform> place;
  osg::ref_ptr<osg::Geometry> triangles, segments, hull;
  bool is_seen = true;
  // Glass: the far and the near sides and the edges, which are ordered by depth at each draw.
  osg::ref_ptr<osg::Geode> glass_back, glass_front, glass_edges;
  std::optional<Seen> glass_sorted;
  // Drawings: contours as seen from the camera.
  std::vector<MeshEdge> mesh_edges;
  std::vector<osg::ref_ptr<osg::Geode>> contours;
  std::optional<Seen> contours_seen;
  // Sections.
  osg::ref_ptr<osg::Group> cut;
  std::optional<Plane> cut_by;
  Pose cut_pose;
  std::vector<float> cut_points;
};

struct LineNode {
  Line line;
  osg::ref_ptr<osg::Group> group;
  bool is_seen = true;
};

struct TriadNode {
  Triad triad;
  osg::ref_ptr<osg::MatrixTransform> place;
  bool is_seen = true;
};

struct MarkNode {
  MassMark mark;
  osg::ref_ptr<osg::MatrixTransform> place, ball;
  bool is_seen = true;
};

bool same(const Colour& a, const Colour& b) {
  return a.r == b.r && a.g == b.g && a.b == b.b && a.a == b.a;
}

bool same(const Appearance& a, const Appearance& b) {
  const auto both = [](const std::optional<Colour>& x, const std::optional<Colour>& y) {
    return x.has_value() == y.has_value() && (!x || same(*x, *y));
  };
  return same(a.colour, b.colour) && a.shininess == b.shininess && a.metalness == b.metalness &&
         both(a.ambient, b.ambient) && both(a.specular, b.specular) && same(a.emission, b.emission);
}

osg::Vec3f rgb_of(const Colour& srgb) {
  const osg::Vec4f c = linear_of(srgb);
  return {c.x(), c.y(), c.z()};
}

bool same(const std::optional<Section>& a, const std::optional<Section>& b) {
  if (!a || !b) return a.has_value() == b.has_value();
  return a->point == b->point && a->normal == b->normal && same(a->colour, b->colour) &&
         a->hatch == b->hatch;
}

bool is_drawing(Style style) { return style == Style::wireframe || style == Style::hidden_line; }

bool has_studio(const render::Look& look) {
  return look.background == Background::studio ||
         (look.background == Background::automatic && !is_drawing(look.style));
}

bool same(const Line& a, const Line& b) {
  return a.points == b.points && same(a.colour, b.colour) && a.width == b.width;
}

/// Drops the nodes that the newest frame did not name.
template <class Map, class Remove>
void sweep(Map& nodes, Remove&& remove) {
  for (auto i = nodes.begin(); i != nodes.end();) {
    if (std::exchange(i->second.is_seen, false)) {
      ++i;
    } else {
      remove(i->second);
      i = nodes.erase(i);
    }
  }
}

}  // namespace

struct SceneView::Impl {
  Impl(Quality quality, Target target);

  void build_item(ItemNode& node);
  void build_line(LineNode& node);
  void sync_items(const Frame& frame);
  void sync_lines(const Frame& frame);
  void sync_triads(const Frame& frame);
  void sync_marks(const Frame& frame);
  void sync_look(const Frame& frame);
  [[nodiscard]] osg::ref_ptr<osg::Geode> line_geode(osg::Geometry* segments, bool is_hidden) const;
  void update_cuts();
  void build_cut(ItemNode& node);
  void update_contours();
  void sort_glass();
  void sort_triangles(ItemNode& node) const;
  void place_marks(double scale);
  [[nodiscard]] double scale() const { return std::max(camera.height() / 800.0, 0.6); }
  [[nodiscard]] bool is_kept(const Vec3& p) const {
    return !plane || dot(plane->normal, p - plane->point) <= 0;
  }
  void place_ground();
  void apply_camera(const Camera& wanted);
  void apply_time();
  void fit();
  void refit_if_untouched();
  [[nodiscard]] std::vector<Vec3> points_of_bodies() const;
  [[nodiscard]] std::vector<Vec3> points_shown() const;
  [[nodiscard]] std::vector<Vec3> points_moved() const;
  [[nodiscard]] std::vector<Lamp> lights_of(const Pass& pass) const;
  void aim_lights(const Pass& pass);
  void place_camera(const Pass& pass);
  void prepare();

  bool is_still;
  OrbitCamera camera, fitted;
  std::optional<Camera> frame_camera;
  double frame_zoom = 1;
  bool is_fitted = false;
  render::Look look;
  std::optional<Plane> plane;
  std::vector<render::Label> labels;
  std::vector<Lamp> lights;  // of the frame, the brightest first
  std::size_t builds = 0;
  std::unordered_map<std::uint64_t, ItemNode> items;
  std::unordered_map<std::uint64_t, LineNode> lines;
  std::unordered_map<std::uint64_t, TriadNode> triads;
  std::unordered_map<std::uint64_t, MarkNode> marks;
  std::shared_ptr<const Playback> playback;
  std::optional<double> time;
  double radius = 1;  // half the diagonal of the box around the frame [m]

  osg::ref_ptr<osg::Group> casters = new osg::Group;
  ShadowMap lamp, sky;
  osg::ref_ptr<osg::Group> root = new osg::Group, ribbons = new osg::Group, frames = new osg::Group,
                           cuts = new osg::Group, balls = new osg::Group;
  osg::ref_ptr<osg::MatrixTransform> ground = new osg::MatrixTransform;
  osg::ref_ptr<osg::Geode> background;
  osg::ref_ptr<osg::Program> surface_program, flat_program, paper_program, cut_program,
      edge_program, outline_program, ribbon_program, ball_program;
  osg::ref_ptr<osg::LineWidth> edge_width = new osg::LineWidth(1.0F),
                               drawn_width = new osg::LineWidth(1.0F),
                               mesh_width = new osg::LineWidth(1.0F);
  std::unique_ptr<Hud> hud;

  osg::ref_ptr<osgViewer::GraphicsWindowEmbedded> window;
  osgViewer::Viewer viewer;
  osg::ref_ptr<osg::Image> memory;
  std::vector<float> pixels;
  bool is_prepared = false, is_released = false;
};

SceneView::Impl::Impl(Quality quality, Target target)
    : is_still(target == Target::memory),
      lamp(quality == Quality::quality && !is_still ? 2048 : 1024, casters.get(), kCaster),
      sky(768, casters.get(), 0) {
  const ShaderVariant variant{quality == Quality::quality, is_still};
  surface_program = program_of(surface_shader(variant), "surface");
  edge_program = program_of(edge_shader(variant), "edge");
  outline_program = program_of(outline_shader(variant), "outline");
  // Compiled when first drawn.
  flat_program = program_of(surface_shader({variant.is_quality, is_still, true}), "flat");
  paper_program = program_of(paper_shader(variant), "paper");
  cut_program = program_of(cut_shader(variant), "cut");
  ribbon_program = program_of(ribbon_shader(variant), "ribbon");
  ball_program = program_of(ball_shader(variant), "ball");

  osg::StateSet* s = root->getOrCreateStateSet();
  // An alpha below one in a window's framebuffer would let what is behind the window shine through.
  s->setAttribute(new osg::ColorMask(true, true, true, is_still));
  s->setTextureAttribute(kLampUnit, lamp.texture());
  s->setTextureAttribute(kSkyUnit, sky.texture());
  set_uniform(s, "lamp_shadow", kLampUnit);
  set_uniform(s, "sky_shadow", kSkyUnit);
  set_uniform(s, "highlight", osg::Vec4f(1, 1, 1, 0));
  set_uniform(s, "glow", osg::Vec3f(0, 0, 0));
  set_uniform(s, "section_plane", osg::Vec4f(0, 0, 0, 1));
  set_uniform(s, "dash", 0.0F);
  set_uniform(s, "drawn", 0.0F);

  osg::StateSet* c = casters->getOrCreateStateSet();
  c->setAttributeAndModes(surface_program);
  c->setAttributeAndModes(new osg::PolygonOffset(1.0F, 1.0F));
  casters->addChild(cuts);
  cuts->getOrCreateStateSet()->setMode(kSectionMode, osg::StateAttribute::OFF);
  set_uniform(cuts->getStateSet(), "section_plane", osg::Vec4f(0, 0, 0, 1));

  background = geode_of(square_of(1), kVisible);
  background->setCullingActive(false);
  osg::StateSet* b = background->getOrCreateStateSet();
  b->setAttributeAndModes(program_of(background_shader(variant), "background"));
  // After everything opaque, so that only what stays free is painted.
  b->setAttributeAndModes(new osg::Depth(osg::Depth::LEQUAL, 0, 1, false));
  b->setRenderBinDetails(kBackgroundBin, "RenderBin");

  ground->addChild(geode_of(square_of(1), kVisible));
  ground->setCullingActive(false);
  osg::StateSet* g = ground->getOrCreateStateSet();
  g->setAttributeAndModes(program_of(ground_shader(variant), "ground"));

  ribbons->getOrCreateStateSet()->setAttributeAndModes(ribbon_program);
  // Marks are seen through everything: a sliver of the depth range before the scene is theirs.
  osg::StateSet* m = balls->getOrCreateStateSet();
  m->setAttributeAndModes(ball_program);
  m->setAttributeAndModes(new osg::Depth(osg::Depth::LEQUAL, 0.001, 0.01, true));
  m->setRenderBinDetails(kMarkBin, "RenderBin", osg::StateSet::OVERRIDE_RENDERBIN_DETAILS);
  frames->getOrCreateStateSet()->setAttributeAndModes(surface_program);
  frames->getOrCreateStateSet()->setMode(GL_NORMALIZE, osg::StateAttribute::ON);
  hud = std::make_unique<Hud>(surface_program.get(), kHudBin, kVisible);

  root->addChild(lamp.camera());
  root->addChild(sky.camera());
  for (osg::Node* node :
       {static_cast<osg::Node*>(background.get()), static_cast<osg::Node*>(casters.get()),
        static_cast<osg::Node*>(ground.get()), static_cast<osg::Node*>(ribbons.get()),
        static_cast<osg::Node*>(frames.get()), static_cast<osg::Node*>(balls.get()), hud->node()})
    root->addChild(node);

  window = new osgViewer::GraphicsWindowEmbedded(0, 0, 64, 64);
  viewer.setThreadingModel(osgViewer::Viewer::SingleThreaded);
  viewer.setKeyEventSetsDone(0);
  viewer.setQuitEventSetsDone(false);
  viewer.setLightingMode(osg::View::NO_LIGHT);
  osg::Camera* main = viewer.getCamera();
  main->setGraphicsContext(window);
  main->setComputeNearFarMode(osg::Camera::DO_NOT_COMPUTE_NEAR_FAR);
  main->setCullingMode(osg::CullSettings::VIEW_FRUSTUM_CULLING);
  main->setCullMask(kVisible);
  main->setClearColor(osg::Vec4(0.5F, 0.5F, 0.5F, 1));
  viewer.setSceneData(root);
}

/// Lines in the look of the style; `is_hidden` = what faces hide, dashed.
osg::ref_ptr<osg::Geode> SceneView::Impl::line_geode(osg::Geometry* segments,
                                                     bool is_hidden) const {
  const bool is_drawn = is_drawing(look.style);
  auto geode = geode_of(segments, kVisible);
  osg::StateSet* t = geode->getOrCreateStateSet();
  t->setAttributeAndModes(edge_program);
  t->setAttributeAndModes(is_hidden ? mesh_width : is_drawn ? drawn_width : edge_width);
  t->setRenderBinDetails(kEdgeBin, "RenderBin");
  const float opacity = is_hidden ? 0.60F : is_drawn ? 1.0F : 0.50F;
  set_uniform(t, "edge_colour", osg::Vec4f(0.012F, 0.014F, 0.02F, opacity));
  blend(t, is_hidden ? osg::Depth::GREATER : osg::Depth::LEQUAL);
  if (is_hidden) set_uniform(t, "dash", 1.0F);  // its length is set when the camera is known
  return geode;
}

void SceneView::Impl::build_item(ItemNode& node) {
  const Item& item = node.item;
  osg::MatrixTransform* place = node.place.get();
  place->removeChildren(0, place->getNumChildren());
  node.glass_back = node.glass_front = node.glass_edges = nullptr;
  node.glass_sorted.reset();
  node.contours.clear();
  node.contours_seen.reset();
  if (!node.triangles) return;

  const bool is_lined = look.style == Style::hidden_line, is_wire = look.style == Style::wireframe;
  const bool is_glass = item.appearance.colour.a < kOpaque && !is_drawing(look.style);
  osg::StateSet* s = place->getOrCreateStateSet();
  const osg::Vec4f base = linear_of(item.appearance.colour);
  osg::Vec4f drawn = base;
  if (is_lined) drawn = item.selected ? osg::Vec4f(1.0F, 0.75F, 0.45F, 1) : osg::Vec4f(1, 1, 1, 1);
  // Dark enough for lines on white.
  if (is_wire) drawn = osg::Vec4f(0.55F * base.x(), 0.55F * base.y(), 0.55F * base.z(), 0.40F);
  set_uniform(s, "base", drawn);
  const float rough = 0.78F - 0.64F * std::clamp(item.appearance.shininess, 0.0F, 1.0F);
  set_uniform(s, "surface",
              osg::Vec4f(rough, std::clamp(item.appearance.metalness, 0.0F, 1.0F),
                         item.selected ? 1.0F : 0.0F, 0.0F));
  const Appearance& a = item.appearance;
  set_uniform(s, "shade", rgb_of(a.ambient.value_or(a.colour)));
  set_uniform(s, "highlight",
              a.specular ? osg::Vec4f(rgb_of(*a.specular), 1.0F) : osg::Vec4f(1, 1, 1, 0));
  set_uniform(s, "glow", rgb_of(a.emission));
  if (is_glass) {
    // The far sides before the near ones, so that both show.
    for (const bool is_front : {false, true}) {
      const auto geode = geode_of(node.triangles, kVisible | (is_front ? kGlassCaster : 0U));
      osg::StateSet* t = geode->getOrCreateStateSet();
      blend(t);
      t->setAttributeAndModes(
          new osg::CullFace(is_front ? osg::CullFace::BACK : osg::CullFace::FRONT));
      t->setRenderBinDetails(kGlassBin, "RenderBin");
      (is_front ? node.glass_front : node.glass_back) = geode;
      place->addChild(geode);
    }
  } else if (is_wire) {
    const auto geode = geode_of(node.triangles, kVisible);
    osg::StateSet* t = geode->getOrCreateStateSet();
    t->setAttributeAndModes(
        new osg::PolygonMode(osg::PolygonMode::FRONT_AND_BACK, osg::PolygonMode::LINE));
    t->setAttributeAndModes(mesh_width);
    blend(t);
    t->setRenderBinDetails(kEdgeBin - 1, "RenderBin");
    place->addChild(geode);
  } else {
    place->addChild(geode_of(node.triangles, kVisible | kCaster));
  }
  if (node.segments && look.feature_edges) {
    const auto geode = line_geode(node.segments, false);
    if (is_glass) {
      set_uniform(geode->getStateSet(), "edge_colour", osg::Vec4f(0.012F, 0.014F, 0.02F, 0.28F));
      node.glass_edges = geode;
    }
    place->addChild(geode);
    if (is_lined && look.hidden_edges) place->addChild(line_geode(node.segments, true));
  }
  if (is_lined) {
    if (node.mesh_edges.empty()) node.mesh_edges = edges_of(node.surface);
    const Segments soft = tangent_edges_of(node.surface, node.mesh_edges);
    if (look.feature_edges && !soft.ends.empty()) {
      const auto geode = line_geode(segments_of(soft.ends, soft.along), false);
      geode->getStateSet()->setAttributeAndModes(mesh_width);
      set_uniform(geode->getStateSet(), "edge_colour", osg::Vec4f(0.012F, 0.014F, 0.02F, 0.35F));
      place->addChild(geode);
    }
    for (const bool is_hidden : {false, true}) {
      if (is_hidden && !look.hidden_edges) continue;
      node.contours.push_back(line_geode(segments_of({}, {}), is_hidden));
      place->addChild(node.contours.back());
    }
  }
  if (item.selected && !is_glass && !is_drawing(look.style)) {  // the hull would show through glass
    if (!node.hull) node.hull = hull_of(node.surface);
    const auto geode = geode_of(node.hull, kVisible);
    osg::StateSet* t = geode->getOrCreateStateSet();
    t->setAttributeAndModes(outline_program);
    t->setAttributeAndModes(new osg::CullFace(osg::CullFace::FRONT));
    t->setRenderBinDetails(kOutlineBin, "RenderBin");
    place->addChild(geode);
  }
}

void SceneView::Impl::build_cut(ItemNode& node) {
  node.cut->removeChildren(0, node.cut->getNumChildren());
  node.cut_points.clear();
  node.cut_by = plane;
  node.cut_pose = node.item.pose;
  if (!plane || node.surface.triangles.empty()) return;
  Cut cut = cut_of(node.surface, node.item.pose, plane->point, plane->normal);
  if (!cut.triangles.empty() && look.style != Style::wireframe) {
    const auto face =
        geode_of(sheet_of(cut.positions, cut.triangles, plane->normal), kVisible | kCaster);
    osg::StateSet* s = face->getOrCreateStateSet();
    s->setAttributeAndModes(cut_program);
    const bool is_lined = look.style == Style::hidden_line;
    const osg::Vec3f colour = is_lined ? osg::Vec3f(1, 1, 1) : rgb_of(look.section->colour);
    const osg::Vec3f dark = is_lined ? osg::Vec3f(0.012F, 0.014F, 0.02F) : colour * 0.30F;
    set_uniform(s, "base", osg::Vec4f(colour, 1));
    const float strength = !look.section->hatch ? 0.0F : is_lined ? 0.9F : 0.6F;
    set_uniform(s, "hatch", osg::Vec4f(dark, strength));
    node.cut->addChild(face);
  }
  if (!cut.outline.ends.empty() && (look.feature_edges || is_drawing(look.style)))
    node.cut->addChild(line_geode(segments_of(cut.outline.ends, cut.outline.along), false));
  node.cut_points = std::move(cut.outline.ends);
}

/// Brings the cut faces to the section and the poses of now.
void SceneView::Impl::update_cuts() {
  for (auto& [id, node] : items) {
    const Pose& pose = node.item.pose;
    if (node.cut_by == plane &&
        (!plane || (node.cut_pose.R == pose.R && node.cut_pose.p == pose.p)))
      continue;
    build_cut(node);
  }
  if (!plane) return;
  // Neighbours are hatched in different directions; of cut faces that share a place the one of the
  // lower number wins.
  std::vector<std::pair<std::uint64_t, ItemNode*>> order;
  for (auto& [id, node] : items)
    if (node.cut->getNumChildren() > 0) order.emplace_back(id, &node);
  std::sort(order.begin(), order.end());
  for (std::size_t i = 0; i < order.size(); ++i) {
    osg::StateSet* s = order[i].second->cut->getOrCreateStateSet();
    s->setAttributeAndModes(new osg::PolygonOffset(0.0F, 2.0F * static_cast<float>(i)));
    const double spacing = kHatchSpacing * scale() * (1 + 0.25 * static_cast<double>(i / 2 % 3));
    const double side = std::sqrt(0.5) / spacing;
    set_uniform(
        s, "hatch_lines",
        osg::Vec2f(static_cast<float>(i % 2 == 0 ? side : -side), static_cast<float>(side)));
  }
}

/// Contours for the camera of now.
void SceneView::Impl::update_contours() {
  if (look.style != Style::hidden_line) return;
  const bool is_point = camera.perspective();
  for (auto& [id, node] : items) {
    if (node.contours.empty()) continue;
    const Seen now{camera.view(), node.item.pose, is_point};
    if (node.contours_seen && same(*node.contours_seen, now)) continue;
    node.contours_seen = now;
    const Vec3 eye = is_point ? rotate_back(node.item.pose, camera.eye() - node.item.pose.p)
                              : rotate_back(node.item.pose, camera.backward());
    const Segments contour = contour_of(node.surface, node.mesh_edges, eye, is_point);
    const auto geometry = segments_of(contour.ends, contour.along);
    for (const auto& geode : node.contours) {
      geode->removeDrawables(0, geode->getNumDrawables());
      geode->addDrawable(geometry);
    }
  }
}

/// Orders the triangles of a clear body from far to near.
void SceneView::Impl::sort_triangles(ItemNode& node) const {
  constexpr std::size_t kMostSorted = 300'000;
  const auto& t = node.surface.triangles;
  if (t.size() / 3 > kMostSorted) return;
  const Seen now{camera.view(), node.item.pose, camera.perspective()};
  if (node.glass_sorted && same(*node.glass_sorted, now)) return;
  node.glass_sorted = now;
  const Vec3 back = rotate_back(node.item.pose, camera.backward());
  const Vec3 eye = rotate_back(node.item.pose, camera.eye() - node.item.pose.p);
  std::vector<std::pair<double, std::uint32_t>> order;
  order.reserve(t.size() / 3);
  for (std::size_t i = 0; i + 2 < t.size(); i += 3) {
    Vec3 middle{};
    for (std::size_t k = 0; k < 3; ++k)
      for (std::size_t c = 0; c < 3; ++c)
        middle[c] += static_cast<double>(node.surface.positions[3 * std::size_t{t[i + k]} + c]) / 3;
    const double depth = camera.perspective() ? norm(eye - middle) : -dot(back, middle);
    order.emplace_back(-depth, static_cast<std::uint32_t>(i));
  }
  std::sort(order.begin(), order.end());
  auto* elements = static_cast<osg::DrawElementsUInt*>(node.triangles->getPrimitiveSet(0));
  std::size_t at = 0;
  for (const auto& [depth, first] : order)
    for (std::size_t k = 0; k < 3; ++k)
      (*elements)[static_cast<unsigned>(at++)] = t[std::size_t{first} + k];
  elements->dirty();
}

/// Clear bodies are drawn from far to near: the far sides of a body by its farthest place, the near
/// sides by its nearest, so that what stands in a glass comes between them.
void SceneView::Impl::sort_glass() {
  struct Layer {
    double depth;
    std::uint64_t id;
    osg::Geode* geode;
  };
  std::vector<Layer> layers;
  for (auto& [id, node] : items) {
    if (!node.glass_back) continue;
    if (is_still) sort_triangles(node);
    double near = std::numeric_limits<double>::infinity(), far = -near;
    for (const Vec3& p : corners(node.surface, node.item.pose)) {
      const double depth = -dot(camera.backward(), p);
      near = std::min(near, depth);
      far = std::max(far, depth);
    }
    layers.push_back({far, id, node.glass_back.get()});
    layers.push_back({near, id, node.glass_front.get()});
    if (node.glass_edges) layers.push_back({near, id, node.glass_edges.get()});
  }
  std::stable_sort(layers.begin(), layers.end(), [](const Layer& a, const Layer& b) {
    return a.depth != b.depth ? a.depth > b.depth : a.id < b.id;
  });
  for (std::size_t i = 0; i < layers.size(); ++i)
    layers[i].geode->getStateSet()->setRenderBinDetails(kGlassBin + static_cast<int>(i),
                                                        "RenderBin");
}

void SceneView::Impl::build_line(LineNode& node) {
  ++builds;
  const auto ribbon = ribbon_of(node.line.points);
  node.group->removeChildren(0, node.group->getNumChildren());
  osg::StateSet* s = node.group->getOrCreateStateSet();
  set_uniform(s, "base", linear_of(node.line.colour));
  set_uniform(s, "ribbon_width", node.line.width);
  for (const bool is_hidden : {false, true}) {
    const auto geode = geode_of(ribbon, kVisible);
    osg::StateSet* t = geode->getOrCreateStateSet();
    blend(t, is_hidden ? osg::Depth::GREATER : osg::Depth::LEQUAL);
    set_uniform(t, "veil", is_hidden ? 0.22F : 1.0F);
    t->setRenderBinDetails(is_hidden ? kVeilBin : kRibbonBin, "RenderBin");
    node.group->addChild(geode);
  }
}

void SceneView::Impl::sync_items(const Frame& frame) {
  for (const Item& item : frame.items) {
    auto [at, is_new] = items.try_emplace(item.id);
    ItemNode& node = at->second;
    const bool has_new_mesh = is_new || node.item.mesh != item.mesh;
    const bool has_new_look = has_new_mesh || !same(node.item.appearance, item.appearance) ||
                              node.item.selected != item.selected;
    node.item = item;
    node.is_seen = true;
    if (!is_finite(item.pose)) node.item.pose = Pose{};
    if (is_new) {
      node.place = new osg::MatrixTransform;
      node.place->setDataVariance(osg::Object::DYNAMIC);
      casters->addChild(node.place);
      node.cut = new osg::Group;
      cuts->addChild(node.cut);
    }
    if (has_new_mesh) {
      node.mesh_edges.clear();
      node.cut_by.reset();
      node.cut->removeChildren(0, node.cut->getNumChildren());
      node.cut_points.clear();
      ++builds;
      node.surface = item.mesh ? surface_of(*item.mesh) : Surface{};
      node.hull = nullptr;
      node.triangles = node.surface.triangles.empty() ? nullptr : triangles_of(node.surface);
      node.segments = node.surface.segments.empty()
                          ? nullptr
                          : segments_of(node.surface.segments, node.surface.along);
    }
    if (has_new_look) build_item(node);
    node.place->setMatrix(matrix_of(node.item.pose));
  }
  sweep(items, [&](ItemNode& node) {
    casters->removeChild(node.place);
    cuts->removeChild(node.cut);
  });
}

void SceneView::Impl::sync_lines(const Frame& frame) {
  for (const Line& line : frame.lines) {
    auto [at, is_new] = lines.try_emplace(line.id);
    LineNode& node = at->second;
    node.is_seen = true;
    if (is_new) {
      node.group = new osg::Group;
      ribbons->addChild(node.group);
    }
    if (!is_new && same(node.line, line)) continue;
    node.line = line;
    build_line(node);
  }
  sweep(lines, [&](LineNode& node) { ribbons->removeChild(node.group); });
}

void SceneView::Impl::sync_triads(const Frame& frame) {
  for (const Triad& triad : frame.triads) {
    auto [at, is_new] = triads.try_emplace(triad.id);
    TriadNode& node = at->second;
    node.is_seen = true;
    node.triad = triad;
    if (!is_finite(triad.pose)) node.triad.pose = Pose{};
    if (is_new) {
      node.place = new osg::MatrixTransform;
      node.place->setDataVariance(osg::Object::DYNAMIC);
      const auto axes = axes_of(0.026);
      axes->setNodeMask(kVisible);
      node.place->addChild(axes);
      frames->addChild(node.place);
    }
    // In the sliver of the depth range that the marks have too.
    osg::StateSet* s = node.place->getOrCreateStateSet();
    if (triad.on_top) {
      s->setAttributeAndModes(new osg::Depth(osg::Depth::LEQUAL, 0.001, 0.01, true));
      s->setRenderBinDetails(kMarkBin, "RenderBin");
      // What shines through a body is not in its shadow: maps that are outside everywhere.
      for (const char* map : {"lamp_map", "sky_map"}) set_uniform(s, map, nowhere());
    } else {
      for (const char* map : {"lamp_map", "sky_map"}) s->removeUniform(map);
      s->removeAttribute(osg::StateAttribute::DEPTH);
      s->setRenderBinToInherit();
    }
    const double l = std::isfinite(triad.length) ? std::max(triad.length, 1e-6) : 0.1;
    node.place->setMatrix(osg::Matrixd::scale(l, l, l) * matrix_of(node.triad.pose));
  }
  sweep(triads, [&](TriadNode& node) { frames->removeChild(node.place); });
}

void SceneView::Impl::sync_marks(const Frame& frame) {
  for (const MassMark& mark : frame.marks) {
    auto [at, is_new] = marks.try_emplace(mark.id);
    MarkNode& node = at->second;
    node.is_seen = true;
    node.mark = mark;
    if (!is_finite(mark.pose)) node.mark.pose = Pose{};
    if (is_new) {
      node.place = new osg::MatrixTransform;
      balls->addChild(node.place);
    }
    node.place->removeChildren(0, node.place->getNumChildren());
    node.place->setMatrix(matrix_of(node.mark.pose));
    node.ball = new osg::MatrixTransform;
    node.ball->addChild(geode_of(ball_of(1), kVisible));
    node.place->addChild(node.ball);
    for (std::size_t i = 0; i < 3; ++i) {
      double& k = node.mark.gyration[i];
      if (!std::isfinite(k) || k < 0) k = 0;
      Vec3 end{};
      end[i] = k;
      const std::array<Vec3, 2> line{-1.0 * end, end};
      const auto geode = geode_of(ribbon_of(line), kVisible);
      osg::StateSet* s = geode->getOrCreateStateSet();
      s->setAttributeAndModes(ribbon_program);
      s->setMode(GL_BLEND, osg::StateAttribute::ON);
      s->setAttributeAndModes(
          new osg::BlendFunc(osg::BlendFunc::SRC_ALPHA, osg::BlendFunc::ONE_MINUS_SRC_ALPHA,
                             osg::BlendFunc::ONE, osg::BlendFunc::ONE_MINUS_SRC_ALPHA));
      set_uniform(s, "base", linear_of(kPrincipalColours[i]));
      set_uniform(s, "ribbon_width", 3.2F);
      set_uniform(s, "veil", 1.0F);
      node.place->addChild(geode);
    }
  }
  sweep(marks, [&](MarkNode& node) { balls->removeChild(node.place); });
}

/// Keeps the balls at one size in pixels.
void SceneView::Impl::place_marks(double per_nominal) {
  for (auto& [id, node] : marks) {
    const double depth = dot(camera.eye() - node.mark.pose.p, camera.backward());
    const double share = camera.perspective() ? std::max(depth / camera.distance(), 1e-6) : 1.0;
    const double r = kBallRadius * per_nominal * camera.metres_per_pixel() * share;
    node.ball->setMatrix(osg::Matrixd::scale(r, r, r));
  }
}

/// Takes over style, section and background; what looks different is built again.
void SceneView::Impl::sync_look(const Frame& frame) {
  const bool has_new_style = look.style != frame.style ||
                             look.feature_edges != frame.feature_edges ||
                             look.hidden_edges != frame.hidden_edges;
  const bool has_new_section = has_new_style || !same(look.section, frame.section);
  look = frame;
  labels = frame.labels;
  lights = lamps_of(frame.lights);
  plane.reset();
  if (look.section) {
    const Section& section = *look.section;
    const double length = norm(section.normal);
    if (is_finite(section.point) && std::isfinite(length) && length > 0)
      plane = Plane{section.point, (1 / length) * section.normal};
  }
  osg::StateSet* c = casters->getOrCreateStateSet();
  const bool is_shaded = !is_drawing(look.style);
  c->setAttributeAndModes(look.style == Style::flat ? flat_program
                          : is_shaded               ? surface_program
                                                    : paper_program);
  c->setMode(kSectionMode, plane ? osg::StateAttribute::ON : osg::StateAttribute::OFF);
  if (has_new_style)
    for (auto& [id, node] : items) build_item(node);
  if (has_new_section)
    for (auto& [id, node] : items) {
      node.cut_by.reset();
      node.cut->removeChildren(0, node.cut->getNumChildren());
      node.cut_points.clear();
    }
  set_uniform(root->getStateSet(), "drawn", is_shaded ? 0.0F : 1.0F);
  const unsigned mask = has_studio(look) ? ~0U : 0U;
  ground->setNodeMask(mask);
  background->setNodeMask(mask & kVisible);
  const Colour& b = look.background_colour;
  const bool is_plain = look.background == Background::plain;
  viewer.getCamera()->setClearColor(is_still   ? osg::Vec4(0, 0, 0, 0)
                                    : is_plain ? osg::Vec4(b.r, b.g, b.b, 1)
                                               : osg::Vec4(1, 1, 1, 1));
}

/// Places of the items that a section leaves.
std::vector<Vec3> SceneView::Impl::points_of_bodies() const {
  std::vector<Vec3> points;
  const auto add = [&](const std::vector<float>& p, const Pose& pose, bool all) {
    for (std::size_t i = 0; i + 2 < p.size(); i += 3) {
      const Vec3 at = transform(pose, {p[i], p[i + 1], p[i + 2]});
      if ((all || is_kept(at)) && is_finite(at)) points.push_back(at);
    }
  };
  for (const auto& [id, node] : items) {
    if (node.surface.triangles.empty()) continue;
    add(node.surface.positions, node.item.pose, false);
    add(node.cut_points, Pose{}, true);
  }
  return points;
}

std::vector<Vec3> SceneView::Impl::points_shown() const {
  std::vector<Vec3> points = points_of_bodies();
  for (const auto& [id, node] : marks)
    for (std::size_t i = 0; i < 3; ++i)
      for (const double side : {-1.0, 1.0}) {
        Vec3 end{};
        end[i] = side * node.mark.gyration[i];
        points.push_back(transform(node.mark.pose, end));
      }
  for (const auto& label : labels)
    if (is_finite(label.place)) points.push_back(label.place);
  for (const auto& [id, node] : lines)
    for (const Vec3& p : node.line.points)
      if (is_finite(p)) points.push_back(p);
  for (const auto& [id, node] : triads) {
    const double l = node.triad.length;
    for (const Vec3& tip : {Vec3{0, 0, 0}, Vec3{l, 0, 0}, Vec3{0, l, 0}, Vec3{0, 0, l}})
      points.push_back(transform(node.triad.pose, tip));
  }
  return points;
}

/// Where moving items get to, at some times of the playback.
std::vector<Vec3> SceneView::Impl::points_moved() const {
  std::vector<Vec3> points;
  if (!playback || playback->times.empty()) return points;
  constexpr int kSamples = 24;
  for (int i = 0; i <= kSamples; ++i) {
    const auto poses =
        poses_at(*playback, playback->times.front() + duration(*playback) * i / kSamples);
    for (std::size_t k = 0; k < poses.size(); ++k) {
      const auto at = items.find(playback->ids[k]);
      if (at == items.end() || at->second.surface.triangles.empty()) continue;
      for (const Vec3& p : corners(at->second.surface, poses[k])) points.push_back(p);
    }
  }
  return points;
}

void SceneView::Impl::place_ground() {
  constexpr double kInf = std::numeric_limits<double>::infinity();
  Vec3 low{kInf, kInf, kInf}, high{-kInf, -kInf, -kInf};
  auto points = points_of_bodies();
  if (points.empty()) points = points_shown();
  for (const Vec3& p : points) {
    for (std::size_t i = 0; i < 3; ++i) {
      low[i] = std::min(low[i], p[i]);
      high[i] = std::max(high[i], p[i]);
    }
  }
  if (low[0] > high[0]) low = {-0.5, -0.5, 0}, high = {0.5, 0.5, 0.5};
  radius = std::clamp(0.5 * norm(high - low), 1e-4, 1e5);
  // Some drivers cut wherever a shader writes a distance, whether the mode is on or not: so the
  // plane is given to the items alone. It lies a hair behind the section, so that a face in it is
  // gone and shows its cut instead.
  osg::Vec4f kept(0, 0, 0, 1);
  if (plane) {
    const Vec3& n = plane->normal;
    kept = osg::Vec4f(vec_of(-1.0 * n), static_cast<float>(dot(n, plane->point) - 2e-6 * radius));
  }
  set_uniform(casters->getStateSet(), "section_plane", kept);
  // The floor lies at z = 0 or under whatever reaches lower; a hair below, so that a sheet lying on
  // it does not flicker.
  const double z = std::min(0.0, low[2]) - 2e-4 * radius;
  const Vec3 centre = 0.5 * (low + high);
  const double half = 60 * radius;
  ground->setMatrix(osg::Matrixd::scale(half, half, 1) *
                    osg::Matrixd::translate(centre[0], centre[1], z));
  osg::StateSet* s = ground->getStateSet();
  set_uniform(s, "ground",
              osg::Vec4f(static_cast<float>(centre[0]), static_cast<float>(centre[1]),
                         static_cast<float>(2.5 * radius), static_cast<float>(13 * radius)));
  const double step = std::pow(10.0, std::floor(std::log10(0.3 * radius)));
  osg::Vec4f grid = osg::Vec4f(static_cast<float>(step), static_cast<float>(10 * step), 1, 1);
  if (const osg::Uniform* old = s->getUniform("grid")) {
    osg::Vec4f was;
    old->get(was);
    grid.z() = was.z(), grid.w() = was.w();
  }
  set_uniform(s, "grid", grid);
}

void SceneView::Impl::apply_camera(const Camera& wanted) {
  if (frame_camera == wanted) return;
  frame_camera = wanted;
  frame_zoom = std::isfinite(wanted.zoom) && wanted.zoom > 0 ? wanted.zoom : 1.0;
  camera.set_perspective(wanted.perspective);
  if (wanted.view == Camera::View::custom && wanted.eye && wanted.target) {
    camera.look_from(*wanted.eye, *wanted.target);
    camera.zoom_at(0.5 * camera.width(), 0.5 * camera.height(), frame_zoom);
    is_fitted = false;
    return;
  }
  const bool is_isometric =
      wanted.view == Camera::View::custom || wanted.view == Camera::View::isometric;
  camera.look(is_isometric ? Camera::View::isometric : wanted.view);
  // In parallel projection the direction in which all three axes are equally short.
  if (is_isometric && !wanted.perspective)
    camera.look_from(camera.target() + camera.distance() * unit(Vec3{1, -1, 1}), camera.target());
  fit();
}

void SceneView::Impl::fit() {
  auto points = points_shown();
  for (const Vec3& p : points_moved()) points.push_back(p);
  if (points.empty()) points = {{-0.5, -0.5, 0}, {0.5, 0.5, 0.5}};
  camera.fit(points);
  camera.zoom_at(0.5 * camera.width(), 0.5 * camera.height(), frame_zoom);
  fitted = camera;
  is_fitted = true;
}

void SceneView::Impl::refit_if_untouched() {
  if (!is_fitted) return;
  // Compare all but the size of the picture.
  OrbitCamera was = fitted;
  was.set_viewport(camera.width(), camera.height());
  if (was == camera && !(fitted == camera)) fit();
}

void SceneView::Impl::apply_time() {
  if (!playback || !time) return;
  const auto poses = poses_at(*playback, *time);
  for (std::size_t k = 0; k < poses.size(); ++k) {
    const std::uint64_t id = playback->ids[k];
    if (const auto at = items.find(id); at != items.end()) {
      at->second.item.pose = poses[k];
      at->second.place->setMatrix(matrix_of(poses[k]));
    }
    if (const auto at = triads.find(id); at != triads.end()) {
      const double l = at->second.triad.length;
      at->second.triad.pose = poses[k];
      at->second.place->setMatrix(osg::Matrixd::scale(l, l, l) * matrix_of(poses[k]));
    }
  }
}

/// The lights of the frame that a pass is lit by, the one with a shadow first. The passes of a
/// still take turns: each has one light, as much brighter as there are passes without it, so that
/// the mean has all with their shadows. A window has them all at once.
std::vector<Lamp> SceneView::Impl::lights_of(const Pass& pass) const {
  if (!is_still) return lights;
  const auto n = static_cast<int>(lights.size());
  const int k = pass.number % n, count = std::max(pass.count, n);
  Lamp one = moved(lights[static_cast<std::size_t>(k)], camera.target(), pass.lamp);
  const int turns = count / n + (k < count % n ? 1 : 0);
  for (float& c : one.colour) c *= static_cast<float>(count) / static_cast<float>(turns);
  return {one};
}

void SceneView::Impl::aim_lights(const Pass& pass) {
  if (is_drawing(look.style)) {
    // Frames and marks are lit from the eye; nothing casts shadows.
    osg::StateSet* state = root->getStateSet();
    for (const char* map : {"lamp_map", "sky_map"}) set_uniform(state, map, nowhere());
    set_uniform(state, "sky_direction", vec_of(camera.backward()));
    const Lamp lamp_at_eye = own_lamp(camera.backward());
    set_lamps(state, {&lamp_at_eye, 1}, 1);
    set_lamps(frames->getOrCreateStateSet(), {&lamp_at_eye, 1}, 1);
    set_uniform(state, "lamp_texel", osg::Vec2f(0, 0));
    set_uniform(state, "sky_texel", osg::Vec2f(0, 0));
    set_uniform(state, "pass_number", static_cast<float>(pass.number));
    lamp.set_mask(0);
    sky.set_mask(0);
    return;
  }
  std::vector<Vec3> opaque, all;
  for (const auto& [id, node] : items) {
    if (node.surface.triangles.empty()) continue;
    const bool is_glass = node.item.appearance.colour.a < kOpaque;
    for (const Vec3& p : corners(node.surface, node.item.pose)) {
      all.push_back(p);
      if (!is_glass) opaque.push_back(p);
    }
  }
  // Glass of opacity a casts its shadow in a share a of the passes: on average a shadow of depth a.
  for (auto& [id, node] : items) {
    if (!node.glass_front) continue;
    const bool casts = static_cast<double>(node.item.appearance.colour.a) > pass.glass_shadow;
    node.glass_front->setNodeMask(kVisible | (casts ? kGlassCaster : 0U));
  }
  const unsigned mask = kCaster | kGlassCaster;
  osg::StateSet* s = root->getStateSet();
  const Lamp own = moved(own_lamp(unit(kLamp)), {}, pass.lamp);
  std::vector<Lamp> shining{own};
  if (!lights.empty()) shining = lights_of(pass);
  const double share = lights.empty() ? 1 : kSurroundings;
  set_lamps(s, shining, share);
  // The floor is its own colour under the lamp of the renderer.
  set_uniform(s, "floor_lamp", static_cast<float>(lights.empty() ? own.place[2] : unit(kLamp)[2]));
  // Frames keep their colours: no light of the scene tints them.
  osg::StateSet* f = frames->getOrCreateStateSet();
  set_lamps(f, {&own, 1}, 1);
  if (lights.empty()) f->removeUniform("lamp_map");
  else set_uniform(f, "lamp_map", nowhere());
  lamp.set_mask(mask);
  const ShadowLookup l = shining[0].is_parallel ? lamp.aim(shining[0].place, all)
                                                : lamp.aim_from(shining[0].place, shining[0].axis,
                                                                shining[0].half_angle, all);
  set_uniform(s, "lamp_map", osg::Matrixf(l.map_T_world));
  set_uniform(s, "lamp_texel", l.texel);
  set_uniform(s, "pass_number", static_cast<float>(pass.number));
  const Vec3 zenith{0, 0, 1};
  sky.set_mask(pass.sky ? mask : 0);
  const ShadowLookup k = sky.aim(pass.sky.value_or(zenith), all);
  set_uniform(s, "sky_direction", vec_of(pass.sky.value_or(zenith)));
  set_uniform(s, "sky_map", osg::Matrixf(k.map_T_world));
  set_uniform(s, "sky_texel", k.texel);
}

void SceneView::Impl::place_camera(const Pass& pass) {
  osg::Camera* main = viewer.getCamera();
  main->setViewport(0, 0, camera.width(), camera.height());
  window->resized(0, 0, camera.width(), camera.height());
  const double d = camera.distance();
  const double reach = norm(camera.target()) + radius;
  const bool is_flat = !camera.perspective();
  const double far = d + 4 * reach + 90 * radius, near = is_flat ? -far : std::max(0.02 * d, 1e-5);
  const osg::Matrixd view = matrix_of(camera.view());
  main->setViewMatrix(view);
  main->setProjectionMatrix(matrix_of(camera.projection(near, far, pass.shift_x, pass.shift_y)));

  osg::StateSet* s = root->getStateSet();
  set_uniform(s, "world_T_view", osg::Matrixf(osg::Matrixd::inverse(view)));
  const Vec3 eye = is_flat ? camera.backward() : camera.eye();
  set_uniform(s, "eye", osg::Vec4f(vec_of(eye), is_flat ? 0.0F : 1.0F));
  // Seen from above the floor hides what is behind it; from below it is a grid to look through.
  const double floor = ground->getMatrix().getTrans().z();
  const bool is_below = is_flat ? eye[2] < 0 : eye[2] < floor;
  osg::StateSet* g = ground->getStateSet();
  g->setRenderBinDetails(is_below ? kGroundFromBelowBin : kGroundBin, "RenderBin");
  blend(g);
  if (!is_below) {
    g->setMode(GL_BLEND, osg::StateAttribute::OFF);
    g->setAttributeAndModes(new osg::Depth(osg::Depth::LESS, 0, 1, true));
  }
  set_uniform(s, "viewport",
              osg::Vec2f(static_cast<float>(camera.width()), static_cast<float>(camera.height())));
  const double per_nominal = scale();
  set_uniform(s, "line_scale", static_cast<float>(per_nominal));
  edge_width->setWidth(static_cast<float>(kEdgeWidth * per_nominal));
  drawn_width->setWidth(static_cast<float>(kDrawnWidth * per_nominal));
  mesh_width->setWidth(static_cast<float>(kMeshWidth * per_nominal));
  for (auto& [id, node] : items)
    for (unsigned i = 0; i < node.place->getNumChildren(); ++i)
      if (osg::StateSet* t = node.place->getChild(i)->getStateSet(); t && t->getUniform("dash"))
        set_uniform(t, "dash",
                    static_cast<float>(kDashPeriod * per_nominal * camera.metres_per_pixel()));
  place_marks(per_nominal);
  sort_glass();
  const double k = camera.tan_half_height();
  set_uniform(s, "ray_centre", vec_of(-1.0 * camera.backward()));
  set_uniform(s, "ray_right", vec_of((k * camera.aspect()) * camera.right()));
  set_uniform(s, "ray_up", vec_of(k * camera.up()));

  std::vector<Hud::Label> texts;
  for (const auto& [id, node] : triads)
    if (!node.triad.label.empty()) texts.push_back({node.triad.pose.p, node.triad.label});
  for (const auto& [id, node] : marks)
    if (!node.mark.label.empty()) texts.push_back({node.mark.pose.p, node.mark.label});
  for (const auto& label : labels)
    if (is_finite(label.place)) texts.push_back({label.place, label.text});
  hud->place(camera, texts, per_nominal, pass.shift_x, pass.shift_y,
             is_still && !is_drawing(look.style));
}

/// Done at each draw, when context and size are known; does something at the first and after a
/// change of size.
void SceneView::Impl::prepare() {
  if (is_still && (!memory || memory->s() != camera.width() || memory->t() != camera.height())) {
    memory = new osg::Image;
    memory->allocateImage(camera.width(), camera.height(), 1, GL_RGBA, GL_FLOAT);
    memory->setInternalTextureFormat(GL_RGBA16F_ARB);
    osg::Camera* main = viewer.getCamera();
    main->setRenderTargetImplementation(osg::Camera::FRAME_BUFFER_OBJECT);
    main->detach(osg::Camera::COLOR_BUFFER);
    main->detach(osg::Camera::DEPTH_BUFFER);
    main->attach(osg::Camera::COLOR_BUFFER, memory.get());
    main->attach(osg::Camera::DEPTH_BUFFER, GL_DEPTH_COMPONENT24);
    main->dirtyAttachmentMap();
  }
  // Not viewer.isRealized(): an embedded window always claims to be.
  if (!std::exchange(is_prepared, true)) viewer.realize();
}

SceneView::SceneView(Quality quality, Target target)
    : impl_(std::make_unique<Impl>(quality, target)) {}
SceneView::~SceneView() = default;

void SceneView::sync(const Frame& frame) {
  impl_->sync_look(frame);
  impl_->sync_items(frame);
  impl_->sync_lines(frame);
  impl_->sync_triads(frame);
  impl_->sync_marks(frame);
  impl_->update_cuts();
  osg::StateSet* s = impl_->ground->getOrCreateStateSet();
  impl_->place_ground();
  osg::Vec4f grid;
  s->getUniform("grid")->get(grid);
  grid.z() = frame.grid ? 1.0F : 0.0F;
  grid.w() = frame.world_axes ? 1.0F : 0.0F;
  set_uniform(s, "grid", grid);
  impl_->hud->show_axes(frame.world_axes);
  impl_->hud->set_caption(frame.caption);
  impl_->hud->set_legends(frame.legends);
  impl_->apply_camera(frame.camera);
  impl_->apply_time();
}

void SceneView::set_playback(std::shared_ptr<const Playback> playback) {
  const bool is_usable = playback && check(*playback).ok();
  impl_->playback = is_usable ? std::move(playback) : nullptr;
  if (impl_->is_fitted && impl_->fitted == impl_->camera) impl_->fit();
}

void SceneView::set_time(double time) {
  if (!std::isfinite(time)) return;
  impl_->time = time;
  impl_->apply_time();
}

void SceneView::select(const std::vector<std::uint64_t>& ids) {
  for (auto& [id, node] : impl_->items) {
    const bool wanted = std::find(ids.begin(), ids.end(), id) != ids.end();
    if (std::exchange(node.item.selected, wanted) != wanted) impl_->build_item(node);
  }
}

void SceneView::forget_camera() { impl_->frame_camera.reset(); }

OrbitCamera& SceneView::camera() { return impl_->camera; }
const OrbitCamera& SceneView::camera() const { return impl_->camera; }

void SceneView::resize(int width, int height) {
  impl_->camera.set_viewport(width, height);
  impl_->refit_if_untouched();
}

void SceneView::fit() {
  impl_->frame_zoom = 1;
  impl_->fit();
}

void SceneView::look(Camera::View view) {
  impl_->camera.look(view);
  fit();
}

std::optional<Pick> SceneView::pick(double x_px, double y_px) const {
  const Ray ray = impl_->camera.ray(x_px, y_px);
  std::optional<Pick> nearest;
  for (const auto& [id, node] : impl_->items) {
    const Pose& pose = node.item.pose;
    const auto hit = first_hit(node.surface, rotate_back(pose, ray.origin - pose.p),
                               rotate_back(pose, ray.direction));
    if (!hit || (nearest && *hit >= nearest->distance)) continue;
    nearest = Pick{id, node.item.name, ray.origin + *hit * ray.direction, *hit};
  }
  return nearest;
}

void SceneView::set_framebuffer(unsigned id) { impl_->window->setDefaultFboId(id); }

void SceneView::draw(const Pass& pass) {
  if (impl_->is_released) return;
  impl_->prepare();
  impl_->update_cuts();
  impl_->update_contours();
  impl_->aim_lights(pass);
  impl_->place_camera(pass);
  impl_->viewer.advance();
  impl_->viewer.updateTraversal();
  impl_->viewer.renderingTraversals();
  if (!impl_->is_still) return;
  const std::size_t count = 4 * static_cast<std::size_t>(impl_->memory->s()) *
                            static_cast<std::size_t>(impl_->memory->t());
  impl_->pixels.resize(count);
  std::memcpy(impl_->pixels.data(), impl_->memory->data(), count * sizeof(float));
}

const std::vector<float>& SceneView::pixels() const { return impl_->pixels; }

void SceneView::release() {
  if (std::exchange(impl_->is_released, true)) return;
  impl_->viewer.setSceneData(nullptr);
  if (osg::State* state = impl_->window->getState()) {
    impl_->root->releaseGLObjects(state);
    impl_->viewer.getCamera()->releaseGLObjects(state);
    osg::flushAllDeletedGLObjects(state->getContextID());
  }
}

const render::Look& SceneView::look() const { return impl_->look; }

std::size_t SceneView::light_count() const { return impl_->lights.size(); }

std::size_t SceneView::geometry_builds() const { return impl_->builds; }

std::array<Vec3, 2> SceneView::bounds() const {
  constexpr double kInf = std::numeric_limits<double>::infinity();
  std::array<Vec3, 2> box{Vec3{kInf, kInf, kInf}, Vec3{-kInf, -kInf, -kInf}};
  for (const Vec3& p : impl_->points_shown()) {
    for (std::size_t i = 0; i < 3; ++i) {
      box[0][i] = std::min(box[0][i], p[i]);
      box[1][i] = std::max(box[1][i], p[i]);
    }
  }
  return box[0][0] <= box[1][0] ? box : std::array<Vec3, 2>{};
}

}  // namespace robomosp::viewer
