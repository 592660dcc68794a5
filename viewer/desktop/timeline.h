// SPDX-License-Identifier: GPL-3.0-or-later
// Timeline: the panel with the transport of the recording that the current view shows, and a ruler
// to scrub it (layer: GUI).
#pragma once

#include <QPointer>
#include <QWidget>

#include "viewer/desktop/player.h"
#include "viewer/theme/theme.h"

class QComboBox;
class QLabel;
class QToolButton;

namespace robomosp::viewer {

class Actions;

/// The ruler: a press or drag moves the time; arrow keys, Home and End do, too. [GUI thread]
class TimeRuler : public QWidget {
 public:
  explicit TimeRuler(QWidget* parent = nullptr);
  void set_player(Player* player);
  [[nodiscard]] QSize sizeHint() const override;
  /// The time at a place [s], and back.
  [[nodiscard]] double time_at(double x) const;
  [[nodiscard]] double x_of(double time) const;

 protected:
  void paintEvent(QPaintEvent* event) override;
  void mousePressEvent(QMouseEvent* event) override;
  void mouseMoveEvent(QMouseEvent* event) override;
  void keyPressEvent(QKeyEvent* event) override;

 private:
  void scrub(double x);
  QPointer<Player> player_;
};

/// [GUI thread]
class Timeline : public QWidget {
 public:
  explicit Timeline(const Actions& actions, QWidget* parent = nullptr);
  /// Follows another player; null = of no view.
  void set_player(Player* player);
  void set_title(const QString& title);
  [[nodiscard]] TimeRuler& ruler() const { return *ruler_; }

 protected:
  void changeEvent(QEvent* event) override;

 private:
  void show_state();
  void show_time();
  void apply_theme();

  QPointer<Player> player_;
  TimeRuler* ruler_;
  QLabel *readout_, *title_;
  QComboBox* speeds_;
  int themed_ = theme_revision();  ///< the theme that it shows
};

}  // namespace robomosp::viewer
