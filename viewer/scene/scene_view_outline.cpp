// SPDX-License-Identifier: GPL-3.0-or-later
// The outline around selected items: one line around all of them, which shows through what hides
// them at a part of its strength.
#include "viewer/scene/scene_view_impl.h"

namespace robomosp::viewer {
namespace {

/// Draws where no selected item is and nothing of the outline was drawn yet.
osg::ref_ptr<osg::Stencil> stencil_of(osg::Stencil::Function function) {
  osg::ref_ptr<osg::Stencil> s = new osg::Stencil;
  s->setFunction(function, 1, 1);
  s->setOperation(osg::Stencil::KEEP, osg::Stencil::KEEP, osg::Stencil::REPLACE);
  return s;
}

}  // namespace

/// First all selected items mark their pixels in the stencil buffer, then hulls a few pixels larger
/// are drawn around these: in front of other bodies, and weaker behind them.
void SceneView::Impl::add_outline(ItemNode& node) {
  const auto mask = geode_of(node.triangles, kVisible);
  osg::StateSet* m = mask->getOrCreateStateSet();
  m->setAttributeAndModes(mask_program);
  m->setAttributeAndModes(stencil_of(osg::Stencil::ALWAYS));
  m->setAttribute(new osg::ColorMask(false, false, false, false));
  m->setAttributeAndModes(new osg::Depth(osg::Depth::ALWAYS, 0, 1, false));
  m->setMode(GL_CULL_FACE, osg::StateAttribute::OFF);
  m->setRenderBinDetails(kOutlineMaskBin, "RenderBin");
  node.place->addChild(mask);
  if (!node.hull) node.hull = hull_of(node.surface);
  for (const bool is_hidden : {false, true}) {
    const auto geode = geode_of(node.hull, kVisible);
    osg::StateSet* t = geode->getOrCreateStateSet();
    t->setAttributeAndModes(outline_program);
    t->setAttributeAndModes(stencil_of(osg::Stencil::NOTEQUAL));
    t->setMode(GL_CULL_FACE, osg::StateAttribute::OFF);
    blend(t, is_hidden ? osg::Depth::GREATER : osg::Depth::LEQUAL);
    set_uniform(t, "veil", is_hidden ? kHiddenShare : 1.0F);
    t->setRenderBinDetails(is_hidden ? kHiddenOutlineBin : kOutlineBin, "RenderBin");
    node.place->addChild(geode);
  }
}

}  // namespace robomosp::viewer
