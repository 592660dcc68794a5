// SPDX-License-Identifier: Apache-2.0
// What the program of 2006 did wrong with programs, a test each: rules that were missing, signals
// that led nowhere, LIN that was PTP, ORIMAT, angles, targets by pointer, STATUS and TURNS.
#include <cmath>
#include <sstream>

#include "c99.h"
#include "melfa.h"
#include "movemaster.h"
#include "posts_support.h"
#include "program_post/templates.h"
#include "support/posts.h"
#include "support/program_world.h"

namespace robomosp {
namespace {

using posts_test::has_text;
using posts_test::How;
using program::testing::fault_of;
using program::testing::loaded;
using program::testing::run_to_end;
using program::testing::TestWorld;

const std::string kPose = "POSE: q := POSE(POSITION(300.0, 0.0, 200.0), ORIZYX(0.0, 180.0, 0.0));";

std::string written_text(const std::string& text) {
  program::Machine m = loaded(text);
  TestWorld w;
  EXPECT_EQ(fault_of(run_to_end(m, w)), "");
  return w.text;
}

// 1: its translation files had no rule for LIN and CIRCLE of the RV-M1, and nobody was told.
TEST(DefectsOf2006, WhatATargetHasNoRuleForIsAnErrorAndNeverLeftOut) {
  const std::string head =
      "robomosp target 1\nname: a\nmotions: lin\n== program_begin\n"
      "== program_end\n== output_on\nON {{number}}\n== output_off\nOFF {{number}}\n"
      "== wait_time\nWAIT {{seconds}}\n";
  // A pack without the rule does not load.
  const auto poor = program_post::read_templates(head, "a.post");
  ASSERT_FALSE(poor.ok());
  EXPECT_TRUE(has_text(poor.error().message, "lin")) << poor.error().message;
  // What the rules do not say is an error at its line.
  const auto pack = program_post::read_templates(
      head + "== lin\nGO {{x}} {{y}} {{z}} {{a}} {{b}} {{c}}\n", "a.post");
  ASSERT_TRUE(pack.ok()) << pack.error().sentence();
  const auto said = test::post_source(*program_post::make_template_post(*pack),
                                      "PROGRAM p;\nVAR " + kPose +
                                          "\nBEGIN\nMOVE LIN q;\nMOVE PTP q;\nWAIT 1.0 SEC;\n"
                                          "PAUSE;\nENDPROGRAM;\n");
  EXPECT_TRUE(has_text(said.faults, "error 5: ")) << said.faults;
  EXPECT_TRUE(has_text(said.faults, "error 7: ")) << said.faults;
  EXPECT_FALSE(has_text(said.faults, "error 4: ")) << said.faults;
  // The RV-M1 has both now: LIN is MS, a circle is pieces of it.
  const auto rv = test::post_source(
      post::Movemaster(),
      "PROGRAM p;\nVAR " + kPose +
          "\nBEGIN\nMOVE LIN q;\nMOVE CIRCLE POSE(POSITION(350.0, 0.0, 250.0), q.ORI), "
          "POSE(POSITION(300.0, 0.0, 300.0), q.ORI);\nENDPROGRAM;\n");
  EXPECT_FALSE(has_text(rv.faults, "error")) << rv.faults;
  ASSERT_EQ(rv.files.size(), 1U);
  int straight = 0;
  for (const std::string& l : posts_test::lines_of(rv.files.begin()->second))
    straight += has_text(l, " MS ");
  EXPECT_GT(straight, 8) << rv.files.begin()->second;
}

// 2: signals were plain variables; UNTIL, processes and interrupts became comments.
TEST(DefectsOf2006, SignalsAreWiredAndUntilProcessesAndInterruptsWork) {
  const std::string text =
      "PROGRAM p;\nSIGNAL INPUT BOOL: stop AT 1; INPUT BOOL: alarm AT 2; "
      "OUTPUT BOOL: g AT 3; OUTPUT INT: lamp AT 4, 4;\nVAR INT: ticks; " +
      kPose +
      "\nPROCESS beat; BEGIN LOOP WAIT 0.1 SEC; ticks := ticks + 1; ENDLOOP; "
      "ENDPROCESS;\nINTERRUPT z WHEN alarm; BEGIN lamp := 9; ENDINTERRUPT;\n"
      "BEGIN\nSTART beat; ENABLE z;\ng := TRUE;\nMOVE LIN q UNTIL stop;\n"
      "CANCEL beat;\nWRITE(ticks);\nENDPROGRAM;\n";
  program::Machine m = loaded(text);
  TestWorld w;
  w.motion_seconds = 10;
  const auto until = [&](double time) {
    for (; w.now < time - 1e-9; w.now += 0.01) m.run(w.now, w);
  };
  until(0.25);
  using Writes = std::vector<std::pair<std::string, std::int64_t>>;
  EXPECT_EQ(w.writes, (Writes{{"g", 1}}));
  ASSERT_EQ(w.motions.size(), 1U);
  EXPECT_TRUE(w.motions[0].has_until);
  w.inputs["alarm"] = {1, 0};
  until(0.3);
  EXPECT_EQ(w.writes, (Writes{{"g", 1}, {"lamp", 9}}));
  EXPECT_TRUE(w.aborted.empty());
  until(0.45);
  w.inputs["stop"] = {1, 0};
  const auto& s = run_to_end(m, w);
  EXPECT_EQ(fault_of(s), "");
  ASSERT_EQ(w.aborted.size(), 1U);
  EXPECT_EQ(w.text, "4");
  EXPECT_LT(w.now, 1);
  // Posted, they have their numbers and the condition is asked.
  const auto c = posts_test::posted(
      posts::C99(), "PROGRAM p;\nSIGNAL INPUT BOOL: stop AT 7; OUTPUT BOOL: g AT 3;\nVAR " + kPose +
                        "\nBEGIN\ng := TRUE;\nMOVE LIN q UNTIL stop;\nENDPROGRAM;\n");
  EXPECT_EQ(c.errors, 0) << c.faults;
  const std::string& main = c.files.at("prog.c");
  EXPECT_TRUE(has_text(main, "rmp_output(3, \"g\", 1)")) << main;
  EXPECT_TRUE(has_text(main, "return (rmp_input(7, \"stop\") != 0);")) << main;
}

// 3: LIN and PTP of the PA-10 were the same call, and loops began at 0 over lists from 1.
TEST(DefectsOf2006, LinAndPtpOfThePa10DifferAndListsBeginWhereTheyWereDeclared) {
  const auto text_of = [](const char* motion, bool robot, std::string& faults) {
    How how;
    how.robot = robot;
    const auto p = posts_test::posted(
        posts::Pa10(),
        "PROGRAM p;\nVAR " + kPose + "\nBEGIN\nMOVE " + motion + " q;\nENDPROGRAM;\n", how);
    EXPECT_EQ(p.errors, 0) << p.faults;
    faults = p.faults;
    return p.files.at("prog.c");
  };
  std::string faults;
  EXPECT_TRUE(has_text(text_of("LIN", true, faults), "  rmp_lin("));
  const std::string ptp = text_of("PTP", true, faults);
  EXPECT_TRUE(has_text(ptp, "  rmp_ptp_to(rmp_joints(")) << ptp;
  EXPECT_FALSE(has_text(faults, "straight line")) << faults;
  // Without a robot the joints are not known, and the straight way is told.
  text_of("PTP", false, faults);
  EXPECT_TRUE(has_text(faults, "warning 4: this PTP becomes a straight line")) << faults;
  // The library's calls behind them.
  const auto files = posts_test::posted(posts::Pa10(), "PROGRAM p;\nBEGIN\nENDPROGRAM;\n").files;
  const std::string& library = files.at("rmp_pa10.c");
  const auto body = [&](const std::string& name) {
    const std::size_t at = library.find("\nvoid " + name + "(");
    EXPECT_NE(at, std::string::npos) << name;
    return library.substr(at, library.find("\n}\n", at) - at);
  };
  EXPECT_TRUE(has_text(body("rmp_ptp_joints"), "pa_exe_axs("));
  EXPECT_TRUE(has_text(body("rmp_ptp_to"), "rmp_ptp_joints(to, how, until);"));
  EXPECT_TRUE(has_text(body("rmp_lin"), "go(to);"));

  const std::string loop =
      "PROGRAM p;\nVAR ARRAY [1..3] OF REAL: x := [10.0, 20.0, 30.0]; INT: i;\nBEGIN\nFOR i := 1 "
      "TO 3\nMOVE LIN POSE(POSITION(x[i], 0.0, 0.0), ORIZYX(0.0, 0.0, 0.0));\nENDFOR;\n"
      "ENDPROGRAM;\n";
  program::Machine m = loaded(loop);
  TestWorld w;
  EXPECT_EQ(fault_of(run_to_end(m, w)), "");
  ASSERT_EQ(w.motions.size(), 3U);
  for (std::size_t i = 0; i < 3; ++i)
    EXPECT_EQ(w.motions[i].targets[0].pose.position[0], 10.0 * static_cast<double>(i + 1));
  const auto c = posts_test::posted(posts::C99(), loop);
  EXPECT_TRUE(has_text(c.files.at("prog.c"), "x[i - 1]")) << c.files.at("prog.c");
}

// 4: ORIMAT wrote Q2 twice and Q3 never, and mixed up terms of the third axis.
TEST(DefectsOf2006, OrimatGivesAllFourNumbersInEveryBranch) {
  // The greatest of the four is each in turn.
  const double angles[][3] = {{10, 20, 30},   {170, 10, 5},    {5, 170, 10}, {5, 10, 170},
                              {-120, 40, 60}, {90, -80, 20},   {180, 0, 0},  {0, 180, 0},
                              {0, 0, 180},    {135, -35, -150}};
  int greatest[4] = {};
  for (const auto& a : angles) {
    const posts_test::Q want =
        posts_test::times(posts_test::times(posts_test::about(2, a[0]), posts_test::about(1, a[1])),
                          posts_test::about(0, a[2]));
    const auto R = posts_test::matrix(want);
    std::ostringstream text;
    text.precision(17);
    text << std::fixed << "PROGRAM p;\nVAR ORIENTATION: o; ARRAY [1..3] OF POSITION: v;\nBEGIN\n";
    for (std::size_t k = 0; k < 3; ++k)
      text << "v[" << k + 1 << "] := POSITION(" << R[k] << ", " << R[3 + k] << ", " << R[6 + k]
           << ");\n";
    text << "o := ORIMAT(v[1], v[2], v[3]);\n"
            "WRITE(o.Q1, ' ', o.Q2, ' ', o.Q3, ' ', o.Q4);\nENDPROGRAM;\n";
    std::istringstream in(written_text(text.str()));
    posts_test::Q got{};
    for (double& x : got) in >> x;
    ASSERT_TRUE(in) << text.str();
    double same = 0;
    std::size_t most = 0;
    for (std::size_t k = 0; k < 4; ++k) {
      same += got[k] * want[k];
      if (std::fabs(want[k]) > std::fabs(want[most])) most = k;
    }
    ++greatest[most];
    const double sign = same < 0 ? -1 : 1;
    for (std::size_t k = 0; k < 4; ++k) EXPECT_NEAR(sign * got[k], want[k], 1e-9) << text.str();
  }
  for (const int n : greatest) EXPECT_GT(n, 0);
}

// 5: its ATAN(0) was 90, ASIN(-1) 270, and TAN(180) a matter of parentheses.
TEST(DefectsOf2006, AnglesInDegreesAreThoseOfTheFunctions) {
  const std::pair<const char*, const char*> kEach[] = {
      {"ATAN(x)", "0.0"},          {"ATAN(x + 1.0)", "45.0"},   {"ATAN(x - 1.0)", "-45.0"},
      {"ASIN(x - 1.0)", "-90.0"},  {"ASIN(x + 1.0)", "90.0"},   {"ACOS(x - 1.0)", "180.0"},
      {"ACOS(x)", "90.0"},         {"TAN(x + 180.0)", "0.0"},   {"TAN(x + 45.0)", "1.0"},
      {"TAN(x - 180.0)", "0.0"},   {"SIN(x + 180.0)", "0.0"},   {"COS(x + 90.0)", "0.0"},
      {"ATAN2(x, -1.0)", "180.0"}, {"ATAN2(-1.0, x)", "-90.0"}, {"SIN(x + 30.0)", "0.5"}};
  for (const auto& [function, value] : kEach) {
    // As it runs, and as the compiler folds it.
    for (const bool runs : {true, false}) {
      const std::string text = std::string("PROGRAM p;\n") + (runs ? "VAR" : "CONST") +
                               " REAL: x := 0.0;\nBEGIN\nWRITE(" + function + ");\nENDPROGRAM;\n";
      const double got = std::stod(written_text(text));
      EXPECT_NEAR(got, std::stod(value), 1e-12) << text;
      EXPECT_FALSE(std::signbit(got) && got == 0) << text;
    }
  }
}

// 6: targets were pointers to one temporary that the next target took.
TEST(DefectsOf2006, TargetsKeepTheirOwnValues) {
  program::Machine m = loaded(
      "PROGRAM p;\nVAR " + kPose +
      " INT: i;\nFUNCTION spot (IN REAL: x): POSE;\nBEGIN\n"
      "  RETURN POSE(POSITION(x, 0.0, 200.0), ORIZYX(0.0, 180.0, 0.0));\nENDFCT;\nBEGIN\n"
      "MOVE CIRCLE spot(1.0), spot(2.0);\nMOVE PATH spot(3.0), spot(4.0), spot(5.0);\n"
      "FOR i := 6 TO 8\n  q.POS.X := i;\n  MOVE LIN q C_CP := 5.0;\n  q.POS.X := 0.0;\nENDFOR;\n"
      "MOVE LIN q @ spot(9.0);\nENDPROGRAM;\n");
  TestWorld w;
  EXPECT_EQ(fault_of(run_to_end(m, w)), "");
  ASSERT_EQ(w.motions.size(), 6U);
  std::vector<double> x;
  for (const auto& motion : w.motions)
    for (const auto& target : motion.targets) x.push_back(target.pose.position[0]);
  ASSERT_EQ(x.size(), 9U);
  for (std::size_t i = 0; i < 8; ++i) EXPECT_EQ(x[i], static_cast<double>(i + 1));
  EXPECT_NEAR(x[8], -9, 1e-9);
}

// 7: STATUS and TURNS of a ROBTARGET were read by nobody.
TEST(DefectsOf2006, StatusAndTurnsOfATargetCount) {
  const std::string text =
      "PROGRAM p;\nVAR ROBTARGET: t := ROBTARGET(POSE(POSITION(450.0, 200.0, 300.0), ORIZYX(0.0, "
      "120.0, 0.0)), 2, [1, -1], ADD_JOINT(25.0));\nBEGIN\nMOVE PTP t;\nt.STATUS := 5;\n"
      "t.TURNS[2] := 3;\nMOVE LIN t;\nENDPROGRAM;\n";
  program::Machine m = loaded(text);
  TestWorld w;
  EXPECT_EQ(fault_of(run_to_end(m, w)), "");
  ASSERT_EQ(w.motions.size(), 2U);
  const auto& first = w.motions[0].targets[0];
  const auto& second = w.motions[1].targets[0];
  EXPECT_EQ(first.status, 2);
  EXPECT_EQ(first.turns, (std::vector<std::int32_t>{1, -1}));
  EXPECT_EQ(first.additional, (std::vector<double>{25}));
  EXPECT_EQ(second.status, 5);
  EXPECT_EQ(second.turns, (std::vector<std::int32_t>{1, 3}));
  // Posted, each has its own flags: right, above and no flip are 7.
  std::set<std::string> flags;
  for (int status = 0; status < 8; ++status) {
    const auto p = posts_test::posted(
        post::Melfa5(),
        "PROGRAM p;\nBEGIN\nMOVE PTP ROBTARGET(POSE(POSITION(450.0, 200.0, 300.0), "
        "ORIZYX(0.0, 120.0, 0.0)), " +
            std::to_string(status) + ", [0, 0], ADD_JOINT(0.0));\nENDPROGRAM;\n");
    EXPECT_EQ(p.errors, 0) << p.faults;
    const std::string all = p.text();
    const std::size_t at = all.find(")(");
    ASSERT_NE(at, std::string::npos) << all;
    flags.insert(all.substr(at + 2, all.find(',', at) - at - 2));
  }
  EXPECT_EQ(flags.size(), 8U);
}

}  // namespace
}  // namespace robomosp
