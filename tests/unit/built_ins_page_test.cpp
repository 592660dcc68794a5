// SPDX-License-Identifier: Apache-2.0
// docs/user/irl/built_ins.md beside the compiler's own tables: every name of the language with its
// signature and its sentence, and every example compiled and, where it has a value, run.
#include <fstream>
#include <map>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "editing.h"
#include "intrinsics.h"
#include "support/program_world.h"

namespace robomosp::program {
namespace {

using namespace testing;

std::string built_ins_page() {
  std::ifstream in(std::string(ROBOMOSP_SOURCE_DIR) + "/docs/user/irl/built_ins.md");
  EXPECT_TRUE(in);
  return {std::istreambuf_iterator<char>(in), {}};
}

std::string without_blanks(std::string s) {
  while (!s.empty() && s.front() == ' ') s.erase(0, 1);
  while (!s.empty() && s.back() == ' ') s.pop_back();
  return s;
}

/// Rows of all tables of the page, cell by cell.
std::vector<std::vector<std::string>> table_rows(const std::string& text) {
  std::vector<std::vector<std::string>> out;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) {
    if (!line.starts_with("| ")) continue;
    std::vector<std::string> cells;
    std::istringstream of(line.substr(1));
    for (std::string cell; std::getline(of, cell, '|');) cells.push_back(without_blanks(cell));
    out.push_back(cells);
  }
  return out;
}

/// What stands between the first two backticks.
std::string in_ticks(const std::string& cell, std::size_t from = 0) {
  const std::size_t begin = cell.find('`', from);
  if (begin == std::string::npos) return {};
  const std::size_t end = cell.find('`', begin + 1);
  return cell.substr(begin + 1, end - begin - 1);
}

struct Signature {
  std::string name;
  std::vector<std::string> parameters;  ///< their types
  std::string result;                   ///< "" = none
};
Signature signature_of(const std::string& text) {
  Signature out;
  const std::size_t open = text.find('('), close = text.rfind(')');
  const bool has_parameters = open != std::string::npos && close != std::string::npos;
  const std::size_t colon = text.find(": ", has_parameters ? close : 0);
  out.name = text.substr(0, std::min(open, colon));
  if (colon != std::string::npos) out.result = text.substr(colon + 2);
  if (!has_parameters) return out;
  std::istringstream in(text.substr(open + 1, close - open - 1));
  for (std::string one; std::getline(in, one, ';');) {
    one = without_blanks(one);
    out.parameters.push_back(one.substr(0, one.find(": ")));
  }
  return out;
}

TEST(BuiltInsPage, HasEveryFunctionAndProcedureAsTheCompilerHasIt) {
  std::map<std::string, std::vector<std::string>> rows;
  for (const auto& cells : table_rows(built_ins_page()))
    if (cells.size() >= 4 && !in_ticks(cells[0]).empty())
      rows[signature_of(in_ticks(cells[0])).name] = cells;
  for (const irl::Intrinsic& f : irl::intrinsics()) {
    const auto row = rows.find(std::string(f.name));
    ASSERT_NE(row, rows.end()) << f.name << " is not on the page";
    const Signature s = signature_of(in_ticks(row->second[0]));
    std::vector<std::string> types;
    for (const char p : f.parameters) types.push_back(irl::Analysis::parameter_name(p));
    EXPECT_EQ(s.parameters, types) << f.name;
    EXPECT_EQ(s.result, f.result.empty() ? "" : irl::Analysis::parameter_name(f.result[0]))
        << f.name;
    EXPECT_EQ(row->second[1], f.doc) << f.name << ": the editor shows another sentence";
    rows.erase(row);
  }
  // Attributes, and then nothing that the language does not have.
  for (const irl::AttributeWord& a : irl::attribute_words()) {
    bool is_there = false;
    for (const auto& cells : table_rows(built_ins_page()))
      is_there =
          is_there || (cells.size() >= 2 && in_ticks(cells[0]) == a.detail && cells[1] == a.doc);
    EXPECT_TRUE(is_there) << a.detail << ": " << a.doc;
    rows.erase(signature_of(std::string(a.detail)).name);
    rows.erase(std::string(a.detail));
  }
  std::set<std::string> known;
  const auto code = compiled("PROGRAM p; BEGIN ENDPROGRAM;");
  for (std::uint32_t i = 0; i < code->code().symbols.count; ++i)
    known.insert(row<rmp_code_symbol>(code->code().symbols, i).name);
  for (const auto& [name, cells] : rows) EXPECT_TRUE(known.contains(name)) << name;
}

TEST(BuiltInsPage, HasEveryTypeConstantAndVariableThatProgramsBeginWith) {
  // Of each name the rest of its row, and where the row holds several, its place among them.
  std::map<std::string, std::pair<std::vector<std::string>, std::size_t>> rows;
  for (const auto& cells : table_rows(built_ins_page())) {
    std::size_t place = 0;
    for (std::size_t at = 0; (at = cells[0].find('`', at)) != std::string::npos;) {
      rows.insert({in_ticks(cells[0], at), {cells, place++}});
      at = cells[0].find('`', at + 1) + 1;
    }
  }
  const auto made = compiled("PROGRAM p; BEGIN ENDPROGRAM;");
  const rmp_code& c = made->code();
  std::size_t types = 0, constants = 0, variables = 0;
  for (std::uint32_t i = 0; i < c.symbols.count; ++i) {
    const auto& s = row<rmp_code_symbol>(c.symbols, i);
    if (s.scope == RMP_NONE) continue;
    const auto& scope = row<rmp_code_scope>(c.scopes, s.scope);
    if (scope.kind != RMP_SCOPE_PREDEFINED && scope.kind != RMP_SCOPE_SYSTEM) continue;
    const bool is_known =
        s.kind == RMP_SYMBOL_TYPE || s.kind == RMP_SYMBOL_CONSTANT || s.kind == RMP_SYMBOL_VARIABLE;
    if (!is_known) continue;
    const std::string name = s.name;
    const auto it = rows.find(name);
    ASSERT_NE(it, rows.end()) << name << " is not on the page";
    types += s.kind == RMP_SYMBOL_TYPE;
    variables += s.kind == RMP_SYMBOL_VARIABLE;
    if (s.kind == RMP_SYMBOL_TYPE) {
      const auto& t = row<rmp_code_type>(c.types, s.type);
      for (std::uint32_t k = 0; t.kind == RMP_TYPE_RECORD && k < t.field_count; ++k)
        EXPECT_NE(it->second.first[1].find(row<rmp_code_field>(c.fields, t.first_field + k).name),
                  std::string::npos)
            << name;
    }
    if (s.kind == RMP_SYMBOL_VARIABLE) {
      const bool is_bool = row<rmp_code_type>(c.types, s.type).kind == RMP_TYPE_BOOL;
      EXPECT_EQ(it->second.first[1], is_bool ? "BOOL" : "REAL") << name;
    }
    if (s.kind == RMP_SYMBOL_CONSTANT && s.type == RMP_TYPE_INT && s.constant != RMP_NONE) {
      ++constants;
      std::istringstream in(it->second.first[1]);
      std::string value;
      for (std::size_t k = 0; k <= it->second.second; ++k) std::getline(in, value, ',');
      EXPECT_EQ(without_blanks(value),
                std::to_string(row<rmp_code_constant>(c.constants, s.constant).integer))
          << name;
    }
  }
  EXPECT_GE(types, 15U);
  EXPECT_GE(constants, 15U);
  EXPECT_GE(variables, 15U);
}

TEST(BuiltInsPage, EveryExampleCompilesAndGivesWhatThePageSays) {
  const std::string text = built_ins_page();
  const std::string mark = "```irl\n";
  const std::size_t begin = text.find(mark) + mark.size();
  const std::string head = text.substr(begin, text.find("```", begin) - begin);
  std::size_t run = 0, with_values = 0;
  for (const auto& cells : table_rows(text)) {
    if (cells.size() < 4 || cells[0] == "signature") continue;
    const std::string example = in_ticks(cells[3]);
    const std::size_t arrow = cells[3].find("→");
    const std::string name = signature_of(in_ticks(cells[0])).name;
    bool is_function = false;
    for (const irl::Intrinsic& f : irl::intrinsics()) is_function = is_function || f.name == name;
    if (!is_function) continue;  // an attribute
    ASSERT_FALSE(example.empty()) << name << " has no example";
    EXPECT_NE(example.find(name), std::string::npos) << example;
    const bool is_statement = example.ends_with(";");
    const std::string program =
        head + (is_statement ? example : "WRITE(" + example + ");") + "\nENDPROGRAM;\n";
    ++run;
    const auto code = compiled(program);
    if (arrow == std::string::npos) {
      EXPECT_TRUE(Machine::load(code).ok()) << program;
      continue;
    }
    ++with_values;
    auto m = Machine::load(code);
    ASSERT_TRUE(m.ok()) << program << m.error().sentence();
    TestWorld w;
    const Status& s = run_to_end(*m, w, 100);
    EXPECT_EQ(w.text + (s.fault ? "!" + s.fault->message : ""), in_ticks(cells[3], arrow))
        << program;
  }
  EXPECT_EQ(run, irl::intrinsics().size());
  EXPECT_GT(with_values, 50U);
}

}  // namespace
}  // namespace robomosp::program
