// SPDX-License-Identifier: Apache-2.0
// The programs that are shipped, against figures computed by hand; traces and flattened programs.
#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <sstream>

#include "program/flatten.h"
#include "program/trace.h"
#include "support/program_world.h"

namespace robomosp::program {
namespace {

using namespace testing;
namespace fs = std::filesystem;

std::string sample_text(const fs::path& p) {
  std::ifstream in(p, std::ios::binary);
  std::ostringstream out;
  out << in.rdbuf();
  return out.str();
}
std::shared_ptr<const CompiledProgram> sample(const std::string& name) {
  const fs::path at = fs::path(ROBOMOSP_SOURCE_DIR) / "scripts/programs" / name;
  EXPECT_TRUE(fs::exists(at)) << at;
  return compiled({{name, sample_text(at)}});
}
Machine machine_of(const std::string& name) {
  auto m = Machine::load(sample(name));
  EXPECT_TRUE(m.ok()) << (m.ok() ? "" : m.error().sentence());
  return std::move(m).value();
}
std::size_t count_of(const TestWorld& w, std::uint32_t interpolation) {
  return static_cast<std::size_t>(
      std::count_if(w.motions.begin(), w.motions.end(),
                    [&](const Motion& m) { return m.interpolation == interpolation; }));
}
Trace traced(std::shared_ptr<const CompiledProgram> p, const TraceOptions& options = {}) {
  auto t = trace(std::move(p), options);
  EXPECT_TRUE(t.ok()) << (t.ok() ? "" : t.error().sentence());
  return t.ok() ? std::move(t).value() : Trace{};
}
std::string failed_trace(const std::string& text, const TraceOptions& options = {}) {
  auto t = trace(compiled(text), options);
  return t.ok() ? "it went through" : t.error().sentence();
}
/// Everything that a trace says, each number in full.
std::string told(const Trace& t, int digits = 17) {
  std::ostringstream out;
  out.precision(digits);
  const auto pose = [&](const PlainPose& p) {
    for (const double v : p.position) out << v << ' ';
    for (const double v : p.quaternion) out << v << ' ';
  };
  for (const TraceEntry& e : t.entries) {
    out << e.process << ' ' << e.span.line << ':' << e.span.column << ' ';
    if (const auto* m = std::get_if<TracedMotion>(&e.what)) {
      out << "move " << m->motion.number << ' ' << m->motion.after << ' ' << m->motion.interpolation
          << ' ' << m->motion.is_incremental << ' ' << m->motion.approximates << ' ';
      for (const Target& x : m->motion.targets) {
        out << x.role << ' ' << x.status << ' ';
        pose(x.pose);
        for (const double v : x.joints) out << v << ' ';
        out << '|';
        for (const double v : x.additional) out << v << ' ';
        for (const int v : x.turns) out << v << ' ';
      }
      MotionAttributes a = m->motion.attributes;
      out << a.speed << ' ' << a.speed_orientation << ' ' << a.acceleration << ' ' << a.time << ' '
          << a.c_cp << ' ' << a.c_speed << ' ' << a.passes << a.weaves << ' ' << a.speed_ptp << ' '
          << a.acceleration_ptp << ' ' << a.c_ptp << ' ' << a.device << ' ' << a.additional_axes
          << ' ' << a.robot << ' ';
      if (a.tool) pose(*a.tool);
      if (a.frame) pose(*a.frame);
      for (const auto& p : m->absolute) {
        if (p) pose(*p);
        else out << "? ";
      }
      if (m->until) out << "until " << m->until->text(t.program->code());
    } else if (const auto* w = std::get_if<TracedWrite>(&e.what)) {
      out << "write " << row<rmp_code_symbol>(t.program->code().symbols, w->symbol).name << ' '
          << w->value.integer << ' ' << w->value.real;
    } else if (const auto* w2 = std::get_if<TracedWait>(&e.what)) {
      out << "wait " << w2->seconds << ' '
          << (w2->condition ? w2->condition->text(t.program->code()) : "");
    } else if (const auto* x = std::get_if<TracedText>(&e.what)) {
      out << "text " << x->text;
    } else if (const auto* q = std::get_if<TracedPause>(&e.what)) {
      out << "pause " << q->message;
    } else {
      out << "halt";
    }
    out << '\n';
  }
  return out.str();
}
/// A flattened program does what the program does, and is its own flattened program; so is what is
/// read back from the text of its code, but for the statements.
void expect_flat(const Trace& t) {
  auto flat = flatten(t);
  ASSERT_TRUE(flat.ok()) << flat.error().sentence();
  const std::shared_ptr<const CompiledProgram> one(std::move(flat).value());
  const Trace again = traced(one);
  EXPECT_EQ(told(t), told(again));
  auto flat2 = flatten(again);
  ASSERT_TRUE(flat2.ok()) << flat2.error().sentence();
  EXPECT_EQ(code_text(one->code()), code_text((*flat2)->code()));
  EXPECT_EQ(one->code().statements.count, (*flat2)->code().statements.count);
  EXPECT_EQ(one->code().statements.count, t.entries.size());
}

TEST(ProgramSamples, HanoiCarriesAllDiscs) {
  Machine m = machine_of("hanoi.irl");
  TestWorld w;
  const Status& s = run_to_end(m, w);
  EXPECT_EQ(fault_of(s), "");
  EXPECT_FALSE(s.is_halted);
  EXPECT_EQ(w.motions.size(), 42u);
  EXPECT_EQ(count_of(w, RMP_MOVE_PTP), 14u);
  EXPECT_EQ(count_of(w, RMP_MOVE_LIN), 28u);
  EXPECT_EQ(w.writes.size(), 14u);
  EXPECT_EQ(m.evaluate("pegs[1].discs")->value, "0");
  EXPECT_EQ(m.evaluate("pegs[2].discs")->value, "0");
  EXPECT_EQ(m.evaluate("pegs[3].discs")->value, "3");
  EXPECT_EQ(w.text, "done: 7 discs carried\n");
  // 42 motions of a second each, 14 waits of 0.3 s.
  EXPECT_NEAR(w.now, 42 + 14 * 0.3, 42 * 0.01 + 14 * 0.01);
  // Discs are where they were put: the rules of the game are kept all the way.
  std::vector<std::vector<int>> pegs{{3, 2, 1}, {}, {}};
  int held = 0;
  std::size_t write = 0;
  for (std::size_t k = 0; k < w.motions.size(); k += 1) {
    const Motion& x = w.motions[k];
    if (x.attributes.speed != 100) continue;
    const auto peg = static_cast<std::size_t>(std::lround(x.targets[0].pose.position[1] / 250) + 1);
    if (w.writes[write++].second) {
      held = pegs[peg].back();
      pegs[peg].pop_back();
      EXPECT_NEAR(x.targets[0].pose.position[2], 30.0 * static_cast<double>(pegs[peg].size()) + 15,
                  1e-9);
    } else {
      ASSERT_TRUE(pegs[peg].empty() || pegs[peg].back() > held);
      EXPECT_NEAR(x.targets[0].pose.position[2], 30.0 * static_cast<double>(pegs[peg].size()) + 15,
                  1e-9);
      pegs[peg].push_back(held);
    }
  }
  EXPECT_EQ(pegs[2], (std::vector<int>{3, 2, 1}));
}

TEST(ProgramSamples, PickAndPlaceWaitsForItsSignals) {
  Machine m = machine_of("pick_and_place.irl");
  TestWorld w;
  w.inputs["tray_ok"] = {0, 0};
  w.inputs["part_here"] = {0, 0};
  while (w.now < 3) {
    m.run(w.now, w);
    w.now += 0.01;
  }
  ASSERT_EQ(m.status().state, RunState::waiting);
  ASSERT_EQ(m.status().waits.size(), 1u);
  EXPECT_EQ(m.status().waits[0].kind, WaitKind::condition);
  ASSERT_EQ(m.status().waits[0].signals.size(), 1u);
  EXPECT_STREQ(row<rmp_code_symbol>(m.code().symbols, m.status().waits[0].signals[0]).name,
               "part_here");
  EXPECT_FALSE(m.status().waits[0].each_cycle);
  w.inputs["part_here"] = {1, 0};
  const Status& s = run_to_end(m, w);
  EXPECT_EQ(fault_of(s), "");
  EXPECT_EQ(w.motions.size(), 32u);
  EXPECT_EQ(std::count_if(w.writes.begin(), w.writes.end(),
                          [](const auto& x) { return x.first == "gripper"; }),
            10);
  EXPECT_TRUE(w.aborted.empty());
  // Joint targets keep their numbers, ROBTARGETs their status and turns (defect 7).
  EXPECT_EQ(w.motions[0].targets[0].joints, (std::vector<double>{0, -90, 90, 0, 90, 0}));
  EXPECT_EQ(w.motions[2].targets[0].status, 2);
  EXPECT_EQ(w.motions[2].targets[0].turns, (std::vector<std::int32_t>{0, 0}));
  // The tool looks down: 80 mm back along its axis is 80 mm up.
  EXPECT_NEAR(w.motions[1].targets[0].pose.position[2], 200, 1e-9);
  EXPECT_TRUE(w.motions[3].is_incremental);
}

TEST(ProgramSamples, UntilEndsTheMotionEarly) {
  Machine m = machine_of("pick_and_place.irl");
  TestWorld w;
  w.inputs["tray_ok"] = {1, 0};
  w.inputs["part_here"] = {1, 0};
  w.braking = 0.05;
  const Status& s = run_to_end(m, w);
  EXPECT_EQ(fault_of(s), "");
  EXPECT_EQ(w.motions.size(), 32u);
  ASSERT_EQ(w.aborted.size(), 5u);
  EXPECT_EQ(w.aborted[0].second, AbortReason::until);
  for (const auto& [number, reason] : w.aborted) EXPECT_TRUE(w.motions[number - 1].has_until);
}

TEST(ProgramSamples, PalletisingFillsTheTray) {
  Machine m = machine_of("palletising.irl");
  TestWorld w;
  const Status& s = run_to_end(m, w);
  EXPECT_EQ(fault_of(s), "");
  EXPECT_EQ(w.text, "full\n");
  ASSERT_EQ(w.motions.size(), 96u);
  EXPECT_EQ(count_of(w, RMP_MOVE_PTP), 48u);
  EXPECT_EQ(count_of(w, RMP_MOVE_LIN), 48u);
  std::size_t k = 0;
  for (int l = 0; l < 2; ++l)
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 4; ++c, ++k) {
        const double x = 110.0 * (r % 2 ? 3 - c : c), y = 85.0 * r;
        const double a = std::numbers::pi / 6;
        const auto& p = w.motions[4 * k + 2].targets[0].pose.position;
        EXPECT_NEAR(p[0], 700 + std::cos(a) * x - std::sin(a) * y, 1e-9);
        EXPECT_NEAR(p[1], -200 + std::sin(a) * x + std::cos(a) * y, 1e-9);
        EXPECT_NEAR(p[2], 20 + 60.0 * l, 1e-9);
      }
  // Every fourth motion has an approximation and lets the next one begin behind it.
  EXPECT_TRUE(w.motions[1].approximates);
  EXPECT_EQ(w.motions[2].after, w.motions[1].number);
  EXPECT_EQ(w.begun[1], w.begun[2]);
}

TEST(ProgramSamples, ArcWeldHasItsLength) {
  const Trace t = traced(sample("arc_weld.irl"));
  std::vector<const TracedMotion*> moves;
  for (const TraceEntry& e : t.entries)
    if (const auto* m = std::get_if<TracedMotion>(&e.what)) moves.push_back(m);
  ASSERT_EQ(moves.size(), 6u);
  ASSERT_EQ(moves[3]->motion.interpolation, std::uint32_t{RMP_MOVE_CIRCLE});
  const auto& from = moves[2]->absolute[0]->position;
  const auto& via = moves[3]->absolute[0]->position;
  const auto& to = moves[3]->absolute[1]->position;
  // The circle through the three points, in the plane z = 100.
  const double ax = from[0], ay = from[1], bx = via[0], by = via[1], cx = to[0], cy = to[1];
  const double d = 2 * (ax * (by - cy) + bx * (cy - ay) + cx * (ay - by));
  const double ux = ((ax * ax + ay * ay) * (by - cy) + (bx * bx + by * by) * (cy - ay) +
                     (cx * cx + cy * cy) * (ay - by)) /
                    d;
  const double uy = ((ax * ax + ay * ay) * (cx - bx) + (bx * bx + by * by) * (ax - cx) +
                     (cx * cx + cy * cy) * (bx - ax)) /
                    d;
  EXPECT_NEAR(ux, 620, 1e-9);
  EXPECT_NEAR(uy, -90, 1e-9);
  const double r = std::hypot(ax - ux, ay - uy);
  EXPECT_NEAR(r, 60, 1e-9);
  const double arc = r * std::numbers::pi;  // via lies on the far side of the chord's middle
  EXPECT_NEAR(arc, 188.50, 0.005);
  const auto length = [](const auto& a, const auto& b) {
    return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
  };
  EXPECT_NEAR(length(moves[1]->absolute[0]->position, from) + arc +
                  length(to, moves[4]->absolute[0]->position),
              428.50, 0.005);
  // 428.50 mm at 8 mm/s.
  double seconds = arc / moves[3]->motion.attributes.speed;
  seconds += length(moves[1]->absolute[0]->position, from) / moves[2]->motion.attributes.speed;
  seconds += length(to, moves[4]->absolute[0]->position) / moves[4]->motion.attributes.speed;
  EXPECT_NEAR(seconds, 53.56, 0.005);
  for (const std::size_t k : {2, 3, 4}) EXPECT_EQ(moves[k]->motion.attributes.speed, 8);
}

TEST(ProgramSamples, TwoRobotsPassPartsInTurn) {
  Machine m = machine_of("two_robots.irl");
  TestWorld w;
  const Status& s = run_to_end(m, w);
  EXPECT_EQ(fault_of(s), "");
  EXPECT_EQ(w.text, "3 parts taken\n");
  ASSERT_EQ(w.motions.size(), 3u * 5 + 3 * 3);
  // Over the table there is one robot at a time, left first.
  std::string order;
  for (const Motion& x : w.motions)
    if (std::fabs(std::fabs(x.targets[0].pose.position[1]) - 600) < 1e-9)
      order += x.attributes.robot[0];
  EXPECT_EQ(order, "lrlrlr");
  // The same again.
  Machine m2 = machine_of("two_robots.irl");
  TestWorld w2;
  run_to_end(m2, w2);
  EXPECT_EQ(w.begun, w2.begun);
  EXPECT_EQ(w.writes, w2.writes);
}

TEST(ProgramSamples, TracesAndFlattenedProgramsAreEqual) {
  for (const char* name : {"hanoi.irl", "pick_and_place.irl", "palletising.irl", "arc_weld.irl"}) {
    SCOPED_TRACE(name);
    expect_flat(traced(sample(name)));
  }
  const Trace t = traced(sample("pick_and_place.irl"));
  EXPECT_EQ(t.motion_count(), 32u);
  std::size_t waits = 0;
  for (const TraceEntry& e : t.entries) {
    if (const auto* w = std::get_if<TracedWait>(&e.what); w && w->condition) {
      ++waits;
      EXPECT_EQ(w->condition->text(t.program->code()), "part_here = TRUE");
    }
    if (const auto* m = std::get_if<TracedMotion>(&e.what); m && m->until) {
      EXPECT_EQ(m->until->text(t.program->code()), "tray_ok");
    }
  }
  EXPECT_EQ(waits, 5u);
  auto both = trace(sample("two_robots.irl"));
  ASSERT_FALSE(both.ok());
  EXPECT_NE(both.error().sentence().find("bring and take both move"), std::string::npos)
      << both.error().sentence();
}

TEST(ProgramTrace, ConditionsKeepWhatIsNotKnown) {
  const Trace t = traced(compiled(R"(PROGRAM p;
SIGNAL INPUT BOOL: a AT 1; INPUT INT: n AT 2, 8; INPUT REAL: x AT 3; OUTPUT REAL: y AT 4;
VAR INT: i := 4; ARRAY [0..3] OF REAL: v := [1.0, 2.0, 3.0, 4.0]; POSE: p := POSE(POSITION(1.0, 2.0, 3.0), ORIZYX(0.0,0.0,0.0));
PROCEDURE q(IN INT: k);
BEGIN
  WAIT FOR n = k * 2 OR x < v[k] / 4.0 AND NOT a TIMEOUT 0.1 * k;
ENDPROC;
BEGIN
  q(3);
  WAIT 0.1 SEC;
  q(1);
  WAIT FOR i = 4 AND (a OR i = 5);
  y := v[2];
  R_SPEED := 33.0;
  MOVE LIN p FRAME := POSE(POSITION(10.0, 0.0, 0.0), ORIZYX(90.0, 0.0, 0.0));
  MOVE_INC LIN p TOOL := p;
  MOVE LIN POSITION(0.0, 0.0, 1.0);
  MOVE PTP ADD_JOINT(5.0) UNTIL n - 1 = i * -1;
  MOVE_INC PTP p;
  PAUSE 'look';
  WRITE('one '); WRITE(i); WRITELN; WRITE('two');
  HALT;
ENDPROGRAM;)"));
  EXPECT_EQ(told(t, 6),
            "0 6:3 wait 0.3 n = 6 OR x < 1.0 AND NOT a\n"
            "0 10:3 wait 0.1 \n"
            "0 6:3 wait 0.1 n = 2 OR x < 0.5 AND NOT a\n"
            "0 12:3 wait -1 a\n"
            "0 13:3 write y 0 3\n"
            "0 15:3 move 1 0 1 0 0 3 0 1 2 3 1 0 0 0 |33 90 100 -1 0 100 00 100 100 0 1 0  10 0 0 "
            "0.707107 0 0 0.707107 8 1 3 0.707107 0 0 "
            "0.707107 \n"
            "0 16:3 move 2 0 1 1 0 3 0 1 2 3 1 0 0 0 |33 90 100 -1 0 100 00 100 100 0 1 0  1 2 3 1 "
            "0 0 0 ? \n"
            "0 17:3 move 3 0 1 0 0 1 0 0 0 1 1 0 0 0 |33 90 100 -1 0 100 00 100 100 0 1 0  ? \n"
            "0 18:3 move 4 0 0 0 0 5 0 0 0 0 1 0 0 0 |5 33 90 100 -1 0 100 00 100 100 0 1 0  ? "
            "until n - 1 = -4\n"
            "0 19:3 move 5 0 0 1 0 3 0 1 2 3 1 0 0 0 |33 90 100 -1 0 100 00 100 100 0 1 0  ? \n"
            "0 20:3 pause look\n"
            "0 21:3 text one 4\n\n"
            "0 21:37 text two\n"
            "0 22:3 halt\n");
  expect_flat(t);
}

TEST(ProgramTrace, WhatDependsOnAnInputIsAnErrorAtItsLine) {
  const std::string head =
      "PROGRAM p;\nSIGNAL INPUT BOOL: part_here AT 1; OUTPUT BOOL: g AT 2;\n"
      "VAR POSE: q := POSE(POSITION(1.0,2.0,3.0), ORIZYX(0.0,0.0,0.0)); INT: i;\n"
      "FUNCTION f: BOOL;\nBEGIN\n  RETURN part_here;\nENDFCT;\n"
      "PROCEDURE d;\nBEGIN\nENDPROC;\nBEGIN\n";
  const std::string tail = "\nENDPROGRAM;\n";
  EXPECT_EQ(failed_trace(head + "IF part_here THEN i := 1; ENDIF;" + tail),
            "p.irl:12:1: the flow depends on the input part_here, which has no known value. Give a "
            "value for part_here, or use it in WAIT FOR or UNTIL only.");
  EXPECT_NE(failed_trace(head + "WAIT FOR f();" + tail).find("p.irl:6:3: the flow depends on"),
            std::string::npos);
  EXPECT_EQ(failed_trace(
                head + "WAIT FOR part_here TIMEOUT 1.0;\nIF R_TIMEOUT THEN i := 1; ENDIF;" + tail),
            "p.irl:13:1: the flow depends on whether the WAIT FOR in line 12 timed out. Give "
            "values for the inputs of its condition.");
  EXPECT_NE(failed_trace(head + "MOVE LIN q UNTIL part_here DO d;" + tail)
                .find("p.irl:12:1: the flow depends on the condition of UNTIL"),
            std::string::npos);
  EXPECT_NE(failed_trace(head + "IF g THEN i := 1; ENDIF;" + tail).find("the output g"),
            std::string::npos);
  EXPECT_NE(failed_trace(head + "READLN(i);" + tail).find("operator input"), std::string::npos);
  EXPECT_NE(
      failed_trace(head + "WAIT FOR i = 1;" + tail).find("p.irl:12:1: the program waits here"),
      std::string::npos);
  TraceOptions few;
  few.most_entries = 10;
  EXPECT_NE(failed_trace(head + "LOOP MOVE LIN q; ENDLOOP;" + tail, few)
                .find("p.irl:12:6: the program does more than 10 actions"),
            std::string::npos);
  few.most_instructions = 100'000;
  EXPECT_NE(failed_trace(head + "LOOP i := 1; ENDLOOP;" + tail, few).find("more than 100000 instr"),
            std::string::npos);
  TraceOptions known;
  known.inputs["PART_HERE"] = {1, 0};
  EXPECT_EQ(failed_trace(head + "IF part_here THEN MOVE LIN q; ENDIF; WAIT FOR f();" + tail, known),
            "it went through");
  known.inputs["other"] = {1, 0};
  EXPECT_NE(failed_trace(head + tail, known).find("no signal other"), std::string::npos);
}

TEST(ProgramTrace, OldHanoiEndsWhereItShould) {
  const fs::path at = fs::path(ROBOMOSP_SOURCE_DIR) / "../shared/data/robomosp-1.4/Saves/IRL";
  if (!fs::exists(at / "HanoiPA10.irl")) GTEST_SKIP() << "the old files are not here";
  const auto p = compiled({{"HanoiPA10.irl", sample_text(at / "HanoiPA10.irl")},
                           {"PA10.ssi", sample_text(at / "PA10.ssi")}});
  auto m = Machine::load(p);
  ASSERT_TRUE(m.ok()) << m.error().sentence();
  TestWorld w;
  w.motion_seconds = 0.05;
  const Status& s = run_to_end(*m, w);
  EXPECT_EQ(fault_of(s), "");
  EXPECT_EQ(m->evaluate("estado")->value, "[0, 0, 4]");
  EXPECT_EQ(w.motions.size(), 1 + 15u * 5);
  EXPECT_EQ(w.text.substr(w.text.size() - 10), "[0, 0, 4]\n");
  EXPECT_EQ(w.motions[1].targets[0].additional, (std::vector<double>{0}));
  EXPECT_EQ(w.motions[2].targets[0].additional, (std::vector<double>{1}));
  expect_flat(traced(p));
}

}  // namespace
}  // namespace robomosp::program
