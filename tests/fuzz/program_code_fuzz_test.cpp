// SPDX-License-Identifier: Apache-2.0
// Programs in IRL that are damaged at random: source, with cells, lists of data and modules, and
// three-address code. Nothing crashes, hangs or takes memory without bounds; what is refused is
// refused in words, at a line and a column that there are. What follows of them, posts, packs and
// readers, is in program_fuzz_test.cpp.
#include "fuzz/program_inputs.h"
#include "support/mutator.h"
#include "support/seed.h"

namespace robomosp {
namespace {

using namespace test;

/// A program with all kinds of files that it may name.
Texts with_files(std::uint32_t seed) {
  const std::string n = std::to_string(seed % 7 + 1);
  return {
      {"p.irl",
       "PROGRAM p;\nSYSTEM_SPECIFICATION 'cell.ssi';\nDATALIST 'taught.dls';\nIMPORT grip, wide "
       "FROM "
       "tools;\nIMPORT more;\nVAR\n  INT: n, m := " +
           n +
           ";\n  POSE: place, home := POSE(POSITION(400.0, 0.0, 200.0), ORIZYX(0.0, 180.0, "
           "0.0));\n  "
           "ARRAY [1..3] OF REAL: a;\nBEGIN\n  TEACH place, n, a;\n  grip(n);\n  MOVE PTP home;\n  "
           "MOVE LIN place SPEED := wide;\n  n := twice(m) + n;\nENDPROGRAM;\n"},
      {"cell.ssi",
       "PROGRAM cell;\nCONST\n  INT: R_NTURNS := 2, R_NADDJ := 1;\n  STRING: ZYX := 'ZYX', "
       "R_DEF_ORI := ZYX;\nTYPE\n  RECORD REAL: A1, A2, A3, A4, A5, A6; ENDRECORD: "
       "MAIN_JOINT;\n  RECORD REAL: AA1; ENDRECORD: ADD_JOINT;\n  RECORD MAIN_JOINT: M_JOINT; "
       "ADD_JOINT: A_JOINT; ENDRECORD: JOINT;\n  RECORD POSE: PSE; INT: STATUS; ARRAY "
       "[1..R_NTURNS] OF INT: TURNS; ADD_JOINT: A_JOINT; ENDRECORD: ROBTARGET;\nENDPROGRAM;\n"},
      {"taught.dls",
       "{ taught }\nplace := POSE(POSITION(410.0, 10.0, 150.0), ORIZYX(0.0, 180.0, 0.0));\nn := " +
           n + ";\na := [1.5, 2.5, 3.5];\n"},
      {"tools.irl",
       "MODULE tools;\nEXPORT grip, wide;\nCONST\n  REAL: wide := 80.0;\nVAR\n  INT: count;\n"
       "PROCEDURE grip (IN INT: how);\nBEGIN\n  count := count + how;\n  WAIT 0.1 SEC;\nENDPROC;\n"
       "ENDMODULE;\n"},
      {"more.irl",
       "MODULE more;\nIMPORT wide FROM tools;\nEXPORT twice;\nFUNCTION twice (IN INT: n): "
       "INT;\nBEGIN\n "
       " IF wide > 1.0 THEN\n    RETURN 2 * n;\n  ENDIF;\n  RETURN n;\nENDFCT;\nENDMODULE;\n"}};
}

TEST(ProgramCodeFuzz, DamagedSourceIsRefusedOrCompilesAndRuns) {
  std::mt19937 random(test::seed());
  std::vector<std::string> all;
  for (std::uint32_t k = 0; k < 40; ++k) all.push_back(random_text(k));
  test::Mutator mutator(random, all, kTokens);
  const test::FuzzBudget budget(3000, 0.5);
  std::size_t n = 0, correct = 0;
  std::pair<std::size_t, std::size_t> hints;
  for (; budget.allows(n); ++n) {
    const std::string& whole = all[random() % all.size()];
    const std::string text = n % 3 == 0 ? mutator.mutate(whole) : changed_gently(whole, random);
    const auto begin = Clock::now();
    const auto p = compiled({{"p.irl", text}}, &hints);
    ASSERT_TRUE(p);
    ASSERT_FALSE(HasFailure()) << text;
    if (!p->code().has_errors) {
      ++correct;
      auto m = program::Machine::load(p, limits());
      ASSERT_TRUE(m.ok()) << m.error().sentence() << "\n" << text;
      run_a_while(*m);
    }
    ASSERT_LT(seconds_since(begin), kMostSeconds) << text;
  }
  std::cout << n << " sources, " << correct << " correct; " << hints.second << " of " << hints.first
            << " errors say what to do\n";
  EXPECT_GT(correct, n / 20);
  EXPECT_GT(hints.second, hints.first / 4);
  expect_memory();
}

TEST(ProgramCodeFuzz, DamagedCellsListsOfDataAndModulesAreRefusedOrRun) {
  std::mt19937 random(test::seed());
  const Texts whole = with_files(1);
  {
    const auto p = compiled(whole);
    ASSERT_TRUE(p);
    for (std::uint32_t k = 0; k < p->code().faults.count; ++k) {
      const auto& f = row<rmp_code_fault>(p->code().faults, k);
      ADD_FAILURE() << f.span.file << ":" << f.span.line << ": " << f.message;
    }
  }
  std::vector<std::string> all;
  for (const auto& [name, text] : whole) all.push_back(text);
  test::Mutator mutator(random, all, kTokens);
  const test::FuzzBudget budget(1500, 0.25);
  std::size_t n = 0, correct = 0;
  std::pair<std::size_t, std::size_t> hints;
  for (; budget.allows(n); ++n) {
    Texts files = with_files(static_cast<std::uint32_t>(n));
    std::string& changed = files[random() % files.size()].second;
    changed = n % 3 == 0 ? mutator.mutate(changed) : changed_gently(changed, random);
    if (random() % 20 == 0) files.erase(files.begin() + 1 + static_cast<long>(random() % 4));
    const auto begin = Clock::now();
    const auto p = compiled(files, &hints);
    ASSERT_TRUE(p);
    ASSERT_FALSE(HasFailure()) << changed;
    if (!p->code().has_errors) {
      ++correct;
      auto m = program::Machine::load(p, limits());
      ASSERT_TRUE(m.ok()) << m.error().sentence() << "\n" << changed;
      run_a_while(*m);
    }
    ASSERT_LT(seconds_since(begin), kMostSeconds) << changed;
  }
  std::cout << n << " programs of five files, " << correct << " correct; " << hints.second << " of "
            << hints.first << " errors say what to do\n";
  EXPECT_GT(correct, n / 50);
  EXPECT_GT(hints.second, hints.first / 4);
  expect_memory();
}

/// Inputs that once crashed, or were compiled to what the machine does not take.
TEST(ProgramCodeFuzz, WhatOnceFailedIsAnswered) {
  // A variable with the name of a type that functions give: nothing is in the way.
  const auto hides = compiled(
      "PROGRAM p;\nVAR\n  REAL: ORIENTATION := -2.8;\n  POSE: a := POSE(POSITION(1.0, 2.0, 3.0), "
      "ORIZYX(0.0, 0.0, 0.0));\nBEGIN\n  MOVE LIN a;\nENDPROGRAM;\n");
  ASSERT_TRUE(hides);
  EXPECT_FALSE(hides->code().has_errors);
  // One value for a record with a field of no type.
  const auto unknown = compiled(
      "PROGRAM p;\nTYPE\n  RECORD INT: a; NOBODY: b; ENDRECORD: T;\nVAR\n  T: x := "
      "5;\nBEGIN\nENDPROGRAM;\n");
  ASSERT_TRUE(unknown);
  EXPECT_TRUE(unknown->code().has_errors);
  // Cells whose ROBTARGET has turns of something else, or that have none.
  for (const bool has_one : {true, false}) {
    Texts files = with_files(1);
    std::string& cell = files[1].second;
    const std::size_t at = has_one ? cell.find("OF INT: TURNS") : cell.find("  RECORD POSE: PSE");
    ASSERT_NE(at, std::string::npos);
    if (has_one) cell.replace(at, 6, "OF MAIN_JOINT");
    else cell.erase(at, cell.find("ENDPROGRAM") - at);
    std::string& program = files[0].second;
    program.insert(program.find("BEGIN"), "  JOINT: j;\n");
    program.insert(program.find("  TEACH"), "  place := TRAFO(j);\n");
    const auto p = compiled(files);
    ASSERT_TRUE(p);
    EXPECT_TRUE(p->code().has_errors) << has_one;
  }
}

/// Files that name each other in rings, and in rows of any length.
TEST(ProgramCodeFuzz, FilesThatNameEachOtherAreReadOnceOrRefused) {
  for (const int count : {2, 10, 63, 64, 65, 1000}) {
    Texts row{{"p.irl", "PROGRAM p;\nIMPORT v0 FROM m0;\nBEGIN\nENDPROGRAM;\n"}};
    for (int k = 0; k < count; ++k) {
      const std::string i = std::to_string(k), next = std::to_string((k + 1) % count);
      row.emplace_back("m" + i + ".irl", "MODULE m" + i + ";\nIMPORT v" + next + " FROM m" + next +
                                             ";\nEXPORT v" + i + ";\nVAR INT: v" + i +
                                             ";\nENDMODULE;\n");
    }
    const auto ring = compiled(row);
    ASSERT_TRUE(ring);
    EXPECT_TRUE(ring->code().has_errors) << count;
    // The last one names nobody.
    row.back().second = "MODULE m" + std::to_string(count - 1) + ";\nEXPORT v" +
                        std::to_string(count - 1) + ";\nVAR INT: v" + std::to_string(count - 1) +
                        ";\nENDMODULE;\n";
    const auto straight = compiled(row);
    ASSERT_TRUE(straight);
    EXPECT_EQ(straight->code().has_errors != 0, count > 64) << count;
  }
}

TEST(ProgramCodeFuzz, DamagedCodeIsRefusedOrRunsWithinItsBounds) {
  std::mt19937 random(test::seed());
  std::vector<std::string> all;
  for (std::uint32_t k = 0; k < 40; ++k)
    if (const auto p = compiled(random_text(k)); p && !p->code().has_errors)
      all.push_back(code_text(p->code()));
  ASSERT_GT(all.size(), 30U);
  static const char* const kCodeTokens[] = {
      "t0:T1", "p0:T2", "v1",   "L0", "r0",  "#1",  "-",     "TRUE", "1.5", "'s'",
      "T12",   "CALL",  "MOVE", "\n", "#99", "T99", "t9:T9", "1..3", "END", "ROUTINE"};
  test::Mutator mutator(random, all, kCodeTokens);
  const test::FuzzBudget budget(3000, 0.25);
  std::size_t n = 0, loaded = 0;
  for (; budget.allows(n); ++n) {
    const std::string text = mutator.mutate(all[n % all.size()]);
    const auto begin = Clock::now();
    auto read = read_code_text(text);
    if (!read.ok()) {
      ASSERT_FALSE(read.error().message.empty());
    } else {
      const std::shared_ptr<const CompiledProgram> p(std::move(*read));
      auto m = program::Machine::load(p, limits());
      if (m.ok()) {
        ++loaded;
        run_a_while(*m);
      } else {
        ASSERT_FALSE(m.error().message.empty());
      }
    }
    ASSERT_LT(seconds_since(begin), kMostSeconds) << text;
  }
  std::cout << n << " codes, " << loaded << " loaded\n";
  EXPECT_GT(loaded, n / 300);
  expect_memory();
}

}  // namespace
}  // namespace robomosp
