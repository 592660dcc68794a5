// SPDX-License-Identifier: Apache-2.0
// How fast a machine runs a program: instructions of three-address code a second, and what a copy
// and an idle run() cost.
#include <benchmark/benchmark.h>

#include "support/program_world.h"

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

}  // namespace
}  // namespace robomosp::program
