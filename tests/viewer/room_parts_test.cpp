// SPDX-License-Identifier: GPL-3.0-or-later
// Parts of several panels: pictures in the console, marks of what is not saved, thumbnails of the
// library, memory of recordings, the start page alone.
#include "viewer/window_test.h"

#include <algorithm>
#include <fstream>

#include <QClipboard>
#include <QComboBox>
#include <QDockWidget>
#include <QLabel>
#include <QPersistentModelIndex>
#include <QPushButton>
#include <QScrollBar>
#include <QTabBar>
#include <QTabWidget>
#include <QTextBlock>
#include <QTextCursor>

#include "viewer/desktop/console_output.h"
#include "viewer/desktop/start_page.h"
#include "viewer/desktop/thumbnails.h"
#include "viewer/forms/result_picture.h"
#include "viewer/forms/result_view.h"
#include "viewer/forms/small_plot.h"

namespace robomosp::viewer {
namespace {

// --- pictures of results ---------------------------------------------------------------------

TEST(ResultPicture, PlotsAreDrawnInTheirShape) {
  const QByteArray plot =
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"100\" height=\"50\" viewBox=\"0 0 100 "
      "50\" fill=\"#39424d\">\n<rect width=\"100\" height=\"50\" fill=\"#ffffff\"/>\n"
      "<path d=\"M10 25L90 25\" fill=\"none\" stroke=\"#ff0000\" stroke-width=\"6\"/>\n"
      "<path d=\"M60 5L90 5L90 15L60 15Z\" fill=\"#0000ff\" fill-opacity=\"1\"/>\n"
      "<text x=\"5\" y=\"45\" font-size=\"14\" text-anchor=\"start\">a &lt; b</text>\n</svg>\n";
  const auto drawn = [](const QByteArray& svg) {
    ResultPicture p;
    p.bytes = svg;
    return draw_picture(p, QSize(400, 400));
  };
  const QImage image = drawn(plot);
  ASSERT_EQ(image.size(), QSize(400, 200));
  EXPECT_EQ(image.pixelColor(200, 100), QColor(Qt::red));
  EXPECT_EQ(image.pixelColor(300, 40), QColor(Qt::blue));
  EXPECT_EQ(image.pixelColor(300, 150), QColor(Qt::white));
  int dark = 0;  // the text
  for (int y = 130; y < 195; ++y)
    for (int x = 20; x < 120; ++x) dark += image.pixelColor(x, y).lightness() < 120;
  EXPECT_GT(dark, 30);
  EXPECT_TRUE(drawn("no picture").isNull());
  EXPECT_TRUE(drawn("<svg").isNull());
}

TEST(ResultPicture, IsFoundInResultsThatAreOrNamePictures) {
  EXPECT_FALSE(picture_of(Value(1.5)));
  EXPECT_FALSE(picture_of(Value("a text")));
  EXPECT_FALSE(picture_of(Value("iVBORw0KGgo is no Base64")));
  EXPECT_FALSE(picture_of(Value(Map{{"file", "a.txt"}})));
  ASSERT_TRUE(picture_of(Value(Map{{"file", "folder/a.png"}})));
  EXPECT_EQ(picture_of(Value(Map{{"file", "folder/a.png"}}))->title, "a.png");
  EXPECT_TRUE(picture_of(Value("a.svg")));
  const auto bytes = picture_of(Value("iVBORw0KGgoAAAA="));
  ASSERT_TRUE(bytes);
  EXPECT_TRUE(bytes->bytes.startsWith("\x89PNG"));
  EXPECT_TRUE(draw_picture(*bytes, QSize(100, 100)).isNull());  // it is cut off
}

TEST(SmallPlot, ShowsTorquesOrTheFirstGroupOverTime) {
  const auto columns = [](std::initializer_list<const char*> names) {
    List out;
    for (const char* name : names) out.emplace_back(Map{{"name", name}});
    return out;
  };
  EXPECT_EQ(small_plot_columns(columns({"time", "q1", "q2", "x"})),
            (std::vector<std::string>{"q1", "q2"}));
  EXPECT_EQ(small_plot_columns(columns({"time", "q1", "tau1", "tau2"})),
            (std::vector<std::string>{"tau1", "tau2"}));
  EXPECT_TRUE(small_plot_columns(columns({"x", "y"})).empty());
  EXPECT_TRUE(small_plot_columns(columns({"time"})).empty());
  // A peak of one sample among many is drawn.
  constexpr std::size_t kRows = 100'000;
  std::vector<double> values(2 * kRows);
  for (std::size_t i = 0; i < kRows; ++i) values[2 * i] = 0.001 * static_cast<double>(i);
  values[2 * (kRows / 2) + 1] = 5;
  const Theme t = make_theme(true);
  const QImage image = draw_small_plot(NumericArray(std::move(values), kRows, 2), {340, 220}, 1, t);
  ASSERT_EQ(image.size(), QSize(340, 220));
  int at_top = 0;
  for (int x = 0; x < image.width(); ++x)
    for (int y = 40; y < 100; ++y) {
      const QColor c = image.pixelColor(x, y);
      at_top += std::abs(c.red() - t.series[0].red()) < 40 &&
                std::abs(c.blue() - t.series[0].blue()) < 40;
    }
  EXPECT_GT(at_top, 20);
  EXPECT_TRUE(draw_small_plot(NumericArray({1, 2}), {340, 220}, 1, t).isNull());
}

class ConsolePicturesTest : public RoomsTest {
 protected:
  ConsoleOutput& output() { return window_->console().output(); }
  /// Runs a line and waits for its pictures.
  void run(const QString& line, std::size_t pictures) {
    window_->show_panel("console");
    window_->console().run(line);
    EXPECT_TRUE(until([&] { return output().pictures() == pictures && !output().is_drawing(); }))
        << output().pictures() << " pictures\n"
        << window_->console().text().right(800).toStdString();
    settle();
  }
};

TEST_F(ConsolePicturesTest, APictureIsShownBelowItsTextAndOpensByAClick) {
  run("solid.create{name = \"plate\", root = {kind = \"box\", x = 0.2, y = 0.1, z = 0.02}}", 0);
  run("view.picture{what = \"plate\", size = {240, 160}, quality = \"draft\"}", 1);
  // The text has the beginning of the bytes only.
  EXPECT_LT(window_->console().text().size(), 3000);
  EXPECT_TRUE(window_->console().text().contains("240")) << window_->console().text().toStdString();
  const QRect place = output().last_picture_place();
  ASSERT_FALSE(place.isEmpty());
  EXPECT_LE(place.width(), 240);
  photo("console_picture");
  QTest::mouseClick(output().viewport(), Qt::LeftButton, {}, place.center());
  auto* tab = window_->findChild<QWidget*>("result_tab");
  ASSERT_NE(tab, nullptr);
  EXPECT_EQ(dynamic_cast<ResultView*>(tab)->shown_mode(), "picture");
  photo("console_picture_tab");
  // A second click shows the same tab.
  const int tabs = widget<QTabWidget>("tabs")->count();
  window_->show_start();
  QTest::mouseClick(output().viewport(), Qt::LeftButton, {}, place.center());
  EXPECT_EQ(widget<QTabWidget>("tabs")->count(), tabs);
  EXPECT_EQ(widget<QTabWidget>("tabs")->currentWidget(), tab);
  action("close_tab")->trigger();
  EXPECT_EQ(window_->findChild<QWidget*>("result_tab"), nullptr);
  // Return opens the newest, without a mouse.
  QTest::keyClick(&output(), Qt::Key_Return);
  EXPECT_NE(window_->findChild<QWidget*>("result_tab"), nullptr);
}

TEST_F(ConsolePicturesTest, CopiedTextHasNoPictures) {
  run("solid.create{name = \"plate\", root = {kind = \"box\", x = 0.2, y = 0.1, z = 0.02}}", 0);
  run("solid.render{id = \"plate\", file = \"" + folder_.filePath("plate.png") +
          "\", size = {96, 64}, quality = \"draft\"}",
      1);
  run("6 * 7", 1);
  // The lines that follow are below the picture, and not far.
  const QTextBlock picture = output().document()->lastBlock().previous().previous();
  const int below = output().cursorRect(QTextCursor(picture.next())).top();
  EXPECT_GE(below, output().last_picture_place().bottom());
  EXPECT_LE(below, output().last_picture_place().bottom() + 40);
  EXPECT_TRUE(output().toPlainText().contains("\nplate.png\n"));  // the title of the picture
  output().selectAll();
  output().copy();
  const QString copied = QApplication::clipboard()->text();
  EXPECT_EQ(copied, window_->console().text());
  EXPECT_FALSE(copied.contains("\nplate.png\n"));
  EXPECT_FALSE(copied.contains(QChar(QChar::LineSeparator)));
  EXPECT_FALSE(copied.contains(QChar(QChar::ObjectReplacementCharacter)));
  EXPECT_TRUE(copied.contains("42"));
  EXPECT_FALSE(copied.contains("\n\n\n"));
  // A file that is not there is no picture.
  run("\"" + folder_.filePath("none.png") + "\"", 1);
}

TEST_F(ConsolePicturesTest, ARecordingIsShownAsAPlotAndOpensAsOne) {
  const QString make =
      "recording.create{title = \"drop\", columns = {{name = \"time\", unit = \"s\", values = {0, "
      "1, 2, 3}}, {name = \"height\", unit = \"m\", values = {4, 3, 1, 0}}}}";
  run("drop = " + make, 0);
  run("drop", 1);
  EXPECT_TRUE(output().toPlainText().contains("plot of drop"));
  photo("console_plot");
  const QRect place = output().last_picture_place();
  ASSERT_FALSE(place.isEmpty());
  QTest::mouseClick(output().viewport(), Qt::LeftButton, {}, place.center());
  auto* tab = dynamic_cast<ResultView*>(window_->findChild<QWidget*>("result_tab"));
  ASSERT_NE(tab, nullptr);
  EXPECT_TRUE(until([&] { return tab->shown_mode() == "plot"; }));
  // One without a time has none, and no line that says so.
  run("recording.create{title = \"no time\", columns = {{name = \"x\", values = {0, 1}}, {name = "
      "\"y\", values = {4, 3}}}}",
      1);
  EXPECT_FALSE(output().toPlainText().contains("plot of no time"));
  // Plots as SVG, as text and as a file.
  run("drop:plot{columns = \"height\", as = \"svg\"}", 2);
  EXPECT_LT(window_->console().text().size(), 6000);
  run("drop:plot{columns = \"height\", file = \"" + folder_.filePath("drop.svg") + "\"}", 3);
  photo("console_svg");
}

TEST_F(ConsolePicturesTest, ThereAreNotMoreThanTheNewest) {
  const QString svg =
      "('<svg width=\"40\" height=\"20\"><rect width=\"40\" height=\"20\" "
      "fill=\"#ff0000\"/></svg>')";
  run(svg, 1);
  for (std::size_t i = 1; i < ConsoleOutput::kMostPictures + 2; ++i) window_->console().run(svg);
  EXPECT_TRUE(until([&] {
    return output().toPlainText().count("(no longer shown)") == 2 && !output().is_drawing();
  }));
  EXPECT_EQ(output().pictures(), ConsoleOutput::kMostPictures);
  // Another zoom keeps the space of each.
  window_->set_theme_and_zoom(true, 0.8);
  settle();
  output().verticalScrollBar()->setValue(output().verticalScrollBar()->maximum());
  const QRect place = output().last_picture_place();
  EXPECT_FALSE(place.isEmpty());
  window_->set_theme_and_zoom(true, 1);
  window_->console().clear();
  EXPECT_EQ(output().pictures(), 0U);
}

// --- what is not saved -----------------------------------------------------------------------

TEST_F(RoomsTest, EveryPanelMarksWhatIsNotSaved) {
  EXPECT_FALSE(window_->windowTitle().contains("not saved"));
  EXPECT_FALSE(action("save_all")->isEnabled());
  const Handle pin =
      made("solid.create",
           {{"name", "pin"}, {"root", Map{{"kind", "box"}, {"x", 0.1}, {"y", 0.1}, {"z", 0.1}}}});
  ASSERT_TRUE(until([&] { return desk_->is_unsaved(pin); }));
  ASSERT_NE(window_->open_view(pin, "pin"), nullptr);
  desk_->select({{pin, {}}});
  settle();
  const QString dot(QChar(0x25CF));
  auto* tabs = widget<QTabWidget>("tabs");
  EXPECT_TRUE(tabs->tabText(tabs->currentIndex()).contains(dot));
  EXPECT_TRUE(window_->windowTitle().startsWith("pin " + dot));
  EXPECT_TRUE(window_->windowTitle().contains("1 not saved"));
  EXPECT_TRUE(action("save")->isEnabled());
  EXPECT_TRUE(action("save_all")->isEnabled());
  EXPECT_TRUE(action("save_all")->text().contains("1"));
  const QModelIndex section = row({"Solids"}), record = row({"Solids", "pin"});
  EXPECT_TRUE(record.data(NavigatorModel::kIsUnsaved).toBool());
  EXPECT_TRUE(section.data(NavigatorModel::kIsUnsaved).toBool());
  EXPECT_TRUE(record.data(Qt::ToolTipRole).toString().contains("not saved"));
  EXPECT_TRUE(section.data(Qt::ToolTipRole).toString().contains("1 not saved"));
  photo("unsaved");
  const std::string file = utf8(folder_.filePath("pin.csg"));
  called("solid.save", {{"id", pin}, {"file", file}});
  ASSERT_TRUE(until([&] { return !desk_->may_be_unsaved(pin) && !desk_->is_unsaved(pin); }));
  settle();
  EXPECT_EQ(window_->windowTitle(), "pin - ROBOMOSP");
  EXPECT_FALSE(tabs->tabText(tabs->currentIndex()).contains(dot));
  EXPECT_FALSE(row({"Solids", "pin"}).data(NavigatorModel::kIsUnsaved).toBool());
  EXPECT_FALSE(row({"Solids"}).data(NavigatorModel::kIsUnsaved).toBool());
  EXPECT_FALSE(action("save")->isEnabled());
  EXPECT_TRUE(action("save_as")->isEnabled());
  EXPECT_FALSE(action("save_all")->isEnabled());
  // An edit can be saved at once, before it is compared with the file; undo makes it saved again.
  bool could_save = false;
  desk_->unsaved_changed.add(window_.get(), [&] {
    could_save = could_save || (action("save")->isEnabled() && !desk_->is_unsaved(pin));
  });
  called("solid.set", {{"id", pin}, {"path", "box.x"}, {"value", 0.2}});
  ASSERT_TRUE(until([&] { return desk_->is_unsaved(pin); }));
  EXPECT_TRUE(could_save);
  called("document.undo", {});
  ASSERT_TRUE(until([&] { return !desk_->may_be_unsaved(pin) && !desk_->is_unsaved(pin); }));
  EXPECT_FALSE(action("save")->isEnabled());
}

TEST_F(RoomsTest, TheQuestionBeforeClosingNamesAllThatIsNotSaved) {
  for (int i = 0; i < 8; ++i) made("world.create", {{"name", "cell_" + std::to_string(i)}});
  settle();
  window_->close();
  QWidget* guard = widget("guard");
  ASSERT_TRUE(until([&] { return guard->isVisible(); }));
  auto* text = widget<QLabel>("guard_text");
  EXPECT_TRUE(text->text().contains("8 records are not saved: world cell_0"));
  EXPECT_TRUE(text->text().contains("and 2 more"));
  EXPECT_EQ(text->toolTip().count('\n'), 7);
  EXPECT_TRUE(text->toolTip().contains("world cell_7: has no file"));
  photo("guard");
  click("guard_stay");
}

// --- thumbnails of the library -----------------------------------------------------------------

class ThumbnailsTest : public RoomsTest {
 protected:
  /// Other programs may draw meanwhile.
  static constexpr int kDrawingMs = 180000;

  void SetUp() override {
    qputenv("XDG_CACHE_HOME", cache_.path().toUtf8());
    RoomsTest::SetUp();
  }
  void TearDown() override {
    RoomsTest::TearDown();
    qputenv("ROBOMOSP_NO_THUMBNAILS", "1");
    if (cache_before_.isEmpty()) qunsetenv("XDG_CACHE_HOME");
    else qputenv("XDG_CACHE_HOME", cache_before_);
  }
  QStringList pictures() const {
    return QDir(cache_.filePath("robomosp/pictures")).entryList(QDir::Files);
  }
  QTemporaryDir cache_;
  const QByteArray cache_before_ = qgetenv("XDG_CACHE_HOME");
};

TEST_F(ThumbnailsTest, ADigestDiffersWithTheContentOfAllFilesNeeded) {
  const auto digests = [&] {
    std::map<std::string, std::string> out;
    const Value rows = called("library.describe", {{"kind", "world"}, {"digests", true}});
    for (const Value& v : list_of(rows))
      out[text_at(map_of(v), "name")] = text_at(map_of(v), "digest");
    return out;
  };
  const auto first = digests();
  ASSERT_GT(first.size(), 10U);
  EXPECT_EQ(first, digests());
  std::set<std::string> different;
  for (const auto& [name, digest] : first) different.insert(digest);
  EXPECT_EQ(different.size(), first.size());
  const Value plain = called("library.describe", {{"kind", "world"}});
  EXPECT_EQ(map_of(list_of(plain).front()).find("digest"), nullptr);
  // A library with a part that changes.
  const std::filesystem::path folder = utf8(folder_.filePath("library"));
  std::filesystem::create_directories(folder / "parts");
  const auto write = [&](const char* name, const std::string& text) {
    std::ofstream(folder / "parts" / name) << text;
  };
  write("pin.csg", "robomosp solid 1\nname pin\nbox pin { x 1  y 1  z 1 }\n");
  write("stack.part", "robomosp object 1\nname stack\npart a { solid \"pin.csg\" }\n");
  app().library.push_back(folder);
  const auto stack = [&] {
    const Value rows = called("library.describe", {{"kind", "object"}, {"digests", true}});
    for (const Value& v : list_of(rows))
      if (text_at(map_of(v), "name") == "stack") return text_at(map_of(v), "digest");
    return std::string();
  };
  const std::string before = stack();
  write("pin.csg", "robomosp solid 1\nname pin\nbox pin { x 2  y 1  z 1 }\n");
  EXPECT_NE(stack(), before);
  app().library.pop_back();
}

TEST_F(ThumbnailsTest, PicturesAreDrawnBesideTheWindowAndKeptByContent) {
  if (!QFileInfo(QCoreApplication::applicationDirPath() + "/../bin/robomosp-desktop").exists())
    GTEST_SKIP() << "the program that draws is not built";
  qunsetenv("ROBOMOSP_NO_THUMBNAILS");
  Value row;
  const Value rows = called("library.describe", {{"kind", "solid"}, {"digests", true}});
  for (const Value& v : list_of(rows))
    if (text_at(map_of(v), "name") == "block") row = v;
  Thumbnails thumbnails;
  thumbnails.niceness = 0;                           // other tests may run beside this one
  EXPECT_EQ(thumbnails.file("solid", "block"), "");  // not known
  thumbnails.know("solid", {row});
  EXPECT_TRUE(thumbnails.knows("solid"));
  EXPECT_TRUE(thumbnails.small("solid", "block", 22, 1).isNull());
  ASSERT_TRUE(until([&] { return !thumbnails.is_drawing() && !pictures().isEmpty(); }, kDrawingMs));
  const QString file = thumbnails.file("solid", "block");
  EXPECT_TRUE(file.endsWith("-dark.png"));
  EXPECT_EQ(QImage(file).size(), QSize(Thumbnails::kWidth, Thumbnails::kHeight));
  (void)thumbnails.small("solid", "block", 22, 1);
  ASSERT_TRUE(until([&] { return !thumbnails.small("solid", "block", 22, 1).isNull(); }));
  EXPECT_EQ(thumbnails.small("solid", "block", 22, 1).height(), 22);
  // The next window finds it. Another content gets another picture, and the first one is removed.
  Thumbnails again;
  again.niceness = 0;
  again.know("solid", {row});
  EXPECT_EQ(again.file("solid", "block"), file);
  row.as_map()->set("digest", "another");
  again.know("solid", {row});
  EXPECT_NE(again.file("solid", "block"), file);
  ASSERT_TRUE(until([&] { return !again.is_drawing() && !QFileInfo::exists(file); }, kDrawingMs));
  EXPECT_EQ(pictures().size(), 1);
  // What cannot be drawn is reported once, and not tried again.
  QString why;
  again.failed.add(window_.get(), [&](const QString& text) { why = text; });
  row.as_map()->set("file", "no/such/file.csg");
  row.as_map()->set("digest", "none");
  again.know("solid", {row});
  (void)again.file("solid", "block");
  ASSERT_TRUE(until([&] { return !why.isEmpty(); }, kDrawingMs));
  EXPECT_TRUE(why.contains("\"block\"")) << why.toStdString();
  (void)again.file("solid", "block");
  EXPECT_FALSE(again.is_drawing());
}

TEST_F(ThumbnailsTest, RowsOfTheLibraryHavePicturesAndDescriptions) {
  if (!QFileInfo(QCoreApplication::applicationDirPath() + "/../bin/robomosp-desktop").exists())
    GTEST_SKIP() << "the program that draws is not built";
  const QPersistentModelIndex robot = row({"Library", "Robots", "twolink"});
  ASSERT_TRUE(robot.isValid());
  const QPersistentModelIndex material = row({"Library", "Materials", "brass"});
  ASSERT_TRUE(material.isValid());
  EXPECT_TRUE(material.data(NavigatorModel::kPicture).value<QPixmap>().isNull());
  EXPECT_TRUE(robot.data(NavigatorModel::kPicture).value<QPixmap>().isNull());
  EXPECT_FALSE(robot.data(NavigatorModel::kIcon).toString().isEmpty());
  const QString tip = robot.data(Qt::ToolTipRole).toString();
  EXPECT_TRUE(tip.contains("<b>twolink</b>"));
  EXPECT_FALSE(tip.contains("<img"));
  EXPECT_TRUE(pictures().isEmpty()) << "nothing is drawn unless it may be";
  auto* thumbnails = dynamic_cast<Thumbnails*>(window_->findChild<QObject*>("thumbnails"));
  ASSERT_NE(thumbnails, nullptr);
  thumbnails->niceness = 0;
  qunsetenv("ROBOMOSP_NO_THUMBNAILS");
  ASSERT_TRUE(until([&] { return !robot.data(NavigatorModel::kPicture).value<QPixmap>().isNull(); },
                    kDrawingMs));
  EXPECT_TRUE(robot.data(Qt::ToolTipRole).toString().contains("<img"));
  // A material on a sphere and a cone, in its colour.
  ASSERT_TRUE(
      until([&] { return !material.data(NavigatorModel::kPicture).value<QPixmap>().isNull(); },
            kDrawingMs));
  const QImage drawn(thumbnails->file("material", "brass"));
  int yellow = 0;
  for (int y = 0; y < drawn.height(); ++y)
    for (int x = 0; x < drawn.width(); ++x) {
      const QColor c = drawn.pixelColor(x, y);
      yellow += c.red() > c.blue() + 40 && c.green() > c.blue() + 20;
    }
  EXPECT_GT(yellow, drawn.width() * drawn.height() / 20);
  qputenv("ROBOMOSP_NO_THUMBNAILS", "1");
}

TEST_F(ThumbnailsTest, TheStartPageShowsRobotsObjectsAndSolidsToo) {
  window_->resize(1900, 1000);
  window_->show_start();
  settle();
  auto* page = window_->findChild<StartPage*>("start");
  ASSERT_NE(page, nullptr);
  auto* kinds = widget<QComboBox>("start_kind");
  EXPECT_EQ(kinds->count(), 4);
  kinds->setCurrentIndex(kinds->findText("Robots"));
  settle();
  EXPECT_EQ(widget<QLabel>("start_worlds_heading")->text(), "Robots of the library");
  EXPECT_EQ(page->cards().size(), list_of(called("library.list", {{"kind", "robot"}})).size());
  photo("start_robots");
  // The choice is kept when the page is closed and shown again.
  action("close_tab")->trigger();
  EXPECT_TRUE(widget("empty")->isVisible());
  photo("empty");
  click("empty_start");
  settle();
  auto* card = window_->findChild<QPushButton*>("card_robot_twolink");
  ASSERT_NE(card, nullptr);
  QTest::mouseClick(card, Qt::LeftButton);
  ASSERT_TRUE(until([&] { return window_->current_view() != nullptr; }));
  EXPECT_EQ(window_->current_view()->what().kind, "robot");
  window_->show_start();
  widget<QComboBox>("start_kind")->setCurrentIndex(0);
  settle();
  EXPECT_NE(window_->findChild<QPushButton*>("card_pa10_circle"), nullptr);
}

// --- the start page alone ----------------------------------------------------------------------

TEST_F(RoomsTest, TheStartPageAloneHasNoPanelsBesideIt) {
  const auto docks = [&] {
    QStringList shown;
    for (QDockWidget* dock : window_->findChildren<QDockWidget*>())
      if (dock->isVisible()) shown += dock->objectName();
    shown.sort();
    return shown;
  };
  const QStringList before = docks();
  ASSERT_GT(before.size(), 3);
  window_->close_now();
  window_ = std::make_unique<MainWindow>(
      *desk_, MainWindow::Options{folder_.filePath("desktop.ini"), false, false, true});
  window_->resize(1440, 900);
  window_->show();
  QApplication::setActiveWindow(window_.get());
  settle();
  EXPECT_EQ(docks(), QStringList());
  EXPECT_FALSE(widget<QTabBar>("tab_bar")->isVisible());
  photo("start_whole");
  // A panel that is asked for brings all back.
  window_->show_panel("console");
  settle();
  EXPECT_EQ(docks(), before);
  EXPECT_TRUE(widget<QTabBar>("tab_bar")->isVisible());
  // So does a record; the first tab stays the start page, and its keys show it again.
  const Handle world = made("world.create", {{"name", "cell"}});
  ASSERT_NE(window_->open_view(world, "cell"), nullptr);
  settle();
  EXPECT_EQ(docks(), before);
  key(Qt::Key_Home, Qt::AltModifier);
  auto* tabs = widget<QTabWidget>("tabs");
  EXPECT_EQ(tabs->currentIndex(), 0);
  EXPECT_EQ(tabs->currentWidget()->objectName(), "start");
  EXPECT_EQ(docks(), before);
  action("close_tab")->trigger();
  EXPECT_EQ(tabs->count(), 1);
  EXPECT_EQ(window_->views().size(), 1U);
  // Once all is closed the page is alone again.
  action("close_tab")->trigger();
  settle();
  EXPECT_EQ(docks(), QStringList());
  window_->set_workspace(Workspace::model);
  settle();
  EXPECT_TRUE(docks().contains("navigator_dock"));
  window_->set_workspace(Workspace::motion);
}

// --- memory --------------------------------------------------------------------------------------

TEST_F(RoomsTest, RecordingsShowTheirMemoryAndAMarkIfItIsMuch) {
  EXPECT_TRUE(list_of(called("recording.list", {})).empty() ||
              map_of(list_of(called("recording.list", {})).front()).find("bytes"));
  constexpr std::size_t kRows = 100'000;
  std::vector<double> times(kRows), values(kRows, 1.0);
  for (std::size_t i = 0; i < kRows; ++i) times[i] = 0.01 * static_cast<double>(i);
  const Handle made_one = made(
      "recording.create",
      {{"title", "heavy"},
       {"columns", List{Map{{"name", "time"}, {"unit", "s"}, {"values", NumericArray(times)}},
                        Map{{"name", "x"}, {"unit", "m"}, {"values", NumericArray(values)}}}}});
  settle();
  bool is_listed = false;
  const Value rows = called("recording.list", {});
  for (const Value& v : list_of(rows))
    if (handle_at(map_of(v), "recording") == made_one) {
      is_listed = true;
      EXPECT_EQ(whole_at(map_of(v), "bytes"), 2 * 8 * static_cast<std::int64_t>(kRows));
      EXPECT_GT(number_at(map_of(v), "share"), 0);
      EXPECT_LT(number_at(map_of(v), "share"), 0.02);
    }
  EXPECT_TRUE(is_listed);
  const QPersistentModelIndex heavy = row({"Recordings", "heavy"});
  EXPECT_TRUE(heavy.data(NavigatorModel::kDetail).toString().contains("1.6 MB"));
  EXPECT_TRUE(heavy.data(Qt::ToolTipRole).toString().contains("Holds 1.6 MB of memory"));
  EXPECT_FALSE(heavy.data(NavigatorModel::kIsHeavy).toBool());
  window_->navigator().model().heavy_share = 1e-9;
  EXPECT_TRUE(heavy.data(NavigatorModel::kIsHeavy).toBool());
  auto* memory = widget<QLabel>("navigator_memory");
  EXPECT_TRUE(until([&] { return memory->text().contains("Recordings"); }))
      << memory->text().toStdString();
  EXPECT_TRUE(memory->toolTip().contains("recording.remove"));
  photo("memory");
  called("recording.remove", {{"id", made_one}});
  EXPECT_TRUE(until([&] {
    return window_->navigator().model().recording_bytes() < 2 * 8 * static_cast<qint64>(kRows);
  }));
  EXPECT_EQ(memory_text(5), "");
  EXPECT_EQ(memory_text(12'300'000), "12 MB");
  EXPECT_EQ(memory_text(2'500'000'000), "2.5 GB");
}

}  // namespace
}  // namespace robomosp::viewer
