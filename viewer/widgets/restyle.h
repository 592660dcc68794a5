// SPDX-License-Identifier: GPL-3.0-or-later
// Looks of a widget that follow its properties, as the style sheet of the theme has them (layer:
// GUI). [GUI thread]
#pragma once

#include <QLabel>
#include <QString>
#include <QStyle>
#include <QWidget>

namespace robomosp::viewer {

/// Applies the style sheet again, after a property changed that it selects by.
inline void restyle(QWidget& widget) {
  widget.style()->unpolish(&widget);
  widget.style()->polish(&widget);
}

/// Shows a sentence in a label, dim or in the colour of faults; hides the label without one.
inline void show_note(QLabel& label, const QString& text, bool is_fault = false) {
  label.setText(text);
  label.setVisible(!text.isEmpty());
  label.setProperty("dim", !is_fault);
  label.setProperty("fault", is_fault);
  restyle(label);
}

}  // namespace robomosp::viewer
