// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/widgets/simple_fields.h"

#include <algorithm>
#include <cmath>

#include <QFileDialog>
#include <QFrame>
#include <QHBoxLayout>
#include <QImage>
#include <QKeyEvent>
#include <QLineEdit>
#include <QMouseEvent>
#include <QPlainTextEdit>
#include <QPointer>
#include <QToolButton>

#include "kernel/literal.h"
#include "viewer/theme/icons.h"
#include "viewer/theme/theme.h"
#include "viewer/widgets/elided.h"
#include "viewer/widgets/restyle.h"

namespace robomosp::viewer {
namespace {

/// Longer literals are shown by their beginning and are not typed.
constexpr std::size_t kLongestLiteral = 4000;

QString colour_text(const QColor& c) {
  QString s = c.name();
  if (c.alpha() != 255) s += QStringLiteral("%1").arg(c.alpha(), 2, 16, QChar('0'));
  return s;
}

}  // namespace

std::optional<QColor> colour_of(const Value& v) {
  if (const std::string* s = v.as_string()) {
    const QString text = qt(*s).trimmed();
    if (text.size() == 9 && text[0] == '#') {
      // "#rrggbbaa"; Qt reads "#aarrggbb".
      const QColor c("#" + text.mid(7, 2) + text.mid(1, 6));
      return c.isValid() ? std::optional(c) : std::nullopt;
    }
    const QColor c(text);
    return c.isValid() ? std::optional(c) : std::nullopt;
  }
  std::vector<double> parts;
  if (const List* list = v.as_list())
    for (const Value& each : *list) parts.push_back(each.number());
  if (const NumericArray* a = v.as_array()) parts.assign(a->data().begin(), a->data().end());
  if (parts.size() < 3) return std::nullopt;
  const auto part = [&](std::size_t i) {
    return static_cast<float>(i < parts.size() ? std::clamp(parts[i], 0.0, 1.0) : 1.0);
  };
  return QColor::fromRgbF(part(0), part(1), part(2), part(3));
}

// ---- BoolField ----

BoolField::BoolField(QWidget* parent) : Field(parent) {
  setFocusPolicy(Qt::StrongFocus);
  setSizePolicy(QSizePolicy::Expanding, QSizePolicy::Fixed);
}

void BoolField::set_value(const std::optional<Value>& value) {
  value_ = value;
  update();
}

void BoolField::set_note(const QString& note) {
  note_ = note;
  update();
}

bool BoolField::is_on() const {
  const std::optional<Value>& v = value_ ? value_ : default_;
  return v && v->as_bool() && *v->as_bool();
}

QSize BoolField::sizeHint() const { return {theme().px(80), theme().field_height}; }

void BoolField::paintEvent(QPaintEvent*) {
  const Theme& t = theme();
  QPainter p(this);
  const int side = t.px(14);
  const QRect box(1, (height() - side) / 2, side, side);
  const bool on = is_on() && !is_mixed();
  FieldLook look{is_hovered(), looks_focused(), !fault().isEmpty(), isEnabled(), false};
  paint_field(p, box, look);
  const double ratio = devicePixelRatioF();
  if (on && isEnabled()) {
    p.setPen(looks_focused() ? QPen(t.text, 1) : Qt::NoPen);
    p.setBrush(value_ ? t.accent_fill : t.text_quiet);
    p.drawRoundedRect(QRectF(box).adjusted(0.5, 0.5, -0.5, -0.5), t.radius, t.radius);
  }
  if (on)
    p.drawPixmap(box.topLeft() + QPoint(t.px(1), t.px(1)),
                 icon_pixmap("ok", isEnabled() ? t.on_accent : t.disabled, t.px(12), ratio));
  if (is_mixed())
    p.fillRect(QRect(box.left() + t.px(3), box.center().y(), side - t.px(6), t.px(2)), t.text_dim);
  const QRect room(box.right() + t.px(7), 0, width() - box.right() - t.px(7), height());
  p.setFont(t.ui);
  p.setPen(isEnabled() ? (value_ ? t.text : t.text_dim) : t.disabled);
  paint_text(p, room, Qt::AlignVCenter | Qt::AlignLeft,
             is_mixed() ? QStringLiteral("several values") : note_);
}

void BoolField::toggle() {
  value_ = Value(is_mixed() || !is_on());
  set_fault({});
  update();
  notify(Stage::changed);
}

void BoolField::mouseReleaseEvent(QMouseEvent* event) {
  if (event->button() == Qt::LeftButton && rect().contains(event->pos())) toggle();
}

void BoolField::keyPressEvent(QKeyEvent* event) {
  if (event->key() == Qt::Key_Space) return toggle();
  if ((event->key() == Qt::Key_Delete || event->key() == Qt::Key_Backspace) && value_) {
    value_.reset();
    update();
    notify(Stage::changed);
    return;
  }
  Field::keyPressEvent(event);
}

// ---- TextField ----

TextField::TextField(QWidget* parent) : Field(parent), line_(new ElidedLine(this)) {
  auto* row = new QHBoxLayout(this);
  row->setContentsMargins(0, 0, 0, 0);
  row->setSpacing(2);
  row->addWidget(line_);
  setFocusProxy(line_);
  setSizePolicy(QSizePolicy::Expanding, QSizePolicy::Fixed);
  line_->setFixedHeight(theme().field_height);
  QObject::connect(line_, &QLineEdit::textEdited, this, [this](const QString& s) { take_text(s); });
  QObject::connect(this, &QObject::objectNameChanged, line_, [this](const QString& name) {
    line_->setObjectName(name + ".text");
    line_->setAccessibleName(accessibleName());
  });
}

void TextField::set_value(const std::optional<Value>& value) {
  value_ = value;
  const QString text = value && !value->is_nil()
                           ? qt(value->as_string() ? *value->as_string() : value->text())
                           : QString();
  if (line_->text() != text) {
    line_->setText(text);
    line_->setCursorPosition(0);
  }
  line_->setAccessibleName(accessibleName());
  line_->setToolTip(toolTip());
}

void TextField::set_default(const std::optional<Value>& value) {
  Field::set_default(value);
  show_placeholder();
}

void TextField::set_mixed(bool on) {
  Field::set_mixed(on);
  if (on) line_->clear();
  show_placeholder();
}

void TextField::set_source(const QString& note) {
  Field::set_source(note);
  show_placeholder();
}

void TextField::show_placeholder() {
  QString s;
  if (is_mixed()) s = "several values";
  else if (default_ && !default_->is_nil())
    s = qt(default_->as_string() ? *default_->as_string() : default_->text());
  line_->setPlaceholderText(s);
}

bool TextField::place_fault(std::string_view path, const QString& sentence) {
  const bool is_own = Field::place_fault(path, sentence);
  line_->setProperty("fault", !sentence.isEmpty());
  line_->setToolTip(toolTip());
  restyle(*line_);
  return is_own;
}

void TextField::clear_faults() {
  if (fault().isEmpty() && !line_->property("fault").toBool()) return;
  (void)place_fault({}, {});
}

void TextField::set_secret(bool on) {
  line_->setEchoMode(on ? QLineEdit::Password : QLineEdit::Normal);
}

QSize TextField::sizeHint() const { return {theme().px(120), theme().field_height}; }

void TextField::take_theme() { line_->setFixedHeight(theme().field_height); }

void TextField::take_text(const QString& text) {
  if (text.isEmpty()) value_.reset();
  else value_ = Value(text.toStdString());
  clear_faults();
  notify(Stage::changed);
}

// ---- PathField ----

PathField::PathField(For purpose, std::vector<std::string> patterns, QWidget* parent)
    : TextField(parent), for_(purpose), patterns_(std::move(patterns)) {
  button_ = new QToolButton(this);
  button_->setIcon(icon("folder"));
  button_->setFixedSize(theme().field_height, theme().field_height);
  button_->setToolTip(for_ == For::folder ? "Choose a folder" : "Choose a file");
  button_->setAccessibleName(button_->toolTip());
  layout()->addWidget(button_);
  QObject::connect(button_, &QToolButton::clicked, this, [this] { browse(); });
  QObject::connect(this, &QObject::objectNameChanged, button_,
                   [this](const QString& name) { button_->setObjectName(name + ".browse"); });
}

void PathField::browse() {
  auto* dialog = new QFileDialog(window());
  dialog->setObjectName(objectName() + ".dialog");
  dialog->setAttribute(Qt::WA_DeleteOnClose);
  dialog->setFileMode(for_ == For::folder ? QFileDialog::Directory
                      : for_ == For::save ? QFileDialog::AnyFile
                                          : QFileDialog::ExistingFile);
  dialog->setAcceptMode(for_ == For::save ? QFileDialog::AcceptSave : QFileDialog::AcceptOpen);
  if (!patterns_.empty()) {
    QStringList all;
    for (const std::string& s : patterns_) all << qt(s);
    dialog->setNameFilters({"Files (" + all.join(' ') + ")", "All files (*)"});
  }
  const QPointer<PathField> self = this;
  QObject::connect(dialog, &QFileDialog::fileSelected, this, [self](const QString& file) {
    if (!self) return;
    self->line_->setText(file);
    self->take_text(file);
  });
  dialog->setModal(false);
  dialog->show();
}

// ---- LiteralField ----

LiteralField::LiteralField(QWidget* parent) : TextField(parent) {
  use_font(*line_, &Theme::mono);
  line_->setPlaceholderText("as Lua");
}

void LiteralField::set_value(const std::optional<Value>& value) {
  value_ = value;
  QString text;
  if (value && !value->is_nil()) {
    std::string s = beginning_of_literal(*value, kLongestLiteral);
    const bool is_whole = s.size() <= kLongestLiteral;
    line_->setReadOnly(!is_whole);
    text = qt(s) + (is_whole ? QString() : QStringLiteral(" …"));
  }
  line_->setText(text);
  line_->setCursorPosition(0);
  line_->setToolTip(toolTip());
}

void LiteralField::take_text(const QString& text) {
  clear_faults();
  if (text.trimmed().isEmpty()) {
    value_.reset();
  } else if (auto read = read_literal(text.toStdString()); read.ok()) {
    value_ = std::move(*read);
  } else {
    value_ = Value(text.toStdString());
    (void)place_fault({}, qt(read.error().sentence()));
  }
  notify(Stage::changed);
}

// ---- ScriptField ----

ScriptField::ScriptField(QWidget* parent) : Field(parent), edit_(new QPlainTextEdit(this)) {
  auto* row = new QHBoxLayout(this);
  row->setContentsMargins(0, 0, 0, 0);
  row->addWidget(edit_);
  setFocusProxy(edit_);
  use_font(*edit_, &Theme::code);
  edit_->setTabChangesFocus(true);
  edit_->installEventFilter(this);
  setMinimumHeight(theme().px(60));
  QObject::connect(edit_, &QPlainTextEdit::textChanged, this, [this] {
    if (is_setting_) return;
    const QString s = edit_->toPlainText();
    if (s.isEmpty()) value_.reset();
    else value_ = Value(s.toStdString());
    set_fault({});
    notify(Stage::changed);
  });
  QObject::connect(this, &QObject::objectNameChanged, edit_, [this](const QString& name) {
    edit_->setObjectName(name + ".text");
    edit_->setAccessibleName(accessibleName());
    edit_->setToolTip(toolTip());
  });
}

std::optional<Value> ScriptField::value() const { return value_; }

void ScriptField::set_value(const std::optional<Value>& value) {
  value_ = value;
  is_setting_ = true;
  edit_->setPlainText(value && value->as_string() ? qt(*value->as_string()) : QString());
  is_setting_ = false;
}

QSize ScriptField::sizeHint() const { return {theme().px(200), theme().px(92)}; }

bool ScriptField::eventFilter(QObject* object, QEvent* event) {
  if (object == edit_ && event->type() == QEvent::KeyPress) {
    const auto* key = static_cast<QKeyEvent*>(event);
    if (key->key() == Qt::Key_Return && key->modifiers() & Qt::ControlModifier) {
      event->ignore();
      return true;
    }
  }
  return Field::eventFilter(object, event);
}

// ---- ColourField ----

namespace {

/// A square of saturation and value beside a strip of hues.
class ColourChooser : public QFrame {
 public:
  ColourChooser(const QColor& colour, QWidget* parent) : QFrame(parent, Qt::Popup) {
    setAttribute(Qt::WA_DeleteOnClose);
    setObjectName(parent->objectName() + ".chooser");
    setAccessibleName("Colour");
    setToolTip("Drag in the square for saturation and brightness, in the strip for the hue.");
    setFocusPolicy(Qt::StrongFocus);
    const Theme& t = theme();
    setFixedSize(t.px(220), t.px(180));
    float h = 0, s = 0, v = 0, a = 1;
    colour.getHsvF(&h, &s, &v, &a);
    hue_ = std::max(0.0F, h);
    saturation_ = s;
    value_ = v;
    alpha_ = a;
  }
  std::function<void(const QColor&, Field::Stage)> on_colour;

 protected:
  [[nodiscard]] QRect square() const {
    const int m = theme().px(8);
    return {m, m, width() - 3 * m - theme().px(16), height() - 2 * m};
  }
  [[nodiscard]] QRect strip() const {
    const int m = theme().px(8);
    return {width() - m - theme().px(16), m, theme().px(16), height() - 2 * m};
  }
  void paintEvent(QPaintEvent* event) override {
    QFrame::paintEvent(event);
    QPainter p(this);
    const Theme& t = theme();
    p.fillRect(rect(), t.header);
    p.setPen(t.field_line);
    p.drawRect(rect().adjusted(0, 0, -1, -1));
    const QRect s = square(), h = strip();
    QImage field(s.size(), QImage::Format_RGB32);
    for (int y = 0; y < s.height(); ++y)
      for (int x = 0; x < s.width(); ++x)
        field.setPixelColor(
            x, y,
            QColor::fromHsvF(hue_, static_cast<float>(x) / static_cast<float>(s.width()),
                             1 - static_cast<float>(y) / static_cast<float>(s.height())));
    p.drawImage(s.topLeft(), field);
    for (int y = 0; y < h.height(); ++y)
      p.fillRect(
          QRect(h.left(), h.top() + y, h.width(), 1),
          QColor::fromHsvF(static_cast<float>(y) / static_cast<float>(h.height()), 0.8F, 0.9F));
    p.setRenderHint(QPainter::Antialiasing);
    p.setPen(QPen(value_ > 0.6F && saturation_ < 0.5F ? Qt::black : Qt::white, 2));
    p.setBrush(Qt::NoBrush);
    p.drawEllipse(QPointF(s.left() + double{saturation_} * s.width(),
                          s.top() + (1 - double{value_}) * s.height()),
                  t.px(5), t.px(5));
    p.setPen(QPen(t.text, 2));
    const int y = h.top() + static_cast<int>(hue_ * static_cast<float>(h.height()));
    p.drawLine(h.left() - 2, y, h.right() + 2, y);
  }
  void mousePressEvent(QMouseEvent* event) override {
    if (!rect().contains(event->pos())) {
      close();
      return;
    }
    in_strip_ = strip().adjusted(-4, -8, 4, 8).contains(event->pos());
    is_dragged_ = true;
    if (on_colour) on_colour(now(), Field::Stage::drag_begun);
    take(event->pos());
  }
  void mouseMoveEvent(QMouseEvent* event) override {
    if (is_dragged_) take(event->pos());
  }
  void mouseReleaseEvent(QMouseEvent*) override {
    if (!is_dragged_) return;
    is_dragged_ = false;
    if (on_colour) on_colour(now(), Field::Stage::drag_ended);
  }
  void keyPressEvent(QKeyEvent* event) override {
    constexpr float kStep = 0.02F;
    switch (event->key()) {
      case Qt::Key_Left: saturation_ -= kStep; break;
      case Qt::Key_Right: saturation_ += kStep; break;
      case Qt::Key_Up: value_ += kStep; break;
      case Qt::Key_Down: value_ -= kStep; break;
      case Qt::Key_PageUp: hue_ -= kStep; break;
      case Qt::Key_PageDown: hue_ += kStep; break;
      case Qt::Key_Return:
      case Qt::Key_Enter:
      case Qt::Key_Escape: close(); return;
      default: QFrame::keyPressEvent(event); return;
    }
    bound();
    update();
    if (on_colour) on_colour(now(), Field::Stage::changed);
  }

 private:
  void bound() {
    hue_ = std::clamp(hue_, 0.0F, 1.0F);
    saturation_ = std::clamp(saturation_, 0.0F, 1.0F);
    value_ = std::clamp(value_, 0.0F, 1.0F);
  }
  [[nodiscard]] QColor now() const { return QColor::fromHsvF(hue_, saturation_, value_, alpha_); }
  void take(const QPoint& at) {
    const QRect s = square(), h = strip();
    if (in_strip_) {
      hue_ = static_cast<float>(at.y() - h.top()) / static_cast<float>(h.height());
    } else {
      saturation_ = static_cast<float>(at.x() - s.left()) / static_cast<float>(s.width());
      value_ = 1 - static_cast<float>(at.y() - s.top()) / static_cast<float>(s.height());
    }
    bound();
    update();
    if (on_colour) on_colour(now(), Field::Stage::dragged);
  }
  float hue_ = 0, saturation_ = 0, value_ = 0, alpha_ = 1;
  bool in_strip_ = false, is_dragged_ = false;
};

}  // namespace

ColourField::ColourField(QWidget* parent) : Field(parent), line_(new QLineEdit(this)) {
  setFocusPolicy(Qt::StrongFocus);
  setSizePolicy(QSizePolicy::Expanding, QSizePolicy::Fixed);
  line_->setFrame(false);
  use_font(*line_, &Theme::mono);
  line_->setStyleSheet(QStringLiteral("border: 0px; background: transparent; padding: 0px;"));
  QObject::connect(line_, &QLineEdit::textEdited, this, [this](const QString& s) {
    if (s.trimmed().isEmpty()) value_.reset();
    else value_ = Value(s.trimmed().toStdString());
    const bool is_bad = value_ && !colour_of(*value_);
    set_fault(is_bad ? QStringLiteral("\"%1\" is not a colour. Type #rrggbb.").arg(s) : QString());
    update();
    if (!is_bad) notify(Stage::changed);
  });
  QObject::connect(this, &QObject::objectNameChanged, line_, [this](const QString& name) {
    line_->setObjectName(name + ".text");
    line_->setAccessibleName(accessibleName());
    line_->setToolTip(toolTip());
  });
}

void ColourField::set_value(const std::optional<Value>& value) {
  value_ = value;
  show_value();
}

void ColourField::set_default(const std::optional<Value>& value) {
  Field::set_default(value);
  show_value();
}

QColor ColourField::colour() const {
  const std::optional<Value>& v = value_ ? value_ : default_;
  if (!v) return {};
  return colour_of(*v).value_or(QColor());
}

void ColourField::show_value() {
  const auto text_of = [](const std::optional<Value>& v) {
    if (!v || v->is_nil()) return QString();
    if (const auto c = colour_of(*v)) return colour_text(*c);
    return v->as_string() ? qt(*v->as_string()) : QString();
  };
  const QString s = text_of(value_);
  line_->setPlaceholderText(text_of(default_));
  if (!line_->hasFocus() || line_->text() != s) line_->setText(s);
  update();
}

QSize ColourField::sizeHint() const { return {theme().px(120), theme().field_height}; }

QRect ColourField::swatch() const {
  const int m = theme().px(4);
  return {m, m, theme().px(22), height() - 2 * m};
}

void ColourField::resizeEvent(QResizeEvent* event) {
  const int left = swatch().right() + theme().px(7);
  line_->setGeometry(left, 2, width() - left - 4, height() - 4);
  Field::resizeEvent(event);
}

void ColourField::paintEvent(QPaintEvent*) {
  const Theme& t = theme();
  QPainter p(this);
  paint_field(
      p, rect(),
      {is_hovered(), looks_focused() || line_->hasFocus(), !fault().isEmpty(), isEnabled(), false});
  const QColor c = colour();
  p.setPen(t.field_line);
  if (c.isValid()) {
    if (c.alpha() < 255) p.fillRect(swatch(), QBrush(t.text_quiet, Qt::Dense4Pattern));
    p.setBrush(c);
  } else {
    p.setBrush(Qt::NoBrush);
  }
  p.drawRoundedRect(QRectF(swatch()).adjusted(0.5, 0.5, -0.5, -0.5), 2, 2);
}

void ColourField::choose(const QColor& colour, Stage stage) {
  value_ = Value(colour_text(colour).toStdString());
  set_fault({});
  show_value();
  notify(stage);
}

void ColourField::open_chooser() {
  const QColor c = colour();
  auto* chooser = new ColourChooser(c.isValid() ? c : QColor("#808080"), this);
  const QPointer<ColourField> self = this;
  chooser->on_colour = [self](const QColor& chosen, Stage stage) {
    if (self) self->choose(chosen, stage);
  };
  chooser->move(mapToGlobal(QPoint(0, height() + 1)));
  chooser->show();
}

void ColourField::mousePressEvent(QMouseEvent* event) {
  if (event->button() == Qt::LeftButton && isEnabled()) open_chooser();
}

void ColourField::keyPressEvent(QKeyEvent* event) {
  if (event->key() == Qt::Key_Space || event->key() == Qt::Key_F4) return open_chooser();
  if (event->key() == Qt::Key_Delete && value_) {
    value_.reset();
    show_value();
    notify(Stage::changed);
    return;
  }
  Field::keyPressEvent(event);
}

}  // namespace robomosp::viewer
