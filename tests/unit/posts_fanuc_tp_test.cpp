// SPDX-License-Identifier: Apache-2.0
// FANUC TP: texts that were read line by line, a reader of its own, every construct, wrong input.
#include "fanuc_tp.h"
#include "posts_support.h"

namespace robomosp::posts_test {
namespace {

const post::FanucTp kFanucTp;

std::vector<Seen> read_fanuc_tp(const std::string& ls) {
  std::vector<Seen> out;
  std::map<int, Seen> positions;
  int at = 0;
  bool in_pos = false;
  std::vector<int> used;
  for (std::string l : lines_of(ls)) {
    EXPECT_TRUE(l.ends_with('\r')) << l;
    if (l.starts_with("/POS")) in_pos = true;
    Numbers n = numbers_in(l);
    if (in_pos) {
      if (l.starts_with("P[")) at = static_cast<int>(n[0]);
      Seen& s = positions[at];
      const auto value = [&](const char* key) {
        return numbers_in(l.substr(l.find(key) + std::string(key).size()))[0];
      };
      if (has_text(l, "\tX =")) s.mm = {value("X ="), value("Y ="), value("Z =")};
      if (has_text(l, "\tW =")) s.R = matrix(rpy(value("W ="), value("P ="), value("R =")));
      for (int j = 1; j <= 6; ++j)
        if (has_text(l, "J" + std::to_string(j) + "="))
          s.joints.push_back(value(("J" + std::to_string(j) + "=").c_str()));
      continue;
    }
    const std::size_t colon = l.find(':');
    if (colon == std::string::npos) continue;
    const std::string t = l.substr(colon + 1);
    n = numbers_in(t);
    Seen s;
    if (t.starts_with("J P[") || t.starts_with("L P[")) {
      s.what = t[0] == 'J' ? "ptp" : "lin";
      s.number = static_cast<int>(n[0]);
      s.value = n[1];
    } else if (t.starts_with("C P[")) {
      s.what = "via";
      s.number = static_cast<int>(n[0]);
    } else if (t.starts_with("  P[")) {
      s.what = "circle";
      s.number = static_cast<int>(n[0]);
      s.value = out.back().value = n[1];
    } else if (t.starts_with("  DO[")) {
      s.what = "out";
      s.value = has_text(t, "=ON");
      s.number = -static_cast<int>(n[0]);
    } else if (t.starts_with("  WAIT ")) {
      s.what = "wait";
      s.value = n[0];
    } else {
      continue;
    }
    out.push_back(s);
  }
  for (Seen& s : out) {
    if (s.number <= 0) {
      s.number = -s.number;
      continue;
    }
    const Seen& p = positions.at(s.number);
    s.number = 0;
    s.mm = p.mm;
    s.R = p.R;
    s.joints = p.joints;
    if (!s.joints.empty()) s.what += " joints";
  }
  return out;
}

TEST(FanucTpPost, WhatIsReadFromTheTextIsWhatTheProgramSays) {
  for (unsigned seed = 1; seed < 6; ++seed) {
    const Straight s = straight(200, seed);
    How how;
    how.robot = true;
    how.form = kPostFlat;
    const Posted p = posted(kFanucTp, s.irl, how);
    ASSERT_EQ(p.errors, 0) << p.faults;
    same(s.seen, read_fanuc_tp(p.text()));
  }
}

/// CNT passes both; a run does only where PTP have a TIME.
TEST(FanucTpPost, WhatARunMakesOfCPassAloneIsSaidAsItIs) {
  How how;
  how.robot = true;
  const auto said = [&](const std::string& attributes) {
    return posted(kFanucTp,
                  "PROGRAM p;\nVAR POSE: a := POSE(POSITION(550.0, -300.0, 120.0), "
                  "ORIZYX(0.0, 180.0, 0.0));\nBEGIN\nMOVE PTP a C_PASS := TRUE" +
                      attributes + ";\nMOVE PTP a TIME := 1.0;\nENDPROGRAM;\n",
                  how)
        .faults;
  };
  const std::string cnt =
      "C_PASS without a distance is written as CNT100, and the simulated robot ";
  EXPECT_NE(said(" TIME := 0.5").find(cnt + "passes this target at its TIME, each joint by a "),
            std::string::npos)
      << said(" TIME := 0.5");
  EXPECT_NE(said("").find(cnt + "stops here. Give C_PTP."), std::string::npos) << said("");
}

TEST(FanucTpPost, AProgramWithStructureReadsAsItShould) {
  How how;
  how.robot = true;
  const Posted p = posted(kFanucTp, R"(PROGRAM pick;
SIGNAL
  INPUT  BOOL: part_here AT 1;
  INPUT  BOOL: tray_ok   AT 2;
  OUTPUT BOOL: gripper   AT 3;
VAR
  POSE: place := POSE(POSITION(550.0, -300.0, 120.0), ORIZYX(0.0, 180.0, 0.0));
  JOINT: home := JOINT(MAIN_JOINT(0.0, -90.0, 90.0, 0.0, 90.0, 0.0), ADD_JOINT(0.0));
  ARRAY [1..3] OF INT: a := [4, 5, 6];
  INT: good := 0; BOOL: full;
PROCEDURE wait_long (IN REAL: t);
BEGIN
  WAIT t SEC;
ENDPROC;
BEGIN
  MOVE PTP home;
  WHILE good < 5 AND NOT full
    WAIT FOR part_here TIMEOUT 2.0;
    IF R_TIMEOUT THEN HALT; ENDIF;
    MOVE LIN place SPEED := 80.0 UNTIL tray_ok;
    gripper := TRUE;
    wait_long(a[good + 1] / 4);
    good := good + 1;
  ENDWHILE;
ENDPROGRAM;
)",
                          how);
  ASSERT_EQ(p.errors, 0) << p.faults;
  std::string text = p.files.at("PROG.LS");
  std::erase(text, '\r');
  text = text.substr(text.find("/MN"));
  EXPECT_EQ(text, R"(/MN
   1:  UFRAME_NUM=0 ;
   2:  UTOOL_NUM=1 ;
   3:  F[1:R_TIMEOUT]=(OFF) ;
   4:  R[1]=4 ;
   5:  R[2]=5 ;
   6:  R[3]=6 ;
   7:  R[4:good]=0 ;
   8:  F[2:full]=(OFF) ;
   9:J P[1] 100% FINE ;
  10:  LBL[1] ;
  11:  IF (!(R[4:good]<5 AND !F[2:full])),JMP LBL[2] ;
  12:  F[1:R_TIMEOUT]=(OFF) ;
  13:  $WAITTMOUT=200 ;
  14:  WAIT DI[1]=ON TIMEOUT,LBL[3] ;
  15:  JMP LBL[4] ;
  16:  LBL[3] ;
  17:  F[1:R_TIMEOUT]=(ON) ;
  18:  LBL[4] ;
  19:  IF (F[1:R_TIMEOUT]) THEN ;
  20:  ABORT ;
  21:  ENDIF ;
  22:  UFRAME_NUM=0 ;
  23:  UTOOL_NUM=1 ;
  24:  SKIP CONDITION DI[2]=ON ;
  25:L P[2] 80mm/sec FINE Skip,LBL[5] ;
  26:  LBL[5] ;
  27:  DO[3]=ON ;
  28:  R[5]=(R[4:good]+1) ;
  29:  R[6]=(R[R[5]]/4) ;
  30:  CALL WAIT_LONG(R[6]) ;
  31:  R[4:good]=(R[4:good]+1) ;
  32:  JMP LBL[1] ;
  33:  LBL[2] ;
/POS
P[1]{
   GP1:
	UF : 0, UT : 1,	
	J1=    0.000 deg,	J2=  -90.000 deg,	J3=   90.000 deg,
	J4=    0.000 deg,	J5=   90.000 deg,	J6=    0.000 deg
};
P[2]{
   GP1:
	UF : 0, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =  550.000  mm,	Y = -300.000  mm,	Z =  120.000  mm,
	W =  180.000 deg,	P =    0.000 deg,	R =  180.000 deg
};
/END
)");
  text = p.files.at("WAIT_LONG.LS");
  std::erase(text, '\r');
  EXPECT_EQ(text.substr(text.find("/MN")), "/MN\n   1:  WAIT AR[1] ;\n/POS\n/END\n");
}

/// A register may have held joints: LPOS makes it a Cartesian one before its elements are written.
TEST(FanucTpPost, APositionRegisterIsMadeCartesianBeforeItsElements) {
  const Posted p = posted(kFanucTp, R"(PROGRAM prog;
VAR
  POSE: a := POSE(POSITION(500.0, -10.0, 300.0), ORIZYX(0.0, 180.0, 0.0));
BEGIN
  a.POS.Z := 250.0;
  MOVE LIN a SPEED := 100.0;
ENDPROGRAM;
)");
  ASSERT_EQ(p.errors, 0) << p.faults;
  const std::string text = p.text();
  const std::size_t made = text.find("]=LPOS ;");
  ASSERT_NE(made, std::string::npos) << text;
  const std::size_t pr = text.rfind("PR[", made);
  const std::string name = text.substr(pr, made - pr);
  EXPECT_GT(text.find(name + ",1]=500", made), made);
  EXPECT_NE(text.find(name + ",1]=500", made), std::string::npos) << text;
  EXPECT_NE(text.find(name + ",2]=(-10", made), std::string::npos) << text;
  EXPECT_NE(text.find(name + ",6]=", made), std::string::npos) << text;
  EXPECT_LT(made, text.find(",3]=250")) << text;
}

TEST(FanucTpPost, WhatTpHasNoWordsForGoesThroughRegistersAndFlags) {
  const Posted p = posted(kFanucTp, R"(PROGRAM prog;
TYPE RECORD BOOL: hot; INT: n; BOOL: full; ENDRECORD: CRATE;
VAR INT: i; BOOL: b; ARRAY [2..3] OF CRATE: c;
PROCEDURE say (IN BOOL: what); BEGIN b := NOT what; ENDPROC;
BEGIN
  i := -(i + 1);
  i := 2 + ABS(i - 5);
  WAIT i / 4 SEC;
  c[i].full := b EXOR i > 3;
  c[3].n := 7;
  say(c[3].hot);
  WAIT FOR ABS(i) > 3;
ENDPROGRAM;
)");
  // A condition that is looked at again has no place for lines before it.
  EXPECT_EQ(p.errors, 1) << p.faults;
  EXPECT_TRUE(has_text(p.faults, "error 12: FANUC TP has no ABS() at run time")) << p.faults;
  std::string text = p.files.at("PROG.LS");
  std::erase(text, '\r');
  const std::size_t begin = text.find("R[1:i]=(0-"), end = text.find("  WAIT (");
  ASSERT_NE(begin, std::string::npos) << text;
  std::string lines;
  std::istringstream in(text.substr(begin, end - begin));
  for (std::string l; std::getline(in, l);) lines += l.substr(l.find(':') == 4 ? 5 : 0) + "\n";
  EXPECT_TRUE(lines.starts_with(R"(R[1:i]=(0-(R[1:i]+1)) ;
  R[4]=(R[1:i]-5) ;
  IF (R[4]<0) THEN ;
  R[4]=(0-R[4]) ;
  ENDIF ;
  R[1:i]=(2+R[4]) ;
  R[5]=(R[1:i]/4) ;
  WAIT R[5] ;
  R[4]=(R[1:i]*2) ;
  R[4]=(R[4]-1) ;
  F[R[4]]=(F[1:b]<>(R[1:i]>3)) ;
  R[3]=7 ;
  IF (F[4]) THEN ;
  R[4]=1 ;
  ELSE ;
  R[4]=0 ;
  ENDIF ;
  CALL SAY(R[4]) ;
)")) << lines;
}

TEST(FanucTpPost, ThePageIsRight) {
  How how;
  how.robot = true;
  page_is_right(kFanucTp, "fanuc_tp.md", how);
}

TEST(FanucTpPost, EveryConstructIsTextOrAnErrorAtItsLine) {
  How how;
  how.robot = true;
  every_construct(kFanucTp, how, 60);
}

TEST(FanucTpPost, WrongInputIsSaid) {
  wrong_input(kFanucTp, {});
  How how;
  how.robot = true;
  how.name = std::string(200, 'n');
  const Posted p = posted(kFanucTp, "PROGRAM prog;\nBEGIN\nWAIT 1.0 SEC;\nENDPROGRAM;\n", how);
  EXPECT_TRUE(has_text(p.text(), "/PROG  " + std::string(36, 'N') + "\r\n"));
  // Joints ask for a robot's limits and for what is known of it.
  const Posted none = posted(kFanucTp, weld());
  EXPECT_TRUE(has_text(none.faults, "warning 9: the configuration of this target is unknown"));
}

TEST(FanucTpPost, TimeGrowsWithTheProgram) {
  How how;
  how.robot = true;
  how.profile.max_lines = 100'000;
  is_linear(kFanucTp, how);
}

}  // namespace
}  // namespace robomosp::posts_test
