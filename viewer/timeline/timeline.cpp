// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/timeline/timeline.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>
#include <utility>

#include <QAbstractItemView>
#include <QComboBox>
#include <QDragEnterEvent>
#include <QEvent>
#include <QFileDialog>
#include <QHBoxLayout>
#include <QLabel>
#include <QMenu>
#include <QMimeData>
#include <QPointer>
#include <QPushButton>
#include <QScrollArea>
#include <QScrollBar>
#include <QSignalBlocker>
#include <QToolButton>
#include <QVBoxLayout>

#include "viewer/desktop/actions.h"
#include "viewer/desktop/dragging.h"
#include "viewer/desktop/settings.h"
#include "viewer/desktop/values.h"
#include "viewer/theme/icons.h"
#include "viewer/theme/theme.h"
#include "viewer/timeline/variables.h"
#include "viewer/widgets/elided.h"

namespace robomosp::viewer {
namespace {

using ioci::Topic;

constexpr double kWordsWidth = 700, kAllButtonsWidth = 480;  ///< of the header [px of the design]
constexpr std::array<double, 8> kSpeeds{-1, -0.25, 0.1, 0.25, 0.5, 1, 2, 4};
constexpr double kLegendWidth = 204, kRightMargin = 14;  ///< [px of the design]
constexpr double kLeastBody = 244;                       ///< of bands and plots [px of the design]
constexpr double kLeastZoomedBody = 72, kLargeZoom = 1.2;  ///< a small screen has no more
constexpr int kLanesAfterMs = 10, kRecordingsAfterMs = 60;

QString seconds_text(double t) { return fixed_number(t, 3); }

QToolButton* tool_button(const char* object_name, const char* icon_name, const QString& text,
                         const QString& name, const QString& tip) {
  auto* button = new QToolButton;
  button->setObjectName(object_name);
  button->setAccessibleName(name);
  button->setToolTip(tip);
  button->setIcon(icon(icon_name));
  button->setText(text);
  button->setToolButtonStyle(text.isEmpty() ? Qt::ToolButtonIconOnly
                                            : Qt::ToolButtonTextBesideIcon);
  button->setFocusPolicy(Qt::TabFocus);
  return button;
}

}  // namespace

Timeline::Timeline(Desk& desk, Settings& settings, const Actions& actions, QWidget* parent)
    : QWidget(parent),
      desk_(desk),
      settings_(settings),
      ruler_(new TimeRuler(axis_)),
      bands_(new BandsView(axis_)),
      lanes_(new PlotLanes(axis_)),
      readout_(new QLabel),
      speeds_(new QComboBox),
      recordings_(new ElidedCombo),
      picker_(new VariablePicker(this)) {
  setObjectName("timeline");
  setAccessibleName("Timeline");
  setToolTip("The recording or live run that moves the view");
  setProperty("ground", "panel");
  setAttribute(Qt::WA_StyledBackground);
  setAcceptDrops(true);
  make_header(actions);
  make_notice();
  body_ = new QWidget;
  body_->setObjectName("timeline_body");
  body_->setAccessibleName("Bands and plots");
  body_->setToolTip("Bands and plots over time");
  scroll_ = new QScrollArea;
  scroll_->setObjectName("timeline_scroll");
  scroll_->setAccessibleName("Bands and plots");
  scroll_->setToolTip("Bands and plots over time");
  scroll_->setFrameShape(QFrame::NoFrame);
  scroll_->setWidgetResizable(true);
  scroll_->setHorizontalScrollBarPolicy(Qt::ScrollBarAlwaysOff);
  scroll_->setFocusPolicy(Qt::NoFocus);
  auto* content = new QWidget;
  content->setObjectName("timeline_content");
  content->setAccessibleName("Bands and plots");
  content->setToolTip("Bands and plots over time");
  content->setProperty("ground", "panel");
  content->setAttribute(Qt::WA_StyledBackground);
  auto* stack = new QVBoxLayout(content);
  stack->setContentsMargins(0, 0, 0, 0);
  stack->setSpacing(0);
  stack->addWidget(bands_);
  stack->addWidget(lanes_, 1);
  scroll_->setWidget(content);
  auto* inside = new QVBoxLayout(body_);
  inside->setContentsMargins(0, 0, 0, 0);
  inside->setSpacing(0);
  inside->addWidget(ruler_);
  inside->addWidget(scroll_, 1);
  cursor_ = new TimeCursor(axis_, body_);
  auto* column = new QVBoxLayout(this);
  column->setContentsMargins(0, 0, 0, 0);
  column->setSpacing(0);
  column->addWidget(header_);
  column->addWidget(notice_);
  column->addWidget(body_, 1);
  setFocusProxy(ruler_);

  scroll_->viewport()->installEventFilter(this);
  connect(scroll_->verticalScrollBar(), &QScrollBar::valueChanged, this, [this] { show_time(); });
  axis_.changed.add(this, [this] { show_time(); });
  lanes_timer_.setSingleShot(true);
  lanes_timer_.setInterval(kLanesAfterMs);
  connect(&lanes_timer_, &QTimer::timeout, this, [this] { show_lanes(); });
  recordings_timer_.setSingleShot(true);
  recordings_timer_.setInterval(kRecordingsAfterMs);
  connect(&recordings_timer_, &QTimer::timeout, this, [this] { fill_recordings(); });
  const auto scrub = [this](double time) {
    if (!player_) return;
    player_->play(false);
    player_->set_time(time);
  };
  lanes_->on_scrub = scrub;
  lanes_->on_remove = [this](int lane) { remove_lane(lane); };
  lanes_->on_move = [this](int lane, int by) { move_lane(lane, by); };
  lanes_->on_menu = [this](int lane, QPoint global) { open_lane_menu(lane, global); };
  bands_->on_scrub = scrub;
  bands_->on_pick = [this](const Band& band, const BandSpan* span) { pick(band, span); };
  picker_->on_choose = [this](std::vector<std::string> columns, bool into) {
    add_columns(columns, into);
  };
  picker_->on_expression = [this](const QString& expression, const QString& name,
                                  const QString& unit) {
    watch_expression(expression, name, unit);
  };
  desk_.events.add(this, [this](const ioci::Event& e) { take(e); });
  desk_.selection_changed.add(this, [this](const QObject*) { show_selected(); });
  is_following_ = settings_.timeline("follow").toBool();
  apply_theme();
  set_player(nullptr);
  show_notice();
}

Timeline::~Timeline() = default;

void Timeline::make_header(const Actions& actions) {
  header_ = new QWidget;
  header_->setObjectName("timeline_header");
  header_->setAccessibleName("Transport");
  header_->setToolTip("Transport, and what is plotted");
  header_->setMinimumWidth(1);  // instead of what all of it needs: see fit_header()
  auto* row = new QHBoxLayout(header_);
  row->setContentsMargins(theme().gap, 0, theme().gap, 0);
  row->setSpacing(theme().px(4));
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
  stop_ = tool_button("timeline_stop", "stop", {}, "Stop the run",
                      "Ends the live run; its rows stay\nrun.stop(id)");
  connect(stop_, &QToolButton::clicked, this, [this] {
    if (driver_) driver_->stop();
  });
  row->addWidget(stop_);
  speeds_->setObjectName("speed");
  speeds_->setAccessibleName("Speed of the playback");
  speeds_->setToolTip("Speed of the playback; negative plays backwards");
  for (const double s : kSpeeds)
    speeds_->addItem(QString::number(s).replace('-', QChar(0x2212)) + QChar(0x00D7), s);
  speeds_->setCurrentIndex(speeds_->findData(1.0));
  connect(speeds_, &QComboBox::currentIndexChanged, this, [this] {
    if (player_) player_->set_speed(speeds_->currentData().toDouble());
  });
  row->addWidget(speeds_);
  readout_->setObjectName("time");
  readout_->setAccessibleName("Time and duration");
  readout_->setToolTip("Time and duration");
  readout_->setSizePolicy(QSizePolicy::Minimum, QSizePolicy::Preferred);
  row->addSpacing(theme().gap);
  row->addWidget(readout_);
  row->addStretch(1);
  recordings_->setObjectName("timeline_recording");
  recordings_->setAccessibleName("Recording");
  recordings_->setToolTip("The recording that moves the view\nrecording.list()");
  recordings_->setMinimumContentsLength(8);
  recordings_->setSizeAdjustPolicy(QComboBox::AdjustToMinimumContentsLengthWithIcon);
  recordings_->setSizePolicy(QSizePolicy::Expanding, QSizePolicy::Fixed);
  connect(recordings_, &QComboBox::activated, this, [this](int index) {
    const QString key = recordings_->itemData(index).toString();
    const qulonglong number = key.section('#', 1).toULongLong();
    if (number > 0 && on_open) on_open(Handle{utf8(key.section('#', 0, 0)), number});
  });
  row->addWidget(recordings_, 4);
  compare_ = tool_button("timeline_compare", "layers", "Compare", "Compare with other recordings",
                         "Draws other recordings over this one, dashed; the legend has the\n"
                         "differences under the cursor");
  compare_->setPopupMode(QToolButton::InstantPopup);
  auto* others = new QMenu(compare_);
  others->setObjectName("compare_menu");
  others->setToolTipsVisible(true);
  compare_->setMenu(others);
  connect(others, &QMenu::aboutToShow, this, [this, others] { fill_compare_menu(*others); });
  row->addWidget(compare_);
  variable_ = tool_button("timeline_variable", "plus", "Variable", "Plot a variable",
                          "Chooses columns of the recording to plot, or computes one\n"
                          "recording.columns(id), recording.watch{...}");
  connect(variable_, &QToolButton::clicked, this, [this] {
    if (data_) picker_->open_below(*variable_, data_->columns());
  });
  row->addWidget(variable_);
  auto* fit = tool_button("timeline_fit", "fit", {}, "Show all of the time",
                          "Shows all of the time (Home in the plots)");
  connect(fit, &QToolButton::clicked, this, [this] { axis_.fit(); });
  row->addWidget(fit);
  more_ = tool_button("timeline_more", "more", {}, "More of the timeline",
                      "Export, runs again, and what else the timeline does");
  more_->setPopupMode(QToolButton::InstantPopup);
  auto* menu = new QMenu(more_);
  menu->setObjectName("timeline_menu");
  menu->setToolTipsVisible(true);
  more_->setMenu(menu);
  connect(menu, &QMenu::aboutToShow, this, [this, menu] { fill_more_menu(*menu); });
  row->addWidget(more_);
}

void Timeline::make_notice() {
  notice_ = new QWidget;
  notice_->setObjectName("timeline_notice");
  notice_->setAccessibleName("Out of date");
  notice_->setToolTip("What changed since the recording was made");
  notice_->setAttribute(Qt::WA_StyledBackground);
  auto* row = new QHBoxLayout(notice_);
  row->setContentsMargins(theme().gap, 0, theme().gap, 0);
  notice_text_ = new QLabel;
  notice_text_->setObjectName("timeline_notice_text");
  notice_text_->setAccessibleName("Changes since the recording was made");
  notice_text_->setToolTip("recording.is_stale(id)");
  notice_text_->setSizePolicy(QSizePolicy::Ignored, QSizePolicy::Preferred);
  refresh_ = new QPushButton("Run again");
  refresh_->setObjectName("timeline_refresh");
  refresh_->setAccessibleName("Run again");
  refresh_->setToolTip(
      "Makes the recording again from the present records, as a job\n"
      "recording.refresh(id)");
  connect(refresh_, &QPushButton::clicked, this, [this] { refresh_recording(); });
  row->addWidget(notice_text_, 1);
  row->addWidget(refresh_);
}

void Timeline::apply_theme() {
  const Theme& t = theme();
  use_font(*readout_, &Theme::mono);
  header_->setFixedHeight(t.bar);
  notice_->setFixedHeight(t.px(28));
  // Bands alone are no plots: the dock grows to show both.
  scroll_->setMinimumHeight(data_ ? t.px(t.zoom > kLargeZoom ? kLeastZoomedBody : kLeastBody) : 0);
  ruler_->setFixedHeight(ruler_->sizeHint().height());
  notice_->setStyleSheet(QString("#timeline_notice { background: %1; } QLabel { color: %2; }")
                             .arg(t.header.name(), t.warn.name()));
  for (QToolButton* button : {stop_, compare_, variable_, more_})
    button->setIconSize(QSize(t.icon, t.icon));
  fit_header();
  place();
}

void Timeline::changeEvent(QEvent* event) {
  if (std::exchange(themed_, theme_revision()) != theme_revision()) apply_theme();
  QWidget::changeEvent(event);
}

void Timeline::resizeEvent(QResizeEvent* event) {
  QWidget::resizeEvent(event);
  fit_header();
  place();
}

bool Timeline::eventFilter(QObject* watched, QEvent* event) {
  if (event->type() == QEvent::Resize && watched == scroll_->viewport()) place();
  return QWidget::eventFilter(watched, event);
}

/// Words and what keys do as well give way where the header is narrow.
void Timeline::fit_header() {
  const Theme& t = theme();
  const bool has_words = width() >= t.px(kWordsWidth), has_all = width() >= t.px(kAllButtonsWidth);
  for (QToolButton* button : {compare_, variable_})
    button->setToolButtonStyle(has_words ? Qt::ToolButtonTextBesideIcon : Qt::ToolButtonIconOnly);
  for (const char* name : {"timeline_to_start", "timeline_step_back", "timeline_step_forward",
                           "timeline_loop", "timeline_fit"})
    if (auto* button = header_->findChild<QToolButton*>(name)) button->setVisible(has_all);
  speeds_->setVisible(has_all);
}

void Timeline::place() {
  const int width = scroll_->viewport()->width();
  axis_.set_place(theme().px(kLegendWidth), width, theme().px(kRightMargin));
  const int top = ruler_->height() - theme().px(3);
  cursor_->setGeometry(0, top, width, std::max(0, body_->height() - top));
  cursor_->raise();
  show_time();
}

void Timeline::set_player(Player* player) {
  if (player_ != player) driver_.reset();
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

void Timeline::set_subject(const Handle& what, const std::optional<Handle>& recording,
                           const std::optional<Handle>& run) {
  what_ = what;
  const std::optional<Handle> source = run ? run : recording;
  if (source && data_ && data_->source() == *source) {
    return drive(run);
  }
  if (!source && !data_) return;
  driver_.reset();
  compared_.clear();
  data_.reset();
  specs_.clear();
  has_specs_ = false;
  is_refreshing_ = is_refresh_wanted_ = false;
  lanes_->show_lanes({});
  bands_->show_bands({});
  if (source) {
    data_ = std::make_unique<RecordingData>(desk_, *source);
    data_->described.add(this, [this] { follow_data(); });
    data_->filled.add(this, [this] {
      bands_->show_bands(data_->bands());
      lanes_timer_.start();
      follow_data();
    });
    drive(run);
  }
  axis_.fit();
  apply_theme();
  show_state();
  show_notice();
  show_selected();
  recordings_timer_.start();
}

void Timeline::drive(const std::optional<Handle>& run) {
  if (!run || driver_ || !player_ || is_starting_) return;
  is_starting_ = true;
  driver_ = std::make_unique<RunDriver>(desk_, *run, *player_);
  is_starting_ = false;
  show_state();
}

void Timeline::follow_data() {
  if (!data_) return;
  if (!has_specs_ && !data_->columns().empty() &&
      (data_->is_run() || !data_->command().empty() || !data_->stale_text().isEmpty()))
    load_specs();
  // A run that was made again may take another time.
  if (const auto range = data_->range(); range && player_ && !data_->is_run() && !is_refreshing_)
    player_->change_range(range->first, range->second);
  show_notice();
}

void Timeline::show_state() {
  const bool has_motion = player_ && player_->has_motion();
  speeds_->setEnabled(has_motion);
  stop_->setVisible(driver_ != nullptr);
  compare_->setEnabled(data_ && !data_->is_run());
  variable_->setEnabled(data_ != nullptr);
  more_->setEnabled(data_ != nullptr);
  if (player_) {
    const QSignalBlocker quiet(speeds_);
    int known = speeds_->findData(player_->speed());
    if (known < 0) {
      speeds_->addItem(
          QString::number(player_->speed()).replace('-', QChar(0x2212)) + QChar(0x00D7),
          player_->speed());
      known = speeds_->count() - 1;
    }
    speeds_->setCurrentIndex(known);
  }
  if (has_motion) axis_.set_range(player_->from(), player_->to());
  else axis_.set_range(0, 0);
  show_time();
}

void Timeline::show_time() {
  const bool has_motion = player_ && player_->has_motion();
  const QString now = has_motion ? seconds_text(player_->time()) : QString("no motion");
  const QString end = has_motion ? " / " + seconds_text(player_->to()) + " s" : QString();
  readout_->setText(now + end);
  // As wide as at the end, so that nothing moves while it plays.
  const qsizetype digits = std::max(now.size(), end.size() - 5) + end.size();
  readout_->setMinimumWidth(QFontMetrics(readout_->font()).horizontalAdvance('0') *
                            static_cast<int>(digits));
  ruler_->update();
  const std::optional<double> time = has_motion ? std::optional(player_->time()) : std::nullopt;
  lanes_->set_cursor(time);
  bands_->set_cursor(time);
  std::vector<TimeCursor::Dot> dots;
  if (time && cursor_) {
    const QPoint to_cursor =
        lanes_->mapTo(body_, QPoint(0, 0)) - QPoint(cursor_->x(), cursor_->y());
    for (const PlotLanes::Mark& mark : lanes_->marks(*time))
      dots.push_back({mark.at + QPointF(to_cursor), mark.colour});
  }
  if (cursor_) cursor_->show_at(time, std::move(dots));
}

void Timeline::show_notice() {
  const bool is_gone = data_ && data_->is_gone();
  const bool is_stale = data_ && data_->is_stale();
  notice_->setVisible(is_gone || (is_stale && !is_following_) || is_refreshing_);
  refresh_->setVisible(!is_gone);
  refresh_->setEnabled(is_stale && data_->can_refresh() && !is_refreshing_);
  QString text;
  if (is_gone) text = data_->is_run() ? "The run was removed." : "The recording was removed.";
  else if (is_refreshing_) text = "Running again…";
  else if (is_stale) text = "Out of date: " + data_->stale_text();
  notice_text_->setText(text);
  notice_text_->setToolTip(text + "\nrecording.is_stale(id)");
  const bool is_dim = is_gone || is_stale || is_refreshing_;
  lanes_->set_dimmed(is_dim);
  bands_->set_dimmed(is_dim);
}

bool Timeline::is_settled() const {
  return !lanes_timer_.isActive() && !recordings_timer_.isActive() && !is_refreshing_ &&
         !(data_ && data_->is_loading()) &&
         std::none_of(compared_.begin(), compared_.end(),
                      [](const auto& each) { return each->is_loading(); });
}

void Timeline::take(const ioci::Event& event) {
  if (event.topic == Topic::recording || event.topic == Topic::run) {
    if (!event.run || !event.run->is_pulse) recordings_timer_.start();
  } else if (event.topic == Topic::change) {
    refresh_if_following();
  }
}

// --- out of date -----------------------------------------------------------------------------

void Timeline::refresh_recording() {
  if (!data_ || data_->is_run() || is_refreshing_) return;
  is_refreshing_ = true;
  show_notice();
  const QPointer<Timeline> self(this);
  desk_.start("recording.refresh", {{"id", data_->source()}}, [self](const Result<Value>& r) {
    if (!self) return;
    self->end_refresh();
    if (!r.ok() && r.error().code != ErrorCode::cancelled) self->desk_.failed(r.error());
  });
}

void Timeline::end_refresh() {
  is_refreshing_ = false;
  follow_data();
  if (std::exchange(is_refresh_wanted_, false)) refresh_if_following();
}

void Timeline::refresh_if_following() {
  if (!is_following_ || !data_ || data_->is_run() || !data_->can_refresh()) return;
  // One at a time: of the edits of a drag only the newest is computed next.
  if (is_refreshing_) {
    is_refresh_wanted_ = true;
    return;
  }
  is_refreshing_ = true;
  lanes_->set_dimmed(true);
  const QPointer<Timeline> self(this);
  (void)desk_.client().start("recording.refresh", {{"id", data_->source()}},
                             [self](const Result<Value>&) {
                               if (self) self->end_refresh();
                             });
}

void Timeline::set_following(bool on) {
  is_following_ = on;
  settings_.set_timeline("follow", on);
  if (on && data_ && data_->is_stale()) refresh_if_following();
  show_notice();
}

// --- bands -----------------------------------------------------------------------------------

void Timeline::pick(const Band& band, const BandSpan* span) {
  if (!data_) return;
  if (!span) {
    if (band.name == "clearance" && !band.is_known)
      desk_.start("recording.compute", {{"id", data_->source()}, {"quantities", "clearance"}});
    return;
  }
  if (player_ && (band.name != "segments" && !band.name.starts_with("grip."))) {
    player_->play(false);
    player_->set_time(span->at);
  }
  if (span->record) {
    desk_.select({{*span->record, span->path}}, this);
  } else if (!span->column.empty() || span->level == "fault" || span->level == "warn") {
    // A limit is the robot's: select it in its world.
    const QPointer<Timeline> self(this);
    const Handle source = data_->source(), what = what_;
    const std::size_t dot = span->column.rfind('.');
    const std::string named = dot == std::string::npos ? "" : span->column.substr(0, dot);
    desk_.ask("recording.list", {}, [self, source, what, named](const Result<Value>& r) {
      if (!self || !r.ok() || what.kind != "world") return;
      for (const Value& v : list_of(*r))
        if (handle_at(map_of(v), "recording") == source) {
          const std::string robot = named.empty() ? text_at(map_of(v), "robot") : named;
          if (!robot.empty()) self->desk_.select({{what, "robots." + robot}}, self);
        }
    });
  }
  if (span->level == "fault" || span->level == "warn" || span->level == "note")
    desk_.noted("t = " + seconds_text(span->at) + " s: " + span->text);
}

void Timeline::show_selected() {
  if (desk_.selection().size() == 1)
    bands_->set_selected(desk_.selection().front().record, desk_.selection().front().path);
  else bands_->set_selected(std::nullopt, {});
}

// --- menus -----------------------------------------------------------------------------------

void Timeline::fill_recordings() {
  const QPointer<Timeline> self(this);
  desk_.ask("recording.list", {}, [self](const Result<Value>& r) {
    if (!self || !r.ok()) return;
    const QSignalBlocker quiet(self->recordings_);
    QComboBox& box = *self->recordings_;
    box.clear();
    const auto add = [&](const Handle& h, const QString& title) {
      box.addItem(icon(h.kind), title + "  #" + QString::number(h.number),
                  shown(h.kind) + "#" + QString::number(h.number));
      if (self->data_ && self->data_->source() == h) box.setCurrentIndex(box.count() - 1);
    };
    if (!self->data_) box.addItem("No recording", QString());
    else if (self->data_->is_run()) add(self->data_->source(), self->data_->title());
    for (const Value& v : list_of(*r))
      if (const auto h = handle_at(map_of(v), "recording"))
        add(*h, shown(text_at(map_of(v), "title")));
    // The list shows whole titles, also below a narrow field.
    box.view()->setMinimumWidth(box.view()->sizeHintForColumn(0) + theme().px(24));
  });
}

void Timeline::fill_compare_menu(QMenu& menu) {
  menu.clear();
  bool has_any = false;
  for (int i = 0; i < recordings_->count(); ++i) {
    const QString key = recordings_->itemData(i).toString();
    if (!key.startsWith("recording#")) continue;
    const Handle other{"recording", key.section('#', 1).toULongLong()};
    if (!data_ || other == data_->source()) continue;
    QAction* entry = menu.addAction(recordings_->itemText(i));
    entry->setObjectName("compare_" + QString::number(other.number));
    entry->setToolTip("Draws it over this one, dashed");
    entry->setCheckable(true);
    entry->setChecked(std::any_of(compared_.begin(), compared_.end(),
                                  [&](const auto& c) { return c->source() == other; }));
    connect(entry, &QAction::triggered, this, [this, other](bool on) { compare(other, on); });
    has_any = true;
  }
  if (!has_any) menu.addAction("There is no other recording")->setEnabled(false);
}

void Timeline::fill_more_menu(QMenu& menu) {
  menu.clear();
  const auto add = [&](const char* name, const QString& text, const QString& tip,
                       std::function<void()> run) {
    QAction* entry = menu.addAction(text);
    entry->setObjectName(name);
    entry->setToolTip(tip);
    connect(entry, &QAction::triggered, this, [run = std::move(run)] { run(); });
    return entry;
  };
  const bool is_recording = data_ && !data_->is_run();
  const auto write = [this](const QString& title, const QString& pattern) {
    auto* dialog = new QFileDialog(this, title, {}, pattern);
    dialog->setObjectName("export_dialog");
    dialog->setAttribute(Qt::WA_DeleteOnClose);
    dialog->setAcceptMode(QFileDialog::AcceptSave);
    dialog->setDefaultSuffix(QString(pattern).remove("*."));
    connect(dialog, &QFileDialog::fileSelected, this,
            [this](const QString& file) { write_file(file); });
    dialog->open();
  };
  for (const auto& [name, text, pattern] :
       {std::tuple{"export_csv", "Write the plotted columns as CSV…", "*.csv"},
        std::tuple{"export_svg", "Write the plots as SVG…", "*.svg"},
        std::tuple{"export_png", "Write the plots as PNG…", "*.png"}})
    add(name, text,
        QString(pattern) == "*.csv" ? "recording.csv{id = ..., file = ..., columns = ...}"
                                    : "recording.plot{id = ..., file = ..., columns = ...}",
        [write, text, pattern] { write(text, pattern); })
        ->setEnabled(is_recording && !specs_.empty());
  add("film", "Write a film…", "recording.video{id = ..., file = ...}", [this] {
    if (on_film) on_film();
  })->setEnabled(data_ != nullptr);
  menu.addSeparator();
  if (driver_) {
    add("run_refresh", "Continue from the time shown",
        "Computes on from there with the present world; later rows are dropped\nrun.refresh(id)",
        [this] {
          desk_.act("run.refresh", {{"id", driver_->run()}});
        });
    add("run_reset", "Restart the run",
        "Computes it again from its beginning with the present world\nrun.reset(id)", [this] {
          desk_.act("run.reset", {{"id", driver_->run()}});
        });
    menu.addSeparator();
  }
  add("run_again", "Run again", "recording.refresh(id)", [this] {
    refresh_recording();
  })->setEnabled(is_recording && data_->can_refresh() && data_->is_stale());
  QAction* follow =
      add("follow_edits", "Run again with each edit",
          "Makes the recording again after each edit, also while a value is dragged", [] {});
  follow->setCheckable(true);
  follow->setChecked(is_following_);
  connect(follow, &QAction::toggled, this, [this](bool on) { set_following(on); });
  menu.addSeparator();
  add("usual_plots", "Usual plots", "Forgets the chosen variables of this kind of recording",
      [this] {
        settings_.set_timeline(lanes_key(), {});
        specs_ = default_lanes();
        want_columns();
      });
}

void Timeline::open_lane_menu(int lane, QPoint global) {
  if (lane < 0 || static_cast<std::size_t>(lane) >= specs_.size()) return;
  auto* menu = new QMenu(this);
  menu->setObjectName("lane_menu");
  menu->setAttribute(Qt::WA_DeleteOnClose);
  const auto add = [&](const char* name, const QString& text, bool is_on,
                       std::function<void()> run) {
    QAction* entry = menu->addAction(text);
    entry->setObjectName(name);
    entry->setEnabled(is_on);
    connect(entry, &QAction::triggered, this, [run = std::move(run)] { run(); });
  };
  const std::size_t count = specs_[static_cast<std::size_t>(lane)].size();
  add("lane_up", "Move up", lane > 0, [this, lane] { move_lane(lane, -1); });
  add("lane_down", "Move down", static_cast<std::size_t>(lane) + 1 < specs_.size(),
      [this, lane] { move_lane(lane, 1); });
  add("lane_split", "A lane for each", count > 1, [this, lane] { split_lane(lane); });
  add("lane_remove", "Remove", true, [this, lane] { remove_lane(lane); });
  menu->popup(global);
}

void Timeline::write_file(const QString& file) {
  if (!data_ || data_->is_run()) return;
  List columns;
  for (const auto& lane : specs_)
    for (const std::string& name : lane)
      if (data_->column(name) &&
          std::find(columns.begin(), columns.end(), Value(name)) == columns.end())
        columns.emplace_back(name);
  Map args{{"id", data_->source()}, {"file", utf8(file)}, {"columns", std::move(columns)}};
  if (axis_.is_zoomed()) {
    args.set("from", axis_.low());
    args.set("to", axis_.high());
  }
  const bool is_table = file.endsWith(".csv");
  if (!is_table && !compared_.empty()) {
    List with;
    for (const auto& other : compared_) with.emplace_back(other->source());
    args.set("with", std::move(with));
  }
  const std::string command = is_table ? "recording.csv" : "recording.plot";
  const QPointer<Timeline> self(this);
  desk_.act(command, std::move(args), [self, file](const Result<Value>& r) {
    if (!self) return;
    if (r.ok()) self->desk_.noted("Written: " + file);
    else self->desk_.failed(r.error());
  });
}

void Timeline::dragEnterEvent(QDragEnterEvent* event) {
  if (data_ && event->mimeData()->hasFormat(kColumnMime)) event->acceptProposedAction();
}

void Timeline::dropEvent(QDropEvent* event) {
  if (!data_) return;
  std::vector<std::string> columns;
  for (const QByteArray& name : event->mimeData()->data(kColumnMime).split('\n'))
    if (!name.isEmpty()) columns.push_back(name.toStdString());
  // On a lane the columns join it; beside the lanes they get one of their own.
  const QPoint at = lanes_->mapFrom(this, event->position().toPoint());
  const bool is_on_lane =
      lanes_->rect().contains(at) && !specs_.empty() && at.x() >= static_cast<int>(axis_.left());
  if (is_on_lane) lanes_->set_current_lane(lanes_->lane_at(at.y()));
  add_columns(columns, is_on_lane);
  event->acceptProposedAction();
}

}  // namespace robomosp::viewer
