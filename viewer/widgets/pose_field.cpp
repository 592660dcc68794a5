// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>

#include <QApplication>
#include <QClipboard>
#include <QHBoxLayout>
#include <QPushButton>
#include <QRegularExpression>
#include <QToolTip>
#include <QVBoxLayout>

#include "kernel/literal.h"
#include "kernel/schema.h"
#include "viewer/theme/icons.h"
#include "viewer/theme/theme.h"
#include "viewer/widgets/number_fields.h"

namespace robomosp::viewer {
namespace {

NumberFormat length_format() {
  NumberFormat f;
  f.unit = "m";
  f.shown = "mm";
  f.step = 0.001;
  f.takes_expressions = true;
  return f;
}
NumberFormat angle_format() {
  NumberFormat f;
  f.unit = "rad";
  f.shown = "deg";
  f.step = std::acos(-1.0) / 180;
  f.takes_expressions = true;
  return f;
}
NumberFormat share_format() {
  NumberFormat f;
  f.step = 0.001;
  return f;
}

/// w, x, y, z with w >= 0.
std::array<double, 4> quaternion_of(const Pose& pose) {
  const auto& r = pose.R;
  const double trace = r[0] + r[4] + r[8];
  std::array<double, 4> q{};
  if (trace > 0) {
    const double s = 2 * std::sqrt(1 + trace);
    q = {s / 4, (r[7] - r[5]) / s, (r[2] - r[6]) / s, (r[3] - r[1]) / s};
  } else if (r[0] >= r[4] && r[0] >= r[8]) {
    const double s = 2 * std::sqrt(std::max(0.0, 1 + r[0] - r[4] - r[8]));
    q = {(r[7] - r[5]) / s, s / 4, (r[1] + r[3]) / s, (r[2] + r[6]) / s};
  } else if (r[4] >= r[8]) {
    const double s = 2 * std::sqrt(std::max(0.0, 1 + r[4] - r[0] - r[8]));
    q = {(r[2] - r[6]) / s, (r[1] + r[3]) / s, s / 4, (r[5] + r[7]) / s};
  } else {
    const double s = 2 * std::sqrt(std::max(0.0, 1 + r[8] - r[0] - r[4]));
    q = {(r[3] - r[1]) / s, (r[2] + r[6]) / s, (r[5] + r[7]) / s, s / 4};
  }
  if (q[0] < 0)
    for (double& x : q) x = -x;
  return q;
}

/// A pose in any representation that commands take.
std::optional<Pose> read_pose(const Value& v) {
  ParamSpec p;
  p.name = "pose";
  p.type = "pose";
  const auto checked = check_value(p, v, "pose");
  return checked.ok() ? pose_from(*checked) : std::nullopt;
}

/// Unit axis and angle in 0 .. pi; the axis of no rotation is z.
std::array<double, 4> axis_angle_of(const Pose& pose) {
  const auto q = quaternion_of(pose);
  const double s = std::hypot(q[1], q[2], q[3]);
  if (s < 1e-12) return {0, 0, 1, 0};
  return {q[1] / s, q[2] / s, q[3] / s, 2 * std::atan2(s, q[0])};
}

/// Numbers of a clipboard in any of the usual layouts: a position, which keeps the orientation
/// `before`, a position with A, B, C in degrees or with a quaternion w, x, y, z, or a matrix by
/// rows. Lengths are in metres.
std::optional<Pose> pose_of_numbers(const QString& text, const Pose& before) {
  static const QRegularExpression between("[\\s,;{}()\\[\\]]+");
  std::vector<double> n;
  for (QString word : text.split(between, Qt::SkipEmptyParts)) {
    bool is_number = false;
    n.push_back(word.replace(QChar(0x2212), '-').toDouble(&is_number));
    if (!is_number || !std::isfinite(n.back())) return std::nullopt;
  }
  if (n.size() < 3) return std::nullopt;
  if (n.size() == 3) {
    Pose moved = before;
    moved.p = {n[0], n[1], n[2]};
    return moved;
  }
  const List position{n[0], n[1], n[2]};
  const double degree = std::acos(-1.0) / 180;
  if (n.size() == 6)
    return read_pose(
        Map{{"position", position}, {"rpy", List{n[5] * degree, n[4] * degree, n[3] * degree}}});
  if (n.size() == 7)
    return read_pose(Map{{"position", position}, {"quaternion", List{n[3], n[4], n[5], n[6]}}});
  if (n.size() == 12) n.insert(n.end(), {0, 0, 0, 1});
  if (n.size() != 16) return std::nullopt;
  List rows;
  for (std::size_t r = 0; r < 4; ++r)
    rows.emplace_back(List{n[4 * r], n[4 * r + 1], n[4 * r + 2], n[4 * r + 3]});
  return read_pose(Value(rows));
}

List list_of(const Vec3& v) { return {Value(v[0]), Value(v[1]), Value(v[2])}; }

/// Rounding errors of conversions are not shown.
double tidy(double v) { return std::fabs(v) < 1e-12 ? 0.0 : v; }

}  // namespace

Vec3 angles_about_zyx(const Pose& pose) {
  const auto& r = pose.R;
  const double s = std::hypot(r[0], r[3]);
  const double b = std::atan2(-r[6], s);
  constexpr double kSingular = 1e-9;
  if (s < kSingular) return {0, b, std::atan2(-r[5], r[4])};
  return {std::atan2(r[3], r[0]), b, std::atan2(r[7], r[8])};
}

PoseField::PoseField(QWidget* parent) : Field(parent) {
  const Theme& t = theme();
  auto* column = new QVBoxLayout(this);
  column->setContentsMargins(0, 0, 0, 0);
  column->setSpacing(t.px(4));
  auto* head = new QHBoxLayout;
  head->setSpacing(0);
  const char* const names[] = {"A B C", "Quaternion", "Axis", "Matrix"};
  const char* const tips[] = {"Angles A, B, C about z, y, x", "Quaternion w, x, y, z",
                              "Axis x, y, z and the angle about it",
                              "Rotation and position as a matrix of 4 x 4"};
  for (std::size_t i = 0; i < std::size(names); ++i) {
    auto* b = new QPushButton(names[i], this);
    style_as_segment(b);
    b->setToolTip(tips[i]);
    b->setAccessibleName(tips[i]);
    b->setSizePolicy(QSizePolicy::Expanding, QSizePolicy::Fixed);
    b->setMinimumWidth(t.px(24));
    QObject::connect(b, &QPushButton::clicked, this, [this, i] { show_as(static_cast<Shown>(i)); });
    head->addWidget(b);
    segments_.push_back(b);
  }
  column->addLayout(head);
  using Components = std::vector<VectorField::Component>;
  position_ = new VectorField(
      Components{{"x", length_format(), 0}, {"y", length_format(), 1}, {"z", length_format(), 2}},
      this);
  angles_ = new VectorField(
      Components{{"A", angle_format(), 2}, {"B", angle_format(), 1}, {"C", angle_format(), 0}},
      this);
  quaternion_ = new VectorField(Components{{"w", share_format(), -1},
                                           {"x", share_format(), 0},
                                           {"y", share_format(), 1},
                                           {"z", share_format(), 2}},
                                this);
  axis_ = new VectorField(Components{{"x", share_format(), 0},
                                     {"y", share_format(), 1},
                                     {"z", share_format(), 2},
                                     {"angle", angle_format(), -1}},
                          this);
  matrix_ = new MatrixField(4, 4, share_format(), this);
  const char letters[] = {'x', 'y', 'z', 'A', 'B', 'C'};
  for (std::size_t i = 0; i < 3; ++i) {
    position_->fields()[i]->set_prefix(QString(QChar(letters[i])), static_cast<int>(i));
    angles_->fields()[i]->set_prefix(QString(QChar(letters[i + 3])), 2 - static_cast<int>(i));
  }
  for (std::size_t i = 0; i < 4; ++i) {
    quaternion_->fields()[i]->set_prefix(QString(QChar("wxyz"[i])), static_cast<int>(i) - 1);
    axis_->fields()[i]->set_prefix(i < 3 ? QString(QChar("xyz"[i])) : QString(),
                                   i < 3 ? static_cast<int>(i) : -1);
  }
  quaternion_->set_per_row(4);
  axis_->set_per_row(4);
  for (Field* f : parts()) {
    f->on_change = [this, f](Stage stage) { take(f, stage); };
    column->addWidget(f);
  }
  make_buttons();
  QObject::connect(this, &QObject::objectNameChanged, this, [this](const QString& name) {
    const QString label = accessibleName(), tip = toolTip();
    position_->describe(label + " position", {}, tip, name + ".position");
    angles_->describe(label + " angles", {}, tip, name + ".rpy");
    quaternion_->describe(label + " quaternion", {}, tip, name + ".quaternion");
    axis_->describe(label + " axis", {}, tip, name + ".axis_angle");
    matrix_->describe(label + " matrix", {}, tip, name + ".matrix");
    for (Field* f : parts()) f->set_value(f->value());
    const char* const modes[] = {"angles", "quaternion", "axis", "matrix"};
    for (std::size_t i = 0; i < segments_.size(); ++i)
      segments_[i]->setObjectName(name + ".as_" + modes[i]);
    from_selection_->setObjectName(name + ".from_selection");
    from_view_->setObjectName(name + ".from_view");
    copy_->setObjectName(name + ".copy");
    paste_->setObjectName(name + ".paste");
  });
  show_as(Shown::angles);
}

void PoseField::make_buttons() {
  auto* foot = new QHBoxLayout;
  foot->setSpacing(theme().px(4));
  const auto button = [&](const char* symbol, const QString& text, const QString& tip) {
    auto* b = new QPushButton(icon(symbol), text, this);
    b->setProperty("full_text", text);
    b->setToolTip(tip);
    b->setAccessibleName(tip);
    foot->addWidget(b);
    return b;
  };
  from_selection_ = button("cursor", "From selection", "Take the pose of what is selected");
  from_view_ = button("eye", "From view", "Take the pose of the camera");
  copy_ = button("copy", "Copy", "Copy the pose as Lua");
  paste_ = button("paste", "Paste",
                  "Take the pose of the clipboard: Lua, or numbers such as x, y, z [m], A, B, C "
                  "[degrees], or a matrix");
  foot->addStretch();
  static_cast<QVBoxLayout*>(layout())->addLayout(foot);
  from_selection_->hide();
  from_view_->hide();
  QObject::connect(copy_, &QPushButton::clicked, this, [this] { copy(); });
  QObject::connect(paste_, &QPushButton::clicked, this, [this] { paste(); });
}

void PoseField::copy() const { QApplication::clipboard()->setText(qt(literal(pose_value(pose_)))); }

void PoseField::paste() {
  const QString text = QApplication::clipboard()->text().trimmed();
  std::optional<Pose> pasted = pose_of_numbers(text, pose_);
  if (!pasted)
    if (const auto read = read_literal(text.toStdString()); read.ok()) pasted = read_pose(*read);
  if (pasted) return set_pose(*pasted);
  constexpr qsizetype kLongest = 40;
  const QString why = text.isEmpty()
                          ? QStringLiteral("The clipboard has no text. Copy a pose first.")
                          : QStringLiteral(
                                "\"%1\" in the clipboard is not a pose. Copy a pose as "
                                "Lua, or 3, 6, 7, 12 or 16 numbers.")
                                .arg(text.size() > kLongest ? text.left(kLongest) + "…" : text);
  set_fault(why);
  QToolTip::showText(paste_->mapToGlobal(QPoint(0, paste_->height())), why, paste_);
}

std::vector<Field*> PoseField::parts() const {
  return {position_, angles_, quaternion_, axis_, matrix_};
}

QSize PoseField::minimumSizeHint() const {
  return {theme().px(200), QWidget::minimumSizeHint().height()};
}

void PoseField::resizeEvent(QResizeEvent* event) {
  Field::resizeEvent(event);
  show_button_texts();
}

void PoseField::show_button_texts() {
  const QFontMetrics metrics(theme().ui);
  int wanted = 0;
  QPushButton* const all[] = {from_selection_, from_view_, copy_, paste_};
  for (QPushButton* b : all)
    if (!b->isHidden())
      wanted += metrics.horizontalAdvance(b->property("full_text").toString()) + theme().px(52);
  for (QPushButton* b : all) b->setIconSize({theme().icon, theme().icon});
  for (QPushButton* b : all)
    b->setText(wanted <= width() ? b->property("full_text").toString() : QString());
}

void PoseField::show_as(Shown shown) {
  shown_ = shown;
  for (std::size_t i = 0; i < segments_.size(); ++i)
    segments_[i]->setChecked(i == static_cast<std::size_t>(shown));
  position_->setVisible(shown != Shown::matrix);
  angles_->setVisible(shown == Shown::angles);
  quaternion_->setVisible(shown == Shown::quaternion);
  axis_->setVisible(shown == Shown::axis);
  matrix_->setVisible(shown == Shown::matrix);
  show_pose();
  updateGeometry();
}

void PoseField::take_theme() {
  show_button_texts();
  for (QPushButton* b : segments_) style_as_segment(b);
}

void PoseField::set_sources(std::function<void()> from_selection, std::function<void()> from_view) {
  from_selection_->setVisible(static_cast<bool>(from_selection));
  from_view_->setVisible(static_cast<bool>(from_view));
  if (from_selection)
    QObject::connect(from_selection_, &QPushButton::clicked, this, std::move(from_selection));
  if (from_view) QObject::connect(from_view_, &QPushButton::clicked, this, std::move(from_view));
  show_button_texts();
}

void PoseField::set_value(const std::optional<Value>& value) {
  value_ = value;
  changed_ = nullptr;
  was_matrix_ = value && value->as_array() && value->as_array()->is_matrix();
  pose_ = Pose{};
  if (value)
    if (const auto read = read_pose(*value)) pose_ = *read;
  show_pose();
}

void PoseField::set_mixed(bool on) {
  Field::set_mixed(on);
  position_->set_mixed(on);
  angles_->set_mixed(on);
}

void PoseField::set_pose(const Pose& pose) {
  pose_ = pose;
  const Vec3 a = angles_about_zyx(pose);
  value_ = Value(Map{{"position", list_of(pose.p)}, {"rpy", List{a[2], a[1], a[0]}}});
  show_pose();
  notify(Stage::changed);
}

void PoseField::show_pose() {
  is_setting_ = true;
  const Vec3 a = angles_about_zyx(pose_);
  // Expressions of a position or of angles are shown as they are written.
  const Map* m = value_ ? value_->as_map() : nullptr;
  const auto given = [m](const char* name) {
    const Value* v = m ? m->find(name) : nullptr;
    auto parts = v ? elements_of(*v) : std::vector<Value>();
    return parts.size() == 3 ? parts : std::vector<Value>();
  };
  List p, angles;
  const auto own_p = given("position"), own_rpy = given("rpy");
  for (std::size_t i = 0; i < 3; ++i) {
    const bool is_text = !own_p.empty() && own_p[i].as_string();
    p.push_back(is_text ? own_p[i] : Value(tidy(pose_.p[i])));
    const bool is_text_angle = !own_rpy.empty() && own_rpy[2 - i].as_string();
    angles.push_back(is_text_angle ? own_rpy[2 - i] : Value(tidy(a[i])));
  }
  position_->set_value(value_ ? std::optional(Value(p)) : std::nullopt);
  position_->set_default(Value(p));
  angles_->set_value(value_ ? std::optional(Value(angles)) : std::nullopt);
  angles_->set_default(Value(angles));
  List quaternion, rows;
  for (const double x : quaternion_of(pose_)) quaternion.emplace_back(tidy(x));
  quaternion_->set_value(Value(quaternion));
  List axis;
  for (const double x : axis_angle_of(pose_)) axis.emplace_back(tidy(x));
  axis_->set_value(Value(axis));
  for (std::size_t r = 0; r < 3; ++r)
    rows.emplace_back(List{tidy(pose_.R[3 * r]), tidy(pose_.R[3 * r + 1]), tidy(pose_.R[3 * r + 2]),
                           tidy(pose_.p[r])});
  rows.emplace_back(List{0.0, 0.0, 0.0, 1.0});
  matrix_->set_value(Value(rows));
  is_setting_ = false;
}

void PoseField::take(Field* changed, Stage stage) {
  if (is_setting_) return;
  changed_ = changed;
  const Value p = position_->value().value_or(Value(list_of(pose_.p)));
  Value next;
  if (shown_ == Shown::matrix) {
    next = matrix_->value().value_or(Value());
  } else if (shown_ == Shown::quaternion) {
    next = Map{{"position", p}, {"quaternion", quaternion_->value().value_or(Value())}};
  } else if (shown_ == Shown::axis) {
    next = Map{{"position", p}, {"axis_angle", axis_->value().value_or(Value())}};
  } else {
    const auto abc =
        elements_of(angles_->value().value_or(Value(list_of(angles_about_zyx(pose_)))));
    next = Map{{"position", p}, {"rpy", List{abc[2], abc[1], abc[0]}}};
  }
  value_ = next;
  set_fault({});
  if (const auto read = read_pose(next)) {
    pose_ = *read;
    if (was_matrix_) value_ = pose_value(pose_);
  }
  notify(stage);
}

bool PoseField::place_fault(std::string_view path, const QString& sentence) {
  const auto within = [&](std::string_view part, VectorField* field, bool is_reversed) {
    if (!path.starts_with(part)) return false;
    std::string rest(path.substr(part.size()));
    if (is_reversed)
      if (const auto i = index_in_path(rest); i && *i < 3)
        rest = "[" + std::to_string(3 - *i) + "]";
    return field->place_fault(rest, sentence);
  };
  if (within(".position", position_, false) || within(".quaternion", quaternion_, false) ||
      within(".axis_angle", axis_, false) || within(".rpy", angles_, true))
    return true;
  if (changed_) {
    (void)changed_->place_fault({}, sentence);
  } else {
    (void)position_->place_fault({}, sentence);
    (void)angles_->place_fault({}, sentence);
  }
  return Field::place_fault(path, sentence);
}

void PoseField::clear_faults() {
  Field::clear_faults();
  for (Field* f : parts()) f->clear_faults();
}

std::vector<PartFault> PoseField::shown_faults() const {
  std::vector<PartFault> out;
  const auto add = [&](const std::string& name, const VectorField* part, bool is_reversed) {
    const auto& fields = part->fields();
    for (std::size_t i = 0; i < fields.size(); ++i)
      if (!fields[i]->fault().isEmpty())
        out.push_back({name + "[" + std::to_string(is_reversed ? fields.size() - i : i + 1) + "]",
                       fields[i]->fault()});
  };
  add(".position", position_, false);
  if (shown_ == Shown::angles) add(".rpy", angles_, true);
  if (shown_ == Shown::quaternion) add(".quaternion", quaternion_, false);
  if (shown_ == Shown::axis) add(".axis_angle", axis_, false);
  return out.empty() ? Field::shown_faults() : out;
}

}  // namespace robomosp::viewer
