// SPDX-License-Identifier: Apache-2.0
// The post for PDL2: golden text, a reader of its own, every construct, wrong input, growth.
#include "support/post_run.h"

#include "pdl2.h"

namespace robomosp::post_run {
namespace {

const post::pdl2::Pdl2 kPdl2;

std::vector<Read> read_pdl2(const Output& o) {
  std::vector<Read> out;
  const auto pose = [](const std::string& l, std::size_t at) {
    const auto n = numbers(l.substr(at, l.find(')', at) - at));
    Read r;
    r.numbers = {n[0], n[1], n[2]};
    r.R = times(times(about(2, n[3]), about(1, n[4])), about(2, n[5]));
    return r;
  };
  for (const std::string& l : lines(o.only())) {
    if (l.find("  MOVE") != 0) continue;
    Read r;
    const std::size_t to = l.find("TO ") + 3;
    if (l[to] == '{') {
      r.kind = "joints";
      r.numbers = numbers(l.substr(to, l.find('}') - to));
    } else {
      r = pose(l, to + 3);
      r.kind = l.find("LINEAR") != std::string::npos     ? "lin"
               : l.find("CIRCULAR") != std::string::npos ? "circle"
                                                         : "ptp";
    }
    const std::size_t mps = l.find("$LIN_SPD = "), share = l.find("$PROG_SPD_OVR = ");
    r.speed = mps != std::string::npos ? std::stod(l.substr(mps + 11)) * 1000
                                       : std::stod(l.substr(share + 16));
    if (const std::size_t via = l.find(" VIA "); via != std::string::npos) {
      Read v = pose(l, via + 8);
      v.kind = "via";
      v.speed = r.speed;
      out.push_back(v);
    }
    out.push_back(r);
  }
  return out;
}

TEST(PostPdl2, WritesAProgram) {
  const Output o = run(kPdl2, pick());
  EXPECT_EQ(o.faults, "");
  EXPECT_EQ(o.only(), R"(PROGRAM prog PROG_ARM = 1
VAR
  good : INTEGER
BEGIN
  $ORNT_TYPE := RS_WORLD
  $TURN_CARE := FALSE
  $SING_CARE := FALSE
  $SPD_OPT := SPD_LIN
  $TERM_TYPE := COARSE
  $FLY_TYPE := FLY_CART
  $FLY_TRAJ := FLY_PASS
  good := 0
  $TOOL := POS(0.000, 0.000, 0.000, 0.0000, 0.0000, 0.0000, '')
  $UFRAME := POS(0.000, 0.000, 0.000, 0.0000, 0.0000, 0.0000, '')
  $CNFG_CARE := FALSE
  MOVE TO {0.0000, -90.0000, 90.0000, 0.0000, 90.0000, 0.0000} WITH $PROG_SPD_OVR = 60
  WHILE good < 5 DO
    $TIMER[1] := 0
    REPEAT
      DELAY 1
    UNTIL ($DIN[1]) OR ($TIMER[1] >= 2000)
    $TOOL := POS(0.000, 0.000, 0.000, 0.0000, 0.0000, 0.0000, '')
    $UFRAME := POS(0.000, 0.000, 0.000, 0.0000, 0.0000, 0.0000, '')
    $CNFG_CARE := FALSE
    MOVE JOINT TO POS(550.000, -300.000, 200.000, 2.7268, 22.2687, 25.5056, '') WITH $PROG_SPD_OVR = 100
    MOVE LINEAR TO POS(587.852, -298.197, 292.542, 2.7268, 22.2687, 25.5056, '') WITH $LIN_SPD = 0.080000
    $DOUT[3] := ON
    DELAY 250
    MOVEFLY LINEAR TO POS(550.000, -300.000, 200.000, 2.7268, 22.2687, 25.5056, '') ADVANCE WITH $LIN_SPD = 0.400000, $FLY_DIST = 10.000
    MOVE CIRCULAR TO POS(550.000, 300.000, 80.000, 90.0000, 180.0000, 0.0000, '') VIA POS(600.000, 0.000, 200.000, 2.7268, 22.2687, 25.5056, '') WITH $LIN_SPD = 0.400000
    $DOUT[3] := OFF
    good := good + 1
  ENDWHILE
END prog
)");
}
TEST(PostPdl2, MotionsAreReadAgain) {
  for (const unsigned seed : {1U, 2U, 3U}) {
    const Motions m = straight_program(200, seed, true, true);
    expect_same(read_pdl2(run(kPdl2, m.source)), m.meant);
  }
}
TEST(PostPdl2, RoutinesRecordsUntilAndAuxiliaryAxes) {
  Station s;
  PostAxis outer;
  outer.joint = 0;
  outer.external = outer.linear = true;
  s.axes = {outer};
  const Output o = run(kPdl2, R"(PROGRAM p;
SIGNAL INPUT BOOL: stop_it AT 7; OUTPUT INT: lamp AT 10, 4; INPUT INT: code AT 20, 3;
TYPE RECORD INT: height; POSITION: foot; ENDRECORD: PEG;
VAR ARRAY [0..1] OF PEG: pegs := [PEG(3, POSITION(600.0, 0.0, 0.0)), PEG(0, POSITION(0.0, 7.0, 0.0))];
  ROBTARGET: a := ROBTARGET(POSE(POSITION(100.0, 0.0, 50.0), ORIZYX(0.0, 0.0, 0.0)), 5, [0, 0], ADD_JOINT(250.0));
  STRING: s; BOOL: b, d;
FUNCTION spot (IN INT: peg; IN REAL: z): POSE;
BEGIN
  RETURN POSE(POSITION(pegs[peg].foot.X, 1.0, z), ORIZYX(z, 180.0, 0.0));
ENDFCT;
PROCEDURE stopped; BEGIN HALT; ENDPROC;
PROCEDURE solve (IN INT: n);
BEGIN
  IF n = 0 THEN RETURN; ENDIF;
  solve(n - 1);
  pegs[n].height := pegs[n].height - 1;
ENDPROC;
BEGIN
  MOVE PTP a SPEED_PTP := 50.0, C_PTP := 20.0;
  MOVE LIN spot(1, 10.0) UNTIL NOT stop_it DO stopped;
  MOVE_INC LIN POSE(POSITION(0.0, 0.0, 80.0), ORIZYX(0.0, 0.0, 0.0));
  solve(1);
  b := b AND code = 2 OR d;
  CASE code OF WHEN 1, 2: s := 'low'; DEFAULT: PAUSE 'what'; ENDCASE;
  WAIT FOR NOT stop_it TIMEOUT 1.5;
  IF R_TIMEOUT THEN WRITE('late ', lamp); ENDIF;
ENDPROGRAM;)",
                       s);
  EXPECT_EQ(o.only(), R"(PROGRAM prog PROG_ARM = 1
VAR
  r_timeout : BOOLEAN
  pegs_height : ARRAY[2] OF INTEGER
  pegs_foot : ARRAY[2] OF POSITION
  s : STRING[127]
  b : BOOLEAN
  d : BOOLEAN
  p_aux : XTNDPOS
ROUTINE spot(peg : INTEGER; z : REAL) : POSITION
BEGIN
  RETURN((POS(pegs_foot[peg + 1].X, 1.0, z, 0, 0, 0, '') : ((POS(0, 0, 0, z, 0, 0, '') : POS(0, 0, 0, 0, 180.0, 0, '')) : POS(0, 0, 0, -90, 0.0, 90, ''))))
END spot
ROUTINE stopped
BEGIN
  DEACTIVATE prog
END stopped
ROUTINE solve(n : INTEGER)
BEGIN
  IF n = 0 THEN
    RETURN
  ENDIF
  solve(n - 1)
  pegs_height[n + 1] := pegs_height[n + 1] - 1
END solve
BEGIN
  $ORNT_TYPE := RS_WORLD
  $TURN_CARE := FALSE
  $SING_CARE := FALSE
  $SPD_OPT := SPD_LIN
  $TERM_TYPE := COARSE
  $FLY_TYPE := FLY_CART
  $FLY_TRAJ := FLY_PASS
  r_timeout := FALSE
  pegs_height[1] := 3
  pegs_height[2] := 0
  pegs_foot[1] := POS(600.000, 0.000, 0.000, 0.0000, 0.0000, 0.0000, '')
  pegs_foot[2] := POS(0.000, 7.000, 0.000, 0.0000, 0.0000, 0.0000, '')
  s := ''
  b := FALSE
  d := FALSE
  $TOOL := POS(0.000, 0.000, 0.000, 0.0000, 0.0000, 0.0000, '')
  $UFRAME := POS(0.000, 0.000, 0.000, 0.0000, 0.0000, 0.0000, '')
  $CNFG_CARE := TRUE
  p_aux.POS := POS(100.000, 0.000, 50.000, 0.0000, 0.0000, 0.0000, 'S W')
  p_aux.AUX[1] := 250.0000
  MOVE JOINT TO p_aux WITH $PROG_SPD_OVR = 50
  $CNFG_CARE := FALSE
  MOVE LINEAR TO spot(1, 10.0) TIL NOT $DIN[7] WITH $LIN_SPD = 0.250000
  IF NOT $DIN[7] THEN
    stopped
  ENDIF
  MOVE LINEAR RELATIVE VEC(0.000, 0.000, 80.000) IN BASE WITH $LIN_SPD = 0.250000
  solve(1)
  b := b AND ($GIN[20] = 2) OR d
  SELECT $GIN[20] OF
  CASE (1, 2):
    s := 'low'
  ELSE:
    WRITE ('what', NL)
    PAUSE
  ENDSELECT
  $TIMER[1] := 0
  REPEAT
    DELAY 1
  UNTIL (NOT $DIN[7]) OR ($TIMER[1] >= 1500)
  r_timeout := $TIMER[1] >= 1500
  IF r_timeout THEN
    WRITE ('late ', $GOUT[10])
  ENDIF
END prog
)");
  EXPECT_EQ(
      o.faults,
      R"(note 19: the motion ends at its target: an output, a wait, a text or a motion with UNTIL follows
note 23: the bits of an INT are port 20 of the groups
note 24: the bits of an INT are port 20 of the groups
note 26: the bits of an INT are port 10 of the groups
)");
}
TEST(PostPdl2, EveryConstructIsSaidOrRefused) {
  expect_refused(kPdl2,
                 {"CANCEL side;", "CONTINUE side;", "LOOP EXIT; ENDLOOP;",
                  "MOVE PTP JOINT(MAIN_JOINT(1.0, 2.0, 3.0, 4.0, 5.0, 6.0), ADD_JOINT(1.0));",
                  "MOVE PTP POSE(POSITION(1.0, 2.0, 3.0), ORIZYX(0.0, 180.0, 0.0)) UNTIL i > 3;",
                  "START side;", "STOP side;", "WHILE b DO EXIT; ENDWHILE;", "amps := 2.5;",
                  "r := ATAN(r);", "r := volts;", "s := 'it''s \"so\"';"});
}
TEST(PostPdl2, WrongInputIsSaid) { expect_sane(kPdl2); }
TEST(PostPdl2, TimeGrowsWithTheProgram) { expect_linear(kPdl2, true, true); }

}  // namespace
}  // namespace robomosp::post_run
