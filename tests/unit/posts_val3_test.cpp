// SPDX-License-Identifier: Apache-2.0
// The post for VAL3: golden text, a reader of its own, every construct, wrong input, growth.
#include "support/post_run.h"

#include "val3.h"

namespace robomosp::post_run {
namespace {

const post::val3::Val3 kVal3;

/// What stands between the marks of a program's code.
std::string code_of(const Output& o, const std::string& file) {
  const auto it = o.files.find(file);
  if (it == o.files.end()) return "no file " + file;
  const std::string all = unix_text(it->second);
  const std::size_t a = all.find("begin\n"), b = all.find("end]]>");
  return a == std::string::npos || b == std::string::npos ? all : all.substr(a + 6, b - a - 6);
}
std::map<std::string, std::string> attributes(const std::string& line) {
  std::map<std::string, std::string> out;
  static const std::regex kOne("([A-Za-z0-9:]+)=\"([^\"]*)\"");
  for (auto i = std::sregex_iterator(line.begin(), line.end(), kOne); i != std::sregex_iterator();
       ++i)
    out[(*i)[1]] = (*i)[2];
  return out;
}
/// Reads an application again: data by name, then the motions of its program.
std::vector<Read> read_val3(const Output& o) {
  std::map<std::string, std::map<std::string, std::string>> data;
  std::string name;
  for (const std::string& l : lines(o.files.at("prog/prog.dtx"))) {
    auto a = attributes(l);
    if (l.find("<Data ") != std::string::npos) name = a["name"];
    if (l.find("<Value ") != std::string::npos) data[name] = a;
  }
  std::vector<Read> out;
  for (const std::string& l : lines(code_of(o, "prog/start.pgx"))) {
    static const std::regex kMove(" *(move[jlc])\\(([^)]*)\\)");
    std::smatch m;
    if (!std::regex_match(l, m, kMove)) continue;
    std::vector<std::string> words;
    std::istringstream all(m[2].str());
    for (std::string w; std::getline(all, w, ',');) words.push_back(w.substr(w[0] == ' ' ? 1 : 0));
    auto& how = data.at(words.back());
    for (std::size_t k = 0; k + 2 < words.size(); ++k) {
      auto& d = data.at(words[k]);
      Read r;
      const auto at = [&](const char* key) { return std::stod(d.at(key)); };
      r.kind = m[1] == "movel" ? "lin" : m[1] == "movec" ? (k == 0 ? "via" : "circle") : "ptp";
      if (d.count("j1")) {
        r.kind = "joints";
        r.numbers = {at("j1"), at("j2"), at("j3"), at("j4"), at("j5"), at("j6")};
      } else {
        r.numbers = {at("x"), at("y"), at("z")};
        r.R = times(times(about(0, at("rx")), about(1, at("ry"))), about(2, at("rz")));
      }
      r.speed = std::stod(how.at(m[1] == "movej" ? "vel" : "tmax"));
      out.push_back(r);
    }
  }
  return out;
}

TEST(PostVal3, WritesAnApplication) {
  const Output o = run(kVal3, pick());
  EXPECT_EQ(o.faults, "");
  EXPECT_EQ(code_of(o, "prog/start.pgx"), R"(  good = 0
  movej(jTo1, tTool1, mMove1)
  waitEndMove()
  while good < 5
    waitEndMove()
    l_bSeen = watch(part, 2.0)
    movej(pTo1, tTool1, mMove2)
    waitEndMove()
    movel(pTo2, tTool1, mMove3)
    waitEndMove()
    grip = true
    delay(0.25)
    movel(pTo1, tTool1, mMove4)
    movec(pTo3, pTo4, tTool1, mMove5)
    waitEndMove()
    grip = false
    good = good + 1
  endWhile
  waitEndMove()
)");
  const std::string& data = o.files.at("prog/prog.dtx");
  for (const char* piece :
       {R"(type="jointRx" size="1">)",
        R"(j1="0.0000" j2="-90.0000" j3="90.0000" j4="0.0000" j5="90.0000" j6="0.0000" />)",
        // Rz(30) Ry(20) Rx(10), as Rx Ry Rz: figures of an outside converter.
        R"(x="550.000" y="-300.000" z="200.000" rx="-1.1161" ry="22.2422" rz="28.4518")",
        R"(tmax="400.000" rmax="90.000" blend="joint" leave="10.000" reach="10.000")",
        R"(<Value key="0" link="BasicIO-1\%Q3" />)", R"(fatherId="flange[0]")"})
    EXPECT_NE(data.find(piece), std::string::npos) << piece;
  ASSERT_EQ(o.files.size(), 4U);
  for (const auto& [name, text] : o.files) {
    EXPECT_NE(text.find("\r\n"), std::string::npos);
    EXPECT_EQ(is_xml(text).value_or(true), true) << name;
  }
  // Each line of the program is found in the source again.
  const auto& from = o.map.at("prog/start.pgx");
  const auto all = lines(o.files.at("prog/start.pgx"));
  for (const auto& [line, source] : from)
    if (all[line - 1].find("movec(") != std::string::npos) {
      EXPECT_EQ(source, 19U);
    }
}
TEST(PostVal3, MotionsAreReadAgain) {
  for (const unsigned seed : {1U, 2U, 3U}) {
    const Motions m = straight_program(200, seed, true, true);
    expect_same(read_val3(run(kVal3, m.source)), m.meant);
  }
}
TEST(PostVal3, ConfigurationsToolsAndFrames) {
  Station s;
  PostPlace tool, frame;
  tool.pose.p = {0, 0, 0.1};
  frame.pose.p = {0.5, 0, 0};
  s.tools = {tool};
  s.frames = {frame};
  s.profile.tool = s.profile.frame = 0;
  const Output o = run(kVal3, R"(PROGRAM p;
VAR ROBTARGET: a := ROBTARGET(POSE(POSITION(100.0, 0.0, 50.0), ORIZYX(0.0, 0.0, 0.0)), 5, [0, 0], ADD_JOINT(0.0));
BEGIN
  MOVE PTP a SPEED_PTP := 50.0, C_PTP := 20.0;
ENDPROGRAM;)",
                       s);
  EXPECT_EQ(o.faults, "note 4: C_PTP of 20 % is posted as 20 mm\n");
  const std::string& d = o.files.at("prog/prog.dtx");
  EXPECT_NE(
      d.find(
          R"(x="100.000" y="0.000" z="50.000" rx="0.0000" ry="0.0000" rz="0.0000" shoulder="righty" elbow="enegative" wrist="wnegative" fatherId="fFrame1[0]")"),
      std::string::npos)
      << d;
  EXPECT_NE(d.find(R"(z="100.000" rx="0.0000" ry="0.0000" rz="0.0000" fatherId="flange[0]")"),
            std::string::npos);
  EXPECT_NE(
      d.find(
          R"(x="500.000" y="0.000" z="0.000" rx="0.0000" ry="0.0000" rz="0.0000" fatherId="world[0]")"),
      std::string::npos);
}
TEST(PostVal3, RecordsFunctionsAndUntilAreSaid) {
  const Output o = run(kVal3, R"(PROGRAM towers;
SIGNAL INPUT BOOL: stop_it AT 1;
TYPE RECORD INT: height; POSITION: foot; ENDRECORD: PEG;
VAR ARRAY [1..2] OF PEG: pegs := [PEG(3, POSITION(600.0, 0.0, 0.0)), PEG(0, POSITION(0.0, 7.0, 0.0))];
    POSE: goal;
FUNCTION spot (IN INT: peg; IN REAL: z): POSE;
BEGIN
  RETURN POSE(POSITION(pegs[peg].foot.X, pegs[peg].foot.Y, z), ORIZYX(0.0, 180.0, 0.0));
ENDFCT;
PROCEDURE solve (IN INT: n);
BEGIN
  IF n = 0 THEN RETURN; ENDIF;
  solve(n - 1);
  MOVE PTP spot(n, 260.0);
  pegs[n].height := pegs[n].height - 1;
ENDPROC;
BEGIN
  pegs[1].foot.Y := 5.0;
  solve(2);
  MOVE LIN spot(1, 10.0) SPEED := 50.0 UNTIL stop_it;
  MOVE_INC LIN POSE(POSITION(0.0, 0.0, 80.0), ORIZYX(0.0, 0.0, 0.0));
ENDPROGRAM;)");
  EXPECT_EQ(o.faults, "");
  EXPECT_EQ(code_of(o, "prog/start.pgx"), R"(  pegs_height[0] = 3
  pegs_height[1] = 0
  pegs_foot[0] = {600.000, 0.000, 0.000, 0.0000, 0.0000, 0.0000}
  pegs_foot[1] = {0.000, 7.000, 0.000, 0.0000, 0.0000, 0.0000}
  pegs_foot[0].y = 5.0
  call solve(2)
  call spot(1, 10.0, l_f1)
  l_pTo.trsf = l_f1
  movel(l_pTo, tTool1, mMove1)
  wait((stop_it) or isEmpty())
  resetMotion()
  waitEndMove()
  waitEndMove()
  l_pTo = here(tTool1, world)
  l_pTo.trsf.x = l_pTo.trsf.x + 0.000
  l_pTo.trsf.y = l_pTo.trsf.y + 0.000
  l_pTo.trsf.z = l_pTo.trsf.z + 80.000
  movel(l_pTo, tTool1, mMove2)
  waitEndMove()
)");
  EXPECT_EQ(code_of(o, "prog/solve.pgx"), R"(  if n == 0
    waitEndMove()
    return
  endIf
  call solve(n - 1)
  call spot(n, 260.0, l_f12)
  l_pTo.trsf = l_f12
  movej(l_pTo, tTool1, mMove3)
  waitEndMove()
  pegs_height[n - 1] = pegs_height[n - 1] - 1
)");
  EXPECT_EQ(code_of(o, "prog/spot.pgx"), R"(  waitEndMove()
  x_result = {pegs_foot[peg - 1].x, pegs_foot[peg - 1].y, z, 0, 0, 0} * {0.000, 0.000, 0.000, -180.0000, 0.0000, -180.0000}
  return
)");
}
TEST(PostVal3, EveryConstructIsSaidOrRefused) {
  expect_refused(
      kVal3, {"s := 'it''s \"so\"';", "i := LENGTH(s);", "r := ATAN2(r, q);",
              "WHILE half(r) < 3.0 DO r := r + 1.0; ENDWHILE;", "LOOP EXIT; ENDLOOP;",
              "WHILE b DO EXIT; ENDWHILE;",
              "CASE i OF WHEN 1, 2: j := 1; WHEN 3: j := 2; DEFAULT: j := 3; ENDCASE;",
              "LABEL spot: i := i + 1; IF i < 3 THEN GOTO spot; ENDIF;", "PAUSE;", "PAUSE 'look';",
              "MOVE PTP JOINT(MAIN_JOINT(1.0, 2.0, 3.0, 4.0, 5.0, 6.0), ADD_JOINT(1.0));"});
}
TEST(PostVal3, WrongInputIsSaid) { expect_sane(kVal3); }
TEST(PostVal3, TimeGrowsWithTheProgram) { expect_linear(kVal3, true, true); }

}  // namespace
}  // namespace robomosp::post_run
