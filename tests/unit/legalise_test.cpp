// SPDX-License-Identifier: Apache-2.0
// Passes keep the meaning: what they make of a program is lowered to three-address code, run by the
// interpreter, and does what the program does. Shipped programs, constructs one by one, and random
// ones, for targets that lack this or that.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <random>
#include <set>
#include <string>
#include <variant>
#include <vector>

#include <gtest/gtest.h>
#include <robomosp/sdk/post_writer.h>

#include "checker.h"
#include "compile.h"
#include "irl_generator.h"
#include "program/trace.h"
#include "program_post/legalise.h"
#include "program_post/points.h"
#include "program_post/rewriter.h"
#include "support/seed.h"

namespace robomosp {
namespace {

namespace fs = std::filesystem;
using program::Trace;
using program::TraceEntry;

/// A language that has everything but what is named.
PostCapabilities without(std::uint64_t features, std::uint32_t motions = 0) {
  PostCapabilities c;
  c.features = ~features;
  c.motions = 0xffU & ~motions;
  c.circle = (motions & kPostCircle) ? PostCircle::none : PostCircle::via;
  c.title = "ACME";
  return c;
}

std::shared_ptr<const CompiledProgram> compiled(const std::string& text,
                                                const std::string& list = {}) {
  std::vector<SourceFile> files{{"p.irl", text, {}}};
  if (!list.empty()) files.push_back({"datalist.dls", list, {}});
  NoProgress progress;
  auto made = irl::compile(files, progress);
  EXPECT_TRUE(made.ok());
  const rmp_code& c = (*made)->code();
  for (std::uint32_t i = 0; i < c.faults.count; ++i) {
    const auto& f = row<rmp_code_fault>(c.faults, i);
    if (f.severity == RMP_FAULT_ERROR)
      ADD_FAILURE() << f.span.line << ": " << f.message << "\n" << text;
  }
  return std::shared_ptr<const CompiledProgram>(std::move(*made));
}

/// Where a language computes the parts of an expression.
enum class Parts {
  in_order,     ///< from left to right, as IRL does
  calls_first,  ///< functions before the line that calls them, as many posts write them
  right_first,  ///< from right to left, as a compiler of C may
};

/// Tables whose expressions are computed in another order than IRL's.
class Reordered final : program_post::Rewriter {
 public:
  Reordered(ProgramTables& t, Parts how) : Rewriter(t), how_(how) {}
  void run() {
    for (routine_ = 0; routine_ < t_.routines.size(); ++routine_) {
      const Id body = block(t_.routines[routine_].body);
      t_.routines[routine_].body = body;
    }
  }

 private:
  using Id = std::uint32_t;
  Id block(Id first) {
    program_post::Chain outer = std::exchange(out_, {});
    for (Id i = first; i != RMP_NONE;) {
      const Id next = std::exchange(st(i).next, RMP_NONE);
      one(i);
      append(out_, i);
      i = next;
    }
    return std::exchange(out_, outer).head;
  }
  void one(Id i) {
    const rmp_code_statement s = st(i);
    switch (s.op) {
      case RMP_STMT_ASSIGN: {
        const bool is_place_first = how_ == Parts::right_first;
        const Id early = is_place_first ? moved(s.a) : RMP_NONE;
        const Id b = moved(s.b);
        const Id a = is_place_first ? early : moved(s.a);
        st(i).a = a;
        st(i).b = b;
        return;
      }
      case RMP_STMT_CALL: {
        const Id a = with_operands(s.a);
        st(i).a = a;
        return;
      }
      case RMP_STMT_RETURN:
      case RMP_STMT_WAIT_TIME: {
        const Id a = moved(s.a);
        st(i).a = a;
        return;
      }
      case RMP_STMT_IF: {
        const Id condition = moved(st(s.body).a);
        st(s.body).a = condition;
        for (Id arm = s.body; arm != RMP_NONE; arm = st(arm).next) {
          const Id body = block(st(arm).body);
          st(arm).body = body;
        }
        return;
      }
      case RMP_STMT_CASE: {
        const Id a = moved(s.a);
        st(i).a = a;
        for (Id arm = s.body; arm != RMP_NONE; arm = st(arm).next) {
          const Id body = block(st(arm).body);
          st(arm).body = body;
        }
        return;
      }
      case RMP_STMT_FOR:
      case RMP_STMT_FOR_DOWN: {
        const Id a = moved(s.a), b = moved(s.b), c = moved(s.c);
        st(i).a = a;
        st(i).b = b;
        st(i).c = c;
        [[fallthrough]];
      }
      default: {
        const Id body = block(s.body);
        st(i).body = body;
        return;
      }
    }
  }
  Id kept(Id e) {
    const Id t = new_variable(ex(e).type, "kept", routine_, ex(e).span);
    append(out_, assignment(variable(t, ex(e).span), e, ex(e).span));
    return variable(t, ex(e).span);
  }
  Id moved(Id e) {
    if (e == RMP_NONE || is_known(e)) return e;
    if (ex(e).op == RMP_EXPR_CALL) return kept(with_operands(e));
    return with_operands(e);
  }
  Id with_operands(Id e) {
    const rmp_code_expression x = ex(e);
    std::vector<Id> all;
    for (Id k = 0; k < x.count; ++k) all.push_back(operand(e, k));
    if (x.op == RMP_EXPR_AND || x.op == RMP_EXPR_OR) {
      all[0] = moved(all[0]);
    } else if (how_ == Parts::calls_first) {
      for (Id& o : all) o = moved(o);
    } else {
      for (std::size_t k = all.size(); k-- > 0;) {
        const bool is_place = x.op == RMP_EXPR_FIELD || (x.op == RMP_EXPR_INDEX && k == 0) ||
                              (x.op == RMP_EXPR_CALL && is_out(x.symbol, k));
        all[k] = moved(all[k]);
        const auto type = t_.types[ex(all[k]).type].kind;
        if (!is_place && !is_known(all[k]) && all.size() > 1 &&
            (type <= RMP_TYPE_STRING || type == RMP_TYPE_RECORD) && x.op != RMP_EXPR_INTRINSIC)
          all[k] = kept(all[k]);
      }
    }
    return expression(x.op, x.type, x.span, all, x.symbol, x.constant);
  }
  [[nodiscard]] bool is_out(Id symbol, std::size_t k) const {
    const rmp_code_routine& r = t_.routines[t_.symbols[symbol].routine];
    return t_.symbols[r.first_parameter + static_cast<Id>(k)].mode != RMP_MODE_IN;
  }

  Parts how_;
  Id routine_ = 0;
  program_post::Chain out_;
};

struct Passed {
  std::shared_ptr<const CompiledProgram> program;
  std::string errors, warnings;
};
/// What the passes make of a program, with code.
Passed passed(const std::shared_ptr<const CompiledProgram>& from, const PostCapabilities& caps,
              double chord_mm = 0.1, Parts parts = Parts::in_order,
              std::size_t recursion_depth = 64) {
  const auto known = program_post::known_points(from->code(), nullptr, nullptr);
  program_post::LegaliseOptions options;
  options.points = known.points;
  options.chord_mm = chord_mm;
  options.recursion_depth = recursion_depth;
  auto legal = program_post::legalise(from->code(), caps, options);
  Passed out;
  for (const auto& r : legal.remarks)
    (r.severity == RMP_FAULT_ERROR ? out.errors : out.warnings) +=
        std::to_string(r.span.line) + ": " + r.message + "\n";
  if (parts != Parts::in_order) Reordered(*legal.tables, parts).run();
  for (auto& r : legal.tables->routines) r.temporary_count = r.label_count = 0;
  irl::lower(*legal.tables);
  legal.tables->seal();
  struct Both {
    std::shared_ptr<const CompiledProgram> texts;
    std::unique_ptr<ProgramTables> tables;
  };
  auto both = std::make_shared<Both>(Both{from, std::move(legal.tables)});
  out.program = std::shared_ptr<const CompiledProgram>(both, both->tables.get());
  return out;
}

std::string number(double v) { return code_text_detail::real_text(v); }
std::string entry_text(const TraceEntry& e, const rmp_code& c) {
  std::string s = std::to_string(e.span.line) + " ";
  if (const auto* m = std::get_if<program::TracedMotion>(&e.what)) {
    s += "move " + std::to_string(m->motion.interpolation) + (m->motion.is_incremental ? "i" : "") +
         " ";
    for (const auto& t : m->motion.targets) {
      s += std::to_string(t.role);
      for (const double x : t.pose.position) s += " " + number(x);
      for (const double x : t.pose.quaternion) s += " " + number(x);
      for (const double x : t.joints) s += " " + number(x);
      for (const double x : t.additional) s += " " + number(x);
      s += " " + std::to_string(t.status);
      for (const auto x : t.turns) s += " " + std::to_string(x);
    }
    const auto& a = m->motion.attributes;
    for (const double x : {a.speed, a.speed_orientation, a.acceleration, a.time, a.c_cp, a.c_speed,
                           a.speed_ptp, a.acceleration_ptp, a.c_ptp})
      s += " " + number(x);
    if (m->until) s += " until " + m->until->text(c);
  } else if (const auto* w = std::get_if<program::TracedWrite>(&e.what)) {
    s += std::string(row<rmp_code_symbol>(c.symbols, w->symbol).name) +
         " := " + std::to_string(w->value.integer) + " " + number(w->value.real);
  } else if (const auto* d = std::get_if<program::TracedWait>(&e.what)) {
    s += "wait " + number(d->seconds) + (d->condition ? d->condition->text(c) : "");
  } else if (const auto* t = std::get_if<program::TracedText>(&e.what)) {
    s += t->text;
  } else if (const auto* p = std::get_if<program::TracedPause>(&e.what)) {
    s += "pause " + p->message;
  } else {
    s += "halt";
  }
  return s;
}
/// What a program does, an entry a line; "!" and why, where it ends with a fault. WRITEs of one
/// line are one.
std::string doings(const std::shared_ptr<const CompiledProgram>& p,
                   const std::map<std::string, std::int64_t>& inputs = {},
                   std::uint64_t most_instructions = 200'000) {
  program::TraceOptions options;
  for (const auto& [name, value] : inputs)
    options.inputs[name] = {value, static_cast<double>(value)};
  options.most_instructions = most_instructions;
  options.most_entries = 20'000;
  const auto t = program::trace(p, options);
  if (!t.ok()) return "!" + t.error().message;
  std::string out;
  for (const TraceEntry& e : t->entries) out += entry_text(e, p->code()) + "\n";
  return out;
}

const std::map<std::string, std::uint64_t> kLacks{
    {"records", kPostRecords},
    {"functions", kPostFunctions},
    {"out", kPostOutParameters},
    {"recursion", kPostRecursion},
    {"recursion and locals", kPostRecursion | kPostLocals | kPostShortCircuit},
    {"recursion and records", kPostRecursion | kPostRecords | kPostFunctions | kPostOutParameters},
    {"functions and out", kPostFunctions | kPostOutParameters},
    {"short circuit", kPostShortCircuit},
    {"records, functions", kPostRecords | kPostFunctions | kPostShortCircuit},
    {"records, out", kPostRecords | kPostOutParameters | kPostFunctions | kPostShortCircuit},
    {"locals", kPostRecords | kPostFunctions | kPostShortCircuit | kPostLocals},
    {"loops", kPostElsif | kPostCase | kPostFor | kPostRepeat | kPostLoop | kPostExit},
    {"all", kPostRecursion | kPostRecords | kPostFunctions | kPostOutParameters |
                kPostShortCircuit | kPostElsif | kPostCase | kPostFor | kPostRepeat | kPostLoop |
                kPostExit}};

/// What the tables still have that they should not.
std::string left(const rmp_code& c, std::uint64_t lacks) {
  std::set<std::uint32_t> used;
  std::vector<std::uint32_t> statements;
  std::string out;
  for (std::uint32_t r = 0; r < c.routines.count; ++r) {
    const auto& x = row<rmp_code_routine>(c.routines, r);
    statements.push_back(x.body);
    if (x.kind == RMP_ROUTINE_FUNCTION && (lacks & kPostFunctions)) out += "function ";
    for (std::uint32_t k = 0; k < x.parameter_count; ++k) {
      const auto& p = row<rmp_code_symbol>(c.symbols, x.first_parameter + k);
      const auto& t = row<rmp_code_type>(c.types, p.type);
      if (p.kind != RMP_SYMBOL_PARAMETER) out += "parameter ";
      if (p.mode != RMP_MODE_IN && (lacks & kPostOutParameters)) out += "out ";
      if (t.kind == RMP_TYPE_RECORD && t.role == RMP_ROLE_NONE && (lacks & kPostRecords))
        out += "record ";
    }
  }
  std::vector<std::uint32_t> expressions;
  while (!statements.empty()) {
    const std::uint32_t i = statements.back();
    statements.pop_back();
    if (i == RMP_NONE) continue;
    const auto& s = row<rmp_code_statement>(c.statements, i);
    statements.push_back(s.next);
    statements.push_back(s.body);
    for (const std::uint32_t e : {s.a, s.b, s.c}) expressions.push_back(e);
    static constexpr std::pair<std::uint32_t, std::uint64_t> kOps[] = {
        {RMP_STMT_CASE, kPostCase}, {RMP_STMT_FOR, kPostFor},   {RMP_STMT_FOR_DOWN, kPostFor},
        {RMP_STMT_LOOP, kPostLoop}, {RMP_STMT_EXIT, kPostExit}, {RMP_STMT_REPEAT, kPostRepeat}};
    for (const auto& [op, bit] : kOps)
      if (s.op == op && (lacks & bit)) out += "statement " + std::to_string(op) + " ";
  }
  while (!expressions.empty()) {
    const std::uint32_t e = expressions.back();
    expressions.pop_back();
    if (e == RMP_NONE) continue;
    const auto& x = row<rmp_code_expression>(c.expressions, e);
    const auto& t = row<rmp_code_type>(c.types, x.type);
    if (t.kind == RMP_TYPE_RECORD && t.role == RMP_ROLE_NONE && (lacks & kPostRecords))
      out += "record value ";
    for (std::uint32_t k = 0; k < x.count; ++k) {
      const std::uint32_t o = row<std::uint32_t>(c.links, x.first + k);
      EXPECT_LT(o, e);
      expressions.push_back(o);
    }
  }
  return out;
}

void expect_same(const std::string& text) {
  const auto from = compiled(text);
  if (from->code().has_errors) return;
  const std::string want = doings(from);
  for (const auto& [name, lacks] : kLacks) {
    const Passed got = passed(from, without(lacks));
    EXPECT_EQ(got.errors, "") << name << "\n" << text;
    EXPECT_EQ(doings(got.program), want) << name << "\n" << text;
    EXPECT_EQ(left(got.program->code(), lacks), "") << name << "\n" << text;
  }
}

TEST(Legalise, ShippedProgramsDoTheSame) {
  const fs::path programs = fs::path(ROBOMOSP_SOURCE_DIR) / "scripts/programs";
  for (const char* name : {"hanoi", "pick_and_place", "palletising", "arc_weld"}) {
    std::ifstream in(programs / (std::string(name) + ".irl"), std::ios::binary);
    const std::string text{std::istreambuf_iterator<char>(in), {}};
    ASSERT_GT(text.size(), 100U);
    expect_same(text);
  }
}

TEST(Legalise, RecordsAreAssignedPassedMadeAndWritten) {
  expect_same(R"(PROGRAM p;
TYPE RECORD INT: a; REAL: r; ENDRECORD: PT;
     RECORD PT: at; ARRAY [2..3] OF INT: n; BOOL: f; POSITION: xyz; ENDRECORD: BOX;
CONST PT: HOME := PT(7, 0.5);
VAR
  PT: p0 := PT(1, 2.5), p1, p2 := p0;
  BOX: b := BOX(PT(3, 4.5), [5, 6], TRUE, POSITION(1.0, 2.0, 3.0)), c;
  ARRAY [0..2] OF BOX: all;
  ARRAY [1..2] OF ARRAY [-1..0] OF PT: grid;
  INT: i, calls := 0, first := p0.a;

FUNCTION next (IN INT: by): INT;
BEGIN calls := calls + by; RETURN calls; ENDFCT;
FUNCTION made (IN INT: a; IN PT: q): PT;
VAR PT: mine;
BEGIN
  mine := q;
  mine.a := mine.a + a;
  calls := calls + 1;
  IF a > 100 THEN RETURN PT(mine.a, -1.0); ENDIF;
  RETURN mine;
ENDFCT;
FUNCTION boxed (INOUT INT: k; IN BOX: x): BOX;
VAR BOX: y;
BEGIN
  k := k + 1;
  y := x;
  y.at := made(k, x.at);
  y.n[2] := x.n[3];
  RETURN y;
ENDFCT;
PROCEDURE exchange (INOUT PT: a; INOUT PT: c);
VAR PT: t;
BEGIN t := a; a := c; c := t; ENDPROC;
PROCEDURE clear (OUT BOX: x; IN INT: a);
BEGIN x.at := PT(a, 0.0); x.f := FALSE; ENDPROC;
FUNCTION sum (IN BOX: x; IN ARRAY [2..3] OF INT: n): INT;
BEGIN RETURN x.at.a + n[2] + n[3]; ENDFCT;
BEGIN
  WRITELN(first, p0, p1, p2, b, HOME);
  p1 := PT(p0.a + 1, p0.r);
  p0 := PT(ROUND(p0.r), p0.a * 1.0);           { each part sees the old value }
  WRITELN(p0, p1);
  c := b;
  c.at := made(3, c.at);
  all[0] := c; all[1] := boxed(i, all[0]); all[next(1) MOD 3] := all[1];
  WRITELN(all, i, calls);
  grid[1][0] := made(next(1), PT(next(1), 1.5)); grid[2][-1] := grid[1][0];
  grid[2][0].a := made(1, grid[1][0]).a + made(2, HOME).a * next(2);
  WRITELN(grid);
  exchange(p0, p1); exchange(b.at, c.at);
  WRITELN(p0, p1, b, c);
  clear(all[2], next(1)); WRITELN(all[2]);
  IF made(1, p0).a > 3 AND next(1) > 2 THEN WRITELN('yes', calls);
  ELSIF made(101, p0).a = 0 OR next(1) = 9 THEN WRITELN('perhaps');
  ELSIF boxed(i, c).f THEN WRITELN('boxed', i);
  ELSE WRITELN('no');
  ENDIF;
  WHILE made(i, p0).a < 40 AND next(1) < 60
    i := i + made(1, p1).a;
    IF i > 25 THEN EXIT; ENDIF;
  ENDWHILE;
  REPEAT i := i - 1; UNTIL next(1) > 20 OR made(1, p0).a < 0;
  FOR i := made(0, p0).a TO made(next(0), p0).a + 2
    WRITE(i, ' ', sum(all[i MOD 3], [i, next(1)]), ' ');
  ENDFOR;
  CASE made(1, p0).a OF WHEN 1, 2: WRITELN('low'); DEFAULT: WRITELN('high', calls); ENDCASE;
  i := next(1) + i * next(2) - made(1, PT(next(3), 0.0)).a;
  WRITELN(i, calls, next(1), calls);
ENDPROGRAM;
)");
}

TEST(Legalise, LocalsBeginWithValuesOfParametersThatHaveBeenTakenApart) {
  expect_same(R"(PROGRAM p;
TYPE RECORD INT: a, c; ENDRECORD: BOX;
VAR BOX: b := BOX(3, 4); INT: x := 5;
PROCEDURE f (IN INT: d; INOUT INT: y; INOUT BOX: b);
VAR INT: l := 2 * d + y, m := b.a * l; BOX: mine := b;
BEGIN
  b.c := l; y := m + mine.c; WRITELN(l, ' ', m, ' ', mine, b);
ENDPROC;
BEGIN
  f(7, x, b); f(x, x, b); WRITELN(x, b);
ENDPROGRAM;
)");
}

TEST(Legalise, TheRightSideOfAndAndOrIsLookedAtWhereItCounts) {
  expect_same(R"(PROGRAM p;
VAR ARRAY [1..3] OF INT: a := [4, 5, 6]; INT: i := 9, zero, n; BOOL: b; POSE: q;
SIGNAL INPUT BOOL: ready AT 1; OUTPUT BOOL: lamp AT 2;
FUNCTION asked (IN INT: k): BOOL; BEGIN n := n + k; RETURN k > 1; ENDFCT;
BEGIN
  IF i <= 3 AND a[i] = 4 THEN WRITELN('in'); ELSE WRITELN('out'); ENDIF;
  IF i > 3 OR a[i] = 4 THEN WRITELN('in'); ENDIF;
  b := zero <> 0 AND 10 DIV zero = 1; WRITELN(b);
  lamp := zero = 0 OR 10 MOD zero = 1;
  b := asked(1) AND asked(2) OR asked(3) AND NOT asked(4); WRITELN(b, n);
  i := 1;
  WHILE i <= 3 AND a[i] > 0 i := i + 1; IF i = 2 AND asked(1) THEN EXIT; ENDIF; ENDWHILE;
  WRITELN(i, n);
  i := 3;
  REPEAT i := i - 1; UNTIL i < 1 OR a[i] = 4;
  WRITELN(i);
  WAIT FOR ready AND (i = 1) TIMEOUT 2.0;
  MOVE LIN q UNTIL ready OR lamp;
ENDPROGRAM;
)");
}

constexpr const char* kOrder = R"(PROGRAM p;
TYPE RECORD INT: a; ARRAY [0..3] OF INT: n; ENDRECORD: PT;
VAR ARRAY [0..9] OF INT: a := [1, 2, 3, 4, 5, 6, 7, 8, 9, 10]; ARRAY [0..3] OF PT: g;
    INT: i := 1, k := 2, x; BOOL: b;
SIGNAL OUTPUT INT: level AT 4, 8;
FUNCTION up (INOUT INT: w; IN INT: by): INT; BEGIN w := (w + by) MOD 4; RETURN w; ENDFCT;
FUNCTION grown (IN INT: by): INT; BEGIN k := (k + by) MOD 4; RETURN k; ENDFCT;
FUNCTION set (IN INT: v): INT; BEGIN level := v; RETURN v; ENDFCT;
FUNCTION deep (IN INT: by): INT; BEGIN RETURN grown(by) + 1; ENDFCT;
FUNCTION made (IN INT: a): PT; VAR PT: p; BEGIN p.a := a; i := (i + 1) MOD 4; RETURN p; ENDFCT;
FUNCTION sum (IN INT: p; IN INT: q; IN INT: r): INT; BEGIN RETURN p * 100 + q * 10 + r; ENDFCT;
PROCEDURE within (INOUT INT: p); BEGIN x := p + grown(1); p := p * 2 + up(k, 1) - p; ENDPROC;
PROCEDURE two (IN INT: p; INOUT INT: q); BEGIN q := p; ENDPROC;
BEGIN
  x := i + up(i, 1); WRITELN(x); x := up(i, 1) + i; WRITELN(x);
  x := i * (k - grown(3)) + deep(1) * k; WRITELN(x, i, k);
  x := a[i] + up(i, 1) + a[i]; WRITELN(x); x := a[up(i, 1)] - i * grown(1); WRITELN(x, k);
  a[i] := up(i, 1); a[up(i, 1)] := i + 6; a[up(i, 1)] := up(i, 2) + grown(i); WRITELN(a, i, k);
  g[i].n[up(i, 1)] := i; g[up(i, 1)].n[i] := g[i].n[up(i, 3)] + i; WRITELN(g, i);
  g[i] := made(i); g[grown(1)] := made(k); WRITELN(g, i, k);
  x := sum(i, up(i, 1), i); WRITELN(x, sum(k, deep(1), grown(1)));
  two(i, a[up(i, 1)]); two(up(i, 1), a[i]); WRITELN(a, i);
  within(i); WRITELN(x, i, k);
  level := 5; x := level + set(3) + level; x := set(1) + level * set(2) + level; WRITELN(x);
  b := i > 0 AND i + up(i, 1) > 3 OR k = grown(1); WRITELN(b, i, k);
  IF k + grown(1) > k THEN WRITELN('more'); ELSIF i < up(i, 1) THEN WRITELN('less'); ENDIF;
  x := 0; WHILE i + up(i, 1) <> 3 AND x < 9 x := x + 1; ENDWHILE; WRITELN(x, i);
  REPEAT x := x - 1; UNTIL k + grown(1) > 4 OR x < 0; WRITELN(x, k);
  FOR x := i TO i + up(i, 3) STEP ABS(i) + 1 WRITE(x); ENDFOR; WRITELN(i);
  CASE i + up(i, 1) OF WHEN 1: WRITELN('one'); WHEN 3, 5: WRITELN('odd'); ENDCASE;
  WRITELN(i, ' ', up(i, 1), ' ', i, k, grown(2), k);
ENDPROGRAM;
)";

TEST(Legalise, WhatACallChangesIsTheSameInWhateverOrderPartsAreComputed) {
  expect_same(kOrder);
  const auto from = compiled(kOrder);
  const std::string want = doings(from);
  ASSERT_FALSE(want.starts_with("!")) << want;
  for (const Parts parts : {Parts::calls_first, Parts::right_first}) {
    for (const auto& [name, lacks] : kLacks)
      EXPECT_EQ(doings(passed(from, without(lacks), 0.1, parts).program), want)
          << static_cast<int>(parts) << " " << name;
  }
}

TEST(Legalise, AComputedStepCountsBothWays) {
  const char* const kText = R"(PROGRAM p;
VAR INT: i, n, last := 9;
BEGIN
  FOR n := -3 TO 3
    IF n <> 0 THEN
      FOR i := 1 TO last STEP n WRITE(i, ' '); IF i > 5 THEN EXIT; ENDIF; ENDFOR; WRITE('|');
      FOR i := last TO 1 STEP n WRITE(i, ' '); ENDFOR; WRITE('|', i);
      FOR i := last DOWNTO 1 STEP n WRITE(i, ' '); last := last + 1; ENDFOR; WRITE('|');
      FOR i := 1 DOWNTO 6 STEP n WRITE(i, ' '); ENDFOR; WRITELN('|', i);
    ENDIF;
  ENDFOR;
ENDPROGRAM;
)";
  expect_same(kText);
  const auto from = compiled(kText);
  const std::string said = doings(from);
  ASSERT_FALSE(said.starts_with("!")) << said;
  EXPECT_NE(said.find("9 6 3 |"), std::string::npos) << said;
  EXPECT_NE(said.find("1 4 |"), std::string::npos) << said;
}

TEST(Legalise, AParameterThatIsChangedMayBeAVariableOfTheProgram) {
  const auto from = compiled(R"(PROGRAM p;
VAR INT: k := 2, x; ARRAY [1..3] OF INT: a := [5, 6, 7];
FUNCTION grown (IN INT: by): INT; BEGIN k := k + by; RETURN k; ENDFCT;
FUNCTION up (INOUT INT: w): INT; BEGIN w := w + 3; RETURN w; ENDFCT;
PROCEDURE within (INOUT INT: p; INOUT INT: q);
VAR INT: mine := 1;
BEGIN
  x := p + grown(1) * q; WRITELN(x, p);
  x := k * up(p) - q; WRITELN(x, q);
  x := q + up(p) + a[1]; WRITELN(x, q, a[1]);
  x := a[1] + up(q) + mine * up(mine); WRITELN(x, mine);
ENDPROC;
BEGIN
  within(k, k); within(a[1], k); within(a[2], a[1]);
ENDPROGRAM;
)");
  const std::string want = doings(from);
  ASSERT_FALSE(want.starts_with("!")) << want;
  for (const Parts parts : {Parts::calls_first, Parts::right_first})
    EXPECT_EQ(doings(passed(from, without(0), 0.1, parts).program), want)
        << static_cast<int>(parts);
}

TEST(Legalise, FunctionsThatChangeNothingAddNoVariable) {
  const auto from = compiled(R"(PROGRAM p;
VAR INT: i := 1, x; ARRAY [1..3] OF INT: a;
FUNCTION twice (IN INT: p): INT; VAR INT: t; BEGIN t := p + i; RETURN 2 * t; ENDFCT;
BEGIN
  x := i + twice(i) + a[twice(1)] * twice(twice(i));
  a[twice(x)] := x + twice(3);
ENDPROGRAM;
)");
  PostCapabilities caps = without(0);
  const auto legal = program_post::legalise(from->code(), caps);
  EXPECT_EQ(legal.tables->symbols.size(), from->code().symbols.count);
}

// ---- recursion ----

/// Runs with each of some inputs, rewritten for languages without recursion and this or that.
void expect_same_recursion(const std::string& text, const std::string& input,
                           const std::vector<std::int64_t>& values) {
  const auto from = compiled(text);
  ASSERT_FALSE(from->code().has_errors);
  for (const auto& [name, lacks] : kLacks) {
    for (const Parts parts : {Parts::in_order, Parts::calls_first, Parts::right_first}) {
      const Passed got = passed(from, without(lacks | kPostRecursion), 0.1, parts);
      ASSERT_EQ(got.errors, "") << name << "\n" << text;
      EXPECT_EQ(left(got.program->code(), lacks), "") << name << "\n" << text;
      for (std::uint32_t r = 0; r < got.program->code().routines.count; ++r)
        EXPECT_EQ(row<rmp_code_routine>(got.program->code().routines, r).is_recursive, 0U);
      for (const std::int64_t value : values) {
        const std::string want = doings(from, {{input, value}});
        ASSERT_FALSE(want.starts_with("!")) << want;
        EXPECT_EQ(doings(got.program, {{input, value}}, 4'000'000), want)
            << name << ", parts " << static_cast<int>(parts) << ", " << input << " " << value
            << "\n"
            << text;
      }
    }
  }
}

TEST(Legalise, HanoiOfAsManyDiscsAsAnInputSaysIsALoop) {
  expect_same_recursion(R"(PROGRAM p;
SIGNAL INPUT INT: discs AT 1, 8; OUTPUT BOOL: gripper AT 3;
TYPE RECORD INT: discs; POSITION: foot; ENDRECORD: PEG;
VAR ARRAY [1..3] OF PEG: pegs := [PEG(0, POSITION(600.0, -250.0, 0.0)),
      PEG(0, POSITION(600.0, 0.0, 0.0)), PEG(0, POSITION(600.0, 250.0, 0.0))];
    ORIENTATION: down := ORIZYX(0.0, 180.0, 0.0);
    INT: carried;
PROCEDURE carry (IN INT: source, goal);
BEGIN
  MOVE LIN POSE(POSITION(600.0, 250.0 * source - 500.0, 30.0 * pegs[source].discs), down);
  gripper := TRUE;
  pegs[source].discs := pegs[source].discs - 1;
  pegs[goal].discs := pegs[goal].discs + 1;
  MOVE LIN POSE(POSITION(600.0, 250.0 * goal - 500.0, 30.0 * pegs[goal].discs), down);
  gripper := FALSE;
  carried := carried + 1;
ENDPROC;
PROCEDURE solve (IN INT: n, source, goal, other);
BEGIN
  IF n > 0 THEN
    solve(n - 1, source, other, goal);
    carry(source, goal);
    solve(n - 1, other, goal, source);
  ENDIF;
ENDPROC;
BEGIN
  pegs[1].discs := discs;
  solve(discs, 1, 3, 2);
  WRITELN(carried, pegs);
ENDPROGRAM;
)",
                        "discs", {0, 1, 2, 5});
}

TEST(Legalise, FunctionsThatCallThemselvesWithinExpressionsAreLoops) {
  expect_same_recursion(R"(PROGRAM p;
SIGNAL INPUT INT: n AT 1, 8;
VAR INT: k, calls; ARRAY [0..9] OF INT: a := [3, 1, 4, 1, 5, 9, 2, 6, 5, 3]; REAL: x;
FUNCTION fact (IN INT: n): INT;
BEGIN
  IF n <= 1 THEN RETURN 1; ENDIF;
  RETURN fact(n - 1) * n;
ENDFCT;
FUNCTION fib (IN INT: n): INT;
BEGIN
  calls := calls + 1;
  IF n < 2 THEN RETURN n; ENDIF;
  RETURN fib(n - 1) + fib(n - 2);
ENDFCT;
FUNCTION ackermann (IN INT: m, n): INT;
BEGIN
  IF m = 0 THEN RETURN n + 1; ELSIF n = 0 THEN RETURN ackermann(m - 1, 1); ENDIF;
  RETURN ackermann(m - 1, ackermann(m, n - 1));
ENDFCT;
FUNCTION power (IN REAL: b; IN INT: e): REAL;
VAR REAL: half;
BEGIN
  IF e = 0 THEN RETURN 1.0; ENDIF;
  half := power(b, e DIV 2);
  IF e MOD 2 = 0 THEN RETURN half * half; ENDIF;
  RETURN b * half * half;
ENDFCT;
FUNCTION found (IN INT: what, at): BOOL;
BEGIN RETURN at <= 9 AND (a[at] = what OR found(what, at + 1)); ENDFCT;
FUNCTION least (IN INT: at): INT;
VAR INT: rest := 99;
BEGIN
  IF at < 9 THEN rest := least(at + 1); ENDIF;
  IF a[at] < rest THEN RETURN a[at]; ENDIF;
  RETURN rest;
ENDFCT;
FUNCTION digits (IN INT: v): STRING;
BEGIN
  IF v < 10 THEN RETURN 'x'; ENDIF;
  RETURN CONCAT(digits(v DIV 10), 'y');
ENDFCT;
BEGIN
  k := 2 * fact(n) + fact(fact(3)) - n;
  WRITELN(k, fib(n), calls, fib(n - 1) - calls);
  WRITELN(ackermann(2, n MOD 3), power(1.5, n), found(n, 0), found(9, n), least(n));
  WHILE k > 0 AND fib(k MOD 7) <> 8 k := k - 1; ENDWHILE;
  WRITELN(k, a[fact(3)], digits(1000 * n + 7));
  FOR k := fact(2) TO fib(5) STEP fact(2) WRITE(k); ENDFOR;
  CASE fact(n) OF WHEN 1: WRITELN('one'); WHEN 2, 6: WRITELN('few'); DEFAULT: WRITELN('many'); ENDCASE;
ENDPROGRAM;
)",
                        "n", {0, 1, 3, 7});
}

TEST(Legalise, RoutinesThatCallEachOtherAreOneLoop) {
  expect_same_recursion(R"(PROGRAM p;
SIGNAL INPUT INT: n AT 1, 8;
VAR INT: steps; BOOL: b;
FUNCTION even (IN INT: n): BOOL;
BEGIN
  steps := steps + 1;
  IF n = 0 THEN RETURN TRUE; ENDIF;
  RETURN odd(n - 1);
ENDFCT;
FUNCTION odd (IN INT: n): BOOL;
BEGIN
  IF n = 0 THEN RETURN FALSE; ENDIF;
  RETURN even(n - 1);
ENDFCT;
PROCEDURE draw (IN INT: level; IN REAL: length);
VAR INT: side;
BEGIN
  IF level = 0 THEN
    MOVE_INC LIN POSE(POSITION(length, 1.0 * steps, 0.0), ORIZYX(0.0, 0.0, 0.0));
    RETURN;
  ENDIF;
  FOR side := 1 TO 3
    IF side = 2 AND even(level) THEN turn(level - 1, length / 2.0);
    ELSE draw(level - 1, length / 3.0);
    ENDIF;
  ENDFOR;
  WRITELN(side, level);
ENDPROC;
PROCEDURE turn (IN INT: level; IN REAL: length);
BEGIN
  steps := steps + 10;
  draw(level, length);
  IF odd(level) THEN RETURN; ENDIF;
  WAIT 0.1 SEC;
  draw(level, -length);
ENDPROC;
BEGIN
  b := odd(n); WRITELN(even(n), b, even(n + 1), steps);
  draw(n MOD 4, 90.0); turn(1, 5.0);
  WRITELN(steps);
ENDPROGRAM;
)",
                        "n", {0, 1, 2, 3, 11});
}

TEST(Legalise, ParametersThatAreChangedAndLocalsAreThoseOfTheirCall) {
  expect_same_recursion(R"(PROGRAM p;
TYPE RECORD INT: a; ARRAY [0..2] OF INT: n; ENDRECORD: BOX;
SIGNAL INPUT INT: n AT 1, 8;
VAR INT: g, x, y; ARRAY [1..4] OF INT: a := [10, 20, 30, 40]; BOX: b;
    POSE: q := POSE(POSITION(1.0, 2.0, 3.0), ORIZYX(0.0, 90.0, 0.0));
PROCEDURE pegs (IN INT: n; INOUT INT: a, b, c);
BEGIN
  IF n = 0 THEN RETURN; ENDIF;
  pegs(n - 1, a, c, b);
  a := a - 1; b := b + 1;
  WRITE(a, b, c);
  pegs(n - 1, c, b, a);
ENDPROC;
FUNCTION gcd (IN INT: a, b; OUT INT: u, v): INT;
VAR INT: g, s, t;
BEGIN
  IF b = 0 THEN u := 1; v := 0; RETURN a; ENDIF;
  g := gcd(b, a MOD b, s, t);
  u := t; v := s - a DIV b * t;
  RETURN g;
ENDFCT;
PROCEDURE fill (IN INT: at; INOUT BOX: b; IN ARRAY [1..3] OF INT: by);
VAR BOX: mine; ARRAY [1..3] OF INT: next; INT: k, sum;
BEGIN
  mine.a := mine.a + at;
  IF at > 2 THEN b.a := b.a + 100; RETURN; ENDIF;
  FOR k := 1 TO 3 next[k] := by[k] + at; ENDFOR;
  b.n[at] := by[1];
  fill(at + 1, mine, next);
  fill(at + 1, b, next);
  sum := sum + next[1] + next[3];
  WRITELN(at, b, mine, next, sum);
ENDPROC;
FUNCTION depth (INOUT INT: most; IN POSE: p): INT;
VAR POSE: q; INT: left; INT: twice := 2 * most;
BEGIN
  left := most;
  most := most - 1;
  IF most < 0 THEN RETURN 0; ENDIF;
  q := p;
  q.POS.Z := q.POS.Z + 10.0;
  g := 1 + depth(most, q) * 2 + left;
  MOVE LIN q SPEED := 50.0 + left;
  WRITELN(most, left, twice);
  RETURN g;
ENDFCT;
BEGIN
  x := 3; y := 5; pegs(n MOD 5, x, a[n MOD 2 + 3], y); WRITELN;
  WRITELN(x, y, a);
  g := gcd(84 + n, 36, x, y); WRITELN(g, x, y, g + gcd(n, 12, x, y) * x);
  fill(0, b, [1, 2, n]); WRITELN(b);
  x := n MOD 4; WRITELN(x + depth(x, q) + x, g);
ENDPROGRAM;
)",
                        "n", {0, 1, 3, 9});
}

TEST(Legalise, LoopsJumpsAndCasesWithCallsOfTheirOwnRoutineAreSteps) {
  expect_same_recursion(R"(PROGRAM p;
SIGNAL INPUT INT: n AT 1, 8; OUTPUT INT: level AT 4, 8;
VAR INT: g, k; ARRAY [0..3] OF INT: a := [1, 2, 3, 4];
FUNCTION walk (IN INT: d): INT;
VAR INT: i, sum, t; REAL: r;
BEGIN
  level := ABS(d);
  IF d <= 0 THEN RETURN 1; ENDIF;
  FOR i := d DOWNTO 1 STEP 2 sum := sum + walk(i - 1); ENDFOR;
  FOR i := 1 TO d + 1 IF i = 3 THEN EXIT; ENDIF; sum := sum + i; IF i = 2 AND walk(d - 2) = 1 THEN EXIT; ENDIF; ENDFOR;
  t := i;
  WHILE t > 0 AND walk(d - 1) > t
    t := t - 1;
    IF t = 2 THEN sum := sum + 1000; EXIT; ENDIF;
  ENDWHILE;
  REPEAT
    i := i - 1;
    CASE i MOD 4 OF
      WHEN 0: sum := sum + 1;
      WHEN 1, 2: sum := sum + walk(d - 3); IF sum > 5000 THEN RETURN sum; ENDIF;
    ENDCASE;
  UNTIL i < 1 OR walk(d - 3) < 0;
  CASE walk(d - 2) OF WHEN 1: g := g + 1; DEFAULT: g := g + walk(d - 4); ENDCASE;
  LOOP
    t := t + 1;
    IF t > 3 THEN EXIT; ENDIF;
    LOOP sum := sum + 1; IF sum MOD 3 = 0 THEN EXIT; ENDIF; IF walk(d - 5) > 1 THEN RETURN -1; ENDIF; ENDLOOP;
  ENDLOOP;
  LABEL again:
  IF t > 0 THEN t := t - 1; sum := sum + walk(d - 4); IF t = 1 THEN GOTO past; ENDIF; GOTO again; ENDIF;
  LABEL past:
  a[walk(d - 3) MOD 4] := walk(d - 4) + a[i MOD 4 + 1];
  FOR k := -1 TO walk(d - 5) STEP ABS(d) r := 0.5 * k; sum := sum + ROUND(r * walk(d - 5)); ENDFOR;
  FOR g := t DOWNTO -3 STEP walk(d - 4) t := t + walk(d - 5) MOD 3; ENDFOR;
  IF walk(d - 3) = 1 THEN sum := sum + 7; ELSIF walk(d - 4) = 1 THEN sum := sum * 2; ELSE g := g + 3; ENDIF;
  RETURN sum MOD 9000 + i;
ENDFCT;
BEGIN
  WRITELN(walk(n), g, a, level);
ENDPROGRAM;
)",
                        "n", {0, 1, 2, 3, 4});
}

TEST(Legalise, WhatMayMeanSomethingElseAsALoopIsAnErrorAtItsLine) {
  const auto p = compiled(R"(PROGRAM p;
SIGNAL OUTPUT INT: lamp AT 4, 8;
VAR INT: g, h, x; ARRAY [1..2] OF INT: a; POSE: q; BOOL: b;
PROCEDURE down (INOUT INT: v; IN INT: n);
BEGIN IF n > 0 THEN g := g + v; v := v + 1; down(v, n - 1); ENDIF; ENDPROC;
PROCEDURE two (INOUT INT: v, w; IN INT: n);
BEGIN IF n > 0 THEN v := v + w; two(w, v, n - 1); ENDIF; ENDPROC;
PROCEDURE between (INOUT INT: v);
BEGIN down(v, 2); ENDPROC;
FUNCTION f (IN INT: n): INT;
VAR LIST OF INT: l;
BEGIN IF n > 0 THEN RETURN f(n - 1); ENDIF; RETURN 0; ENDFCT;
FUNCTION w (IN INT: n): INT;
BEGIN IF n > 0 THEN WAIT FOR w(n - 1) = 0; ENDIF; RETURN 0; ENDFCT;
PROCEDURE finish (IN INT: n);
BEGIN IF n > 0 THEN finish(n - 1); ENDIF; ENDPROC;
PROCESS side; BEGIN finish(3); h := h + 1; ENDPROCESS;
BEGIN
  down(x, 3); down(a[1], 3);
  down(g, 3);
  two(a[1], x, 3);
  two(a[1], a[2], 3);
  between(x);
  between(g);
  finish(2); x := f(3) + w(2); START side;
ENDPROGRAM;
)");
  const std::string begins = "ACME has no recursive routines, ";
  EXPECT_EQ(
      passed(p, without(kPostRecursion)).errors,
      "20: " + begins +
          "what down changes by a parameter is a copy, and it reaches g and also by its name\n"
          "9: " +
          begins +
          "what down changes by a parameter is a copy, and it reaches v and also by its name\n"
          "22: " +
          begins +
          "what two changes by a parameter is a copy, and it reaches a by two "
          "of them\n"
          "11: " +
          begins +
          "and l of f has a type that cannot be saved during recursion\n"
          "15: " +
          begins +
          "and finish, which does, is called by several processes or "
          "interrupts\n"
          "14: ACME has no functions within WAIT FOR used as values there\n");
  const auto q = compiled(R"(PROGRAM p;
SIGNAL INPUT BOOL: stop AT 1;
VAR POSE: there := POSE(POSITION(1.0, 2.0, 3.0), ORIZYX(0.0, 0.0, 0.0));
PROCEDURE back (IN INT: n); BEGIN IF n > 0 THEN back(n - 1); ENDIF; go; ENDPROC;
PROCEDURE end; BEGIN back(2); ENDPROC;
PROCEDURE go; BEGIN MOVE LIN there UNTIL stop DO end; ENDPROC;
BEGIN go; ENDPROGRAM;
)");
  EXPECT_EQ(passed(q, without(kPostRecursion)).errors,
            "6: " + begins +
                "and go does so through the procedure called at the end of a motion (DO): end\n");
  const auto r = compiled(R"(PROGRAM p;
VAR INT: x;
FUNCTION f (IN INT: n): INT; BEGIN IF n > 0 THEN RETURN f(n - 1); ENDIF; RETURN 0; ENDFCT;
INTERRUPT i WHEN f(3) = 1; BEGIN x := 1; ENDINTERRUPT;
BEGIN ENABLE i; WAIT 1.0 SEC; ENDPROGRAM;
)");
  EXPECT_EQ(passed(r, without(kPostRecursion)).errors,
            "3: " + begins + "and f, which does, is called by the condition of an interrupt\n");
  EXPECT_NE(
      passed(p, without(kPostRecursion | kPostArrays | kPostWhile))
          .errors.find("as down does, and lacks the features needed for a stack (WHILE, arrays)"),
      std::string::npos);
}

TEST(Legalise, MoreCallsThanTheStackHoldsEndTheProgramWithAMessage) {
  const auto from = compiled(R"(PROGRAM p;
SIGNAL INPUT INT: n AT 1, 8; OUTPUT INT: level AT 4, 8;
FUNCTION sum (IN INT: n): INT;
BEGIN
  level := n;
  IF n <= 1 THEN RETURN n; ENDIF;
  RETURN n + sum(n - 1);
ENDFCT;
BEGIN
  WRITELN(sum(n));
  level := 99;
ENDPROGRAM;
)");
  const Passed got = passed(from, without(kPostRecursion), 0.1, Parts::in_order, 8);
  EXPECT_EQ(got.errors, "");
  EXPECT_EQ(got.warnings,
            "3: ACME has no recursive routines, such as sum does: it is a loop with a stack "
            "there, for at most 8 nested calls\n");
  EXPECT_EQ(doings(got.program, {{"n", 8}}), doings(from, {{"n", 8}}));
  const std::string ended = doings(got.program, {{"n", 9}});
  EXPECT_NE(ended.find("5 level := 2 "), std::string::npos) << ended;
  EXPECT_EQ(ended.find("level := 1 "), std::string::npos) << ended;
  EXPECT_TRUE(ended.ends_with("7 sum: too deep\n7 halt\n") ||
              ended.ends_with("7 sum: too deep\n\n7 halt\n"))
      << ended;
}

TEST(Legalise, ConditionsThatAreAskedAgainAndDependOnTheOrderAreErrors) {
  const auto p = compiled(R"(PROGRAM p;
VAR INT: n; POSE: q;
FUNCTION f (INOUT INT: k): INT; BEGIN k := k + 1; RETURN k; ENDFCT;
BEGIN
  WAIT FOR f(n) > 3;
  WAIT FOR n + f(n) > 3;
  MOVE LIN q UNTIL f(n) < n;
ENDPROGRAM;
)");
  const std::string what =
      ": which part of this condition ACME computes first is not defined, and a function in it "
      "changes variables read by another part\n";
  EXPECT_EQ(passed(p, without(0)).errors, "6" + what + "7" + what);
}

TEST(Legalise, TaughtValuesAreThoseOfTheListOfData) {
  const std::string list =
      "n := 7;\nplace := POSE(POSITION(1.0, 2.0, 3.0), ORIZYX(90.0, 0.0, 0.0));\n"
      "crate := BOX(3, [4, 5]);\nn := 8;\nlate := 2.5;\n";
  const std::string head = R"(PROGRAM p;
TYPE RECORD INT: a; ARRAY [1..2] OF INT: b; ENDRECORD: BOX;
VAR INT: n := 1, k; POSE: place; BOX: crate; REAL: late;
)";
  // Before anything reads them, behind, in loops and routines, several at once.
  for (const char* body :
       {"BEGIN\n  TEACH n, place, crate; WRITELN(n, place, crate); MOVE LIN place;\n",
        "PROCEDURE again; BEGIN TEACH n, late; ENDPROC;\nBEGIN\n"
        "  WRITELN(n, late); again; n := n + 1; WRITELN(n, late); TEACH crate; crate.a := 9;\n"
        "  WRITELN(crate); TEACH crate; WRITELN(crate);\n",
        "BEGIN\n  FOR k := 1 TO 3\n    n := n + k; WRITELN(n);\n    IF k = 2 THEN TEACH n; ENDIF;\n"
        "  ENDFOR; WRITELN(n);\n",
        "FUNCTION f: INT; BEGIN RETURN n; ENDFCT;\nBEGIN\n  WRITELN(f); TEACH n; WRITELN(f);\n",
        "BEGIN\n  IF k = 0 THEN GOTO past; ENDIF;\n  TEACH n;\n  LABEL past: WRITELN(n);\n",
        "BEGIN\n  k := k + 1; TEACH place; LABEL again: k := k + 1; TEACH n; WRITELN(n, place);\n"
        "  IF k < 5 THEN GOTO again; ENDIF;\n"}) {
    const std::string text = head + body + "ENDPROGRAM;\n";
    for (const auto& [name, lacks] : kLacks) {
      const Passed got = passed(compiled(text, list), without(lacks | kPostTeach));
      EXPECT_EQ(got.errors, "") << name;
      const std::string want = doings(compiled(text, list));
      EXPECT_FALSE(want.starts_with("!")) << want;
      EXPECT_EQ(doings(got.program), want) << name << "\n" << text;
      for (std::uint32_t i = 0; i < got.program->code().statements.count; ++i)
        EXPECT_NE(row<rmp_code_statement>(got.program->code().statements, i).op,
                  std::uint32_t{RMP_STMT_TEACH});
    }
  }
}

TEST(Legalise, WhatCannotBeRewrittenIsAnErrorAtItsLine) {
  const auto p = compiled(R"(PROGRAM p;
VAR INT: n; POSE: q; ARRAY [1..2] OF INT: a;
FUNCTION f (INOUT INT: k): BOOL; BEGIN k := k + n; RETURN k > 3; ENDFCT;
PROCEDURE two (INOUT INT: a, b); BEGIN a := b; ENDPROC;
BEGIN
  WAIT FOR f(n);
  MOVE LIN q UNTIL f(a[1]);
  two(a[1], a[2]);
  IF f(n) THEN n := 1; ENDIF;
ENDPROGRAM;
)");
  EXPECT_EQ(passed(p, without(kPostFunctions)).errors,
            "6: ACME has no functions within WAIT FOR used as values there\n"
            "7: ACME has no functions within UNTIL used as values there\n");
  EXPECT_EQ(
      passed(p, without(kPostOutParameters)).errors,
      "6: ACME has no functions within WAIT FOR used as values there\n"
      "7: ACME has no functions within UNTIL used as values there\n"
      "8: ACME has no parameters passed by reference, and two reaches a by two of them\n"
      "9: ACME has no parameters passed by reference, and f reaches n and also by its name\n");
}

// ---- arcs ----

double distance(const std::array<double, 3>& a, const std::array<double, 3>& b) {
  return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}
std::vector<program::PlainPose> ends(const std::shared_ptr<const CompiledProgram>& p) {
  const auto t = program::trace(p);
  EXPECT_TRUE(t.ok()) << (t.ok() ? "" : t.error().sentence());
  std::vector<program::PlainPose> out;
  if (!t.ok()) return out;
  for (const auto& e : t->entries)
    if (const auto* m = std::get_if<program::TracedMotion>(&e.what))
      for (const auto& a : m->absolute)
        if (a) out.push_back(*a);
  return out;
}

TEST(Legalise, TaughtTargetsThatNothingElseAssignsAreKnown) {
  const std::string list =
      "a := POSE(POSITION(100.0, 0.0, 0.0), ORIZYX(0.0, 0.0, 0.0));\n"
      "b := POSE(POSITION(0.0, 100.0, 0.0), ORIZYX(0.0, 0.0, 0.0));\n"
      "c := POSE(POSITION(-100.0, 0.0, 0.0), ORIZYX(0.0, 0.0, 0.0));\n";
  const auto from = compiled(R"(PROGRAM p;
VAR POSE: a, b, c;
BEGIN
  TEACH a, b, c;
  MOVE LIN a;
  MOVE CIRCLE b, c;
ENDPROGRAM;
)",
                             list);
  // A target without circles goes along the arc, which it could not if the places were computed.
  const Passed got = passed(from, without(kPostTeach, kPostCircle));
  EXPECT_EQ(got.errors, "");
  const auto is = ends(got.program);
  ASSERT_GT(is.size(), 10U);
  for (const auto& at : is) EXPECT_NEAR(distance(at.position, {0, 0, 0}), 100, 1e-9);
  EXPECT_EQ(is.back(), ends(from).back());
  // Without a value it is an error at its line.
  const auto none = compiled("PROGRAM p;\nVAR INT: n;\nBEGIN\n  TEACH n;\nENDPROGRAM;\n");
  EXPECT_EQ(passed(none, without(kPostTeach)).errors, "4: n has no taught value\n");
}

TEST(LegaliseArcs, PiecesLieOnTheArcWithinTheTolerance) {
  for (const double most : {1.0, 0.1, 0.01}) {
    const auto p = compiled(R"(PROGRAM p;
VAR POSE: f := POSE(POSITION(100.0, 50.0, 20.0), ORIZYX(30.0, 0.0, 0.0));
    ORIENTATION: o := ORIZYX(0.0, 0.0, 0.0), u := ORIZYX(90.0, 0.0, 0.0);
BEGIN
  MOVE LIN POSE(POSITION(60.0, 0.0, 0.0), o) FRAME := f;
  MOVE CIRCLE POSE(POSITION(0.0, 60.0, 0.0), o), POSE(POSITION(-60.0, 0.0, 0.0), u)
    FRAME := f SPEED := 33.0 TIME := 4.0;
  MOVE LIN POSE(POSITION(0.0, 0.0, 90.0), u);
ENDPROGRAM;
)");
    const Passed got = passed(p, without(0, kPostCircle), most);
    EXPECT_EQ(got.errors, "");
    const auto want = ends(p);
    const auto is = ends(got.program);
    ASSERT_EQ(want.size(), 4U);
    ASSERT_GT(is.size(), 4U);
    EXPECT_EQ(is.front(), want.front());
    EXPECT_EQ(is.back(), want.back());
    EXPECT_LT(distance(is[is.size() - 2].position, want[2].position), 1e-9);
    const std::array<double, 3> centre{100, 50, 20};
    double farthest = 0;
    for (std::size_t k = 0; k + 2 < is.size(); ++k) {
      EXPECT_NEAR(distance(is[k].position, centre), 60, 1e-9);
      std::array<double, 3> middle{};
      for (std::size_t i = 0; i < 3; ++i)
        middle[i] = (is[k].position[i] + is[k + 1].position[i]) / 2;
      farthest = std::max(farthest, 60 - distance(middle, centre));
    }
    EXPECT_LE(farthest, most + 1e-9);
    EXPECT_GT(farthest, most / 4);  // no more pieces than it takes
    const std::string said = "6: CIRCLE is written as " + std::to_string(is.size() - 2) +
                             " straight pieces, at most " + post::trimmed(farthest, 4, 1) +
                             " mm away from it\n";
    EXPECT_EQ(got.warnings, said);
    // Half a turn of the arc before the place on the way keeps the orientation.
    for (std::size_t k = 1; k + 2 < is.size(); ++k) {
      const double w = is[k].quaternion[0], z = is[k].quaternion[3];
      const double turned = 2 * std::atan2(z, w) * post::kDegree - 30;
      const double share = static_cast<double>(k) / static_cast<double>(is.size() - 2);
      EXPECT_NEAR(turned, share <= 0.5 ? 0 : 180 * (share - 0.5), 1e-6) << k;
    }
    const auto t = program::trace(got.program);
    double time = 0;
    std::size_t passes = 0;
    for (const auto& e : t->entries)
      if (const auto* m = std::get_if<program::TracedMotion>(&e.what)) {
        if (m->motion.attributes.time > 0) time += m->motion.attributes.time;
        passes += m->motion.attributes.passes;
        if (m->motion.attributes.time > 0) {
          EXPECT_EQ(m->motion.attributes.speed, 33);
        }
      }
    EXPECT_NEAR(time, 4, 1e-9);
    EXPECT_EQ(passes, is.size() - 3);
  }
}

TEST(LegaliseArcs, PathsFollowTheSplineThroughTheirTargets) {
  const auto p = compiled(R"(PROGRAM p;
VAR ORIENTATION: o := ORIZYX(0.0, 0.0, 0.0);
BEGIN
  MOVE LIN POSE(POSITION(0.0, 0.0, 0.0), o);
  MOVE PATH POSE(POSITION(100.0, 50.0, 0.0), o), POSE(POSITION(200.0, 0.0, 0.0), o);
ENDPROGRAM;
)");
  const Passed got = passed(p, without(0, kPostPath), 0.05);
  EXPECT_EQ(got.errors, "");
  const auto is = ends(got.program);
  ASSERT_GT(is.size(), 10U);
  // Three places at equal distances h: the natural spline's second derivative in the middle is
  // 3 (y0 - 2 y1 + y2) / (2 h^2), and x is even.
  const double h = std::hypot(100, 50), bend = 1.5 * (-100) / (h * h);
  for (const auto& at : is) {
    const double u = std::min(at.position[0], 200 - at.position[0]) / 100;
    EXPECT_NEAR(at.position[1], 50 * u + h * h / 6 * (u * u * u - u) * bend, 1e-9);
    EXPECT_EQ(at.position[2], 0);
  }
  EXPECT_NE(
      got.warnings.find("PATH is written as " + std::to_string(is.size() - 1) + " straight pieces"),
      std::string::npos)
      << got.warnings;
}

TEST(LegaliseArcs, WhatIsNotKnownIsSaid) {
  const auto p = compiled(R"(PROGRAM p;
SIGNAL INPUT BOOL: s AT 1;
VAR POSE: a := POSE(POSITION(1.0, 0.0, 0.0), ORIZYX(0.0, 0.0, 0.0)),
          b := POSE(POSITION(0.0, 1.0, 0.0), ORIZYX(0.0, 0.0, 0.0)),
          c := POSE(POSITION(2.0, 0.0, 0.0), ORIZYX(0.0, 0.0, 0.0)); INT: i;
PROCEDURE away; BEGIN MOVE LIN b; ENDPROC;
BEGIN
  MOVE CIRCLE b, c;
  MOVE LIN a UNTIL s;
  MOVE CIRCLE b, c;
  MOVE LIN a; away;
  MOVE CIRCLE b, c;
  MOVE LIN a;
  MOVE CIRCLE c, POSE(POSITION(3.0, 0.0, 0.0), ORIZYX(0.0, 0.0, 0.0));
  MOVE LIN a;
  FOR i := 1 TO 2 MOVE CIRCLE b, c; MOVE LIN a; ENDFOR;
  MOVE CIRCLE b, c UNTIL s;
ENDPROGRAM;
)");
  const Passed got = passed(p, without(0, kPostCircle));
  const std::string head =
      ": ACME has no circles, and this one cannot be written as straight pieces: ";
  const std::string unknown = head + "its start or end is unknown before run time\n";
  EXPECT_EQ(got.errors, "8" + unknown + "10" + unknown + "12" + unknown + "14" + head +
                            "start, via and end lie on a line, or the arc is too long\n" + "16" +
                            unknown + "17" + head + "it ends on a condition (UNTIL)\n");
}

// ---- random programs ----

/// Programs of records within records and arrays, and of routines that take and give them.
class Records {
 public:
  explicit Records(std::uint32_t seed) : random_(seed) {}
  std::string program() {
    std::string out =
        "PROGRAM p;\nTYPE RECORD INT: a; REAL: r; ENDRECORD: PT;\n"
        "RECORD PT: at; ARRAY [1..2] OF INT: n; BOOL: f; ENDRECORD: BOX;\n"
        "VAR PT: p0 := PT(1, 0.5), p1 := p0; BOX: b0, b1; ARRAY [0..2] OF BOX: bs;\n"
        "ARRAY [0..2] OF PT: ps; INT: i0 := 2, i1, k, calls;\n"
        "FUNCTION counted (IN INT: by): INT;\nBEGIN calls := calls + by; RETURN calls; ENDFCT;\n"
        "FUNCTION made (IN INT: a; IN PT: q): PT;\nVAR PT: l0; INT: x;\nBEGIN\n  calls := calls + "
        "1;\n" +
        in_function("l0", "q", "a") +
        "  RETURN l0;\nENDFCT;\n"
        "FUNCTION boxed (INOUT INT: k; IN BOX: q): BOX;\nVAR BOX: y; PT: l0; INT: x;\nBEGIN\n"
        "  calls := calls + 1; k := k + 1; y := q; l0 := y.at;\n" +
        in_function("l0", "y.at", "k") +
        "  y.at := l0;\n  IF k > 5 THEN RETURN BOX(l0, [k, l0.a], q.f); ENDIF;\n  RETURN y;\n"
        "ENDFCT;\nPROCEDURE change (INOUT PT: a; OUT BOX: c; IN BOX: d);\nVAR PT: l0; INT: x;\n"
        "BEGIN\n  calls := calls + 1; l0 := a;\n" +
        in_function("l0", "d.at", "d.n[1]") + "  c := d; c.at := a; a := l0;\nENDPROC;\n";
    out += "BEGIN\n" + block(8, 1) + "  WRITELN(p0, p1, b0, b1, bs, ps, i0, i1, calls);\n";
    return out + "ENDPROGRAM;\n";
  }

 private:
  int pick(int n) { return static_cast<int>(random_() % static_cast<std::uint32_t>(n)); }
  std::string digit(int n) { return std::to_string(pick(n)); }
  /// Statements of a routine: nothing but what is its own.
  std::string in_function(const std::string& own, const std::string& given,
                          const std::string& number) {
    std::string out;
    for (int k = 1 + pick(3); k > 0; --k) switch (pick(4)) {
        case 0:
          out += "  " + own + " := PT(" + given + ".a + " + digit(5) + ", " + own + ".r);\n";
          break;
        case 1: out += "  " + own + " := " + given + ";\n"; break;
        case 2: out += "  x := " + number + " * " + digit(3) + "; " + own + ".a := x - 1;\n"; break;
        default:
          out += "  IF " + given + ".a > " + digit(4) + " AND 6 DIV " + given + ".a > 1 THEN " +
                 own + ".r := " + own + ".r + 0.5; ENDIF;\n";
      }
    return out;
  }
  std::string index() { return pick(2) ? digit(3) : "ABS(" + whole(1) + ") MOD 3"; }
  std::string pt_place() {
    switch (pick(6)) {
      case 0: return "p0";
      case 1: return "p1";
      case 2: return "b0.at";
      case 3: return "b1.at";
      case 4: return "bs[" + index() + "].at";
      default: return "ps[" + index() + "]";
    }
  }
  std::string box_place() {
    switch (pick(3)) {
      case 0: return "b0";
      case 1: return "b1";
      default: return "bs[" + index() + "]";
    }
  }
  std::string pt(int depth) {
    if (depth <= 0 || pick(3) == 0) return pt_place();
    switch (pick(3)) {
      case 0: return "PT(" + whole(depth - 1) + ", " + real(depth - 1) + ")";
      case 1: return "made(" + whole(depth - 1) + ", " + pt(depth - 1) + ")";
      default: return pt_place();
    }
  }
  std::string box(int depth) {
    if (depth <= 0 || pick(3) == 0) return box_place();
    switch (pick(3)) {
      case 0:
        return "BOX(" + pt(depth - 1) + ", [" + whole(depth - 1) + ", " + whole(depth - 1) + "], " +
               truth(depth - 1) + ")";
      case 1: return "boxed(i1, " + box(depth - 1) + ")";
      default: return box_place();
    }
  }
  std::string whole(int depth) {
    if (depth <= 0) return pick(2) ? digit(9) : pick(2) ? "i0" : "i1";
    switch (pick(6)) {
      case 0: return whole(depth - 1) + " + " + whole(depth - 1);
      case 1: return "counted(" + digit(3) + ")";
      case 2: return pt_place() + ".a";
      case 3: return box_place() + ".n[" + std::to_string(1 + pick(2)) + "]";
      case 4: return "made(" + whole(depth - 1) + ", " + pt(depth - 1) + ").a - " + digit(9);
      default: return whole(depth - 1);
    }
  }
  std::string real(int depth) {
    switch (pick(3)) {
      case 0: return digit(9) + ".25";
      case 1: return pt_place() + ".r";
      default: return depth > 0 ? "made(" + whole(0) + ", " + pt(depth - 1) + ").r / 2" : "1.5";
    }
  }
  std::string truth(int depth) {
    if (depth <= 0) return box_place() + ".f";
    switch (pick(6)) {
      case 0: return whole(depth - 1) + " < " + whole(depth - 1);
      case 1: return "(" + truth(depth - 1) + " AND " + truth(depth - 1) + ")";
      case 2: return "(" + truth(depth - 1) + " OR " + truth(depth - 1) + ")";
      case 3: return "NOT " + truth(depth - 1);
      case 4: return "ps[" + index() + "].a > i0";
      default: return "boxed(i1, " + box(depth - 1) + ").f";
    }
  }
  std::string block(int n, int depth) {
    std::string out;
    for (int k = 0; k < n; ++k) out += statement(depth);
    return out;
  }
  std::string statement(int depth) {
    const std::string p(static_cast<std::size_t>(2 * depth), ' ');
    switch (pick(depth > 3 ? 6 : 11)) {
      case 0: return p + pt_place() + " := " + pt(2) + ";\n";
      case 1: return p + box_place() + " := " + box(2) + ";\n";
      case 2: return p + pt_place() + ".a := " + whole(2) + ";\n";
      case 3: return p + box_place() + ".f := " + truth(2) + ";\n";
      case 4: return p + "WRITELN(" + whole(2) + ", ' ', " + box_place() + ", " + pt(2) + ");\n";
      case 5: return p + "change(" + (pick(2) ? "p0" : "p1") + ", b1, " + box(1) + ");\n";
      case 6:
        return p + "IF " + truth(2) + " THEN\n" + block(1, depth + 1) + p + "ELSIF " + truth(2) +
               " THEN\n" + block(1, depth + 1) + p + "ELSE\n" + block(1, depth + 1) + p +
               "ENDIF;\n";
      case 7:
        return p + "WHILE calls < 40 AND " + truth(2) + "\n" + p + "  calls := calls + 1;\n" +
               block(1, depth + 1) + p + "ENDWHILE;\n";
      case 8:
        return p + "REPEAT\n" + block(1, depth + 1) + p + "  calls := calls + 1;\n" + p +
               "UNTIL calls > 30 OR " + truth(1) + ";\n";
      case 9:
        return p + "FOR k := " + digit(3) + " TO ABS(" + whole(1) + ") MOD 4\n" +
               (depth < 2 ? block(1, 4) : "") + p + "ENDFOR;\n";
      default:
        return p + "CASE " + whole(2) + " OF\n" + p + "WHEN 0, 1:\n" + block(1, depth + 1) + p +
               "WHEN 2:\n" + block(1, depth + 1) + p + "DEFAULT:\n" + block(1, depth + 1) + p +
               "ENDCASE;\n";
    }
  }
  std::mt19937 random_;
};

/// Programs of routines that call themselves and each other, from wherever a call may stand.
class Circles {
 public:
  explicit Circles(std::uint32_t seed) : random_(seed) {}
  std::string program() {
    static const char* const kHeads[] = {
        "FUNCTION f0 (IN INT: d, x; INOUT INT: y): INT;\n",
        "FUNCTION f1 (IN INT: d, x; IN BOX: b): INT;\n",
        "PROCEDURE f2 (IN INT: d; INOUT INT: x, y; INOUT BOX: b);\n"};
    std::string out =
        "PROGRAM p;\nTYPE RECORD INT: a; ARRAY [0..1] OF INT: n; ENDRECORD: BOX;\n"
        "SIGNAL OUTPUT INT: level AT 4, 16;\n"
        "VAR INT: calls, g0 := 3, g1, v0 := 4, v1 := 5; ARRAY [0..2] OF INT: ga; BOX: vb;\n";
    for (kind_ = 0; kind_ < 3; ++kind_) {
      out += kHeads[kind_];
      out +=
          "VAR INT: l0, l1 := 2 * d + x; ARRAY [0..2] OF INT: la; BOX: lb; INT: w0, w1, w2;\n"
          "BEGIN\n  calls := calls + 1; level := calls;\n  IF d <= 0 OR calls > 90 THEN " +
          leave("1") + " ENDIF;\n" + block(3 + pick(3), 1) + "  " + leave("l0 + l1 + la[1]") +
          "\n" + (kind_ < 2 ? "ENDFCT;\n" : "ENDPROC;\n");
    }
    const std::string d = std::to_string(2 + pick(3));
    return out + "BEGIN\n  WRITELN(f0(" + d + ", 3, v0) + f1(2, 4, vb) * f0(2, v0, v1));\n  f2(" +
           d +
           ", v0, v1, vb);\n  WRITELN(calls, ' ', g0, ' ', g1, ' ', v0, ' ', v1, ga, vb);\n"
           "ENDPROGRAM;\n";
  }

 private:
  int pick(int n) { return static_cast<int>(random_() % static_cast<std::uint32_t>(n)); }
  std::string digit(int n) { return std::to_string(pick(n)); }
  std::string leave(const std::string& value) const {
    return kind_ < 2 ? "RETURN " + value + ";" : "RETURN;";
  }
  std::string index(int depth) { return pick(2) ? digit(3) : "ABS(" + whole(depth) + ") MOD 3"; }
  /// What may be changed by a parameter: never the same variable twice.
  std::vector<std::string> changeable(int depth) {
    std::vector<std::string> all{"l0", "l1", "la[" + index(depth) + "]"};
    if (kind_ != 1) all.emplace_back("y");
    if (kind_ == 2) all.emplace_back("x");
    std::shuffle(all.begin(), all.end(), random_);
    return all;
  }
  std::string place(int depth) {
    switch (pick(8)) {
      case 0: return "g0";
      case 1: return "g1";
      case 2: return "ga[" + index(depth) + "]";
      case 3: return "lb.a";
      case 4: return "lb.n[" + index(depth) + " MOD 2]";
      default: return changeable(depth)[0];
    }
  }
  std::string box(int depth) {
    if (depth > 0 && pick(3) == 0)
      return "BOX(" + whole(depth - 1) + ", [" + whole(depth - 1) + ", " + whole(0) + "])";
    return kind_ > 0 && pick(2) ? "b" : "lb";
  }
  std::string whole(int depth) {
    if (depth <= 0) return pick(3) ? place(0) : pick(2) ? "x" : digit(9);
    switch (pick(8)) {
      case 0: return whole(depth - 1) + " + " + whole(depth - 1);
      case 1: return whole(depth - 1) + " - (" + whole(depth - 1) + ") * " + digit(4);
      case 2: return "f0(d - 1, " + whole(depth - 1) + ", " + changeable(depth - 1)[0] + ")";
      case 3: return "f1(d - 1, " + whole(depth - 1) + ", " + box(depth - 1) + ")";
      case 4: return "(" + whole(depth - 1) + ") MOD 7";
      case 5: return box(0) + ".n[" + index(depth - 1) + " MOD 2]";
      default: return whole(depth - 1);
    }
  }
  std::string truth(int depth) {
    switch (pick(depth > 0 ? 5 : 2)) {
      case 0: return whole(depth) + " < " + whole(depth);
      case 1: return "g0 > " + digit(9);
      case 2: return "(" + truth(depth - 1) + " AND " + truth(depth - 1) + ")";
      case 3: return "(" + truth(depth - 1) + " OR " + truth(depth - 1) + ")";
      default: return "NOT " + truth(depth - 1);
    }
  }
  std::string block(int n, int depth) {
    std::string out;
    for (int k = 0; k < n; ++k) out += statement(depth);
    return out;
  }
  std::string statement(int depth) {
    const std::string p(static_cast<std::size_t>(2 * depth), ' ');
    const std::string w = "w" + std::to_string(std::min(depth, 3) - 1);
    const auto inner = [&] { return block(1 + pick(2), depth + 1); };
    switch (pick(depth > 3 ? 5 : 12)) {
      case 0:
      case 1: return p + place(1) + " := (" + whole(2) + ") MOD 50;\n";
      case 2: return p + "lb := " + box(2) + ";\n";
      case 3: {
        const auto by = changeable(1);
        return p + "f2(d - 1, " + by[0] + ", " + by[1] + ", " +
               (kind_ == 2 && pick(2) ? "b" : "lb") + ");\n";
      }
      case 4:
        return p + "IF " + truth(1) + " THEN " + leave("(" + whole(1) + ") MOD 50") + " ENDIF;\n";
      case 5:
        return p + "IF " + truth(2) + " THEN\n" + inner() + p + "ELSIF " + truth(2) + " THEN\n" +
               inner() + p + "ELSE\n" + inner() + p + "ENDIF;\n";
      case 6:
        return p + w + " := 0;\n" + p + "WHILE " + w + " < 3 AND " + truth(1) + "\n" + p + "  " +
               w + " := " + w + " + 1;\n" + inner() + p + "ENDWHILE;\n";
      case 7:
        return p + w + " := 0;\n" + p + "REPEAT\n" + p + "  " + w + " := " + w + " + 1;\n" +
               inner() + p + "UNTIL " + w + " >= 2 OR " + truth(1) + ";\n";
      case 8:
        return p + "FOR " + w + " := " + digit(2) + (pick(2) ? " TO " : " DOWNTO ") + "ABS(" +
               whole(1) + ") MOD 3" +
               (pick(3)   ? ""
                : pick(2) ? " STEP 2"
                          : " STEP 1 + ABS(g1)") +
               "\n" + inner() + (pick(2) ? p + "  IF " + truth(1) + " THEN EXIT; ENDIF;\n" : "") +
               p + "ENDFOR;\n" + p + "g1 := " + w + " MOD 50;\n";
      case 9:
        return p + w + " := 0;\n" + p + "LOOP\n" + p + "  " + w + " := " + w + " + 1;\n" + p +
               "  IF " + w + " > 2 OR " + truth(1) + " THEN EXIT; ENDIF;\n" + inner() + p +
               "ENDLOOP;\n";
      case 10: {
        const std::string label = "j" + std::to_string(++labels_);
        return p + "IF " + truth(1) + " THEN GOTO " + label + "; ENDIF;\n" + inner() + p +
               "LABEL " + label + ":\n" + p + "l0 := l0 + 1;\n";
      }
      default:
        return p + "CASE (" + whole(2) + ") MOD 4 OF\n" + p + "WHEN 0, 1:\n" + inner() + p +
               "WHEN 2:\n" + inner() + (pick(2) ? p + "DEFAULT:\n" + inner() : "") + p +
               "ENDCASE;\n";
    }
  }
  std::mt19937 random_;
  int kind_ = 0, labels_ = 0;
};

/// Compares a program with what the passes make of it; gives how many were compared.
std::size_t compare(const std::string& text, std::size_t& refused) {
  NoProgress progress;
  const SourceFile file{"p.irl", text, {}};
  auto made = irl::compile(std::span(&file, 1), progress);
  EXPECT_TRUE(made.ok());
  if ((*made)->code().has_errors) return 0;
  const std::shared_ptr<const CompiledProgram> from(std::move(*made));
  const std::string want = doings(from);
  // One that does not end is not comparable: the passes take other instructions.
  if (want.starts_with("!") && want.find("instructions") != std::string::npos) return 0;
  std::size_t n = 0;
  for (const auto& [name, lacks] : kLacks) {
    const Passed got = passed(from, without(lacks));
    if (!got.errors.empty()) {
      ++refused;
      continue;
    }
    const std::string is = doings(got.program);
    EXPECT_EQ(is, want) << name << "\n" << text;
    EXPECT_EQ(left(got.program->code(), lacks), "") << name << "\n" << text;
    if (is != want) return n;
    // Which of two faults is first depends on the order.
    if (want.starts_with("!")) continue;
    for (const Parts parts : {Parts::calls_first, Parts::right_first}) {
      const std::string other = doings(passed(from, without(lacks), 0.1, parts).program);
      EXPECT_EQ(other, want) << name << " " << static_cast<int>(parts) << "\n" << text;
      if (other != want) return n;
    }
    ++n;
  }
  return n;
}

TEST(LegaliseRandom, RecordsAndRoutinesDoTheSame) {
  const test::FuzzBudget budget(300, 0.5);
  const std::uint32_t seed = test::seed();
  std::size_t compared = 0, refused = 0, k = 0;
  for (; budget.allows(k) && !testing::Test::HasFailure(); ++k) {
    SCOPED_TRACE("seed " + std::to_string(seed + static_cast<std::uint32_t>(k)));
    compared += compare(Records(seed + static_cast<std::uint32_t>(k)).program(), refused);
  }
  EXPECT_GT(compared, k * 4);
}

TEST(LegaliseRandom, RoutinesThatCallThemselvesAndEachOtherDoTheSame) {
  const test::FuzzBudget budget(40, 0.5);
  const std::uint32_t seed = test::seed();
  std::size_t compared = 0, ended = 0, k = 0;
  for (; budget.allows(k) && !testing::Test::HasFailure(); ++k) {
    const std::string text = Circles(seed + static_cast<std::uint32_t>(k)).program();
    SCOPED_TRACE("seed " + std::to_string(seed + static_cast<std::uint32_t>(k)) + "\n" + text);
    const auto from = compiled(text);
    ASSERT_FALSE(from->code().has_errors);
    const std::string want = doings(from, {}, 1'000'000);
    if (want.starts_with("!")) {
      ++ended;
      continue;
    }
    for (const auto& [name, lacks] : kLacks) {
      const Passed got = passed(from, without(lacks | kPostRecursion));
      ASSERT_EQ(got.errors, "") << name;
      const std::string is = doings(got.program, {}, 20'000'000);
      EXPECT_EQ(is, want) << name;
      ++compared;
    }
  }
  EXPECT_GT(compared, k * 8) << ended << " of " << k << " end with a fault";
}

TEST(LegaliseRandom, ProgramsOfTheGeneratorDoTheSame) {
  const test::FuzzBudget budget(1000, 0.5);
  std::mt19937 random(test::seed());
  std::size_t compared = 0, refused = 0, k = 0;
  for (; budget.allows(k) && !testing::Test::HasFailure(); ++k)
    compared += compare(irl::Generator(random).program(), refused);
  EXPECT_GT(compared, k);
}

}  // namespace
}  // namespace robomosp
