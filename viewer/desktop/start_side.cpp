// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/desktop/start_side.h"

#include <QDir>
#include <QHBoxLayout>
#include <QLabel>
#include <QPushButton>
#include <QScrollArea>
#include <QVBoxLayout>

#include <robomosp/sdk/plugin.h>

#include "viewer/desktop/manual.h"
#include "viewer/desktop/settings.h"
#include "viewer/desktop/values.h"
#include "viewer/theme/icons.h"
#include "viewer/theme/theme.h"

namespace robomosp::viewer {

StartSide::StartSide(const Settings& settings, const Manual& manual, std::size_t commands,
                     QWidget* parent)
    : QWidget(parent), settings_(settings) {
  setObjectName("start_side");
  setAccessibleName("Stories, and where to look things up");
  setProperty("ground", "panel");
  setAttribute(Qt::WA_StyledBackground);
  auto* inside = new QWidget;
  inside->setObjectName("start_side_list");
  inside->setAccessibleName("Stories");
  inside->setProperty("ground", "panel");
  column_ = new QVBoxLayout(inside);
  QVBoxLayout* const column = column_;
  set_within(false);
  column->setSpacing(12);
  const auto heading = [&](const QString& text, const char* name, QFont Theme::*font) {
    auto* label = new QLabel(text);
    label->setObjectName(name);
    label->setAccessibleName(text);
    label->setToolTip(text);
    use_font(*label, font, true);
    column->addWidget(label);
  };
  heading("Stories", "start_stories_heading", &Theme::heading);
  for (const Story& story : stories()) {
    auto* card = new StoryCard(story);
    card->on_begin = [this](const Story& s, bool anew) {
      if (on_story) on_story(s, anew);
    };
    cards_.push_back(card);
    column->addWidget(card);
  }
  column->addSpacing(8);
  heading("Look it up", "start_look_up_heading", &Theme::menu);
  const auto row = [&](const char* name, const char* icon_name, const QString& words,
                       const QString& count, const QString& tip, std::function<void()> act) {
    auto* across = new QHBoxLayout;
    auto* button = new QPushButton(icon(icon_name), words);
    button->setObjectName(name);
    button->setAccessibleName(words + ", " + count);
    button->setToolTip(tip);
    button->setProperty("link", true);
    connect(button, &QPushButton::clicked, this, [act = std::move(act)] { act(); });
    auto* label = new QLabel(count);
    label->setObjectName(QString(name) + "_count");
    label->setAccessibleName(count);
    label->setToolTip(count);
    label->setProperty("dim", true);
    across->addWidget(button);
    across->addStretch(1);
    across->addWidget(label);
    column->addLayout(across);
  };
  const auto page = [this](const QString& name) {
    return [this, name] {
      if (on_page) on_page(name);
    };
  };
  const auto page_tip = [](const QString& name) {
    return "window.open{panel = \"help\", page = \"" + name + "\"}";
  };
  row("start_manual", "program", "Manual", QString("%1 chapters").arg(manual.pages("user").size()),
      page_tip("contents"), page("contents"));
  row("start_commands", "console", "Commands", QString("%1, each with an example").arg(commands),
      page_tip("topics"), page("topics"));
  row("start_examples", "play", "Examples",
      QString("%1 scripts to run").arg(manual.script_files().size()), page_tip("examples"),
      page("examples"));
  column->addStretch(1);
  auto* foot = new QHBoxLayout;
  auto* version = new QLabel("Version " RMP_SDK_VERSION);
  version->setObjectName("start_version");
  version->setAccessibleName(version->text());
  version->setToolTip("version()");
  version->setProperty("dim", true);
  foot->addWidget(version);
  foot->addStretch(1);
  column->addLayout(foot);
  auto* area = new QScrollArea;
  area->setObjectName("start_side_area");
  area->setAccessibleName("Stories");
  area->setToolTip("Stories to begin or continue");
  area->setWidgetResizable(true);
  area->setFrameShape(QFrame::NoFrame);
  area->setFocusPolicy(Qt::NoFocus);  // what is in it shows its focus
  area->setHorizontalScrollBarPolicy(Qt::ScrollBarAlwaysOff);
  area->setWidget(inside);
  auto* outer = new QVBoxLayout(this);
  outer->setContentsMargins(0, 0, 0, 0);
  outer->addWidget(area);
  show_ticks();
}

void StartSide::set_within(bool on) {
  if (on) column_->setContentsMargins(0, 0, 12, 0);
  else column_->setContentsMargins(20, 24, 20, 20);
}

void StartSide::show_ticks() {
  for (std::size_t i = 0; i < cards_.size(); ++i)
    cards_[i]->show_ticks(StoryProgress::kept(settings_, stories()[i]));
}

}  // namespace robomosp::viewer
