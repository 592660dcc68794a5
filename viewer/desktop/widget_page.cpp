// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/desktop/widget_page.h"

#include <algorithm>
#include <cmath>

#include <QCoreApplication>
#include <QLabel>
#include <QLineEdit>
#include <QListWidget>
#include <QMouseEvent>
#include <QPainter>
#include <QPushButton>
#include <QStandardItemModel>
#include <QTabBar>
#include <QToolButton>
#include <QTreeView>

#include "viewer/desktop/navigator_model.h"
#include "viewer/desktop/row_delegate.h"
#include "viewer/theme/contrast.h"
#include "viewer/theme/icons.h"
#include "viewer/theme/theme.h"
#include "viewer/widgets/choice_field.h"
#include "viewer/widgets/gauge.h"
#include "viewer/widgets/number_fields.h"
#include "viewer/widgets/simple_fields.h"

namespace robomosp::viewer {
namespace {

constexpr double kPageWidth = 960, kPageHeight = 1200;
constexpr double kLeft = 24, kRight = 508, kLeftWidth = 456, kRightWidth = 428;
constexpr double kRow = 26;

NumberFormat page_format(const char* unit, const char* shown, double min, double max, double step) {
  NumberFormat f;
  f.unit = unit;
  f.shown = shown;
  f.min = min;
  f.max = max;
  f.step = step;
  f.takes_expressions = true;
  return f;
}

double page_radians(double degrees) { return degrees * std::acos(-1.0) / 180; }

}  // namespace

WidgetPage::WidgetPage(QWidget* parent) : QWidget(parent) {
  setObjectName("widget_page");
  setAccessibleName("Widgets and their states");
  setToolTip({});
  resize(sizeHint());
  const Theme& t = theme();
  QLabel* title = text("Widgets and their states", at(kLeft, 20, 300, 28));
  use_font(*title, &Theme::title);
  text(QString("%1, %2 %").arg(t.is_dark ? "dark" : "light").arg(std::lround(t.zoom * 100)),
       at(278, 22, 200, 26), "dim");
  add_numbers();
  add_pose();
  add_materials();
  add_buttons();
  add_rows();
  add_choices();
  add_joints();
  add_lengths();
}

QSize WidgetPage::sizeHint() const { return {theme().px(kPageWidth), theme().px(kPageHeight)}; }

QRect WidgetPage::at(double x, double y, double width, double height) const {
  const Theme& t = theme();
  return {t.px(x), t.px(y), t.px(width), t.px(height)};
}

QLabel* WidgetPage::text(const QString& words, const QRect& place, const char* property) {
  auto* label = new QLabel(words, this);
  label->setObjectName("widget_page.text" + QString::number(children().size()));
  label->setAccessibleName(words);
  label->setToolTip({});
  if (property) label->setProperty(property, true);
  label->setGeometry(place);
  return label;
}

void WidgetPage::block(const QString& title, const QString& about, double x, double y, double width,
                       double height) {
  QLabel* head = text(title, at(x, y - 26, width, 20));
  use_font(*head, &Theme::menu, true);
  const int after = head->fontMetrics().horizontalAdvance(title) + theme().px(8);
  head->setFixedWidth(after);
  QRect rest = at(x, y - 26, width, 20);
  rest.setLeft(rest.left() + after);
  text(about, rest, "dim");
  blocks_.push_back(at(x, y, width, height));
}

NumberField* WidgetPage::number_row(double& y, const QString& label, const QString& note) {
  text(label, at(kLeft + 27, y, 100, 22), "dim");
  text(note, at(321, y, 150, 22), "dim");
  auto* f = new NumberField(page_format("m/s", "mm/s", 0, 0.3, 0.001), this);
  f->describe(label, note, {}, "widget_page.number" + QString::number(std::lround(y)));
  f->setGeometry(at(155, y, 152, 22));
  f->set_value(Value(0.2));
  y += kRow;
  return f;
}

void WidgetPage::add_numbers() {
  block("Number field", "row 26, field 22, label 118, mark 12, padding 6", kLeft, 90, kLeftWidth,
        270);
  double y = 98;
  number_row(y, "Speed", "normal");
  number_row(y, "Speed", "hover, a drag begins")->hold_look(true, false);
  NumberField* dragged = number_row(y, "Speed", "dragged, fill of range");
  const QPoint from(dragged->width() / 2, dragged->height() / 2);
  const auto send = [&](QEvent::Type type, int dx, Qt::MouseButton button, Qt::MouseButtons held) {
    const QPointF place = from + QPoint(dx, 0);
    QMouseEvent event(type, place, dragged->mapToGlobal(place), button, held, Qt::NoModifier);
    QCoreApplication::sendEvent(dragged, &event);
  };
  send(QEvent::MouseButtonPress, 0, Qt::LeftButton, Qt::LeftButton);
  for (const int dx : {5, 17}) send(QEvent::MouseMove, dx, Qt::NoButton, Qt::LeftButton);
  NumberField* typed = number_row(y, "Speed", "focus, typing");
  typed->hold_look(false, true);
  typed->begin_edit("20 cm/s");
  NumberField* expression = number_row(y, "Speed", "expression, its value");
  expression->set_value(Value("v_max/2"));
  expression->set_computed(0.2);
  NumberField* changed = number_row(y, "Speed", "changed since saved");
  changed->set_value(Value(0.25));
  NumberField* by_default = number_row(y, "Speed", "by default, not given");
  by_default->set_value(std::nullopt);
  by_default->set_default(Value(0.2));
  NumberField* disabled = number_row(y, "Duration", "disabled, follows");
  disabled->setEnabled(false);
  NumberField* wrong = number_row(y, "Bore", "fault, sentence below");
  wrong->set_value(Value("30 mm + 2"));
  wrong->set_fault("wrong");
  for (const int row : {2, 5}) marks_.push_back(at(148, 98 + row * kRow + 11, 1, 1).topLeft());
  QLabel* sentence = text(
      "At character 7 of “30 mm + 2”: a length (30 mm) and a number without a unit (2) cannot be "
      "added. Give the number a unit.",
      at(kLeft + 27, y - 2, 420, 30), "fault");
  sentence->setWordWrap(true);
}

void WidgetPage::add_pose() {
  block("Pose editor", "axis colours only as 3 px marks", kLeft, 412, kLeftWidth, 146);
  auto* pose = new PoseField(this);
  pose->describe("Pose", "A pose", {}, "widget_page.pose");
  pose->setGeometry(at(kLeft + 8, 420, kLeftWidth - 16, 118));
  const double half = std::acos(-1.0);
  pose->set_sources([] {}, [] {});
  pose->set_value(
      Value(Map{{"position", List{0.7344, -0.0646, 0.7346}}, {"rpy", List{half, 0.0, -half}}}));
  for (NumberField* f : pose->findChildren<NumberField*>())
    if (f->objectName() == "widget_page.pose.position[2]") f->hold_look(false, true);
}

void WidgetPage::add_materials() {
  block("Material picker", "row 32, swatch 28", kLeft, 595, kLeftWidth, 166);
  auto* list = new ChoicePopup(this);
  list->setWindowFlags(Qt::Widget);
  list->setGeometry(at(kLeft + 1, 596, kLeftWidth - 2, 164));
  list->set_has_swatches(true);
  const struct {
    const char *name, *about, *colour;
  } rows[] = {{"aluminium_6082", "2700 kg/m³ · 70 GPa", "#c8ccd2"},
              {"aluminium_7075", "2810 kg/m³ · 71.7 GPa", "#b4b9c2"},
              {"cast_aluminium", "2680 kg/m³ · 72 GPa", "#9a9da3"},
              {"alumina", "3900 kg/m³ · 370 GPa", "#e8e2d4"}};
  std::vector<FieldChoice> choices;
  for (const auto& row : rows)
    choices.push_back({Value(row.name), row.name, row.about, {}, QColor(row.colour)});
  list->show_choices(choices, Value(rows[0].name));
  list->search()->setText("alu");
  list->show();
}

void WidgetPage::add_buttons() {
  block("Buttons, tabs", "height 24, radius 3, gap 8", kLeft, 798, kLeftWidth, 112);
  double x = kLeft + 8;
  const auto button = [&](const QString& name, double width, const char* property) {
    auto* b = new QPushButton(name, this);
    b->setObjectName("widget_page." + name.toLower());
    b->setAccessibleName(name);
    b->setToolTip(name);
    if (property) b->setProperty(property, true);
    b->setGeometry(at(x, 808, width, 24));
    x += width + 8;
    return b;
  };
  button("Run", 48, "filled");
  button("Normal", 66, nullptr);
  const Theme& t = theme();
  const auto held = [&](QPushButton* b, const QColor& ground, const QColor& line, int width) {
    b->setStyleSheet(QString("background: %1; border: %3px solid %2; padding: 2px;")
                         .arg(ground.name(), line.name())
                         .arg(width));
  };
  held(button("Hover", 60, nullptr), t.hover, t.field_line, 1);
  held(button("Focus", 60, nullptr), t.header, t.accent, t.focus_ring);
  held(button("Pressed", 70, nullptr), t.field, t.field_line, 1);
  button("Disabled", 76, nullptr)->setEnabled(false);
  x = kLeft + 8;
  const char* const states[] = {"normal", "hover", "checked", "disabled"};
  for (const char* state : states) {
    auto* b = new QToolButton(this);
    b->setIcon(icon("move"));
    b->setIconSize({t.icon, t.icon});
    b->setObjectName(QString("widget_page.tool_") + state);
    b->setAccessibleName(QString("Tool button, ") + state);
    b->setToolTip(b->accessibleName());
    b->setCheckable(true);
    b->setChecked(b->accessibleName().endsWith("checked"));
    b->setEnabled(!b->accessibleName().endsWith("disabled"));
    if (b->accessibleName().endsWith("hover"))
      b->setStyleSheet(QString("background: %1;").arg(t.hover.name()));
    b->setGeometry(at(x, 843, 24, 24));
    x += 28;
  }
  text("24 × 24, icon 16", at(x, 843, 110, 24), "dim");
  auto* law = new ChoiceField(this);
  law->describe("Law", "A choice", {}, "widget_page.law");
  law->set_value(Value("s_curve"));
  law->setGeometry(at(x + 110, 844, 110, 22));
  double box = x + 234;
  for (const bool on : {true, false}) {
    auto* b = new BoolField(this);
    b->describe("Switch", "A switch", {}, QString("widget_page.switch%1").arg(on));
    b->set_value(Value(on));
    b->setGeometry(at(box, 844, 20, 22));
    box += 20;
  }
  auto* tabs = new QTabBar(this);
  tabs->setObjectName("widget_page.tabs");
  tabs->setAccessibleName("Tabs");
  tabs->setToolTip({});
  tabs->setExpanding(false);
  tabs->addTab(icon("console"), "Console");
  tabs->addTab(icon("messages"), "Messages 2");
  tabs->addTab(icon("jobs"), "Jobs");
  tabs->setGeometry(at(kLeft + 1, 880, kLeftWidth - 2, 29));
}

void WidgetPage::add_rows() {
  block("Tree rows", "row 24, indent 14, icon 16, gap 6", kRight, 90, kRightWidth, 246);
  auto* model = new QStandardItemModel(this);
  const auto row = [&](QStandardItem* under, const char* name, const char* symbol,
                       const char* detail) {
    auto* item = new QStandardItem(name);
    item->setData(QString(symbol), NavigatorModel::kIcon);
    item->setData(QString(detail), NavigatorModel::kDetail);
    under->appendRow(item);
    return item;
  };
  QStandardItem* world = row(model->invisibleRootItem(), "pa10_circle", "world", "normal");
  row(row(world, "pa10", "robot", "normal"), "link", "link", "");
  QStandardItem* chosen = row(world, "deburr", "trajectory", "selected");
  row(world, "workpiece", "object", "normal");
  row(world, "block", "object", "not saved")->setData(true, NavigatorModel::kIsUnsaved);
  row(world, "3 line", "segment_line", "fault")
      ->setData(QString("Out of reach."), NavigatorModel::kFault);
  row(world, "bushing_1", "object", "quiet")->setData(true, NavigatorModel::kIsQuiet);
  row(world, "UR10e", "library", "");
  row(world, "live run", "play", "12.4 s");
  auto* tree = new QTreeView(this);
  tree->setObjectName("widget_page.rows");
  tree->setAccessibleName("Rows of a tree");
  tree->setToolTip({});
  tree->setHeaderHidden(true);
  tree->setIndentation(theme().indent);
  tree->setItemDelegate(new RowDelegate(tree));
  tree->setModel(model);
  tree->expand(world->index());
  tree->setCurrentIndex(chosen->index());
  tree->setGeometry(at(kRight + 1, 91, kRightWidth - 2, 244));
}

void WidgetPage::add_choices() {
  block("Vectors, bands, switches, gauges", "units beside narrow numbers", kRight, 384, kRightWidth,
        184);
  double y = 390;
  const auto place = [&](Field* f, const QString& label, double width) {
    text(label, at(kRight + 8, y, 110, 22), "dim");
    f->describe(label, label, {}, "widget_page." + label.toLower());
    f->setGeometry(at(kRight + 126, y, width, 22));
    y += kRow;
  };
  const NumberFormat length = page_format("m", "mm", -1, 1, 0.001);
  auto* vector = new VectorField({{"x", length, 0}, {"y", length, 1}, {"z", length, 2}}, this);
  vector->set_value(Value(List{0.558, "bore/2", 0.7346}));
  place(vector, "Start", 290);
  auto* fault = new VectorField({{"x", length, 0}, {"y", length, 1}, {"z", length, 2}}, this);
  fault->set_value(Value(List{0.558, 0.0, 0.7346}));
  place(fault, "Through", 290);
  (void)fault->place_fault("[2]", "wrong");
  auto* band = new BandField(length, this);
  band->set_range(-0.2, 0.2);
  band->set_value(Value(List{-0.1, 0.15}));
  band->set_marked(0.05);
  place(band, "Limits", 290);
  auto* colour = new ColourField(this);
  colour->set_value(Value("#c8a44a"));
  place(colour, "Colour", 160);
  auto* robot = new ChoiceField(this);
  robot->set_icon("robot");
  robot->set_value(Value("pa10"));
  robot->set_source("from the selection");
  place(robot, "Robot", 200);
  const struct {
    double share;
    const char* words;
  } shares[] = {{0.39, "joint 4, 44.6°/s"}, {0.86, "200 of 250 mm/s"}};
  for (const auto& each : shares) {
    auto* gauge = new Gauge(this);
    gauge->setObjectName(QString("widget_page.gauge%1").arg(each.share));
    gauge->setAccessibleName("Gauge");
    gauge->setToolTip("Gauge");
    gauge->set_share(each.share);
    gauge->set_text(each.words);
    text("Share", at(kRight + 8, y, 110, 22), "dim");
    gauge->setGeometry(at(kRight + 126, y, 290, 22));
    y += 22;
  }
}

void WidgetPage::add_joints() {
  block("Pendant rows", "row 26, gauge 22, torque bar 4", kRight, 605, kRightWidth, 166);
  const struct {
    const char* name;
    double q, effort;
  } rows[] = {{"shoulder_yaw", -5.02, 3.48},
              {"shoulder_pitch", 88.40, -64.5},
              {"arm_roll", 0, 0.38},
              {"elbow_pitch", 36.27, -92.7},
              {"wrist_pitch", 105.95, 0.53}};
  double y = 609;
  int number = 0;
  for (const auto& each : rows) {
    ++number;
    auto* row = new JointRow(number, each.name,
                             page_format("rad", "deg", page_radians(number == 2 ? -91 : -177),
                                         page_radians(number == 2 ? 91 : 177), page_radians(1)),
                             this);
    row->describe(each.name, "A joint", {}, QString("widget_page.joint%1").arg(number));
    row->setGeometry(at(kRight + 8, y, kRightWidth - 16, kRow));
    row->set_value(Value(page_radians(each.q)));
    row->set_effort(each.effort, 100);
    if (number == 5) row->field()->hold_look(false, true);
    y += kRow;
  }
  text("fill from zero · line at the position · lower bar: torque of its limit",
       at(kRight + 8, y + 2, kRightWidth - 16, 22), "dim");
}

void WidgetPage::add_lengths() {
  const Theme& t = theme();
  const auto rows = contrast_table(t);
  QLabel* head = text("Palette", at(kLeft, 922, 60, 20));
  use_font(*head, &Theme::menu, true);
  text("contrast on the panel beside the text colours; 4.5 is AA", at(86, 922, 500, 20), "dim");
  int i = 0;
  for (const PaletteRow& row : rows) {
    const double x = kLeft + 132 * (i % 7), y = 946 + 39 * (i / 7);
    auto* swatch = new QLabel(this);
    swatch->setObjectName(QString("widget_page.swatch%1").arg(i));
    swatch->setAccessibleName(row.name);
    swatch->setToolTip(row.name);
    swatch->setGeometry(at(x, y, 34, 34));
    swatch->setStyleSheet(QString("background: %1; border: 1px solid %2; border-radius: %3px;")
                              .arg(row.colour.name(), t.field_line.name())
                              .arg(t.radius));
    text(row.name, at(x + 42, y - 1, 88, 18));
    QLabel* value =
        text(row.colour.name().toUpper() +
                 (row.contrast > 0 ? QString(" %1").arg(row.contrast, 0, 'f', 1) : QString()),
             at(x + 42, y + 17, 90, 16), "dim");
    QFont small = t.mono;
    small.setPixelSize(t.px(10));
    value->setFont(small);
    if (++i >= 28) break;
  }
  double x = kLeft;
  const auto sample = [&](const QString& words, QFont Theme::*font, bool is_bold) {
    QLabel* l = text(words, at(x, 1112, 300, 34));
    use_font(*l, font, is_bold);
    const int width = l->fontMetrics().horizontalAdvance(words);
    l->setFixedWidth(width + 2);
    x += width / t.zoom + 20;
  };
  sample("Type", &Theme::menu, true);
  sample("20 title", &Theme::title, true);
  sample("17 heading", &Theme::heading, true);
  sample("13 menu, section", &Theme::menu, true);
  sample("12 rows, labels", &Theme::ui, false);
  sample("11 units, notes", &Theme::small, false);
  sample("11.5 numbers 0123.456 \u22127", &Theme::mono, false);
  sample("12.5 code", &Theme::code, false);
  QLabel* space = text("Space", at(kLeft, 1146, 60, 20));
  use_font(*space, &Theme::menu, true);
  text(
      "4  8  12  16  24    radius 3    separator 1    focus ring 2    dock header 28    bars 32    "
      "status 24    icon 16 in 24, stroke 1.3",
      at(84, 1146, 860, 20), "dim");
}

void WidgetPage::paintEvent(QPaintEvent*) {
  const Theme& t = theme();
  QPainter p(this);
  p.fillRect(rect(), t.window);
  for (const QRect& each : blocks_) {
    p.fillRect(each, t.panel);
    p.setPen(t.line);
    p.drawRect(each.adjusted(0, 0, -1, -1));
  }
  p.setRenderHint(QPainter::Antialiasing);
  p.setPen(Qt::NoPen);
  p.setBrush(t.accent);
  for (const QPoint& each : marks_) p.drawEllipse(QPointF(each), t.px(2), t.px(2));
}

}  // namespace robomosp::viewer
