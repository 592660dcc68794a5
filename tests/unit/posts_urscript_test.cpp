// SPDX-License-Identifier: Apache-2.0
// URScript: texts that were read line by line, a reader of its own for poses, speeds and signals,
// every construct, wrong input, growth.
#include "posts_support.h"
#include "urscript.h"

namespace robomosp::posts_test {
namespace {

const post::UrScript kUrScript;

/// What a script does, line by line. It knows nothing of the post.
std::vector<Seen> read_urscript(const std::string& script) {
  std::vector<Seen> out;
  const auto pose = [](Seen& s, const Numbers& n, std::size_t at) {
    const double a =
        std::sqrt(n[at + 3] * n[at + 3] + n[at + 4] * n[at + 4] + n[at + 5] * n[at + 5]);
    const double k = a < 1e-12 ? 0.5 : std::sin(a / 2) / a;
    set_pose(s, n, at, 1000, {std::cos(a / 2), n[at + 3] * k, n[at + 4] * k, n[at + 5] * k});
  };
  for (const std::string& l : lines_of(script)) {
    const Numbers n = numbers_in(l);
    Seen s;
    if (has_text(l, "movej([")) {
      s.what = "ptp joints";
      for (std::size_t k = 0; k < 6; ++k) s.joints.push_back(n[k] / kDeg);
      s.value = n[7] / 3.141592653589793 * 100;
    } else if (has_text(l, "movej(p[")) {
      s.what = "ptp";
      pose(s, n, 0);
      s.value = n[7] / 3.141592653589793 * 100;
    } else if (has_text(l, "movel(p[")) {
      s.what = "lin";
      pose(s, n, 0);
      s.value = n[7] * 1000;
    } else if (has_text(l, "movec(")) {
      s.what = "via";
      pose(s, n, 0);
      s.value = n[13] * 1000;
      out.push_back(s);
      s.what = "circle";
      pose(s, n, 6);
    } else if (has_text(l, "set_standard_digital_out(")) {
      s.what = "out";
      s.number = static_cast<int>(n[0]);
      s.value = has_text(l, "True");
    } else if (has_text(l, "sleep(")) {
      s.what = "wait";
      s.value = n[0];
    } else {
      continue;
    }
    out.push_back(s);
  }
  return out;
}

TEST(UrScriptPost, WhatIsReadFromTheTextIsWhatTheProgramSays) {
  for (unsigned seed = 1; seed < 6; ++seed) {
    const Straight s = straight(200, seed);
    How how;
    how.robot = true;
    how.form = kPostFlat;
    const Posted p = posted(kUrScript, s.irl, how);
    ASSERT_EQ(p.errors, 0) << p.faults;
    same(s.seen, read_urscript(p.text()));
    // Lines lead back to the program.
    EXPECT_GE(p.lines.at("prog.script").size(), s.seen.size() - 20);
  }
}

TEST(UrScriptPost, AProgramWithStructureReadsAsItShould) {
  const Posted p = posted(kUrScript, R"(PROGRAM pick;
SIGNAL
  INPUT  BOOL: part_here AT 1;
  INPUT  BOOL: tray_ok   AT 2;
  OUTPUT BOOL: gripper   AT 3;
VAR
  POSE: pick := POSE(POSITION(550.0, -300.0, 120.0), ORIZYX(0.0, 180.0, 0.0));
  POSE: lift := POSE(POSITION(0.0, 0.0, 80.0), ORIZYX(0.0, 0.0, 0.0));
  JOINT: home := JOINT(MAIN_JOINT(0.0, -90.0, 90.0, 0.0, 90.0, 0.0), ADD_JOINT(0.0));
  INT: good := 0;
PROCEDURE grip (IN BOOL: state);
BEGIN
  gripper := state;
  WAIT 0.25 SEC;
ENDPROC;
BEGIN
  MOVE PTP home;
  WHILE good < 5
    WAIT FOR part_here = TRUE TIMEOUT 2.0;
    IF R_TIMEOUT THEN WRITELN('no part after ', good); HALT; ENDIF;
    MOVE LIN pick SPEED := 80.0 UNTIL tray_ok;
    grip(TRUE);
    MOVE_INC LIN lift SPEED := 200.0;
    good := good + 1;
  ENDWHILE;
ENDPROGRAM;
)");
  EXPECT_EQ(p.faults, "note 17: additional joints are not written; those of this target are 0\n");
  EXPECT_EQ(p.text(), R"(def prog():
  global R_TIMEOUT = False
  global good = 0
  global rmp_moving = False
  thread rmp_move():
    movel(p[0.55, -0.3, 0.12, 0.0, 3.141593, 0.0], a=1.2, v=0.08)
    rmp_moving = False
  end
  def grip(state):
    set_standard_digital_out(3, state)
    sleep(0.25)
  end
  movej([0.0, -1.570796, 1.570796, 0.0, 1.570796, 0.0], a=1.396263, v=1.047198)
  while good < 5:
    R_TIMEOUT = False
    rmp_waited = 0.0
    while not (get_standard_digital_in(1) == True):
      if rmp_waited >= 2.0:
        R_TIMEOUT = True
        break
      end
      sync()
      rmp_waited = rmp_waited + get_steptime()
    end
    if R_TIMEOUT:
      textmsg(str_cat("no part after ", to_str(good)))
      halt
    end
    rmp_moving = True
    rmp_moves = run rmp_move()
    while rmp_moving:
      if get_standard_digital_in(2):
        kill rmp_moves
        stopl(1.2)
        rmp_moving = False
      else:
        sync()
      end
    end
    grip(True)
    movel(pose_add(p[0.0, 0.0, 0.08, 0.0, 0.0, 0.0], get_target_tcp_pose()), a=1.2, v=0.2)
    good = good + 1
  end
end
)");
}

TEST(UrScriptPost, RecordsAndArraysBecomeListsOfTheirParts) {
  const Posted p = posted(kUrScript, R"(PROGRAM t;
TYPE RECORD INT: height; POSITION: foot; ENDRECORD: PEG;
VAR ARRAY [1..2] OF PEG: pegs := [PEG(3, POSITION(600.0, 0.0, 5.0)), PEG(0, POSITION(0.0, 1.0, 2.0))];
  INT: k;
FUNCTION spot (IN INT: peg; IN REAL: z): POSE;
BEGIN
  RETURN POSE(POSITION(pegs[peg].foot.X, pegs[peg].foot.Y, z), ORIZYX(0.0, 180.0, 0.0));
ENDFCT;
BEGIN
  FOR k := 1 TO 2
    pegs[k].height := pegs[3 - k].height + 1;
    MOVE LIN spot(k, 30.0);
  ENDFOR;
ENDPROGRAM;
)");
  EXPECT_EQ(p.faults, "");
  EXPECT_EQ(p.text(), R"(def prog():
  global pegs_height = [3, 0]
  global pegs_foot = [p[0.6, 0.0, 0.005, 0.0, 0.0, 0.0], p[0.0, 0.001, 0.002, 0.0, 0.0, 0.0]]
  global k = 0
  # position of a, orientation of b
  def rmp_pose(a, b):
    return p[a[0], a[1], a[2], b[3], b[4], b[5]]
  end
  def rmp_at(a, i):
    return a[i]
  end
  def spot(peg, z):
    return rmp_pose(p[rmp_at(pegs_foot[peg - 1], 0) * 1000.0 / 1000.0, rmp_at(pegs_foot[peg - 1], 1) * 1000.0 / 1000.0, z / 1000.0, 0.0, 0.0, 0.0], p[0.0, 0.0, 0.0, 0.0, 3.141593, 0.0])
  end
  k = 1
  while k <= 2:
    pegs_height[k - 1] = pegs_height[3 - k - 1] + 1
    movel(spot(k, 30.0), a=1.2, v=0.25)
    k = k + 1
  end
end
)");
}

TEST(UrScriptPost, BlendsAreAtMostHalfOfTheWay) {
  const Posted p = posted(kUrScript, R"(PROGRAM t;
VAR ORIENTATION: d := ORIZYX(0.0, 180.0, 0.0);
BEGIN
  MOVE LIN POSE(POSITION(400.0, 0.0, 300.0), d);
  MOVE LIN POSE(POSITION(410.0, 0.0, 300.0), d) C_CP := 4.0;
  MOVE LIN POSE(POSITION(410.0, 6.0, 300.0), d) C_CP := 2.0;
  MOVE LIN POSE(POSITION(410.0, 60.0, 300.0), d);
ENDPROGRAM;
)");
  EXPECT_EQ(p.faults,
            "warning 5: the blend radius of 4 mm is written as 3 mm: half the distance to the next "
            "target. Give a smaller C_CP or C_PTP.\n");
  EXPECT_TRUE(has_text(p.text(), "v=0.25, r=0.003)\n"));
  EXPECT_TRUE(has_text(p.text(), "v=0.25, r=0.002)\n"));
}

TEST(UrScriptPost, ToolsFramesSignalsAndStatus) {
  How how;
  how.robot = true;
  PostPlace tool;
  tool.name = "gripper";
  tool.pose.p = {0, 0, 0.12};
  tool.mass = 1.5;
  tool.com = {0, 0, 0.05};
  how.profile.tools = {&tool, 1};
  how.profile.tool = 0;
  PostSignal lamp;
  lamp.name = "LAMP";
  lamp.number = 4;
  lamp.kind = "configurable";
  PostSignal grip;
  grip.name = "grip";
  grip.number = 0;
  grip.kind = "tool";
  grip.inverted = true;
  const PostSignal signals[] = {lamp, grip};
  how.profile.signals = signals;
  const Posted p = posted(kUrScript, R"(PROGRAM t;
SIGNAL OUTPUT BOOL: lamp AT 40; OUTPUT BOOL: grip AT 41;
VAR POSE: f := POSE(POSITION(100.0, 0.0, 0.0), ORIZYX(90.0, 0.0, 0.0));
  POSE: torch := POSE(POSITION(0.0, 0.0, 200.0), ORIZYX(0.0, 0.0, 0.0));
  ROBTARGET: x := ROBTARGET(POSE(POSITION(50.0, 0.0, 300.0), ORIZYX(0.0, 180.0, 0.0)), 2, [0, 0], ADD_JOINT(0.0));
BEGIN
  lamp := TRUE;
  grip := TRUE;
  MOVE PTP x;
  MOVE LIN x FRAME := f;
  MOVE LIN x TOOL := torch;
  MOVE LIN x;
ENDPROGRAM;
)",
                          how);
  EXPECT_EQ(p.errors, 0) << p.faults;
  EXPECT_EQ(p.text(), R"(def prog():
  set_tcp(p[0.0, 0.0, 0.12, 0.0, 0.0, 0.0])
  set_payload(1.500, [0.0000, 0.0000, 0.0500])
  set_configurable_digital_out(4, True)
  set_tool_digital_out(0, False)
  movej(get_inverse_kin(p[0.05, 0.0, 0.3, 0.0, 3.141593, 0.0], qnear=[0.05, 0.0, 0.3, 0.0, 3.141593, 0.0]), a=1.396263, v=3.141593)
  movel(p[0.1, 0.05, 0.3, -2.221441, 2.221441, 0.0], a=1.2, v=0.25)
  set_tcp(p[0.0, 0.0, 0.2, 0.0, 0.0, 0.0])
  movel(p[0.05, 0.0, 0.3, 0.0, 3.141593, 0.0], a=1.2, v=0.25)
  set_tcp(p[0.0, 0.0, 0.12, 0.0, 0.0, 0.0])
  movel(p[0.05, 0.0, 0.3, 0.0, 3.141593, 0.0], a=1.2, v=0.25)
end
)");
}

TEST(UrScriptPost, ThePageIsRight) { page_is_right(kUrScript, "urscript.md", {}); }

TEST(UrScriptPost, EveryConstructIsTextOrAnErrorAtItsLine) { every_construct(kUrScript, {}, 90); }

TEST(UrScriptPost, WrongInputIsSaid) {
  wrong_input(kUrScript, {});
  const std::string letters(200, 'n');
  const Posted p =
      posted(kUrScript, "PROGRAM prog;\nVAR INT: " + letters + ", " + letters + "a;\nBEGIN\n" +
                            letters + " := 1; " + letters + "a := 2;\nENDPROGRAM;\n");
  EXPECT_EQ(p.errors, 0) << p.faults;
  EXPECT_TRUE(has_text(p.text(), "  " + std::string(60, 'n') + " = 1\n"));
  EXPECT_TRUE(has_text(p.text(), "  " + std::string(59, 'n') + "2 = 2\n"));
  const Posted far = posted(kUrScript,
                            "PROGRAM prog;\nSIGNAL OUTPUT BOOL: x AT 200;\nBEGIN\nx := TRUE;\n"
                            "ENDPROGRAM;\n");
  EXPECT_EQ(far.faults,
            "error 4: signal 200 is not one of the 8 standard signals of the controller, numbered "
            "from 0. Map it "
            "in the profile: a number, and standard, configurable, tool or register as kind.\n");
}

TEST(UrScriptPost, TimeGrowsWithTheProgram) { is_linear(kUrScript, {}); }

}  // namespace
}  // namespace robomosp::posts_test
