// SPDX-License-Identifier: GPL-3.0-or-later
// StartSide: the right column of the start page: stories and references (layer: GUI).
#pragma once

#include <functional>
#include <vector>

#include <QWidget>

#include "viewer/desktop/story_panel.h"

class QVBoxLayout;

namespace robomosp::viewer {

class Manual;

/// [GUI thread]
class StartSide : public QWidget {
 public:
  /// `commands` is the number of commands of the program.
  StartSide(const Settings& settings, const Manual& manual, std::size_t commands,
            QWidget* parent = nullptr);

  std::function<void(const Story& story, bool anew)> on_story;
  std::function<void(const QString& page)> on_page;
  void show_ticks();
  /// Within another column it needs no margins.
  void set_within(bool on);

 private:
  const Settings& settings_;
  QVBoxLayout* column_ = nullptr;
  std::vector<StoryCard*> cards_;
};

}  // namespace robomosp::viewer
