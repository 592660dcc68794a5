// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/desktop/top_bar.h"

#include <algorithm>
#include <utility>

#include <QEvent>
#include <QHBoxLayout>
#include <QMenu>
#include <QMenuBar>
#include <QPainter>
#include <QPushButton>
#include <QToolButton>

#include "viewer/desktop/main_window.h"
#include "viewer/theme/icons.h"
#include "viewer/theme/theme.h"

namespace robomosp::viewer {
namespace {

constexpr double kFindWidth = 296, kShortFindWidth = 150, kFindHeight = 24;  ///< [px of the design]

QString title_of(std::size_t workspace) {
  QString title = kWorkspaceNames[workspace];
  title[0] = title[0].toUpper();
  return title;
}

}  // namespace

/// Looks like a field, as the palette begins with one: icon, words and keys, as many as fit.
class TopBar::Find : public QPushButton {
 public:
  Find() {
    setObjectName("find_command");
    setAccessibleName("Find a command");
    show_keys({});
  }
  void show_keys(const QString& keys) {
    keys_ = keys;
    setToolTip("Find a command, fill its form and run it" +
               (keys.isEmpty() ? QString() : " (" + keys + ")"));
    update();
  }

 protected:
  void paintEvent(QPaintEvent*) override {
    const Theme& t = theme();
    QPainter p(this);
    p.setRenderHint(QPainter::Antialiasing);
    const bool is_lit = hasFocus() || isDown();
    p.setPen(QPen(is_lit         ? t.accent
                  : underMouse() ? t.text_quiet
                                 : t.field_line,
                  hasFocus() ? t.focus_ring : 1));
    p.setBrush(underMouse() ? t.hover : t.field);
    const double inset = hasFocus() ? 1 : 0.5;
    p.drawRoundedRect(QRectF(rect()).adjusted(inset, inset, -inset, -inset), t.radius, t.radius);
    const int middle = (height() - t.icon) / 2;
    const bool is_icon = width() < t.px(kShortFindWidth);
    const int left = is_icon ? (width() - t.icon) / 2 : t.gap;
    p.drawPixmap(left, middle, icon_pixmap("search", t.text_dim, t.icon, devicePixelRatioF()));
    if (is_icon) return;
    int right = width() - t.gap;
    p.setFont(t.small);
    const int keys_width = QFontMetrics(t.small).horizontalAdvance(keys_) + t.gap;
    const int words = QFontMetrics(t.ui).horizontalAdvance("Find a command...");
    const int text_left = left + t.icon + t.gap;
    if (!keys_.isEmpty() && right - keys_width - t.gap >= text_left + words) {
      const QRectF box(right - keys_width, (height() - t.px(16)) / 2.0, keys_width, t.px(16));
      p.setBrush(Qt::NoBrush);
      p.setPen(QPen(t.field_line, 1));
      p.drawRoundedRect(box.adjusted(0.5, 0.5, -0.5, -0.5), t.radius, t.radius);
      p.setPen(t.text_dim);
      p.drawText(box, Qt::AlignCenter, keys_);
      right -= keys_width + t.gap;
    }
    p.setFont(t.ui);
    p.setPen(t.text_dim);
    p.drawText(
        QRect(text_left, 0, right - text_left, height()), Qt::AlignVCenter | Qt::AlignLeft,
        QFontMetrics(t.ui).elidedText("Find a command...", Qt::ElideRight, right - text_left));
  }

 private:
  QString keys_;
};

TopBar::TopBar(QMenuBar& menus, QMenu& spaces, std::size_t workspace)
    : menus_(menus), spaces_(new QWidget(this)), one_(new QToolButton(this)), find_(new Find) {
  setObjectName("top_bar");
  setAccessibleName("Menus and workspaces");
  setProperty("ground", "header");
  setAttribute(Qt::WA_StyledBackground);
  menus_.setParent(this);
  // Their hints change with fonts and texts, after the theme has.
  menus_.installEventFilter(this);
  spaces_->installEventFilter(this);
  spaces_->setObjectName("workspaces");
  spaces_->setAccessibleName("Workspaces");
  auto* row = new QHBoxLayout(spaces_);
  row->setContentsMargins(0, 0, 0, 0);
  row->setSpacing(0);
  for (std::size_t i = 0; i < buttons_.size(); ++i) {
    auto* button = new QToolButton;
    const QString name = kWorkspaceNames[i], title = title_of(i);
    button->setObjectName("workspace_button_" + name);
    button->setText(title);
    button->setAccessibleName("Workspace " + title);
    button->setToolTip(
        QString("%1 (Ctrl+%2)\nwindow.set{workspace = \"%3\"}").arg(title).arg(i + 1).arg(name));
    button->setCheckable(true);
    button->setAutoExclusive(true);
    button->setProperty("workspace", true);
    button->setFocusPolicy(Qt::TabFocus);
    use_font(*button, &Theme::menu);
    connect(button, &QToolButton::clicked, this, [this, i] {
      if (on_workspace) on_workspace(i);
    });
    row->addWidget(button);
    buttons_[i] = button;
  }
  one_->setObjectName("workspace_one");
  one_->setAccessibleName("Workspaces");
  one_->setToolTip("Workspaces (Ctrl+1 to Ctrl+4)\nwindow.set{workspace = ...}");
  one_->setProperty("workspace", true);
  one_->setFocusPolicy(Qt::TabFocus);
  one_->setPopupMode(QToolButton::InstantPopup);
  one_->setMenu(&spaces);
  one_->setToolButtonStyle(Qt::ToolButtonTextBesideIcon);
  one_->hide();
  use_font(*one_, &Theme::menu);
  find_->setParent(this);
  connect(find_, &QPushButton::clicked, this, [this] {
    if (on_find) on_find();
  });
  show_workspace(workspace);
  apply_theme();
}

void TopBar::show_workspace(std::size_t workspace) {
  buttons_[workspace]->setChecked(true);
  one_->setText(title_of(workspace));
  arrange();
}

void TopBar::show_keys(const QString& keys) { find_->show_keys(keys); }

QSize TopBar::sizeHint() const { return {theme().px(900), theme().bar}; }
QSize TopBar::minimumSizeHint() const { return {theme().px(160), theme().bar}; }

void TopBar::resizeEvent(QResizeEvent*) { arrange(); }

void TopBar::changeEvent(QEvent* event) {
  if (std::exchange(themed_, theme_revision()) != theme_revision()) apply_theme();
  QWidget::changeEvent(event);
}

bool TopBar::eventFilter(QObject* object, QEvent* event) {
  switch (event->type()) {
    case QEvent::LayoutRequest:
    case QEvent::FontChange:
    case QEvent::StyleChange:
    case QEvent::ActionAdded:
    case QEvent::ActionRemoved:
      QMetaObject::invokeMethod(
          this, [this] { arrange(); }, Qt::QueuedConnection);
      break;
    default: break;
  }
  return QWidget::eventFilter(object, event);
}

void TopBar::apply_theme() {
  themed_ = theme_revision();
  one_->setIcon(icon("chevron_down"));
  one_->setIconSize(QSize(theme().px(12), theme().px(12)));
  arrange();
}

void TopBar::arrange() {
  const Theme& t = theme();
  // Qt paints no menu that is higher than its bar, as rounded heights of large text may be.
  const int high = std::max(t.bar, menus_.sizeHint().height());
  if (minimumHeight() != high) setFixedHeight(high);
  const int gap = t.gap / 2, all = width();
  const int menus = menus_.sizeHint().width();
  // The present one is bold, and wider than its hint.
  const int four = spaces_->sizeHint().width() + t.px(6);
  const int one = one_->sizeHint().width();
  const int icon_only = t.px(kFindHeight) + t.gap;
  struct Choice {
    int spaces, find;
  };
  const std::array<Choice, 4> choices{{{four, t.px(kFindWidth)},
                                       {four, t.px(kShortFindWidth)},
                                       {four, icon_only},
                                       {one, icon_only}}};
  const auto needed = [&](const Choice& c) { return menus + c.spaces + c.find + 4 * gap; };
  const auto fits = std::find_if(choices.begin(), choices.end(),
                                 [&](const Choice& c) { return needed(c) <= all; });
  const Choice chosen = fits == choices.end() ? choices.back() : *fits;
  const bool has_four = chosen.spaces == four;
  spaces_->setVisible(has_four);
  one_->setVisible(!has_four);
  const int find_x = all - gap - chosen.find;
  const int height_of_find = std::min(high - 2, t.px(kFindHeight));
  find_->setGeometry(find_x, (high - height_of_find) / 2, chosen.find, height_of_find);
  // In the middle of the window, if the menus end before.
  const int menus_width = std::max(0, std::min(menus, find_x - 2 * gap - chosen.spaces));
  menus_.setGeometry(0, 0, menus_width, high);
  const int x = std::clamp((all - chosen.spaces) / 2, std::min(menus_width + gap, find_x),
                           std::max(menus_width + gap, find_x - gap - chosen.spaces));
  if (has_four) spaces_->setGeometry(x, 0, chosen.spaces, high);
  else one_->setGeometry(x, 0, chosen.spaces, high);
}

}  // namespace robomosp::viewer
