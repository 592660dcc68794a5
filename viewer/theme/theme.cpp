// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/theme/theme.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include <QApplication>
#include <QEvent>
#include <QList>
#include <QPalette>
#include <QPointer>
#include <QStyle>
#include <QStyleFactory>
#include <QVariant>
#include <QWidget>

namespace robomosp::viewer {
namespace {

void paint_dark(Theme& t) {
  t.window = "#17191D";
  t.panel = "#1F2227";
  t.header = "#272B31";
  t.field = "#14161A";
  t.hover = "#30353D";
  t.line = "#343941";
  t.field_line = "#4A515C";
  t.text = "#E6E8EC";
  t.text_dim = "#AAB1BC";
  t.text_quiet = "#939CAA";
  t.disabled = "#6B7482";
  t.accent = "#4DA3FF";
  t.accent_fill = "#1B62B5";
  t.selection = "#1A3350";
  t.selection_idle = "#2A313B";
  t.ok = "#4FBF87";
  t.warn = "#E5A93D";
  t.fault = "#FF6B63";
  t.fault_ground = "#4A2326";
  t.ok_ground = "#1D3B2E";
  t.ok_fill = "#4FBF87";
  t.warn_fill = "#E5A93D";
  t.axes = {"#F0524F", "#5FBF4A", "#4C8DFF"};
  t.series = {"#4DA3FF", "#F2A33A", "#5CC98A", "#E07BD0", "#E8DA5A", "#F2706A", "#9C8CFF"};
  t.keyword = "#7FB4FF";
  t.string = "#E0B070";
  t.number = "#8FD6A8";
  t.comment = "#7E8794";
  t.type = "#6FD0D0";
}

void paint_light(Theme& t) {
  t.window = "#D9DDE2";
  t.panel = "#F5F6F8";
  t.header = "#E9ECF0";
  t.field = "#FFFFFF";
  t.hover = "#DDE3EA";
  t.line = "#CBD1D8";
  t.field_line = "#A3ACB7";
  t.text = "#191D22";
  t.text_dim = "#4B545F";
  t.text_quiet = "#5E6772";
  t.disabled = "#8C949E";
  t.accent = "#0B63C4";
  t.accent_fill = "#0B63C4";
  t.selection = "#D8E8FC";
  t.selection_idle = "#DFE5EC";
  t.ok = "#1A7A4A";
  t.warn = "#8A5800";
  t.fault = "#C22A2A";
  t.fault_ground = "#FBE3E2";
  t.ok_ground = "#DDF1E6";
  t.ok_fill = "#2E9E63";
  t.warn_fill = "#DD9A1F";
  t.axes = {"#C9302C", "#2E8B1F", "#1F5FD0"};
  t.series = {"#0B63C4", "#B86A00", "#1A8552", "#A83A98", "#857400", "#C43C36", "#5F4BD0"};
  t.keyword = "#0B4FA8";
  t.string = "#8A4A00";
  t.number = "#0F6B3C";
  t.comment = "#6A7380";
  t.type = "#0B6A6A";
}

QFont font_of(const QStringList& families, double px, bool is_bold = false) {
  QFont font(families);
  font.setPixelSize(std::max(1, static_cast<int>(std::lround(px))));
  font.setWeight(is_bold ? QFont::DemiBold : QFont::Normal);
  return font;
}

QPalette palette_of(const Theme& t) {
  QPalette p;
  p.setColor(QPalette::Window, t.panel);
  p.setColor(QPalette::WindowText, t.text);
  p.setColor(QPalette::Base, t.field);
  p.setColor(QPalette::AlternateBase, t.panel);
  p.setColor(QPalette::ToolTipBase, t.header);
  p.setColor(QPalette::ToolTipText, t.text);
  p.setColor(QPalette::Text, t.text);
  p.setColor(QPalette::Button, t.header);
  p.setColor(QPalette::ButtonText, t.text);
  p.setColor(QPalette::BrightText, t.on_accent);
  p.setColor(QPalette::Link, t.accent);
  p.setColor(QPalette::LinkVisited, t.accent);
  p.setColor(QPalette::Highlight, t.selection);
  p.setColor(QPalette::HighlightedText, t.text);
  p.setColor(QPalette::PlaceholderText, t.text_quiet);
  p.setColor(QPalette::Light, t.hover);
  p.setColor(QPalette::Midlight, t.hover);
  p.setColor(QPalette::Mid, t.line);
  p.setColor(QPalette::Dark, t.line);
  p.setColor(QPalette::Shadow, t.window);
  p.setColor(QPalette::Inactive, QPalette::Highlight, t.selection_idle);
  for (const auto role : {QPalette::WindowText, QPalette::Text, QPalette::ButtonText})
    p.setColor(QPalette::Disabled, role, t.disabled);
  return p;
}

int& revision() {
  static int count = 0;
  return count;
}

Theme& current() {
  static Theme instance = make_theme(true);
  return instance;
}

constexpr QFont Theme::*kFonts[] = {&Theme::ui,   &Theme::menu,    &Theme::small, &Theme::mono,
                                    &Theme::code, &Theme::heading, &Theme::title};
/// Twice the place in kFonts, and one more for bold.
constexpr const char* kFontProperty = "theme_font";

QFont font_numbered(const Theme& t, int number) {
  QFont font = t.*kFonts[static_cast<std::size_t>(number / 2) % std::size(kFonts)];
  if (number % 2 != 0) font.setWeight(QFont::DemiBold);
  return font;
}

}  // namespace

void use_font(QWidget& widget, QFont Theme::*font, bool is_bold) {
  const auto at = std::find(std::begin(kFonts), std::end(kFonts), font);
  const int number = 2 * static_cast<int>(at - std::begin(kFonts)) + (is_bold ? 1 : 0);
  widget.setProperty(kFontProperty, number);
  widget.setFont(font_numbered(theme(), number));
}

int Theme::px(double length) const { return static_cast<int>(std::lround(length * zoom)); }

Theme make_theme(bool is_dark, double zoom, bool has_strong_borders) {
  Theme t;
  t.is_dark = is_dark;
  t.zoom = std::isfinite(zoom) ? std::clamp(zoom, 0.5, 3.0) : 1.0;
  if (is_dark) paint_dark(t);
  else paint_light(t);
  t.has_strong_borders = has_strong_borders;
  if (has_strong_borders) t.field_line = t.text_quiet;
  t.on_accent = "#FFFFFF";
  t.speed = {"#3B4CC0", "#3E78D8", "#35A7C2", "#4FC08D", "#A6CF4F", "#F2C13C", "#F08A3C"};
  t.label = "#FFFFFF";
  t.label_ground = QColor(0x14, 0x17, 0x1B, 232);
  for (int* length :
       {&t.gap, &t.radius, &t.bar, &t.dock_head, &t.status, &t.row, &t.property_row,
        &t.field_height, &t.label_width, &t.mark_width, &t.indent, &t.button, &t.icon})
    *length = std::max(1, t.px(*length));
  const QStringList text{"Inter", "DejaVu Sans"}, digits{"JetBrains Mono", "DejaVu Sans Mono"};
  t.ui = font_of(text, 12 * t.zoom);
  t.menu = font_of(text, 13 * t.zoom);
  t.small = font_of(text, 11 * t.zoom);
  t.mono = font_of(digits, 11.5 * t.zoom);
  t.code = font_of(digits, 12.5 * t.zoom);
  t.heading = font_of(text, 17 * t.zoom, true);
  t.title = font_of(text, 20 * t.zoom, true);
  return t;
}

const Theme& theme() { return current(); }

int theme_revision() { return revision(); }

void set_theme(QApplication& application, const Theme& wanted) {
  current() = wanted;
  if (application.style()->objectName().compare("fusion", Qt::CaseInsensitive) != 0)
    application.setStyle(QStyleFactory::create("Fusion"));
  QApplication::setFont(wanted.ui);
  QApplication::setPalette(palette_of(wanted));
  application.setStyleSheet(style_sheet(wanted));
  // Last, since a style sheet gives widgets back the fonts that they had before it.
  ++revision();
  QList<QPointer<QWidget>> widgets;  // some end others when they change
  for (QWidget* widget : QApplication::allWidgets()) widgets.append(widget);
  for (const QPointer<QWidget>& widget : widgets)
    if (const QVariant number = widget->property(kFontProperty); number.isValid())
      widget->setFont(font_numbered(wanted, number.toInt()));
  for (const QPointer<QWidget>& widget : widgets) {
    QEvent changed(QEvent::StyleChange);
    if (widget) QCoreApplication::sendEvent(widget, &changed);
  }
}

}  // namespace robomosp::viewer
