// SPDX-License-Identifier: GPL-3.0-or-later
// NoteBar: a sentence above the views with buttons behind it (layer: GUI).
#pragma once

#include <QString>
#include <QWidget>

class QLabel;
class QPushButton;

namespace robomosp::viewer {

/// Hidden until it is shown. The label is named `<name>_text`. [GUI thread]
class NoteBar : public QWidget {
 public:
  NoteBar(const QString& name, const QString& words, const QString& words_of_text);
  [[nodiscard]] QLabel& text() const { return *text_; }
  QPushButton& add_button(const QString& name, const QString& label, const QString& tip);

 private:
  QLabel* text_;
};

}  // namespace robomosp::viewer
