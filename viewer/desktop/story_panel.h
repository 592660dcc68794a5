// SPDX-License-Identifier: GPL-3.0-or-later
// StoryPanel: the steps of a story beside the world, and its card on the start page (layer: GUI).
#pragma once

#include <functional>
#include <vector>

#include <QFrame>
#include <QString>
#include <QWidget>

#include "viewer/desktop/stories.h"
#include "viewer/theme/theme.h"

class QLabel;
class QPushButton;
class QVBoxLayout;

namespace robomosp::viewer {

/// A step: its tick, its title, and while it is the current one what to do. [GUI thread]
class StoryStepRow : public QWidget {
 public:
  StoryStepRow(const StoryStep& step, int number, bool is_short, QWidget* parent = nullptr);
  void show_state(bool is_done, bool is_current);
  std::function<void()> on_show_me;
  std::function<void()> on_page;

 protected:
  void changeEvent(QEvent* event) override;

 private:
  void apply_theme();
  QLabel *tick_, *title_, *how_ = nullptr;
  QPushButton *show_me_ = nullptr, *more_ = nullptr;
  bool is_done_ = false, is_current_ = false;
  int themed_ = theme_revision();
};

/// The steps of the story that is followed. [GUI thread]
class StoryPanel : public QWidget {
 public:
  explicit StoryPanel(StoryProgress& progress, QWidget* parent = nullptr);

  /// Runs the lines of a step in the console; set by the window.
  std::function<void(const std::vector<std::string>& lines)> on_show_me;
  std::function<void(const QString& page)> on_page;
  /// Begins the story anew, with its world.
  std::function<void(const Story& story)> on_again;
  std::function<void()> on_leave;

 private:
  void show_story();
  StoryProgress& progress_;
  const Story* shown_ = nullptr;
  QLabel *title_, *summary_, *count_;
  QVBoxLayout* steps_;
  std::vector<StoryStepRow*> rows_;
};

/// A story on the start page. [GUI thread]
class StoryCard : public QFrame {
 public:
  explicit StoryCard(const Story& story, QWidget* parent = nullptr);
  void show_ticks(const std::set<std::size_t>& done);
  std::function<void(const Story& story, bool anew)> on_begin;

 private:
  const Story& story_;
  std::vector<StoryStepRow*> rows_;
  QPushButton* begin_;
  QLabel* count_;
  bool is_begun_ = false;
};

}  // namespace robomosp::viewer
