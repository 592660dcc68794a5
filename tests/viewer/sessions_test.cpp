// SPDX-License-Identifier: GPL-3.0-or-later
// Two sessions on one document: the window, and another one as a console or a remote client has.
#include <atomic>
#include <cmath>
#include <memory>
#include <string>
#include <thread>

#include <QApplication>
#include <QLineEdit>
#include <QPointer>
#include <QTabWidget>
#include <QTest>

#include <gtest/gtest.h>

#include "viewer/desktop/console.h"
#include "viewer/desktop/navigator.h"
#include "viewer/forms/properties_panel.h"
#include "viewer/forms/schema_form.h"
#include "viewer/theme/theme.h"
#include "viewer/widgets/number_field.h"
#include "viewer/window_harness.h"

namespace robomosp::viewer {
namespace {

class TwoSessions : public testing::Test {
 protected:
  static void SetUpTestSuite() { holder() = start_program(); }
  static void TearDownTestSuite() { holder().reset(); }
  static std::unique_ptr<ioci::Application>& holder() {
    static std::unique_ptr<ioci::Application> app;
    return app;
  }
  void SetUp() override {
    holder()->document.clear();
    h = std::make_unique<WindowHarness>(*holder());
    other = std::make_unique<OtherSession>(*holder());
    ASSERT_TRUE(h->settle());
    block = h->made(
        "solid.create",
        {{"name", "block"},
         {"root", Map{{"kind", "box"}, {"name", "body"}, {"x", 0.2}, {"y", 0.2}, {"z", 0.2}}}});
    world = h->made("world.create", {{"name", "cell"}});
    ASSERT_TRUE(
        h->call("world.add_object", {{"id", world}, {"what", block}, {"name", "left"}}).ok());
    ASSERT_NE(h->window().open_view(world, "cell"), nullptr);
    ASSERT_TRUE(h->settle());
  }
  void TearDown() override {
    other.reset();
    h.reset();
  }
  /// A command of the other session, which must succeed.
  Value done(const std::string& command, const Map& args) {
    const auto r = other->call(command, args);
    EXPECT_TRUE(r.ok()) << command << ": " << (r.ok() ? "" : r.error().sentence());
    return r.ok() ? *r : Value();
  }
  [[nodiscard]] bool has(Kind kind, const std::string& name) const {
    return holder()->document.now()->find(kind, name).has_value();
  }
  double length_of_block() {
    const auto r = h->call("solid.tree", {{"id", block}});
    if (!r.ok() || !r->as_map()) return std::nan("");
    const Value* x = r->as_map()->find("x");
    return x && x->as_real() ? *x->as_real() : std::nan("");
  }
  /// The field of a number of the solid in the properties.
  NumberField* field(const std::string& name) {
    h->desk().select({{block, "nodes.body"}});
    NumberField* found = nullptr;
    EXPECT_TRUE(h->until([&] {
      const SchemaForm* form = h->window().properties().form();
      found = form ? dynamic_cast<NumberField*>(form->field(name)) : nullptr;
      return found && found->isVisible();
    })) << "the properties have no field "
        << name;
    QApplication::processEvents();
    return found;
  }
  void key(Qt::Key key, Qt::KeyboardModifiers modifiers) {
    QApplication::setActiveWindow(&h->window());
    QTest::keyClick(&h->window(), key, modifiers);
  }
  std::unique_ptr<WindowHarness> h;
  std::unique_ptr<OtherSession> other;
  Handle block, world;
};

TEST_F(TwoSessions, TheWindowShowsTheChangesOfTheOtherAtOnce) {
  ViewTab* view = h->window().current_view();
  ASSERT_NE(view, nullptr);
  NumberField* x = field("x");
  ASSERT_NE(x, nullptr);
  ASSERT_TRUE(h->settle());
  const QImage before = view->display().shown();
  done("solid.set", {{"id", block}, {"path", "body.x"}, {"value", 0.4}});
  EXPECT_TRUE(h->until([&] {
    NumberField* now = dynamic_cast<NumberField*>(h->window().properties().form()->field("x"));
    return now && now->number() && std::fabs(*now->number() - 0.4) < 1e-12;
  })) << "the properties keep the old value";
  ASSERT_TRUE(h->settle());
  EXPECT_TRUE(h->until([&] { return view->display().shown() != before; }))
      << "the picture keeps the old size";
  done("material.create", {{"name", "tin"}, {"density", 7300.0}});
  done("world.rename", {{"id", world}, {"name", "hall"}});
  EXPECT_TRUE(h->until([&] { return view->name() == "hall"; })) << "the tab keeps the old name";
  const Handle tin = *done("material.get", {{"name", "tin"}}).as_handle();
  EXPECT_TRUE(h->until([&] {
    const auto rows = h->window().navigator().model().rows_of({tin, {}});
    return !rows.isEmpty() && rows.front().data().toString() == "tin";
  })) << "the navigator lacks the new material";
}

TEST_F(TwoSessions, TheOtherSeesTheChangesOfTheWindowAtOnce) {
  NumberField* x = field("x");
  ASSERT_NE(x, nullptr);
  QTest::keyClick(x, Qt::Key_F2);
  auto* line = x->findChild<QLineEdit*>();
  ASSERT_NE(line, nullptr);
  line->selectAll();
  QTest::keyClicks(line, "300 mm");
  QTest::keyClick(line, Qt::Key_Return);
  EXPECT_TRUE(h->until([&] {
    const Value tree = done("solid.tree", {{"id", block}});
    const Value* v = tree.as_map() ? tree.as_map()->find("x") : nullptr;
    return v && v->as_real() && std::fabs(*v->as_real() - 0.3) < 1e-12;
  }));
}

TEST_F(TwoSessions, EachUndoesItsOwnSteps) {
  ASSERT_NE(h->window().actions().find("new_world"), nullptr);
  h->window().actions().find("new_world")->trigger();
  ASSERT_TRUE(h->until([&] { return has(Kind::world, "new_world"); }));
  done("material.create", {{"name", "tin"}, {"density", 7300.0}});
  ASSERT_TRUE(h->settle());
  // The newer step is the other's; the window undoes its own.
  key(Qt::Key_Z, Qt::ControlModifier);
  EXPECT_TRUE(h->until([&] { return !has(Kind::world, "new_world"); }));
  EXPECT_TRUE(has(Kind::material, "tin"));
  done("document.undo", {});
  EXPECT_FALSE(has(Kind::material, "tin"));
  EXPECT_TRUE(has(Kind::world, "cell"));
  // The other one has no more steps.
  EXPECT_FALSE(other->call("document.undo", {}).ok());
  EXPECT_TRUE(has(Kind::world, "cell"));
}

TEST_F(TwoSessions, WhatADragEditsIsRefusedToTheOtherUntilItEnds) {
  NumberField* x = field("x");
  ASSERT_NE(x, nullptr);
  const QPoint at(x->width() / 2, x->height() / 2);
  QTest::mousePress(x, Qt::LeftButton, {}, at);
  for (int i = 1; i <= 10; ++i) move_mouse(*x, at + QPointF(3 * i, 0));
  ASSERT_TRUE(h->until([&] { return std::fabs(length_of_block() - 0.2) > 1e-6; }));
  const auto refused =
      other->call("solid.set", {{"id", block}, {"path", "body.x"}, {"value", 0.7}});
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.error().sentence().find("block"), std::string::npos)
      << refused.error().sentence();
  // Another record is free meanwhile.
  done("material.create", {{"name", "tin"}, {"density", 7300.0}});
  QTest::mouseRelease(x, Qt::LeftButton, {}, at + QPoint(30, 0));
  // The window's calls run in their order: this one after the end of the gesture.
  ASSERT_TRUE(h->call("document.history", {{"at_most", 1}}).ok());
  done("solid.set", {{"id", block}, {"path", "body.x"}, {"value", 0.7}});
  EXPECT_NEAR(length_of_block(), 0.7, 1e-12);
}

TEST_F(TwoSessions, ARecordThatTheOtherDeletesDuringADragDoesNoHarm) {
  // Nothing refers to it, so that it may be deleted.
  block = h->made(
      "solid.create",
      {{"name", "loose"},
       {"root", Map{{"kind", "box"}, {"name", "body"}, {"x", 0.2}, {"y", 0.2}, {"z", 0.2}}}});
  NumberField* x = field("x");
  ASSERT_NE(x, nullptr);
  const QPoint at(x->width() / 2, x->height() / 2);
  QTest::mousePress(x, Qt::LeftButton, {}, at);
  const auto deleted = other->call("solid.remove", {{"id", block}});
  const bool is_deleted = deleted.ok();
  const QPointer<NumberField> alive(x);
  for (int i = 1; i <= 10 && alive; ++i) {
    move_mouse(*alive, at + QPointF(3 * i, 0));
    QTest::qWait(10);
  }
  if (alive) QTest::mouseRelease(alive, Qt::LeftButton, {}, at + QPoint(30, 0));
  ASSERT_TRUE(h->settle());
  EXPECT_EQ(has(Kind::solid, "loose"), !is_deleted);
  // Whether it was deleted or not, the gesture of the drag ended with the mouse.
  const auto gesture = h->call("gesture.begin", {{"label", "another"}});
  ASSERT_TRUE(gesture.ok()) << "the gesture of the drag is still open: "
                            << gesture.error().sentence();
  EXPECT_TRUE(h->call("gesture.cancel", {{"gesture", *gesture}}).ok());
  // The window works on.
  h->window().actions().find("new_world")->trigger();
  EXPECT_TRUE(h->until([&] { return has(Kind::world, "new_world"); }));
}

TEST_F(TwoSessions, AWorldThatTheOtherDeletesIsMarkedInItsTab) {
  ViewTab* view = h->window().current_view();
  done("world.remove", {{"id", world}});
  EXPECT_TRUE(h->until([&] { return !view->is_there(); }));
  auto* tabs = h->window().findChild<QTabWidget*>("tabs");
  EXPECT_TRUE(h->until([&] { return tabs->tabText(tabs->indexOf(view)).contains("deleted"); }));
  done("document.undo", {});
  EXPECT_TRUE(h->until([&] { return view->is_there(); }));
}

TEST_F(TwoSessions, BothEditAtOnceAndNothingIsLost) {
  // Each makes its own records; neither waits for the other.
  constexpr int kEach = 40;
  std::atomic<int> failed{0};
  std::jthread thread([&] {
    for (int i = 0; i < kEach; ++i)
      if (!other
               ->call("material.create",
                      {{"name", "other_" + std::to_string(i)}, {"density", 1000.0 + i}})
               .ok())
        ++failed;
  });
  for (int i = 0; i < kEach; ++i) {
    h->desk().act("material.create",
                  {{"name", "window_" + std::to_string(i)}, {"density", 2000.0 + i}});
    QApplication::processEvents();
  }
  ASSERT_TRUE(h->settle());
  thread.join();
  EXPECT_EQ(failed, 0);
  for (int i = 0; i < kEach; ++i) {
    EXPECT_TRUE(has(Kind::material, "other_" + std::to_string(i))) << i;
    EXPECT_TRUE(has(Kind::material, "window_" + std::to_string(i))) << i;
  }
  // Only the acts of the window are among its lines.
  EXPECT_TRUE(h->window().console().text().contains("window_39"));
  EXPECT_FALSE(h->window().console().text().contains("other_"));
}

}  // namespace
}  // namespace robomosp::viewer
