// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/desktop/start_page.h"

#include <algorithm>
#include <iterator>
#include <string_view>
#include <tuple>
#include <utility>

#include <QAction>
#include <QCheckBox>
#include <QComboBox>
#include <QDateTime>
#include <QEvent>
#include <QFileInfo>
#include <QGridLayout>
#include <QHBoxLayout>
#include <QKeyEvent>
#include <QLabel>
#include <QLocale>
#include <QPainter>
#include <QPixmap>
#include <QScrollArea>
#include <QVBoxLayout>

#include "viewer/desktop/actions.h"
#include "viewer/desktop/manual.h"
#include "viewer/desktop/settings.h"
#include "viewer/desktop/start_side.h"
#include "viewer/desktop/status_line.h"
#include "viewer/desktop/thumbnails.h"
#include "viewer/desktop/values.h"
#include "viewer/theme/icons.h"
#include "viewer/theme/theme.h"

namespace robomosp::viewer {
namespace {

constexpr double kPictureShape = 0.75;  ///< height by width
constexpr double kFootHeight = 50;      ///< of a card, below its picture [px of the design]
constexpr double kTwoButtons = 250;     ///< width for two beside each other [px of the design]
constexpr const char* kStartKind = "start/kind";

/// Records that the page shows.
struct KindShown {
  const char *kind, *name, *heading, *hint;
};
constexpr KindShown kKindsShown[] = {
    {"world", "Worlds", "Worlds that move", "one click opens one and runs it"},
    {"robot", "Robots", "Robots of the library", "one click opens one"},
    {"object", "Objects", "Objects of the library", "one click opens one"},
    {"solid", "Solids", "Solids of the library", "one click opens one"}};

/// Title and summary of a card. A description of the library begins with a title, "PUMA 560: beside
/// a table" or "ABB IRB 140, standard DH"; without a short one the title is the name.
std::pair<QString, QString> card_texts(const QString& name, const QString& description) {
  constexpr qsizetype kLongestTitle = 30;
  qsizetype end = description.size();
  for (const char* mark : {": ", ". ", ", "}) {
    const qsizetype at = description.indexOf(QLatin1String(mark));
    // Of "Two arms, one tray: a tree" the title ends at the colon.
    if (at > 0 && (mark[0] == ':' ? at <= kLongestTitle : at < end)) end = at;
    if (mark[0] == ':' && end == at) break;
  }
  if (end <= 0 || end > kLongestTitle)
    return {capitalized(QString(name).replace('_', ' ')), description};
  return {description.left(end), capitalized(description.mid(end + 2))};
}

QLabel* heading_label(const QString& text, const char* name, const QFont& font) {
  auto* label = new QLabel(text);
  label->setObjectName(name);
  label->setAccessibleName(text);
  label->setToolTip(text);
  label->setFont(font);
  return label;
}

std::string icon_of_file(const QFileInfo& file) {
  static constexpr std::pair<const char*, const char*> kIcons[] = {
      {"wld", "world"},      {"rbt", "robot"},  {"part", "object"}, {"csg", "solid"},
      {"mtr", "material"},   {"tsk", "task"},   {"prg", "program"}, {"irl", "program"},
      {"tjc", "trajectory"}, {"lua", "console"}};
  for (const auto& [ending, name] : kIcons)
    if (file.suffix() == QLatin1String(ending)) return name;
  return "folder";
}

/// "today 09:41", "yesterday", "18 Nov", "2025-11-18".
QString date_text(const QDateTime& then, const QDateTime& now) {
  const qint64 days = then.date().daysTo(now.date());
  if (days == 0) return "today " + then.toString("HH:mm");
  if (days == 1) return "yesterday";
  static const QLocale english(QLocale::English);
  return days > 0 && days < 300 ? english.toString(then.date(), "d MMM")
                                : then.toString("yyyy-MM-dd");
}

}  // namespace

WorldCard::WorldCard(std::string kind, const QString& name, const QString& description, int number,
                     QWidget* parent)
    : QPushButton(parent), kind_(std::move(kind)), name_(name), number_(number) {
  std::tie(title_, summary_) = card_texts(name, description);
  const QString of = shown(kind_);
  setObjectName((kind_ == "world" ? QString("card_") : "card_" + of + "_") + name);
  setAccessibleName("Open the " + of + " " + name);
  setAccessibleDescription(description);
  setToolTip(description + (description.isEmpty() ? "" : "\n") + act_text() +
             (number <= 9 ? QString(" (%1)").arg(number) : QString()) + "\n" + of + ".get(\"" +
             name + "\")");
  setCursor(Qt::PointingHandCursor);
  QSizePolicy policy(QSizePolicy::Expanding, QSizePolicy::Fixed);
  policy.setHeightForWidth(true);
  setSizePolicy(policy);
}

QString WorldCard::act_text() const { return kind_ == "world" ? "Open and run" : "Open"; }

void WorldCard::set_picture(const QString& file) {
  picture_ = QPixmap(file);
  update();
}

int WorldCard::heightForWidth(int width) const {
  return static_cast<int>(width * kPictureShape) + theme().px(kFootHeight);
}

QSize WorldCard::sizeHint() const { return {theme().px(240), heightForWidth(theme().px(240))}; }

QSize WorldCard::minimumSizeHint() const {
  return {theme().px(150), heightForWidth(theme().px(150))};
}

void WorldCard::paintEvent(QPaintEvent*) {
  const Theme& t = theme();
  QPainter p(this);
  p.setRenderHint(QPainter::Antialiasing);
  p.setRenderHint(QPainter::SmoothPixmapTransform);
  const QRectF frame = QRectF(rect()).adjusted(1, 1, -1, -1);
  p.setBrush(underMouse() ? t.header : t.panel);
  p.setPen(QPen(hasFocus() ? t.accent : underMouse() ? t.field_line : t.line, hasFocus() ? 2 : 1));
  p.drawRoundedRect(frame, t.radius, t.radius);
  const int foot = t.px(kFootHeight), title_height = t.px(28);
  const QRect place(2, 2, width() - 4, height() - foot - 2);
  if (picture_.isNull()) {
    p.fillRect(place, t.field);
    const int size = t.px(32);
    p.drawPixmap(place.center() - QPoint(size / 2, size / 2),
                 icon_pixmap(icon_of_kind(kind_), t.text_quiet, size, devicePixelRatioF()));
  } else {
    const QSize fitted = picture_.size().scaled(place.size(), Qt::KeepAspectRatioByExpanding);
    QRect source(QPoint(), picture_.size());
    const double share = static_cast<double>(place.width()) / fitted.width();
    source.setWidth(static_cast<int>(picture_.width() * std::min(1.0, share)));
    source.moveLeft((picture_.width() - source.width()) / 2);
    p.fillRect(place, t.field);
    p.drawPixmap(place, picture_, source);
  }
  QFont bold = t.menu;
  bold.setWeight(QFont::DemiBold);
  p.setFont(bold);
  p.setPen(t.text);
  const QRect head(t.gap, height() - foot, width() - 2 * t.gap, title_height);
  p.drawText(head, Qt::AlignVCenter | Qt::AlignLeft,
             QFontMetrics(bold).elidedText(title_, Qt::ElideRight, width() - t.px(40)));
  p.setFont(t.ui);
  p.setPen(t.text_dim);
  p.drawText(QRect(t.gap, head.bottom(), head.width(), foot - title_height - t.px(4)),
             Qt::AlignTop | Qt::AlignLeft,
             QFontMetrics(t.ui).elidedText(summary_, Qt::ElideRight, head.width()));
  const QString act = act_text();
  const int title = QFontMetrics(bold).horizontalAdvance(title_);
  if ((hasFocus() || underMouse()) &&
      title + QFontMetrics(t.ui).horizontalAdvance(act) + 3 * t.gap + t.icon < width()) {
    p.setFont(t.ui);
    p.setPen(t.accent);
    p.drawText(head, Qt::AlignVCenter | Qt::AlignRight, act);
    const int x = width() - t.gap - QFontMetrics(t.ui).horizontalAdvance(act) - t.icon - t.px(2);
    p.drawPixmap(
        x, head.top() + (title_height - t.icon) / 2,
        icon_pixmap(kind_ == "world" ? "play" : "external", t.accent, t.icon, devicePixelRatioF()));
  } else if (number_ <= 9) {
    p.setFont(t.small);
    p.setPen(t.text_quiet);
    p.drawText(head, Qt::AlignVCenter | Qt::AlignRight, QString::number(number_));
  }
  // Over the picture, so that the ring is whole.
  if (!hasFocus()) return;
  p.setBrush(Qt::NoBrush);
  p.setPen(QPen(t.accent, t.focus_ring));
  p.drawRoundedRect(frame, t.radius, t.radius);
}

StartPage::StartPage(Desk& desk, Settings& settings, const Actions& actions, Thumbnails& thumbnails,
                     QWidget* parent)
    : QWidget(parent), desk_(desk), settings_(settings), thumbnails_(thumbnails) {
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
    acts_.push_back(button);
  }
  buttons_ = buttons;
  column->addLayout(buttons);
  column->addSpacing(16);
  auto* recent_head = new QHBoxLayout;
  recent_head->addWidget(heading_label("Recent", "start_recent_heading", t.menu));
  recent_head->addStretch(1);
  auto* clear = new QPushButton("Clear");
  clear->setObjectName("start_recent_clear");
  clear->setAccessibleName("Clear the recent files");
  clear->setToolTip("Forget the files of this list; the files stay");
  clear->setProperty("link", true);
  connect(clear, &QPushButton::clicked, this, [this] {
    settings_.forget_recent_files();
    show_recent();
  });
  recent_head->addWidget(clear);
  column->addLayout(recent_head);
  recent_ = new QVBoxLayout;
  recent_->setSpacing(0);
  column->addLayout(recent_);
  column->addStretch(1);
  left_column_ = column;

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
  auto* hint = new ShortLabel("one click opens one and runs it");
  hint->setObjectName("start_worlds_hint");
  hint->setAccessibleName(hint->text());
  hint->setToolTip(hint->text());
  hint->setSizePolicy(QSizePolicy::Ignored, QSizePolicy::Preferred);
  head->addWidget(hint, 1);
  kinds_ = new QComboBox;
  kinds_->setObjectName("start_kind");
  kinds_->setAccessibleName("Kind of the records shown");
  kinds_->setToolTip("Worlds, robots, objects or solids of the library\nlibrary.describe(kind)");
  for (const KindShown& each : kKindsShown) kinds_->addItem(each.name, QString(each.kind));
  const QString kept = settings_.value(kStartKind);
  if (const int at = kinds_->findData(kept); at > 0) {
    kinds_->setCurrentIndex(at);
    kind_ = utf8(kept);
  }
  connect(kinds_, &QComboBox::currentIndexChanged, this,
          [this] { show_kind(utf8(kinds_->currentData().toString())); });
  head->addWidget(kinds_);
  auto* library = new QPushButton("The whole library");
  library->setObjectName("start_library");
  library->setAccessibleName("The whole library");
  library->setToolTip(
      "Robots, objects, solids and materials, in the navigator\n"
      "library.list(kind)");
  library->setProperty("link", true);
  connect(library, &QPushButton::clicked, this, [this] {
    if (on_library) on_library();
  });
  head->addWidget(library);
  worlds->addLayout(head);
  grid_ = new QGridLayout;
  grid_->setSpacing(12);
  worlds->addLayout(grid_);
  auto* foot = new QHBoxLayout;
  auto* keys = heading_label("1 to 9 open a world, Ctrl+Shift+P finds any command, F1 helps",
                             "start_keys", t.ui);
  keys->setProperty("dim", true);
  keys->setWordWrap(true);
  auto* at_start = new QCheckBox("Show this page at the start");
  at_start->setObjectName("start_at_start");
  at_start->setAccessibleName("Show this page at the start");
  at_start->setToolTip("File > Start page shows it at any time");
  at_start->setChecked(settings_.value(kStartHidden) != "true");
  connect(at_start, &QCheckBox::toggled, this,
          [this](bool on) { settings_.set_value(kStartHidden, on ? "" : "true"); });
  foot->addWidget(keys, 1);
  foot->addWidget(at_start);
  worlds->addLayout(foot);
  worlds->addStretch(1);
  auto* area = new QScrollArea;
  area_ = area;
  area->setObjectName("start_area");
  area->setAccessibleName("Worlds");
  area->setToolTip("Worlds to open");
  area->setWidgetResizable(true);
  area->setFrameShape(QFrame::NoFrame);
  area->setHorizontalScrollBarPolicy(Qt::ScrollBarAlwaysOff);
  area->setWidget(middle_);
  auto* across = new QHBoxLayout(this);
  across->setContentsMargins(0, 0, 0, 0);
  across->setSpacing(0);
  left_area_ = new QScrollArea;
  left_area_->setObjectName("start_left_area");
  left_area_->setAccessibleName("New, open, recent");
  left_area_->setToolTip("New records, files to open, recent files");
  left_area_->setWidgetResizable(true);
  left_area_->setFrameShape(QFrame::NoFrame);
  left_area_->setFocusPolicy(Qt::NoFocus);
  left_area_->setHorizontalScrollBarPolicy(Qt::ScrollBarAlwaysOff);
  left_area_->setWidget(left_);
  across->addWidget(left_area_);
  across->addWidget(area, 1);
  const ioci::Application& app = desk_.application();
  side_ = new StartSide(settings_, Manual(app.share / "docs"), app.commands.list().size());
  side_->on_story = [this](const Story& story, bool anew) {
    if (on_story) on_story(story, anew);
  };
  side_->on_page = [this](const QString& page) {
    if (on_page) on_page(page);
  };
  across->addWidget(side_);
  across_ = across;

  thumbnails_.drawn.add(this, [this](const std::string& kind, const std::string& name) {
    for (WorldCard* each : cards_)
      if (each->kind() == kind && utf8(each->name()) == name)
        if (const QString file = thumbnails_.file(kind, name); !file.isEmpty())
          each->set_picture(file);
  });
  ask_kind();
  desk_.ask("recovery.list", {}, *this, [this](const Result<Value>& r) {
    if (r.ok()) take_journals(list_of(*r));
  });
  show_recent();
  apply_theme();
}

StartPage::~StartPage() = default;

void StartPage::apply_theme() {
  const Theme& t = theme();
  setMinimumWidth(std::min(t.px(320), 360));  // the columns adapt
  if (!is_narrow_) side_->setFixedWidth(t.px(400));
  for (const auto& [name, font] :
       {std::pair{"start_title", t.title}, std::pair{"start_subtitle", t.ui},
        std::pair{"start_recent_heading", t.menu}, std::pair{"start_worlds_heading", t.heading},
        std::pair{"start_worlds_hint", t.ui}, std::pair{"start_keys", t.ui}})
    if (auto* label = findChild<QLabel*>(name)) label->setFont(font);
  for (QLabel* date : findChildren<QLabel*>("recent_date")) date->setFont(t.ui);
  for (QPushButton* button : findChildren<QPushButton*>())
    button->setIconSize(QSize(t.icon, t.icon));
  for (QPushButton* act : acts_)
    if (act->property("filled").toBool())
      act->setIcon(icon_pixmap("folder", t.on_accent, t.icon, devicePixelRatioF()));
  columns_ = 0;
  arrange_cards();
  show_pictures();
}

void StartPage::changeEvent(QEvent* event) {
  if (std::exchange(themed_, theme_revision()) != theme_revision()) apply_theme();
  QWidget::changeEvent(event);
}

void StartPage::show_pictures() {
  for (WorldCard* card : cards_)
    if (const QString file = thumbnails_.file(card->kind(), utf8(card->name())); !file.isEmpty())
      card->set_picture(file);
}

void StartPage::show_kind(const std::string& kind) {
  if (kind == kind_) return;
  kind_ = kind;
  settings_.set_value(kStartKind, kind == "world" ? QString() : shown(kind));
  kinds_->setCurrentIndex(kinds_->findData(shown(kind)));
  ask_kind();
}

void StartPage::ask_kind() {
  for (const KindShown& each : kKindsShown)
    if (kind_ == each.kind) {
      for (const auto& [name, text] : {std::pair{"start_worlds_heading", each.heading},
                                       std::pair{"start_worlds_hint", each.hint}})
        if (auto* label = findChild<QLabel*>(name)) {
          label->setText(text);
          label->setAccessibleName(text);
          label->setToolTip(text);
        }
    }
  desk_.ask("library.describe", {{"kind", kind_}, {"digests", true}}, *this,
            [this, kind = kind_](const Result<Value>& r) {
              if (kind_ != kind) return;  // another kind was chosen
              if (!r.ok()) {
                take_records({});
                return desk_.failed(r.error());
              }
              thumbnails_.know(kind, list_of(*r));
              take_records(list_of(*r));
            });
}

void StartPage::take_records(const List& rows) {
  for (WorldCard* card : cards_) {
    grid_->removeWidget(card);
    card->hide();
    card->deleteLater();
  }
  cards_.clear();

  // Those that show most come first.
  static constexpr std::string_view kFirst[] = {
      "pa10_circle", "puma560", "pick_and_place", "welding", "palletising", "dual_arm",
      "panda",       "kr5",     "ur10e",          "cobra600"};
  const auto rank = [](const Value& v) {
    return std::find(std::begin(kFirst), std::end(kFirst), text_at(map_of(v), "name")) -
           std::begin(kFirst);
  };
  List sorted = rows;
  if (kind_ == "world")
    std::stable_sort(sorted.begin(), sorted.end(),
                     [&](const Value& a, const Value& b) { return rank(a) < rank(b); });
  for (const Value& value : sorted) {
    const Map& row = map_of(value);
    auto* card =
        new WorldCard(kind_, shown(text_at(row, "name")), shown(text_at(row, "description")),
                      static_cast<int>(cards_.size()) + 1);
    connect(card, &QPushButton::clicked, this, [this, card] {
      if (card->kind() != "world") {
        if (on_shipped) on_shipped(card->kind(), utf8(card->name()));
      } else if (on_world) {
        on_world(card->name());
      }
    });
    card->installEventFilter(this);
    cards_.push_back(card);
  }
  if (window()->focusWidget() == this) take_focus(Qt::OtherFocusReason);
  columns_ = 0;
  arrange_cards();
  show_pictures();
}

void StartPage::place_side() {
  const bool is_narrow = width() <= left_area_->maximumWidth() + theme().px(400 + 320);
  if (is_narrow == is_narrow_) return;
  is_narrow_ = is_narrow;
  side_->set_within(is_narrow);
  if (is_narrow) {
    side_->setMinimumWidth(0);
    side_->setMaximumWidth(QWIDGETSIZE_MAX);
    left_column_->insertWidget(left_column_->count() - 1, side_, 100);
  } else {
    side_->setFixedWidth(theme().px(400));
    across_->addWidget(side_);
  }
}

void StartPage::arrange_cards() {
  left_area_->setFixedWidth(std::min(theme().px(320), std::max(theme().px(170), width() * 2 / 5)));
  const int across = left_area_->maximumWidth() < theme().px(kTwoButtons) ? 1 : 2;
  for (std::size_t i = 0; i < acts_.size(); ++i)
    buttons_->addWidget(acts_[i], static_cast<int>(i) / across, static_cast<int>(i) % across);
  place_side();
  const int side = is_narrow_ ? 0 : side_->width();
  const int space =
      std::max(200, this->width() - left_area_->maximumWidth() - side - theme().px(14));
  const int columns = std::clamp(space / theme().px(215), 1, 6);
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

/// The page itself has nothing to show a focus on: its first world has.
void StartPage::focusInEvent(QFocusEvent* event) {
  QWidget::focusInEvent(event);
  take_focus(event->reason());
}

void StartPage::take_focus(Qt::FocusReason reason) {
  QWidget* const wanted = cards_.empty() ? static_cast<QWidget*>(this) : cards_.front();
  if (window()->focusWidget() != wanted) wanted->setFocus(reason);
}

/// Arrows go from card to card, as they lie.
bool StartPage::eventFilter(QObject* object, QEvent* event) {
  const auto at = std::find(cards_.begin(), cards_.end(), object);
  if (at == cards_.end() || event->type() != QEvent::KeyPress)
    return QWidget::eventFilter(object, event);
  const auto index = static_cast<int>(at - cards_.begin());
  int to = index;
  switch (static_cast<QKeyEvent*>(event)->key()) {
    case Qt::Key_Left: to = index - 1; break;
    case Qt::Key_Right: to = index + 1; break;
    case Qt::Key_Up: to = index - columns_; break;
    case Qt::Key_Down: to = index + columns_; break;
    case Qt::Key_Home: to = 0; break;
    case Qt::Key_End: to = static_cast<int>(cards_.size()) - 1; break;
    case Qt::Key_Return:
    case Qt::Key_Enter: cards_[static_cast<std::size_t>(index)]->click(); return true;
    default: return false;
  }
  if (to < 0 || to >= static_cast<int>(cards_.size())) return true;
  WorldCard* next = cards_[static_cast<std::size_t>(to)];
  next->setFocus(Qt::TabFocusReason);
  area_->ensureWidgetVisible(next);
  return true;
}

void StartPage::show_recent() {
  while (QLayoutItem* item = recent_->takeAt(0)) {
    delete item->widget();
    delete item;
  }
  int number = 0;
  const QDateTime now = QDateTime::currentDateTime();
  for (const QString& file : settings_.recent_files()) {
    const QFileInfo about(file);
    auto* button = new QPushButton(icon(icon_of_file(about)), about.fileName());
    button->setIconSize(QSize(theme().icon, theme().icon));
    button->setObjectName(QString("recent_%1").arg(++number));
    button->setAccessibleName("Open " + about.fileName());
    button->setToolTip(file + "\nfile.load(\"" + file + "\")");
    button->setProperty("link", true);
    button->setEnabled(about.exists());
    connect(button, &QPushButton::clicked, this, [this, file] {
      if (on_file) on_file(file);
    });
    auto* row = new QWidget;
    row->setObjectName(QString("recent_row_%1").arg(number));
    row->setAccessibleName(about.fileName());
    auto* across = new QHBoxLayout(row);
    across->setContentsMargins(0, 0, 0, 0);
    auto* date = heading_label(about.exists() ? date_text(about.lastModified(), now) : "is gone",
                               "recent_date", theme().ui);
    date->setToolTip(about.absolutePath());
    date->setProperty("dim", true);
    across->addWidget(button);
    across->addStretch(1);
    across->addWidget(date);
    recent_->addWidget(row);
  }
  if (auto* clear = findChild<QPushButton*>("start_recent_clear")) clear->setVisible(number > 0);
  if (number == 0) {
    auto* none = new QLabel("Files you open or save appear here.");
    none->setObjectName("recent_none");
    none->setAccessibleName("No recent files");
    none->setToolTip("Files you open or save appear here");
    none->setProperty("quiet", true);
    recent_->addWidget(none);
  }
}

void StartPage::show_ticks() { side_->show_ticks(); }

void StartPage::take_journals(const List& rows) {
  if (rows.empty()) return;
  const Map& newest = map_of(rows.back());  // the oldest comes first
  journal_ = text_at(newest, "file");
  recovery_text_->setText(QString("<b>Work of %1 was not saved</b><br>%2 records were kept. Open "
                                  "them to look before you decide.")
                              .arg(shown(text_at(newest, "time")).toHtmlEscaped())
                              .arg(whole_at(newest, "records")));
  recovery_->show();
}

}  // namespace robomosp::viewer
