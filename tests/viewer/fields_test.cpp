// SPDX-License-Identifier: GPL-3.0-or-later
// Rows and fields that adapt to their space, faults at parts, forms made in slices, the page of all
// widgets, and the contrast of the theme. ROBOMOSP_PHOTOS=FOLDER keeps the pictures.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include <QApplication>
#include <QClipboard>
#include <QLabel>
#include <QLineEdit>
#include <QListWidget>
#include <QPushButton>
#include <QTest>

#include <gtest/gtest.h>

#include "docs/example_arguments.h"
#include "ioci/client/client.h"
#include "kernel/schema.h"
#include "kernel/type.h"
#include "viewer/desktop/widget_page.h"
#include "viewer/forms/command_form.h"
#include "viewer/forms/composite_fields.h"
#include "viewer/forms/field_factory.h"
#include "viewer/forms/schema_form.h"
#include "viewer/theme/contrast.h"
#include "viewer/theme/theme.h"
#include "viewer/widgets/choice_field.h"
#include "viewer/widgets/gauge.h"
#include "viewer/widgets/number_fields.h"
#include "viewer/widgets/simple_fields.h"

namespace robomosp::viewer {
namespace {

ioci::Application& program() { return test::examples_app(); }
QApplication& gui() { return *qobject_cast<QApplication*>(QApplication::instance()); }

bool wait_for(const std::function<bool()>& done, int ms = 60000) {
  return QTest::qWaitFor([&] { return done(); }, ms);
}

void type_number(NumberField* f, const QString& text) {
  QTest::keyClick(f, Qt::Key_F2);
  auto* line = f->findChild<QLineEdit*>();
  ASSERT_NE(line, nullptr);
  line->selectAll();
  QTest::keyClicks(line, text);
  QTest::keyClick(line, Qt::Key_Return);
}

void keep(QWidget& w, const std::string& name) {
  const char* folder = std::getenv("ROBOMOSP_PHOTOS");
  if (folder) w.grab().save(QString("%1/%2.png").arg(folder, QString::fromStdString(name)));
}

FormContextPtr record_context() {
  auto c = std::make_shared<FormContext>();
  c->of = Map{{"kind", "robot"}};
  c->title = "record.set";
  c->takes_expressions = true;
  return c;
}

ParamSpec param(const char* name, const char* type, const char* unit = "") {
  ParamSpec p;
  p.name = name;
  p.type = type;
  p.unit = unit;
  p.doc = "A value.";
  return p;
}

Schema link_schema() {
  return {param("a", "real", "m"),           param("position", "vec3", "m"),
          param("placement", "pose"),        param("inertia", "vec(6)", "kg m^2"),
          param("parts", "list<vec3>", "m"), param("limits", "map<real>", "m")};
}

// ---- faults at parts ----

TEST(Parts, OnlyTheWrongComponentOfAVectorIsRed) {
  QWidget window;
  SchemaForm form(record_context(), link_schema(), {}, &window);
  window.show();
  form.fill(Map{{"position", List{0.1, 0.2, 0.3}}});
  auto* position = dynamic_cast<VectorField*>(form.field("position"));
  ASSERT_NE(position, nullptr);
  std::string changed;
  form.on_change = [&](const std::string& path, const std::optional<Value>&, Field::Stage) {
    changed = path;
  };
  type_number(position->fields()[1], "12 deg");
  EXPECT_EQ(changed, "position");
  EXPECT_TRUE(position->fields()[0]->fault().isEmpty());
  EXPECT_FALSE(position->fields()[1]->fault().isEmpty());
  EXPECT_TRUE(position->fields()[2]->fault().isEmpty());
  EXPECT_FALSE(form.row("position")->fault_text().isEmpty());
  // A refusal that names the whole is about the component that was edited.
  form.clear_faults();
  type_number(position->fields()[2], "400");
  (void)form.show_faults({{"position", "It is too far.", {}}});
  EXPECT_TRUE(position->fields()[0]->fault().isEmpty());
  EXPECT_TRUE(position->fields()[1]->fault().isEmpty());
  EXPECT_EQ(position->fields()[2]->fault(), "It is too far.");
  // Before any edit it is about all of them.
  form.fill(Map{{"position", List{0.1, 0.2, 0.3}}});
  form.clear_faults();
  (void)form.show_faults({{"position", "It is wrong.", {}}});
  for (const NumberField* f : position->fields()) EXPECT_EQ(f->fault(), "It is wrong.");
}

TEST(Parts, FaultsOfListsMapsAndPosesAreAtTheirParts) {
  QWidget window;
  SchemaForm form(record_context(), link_schema(), {}, &window);
  window.show();
  form.fill(
      Map{{"parts", List{List{0.0, 0.0, 0.0}, List{0.1, 0.1, 0.1}}},
          {"limits", Map{{"low", 0.1}, {"high", 0.2}}},
          {"placement", Map{{"position", List{0.0, 0.0, 0.0}}, {"rpy", List{0.0, 0.0, 0.0}}}}});
  const auto part_of = [&](const char* name) -> Field* {
    auto* options = dynamic_cast<OptionsField*>(form.field(name));
    if (!options) return form.field(name);
    if (!options->editor()) options->open_editor(false);
    return options->editor();
  };
  auto* list = dynamic_cast<ListField*>(part_of("parts"));
  ASSERT_NE(list, nullptr);
  (void)form.show_faults({{"parts[2][3]", "Wrong.", {}}});
  const auto faults = form.field_faults();
  ASSERT_EQ(faults.size(), 1U);
  EXPECT_EQ(faults[0].path, "parts[2][3]");
  form.clear_faults();
  auto* map = dynamic_cast<MapField*>(part_of("limits"));
  ASSERT_NE(map, nullptr);
  (void)form.show_faults({{"limits.high", "Wrong.", {}}});
  ASSERT_EQ(form.field_faults().size(), 1U);
  EXPECT_EQ(form.field_faults()[0].path, "limits.high");
  form.clear_faults();
  auto* pose = dynamic_cast<PoseField*>(part_of("placement"));
  ASSERT_NE(pose, nullptr);
  (void)form.show_faults({{"placement.rpy[1]", "Wrong.", {}}});
  ASSERT_EQ(form.field_faults().size(), 1U);
  EXPECT_EQ(form.field_faults()[0].path, "placement.rpy[1]");
}

// ---- no Lua where there is a field ----

TEST(Parts, PlacementsJointsAndParentsHaveTheirFields) {
  QWidget window;
  for (const ParamSpec& p : {param("placement", "pose"), param("q", "joints")}) {
    Field* f = make_field(record_context(), p, p.name, &window);
    auto* options = dynamic_cast<OptionsField*>(f);
    ASSERT_NE(options, nullptr) << p.name;
    const Value given = p.name == "q" ? Value(NumericArray({0.1, 0.2}))
                                      : Value(Map{{"position", NumericArray({0.1, 0.2, 0.3})},
                                                  {"rpy", NumericArray({0.0, 0.0, 0.5})}});
    options->set_value(given);
    ASSERT_NE(options->editor(), nullptr) << p.name;
    EXPECT_EQ(dynamic_cast<LiteralField*>(options->editor()), nullptr) << p.name;
    EXPECT_EQ(*options->value(), given) << p.name;
  }
}

TEST(Parts, APoseHasAnAxisAndIsCopiedAndPasted) {
  QWidget window;
  PoseField pose(&window);
  pose.describe("Pose", {}, {}, "pose");
  window.show();
  const double third = std::acos(-1.0) / 3;
  pose.set_value(Value(Map{{"position", List{0.1, 0.2, 0.3}}, {"rpy", List{0.0, 0.0, third}}}));
  pose.show_as(PoseField::Shown::axis);
  std::vector<NumberField*> axis;
  for (int i = 1; i <= 4; ++i)
    axis.push_back(
        static_cast<NumberField*>(pose.findChild<QWidget*>(QString("pose.axis_angle[%1]").arg(i))));
  EXPECT_NEAR(*axis[2]->number(), 1, 1e-12);
  EXPECT_NEAR(*axis[3]->number(), third, 1e-12);
  type_number(axis[3], "90");
  ASSERT_TRUE(pose.value()->as_map());
  EXPECT_NE(pose.value()->as_map()->find("axis_angle"), nullptr);
  EXPECT_NEAR(pose.pose().R[0], 0, 1e-12);
  EXPECT_NEAR(pose.pose().R[3], 1, 1e-12);
  pose.copy();
  const Pose before = pose.pose();
  pose.set_value(Value(Map{{"position", List{0.0, 0.0, 0.0}}}));
  int changes = 0;
  pose.on_change = [&](Field::Stage) { ++changes; };
  pose.paste();
  EXPECT_EQ(changes, 1);
  for (std::size_t i = 0; i < 9; ++i) EXPECT_NEAR(pose.pose().R[i], before.R[i], 1e-12);
  EXPECT_NEAR(pose.pose().p[2], 0.3, 1e-12);
  const struct {
    const char* text;
    double x, r0, r3;
  } rows[] = {{"1 2 3", 1, before.R[0], before.R[3]},
              {"0.5, 0, 0, 90, 0, 0", 0.5, 0, 1},
              {"0.4 0 0 1 0 0 0", 0.4, 1, 0},
              {"1 0 0 0.7\n0 1 0 0\n0 0 1 0", 0.7, 1, 0},
              {"\u22120.2; 0; 0", -0.2, 1, 0}};
  for (const auto& row : rows) {
    QApplication::clipboard()->setText(row.text);
    pose.paste();
    EXPECT_NEAR(pose.pose().p[0], row.x, 1e-12) << row.text;
    EXPECT_NEAR(pose.pose().R[0], row.r0, 1e-12) << row.text;
    EXPECT_NEAR(pose.pose().R[3], row.r3, 1e-12) << row.text;
  }
  // What is no pose changes nothing and says so.
  changes = 0;
  for (const char* wrong : {"", "hello", "1 2", "nan 0 0", "1 2 3 4 5", "inf 0 0 0 0 0"}) {
    QApplication::clipboard()->setText(wrong);
    pose.paste();
    EXPECT_EQ(changes, 0) << wrong;
    EXPECT_FALSE(pose.fault().isEmpty()) << wrong;
  }
}

// ---- space ----

TEST(Space, ANarrowVectorShowsItsUnitBesideTheLabelAndARowBreaks) {
  QWidget window;
  SchemaForm form(record_context(), link_schema(), {}, &window);
  window.show();
  form.fill(Map{{"position", List{0.1, 0.2, 0.3}}});
  form.resize(320, 400);
  FormRowWidget* row = form.row("position");
  auto* vector = dynamic_cast<VectorField*>(row->field());
  EXPECT_TRUE(wait_for([&] { return !row->is_stacked() && vector->unit_beside() == "mm"; }));
  form.resize(276, 400);
  EXPECT_TRUE(wait_for([&] { return row->is_stacked() && !form.row("a")->is_stacked(); }));
  form.resize(640, 400);
  EXPECT_TRUE(wait_for([&] { return !row->is_stacked() && vector->unit_beside().isEmpty(); }));
}

TEST(Space, NoFieldIsCutAtAnyWidthAndZoom) {
  for (const double zoom : {0.75, 1.0, 1.33, 1.5, 2.0}) {
    set_theme(gui(), make_theme(true, zoom));
    QWidget window;
    SchemaForm form(record_context(), link_schema(), {}, &window);
    window.show();
    form.fill(Map{{"a", 0.2},
                  {"position", List{0.1, 0.2, 0.3}},
                  {"placement", Map{{"position", List{0.0, 0.0, 0.0}}}},
                  {"inertia", List{1.0, 2.0, 3.0, 0.1, 0.2, 0.3}}});
    for (const int width : {216, 276, 320, 400}) {
      form.resize(theme().px(width), theme().px(700));
      QString cut;
      int fitted = 0;  // times in a row
      EXPECT_TRUE(wait_for([&] {
        cut.clear();
        for (const QWidget* w : form.findChildren<QWidget*>())
          if (w->isVisible() && dynamic_cast<const Field*>(w) &&
              w->mapTo(&form, QPoint(w->width(), 0)).x() > form.width())
            cut += " " + w->objectName();
        fitted = cut.isEmpty() ? fitted + 1 : 0;
        return fitted > 3;
      })) << cut.toStdString()
          << " at " << width << " and zoom " << zoom;
    }
    keep(form, "narrow-" + std::to_string(zoom));
  }
  set_theme(gui(), make_theme(true));
}

TEST(Space, AJointHasTwoLinesWhereItIsNarrow) {
  NumberFormat angle;
  angle.unit = "rad";
  angle.shown = "deg";
  angle.min = -2;
  angle.max = 2;
  JointRow row(1, "shoulder_yaw", angle);
  row.describe("shoulder_yaw", {}, {}, "joint");
  row.set_value(Value(0.5));
  row.set_effort(3.2, 10);
  row.resize(480, row.sizeHint().height());
  row.show();
  EXPECT_FALSE(row.is_stacked());
  row.resize(320, row.height());
  EXPECT_TRUE(row.is_stacked());
  EXPECT_GT(row.sizeHint().height(), theme().property_row);
  row.resize(320, row.sizeHint().height());
  // The bar has most of the width.
  const auto buttons = row.findChildren<QWidget*>(QString(), Qt::FindDirectChildrenOnly);
  QWidget* less = row.findChild<QWidget*>("joint.less");
  EXPECT_GT(row.field()->geometry().left() - less->geometry().right(), 150);
  EXPECT_GE(less->geometry().left(), 0);
}

// ---- contrast ----

TEST(Contrast, AllTextMeetsAaInBothThemes) {
  EXPECT_NEAR(contrast(Qt::white, Qt::black), 21, 1e-9);
  EXPECT_NEAR(contrast(QColor("#767676"), Qt::white), 4.54, 0.01);  // the published limit grey
  for (const bool is_dark : {true, false})
    for (const bool strong : {false, true}) {
      Theme t = make_theme(is_dark, 1, strong);
      for (const TextPair& pair : text_pairs(t))
        EXPECT_GE(contrast(pair.text_colour, pair.ground_colour), 4.5)
            << pair.text.toStdString() << " on " << pair.ground.toStdString()
            << (is_dark ? " (dark)" : " (light)");
      if (strong) {
        EXPECT_GE(contrast(t.field_line, t.panel), 4.5);
      } else {
        EXPECT_LT(contrast(t.field_line, t.panel), 3);
      }
    }
}

// ---- the page of all widgets ----

TEST(Page, ShowsEveryWidgetInBothThemes) {
  for (const bool is_dark : {true, false}) {
    set_theme(gui(), make_theme(is_dark));
    WidgetPage page;
    page.show();
    EXPECT_TRUE(wait_for([&] { return page.size() == QSize(960, 1200); }));
    EXPECT_GT(page.findChildren<NumberField*>().size(), 30);
    for (const QWidget* w : page.findChildren<QWidget*>())
      if (const auto* f = dynamic_cast<const Field*>(w)) {
        EXPECT_FALSE(f->objectName().isEmpty());
        EXPECT_FALSE(f->accessibleName().isEmpty()) << f->objectName().toStdString();
        EXPECT_FALSE(f->toolTip().isEmpty()) << f->objectName().toStdString();
      }
    keep(page, std::string("page-") + (is_dark ? "dark" : "light"));
  }
  set_theme(gui(), make_theme(true));
}

// ---- slices ----

class Slices : public testing::Test {
 protected:
  void SetUp() override {
    ioci::Client::Options options;
    options.name = "fields";
    options.wake = [] {
      QMetaObject::invokeMethod(
          &gui(),
          [] {
            if (current) current->client->deliver();
          },
          Qt::QueuedConnection);
    };
    current = this;
    auto opened = ioci::Client::open(program(), std::move(options));
    ASSERT_TRUE(opened.ok());
    client = std::move(*opened);
  }
  void TearDown() override {
    current = nullptr;
    client.reset();
  }
  static inline Slices* current = nullptr;
  std::unique_ptr<ioci::Client> client;
};

TEST_F(Slices, AFormIsMadeAFewRowsAtATimeAndIsWholeInTheEnd) {
  SchemaForm::slice_ms = 0;  // whatever the machine's speed
  int slices = 0;
  for (const char* command : {"view.render", "robot.simulate", "world.simulate"}) {
    QWidget window;
    CommandForm form(*client, &window);
    form.resize(860, 700);
    window.resize(900, 760);
    window.show();
    bool is_open = false;
    form.on_ready = [&] { is_open = true; };
    form.on_grown = [&] { ++slices; };
    form.open(command, {});
    ASSERT_TRUE(wait_for([&] { return is_open; })) << command;
    SchemaForm* fields = form.form();
    ASSERT_TRUE(wait_for([&] { return fields->is_complete(); })) << command;
    const auto names = fields->shown_names();
    EXPECT_GT(names.size(), 5U);
    for (const std::string& name : names) EXPECT_NE(fields->field(name), nullptr) << name;
    // The order on the screen is that of the keyboard.
    EXPECT_TRUE(wait_for([&] {
      std::vector<QWidget*> chain;
      for (QWidget* w = fields->nextInFocusChain(); w != fields; w = w->nextInFocusChain())
        if (fields->isAncestorOf(w)) chain.push_back(w);
      std::vector<std::ptrdiff_t> places;
      for (const std::string& name : names) {
        Field* f = fields->field(name);
        QWidget* target = f->focusProxy() ? f->focusProxy() : f;
        const auto at = std::find(chain.begin(), chain.end(), target);
        if (at != chain.end()) places.push_back(at - chain.begin());
      }
      return std::is_sorted(places.begin(), places.end());
    })) << command;
  }
  EXPECT_GT(slices, 10) << "forms were made at once";
  SchemaForm::slice_ms = 6;
}

}  // namespace
}  // namespace robomosp::viewer

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  QApplication app(argc, argv);
  robomosp::viewer::set_theme(app, robomosp::viewer::make_theme(true));
  const int result = RUN_ALL_TESTS();
  robomosp::test::examples_holder().reset();
  return result;
}
