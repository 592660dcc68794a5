// SPDX-License-Identifier: GPL-3.0-or-later
// Help, shortcuts and connections of the window, driven with mouse and keys.
#include "viewer/window_test.h"

#include <QCheckBox>
#include <QComboBox>
#include <QCursor>
#include <QDockWidget>
#include <QKeySequenceEdit>
#include <QLabel>
#include <QLineEdit>
#include <QPlainTextEdit>
#include <QTabBar>
#include <QTabWidget>
#include <QTextBrowser>
#include <QToolButton>
#include <QTreeWidget>

#include "viewer/desktop/connections.h"
#include "viewer/desktop/console_signature.h"
#include "viewer/desktop/help_panel.h"
#include "viewer/desktop/shortcuts.h"
#include "viewer/desktop/status_line.h"
#include "viewer/forms/command_form.h"
#include "viewer/forms/command_palette.h"
#include "viewer/forms/properties_panel.h"
#include "viewer/forms/schema_form.h"
#include "viewer/widgets/number_field.h"

namespace robomosp::viewer {
namespace {

// --- help ------------------------------------------------------------------------------------

TEST_F(RoomsTest, F1ShowsThePageOfThePanelThatHasTheFocus) {
  tree().setFocus();
  QCursor::setPos(tree().viewport()->mapToGlobal(QPoint(60, 60)));
  key(Qt::Key_F1);
  EXPECT_TRUE(widget<QDockWidget>("help_dock")->isVisible());
  EXPECT_EQ(window_->help().page(), "user/desktop.md#navigator");
  EXPECT_TRUE(window_->help().browser().toPlainText().contains("Rows load when you open them"));
  EXPECT_TRUE(window_->console().text().contains("window.open{panel = \"help\""));
  photo("help");
}

TEST_F(RoomsTest, AWidgetWithACommandHasThePageOfTheCommand) {
  EXPECT_EQ(command_in("Start the server\nserver.start{...}"), "server.start");
  EXPECT_EQ(command_in("Nothing to call"), "");
  EXPECT_EQ(help_page_of(widget("connections")->findChild<QWidget*>("token_make")),
            "command:server.grant");
  EXPECT_EQ(help_page_of(widget("console_input")), "user/console.md");
}

TEST_F(RoomsTest, ThePaletteShowsThePageOfItsCommand) {
  window_->palette().open_command("robot.gravity_torques");
  ASSERT_TRUE(until([&] { return window_->palette().has_form(); }));
  key(Qt::Key_F1);
  EXPECT_EQ(window_->help().page(), "command:robot.gravity_torques");
  EXPECT_TRUE(window_->help().browser().toPlainText().contains("hold the robot still"));
  EXPECT_FALSE(window_->palette().isVisible());
}

/// The window's own session may wait for the window, too: its call does not wait for itself.
TEST_F(RoomsTest, AFormWaitsForTheWindowWithoutWaitingForItself) {
  for (const bool is_job : {false, true}) {
    CommandForm& form = *window_->palette().form();
    window_->palette().open_command("window.settle");
    ASSERT_TRUE(until([&] { return form.command() == "window.settle" && form.form(); }));
    form.fill(Map{{"at_most", 600.0}});
    form.run(is_job);
    // Neither does it wait for what waits behind it.
    (void)desk_->ask("document.history", {}, {});
    ASSERT_TRUE(until([&] { return !form.is_running(); })) << "it waits for itself";
    EXPECT_TRUE(form.outcome().contains("Done")) << form.outcome().toStdString();
  }
}

/// F2 renames, Delete deletes and letters change the view, but not where a number is typed.
TEST_F(RoomsTest, KeysOfANumberFieldAreNoShortcutsOfTheWindow) {
  const Handle solid =
      made("solid.create",
           {{"name", "block"},
            {"root", Map{{"kind", "box"}, {"name", "body"}, {"x", 0.2}, {"y", 0.2}, {"z", 0.2}}}});
  window_->navigator().tree().setFocus();
  desk_->select({{solid, {}}});
  settle();
  ASSERT_TRUE(until([&] { return action("rename")->isEnabled(); }));
  ASSERT_TRUE(action("delete")->isEnabled());
  const bool was_perspective = action("perspective")->isChecked();
  desk_->select({{solid, "nodes.body"}});
  NumberField* x = nullptr;
  ASSERT_TRUE(until([&] {
    const SchemaForm* form = window_->properties().form();
    x = form ? dynamic_cast<NumberField*>(form->field("x")) : nullptr;
    return x && x->isVisible();
  }));
  settle();
  QApplication::setActiveWindow(window_.get());
  for (const auto& [key, text] : {std::pair(Qt::Key_F2, ""), {Qt::Key_P, "p"}, {Qt::Key_F, "f"}}) {
    QTest::keyClick(x, key);
    auto* line = x->findChild<QLineEdit*>();
    ASSERT_TRUE(x->is_editing() && line) << text;
    if (*text) {
      EXPECT_EQ(line->text(), text);
    }
    QTest::keyClick(line, Qt::Key_Escape);
    ASSERT_TRUE(until([&] { return !x->is_editing(); }));
  }
  QTest::keyClick(x, Qt::Key_Delete);
  // With Ctrl it is the window's again.
  QTest::keyClick(x, Qt::Key_Up, Qt::ControlModifier);
  settle();
  EXPECT_EQ(action("perspective")->isChecked(), was_perspective);
  EXPECT_TRUE(app().document.now()->find(Kind::solid, "block"));
  const Value tree = called("solid.tree", {{"id", solid}});
  EXPECT_DOUBLE_EQ(number_at(map_of(tree), "x"), 0.2);
}

TEST_F(RoomsTest, AMessageBeforeTheStatusLineIsShownIsNotDrawnOverItsLabels) {
  StatusLine line;
  auto* label = new QLabel("mm");
  line.addWidget(label);
  line.showMessage("Opening a script");
  line.show();
  EXPECT_FALSE(label->isVisible());
  line.clearMessage();
  EXPECT_TRUE(label->isVisible());
}

TEST_F(RoomsTest, ClosingDuringALongInputClosesOrAsks) {
  const auto run_long = [this] {
    window_->console().run("local t = os.clock() while os.clock() - t < 600 do end");
    ASSERT_TRUE(until([&] { return desk_->has_calls(); }));
  };
  made("material.create", {{"name", "tin"}, {"density", 7300.0}});
  settle();
  ASSERT_TRUE(until([&] { return desk_->has_unsaved(); }));
  run_long();
  window_->close();
  ASSERT_TRUE(until([&] { return widget("guard_discard")->isVisible(); }));
  EXPECT_TRUE(window_->isVisible());
  // Who stays is not asked by an earlier wish to close.
  window_->close();
  click("guard_stay");
  EXPECT_FALSE(QTest::qWaitFor([&] { return widget("guard_discard")->isVisible(); }, 1000));
  desk_->client().cancel_all();
  ASSERT_TRUE(until([&] { return !desk_->has_calls(); }));
  called("document.clear", {});
  settle();
  ASSERT_TRUE(until([&] { return !desk_->has_unsaved(); }));
  run_long();
  window_->close();
  EXPECT_TRUE(until([&] { return !window_->isVisible(); }));
}

TEST_F(RoomsTest, LinksBackForwardAndSearchGoThroughThePages) {
  HelpPanel& help = window_->help();
  help.open("user/desktop.md");
  help.open("user/desktop.md#closing");
  Q_EMIT help.browser().anchorClicked(QUrl("sessions.md"));
  EXPECT_EQ(help.page(), "user/sessions.md");
  Q_EMIT help.browser().anchorClicked(QUrl("../ioci/robot.md#robotfk"));
  EXPECT_EQ(help.page(), "command:robot.fk");
  Q_EMIT help.browser().anchorClicked(QUrl("../ioci/robot.md"));
  EXPECT_EQ(help.page(), "topic:robot");
  help.back();
  help.back();
  EXPECT_EQ(help.page(), "user/sessions.md");
  help.forward();
  EXPECT_EQ(help.page(), "command:robot.fk");
  window_->show_panel("help");
  auto* search = widget<QLineEdit>("help_search");
  search->clear();
  QTest::keyClicks(search, "gravity torques");
  QTest::keyClick(search, Qt::Key_Return);
  EXPECT_EQ(help.page(), "search:gravity torques");
  EXPECT_TRUE(help.browser().toPlainText().contains("robot.gravity_torques"));
  help.open("search:no_such_word_anywhere");
  EXPECT_TRUE(help.browser().toPlainText().contains("Nothing found"));
  help.open("user/../../secret.md");
  EXPECT_TRUE(help.browser().toPlainText().contains("not installed"));
  photo("help_search");
}

TEST_F(RoomsTest, AllPagesAreShownAndTheirLinksLeadToPages) {
  HelpPanel& help = window_->help();
  ASSERT_TRUE(help.manual().is_there());
  const QStringList pages = help.manual().pages("user");
  EXPECT_GT(pages.size(), 40);
  for (const QString& page : pages) {
    help.open(page);
    EXPECT_FALSE(help.browser().toPlainText().contains("This page is not installed"))
        << page.toStdString();
    EXPECT_GT(help.browser().toPlainText().size(), 50) << page.toStdString();
  }
  help.open("contents");
  EXPECT_TRUE(help.browser().toPlainText().contains("The desktop"));
  EXPECT_TRUE(help.browser().toPlainText().contains("trajectory"));
}

TEST_F(RoomsTest, AnExampleRunsInTheConsole) {
  HelpPanel& help = window_->help();
  window_->show_panel("help");
  help.open("command:material.create");
  ASSERT_FALSE(help.examples().isEmpty());
  Q_EMIT help.browser().anchorClicked(QUrl("run:0"));
  EXPECT_TRUE(until([&] { return window_->console().text().contains("material.create"); }));
  settle();
  EXPECT_FALSE(list_of(called("material.list", {})).empty());
  EXPECT_TRUE(window_->console().text().contains("material.create"));
}

// --- console ---------------------------------------------------------------------------------

TEST(ConsoleSignature, FindsTheCallAndTheArgumentAroundAPlace) {
  const auto call = [](const char* lua) {
    return utf8(call_around(lua, static_cast<int>(QString(lua).size())));
  };
  EXPECT_EQ(call("robot.fk{id = "), "robot.fk");
  EXPECT_EQ(call("robot.fk({id = "), "robot.fk");
  EXPECT_EQ(call("x = world.add_robot{position = {1, 2"), "world.add_robot");
  EXPECT_EQ(call("robot(\"a\"):fk{q"), ":fk");
  EXPECT_EQ(call("robot.fk{id = \"a\"}"), "");
  EXPECT_EQ(call("print(\"robot.fk{\""), "print");
  EXPECT_EQ(call("-- robot.fk{"), "");
  EXPECT_EQ(call(""), "");
  EXPECT_EQ(argument_at("robot.fk{id = \"a\", q = ", 23), "q");
}

TEST_F(RoomsTest, TheConsoleShowsTheArgumentsOfTheCommandThatIsTyped) {
  window_->show_panel("console");
  auto* signature = widget<QLabel>("console_signature");
  EXPECT_FALSE(signature->isVisible());
  QTest::keyClicks(&window_->console().input(), "robot.fk{q = ");
  ASSERT_TRUE(until([&] { return signature->isVisible(); }));
  EXPECT_TRUE(signature->text().contains("<b><i>q</i></b>") ||
              signature->text().contains("<b>q</b>"))
      << signature->text().toStdString();
  photo("console_signature");
  QTest::keyClicks(&window_->console().input(), "{0}}");
  EXPECT_TRUE(until([&] { return !signature->isVisible(); }));
}

// --- frame -----------------------------------------------------------------------------------

TEST_F(RoomsTest, ABrokenFileIsExplainedInPlaceAndNothingIsLost) {
  const Handle world = made("world.create", {{"name", "kept"}});
  const QString file = folder_.filePath("broken.wld");
  QFile out(file);
  ASSERT_TRUE(out.open(QIODevice::WriteOnly));
  out.write("robomosp-world 1\nname \"x\"\nthis is no line of a world {\n");
  out.close();
  ioci::OpenRequest request;
  request.what = utf8(file);
  window_->open(std::move(request), false);
  auto* notice = widget("notice");
  ASSERT_TRUE(until([&] { return notice->isVisible(); }));
  EXPECT_TRUE(widget<QLabel>("notice_text")->text().contains("broken.wld"));
  photo("notice");
  EXPECT_GT(window_->messages().model().rowCount({}), 0);
  EXPECT_TRUE(app().document.now()->find(Kind::world, "kept"));
  click("notice_close");
  EXPECT_FALSE(notice->isVisible());
  EXPECT_TRUE(world.number > 0);
}

TEST_F(RoomsTest, NoSecondTabBarAfterAFloatingNavigatorAndAnotherWorkspace) {
  const auto visible_bars = [&] {
    int bars = 0;
    for (QTabBar* bar : window_->findChildren<QTabBar*>(QString(), Qt::FindDirectChildrenOnly))
      bars += bar->isVisible();
    return bars;
  };
  const int before = visible_bars();
  auto* navigator = widget<QDockWidget>("navigator_dock");
  navigator->setFloating(true);
  settle();
  window_->set_workspace(Workspace::robot);
  settle();
  window_->set_workspace(Workspace::motion);
  settle();
  EXPECT_EQ(visible_bars(), before);
  photo("workspace_after_floating");
  window_->palette().open();
  window_->set_workspace(Workspace::model);
  settle();
  // The palette is above the docks that came back.
  const QPoint middle = window_->palette().mapTo(window_.get(), window_->palette().rect().center());
  const QWidget* top = window_->childAt(middle);
  EXPECT_TRUE(top == &window_->palette() || window_->palette().isAncestorOf(top));
}

TEST_F(RoomsTest, TheNextStartShowsNoPanelThatWasNotOpen) {
  for (int start = 0; start < 2; ++start) {
    window_->close_now();
    window_.reset();
    show_window();
    for (const char* room : {"help_dock", "story_dock", "connections_dock", "shortcuts_dock"})
      EXPECT_FALSE(widget<QDockWidget>(room)->isVisible()) << room;
    window_->set_workspace(start == 0 ? Workspace::robot : Workspace::motion);
    settle();
    EXPECT_FALSE(widget<QDockWidget>("help_dock")->isVisible());
  }
  EXPECT_FALSE(window_->help().manual().scripts().empty());
}

// --- shortcuts -------------------------------------------------------------------------------

TEST_F(RoomsTest, AShortcutIsChangedAndKeptAndMenusFollow) {
  window_->show_panel("shortcuts");
  auto* list = widget<QTreeWidget>("shortcuts_list");
  auto* search = widget<QLineEdit>("shortcuts_search");
  EXPECT_EQ(list->topLevelItemCount(), static_cast<int>(window_->actions().all().size()));
  QTest::keyClicks(search, "duplicate");
  QTreeWidgetItem* found = nullptr;
  for (int i = 0; i < list->topLevelItemCount(); ++i)
    if (!list->topLevelItem(i)->isHidden()) found = list->topLevelItem(i);
  ASSERT_NE(found, nullptr);
  EXPECT_EQ(found->text(0), "Duplicate");
  list->setCurrentItem(found);
  auto* keys = widget<QKeySequenceEdit>("shortcuts_keys");
  keys->setKeySequence(QKeySequence("Ctrl+Alt+K"));
  click("shortcuts_set");
  EXPECT_EQ(action("duplicate")->shortcut(), QKeySequence("Ctrl+Alt+K"));
  EXPECT_TRUE(action("duplicate")->toolTip().contains("Ctrl+Alt+K"));
  EXPECT_TRUE(window_->console().text().contains(
      "window.set_keys{action = \"duplicate\", keys = \"Ctrl+Alt+K\"}"));
  photo("shortcuts");
  window_->close_now();
  window_.reset();
  show_window();
  EXPECT_EQ(action("duplicate")->shortcut(), QKeySequence("Ctrl+Alt+K"));
  ASSERT_TRUE(window_->set_keys("duplicate", {}).ok());
  EXPECT_EQ(action("duplicate")->shortcut(), QKeySequence("Ctrl+D"));
}

TEST_F(RoomsTest, AConflictOfKeysNamesBothEntriesAndCanBeTaken) {
  const auto r = window_->set_keys("duplicate", QString("Ctrl+S"));
  ASSERT_FALSE(r.ok());
  EXPECT_NE(r.error().sentence().find("\"Save\""), std::string::npos);
  EXPECT_NE(r.error().sentence().find("\"Duplicate\""), std::string::npos);
  EXPECT_FALSE(window_->set_keys("no_such_entry", QString("Ctrl+S")).ok());
  EXPECT_FALSE(window_->set_keys("duplicate", QString("no keys at all")).ok());
  window_->show_panel("shortcuts");
  auto* list = widget<QTreeWidget>("shortcuts_list");
  for (int i = 0; i < list->topLevelItemCount(); ++i)
    if (list->topLevelItem(i)->text(0) == "Duplicate") list->setCurrentItem(list->topLevelItem(i));
  widget<QKeySequenceEdit>("shortcuts_keys")->setKeySequence(QKeySequence("Ctrl+S"));
  EXPECT_TRUE(widget<QLabel>("shortcuts_note")->text().contains("Save"));
  ASSERT_TRUE(widget("shortcuts_take")->isVisible());
  click("shortcuts_take");
  EXPECT_EQ(action("duplicate")->shortcut(), QKeySequence("Ctrl+S"));
  EXPECT_TRUE(action("save")->shortcut().isEmpty());
  click("shortcuts_reset_all");
  EXPECT_EQ(action("save")->shortcut(), QKeySequence("Ctrl+S"));
  EXPECT_EQ(action("duplicate")->shortcut(), QKeySequence("Ctrl+D"));
}

// --- connections -----------------------------------------------------------------------------

TEST_F(RoomsTest, AServerIsStartedAnswersALineAndIsStopped) {
  EXPECT_EQ(widget<QToolButton>("status_server")->text(), "local only");
  click("status_server");
  ASSERT_TRUE(widget("connections")->isVisible());
  settle();
  widget<QLineEdit>("server_address")->setText("127.0.0.1:0");
  click("server_start");
  ASSERT_TRUE(until([&] { return window_->connections().state().is_running; }));
  const QString address = window_->connections().state().addresses.value(0);
  EXPECT_TRUE(widget<QToolButton>("status_server")->text().startsWith(address));
  photo("connections_server");
  // The program connects to itself: the same commands as for another one.
  widget<QTabWidget>("connections_pages")->setCurrentIndex(3);
  widget<QLineEdit>("remote_address")->setText(address);
  click("remote_connect");
  ASSERT_TRUE(until([&] { return widget<QComboBox>("remote_list")->count() == 1; }));
  auto* line = widget<QLineEdit>("remote_line");
  auto* answers = widget<QPlainTextEdit>("remote_answers");
  QTest::keyClicks(line, "world.create{name = \"remote_cell\"}");
  QTest::keyClick(line, Qt::Key_Return);
  EXPECT_TRUE(until([&] {
    return answers->toPlainText().contains("remote_cell\"", Qt::CaseSensitive) &&
           app().document.now()->find(Kind::world, "remote_cell");
  }));
  QTest::keyClicks(line, "Nonsense is no line");
  QTest::keyClick(line, Qt::Key_Return);
  EXPECT_TRUE(until([&] { return answers->toPlainText().contains("no classic command"); }));
  QTest::keyClicks(line, "world.create{name = ");
  QTest::keyClick(line, Qt::Key_Return);
  settle();
  QTest::keyClick(line, Qt::Key_Up);
  photo("connections_remote");
  // The client is listed, with its traffic, and its connection can be closed.
  widget<QTabWidget>("connections_pages")->setCurrentIndex(1);
  auto* clients = widget<QTreeWidget>("clients_list");
  ASSERT_TRUE(until([&] { return clients->topLevelItemCount() == 1; }));
  EXPECT_EQ(clients->topLevelItem(0)->text(1), "robomosp-desktop");
  EXPECT_TRUE(until([&] { return clients->topLevelItem(0)->text(7).toInt() > 1; }));
  photo("connections_clients");
  click("clients_kick");
  EXPECT_TRUE(until([&] { return window_->connections().state().clients == 0; }));
  widget<QTabWidget>("connections_pages")->setCurrentIndex(0);
  click("server_start");
  EXPECT_TRUE(until([&] { return !window_->connections().state().is_running; }));
  EXPECT_EQ(widget<QToolButton>("status_server")->text(), "local only");
}

TEST_F(RoomsTest, ATokenIsShownOnceAndNowhereElse) {
  const QByteArray config_before = qgetenv("XDG_CONFIG_HOME");
  qputenv("XDG_CONFIG_HOME", folder_.path().toUtf8());
  window_->show_panel("connections");
  widget<QTabWidget>("connections_pages")->setCurrentIndex(2);
  settle();
  auto* note = widget<QLabel>("connections_note");
  click("token_make");
  EXPECT_EQ(note->text(), "Give the token a name first.");
  EXPECT_EQ(note->palette().color(QPalette::WindowText), theme().fault);
  // It stays a fault in another theme.
  window_->set_theme_and_zoom(!theme().is_dark, 1);
  EXPECT_EQ(note->palette().color(QPalette::WindowText), theme().fault);
  window_->set_theme_and_zoom(!theme().is_dark, 1);
  QTest::keyClicks(widget<QLineEdit>("token_name"), "student");
  widget<QCheckBox>("token_rights_edits")->setChecked(false);
  click("token_make");
  auto* secret = widget<QLineEdit>("token_secret_text");
  ASSERT_TRUE(until([&] { return !secret->text().isEmpty(); }));
  settle();
  const QString text = secret->text();
  EXPECT_GT(text.size(), 40);
  EXPECT_TRUE(window_->console().text().contains("server.grant"));
  EXPECT_FALSE(window_->console().text().contains(text));
  for (int i = 0; i < window_->messages().model().rowCount({}); ++i)
    EXPECT_FALSE(window_->messages().model().index(i).data().toString().contains(text));
  auto* tokens = widget<QTreeWidget>("tokens_list");
  ASSERT_TRUE(until([&] { return tokens->topLevelItemCount() == 1; }));
  EXPECT_EQ(tokens->topLevelItem(0)->text(0), "student");
  EXPECT_EQ(tokens->topLevelItem(0)->text(1), "reads, simulates");
  photo("connections_tokens");
  click("token_hide");
  EXPECT_TRUE(secret->text().isEmpty());
  tokens->setCurrentItem(tokens->topLevelItem(0));
  click("token_revoke");
  EXPECT_TRUE(until([&] { return tokens->topLevelItemCount() == 0; }));
  if (config_before.isEmpty()) qunsetenv("XDG_CONFIG_HOME");
  else qputenv("XDG_CONFIG_HOME", config_before);
}

TEST(RemoteLine, IsACommandLuaOrAClassicLine) {
  EXPECT_EQ(read_remote_line("robot.list")->method, "robot.list");
  EXPECT_EQ(text_at(read_remote_line("robot.fk{id = \"arm\"}")->params, "id"), "arm");
  EXPECT_EQ(text_at(read_remote_line("= 1 + 1")->params, "code"), "return  1 + 1");
  EXPECT_EQ(read_remote_line("Worlds Create cell")->method, "ioci.classic");
  EXPECT_EQ(read_remote_line("version")->method, "ioci.classic");
  EXPECT_FALSE(read_remote_line("robot.fk{id = }").ok());
  EXPECT_FALSE(read_remote_line("robot.fk{1, 2}").ok());
}

}  // namespace
}  // namespace robomosp::viewer
