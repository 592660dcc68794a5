// SPDX-License-Identifier: GPL-3.0-or-later
// Where the camera stands and what it must see; the ground below the scene.
#include "viewer/scene/scene_view_impl.h"

namespace robomosp::viewer {
namespace {

/// Around points; empty at first.
struct BoxOfPoints {
  static constexpr double kNone = std::numeric_limits<double>::infinity();
  Vec3 low{kNone, kNone, kNone}, high{-kNone, -kNone, -kNone};
  [[nodiscard]] bool is_empty() const { return low[0] > high[0]; }
  void add(const Vec3& p) {
    for (std::size_t i = 0; i < 3; ++i) {
      low[i] = std::min(low[i], p[i]);
      high[i] = std::max(high[i], p[i]);
    }
  }
  void add(const BoxOfPoints& other) {
    if (other.is_empty()) return;
    add(other.low);
    add(other.high);
  }
};

}  // namespace

/// Places of the items that a section leaves.
std::vector<Vec3> SceneView::Impl::points_of_bodies(const std::set<std::uint64_t>& without) const {
  std::vector<Vec3> points;
  const auto add = [&](const std::vector<float>& p, const Pose& pose, bool all) {
    for (std::size_t i = 0; i + 2 < p.size(); i += 3) {
      const Vec3 at = transform(pose, {p[i], p[i + 1], p[i + 2]});
      if ((all || is_kept(at)) && is_finite(at)) points.push_back(at);
    }
  };
  for (const auto& [id, node] : items) {
    if (node.surface.triangles.empty() || without.contains(id)) continue;
    add(node.surface.positions, node.item.pose, false);
    add(node.cut_points, Pose{}, true);
  }
  return points;
}

std::vector<Vec3> SceneView::Impl::points_shown(const std::set<std::uint64_t>& without) const {
  std::vector<Vec3> points = points_of_bodies(without);
  BoxOfPoints bodies;
  for (const Vec3& p : points) bodies.add(p);
  const double reach = points.empty() ? 0 : norm(bodies.high - bodies.low);
  // Frames, marks and labels far from all bodies would make these tiny.
  const auto is_near = [&](const Vec3& p) {
    if (points.empty()) return true;
    for (std::size_t i = 0; i < 3; ++i)
      if (p[i] < bodies.low[i] - reach || p[i] > bodies.high[i] + reach) return false;
    return true;
  };
  std::vector<Vec3> more;
  for (const auto& [id, node] : marks)
    for (std::size_t i = 0; i < 3; ++i)
      for (const double side : {-1.0, 1.0}) {
        Vec3 end{};
        end[i] = side * node.mark.gyration[i];
        more.push_back(transform(node.mark.pose, end));
      }
  for (const auto& label : labels) more.push_back(label.place);
  for (const auto& [id, node] : triads) {
    const double l = node.triad.length;
    for (const Vec3& tip : {Vec3{0, 0, 0}, Vec3{l, 0, 0}, Vec3{0, l, 0}, Vec3{0, 0, l}})
      more.push_back(transform(node.triad.pose, tip));
  }
  std::erase_if(more, [&](const Vec3& p) { return !is_finite(p) || !is_near(p); });
  points.insert(points.end(), more.begin(), more.end());
  for (const auto& [id, node] : lines)
    for (const Vec3& p : node.line.points)
      if (is_finite(p)) points.push_back(p);
  return points;
}

std::set<std::uint64_t> SceneView::Impl::floors() const {
  constexpr double kFlat = 0.05;      // height by the shorter side
  constexpr double kAtGround = 0.02;  // of its top [m]
  constexpr double kLarger = 4;       // area by that of all else
  std::map<std::uint64_t, BoxOfPoints> flat;
  BoxOfPoints rest;
  for (const auto& [id, node] : items) {
    if (node.surface.triangles.empty()) continue;
    BoxOfPoints box;
    for (const Vec3& p : corners(node.surface, node.item.pose)) box.add(p);
    const Vec3 size = box.high - box.low;
    if (size[2] <= kFlat * std::min(size[0], size[1]) && std::abs(box.high[2]) <= kAtGround)
      flat.emplace(id, box);
    else rest.add(box);
  }
  std::set<std::uint64_t> out;
  if (rest.is_empty()) return out;
  const Vec3 size = rest.high - rest.low;
  for (const auto& [id, box] : flat) {
    const Vec3 floor = box.high - box.low;
    const bool is_below = box.high[2] <= rest.low[2] + kAtGround;
    if (is_below && floor[0] * floor[1] >= kLarger * size[0] * size[1]) out.insert(id);
  }
  return out;
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
  auto points = points_shown(floors());
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

void SceneView::Impl::place_camera(const Pass& pass) {
  osg::Camera* main = viewer.getCamera();
  main->setViewport(origin_x, origin_y, camera.width(), camera.height());
  window->resized(0, 0, origin_x + camera.width(), origin_y + camera.height());
  main->setViewport(origin_x, origin_y, camera.width(), camera.height());
  const double d = camera.distance();
  const double reach = norm(camera.target()) + radius;
  const bool is_flat = !camera.perspective();
  const double far = d + 4 * reach + 90 * radius, near = is_flat ? -far : std::max(0.02 * d, 1e-5);
  const osg::Matrixd view = matrix_of(camera.view());
  main->setViewMatrix(view);
  main->setProjectionMatrix(
      matrix_of(camera.projection(near, far, pass.shift_x + shift, pass.shift_y)));

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
  set_uniform(s, "origin", osg::Vec2f(static_cast<float>(origin_x), static_cast<float>(origin_y)));
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

}  // namespace robomosp::viewer
