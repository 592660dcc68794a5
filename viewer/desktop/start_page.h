// SPDX-License-Identifier: GPL-3.0-or-later
// StartPage: records of the library with pictures, recent files, unsaved work of an earlier run
// (layer: GUI).
#pragma once

#include <functional>
#include <string>
#include <vector>

#include <QPushButton>
#include <QWidget>

#include "viewer/desktop/desk.h"
#include "viewer/theme/theme.h"

class QComboBox;
class QGridLayout;
class QLabel;
class QHBoxLayout;
class QScrollArea;
class QVBoxLayout;

namespace robomosp::viewer {

class Actions;
class Settings;
class StartSide;
class Thumbnails;
struct Story;

/// A record of the library, such as a world: its picture and name. [GUI thread]
class WorldCard : public QPushButton {
 public:
  WorldCard(std::string kind, const QString& name, const QString& description, int number,
            QWidget* parent = nullptr);
  void set_picture(const QString& file);
  [[nodiscard]] const std::string& kind() const { return kind_; }
  [[nodiscard]] const QString& name() const { return name_; }
  [[nodiscard]] bool has_picture() const { return !picture_.isNull(); }
  [[nodiscard]] QSize sizeHint() const override;
  [[nodiscard]] QSize minimumSizeHint() const override;
  [[nodiscard]] bool hasHeightForWidth() const override { return true; }
  [[nodiscard]] int heightForWidth(int width) const override;

 protected:
  void paintEvent(QPaintEvent* event) override;

 private:
  [[nodiscard]] QString act_text() const;

  std::string kind_;
  QString name_, title_, summary_;
  int number_;
  QPixmap picture_;
};

/// [GUI thread]
class StartPage : public QWidget {
 public:
  StartPage(Desk& desk, Settings& settings, const Actions& actions, Thumbnails& thumbnails,
            QWidget* parent = nullptr);
  ~StartPage() override;

  /// Opens a world of the library and plays its motion; set by the window.
  std::function<void(const QString& world)> on_world;
  /// Gets another record of the library, "robot" and "puma560", and opens it.
  std::function<void(const std::string& kind, const std::string& name)> on_shipped;
  std::function<void(const QString& file)> on_file;
  /// Restores unsaved work.
  std::function<void(const std::string& journal)> on_restore;

  /// Begins or continues a story; shows a page of the help; shows the whole library.
  std::function<void(const Story& story, bool anew)> on_story;
  std::function<void(const QString& page)> on_page;
  std::function<void()> on_library;

  /// Gives the focus to the first world, or to the page while it has none.
  void take_focus(Qt::FocusReason reason);
  /// Shows the records of the library of a kind: "world", "robot", "object" or "solid".
  void show_kind(const std::string& kind);
  void show_recent();
  /// The steps of stories that are done.
  void show_ticks();
  [[nodiscard]] const std::vector<WorldCard*>& cards() const { return cards_; }

 protected:
  void changeEvent(QEvent* event) override;
  void resizeEvent(QResizeEvent* event) override;
  void keyPressEvent(QKeyEvent* event) override;
  void focusInEvent(QFocusEvent* event) override;
  bool eventFilter(QObject* object, QEvent* event) override;

 private:
  void ask_kind();
  void take_records(const List& rows);
  void show_pictures();
  void take_journals(const List& rows);
  void arrange_cards();
  /// On a narrow page, the stories are below the recent files.
  void place_side();
  void apply_theme();

  Desk& desk_;
  Settings& settings_;
  QWidget* left_;
  QWidget* middle_;
  QScrollArea *area_, *left_area_;
  StartSide* side_;
  QVBoxLayout* left_column_ = nullptr;
  QHBoxLayout* across_ = nullptr;
  bool is_narrow_ = false;
  QVBoxLayout* recent_;
  QGridLayout* buttons_;
  std::vector<QPushButton*> acts_;  ///< new, open, run
  QWidget* recovery_;
  QLabel* recovery_text_;
  QGridLayout* grid_;
  std::vector<WorldCard*> cards_;
  Thumbnails& thumbnails_;
  QComboBox* kinds_;
  std::string kind_ = "world";
  std::string journal_;
  int columns_ = 0;
  int themed_ = theme_revision();  ///< the theme that it shows
};

}  // namespace robomosp::viewer
