// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/desktop/jobs.h"

#include <cmath>

#include <QHBoxLayout>
#include <QLabel>
#include <QProgressBar>
#include <QScrollArea>
#include <QToolButton>
#include <QVBoxLayout>

#include "viewer/desktop/values.h"
#include "viewer/theme/icons.h"
#include "viewer/theme/theme.h"

namespace robomosp::viewer {
namespace {

constexpr std::size_t kMostRows = 50;

bool is_running(JobState s) { return s == JobState::waiting || s == JobState::running; }

/// Checks of records that the navigator makes for itself are no news.
bool is_own_check(const JobStatus& s) { return s.label.find("fault.list") != std::string::npos; }

QString duration_text(double seconds) {
  return seconds < 60 ? QString::number(seconds, 'f', 1) + " s"
                      : QString("%1 min %2 s")
                            .arg(static_cast<int>(seconds) / 60)
                            .arg(static_cast<int>(seconds) % 60);
}

}  // namespace

JobsPanel::JobsPanel(Desk& desk, QWidget* parent)
    : QWidget(parent), desk_(desk), column_(nullptr), none_(new QLabel("Nothing runs.")) {
  setObjectName("jobs");
  setAccessibleName("Jobs");
  setProperty("ground", "panel");
  auto* area = new QScrollArea;
  area->setObjectName("jobs_area");
  area->setAccessibleName("Jobs");
  area->setToolTip("Commands that take long, with their progress");
  area->setWidgetResizable(true);
  area->setFrameShape(QFrame::NoFrame);
  auto* inside = new QWidget;
  inside->setObjectName("jobs_list");
  inside->setAccessibleName("List of jobs");
  inside->setProperty("ground", "panel");
  column_ = new QVBoxLayout(inside);
  column_->setContentsMargins(0, 0, 0, 0);
  column_->setSpacing(0);
  none_->setObjectName("jobs_none");
  none_->setAccessibleName("No jobs");
  none_->setToolTip("Work that takes long is listed here");
  none_->setProperty("quiet", true);
  none_->setMargin(theme().gap);
  column_->addWidget(none_);
  column_->addStretch(1);
  area->setWidget(inside);
  auto* outer = new QVBoxLayout(this);
  outer->setContentsMargins(0, 0, 0, 0);
  outer->addWidget(area);
  desk_.events.add(this, [this](const ioci::Event& e) {
    if (e.topic == ioci::Topic::job && e.job && !is_own_check(*e.job)) take(*e.job);
  });
}

std::size_t JobsPanel::running() const {
  std::size_t count = 0;
  for (const auto& [id, row] : rows_) count += is_running(row.status.state);
  return count;
}

const JobStatus* JobsPanel::current() const {
  for (auto row = rows_.rbegin(); row != rows_.rend(); ++row)
    if (is_running(row->second.status.state)) return &row->second.status;
  return nullptr;
}

void JobsPanel::cancel(std::uint64_t job) { desk_.act("job.cancel", {{"id", Handle{"job", job}}}); }

void JobsPanel::cancel_all() {
  for (const auto& [id, row] : rows_)
    if (is_running(row.status.state)) cancel(id);
}

void JobsPanel::make_row(Row& row) {
  const QString id = QString::number(row.status.id);
  row.widget = new QWidget;
  row.widget->setObjectName("job_" + id);
  row.widget->setAccessibleName("Job " + shown(row.status.label));
  auto* across = new QHBoxLayout(row.widget);
  across->setContentsMargins(8, 4, 8, 4);
  row.icon = new QLabel;
  row.icon->setObjectName("job_icon_" + id);
  row.icon->setAccessibleName("State");
  row.label = new QLabel;
  row.label->setObjectName("job_label_" + id);
  row.label->setAccessibleName("What runs");
  row.bar = new QProgressBar;
  row.bar->setObjectName("job_bar_" + id);
  row.bar->setAccessibleName("Progress");
  row.bar->setToolTip("Progress");
  row.bar->setRange(0, 1000);
  row.bar->setTextVisible(false);
  row.bar->setFixedWidth(theme().px(160));
  row.state = new QLabel;
  row.state->setObjectName("job_state_" + id);
  row.state->setAccessibleName("Time and progress");
  row.state->setToolTip("Time and progress");
  row.state->setProperty("dim", true);
  row.cancel = new QToolButton;
  row.cancel->setObjectName("job_cancel_" + id);
  row.cancel->setAccessibleName("Cancel");
  row.cancel->setText("Cancel");
  row.cancel->setIcon(icon("close"));
  row.cancel->setToolTip("Cancel\njob.cancel(" + id + ")");
  connect(row.cancel, &QToolButton::clicked, this, [this, job = row.status.id] { cancel(job); });
  across->addWidget(row.icon);
  across->addWidget(row.label, 1);
  across->addWidget(row.bar);
  across->addWidget(row.state);
  across->addWidget(row.cancel);
  column_->insertWidget(0, row.widget);
  row.since.start();
}

void JobsPanel::show_row(Row& row) {
  const Theme& t = theme();
  const JobStatus& s = row.status;
  const double seconds = 1e-3 * static_cast<double>(row.since.elapsed());
  const char* name = s.state == JobState::done        ? "ok"
                     : s.state == JobState::failed    ? "fault"
                     : s.state == JobState::cancelled ? "close"
                                                      : "jobs";
  const QColor colour = s.state == JobState::done     ? t.ok
                        : s.state == JobState::failed ? t.fault
                        : is_running(s.state)         ? t.accent
                                                      : t.text_dim;
  row.icon->setPixmap(icon_pixmap(name, colour, t.icon, devicePixelRatioF()));
  row.icon->setToolTip(shown(to_string(s.state)));
  row.label->setText(shown(s.label) + (s.what.empty() ? QString() : ": " + shown(s.what)));
  row.label->setToolTip(row.label->text());
  row.bar->setVisible(is_running(s.state));
  row.bar->setValue(static_cast<int>(std::lround(1000 * s.fraction)));
  row.cancel->setVisible(is_running(s.state));
  row.state->setText(is_running(s.state) && s.fraction > 0
                         ? QString("%1 %").arg(static_cast<int>(std::lround(100 * s.fraction)))
                         : (is_running(s.state) ? QString() : duration_text(seconds)));
}

void JobsPanel::take(const JobStatus& status) {
  const bool is_new = !rows_.contains(status.id);
  Row& row = rows_[status.id];
  row.status = status;
  if (is_new) make_row(row);
  show_row(row);
  while (rows_.size() > kMostRows && !is_running(rows_.begin()->second.status.state)) {
    delete rows_.begin()->second.widget;
    rows_.erase(rows_.begin());
  }
  none_->setVisible(rows_.empty());
  changed();
}

}  // namespace robomosp::viewer
