// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/desktop/timeline.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <utility>

#include <QComboBox>
#include <QEvent>
#include <QHBoxLayout>
#include <QKeyEvent>
#include <QLabel>
#include <QMouseEvent>
#include <QPainter>
#include <QSignalBlocker>
#include <QToolButton>
#include <QVBoxLayout>

#include "viewer/desktop/actions.h"
#include "viewer/theme/theme.h"

namespace robomosp::viewer {
namespace {

constexpr std::array<double, 6> kSpeeds{0.1, 0.25, 0.5, 1, 2, 4};

QString seconds_text(double t) { return QString::number(t, 'f', 3) + " s"; }

/// A distance between ticks of 1, 2 or 5 times a power of ten that leaves `px` between them.
double tick_step(double per_px, double px) {
  const double least = per_px * px;
  const double power = std::pow(10.0, std::floor(std::log10(std::max(least, 1e-9))));
  for (const double by : {1.0, 2.0, 5.0, 10.0})
    if (by * power >= least) return by * power;
  return 10 * power;
}

}  // namespace

TimeRuler::TimeRuler(QWidget* parent) : QWidget(parent) {
  setObjectName("time_ruler");
  setAccessibleName("Time");
  setToolTip("Drag to move the time; Left and Right step, Home and End jump");
  setFocusPolicy(Qt::StrongFocus);
  setMouseTracking(false);
}

void TimeRuler::set_player(Player* player) {
  player_ = player;
  update();
}

QSize TimeRuler::sizeHint() const { return {theme().px(300), theme().px(46)}; }

double TimeRuler::time_at(double x) const {
  if (!player_ || !player_->has_motion()) return 0;
  const double margin = theme().px(24), length = std::max(1.0, width() - 2 * margin);
  return player_->from() +
         (player_->to() - player_->from()) * std::clamp((x - margin) / length, 0.0, 1.0);
}

double TimeRuler::x_of(double time) const {
  if (!player_ || !player_->has_motion()) return 0;
  const double margin = theme().px(24), length = std::max(1.0, width() - 2 * margin);
  return margin + length * (time - player_->from()) / (player_->to() - player_->from());
}

void TimeRuler::paintEvent(QPaintEvent*) {
  const Theme& t = theme();
  QPainter p(this);
  p.fillRect(rect(), t.panel);
  p.setFont(t.mono);
  const int ruler = t.px(22);
  if (!player_ || !player_->has_motion()) {
    p.setFont(t.ui);
    p.setPen(t.text_quiet);
    p.drawText(rect().adjusted(t.gap, 0, 0, 0), Qt::AlignVCenter,
               "No motion. Open a world with a trajectory, or double-click a recording.");
    return;
  }
  p.setPen(t.line);
  p.drawLine(0, ruler, width(), ruler);
  const double length = player_->to() - player_->from();
  const double step = tick_step(length / std::max(1, width()), t.px(70));
  for (double at = std::ceil(player_->from() / step) * step; at <= player_->to() + 1e-9 * length;
       at += step) {
    const int x = static_cast<int>(std::lround(x_of(at)));
    p.setPen(t.line);
    p.drawLine(x, ruler - t.px(5), x, ruler);
    p.setPen(t.text_quiet);
    p.drawText(QRect(x - t.px(40), 0, t.px(80), ruler - t.px(4)), Qt::AlignCenter,
               QString::number(at, 'g', 4));
  }
  const QRect band(static_cast<int>(x_of(player_->from())), ruler + t.px(8),
                   static_cast<int>(x_of(player_->to()) - x_of(player_->from())), t.px(8));
  p.fillRect(band, t.field);
  p.fillRect(QRect(band.topLeft(),
                   QSize(static_cast<int>(x_of(player_->time())) - band.left(), band.height())),
             t.selection);
  const double x = x_of(player_->time());
  const QString flag = QString::number(player_->time(), 'f', 3);
  const int flag_width = QFontMetrics(t.mono).horizontalAdvance(flag) + t.gap;
  const int flag_left =
      std::clamp(static_cast<int>(x) - flag_width / 2, 0, std::max(0, width() - flag_width));
  p.setPen(t.accent);
  p.drawLine(QPointF(x, ruler - t.px(4)), QPointF(x, height()));
  p.setPen(Qt::NoPen);
  p.setBrush(t.accent_fill);
  p.drawRoundedRect(QRect(flag_left, t.px(2), flag_width, ruler - t.px(6)), t.radius, t.radius);
  p.setPen(t.on_accent);
  p.drawText(QRect(flag_left, t.px(2), flag_width, ruler - t.px(6)), Qt::AlignCenter, flag);
  if (hasFocus()) {
    p.setPen(QPen(t.accent, 1));
    p.setBrush(Qt::NoBrush);
    p.drawRect(rect().adjusted(0, 0, -1, -1));
  }
}

void TimeRuler::scrub(double x) {
  if (!player_) return;
  player_->play(false);
  player_->set_time(time_at(x));
}

void TimeRuler::mousePressEvent(QMouseEvent* event) {
  if (event->button() == Qt::LeftButton) scrub(event->position().x());
}

void TimeRuler::mouseMoveEvent(QMouseEvent* event) {
  if (event->buttons().testFlag(Qt::LeftButton)) scrub(event->position().x());
}

void TimeRuler::keyPressEvent(QKeyEvent* event) {
  if (!player_ || !player_->has_motion()) return QWidget::keyPressEvent(event);
  const double step = (player_->to() - player_->from()) / 100;
  switch (event->key()) {
    case Qt::Key_Left: player_->set_time(player_->time() - step); break;
    case Qt::Key_Right: player_->set_time(player_->time() + step); break;
    case Qt::Key_Home: player_->set_time(player_->from()); break;
    case Qt::Key_End: player_->set_time(player_->to()); break;
    default: QWidget::keyPressEvent(event); return;
  }
  event->accept();
}

Timeline::Timeline(const Actions& actions, QWidget* parent)
    : QWidget(parent),
      ruler_(new TimeRuler),
      readout_(new QLabel),
      title_(new QLabel),
      speeds_(new QComboBox) {
  setObjectName("timeline");
  setAccessibleName("Timeline");
  setProperty("ground", "panel");
  auto* row = new QHBoxLayout;
  row->setContentsMargins(8, 4, 8, 4);
  row->setSpacing(4);
  for (const char* name : {"to_start", "step_back", "play", "step_forward", "loop"}) {
    QAction* action = actions.find(name);
    if (!action) continue;
    auto* button = new QToolButton;
    button->setDefaultAction(action);
    button->setObjectName(QString("timeline_") + name);
    button->setAccessibleName(action->text().remove('&'));
    button->setFocusPolicy(Qt::TabFocus);
    row->addWidget(button);
  }
  speeds_->setObjectName("speed");
  speeds_->setAccessibleName("Speed of the playback");
  speeds_->setToolTip("Speed of the playback");
  for (const double s : kSpeeds) speeds_->addItem(QString::number(s) + QChar(0x00D7), s);
  speeds_->setCurrentIndex(3);
  connect(speeds_, &QComboBox::currentIndexChanged, this, [this] {
    if (player_) player_->set_speed(speeds_->currentData().toDouble());
  });
  row->addWidget(speeds_);
  readout_->setObjectName("time");
  readout_->setAccessibleName("Time and duration");
  readout_->setToolTip("Time and duration");
  row->addSpacing(8);
  row->addWidget(readout_);
  row->addStretch(1);
  title_->setObjectName("timeline_title");
  title_->setAccessibleName("Recording");
  title_->setToolTip("The recording that moves the view");
  title_->setProperty("dim", true);
  row->addWidget(title_);
  auto* column = new QVBoxLayout(this);
  column->setContentsMargins(0, 0, 0, 0);
  column->setSpacing(0);
  column->addLayout(row);
  column->addWidget(ruler_);
  column->addStretch(1);
  setFocusProxy(ruler_);
  apply_theme();
  set_player(nullptr);
}

void Timeline::apply_theme() {
  use_font(*readout_, &Theme::mono);
  ruler_->setFixedHeight(theme().px(46));
}

void Timeline::changeEvent(QEvent* event) {
  if (std::exchange(themed_, theme_revision()) != theme_revision()) apply_theme();
  QWidget::changeEvent(event);
}

void Timeline::set_player(Player* player) {
  player_ = player;
  ruler_->set_player(player);
  if (player && !player->property("in_timeline").toBool()) {
    player->setProperty("in_timeline", true);
    player->time_changed.add(this, [this, player](double) {
      if (player == player_) show_time();
    });
    player->state_changed.add(this, [this, player] {
      if (player == player_) show_state();
    });
  }
  show_state();
}

void Timeline::set_title(const QString& title) { title_->setText(title); }

void Timeline::show_state() {
  const bool has_motion = player_ && player_->has_motion();
  speeds_->setEnabled(has_motion);
  if (player_) {
    const QSignalBlocker quiet(speeds_);
    int known = speeds_->findData(player_->speed());
    if (known < 0) {
      speeds_->addItem(QString::number(player_->speed()) + QChar(0x00D7), player_->speed());
      known = speeds_->count() - 1;
    }
    speeds_->setCurrentIndex(known);
  }
  show_time();
}

void Timeline::show_time() {
  readout_->setText(player_ && player_->has_motion()
                        ? seconds_text(player_->time()) + " / " + seconds_text(player_->to())
                        : QString("no motion"));
  ruler_->update();
}

}  // namespace robomosp::viewer
