// SPDX-License-Identifier: GPL-3.0-or-later
// Seeded random clicks, drags, keys and texts on every panel and view of the window. Afterwards the
// lines of the console, run in a new session, give the same document, and undo gives the first one.
// ROBOMOSP_RANDOM_SECONDS lengthens it, ROBOMOSP_RANDOM_SEED repeats a run.
#include <algorithm>
#include <clocale>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include <QAbstractButton>
#include <QAbstractItemView>
#include <QAbstractSlider>
#include <QContextMenuEvent>
#include <QDialog>
#include <QDir>
#include <QDockWidget>
#include <QElapsedTimer>
#include <QLabel>
#include <QLineEdit>
#include <QMenu>
#include <QMenuBar>
#include <QPlainTextEdit>
#include <QPointer>
#include <QPushButton>
#include <QScreen>
#include <QTimer>
#include <QToolButton>
#include <QWheelEvent>

#include <gtest/gtest.h>

#include "viewer/desktop/console.h"
#include "viewer/forms/command_palette.h"
#include "viewer/metered_application.h"
#include "viewer/theme/theme.h"
#include "viewer/window_harness.h"

namespace robomosp::viewer {
namespace {

constexpr double kLongestHang = 2;  ///< time of the processor [s]

/// What ends the program, leaves it, or writes to files and networks.
bool is_forbidden(const QString& name) {
  static const char* const kWords[] = {"quit",   "save",   "open",    "script", "export", "import",
                                       "browse", "film",   "picture", "reload", "server", "connect",
                                       "guard",  "clear",  "video",   "photo",  "tour",   "file",
                                       "run",    "remote", "restore", "recent", "token",  "listen"};
  return std::any_of(std::begin(kWords), std::end(kWords), [&](const char* word) {
    return name.contains(QLatin1String(word), Qt::CaseInsensitive);
  });
}

/// A drag of selected text waits for the real mouse button.
bool starts_text_drag(const QWidget* w) {
  if (const auto* label = qobject_cast<const QLabel*>(w))
    return label->textInteractionFlags().testFlag(Qt::TextSelectableByMouse);
  for (; w; w = w->parentWidget())
    if (w->inherits("QPlainTextEdit") || w->inherits("QTextEdit") || w->inherits("QLineEdit") ||
        w->inherits("QAbstractItemView") || w->inherits("QsciScintilla"))
      return true;
  return false;
}

class RandomActs : public testing::Test {
 protected:
  void SetUp() override {
    const char* seed = std::getenv("ROBOMOSP_RANDOM_SEED");
    state_ = seed ? static_cast<unsigned>(std::atoi(seed)) : 20061130;
    const char* seconds = std::getenv("ROBOMOSP_RANDOM_SECONDS");
    seconds_ = seconds ? std::atoi(seconds) : 20;
    std::cout << "Note: seed " << state_ << ", " << seconds_ << " s\n";
    // What is saved by a question that a random click answers.
    ASSERT_TRUE(QDir::setCurrent(folder_.path()));
    // Records of the library have files, which a random act may save.
    library_ = std::filesystem::path(folder_.path().toStdString()) / "library";
    std::filesystem::copy(std::filesystem::path(ROBOMOSP_SOURCE_DIR) / "scripts/library", library_,
                          std::filesystem::copy_options::recursive);
    app_ = start_program(false, library_);
  }
  unsigned random(unsigned below) {
    state_ = state_ * 1664525U + 1013904223U;
    return (state_ >> 8U) % std::max(1U, below);
  }
  template <class T>
  const T& any(const std::vector<T>& of) {
    return of[random(static_cast<unsigned>(of.size()))];
  }

  /// By a session other than that of the window, which cannot undo these steps.
  void make_records() {
    ioci::Session setup("setup");
    const auto called = [&](const char* command, const Map& args) {
      const auto done = app_->dispatch(setup, command, args);
      EXPECT_TRUE(done.ok()) << command << ": " << (done.ok() ? "" : done.error().sentence());
      const Handle* made = done.ok() ? done->as_handle() : nullptr;
      return made ? *made : Handle{};
    };
    const Handle steel = called("material.create", {{"name", "steel"}, {"density", 7850.0}});
    const Handle block = called(
        "solid.create",
        {{"name", "block"},
         {"material", "steel"},
         {"root", Map{{"kind", "box"}, {"name", "body"}, {"x", 0.2}, {"y", 0.2}, {"z", 0.2}}}});
    const Handle world = called("world.create", {{"name", "cell"}});
    for (const char* name : {"left", "right"})
      (void)called("world.add_object",
                   {{"id", world},
                    {"what", block},
                    {"name", name},
                    {"placement", Map{{"position", List{0.6 * (name[0] == 'r'), 0.0, 0.0}}}}});
    const Handle robot = called("robot.get", {{"name", "puma560"}});
    (void)called("world.add_robot", {{"id", world}, {"robot", robot}, {"name", "arm"}});
    records_ = {world, block, steel, robot};
  }

  /// Closes what would wait for a user.
  void leave_dialogs() {
    for (int i = 0; i < 20; ++i) {
      QWidget* modal = QApplication::activeModalWidget();
      QWidget* popup = QApplication::activePopupWidget();
      if (!modal && !popup) return;
      if (popup) popup->close();
      else if (auto* dialog = qobject_cast<QDialog*>(modal)) dialog->reject();
      else modal->close();
    }
  }

  [[nodiscard]] static std::vector<QWidget*> reachable(QWidget& root) {
    std::vector<QWidget*> out;
    for (QWidget* w : root.findChildren<QWidget*>())
      if (w->isVisible() && w->isEnabled() && w->width() > 0 && w->height() > 0 &&
          w->window() == root.window())
        out.push_back(w);
    return out;
  }

  /// Whether a click there could do what is forbidden.
  static bool is_dangerous(const QWidget* w, const QPoint& at) {
    if (const auto* menu = qobject_cast<const QMenu*>(w)) {
      const QAction* action = menu->actionAt(at);
      return action && (is_forbidden(action->objectName()) || is_forbidden(action->text()));
    }
    if (const auto* button = qobject_cast<const QToolButton*>(w))
      if (const QAction* action = button->defaultAction())
        return is_forbidden(action->objectName());
    return qobject_cast<const QAbstractButton*>(w) &&
           (is_forbidden(w->objectName()) || is_forbidden(w->toolTip().section('\n', 0, 0)));
  }

  void act(WindowHarness& h) {
    MainWindow& window = h.window();
    QWidget* popup = QApplication::activePopupWidget();
    QWidget* modal = QApplication::activeModalWidget();
    QWidget* root = popup ? popup : modal ? modal : static_cast<QWidget*>(&window);
    if (!popup && !modal && window.palette().isVisible() && random(2)) root = &window.palette();
    auto all = reachable(*root);
    if (all.empty() || qobject_cast<QMenu*>(root)) all.push_back(root);
    QWidget* w = any(all);
    const QPoint at(static_cast<int>(random(static_cast<unsigned>(w->width()))),
                    static_cast<int>(random(static_cast<unsigned>(w->height()))));
    last_ = w->metaObject()->className() + (" " + w->objectName().toStdString());
    switch (random(14)) {
      case 0:
      case 1:
      case 2:
      case 3:
        if (!is_dangerous(w, at)) QTest::mouseClick(w, Qt::LeftButton, {}, at);
        break;
      case 4:
      case 5:
        if (!is_dangerous(w, at) && !starts_text_drag(w)) {
          const QPointer<QWidget> alive = w;
          const QPoint by(static_cast<int>(random(160)) - 80, static_cast<int>(random(80)) - 40);
          const auto keys = random(3) == 0 ? Qt::ShiftModifier : Qt::NoModifier;
          QTest::mousePress(w, Qt::LeftButton, keys, at);
          for (int i = 1; i <= 6 && alive; ++i) {
            move_mouse(*w, at + by * i / 6.0, Qt::LeftButton, keys);
            if (random(3) == 0) QApplication::processEvents();
          }
          if (alive) QTest::mouseRelease(w, Qt::LeftButton, keys, at + by);
        }
        break;
      case 6: {
        QWheelEvent wheel(at, w->mapToGlobal(at), {}, {0, random(2) ? 120 : -120}, Qt::NoButton,
                          Qt::NoModifier, Qt::NoScrollPhase, false);
        QApplication::sendEvent(w, &wheel);
        break;
      }
      case 7:
      case 8: {
        static constexpr Qt::Key kKeys[] = {
            Qt::Key_Tab,    Qt::Key_Up,     Qt::Key_Down,      Qt::Key_Escape,
            Qt::Key_Delete, Qt::Key_Space,  Qt::Key_F2,        Qt::Key_Left,
            Qt::Key_End,    Qt::Key_PageUp, Qt::Key_Backspace, Qt::Key_Home,
            Qt::Key_F,      Qt::Key_1,      Qt::Key_P,         Qt::Key_Backtab};
        QWidget* focus = QApplication::focusWidget();
        if (focus && !is_forbidden(focus->objectName()))
          QTest::keyClick(focus, kKeys[random(std::size(kKeys))]);
        break;
      }
      case 9: {
        QWidget* focus = QApplication::focusWidget();
        static const char* const kTexts[] = {"20 mm", "bore/2", "-3",  "1e9",  "abc(",
                                             "0",     "nan",    "arm", "#fff", "0.25"};
        // Return would run what the console or a form has.
        if (focus && focus != &window.console().input() && !qobject_cast<QAbstractButton*>(focus)) {
          QTest::keyClicks(focus, kTexts[random(std::size(kTexts))]);
          if (random(2) && !root->inherits("QDialog") && root != &window.palette())
            QTest::keyClick(focus, Qt::Key_Return);
        }
        break;
      }
      case 10: {
        const Handle& record = any(records_);
        static const std::vector<std::string> kPaths{"", "objects.left", "robots.arm", "nodes.body",
                                                     "links[2]"};
        window.desk().select({{record, any(kPaths)}});
        break;
      }
      case 11: {
        if (random(3) == 0) window.set_workspace(static_cast<Workspace>(random(4)));
        else if (const auto panels = window.panels(); !panels.isEmpty())
          window.show_panel(panels[static_cast<int>(random(static_cast<unsigned>(panels.size())))]);
        break;
      }
      case 12: {
        const auto& actions = window.actions().all();
        QAction* action = actions[random(static_cast<unsigned>(actions.size()))];
        last_ = "action " + action->objectName().toStdString();
        if (action->isEnabled() && !is_forbidden(action->objectName()) && !popup && !modal)
          action->trigger();
        break;
      }
      default: {
        if (random(4) == 0) {
          QContextMenuEvent menu(QContextMenuEvent::Mouse, at, w->mapToGlobal(at));
          QApplication::sendEvent(w, &menu);
        } else if (random(4) == 0) {
          const Handle& record = any(records_);
          if (window.views().size() < 4 && record.kind != "material")
            (void)window.open_view(record, "view");
        } else if (random(6) == 0) {
          window.set_theme_and_zoom(random(2) == 0, std::vector<double>{1, 1.25, 1.5}[random(3)]);
        }
        break;
      }
    }
  }

  QTemporaryDir folder_;
  std::filesystem::path library_;
  std::unique_ptr<ioci::Application> app_;
  std::vector<Handle> records_;
  std::string last_;
  unsigned state_ = 0;
  int seconds_ = 20;
};

std::string digest_of(ioci::Application& app) { return app.document.content_digest(); }

/// The kinds and names of all records.
std::string records_of(ioci::Application& app) {
  const auto now = app.document.now();
  std::string out;
  for (const AnyId id : now->list())
    out += std::string(out.empty() ? "" : ", ") + std::string(to_string(id.kind)) + " " +
           now->find(id)->name;
  return out;
}

TEST_F(RandomActs, DoNoHarmAndLoseNoEdit) {
  auto* meter = static_cast<MeteredApplication*>(QApplication::instance());
  std::vector<std::string> lines;
  std::string reached, begin, undone, ran;
  std::string records_reached, records_undone;
  int acts = 0;
  {
    WindowHarness h(*app_, {960, 680});  // small, so that pictures take little of the time
    ASSERT_TRUE(h.settle());
    QObject listener;
    h.desk().acted.add(&listener, [&](const std::string& line) { lines.push_back(line); });
    // All that ran, with those that have no line, to find one that is missing.
    h.desk().events.add(&listener, [&](const ioci::Event& e) {
      if (e.topic != ioci::Topic::command || !e.command || e.command->only_reads) return;
      const ioci::CommandRun& run = *e.command;
      ran += "\n  " + run.line + " [session " + std::to_string(run.author.session) +
             (run.gesture ? ", gesture " + std::to_string(run.gesture) : "") +
             (run.draft ? ", draft " + std::to_string(run.draft) : "") +
             (run.failure ? ", failed" : "") + "]";
    });
    make_records();
    ASSERT_TRUE(h.settle());
    begin = digest_of(*app_);
    const std::size_t steps_before = app_->document.undo_labels().size();
    // What made the records was asked for and not acted, so that it has no lines.
    lines.clear();
    (void)h.window().open_view(records_[0], "cell");
    ASSERT_TRUE(h.settle());
    meter->reset();
    meter->start_watchdog(kLongestHang);
    QElapsedTimer clock;
    clock.start();
    // Loops of menus and dialogs end by themselves.
    QTimer patience;
    QObject::connect(&patience, &QTimer::timeout, [&] {
      if (QApplication::activePopupWidget() || QApplication::activeModalWidget()) {
        if (random(3) == 0) leave_dialogs();
        else act(h);
      }
    });
    patience.start(40);
    while (clock.elapsed() < 1000 * seconds_) {
      ++acts;
      act(h);
      QApplication::processEvents();
      if (!h.window().isVisible()) h.window().show();
    }
    patience.stop();
    leave_dialogs();
    QTest::keyClick(&h.window(), Qt::Key_Escape);
    h.window().palette().hide();
    (void)h.window().desk().act("job.list");  // a last line that changes nothing
    EXPECT_TRUE(h.settle(120000)) << "the window does not come to rest; the last act: " << last_;
    meter->stop_watchdog();
    EXPECT_EQ(meter->hangs(), 0);
    std::cout << "Note: " << acts << " acts, " << lines.size() << " lines; the longest event took "
              << 1e3 * meter->longest().elapsed << " ms (" << meter->longest().receiver
              << ", event " << meter->longest().type << ", processor "
              << 1e3 * meter->longest().processor << " ms)\n";
    // Nothing has grown beyond the screen.
    const QRect screen = h.window().screen()->geometry();
    for (const QWidget* top : QApplication::topLevelWidgets())
      if (top->isVisible()) {
        EXPECT_LE(top->width(), screen.width()) << top->objectName().toStdString();
        EXPECT_LE(top->height(), screen.height()) << top->objectName().toStdString();
      }
    reached = digest_of(*app_);
    records_reached = records_of(*app_);
    // Undo to the beginning; what was loaded from the library is no step, and stays.
    while (app_->document.undo_labels().size() > steps_before)
      if (!h.call("document.undo", {}).ok()) break;
    EXPECT_EQ(app_->document.undo_labels().size(), steps_before);
    undone = digest_of(*app_);
    records_undone = records_of(*app_);
    if (const char* file = std::getenv("ROBOMOSP_RANDOM_LINES")) {
      std::ofstream out(file);
      for (const std::string& line : lines) out << line << '\n';
    }
  }
  // The lines in a new session of a new program.
  app_.reset();
  std::filesystem::remove_all(library_);
  std::filesystem::copy(std::filesystem::path(ROBOMOSP_SOURCE_DIR) / "scripts/library", library_,
                        std::filesystem::copy_options::recursive);
  app_ = start_program(false, library_);
  WindowHarness h(*app_);
  ASSERT_TRUE(h.settle());
  make_records();
  ASSERT_EQ(digest_of(*app_), begin);
  std::string failures, all;
  for (const std::string& line : lines) all += "\n  " + line;
  const auto run = [&](const std::string& line) {
    std::optional<Result<Value>> result;
    h.desk().evaluate(line, [&](const Result<Value>& r) { result = r; });
    ASSERT_TRUE(h.until([&] { return result.has_value(); })) << line;
    if (!result->ok() && failures.size() < 2000)
      failures += "\n  " + line + ": " + result->error().sentence();
  };
  for (const std::string& line : lines)
    if (line.find(".get{") != std::string::npos) run(line);
  ASSERT_TRUE(h.settle(120000));
  EXPECT_EQ(digest_of(*app_), undone)
      << "undo does not give the first document, but:\n  " << records_undone << "\nand not:\n  "
      << records_of(*app_) << "\nafter the lines:" << all;
  for (const std::string& line : lines)
    if (!line.starts_with("window.")) run(line);
  ASSERT_TRUE(h.settle(120000));
  EXPECT_EQ(digest_of(*app_), reached)
      << "the lines give another document:\n  " << records_of(*app_) << "\nand not:\n  "
      << records_reached << "\nthe lines:" << all << "\nrefused:" << failures
      << "\nwhat ran:" << ran;
}

}  // namespace
}  // namespace robomosp::viewer

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  qputenv("ROBOMOSP_NO_THUMBNAILS", "1");
  robomosp::viewer::MeteredApplication application(argc, argv);
  std::setlocale(LC_NUMERIC, "C");
  robomosp::viewer::set_theme(application, robomosp::viewer::make_theme(true));
  return RUN_ALL_TESTS();
}
