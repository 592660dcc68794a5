// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/scene/scene_view_impl.h"

namespace robomosp::viewer {
namespace {

constexpr Colour kOrange{1.0F, 0.61F, 0.15F, 1};

}  // namespace

SceneView::Impl::Impl(Quality quality, Target target)
    : is_still(target == Target::memory),
      has_two_samples(is_still && quality == Quality::quality),
      lamp(quality == Quality::quality && !is_still ? 2048 : 1024, casters.get(), kCaster),
      sky(512, casters.get(), 0),
      lamp_2(1024, casters.get(), 0),
      sky_2(512, casters.get(), 0),
      is_quality(quality == Quality::quality) {
  [[maybe_unused]] static const bool is_known = [] {
    osgUtil::RenderBin::addRenderBinPrototype(
        kNearestFirst, new osgUtil::RenderBin(osgUtil::RenderBin::SORT_FRONT_TO_BACK));
    return true;
  }();
  const ShaderVariant variant{.is_quality = is_quality, .is_still = is_still};
  surface_program = program_of(surface_shader(variant), "surface");
  edge_program = program_of(edge_shader(variant), "edge");
  outline_program = program_of(outline_shader(variant), "outline");
  // Compiled when first drawn.
  mask_program = program_of(caster_shader(), "mask");
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
  if (has_two_samples) {
    s->setTextureAttribute(kLampUnit2, lamp_2.texture());
    s->setTextureAttribute(kSkyUnit2, sky_2.texture());
    set_uniform(s, "lamp_shadow_2", kLampUnit2);
    set_uniform(s, "sky_shadow_2", kSkyUnit2);
    root->addChild(lamp_2.camera());
    root->addChild(sky_2.camera());
  }
  set_uniform(s, "highlight", osg::Vec4f(1, 1, 1, 0));
  set_uniform(s, "glow", osg::Vec3f(0, 0, 0));
  set_uniform(s, "section_plane", osg::Vec4f(0, 0, 0, 1));
  set_uniform(s, "dash", 0.0F);
  set_uniform(s, "drawn", 0.0F);
  set_uniform(s, "dark", 0.0F);
  set_uniform(s, "origin", osg::Vec2f(0, 0));
  set_uniform(s, "accent", linear_of(kOrange));

  osg::StateSet* c = casters->getOrCreateStateSet();
  c->setAttributeAndModes(lit_programs().surface);
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
  g->setAttributeAndModes(lit_programs().ground);

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
  main->setClearMask(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT | GL_STENCIL_BUFFER_BIT);
  viewer.setSceneData(root);
}

/// Those for the lamps that light the present frame.
const SceneView::Impl::LitPrograms& SceneView::Impl::lit_programs() {
  const bool has_own_lamp = !is_still && (lights.empty() || is_drawing(look.style));
  const int lamps =
      is_still || has_own_lamp ? 1 : static_cast<int>(std::min(lights.size(), kMostLamps));
  LitPrograms& out = lit[has_own_lamp ? 0 : lamps];
  if (out.surface) return out;
  ShaderVariant variant{
      .is_quality = is_quality, .is_still = is_still, .lamps = lamps, .has_own_lamp = has_own_lamp};
  out.surface = program_of(surface_shader(variant), "surface");
  out.ground = program_of(ground_shader(variant), "ground");
  variant.is_flat = true;
  out.flat = program_of(surface_shader(variant), "flat");
  return out;
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
  surroundings = surroundings_of(frame.lights);
  plane.reset();
  if (look.section) {
    const Section& section = *look.section;
    const double length = norm(section.normal);
    if (is_finite(section.point) && std::isfinite(length) && length > 0)
      plane = Plane{section.point, (1 / length) * section.normal};
  }
  osg::StateSet* c = casters->getOrCreateStateSet();
  const bool is_shaded = !is_drawing(look.style);
  const LitPrograms& programs = lit_programs();
  c->setAttributeAndModes(look.style == Style::flat ? programs.flat
                          : is_shaded               ? programs.surface
                                                    : paper_program);
  ground->getOrCreateStateSet()->setAttributeAndModes(programs.ground);
  if (plane) c->setMode(GL_CULL_FACE, osg::StateAttribute::OFF | osg::StateAttribute::OVERRIDE);
  else c->removeMode(GL_CULL_FACE);
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
  show_darkness();
  const unsigned mask = has_studio(look) ? ~0U : 0U;
  ground->setNodeMask(mask);
  background->setNodeMask(mask & kVisible);
  const Colour& b = look.background_colour;
  const bool is_plain = look.background == Background::plain;
  viewer.getCamera()->setClearColor(is_still   ? osg::Vec4(0, 0, 0, 0)
                                    : is_plain ? osg::Vec4(b.r, b.g, b.b, 1)
                                               : osg::Vec4(1, 1, 1, 1));
}

void SceneView::Impl::show_darkness() {
  const bool is_on = (is_dark || asks_for_darkness(look)) && has_studio(look);
  set_uniform(root->getStateSet(), "dark", is_on ? 1.0F : 0.0F);
  hud->set_dark(is_on);
}

void SceneView::Impl::apply_time() {
  if (!playback || !time) return;
  has_new_casters = true;
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
    main->detach(osg::Camera::PACKED_DEPTH_STENCIL_BUFFER);
    main->attach(osg::Camera::COLOR_BUFFER, memory.get());
    main->attach(osg::Camera::PACKED_DEPTH_STENCIL_BUFFER, GL_DEPTH24_STENCIL8_EXT);
    main->dirtyAttachmentMap();
  }
  // Not viewer.isRealized(): an embedded window always claims to be.
  if (!std::exchange(is_prepared, true)) viewer.realize();
}

SceneView::SceneView(Quality quality, Target target)
    : impl_(std::make_unique<Impl>(quality, target)) {}
SceneView::~SceneView() = default;

void SceneView::sync(const Frame& frame) {
  impl_->has_new_casters = true;
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

void SceneView::set_dark(bool on) {
  if (std::exchange(impl_->is_dark, on) != on) impl_->show_darkness();
}

void SceneView::set_accent(const Colour& colour) {
  set_uniform(impl_->root->getStateSet(), "accent", linear_of(colour));
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
  return pick(impl_->camera, x_px, y_px);
}

std::optional<Pick> SceneView::pick(const OrbitCamera& from, double x_px, double y_px) const {
  const Ray ray = from.ray(x_px, y_px);
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

void SceneView::set_origin(int x_px, int y_px) {
  impl_->origin_x = x_px;
  impl_->origin_y = y_px;
}

void SceneView::set_shift(double x_px) {
  if (std::isfinite(x_px)) impl_->shift = x_px;
}

void SceneView::set_zoom(double zoom) { impl_->hud->set_zoom(zoom); }

std::array<std::size_t, 2> SceneView::label_counts() const {
  return {impl_->hud->labels_shown(), impl_->hud->labels_left_out()};
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
