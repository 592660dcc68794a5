// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/forms/form_row.h"

#include <algorithm>

#include <QApplication>
#include <QClipboard>
#include <QContextMenuEvent>
#include <QGridLayout>
#include <QHBoxLayout>
#include <QLabel>
#include <QMenu>
#include <QPushButton>
#include <QVBoxLayout>

#include "kernel/literal.h"
#include "kernel/type.h"
#include "kernel/type_forms.h"
#include "viewer/forms/composite_fields.h"
#include "viewer/forms/field_factory.h"
#include "viewer/theme/theme.h"
#include "viewer/widgets/elided.h"
#include "viewer/widgets/restyle.h"

namespace robomosp::viewer {
namespace {

/// The record that a command is about is called by its kind: "Robot" rather than "Id".
QString label_of(const ParamSpec& p) {
  const TypeTree& t = type_tree(p.type);
  if (p.name == "id" && t.kind == TypeKind::reference && t.notes.label.empty() && p.label.empty())
    return readable(t.words.empty() || t.words.front() == "any" ? "record" : t.words.front());
  return readable(form_label(p));
}

/// Units as the fields write them: "kg m²".
QString with_powers(QString text) {
  return text.replace("^2", QStringLiteral("²")).replace("^3", QStringLiteral("³"));
}

}  // namespace

QWidget* fault_box(const ShownFault& fault,
                   const std::function<void(const FaultRemedy&)>& on_remedy, const QString& name,
                   QWidget* parent) {
  auto* box = new QWidget(parent);
  box->setObjectName(name);
  box->setAccessibleName("Fault");
  auto* column = new QVBoxLayout(box);
  column->setContentsMargins(0, 0, 0, theme().px(2));
  column->setSpacing(0);
  auto* sentence = new QLabel(with_powers(fault.sentence), box);
  sentence->setObjectName(name + ".sentence");
  sentence->setAccessibleName("Fault: " + fault.sentence);
  sentence->setToolTip("The fault of this value.");
  sentence->setProperty(fault.severity == Severity::error ? "fault" : "warning", true);
  sentence->setWordWrap(true);
  sentence->setTextInteractionFlags(Qt::TextSelectableByMouse);
  column->addWidget(sentence);
  if (!fault.remedies.empty() && on_remedy) {
    // Beside each other while they are short.
    constexpr qsizetype kLettersInARow = 36;
    qsizetype letters = 0;
    for (const FaultRemedy& remedy : fault.remedies) letters += qt(remedy.label).size();
    const bool is_long = letters > kLettersInARow;
    auto* row = new QBoxLayout(is_long ? QBoxLayout::TopToBottom : QBoxLayout::LeftToRight);
    row->setContentsMargins(0, 0, 0, 0);
    row->setSpacing(is_long ? 0 : theme().px(8));
    int i = 0;
    for (const FaultRemedy& remedy : fault.remedies) {
      auto* button = new ElidedButton(with_powers(qt(remedy.label)), box);
      button->setProperty("link", true);
      button->setObjectName(QString("%1.remedy%2").arg(name).arg(++i));
      button->setAccessibleName(qt(remedy.label));
      button->setToolTip(qt(remedy.label) + (remedy.is_tried
                                                 ? "\nThis was tried and removes the fault."
                                                 : "\nThis may help; it was not tried."));
      button->setMinimumWidth(1);  // a narrow panel shows the beginning of a long one
      QObject::connect(button, &QPushButton::clicked, box,
                       [on_remedy, remedy] { on_remedy(remedy); });
      row->addWidget(button);
    }
    row->addStretch();
    column->addLayout(row);
  }
  return box;
}

QString readable(const std::string& label) {
  QString s = qt(label);
  s.replace('_', ' ');
  if (!s.isEmpty() && s[0].isLower() && s.size() > 1) s[0] = s[0].toUpper();
  return s;
}

ShownFault shown_fault(const Fault& fault) {
  ShownFault out;
  out.path = fault.subject.argument.empty() ? fault.subject.path : fault.subject.argument;
  // At its place a fault needs no place in its sentence.
  Fault plain = fault;
  if (!out.path.empty()) plain.where.clear();
  QString s = qt(sentence(plain));
  if (!s.isEmpty()) s[0] = s[0].toUpper();
  out.sentence = s;
  out.severity = fault.severity;
  out.remedies = fault.remedies;
  return out;
}

// ---- FormRowWidget ----

FormRowWidget::FormRowWidget(const FormContextPtr& context, const ParamSpec& param,
                             const std::string& path, QWidget* parent)
    : QWidget(parent), param_(param), label_(new QLabel(this)), grid_(new QGridLayout(this)) {
  const Theme& t = theme();
  const QString name = qt(context->title + "." + path);
  setObjectName(name + ".row");
  setAccessibleName(label_of(param_));
  field_ = make_field(context, param_, path, this);
  if (param_.required)
    if (auto* options = dynamic_cast<OptionsField*>(field_)) options->open_editor(false);
  label_->setObjectName(name + ".label");
  label_->setText(label_of(param_));
  label_->setProperty("dim", true);
  label_->setAccessibleName(label_->text());
  label_->setToolTip(field_->toolTip());
  label_->setBuddy(field_);
  label_->setAlignment(Qt::AlignLeft | Qt::AlignVCenter);
  grid_->setContentsMargins(0, t.px(2), 0, t.px(2));
  grid_->setHorizontalSpacing(0);
  grid_->setVerticalSpacing(t.px(2));
  take_lengths();
  arrange();
}

void FormRowWidget::set_is_inner(bool on) {
  is_inner_ = on;
  take_lengths();
}

int FormRowWidget::label_width() const {
  constexpr int kInnerLabel = 84;  // of the design [px]
  return is_inner_ ? theme().px(kInnerLabel) : theme().label_width;
}

void FormRowWidget::take_lengths() {
  if (is_stacked_) {
    label_->setMinimumWidth(0);
    label_->setMaximumWidth(QWIDGETSIZE_MAX);
  } else {
    label_->setFixedWidth(label_width());
  }
  label_->setMinimumHeight(theme().field_height);
}

void FormRowWidget::arrange() {
  for (QWidget* w : {static_cast<QWidget*>(label_), static_cast<QWidget*>(field_), faults_})
    if (w) grid_->removeWidget(w);
  const int line = is_stacked_ ? 1 : 0;
  grid_->addWidget(label_, 0, 0, 1, is_stacked_ ? 3 : 1, Qt::AlignTop);
  grid_->setColumnMinimumWidth(1, is_stacked_ ? 0 : theme().mark_width);
  grid_->addWidget(field_, line, is_stacked_ ? 0 : 2, 1, is_stacked_ ? 3 : 1, Qt::AlignTop);
  grid_->setColumnStretch(2, 1);
  if (faults_) grid_->addWidget(faults_, line + 1, 0, 1, 3);
}

QSize FormRowWidget::minimumSizeHint() const {
  // A row that becomes narrower puts its label above the field, so that it needs less.
  constexpr int kLeast = 120;  // of the design [px]
  return {std::min(theme().px(kLeast), QWidget::minimumSizeHint().width()),
          QWidget::minimumSizeHint().height()};
}

void FormRowWidget::resizeEvent(QResizeEvent* event) {
  QWidget::resizeEvent(event);
  constexpr int kReadable = 110;  // least width of any field beside its label [px of the design]
  const int needed = label_width() + theme().mark_width +
                     std::max(theme().px(kReadable), field_->minimumSizeHint().width());
  const bool is_stacked = width() < needed;
  if (is_stacked == is_stacked_) return;
  is_stacked_ = is_stacked;
  take_lengths();
  arrange();
  updateGeometry();
}

void FormRowWidget::set_changed(bool on) {
  if (is_changed_ == on) return;
  is_changed_ = on;
  QFont f = label_->font();
  label_->setProperty("dim", !on);
  restyle(*label_);
  label_->setFont(f);
  update();
}

void FormRowWidget::paintEvent(QPaintEvent*) {
  const QString unit = field_->unit_beside();
  if (!is_changed_ && unit.isEmpty()) return;
  const Theme& t = theme();
  QPainter p(this);
  p.setRenderHint(QPainter::Antialiasing);
  const QRect label = label_->geometry();
  const int text_end = label.left() + label_->fontMetrics().horizontalAdvance(label_->text());
  if (!unit.isEmpty()) {
    p.setFont(t.small);
    p.setPen(t.text_dim);
    const QRect room(text_end + t.px(5), label.top(), label.right() - text_end - t.px(5),
                     t.field_height);
    if (p.fontMetrics().horizontalAdvance(unit) <= room.width())
      p.drawText(room, Qt::AlignVCenter | (is_stacked_ ? Qt::AlignLeft : Qt::AlignRight), unit);
  }
  if (!is_changed_) return;
  p.setPen(Qt::NoPen);
  p.setBrush(t.accent);
  const double r = t.px(2);
  const double x = (is_stacked_ ? text_end : label.right()) + t.mark_width / 2.0;
  p.drawEllipse(QPointF(x, label.top() + t.field_height / 2.0), r, r);
}

void FormRowWidget::contextMenuEvent(QContextMenuEvent* event) {
  auto* menu = new QMenu(this);
  menu->setAttribute(Qt::WA_DeleteOnClose);
  menu->setObjectName(objectName() + ".menu");
  menu->setAccessibleName("Acts on the value");
  const auto add = [menu](const QString& text, bool is_possible, const std::function<void()>& act) {
    QAction* a = menu->addAction(text);
    a->setEnabled(is_possible && act);
    if (act) QObject::connect(a, &QAction::triggered, menu, act);
  };
  const auto value = field_->value();
  const auto& standard = field_->default_value();
  const QString by_default = standard && !standard->is_nil()
                                 ? QString(" (%1)").arg(qt(beginning_of_literal(*standard, 40)))
                                 : QString();
  add("Use the default" + by_default, field_->isEnabled() && value.has_value() && !param_.required,
      on_default);
  if (on_saved) add("Take back to the saved value", is_changed_, on_saved);
  menu->addSeparator();
  add("Copy the value", value.has_value(), [this] {
    if (const auto v = field_->value()) QApplication::clipboard()->setText(qt(literal(*v)));
  });
  add("Copy the name of the field", true,
      [this] { QApplication::clipboard()->setText(qt(param_.name)); });
  menu->popup(event->globalPos());
}

void FormRowWidget::changeEvent(QEvent* event) {
  if (event->type() == QEvent::StyleChange) {
    take_lengths();
    const bool on = is_changed_;
    is_changed_ = !on;
    set_changed(on);
  }
  QWidget::changeEvent(event);
}

void FormRowWidget::show_fault(const ShownFault& fault,
                               const std::function<void(const FaultRemedy&)>& on_remedy) {
  if (!faults_) {
    faults_ = new QWidget(this);
    faults_->setObjectName(objectName() + ".faults");
    faults_->setAccessibleName("Faults");
    fault_column_ = new QVBoxLayout(faults_);
    fault_column_->setContentsMargins(0, 0, 0, 0);
    fault_column_->setSpacing(theme().px(2));
    grid_->addWidget(faults_, is_stacked_ ? 2 : 1, 0, 1, 3);
  }
  fault_column_->addWidget(fault_box(
      fault, on_remedy, field_->objectName() + QString(".fault%1").arg(fault_column_->count() + 1),
      faults_));
  faults_->show();
}

void FormRowWidget::clear_faults() {
  field_->clear_faults();
  if (!faults_) return;
  faults_->hide();
  faults_->deleteLater();
  faults_ = nullptr;
  fault_column_ = nullptr;
}

QString FormRowWidget::fault_text() const {
  QStringList all;
  if (faults_)
    for (const QLabel* label : faults_->findChildren<QLabel*>()) all << label->text();
  return all.join('\n');
}

}  // namespace robomosp::viewer
