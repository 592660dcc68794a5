// SPDX-License-Identifier: GPL-3.0-or-later
// The window where something is missing or unusual: it works, or one sentence says what does not.
// And after a crash: the next start offers what was not saved.
#include <csignal>
#include <cstdio>
#include <random>
#include <set>
#include <sstream>
#include <string>
#include <utility>

#include <QCoreApplication>
#include <QDir>
#include <QElapsedTimer>
#include <QFile>
#include <QThread>

#include <gtest/gtest.h>

#include "viewer/desktop_program.h"

namespace robomosp::viewer {
namespace {

class Conditions : public testing::Test {
 protected:
  /// The program starts, shows its window and ends.
  static void expect_usable(const ProgramEnd& e) {
    EXPECT_FALSE(e.is_late) << "the window does not become usable\n" << e.err;
    EXPECT_EQ(e.status, 0) << e.err;
    EXPECT_NE(e.out.find("usable"), std::string::npos) << e.out << e.err;
  }
  /// A script with a function say(), which writes to a file: what scripts print goes to the console
  /// of the window.
  QString script(const QString& name, const char* text) {
    QFile::remove(home_.filePath("said"));
    return written(home_, name,
                   "local said = io.open('" + home_.filePath("said").toUtf8() +
                       "', 'a')\nlocal function say(...) said:write(...) said:flush() end\n" +
                       text);
  }
  [[nodiscard]] std::string said() const {
    QFile file(home_.filePath("said"));
    return file.open(QIODevice::ReadOnly) ? file.readAll().toStdString() : std::string();
  }
  /// Starts again: the work of an earlier run is offered and restored. Its digest, "" without.
  std::string restored_digest() {
    const QString look = script("look.lua", R"(
    window.settle{}
    say("journals ", #recovery.list(), "\n")
    local offered = window.read{widget = "start_recovery_text"}
    say("offered ", tostring(offered.text), "\n")
    -- A click on the button would wait for the end of this script, as both are of one session.
    recovery.restore()
    say("digest ", document.digest(), "\n"))");
    const ProgramEnd e = DesktopProgram(home_).run({"--script", look, "--start-times"});
    const std::string seen = said();
    EXPECT_NE(seen.find("journals 1"), std::string::npos) << seen << e.err;
    EXPECT_NE(seen.find("not saved"), std::string::npos)
        << "the start page offers nothing: " << seen;
    const std::size_t at = seen.find("digest ");
    EXPECT_NE(at, std::string::npos) << seen << e.err;
    if (at == std::string::npos) return {};
    return seen.substr(at + 7, seen.find('\n', at) - at - 7);
  }
  QTemporaryDir home_;
};

TEST_F(Conditions, TheStartIsTimed) {
  const ProgramEnd e = DesktopProgram(home_).run({"--start-times"});
  expect_usable(e);
  for (const char* step : {"program started", "window built", "window painted", "usable"})
    EXPECT_NE(e.out.find(step), std::string::npos) << step << "\n" << e.out;
}

TEST_F(Conditions, WithoutAnyDisplayServerTheWindowIsDrawnThroughEgl) {
  const ProgramEnd e = DesktopProgram(home_)
                           .with("DISPLAY", "")
                           .with("WAYLAND_DISPLAY", "")
                           .with("QT_QPA_PLATFORM", "offscreen")
                           .run({"pa10_circle", "--still", "--start-times"});
  expect_usable(e);
}

TEST_F(Conditions, WithoutOpenGlTheWindowOpensAndSaysWhatIsNotDrawn) {
  // No driver is found, neither for windows nor for EGL.
  const ProgramEnd e = DesktopProgram(home_)
                           .with("LIBGL_DRIVERS_PATH", "/nonexistent")
                           .with("GBM_DRIVERS_PATH", "/nonexistent")
                           .with("__EGL_VENDOR_LIBRARY_DIRS", "/nonexistent")
                           .with("LIBGL_ALWAYS_SOFTWARE", "1")
                           .run({"pa10_circle", "--still", "--start-times"});
  expect_usable(e);
  EXPECT_NE(e.err.find("OpenGL"), std::string::npos) << "no sentence about OpenGL: " << e.err;
}

TEST_F(Conditions, AHomeThatCannotBeWrittenIsReported) {
  // Not even root writes there.
  const ProgramEnd e =
      DesktopProgram(home_).with("HOME", "/proc").run({"pa10_circle", "--still", "--start-times"});
  expect_usable(e);
  EXPECT_NE(e.err.find("settings"), std::string::npos) << "no sentence about settings: " << e.err;
}

TEST_F(Conditions, AFullDiskIsReported) {
  const ProgramEnd e = DesktopProgram(home_).with_file_limit("0").run(
      {"pa10_circle", "--still", "--software-view", "--start-times"});
  EXPECT_FALSE(e.is_late);
  EXPECT_GE(e.status, 0) << "it crashed: " << e.err;
  EXPECT_NE(e.err.find("settings"), std::string::npos) << "a full disk is not reported: " << e.err;
}

TEST_F(Conditions, SettingsThatAreNonsenseAreIgnored) {
  QDir().mkpath(home_.filePath(".config/robomosp"));
  written(home_, ".config/robomosp/desktop.ini",
          "[window]\ntheme=mauve\nzoom=nan\nworkspace=kitchen\ngeometry=@ByteArray(xyz)\n"
          "[layout2]\nmotion=@ByteArray(\\0\\0\\xff)\n[files]\nrecent=\x01\x02,,,\n\0\xff");
  expect_usable(DesktopProgram(home_).run({"--start-times"}));
}

TEST_F(Conditions, SafeModeLeavesOutSettingsAndPluginsOfTheUserAndSaysSo) {
  const QByteArray kept = "[window]\ntheme=light\nworkspace=program\nzoom=2\n";
  QDir().mkpath(home_.filePath(".config/robomosp"));
  QDir().mkpath(home_.filePath(".local/share/robomosp/plugins"));
  written(home_, ".config/robomosp/desktop.ini", kept);
  written(home_, ".local/share/robomosp/plugins/extra.lua", "error('the plugin extra was run')");
  const QString look = script("look.lua", R"(
    local now = window.set{}
    say(now.theme, " ", now.workspace, " ", tostring(now.zoom), "\n")
    window.set{theme = "light", workspace = "robot"}
    local ok, label = pcall(window.read, {widget = "status_safe"})
    say("says ", tostring(ok and label.text), "\n")
    window.settle{})");
  const ProgramEnd usual = DesktopProgram(home_).run({"--script", look, "--start-times"});
  expect_usable(usual);
  EXPECT_EQ(said(), "light program 2.0\nsays false\n");
  EXPECT_NE(usual.err.find("the plugin extra was run"), std::string::npos) << usual.err;

  written(home_, ".config/robomosp/desktop.ini", kept);
  QFile::remove(home_.filePath("said"));
  const ProgramEnd safe = DesktopProgram(home_).run({"--safe", "--script", look, "--start-times"});
  expect_usable(safe);
  EXPECT_EQ(said(), "dark motion 1.0\nsays Safe mode\n");
  EXPECT_EQ(safe.err.find("the plugin extra was run"), std::string::npos) << safe.err;
  EXPECT_NE(safe.err.find("Safe mode: "), std::string::npos) << safe.err;
  QFile file(home_.filePath(".config/robomosp/desktop.ini"));
  ASSERT_TRUE(file.open(QIODevice::ReadOnly));
  EXPECT_EQ(file.readAll(), kept) << "the settings of the user were written";

  const ProgramEnd both =
      DesktopProgram(home_).run({"--safe", "--plugin-path", home_.path(), "--start-times"});
  EXPECT_EQ(both.status, 2) << "plugins of a folder were asked for in safe mode";
}

TEST_F(Conditions, PicturesOfTheWindowLeaveTheSettingsOfTheUserAsTheyAre) {
  const QByteArray kept = "[window]\ntheme=light\nworkspace=program\nzoom=1.5\n";
  QDir().mkpath(home_.filePath(".config/robomosp"));
  written(home_, ".config/robomosp/desktop.ini", kept);
  const auto now = [&] {
    QFile file(home_.filePath(".config/robomosp/desktop.ini"));
    return file.open(QIODevice::ReadOnly) ? file.readAll() : QByteArray();
  };
  const QString look = script("look.lua", R"(
    local now = window.set{}
    say(now.theme, " ", now.workspace, " ", tostring(now.zoom), "\n")
    window.set{theme = "dark", workspace = "robot"}
    return solid.create{name = "part", root = {kind = "box", x = 0.1, y = 0.2, z = 0.3}})");
  const QString picture = home_.filePath("window.png");
  const ProgramEnd e =
      DesktopProgram(home_).run({"--script", look, "--size", "900x600", "--screenshot", picture});
  EXPECT_EQ(said(), "light program 1.5\n") << "it is not as the user has it: " << e.err;
  EXPECT_TRUE(QFile::exists(picture)) << e.err;
  EXPECT_EQ(now(), kept) << "a screenshot wrote the settings of the user";
  DesktopProgram tour(home_);
  tour.start({"--tour", home_.filePath("pictures")});
  QElapsedTimer clock;
  clock.start();
  while (clock.elapsed() < 60000 && QDir(home_.filePath("pictures")).entryList({"*.png"}).isEmpty())
    QThread::msleep(100);
  EXPECT_FALSE(QDir(home_.filePath("pictures")).entryList({"*.png"}).isEmpty());
  EXPECT_GE(tour.terminate(), 0);
  EXPECT_EQ(now(), kept) << "the tour wrote the settings of the user";
}

TEST_F(Conditions, LocalesChangeNoNumbersAndNoNames) {
  for (const char* locale : {"de_DE.UTF-8", "tr_TR.UTF-8", "ar_EG.UTF-8", "C"}) {
    const QString numbers = script("numbers.lua", R"(
      local part = solid.create{name = "KIWI_i_I", root = {kind = "box", x = 0.125, y = 0.25, z = 1.5}}
      assert(solid.get("KIWI_i_I") and not pcall(solid.get, "kiwi_i_i"))
      local line = window.read{widget = "status_units"}.text
      assert(line:find("mm"), line)
      window.settle{}
      say("x = ", tostring(part:tree().x), "\n")
      return part)");
    const ProgramEnd e = DesktopProgram(home_)
                             .with("LANG", locale)
                             .with("LC_ALL", locale)
                             .run({"--script", numbers, "--start-times"});
    expect_usable(e);
    EXPECT_EQ(said(), "x = 0.125\n") << locale << ": " << e.out << e.err;
  }
}

TEST_F(Conditions, NamesFromRightToLeftAreShown) {
  // Hebrew, Arabic, a combining letter, and a character beyond 16 bits.
  const QString names = script("names.lua", R"(
    local cell = world.create{name = "cell"}
    local box = {kind = "box", x = 0.1, y = 0.1, z = 0.1}
    for _, name in ipairs{"שלום", "مرحبا", "é", "😀"} do
      local ok, reason = pcall(solid.create, {name = name, root = box})
      if not ok then say("refused: ", tostring(reason), "\n")
      else cell:add_object{what = name} end
    end
    window.settle{}
    say("placed ", #cell:objects(), "\n")
    return cell)");
  const ProgramEnd e = DesktopProgram(home_).run({"--script", names, "--start-times"});
  expect_usable(e);
  EXPECT_EQ(said(), "placed 4\n") << e.err;
}

TEST_F(Conditions, SystemZoomAndLargeFontsWork) {
  for (const auto& [name, value] :
       {std::pair{"QT_SCALE_FACTOR", "1.5"}, std::pair{"QT_SCALE_FACTOR", "2"},
        std::pair{"QT_FONT_DPI", "192"}, std::pair{"QT_SCREEN_SCALE_FACTORS", "1.25"}}) {
    const ProgramEnd e =
        DesktopProgram(home_).with(name, value).run({"pa10_circle", "--still", "--start-times"});
    SCOPED_TRACE(std::string(name) + "=" + value);
    expect_usable(e);
  }
}

// --- crash and recovery ----------------------------------------------------------------------

/// Edits without an end; prints the digest of the document after each.
constexpr const char* kEdits = R"(
  local function note() say(document.digest(), "\n") end
  local bolt = solid.create{name = "bolt", root = {kind = "cylinder", radius = 0.01, height = 0.1}}
  note()
  local cell = world.create{name = "cell"}
  note()
  cell:add_object{what = bolt, name = "first"}
  note()
  for i = 1, 1e9 do
    bolt:set{path = "cylinder.height", value = 0.1 + i * 1e-6}
    note()
    if i % 7 == 0 then
      cell:add_object{what = bolt}
      note()
    end
    if i % 11 == 0 then
      document.undo()
      note()
    end
    local t = os.clock()
    while os.clock() - t < 0.02 do end
  end)";

TEST_F(Conditions, AfterAKillTheNextStartOffersTheWorkAndRestoresIt) {
  std::mt19937 random(std::random_device{}());
  const int after_ms = 2500 + static_cast<int>(random() % 4000);
  SCOPED_TRACE("killed after " + std::to_string(after_ms) + " ms of edits");
  std::set<std::string> digests;
  {
    DesktopProgram killed(home_);
    killed.start({"--script", script("edits.lua", kEdits)});
    QElapsedTimer clock;
    for (clock.start(); said().empty() && clock.elapsed() < 120000;) QThread::msleep(20);
    ASSERT_FALSE(said().empty()) << "the script makes no edits";
    QThread::msleep(static_cast<unsigned long>(after_ms));
    killed.kill();
    std::istringstream lines(said());
    for (std::string line; std::getline(lines, line);) digests.insert(line);
  }
  ASSERT_GT(digests.size(), 5U);
  const std::string restored = restored_digest();
  EXPECT_TRUE(digests.contains(restored)) << "the restored document is none of those before";
}

TEST_F(Conditions, ATerminatedWindowEndsAtOnceAndKeepsUnsavedWork) {
  std::string digest;
  {
    DesktopProgram ended(home_);
    ended.start({"--script", script("one.lua", R"(
      window.settle{}
      material.create{name = "kept", density = 1234}
      say(document.digest(), "\n"))")});
    QElapsedTimer clock;
    for (clock.start(); said().empty() && clock.elapsed() < 120000;) QThread::msleep(20);
    ASSERT_FALSE(said().empty()) << "the script makes no edit";
    QThread::msleep(500);
    const qint64 took = ended.terminate();
    EXPECT_GE(took, 0) << "it does not end";
    RecordProperty("end_ms", std::to_string(took));
    std::printf("the end took %.0f ms (aim 1000)\n", static_cast<double>(took));
    EXPECT_EQ(ended.exit_code(), 128 + SIGTERM);
    digest = said().substr(0, said().find('\n'));
  }
  EXPECT_EQ(restored_digest(), digest);
}

TEST_F(Conditions, ATerminatedWindowLeavesNoTemporaryFolders) {
  const QTemporaryDir temporary;
  const auto left = [&] {
    return QDir(temporary.path())
        .entryList(QDir::AllEntries | QDir::Hidden | QDir::NoDotAndDotDot)
        .join(' ')
        .toStdString();
  };
  DesktopProgram ended(home_);
  ended.with("TMPDIR", temporary.path())
      .start({"--safe", "--script", script("ready.lua", "window.settle{}\nsay(\"ready\\n\")")});
  QElapsedTimer clock;
  for (clock.start(); said().empty() && clock.elapsed() < 120000;) QThread::msleep(20);
  ASSERT_FALSE(said().empty()) << "the script does not run";
  // The settings of a safe start, and the images of the style sheet.
  EXPECT_NE(left().find(' '), std::string::npos) << left();
  ASSERT_GE(ended.terminate(), 0) << "it does not end";
  EXPECT_EQ(left(), "");
}

}  // namespace
}  // namespace robomosp::viewer

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  QCoreApplication application(argc, argv);  // for processes
  return RUN_ALL_TESTS();
}
