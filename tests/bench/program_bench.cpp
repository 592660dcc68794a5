// SPDX-License-Identifier: Apache-2.0
// How fast a program is compiled, run and posted: lines, instructions of three-address code a
// second, what a copy and an idle run() cost, completion in a long file, motions to KRL.
#include <benchmark/benchmark.h>

#include "support/posts.h"
#include "support/program_world.h"

#include "editing.h"
#include "krl.h"

namespace robomosp::program {
namespace {

using namespace testing;

// Whole and real arithmetic, arrays of records, a call in every eighth round.
constexpr const char* kLoop = R"(PROGRAM p;
TYPE RECORD INT: n; REAL: x; ENDRECORD: CELL;
VAR ARRAY [0..63] OF CELL: cells; INT: i, k, sum; REAL: r := 1.0;
FUNCTION half(IN REAL: v): REAL;
BEGIN
  RETURN v * 0.5;
ENDFCT;
BEGIN
  FOR i := 1 TO 2000000
    k := i MOD 64;
    cells[k].n := cells[k].n + 1;
    cells[k].x := cells[k].x + r / (k + 1);
    sum := (sum + cells[k].n * 3) MOD 1000;
    IF k MOD 8 = 0 THEN r := half(r) + 1.0; ENDIF;
  ENDFOR;
ENDPROGRAM;)";
constexpr const char* kArithmetic = R"(PROGRAM p;
VAR ARRAY [1..16] OF REAL: a; INT: i, k; REAL: s;
BEGIN
  FOR i := 1 TO 2000000
    k := k + 3;
    IF k > 16 THEN k := k - 16; ENDIF;
    s := s + 0.5;
    a[k] := a[k] * 0.5 + s;
  ENDFOR;
ENDPROGRAM;)";

void instructions(benchmark::State& state, const char* text) {
  Limits limits;
  limits.slice = std::uint64_t{1} << 60;
  const Machine fresh = loaded(text, limits);
  TestWorld w;
  std::uint64_t all = 0;
  for (auto _ : state) {
    Machine m = fresh;
    if (m.run(0, w).state != RunState::over) state.SkipWithError("it does not come to its end");
    all += m.instructions();
  }
  state.counters["instructions"] =
      benchmark::Counter(static_cast<double>(all), benchmark::Counter::kIsRate);
}
void ProgramMixed(benchmark::State& state) { instructions(state, kLoop); }
void ProgramArithmetic(benchmark::State& state) { instructions(state, kArithmetic); }
BENCHMARK(ProgramMixed)->Unit(benchmark::kMillisecond);
BENCHMARK(ProgramArithmetic)->Unit(benchmark::kMillisecond);

/// A row of a live run: a machine that waits is copied, looked at, and copied again.
void ProgramWaitingRow(benchmark::State& state) {
  Machine m = loaded("PROGRAM p; SIGNAL INPUT BOOL: a AT 1; BEGIN WAIT FOR a; ENDPROGRAM;");
  TestWorld w;
  m.run(0, w);
  double now = 0;
  for (auto _ : state) {
    const Machine row = m;
    m.run(now += 0.001, w);
    benchmark::DoNotOptimize(row);
  }
}
BENCHMARK(ProgramWaitingRow);

/// Ten lines a routine, each of which calls the one before.
std::string long_source(int routines) {
  std::string s = "PROGRAM big;\nVAR INT: i; REAL: r; POSE: p;\n";
  for (int k = 0; k < routines; ++k) {
    const std::string n = std::to_string(k);
    s += "PROCEDURE q" + n + " (IN INT: n);\nVAR REAL: z;\nBEGIN\n  z := n * 2.5 + " + n +
         ";\n  IF n > " + n + " AND z < 100.0 THEN\n    r := r + z;\n  ENDIF;\n" +
         "  MOVE LIN POSE(POSITION(z, 0.0, 100.0), ORIZYX(0.0, 180.0, 0.0)) SPEED := 80.0;\n" +
         (k ? "  q" + std::to_string(k - 1) + "(n - 1);\n" : "") + "ENDPROC;\n";
  }
  return s + "BEGIN\n  q" + std::to_string(routines - 1) + "(3);\nENDPROGRAM;\n";
}
void ProgramCompile100000Lines(benchmark::State& state) {
  const std::string text = long_source(10'000);
  const std::vector<SourceFile> files{{"p.irl", text, {}}};
  NoProgress progress;
  for (auto _ : state) {
    const auto made = irl::compile(files, progress);
    if (!made.ok() || (*made)->code().has_errors) state.SkipWithError("it does not compile");
    benchmark::DoNotOptimize(made);
  }
}
BENCHMARK(ProgramCompile100000Lines)->Unit(benchmark::kMillisecond);

/// A letter typed in the last routine of 10,000 lines: the file is read anew, and asked.
void ProgramCompletion10000Lines(benchmark::State& state) {
  std::string text = long_source(1'000);
  const std::size_t at = text.rfind("    r := r + z;");
  text.insert(at, "    q99\n");
  const auto place = static_cast<std::uint32_t>(at + std::string_view("    q99").size());
  const std::vector<SourceFile> files{{"p.irl", text, {}}};
  NoProgress progress;
  for (auto _ : state) {
    const auto items = irl::edit(files)->complete(0, place, progress);
    if (!items.ok() || items->empty()) state.SkipWithError("there are no items");
    benchmark::DoNotOptimize(items);
  }
}
BENCHMARK(ProgramCompletion10000Lines)->Unit(benchmark::kMillisecond);

/// Passes before posting, points, and the text; the program is compiled.
void Program10000MotionsToKrl(benchmark::State& state) {
  std::string text = "PROGRAM p;\nBEGIN\n";
  for (int i = 0; i < 10'000; ++i)
    text += "MOVE LIN POSE(POSITION(" + std::to_string(300 + i % 500) + ".0, " +
            std::to_string(i / 500) +
            ".0, 300.0), ORIZYX(0.0, 180.0, 0.0)) SPEED := 80.0 C_CP := 5.0;\n";
  const auto p = compiled(text + "ENDPROGRAM;\n");
  for (auto _ : state) {
    const test::Posted got = test::post_code(posts::Krl(), p->code());
    if (got.files.size() != 2) state.SkipWithError("there are not two files");
    benchmark::DoNotOptimize(got);
  }
}
BENCHMARK(Program10000MotionsToKrl)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace robomosp::program
