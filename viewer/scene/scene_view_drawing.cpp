// SPDX-License-Identifier: GPL-3.0-or-later
// What is made anew for the camera: cut faces, contours, the order of glass.
#include "viewer/scene/scene_view_impl.h"

namespace robomosp::viewer {

void SceneView::Impl::build_cut(ItemNode& node) {
  has_new_casters = true;
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

}  // namespace robomosp::viewer
