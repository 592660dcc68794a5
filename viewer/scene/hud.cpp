// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/scene/hud.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>

#include <osg/BlendFunc>
#include <osg/Depth>
#include <osgDB/Registry>
#include <osgText/Font>

#include "viewer/scene/lamps.h"
#include "viewer/scene/linear.h"
#include "viewer/scene/osg_geometry.h"
#include "viewer/scene/shaders.h"

namespace robomosp::viewer {
namespace {

// Nominal pixels of a picture 800 pixels high.
constexpr double kAxisLength = 46, kCornerInset = 68, kLetterSize = 18, kCaptionSize = 16;
constexpr Colour kInkOnLight{0.09F, 0.10F, 0.12F, 1}, kInkOnDark{0.90F, 0.91F, 0.93F, 1};

/// Pixels of a nominal one for texts, which are to be read in small pictures too, and in those
/// shown at half their size.
double text_scale(double height) {
  return std::max(height / 800, std::clamp(height / 330, 0.6, 1.0));
}

/// A font of the system, the one of the window if it is installed; without any osgText falls back
/// to its built-in letters.
osg::ref_ptr<osgText::Font> label_font() {
  // The reader of fonts refuses names that end with .otf, but reads their content.
  osgDB::ReaderWriter* const reader =
      osgDB::Registry::instance()->getReaderWriterForExtension("ttf");
  if (!reader) return {};
  for (const char* path :
       {"/usr/share/fonts/opentype/inter/Inter-Medium.otf",
        "/usr/share/fonts/truetype/inter/Inter-Medium.ttf",
        "/usr/share/fonts/inter/Inter-Medium.otf", "/usr/share/fonts/TTF/Inter-Medium.ttf",
        "/usr/share/fonts/truetype/dejavu/DejaVuSans.ttf", "/usr/share/fonts/TTF/DejaVuSans.ttf",
        "/usr/share/fonts/dejavu-sans-fonts/DejaVuSans.ttf",
        "/usr/share/fonts/truetype/liberation/LiberationSans-Regular.ttf"}) {
    osgDB::Registry& known = *osgDB::Registry::instance();
    const osg::ref_ptr<osg::Object> kept = known.getRefFromObjectCache(path);
    if (auto* font = dynamic_cast<osgText::Font*>(kept.get())) return font;
    if (!std::filesystem::exists(path)) continue;
    std::ifstream file(path, std::ios::binary);
    auto read = reader->readObject(file);
    if (auto* font = dynamic_cast<osgText::Font*>(read.getObject())) {
      known.addEntryToObjectCache(path, font);
      return font;
    }
  }
  return {};
}

void overlay(osg::Camera* camera, int bin, unsigned mask) {
  camera->setRenderOrder(osg::Camera::NESTED_RENDER);
  camera->setReferenceFrame(osg::Transform::ABSOLUTE_RF);
  camera->setClearMask(0);
  camera->setComputeNearFarMode(osg::Camera::DO_NOT_COMPUTE_NEAR_FAR);
  camera->setCullingMode(osg::CullSettings::NO_CULLING);
  camera->setCullMask(mask);
  camera->setAllowEventFocus(false);
  osg::StateSet* s = camera->getOrCreateStateSet();
  s->setRenderBinDetails(bin, "RenderBin", osg::StateSet::OVERRIDE_RENDERBIN_DETAILS);
  // The nearest sliver of the depth range belongs to the overlay.
  s->setAttributeAndModes(new osg::Depth(osg::Depth::LESS, 0.0, 0.001, true));
}

}  // namespace

osg::ref_ptr<osg::Group> axes_of(double shaft_radius) {
  const auto arrow = arrow_of(shaft_radius);
  osg::ref_ptr<osg::Group> group = new osg::Group;
  const std::array<osg::Matrixd, 3> turns{
      osg::Matrixd::rotate(osg::Vec3d(0, 0, 1), osg::Vec3d(1, 0, 0)),
      osg::Matrixd::rotate(osg::Vec3d(0, 0, 1), osg::Vec3d(0, 1, 0)), osg::Matrixd()};
  for (std::size_t i = 0; i < 3; ++i) {
    osg::ref_ptr<osg::MatrixTransform> turn = new osg::MatrixTransform(turns[i]);
    osg::ref_ptr<osg::Geode> geode = new osg::Geode;
    geode->addDrawable(arrow);
    osg::StateSet* s = turn->getOrCreateStateSet();
    const osg::Vec4f colour = linear_of(kAxisColours[i]);
    s->addUniform(new osg::Uniform("base", colour));
    s->addUniform(new osg::Uniform("shade", osg::Vec3f(colour.x(), colour.y(), colour.z())));
    s->addUniform(new osg::Uniform("surface", osg::Vec4f(0.55F, 0, 0, 0)));
    turn->addChild(geode);
    group->addChild(turn);
  }
  return group;
}

Hud::Hud(osg::Program* surface_program, int first_bin, unsigned mask) {
  overlay(arrows_, first_bin, mask);
  overlay(texts_, first_bin + 1, mask);
  osg::StateSet* s = arrows_->getStateSet();
  s->setAttributeAndModes(surface_program);
  s->setMode(GL_NORMALIZE, osg::StateAttribute::ON);
  s->addUniform(new osg::Uniform("eye", osg::Vec4f(0, 0, 1, 0)));
  // Maps whose coordinates are always outside: no shadow falls on the arrows.
  for (const char* map : kMapUniforms)
    s->addUniform(
        new osg::Uniform(map, osg::Matrixf::scale(0, 0, 0) * osg::Matrixf::translate(-1, -1, 0)));
  corner_->addChild(axes_of(0.042));
  arrows_->addChild(corner_);
  osg::StateSet* t = texts_->getStateSet();
  t->setMode(GL_BLEND, osg::StateAttribute::ON);
  t->setAttributeAndModes(
      new osg::BlendFunc(osg::BlendFunc::SRC_ALPHA, osg::BlendFunc::ONE_MINUS_SRC_ALPHA,
                         osg::BlendFunc::ONE, osg::BlendFunc::ONE_MINUS_SRC_ALPHA));
  t->setAttributeAndModes(new osg::Depth(osg::Depth::ALWAYS, 0.0, 0.001, false));
  // Grounds and bars lie behind all texts.
  grounds_->getOrCreateStateSet()->setRenderBinDetails(-1, "RenderBin");
  bars_->getOrCreateStateSet()->setRenderBinDetails(0, "RenderBin");
  text_node_->getOrCreateStateSet()->setRenderBinDetails(1, "RenderBin");
  texts_->addChild(grounds_);
  texts_->addChild(bars_);
  texts_->addChild(text_node_);
  root_->addChild(arrows_);
  root_->addChild(texts_);
  for (std::size_t i = 0; i < 3; ++i) {
    letters_[i] = new_text();
    letters_[i]->setText(std::string(1, static_cast<char>('X' + i)));
  }
  set_dark(false);
  caption_ = new_text();
  caption_->setAlignment(osgText::Text::LEFT_BOTTOM);  // more lines grow upwards
}

osg::ref_ptr<osgText::Text> Hud::new_text() {
  static const osg::ref_ptr<osgText::Font> font = label_font();
  osg::ref_ptr<osgText::Text> t = new osgText::Text;
  if (font) t->setFont(font);
  t->setFontResolution(64, 64);
  t->setAlignment(osgText::Text::CENTER_CENTER);
  t->setUseDisplayList(false);
  t->setUseVertexBufferObjects(true);
  text_node_->addDrawable(t);
  return t;
}

void Hud::set_caption(const std::string& text) {
  caption_->setText(text, osgText::String::ENCODING_UTF8);
}

void Hud::show_axes(bool on) { has_axes_ = on; }

void Hud::set_dark(bool on) { ink_ = on ? kInkOnDark : kInkOnLight; }

void Hud::put(osgText::Text& text, double x, double y, double size, const Colour& colour,
              bool is_linear) {
  // Whole pixels keep letters crisp.
  text.setPosition(
      osg::Vec3f(static_cast<float>(std::round(x)), static_cast<float>(std::round(y)), 0.0F));
  text.setCharacterSize(static_cast<float>(size));
  text.setColor(is_linear ? linear_of(colour) : osg::Vec4f(colour.r, colour.g, colour.b, colour.a));
}

void Hud::place(const OrbitCamera& camera, const std::vector<Label>& labels, double scale,
                double shift_x, double shift_y, bool is_linear) {
  const double w = camera.width(), h = camera.height();
  const double letters = zoom_ * text_scale(h);
  scale = std::max(scale, 0.8 * letters);
  const auto pixels = [&](double dx, double dy) {
    return osg::Matrixd::ortho(-dx, w - dx, dy, h + dy, -1000 * scale, 1000 * scale);
  };
  arrows_->setProjectionMatrix(pixels(shift_x, shift_y));
  texts_->setProjectionMatrix(pixels(0, 0));
  arrows_->setNodeMask(has_axes_ ? ~0U : 0U);

  const Vec3 x = camera.right(), y = camera.up(), z = camera.backward();
  const osg::Matrixd turn =
      matrix_of(Matrix4{x[0], x[1], x[2], 0, y[0], y[1], y[2], 0, z[0], z[1], z[2], 0, 0, 0, 0, 1});
  const double length = kAxisLength * scale, inset = kCornerInset * scale;
  const double margin = 20 * scale;
  caption_->setMaximumWidth(static_cast<float>(w - 2 * margin));
  put(*caption_, margin, 14 * scale, kCaptionSize * letters, ink_, is_linear);
  const osg::BoundingBox said = caption_->getBoundingBox();
  const double bottom =
      inset + (caption_->getText().empty() || !said.valid()
                   ? 0
                   : static_cast<double>(said.yMax() - said.yMin()) + 0.4 * kCaptionSize * letters);
  corner_->setMatrix(osg::Matrixd::scale(length, length, length) * turn *
                     osg::Matrixd::translate(inset, bottom, 0));
  const auto direction = [](const Vec3& v) {
    return osg::Vec3f(static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2]));
  };
  arrows_->getStateSet()->getUniform("eye")->set(osg::Vec4f(direction(z), 0));
  // Lit from over the viewer's left shoulder, from wherever one looks.
  const Vec3 lamp = z + 0.6 * y + (-0.4) * x;
  const Lamp own = own_lamp((1 / norm(lamp)) * lamp);
  set_lamps(arrows_->getStateSet(), {&own, 1});

  for (std::size_t i = 0; i < 3; ++i) {
    const double reach = length + 11 * scale;
    // An axis that points at the viewer has its letter on top of the arrow: push it sideways.
    put(*letters_[i], inset + x[i] * reach, bottom + y[i] * reach, kLetterSize * letters,
        kAxisColours[i], is_linear);
    letters_[i]->setNodeMask(has_axes_ && std::hypot(x[i], y[i]) > 0.25 ? ~0U : 0U);
  }
  std::size_t used = place_labels(camera, labels, letters, is_linear);
  used = place_legends(w, h, letters, used, is_linear);
  for (std::size_t i = used; i < labels_.size(); ++i) labels_[i]->setNodeMask(0U);
}

}  // namespace robomosp::viewer
