// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/desktop/start_page.h"

#include <algorithm>
#include <iterator>
#include <string_view>
#include <utility>

#include <QAction>
#include <QCoreApplication>
#include <QDir>
#include <QEvent>
#include <QFileInfo>
#include <QGridLayout>
#include <QHBoxLayout>
#include <QKeyEvent>
#include <QLabel>
#include <QPainter>
#include <QPixmap>
#include <QScrollArea>
#include <QStandardPaths>
#include <QVBoxLayout>

#include "viewer/desktop/actions.h"
#include "viewer/desktop/settings.h"
#include "viewer/desktop/values.h"
#include "viewer/theme/icons.h"
#include "viewer/theme/theme.h"

namespace robomosp::viewer {
namespace {

constexpr double kPictureShape = 0.75;  ///< height by width
constexpr int kPictureWidth = 480;      ///< of files [px]

QString title_of_world(const QString& name) {
  QString title = name;
  title.replace('_', ' ');
  if (!title.isEmpty()) title[0] = title[0].toUpper();
  return title;
}

QLabel* heading_label(const QString& text, const char* name, const QFont& font) {
  auto* label = new QLabel(text);
  label->setObjectName(name);
  label->setAccessibleName(text);
  label->setToolTip(text);
  label->setFont(font);
  return label;
}

}  // namespace

WorldCard::WorldCard(const QString& name, int number, QWidget* parent)
    : QPushButton(parent), name_(name), number_(number) {
  setObjectName("card_" + name);
  setAccessibleName("Open the world " + name);
  setToolTip("Open and run" + (number <= 9 ? QString(" (%1)").arg(number) : QString()) +
             "\nworld.get(\"" + name + "\")");
  setCursor(Qt::PointingHandCursor);
  QSizePolicy policy(QSizePolicy::Expanding, QSizePolicy::Fixed);
  policy.setHeightForWidth(true);
  setSizePolicy(policy);
}

void WorldCard::set_picture(const QString& file) {
  picture_ = QPixmap(file);
  update();
}

int WorldCard::heightForWidth(int width) const {
  return static_cast<int>(width * kPictureShape) + theme().px(34);
}

QSize WorldCard::sizeHint() const { return {theme().px(240), heightForWidth(theme().px(240))}; }

void WorldCard::paintEvent(QPaintEvent*) {
  const Theme& t = theme();
  QPainter p(this);
  p.setRenderHint(QPainter::Antialiasing);
  p.setRenderHint(QPainter::SmoothPixmapTransform);
  const QRectF frame = QRectF(rect()).adjusted(1, 1, -1, -1);
  p.setBrush(underMouse() ? t.header : t.panel);
  p.setPen(QPen(hasFocus() ? t.accent : underMouse() ? t.field_line : t.line, hasFocus() ? 2 : 1));
  p.drawRoundedRect(frame, t.radius, t.radius);
  const int foot = t.px(34);
  const QRect place(2, 2, width() - 4, height() - foot - 2);
  if (picture_.isNull()) {
    p.fillRect(place, t.field);
    const int size = t.px(32);
    p.drawPixmap(place.center() - QPoint(size / 2, size / 2),
                 icon_pixmap("world", t.text_quiet, size, devicePixelRatioF()));
  } else {
    const QSize fitted = picture_.size().scaled(place.size(), Qt::KeepAspectRatioByExpanding);
    QRect source(QPoint(), picture_.size());
    const double share = static_cast<double>(place.width()) / fitted.width();
    source.setWidth(static_cast<int>(picture_.width() * std::min(1.0, share)));
    source.moveLeft((picture_.width() - source.width()) / 2);
    p.drawPixmap(place, picture_, source);
  }
  QFont bold = t.menu;
  bold.setWeight(QFont::DemiBold);
  p.setFont(bold);
  p.setPen(t.text);
  p.drawText(
      QRect(t.gap, height() - foot, width() - 2 * t.gap, foot), Qt::AlignVCenter | Qt::AlignLeft,
      QFontMetrics(bold).elidedText(title_of_world(name_), Qt::ElideRight, width() - t.px(40)));
  if (number_ <= 9) {
    p.setFont(t.small);
    p.setPen(t.text_quiet);
    p.drawText(QRect(0, height() - foot, width() - t.gap, foot), Qt::AlignVCenter | Qt::AlignRight,
               QString::number(number_));
  }
}

StartPage::StartPage(Desk& desk, Settings& settings, const Actions& actions, QWidget* parent)
    : QWidget(parent), desk_(desk), settings_(settings) {
  setObjectName("start");
  setAccessibleName("Start");
  setProperty("ground", "window");
  setAttribute(Qt::WA_StyledBackground);
  setFocusPolicy(Qt::StrongFocus);
  const Theme& t = theme();

  left_ = new QWidget;
  left_->setObjectName("start_left");
  left_->setAccessibleName("New, open, recent");
  left_->setProperty("ground", "panel");
  left_->setAttribute(Qt::WA_StyledBackground);
  auto* column = new QVBoxLayout(left_);
  column->setContentsMargins(20, 24, 20, 20);
  column->setSpacing(8);
  column->addWidget(heading_label("ROBOMOSP", "start_title", t.title));
  auto* under = heading_label("Model, simulate, program robots", "start_subtitle", t.ui);
  under->setProperty("dim", true);
  column->addWidget(under);
  column->addSpacing(12);
  auto* buttons = new QGridLayout;
  buttons->setSpacing(8);
  int place = 0;
  for (const char* name :
       {"new_world", "new_robot", "new_solid", "new_program", "open", "run_script"}) {
    QAction* action = actions.find(name);
    if (!action) continue;
    auto* button = new QPushButton(action->icon(), action->text().remove('&'));
    button->setObjectName(QString("start_") + name);
    button->setAccessibleName(action->text().remove('&'));
    button->setToolTip(action->toolTip());
    button->setProperty("filled", QString(name) == "open");
    connect(button, &QPushButton::clicked, action, &QAction::trigger);
    buttons->addWidget(button, place / 2, place % 2);
    ++place;
  }
  column->addLayout(buttons);
  column->addSpacing(16);
  column->addWidget(heading_label("Recent", "start_recent_heading", t.menu));
  recent_ = new QVBoxLayout;
  recent_->setSpacing(0);
  column->addLayout(recent_);
  column->addStretch(1);

  recovery_ = new QWidget;
  recovery_->setObjectName("start_recovery");
  recovery_->setAccessibleName("Unsaved work of an earlier run");
  recovery_->setProperty("card", true);
  recovery_->setAttribute(Qt::WA_StyledBackground);
  auto* card = new QVBoxLayout(recovery_);
  recovery_text_ = new QLabel;
  recovery_text_->setObjectName("start_recovery_text");
  recovery_text_->setAccessibleName("What was not saved");
  recovery_text_->setToolTip("What was not saved");
  recovery_text_->setWordWrap(true);
  card->addWidget(recovery_text_);
  auto* choice = new QHBoxLayout;
  auto* restore = new QPushButton("Open recovered");
  restore->setObjectName("start_restore");
  restore->setAccessibleName("Open recovered work");
  restore->setToolTip("Open it\nrecovery.restore{}");
  connect(restore, &QPushButton::clicked, this, [this] {
    if (on_restore) on_restore(journal_);
    recovery_->hide();
  });
  auto* later = new QPushButton("Not now");
  later->setObjectName("start_restore_later");
  later->setAccessibleName("Not now");
  later->setToolTip("Keep it for the next start");
  later->setProperty("link", true);
  connect(later, &QPushButton::clicked, recovery_, &QWidget::hide);
  choice->addWidget(restore);
  choice->addWidget(later);
  choice->addStretch(1);
  card->addLayout(choice);
  recovery_->hide();
  column->addWidget(recovery_);

  middle_ = new QWidget;
  middle_->setObjectName("start_worlds");
  middle_->setAccessibleName("Worlds of the library");
  middle_->setProperty("ground", "window");
  middle_->setAttribute(Qt::WA_StyledBackground);
  auto* worlds = new QVBoxLayout(middle_);
  worlds->setContentsMargins(24, 24, 24, 24);
  worlds->setSpacing(16);
  auto* head = new QHBoxLayout;
  head->addWidget(heading_label("Worlds that move", "start_worlds_heading", t.heading));
  auto* hint = heading_label("one click opens one and runs it", "start_worlds_hint", t.ui);
  hint->setProperty("dim", true);
  head->addWidget(hint);
  head->addStretch(1);
  worlds->addLayout(head);
  grid_ = new QGridLayout;
  grid_->setSpacing(12);
  worlds->addLayout(grid_);
  worlds->addStretch(1);
  auto* area = new QScrollArea;
  area->setObjectName("start_area");
  area->setAccessibleName("Worlds");
  area->setToolTip(QString());
  area->setWidgetResizable(true);
  area->setFrameShape(QFrame::NoFrame);
  area->setWidget(middle_);
  auto* across = new QHBoxLayout(this);
  across->setContentsMargins(0, 0, 0, 0);
  across->setSpacing(0);
  across->addWidget(left_);
  across->addWidget(area, 1);

  connect(&drawer_, &QProcess::finished, this, [this] {
    for (WorldCard* each : cards_)
      if (each->name() == drawn_world_) each->set_picture(picture_file(drawn_world_));
    draw_next_picture();
  });
  desk_.ask("library.list", {{"kind", "world"}}, [this](const Result<Value>& r) {
    if (r.ok()) take_worlds(list_of(*r));
  });
  desk_.ask("recovery.list", {}, [this](const Result<Value>& r) {
    if (r.ok()) take_journals(list_of(*r));
  });
  show_recent();
  apply_theme();
}

StartPage::~StartPage() {
  drawer_.disconnect();
  drawer_.kill();
  drawer_.waitForFinished(1000);
}

void StartPage::apply_theme() {
  const Theme& t = theme();
  left_->setFixedWidth(t.px(320));
  for (const auto& [name, font] :
       {std::pair{"start_title", t.title}, std::pair{"start_subtitle", t.ui},
        std::pair{"start_recent_heading", t.menu}, std::pair{"start_worlds_heading", t.heading},
        std::pair{"start_worlds_hint", t.ui}})
    if (auto* label = findChild<QLabel*>(name)) label->setFont(font);
  for (QPushButton* button : findChildren<QPushButton*>())
    button->setIconSize(QSize(t.icon, t.icon));
  columns_ = 0;
  arrange_cards();
  to_draw_.clear();
  for (WorldCard* card : cards_) {
    const QString file = picture_file(card->name());
    if (QFileInfo::exists(file)) card->set_picture(file);
    else to_draw_.push_back(card->name());
  }
  draw_next_picture();
}

void StartPage::changeEvent(QEvent* event) {
  if (std::exchange(themed_, theme_revision()) != theme_revision()) apply_theme();
  QWidget::changeEvent(event);
}

QString StartPage::picture_file(const QString& world) const {
  return QStandardPaths::writableLocation(QStandardPaths::GenericCacheLocation) +
         "/robomosp/pictures/" + world + ".png";
}

void StartPage::take_worlds(const List& names) {
  // Those that show most come first.
  static constexpr std::string_view kFirst[] = {
      "pa10_circle", "puma560", "pick_and_place", "welding", "palletising", "dual_arm",
      "panda",       "kr5",     "ur10e",          "cobra600"};
  const auto rank = [](const Value& v) {
    const std::string* name = v.as_string();
    return name ? std::find(std::begin(kFirst), std::end(kFirst), *name) - std::begin(kFirst) : 99;
  };
  List sorted = names;
  std::stable_sort(sorted.begin(), sorted.end(),
                   [&](const Value& a, const Value& b) { return rank(a) < rank(b); });
  for (const Value& value : sorted) {
    const std::string* name = value.as_string();
    if (!name) continue;
    auto* card = new WorldCard(shown(*name), static_cast<int>(cards_.size()) + 1);
    connect(card, &QPushButton::clicked, this, [this, card] {
      if (on_world) on_world(card->name());
    });
    cards_.push_back(card);
  }
  columns_ = 0;
  arrange_cards();
  apply_theme();
}

/// Another process draws, one picture at a time and below all else: a world is loaded and made
/// there, so that neither this document nor this memory keeps it.
void StartPage::draw_next_picture() {
  if (drawer_.state() != QProcess::NotRunning || to_draw_.empty()) return;
  if (qEnvironmentVariableIsSet("ROBOMOSP_NO_THUMBNAILS")) return;
  drawn_world_ = to_draw_.front();
  to_draw_.erase(to_draw_.begin());
  const QString file = picture_file(drawn_world_);
  if (!QDir().mkpath(QFileInfo(file).absolutePath())) return;
  const QString size = QString("%1x%2").arg(kPictureWidth).arg(int(kPictureWidth * kPictureShape));
  drawer_.setProcessChannelMode(QProcess::MergedChannels);
  drawer_.start("nice", {"-n", "19", QCoreApplication::applicationFilePath(), drawn_world_,
                         "--still", "--fast", "--size", size, "--render", file});
}

void StartPage::arrange_cards() {
  const int space = std::max(200, this->width() - left_->width() - theme().px(14));
  const int columns = std::clamp(space / theme().px(250), 1, 6);
  const int width = (space - 48 - 12 * (columns - 1)) / columns;
  for (WorldCard* card : cards_) card->setFixedHeight(card->heightForWidth(width));
  if (columns == columns_) return;
  columns_ = columns;
  for (WorldCard* card : cards_) grid_->removeWidget(card);
  for (int i = 0; i < 8; ++i) grid_->setColumnStretch(i, i < columns ? 1 : 0);
  for (std::size_t i = 0; i < cards_.size(); ++i)
    grid_->addWidget(cards_[i], static_cast<int>(i) / columns, static_cast<int>(i) % columns);
}

void StartPage::resizeEvent(QResizeEvent* event) {
  QWidget::resizeEvent(event);
  QMetaObject::invokeMethod(
      this, [this] { arrange_cards(); }, Qt::QueuedConnection);
}

void StartPage::keyPressEvent(QKeyEvent* event) {
  const int number = event->key() - Qt::Key_0;
  if (number >= 1 && number <= 9 && static_cast<std::size_t>(number) <= cards_.size()) {
    cards_[static_cast<std::size_t>(number) - 1]->click();
    return;
  }
  QWidget::keyPressEvent(event);
}

void StartPage::show_recent() {
  while (QLayoutItem* item = recent_->takeAt(0)) {
    delete item->widget();
    delete item;
  }
  int number = 0;
  for (const QString& file : settings_.recent_files()) {
    const QFileInfo about(file);
    auto* button = new QPushButton(about.fileName());
    button->setObjectName(QString("recent_%1").arg(++number));
    button->setAccessibleName("Open " + about.fileName());
    button->setToolTip(file + "\nfile.load(\"" + file + "\")");
    button->setProperty("link", true);
    button->setEnabled(about.exists());
    connect(button, &QPushButton::clicked, this, [this, file] {
      if (on_file) on_file(file);
    });
    recent_->addWidget(button, 0, Qt::AlignLeft);
  }
  if (number == 0) {
    auto* none = new QLabel("Files you open or save appear here.");
    none->setObjectName("recent_none");
    none->setAccessibleName("No recent files");
    none->setToolTip("Files you open or save appear here");
    none->setProperty("quiet", true);
    recent_->addWidget(none);
  }
}

void StartPage::take_journals(const List& rows) {
  if (rows.empty()) return;
  const Map& newest = map_of(rows.front());
  journal_ = text_at(newest, "file");
  recovery_text_->setText(QString("<b>Work of %1 was not saved</b><br>%2 records were kept. Open "
                                  "them to look before you decide.")
                              .arg(shown(text_at(newest, "time")).toHtmlEscaped())
                              .arg(whole_at(newest, "records")));
  recovery_->show();
}

}  // namespace robomosp::viewer
