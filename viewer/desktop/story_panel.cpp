// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/desktop/story_panel.h"

#include <utility>

#include <QEvent>
#include <QHBoxLayout>
#include <QLabel>
#include <QPainter>
#include <QPixmap>
#include <QPushButton>
#include <QScrollArea>
#include <QVBoxLayout>

#include "viewer/desktop/values.h"
#include "viewer/theme/icons.h"
#include "viewer/theme/theme.h"
#include "viewer/widgets/restyle.h"

namespace robomosp::viewer {
namespace {

QLabel* story_label(const QString& name, const QString& text, QFont Theme::*font,
                    bool is_bold = false) {
  auto* label = new QLabel(text);
  label->setObjectName(name);
  label->setAccessibleName(text.isEmpty() ? name : text);
  label->setToolTip(text);
  label->setWordWrap(true);
  use_font(*label, font, is_bold);
  return label;
}

QPushButton* story_button(const QString& name, const QString& text, const QString& tip) {
  auto* button = new QPushButton(text);
  button->setObjectName(name);
  button->setAccessibleName(text);
  button->setToolTip(tip);
  return button;
}

/// The mark of a step: a filled disc with a tick, a ring in the accent, or a dim ring.
QPixmap tick_pixmap(bool is_done, bool is_current, double ratio) {
  const Theme& t = theme();
  if (is_done) return icon_pixmap("ok", t.ok, t.icon, ratio);
  QPixmap out(QSize(t.icon, t.icon) * ratio);
  out.setDevicePixelRatio(ratio);
  out.fill(Qt::transparent);
  QPainter p(&out);
  p.setRenderHint(QPainter::Antialiasing);
  p.setPen(QPen(is_current ? t.accent : t.field_line, is_current ? t.px(2) : t.px(1)));
  const double edge = t.px(2);
  p.drawEllipse(QRectF(edge, edge, t.icon - 2 * edge, t.icon - 2 * edge));
  return out;
}

QString count_text(std::size_t done, std::size_t all) {
  return QString("%1 of %2 steps").arg(done).arg(all);
}

}  // namespace

StoryStepRow::StoryStepRow(const StoryStep& step, int number, bool is_short, QWidget* parent)
    : QWidget(parent) {
  const QString id = QString::number(number);
  setObjectName("story_step_" + id);
  setAccessibleName(step.title);
  auto* across = new QHBoxLayout(this);
  across->setContentsMargins(0, 2, 0, 2);
  across->setSpacing(8);
  tick_ = story_label("story_tick_" + id, {}, &Theme::ui);
  title_ = story_label("story_title_" + id, step.title, &Theme::ui);
  across->addWidget(tick_, 0, Qt::AlignTop);
  auto* column = new QVBoxLayout;
  column->setContentsMargins(0, 0, 0, 0);
  column->setSpacing(4);
  column->addWidget(title_);
  if (!is_short) {
    how_ = story_label("story_how_" + id, step.how, &Theme::ui);
    how_->setProperty("dim", true);
    column->addWidget(how_);
    QStringList lines;
    for (const std::string& line : step.show) lines += shown(line);
    auto* foot = new QHBoxLayout;
    show_me_ = story_button("story_show_" + id, "Show me",
                            "Run this in the console:\n" + lines.join('\n'));
    more_ = story_button(
        "story_more_" + id, "More",
        "The page about it\nwindow.open{panel = \"help\", page = \"" + step.page + "\"}");
    more_->setProperty("link", true);
    connect(show_me_, &QPushButton::clicked, this, [this] {
      if (on_show_me) on_show_me();
    });
    connect(more_, &QPushButton::clicked, this, [this] {
      if (on_page) on_page();
    });
    foot->addWidget(show_me_);
    foot->addWidget(more_);
    foot->addStretch(1);
    column->addLayout(foot);
  }
  across->addLayout(column, 1);
  apply_theme();
}

void StoryStepRow::show_state(bool is_done, bool is_current) {
  is_done_ = is_done;
  is_current_ = is_current;
  apply_theme();
}

void StoryStepRow::apply_theme() {
  tick_->setPixmap(tick_pixmap(is_done_, is_current_, devicePixelRatioF()));
  tick_->setAccessibleName(is_done_ ? "Done" : is_current_ ? "To do now" : "To do");
  tick_->setToolTip(tick_->accessibleName());
  use_font(*title_, &Theme::ui, is_current_);
  title_->setStyleSheet(
      QString("color: %1;").arg((is_done_ ? theme().text_dim : theme().text).name()));
  for (QWidget* each :
       {static_cast<QWidget*>(how_), static_cast<QWidget*>(show_me_), static_cast<QWidget*>(more_)})
    if (each) each->setVisible(is_current_);
}

void StoryStepRow::changeEvent(QEvent* event) {
  if (std::exchange(themed_, theme_revision()) != theme_revision()) apply_theme();
  QWidget::changeEvent(event);
}

// --- the panel beside the world --------------------------------------------------------------

StoryPanel::StoryPanel(StoryProgress& progress, QWidget* parent)
    : QWidget(parent),
      progress_(progress),
      title_(story_label("story_title", {}, &Theme::heading, true)),
      summary_(story_label("story_summary", {}, &Theme::ui)),
      count_(story_label("story_count", {}, &Theme::ui)),
      steps_(new QVBoxLayout) {
  setObjectName("story");
  setAccessibleName("Story");
  setProperty("ground", "panel");
  auto* area = new QScrollArea;
  area->setObjectName("story_area");
  area->setAccessibleName("Steps of the story");
  area->setToolTip("The steps of the story");
  area->setWidgetResizable(true);
  area->setFrameShape(QFrame::NoFrame);
  area->setHorizontalScrollBarPolicy(Qt::ScrollBarAlwaysOff);
  auto* inside = new QWidget;
  inside->setObjectName("story_steps");
  inside->setAccessibleName("Steps");
  inside->setProperty("ground", "panel");
  auto* column = new QVBoxLayout(inside);
  column->setContentsMargins(12, 12, 12, 12);
  column->setSpacing(8);
  summary_->setProperty("dim", true);
  count_->setProperty("dim", true);
  column->addWidget(title_);
  column->addWidget(summary_);
  column->addLayout(steps_);
  auto* foot = new QHBoxLayout;
  auto* again = story_button("story_again", "Begin again", "All steps are open again");
  auto* leave = story_button("story_leave", "Leave", "Close the story; its ticks are kept");
  connect(again, &QPushButton::clicked, this, [this] {
    if (progress_.story() && on_again) on_again(*progress_.story());
  });
  connect(leave, &QPushButton::clicked, this, [this] {
    if (on_leave) on_leave();
  });
  foot->addWidget(again);
  foot->addWidget(leave);
  foot->addStretch(1);
  foot->addWidget(count_);
  column->addLayout(foot);
  column->addStretch(1);
  area->setWidget(inside);
  auto* outer = new QVBoxLayout(this);
  outer->setContentsMargins(0, 0, 0, 0);
  outer->addWidget(area);
  progress_.changed.add(this, [this] { show_story(); });
  show_story();
}

void StoryPanel::show_story() {
  const Story* story = progress_.story();
  if (story != shown_) {
    shown_ = story;
    for (StoryStepRow* row : std::exchange(rows_, {})) row->deleteLater();
    for (std::size_t i = 0; story && i < story->steps.size(); ++i) {
      auto* row = new StoryStepRow(story->steps[i], static_cast<int>(i) + 1, false);
      row->on_show_me = [this, i] {
        if (shown_ && on_show_me) on_show_me(shown_->steps[i].show);
      };
      row->on_page = [this, i] {
        if (shown_ && on_page) on_page(shown_->steps[i].page);
      };
      steps_->addWidget(row);
      rows_.push_back(row);
    }
  }
  title_->setText(story ? story->title : QString("No story"));
  summary_->setText(!story ? QString("The start page has three stories.")
                    : progress_.done() == story->steps.size()
                        ? QString("All steps are done.")
                        : story->summary + QString(" About %1 min.").arg(story->minutes));
  count_->setText(story ? count_text(progress_.done(), story->steps.size()) : QString());
  for (std::size_t i = 0; i < rows_.size(); ++i)
    rows_[i]->show_state(progress_.is_done(i), i == progress_.current());
}

// --- a card of the start page ----------------------------------------------------------------

StoryCard::StoryCard(const Story& story, QWidget* parent)
    : QFrame(parent), story_(story), begin_(nullptr), count_(nullptr) {
  setObjectName("story_card_" + story.id);
  setAccessibleName(story.title);
  setProperty("card", true);
  auto* column = new QVBoxLayout(this);
  column->setContentsMargins(12, 12, 12, 12);
  column->setSpacing(4);
  auto* head = new QHBoxLayout;
  head->addWidget(story_label("story_card_title_" + story.id, story.title, &Theme::menu, true), 1);
  auto* minutes = story_label("story_card_minutes_" + story.id,
                              QString("%1 min").arg(story.minutes), &Theme::ui);
  minutes->setProperty("dim", true);
  minutes->setWordWrap(false);
  head->addWidget(minutes);
  column->addLayout(head);
  auto* summary = story_label("story_card_summary_" + story.id, story.summary, &Theme::ui);
  summary->setProperty("dim", true);
  column->addWidget(summary);
  int number = 0;
  for (const StoryStep& step : story.steps) {
    rows_.push_back(new StoryStepRow(step, ++number, true));
    column->addWidget(rows_.back());
  }
  auto* foot = new QHBoxLayout;
  begin_ = story_button("story_begin_" + story.id, "Start", "Show its steps beside the world");
  begin_->setIcon(icon("play"));
  connect(begin_, &QPushButton::clicked, this, [this] {
    if (on_begin) on_begin(story_, !is_begun_);
  });
  count_ = story_label("story_card_count_" + story.id, {}, &Theme::ui);
  count_->setProperty("dim", true);
  count_->setWordWrap(false);
  foot->addWidget(begin_);
  foot->addStretch(1);
  foot->addWidget(count_);
  column->addLayout(foot);
  show_ticks({});
}

void StoryCard::show_ticks(const std::set<std::size_t>& done) {
  is_begun_ = !done.empty() && done.size() < rows_.size();
  std::size_t current = 0;
  while (done.contains(current)) ++current;
  for (std::size_t i = 0; i < rows_.size(); ++i)
    rows_[i]->show_state(done.contains(i), i == current);
  begin_->setText(is_begun_ ? "Continue" : done.empty() ? "Start" : "Begin again");
  begin_->setAccessibleName(begin_->text() + ": " + story_.title);
  begin_->setProperty("filled", is_begun_);
  restyle(*begin_);
  count_->setText(count_text(done.size(), rows_.size()));
}

}  // namespace robomosp::viewer
