// SPDX-License-Identifier: Apache-2.0
// The post for PacScript: golden text, a reader of its own, every construct, wrong input, growth.
#include "support/post_run.h"

#include "pacscript.h"

namespace robomosp::post_run {
namespace {

const post::pacscript::PacScript kPac;

Station fast() {
  Station s;
  s.profile.max_speed = 1000;
  return s;
}
/// Reads a file again; speeds are shares of 1000 mm/s.
std::vector<Read> read_pacscript(const Output& o) {
  std::vector<Read> out;
  for (const std::string& l : lines(o.only())) {
    const std::size_t at = l.find("Move ");
    if (at == std::string::npos) continue;
    const char verb = l[at + 5];
    const double speed = std::stod(l.substr(l.find("Speed = ") + 8));
    std::size_t open = at;
    std::vector<Read> here;
    while ((open = l.find('(', open + 1)) != std::string::npos) {
      const auto n = numbers(l.substr(open, l.find(')', open) - open));
      Read r;
      r.speed = verb == 'P' ? speed : speed * 10;
      if (l[open - 1] == 'J') {
        r.kind = "joints";
        r.numbers = n;
      } else {
        r.kind = verb == 'P' ? "ptp" : verb == 'L' ? "lin" : here.empty() ? "via" : "circle";
        r.numbers = {n[0], n[1], n[2]};
        r.R = times(times(about(2, n[5]), about(1, n[4])), about(0, n[3]));
      }
      here.push_back(r);
    }
    out.insert(out.end(), here.begin(), here.end());
  }
  return out;
}

TEST(PostPacScript, WritesOneFile) {
  const Output o = run(kPac, pick(), fast());
  EXPECT_EQ(o.faults, "");
  EXPECT_NE(o.only().find("\r\n"), std::string::npos);
  EXPECT_EQ(unix_text(o.only()), R"('!TITLE "prog"
Dim good As Long

Sub Main
  TakeArm Keep = 0
  good = 0
  ChangeTool 0
  ChangeWork 0
  Move P, @0 J(0.0000, -90.0000, 90.0000, 0.0000, 90.0000, 0.0000), Speed = 60.000
  Do While good < 5
    Wait IO[1] = On, 2000
    ChangeTool 0
    ChangeWork 0
    Move P, @0 P(550.000, -300.000, 200.000, 10.0000, 20.0000, 30.0000, -1), Speed = 100.000
    Move L, @0 P(587.852, -298.197, 292.542, 10.0000, 20.0000, 30.0000, -1), Speed = 8.00000
    Set IO[3]
    Delay 250
    Move L, @10 P(550.000, -300.000, 200.000, 10.0000, 20.0000, 30.0000, -1), Speed = 40.00000
    Move C, P(600.000, 0.000, 200.000, 10.0000, 20.0000, 30.0000, -1), @0 P(550.000, 300.000, 80.000, 180.0000, 0.0000, -90.0000, -1), Speed = 40.00000
    Reset IO[3]
    good = good + 1
  Loop
  GiveArm
End Sub
)");
}
TEST(PostPacScript, MotionsAreReadAgain) {
  for (const unsigned seed : {1U, 2U, 3U}) {
    const Motions m = straight_program(200, seed, true, true);
    expect_same(read_pacscript(run(kPac, m.source, fast())), m.meant);
  }
}
TEST(PostPacScript, FiguresToolsWorksAndRoutines) {
  Station s = fast();
  PostAxis outer;
  outer.joint = 0;
  outer.external = outer.linear = true;
  s.axes = {outer};
  const Output o = run(kPac, R"(PROGRAM p;
SIGNAL INPUT BOOL: ok AT 7; OUTPUT INT: lamp AT 10, 4; INPUT INT: code AT 20, 3;
VAR ROBTARGET: a := ROBTARGET(POSE(POSITION(100.0, 0.0, 50.0), ORIZYX(0.0, 0.0, 0.0)), 5, [0, 0], ADD_JOINT(250.0));
  ARRAY [1..2] OF REAL: heights := [1.5, 2.5]; POSE: cell;
FUNCTION spot (IN INT: n): POSE;
BEGIN
  RETURN cell @ POSE(POSITION(0.0, 0.0, heights[n]), ORIZYX(heights[n], 180.0, 0.0));
ENDFCT;
BEGIN
  cell.POS.X := 300.0;
  MOVE PTP a SPEED_PTP := 50.0, C_PTP := 20.0, TOOL := POSE(POSITION(0.0, 0.0, 100.0), ORIZYX(0.0, 0.0, 0.0));
  MOVE LIN spot(2) SPEED := 250.0, FRAME := INV(cell);
  MOVE_INC LIN POSE(POSITION(0.0, 0.0, 80.0), ORIZYX(0.0, 0.0, 0.0));
  lamp := code;
  LOOP
    WAIT FOR ok TIMEOUT 1.5;
    IF R_TIMEOUT THEN EXIT; ENDIF;
  ENDLOOP;
ENDPROGRAM;)",
                       s);
  EXPECT_EQ(unix_text(o.only()), R"('!TITLE "prog"
Dim R_TIMEOUT As Boolean
Dim heights(2) As Double
Dim cell As Position
Dim part As Long

Sub Main
  TakeArm Keep = 0
  R_TIMEOUT = False
  heights(0) = 1.5
  heights(1) = 2.5
  cell = P(0.000, 0.000, 0.000, 0.0000, 0.0000, 0.0000, -1)
  LetX cell = 300.0
  Tool 1, P(0.000, 0.000, 100.000, 0.0000, 0.0000, 0.0000)
  ChangeTool 1
  ChangeWork 0
  Move P, @20 P(100.000, 0.000, 50.000, 0.0000, 0.0000, 0.0000, 0) EXA((7, 250.0000)), Speed = 50.000
  ChangeTool 0
  Work 1, T2P(TInv(P2T(cell)))
  ChangeWork 1
  Move L, @0 spot(2), Speed = 25.00000
  ChangeWork 0
  Move L, @0 Dev(CurPos, P(0.000, 0.000, 80.000, 0, 0, 0)), Speed = 25.00000
  In part = IO[20 To 22]
  Out IO[10 To 13] = part
  Do
    Wait IO[7] = On, 1500, R_TIMEOUT
    R_TIMEOUT = Not(R_TIMEOUT)
    If R_TIMEOUT Then
      Exit Do
    End If
  Loop
  GiveArm
End Sub

Function spot(ByVal n As Long) As Position
  spot = DevH(cell, DevH(P(0.0, 0.0, heights(n - 1), 0, 0, 0, -1), DevH(DevH(P(0, 0, 0, 0, 0, heights(n - 1), -1), P(0, 0, 0, 0, 180.0, 0, -1)), P(0, 0, 0, 0.0, 0, 0, -1))))
  Exit Function
End Function
)");
  EXPECT_EQ(o.faults, "note 11: C_PTP of 20 % is posted as 20 mm\n");
}
TEST(PostPacScript, AnInputAndAnOutputOfOneNumberAreTold) {
  const auto faults = [](const char* signals) {
    return run(kPac, std::string("PROGRAM p;\nSIGNAL ") + signals +
                         "\nBEGIN\n  lamp := 1;\n  WAIT FOR ok;\nENDPROGRAM;")
        .faults;
  };
  EXPECT_EQ(faults("INPUT BOOL: ok AT 6; OUTPUT INT: lamp AT 4, 2;"), "");
  EXPECT_EQ(
      faults("INPUT BOOL: ok AT 5; OUTPUT INT: lamp AT 4, 2;"),
      "error 5: IO[5] would be an input and an output: PacScript numbers both in one sequence\n");
}
TEST(PostPacScript, NoGreatestSpeedIsSaid) {
  EXPECT_NE(run(kPac, with("MOVE LIN " RMP_A ";")).faults.find("which the profile does not set"),
            std::string::npos);
}
TEST(PostPacScript, EveryConstructIsSaidOrRefused) {
  expect_refused(
      kPac,
      {"CANCEL side;", "CONTINUE side;",
       "MOVE LIN POSE(POSITION(1.0, 2.0, 3.0), ORIZYX(0.0, 180.0, 0.0)) UNTIL ready DO done;",
       "MOVE LIN POSE(POSITION(1.0, 2.0, 3.0), ORIZYX(0.0, 180.0, 0.0)) UNTIL ready;",
       "MOVE PTP JOINT(MAIN_JOINT(1.0, 2.0, 3.0, 4.0, 5.0, 6.0), ADD_JOINT(1.0));",
       "MOVE PTP POSE(POSITION(1.0, 2.0, 3.0), ORIZYX(0.0, 180.0, 0.0)) UNTIL i > 3;",
       "START side;", "STOP side;", "amps := 2.5;", "i := ROUND(r);", "i := TRUNC(r);",
       "r := volts;", "s := 'it''s \"so\"';"},
      fast());
}
TEST(PostPacScript, WrongInputIsSaid) { expect_sane(kPac, fast()); }
TEST(PostPacScript, TimeGrowsWithTheProgram) { expect_linear(kPac, true, true, fast()); }

}  // namespace
}  // namespace robomosp::post_run
