// SPDX-License-Identifier: Apache-2.0
// MELFA-BASIC IV and V: texts that were read line by line, a reader of its own, every construct,
// wrong input.
#include "melfa.h"
#include "posts_support.h"

namespace robomosp::posts_test {
namespace {

const post::Melfa4 kFour;
const post::Melfa5 kFive;

std::vector<Seen> read_melfa(const std::string& text) {
  std::vector<Seen> out;
  std::map<std::string, Numbers> points;
  std::vector<std::pair<Seen, std::string>> moves;
  double speed = 0, joint_speed = 0;
  int line = 0;
  for (std::string l : lines_of(text)) {
    EXPECT_TRUE(l.ends_with('\r')) << l;
    l.pop_back();
    if (l[0] == 'P' || l[0] == 'J') {
      Numbers n = numbers_in(l.substr(l.find('=')));
      points[l.substr(0, l.find('='))] = n;
      continue;
    }
    const std::size_t blank = l.find(' ');
    const int number = std::stoi(l.substr(0, blank));
    EXPECT_GT(number, line) << l;
    line = number;
    const std::string t = l.substr(blank + 1);
    const Numbers n = numbers_in(t);
    Seen s;
    if (t.starts_with("Spd ")) speed = n[0];
    if (t.starts_with("JOvrd ")) joint_speed = n[0];
    if (t.starts_with("Mov ") || t.starts_with("Mvs ")) {
      s.what = t[2] == 's' ? "lin" : t[4] == 'J' ? "ptp joints" : "ptp";
      s.value = t[2] == 's' ? speed : joint_speed;
      moves.emplace_back(s, t.substr(4));
    } else if (t.starts_with("Mvr ")) {
      const std::size_t a = t.find(','), b = t.find(',', a + 1);
      s.value = speed;
      // An arc begins where the motion before it ended.
      if (!moves.empty() && moves.back().second[0] == 'P' && moves.back().first.what != "wait" &&
          moves.back().first.what != "out") {
        EXPECT_EQ(points.count(t.substr(4, a - 4)), 0U);
        EXPECT_EQ(t.substr(4, a - 4), moves.back().second);
      }
      s.what = "via";
      moves.emplace_back(s, t.substr(a + 1, b - a - 1));
      s.what = "circle";
      moves.emplace_back(s, t.substr(b + 1));
    } else if (t.starts_with("M_Out(")) {
      s.what = "out";
      s.number = static_cast<int>(n[0]);
      s.value = n[1];
      moves.emplace_back(s, "");
    } else if (t.starts_with("Dly ")) {
      s.what = "wait";
      s.value = n[0];
      moves.emplace_back(s, "");
    }
  }
  for (auto& [s, name] : moves) {
    if (!name.empty()) {
      const Numbers& n = points.at(name);
      if (name[0] == 'J') s.joints = n;
      else set_pose(s, n, 0, 1, rpy(n[3], n[4], n[5]));
    }
    out.push_back(s);
  }
  return out;
}

TEST(MelfaPost, WhatIsReadFromTheTextIsWhatTheProgramSays) {
  for (unsigned seed = 1; seed < 6; ++seed) {
    const Straight s = straight(200, seed);
    How how;
    how.robot = true;
    how.form = kPostFlat;
    for (const Post* post : {static_cast<const Post*>(&kFour), static_cast<const Post*>(&kFive)}) {
      const Posted p = posted(*post, s.irl, how);
      ASSERT_EQ(p.errors, 0) << p.faults;
      same(s.seen, read_melfa(p.text()));
    }
  }
}

TEST(MelfaPost, AProgramWithStructureReadsAsItShould) {
  How how;
  how.robot = true;
  const Posted p = posted(kFive, R"(PROGRAM pick;
SIGNAL
  INPUT  BOOL: part_here AT 1;
  INPUT  BOOL: tray_ok   AT 2;
  OUTPUT BOOL: gripper   AT 3;
VAR
  POSE: place := POSE(POSITION(550.0, -300.0, 120.0), ORIZYX(0.0, 180.0, 0.0)), cell;
  POSE: above := POSE(POSITION(0.0, 0.0, 80.0), ORIZYX(0.0, 0.0, 0.0));
  ARRAY [1..3] OF INT: a := [4, 5, 6];
  INT: good := 0; BOOL: full;
FUNCTION twice (IN INT: x): INT;
BEGIN
  RETURN 2 * x;
ENDFCT;
BEGIN
  WHILE good < 5 AND NOT full
    WAIT FOR part_here TIMEOUT 2.0;
    IF R_TIMEOUT THEN HALT; ENDIF;
    cell := place @ above;
    cell.POS.X := 500.0 + twice(a[good]);
    MOVE PTP cell @ above SPEED_PTP := 50.0;
    MOVE LIN place SPEED := 80.0, C_CP := 5.0;
    MOVE LIN cell SPEED := 80.0 UNTIL tray_ok;
    gripper := tray_ok;
    full := good > 3;
    good := good + 1;
  ENDWHILE;
ENDPROGRAM;
)",
                          how);
  ASSERT_EQ(p.errors, 0) << p.faults;
  std::string text = p.text();
  std::erase(text, '\r');
  EXPECT_EQ(text, R"(1 MR_TIMEOUT=0
2 PCELL=P1
3 Dim MA(3)
4 MA(1)=4
5 MA(2)=5
6 MA(3)=6
7 MGOOD=0
8 MFULL=0
9 *L
10 If MGOOD>=5 Or MFULL=1 Then GoTo *L2
11 MR_TIMEOUT=0
12 M_Timer(1)=0
13 *L3
14 If M_In(1)=1 Then GoTo *L4
15 If M_Timer(1)<2.0*1000 Then GoTo *L3
16 MR_TIMEOUT=1
17 *L4
18 If MR_TIMEOUT=1 Then
19 End
20 EndIf
21 PCELL=P2
22 MX=MA(MGOOD)
23 GoSub *TWICE
24 MT=MTWICE
25 PCELL.X=500.0+MT
26 JOvrd 50.00
27 Accel 100,100
28 Cnt 0
29 PT=PCELL*P3
30 PT.FL1=P_Curr.FL1
31 PT.FL2=P_Curr.FL2
32 Mov PT Type 0,0
33 Spd 80.00
34 Mvs P4
35 PT2=PCELL
36 PT2.FL1=P_Curr.FL1
37 PT2.FL2=P_Curr.FL2
38 Mvs PT2 WthIf M_In(2)=1,Skip
39 If M_In(2)=1 Then M_Out(3)=1 Else M_Out(3)=0
40 If MGOOD>3 Then MFULL=1 Else MFULL=0
41 MGOOD=MGOOD+1
42 GoTo *L
43 *L2
44 End
45 *TWICE
46 MTWICE=2*MX
47 Return
48 Return
P1=(0.00,0.00,0.00,0.00,0.00,0.00)(7,0)
P2=(550.000,-300.000,40.000,180.000,0.000,180.000)(7,0)
P3=(0.000,0.000,80.000,0.000,0.000,0.000)(7,0)
P4=(550.000,-300.000,120.000,180.000,0.000,180.000)(7,0)
)");
}

TEST(MelfaPost, ALineLongerThanTheControllerTakesIsAnErrorAtItsLine) {
  const auto with = [](const Post& post, int terms) {
    std::string sum = "i";
    for (int k = 0; k < terms; ++k) sum += " + i";
    return posted(
        post, "PROGRAM prog;\nVAR INT: i, j;\nBEGIN\ni := 1;\nj := " + sum + ";\nENDPROGRAM;\n");
  };
  for (const auto& [post, most] : {std::pair{static_cast<const Post*>(&kFour), 127},
                                   std::pair{static_cast<const Post*>(&kFive), 240}}) {
    // Each term is three characters; the longest that is taken, and one more.
    std::size_t longest = 0;
    int terms = 1;
    for (; terms < 200; ++terms) {
      const Posted p = with(*post, terms);
      if (p.errors > 0) {
        EXPECT_TRUE(has_text(p.faults, "error 5: this becomes a line of ")) << p.faults;
        EXPECT_TRUE(has_text(p.faults, "takes " + std::to_string(most))) << p.faults;
        break;
      }
      for (const std::string& l : lines_of(p.text()))
        longest = std::max(longest, l.size() - (l.ends_with('\r') ? 1 : 0));
    }
    EXPECT_LT(terms, 200);
    EXPECT_LE(longest, static_cast<std::size_t>(most));
    EXPECT_GT(longest, static_cast<std::size_t>(most) - 6);
  }
}

TEST(MelfaPost, ThePageIsRight) {
  How how;
  how.robot = true;
  page_is_right(kFive, "melfa.md", how);
}

TEST(MelfaPost, EveryConstructIsTextOrAnErrorAtItsLine) {
  How how;
  how.robot = true;
  every_construct(kFour, how, 80);
  every_construct(kFive, how, 80);
}

TEST(MelfaPost, WrongInputIsSaid) {
  wrong_input(kFive, {});
  const std::string letters(200, 'n');
  const std::string irl = "PROGRAM prog;\nVAR INT: " + letters + ", " + letters + "a;\nBEGIN\n" +
                          letters + " := 1; " + letters + "a := 2;\nENDPROGRAM;\n";
  EXPECT_TRUE(has_text(posted(kFour, irl).text(), "40 MNNNNNN2=2\r\n"));
  EXPECT_TRUE(has_text(posted(kFive, irl).text(), "4 M" + std::string(14, 'N') + "2=2\r\n"));
}

TEST(MelfaPost, TimeGrowsWithTheProgram) {
  How how;
  how.robot = true;
  how.profile.max_lines = 100'000;
  is_linear(kFive, how);
}

}  // namespace
}  // namespace robomosp::posts_test
