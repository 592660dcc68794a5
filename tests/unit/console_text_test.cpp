// SPDX-License-Identifier: Apache-2.0
// What a console shows: robots on one screen, help and tables as wide as the terminal, digits.
#include <algorithm>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <sstream>

#include <gtest/gtest.h>

#include "lua/lua_state.h"
#include "lua/terminal_text.h"
#include "support/library_robots.h"
#include "support/program.h"

namespace robomosp::lua {
namespace {

class ConsoleText : public test::ProgramTest {
 protected:
  void SetUp() override {
    ProgramTest::SetUp();
    LuaOptions options;
    options.print = [this](std::string_view s) { printed_ += s; };
    options.width = [this] { return width_; };
    state_ = std::make_unique<LuaState>(app(), session_, std::move(options));
  }
  std::string eval(std::string_view code) {
    auto r = state_->eval(code);
    return r.ok() ? *r
                  : "ERROR " + std::string(to_string(r.error().code)) + ": " + r.error().sentence();
  }
  static std::size_t widest(const std::string& text) {
    std::size_t out = 0;
    std::istringstream in(text);
    for (std::string line; std::getline(in, line);) out = std::max(out, width_of(line));
    return out;
  }
  /// The letters and digits, sorted: what a layout must not lose.
  static std::string letters(const std::string& text) {
    std::string out;
    for (const char c : text)
      if (std::isalnum(static_cast<unsigned char>(c)) != 0) out += c;
    std::sort(out.begin(), out.end());
    return out;
  }
  /// Both sorted; a table that is cut repeats its first column.
  static bool has_all(const std::string& text, const std::string& what) {
    return std::includes(text.begin(), text.end(), what.begin(), what.end());
  }
  ioci::Session session_{"test"};
  std::size_t width_ = 0;
  std::string printed_;
  std::unique_ptr<LuaState> state_;
};

TEST_F(ConsoleText, ARobotShowsItsRowsLimitsMassesAndSolvers) {
  const std::string text = eval("robot 'puma560'");
  // Corke and Armstrong-Helouvry 1994: the elbow is 0.4318 m from the shoulder; limits of -160 to
  // 160 degrees; 17.4 kg of upper arm; 23.45 kg of links in all.
  for (const char* word :
       {"0.4318", "0.15005", "-160", "17.4", "23.45 kg in all", "spherical_wrist",
        "newton_euler (default)", "standard Denavit-Hartenberg", "wrist_pitch"})
    EXPECT_NE(text.find(word), std::string::npos) << word << "\n" << text;
  EXPECT_EQ(text, eval("= robot 'puma560'"));
  EXPECT_LT(std::count(text.begin(), text.end(), '\n'), 23) << text;
  // Only what stands alone: a list of robots stays a list, and a text is the same as ever.
  EXPECT_NE(eval("{robot 'puma560'}").find("robot:puma560#"), std::string::npos);
  EXPECT_TRUE(eval("tostring(robot 'puma560')").starts_with("robot:puma560#"));
}

TEST_F(ConsoleText, ARobotWithoutPosesIsToldHowOneIsNamed) {
  eval("bare = robot.create{name = 'bare', links = {{a = 1, mass = 1}}}");
  EXPECT_NE(eval("bare:fk{q = 'zero'}").find("robot.set_pose names one"), std::string::npos)
      << eval("bare:fk{q = 'zero'}");
}

TEST_F(ConsoleText, EveryRobotOfTheLibraryFitsAScreen) {
  width_ = 80;
  std::size_t count = 0;
  for (const std::string& name : test::library_robots()) {
    const std::string text = eval("robot('" + name + "')");
    EXPECT_FALSE(text.starts_with("ERROR")) << text;
    EXPECT_LE(widest(text), 80U) << text;
    EXPECT_LT(std::count(text.begin(), text.end(), '\n'), 70) << text;
    ++count;
  }
  EXPECT_GT(count, 10U);
}

TEST_F(ConsoleText, ALongChainIsShortened) {
  const std::string text = eval(
      "links = {} for i = 1, 300 do links[i] = {a = 0.1, mass = 1} end "
      "return robot.create{name = 'chain', links = links}");
  EXPECT_NE(text.find("... 276 more"), std::string::npos) << text;
  EXPECT_NE(text.find("300 kg in all"), std::string::npos) << text;
  EXPECT_LT(std::count(text.begin(), text.end(), '\n'), 40) << text;
}

TEST_F(ConsoleText, TablesHelpAndMatricesKeepToTheWidthAndLoseNothing) {
  eval("puma = robot 'puma560'");
  const char* const shown[] = {
      "help(robot)",   "help 'units'", "help(linalg)",    "help()", "apropos 'inverse'",
      "puma:joints()", "puma:tools()", "puma:dh_table()", "puma",   "provider.list()"};
  for (const char* code : shown) {
    width_ = 400;
    const std::string wide = eval(code);
    ASSERT_FALSE(wide.starts_with("ERROR")) << wide;
    for (const std::size_t width : {60U, 80U, 100U, 133U}) {
      width_ = width;
      const std::string text = eval(code);
      EXPECT_LE(widest(text), width) << code << "\n" << text;
      EXPECT_TRUE(has_all(letters(text), letters(wide))) << code << "\n" << text;
    }
  }
  width_ = 60;
  const std::string ones = eval("linalg.ones(2, 70)");
  EXPECT_LE(widest(ones), 60U);
  EXPECT_NE(ones.find("columns 1 to "), std::string::npos);
  std::ptrdiff_t count = 0;
  std::istringstream lines(ones);
  for (std::string line; std::getline(lines, line);)
    if (line.starts_with('[')) count += std::count(line.begin(), line.end(), '1');
  EXPECT_EQ(count, 140) << ones;
  EXPECT_LE(widest(eval("linalg.linspace(0, 1, 200)")), 60U);
  // Without a terminal everything is as it was: Markdown, and rows of one line.
  width_ = 0;
  EXPECT_NE(eval("help 'robot.fk'").find("|---|"), std::string::npos);
  EXPECT_EQ(eval("linalg.ones(2, 70)").find("columns"), std::string::npos);
}

TEST_F(ConsoleText, NumbersWithinCellsHaveTheDigitsOfOthersAndCutTablesRepeatTheName) {
  eval("list = {{way = {a = 1/3, b = {2/3, 1}}, name = 'one', at = array{1/3, 2}}}");
  const std::string text = eval("list");
  EXPECT_NE(text.find("0.333333"), std::string::npos) << text;
  EXPECT_EQ(text.find("0.3333333"), std::string::npos) << text;
  EXPECT_EQ(text.find("0.6666666"), std::string::npos) << text;
  eval("digits(15)");
  EXPECT_NE(eval("list").find("0.666666666666667"), std::string::npos) << eval("list");
  eval("digits(6)");
  // As given where there is room, each part with the name of its row where there is none.
  width_ = 100;
  EXPECT_NE(eval("robot('puma560'):dh_table()").find("a    alpha        d  link"),
            std::string::npos);
  width_ = 60;
  const std::string cut = eval("robot('puma560'):dh_table()");
  std::size_t count = 0;
  for (std::size_t at = cut.find("wrist_pitch"); at != std::string::npos;
       at = cut.find("wrist_pitch", at + 1))
    ++count;
  EXPECT_EQ(count, 2U) << cut;
}

TEST_F(ConsoleText, AScriptThatWasTypedAtTheConsoleIsToldHowValuesAreShown) {
  const auto run = [&](const std::string& code) {
    const std::string file = testing::TempDir() + "robomosp-typed.lua";
    std::ofstream(file) << code;
    const auto r = state_->run_file(file, {});
    return r.ok() ? std::string("ok") : r.error().sentence();
  };
  const std::string hint = "print(...) shows a value";
  EXPECT_NE(run("x = 1\nx\n\ny = 2\n").find(hint), std::string::npos) << run("x = 1\nx\ny = 2\n");
  EXPECT_NE(run("puma = robot 'puma560'\npuma").find(hint), std::string::npos);
  EXPECT_EQ(run("x = 1\nx\ny = 2\n").find("syntax error: syntax error"), std::string::npos);
  EXPECT_NE(run("f = function()\n  return 1\nend\nf().x, 2\n").find(hint), std::string::npos);
  EXPECT_EQ(run("x = {\n  a = 1,\n  b = = 2 }\n").find(hint), std::string::npos);
  EXPECT_EQ(run("for i = 1, 2 do\n  i\nend\n").find(hint), std::string::npos);
  EXPECT_EQ(run("print(1").find(hint), std::string::npos);
  EXPECT_EQ(run("x = 1"), "ok");
}

TEST_F(ConsoleText, WordsWrapWhereTheyEndAndLongOnesAreCut) {
  EXPECT_EQ(wrapped("one two three", 7), (std::vector<std::string>{"one two", "three"}));
  EXPECT_EQ(wrapped("abcdefgh", 3), (std::vector<std::string>{"abc", "def", "gh"}));
  EXPECT_EQ(wrapped("", 5), (std::vector<std::string>{""}));
  EXPECT_EQ(wrapped("\u00e4\u00f6\u00fc \u00df", 3),
            (std::vector<std::string>{"\u00e4\u00f6\u00fc", "\u00df"}));
  EXPECT_EQ(table_text({{"name", "n"}, {"a", "12"}}, {false, true}, 0), "name   n\na     12");
  EXPECT_EQ(fitted("| a | b |\n|---|---:|\n| x\\|y | 1 |\n", 40), "a    b\nx|y  1\n");
  EXPECT_EQ(fitted("  name   one two three\n", 16), "  name   one two\n         three\n");
}

TEST_F(ConsoleText, NumbersAreShownWithAsManyDigitsAsAsked) {
  EXPECT_EQ(eval("1/3"), "0.333333");
  eval("digits(15)");
  EXPECT_EQ(eval("1/3"), "0.333333333333333");
  EXPECT_EQ(eval("array{1/3, 0.5}"), "{0.333333333333333, 0.5}");
  EXPECT_EQ(eval("tostring(array{1/3})"), "{0.333333333333333}");
  EXPECT_EQ(eval("digits()"), "15");
  for (const char* wrong : {"digits(0)", "digits(18)", "digits(2.5)", "digits('x')", "digits{}"})
    EXPECT_TRUE(eval(wrong).starts_with("ERROR invalid_argument: digits(n) needs a whole number"))
        << eval(wrong);
  EXPECT_EQ(eval("digits()"), "15");
  eval("digits(6)");
  EXPECT_EQ(eval("1/3"), "0.333333");
}

TEST_F(ConsoleText, HelpIsGroupedAndFindsMethodsByTheirNames) {
  const std::string robots = eval("help(robot)");
  for (const char* group :
       {"\ninverse kinematics\n", "\ndynamics\n", "\ncollision and clearance\n"})
    EXPECT_NE(robots.find(group), std::string::npos) << group << robots;
  for (const ioci::CommandSpec* spec : app().commands.list())
    EXPECT_EQ(robots.find("  " + spec->name + " ") != std::string::npos,
              spec->name.starts_with("robot."))
        << spec->name;
  EXPECT_TRUE(eval("help 'solve_ik'").starts_with("## robot.solve_ik"));
  EXPECT_TRUE(eval("help ':solve_ik'").starts_with("## robot.solve_ik"));
  EXPECT_NE(eval("help 'render'").find("world.render"), std::string::npos);
  EXPECT_EQ(eval("help 'pinv'"), eval("help 'linalg'"));
  EXPECT_NE(eval("help 'solve_kin'").find("there is no command"), std::string::npos);
  EXPECT_NE(eval("help 'torque'").find("apropos(\"torque\") finds"), std::string::npos)
      << eval("help 'torque'");
}

TEST_F(ConsoleText, AproposFindsWhatIsMeant) {
  const auto finds = [this](const std::string& words, const std::string& name, std::size_t among) {
    const auto found = app().commands.apropos(words);
    const auto end = found.begin() + static_cast<std::ptrdiff_t>(std::min(among, found.size()));
    EXPECT_TRUE(std::any_of(found.begin(), end, [&](const auto* s) { return s->name == name; }))
        << words << " does not find " << name << ", but " << found.size() << ": "
        << (found.empty() ? "" : found.front()->name);
  };
  finds("inverse kinematics", "robot.solve_ik", 3);
  finds("inverse kinematic", "robot.solve_ik", 3);
  finds("invers", "robot.inverse_dynamics", 3);
  finds("invrese kinematics", "robot.solve_ik", 3);
  finds("ik", "robot.solve_ik", 3);
  finds("torque", "robot.inverse_dynamics", 5);
  finds("torques", "robot.inverse_dynamics", 5);
  finds("render", "view.render", 10);
  finds("draw robot", "robot.render", 5);
  finds("film", "recording.video", 5);
  finds("delete robot", "robot.remove", 3);
  finds("jacobain", "robot.jacobian", 3);
  finds("singularities", "robot.singularity", 5);
  finds("copy solid", "solid.duplicate", 3);
  finds("TORQUE", "robot.inverse_dynamics", 5);
  // Where hardly anything has all the words, what has one in its name follows.
  finds("torqe plot", "recording.plot", 4);
  finds("STEP file", "import", 8);
  finds("welding seam", "trajectory.along_edges", 1);
  finds("gripp", "robot.attach", 40);
  EXPECT_LT(app().commands.apropos("undo").size(), 36U);
  EXPECT_TRUE(app().commands.apropos("xyzzyqq").empty());
  EXPECT_TRUE(app().commands.apropos("").empty());
  EXPECT_TRUE(app().commands.apropos("  ,.;").empty());
  EXPECT_NE(eval("apropos 'xyzzyqq'").find("Nothing was found"), std::string::npos);
}

}  // namespace
}  // namespace robomosp::lua
