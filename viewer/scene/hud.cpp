// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/scene/hud.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>

#include <osg/BlendFunc>
#include <osg/Depth>
#include <osgText/Font>

#include "viewer/scene/lamps.h"
#include "viewer/scene/linear.h"
#include "viewer/scene/osg_geometry.h"
#include "viewer/scene/shaders.h"

namespace robomosp::viewer {
namespace {

// Nominal pixels of a picture 800 pixels high.
constexpr double kAxisLength = 46, kCornerInset = 68, kLetterSize = 18, kLabelSize = 16,
                 kCaptionSize = 16, kLegendInset = 22, kBarWidth = 20, kBarToText = 9,
                 kLegendGap = 36;
constexpr double kBarShare = 0.46;  // of the height of the picture
constexpr Colour kInkOnLight{0.09F, 0.10F, 0.12F, 1}, kInkOnDark{0.90F, 0.91F, 0.93F, 1};

/// Pixels of a nominal one for texts, which are to be read in small pictures too, and in those
/// shown at half their size.
double text_scale(double height) {
  return std::max(height / 800, std::clamp(height / 330, 0.6, 1.0));
}

bool overlap(const std::array<double, 4>& a, const std::array<double, 4>& b) {
  return a[0] < b[2] && b[0] < a[2] && a[1] < b[3] && b[1] < a[3];
}

/// Bands that each have their name beside their middle stand for kinds, not for values.
bool is_of_kinds(const render::Legend& legend) {
  const auto n = legend.colours.size();
  if (n == 0 || legend.ticks.size() != n) return false;
  for (std::size_t i = 0; i < n; ++i) {
    const double middle = (static_cast<double>(i) + 0.5) / static_cast<double>(n);
    if (std::abs(legend.ticks[i].share - middle) > 1e-6) return false;
  }
  return true;
}

/// A font of the system; without one osgText falls back to its built-in letters.
osg::ref_ptr<osgText::Font> label_font() {
  for (const char* path : {"/usr/share/fonts/truetype/dejavu/DejaVuSans-Bold.ttf",
                           "/usr/share/fonts/TTF/DejaVuSans-Bold.ttf",
                           "/usr/share/fonts/dejavu-sans-fonts/DejaVuSans-Bold.ttf",
                           "/usr/share/fonts/truetype/liberation/LiberationSans-Bold.ttf"}) {
    if (!std::filesystem::exists(path)) continue;
    if (auto font = osgText::readRefFontFile(path)) return font;
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
  // Bars lie behind all texts.
  bars_->getOrCreateStateSet()->setRenderBinDetails(0, "RenderBin");
  text_node_->getOrCreateStateSet()->setRenderBinDetails(1, "RenderBin");
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
  const double letters = text_scale(h);
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
  set_lamps(arrows_->getStateSet(), {&own, 1}, 1);

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

double Hud::width_of(const osgText::Text& text) {
  const osg::BoundingBox box = text.getBoundingBox();
  return box.valid() ? static_cast<double>(box.xMax() - box.xMin()) : 0;
}

/// Texts stand to the right of their place, or to the left where the picture ends, and one below
/// the other where they would cover each other.
std::size_t Hud::place_labels(const OrbitCamera& camera, const std::vector<Label>& labels,
                              double scale, bool is_linear) {
  const double w = camera.width(), h = camera.height();
  const double size = kLabelSize * scale, off = 9 * scale, rim = 5 * scale;
  std::vector<std::array<double, 4>> taken;  // left, lower, right, upper
  std::size_t used = 0;
  for (const Label& label : labels) {
    const auto at = camera.project(label.place);
    if (!at) continue;
    osgText::Text& t = text_of(used++, label.text, is_linear);
    t.setAlignment(osgText::Text::LEFT_CENTER);
    put(t, 0, 0, size, ink_, is_linear);
    const double wide = width_of(t);
    double x = (*at)[0] + off, y = h - (*at)[1] - off;
    // What lies outside the picture has its text there too.
    if ((*at)[0] >= 0 && (*at)[0] <= w && (*at)[1] >= 0 && (*at)[1] <= h) {
      if (x + wide > w - rim) x = (*at)[0] - off - wide;
      x = std::clamp(x, rim, std::max(rim, w - rim - wide));
      const auto box = [&] { return std::array{x, y - 0.6 * size, x + wide, y + 0.6 * size}; };
      const double wanted = y;
      constexpr int kTries = 16;
      for (int k = 0; k < kTries; ++k) {
        // Below, above, further below and so on.
        y = wanted + (k % 2 == 0 ? -1 : 1) * ((k + 1) / 2) * 1.2 * size;
        y = std::clamp(y, 0.8 * size, h - 0.8 * size);
        if (std::none_of(taken.begin(), taken.end(),
                         [&](const auto& other) { return overlap(box(), other); }))
          break;
      }
      taken.push_back(box());
    }
    put(t, x, y, size, ink_, is_linear);
  }
  return used;
}

osgText::Text& Hud::text_of(std::size_t n, const std::string& text, bool is_linear) {
  while (labels_.size() <= n) labels_.push_back(new_text());
  osgText::Text& t = *labels_[n];
  t.setNodeMask(~0U);
  t.setText(text, osgText::String::ENCODING_UTF8);
  t.setBackdropType(osgText::Text::OUTLINE);
  t.setBackdropOffset(0.06F);
  const Colour halo{0.93F, 0.94F, 0.95F, 0.85F};
  t.setBackdropColor(is_linear ? linear_of(halo) : osg::Vec4f(halo.r, halo.g, halo.b, halo.a));
  return t;
}

std::size_t Hud::place_legends(double width, double height, double scale, std::size_t first,
                               bool is_linear) {
  bars_->removeDrawables(0, bars_->getNumDrawables());
  if (legends_.empty()) return first;
  osg::ref_ptr<osg::Geometry> bars = new osg::Geometry;
  osg::ref_ptr<osg::Vec3Array> corners = new osg::Vec3Array;
  osg::ref_ptr<osg::Vec4Array> colours = new osg::Vec4Array;
  const auto box = [&](double x0, double y0, double x1, double y1, const Colour& c) {
    for (const auto& [x, y] : {std::pair{x0, y0}, {x1, y0}, {x1, y1}, {x0, y0}, {x1, y1}, {x0, y1}})
      corners->push_back(osg::Vec3(static_cast<float>(x), static_cast<float>(y), 0));
    colours->insert(colours->end(), 6, is_linear ? linear_of(c) : osg::Vec4f(c.r, c.g, c.b, c.a));
  };
  const double bar = std::round(kBarShare * height);
  const double low = std::round(0.5 * (height - bar)), line = std::max(1.0, std::round(scale));
  double right = width - kLegendInset * scale;
  const double size = kLabelSize * scale;
  for (const render::Legend& legend : legends_) {
    const std::size_t first_tick = first;
    double widest = 0;
    for (const auto& tick : legend.ticks) {
      osgText::Text& t = text_of(first++, tick.text, is_linear);
      t.setAlignment(osgText::Text::LEFT_CENTER);
      put(t, 0, 0, size, ink_, is_linear);
      widest = std::max(widest, width_of(t));
    }
    osgText::Text& title = text_of(first++, legend.title, is_linear);
    const bool has_kinds = is_of_kinds(legend);
    const double patch = (has_kinds ? 0.9 : kBarWidth / kLabelSize) * size;
    const double x1 = std::round(right - widest - kBarToText * scale);
    const double x0 = std::round(x1 - patch);
    double top = low + bar;
    if (has_kinds) {
      // Patches with names, the first at the top.
      const double step = 1.6 * size;
      top = std::round(height - kLegendInset * scale - 14 * scale - size);
      for (std::size_t i = 0; i < legend.colours.size(); ++i) {
        const double y = std::round(top - (static_cast<double>(i) + 0.5) * step);
        box(x0 - line, y - 0.5 * patch - line, x1 + line, y + 0.5 * patch + line, ink_);
        box(x0, y - 0.5 * patch, x1, y + 0.5 * patch, legend.colours[i]);
        put(*labels_[first_tick + i], x1 + kBarToText * scale, y, size, ink_, is_linear);
      }
    } else {
      box(x0 - line, low - line, x1 + line, low + bar + line, ink_);
      const auto n = static_cast<double>(legend.colours.size());
      for (std::size_t i = 0; i < legend.colours.size(); ++i)
        box(x0, low + bar * static_cast<double>(i) / n, x1,
            low + bar * static_cast<double>(i + 1) / n, legend.colours[i]);
      for (std::size_t i = 0; i < legend.ticks.size(); ++i) {
        const double y = std::round(low + bar * std::clamp(legend.ticks[i].share, 0.0, 1.0));
        box(x1 + line, y - 0.5 * line, x1 + 5 * scale, y + 0.5 * line, ink_);
        put(*labels_[first_tick + i], x1 + kBarToText * scale, y, size, ink_, is_linear);
      }
    }
    title.setAlignment(osgText::Text::RIGHT_BASE_LINE);
    put(title, right, top + 14 * scale, size, ink_, is_linear);
    right = std::min(x0, right - width_of(title)) - kLegendGap * scale;
  }
  bars->setVertexArray(corners);
  bars->setColorArray(colours, osg::Array::BIND_PER_VERTEX);
  bars->addPrimitiveSet(
      new osg::DrawArrays(GL_TRIANGLES, 0, static_cast<GLsizei>(corners->size())));
  bars->setUseDisplayList(false);
  bars->setUseVertexBufferObjects(true);
  bars_->addDrawable(bars);
  return first;
}

}  // namespace robomosp::viewer
