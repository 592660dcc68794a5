// SPDX-License-Identifier: Apache-2.0
// Readers of controllers' programs: what each makes of programs of our own, line by line; that it
// compiles; what is refused and where; texts changed at random.
#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <ctime>
#include <functional>
#include <iostream>
#include <map>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "compile.h"
#include "reader.h"
#include "readers.h"
#include "support/mutator.h"
#include "support/reader_settings.h"
#include "support/seed.h"

namespace robomosp::readers {
namespace {

struct RobotFile {
  std::string name, text;
};
using Read = Made (*)(const ProgramReaderTask&, const Params&, Progress&);

std::unique_ptr<ReadProgram> read_with(Read reader, const std::vector<RobotFile>& files) {
  std::vector<SourceFile> all;
  for (const RobotFile& f : files) all.push_back({f.name, f.text, {}});
  ProgramReaderTask task;
  task.files = all;
  NoProgress progress;
  auto made = reader(task, test::ReaderSettings(), progress);
  EXPECT_TRUE(made.ok()) << (made.ok() ? "" : made.error().sentence());
  return made.ok() ? std::move(made).value() : nullptr;
}
/// Errors of the IRL that was made; "" = it compiles.
std::string errors_of_irl(const ReadProgram& p) {
  std::vector<SourceFile> files;
  for (const ReadFile& f : p.files()) files.push_back({f.name, f.text, {}});
  NoProgress progress;
  const auto made = irl::compile(files, progress);
  if (!made.ok()) return made.error().sentence();
  std::string out;
  for (const rmp_code_fault& f : made.value()->faults)
    if (f.severity == RMP_FAULT_ERROR) out += std::to_string(f.span.line) + ": " + f.message + "\n";
  return out;
}
/// "3:7 error message." for each fault that is no note.
std::string read_faults(const ReadProgram& p) {
  std::string out;
  for (const rmp_code_fault& f : p.faults())
    if (f.severity != RMP_FAULT_NOTE)
      out += std::to_string(f.span.line) + ":" + std::to_string(f.span.column) +
             (f.severity == RMP_FAULT_ERROR ? " error " : " warning ") + f.message + ".\n";
  return out;
}
/// The IRL reads like this: each line of `expected` in this order, blanks at both ends apart.
void expect_lines(const ReadProgram& p, const std::string& expected) {
  std::istringstream made{std::string(p.files()[0].text)}, wanted{expected};
  const auto trimmed = [](std::string s) {
    const std::size_t b = s.find_first_not_of(' ');
    return b == std::string::npos ? std::string() : s.substr(b, s.find_last_not_of(' ') - b + 1);
  };
  std::string line;
  for (std::string want; std::getline(wanted, want);) {
    want = trimmed(want);
    if (want.empty()) continue;
    bool found = false;
    while (!found && std::getline(made, line)) found = trimmed(line) == want;
    ASSERT_TRUE(found) << "this line is missing, or not in its place:\n"
                       << want << "\nin\n"
                       << p.files()[0].text;
  }
  EXPECT_EQ(errors_of_irl(p), "") << p.files()[0].text;
}

const std::vector<RobotFile> kKrl{{"weld.src", R"(&ACCESS RVP
DEF weld( )
;FOLD INI;%{PE}
DECL INT i
DECL E6POS p
BAS (#INITMOV,0 )
$VEL.CP=0.3
$TOOL={X 0,Y 0,Z 100,A 0,B 0,C 0}
$APO.CDIS=5
PTP {A1 0,A2 -90,A3 90,A4 0,A5 90,A6 0}
p={X 500,Y 0,Z 300,A 0,B 90,C 0,S 2,T 35}
FOR i=1 TO 3
  p.Z=p.Z+10*i
  LIN p C_DIS
  lamp=TRUE
  WAIT FOR ($IN[5]==TRUE) AND $IN[6]
  WAIT SEC 0.5
ENDFOR
CIRC {X 1,Y 2,Z 3,A 0,B 0,C 0},{X 10,Y 20,Z 30,A 0,B 0,C 0}
LIN_REL {Z 100}
SWITCH i
CASE 1,2
 grip(TRUE)
DEFAULT
 $VEL.CP=dist(3.0)/2
ENDSWITCH
LIN place
END
DEF grip(on:IN)
DECL BOOL on
IF NOT on THEN
 on = TRUE
 GOTO fin
ENDIF
$OUT[4]=on
fin:
END
DEFFCT REAL dist(x:IN)
REAL x
RETURN SQRT(x*x)
ENDFCT
)"},
                                  {"weld.dat", R"(DEFDAT weld PUBLIC
DECL FRAME place={X 1.5,Y -2,Z 3,A 30,B 20,C 10}
SIGNAL lamp $OUT[3]
ENDDAT
)"}};

TEST(ProgramReaders, KrlBecomesIrl) {
  const auto p = read_with(read_krl, kKrl);
  EXPECT_EQ(read_faults(*p), "");
  expect_lines(*p, R"(
PROGRAM weld;
SYSTEM_SPECIFICATION 'weld.ssi';
OUTPUT BOOL: lamp AT 3;
INPUT BOOL: in_5 AT 5;
POSE: place := POSE(POSITION(1.5, -2.0, 3.0), ORIZYX(30.0, 20.0, 10.0));
INT: i;
ROBTARGET: p;
POSE: present_tool := POSE(POSITION(0.0, 0.0, 100.0), ORIZYX(0.0, 0.0, 0.0));
PROCEDURE grip (IN BOOL: on_given);
on := on_given;
IF NOT on THEN
on := TRUE;
GOTO fin;
out_4 := on;
LABEL fin:
FUNCTION dist (IN REAL: x): REAL;
RETURN SQRT(x * x);
R_SPEED := 300.0;
MOVE PTP MAIN_JOINT(0.0, -90.0, 90.0, 0.0, 90.0, 0.0) TOOL := present_tool;
p := ROBTARGET(POSE(POSITION(500.0, 0.0, 300.0), ORIZYX(0.0, 90.0, 0.0)), 0, [-1, -1, 0, 0, 0, -1], ADD_JOINT(0.0));
FOR i := 1 TO 3 DO
p.PSE.POS.Z := p.PSE.POS.Z + 10 * i;
MOVE LIN p C_CP := 5.0 TOOL := present_tool;
lamp := TRUE;
WAIT FOR in_5 = TRUE AND in_6;
WAIT 0.5 SEC;
ENDFOR;
MOVE CIRCLE POSE(POSITION(1.0, 2.0, 3.0), ORIZYX(0.0, 0.0, 0.0)), POSE(POSITION(10.0, 20.0, 30.0), ORIZYX(0.0, 0.0, 0.0)) TOOL := present_tool;
MOVE_INC LIN POSE(POSITION(0.0, 0.0, 100.0), ORIZYX(0.0, 0.0, 0.0)) TOOL := present_tool;
CASE i OF
WHEN 1, 2:
grip(TRUE);
DEFAULT:
R_SPEED := dist(3.0) / 2 * 1000.0;
ENDCASE;
MOVE LIN place TOOL := present_tool;
ENDPROGRAM;
)");
  // Every line knows where it comes from.
  const std::string_view text = p->files()[0].text;
  std::uint32_t line = 1;
  for (std::size_t at = 0; at < text.find("  MOVE LIN p C_CP"); ++at) line += text[at] == '\n';
  line += 1;
  const auto row = std::find_if(p->lines().begin(), p->lines().end(), [&](const ReadLine& l) {
    return l.irl_line == line - 1 || l.irl_line == line;
  });
  ASSERT_NE(row, p->lines().end());
  EXPECT_EQ(row->line, 14U);
}

TEST(ProgramReaders, KrlSaysWhatItDoesNotRead) {
  const auto p = read_with(read_krl, {{"p.src", R"(DEF p()
PTP XHOME
LIN {Z 50}
CIRC {X 1,Y 2,Z 3},{X 4,Y 5,Z 6}, CA 90
$OUT[n]=TRUE
IF $IN[1]==TRUE AND $IN[2] THEN
ENDIF
other(1)
TRIGGER WHEN DISTANCE=0 DELAY=0 DO $OUT[1]=TRUE
ENDLOOP
LOOP
END
)"}});
  EXPECT_EQ(read_faults(*p),
            "2:5 error XHOME is not declared; its values are zero here.\n"
            "3:5 error components without a value keep their values, which IRL cannot express.\n"
            "4:1 error IRL has no angle of an arc (CA).\n"
            "5:6 error n is not declared.\n"
            "6:17 error a comparison of truth values next to AND or OR has no parentheses.\n"
            "8:1 error other is not among the files; an empty routine replaces it.\n"
            "9:1 error IRL has no counterpart of this statement.\n"
            "10:1 error no block is open here.\n"
            "12:1 error a block has no endloop above.\n");
  expect_lines(*p, R"(
{ not read: LIN (Z 50) }
)");
}

TEST(ProgramReaders, KrlInlineFormsBeginWithTheDeliveredHome) {
  const auto p = read_with(read_krl, {{"cell.src", R"(DEF cell()
PDAT_ACT=PDEFAULT
FDAT_ACT=FHOME
BAS (#FRAMES )
BAS (#PTP_PARAMS,100 )
PTP XHOME
PTP XHOME C_PTP
END
)"},
                                      {"$config.dat", R"(DEFDAT $CONFIG PUBLIC
DECL E6AXIS XHOME={A1 0,A2 -90,A3 90,A4 0,A5 0,A6 0}
ENDDAT
)"}});
  // PDEFAULT and FHOME are in no file, and the approximation of PDEFAULT is used.
  EXPECT_EQ(
      read_faults(*p),
      "7:1 error $APO.CPTP is not set before this point: here the controller's value applies.\n");
  expect_lines(*p, R"(
MAIN_JOINT: XHOME := MAIN_JOINT(0.0, -90.0, 90.0, 0.0, 0.0, 0.0);
R_SPEED_PTP := 100.0;
MOVE PTP XHOME;
MOVE PTP XHOME C_PTP := present_apo_cptp;
)");
}

const std::vector<RobotFile> kRapid{{"cell.mod", R"(%%%
  VERSION:1
  LANGUAGE:ENGLISH
%%%
MODULE Cell
  CONST robtarget p1:=[[600,0,500],[0,0,1,0],[0,-1,0,4],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST jointtarget home:=[[0,0,0,0,30,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PERS tooldata grip:=[TRUE,[[0,0,100],[1,0,0,0]],[1,[0,0,50],[1,0,0,0],0,0,0]];
  PERS wobjdata table:=[FALSE,TRUE,"",[[500,0,0],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];
  VAR speeddata slow:=[80,500,5000,1000];
  VAR num n:=0;
  VAR num list{3}:=[1,2,3];
  PROC main()
    VAR num k;
    MoveAbsJ home,v1000,fine,grip;
    FOR i FROM 1 TO 3 DO
      n:=n+list{i};
      MoveL Offs(p1,0,0,100*i),v500,z10,grip\WObj:=table;
    ENDFOR
    WHILE n<10 DO
      Incr n;
      IF n=5 Set do1;
      IF di2=1 THEN
        GOTO again;
      ELSEIF n>7 THEN TPWrite "n="\Num:=n;
      ELSE
        Reset do1;
      ENDIF
      again:
    ENDWHILE
    MoveC p1,p1,slow,z1,grip;
    Place 3;
    TEST n CASE 1,2: Stop; DEFAULT: WaitTime 0.5; ENDTEST
    WaitDI di2,1\MaxTime:=2;
    k:=Square(3);
  ENDPROC
  PROC Place(num x)
    x := x+1;
    MoveJ p1,v200,z50,tool0;
  ENDPROC
  FUNC num Square(num x)
    RETURN x*x;
  ENDFUNC
ENDMODULE
)"}};

TEST(ProgramReaders, RapidBecomesIrl) {
  const auto p = read_with(read_rapid, kRapid);
  EXPECT_EQ(read_faults(*p), "");
  expect_lines(*p, R"(
ROBTARGET: p1 := ROBTARGET(POSE(POSITION(600.0, 0.0, 500.0), ORIQUAT(0.0, 0.0, 1.0, 0.0)), 3, [0, -128, -128, -1, -128, 0], ADD_JOINT(0.0));
MAIN_JOINT: home := MAIN_JOINT(0.0, 0.0, 0.0, 0.0, 30.0, 0.0);
POSE: grip := POSE(POSITION(0.0, 0.0, 100.0), ORIQUAT(1.0, 0.0, 0.0, 0.0));
POSE: table := POSE(POSITION(500.0, 0.0, 0.0), ORIQUAT(1.0, 0.0, 0.0, 0.0));
REAL: slow := 80.0;
ARRAY [1..3] OF REAL: list_v := [1.0, 2.0, 3.0];
PROCEDURE Place (IN REAL: x_given);
x := x + 1;
MOVE PTP p1 SPEED_PTP := 20.0 C_PTP := 50.0;
MOVE PTP home SPEED_PTP := 100.0 TOOL := grip;
FOR i := 1 TO 3 DO
n := n + list_v[i];
MOVE LIN shifted_target(p1, 0.0, 0.0, 100 * i) SPEED := 500.0 C_CP := 10.0 TOOL := grip FRAME := table;
WHILE n < 10 DO
n := n + 1;
IF n = 5 THEN
do1 := TRUE;
IF di2 = TRUE THEN
GOTO again;
ELSIF n > 7 THEN
WRITELN('n=', n);
ELSE
do1 := FALSE;
LABEL again:
MOVE CIRCLE p1, p1 SPEED := slow C_CP := 1.0 TOOL := grip;
Place(3.0);
IF n = 1 OR n = 2 THEN
PAUSE;
ELSE
WAIT 0.5 SEC;
WAIT FOR di2 = TRUE TIMEOUT 2.0;
IF R_TIMEOUT THEN HALT; ENDIF;
k := Square(3.0);
)");
}

TEST(ProgramReaders, RapidProgramIsWhatItsListOfModulesNames) {
  const auto p = read_with(read_rapid, {{"cell.pgf", R"(<?xml version="1.0" encoding="ISO-8859-1" ?>
<Program>
  <Module>MainModule.mod</Module>
</Program>
)"},
                                        {"MainModule.mod", R"(MODULE MainModule
  PROC main()
    MoveL p1,v100,fine,cup;
  ENDPROC
ENDMODULE
)"},
                                        {"CalibData.mod", R"(MODULE CalibData
  PERS tooldata cup:=[TRUE,[[0,0,80],[1,0,0,0]],[1,[0,0,50],[1,0,0,0],0,0,0]];
  CONST robtarget p1:=[[600,0,500],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
ENDMODULE
)"}});
  EXPECT_EQ(read_faults(*p), "");
  expect_lines(*p, R"(
PROGRAM cell;
POSE: cup := POSE(POSITION(0.0, 0.0, 80.0), ORIQUAT(1.0, 0.0, 0.0, 0.0));
MOVE LIN p1 SPEED := 100.0 TOOL := cup;
)");
}

const std::vector<RobotFile> kUrscript{{"prog.script", R"(def prog():
  n = 0
  home = [0, 1.5, 0, 0, 0, 0]
  def grip(on):
    set_standard_digital_out(3, on)
    sleep(0.3)
  end
  def lift(p0, h):
    return pose_trans(p0, p[0,0,-h,0,0,0])
  end
  thread blink():
    while True:
      set_digital_out(1, not get_standard_digital_out(1))
      sync()
    end
  end
  set_tcp(p[0,0,0.1,0,0,0])
  run blink()
  movej(home, v=1.5707963267948966)
  place = p[0.4,-0.2,0.3,0,0,1.5707963267948966]
  while n < 5:
    movel(lift(place, 0.1), v=0.25, r=0.01)
    place[2] = place[2] + 0.05*n
    if get_standard_digital_in(2) == False and n > 2:
      n = n + 0.5
    elif n == 1:
      continue
    else:
      grip(True)
      break
    end
  end
  movec(p[0.1,0,0,0,0,0], p[0.2,0,0,0,0,0], v=0.25)
end
)"}};

TEST(ProgramReaders, UrscriptFromThePendantAndSignalsOfComputedNumbers) {
  const auto p = read_with(read_urscript, {{"saved.script", R"(def saved():
  def light(lamp):
    if get_standard_digital_in(lamp):
      set_tool_digital_out(lamp, True)
    end
  end
  $ 1 "Robot {Program}"
  $ 2 "Wait: 0.5"
  sleep(0.5)
  enter_critical
  light(1)
  exit_critical
  $ 3 "If"
  if get_standard_analog_out(0) > 0.5:
    $ 4 "Stop"
    halt
  end
end
)"}});
  EXPECT_EQ(read_faults(*p), "");
  expect_lines(*p, R"(
PROCEDURE light (IN INT: lamp);
IF get_standard_digital_in(lamp) THEN
CASE lamp OF
WHEN 0: out_16 := TRUE;
WHEN 1: out_17 := TRUE;
ENDCASE;
FUNCTION get_standard_digital_in (IN INT: n): BOOL;
CASE n OF
WHEN 0: RETURN in_0;
WHEN 7: RETURN in_7;
RETURN FALSE;
{ Robot (Program) }
{ Wait: 0.5 }
WAIT 0.5 SEC;
{ enter_critical }
light(1);
{ If }
IF analog_out_0 > 0.5 THEN
{ Stop }
HALT;
)");
}

TEST(ProgramReaders, UrscriptBecomesIrl) {
  const auto p = read_with(read_urscript, kUrscript);
  EXPECT_EQ(read_faults(*p), "");
  expect_lines(*p, R"(
REAL: n;
MAIN_JOINT: home;
PROCEDURE grip (IN BOOL: on);
out_3 := on;
WAIT 0.3 SEC;
FUNCTION lift (IN POSE: p0; IN REAL: h): POSE;
RETURN p0 @ POSE(POSITION(0.0, 0.0, -h * 1000.0), ORIQUAT(1.0, 0.0, 0.0, 0.0));
PROCESS blink;
WHILE TRUE DO
out_1 := NOT out_1;
ENDPROCESS;
n := 0.0;
home := MAIN_JOINT(0.0, 85.9436692696, 0.0, 0.0, 0.0, 0.0);
START blink;
MOVE PTP home SPEED_PTP := 50.0 TOOL := present_tool;
place := POSE(POSITION(400.0, -200.0, 300.0), ORIQUAT(0.7071067811865476, 0.0, 0.0, 0.7071067811865475));
WHILE n < 5 DO
MOVE LIN lift(place, 0.1) SPEED := 250.0 C_CP := 10.0 TOOL := present_tool;
place.POS.Z := (place.POS.Z / 1000.0 + 0.05 * n) * 1000.0;
IF in_2 = FALSE AND n > 2 THEN
n := n + 0.5;
ELSIF n = 1 THEN
GOTO again;
grip(TRUE);
EXIT;
LABEL again:
ENDWHILE;
MOVE CIRCLE POSE(POSITION(100.0, 0.0, 0.0), ORIQUAT(1.0, 0.0, 0.0, 0.0)), POSE(POSITION(200.0, 0.0, 0.0), ORIQUAT(1.0, 0.0, 0.0, 0.0)) SPEED := 250.0 TOOL := present_tool;
)");
}

const std::vector<RobotFile> kTp{{"pick.ls", R"(/PROG  PICK
/ATTR
OWNER = MNEDITOR;
/MN
   1:  !pick a part ;
   2:  UFRAME[1]=PR[2] ;
   3:  UFRAME_NUM=1 ;
   4:J P[1] 50% FINE    ;
   5:  LBL[1:again] ;
   6:L P[2:above] 250mm/sec CNT50 Offset,PR[1] ;
   7:C P[1]
    :  P[2] 100mm/sec FINE ;
   8:  DO[1]=ON ;
   9:  WAIT DI[3]=ON TIMEOUT,LBL[9] ;
  10:  WAIT   .50(sec) ;
  11:  R[1:count]=R[1]+1 ;
  12:  IF R[1]>3,JMP LBL[9] ;
  13:  SELECT R[1]=1,JMP LBL[1] ;
    :  =2,CALL GRIP(1,R[2]) ;
    :  ELSE,JMP LBL[9] ;
  14:  FOR R[2]=1 TO 4 ;
  15:  PR[1,3]=R[2]*10 ;
  16:  ENDFOR ;
  17:  IF (DI[1] AND !DI[2]) THEN ;
  18:  PAUSE ;
  19:  ELSE ;
  20:  MESSAGE[No part] ;
  21:  ENDIF ;
  22:  SKIP CONDITION DI[4]=ON ;
  23:L P[2] 100mm/sec FINE Skip,LBL[9] ;
  24:  LBL[9] ;
/POS
P[1]{
   GP1:
	UF : 1, UT : 2,	CONFIG : 'F U B, 0, 0, -1',
	X =   600.000  mm,	Y =      .000  mm,	Z =   400.000  mm,
	W =   180.000 deg,	P =      -10.000 deg,	R =      30.000 deg
};
P[2:"above"]{
   GP1:
	UF : 1, UT : 2,
	J1=     0.000 deg,	J2=     0.000 deg,	J3=   -20.000 deg,
	J4=     0.000 deg,	J5=   -70.000 deg,	J6=     0.000 deg
};
/END
)"},
                                 {"grip.ls", R"(/PROG GRIP
/MN
   1:  IF AR[1]=1,DO[2]=(ON) ;
   2:  R[5]=AR[2] ;
/POS
/END
)"}};

TEST(ProgramReaders, TpBecomesIrl) {
  const auto p = read_with(read_tp, kTp);
  // One element of PR[1] is set, and R[1] goes on from what the controller has.
  EXPECT_EQ(
      read_faults(*p),
      "6:18 error PR[2] is set on the controller; it is zero here.\n"
      "8:6 error UTOOL[2] is set on the controller; it is zero here.\n"
      "10:6 error this straight motion to joint values uses the robot's present tool, not UTOOL.\n"
      "10:42 error PR[1] is set on the controller; it is zero here.\n"
      "11:6 error this straight motion to joint values uses the robot's present tool, not UTOOL.\n"
      "16:8 warning R[1] is not set by any program here; it is zero.\n"
      "30:6 error this straight motion to joint values uses the robot's present tool, not "
      "UTOOL.\n");
  expect_lines(*p, R"(
ROBTARGET: P_1 := ROBTARGET(POSE(POSITION(600.0, 0.0, 400.0), ORIZYX(30.0, -10.0, 180.0)), 5, [0, 0, 0, 0, 0, -1], ADD_JOINT(0.0));
MAIN_JOINT: P_2_above := MAIN_JOINT(0.0, 0.0, -20.0, 0.0, -70.0, 0.0);
PROCEDURE GRIP (IN REAL: AR_1; IN REAL: AR_2);
IF AR_1 = 1 THEN
out_2 := TRUE;
R[5] := AR_2;
{ pick a part  }
UFRAME[1] := PR[2];
MOVE PTP P_1 SPEED_PTP := 50.0 TOOL := UTOOL[2] FRAME := UFRAME[1];
LABEL lbl_1:
MOVE LIN with_pose(TRAFO(JOINT(P_2_above, ADD_JOINT(0.0))), PR[1] @ TRAFO(JOINT(P_2_above, ADD_JOINT(0.0))).PSE) SPEED := 250.0 C_SPEED := 50.0;
out_1 := TRUE;
WAIT FOR in_3 = TRUE TIMEOUT 30.0;
IF R_TIMEOUT THEN GOTO lbl_9; ENDIF;
WAIT 0.5 SEC;
R[1] := R[1] + 1;
IF R[1] > 3 THEN
GOTO lbl_9;
IF R[1] = 1 THEN
GOTO lbl_1;
ELSIF R[1] = 2 THEN
GRIP(1.0, R[2]);
ELSE
GOTO lbl_9;
R[2] := 1.0;
WHILE R[2] <= 4 DO
PR[1].POS.Z := R[2] * 10;
R[2] := R[2] + 1;
ENDWHILE;
IF in_1 AND NOT in_2 THEN
PAUSE;
WRITELN('No part');
MOVE LIN TRAFO(JOINT(P_2_above, ADD_JOINT(0.0))) SPEED := 100.0 UNTIL in_4 = TRUE;
IF NOT (in_4 = TRUE) THEN GOTO lbl_9; ENDIF;
LABEL lbl_9:
)");
}

TEST(ProgramReaders, TpGroupsBehindTheFirstAreAdditionalAxes) {
  const auto listing = [](const std::string& groups) {
    return "/PROG GUN\n/ATTR\nDEFAULT_GROUP\t= " + groups + R"(;
/MN
   1:J P[1] 50% FINE ;
   2:L P[2] 200mm/sec FINE ;
/POS
P[1]{
   GP1:
	UF : 0, UT : 1,
	J1=     1.000 deg,	J2=     2.000 deg,	J3=     3.000 deg,
	J4=     4.000 deg,	J5=     5.000 deg,	J6=     6.000 deg
   GP3:
	UF : 0, UT : 1,
	J1=    40.000  mm
};
P[2]{
   GP1:
	UF : 0, UT : 1,	CONFIG : 'F U T, 0, 0, 0',
	X =   500.000  mm,	Y =    10.000  mm,	Z =   600.000  mm,
	W =     0.000 deg,	P =     0.000 deg,	R =    90.000 deg
   GP2:
	UF : 0, UT : 1,
	J1=    -7.500  mm
   GP3:
	UF : 0, UT : 1,
	J1=     0.000  mm
};
/END
)";
  };
  const auto p = read_with(read_tp, {{"gun.ls", listing("1,*,1,*,*")}});
  const std::string unknown = "6:6 error UTOOL[1] is set on the controller; it is zero here.\n";
  EXPECT_EQ(read_faults(*p), unknown);
  expect_lines(*p, R"(
JOINT: P_1 := JOINT(MAIN_JOINT(1.0, 2.0, 3.0, 4.0, 5.0, 6.0), ADD_JOINT(40.0));
ROBTARGET: P_2 := ROBTARGET(POSE(POSITION(500.0, 10.0, 600.0), ORIZYX(90.0, 0.0, 0.0)), 4, [0, 0, 0, 0, 0, 0], ADD_JOINT(0.0));
)");
  // The groups that the program does not move are not read.
  const auto alone = read_with(read_tp, {{"gun.ls", listing("1,*,*,*,*")}});
  EXPECT_EQ(read_faults(*alone), unknown);
  expect_lines(*alone, "MAIN_JOINT: P_1 := MAIN_JOINT(1.0, 2.0, 3.0, 4.0, 5.0, 6.0);");
  // A second robot's place, and what is of another group alone, is no axis.
  const auto second = read_with(read_tp, {{"two.ls", R"(/PROG TWO
/ATTR
DEFAULT_GROUP = 1,1,*,*,*;
/MN
   1:J P[1] 50% FINE ;
   2:J PR[4] 50% FINE ;
/POS
P[1]{
   GP1:
	UF : 0, UT : 1,	CONFIG : 'N U T, 0, 0, 0',
	X = 1.0 mm, Y = 2.0 mm, Z = 3.0 mm, W = 0.0 deg, P = 0.0 deg, R = 0.0 deg
   GP2:
	UF : 0, UT : 1,	CONFIG : 'F U T, 0, 0, 0',
	X = 9.0 mm, Y = 9.0 mm, Z = 9.0 mm, W = 0.0 deg, P = 0.0 deg, R = 0.0 deg
};
P[2]{
   GP2:
	UF : 0, UT : 1,
	J1= 9.0 mm
};
/END
)"}});
  EXPECT_EQ(
      read_faults(*second),
      "5:6 error UTOOL[1] is set on the controller; it is zero here.\n"
      "6:6 error the joints of further groups in position registers are not read; they keep their "
      "positions.\n"
      "6:8 error PR[4] is set on the controller; it is zero here.\n"
      "8:1 error another group of this position has a Cartesian position, which is not read.\n"
      "16:1 error this position belongs to a group other than the first, and only the first is "
      "read.\n");
  expect_lines(
      *second,
      "ROBTARGET: P_1 := ROBTARGET(POSE(POSITION(1.0, 2.0, 3.0), ORIZYX(0.0, 0.0, 0.0)), 0, "
      "[0, 0, 0, 0, 0, 0], ADD_JOINT(0.0));");
}

TEST(ProgramReaders, TpJumpsTimersAlarmsAndWhatIsDoneAtAPoint) {
  const auto p = read_with(read_tp, {{"spot.ls", R"(/PROG SPOT
/MN
   1:  TIMER[4]=RESET ;
   2:  !TIMER[4]=START in words ;
   3:  PR[GP1:5,3]=(12) ;
   4:  JMP LBL[R[2]] ;
   5:  LBL[1:first] ;
   6:J PR[5] 50% CNT100 TB    .10sec,P-SPS    ;
      1:  LBL[1] ;
      2:  IF (DI[1]),JMP LBL[1] ;
       ------ ;
   7:L PR[5] 100mm/sec FINE TB   0.00sec,P-SPS Offset,PR[6]   ;
      1:  LBL[1] ;
      2:  DO[3]=ON ;
       ------ ;
   8:L PR[5] 100mm/sec FINE DB    5.0mm,DO[4]=OFF ;
   9:L PR[5] 100mm/sec FINE TA    .20sec,DO[4]=ON ;
  10:  IF (DI[2]),JMP LBL[1] ;
  11:  UALM[7] ;
  12:  LBL[12] ;
  13:  LBL[12] ;
/POS
/END
)"}});
  EXPECT_EQ(read_faults(*p),
            "3:8 warning IRL has no counterpart of TIMER.\n"
            "5:8 error PR[5] is set on the controller; it is zero here.\n"
            "6:16 warning R[2] is not set by any program here; it is zero.\n"
            "8:6 error which UFRAME is active here is set on the controller; none is taken.\n"
            "8:25 warning an action set a time before the point is executed at the point.\n"
            "12:55 error PR[6] is set on the controller; it is zero here.\n"
            "16:29 warning an action set a distance before the point is executed at the point.\n"
            "17:29 error an action after a point during the next motion has no counterpart in IRL; "
            "it is left out.\n"
            "19:8 warning a user alarm becomes a line of text and PAUSE; its text and its other "
            "effects are set on the controller.\n"
            "21:8 error this label already exists.\n");
  expect_lines(*p, R"(
PR[5].POS.Z := 12.0;
IF ROUND(R[2]) = 1 THEN GOTO lbl_1; ENDIF;
IF ROUND(R[2]) = 12 THEN GOTO lbl_12; ENDIF;
HALT;
LABEL lbl_1:
MOVE PTP PR[5] SPEED_PTP := 50.0 C_PTP := 100.0;
LABEL lbl_p1_1:
IF in_1 THEN
GOTO lbl_p1_1;
MOVE LIN PR[6] @ PR[5] SPEED := 100.0;
LABEL lbl_p2_1:
out_3 := TRUE;
MOVE LIN PR[5] SPEED := 100.0;
out_4 := FALSE;
MOVE LIN PR[5] SPEED := 100.0;
IF in_2 THEN
GOTO lbl_1;
WRITELN('UALM[7]');
PAUSE;
LABEL lbl_12:
)");
  // Programs that are called as registers are, and are not.
  const auto named = read_with(read_tp, {{"shift.ls", R"(/PROG SHIFT
/MN
   1:  CALL PR(7,R[1]) ;
   2:  R[1]=5 ;
   3:L PR[7] 100mm/sec FINE ;
   4:  CALL R ;
/POS
/END
)"},
                                         {"pr.ls", R"(/PROG PR
/MN
   1:  PR[7,1]=AR[2] ;
   2:  R[2]=AR[1] ;
/POS
/END
)"}});
  expect_lines(*named, R"(
PROCEDURE PR (IN REAL: AR_1; IN REAL: AR_2);
PR_register[7].POS.X := AR_2;
R_register_v[2] := AR_1;
PR(7.0, R_register_v[1]);
MOVE LIN PR_register[7] SPEED := 100.0;
)");
  // A timer that somebody looks at is missed.
  const auto looked = read_with(read_tp, {{"cycle.ls", R"(/PROG CYCLE
/MN
   1:  TIMER[1]=START ;
   2:  IF TIMER[1]>5,JMP LBL[1] ;
   3:  LBL[1] ;
/POS
/END
)"}});
  EXPECT_EQ(read_faults(*looked),
            "3:8 error IRL has no counterpart of TIMER.\n"
            "4:11 error IRL has no counterpart of TIMER.\n");
}

const std::vector<RobotFile> kMelfa{{"pal.prg", R"(1 Ovrd 50
2 Spd 200
3 Def Plt 1,P1,P2,P3, ,3,2,1
4 M1=0
5 *Next
6 Mov P10,-50
7 Mvs P10
8 HClose 1
9 Dly 0.5
10 P11=Plt 1,M1+1
11 P11.Z=P11.Z+10
12 Mov P11*P20
13 GoSub *Release
14 M1=M1+1
15 If M1<6 Then *Next
16 Select M1
17 Case 6
18 Wait M_In(3)=1
19 Break
20 Default
21 Hlt
22 End Select
23 Mvr P1,P2,P3
24 End
25 *Release
26 If M_In(2)=0 Then Return
27 M_Out(10)=1
28 Return
P1=(+250.00,+20.00,+180.00,-180.00,+0.00,+90.00)(7,0)
P2=(+300.00,+20.00,+180.00,-180.00,+0.00,+90.00)(7,0)
P3=(+250.00,+80.00,+180.00,-180.00,+0.00,+90.00)(7,0)
P10=(+280.00,-300.00,+180.00,+180.00,+0.00,+90.00)(2,1048575)
P11=(+0.00,+0.00,+0.00,+0.00,+0.00,+0.00)(7,0)
P20=(+0.00,+0.00,-50.00,+0.00,+0.00,+0.00)(0,0)
)"}};

TEST(ProgramReaders, MelfaBecomesIrl) {
  const auto p = read_with(read_melfa, kMelfa);
  EXPECT_EQ(read_faults(*p), "");
  expect_lines(*p, R"(
OUTPUT BOOL: hand_1 AT 900;
ROBTARGET: P1 := ROBTARGET(POSE(POSITION(250.0, 20.0, 180.0), ORIZYX(90.0, 0.0, -180.0)), 0, [0, 0, 0, 0, 0, 0], ADD_JOINT(0.0));
ROBTARGET: P10 := ROBTARGET(POSE(POSITION(280.0, -300.0, 180.0), ORIZYX(90.0, 0.0, 180.0)), 5, [-1, -1, -1, -1, -1, 0], ADD_JOINT(0.0));
i := (number - 1) MOD pallet_1_columns;
PROCEDURE release_v ();
IF in_2 = FALSE THEN
RETURN;
out_10 := TRUE;
pallet_1_start := P1.PSE;
M1 := 0.0;
LABEL next:
MOVE PTP with_pose(P10, P10.PSE @ POSE(POSITION(0.0, 0.0, -50.0), ORIQUAT(1.0, 0.0, 0.0, 0.0))) SPEED_PTP := 50.0;
MOVE LIN P10 SPEED := 100.0;
hand_1 := TRUE;
WAIT 0.5 SEC;
P11.PSE := pallet_1_place(ROUND(M1 + 1));
P11.PSE.POS.Z := P11.PSE.POS.Z + 10;
MOVE PTP with_pose(P11, P11.PSE @ P20.PSE) SPEED_PTP := 50.0;
release_v();
M1 := M1 + 1;
IF M1 < 6 THEN
GOTO next;
IF M1 = 6 THEN
WAIT FOR in_3 = TRUE;
ELSE
PAUSE;
ENDIF;
MOVE LIN P1 SPEED := 100.0;
MOVE CIRCLE P2, P3 SPEED := 100.0;
RETURN;
)");
}

TEST(ProgramReaders, TpTakesRegistersAndFramesOfABackup) {
  const auto p = read_with(
      read_tp,
      {{"home.ls", R"(/PROG HOME
/MN
   1:  UTOOL_NUM=2 ;
   2:  UFRAME_NUM=1 ;
   3:L PR[2:park] R[3]mm/sec FINE ;
   4:L PR[1] 100mm/sec FINE ;
/POS
/END
)"},
       {"POSREG.VA", R"([*POSREG*]$POSREG  Storage: SHADOW  Access: RW  : ARRAY[2,9] OF Position Reg
    [1,1] =   'joints'   Group: 1
  J1 =     1.000 deg   J2 =     2.000 deg   J3 =     3.000 deg
  J4 =     4.000 deg   J5 =     5.000 deg   J6 =     6.000 deg
    [1,2] =   'park: here'
  Group: 1   Config: N U T, 0, 0, 0
  X:   500.500   Y:   -20.000   Z:     .250
  W:   180.000   P:     0.000   R:    90.000
    [1,3] =   '' Uninitialized
    [2,1] =   ''
  Group: 2   Config: N U T, 0, 0, 0
  X:     9.000   Y:     9.000   Z:     9.000
  W:     9.000   P:     9.000   R:     9.000
)"},
       {"numreg.va", R"([*NUMREG*]$NUMREG  Storage: SHADOW  Access: RW  : ARRAY[200] OF Numeric Reg
  [1] = 7  'count'
  [2] = -1.5  ''
  [3] = 250  'speed'
)"},
       {"sysframe.va", R"([*SYSTEM*]$MNUFRAME  Storage: SHADOW  Access: RW  : ARRAY[2,9] OF POSITION
    [1,1] =
  Group: 1   Config: N D B, 0, 0, 0
  X:   884.000   Y:     0.000   Z:     0.000
  W:     0.000   P:     0.000   R:     0.000
[*SYSTEM*]$MNUFRAMENUM  Storage: SHADOW  Access: RW  : ARRAY[2] OF BYTE
  [1] = 0
)"}});
  EXPECT_EQ(read_faults(*p),
            "5:6 error UTOOL[2] is set on the controller; it is zero here.\n"
            "6:8 error PR[1] is set on the controller; it is zero here.\n");
  expect_lines(*p, R"(
ARRAY [1..2] OF POSE: PR := [POSE(POSITION(0.0, 0.0, 0.0), ORIQUAT(1.0, 0.0, 0.0, 0.0)), POSE(POSITION(500.5, -20.0, 0.25), ORIZYX(90.0, 0.0, 180.0))];
ARRAY [1..3] OF REAL: R := [7.0, -1.5, 250.0];
ARRAY [1..1] OF POSE: UFRAME := [POSE(POSITION(884.0, 0.0, 0.0), ORIZYX(0.0, 0.0, 0.0))];
MOVE LIN PR[2] SPEED := R[3] TOOL := UTOOL[2] FRAME := UFRAME[1];
)");
}

TEST(ProgramReaders, WhatIsTaughtElsewhereIsZeroAndSaid) {
  const auto melfa = read_with(read_melfa, {{"pick.mb5", R"(Mov P1
P2=P1
P2.Z=P2.Z+10
Mvs P2
Mvs P3
GoSub *Down
End
*Down
P3=P2
Return
)"}});
  EXPECT_EQ(read_faults(*melfa), "1:5 error P1 has no value in the program; it is zero here.\n");
  const auto tp = read_with(read_tp, {{"pick.ls", R"(/PROG PICK
/MN
   1:J PR[4:home] 50% FINE ;
   2:L PR[4:home] 100mm/sec FINE ;
   3:  PR[5,2:place]=R[3:width] ;
   4:L PR[5:place] R[6]mm/sec FINE Offset,PR[6] ;
   5:  CALL SETUP ;
/POS
/END
)"},
                                      {"setup.ls", R"(/PROG SETUP
/MN
   1:  PR[6]=PR[5] ;
   2:  R[6]=200 ;
/POS
/END
)"}});
  EXPECT_EQ(read_faults(*tp),
            "3:6 error which UFRAME is active here is set on the controller; none is taken.\n"
            "3:8 error PR[4] is set on the controller; it is zero here.\n"
            "5:8 error PR[5] is set on the controller; it is zero here.\n"
            "5:22 warning R[3] is not set by any program here; it is zero.\n");
}

const std::vector<RobotFile> kGcode{{"part.ngc", R"(%
(part one)
G21 G90 G17
N10 G0 X0 Y0 Z5
G1 X10 Y0 F600
G2 X20 Y10 I10 J0
G3 X20 Y10 I0 J-5
G91 G1 X-5
G90 G20 G1 X1
G4 P0.5
M64 P3
M66 P2 L3 Q4
G81 X1
M2
)"}};

TEST(ProgramReaders, GcodeBecomesIrl) {
  const auto p = read_with(read_gcode, kGcode);
  EXPECT_EQ(read_faults(*p), "13:1 error G81 is not read.\n");
  expect_lines(*p, R"(
{ part one }
MOVE PTP POSITION(0.0, 0.0, 5.0);
MOVE LIN POSITION(10.0, 0.0, 5.0) SPEED := 10.0;
MOVE CIRCLE POSITION(12.9289321881, 7.07106781187, 5.0), POSITION(20.0, 10.0, 5.0) SPEED := 10.0;
MOVE CIRCLE POSITION(15.0, 5.0, 5.0), POSITION(20.0, 0.0, 5.0) SPEED := 10.0;
MOVE CIRCLE POSITION(25.0, 5.0, 5.0), POSITION(20.0, 10.0, 5.0) SPEED := 10.0;
MOVE LIN POSITION(15.0, 10.0, 5.0) SPEED := 10.0;
MOVE LIN POSITION(25.4, 10.0, 5.0) SPEED := 10.0;
WAIT 0.5 SEC;
out_3 := TRUE;
WAIT FOR in_2 = TRUE TIMEOUT 4.0;
{ not read: G81 X1 }
RETURN;
)");
}

const std::vector<RobotFile> kVal3Files{
    {"app.pjx", R"(<?xml version="1.0" encoding="utf-8"?>
<Project><Programs><Program file="start.pgx"/><Program file="grip.pgx"/></Programs>
<Database><Data file="app.dtx"/></Database></Project>
)"},
    {"app.dtx", R"(<?xml version="1.0"?>
<Database xmlns:xsi="x"><Datas>
<Data name="bGrip" xsi:type="array" type="dio" size="1"><Value key="0" link="sysIO\out3"/></Data>
<Data name="bPart" xsi:type="array" type="dio" size="1"><Value key="0" link="sysIO\in3"/></Data>
<Data name="fTable" type="frame" size="1"><Value key="0" x="500" rz="90" fatherId="world[0]"/></Data>
<Data name="jHome" type="jointRx" size="1"><Value key="0" j1="0" j2="10" j3="90" j5="80"/></Data>
<Data name="mFast" type="mdesc"><Value key="0" accel="50" vel="80" tmax="500" blend="cartesian" leave="20"/></Data>
<Data name="nCount" type="num" size="1"/>
<Data name="pPick" type="pointRx" size="2"><Value key="0" x="1" rx="10" ry="20" rz="30" shoulder="righty" elbow="epositive" wrist="wnegative" fatherId="fTable[0]"/></Data>
<Data name="tGrip" type="tool" size="1"><Value key="0" z="120" fatherId="flange[0]"/></Data>
</Datas></Database>
)"},
    {"start.pgx",
     R"(<Programs><Program name="start"><Locals><Local name="l_nI" type="num"/></Locals>
<Code><![CDATA[begin
  // pick
  movej(jHome,tGrip,mFast)
  for l_nI=0 to 1
    movel(appro(pPick[l_nI],{0,0,-50,0,0,0}),tGrip,mFast)
    call grip(true, nCount)
    delay(0.5)
  endFor
  if nCount>3 and bPart==true
    putln("full")
  elseIf !bPart
    wait(bPart)
  else
    jHome.j1=10
  endIf
end]]></Code></Program></Programs>
)"},
    {"grip.pgx", R"(<Programs><Program name="grip"><Parameters>
<Parameter name="x_bShut" type="bool" use="value"/><Parameter name="x_n" type="num" use="reference"/>
</Parameters><Code><![CDATA[begin
  bGrip=x_bShut
  x_n=x_n+1
end]]></Code></Program></Programs>
)"}};

TEST(ProgramReaders, Val3BecomesIrl) {
  EXPECT_EQ(val3_needs({kVal3Files[0].name, kVal3Files[0].text, {}}),
            (std::vector<std::string>{"start.pgx", "grip.pgx", "app.dtx"}));
  const auto p = read_with(read_val3, kVal3Files);
  EXPECT_EQ(read_faults(*p), "");
  expect_lines(*p, R"(
INPUT BOOL: bPart AT 1;
OUTPUT BOOL: bGrip AT 2;
POSE: fTable := POSE(POSITION(500.0, 0.0, 0.0), ORIXYZ(0.0, 0.0, 90.0));
MAIN_JOINT: jHome := MAIN_JOINT(0.0, 10.0, 90.0, 0.0, 80.0, 0.0);
PROCEDURE grip (IN BOOL: x_bShut; INOUT REAL: x_n);
bGrip := x_bShut;
x_n := x_n + 1;
{ pick }
MOVE PTP jHome SPEED_PTP := 80.0 ACC_PTP := 50.0 C_PTP := 20.0 TOOL := tGrip;
l_nI := 0.0;
WHILE l_nI <= 1 DO
MOVE LIN with_pose(pPick[ROUND(l_nI)], pPick[ROUND(l_nI)].PSE @ POSE(POSITION(0.0, 0.0, -50.0), ORIXYZ(0.0, 0.0, 0.0))) SPEED := 500.0 ACC := 50.0 C_CP := 20.0 TOOL := tGrip FRAME := fTable;
grip(TRUE, nCount);
WAIT 0.5 SEC;
l_nI := l_nI + 1;
ENDWHILE;
IF nCount > 3 AND bPart = TRUE THEN
WRITELN('full');
ELSIF NOT bPart THEN
WAIT FOR bPart;
ELSE
jHome.A1 := 10.0;
ENDIF;
)");
}

/// sel() of a number rounded up below zero and down from it on is TRUNC; another sel() is not, and
/// roundUp() and roundDown() alone go to their own sides.
TEST(ProgramReaders, Val3RoundsUpDownAndTowardsZero) {
  std::vector<RobotFile> files = kVal3Files;
  std::string text = files[2].text;
  const std::string head = "<![CDATA[begin\n";
  ASSERT_NE(text.find(head), std::string::npos);
  text.insert(text.find(head) + head.size(),
              "nCount = sel(nCount / (2 + 1) < 0, roundUp(nCount / (2 + 1)), "
              "roundDown(nCount / (2 + 1)))\n"
              "nCount = roundUp(nCount - 1)\nnCount = roundDown(nCount)\n");
  files[2].text = text;
  const auto p = read_with(read_val3, files);
  EXPECT_EQ(read_faults(*p), "");
  expect_lines(*p, R"(
nCount := TRUNC(nCount / (2 + 1));
nCount := -floor(-(nCount - 1));
nCount := floor(nCount);
)");
  text.replace(text.find("roundUp(nCount / (2"), 19, "roundUp(nCount / (3");
  files[2].text = text;
  EXPECT_NE(read_faults(*read_with(read_val3, files)).find("no counterpart of sel"),
            std::string::npos);
}

const std::vector<RobotFile> kAsCell{{"cell.as", R"(.AUXDATA
N_OX33 "grip.open"
.END
.PROGRAM cell()@25/11/13 12:08 #4; palletising
  ; switches of the controller
  CP ON
  PREFETCH.SIGINS OFF
  grip = 33
  part.in[2] = 1034
  CALL set.tool(1)
  SPEED 60 ALWAYS
  ACCURACY 10 ALWAYS
  JMOVE #safe
  FOR .i = 1 TO 2
    POINT .at = pallet[.i, 1] + TRANS(0, 0, -50)
    LMOVE .at
    SPEED 50 MM/S
    LMOVE pallet[.i, 1]
    BREAK
    SIGNAL grip, -34
    TWAIT(0.5)
    LDEPART 80
  END
10 LAPPRO drop, 30
  SPEED 200 MM/S, 90 DEG/S
  ACCEL 50
  DECEL 50
  C1MOVE drop
  C2MOVE drop + TRANS(10)
  SWAIT part.in[2], -1005
  IF SIG(1002) AND NOT SIG(-1003) GOTO 10
  LMOVE SHIFT(HERE BY 0, 0, 60)
  XMOVE/LVL drop TILL -1002
  TIMER 2 = 0
  WAIT SIG(1004) OR TIMER(2) >= 2.5
  late = TIMER(2) >= 2.5
  CASE INT(count) OF
  VALUE 1, 2:
    BITS 10, 4 = count
  ANY :
    PRINT "none: ", count
  END
  DO
    count = count + 1
  UNTIL count > 3
  HOME
  WEIGHT 20, 0, 0, 100
  RETURN
.END
.PROGRAM set.tool(.n)
  TOOL grippers[.n]
.END
.PROGRAM idle.pc()
  MC ZPOWER ON
.END
.TRANS
pallet[1,1] 500.5, -20 , 100 0 180 0
pallet[2,1] 600 -20 100 10 170 20
drop 0 600 50 0 180 0
grippers[1] 0 0 120 0 0 0
not.used 1 2 3 4 5 6
.END
.JOINTS
#safe 0 0 -90 0 -90 0
.END
.REALS
count = 0
.END
)"}};

TEST(ProgramReaders, AsBecomesIrl) {
  const auto p = read_with(read_as, kAsCell);
  EXPECT_EQ(read_faults(*p),
            "46:3 error HOME is specific to the controller and is not read.\n"
            "47:3 warning WEIGHT neither moves a robot nor switches a signal; it was left out.\n");
  expect_lines(*p, R"(
PROGRAM cell;
MAIN_JOINT: safe := MAIN_JOINT(0.0, 0.0, -90.0, 0.0, -90.0, 0.0);
PROCEDURE set_tool (IN REAL: n);
present_tool := grippers[ROUND(n)];
pallet[1, 1] := POSE(POSITION(500.5, -20.0, 100.0), ORIZYZ2(0.0, 180.0, 0.0));
{ switches of the controller }
grip := 33.0;
set_tool(1.0);
MOVE PTP safe SPEED_PTP := 60.0 C_PTP := 10.0 TOOL := present_tool;
i := 1.0;
WHILE i <= 2 DO
at_v := pallet[ROUND(i), 1] @ POSE(POSITION(0.0, 0.0, -50.0), ORIZYZ2(0.0, 0.0, 0.0));
MOVE LIN at_v SPEED := 600.0 C_CP := 10.0 TOOL := present_tool;
MOVE LIN pallet[ROUND(i), 1] SPEED := 50.0 TOOL := present_tool;
out_33 := TRUE;
out_34 := FALSE;
WAIT 0.5 SEC;
MOVE LIN pallet[ROUND(i), 1] @ POSE(POSITION(0.0, 0.0, -80.0), ORIQUAT(1.0, 0.0, 0.0, 0.0)) SPEED := 600.0 C_CP := 10.0 TOOL := present_tool;
i := i + 1;
ENDWHILE;
LABEL line_10:
MOVE LIN drop @ POSE(POSITION(0.0, 0.0, -30.0), ORIQUAT(1.0, 0.0, 0.0, 0.0)) SPEED := 600.0 C_CP := 10.0 TOOL := present_tool;
MOVE CIRCLE drop, drop @ POSE(POSITION(10.0, 0.0, 0.0), ORIZYZ2(0.0, 0.0, 0.0)) SPEED := 200.0 SPEED_ORI := 90.0 ACC := 50.0 C_CP := 10.0 TOOL := present_tool;
WAIT FOR in_34 AND NOT in_5;
IF in_2 AND NOT (NOT in_3) THEN GOTO line_10; ENDIF;
MOVE_INC LIN POSITION(0.0, 0.0, 60.0) SPEED := 600.0 C_CP := 10.0 TOOL := present_tool;
MOVE LIN drop SPEED := 600.0 TOOL := present_tool UNTIL NOT in_2;
WAIT FOR in_4 TIMEOUT 2.5;
late := R_TIMEOUT;
CASE TRUNC(count) OF
WHEN 1, 2:
out_10_4 := ROUND(count);
DEFAULT:
WRITELN('none: ', count);
ENDCASE;
REPEAT
count := count + 1;
UNTIL count > 3;
{ not read: HOME }
RETURN;
)");
  EXPECT_EQ(p->files()[0].text.find("not_used"), std::string_view::npos);
  EXPECT_EQ(p->files()[0].text.find("idle"), std::string_view::npos);
}

TEST(ProgramReaders, AsSettingsOfTheNextMotionStayWithIt) {
  const auto faults_of = [](const std::string& body) {
    return read_faults(*read_with(
        read_as, {{"p.as", ".PROGRAM p()\n" + body + ".END\n.PROGRAM q()\nLMOVE a\n.END\n" +
                               ".TRANS\na 1 2 3 0 0 0\n.END\n"}}));
  };
  // The motion behind is another one where the condition holds.
  EXPECT_EQ(faults_of("SPEED 50\nIF SIG(1001) THEN\nLMOVE a\nEND\nLMOVE a\n"),
            "5:1 error it is unknown whether the next motion is within the block or after it.\n");
  EXPECT_EQ(faults_of("SPEED 50\nIF SIG(1001) THEN\nLMOVE a\nELSE\nJMOVE a\nEND\n"), "");
  EXPECT_EQ(faults_of("SPEED 50\nCALL q\nLMOVE a\n"),
            "3:1 error a setting for the next motion comes before a jump, a label or a call.\n");
  EXPECT_EQ(faults_of("IF SIG(1001) THEN\nSPEED 50\nEND\nLMOVE a\n"),
            "4:1 error a setting for the next motion is within a block, but the motion follows the "
            "block.\n");
  EXPECT_EQ(faults_of("XMOVE a TILL 1001\n"),
            "2:1 error XMOVE without /LVL waits for a change of the signal; UNTIL of IRL tests its "
            "level.\n");
  EXPECT_EQ(faults_of("RIGHTY\nJMOVE a\n"),
            "3:1 error the configuration is set only in part: RIGHTY or LEFTY, ABOVE or BELOW, and "
            "UWRIST or DWRIST belong together.\n");
  EXPECT_EQ(faults_of("LMOVE b\n"), "2:7 error b has no value in this file; it is zero here.\n");
  EXPECT_EQ(faults_of("SIGNAL n + 1\nn = 4\n"),
            "2:1 error IRL has no signals with computed numbers.\n");
}

/// A program of a robot on a rail: transformations of seven numbers.
std::vector<RobotFile> as_on_rail(const std::string& body, const std::string& data = {}) {
  return {{"rail.as", ".PROGRAM rail()\n" + body +
                          ".END\n.PROGRAM other(.p)\nLMOVE .p\n.END\n"
                          ".TRANS\nhigh 500 0 300 0 180 0 400\nnest 100 0 0 0 0 0\n" +
                          data + ".END\n.JOINTS\n#safe 0 10 20 0 50 0 250\n.END\n"}};
}

TEST(ProgramReaders, AsTransformationsTakeAdditionalAxesAlong) {
  const auto p = read_with(read_as, as_on_rail(R"(JMOVE #safe
LMOVE high
LMOVE nest + high
POINT at = nest + high
LMOVE at
LMOVE SHIFT(high BY 0, 0, 50)
LAPPRO high, 30
LMOVE nest
C1MOVE TRANS(500, 100, 300, 0, 180, 0, 450)
C2MOVE high
DECOMPOSE v[1] = high
x = v[7]
HERE there
LMOVE there
POINT taken = #safe
LMOVE taken
LMOVE cell[2]
)",
                                               "cell[1] 1 2 3 0 0 0 10\ncell[2] 4 5 6 0 0 0 0\n"));
  EXPECT_EQ(read_faults(*p), "");
  expect_lines(*p, R"(
ROBTARGET: high := ROBTARGET(POSE(POSITION(500.0, 0.0, 300.0), ORIZYZ2(0.0, 180.0, 0.0)), -1, [-128, -128, -128, -128, -128, -128], ADD_JOINT(400.0));
POSE: nest := POSE(POSITION(100.0, 0.0, 0.0), ORIZYZ2(0.0, 0.0, 0.0));
JOINT: safe := JOINT(MAIN_JOINT(0.0, 10.0, 20.0, 0.0, 50.0, 0.0), ADD_JOINT(250.0));
cell[1] := ROBTARGET(POSE(POSITION(1.0, 2.0, 3.0), ORIZYZ2(0.0, 0.0, 0.0)), -1, [-128, -128, -128, -128, -128, -128], ADD_JOINT(10.0));
cell[2] := ROBTARGET(POSE(POSITION(4.0, 5.0, 6.0), ORIZYZ2(0.0, 0.0, 0.0)), -1, [-128, -128, -128, -128, -128, -128], ADD_JOINT(0.0));
)");
  const std::string irl(p->files()[0].text);
  const auto has = [&](const char* part) {
    EXPECT_NE(irl.find(part), std::string::npos) << part << "\nin\n" << irl;
  };
  // A sum has the axes of its last transformation, a shifted place its own.
  has("MOVE LIN ROBTARGET(nest @ high.PSE, -1, [-128, -128, -128, -128, -128, -128], "
      "ADD_JOINT(high.A_JOINT.AA1))");
  has("at_v := ROBTARGET(nest @ high.PSE, -1");
  has("MOVE LIN at_v");
  has("MOVE LIN ROBTARGET(shifted(high.PSE, 0.0, 0.0, 50.0), -1");
  has("ORIQUAT(1.0, 0.0, 0.0, 0.0)), -1, [-128, -128, -128, -128, -128, -128], "
      "ADD_JOINT(high.A_JOINT.AA1))");
  has("MOVE LIN nest");
  has("MOVE CIRCLE ROBTARGET(POSE(POSITION(500.0, 100.0, 300.0), ORIZYZ2(0.0, 180.0, 0.0)), -1, "
      "[-128, -128, -128, -128, -128, -128], ADD_JOINT(450.0)), high");
  has("v[7] := high.A_JOINT.AA1;");
  has("there := any_configuration_target(");
  has("taken := any_configuration_target(TRAFO(safe))");
  has("MOVE LIN cell[2]");
}

TEST(ProgramReaders, AsNeverSetsAnAdditionalAxisThatNothingGives) {
  const auto faults_of = [](const std::string& body, const std::string& data = {}) {
    return read_faults(*read_with(read_as, as_on_rail(body, data)));
  };
  EXPECT_EQ(faults_of("LMOVE high + nest\n"),
            "2:7 error the last transformation of this sum has no additional axes, but one before "
            "it has them.\n");
  EXPECT_EQ(faults_of("LMOVE high - nest\n"),
            "2:7 error the last transformation of this sum has no additional axes, but one before "
            "it has them.\n");
  EXPECT_EQ(faults_of("LMOVE high\nCALL other(high)\n"),
            "3:12 error a transformation with additional axes is not passed to another program.\n");
  EXPECT_EQ(faults_of("LMOVE high\nCALL other(.&cell[,])\n"),
            "3:12 error an array is not passed to another program.\n");
  EXPECT_EQ(faults_of("POINT a = high\nPOINT a = nest\nLMOVE a\n"),
            "3:1 error this transformation has no additional axes, but a has them elsewhere.\n");
  EXPECT_EQ(
      faults_of("LMOVE high\nLMOVE cell[1]\n", "cell[1] 1 2 3 0 0 0\ncell[2] 4 5 6 0 0 0 70\n"),
      "11:1 error this transformation has no additional axes, but cell has them "
      "elsewhere.\n");
  EXPECT_EQ(faults_of("RIGHTY\nABOVE\nUWRIST\nJMOVE high\nJMOVE nest\n"),
            "6:1 error this transformation has no additional axes, so it cannot get a "
            "configuration.\n");
  // Zeros behind six numbers where no value is of an additional axis: a robot without any.
  const auto alone = read_with(read_as, {{"six.as",
                                          ".PROGRAM six()\nLMOVE a\nLMOVE b + a\n.END\n.TRANS\n"
                                          "a 1 2 3 0 0 0 0 0\nb 4 5 6 0 0 0 0\n.END\n"}});
  EXPECT_EQ(read_faults(*alone), "");
  EXPECT_EQ(alone->files()[0].text.find("ROBTARGET"), std::string_view::npos)
      << alone->files()[0].text;
}

TEST(ProgramReaders, BinaryNumbersHaveTheirDigitsAndAtMost31Bits) {
  const std::string many(32, '1');
  const auto as = [](const std::string& n) {
    return read_with(read_as, {{"b.as", ".PROGRAM b()\nx = " + n + "\n.END\n"}});
  };
  const auto pac = [](const std::string& n) {
    return read_with(read_pacscript,
                     {{"b.pcs", "Sub Main\nDim x As Long\nx = " + n + "\nEnd Sub\n"}});
  };
  const auto melfa = [](const std::string& n) {
    return read_with(read_melfa, {{"b.mb5", "M1%=" + n + "\nEnd\n"}});
  };
  // 0101 is 5; zeros in front are no bits.
  EXPECT_NE(as("^B0101")->files()[0].text.find("x := 5"), std::string_view::npos);
  EXPECT_NE(pac("&B0101")->files()[0].text.find("x := 5"), std::string_view::npos);
  EXPECT_NE(melfa("&B" + std::string(40, '0') + "101")->files()[0].text.find("M1 := 5"),
            std::string_view::npos);
  for (const auto& p : {as("^B102"), pac("&B102"), melfa("&B102")})
    EXPECT_NE(read_faults(*p).find("B102 is not a binary number."), std::string::npos)
        << read_faults(*p);
  for (const auto& p : {as("^B" + many), pac("&B" + many), melfa("&B" + many)})
    EXPECT_NE(read_faults(*p).find("has more than 31 bits."), std::string::npos) << read_faults(*p);
}

const std::vector<RobotFile> kPdl2Weld{{"weld.pdl", R"(PROGRAM weld PROG_ARM = 1, EZ
-- a seam
CONST
  rounds = 3
TYPE
  crate = RECORD
    count : INTEGER
    full : BOOLEAN
  ENDRECORD
VAR
  i, n : INTEGER (2) NOSAVE
  home : JOINTPOS FOR ARM[1]
  p, q : POSITION
  places : ARRAY[2] OF POSITION
  box : crate
  late : BOOLEAN
  taught : POSITION
ROUTINE grip(on_off : BOOLEAN; VAR_n : INTEGER) EXPORTED FROM tools GLOBAL
ROUTINE twice(x : INTEGER) : INTEGER
BEGIN
  RETURN(x * 2)
END twice
ROUTINE count_up(x : INTEGER)
VAR
  y : INTEGER
BEGIN
  y := 1
  x := x + y
END count_up
BEGIN
  $SPD_OPT := SPD_LIN
  $CNFG_CARE := FALSE
  $TOOL := POS(0, 0, 120, 0, 0, 0, '')
  $UFRAME := POS(500, 0, 0, 90, 0, 0, '')
  $GEN_OVR := 50
  $LIN_SPD := 0.25
  $FLY_TYPE := FLY_CART
  home := {0, 0, -90, 0, 90, 0}
  MOVE JOINT TO home WITH $PROG_SPD_OVR = 50
  p := POS(10, 20, 30, 0, 180, 0, 'S W')
  FOR i := 1 TO rounds DO
    places[1] := p : POS(0, 0, -50)
    places[1].X := places[1].X + i
    MOVEFLY LINEAR TO places[1] ADVANCE WITH $FLY_DIST = 5
    MOVE LINEAR TO p,
      WITH $LIN_SPD = 0.05,
    ENDMOVE
    $DOUT[3] := ON
    DELAY 250
    MOVE AWAY 80
    count_up(n)
    count_up((n))
    n := twice(n) + ROUND(SIN(30.0))
  ENDFOR
  MOVE CIRCULAR TO POS(20, 0, 30, 0, 180, 0, '') VIA POS(10, 10, 30, 0, 180, 0, '')
  MOVE NEAR p BY 40
  $CNFG_CARE := TRUE
  MOVE TO p
  MOVE LINEAR RELATIVE VEC(0, 0, 10) IN BASE
  MOVE LINEAR TO q TIL NOT $DIN[2]
  WAIT FOR $DIN[1] AND ((n > 2) OR $DOUT[3])
  $TIMER[1] := 0
  REPEAT
    DELAY 1
  UNTIL ($DIN[4]) OR ($TIMER[1] >= 2000)
  late := $TIMER[1] >= 2000
  SELECT n OF
    CASE (1, 2):
      box.count := n
    ELSE:
      WRITE LUN_CRT ('n = ', n, NL)
  ENDSELECT
  IF late THEN
    GOTO out
  ELSIF n DIV 2 = 1 THEN
    PAUSE
  ENDIF
  CONDITION[1] :
    WHEN $DIN[5] DO
      HOLD
  ENDCONDITION
  q := taught
out::
  grip(TRUE, 1)
  POS_SHIFT(p, VEC(1, 2, 3))
END weld
)"}};

TEST(ProgramReaders, Pdl2BecomesIrl) {
  const auto p = read_with(read_pdl2, kPdl2Weld);
  EXPECT_EQ(read_faults(*p),
            "78:3 error condition handlers are not read.\n"
            "82:8 error taught has no value in this program; it is zero here.\n"
            "84:3 error grip is not among the files; an empty routine replaces it.\n"
            "85:3 error POS_SHIFT is specific to the controller and is not read.\n");
  expect_lines(*p, R"(
PROGRAM weld;
INT: rounds := 3;
RECORD INT: f_count; BOOL: f_full; ENDRECORD: crate;
INT: n := 2;
FUNCTION twice (IN INT: x): INT;
RETURN x * 2;
PROCEDURE count_up (INOUT INT: x_2);
x_2 := x_2 + y;
home := MAIN_JOINT(0.0, 0.0, -90.0, 0.0, 90.0, 0.0);
MOVE PTP home SPEED_PTP := 25.0 TOOL := present_tool;
p := ROBTARGET(POSE(POSITION(10.0, 20.0, 30.0), ORIZYZ2(0.0, 180.0, 0.0)), 5, [-128, -128, -128, -128, -128, -128], ADD_JOINT(0.0));
FOR i := 1 TO rounds
places[1].PSE := p.PSE @ POSE(POSITION(0.0, 0.0, -50.0), ORIZYZ2(0.0, 0.0, 0.0));
places[1].PSE.POS.X := places[1].PSE.POS.X + i;
MOVE LIN places[1].PSE SPEED := 125.0 C_CP := 5.0 FRAME := present_uframe TOOL := present_tool;
MOVE LIN p.PSE SPEED := 25.0 FRAME := present_uframe TOOL := present_tool;
out_3 := TRUE;
WAIT 0.25 SEC;
MOVE PTP p.PSE @ POSE(POSITION(0.0, 0.0, -80.0), ORIQUAT(1.0, 0.0, 0.0, 0.0)) SPEED_PTP := 50.0 FRAME := present_uframe TOOL := present_tool;
count_up(n);
given := n;
count_up(given);
n := twice(n) + ROUND(SIN(30.0));
ENDFOR;
MOVE CIRCLE POSE(POSITION(10.0, 10.0, 30.0), ORIZYZ2(0.0, 180.0, 0.0)), POSE(POSITION(20.0, 0.0, 30.0), ORIZYZ2(0.0, 180.0, 0.0)) SPEED := 125.0 FRAME := present_uframe TOOL := present_tool;
MOVE PTP p.PSE @ POSE(POSITION(0.0, 0.0, -40.0), ORIQUAT(1.0, 0.0, 0.0, 0.0)) SPEED_PTP := 50.0 FRAME := present_uframe TOOL := present_tool;
MOVE PTP p SPEED_PTP := 50.0 FRAME := present_uframe TOOL := present_tool;
MOVE_INC LIN POSITION(0.0, 0.0, 10.0) SPEED := 125.0 TOOL := present_tool;
MOVE LIN q.PSE SPEED := 125.0 FRAME := present_uframe TOOL := present_tool UNTIL NOT in_2;
WAIT FOR in_1 AND (n > 2 OR out_3);
WAIT FOR in_4 TIMEOUT 2.0;
late := R_TIMEOUT;
CASE n OF
WHEN 1, 2:
box.f_count := n;
DEFAULT:
WRITELN('n = ', n);
ENDCASE;
IF late THEN
GOTO out_v;
ELSIF n DIV 2 = 1 THEN
PAUSE;
ENDIF;
{ not read: CONDITION[1] : }
q := taught;
LABEL out_v:
)");
}

TEST(ProgramReaders, Pdl2PositionsTakeAuxiliaryAxesAlong) {
  const auto p = read_with(read_pdl2, {{"rail.pdl", R"(PROGRAM rail
VAR
  x, y : XTNDPOS
  way : ARRAY[2] OF XTNDPOS
  p : POSITION
ROUTINE go(q : XTNDPOS)
BEGIN
  MOVE LINEAR TO q
END go
BEGIN
  $CNFG_CARE := FALSE
  x := y
  x.POS := POS(500, 0, 300, 0, 180, 0, '')
  x.AUX[1] := 400
  way[1] := x
  p := x.POS
  MOVE TO x
  MOVE LINEAR TO x
  MOVE LINEAR TO way[1]
  MOVE LINEAR TO x.POS
  MOVE LINEAR TO p
  MOVE CIRCULAR TO x VIA way[1]
  go(x)
END rail
)"}});
  const std::string irl(p->files()[0].text);
  const auto has = [&](const std::string& part) {
    EXPECT_NE(irl.find(part), std::string::npos) << part << "\nin\n" << irl;
  };
  const auto along = [](const std::string& x) {
    return "ROBTARGET(" + x + ".PSE, -1, [-128, -128, -128, -128, -128, -128], ADD_JOINT(" + x +
           ".A_JOINT.AA1))";
  };
  has("x.A_JOINT.AA1 := 400");
  has("MOVE PTP " + along("x"));
  has("MOVE LIN " + along("x"));
  has("MOVE LIN " + along("way[1]"));
  // The .POS of an XTNDPOS and a POSITION leave the axes where they are.
  has("MOVE LIN x.PSE");
  has("MOVE LIN p.PSE");
  has("MOVE CIRCLE " + along("way[1]") + ", " + along("x"));
  has("MOVE LIN " + along("q"));
  EXPECT_EQ(errors_of_irl(*p), "") << irl;
}

const std::vector<RobotFile> kPacPick{{"pick.pcs", R"('!TITLE "pick"
#define GRIP IO[128]
#define HEIGHT 80.5
Dim count As Long
Dim places(2) As Position

Sub Main
  Dim home As Joint
  TakeArm Keep = 0
  Tool 1, P(0, 0, 120, 0, 0, 0)
  ChangeTool 1
  Speed 50
  Accel 100, 100
  home = J(0, -30, 120, 0, 90, 0)
  DriveA @0 home
  places(0) = P(425, 0, 325, 180, 0, 0, 5)
  P10 = P(400, -100, 200, 180, 0, 90, -1)
  For count = 1 To 2
    Approach P, places(0), @P HEIGHT
    Move L, @0 places(0), S = 10
    Set GRIP
    Delay 250
    Depart L, @20 HEIGHT
    Move P, @5 P10, @0 P(1, 2, 3), Speed = 20, Next
  Next
  Move C, P(450, 0, 200, 180, 0, 0), @P P(425, 50, 200, 180, 0, 0)
  Draw L, V(0, 0, 30)
  Move L, @0 Dev(CurPos, P(0, 10, 0, 0, 0, 0)), Speed = 5
  Wait IO[1] = On And Not(IO[2] = Off), 2000, seen
  Select Case count
  Case 1, 3 To 4
    LetX places(0) = PosX(places(0)) + 10
  Case Else
    Reset IO[129], 100
  End Select
  Do While count < 5
    count = twice(count)
    Call lift(count)
    If count = 4 Then Exit Do Else count = 4
  Loop
  Out IO[136 To 139] = 5
  In count = IO[8 To 11]
  If IO[1] Then
    GoTo *ready
  ElseIf count = 2 Then
    PrintDbg "two"; count
  End If
  ArchMove P10, 20
*ready:
  Move P, @0 P11
  GiveArm
End Sub

Function twice(ByVal n As Long) As Long
  If n > 3 Then Exit Function
  twice = n * 2
End Function

Sub lift(n As Long)
  n = n + 1
End Sub
)"}};

TEST(ProgramReaders, PacScriptBecomesIrl) {
  std::vector<RobotFile> files = kPacPick;
  files[0].text.insert(files[0].text.find("Dim places"), "Dim seen As Boolean\n");
  const auto p = read_with(read_pacscript, files);
  EXPECT_EQ(
      read_faults(*p),
      "25:5 warning with Next the controller continues while the robot moves; in IRL the motion "
      "ends first.\n"
      "35:5 warning the IRL program waits for the end of this pulse; the controller continues.\n"
      "49:3 error ArchMove is specific to the controller and is not read.\n"
      "51:14 error P11 has no value in this program; it is zero here.\n");
  expect_lines(*p, R"(
PROGRAM pick;
FUNCTION twice (IN INT: n): INT;
IF n > 3 THEN
RETURN twice_2;
ENDIF;
twice_2 := n * 2;
RETURN twice_2;
PROCEDURE lift (INOUT INT: n_2);
n_2 := n_2 + 1;
home := MAIN_JOINT(0.0, -30.0, 120.0, 0.0, 90.0, 0.0);
MOVE PTP home SPEED_PTP := 50.0 ACC_PTP := 100.0 TOOL := present_tool;
places[0] := ROBTARGET(POSE(POSITION(425.0, 0.0, 325.0), ORIZYX(0.0, 0.0, 180.0)), 5, [-128, -128, -128, 0, -128, 0], ADD_JOINT(0.0));
P10 := POSE(POSITION(400.0, -100.0, 200.0), ORIZYX(90.0, 0.0, 180.0));
WHILE count <= 2 DO
MOVE LIN places[0].PSE SPEED := 100.0 ACC := 100.0 TOOL := present_tool;
out_128 := TRUE;
WAIT 0.25 SEC;
MOVE LIN places[0].PSE @ POSE(POSITION(0.0, 0.0, -80.5), ORIQUAT(1.0, 0.0, 0.0, 0.0)) SPEED := 500.0 ACC := 100.0 C_CP := 20.0 TOOL := present_tool;
MOVE PTP P10 SPEED_PTP := 20.0 ACC_PTP := 100.0 C_PTP := 5.0 TOOL := present_tool;
MOVE PTP POSE(POSITION(1.0, 2.0, 3.0), ORIZYX(0.0, 0.0, 0.0)) SPEED_PTP := 20.0 ACC_PTP := 100.0 TOOL := present_tool;
count := count + 1;
ENDWHILE;
MOVE CIRCLE POSE(POSITION(450.0, 0.0, 200.0), ORIZYX(0.0, 0.0, 180.0)), POSE(POSITION(425.0, 50.0, 200.0), ORIZYX(0.0, 0.0, 180.0)) SPEED := 500.0 ACC := 100.0 C_PASS := TRUE TOOL := present_tool;
MOVE_INC LIN POSITION(0.0, 0.0, 30.0) SPEED := 500.0 ACC := 100.0 TOOL := present_tool;
MOVE_INC LIN POSITION(0.0, 10.0, 0.0) SPEED := 50.0 ACC := 100.0 TOOL := present_tool;
WAIT FOR in_1 = TRUE AND NOT in_2 = FALSE TIMEOUT 2.0;
seen := NOT R_TIMEOUT;
CASE count OF
WHEN 1, 3, 4:
places[0].PSE.POS.X := places[0].PSE.POS.X + 10;
DEFAULT:
out_129 := FALSE;
WAIT 0.1 SEC;
out_129 := TRUE;
ENDCASE;
WHILE count < 5 DO
count := twice(count);
lift(count);
IF count = 4 THEN
EXIT;
ELSE
count := 4;
ENDIF;
ENDWHILE;
out_136_4 := 5;
count := in_8_4;
IF in_1 THEN
GOTO ready;
ELSIF count = 2 THEN
WRITELN('two', count);
ENDIF;
LABEL ready:
MOVE PTP P11 SPEED_PTP := 50.0 ACC_PTP := 100.0 TOOL := present_tool;
)");
}

TEST(ProgramReaders, RapidComputedPlacesKeepTheNearestConfiguration) {
  const auto p = read_with(read_rapid, {{"c.mod", R"(MODULE M
  VAR pos middle;
  VAR num n;
  VAR robtarget kept;
  PROC main()
    MoveC there([middle,[1,0,0,0]]), there([[1,2,3],[1,0,0,0]]), v100, fine, tool0;
    TPWrite "n is " + ValToStr(n) + "; " + NumToStr(n, 2);
    kept := CRobT();
  ENDPROC
  FUNC robtarget there(pose p)
    VAR robtarget t;
    t := CRobT(\Tool:=tool0);
    t.trans := p.trans;
    t.rot := p.rot;
    RETURN t;
  ENDFUNC
ENDMODULE
)"}});
  // Where the robot is stays unknown where its place counts.
  EXPECT_EQ(
      read_faults(*p),
      "8:13 error CRobT without \\Tool or \\WObj is in those of the last motion, which differ "
      "from motion to motion.\n");
  expect_lines(*p, R"(
t.STATUS := -1;
t.TURNS := [-128, -128, -128, -128, -128, -128];
t.PSE.POS := p.POS;
t.PSE.ORI := p.ORI;
MOVE CIRCLE there(POSE(middle, ORIQUAT(1.0, 0.0, 0.0, 0.0))), there(POSE(POSITION(1.0, 2.0, 3.0), ORIQUAT(1.0, 0.0, 0.0, 0.0))) SPEED := 100.0;
WRITELN('n is ', n, '; ', n);
)");
}

TEST(ProgramReaders, MelfaFlagsOfWhereTheRobotIsAreAnyConfiguration) {
  const auto p = read_with(read_melfa, {{"f.mb5", R"(PT=P1*P2
PT.FL1=P_Curr.FL1
PT.FL2=P_Curr.FL2
Cnt 1,25,25
Mov PT Type 0,0
Mov P1 Type 0,0
Mvs PT
End
P1=(1,2,3,0,0,0)(7,0)
P2=(0,0,10,0,0,0)(7,0)
)"}});
  EXPECT_EQ(read_faults(*p),
            "6:1 error IRL cannot choose how the tool rotates during a motion (Type).\n");
  expect_lines(*p, R"(
PT.STATUS := -1;
PT.TURNS := [-128, -128, -128, -128, -128, -128];
MOVE PTP PT C_PASS := TRUE C_PTP := 25.0;
MOVE LIN PT C_PASS := TRUE C_CP := 25.0;
)");
}

TEST(ProgramReaders, UrscriptTextsOfNumbersAreWritten) {
  const auto p = read_with(
      read_urscript,
      {{"t.script", "n = 3\ntextmsg(str_cat(str_cat(\"after \", to_str(n)), \" discs\"))\n"}});
  EXPECT_EQ(read_faults(*p), "");
  expect_lines(*p, "WRITELN('after ', n, ' discs');\n");
}

TEST(ProgramReaders, Val3PointsAreLinkedAndMotionsEndEarly) {
  const auto code = [](const std::string& lines) {
    return std::vector<RobotFile>{
        {"app.pjx",
         "<Project><Programs><Program file=\"start.pgx\"/></Programs><Database><Data "
         "file=\"app.dtx\"/></Database></Project>"},
        {"app.dtx",
         R"(<Database><Datas>
<Data name="lamp" type="dio" size="3"><Value key="0" link="sysIO\out3"/></Data>
<Data name="seen" type="dio" size="1"><Value key="0" link="sysIO\in3"/></Data>
<Data name="fTable" type="frame" size="1"><Value key="0" x="500" fatherId="world[0]"/></Data>
<Data name="fOther" type="frame" size="1"><Value key="0" y="500" fatherId="world[0]"/></Data>
<Data name="tGrip" type="tool" size="1"><Value key="0" z="120" fatherId="flange[0]"/></Data>
<Data name="mSlow" type="mdesc"><Value key="0" accel="100" vel="100" tmax="80" blend="off"/></Data>
<Data name="pTo" type="pointRx" size="1"><Value key="0" x="1" shoulder="lefty" elbow="epositive" wrist="wpositive" fatherId="fTable[0]"/></Data>
<Data name="n" type="num" size="1"/>
</Datas></Database>
)"},
        {"start.pgx", "<Programs><Program name=\"start\"><Code><![CDATA[begin\n" + lines +
                          "end]]></Code></Program></Programs>"}};
  };
  const auto p = read_with(read_val3, code(R"(link(pTo, fOther)
pTo.trsf = {1, 2, 3, 0, 0, 0}
movej(pTo, tGrip, mSlow)
pTo = here(tGrip, fTable)
pTo.trsf.z = pTo.trsf.z + 80
movel(pTo, tGrip, mSlow)
movel(pTo, tGrip, mSlow)
wait(seen or isEmpty())
resetMotion()
dioSet(lamp, 5)
n = dioGet(lamp)
logMsg("n = " + toString("", n))
taskKill("app~")
taskKill("other")
)"));
  EXPECT_EQ(read_faults(*p), "15:1 error IRL has no counterpart of taskKill.\n");
  expect_lines(*p, R"(
ROBTARGET: pTo := ROBTARGET(POSE(POSITION(1.0, 0.0, 0.0), ORIXYZ(0.0, 0.0, 0.0)), 0, [-128, -128, -128, -128, -128, -128], ADD_JOINT(0.0));
pTo.PSE := POSE(POSITION(1.0, 2.0, 3.0), ORIXYZ(0.0, 0.0, 0.0));
MOVE PTP pTo SPEED_PTP := 100.0 TOOL := tGrip FRAME := fOther;
MOVE_INC LIN POSITION(0.0, 0.0, 80.0) SPEED := 80.0 TOOL := tGrip FRAME := fTable;
MOVE LIN pTo SPEED := 80.0 TOOL := tGrip FRAME := fOther UNTIL seen;
lamp_0 := TRUE;
lamp_1 := FALSE;
lamp_2 := TRUE;
n := bool_number(lamp_0) + 2 * bool_number(lamp_1) + 4 * bool_number(lamp_2);
WRITELN('n = ', n);
HALT;
)");
  // Of several frames the one that counts is not known behind a condition.
  EXPECT_EQ(read_faults(*read_with(read_val3, code(R"(if n > 1
link(pTo, fOther)
else
link(pTo, fTable)
endIf
movel(pTo, tGrip, mSlow)
)"))),
            "7:1 error which frame pTo uses is unknown here.\n");
}

// ---- Yaskawa, Movemaster, CRCL, JointTrajectory ----

const std::vector<RobotFile> kInformJobs{{"PICK.JBI", R"(/JOB
//NAME PICK
//POS
///NPOS 4,1,0,0,0,0
///TOOL 1
///POSTYPE PULSE
///PULSE
C00000=1000,-2000,3000,800,-1600,500
///POSTYPE BASE
///RECTAN
///RCONF 0,1,0,0,0,0,0,0
C00001=500.000,-100.000,300.000,180.0000,10.0000,-20.0000
///USER 2
///POSTYPE USER
///RCONF 1,0,1,0,0,0,0,0
C00002=10.000,20.000,30.000,0.0000,0.0000,90.0000
C00003=10.000,40.000,30.000,0.0000,0.0000,90.0000
C00004=30.000,40.000,30.000,0.0000,0.0000,90.0000
///POSTYPE PULSE
///PULSE
BC00000=25000
//INST
///DATE 2020/01/01 12:00
///ATTR SC,RW
///GROUP1 RB1,BS1
NOP
'begins
MOVJ C00000 BC00000 VJ=50.00 PL=0
SET I001 0
*LOOP
MOVL C00001 V=123.4 PL=2 UNTIL IN#(3)=ON ACC=50 DEC=50
DOUT OT#(10) ON
TIMER T=0.25
WAIT IN#(4)=OFF T=2.00
IFTHENEXP (I001<3) AND (IN#(5)=ON)
  INC I001
  CALL JOB:DROP-1 IF IN#(6)=ON
ELSE
  DOUT OG#(2) 5
ENDIF
JUMP *LOOP IF I001<>3
MOVC C00002 V=50.0 PL=0
MOVC C00003 V=50.0
MOVC C00004 V=60.0 PL=0
SET R000 EXPRESS (2 + 3) * 1.5
MSG "done"
END
)"},
                                         {"DROP-1.JBI", R"(/JOB
//NAME DROP-1
//POS
///NPOS 0,0,0,0,0,0
//INST
///DATE 2020/01/01 12:00
///ATTR SC,RW
///GROUP1 RB1
NOP
FOR LI000=1 TO 3
  PULSE OT#(11) T=0.50
NEXT LI000
SWITCH LI000 CASE 1
  TIMER T=1.00
CASE 2
  TIMER T=2.00
DEFAULT
  TIMER T=I000
ENDSWITCH
RET
END
)"},
                                         {"TOOL.CND", R"(//TOOL 0
///NAME
0.000,0.000,0.000,0.0000,0.0000,0.0000
0.000,0.000,0.000
//TOOL 1
///NAME TORCH
1.000,2.000,150.000,0.0000,30.0000,0.0000
)"},
                                         {"UFRAME.CND", R"(//UFRAME 2
///NAME TABLE
////BUSER 400.000,0.000,100.000,0.0000,0.0000,90.0000
)"}};

// Pulses are those of the test's settings: 1000, 1000, 1000, 800, 800, 500 a degree, 100 a mm.
TEST(ProgramReaders, InformBecomesIrl) {
  const auto p = read_with(read_inform, kInformJobs);
  EXPECT_EQ(
      read_faults(*p),
      "29:5 warning variables start at 0: their values are stored on the controller.\n"
      "11:3 warning the IRL program waits for the end of the pulse; the controller does not.\n");
  expect_lines(*p, R"(
OUTPUT INT: out_9_8 AT 9, 8;
PROCEDURE job_DROP_1 ();
FOR LI000_DROP_1 := 1 TO 3 DO
out_11 := TRUE;
WAIT 0.5 SEC;
out_11 := FALSE;
ENDFOR;
CASE LI000_DROP_1 OF
WHEN 1:
DEFAULT:
WAIT I000 / 100.0 SEC;
{ begins }
MOVE PTP JOINT(MAIN_JOINT(1.0, -2.0, 3.0, 1.0, -2.0, 1.0), ADD_JOINT(250.0)) SPEED_PTP := 50.0;
LABEL label_LOOP:
MOVE LIN ROBTARGET(POSE(POSITION(500.0, -100.0, 300.0), ORIZYX(-20.0, 10.0, 180.0)), 6, [0, 0, 0, 0, 0, 0], ADD_JOINT(0.0)) SPEED := 123.4 C_CP := 20.0 ACC := 50.0 TOOL := POSE(POSITION(1.0, 2.0, 150.0), ORIZYX(0.0, 30.0, 0.0)) UNTIL in_3 = TRUE;
WAIT FOR in_4 = FALSE TIMEOUT 2.0;
IF (I001 < 3) AND (in_5 = TRUE) THEN
I001 := I001 + 1;
IF in_6 = TRUE THEN job_DROP_1(); ENDIF;
ELSE
out_9_8 := 5;
ENDIF;
IF I001 <> 3 THEN GOTO label_LOOP; ENDIF;
MOVE LIN ROBTARGET(POSE(POSITION(10.0, 20.0, 30.0), ORIZYX(90.0, 0.0, 0.0)), 1, [0, 0, 0, 0, 0, 0], ADD_JOINT(0.0)) SPEED := 50.0 TOOL := POSE(POSITION(1.0, 2.0, 150.0), ORIZYX(0.0, 30.0, 0.0)) FRAME := POSE(POSITION(400.0, 0.0, 100.0), ORIZYX(90.0, 0.0, 0.0));
MOVE CIRCLE ROBTARGET(POSE(POSITION(10.0, 40.0, 30.0), ORIZYX(90.0, 0.0, 0.0)), 1, [0, 0, 0, 0, 0, 0], ADD_JOINT(0.0)), ROBTARGET(POSE(POSITION(30.0, 40.0, 30.0), ORIZYX(90.0, 0.0, 0.0)), 1, [0, 0, 0, 0, 0, 0], ADD_JOINT(0.0)) SPEED := 60.0 TOOL := POSE(POSITION(1.0, 2.0, 150.0), ORIZYX(0.0, 30.0, 0.0)) FRAME := POSE(POSITION(400.0, 0.0, 100.0), ORIZYX(90.0, 0.0, 0.0));
R000 := (2 + 3) * 1.5;
WRITELN('done');
)");
}
TEST(ProgramReaders, InformSaysWhatItDoesNotRead) {
  const auto job = [](const std::string& positions, const std::string& lines) {
    return std::vector<RobotFile>{
        {"J.JBI", "/JOB\n//NAME J\n//POS\n" + positions + "//INST\nNOP\n" + lines + "END\n"}};
  };
  const std::string pose =
      "///TOOL 3\n///POSTYPE USER\n///USER 2\n///RCONF 1,0,0,1,0,0,0,0\n"
      "C00000=1,2,3,4,5,6\n";
  EXPECT_EQ(
      read_faults(*read_with(read_inform, job(pose, "MOVL C00000 V=10.0 PL=0\n"))),
      "8:1 error an axis of this position is beyond 180 degrees, but RCONF does not give the side; "
      "turn 0 is assumed.\n"
      "11:1 error the value of tool 3 is known only to the controller; zero is assumed.\n"
      "11:1 error the value of user frame 2 is known only to the controller; zero is assumed.\n");
  EXPECT_EQ(
      read_faults(*read_with(
          read_inform, job("",
                           "ARCON ASF#(1)\nMOVL P001 V=1.0\nMOVJ C00009 VJ=1.00\nCALL JOB:OTHER\n"
                           "JUMP *NONE\nDOUT OT#(*) ON\nTIMER T=1.00 NWAIT\nMOVC C00000 V=1.0\n"))),
      "6:1 error ARCON is not read: IRL has no counterpart.\n"
      "7:6 error the value of position variable P1 is stored on the controller.\n"
      "8:6 error the job has no position C9.\n"
      "9:1 error job OTHER is not among the files.\n"
      "10:1 error the label *NONE is not in this job.\n"
      "11:10 error signals with computed numbers are not read.\n"
      "12:14 error \"NWAIT\" of this instruction is not read.\n"
      "13:6 error the job has no position C0.\n");
}

const std::vector<RobotFile> kMovemasterLines{{"stack.rm1", R"(PD 1,300.0,0.0,200.0,-90.0,0.0
PD 2,0.0,250.0,150.0,-45.0,30.0
10 SP 5
20 TL 120
30 SC 1,3
40 MO 1,O
50 MS 2,10
60 GC
70 TI 5
80 OB +3
90 ID
100 TB -2,90
110 GS 300
120 DC 1
130 CP 1
140 NE 0,40
150 RC 2
160 MO 1
170 NX
180 HLT
190 ED
300 MO 2
310 OB -3
320 RT
)"}};

// A hand at a pitch of -90 degrees points down; at a waist of 90 degrees it lies in the plane of y.
TEST(ProgramReaders, MovemasterBecomesIrl) {
  const auto p = read_with(read_movemaster, kMovemasterLines);
  EXPECT_EQ(read_faults(*p), "");
  expect_lines(*p, R"(
OUTPUT BOOL: hand AT 1;
OUTPUT BOOL: out_3 AT 3;
POSE: position_1 := POSE(POSITION(300.0, 0.0, 200.0), ORIMAT(POSITION(-1.0, 0.0, 0.0), POSITION(0.0, 1.0, 0.0), POSITION(0.0, 0.0, -1.0)));
POSE: position_2 := POSE(POSITION(0.0, 250.0, 150.0), ORIMAT(POSITION(-0.5, -0.612372435696, -0.612372435696), POSITION(-0.866025403784, 0.353553390593, 0.353553390593), POSITION(0.0, 0.707106781187, -0.707106781187)));
POSE: present_tool := POSE(POSITION(0.0, 0.0, 120.0), ORIQUAT(1.0, 0.0, 0.0, 0.0));
PROCEDURE subroutine_300 ();
out_3 := FALSE;
counter_1 := 3;
LABEL line_40:
hand := FALSE;
MOVE PTP position_1 SPEED_PTP := 55.5555555556 TOOL := present_tool;
MOVE LIN position_2 SPEED := 555.555555556 TOOL := present_tool;
hand := TRUE;
WAIT 0.5 SEC;
out_3 := TRUE;
WAIT FOR in_2 = TRUE;
subroutine_300();
counter_1 := counter_1 - 1;
register := counter_1;
IF register <> 0 THEN GOTO line_40; ENDIF;
FOR repeat_1 := 1 TO 2 DO
ENDFOR;
PAUSE;
RETURN;
)");
  EXPECT_EQ(
      read_faults(*read_with(read_movemaster, {{"p.rm1",
                                                "10 MO 7\n20 DW 1,2,3\n30 GT 99\n40 XX\n50 OB 3\n"
                                                "60 NX\n70 RT\n80 ED\n"}})),
      "1:7 error position 7 is not defined in this file (PD).\n"
      "2:1 error DW is not read.\n"
      "3:7 error line 99 is not in this program.\n"
      "4:1 error \"XX\" is not a command of the Movemaster RV-M1.\n"
      "5:7 error OB needs + to switch a bit on or - to switch it off.\n"
      "6:1 error NX has no loop (RC).\n"
      "7:1 error RT is outside a subroutine (GS).\n");
}

const std::vector<RobotFile> kCrclProgram{{"lift.xml", R"(<?xml version="1.0" encoding="UTF-8"?>
<CRCLProgram xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance">
  <Name>lift</Name>
  <InitCanon><CommandID>1</CommandID></InitCanon>
  <!-- millimetres -->
  <MiddleCommand xsi:type="SetLengthUnitsType"><CommandID>2</CommandID><UnitName>millimeter</UnitName></MiddleCommand>
  <MiddleCommand xsi:type="SetAngleUnitsType"><CommandID>3</CommandID><UnitName>degree</UnitName></MiddleCommand>
  <MiddleCommand xsi:type="SetTransSpeedType"><CommandID>4</CommandID><TransSpeed xsi:type="TransSpeedAbsoluteType"><Setting>120</Setting></TransSpeed></MiddleCommand>
  <MiddleCommand xsi:type="MoveToType"><CommandID>5</CommandID><MoveStraight>true</MoveStraight><EndPosition><Point><X>400</X><Y>0</Y><Z>300</Z></Point><XAxis><I>1</I><J>0</J><K>0</K></XAxis><ZAxis><I>0</I><J>0</J><K>-1</K></ZAxis></EndPosition></MiddleCommand>
  <MiddleCommand xsi:type="SetEndEffectorType"><CommandID>6</CommandID><Setting>1.0</Setting></MiddleCommand>
  <MiddleCommand xsi:type="DwellType"><CommandID>7</CommandID><DwellTime>0.5</DwellTime></MiddleCommand>
  <MiddleCommand xsi:type="SetRobotParametersType"><CommandID>8</CommandID><ParameterSetting><ParameterName>output 3</ParameterName><ParameterValue>true</ParameterValue></ParameterSetting></MiddleCommand>
  <MiddleCommand xsi:type="MessageType"><CommandID>9</CommandID><Message>up &amp; away</Message></MiddleCommand>
  <MiddleCommand xsi:type="ActuateJointsType"><CommandID>10</CommandID><ActuateJoint><JointNumber>1</JointNumber><JointPosition>10</JointPosition></ActuateJoint><ActuateJoint><JointNumber>2</JointNumber><JointPosition>20</JointPosition></ActuateJoint><ActuateJoint><JointNumber>3</JointNumber><JointPosition>30</JointPosition></ActuateJoint><ActuateJoint><JointNumber>4</JointNumber><JointPosition>40</JointPosition></ActuateJoint><ActuateJoint><JointNumber>5</JointNumber><JointPosition>50</JointPosition></ActuateJoint><ActuateJoint><JointNumber>6</JointNumber><JointPosition>60</JointPosition></ActuateJoint></MiddleCommand>
  <EndCanon><CommandID>12</CommandID></EndCanon>
</CRCLProgram>
)"}};

TEST(ProgramReaders, CrclBecomesIrl) {
  const auto p = read_with(read_crcl, kCrclProgram);
  EXPECT_EQ(read_faults(*p), "");
  expect_lines(*p, R"(
OUTPUT BOOL: gripper AT 1;
OUTPUT BOOL: output_3 AT 3;
MOVE LIN POSE(POSITION(400.0, 0.0, 300.0), ORIMAT(POSITION(1.0, 0.0, 0.0), POSITION(0.0, -1.0, 0.0), POSITION(0.0, 0.0, -1.0))) SPEED := 120.0;
gripper := TRUE;
WAIT 0.5 SEC;
output_3 := TRUE;
WRITELN('up & away');
MOVE PTP MAIN_JOINT(10.0, 20.0, 30.0, 40.0, 50.0, 60.0);
)");
  const auto program = [](const std::string& commands) {
    return std::vector<RobotFile>{{"p.xml", "<CRCLProgram>\n" + commands + "</CRCLProgram>\n"}};
  };
  const auto command = [](const std::string& type, const std::string& inner) {
    return "<MiddleCommand type=\"" + type + "\">" + inner + "</MiddleCommand>\n";
  };
  // Without units lengths are metres and angles radians.
  const std::string place =
      "<EndPosition><Point><X>0.4</X><Y>0</Y><Z>0.3</Z></Point><XAxis><I>1</I><J>0</J><K>0</K>"
      "</XAxis><ZAxis><I>0</I><J>0</J><K>1</K></ZAxis></EndPosition>";
  const auto metres = read_with(
      read_crcl, program(command("MoveToType", "<MoveStraight>false</MoveStraight>" + place)));
  EXPECT_NE(metres->files()[0].text.find("MOVE PTP POSE(POSITION(400.0, 0.0, 300.0)"),
            std::string::npos);
  EXPECT_EQ(read_faults(*read_with(
                read_crcl, program(command("OpenToolChangerType", "") +
                                   command("MoveToType", "<MoveStraight>true</MoveStraight>") +
                                   command("DwellType", "<DwellTime>soon</DwellTime>") +
                                   command("MessageType", "<Message>a</Message><Colour/>")))),
            "2:1 error OpenToolChangerType is not read: IRL has no counterpart.\n"
            "3:1 error MoveToType has no element EndPosition.\n"
            "4:33 error DwellTime must be a number, not \"soon\".\n"
            "5:55 error the element Colour of MessageType is not read.\n");
  EXPECT_EQ(read_faults(*read_with(read_crcl, {{"p.xml", "<a><b></a>"}})),
            "1:10 error this XML cannot be read: the element b is not closed here.\n");
}

const std::vector<RobotFile> kTrajectoryMessage{{"go.yaml", R"(# as ros2 topic echo shows it
header:
  stamp: {sec: 0, nanosec: 0}
  frame_id: ''
joint_names:
- shoulder
- elbow
- "wrist 1"
points:
- positions: [0.0, 0.5, -1.0]
  velocities: []
  time_from_start:
    sec: 1
    nanosec: 500000000
- positions:
  - 0.1
  - 0.6
  - -1.1
  velocities: [0.1, 0.0, 0.0]
  accelerations: []
  effort: []
  time_from_start: {sec: 2, nanosec: 0}
---
)"}};

TEST(ProgramReaders, JointTrajectoryBecomesIrl) {
  const auto p = read_with(read_joint_trajectory, kTrajectoryMessage);
  EXPECT_EQ(read_faults(*p),
            "19:15 warning velocities are not written: a run passes through the points at their "
            "times on its own cubics.\n");
  // Radians are degrees, and times those between points.
  expect_lines(*p, R"(
MOVE PTP MAIN_JOINT(0.0, 28.6478897565, -57.2957795131) TIME := 1.5 C_PASS := TRUE;
MOVE PTP MAIN_JOINT(5.72957795131, 34.3774677078, -63.0253574644) TIME := 0.5;
)");
  ASSERT_EQ(p->files().size(), 2U);
  // Joints of the model, and no axes of its maker.
  EXPECT_EQ(p->files()[1].text.find("R_MAKER_AXES"), std::string::npos);
  EXPECT_NE(p->files()[1].text.find("RECORD REAL: A1, A2, A3; ENDRECORD: MAIN_JOINT"),
            std::string::npos);
  const auto json = read_with(read_joint_trajectory,
                              {{"a.json",
                                "{\"joint_names\": [\"a\"], \"points\": [{\"positions\": [1], "
                                "\"time_from_start\": {\"secs\": 2, \"nsecs\": 0}}]}"}});
  EXPECT_EQ(read_faults(*json), "");
  expect_lines(*json, "MOVE PTP MAIN_JOINT(57.2957795131) TIME := 2.0;\n");
  EXPECT_EQ(read_faults(*read_with(read_joint_trajectory,
                                   {{"a.yaml",
                                     "joint_names: [a, b]\npoints:\n"
                                     "- {positions: [1], time_from_start: 1}\n"
                                     "- {positions: [1, 2], time_from_start: 2, "
                                     "effort: [3, 4]}\n"
                                     "- {positions: [1, x], time_from_start: 3}\n"}})),
            "3:15 error this point has 1 positions, and joint_names 2.\n"
            "4:51 error IRL has no efforts.\n"
            "5:19 error a number is expected here, not \"x\".\n");
  EXPECT_NE(read_faults(*read_with(read_joint_trajectory, {{"a.yaml", "a: &b 1\n"}}))
                .find("1:4 error this YAML or JSON cannot be read: the sign & of YAML is "
                      "not read in messages.\n"),
            std::string::npos);
}

TEST(ProgramReaders, WordsThatAreNotReadAreNoRoutines) {
  EXPECT_EQ(read_faults(*read_with(read_pdl2, {{"p.pdl", R"(PROGRAM p
VAR
  n, lun : INTEGER
  q : POSITION
BEGIN
  OPEN FILE lun ('NETT:', 'rw'),
    WITH $FL_BINARY = TRUE,
  ENDOPEN
  FROBNICATE(1)
  MOVEFLY LINEAR TO nowhere ADVANCE,
    WITH $FLY_TYPE = FLY_CART, $SPD_OPT = SPD_LIN,
    WITH $LIN_SPD = 0.5, $TERM_TYPE = FINE
  ENDMOVE
  n := 1
END p
)"}})),
            "6:3 error IRL has no counterpart of OPEN.\n"
            "9:3 error FROBNICATE is neither a statement nor a routine of this program.\n"
            "10:21 error the name nowhere is not declared here.\n");
  EXPECT_EQ(read_faults(*read_with(read_pacscript, {{"p.pcs", R"(Sub Main
  Frobnicate 1, 2
  Frobnicate(1)
  Call other(1)
End Sub
)"}})),
            "2:3 error Frobnicate is neither a supported statement nor a procedure here.\n"
            "3:3 error Frobnicate is neither a supported statement nor a procedure here.\n"
            "4:3 error other is not among the files; an empty routine replaces it.\n");
  EXPECT_EQ(read_faults(*read_with(read_as, {{"p.as", R"(.*=== AS GROUP ===
.*USER IF AS
.NETCONF     0.0.0.0,""
.PROGRAM p()
  FROBNICATE 1
.END
)"}})),
            "5:3 error FROBNICATE is specific to the controller and is not read.\n");
}

struct Language {
  const char* name;
  Read read;
  const std::vector<RobotFile>* sample;
};
const Language kLanguages[] = {{"krl", read_krl, &kKrl},
                               {"rapid", read_rapid, &kRapid},
                               {"urscript", read_urscript, &kUrscript},
                               {"tp", read_tp, &kTp},
                               {"melfa", read_melfa, &kMelfa},
                               {"gcode", read_gcode, &kGcode},
                               {"val3", read_val3, &kVal3Files},
                               {"as", read_as, &kAsCell},
                               {"pdl2", read_pdl2, &kPdl2Weld},
                               {"pacscript", read_pacscript, &kPacPick},
                               {"inform", read_inform, &kInformJobs},
                               {"movemaster", read_movemaster, &kMovemasterLines},
                               {"crcl", read_crcl, &kCrclProgram},
                               {"joint_trajectory", read_joint_trajectory, &kTrajectoryMessage}};

/// Everything that the host's guard asks of an answer.
void expect_sound(const ReadProgram& p, const std::vector<RobotFile>& files,
                  const std::string& what) {
  const auto lines = [](std::string_view s) {
    return static_cast<std::uint32_t>(std::count(s.begin(), s.end(), '\n')) + 1;
  };
  ASSERT_FALSE(p.files().empty()) << what;
  for (const rmp_code_fault& f : p.faults()) {
    ASSERT_LT(f.span.file, files.size()) << what;
    ASSERT_TRUE(f.span.line >= 1 && f.span.line <= lines(files[f.span.file].text)) << what;
    ASSERT_TRUE(f.span.begin <= f.span.end && f.span.end <= files[f.span.file].text.size())
        << f.message << "\n"
        << what;
  }
  std::uint32_t last = 0;
  for (const ReadLine& l : p.lines()) {
    ASSERT_TRUE(l.irl_file == 0 && l.irl_line >= last && l.irl_line <= lines(p.files()[0].text))
        << what;
    ASSERT_TRUE(l.file < files.size() && l.line >= 1 && l.line <= lines(files[l.file].text))
        << what;
    last = l.irl_line;
  }
}

TEST(ProgramReaders, WaitsThatAreLoopsBecomeWaitFor) {
  const std::string loop =
      "def p():\n  t = 0.0\n  while not get_standard_digital_in(6):\n    if t >= 2.0:\n      "
      "break\n"
      "    end\n    sync()\n    t = t + get_steptime()\n  end\n";
  const auto ur = read_with(read_urscript, {{"p.script", loop + "end\n"}});
  EXPECT_EQ(errors_of_irl(*ur), "");
  expect_lines(*ur, "WAIT FOR in_6 TIMEOUT 2.0;\n");
  // The time that it took is looked at: the loop stays.
  const auto counted = read_with(read_urscript, {{"p.script", loop + "  textmsg(t)\nend\n"}});
  expect_lines(*counted, "EXIT;\n");
  const auto krl = read_with(read_krl, {{"p.src",
                                         "DEF p( )\n$TIMER[2]=-1500\n$TIMER_STOP[2]=FALSE\n"
                                         "WAIT FOR $IN[1] OR $IN[2] OR $TIMER_FLAG[2]\n"
                                         "$TIMER_STOP[2]=TRUE\nEND\n"}});
  EXPECT_EQ(read_faults(*krl), "");
  EXPECT_EQ(errors_of_irl(*krl), "");
  expect_lines(*krl, "WAIT FOR in_1 OR in_2 TIMEOUT 1.5;\n");
  // Of another timer: none of it is a wait with a time.
  const auto other = read_with(read_krl, {{"p.src",
                                           "DEF p( )\n$TIMER[2]=-1500\n$TIMER_STOP[3]=FALSE\n"
                                           "WAIT FOR $IN[1] OR $TIMER_FLAG[2]\n"
                                           "$TIMER_STOP[2]=TRUE\nEND\n"}});
  EXPECT_NE(read_faults(*other), "");
}

TEST(ProgramReaders, KrlPlacesWithoutAnglesKeepTheOrientation) {
  // A FRAME that is declared with X, Y, Z only is a place, not one with zero angles.
  const auto p = read_with(read_krl, {{"p.src", "DEF p( )\nLIN XP1\nEND\n"},
                                      {"p.dat",
                                       "DEFDAT p PUBLIC\nDECL FRAME XP1={X 1,Y 2,Z 3}\n"
                                       "ENDDAT\n"}});
  EXPECT_EQ(read_faults(*p), "");
  expect_lines(*p, "MOVE LIN XP1.POS;\n");
  const auto written =
      read_with(read_krl, {{"p.src", "DEF p( )\nLIN XP1\nXP1.Z=5\nEND\n"},
                           {"p.dat", "DEFDAT p PUBLIC\nDECL FRAME XP1={X 1,Y 2,Z 3}\nENDDAT\n"}});
  EXPECT_NE(read_faults(*written).find("XP1 has no A, B, C in its declaration, but is assigned"),
            std::string::npos)
      << read_faults(*written);
}
/// The way in which a search stops: BRAKE and RESUME leave the routine that moves.
TEST(ProgramReaders, KrlMotionsThatAnInterruptEndsAreUntil) {
  const std::string stop = "DEF stop( )\n BRAKE F\n RESUME\nEND\n";
  const std::string go =
      "DEF go( )\n INTERRUPT ON 5\n LIN {X 1,Y 2,Z 3,A 0,B 0,C 0}\n WAIT SEC 0\n INTERRUPT OFF "
      "5\nEND\n";
  const auto p = read_with(read_krl, {{"p.src",
                                       "DEF p( )\nINTERRUPT DECL 5 WHEN $IN[3] DO stop( )\ngo( )\n"
                                       "INTERRUPT OFF 5\nEND\n" +
                                           go + stop}});
  EXPECT_EQ(read_faults(*p), "");
  expect_lines(*p, "MOVE LIN POSE(POSITION(1.0, 2.0, 3.0), ORIZYX(0.0, 0.0, 0.0)) UNTIL in_3;\n");
  // One routine cannot be ended by two conditions, and what else it stops is not known.
  const auto two =
      read_with(read_krl, {{"p.src",
                            "DEF p( )\nINTERRUPT DECL 5 WHEN $IN[3] DO stop( )\ngo( )\n"
                            "INTERRUPT DECL 5 WHEN $IN[4] DO stop( )\ngo( )\nEND\n" +
                                go + stop}});
  EXPECT_NE(read_faults(*two).find("is ended by two conditions"), std::string::npos)
      << read_faults(*two);
  const auto here = read_with(read_krl, {{"p.src",
                                          "DEF p( )\nINTERRUPT DECL 5 WHEN $IN[3] DO stop( )\n"
                                          "INTERRUPT ON 5\nLIN {X 1,Y 2,Z 3,A 0,B 0,C 0}\nEND\n" +
                                              stop}});
  EXPECT_NE(read_faults(*here).find("does not stop a single motion in a separate routine"),
            std::string::npos)
      << read_faults(*here);
  // Without RESUME the motion goes on behind the routine.
  const auto held =
      read_with(read_krl, {{"p.src", "DEF p( )\nhold( )\nEND\nDEF hold( )\nBRAKE\nEND\n"}});
  EXPECT_EQ(read_faults(*held), "");
  expect_lines(*held, "BRAKE(1);\n");
}
TEST(ProgramReaders, MelfaTransitionsEndWithCnt0) {
  const auto p = read_with(read_melfa, {{"p.prg",
                                         "1 Cnt 1,25,25\n2 Mvs P1\n3 Cnt 0\n4 Mvs P2\n5 End\n"
                                         "P1=(1,2,3,0,0,0)(7,0)\nP2=(4,5,6,0,0,0)(7,0)\n"}});
  EXPECT_EQ(read_faults(*p), "");
  expect_lines(*p, "present_continuous_distance := 25.0;\npresent_continuous_distance := 0.0;\n");
}
// What the controller has by itself is read or refused, never taken for a user's empty routine.
TEST(ProgramReaders, WordsOfTheMakerAreNoRoutinesOfUsers) {
  struct Case {
    Read read;
    RobotFile file;
    const char* faults;
  };
  const Case cases[] = {
      {read_rapid,
       {"p.mod",
        "MODULE p\nPROC main()\nIOEnable;\nEOffsOff;\nWrite "
        "\"on\";\nmine;\nENDPROC\nENDMODULE\n"},
       "3:1 error IOEnable is specific to the controller and is not read.\n"
       "4:1 error EOffsOff is specific to the controller and is not read.\n"
       "5:1 warning Write is specific to the controller and moves nothing; it was left out.\n"
       "6:1 error mine is not among the files; an empty routine replaces it.\n"},
      {read_krl,
       {"p.src", "DEF p()\nSYNCMD(1)\nmine()\nEND\n"},
       "2:1 error SYNCMD is specific to the controller and is not read.\n"
       "3:1 error mine is not among the files; an empty routine replaces it.\n"}};
  for (const Case& c : cases)
    EXPECT_EQ(read_faults(*read_with(c.read, {c.file})), c.faults) << c.file.text;
}

TEST(ProgramReaders, TpRegistersThatAreSetInPartOrFromThemselvesAreUnknown) {
  const auto faults = [](const std::string& lines) {
    return read_faults(*read_with(
        read_tp,
        {{"q.ls", "/PROG Q\n/ATTR\nDEFAULT_GROUP = 1,*,*,*,*;\n/MN\n" + lines + "/POS\n/END\n"}}));
  };
  const std::string move = "7:UFRAME_NUM=0 ;\n8:L PR[3] 100mm/sec FINE ;\n";
  EXPECT_NE(faults("1: PR[3,3]=PR[3,3]+10 ;\n" + move).find("error PR[3] is set on the controller"),
            std::string::npos);
  EXPECT_NE(faults("1: PR[3,1]=500 ;\n" + move).find("error PR[3] is set on the controller"),
            std::string::npos);
  EXPECT_EQ(
      faults("1: PR[3,1]=500 ;\n2: PR[3,2]=0 ;\n3: PR[3,3]=300 ;\n4: PR[3,4]=180 ;\n5: PR[3,5]=0 "
             ";\n6: PR[3,6]=0 ;\n" +
             move),
      "");
  EXPECT_NE(faults("1: R[7]=R[7]+1 ;\n").find("warning R[7] is not set by any program here"),
            std::string::npos);
  EXPECT_EQ(faults("1: R[7]=0 ;\n2: R[7]=R[7]+1 ;\n"), "");
}

TEST(ProgramReaders, RapidSpeedsAndZonesAreAssignedAsLists) {
  const auto p = read_with(read_rapid, {{"s.mod", R"(MODULE M
  VAR speeddata s;
  VAR zonedata z;
  PROC main()
    s := [400, 500, 400, 400];
    z := [FALSE,10,15,15,1.5,15,1.5];
    MoveL [[500,0,300],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]], s, z, tool0;
    z := [TRUE,10,15,15,1.5,15,1.5];
  ENDPROC
ENDMODULE
)"}});
  EXPECT_EQ(read_faults(*p).find("error"), std::string::npos) << read_faults(*p);
  expect_lines(*p, "s := 400.0;\nz := 10.0;\n");
  expect_lines(*p, "z := 0.0;\n");
}

TEST(ProgramReaders, NotOfRapidStandsBeforeALogicalTerm) {
  const auto p = read_with(read_rapid, {{"n.mod", R"(MODULE M
  VAR bool b;
  VAR bool c;
  VAR num n;
  PROC main()
    c := NOT b AND n > 3;
    c := NOT b OR n > 3;
    c := n > 3 AND NOT b;
    c := NOT n > 3;
  ENDPROC
ENDMODULE
)"}});
  EXPECT_EQ(read_faults(*p).find("error"), std::string::npos) << read_faults(*p);
  expect_lines(*p, R"(
c := NOT (b AND n > 3);
c := NOT b OR n > 3;
c := n > 3 AND NOT b;
c := NOT n > 3;
)");
}

TEST(ProgramReaders, GcodeBeginsWhereTheRobotIs) {
  const auto p = read_with(
      read_gcode,
      {{"p.ngc", "G21 G90 F600\nG0 Z50\nG91 G1 X-5\nG90 G2 X10 Y10 R20\nG0 X1 Y2\nG1 Z5\nM2\n"}});
  EXPECT_EQ(read_faults(*p), "4:1 error the start of this arc is unknown.\n");
  expect_lines(*p, R"(
MOVE PTP POSITION(R_ROBTARGET_ACT.PSE.POS.X, R_ROBTARGET_ACT.PSE.POS.Y, 50.0);
MOVE LIN POSITION(R_ROBTARGET_ACT.PSE.POS.X - 5.0, R_ROBTARGET_ACT.PSE.POS.Y, 50.0) SPEED := 10.0;
MOVE PTP POSITION(1.0, 2.0, 50.0);
MOVE LIN POSITION(1.0, 2.0, 5.0) SPEED := 10.0;
)");
}

TEST(ProgramReaders, GcodeArcsWithoutAnEndGoAllTheWayRound) {
  const auto p = read_with(
      read_gcode, {{"p.ngc", "G21 G90 F600\nG0 X20 Y10 Z5\nG2 I-10 J0\nI0 J5\nG2 R4\nM2\n"}});
  EXPECT_EQ(read_faults(*p), "5:1 error no arc with this radius reaches the end point.\n");
  expect_lines(*p, R"(
MOVE PTP POSITION(20.0, 10.0, 5.0);
MOVE CIRCLE POSITION(10.0, 0.0, 5.0), POSITION(0.0, 10.0, 5.0) SPEED := 10.0;
MOVE CIRCLE POSITION(10.0, 20.0, 5.0), POSITION(20.0, 10.0, 5.0) SPEED := 10.0;
MOVE CIRCLE POSITION(15.0, 15.0, 5.0), POSITION(20.0, 20.0, 5.0) SPEED := 10.0;
MOVE CIRCLE POSITION(25.0, 15.0, 5.0), POSITION(20.0, 10.0, 5.0) SPEED := 10.0;
)");
}

TEST(ProgramReaders, GcodeDwellsOfManySecondsAreTold) {
  EXPECT_EQ(read_faults(*read_with(read_gcode, {{"p.ngc", "G4 P500\nG4 P9\nM2\n"}})),
            "1:4 warning P of a dwell is taken as seconds, as in LinuxCNC and Grbl.\n");
  EXPECT_EQ(read_faults(*read_with(read_gcode, {{"p.ngc", "G4 P0.5\nG4 S20\nM2\n"}})), "");
}

TEST(ProgramReaders, GcodeWaitsOfAMillionSecondsHaveNoEnd) {
  const auto p = read_with(read_gcode, {{"p.ngc", "M66 P2 L3 Q1000000\nM66 P2 L4 Q999\nM2\n"}});
  EXPECT_EQ(read_faults(*p), "");
  expect_lines(*p, "WAIT FOR in_2 = TRUE;\nWAIT FOR in_2 = FALSE TIMEOUT 999.0;\n");
}

// A backup: two programs with points of one name, a file of global routines, and global data.
const std::vector<RobotFile> kKrlBackup{{"cell.src", R"(DEF cell( )
DECL INT n
$TOOL={X 0,Y 0,Z 100,A 0,B 0,C 0}
$BASE={X 1,Y 2,Z 3,A 0,B 0,C 0}
n=2
PTP XP1
weld(n,5)
LIN XP1
n=twice(n)
LIN above
own()
hidden()
nowhere(n)
LIN secret
END
DEF own( )
$OUT[4]=TRUE
END
)"},
                                        {"cell.dat", R"(DEFDAT cell
DECL FRAME XP1={X 500,Y 0,Z 300,A 0,B 90,C 0}
ENDDAT
)"},
                                        {"weld.src", R"(DEF weld(k:OUT,by:IN)
DECL INT k,by
LIN XP1
k=k+by
own()
END
DEF own( )
$OUT[5]=TRUE
END
DEF never( )
TRIGGER WHEN DISTANCE=0 DELAY=0 DO $OUT[9]=TRUE
END
)"},
                                        {"weld.dat", R"(DEFDAT weld
DECL FRAME XP1={X 600,Y 0,Z 200,A 0,B 90,C 0}
DECL STRANGE_T nothing={A 1}
DECL FRAME secret={X 1,Y 1,Z 1,A 0,B 0,C 0}
ENDDAT
)"},
                                        {"lib.src", R"(DEF lib( )
END
GLOBAL DEFFCT INT twice(x:IN)
DECL INT x
RETURN 2*x
ENDFCT
DEF hidden( )
END
)"},
                                        {"points.dat", R"(DEFDAT points PUBLIC
DECL GLOBAL FRAME above={X 500,Y 0,Z 400,A 0,B 90,C 0}
above.Z=450
DECL FRAME own={X 9,Y 9,Z 9,A 0,B 0,C 0}
ENDDAT
)"}};

TEST(ProgramReaders, KrlFilesOfABackupAreOneProgram) {
  const auto p = read_with(read_krl, kKrlBackup);
  EXPECT_EQ(read_faults(*p),
            "12:1 error hidden is declared in another file, which keeps it to itself.\n"
            "13:1 error nowhere is not among the files; an empty routine replaces it.\n"
            "14:5 error secret is declared in another file, which keeps it to itself.\n");
  expect_lines(*p, R"(
POSE: above := POSE(POSITION(500.0, 0.0, 400.0), ORIZYX(0.0, 90.0, 0.0));
POSE: XP1 := POSE(POSITION(500.0, 0.0, 300.0), ORIZYX(0.0, 90.0, 0.0));
PROCEDURE own ();
out_4 := TRUE;
PROCEDURE weld (INOUT INT: k; IN INT: by);
MOVE LIN XP1_weld TOOL := present_tool FRAME := present_frame;
k := k + by;
own_weld();
PROCEDURE own_weld ();
out_5 := TRUE;
FUNCTION twice (IN INT: x): INT;
RETURN 2 * x;
above.POS.Z := 450.0;
n := 2;
MOVE PTP XP1 TOOL := present_tool FRAME := present_frame;
weld(n, 5);
MOVE LIN XP1 TOOL := present_tool FRAME := present_frame;
n := twice(n);
MOVE LIN above TOOL := present_tool FRAME := present_frame;
own();
)");
  const std::string_view irl = p->files()[0].text;
  EXPECT_NE(irl.find("XP1_weld := POSE(POSITION(600.0, 0.0, 200.0)"), std::string::npos) << irl;
  EXPECT_EQ(irl.find("never"), std::string::npos) << irl;
}

TEST(ProgramReaders, KrlNamesOfABackupAreAskedForAndOffered) {
  const auto joined = [](std::vector<std::string> all) {
    std::sort(all.begin(), all.end());
    std::string out;
    for (const std::string& s : all) out += (out.empty() ? "" : " ") + s;
    return out;
  };
  std::map<std::string, std::string> text;
  for (const RobotFile& f : kKrlBackup) text[f.name] = f.text;
  const auto offers = [&](const char* name) {
    return joined(krl_offers(SourceFile{name, text[name], {}}));
  };
  EXPECT_EQ(offers("cell.src"), "cell");
  EXPECT_EQ(offers("lib.src"), "lib twice");
  EXPECT_EQ(offers("weld.dat"), "weld.dat");
  EXPECT_EQ(offers("points.dat"), "above points.dat");
  const auto needs = krl_needs(SourceFile{"cell.src", text["cell.src"], {}});
  for (const char* n : {"cell.dat", "System/$config.dat", "@weld", "@twice", "@above", "@nowhere"})
    EXPECT_NE(std::find(needs.begin(), needs.end(), n), needs.end()) << n;
  for (const char* n : {"@n", "@own", "@cell"})
    EXPECT_EQ(std::find(needs.begin(), needs.end(), n), needs.end()) << n;
}

TEST(ProgramReaders, KrlImportsEnumeratorsAndTheSubmitInterpreter) {
  const auto p = read_with(read_krl, {{"a.src", R"(DEF a( )
IMPORT FRAME mine IS /R1/b..theirs
IF state==#GREEN THEN
$OUT[3]=TRUE
ENDIF
IF other==#BLUE THEN
$OUT[2]=flagged
ENDIF
LIN mine
END
)"},
                                      {"b.dat", R"(DEFDAT b PUBLIC
ENUM light RED,GREEN
ENUM paint GREEN,BLUE
DECL FRAME theirs={X 1,Y 2,Z 3,A 0,B 0,C 0}
ENDDAT
)"},
                                      {"a.dat", R"(DEFDAT a
ENUM light RED,GREEN
ENUM paint GREEN,BLUE
DECL light state=#RED
DECL paint other=#BLUE
DECL BOOL flagged=FALSE
ENDDAT
)"},
                                      {"sps.sub", R"(DEF SPS ( )
DECL INT own
LOOP
own=1
$OUT[3]=$IN[7]
$OUT[8]=TRUE
flagged=$IN[8]
ENDLOOP
END
)"}});
  EXPECT_EQ(read_faults(*p),
            "5:1 error the submit interpreter sets $OUT[3] here while the program runs.\n"
            "7:1 error the submit interpreter sets flagged here while the program runs.\n");
  expect_lines(*p, R"(
INT: red := 1;
INT: green := 2;
INT: blue := 3;
IF state = green THEN
MOVE LIN theirs;
)");
}

TEST(ProgramReaders, RapidLocalNamesAreThoseOfTheirModule) {
  const auto p = read_with(read_rapid, {{"m.mod", R"(MODULE M
  LOCAL CONST robtarget p1:=[[1,2,3],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    MoveL p1, v100, fine, tool0;
    other;
  ENDPROC
ENDMODULE
)"},
                                        {"n.mod", R"(MODULE N
  LOCAL CONST robtarget p1:=[[4,5,6],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC other()
    MoveL p1, v100, fine, tool0;
  ENDPROC
ENDMODULE
)"}});
  EXPECT_EQ(read_faults(*p), "");
  expect_lines(*p, R"(
PROCEDURE other ();
MOVE LIN p1_n SPEED := 100.0;
MOVE LIN p1_m SPEED := 100.0;
)");
  const std::string m =
      "MODULE M\nLOCAL VAR num a;\nVAR num b;\nPROC q()\nVAR num c;\nd;\nENDPROC\n"
      "ENDMODULE\n";
  EXPECT_EQ(rapid_offers(SourceFile{"m.mod", m, {}}), (std::vector<std::string>{"b", "q"}));
  const auto needs = rapid_needs(SourceFile{"m.mod", m, {}});
  EXPECT_NE(std::find(needs.begin(), needs.end(), "@d"), needs.end());
  EXPECT_EQ(std::find(needs.begin(), needs.end(), "@a"), needs.end());
}

TEST(ProgramReaders, Val3OfVersion6IsNamed) {
  const auto p =
      read_with(read_val3,
                {{"a.pjx",
                  "<project xmlns=\"ProjectNameSpace\"><programSection><program file=\"start.pgx\" "
                  "/></programSection></project>"},
                 {"start.pgx",
                  "<programList xmlns=\"ProgramNameSpace\"><program name=\"start\"><source>"
                  "<code>begin\nend</code></source></program></programList>"}});
  EXPECT_EQ(read_faults(*p),
            "1:1 error this program is in the format of VAL 3 s6 (CS8C), which is not read.\n");
}

// What a routine declares itself is not looked for in other modules; what it uses is, also where
// another routine has a name like that.
TEST(ProgramReaders, RapidAsksOtherModulesOnlyForWhatARoutineLacks) {
  const auto asks = [](const std::string& routines, const char* name) {
    const auto needs =
        rapid_needs(SourceFile{"m.mod", "MODULE m\n" + routines + "ENDMODULE\n", {}});
    return std::find(needs.begin(), needs.end(), std::string("@") + name) != needs.end();
  };
  const std::string own =
      "PROC a(num given, INOUT num list{*}, \\switch on | \\switch off)\nVAR num mine;\n"
      "FOR count FROM 1 TO 3 DO\nmine := given + list{count} + theirs;\nENDFOR\n"
      "GOTO ready;\nready:\nENDPROC\n";
  for (const char* n : {"given", "list", "on", "off", "mine", "count", "ready", "a"})
    EXPECT_FALSE(asks(own, n)) << n;
  EXPECT_TRUE(asks(own, "theirs"));
  // A counter hides a name only within its loop, VAR only in its routine.
  EXPECT_TRUE(asks("PROC a()\nFOR i FROM 1 TO 2 DO\nENDFOR\ng i;\nENDPROC\n", "i"));
  EXPECT_TRUE(asks("PROC a()\nVAR num x;\nx := 1;\nENDPROC\nPROC b()\nx := 2;\nENDPROC\n", "x"));
  // Components of a record are no names, their types are.
  const std::string record = "RECORD part\npos place;\nkind sort;\nENDRECORD\n";
  EXPECT_TRUE(asks(record, "kind"));
  EXPECT_FALSE(asks(record, "sort"));
}

TEST(ProgramReaders, WhereTheRobotIsIsReadInTheToolAndFrameThatAreSet) {
  struct Case {
    const char* what;
    Read read;
    RobotFile file;
    const char* faults;
    const char* irl;
  };
  const std::string krl_head = "DEF p()\nDECL E6POS x\nDECL E6AXIS a\n";
  const std::string krl_frames =
      "$TOOL={X 0,Y 0,Z 100,A 0,B 0,C 0}\n$BASE={X 1,Y 0,Z 0,A 0,B 0,C 0}\n";
  const std::string krl_reads =
      "x=$POS_ACT\na=$AXIS_ACT\nIF $POS_ACT.Z>3 THEN\nENDIF\n$POS_ACT=x\n";
  const std::string tp = "/PROG P\n/MN\n1:  UFRAME_NUM=0 ;\n2:  UTOOL_NUM=0 ;\n";
  const Case cases[] = {
      {"KRL with tool and base",
       read_krl,
       {"p.src", krl_head + krl_frames + krl_reads + "END\n"},
       "10:1 error $POS_ACT is where the robot is, and gets no value.\n",
       "x := with_pose(R_ROBTARGET_ACT, INV(present_frame) @ R_FLANGE_ACT @ present_tool);\n"
       "a := R_JOINT_ACT.M_JOINT;\n"},
      {"KRL with the robot's own tool",
       read_krl,
       {"p.src", krl_head + "x=$POS_ACT\nIF $POS_ACT.Z>3 THEN\nENDIF\nEND\n"},
       "",
       "x := R_ROBTARGET_ACT;\nIF R_ROBTARGET_ACT.PSE.POS.Z > 3 THEN\n"},
      {"RAPID",
       read_rapid,
       {"p.mod",
        "MODULE p\nPERS tooldata t:=[TRUE,[[0,0,100],[1,0,0,0]],[1,[0,0,1],[1,0,0,0],0,0,0]];\n"
        "VAR robtarget r;\nVAR jointtarget j;\nPROC main()\nr:=CRobT(\\Tool:=t "
        "\\WObj:=wobj0);\nj:=CJointT();\nENDPROC\nENDMODULE\n"},
       "",
       "r := with_pose(R_ROBTARGET_ACT, R_FLANGE_ACT @ t);\nj := R_JOINT_ACT.M_JOINT;\n"},
      {"TP",
       read_tp,
       {"p.ls", tp + "3:  PR[1]=LPOS ;\n4:  PR[1,3]=PR[1,3]+10 ;\n/POS\n/END\n"},
       "",
       "PR[1] := with_pose(R_ROBTARGET_ACT, R_FLANGE_ACT @ POSE(POSITION(0.0, 0.0, 0.0), "
       "ORIQUAT(1.0, 0.0, 0.0, 0.0))).PSE;\nPR[1].POS.Z := PR[1].POS.Z + 10;\n"},
      {"MELFA-BASIC",
       read_melfa,
       {"p.prg", "1 P1=P_Curr\n2 P1.Z=P1.Z+10\n3 J1=J_Curr\n"},
       "",
       "P1 := R_ROBTARGET_ACT;\nJ1 := R_JOINT_ACT.M_JOINT;\n"},
      {"URScript",
       read_urscript,
       {"p.script",
        "def p():\n  a = get_actual_tcp_pose()\n  q = get_actual_joint_positions()\nend\n"},
       "",
       "a := R_ROBTARGET_ACT.PSE;\nq := R_JOINT_ACT.M_JOINT;\n"},
      {"AS",
       read_as,
       {"p.as", ".PROGRAM p()\nHERE a\nHERE #b\n.END\n"},
       "",
       "a := R_ROBTARGET_ACT.PSE;\nb := R_JOINT_ACT.M_JOINT;\n"},
      {"PacScript",
       read_pacscript,
       {"p.pcs", "Sub Main\nP1 = CurPos\nJ1 = CurJnt\nEnd Sub\n"},
       "",
       "P1 := R_ROBTARGET_ACT;\nJ1 := R_JOINT_ACT.M_JOINT;\n"}};
  for (const Case& c : cases) {
    SCOPED_TRACE(c.what);
    const auto p = read_with(c.read, {c.file});
    EXPECT_EQ(read_faults(*p), c.faults);
    expect_lines(*p, c.irl);
  }
}

TEST(ProgramReaders, TakeAnyTextWithoutACrash) {
  const auto deep = [](const std::string& open, std::size_t n) {
    std::string s;
    for (std::size_t i = 0; i < n; ++i) s += open;
    return s;
  };
  for (const Language& l : kLanguages)
    for (const std::string& text :
         {std::string(), std::string("\n"), std::string(100, '\0'), std::string("\xff\xfe\x80"),
          deep("(", 3000), deep("{", 3000), deep("IF a THEN ", 3000), deep("x = [", 3000),
          deep("\n1:", 3000), deep("-", 3000), deep("NOT ", 3000), deep("DEF a()\n", 500),
          deep("def a():\n", 500), deep("<", 50000), deep("1e308*", 3000),
          std::string(300000, 'a')}) {
      const std::vector<RobotFile> files{{(*l.sample)[0].name, text}};
      const auto begin = std::chrono::steady_clock::now();
      const auto p = read_with(l.read, files);
      ASSERT_TRUE(p);
      const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
      EXPECT_LT(took.count(), 10.0) << l.name << ": " << text.substr(0, 80);
      expect_sound(*p, files, std::string(l.name) + ": " + text.substr(0, 80));
    }
}

/// A text that is none of the language: read without a crash, and said at a place, with what to do.
TEST(ProgramReaders, WrongInputIsAFaultWithALineAndAHint) {
  const std::string line(std::size_t{1} << 20, 'x');
  std::string deep, binary;
  for (int i = 0; i < 100'000; ++i) deep += "((";
  std::mt19937 random(7);
  for (int i = 0; i < 50'000; ++i) binary += static_cast<char>(random() % 255 + 1);
  for (const Language& l : kLanguages) {
    const std::string whole = (*l.sample)[0].text;
    const std::vector<std::pair<const char*, std::string>> kWrong{
        {"empty", ""},
        {"blank", " \r\n\t\n"},
        {"a line of 1 MB", line},
        {"deep", deep},
        {"binary", binary},
        {"half", whole.substr(0, whole.size() / 2)},
        {"deep behind it", whole + deep}};
    for (const auto& [what, text] : kWrong) {
      SCOPED_TRACE(std::string(l.name) + ": " + what);
      const std::vector<RobotFile> files{{(*l.sample)[0].name, text}};
      const auto begin = std::chrono::steady_clock::now();
      const auto p = read_with(l.read, files);
      ASSERT_TRUE(p);
      const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
      EXPECT_LT(took.count(), 10.0);
      expect_sound(*p, files, what);
      std::size_t said = 0, hints = 0;
      for (const rmp_code_fault& f : p->faults()) {
        if (f.severity == RMP_FAULT_NOTE) continue;
        ++said;
        hints += *f.hint != 0;
        EXPECT_STRNE(f.message, "");
        EXPECT_LT(std::string_view(f.message).size(), 1000U);
        EXPECT_GE(f.span.column, 1U);
      }
      EXPECT_GT(said, 0U) << p->files()[0].text.substr(0, 300);
      EXPECT_LT(said, 10'000U);
      if (said > 0) {
        EXPECT_GT(hints, 0U) << p->faults()[0].span.line << ": " << p->faults()[0].message;
      }
    }
  }
}

/// What is read without an error compiles, up to one text in a hundred (a second ELSE, a speed that
/// is computed and below zero: IRL's own check says so); and of what has errors nearly all does.
TEST(ProgramReaders, ChangedTextsAreReadOrRefusedAndTheIrlIsRight) {
  const std::uint32_t seed = test::seed();
  std::mt19937 random(seed);
  static constexpr const char* kTokens[] = {
      "IF ", "END", "(",    ")",     "[",       "]",          "{",        "}",    "=",
      ":=",  ",",   ";",    "\n",    "1e999",   "-1",         "9E9",      "TRUE", "\"",
      "'",   "P1",  "LIN ", "WAIT ", "CALL ",   "FOR ",       "def x():", "\xff", "G2",
      "$",   "#",   "&",    "]]>",   "<Value ", "99999999999"};
  std::map<std::string, std::string> wrong;
  for (const Language& l : kLanguages) {
    std::vector<std::string> all;
    for (const RobotFile& f : *l.sample) all.push_back(f.text);
    test::Mutator mutator(random, all, kTokens);
    const auto until = std::chrono::steady_clock::now() + std::chrono::milliseconds(700);
    int rounds = 0, wrong_irl = 0, broken = 0;
    while (std::chrono::steady_clock::now() < until) {
      std::vector<RobotFile> files = *l.sample;
      RobotFile& f = files[std::uniform_int_distribution<std::size_t>(0, files.size() - 1)(random)];
      f.text = mutator.mutate(f.text);
      const auto begin = std::chrono::steady_clock::now();
      const auto p = read_with(l.read, files);
      ASSERT_TRUE(p) << "seed " << seed;
      expect_sound(*p, files,
                   std::string(l.name) + " seed " + std::to_string(seed) + "\n" + f.text);
      const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
      ASSERT_LT(took.count(), 5.0) << l.name << " seed " << seed << "\n" << f.text;
      const std::string errors = errors_of_irl(*p);
      ++rounds;
      const bool is_read =
          std::none_of(p->faults().begin(), p->faults().end(),
                       [](const rmp_code_fault& x) { return x.severity == RMP_FAULT_ERROR; });
      broken += !errors.empty();
      if (!errors.empty() && is_read && wrong_irl++ < 1)
        wrong[l.name] = errors + "\n" + f.text + "\n->\n" + std::string(p->files()[0].text);
    }
    RecordProperty(std::string(l.name) + "_rounds", rounds);
    EXPECT_LE(broken, 1 + rounds / 5) << l.name;
    std::cout << l.name << ": " << rounds << " texts, the IRL of " << broken << " has errors\n";
    EXPECT_LE(wrong_irl, 1 + rounds / 100)
        << l.name << ": " << wrong_irl << " of " << rounds << ", seed " << seed << "\n"
        << wrong[l.name];
  }
}

TEST(ProgramReaders, GrowthIsLinear) {
  for (const Language& l : kLanguages) {
    const auto time_of = [&](int n) {
      std::string s;
      const std::string name = l.name;
      if (name == "krl") {
        s = "DEF p()\n";
        for (int i = 0; i < n; ++i) s += "LIN {X " + std::to_string(i) + ",Y 0,Z 0,A 0,B 0,C 0}\n";
        s += "END\n";
      } else if (name == "rapid") {
        s = "MODULE m\nPROC main()\n";
        for (int i = 0; i < n; ++i)
          s += "MoveL [[" + std::to_string(i) +
               ",0,0],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,fine,tool0;\n";
        s += "ENDPROC\nENDMODULE\n";
      } else if (name == "urscript") {
        for (int i = 0; i < n; ++i) s += "movel(p[" + std::to_string(i) + ",0,0,0,0,0], v=0.1)\n";
      } else if (name == "tp") {
        s = "/PROG P\n/MN\n";
        for (int i = 0; i < n; ++i) s += " 1:L P[1] 100mm/sec FINE ;\n";
        s += "/POS\nP[1]{ GP1: CONFIG : 'N U T, 0, 0, 0', X = 1 mm, Y = 2 mm, Z = 3 mm, W = 0 deg, "
             "P = 0 deg, R = 0 deg };\n/END\n";
      } else if (name == "melfa") {
        for (int i = 0; i < n; ++i) s += "Mvs P1\n";
        s += "P1=(1,2,3,0,0,0)(7,0)\n";
      } else if (name == "gcode") {
        for (int i = 0; i < n; ++i) s += "G1 X" + std::to_string(i) + " Y0 Z0 F100\n";
      } else if (name == "as") {
        s = ".PROGRAM p()\n";
        for (int i = 0; i < n; ++i)
          s += "SPEED 10\nLMOVE TRANS(" + std::to_string(i) + ",0,0,0,0,0)\nx = x + 1\n";
        s += ".END\n";
      } else if (name == "pdl2") {
        s = "PROGRAM p\nBEGIN\n";
        for (int i = 0; i < n; ++i)
          s += "MOVE LINEAR TO POS(" + std::to_string(i) + ",0,0,0,0,0,'S')\n";
        s += "END p\n";
      } else if (name == "pacscript") {
        s = "Sub Main\n";
        for (int i = 0; i < n; ++i) s += "Move L, P(" + std::to_string(i) + ",0,0,0,0,0,5)\n";
        s += "End Sub\n";
      } else if (name == "inform") {
        s = "/JOB\n//NAME P\n//POS\n///POSTYPE BASE\nC00000=1,2,3,4,5,6\n//INST\nNOP\n";
        for (int i = 0; i < n; ++i) s += "MOVL C00000 V=10.0 PL=0\n";
        s += "END\n";
      } else if (name == "movemaster") {
        s = "PD 1,300,0,200,-90,0\n";
        for (int i = 0; i < std::min(n, 9000); ++i) s += std::to_string(i + 1) + " MO 1\n";
      } else if (name == "crcl") {
        s = "<CRCLProgram>\n";
        for (int i = 0; i < n; ++i)
          s += "<MiddleCommand type=\"DwellType\"><DwellTime>1</DwellTime></MiddleCommand>\n";
        s += "</CRCLProgram>\n";
      } else if (name == "joint_trajectory") {
        s = "joint_names: [a]\npoints:\n";
        for (int i = 0; i < n; ++i)
          s += "- {positions: [1], time_from_start: " + std::to_string(i + 1) + "}\n";
      } else {
        s = "<Programs><Program name=\"start\"><Code><![CDATA[begin\n";
        for (int i = 0; i < n; ++i) s += "delay(1)\n";
        s += "end]]></Code></Program></Programs>";
      }
      const std::vector<RobotFile> files{{name == "val3" ? "start.pgx" : (*l.sample)[0].name, s}};
      const std::clock_t begin = std::clock();
      const auto p = read_with(l.read, files);
      return static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
    };
    time_of(100);
    // A square would take a hundred times as long. What takes longer than 40 times is measured
    // again, for a machine that did something else meanwhile.
    double small = time_of(1000), large = time_of(10000);
    constexpr int kTries = 4;
    for (int t = 0; t < kTries && large > 40 * small + 0.05; ++t) {
      small = time_of(1000);
      large = time_of(10000);
    }
    EXPECT_LT(large, 40 * small + 0.05) << l.name;
    RecordProperty(std::string(l.name) + "_10000_lines_ms", static_cast<int>(large * 1000));
  }
}

}  // namespace
}  // namespace robomosp::readers
