// SPDX-License-Identifier: GPL-3.0-or-later
// The status bar of the window: texts are shortened where space is missing, never drawn over each
// other (layer: GUI).
#pragma once

#include <QLabel>
#include <QList>
#include <QStatusBar>

namespace robomosp::viewer {

/// A label that shortens its text with an ellipsis; its tool tip then has the whole text.
class ShortLabel : public QLabel {
 public:
  using QLabel::QLabel;
  [[nodiscard]] QSize minimumSizeHint() const override;
  [[nodiscard]] bool is_shortened() const;

 protected:
  void paintEvent(QPaintEvent* event) override;
  bool event(QEvent* event) override;
};

/// Messages end before the permanent widgets, and are repeated in the tool tip. [GUI thread]
class StatusLine : public QStatusBar {
 public:
  explicit StatusLine(QWidget* parent = nullptr);
  /// Adds a permanent widget at the right end.
  void add_end(QWidget* widget);
  /// The text that a message has here, shortened if needed; "" without a message.
  [[nodiscard]] QString message_shown() const;

 protected:
  void showEvent(QShowEvent* event) override;
  void paintEvent(QPaintEvent* event) override;

 private:
  [[nodiscard]] QRect message_place() const;
  QList<QWidget*> ends_;
};

}  // namespace robomosp::viewer
