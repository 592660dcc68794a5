// SPDX-License-Identifier: Apache-2.0
// G-code: words and arcs read back, every construct, wrong input; tests/checkers asks rs274.
#include <cstdio>

#include "gcode.h"
#include "posts_support.h"

namespace robomosp::posts_test {
namespace {

const post::GCode kGCode;

TEST(GCodePost, WhatIsReadFromTheTextIsWhatTheProgramSays) {
  PostOption rotary;
  rotary.name = "rotary";
  rotary.value = "ABC";
  for (unsigned seed = 1; seed < 6; ++seed) {
    const Straight s = straight(200, seed, false, false);
    How how;
    how.profile.options = {&rotary, 1};
    const Posted p = posted(kGCode, s.irl, how);
    ASSERT_EQ(p.errors, 0) << p.faults;
    std::vector<Seen> got;
    for (const std::string& l : lines_of(p.text())) {
      std::map<char, double> word;
      for (std::size_t i = 0; i + 1 < l.size(); ++i)
        if (l[i] >= 'A' && l[i] <= 'Z') word[l[i]] = numbers_in(l.substr(i + 1))[0];
      Seen x;
      if (l.starts_with("G0 ") || l.starts_with("G1 ")) {
        x.what = l[1] == '0' ? "ptp" : "lin";
        x.mm = {word['X'], word['Y'], word['Z']};
        x.R = matrix(rpy(word['A'], word['B'], word['C']));
        x.value = l[1] == '0' ? 25 : word['F'] / 60;
      } else if (l.starts_with("M64 P") || l.starts_with("M65 P")) {
        x.what = "out";
        x.number = static_cast<int>(word['P']);
        x.value = l[2] == '4';
      } else if (l.starts_with("G4 P")) {
        x.what = "wait";
        x.value = word['P'];
      } else {
        continue;
      }
      got.push_back(x);
    }
    same(s.seen, got);
  }
}

std::string arcs() {
  return "PROGRAM prog;\nVAR ORIENTATION: d := ORIZYX(0.0, 180.0, 0.0);\nBEGIN\n"
         "MOVE LIN POSE(POSITION(10.0, 0.0, 0.0), d) SPEED := 50.0;\n"
         "MOVE CIRCLE POSE(POSITION(0.0, 10.0, 0.0), d), POSE(POSITION(-10.0, 0.0, 0.0), d) SPEED "
         ":= 50.0;\n"
         "MOVE CIRCLE POSE(POSITION(0.0, 10.0, 0.0), d), POSE(POSITION(10.0, 0.0, 0.0), d);\n"
         "MOVE CIRCLE POSE(POSITION(0.0, 0.0, 10.0), d), POSE(POSITION(-10.0, 0.0, 0.0), d);\n"
         "MOVE LIN POSE(POSITION(0.0, 10.0, 0.0), d);\n"
         "MOVE CIRCLE POSE(POSITION(0.0, 0.0, 10.0), d), POSE(POSITION(0.0, -10.0, 0.0), d);\n"
         "MOVE CIRCLE POSE(POSITION(5.0, 5.0, 5.0), d), POSE(POSITION(0.0, 10.0, 3.0), d);\n"
         "ENDPROGRAM;\n";
}
TEST(GCodePost, ArcsInThePlanesHaveTheirCentreAndOthersAreChords) {
  const Posted p = posted(kGCode, arcs());
  ASSERT_EQ(p.errors, 0) << p.faults;
  const std::string t = p.text();
  EXPECT_TRUE(has_text(t, "G17\nG3 X-10.000 Y0.000 Z0.000 I-10.000 J0.000 F3000.000\n")) << t;
  EXPECT_TRUE(has_text(t, "G2 X10.000 Y0.000 Z0.000 I10.000 J0.000 F15000.000\n")) << t;
  // From x over z to -x is against the sense of z to x: clockwise seen from +y.
  EXPECT_TRUE(has_text(t, "G18\nG2 X-10.000 Y0.000 Z0.000 I-10.000 K0.000 F15000.000\n")) << t;
  EXPECT_TRUE(has_text(t, "G19\nG3 X0.000 Y-10.000 Z0.000 J-10.000 K0.000 F15000.000\n")) << t;
  // Chords: each end is on the sphere's circle through the three points.
  const std::size_t chords = t.find("G1", t.find("G19\n"));
  int n = 0;
  for (const std::string& l : lines_of(t.substr(chords))) {
    if (!l.starts_with("G1 ")) continue;
    ++n;
    EXPECT_TRUE(has_text(l, "F15000.000"));
  }
  EXPECT_GT(n, 20);
  EXPECT_TRUE(has_text(p.faults, "the circle is written as " + std::to_string(n))) << p.faults;
  EXPECT_TRUE(has_text(t, "X0.000 Y10.000 Z3.000 F15000.000\nM2\n"));
}

/// Rotary axes go from number to number: 180 to -135 would be 315 degrees for a turn of 45.
TEST(GCodePost, RotaryAxesGoOnFromWhereTheyAre) {
  PostOption rotary;
  rotary.name = "rotary";
  rotary.value = "ABC";
  How how;
  how.robot = true;
  how.form = kPostFlat;
  how.profile.options = {&rotary, 1};
  std::string irl = "PROGRAM prog;\nBEGIN\n";
  // Two whole turns of C, and the hand over the edge where A and C turn round.
  for (int k = 0; k <= 48; ++k)
    irl += "MOVE LIN POSE(POSITION(500.0, 0.0, 200.0), ORIZYX(" + std::to_string(15 * k) +
           ".0, 180.0, 0.0));\n";
  for (int b = 60; b <= 120; b += 15)
    irl += "MOVE LIN POSE(POSITION(500.0, 0.0, 200.0), ORIZYX(0.0, " + std::to_string(b) +
           ".0, 0.0));\n";
  const Posted p = posted(kGCode, irl + "ENDPROGRAM;\n", how);
  ASSERT_EQ(p.errors, 0) << p.faults;
  std::vector<Numbers> at;
  for (const std::string& l : lines_of(p.text())) {
    const std::size_t a = l.find(" A"), b = l.find(" B"), c = l.find(" C");
    if (!l.starts_with("G1 ") || a == std::string::npos) continue;
    at.push_back(
        {std::stod(l.substr(a + 2)), std::stod(l.substr(b + 2)), std::stod(l.substr(c + 2))});
  }
  ASSERT_EQ(at.size(), 54U) << p.text();
  for (std::size_t i = 1; i < at.size(); ++i) {
    if (i == 49) continue;  // between the two parts
    double way = 0;
    for (std::size_t k = 0; k < 3; ++k) way += std::fabs(at[i][k] - at[i - 1][k]);
    EXPECT_NEAR(way, 15, 1e-3) << i;
  }
  EXPECT_NEAR(std::fabs(at[48][2] - at[0][2]), 720, 1e-3);
}

TEST(GCodePost, AnotherOrientationIsAnErrorOnThreeAxes) {
  const Posted p =
      posted(kGCode,
             "PROGRAM prog;\nBEGIN\nMOVE LIN POSE(POSITION(1.0, 0.0, 0.0), ORIZYX(0.0, "
             "0.0, 0.0));\nMOVE LIN POSE(POSITION(1.0, 0.0, 0.0), ORIZYX(5.0, 0.0, "
             "0.0));\nENDPROGRAM;\n");
  EXPECT_TRUE(has_text(p.faults, "error 4: G-code has no orientation changes"));
}
TEST(GCodePost, ThePageIsRight) { page_is_right(kGCode, "gcode.md", {}); }
TEST(GCodePost, EveryConstructIsTextOrAnErrorAtItsLine) { every_construct(kGCode, {}, 15); }
TEST(GCodePost, WrongInputIsSaid) { wrong_input(kGCode, {}); }
TEST(GCodePost, TimeGrowsWithTheProgram) {
  PostOption rotary;
  rotary.name = "rotary";
  rotary.value = "ABC";
  How how;
  how.profile.options = {&rotary, 1};
  is_linear(kGCode, how, false, false);
}

}  // namespace
}  // namespace robomosp::posts_test
