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
#include <osg/PolygonOffset>
#include <osgViewer/GraphicsWindow>
#include <osgViewer/Viewer>

#include "viewer/scene/hud.h"
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
constexpr int kEdgeBin = 1, kOutlineBin = 2, kGroundBin = 3, kBackgroundBin = 4,
              kGroundFromBelowBin = 5, kRibbonBin = 6, kVeilBin = 7, kGlassBackBin = 10,
              kGlassFrontBin = 11, kGlassEdgeBin = 12, kHudBin = 20;

// Towards the lamp: above the left shoulder of whoever takes the isometric view.
constexpr Vec3 kLamp{-0.20, -0.80, 1.02};
// Angular radius of the lamp [rad]; larger than the sun's, as a softbox in a studio.
constexpr double kLampRadius = 0.042;
constexpr float kOpaque = 0.999F;

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

/// Sets a uniform of a state set, making it if it is new.
template <class T>
void set_uniform(osg::StateSet* state, const char* name, const T& value) {
  if (osg::Uniform* u = state->getUniform(name)) u->set(value);
  else state->addUniform(new osg::Uniform(name, value));
}

void blend(osg::StateSet* state, osg::Depth::Function function = osg::Depth::LESS) {
  state->setMode(GL_BLEND, osg::StateAttribute::ON);
  state->setAttributeAndModes(
      new osg::BlendFunc(osg::BlendFunc::SRC_ALPHA, osg::BlendFunc::ONE_MINUS_SRC_ALPHA));
  state->setAttributeAndModes(new osg::Depth(function, 0, 1, false));
}

osg::ref_ptr<osg::Geode> geode_of(osg::Geometry* geometry, unsigned mask) {
  osg::ref_ptr<osg::Geode> geode = new osg::Geode;
  geode->addDrawable(geometry);
  geode->setNodeMask(mask);
  return geode;
}

struct ItemNode {
  Item item;
  Surface surface;
  osg::ref_ptr<osg::MatrixTransform> place;
  osg::ref_ptr<osg::Geometry> triangles, segments, hull;
  bool is_seen = true;
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

bool same(const Colour& a, const Colour& b) {
  return a.r == b.r && a.g == b.g && a.b == b.b && a.a == b.a;
}

bool same(const Appearance& a, const Appearance& b) {
  return same(a.colour, b.colour) && a.shininess == b.shininess && a.metalness == b.metalness;
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
  void place_ground();
  void apply_camera(const Camera& wanted);
  void apply_time();
  void fit();
  void refit_if_untouched();
  [[nodiscard]] std::vector<Vec3> points_shown() const;
  [[nodiscard]] std::vector<Vec3> points_moved() const;
  void aim_lights(const Pass& pass);
  void place_camera(const Pass& pass);
  void prepare();

  bool is_still;
  OrbitCamera camera, fitted;
  std::optional<Camera> frame_camera;
  double frame_zoom = 1;
  bool is_fitted = false, has_edges = true;
  std::size_t builds = 0;
  std::unordered_map<std::uint64_t, ItemNode> items;
  std::unordered_map<std::uint64_t, LineNode> lines;
  std::unordered_map<std::uint64_t, TriadNode> triads;
  std::shared_ptr<const Playback> playback;
  std::optional<double> time;
  double radius = 1;  // half the diagonal of the box around the frame [m]

  osg::ref_ptr<osg::Group> casters = new osg::Group;
  ShadowMap lamp, sky;
  osg::ref_ptr<osg::Group> root = new osg::Group, ribbons = new osg::Group, frames = new osg::Group;
  osg::ref_ptr<osg::MatrixTransform> ground = new osg::MatrixTransform;
  osg::ref_ptr<osg::Geode> background;
  osg::ref_ptr<osg::Program> surface_program, edge_program, outline_program;
  osg::ref_ptr<osg::LineWidth> edge_width = new osg::LineWidth(1.0F);
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

  osg::StateSet* s = root->getOrCreateStateSet();
  // An alpha below one in a window's framebuffer would let what is behind the window shine through.
  s->setAttribute(new osg::ColorMask(true, true, true, false));
  s->setTextureAttribute(kLampUnit, lamp.texture());
  s->setTextureAttribute(kSkyUnit, sky.texture());
  set_uniform(s, "lamp_shadow", kLampUnit);
  set_uniform(s, "sky_shadow", kSkyUnit);

  osg::StateSet* c = casters->getOrCreateStateSet();
  c->setAttributeAndModes(surface_program);
  c->setAttributeAndModes(new osg::PolygonOffset(1.0F, 1.0F));

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

  ribbons->getOrCreateStateSet()->setAttributeAndModes(
      program_of(ribbon_shader(variant), "ribbon"));
  frames->getOrCreateStateSet()->setAttributeAndModes(surface_program);
  frames->getOrCreateStateSet()->setMode(GL_NORMALIZE, osg::StateAttribute::ON);
  hud = std::make_unique<Hud>(surface_program.get(), kHudBin, kVisible);

  root->addChild(lamp.camera());
  root->addChild(sky.camera());
  for (osg::Node* node :
       {static_cast<osg::Node*>(background.get()), static_cast<osg::Node*>(casters.get()),
        static_cast<osg::Node*>(ground.get()), static_cast<osg::Node*>(ribbons.get()),
        static_cast<osg::Node*>(frames.get()), hud->node()})
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

void SceneView::Impl::build_item(ItemNode& node) {
  const Item& item = node.item;
  osg::MatrixTransform* place = node.place.get();
  place->removeChildren(0, place->getNumChildren());
  if (!node.triangles) return;

  const bool is_glass = item.appearance.colour.a < kOpaque;
  osg::StateSet* s = place->getOrCreateStateSet();
  set_uniform(s, "base", linear_of(item.appearance.colour));
  const float rough = 0.78F - 0.64F * std::clamp(item.appearance.shininess, 0.0F, 1.0F);
  set_uniform(s, "surface",
              osg::Vec4f(rough, std::clamp(item.appearance.metalness, 0.0F, 1.0F),
                         item.selected ? 1.0F : 0.0F, 0.0F));
  if (is_glass) {
    // The far sides before the near ones, so that both show.
    for (const bool is_front : {false, true}) {
      const auto geode = geode_of(node.triangles, kVisible | (is_front ? kGlassCaster : 0U));
      osg::StateSet* t = geode->getOrCreateStateSet();
      blend(t);
      t->setAttributeAndModes(
          new osg::CullFace(is_front ? osg::CullFace::BACK : osg::CullFace::FRONT));
      t->setRenderBinDetails(is_front ? kGlassFrontBin : kGlassBackBin, "DepthSortedBin");
      place->addChild(geode);
    }
  } else {
    place->addChild(geode_of(node.triangles, kVisible | kCaster));
  }
  if (node.segments && has_edges) {
    const auto geode = geode_of(node.segments, kVisible);
    osg::StateSet* t = geode->getOrCreateStateSet();
    t->setAttributeAndModes(edge_program);
    t->setAttributeAndModes(edge_width);
    t->setRenderBinDetails(is_glass ? kGlassEdgeBin : kEdgeBin, "RenderBin");
    set_uniform(t, "edge_colour", osg::Vec4f(0.012F, 0.014F, 0.02F, is_glass ? 0.28F : 0.50F));
    blend(t, osg::Depth::LEQUAL);
    place->addChild(geode);
  }
  if (item.selected && !is_glass) {  // the hull would show through glass
    if (!node.hull) node.hull = hull_of(node.surface);
    const auto geode = geode_of(node.hull, kVisible);
    osg::StateSet* t = geode->getOrCreateStateSet();
    t->setAttributeAndModes(outline_program);
    t->setAttributeAndModes(new osg::CullFace(osg::CullFace::FRONT));
    t->setRenderBinDetails(kOutlineBin, "RenderBin");
    place->addChild(geode);
  }
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
  const bool edges_changed = std::exchange(has_edges, frame.feature_edges) != frame.feature_edges;
  for (const Item& item : frame.items) {
    auto [at, is_new] = items.try_emplace(item.id);
    ItemNode& node = at->second;
    const bool has_new_mesh = is_new || node.item.mesh != item.mesh;
    const bool has_new_look = has_new_mesh || edges_changed ||
                              !same(node.item.appearance, item.appearance) ||
                              node.item.selected != item.selected;
    node.item = item;
    node.is_seen = true;
    if (!is_finite(item.pose)) node.item.pose = Pose{};
    if (is_new) {
      node.place = new osg::MatrixTransform;
      node.place->setDataVariance(osg::Object::DYNAMIC);
      casters->addChild(node.place);
    }
    if (has_new_mesh) {
      ++builds;
      node.surface = item.mesh ? surface_of(*item.mesh) : Surface{};
      node.hull = nullptr;
      node.triangles = node.surface.triangles.empty() ? nullptr : triangles_of(node.surface);
      node.segments = node.surface.segments.empty() ? nullptr : segments_of(node.surface);
    }
    if (has_new_look) build_item(node);
    node.place->setMatrix(matrix_of(node.item.pose));
  }
  sweep(items, [&](ItemNode& node) { casters->removeChild(node.place); });
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
    const double l = std::isfinite(triad.length) ? std::max(triad.length, 1e-6) : 0.1;
    node.place->setMatrix(osg::Matrixd::scale(l, l, l) * matrix_of(node.triad.pose));
  }
  sweep(triads, [&](TriadNode& node) { frames->removeChild(node.place); });
}

std::vector<Vec3> SceneView::Impl::points_shown() const {
  std::vector<Vec3> points;
  for (const auto& [id, node] : items) {
    if (node.surface.triangles.empty()) continue;
    for (const Vec3& p : corners(node.surface, node.item.pose)) points.push_back(p);
  }
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
  for (const Vec3& p : points_shown()) {
    for (std::size_t i = 0; i < 3; ++i) {
      low[i] = std::min(low[i], p[i]);
      high[i] = std::max(high[i], p[i]);
    }
  }
  if (low[0] > high[0]) low = {-0.5, -0.5, 0}, high = {0.5, 0.5, 0.5};
  radius = std::clamp(0.5 * norm(high - low), 1e-4, 1e5);
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
  camera.look(wanted.view == Camera::View::custom ? Camera::View::isometric : wanted.view);
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

void SceneView::Impl::aim_lights(const Pass& pass) {
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
    const float a = node.item.appearance.colour.a;
    if (a >= kOpaque || node.place->getNumChildren() < 2) continue;
    const bool casts = static_cast<double>(a) > pass.glass_shadow;
    node.place->getChild(1)->setNodeMask(kVisible | (casts ? kGlassCaster : 0U));
  }
  const unsigned mask = kCaster | kGlassCaster;
  osg::StateSet* s = root->getStateSet();
  const Vec3 middle = unit(kLamp);
  const Vec3 side = unit(cross(middle, {0, 0, 1})), across = cross(side, middle);
  const Vec3 direction =
      unit(middle + (kLampRadius * pass.lamp[0]) * side + (kLampRadius * pass.lamp[1]) * across);
  lamp.set_mask(mask);
  const ShadowLookup l = lamp.aim(direction, all);
  set_uniform(s, "lamp_direction", vec_of(direction));
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
  const double scale = std::max(camera.height() / 800.0, 0.6);
  set_uniform(s, "line_scale", static_cast<float>(scale));
  edge_width->setWidth(static_cast<float>(1.15 * scale));
  const double k = camera.tan_half_height();
  set_uniform(s, "ray_centre", vec_of(-1.0 * camera.backward()));
  set_uniform(s, "ray_right", vec_of((k * camera.aspect()) * camera.right()));
  set_uniform(s, "ray_up", vec_of(k * camera.up()));

  std::vector<Hud::Label> labels;
  for (const auto& [id, node] : triads)
    if (!node.triad.label.empty()) labels.push_back({node.triad.pose.p, node.triad.label});
  hud->place(camera, labels, scale, pass.shift_x, pass.shift_y, is_still);
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
  impl_->sync_items(frame);
  impl_->sync_lines(frame);
  impl_->sync_triads(frame);
  osg::StateSet* s = impl_->ground->getOrCreateStateSet();
  impl_->place_ground();
  osg::Vec4f grid;
  s->getUniform("grid")->get(grid);
  grid.z() = frame.grid ? 1.0F : 0.0F;
  grid.w() = frame.world_axes ? 1.0F : 0.0F;
  set_uniform(s, "grid", grid);
  impl_->hud->show_axes(frame.world_axes);
  impl_->hud->set_caption(frame.caption);
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
