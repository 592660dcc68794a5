// SPDX-License-Identifier: GPL-3.0-or-later
// Items, lines, triads and mass marks of the frame as nodes.
#include "viewer/scene/scene_view_impl.h"

namespace robomosp::viewer {
namespace {

/// Arrowheads and balls on a path, which shine with half their colour at least: whoever looks is to
/// see where they are, not what they would hide from the light.
bool is_mark(const Item& item) {
  const Colour &c = item.appearance.colour, &glow = item.appearance.emission;
  return glow.r + glow.g + glow.b > 0 && 2 * glow.r >= c.r && 2 * glow.g >= c.g &&
         2 * glow.b >= c.b;
}

}  // namespace

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
  has_new_casters = true;
  const Item& item = node.item;
  osg::MatrixTransform* place = node.place.get();
  place->removeChildren(0, place->getNumChildren());
  node.glass_back = node.glass_front = node.glass_edges = node.glass_caster = nullptr;
  node.glass_sorted.reset();
  node.contours.clear();
  node.contours_seen.reset();
  if (!node.triangles) return;

  const bool is_lined = look.style == Style::hidden_line, is_wire = look.style == Style::wireframe;
  const bool is_glass = item.appearance.colour.a < kOpaque && !is_drawing(look.style);
  osg::StateSet* s = place->getOrCreateStateSet();
  const osg::Vec4f base = linear_of(item.appearance.colour);
  osg::Vec4f drawn = base;
  if (is_lined) drawn = osg::Vec4f(1, 1, 1, 1);
  // Dark enough for lines on white.
  if (is_wire) drawn = osg::Vec4f(0.55F * base.x(), 0.55F * base.y(), 0.55F * base.z(), 0.24F);
  set_uniform(s, "base", drawn);
  const float rough = 0.78F - 0.64F * std::clamp(item.appearance.shininess, 0.0F, 1.0F);
  set_uniform(s, "surface",
              osg::Vec4f(rough, std::clamp(item.appearance.metalness, 0.0F, 1.0F), 0.0F, 0.0F));
  const Appearance& a = item.appearance;
  set_uniform(s, "shade", rgb_of(a.ambient.value_or(a.colour)));
  set_uniform(s, "highlight",
              a.specular ? osg::Vec4f(rgb_of(*a.specular), 1.0F) : osg::Vec4f(1, 1, 1, 0));
  set_uniform(s, "glow", rgb_of(a.emission));
  if (is_glass) {
    // The far sides before the near ones, so that both show.
    for (const bool is_front : {false, true}) {
      const auto geode = geode_of(node.triangles, kVisible);
      osg::StateSet* t = geode->getOrCreateStateSet();
      blend(t);
      cull(t, is_front ? osg::CullFace::BACK : osg::CullFace::FRONT);
      t->setRenderBinDetails(kGlassBin, "RenderBin");
      (is_front ? node.glass_front : node.glass_back) = geode;
      place->addChild(geode);
    }
    node.glass_caster = geode_of(node.triangles, 0);
    place->addChild(node.glass_caster);
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
    const auto geode = geode_of(node.triangles, is_mark(item) ? kVisible : kVisible | kCaster);
    osg::StateSet* t = geode->getOrCreateStateSet();
    // The nearest first, so that what it hides is not shaded.
    t->setRenderBinDetails(kBodyBin, kNearestFirst);
    // A section opens bodies: then the casters' state shows their insides.
    if (node.surface.is_closed) t->setAttributeAndModes(new osg::CullFace(osg::CullFace::BACK));
    place->addChild(geode);
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
  if (item.selected) add_outline(node);
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
    set_uniform(t, "veil", is_hidden ? kHiddenShare : 1.0F);
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

/// The part of a triad that bodies hide, weaker. It is drawn after the bodies and before the
/// triads, which therefore do not count as what hides it.
osg::ref_ptr<osg::Group> SceneView::Impl::veiled_axes() const {
  const auto axes = axes_of(0.026);
  osg::StateSet* s = axes->getOrCreateStateSet();
  blend(s, osg::Depth::GREATER);
  s->setRenderBinDetails(kVeiledFrameBin, "RenderBin");
  for (const char* map : kMapUniforms) set_uniform(s, map, nowhere());
  for (unsigned i = 0; i < axes->getNumChildren(); ++i) {
    osg::Uniform* base = axes->getChild(i)->getStateSet()->getUniform("base");
    osg::Vec4f colour;
    base->get(colour);
    colour.w() = kHiddenShare;
    base->set(colour);
  }
  return axes;
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
      node.veiled = veiled_axes();
      node.place->addChild(node.veiled);
      frames->addChild(node.place);
    }
    // In the sliver of the depth range that the marks have too.
    osg::StateSet* s = node.place->getOrCreateStateSet();
    node.veiled->setNodeMask(triad.on_top ? 0U : kVisible);
    if (triad.on_top) {
      s->setAttributeAndModes(new osg::Depth(osg::Depth::LEQUAL, 0.001, 0.01, true));
      s->setRenderBinDetails(kMarkBin, "RenderBin");
      // What shines through a body is not in its shadow: maps that are outside everywhere.
      for (const char* map : kMapUniforms) set_uniform(s, map, nowhere());
    } else {
      for (const char* map : kMapUniforms) s->removeUniform(map);
      s->removeAttribute(osg::StateAttribute::DEPTH);
      s->setRenderBinDetails(kFrameBin, "RenderBin");
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

}  // namespace robomosp::viewer
