// SPDX-License-Identifier: GPL-3.0-or-later
// Runs robomosp-desktop with wrong inputs: the exit status and the sentence, nothing drawn. And a
// map.
#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <sys/wait.h>

#include <gtest/gtest.h>

namespace {

struct Ended {
  int status = -1;     ///< of the program; 128 + signal as a shell has it
  std::string output;  ///< standard output and standard error together
};

/// `before` are words for env(1): NAME=VALUE.
Ended run(const std::string& arguments, const std::string& before = "") {
  const std::string command =
      "env -u DISPLAY -u WAYLAND_DISPLAY -u QT_QPA_PLATFORM -u XDG_SESSION_TYPE "
      "-u XDG_RUNTIME_DIR " +
      before + " '" ROBOMOSP_BUILD_DIR "/bin/robomosp-desktop' " + arguments + " 2>&1";
  Ended ended;
  std::FILE* pipe = popen(command.c_str(), "r");
  if (pipe == nullptr) return ended;
  std::array<char, 4096> part{};
  for (std::size_t n; (n = std::fread(part.data(), 1, part.size(), pipe)) > 0;)
    ended.output.append(part.data(), n);
  const int status = pclose(pipe);
  ended.status = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  return ended;
}

void expect(const std::string& arguments, int status, const std::string& sentence,
            const std::string& before = "") {
  const Ended ended = run(arguments, before);
  EXPECT_EQ(ended.status, status) << arguments << "\n" << ended.output;
  EXPECT_NE(ended.output.find(sentence), std::string::npos) << arguments << "\n" << ended.output;
  // One sentence, perhaps with its hint, on one line.
  EXPECT_EQ(ended.output.find('\n') + 1, ended.output.size()) << arguments << "\n" << ended.output;
}

/// A picture that is never drawn, so that no display is asked for.
std::string render() { return " --render '" + testing::TempDir() + "robomosp-never-drawn.png'"; }

TEST(Program, WithoutADisplayItRefusesTheWindowAndNamesRender) {
  const std::string none =
      "cannot open a window, because there is no display: neither DISPLAY nor WAYLAND_DISPLAY is";
  expect("pa10_circle --still", 1, none);
  expect("pa10_circle --still", 1, none, "DISPLAY=");
  expect("pa10_circle --still", 1, "--render FILE");
}

TEST(Program, ADisplayThatDoesNotAnswerIsRefusedInsteadOfAborting) {
  // Not :99, which Xvfb takes first for a test that runs beside this one.
  expect("pa10_circle --still", 1,
         "cannot open a window, because the display does not answer: DISPLAY is \":4321\". Start "
         "the program in a desktop session, or draw the picture into a file instead with --render "
         "FILE.",
         "DISPLAY=:4321");
  expect("pa10_circle --still", 1, "cannot open a window, because", "DISPLAY=' '");
  expect("pa10_circle --still", 1, "QT_QPA_PLATFORM is \"nonsense\"", "QT_QPA_PLATFORM=nonsense");
}

TEST(Program, ANameThatIsNothingShownIsAnsweredOverAllKinds) {
  expect("nope" + render(), 3,
         "there is no world, robot, object, solid or material \"nope\". The library");
  expect("pa10_circel" + render(), 3,
         "there is no world, robot, object, solid or material \"pa10_circel\". Did you mean "
         "\"pa10_circle\"?");
  expect("puma56" + render(), 3, "Did you mean \"puma560\"?");
  expect("stel" + render(), 3, "Did you mean \"steel\"?");
  expect("circle" + render(), 3, "\"circle\" is a trajectory; it cannot be shown.");
  expect("pa10_circle --play nobody circle" + render(), 3,
         "there is no robot \"nobody\" in the world. There is pa10.");
}

TEST(Program, AScriptThatIsMissingOrMakesNoRecordingIsTold) {
  expect("--script nowhere.lua" + render(), 3, "there is no script \"nowhere.lua\"");
  const std::string script = testing::TempDir() + "robomosp-no-recording.lua";
  std::ofstream(script) << "world.create{name = \"empty\"}\n";
  expect("--script '" + script + "'" + render(), 3, "the script made no recording of a world");
  std::filesystem::remove(script);
}

TEST(Program, AScriptSaysWhatIsShownByWhatItReturns) {
  const std::string script = testing::TempDir() + "robomosp-returns.lua";
  const std::string drawn = testing::TempDir() + "robomosp-returned.png";
  const auto shows = [&](const std::string& code, int status) {
    std::ofstream(script) << code;
    std::filesystem::remove(drawn);
    const Ended e = run("--script '" + script + "' --argument 0.5 --fast --size 64x48 --render '" +
                        drawn + "'");
    EXPECT_EQ(e.status, status) << code << e.output;
    EXPECT_EQ(std::filesystem::exists(drawn), status == 0) << code << e.output;
    return e.output;
  };
  shows("assert(arg[1] == '0.5') return robot 'puma560'", 0);
  shows("return solid.create{name = 'box', root = {kind = 'box', x = 1, y = 1, z = 1}}", 0);
  shows("return material.create{name = 'tin', density = 7000}", 0);
  EXPECT_NE(shows("return task.create{name = 'serve', steps = {}}", 3).find("is a task"),
            std::string::npos);
  EXPECT_NE(shows("return robot('planar2rods'):simulate{q = {0, 0.5}, duration = 0.1}", 3)
                .find("a recording without a world"),
            std::string::npos);
  shows("return 17", 3);
  std::filesystem::remove(script);
  std::filesystem::remove(drawn);
}

TEST(Program, SolversThatComeWithAFileRunOnlyWhenTrusted) {
  const std::filesystem::path folder = testing::TempDir() + "robomosp-trust";
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder);
  // A world whose robot follows its trajectory by a solver that is kept with it.
  std::ofstream(folder / "make.lua") << R"(
    local folder = arg[1]
    local rail = robot.create{name = "rail", links = {{joint = "prismatic", lower = -1, upper = 1}}}
    provider.keep{interface = "ik", name = "mine", with = rail,
                  text = "return function(model, target) return {target[3][4]} end"}
    rail:set{ik = "mine"}
    local way = trajectory.create{name = "way", sample_time = 0.1, segments = {
      {shape = "line", points = {{0, 0, 0, 0, 0, 0}, {0, 0, 0.5, 0, 0, 0}}, speed = 0.5}}}
    local cell = world.create{name = "cell"}
    cell:add_robot{robot = rail}
    cell:add_trajectory{trajectory = way}
    rail:save(folder .. "/rail.rbt")
    way:save(folder .. "/way.tjc")
    cell:save(folder .. "/cell.wld")
    return cell)";
  const std::string user = "XDG_CONFIG_HOME='" + (folder / "user").string() + "'";
  const std::string drawn = (folder / "drawn.png").string();
  const std::string picture = " --fast --size 64x48 --render '" + drawn + "'";
  const Ended made = run("--script '" + (folder / "make.lua").string() + "' --argument '" +
                             folder.string() + "'" + picture,
                         "XDG_CONFIG_HOME='" + (folder / "author").string() + "'");
  ASSERT_EQ(made.status, 0) << made.output;
  std::filesystem::remove(drawn);
  const std::string shown = "'" + (folder / "cell.wld").string() + "' --at 0.5" + picture;
  const Ended refused = run(shown, user);
  EXPECT_EQ(refused.status, 3) << refused.output;
  EXPECT_NE(refused.output.find("is not run until you trust it"), std::string::npos)
      << refused.output;
  // And before that what came with the file, as the console says it.
  EXPECT_NE(refused.output.find("warning: A solver in Lua came with this document"),
            std::string::npos)
      << refused.output;
  EXPECT_FALSE(std::filesystem::exists(drawn));
  const Ended trusted = run("--trust " + shown, user);
  EXPECT_EQ(trusted.status, 0) << trusted.output;
  EXPECT_TRUE(std::filesystem::exists(drawn));
  EXPECT_FALSE(std::filesystem::exists(folder / "user/robomosp/trusted"));  // nothing is remembered
  std::filesystem::remove_all(folder);
}

/// The scripts of README's table of demos.
std::vector<std::string> demos() {
  std::vector<std::string> out;
  std::ifstream in(ROBOMOSP_SOURCE_DIR "/README.md");
  for (std::string line; std::getline(in, line);)
    if (const auto end = line.find(".lua` |"); line.starts_with("| `") && end != std::string::npos)
      out.push_back(line.substr(3, end - 3));
  return out;
}

TEST(Demos, TheTableOfTheReadmeHasThem) { EXPECT_GE(demos().size(), 13U); }

class Demo : public testing::TestWithParam<std::string> {};

/// As README says, but drawn offscreen; the script is given no folder, so it leaves no file.
TEST_P(Demo, IsShownAsTheReadmeSays) {
  const std::filesystem::path folder = testing::TempDir() + "robomosp-demo-" + GetParam();
  std::filesystem::create_directories(folder / "empty");
  std::filesystem::current_path(folder / "empty");
  const Ended e =
      run("--script '" ROBOMOSP_SOURCE_DIR "/scripts/demos/" + GetParam() +
          ".lua' --at 1 --fast --size 320x240 --render '" + (folder / "shown.png").string() + "'");
  EXPECT_EQ(e.status, 0) << e.output;
  // More than a floor and a sky.
  std::error_code none;
  EXPECT_GT(std::filesystem::file_size(folder / "shown.png", none), 8000U) << e.output;
  EXPECT_TRUE(std::filesystem::is_empty(folder / "empty"));
  std::filesystem::current_path(testing::TempDir());
  std::filesystem::remove_all(folder);
}

INSTANTIATE_TEST_SUITE_P(Readme, Demo, testing::ValuesIn(demos()),
                         [](const auto& row) { return row.param; });

TEST(Program, ASizeIsTwoWholeNumbersInItsRange) {
  const std::string no =
      "is not a width and a height; give two whole numbers of pixels in 16..8192";
  for (const char* size : {"640", "abc", "640x", "x480", "640x480x3", "6.5x480", "''"})
    expect(std::string("nope --size ") + size + render(), 2, no);
  const std::string out = "is out of range; the width and the height are 16..8192 pixels";
  for (const char* size : {"15x480", "640,8193", "640 8193", "-640 480", "0x0"})
    expect(std::string("nope --size ") + size + render(), 2, out);
  // Well-formed ones reach the name, also when it follows.
  for (const char* size : {"640x480", "640,480", "640 480", "=640x480"})
    expect((size[0] == '=' ? "--size" : "--size ") + std::string(size) + " nope" + render(), 3,
           "material \"nope\"");
}

TEST(Program, TimesAndZoomsAreNumbersInTheirRange) {
  expect("nope --at abc" + render(), 2, "--at: \"abc\" is not a time in seconds");
  expect("nope --at nan" + render(), 2, "--at: \"nan\" is not a time in seconds");
  expect("nope --at -1" + render(), 2, "--at: the time must be 0 or more seconds");
  expect("nope --zoom abc" + render(), 2, "--zoom: \"abc\" is not a number");
  for (const char* zoom : {"0", "-1", "101", "inf"})
    expect(std::string("nope --zoom ") + zoom + render(), 2,
           "is out of range; a zoom is 0.01..100");
}

TEST(Program, ACameraNeedsTwoDifferentFinitePoints) {
  expect("nope --eye 1 2 3" + render(), 2, "--eye and --target go together");
  expect("nope --eye 1 2 3 --target 1 2 3" + render(), 2, "no direction to look");
  expect("nope --eye 1 2 nan --target 1 2 3" + render(), 2, "\"nan\" is not a coordinate");
  expect("nope --eye 1 2 3 --target 1 inf 3" + render(), 2, "\"inf\" is not a coordinate");
  expect("nope --eye 1 2 1e300 --target 1 2 3" + render(), 2, "is too far away");
}

TEST(Program, APictureThatCannotBeWrittenIsRefusedBeforeTheWork) {
  expect("nope --render a.jpg", 3, "--render: \"a.jpg\" does not end with .png");
  expect("nope --render ''", 3, "does not end with .png");
  expect("nope --render '" + testing::TempDir() + "robomosp-no-such-folder/a.png'", 3,
         "there is no folder");
  expect("nope --screenshot a.jpg", 3, "--screenshot: \"a.jpg\" does not end with .png");
}

TEST(Program, ARefusedPictureLeavesNoFile) {
  const auto file = std::filesystem::path(testing::TempDir()) / "robomosp-never-drawn.png";
  run("nope" + render());
  EXPECT_FALSE(std::filesystem::exists(file));
}

TEST(Program, AMapStandsAroundARobot) {
  const std::string file = testing::TempDir() + "robomosp-map.png";
  std::filesystem::remove(file);
  const Ended ended =
      run("planar2rods --map manipulability --cut -x --map-opacity 0.5 --fast "
          "--size 64x48 --render '" +
          file + "'");
  EXPECT_EQ(ended.status, 0) << ended.output;
  EXPECT_EQ(ended.output, file + "\n");
  EXPECT_TRUE(std::filesystem::exists(file));
  std::filesystem::remove(file);
  expect("mechanisms --map manipulability --play nobody path" + render(), 3,
         "there is no robot \"nobody\" in the world");
}

}  // namespace
