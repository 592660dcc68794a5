// SPDX-License-Identifier: GPL-3.0-or-later
// Legends over the picture: bars of colours with values, or patches with names.
#include <algorithm>
#include <cmath>

#include "viewer/scene/hud.h"
#include "viewer/scene/osg_geometry.h"

namespace robomosp::viewer {
namespace {

// Nominal pixels of a picture 800 pixels high.
constexpr double kLegendText = 14, kLegendInset = 22, kBarLength = 190, kBarHeight = 10,
                 kPatchToText = 9, kLegendGap = 36, kTickLength = 4;
constexpr double kPlateMargin = 10;
constexpr float kLegendOpacity = 0.55F;
constexpr double kMostBarShare = 0.6;  // of the width of the picture

/// Bands that each have their name beside their middle show kinds, not values.
bool is_of_kinds(const render::Legend& legend) {
  const auto n = legend.colours.size();
  if (n == 0 || legend.ticks.size() != n) return false;
  for (std::size_t i = 0; i < n; ++i) {
    const double middle = (static_cast<double>(i) + 0.5) / static_cast<double>(n);
    if (std::abs(legend.ticks[i].share - middle) > 1e-6) return false;
  }
  return true;
}

}  // namespace

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
  // Plates below all else, so that words are readable in front of any body.
  osg::ref_ptr<osg::Vec3Array> plates = new osg::Vec3Array;
  const auto plate = [&](double x0, double y0, double x1, double y1) {
    const auto pad = static_cast<float>(std::round(kPlateMargin * scale));
    const auto l = static_cast<float>(x0) - pad, r = static_cast<float>(x1) + pad,
               b = static_cast<float>(y0) - pad, t = static_cast<float>(y1) + pad;
    for (const auto& [x, y] : {std::pair{l, b}, {r, b}, {r, t}, {l, b}, {r, t}, {l, t}})
      plates->push_back(osg::Vec3(std::round(x), std::round(y), 0));
  };
  const double line = std::max(1.0, std::round(scale)), size = kLegendText * scale;
  const double inset = kLegendInset * scale;
  double top = height - inset;
  // Bars lie in the upper right corner, one below the other.
  for (const render::Legend& legend : legends_) {
    if (is_of_kinds(legend)) continue;
    osgText::Text& title = text_of(first++, legend.title);
    put(title, 0, 0, size, ink_, is_linear);
    const std::size_t first_tick = first;
    double words = 0;
    for (const auto& tick : legend.ticks) {
      osgText::Text& t = text_of(first++, tick.text);
      put(t, 0, 0, size, ink_, is_linear);
      words += width_of(t) + size;
    }
    const double length =
        std::round(std::min(std::max({kBarLength * scale, words, width_of(title)}),
                            std::max(kMostBarShare * width, 1.0)));
    const double x1 = std::round(width - inset), x0 = x1 - length;
    title.setAlignment(osgText::Text::LEFT_TOP);
    put(title, x0, top, size, ink_, is_linear);
    const double high = std::round(top - 1.5 * size), low = high - std::round(kBarHeight * scale);
    box(x0 - line, low - line, x1 + line, high + line, ink_);
    const auto n = static_cast<double>(legend.colours.size());
    for (std::size_t i = 0; i < legend.colours.size(); ++i)
      box(x0 + length * static_cast<double>(i) / n, low,
          x0 + length * static_cast<double>(i + 1) / n, high, legend.colours[i]);
    // Values that would cover their left neighbour are left out; their marks stay.
    double free_from = x0 - size;
    for (std::size_t i = 0; i < legend.ticks.size(); ++i) {
      const double share = std::clamp(legend.ticks[i].share, 0.0, 1.0);
      const double x = std::round(x0 + length * share);
      box(x - 0.5 * line, low - line - kTickLength * scale, x + 0.5 * line, low - line, ink_);
      osgText::Text& t = *labels_[first_tick + i];
      const double half = 0.5 * width_of(t);
      const double middle = std::clamp(x, x0 + half, std::max(x0 + half, x1 - half));
      if (middle - half < free_from) {
        t.setNodeMask(0U);
        continue;
      }
      free_from = middle + half + 0.4 * size;
      t.setAlignment(osgText::Text::CENTER_TOP);
      put(t, middle, low - line - (kTickLength + 3) * scale, size, ink_, is_linear);
    }
    plate(x0, low - (kTickLength + 3) * scale - size, x1, top);
    top = low - (kTickLength + 3) * scale - 2 * size - kPlateMargin * scale;
  }
  // Patches with names, below the bars and beside each other.
  double right = width - inset;
  for (const render::Legend& legend : legends_) {
    if (!is_of_kinds(legend)) continue;
    const std::size_t first_tick = first;
    double widest = 0;
    for (const auto& tick : legend.ticks) {
      osgText::Text& t = text_of(first++, tick.text);
      t.setAlignment(osgText::Text::LEFT_CENTER);
      put(t, 0, 0, size, ink_, is_linear);
      widest = std::max(widest, width_of(t));
    }
    osgText::Text& title = text_of(first++, legend.title);
    const double patch = 0.9 * size, step = 1.6 * size;
    const double x1 = std::round(right - widest - kPatchToText * scale);
    const double x0 = std::round(x1 - patch);
    const double under = std::round(top - 14 * scale - size);
    for (std::size_t i = 0; i < legend.colours.size(); ++i) {
      const double y = std::round(under - (static_cast<double>(i) + 0.5) * step);
      box(x0 - line, y - 0.5 * patch - line, x1 + line, y + 0.5 * patch + line, ink_);
      box(x0, y - 0.5 * patch, x1, y + 0.5 * patch, legend.colours[i]);
      put(*labels_[first_tick + i], x1 + kPatchToText * scale, y, size, ink_, is_linear);
    }
    title.setAlignment(osgText::Text::RIGHT_BASE_LINE);
    put(title, right, under + 14 * scale, size, ink_, is_linear);
    const double left = std::min(x0, right - width_of(title));
    plate(left, under - static_cast<double>(legend.colours.size()) * step, right, top);
    right = left - kLegendGap * scale;
  }
  const bool is_light = ink_.r > 0.5F;
  const Colour ground{is_light ? 0.08F : 1, is_light ? 0.09F : 1, is_light ? 0.11F : 1,
                      kLegendOpacity};
  corners->insert(corners->begin(), plates->begin(), plates->end());
  colours->insert(
      colours->begin(), plates->size(),
      is_linear ? linear_of(ground) : osg::Vec4f(ground.r, ground.g, ground.b, ground.a));
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
