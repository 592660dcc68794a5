// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/widgets/choice_field.h"

#include <algorithm>

#include <QGuiApplication>
#include <QKeyEvent>
#include <QLabel>
#include <QLineEdit>
#include <QListWidget>
#include <QPointer>
#include <QScreen>
#include <QStyledItemDelegate>
#include <QVBoxLayout>

#include "viewer/theme/icons.h"
#include "viewer/theme/theme.h"

namespace robomosp::viewer {
namespace {

constexpr int kDoc = Qt::UserRole + 1, kWhyNot = Qt::UserRole + 2, kIndex = Qt::UserRole + 3,
              kSwatch = Qt::UserRole + 4;
constexpr int kSwatchRow = 32, kSwatch0 = 28;  // of the design [px]
constexpr std::size_t kMostLooks = 64;

/// The word that a choice sets, if its label is another text.
QString word_of(const FieldChoice& c) {
  const QString word = c.value.as_string() ? qt(*c.value.as_string()) : QString();
  return word == c.label ? QString() : word;
}

/// The word and its description, or why it cannot be chosen.
QString tip_of(const FieldChoice& c) {
  if (!c.why_not.isEmpty()) return c.why_not;
  const QString word = word_of(c);
  return word.isEmpty() || c.doc.isEmpty() ? word + c.doc : word + ": " + c.doc;
}

class ChoiceDelegate : public QStyledItemDelegate {
 public:
  using QStyledItemDelegate::QStyledItemDelegate;
  void paint(QPainter* p, const QStyleOptionViewItem& option,
             const QModelIndex& index) const override {
    const Theme& t = theme();
    const bool is_selected = option.state & QStyle::State_Selected;
    const bool is_hovered = option.state & QStyle::State_MouseOver;
    const bool can_choose = index.data(kWhyNot).toString().isEmpty();
    if (is_selected) {
      p->fillRect(option.rect, t.selection);
      p->fillRect(QRect(option.rect.left(), option.rect.top(), t.px(2), option.rect.height()),
                  t.accent);
    } else if (is_hovered) {
      p->fillRect(option.rect, t.hover);
    }
    QRect room = option.rect.adjusted(t.px(8), 0, -t.px(8), 0);
    if (has_swatches) {
      const int side = t.px(kSwatch0);
      const QColor swatch = index.data(kSwatch).value<QColor>();
      const QRectF place(room.left(), room.center().y() - side / 2.0, side, side);
      if (swatch.isValid()) paint_ball(*p, place, swatch);
      room.setLeft(room.left() + side + t.px(10));
    }
    p->setFont(t.ui);
    p->setPen(can_choose ? t.text : t.disabled);
    const QString label = index.data(Qt::DisplayRole).toString();
    paint_text(*p, room, Qt::AlignVCenter | Qt::AlignLeft, label);
    room.setLeft(room.left() + p->fontMetrics().horizontalAdvance(label) + t.px(16));
    p->setFont(t.small);
    p->setPen(can_choose ? t.text_quiet : t.disabled);
    const QString doc = can_choose ? index.data(kDoc).toString() : index.data(kWhyNot).toString();
    paint_text(*p, room, Qt::AlignVCenter | Qt::AlignRight, doc);
  }
  QSize sizeHint(const QStyleOptionViewItem&, const QModelIndex&) const override {
    return {theme().px(120), has_swatches ? theme().px(kSwatchRow) : theme().row};
  }
  bool has_swatches = false;
};

}  // namespace

void paint_ball(QPainter& painter, const QRectF& place, const QColor& colour) {
  painter.save();
  painter.setRenderHint(QPainter::Antialiasing);
  QRadialGradient light(place.left() + place.width() * 0.35, place.top() + place.height() * 0.3,
                        place.width() * 0.75);
  light.setColorAt(0, colour.lighter(150));
  light.setColorAt(0.45, colour);
  light.setColorAt(1, colour.darker(230));
  painter.setPen(Qt::NoPen);
  painter.setBrush(light);
  painter.drawEllipse(place.adjusted(1, 1, -1, -1));
  painter.restore();
}

ChoicePopup::ChoicePopup(QWidget* parent) : QFrame(parent, Qt::Popup) {
  setObjectName(parent->objectName() + ".list");
  setAccessibleName("Choices of " + parent->accessibleName());
  setAttribute(Qt::WA_DeleteOnClose);
  setProperty("popup", true);
  setToolTip({});
  auto* column = new QVBoxLayout(this);
  column->setContentsMargins(1, 1, 1, 1);
  column->setSpacing(0);
  search_ = new QLineEdit(this);
  search_->setObjectName(objectName() + ".search");
  search_->setAccessibleName("Search the choices");
  search_->setToolTip("Type to narrow the list; Up and Down choose, Enter takes, Escape closes.");
  search_->setPlaceholderText("Search");
  search_->addAction(icon("search"), QLineEdit::LeadingPosition);
  search_->installEventFilter(this);
  list_ = new QListWidget(this);
  list_->setObjectName(objectName() + ".choices");
  list_->setAccessibleName("Choices");
  list_->setToolTip("Click to choose.");
  list_->setItemDelegate(new ChoiceDelegate(list_));
  list_->setFocusPolicy(Qt::NoFocus);
  list_->setUniformItemSizes(true);
  list_->setMouseTracking(true);
  list_->setHorizontalScrollBarPolicy(Qt::ScrollBarAlwaysOff);
  about_ = new QLabel(this);
  about_->setObjectName(objectName() + ".about");
  about_->setAccessibleName("About the choice");
  about_->setToolTip({});
  about_->setWordWrap(true);
  about_->setProperty("quiet", true);
  about_->setContentsMargins(8, 4, 8, 4);
  about_->hide();
  column->addWidget(search_);
  column->addWidget(list_, 1);
  column->addWidget(about_);
  QObject::connect(search_, &QLineEdit::textChanged, this, [this](const QString& text) {
    filter();
    if (on_prefix) on_prefix(text);
  });
  QObject::connect(list_, &QListWidget::itemClicked, this,
                   [this](QListWidgetItem* item) { choose_row(list_->row(item)); });
  QObject::connect(list_, &QListWidget::currentItemChanged, this, [this](QListWidgetItem* item) {
    const QString why = item ? item->data(kWhyNot).toString() : QString();
    about_->setText(why);
    about_->setVisible(!why.isEmpty());
  });
}

void ChoicePopup::open_at(QWidget* field, bool takes_text, const QString& typed) {
  takes_text_ = takes_text;
  const Theme& t = theme();
  search_->setText(typed);
  const int rows = std::clamp<int>(static_cast<int>(choices_.size()), 3, 12);
  const int row = has_swatches_ ? t.px(kSwatchRow) : t.row;
  const QSize size(std::max(field->width(), t.px(300)), row * rows + t.px(28));
  const QRect screen = field->screen()->availableGeometry();
  QPoint at = field->mapToGlobal(QPoint(0, field->height() + 1));
  if (at.y() + size.height() > screen.bottom())
    at.setY(std::max(screen.top(), field->mapToGlobal(QPoint(0, 0)).y() - size.height() - 1));
  if (at.x() + size.width() > screen.right())
    at.setX(std::max(screen.left(), screen.right() - size.width()));
  setGeometry(QRect(at, size));
  show();
  search_->setFocus();
}

void ChoicePopup::show_choices(const std::vector<FieldChoice>& choices,
                               const std::optional<Value>& current) {
  choices_ = choices;
  current_ = current;
  filter();
}

void ChoicePopup::set_has_swatches(bool on) {
  has_swatches_ = on;
  static_cast<ChoiceDelegate*>(list_->itemDelegate())->has_swatches = on;
}

void ChoicePopup::show_look(const Value& choice, const ChoiceLook& look) {
  for (std::size_t i = 0; i < choices_.size(); ++i) {
    if (!(choices_[i].value == choice)) continue;
    choices_[i].swatch = look.swatch;
    if (!look.doc.isEmpty()) choices_[i].doc = look.doc;
    for (int row = 0; row < list_->count(); ++row)
      if (QListWidgetItem* item = list_->item(row);
          item->data(kIndex).toInt() == static_cast<int>(i)) {
        item->setData(kSwatch, look.swatch);
        item->setData(kDoc, choices_[i].doc);
      }
  }
}

void ChoicePopup::filter() {
  const QString typed = search_->text().trimmed();
  list_->clear();
  int first = -1, at = -1;
  for (std::size_t i = 0; i < choices_.size(); ++i) {
    const FieldChoice& c = choices_[i];
    const QString word = word_of(c);
    if (!typed.isEmpty() && !c.label.contains(typed, Qt::CaseInsensitive) &&
        !word.contains(typed, Qt::CaseInsensitive) && !c.doc.contains(typed, Qt::CaseInsensitive))
      continue;
    auto* item = new QListWidgetItem(c.label, list_);
    item->setData(kDoc, c.doc);
    item->setData(kWhyNot, c.why_not);
    item->setData(kIndex, static_cast<int>(i));
    item->setData(kSwatch, c.swatch);
    item->setToolTip(tip_of(c));
    const int row = list_->count() - 1;
    if (first < 0 && c.why_not.isEmpty()) first = row;
    if (!typed.isEmpty() && at < 0 &&
        (c.label.startsWith(typed, Qt::CaseInsensitive) ||
         word.startsWith(typed, Qt::CaseInsensitive)))
      at = row;
    if (typed.isEmpty() && current_ && c.value == *current_) at = row;
  }
  list_->setCurrentRow(at >= 0 ? at : first);
}

void ChoicePopup::choose_row(int row) {
  QListWidgetItem* item = list_->item(row);
  std::optional<Value> chosen;
  if (item) {
    if (!item->data(kWhyNot).toString().isEmpty()) return;
    chosen = choices_[static_cast<std::size_t>(item->data(kIndex).toInt())].value;
  } else if (takes_text_ && !search_->text().trimmed().isEmpty()) {
    chosen = Value(search_->text().trimmed().toStdString());
  }
  if (!chosen) return;
  const auto choose = on_choose;
  close();
  if (choose) choose(*chosen);
}

bool ChoicePopup::eventFilter(QObject* object, QEvent* event) {
  if (object == search_ && event->type() == QEvent::KeyPress) {
    const auto* key = static_cast<QKeyEvent*>(event);
    const int row = list_->currentRow(), last = list_->count() - 1;
    switch (key->key()) {
      case Qt::Key_Down: list_->setCurrentRow(std::min(row + 1, last)); return true;
      case Qt::Key_Up: list_->setCurrentRow(std::max(row - 1, 0)); return true;
      case Qt::Key_PageDown: list_->setCurrentRow(std::min(row + 10, last)); return true;
      case Qt::Key_PageUp: list_->setCurrentRow(std::max(row - 10, 0)); return true;
      case Qt::Key_Return:
      case Qt::Key_Enter: choose_row(row); return true;
      case Qt::Key_Escape: close(); return true;
      default: break;
    }
  }
  return QFrame::eventFilter(object, event);
}

void ChoicePopup::hideEvent(QHideEvent* event) {
  QFrame::hideEvent(event);
  if (on_close) on_close();
}

// ---- the field ----

ChoiceField::ChoiceField(QWidget* parent) : Field(parent) {
  setFocusPolicy(Qt::StrongFocus);
  setSizePolicy(QSizePolicy::Expanding, QSizePolicy::Fixed);
}

void ChoiceField::set_look(Look look) {
  look_ = std::move(look);
  ask_look();
}

void ChoiceField::ask_look() {
  swatch_ = QColor();
  const std::optional<Value>& v = value_ ? value_ : default_;
  if (!look_ || !v || v->is_nil()) return;
  look_(*v, [self = QPointer<ChoiceField>(this), asked = *v](const ChoiceLook& look) {
    if (!self || !self->value_ || !(*self->value_ == asked)) return;
    self->swatch_ = look.swatch;
    self->update();
  });
}

void ChoiceField::set_value(const std::optional<Value>& value) {
  const bool is_other = !(value_ == value);
  value_ = value;
  if (is_other) ask_look();
  setAccessibleDescription(shown_text());
  update();
}

void ChoiceField::set_choices(std::vector<FieldChoice> choices) {
  choices_ = std::move(choices);
  update();
}

void ChoiceField::set_icon(std::string_view icon) {
  icon_ = icon;
  update();
}

QString ChoiceField::shown_text() const {
  if (is_mixed()) return QStringLiteral("several values");
  const std::optional<Value>& v = value_ ? value_ : default_;
  if (!v || v->is_nil()) return {};
  for (const FieldChoice& c : choices_)
    if (c.value == *v) return c.label;
  return qt(v->as_string() ? *v->as_string() : v->text());
}

QSize ChoiceField::sizeHint() const { return {theme().px(120), theme().field_height}; }
QSize ChoiceField::minimumSizeHint() const { return {theme().px(64), theme().field_height}; }

void ChoiceField::paintEvent(QPaintEvent*) {
  const Theme& t = theme();
  QPainter p(this);
  paint_field(p, rect(),
              {is_hovered(), looks_focused() || popup_, !fault().isEmpty(), isEnabled(), false});
  QRect room = rect().adjusted(t.px(6), 0, -t.px(6), 0);
  const double ratio = devicePixelRatioF();
  const int icon_size = t.px(12);
  const QPixmap chevron =
      icon_pixmap("chevron_down", isEnabled() ? t.text_dim : t.disabled, icon_size, ratio);
  p.drawPixmap(room.right() - icon_size + 1, (height() - icon_size) / 2, chevron);
  room.setRight(room.right() - icon_size - t.px(4));
  if (swatch_.isValid() && !is_mixed()) {
    const int size = t.px(16);
    paint_ball(p, QRectF(room.left(), (height() - size) / 2.0, size, size), swatch_);
    room.setLeft(room.left() + size + t.px(5));
  } else if (!icon_.empty()) {
    const int size = t.px(14);
    p.drawPixmap(room.left(), (height() - size) / 2,
                 icon_pixmap(icon_, isEnabled() ? t.text_dim : t.disabled, size, ratio));
    room.setLeft(room.left() + size + t.px(5));
  }
  const QString text = shown_text();
  p.setFont(t.small);
  if (!source().isEmpty()) {
    const int note_width = p.fontMetrics().horizontalAdvance(source());
    if (note_width < room.width() / 2) {
      p.setPen(t.text_quiet);
      p.drawText(room, Qt::AlignVCenter | Qt::AlignRight, source());
      room.setRight(room.right() - note_width - t.px(6));
    }
  }
  p.setFont(t.ui);
  p.setPen(!isEnabled() ? t.disabled : value_ && !is_mixed() ? t.text : t.text_quiet);
  paint_text(p, room, Qt::AlignVCenter | Qt::AlignLeft,
             text.isEmpty() ? QStringLiteral("none") : text);
}

void ChoiceField::choose(const Value& value) {
  value_ = value;
  if (const std::string* text = value.as_string(); text && takes_numbers_) {
    bool is_number = false;
    const qlonglong number = qt(*text).toLongLong(&is_number);
    if (is_number) value_ = Value(static_cast<std::int64_t>(number));
  }
  ask_look();
  set_fault({});
  setAccessibleDescription(shown_text());
  update();
  notify(Stage::changed);
}

void ChoiceField::open_list(const QString& typed) {
  if (!isEnabled() || popup_) return;
  popup_ = new ChoicePopup(this);
  const QPointer<ChoicePopup> popup = popup_;
  popup_->on_close = [this] {
    popup_ = nullptr;
    update();
  };
  popup_->on_choose = [this](const Value& v) {
    setFocus(Qt::PopupFocusReason);
    choose(v);
  };
  const auto ask = [this, popup](const QString& prefix) {
    const int number = ++asked_;
    const QPointer<ChoiceField> self = this;
    ask_(prefix, [self, popup, number](std::vector<FieldChoice> choices) {
      if (!self || !popup || self->asked_ != number) return;
      self->choices_ = std::move(choices);
      popup->show_choices(self->choices_, self->value_);
      self->update();
      if (!self->look_) return;
      for (std::size_t i = 0; i < std::min(self->choices_.size(), kMostLooks); ++i)
        self->look_(self->choices_[i].value,
                    [popup, choice = self->choices_[i].value](const ChoiceLook& look) {
                      if (popup) popup->show_look(choice, look);
                    });
    });
  };
  popup_->set_has_swatches(static_cast<bool>(look_));
  popup_->show_choices(choices_, value_ ? value_ : default_);
  popup_->open_at(this, takes_text_, typed);
  if (ask_) ask({});
  update();
}

void ChoiceField::step(int by) {
  const auto usable = [](const FieldChoice& c) { return c.why_not.isEmpty(); };
  const std::optional<Value>& v = value_ ? value_ : default_;
  int at = -1;
  const int count = static_cast<int>(choices_.size());
  for (int i = 0; i < count; ++i)
    if (v && choices_[static_cast<std::size_t>(i)].value == *v) at = i;
  for (int i = at < 0 && by < 0 ? count - 1 : at + by; i >= 0 && i < count; i += by) {
    const FieldChoice& c = choices_[static_cast<std::size_t>(i)];
    if (!usable(c)) continue;
    choose(c.value);
    return;
  }
}

void ChoiceField::mousePressEvent(QMouseEvent* event) {
  if (event->button() != Qt::LeftButton) return Field::mousePressEvent(event);
  setFocus(Qt::MouseFocusReason);
  open_list();
}

void ChoiceField::keyPressEvent(QKeyEvent* event) {
  switch (event->key()) {
    case Qt::Key_Down:
      if (event->modifiers() & Qt::AltModifier || choices_.empty()) return open_list();
      return step(1);
    case Qt::Key_Up: return step(-1);
    case Qt::Key_Return:
    case Qt::Key_Enter:
      if (event->modifiers() & Qt::ControlModifier) break;
      return open_list();
    case Qt::Key_Space:
    case Qt::Key_F4: return open_list();
    case Qt::Key_Delete:
    case Qt::Key_Backspace:
      if (!may_be_empty_ || !value_) break;
      value_.reset();
      set_fault({});
      update();
      notify(Stage::changed);
      return;
    default: break;
  }
  const QString typed = event->text();
  if (!typed.isEmpty() && typed[0].isPrint() &&
      !(event->modifiers() & (Qt::ControlModifier | Qt::AltModifier)))
    return open_list(typed);
  Field::keyPressEvent(event);
}

}  // namespace robomosp::viewer
