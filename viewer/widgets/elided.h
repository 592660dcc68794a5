// SPDX-License-Identifier: GPL-3.0-or-later
// Buttons, lines and choices that end a text that does not fit with "…" instead of cutting a
// letter; the text itself stays whole (layer: GUI). [GUI thread]
#pragma once

#include <QComboBox>
#include <QLineEdit>
#include <QPushButton>
#include <QToolButton>

namespace robomosp::viewer {

class ElidedButton : public QPushButton {
 public:
  using QPushButton::QPushButton;

 protected:
  void paintEvent(QPaintEvent* event) override;
};

/// With its text beside the icon; narrower than its text if it has to be.
class ElidedToolButton : public QToolButton {
 public:
  using QToolButton::QToolButton;
  [[nodiscard]] QSize minimumSizeHint() const override;

 protected:
  void paintEvent(QPaintEvent* event) override;
};

/// The whole text is there to edit once the line has the focus.
class ElidedLine : public QLineEdit {
 public:
  using QLineEdit::QLineEdit;

 protected:
  void paintEvent(QPaintEvent* event) override;
};

class ElidedCombo : public QComboBox {
 public:
  using QComboBox::QComboBox;

 protected:
  void paintEvent(QPaintEvent* event) override;
};

}  // namespace robomosp::viewer
