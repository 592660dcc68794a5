// SPDX-License-Identifier: Apache-2.0
// Every operator over every pair of types, precedence, conversions and functions of numbers, held
// against a table that irl_operators.py computes with fractions: once with variables, when the
// machine computes, and once with their values, when the compiler does.
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <map>
#include <string>

#include "support/program_world.h"

namespace robomosp::program {
namespace {

using namespace testing;

/// What is written, "!" of a fault of the run, "?" of what the compiler refuses.
std::string outcome(const std::string& text) {
  NoProgress progress;
  const std::vector<SourceFile> files{{"p.irl", text, {}}};
  auto made = irl::compile(files, progress);
  EXPECT_TRUE(made.ok());
  if (!made.ok()) return "";
  if ((*made)->code().has_errors) return "?";
  (*made)->seal();
  auto m = Machine::load(std::shared_ptr<const CompiledProgram>(std::move(*made)));
  EXPECT_TRUE(m.ok()) << text;
  if (!m.ok()) return "";
  TestWorld w;
  const Status& s = run_to_end(*m, w, 100);
  return s.fault ? "!" : w.text;
}
std::string program(const std::string& variables, const std::string& expression) {
  // An assignment is "-> TYPE value".
  if (expression.starts_with("-> ")) {
    const std::size_t at = expression.find(' ', 3);
    return "PROGRAM p; VAR " + variables + " " + expression.substr(3, at - 3) +
           ": y; BEGIN y := " + expression.substr(at + 1) + "; WRITE(y); ENDPROGRAM;";
  }
  return "PROGRAM p; VAR " + variables + " BEGIN WRITE(" + expression + "); ENDPROGRAM;";
}
/// Whether what was written is what the table says.
bool agrees(const std::string& got, const std::string& want, bool is_folded) {
  switch (want[0]) {
    case '?': return got == "?";
    // Where all is known the compiler says it.
    case '!': return got == "!" || (is_folded && got == "?");
    case 'R': {
      char* end = nullptr;
      const double v = std::strtod(want.c_str() + 1, &end);
      const double tolerance = std::strtod(end, nullptr);
      char* rest = nullptr;
      const double x = std::strtod(got.c_str(), &rest);
      if (got.empty() || *rest != '\0' || got.find_first_of(".e") == std::string::npos)
        return false;
      return tolerance > 0 ? std::fabs(x - v) <= tolerance * std::max(1.0, std::fabs(v)) : x == v;
    }
    default: return got == want.substr(1);
  }
}

TEST(ProgramOperators, AreWhatTheirTableSays) {
  const std::string command =
      "/usr/bin/env python3 '" + std::string(ROBOMOSP_SOURCE_DIR) + "/tests/unit/irl_operators.py'";
  std::FILE* pipe = popen(command.c_str(), "r");
  ASSERT_NE(pipe, nullptr);
  std::string table;
  std::array<char, 65536> buffer{};
  while (const std::size_t n = fread(buffer.data(), 1, buffer.size(), pipe))
    table.append(buffer.data(), n);
  const int code = pclose(pipe);
  if (WEXITSTATUS(code) == 127) GTEST_SKIP() << "python3 is not here: install the package python3";
  ASSERT_EQ(code, 0);
  std::map<char, std::size_t> kinds;
  std::size_t rows = 0, wrong = 0;
  for (std::size_t at = 0; at < table.size(); ++rows) {
    const std::size_t end = table.find('\n', at);
    std::array<std::string, 4> field;
    for (std::size_t k = 0; k < 4; ++k) {
      const std::size_t stop = k == 3 ? end : table.find('\t', at);
      field[k] = table.substr(at, stop - at);
      at = stop + 1;
    }
    // What is known may convert where a variable does not: "with variables \x1f with values".
    const std::size_t two = field[3].find('\x1f');
    const std::string run = field[3].substr(0, two),
                      folded = two == std::string::npos ? run : field[3].substr(two + 1);
    ++kinds[run[0]];
    const std::string with_variables = program(field[0], field[1]),
                      with_values = program("INT: unused;", field[2]);
    const std::string got = outcome(with_variables), got_folded = outcome(with_values);
    const bool is_right = agrees(got, run, false),
               is_right_folded = agrees(got_folded, folded, true);
    wrong += !is_right + !is_right_folded;
    if (wrong > 40) break;
    EXPECT_TRUE(is_right) << with_variables << "\n" << got << " and not " << run;
    EXPECT_TRUE(is_right_folded) << with_values << "\n" << got_folded << " and not " << folded;
  }
  EXPECT_LE(wrong, 40U) << "and more";
  std::cout << rows << " rows:";
  for (const auto& [kind, n] : kinds) std::cout << " " << n << " " << kind;
  std::cout << "\n";
  EXPECT_GT(rows, 8000U);
  for (const char kind : std::string("IRBS!?")) EXPECT_GT(kinds[kind], 10U) << kind;
}

}  // namespace
}  // namespace robomosp::program
