// SPDX-License-Identifier: Apache-2.0
// The post for AS: golden text, a reader of its own, every construct, wrong input, growth.
#include "support/post_run.h"

#include "as.h"

namespace robomosp::post_run {
namespace {

const post::as::As kAs;

/// Reads a file again: the points first, then the motions.
std::vector<Read> read_as(const Output& o) {
  std::map<std::string, std::vector<double>> points;
  const auto all = lines(o.only());
  for (const std::string& l : all)
    if (l.starts_with("p") || l.starts_with("#")) {
      const std::size_t blank = l.find(' ');
      points[l.substr(0, blank)] = numbers(l.substr(blank));
    }
  std::vector<Read> out;
  double speed = -1;
  for (const std::string& raw : all) {
    const std::string l = raw.substr(std::min(raw.find_first_not_of(' '), raw.size()));
    if (l.starts_with("SPEED ")) speed = std::stod(l.substr(6));
    if (l.size() < 7 || l.find("MOVE ") == std::string::npos) continue;
    const std::size_t blank = l.find(' ');
    const std::string verb = l.substr(0, blank), name = l.substr(blank + 1);
    const auto& n = points.at(name);
    Read r;
    r.kind = verb == "LMOVE"    ? "lin"
             : verb == "C1MOVE" ? "via"
             : verb == "C2MOVE" ? "circle"
                                : "ptp";
    if (name[0] == '#') {
      r.kind = "joints";
      r.numbers = n;
    } else {
      r.numbers = {n[0], n[1], n[2]};
      r.R = times(times(about(2, n[3]), about(1, n[4])), about(2, n[5]));
    }
    r.speed = speed;
    out.push_back(r);
  }
  return out;
}

TEST(PostAs, WritesProgramsAndPoints) {
  const Output o = run(kAs, pick());
  EXPECT_EQ(o.faults, "");
  EXPECT_EQ(o.only(), R"(.PROGRAM prog()
  CP ON
  good = 0
  TOOL NULL
  SPEED 60.000
  JMOVE #j1
  BREAK
  WHILE good < 5 DO
    BREAK
    TIMER 1 = 0
    WAIT SIG(1001) OR TIMER(1) >= 2.0
    TOOL NULL
    SPEED 100.000
    JMOVE p1
    BREAK
    SPEED 80.000 MM/S
    LMOVE p2
    BREAK
    SIGNAL 3
    TWAIT 0.25
    SPEED 400.000 MM/S
    ACCURACY 10.000
    LMOVE p1
    SPEED 400.000 MM/S
    C1MOVE p3
    SPEED 400.000 MM/S
    C2MOVE p4
    BREAK
    SIGNAL -3
    good = good + 1
  END
  BREAK
.END
.TRANS
p1 550.000 -300.000 200.000 2.7268 22.2687 25.5056
p2 587.852 -298.197 292.542 2.7268 22.2687 25.5056
p3 600.000 0.000 200.000 2.7268 22.2687 25.5056
p4 550.000 300.000 80.000 90.0000 180.0000 0.0000
.END
.JOINTS
#j1 0.0000 -90.0000 90.0000 0.0000 90.0000 0.0000
.END
)");
}
TEST(PostAs, MotionsAreReadAgain) {
  for (const unsigned seed : {1U, 2U, 3U}) {
    const Motions m = straight_program(200, seed, true, true);
    expect_same(read_as(run(kAs, m.source)), m.meant);
  }
}
TEST(PostAs, ConfigurationsFramesToolsUntilAndRoutines) {
  Station s;
  PostAxis outer;
  outer.name = "JT7";
  outer.joint = 0;
  outer.external = outer.linear = true;
  s.axes = {outer};
  s.options = {{"timer", "4", {}}};
  const Output o = run(kAs, R"(PROGRAM p;
SIGNAL INPUT BOOL: stop_it AT 7; OUTPUT INT: lamp AT 10, 4; INPUT INT: code AT 20, 3;
TYPE RECORD INT: height; POSITION: foot; ENDRECORD: PEG;
VAR ARRAY [1..2] OF PEG: pegs := [PEG(3, POSITION(600.0, 0.0, 0.0)), PEG(0, POSITION(0.0, 7.0, 0.0))];
  ROBTARGET: a := ROBTARGET(POSE(POSITION(100.0, 0.0, 50.0), ORIZYX(0.0, 0.0, 0.0)), 5, [0, 0], ADD_JOINT(250.0));
  POSE: tip := POSE(POSITION(0.0, 0.0, 100.0), ORIZYX(0.0, 0.0, 0.0)); STRING: s;
FUNCTION spot (IN INT: peg; IN REAL: z): POSE;
BEGIN
  RETURN POSE(POSITION(pegs[peg].foot.X, 1.0, z), ORIZYX(z, 180.0, 0.0));
ENDFCT;
BEGIN
  MOVE PTP a SPEED_PTP := 50.0, C_PTP := 20.0, TOOL := tip;
  MOVE LIN spot(1, 10.0) UNTIL NOT stop_it;
  pegs[2].foot.Z := 4.0;
  lamp := code;
  CASE code OF WHEN 1, 2: s := 'low'; DEFAULT: PAUSE 'what'; ENDCASE;
  WAIT FOR NOT stop_it TIMEOUT 1.5;
  IF R_TIMEOUT THEN WRITE('late ', code); ENDIF;
ENDPROGRAM;)",
                       s);
  EXPECT_EQ(o.only(), R"(.PROGRAM prog()
  CP ON
  r_timeout = FALSE
  pegs_height[1] = 3
  pegs_height[2] = 0
  POINT pegs_foot[1] = TRANS(600.000, 0.000, 0.000, 0.0000, 0.0000, 0.0000)
  POINT pegs_foot[2] = TRANS(0.000, 7.000, 0.000, 0.0000, 0.0000, 0.0000)
  $s = ""
  TOOL p1
  LEFTY
  ABOVE
  DWRIST
  SPEED 50.000
  JMOVE p2
  BREAK
  CALL spot(1, 10.0, .f)
  TOOL NULL
  SPEED 250.000 MM/S
  XMOVE/LVL .f TILL -1007
  BREAK
  POINT pegs_foot[2] = SHIFT(pegs_foot[2] BY 0, 0, (4.0) - DZ(pegs_foot[2]))
  BITS 10,4 = BITS(1020,3)
  CASE BITS(1020,3) OF
  VALUE 1,2:
    $s = "low"
  ANY :
    BREAK
    PRINT "what"
    PAUSE
  END
  BREAK
  TIMER 4 = 0
  WAIT NOT(SIG(1007)) OR TIMER(4) >= 1.5
  r_timeout = TIMER(4) >= 1.5
  IF r_timeout THEN
    PRINT "late ", BITS(1020,3), /S
  END
  BREAK
.END
.PROGRAM spot(.peg, .z, .result)
  BREAK
  POINT .result = TRANS(DX(pegs_foot[.peg]), 1.0, .z) + (RZ(.z) + RY(180.0) + RX(0.0))
  RETURN
.END
.TRANS
p1 0.000 0.000 100.000 0.0000 0.0000 0.0000
p2 100.000 0.000 50.000 0.0000 0.0000 0.0000 250.0000
.END
)");
  EXPECT_EQ(o.faults,
            "note 12: the motion ends at its target: an output, a wait, a text or a motion with "
            "UNTIL follows\n");
}
TEST(PostAs, EveryConstructIsSaidOrRefused) {
  expect_refused(kAs,
                 {"CANCEL side;",
                  "CONTINUE side;",
                  "IF b THEN i := 1; ELSIF d THEN i := 2; ELSE i := 3; ENDIF;",
                  "LOOP EXIT; ENDLOOP;",
                  "MOVE PTP JOINT(MAIN_JOINT(1.0, 2.0, 3.0, 4.0, 5.0, 6.0), ADD_JOINT(1.0));",
                  "MOVE PTP POSE(POSITION(1.0, 2.0, 3.0), ORIZYX(0.0, 180.0, 0.0)) UNTIL i > 3;",
                  "START side;",
                  "STOP side;",
                  "WHILE b DO EXIT; ENDWHILE;",
                  "WHILE half(r) < 3.0 DO r := r + 1.0; ENDWHILE;",
                  "amps := 2.5;",
                  "i := ROUND(r);",
                  "r := ACOS(r);",
                  "r := ASIN(r);",
                  "r := ATAN(r);",
                  "r := EXP(r);",
                  "r := LN(r);",
                  "r := TAN(r);",
                  "r := volts;",
                  "s := 'it''s \"so\"';"});
}
TEST(PostAs, WrongInputIsSaid) { expect_sane(kAs); }
TEST(PostAs, TimeGrowsWithTheProgram) { expect_linear(kAs, true, true); }

}  // namespace
}  // namespace robomosp::post_run
