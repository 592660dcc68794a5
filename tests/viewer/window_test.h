// SPDX-License-Identifier: GPL-3.0-or-later
// WindowTest: a window on an application with plugins and library, for tests that drive it.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <QAbstractButton>
#include <QApplication>
#include <QTemporaryDir>
#include <QTest>
#include <QTreeView>

#include <gtest/gtest.h>

#include "viewer/desktop/automation.h"
#include "viewer/desktop/console.h"
#include "viewer/desktop/main_window.h"
#include "viewer/desktop/messages.h"
#include "viewer/desktop/navigator.h"
#include "viewer/desktop/values.h"
#include "viewer/theme/theme.h"
#include "viewer/window_harness.h"

namespace robomosp::viewer {

inline constexpr int kPatienceMs = 60000;

class WindowTest : public testing::Test {
 protected:
  explicit WindowTest(QSize size) : size_(size) {}
  static void SetUpTestSuite() { holder() = start_program(); }
  static void TearDownTestSuite() { holder().reset(); }
  static ioci::Application& app() { return *holder(); }

  void SetUp() override {
    app().document.clear();
    auto desk = Desk::open(app(), {});
    ASSERT_TRUE(desk.ok()) << desk.error().sentence();
    desk_ = std::move(*desk);
    // Most tests need no stills, which take long on software OpenGL.
    Settings(folder_.filePath("desktop.ini")).set_fine_pictures(false);
    show_window();
  }
  void show_window() {
    window_ = std::make_unique<MainWindow>(
        *desk_, MainWindow::Options{folder_.filePath("desktop.ini"), false});
    window_->resize(size_);
    window_->show();
    QApplication::setActiveWindow(window_.get());
    settle();
  }
  void TearDown() override {
    if (window_) window_->close_now();
    window_.reset();
    desk_.reset();
  }
  bool until(const std::function<bool()>& is_so, int patience_ms = kPatienceMs) {
    return QTest::qWaitFor(is_so, patience_ms);
  }
  void settle() {
    int settled = 0;
    EXPECT_TRUE(until([&] {
      settled = window_->is_settled() && !desk_->has_calls() ? settled + 1 : 0;
      return settled > 3;
    })) << "the window does not come to rest";
  }
  /// The result of a command in the window's session.
  Value called(const std::string& command, Map args) {
    const auto answer = desk_->ask(command, std::move(args), {});
    EXPECT_TRUE(until([&] { return answer.result() != nullptr; })) << command;
    const Result<Value>* r = answer.result();
    EXPECT_TRUE(r && r->ok()) << command << ": " << (r && !r->ok() ? r->error().sentence() : "");
    return r && r->ok() ? **r : Value();
  }
  Handle made(const std::string& command, Map args) {
    const Value v = called(command, std::move(args));
    EXPECT_NE(v.as_handle(), nullptr) << command;
    return v.as_handle() ? *v.as_handle() : Handle{};
  }
  template <class W = QWidget>
  W* widget(const QString& name) {
    W* found = window_->findChild<W*>(name);
    EXPECT_NE(found, nullptr) << name.toStdString();
    return found;
  }
  QAction* action(const char* name) {
    QAction* found = window_->actions().find(name);
    EXPECT_NE(found, nullptr) << name;
    return found;
  }
  void key(Qt::Key key, Qt::KeyboardModifiers modifiers = {}) {
    QApplication::setActiveWindow(window_.get());
    QTest::keyClick(window_.get(), key, modifiers);
  }
  void click(const QString& name) {
    if (auto* w = widget(name)) QTest::mouseClick(w, Qt::LeftButton);
  }
  QTreeView& tree() { return window_->navigator().tree(); }
  /// The row of the tree with these names, from the top; loads what is closed.
  QModelIndex row(const std::vector<QString>& names) {
    QModelIndex at;
    for (const QString& name : names) {
      if (at.isValid()) tree().expand(at);
      QModelIndex found;
      until([&] {
        QAbstractItemModel* m = tree().model();
        if (m->canFetchMore(at)) m->fetchMore(at);
        for (int i = 0; i < m->rowCount(at) && !found.isValid(); ++i)
          if (m->index(i, 0, at).data().toString() == name) found = m->index(i, 0, at);
        return found.isValid();
      });
      EXPECT_TRUE(found.isValid()) << name.toStdString();
      if (!found.isValid()) return {};
      at = found;
    }
    return at;
  }
  /// Keeps a picture of the window in the folder ROBOMOSP_PHOTOS, if that is set.
  void photo(const std::string& name) {
    const QString folder = qEnvironmentVariable("ROBOMOSP_PHOTOS");
    if (folder.isEmpty()) return;
    settle();
    const auto png = photograph_of(*window_);
    ASSERT_TRUE(png.ok());
    QFile file(folder + "/" + QString::fromStdString(name) + ".png");
    ASSERT_TRUE(file.open(QIODevice::WriteOnly));
    file.write(png->data(), static_cast<qint64>(png->size()));
  }

  static std::unique_ptr<ioci::Application>& holder() {
    static std::unique_ptr<ioci::Application> app;
    return app;
  }
  const QSize size_;
  QTemporaryDir folder_;
  std::unique_ptr<Desk> desk_;
  std::unique_ptr<MainWindow> window_;
};

/// Of the panels.
class RoomsTest : public WindowTest {
 protected:
  RoomsTest() : WindowTest({1440, 900}) {}
};

}  // namespace robomosp::viewer
