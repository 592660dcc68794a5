// SPDX-License-Identifier: GPL-3.0-or-later
// Buttons and columns that fields with parts share (layer: GUI).
#pragma once

#include <QString>

class QPushButton;
class QToolButton;
class QVBoxLayout;
class QWidget;

namespace robomosp::viewer {

/// A button of an icon, as high as a field.
QToolButton* small_button(QWidget* parent, const char* symbol, const QString& tip,
                          const QString& name);
/// A button that looks like a link.
QPushButton* link_button(QWidget* parent, const QString& text, const QString& tip,
                         const QString& name);
/// The layout of a widget with parts below each other.
QVBoxLayout* column_of(QWidget* widget);

}  // namespace robomosp::viewer
