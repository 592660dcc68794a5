// SPDX-License-Identifier: GPL-3.0-or-later
// StartPage: worlds of the library with pictures, recent files, unsaved work of an earlier run
// (layer: GUI).
#pragma once

#include <functional>
#include <string>
#include <vector>

#include <QProcess>
#include <QPushButton>
#include <QWidget>

#include "viewer/desktop/desk.h"
#include "viewer/theme/theme.h"

class QGridLayout;
class QLabel;
class QVBoxLayout;

namespace robomosp::viewer {

class Actions;
class Settings;

/// A world of the library: its picture and name. [GUI thread]
class WorldCard : public QPushButton {
 public:
  WorldCard(const QString& name, int number, QWidget* parent = nullptr);
  void set_picture(const QString& file);
  [[nodiscard]] const QString& name() const { return name_; }
  [[nodiscard]] QSize sizeHint() const override;
  [[nodiscard]] bool hasHeightForWidth() const override { return true; }
  [[nodiscard]] int heightForWidth(int width) const override;

 protected:
  void paintEvent(QPaintEvent* event) override;

 private:
  QString name_;
  int number_;
  QPixmap picture_;
};

/// [GUI thread]
class StartPage : public QWidget {
 public:
  StartPage(Desk& desk, Settings& settings, const Actions& actions, QWidget* parent = nullptr);
  ~StartPage() override;

  /// Opens a world of the library and plays its motion; set by the window.
  std::function<void(const QString& world)> on_world;
  std::function<void(const QString& file)> on_file;
  /// Restores unsaved work.
  std::function<void(const std::string& journal)> on_restore;

  void show_recent();
  [[nodiscard]] const std::vector<WorldCard*>& cards() const { return cards_; }

 protected:
  void changeEvent(QEvent* event) override;
  void resizeEvent(QResizeEvent* event) override;
  void keyPressEvent(QKeyEvent* event) override;

 private:
  void take_worlds(const List& names);
  void take_journals(const List& rows);
  void arrange_cards();
  void draw_next_picture();
  [[nodiscard]] QString picture_file(const QString& world) const;
  void apply_theme();

  Desk& desk_;
  Settings& settings_;
  QWidget* left_;
  QWidget* middle_;
  QVBoxLayout* recent_;
  QWidget* recovery_;
  QLabel* recovery_text_;
  QGridLayout* grid_;
  std::vector<WorldCard*> cards_;
  std::vector<QString> to_draw_;
  QProcess drawer_;
  QString drawn_world_;
  std::string journal_;
  int columns_ = 0;
  int themed_ = theme_revision();  ///< the theme that it shows
};

}  // namespace robomosp::viewer
