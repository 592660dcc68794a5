// SPDX-License-Identifier: GPL-3.0-or-later
// Theme: colours, type and spacing of all windows, dark and light. It feeds the style sheet,
// painters, plots and lexers (layer: GUI). Tokens in brackets are those of the design's palette.
#pragma once

#include <array>

#include <QColor>
#include <QFont>
#include <QString>

class QApplication;
class QWidget;

namespace robomosp::viewer {

struct Theme {
  bool is_dark = true;
  bool has_strong_borders = false;  ///< of fields and buttons, for people who need them
  double zoom = 1;                  ///< of the interface; included in all lengths and fonts below

  // Grounds.
  QColor window;  ///< gaps, start page [bg0]
  QColor panel;   ///< docks, selected tab [bg1]
  QColor header;  ///< menu, dock heads, status bar, buttons [bg2]
  QColor field;   ///< fields, editors, console [bg3]
  QColor hover;   ///< [hov]
  // Lines.
  QColor line;        ///< separators [line]
  QColor field_line;  ///< borders of fields and buttons [line2]
  // Text.
  QColor text;        ///< [tx]
  QColor text_dim;    ///< labels, units [tx2]
  QColor text_quiet;  ///< line numbers, times, old values [tx3]
  QColor disabled;    ///< [dis]
  // Accent and selection.
  QColor accent;          ///< focus, cursor, links [acc]
  QColor accent_fill;     ///< filled button, time flag [accf]
  QColor on_accent;       ///< text on accent_fill
  QColor selection;       ///< in the widget with the focus [accd]
  QColor selection_idle;  ///< elsewhere [seld]
  // States: of text and marks, their grounds, fills of bars and bands.
  QColor ok, warn, fault;          ///< [ok warn err]
  QColor fault_ground, ok_ground;  ///< [errd okd]
  QColor ok_fill, warn_fill;       ///< [gok gwarn]
  std::array<QColor, 3> axes;      ///< x, y, z
  std::array<QColor, 7> series;    ///< of plots; joints 1..7 [s1..s7]
  std::array<QColor, 7> speed;     ///< of paths, slow to fast; the same in both themes
  QColor label, label_ground;      ///< of labels in the 3-D picture
  QColor keyword, string, number, comment, type;  ///< of code

  // Lengths [device-independent px].
  int gap = 8;     ///< between elements; half of it inside them
  int radius = 3;  ///< of corners
  int bar = 32;    ///< menu bar, document tabs, view bar
  int dock_head = 28;
  int status = 24;
  int row = 24;  ///< of trees and tables
  int property_row = 26;
  int field_height = 22;  ///< of a field in a property row
  int label_width = 118;  ///< of a property row
  int mark_width = 12;    ///< of the changed mark in a property row
  int indent = 14;        ///< of trees
  int button = 24;
  int icon = 16;
  int focus_ring = 2;

  QFont ui;       ///< rows and labels
  QFont menu;     ///< menus, titles of views
  QFont small;    ///< units and notes
  QFont mono;     ///< numbers
  QFont code;     ///< editors and console
  QFont heading;  ///< of the start page
  QFont title;    ///< of the start page

  /// A length of the design at the zoom of the interface [device-independent px].
  [[nodiscard]] int px(double length) const;
};

/// The palette, type and spacing at a zoom of 0.5 .. 3; values outside are clamped.
[[nodiscard]] Theme make_theme(bool is_dark, double zoom = 1, bool has_strong_borders = false);

/// The current theme: dark at zoom 1 until set_theme() is called. The reference stays valid, its
/// content changes with set_theme(), which then sends each widget QEvent::StyleChange.
/// [GUI thread]
[[nodiscard]] const Theme& theme();

/// Counts up with set_theme(). Widgets that keep lengths, fonts or colours compare it in
/// changeEvent(), whatever the event. [GUI thread]
[[nodiscard]] int theme_revision();

/// Makes it current and applies style, palette, fonts and style sheet. [GUI thread]
void set_theme(QApplication& application, const Theme& wanted);

/// Gives a widget a font of the theme, at every zoom: use_font(*label, &Theme::heading). [GUI
/// thread]
void use_font(QWidget& widget, QFont Theme::*font, bool is_bold = false);

/// The style sheet of standard widgets. Own painters read theme() instead.
[[nodiscard]] QString style_sheet(const Theme& theme);

}  // namespace robomosp::viewer
