// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/widgets/number_field.h"

#include <algorithm>
#include <cmath>

#include <QAbstractItemView>
#include <QApplication>
#include <QClipboard>
#include <QCompleter>
#include <QContextMenuEvent>
#include <QKeyEvent>
#include <QLineEdit>
#include <QMenu>
#include <QMouseEvent>

#include "kernel/expression.h"
#include "kernel/schema.h"
#include "kernel/text.h"
#include "kernel/units.h"
#include "viewer/theme/theme.h"

namespace robomosp::viewer {
namespace {

constexpr int kDragBegins = 3;  // [px]

/// The power of ten that is at most |v|.
double decade(double v) { return std::pow(10.0, std::floor(std::log10(v) + 1e-9)); }

}  // namespace

NumberField::NumberField(NumberFormat format, QWidget* parent)
    : Field(parent), format_(std::move(format)) {
  if (format_.shown.empty()) format_.shown = format_.unit;
  if (const auto unit = units::parse(format_.shown); unit.ok()) shown_unit_ = *unit;
  setFocusPolicy(Qt::StrongFocus);
  setCursor(Qt::SizeHorCursor);
  setSizePolicy(QSizePolicy::Expanding, QSizePolicy::Fixed);
  if (std::isfinite(format_.min) && std::isfinite(format_.max))
    set_fill_range(format_.min == kPositive ? 0 : format_.min, format_.max);
}

void NumberField::set_value(const std::optional<Value>& value) {
  value_ = value;
  computed_.reset();
  show_value();
}

void NumberField::set_mixed(bool on) {
  Field::set_mixed(on);
  show_value();
}

bool NumberField::place_fault(std::string_view path, const QString& sentence) {
  return Field::place_fault(path, sentence);
}

void NumberField::set_computed(std::optional<double> si) {
  computed_ = si;
  show_value();
}

void NumberField::set_prefix(const QString& prefix, int axis) {
  prefix_ = prefix;
  axis_ = axis;
  update();
}

void NumberField::set_fill_range(double from, double to) {
  fill_from_ = from;
  fill_to_ = to;
  update();
}

const std::optional<Value>& NumberField::effective() const { return value_ ? value_ : default_; }

double NumberField::to_shown(double si) const { return units::from_si(si, shown_unit_); }
double NumberField::from_shown(double shown) const { return units::to_si(shown, shown_unit_); }

std::optional<double> NumberField::number() const {
  const auto& v = effective();
  if (!v) return std::nullopt;
  if (v->is_number()) return v->number();
  if (computed_) return computed_;
  if (v->as_string()) return read(qt(*v->as_string())).number;
  return std::nullopt;
}

bool NumberField::is_expression() const {
  if (!value_ || !value_->as_string()) return false;
  const auto compiled = Expression::compile(*value_->as_string());
  return compiled.ok() && !compiled->names().empty();
}

NumberField::Reading NumberField::read(const QString& text) const {
  Reading out;
  std::string s = text.trimmed().toStdString();
  for (const std::string_view minus = "\u2212"; s.find(minus) != std::string::npos;)
    s.replace(s.find(minus), minus.size(), "-");
  if (s.empty()) return out;
  out.value = Value(s);
  if (format_.takes_infinity) {
    std::string_view bare = s;
    const double sign = bare.starts_with('-') ? -1 : 1;
    if (sign < 0) bare.remove_prefix(1);
    if (bare == "inf" || bare == "infinity" || bare == "∞") {
      out.number = sign * std::numeric_limits<double>::infinity();
      out.value = Value(*out.number);
      return out;
    }
  }
  const auto compiled = Expression::compile(s);
  if (!compiled.ok()) {
    out.fault = qt(compiled.error().sentence());
    return out;
  }
  if (!compiled->names().empty()) {
    if (!format_.takes_expressions)
      out.fault =
          QStringLiteral("\"%1\" is not a number. Type a number%2.")
              .arg(text.trimmed(),
                   format_.unit.empty()
                       ? QString()
                       : QStringLiteral(" with a unit such as %1").arg(unit_text(format_.shown)));
    return out;
  }
  const auto quantity =
      compiled->evaluate([](const Expression::Name&) -> Result<Quantity> { return Quantity{}; });
  if (!quantity.ok()) {
    out.fault = qt(quantity.error().sentence());
    return out;
  }
  const bool has_unit = quantity->dimension != units::Dimension{};
  const auto own = units::parse(format_.unit);
  double si = quantity->value;
  if (!has_unit && own.ok() && own->dimension != units::Dimension{}) {
    si = from_shown(si);
  } else if (own.ok() && !same_kind(quantity->dimension, own->dimension) && !quantity->fits_any) {
    out.fault = QStringLiteral("\"%1\" is %2, but %3 is needed.")
                    .arg(text.trimmed(), qt(units::kind_of(quantity->dimension)),
                         qt(units::kind_of(own->dimension)));
    return out;
  }
  if (format_.is_whole && si != std::round(si)) {
    out.fault = QStringLiteral("%1 is not a whole number.").arg(number_text(si));
    return out;
  }
  if (si < format_.min || si > format_.max) {
    const double limit = si < format_.min ? format_.min : format_.max;
    out.fault = limit == kPositive
                    ? QStringLiteral("%1 is not greater than 0.").arg(number_text(to_shown(si)))
                    : QStringLiteral("%1 is %2 the limit of %3 %4.")
                          .arg(number_text(to_shown(si)),
                               si < format_.min ? QStringLiteral("below") : QStringLiteral("above"),
                               number_text(to_shown(limit)), unit_text(format_.shown));
  }
  out.number = si;
  out.value =
      format_.is_whole && std::fabs(si) < 9e15 ? Value(static_cast<std::int64_t>(si)) : Value(si);
  return out;
}

double NumberField::clamped(double si) const {
  if (format_.min == kPositive && si <= 0) return from_shown(step_size());
  return std::clamp(si, format_.min, format_.max);
}

double NumberField::step_size() const {
  if (format_.step > 0) return to_shown(format_.step);
  if (format_.is_whole) return 1;
  const auto now = number();
  const double shown = now && std::isfinite(*now) ? std::fabs(to_shown(*now)) : 0;
  if (shown > 0) return std::max(decade(shown) / 100, 1e-9);
  if (fill_to_ > fill_from_) return decade(to_shown(fill_to_ - fill_from_)) / 100;
  return format_.unit.empty() ? 0.01 : 1;
}

QString NumberField::shown_text() const {
  const QString unit = unit_text(format_.shown);
  const auto with_unit = [&](double si) {
    const QString n = number_text(to_shown(si), is_dragged_ ? decimals_ : -1);
    return unit.isEmpty() || n.startsWith("not") ? n : n + " " + unit;
  };
  if (is_mixed()) return QStringLiteral("several values");
  const auto& v = effective();
  if (!v || v->is_nil()) return {};
  if (const std::string* s = v->as_string()) {
    if (is_expression() || !fault().isEmpty()) {
      const auto si = number();
      return qt(*s) + (si ? " = " + with_unit(*si) : QString());
    }
    const auto si = number();
    return si ? with_unit(*si) : qt(*s);
  }
  return v->is_number() ? with_unit(v->number()) : qt(v->text());
}

QString NumberField::edit_text() const {
  const auto& v = effective();
  if (!v || is_mixed()) return {};
  if (v->as_string()) return qt(*v->as_string());
  if (!v->is_number()) return {};
  // The shortest text that reads back to the same number in the shown unit.
  return qt(text::print(to_shown(v->number())));
}

void NumberField::show_value() {
  setAccessibleDescription(shown_text());
  update();
}

QSize NumberField::sizeHint() const {
  const Theme& t = theme();
  return {t.px(96), t.field_height};
}
QSize NumberField::minimumSizeHint() const {
  const Theme& t = theme();
  const int prefix = prefix_.isEmpty() ? 0 : QFontMetrics(t.small).horizontalAdvance(prefix_);
  return {t.px(56) + prefix, t.field_height};
}

void NumberField::set_shows_unit(bool on) {
  if (shows_unit_ == on) return;
  shows_unit_ = on;
  update();
}

int NumberField::width_with_unit() const {
  const Theme& t = theme();
  const QFontMetrics small(t.small), mono(t.mono);
  int width = mono.horizontalAdvance(QStringLiteral("\u22121234.5")) + 2 * t.px(6);
  if (axis_ >= 0) width += t.px(8);
  if (!prefix_.isEmpty()) width += small.horizontalAdvance(prefix_) + t.px(4);
  const QString unit = unit_text(format_.shown);
  return unit.isEmpty() ? width : width + small.horizontalAdvance(unit) + t.px(3);
}

void NumberField::paintEvent(QPaintEvent*) {
  const Theme& t = theme();
  QPainter p(this);
  const bool has_fault = !fault().isEmpty();
  const bool has_focus = looks_focused() || (edit_ && edit_->hasFocus());
  paint_field(p, rect(), {is_hovered(), has_focus, has_fault, isEnabled(), is_dragged_});
  const QRect inner = rect().adjusted(2, 2, -2, -2);
  const auto& v = effective();
  const auto si = number();
  if (!edit_ && isEnabled() && !has_fault && si && fill_to_ > fill_from_ &&
      (is_hovered() || is_dragged_ || looks_focused())) {
    const double share = std::clamp((*si - fill_from_) / (fill_to_ - fill_from_), 0.0, 1.0);
    p.fillRect(
        QRect(inner.left(), inner.top(), static_cast<int>(inner.width() * share), inner.height()),
        t.selection);
  }
  paint_axis_mark(p, rect(), axis_);
  const int pad = t.px(6);
  int left = rect().left() + pad + (axis_ >= 0 ? t.px(8) : 0);
  QRect room(left, 0, rect().right() - pad - left + 1, height());
  const QColor main = !isEnabled() ? t.disabled : !value_ || is_mixed() ? t.text_quiet : t.text;
  if (!prefix_.isEmpty()) {
    p.setFont(t.small);
    p.setPen(isEnabled() ? t.text_dim : t.disabled);
    p.drawText(room, Qt::AlignVCenter | Qt::AlignLeft, prefix_);
    const int used = p.fontMetrics().horizontalAdvance(prefix_) + t.px(4);
    room.setLeft(room.left() + used);
  }
  if (edit_) {
    if (!note_.isEmpty()) {
      p.setFont(t.small);
      p.setPen(t.text_dim);
      p.drawText(room, Qt::AlignVCenter | Qt::AlignRight, note_);
    }
    return;
  }
  if (is_mixed()) {
    p.setFont(t.small);
    p.setPen(t.text_quiet);
    paint_text(p, room, Qt::AlignVCenter | Qt::AlignRight, shown_text());
    return;
  }
  if (!v || v->is_nil()) {
    if (!source().isEmpty()) {
      p.setFont(t.small);
      p.setPen(t.text_quiet);
      paint_text(p, room, Qt::AlignVCenter | Qt::AlignRight, source());
    } else if (const QString unit = unit_text(format_.shown); !unit.isEmpty()) {
      p.setFont(t.small);
      p.setPen(t.disabled);
      p.drawText(room, Qt::AlignVCenter | Qt::AlignRight, unit);
    }
    return;
  }
  const bool as_text = v->as_string() && (is_expression() || has_fault || !si);
  if (as_text) {
    // The text at the left, its value at the right.
    if (is_expression()) {
      QFont f = t.ui;
      f.setItalic(true);
      f.setBold(true);
      p.setFont(f);
      p.setPen(isEnabled() ? t.accent : t.disabled);
      p.drawText(room, Qt::AlignVCenter | Qt::AlignLeft, QStringLiteral("ƒ"));
      room.setLeft(room.left() + p.fontMetrics().horizontalAdvance(QStringLiteral("ƒ")) + t.px(4));
    }
    QString result;
    if (si && !has_fault)
      result = "= " + number_text(to_shown(*si)) + " " + unit_text(format_.shown);
    p.setFont(t.small);
    const int result_width = result.isEmpty() ? 0 : p.fontMetrics().horizontalAdvance(result);
    // A narrow field shows the expression alone.
    const bool fits = result_width < room.width() * 6 / 10;
    if (fits && result_width > 0) {
      p.setPen(t.text_dim);
      p.drawText(room, Qt::AlignVCenter | Qt::AlignRight, result);
      room.setRight(room.right() - result_width - t.px(6));
    }
    p.setFont(t.mono);
    p.setPen(main);
    paint_text(p, room, Qt::AlignVCenter | Qt::AlignLeft, qt(*v->as_string()));
    return;
  }
  if (!si) return;
  const QString unit = unit_text(format_.shown);
  p.setFont(t.small);
  const int unit_width = p.fontMetrics().horizontalAdvance(unit);
  // A field that has no space for both shows the number.
  if (!unit.isEmpty() && shows_unit_ && room.width() - unit_width > t.px(28)) {
    p.setPen(isEnabled() ? t.text_dim : t.disabled);
    p.drawText(room, Qt::AlignVCenter | Qt::AlignRight, unit);
    room.setRight(room.right() - unit_width - t.px(3));
  }
  QFont f = t.mono;
  if (is_dragged_) f.setWeight(QFont::DemiBold);
  p.setFont(f);
  p.setPen(main);
  QString digits = number_text(to_shown(*si), is_dragged_ ? decimals_ : -1);
  // A narrow field shows fewer digits; its tool tip and typing have all of them.
  constexpr int kFewestDigits = 3;
  for (int n = 5; n >= kFewestDigits && !is_dragged_ &&
                  p.fontMetrics().horizontalAdvance(digits) > room.width() - 2;
       --n)
    digits = number_text(QString::number(to_shown(*si), 'g', n).toDouble());
  paint_text(p, room, Qt::AlignVCenter | Qt::AlignRight, digits);
}

// ---- typing ----

void NumberField::begin_edit(const QString& typed) {
  if (edit_ || !isEnabled()) return;
  edit_ = new QLineEdit(this);
  edit_->setObjectName(objectName() + ".typed");
  edit_->setAccessibleName(accessibleName());
  edit_->setToolTip(toolTip());
  edit_->setFrame(false);
  use_font(*edit_, &Theme::mono);
  edit_->setStyleSheet(QStringLiteral("border: 0px; background: transparent; padding: 0px;"));
  edit_->setText(typed.isEmpty() ? edit_text() : typed);
  if (typed.isEmpty()) edit_->selectAll();
  edit_->installEventFilter(this);
  QObject::connect(edit_, &QLineEdit::textChanged, this, [this](const QString& text) {
    const Reading r = read(text);
    note_.clear();
    // The value in the shown unit, where the text is another spelling of it.
    if (r.fault.isEmpty() && r.number) {
      bool is_plain = false;
      (void)text.trimmed().toDouble(&is_plain);
      if (!is_plain)
        note_ = "= " + number_text(to_shown(*r.number)) + " " + unit_text(format_.shown);
    }
    set_fault(r.fault);
    place_edit();
    update();
  });
  if (!typed.isEmpty()) Q_EMIT edit_->textChanged(edit_->text());
  if (format_.names)
    QObject::connect(edit_, &QLineEdit::textEdited, this, [this] { offer_names(); });
  setFocusProxy(nullptr);
  place_edit();
  edit_->show();
  edit_->setFocus(Qt::OtherFocusReason);
}

namespace {

/// Whether a key is held with one that makes a shortcut of it.
bool has_modifiers(const QKeyEvent& key) {
  return key.modifiers() & (Qt::ControlModifier | Qt::AltModifier | Qt::MetaModifier);
}

/// Whether a key types a value.
bool is_typing(const QKeyEvent& key) {
  const QString typed = key.text();
  return !typed.isEmpty() && typed[0].isPrint() && !typed[0].isSpace() && !has_modifiers(key);
}

/// The name that ends at the cursor: "bo" of "2*bo|+1"; empty after a digit or an operator.
QString name_before(const QString& text, qsizetype cursor) {
  qsizetype from = cursor;
  while (from > 0 && (text[from - 1].isLetterOrNumber() || text[from - 1] == '_')) --from;
  return from < cursor && text[from].isLetter() ? text.mid(from, cursor - from) : QString();
}

}  // namespace

void NumberField::offer_names() {
  if (!edit_) return;
  const QString begun = name_before(edit_->text(), edit_->cursorPosition());
  if (!completer_) {
    completer_ = new QCompleter(format_.names(), edit_);
    completer_->setWidget(edit_);
    completer_->setCaseSensitivity(Qt::CaseInsensitive);
    completer_->popup()->setObjectName(objectName() + ".names");
    completer_->popup()->setAccessibleName("Names for the expression");
    QObject::connect(completer_, qOverload<const QString&>(&QCompleter::activated), this,
                     [this](const QString& name) { take_name(name); });
  }
  completer_->setCompletionPrefix(begun);
  const bool is_whole =
      completer_->completionCount() == 1 && completer_->currentCompletion() == begun;
  if (begun.isEmpty() || completer_->completionCount() == 0 || is_whole) {
    completer_->popup()->hide();
    return;
  }
  completer_->complete();
  completer_->popup()->setCurrentIndex(completer_->completionModel()->index(0, 0));
}

void NumberField::take_name(const QString& name) {
  if (!edit_) return;
  const qsizetype cursor = edit_->cursorPosition();
  const qsizetype begun = name_before(edit_->text(), cursor).size();
  QString text = edit_->text();
  text.replace(cursor - begun, begun, name);
  edit_->setText(text);
  edit_->setCursorPosition(static_cast<int>(cursor - begun + name.size()));
}

void NumberField::place_edit() {
  if (!edit_) return;
  const Theme& t = theme();
  int right = t.px(6);
  if (!note_.isEmpty()) right += QFontMetrics(t.small).horizontalAdvance(note_) + t.px(6);
  int left = t.px(5) + (axis_ >= 0 ? t.px(8) : 0);
  if (!prefix_.isEmpty()) left += QFontMetrics(t.small).horizontalAdvance(prefix_) + t.px(4);
  edit_->setGeometry(left, 2, std::max(t.px(24), width() - left - right), height() - 4);
}

void NumberField::end_edit(bool keep) {
  if (!edit_ || is_ending_) return;
  is_ending_ = true;
  QLineEdit* edit = edit_;
  completer_ = nullptr;  // ends with the line
  const bool had_focus = edit->hasFocus();
  const QString typed = edit->text();
  const bool is_changed = edit->isModified() || typed != edit_text();
  edit_ = nullptr;
  note_.clear();
  edit->removeEventFilter(this);
  edit->setParent(nullptr);
  edit->deleteLater();
  is_ending_ = false;
  if (had_focus) setFocus(Qt::OtherFocusReason);
  if (!keep || !is_changed) {
    set_fault({});
    show_value();
    return;
  }
  Reading r = read(typed);
  if (!r.value && !may_be_empty_) {
    set_fault({});
    show_value();
    return;
  }
  value_ = std::move(r.value);
  computed_.reset();
  set_fault(r.fault);
  show_value();
  notify(Stage::changed);
}

bool NumberField::eventFilter(QObject* object, QEvent* event) {
  if (object == edit_ && event->type() == QEvent::KeyPress) {
    const auto* key = static_cast<QKeyEvent*>(event);
    if (key->key() == Qt::Key_Escape) {
      end_edit(false);
      return true;
    }
    if (key->key() == Qt::Key_Return || key->key() == Qt::Key_Enter) {
      const bool passes_on = key->modifiers() & Qt::ControlModifier;
      end_edit(true);
      return !passes_on;
    }
    if (key->key() == Qt::Key_Tab || key->key() == Qt::Key_Backtab) {
      const bool forward = key->key() == Qt::Key_Tab;
      end_edit(true);
      focusNextPrevChild(forward);
      return true;
    }
  }
  if (object == edit_ && event->type() == QEvent::FocusOut) {
    const auto reason = static_cast<QFocusEvent*>(event)->reason();
    if (reason != Qt::PopupFocusReason && reason != Qt::ActiveWindowFocusReason) end_edit(true);
  }
  return Field::eventFilter(object, event);
}

void NumberField::resizeEvent(QResizeEvent* event) {
  place_edit();
  Field::resizeEvent(event);
}

// ---- dragging and stepping ----

void NumberField::set_number(double si, Stage stage) {
  si = clamped(si);
  if (format_.is_whole) si = std::round(si);
  value_ = format_.is_whole ? Value(static_cast<std::int64_t>(si)) : Value(si);
  computed_.reset();
  set_fault({});
  show_value();
  notify(stage);
}

void NumberField::step_by(double steps) {
  const auto now = number();
  double shown =
      to_shown(now && std::isfinite(*now) ? *now : std::clamp(0.0, format_.min, format_.max));
  const double step = step_size();
  if (format_.is_logarithmic && shown > 0) shown *= std::pow(1.05, steps);
  else shown += steps * step;
  // Steps give round numbers.
  const double fine = std::min(1.0, std::fabs(steps)) * step;
  if (!format_.is_logarithmic && fine > 0) {
    const double unit = decade(fine) / 10;
    shown = std::round(shown / unit) * unit;
  }
  set_number(from_shown(shown), Stage::changed);
}

void NumberField::mousePressEvent(QMouseEvent* event) {
  if (event->button() != Qt::LeftButton || edit_) return Field::mousePressEvent(event);
  is_pressed_ = true;
  press_ = event->pos();
  last_x_ = event->pos().x();
  drag_px_ = 0;
  before_drag_ = value_;
  setFocus(Qt::MouseFocusReason);
}

void NumberField::mouseMoveEvent(QMouseEvent* event) {
  if (!is_pressed_) return Field::mouseMoveEvent(event);
  const auto now = number();
  if (!is_dragged_) {
    if (std::abs(event->pos().x() - press_.x()) < kDragBegins) return;
    if (is_mixed() || (effective() && !now)) return;  // an expression that was not computed
    is_dragged_ = true;
    drag_start_ = to_shown(now && std::isfinite(*now) ? *now : 0.0);
    drag_step_ = step_size();
    decimals_ = std::clamp(static_cast<int>(-std::floor(std::log10(drag_step_) + 1e-9)), 0, 9);
    notify(Stage::drag_begun);
  }
  const bool is_fine = event->modifiers() & Qt::ShiftModifier;
  drag_px_ += (event->pos().x() - last_x_) * (is_fine ? 0.1 : 1.0);
  last_x_ = event->pos().x();
  if (is_fine)
    decimals_ = std::clamp(static_cast<int>(-std::floor(std::log10(drag_step_ / 10) + 1e-9)), 0, 9);
  double shown = drag_start_;
  if (format_.is_logarithmic && drag_start_ > 0) shown *= std::pow(1.01, drag_px_);
  else shown += drag_px_ * drag_step_;
  const double unit =
      event->modifiers() & Qt::ControlModifier ? drag_step_ * 10 : drag_step_ / (is_fine ? 10 : 1);
  if (!format_.is_logarithmic || event->modifiers() & Qt::ControlModifier)
    shown = std::round(shown / unit) * unit;
  set_number(from_shown(shown), Stage::dragged);
}

void NumberField::mouseReleaseEvent(QMouseEvent* event) {
  if (!is_pressed_ || event->button() != Qt::LeftButton) return Field::mouseReleaseEvent(event);
  is_pressed_ = false;
  if (is_dragged_) {
    is_dragged_ = false;
    decimals_ = -1;
    show_value();
    notify(Stage::drag_ended);
  } else if (rect().contains(event->pos())) {
    begin_edit();
  }
}

bool NumberField::uses(const QKeyEvent& key) const {
  if (key.key() == Qt::Key_Escape) return is_dragged_;
  if (has_modifiers(key)) return key.matches(QKeySequence::Copy);
  switch (key.key()) {
    case Qt::Key_Up:
    case Qt::Key_Down:
    case Qt::Key_PageUp:
    case Qt::Key_PageDown:
    case Qt::Key_F2:
    case Qt::Key_Return:
    case Qt::Key_Enter:
    // Also where nothing can be taken away: the window would delete what is selected.
    case Qt::Key_Delete:
    case Qt::Key_Backspace: return true;
    default: return is_typing(key);
  }
}

bool NumberField::event(QEvent* event) {
  // What the field uses is not for shortcuts of the window, such as F2, Delete or a letter.
  if (event->type() == QEvent::ShortcutOverride && uses(*static_cast<QKeyEvent*>(event))) {
    event->accept();
    return true;
  }
  return Field::event(event);
}

void NumberField::keyPressEvent(QKeyEvent* event) {
  // What the line of an edit leaves over would change the value below it.
  if (edit_ || !uses(*event)) return Field::keyPressEvent(event);
  const double fine = event->modifiers() & Qt::ShiftModifier ? 0.1 : 1;
  if (event->matches(QKeySequence::Copy)) return copy();
  switch (event->key()) {
    case Qt::Key_Escape:
      is_dragged_ = is_pressed_ = false;
      decimals_ = -1;
      value_ = before_drag_;
      show_value();
      return notify(Stage::drag_cancelled);
    case Qt::Key_Up: return step_by(fine);
    case Qt::Key_Down: return step_by(-fine);
    case Qt::Key_PageUp: return step_by(10 * fine);
    case Qt::Key_PageDown: return step_by(-10 * fine);
    case Qt::Key_F2:
    case Qt::Key_Return:
    case Qt::Key_Enter: return begin_edit();
    case Qt::Key_Delete:
    case Qt::Key_Backspace:
      if (may_be_empty_ && value_) take_default();
      return;
    default: return begin_edit(event->text());
  }
}

void NumberField::contextMenuEvent(QContextMenuEvent* event) {
  auto* menu = new QMenu(this);
  menu->setAttribute(Qt::WA_DeleteOnClose);
  menu->setObjectName(objectName() + ".menu");
  QObject::connect(menu->addAction("Type a value"), &QAction::triggered, this,
                   [this] { begin_edit(); });
  QObject::connect(menu->addAction("Copy"), &QAction::triggered, this, [this] { copy(); });
  QAction* reset = menu->addAction("Use the default");
  reset->setEnabled(isEnabled() && may_be_empty_ && value_.has_value());
  QObject::connect(reset, &QAction::triggered, this, [this] { take_default(); });
  menu->popup(event->globalPos());
}

void NumberField::copy() const {
  QApplication::clipboard()->setText(shown_text().replace(QChar(0x2212), '-'));
}

void NumberField::take_default() {
  value_.reset();
  computed_.reset();
  set_fault({});
  show_value();
  notify(Stage::changed);
}

}  // namespace robomosp::viewer
